// The two messages between the loops, and what the simulation shows to the rest of the program.
//
//   SimulationLoop ── TissuePatch ──▶ HapticLoop          (latest value; see latest_value.h)
//   HapticLoop     ── NeedleState ──▶ SimulationLoop, recorder, renderer
//   SimulationLoop ── TissueState ──▶ state buffer
//
// Every array is sized once, by the constructors here or by reserve_for(); the real-time side only writes within
// capacity. All positions are in the patient frame, metres; forces in newtons.
#pragma once

#include "physics/messages/material.h"
#include "physics/messages/surface_patch.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stylet::physics {

static_assert(EIGEN_MAX_ALIGN_BYTES == 32 && EIGEN_MAX_STATIC_ALIGN_BYTES == 32,
              "another layout than the library's: link Stylet::physics, which defines both");

inline constexpr int kMaxBodies = 4;
inline constexpr int kMaxCavities = 8;   ///< full of fluid, of all bodies
inline constexpr int kMaxContacts = 96;  ///< contact points of one haptic solve
inline constexpr int kMaxRows = 248;     ///< constraint rows in it: four of a point on the shaft, three of the tip
inline constexpr int kMaxBeams = 64;
inline constexpr int kMaxNeedleNodes = kMaxBeams + 1;
inline constexpr int kMaxPatchNodes = 256;                                            ///< isolated nodes of one body
inline constexpr std::size_t kMaxWBarValues = 9UL * kMaxPatchNodes * kMaxPatchNodes;  ///< (3 kMaxPatchNodes)^2
inline constexpr std::size_t kMaxContactValues =
    9UL * kMaxContacts * (kMaxContacts + 1) / 2;  ///< of pairs of contacts
inline constexpr int kMaxPatchTets = 1024;        ///< tetrahedra of one patch
inline constexpr int kBeyondSurface = -1;         ///< no tetrahedron there: the body ends
inline constexpr int kBeyondPatch = -2;           ///< a tetrahedron that is not in the patch
inline constexpr int kMaxContactNodes = 192;      ///< of one body, in contact with others, with known compliance
inline constexpr int kMaxOrganRows = 64;  ///< contacts between bodies, and of the probe, that the haptic loop follows

/// Pose of the needle's hub as asked for by the stylus: position of the hub, rotation needle frame -> patient frame
/// (needle +Z from hub to tip, +X the bevel normal).
struct StylusPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

/// Pose of a rigid body (the probe): patient_from_body.
struct RigidPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

/// Force and moment about the hub, patient frame. N, N m.
struct Wrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
};

/// A contact point as the simulation loop lays it: a material point of the tissue that the needle passes through.
struct PatchContact {
  std::uint32_t id = 0;                                     ///< stable over the life of the contact
  int tet = -1;                                             ///< tetrahedron of the body
  std::array<int, 4> patch_nodes{};                         ///< its nodes, as indices into BodyPatch::node_ids
  Eigen::Vector4d barycentric = Eigen::Vector4d::Zero();    ///< weights of those nodes, sum 1
  Eigen::Vector3d free_position = Eigen::Vector3d::Zero();  ///< all needle force removed, m; see BodyPatch::condense
  // The linearisation by the simulation loop (coupling `paper-frozen`): where on the needle, and the two directions.
  int beam = 0;              ///< beam that carries the point
  double beam_fraction = 0;  ///< 0 at the beam's first node, 1 at its second
  Eigen::Matrix<double, 3, 2> directions = Eigen::Matrix<double, 3, 2>::Zero();
  // A point of bone that the tip stands on (coupling `stylet`): it follows the tissue around it as that is without
  // needle force, and no needle force moves it.
  bool rigid = false;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< from that tissue, m
  // A point that the patch in use lacks (coupling `stylet`): it stays where free_position says, with the compliance
  // that it had. Its patch_nodes are -1 where the patch lacks them.
  bool kept = false;
  std::array<int, 4> nodes{-1, -1, -1, -1};  ///< ids in the body, as patch_nodes
};

/// One body's share of a TissuePatch.
struct BodyPatch {
  BodyPatch();

  int node_count = 0;
  /// [node_count] ascending, capacity kMaxPatchNodes: isolated nodes; and those far ahead of the needle whose
  /// compliance is not known, zero in W_bar: held where they are.
  std::vector<int> node_ids;
  Eigen::Matrix3Xd free_positions;             ///< [3 x node_count] all needle force removed, linearised at the
                                               ///< current state, m
  Eigen::Matrix3Xd rest_positions;             ///< [3 x node_count] m
  std::vector<NodeSurroundings> surroundings;  ///< [node_count]
  /// W_bar [3 node_count x 3 node_count], the compliance of the isolated DOFs, symmetric positive definite, m/N; by
  /// blocks of two nodes without gaps, because that is how the haptic side reads it, all over the place: a block is
  /// then one or two cache lines, not three. Sized to (3 kMaxPatchNodes)^2 for the bodies in use, at load.
  std::vector<double> w_bar_values;
  auto w_bar(int i, int j) { return Eigen::Map<Eigen::Matrix3d>(w_bar_values.data() + block_start(i, j)); }
  auto w_bar(int i, int j) const {
    return Eigen::Map<const Eigen::Matrix3d>(w_bar_values.data() + block_start(i, j));
  }
  /// All of it as a matrix, and from one: for tests and experiments, they allocate.
  Eigen::MatrixXd w_bar() const;
  void set_w_bar(const Eigen::MatrixXd& w);

  /// Of a contact of this body, all needle force removed, m: B x_free.
  Eigen::Vector3d free_position(const PatchContact& contact) const;
  /// Displacement of contact i per force on contact j, both of this body, m/N: B_i W_bar B_j^T.
  Eigen::Matrix3d compliance(const PatchContact& i, const PatchContact& j) const;

  SurfacePatch surface;  ///< all of the body's, coupling `stylet` only

  int contact_count = 0;
  std::vector<PatchContact> contacts;  ///< [contact_count] from entry to tip
  /// compliance() of every pair of them: all that a loop which takes them as they are reads of W_bar. Blocks i <= j;
  /// sized as w_bar_values is.
  std::vector<double> contact_values;
  auto contact_compliance(int i, int j) {
    return Eigen::Map<Eigen::Matrix3d>(contact_values.data() + contact_block_start(i, j));
  }
  auto contact_compliance(int i, int j) const {
    return Eigen::Map<const Eigen::Matrix3d>(contact_values.data() + contact_block_start(i, j));
  }
  /// Fills it and the contacts' free positions.
  void condense();

  int tet_count = 0;
  std::vector<int> tet_ids;  ///< [tet_count] tetrahedra whose four nodes are all in node_ids, ascending
  std::vector<std::array<int, 4>> tet_nodes;  ///< [tet_count] as indices into node_ids
  /// [tet_count] tetrahedron beyond the face opposite each node, as indices into tet_ids, kBeyondSurface or
  /// kBeyondPatch.
  std::vector<std::array<int, 4>> tet_neighbours;

private:
  std::ptrdiff_t block_start(int i, int j) const { return 9 * (i + static_cast<std::ptrdiff_t>(node_count) * j); }
  static std::ptrdiff_t contact_block_start(int i, int j) {
    return 9 * (i + static_cast<std::ptrdiff_t>(j) * (j + 1) / 2);
  }
};

/// Contacts between the bodies, and of the probe, as they go on between two simulation steps (README eq. 31b):
///   u = gap + W (lambda - lambda_0) + Y^T f >= 0,  lambda >= 0,  one of the two zero
/// for forces f of the needle on the isolated nodes, which then are at p_free + W_bar f + Y (lambda - lambda_0).
struct OrganRows {
  int count = 0;
  std::array<std::uint64_t, kMaxOrganRows> ids{};  ///< [count] stable over the life of a contact
  Eigen::VectorXd gap;     ///< [count] of p_free, with the yield of the layer between under lambda_0, m
  Eigen::VectorXd lambda;  ///< [count] lambda_0: the forces that p_free has, N
  Eigen::MatrixXd w;       ///< [count x count] W: opening of a gap per force of another, symmetric, m/N
  std::array<Eigen::MatrixXd, kMaxBodies> y;  ///< [count x 3 node_count] Y^T of the body's isolated nodes, m/N
  /// Takes the memory for the first `body_count` bodies.
  void reserve(int body_count);
};

/// Simulation -> haptic: everything of the tissue that the haptic loop needs for a step.
struct TissuePatch {
  std::uint64_t step = 0;          ///< simulation step that made it
  std::uint64_t epoch = 0;         ///< counts published patches, from 1; 0 is "no tissue yet"
  std::uint64_t factor_epoch = 0;  ///< factorisation W_bar comes from
  std::uint64_t needle_step = 0;   ///< haptic step whose NeedleState was consumed
  double time_s = 0;
  std::uint32_t flags = 0;  ///< PatchFlag bits
  int body_count = 0;
  std::array<BodyPatch, kMaxBodies> bodies;
  OrganRows organs;
};

enum PatchFlag : std::uint32_t {
  kPatchContactOverflow = 1u << 0,  ///< contacts beyond capacity were merged into the last one
  kPatchNodeOverflow = 1u << 1,     ///< isolated nodes beyond capacity: the oldest contacts were dropped
  kPatchTetOverflow = 1u << 2,      ///< tetrahedra beyond capacity were left out
};

/// Where the tip is. Indenting: it presses on a surface that it has not broken through.
enum class TipState : std::uint8_t { outside, indenting, inside };

/// The needle breaks through a surface.
struct Puncture {
  std::uint64_t step = 0;  ///< haptic step
  int body = -1;
  int from = 0;       ///< tissue left, index into the TissueMap
  int to = 0;         ///< tissue entered
  double force = 0;   ///< on the tip, along the shaft, N
  double energy = 0;  ///< elastic, released by it, J: physics/README.md eq. 25b
};

/// What the needle and the tissue beside it have suffered since the start; never falls, but for `bend`, which a
/// needle that is straightened loses again. physics/README.md eq. 37, 38.
struct NeedleDamage {
  double bend = 0;       ///< of the needle for good, sum over its beams, rad
  double bend_work = 0;  ///< that went into its steel, J
  double side_cut = 0;   ///< of tissue by the side of the shaft, m^2
  double side_work = 0;  ///< that this took, J
};

/// A contact as the haptic loop solved it.
struct NeedleContact {
  std::uint32_t id = 0;
  int body = -1;
  int tet = -1;
  Eigen::Vector4d barycentric = Eigen::Vector4d::Zero();
  int beam = 0;
  double beam_fraction = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the tissue point after the solve
  Eigen::Vector3d force = Eigen::Vector3d::Zero();     ///< on the tissue, N
  bool cuts = false;  ///< sideways: the point may go on into a tetrahedron beside its own
};

/// Force on one isolated node. Forces, not multipliers: they survive a change of directions.
struct NodeForce {
  int body = -1;
  int node = -1;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
};

enum NeedleFlag : std::uint32_t {
  kNeedleBaseLimited = 1u << 0,    ///< the base motion of this step was limited to what one Newton step allows
  kNeedleRowOverflow = 1u << 1,    ///< more rows than capacity: the shallowest contacts were left out
  kNeedleSolveFailed = 1u << 2,    ///< a factorisation failed (not SPD); the previous contact forces were kept
  kNeedleNonFinite = 1u << 3,      ///< a non-finite input was refused; the previous state was kept
  kNeedleStepShortened = 1u << 4,  ///< the Newton step turned a node too far and was shortened; the next ones go on.
                                   ///< Not said of a needle that springs back, held by its tip alone
  kNeedlePatchLeft = 1u << 6,      ///< track or tip are beyond the patch: the tissue there is not known yet
  kNeedleSolveInexact = 1u << 7,   ///< the bounded solver used its fall-back
  kNeedleBoundsLagged = 1u << 8,  ///< solved exactly, but for friction bounds of the step before: they did not settle
  kNeedleSurfaceLate = 1u << 9,   ///< the tip is deep in a body whose surface it has not felt: the track is behind
  kNeedleRowsDependent = 1u << 5,  ///< contacts too dense for mesh or beams; their rows were softened, README eq. 18
};

/// Haptic -> simulation, renderer, recorder.
struct NeedleState {
  NeedleState();

  std::uint64_t step = 0;
  std::uint64_t patch_epoch = 0;  ///< TissuePatch consumed
  double time_s = 0;
  std::uint32_t flags = 0;  ///< NeedleFlag bits
  int node_count = 0;
  Eigen::Matrix3Xd positions;                    ///< [3 x node_count] hub first, tip last
  std::vector<Eigen::Quaterniond> orientations;  ///< [node_count] node frame -> patient frame
  TipState tip = TipState::outside;
  int tip_body = -1;     ///< body the tip is in, -1 outside
  double tip_depth = 0;  ///< arc length of needle inside tip_body, m
  int contact_count = 0;
  std::vector<NeedleContact> contacts;  ///< [contact_count] in touch, then up to track_count  capacity kMaxContacts
  int track_count = 0;                  ///< contacts, then points of the track that the needle is withdrawn from
  std::uint32_t puncture_count = 0;     ///< since the start
  Puncture last_puncture;
  int force_count = 0;
  /// [force_count] by body then node id, those of nodes that the patch lacks last of their body; capacity
  /// kMaxBodies * kMaxPatchNodes
  std::vector<NodeForce> forces;
  Wrench wrench;         ///< given to the device: what the hand feels, about the hub
  double hand_work = 0;  ///< of the hand on the needle since the start, J: tells whether energy was made
  NeedleDamage damage;
};

/// Copies the active part of a state into one of the same capacity.
/// @realtime no allocation
void copy_state(const NeedleState& from, NeedleState& to);

/// Simulation -> pictures: the whole tissue.
struct TissueState {
  std::uint64_t step = 0;
  std::uint64_t needle_step = 0;
  double time_s = 0;
  int body_count = 0;
  std::array<Eigen::Matrix3Xd, kMaxBodies> positions;  ///< [3 x nodes of the body]
};

/// The shortest rotation that takes the direction of `from` to that of `to`; half a turn about any axis across where
/// they are opposite. Not Quaterniond::FromTwoVectors, which brings a singular value decomposition to every file.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace stylet::physics

// Contact between deformable bodies, and of the probe with one of them, at the low rate: unilateral; bodies slide on
// each other, under the probe there is friction.
//
// Part of the simulation's quasi-Newton step (physics/README.md eq. 6-8, 30-33). Each row i has a gap g_i(p), a
// normal n_i and a multiplier lambda_i >= 0, the force along n_i. At rest, whatever S and the factor:
//   F_int(p) = H^T lambda + needle,   g_i + c_i lambda_i >= 0,   lambda_i >= 0,   one of the two zero
// One update a step moves the multipliers as if the bodies were S, their compliance at rest:
//   find lambda+ >= 0 with  g + c lambda+ + H S (H^T lambda+ - f) + e (lambda+ - lambda) >= 0, complementary   (eq.
//   31)
// f being the forces of the update before, along the normals of then. That needs no solve with the current factor:
// the bodies follow in the step's own solve. S and the proximal term e set only the speed. Since e > 0, dependent
// rows (more contacts than nodes) do no harm. A point under the probe also has a force t across the normal, in the
// same update:
//   |t| <= mu lambda;  s + c_t t = 0 where it sticks, s its motion on the face since it was anchored there   (eq. 33)
#pragma once

#include "physics/contact/body_surface.h"
#include "physics/contact/probe_shape.h"
#include "physics/contact/surface_compliance.h"
#include "physics/messages/messages.h"
#include "physics/tissue/companion.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace stylet::physics {

/// Which nodes may not pass which surface. Best the body with the finer mesh gives the nodes.
struct ContactPair {
  int nodes_of = 0;    ///< body
  int surface_of = 0;  ///< another body
};

/// The probe and the body it is pressed on.
struct ProbeContactSettings {
  ProbeShape shape{};
  int body = 0;
  double point_spacing = 0.005;      ///< of the material points on the body's faces that feel the probe, at rest, m
  double layer_compliance = 5e-8;    ///< yield of skin surface and gel at first: m per Pa of pressure
  double layer_thickness = 0.005;    ///< the most it yields under any pressure (eq. 30), m
  double friction = 0;               ///< Coulomb, of the head on the skin
  double shear_compliance = 1.5e-7;  ///< yield of the same layer sideways (an incompressible one: 3 times): m per Pa
  double grip_force = 40;            ///< along the axis, at which the hand has given way by grip_yield (eq. 33c), N
  double grip_yield = 0.005;         ///< m
  int max_points = 160;
  /// Middle of the head's face when it is held as planned, patient frame, m: see OrganContact.
  std::optional<Eigen::Vector3d> held_at{};
};

struct OrganContactSettings {
  std::vector<ContactPair> pairs;
  int max_points = 64;    ///< of a pair: those with the smallest gaps count
  double reach = 0.002;   ///< nodes further than this from the other surface have no row, m
  double search = 0.015;  ///< how deep below a surface a node is still found, m
  /// The haptic loop follows the contacts that the needle moves (eq. 31b); else their forces are constant between
  /// two steps, as in the couplings of the paper.
  bool at_haptic_rate = true;
  int learn_limit = 12;  ///< nodes of a body whose compliance one step may compute (three solves each)
  /// Of a body of at least so many, where such a solve takes a good part of a step, it is computed beforehand where
  /// that can be foreseen.
  int large_dofs = 15000;
  std::optional<ProbeContactSettings> probe{};
};

/// One point of contact: force weight * force() on each node.
struct SurfaceRow {
  struct Support {
    int body = -1;
    int node = -1;
    double weight = 0;
  };
  std::array<Support, 4> supports;  ///< one node against three, or three against the probe
  int support_count = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the point, patient frame, m
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   ///< gradient of the gap; unit but under the probe's rims
  double gap = 0;                                      ///< negative: overlap, m
  double compliance = 0;                               ///< c: of the layer between, m/N
  double area = 0;                                     ///< that the point stands for, m^2
  double lambda = 0;                                   ///< force over the length of the normal, N
  int pair = -1;                                       ///< index of the ContactPair, -1: probe
  std::size_t slot = 0;                                ///< of its multiplier between steps

  // Friction, where the point may have any (limit > 0).
  std::array<Eigen::Vector3d, 2> across{};               ///< unit, normal to each other and to the normal
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();      ///< s, along `across`, m
  Eigen::Vector2d tangential = Eigen::Vector2d::Zero();  ///< t, along `across`, N
  double shear_compliance = 0;                           ///< c_t, m/N
  double limit = 0;                                      ///< mu times the normal force of the step before, N
  int first = 0;                                         ///< of its unknowns: lambda, then t
  int unknowns() const { return limit > 0 ? 3 : 1; }
  Eigen::Vector3d force() const {
    Eigen::Vector3d f = lambda * normal;
    if (limit > 0) f += tangential[0] * across[0] + tangential[1] * across[1];
    return f;
  }
};

/// What the probe does to the patient, and feels.
struct ProbeContact {
  int points = 0;        ///< that carry force
  double area = 0;       ///< skin they stand for, m^2
  double depth = 0;      ///< largest overlap of head and undeformed layer, m
  int sliding = 0;       ///< points whose friction is at its limit
  Wrench wrench;         ///< on the probe, about the centre of its face
  double gap = 0;        ///< to the nearest point of the skin where none carries force, at most the reach; else 0, m
  bool near = false;     ///< there is skin in reach
  double stiffness = 0;  ///< of the force along the head's axis per motion along it (README eq. 33b), N/m
  double yielded = 0;    ///< how far the head is behind where the hand would have it, along its axis (eq. 33c), m
};

/// Of the last update().
struct OrganContactReport {
  int rows = 0;          ///< within reach
  int pressing = 0;      ///< with force
  int left_out = 0;      ///< points in reach beyond the capacities
  double force_n = 0;    ///< sum of the normal forces between bodies, N
  double deepest = 0;    ///< largest overlap of two bodies, rest overlap excepted, m
  double violation = 0;  ///< largest |min(g + c lambda, S_ii lambda)|: how far from complementarity, m; of friction,
                         ///< how far the point is from where its force would be right
};

class OrganContact {
public:
  /// Rest overlap of the meshes is taken as contact without force: the node keeps it as its zero.
  /// @param models  outlive this
  /// @param rest    factors of the bodies at rest
  /// Of large bodies the compliance is learnt here (eq. 31): it takes seconds, with the companion half as long.
  /// @throws std::invalid_argument if a pair or the probe names a body that does not exist, or a body twice
  OrganContact(std::span<const TissueModel> models, std::span<const Factorisation* const> rest,
               OrganContactSettings settings, Companion* companion = nullptr);

  /// Where a body is now: all of them, before each update(). Threads may do so for different bodies.
  /// @param positions  [3 x nodes] after the motion correction, m; they stay there until the next call
  void follow(int body, const Eigen::Matrix3Xd& positions, Companion* companion = nullptr);
  /// New rows and multipliers for these positions. Never throws.
  /// @param probe  null: none
  void update(const RigidPose* probe, SolveWorkspace& workspace);

  /// Other multipliers for some rows of the last update: what the bodies answered to the needle since.
  /// @param rows    indices into rows()
  /// @param lambda  of them, N
  void take(std::span<const int> rows, Eigen::Ref<const Eigen::VectorXd> lambda);
  /// Free nodes of a body that have a row, those under force first.
  /// @return how many of them are under force
  std::size_t nodes(int body, std::vector<int>& out) const;

  /// Adds H^T lambda of the last update.
  /// @param forces  [free DOFs of the body], N
  void add_forces(int body, Eigen::VectorXd& forces) const;

  std::span<const SurfaceRow> rows() const { return rows_; }
  const OrganContactReport& report() const { return report_; }
  const ProbeContact& probe() const { return probe_; }

private:
  struct Body {
    const TissueModel* model = nullptr;
    std::unique_ptr<BodySurface> surface;
    std::unique_ptr<SurfaceCompliance> compliance;
    std::vector<int> touched;                     // nodes of the rows, those under force first
    std::vector<int> loaded;                      // nodes that the last update put a force on
    Eigen::Matrix3Xd force;                       // [3 x nodes] that force, zero elsewhere, N
    Eigen::Matrix3Xd motion;                      // [3 x nodes] scratch: foreseen, of the touched nodes, m
    const Eigen::Matrix3Xd* positions = nullptr;  // of the last follow()
  };
  /// What a node has last seen of the other surface.
  struct Sight {
    int near = -1;     // the nearest face
    double clear = 0;  // how far the two bodies may go, together, before the node can have a row, m
  };
  /// A node's state between steps.
  struct NodeContact {
    double lambda = 0;
    double rest_overlap = 0;  // <= 0
    Sight sight;
    double clear_until = 0;  // of the travel of both bodies
  };
  struct ProbePoint {
    int face = -1;
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();
    double area = 0;  // rest, m^2
    double lambda = 0;
    Eigen::Vector3d friction = Eigen::Vector3d::Zero();  // on the skin, probe frame, N
    Eigen::Vector3d anchor = Eigen::Vector3d::Zero();    // where it sticks, probe frame; while lambda > 0
    ProbeSide side = ProbeSide::none;                    // of the head it came in through; none: outside
    ProbeSide side_before = ProbeSide::none;             // in the update before
  };

  // The stages of update(), in order.
  void find_pair(int pair, Companion* companion);
  void find_probe(const RigidPose& pose, Companion* companion);
  /// The row of a point of the skin that touches the probe, or false; what side it is inside of is kept with it.
  bool meets_probe(ProbePoint& point, const RigidPose& pose, const Eigen::Matrix3d& world_from_probe,
                   SurfaceRow& row);
  /// Into rows_, those with the smallest gaps if there are more than `most`.
  void take_deepest(std::vector<SurfaceRow>& found, int most);
  void learn(int limit, SolveWorkspace& workspace);
  bool is_large(const Body& body) const;
  /// Of large bodies all that touches at rest, and what lies near small ones and around where the probe will be held.
  void learn_beforehand(Companion* companion);
  void assemble(Companion* companion);
  void foresee_turn();
  void relax();
  void keep(const RigidPose* probe);
  void sum_up(const RigidPose* probe);
  /// Gap and stiffness of probe_.
  void feel(const RigidPose& probe);
  /// Of rows_, node by node, into the bodies' force.
  void collect_forces();
  void remember(const RigidPose* probe);

  /// Where a point of the skin was in the update before, in the probe frame of then; else where it is.
  Eigen::Vector3d before(const ProbePoint& point, const Eigen::Vector3d& in_probe) const;
  /// s, t and their limit, from what the point keeps in the probe's frame; where it slides its anchor follows.
  void hold(SurfaceRow& row, ProbePoint& point, const Eigen::Vector3d& in_probe,
            const Eigen::Matrix3d& world_from_probe);
  /// The row of a node against a surface as both are now, without its overlap at rest; support_count = 0: none.
  SurfaceRow face_to_face(int pair, int node, bool pressed, Sight& sight) const;
  bool movable(const SurfaceRow& row) const;

  OrganContactSettings settings_;
  std::vector<Body> bodies_;
  std::vector<std::vector<NodeContact>> nodes_;  // [pairs] [nodes of the pair's body]
  std::size_t updates_ = 0;
  std::vector<ProbePoint> points_;           // face by face
  std::vector<std::size_t> inside_;          // of points_: those in the head
  std::vector<std::size_t> inside_before_;   // in the update before
  std::vector<std::size_t> pressed_points_;  // those of the last rows
  Eigen::Matrix3Xd positions_before_;        // [3 x nodes] of the probe's body in the update before
  std::optional<RigidPose> pose_before_;     // of the probe; nullopt: it was not there
  std::size_t points_a_face_ = 0;
  std::vector<SurfaceRow> rows_;
  std::vector<int> faces_;     // scratch
  Eigen::Index unknowns_ = 0;  // of rows_
  Eigen::MatrixXd w_;          // [unknowns x unknowns] H S H^T + c + e
  Eigen::VectorXd slack_;      // left side of eq. 31 and 33
  std::vector<int> pressed_;   // scratch: unknowns of the rows that press on the probe
  OrganContactReport report_;
  ProbeContact probe_;
};

}  // namespace stylet::physics

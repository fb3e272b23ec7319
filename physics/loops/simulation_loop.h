// The low-rate loop (25-100 Hz): owns the tissue, takes the needle's forces, publishes a TissuePatch.
//
// Frame: patient frame, metres, newtons. physics/README.md eq. 5-8; paper III, Fig. 1.
//
//   SimulationLoop loop(bodies, settings);
//   TissuePatch patch = loop.make_patch();              // also the initial value of a LatestValue<TissuePatch>
//   loop.step({.needle = &needle_state, .time_s = t}, patch);
//   loop.worker().step();                               // in its own thread, or at fixed times in lockstep
#pragma once

#include "physics/contact/insertion_path.h"
#include "physics/contact/organ_contact.h"
#include "physics/contact/probe_grip.h"
#include "physics/loops/organ_response.h"
#include "physics/messages/messages.h"
#include "physics/tissue/cavity.h"
#include "physics/tissue/companion.h"
#include "physics/tissue/corotational.h"
#include "physics/tissue/factorisation_worker.h"
#include "physics/tissue/strain_memory.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace stylet::physics {

/// A body to simulate.
struct SimulationBody {
  TetMesh mesh;
  std::vector<ElasticMaterial> tet_materials;  ///< one a tetrahedron
  std::vector<int> fixed_nodes;                ///< ascending; at least three that are not on one line
  double damping_time_s = 0;                   ///< Kelvin-Voigt B = damping_time K; 0: quasi-static, the rates agree
  /// Displacement of each fixed node when SimulationInput::held_amplitude is 1, m; empty: they stay at rest.
  std::vector<Eigen::Vector3d> held_motion{};
  Eigen::Matrix3Xd load{};                   ///< [3 x nodes] constant forces, weight; N. Empty: none
  std::vector<std::vector<int>> cavities{};  ///< tetrahedra of each cavity full of fluid
  Element element = Element::linear;         ///< quadratic: a run of eight tetrahedra is one (refinement.h)
  double capsule = 0;  ///< Young's modulus times thickness of a membrane over the whole surface, N/m; 0: none
};

struct SimulationLoopSettings {
  double dt = 0.020;                 ///< period of the loop, s
  double contact_spacing = 0.010;    ///< between contact points along the path, m
  double removal_hysteresis = 2e-4;  ///< how far the tip withdraws past a contact before it is removed, m
  /// The paper's couplings: contacts are laid here. Else (`stylet`) the haptic loop lays them, and a patch holds the
  /// nodes around the needle's track and `patch_range` ahead of its tip.
  bool lay_contacts = true;
  double patch_range = 0.012;    ///< m; more for a needle that is fast, see foresight()
  double fastest_tip = 1.0;      ///< that tissue is known for ahead of the tip, m/s; its compliance: up to look_ahead
  double longest_stall = 0.060;  ///< that a step may be late by beside its period, s
  double look_ahead = 0.040;     ///< how far ahead of the tip nodes are prepared with a factorisation, m
  bool two_threads = true;  ///< second ones take part in long steps and factorizations; the bits do not know of them
  /// Of what a step reads L in: not what it converges to.
  PassPrecision coarsest = PassPrecision::twelve_bits;
  OrganContactSettings contact{};  ///< between the bodies, and of the probe; none: no pairs, no probe
};

/// What a step consumes. The flags are true in live mode ("if there is one", "if the worker is free"); a replay sets
/// them to what the recorded SimulationReport says.
struct SimulationInput {
  const NeedleState* needle = nullptr;  ///< latest needle; null or node_count < 2: no needle
  double time_s = 0;
  bool take_factorisation = true;
  bool request_factorisation = true;
  /// Rad. A factorisation is requested only where a tetrahedron has turned by more than this since the one in use, or
  /// nodes that it must have are not among its trailing ones. 0, and in a replay: whatever has moved.
  double stale_turn = 0;
  const RigidPose* probe = nullptr;  ///< patient_from_probe; null: not there
  double held_amplitude = 0;         ///< of SimulationBody::held_motion: breathing. Moves what is held at once
  /// Volume wanted of each cavity over that when full, bodies in order; 1: full. Empty: all full. See Cavity::fill.
  std::span<const double> cavity_shares{};
};

enum SimulationFlag : std::uint32_t {
  kSimulationInverted = 1u << 0,             ///< tetrahedra are inverted (their forces push back)
  kSimulationStepLimited = 1u << 1,          ///< the motion correction was shortened, see README eq. 6
  kSimulationNonFinite = 1u << 2,            ///< a non-finite input or state was refused; the previous one was kept
  kSimulationFactorisationFailed = 1u << 3,  ///< a factorisation was not positive definite; the previous one was kept
};

struct SimulationReport {
  std::uint64_t step = 0;                ///< counts from 1
  std::uint64_t needle_step = 0;         ///< of the NeedleState consumed
  std::uint64_t factor_epoch = 0;        ///< simulation step whose matrix the factor in use comes from; 0: rest
  bool factorisation_taken = false;      ///< a new factor was swapped in by this step
  bool factorisation_requested = false;  ///< this step asked the worker for one
  std::uint32_t flags = 0;               ///< SimulationFlag bits; PatchFlag bits are in the patch
  int contact_count = 0;
  int isolated_nodes = 0;
  int new_isolated_nodes = 0;  ///< whose columns of W_bar this step had to compute
  int inverted_tets = 0;
  double residual_n = 0;      ///< |F_int(p) - H^T lambda - contact| over the free DOFs at the published state, N
  double force_n = 0;         ///< |H^T lambda|, N
  OrganContactReport organs;  ///< contact between bodies
  ProbeContact probe;         ///< what the probe feels, and the skin it touches
  int cavity_count = 0;
  std::array<CavityState, kMaxCavities> cavities{};  ///< [cavity_count] bodies in order
};

/// Deterministic: the same inputs (and worker().step() between the same steps) give the same bits.
/// A thread of its own, with the scheduling of who constructs it, sleeps between the steps and takes part in those of
/// large bodies where a core is free. Another one, niced, does so in the factorizations of large bodies.
/// One thread calls step(); worker().step() may run in another. Not movable: the worker refers to the models.
class SimulationLoop {
public:
  /// Factorises the bodies at rest (epoch 0), so it takes a moment.
  /// @throws std::invalid_argument if a body is malformed or not held; there are 1..kMaxBodies bodies
  SimulationLoop(std::vector<SimulationBody> bodies, const SimulationLoopSettings& settings);
  SimulationLoop(const SimulationLoop&) = delete;
  SimulationLoop& operator=(const SimulationLoop&) = delete;

  /// One simulation step (never throws): correction by the needle's forces, factor swap, free motion, contacts,
  /// isolated DOFs, patch. `out` is filled whole; publish it.
  SimulationReport step(const SimulationInput& input, TissuePatch& out);

  /// So many steps without a needle and with the factor at rest, which do not count: the next one is the first.
  /// Before the session, on any thread.
  void settle(SimulationInput input, int steps);

  /// A patch with arrays sized for these bodies, epoch 0 ("no tissue yet").
  TissuePatch make_patch() const;
  /// State after the last step (rest before the first): what the pictures show.
  const TissueState& tissue() const { return tissue_; }
  FactorisationWorker& worker() { return worker_; }
  int body_count() const { return static_cast<int>(models_.size()); }
  const TissueModel& model(int body) const { return models_[body]; }
  /// Contact rows of the last step.
  std::span<const SurfaceRow> contact_rows() const {
    return contact_ ? contact_->rows() : std::span<const SurfaceRow>();
  }

private:
  /// What a thread needs that has a body in work.
  struct Side {
    SolveWorkspace workspace;
    ElementScratch elements;
  };
  /// work(body, side) for each body, apart from each other: which thread has which must not matter.
  template <typename Work>
  void for_bodies(const Work& work);

  // The stages of step(), in order.
  const NeedleState* accept(const NeedleState* needle, SimulationReport& report);
  void respond_organs();
  void watch_speed(const NeedleState& needle);
  /// Until when a patch made now may be all that the haptic loop has, from its last one on, s.
  double foresight(const NeedleState& needle) const;
  void move_held(double amplitude, SimulationReport& report);
  /// @param shown  see respond(); what fades of the stress does so for a period, too, where the tissue then is
  ///               (eq. 46)
  void correct_motion(std::size_t body, bool shown, Side& side);
  void fill_cavities(std::size_t body, std::span<const double> shares, Side& side, SimulationReport& report);
  void swap_factorisation(const SimulationInput& input, SimulationReport& report);
  /// Where the probe moves fast: contact and whole corrections (6) at poses on its way.
  void follow_probe(const RigidPose* probe, SimulationReport& report);
  void touch(const RigidPose* probe, SimulationReport& report);
  /// A factorisation is wanted, and none outstanding.
  bool may_request(const SimulationInput& input, SimulationReport& report);
  void free_motion(std::size_t body, Side& side);
  void isolate(std::size_t body, const NeedleState* needle, Side& side);
  void choose_nodes(std::size_t body, const NeedleState& needle);
  /// How the law has stiffened a body: what the patch is of, or the whole of it.
  void stiffen(std::size_t body, bool whole, Side& side);
  void fill_request(std::size_t body, const NeedleState* needle, double stale_turn, Side& side);
  /// Isolated, foreseen and touched nodes of a body.
  void name_nodes(std::size_t body, const NeedleState* needle, FactorisationRequest::Body& request) const;
  void fill_patch(std::size_t body, TissuePatch& out);
  void request_factorisation(SimulationReport& report);
  void couple_organs(const NeedleState* needle, TissuePatch& out);
  void sum_up(const NeedleState* needle, SimulationReport& report, TissuePatch& out) const;

  /// What the stages of a step say of a body.
  struct BodyReport {
    std::uint32_t flags = 0;        // SimulationFlag bits
    std::uint32_t patch_flags = 0;  // PatchFlag bits
    int inverted_tets = 0;
    int new_isolated_nodes = 0;
    double residual_n = 0;
    double force_n = 0;
    bool factor_is_stale = false;
  };

  /// Mutable data of a body.
  struct BodyState {
    Eigen::Matrix3Xd free_positions;            // [3 x isolated] p_free, all needle force removed
    Eigen::Matrix3Xd trial;                     // scratch: corrected positions not yet accepted
    std::vector<Eigen::Quaterniond> rotations;  // [points] rest -> now
    Eigen::Matrix3Xd nodal_force;               // scratch: F_int at all nodes
    Eigen::VectorXd internal_force;             // [free DOFs] F_int at the current positions
    Eigen::VectorXd needle_force;               // [free DOFs] H^T lambda
    Eigen::VectorXd load;                       // [free DOFs] constant
    Eigen::VectorXd contact_force;              // [free DOFs] of other bodies and the probe, and the load
    Eigen::Matrix3Xd held_field;                // motion of all nodes per held_amplitude at rest; empty: none
    std::vector<int> loaded_nodes;              // where it is not zero, ascending
    Eigen::VectorXd eliminated;                 // [free DOFs] L^-1 P (F_int - H^T lambda): half of a solve
    Eigen::VectorXd eliminated_force;           // [free DOFs] the H^T lambda in it, of the needle and of contact
    Eigen::VectorXd displacement;               // [free DOFs] scratch
    Eigen::VectorXd pass;                       // [free DOFs] scratch, in the order of elimination
    Eigen::VectorXd on_trailing{};              // [S] of pass, see solve_trailing()
    Eigen::VectorXd unloading{};                // [3 known] W_bar H^T lambda then, by place
    bool trailing_solved = false;               // since the last free motion
    bool unloaded_on_trailing = false;          // H^T lambda acted on trailing nodes alone then
    std::vector<int> nodes;                     // isolated now, ascending
    std::vector<int> wanted;                    // of these, what the next factor has to have
    std::vector<int> held;                      // in the patch beside these, ascending: without compliance
    std::shared_ptr<const SurfaceTopology> surface{};  // coupling `stylet`
    double extent = 0;                                 // diagonal of the rest bounding box, m
    bool limited = false;                              // the last correction was shortened lest a tetrahedron inverts
    int squeezed = 0;                                  // tetrahedra in the barrier at the positions of internal_force
    std::vector<Cavity> cavities{};
    std::size_t first_cavity = 0;              // of all cavities
    BodyReport report{};                       // of the step in work
    std::vector<double> rest_size{};           // [tets] g of eq. 34; empty until a cavity is not full
    std::vector<StrainMemory> memory{};        // [memory_count()] of eq. 46; empty where nothing relaxes
    std::vector<StrainMemory> relaxed{};       // the same after the step in work
    std::vector<PointStiffness> stiffening{};  // [points] now; empty where nothing stiffens
  };

  /// p - A_f^-1 (F_int - H^T lambda) with the latest forces into body.trial: the other half of the solve (eq. 6).
  /// @param shown  the isolated nodes go where the haptic loop showed them with the last patch
  void respond(std::size_t body, bool shown, Side& side);
  /// Whether all that acts on a body since p_free was found acts on trailing nodes, and did then.
  bool acts_on_trailing(std::size_t body) const;
  /// A_f^-1 (F_int - H^T lambda) on the factor's trailing nodes, with what free_positions() needs of it.
  void solve_trailing(std::size_t body, Side& side);
  /// Of known nodes by their place, under the needle's forces on such [3 known], m.
  Eigen::VectorXd motion_under_needle(std::size_t body) const;
  /// p_free of nodes whose compliance is known or that are held (eq. 7).
  /// @param[out] free  [3 x nodes], m
  void free_positions(std::size_t body, std::span<const int> nodes, Eigen::Ref<Eigen::Matrix3Xd> free, Side& side);
  /// The bodies as the contact rows are linearised, with the nodes of a patch or none.
  std::vector<OrganResponseBody> organ_bodies(const TissuePatch* patch) const;
  /// Where all nodes go when those that are held move, to first order at rest.
  /// @param held  [3 x nodes] motion of the held nodes, zero elsewhere, m
  Eigen::Matrix3Xd field_of(std::size_t body, const Eigen::Matrix3Xd& held);
  /// F_int at `positions` with the body's rotations, into body.internal_force.
  void gather_internal_force(const TissueModel& model, const Eigen::Matrix3Xd& positions, BodyState& body,
                             Side& side);
  /// A step to body.trial, with the forces of the body before or after it.
  struct StepTried {
    double longest = 0;  // of a component of a node's step, m
    double slope = 0;    // of U(p) - p . external force along the step, J
  };
  static StepTried step_tried(const TissueModel& model, const BodyState& body, const Eigen::Matrix3Xd& from);
  /// 1, or the fraction of the step after which the potential would be least.
  static double overshoot(const StepTried& before, const StepTried& after, bool squeezed);

  SimulationLoopSettings settings_;
  std::vector<TissueModel> models_;
  FactorisationWorker worker_;
  Companion companion_;
  std::array<Side, Companion::kSides> sides_;
  std::vector<std::size_t> order_;  // of the bodies in for_bodies(), the largest first
  std::vector<BodyState> bodies_;
  InsertionPath path_;
  std::optional<OrganContact> contact_;
  std::optional<ProbeGrip> grip_;
  OrganResponse organs_;
  bool follow_organs_ = false;
  double held_amplitude_ = 0;
  std::optional<RigidPose> probe_;  // in the last step
  double tip_speed_ = 0;            // between the last two needles consumed, m/s
  double tip_time_s_ = 0;
  Eigen::Vector3d tip_ = Eigen::Vector3d::Zero();
  std::uint64_t tip_step_ = 0;  // 0: none consumed
  TissueState tissue_;
  bool any_large_ = false;                  // of the bodies: work body by body is worth waking the helper for
  bool factorisation_outstanding_ = false;  // requested and not yet taken: at most one
  std::uint64_t failures_seen_ = 0;
};

}  // namespace stylet::physics

// What a scenario becomes once it is loaded: everything the loops and the pictures need, in memory.
#pragma once

#include "engine/content/exercise.h"
#include "physics/contact/tissue_map.h"
#include "physics/contact/track_rows.h"
#include "physics/messages/messages.h"
#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stylet::content {

/// Acoustic properties of a tissue at body temperature; sources in content/tissues.json.
struct Acoustics {
  double impedance_rayl = 1.63e6;          ///< characteristic impedance, Pa s/m
  double speed_of_sound = 1540;            ///< m/s
  double attenuation_db_per_cm_mhz = 0.5;  ///< one way
  double backscatter_db = 0;               ///< relative to liver
  double texture_db = 0;                   ///< rms of the slow brightness variation
  double layering = 0;   ///< times that the texture is longer along the layers of the body than across; 0: isotropic
  double septa_db = 0;   ///< thin bright sheets between lobules and fascicles, over the tissue; 0: none
  double triads_db = 0;  ///< bright portal triads of liver, over the tissue; 0: none
  double mirror = 0;     ///< gas: amplitude of the image of what lies in front, mirrored in its surface; 0: none
  double ring_down = 0;  ///< froth: amplitude of a reverberation over the one before; 0: none
};

/// A sheath thinner than the meshes: what `outside` is next to `inside`, one voxel thick, is `wall`. Seen by
/// ultrasound only. Indices into Scene::tissues.
struct TissueWall {
  int outside = 0;
  int inside = 0;
  int wall = 0;
};

/// One row of content/tissues.json, as a scene uses it. Index in Scene::tissues = label in LabelVolume.
struct Tissue {
  std::string name;
  physics::ElasticMaterial mechanics;
  double density = 1000;         ///< kg/m^3
  double capsule_modulus = 0;    ///< of the capsule around a body whose boundary is of this tissue, Pa
  double capsule_thickness = 0;  ///< m
  bool fluid = false;            ///< a needle can draw it: regions of it are cavities
  Acoustics acoustics;
  physics::InsertionResistance needle;                  ///< how it resists the needle
  std::array<float, 4> colour{0.8F, 0.8F, 0.8F, 1.0F};  ///< linear RGB, opacity in the 3-D view
};

/// A body that deforms: simulated by finite elements.
struct DeformableBody {
  std::string name;
  physics::TetMesh mesh;
  physics::Element element = physics::Element::linear;
  std::vector<std::uint8_t> tet_tissue;                 ///< [tets] index into Scene::tissues
  std::vector<physics::ElasticMaterial> tet_mechanics;  ///< [tets] mean over the volume; empty: of the tissue
  double capsule = 0;                        ///< modulus times thickness of a membrane over its surface, N/m; 0: none
  std::vector<int> fixed_nodes;              ///< ascending, no duplicates
  std::vector<Eigen::Vector3d> held_motion;  ///< of the fixed nodes at full inspiration, m; empty: none moves
};

/// A region of a body that is filled with a fluid: a cyst.
struct Cavity {
  std::string name;       ///< organ id
  int body = 0;           ///< index into Scene::bodies
  std::vector<int> tets;  ///< of the body, ascending
  double volume = 0;      ///< of them at rest, m^3
};

/// Two bodies that slide on each other and do not pass through: nodes of one against the surface of the other.
struct BodyContact {
  int nodes_of = 0;  ///< index into Scene::bodies
  int surface_of = 0;
};

/// Quiet breathing; what it moves is in DeformableBody::held_motion and Surface::breathes.
struct Breathing {
  double amplitude = 0;                                    ///< 1: as the bodies say, 0: breath held at end-expiration
  double period = 4;                                       ///< s
  Eigen::Vector3d rigid_motion = Eigen::Vector3d::Zero();  ///< of surfaces that breathe, at full inspiration, m
  /// Spells of held breath at end-expiration, from and to, s; ascending and apart.
  std::vector<std::array<double, 2>> holds{};
  std::optional<double> drawn_once{};  ///< a breath drawn at the start to this share and held; in place of all above
};

/// Where a vertex of a surface sits in a deformable body: x = sum weights[i] * node[nodes[i]].
struct Embedding {
  std::array<std::uint32_t, 4> nodes{};
  std::array<float, 4> weights{};  ///< sum 1; may be slightly outside [0,1] at the boundary
};

enum class SurfaceRole : std::uint8_t { boundary, region, vessel, target, visual };

/// A closed triangle surface of the patient, for pictures and labels.
struct Surface {
  std::string name;  ///< glTF node name
  int tissue = 0;    ///< index into Scene::tissues
  SurfaceRole role = SurfaceRole::boundary;
  int body = -1;                           ///< deformable body that carries it, -1: rigid
  bool breathes = false;                   ///< rigid, and goes with the breath: the diaphragm
  std::vector<Eigen::Vector3f> positions;  ///< rest, patient frame, m
  std::vector<Eigen::Vector3f> normals;    ///< unit, outward, same size
  std::vector<std::uint32_t> indices;      ///< triangles, counter-clockwise from outside
  std::vector<Embedding> embedding;        ///< same size as positions where body >= 0, else empty
};

inline constexpr std::int8_t kBreathes = -2;  ///< in place of a body: rigid, and goes with the breath

/// Anatomy in rest space: the tissue at each voxel centre. x fastest; voxel (i,j,k) centre =
/// origin + spacing * (i,j,k).
struct LabelVolume {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  float spacing = 0.001F;  ///< m, isotropic
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<std::uint8_t> labels;  ///< index into Scene::tissues
  std::vector<std::int8_t> bodies;  ///< deformable body of the voxel's tissue, -1: none, or kBreathes. Size of labels
  std::vector<std::uint8_t> edges;  ///< distance from the voxel's centre to the surface where the tissue changes,
                                    ///< kEdgeStep voxels, as the surface had it; kNoEdge: far or unknown. Size of
                                    ///< labels, or empty: of none
};
inline constexpr float kEdgeStep = 0.01F;
inline constexpr std::uint8_t kNoEdge = 255;

/// A target thinner than the beam resolves, as the nylon threads of a test object: seen by ultrasound only.
struct Wire {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();  ///< patient frame, m; it stays where it is
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double echo_db = 30;  ///< amplitude of its echo, across the image plane, over the rms of liver at the same depth
};

struct Needle {
  std::string name;
  double length = 0.150;  ///< hub to tip, m
  double outer_diameter = 1.27e-3;
  double inner_diameter = 0.838e-3;  ///< 0: solid
  double young_modulus = 200e9;
  double poisson_ratio = 0.3;
  double yield_strength = 0;  ///< Pa; beyond it the needle stays bent; 0: it never does
  int beams = 8;
  double bevel_force_ratio = 0;  ///< lateral over axial force on the tip that cuts, away from the bevel
};

struct Probe {
  std::string name;
  bool convex = true;
  double radius = 0.060;        ///< of the face (convex), m
  double field_of_view = 1.15;  ///< rad (convex)
  double width = 0.040;         ///< of the face (linear), m
  double depth = 0.160;         ///< m below the face
  double frequency_hz = 3.5e6;
  int scan_lines = 192;
  int samples = 512;
  double dynamic_range_db = 60;
  double gain_db = 0;
  // What a scanner starts with and its knobs change.
  double lowest_frequency_hz = 2e6;  ///< band
  double highest_frequency_hz = 5e6;
  double focus = 0.075;  ///< m below the face
  // What the array and its lens are: how sharp it can be.
  double f_number = 2.2;              ///< least depth over width of the receiving aperture
  double elevation_width = 3e-3;      ///< thickness of the slice where it is thinnest, full width at half maximum, m
  double elevation_focus = 0.070;     ///< m below the face: where that is
  std::array<double, 8> tgc_db{};     ///< sliders, nearest first
  std::optional<double> persistence;  ///< share of the frame before; default: the preset's
  std::string preset = "clinical";    ///< or raw
  physics::RigidPose pose;            ///< patient_from_probe
  int presses = -1;                   ///< deformable body it is held against, -1: none
  bool gel = true;                    ///< between head and skin
};

struct Target {
  std::string name;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< rest, patient frame
  double radius = 0.01;
};

/// An organ that the needle must not enter. Where organs overlap the later one counts, as in LabelVolume.
struct Forbidden {
  std::string name{};    ///< organ id
  int tissue = 0;        ///< of its voxels in Scene::labels
  int body = -1;         ///< and their body, -1 or kBreathes
  LabelVolume inside{};  ///< 1 inside its surface at rest; around it alone, spacing of Scene::labels
};
inline constexpr std::size_t kMaxForbidden = 32;

/// What a metric (metric_table.h) must come to: all points at `full`, none at `zero`, linear between them.
struct Criterion {
  std::string metric;
  double full = 0;        ///< in the metric's unit
  double zero = 0;        ///< above or below full
  double weight = 1;      ///< share of the total
  bool critical = false;  ///< no points here: failed, whatever the total
};

/// Camera of the 3-D view, room or patient frame resolved to the patient frame.
struct Camera {
  Eigen::Vector3d eye = Eigen::Vector3d::Zero();
  Eigen::Vector3d look_at = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  double vertical_fov = 0.6;  ///< rad
};

/// One sample of the stylus (or probe) in a motion file.
struct MotionSample {
  double time_s = 0;
  physics::StylusPose pose;
  std::uint32_t buttons = 0;
};

struct Motion {
  std::vector<MotionSample> stylus;  ///< strictly increasing times
  std::vector<MotionSample> probe;   ///< may be empty: the probe stays at Probe::pose
};

struct LoopRates {
  double haptic_hz = 1000;
  double simulation_hz = 50;

  /// Whole haptic steps in a simulation step.
  bool in_lockstep() const {
    const double ratio = haptic_hz / simulation_hz;
    return ratio >= 1 - 1e-9 && std::abs(ratio - std::round(ratio)) <= 1e-9;
  }
};
inline constexpr double kMinHapticHz = 100;
inline constexpr double kMaxHapticHz = 4000;

/// What ordinary use of a scenario puts on the hand, N. 0: not said.
struct HandForce {
  double peak = 0;
  double held = 0;  ///< root of the mean square over 10 s, as motors warm
};

/// How far from the planned line a trainee finds needle and probe (session/start_pose.h), m and rad. [least, most].
struct StartSpread {
  double entry_off = 0;                                 ///< of the tip beside where the motion begins, at most
  Eigen::Vector2d aim_off = Eigen::Vector2d::Zero();    ///< of the point aimed at beside the first target
  Eigen::Vector2d probe_off = Eigen::Vector2d::Zero();  ///< that the probe is slid
  double probe_turned = 0;                              ///< and turned about its axis, at most

  bool none() const { return entry_off == 0 && aim_off.y() == 0 && probe_off.y() == 0 && probe_turned == 0; }
};

struct Scene {
  std::string name;
  std::string title;                     ///< one line for people
  std::filesystem::path scenario;        ///< file it came from
  std::filesystem::path tissue_table{};  ///< file of the tissues
  Eigen::Isometry3d room_from_patient = Eigen::Isometry3d::Identity();
  std::vector<Tissue> tissues;                          ///< [0] is "outside" (air / gel)
  std::vector<physics::TissueSurface> tissue_surfaces;  ///< between two tissues, where the table says so
  std::vector<TissueWall> tissue_walls;
  std::vector<DeformableBody> bodies;  ///< at most physics::kMaxBodies
  std::vector<Cavity> cavities;        ///< in the order of their bodies, at most physics::kMaxCavities
  std::vector<Surface> surfaces;
  LabelVolume labels;
  Needle needle;
  std::vector<Wire> wires;
  Probe probe;
  std::vector<Target> targets;
  std::vector<Forbidden> forbidden;  ///< at most kMaxForbidden
  std::vector<Criterion> scoring;    ///< each metric once; empty: the session is measured, not scored
  double pass_mark = 70;             ///< of 100
  Camera camera;
  Motion motion;
  StartSpread start;
  LoopRates rates;
  std::string coupling = "stylet";  ///< the scenario's default: stylet, paper-updated, paper-trajectory, paper-frozen
  physics::ShaftFriction shaft_friction = physics::ShaftFriction::coulomb;  ///< coupling stylet
  HandForce hand_force;
  double contact_spacing = 0.010;                     ///< m along the path
  double damping_time_s = 0;                          ///< Kelvin-Voigt: B = damping_time * K
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< patient frame, m/s^2
  std::vector<BodyContact> contacts;
  Breathing breathing;
  Exercise exercise;
};

}  // namespace stylet::content

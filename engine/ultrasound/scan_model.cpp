#include "engine/ultrasound/scan_model.h"

#include "engine/content/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace stylet::ultrasound {
namespace {

constexpr float kMeshEdge = 1.5F;       ///< voxels by which a mesh may miss the surface it was made from
constexpr double kSpeedOfSound = 1540;  ///< m/s, what every scanner assumes

double amplitude(double db) {
  return std::pow(10.0, db / 20);
}
double nepers(double db) {
  return db * std::log(10.0) / 20;
}

TissueRow tissue_row(const content::Acoustics& acoustics, double frequency_mhz) {
  const double db_per_m = 2 * acoustics.attenuation_db_per_cm_mhz * 100 * frequency_mhz;  // there and back
  return {.log_impedance = static_cast<float>(std::log(acoustics.impedance_rayl)),
          .loss = static_cast<float>(nepers(db_per_m)),
          .backscatter = static_cast<float>(amplitude(acoustics.backscatter_db)),
          .texture = static_cast<float>(nepers(acoustics.texture_db))};
}

vec4 as_vec4(const Eigen::Vector3f& v, float w = 0) {
  return {v.x(), v.y(), v.z(), w};
}

/// Voxels of `labels` inside the rest mesh of a body, or within `margin` (m) outside it. [voxels] 1 or 0
std::vector<std::uint8_t> covered_voxels(const content::LabelVolume& labels, const physics::TetMesh& mesh,
                                         float margin) {
  std::vector<std::uint8_t> covered(labels.labels.size(), 0);
  for (const std::array<int, 4>& tet : mesh.tets) {
    Eigen::Matrix<float, 3, 4> p;
    for (int i = 0; i < 4; ++i) p.col(i) = (mesh.nodes[tet[i]].cast<float>() - labels.origin) / labels.spacing;
    const Eigen::Matrix3f edges = p.rightCols<3>().colwise() - p.col(0);
    if (!(std::abs(edges.determinant()) > 1e-6F)) continue;
    const Eigen::Matrix3f inverse = edges.inverse();
    Eigen::Matrix<float, 4, 3> gradient;
    gradient << -inverse.colwise().sum(), inverse;
    const Eigen::Vector4f slack = gradient.rowwise().norm() * (margin / labels.spacing);
    const float reach = margin / labels.spacing;
    const Eigen::Array3i low = (p.rowwise().minCoeff().array() - reach).ceil().cast<int>().max(0);
    const Eigen::Array3i high =
        (p.rowwise().maxCoeff().array() + reach).floor().cast<int>().min(labels.size.array() - 1);
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        const std::size_t row = (static_cast<std::size_t>(k) * labels.size.y() + j) * labels.size.x();
        for (int i = low.x(); i <= high.x(); ++i) {
          Eigen::Vector4f w = gradient * (Eigen::Vector3f(float(i), float(j), float(k)) - p.col(0));
          w[0] += 1;
          if ((w.array() >= -slack.array()).all()) covered[row + i] = 1;
        }
      }
    }
  }
  return covered;
}

void check(const content::Scene& scene, const ImagerSettings& settings) {
  const auto fail = [&scene](const std::string& what) {
    throw content::ContentError(fmt::format("{}: ultrasound: {}", scene.scenario.string(), what));
  };
  const content::Probe& probe = scene.probe;
  if (probe.scan_lines < 8 || probe.scan_lines > 1024 || probe.samples < 16 || probe.samples > 4096) {
    fail(fmt::format("probe has {} scan lines of {} samples; give 8 to 1024 lines of 16 to 4096 samples",
                     probe.scan_lines, probe.samples));
  }
  if (!(probe.depth > 0) || !(probe.frequency_hz > 0) ||
      !(probe.convex ? probe.radius > 0 && probe.field_of_view > 0 && probe.field_of_view < EIGEN_PI
                     : probe.width > 0)) {
    fail("depth, frequency and face of the probe must be positive, its field of view below 180 degrees");
  }
  const content::LabelVolume& labels = scene.labels;
  const std::size_t voxels = std::size_t(std::max(labels.size.x(), 0)) * std::size_t(std::max(labels.size.y(), 0)) *
                             std::size_t(std::max(labels.size.z(), 0));
  if (voxels == 0 || labels.labels.size() != voxels || labels.bodies.size() != voxels || !(labels.spacing > 0)) {
    fail(fmt::format(
        "label volume of {} x {} x {} voxels has {} labels and {} bodies; build it from the scene's surfaces",
        labels.size.x(), labels.size.y(), labels.size.z(), labels.labels.size(), labels.bodies.size()));
  }
  for (std::uint8_t label : labels.labels) {
    if (label >= scene.tissues.size()) {
      fail(fmt::format("label {} has no tissue; there are {}", int(label), scene.tissues.size()));
    }
  }
  if (!(settings.persistence >= 0 && settings.persistence <= kMostPersistence)) {
    fail(fmt::format("settings: persistence must be 0 to {}", kMostPersistence));
  }
  if (settings.looks < 1 || settings.looks > kMaxLooks || settings.planes < 1 || settings.planes > kMaxPlanes ||
      settings.planes % 2 == 0 || settings.line_oversampling < 1 || settings.width < 16 || settings.height < 16) {
    fail(
        "settings: looks must be 1 to 3, planes odd and 1 to 13, line oversampling at least 1, the picture at least "
        "16 x 16");
  }
}

}  // namespace

ScanModel::ScanModel(const content::Scene& scene, const ImagerSettings& settings)
    : scene_((check(scene, settings), scene)),
      settings_(settings),
      controls_(ScannerControls::of(scene.probe, settings.persistence)),
      speckle_(settings.seed),
      slice_(ScanGeometry::of(scene.probe, settings.line_oversampling), scene.bodies) {
  for (const content::Tissue& tissue : scene.tissues) acoustics_.push_back(tissue.acoustics);
  // Label 0 is the outside. Air, unless it is the gel in front of the skin.
  const auto medium = [](double impedance, double attenuation, double backscatter_db) {
    content::Acoustics acoustics;
    acoustics.impedance_rayl = impedance;
    acoustics.attenuation_db_per_cm_mhz = attenuation;
    acoustics.backscatter_db = backscatter_db;
    return acoustics;
  };
  acoustics_[0] = medium(kAirImpedance, kAirAttenuation, kNoBackscatterDb);
  constants_.gel_tissue = static_cast<int>(acoustics_.size());
  acoustics_.push_back(medium(kGelImpedance, kGelAttenuation, kNoBackscatterDb));
  constants_.filler_tissue = static_cast<int>(acoustics_.size());
  acoustics_.push_back(medium(kFillerImpedance, kFillerAttenuation, kFillerBackscatterDb));

  const content::LabelVolume& labels = scene.labels;
  voxels_.resize((labels.labels.size() + 1) / 2 * 2);
  for (std::size_t i = 0; i < labels.labels.size(); ++i) {
    voxels_[i] = labels.labels[i];
  }
  // A voxel belongs to the body whose tetrahedra carry it. What only hangs on a body, outside its mesh (the
  // gallbladder under the liver), stays where it is at rest; a voxel at the mesh's own rough edge does not.
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    const std::vector<std::uint8_t> covered =
        covered_voxels(labels, scene.bodies[body].mesh, kMeshEdge * labels.spacing);
    for (std::size_t i = 0; i < labels.labels.size(); ++i) {
      if (covered[i] != 0 && labels.bodies[i] == static_cast<int>(body)) {
        voxels_[i] = static_cast<std::uint16_t>(labels.labels[i] | (body + 1) << 8);
      }
    }
  }

  constants_.breath.w = -1;
  for (std::size_t i = 0; i < labels.labels.size(); ++i) {
    if (labels.bodies[i] != content::kBreathes) continue;
    constants_.breath.w = static_cast<float>(scene.bodies.size());
    voxels_[i] = static_cast<std::uint16_t>(labels.labels[i] | (scene.bodies.size() + 1) << 8);
  }

  FrameConstants& c = constants_;
  c.looks = settings.looks;
  c.label_nx = labels.size.x();
  c.label_ny = labels.size.y();
  c.label_nz = labels.size.z();
  c.label_x = labels.origin.x();
  c.label_y = labels.origin.y();
  c.label_z = labels.origin.z();
  c.label_spacing = labels.spacing;
  c.needle_radius = static_cast<float>(0.5 * scene.needle.outer_diameter);
  c.noise = static_cast<float>(amplitude(settings.noise_db));
  c.gradient_reach = std::max(kGradientReach, 0.5F * labels.spacing);
  c.planes = settings.planes;
  c.haze = settings.haze ? 1.0F : 0.0F;
  c.texture = settings.texture ? 1.0F : 0.0F;
  c.tick_pitch = settings.depth_scale ? 0.010F : 0.0F;
  limit(controls_, scene.probe);
  make_geometry();
  make_tissues();
  set_receiver();
}

std::string ScanModel::set_controls(ScannerControls controls) {
  std::string limited = limit(controls, scene_.probe);
  const ScannerControls before = std::exchange(controls_, controls);
  const bool frequency = controls.frequency_hz != before.frequency_hz;
  if (frequency || controls.depth != before.depth || controls.focus != before.focus) make_geometry();
  if (frequency) make_tissues();
  if (controls.depth != before.depth) restart();  // the frame before lies on other samples
  set_receiver();
  return limited;
}

void ScanModel::set_acoustics(std::span<const content::Tissue> tissues) {
  for (std::size_t i = 1; i < std::min(tissues.size(), scene_.tissues.size()); ++i) {
    acoustics_[i] = tissues[i].acoustics;
  }
  make_tissues();
}

/// Where the samples lie, the picture of them, and the beam: depth, focus and frequency.
void ScanModel::make_geometry() {
  content::Probe probe = scene_.probe;
  probe.depth = controls_.depth;
  scan_ = ScanGeometry::of(probe, settings_.line_oversampling);
  sector_ = SectorGeometry::fit(scan_, settings_.width, settings_.height);
  beam_ = BeamProfile::of(scan_, kSpeedOfSound / controls_.frequency_hz, controls_.focus, settings_.planes);
  slice_ = PlaneSlice(scan_, scene_.bodies);
  FrameConstants& c = constants_;
  c.face_radius = static_cast<float>(scan_.face_radius);
  c.first_line = static_cast<float>(scan_.first_line);
  c.line_pitch = static_cast<float>(scan_.line_pitch);
  c.sample_pitch = static_cast<float>(scan_.sample_pitch);
  c.lines = scan_.lines;
  c.samples = scan_.samples;
  c.plane_spacing = static_cast<float>(beam_.plane_spacing);
  c.bin_x = slice_.bin_origin().x();
  c.bin_z = slice_.bin_origin().y();
  c.bin_size = slice_.bin_size();
  c.bin_columns = slice_.columns();
  c.bin_rows = slice_.rows();
  c.width = sector_.width;
  c.height = sector_.height;
  c.pixel = static_cast<float>(sector_.metres_per_pixel);
  c.picture_x = static_cast<float>(sector_.origin.x());
  c.picture_z = static_cast<float>(sector_.origin.y());
  ++tables_version_;
}

void ScanModel::make_tissues() {
  const double mhz = controls_.frequency_hz * 1e-6;
  tissues_.clear();
  for (const content::Acoustics& acoustics : acoustics_) tissues_.push_back(tissue_row(acoustics, mhz));
  ++tables_version_;
}

/// Gain, depth gain, dynamic range.
void ScanModel::set_receiver() {
  constants_.tgc = static_cast<float>(2 * kTgcAttenuation * 100 * controls_.frequency_hz * 1e-6);
  constants_.white_db = static_cast<float>(kWhiteOverLiverDb - controls_.gain_db);
  constants_.dynamic_range = static_cast<float>(controls_.dynamic_range_db);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto db = [&](std::size_t k) { return static_cast<float>(controls_.tgc_db[4 * i + k]); };
    constants_.tgc_sliders[i] = {db(0), db(1), db(2), db(3)};
  }
}

void ScanModel::update(const state::FrameState& state) {
  Eigen::Isometry3f patient_from_probe = Eigen::Isometry3f::Identity();
  patient_from_probe.linear() = state.probe_orientation.normalized().toRotationMatrix();
  patient_from_probe.translation() = state.probe_position;
  const Eigen::Isometry3f probe_from_patient = patient_from_probe.inverse();
  slice_.cut(state, probe_from_patient);
  place_needle(state, probe_from_patient);
  place_wires(probe_from_patient);
  constants_.origin = as_vec4(patient_from_probe.translation());
  constants_.lateral = as_vec4(patient_from_probe.linear().col(0));
  constants_.elevation = as_vec4(patient_from_probe.linear().col(1));
  constants_.axial = as_vec4(patient_from_probe.linear().col(2));
  constants_.coupling = kCouplingDepth + state.probe_lifted * (kGelFilm - kCouplingDepth);
  if (!scene_.probe.gel) constants_.coupling = kDryGap;
  constants_.breath = as_vec4(state.breath, constants_.breath.w);
  // The receiver's noise is new at every moment, and the same whenever that moment is drawn.
  const auto microseconds = static_cast<std::uint32_t>(std::llround(state.time_s * 1e6));
  constants_.noise_seed = static_cast<int>(settings_.seed + 2654435761U * microseconds);
  constants_.persistence = first_frame_ ? 0.0F : static_cast<float>(controls_.persistence);
  first_frame_ = false;
}

void ScanModel::place_needle(const state::FrameState& state, const Eigen::Isometry3f& probe_from_patient) {
  // Beyond three standard deviations of the widest beam a segment shows nothing.
  const float reach = 1.3F * static_cast<float>(elevation_fwhm(scan_.range(scan_.samples)));
  const double margin = 4 * kNeedleWidth + constants_.needle_radius;
  needle_.clear();
  Eigen::AlignedBox2d box;  // of (line, sample)
  float from_tip = 0;
  for (std::size_t i = state.needle_positions.size(); i-- > 1;) {
    const Eigen::Vector3f a = probe_from_patient * state.needle_positions[i];
    const Eigen::Vector3f b = probe_from_patient * state.needle_positions[i - 1];
    const float length = (b - a).norm();
    const bool away = std::min(std::abs(a.y()), std::abs(b.y())) > reach && a.y() * b.y() > 0;
    if (!away && std::isfinite(length) && length > 1e-6F) {
      needle_.push_back({as_vec4(a, from_tip), as_vec4(b, from_tip + length)});
      // The range along a segment is convex, its least value inside it: a few points bound it well enough.
      for (float t : {0.0F, 0.25F, 0.5F, 0.75F, 1.0F}) {
        const Eigen::Vector3f p = a + t * (b - a);
        box.extend(scan_.line_and_sample(Eigen::Vector2d(p.x(), p.z())));
      }
    }
    from_tip += length;
  }
  const auto clamp_to = [](double value, int end) { return static_cast<int>(std::clamp(value, 0.0, double(end))); };
  constants_.needle_segments = static_cast<int>(needle_.size());
  if (needle_.empty()) return;
  const double echo_end = margin + kReverberations * kReverberationSpacing;
  const double nearest = std::max(scan_.range(box.min().y()), scan_.range(0));
  const double lines = margin / scan_.lateral_pitch(nearest) + 1;
  constants_.needle_first_line = clamp_to(box.min().x() - lines, scan_.lines);
  constants_.needle_end_line = clamp_to(box.max().x() + lines + 1, scan_.lines);
  constants_.needle_first_sample = clamp_to(box.min().y() - 2 * margin / scan_.sample_pitch, scan_.samples);
  constants_.needle_end_sample = clamp_to(box.max().y() + echo_end / scan_.sample_pitch + 1, scan_.samples);
  const bool in_sector = constants_.needle_first_line < constants_.needle_end_line &&
                         constants_.needle_first_sample < constants_.needle_end_sample;
  if (!in_sector) constants_.needle_segments = 0;
}

/// Before the beam's kernels, so that behind them it is what the wire is said to be.
float ScanModel::wire_amplitude(const content::Wire& wire, const Eigen::Vector3f& at) const {
  const Eigen::Vector2d place = scan_.line_and_sample(Eigen::Vector2d(at.x(), at.z()));
  const int sample = static_cast<int>(std::clamp(std::round(place.y()), 0.0, scan_.samples - 1.0));
  const auto response = [sample](const std::vector<float>& table, int taps, double pitch) {
    const double width = std::max<double>(kWireWidth, kWirePitches * pitch) / pitch;
    const float* weights = table.data() + static_cast<std::size_t>(sample) * taps;
    double sum = weights[0];
    for (int i = 1; i < taps; ++i) sum += 2 * weights[i] * std::exp(-0.5 * i * i / (width * width));
    return sum;
  };
  const double lateral = response(beam_.lateral, kLateralTaps, scan_.lateral_pitch(scan_.range(sample)));
  return static_cast<float>(amplitude(wire.echo_db) /
                            (lateral * response(beam_.axial, kAxialTaps, scan_.sample_pitch)));
}

void ScanModel::place_wires(const Eigen::Isometry3f& probe_from_patient) {
  wires_.clear();
  const float reach = 1.3F * static_cast<float>(elevation_fwhm(scan_.range(scan_.samples)));
  for (const content::Wire& wire : scene_.wires) {
    const Eigen::Vector3f a = probe_from_patient * wire.from.cast<float>();
    const Eigen::Vector3f b = probe_from_patient * wire.to.cast<float>();
    const bool away = std::min(std::abs(a.y()), std::abs(b.y())) > reach && a.y() * b.y() > 0;
    if (away || !((b - a).norm() > 1e-6F)) continue;
    wires_.push_back({as_vec4(a, wire_amplitude(wire, a)), as_vec4(b, wire_amplitude(wire, b))});
  }
  constants_.wires = static_cast<int>(wires_.size());
  if (wires_.empty()) return;
  // They lie all over a test object.
  constants_.needle_first_line = 0;
  constants_.needle_end_line = scan_.lines;
  constants_.needle_first_sample = 0;
  constants_.needle_end_sample = scan_.samples;
}

}  // namespace stylet::ultrasound

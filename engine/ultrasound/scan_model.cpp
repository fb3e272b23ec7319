#include "engine/ultrasound/scan_model.h"

#include "engine/files/error.h"
#include "engine/state/biopsy_shot.h"
#include "engine/ultrasound/voxel_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace stylet::ultrasound {
namespace {

constexpr double kNoEcho = 5.5;         ///< standard deviations of a profile beyond which it is nothing: -131 dB
constexpr double kLobeEnd = 2.2;        ///< standard deviations of a side lobe beyond which it is below -55 dB
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
          .texture = static_cast<float>(nepers(acoustics.texture_db)),
          .layering = static_cast<float>(acoustics.layering),
          .septa = static_cast<float>(nepers(acoustics.septa_db)),
          .triads = static_cast<float>(nepers(acoustics.triads_db)),
          .mirror = static_cast<float>(acoustics.mirror),
          .ring_down = static_cast<float>(acoustics.ring_down),
          .unused0 = 0,
          .unused1 = 0,
          .unused2 = 0};
}

vec4 as_vec4(const Eigen::Vector3f& v, float w = 0) {
  return {v.x(), v.y(), v.z(), w};
}

void check(const content::Scene& scene, const ImagerSettings& settings) {
  const auto fail = [&scene](const std::string& what) {
    throw files::ContentError(fmt::format("{}: ultrasound: {}", scene.scenario.string(), what));
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
  if (scene.tissues.size() + 2 > kTissueRows) {
    fail(fmt::format("scene has {} tissues, the limit is {}", scene.tissues.size(), kTissueRows - 2));
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
      voxels_(voxel_words(scene)),
      layers_(LayerDepth::of(scene, voxels_)),
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
  acoustics_[0].mirror = kAirMirror;
  constants_.gel_tissue = static_cast<int>(acoustics_.size());
  acoustics_.push_back(medium(kGelImpedance, kGelAttenuation, kNoBackscatterDb));
  constants_.filler_tissue = static_cast<int>(acoustics_.size());
  acoustics_.push_back(medium(kFillerImpedance, kFillerAttenuation, kFillerBackscatterDb));

  const content::LabelVolume& labels = scene.labels;
  const bool breathes = std::ranges::find(labels.bodies, content::kBreathes) != labels.bodies.end();
  constants_.breath.w = breathes ? static_cast<float>(scene.bodies.size()) : -1.0F;

  FrameConstants& c = constants_;
  c.label_nx = labels.size.x();
  c.label_ny = labels.size.y();
  c.label_nz = labels.size.z();
  c.label_x = labels.origin.x();
  c.label_y = labels.origin.y();
  c.label_z = labels.origin.z();
  c.label_spacing = labels.spacing;
  c.depth_nx = layers_.size.x();
  c.depth_ny = layers_.size.y();
  c.depth_nz = layers_.size.z();
  c.needle_radius = static_cast<float>(0.5 * scene.needle.outer_diameter);
  c.noise = static_cast<float>(amplitude(settings.noise_db));
  c.gradient_reach = std::max(kGradientReach, 0.5F * labels.spacing);
  c.planes = settings.planes;
  c.elevation_width = static_cast<float>(scene.probe.elevation_width);
  c.elevation_focus = static_cast<float>(scene.probe.elevation_focus);
  c.elevation_field_depth = static_cast<float>(elevation_field_depth(scene.probe));
  c.grain = static_cast<float>(speckle_grain(scene.probe));
  c.haze = settings.haze ? 1.0F : 0.0F;
  c.tick_pitch = settings.depth_scale ? 0.010F : 0.0F;
  limit(controls_, scene.probe);
  make_geometry();
  make_tissues();
  set_receiver();
}

std::vector<std::uint32_t> ScanModel::switches() const {
  const auto flag = [](bool on) { return on ? 1U : 0U; };
  return {static_cast<std::uint32_t>(settings_.looks),
          flag(settings_.texture),
          flag(constants_.breath.w >= 0),
          flag(constants_.face_radius != 0),
          flag(settings_.texture && constants_.depth_nx > 0),
          flag(scene_.exercise.plan && scene_.exercise.plan->destroys)};
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

void ScanModel::set_seed(std::uint32_t seed) {
  if (seed == settings_.seed) return;
  settings_.seed = seed;
  speckle_ = SpeckleField(seed);
  ++speckle_version_;
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
  beam_ = BeamProfile::of(scan_, probe, kSpeedOfSound / controls_.frequency_hz, controls_.focus, settings_.planes);
  slice_ = PlaneSlice(scan_, scene_.bodies);
  FrameConstants& c = constants_;
  c.face_radius = static_cast<float>(scan_.face_radius);
  c.first_line = static_cast<float>(scan_.first_line);
  c.line_pitch = static_cast<float>(scan_.line_pitch);
  c.sample_pitch = static_cast<float>(scan_.sample_pitch);
  c.lines = scan_.lines;
  c.samples = scan_.samples;
  c.tile_columns = slice_.columns();
  c.width = sector_.width;
  c.height = sector_.height;
  c.pixel = static_cast<float>(sector_.metres_per_pixel);
  c.picture_x = static_cast<float>(sector_.origin.x());
  c.picture_z = static_cast<float>(sector_.origin.y());
  make_runs();
  ++tables_version_;
}

/// The picture in runs of kPixels; first those that show the sector.
void ScanModel::make_runs() {
  std::vector<std::uint32_t> empty;
  runs_.clear();
  for (int v = 0; v < sector_.height; ++v) {
    for (int u = 0; u < sector_.width; u += kPixels) {
      bool shown = false;
      for (int i = u - 1; i <= std::min(u + kPixels, sector_.width) && !shown; ++i) {
        const Eigen::Vector2d at = scan_.line_and_sample(sector_.position(Eigen::Vector2d(i, v)));
        shown = at.x() > -1 && at.x() < scan_.lines && at.y() > -1 && at.y() < scan_.samples;
      }
      (shown ? runs_ : empty).push_back(static_cast<std::uint32_t>(v << 16 | u));
    }
  }
  sector_runs_ = static_cast<int>(runs_.size());
  runs_.insert(runs_.end(), empty.begin(), empty.end());
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
  take_zone(state.zone.get());
  Eigen::Isometry3f patient_from_probe = Eigen::Isometry3f::Identity();
  patient_from_probe.linear() = state.probe_orientation.normalized().toRotationMatrix();
  patient_from_probe.translation() = state.probe_position;
  const Eigen::Isometry3f probe_from_patient = patient_from_probe.inverse();
  slice_.cut(state, probe_from_patient);
  place_thin(state, probe_from_patient);
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

void ScanModel::take_zone(const content::HeatedZone* zone) {
  const std::uint64_t version = zone != nullptr ? zone->version : 0;
  if (version == zone_version_) return;
  zone_version_ = version;
  ++zone_changes_;
  FrameConstants& c = constants_;
  const auto whole = [](float share) {
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.F, 1.F)));
  };
  zone_texels_.clear();
  c.zone_nx = c.zone_ny = c.zone_nz = 0;
  if (version == 0) return;
  for (std::size_t i = 0; i < zone->gas.size(); ++i) {
    zone_texels_.push_back({whole(zone->gas[i]), whole(0.5F + 0.5F * zone->dose[i] / kMostDose)});
  }
  c.zone_x = zone->origin.x();
  c.zone_y = zone->origin.y();
  c.zone_z = zone->origin.z();
  c.zone_spacing = zone->spacing;
  c.zone_nx = zone->size.x();
  c.zone_ny = zone->size.y();
  c.zone_nz = zone->size.z();
}

ScanModel::Heated ScanModel::heated_at(const Eigen::Vector3f& x) const {
  const FrameConstants& c = constants_;
  const Eigen::Array3f q = (x - Eigen::Vector3f(c.zone_x, c.zone_y, c.zone_z)).array() / c.zone_spacing;
  const Eigen::Array3f base = q.floor();
  const Eigen::Array3f f = q - base;
  const Eigen::Array3i low = base.cast<int>();
  const Eigen::Array3i size(c.zone_nx, c.zone_ny, c.zone_nz);
  if (!((low >= 0).all() && (low < size - 1).all())) return {};
  float gas = 0, dose = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i d(corner & 1, (corner >> 1) & 1, corner >> 2);
    const float w = (d == 0).select(1 - f, f).prod();
    const Eigen::Array3i cell = low + d;
    const auto& texel =
        zone_texels_[(static_cast<std::size_t>(cell.z()) * c.zone_ny + cell.y()) * c.zone_nx + cell.x()];
    gas += w * static_cast<float>(texel[0]) / 255;
    dose += w * static_cast<float>(texel[1]) / 255;
  }
  const auto smoothstep = [](float a, float b, float at) {
    const float t = std::clamp((at - a) / (b - a), 0.F, 1.F);
    return t * t * (3 - 2 * t);
  };
  dose = (2 * dose - 1) * kMostDose;
  return {gas, smoothstep(-kCoagulatedEdge, kCoagulatedEdge, dose), 1 - smoothstep(0, kRimWidth, std::abs(dose))};
}

/// Marks the tiles that the echo of a piece from `a` to `b` (probe frame) reaches: `across`, `before` and `behind`
/// from it within the plane, m.
void ScanModel::mark_tiles(const Eigen::Vector3f& a, const Eigen::Vector3f& b, double across, double before,
                           double behind) {
  const auto tile_of = [](double place, int end) {
    return static_cast<int>(std::clamp(std::floor(place / kTile), -1.0, static_cast<double>(end)));
  };
  const double step = 0.5 * kTile * scan_.sample_pitch;
  constexpr double kMostSteps = 4096;  // metres of needle: longer is a state that has gone wrong
  const int steps = static_cast<int>(std::min(std::ceil(double((b - a).norm()) / step), kMostSteps));
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector3d p = (a + (b - a) * (static_cast<float>(i) / static_cast<float>(steps))).cast<double>();
    const Eigen::Vector2d place = scan_.line_and_sample({p.x(), p.z()});
    const double range = scan_.range(place.y());
    if (std::abs(p.y()) > slice_reach() + step || range + behind < 0) continue;
    const double nearest = std::max(range - before, scan_.sample_pitch);
    const double lines = (across + step) / scan_.lateral_pitch(nearest) + 1;
    const int first_column = std::max(tile_of(place.x() - lines, slice_.columns()), 0);
    const int last_column = tile_of(place.x() + lines, slice_.columns() - 1);
    const int first_row = std::max(tile_of(place.y() - (before + step) / scan_.sample_pitch, slice_.rows()), 0);
    const int last_row = tile_of(place.y() + (behind + step) / scan_.sample_pitch, slice_.rows() - 1);
    for (int row = first_row; row <= last_row; ++row) {
      for (int column = first_column; column <= last_column; ++column) {
        marked_[static_cast<std::size_t>(row) * slice_.columns() + column] = 1;
      }
    }
  }
}

/// Further out of the plane nothing shows, m.
float ScanModel::slice_reach() const {
  return 2.2F * static_cast<float>(elevation_fwhm(scene_.probe, scan_.range(scan_.samples)));
}

void ScanModel::place_thin(const state::FrameState& state, const Eigen::Isometry3f& probe_from_patient) {
  marked_.assign(static_cast<std::size_t>(slice_.columns()) * slice_.rows(), 0);
  place_needle(state, probe_from_patient);
  place_wires(probe_from_patient);
  thin_tiles_.clear();
  for (std::size_t tile = 0; tile < marked_.size(); ++tile) {
    if (marked_[tile] != 0) thin_tiles_.push_back(static_cast<std::uint32_t>(tile));
  }
}

void ScanModel::place_needle(const state::FrameState& state, const Eigen::Isometry3f& probe_from_patient) {
  const double margin = kNoEcho * kNeedleWidth / constants_.grain + constants_.needle_radius;
  const double across = std::max<double>(margin, kLobeEnd * kSideLobeWidth);
  needle_.clear();
  float from_tip = 0;
  const auto place = [&](const Eigen::Vector3f& nearer_tip, const Eigen::Vector3f& nearer_hub) {
    const Eigen::Vector3f a = probe_from_patient * nearer_tip;
    const Eigen::Vector3f b = probe_from_patient * nearer_hub;
    const float length = (b - a).norm();
    if (!out_of_slice(a, b) && std::isfinite(length) && length > 1e-6F) {
      needle_.push_back({as_vec4(a, from_tip), as_vec4(b, from_tip + length)});
      mark_tiles(a, b, across, margin, margin + 2 * kReverberations * constants_.needle_radius);
    }
    from_tip += length;
  };
  const auto& nodes = state.needle_positions;
  const std::optional<state::BiopsyShot> shot = state::shot_of(state);
  if (shot && !nodes.empty() && !state.needle_orientations.empty()) {
    place(nodes.back() + shot->stylet * (state.needle_orientations.back() * Eigen::Vector3f::UnitZ()), nodes.back());
  }
  for (std::size_t i = nodes.size(); i-- > 1;) place(nodes[i], nodes[i - 1]);
  constants_.bevel = {0, 0, 0, 0};
  if (!state.needle_orientations.empty() && scene_.needle.bevel_force_ratio > 0) {
    const Eigen::Vector3f side = state.needle_orientations.back() * Eigen::Vector3f::UnitX();
    constants_.bevel = as_vec4(probe_from_patient.linear() * side, 1);
  }
  constants_.needle_segments = static_cast<int>(needle_.size());
}

bool ScanModel::out_of_slice(const Eigen::Vector3f& a, const Eigen::Vector3f& b) const {
  return std::min(std::abs(a.y()), std::abs(b.y())) > slice_reach() && a.y() * b.y() > 0;
}

/// Before the beam's kernels, so that behind them it is what the wire is said to be.
float ScanModel::wire_amplitude(const content::Wire& wire, const Eigen::Vector3f& at) const {
  const Eigen::Vector2d place = scan_.line_and_sample(Eigen::Vector2d(at.x(), at.z()));
  const int sample = static_cast<int>(std::clamp(std::round(place.y()), 0.0, scan_.samples - 1.0));
  const auto response = [this, sample](const std::vector<float>& table, int taps, double pitch) {
    const double width = std::max<double>(kWireWidth / constants_.grain, kWirePitches * pitch) / pitch;
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
  const double deepest = scan_.range(scan_.samples);
  const double across =
      kNoEcho * std::max<double>(kWireWidth / constants_.grain, kWirePitches * scan_.lateral_pitch(deepest));
  const double along = kNoEcho * std::max<double>(kWireWidth / constants_.grain, kWirePitches * scan_.sample_pitch);
  for (const content::Wire& wire : scene_.wires) {
    const Eigen::Vector3f a = probe_from_patient * wire.from.cast<float>();
    const Eigen::Vector3f b = probe_from_patient * wire.to.cast<float>();
    if (out_of_slice(a, b) || !((b - a).norm() > 1e-6F)) continue;
    wires_.push_back({as_vec4(a, wire_amplitude(wire, a)), as_vec4(b, wire_amplitude(wire, b))});
    mark_tiles(a, b, across, along, along);
  }
  constants_.wires = static_cast<int>(wires_.size());
}

}  // namespace stylet::ultrasound

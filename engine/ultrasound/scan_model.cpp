#include "engine/ultrasound/scan_model.h"

#include "engine/content/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace stylet::ultrasound {
namespace {

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
  if (settings.looks < 1 || settings.looks > kMaxLooks || settings.line_oversampling < 1 || settings.width < 16 ||
      settings.height < 16) {
    fail("settings: looks must be 1 to 3, line oversampling at least 1, the picture at least 16 x 16");
  }
}

}  // namespace

ScanModel::ScanModel(const content::Scene& scene, const ImagerSettings& settings)
    : scene_((check(scene, settings), scene)),
      scan_(ScanGeometry::of(scene.probe, settings.line_oversampling)),
      sector_(SectorGeometry::fit(scan_, settings.width, settings.height)),
      beam_(BeamProfile::of(scan_, kSpeedOfSound / scene.probe.frequency_hz)),
      speckle_(settings.seed),
      slice_(scan_, scene.bodies) {
  const double mhz = scene.probe.frequency_hz * 1e-6;
  for (const content::Tissue& tissue : scene.tissues) tissues_.push_back(tissue_row(tissue.acoustics, mhz));
  // Label 0 is the outside. Air, unless it is the gel in front of the skin.
  const auto medium = [mhz](double impedance, double attenuation, double backscatter_db) {
    content::Acoustics acoustics;
    acoustics.impedance_rayl = impedance;
    acoustics.attenuation_db_per_cm_mhz = attenuation;
    acoustics.backscatter_db = backscatter_db;
    return tissue_row(acoustics, mhz);
  };
  tissues_[0] = medium(kAirImpedance, kAirAttenuation, kNoBackscatterDb);
  constants_.gel_tissue = static_cast<int>(tissues_.size());
  tissues_.push_back(medium(kGelImpedance, kGelAttenuation, kNoBackscatterDb));
  constants_.filler_tissue = static_cast<int>(tissues_.size());
  tissues_.push_back(medium(kFillerImpedance, kFillerAttenuation, kFillerBackscatterDb));

  const content::LabelVolume& labels = scene.labels;
  voxels_.resize((labels.labels.size() + 1) / 2 * 2);
  for (std::size_t i = 0; i < labels.labels.size(); ++i) {
    voxels_[i] = static_cast<std::uint16_t>(labels.labels[i] | (labels.bodies[i] + 1) << 8);
  }

  FrameConstants& c = constants_;
  c.face_radius = static_cast<float>(scan_.face_radius);
  c.first_line = static_cast<float>(scan_.first_line);
  c.line_pitch = static_cast<float>(scan_.line_pitch);
  c.sample_pitch = static_cast<float>(scan_.sample_pitch);
  c.lines = scan_.lines;
  c.samples = scan_.samples;
  c.looks = settings.looks;
  c.noise_seed = static_cast<int>(settings.seed);
  c.bin_x = slice_.bin_origin().x();
  c.bin_z = slice_.bin_origin().y();
  c.bin_size = slice_.bin_size();
  c.bin_columns = slice_.columns();
  c.bin_rows = slice_.rows();
  c.label_nx = labels.size.x();
  c.label_ny = labels.size.y();
  c.label_nz = labels.size.z();
  c.label_x = labels.origin.x();
  c.label_y = labels.origin.y();
  c.label_z = labels.origin.z();
  c.label_spacing = labels.spacing;
  c.needle_radius = static_cast<float>(0.5 * scene.needle.outer_diameter);
  c.tgc = static_cast<float>(2 * kTgcAttenuation * 100 * mhz);
  c.noise = static_cast<float>(amplitude(settings.noise_db));
  c.white_db = static_cast<float>(kWhiteOverLiverDb - scene.probe.gain_db);
  c.dynamic_range = static_cast<float>(scene.probe.dynamic_range_db);
  c.gradient_reach = std::max(kGradientReach, 0.5F * labels.spacing);
  c.haze = settings.haze ? 1.0F : 0.0F;
  c.width = sector_.width;
  c.height = sector_.height;
  c.pixel = static_cast<float>(sector_.metres_per_pixel);
  c.picture_x = static_cast<float>(sector_.origin.x());
  c.picture_z = static_cast<float>(sector_.origin.y());
  c.tick_pitch = settings.depth_scale ? 0.010F : 0.0F;
}

void ScanModel::update(const state::FrameState& state) {
  Eigen::Isometry3f patient_from_probe = Eigen::Isometry3f::Identity();
  patient_from_probe.linear() = state.probe_orientation.normalized().toRotationMatrix();
  patient_from_probe.translation() = state.probe_position;
  const Eigen::Isometry3f probe_from_patient = patient_from_probe.inverse();
  slice_.cut(state, probe_from_patient);
  place_needle(state, probe_from_patient);
  constants_.origin = as_vec4(patient_from_probe.translation());
  constants_.lateral = as_vec4(patient_from_probe.linear().col(0));
  constants_.elevation = as_vec4(patient_from_probe.linear().col(1));
  constants_.axial = as_vec4(patient_from_probe.linear().col(2));
}

void ScanModel::place_needle(const state::FrameState& state, const Eigen::Isometry3f& probe_from_patient) {
  // Beyond three standard deviations of the widest beam a segment shows nothing.
  const float reach = 1.3F * static_cast<float>(elevation_fwhm(scan_.range(scan_.samples)));
  const float margin = 4 * kNeedleWidth + 2 * constants_.needle_radius;
  needle_.clear();
  Eigen::AlignedBox2f box;
  float from_tip = 0;
  for (std::size_t i = state.needle_positions.size(); i-- > 1;) {
    const Eigen::Vector3f a = probe_from_patient * state.needle_positions[i];
    const Eigen::Vector3f b = probe_from_patient * state.needle_positions[i - 1];
    const float length = (b - a).norm();
    const bool away = std::min(std::abs(a.y()), std::abs(b.y())) > reach && a.y() * b.y() > 0;
    if (!away && std::isfinite(length) && length > 0) {
      needle_.push_back({as_vec4(a, from_tip), as_vec4(b, from_tip + length)});
      box.extend(Eigen::Vector2f(a.x(), a.z()));
      box.extend(Eigen::Vector2f(b.x(), b.z()));
    }
    from_tip += length;
  }
  constants_.needle_segments = static_cast<int>(needle_.size());
  if (needle_.empty()) return;
  constants_.needle_min_x = box.min().x() - margin - kReverberations * kReverberationSpacing;
  constants_.needle_max_x = box.max().x() + margin + kReverberations * kReverberationSpacing;
  constants_.needle_min_z = box.min().y() - margin;
  constants_.needle_max_z = box.max().y() + margin + kReverberations * kReverberationSpacing;
}

}  // namespace stylet::ultrasound

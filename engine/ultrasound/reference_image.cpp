#include "engine/ultrasound/reference_image.h"

#include "engine/ultrasound/voxel_words.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::ultrasound {
namespace {

float unit(std::uint32_t bits) {
  return (static_cast<float>(bits >> 8U) + 0.5F) * (1.0F / 16777216.0F);
}

Eigen::Vector3f xyz(const vec4& v) {
  return {v.x, v.y, v.z};
}

float smoothstep(float a, float b, float x) {
  const float t = std::clamp((x - a) / (b - a), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

}  // namespace

ReferenceImager::ReferenceImager(const content::Scene& scene, const ImagerSettings& settings)
    : model_(scene, settings),
      lines_(model_.scan().lines),
      samples_(model_.scan().samples),
      looks_(settings.looks),
      textured_(settings.texture ? 1.0F : 0.0F) {
  const std::size_t size = static_cast<std::size_t>(lines_) * samples_;
  rest_.resize(size);
  mix_.resize(size);
  found_.resize(size);
  fronts_.resize(lines_);
  for (int k = 0; k < looks_; ++k) {
    echo_[k].resize(size);
    scratch_[k].resize(size);
  }
  loss_.resize(size);
  envelope_.resize(size);
  display_.resize(size);
  picture_.resize(static_cast<std::size_t>(settings.width) * settings.height);
}

const std::vector<std::uint8_t>& ReferenceImager::image(const state::FrameState& state) {
  model_.update(state);
  slice();
  follow_breath();
  mix_tissues();
  make_echoes();
  add_needle();
  add_wires();
  find_gas();
  add_gas();
  attenuate();
  convolve();
  detect();
  scan_convert();
  return picture_;
}

void ReferenceImager::slice() {
  const FrameConstants& c = model_.constants();
  const PlaneSlice& plane = model_.slice();
  for (int s = 0; s < samples_; ++s) {
    for (int l = 0; l < lines_; ++l) {
      const Eigen::Vector2f p = model_.scan().position(l, s).cast<float>();
      PlaneSlice::Place& rest = rest_[index(l, s)];
      rest = {xyz(c.origin) + p.x() * xyz(c.lateral) + p.y() * xyz(c.axial), xyz(c.elevation), -1};
      if (const auto place = plane.find(p, l, s)) rest = *place;
    }
  }
}

void ReferenceImager::follow_breath() {
  const FrameConstants& c = model_.constants();
  const int owner = static_cast<int>(c.breath.w);
  if (owner < 0) return;
  for (PlaneSlice::Place& rest : rest_) {
    if (rest.body >= 0) continue;
    const Eigen::Vector3f before = rest.position - xyz(c.breath);
    if (!breathes_at(voxel_position(before))) continue;
    rest.position = before;
    rest.body = owner;
  }
}

Eigen::Vector3f ReferenceImager::voxel_position(const Eigen::Vector3f& rest) const {
  const FrameConstants& c = model_.constants();
  return (rest - Eigen::Vector3f(c.label_x, c.label_y, c.label_z)) / c.label_spacing;
}

std::uint32_t ReferenceImager::voxel_at(const Eigen::Vector3i& voxel) const {
  const FrameConstants& c = model_.constants();
  const Eigen::Array3i last(c.label_nx - 1, c.label_ny - 1, c.label_nz - 1);
  const Eigen::Array3i v = voxel.array().max(0).min(last);
  if (((voxel.array() - v).abs() > kBeyond).any()) return kFarOutside;
  return model_.voxels()[(static_cast<std::size_t>(v.z()) * c.label_ny + v.y()) * c.label_nx + v.x()];
}

int ReferenceImager::tissue_of(std::uint32_t word, int body, bool gel) const {
  const FrameConstants& c = model_.constants();
  const int label = label_of(word);
  const int owner = owner_of(word);
  // The organ that was here at rest has moved away.
  if (owner >= 0 && owner != body) return c.filler_tissue;
  return label == 0 && gel ? c.gel_tissue : label;
}

/// Calls visit(word, trilinear weight) for the eight voxels around a place.
template <typename Visit>
void ReferenceImager::each_corner(const Eigen::Vector3f& voxel, Visit&& visit) const {
  const Eigen::Vector3f base = voxel.array().floor();
  const Eigen::Vector3f f = voxel - base;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i d(corner & 1, (corner >> 1) & 1, corner >> 2);
    float weight = 1;
    for (int axis = 0; axis < 3; ++axis) weight *= d[axis] != 0 ? f[axis] : 1 - f[axis];
    visit(voxel_at(base.cast<int>() + d), weight);
  }
}

/// The surface lies where the distances of the eight voxels around to it, counted negative on the other side, cancel.
ReferenceImager::Mixture ReferenceImager::mixture_at(const Eigen::Vector3f& voxel, int body, bool gel) const {
  const std::uint32_t here = voxel_at((voxel.array() + 0.5F).floor().matrix().cast<int>());
  const int tissue = tissue_of(here, body, gel);
  Mixture found{tissue, tissue, 1};
  if (clearance_of(here) >= 2) return found;
  float distance = 0;
  float most = 0;
  each_corner(voxel, [&](std::uint32_t word, float share) {
    const float weight = share * edge_of(word);
    const int there = tissue_of(word, body, gel);
    distance += there == tissue ? weight : -weight;
    if (there != tissue && weight > most) {
      most = weight;
      found.other = there;
    }
  });
  if (most > 0) found.share = std::clamp(0.5F + distance, 0.0F, 1.0F);
  return found;
}

bool ReferenceImager::breathes_at(const Eigen::Vector3f& voxel) const {
  const int breath = static_cast<int>(model_.constants().breath.w);
  const std::uint32_t here = voxel_at((voxel.array() + 0.5F).floor().matrix().cast<int>());
  if (clearance_of(here) >= 2) return owner_of(here) == breath;
  float distance = 0;
  each_corner(voxel, [&](std::uint32_t word, float share) {
    distance += share * (owner_of(word) == breath ? edge_of(word) : -edge_of(word));
  });
  return distance > 0;
}

Eigen::Vector3f ReferenceImager::lattice_at(const Eigen::Vector3f& x) {
  const float scale = 1.0F / kSpeckleSpacing;
  return scale * Eigen::Vector3f(kSpeckleX0 * x.x() + kSpeckleX1 * x.y() + kSpeckleX2 * x.z(),
                                 kSpeckleY0 * x.x() + kSpeckleY1 * x.y() + kSpeckleY2 * x.z(),
                                 kSpeckleZ0 * x.x() + kSpeckleZ1 * x.y() + kSpeckleZ2 * x.z());
}

std::size_t ReferenceImager::slow_texel(const Eigen::Vector3f& rest, int tissue) const {
  Eigen::Vector3f lattice = lattice_at(rest);
  const float layering = textured_ * model_.tissues()[tissue].layering;
  if (layering > 0) {
    const float finer = kTextureFwhm / kLayerFwhm;
    lattice = finer / layering * lattice + (finer - finer / layering) / kSpeckleSpacing *
                                               model_.layers().at(voxel_position(rest)) *
                                               Eigen::Vector3f(kLayerX, kLayerY, kLayerZ);
  }
  return SpeckleField::slow_texel(lattice.array().floor().matrix().cast<int>());
}

void ReferenceImager::mix_tissues() {
  for (int s = 0; s < samples_; ++s) {
    const bool gel = static_cast<float>(model_.scan().range(s)) < model_.constants().coupling;
    for (int l = 0; l < lines_; ++l) {
      const PlaneSlice::Place& rest = rest_[index(l, s)];
      const Mixture around = mixture_at(voxel_position(rest.position), rest.body, gel);
      const TissueRow& row = model_.tissues()[around.tissue];
      const TissueRow& other = model_.tissues()[around.other];
      const auto mixed = [&around](float of, float of_other) {
        return around.share * of + (1 - around.share) * of_other;
      };
      mix_[index(l, s)] = {mixed(row.log_impedance, other.log_impedance), mixed(row.loss, other.loss)};
      found_[index(l, s)] = around.share < 0.5F ? around.other : around.tissue;
    }
  }
}

void ReferenceImager::make_echoes() {
  const FrameConstants& c = model_.constants();
  const float ramp = std::max(c.label_spacing, 2 * c.sample_pitch);
  const int a = std::max(1, static_cast<int>(c.gradient_reach / c.sample_pitch + 0.5F));
  const auto log_impedance = [this](int l, int s) {
    return mix_[index(std::clamp(l, 0, lines_ - 1), std::clamp(s, 0, samples_ - 1))].log_impedance;
  };
  for (int s = 0; s < samples_; ++s) {
    const float range = (static_cast<float>(s) + 0.5F) * c.sample_pitch;
    const float pitch = c.face_radius == 0 ? c.line_pitch : (c.face_radius + range) * c.line_pitch;
    const int b = std::clamp(static_cast<int>(c.gradient_reach / pitch + 0.5F), 1, 16);
    const bool gel = range < c.coupling;
    const float* elevation = model_.beam().elevation.data() + static_cast<std::size_t>(s) * kElevationRow;
    const float plane_spacing = elevation[kElevationRow - 1];
    for (int l = 0; l < lines_; ++l) {
      const PlaneSlice::Place& rest = rest_[index(l, s)];
      const Mix& mix = mix_[index(l, s)];

      // Backscatter over the slice thickness. The tissue of each scatterer is drawn from the two around it, by bits
      // that belong to its place.
      Complex sum[kMaxLooks] = {};
      for (int off = -(c.planes / 2); off <= c.planes / 2; ++off) {
        const Eigen::Vector3f x = rest.position + static_cast<float>(off) * plane_spacing * rest.slope;
        const std::size_t texel = SpeckleField::texel(grain_at(x));
        const Mixture drawn = mixture_at(voxel_position(x), rest.body, gel);
        const auto bits = static_cast<float>(hash(static_cast<std::uint32_t>(texel)) >> 8U);
        const TissueRow& row = model_.tissues()[bits < 16777216.0F * drawn.share ? drawn.tissue : drawn.other];
        const float w = elevation[std::abs(off)] * row.backscatter * 0.70710678F;
        for (int k = 0; k < looks_; ++k) sum[k] += w * model_.speckle().look(k, texel);
      }
      float heat_loss = 0;
      if (c.zone_nx > 0) {
        const ScanModel::Heated heated = model_.heated_at(rest.position);
        const Eigen::Vector3i cell = cell_at(rest.position);
        const float patches = model_.speckle().slow(SpeckleField::slow_texel(cell)).imag();
        const float gain = std::exp(kCoagulatedEcho * heated.dead + kRimEcho * heated.rim);
        const float bubbles = 0.70710678F * kBubbleEcho * heated.gas * std::exp(kBubblePatches * patches);
        const std::size_t texel = SpeckleField::texel(grain_at(rest.position));
        for (int k = 0; k < looks_; ++k) sum[k] = gain * sum[k] + bubbles * model_.speckle().look(k, texel);
        heat_loss = kBubbleLoss * heated.gas + kCoagulatedLoss * heated.dead;
      }
      const TissueRow& row = model_.tissues()[found_[index(l, s)]];
      const std::size_t here = slow_texel(rest.position, found_[index(l, s)]);
      const Complex texture_and_beads = textured_ * model_.speckle().slow(here);
      const float slow = texture_and_beads.real();
      const float triads = smoothstep(kTriadThreshold, kTriadThreshold + kTriadEdge, slow);
      const float septa = std::exp(-slow * slow / (kSeptumWidth * kSeptumWidth)) *
                          smoothstep(kSeptumGap, kSeptumGap + 1, texture_and_beads.imag());
      const float texture = std::exp(textured_ * (row.texture * slow + row.triads * triads + row.septa * septa));

      // Interfaces: the jump of ln Z along the beam, and the angle from the corners of a wider square.
      const float jump = (log_impedance(l, s + 1) - log_impedance(l, s - 1)) / (2 * c.sample_pitch) * ramp;
      const float before_left = log_impedance(l - b, s - a);
      const float before_right = log_impedance(l + b, s - a);
      const float behind_left = log_impedance(l - b, s + a);
      const float behind_right = log_impedance(l + b, s + a);
      const float along =
          (behind_left - before_left + behind_right - before_right) / (4 * static_cast<float>(a) * c.sample_pitch);
      const float across =
          (before_right - before_left + behind_right - behind_left) / (4 * static_cast<float>(b) * pitch);
      const float slope = std::sqrt(along * along + across * across);
      const float cosine = slope > 1e-3F ? std::abs(along) / slope : 1.0F;
      const float reflection = std::tanh(0.5F * std::abs(jump));
      const float total = std::tanh(0.5F * slope * ramp);
      const float beads = std::exp((kBeadDb * texture_and_beads.imag() - kBeadDb) * 0.115129255F);
      const float mirror = kInterfaceGain * reflection * std::pow(cosine, kInterfaceExponent) * beads;
      const float diffuse = kInterfaceGain * total * kInterfaceDiffuse;
      for (int k = 0; k < looks_; ++k) {
        const Complex noise = model_.speckle().look(k, here % kSpeckleTexels);
        echo_[k][index(l, s)] = texture * sum[k] + mirror * kInterfaceCoherent +
                                (mirror * kInterfaceRough + diffuse) * 0.70710678F * noise;
      }
      const float crossing = -std::log(std::max(1 - reflection * reflection, 1e-4F)) / ramp;
      const float grazing = kGrazingLoss * (1 - cosine) * (1 - cosine) * std::min(1.0F, 20 * total);
      loss_[index(l, s)] = (mix.loss + heat_loss + crossing + grazing) * c.sample_pitch;
    }
  }
}

/// Calls visit(line, sample) for every sample that echoes of the needle or of wires reach.
template <typename Visit>
void ReferenceImager::each_thin_sample(Visit&& visit) const {
  const int columns = model_.slice().columns();
  for (const std::uint32_t tile : model_.thin_tiles()) {
    const int line = static_cast<int>(tile) % columns * kTile;
    const int sample = static_cast<int>(tile) / columns * kTile;
    for (int s = sample; s < std::min(sample + kTile, samples_); ++s) {
      for (int l = line; l < std::min(line + kTile, lines_); ++l) visit(l, s);
    }
  }
}

ReferenceImager::Nearest ReferenceImager::nearest_point(const Eigen::Vector2f& p, const Eigen::Vector2f& beam,
                                                        const Eigen::Vector3f& scale) const {
  // Across the beam, out of the plane, along the beam.
  const auto scaled = [&](const Eigen::Vector3f& v) -> Eigen::Vector3f {
    return scale.cwiseProduct(
        Eigen::Vector3f(v.x() * beam.y() - v.z() * beam.x(), v.y(), v.x() * beam.x() + v.z() * beam.y()));
  };
  Nearest found;
  for (const NeedleSegment& segment : model_.needle()) {
    const Eigen::Vector3f axis = xyz(segment.to) - xyz(segment.from);
    const float length = segment.to.w - segment.from.w;
    const Eigen::Vector3f to_p = scaled(Eigen::Vector3f(p.x(), 0, p.y()) - xyz(segment.from));
    const Eigen::Vector3f scaled_axis = scaled(axis);
    const float t = std::clamp(to_p.dot(scaled_axis) / scaled_axis.squaredNorm(), 0.0F, 1.0F);
    const float distance2 = (to_p - t * scaled_axis).squaredNorm();
    if (distance2 < found.distance2) {
      found = {distance2, segment.from.w + t * length, beam.dot(Eigen::Vector2f(axis.x(), axis.z())) / length};
    }
  }
  return found;
}

/// Share of the echo of a shaft square to the beam: mirror-like, and of the tip.
float ReferenceImager::mirror_law(const Nearest& at, const Eigen::Vector2f& beam) const {
  const vec4& bevel = model_.constants().bevel;
  const float sin2 = std::max(1 - at.along * at.along, 0.0F);
  const float tip = std::exp(-at.from_tip * at.from_tip / (kTipLength * kTipLength));
  const float facing = beam.x() * bevel.x + beam.y() * bevel.z;
  return kNeedleMirror * std::pow(sin2, 4.0F) + kNeedleFloor +
         tip * (kTipFloor + kBevelFlash * (bevel.w > 0 ? facing * facing : 0.5F * sin2));
}

void ReferenceImager::add_needle() {
  const FrameConstants& c = model_.constants();
  if (c.needle_segments == 0) return;
  each_thin_sample([&](int l, int s) {
    const float range = (static_cast<float>(s) + 0.5F) * c.sample_pitch;
    const float sigma = static_cast<float>(elevation_fwhm(model_.scene().probe, range)) * 0.42466090F;
    const float width = kNeedleWidth / c.grain;
    const Eigen::Vector3f scale(1 / width, 1 / sigma, 1 / width);
    const Eigen::Vector2f beam = model_.scan().direction(l).cast<float>();
    // The echo comes from the near side of the shaft.
    const Eigen::Vector2f p = model_.scan().position(l, s).cast<float>() + c.needle_radius * beam;
    const Nearest shaft = nearest_point(p, beam, scale);
    const float profile = std::exp(-0.5F * shaft.distance2);
    const float sin2 = std::max(1 - shaft.along * shaft.along, 0.0F);
    float mirror = profile * mirror_law(shaft, beam);
    const float rough = profile * kNeedleRough * sin2;
    const Nearest lobe = nearest_point(p, beam, {1 / kSideLobeWidth, scale.y(), scale.z()});
    mirror += kSideLobe * std::exp(-0.5F * lobe.distance2) * mirror_law(lobe, beam);
    // Copies arrive later. Those of a shaft that does not face the beam go elsewhere.
    float gain = kReverberationGain * std::pow(sin2, 4.0F);
    for (int n = 1; n <= kReverberations && kNeedleGain * gain > kLeastReverberation; ++n) {
      const Nearest copy = nearest_point(p - 2 * static_cast<float>(n) * c.needle_radius * beam, beam, scale);
      mirror += gain * std::exp(-0.5F * copy.distance2);
      gain *= kReverberationDecay;
    }
    const Eigen::Vector3f on_shaft(shaft.from_tip, 0, 0);
    const float ripple = model_.speckle().slow(SpeckleField::slow_texel(cell_at(on_shaft))).imag();
    mirror *= std::exp(textured_ * kNeedleRipple * (ripple - kNeedleRipple));
    const std::size_t texel = SpeckleField::texel(grain_at(on_shaft));
    for (int k = 0; k < looks_; ++k) {
      echo_[k][index(l, s)] += kNeedleGain * (mirror + rough * 0.70710678F * model_.speckle().look(k, texel));
    }
    // The profile integrates to sqrt(2 pi) sigma across the shaft.
    loss_[index(l, s)] += kNeedleShadow * profile * c.sample_pitch / (2.5066283F * width);
  });
}

void ReferenceImager::add_wires() {
  const FrameConstants& c = model_.constants();
  if (c.wires == 0) return;
  each_thin_sample([&](int l, int s) {
    const double range = model_.scan().range(s);
    const auto width = [&c](double pitch) {
      return std::max(kWireWidth / c.grain, kWirePitches * static_cast<float>(pitch));
    };
    const Eigen::Array3f scale =
        1 / Eigen::Array3f(width(model_.scan().lateral_pitch(range)),
                           static_cast<float>(elevation_fwhm(model_.scene().probe, range)) * 0.42466090F,
                           width(c.sample_pitch));
    const Eigen::Vector2f at = model_.scan().position(l, s).cast<float>();
    const Eigen::Vector2f beam = model_.scan().direction(l).cast<float>();
    // Across the beam, out of the plane, along the beam.
    const auto scaled = [&](const Eigen::Vector3f& v) -> Eigen::Vector3f {
      return scale * Eigen::Array3f(v.x() * beam.y() - v.z() * beam.x(), v.y(), v.x() * beam.x() + v.z() * beam.y());
    };
    float echo = 0;
    for (const WireSegment& wire : model_.wires()) {
      const Eigen::Vector3f to_p = scaled(Eigen::Vector3f(at.x(), 0, at.y()) - xyz(wire.from));
      const Eigen::Vector3f axis = scaled(xyz(wire.to) - xyz(wire.from));
      const float t = std::clamp(to_p.dot(axis) / axis.squaredNorm(), 0.0F, 1.0F);
      echo += ((1 - t) * wire.from.w + t * wire.to.w) * std::exp(-0.5F * (to_p - t * axis).squaredNorm());
    }
    for (int k = 0; k < looks_; ++k) echo_[k][index(l, s)] += echo;
  });
}

void ReferenceImager::attenuate() {
  const FrameConstants& c = model_.constants();
  for (int l = 0; l < lines_; ++l) {
    float lost = 0;
    if (textured_ != 0) {  // what is wrong with the contact belongs to the skin
      const Eigen::Vector2f face = model_.scan().position(l, -0.5).cast<float>();
      const Eigen::Vector3f skin = xyz(c.origin) + face.x() * xyz(c.lateral) + face.y() * xyz(c.axial);
      const Eigen::Vector3f cell = (kContactStretch * lattice_at(skin)).array().floor();
      lost = kContactDb * 0.115129255F * model_.speckle().slow(SpeckleField::slow_texel(cell.cast<int>())).imag();
    }
    for (int s = 0; s < samples_; ++s) {
      const std::size_t i = index(l, s);
      const float transmission = std::exp(-(lost + 0.5F * loss_[i]));
      lost += loss_[i];
      for (int k = 0; k < looks_; ++k) echo_[k][i] *= transmission;
    }
    if (c.haze == 0) continue;
    const float fresh = 1 - std::exp(-c.sample_pitch / kClutterLength);
    float above = 0;
    for (int s = 0; s < samples_; ++s) {
      const std::size_t i = index(l, s);
      const float range = (static_cast<float>(s) + 0.5F) * c.sample_pitch;
      float haze = kClutter * above;
      if (range < kHazeDepth) {
        haze += kHazeNear * std::exp(-range / kHazeNearDecay) + kHazeFar * std::exp(-range / kHazeFarDecay);
      }
      const float level = std::abs(echo_[0][i]);
      above += fresh * (level - above);
      if (haze < kLeastHaze * level) continue;
      // Fixed to the probe and smeared along the face.
      const Eigen::Vector2f p = model_.scan().position(l, s).cast<float>();
      const std::size_t texel = SpeckleField::texel(grain_at({0.2F * p.x(), 0.0F, range}));
      for (int k = 0; k < looks_; ++k) {
        echo_[k][i] += haze * 0.70710678F * model_.speckle().look(k, texel);
      }
    }
  }
}

void ReferenceImager::convolve() {
  for (int k = 0; k < looks_; ++k) {
    for (int s = 0; s < samples_; ++s) {
      const float* w = model_.beam().lateral.data() + static_cast<std::size_t>(s) * kLateralTaps;
      for (int l = 0; l < lines_; ++l) {
        Complex sum = w[0] * echo_[k][index(l, s)];
        for (int i = 1; i < kLateralTaps && w[i] > 0; ++i) {
          sum += w[i] * (echo_[k][index(std::max(l - i, 0), s)] + echo_[k][index(std::min(l + i, lines_ - 1), s)]);
        }
        scratch_[k][index(l, s)] = sum;
      }
    }
    for (int s = 0; s < samples_; ++s) {
      const float* w = model_.beam().axial.data() + static_cast<std::size_t>(s) * kAxialTaps;
      for (int l = 0; l < lines_; ++l) {
        Complex sum = w[0] * scratch_[k][index(l, s)];
        for (int i = 1; i < kAxialTaps && w[i] > 0; ++i) {
          sum += w[i] *
                 (scratch_[k][index(l, std::max(s - i, 0))] + scratch_[k][index(l, std::min(s + i, samples_ - 1))]);
        }
        echo_[k][index(l, s)] = sum;
      }
    }
  }
}

void ReferenceImager::detect() {
  const FrameConstants& c = model_.constants();
  for (int s = 0; s < samples_; ++s) {
    const float range = (static_cast<float>(s) + 0.5F) * c.sample_pitch;
    const auto sliders = static_cast<float>(slider_gain_db(model_.controls(), (s + 0.5) / samples_));
    for (int l = 0; l < lines_; ++l) {
      float intensity = 0;
      for (int k = 0; k < looks_; ++k) {
        const std::uint32_t counter = static_cast<std::uint32_t>((k * samples_ + s) * lines_ + l);
        const std::uint32_t first = hash(counter + hash(static_cast<std::uint32_t>(c.noise_seed)));
        const std::uint32_t second = hash(first);
        // Box-Muller; a complex number of mean square 1.
        const float modulus = c.noise * std::sqrt(-std::log(unit(first)));
        const float phase = 2 * kPi * unit(second);
        const Complex iq = echo_[k][index(l, s)] + modulus * Complex(std::cos(phase), std::sin(phase));
        intensity += std::norm(iq);
      }
      const float amplitude = std::sqrt(intensity / static_cast<float>(looks_));
      envelope_[index(l, s)] = amplitude;
      const float db = 8.6858896F * std::log(std::max(amplitude, 1e-9F)) + c.tgc * range + sliders;
      float& shown = display_[index(l, s)];
      const float now = std::clamp((db - c.white_db + c.dynamic_range) / c.dynamic_range, 0.0F, 1.0F);
      shown = c.persistence > 0 ? now + c.persistence * (shown - now) : now;
    }
  }
}

ReferenceImager::Pixel ReferenceImager::pixel(int u, int v) const {
  const FrameConstants& c = model_.constants();
  Pixel pixel;
  pixel.x = c.picture_x + (static_cast<float>(u) + 0.5F) * c.pixel;
  pixel.z = c.picture_z + (static_cast<float>(v) + 0.5F) * c.pixel;
  float across = pixel.x;
  pixel.range = pixel.z;
  if (c.face_radius != 0) {
    const float from_centre = pixel.z + c.face_radius;
    across = std::atan2(pixel.x, from_centre);
    pixel.range = std::sqrt(pixel.x * pixel.x + from_centre * from_centre) - c.face_radius;
  }
  pixel.line = (across - c.first_line) / c.line_pitch;
  pixel.sample = pixel.range / c.sample_pitch - 0.5F;
  pixel.in_sector = pixel.line >= -0.5F && pixel.line <= static_cast<float>(lines_) - 0.5F && pixel.sample >= -0.5F &&
                    pixel.sample <= static_cast<float>(samples_) - 0.5F;
  return pixel;
}

void ReferenceImager::scan_convert() {
  const FrameConstants& c = model_.constants();
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u) {
      const Pixel at = pixel(u, v);
      const float z = at.z;
      float grey = 0;
      if (at.in_sector) {
        const float fl = std::clamp(at.line, 0.0F, static_cast<float>(lines_ - 1));
        const float fs = std::clamp(at.sample, 0.0F, static_cast<float>(samples_ - 1));
        const int l = std::min(static_cast<int>(fl), lines_ - 2);
        const int s = std::min(static_cast<int>(fs), samples_ - 2);
        const float wl = fl - static_cast<float>(l);
        const float ws = fs - static_cast<float>(s);
        const float value = (1 - ws) * ((1 - wl) * display_[index(l, s)] + wl * display_[index(l + 1, s)]) +
                            ws * ((1 - wl) * display_[index(l, s + 1)] + wl * display_[index(l + 1, s + 1)]);
        const float curve = value * value * (3 - 2 * value);
        grey = (1 - kSCurve) * std::pow(value, kGreyGamma) + kSCurve * curve;
      }
      if (c.tick_pitch > 0 && z >= -0.5F * c.pixel && z <= static_cast<float>(samples_) * c.sample_pitch) {
        const float mark = std::floor(z / c.tick_pitch + 0.5F);
        const bool fifth = std::abs(mark - 5 * std::floor(mark / 5 + 0.5F)) < 0.5F;
        if (std::abs(z - mark * c.tick_pitch) <= 0.5F * c.pixel && u < c.width - 4 &&
            u >= c.width - (fifth ? 14 : 9)) {
          grey = 0.6F;
        }
      }
      picture_[static_cast<std::size_t>(v) * c.width + u] = static_cast<std::uint8_t>(grey * 255.0F + 0.5F);
    }
  }
}

}  // namespace stylet::ultrasound

// What is shown behind gas, in plain C++: shaders/ultrasound_gas.comp, line by line.
#include "engine/ultrasound/reference_image.h"

#include <algorithm>
#include <cmath>

namespace stylet::ultrasound {

void ReferenceImager::find_gas() {
  for (int l = 0; l < lines_; ++l) {
    int s = 0;
    const auto gas = [&] {
      const TissueRow& row = model_.tissues()[found_[index(l, s)]];
      return row.mirror + row.ring_down > 0;
    };
    while (s < samples_ && !gas()) ++s;
    fronts_[l] = s;
  }
}

int ReferenceImager::edge_of_surface(int line, int step, int reach) const {
  int last = line;
  const int most = static_cast<int>(kMirrorStep / model_.constants().sample_pitch + 0.5F);
  for (int i = 0; i < reach; ++i) {
    const int next = last + step;
    // Without gas it is as far away as can be.
    if (next < 0 || next >= lines_ || fronts_[next] == samples_ || std::abs(fronts_[next] - fronts_[last]) > most)
      break;
    last = next;
  }
  return last;
}

void ReferenceImager::add_gas() {
  for (int l = 0; l < lines_; ++l) {
    if (fronts_[l] < samples_) add_gas(l);
  }
}

void ReferenceImager::add_gas(int l) {
  const FrameConstants& c = model_.constants();
  const int front = fronts_[l];
  const TissueRow& gas = model_.tissues()[found_[index(l, front)]];
  const int margin = 1 + static_cast<int>(std::max(c.label_spacing, 2 * c.sample_pitch) / c.sample_pitch);
  const int before = std::max(front - margin, 0);
  if (front == 0 || found_[index(l, front - 1)] == c.gel_tissue) {
    for (int s = before; s < samples_; ++s) {
      for (int k = 0; k < looks_; ++k) echo_[k][index(l, s)] = 0;
    }
    return;
  }
  float surface = 0;
  for (int s = before; s <= std::min(front + margin, samples_ - 1); ++s) {
    surface = std::max(surface, std::abs(echo_[0][index(l, s)]));
    loss_[index(l, s)] = 0;
  }

  const auto range_of = [&c](int s) { return (static_cast<float>(s) + 0.5F) * c.sample_pitch; };
  const auto position = [this](int line, int s) -> Eigen::Vector2f {
    return model_.scan().position(line, s).cast<float>();
  };
  const float depth = range_of(front);
  const float pitch = c.face_radius == 0 ? c.line_pitch : (c.face_radius + depth) * c.line_pitch;
  const int reach = std::clamp(static_cast<int>(kMirrorReach / pitch + 0.5F), 1, 64);
  const int left = edge_of_surface(l, -1, reach);
  const int right = edge_of_surface(l, 1, reach);
  const Eigen::Vector2f beam = model_.scan().direction(l).cast<float>();
  const Eigen::Vector2f along = position(right, fronts_[right]) - position(left, fronts_[left]);
  const Eigen::Vector2f normal = left == right ? beam : Eigen::Vector2f(-along.y(), along.x()).normalized();
  const Eigen::Vector2f mirrored = beam - 2 * beam.dot(normal) * normal;
  const float facing = std::pow(std::abs(beam.dot(normal)), kInterfaceExponent);
  const Eigen::Vector2f from = position(l, front);
  const std::size_t texel = slow_texel(rest_[index(l, front)].position, found_[index(l, front)]);
  const float patch = std::clamp(model_.speckle().slow(texel).imag(), 0.0F, 1.0F);
  const float bubbles = patch * patch * (3 - 2 * patch);
  float lost = 0;
  for (int s = front; s < samples_; ++s) {
    const std::size_t here = index(l, s);
    const float range = range_of(s);
    const float behind = range - depth;
    const Eigen::Vector2d there = model_.scan().line_and_sample((from + behind * mirrored).cast<double>());
    const int line = static_cast<int>(std::floor(there.x() + 0.5));
    const int sample = static_cast<int>(std::floor(there.y() + 0.5));
    const bool seen = line >= 0 && line < lines_ && sample >= 0 && sample < samples_ &&
                      sample + margin < (fronts_[line] < samples_ ? fronts_[line] : samples_ + margin);
    const std::size_t image = seen ? index(line, sample) : here;
    if (seen) lost += loss_[image];
    const float mirror = seen && s > front + margin ? gas.mirror * std::exp(-behind / kMirrorLength - lost) : 0.0F;
    const float times = std::floor(range / depth + 0.5F);
    float off = (range - times * depth) / kRingWidth;
    const float on_the_way = std::exp(-c.tgc * 0.115129255F * behind);
    const float again =
        times < 1.5F ? 0.0F
                     : on_the_way * facing * std::pow(kFaceReverberation, times - 1) * std::exp(-0.5F * off * off);
    const float rings = std::floor(behind / kRingSpacing + 0.5F);
    off = (behind - rings * kRingSpacing) / kRingWidth;
    const float ringing = gas.ring_down > 0 && rings > 0.5F
                              ? kRing * bubbles * std::pow(gas.ring_down, rings) * std::exp(-0.5F * off * off)
                              : 0.0F;
    const float dirty =
        (gas.ring_down > 0 ? kDirty : kDirtySmooth * kDirty) * on_the_way * std::exp(-behind / kDirtyLength);
    const std::size_t speckle = SpeckleField::texel(grain_at({from.x(), from.y(), range}));
    for (int k = 0; k < looks_; ++k) {
      const Complex own = s <= front + margin ? echo_[k][here] : Complex(0);
      echo_[k][here] = own + mirror * echo_[k][image] + surface * (again + ringing) +
                       surface * dirty * 0.70710678F * model_.speckle().look(k, speckle);
    }
    loss_[here] = 0;
  }
}

}  // namespace stylet::ultrasound

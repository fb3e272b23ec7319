#include "engine/session/picture_watch.h"

#include <algorithm>
#include <cmath>

namespace stylet::session {
namespace {

constexpr double kRecent = 0.5;  // s

std::int64_t nanoseconds(double seconds) {
  return std::llround(seconds * 1e9);
}

}  // namespace

void PictureWatch::shown(const ShownPicture& picture) {
  const std::uint64_t made = picture.images < last_images_ ? picture.images : picture.images - last_images_;
  last_images_ = picture.images;
  ++frames_;
  images_ += made;
  scale_sum_ += picture.scale;
  if (picture.needle_age_s) {
    needle_age_.add(nanoseconds(*picture.needle_age_s));
    gathering_.needle_age_s = std::max(gathering_.needle_age_s, *picture.needle_age_s);
  }
  if (picture.ultrasound_age_s) {
    ultrasound_age_.add(nanoseconds(*picture.ultrasound_age_s));
    gathering_.ultrasound_age_s = std::max(gathering_.ultrasound_age_s, *picture.ultrasound_age_s);
  }
  if (last_s_) {
    const double frame_s = picture.clock_s - *last_s_;
    frame_time_.add(nanoseconds(frame_s));
    seconds_ += frame_s;
    gathered_s_ += frame_s;
    gathering_.frames_per_second += 1;
    gathering_.images_per_second += static_cast<double>(made);
  }
  last_s_ = picture.clock_s;
  if (gathered_s_ < kRecent) return;
  recent_ = gathering_;
  recent_.frames_per_second /= gathered_s_;
  recent_.images_per_second /= gathered_s_;
  gathering_ = {};
  gathered_s_ = 0;
}

PictureSummary PictureWatch::summary() const {
  const double frames = static_cast<double>(frames_);
  return {.frames = frames_,
          .frames_per_second = seconds_ > 0 ? static_cast<double>(frame_time_.count()) / seconds_ : 0,
          .frame_time = frame_time_.quantiles(),
          .needle_age = needle_age_.quantiles(),
          .mean_scale = frames_ > 0 ? scale_sum_ / frames : 1,
          .images = images_,
          .images_per_second = seconds_ > 0 ? static_cast<double>(images_) / seconds_ : 0,
          .ultrasound_age = ultrasound_age_.quantiles()};
}

}  // namespace stylet::session

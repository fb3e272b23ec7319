// How often the pictures of a running session came, and how old what they show was.
#pragma once

#include "haptic/latency_histogram.h"

#include <cstdint>
#include <optional>

namespace stylet::session {

/// A picture that was handed to the window system or the headset. Times in s; those of the session by its own clock.
struct ShownPicture {
  double clock_s = 0;  ///< when, by any steady clock
  /// From the haptic step whose needle it shows to then. Not set: session time does not go by the clock (lockstep,
  /// a pause).
  std::optional<double> needle_age_s{};
  std::optional<double> ultrasound_age_s{};  ///< the same from the moment that its ultrasound image shows
  std::uint64_t images = 0;                  ///< ultrasound images that the scanner has made so far
  double scale = 1;                          ///< of width and height that the 3-D view was drawn with
};

/// Over a session. A software rasteriser has drawn a picture when it is handed over; a GPU may need its time and the
/// display's on top.
struct PictureSummary {
  std::uint64_t frames = 0;
  double frames_per_second = 0;
  haptic::LatencyQuantiles frame_time{};  ///< between two pictures
  haptic::LatencyQuantiles needle_age{};
  double mean_scale = 1;
  std::uint64_t images = 0;
  double images_per_second = 0;
  haptic::LatencyQuantiles ultrasound_age{};
};

/// Over the last half second or so: for the screen.
struct RecentPictures {
  double frames_per_second = 0;  ///< 0: not known yet
  double needle_age_s = 0;       ///< of the oldest
  double images_per_second = 0;
  double ultrasound_age_s = 0;  ///< of the oldest
};

/// One thread.
class PictureWatch {
public:
  void shown(const ShownPicture& picture);
  /// Nothing is shown for a while, because nobody can see it: the next picture comes late through nobody's fault.
  void interrupted() { last_s_.reset(); }

  PictureSummary summary() const;
  const RecentPictures& recent() const { return recent_; }

private:
  std::optional<double> last_s_;
  std::uint64_t last_images_ = 0;
  double seconds_ = 0;    // between pictures
  double scale_sum_ = 0;  // over frames
  std::uint64_t frames_ = 0;
  std::uint64_t images_ = 0;
  haptic::LatencyHistogram frame_time_;
  haptic::LatencyHistogram needle_age_;
  haptic::LatencyHistogram ultrasound_age_;
  RecentPictures recent_;
  RecentPictures gathering_;  // counts in place of rates
  double gathered_s_ = 0;
};

}  // namespace stylet::session

// The scanner of a running session: commands turn its knobs, its image and screen follow.
#pragma once

#include "engine/content/scene.h"
#include "engine/content/texts.h"
#include "engine/figures/canvas.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/image.h"
#include "engine/picture/picture.h"
#include "engine/readers/tissue_watch.h"
#include "engine/render/renderer.h"
#include "engine/scanner/calipers.h"
#include "engine/scanner/saved_image.h"
#include "engine/scanner/scanner_console.h"
#include "engine/state/frame_state.h"
#include "engine/ultrasound/imager.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::scanner {

class LiveScanner;

/// Gets the images of a scanner for others, and does at it what they ask for; on its thread.
class ImageWatcher {
public:
  virtual ~ImageWatcher() = default;
  /// With each LiveScanner::poll().
  virtual void operate(LiveScanner&, double /*time_s*/) {}
  /// @param bare  B-mode alone, grey
  virtual void imaged(const state::FrameState& state, const ultrasound::SectorGeometry& sector,
                      const picture::Picture& bare) = 0;
};

/// Thread: the one that uses the device.
class LiveScanner {
public:
  /// Keeps references to `device` and `scene`. The tissue table is watched, its acoustics show when it is written.
  LiveScanner(gpu::Device& device, const content::Scene& scene, const ScannerConsole& console);
  /// Waits for what uses the screen.
  ~LiveScanner() { device_.settle(); }
  LiveScanner(const LiveScanner&) = delete;
  LiveScanner& operator=(const LiveScanner&) = delete;

  /// @param time_s  of the session; so for all
  void apply(const Command& command, double time_s);
  /// Where SaveImage puts its images from now on; null, as at first: nobody keeps them.
  void keep_images(SavedImages* images) { saved_ = images; }
  /// The language of what say() shows; null: English.
  void speak(const content::Texts* texts) { texts_ = texts; }
  /// Shows a line at the bottom of the screen for a while; empty: takes it away.
  void say(const std::string& message, double time_s);
  /// With each frame: whether the tissue table was written, what the watcher wants.
  void poll(double time_s);
  /// Makes image and screen of `state` where an image is due: the scanner has its own rate, that of its lines and
  /// depth (ultrasound::image_rate_hz) in the time of the states, and while that stands nothing is made again. What a
  /// knob or a message changes shows at once, and so does a core that was cut: its strip is laid beside the image. A
  /// frozen scanner keeps its image.
  void draw(const state::FrameState& state);
  /// Images come less often where they would take more than this share of the time there is: so that a picture
  /// beside them stays alive where a processor draws both. 0, as at first: as often as they are due.
  void limit_share(double share) { most_share_ = share; }
  /// Made so far.
  std::uint64_t images() const { return images_; }
  /// Times that the screen was made: where it has not changed, nor has what in_view() shows.
  std::uint64_t screens() const { return screens_; }
  /// Session time of the state that the image shows, s.
  double imaged_s() const { return imaged_s_; }
  /// Images a second as they come now.
  double rate_hz() const { return 1 / period_s(); }

  /// Gets every image from now on, none of a frozen scanner; null: nobody does.
  void watch(ImageWatcher* watcher) { watcher_ = watcher; }

  /// Image, settings and scales, as on a machine's screen. sRGB.
  const gpu::Image& screen() const { return screen_; }
  /// The bare image where the probe's plane lies in the 3-D view.
  render::PlaneTexture in_view() const;
  /// Time the GPU spent on the passes of the image last made.
  std::vector<gpu::Timestamps::Span> pass_times() const { return imager_->pass_times(); }
  const ScannerConsole& console() const { return console_; }
  /// Marks in the image plane. They go when the image goes on.
  const Calipers& calipers() const { return calipers_; }
  /// The line at the bottom of the screen, empty: none.
  const std::string& note() const { return note_; }

private:
  void make_imager();
  void take_cores(std::span<const state::CoreTrack> cores);
  void make_image(const state::FrameState& state);
  void show();
  /// The bare image with all that stands beside it.
  void compose(picture::Picture& bare, const std::string& note) const;
  void point(const Point& point);
  void save_image(double time_s);
  double period_s() const;

  gpu::Device& device_;
  const content::Scene& scene_;
  ScannerConsole console_;
  readers::TissueWatch tissues_;
  figures::Font font_ = figures::Font::load();
  ultrasound::Preset preset_;  ///< of the imager
  std::optional<ultrasound::Imager> imager_;
  gpu::Image screen_;
  gpu::Commands commands_;  ///< that make an image
  gpu::Commands upload_;    ///< that fill the screen
  gpu::Buffer read_back_;   ///< where the image comes to the host
  picture::Picture bare_;   ///< the image last made, grey
  std::uint64_t screens_ = 0;
  std::string message_;  ///< shown for a while, before why the image is black
  double message_until_s_ = 0;
  std::string diagnosis_;
  double diagnosed_s_ = -1;
  std::string note_;
  bool touched_ = true;  ///< since image and screen were made
  bool marked_ = false;  ///< on the screen since it was made
  Calipers calipers_;
  double probe_force_ = 0;  ///< of the image, N
  std::vector<state::CoreTrack> cores_;
  SavedImages* saved_ = nullptr;
  const content::Texts* texts_ = nullptr;
  std::uint64_t images_ = 0;
  double imaged_s_ = -1;
  double next_image_s_ = 0;
  double most_share_ = 0;
  double cost_s_ = 0;  ///< what an image takes, smoothed
  ImageWatcher* watcher_ = nullptr;
};

}  // namespace stylet::scanner

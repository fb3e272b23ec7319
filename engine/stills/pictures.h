// The two pictures of a moment, in host memory: the 3-D view and the ultrasound image; and both in one video frame.
#pragma once

#include "engine/content/scene.h"
#include "engine/figures/canvas.h"
#include "engine/figures/force_trace.h"
#include "engine/gpu/device.h"
#include "engine/picture/picture.h"
#include "engine/render/renderer.h"
#include "engine/state/frame_state.h"
#include "engine/ultrasound/imager.h"

#include <cstdint>
#include <string>
#include <vector>

namespace stylet::stills {

struct PictureSettings {
  int view_width = 1280;
  int view_height = 720;
  int ultrasound_width = 640;
  int ultrasound_height = 480;
  bool stereo = false;     ///< the view holds both eyes side by side, each view_width wide
  std::uint32_t seed = 1;  ///< of speckle and noise
  bool room = true;        ///< the view shows the operating room; else a plain ground, as data sets want it
  /// Four samples a pixel of the view; else its edges are smoothed afterwards, a third of the time on a processor.
  bool multisample = true;
  bool notes = true;  ///< a black ultrasound image says at its bottom why
};

/// Draws a scene's moments on a GPU and brings them home: the ultrasound in the preset and with the knobs of the
/// scene's probe, but without persistence, so that each picture stands for itself. One thread.
class Pictures {
public:
  Pictures(gpu::Device& device, const content::Scene& scene, const PictureSettings& settings);

  struct Moment {
    picture::Picture view;        ///< 3-D view; the probe's image plane shows the ultrasound image; sRGB
    picture::Picture ultrasound;  ///< B-mode image, grey
  };
  Moment draw(const state::FrameState& state, const content::Camera& camera);
  /// Why the ultrasound image last drawn is black; empty: it shows something.
  const std::string& note() const { return note_; }
  /// Label map of the ultrasound image last drawn; see ultrasound::Imager::read_label_map.
  std::vector<std::uint8_t> ultrasound_labels() { return imager_.read_label_map(); }

  /// Labels and depths of the view last drawn, both eyes side by side as there; see render::LabelPass.
  render::ViewLabels view_labels();

private:
  picture::Picture read_view() const;

  gpu::Device& device_;
  bool stereo_;
  bool multisample_;
  bool notes_;
  ultrasound::Imager imager_;
  figures::Font font_ = figures::Font::load();
  std::string note_;
  render::Renderer renderer_;
};

/// A frame of session.mp4: the 3-D view on the left, the ultrasound image, cores laid beside it, above the live force
/// curve on the right (picture::PaneLayout), captions over the view.
picture::Picture compose_frame(const Pictures::Moment& moment, const state::FrameState& state,
                               const content::Scene& scene, const figures::ForceTrace& trace,
                               const figures::Font& font, int width, int height);

/// "tip to target 12 mm   " for captions; empty without a target.
std::string distance_in_words(const state::FrameState& state);

}  // namespace stylet::stills

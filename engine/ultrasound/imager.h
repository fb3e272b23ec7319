// The B-mode image of the simulated patient, on the GPU.
//
// The image plane cuts the deformed tetrahedra; every sample of every scan line is carried back to rest space, where
// the tissue labels and the speckle live, so that both follow the tissue. The chain is that of engine/ultrasound/
// reference_image.h, pass by pass, one shader each (shaders/ultrasound_*.comp):
//   tissue -> interface -> needle -> gas -> attenuate -> lateral -> axial -> detect -> scan conversion
#pragma once

#include "engine/content/scene.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/image.h"
#include "engine/state/frame_state.h"
#include "engine/ultrasound/scan_geometry.h"
#include "engine/ultrasound/scan_model.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace stylet::ultrasound {

/// Makes B-mode images of one scene. Thread: the one that uses the device.
///
///   ultrasound::Imager imager(device, scene);
///   const gpu::Image& picture = imager.image(state);   // or record(commands, state), to join a frame
class Imager {
public:
  /// Uploads labels, tissues and speckle. Keeps references to `device` and `scene`.
  /// @throws files::ContentError when the scene's probe or label volume cannot be imaged
  Imager(gpu::Device& device, const content::Scene& scene, const ImagerSettings& settings = {});
  ~Imager();
  Imager(const Imager&) = delete;
  Imager& operator=(const Imager&) = delete;

  /// Records the passes that make the image of `state`, probe pose included. image() holds it once they have run.
  void record(gpu::Commands& commands, const state::FrameState& state);
  /// The same, submitted and waited for.
  const gpu::Image& image(const state::FrameState& state);
  /// The next image is a first one: none before it persists in it.
  void restart();

  const ScannerControls& controls() const;
  /// From the next image on; limited to what the probe can do. geometry() and scan() follow.
  /// @return  what was limited, for the user; empty: nothing
  std::string set_controls(const ScannerControls& controls);
  /// From the next image on: other speckle and noise.
  void set_seed(std::uint32_t seed);
  /// From the next image on: the acoustics of these tissues, in the order of the scene's.
  void set_acoustics(std::span<const content::Tissue> tissues);
  /// The picture last made: the sector, grey on black, RGBA8 [width x height].
  const gpu::Image& image() const;

  /// Grey values of the picture last made, row by row from the top. [width * height]
  std::vector<std::uint8_t> read_back();
  /// Its envelope before depth gain and log compression, 1 = rms of liver. [sample][line], lines of scan()
  std::vector<float> read_back_envelope();

  /// Why the image last made is black, one line; empty: it shows something.
  std::string diagnosis() const;

  /// What each pixel of the picture last made shows: indices of content::PictureLabels, row by row from the top.
  /// Nearest tissue, not interpolated; a pass of its own, which runs only here. [width * height]
  std::vector<std::uint8_t> read_label_map();

  /// GPU time of each pass of the picture last made; call when it is done.
  std::vector<gpu::Timestamps::Span> pass_times() const;

  const SectorGeometry& geometry() const;
  const ScanGeometry& scan() const;

private:
  struct Passes;
  std::unique_ptr<Passes> passes_;
};

}  // namespace stylet::ultrasound

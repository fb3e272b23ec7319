// The monitor in the room that tells a trainee in a headset of the session: what to do, force against depth, and for
// an instructor where the tip is and what to warn of. Drawn with Dear ImGui, the pieces those of the desktop's
// panels.
#pragma once

#include "engine/gpu/device.h"
#include "engine/immersive/monitor.h"
#include "engine/panels/session_facts.h"
#include "engine/render/view_options.h"

#include <cstdint>

namespace stylet::immersive {

/// What a press of the panel's button goes through.
enum class PanelLevel : std::uint8_t {
  panel,
  instructor,  ///< more on the panel, and patient and drape are glass
  hidden,      ///< no monitor in the room
};
PanelLevel next(PanelLevel level);
/// How far one sees into the patient then.
render::SeeThrough see_through(PanelLevel level);

/// Is a Monitor. Thread: the one that uses the device.
class SessionPanel {
public:
  /// @param asks  a button asks the patient to hold the breath. @throws gpu::GpuError
  explicit SessionPanel(gpu::Device& device, bool left_handed = false, bool asks = false)
      : left_handed_(left_handed), asks_(asks), monitor_(device) {}

  /// Draws anew where `level` is another or kPeriod has passed: what stands there is to be read, not to be followed.
  /// @param now_s  of a clock that goes on while the session is paused
  void draw(const panels::SessionFacts& facts, PanelLevel level, double now_s);
  /// As last drawn; null: the monitor is hidden. R8G8B8A8_SRGB.
  const gpu::Image* picture() const { return level_ == PanelLevel::hidden ? nullptr : &monitor_.picture(); }

  static constexpr double kPeriod = 0.1;  ///< s

private:
  bool left_handed_;
  bool asks_;
  Monitor monitor_;
  PanelLevel level_ = PanelLevel::hidden;
  double drawn_s_ = 0;
};

}  // namespace stylet::immersive

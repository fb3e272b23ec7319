// Who trains, asked in the headset before the briefing: the choice on the monitor in the room, the controllers'
// buttons its keys.
#pragma once

#include "engine/content/texts.h"
#include "engine/headset/headset_controllers.h"
#include "engine/immersive/monitor.h"
#include "engine/immersive/thumb.h"
#include "engine/panels/trainee_choice.h"
#include "engine/view/input.h"

namespace stylet::immersive {

/// The buttons of a frame as keys of a TraineeChoice, so that any controller does: a stick goes about, the panel's
/// button goes round, a trigger takes, the menu button goes back. Thread: the display's.
class HandsOnChoice {
public:
  /// @param time_s  of the display
  view::Input keys(const headset::Hands& hands, double time_s);

private:
  Thumb thumb_;
  bool trigger_ = true;  ///< of the hand with the needle; one that was held before is no press
};

/// Is a Monitor. Thread: the one that uses the device.
class TraineePanel {
public:
  /// @throws gpu::GpuError
  explicit TraineePanel(gpu::Device& device, bool left_handed = false)
      : left_handed_(left_handed), monitor_(device) {}

  /// @param dt_s  since the frame before
  void draw(panels::TraineeChoice& choice, const content::Texts& texts, double dt_s);
  /// As last drawn. R8G8B8A8_SRGB.
  const gpu::Image& picture() const { return monitor_.picture(); }

private:
  bool left_handed_;
  Monitor monitor_;
};

}  // namespace stylet::immersive

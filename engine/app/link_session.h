// A session that 3D Slicer and PLUS see and move.
#pragma once

#include "engine/app/observer.h"
#include "engine/gpu/device.h"
#include "engine/link/link.h"
#include "engine/scanner/live_scanner.h"
#include "engine/session/live_session.h"
#include "engine/training/training_session.h"

#include <optional>
#include <string>
#include <vector>

namespace stylet::app {

struct SessionLinkSettings {
  std::optional<link::Endpoint> listen{};  ///< where clients connect to; nothing: they cannot
  std::optional<link::Endpoint> source{};  ///< a server whose probe and needle are taken in
  double image_hz = 20;                    ///< most images a second for the clients
  double transform_hz = 50;                ///< transforms a second for the clients
  bool wanted() const { return listen || source; }
};

/// Nothing happens in it where no link is wanted. Thread: main.
class LinkSession final : public scanner::ImageWatcher {
public:
  /// Keeps references to `scene` and `live`. @throws link::LinkError
  LinkSession(const SessionLinkSettings& settings, const content::Scene& scene, const session::LiveSession& live,
              const link::LinkInputs& inputs);

  /// When the loops have started. Notes where clients connect to.
  void start(Observer& observer);
  /// Of every image of the window's scanner.
  void imaged(const state::FrameState& state, const ultrasound::SectorGeometry& sector,
              const picture::Picture& bare) override;
  /// Does what clients ask of the scanner, and answers them.
  void operate(scanner::LiveScanner& scanner, double time_s) override;
  /// Passes some time of a session without a window: makes an image while a client is there, else sleeps.
  /// @param device  null: there is none for images. @throws gpu::GpuError
  void pass_time(gpu::Device* device, const training::TrainingSession& course);
  /// Lets go of the device, before it is destroyed.
  void drop_scanner() { scanner_.reset(); }
  /// After the session. @return what went over it, a line each
  std::vector<std::string> stop();

private:
  const content::Scene& scene_;
  const session::LiveSession& live_;
  SessionLinkSettings settings_;
  std::optional<link::Link> link_;
  link::LinkImage image_;
  link::Clock::time_point next_image_{};
  std::optional<scanner::LiveScanner> scanner_;  ///< of a session without a window
  state::FrameState frame_;
};

}  // namespace stylet::app

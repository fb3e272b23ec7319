#include "engine/app/ask_trainee.h"

#include "engine/app/headset_session.h"
#include "engine/app/load_scene.h"
#include "engine/app/session_window.h"
#include "engine/app/trainee_door.h"
#include "engine/files/error.h"
#include "engine/headset/headset_runtime.h"
#include "engine/readers/texts_file.h"

#include <memory>
#include <optional>

namespace stylet::app {

namespace {

/// @return none: no headset answers
std::optional<bool> chosen_in_a_headset(const SessionSettings& settings, panels::TraineeChoice& choice,
                                        const content::Texts& texts, Observer& observer) {
  try {
    headset::HeadsetRuntime runtime;
    const content::Scene scene = load_scene(settings.scenario, observer);
    gpu::Device device(gpu::DeviceSettings{.gpu = settings.gpu, .maker = &runtime});
    return chosen_in_headset(runtime, device, scene, choice, texts, settings.left_handed, observer);
  } catch (const headset::HeadsetError&) {  // which the session will say
    return std::nullopt;
  }
}

bool chosen(const SessionSettings& settings, panels::TraineeChoice& choice, Observer& observer) {
  const content::Texts texts = readers::find_texts(settings.language);
  if (settings.view == SessionView::headset) {
    if (const auto there = chosen_in_a_headset(settings, choice, texts, observer)) return *there;
  }
  if (!has_display()) {
    throw files::ContentError(
        "--ask-trainee: there is no display and no headset to ask in; say who it is with --trainee NAME");
  }
  Screen screen;
  gpu::Device device(
      gpu::DeviceSettings{.gpu = settings.gpu, .window_extensions = screen.display().vulkan_extensions()});
  screen.open(device, "Stylet");
  const bool in_window = chosen_in_window(screen, choice, texts, observer);
  screen.close();  // before its device
  return in_window;
}

}  // namespace

bool chosen_in_window(Screen& screen, panels::TraineeChoice& choice, const content::Texts& texts,
                      Observer& observer) {
  panels::TraineeWish wish = panels::TraineeWish::nothing;
  show_panels(screen, observer, [&](const view::Input& input, int width, int height) {
    const panels::TraineeWish by_keys = choice.handle(input), by_pointer = choice.draw(width, height, texts);
    wish = by_keys != panels::TraineeWish::nothing ? by_keys : by_pointer;
    return wish != panels::TraineeWish::nothing;
  });
  return wish == panels::TraineeWish::chosen;
}

bool ask_trainee(SessionSettings& settings, Observer& observer) {
  const std::unique_ptr<TraineeDoor> door = TraineeDoor::at(settings.trainee.lab);
  if (!door) return true;
  panels::TraineeChoice choice = door->choice();
  choice.choose(settings.trainee.name);
  if (!chosen(settings, choice, observer)) return false;
  settings.trainee.name = choice.pseudonym();
  return true;
}

}  // namespace stylet::app

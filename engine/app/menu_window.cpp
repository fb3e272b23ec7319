#include "engine/app/menu_window.h"

#include "engine/app/ask_trainee.h"
#include "engine/app/screen.h"
#include "engine/app/trainee_door.h"
#include "engine/desktop/menu.h"
#include "engine/files/error.h"
#include "engine/panels/trainee_choice.h"
#include "engine/readers/scenario.h"
#include "engine/readers/texts_file.h"

#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace stylet::app {

namespace {

desktop::Menu make_menu() {
  const auto folder = readers::content_directory() / "scenarios";
  std::vector<desktop::MenuItem> scenarios;
  for (const readers::ScenarioEntry& entry : readers::list_scenarios(folder)) {
    if (!entry.unreadable_because.empty()) continue;
    const std::size_t colon = entry.title.find(": ");
    desktop::MenuItem item{.name = entry.path.string(), .title = entry.title.substr(0, colon)};
    if (colon != std::string::npos) item.about = entry.title.substr(colon + 2);
    // Whoever has never done it begins with the tutorial.
    scenarios.insert(entry.name == "tutorial" ? scenarios.begin() : scenarios.end(), std::move(item));
  }
  std::vector<desktop::MenuItem> languages;
  for (const std::string& language : readers::languages()) {
    languages.push_back({.name = language, .title = readers::language_name(language)});
  }
  if (scenarios.empty()) throw files::ContentError(folder.string() + ": holds no scenario that can be read");
  return {std::move(scenarios),
          {{.name = "", .title = "The stylus that is connected, else mouse and keyboard"},
           {.name = "mouse", .title = "Mouse and keyboard"},
           {.name = "recorded", .title = "Nobody: a demonstration"}},
          {{.name = "window", .title = "In this window"}, {.name = "headset", .title = "In a headset (OpenXR)"}},
          std::move(languages)};
}

/// @return false: the user leaves
bool chosen_in(desktop::Menu& menu, const std::string& gpu_name, std::string& trainee, Observer& observer) {
  std::optional<gpu::Device> device;
  Screen screen;
  device.emplace(gpu::DeviceSettings{.gpu = gpu_name, .window_extensions = screen.display().vulkan_extensions()});
  screen.open(*device, "Stylet");
  desktop::MenuWish wish = desktop::MenuWish::nothing;
  std::string language = menu.language();
  content::Texts texts = readers::find_texts(language);
  const auto asked_who = [&] {
    try {
      const std::unique_ptr<TraineeDoor> door = TraineeDoor::at({});
      if (!door) return true;
      panels::TraineeChoice choice = door->choice();
      choice.choose(trainee);
      if (!chosen_in_window(screen, choice, texts, observer)) return false;
      trainee = choice.pseudonym();
      return true;
    } catch (const files::ContentError& error) {  // of the records
      menu.say(error.what());
      return false;
    }
  };
  do {
    wish = desktop::MenuWish::leave;  // where the observer asks for it
    show_panels(screen, observer, [&](const view::Input& input, int width, int height) {
      const desktop::MenuWish by_keys = menu.handle(input), by_pointer = menu.draw(width, height, texts);
      if (language != menu.language()) texts = readers::find_texts(language = menu.language());
      const desktop::MenuWish asked = by_pointer != desktop::MenuWish::nothing ? by_pointer : by_keys;
      if (asked == desktop::MenuWish::nothing) return false;
      wish = asked;
      return true;
    });
  } while (wish == desktop::MenuWish::start && !asked_who() && !observer.stop_requested());
  screen.close();  // before its device
  return wish == desktop::MenuWish::start && !observer.stop_requested();
}

}  // namespace

void run_from_menu(const SessionSettings& settings, SessionObserver& observer,
                   const std::function<void(const SessionSettings&, const SessionResult&)>& done) {
  desktop::Menu menu = make_menu();
  menu.set_language(readers::language_of_environment());
  std::string trainee;
  while (chosen_in(menu, settings.gpu, trainee, observer)) {
    SessionSettings chosen = settings;
    chosen.trainee.name = trainee;
    chosen.scenario = menu.scenario();
    chosen.stylus = menu.stylus();
    chosen.language = menu.language();
    chosen.left_handed = menu.left_handed();
    chosen.view = menu.view() == "headset" ? SessionView::headset : SessionView::window;
    menu.say("");
    try {
      done(chosen, run_session(chosen, observer));
    } catch (const Stopped&) {
      throw;
    } catch (const std::exception& error) {
      menu.say(error.what());
      observer.note(Note::notice, error.what());
    }
  }
}

}  // namespace stylet::app

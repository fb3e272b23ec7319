// What the runtime does under a program that knows nothing of it:
//
//   STYLET_MOCK_OPENXR="size=640x640 lose=90"
//
// size=WxH     of each eye
// absent       no headset is connected
// steady=MS    time goes on by so much with each frame, however long it takes; else in real time
// resize=N     half the size after N frames
// lose=N       the headset goes after N frames
// end=N        the session ends for good after N frames
// breath=N     the right hand presses its upper button at frame N
// menu=N       the left hand presses its menu button after N frames, and lets go two later
// yaw=A, pitch=A  of the head, degrees; without: it looks down at the table
// trigger=N    the right hand pulls its trigger at frame N
// panel=N, panel2=N  the left, the right hand presses its lower button after N frames
// stage=CM     the runtime knows the floor, so far below the head
// felt=FILE    appends "HAND AMPLITUDE" of every vibration
// errors=FILE  appends every call that was refused
// left=FILE, right=FILE  a recent frame of an eye, as PPM
//
// Head and hands move a little: the head looks down at the table, the right hand comes nearer to it,
// the left hand slides aside.
#include "tests/support/openxr/state.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

namespace stylet::mock_xr {

namespace {

struct Plan {
  std::map<std::string, std::string> words;
  float degrees(const char* word, float otherwise) const {
    const auto found = words.find(word);
    return found == words.end() ? otherwise : std::stof(found->second) * 3.14159265F / 180;
  }
  std::uint64_t number(const char* word) const {
    const auto found = words.find(word);
    return found == words.end() ? 0 : std::stoull(found->second);
  }
};

Plan& plan() {
  static Plan the_plan;
  return the_plan;
}

float seconds(XrTime time) {
  return static_cast<float>(time % 1'000'000'000'000) * 1e-9F;
}

void write_ppm(const std::string& file, const Submitted& frame, std::size_t eye) {
  std::FILE* out = std::fopen(file.c_str(), "wb");
  if (out == nullptr) return;
  std::fprintf(out, "P6\n%u %u\n255\n", frame.width, frame.height);
  for (std::size_t i = 0; i < frame.rgba[eye].size(); i += 4) std::fwrite(&frame.rgba[eye][i], 1, 3, out);
  std::fclose(out);
}

/// Reads the variable once the library is loaded.
const bool read_environment = [] {
  const char* text = std::getenv("STYLET_MOCK_OPENXR");
  if (text == nullptr) return false;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    plan().words[word.substr(0, equals)] = equals == std::string::npos ? "" : word.substr(equals + 1);
  }
  Script script;
  if (const std::uint64_t ms = plan().number("steady"); ms != 0) {
    script.period = static_cast<XrDuration>(ms) * 1'000'000;
  } else {
    script.in_real_time = true;
  }
  if (const std::uint64_t cm = plan().number("stage"); cm != 0) {
    script.stage = true;
    script.local_from_stage.position.y = -0.01F * static_cast<float>(cm);
  }
  script.connected = plan().words.count("absent") == 0;
  if (const auto size = plan().words.find("size"); size != plan().words.end())
    std::sscanf(size->second.c_str(), "%ux%u", &script.width, &script.height);
  script.head = [](XrTime time) {
    const float t = seconds(time);
    return looking(plan().degrees("yaw", 0) + 0.05F * std::sin(t), plan().degrees("pitch", -0.6F),
                   {0.02F * std::sin(0.7F * t), 0, 0.01F * std::sin(t)});
  };
  script.right = [](XrTime time) {
    HandScript hand;
    hand.grip = looking(0.2F, -0.3F, {0.15F, -0.25F, -0.3F - 0.02F * (1 - std::cos(0.5F * seconds(time)))});
    hand.lower = report().frames != 0 && report().frames == plan().number("panel2");
    hand.upper = report().frames != 0 && report().frames == plan().number("breath");
    hand.trigger = report().frames != 0 && report().frames == plan().number("trigger");
    return hand;
  };
  script.left = [](XrTime time) {
    HandScript hand;
    hand.grip = looking(0, 0, {-0.15F + 0.01F * std::sin(seconds(time)), -0.3F, -0.3F});
    const std::uint64_t menu = plan().number("menu"), frame = report().frames;
    hand.lower = frame != 0 && frame == plan().number("panel");
    hand.menu = menu != 0 && frame >= menu && frame < menu + 2;
    return hand;
  };
  play(script);
  return true;
}();

}  // namespace

void follow_environment() {
  if (!read_environment) return;
  const std::uint64_t frame = report().frames;
  if (frame == plan().number("resize")) resize(script().width / 2, script().height / 2, true);
  if (frame == plan().number("lose")) lose_session(true);
  if (frame == plan().number("end")) stop(true);
  for (std::size_t eye = 0; eye < 2; ++eye) {
    const auto file = plan().words.find(eye == 0 ? "left" : "right");
    if (file != plan().words.end() && report().last.layer && frame % 5 == 0)
      write_ppm(file->second, report().last, eye);
  }
  static std::size_t told = 0;
  if (const auto felt = plan().words.find("felt"); felt != plan().words.end() && told < report().felt.size()) {
    if (std::FILE* out = std::fopen(felt->second.c_str(), "a")) {
      for (; told < report().felt.size(); ++told)
        std::fprintf(out, "%s %.3f\n", report().felt[told].hand == 0 ? "left" : "right",
                     report().felt[told].amplitude);
      std::fclose(out);
    }
  }
  static std::size_t written = 0;
  const auto errors = plan().words.find("errors");
  if (errors == plan().words.end() || written == report().errors.size()) return;
  if (std::FILE* out = std::fopen(errors->second.c_str(), "a")) {
    for (; written < report().errors.size(); ++written) std::fprintf(out, "%s\n", report().errors[written].c_str());
    std::fclose(out);
  }
}

}  // namespace stylet::mock_xr

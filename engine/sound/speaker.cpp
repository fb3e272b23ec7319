#include "engine/sound/speaker.h"

#include "engine/sound/mixer.h"
#include "engine/sound/output.h"

#include <chrono>
#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace stylet::sound {
namespace {

constexpr std::size_t kRing = 16 * 1024;                       // bytes: 680 cues
constexpr auto kLooked = std::chrono::milliseconds(3);         // between looks at the device
constexpr auto kTriedAgain = std::chrono::milliseconds(1000);  // for another in place of one that has gone

static_assert(std::is_trivially_copyable_v<Cue>);

}  // namespace

Speaker::Speaker(bool muted) : cues_(kRing), muted_(muted) {
  quieten_libraries();
  if (!muted) begin();
}

Speaker::~Speaker() = default;

void Speaker::begin() {
  if (thread_.joinable()) return;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void Speaker::play(const Cue& cue) {
  if (!thread_.joinable()) return;
  cues_.push({reinterpret_cast<const std::uint8_t*>(&cue), sizeof(cue)});  // full: nobody listens
}

void Speaker::mute(bool muted) {
  muted_.store(muted, std::memory_order_relaxed);
  if (!muted) begin();
}

std::optional<std::string> Speaker::news() {
  const State now = state();
  const State before = std::exchange(told_, now);
  if (now == before) return std::nullopt;
  if (now == State::silent) return "no sound: there is no device for it; going on silent";
  if (now == State::lost) return "the device for sound has gone; going on silent until there is one";
  if (before == State::lost) return "there is sound again";
  return std::nullopt;
}

void Speaker::run(const std::stop_token& stop) {
  Mixer mixer;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(kRing);
  std::optional<Output> output = Output::open();
  state_.store(output ? State::plays : State::silent, std::memory_order_release);
  auto tried = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    bytes.clear();
    cues_.drain(bytes);
    for (std::size_t at = 0; at + sizeof(Cue) <= bytes.size(); at += sizeof(Cue)) {
      Cue cue;
      std::memcpy(&cue, &bytes[at], sizeof(cue));
      if (output || goes_on(cue.sound)) mixer.start(cue);
    }
    mixer.mute(muted());
    if (output && !output->feed(mixer)) {
      output.reset();
      tried = std::chrono::steady_clock::now();
      state_.store(State::lost, std::memory_order_release);
    }
    if (state() == State::lost && std::chrono::steady_clock::now() - tried > kTriedAgain) {
      tried = std::chrono::steady_clock::now();
      output = Output::open();
      if (output) state_.store(State::plays, std::memory_order_release);
    }
    std::this_thread::sleep_for(kLooked);
  }
}

}  // namespace stylet::sound

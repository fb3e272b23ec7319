#include "engine/training/sound_watch.h"

#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>

namespace stylet::training {
namespace {

using sound::Cue;

constexpr std::size_t kRing = 16 * 1024;  // bytes: six seconds of simulation steps
static_assert(std::is_trivially_copyable_v<Cue>);

void push(recording::ByteRing& ring, const Cue& cue) {
  ring.push({reinterpret_cast<const std::uint8_t*>(&cue), sizeof(cue)});
}

}  // namespace

SoundWatch::SoundWatch(const content::Scene& scene, const TraceRecorder& trace)
    : trace_(trace), ear_(scene), of_haptic_(kRing), of_simulation_(kRing) {}

void SoundWatch::haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) {
  if (needle.puncture_count == punctures_) return;
  punctures_ = needle.puncture_count;
  push(of_haptic_, cue_of(record.time_s, needle.last_puncture));
}

void SoundWatch::simulation_stepped(const recording::SimulationStepRecord& /*record*/,
                                    const physics::SimulationReport& /*report*/,
                                    const physics::TissueState& /*tissue*/, const physics::NeedleState& /*needle*/) {
  const TraceSample* sample = trace_.newest();
  if (sample == nullptr) return;
  heard_.clear();
  ear_.step(*sample, heard_);
  for (const Cue& cue : heard_) push(of_simulation_, cue);
}

const std::vector<Cue>& SoundWatch::take() {
  bytes_.clear();
  of_haptic_.drain(bytes_);
  of_simulation_.drain(bytes_);
  taken_.resize(bytes_.size() / sizeof(Cue));
  if (!taken_.empty()) std::memcpy(taken_.data(), bytes_.data(), taken_.size() * sizeof(Cue));
  return taken_;
}

}  // namespace stylet::training

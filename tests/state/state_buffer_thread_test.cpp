#include "engine/state/state_buffer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>
#include <vector>

namespace stylet::state {
namespace {

FrameState prototype(std::size_t nodes) {
  FrameState state;
  state.bodies.resize(2);
  for (auto& body : state.bodies) body.resize(nodes, Eigen::Vector3f::Zero());
  state.needle_positions.resize(9, Eigen::Vector3f::Zero());
  state.needle_orientations.resize(9, Eigen::Quaternionf::Identity());
  state.targets.resize(2);
  return state;
}

/// Every value of the state of step k is k, so a mixture of steps shows.
void fill(FrameState& state, std::uint64_t k) {
  const auto value = static_cast<float>(k);
  state.time_s = static_cast<double>(k);
  state.simulation_step = k;
  state.haptic_step = 7 * k;
  for (auto& body : state.bodies) {
    for (auto& x : body) x.setConstant(value);
  }
  for (auto& x : state.needle_positions) x.setConstant(value);
  state.force.setConstant(value);
  state.insertion_depth = value;
  state.targets[0].distance = -value;
  state.probe_force = value;
  state.probe_area = value;
}

/// All values are `expected` (float rounding of the blend apart).
bool whole(const FrameState& state, double expected) {
  const auto same = [&](float v) { return std::abs(v - expected) <= 1e-6 * std::abs(expected) + 1e-6; };
  for (const auto& body : state.bodies) {
    for (const auto& x : body) {
      if (!same(x.x()) || !same(x.y()) || !same(x.z())) return false;
    }
  }
  for (const auto& x : state.needle_positions) {
    if (!same(x.x()) || !same(x.z())) return false;
  }
  return same(state.force.y()) && same(state.insertion_depth) && same(-state.targets[0].distance) &&
         same(state.probe_force) && same(state.probe_area) && state.haptic_step == 7 * state.simulation_step;
}

TEST(StateBuffer, IsNeverTornUnderAFastWriterAndSeveralReaders) {
  constexpr std::uint64_t kSteps = 8'000;  // floats hold these and their fractions exactly enough
  StateBuffer buffer(prototype(100), 6);
  std::atomic<bool> done{false};
  std::atomic<int> torn{0}, interpolated{0}, exact{0}, held{0}, backwards{0};
  std::vector<std::thread> readers;
  readers.reserve(3);
  for (int reader = 0; reader < 3; ++reader) {
    readers.emplace_back([&, reader] {
      FrameState frame = buffer.make_frame();
      std::uint64_t last = 0;
      for (bool last_round = false; !last_round;) {
        last_round = done.load();
        const double newest = buffer.newest_s();
        if (!std::isfinite(newest)) continue;
        // Before the newest, at it, and beyond; the first may have left the ring by the time it is read.
        const double asked = reader == 0 ? newest - 1.3 : reader == 1 ? newest - 1 : newest + 10;
        const FrameStamps stamps = buffer.sample(asked, frame);
        if (!whole(frame, frame.time_s)) ++torn;
        if (reader == 2 && frame.simulation_step < last) ++backwards;
        last = frame.simulation_step;
        interpolated += stamps.provenance == Provenance::interpolated ? 1 : 0;
        exact += stamps.provenance == Provenance::exact ? 1 : 0;
        held += stamps.provenance == Provenance::held ? 1 : 0;
      }
    });
  }
  FrameState state = prototype(100);
  for (std::uint64_t k = 1; k <= kSteps; ++k) {
    fill(state, k);
    ASSERT_TRUE(buffer.publish(state));
    // Few processors: let the readers in. On a busy machine one that yields comes back last.
    if (k % 16 == 0) std::this_thread::sleep_for(std::chrono::microseconds(20));
  }
  done = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(torn, 0);
  EXPECT_EQ(backwards, 0);
  EXPECT_GT(interpolated, 0);
  EXPECT_GT(exact, 0);
  EXPECT_GT(held, 0);
}

}  // namespace
}  // namespace stylet::state

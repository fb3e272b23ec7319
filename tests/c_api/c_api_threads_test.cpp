// The three kinds of steps in a thread each, as the header allows.
#include "tests/c_api/cube.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <thread>
#include <vector>

namespace stylet::c_api {
namespace {

TEST(CApiThreads, EachKindOfStepHasItsOwn) {
  const Cube cube;
  const Handle handle = create(cube);
  ASSERT_TRUE(handle) << stylet_last_error();
  constexpr std::uint64_t kSimulationSteps = 40;
  // Session time is counted in steps: the hub makes 20 moves to one step of the simulation, and neither is ahead of
  // the other by more than that however busy the machine is.
  std::atomic<std::uint64_t> simulated{0};
  std::atomic<std::uint64_t> moves{0};

  std::jthread simulation([&] {
    std::vector<double> nodes(cube.nodes.size());
    for (std::uint64_t step = 1; step <= kSimulationSteps; ++step) {
      while (moves.load() < 20 * (step - 1)) std::this_thread::yield();
      EXPECT_EQ(stylet_physics_simulation_step(handle.get()), STYLET_OK);
      EXPECT_EQ(stylet_physics_tissue_nodes(handle.get(), nodes.data(), nodes.size() / 3), STYLET_OK);
      simulated.store(step);
    }
  });
  std::int32_t factorisations = 0;
  std::jthread worker([&] {
    while (simulated.load() < kSimulationSteps) {
      std::int32_t done = 0;
      EXPECT_EQ(stylet_physics_factorise(handle.get(), &done), STYLET_OK);
      factorisations += done;
      if (done == 0) std::this_thread::yield();
    }
  });
  auto state = sized<stylet_needle_state>();
  stylet_pose hub = cube.hub;
  while (simulated.load() < kSimulationSteps) {
    const bool moves_on = moves.load() < 20 * (simulated.load() + 1);
    if (moves_on) hub.position[2] += 4e-5;
    EXPECT_EQ(stylet_physics_haptic_step(handle.get(), &hub, nullptr), STYLET_OK);
    if (moves_on) moves.fetch_add(1);
  }
  simulation.join();
  worker.join();
  stylet_physics_haptic_step(handle.get(), &hub, nullptr);
  stylet_physics_needle_state(handle.get(), &state);
  EXPECT_EQ(state.tissue_step, kSimulationSteps);
  EXPECT_EQ(state.tip, STYLET_TIP_INSIDE);
  EXPECT_EQ(state.puncture_count, 1U);
  EXPECT_GE(factorisations, 1);
}

TEST(CApiThreads, EachHasItsOwnLastError) {
  EXPECT_EQ(stylet_physics_simulation_step(nullptr), STYLET_ERROR_ARGUMENT);
  std::jthread([] { EXPECT_STREQ(stylet_last_error(), ""); }).join();
  EXPECT_STREQ(stylet_last_error(), "physics is null");
}

}  // namespace
}  // namespace stylet::c_api

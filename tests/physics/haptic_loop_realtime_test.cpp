// The haptic step takes no memory: operator new fails inside it, and the C allocator is watched for Eigen's own
// calls.
#include "physics/loops/haptic_loop.h"
#include "tests/physics/haptic_loop_synthetic_patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <new>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define STYLET_WATCH_MALLOC 0  // the sanitizers own malloc
#else
#define STYLET_WATCH_MALLOC 1
#endif

namespace {
thread_local bool forbidden = false;
thread_local int allocations = 0;

void* allocate(std::size_t size) {
  if (forbidden) {
    ++allocations;
    throw std::bad_alloc();
  }
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) {
  return allocate(size);
}
void* operator new[](std::size_t size) {
  return allocate(size);
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete[](void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}
void operator delete[](void* p, std::size_t) noexcept {
  std::free(p);
}

#if STYLET_WATCH_MALLOC
extern "C" void* __libc_malloc(std::size_t);
extern "C" void* malloc(std::size_t size) {
  if (forbidden) ++allocations;
  return __libc_malloc(size);
}
#endif

namespace stylet::physics {
namespace {

int allocations_in_steps(HapticLoop& loop, const StylusPose& hub, TissuePatch& patch) {
  allocations = 0;
  for (int i = 0; i < 20; ++i) {
    if (i == 10 && patch.epoch > 0) ++patch.epoch;  // synchronisation counts too
    StylusPose moved = hub;
    moved.position.x() += 1e-4 * i;
    forbidden = true;
    loop.step(moved, 1e-3, patch);
    forbidden = false;
  }
  return allocations;
}

TEST(HapticLoopRealtime, TheWatchSeesAllocations) {
  allocations = 0;
  forbidden = true;
  bool thrown = false;
  try {
    volatile double* p = new double(1);
    delete p;
  } catch (const std::bad_alloc&) {
    thrown = true;
  }
#if STYLET_WATCH_MALLOC
  void* volatile q = std::malloc(64);
#endif
  forbidden = false;
  EXPECT_TRUE(thrown);
#if STYLET_WATCH_MALLOC
  std::free(q);
  EXPECT_GE(allocations, 2);  // and what the exception itself takes
#endif
}

TEST(HapticLoopRealtime, StepTakesNoMemory) {
  for (const int beams : {1, 8, 64}) {
    for (const Coupling coupling : {Coupling::paper_updated, Coupling::paper_frozen}) {
      HapticLoopSettings settings;
      settings.needle.beams = beams;
      settings.coupling = coupling;
      const StylusPose hub;
      HapticLoop empty(settings, hub);
      TissuePatch nothing;
      EXPECT_EQ(allocations_in_steps(empty, hub, nothing), 0);
      for (const int contacts : {1, 8, 16, 32}) {
        HapticLoop loop(settings, hub);
        TissuePatch patch = testing::synthetic_patch(loop.state(), contacts, 0.4, 0.9);
        EXPECT_EQ(allocations_in_steps(loop, hub, patch), 0) << beams << " beams, " << contacts << " contacts";
        EXPECT_EQ(loop.state().contact_count, contacts);
      }
    }
  }
}

TEST(HapticLoopRealtime, RefusalsTakeNoMemory) {
  HapticLoop loop({}, {});
  TissuePatch patch = testing::synthetic_patch(loop.state(), 8);
  patch.bodies[0].w_bar(0, 0) = -1;
  StylusPose hub;
  hub.position.y() = 1.0;  // limited base motion, failed solve
  EXPECT_EQ(allocations_in_steps(loop, hub, patch), 0);
  hub.position.y() = std::nan("");
  EXPECT_EQ(allocations_in_steps(loop, hub, patch), 0);
}

}  // namespace
}  // namespace stylet::physics

// Counts what a thread takes from the heap, to prove that something allocates nothing.
#pragma once

namespace stylet::tests {

/// While one lives, this thread's calls of malloc and its kin, which operator new and Eigen end in, are counted.
/// Under a sanitizer, which owns malloc, only operator new is. Link tests/support/allocation_count.cpp into the test.
class AllocationCount {
public:
  AllocationCount();
  ~AllocationCount();
  AllocationCount(const AllocationCount&) = delete;
  AllocationCount& operator=(const AllocationCount&) = delete;
  int value() const;
};

}  // namespace stylet::tests

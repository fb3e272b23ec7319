// Counts calls of operator new, to prove that something allocates nothing.
#pragma once

namespace stylet::tests {

/// While one lives, operator new of this thread is counted. Link tests/support/allocation_count.cpp into the test.
/// Does not see malloc (Eigen's dynamic matrices): for those define EIGEN_RUNTIME_NO_MALLOC.
class AllocationCount {
public:
  AllocationCount();
  ~AllocationCount();
  AllocationCount(const AllocationCount&) = delete;
  AllocationCount& operator=(const AllocationCount&) = delete;
  int value() const;
};

}  // namespace stylet::tests

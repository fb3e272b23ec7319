#include "tests/support/allocation_count.h"

#include <cstdlib>
#include <new>

namespace {
thread_local int counting = 0;
thread_local int allocations = 0;

void* allocate(std::size_t size) {
  if (counting > 0) ++allocations;
  if (void* memory = std::malloc(size != 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) {
  return allocate(size);
}
void* operator new[](std::size_t size) {
  return allocate(size);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace stylet::tests {

AllocationCount::AllocationCount() {
  if (counting++ == 0) allocations = 0;
}
AllocationCount::~AllocationCount() {
  --counting;
}
int AllocationCount::value() const {
  return allocations;
}

}  // namespace stylet::tests

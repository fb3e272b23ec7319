// The interface of libFuzzer: what the engine calls, and what it offers to custom mutators.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

extern "C" {
/// Called with every input. Returns 0.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
/// Changes data in place; @return its new size, at most max_size.
std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed);
/// The engine's own mutations, for parts of an input.
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);
}

namespace stylet::fuzz {

/// The engine's mutations on a text that may grow by `room` bytes.
inline void mutate(std::string& bytes, std::size_t room) {
  const std::size_t size = bytes.size();
  bytes.resize(size + room);
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), size, size + room));
}

}  // namespace stylet::fuzz

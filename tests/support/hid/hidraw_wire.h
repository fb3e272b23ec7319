// What the preloaded shim and the mocked node say to each other about an open node.
#pragma once

#include <array>
#include <cstdint>

namespace stylet::support {

inline constexpr std::size_t kMostHidBytes = 4096;  ///< of a report or a descriptor

struct HidrawRequest {
  enum Kind : std::uint32_t { kDescriptor, kWrite, kSetFeature, kGetFeature };
  Kind kind = kDescriptor;
  std::uint32_t room = 0;  ///< most bytes of the answer
  std::uint32_t size = 0;
  std::array<std::uint8_t, kMostHidBytes> bytes{};
};

struct HidrawAnswer {
  std::int32_t result = 0;  ///< what the call returns; negative: -errno
  std::uint32_t size = 0;
  std::array<std::uint8_t, kMostHidBytes> bytes{};
};

}  // namespace stylet::support

// The checksum of recordings: CRC-32C (Castagnoli), as in iSCSI (RFC 3720), ext4 and Btrfs.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace stylet::files {

namespace detail {
constexpr std::array<std::uint32_t, 256> crc32c_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0x82F63B78u : 0u);
    table[byte] = crc;
  }
  return table;
}
inline constexpr std::array<std::uint32_t, 256> kCrc32cTable = crc32c_table();
}  // namespace detail

/// @param before  checksum of the bytes in front of these, 0 at the start
/// @realtime 3 ns a byte at most
inline std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t before = 0) {
  std::uint32_t crc = ~before;
  for (const std::uint8_t byte : bytes) crc = (crc >> 8) ^ detail::kCrc32cTable[(crc ^ byte) & 0xFF];
  return ~crc;
}

}  // namespace stylet::files

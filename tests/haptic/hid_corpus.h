// Report descriptors of real devices, where STYLET_TEST_DATA has them.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace stylet::support {

/// Empty: there are none.
inline std::filesystem::path hid_corpus() {
  const char* root = std::getenv("STYLET_TEST_DATA");
  const std::filesystem::path path = root == nullptr ? "" : std::filesystem::path(root) / "hid";
  std::error_code error;
  return root != nullptr && std::filesystem::exists(path / "INDEX.tsv", error) ? path : std::filesystem::path();
}

inline std::vector<std::uint8_t> read_hex(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<std::uint8_t> bytes;
  for (char high = 0, low = 0; file >> high >> low;) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(std::string{high, low}, nullptr, 16)));
  }
  return bytes;
}

/// All descriptors of the corpus by name.
inline std::map<std::string, std::vector<std::uint8_t>> hid_descriptors() {
  std::map<std::string, std::vector<std::uint8_t>> all;
  if (hid_corpus().empty()) return all;
  for (const auto& entry : std::filesystem::directory_iterator(hid_corpus())) {
    if (entry.path().extension() == ".hex") all[entry.path().stem().string()] = read_hex(entry.path());
  }
  return all;
}

}  // namespace stylet::support

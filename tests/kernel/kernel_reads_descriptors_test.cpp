// The kernel as oracle of the parser: descriptors go in through /dev/uhid, and what the kernel made of them
// (its debugfs) is put beside each as NAME.kernel.txt, where HidCorpus.AgreesWithTheKernelOnEveryField looks.
#include "haptic/hid/force_stylus.h"
#include "tests/haptic/hid_corpus.h"
#include "tests/kernel/device_port.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <thread>

namespace stylet::kernel_test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kAtOnce = 16;  ///< devices; hidraw has 64 nodes

std::string serial_of(std::size_t k) {
  return "descriptor-" + std::to_string(k);
}

/// A device that answers at once, with an error: the kernel asks for features while it probes.
class SilentDevice final : public HostRequests {
public:
  void output(std::span<const std::uint8_t>) override {}
  std::vector<std::uint8_t> get_feature(std::uint8_t) override { return {}; }
  bool set_feature(std::span<const std::uint8_t>) override { return false; }
};

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The kernel's name of the device with this serial once a driver has read its descriptor, such as
/// 0003:1209:0001.0001; empty until then.
std::string kernel_name(const std::string& serial) {
  for (const auto& entry : fs::directory_iterator("/sys/bus/hid/devices")) {
    if (text_of(entry.path() / "uevent").find("HID_UNIQ=" + serial + "\n") == std::string::npos) continue;
    return fs::exists(entry.path() / "driver") ? entry.path().filename().string() : "";
  }
  return {};
}

void write_hex(const fs::path& path, std::span<const std::uint8_t> bytes) {
  std::ofstream file(path);
  for (const std::uint8_t byte : bytes) {
    char text[3];
    std::snprintf(text, sizeof text, "%02X", byte);
    file << text;
  }
}

TEST(KernelReadsDescriptors, OfTheForceStylusAndOfAllInTheTestData) {
  const fs::path folder = fs::path(std::getenv("STYLET_TEST_DATA")) / "hid";  // of the virtual machine
  { const std::ofstream index(folder / "INDEX.tsv"); }
  write_hex(folder / "stylet_force_stylus.hex", haptic::hid::kForceStylusDescriptor);
  const auto descriptors = support::hid_descriptors();
  ASSERT_FALSE(descriptors.empty());

  std::vector<std::string> names;
  names.reserve(descriptors.size());
  for (const auto& [name, bytes] : descriptors) names.push_back(name);
  std::size_t read = 0;
  std::vector<std::string> refused;
  for (std::size_t first = 0; first < names.size(); first += kAtOnce) {
    const auto batch = std::span(names).subspan(first, std::min(kAtOnce, names.size() - first));
    SilentDevice device;
    std::vector<std::unique_ptr<DevicePort>> ports;
    for (const std::string& name : batch) {
      const DeviceIdentity identity{.product = 0x0002, .serial = serial_of(ports.size())};
      ports.push_back(make_uhid_port(identity, descriptors.at(name), device));
      ports.back()->plug();
    }
    for (std::size_t k = 0; k < batch.size(); ++k) {
      // All came at once: only the first ones have to be waited for.
      std::string kernel = kernel_name(serial_of(k));
      for (int tries = 0; tries < 100 && kernel.empty(); ++tries) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        kernel = kernel_name(serial_of(k));
      }
      if (kernel.empty()) {
        refused.push_back(batch[k]);
        continue;
      }
      const std::string text = text_of(fs::path("/sys/kernel/debug/hid") / kernel / "rdesc");
      const auto bytes_end = text.find("\n\n");  // first the descriptor itself in hex
      ASSERT_NE(bytes_end, std::string::npos) << batch[k] << ": " << text;
      std::ofstream(folder / (batch[k] + ".kernel.txt")) << text.substr(bytes_end + 2);
      ++read;
    }
    for (const auto& port : ports) port->unplug();
  }
  std::printf("  %zu descriptors, %zu read by the kernel\n", descriptors.size(), read);
  for (const std::string& name : refused) {
    std::printf("  refused by the kernel: %s\n", name.c_str());
  }
  EXPECT_TRUE(fs::exists(folder / "stylet_force_stylus.kernel.txt"));
  EXPECT_TRUE(refused.empty());
}

}  // namespace
}  // namespace stylet::kernel_test

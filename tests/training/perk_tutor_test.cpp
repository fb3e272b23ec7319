// Perk Tutor's own recording, where STYLET_TEST_DATA has it, against the values that its authors publish beside it:
// PerkTutor/PerkTutor, Testing/Scenes/Lumbar/TransformBuffer_Subject13.xml and Testing/Results/Lumbar.xml. It names
// no licence, so none of it is here. What these metrics need besides (the tissue's model) is not published.
#include "engine/training/metrics.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

namespace stylet::training {
namespace {

namespace fs = std::filesystem;

std::string attribute(const std::string& line, const std::string& name) {
  const std::size_t begin = line.find(' ' + name + "=\"");
  if (begin == std::string::npos) return {};
  const std::size_t from = begin + name.size() + 3;
  return line.substr(from, line.find('"', from) - from);
}

/// The tracks by device. A log line holds time stamp and 4 x 4 matrix by rows, mm.
std::map<std::string, Trace> tracks(const fs::path& file) {
  std::map<std::string, Trace> found;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.find("<log ") == std::string::npos) continue;
    std::istringstream matrix(attribute(line, "transform"));
    TraceSample sample;
    sample.time_s = std::stod(attribute(line, "TimeStampSec")) + 1e-9 * std::stod(attribute(line, "TimeStampNSec"));
    for (int i = 0; i < 12; ++i) {
      double value = 0;
      matrix >> value;
      if (i % 4 == 3) sample.tip[i / 4] = 1e-3 * value;
    }
    found[attribute(line, "DeviceName")].samples.push_back(sample);
  }
  return found;
}

TEST(PerkTutor, ItsRecordingGivesThePublishedValues) {
  const char* data = std::getenv("STYLET_TEST_DATA");
  const fs::path file = fs::path(data != nullptr ? data : "") / "perk_tutor/TransformBuffer_Subject13.xml";
  if (data == nullptr || !fs::exists(file)) GTEST_SKIP() << "STYLET_TEST_DATA has no perk_tutor";
  const auto found = tracks(file);
  for (const auto& [device, path_mm] : {std::pair("StylusTipToRAS", 2694.23), std::pair("ProbeToRAS", 1271.15)}) {
    ASSERT_TRUE(found.contains(device)) << device;
    const std::vector<Metric> metrics = measure(found.at(device), {});
    EXPECT_NEAR(find_metric(metrics, "path_length").value.value_or(0), path_mm, 0.005) << device;
    EXPECT_NEAR(find_metric(metrics, "elapsed_time").value.value_or(0), 47.831, 5e-4) << device;
  }
}

}  // namespace
}  // namespace stylet::training

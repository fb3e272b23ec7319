// `stylet bench coupling` as a user runs it, shortened: its numbers, and that they are of this coupling.
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

namespace stylet::bench {
namespace {

using nlohmann::json;

TEST(CouplingBench, MeasuresWhatTheCouplingGains) {
  if (support::kSanitized) GTEST_SKIP() << "long with a sanitizer; it runs what the tests of physics run";
  const support::TemporaryFolder folder;
  const std::filesystem::path file = folder / "coupling.json";
  const std::string command = std::string("'") + STYLET_COMMAND + "' bench coupling --quick --out '" +
                              folder.path().string() + "' --json '" + file.string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::ifstream in(file);
  const json list = json::parse(in);
  std::map<std::string, double> values;
  for (const json& entry : list) {
    ASSERT_EQ(entry.size(), 6u) << entry;
    ASSERT_TRUE(entry.at("value").is_number()) << entry;
    EXPECT_EQ(entry.at("target").is_null(), entry.at("met").is_null()) << entry;
    EXPECT_TRUE(values.emplace(entry.at("name"), entry.at("value")).second) << "twice: " << entry;
  }
  const auto value = [&](const std::string& name) {
    EXPECT_TRUE(values.contains(name)) << name;
    return values.contains(name) ? values[name] : std::nan("");
  };
  EXPECT_LT(value("shaft.jump.hermite"), 0.5 * value("shaft.jump.straight"));
  EXPECT_LT(value("shaft.discontinuity.hermite"), 0.05 * value("shaft.discontinuity.straight"));
  EXPECT_GT(value("shaft.discontinuity.paper"), value("shaft.discontinuity.hermite"));
  EXPECT_LT(value("sync.kink"), 1e-3);
  EXPECT_LT(value("subgrid.spread.on"), 0.5 * value("subgrid.spread.off"));
  EXPECT_LT(value("subgrid.indentation.spread.on"), value("subgrid.indentation.spread.off"));
  EXPECT_LT(value("w_bar.512.error"), 1e-12);
  EXPECT_NEAR(value("resistance.puncture.peak"), 1.8, 0.05);
  EXPECT_NEAR(value("resistance.friction.slope"), 18, 2);
  EXPECT_LT(value("resistance.withdrawal"), 0);
  EXPECT_GT(value("resistance.work.closed_path"), 0.01);
  EXPECT_LT(value("resistance.rate.1_against_2_khz"), 2);
  // The steps timed are those that were meant.
  EXPECT_GT(value("speed.9_nodes.16_rows.steps"), 100);
  EXPECT_GE(value("speed.9_nodes.16_rows.rows"), 24);
  EXPECT_GT(value("speed.33_nodes.64_rows.steps"), 100);
  EXPECT_GE(value("speed.33_nodes.64_rows.rows"), 96);
  EXPECT_EQ(value("speed.33_nodes.64_rows.bodies"), 3);
  EXPECT_EQ(value("speed.solver.192_rows.fallbacks"), 0);
  for (const char* flags : {"shaft.flags", "sync.flags", "subgrid.flags", "resistance.flags",
                            "speed.9_nodes.16_rows.flags", "speed.33_nodes.64_rows.flags"}) {
    EXPECT_EQ(value(flags), 0) << flags;
  }
  for (const char* figure : {"shaft", "synchronisation", "subgrid", "spacing", "resistance", "solver"}) {
    for (const char* kind : {".png", ".csv"}) {
      const std::filesystem::path written = folder / (std::string("coupling_") + figure + kind);
      EXPECT_TRUE(std::filesystem::exists(written) && std::filesystem::file_size(written) > 0) << written;
    }
  }
}

}  // namespace
}  // namespace stylet::bench

// Sound files of unsound surfaces, where STYLET_TEST_DATA has them: each gets the verdict its collection expects.
#include "engine/files/error.h"
#include "engine/import/organ_import.h"
#include "tests/support/sanitized.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace stylet::import {
namespace {

using ::testing::AnyOf;

/// accept: as it is; repair or report: made, and the author is told what was found; reject: one line says why.
std::string verdict(const std::filesystem::path& path) {
  try {
    const std::vector<SourceFile> files{read_source(path, {})};
    bool told = !files[0].warnings.empty();
    for (const OrganParts& parts : assign_parts(files, {})) {
      const ImportedOrgan organ = import_organ(parts, {}, [](const std::string&, double) {});
      EXPECT_EQ(organ.report.quality.inverted, 0) << path;
      EXPECT_GE(organ.report.quality.min_dihedral_deg, 12) << path;
      EXPECT_LT(std::abs(organ.report.volume_error()), 0.03) << path;
      told = told || !organ.report.notes.empty();
    }
    return told ? "repair or report" : "accept";
  } catch (const files::ContentError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find(path.filename().string()), std::string::npos) << error.what();
    return "reject";
  }
}

TEST(HostileSurfaces, GetTheVerdictTheCollectionExpects) {
  const char* data = std::getenv("STYLET_TEST_DATA");
  const std::filesystem::path folder = std::filesystem::path(data == nullptr ? "" : data) / "malformed/hostile";
  if (data == nullptr || !exists(folder)) GTEST_SKIP() << "STYLET_TEST_DATA has no malformed/hostile";
  if (support::kSanitized)
    GTEST_SKIP() << "minutes long with a sanitizer; the spheres of OrganImport take the same ways";
  std::ifstream table(folder / "EXPECT.tsv");
  int checked = 0;
  for (std::string line; std::getline(table, line);) {
    std::istringstream row(line);
    std::string file, expect;
    std::getline(row, file, '\t');
    std::getline(row, expect, '\t');
    if (!file.starts_with("geo_") || !exists(folder / file)) continue;
    ++checked;
    const std::string found = verdict(folder / file);
    if (expect == "reject-or-repair") {
      EXPECT_THAT(found, AnyOf("reject", "repair or report")) << line;
    } else {
      EXPECT_EQ(found, expect == "repair" || expect == "report" ? "repair or report" : expect) << line;
    }
  }
  EXPECT_GT(checked, 5);
}

}  // namespace
}  // namespace stylet::import

// Files of other projects' glTF collections, most of them with errors: what becomes of each is in gltf_verdicts.tsv.
#include "engine/gltf/gltf.h"
#include "tests/support/sanitized.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <sys/resource.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

namespace stylet::gltf {
namespace {

namespace fs = std::filesystem;

std::vector<std::vector<std::string>> read_table(const fs::path& path) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    for (rows.emplace_back(); std::getline(cells, line, '\t');) rows.back().push_back(line);
  }
  return rows;
}

struct Outcome {
  std::string refusal;   ///< empty: read
  std::string warnings;  ///< of a file that was read
};

/// That this process and its children took, whatever else the machine does.
double processor_seconds() {
  double seconds = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used{};
    getrusage(who, &used);
    for (const timeval& time : {used.ru_utime, used.ru_stime})
      seconds += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  }
  return seconds;
}

/// Reads a file, and holds the reader to its promises whatever the file is.
Outcome outcome_of(const fs::path& path) {
  Outcome outcome;
  const double start_s = processor_seconds();
  try {
    const GltfScene scene = read_gltf(path);
    for (const std::string& warning : scene.warnings) outcome.warnings += warning + "\n";
    EXPECT_FALSE(scene.organs.empty()) << path;
    for (const GltfOrgan& organ : scene.organs) {
      for (const auto& vertex : organ.mesh.vertices) EXPECT_TRUE(vertex.allFinite()) << path;
      for (const auto& triangle : organ.mesh.triangles) {
        for (const std::uint32_t vertex : triangle) EXPECT_LT(vertex, organ.mesh.vertices.size()) << path;
      }
    }
  } catch (const files::ContentError& error) {
    outcome.refusal = error.what();
    EXPECT_NE(outcome.refusal, "") << path;
    EXPECT_EQ(outcome.refusal.find('\n'), std::string::npos) << path << outcome.refusal;
  }
  EXPECT_LT(processor_seconds() - start_s, 2) << path;
  return outcome;
}

/// Whether a valid file draws triangles with positions: by its JSON, for the reader is what is judged.
bool has_triangles(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (text.starts_with("glTF")) {
    std::uint32_t length = 0;
    std::memcpy(&length, text.data() + 12, sizeof length);
    text = text.substr(20, length);
  }
  const auto document = nlohmann::json::parse(text);
  if (!document.contains("meshes")) return false;
  for (const auto& mesh : document["meshes"]) {
    for (const auto& primitive : mesh["primitives"]) {
      if (primitive.value("mode", 4) >= 4 && primitive["attributes"].contains("POSITION")) return true;
    }
  }
  return false;
}

/// Of the process so far; a sanitizer's own memory is none of the reader's.
double peak_memory_gb() {
  if (support::kSanitized) return 0;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1e6;
}

TEST(GltfVerdicts, AreThoseOfTheTableForFilesOfOtherProjects) {
  const char* root = std::getenv("STYLET_TEST_DATA");
  const fs::path folder = root == nullptr ? fs::path() : fs::path(root) / "malformed";
  if (root == nullptr || !fs::exists(folder / "EXPECT.tsv"))
    GTEST_SKIP() << "STYLET_TEST_DATA has no malformed files";
  std::set<std::string> with_errors;
  for (const auto& row : read_table(folder / "EXPECT.tsv")) {
    if (row.size() > 1 && !row[1].empty() && row[1] != "0") with_errors.insert(row[0].substr(10));  // "malformed/"
  }
  std::map<std::string, std::vector<std::string>> verdicts;
  for (const auto& row : read_table(fs::path(STYLET_SOURCE_DIR) / "tests/gltf/gltf_verdicts.tsv")) {
    ASSERT_EQ(row.size(), 4U) << row[0];
    EXPECT_TRUE(verdicts.emplace(row[0], row).second) << row[0] << " has two rows";
  }

  std::map<std::string, int> count;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string file = fs::relative(entry.path(), folder).string();
    const std::string extension = entry.path().extension().string();
    if ((extension != ".glb" && extension != ".gltf") || file.starts_with("hostile/")) continue;
    const Outcome outcome = outcome_of(entry.path());
    const std::string seen = file + ": " + outcome.refusal + outcome.warnings;
    const auto found = verdicts.find(file);
    if (found == verdicts.end() && with_errors.contains(file)) {
      std::cout << "no row in gltf_verdicts.tsv: " << seen << "\n";  // of a larger collection
      ++count["with errors and no verdict"];
      continue;
    }
    if (found == verdicts.end()) {  // a valid file: read if it has triangles
      const bool triangles = has_triangles(entry.path());
      EXPECT_THAT(outcome.refusal, ::testing::HasSubstr(triangles ? "" : "no node has triangles")) << seen;
      EXPECT_EQ(outcome.refusal.empty(), triangles) << seen;
      ++count[triangles ? "valid with triangles" : "valid without triangles"];
      continue;
    }
    const std::string& verdict = found->second[1];
    const std::string& says = found->second[2];
    ++count[verdict];
    if (verdict == "refused") {
      EXPECT_THAT(outcome.refusal, ::testing::HasSubstr(says)) << seen;
    } else {
      EXPECT_EQ(outcome.refusal, "") << seen;
      EXPECT_THAT(outcome.warnings, ::testing::HasSubstr(verdict == "repaired" ? says : "")) << seen;
    }
    EXPECT_THAT(verdict, ::testing::AnyOf("accepted", "repaired", "refused"));
  }
  for (const auto& [what, files] : count) std::cout << files << " " << what << "\n";
  EXPECT_GT(count["refused"], 10);
  EXPECT_GT(count["valid with triangles"], 10);
  EXPECT_LT(peak_memory_gb(), 1.0);
}

TEST(GltfVerdicts, FilesMadeToSwellInMemoryDoNot) {
  // A parser makes some hundred bytes of each of these two or three.
  constexpr int kValues = support::kSanitized ? 50'000 : 400'000;
  const auto file = [](const std::string& where, const std::string& element, int count) {
    std::string list = element;
    for (int i = 1; i < count; ++i) list += "," + element;
    const std::string text =
        R"({"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 0})" +
        (where == "targets" ? ", \"targets\": [" + list + "]" : "") + "}]}]," +
        R"("accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}],)" +
        (where == "nodes" ? "\"nodes\": [" : "\"extras\": [") + (where == "targets" ? "0" : list) + "]}";
    return read_gltf(std::as_bytes(std::span(text.data(), text.size())), "swell.gltf");
  };
  EXPECT_EQ(file("extras", "0", kValues).organs.size(), 1U);
  EXPECT_EQ(file("targets", "{}", kValues).organs.size(), 1U);
  EXPECT_THROW(file("nodes", "{}", 100'001), files::ContentError);
  EXPECT_THROW(file("extras", "0", 1'000'001), files::ContentError);
  EXPECT_LT(peak_memory_gb(), 1.0);
}

}  // namespace
}  // namespace stylet::gltf

// Thousands of damaged files: whatever happens to the bytes, reading ends with a scene or with one line.
#include "engine/files/json_reader.h"
#include "engine/gltf/gltf.h"
#include "engine/readers/scenario_file.h"
#include "tests/readers/small_scenario.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <string>

namespace stylet::readers {
namespace {

/// One to four edits: flips, runs of one byte, cuts, doublings, numbers that hurt.
std::string mutate(std::string bytes, std::mt19937& random) {
  const auto pick = [&](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random()) % n; };
  static const std::string kNasty[] = {"-1",     "0",        "1e308", "4294967295", "9223372036854775807",
                                       "[",      "{",        "\"",    "null",       "0.5",
                                       "99999",  "\x01\xff", "true",  "[[[[[[",     ",",
                                       "\\u0000"};
  for (std::size_t edits = 1 + pick(4); edits > 0; --edits) {
    const std::size_t at = pick(bytes.size());
    const std::size_t length = std::min(bytes.size() - at, pick(12));
    switch (pick(6)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << pick(8)));
        break;
      case 1:
        bytes.erase(at, length);
        break;
      case 2:
        bytes.insert(at, bytes.substr(pick(bytes.size()), pick(40)));
        break;
      case 3:
        bytes.replace(at, length, kNasty[pick(std::size(kNasty))]);
        break;
      case 4:
        bytes.replace(at, length, std::string(length, '\xff'));
        break;
      default: {  // a number becomes another
        const std::size_t digit = bytes.find_first_of("0123456789", at);
        if (digit == std::string::npos) break;
        const std::size_t end = bytes.find_first_not_of("0123456789", digit);
        bytes.replace(digit, end == std::string::npos ? std::string::npos : end - digit, kNasty[pick(5)]);
      }
    }
    if (bytes.empty()) bytes.push_back(' ');
  }
  return bytes;
}

void expect_one_line(const char* what) {
  ASSERT_NE(*what, '\0');
  ASSERT_EQ(std::string(what).find('\n'), std::string::npos) << what;
}

TEST(Mutation, NoDamagedGlbCrashesOrHangs) {
  test::SmallScenario small;
  small.organs = {};
  small.organs.add("liver_ball", gltf::test::sphere({0, 0, 0}, 0.05, 4), {{"id", "liver"}, {"role", "boundary"}},
                   {{"preset", "liver"}, {"mechanics", {{"youngsModulus", 5000}}}});
  const std::string sound = small.organs.bytes();
  const std::size_t json_end = sound.find(std::string("BIN\0", 4));
  std::mt19937 random(20240607);
  int read = 0;
  int refused = 0;
  for (int i = 0; i < 4000; ++i) {
    // Half of the damage goes to the JSON alone and leaves a sound frame round it: it gets further.
    std::string bytes;
    if (i % 2 == 0) {
      bytes = mutate(sound, random);
    } else {
      std::string text = mutate(sound.substr(20, json_end - 24), random);
      text.append((4 - text.size() % 4) % 4, ' ');
      bytes = sound.substr(0, 12) + std::string(4, '\0') + "JSON" + text + sound.substr(json_end - 4);
      const auto total = static_cast<std::uint32_t>(bytes.size());
      const auto length = static_cast<std::uint32_t>(text.size());
      std::memcpy(bytes.data() + 8, &total, 4);
      std::memcpy(bytes.data() + 12, &length, 4);
    }
    try {
      const gltf::GltfScene scene = gltf::read_gltf(gltf::test::as_bytes(bytes), "mutant.glb");
      for (const gltf::GltfOrgan& organ : scene.organs) {
        for (const auto& vertex : organ.mesh.vertices) ASSERT_TRUE(vertex.allFinite());
        for (const auto& triangle : organ.mesh.triangles) {
          for (const std::uint32_t v : triangle) ASSERT_LT(v, organ.mesh.vertices.size());
        }
      }
      ++read;
    } catch (const files::ContentError& error) {
      expect_one_line(error.what());
      ++refused;
    }
  }
  EXPECT_GT(read, 100) << "the damage is too coarse to reach the deeper checks";
  EXPECT_GT(refused, 1000);
}

TEST(Mutation, NoDamagedScenarioCrashesOrHangs) {
  const test::SmallScenario small;
  small.write();
  const std::string sound = small.scenario.dump();
  std::mt19937 random(7);
  int clean = 0;
  int refused = 0;
  for (int i = 0; i < 4000; ++i) {
    try {
      files::JsonFile file(small.path(), mutate(sound, random));
      const ScenarioFile scenario = read_scenario_file(file);
      for (const std::string& problem : file.problems()) expect_one_line(problem.c_str());
      for (const BodyRequest& body : scenario.bodies) ASSERT_LE(body.target_nodes, 50000);
      ++(file.problems().empty() ? clean : refused);
    } catch (const files::ContentError& error) {
      expect_one_line(error.what());
      ++refused;
    }
  }
  EXPECT_GT(clean, 20);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace stylet::readers

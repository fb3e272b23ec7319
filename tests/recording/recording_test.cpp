#include "engine/recording/recording.h"
#include "engine/files/crc32c.h"
#include "engine/files/error.h"
#include "engine/recording/recording_writer.h"
#include "engine/session/state_hash.h"
#include "tests/support/allocation_count.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <set>
#include <string>

namespace stylet::recording {
namespace {

namespace fs = std::filesystem;
using files::ContentError;

HapticStepRecord haptic_step(std::uint64_t k) {
  const double t = 1e-3 * static_cast<double>(k);
  return {.step = k,
          .time_s = t,
          .dt_s = 1e-3,
          .pose = {.position = {0.1 * t, -0.02, 1.0 / 3.0},
                   .orientation = Eigen::Quaterniond(Eigen::AngleAxisd(t, Eigen::Vector3d::UnitY()))},
          .buttons = static_cast<std::uint32_t>(k % 3),
          .valid = k % 5 != 0,
          .patch_epoch = k / 20};
}

SimulationStepRecord simulation_step(std::uint64_t k) {
  return {.step = k,
          .time_s = 0.02 * static_cast<double>(k),
          .needle_step = 20 * k + 3,
          .factor_taken = k % 2 == 1,
          .factor_requested = k % 4 == 2,
          .factor_epoch = k / 2,
          .probe = {.position = {0.05, 0.06, 0.07}, .orientation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)},
          .inspiration = 0.25 * static_cast<double>(k % 4)};
}

RecordingHeader header() {
  return {.build = "0.1.0 abcdef Release",
          .scenario = "content/scenarios/liver_biopsy.json",
          .scenario_hash = 0xfedcba9876543210,
          .settings_json = R"({"coupling":"paper-updated","rates":{"haptic_hz":1000}})"};
}

class RecordingFile : public testing::Test {
protected:
  /// A whole session of so many simulation steps, drained after each.
  void write_session(std::uint64_t simulation_steps) {
    RecordingWriter writer(path_, header());
    std::uint64_t haptic = 0;
    for (std::uint64_t k = 0; k < simulation_steps; ++k) {
      for (int i = 0; i < 20; ++i) writer.haptic().add(haptic_step(haptic++));
      writer.simulation().add(simulation_step(k));
      writer.haptic().add(HashRecord{.loop = LoopName::haptic, .final = false, .step = haptic, .hash = 17 * k});
      if (k % 3 == 0)
        writer.haptic().add_event(0.02 * static_cast<double>(k), haptic, "puncture",
                                  {{"to", std::string_view("liver capsule")}, {"force", 1.5, "N"}});
      writer.drain();
    }
    writer.simulation().add(HashRecord{.loop = LoopName::simulation, .final = true, .step = 9, .hash = 0xabc});
    writer.finish();
  }
  std::vector<std::uint8_t> bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  const support::TemporaryFolder folder_;
  const fs::path path_ = folder_ / "session.rec";
};

TEST_F(RecordingFile, ComesBackBitForBit) {
  write_session(10);
  const Recording r = read_recording(path_);
  EXPECT_TRUE(r.complete()) << r.condition();
  EXPECT_EQ(r.condition(), "complete, 200 haptic and 10 simulation steps");
  EXPECT_EQ(r.header.build, header().build);
  EXPECT_EQ(r.header.scenario, header().scenario);
  EXPECT_EQ(r.header.scenario_hash, header().scenario_hash);
  EXPECT_EQ(r.header.settings_json, header().settings_json);
  ASSERT_EQ(r.haptic.size(), 200u);
  for (std::uint64_t k = 0; k < 200; ++k) {
    const HapticStepRecord& a = r.haptic[k];
    const HapticStepRecord b = haptic_step(k);
    EXPECT_EQ(a.step, b.step);
    EXPECT_EQ(a.time_s, b.time_s);
    EXPECT_EQ(a.dt_s, b.dt_s);
    EXPECT_EQ(a.pose.position, b.pose.position);
    EXPECT_EQ(a.pose.orientation.coeffs(), b.pose.orientation.coeffs());
    EXPECT_EQ(a.buttons, b.buttons);
    EXPECT_EQ(a.valid, b.valid);
    EXPECT_EQ(a.patch_epoch, b.patch_epoch);
  }
  ASSERT_EQ(r.simulation.size(), 10u);
  for (std::uint64_t k = 0; k < 10; ++k) {
    const SimulationStepRecord& a = r.simulation[k];
    const SimulationStepRecord b = simulation_step(k);
    EXPECT_EQ(a.step, b.step);
    EXPECT_EQ(a.time_s, b.time_s);
    EXPECT_EQ(a.needle_step, b.needle_step);
    EXPECT_EQ(a.factor_taken, b.factor_taken);
    EXPECT_EQ(a.factor_requested, b.factor_requested);
    EXPECT_EQ(a.factor_epoch, b.factor_epoch);
    EXPECT_EQ(a.probe.position, b.probe.position);
    EXPECT_EQ(a.probe.orientation.coeffs(), b.probe.orientation.coeffs());
    EXPECT_EQ(a.inspiration, b.inspiration);
  }
  ASSERT_EQ(r.hashes.size(), 11u);
  EXPECT_EQ(r.hashes[3].hash, 51u);
  EXPECT_FALSE(r.hashes[3].final);
  EXPECT_EQ(r.hashes[10].loop, LoopName::simulation);
  EXPECT_TRUE(r.hashes[10].final);
  EXPECT_EQ(r.hashes[10].hash, 0xabcu);
  ASSERT_EQ(r.events.size(), 4u);
  EXPECT_EQ(r.events[1].name, "puncture");
  EXPECT_EQ(r.events[1].text("to"), "liver capsule");
  EXPECT_EQ(r.events[1].number("force"), 1.5);
  EXPECT_EQ(r.events[1].fields[1].unit, "N");
  EXPECT_EQ(r.events[1].time_s, 0.06);
}

TEST_F(RecordingFile, NonFiniteInputsAreKeptAsTheyWere) {
  {
    RecordingWriter writer(path_, header());
    HapticStepRecord bad = haptic_step(0);
    bad.pose.position.x() = std::nan("77");
    bad.pose.position.y() = -0.0;
    writer.haptic().add(bad);
    writer.finish();
  }
  const Recording r = read_recording(path_);
  EXPECT_TRUE(std::isnan(r.haptic.at(0).pose.position.x()));
  EXPECT_TRUE(std::signbit(r.haptic.at(0).pose.position.y()));
}

TEST_F(RecordingFile, TimesThatNoSessionHasAreRefused) {
  for (const double time_s : {std::nan(""), HUGE_VAL, -1.0, 1e9}) {
    {
      RecordingWriter writer(path_, header());
      HapticStepRecord step = haptic_step(0);
      step.time_s = time_s;
      writer.haptic().add(step);
      writer.finish();
    }
    EXPECT_THROW(read_recording(path_), ContentError) << time_s;
    {
      RecordingWriter writer(path_, header());
      writer.session().add_event(time_s, 0, "ablation_started");
      writer.finish();
    }
    EXPECT_THROW(read_recording(path_), ContentError) << time_s;
  }
}

TEST_F(RecordingFile, EveryCutLeavesAReadableBeginning) {
  write_session(3);
  const std::vector<std::uint8_t> whole = bytes();
  const Recording full = parse_recording(whole, "whole");
  std::size_t refused = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    try {
      const Recording part = parse_recording({whole.data(), size}, "part");
      EXPECT_FALSE(part.complete()) << size;
      EXPECT_LE(part.usable_bytes, size);
      EXPECT_LE(part.haptic.size(), full.haptic.size());
      EXPECT_NE(part.condition().find("cut short"), std::string::npos);
      for (std::size_t k = 0; k < part.haptic.size(); ++k) ASSERT_EQ(part.haptic[k].step, full.haptic[k].step);
    } catch (const ContentError&) {
      ++refused;  // within the header only
    }
  }
  EXPECT_LT(refused, 400u);
  EXPECT_EQ(parse_recording(std::span(whole).first(whole.size() - 1), "part").haptic.size(), 60u);
}

// After a power cut a file may be as long as it was to become, with zeros where nothing reached the disk.
TEST_F(RecordingFile, ZerosBehindEveryCutAreLeftOut) {
  write_session(2);
  const std::vector<std::uint8_t> whole = bytes();
  const std::size_t first = 12 + (whole[8] | whole[9] << 8) + 4;
  for (std::size_t size = first; size < whole.size() - 33; ++size) {
    const Recording cut = parse_recording({whole.data(), size}, "cut");
    std::vector<std::uint8_t> padded(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    padded.resize(size + 4096);
    const Recording part = parse_recording(padded, "padded");
    ASSERT_GE(part.haptic.size(), cut.haptic.size()) << size;  // the last bytes of a record may have been zeros
    ASSERT_LE(part.haptic.size(), cut.haptic.size() + 1) << size;
    ASSERT_FALSE(part.complete());
    ASSERT_NE(part.condition().find("cut short"), std::string::npos);
  }
}

TEST_F(RecordingFile, EveryFlippedBitIsFound) {
  write_session(2);
  const std::vector<std::uint8_t> whole = bytes();
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::vector<std::uint8_t> damaged = whole;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    try {
      // A length that now points past the end of the file looks like a cut; the recording is then not complete.
      EXPECT_FALSE(parse_recording(damaged, "damaged").complete()) << "bit " << bit;
    } catch (const ContentError& error) {
      const std::string what = error.what();
      ASSERT_EQ(what.rfind("damaged: byte ", 0), 0u) << what;
      ASSERT_EQ(what.find('\n'), std::string::npos) << what;
    }
  }
}

TEST_F(RecordingFile, DamageIsReportedWithItsPlace) {
  write_session(2);
  std::vector<std::uint8_t> damaged = bytes();
  const Recording whole = parse_recording(damaged, "whole");
  damaged[damaged.size() - 10] ^= 0x40;  // within the end record, of 33 bytes
  try {
    parse_recording(damaged, "session.rec");
    FAIL();
  } catch (const ContentError& error) {
    EXPECT_EQ(std::string(error.what()), "session.rec: byte " + std::to_string(whole.file_bytes - 33) +
                                             ": the record's checksum does not match; record the session again");
  }
}

TEST_F(RecordingFile, SurvivesRandomDamage) {
  // With the checksums made right again after the damage, so that it reaches the code behind them.
  write_session(2);
  const std::vector<std::uint8_t> whole = bytes();
  const std::size_t first = 12 + (whole[8] | whole[9] << 8) + 4;
  std::mt19937 random(11);
  const auto any = [&](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
  };
  int accepted = 0, refused = 0;
  for (int round = 0; round < 3000; ++round) {
    std::vector<std::uint8_t> damaged = whole;
    for (std::size_t changes = 1 + any(6); changes > 0; --changes) {
      const std::size_t at = any(damaged.size());
      switch (any(4)) {
        case 0:
          damaged[at] = static_cast<std::uint8_t>(any(256));
          break;
        case 1:
          damaged[at] = any(2) == 0 ? 0x00 : 0xFF;
          break;
        case 2:
          damaged.erase(damaged.begin() + static_cast<std::ptrdiff_t>(at));
          break;
        default:
          damaged.insert(damaged.begin() + static_cast<std::ptrdiff_t>(at), static_cast<std::uint8_t>(any(256)));
      }
    }
    const auto sign = [&](std::size_t begin, std::size_t end) {
      const std::uint32_t sum = files::crc32c({damaged.data() + begin, end - begin});
      for (int i = 0; i < 4; ++i)
        damaged[end + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(sum >> (8 * i));
    };
    if (damaged.size() > first) sign(0, first - 4);
    for (std::size_t at = first; at + 9 <= damaged.size();) {
      const std::size_t length = damaged[at + 1] | damaged[at + 2] << 8;
      if (at + 9 + length > damaged.size()) break;
      sign(at, at + 5 + length);
      at += 9 + length;
    }
    try {
      parse_recording(damaged, "damaged");
      ++accepted;
    } catch (const ContentError& error) {
      ++refused;
      ASSERT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(accepted, 50);  // a changed number is still a number
  EXPECT_GT(refused, 50);
}

/// A file with this text as its header and right checksums.
std::vector<std::uint8_t> with_header(const std::string& text) {
  std::vector<std::uint8_t> file{0x89, 'S', 'T', 'Y', 'R', 'E', 'C', '\n'};
  const auto append = [&file](std::size_t value) {
    for (int shift = 0; shift < 32; shift += 8) file.push_back(static_cast<std::uint8_t>(value >> shift));
  };
  append(text.size());
  file.insert(file.end(), text.begin(), text.end());
  append(files::crc32c(file));
  return file;
}

TEST(RecordingHeader, BadHeadersAreRefusedInOneLine) {
  const auto header_with = [](const std::string& settings, const std::string& version = "1") {
    return R"({"format":"stylet-recording","version":)" + version +
           R"(,"endianness":"little","build":"b","scenario":"s","scenario_hash":"0123456789abcdef","settings":)" +
           settings + "}";
  };
  EXPECT_EQ(parse_recording(with_header(header_with("{}")), "x").header.scenario_hash, 0x0123456789abcdefu);
  const std::string deep = std::string(200'000, '[') + std::string(200'000, ']');
  for (const std::string& bad :
       {std::string(), std::string("{}"), std::string("[]"), std::string("nonsense"), header_with("[]"),
        header_with("{}", "4"), header_with("{}", "-1"), header_with("{}", "\"1\""),
        header_with("{\"a\":" + deep + "}"), deep, std::string(200'000, '['), header_with("{\"a\":\"\xff\"}")}) {
    try {
      parse_recording(with_header(bad), "x");
      FAIL() << bad.substr(0, 200);
    } catch (const ContentError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("x: byte ", 0), 0u) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

TEST(RecordingHeader, ALaterVersionIsRefusedWithItsNumber) {
  try {
    parse_recording(with_header(R"({"format":"stylet-recording","version":7})"), "x");
    FAIL();
  } catch (const ContentError& error) {
    EXPECT_NE(std::string(error.what()).find("of version 7, and this program reads up to 3"), std::string::npos)
        << error.what();
  }
}

TEST_F(RecordingFile, HugeLengthsDoNotReserveMemory) {
  write_session(1);
  std::vector<std::uint8_t> damaged = bytes();
  for (int i = 0; i < 4; ++i) damaged[8 + static_cast<std::size_t>(i)] = 0xFF;  // header length
  EXPECT_THROW(parse_recording(damaged, "damaged"), ContentError);
  EXPECT_THROW(read_recording(path_, {.max_file_bytes = 100}), ContentError);
  EXPECT_THROW(read_recording(path_.string() + ".none"), ContentError);
  EXPECT_THROW(read_recording(fs::temp_directory_path()), ContentError);
}

TEST_F(RecordingFile, FullRingLosesRecordsAndSaysSo) {
  {
    RecordingWriter writer(path_, header(), 1024);
    for (std::uint64_t k = 0; k < 100; ++k) writer.haptic().add(haptic_step(k));
    writer.finish();
  }
  const Recording r = read_recording(path_);
  EXPECT_FALSE(r.complete());
  EXPECT_EQ(r.haptic.size(), 1024u / 102);  // a record is 9 + 93 bytes
  EXPECT_EQ(r.end->lost_records, 100 - r.haptic.size());
  EXPECT_NE(r.condition().find("lost"), std::string::npos);
}

TEST_F(RecordingFile, WhatWasDrainedIsInTheFileWhileTheSessionRuns) {
  RecordingWriter writer(path_, header());
  for (std::uint64_t k = 0; k < 7; ++k) writer.haptic().add(haptic_step(k));
  writer.drain();
  EXPECT_EQ(read_recording(path_).haptic.size(), 7u) << "a process killed now has lost nothing";
}

TEST_F(RecordingFile, WithoutFinishIsReadableButNotComplete) {
  {
    RecordingWriter writer(path_, header());
    for (std::uint64_t k = 0; k < 50; ++k) writer.haptic().add(haptic_step(k));
    writer.drain();
  }
  const Recording r = read_recording(path_);
  EXPECT_EQ(r.haptic.size(), 50u);
  EXPECT_FALSE(r.complete());
}

TEST_F(RecordingFile, AddingARecordAllocatesNothing) {
  RecordingWriter writer(path_, header());
  const std::string long_text(1000, 'x');
  {
    const tests::AllocationCount allocations;
    for (std::uint64_t k = 0; k < 1000; ++k) writer.haptic().add(haptic_step(k));
    writer.simulation().add(simulation_step(1));
    writer.haptic().add(HashRecord{});
    writer.haptic().add_event(1, 2, "name", {{"word", std::string_view(long_text)}});
    EXPECT_EQ(allocations.value(), 0);
  }
  writer.finish();
  EXPECT_EQ(read_recording(path_).events.at(0).text("word"), std::string(kMaxEventText, 'x'));
}

TEST_F(RecordingFile, UnwritablePathAndBadSettingsAreRefused) {
  EXPECT_THROW(RecordingWriter("/no/such/folder/a.rec", header()), ContentError);
  RecordingHeader bad = header();
  bad.settings_json = "[1, 2";
  EXPECT_THROW(RecordingWriter(path_, bad), ContentError);
}

TEST_F(RecordingFile, FullDiskIsReportedAtTheEnd) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_THROW(
      {
        RecordingWriter writer("/dev/full", header());
        for (std::uint64_t k = 0; k < 1000; ++k) writer.haptic().add(haptic_step(k));
        writer.finish();
      },
      ContentError);
}

TEST(Crc32c, MatchesThePublishedVectors) {
  // RFC 3720, B.4: 32 bytes of zeros, of ones, and counting up; and the usual check value.
  std::vector<std::uint8_t> zeros(32, 0), ones(32, 0xFF), up(32);
  for (std::size_t i = 0; i < 32; ++i) up[i] = static_cast<std::uint8_t>(i);
  EXPECT_EQ(files::crc32c(zeros), 0x8A9136AAu);
  EXPECT_EQ(files::crc32c(ones), 0x62A8AB43u);
  EXPECT_EQ(files::crc32c(up), 0x46DD794Eu);
  const std::string digits = "123456789";
  const std::vector<std::uint8_t> check(digits.begin(), digits.end());
  EXPECT_EQ(files::crc32c(check), 0xE3069283u);
  EXPECT_EQ(files::crc32c(std::span(check).subspan(4), files::crc32c(std::span(check).first(4))), 0xE3069283u);
}

TEST(StateHash, ChangesWithEveryBitAndWithTheOrder) {
  const std::vector<double> values{0.1, -2.5, 1e-300, 0.0, 7};
  const auto hash = [](const std::vector<double>& v) {
    session::StateHash h;
    h.add(std::span<const double>(v));
    return h.value();
  };
  std::set<std::uint64_t> seen{hash(values)};
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (int bit = 0; bit < 64; ++bit) {
      std::vector<double> other = values;
      other[i] = std::bit_cast<double>(std::bit_cast<std::uint64_t>(other[i]) ^ (std::uint64_t{1} << bit));
      EXPECT_TRUE(seen.insert(hash(other)).second) << i << ' ' << bit;
    }
  }
  EXPECT_NE(hash({1, 2}), hash({2, 1}));
  EXPECT_NE(hash({0}), hash({0, 0}));
  EXPECT_NE(hash({0.0}), hash({-0.0}));
}

TEST(StateHash, SpreadsSmallChangesOverAllBits) {
  // Flipping one input bit flips about half of the output bits.
  std::mt19937_64 random(5);
  double flipped = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const std::uint64_t word = random();
    session::StateHash a, b;
    a.add(word);
    b.add(word ^ (std::uint64_t{1} << (trial % 64)));
    flipped += std::popcount(a.value() ^ b.value());
  }
  EXPECT_NEAR(flipped / 2000, 32, 1);
}

TEST(StateHash, CountsOnlyTheUsedColumns) {
  Eigen::Matrix3Xd small(3, 2);
  small << 1, 2, 3, 4, 5, 6;
  Eigen::Matrix3Xd large = Eigen::Matrix3Xd::Constant(3, 9, 77.0);
  large.leftCols(2) = small;
  session::StateHash a, b, c;
  a.add_columns(small, 2);
  b.add_columns(large, 2);
  c.add_columns(large, 3);
  EXPECT_EQ(a.value(), b.value());
  EXPECT_NE(a.value(), c.value());
}

}  // namespace
}  // namespace stylet::recording

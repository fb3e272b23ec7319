// What comes out of the real library: its device writes a file here, is full, or is not there.
#include "engine/sound/speaker.h"

#include "engine/sound/mixer.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace stylet::sound {
namespace {

namespace fs = std::filesystem;

/// OpenAL's wave file writer as the one device. The library reads this once; where the file is, every time it opens.
class WaveDevice {
public:
  WaveDevice() {
    const fs::path settings = folder_.write("alsoft.conf",
                                            "[general]\nsample-type = float32\nchannels = mono\n"
                                            "[wave]\nfile = " +
                                                link().string() + "\n");
    setenv("ALSOFT_DRIVERS", "wave", 1);
    setenv("ALSOFT_CONF", settings.c_str(), 1);
  }
  /// The device is this file from its next opening on.
  void is(const fs::path& file) const {
    const fs::path fresh = folder_ / "fresh";
    fs::create_symlink(file, fresh);
    fs::rename(fresh, link());
  }
  fs::path file(const std::string& name) const { return folder_ / name; }

private:
  fs::path link() const { return folder_ / "device"; }
  support::TemporaryFolder folder_;
};

const WaveDevice& device() {
  static const WaveDevice wave;
  return wave;
}

/// Those that are not 0, in order: a gap that a busy machine made is none.
std::vector<float> heard(const fs::path& wav) {
  std::ifstream file(wav, std::ios::binary);
  const std::vector<char> bytes(std::istreambuf_iterator<char>(file), {});
  constexpr std::string_view kData = "data";
  const auto data = std::search(bytes.begin(), bytes.end(), kData.begin(), kData.end());
  std::vector<float> samples;
  for (auto at = data; bytes.end() - at >= 12; at += 4) {
    float sample = 0;
    std::memcpy(&sample, &*at + 8, sizeof(sample));
    if (sample != 0) samples.push_back(sample);
  }
  return samples;
}

/// Waits, however slow the machine is. @return it came
bool comes(const std::function<bool()>& what) {
  for (int i = 0; i < 6000; ++i) {
    if (what()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

TEST(Speaker, PlaysEverySampleOfTheMix) {
  const fs::path file = device().file("played.wav");
  device().is(file);
  std::vector<float> mix = waveform(Sound::puncture, 0.8);
  std::erase(mix, 0.0F);
  Speaker speaker;
  ASSERT_TRUE(comes([&] { return speaker.state() == Speaker::State::plays; }));
  EXPECT_EQ(speaker.news(), std::nullopt) << "nothing to tell";
  speaker.play({.sound = Sound::puncture, .strength = 0.8});
  ASSERT_TRUE(comes([&] { return heard(file).size() >= mix.size(); }));
  EXPECT_EQ(heard(file), mix);
}

TEST(Speaker, MutedOpensNothingAndMutedLaterPlaysZeros) {
  const fs::path file = device().file("muted.wav");
  device().is(file);
  Speaker speaker(true);
  speaker.play({.sound = Sound::shot});
  EXPECT_EQ(speaker.state(), Speaker::State::closed);
  EXPECT_FALSE(fs::exists(file));
  speaker.mute(false);
  ASSERT_TRUE(comes([&] { return speaker.state() == Speaker::State::plays; }));
  speaker.mute(true);
  const std::uintmax_t before = fs::exists(file) ? fs::file_size(file) : 0;
  // Longer than what the device had queued: only then is it mute for certain.
  constexpr std::uintmax_t kLong = sizeof(float) * kRate / 2;
  ASSERT_TRUE(comes([&] { return fs::file_size(file) > before + kLong; }));
  speaker.play({.sound = Sound::puncture});
  ASSERT_TRUE(comes([&] { return fs::file_size(file) > before + 2 * kLong; }));
  EXPECT_TRUE(heard(file).empty());
}

TEST(Speaker, GoesOnSilentWithoutADevice) {
  device().is(device().file("no-such-folder/device.wav"));
  Speaker speaker;
  ASSERT_TRUE(comes([&] { return speaker.state() == Speaker::State::silent; }));
  const auto news = speaker.news();
  ASSERT_TRUE(news.has_value());
  EXPECT_NE(news->find("no device"), std::string::npos) << *news;
  EXPECT_EQ(news->find('\n'), std::string::npos);
  for (int i = 0; i < 2000; ++i) speaker.play({.sound = Sound::shot});
  EXPECT_EQ(speaker.news(), std::nullopt) << "once";
}

TEST(Speaker, OutlivesItsDeviceAndTakesUpTheNext) {
  device().is("/dev/full");
  Speaker speaker;
  ASSERT_TRUE(comes([&] { return speaker.state() == Speaker::State::lost; }));
  std::optional<std::string> news;
  ASSERT_TRUE(comes([&] { return (news = speaker.news()).has_value(); }));
  EXPECT_NE(news->find("gone"), std::string::npos) << *news;
  speaker.play({.sound = Sound::shot});
  const fs::path file = device().file("next.wav");
  device().is(file);
  ASSERT_TRUE(comes([&] { return speaker.state() == Speaker::State::plays && fs::exists(file); }));
  EXPECT_EQ(speaker.news(), "there is sound again");
  speaker.play({.sound = Sound::bone, .strength = 1});
  std::vector<float> mix = waveform(Sound::bone, 1);
  std::erase(mix, 0.0F);
  ASSERT_TRUE(comes([&] { return heard(file).size() >= mix.size(); }));
  EXPECT_EQ(heard(file), mix) << "and nothing of what came while there was none";
}

}  // namespace
}  // namespace stylet::sound

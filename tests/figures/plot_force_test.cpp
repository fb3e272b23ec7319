#include "engine/figures/force_trace.h"
#include "engine/figures/video.h"
#include "engine/files/error.h"
#include "engine/picture/picture.h"
#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

namespace stylet::figures {
namespace {

namespace fs = std::filesystem;
using files::ContentError;

/// Insertion, withdrawal, second insertion with a force like friction and a spring.
ForceTrace insertion(int samples = 4000) {
  ForceTrace trace(static_cast<std::size_t>(samples));
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, -0.2, -0.9).normalized();
  const Eigen::Vector3d across = Eigen::Vector3d(0.2, 0.3, 0).normalized();  // axis.dot(across) = 0
  double last = 0, work = 0;
  for (int i = 0; i < samples; ++i) {
    const double t = 12.0 * i / samples;
    const double depth = std::max(0.0, t < 6   ? 0.012 * (t - 1)
                                       : t < 8 ? 0.06 - 0.015 * (t - 6)
                                               : 0.03 + 0.011 * (t - 8));
    const double speed = depth - last;
    last = depth;
    const double friction = depth > 0 ? std::copysign(0.2 + 8 * depth, speed) : 0;
    const double axial = 6 * depth + friction + 0.02 * std::sin(40 * t);
    work += axial * speed;
    trace.add(t, axis * depth, axis, depth, -axial * axis + 0.9 * std::sin(0.9 * t) * (depth > 0) * across, work);
  }
  return trace;
}

TEST(ForceTrace, SplitsTheForceAlongAndAcrossTheNeedle) {
  ForceTrace trace(10);
  trace.add(0, {0, 0, 0}, {0, 0, -1}, 0.01, {0.3, 0.4, 2});  // pushes up, against a needle that points down
  const ForceSample& s = trace.samples()[0];
  EXPECT_DOUBLE_EQ(s.axial, 2);
  EXPECT_DOUBLE_EQ(s.lateral, 0.5);
}

TEST(ForceTrace, SummaryHoldsTheGreatestOfEach) {
  ForceTrace trace(10);
  const Eigen::Vector3d down(0, 0, -1);
  trace.add(1.0, {0, 0, 0}, down, 0.00, {0, 0, 0});
  trace.add(1.1, {0, 0, 0}, down, 0.02, {0, 3, 4});
  trace.add(1.2, {0, 0, 0}, down, 0.05, {0, 0, -1});
  const ForceSummary s = trace.summary();
  EXPECT_EQ(s.samples, 3u);
  EXPECT_NEAR(s.duration_s, 0.2, 1e-12);
  EXPECT_DOUBLE_EQ(s.peak_force, 5);
  EXPECT_DOUBLE_EQ(s.peak_force_time_s, 1.1);
  EXPECT_DOUBLE_EQ(s.peak_axial, 4);
  EXPECT_DOUBLE_EQ(s.peak_lateral, 3);
  EXPECT_DOUBLE_EQ(s.max_depth, 0.05);
  EXPECT_NEAR(s.max_jump, std::hypot(3, 5), 1e-12);
  EXPECT_EQ(ForceTrace(3).summary().peak_force, 0);
}

TEST(ForceTrace, LeastWorkIsOfAllStepsAlsoThoseNotKept) {
  ForceTrace trace(2, 2);  // steps 0 and 2 are kept, 4 does not fit
  for (const double work : {0.1, 0.02, 0.3, 0.2, 0.4}) trace.add(0, {}, {0, 0, 1}, 0, {0, 0, 0}, work);
  EXPECT_EQ(trace.summary().least_work, 0) << "nothing was done before the start";
  trace.add(0, {}, {0, 0, 1}, 0, {0, 0, 0}, -0.005);
  trace.add(0, {}, {0, 0, 1}, 0, {0, 0, 0}, -0.001);
  EXPECT_EQ(trace.summary().least_work, -0.005);
  EXPECT_EQ(trace.samples()[1].work, 0.3);
}

TEST(ForceTrace, KeepsOneInSoManyAndCountsWhatDoesNotFit) {
  ForceTrace trace(5, 10);
  int refused = 0;
  for (int i = 0; i < 100; ++i) refused += trace.add(i, {}, {0, 0, 1}, 0, {0, 0, 0}) ? 0 : 1;
  ASSERT_EQ(trace.samples().size(), 5u);
  EXPECT_EQ(trace.samples()[4].time_s, 40);
  EXPECT_EQ(trace.dropped(), 5u);
  EXPECT_EQ(refused, 5);
}

TEST(ForceCsv, ReadsBackToTheSameBits) {
  const support::TemporaryFolder folder;
  const ForceTrace trace = insertion(500);
  // Between two samples, as is one of a thinned trace; two at once; one after the end.
  const double first = trace.samples()[10].time_s, second = trace.samples()[20].time_s;
  const TraceEvent events[] = {{second, "liver"}, {first - 1e-9, "a \"b\""}, {second, "tumour"}, {1e9, "late"}};
  write_force_csv(folder / "force.csv", trace, events);
  std::ifstream file(folder / "force.csv", std::ios::binary);
  std::string line;
  ASSERT_TRUE(std::getline(file, line));
  EXPECT_EQ(line,
            "time_s,hub_x_m,hub_y_m,hub_z_m,depth_m,force_x_n,force_y_n,force_z_n,force_axial_n,force_lateral_n,"
            "work_j,event\r");
  for (const ForceSample& s : trace.samples()) {
    ASSERT_TRUE(std::getline(file, line));
    ASSERT_EQ(line.back(), '\r');
    std::istringstream fields(line);
    for (const double expected : {s.time_s, s.hub.x(), s.hub.y(), s.hub.z(), s.depth, s.force.x(), s.force.y(),
                                  s.force.z(), s.axial, s.lateral, s.work}) {
      std::string field;
      ASSERT_TRUE(std::getline(fields, field, ','));
      ASSERT_EQ(std::strtod(field.c_str(), nullptr), expected);
    }
    std::string event;
    std::getline(fields, event);
    ASSERT_EQ(event, s.time_s == first ? "\"a \"\"b\"\"\"\r" : s.time_s == second ? "\"liver; tumour\"\r" : "\r");
  }
  EXPECT_FALSE(std::getline(file, line));
}

TEST(ForceCsv, UnwritablePathIsOneLine) {
  try {
    write_force_csv("/no/such/folder/force.csv", insertion(10));
    FAIL();
  } catch (const ContentError& error) {
    EXPECT_NE(std::string(error.what()).find("/no/such/folder/force.csv"), std::string::npos);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

TEST(ForceFigure, IsWrittenAsPngAndGrowsWithTheData) {
  const support::TemporaryFolder folder;
  const Font font = Font::load();
  const TraceEvent events[] = {{1.0, "skin"}, {6.0, "withdrawal"}, {8.0, "second advance"}};
  const picture::Picture figure = draw_force_figure(insertion(), events, font);
  picture::write_png(folder / "force.png", figure);
  std::ifstream file(folder / "force.png", std::ios::binary);
  std::array<char, 8> magic{};
  file.read(magic.data(), magic.size());
  EXPECT_EQ(std::string(magic.data(), 8), "\x89PNG\r\n\x1a\n");
  EXPECT_NE(figure.rgba, draw_force_figure(ForceTrace(1), {}, font).rgba);
  if (const char* keep = std::getenv("STYLET_KEEP_FIGURES")) {
    picture::write_png(fs::path(keep) / "force.png", figure);
    picture::write_png(fs::path(keep) / "strip.png", draw_force_depth_strip(insertion(), 7.2, font, 1280, 220));
  }
}

TEST(ForceFigure, StripShowsThePastOnlyOnAxesThatDoNotMove) {
  const Font font;
  const ForceTrace trace = insertion();
  const auto curve_pixels = [&](double t) {
    const picture::Picture image = draw_force_depth_strip(trace, t, font, 640, 180);
    const Colour axial = plot_colour(0, PlotTheme::dark);
    int count = 0;
    for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
      count += image.rgba[i] == axial.r && image.rgba[i + 1] == axial.g ? 1 : 0;
    }
    return count;
  };
  const int none = curve_pixels(-1), early = curve_pixels(3), late = curve_pixels(5.5), all = curve_pixels(12);
  EXPECT_EQ(none, 0);
  EXPECT_GT(early, 20);
  EXPECT_GT(late, early);
  EXPECT_GT(all, late);
  // The axes are the same pixels at all times: compare the left margin.
  const picture::Picture a = draw_force_depth_strip(trace, 2, font, 640, 180);
  const picture::Picture b = draw_force_depth_strip(trace, 11, font, 640, 180);
  for (int y = 0; y < 180; ++y) {
    for (int x = 0; x < 10; ++x) ASSERT_EQ(a.at(x, y)[0], b.at(x, y)[0]);
  }
}

void paint(picture::Picture& image, int frame) {
  Canvas canvas(image);
  canvas.fill({0, 0, static_cast<double>(image.width), static_cast<double>(image.height)}, {20, 30, 60});
  canvas.disc({10.0 + 3 * frame, 60}, 9, {250, 200, 40});
}

TEST(Video, HasTheFramesAndTheDurationItWasGiven) {
  const support::TemporaryFolder folder;
  const fs::path path = folder / "clip.mp4";
  VideoWriter video(path, {.width = 160, .height = 120, .frames_per_second = 30});
  picture::Picture image(160, 120);
  for (int frame = 0; frame < 45; ++frame) {
    paint(image, frame);
    video.add_frame(image.rgba);
  }
  EXPECT_FALSE(fs::exists(path));  // not before it is whole
  video.finish();
  EXPECT_EQ(video.frames(), 45);
  const std::string told =
      support::run_in_shell(
          "ffprobe -v error -count_frames -show_entries "
          "stream=codec_name,width,height,pix_fmt,nb_read_frames,duration -of default=noprint_wrappers=1 " +
          path.string())
          .output;
  EXPECT_NE(told.find("codec_name=h264\n"), std::string::npos) << told;
  EXPECT_NE(told.find("width=160\nheight=120\n"), std::string::npos) << told;
  EXPECT_NE(told.find("pix_fmt=yuv420p\n"), std::string::npos) << told;
  EXPECT_NE(told.find("duration=1.500000\n"), std::string::npos) << told;
  EXPECT_NE(told.find("nb_read_frames=45\n"), std::string::npos) << told;
}

TEST(Video, FramesComeBackAsTheyWentIn) {
  const support::TemporaryFolder folder;
  const fs::path path = folder / "clip.mp4";
  VideoWriter video(path, {.width = 64, .height = 48});
  picture::Picture image(64, 48);  // red above, blue below: rows must not be flipped, channels not swapped
  Canvas(image).fill({0, 0, 64, 24}, {220, 30, 30});
  Canvas(image).fill({0, 24, 64, 48}, {30, 30, 220});
  for (int i = 0; i < 5; ++i) video.add_frame(image.rgba);
  video.finish();
  const fs::path raw = folder / "frame.rgb";
  support::run_in_shell("ffmpeg -v error -y -i " + path.string() + " -frames:v 1 -f rawvideo -pix_fmt rgb24 " +
                        raw.string());
  std::ifstream file(raw, std::ios::binary);
  std::vector<unsigned char> rgb(64 * 48 * 3);
  ASSERT_TRUE(file.read(reinterpret_cast<char*>(rgb.data()), static_cast<std::streamsize>(rgb.size())));
  const auto pixel = [&](int x, int y) { return &rgb[3 * (64 * y + x)]; };
  EXPECT_NEAR(pixel(32, 8)[0], 220, 25);
  EXPECT_NEAR(pixel(32, 8)[2], 30, 25);
  EXPECT_NEAR(pixel(32, 40)[0], 30, 25);
  EXPECT_NEAR(pixel(32, 40)[2], 220, 25);
}

TEST(Video, HasTheSoundItWasGivenAtItsTime) {
  const support::TemporaryFolder folder;
  const fs::path path = folder / "clip.mp4";
  constexpr int kRate = 48'000;
  std::vector<float> sound(kRate);  // a second; a tone from 0.5 to 0.7 s
  for (int n = kRate / 2; n < kRate * 7 / 10; ++n) sound[n] = 0.5F * std::sin(0.1F * static_cast<float>(n));
  VideoWriter video(path, {.width = 64, .height = 48, .sound = sound, .samples_per_second = kRate});
  picture::Picture image(64, 48);
  for (int frame = 0; frame < 30; ++frame) video.add_frame(image.rgba);
  video.finish();
  const fs::path raw = folder / "sound.f32";
  support::run_in_shell("ffmpeg -v error -y -i " + path.string() + " -f f32le -ac 1 " + raw.string());
  std::ifstream file(raw, std::ios::binary);
  std::vector<float> back(kRate);
  ASSERT_TRUE(file.read(reinterpret_cast<char*>(back.data()), sizeof(float) * back.size()));
  double within = 0, without = 0;
  for (int n = 0; n < kRate; ++n) {
    const bool tone = n > kRate * 49 / 100 && n < kRate * 71 / 100;  // a frame of the code is 21 ms
    (tone ? within : without) += static_cast<double>(back[n]) * back[n];
  }
  EXPECT_NEAR(within, 0.5 * 0.25 * 0.2 * kRate, 0.1 * 0.025 * kRate) << "half the square of its amplitude";
  EXPECT_LT(without, 0.01 * within);
  fs::remove(path);
  fs::remove(raw);
  EXPECT_TRUE(folder.empty()) << "nothing is left of what it was made from";
}

TEST(Video, MissingCommandIsOneLineThatNamesIt) {
  const support::TemporaryFolder folder;
  try {
    VideoWriter video(folder / "clip.mp4", {.width = 16, .height = 16, .encoder = "no-such-ffmpeg"});
    FAIL();
  } catch (const ContentError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("no-such-ffmpeg"), std::string::npos) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos);
  }
  EXPECT_TRUE(folder.empty());
}

TEST(Video, EncoderThatDiesIsAnErrorAndNoSignal) {
  const support::TemporaryFolder folder;
  VideoWriter video(folder / "clip.mp4", {.width = 640, .height = 480, .encoder = "false"});
  const picture::Picture image(640, 480);
  EXPECT_THROW(
      {
        for (int i = 0; i < 100; ++i) video.add_frame(image.rgba);  // more than a socket holds
      },
      ContentError);
  EXPECT_THROW(video.finish(), ContentError);
}

TEST(Video, ErrorOfTheEncoderIsPassedOn) {
  const support::TemporaryFolder folder;
  VideoWriter video(folder / "missing/clip.mp4", {.width = 64, .height = 64});
  try {
    const picture::Picture image(64, 64);
    for (int i = 0; i < 3; ++i) video.add_frame(image.rgba);
    video.finish();
    FAIL();
  } catch (const ContentError& error) {
    EXPECT_NE(std::string(error.what()).find("No such file"), std::string::npos) << error.what();
  }
}

TEST(Video, LeavesNothingBehindWithoutFinish) {
  const support::TemporaryFolder folder;
  {
    VideoWriter video(folder / "clip.mp4", {.width = 64, .height = 64});
    const picture::Picture image(64, 64);
    for (int i = 0; i < 10; ++i) video.add_frame(image.rgba);
  }
  EXPECT_TRUE(folder.empty());
}

TEST(Video, RefusesOddSizesAndWrongFrames) {
  const support::TemporaryFolder folder;
  EXPECT_THROW(VideoWriter(folder / "a.mp4", {.width = 63, .height = 64}), ContentError);
  EXPECT_THROW(VideoWriter(folder / "a.mp4", {.width = 0, .height = 64}), ContentError);
  VideoWriter video(folder / "a.mp4", {.width = 64, .height = 64});
  EXPECT_THROW(video.add_frame(std::vector<std::uint8_t>(3)), ContentError);
}

}  // namespace
}  // namespace stylet::figures

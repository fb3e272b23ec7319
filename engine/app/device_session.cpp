#include "engine/app/device_session.h"

#include "engine/files/error.h"
#include "haptic/feel.h"
#include "haptic/hid/calibrator.h"
#include "haptic/hid/hand_recorder.h"
#include "haptic/output_guard.h"
#include "haptic/paced_loop.h"
#include "haptic/real_time_thread.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace stylet::app {
namespace {

namespace hid = haptic::hid;

constexpr int kReadTimeout = 5;         // ms
constexpr double kPlacePatience = 120;  // s, for one place
constexpr double kAsked = 0.1;          // N

std::string title(const HidDevice& device) {
  return fmt::format("{} ({:04x}:{:04x})", device.summary.product.empty() ? "HID device" : device.summary.product,
                     device.summary.vendor_id, device.summary.product_id);
}

files::ContentError gone(const HidDevice& device) {
  return files::ContentError(fmt::format("{}: was pulled out; plug it in and begin anew", title(device)));
}

/// What stands beside the needle's axes of a recorded hand.
readers::MotionFrame frame_of(hid::DeviceKind kind) {
  return kind == hid::DeviceKind::kPen ? readers::MotionFrame::kTablet : readers::MotionFrame::kHand;
}

}  // namespace

void calibrate_device(const HidChoice& choice, double still_s, Observer& observer) {
  const auto say = [&](const std::string& line) { observer.note(Note::info, line); };
  const HidDevice device = choose_uncalibrated(choice, "--calibrate");
  OpenHidDevice open(device);
  haptic::MonotonicClock clock;
  const auto now_s = [&] { return static_cast<double>(clock.now_ns()) * 1e-9; };
  hid::Calibrator calibrator(device.kind, {.still_s = still_s});
  say(fmt::format("{}: hold still for {:g} s at each place.", title(device), still_s));
  say(calibrator.prompt());
  hid::HidReading reading;
  std::array<std::uint8_t, hid::kReadBuffer> report;
  double since_s = now_s();
  while (!calibrator.done()) {
    throw_if_stopped(observer);
    int size = open.transport->read(report, kReadTimeout);
    for (; size > 0; size = open.transport->read(report, 0)) {
      open.map.decode(std::span(report).first(size), reading);
    }
    if (size < 0) throw gone(device);
    if (calibrator.add(reading, now_s())) {
      since_s = now_s();
      if (!calibrator.done()) say(calibrator.prompt());
    }
    if (now_s() - since_s > kPlacePatience) {
      throw files::ContentError(fmt::format("{}: nothing for {:g} s; \"{}\" Begin anew when it can be done",
                                            title(device), kPlacePatience, calibrator.prompt()));
    }
  }
  const hid::Calibration found = calibrator.result();
  const auto file = readers::save_calibration(identity_of(device.summary), found);
  if (found.rest) {
    const Eigen::Vector3d rest_mm = 1e3 * *found.rest;
    say(fmt::format("rest place   {:.1f} {:.1f} {:.1f} mm", rest_mm.x(), rest_mm.y(), rest_mm.z()));
  }
  if (found.dead_zone) {
    say(fmt::format("dead zones   {:.3f} of the full deflection", fmt::join(*found.dead_zone, " ")));
  } else {
    const Eigen::AngleAxisd turn(found.user_from_device);
    say(fmt::format("turned by    {:.1f} deg", turn.angle() * 180 / std::numbers::pi));
    say(fmt::format("scale        {:.2f} mm in the patient for one of the hand", found.scale));
  }
  say(fmt::format("{} holds the calibration; `stylet train --device hid` reads it", file.string()));
}

void record_device(const HidChoice& choice, double seconds, const std::filesystem::path& file, Observer& observer) {
  const auto say = [&](const std::string& line) { observer.note(Note::info, line); };
  const HidDevice device = choose_hid_device(choice, "--record");
  OpenHidDevice open(device);
  haptic::MonotonicClock clock;
  haptic::Workspace workspace{.patient_from_device = turn_on_the_desk(device), .scale = device.calibration.scale};
  hid::HandRecorder recorder(open.map, workspace);
  content::Motion motion;
  readers::RawReports raw{
      .frame = frame_of(device.kind), .device = title(device), .report_descriptor = open.descriptor};
  std::array<std::uint8_t, hid::kReadBuffer> report;
  say(fmt::format("{}: recording {}", title(device),
                  seconds > 0 ? fmt::format("{:g} s", seconds) : std::string("until Ctrl-C")));
  const std::int64_t opened_ns = clock.now_ns();
  std::int64_t first_ns = 0;
  bool there = true;
  while (there && !observer.stop_requested() &&
         (seconds <= 0 || static_cast<double>(clock.now_ns() - opened_ns) < seconds * 1e9)) {
    const int size = open.transport->read(report, kReadTimeout);
    there = size >= 0;
    if (size <= 0) continue;
    const auto bytes = std::span(report).first(size);
    const std::int64_t now_ns = clock.now_ns();
    if (raw.reports.empty()) first_ns = now_ns;
    raw.reports.push_back(
        {.time_s = static_cast<double>(now_ns - first_ns) * 1e-9, .bytes = {bytes.begin(), bytes.end()}});
    if (const auto sample = recorder.add(bytes, now_ns)) {
      motion.stylus.push_back(
          {.time_s = sample->time_s, .pose = {sample->position, sample->orientation}, .buttons = sample->buttons});
    }
  }
  observer.stop_answered();
  if (!there) observer.note(Note::notice, title(device) + ": was pulled out; the recording ends there");
  if (motion.stylus.size() < 2) {
    throw files::ContentError(fmt::format("{}: not written, {} sent {} reports; move it while it is recorded",
                                          file.string(), title(device), raw.reports.size()));
  }
  readers::write_motion(motion, file.stem().string(), file, 9, raw);
  say(fmt::format(
      "{} holds {} reports and {} poses of {:.1f} s; `stylet train SCENARIO --device recorded:{}` plays it",
      file.string(), raw.reports.size(), motion.stylus.size(), motion.stylus.back().time_s, file.string()));
}

namespace {

std::string what_is_felt(haptic::Feel feel, const haptic::FeelModel& model) {
  const double mm = 1e3 * haptic::FeelModel::kDepth;
  switch (feel) {
    case haptic::Feel::kSpring:
      return fmt::format(
          "a spring: it draws you back to where you are now, {:.1f} N for each centimetre, smoothly in "
          "all directions",
          0.01 * model.stiffness());
    case haptic::Feel::kWall:
      return fmt::format("a wall: {:.0f} mm below you is a hard floor; it neither trembles nor holds you", mm);
    case haptic::Feel::kFriction:
      return fmt::format("friction: {:.1f} N against every motion, the same both ways; at rest nothing moves you",
                         model.force());
    case haptic::Feel::kPuncture:
      return fmt::format(
          "a skin: {:.0f} mm below you it resists up to {:.1f} N and gives way at once; above it is whole "
          "again",
          mm, model.force());
  }
  return {};
}

/// Written by the haptic thread.
struct Felt {
  std::atomic<double> most_n{0};
  std::atomic<double> farthest_m{0};
  std::atomic<std::uint64_t> steps{0};
  std::atomic<std::uint64_t> followed{0};  ///< steps with a pose
  std::atomic<std::uint64_t> clipped{0};   ///< steps in which the device could not give it all
  std::atomic<int> punctures{0};
  // Of the steps in which the device said what its motors give.
  std::atomic<double> told_most_n{0};
  std::atomic<double> told_sum_n{0};
  std::atomic<double> asked_sum_n{0};
  std::atomic<double> along_sum{0};  ///< asked . told, N^2

  std::string told() const;
};

std::string Felt::told() const {
  constexpr double kAnything = 100;  // N over steps: 0.1 N s
  if (asked_sum_n < kAnything) return {};
  const double share = told_sum_n / asked_sum_n;
  std::string words = fmt::format("; the device says that it gave up to {:.2f} N, {:.0f} % of what was asked in all",
                                  told_most_n.load(), 100 * share);
  if (along_sum < 0) return words + ", but against it: its axes are not those of its profile, do not use it";
  if (share < 0.8) return words + ": its own settings or warm motors hold it back";
  if (share > 1.2) return words + ": something else pushes too, or its own settings make it stronger";
  return words;
}

/// @return whether nobody asked for the end
bool feel(haptic::hid::HidStylus& stylus, haptic::FeelModel& model, double seconds, Felt& felt, Observer& observer) {
  haptic::OutputGuard guard(stylus.limits());
  std::optional<Eigen::Vector3d> begin;
  double last_s = 0;
  const auto step = [&](const haptic::StepTiming& timing) {
    const double now_s = static_cast<double>(timing.started_ns) * 1e-9;
    const double dt_s = last_s > 0 ? now_s - last_s : 1e-3;
    last_s = now_s;
    const haptic::StylusSample sample = stylus.read(now_s);
    felt.steps.fetch_add(1, std::memory_order_relaxed);
    haptic::GuardInput input{.position = sample.position,
                             .orientation = sample.orientation,
                             .valid = sample.valid,
                             .pose_age_s = sample.age_s};
    if (sample.valid) {
      if (!begin) begin = sample.position;
      input.force = model.step(sample.position - *begin, dt_s);
      felt.followed.fetch_add(1, std::memory_order_relaxed);
      felt.farthest_m = std::max(felt.farthest_m.load(), (sample.position - *begin).norm());
      felt.punctures = model.punctures();
    }
    const haptic::GuardedWrench out = guard.apply(input, dt_s);
    felt.most_n = std::max(felt.most_n.load(), out.force.norm());
    if ((out.flags & haptic::kOutputClamped) != 0) felt.clipped.fetch_add(1, std::memory_order_relaxed);
    // Where nothing is asked for, what is told is the device's own: its weight, or of before.
    if (const auto told = stylus.told_force(); told && sample.valid && out.force.norm() > kAsked) {
      felt.told_most_n = std::max(felt.told_most_n.load(), told->norm());
      felt.told_sum_n = felt.told_sum_n + told->norm();
      felt.asked_sum_n = felt.asked_sum_n + out.force.norm();
      felt.along_sum = felt.along_sum + told->dot(out.force);
    }
    stylus.write(out.force, out.torque);
  };
  haptic::RealTimeThread thread({.lock_memory = false}, step);
  haptic::MonotonicClock clock;
  const std::int64_t until_ns = clock.now_ns() + static_cast<std::int64_t>(seconds * 1e9);
  while (clock.now_ns() < until_ns && !observer.stop_requested()) clock.sleep_until_ns(clock.now_ns() + 10'000'000);
  thread.stop();
  stylus.write(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  return !observer.stop_requested();
}

}  // namespace

void feel_device(const HidChoice& choice, double each_s, Observer& observer) {
  const auto say = [&](const std::string& line) { observer.note(Note::info, line); };
  const HidDevice device = choose_hid_device(choice, "--feel");
  haptic::hid::HidStylus stylus({.device = device.summary,
                                 .source = device.source,
                                 .profile = device.profile,
                                 .workspace = {.patient_from_device = turn_on_the_desk(device)}});
  if (!stylus.limits().renders_force) {
    throw files::ContentError(fmt::format("{}: gives no force; there is nothing to feel", title(device)));
  }
  say(fmt::format("{}: hold it lightly; each lasts {:g} s, and Ctrl-C ends at once without force.", title(device),
                  each_s));
  if (!stylus.lets_go()) {
    observer.note(
        Note::notice,
        fmt::format("{}: its force may stay on if this computer stops; be ready to switch it off", title(device)));
  }
  for (std::size_t k = 0; k < haptic::kFeels.size(); ++k) {
    haptic::FeelModel model(haptic::kFeels[k], stylus.limits());
    say(fmt::format("{} of {}: {}", k + 1, haptic::kFeels.size(), what_is_felt(haptic::kFeels[k], model)));
    Felt felt;
    const bool go_on = feel(stylus, model, each_s, felt, observer);
    const auto share = [&](std::uint64_t count) {
      return felt.steps > 0 ? 100 * static_cast<double>(count) / static_cast<double>(felt.steps) : 0.0;
    };
    say(fmt::format(
        "  asked for up to {:.2f} N; you moved {:.0f} mm{}; followed {:.0f} % of the time, at the device's most "
        "{:.0f} %{}",
        felt.most_n.load(), 1e3 * felt.farthest_m.load(),
        haptic::kFeels[k] == haptic::Feel::kPuncture ? fmt::format(", {} times through", felt.punctures.load()) : "",
        share(felt.followed), share(felt.clipped), felt.told()));
    if (!go_on) break;
  }
  observer.stop_answered();
  say(stylus.statistics());
}

}  // namespace stylet::app

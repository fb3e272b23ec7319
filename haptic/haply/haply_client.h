// Our side of the talk with the Haply Inverse Service: one answer for each message, and a force that is never old.
#pragma once

#include "haptic/haply/haply_message.h"
#include "haptic/hid/stylus_adapter.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace stylet::haptic::haply {

/// Largest force of the range of the reports; a profile may say less. The strongest that a public client allows.
inline constexpr double kMostForce = 12;  // N

/// Which of the service's devices.
struct Pair {
  std::string arm{};   ///< device_id; empty: the first
  std::string grip{};  ///< device_id; empty: the only one, if there is one
};

/// The state of a connection. The service pushes nothing: it sends an inventory when somebody connects, and then one
/// message for each that it gets. So one message is under way at a time; only a zero force goes out of turn, when the
/// answer to another force does not come. Depends on its inputs only; one thread at a time; times in ns of a
/// monotonic clock.
class HaplyClient {
public:
  using Report = std::array<std::uint8_t, hid::kPoseReportBytes>;

  static constexpr std::int64_t kSilence = 20'000'000;         ///< without a state: no force
  static constexpr std::int64_t kOldAnswer = 10'000'000;       ///< a state that came later is too old to be one
  static constexpr std::int64_t kInventoryWait = 500'000'000;  ///< for what comes unasked
  static constexpr std::int64_t kFirstAnswer = 500'000'000;
  static constexpr std::int64_t kAnswer = 100'000'000;       ///< later: the connection is of no use any more
  static constexpr std::int64_t kLookAgain = 1'000'000'000;  ///< between questions for devices while there is none
  static constexpr int kMostNonsense = 20;                   ///< answers in a row without a state of our arm
  static constexpr int kMostUnasked = 10;                    ///< messages that nobody asked for

  HaplyClient(Pair pair, std::int64_t connected_ns) : pair_(std::move(pair)), connected_ns_(connected_ns) {}

  /// What came in, whatever it is. @return a report, where it had a state of our arm
  std::optional<Report> receive(std::string_view text, std::int64_t now_ns);
  /// What is to be sent now, to be asked for at least every millisecond. Empty: nothing.
  std::string next(std::int64_t now_ns);
  /// Output reports of the session.
  bool output(std::span<const std::uint8_t> report, std::int64_t now_ns) { return adapter_.output(report, now_ns); }
  bool set_gain(std::span<const std::uint8_t> report) { return adapter_.set_gain(report); }
  std::uint8_t gain() const { return adapter_.gain(); }
  /// From now on zero force only. @return whether the service has answered one
  bool end();
  /// Of a connection that is given up: what takes the last force back, to be asked for until it is empty.
  std::string last_word();
  /// That the service says the arm was commanded, axes of the reports, N; none: it has said nothing of it.
  const std::optional<Eigen::Vector3d>& told_force() const { return told_force_; }
  /// Whether the session wants the motors on.
  bool enabled() const { return adapter_.enabled(); }

  /// Why this connection is to be given up; empty: it is not.
  const std::string& failed() const { return failed_; }
  /// What the user should do before the device can lead or push; empty: nothing.
  const std::string& problem() const { return problem_; }

private:
  enum class Form : std::uint8_t { kBoth, kVector, kValues, kNone };

  bool able(std::int64_t now_ns) const;
  Eigen::Vector3d force(std::int64_t now_ns) const;
  std::string force_message(const Eigen::Vector3d& force);
  std::string first_message();
  void take(const Arm& arm, std::int64_t now_ns);
  void check_echo(const Arm& arm, std::int64_t now_ns);
  void look_for_others(const Arm& arm, std::int64_t now_ns);
  std::string what_is_wrong(const Grip* grip) const;

  Pair pair_;
  hid::StylusAdapter adapter_{kMostForce};
  std::int64_t connected_ns_;
  bool heard_ = false;       // anything
  bool introduced_ = false;  // the first message was sent
  bool ending_ = false;
  int outstanding_ = 0;
  std::int64_t waiting_ns_ = 0;  // since when an answer is due
  std::int64_t looked_ns_ = 0;
  std::int64_t state_ns_ = 0;  // when our arm last told its position; 0: never
  int nonsense_ = 0;
  int unasked_ = 0;
  bool pushed_ = false;     // a force that is not zero has not been taken back yet under each key
  bool zero_sent_ = false;  // the last message was a zero under both keys
  bool let_go_ = false;     // the key changes: no force until a zero has gone out under both
  Arm arm_{};               // all that is known of it
  // The key of the force has changed with the versions, and the wrong one is ignored without a word.
  Form form_ = Form::kBoth;
  std::int64_t unanswered_ns_ = 0;  // since when a force shows in no state; 0: it does
  std::optional<Eigen::Vector3d> told_force_{};
  // Forces of several programs add up in the service.
  std::array<double, 2> sent_n_{};  // the largest norms sent in this window of kWindow and the one before
  std::int64_t window_ns_ = 0;
  std::int64_t more_ns_ = 0;     // since when the states show more force than was sent; 0: they do not
  std::int64_t no_more_ns_ = 0;  // since when they do not; 0: they do
  bool others_ = false;          // another program pushes too: we do not
  int let_goes_ = 0;             // times that was found
  std::string failed_;
  std::string problem_;
};

}  // namespace stylet::haptic::haply

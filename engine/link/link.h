// OpenIGTLink: 3D Slicer, PLUS and others see the running session, and trackers of theirs hold its probe and needle.
#pragma once

#include "engine/link/command_desk.h"
#include "engine/link/connection.h"
#include "engine/link/link_stylus.h"
#include "engine/link/source.h"
#include "engine/link/tcp.h"
#include "engine/session/held_probe.h"
#include "engine/state/state_buffer.h"
#include "physics/messages/latest_value.h"

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace stylet::link {

struct LinkSettings {
  std::optional<Endpoint> listen{};  ///< where clients connect to; nothing: they cannot
  std::optional<Endpoint> source{};  ///< a server that transforms are taken from as well
  double transform_hz = 50;
  double patience_s = 5;  ///< with a peer that stops in the middle of a message
  double idle_s = 30;     ///< without a word from a client, after which it makes room for a newcomer
};

/// Moved by transforms that come in; null: those are passed over.
struct LinkInputs {
  session::HeldProbe* probe = nullptr;  ///< ProbeToReference
  LinkStylus* needle = nullptr;         ///< NeedleToReference, StylusToReference
};

/// A B-mode image and where it is.
struct LinkImage {
  double time_s = 0;  ///< session time of what it shows
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels{};
  Eigen::Matrix4d reference_from_image = Eigen::Matrix4d::Identity();  ///< pixel centres (column, row, 0), mm
};

struct LinkReport {
  std::uint64_t clients = 0;  ///< that came
  std::uint64_t refused = 0;  ///< beyond Link::kMostClients at a time, none of them idle
  std::array<Connection::Counts, kTopics> counts{};
  std::uint64_t taken = 0;        ///< transforms that moved probe or needle
  std::uint64_t passed_over = 0;  ///< with other names
  std::uint64_t odd = 0;          ///< that are no rigid pose, or hold the probe inside the patient
  std::uint64_t commands = 0;     ///< of clients, that were done
  std::uint64_t not_done = 0;     ///< that were not
  std::uint64_t source_connections = 0;
  std::vector<std::string> problems{};  ///< a line for each peer that was put off, the first kMostProblems
  std::uint64_t more_problems = 0;      ///< beyond these
  static constexpr std::size_t kMostProblems = 16;
};

/// A thread of its own serves all peers: sends IMAGE (Image_Reference), TRANSFORM (ProbeToReference,
/// NeedleToReference, NeedleTipToReference) and STATUS once a second, takes transforms and commands in, answers
/// these: a COMMAND by RTS_COMMAND, a STRING to CMD_n by one of ACK_n. It meets the session in latest-value slots, so
/// that nothing a peer does can hold up a loop. The reference frame is the patient in RAS, millimetres; axes of probe
/// and needle as in engine/tracking/tracked_transforms.h. Time stamps are UTC of the session time that a message is
/// of.
class Link {
public:
  /// Keeps references to what is passed in. @throws LinkError  it cannot listen there; there is no such source
  Link(const state::StateBuffer& world, const LinkInputs& inputs, const LinkSettings& settings);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// The port clients connect to, 0: it does not listen. They are let in from start() on.
  std::uint16_t port() const;
  /// @param session_s  session time of this moment
  void start(double session_s);
  /// One thread: the newest image. Never waits.
  void show(const LinkImage& image);
  /// What clients ask for, to be done and answered by one other thread.
  CommandDesk& commands() { return desk_; }
  /// Clients there are now: without any nobody needs an image. Any thread.
  int clients() const { return client_count_.load(std::memory_order_relaxed); }
  /// Ends the thread and every connection. May be called twice.
  const LinkReport& stop();

  /// One more is refused, unless one of them is idle: who only listens is that, and keeps its place while nobody else
  /// wants it.
  static constexpr int kMostClients = 8;

private:
  void run(const std::stop_token& stop);
  void wait_for_peers();
  void let_in(Clock::time_point now);
  /// Takes the place of the client that has been silent longest, where that is long. @return false: none has
  bool make_room(Clock::time_point now);
  void remove_ended();
  void post(Clock::time_point now);
  Bulletin& post(Topic topic);
  void take_in();
  void take_in(const ReceivedTransform& transform);
  void pass_commands();
  void drop_silent_peers(Clock::time_point now);
  void add_counts(const Connection& client);
  void add_problem(std::string line);
  double utc(double session_s) const { return utc_of_start_s_ + session_s; }

  const state::StateBuffer& world_;
  LinkInputs inputs_;
  LinkSettings settings_;
  Socket listening_;
  physics::LatestValue<LinkImage> images_;
  CommandDesk desk_;
  std::atomic<int> client_count_{0};

  /// A command on the desk, its text taken out.
  struct Asked {
    std::uint64_t number = 0;
    std::string client{};  ///< its name
    ReceivedCommand command{};
  };

  // The thread's own.
  std::optional<Source> source_;
  std::vector<Connection> clients_;
  std::vector<ReceivedTransform> received_;
  std::vector<Asked> asked_;
  std::uint64_t commands_asked_ = 0;
  state::FrameState frame_;
  Board board_;
  bool image_waits_ = false;
  Clock::time_point next_transforms_{};
  Clock::time_point next_status_{};
  double utc_of_start_s_ = 0;
  LinkReport report_;
  std::jthread thread_;
};

/// What went over the link, for the end of a session; lines without a newline at the end.
std::vector<std::string> summary(const LinkReport& report);

}  // namespace stylet::link

#include "engine/link/link.h"

#include "engine/link/tracked_pose.h"
#include "engine/tracking/tracked_transforms.h"

#include <poll.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace stylet::link {
namespace {

constexpr auto kLongestWait = std::chrono::milliseconds(20);  // an image that was shown waits no longer
constexpr auto kStatusPeriod = std::chrono::seconds(1);

Clock::duration seconds(double s) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
}

/// As the client asked: by the number of its COMMAND, or to ACK_n for CMD_n.
Bytes reply_to(const ReceivedCommand& command, double utc_s, const CommandDesk::Answer& answer) {
  Bytes bytes;
  if (command.numbered) {
    append_command_reply(bytes, kStatusName, utc_s,
                         {.id = command.id, .name = command.name, .done = answer.done, .words = answer.words});
  } else {
    append_string(
        bytes, fmt::format("ACK_{}", command.device.substr(4)), utc_s,
        fmt::format("<CommandReply Status=\"{}\" Message=\"{}\" />", answer.done ? "SUCCESS" : "FAIL", answer.words));
  }
  return bytes;
}

static_assert(MessageReader::kMostCommands >= CommandDesk::kMost + Connection::kMostReplies,
              "whoever asks for one too many hears of it");

}  // namespace

Link::Link(const state::StateBuffer& world, const LinkInputs& inputs, const LinkSettings& settings)
    : world_(world), inputs_(inputs), settings_(settings), frame_(world.make_frame()) {
  if (settings.listen) listening_ = listen_on(*settings.listen);
  if (settings.source) source_.emplace(*settings.source);
}

Link::~Link() {
  stop();
}

std::uint16_t Link::port() const {
  return listening_.is_open() ? port_of(listening_) : 0;
}

void Link::start(double session_s) {
  const std::chrono::duration<double> now = std::chrono::system_clock::now().time_since_epoch();
  utc_of_start_s_ = now.count() - session_s;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

void Link::show(const LinkImage& image) {
  images_.back() = image;
  images_.publish();
}

const LinkReport& Link::stop() {
  if (thread_.joinable()) {
    thread_.request_stop();
    thread_.join();
  }
  return report_;
}

void Link::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    if (source_) source_->attend(Clock::now());
    wait_for_peers();
    const Clock::time_point now = Clock::now();
    if (listening_.is_open()) let_in(now);
    for (Connection& client : clients_) client.receive(received_, now);
    if (source_) source_->serve(received_, now);
    take_in();
    pass_commands();
    post(now);
    for (Connection& client : clients_) client.send(board_, now);
    drop_silent_peers(now);
  }
  append_status(post(Topic::status).bytes, kStatusName, utc(frame_.time_s), Status::shut_down, "the session is over");
  for (Connection& client : clients_) client.send(board_, Clock::now());
  for (const Connection& client : clients_) add_counts(client);
  clients_.clear();
  client_count_.store(0, std::memory_order_relaxed);
  if (source_) report_.source_connections = source_->connections();
}

void Link::wait_for_peers() {
  std::array<pollfd, kMostClients + 2> watched{};
  nfds_t count = 0;
  const auto watch = [&](int descriptor, bool to_write) {
    if (descriptor < 0) return;
    watched[count++] = {
        .fd = descriptor, .events = static_cast<short>(to_write ? POLLIN | POLLOUT : POLLIN), .revents = 0};
  };
  watch(listening_.descriptor(), false);
  if (source_) watch(source_->descriptor(), source_->is_connecting());
  for (const Connection& client : clients_) watch(client.descriptor(), client.is_sending());
  const auto until = std::clamp<Clock::duration>(next_transforms_ - Clock::now(), Clock::duration{}, kLongestWait);
  (void)poll(watched.data(), count, static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(until).count()));
}

void Link::let_in(Clock::time_point now) {
  while (std::optional<Accepted> peer = accept_from(listening_)) {
    if (clients_.size() == kMostClients && !make_room(now)) {
      ++report_.refused;
      continue;
    }
    ++report_.clients;
    clients_.emplace_back(std::move(peer->socket), std::move(peer->name), now);
    next_status_ = now;  // a newcomer hears at once that it is connected
  }
  client_count_.store(static_cast<int>(clients_.size()), std::memory_order_relaxed);
}

bool Link::make_room(Clock::time_point now) {
  const auto longest = std::ranges::min_element(clients_, {}, &Connection::last_received);
  if (now - longest->last_received() < seconds(settings_.idle_s)) return false;
  longest->make_room(now);
  remove_ended();
  return true;
}

Bulletin& Link::post(Topic topic) {
  Bulletin& bulletin = board_[static_cast<std::size_t>(topic)];
  ++bulletin.number;
  bulletin.bytes.clear();
  return bulletin;
}

void Link::post(Clock::time_point now) {
  image_waits_ = images_.update() || image_waits_;
  const bool transforms_due = now >= next_transforms_;
  if (transforms_due) next_transforms_ = std::max(next_transforms_ + seconds(1 / settings_.transform_hz), now);
  if (clients_.empty()) return;
  if (image_waits_) {
    image_waits_ = false;
    const LinkImage& image = images_.front();
    append_image(post(Topic::image).bytes, kImageName, utc(image.time_s),
                 {.width = image.width,
                  .height = image.height,
                  .pixels = image.pixels,
                  .reference_from_image = image.reference_from_image});
  }
  const bool known = transforms_due && world_.sample(std::numeric_limits<double>::infinity(), frame_).provenance !=
                                           state::Provenance::none;
  if (known) {
    Bytes& bytes = post(Topic::transforms).bytes;
    const double utc_s = utc(frame_.time_s);
    append_transform(bytes, kProbeName, utc_s, tracking::ras_pose(frame_.probe_position, frame_.probe_orientation));
    if (!frame_.needle_positions.empty()) {
      append_transform(bytes, kNeedleName, utc_s,
                       tracking::ras_pose(frame_.needle_positions.front(), frame_.needle_orientations.front()));
      append_transform(bytes, kNeedleTipName, utc_s,
                       tracking::ras_pose(frame_.needle_positions.back(), frame_.needle_orientations.back()));
    }
  }
  if (now >= next_status_) {
    next_status_ = now + kStatusPeriod;
    append_status(post(Topic::status).bytes, kStatusName, utc(frame_.time_s), Status::ok,
                  fmt::format("session at {:.1f} s", frame_.time_s));
  }
}

void Link::take_in() {
  for (const ReceivedTransform& transform : received_) take_in(transform);
  received_.clear();
}

void Link::take_in(const ReceivedTransform& transform) {
  const bool for_probe = inputs_.probe != nullptr && transform.name == kProbeName;
  const bool for_needle =
      inputs_.needle != nullptr && (transform.name == kNeedleName || transform.name == kStylusName);
  if (!for_probe && !for_needle) {
    ++report_.passed_over;
    return;
  }
  const std::optional<physics::RigidPose> pose = patient_pose(transform.matrix);
  if (!pose || (for_probe && !inputs_.probe->follow(*pose))) {
    ++report_.odd;
    return;
  }
  if (for_needle) inputs_.needle->follow(*pose);
  ++report_.taken;
}

void Link::pass_commands() {
  for (Connection& client : clients_) {
    for (ReceivedCommand& command : client.take_commands()) {
      desk_.hand_in({++commands_asked_, std::exchange(command.text, {})});
      asked_.push_back({commands_asked_, client.name(), std::move(command)});
    }
  }
  for (const CommandDesk::Answer& answer : desk_.take_answers()) {
    ++(answer.done ? report_.commands : report_.not_done);
    const auto asked = std::ranges::find(asked_, answer.number, &Asked::number);
    if (asked == asked_.end()) continue;  // its client has gone
    const auto client = std::ranges::find(clients_, asked->client, &Connection::name);
    if (client != clients_.end()) client->reply(reply_to(asked->command, utc(frame_.time_s), answer));
    asked_.erase(asked);
  }
}

void Link::add_counts(const Connection& client) {
  for (std::size_t t = 0; t < kTopics; ++t) {
    report_.counts[t].sent += client.counts()[t].sent;
    report_.counts[t].dropped += client.counts()[t].dropped;
  }
}

void Link::add_problem(std::string line) {
  if (report_.problems.size() < LinkReport::kMostProblems) {
    report_.problems.push_back(std::move(line));
  } else {
    ++report_.more_problems;
  }
}

void Link::drop_silent_peers(Clock::time_point now) {
  const Clock::duration patience = seconds(settings_.patience_s);
  for (Connection& client : clients_) client.expire(now, patience);
  remove_ended();
  client_count_.store(static_cast<int>(clients_.size()), std::memory_order_relaxed);
  if (!source_) return;
  if (source_->connection()) source_->connection()->expire(now, patience);
  if (std::string line = source_->take_leave(now); !line.empty()) add_problem(std::move(line));
}

void Link::remove_ended() {
  for (const Connection& client : clients_) {
    if (!client.has_ended()) continue;
    if (!client.problem().empty()) add_problem(fmt::format("client {}: {}", client.name(), client.problem()));
    add_counts(client);
    for (const Asked& asked : asked_) {
      if (asked.client == client.name()) desk_.withdraw(asked.number);
    }
    std::erase_if(asked_, [&](const Asked& asked) { return asked.client == client.name(); });
  }
  std::erase_if(clients_, [](const Connection& client) { return client.has_ended(); });
}

std::vector<std::string> summary(const LinkReport& report) {
  const auto& [status, transforms, image] = report.counts;
  std::vector<std::string> lines{
      fmt::format("OpenIGTLink: {} clients; sent {} images ({} dropped for slow clients), {} sets of transforms ({})",
                  report.clients, image.sent, image.dropped, transforms.sent, transforms.dropped),
      fmt::format("OpenIGTLink: {} poses taken in, {} with other names, {} not possible", report.taken,
                  report.passed_over, report.odd)};
  if (report.commands + report.not_done > 0) {
    lines.push_back(fmt::format("OpenIGTLink: {} commands done, {} not", report.commands, report.not_done));
  }
  if (report.source_connections > 0) {
    lines.push_back(fmt::format("OpenIGTLink: connected {} times to the source", report.source_connections));
  }
  if (report.refused > 0) {
    lines.push_back(fmt::format("OpenIGTLink: {} clients refused, there were {} that were not idle", report.refused,
                                Link::kMostClients));
  }
  for (const std::string& problem : report.problems) lines.push_back("OpenIGTLink: " + problem + "; closed");
  if (report.more_problems > 0) lines.push_back(fmt::format("OpenIGTLink: {} more like these", report.more_problems));
  return lines;
}

}  // namespace stylet::link

#include "tests/support/hid/mock_hid_node.h"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <optional>
#include <system_error>
#include <vector>

namespace stylet::support {
namespace {

constexpr std::uint64_t kRing = 63;  // usable of the 64 entries of hidraw
constexpr std::int64_t kTick = 1'000'000;

std::int64_t now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

std::int64_t to_ns(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}

int checked(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  return result;
}

}  // namespace

int MockFirmware::get_feature(std::span<std::uint8_t> /*report*/) {
  return -EINVAL;
}

/// One open() of the node.
struct MockHidNode::OpenFile {
  explicit OpenFile(int accepted) : connection(accepted) {
    std::array<int, 2> pair{};
    checked(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair.data()), "socketpair");
    stream = pair[0];
    const int counter = checked(memfd_create("taken", MFD_CLOEXEC), "memfd_create");
    checked(ftruncate(counter, sizeof(std::uint64_t)), "ftruncate");
    taken = static_cast<std::atomic<std::uint64_t>*>(
        mmap(nullptr, sizeof(std::uint64_t), PROT_READ | PROT_WRITE, MAP_SHARED, counter, 0));
    greet(0, {pair[1], counter});
    ::close(pair[1]);
    ::close(counter);
  }
  ~OpenFile() {
    ::close(stream);
    ::close(connection);
    munmap(taken, sizeof(std::uint64_t));
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  void greet(std::int32_t error, const std::array<int, 2>& files) const {
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof files)> control{};
    iovec part{&error, sizeof error};
    msghdr message{};
    message.msg_iov = &part, message.msg_iovlen = 1;
    message.msg_control = control.data(), message.msg_controllen = control.size();
    cmsghdr* head = CMSG_FIRSTHDR(&message);
    head->cmsg_level = SOL_SOCKET, head->cmsg_type = SCM_RIGHTS, head->cmsg_len = CMSG_LEN(sizeof files);
    std::memcpy(CMSG_DATA(head), files.data(), sizeof files);
    sendmsg(connection, &message, MSG_NOSIGNAL);
  }

  int connection = -1;
  int stream = -1;
  std::atomic<std::uint64_t>* taken = nullptr;
  std::uint64_t put = 0;
  std::optional<HidrawRequest> slow_write;  // not done yet
  std::int64_t write_done_ns = 0;
};

MockHidNode::MockHidNode(MockHidBus& bus, MockFirmware& firmware, const MockNodeSettings& settings)
    : bus_(bus), firmware_(firmware), settings_(settings), wake_(checked(eventfd(0, EFD_CLOEXEC), "eventfd")) {
  next_report_ns_ = now();
  listen_at(settings.number);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

MockHidNode::~MockHidNode() {
  thread_.request_stop();
  wake();
  thread_.join();
  unplug();
  ::close(wake_);
}

void MockHidNode::listen_at(int number) {
  settings_.number = number;
  bus_.plug(number, settings_.identity, firmware_.descriptor());
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  const std::string path = bus_.node(number).string();
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  listening_ = checked(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), "socket");
  checked(::bind(listening_, reinterpret_cast<const sockaddr*>(&address), sizeof address), "bind");
  checked(::listen(listening_, 16), "listen");
}

void MockHidNode::stop_listening() {
  ::close(listening_);
  listening_ = -1;
  files_.clear();
}

void MockHidNode::unplug() {
  const std::scoped_lock lock(mutex_);
  if (listening_ < 0) return;
  stop_listening();
  bus_.unplug(settings_.number);
  firmware_.power_off();
  wake();
}

void MockHidNode::plug(int number) {
  const std::scoped_lock lock(mutex_);
  next_report_ns_ = now();
  listen_at(number);
  wake();
}

void MockHidNode::refuse_open(int error) {
  const std::scoped_lock lock(mutex_);
  open_error_ = error;
}

void MockHidNode::stall(double seconds) {
  const std::scoped_lock lock(mutex_);
  next_report_ns_ = now() + to_ns(seconds);
}

void MockHidNode::set_streaming(bool on) {
  const std::scoped_lock lock(mutex_);
  settings_.streaming = on;
  next_report_ns_ = now();
  wake();
}

void MockHidNode::inject(std::span<const std::uint8_t> report) {
  const std::scoped_lock lock(mutex_);
  deliver(report);
}

void MockHidNode::delay_writes(double seconds) {
  const std::scoped_lock lock(mutex_);
  write_delay_ns_ = to_ns(seconds);
}

void MockHidNode::fail_writes(int error) {
  const std::scoped_lock lock(mutex_);
  write_error_ = error;
}

std::uint64_t MockHidNode::sent() const {
  const std::scoped_lock lock(mutex_);
  return sent_;
}

std::uint64_t MockHidNode::dropped() const {
  const std::scoped_lock lock(mutex_);
  return dropped_;
}

std::size_t MockHidNode::open_files() const {
  const std::scoped_lock lock(mutex_);
  return files_.size();
}

bool MockHidNode::wait(const std::function<bool()>& condition, double seconds) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, std::chrono::duration<double>(seconds), condition);
}

void MockHidNode::wake() const {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t n = ::write(wake_, &one, sizeof one);
}

void MockHidNode::run(const std::stop_token& stop) {
  if (settings_.fifo_priority > 0) {
    const sched_param priority{.sched_priority = settings_.fifo_priority};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  }
  std::vector<pollfd> polled;
  while (!stop.stop_requested()) {
    std::int64_t due = 0;
    {
      const std::scoped_lock lock(mutex_);
      due = serve(now());
      polled.assign(1, {.fd = wake_, .events = POLLIN, .revents = 0});
      polled.push_back({.fd = listening_, .events = POLLIN, .revents = 0});
      for (const OpenFile& file : files_) {
        polled.push_back({.fd = file.slow_write ? -1 : file.connection, .events = POLLIN, .revents = 0});
      }
    }
    changed_.notify_all();
    const std::int64_t left = std::max<std::int64_t>(0, due - now());
    const timespec wait{.tv_sec = left / 1'000'000'000, .tv_nsec = left % 1'000'000'000};
    ppoll(polled.data(), polled.size(), &wait, nullptr);
    if ((polled[0].revents & POLLIN) != 0) {
      std::uint64_t count = 0;
      [[maybe_unused]] const ssize_t n = ::read(wake_, &count, sizeof count);
    }
  }
}

std::int64_t MockHidNode::serve(std::int64_t now_ns) {
  if (listening_ < 0) return now_ns + kTick;
  accept_file();
  for (auto file = files_.begin(); file != files_.end();) {
    file = take_request(*file, now_ns) ? std::next(file) : files_.erase(file);
  }
  firmware_.tick(now_ns);
  std::int64_t due = now_ns + kTick;
  if (settings_.streaming) {
    const std::int64_t period = to_ns(1 / settings_.rate_hz);
    if (now_ns - next_report_ns_ > settings_.most_behind * period) next_report_ns_ = now_ns;
    for (; next_report_ns_ <= now_ns; next_report_ns_ += period) {
      std::array<std::uint8_t, kMostHidBytes> report;
      const std::size_t size = firmware_.input(next_report_ns_, report);
      if (size != 0) deliver(std::span(report).first(size));
    }
    due = std::min(due, next_report_ns_);
  }
  for (const OpenFile& file : files_) {
    if (file.slow_write) due = std::min(due, file.write_done_ns);
  }
  return due;
}

void MockHidNode::accept_file() {
  while (true) {
    const int connection = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) return;
    if (open_error_ != 0) {
      const std::int32_t error = open_error_;
      send(connection, &error, sizeof error, MSG_NOSIGNAL);
      ::close(connection);
    } else {
      files_.emplace_back(connection);
    }
  }
}

void MockHidNode::deliver(std::span<const std::uint8_t> report) {
  for (OpenFile& file : files_) {
    if (file.put - file.taken->load(std::memory_order_acquire) >= kRing ||
        send(file.stream, report.data(), report.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0) {
      ++dropped_;
    } else {
      ++file.put;
      ++sent_;
    }
  }
}

/// @return false: the file was closed
bool MockHidNode::take_request(OpenFile& file, std::int64_t now_ns) {
  while (true) {
    if (file.slow_write) {
      if (now_ns < file.write_done_ns) return true;
      const HidrawAnswer done = answer(*file.slow_write, now_ns);
      file.slow_write.reset();
      send(file.connection, &done, sizeof done, MSG_NOSIGNAL);
    }
    HidrawRequest request;
    const ssize_t n = recv(file.connection, &request, sizeof request, MSG_DONTWAIT);
    if (n < 0 && errno == EAGAIN) return true;
    if (n != sizeof request) return false;
    if (request.kind == HidrawRequest::kWrite && write_delay_ns_ > 0) {
      file.slow_write = request;
      file.write_done_ns = now_ns + write_delay_ns_;
      continue;
    }
    const HidrawAnswer done = answer(request, now_ns);
    send(file.connection, &done, sizeof done, MSG_NOSIGNAL);
  }
}

HidrawAnswer MockHidNode::answer(const HidrawRequest& request, std::int64_t now_ns) {
  HidrawAnswer answer;
  const std::span<const std::uint8_t> bytes = std::span(request.bytes).first(request.size);
  switch (request.kind) {
    case HidrawRequest::kDescriptor: {
      const std::vector<std::uint8_t> descriptor = firmware_.descriptor();
      answer.size = std::min<std::uint32_t>(request.room, static_cast<std::uint32_t>(descriptor.size()));
      std::copy_n(descriptor.begin(), answer.size, answer.bytes.begin());
      answer.result = static_cast<std::int32_t>(descriptor.size());
      break;
    }
    case HidrawRequest::kWrite: {
      const int error = write_error_ != 0 ? write_error_ : firmware_.output(now_ns, bytes);
      answer.result = error != 0 ? -error : static_cast<std::int32_t>(request.size);
      break;
    }
    case HidrawRequest::kSetFeature: {
      const int error = firmware_.set_feature(now_ns, bytes);
      answer.result = error != 0 ? -error : static_cast<std::int32_t>(request.size);
      break;
    }
    case HidrawRequest::kGetFeature: {
      answer.bytes[0] = bytes.empty() ? std::uint8_t{0} : bytes[0];
      const std::size_t room = std::min<std::size_t>(request.room, answer.bytes.size());
      answer.result = firmware_.get_feature(std::span(answer.bytes).first(room));
      answer.size = static_cast<std::uint32_t>(std::max(0, answer.result));
      break;
    }
  }
  return answer;
}

}  // namespace stylet::support

#include "haptic/haply/haply_transport.h"

#include "haptic/hid/force_writer.h"
#include "haptic/paced_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <utility>

namespace stylet::haptic::haply {
namespace {

constexpr double kConnect = 1;                    // s
constexpr std::int64_t kPeriod = 1'000'000;       // ns
constexpr int kFifoPriority = 78;                 // below the haptic thread's and its writer's
constexpr std::int64_t kGoodBye = 50'000'000;     // ns
constexpr std::int64_t kInventory = 600'000'000;  // ns, for what the service sends when somebody connects
constexpr std::size_t kMostWaiting = 64;   // reports that nobody reads; as many as the kernel keeps of a HID device
constexpr std::uint16_t kVendor = 0x16C0;  // USB ids of an Inverse3
constexpr std::uint16_t kProduct = 0x0483;
constexpr const char* kScheme = "haply:";

std::string model(const std::string& type) {
  if (type == "inverse3x") return "Haply Inverse3x";
  if (type == "minverse") return "Haply Minverse";
  return "Haply Inverse3";
}

Pair pair_of(const std::string& path) {
  const std::string ids = path.starts_with(kScheme) ? path.substr(6) : path;
  const std::size_t slash = ids.find('/');
  return {.arm = ids.substr(0, slash), .grip = slash == std::string::npos ? "" : ids.substr(slash + 1)};
}

std::string state_of(const Arm& arm, const Grip* grip) {
  std::string state;
  const auto add = [&state](const std::string& words) { state += (state.empty() ? "" : "; ") + words; };
  if (!arm.calibrated.value_or(true)) add("it is not calibrated: do that in the Haply Hub");
  if (!arm.power.value_or(false)) add("its motors have no power: plug in its power supply");
  if (!arm.ready.value_or(false)) add("it is not ready: see the Haply Hub");
  if (grip == nullptr) add("no VerseGrip: the needle keeps its direction");
  if (grip != nullptr && !grip->there) add("its grip sleeps: press a button of the grip");
  if (grip != nullptr && grip->battery && *grip->battery < 0.15) {
    add(fmt::format("the battery of its grip has {:.0f} %", 100 * *grip->battery));
  }
  return state.empty() ? "ready" : state;
}

}  // namespace

HaplyTransport::HaplyTransport(const Endpoint& endpoint, const Pair& pair)
    : socket_(endpoint, kConnect),
      client_(pair, MonotonicClock().now_ns()),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

HaplyTransport::~HaplyTransport() = default;

void HaplyTransport::take(std::string_view text) {
  const std::scoped_lock lock(mutex_);
  const auto report = client_.receive(text, MonotonicClock().now_ns());
  if (!report) return;
  if (reports_.size() == kMostWaiting) reports_.pop_front();
  reports_.push_back(*report);
  came_.notify_one();
}

void HaplyTransport::run(const std::stop_token& stop) {
  MonotonicClock clock;
  std::int64_t due_ns = clock.now_ns();
  bool open = true;
  bool fifo = false;
  while (open && !stop.stop_requested()) {
    {
      const std::scoped_lock lock(mutex_);
      if (client_.enabled() != fifo) {
        fifo = client_.enabled();
        hid::run_under_fifo(fifo ? kFifoPriority : 0);
      }
      std::string message = client_.next(clock.now_ns());
      if (!message.empty()) socket_.send(std::move(message));
      if (!client_.failed().empty()) break;
    }
    due_ns = std::max(due_ns + kPeriod, clock.now_ns() + kPeriod / 4);
    open = socket_.run_until(due_ns, [this](std::string_view text) { take(text); });
  }
  if (open && stop.stop_requested()) say_good_bye();
  {
    const std::scoped_lock lock(mutex_);
    gone_ = true;
    came_.notify_one();
    for (std::string word = client_.last_word(); !word.empty(); word = client_.last_word()) {
      socket_.send(std::move(word));
    }
  }
  if (!open) return;
  socket_.run_until(clock.now_ns() + kPeriod, [](std::string_view) {});
  socket_.close(static_cast<double>(kGoodBye) * 1e-9);
}

void HaplyTransport::say_good_bye() {
  MonotonicClock clock;
  const std::int64_t until_ns = clock.now_ns() + kGoodBye;
  bool open = true;
  while (open && clock.now_ns() < until_ns) {
    {
      const std::scoped_lock lock(mutex_);
      if (client_.end()) break;
      std::string message = client_.next(clock.now_ns());
      if (!message.empty()) socket_.send(std::move(message));
    }
    open = socket_.run_until(clock.now_ns() + kPeriod, [this](std::string_view text) { take(text); });
  }
}

int HaplyTransport::read(std::span<std::uint8_t> bytes, int timeout_ms) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, std::chrono::milliseconds(timeout_ms), [this] { return gone_ || !reports_.empty(); });
  if (reports_.empty()) return gone_ ? -1 : 0;
  const HaplyClient::Report report = reports_.front();
  reports_.pop_front();
  const std::size_t size = std::min(bytes.size(), report.size());
  std::copy_n(report.begin(), size, bytes.begin());
  return static_cast<int>(size);
}

bool HaplyTransport::write(std::span<const std::uint8_t> bytes) {
  const std::scoped_lock lock(mutex_);
  return !gone_ && client_.output(bytes, MonotonicClock().now_ns());
}

bool HaplyTransport::set_feature(std::span<const std::uint8_t> bytes) {
  const std::scoped_lock lock(mutex_);
  return !gone_ && client_.set_gain(bytes);
}

int HaplyTransport::get_feature(std::span<std::uint8_t> bytes) {
  const std::scoped_lock lock(mutex_);
  if (gone_ || bytes.size() < hid::kGainReportBytes || bytes[0] != hid::kGainReport) return -1;
  bytes[1] = client_.gain();
  return static_cast<int>(hid::kGainReportBytes);
}

std::string HaplyTransport::needs() const {
  const std::scoped_lock lock(mutex_);
  return client_.problem();
}

std::optional<Eigen::Vector3d> HaplyTransport::told_force() const {
  const std::scoped_lock lock(mutex_);
  return client_.told_force();
}

std::string HaplyTransport::failed() const {
  const std::scoped_lock lock(mutex_);
  return client_.failed();
}

std::vector<hid::HidDeviceSummary> HaplySource::list() const {
  std::optional<Message> found;
  try {
    HaplySocket socket(endpoint_, kConnect);
    MonotonicClock clock;
    const auto take = [&](std::string_view text) { found = parse_message(text); };
    const auto enough = [&] { return found.has_value(); };
    if (socket.run_until(clock.now_ns() + kInventory, take, enough) && !found) {
      socket.send(R"({"session":{"force_render_full_state":{}}})");
      socket.run_until(clock.now_ns() + kInventory, take, enough);
    }
    socket.close(0.05);
  } catch (const hid::HidError&) {
    return {};
  }
  if (!found) return {};
  std::vector<hid::HidDeviceSummary> devices;
  const auto add = [&](const Arm& arm, const Grip* grip) {
    devices.push_back({.path = kScheme + arm.id + (grip != nullptr ? "/" + grip->id : ""),
                       .vendor_id = kVendor,
                       .product_id = kProduct,
                       .manufacturer = "Haply",
                       .product = model(arm.type),
                       .serial_number = arm.id + (grip != nullptr ? "-" + grip->id : ""),
                       .state = state_of(arm, grip)});
  };
  for (const Arm& arm : found->arms) {
    for (const Grip& grip : found->grips) add(arm, &grip);
    if (found->grips.empty()) add(arm, nullptr);
  }
  std::ranges::sort(devices, {}, &hid::HidDeviceSummary::path);
  return devices;
}

std::string HaplySource::complaint() const {
  try {
    HaplySocket(endpoint_, kConnect).close(0.05);
    return knows_none();
  } catch (const hid::HidError&) {
    return {};
  }
}

std::string HaplySource::missing() const {
  try {
    HaplySocket(endpoint_, kConnect).close(0.05);
    return knows_none();
  } catch (const hid::HidError& error) {
    return error.what();
  }
}

std::string HaplySource::knows_none() const {
  return fmt::format(
      "{}:{}: the Haply Inverse Service knows no Inverse3; plug it in, and update the service if that does not help",
      endpoint_.host, endpoint_.port);
}

std::vector<std::uint8_t> HaplySource::descriptor(const std::string& /*path*/) const {
  return hid::adapted_descriptor(kMostForce);
}

std::unique_ptr<hid::ReportTransport> HaplySource::open(const std::string& path) const {
  return std::make_unique<HaplyTransport>(endpoint_, pair_of(path));
}

const HaplySource& haply_source() {
  static const HaplySource source([] {
    Endpoint endpoint;
    const char* asked = std::getenv("STYLET_HAPLY");  // NOLINT(concurrency-mt-unsafe): nobody sets it
    if (asked == nullptr || *asked == '\0') return endpoint;
    const std::string place = asked;
    const std::size_t colon = place.rfind(':');
    endpoint.host = place.substr(0, colon);
    if (colon != std::string::npos) endpoint.port = place.substr(colon + 1);
    return endpoint;
  }());
  return source;
}

}  // namespace stylet::haptic::haply

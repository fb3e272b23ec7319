#include "tests/kernel/device_port.h"
#include "tests/kernel/file_descriptor.h"

#include <linux/input.h>
#include <linux/uhid.h>
#include <poll.h>

#include <algorithm>
#include <cstring>
#include <stop_token>
#include <thread>

namespace stylet::kernel_test {
namespace {

constexpr int kPollMs = 20;  ///< how often a thread looks whether it shall stop

template <std::size_t N>
void put_text(std::uint8_t (&to)[N], const std::string& text) {
  std::copy_n(text.begin(), std::min(text.size(), N - 1), to);
}

class UhidPort final : public DevicePort {
public:
  UhidPort(DeviceIdentity identity, ReportDescriptor descriptor, HostRequests& requests)
      : identity_(std::move(identity)),
        descriptor_(std::move(descriptor)),
        requests_(requests),
        file_("/dev/uhid", O_RDWR),
        thread_([this](const std::stop_token& stop) { serve(stop); }) {}

  void plug() override {
    uhid_event event{};
    event.type = UHID_CREATE2;
    uhid_create2_req& create = event.u.create2;
    put_text(create.name, identity_.name);
    put_text(create.uniq, identity_.serial);
    create.bus = BUS_USB;
    create.vendor = identity_.vendor;
    create.product = identity_.product;
    create.rd_size = static_cast<std::uint16_t>(descriptor_.size());
    std::copy(descriptor_.begin(), descriptor_.end(), create.rd_data);
    put(event);
  }

  void unplug() override {
    uhid_event event{};
    event.type = UHID_DESTROY;
    put(event);
  }

  bool send(std::span<const std::uint8_t> report) override {
    uhid_event event{};
    event.type = UHID_INPUT2;
    event.u.input2.size = static_cast<std::uint16_t>(report.size());
    std::copy(report.begin(), report.end(), event.u.input2.data);
    const std::size_t bytes = offsetof(uhid_event, u.input2.data) + report.size();
    return ::write(file_.get(), &event, bytes) == static_cast<ssize_t>(bytes);
  }

private:
  void put(const uhid_event& event) const {
    file_.write({reinterpret_cast<const std::uint8_t*>(&event), sizeof event});
  }

  void serve(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      pollfd wait{.fd = file_.get(), .events = POLLIN, .revents = 0};
      uhid_event event{};
      if (::poll(&wait, 1, kPollMs) == 1 && ::read(file_.get(), &event, sizeof event) > 0) {
        answer(event);
      }
    }
  }

  /// The kernel waits seconds for each answer that does not come.
  void answer(const uhid_event& event) {
    uhid_event reply{};
    if (event.type == UHID_OUTPUT) {
      requests_.output({event.u.output.data, event.u.output.size});
      return;
    }
    if (event.type == UHID_GET_REPORT) {
      const std::vector<std::uint8_t> report = requests_.get_feature(event.u.get_report.rnum);
      reply.type = UHID_GET_REPORT_REPLY;
      reply.u.get_report_reply.id = event.u.get_report.id;
      reply.u.get_report_reply.err = report.empty() ? EIO : 0;
      reply.u.get_report_reply.size = static_cast<std::uint16_t>(report.size());
      std::copy(report.begin(), report.end(), reply.u.get_report_reply.data);
    } else if (event.type == UHID_SET_REPORT) {
      const bool taken = requests_.set_feature({event.u.set_report.data, event.u.set_report.size});
      reply.type = UHID_SET_REPORT_REPLY;
      reply.u.set_report_reply.id = event.u.set_report.id;
      reply.u.set_report_reply.err = taken ? 0 : EIO;
    } else {
      return;
    }
    put(reply);
  }

  DeviceIdentity identity_;
  ReportDescriptor descriptor_;
  HostRequests& requests_;
  FileDescriptor file_;
  std::jthread thread_;
};

}  // namespace

std::unique_ptr<DevicePort> make_uhid_port(const DeviceIdentity& identity, const ReportDescriptor& descriptor,
                                           HostRequests& requests) {
  return std::make_unique<UhidPort>(identity, descriptor, requests);
}

}  // namespace stylet::kernel_test

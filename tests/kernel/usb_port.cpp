#include "tests/kernel/device_port.h"
#include "tests/kernel/file_descriptor.h"

#include <linux/hid.h>
#include <linux/usb/ch9.h>
#include <linux/usb/functionfs.h>
#include <poll.h>
#include <sys/mount.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <stop_token>
#include <thread>

namespace stylet::kernel_test {
namespace {

const std::filesystem::path kGadget = "/sys/kernel/config/usb_gadget/stylet";
const std::filesystem::path kFunction = "/dev/stylet_function";
constexpr const char* kController = "dummy_udc.0";
constexpr int kSetupPollMs = 20;  ///< how often a thread looks whether it shall stop
constexpr std::uint16_t kPacketBytes = 64;
constexpr std::uint8_t kReportDescriptorType = 0x22;  // HID 1.11, 7.1
constexpr std::uint8_t kFeatureReport = 3;            // HID 1.11, 7.2.1

/// HID 1.11, 6.2.1.
struct HidDescriptor {
  std::uint8_t length = 9;
  std::uint8_t type = HID_DT_HID;
  std::uint16_t version = 0x0111;
  std::uint8_t country = 0;
  std::uint8_t count = 1;
  std::uint8_t report_type = kReportDescriptorType;
  std::uint16_t report_length = 0;
} __attribute__((packed));

/// One speed: an interface with an interrupt endpoint each way.
struct Function {
  usb_interface_descriptor interface {
    .bLength = USB_DT_INTERFACE_SIZE, .bDescriptorType = USB_DT_INTERFACE, .bInterfaceNumber = 0,
    .bAlternateSetting = 0, .bNumEndpoints = 2, .bInterfaceClass = USB_CLASS_HID, .bInterfaceSubClass = 0,
    .bInterfaceProtocol = 0, .iInterface = 0
  };
  HidDescriptor hid{};
  usb_endpoint_descriptor_no_audio in{};
  usb_endpoint_descriptor_no_audio out{};
} __attribute__((packed));

struct FunctionDescriptors {
  usb_functionfs_descs_head_v2 head{.magic = FUNCTIONFS_DESCRIPTORS_MAGIC_V2,
                                    .length = sizeof(FunctionDescriptors),
                                    .flags = FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC};
  std::uint32_t full_speed_count = 4;
  std::uint32_t high_speed_count = 4;
  Function full_speed{};
  Function high_speed{};
} __attribute__((packed));

/// @param interval  of the endpoints: 1 ms, in ms at full speed and as a power of two of 125 us at high speed
Function function(std::size_t report_descriptor_bytes, std::uint8_t interval) {
  const auto endpoint = [interval](std::uint8_t address) {
    return usb_endpoint_descriptor_no_audio{.bLength = sizeof(usb_endpoint_descriptor_no_audio),
                                            .bDescriptorType = USB_DT_ENDPOINT,
                                            .bEndpointAddress = address,
                                            .bmAttributes = USB_ENDPOINT_XFER_INT,
                                            .wMaxPacketSize = kPacketBytes,
                                            .bInterval = interval};
  };
  Function function;
  function.hid.report_length = static_cast<std::uint16_t>(report_descriptor_bytes);
  function.in = endpoint(USB_DIR_IN | 1);
  function.out = endpoint(USB_DIR_OUT | 2);
  return function;
}

template <class T>
std::span<const std::uint8_t> bytes_of(const T& value) {
  return {reinterpret_cast<const std::uint8_t*>(&value), sizeof value};
}

void put_text(const std::filesystem::path& path, const std::string& text) {
  FileDescriptor(path.string(), O_WRONLY).write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// The gadget in configfs and the mounted FunctionFS; removes both.
class Gadget {
public:
  explicit Gadget(const DeviceIdentity& identity) {
    std::filesystem::create_directory(kGadget);
    put_text(kGadget / "idVendor", std::to_string(identity.vendor));
    put_text(kGadget / "idProduct", std::to_string(identity.product));
    std::filesystem::create_directory(kGadget / "strings/0x409");
    put_text(kGadget / "strings/0x409/manufacturer", identity.manufacturer);
    put_text(kGadget / "strings/0x409/product", identity.name);
    put_text(kGadget / "strings/0x409/serialnumber", identity.serial);
    std::filesystem::create_directory(kGadget / "configs/c.1");
    std::filesystem::create_directory(kGadget / "functions/ffs.stylet");
    std::filesystem::create_directory_symlink(kGadget / "functions/ffs.stylet", kGadget / "configs/c.1/ffs.stylet");
    std::filesystem::create_directories(kFunction);
    if (::mount("stylet", kFunction.c_str(), "functionfs", 0, nullptr) != 0) {
      throw std::system_error(errno, std::generic_category(), "mount " + kFunction.string());
    }
  }
  ~Gadget() {
    ::umount(kFunction.c_str());
    std::error_code ignored;
    for (const char* entry : {"configs/c.1/ffs.stylet", "functions/ffs.stylet", "configs/c.1", "strings/0x409", ""}) {
      std::filesystem::remove(kGadget / entry, ignored);
    }
  }
  Gadget(const Gadget&) = delete;
  Gadget& operator=(const Gadget&) = delete;
};

/// Endpoint 0 with the descriptors written, after which the other endpoints' files exist.
class ControlEndpoint : public FileDescriptor {
public:
  explicit ControlEndpoint(std::size_t report_descriptor_bytes)
      : FileDescriptor((kFunction / "ep0").string(), O_RDWR) {
    FunctionDescriptors descriptors;
    descriptors.full_speed = function(report_descriptor_bytes, 1);
    descriptors.high_speed = function(report_descriptor_bytes, 4);
    write(bytes_of(descriptors));
    write(bytes_of(usb_functionfs_strings_head{.magic = FUNCTIONFS_STRINGS_MAGIC,
                                               .length = sizeof(usb_functionfs_strings_head),
                                               .str_count = 0,
                                               .lang_count = 0}));
  }
};

class UsbPort final : public DevicePort {
public:
  UsbPort(DeviceIdentity identity, ReportDescriptor descriptor, HostRequests& requests)
      : identity_(std::move(identity)),
        descriptor_(std::move(descriptor)),
        requests_(requests),
        gadget_(identity_),
        control_(descriptor_.size()),
        in_((kFunction / "ep1").string(), O_RDWR | O_NONBLOCK),
        out_((kFunction / "ep2").string(), O_RDWR | O_NONBLOCK),
        control_thread_([this](const std::stop_token& stop) { serve_control(stop); }),
        out_thread_([this](const std::stop_token& stop) { serve_output(stop); }) {}

  void plug() override { put_text(kGadget / "UDC", kController); }
  void unplug() override { put_text(kGadget / "UDC", "\n"); }

  /// O_NONBLOCK makes only the wait for a host end at once; a transfer that has begun is waited for.
  bool send(std::span<const std::uint8_t> report) override {
    return ::write(in_.get(), report.data(), report.size()) == static_cast<ssize_t>(report.size());
  }

private:
  void serve_output(const std::stop_token& stop) {
    std::array<std::uint8_t, kPacketBytes> report{};
    while (!stop.stop_requested()) {
      const ssize_t size = ::read(out_.get(), report.data(), report.size());
      if (size > 0) {
        requests_.output(std::span(report).first(size));
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
  }

  void serve_control(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      pollfd wait{.fd = control_.get(), .events = POLLIN, .revents = 0};
      usb_functionfs_event event{};
      if (::poll(&wait, 1, kSetupPollMs) == 1 && ::read(control_.get(), &event, sizeof event) == sizeof event &&
          event.type == FUNCTIONFS_SETUP) {
        answer(event.u.setup);
      }
    }
  }

  void answer(const usb_ctrlrequest& setup) {
    const auto type = static_cast<std::uint8_t>(setup.wValue >> 8);
    const auto id = static_cast<std::uint8_t>(setup.wValue & 0xFF);
    switch (setup.bRequestType << 8 | setup.bRequest) {
      case (USB_DIR_IN | USB_TYPE_STANDARD | USB_RECIP_INTERFACE) << 8 | USB_REQ_GET_DESCRIPTOR:
        if (type == kReportDescriptorType) {
          return reply(setup, descriptor_);
        }
        break;
      case (USB_DIR_IN | USB_TYPE_CLASS | USB_RECIP_INTERFACE) << 8 | 0x01:  // GET_REPORT
        if (type == kFeatureReport) {
          if (const auto report = requests_.get_feature(id); !report.empty()) {
            return reply(setup, report);
          }
        }
        break;
      case (USB_DIR_OUT | USB_TYPE_CLASS | USB_RECIP_INTERFACE) << 8 | 0x09: {  // SET_REPORT
        std::array<std::uint8_t, 4096> report{};
        const ssize_t size =
            ::read(control_.get(), report.data(), std::min<std::size_t>(setup.wLength, report.size()));
        if (size > 0) {
          requests_.set_feature(std::span(report).first(size));
        }
        return;
      }
      case (USB_DIR_OUT | USB_TYPE_CLASS | USB_RECIP_INTERFACE) << 8 | 0x0A:  // SET_IDLE
        static_cast<void>(!::read(control_.get(), nullptr, 0));
        return;
      default:
        break;
    }
    stall(setup);
  }

  void reply(const usb_ctrlrequest& setup, std::span<const std::uint8_t> bytes) const {
    static_cast<void>(!::write(control_.get(), bytes.data(), std::min<std::size_t>(setup.wLength, bytes.size())));
  }

  /// FunctionFS: a transfer the wrong way.
  void stall(const usb_ctrlrequest& setup) const {
    if ((setup.bRequestType & USB_DIR_IN) != 0) {
      static_cast<void>(!::read(control_.get(), nullptr, 0));
    } else {
      static_cast<void>(!::write(control_.get(), nullptr, 0));
    }
  }

  DeviceIdentity identity_;
  ReportDescriptor descriptor_;
  HostRequests& requests_;
  Gadget gadget_;
  ControlEndpoint control_;
  FileDescriptor in_;   ///< to the host
  FileDescriptor out_;  ///< from the host
  std::jthread control_thread_;
  std::jthread out_thread_;
};

}  // namespace

std::unique_ptr<DevicePort> make_usb_port(const DeviceIdentity& identity, const ReportDescriptor& descriptor,
                                          HostRequests& requests) {
  return std::make_unique<UsbPort>(identity, descriptor, requests);
}

}  // namespace stylet::kernel_test

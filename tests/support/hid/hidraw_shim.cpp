// A library for LD_PRELOAD, or first in an executable's list of libraries: open, access, read, write, ioctl and close
// of /dev/hidraw* go to a mocked node (mock_hid_node.h) as they would go to the kernel's hidraw driver.
//
// Where UMOCKDEV_DIR names a mocked bus, opening /dev/hidrawN connects to the socket UMOCKDEV_DIR/dev/hidrawN. The
// node answers with an error, or with the stream of input reports (a SOCK_SEQPACKET socket, so that reports keep
// their boundaries and poll() is the real one) and a counter of what was read. Everything else is asked over the
// connection itself, one message there and one back, as these calls wait for the device in the kernel too.
#include "tests/support/hid/hidraw_wire.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/hidraw.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string_view>

namespace {

using namespace stylet::support;

struct OpenNode {
  std::mutex in_use;  // a request and its answer belong together
  int connection = -1;
  std::atomic<std::uint64_t>* taken = nullptr;
};
constexpr int kMostFiles = 4096;
std::array<std::atomic<OpenNode*>, kMostFiles> nodes;

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

OpenNode* node_of(int file) {
  return file >= 0 && file < kMostFiles ? nodes[file].load(std::memory_order_acquire) : nullptr;
}

int failed(int error) {
  errno = error;
  return -1;
}

/// One request to the node. @return bytes of the answer in `out`, or -1 and errno
long ask(OpenNode& node, HidrawRequest::Kind kind, const void* bytes, std::size_t size, void* out, std::size_t room) {
  HidrawRequest request{.kind = kind, .room = static_cast<std::uint32_t>(room), .size = 0, .bytes = {}};
  request.size = static_cast<std::uint32_t>(std::min(size, request.bytes.size()));
  if (size != 0) std::memcpy(request.bytes.data(), bytes, request.size);
  HidrawAnswer answer;
  const std::scoped_lock lock(node.in_use);
  if (send(node.connection, &request, sizeof request, MSG_NOSIGNAL) < 0) return failed(ENODEV);
  if (recv(node.connection, &answer, sizeof answer, 0) != sizeof answer) return failed(ENODEV);
  if (answer.result < 0) return failed(-answer.result);
  if (out != nullptr) std::memcpy(out, answer.bytes.data(), std::min<std::size_t>(room, answer.size));
  return answer.result;
}

int connect_to(const char* bus, const char* path) {
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  std::snprintf(address.sun_path, sizeof address.sun_path, "%s%s", bus, path);
  const int connection = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  // umockdev has a connect() of its own.
  static const auto libc_connect = reinterpret_cast<decltype(&connect)>(dlsym(RTLD_NEXT, "connect"));
  if (libc_connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return connection;
  const int error = errno;
  close(connection);
  return failed(error == ECONNREFUSED ? ENODEV : error);
}

int open_node(const char* bus, const char* path, int flags) {
  const int connection = connect_to(bus, path);
  if (connection < 0) return -1;
  std::int32_t error = 0;
  std::array<int, 2> files{-1, -1};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof files)> control{};
  iovec part{&error, sizeof error};
  msghdr message{};
  message.msg_iov = &part, message.msg_iovlen = 1;
  message.msg_control = control.data(), message.msg_controllen = control.size();
  if (recvmsg(connection, &message, MSG_CMSG_CLOEXEC) != sizeof error) error = ENODEV;
  if (const cmsghdr* head = CMSG_FIRSTHDR(&message); error == 0 && head != nullptr) {
    std::memcpy(files.data(), CMSG_DATA(head), sizeof files);
  }
  if (error != 0 || files[0] < 0 || files[0] >= kMostFiles) {
    close(connection);
    return failed(error != 0 ? error : EMFILE);
  }
  void* counter = mmap(nullptr, sizeof(std::uint64_t), PROT_READ | PROT_WRITE, MAP_SHARED, files[1], 0);
  close(files[1]);
  auto* node = new OpenNode;
  node->connection = connection;
  node->taken = static_cast<std::atomic<std::uint64_t>*>(counter);
  if ((flags & O_NONBLOCK) != 0) fcntl(files[0], F_SETFL, O_NONBLOCK);
  nodes[files[0]].store(node, std::memory_order_release);
  return files[0];
}

int open_any(const char* name, const char* path, int flags, mode_t mode) {
  const char* bus = std::getenv("UMOCKDEV_DIR");
  if (bus != nullptr && std::string_view(path).starts_with("/dev/hidraw")) return open_node(bus, path, flags);
  return next<int (*)(const char*, int, ...)>(name)(path, flags, mode);
}

mode_t mode_argument(int flags, va_list list) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(list, mode_t) : 0;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = mode_argument(flags, list);
  va_end(list);
  return open_any("open", path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = mode_argument(flags, list);
  va_end(list);
  return open_any("open64", path, flags, mode);
}

/// By opening it, which a mocked device may refuse.
int access(const char* path, int mode) {
  const char* bus = std::getenv("UMOCKDEV_DIR");
  if (bus == nullptr || !std::string_view(path).starts_with("/dev/hidraw")) {
    return next<int (*)(const char*, int)>("access")(path, mode);
  }
  const int file = open_node(bus, path, O_RDWR);
  return file < 0 ? -1 : close(file);
}

ssize_t read(int file, void* buffer, size_t size) {
  static const auto libc_read = next<decltype(&read)>("read");
  const ssize_t n = libc_read(file, buffer, size);
  OpenNode* node = node_of(file);
  if (node == nullptr) return n;
  if (n > 0) {
    node->taken->fetch_add(1, std::memory_order_release);
    return n;
  }
  return n == 0 || errno == ECONNRESET ? failed(EIO) : n;  // the device has gone
}

ssize_t write(int file, const void* bytes, size_t size) {
  OpenNode* node = node_of(file);
  if (node == nullptr) {
    static const auto libc_write = next<decltype(&write)>("write");
    return libc_write(file, bytes, size);
  }
  return ask(*node, HidrawRequest::kWrite, bytes, size, nullptr, 0);
}

int ioctl(int file, unsigned long request, ...) {
  va_list list;
  va_start(list, request);
  void* argument = va_arg(list, void*);
  va_end(list);
  OpenNode* node = node_of(file);
  if (node == nullptr) {
    static const auto libc_ioctl = next<decltype(&ioctl)>("ioctl");
    return libc_ioctl(file, request, argument);
  }
  if (_IOC_TYPE(request) != 'H') return failed(ENOTTY);
  const std::size_t size = _IOC_SIZE(request);
  switch (_IOC_NR(request)) {
    case _IOC_NR(HIDIOCGRDESCSIZE): {
      const long length = ask(*node, HidrawRequest::kDescriptor, nullptr, 0, nullptr, 0);
      if (length >= 0) *static_cast<int*>(argument) = static_cast<int>(length);
      return length < 0 ? -1 : 0;
    }
    case _IOC_NR(HIDIOCGRDESC): {
      auto* descriptor = static_cast<hidraw_report_descriptor*>(argument);
      return ask(*node, HidrawRequest::kDescriptor, nullptr, 0, descriptor->value, descriptor->size) < 0 ? -1 : 0;
    }
    case _IOC_NR(HIDIOCSFEATURE(0)):
      return static_cast<int>(ask(*node, HidrawRequest::kSetFeature, argument, size, nullptr, 0));
    case _IOC_NR(HIDIOCGFEATURE(0)):
      return static_cast<int>(ask(*node, HidrawRequest::kGetFeature, argument, 1, argument, size));
    default:
      return failed(EINVAL);
  }
}

int close(int file) {
  static const auto libc_close = next<decltype(&close)>("close");
  if (file >= 0 && file < kMostFiles) {
    if (OpenNode* node = nodes[file].exchange(nullptr)) {
      ::close(node->connection);  // by its name: a sanitizer has to see it
      munmap(node->taken, sizeof(std::uint64_t));
      delete node;
    }
  }
  return libc_close(file);
}

}  // extern "C"

#include "engine/link/tcp.h"

#include "engine/link/link_error.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <system_error>

namespace stylet::link {
namespace {

// What a slow client lags behind: three images. Less than a segment of loopback, 64 KiB, would be sent haltingly.
constexpr int kSendBuffer = 512 * 1024;

struct FreeAddresses {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

Addresses look_up(const Endpoint& endpoint, int flags) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags | AI_NUMERICSERV;
  addrinfo* list = nullptr;
  const int result = getaddrinfo(endpoint.host.c_str(), std::to_string(endpoint.port).c_str(), &hints, &list);
  if (result != 0) {
    throw LinkError(fmt::format("OpenIGTLink: {}: {}; give a name or address of this network", to_string(endpoint),
                                gai_strerror(result)));
  }
  return Addresses(list);
}

std::string error_text(int number) {
  return std::generic_category().message(number);
}

void set(int descriptor, int level, int option, int value) {
  (void)setsockopt(descriptor, level, option, &value, sizeof value);  // what is refused is worth no failure
}

/// An end that died without a word is noticed after half a minute of silence.
void watch_for_death(int descriptor) {
  set(descriptor, SOL_SOCKET, SO_KEEPALIVE, 1);
  set(descriptor, IPPROTO_TCP, TCP_KEEPIDLE, 10);
  set(descriptor, IPPROTO_TCP, TCP_KEEPINTVL, 5);
  set(descriptor, IPPROTO_TCP, TCP_KEEPCNT, 4);
  set(descriptor, IPPROTO_TCP, TCP_NODELAY, 1);
}

}  // namespace

Endpoint parse_endpoint(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  Endpoint endpoint;
  if (colon != std::string::npos && colon > 0) {
    endpoint.host = text.substr(0, colon);
    if (endpoint.host.front() == '[' && endpoint.host.back() == ']' && endpoint.host.size() > 2) {
      endpoint.host = endpoint.host.substr(1, endpoint.host.size() - 2);
    }
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, endpoint.port);
    if (error == std::errc{} && rest == end && endpoint.port != 0) return endpoint;
  }
  throw LinkError(fmt::format("OpenIGTLink: {}: is not HOST:PORT; write such as localhost:18944", text));
}

std::string to_string(const Endpoint& endpoint) {
  const bool v6 = endpoint.host.find(':') != std::string::npos;
  return fmt::format("{}{}{}:{}", v6 ? "[" : "", endpoint.host, v6 ? "]" : "", endpoint.port);
}

Socket::~Socket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Socket::Transfer Socket::send(std::span<const std::uint8_t> bytes) {
  const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent >= 0) return {.bytes = static_cast<std::size_t>(sent)};
  if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return {};
  if (errno == EPIPE || errno == ECONNRESET) return {.ended = true};
  return {.ended = true, .problem = error_text(errno)};
}

Socket::Transfer Socket::receive(std::span<std::uint8_t> room) {
  const ssize_t got = ::recv(descriptor_, room.data(), room.size(), MSG_DONTWAIT);
  if (got > 0) return {.bytes = static_cast<std::size_t>(got)};
  if (got == 0) return {.ended = true};
  if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return {};
  if (errno == ECONNRESET) return {.ended = true};
  return {.ended = true, .problem = error_text(errno)};
}

Socket listen_on(const Endpoint& endpoint) {
  const Addresses addresses = look_up(endpoint, AI_PASSIVE);
  int failure = EADDRNOTAVAIL;
  for (const addrinfo* a = addresses.get(); a != nullptr; a = a->ai_next) {
    Socket socket(::socket(a->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol));
    if (!socket.is_open()) {
      failure = errno;
      continue;
    }
    set(socket.descriptor(), SOL_SOCKET, SO_REUSEADDR, 1);
    if (::bind(socket.descriptor(), a->ai_addr, a->ai_addrlen) == 0 && ::listen(socket.descriptor(), 8) == 0) {
      return socket;
    }
    failure = errno;
  }
  throw LinkError(fmt::format(
      "OpenIGTLink: cannot listen on {}: {}; {}", to_string(endpoint), error_text(failure),
      failure == EADDRINUSE ? "another program has the port: give another one" : "give an address of this machine"));
}

std::uint16_t port_of(const Socket& socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getsockname(socket.descriptor(), reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  // The port lies at the same place in both families.
  sockaddr_in in{};
  std::memcpy(&in, &address, sizeof in);
  return ntohs(in.sin_port);
}

std::optional<Accepted> accept_from(const Socket& listening) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  Socket socket(
      ::accept4(listening.descriptor(), reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!socket.is_open()) return {};
  watch_for_death(socket.descriptor());
  set(socket.descriptor(), SOL_SOCKET, SO_SNDBUF, kSendBuffer);
  std::array<char, NI_MAXHOST> host{};
  std::array<char, NI_MAXSERV> port{};
  (void)getnameinfo(reinterpret_cast<sockaddr*>(&address), size, host.data(), host.size(), port.data(), port.size(),
                    NI_NUMERICHOST | NI_NUMERICSERV);
  return Accepted{.socket = std::move(socket), .name = fmt::format("{}:{}", host.data(), port.data())};
}

Remote::Remote(const Endpoint& endpoint) {
  const Addresses addresses = look_up(endpoint, 0);
  for (const addrinfo* a = addresses.get(); a != nullptr; a = a->ai_next) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(a->ai_addr);
    addresses_.push_back({.family = a->ai_family, .bytes = {bytes, bytes + a->ai_addrlen}});
  }
}

Socket Remote::begin_connecting() const {
  const Address& address = addresses_[next_++ % addresses_.size()];
  Socket socket(::socket(address.family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket.is_open()) return socket;
  watch_for_death(socket.descriptor());
  const int result = ::connect(socket.descriptor(), reinterpret_cast<const sockaddr*>(address.bytes.data()),
                               static_cast<socklen_t>(address.bytes.size()));
  if (result != 0 && errno != EINPROGRESS) return {};
  return socket;
}

bool Remote::connected(const Socket& socket) {
  int error = 0;
  socklen_t size = sizeof error;
  return getsockopt(socket.descriptor(), SOL_SOCKET, SO_ERROR, &error, &size) == 0 && error == 0;
}

}  // namespace stylet::link

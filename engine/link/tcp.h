// TCP as the link needs it: nothing blocks, no SIGPIPE, and a server listens where it is told to. The sockets of the
// OpenIGTLink library do none of the three: its server takes every interface, its sends wait.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace stylet::link {

struct Endpoint {
  std::string host = "127.0.0.1";  ///< name or address, IPv4 or IPv6
  std::uint16_t port = 18944;      ///< of OpenIGTLink; 0 where one listens: any free one
};

/// "HOST:PORT", "[IPV6]:PORT". @throws LinkError
Endpoint parse_endpoint(const std::string& text);
std::string to_string(const Endpoint& endpoint);

/// Owns a descriptor; never blocks.
class Socket {
public:
  Socket() = default;
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  ~Socket();

  bool is_open() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }

  /// How a transfer ended: so many bytes, none now, or never again.
  struct Transfer {
    std::size_t bytes = 0;
    bool ended = false;     ///< the other side is gone
    std::string problem{};  ///< why, where it did not leave in order
  };
  Transfer send(std::span<const std::uint8_t> bytes);
  Transfer receive(std::span<std::uint8_t> room);

private:
  int descriptor_ = -1;
};

/// @throws LinkError  the address is not ours or the port is taken
Socket listen_on(const Endpoint& endpoint);
std::uint16_t port_of(const Socket& socket);

struct Accepted {
  Socket socket;
  std::string name;  ///< "127.0.0.1:43210"
};
/// The next one that waits to be let in, if there is one.
std::optional<Accepted> accept_from(const Socket& listening);

/// A server elsewhere. Its name is looked up once, at the start: a name server may take seconds to answer.
class Remote {
public:
  /// @throws LinkError  there is no such host
  explicit Remote(const Endpoint& endpoint);
  /// Begins to connect: once the socket can be written, connected() tells how it went.
  Socket begin_connecting() const;
  static bool connected(const Socket& socket);

private:
  struct Address {
    int family = 0;
    std::vector<std::uint8_t> bytes;  ///< a sockaddr
  };
  std::vector<Address> addresses_;
  mutable std::size_t next_ = 0;  ///< they are tried in turn
};

}  // namespace stylet::link

#include "tests/support/haply/haply_server.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>

#include <poll.h>

#include <optional>
#include <thread>
#include <vector>

namespace stylet::support {

namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using Error = boost::system::error_code;

struct HaplyServer::Io {
  asio::io_context context{1};
  tcp::acceptor acceptor{context, {asio::ip::make_address("127.0.0.1"), 0}};
};

struct HaplyServer::Client {
  explicit Client(asio::io_context& context) : socket(context) {}
  tcp::socket socket;
};

namespace {

/// Whether something can be read within so many ms.
bool readable(int socket, int ms) {
  pollfd wait{.fd = socket, .events = POLLIN, .revents = 0};
  return poll(&wait, 1, ms) > 0;
}

}  // namespace

HaplyServer::HaplyServer() : io_(std::make_unique<Io>()) {
  port_ = std::to_string(io_->acceptor.local_endpoint().port());
  thread_ = std::thread([this] { run(); });
}

HaplyServer::~HaplyServer() {
  stop_ = true;
  thread_.join();
}

void HaplyServer::run() {
  std::vector<std::jthread> clients;  // as the service, which has several
  while (!stop_) {
    if (!readable(io_->acceptor.native_handle(), 5)) continue;
    auto client = std::make_shared<Client>(io_->context);
    Error error;
    io_->acceptor.accept(client->socket, error);
    if (!error) clients.emplace_back([this, client] { serve(*client); });
  }
}

void HaplyServer::serve(Client& client) {
  Error error;
  tcp::socket& socket = client.socket;
  Trouble refuse = Trouble::kRefuse;
  if (trouble_.compare_exchange_strong(refuse, Trouble::kNone)) {
    asio::write(socket, asio::buffer(std::string("HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\n\r\n")),
                error);
    return;
  }
  socket.set_option(tcp::no_delay(true), error);
  websocket::stream<tcp::socket> stream(std::move(socket));
  stream.accept(error);
  if (error) return;
  ++connections_;
  const auto say = [&](const std::string& text) {
    stream.text(true);
    stream.write(asio::buffer(text), error);
    return !error;
  };
  Trouble silent = Trouble::kNoInventory;
  if (!trouble_.compare_exchange_strong(silent, Trouble::kNone)) {
    if (!say(with_service([](HaplyService& s) { return s.inventory(now_ns()); }))) return;
  }
  const auto end = [&] { with_service([](HaplyService& s) { s.disconnect(); }); };
  boost::beast::flat_buffer in;
  while (!stop_) {
    if (!readable(stream.next_layer().native_handle(), 5)) continue;
    in.clear();
    stream.read(in, error);
    if (error) break;
    while (trouble_ == Trouble::kStall && !stop_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const auto bytes = in.cdata();
    const std::string answer = with_service([&](HaplyService& s) {
      return s.answer({static_cast<const char*>(bytes.data()), bytes.size()}, now_ns());
    });
    Trouble trouble = trouble_;
    if (trouble == Trouble::kNoInventory || trouble == Trouble::kRefuse || trouble == Trouble::kStall)
      trouble = Trouble::kNone;
    else if (trouble != Trouble::kNone)
      trouble_ = Trouble::kNone;
    switch (trouble) {
      case Trouble::kReset:
        stream.next_layer().set_option(asio::socket_base::linger(true, 0), error);
        stream.next_layer().close(error);
        end();
        return;
      case Trouble::kClose:
        stream.close(websocket::close_code::going_away, error);
        end();
        return;
      case Trouble::kGarbage:
        say("[nonsense");
        break;
      case Trouble::kBinary:
        stream.binary(true);
        stream.write(asio::buffer(answer), error);
        break;
      case Trouble::kHuge:
        say(std::string(1u << 20, ' '));
        break;
      case Trouble::kBadUtf8:
        say("{\"\xFF\xFE\":1}");
        break;
      case Trouble::kTwice:
        say(answer);
        say(answer);
        break;
      case Trouble::kMany:
        for (int k = 0; k < 20 && !error; ++k) say(answer);
        break;
      case Trouble::kFragments:
        stream.text(true);
        stream.write_some(false, asio::buffer(answer.data(), 7), error);
        stream.write_some(true, asio::buffer(answer.data() + 7, answer.size() - 7), error);
        break;
      case Trouble::kPings:
        for (int k = 0; k < 500 && !error; ++k) stream.ping("x", error);
        say(answer);
        break;
      default:
        say(answer);
    }
    if (error) break;
  }
  end();
}

}  // namespace stylet::support

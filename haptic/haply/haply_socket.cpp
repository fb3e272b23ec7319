#include "haptic/haply/haply_socket.h"

#include "haptic/hid/report_transport.h"

#include <fmt/format.h>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>

#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <string>
#include <utility>

namespace stylet::haptic::haply {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;
using Error = boost::system::error_code;
using Clock = std::chrono::steady_clock;  // CLOCK_MONOTONIC

namespace {

constexpr std::size_t kMostMessage = 64u << 10;

}  // namespace

struct HaplySocket::Io {
  asio::io_context context{1};
  beast::websocket::stream<tcp::socket> stream{context};
  asio::steady_timer timer{context};
  beast::flat_buffer in{kMostMessage};
  std::deque<std::string> out{};
  bool writing = false;
  bool open = false;
  std::function<void(std::string_view)> on_message{};

  /// @return false: it is then and not done
  bool run_until(Clock::time_point until, const std::function<bool()>& done) {
    bool late = false;
    timer.expires_at(until);
    timer.async_wait([&late](Error error) { late = !error; });
    while (!late && !done()) {
      context.restart();
      if (context.run_one() == 0) break;
    }
    if (!late) {  // its handler knows `late`
      timer.cancel();
      bool gone = false;
      asio::post(context, [&gone] { gone = true; });
      while (!gone) {
        context.restart();
        if (context.run_one() == 0) break;
      }
    }
    return done();
  }

  void read() {
    stream.async_read(in, [this](Error error, std::size_t) {
      if (error) {
        open = false;
        return;
      }
      const auto bytes = in.cdata();
      const std::string_view text(static_cast<const char*>(bytes.data()), bytes.size());
      if (on_message) on_message(stream.got_text() ? text : std::string_view{});
      in.consume(in.size());
      read();
    });
  }

  void write() {
    if (writing || out.empty() || !open) return;
    writing = true;
    stream.async_write(asio::buffer(out.front()), [this](Error error, std::size_t) {
      writing = false;
      out.pop_front();
      if (error) open = false;
      write();
    });
  }
};

HaplySocket::HaplySocket(const Endpoint& endpoint, double seconds) : io_(std::make_unique<Io>()) {
  const std::string place = endpoint.host + ":" + endpoint.port;
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  const auto refuse = [&](const std::string& why) -> hid::HidError {
    return hid::HidError(
        fmt::format("{}: the Haply Inverse Service does not answer there ({}); install and start it, or "
                    "say where it is, STYLET_HAPLY=HOST:PORT",
                    place, why));
  };
  Error failed;
  const auto wait = [&](bool& done) {
    if (!io_->run_until(until, [&done] { return done; })) {
      Error ignored;
      io_->stream.next_layer().close(ignored);
      while (!done) {
        io_->context.restart();
        if (io_->context.run_one() == 0) break;
      }
      throw refuse("no answer in time");
    }
    if (failed) throw refuse(failed.message());
  };
  Error error;
  const auto places = tcp::resolver(io_->context).resolve(endpoint.host, endpoint.port, error);
  if (error) throw refuse(error.message());
  bool connected = false;
  asio::async_connect(io_->stream.next_layer(), places, [&](Error result, const tcp::endpoint&) {
    failed = result;
    connected = true;
  });
  wait(connected);
  io_->stream.next_layer().set_option(tcp::no_delay(true), error);
  io_->stream.read_message_max(kMostMessage);
  io_->stream.auto_fragment(false);
  io_->stream.text(true);
  bool shaken = false;
  io_->stream.async_handshake(place, "/", [&](Error result) {
    failed = result;
    shaken = true;
  });
  wait(shaken);
  io_->open = true;
  io_->read();
}

HaplySocket::~HaplySocket() {
  Error ignored;
  io_->stream.next_layer().close(ignored);
  io_->on_message = {};
  io_->context.restart();
  io_->context.poll();
}

void HaplySocket::send(std::string text) {
  io_->out.push_back(std::move(text));
}

bool HaplySocket::run_until(std::int64_t until_ns, const std::function<void(std::string_view)>& on_message,
                            const std::function<bool()>& enough) {
  bool stop = false;
  io_->on_message = [&](std::string_view text) {
    on_message(text);
    stop = enough && enough();
  };
  io_->write();
  io_->run_until(Clock::time_point(std::chrono::nanoseconds(until_ns)), [&] { return stop || !io_->open; });
  io_->on_message = {};
  return io_->open;
}

void HaplySocket::close(double seconds) {
  if (!io_->open) return;
  bool closed = false;
  io_->stream.async_close(beast::websocket::close_code::normal, [&closed](Error) { closed = true; });
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  if (io_->run_until(until, [&closed] { return closed; })) return;
  Error ignored;
  io_->stream.next_layer().close(ignored);
  while (!closed) {
    io_->context.restart();
    if (io_->context.run_one() == 0) break;
  }
}

}  // namespace stylet::haptic::haply

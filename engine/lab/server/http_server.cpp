#include "engine/lab/server/http_server.h"

#include "engine/files/error.h"
#include "engine/files/json_scan.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <memory>
#include <string_view>
#include <utility>

namespace stylet::lab::server {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using Error = boost::system::error_code;

namespace {

constexpr std::uint32_t kMostHeader = 8192;
constexpr std::uint64_t kMostBody = 65'536;
constexpr int kMostConnections = 64;

std::string decoded(std::string_view text) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  };
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? digit(text[i + 1]) : -1;
    const int low = high >= 0 ? digit(text[i + 2]) : -1;
    if (low >= 0) {
      plain += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      plain += text[i] == '+' ? ' ' : text[i];
    }
  }
  return plain;
}

std::map<std::string, std::string> cookies_of(std::string_view header) {
  std::map<std::string, std::string> cookies;
  while (!header.empty()) {
    const std::size_t end = std::min(header.find(';'), header.size());
    std::string_view pair = header.substr(0, end);
    header.remove_prefix(std::min(end + 1, header.size()));
    while (pair.starts_with(' ')) pair.remove_prefix(1);
    const std::size_t equals = pair.find('=');
    if (equals != std::string_view::npos) cookies[std::string(pair.substr(0, equals))] = pair.substr(equals + 1);
  }
  return cookies;
}

Request request_of(const http::request<http::string_body>& message) {
  const std::string target(message.target());
  const std::size_t question = target.find('?');
  Request request{.method = std::string(message.method_string()), .path = target.substr(0, question)};
  if (question != std::string::npos) request.query = decoded_form(target.substr(question + 1));
  request.host = std::string(message[http::field::host]);
  request.origin = std::string(message[http::field::origin]);
  request.cookies = cookies_of(std::string(message[http::field::cookie]));
  if (message[http::field::content_type].starts_with("application/x-www-form-urlencoded")) {
    request.form = decoded_form(message.body());
  }
  return request;
}

/// One connection: reads a request, writes its answer, and is gone.
class Connection : public std::enable_shared_from_this<Connection> {
public:
  Connection(tcp::socket socket, const std::function<Response(const Request&)>& answer, int timeout_s, int& open)
      : stream_(std::move(socket)), answer_(answer), timeout_(timeout_s), open_(open) {
    ++open_;
    parser_.header_limit(kMostHeader);
    parser_.body_limit(kMostBody);
  }
  ~Connection() { --open_; }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void start() {
    stream_.expires_after(timeout_);
    http::async_read(stream_, buffer_, parser_,
                     [self = shared_from_this()](const Error& error, std::size_t) { self->read(error); });
  }

private:
  void read(const Error& error) {
    if (error == http::error::body_limit) return write({.status = 413});
    if (error == http::error::header_limit) return write({.status = 431});
    if (error.category() == http::make_error_code(http::error::bad_target).category() &&
        error != http::error::end_of_stream && error != http::error::partial_message) {
      return write({.status = 400});
    }
    if (error) return;  // gone, or too slow
    try {
      write(answer_(request_of(parser_.get())));
    } catch (const std::exception&) {
      write({.status = 500, .body = "The lab's records cannot be read just now."});
    }
  }

  void write(const Response& response) {
    message_.result(static_cast<unsigned>(response.status));
    message_.version(11);
    message_.set(http::field::content_type, "text/html; charset=utf-8");
    for (const auto& [name, value] : response.headers) message_.insert(name, value);
    message_.body() = response.body;
    message_.keep_alive(false);
    message_.prepare_payload();
    stream_.expires_after(timeout_);
    http::async_write(stream_, message_, [self = shared_from_this()](const Error&, std::size_t) {
      Error ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMostHeader + kMostBody};
  http::request_parser<http::string_body> parser_;
  http::response<http::string_body> message_;
  const std::function<Response(const Request&)>& answer_;
  std::chrono::seconds timeout_;
  int& open_;
};

}  // namespace

struct HttpServer::Io {
  std::function<Response(const Request&)> answer;
  int timeout_s;
  int open = 0;  // connections
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::steady_timer later{context};

  void accept() {
    acceptor.async_accept([this](const Error& error, tcp::socket socket) {
      if (!acceptor.is_open()) return;
      if (!error && open < kMostConnections) {
        std::make_shared<Connection>(std::move(socket), answer, timeout_s, open)->start();
      }
      if (!error) return accept();
      later.expires_after(std::chrono::milliseconds(100));  // no more files to open: others end
      later.async_wait([this](const Error& cancelled) {
        if (!cancelled) accept();
      });
    });
  }
};

std::map<std::string, std::string> decoded_form(const std::string& text) {
  std::map<std::string, std::string> form;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view pair = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const std::size_t equals = std::min(pair.find('='), pair.size());
    form[decoded(pair.substr(0, equals))] = decoded(pair.substr(std::min(equals + 1, pair.size())));
  }
  return form;
}

HttpServer::HttpServer(const ServerSettings& settings, std::function<Response(const Request&)> answer)
    : io_(new Io{.answer = std::move(answer), .timeout_s = settings.timeout_s}) {
  Error error;
  const auto address = asio::ip::make_address(settings.address, error);
  if (error) {
    throw files::ContentError(
        fmt::format("{}: is no address of this computer; 127.0.0.1 is for its own browser alone",
                    files::printable(settings.address)));
  }
  const tcp::endpoint endpoint(address, settings.port);
  io_->acceptor.open(endpoint.protocol(), error);
  if (!error) io_->acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) io_->acceptor.bind(endpoint, error);
  if (!error) io_->acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    throw files::ContentError(fmt::format("{}:{}: cannot be listened at ({}); --port names another, 0 any free one",
                                          settings.address, settings.port, error.message()));
  }
}

HttpServer::~HttpServer() = default;

std::string HttpServer::host() const {
  const tcp::endpoint at = io_->acceptor.local_endpoint();
  return at.address().is_v6() ? fmt::format("[{}]:{}", at.address().to_string(), at.port())
                              : fmt::format("{}:{}", at.address().to_string(), at.port());
}

void HttpServer::run(const std::function<bool()>& stop) {
  io_->accept();
  while (!stop()) {
    io_->context.restart();
    io_->context.run_for(std::chrono::milliseconds(100));
  }
}

}  // namespace stylet::lab::server

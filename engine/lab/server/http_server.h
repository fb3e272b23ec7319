// A small web server for people of a lab: whole requests in, whole answers out. Boost.Beast reads and writes HTTP; no
// file is ever served, so no path leads to one.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace stylet::lab::server {

struct Request {
  std::string method{};
  std::string path{};                          ///< as it was sent, up to "?"
  std::map<std::string, std::string> query{};  ///< decoded; of two of one name the last
  std::map<std::string, std::string> form{};   ///< of a body in application/x-www-form-urlencoded, decoded
  std::string host{};
  std::string origin{};  ///< empty: none was said
  std::map<std::string, std::string> cookies{};
};

struct Response {
  int status = 200;
  std::string body{};  ///< HTML
  std::vector<std::pair<std::string, std::string>> headers{};
};

struct ServerSettings {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8480;  ///< 0: a free one
  int timeout_s = 10;         ///< for a whole request, and for its answer to be taken
};

/// "a=1&b=%20+": decoded; what is no encoding stays as it is.
std::map<std::string, std::string> decoded_form(const std::string& text);

/// Requests up to 8 kB of header and 64 kB of body; others are answered by itself.
class HttpServer {
public:
  /// @throws files::ContentError  the address is none, or in use
  HttpServer(const ServerSettings& settings, std::function<Response(const Request&)> answer);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// "127.0.0.1:8480", as it is in Host.
  std::string host() const;
  /// Answers, one request at a time, until asked to stop (looked at several times a second). Connections wait beside
  /// each other: who sends slowly keeps nobody waiting.
  void run(const std::function<bool()>& stop);

private:
  struct Io;
  std::unique_ptr<Io> io_;
};

}  // namespace stylet::lab::server

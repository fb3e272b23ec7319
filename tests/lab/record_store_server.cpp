#include "tests/lab/record_store_server.h"

#include "tests/lab/xapi_rules.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>

#include <sodium.h>

#include <fmt/format.h>

#include <set>

namespace stylet::lab::test {

namespace http = boost::beast::http;
using boost::asio::ip::tcp;
using Error = boost::system::error_code;

namespace {

std::string basic(const std::string& key) {
  std::string text(sodium_base64_ENCODED_LEN(key.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(text.data(), text.size(), reinterpret_cast<const unsigned char*>(key.data()), key.size(),
                    sodium_base64_VARIANT_ORIGINAL);
  return "Basic " + std::string(text.c_str());
}

}  // namespace

struct RecordStoreServer::Io {
  boost::asio::io_context context{};
  tcp::acceptor acceptor{context, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0)};
};

struct RecordStoreServer::Peer {
  tcp::socket socket;
};

RecordStoreServer::RecordStoreServer() : io_(std::make_unique<Io>()), thread_([this] { serve(); }) {}

RecordStoreServer::~RecordStoreServer() {
  over_ = true;
  Error ignored;
  tcp::socket wake(io_->context);
  wake.connect(io_->acceptor.local_endpoint(), ignored);
  thread_.join();
}

std::string RecordStoreServer::endpoint() const {
  return fmt::format("http://127.0.0.1:{}/xapi", io_->acceptor.local_endpoint().port());
}

std::map<std::string, nlohmann::json> RecordStoreServer::statements() const {
  const std::lock_guard lock(mutex_);
  return statements_;
}

void RecordStoreServer::put(const nlohmann::json& statement) {
  const std::lock_guard lock(mutex_);
  statements_[statement["id"]] = statement;
}

std::vector<std::string> RecordStoreServer::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

RecordStoreServer::Reply RecordStoreServer::take(const std::string& body) {
  const std::lock_guard lock(mutex_);
  const auto refuse = [&](const std::string& why) {
    refused_.push_back(why);
    return Reply{.status = 400, .body = why};
  };
  const auto batch = nlohmann::json::parse(body, nullptr, false);
  if (!batch.is_array() || batch.empty()) return refuse("no list of statements");
  if (mood_ == Mood::small && batch.size() > 1) return {.status = 413};
  std::set<std::string> ids;
  for (const nlohmann::json& statement : batch) {
    for (const std::string& problem : problems_of(statement)) return refuse(problem);
    if (!ids.insert(statement["id"]).second) return refuse("two statements of one id");
  }
  for (const nlohmann::json& statement : batch) {
    const auto known = statements_.find(statement["id"]);
    if (known != statements_.end() && (mood_ == Mood::stubborn || known->second != statement)) {
      return {.status = 409, .body = "there is one of this id"};
    }
  }
  for (const nlohmann::json& statement : batch) statements_.emplace(statement["id"], statement);
  return {.status = 200, .body = nlohmann::json(ids).dump()};
}

void RecordStoreServer::serve() {
  while (true) {
    Error error;
    Peer peer{tcp::socket(io_->context)};
    io_->acceptor.accept(peer.socket, error);
    if (over_) return;
    if (error) continue;
    if (mood_ == Mood::gone) {
      peer.socket.set_option(boost::asio::socket_base::linger(true, 0), error);  // reset
      continue;
    }
    answer(peer);
  }
}

void RecordStoreServer::answer(Peer& peer) {
  Error error;
  boost::beast::flat_buffer buffer;
  http::request_parser<http::string_body> parser;
  parser.body_limit(4u << 20);
  http::read(peer.socket, buffer, parser, error);
  const Mood mood = mood_;
  if (error || mood == Mood::gone) return;
  const auto& request = parser.get();
  ++requests_;
  Reply reply{.status = 404};
  const std::string target(request.target());
  const std::string one = "/xapi/statements?statementId=";
  if (mood == Mood::babbling) {
    reply = {.status = 200, .body = "<!DOCTYPE html><p>Under maintenance"};
  } else if (mood == Mood::busy) {
    reply = {.status = 503, .body = "busy"};
  } else if (mood == Mood::moved) {
    reply = {.status = 302};
  } else if (mood != Mood::stranger && target == "/xapi/about") {
    reply = {.status = 200, .body = nlohmann::json({{"version", {"0.95", version_}}}).dump()};
  } else if (mood == Mood::stranger || request[http::field::authorization] != basic(kKey)) {
    reply = {.status = 401, .body = "who are you?"};
  } else if (request["X-Experience-API-Version"] != version_) {
    reply = {.status = 400, .body = "no version of xAPI"};
  } else if (request.method() == http::verb::post && target == "/xapi/statements") {
    reply = take(request.body());
  } else if (request.method() == http::verb::get && target.starts_with(one)) {
    reply = give(target.substr(one.size()));
  }
  if (mood == Mood::answer_lost) return;
  http::response<http::string_body> response(static_cast<http::status>(reply.status), request.version());
  if (reply.status == 503) response.set(http::field::retry_after, "7");
  if (reply.status == 302) response.set(http::field::location, "http://127.0.0.1:9/elsewhere");
  response.body() = reply.body;
  response.keep_alive(false);
  response.prepare_payload();
  http::write(peer.socket, response, error);
  peer.socket.shutdown(tcp::socket::shutdown_both, error);
}

RecordStoreServer::Reply RecordStoreServer::give(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = statements_.find(id);
  if (found == statements_.end()) return {.status = 404};
  // As a store gives it back: with what it adds itself.
  nlohmann::json kept = found->second;
  kept["stored"] = "2026-03-02T09:20:00.000Z";
  kept["version"] = "2.0.0";
  kept["authority"] = {{"mbox", "mailto:lab@example.org"}};
  return {.status = 200, .body = kept.dump()};
}

}  // namespace stylet::lab::test

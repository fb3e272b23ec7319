// The web server of a lab by itself: what it makes of requests, good and bad, and who it lets in.
#include "engine/files/error.h"
#include "engine/lab/server/http_server.h"
#include "engine/lab/server/logins.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <thread>

namespace stylet::lab::server {
namespace {

using boost::asio::ip::tcp;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

/// A connection to the server.
class Client {
public:
  explicit Client(const std::string& host) {
    const std::size_t colon = host.rfind(':');
    tcp::resolver resolver(context_);
    boost::asio::connect(socket_, resolver.resolve(host.substr(0, colon), host.substr(colon + 1)));
  }
  void send(const std::string& text) {
    boost::system::error_code ignored;  // it may have been cut off already
    boost::asio::write(socket_, boost::asio::buffer(text), ignored);
  }
  std::string rest() {
    std::string text;
    boost::system::error_code ignored;
    boost::asio::read(socket_, boost::asio::dynamic_buffer(text), ignored);
    return text;
  }

private:
  boost::asio::io_context context_;
  tcp::socket socket_{context_};
};

class Served : public ::testing::Test {
protected:
  ~Served() override {
    over_ = true;
    thread_.join();
  }
  std::string ask(const std::string& text) const {
    Client client(server_.host());
    client.send(text);
    return client.rest();
  }

  std::atomic<bool> over_ = false;
  Request last_{};
  HttpServer server_{{.port = 0}, [this](const Request& request) {
                       last_ = request;
                       if (request.path == "/fails") throw files::ContentError("a secret path");
                       return Response{.body = "hello", .headers = {{"X-Answer", "yes"}}};
                     }};
  std::thread thread_{[this] { server_.run([this] { return over_.load(); }); }};
};

TEST_F(Served, ARequestComesWholeAndDecoded) {
  const std::string body = "name=Ada+L&password=%22%3c%zz%4&empty=&=x&token";
  const std::string answer =
      ask("POST /a%2e%2e/b?x=1&y=%C3%A4&x=2 HTTP/1.1\r\nHost: here:1\r\nOrigin: http://here:1\r\nCookie: a=1; "
          "stylet=abc;b\r\n"
          "Content-Type: application/x-www-form-urlencoded; charset=utf-8\r\nContent-Length: " +
          std::to_string(body.size()) + "\r\n\r\n" + body);
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer, HasSubstr("X-Answer: yes"));
  EXPECT_THAT(answer, HasSubstr("\r\n\r\nhello"));
  EXPECT_EQ(last_.method, "POST");
  EXPECT_EQ(last_.path, "/a%2e%2e/b") << "as it was sent: a table of pages has no such one";
  EXPECT_EQ(last_.query, (std::map<std::string, std::string>{{"x", "2"}, {"y", "ä"}}));
  EXPECT_EQ(last_.form.at("name"), "Ada L");
  EXPECT_EQ(last_.form.at("password"), "\"<%zz%4");
  EXPECT_EQ(last_.form.at("token"), "");
  EXPECT_EQ(last_.host, "here:1");
  EXPECT_EQ(last_.origin, "http://here:1");
  EXPECT_EQ(last_.cookies, (std::map<std::string, std::string>{{"a", "1"}, {"stylet", "abc"}}));
}

TEST_F(Served, WhatIsNoRequestOrTooMuchIsRefused) {
  EXPECT_THAT(ask("nonsense\r\n\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(ask("GET / HTTP/9.9\r\n\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(ask("GET / HTTP/1.1\r\nA: " + std::string(20'000, 'a') + "\r\n\r\n"), StartsWith("HTTP/1.1 431"));
  EXPECT_THAT(ask("POST / HTTP/1.1\r\nContent-Length: 1000000000\r\n\r\n"), StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(ask("POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_EQ(last_.method, "") << "nobody was asked";
  const std::string failed = ask("GET /fails HTTP/1.1\r\n\r\n");
  EXPECT_THAT(failed, StartsWith("HTTP/1.1 500"));
  EXPECT_THAT(failed, Not(HasSubstr("secret")));
}

TEST_F(Served, WhoSendsSlowlyKeepsNobodyWaiting) {
  Client slow(server_.host());
  slow.send("GET / HT");
  for (int i = 0; i < 20; ++i) EXPECT_THAT(ask("GET / HTTP/1.1\r\nHost: a\r\n\r\n"), StartsWith("HTTP/1.1 200"));
  slow.send("TP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_THAT(slow.rest(), StartsWith("HTTP/1.1 200"));
}

TEST_F(Served, ItIsOfThisComputerAloneAndTellsWhereItIs) {
  EXPECT_THAT(server_.host(), StartsWith("127.0.0.1:"));
  const auto port = static_cast<std::uint16_t>(std::stoi(server_.host().substr(10)));
  const auto refusal = [](const ServerSettings& settings) -> std::string {
    try {
      HttpServer({settings}, [](const Request&) { return Response{}; });
    } catch (const files::ContentError& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  EXPECT_THAT(refusal({.port = port}), HasSubstr("cannot be listened at"));
  EXPECT_THAT(refusal({.address = "lab.example"}), HasSubstr("is no address of this computer"));
}

class LoggedIn : public ::testing::Test {
protected:
  std::int64_t now_ms_ = 1'790'000'000'000;
  std::map<std::string, std::string> hashes_{{"ines", password_hash("right horse")}};
  Logins logins_{[this](const std::string& name) -> std::optional<std::string> {
                   const auto found = hashes_.find(name);
                   if (found == hashes_.end()) return std::nullopt;
                   return found->second;
                 },
                 [this] { return now_ms_; }};
};

TEST_F(LoggedIn, PasswordsAreKeptAsArgon2id) {
  EXPECT_THAT(hashes_["ines"], StartsWith("$argon2id$"));
  EXPECT_NE(hashes_["ines"], password_hash("right horse")) << "its salt is its own";
  EXPECT_TRUE(is_password(hashes_["ines"], "right horse"));
  EXPECT_FALSE(is_password(hashes_["ines"], "right horsf"));
  EXPECT_FALSE(is_password("", ""));
  EXPECT_FALSE(is_password(std::string(1000, '$'), ""));
}

TEST_F(LoggedIn, ASessionHasItsOwnSecretsAndEnds) {
  EXPECT_FALSE(logins_.log_in("ines", "wrong").cookie);
  EXPECT_FALSE(logins_.log_in("nobody", "right horse").cookie);
  EXPECT_FALSE(logins_.log_in("nobody", "").cookie);
  const std::string first = logins_.log_in("ines", "right horse").cookie.value_or("");
  const std::string second = logins_.log_in("ines", "right horse").cookie.value_or("");
  EXPECT_EQ(first.size(), 64u) << "256 bits";
  EXPECT_NE(first, second);
  const Session* session = logins_.session(first);
  ASSERT_NE(session, nullptr);
  EXPECT_EQ(session->instructor, "ines");
  EXPECT_NE(session->token, logins_.session(second)->token);
  EXPECT_NE(session->token, first);
  EXPECT_EQ(logins_.session(""), nullptr);
  EXPECT_EQ(logins_.session(first.substr(1) + "0"), nullptr);
  logins_.log_out(first);
  EXPECT_EQ(logins_.session(first), nullptr);
  EXPECT_NE(logins_.session(second), nullptr);
  now_ms_ += Logins::kLongestMs;
  EXPECT_EQ(logins_.session(second), nullptr);
}

TEST_F(LoggedIn, WhoGuessesWaitsAlsoWithTheRightOne) {
  for (int i = 0; i < Logins::kTries; ++i) EXPECT_EQ(logins_.log_in("ines", "guess").wait_ms, 0);
  const auto braked = logins_.log_in("ines", "right horse");
  EXPECT_FALSE(braked.cookie);
  EXPECT_EQ(braked.wait_ms, Logins::kPauseMs);
  EXPECT_EQ(logins_.log_in("other", "guess").wait_ms, 0) << "others are not kept out";
  now_ms_ += Logins::kPauseMs - 1;
  EXPECT_EQ(logins_.log_in("ines", "right horse").wait_ms, 1);
  now_ms_ += 1;
  EXPECT_TRUE(logins_.log_in("ines", "right horse").cookie);
}

TEST_F(LoggedIn, OtherNamesDoNotTakeTheBrakeOffAndLongOnesAreNobodys) {
  for (int i = 0; i < Logins::kTries; ++i) logins_.log_in("ines", "guess");
  EXPECT_FALSE(logins_.log_in(std::string(60'000, 'n'), "guess").cookie);
  // As many as are looked at: then nobody is, and nobody's name is kept.
  for (int i = 0; i < 20'000; ++i) logins_.log_in(std::to_string(i), "guess");
  EXPECT_EQ(logins_.log_in("ines", "right horse").wait_ms, Logins::kPauseMs);
}

TEST(Secret, IsComparedAsAWhole) {
  EXPECT_TRUE(same_secret("abc", "abc"));
  EXPECT_FALSE(same_secret("abc", "abd"));
  EXPECT_FALSE(same_secret("abc", "ab"));
  EXPECT_FALSE(same_secret("", "")) << "no token is no token";
}

}  // namespace
}  // namespace stylet::lab::server

// A record store on a socket of its own: strict about every statement, and with what a network and a store do.
#pragma once

#include <nlohmann/json.hpp>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace stylet::lab::test {

/// The statements resource of xAPI 2.0; one connection at a time, a thread of its own.
class RecordStoreServer {
public:
  enum class Mood {
    there,
    gone,         ///< connections are cut before anything is read
    answer_lost,  ///< it takes the statements, and the connection is cut before the answer
    busy,         ///< 503, come back in 7 s
    stranger,     ///< 401
    moved,        ///< 302
    small,        ///< 413 for more than one statement
    babbling,     ///< 200 and a page, whatever is asked
    stubborn,     ///< 409 for every statement that it has, also the same
  };

  RecordStoreServer();
  ~RecordStoreServer();
  RecordStoreServer(const RecordStoreServer&) = delete;
  RecordStoreServer& operator=(const RecordStoreServer&) = delete;

  std::string endpoint() const;
  static constexpr const char* kKey = "lab:secret of the tests";

  void set(Mood mood) { mood_ = mood; }
  /// The one version of xAPI that it takes and tells of; before it is asked anything.
  void speak(const std::string& version) { version_ = version; }
  /// What it has, by id.
  std::map<std::string, nlohmann::json> statements() const;
  void put(const nlohmann::json& statement);
  /// What it refused, with why.
  std::vector<std::string> refused() const;
  int requests() const { return requests_; }

private:
  struct Io;
  struct Reply {
    int status = 200;
    std::string body{};
  };
  struct Peer;
  void serve();
  void answer(Peer& peer);
  Reply take(const std::string& body);
  Reply give(const std::string& id) const;

  std::unique_ptr<Io> io_;
  std::string version_ = "2.0.0";
  std::atomic<Mood> mood_ = Mood::there;
  std::atomic<bool> over_ = false;
  std::atomic<int> requests_ = 0;
  mutable std::mutex mutex_;
  std::map<std::string, nlohmann::json> statements_;
  std::vector<std::string> refused_;
  std::thread thread_;
};

}  // namespace stylet::lab::test

// Who of the instructors is logged in: sessions by a cookie, tokens against forged forms, a brake for guessers.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

namespace stylet::lab::server {

/// argon2id by libsodium: its salt and cost are in it.
std::string password_hash(const std::string& password);
bool is_password(const std::string& hash, const std::string& password);

struct Session {
  std::string instructor{};
  std::string token{};  ///< that every form must bring back
  std::int64_t until_ms = 0;
};

/// In memory: with the server everybody is logged out. One thread.
class Logins {
public:
  static constexpr int kTries = 5;
  static constexpr std::int64_t kPauseMs = 30'000;
  static constexpr std::int64_t kLongestMs = 8 * 3'600'000;

  /// @param hash_of  of an instructor by name; nothing: nobody
  Logins(std::function<std::optional<std::string>(const std::string&)> hash_of, std::function<std::int64_t()> clock);

  struct Try {
    std::optional<std::string> cookie{};  ///< of a new session; nothing: not let in
    std::int64_t wait_ms = 0;             ///< above 0: nothing was looked at, too many were wrong
  };
  /// A name that is nobody's costs as much time as a wrong password. After five that were wrong, of one name or a
  /// hundred of any, the next is looked at half a minute later.
  Try log_in(const std::string& instructor, const std::string& password);
  void log_out(const std::string& cookie);
  /// Null: no such session, or its eight hours are over.
  const Session* session(const std::string& cookie);

private:
  struct Wrong {
    int times = 0;
    std::int64_t until_ms = 0;
  };
  std::int64_t pause_of(const Wrong& wrong) const;
  void count(Wrong& wrong, int most);

  std::function<std::optional<std::string>(const std::string&)> hash_of_;
  std::function<std::int64_t()> clock_;
  std::string nobodys_hash_;
  std::map<std::string, Session> sessions_;  ///< by the hash of their cookie
  std::map<std::string, Wrong> wrong_;       ///< by name
  Wrong of_any_;
};

/// Of equal length takes as long wherever they differ.
bool same_secret(const std::string& a, const std::string& b);

}  // namespace stylet::lab::server

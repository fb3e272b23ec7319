#include "engine/lab/server/logins.h"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <utility>

namespace stylet::lab::server {

namespace {

constexpr std::size_t kSecret = 32;         // bytes
constexpr std::size_t kMostNames = 10'000;  // remembered of those that were wrong
constexpr std::size_t kLongestName = 200;   // bytes
constexpr int kTriesOfAny = 100;

std::string hex(const unsigned char* bytes, std::size_t size) {
  std::string text(2 * size + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), bytes, size);
  text.pop_back();
  return text;
}

std::string new_secret() {
  std::array<unsigned char, kSecret> bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  return hex(bytes.data(), bytes.size());
}

std::string hash_of_cookie(const std::string& cookie) {
  std::array<unsigned char, crypto_generichash_BYTES> hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(cookie.data()), cookie.size(),
                     nullptr, 0);
  return hex(hash.data(), hash.size());
}

}  // namespace

std::string password_hash(const std::string& password) {
  if (sodium_init() < 0) std::abort();
  std::array<char, crypto_pwhash_STRBYTES> hash{};
  if (crypto_pwhash_str(hash.data(), password.data(), password.size(), crypto_pwhash_OPSLIMIT_INTERACTIVE,
                        crypto_pwhash_MEMLIMIT_INTERACTIVE) != 0) {
    throw std::bad_alloc();
  }
  return hash.data();
}

bool is_password(const std::string& hash, const std::string& password) {
  if (sodium_init() < 0) std::abort();
  return hash.size() < crypto_pwhash_STRBYTES &&
         crypto_pwhash_str_verify(hash.c_str(), password.data(), password.size()) == 0;
}

bool same_secret(const std::string& a, const std::string& b) {
  return a.size() == b.size() && !a.empty() && sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

Logins::Logins(std::function<std::optional<std::string>(const std::string&)> hash_of,
               std::function<std::int64_t()> clock)
    : hash_of_(std::move(hash_of)), clock_(std::move(clock)), nobodys_hash_(password_hash(new_secret())) {}

std::int64_t Logins::pause_of(const Wrong& wrong) const {
  return std::max<std::int64_t>(0, wrong.until_ms - clock_());
}

void Logins::count(Wrong& wrong, int most) {
  if (++wrong.times < most) return;
  wrong.times = 0;
  wrong.until_ms = clock_() + kPauseMs;
}

Logins::Try Logins::log_in(const std::string& instructor, const std::string& password) {
  const auto known = wrong_.find(instructor);
  const std::int64_t of_name = known != wrong_.end() ? pause_of(known->second) : 0;
  if (const std::int64_t wait = std::max(of_name, pause_of(of_any_)); wait > 0) return {.wait_ms = wait};
  const bool possible = instructor.size() <= kLongestName;
  const std::optional<std::string> hash = possible ? hash_of_(instructor) : std::nullopt;
  const bool right = is_password(hash.value_or(nobodys_hash_), password);
  if (!hash || !right) {
    if (wrong_.size() > kMostNames)
      std::erase_if(wrong_, [&](const auto& each) { return pause_of(each.second) == 0; });
    if (possible) count(wrong_[instructor], kTries);
    count(of_any_, kTriesOfAny);
    return {};
  }
  wrong_.erase(instructor);
  const std::int64_t now = clock_();
  std::erase_if(sessions_, [&](const auto& each) { return each.second.until_ms <= now; });
  const std::string cookie = new_secret();
  sessions_[hash_of_cookie(cookie)] = {.instructor = instructor, .token = new_secret(), .until_ms = now + kLongestMs};
  return {.cookie = cookie};
}

void Logins::log_out(const std::string& cookie) {
  sessions_.erase(hash_of_cookie(cookie));
}

const Session* Logins::session(const std::string& cookie) {
  const auto found = sessions_.find(hash_of_cookie(cookie));
  return found != sessions_.end() && found->second.until_ms > clock_() ? &found->second : nullptr;
}

}  // namespace stylet::lab::server

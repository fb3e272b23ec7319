#include "engine/lab/store/identity.h"

#include <sodium.h>

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cstddef>
#include <cstdlib>

namespace stylet::lab::store {

namespace {

constexpr std::string_view kDigits = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";
constexpr std::size_t kLetters = 6;  // before the check digit

/// Odd weights: a wrong character changes the sum of 32.
char check_digit(std::string_view letters) {
  std::size_t sum = 0;
  for (std::size_t i = 0; i < letters.size(); ++i) sum += (2 * i + 1) * kDigits.find(letters[i]);
  return kDigits[sum % kDigits.size()];
}

void need_random() {
  if (sodium_init() < 0) std::abort();
}

}  // namespace

std::string new_id(std::int64_t now_ms) {
  need_random();
  std::array<unsigned char, 16> bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  for (std::size_t i = 0; i < 6; ++i) bytes[i] = static_cast<unsigned char>(now_ms >> (40 - 8 * i));
  bytes[6] = static_cast<unsigned char>(0x70 | (bytes[6] & 0x0f));
  bytes[8] = static_cast<unsigned char>(0x80 | (bytes[8] & 0x3f));
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (i == 4 || i == 6 || i == 8 || i == 10) text += '-';
    text += fmt::format("{:02x}", bytes[i]);
  }
  return text;
}

bool is_id(std::string_view text) {
  if (text.size() != 36) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    const bool digit = (text[i] >= '0' && text[i] <= '9') || (text[i] >= 'a' && text[i] <= 'f');
    if (dash ? text[i] != '-' : !digit) return false;
  }
  return true;
}

std::int64_t time_of(std::string_view id) {
  const std::string digits = std::string(id.substr(0, 8)) + std::string(id.substr(9, 4));
  return static_cast<std::int64_t>(std::strtoull(digits.c_str(), nullptr, 16));
}

std::string new_pseudonym() {
  need_random();
  std::string letters;
  for (std::size_t i = 0; i < kLetters; ++i) letters += kDigits[randombytes_uniform(kDigits.size())];
  return letters + check_digit(letters);
}

bool is_pseudonym(std::string_view text) {
  if (text.size() != kLetters + 1 || text.find_first_not_of(kDigits) != std::string_view::npos) return false;
  return check_digit(text.substr(0, kLetters)) == text.back();
}

bool looks_like_pseudonym(std::string_view text) {
  constexpr std::string_view kNumerals = "0123456789";
  return is_pseudonym(normalized_pseudonym(text)) && text.find_first_of(kNumerals) != std::string_view::npos &&
         text.find_first_not_of(kNumerals) != std::string_view::npos;
}

std::string normalized_pseudonym(std::string_view text) {
  std::string normal;
  for (const char c : text) {
    const char upper = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    normal += upper == 'O' ? '0' : upper == 'I' || upper == 'L' ? '1' : upper;
  }
  return normal;
}

}  // namespace stylet::lab::store

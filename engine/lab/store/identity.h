// Who and what rows are: ids that sort by time, and pseudonyms that tell nothing.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace stylet::lab::store {

/// UUID version 7 (RFC 9562) in lower case: 48 bits of Unix milliseconds, the rest random.
std::string new_id(std::int64_t now_ms);
bool is_id(std::string_view text);
/// The milliseconds in it. @param id  is_id()
std::int64_t time_of(std::string_view id);

/// Seven characters of Crockford's base 32 (no I, L, O, U), the last a check digit: random, never made from a name.
std::string new_pseudonym();
/// Whether the check digit is right: a slip of one character is always found.
bool is_pseudonym(std::string_view text);
/// Typed as one: with the right check digit, letters and digits. New names do not look so.
bool looks_like_pseudonym(std::string_view text);
/// As people type it: upper case, O is 0, I and L are 1.
std::string normalized_pseudonym(std::string_view text);

}  // namespace stylet::lab::store

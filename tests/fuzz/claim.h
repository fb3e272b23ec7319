// What a fuzzer claims of what a reader hands over; a broken claim is a crash that libFuzzer keeps.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace stylet::fuzz {

inline void claim(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "claim broken: %s\n", what);
  std::abort();
}

/// A refusal is one line that says something.
inline void claim_one_line(std::string_view message) {
  claim(!message.empty(), "the message is not empty");
  claim(message.find('\n') == std::string_view::npos, "the message is one line");
}

}  // namespace stylet::fuzz

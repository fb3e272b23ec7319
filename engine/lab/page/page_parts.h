// What both pages have.
#pragma once

#include "engine/lab/page/page.h"

#include <cstdint>
#include <string>
#include <string_view>

namespace stylet::lab::page {

/// Up to the body's content. A policy forbids every request and every script. @param title  not yet escaped
std::string page_begin(const std::string& title);
std::string page_end(const PageFacts& facts);

/// Escaped, and with its own direction of writing: what people write turns nothing around it.
std::string isolated(std::string_view text);
/// "ada (7Q4M2KX)", escaped.
std::string name_of(const store::Person& person);
/// Class, symbol and word: a color is never alone.
struct StandingMark {
  const char* name;
  const char* symbol;
  const char* word;
};
StandingMark mark_of(course::Standing standing);
/// "2026-03-02"
std::string date_of(std::int64_t day);
/// "passed", "failed: tumour_content", "broken off", not escaped.
std::string result_of(const store::AttemptRecord& attempt);

}  // namespace stylet::lab::page

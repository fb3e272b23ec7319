#include "engine/lab/store/database.h"

#include <exception>
#include <utility>

namespace stylet::lab::store {

std::string text(const Value& value) {
  const auto* held = std::get_if<std::string>(&value);
  return held != nullptr ? *held : std::string();
}

std::string text(Value&& value) {
  auto* held = std::get_if<std::string>(&value);
  return held != nullptr ? std::move(*held) : std::string();
}

std::int64_t integer(const Value& value) {
  const auto* held = std::get_if<std::int64_t>(&value);
  return held != nullptr ? *held : 0;
}

std::optional<double> number(const Value& value) {
  if (const auto* held = std::get_if<double>(&value)) return *held;
  if (const auto* held = std::get_if<std::int64_t>(&value)) return static_cast<double>(*held);
  return std::nullopt;
}

std::optional<bool> truth(const Value& value) {
  const auto* held = std::get_if<std::int64_t>(&value);
  return held != nullptr ? std::optional(*held != 0) : std::nullopt;
}

std::string with_words(std::string_view text,
                       const std::vector<std::pair<std::string_view, std::string_view>>& words) {
  std::string replaced(text);
  for (const auto& [from, to] : words) {
    for (std::size_t at = replaced.find(from); at != std::string::npos; at = replaced.find(from, at + to.size())) {
      replaced.replace(at, from.size(), to);
    }
  }
  return replaced;
}

Transaction::Transaction(Database& database) : database_(database) {
  database_.begin();
}

Transaction::~Transaction() {
  if (!open_) return;
  try {
    database_.run("ROLLBACK");
  } catch (const std::exception&) {  // the database has rolled back by itself, or is gone
  }
}

void Transaction::commit() {
  database_.run("COMMIT");
  open_ = false;
}

}  // namespace stylet::lab::store

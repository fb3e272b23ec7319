// Another language: what the application says in English, sentence by sentence, as its catalogue has it.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace stylet::content {

/// Without entries everything stays English.
class Texts {
public:
  Texts() = default;
  /// @param texts  English to the other language; {} stands for a number, in the order of the English
  explicit Texts(std::map<std::string, std::string, std::less<>> texts) : texts_(std::move(texts)) {}

  /// The sentence itself, else with {} in the place of its numbers, else without the number of a list ("1. ") before
  /// it; what the catalogue does not have stays as it is.
  std::string of(std::string_view english) const;

private:
  std::map<std::string, std::string, std::less<>> texts_;
};

}  // namespace stylet::content

#include "tools/stylet/refusal.h"

#include "engine/files/json_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <vector>

namespace stylet::tools {

namespace {

std::string did_you_mean(const std::string& word, const std::set<std::string>& names) {
  const std::string close = files::nearest(word, names);
  return close.empty() ? "" : fmt::format("did you mean {}? ", close);
}

std::string see(const CLI::App& command) {
  return fmt::format("see `{} --help`", command.get_parent() == nullptr ? "stylet" : "stylet " + command.get_name());
}

/// Options are judged before what is missing: a misspelt --out is not a missing one.
std::string unexpected(const CLI::App& command) {
  const std::vector<std::string> words = command.remaining();
  if (words.empty()) return {};
  const auto option = std::ranges::find_if(words, [](const std::string& word) { return word.starts_with('-'); });
  if (option == words.end()) {
    return fmt::format("{}: is one word too many; {}", words.front(), see(command));
  }
  std::set<std::string> names;
  for (const CLI::Option* known : command.get_options()) {
    for (const std::string& name : known->get_lnames()) names.insert("--" + name);
  }
  return fmt::format("{}: there is no such option; {}{}", *option,
                     did_you_mean(option->substr(0, option->find('=')), names), see(command));
}

}  // namespace

std::string no_command(const CLI::App& app, const std::string& first_word) {
  if (first_word.empty() || first_word.starts_with('-')) return {};
  std::set<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_name() == first_word) return {};
    if (!command->get_group().empty()) names.insert(command->get_name());
  }
  return fmt::format("{}: there is no such command; {}see `stylet --help`", first_word,
                     did_you_mean(first_word, names));
}

std::string refusal(const CLI::App& app, const CLI::ParseError& error) {
  const auto chosen = app.get_subcommands();
  for (const CLI::App* command : chosen) {
    if (const std::string word = unexpected(*command); !word.empty()) return word;
  }
  if (const std::string word = unexpected(app); !word.empty()) return word;
  return fmt::format("{}; {}", error.what(), see(chosen.empty() ? app : *chosen.front()));
}

}  // namespace stylet::tools

#include "tools/stylet/completion.h"

#include "engine/app/stylus.h"
#include "engine/readers/scenario.h"

#include <algorithm>
#include <exception>
#include <filesystem>

namespace stylet::tools {

namespace {

// Nothing is quoted by hand: the words go to the command as the shell has them. Where it offers nothing, files are.
constexpr const char* kBash = R"sh(# bash completion of stylet; made by `stylet completion bash`
_stylet() {
  local IFS=$'\n' command=${1/#\~/$HOME}
  COMPREPLY=($("$command" complete -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null | cut -f 1))
  # After recorded: a file follows.
  if [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *: ]]; then compopt -o nospace 2>/dev/null; fi
}
complete -o bashdefault -o default -F _stylet stylet
)sh";

constexpr const char* kZsh = R"sh(#compdef stylet
# zsh completion of stylet; made by `stylet completion zsh`
_stylet() {
  local -a lines
  lines=(${(f)"$("${(Q)words[1]}" complete -- "${(@Q)words[2,CURRENT]}" 2>/dev/null)"})
  [[ $PREFIX == --*=* ]] && compset -P '*='
  if (( ! $#lines )); then
    compset -P '*:'
    _files
    return
  fi
  # _describe reads "word:meaning".
  lines=(${lines//:/\\:})
  lines=(${lines/$'\t'/:})
  _describe stylet lines
}
if [[ $funcstack[1] == _stylet ]]; then _stylet "$@"; else compdef _stylet stylet; fi
)sh";

constexpr const char* kFish = R"sh(# fish completion of stylet; made by `stylet completion fish`
function __stylet_complete
  set -l words (commandline -opc)
  set -l typed (commandline -ct)
  set -l option (string match -r -- '^--[^=]*=' $typed)
  $words[1] complete -- $words[2..-1] "$typed" 2>/dev/null | string replace -r '^' -- "$option"
end
complete -c stylet -f -a '(__stylet_complete)'
complete -c stylet -n 'not __stylet_complete | string length -q' -F
)sh";

/// Bash cuts words at = and at :, which become words of their own.
std::vector<std::string> rejoined(const std::vector<std::string>& words) {
  std::vector<std::string> whole;
  bool glue = false;
  for (const std::string& word : words) {
    const bool sign = word == "=" || word == ":";
    if (!whole.empty() && (glue || sign)) {
      whole.back() += word;
    } else {
      whole.push_back(word);
    }
    glue = sign;
  }
  return whole;
}

/// One line, cut where it is longer than a line of a list should be.
std::string short_meaning(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  constexpr std::size_t kLongest = 72;
  if (text.size() > kLongest) text = text.substr(0, text.rfind(' ', kLongest)) + " ...";
  return text;
}

bool shown(const CLI::Option& option) {
  return !option.get_group().empty();
}

std::vector<Completion> commands_of(const CLI::App& app) {
  std::vector<Completion> all;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); })) {
    all.push_back({command->get_name(), command->get_description()});
  }
  return all;
}

std::vector<Completion> options_of(const CLI::App& command) {
  std::vector<Completion> all;
  for (const CLI::Option* option : command.get_options([](const CLI::Option* o) { return shown(*o); })) {
    for (const std::string& name : option->get_lnames()) all.push_back({"--" + name, option->get_description()});
  }
  return all;
}

std::vector<Completion> scenarios() {
  std::vector<Completion> all;
  try {
    for (const readers::ScenarioEntry& entry : readers::list_scenarios(readers::content_directory() / "scenarios")) {
      if (entry.unreadable_because.empty()) all.push_back({entry.name, entry.title});
    }
  } catch (const std::exception&) {
    // No content, no names: a key pressed is no place for an error.
  }
  return all;
}

std::vector<Completion> courses() {
  std::vector<Completion> all;
  try {
    for (const auto& entry : std::filesystem::directory_iterator(readers::content_directory() / "courses")) {
      if (entry.path().extension() == ".json") all.push_back({entry.path().stem(), ""});
    }
  } catch (const std::exception&) {  // as above
  }
  return all;
}

std::vector<Completion> styluses() {
  std::vector<Completion> all;
  for (const app::StylusKind& kind : app::stylus_kinds()) {
    all.push_back({std::string(kind.name) + (*kind.argument == '\0' ? "" : ":"), kind.help});
  }
  return all;
}

std::vector<Completion> values_of(const CLI::Option& option) {
  const std::string name = option.get_name();
  if (name == "SCENARIO" || name == "--scenario") return scenarios();
  if (name == "--device") return styluses();
  if (name == "--course") return courses();
  // A choice says itself what there is: {auto,window,headless}.
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{');
  const std::size_t close = type.find('}', open);
  if (close == std::string::npos) return {};
  std::vector<Completion> all;
  for (std::size_t at = open + 1; at < close;) {
    const std::size_t end = std::min(type.find(',', at), close);
    all.push_back({type.substr(at, end - at), ""});
    at = end + 1;
  }
  return all;
}

const CLI::Option* option_named(const CLI::App& command, const std::string& name) {
  return command.get_option_no_throw(name);
}

const CLI::Option* positional(const CLI::App& command, int number) {
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional()) continue;
    if (number-- == 0 || option->get_items_expected_max() > 1) return option;
  }
  return nullptr;
}

/// What of `all` begins as what is typed.
std::vector<Completion> beginning_with(const std::string& typed, std::vector<Completion> all) {
  std::erase_if(all, [&](const Completion& c) {
    return !c.word.starts_with(typed) || (c.word == typed && c.word.ends_with(':'));
  });
  for (Completion& completion : all) completion.meaning = short_meaning(completion.meaning);
  return all;
}

}  // namespace

std::vector<Completion> completions(const CLI::App& app, const std::vector<std::string>& words) {
  const std::vector<std::string> whole = rejoined(words);
  if (whole.empty()) return beginning_with("", commands_of(app));
  const CLI::App* command = &app;
  const CLI::Option* waiting = nullptr;  // the option whose value comes next
  int due = 0;                           // values that it still takes
  int positionals = 0;
  for (std::size_t i = 0; i + 1 < whole.size(); ++i) {
    const std::string& word = whole[i];
    if (due > 0) {
      --due;
    } else if (word.starts_with('-')) {
      waiting = option_named(*command, word);  // with its value behind = it is none
      due = waiting != nullptr ? waiting->get_items_expected_min() : 0;
    } else if (command == &app) {
      const auto named = app.get_subcommands([&](const CLI::App* c) { return c->get_name() == word; });
      if (named.empty()) return {};
      command = named.front();
    } else {
      ++positionals;
    }
  }
  const std::string& typed = whole.back();
  if (due > 0) return beginning_with(typed, values_of(*waiting));
  if (typed.starts_with('-')) {
    const std::size_t equals = typed.find('=');
    if (equals == std::string::npos) return beginning_with(typed, options_of(*command));
    const CLI::Option* option = option_named(*command, typed.substr(0, equals));
    return option == nullptr ? std::vector<Completion>{}
                             : beginning_with(typed.substr(equals + 1), values_of(*option));
  }
  if (command == &app) return beginning_with(typed, commands_of(app));
  const CLI::Option* next = positional(*command, positionals);
  return next == nullptr ? std::vector<Completion>{} : beginning_with(typed, values_of(*next));
}

std::string completion_lines(const std::vector<Completion>& completions) {
  std::string lines;
  for (const Completion& completion : completions) {
    lines += completion.word + (completion.meaning.empty() ? "" : "\t" + completion.meaning) + "\n";
  }
  return lines;
}

std::string completion_script(const std::string& shell) {
  return shell == "bash" ? kBash : shell == "zsh" ? kZsh : shell == "fish" ? kFish : "";
}

}  // namespace stylet::tools

#include "tools/stylet/man_page.h"

#include "tools/stylet/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::tools {

namespace {

/// What roff would take for its own is escaped, so that options and examples can be copied out of the page.
std::string literal(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '\\':
        out += "\\e";
        break;
      case '-':
        out += "\\-";
        break;
      case '\'':
        out += "\\(aq";
        break;
      case '`':
        out += "\\(ga";
        break;
      case '^':
        out += "\\(ha";
        break;
      case '~':
        out += "\\(ti";
        break;
      default:
        out += c;
    }
  }
  return out;
}

/// A list without blanks may be broken at its commas.
std::string with_breaks(std::string list) {
  for (std::size_t at = 0; (at = list.find(',', at)) != list.npos; at += 3) list.insert(at + 1, "\\:");
  return list;
}

/// A line of text; what stands between `...` is bold. Guarded at its start, where a dot or a quote would be a
/// request.
std::string prose(std::string_view text) {
  std::string out = "\\&";
  bool bold = false;
  std::size_t at = 0;
  while (at <= text.size()) {
    const std::size_t tick = std::min(text.find('`', at), text.size());
    out += literal(text.substr(at, tick - at));
    if (tick < text.size() && (bold || text.find('`', tick + 1) != text.npos)) {
      bold = !bold;
      out += bold ? "\\fB" : "\\fR";
    }
    at = tick + 1;
  }
  return out;
}

/// Help text: lines that follow each other are one paragraph, but those that begin with two blanks, "  what meaning",
/// are a list.
std::string block(const std::string& text) {
  std::string out;
  bool in_list = false;
  bool new_paragraph = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) {
      new_paragraph = true;
    } else if (line.starts_with("  ")) {
      const std::size_t begin = line.find_first_not_of(' ');
      const std::size_t gap = std::min(line.find("  ", begin), line.size());
      const std::size_t meaning = std::min(line.find_first_not_of(' ', gap), line.size());
      out += fmt::format(".TP\n\\fB{}\\fR\n{}\n", literal(line.substr(begin, gap - begin)),
                         meaning < line.size() ? prose(line.substr(meaning)) : "\\&");
      in_list = true;
      new_paragraph = false;
    } else {
      if (in_list || new_paragraph) out += ".PP\n";
      in_list = false;
      new_paragraph = false;
      out += prose(line) + "\n";
    }
  }
  return out;
}

/// "FLOAT:FLOAT in [0 - 60]": what it is, and between what.
std::pair<std::string, std::string> type_and_range(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t range = type.find(" in [");
  const std::size_t choice = type.find('{');
  const std::string plain = option.nonpositional() ? type.substr(0, type.find(':')) : "";  // a name says enough
  const std::string kind = choice != std::string::npos ? type.substr(choice) : plain;
  return {kind, range == std::string::npos ? "" : type.substr(range + 4)};
}

std::string entry(const CLI::Option& option) {
  std::string names = option.get_positional() && option.get_lnames().empty() ? option.get_name() : "";
  for (const std::string& name : option.get_snames()) names += fmt::format("{}-{}", names.empty() ? "" : ", ", name);
  for (const std::string& name : option.get_lnames()) names += fmt::format("{}--{}", names.empty() ? "" : ", ", name);
  const auto [type, range] =
      option.get_items_expected_max() > 0 ? type_and_range(option) : std::pair<std::string, std::string>{};
  std::string out = fmt::format(".TP\n\\fB{}\\fR", literal(names));
  if (!type.empty()) out += fmt::format(" \\fI{}\\fR", with_breaks(literal(type)));
  out += "\n" + prose(option.get_description() + ".") + "\n";
  if (!range.empty()) out += prose("Range: " + range + ".") + "\n";
  if (!option.get_default_str().empty()) out += prose("Default: " + option.get_default_str() + ".") + "\n";
  if (option.get_required()) out += prose("Required.") + "\n";
  return out;
}

std::string options(const CLI::App& command) {
  std::string out;
  for (const CLI::Option* option :
       command.get_options([](const CLI::Option* o) { return !o->get_group().empty(); })) {
    if (command.get_parent() != nullptr && option == command.get_help_ptr()) continue;  // said once, at the top
    out += entry(*option);
  }
  return out;
}

std::string synopsis(const CLI::App& command) {
  std::string out = "stylet " + command.get_name();
  for (const CLI::Option* option : command.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
    const std::string name = option->get_name() + (option->get_items_expected_max() > 1 ? "..." : "");
    out += option->get_required() ? " " + name : " [" + name + "]";
  }
  return out + " [OPTIONS]";
}

}  // namespace

std::string man_page(const CLI::App& app, const std::string& version) {
  const auto commands = app.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); });
  std::string out =
      fmt::format(".\\\" Made by `stylet man`.\n.TH STYLET 1 \"\" \"stylet {}\" \"User commands\"\n", version);
  out += ".nh\n.ad l\n.SH NAME\nstylet \\- training simulator for needle procedures\n.SH SYNOPSIS\n.nf\n";
  for (const CLI::App* command : commands) out += fmt::format("\\fB{}\\fR\n", literal(synopsis(*command)));
  out += ".fi\n.SH DESCRIPTION\n" + block(app.get_description());
  out += ".SH OPTIONS\n" + options(app) + ".SH COMMANDS\n";
  for (const CLI::App* command : commands) {
    out += fmt::format(".SS {}\n{}\n", literal(synopsis(*command)), prose(command->get_description() + "."));
    out += options(*command) + block("\n" + command->get_footer());
  }
  out += ".SH EXAMPLES\n" + block(app.get_footer());
  out += ".SH EXIT STATUS\n";
  for (const auto& [code, meaning] :
       {std::pair{kExitYes, "Done."}, std::pair{kExitNo, "It ran, and the answer is no: a replay that differs."},
        std::pair{kExitBadInput, "Bad input, or a device that is not there; one line says what to do."},
        std::pair{kExitInterrupted, "Ended by Ctrl-C."}}) {
    out += fmt::format(".TP\n\\fB{}\\fR\n{}\n", code, prose(meaning));
  }
  out += ".SH ENVIRONMENT\n";
  for (const auto& [name, meaning] :
       {std::pair{"STYLET_CONTENT",
                  "Folder with scenarios, organs, tissues, needles and probes; default: the one installed with the "
                  "program."},
        std::pair{"STYLET_LAB", "Folder of the lab's records; default: see FILES."},
        std::pair{"STYLET_VALIDATION", "1: Vulkan's validation layers check all use of the GPU; slow."},
        std::pair{"XR_RUNTIME_JSON", "OpenXR runtime of the headset, where it is not the system's."},
        std::pair{"OPENBLAS_CORETYPE", "Kernels of OpenBLAS; default: those that fit the processor."}}) {
    out += fmt::format(".TP\n\\fB{}\\fR\n{}\n", name, prose(meaning));
  }
  out += ".SH FILES\n";
  for (const auto& [name, meaning] :
       {std::pair{"$XDG_CONFIG_HOME/stylet/devices/", "Calibrations of devices; else in ~/.config."},
        std::pair{"$XDG_DATA_HOME/stylet/lab/",
                  "Records of a skills lab, where a session had a trainee; else in ~/.local/share."},
        std::pair{"$XDG_CACHE_HOME/stylet/",
                  "Expert runs that a debrief compares with, made once; else in ~/.cache."}}) {
    out += fmt::format(".TP\n\\fB{}\\fR\n{}\n", literal(name), prose(meaning));
  }
  return out;
}

}  // namespace stylet::tools

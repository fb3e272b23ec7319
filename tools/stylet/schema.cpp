// `stylet schema`: the keys of every file, and the metrics, from the tables that the readers read by.
#include "engine/content/metric_table.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/files/key_tables.h"
#include "engine/import/side_file.h"
#include "engine/lab/course/course_file.h"
#include "engine/procedures/kinds.h"
#include "engine/readers/formats.h"
#include "tools/stylet/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace stylet::tools {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kMetrics = "metrics";
constexpr std::size_t kLongestPage = 4u << 20;  // bytes

std::vector<files::FileFormat> all_formats() {
  std::vector<files::FileFormat> formats = readers::formats();
  formats.push_back(import::side_file_format());
  formats.push_back(lab::course::course_format());
  return formats;
}

void list_kinds() {
  std::vector<std::vector<std::string>> rows;
  for (const files::FileFormat& format : all_formats()) {
    rows.push_back({"  " + std::string(format.name), std::string(format.title)});
  }
  rows.push_back({"  " + std::string(kMetrics), "What a scenario can score: unit, definition, source"});
  fmt::print("{}`stylet schema KIND` shows one.\n", files::columns(rows));
}

std::string metric_columns() {
  std::vector<std::vector<std::string>> rows;
  for (const content::MetricRow& metric : procedures::metric_table()) {
    rows.push_back({"  " + std::string(metric.name), std::string(metric.unit.empty() ? "-" : metric.unit),
                    fmt::format("{} ({})", metric.definition, metric.source)});
  }
  return files::columns(rows);
}

/// "{scenario,tissues,...}"
std::string kinds() {
  std::string names;
  for (const files::FileFormat& format : all_formats()) names += fmt::format("{},", format.name);
  return fmt::format("{{{}{}}}", names, kMetrics);
}

files::FileFormat find_format(const std::string& kind) {
  std::set<std::string> names{std::string(kMetrics)};
  for (const files::FileFormat& format : all_formats()) {
    if (format.name == kind || format.id == kind) return format;
    names.emplace(format.name);
  }
  const std::string close = files::nearest(kind, names);
  throw files::ContentError(
      fmt::format("{} is no kind of file; {}", kind,
                  close.empty() ? "`stylet schema` lists them" : fmt::format("did you mean \"{}\"?", close)));
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  if (!(out << text).flush()) {
    throw files::ContentError(fmt::format("{}: cannot be written; check folder and space", path.string()));
  }
}

/// Makes schemas/*.schema.json and the tables of README.md in a content folder anew.
void write_content(const fs::path& folder) {
  std::string page = files::read_file(folder / "README.md", kLongestPage);
  for (const files::FileFormat& format : all_formats()) {
    write(folder / "schemas" / fmt::format("{}.schema.json", format.name), files::json_schema(format));
    page = files::with_generated(page, format.name, files::markdown_table(format));
  }
  write(folder / "README.md",
        files::with_generated(page, kMetrics, content::metric_markdown(procedures::metric_table())));
}

struct SchemaOptions {
  std::string kind;
  bool json = false;
  bool markdown = false;
  std::string write;
};

void show(const SchemaOptions& options) {
  if (options.kind == kMetrics) {
    if (options.json) throw files::ContentError("metrics are no file and have no JSON schema; leave out --json");
    fmt::print("{}", options.markdown ? content::metric_markdown(procedures::metric_table()) : metric_columns());
    return;
  }
  const files::FileFormat format = find_format(options.kind);
  fmt::print("{}", options.json       ? files::json_schema(format)
                   : options.markdown ? files::markdown_table(format)
                                      : files::plain_table(format));
}

}  // namespace

void add_schema(CLI::App& app) {
  CLI::App* command = app.add_subcommand("schema", "The keys of every file: type, unit, range, default, meaning");
  auto options = std::make_shared<SchemaOptions>();
  CLI::Option* kind =
      command->add_option("KIND", options->kind, "Kind of file, or metrics; without it all kinds are listed")
          ->type_name(kinds());
  CLI::Option* json = command->add_flag("--json", options->json, "As a JSON schema, for editors")->needs(kind);
  CLI::Option* markdown =
      command->add_flag("--markdown", options->markdown, "As the table in content/README.md")->needs(kind);
  json->excludes(markdown);
  command
      ->add_option("--write", options->write,
                   "Content folder of the sources, whose schemas/ and README.md are made anew from these tables")
      ->excludes(kind);
  command->footer(
      "A key of an object within an object is indented. What has no default and is not optional must be there.\n"
      "Of the alternatives in an object exactly one must be there.\n\n"
      "  stylet schema scenario\n"
      "  stylet schema needle --json > needle.schema.json\n"
      "  stylet schema metrics\n"
      "  stylet schema --write content                   after a key was changed");
  command->callback([options] {
    if (!options->write.empty()) return write_content(options->write);
    return options->kind.empty() ? list_kinds() : show(*options);
  });
}

}  // namespace stylet::tools

#include "tools/bench/report.h"

#include "engine/files/html.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>

namespace stylet::bench {
namespace {

using files::html::escaped;

constexpr std::string_view kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
body {{ font: 15px/1.5 system-ui, sans-serif; max-width: 1150px; margin: 2em auto; padding: 0 1em; color: #1f242e; }}
table {{ border-collapse: collapse; width: 100%; font-size: 14px; }}
th, td {{ text-align: left; padding: 3px 8px; border-bottom: 1px solid #dde; }}
td.n {{ text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }}
tr.first td {{ border-top: 2px solid #99a; }}
.met {{ color: #067a46; }} .missed {{ color: #c00; font-weight: bold; }} .note, .machine {{ color: #667; }}
figure {{ margin: 1.6em 0; }} img {{ max-width: 100%; }} figcaption {{ color: #445; }}
</style></head><body>
<h1>{title}</h1>
)";

std::string rounded(std::optional<double> value) {
  if (!value) return {};
  return std::isfinite(*value) ? fmt::format("{:.4g}", *value) : "not finite";
}

std::string table(const Report& report) {
  std::string html =
      "<table><tr><th>measurement</th><th>value</th><th>unit</th><th>theory</th><th>bound</th><th></th>"
      "<th>conditions</th></tr>\n";
  std::string group;
  for (const Measurement& m : report.measurements) {
    const std::string first = m.name.substr(0, m.name.find('.'));
    const std::string_view verdict = !m.met   ? ""
                                     : *m.met ? "<span class=met>met</span>"
                                              : "<span class=missed>MISSED</span>";
    html += fmt::format(
        "<tr{}><td>{}</td><td class=n>{}</td><td>{}</td><td class=n>{}</td><td class=n>{}</td><td>{}</td>"
        "<td class=note>{}</td></tr>\n",
        first != group ? " class=first" : "", escaped(m.name), rounded(m.value), escaped(m.unit),
        rounded(m.reference), escaped(m.target), verdict, escaped(m.note));
    group = first;
  }
  return html + "</table>\n";
}

std::string read_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read; was it moved while the bench ran?");
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

void write_page(const std::filesystem::path& file, const std::string& title, const Report& report,
                const Machine& machine) {
  std::string html = fmt::format(kHead, fmt::arg("title", escaped(title)));
  int asked = 0;
  for (const Measurement& m : report.measurements) asked += m.met ? 1 : 0;
  html += fmt::format("<p class=machine>{}, {} cores, {:.0f} GiB<br>{}, {}, {}</p>\n<p>{} of {} targets met.</p>\n",
                      escaped(machine.processor), machine.cores, machine.memory_gib, escaped(machine.build),
                      escaped(machine.compiler), escaped(machine.flags), asked - report.missed(), asked);
  html += table(report);
  for (const Figure& figure : report.figures) {
    html += fmt::format(
        "<figure><h2>{0}</h2><img alt=\"{0}\" "
        "src=\"data:image/png;base64,{1}\"><figcaption>{2}</figcaption></figure>\n",
        escaped(figure.title), files::html::base64(read_file(figure.file)), escaped(figure.caption));
  }
  std::ofstream out(file, std::ios::binary);
  out << html << "</body></html>\n";
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written; is the disk full?");
}

}  // namespace stylet::bench

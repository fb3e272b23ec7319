#include "engine/lab/course/course.h"

#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/readers/scenario.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <system_error>

namespace stylet::lab::course {

namespace fs = std::filesystem;

std::string gate_words(const Exercise& exercise) {
  const statistics::Gate& gate = exercise.gate;
  return fmt::format(
      "gate at {:.2f} within {} attempts on {} days, {} passes at least; who fails {:.0f} % passes it with "
      "probability "
      "{:.3f}, who fails {:.0f} % with {:.3f}",
      gate.limit, gate.horizon, exercise.days, gate.shortest_run, exercise.rates.acceptable * 100,
      gate.true_discovery, exercise.rates.unacceptable * 100, gate.false_discovery);
}

fs::path find_course(const std::string& path_or_name) {
  std::error_code error;
  if (fs::is_regular_file(path_or_name, error)) return path_or_name;
  const fs::path folder = readers::content_directory() / "courses";
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".json") continue;
    if (entry.path().stem() == path_or_name) return entry.path();
    names.insert(entry.path().stem().string());
  }
  const std::string close = files::nearest(path_or_name, names);
  throw files::ContentError(fmt::format(
      "{}: there is no such file or course; {}: {}", path_or_name,
      close.empty() ? "name one of" : fmt::format("did you mean {}? There are", close), fmt::join(names, ", ")));
}

}  // namespace stylet::lab::course

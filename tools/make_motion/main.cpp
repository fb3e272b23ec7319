// Writes the motions of content/motions; content/motions/LICENCE.md has the commands.
#include "engine/motion/biopsy_motion.h"
#include "engine/motion/stroke_motion.h"
#include "engine/procedures/ablation/plan.h"
#include "engine/readers/instruments.h"
#include "engine/readers/motion.h"
#include "engine/readers/patient_procedure.h"
#include "engine/readers/scenario_file.h"

#include <exception>
#include <iostream>
#include <string>
#include <vector>

namespace {

stylet::motion::BiopsyPlan read_plan(const char* procedure, const char* needle) {
  using namespace stylet::content;
  using namespace stylet::files;
  using namespace stylet::readers;
  JsonFile file{std::filesystem::path(procedure)};
  const Procedure planned = read_procedure(file);
  file.throw_problems();
  JsonFile needle_file{std::filesystem::path(needle)};
  const double length = read_needle(needle_file).length;
  needle_file.throw_problems();
  return stylet::motion::demonstration(planned.entry, planned.target, planned.target_radius, length);
}

/// The scenario as written; the motion that it names may not be there yet.
stylet::readers::ScenarioFile read_scenario(const char* path) {
  stylet::files::JsonFile file{std::filesystem::path(path)};
  return stylet::readers::read_scenario_file(file);
}

double needle_length(const stylet::readers::ScenarioFile& scenario) {
  stylet::files::JsonFile file{scenario.needle};
  const double length = stylet::readers::read_needle(file).length;
  file.throw_problems();
  return length;
}

stylet::content::Motion make_tour(const char* path) {
  using namespace stylet::content;
  using namespace stylet::files;
  using namespace stylet::readers;
  const ScenarioFile scenario = read_scenario(path);
  std::vector<Target> targets;
  for (const TargetRequest& target : scenario.targets) targets.push_back({target.name, target.centre, target.radius});
  // Beside the probe's face, image left.
  return stylet::motion::tour_motion(
      {.entry = {-0.040, 0, 0}, .targets = targets, .needle_length = needle_length(scenario)});
}

/// Into the target of a procedure, to stay there: an ablation, or an aspiration, after which it leaves.
stylet::content::Motion make_stay(bool ablates, const char* procedure, const char* path) {
  using namespace stylet::content;
  using namespace stylet::files;
  using namespace stylet::readers;
  const ScenarioFile scenario = read_scenario(path);
  JsonFile file{std::filesystem::path(procedure)};
  const Procedure planned = read_procedure(file);
  file.throw_problems();
  constexpr double kDraining = 24;  // s
  double exposed = 0, stay = kDraining;
  if (ablates) {
    const auto& ablation = stylet::procedures::ablation::plan_of(scenario.exercise);
    exposed = ablation.exposed;
    stay = ablation.duration_s / ablation.time_factor + 2;
  }
  return stylet::motion::stay_motion({.entry = planned.entry,
                                      .target = planned.target,
                                      .exposed = exposed,
                                      .beyond = ablates ? stylet::motion::kLiverYields : 0,
                                      .needle_length = needle_length(scenario),
                                      .breathing = scenario.breathing,
                                      .carried = 0.9 * scenario.breathing.rigid_motion,
                                      .stay = stay,
                                      .withdraw = !ablates});
}

int write(const stylet::content::Motion& motion, const char* name, const char* path) {
  stylet::readers::write_motion(motion, name, path);
  std::cout << path << ": " << motion.stylus.size() << " samples, " << motion.stylus.back().time_s << " s\n";
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  const std::string kind = count > 1 ? arguments[1] : "";
  try {
    if (kind == "tour" && count == 4) return write(make_tour(arguments[2]), "phantom tour", arguments[3]);
    if ((kind == "ablation" || kind == "aspiration") && count == 5) {
      return write(make_stay(kind == "ablation", arguments[2], arguments[3]), kind.c_str(), arguments[4]);
    }
    if (count == 4) {
      return write(stylet::motion::biopsy_motion(read_plan(arguments[1], arguments[2])), "liver biopsy",
                   arguments[3]);
    }
    std::cerr << "usage: make_motion PROCEDURE.json NEEDLE.json OUT.json         the liver biopsy\n"
                 "       make_motion tour SCENARIO.json OUT.json                 to each of its targets in turn\n"
                 "       make_motion ablation PROCEDURE.json SCENARIO.json OUT.json\n"
                 "       make_motion aspiration PROCEDURE.json SCENARIO.json OUT.json\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
  }
  return 2;
}

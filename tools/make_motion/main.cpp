// Writes content/motions/liver_biopsy.json from the planned entry and target of the default patient.
//   make_motion content/organs/abdomen.json content/needles/18g_150mm.json content/motions/liver_biopsy.json
#include "engine/content/instruments.h"
#include "engine/content/motion.h"
#include "engine/content/procedure.h"
#include "tools/make_motion/biopsy_motion.h"

#include <exception>
#include <iostream>

namespace {

stylet::motion::BiopsyPlan read_plan(const char* procedure, const char* needle) {
  using namespace stylet::content;
  stylet::motion::BiopsyPlan plan;
  JsonFile file{std::filesystem::path(procedure)};
  const Procedure planned = read_procedure(file);
  file.throw_problems();
  plan.entry = planned.entry;
  plan.target = planned.target;
  JsonFile needle_file{std::filesystem::path(needle)};
  plan.needle_length = read_needle(needle_file).length;
  needle_file.throw_problems();
  return plan;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) {
    std::cerr << "usage: make_motion PROCEDURE.json NEEDLE.json OUT.json\n";
    return 2;
  }
  try {
    const auto motion = stylet::motion::biopsy_motion(read_plan(arguments[1], arguments[2]));
    stylet::content::write_motion(motion, "liver biopsy", arguments[3]);
    std::cout << arguments[3] << ": " << motion.stylus.size() << " samples, " << motion.stylus.back().time_s
              << " s\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
  return 0;
}

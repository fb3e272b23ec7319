// The JSON files of content/: what comes out is in range and every problem is one line.
#include "engine/content/tissue_table.h"
#include "engine/files/json_reader.h"
#include "engine/import/side_file.h"
#include "engine/lab/course/course_file.h"
#include "engine/readers/calibration_file.h"
#include "engine/readers/instruments.h"
#include "engine/readers/motion_file.h"
#include "engine/readers/patient_procedure.h"
#include "engine/readers/scenario_file.h"
#include "tests/fuzz/claim.h"
#include "tests/fuzz/libfuzzer.h"

#include <nlohmann/json.hpp>

#include <cmath>

namespace {

using namespace stylet;
using files::JsonFile;

constexpr files::JsonLimits kLimits{.bytes = 1u << 20, .depth = 16};

void claim_scenario(JsonFile& file) {
  const readers::ScenarioFile scenario = readers::read_scenario_file(file);
  for (const readers::BodyRequest& body : scenario.bodies) {
    fuzz::claim(body.target_nodes <= 50000, "a body's nodes are limited");
  }
  for (const readers::TargetRequest& target : scenario.targets) {
    fuzz::claim(target.centre.allFinite() && std::isfinite(target.radius), "targets are finite");
  }
  fuzz::claim(scenario.room_from_patient.matrix().allFinite(), "the room's pose is finite");
}

void claim_side_file(JsonFile& file) {
  const import::SideFile side = import::read_side_file(file);
  for (const import::SideOrgan& organ : side.organs) {
    fuzz::claim(organ.cell >= 0 && organ.target_nodes <= 200000, "tetrahedra are limited");
  }
  if (!file.problems().empty() || !side.scenario) return;
  const std::optional<Eigen::Vector3d>& entry = side.scenario->entry;
  fuzz::claim((!entry || entry->allFinite()) && (!side.scenario->probe.at || side.scenario->probe.at->allFinite()),
              "places are finite");
  fuzz::claim(side.scenario->wall.depth > 0 && side.scenario->label_spacing > 0, "lengths are positive");
}

void claim_tissues(JsonFile& file) {
  for (content::Tissue& tissue : content::read_tissues(file).tissues) {
    for (const content::TissueKey& key : content::tissue_keys()) {
      fuzz::claim(std::isfinite(key.of(tissue)), "tissue values are finite");
    }
  }
}

void claim_motion(JsonFile& file) {
  const content::Motion motion = readers::read_motion(file);
  if (!file.problems().empty()) return;
  fuzz::claim(motion.stylus.size() >= 2, "a stylus track has two samples");
  for (std::size_t i = 0; i < motion.stylus.size(); ++i) {
    const content::MotionSample& sample = motion.stylus[i];
    fuzz::claim(sample.pose.position.allFinite(), "positions are finite");
    fuzz::claim(std::abs(sample.pose.orientation.norm() - 1) < 1e-9, "orientations are normalised");
    fuzz::claim(i == 0 || sample.time_s > motion.stylus[i - 1].time_s, "times increase");
  }
}

void claim_course(JsonFile& file) {
  const lab::course::Course course = lab::course::read_course(file);
  if (!file.problems().empty()) return;
  fuzz::claim(!course.exercises.empty(), "a course has an exercise");
  for (const lab::course::Exercise& exercise : course.exercises) {
    fuzz::claim(exercise.gate.limit > 0 && exercise.gate.shortest_run <= exercise.gate.horizon,
                "a gate can be passed");
    fuzz::claim(exercise.gate.false_discovery < exercise.gate.true_discovery, "a gate tells the competent apart");
    fuzz::claim(!exercise.monitoring || exercise.monitoring->limit > 0, "an alarm has a limit");
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Stands beside the shipped scenarios, so that the files it names are there.
  const std::string path = STYLET_SOURCE_DIR "/content/scenarios/fuzz.json";
  try {
    JsonFile file(path, {reinterpret_cast<const char*>(data), size}, kLimits);
    const std::string format = file.format();
    if (format == "stylet-tissues") {
      claim_tissues(file);
    } else if (format == "stylet-needle") {
      const content::Needle needle = readers::read_needle(file);
      fuzz::claim(needle.length > 0 && std::isfinite(needle.length), "a needle has a length");
    } else if (format == "stylet-probe") {
      readers::read_probe(file);
    } else if (format == "stylet-procedure") {
      fuzz::claim(std::abs(readers::read_procedure(file).needle_direction.norm() - 1) < 1e-9,
                  "a direction is a unit vector");
    } else if (format == "stylet-motion") {
      claim_motion(file);
    } else if (format == "stylet-calibration") {
      const haptic::hid::Calibration calibration = readers::read_calibration(file);
      fuzz::claim(calibration.scale >= 0.1 && calibration.scale <= 10, "a calibration's scale is in range");
      fuzz::claim(!calibration.rest || calibration.rest->allFinite(), "a rest place is finite");
      fuzz::claim(std::abs(calibration.user_from_device.norm() - 1) < 1e-9, "a turn is normalised");
    } else if (format == "stylet-import") {
      claim_side_file(file);
    } else if (format == "stylet-course") {
      claim_course(file);
    } else {
      claim_scenario(file);
    }
    for (const std::string& problem : file.problems()) fuzz::claim_one_line(problem);
  } catch (const files::ContentError& error) {
    fuzz::claim_one_line(error.what());
  }
  return 0;
}

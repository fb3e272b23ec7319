// Where needle and probe stand when a trainee takes them up: drawn, so that nobody begins aimed at the target.
#pragma once

#include "engine/content/probe_placement.h"
#include "engine/content/scene.h"

#include <Eigen/Core>

#include <cstdint>

namespace stylet::session {

/// Patient frame, m.
struct StartPose {
  std::uint32_t seed = 0;                          ///< that it was drawn from
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();   ///< of the needle
  Eigen::Vector3d aim = Eigen::Vector3d::UnitZ();  ///< the point that it points at, as far away as the target
  physics::StylusPose hub{};                       ///< of the same needle
  content::ProbeMove probe{};                      ///< from where the scene has it
};

/// As the scene has them: the needle where its motion begins, aimed at the first target, the probe where the scenario
/// holds it. The scene has a target and a motion.
StartPose start_of(const content::Scene& scene);

/// The same displaced as Scene::start says, the same for the same seed. The probe stays on the skin: where there is
/// none in 64 draws it stays where the scene has it.
StartPose drawn_start(const content::Scene& scene, std::uint32_t seed);

}  // namespace stylet::session

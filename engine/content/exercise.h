// What a scenario trains: briefing, the procedure, hints. Difficulty is data.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stylet::content {

/// What the trainee reads before the procedure; any of it may be empty.
struct Briefing {
  std::string goal{};
  std::vector<std::string> steps{};
  std::string anatomy{};
};

/// What a scenario says of its procedure: the module of the kind has the rest (engine/procedures/KIND/plan.h). The
/// rest of the engine needs to know:
struct ProcedurePlan {
  virtual ~ProcedurePlan() = default;
  std::string kind{};
  bool automatic = false;     ///< begins by itself where the tip rests inside a target
  double working_length = 0;  ///< of the needle, from its tip, that works on the tissue, m; 0: the tip alone
  bool destroys = false;      ///< pictures will have a zone to show
};

/// Closed interval; without ends where the scenario gives none.
struct Interval {
  double from = -std::numeric_limits<double>::infinity();
  double to = std::numeric_limits<double>::infinity();
  bool holds(double value) const { return value >= from && value <= to; }
};

/// A sentence for the trainee, shown while every condition given holds.
struct Hint {
  std::string text{};
  std::string stage{};                 ///< briefing, procedure, sampling, debrief; empty: any
  std::optional<bool> tip_inside{};    ///< the needle is in the patient, its tip perhaps between two organs
  std::optional<bool> probe_lifted{};  ///< it touches no skin
  Interval stage_s{};                  ///< since the stage began
  Interval depth{};                    ///< of needle in tissue, m
  Interval distance{};                 ///< from the tip to the surface of the next target, m; negative inside
  Interval off_plane{};                ///< from the tip to the image plane, m
  Interval force{};                    ///< on the hand, N
  Interval samples{};                  ///< taken so far
};

struct Exercise {
  Briefing briefing{};
  std::shared_ptr<const ProcedurePlan> plan{};  ///< null: nothing is sampled or destroyed
  std::vector<Hint> hints{};                    ///< the first that holds is shown
};

}  // namespace stylet::content

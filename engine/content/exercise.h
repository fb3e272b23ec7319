// What a scenario trains: briefing, how tissue is sampled or destroyed, hints. Difficulty is data.
#pragma once

#include <cstdint>
#include <limits>
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

enum class SamplingKind : std::uint8_t { none, biopsy, ablation };

/// A spring-loaded side-notch needle: fired, its stylet shoots ahead by `throw_length`, and the cannula cuts off what
/// has fallen into the notch behind the stylet's point.
struct BiopsyGun {
  double throw_length = 0.022;  ///< m
  double notch = 0.017;         ///< length of the core, m
  double bore = 0.0011;         ///< diameter of the core, m

  static constexpr double kStyletPoint = 0.005;  ///< m; the notch ends so far behind the stylet's tip at least
};

/// A monopolar radio-frequency electrode, and for how long it heats.
struct AblationPlan {
  double exposed = 0.030;        ///< length of the bare tip, m
  double power_w = 100;          ///< most that goes into the tissue
  double max_temperature = 100;  ///< degrees Celsius that no tissue exceeds: power is taken back
  double duration_s = 720;       ///< of heating
  double time_factor = 60;       ///< seconds of heating in a second of the session
  double margin = 0.005;         ///< around the tumour that is to be destroyed too, m
};

struct Sampling {
  SamplingKind kind = SamplingKind::none;
  bool automatic = false;  ///< fires, or starts to heat, by itself where the tip rests inside a target
  int samples = 1;         ///< cores wanted, at most one a target where there are several
  BiopsyGun gun{};
  AblationPlan ablation{};
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
  std::optional<bool> tip_inside{};    ///< in tissue
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
  Sampling sampling{};
  std::vector<Hint> hints{};  ///< the first that holds is shown
};

}  // namespace stylet::content

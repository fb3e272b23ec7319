// What a trainee is told when the session is over, and what to do about it.
#pragma once

#include "engine/content/texts.h"
#include "engine/training/training_report.h"

#include <optional>
#include <string>
#include <vector>

namespace stylet::panels {

/// A scored line, that which lost most points first.
struct EndingLine {
  std::string title{};
  std::string value{};  ///< "12.3 mm"; empty: not measured
  double points = 0;
  double most = 0;
  bool failed = false;  ///< critical, and without points
};

struct Ending {
  std::optional<double> score{};  ///< of 100; none: the scenario scores nothing
  double pass_mark = 0;
  bool passed = false;
  std::string verdict{};  ///< "Passed"
  std::string wanted{};   ///< "of 100; 60 are to be reached"
  std::vector<EndingLine> lines{};
  std::vector<std::string> result{};  ///< what was sampled or destroyed
  std::string advice{};               ///< one sentence
  // Changes while it is shown.
  std::string doing{};  ///< what is still under way; empty: nothing
  double share = 0;     ///< of it done, [0, 1]
  std::string note{};   ///< what came of the last button, or of the replay
};

/// @param result_in_words  of the procedure, lines
Ending ending_of(const training::TrainingReport& report, const std::string& result_in_words);

/// What people read of it in another language.
void translate(Ending& ending, const content::Texts& texts);

/// One sentence: what to do better, by the criterion that failed, or that lost most points.
std::string advice(const training::Score& score);

}  // namespace stylet::panels

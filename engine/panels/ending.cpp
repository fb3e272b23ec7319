#include "engine/panels/ending.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

namespace stylet::panels {
namespace {

/// What does better at a criterion, said where it lost most.
constexpr std::array<std::pair<std::string_view, std::string_view>, 19> kAdvice{{
    {"ablation_coverage",
     "Place the electrode so that the whole tumour and its margin lie in the zone before you heat."},
    {"angle_error", "Line the needle up with the target while it is still shallow: deep in, it cannot be turned."},
    {"blood_drawn", "Stop drawing as soon as the tip leaves the cyst: what comes then is blood."},
    {"cyst_residue", "Keep the tip in the middle of the cyst and draw until nothing is left."},
    {"depth_overshoot", "Stop at the target: follow the tip in the image and advance in smaller steps at the end."},
    {"elapsed_time", "Plan the way before you start; then go it without waiting."},
    {"forbidden_hits", "Find vessels, gut and lung in the image first and choose a way that keeps clear of them."},
    {"needle_in_beam", "Turn the probe until the whole needle is in the image before you go deeper."},
    {"out_of_plane_time", "Advance only while you see the tip: stop and turn the probe when it is lost."},
    {"path_inefficiency", "Aim before you enter the skin, so that one straight way leads to the target."},
    {"peak_force", "Push gently; where it becomes hard you are on bone: go back and choose another way."},
    {"punctures", "Enter the skin once: correct the direction inside, or draw back without leaving the patient."},
    {"skin_contacts", "Decide on the point of entry with the probe before the needle touches the skin."},
    {"targeting", "Bring the tip to the middle of the target before you release."},
    {"throw_beyond", "Fire where the needle enters the target: it shoots ahead, and must not come out behind."},
    {"time_in_tissue", "Work steadily: the patient can hold the breath only for so long."},
    {"tissue_damage", "Do not swing the needle inside the patient: draw back before you change direction."},
    {"tumour_content", "Place the needle so that the part that cuts lies in the tumour from end to end."},
    {"wall_punctures", "Go through the wall of the cyst once, and stay inside it."},
}};

std::string value_text(const training::ScoreLine& line) {
  if (!line.value || !std::isfinite(*line.value)) return "";
  const std::string unit = line.unit == "mm2" ? "mm²" : line.unit;
  if (unit.empty()) return fmt::format("{:.0f}", *line.value);
  return fmt::format("{:.{}f} {}", *line.value, std::abs(*line.value) >= 100 ? 0 : 1, unit);
}

double lost(const training::ScoreLine& line) {
  return line.most - line.points;
}

/// That which failed first, then that which lost most.
bool worse(const training::ScoreLine& a, const training::ScoreLine& b) {
  return a.failed != b.failed ? a.failed : lost(a) > lost(b);
}

}  // namespace

std::string advice(const training::Score& score) {
  if (!score.done) {
    return "There is nothing to give points for: bring the needle to the target and do what the briefing asks.";
  }
  const auto worst = std::ranges::min_element(score.lines, worse);
  if (worst == score.lines.end() || (!worst->failed && lost(*worst) < 1)) {
    return "Nothing lost a point worth a word: do it again a little faster.";
  }
  const auto known = std::ranges::find(kAdvice, worst->criterion.metric, [](const auto& row) { return row.first; });
  if (known != kAdvice.end()) return std::string(known->second);
  return fmt::format("Most points were lost by: {}.", worst->title);
}

Ending ending_of(const training::TrainingReport& report, const std::string& result_in_words) {
  Ending ending{.verdict = "The session is over"};
  for (std::size_t at = 0; at < result_in_words.size();) {
    const std::size_t end = std::min(result_in_words.find('\n', at), result_in_words.size());
    if (end > at) ending.result.push_back(result_in_words.substr(at, end - at));
    at = end + 1;
  }
  if (!report.score) return ending;
  const training::Score& score = *report.score;
  ending.score = score.total;
  ending.pass_mark = score.pass_mark;
  ending.passed = score.passed;
  ending.verdict = !score.done ? "Nothing was sampled or treated" : score.passed ? "Passed" : "Not passed";
  ending.wanted = fmt::format("of 100; {:.0f} are to be reached", score.pass_mark);
  ending.advice = advice(score);
  std::vector<training::ScoreLine> lines = score.lines;
  std::ranges::stable_sort(lines, worse);
  for (const training::ScoreLine& line : lines) {
    ending.lines.push_back({line.title, value_text(line), line.points, line.most, line.failed});
  }
  return ending;
}

void translate(Ending& ending, const content::Texts& texts) {
  for (std::string* text : {&ending.verdict, &ending.wanted, &ending.advice, &ending.doing, &ending.note}) {
    *text = texts.of(*text);
  }
  for (EndingLine& line : ending.lines) line.title = texts.of(line.title);
  for (std::string& line : ending.result) line = texts.of(line);
}

}  // namespace stylet::panels

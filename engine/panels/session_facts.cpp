#include "engine/panels/session_facts.h"

#include <string_view>

namespace stylet::panels {
namespace {

constexpr std::string_view kNotNow = "Not now";

std::vector<std::string> paragraphs(const content::Briefing& briefing) {
  std::vector<std::string> all;
  if (!briefing.goal.empty()) all.push_back(briefing.goal);
  for (std::size_t i = 0; i < briefing.steps.size(); ++i) {
    all.push_back(std::to_string(i + 1) + ". " + briefing.steps[i]);
  }
  if (!briefing.anatomy.empty()) all.push_back(briefing.anatomy);
  return all;
}

std::string refused(std::string_view not_now, const std::string& reason) {
  return std::string(not_now) + ": " + reason + ".";
}

/// A refusal with its reason, or what to do.
std::string translated_prompt(const std::string& prompt, const content::Texts& texts) {
  const std::string begin = std::string(kNotNow) + ": ";
  if (!prompt.starts_with(begin) || !prompt.ends_with('.')) return texts.of(prompt);
  return refused(texts.of(kNotNow), texts.of(prompt.substr(begin.size(), prompt.size() - begin.size() - 1)));
}

}  // namespace

SessionFacts facts_of(const content::Scene& scene, const training::TrainingSession* session) {
  const std::string& title = scene.title.empty() ? scene.name : scene.title;
  SessionFacts facts{.title = title.substr(0, title.find(':'))};
  if (session == nullptr) return facts;
  const training::FlowState& course = session->state();
  facts.stage = training::stage_name(course.stage);
  facts.prompt = course.refusal.empty() ? course.prompt : refused(kNotNow, course.refusal);
  facts.hint = course.hint;
  facts.paused = course.paused;
  if (const int tissue = session->tip_tissue(); tissue > 0) facts.tissue = scene.tissues[tissue].name;
  if (course.stage == training::Stage::briefing) facts.briefing = paragraphs(scene.exercise.briefing);
  return facts;
}

void translate(SessionFacts& facts, const content::Texts& texts) {
  for (std::string* text : {&facts.title, &facts.stage, &facts.hint, &facts.breath, &facts.tissue}) {
    *text = texts.of(*text);
  }
  facts.prompt = translated_prompt(facts.prompt, texts);
  for (std::string& paragraph : facts.briefing) paragraph = texts.of(paragraph);
  for (Warning& warning : facts.warnings) warning.text = texts.of(warning.text);
}

}  // namespace stylet::panels

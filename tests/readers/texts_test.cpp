// The German catalogue: it reads, it has what the shipped scenarios say, its numbers land where they belong.
#include "engine/readers/texts_file.h"

#include "engine/files/error.h"
#include "engine/readers/scenario.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <map>
#include <string>

namespace stylet::readers {
namespace {

TEST(Texts, AreFoundByTheSentenceItsNumbersOrBehindTheNumberOfAList) {
  const content::Texts texts(std::map<std::string, std::string, std::less<>>{
      {"Stop.", "Halt."}, {"core {} at {} s", "bei {}: {}"}, {"A ball of 23 mm.", "Eine Kugel von 23 mm."}});
  EXPECT_EQ(texts.of("Stop."), "Halt.");
  EXPECT_EQ(texts.of("2. Stop."), "2. Halt.");
  EXPECT_EQ(texts.of("core 1 at 12.5 s"), "bei 1: 12.5");
  EXPECT_EQ(texts.of("3. A ball of 23 mm."), "3. Eine Kugel von 23 mm.");
  EXPECT_EQ(texts.of("A ball of 24 mm."), "A ball of 24 mm.") << "another sentence";
  EXPECT_EQ(texts.of("12."), "12.");
  EXPECT_EQ(texts.of(""), "");
  EXPECT_EQ(content::Texts().of("Stop."), "Stop.");
}

TEST(Texts, GermanHasWhatTheShippedScenariosSay) {
  const content::Texts german = find_texts("de");
  for (const ScenarioEntry& entry : list_scenarios(content_directory() / "scenarios")) {
    std::ifstream file(entry.path);
    const auto scenario = nlohmann::json::parse(file);
    const auto expect = [&](const std::string& english) {
      EXPECT_NE(german.of(english), english) << entry.name << ": content/texts/de.json lacks it";
    };
    const auto& briefing = scenario["briefing"];
    expect(briefing["goal"]);
    expect(briefing["anatomy"]);
    for (const auto& step : briefing["steps"]) expect(step);
    for (const auto& hint : scenario["hints"]) expect(hint["text"]);
  }
}

TEST(Texts, GermanSaysWhatACoreHolds) {
  EXPECT_EQ(find_texts("de").of("core 1: 17 mm, 82 % target"), "Zylinder 1: 17 mm, 82 % Ziel");
}

TEST(Texts, ALanguageThatIsNotThereIsRefusedWithThoseThatAre) {
  EXPECT_EQ(find_texts("en").of("Pause"), "Pause");
  EXPECT_EQ(language_name("de"), "Deutsch");
  try {
    find_texts("xx");
    FAIL();
  } catch (const files::ContentError& error) {
    EXPECT_NE(std::string(error.what()).find("de, en"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace stylet::readers

#include "engine/app/stylus.h"

#include "engine/files/error.h"
#include "engine/readers/scenario.h"
#include "tests/readers/small_scenario.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace stylet::app {
namespace {

using ::testing::HasSubstr;

class Styluses : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    const readers::test::SmallScenario files;
    scene_ = new content::Scene(readers::load_scene(files.write()));
  }
  static void TearDownTestSuite() { delete scene_; }

  std::string refused(const std::string& description) const {
    try {
      open_stylus(description, *scene_);
      return {};
    } catch (const files::ContentError& error) {
      return error.what();
    }
  }

  static inline content::Scene* scene_ = nullptr;
};

TEST_F(Styluses, OfTheTableNeedNoDeviceUnlessTheyAreOne) {
  for (const StylusKind& kind : stylus_kinds()) {
    if (kind.in_real_time_only || *kind.argument != '\0') continue;
    const Stylus stylus = open_stylus(kind.name, *scene_);
    EXPECT_EQ(stylus.kind, &kind) << kind.name;
    EXPECT_EQ(std::isinf(stylus.duration_s), stylus.held()) << kind.name << ": who holds it ends the session";
    EXPECT_EQ(stylus.input.mouse != nullptr, kind.need == StylusNeed::window) << kind.name;
    EXPECT_EQ(stylus.input.hand != nullptr, kind.need == StylusNeed::headset) << kind.name;
    EXPECT_EQ(stylus.input.tracked != nullptr, kind.need == StylusNeed::link) << kind.name;
    EXPECT_TRUE(stylus.device->status().connected) << kind.name;
  }
}

TEST_F(Styluses, AreAllInTheHelp) {
  for (const StylusKind& kind : stylus_kinds()) {
    EXPECT_THAT(stylus_help(), HasSubstr(kind.name));
    EXPECT_THAT(stylus_help(), HasSubstr(kind.help));
  }
}

TEST_F(Styluses, WithoutANamePlayTheScenariosOwnMotion) {
  EXPECT_TRUE(open_stylus("", *scene_).own_motion);
  EXPECT_EQ(open_stylus("", *scene_).duration_s, 1);
}

TEST_F(Styluses, WithAMistypedNameSayWhichWasMeant) {
  EXPECT_THAT(refused("mosue"), HasSubstr("did you mean \"mouse\"?"));
  EXPECT_THAT(
      refused("mosue"),
      HasSubstr("there is hid, hid:VID:PID, haply, haply:ID, force_dimension, "
                "force_dimension:ID, openhaptics, openhaptics:ID, mouse, hand, link, recorded, recorded:FILE and "
                "scripted"));
  EXPECT_THAT(refused("mouse:left"), HasSubstr("--device mouse:left: there is hid"));
  EXPECT_THAT(refused("recorded:"), HasSubstr("recorded:FILE"));
  EXPECT_THAT(refused("hid:12"), HasSubstr("--device hid:12: is not VID:PID"));
}

}  // namespace
}  // namespace stylet::app

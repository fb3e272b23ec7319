// The commands as somebody runs them who has the libraries of Force Dimension and of 3D Systems.
#include "tests/stylet/command.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vendor/mock_device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cstdlib>

namespace stylet {
namespace {

using support::MockDevice;
using ::testing::HasSubstr;

class HostCommand : public testing::Test {
protected:
  HostCommand() {
    setenv("STYLET_MOCK_DEVICE", (folder.path() / "device").c_str(), 1);
    setenv("STYLET_DHD_LIBRARY", STYLET_MOCK_DHD, 1);
    setenv("STYLET_HD_LIBRARY", STYLET_MOCK_HD, 1);
    mock = support::mock_device();
    mock->reset();
  }
  ~HostCommand() override {
    for (const char* name : {"STYLET_MOCK_DEVICE", "STYLET_DHD_LIBRARY", "STYLET_HD_LIBRARY"}) unsetenv(name);
    munmap(mock, sizeof(MockDevice));
  }

  support::TemporaryFolder folder;
  MockDevice* mock = nullptr;
};

TEST_F(HostCommand, DevicesSayWhatTheyAreAndWhatTheyNeed) {
  std::string said = run("devices").output;
  EXPECT_THAT(said, HasSubstr("force_dimension:4711  1451:0000  omega.6 (Force Dimension)"));
  EXPECT_THAT(said, HasSubstr("profile \"Force Dimension omega\""));
  EXPECT_THAT(said, HasSubstr("limits     12 N, 3 N for ever"));
  EXPECT_THAT(said, HasSubstr("openhaptics:0815  2988:0000  Touch (3D Systems)"));
  EXPECT_THAT(said, HasSubstr("limits     3.3 N, 0.88 N for ever"));
  EXPECT_THAT(said, HasSubstr("state      ready"));
  mock->devices = 0;
  said = run("devices").output;
  EXPECT_THAT(said, HasSubstr("force_dimension\n  not usable: no Force Dimension device and no Falcon is connected"));
  EXPECT_THAT(said, HasSubstr("openhaptics\n  not usable: no device of 3D Systems can be opened"));
  unsetenv("STYLET_DHD_LIBRARY");
  EXPECT_EQ(run("devices").output.find("force_dimension"), std::string::npos)
      << "who has no library hears nothing of it";
}

TEST_F(HostCommand, TrainIsLedByThem) {
  for (const char* kind : {"force_dimension", "openhaptics"}) {
    mock->reset();
    const Outcome said =
        run(fmt::format("train tutorial --view headless --expert none --no-film --device {} --seconds 2 --out '{}'",
                        kind, (folder.path() / kind).string()));
    ASSERT_EQ(said.exit_code, 0) << said.output;
    EXPECT_GT(mock->calls, 1000u) << kind;
    EXPECT_EQ(mock->broken, 0u) << kind;
    EXPECT_EQ(mock->open, 0) << kind;
    EXPECT_EQ(mock->applied(), 0) << kind;
  }
}

TEST_F(HostCommand, WithoutTheLibraryItIsSaidWhatToDo) {
  unsetenv("STYLET_DHD_LIBRARY");
  setenv("HOME", folder.path().c_str(), 1);
  const Outcome said = run("train tutorial --device force_dimension");
  EXPECT_EQ(said.exit_code, 2) << said.output;
  EXPECT_THAT(said.output, HasSubstr("--device force_dimension: the library of Force Dimension is not installed"));
  EXPECT_EQ(said.lines(), 1) << said.output;
}

}  // namespace
}  // namespace stylet

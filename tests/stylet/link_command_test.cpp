// `stylet train --link` as 3D Slicer meets it: the command in a process of its own, the library's client in this one.
#include "tests/link/igtl_client.h"
#include "tests/readers/small_scenario.h"
#include "tests/stylet/running_command.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>

#include <map>

namespace stylet {
namespace {

using ::testing::HasSubstr;

class LinkCommand : public ::testing::Test {
protected:
  LinkCommand() {
    small_.scenario["labels"]["spacing_mm"] = 4;
    small_.write();
  }
  std::string train() const {
    return fmt::format("train {} --view headless --no-film --out {} ", small_.path().string(), out().string());
  }
  fs::path out() const { return folder_ / "out"; }

  support::TemporaryFolder folder_;
  readers::test::SmallScenario small_;
};

TEST_F(LinkCommand, AClientSeesTheSessionAndItsTrackerLeadsTheNeedle) {
  RunningCommand command(train() + "--link 0 --device link --seconds 600");
  const std::string place = command.wait_for("clients connect to 127.0.0.1:");
  ASSERT_FALSE(place.empty()) << command.output();
  tests::IgtlClient client;
  ASSERT_TRUE(client.connect(std::stoi(place)));
  // The tracked hub goes 3 mm along its axis; what the session shows follows.
  std::map<std::string, tests::ClientMessage> seen;
  Eigen::Matrix4d led;
  Eigen::Vector3d begin;
  double farthest = 0;
  while (farthest < 2.9 || !seen.contains("Image_Reference") || !seen.contains("Stylet")) {
    tests::ClientMessage message = client.receive();
    ASSERT_FALSE(message.type.empty()) << command.output();
    if (message.device == "NeedleToReference") {
      if (!seen.contains(message.device)) {
        led = message.matrix;
        begin = led.topRightCorner<3, 1>();
        led.topRightCorner<3, 1>() += 3 * led.block<3, 1>(0, 2);
      }
      farthest = std::max(farthest, (message.matrix.topRightCorner<3, 1>() - begin).norm());
      ASSERT_TRUE(client.send_transform("NeedleToReference", led));
    }
    seen[message.device] = std::move(message);
  }
  client.close();
  command.interrupt();
  EXPECT_EQ(command.end(), 0) << command.output();
  EXPECT_NEAR(farthest, 3, 0.1) << "mm";
  for (const char* name :
       {"Image_Reference", "ProbeToReference", "NeedleToReference", "NeedleTipToReference", "Stylet"})
    EXPECT_TRUE(seen.contains(name)) << name;
  const tests::ClientMessage& image = seen["Image_Reference"];
  EXPECT_EQ(image.type, "IMAGE");
  EXPECT_EQ(image.pixels.size(), static_cast<std::size_t>(image.size.prod()));
  EXPECT_GT(std::ranges::count_if(image.pixels, [](std::uint8_t pixel) { return pixel > 40; }), 1000);
  EXPECT_THAT(command.output(), HasSubstr("OpenIGTLink: 1 clients; sent "));
  EXPECT_THAT(read_text(out() / "session.json"), HasSubstr("\"identical\": true"));
}

TEST_F(LinkCommand, AClientTurnsTheScannersKnobs) {
  RunningCommand command(train() + "--link 0 --device link --seconds 600");
  const std::string place = command.wait_for("clients connect to 127.0.0.1:");
  ASSERT_FALSE(place.empty()) << command.output();
  tests::IgtlClient client;
  ASSERT_TRUE(client.connect(std::stoi(place)));
  const auto answer = [&](const std::string& number, const char* text) {
    auto message = igtl::StringMessage::New();
    message->SetDeviceName(("CMD_" + number).c_str());
    message->SetString(text);
    client.send(*message);
    return client.receive("ACK_" + number).text;
  };
  EXPECT_EQ(answer("1", "scanner gain +2"), R"(<CommandReply Status="SUCCESS" Message="done" />)");
  EXPECT_EQ(answer("2", R"(<Command Name="SetUsParameter"><Parameter Name="DepthMm" Value="999"/></Command>)"),
            R"(<CommandReply Status="SUCCESS" Message="depth limited to 300 mm" />)");
  EXPECT_THAT(answer("3", "scanner volume 11"), HasSubstr("FAIL\" Message=\"the scanner has depth, gain, "));
  client.close();
  command.interrupt();
  EXPECT_EQ(command.end(), 0) << command.output();
  EXPECT_THAT(command.output(), HasSubstr("OpenIGTLink: 2 commands done, 1 not"));
}

TEST_F(LinkCommand, RefusesWhatCannotBe) {
  const auto refused = [&](const std::string& more, const char* words) {
    const Outcome outcome = run(train() + more);
    EXPECT_EQ(outcome.exit_code, 2) << more;
    EXPECT_THAT(outcome.output, HasSubstr(words));
  };
  refused("--device link", "--device link: its poses come over --link or --link-from HOST:PORT");
  refused("--lockstep --link", "leave one of --lockstep and --link out");
  if (support::kSanitized) return;
  refused("--link 99999", "--link 99999: is no port");
  refused("--link --link-address 203.0.113.1", "203.0.113.1");
}

}  // namespace
}  // namespace stylet

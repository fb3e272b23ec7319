// The comparator must see what a wrong pass does to a picture and forgive what another CPU's last bits do.
#include "tests/support/image_compare.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

namespace stylet::tests {
namespace {

using picture::Picture;

/// Smooth shading with fine speckle over it, like an ultrasound image.
Picture speckled() {
  Picture picture(320, 240);
  std::mt19937 random(7);
  std::uniform_int_distribution<int> speckle(-40, 40);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      for (int c = 0; c < 3; ++c)
        picture.at(x, y)[c] =
            static_cast<std::uint8_t>(120 + 60 * std::sin(0.02 * x) * std::cos(0.03 * y) + speckle(random));
  return picture;
}

TEST(ImageCompare, IdenticalPicturesPass) {
  const Difference difference = compare(speckled(), speckled());
  EXPECT_EQ(difference.largest, 0);
  EXPECT_NEAR(difference.ssim, 1, 1e-9);
  EXPECT_TRUE(difference.passes());
}

TEST(ImageCompare, LastBitsOfAFewPixelsAreForgiven) {
  Picture other = speckled();
  for (int i = 0; i < 200; ++i) other.at(i, i)[0] ^= 1;
  EXPECT_TRUE(compare(speckled(), other).passes());
}

/// Every fifteenth value up or down by a level.
Picture rounded_otherwise(bool both_ways) {
  Picture picture = speckled();
  std::mt19937 random(11);
  for (std::size_t i = 0; i < picture.rgba.size(); ++i) {
    if (i % 4 == 3 || random() % 15 != 0) continue;
    const bool up = !both_ways || random() % 2 == 0;
    picture.rgba[i] = static_cast<std::uint8_t>(picture.rgba[i] + (up ? 1 : -1));
  }
  return picture;
}

TEST(ImageCompare, RoundingOfAnotherCpuIsForgivenUnlessItIsAllOneWay) {
  EXPECT_TRUE(compare(speckled(), rounded_otherwise(true)).passes());
  EXPECT_FALSE(compare(speckled(), rounded_otherwise(false)).passes());
}

TEST(ImageCompare, OneLevelOfOneColourInAPatchFails) {
  Picture tinted = speckled();
  for (int y = 100; y < 132; ++y)
    for (int x = 100; x < 140; ++x) ++tinted.at(x, y)[2];
  EXPECT_FALSE(compare(speckled(), tinted).passes());
}

TEST(ImageCompare, ShiftOfOnePixelFails) {
  const Picture original = speckled();
  Picture shifted = original;
  for (int y = 0; y < original.height; ++y)
    for (int x = 1; x < original.width; ++x)
      for (int c = 0; c < 4; ++c) shifted.at(x, y)[c] = original.at(x - 1, y)[c];
  EXPECT_FALSE(compare(original, shifted).passes());
}

TEST(ImageCompare, GainErrorOfTwoPercentFails) {
  Picture brighter = speckled();
  for (auto& value : brighter.rgba) value = static_cast<std::uint8_t>(std::min(255.0, std::round(value * 1.02)));
  EXPECT_FALSE(compare(speckled(), brighter).passes());
}

TEST(ImageCompare, OneVeryWrongPixelFails) {
  Picture other = speckled();
  other.at(100, 100)[1] = static_cast<std::uint8_t>(other.at(100, 100)[1] ^ 0x80);
  EXPECT_FALSE(compare(speckled(), other).passes());
}

TEST(ImageCompare, MissingGoldenFailsAndSaysHowToMakeIt) {
  if (std::getenv("STYLET_UPDATE_GOLDEN") != nullptr) GTEST_SKIP() << "would write the golden that must not exist";
  const auto result = matches_golden({}, speckled(), "there_is_no_such_golden");
  EXPECT_FALSE(result);
  EXPECT_NE(std::string(result.message()).find("STYLET_UPDATE_GOLDEN=1"), std::string::npos);
}

TEST(ImageCompare, PngKeepsEveryByte) {
  const support::TemporaryFolder folder;
  const auto file = folder / "speckled.png";
  Picture picture = speckled();
  for (std::size_t i = 3; i < picture.rgba.size(); i += 4) picture.rgba[i] = static_cast<std::uint8_t>(i / 4);
  picture::write_png(file, picture);
  EXPECT_EQ(picture::read_png(file).rgba, picture.rgba);
  std::filesystem::remove(file);
  EXPECT_THROW(picture::read_png(file), std::runtime_error);
}

}  // namespace
}  // namespace stylet::tests

// PNG files of data sets, read back by another library.
#include "engine/picture/png_bytes.h"

#include "tests/support/temporary_folder.h"

#include <stb_image.h>

#include <gtest/gtest.h>

#include <memory>

namespace stylet::picture {
namespace {

const unsigned char* bytes(const std::string& file) {
  return reinterpret_cast<const unsigned char*>(file.data());
}

TEST(PngBytes, GreyOf8And16BitsComesBack) {
  const int width = 37;
  const int height = 11;
  std::vector<std::uint8_t> narrow;
  std::vector<std::uint16_t> wide;
  for (int i = 0; i < width * height; ++i) {
    narrow.push_back(static_cast<std::uint8_t>(i * 7));
    wide.push_back(static_cast<std::uint16_t>(i * 161));
  }
  int w = 0, h = 0, channels = 0;
  const std::string file8 = png_bytes(width, height, narrow);
  const std::unique_ptr<stbi_uc, void (*)(void*)> read8(
      stbi_load_from_memory(bytes(file8), int(file8.size()), &w, &h, &channels, 0), stbi_image_free);
  ASSERT_NE(read8, nullptr) << stbi_failure_reason();
  EXPECT_EQ(std::tie(w, h, channels), std::make_tuple(width, height, 1));
  EXPECT_EQ(std::vector<std::uint8_t>(read8.get(), read8.get() + narrow.size()), narrow);

  const std::string file16 = png_bytes(width, height, wide);
  EXPECT_EQ(stbi_is_16_bit_from_memory(bytes(file16), int(file16.size())), 1);
  const std::unique_ptr<stbi_us, void (*)(void*)> read16(
      stbi_load_16_from_memory(bytes(file16), int(file16.size()), &w, &h, &channels, 0), stbi_image_free);
  ASSERT_NE(read16, nullptr) << stbi_failure_reason();
  EXPECT_EQ(std::tie(w, h, channels), std::make_tuple(width, height, 1));
  EXPECT_EQ(std::vector<std::uint16_t>(read16.get(), read16.get() + wide.size()), wide);
}

TEST(PngBytes, ColourComesBack) {
  Picture picture(9, 4);
  for (std::size_t i = 0; i < picture.rgba.size(); ++i) {
    if (i % 4 != 3) picture.rgba[i] = static_cast<std::uint8_t>(i * 13);
  }
  const support::TemporaryFolder folder;
  EXPECT_EQ(read_png(folder.write("colour.png", png_bytes(picture))).rgba, picture.rgba);
}

}  // namespace
}  // namespace stylet::picture

// Golden images: does a rendered picture still look as it did when someone looked at it?
//
//   TEST(Renderer, DrawsTheTestScene) {
//     if (const auto why = no_golden_for(device)) GTEST_SKIP() << *why;
//     EXPECT_TRUE(matches_golden(device, picture, "render_scene"));
//   }
//
// STYLET_UPDATE_GOLDEN=1 writes tests/golden/NAME.png instead of comparing. Look at it before committing.
#pragma once

#include "engine/gpu/device.h"
#include "engine/picture/picture.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace stylet::tests {

/// How two pictures of one size differ, over R, G, B. A pixel's difference is its largest channel difference.
struct Difference {
  double above_1 = 0;   ///< share of pixels that differ by more than one level
  double above_3 = 0;   ///< share that differ by more than 3 levels
  int largest = 0;      ///< levels
  double coherent = 0;  ///< levels that neighbours differ by alike: rms of a channel's mean over 8 x 8 windows
  double ssim = 1;      ///< mean structural similarity of the luma, 8 x 8 windows

  /// Room for another CPU, none for a wrong picture. Mesa's rasteriser makes sRGB with the CPU's estimate of 1/sqrt,
  /// which no two families have alike: 3 % of the pixels round the other way, either way, so `coherent` is 0.014
  /// between two of them. An error of gain or colour by one level in a four-hundredth of the picture gives 0.05; the
  /// largest difference and SSIM (0.9999) would miss that.
  bool passes() const {
    return above_1 <= 0.01 && coherent <= 0.05 && above_3 <= 0.0005 && largest <= 16 && ssim >= 0.998;
  }
  std::string text() const;
};

/// @throws std::invalid_argument if the sizes differ
Difference compare(const picture::Picture& expected, const picture::Picture& actual);

/// Reason to skip: goldens hold for Mesa's software rasteriser alone.
std::optional<std::string> no_golden_for(const gpu::DeviceIdentity& device);

/// Compares with tests/golden/NAME.png. On failure writes NAME.actual.png and NAME.diff.png (|difference| x 16) into
/// golden/ of the build and says where, with the device and driver.
testing::AssertionResult matches_golden(const gpu::DeviceIdentity& device, const picture::Picture& actual,
                                        const std::string& name);

}  // namespace stylet::tests

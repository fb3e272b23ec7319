#include "tests/support/image_compare.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace stylet::tests {

namespace {

using picture::Picture;

double luma(const std::uint8_t* p) {
  return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
}

/// Wang et al. 2004, "Image quality assessment": one window of kWindow^2 pixels.
constexpr int kWindow = 8;
double window_ssim(const Picture& a, const Picture& b, int x0, int y0) {
  double sum_a = 0, sum_b = 0, sum_aa = 0, sum_bb = 0, sum_ab = 0;
  for (int y = y0; y < y0 + kWindow; ++y) {
    for (int x = x0; x < x0 + kWindow; ++x) {
      const double va = luma(a.at(x, y));
      const double vb = luma(b.at(x, y));
      sum_a += va;
      sum_b += vb;
      sum_aa += va * va;
      sum_bb += vb * vb;
      sum_ab += va * vb;
    }
  }
  constexpr double n = kWindow * kWindow;
  constexpr double c1 = 0.01 * 255 * 0.01 * 255;
  constexpr double c2 = 0.03 * 255 * 0.03 * 255;
  const double mean_a = sum_a / n, mean_b = sum_b / n;
  const double var_a = sum_aa / n - mean_a * mean_a, var_b = sum_bb / n - mean_b * mean_b;
  const double covariance = sum_ab / n - mean_a * mean_b;
  return (2 * mean_a * mean_b + c1) * (2 * covariance + c2) /
         ((mean_a * mean_a + mean_b * mean_b + c1) * (var_a + var_b + c2));
}

/// Sum over the channels of the squared mean difference in a window.
double window_bias(const Picture& a, const Picture& b, int x0, int y0) {
  double squares = 0;
  for (int c = 0; c < 3; ++c) {
    int sum = 0;
    for (int y = y0; y < y0 + kWindow; ++y) {
      for (int x = x0; x < x0 + kWindow; ++x) sum += b.at(x, y)[c] - a.at(x, y)[c];
    }
    const double mean = sum / double(kWindow * kWindow);
    squares += mean * mean;
  }
  return squares;
}

int pixel_difference(const std::uint8_t* a, const std::uint8_t* b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

Picture magnified_difference(const Picture& a, const Picture& b) {
  Picture out(a.width, a.height);
  for (std::size_t i = 0; i < out.rgba.size(); ++i)
    if (i % 4 != 3) out.rgba[i] = static_cast<std::uint8_t>(std::min(255, 16 * std::abs(a.rgba[i] - b.rgba[i])));
  return out;
}

}  // namespace

std::string Difference::text() const {
  return fmt::format(
      "{:.3f} % of the pixels differ by more than 1 level (limit 1), {:.4f} % by more than 3 (limit 0.05), largest "
      "{} "
      "(limit 16), neighbours alike by {:.3f} levels (limit 0.05), SSIM {:.5f} (limit 0.998)",
      100 * above_1, 100 * above_3, largest, coherent, ssim);
}

Difference compare(const Picture& expected, const Picture& actual) {
  if (expected.width != actual.width || expected.height != actual.height)
    throw std::invalid_argument(fmt::format("pictures of {}x{} and {}x{} cannot be compared", expected.width,
                                            expected.height, actual.width, actual.height));
  Difference difference;
  std::size_t above_1 = 0, above_3 = 0;
  for (std::size_t i = 0; i < expected.rgba.size(); i += 4) {
    const int d = pixel_difference(&expected.rgba[i], &actual.rgba[i]);
    above_1 += d > 1 ? 1 : 0;
    above_3 += d > 3 ? 1 : 0;
    difference.largest = std::max(difference.largest, d);
  }
  const double pixels = std::max<double>(1, expected.width * static_cast<double>(expected.height));
  difference.above_1 = static_cast<double>(above_1) / pixels;
  difference.above_3 = static_cast<double>(above_3) / pixels;
  double sum = 0, bias = 0;
  int windows = 0;
  for (int y = 0; y + kWindow <= expected.height; y += kWindow / 2) {
    for (int x = 0; x + kWindow <= expected.width; x += kWindow / 2) {
      sum += window_ssim(expected, actual, x, y);
      bias += window_bias(expected, actual, x, y);
      ++windows;
    }
  }
  if (windows > 0) difference.coherent = std::sqrt(bias / (3 * windows));
  difference.ssim = windows > 0 ? sum / windows : (difference.largest == 0 ? 1 : 0);
  return difference;
}

std::optional<std::string> no_golden_for(const gpu::DeviceIdentity& device) {
  if (device.is_lavapipe()) return std::nullopt;
  return fmt::format("golden images hold for lavapipe only; this is {} ({})", device.name, device.driver);
}

testing::AssertionResult matches_golden(const gpu::DeviceIdentity& device, const Picture& actual,
                                        const std::string& name) {
  const std::filesystem::path golden = std::filesystem::path(STYLET_GOLDEN_DIR) / (name + ".png");
  const char* update = std::getenv("STYLET_UPDATE_GOLDEN");
  if (update != nullptr && std::string(update) == "1") {
    picture::write_png(golden, actual);
    fmt::print("wrote {}: look at it before committing\n", golden.string());
    return testing::AssertionSuccess();
  }
  const std::filesystem::path folder = STYLET_GOLDEN_FAILURES;
  std::filesystem::create_directories(folder);
  const auto keep = [&](const char* what, const Picture& picture) {
    const auto file = folder / (name + "." + what + ".png");
    picture::write_png(file, picture);
    return file.string();
  };
  if (!std::filesystem::exists(golden))
    return testing::AssertionFailure() << golden << " is missing; look at " << keep("actual", actual)
                                       << " and, if it is right, run again with STYLET_UPDATE_GOLDEN=1";
  const Picture expected = picture::read_png(golden);
  if (expected.width != actual.width || expected.height != actual.height)
    return testing::AssertionFailure() << name << " is " << actual.width << "x" << actual.height << ", its golden "
                                       << expected.width << "x" << expected.height << "; see "
                                       << keep("actual", actual);
  const Difference difference = compare(expected, actual);
  if (difference.passes()) return testing::AssertionSuccess();
  return testing::AssertionFailure() << name << ": " << difference.text() << "\n  on " << device.name << ", "
                                     << device.driver << "\n  see " << keep("actual", actual) << " and "
                                     << keep("diff", magnified_difference(expected, actual));
}

}  // namespace stylet::tests

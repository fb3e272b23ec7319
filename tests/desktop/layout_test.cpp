// The places of the panels in windows of every size: none lies on another, nothing leaves the window.
#include "engine/desktop/layout.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace stylet::desktop {
namespace {

struct Size {
  int width, height;
  double content_scale;
};
/// As the issue names them, laptops between them, a tall one, and displays whose user has chosen 200 %.
constexpr std::array kSizes{Size{1024, 640, 1},  Size{1280, 720, 1},  Size{1366, 768, 1},  Size{1024, 768, 1},
                            Size{1920, 1080, 1}, Size{2560, 1080, 1}, Size{1200, 1600, 1}, Size{2560, 1440, 1},
                            Size{3840, 2160, 1}, Size{3840, 2160, 2}, Size{2560, 1600, 2}, Size{2048, 1280, 2}};
constexpr double kFont = 15;  // pixels at scale 1

bool overlap(const picture::Pane& a, const picture::Pane& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

std::vector<std::pair<std::string, picture::Pane>> shown(const Layout& layout) {
  std::vector<std::pair<std::string, picture::Pane>> panes;
  for (const auto& [name, pane] : {std::pair{"ultrasound", layout.ultrasound},
                                   {"course", layout.course},
                                   {"force", layout.force},
                                   {"scanner", layout.scanner},
                                   {"instructor", layout.instructor},
                                   {"middle", layout.middle}}) {
    if (pane.width > 0 && pane.height > 0) panes.emplace_back(name, pane);
  }
  return panes;
}

TEST(Layout, NoPanelLiesOnAnotherOrLeavesTheWindow) {
  for (const auto& [width, height, content_scale] : kSizes) {
    const double em = kFont * text_scale(width, height, content_scale);
    for (int open = 0; open < 16; ++open) {
      const OpenPanels panels{.force = (open & 1) != 0,
                              .scanner = (open & 2) != 0,
                              .instructor = (open & 4) != 0,
                              .briefing = (open & 8) != 0};
      const auto panes = shown(layout_of(width, height, em, panels));
      const std::string where =
          std::to_string(width) + "x" + std::to_string(height) + " with " + std::to_string(open);
      EXPECT_EQ(panes.size(), 2U + panels.force + panels.scanner + panels.instructor + panels.briefing) << where;
      for (std::size_t i = 0; i < panes.size(); ++i) {
        const picture::Pane& pane = panes[i].second;
        EXPECT_TRUE(pane.x >= 0 && pane.y >= 0 && pane.x + pane.width <= width && pane.y + pane.height <= height)
            << panes[i].first << " leaves " << where;
        for (std::size_t k = 0; k < i; ++k) {
          EXPECT_FALSE(overlap(pane, panes[k].second))
              << panes[i].first << " on " << panes[k].first << " in " << where;
        }
      }
    }
  }
}

TEST(Layout, ForLeftHandsIsTheMirrorImage) {
  for (const auto& [width, height, content_scale] : kSizes) {
    const double em = kFont * text_scale(width, height, content_scale);
    for (int open = 0; open < 32; ++open) {
      OpenPanels panels{.force = (open & 1) != 0,
                        .scanner = (open & 2) != 0,
                        .instructor = (open & 4) != 0,
                        .briefing = (open & 8) != 0,
                        .ending = (open & 16) != 0};
      const auto right = shown(layout_of(width, height, em, panels));
      panels.left_handed = true;
      const auto left = shown(layout_of(width, height, em, panels));
      ASSERT_EQ(left.size(), right.size());
      for (std::size_t i = 0; i < left.size(); ++i) {
        const picture::Pane &a = left[i].second, &b = right[i].second;
        EXPECT_EQ(a.x, width - b.x - b.width) << left[i].first;
        EXPECT_TRUE(a.y == b.y && a.width == b.width && a.height == b.height) << left[i].first;
      }
    }
  }
}

TEST(Layout, LeavesEveryPanelRoomForWhatItSays) {
  for (const auto& [width, height, content_scale] : kSizes) {
    const double em = kFont * text_scale(width, height, content_scale);
    const Layout layout = layout_of(width, height, em, {.scanner = true, .instructor = true, .briefing = true});
    const std::string where = std::to_string(width) + "x" + std::to_string(height);
    EXPECT_GE(layout.ultrasound.height, height / 4) << where;
    EXPECT_GE(layout.scanner.height, 19 * em) << where;
    EXPECT_GE(layout.instructor.height, 16 * em) << where;
    EXPECT_GE(layout.course.height, 12 * em) << where;
    EXPECT_GE(layout.middle.width, 20 * em) << where;
    EXPECT_FALSE(overlap(layout.needle, layout.course)) << where;
    EXPECT_FALSE(overlap(layout.needle, layout.ultrasound)) << where;
    EXPECT_FALSE(overlap(layout.needle, layout.force)) << where;
  }
}

TEST(Layout, TextsScaleWithTheDisplay) {
  EXPECT_EQ(text_scale(1280, 720, 1), 1);
  EXPECT_EQ(text_scale(2560, 1440, 2), 2);
  EXPECT_EQ(text_scale(3840, 2160, 2), 3);
  EXPECT_EQ(text_scale(1920, 1080, 1), 1.5);
  EXPECT_EQ(text_scale(3840, 2160, 1), 1.5) << "a display of usual density has more room, not larger letters";
  EXPECT_EQ(text_scale(1024, 640, 1), 0.8);
}

}  // namespace
}  // namespace stylet::desktop

// A debrief by hand: a needle that goes in along a line, stops, and comes out, with texts as hostile as users write.
#pragma once

#include "engine/debrief/debrief_data.h"
#include "engine/picture/png_bytes.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace stylet::tests {

/// Closes every element and attribute it may stand in, and runs as a script where it is taken for HTML.
inline constexpr const char* kHostile =
    "\"'></title></script><script>document.documentElement.dataset.hacked=1</script>"
    "<img src=x onerror=\"document.documentElement.dataset.hacked=1\">,\n&amp;";

inline std::vector<debrief::PathPoint> straight_path(int points, double sideways) {
  std::vector<debrief::PathPoint> path;
  for (int i = 0; i < points; ++i) {
    const double t = 10.0 * i / (points - 1);
    const double depth = 0.07 * std::clamp(std::min(t / 4, (10 - t) / 4), 0.0, 1.0) - 0.01;
    const bool inside = depth > 0;
    path.push_back({.time_s = t,
                    .tip = {sideways * std::sin(t), 0.002 * std::cos(3 * t), -depth},
                    .tissue = depth > 0.03 ? 2
                              : inside     ? 1
                                           : 0,
                    .inserted = std::max(depth, 0.0),
                    .force = inside ? 0.5 + depth * 10 : 0,
                    .axial = inside ? 0.5 + depth * 10 : 0,
                    .lateral = inside ? 0.2 * std::abs(std::sin(5 * t)) : 0,
                    .target_distance = std::abs(0.06 - depth)});
  }
  return path;
}

inline debrief::DebriefData sample_debrief(const std::string& title = "Liver biopsy") {
  debrief::DebriefData data;
  data.title = title;
  data.scenario = "liver_biopsy";
  data.build = "test";
  data.stylus = "recorded stylus";
  data.mode = "lockstep";
  data.duration_s = 10;
  data.score = debrief::DebriefScore{.total = 81.25, .pass_mark = 70, .passed = true};
  data.metrics = {
      {.key = "targeting",
       .title = "Distance to the target",
       .unit = "mm",
       .value = 1.23456789,
       .expert = 0.5,
       .definition = "tip to centre",
       .source = "Johnson 2012",
       .points = 40,
       .most_points = 50,
       .full = 1,
       .zero = 10,
       .critical = true},
      {.key = "skin_contacts",
       .title = "Skin contacts",
       .value = 2,
       .points = 41.25,
       .most_points = 50,
       .full = 1,
       .zero = 6},
      {.key = "path_length", .title = title, .unit = "mm", .value = 212.5, .expert = 180, .definition = title},
      {.key = "tumour_content", .title = "Tumour in the core", .unit = "%"}};
  using debrief::EventKind;
  data.events = {{0, EventKind::stage, "Procedure", ""},
                 {1, EventKind::puncture, "Into skin", "0.80 N"},
                 {2.5, EventKind::puncture, title, title},
                 {5, EventKind::stage, "Sampling", ""},
                 {5.2, EventKind::sample, "Biopsy fired", "core 1"},
                 {7, EventKind::safety, "Force limited", "max_force"}};
  data.tissues = {{"outside", {0.6F, 0.7F, 0.8F}}, {"fat", {0.9F, 0.7F, 0.3F}}, {title, {0.4F, 0.05F, 0.03F}}};
  data.path = straight_path(501, 0.004);
  data.expert = "expert motion";
  data.expert_path = straight_path(301, 0.001);
  data.arrival_s = 5;
  data.shaft = {{0, 0, 0.09}, {0, 0, 0.02}, {0, 0.001, -0.06}};
  data.targets = {{title, {0, 0, -0.06}, 0.01}};
  data.outlines = {{.name = title,
                    .colour = {0.6F, 0.2F, 0.1F},
                    .vertices = {{-0.04F, -0.04F, 0}, {0.04F, -0.04F, 0}, {0, 0.05F, 0}, {0, 0, -0.1F}},
                    .triangles = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}}};
  picture::Picture picture(32, 24, {90, 90, 90, 255});
  data.pictures = {{5.2, title, "needle at the target", picture::png_bytes(picture)}};
  data.eye = {0.3, -0.4, 0.2};
  data.up = {0, 0, 1};
  return data;
}

}  // namespace stylet::tests

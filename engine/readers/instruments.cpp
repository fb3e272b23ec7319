#include "engine/readers/instruments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::readers {

content::Needle read_needle(files::JsonFile& file) {
  files::JsonObject root = file.root("stylet-needle", 1);
  content::Needle needle;
  needle.name = root.text("name");
  needle.length = root.number("length_mm", {20, 400}) * 1e-3;
  const double outer_mm = root.number("outer_diameter_mm", {0.2, 5});
  const double inner_mm = root.number("inner_diameter_mm", {0, 5}, 0);
  if (inner_mm >= outer_mm) {
    root.problem("inner_diameter_mm",
                 fmt::format("is {:g}, not smaller than outer_diameter_mm ({:g})", inner_mm, outer_mm));
  }
  needle.outer_diameter = outer_mm * 1e-3;
  needle.inner_diameter = inner_mm * 1e-3;
  needle.young_modulus = root.number("young_modulus_pa", {1e6, 1e12});
  needle.poisson_ratio = root.number("poisson_ratio", {0, 0.49});
  needle.beams = root.integer("beams", 1, physics::kMaxBeams, needle.beams);
  needle.bevel_force_ratio = root.number("bevel_force_ratio", {0, 1}, 0);
  root.ignore("licence");
  root.ignore("source");
  root.finish();
  return needle;
}

content::Probe read_probe(files::JsonFile& file) {
  constexpr double kDegree = std::numbers::pi / 180;
  files::JsonObject root = file.root("stylet-probe", 1);
  content::Probe probe;
  probe.name = root.text("name");
  probe.convex = root.choice("kind", {"convex", "linear"}, "convex") == "convex";
  if (probe.convex) {
    probe.radius = root.number("radius_mm", {5, 200}) * 1e-3;
    probe.field_of_view = root.number("field_of_view_deg", {5, 170}) * kDegree;
    // Width of the footprint: the chord of the face.
    probe.width = 2 * probe.radius * std::sin(0.5 * probe.field_of_view);
    root.ignore("width_mm");
    if (root.has("width_mm")) root.problem("width_mm", "is for linear probes; remove it");
  } else {
    probe.width = root.number("width_mm", {5, 150}) * 1e-3;
    for (const char* key : {"radius_mm", "field_of_view_deg"}) {
      root.ignore(key);
      if (root.has(key)) root.problem(key, "is for convex probes; remove it");
    }
  }
  probe.depth = root.number("depth_mm", {20, 400}) * 1e-3;
  probe.frequency_hz = root.number("frequency_mhz", {0.5, 30}) * 1e6;
  probe.scan_lines = root.integer("scan_lines", 16, 1024, probe.scan_lines);
  probe.samples = root.integer("samples", 64, 4096, probe.samples);
  probe.dynamic_range_db = root.number("dynamic_range_db", {20, 120}, probe.dynamic_range_db);
  probe.gain_db = root.number("gain_db", {-60, 60}, probe.gain_db);
  probe.lowest_frequency_hz = probe.highest_frequency_hz = probe.frequency_hz;
  if (const auto band = root.numbers("frequency_range_mhz", 2, {0.5, 30}); band.size() == 2) {
    probe.lowest_frequency_hz = band[0] * 1e6;
    probe.highest_frequency_hz = band[1] * 1e6;
    if (!(probe.lowest_frequency_hz <= probe.frequency_hz && probe.frequency_hz <= probe.highest_frequency_hz)) {
      root.problem("frequency_range_mhz", fmt::format("is {:g} to {:g}, without frequency_mhz ({:g}); widen it",
                                                      band[0], band[1], probe.frequency_hz * 1e-6));
    }
  }
  probe.focus = root.number("focus_mm", {5, 400}, probe.focus * 1e3) * 1e-3;
  std::ranges::copy(root.numbers("tgc_db", probe.tgc_db.size(), {-20, 20}), probe.tgc_db.begin());
  const double persistence = root.number("persistence", {0, 0.95}, -1);
  if (persistence >= 0) probe.persistence = persistence;
  probe.preset = root.choice("preset", {"clinical", "raw"}, probe.preset);
  root.ignore("licence");
  root.ignore("source");
  root.finish();
  return probe;
}

}  // namespace stylet::readers

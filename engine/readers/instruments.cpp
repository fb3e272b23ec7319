#include "engine/readers/instruments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::readers {

namespace key = files::key;
using files::Key;

namespace {

constexpr struct {
  Key name = key::text("name", "shown to the user");
  Key licence = key::kLicence;
  Key source = key::kSource;
  Key length = key::number("length_mm", "mm", {20, 400}, "hub to tip");
  Key outer = key::number("outer_diameter_mm", "mm", {0.2, 5}, "of the shaft");
  Key inner = key::number("inner_diameter_mm", "mm", {0, 5}, "of the bore, smaller than the outer one; 0: solid")
                  .otherwise(0);
  Key young_modulus = key::number("young_modulus_pa", "Pa", {1e6, 1e12}, "of the shaft");
  Key poisson_ratio = key::number("poisson_ratio", "", {0, 0.49}, "of the shaft");
  Key yield_strength =
      key::number("yield_strength_pa", "Pa", {0, 1e11}, "of the shaft, which stays bent beyond it; 0: it never does")
          .otherwise(0);
  Key beams = key::integer("beams", {1, physics::kMaxBeams}, "beam elements from hub to tip").otherwise(8);
  Key bevel_force_ratio = key::number("bevel_force_ratio", "", {0, 1},
                                      "lateral over axial force on the tip that cuts, away from the bevel's face; "
                                      "coupling stylet only")
                              .otherwise(0);
} kNeedleKeys;

constexpr struct {
  Key name = key::text("name", "shown to the user");
  Key licence = key::kLicence;
  Key source = key::kSource;
  Key kind = key::choice("kind", files::one_of<"convex", "linear">, "shape of the face").otherwise("convex");
  Key depth = key::number("depth_mm", "mm", {20, 400}, "imaged below the face");
  Key frequency = key::number("frequency_mhz", "MHz", {0.5, 30}, "centre frequency");
  Key frequency_range = key::numbers("frequency_range_mhz", 2, "MHz", {0.5, 30},
                                     "band that the frequency knob covers, lowest and highest; absent: frequency_mhz "
                                     "alone")
                            .optional();
  Key focus = key::number("focus_mm", "mm", {5, 400}, "transmit focus below the face").otherwise(75);
  Key f_number =
      key::number("f_number", "", {0.8, 6}, "least depth over width of the receiving aperture").otherwise(2.2);
  Key elevation_width = key::number("elevation_width_mm", "mm", {0.75, 10},
                                    "thickness of the slice where it is thinnest, full width at half maximum of the "
                                    "amplitude; speckle is as fine as it allows")
                            .otherwise(3);
  Key elevation_focus =
      key::number("elevation_focus_mm", "mm", {5, 400}, "where that is, below the face: the lens's focus")
          .otherwise(70);
  Key scan_lines = key::integer("scan_lines", {16, 1024}, "of an image").otherwise(192);
  Key samples = key::integer("samples", {64, 4096}, "along a line").otherwise(512);
  Key dynamic_range = key::number("dynamic_range_db", "dB", {20, 120}, "shown").otherwise(60);
  Key gain = key::number("gain_db", "dB", {-60, 60}, "what the knob begins with").otherwise(0);
  Key tgc = key::numbers("tgc_db", 8, "dB", {-20, 20},
                         "sliders of the time-gain compensation, nearest first, at the middle of each eighth of the "
                         "depth; absent: all 0")
                .optional();
  Key persistence = key::number("persistence", "", {0, 0.95},
                                "share of the frame before in what a live image shows; absent: the preset's")
                        .optional();
  Key preset =
      key::choice("preset", files::one_of<"clinical", "raw">,
                  "how a live image is made: clinical (compounded, textured) or raw (one look, nothing added)")
          .otherwise("clinical");
} kProbeKeys;

constexpr struct {
  Key radius = key::number("radius_mm", "mm", {5, 200}, "of the face");
  Key field_of_view = key::number("field_of_view_deg", "degrees", {5, 170}, "angle between the outermost lines");
} kConvex;

constexpr struct { Key width = key::number("width_mm", "mm", {5, 150}, "of the face"); } kLinear;

const files::KeyTable& probe_table() {
  static const files::KeyTable table{
      .keys = files::keys_of(kProbeKeys),
      .by = kProbeKeys.kind.name,
      .variants = {{"convex", files::keys_of(kConvex)}, {"linear", files::keys_of(kLinear)}}};
  return table;
}

}  // namespace

const files::FileFormat& needle_format() {
  static const files::FileFormat format{
      .name = "needle", .title = "A needle", .table = files::table_of<kNeedleKeys>, .id = "stylet-needle"};
  return format;
}

const files::FileFormat& probe_format() {
  static const files::FileFormat format{.name = "probe",
                                        .title = "An ultrasound probe and what the scanner's knobs begin with",
                                        .table = probe_table,
                                        .id = "stylet-probe"};
  return format;
}

content::Needle read_needle(files::JsonFile& file) {
  files::JsonObject root = file.root(needle_format());
  content::Needle needle;
  needle.name = root.text(kNeedleKeys.name);
  needle.length = root.number(kNeedleKeys.length) * 1e-3;
  const double outer_mm = root.number(kNeedleKeys.outer);
  const double inner_mm = root.number(kNeedleKeys.inner);
  if (inner_mm >= outer_mm) {
    root.problem(kNeedleKeys.inner,
                 fmt::format("is {:g}, not smaller than {} ({:g})", inner_mm, kNeedleKeys.outer.name, outer_mm));
  }
  needle.outer_diameter = outer_mm * 1e-3;
  needle.inner_diameter = inner_mm * 1e-3;
  needle.young_modulus = root.number(kNeedleKeys.young_modulus);
  needle.poisson_ratio = root.number(kNeedleKeys.poisson_ratio);
  needle.yield_strength = root.number(kNeedleKeys.yield_strength);
  needle.beams = root.integer(kNeedleKeys.beams);
  needle.bevel_force_ratio = root.number(kNeedleKeys.bevel_force_ratio);
  root.finish();
  return needle;
}

content::Probe read_probe(files::JsonFile& file) {
  constexpr double kDegree = std::numbers::pi / 180;
  files::JsonObject root = file.root(probe_format());
  content::Probe probe;
  probe.name = root.text(kProbeKeys.name);
  const std::string kind = root.choice(kProbeKeys.kind);
  probe.convex = kind == "convex";
  if (probe.convex) {
    probe.radius = root.number(kConvex.radius) * 1e-3;
    probe.field_of_view = root.number(kConvex.field_of_view) * kDegree;
    // Width of the footprint: the chord of the face.
    probe.width = 2 * probe.radius * std::sin(0.5 * probe.field_of_view);
  } else {
    probe.width = root.number(kLinear.width) * 1e-3;
  }
  probe_table().each([&](const Key& key, std::string_view of) {
    if (of.empty() || of == kind) return;
    root.ignore(std::string(key.name));
    if (root.has(key)) root.problem(key, fmt::format("is for {} probes; remove it", of));
  });
  probe.depth = root.number(kProbeKeys.depth) * 1e-3;
  probe.frequency_hz = root.number(kProbeKeys.frequency) * 1e6;
  probe.f_number = root.number(kProbeKeys.f_number);
  probe.elevation_width = root.number(kProbeKeys.elevation_width) * 1e-3;
  probe.elevation_focus = root.number(kProbeKeys.elevation_focus) * 1e-3;
  probe.scan_lines = root.integer(kProbeKeys.scan_lines);
  probe.samples = root.integer(kProbeKeys.samples);
  probe.dynamic_range_db = root.number(kProbeKeys.dynamic_range);
  probe.gain_db = root.number(kProbeKeys.gain);
  probe.lowest_frequency_hz = probe.highest_frequency_hz = probe.frequency_hz;
  if (const auto band = root.numbers(kProbeKeys.frequency_range); band.size() == 2) {
    probe.lowest_frequency_hz = band[0] * 1e6;
    probe.highest_frequency_hz = band[1] * 1e6;
    if (!(probe.lowest_frequency_hz <= probe.frequency_hz && probe.frequency_hz <= probe.highest_frequency_hz)) {
      root.problem(kProbeKeys.frequency_range,
                   fmt::format("is {:g} to {:g}, without {} ({:g}); widen it", band[0], band[1],
                               kProbeKeys.frequency.name, probe.frequency_hz * 1e-6));
    }
  }
  probe.focus = root.number(kProbeKeys.focus) * 1e-3;
  std::ranges::copy(root.numbers(kProbeKeys.tgc), probe.tgc_db.begin());
  if (const double share = root.number(kProbeKeys.persistence); !std::isnan(share)) probe.persistence = share;
  probe.preset = root.choice(kProbeKeys.preset);
  root.finish();
  return probe;
}

}  // namespace stylet::readers

// The metrics: what each is called, its unit, its definition and where that is from, written once. engine/training
// computes the values, scenarios score them by name, content/README.md shows this table (`stylet schema metrics`).
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace stylet::content {

struct MetricRow {
  std::string_view name;        ///< in scenarios and results
  std::string_view title;       ///< for people
  std::string_view unit;        ///< "mm", "s", "deg", "N", "%", ...; empty: a count
  std::string_view definition;  ///< one line
  std::string_view source;
  std::string_view remark{};  ///< what else is to know of the definition; how it differs from its source
};

/// Those of every procedure, in the order of results; kinds of procedures have more (procedures::metric_table()).
std::span<const MetricRow> metric_table();

/// The row of a name that is there.
const MetricRow& metric_row(std::string_view name);

/// As a table of Markdown.
std::string metric_markdown(std::span<const MetricRow> rows);

// Johnson et al. 2012 and Perk Tutor (Holden et al.; the names are ours).
inline constexpr std::string_view kTargeting = "targeting";
inline constexpr std::string_view kProbeUsageTime = "probe_usage_time";
inline constexpr std::string_view kNeedleInBeam = "needle_in_beam";
inline constexpr std::string_view kForbiddenHits = "forbidden_hits";
inline constexpr std::string_view kForbiddenTime = "forbidden_time";
inline constexpr std::string_view kElapsedTime = "elapsed_time";
inline constexpr std::string_view kPathLength = "path_length";
inline constexpr std::string_view kSkinContacts = "skin_contacts";
inline constexpr std::string_view kTimeInTissue = "time_in_tissue";
inline constexpr std::string_view kPathInTissue = "path_in_tissue";
inline constexpr std::string_view kTissueDamage = "tissue_damage";
inline constexpr std::string_view kPunctures = "punctures";
inline constexpr std::string_view kTargetsHit = "targets_hit";
inline constexpr std::string_view kTranslationalActions = "translational_actions";
inline constexpr std::string_view kRotationalActions = "rotational_actions";
inline constexpr std::string_view kSmoothness = "smoothness";
inline constexpr std::string_view kPathInefficiency = "path_inefficiency";
inline constexpr std::string_view kRotation = "rotation";
inline constexpr std::string_view kDepthPerception = "depth_perception";
inline constexpr std::string_view kAverageVelocity = "average_velocity";
// Against a reference motion.
inline constexpr std::string_view kReferenceRms = "reference_rms";
inline constexpr std::string_view kReferenceHausdorff = "reference_hausdorff";
inline constexpr std::string_view kReferenceFrechet = "reference_frechet";
inline constexpr std::string_view kReferenceDtw = "reference_dtw";
// Ours.
inline constexpr std::string_view kAngleError = "angle_error";
inline constexpr std::string_view kDepthOvershoot = "depth_overshoot";
inline constexpr std::string_view kPeakForce = "peak_force";
inline constexpr std::string_view kLateralBending = "lateral_bending";
inline constexpr std::string_view kNeedleBend = "needle_bend";
inline constexpr std::string_view kCutAside = "cut_aside";
inline constexpr std::string_view kOutOfPlaneTime = "out_of_plane_time";

}  // namespace stylet::content

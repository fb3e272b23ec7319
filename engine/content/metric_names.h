// Names of the metrics that a scenario of any kind can score (content/README.md, "Metrics"); engine/training computes
// them. A kind of procedure has metrics of its own.
#pragma once

#include <array>
#include <string_view>

namespace stylet::content {

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
inline constexpr std::string_view kOutOfPlaneTime = "out_of_plane_time";

inline constexpr std::array kMetricNames{
    kTargeting,      kProbeUsageTime,     kNeedleInBeam,     kForbiddenHits,        kForbiddenTime,
    kElapsedTime,    kPathLength,         kSkinContacts,     kTimeInTissue,         kPathInTissue,
    kTissueDamage,   kPunctures,          kTargetsHit,       kTranslationalActions, kRotationalActions,
    kSmoothness,     kPathInefficiency,   kRotation,         kDepthPerception,      kAverageVelocity,
    kReferenceRms,   kReferenceHausdorff, kReferenceFrechet, kReferenceDtw,         kAngleError,
    kDepthOvershoot, kPeakForce,          kLateralBending,   kOutOfPlaneTime};

}  // namespace stylet::content

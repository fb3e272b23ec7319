#include "engine/content/metric_table.h"

#include "engine/files/key_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace stylet::content {
namespace {

constexpr std::string_view kJohnson = "Johnson 2012";
constexpr std::string_view kPerkTutor = "Perk Tutor";
constexpr std::string_view kBoth = "Johnson 2012; Perk Tutor";
constexpr std::string_view kOurs = "Stylet";

// Of every procedure.
constexpr MetricRow kOfTheNeedle[] = {
    {kTargeting, "targeting", "mm", "tip to the target's centre when the needle is fired, else at its closest",
     kJohnson, "to the nearest target, at the arrival"},
    {kProbeUsageTime, "probe on the skin", "s", "time in which the probe touches the skin", kJohnson},
    {kNeedleInBeam, "needle in the beam", "mm",
     "length of inserted needle that the beam sees, mean over the time in tissue", kJohnson,
     "within sector, depth and half the beam's width (full width at half maximum) of the image plane"},
    {kForbiddenHits, "no-go areas touched", "",
     "entries of the tip into forbidden structures, 0.2 s out of them in between", kJohnson,
     "each structure by itself, looked up every 0.5 mm of the tip's way"},
    {kForbiddenTime, "time in no-go areas", "s", "time of the tip in forbidden structures", kJohnson},
    {kElapsedTime, "length of the procedure", "s", "from its beginning, after the briefing, to its end", kBoth,
     "Johnson: session length"},
    {kPathLength, "needle path", "mm", "way of the tip", kBoth,
     "sum of |step of the tip|; Johnson: total needle distance"},
    {kSkinContacts, "skin contacts", "", "times that the needle comes to the skin, 1 mm clear of it in between",
     kJohnson},
    {kTimeInTissue, "time in tissue", "s", "time with the needle in the patient", kPerkTutor},
    {kPathInTissue, "needle path in tissue", "mm", "way of the tip with the needle in the patient", kPerkTutor},
    {kTissueDamage, "tissue damage", "mm2", "area swept by the needle between skin and tip, two triangles a step",
     kPerkTutor, "triangles (tip', entry', tip) and (entry', tip, entry) for every step in tissue"},
    {kPunctures, "punctures", "", "entries into the patient, with a hysteresis of 1 mm either way", kPerkTutor,
     "the tip 1 mm behind the skin, after nothing was 1 mm ahead of it"},
    {kTargetsHit, "targets hit", "", "targets that the tip came within 3 mm of the centre of", kPerkTutor,
     "while inserted"},
    {kTranslationalActions, "translational actions", "", "spells of the tip above 50 mm/s for more than 0.2 s",
     kPerkTutor, "each begins after more than 0.2 s above, and ends after more than 0.2 s below"},
    {kRotationalActions, "rotational actions", "", "spells of the hand above 50 deg/s for more than 0.2 s",
     kPerkTutor, "begin and end as those of the tip"},
    {kSmoothness, "jerk cost", "mm/s^2.5", "square root of the time integral of the hub's squared jerk: 0 is smooth",
     kPerkTutor,
     "by third divided differences, of what the hand holds: a tip that breaks through jumps; Perk Tutor writes "
     "mm/s^3 for the same integral"},
    {kPathInefficiency, "path inefficiency", "%",
     "100 (way / distance - 1) of the tip from the first entry to the arrival", kPerkTutor,
     "Perk Tutor: of the whole motion, which is endless for a needle that comes back"},
    {kRotation, "rotation", "deg", "sum of the angles that the hub turned by", kPerkTutor},
    {kDepthPerception, "way along the needle", "mm", "sum of |way of the tip . axis of the needle|", kPerkTutor},
    {kAverageVelocity, "average velocity", "mm/s", "needle path over length of the procedure", kPerkTutor,
     "Perk Tutor: mean of the steps' speeds, the same where steps are even"},
    {kReferenceRms, "off the reference motion, RMS", "mm", "root mean square distance to the reference motion's path",
     kOurs,
     "the reference is the scenario's motion; this and the next three: of the tip of a needle that does not bend, "
     "for both hands, 600 points even in time of each"},
    {kReferenceHausdorff, "off the reference motion, Hausdorff", "mm",
     "largest distance of a point of either path to the other", kPerkTutor,
     "Perk Tutor: of the trainee's points to the reference's points only"},
    {kReferenceFrechet, "off the reference motion, Frechet", "mm",
     "shortest leash of two that walk along the paths without going back", kPerkTutor,
     "discrete Fréchet distance, Eiter and Mannila 1994"},
    {kReferenceDtw, "off the reference motion, time warped", "mm",
     "mean distance of points matched in order so that it is least", kPerkTutor,
     "dynamic time warping, Sakoe and Chiba 1978; Perk Tutor divides the same sum by the points of both less one, so "
     "its value is the smaller"},
    {kAngleError, "angle error", "deg",
     "between the needle and the line from its tip to the target, 10 mm deep in the last pass", kOurs},
    {kDepthOvershoot, "depth overshoot", "mm",
     "farthest that the tip went beyond the target's centre, along the needle", kOurs, "in the pass that arrives"},
    {kPeakForce, "peak force", "N", "largest force on the hand", kOurs, "seen once a step"},
    {kLateralBending, "lateral bending", "mm",
     "largest distance of the inserted needle's shaft from the line between hub and tip", kOurs},
    {kNeedleBend, "needle bent", "deg", "largest angle that the needle was bent by for good", kOurs,
     "sum over its beams; 0 where its file has no yield strength"},
    {kCutAside, "tissue cut aside", "mm2", "area of tissue cut by the side of the shaft", kOurs,
     "length of shaft times its way through the tissue, across; 0 where tissues have no side strength"},
    {kOutOfPlaneTime, "out of plane while advancing", "s",
     "time in which the needle goes deeper while its tip is out of the beam's width", kOurs,
     "deeper by more than 1 mm/s; also while the probe is off the skin"},
};

}  // namespace

std::span<const MetricRow> metric_table() {
  return kOfTheNeedle;
}

const MetricRow& metric_row(std::string_view name) {
  const auto found = std::ranges::find(metric_table(), name, &MetricRow::name);
  if (found == metric_table().end()) {
    std::fprintf(stderr, "there is no metric %.*s\n", static_cast<int>(name.size()), name.data());
    std::abort();
  }
  return *found;
}

std::string metric_markdown(std::span<const MetricRow> rows_of_metrics) {
  std::vector<std::vector<std::string>> rows;
  for (const MetricRow& metric : rows_of_metrics) {
    std::string definition(metric.definition);
    if (!metric.remark.empty()) definition += fmt::format("; {}", metric.remark);
    rows.push_back({fmt::format("`{}`", metric.name), std::string(metric.unit.empty() ? "–" : metric.unit),
                    definition, std::string(metric.source)});
  }
  return files::markdown_table({"metric", "unit", "definition", "source"}, rows);
}

}  // namespace stylet::content

// What was sampled or destroyed, as the session tells it and as its recording keeps it.
#pragma once

#include "engine/content/scene.h"
#include "engine/training/ablation.h"
#include "engine/training/procedure_watch.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::training {

struct SamplingResult {
  std::vector<Core> cores;
  std::vector<double> tumour_shares;  ///< [cores] of the targets' tissues
  bool heated = false;                ///< an electrode was; of it:
  double heated_s = 0;
  double volume = 0;  ///< destroyed, m^3
  AblationCoverage coverage;
};

/// Some lines for the terminal; empty where nothing was sampled or destroyed.
std::string in_words(const SamplingResult& result);

/// Events besides those of the flow (recording::EventRecord). The metrics read them: a replay measures what the
/// session did.
namespace training_event {
inline constexpr std::string_view kCore = "core";        ///< detail: core_detail()
inline constexpr std::string_view kAblated = "ablated";  ///< detail: ablation_detail()
}  // namespace training_event

/// "target 62.00 %: tumour 62.00 %, liver 38.00 %".
/// @param content  [tissues] shares of the core
std::string core_detail(double target, const std::vector<double>& content, const content::Scene& scene);
/// "720 s, 7.53 ml; target 100.00 %, margin 95.12 %, least margin 3.2 mm"
std::string ablation_detail(const SamplingResult& result);
/// The seconds of an ablation_detail(); none: it is another text.
std::optional<double> heated_in(std::string_view detail);
/// The number after the first `name` in a detail, per cent; none: no such name, or no number.
std::optional<double> percent_in(std::string_view detail, std::string_view name);

}  // namespace stylet::training

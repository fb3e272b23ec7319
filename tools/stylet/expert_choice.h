// Who a debrief compares the trainee with: what `train` and `debrief` have in common.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/expert.h"
#include "tools/stylet/progress.h"

#include <optional>
#include <string>

namespace stylet::tools {

inline constexpr const char* kExpertHelp =
    "Whom the debrief compares with: another recording of the scenario, or none; default: the scenario's motion";

/// Of --expert, before a session that it must not spoil. @throws files::ContentError  a file that is no recording
void check_expert(const std::string& choice);

/// @param choice    of --expert
/// @param own_hand  the session's hand was the scenario's motion itself: nobody to compare with unless chosen
/// @throws files::ContentError
std::optional<debrief::Expert> chosen_expert(const std::string& choice, bool own_hand, const content::Scene& scene,
                                             Progress& progress);

}  // namespace stylet::tools

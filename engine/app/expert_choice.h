// Whom a debrief compares the trainee with.
#pragma once

#include "engine/app/observer.h"
#include "engine/content/scene.h"
#include "engine/debrief/expert.h"

#include <optional>
#include <string>

namespace stylet::app {

/// Whether the choice is one, before a session that it must not spoil. @throws files::ContentError  a file that is no
/// recording
void check_expert(const std::string& choice);

/// @param choice    a recording of the scenario, "none", or empty: the scenario's motion
/// @param own_hand  the session's hand was the scenario's motion itself: nobody to compare with unless chosen
/// @throws files::ContentError
std::optional<debrief::Expert> chosen_expert(const std::string& choice, bool own_hand, const content::Scene& scene,
                                             Observer& observer);

}  // namespace stylet::app

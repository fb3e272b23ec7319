// Ultrasound images that a trainee saved, among the results of their session and in its debrief.
#pragma once

#include "engine/debrief/debrief_data.h"
#include "engine/files/output_directory.h"
#include "engine/scanner/saved_image.h"
#include "engine/session/session_report.h"

#include <filesystem>
#include <vector>

namespace stylet::app {

/// Stages their files. @throws files::ContentError
void write_images(const scanner::SavedImages& saved, const files::OutputDirectory& out);
/// What session.json tells of them.
std::vector<session::SavedImageFacts> facts_of(const scanner::SavedImages& saved);
/// Those that lie in a session's folder, as its session.json lists them; what cannot be read is left out.
std::vector<debrief::DebriefPicture> saved_pictures(const std::filesystem::path& folder);

}  // namespace stylet::app

// A course as an instructor sees it, written as files.
#pragma once

#include "engine/lab/course/course.h"
#include "engine/lab/store/lab.h"

#include <filesystem>

namespace stylet::app {

/// Writes index.html and a page PSEUDONYM.html for each trainee; pages of people who are no more there are taken
/// away.
/// @param names  beside the pseudonyms; without, nobody is named in them
/// @return the index
/// @throws files::ContentError
std::filesystem::path write_lab_pages(lab::store::Lab& lab, const lab::course::Course& course, bool names,
                                      const std::filesystem::path& out);

}  // namespace stylet::app

// A course as an instructor sees it, written as files.
#pragma once

#include "engine/lab/course/course.h"
#include "engine/lab/page/page.h"
#include "engine/lab/store/lab.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace stylet::app {

/// Everybody of the lab in the course, as the cohort's page shows them: without metrics and notes.
/// @param names  beside the pseudonyms
/// @throws files::ContentError
std::vector<lab::page::TraineeView> cohort_views(lab::store::Lab& lab, const lab::course::Course& course, bool names,
                                                 std::int64_t now_ms);
/// One of them, with everything.
lab::page::TraineeView lab_view(lab::store::Lab& lab, const lab::course::Course& course, lab::store::Person person,
                                bool names, std::int64_t now_ms);

/// Writes index.html and a page PSEUDONYM.html for each trainee; pages of people who are no more there are taken
/// away.
/// @param names  beside the pseudonyms; without, nobody is named in them
/// @return the index
/// @throws files::ContentError
std::filesystem::path write_lab_pages(lab::store::Lab& lab, const lab::course::Course& course, bool names,
                                      const std::filesystem::path& out);

}  // namespace stylet::app

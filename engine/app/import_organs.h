// Meshes and label volumes of other programs become organs, a folder each, or a whole scenario.
#pragma once

#include "engine/app/observer.h"
#include "engine/import/organ_import.h"
#include "engine/import/organ_source.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace stylet::app {

struct ImportOrgansSettings {
  std::vector<std::string> files{};
  import::SourceSettings source{};
  std::filesystem::path side{};  ///< side file: which parts make which organs, and how they become a scenario
  std::string target{};  ///< without a side file: one is proposed with this part as the target (side_proposal.h)
  std::filesystem::path out{};                   ///< a folder an organ in it; of a scenario the folder itself
  std::vector<import::OrganRequest> organs{};    ///< without a side file
  std::map<std::string, std::string> tissues{};  ///< by organ: a row of the tissue table
  import::ImportSettings mesh{};                 ///< before what a side file says
  std::vector<std::string> of_single_organs{};   ///< options given that a scenario has no use for, for the message
};

/// Reads the files and notes their warnings. @throws files::ContentError
std::vector<import::SourceFile> read_sources(const ImportOrgansSettings& settings, Observer& observer);

/// Makes the organs, or the scenario where the side file has one, and notes what each came to.
/// @return false: an organ was refused, which a note says; the others were made
/// @throws files::ContentError, Stopped
bool import_organs(const ImportOrgansSettings& settings, Observer& observer);

}  // namespace stylet::app

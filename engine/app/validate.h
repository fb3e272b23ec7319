// All problems of a file that Stylet reads, at once.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace stylet::app {

struct Verdict {
  std::vector<std::string> problems{};  ///< one line each: file, place, what is wrong and what to do
  std::vector<std::string> warnings{};
  std::string summary{};  ///< of a sound file: lines about it
  bool sound() const { return problems.empty(); }
};

/// By "format": reads a file that the engine knows nothing of. @throws files::ContentError  what is wrong with it
using OtherFormats = std::map<std::string, std::function<void(const std::filesystem::path&)>>;

/// Of a folder the files below it that Stylet reads, in order; a file named by itself whatever it is.
/// @throws files::ContentError  the folder holds none
std::vector<std::filesystem::path> files_to_validate(const std::filesystem::path& path,
                                                     const OtherFormats& others = {});

/// A scenario is checked with every file it names, and its organs are turned into tetrahedra.
Verdict validate(const std::filesystem::path& path, const OtherFormats& others = {});

}  // namespace stylet::app

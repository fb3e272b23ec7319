// Files and folders of the lab's records, as lab.cpp and erasure.cpp make them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace stylet::lab::store {

/// The folder, made for its owner alone where it is not there. @throws files::ContentError
std::filesystem::path private_folder(std::filesystem::path folder);
/// What was written and how the folder names it are on the disk.
void sync(const std::filesystem::path& path);
/// "20260302T091625Z"
std::string time_name(std::int64_t ms);
/// What a recording is called while it is copied.
std::filesystem::path unfinished(const std::filesystem::path& recording);
/// With what a kill left of it. @return it was there
bool remove_recording(const std::filesystem::path& recording);

}  // namespace stylet::lab::store

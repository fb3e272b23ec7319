// SHA-256 in hexadecimal: what a recording, a scenario, a course was.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace stylet::lab::store {

std::string sha256(std::string_view bytes);
/// @throws files::ContentError  unreadable
std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace stylet::lab::store

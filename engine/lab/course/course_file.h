// The reader of course files.
#pragma once

#include "engine/files/json_reader.h"
#include "engine/lab/course/course.h"

#include <filesystem>
#include <string>
#include <vector>

namespace stylet::lab::course {

/// Its keys.
const files::FileFormat& course_format();

/// Problems go to `file`. Limits of gates and alarms are computed here; those of an exercise with problems are not.
/// @param warnings  appended to: what is odd but no reason to refuse, one line each
Course read_course(files::JsonFile& file, std::vector<std::string>* warnings = nullptr);

/// @throws files::ContentError  the first problem
Course load_course(const std::filesystem::path& path);

}  // namespace stylet::lab::course

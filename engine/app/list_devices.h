// What HID devices are plugged in, what each can do, and why one is not usable; what sound comes out of.
#pragma once

#include "engine/app/hid_device.h"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>
#include <string>

namespace stylet::app {

/// A list; of each what `stylet devices --json` prints, and "text": lines for people. Nothing is opened.
/// @throws files::ContentError  of the profiles
nlohmann::json list_devices();

/// The same of one device, by its report descriptor alone: bytes, or hexadecimal digits.
/// @param id      to find its profile. @param fields  "text" lists every field
/// @throws files::ContentError  it is no descriptor
nlohmann::json describe_descriptor(const std::filesystem::path& file, const HidChoice& id, bool fields);

/// Opens it for a moment. @return as its system calls it; empty: there is none
std::string sound_device();

}  // namespace stylet::app

// Device profiles (content/README.md, "stylet-device").
#pragma once

#include "engine/files/json_reader.h"
#include "haptic/hid/device_profile.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::readers {

/// Its keys.
const files::FileFormat& device_format();

/// Problems go to `file`; what comes out is in range even then.
haptic::hid::DeviceProfile read_device_profile(files::JsonFile& file);

/// A vendor or product id as such files write it. @return nothing: `text` is not that, which is noted at `key`
std::optional<std::uint16_t> read_hex_id(files::JsonObject& object, const files::Key& key, const std::string& text);
/// What a JSON schema says of such a text.
inline constexpr std::string_view kHexId = R"({"pattern": "^[0-9a-fA-F]{4}$"})";

/// All profiles of a folder, by file name. @throws ContentError  one of them is wrong
std::vector<haptic::hid::DeviceProfile> load_device_profiles(const std::filesystem::path& folder);
/// Those that Stylet ships, or STYLET_CONTENT has.
std::vector<haptic::hid::DeviceProfile> load_device_profiles();

/// The profile that fits best, the first of several; one without a name where none does.
/// @param described  what its descriptor makes of the device
haptic::hid::DeviceProfile choose_profile(const std::vector<haptic::hid::DeviceProfile>& profiles,
                                          const haptic::hid::DeviceIdentity& identity,
                                          haptic::hid::DeviceKind described);

}  // namespace stylet::readers

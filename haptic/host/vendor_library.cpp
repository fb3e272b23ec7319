#include "haptic/host/vendor_library.h"

#include "haptic/host/driver.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>
#include <utility>

namespace stylet::haptic::host {

VendorLibrary::VendorLibrary(std::string whose, const std::string& chosen, std::span<const std::string> names)
    : whose_(std::move(whose)) {
  const std::vector<std::string> asked =
      chosen.empty() ? std::vector<std::string>(names.begin(), names.end()) : std::vector<std::string>{chosen};
  std::string found_but;
  for (const std::string& name : asked) {
    handle_ = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    path_ = name;
    if (handle_ != nullptr) return;
    const char* why = dlerror();
    // One that is there and cannot be loaded is worth a word.
    std::error_code ignored;
    if (name.find('/') != std::string::npos && std::filesystem::exists(name, ignored) && found_but.empty()) {
      found_but = why != nullptr ? why : name;
    }
  }
  if (!found_but.empty())
    throw DriverError(fmt::format("the library of {} cannot be loaded: {}", whose_, found_but), true);
  throw DriverError(
      fmt::format("the library of {} is not installed ({}); install it from its maker", whose_, asked[0]),
      !chosen.empty());
}

void* VendorLibrary::address_or_null(const char* name) const {
  return dlsym(handle_, name);
}

void* VendorLibrary::address(const char* name) const {
  void* found = address_or_null(name);
  if (found == nullptr) {
    throw DriverError(fmt::format("{}: has no {}; install a newer version of the library of {}", path_, name, whose_),
                      true);
  }
  return found;
}

}  // namespace stylet::haptic::host

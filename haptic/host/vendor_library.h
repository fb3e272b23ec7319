// A library that the user has installed, loaded while the program runs.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace stylet::haptic::host {

/// Never unloaded: vendors' drivers do not survive that.
class VendorLibrary {
public:
  /// @param whose  for messages  @param chosen  what the user says; empty: the first of `names` that can be loaded
  /// @throws DriverError
  VendorLibrary(std::string whose, const std::string& chosen, std::span<const std::string> names);

  /// @throws DriverError  it has no such function
  template <typename Function>
  void find(Function*& function, const char* name) const {
    function = reinterpret_cast<Function*>(address(name));
  }
  /// Null where it has no such function.
  template <typename Function>
  void find_if_there(Function*& function, const char* name) const {
    function = reinterpret_cast<Function*>(address_or_null(name));
  }
  const std::string& path() const { return path_; }

private:
  void* address(const char* name) const;
  void* address_or_null(const char* name) const;

  std::string whose_;
  std::string path_;
  void* handle_ = nullptr;
};

}  // namespace stylet::haptic::host

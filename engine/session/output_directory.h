// A result folder that is either complete or untouched.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string_view>

namespace stylet::session {

/// Files are written into a hidden folder beside the destination and moved into it by commit(); without commit()
/// nothing remains. Files already in the destination that the new result does not name stay. Hidden folders of
/// processes that were killed are removed by the next one with the same destination.
class OutputDirectory {
public:
  /// Throws content::ContentError where the destination cannot be written.
  explicit OutputDirectory(std::filesystem::path destination);
  ~OutputDirectory();
  OutputDirectory(const OutputDirectory&) = delete;
  OutputDirectory& operator=(const OutputDirectory&) = delete;

  /// Path to write the file `name` to, until commit().
  std::filesystem::path staged(const std::filesystem::path& name) const { return staging_ / name; }
  const std::filesystem::path& destination() const { return destination_; }
  /// Drops the staged files but those named.
  void keep_only(std::initializer_list<std::string_view> names);
  void commit();

private:
  std::filesystem::path destination_;
  std::filesystem::path staging_;
};

}  // namespace stylet::session

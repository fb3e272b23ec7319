// A result folder that is either complete or untouched.
#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::files {

/// Files are written into a hidden folder beside the destination and moved into it by commit(); without commit()
/// nothing remains. Files already in the destination stay, but those the new result replaces or supersedes. Hidden
/// folders of processes that were killed are removed by the next one with the same destination.
class OutputDirectory {
public:
  /// Throws files::ContentError where the destination cannot be written.
  explicit OutputDirectory(std::filesystem::path destination);
  ~OutputDirectory();
  OutputDirectory(const OutputDirectory&) = delete;
  OutputDirectory& operator=(const OutputDirectory&) = delete;

  /// Path to write the file `name` to, until commit().
  std::filesystem::path staged(const std::filesystem::path& name) const { return staging_ / name; }
  /// Stages a file. @throws files::ContentError  it cannot be written
  void write(const std::filesystem::path& name, std::string_view bytes) const;
  /// Does what writes staged files. Where that fails, the error names them by the place they were to have: the hidden
  /// folder is gone before anybody reads of it.
  void named_in_place(const std::function<void()>& act) const;
  /// The same of any text.
  std::string in_place(std::string text) const;
  const std::filesystem::path& destination() const { return destination_; }
  /// Whether commit() will find room for files of these names: a folder of such a name stands in the way.
  /// @throws files::ContentError  it does
  void require_places(const std::vector<std::string>& names) const;
  /// Drops the staged files but those named.
  void keep_only(std::initializer_list<std::string_view> names);
  /// Names of files of an earlier result: commit() removes from the destination those that were not staged again.
  /// What is no plain name of a file there is left alone.
  void supersede(std::vector<std::string> names);
  /// Moves staged files of these names into the destination now, one after the other, in the place of what has their
  /// name there; each is whole or not there. The rest stays staged. @throws files::ContentError
  void publish(const std::vector<std::string>& names);
  /// Moves all files, or none where the place of one is taken (a folder of its name). `last`, the file that tells
  /// what the others are, is taken away first and comes last: while it is there, so are they.
  /// @throws files::ContentError
  void commit(const std::filesystem::path& last = {});

private:
  void check_places() const;
  void remove_superseded(const std::filesystem::path& last);
  std::filesystem::path destination_;
  std::filesystem::path staging_;
  std::vector<std::string> superseded_;
};

}  // namespace stylet::files

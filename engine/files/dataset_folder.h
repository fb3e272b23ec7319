// A folder of frames that many processes fill, each its own frames, without a word to each other: a frame is whole or
// not there, and what is whole is not made again.
//
//   DatasetFolder folder("out", manifest);              // the same manifest, or refused
//   if (!folder.whole(7)) folder.put(7, {{"image", png}}, about);
#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace stylet::files {

/// A file of a frame: NAME_000007.png for "NAME".
struct FrameFile {
  std::string name;
  std::string bytes;
};

/// Thread: one; any number of processes, on any number of machines that share the folder.
class DatasetFolder {
public:
  /// Makes the folder, and manifest.json where there is none; every process has the same one to write.
  /// @throws files::ContentError  cannot be written, or it holds frames of another manifest
  DatasetFolder(std::filesystem::path folder, const nlohmann::ordered_json& manifest);

  /// frame_000007.json is there and every file that it lists has the bytes that it says.
  bool whole(std::uint64_t frame) const;
  /// Writes the files, each under another name first, and frame_000007.json last: `about` with the files added.
  /// @throws files::ContentError
  void put(std::uint64_t frame, const std::vector<FrameFile>& files, nlohmann::ordered_json about) const;
  /// Frames of [0, end) that are there; their bytes are not looked at.
  std::uint64_t count(std::uint64_t end) const;

private:
  void write(const std::string& name, const std::string& bytes) const;

  std::filesystem::path folder_;
};

}  // namespace stylet::files

// Tracked ultrasound as the PLUS toolkit writes it and 3D Slicer (extension SlicerIGSIO) opens it: NAME.igs.mha, a
// MetaImage whose third axis is time, with time stamp and transforms of every frame in its header.
//
//   SequenceFile sequence("out/ultrasound.igs.mha", 640, 480);
//   sequence.add({.time_s = 0.1, .pixels = grey, .transforms = {{"ProbeToTracker", tracker_from_probe}}});
//   sequence.close();
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

namespace stylet::tracking {

/// A transform of a frame: maps millimetres (or pixels) of one frame of reference to millimetres of another.
struct NamedTransform {
  std::string name;  ///< FROMToTO, as ProbeToTracker
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
};

struct SequenceFrame {
  double time_s = 0;
  std::span<const std::uint8_t> pixels;  ///< grey, rows from the probe downwards, the marked side of the probe right
  std::vector<NamedTransform> transforms{};
};

/// Writes frames as they come; memory does not grow with them. Until close() they lie in two files beside the
/// sequence, FILE.header and FILE.pixels, which are removed.
class SequenceFile {
public:
  /// @throws files::ContentError  the file cannot be written; so do add() and close()
  SequenceFile(std::filesystem::path file, int width, int height);
  ~SequenceFile();
  SequenceFile(const SequenceFile&) = delete;
  SequenceFile& operator=(const SequenceFile&) = delete;

  void add(const SequenceFrame& frame);
  /// Puts the file together: only now is the number of frames known, which stands at its beginning.
  void close();
  int frames() const { return frames_; }

private:
  void remove_parts();
  std::filesystem::path part(const char* name) const;
  void check(bool sound, const std::filesystem::path& file) const;

  std::filesystem::path file_;
  int width_;
  int height_;
  int frames_ = 0;
  std::ofstream header_;
  std::ofstream pixels_;
};

}  // namespace stylet::tracking

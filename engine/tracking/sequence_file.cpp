#include "engine/tracking/sequence_file.h"

#include "engine/files/error.h"

#include <fmt/format.h>

#include <cassert>
#include <system_error>

namespace stylet::tracking {

namespace fs = std::filesystem;

namespace {

/// Appends a file in pieces. false: something went wrong.
bool append(std::ofstream& to, const fs::path& from) {
  std::ifstream in(from, std::ios::binary);
  std::vector<char> piece(1U << 20);
  while (in) {
    in.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    to.write(piece.data(), in.gcount());
  }
  return in.eof() && static_cast<bool>(to);
}

}  // namespace

SequenceFile::SequenceFile(fs::path file, int width, int height)
    : file_(std::move(file)),
      width_(width),
      height_(height),
      header_(part("header"), std::ios::binary),
      pixels_(part("pixels"), std::ios::binary) {
  check(static_cast<bool>(header_), part("header"));
  check(static_cast<bool>(pixels_), part("pixels"));
}

SequenceFile::~SequenceFile() {
  remove_parts();
}

void SequenceFile::remove_parts() {
  header_.close();
  pixels_.close();
  std::error_code ignored;
  fs::remove(part("header"), ignored);
  fs::remove(part("pixels"), ignored);
}

fs::path SequenceFile::part(const char* name) const {
  return file_.string() + "." + name;
}

void SequenceFile::check(bool sound, const fs::path& file) const {
  if (!sound) throw files::ContentError(file.string() + ": cannot be written; is the disk full?");
}

void SequenceFile::add(const SequenceFrame& frame) {
  assert(frame.pixels.size() == static_cast<std::size_t>(width_) * height_);
  const std::string key = fmt::format("Seq_Frame{:04}_", frames_);
  std::string lines = fmt::format("{}FrameNumber = {}\n", key, frames_);
  for (const NamedTransform& transform : frame.transforms) {
    lines += fmt::format("{}{}Transform =", key, transform.name);
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) lines += fmt::format(" {:.9g}", transform.matrix(row, column));
    }
    lines += fmt::format("\n{}{}TransformStatus = OK\n", key, transform.name);
  }
  lines += fmt::format("{0}Timestamp = {1:.6f}\n{0}ImageStatus = OK\n", key, frame.time_s);
  header_ << lines;
  pixels_.write(reinterpret_cast<const char*>(frame.pixels.data()),
                static_cast<std::streamsize>(frame.pixels.size()));
  check(static_cast<bool>(header_), part("header"));
  check(static_cast<bool>(pixels_), part("pixels"));
  ++frames_;
}

void SequenceFile::close() {
  check(static_cast<bool>(header_.flush()), part("header"));
  check(static_cast<bool>(pixels_.flush()), part("pixels"));
  std::ofstream out(file_, std::ios::binary);
  // Spacing and origin say nothing here: ImageToProbe places the pixels.
  out << "ObjectType = Image\nNDims = 3\nAnatomicalOrientation = RAI\nBinaryData = True\n"
         "BinaryDataByteOrderMSB = False\nCenterOfRotation = 0 0 0\nCompressedData = False\n"
      << fmt::format("DimSize = {} {} {}\n", width_, height_, frames_)
      << "Kinds = domain domain list\nElementSpacing = 1 1 1\nElementType = MET_UCHAR\nOffset = 0 0 0\n"
         "TransformMatrix = 1 0 0 0 1 0 0 0 1\nUltrasoundImageOrientation = MF\nUltrasoundImageType = BRIGHTNESS\n";
  const bool sound =
      append(out, part("header")) && out << "ElementDataFile = LOCAL\n" && append(out, part("pixels")) && out.flush();
  check(sound, file_);
  remove_parts();
}

}  // namespace stylet::tracking

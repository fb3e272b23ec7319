#include "engine/import/nifti.h"

#include "engine/files/error.h"
#include "engine/files/json_scan.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

namespace stylet::import {
namespace {

using files::ContentError;

constexpr std::size_t kHeader1 = 348;
constexpr std::size_t kHeader2 = 540;
constexpr double kMostExtent = 5;                 // m
constexpr std::size_t kMostExtension = 1u << 20;  // of the header, that names of labels are looked for in

/// The bytes of a file from front to back, inflated where it is gzipped.
class ByteStream {
public:
  ByteStream(std::span<const std::byte> bytes, const std::string& file) : bytes_(bytes), file_(file) {
    gzipped_ = bytes.size() >= 2 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b};
    if (!gzipped_) return;
    if (inflateInit2(&inflater_, 15 + 16) != Z_OK) throw ContentError(file_ + ": no memory to inflate it");
    inflater_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes_.data()));
    inflater_.avail_in = static_cast<uInt>(bytes_.size());
  }
  ~ByteStream() {
    if (gzipped_) inflateEnd(&inflater_);
  }
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  /// Fills `out` whole. @throws ContentError  damaged or too short
  void read(std::span<std::byte> out) {
    if (!gzipped_) {
      if (out.size() > bytes_.size() - position_) truncated();
      std::memcpy(out.data(), bytes_.data() + position_, out.size());
      position_ += out.size();
      return;
    }
    inflater_.next_out = reinterpret_cast<Bytef*>(out.data());
    inflater_.avail_out = static_cast<uInt>(out.size());
    while (inflater_.avail_out > 0) {
      const int status = inflate(&inflater_, Z_NO_FLUSH);
      if (status == Z_STREAM_END && inflater_.avail_out > 0) truncated();
      if (status != Z_OK && status != Z_STREAM_END) {
        if (status == Z_BUF_ERROR) truncated();
        throw ContentError(fmt::format("{}: its gzip data is damaged ({}); copy the file again", file_,
                                       inflater_.msg != nullptr ? inflater_.msg : "no reason given"));
      }
    }
  }

  void skip(std::size_t count) {
    std::array<std::byte, 4096> dropped;
    for (; count > 0; count -= std::min(count, dropped.size())) {
      read(std::span(dropped).first(std::min(count, dropped.size())));
    }
  }

private:
  [[noreturn]] void truncated() const { throw ContentError(file_ + ": ends too early; copy the file again"); }

  std::span<const std::byte> bytes_;
  const std::string& file_;
  std::size_t position_ = 0;
  bool gzipped_ = false;
  z_stream inflater_{};
};

/// Numbers of a header, in the byte order of the file.
class Header {
public:
  Header(std::vector<std::byte> bytes, bool swapped, int version)
      : bytes_(std::move(bytes)), swapped_(swapped), version_(version) {}

  template <typename T>
  T at(std::size_t offset) const {
    std::array<std::byte, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + offset, sizeof(T));
    if (swapped_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }
  int version() const { return version_; }
  bool swapped() const { return swapped_; }
  std::string_view magic() const {
    return {reinterpret_cast<const char*>(bytes_.data()) + (version_ == 1 ? 344 : 4), 3};
  }

  // Where NIfTI-1 and NIfTI-2 keep the same things.
  std::int64_t dim(std::size_t i) const {
    return version_ == 1 ? at<std::int16_t>(40 + 2 * i) : at<std::int64_t>(16 + 8 * i);
  }
  double pixdim(std::size_t i) const { return version_ == 1 ? at<float>(76 + 4 * i) : at<double>(104 + 8 * i); }
  int datatype() const { return at<std::int16_t>(version_ == 1 ? 70 : 12); }
  double data_offset() const { return version_ == 1 ? at<float>(108) : static_cast<double>(at<std::int64_t>(168)); }
  double slope() const { return version_ == 1 ? at<float>(112) : at<double>(176); }
  double intercept() const { return version_ == 1 ? at<float>(116) : at<double>(184); }
  int units() const { return version_ == 1 ? at<std::int8_t>(123) : at<std::int32_t>(500); }
  int qform() const { return version_ == 1 ? at<std::int16_t>(252) : at<std::int32_t>(344); }
  int sform() const { return version_ == 1 ? at<std::int16_t>(254) : at<std::int32_t>(348); }
  double quatern(std::size_t i) const { return version_ == 1 ? at<float>(256 + 4 * i) : at<double>(352 + 8 * i); }
  double qoffset(std::size_t i) const { return version_ == 1 ? at<float>(268 + 4 * i) : at<double>(376 + 8 * i); }
  double srow(std::size_t r, std::size_t c) const {
    return version_ == 1 ? at<float>(280 + 16 * r + 4 * c) : at<double>(400 + 32 * r + 8 * c);
  }

private:
  std::vector<std::byte> bytes_;
  bool swapped_;
  int version_;
};

template <typename T>
T reversed(T value) {
  auto raw = std::bit_cast<std::array<std::byte, sizeof(T)>>(value);
  std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

Header read_header(ByteStream& stream, const std::string& file) {
  std::vector<std::byte> bytes(kHeader1);
  stream.read(bytes);
  std::int32_t size = 0;
  std::memcpy(&size, bytes.data(), sizeof size);
  for (const bool swapped : {false, true}) {
    const std::int32_t read = swapped ? reversed(size) : size;
    if (read == static_cast<std::int32_t>(kHeader1)) return {std::move(bytes), swapped, 1};
    if (read != static_cast<std::int32_t>(kHeader2)) continue;
    bytes.resize(kHeader2);
    stream.read(std::span(bytes).subspan(kHeader1));
    return {std::move(bytes), swapped, 2};
  }
  throw ContentError(file + ": is no NIfTI file: its header has the wrong size");
}

/// RAS, in the file's unit, from voxel indices.
Eigen::Affine3d ras_from_voxel(const Header& header, const std::string& file, std::vector<std::string>& warnings) {
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  if (header.sform() > 0) {
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 4; ++c) {
        out.matrix()(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = header.srow(r, c);
      }
    }
    return out;
  }
  const Eigen::Vector3d spacing(header.pixdim(1), header.pixdim(2), header.pixdim(3));
  if (header.qform() > 0) {
    const Eigen::Vector3d v(header.quatern(0), header.quatern(1), header.quatern(2));
    const double w2 = 1 - v.squaredNorm();
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond(std::sqrt(std::max(0.0, w2)), v.x(), v.y(), v.z()).normalized();
    const double handedness = header.pixdim(0) < 0 ? -1 : 1;
    out.linear() = turn.toRotationMatrix() * Eigen::Vector3d(1, 1, handedness).cwiseProduct(spacing).asDiagonal();
    out.translation() << header.qoffset(0), header.qoffset(1), header.qoffset(2);
    return out;
  }
  warnings.push_back(file + ": says nothing about its orientation; taken as right, anterior, superior (RAS)");
  out.linear() = spacing.asDiagonal();
  return out;
}

double metres_per_unit(const Header& header, const std::string& file, std::vector<std::string>& warnings) {
  switch (header.units() & 7) {
    case 1:
      return 1;
    case 2:
      return 1e-3;
    case 3:
      return 1e-6;
    default:
      warnings.push_back(file + ": says nothing about its unit; taken as millimetres");
      return 1e-3;
  }
}

/// Reads `count` values of type T and turns them into labels.
template <typename T>
void read_labels(ByteStream& stream, const Header& header, const std::string& file, std::vector<std::uint16_t>& out,
                 const files::Pulse& pulse) {
  const double slope = header.slope();
  const bool scaled = std::isfinite(slope) && slope != 0 && (slope != 1 || header.intercept() != 0);
  std::vector<T> row(std::min<std::size_t>(out.size(), files::Pulse::kOften));
  for (std::size_t first = 0; first < out.size(); first += row.size()) {
    const std::span<T> part = std::span(row).first(std::min(row.size(), out.size() - first));
    pulse(part.size());
    stream.read(std::as_writable_bytes(part));
    for (std::size_t i = 0; i < part.size(); ++i) {
      double value = static_cast<double>(header.swapped() ? reversed(part[i]) : part[i]);
      if (scaled) value = slope * value + header.intercept();
      if (!(value >= 0 && value <= std::numeric_limits<std::uint16_t>::max()) || value != std::floor(value)) {
        throw ContentError(
            fmt::format("{}: voxel {} is {:g}, a label is a whole number from 0 to 65535; this looks like an image, "
                        "give its segmentation",
                        file, first + i, value));
      }
      out[first + i] = static_cast<std::uint16_t>(value);
    }
  }
}

/// Names of labels in a header extension, as Connectome Workbench and TotalSegmentator write them:
/// <Label Key="5" ...><![CDATA[liver]]></Label>. What is not of this form is passed over.
std::map<int, std::string> label_names(std::string_view xml) {
  std::map<int, std::string> names;
  for (std::size_t at = xml.find("<Label "); at != std::string_view::npos; at = xml.find("<Label ", at + 1)) {
    const std::size_t head = xml.find('>', at), end = xml.find("</Label>", at);
    const std::size_t key = xml.find("Key=\"", at);
    if (end == std::string_view::npos || head > end || key == std::string_view::npos || key > head) continue;
    int label = 0;
    const char* digits = xml.data() + key + 5;
    if (std::from_chars(digits, xml.data() + head, label).ec != std::errc{}) continue;
    std::string_view name = xml.substr(head + 1, end - head - 1);
    constexpr std::string_view kOpen = "<![CDATA[", kClose = "]]>";
    if (name.starts_with(kOpen) && name.ends_with(kClose)) {
      name = name.substr(kOpen.size(), name.size() - kOpen.size() - kClose.size());
    }
    if (!name.empty() && label > 0) names[label] = files::printable(std::string(name));
  }
  return names;
}

}  // namespace

std::map<std::uint16_t, std::size_t> LabelImage::counts() const {
  std::vector<std::size_t> histogram(std::size_t{1} << 16, 0);
  for (const std::uint16_t label : labels) ++histogram[label];
  std::map<std::uint16_t, std::size_t> out;
  for (std::size_t label = 0; label < histogram.size(); ++label) {
    if (histogram[label] > 0) out.emplace(static_cast<std::uint16_t>(label), histogram[label]);
  }
  return out;
}

bool looks_like_nifti(std::span<const std::byte> bytes) {
  if (bytes.size() >= 2 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b}) return true;
  if (bytes.size() < kHeader1) return false;
  std::int32_t size = 0;
  std::memcpy(&size, bytes.data(), sizeof size);
  for (const auto header : {kHeader1, kHeader2}) {
    const auto expected = static_cast<std::int32_t>(header);
    if (size == expected || reversed(size) == expected) return true;
  }
  return false;
}

LabelImage read_nifti_labels(std::span<const std::byte> bytes, const std::filesystem::path& name,
                             const NiftiLimits& limits, const files::Pulse& pulse) {
  const std::string file = name.string();
  if (bytes.size() > limits.file_bytes) {
    throw ContentError(
        fmt::format("{}: has {} MB, accepted are {}", file, bytes.size() >> 20, limits.file_bytes >> 20));
  }
  ByteStream stream(bytes, file);
  const Header header = read_header(stream, file);
  if (header.magic() == "ni1" || header.magic() == "ni2") {
    throw ContentError(file + ": is the header of a pair of files; save it as a single .nii.gz");
  }
  if (header.magic() != "n+1" && header.magic() != "n+2") {
    throw ContentError(file + ": is no NIfTI file: its magic is wrong");
  }

  LabelImage image;
  const std::int64_t dimensions = header.dim(0);
  if (dimensions < 3 || dimensions > 7) {
    throw ContentError(fmt::format("{}: has {} dimensions; give a volume", file, dimensions));
  }
  double voxels = 1;
  for (std::size_t i = 1; i <= static_cast<std::size_t>(dimensions); ++i) {
    const std::int64_t n = header.dim(i);
    if (n < 1 || n > 100'000) throw ContentError(fmt::format("{}: has {} voxels along axis {}", file, n, i));
    if (i > 3 && n != 1) {
      throw ContentError(fmt::format("{}: has {} volumes; give one segmentation", file, n));
    }
    if (i <= 3) image.size[static_cast<Eigen::Index>(i - 1)] = static_cast<int>(n);
    voxels *= static_cast<double>(n);
  }
  if (voxels > static_cast<double>(limits.voxels)) {
    throw ContentError(fmt::format("{}: has {:.3g} voxels, accepted are {:.3g}; crop or resample it", file, voxels,
                                   static_cast<double>(limits.voxels)));
  }

  // The least that so many voxels take in a file: deflate shrinks by 1032 at most.
  const bool gzipped = bytes[0] == std::byte{0x1f};
  if (voxels > static_cast<double>(bytes.size()) * (gzipped ? 1032 : 1)) {
    throw ContentError(
        fmt::format("{}: announces {:.3g} voxels and has {} bytes; copy the file again", file, voxels, bytes.size()));
  }

  const double metres = metres_per_unit(header, file, image.warnings);
  const Eigen::Affine3d ras = ras_from_voxel(header, file, image.warnings);
  Eigen::Matrix3d patient_from_ras;
  patient_from_ras << -1, 0, 0, 0, 0, 1, 0, 1, 0;
  image.patient_from_voxel.linear() = metres * patient_from_ras * ras.linear();
  image.patient_from_voxel.translation() = metres * patient_from_ras * ras.translation();
  const double cell = std::abs(image.patient_from_voxel.linear().determinant());
  const Eigen::Vector3d extent = image.patient_from_voxel.linear().cwiseAbs() * image.size.cast<double>();
  if (!image.patient_from_voxel.matrix().allFinite() || !(cell > 1e-15) || !(extent.maxCoeff() < kMostExtent)) {
    throw ContentError(
        fmt::format("{}: its voxels measure {:.3g} mm^3 and the volume {:.3g} m; its orientation or "
                    "unit is wrong",
                    file, cell * 1e9, extent.maxCoeff()));
  }

  const std::size_t header_bytes = header.version() == 1 ? kHeader1 : kHeader2;
  const double offset = header.data_offset();
  if (!(offset >= static_cast<double>(header_bytes) && offset < 1e8)) {
    throw ContentError(fmt::format("{}: its data begin at byte {:g}; the file is damaged", file, offset));
  }
  std::string extension(std::min(static_cast<std::size_t>(offset) - header_bytes, kMostExtension), '\0');
  stream.read(std::as_writable_bytes(std::span(extension)));
  image.names = label_names(extension);
  stream.skip(static_cast<std::size_t>(offset) - header_bytes - extension.size());
  image.labels.resize(static_cast<std::size_t>(voxels));
  switch (header.datatype()) {
    case 2:
      read_labels<std::uint8_t>(stream, header, file, image.labels, pulse);
      break;
    case 4:
      read_labels<std::int16_t>(stream, header, file, image.labels, pulse);
      break;
    case 8:
      read_labels<std::int32_t>(stream, header, file, image.labels, pulse);
      break;
    case 16:
      read_labels<float>(stream, header, file, image.labels, pulse);
      break;
    case 64:
      read_labels<double>(stream, header, file, image.labels, pulse);
      break;
    case 256:
      read_labels<std::int8_t>(stream, header, file, image.labels, pulse);
      break;
    case 512:
      read_labels<std::uint16_t>(stream, header, file, image.labels, pulse);
      break;
    case 768:
      read_labels<std::uint32_t>(stream, header, file, image.labels, pulse);
      break;
    case 1024:
      read_labels<std::int64_t>(stream, header, file, image.labels, pulse);
      break;
    case 1280:
      read_labels<std::uint64_t>(stream, header, file, image.labels, pulse);
      break;
    default:
      throw ContentError(
          fmt::format("{}: its voxels are of type {}; save it with whole numbers", file, header.datatype()));
  }
  const std::size_t different = image.counts().size();
  if (different > limits.labels) {
    throw ContentError(
        fmt::format("{}: has {} different values; this looks like an image, give its segmentation", file, different));
  }
  return image;
}

}  // namespace stylet::import

// The sequence file, read back by a parser that knows nothing of the writer; and positions by hand.
#include "engine/tracking/sequence_file.h"

#include "engine/tracking/tracked_transforms.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

namespace stylet::tracking {
namespace {

struct MetaImage {
  std::map<std::string, std::string> fields;
  std::string last_field;
  std::string pixels;

  explicit MetaImage(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    for (std::string line; last_field != "ElementDataFile" && std::getline(in, line);) {
      const auto equals = line.find(" = ");
      ADD_FAILURE_IF(equals == std::string::npos, line);
      last_field = line.substr(0, equals);
      ADD_FAILURE_IF(fields.count(last_field) > 0, line);
      fields[last_field] = line.substr(equals + 3);
    }
    pixels.assign(std::istreambuf_iterator<char>(in), {});
  }
  std::vector<double> numbers(const std::string& key) const {
    const auto field = fields.find(key);
    if (field == fields.end()) return {};
    std::istringstream text(field->second);
    return {std::istream_iterator<double>(text), {}};
  }
  static void ADD_FAILURE_IF(bool wrong, const std::string& line) {
    if (wrong) ADD_FAILURE() << line;
  }
};

TEST(SequenceFile, GivesBackPixelsTimesAndTransforms) {
  const support::TemporaryFolder folder;
  const int width = 5;
  const int height = 3;
  const int frames = 12;
  const auto pixel = [](int frame, int i) { return static_cast<std::uint8_t>(frame * 17 + i * 29); };
  const auto element = [](int frame, int row, int column) { return frame + 0.1 * row - std::sqrt(2.0) * column; };
  SequenceFile sequence(folder / "run.igs.mha", width, height);
  for (int f = 0; f < frames; ++f) {
    std::vector<std::uint8_t> grey(static_cast<std::size_t>(width) * height);
    for (int i = 0; i < width * height; ++i) grey[i] = pixel(f, i);
    SequenceFrame frame{.time_s = 0.25 * f, .pixels = grey, .transforms = {{"ProbeToTracker"}, {"NeedleToTracker"}}};
    for (int i = 0; i < 12; ++i) frame.transforms[0].matrix(i / 4, i % 4) = element(f, i / 4, i % 4);
    sequence.add(frame);
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "run.igs.mha")) << "nothing half-done has the file's name";
  sequence.close();

  const MetaImage read(folder / "run.igs.mha");
  EXPECT_EQ(read.last_field, "ElementDataFile") << "the field that pixels follow";
  EXPECT_EQ(read.fields.at("ElementDataFile"), "LOCAL");
  EXPECT_EQ(read.fields.at("NDims"), "3");
  EXPECT_EQ(read.fields.at("ElementType"), "MET_UCHAR");
  EXPECT_EQ(read.fields.at("UltrasoundImageOrientation"), "MF");
  EXPECT_EQ(read.fields.at("UltrasoundImageType"), "BRIGHTNESS");
  EXPECT_EQ(read.numbers("DimSize"), (std::vector<double>{width, height, frames}));
  ASSERT_EQ(read.pixels.size(), std::size_t(width * height * frames));
  for (int f = 0; f < frames; ++f) {
    const std::string key = "Seq_Frame00" + std::string(f < 10 ? "0" : "") + std::to_string(f) + "_";
    EXPECT_EQ(read.numbers(key + "Timestamp"), std::vector<double>{0.25 * f});
    EXPECT_EQ(read.fields.at(key + "ProbeToTrackerTransformStatus"), "OK");
    EXPECT_EQ(read.fields.at(key + "NeedleToTrackerTransformStatus"), "OK");
    const std::vector<double> matrix = read.numbers(key + "ProbeToTrackerTransform");
    ASSERT_EQ(matrix.size(), 16u);
    for (int i = 0; i < 12; ++i) EXPECT_NEAR(matrix[i], element(f, i / 4, i % 4), 1e-7);
    EXPECT_EQ(matrix[15], 1);
    for (int i = 0; i < width * height; ++i) {
      ASSERT_EQ(static_cast<std::uint8_t>(read.pixels[f * width * height + i]), pixel(f, i));
    }
  }
}

TEST(SequenceFile, LeavesNothingBesideItself) {
  const support::TemporaryFolder folder;
  const auto files = [&] {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
      names.push_back(entry.path().filename());
    }
    return names;
  };
  {
    SequenceFile abandoned(folder / "half.igs.mha", 2, 2);
    const std::vector<std::uint8_t> grey(4);
    abandoned.add({.pixels = grey});
  }
  {
    SequenceFile empty(folder / "empty.igs.mha", 2, 2);
    empty.close();
    EXPECT_EQ(files(), std::vector<std::string>{"empty.igs.mha"}) << "from close() on";
  }
  EXPECT_EQ(MetaImage(folder / "empty.igs.mha").fields.at("DimSize"), "2 2 0");
}

TEST(SequenceFile, RefusesAFolderThatIsNotThere) {
  EXPECT_ANY_THROW(SequenceFile("/nowhere/at/all.igs.mha", 2, 2));
}

/// By name; an empty matrix where there is none.
Eigen::Matrix4d transform(const std::vector<NamedTransform>& transforms, const std::string& name) {
  for (const NamedTransform& t : transforms) {
    if (t.name == name) return t.matrix;
  }
  ADD_FAILURE() << name;
  return Eigen::Matrix4d::Zero();
}

TEST(TrackedTransforms, PutAPixelWhereItIsInThePatientsRas) {
  // A probe on the belly, 0.1 m left, 0.2 m up, 0.3 m in front, that looks backwards (-Z) with its lateral axis to
  // the patient's left (+X): its elevation is then -Y.
  state::FrameState state;
  state.probe_position = {0.1F, 0.2F, 0.3F};
  Eigen::Matrix3f axes;
  axes << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  state.probe_orientation = axes;
  state.needle_positions = {{0, 0, 0}, {0.01F, 0.02F, 0.03F}};
  state.needle_orientations.assign(2, Eigen::Quaternionf::Identity());
  state.targets = {{.centre = {0.04F, 0.05F, 0.06F}}};
  const ultrasound::SectorGeometry image{
      .width = 11, .height = 20, .metres_per_pixel = 0.001, .origin = {-0.0055, -0.002}};
  const auto transforms = tracked_transforms(state, image);
  const Eigen::Matrix4d image_to_probe = transform(transforms, "ImageToProbe");
  const Eigen::Matrix4d to_tracker = transform(transforms, "ProbeToTracker") * image_to_probe;
  // The middle column is the axis of the probe. Row r has its centre (r - 1.5) mm below the face.
  const auto expect_at = [](const Eigen::Vector4d& found, double x, double y, double z) {
    EXPECT_NEAR(found.x(), x, 1e-3);
    EXPECT_NEAR(found.y(), y, 1e-3);
    EXPECT_NEAR(found.z(), z, 1e-3);
  };
  expect_at(image_to_probe * Eigen::Vector4d(5, 10, 0, 1), 0, 0, 8.5);
  expect_at(to_tracker * Eigen::Vector4d(5, 10, 0, 1), -100, 300 - 8.5, 200);  // right, anterior, superior
  expect_at(to_tracker * Eigen::Vector4d(6, 10, 0, 1), -101, 300 - 8.5, 200);  // one pixel further left
  expect_at(transform(transforms, "NeedleTipToTracker").col(3), -10, 30, 20);
  expect_at(transform(transforms, "NeedleToTracker").col(2), 0, 1, 0);  // along +Z, anterior
  expect_at(transform(transforms, "TargetToTracker").col(3), -40, 60, 50);
  for (const NamedTransform& t : transforms) {
    EXPECT_GT((t.matrix.topLeftCorner<3, 3>().determinant()), 0) << t.name << " is not right-handed";
  }
}

}  // namespace
}  // namespace stylet::tracking

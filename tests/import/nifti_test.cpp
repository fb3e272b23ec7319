// Label volumes: every number type, byte order and orientation gives the same labels at the same place.
#include "engine/import/nifti.h"
#include "engine/files/error.h"
#include "engine/import/label_solid.h"
#include "tests/import/file_bytes.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

namespace stylet::import {
namespace {

using files::ContentError;
using test::bytes_of;

constexpr std::array<std::int16_t, 3> kSize{4, 3, 2};

/// A NIfTI-1 file in memory; 24 voxels valued 0, 1, 2, ... modulo 5.
struct Volume {
  std::string header = std::string(352, '\0');
  int datatype = 2;
  bool swapped = false;

  Volume() {
    set<std::int32_t>(0, 348);
    set<std::int16_t>(40, 3);
    for (std::size_t i = 0; i < 3; ++i) {
      set<std::int16_t>(42 + 2 * i, kSize[i]);
      set<float>(80 + 4 * i, 2.0F);
    }
    set<float>(108, 352);
    header[123] = 2;  // millimetres
    std::memcpy(header.data() + 344, "n+1", 4);
    // As 3D Slicer has it: left, posterior, superior become -x, -y, z of RAS.
    set<std::int16_t>(254, 1);
    const std::array<float, 12> srow{-2, 0, 0, 10, 0, -3, 0, 20, 0, 0, 5, 30};
    for (std::size_t i = 0; i < 12; ++i) set<float>(280 + 4 * i, srow[i]);
  }

  template <typename T>
  void set(std::size_t offset, T value) {
    std::memcpy(header.data() + offset, &value, sizeof value);
  }

  template <typename T>
  std::string with_voxels(int type) {
    set<std::int16_t>(70, static_cast<std::int16_t>(type));
    std::string out = header;
    for (int v = 0; v < 24; ++v) {
      const T value = static_cast<T>(v % 5);
      out.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    return out;
  }
};

std::string gzipped(const std::string& text) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

void expect_volume(const LabelImage& image) {
  EXPECT_EQ(image.size, Eigen::Vector3i(4, 3, 2));
  ASSERT_EQ(image.labels.size(), 24u);
  for (std::size_t v = 0; v < 24; ++v) EXPECT_EQ(image.labels[v], v % 5);
  // Voxel (1, 1, 1): RAS (8, 17, 35) mm, so left -8, superior 35, anterior 17 mm.
  EXPECT_TRUE(
      (image.patient_from_voxel * Eigen::Vector3d(1, 1, 1)).isApprox(Eigen::Vector3d(-8, 35, 17) * 1e-3, 1e-6));
  EXPECT_TRUE(image.warnings.empty());
}

std::string refusal(const std::string& bytes, const NiftiLimits& limits = {}) {
  try {
    read_nifti_labels(bytes_of(bytes), "a.nii", limits);
  } catch (const ContentError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "";
}

TEST(Nifti, EveryNumberTypeHoldsTheSameLabels) {
  Volume v;
  for (const std::string& file :
       {v.with_voxels<std::uint8_t>(2), v.with_voxels<std::int16_t>(4), v.with_voxels<std::int32_t>(8),
        v.with_voxels<float>(16), v.with_voxels<double>(64), v.with_voxels<std::int8_t>(256),
        v.with_voxels<std::uint16_t>(512), v.with_voxels<std::uint32_t>(768), v.with_voxels<std::int64_t>(1024),
        v.with_voxels<std::uint64_t>(1280)}) {
    EXPECT_TRUE(looks_like_nifti(bytes_of(file)));
    expect_volume(read_nifti_labels(bytes_of(file), "a.nii"));
    expect_volume(read_nifti_labels(bytes_of(gzipped(file)), "a.nii.gz"));
  }
}

TEST(Nifti, OtherByteOrderIsTheSameVolume) {
  std::string file = Volume().with_voxels<std::int16_t>(4);
  const auto reverse = [&](std::size_t offset, std::size_t size, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto first = file.begin() + static_cast<std::ptrdiff_t>(offset + i * size);
      std::reverse(first, first + static_cast<std::ptrdiff_t>(size));
    }
  };
  reverse(0, 4, 1);     // size of the header
  reverse(40, 2, 8);    // dim
  reverse(70, 2, 2);    // datatype, bits
  reverse(76, 4, 8);    // pixdim
  reverse(108, 4, 3);   // offset, slope, intercept
  reverse(252, 2, 2);   // codes
  reverse(256, 4, 18);  // quaternion, offset, rows
  reverse(352, 2, 24);  // voxels
  expect_volume(read_nifti_labels(bytes_of(file), "a.nii"));
}

TEST(Nifti, QuaternionAndRowsSayTheSame) {
  Volume v;
  v.set<std::int16_t>(254, 0);
  v.set<std::int16_t>(252, 1);
  v.set<float>(76, 1);  // handedness
  const std::array<float, 3> spacing{2, 3, 5};
  for (std::size_t i = 0; i < 3; ++i) v.set<float>(80 + 4 * i, spacing[i]);
  v.set<float>(256 + 8, 1);  // half a turn about z: x and y change sign
  const std::array<float, 3> offset{10, 20, 30};
  for (std::size_t i = 0; i < 3; ++i) v.set<float>(268 + 4 * i, offset[i]);
  expect_volume(read_nifti_labels(bytes_of(v.with_voxels<std::uint8_t>(2)), "a.nii"));
}

/// The label of a place in RAS, mm: a lopsided lump that no turn or mirror brings onto itself.
std::uint8_t lump(const Eigen::Vector3d& ras) {
  const Eigen::Vector3d x = ras - Eigen::Vector3d(30, -50, 70);
  const bool body = x.cwiseQuotient(Eigen::Vector3d(13, 9, 7)).norm() < 1;
  const bool horn = (x - Eigen::Vector3d(8, 5, 4)).norm() < 6;
  return body || horn ? 3 : 0;
}

TEST(Nifti, EveryOrientationIsTheSameSolidAtTheSamePlace) {
  const Eigen::Vector3d first(10, -70, 55), spacing(2, 1.5, 1);  // RAS, mm
  const Eigen::Vector3i count(22, 30, 34);
  // The same samples summed up here, in the patient frame: (-x, z, y).
  double volume = 0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (int k = 0; k < count.z(); ++k) {
    for (int j = 0; j < count.y(); ++j) {
      for (int i = 0; i < count.x(); ++i) {
        const Eigen::Vector3d ras = first + spacing.cwiseProduct(Eigen::Vector3d(i, j, k));
        if (lump(ras) == 0) continue;
        volume += 1;
        centroid += Eigen::Vector3d(-ras.x(), ras.z(), ras.y()) * 1e-3;
      }
    }
  }
  centroid /= volume;
  volume *= spacing.prod() * 1e-9;

  std::vector<double> distances;  // of the first orientation
  std::array<int, 3> axes{0, 1, 2};
  do {
    for (int flips = 0; flips < 8; ++flips) {
      // Voxel axis a runs along RAS axis axes[a], backwards where its bit of `flips` is set.
      Volume v;
      Eigen::Matrix<double, 3, 4> ras_from_voxel = Eigen::Matrix<double, 3, 4>::Zero();
      ras_from_voxel.col(3) = first;
      std::array<int, 3> size{};
      for (int a = 0; a < 3; ++a) {
        const int r = axes[a];
        const bool backwards = (flips >> a & 1) != 0;
        size[a] = count[r];
        v.set<std::int16_t>(42 + 2 * static_cast<std::size_t>(a), static_cast<std::int16_t>(count[r]));
        ras_from_voxel(r, a) = backwards ? -spacing[r] : spacing[r];
        if (backwards) ras_from_voxel(r, 3) += spacing[r] * (count[r] - 1);
      }
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 4; ++c) {
          v.set<float>(280 + 4 * static_cast<std::size_t>(4 * r + c), static_cast<float>(ras_from_voxel(r, c)));
        }
      }
      v.set<std::int16_t>(70, 2);
      std::string file = v.header;
      for (int k = 0; k < size[2]; ++k) {
        for (int j = 0; j < size[1]; ++j) {
          for (int i = 0; i < size[0]; ++i) {
            file += static_cast<char>(lump(ras_from_voxel * Eigen::Vector4d(i, j, k, 1)));
          }
        }
      }

      const LabelImage image = read_nifti_labels(bytes_of(file), "a.nii");
      const std::array labels{3};
      const LabelSolid solid(image, labels);
      EXPECT_NEAR(solid.volume(), volume, 1e-9 * volume);
      EXPECT_FALSE(solid.touches_rim());
      // Probes of a lattice that has nothing to do with the voxels.
      Eigen::Vector3d inside = Eigen::Vector3d::Zero();
      double inner = 0;
      std::vector<double> probed;
      for (int k = -10; k <= 10; ++k) {
        for (int j = -10; j <= 10; ++j) {
          for (int i = -10; i <= 10; ++i) {
            const Eigen::Vector3d x = centroid + 1.7e-3 * Eigen::Vector3d(i, j, k);
            const double d = solid.signed_distance(x);
            probed.push_back(d);
            if (d >= 0) continue;
            inside += x;
            inner += 1;
          }
        }
      }
      // A third of a voxel: smoothing rounds the horn off, and about a thousand probes are inside.
      EXPECT_LT((inside / inner - centroid).norm(), 0.5e-3) << axes[0] << axes[1] << axes[2] << " " << flips;
      if (distances.empty()) distances = probed;
      double apart = 0;
      for (std::size_t p = 0; p < probed.size(); ++p) apart = std::max(apart, std::abs(probed[p] - distances[p]));
      EXPECT_LT(apart, 1e-6) << "rounding of floats, m: " << axes[0] << axes[1] << axes[2] << " " << flips;
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
}

TEST(Nifti, SaysWhatItAssumes) {
  Volume v;
  v.set<std::int16_t>(254, 0);
  v.header[123] = 0;
  const LabelImage image = read_nifti_labels(bytes_of(v.with_voxels<std::uint8_t>(2)), "a.nii");
  EXPECT_EQ(image.warnings.size(), 2u);  // unit, orientation
}

// A scan may be large where an organ is not: what counts is the box around the labels, here 2 + 6 voxels wide.
TEST(LabelSolid, CountsTheVoxelsAroundItsLabels) {
  LabelImage image;
  image.size = Eigen::Vector3i(40, 40, 40);
  image.patient_from_voxel.linear() *= 1e-3;
  image.labels.assign(64'000, 0);
  for (const std::size_t v : {20UL, 21UL}) image.labels[20 + 40 * (20 + 40 * v)] = 3;
  const std::array labels{3};
  EXPECT_NEAR(LabelSolid(image, labels, 7 * 7 * 8).volume(), 2e-9, 1e-15);
  try {
    const LabelSolid solid(image, labels, 7 * 7 * 8 - 1);
    FAIL() << "one voxel too many";
  } catch (const files::ContentError& e) {
    EXPECT_STREQ(
        e.what(),
        "the box around its labels has 7 x 7 x 8 voxels, 392 in all, accepted are 391; resample the volume to "
        "larger voxels");
  }
}

TEST(Nifti, RefusesWhatIsWrongInOneLine) {
  const std::string good = Volume().with_voxels<std::uint8_t>(2);
  EXPECT_NE(refusal(good.substr(0, 370)).find("ends too early"), std::string::npos);
  EXPECT_NE(refusal(good.substr(0, 100)).find("ends too early"), std::string::npos);
  const std::string packed = gzipped(good);
  EXPECT_NE(refusal(packed.substr(0, packed.size() / 2)).find("ends too early"), std::string::npos);
  std::string broken = packed;
  broken[12] = static_cast<char>(~broken[12]);
  EXPECT_FALSE(refusal(broken).empty());
  const auto changed = [](const std::function<void(Volume&)>& change) {
    Volume v;
    change(v);
    return refusal(v.with_voxels<std::uint8_t>(2));
  };
  EXPECT_NE(changed([](Volume& v) { v.set<std::int32_t>(0, 347); }).find("wrong size"), std::string::npos);
  EXPECT_NE(changed([](Volume& v) { v.header[345] = 'x'; }).find("magic"), std::string::npos);
  EXPECT_NE(changed([](Volume& v) { v.set<std::int16_t>(40, 2); }).find("2 dimensions"), std::string::npos);
  EXPECT_NE(changed([](Volume& v) { v.set<std::int16_t>(42, -4); }).find("-4 voxels along axis 1"),
            std::string::npos);
  EXPECT_NE(changed([](Volume& v) { v.set<std::int16_t>(42, 4000); }).find("announces 2.4e+04 voxels"),
            std::string::npos);
  EXPECT_NE(changed([](Volume& v) { v.set<float>(108, 1e30F); }).find("data begin"), std::string::npos);
  EXPECT_NE(changed([](Volume& v) { v.set<float>(280, std::nanf("")); }).find("orientation"), std::string::npos);
  EXPECT_NE(changed([](Volume& v) { v.set<float>(280, 0); }).find("orientation"), std::string::npos);
  Volume scaled;
  scaled.set<float>(112, 0.5F);
  EXPECT_NE(refusal(scaled.with_voxels<std::uint8_t>(2)).find("looks like an image"), std::string::npos);
  EXPECT_NE(refusal(Volume().with_voxels<float>(128)).find("type 128"), std::string::npos);
  // Said of the header alone: neither file has that many voxels.
  const auto sized = [&](std::int16_t x, std::int16_t y, std::int16_t z) {
    return changed([&](Volume& v) {
      v.set<std::int16_t>(42, x);
      v.set<std::int16_t>(44, y);
      v.set<std::int16_t>(46, z);
    });
  };
  const std::string large = sized(1000, 1000, 300);
  EXPECT_NE(large.find("a.nii: has 3e+08 voxels, accepted are 2.5e+08"), std::string::npos) << large;
  EXPECT_NE(large.find("crop or resample it"), std::string::npos) << large;
  EXPECT_NE(sized(1000, 1000, 250).find("announces 2.5e+08 voxels"), std::string::npos);  // as many as are accepted
  NiftiLimits few;
  few.labels = 3;
  EXPECT_NE(refusal(good, few).find("5 different values"), std::string::npos);
}

TEST(Nifti, LabelsHaveTheNamesOfTheTableInTheHeader) {
  Volume volume;
  volume.set<float>(108, 672);
  std::string bytes = volume.with_voxels<std::uint8_t>(2);
  std::string table =
      "<LabelTable><Label Key=\"1\" Red=\"0\"><![CDATA[liver]]></Label><Label Key=\"2\">spleen</Label>"
      "<Label Key=\"x\">no</Label><Label Key=\"3\"></Label><Label Key=\"4\"><![CDATA[spleen]]></Label><Label "
      "Key=\"7\"";
  table.resize(320, ' ');
  bytes.insert(352, table);
  const LabelImage image = read_nifti_labels(bytes_of(bytes), "named.nii");
  EXPECT_EQ(image.names, (std::map<int, std::string>{{1, "liver"}, {2, "spleen"}, {4, "spleen"}}));
  EXPECT_EQ(image.labels[1], 1) << "voxels begin behind it";
}

}  // namespace
}  // namespace stylet::import

// A torso of labels whose shapes are known: as a segmentation of a CT has it, without the body.
#pragma once

#include "engine/import/nifti.h"

#include <fmt/format.h>

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace stylet::support {

/// Patient frame, m.
struct TorsoOrgan {
  const char* name;
  std::function<bool(const Eigen::Vector3d&)> holds;
};

inline bool in_ellipsoid(const Eigen::Vector3d& x, const Eigen::Vector3d& centre, const Eigen::Vector3d& radii) {
  return (x - centre).cwiseQuotient(radii).squaredNorm() < 1;
}

/// Ribs lie on an ellipse about the body's axis, half as wide and deep as this, and slope down to the front.
inline constexpr double kCageWidth = 0.150, kCageDepth = 0.100;

/// The later counts. Organs of an adult in size and place, simplified.
inline std::vector<TorsoOrgan> torso_organs(double lesion_radius = 0) {
  const auto tube = [](double x, double z, double radius) {
    return [=](const Eigen::Vector3d& p) { return std::hypot(p.x() - x, p.z() - z) < radius; };
  };
  const auto ball = [](Eigen::Vector3d centre, Eigen::Vector3d radii) {
    return [=](const Eigen::Vector3d& p) { return in_ellipsoid(p, centre, radii); };
  };
  std::vector<TorsoOrgan> organs{
      {"vertebrae_L1", tube(0, -0.075, 0.020)},
      {"lung_lower_lobe_right", ball({-0.07, 0.255, 0}, {0.06, 0.030, 0.06})},
      {"liver", ball({-0.065, 0.17, 0.01}, {0.070, 0.065, 0.070})},
      {"stomach", ball({0.075, 0.17, 0.02}, {0.05, 0.05, 0.05})},
      {"colon", ball({0.03, 0.04, 0.03}, {0.09, 0.03, 0.04})},
      {"kidney_right", ball({-0.07, 0.08, -0.055}, {0.025, 0.045, 0.020})},
      {"gallbladder", ball({-0.035, 0.110, 0.060}, {0.013, 0.013, 0.013})},
      {"inferior_vena_cava", tube(-0.022, -0.040, 0.011)},
      {"aorta", tube(0.022, -0.042, 0.010)},
  };
  static constexpr std::array kRibs{"rib_right_8", "rib_right_9", "rib_right_10", "rib_right_11"};
  for (std::size_t i = 0; i < kRibs.size(); ++i) {
    const double y = 0.12 + 0.032 * static_cast<double>(i);
    organs.push_back({kRibs[i], [y](const Eigen::Vector3d& p) {
                        const double angle = std::atan2(p.z() / kCageDepth, p.x() / kCageWidth);
                        if (angle > -0.5 * std::numbers::pi && angle < 0.6 * std::numbers::pi) return false;  // open
                        const double share = std::hypot(p.x() / kCageWidth, p.z() / kCageDepth);
                        const double aside = (share - 1) * std::hypot(p.x(), p.z()) / share;
                        return std::hypot(aside, p.y() - (y - 0.25 * p.z())) < 0.006;
                      }});
  }
  if (lesion_radius > 0)
    organs.push_back({"liver_tumor", ball({-0.075, 0.16, 0.02}, Eigen::Vector3d::Constant(lesion_radius))});
  return organs;
}

/// Voxels of the patient's axes from `low` to `high`, named.
inline import::LabelImage labels_of(const std::vector<TorsoOrgan>& organs, double voxel, const Eigen::Vector3d& low,
                                    const Eigen::Vector3d& high) {
  import::LabelImage image;
  image.size = ((high - low) / voxel).array().round().cast<int>();
  image.patient_from_voxel = Eigen::Translation3d(low + Eigen::Vector3d::Constant(voxel / 2)) * Eigen::Scaling(voxel);
  for (int k = 0; k < image.size.z(); ++k) {
    for (int j = 0; j < image.size.y(); ++j) {
      for (int i = 0; i < image.size.x(); ++i) {
        const Eigen::Vector3d x = image.patient_from_voxel * Eigen::Vector3d(i, j, k);
        std::uint16_t label = 0;
        for (std::size_t o = 0; o < organs.size(); ++o) {
          if (organs[o].holds(x)) label = static_cast<std::uint16_t>(o + 1);
        }
        image.labels.push_back(label);
      }
    }
  }
  for (std::size_t o = 0; o < organs.size(); ++o) image.names[static_cast<int>(o) + 1] = organs[o].name;
  return image;
}

inline import::LabelImage torso_labels(double voxel = 0.003, double lesion_radius = 0) {
  return labels_of(torso_organs(lesion_radius), voxel, {-0.20, 0.0, -0.15}, {0.20, 0.30, 0.15});
}

/// NIfTI-1, not gzipped, with the names as TotalSegmentator writes them.
inline std::string nifti_of(const import::LabelImage& image) {
  std::string names = "<CaretExtension><LabelTable>";
  for (const auto& [label, name] : image.names) {
    names += fmt::format("<Label Key=\"{}\"><![CDATA[{}]]></Label>", label, name);
  }
  names += "</LabelTable></CaretExtension>";
  names.resize((names.size() + 8 + 15) / 16 * 16 - 8, ' ');
  std::string header(352, '\0');
  const auto set = [&](std::size_t at, auto value) { std::memcpy(header.data() + at, &value, sizeof value); };
  set(0, std::int32_t{348});
  set(40, std::int16_t{3});
  for (int axis = 0; axis < 3; ++axis) {
    set(42 + 2 * static_cast<std::size_t>(axis), static_cast<std::int16_t>(image.size[axis]));
    set(80 + 4 * static_cast<std::size_t>(axis),
        static_cast<float>(image.patient_from_voxel.linear()(axis, axis) * 1e3));
  }
  set(70, std::int16_t{512});  // unsigned, 16 bits
  set(72, std::int16_t{16});
  set(108, static_cast<float>(352 + 8 + names.size()));
  header[123] = 2;  // millimetres
  set(254, std::int16_t{1});
  // Right, anterior, superior: what the patient frame has as -x, z, y.
  constexpr std::array kAxis{0, 2, 1};
  for (std::size_t row = 0; row < 3; ++row) {
    const double sign = row == 0 ? -1e3 : 1e3;
    for (int column = 0; column < 4; ++column) {
      set(280 + 16 * row + 4 * static_cast<std::size_t>(column),
          static_cast<float>(sign * image.patient_from_voxel.matrix()(kAxis[row], column)));
    }
  }
  std::memcpy(header.data() + 344, "n+1", 4);
  header[348] = 1;  // an extension follows
  const auto size = static_cast<std::int32_t>(names.size() + 8);
  const std::int32_t code = 0;
  std::string out = header;
  out.append(reinterpret_cast<const char*>(&size), sizeof size);
  out.append(reinterpret_cast<const char*>(&code), sizeof code);
  out += names;
  out.append(reinterpret_cast<const char*>(image.labels.data()), image.labels.size() * sizeof(std::uint16_t));
  return out;
}

}  // namespace stylet::support

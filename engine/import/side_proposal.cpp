#include "engine/import/side_proposal.h"

#include "engine/files/error.h"
#include "engine/import/derived_body.h"

#include <fnmatch.h>

#include <Eigen/Geometry>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>

namespace stylet::import {
namespace {

using files::ContentError;
using Json = nlohmann::ordered_json;

constexpr double kNear = 0.12;  // m from the target's organ: what matters to needle and image
constexpr double kLesion = 20;  // mm, made up
constexpr int kBack = 30;       // % of the target's organ that is held
constexpr int kBehind = 50;     // the same of one behind the peritoneum: its fat and fascia hold it all round

/// What a part is by its name; the first that fits.
struct Known {
  const char* pattern;
  const char* tissue;
  const char* role;
  const char* organ;  ///< parts with the same one make one organ; empty: by itself
};
constexpr const char* kBoundary = "boundary";
constexpr std::array kKnown{
    Known{"*tumo*r*", "tumour", "target", ""},
    Known{"*lesion*", "tumour", "target", ""},
    Known{"*nodule*", "tumour", "target", ""},
    Known{"*metasta*", "tumour", "target", ""},
    Known{"*carcinoma*", "tumour", "target", ""},
    Known{"*cyst*", "cyst_fluid", "target", ""},
    Known{"rib*", "bone", kBoundary, "ribs"},
    Known{"*cartilage*", "cartilage", kBoundary, "costal_cartilages"},
    Known{"vertebra*", "bone", kBoundary, "spine"},
    Known{"sacrum", "bone", kBoundary, "spine"},
    Known{"spine*", "bone", kBoundary, "spine"},
    Known{"sternum", "bone", kBoundary, ""},
    Known{"hip_*", "bone", kBoundary, "hips"},
    Known{"pelvis*", "bone", kBoundary, "hips"},
    Known{"femur*", "bone", kBoundary, "femurs"},
    Known{"humerus*", "bone", kBoundary, "shoulders"},
    Known{"scapula*", "bone", kBoundary, "shoulders"},
    Known{"clavicula*", "bone", kBoundary, "shoulders"},
    Known{"*bone*", "bone", kBoundary, ""},
    Known{"skull", "bone", kBoundary, ""},
    Known{"lung*", "outside", "region", "lungs"},
    Known{"trachea", "outside", "region", "lungs"},
    Known{"liver*", "liver", kBoundary, "liver"},
    Known{"gallbladder*", "bile", "region", ""},
    Known{"portal*", "portal_blood", "vessel", ""},
    Known{"hepatic_v*", "hepatic_blood", "vessel", ""},
    Known{"aorta*", "caval_blood", "vessel", ""},
    Known{"*artery*", "caval_blood", "vessel", "arteries"},
    Known{"*vena_cava*", "caval_blood", "vessel", ""},
    Known{"*vein*", "caval_blood", "vessel", "veins"},
    Known{"*vena*", "caval_blood", "vessel", "veins"},
    Known{"*vessel*", "caval_blood", "vessel", ""},
    Known{"heart*", "caval_blood", "vessel", "heart"},
    Known{"kidney*", "kidney_cortex", kBoundary, ""},
    Known{"spleen", "spleen", kBoundary, ""},
    Known{"pancreas*", "pancreas", kBoundary, "pancreas"},
    Known{"stomach", "bowel", kBoundary, ""},
    Known{"duodenum", "bowel", kBoundary, ""},
    Known{"*bowel*", "bowel", kBoundary, "bowel"},
    Known{"*intestine*", "bowel", kBoundary, "bowel"},
    Known{"colon*", "bowel", kBoundary, ""},
    Known{"rectum", "bowel", kBoundary, ""},
    Known{"esophagus", "bowel", kBoundary, ""},
    Known{"urinary_bladder", "bile", "region", ""},
    Known{"diaphragm", "diaphragm", kBoundary, ""},
    Known{"adrenal*", "muscle", kBoundary, "adrenals"},
    Known{"autochthon*", "muscle", kBoundary, "muscles"},
    Known{"iliopsoas*", "muscle", kBoundary, "muscles"},
    Known{"gluteus*", "muscle", kBoundary, "muscles"},
    Known{"*muscle*", "muscle", kBoundary, "muscles"},
    Known{"*fat*", "peritoneal_fat", kBoundary, ""},
    Known{"*", "muscle", kBoundary, ""},
};

bool fits(const char* pattern, const std::string& name) {
  return ::fnmatch(pattern, name.c_str(), FNM_CASEFOLD) == 0;
}

const Known& known(const std::string& name) {
  return *std::ranges::find_if(kKnown, [&](const Known& row) { return fits(row.pattern, name); });
}

std::string id_of(const std::string& name) {
  std::string id;
  for (const char c : name) {
    id += std::isalnum(static_cast<unsigned char>(c)) != 0
              ? static_cast<char>(std::tolower(static_cast<unsigned char>(c)))
              : '_';
  }
  return id;
}

/// Parts that make one organ.
struct Proposed {
  std::string id;
  const Known* is;
  std::vector<std::string> parts;
  std::vector<int> labels;
  std::vector<const mesh::TriangleMesh*> surfaces;
  Eigen::AlignedBox3d box;  // patient frame, m
};

std::size_t index_of(const LabelImage& image, const Eigen::Vector3i& v) {
  return static_cast<std::size_t>(v.x()) +
         static_cast<std::size_t>(image.size.x()) *
             (static_cast<std::size_t>(v.y()) +
              static_cast<std::size_t>(image.size.y()) * static_cast<std::size_t>(v.z()));
}

std::map<int, Eigen::AlignedBox3d> boxes_of(const LabelImage& image) {
  std::map<int, Eigen::AlignedBox3i> voxels;
  std::size_t i = 0;
  for (int z = 0; z < image.size.z(); ++z) {
    for (int y = 0; y < image.size.y(); ++y) {
      for (int x = 0; x < image.size.x(); ++x, ++i) {
        if (image.labels[i] != 0) voxels[image.labels[i]].extend(Eigen::Vector3i(x, y, z));
      }
    }
  }
  std::map<int, Eigen::AlignedBox3d> boxes;
  for (const auto& [label, box] : voxels) {
    for (int corner = 0; corner < 8; ++corner) {
      const auto type = static_cast<Eigen::AlignedBox3i::CornerType>(corner);
      boxes[label].extend(image.patient_from_voxel * box.corner(type).cast<double>());
    }
  }
  return boxes;
}

/// Faces between voxels of some labels and each other one.
std::map<int, std::size_t> touching(const LabelImage& image, const std::vector<int>& labels) {
  std::map<int, std::size_t> faces;
  const auto among = [&](int label) { return std::ranges::find(labels, label) != labels.end(); };
  const auto count = [&](int a, int b) {
    if (a == b) return;
    if (among(a) && b != 0 && !among(b)) ++faces[b];
    if (among(b) && a != 0 && !among(a)) ++faces[a];
  };
  for (int z = 0; z < image.size.z(); ++z) {
    for (int y = 0; y < image.size.y(); ++y) {
      for (int x = 0; x < image.size.x(); ++x) {
        const int here = image.labels[index_of(image, {x, y, z})];
        if (x > 0) count(here, image.labels[index_of(image, {x - 1, y, z})]);
        if (y > 0) count(here, image.labels[index_of(image, {x, y - 1, z})]);
        if (z > 0) count(here, image.labels[index_of(image, {x, y, z - 1})]);
      }
    }
  }
  return faces;
}

/// How often a surface goes round a point: 1 within a closed one, also where its triangles are not welded.
/// Van Oosterom and Strackee, IEEE TBME 1983.
double winding_number(const mesh::TriangleMesh& surface, const Eigen::Vector3d& x) {
  double sum = 0;
  for (const auto& [i, j, k] : surface.triangles) {
    const Eigen::Vector3d a = surface.vertices[i] - x, b = surface.vertices[j] - x, c = surface.vertices[k] - x;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

std::string list_of(const std::vector<Proposed>& organs) {
  std::string names;
  for (const Proposed& organ : organs) {
    for (const std::string& part : organ.parts) {
      if (names.size() > 400) return names + ", ...";
      names += (names.empty() ? "" : ", ") + part;
    }
  }
  return names;
}

class Proposal {
public:
  Proposal(const std::vector<SourceFile>& files, std::string target) : files_(files), target_(std::move(target)) {
    for (const SourceFile& file : files) {
      const auto boxes = file.image ? boxes_of(*file.image) : std::map<int, Eigen::AlignedBox3d>{};
      for (const SourcePart& part : file.parts) add(part, boxes);
    }
  }

  std::string text(const std::string& name) {
    choose_target();
    Json json;
    json["format"] = "stylet-import";
    json["version"] = 1;
    json["description"] =
        "Proposed by stylet import --target: what each part is was guessed from its name; correct it here.";
    json["organs"] = organs();
    Json wall{{"depth_mm", 25}, {"radius_mm", 90}};
    if (!skin_.empty()) wall["skin"] = skin_;
    if (!holders_of_wall_.empty()) wall["held_by"] = holders_of_wall_;
    wall["filler"] = "peritoneal_fat";
    json["scenario"] = {{"name", name},
                        {"title", fmt::format("Biopsy: {} in the {}", target_id(), carrier_->id)},
                        {"target", target_id()},
                        {"wall", wall}};
    return json.dump(2) + "\n";
  }

private:
  void add(const SourcePart& part, const std::map<int, Eigen::AlignedBox3d>& boxes) {
    // A label of the body has what no organ has: the body is derived from all labels together.
    if (names_body(part.name)) {
      if (part.label < 0) skin_ = "body";
      body_parts_.push_back(part.name);
      return;
    }
    const Known& is = known(part.name);
    const bool asked = fits(target_.c_str(), part.name);
    const std::string id = *is.organ == '\0' || (asked && !lesion(is)) ? id_of(part.name) : is.organ;
    auto organ = std::ranges::find(organs_, id, &Proposed::id);
    if (organ == organs_.end()) {
      organs_.push_back({.id = id, .is = &is, .parts = {}, .labels = {}, .surfaces = {}, .box = {}});
      organ = organs_.end() - 1;
    }
    organ->parts.push_back(part.name);
    if (part.label >= 0) {
      organ->labels.push_back(part.label);
      organ->box.extend(boxes.at(part.label));
    }
    for (const Eigen::Vector3d& v : part.mesh.vertices) organ->box.extend(v);
    if (part.label < 0) organ->surfaces.push_back(&part.mesh);
  }

  static bool lesion(const Known& is) { return std::string_view(is.role) == "target"; }

  void choose_target() {
    std::vector<Proposed*> found;
    for (Proposed& organ : organs_) {
      if (fits(target_.c_str(), organ.id) ||
          std::ranges::any_of(organ.parts, [&](const std::string& part) { return fits(target_.c_str(), part); })) {
        found.push_back(&organ);
      }
    }
    if (found.size() != 1) {
      throw ContentError(fmt::format("--target {}: {}; there are {}", target_,
                                     found.empty() ? "no part is called so" : "several parts are called so; name one",
                                     list_of(organs_)));
    }
    if (!lesion(*found.front()->is)) {
      carrier_ = found.front();
      return;
    }
    lesion_ = found.front();
    carrier_ = surrounding(*lesion_);
    if (carrier_ == nullptr) {
      throw ContentError(
          fmt::format("--target {}: it lies in no organ that could deform; write a side file (--side) "
                      "that says which",
                      target_));
    }
  }

  /// The organ that touches a lesion most; of surfaces, the smallest that its middle lies in.
  Proposed* surrounding(const Proposed& lesion) {
    Proposed* best = nullptr;
    double most = 0;
    for (const SourceFile& file : files_) {
      if (!file.image || lesion.labels.empty()) continue;
      const auto faces = touching(*file.image, lesion.labels);
      for (Proposed& organ : organs_) {
        double sum = 0;
        for (const int label : organ.labels) sum += faces.contains(label) ? static_cast<double>(faces.at(label)) : 0;
        if (!may_carry(organ) || sum <= most) continue;
        most = sum;
        best = &organ;
      }
    }
    if (best != nullptr) return best;
    for (Proposed& organ : organs_) {
      const Eigen::Vector3d middle = lesion.box.center();
      if (&organ == &lesion || !may_carry(organ) || !organ.box.contains(middle)) continue;
      double turns = 0;
      for (const mesh::TriangleMesh* surface : organ.surfaces) turns += winding_number(*surface, middle);
      if (std::abs(turns) < 0.5) continue;
      if (best == nullptr || organ.box.volume() < best->box.volume()) best = &organ;
    }
    return best;
  }

  static bool may_carry(const Proposed& organ) {
    const std::string_view tissue = organ.is->tissue;
    return !lesion(*organ.is) && tissue != "bone" && tissue != "cartilage" && tissue != "outside" &&
           std::string_view(organ.is->role) == kBoundary;
  }

  static bool behind_peritoneum(const Proposed& organ) {
    const std::string_view tissue = organ.is->tissue;
    return tissue.starts_with("kidney") || tissue == "pancreas";
  }

  std::string target_id() const { return lesion_ != nullptr ? lesion_->id : "lesion"; }

  Json organs() {
    Json list = Json::array();
    const auto row = [](const Proposed& organ) {
      Json json{{"id", organ.id}, {"parts", organ.parts}};
      if (std::string_view(organ.is->role) != kBoundary) json["role"] = organ.is->role;
      json["tissue"] = organ.is->tissue;
      return json;
    };
    if (!body_parts_.empty()) {
      Json body{{"id", skin_.empty() ? "body_label" : skin_}, {"parts", body_parts_}};
      if (skin_.empty()) body["role"] = "ignore";
      list.push_back(body);
    }
    Json other_lesions = Json::array();  // seen, and not aimed at
    std::vector<std::string> parts_of_carrier = carrier_->parts;
    for (const Proposed& organ : organs_) {
      if (&organ == carrier_ || &organ == lesion_) continue;
      Json json = row(organ);
      if (lesion(*organ.is)) json["role"] = "region";
      const double away = std::sqrt(carrier_->box.squaredExteriorDistance(organ.box));
      if (away > kNear) {
        json = {{"id", organ.id}, {"parts", organ.parts}, {"role", "ignore"}};
      } else if (organ.id == "ribs" || organ.id == "costal_cartilages") {
        holders_of_wall_.push_back(organ.id);
      }
      if (!lesion(*organ.is)) {
        list.push_back(json);
        continue;
      }
      if (surrounding(organ) == carrier_) {
        json["body"] = carrier_->id;
        if (!organ.labels.empty()) std::ranges::copy(organ.parts, std::back_inserter(parts_of_carrier));
      }
      other_lesions.push_back(json);
    }
    Json carrier = row(*carrier_);
    carrier["role"] = kBoundary;
    // Labels exclude each other.
    if (lesion_ != nullptr && !lesion_->labels.empty())
      std::ranges::copy(lesion_->parts, std::back_inserter(parts_of_carrier));
    carrier["parts"] = parts_of_carrier;
    carrier["deformable"] = true;
    carrier["held_back_percent"] = behind_peritoneum(*carrier_) ? kBehind : kBack;
    list.push_back(carrier);
    for (const Json& other : other_lesions) list.push_back(other);  // in organs, so after them
    if (lesion_ != nullptr) {
      Json json = row(*lesion_);
      json["body"] = carrier_->id;
      list.push_back(json);
    } else {
      list.push_back(
          {{"id", "lesion"}, {"role", "target"}, {"tissue", "tumour"}, {"body", carrier_->id}, {"ball_mm", kLesion}});
    }
    return list;
  }

  const std::vector<SourceFile>& files_;
  std::string target_;
  std::vector<Proposed> organs_;
  std::vector<std::string> body_parts_, holders_of_wall_;
  std::string skin_;
  Proposed* carrier_ = nullptr;
  Proposed* lesion_ = nullptr;
};

}  // namespace

std::string propose_side_text(const std::vector<SourceFile>& files, const std::string& target,
                              const std::string& name) {
  return Proposal(files, target).text(name);
}

}  // namespace stylet::import

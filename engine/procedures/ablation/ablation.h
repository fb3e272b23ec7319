// An ablation in the patient: the zone that an electrode destroys, growing in the tissue at rest.
#pragma once

#include "engine/content/heated_zone.h"
#include "engine/content/scene.h"
#include "engine/mesh/triangle_mesh.h"
#include "engine/procedures/ablation/bioheat.h"
#include "engine/procedures/ablation/electrode.h"

#include <memory>
#include <vector>

namespace stylet::procedures::ablation {

/// How much of what was to be destroyed is.
struct AblationCoverage {
  double tumour = 0;        ///< share of the target's volume
  double with_margin = 0;   ///< of the target and what lies within the margin around it, vessels apart
  double least_margin = 0;  ///< from the target to the nearest tissue that lives, m; 0 where target is left
};

/// The heat spreads in the rest frame of the tissue around the electrode, where the label volume says what are large
/// vessels (tissues of surfaces with that role: they stay at body temperature). Time goes in steps of kStep whatever
/// the rate at which it is asked for, so the zone depends on the seconds heated and nothing else. One thread.
class Ablation {
public:
  static constexpr double kStep = 1.0;     ///< s
  static constexpr double kCell = 0.002;   ///< m
  static constexpr double kReach = 0.024;  ///< of the grid beyond the electrode, m: five times that of the heat
  /// Bubbles come out of hot tissue, about as far as it dies, and dissolve again in minutes. Engineering values.
  static constexpr double kFirstGas = 50;             ///< degrees Celsius
  static constexpr double kFullGas = 70;              ///< degrees Celsius
  static constexpr double kGasLasts = 300;            ///< s, until 1/e is left
  static constexpr double kGasGone = 20 * kGasLasts;  ///< s, until nothing is

  /// @param scene      kept
  /// @param electrode  at rest
  /// @param target     index into Scene::targets that is to be destroyed; -1: none
  Ablation(const content::Scene& scene, const Electrode& electrode, int target);

  /// The electrode was moved; the grid stays where it is.
  void place(const Electrode& electrode);
  /// Goes on until so many seconds have been heated since the start; whole steps.
  void heat_to(double heated_s);
  /// Nothing is heated: lets the bubbles dissolve until so many seconds have passed since heating stopped; whole
  /// steps. What is destroyed stays as it was told then.
  void rest_to(double rested_s);

  double heated_s() const { return kStep * steps_; }
  double power_w() const { return power_w_; }  ///< in the last step
  double energy_j() const { return energy_j_; }
  double volume() const;  ///< destroyed, m^3
  AblationCoverage coverage() const;
  /// Surface of what is destroyed, patient frame at rest; empty before there is anything.
  mesh::TriangleMesh zone() const;
  /// The same as the renderer draws surfaces: carried by a deformable body, with normals.
  content::Surface surface(int body) const;
  const Bioheat& field() const { return heat_; }
  const std::vector<float>& gas() const { return gas_; }  ///< [cells] 0 ... 1

  /// Seconds heated and rested between two updates of the pictures' zone: its surface takes milliseconds.
  static constexpr int kShownEvery = 6;
  /// The pictures' zone up to date: `before` where that is so still, at the latest kShownEvery steps late.
  /// @param body  deformable body that carries it
  /// @param exactly  not late
  std::shared_ptr<const content::HeatedZone> shown(std::shared_ptr<const content::HeatedZone> before, int body,
                                                   bool exactly) const;

private:
  /// A voxel of the target, or of what lies within the margin.
  struct Voxel {
    Eigen::Vector3d at;
    double distance;  // to the target, m; 0: of it
  };
  void find_region(int target);
  std::vector<double> log_dose() const;
  void dissolve();

  const content::Scene& scene_;
  Bioheat heat_;
  std::vector<Voxel> region_;
  std::vector<float> gas_;
  int steps_ = 0;
  int rested_ = 0;   // steps since the last one that heated
  int changes_ = 0;  // steps of either kind
  double power_w_ = 0;
  double energy_j_ = 0;
};

}  // namespace stylet::procedures::ablation

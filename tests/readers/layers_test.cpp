// Layers of tissue that cross the elements of a body.
#include "engine/content/scene.h"
#include "engine/mesh/tet_quality.h"
#include "engine/readers/anatomy.h"
#include "engine/readers/deformable.h"
#include "physics/tissue/refinement.h"
#include "physics/tissue/tet_mesh.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

namespace stylet::readers {
namespace {

using physics::Element;

constexpr double kThick = 0.024;  // m
constexpr double kSkin = 200e3, kMuscle = 30e3;

Organ plate(const std::string& id, content::SurfaceRole role, int tissue, double from) {
  Organ organ{.id = id, .name = id, .place = id, .body = "wall", .role = role, .tissue = tissue, .mesh = {}};
  organ.mesh = mesh::boundary_surface(reference::kuhn_box({0, 0, from}, {0.048, 0.048, kThick}, {2, 2, 1})).mesh;
  return organ;
}

/// Skin of 2 mm on muscle, in elements of 12 mm.
content::DeformableBody wall(Element element) {
  std::vector<content::Tissue> tissues(2);
  tissues[0].mechanics.young_modulus = kMuscle;
  tissues[1].mechanics.young_modulus = kSkin;
  const std::vector<Organ> organs{plate("wall", content::SurfaceRole::boundary, 0, 0),
                                  plate("skin", content::SurfaceRole::region, 1, kThick - 0.002)};
  content::DeformableBody body;
  body.name = "wall";
  body.element = element;
  body.mesh = physics::refined(reference::kuhn_box(Eigen::Vector3d::Zero(), {0.048, 0.048, kThick}, {4, 4, 2}));
  give_tissues(organs[0], organs, tissues, body);
  return body;
}

TEST(Layers, QuadraticElementsKnowHowTheyLie) {
  const content::DeformableBody body = wall(Element::quadratic);
  int layered = 0;
  for (std::size_t t = 0; t < body.mesh.tets.size(); ++t) {
    const physics::ElasticMaterial& m = body.tet_mechanics[t];
    // A share of skin: the mean along it, the mean of softness across.
    const double skin = (m.young_modulus - kMuscle) / (kSkin - kMuscle);
    EXPECT_NEAR(m.layers.across * m.young_modulus, 1 / (skin / kSkin + (1 - skin) / kMuscle), 1e-6 * kSkin) << t;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const int n : body.mesh.tets[t]) middle += body.mesh.nodes[static_cast<std::size_t>(n)] / 4;
    const bool at_rim = (middle.head<2>().array() - 0.024).abs().maxCoeff() > 0.012;
    if (at_rim || m.layers.across > 1 - 1e-6) continue;
    ++layered;
    EXPECT_NEAR(std::abs(m.layers.normal[2]), 1, 1e-6) << t;
  }
  EXPECT_GE(layered, 2 * 2 * 6);
}

// Their forces do not know layers: nothing is looked for.
TEST(Layers, LinearElementsAreOfTheMean) {
  const content::DeformableBody linear = wall(Element::linear), quadratic = wall(Element::quadratic);
  for (std::size_t t = 0; t < linear.mesh.tets.size(); ++t) {
    EXPECT_EQ(linear.tet_mechanics[t].young_modulus, quadratic.tet_mechanics[t].young_modulus);
    EXPECT_EQ(linear.tet_mechanics[t].layers.normal, (std::array<double, 3>{}));
  }
}

TEST(Layers, LinearElementsKeepTheirDistanceFromWhereTheyLock) {
  for (const Element element : {Element::linear, Element::quadratic}) {
    std::vector<content::Tissue> tissues(1);
    tissues[0].mechanics.poisson_ratio = 0.49;
    const std::vector<Organ> organs{plate("wall", content::SurfaceRole::boundary, 0, 0)};
    content::DeformableBody body;
    body.name = "wall";
    body.element = element;
    body.mesh = physics::refined(reference::kuhn_box(Eigen::Vector3d::Zero(), {0.048, 0.048, kThick}, {4, 4, 2}));
    give_tissues(organs[0], organs, tissues, body);
    for (const physics::ElasticMaterial& m : body.tet_mechanics)
      ASSERT_EQ(m.poisson_ratio, element == Element::linear ? 0.45 : 0.49);
  }
}

// A cube of 12 mm in the middle of a block that stiffens: so far from it as a ball of its volume is thick.
TEST(Cavities, WhatTheyHaveStretchedAsTheyGrewDoesNotStiffen) {
  std::vector<content::Tissue> tissues(2);
  tissues[0].mechanics.stiffening = 40;
  tissues[1].fluid = true;
  Organ block{.id = "block", .name = "block", .place = "block", .body = "block"};
  block.role = content::SurfaceRole::boundary;
  block.mesh =
      mesh::boundary_surface(reference::kuhn_box(Eigen::Vector3d::Zero(), {0.06, 0.06, 0.06}, {2, 2, 2})).mesh;
  Organ cyst = block;
  cyst.id = "cyst";
  cyst.role = content::SurfaceRole::region;
  cyst.tissue = 1;
  cyst.mesh =
      mesh::boundary_surface(reference::kuhn_box({0.024, 0.024, 0.024}, {0.036, 0.036, 0.036}, {2, 2, 2})).mesh;
  const std::vector<Organ> organs{block, cyst};
  content::DeformableBody body;
  body.name = "block";
  body.mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), {0.06, 0.06, 0.06}, {10, 10, 10});
  give_tissues(organs[0], organs, tissues, body);
  const double radius = std::cbrt(0.75 / std::numbers::pi) * 0.012;
  int near = 0;
  for (std::size_t t = 0; t < body.mesh.tets.size(); ++t) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const int n : body.mesh.tets[t]) middle += body.mesh.nodes[static_cast<std::size_t>(n)] / 4;
    const double distance = ((middle.array() - 0.03).abs() - 0.006).max(0.0).matrix().norm();
    EXPECT_EQ(body.tet_mechanics[t].stiffening, distance <= radius ? 0 : 40) << distance;
    if (distance <= radius) ++near;
  }
  EXPECT_GT(near, 300);
  EXPECT_LT(near, 3000);
}

}  // namespace
}  // namespace stylet::readers

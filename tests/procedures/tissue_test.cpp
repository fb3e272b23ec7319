// Where a point of the deformed, breathing patient lies, and what a biopsy needle cuts out there.
#include "engine/content/tissue_locator.h"
#include "engine/procedures/biopsy/biopsy.h"
#include "engine/procedures/biopsy/core_sample.h"
#include "engine/state/biopsy_shot.h"
#include "tests/session/cube_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace stylet::training {
namespace {

using Eigen::Vector3d;

enum Label : std::uint8_t { kAir, kFlesh, kBall, kPlate, kBone };
const Vector3d kBallCentre(0.003, -0.002, 0.021);
constexpr double kBallRadius = 0.006;

/// A cube of flesh, 40 mm, with a ball and a bone in it; under it a plate that stands still, beside it a lung that
/// goes with the breath.
content::Scene small_patient(float spacing = 0.5e-3F) {
  content::Scene scene;
  scene.tissues.resize(5);
  scene.tissues[kBone].mechanics.young_modulus = 1e9;
  scene.bodies.push_back(tests::box_body("cube", {-0.02, -0.02, 0}, {0.02, 0.02, 0.04}, {4, 4, 4}));
  scene.breathing = {.amplitude = 1, .period = 4, .rigid_motion = {0, 0.010, 0}};
  content::LabelVolume& labels = scene.labels;
  labels.spacing = spacing;
  labels.origin = Eigen::Vector3f(-0.025F, -0.025F, -0.010F);
  labels.size = (Eigen::Array3f(0.080F, 0.050F, 0.055F) / spacing).cast<int>() + 1;
  content::Forbidden ball{.name = "ball", .tissue = kBall, .body = 0},
      lung{.name = "lung", .body = content::kBreathes};
  for (int k = 0; k < labels.size.z(); ++k) {
    for (int j = 0; j < labels.size.y(); ++j) {
      for (int i = 0; i < labels.size.x(); ++i) {
        const Vector3d x = (labels.origin + spacing * Eigen::Vector3f(float(i), float(j), float(k))).cast<double>();
        const bool cube = (x.head<2>().cwiseAbs().array() <= 0.02).all() && x.z() >= 0 && x.z() <= 0.04;
        const bool in_ball = cube && (x - kBallCentre).norm() < kBallRadius;
        const bool bone = cube && x.x() > 0.015 && x.z() < 0.005;
        const bool in_lung = x.x() > 0.03 && std::abs(x.y()) < 0.005;
        labels.labels.push_back(bone ? kBone : in_ball ? kBall : cube ? kFlesh : x.z() < -0.005 ? kPlate : kAir);
        labels.bodies.push_back(in_lung ? content::kBreathes : cube && !bone ? 0 : -1);
        ball.inside.labels.push_back(in_ball);
        lung.inside.labels.push_back(in_lung);
      }
    }
  }
  for (content::Forbidden* organ : {&ball, &lung}) {
    organ->inside.origin = labels.origin;
    organ->inside.spacing = spacing;
    organ->inside.size = labels.size;
    scene.forbidden.push_back(*organ);
  }
  return scene;
}

/// The body moved as one affine map.
physics::TissueState moved(const content::Scene& scene, const Eigen::Affine3d& map) {
  physics::TissueState state;
  state.body_count = 1;
  state.positions[0].resize(3, static_cast<Eigen::Index>(scene.bodies[0].mesh.nodes.size()));
  for (Eigen::Index n = 0; n < state.positions[0].cols(); ++n) {
    state.positions[0].col(n) = map * scene.bodies[0].mesh.nodes[n];
  }
  return state;
}

Eigen::Affine3d some_map() {
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.translate(Vector3d(0.02, 0.01, 0.03)).rotate(Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()));
  map.scale(Vector3d(1.3, 0.8, 1.1));
  return map;
}

TEST(TissueLocator, FindsWhatWasThereAtRest) {
  const content::Scene scene = small_patient();
  content::TissueLocator locator(scene);
  const Eigen::Affine3d map = some_map();
  const physics::TissueState state = moved(scene, map);
  locator.update(state, 0);
  for (const Vector3d& rest : {Vector3d(0, 0, 0.01), kBallCentre, Vector3d(-0.019, 0.019, 0.039)}) {
    const content::TissuePlace place = locator.find(map * rest);
    EXPECT_LT((place.rest - rest).norm(), 1e-12);
    EXPECT_EQ(place.tissue, rest == kBallCentre ? kBall : kFlesh);
    EXPECT_EQ(place.body, 0);
    EXPECT_EQ(place.forbidden, rest == kBallCentre ? 1U : 0U);
    EXPECT_TRUE(locator.in_body(map * rest));
    EXPECT_LT((locator.carried(locator.carrier(rest), rest) - map * rest).norm(), 1e-12);
  }
  const content::TissuePlace gap = locator.find(kBallCentre + Vector3d(-0.01, -0.01, -0.01));
  EXPECT_EQ(gap.tissue, kAir) << "the body has left that place";
  EXPECT_EQ(gap.forbidden, 0U);
  EXPECT_EQ(locator.find({0, 0, -0.008}).tissue, kPlate);
  EXPECT_EQ(locator.find({0, 0, 1}).tissue, kAir);
  const Vector3d nowhere(0, 0, 1);
  EXPECT_EQ(locator.carried(locator.carrier(nowhere), nowhere), nowhere);
}

TEST(TissueLocator, BoneInABodyStandsStill) {
  const content::Scene scene = small_patient();
  content::TissueLocator locator(scene);
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.translate(Vector3d(0.004, 0, 0));
  const physics::TissueState state = moved(scene, map);
  locator.update(state, 0);
  EXPECT_EQ(locator.find({0.017, 0, 0.003}).tissue, kBone);
  EXPECT_EQ(locator.find({0.022, 0, 0.003}).tissue, kFlesh) << "no bone moved there";
}

TEST(TissueLocator, WhatBreathesIsWhereTheBreathHasTakenIt) {
  const content::Scene scene = small_patient();
  content::TissueLocator locator(scene);
  const physics::TissueState rest = moved(scene, Eigen::Affine3d::Identity());
  locator.update(rest, 0);
  EXPECT_EQ(locator.find({0.04, 0.003, 0.02}).forbidden, 2U);
  EXPECT_EQ(locator.find({0.04, 0.013, 0.02}).forbidden, 0U);
  locator.update(rest, 2);  // half a period: full inspiration, 10 mm
  EXPECT_EQ(locator.find({0.04, 0.003, 0.02}).forbidden, 0U) << "the lung has left";
  EXPECT_EQ(locator.find({0.04, 0.013, 0.02}).forbidden, 2U);
  EXPECT_EQ(locator.find({0.04, 0.013, 0.02}).body, content::kBreathes);
}

std::vector<double> core_content(content::TissueLocator& tissue, std::size_t tissues, const Vector3d& tip,
                                 const Eigen::Quaterniond& orientation,
                                 const procedures::biopsy::CoreSettings& settings) {
  return procedures::biopsy::core_content(
      procedures::biopsy::core_points(tissue, tissues, tip, orientation, settings), tissues);
}

// A core along a diameter holds what the ball's chord is of it; a tissue that is stretched along the needle holds
// more.
TEST(CoreSample, HoldsTheChordOfTheBallDeformedOrNot) {
  const content::Scene scene = small_patient();
  content::TissueLocator locator(scene);
  const procedures::biopsy::CoreSettings settings{.throw_length = 0.025, .dead_length = 0.005, .bore = 0.001};
  for (const double stretch : {1.0, 1.4}) {
    Eigen::Affine3d map = Eigen::Affine3d::Identity();
    map.scale(Vector3d(1, 1, stretch));
    const physics::TissueState state = moved(scene, map);
    locator.update(state, 0);
    const double voxel =
        stretch * double(scene.labels.spacing) / 0.020;  // the ends of a chord are known to half of it
    const Eigen::Quaterniond down(Eigen::AngleAxisd(std::acos(-1), Vector3d::UnitX()));
    const Vector3d centre = map * kBallCentre;
    const std::vector<double> whole =
        core_content(locator, scene.tissues.size(), centre + Vector3d(0, 0, 0.010), down, settings);
    EXPECT_NEAR(std::accumulate(whole.begin(), whole.end(), 0.0), 1, 1e-9);
    EXPECT_NEAR(whole[kBall], stretch * 2 * kBallRadius / 0.020, voxel);
    EXPECT_NEAR(whole[kFlesh], 1 - whole[kBall], 1e-9);
    // Fired from its middle, upwards, half of it.
    const std::vector<double> half =
        core_content(locator, scene.tissues.size(), centre, Eigen::Quaterniond::Identity(), settings);
    EXPECT_NEAR(half[kBall], stretch * kBallRadius / 0.020, voxel);
    // 5 mm beside its middle, the chord is 2 sqrt(36 - 25) mm.
    const std::vector<double> beside =
        core_content(locator, scene.tissues.size(), centre + Vector3d(0.005, 0, 0.010), down, settings);
    EXPECT_NEAR(beside[kBall], stretch * 2 * std::sqrt(11e-6) / 0.020, 2 * voxel) << "it is met at a slant";
  }
}

TEST(CoreSample, IsAsLongAsTheThrowWithoutTheTip) {
  const content::Scene scene = small_patient();
  content::TissueLocator locator(scene);
  const physics::TissueState state = moved(scene, Eigen::Affine3d::Identity());
  locator.update(state, 0);
  const Eigen::Quaterniond up = Eigen::Quaterniond::Identity();
  // From 3 mm below the ball.
  const Vector3d tip = kBallCentre - Vector3d(0, 0, kBallRadius + 0.003);
  EXPECT_EQ(core_content(locator, 5, tip, up, {.throw_length = 0.007, .dead_length = 0.005})[kBall], 0);
  EXPECT_NEAR(core_content(locator, 5, tip, up, {.throw_length = 0.011, .dead_length = 0.005})[kBall], 0.5, 0.1);
  EXPECT_NEAR(core_content(locator, 5, tip, up, {.throw_length = 0.011, .dead_length = 0.002})[kBall], 6.0 / 9, 0.1);
}

// Met at a slant and off its middle: slices of one tissue, of the other, and of both.
TEST(CorePieces, FillTheCoreAndHoldWhatTheMetricCounts) {
  const content::Scene scene = small_patient();
  content::TissueLocator locator(scene);
  const physics::TissueState state = moved(scene, some_map());
  locator.update(state, 0);
  const std::vector<bool> targets{false, false, true, false, false};  // the ball
  const procedures::biopsy::CoreSettings settings{.throw_length = 0.022, .dead_length = 0.005, .bore = 0.0011};
  const Eigen::Quaterniond slant(Eigen::AngleAxisd(0.5, Vector3d(1, 0.3, 0.2).normalized()));
  const Vector3d tip = some_map() * (kBallCentre + Vector3d(0.002, 0, 0)) - slant * Vector3d(0, 0, 0.010);
  const std::vector<std::uint8_t> points = procedures::biopsy::core_points(locator, 5, tip, slant, settings);
  const std::vector<double> content = procedures::biopsy::core_content(points, 5);
  const std::vector<state::CorePiece> pieces = procedures::biopsy::core_pieces(points, targets);
  std::vector<double> area(5, 0.0);
  double whole_slices = 0, target = 0, last = 0, across = 1;
  for (const state::CorePiece& piece : pieces) {
    EXPECT_LT(piece.from, piece.to);
    EXPECT_LT(piece.low, piece.high);
    if (across == 1) {  // a new slice, where the one before ended
      EXPECT_EQ(piece.from, last);
      EXPECT_EQ(piece.low, 0);
      whole_slices += piece.to - piece.from;
    } else {
      EXPECT_EQ(piece.low, across);
    }
    last = piece.to;
    across = piece.high;
    const double size = (piece.to - piece.from) * (piece.high - piece.low);
    area[static_cast<std::size_t>(piece.tissue)] += size;
    if (piece.target) target += size;
  }
  EXPECT_EQ(last, 1);
  EXPECT_EQ(across, 1);
  EXPECT_NEAR(whole_slices, 1, 1e-6) << "single precision";
  for (std::size_t t = 0; t < 5; ++t) EXPECT_NEAR(area[t], content[t], 1e-6) << t;
  EXPECT_NEAR(target, content[kBall], 1e-6);
  EXPECT_GT(target, 0.2);
  EXPECT_LT(target, 0.9);
  EXPECT_LT(pieces.size(), 40U) << "slices that are alike are one piece";
}

// The cannula never overtakes the stylet, both come out in full before anything is drawn back, and all is back when
// the gun can be fired again.
TEST(BiopsyShot, ShootsOutStaysToBeSeenAndIsBackWhenTheGunIsCocked) {
  EXPECT_EQ(state::stylet_out(0), 0);
  EXPECT_EQ(state::stylet_out(-1), 0);
  double stylet = 0, cannula = 0, notch_seen_s = 0;
  constexpr double kStep = 1e-3;
  for (double t = 0; t <= state::ShotTimes::kStaysUntil; t += kStep) {
    EXPECT_GE(state::stylet_out(t), stylet) << t;
    EXPECT_GE(state::cannula_out(t), cannula) << t;
    stylet = state::stylet_out(t);
    cannula = state::cannula_out(t);
    EXPECT_LE(cannula, stylet);
    EXPECT_LE(stylet, 1);
    if (stylet == 1 && cannula == 0) notch_seen_s += kStep;
  }
  EXPECT_EQ(stylet, 1);
  EXPECT_EQ(cannula, 1);
  EXPECT_GT(notch_seen_s, 0.1) << "long enough for an eye";
  for (double t = state::ShotTimes::kStaysUntil; t <= procedures::biopsy::Biopsy::kCocking; t += kStep) {
    EXPECT_LE(state::stylet_out(t), stylet) << t;
    EXPECT_LE(state::cannula_out(t), state::stylet_out(t)) << t;
    stylet = state::stylet_out(t);
  }
  EXPECT_EQ(stylet, 0);
  EXPECT_EQ(state::cannula_out(procedures::biopsy::Biopsy::kCocking), 0);
}

TEST(BiopsyShot, OfAFrameGoesByItsTimeAndItsNewestCoreAlone) {
  state::FrameState frame;
  frame.time_s = 5;
  EXPECT_FALSE(state::shot_of(frame)) << "nothing was fired";
  frame.cores = {{.fired_s = 1, .throw_length = 0.022F},
                 {.to = {0, 0, 0.017F}, .fired_s = 4.9, .throw_length = 0.022F}};
  const auto shot = state::shot_of(frame);
  ASSERT_TRUE(shot);
  EXPECT_FLOAT_EQ(shot->stylet, 0.022F);
  EXPECT_FLOAT_EQ(shot->cannula, 0);
  EXPECT_FLOAT_EQ(shot->stylet - shot->notch_behind + shot->notch, 0.017F) << "the notch lies along the core";
  frame.time_s = 4.92;
  EXPECT_NEAR(state::shot_of(frame)->stylet, 0.022 / 4, 1e-6) << "half way in time, a quarter in length";
  frame.time_s = 4.89;
  EXPECT_FALSE(state::shot_of(frame)) << "gone back in time: not fired yet";
  frame.time_s = 6;
  EXPECT_FALSE(state::shot_of(frame)) << "drawn back";
}

}  // namespace
}  // namespace stylet::training

// What tissue that stiffens and relaxes does whatever its elements are: for linear tetrahedra and quadratic ones.
#pragma once

#include "physics/messages/material.h"
#include "tests/validation/static_body.h"

#include <Eigen/Core>

namespace stylet::validation {

inline constexpr physics::ElasticMaterial kLawTissue{
    .young_modulus = 10e3,
    .poisson_ratio = 0.45,
    .stiffening = 8,
    .relaxation = {{{.share = 0.2, .time_s = 0.3}, {.share = 0.25, .time_s = 4}}}};

void shake(Eigen::Matrix3Xd& positions, double amount, unsigned seed);
/// By 2.2 rad about no axis of the mesh.
Eigen::Matrix3d law_rotation();
/// Deforms it, with another deformation half forgotten: alpha has other axes than the strain.
void strain(StaticBody& body);
/// Force on the top face of a unit cube, N.
double pull_on_top(StaticBody& body);

/// Of kLawTissue without stiffening, deformed with all of its stress shape's: what is left of the pull on its top is
/// g_inf + sum g_i exp(-t/tau_i).
void expect_prony(StaticBody& body);
/// Along random closed paths, at random speeds: what is put in is what the fading takes, and that is never negative.
void expect_no_energy_from_closed_paths(const physics::TissueModel& model);
/// No mode without stiffness but those of rest, also where it is pressed and turned.
void expect_positive_stiffness(StaticBody& body);
/// A cube pulled: what the factor says of the next bit of force is what the tissue does, not what it did at rest.
void expect_factor_as_stiff_as_pulled(StaticBody& body);

}  // namespace stylet::validation

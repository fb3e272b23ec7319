#include "physics/tissue/strain_law.h"

#include "physics/tissue/lanes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace stylet::physics {
namespace {

/// b |E|^2 from which on the stress no longer grows exponentially but in proportion to the strain, e^5 = 148 times as
/// stiff: keeps what a wild step makes finite. Engineering value.
constexpr double kStiffest = 5;

constexpr std::array<std::pair<std::size_t, std::size_t>, 6> kSymmetric{
    {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}};

Lanes squared_norm(const LaneMatrix& m) {
  Lanes sum = Lanes::Zero();
  for (const auto& row : m) {
    for (const Lanes& entry : row) sum += entry.square();
  }
  return sum;
}

Lanes product(const LaneMatrix& a, const LaneMatrix& b) {
  Lanes sum = Lanes::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) sum += a[i][k] * b[i][k];
  }
  return sum;
}

}  // namespace

LaneMatrix along_layers(const LayerLaw& layers, const LaneMatrix& strain) {
  const auto& n = layers.normal;
  std::array<Lanes, 3> across;  // E n
  for (std::size_t i = 0; i < 3; ++i) across[i] = strain[i][0] * n[0] + strain[i][1] * n[1] + strain[i][2] * n[2];
  const Lanes stretch = n[0] * across[0] + n[1] * across[1] + n[2] * across[2];
  const Lanes spread = layers.spread * (strain[0][0] + strain[1][1] + strain[2][2] - stretch);
  LaneMatrix along;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      along[i][k] = strain[i][k] - across[i] * n[k] - n[i] * across[k] + (stretch - spread) * n[i] * n[k];
    }
    along[i][i] += spread;
  }
  return along;
}

LaneMatrix stretch_of(const LaneMatrix& r, const LaneMatrix& f) {
  LaneMatrix m;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) m[i][j] = r[0][i] * f[0][j] + r[1][i] * f[1][j] + r[2][i] * f[2][j];
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < i; ++j) m[i][j] = m[j][i] = 0.5 * (m[i][j] + m[j][i]);
  }
  return m;
}

LaneMatrix strain_of(const LaneMatrix& stretch, const Lanes& size) {
  LaneMatrix strain = stretch;
  for (std::size_t i = 0; i < 3; ++i) strain[i][i] -= size;
  return strain;
}

// T = (g_inf exp(b |E|^2) + sum g_i) E - K + s L (E - K), K = sum g_i alpha_i   (eq. 45, 51), and R (T - [y]x) where
// T and S do not share axes.
LaneMatrix stress_of(const StrainLaw& law, const LaneMatrix& strain, const Lanes& size, const StrainMemory* memory,
                     const LayerLaw* layers) {
  LaneMatrix stress;
  const Lanes fading = law.share[0] + law.share[1];
  const Lanes ratio =
      (1 - fading) * (law.stiffening * squared_norm(strain)).min(Lanes::Constant(kStiffest)).exp() + fading;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) stress[i][k] = ratio * strain[i][k];
  }
  if (memory == nullptr && layers == nullptr) return stress;
  LaneMatrix kept;  // K - s L (E - K): what does not share its axes with S
  for (std::size_t c = 0; c < kSymmetric.size(); ++c) {
    const auto [i, k] = kSymmetric[c];
    if (memory != nullptr) {
      kept[i][k] = law.share[0] * memory->alpha[0][c] + law.share[1] * memory->alpha[1][c];
    } else {
      kept[i][k].setZero();
    }
    kept[k][i] = kept[i][k];
  }
  if (layers != nullptr) {
    LaneMatrix left = strain;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) left[i][k] -= kept[i][k];
    }
    const LaneMatrix along = along_layers(*layers, left);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) kept[i][k] -= layers->sheets * along[i][k];
    }
  }
  // dU = T : dS = T : (R^T dF) - T : (Omega S), Omega = R^T dR, and dR follows from F by
  // (tr(S) I - S) omega = axial(R^T dF - dF^T R). What shares its axes with S is not turned.
  const auto axial = [](const LaneMatrix& a, const LaneMatrix& b, std::size_t i, std::size_t k) {
    return Lanes(a[i][0] * b[0][k] + a[i][1] * b[1][k] + a[i][2] * b[2][k] - a[k][0] * b[0][i] - a[k][1] * b[1][i] -
                 a[k][2] * b[2][i]);
  };
  const Lanes v0 = axial(kept, strain, 1, 2);  // of -kept * S: S and the strain differ by a multiple of I
  const Lanes v1 = axial(kept, strain, 2, 0);
  const Lanes v2 = axial(kept, strain, 0, 1);
  const Lanes c00 = strain[1][1] + strain[2][2] + 2 * size;
  const Lanes c11 = strain[0][0] + strain[2][2] + 2 * size;
  const Lanes c22 = strain[0][0] + strain[1][1] + 2 * size;
  const Lanes& c01 = strain[0][1];  // the negative of C's
  const Lanes& c02 = strain[0][2];
  const Lanes& c12 = strain[1][2];
  const Lanes k00 = c11 * c22 - c12 * c12;
  const Lanes k01 = c02 * c12 + c01 * c22;
  const Lanes k02 = c01 * c12 + c02 * c11;
  const Lanes k11 = c00 * c22 - c02 * c02;
  const Lanes k12 = c01 * c02 + c00 * c12;
  const Lanes k22 = c00 * c11 - c01 * c01;
  const Lanes determinant = c00 * k00 - c01 * k01 - c02 * k02;
  // Zero only where the rotation is not defined.
  const Lanes inverse = (determinant > 1e-9).select(1 / determinant, 0);
  const Lanes y0 = inverse * (k00 * v0 + k01 * v1 + k02 * v2);
  const Lanes y1 = inverse * (k01 * v0 + k11 * v1 + k12 * v2);
  const Lanes y2 = inverse * (k02 * v0 + k12 * v1 + k22 * v2);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) stress[i][k] -= kept[i][k];
  }
  stress[0][1] += y2;
  stress[0][2] -= y1;
  stress[1][0] -= y2;
  stress[1][2] += y0;
  stress[2][0] += y1;
  stress[2][1] -= y0;
  return stress;
}

Lanes energy_of(const StrainLaw& law, const LaneMatrix& strain, const StrainMemory* memory, const LayerLaw* layers) {
  const Lanes squares = squared_norm(strain);
  if (law.linear) return squares;
  const Lanes exponent = law.stiffening * squares;
  Lanes energy = Lanes::Zero();
  for (int lane = 0; lane < kLanes; ++lane) {
    const double q = std::min(exponent[lane], kStiffest);
    const double tail = std::exp(q) * (exponent[lane] - q);
    const double b = law.stiffening[lane];
    energy[lane] =
        (1 - law.share[0][lane] - law.share[1][lane]) * (b > 0 ? (std::expm1(q) + tail) / b : squares[lane]);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    LaneMatrix fading = strain;  // E - alpha_i
    if (memory != nullptr) {
      for (std::size_t c = 0; c < kSymmetric.size(); ++c) {
        const auto [row, column] = kSymmetric[c];
        fading[row][column] -= memory->alpha[i][c];
        fading[column][row] = fading[row][column];
      }
    }
    energy += law.share[i] * squared_norm(fading);
    if (layers != nullptr) energy += layers->sheets * law.share[i] * product(fading, along_layers(*layers, fading));
  }
  if (layers != nullptr) {
    energy += layers->sheets * (1 - law.share[0] - law.share[1]) * product(strain, along_layers(*layers, strain));
  }
  return energy;
}

void find_stiffness(const StrainLaw& law, const LaneMatrix& r, const LaneMatrix& strain,
                    std::span<PointStiffness> of_points) {
  const Lanes exponent = law.stiffening * squared_norm(strain);
  const Lanes fading = law.share[0] + law.share[1];
  const Lanes grown = (1 - fading) * exponent.min(Lanes::Constant(kStiffest)).exp();
  const Lanes along = (exponent < kStiffest).select((2 * law.stiffening * grown).sqrt(), 0);
  for (int lane = 0; lane < kLanes; ++lane) {
    of_points[static_cast<std::size_t>(lane)] = {.ratio = grown[lane] + fading[lane],
                                                 .along = along[lane] * of_lane(r, lane) * of_lane(strain, lane)};
  }
}

void relax(const StrainLaw& law, const LaneMatrix& strain, double dt, StrainMemory& memory) {
  for (std::size_t i = 0; i < 2; ++i) {
    const Lanes part = 1 - (-dt * law.rate[i]).exp();
    for (std::size_t c = 0; c < kSymmetric.size(); ++c) {
      Lanes& alpha = memory.alpha[i][c];
      alpha += part * (strain[kSymmetric[c].first][kSymmetric[c].second] - alpha);
    }
  }
}

}  // namespace stylet::physics

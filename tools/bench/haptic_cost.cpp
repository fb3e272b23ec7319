#include "tools/bench/haptic_cost.h"

#include "tools/bench/samples.h"

#include <Eigen/Core>

#include <algorithm>

namespace stylet::bench {

namespace {

// Multiply-adds count two. [a x b][b x c]: 2 a b c.
constexpr double product(double a, double b, double c) {
  return 2 * a * b * c;
}

/// beam_response(): the local stiffness through T^-1, P and the frame (physics/README.md eq. 10, 11).
constexpr double kBeamFlops = 4 * 2 * product(3, 3, 3)                     // T^-T K_l T^-1, four blocks
                              + 2 * 3 * product(3, 3, 3)                   // K_h, two ends
                              + product(6, 6, 12) + product(12, 6, 12)     // P^T (K P)
                              + 4 * product(3, 3, 12)                      // moments turn with the frame
                              + 8 * product(3, 3, 12)                      // rotated from both sides
                              + 4 * product(3, 3, 3) + product(12, 6, 1);  // frames, force

double stream_bytes_per_us(int doubles, int repeats) {
  const Eigen::ArrayXd b = Eigen::ArrayXd::Constant(doubles, 1.5);
  const Eigen::ArrayXd c = Eigen::ArrayXd::Constant(doubles, 2.5);
  Eigen::ArrayXd a = b;
  double scale = 0.5;
  Samples samples;
  for (int i = 0; i < repeats; ++i) {
    samples.time([&] { a = b + scale * c; });
    scale = 0.25 + 1e-3 * a[i % doubles];  // so that no pass can be left out
  }
  return 3.0 * 8.0 * doubles / samples.quantile(0.1);
}

}  // namespace

Cost haptic_step_cost(int beams, int rows) {
  const double blocks = beams + 1;
  const double m = rows;
  const double contacts = 0.5 * m;
  Cost cost;
  cost.flops = beams * kBeamFlops;
  cost.flops += blocks * (72 + 216 + product(6, 6, 6));        // block Cholesky: factor, U = G^-1 C, D - U^T U
  cost.flops += 2 * blocks * (2 * 36 + 2 * product(6, 6, 1));  // free motion and correction
  cost.flops += blocks * m * (36 + product(6, 6, 1));          // Y = L^-1 H_n^T
  cost.flops += blocks * 6 * m * (m + 1);                      // Y^T Y, lower triangle
  cost.flops += 0.5 * contacts * (contacts + 1) * (product(3, 3, 2) + product(2, 3, 2));  // D^T C D
  cost.flops += m * m * m / 3 + 2 * m * m;                                                // L D L^T and its solve
  cost.flops += product(3 * contacts, 3 * contacts, 1);                                   // x = B x_free + C f
  cost.flops += contacts * beams * 24;                                                    // projection on every edge
  const double doubles = (2 * blocks - 1) * 36                                            // A_n
                         + 6 * blocks * m                                                 // Y
                         + 2 * 0.5 * m * (m + 1)                                          // W and its factor
                         + 9 * contacts * contacts                                        // C
                         + 6 * 6 * blocks + 7 * 2 * blocks                                // vectors, shapes
                         + contacts * (9 + 3 * 3 + 4) + 4 * m;  // contacts, points, delta, lambda
  cost.bytes = 8 * doubles;
  return cost;
}

double MachinePeak::shortest_time_us(const Cost& cost) const {
  return std::max(cost.flops / flops_per_us, cost.bytes / cache_bytes_per_us);
}

MachinePeak measure_peak() {
  constexpr int kSize = 96;
  const Eigen::MatrixXd a = Eigen::MatrixXd::Constant(kSize, kSize, 0.5);
  Eigen::MatrixXd b = Eigen::MatrixXd::Constant(kSize, kSize, 0.25);
  Eigen::MatrixXd c(kSize, kSize);
  Samples products;
  for (int i = 0; i < 300; ++i) {
    products.time([&] { c.noalias() = a * b; });
    b(i % kSize, 0) = 1e-3 * c(0, i % kSize);
  }
  MachinePeak peak;
  // The tenth percentile: others on the machine only ever slow a pass down.
  peak.flops_per_us = product(kSize, kSize, kSize) / products.quantile(0.1);
  peak.cache_bytes_per_us = stream_bytes_per_us(1 << 10, 4000);
  peak.memory_bytes_per_us = stream_bytes_per_us(1 << 22, 10);
  return peak;
}

}  // namespace stylet::bench

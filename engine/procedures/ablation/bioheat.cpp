#include "engine/procedures/ablation/bioheat.h"

#include <algorithm>
#include <cmath>

namespace stylet::procedures::ablation {
namespace {

constexpr double kNoDose = 39;  // degrees; what is cooler does nothing to the tissue

}  // namespace

Bioheat::Bioheat(const CellGrid& grid, const HeatProperties& properties)
    : grid_(grid),
      properties_(properties),
      temperature_(grid.count(), properties.body_temperature),
      next_(temperature_),
      dose_(grid.count(), 0.0),
      perfusion_(grid.count(), properties.perfusion * properties.blood_density * properties.blood_heat /
                                   (properties.density * properties.specific_heat)),
      held_(grid.count(), 0) {
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i) {
        const Eigen::Array3i at(i, j, k);
        if ((at == 0).any() || (at == grid.size.array() - 1).any()) hold(grid.index(i, j, k));
      }
    }
  }
}

void Bioheat::set_source(std::vector<double> share) {
  heated_.clear();
  source_.clear();
  for (std::size_t cell = 0; cell < share.size(); ++cell) {
    if (!(share[cell] > 0)) continue;
    heated_.push_back(static_cast<std::uint32_t>(cell));
    source_.push_back(share[cell]);
  }
}

void Bioheat::hold(std::size_t cell) {
  held_[cell] = 1;
  temperature_[cell] = properties_.body_temperature;
}

double Bioheat::longest_step() const {
  const HeatProperties& p = properties_;
  const double capacity = p.density * p.specific_heat;
  const double rate = 6 * p.conductivity / (capacity * grid_.spacing * grid_.spacing) +
                      p.perfusion * p.blood_density * p.blood_heat / capacity / 2;
  return 1 / rate;
}

double Bioheat::step(double dt_s, double most_power, double most_degrees) {
  const double body = properties_.body_temperature;
  const double capacity = properties_.density * properties_.specific_heat;
  const double diffusion = properties_.conductivity / (capacity * grid_.spacing * grid_.spacing);
  const auto row = static_cast<std::size_t>(grid_.size.x());
  const std::size_t layer = row * static_cast<std::size_t>(grid_.size.y());
  const double* t = temperature_.data();
  for (int k = 1; k + 1 < grid_.size.z(); ++k) {
    for (int j = 1; j + 1 < grid_.size.y(); ++j) {
      const std::size_t begin = grid_.index(1, j, k);
      for (std::size_t c = begin; c < begin + row - 2; ++c) {
        const double around = (t[c - 1] + t[c + 1]) + (t[c - row] + t[c + row]) + (t[c - layer] + t[c + layer]);
        const double rate = diffusion * (around - 6 * t[c]) + perfusion_[c] * (body - t[c]);
        next_[c] = held_[c] != 0 ? t[c] : t[c] + dt_s * rate;
      }
    }
  }
  // No cell may exceed the limit: the one with the least room for its share decides.
  double power = most_power;
  for (std::size_t i = 0; i < heated_.size(); ++i) {
    if (held(heated_[i])) continue;
    power = std::min(power, (most_degrees - next_[heated_[i]]) * capacity / (dt_s * source_[i]));
  }
  power = std::max(power, 0.0);
  for (std::size_t i = 0; i < heated_.size(); ++i) {
    if (!held(heated_[i])) next_[heated_[i]] += power * dt_s * source_[i] / capacity;
  }
  temperature_.swap(next_);

  for (std::size_t c = 0; c < temperature_.size(); ++c) {
    const double degrees = temperature_[c];
    if (degrees < kNoDose) continue;
    dose_[c] += dt_s * std::exp2(degrees >= 43 ? degrees - 43 : 2 * (degrees - 43));
    if (dose_[c] >= kLethal) perfusion_[c] = 0;
  }
  return power;
}

double Bioheat::hottest() const {
  return *std::ranges::max_element(temperature_);
}

}  // namespace stylet::procedures::ablation

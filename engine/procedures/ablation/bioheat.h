// Heat in perfused tissue: Pennes' equation on a grid of cubic cells, and what it destroys.
//
//   rho c dT/dt = k lap T + w rho_b c_b (T_a - T) + P s          (1)   Pennes 1948
//   CEM43 = Int R^(43 - T) dt,  R = 0.5 from 43 C on, else 0.25  (2)   Sapareto and Dewey 1984
//
// T temperature, T_a that of arterial blood, w perfusion (volume of blood per volume of tissue and time), P power of
// the source, s its distribution (1/m^3, integral 1). Tissue is destroyed where (2) reaches kLethal; blood no longer
// flows there (w = 0). Large vessels and the border of the grid stay at T_a. Explicit Euler in time, second order in
// space; the power is such that no cell exceeds a given temperature, which is exact since a step is linear in P.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace stylet::procedures::ablation {

/// Of liver and blood. The defaults are those of Tungjitkusolmun et al., IEEE TBME 49 (2002) 3, which models of
/// hepatic radio-frequency ablation share.
struct HeatProperties {
  double density = 1060;         ///< rho, kg/m^3
  double specific_heat = 3600;   ///< c, J/(kg K)
  double conductivity = 0.512;   ///< k, W/(m K)
  double perfusion = 6.4e-3;     ///< w, 1/s
  double blood_density = 1000;   ///< rho_b
  double blood_heat = 4180;      ///< c_b
  double body_temperature = 37;  ///< T_a, degrees Celsius
};

/// Cells x fastest; centre of cell (i,j,k) = origin + spacing * (i,j,k).
struct CellGrid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< m
  double spacing = 0.002;                            ///< m
  Eigen::Vector3i size = Eigen::Vector3i::Zero();

  std::size_t count() const { return static_cast<std::size_t>(size.cast<std::int64_t>().prod()); }
  std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>((static_cast<std::int64_t>(k) * size.y() + j) * size.x() + i);
  }
  Eigen::Vector3d centre(int i, int j, int k) const { return origin + spacing * Eigen::Vector3d(i, j, k); }
  double volume() const { return spacing * spacing * spacing; }
};

/// The field. Same inputs, same bits.
class Bioheat {
public:
  static constexpr double kLethal = 240 * 60;  ///< CEM43 that destroys liver, s: 240 minutes

  explicit Bioheat(const CellGrid& grid, const HeatProperties& properties = {});

  /// Where the power goes, 1/m^3 a cell, not negative; the sum times the cells' volume is 1 for the whole of it.
  void set_source(std::vector<double> share);
  /// A cell of a large vessel: it stays at body temperature.
  void hold(std::size_t cell);

  /// Longest stable step, s.
  double longest_step() const;
  /// @param dt_s           at most longest_step()
  /// @param most_power     W
  /// @param most_degrees   that no cell exceeds by heating
  /// @return the power of the source, W; what falls on held cells is carried off at once
  double step(double dt_s, double most_power, double most_degrees);

  const CellGrid& grid() const { return grid_; }
  const std::vector<double>& temperature() const { return temperature_; }  ///< degrees Celsius
  const std::vector<double>& dose() const { return dose_; }                ///< CEM43, s
  bool destroyed(std::size_t cell) const { return dose_[cell] >= kLethal; }
  bool held(std::size_t cell) const { return held_[cell] != 0; }
  double hottest() const;

private:
  CellGrid grid_;
  HeatProperties properties_;
  std::vector<double> temperature_;
  std::vector<double> next_;
  std::vector<double> dose_;
  std::vector<double> perfusion_;      // w rho_b c_b / (rho c), 1/s; 0 where destroyed
  std::vector<double> source_;         // of the cells below
  std::vector<std::uint32_t> heated_;  // cells with a source
  std::vector<std::uint8_t> held_;
};

}  // namespace stylet::procedures::ablation

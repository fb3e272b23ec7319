// The image chain in plain C++: what the GPU passes are tested against, and what image-quality tests measure on.
//
//   tissue     (line, sample) -> rest position X and dX/dy across the plane; trilinear mix of the labels around X;
//              backscatter * speckle over the slice thickness        (slice, follow_breath, mix_tissues, make_echoes)
//   interface  texture of the tissue; echoes from the gradient of ln Z, and what they take from the beam
//   (make_echoes) needle     analytic echoes of the shaft and tip, reverberation, shadow gas        what is shown
//   behind it: mirror image, echoes between surface and face, ringing froth attenuate  two-way amplitude exp(-sum of
//   loss) along each line; haze and clutter lateral, axial   separable Gaussian point-spread function, complex detect
//   receiver noise, compounding of looks, envelope, depth gain, log compression, persistence scan conversion  polar
//   to picture, grey map, depth scale
#pragma once

#include "engine/ultrasound/diagnosis.h"
#include "engine/ultrasound/scan_model.h"

#include <array>
#include <complex>
#include <cstdint>
#include <limits>
#include <vector>

namespace stylet::ultrasound {

/// Same results as Imager within the rounding of exp, log and sin. Thread: one at a time.
class ReferenceImager {
public:
  /// Keeps a reference to `scene`. @throws files::ContentError as ScanModel
  explicit ReferenceImager(const content::Scene& scene, const ImagerSettings& settings = {});

  /// Grey values of the picture of `state`, row by row from the top. [width * height]; valid until the next call
  const std::vector<std::uint8_t>& image(const state::FrameState& state);

  /// The next image is a first one: none before it persists in it.
  void restart() { model_.restart(); }
  const ScannerControls& controls() const { return model_.controls(); }
  /// As ScanModel has it.
  std::string set_controls(const ScannerControls& controls) { return model_.set_controls(controls); }
  void set_acoustics(std::span<const content::Tissue> tissues) { model_.set_acoustics(tissues); }

  /// Why the last image is black, one line; empty: it shows something.
  std::string diagnosis() const { return diagnose(model_); }

  /// Envelope of the last image before depth gain and log compression, 1 = rms of liver. [sample][line]
  const std::vector<float>& envelope() const { return envelope_; }
  /// What each pixel of the last image shows: indices of content::PictureLabels, row by row from the top.
  std::vector<std::uint8_t> label_map() const;
  const SectorGeometry& geometry() const { return model_.sector(); }
  const ScanGeometry& scan() const { return model_.scan(); }

private:
  using Complex = std::complex<float>;
  /// What a pixel of the picture shows.
  struct Pixel {
    float x, z;          ///< probe frame, m
    float range;         ///< m below the face
    float line, sample;  ///< fractional
    bool in_sector;
  };
  struct Mix {
    float log_impedance, loss;
  };
  /// What lies at a place: one tissue, or near a surface two, the second's share rising through it over a voxel.
  struct Mixture {
    int tissue;  ///< of the nearest voxel
    int other;
    float share;  ///< of `tissue`
  };
  /// The point of the shaft that shows most somewhere.
  struct Nearest {
    float distance2 = std::numeric_limits<float>::max();  ///< in standard deviations of the echo
    float from_tip = 0;                                   ///< m
    float along = 0;                                      ///< cosine between beam and shaft
  };

  void slice();
  void follow_breath();
  void mix_tissues();
  void make_echoes();
  template <typename Visit>
  void each_thin_sample(Visit&& visit) const;
  Nearest nearest_point(const Eigen::Vector2f& p, const Eigen::Vector2f& beam, const Eigen::Vector3f& scale) const;
  float mirror_law(const Nearest& at, const Eigen::Vector2f& beam) const;
  void add_needle();
  void add_wires();
  void find_gas();
  void add_gas();
  void add_gas(int line);
  int edge_of_surface(int line, int step, int reach) const;
  void attenuate();
  void convolve();
  void detect();
  void scan_convert();

  Pixel pixel(int u, int v) const;
  bool on_needle(const Eigen::Vector2f& p, float range) const;
  Eigen::Vector3f voxel_position(const Eigen::Vector3f& rest) const;
  std::uint32_t voxel_at(const Eigen::Vector3i& voxel) const;
  int tissue_of(std::uint32_t word, int body, bool gel) const;
  Mixture mixture_at(const Eigen::Vector3f& voxel, int body, bool gel) const;
  bool breathes_at(const Eigen::Vector3f& voxel) const;
  template <typename Visit>
  void each_corner(const Eigen::Vector3f& voxel, Visit&& visit) const;
  static Eigen::Vector3f lattice_at(const Eigen::Vector3f& rest);  ///< speckle lattice, texels
  static Eigen::Vector3i cell_at(const Eigen::Vector3f& rest) {
    return lattice_at(rest).array().floor().matrix().cast<int>();
  }
  /// The same in the lattice of the looks.
  Eigen::Vector3i grain_at(const Eigen::Vector3f& rest) const {
    return (model_.constants().grain * lattice_at(rest)).array().floor().matrix().cast<int>();
  }
  /// Texel of the slow fields for tissue of row `tissue`.
  std::size_t slow_texel(const Eigen::Vector3f& rest, int tissue) const;
  std::size_t index(int line, int sample) const { return static_cast<std::size_t>(sample) * lines_ + line; }

  ScanModel model_;
  int lines_;
  int samples_;
  int looks_;
  float textured_;                       ///< 1 shows slow texture, triads and beads, 0 does not
  std::vector<PlaneSlice::Place> rest_;  ///< body -1: none
  std::vector<Mix> mix_;
  std::vector<int> found_;   ///< row of the tissue table
  std::vector<int> fronts_;  ///< first sample in gas of each line; as many as there are samples: none
  std::array<std::vector<Complex>, kMaxLooks> echo_;
  std::array<std::vector<Complex>, kMaxLooks> scratch_;
  std::vector<float> loss_;  ///< nepers of a sample
  std::vector<float> envelope_;
  std::vector<float> display_;  ///< 0 black to 1 white, polar
  std::vector<std::uint8_t> picture_;
};

}  // namespace stylet::ultrasound

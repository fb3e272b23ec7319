// What both image chains (Imager on the GPU, ReferenceImager on the CPU) are given: a scene as an ultrasound scanner
// meets it. The tables are made once; update() makes the part that changes with every frame.
#pragma once

#include "engine/content/heated_zone.h"
#include "engine/content/scene.h"
#include "engine/state/frame_state.h"
#include "engine/ultrasound/beam_profile.h"
#include "engine/ultrasound/layer_depth.h"
#include "engine/ultrasound/plane_slice.h"
#include "engine/ultrasound/scan_geometry.h"
#include "engine/ultrasound/scanner_controls.h"
#include "engine/ultrasound/speckle_field.h"
#include "shaders/ultrasound_shared.h"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace stylet::ultrasound {

struct ImagerSettings {
  int width = 640;  ///< of the picture, px
  int height = 480;
  std::uint32_t seed = 1;     ///< of the speckle field and the receiver noise
  int looks = 3;              ///< intensity-compounded looks, 1..3; 1 is raw Rayleigh speckle
  int planes = 9;             ///< sub-planes across the slice thickness, odd, 1..13
  int line_oversampling = 2;  ///< lines computed for each scan line of the probe, so that speckle moves smoothly
  double noise_db = -69;      ///< receiver noise before the depth gain, relative to liver under the face
  bool haze = true;           ///< ring-down and reverberation in the near field
  bool texture = true;        ///< slow brightness of parenchyma, bright portal triads, beads along interfaces
  double persistence = 0;     ///< the control's first value; 0: every frame for itself
  bool depth_scale = true;    ///< marks every 10 mm at the right side
};

/// Thread: one at a time.
class ScanModel {
public:
  /// Keeps a reference to `scene` (its meshes and needle).
  /// @throws files::ContentError when the probe or the label volume cannot be imaged
  ScanModel(const content::Scene& scene, const ImagerSettings& settings);

  void update(const state::FrameState& state);
  /// The next frame is a first one: no earlier frame persists in it.
  void restart() { first_frame_ = true; }

  const ScannerControls& controls() const { return controls_; }
  /// Limits `controls` to what the probe can do and sets them from the next frame on. Number of lines and samples and
  /// the size of the picture stay.
  /// @return  what was limited (ultrasound::limit)
  std::string set_controls(ScannerControls controls);
  /// Other speckle and noise.
  void set_seed(std::uint32_t seed);
  /// New acoustics for the tissues of the scene, by label. [at most as many as there are]
  void set_acoustics(std::span<const content::Tissue> tissues);
  /// Counts the speckle fields there were.
  int speckle_version() const { return speckle_version_; }
  /// Counts what changed tissues(), beam() or picture_runs() since construction.
  int tables_version() const { return tables_version_; }

  const content::Scene& scene() const { return scene_; }
  const ScanGeometry& scan() const { return scan_; }
  const SectorGeometry& sector() const { return sector_; }
  const BeamProfile& beam() const { return beam_; }
  const SpeckleField& speckle() const { return speckle_; }
  /// Row of a tissue = its label; then gel and filler.
  const std::vector<TissueRow>& tissues() const { return tissues_; }
  /// engine/ultrasound/voxel_words.h
  const std::vector<std::uint16_t>& voxels() const { return voxels_; }
  const LayerDepth& layers() const { return layers_; }

  /// All pixels, kPixels of a row at a time: first of them | row << 16. The first sector_runs() show the sector.
  const std::vector<std::uint32_t>& picture_runs() const { return runs_; }
  int sector_runs() const { return sector_runs_; }

  // Of the last update().
  const PlaneSlice& slice() const { return slice_; }
  const std::vector<NeedleSegment>& needle() const {
    return needle_;
  }  ///< from the tip, or the stylet that is shot out of it, to the hub; at most kMaxBeams + 1
  /// Wires of the scene that come near the image plane.
  const std::vector<WireSegment>& wires() const { return wires_; }
  /// Tiles (PlaneSlice) that echoes of the needle and of wires reach; ascending.
  const std::vector<std::uint32_t>& thin_tiles() const { return thin_tiles_; }
  const FrameConstants& constants() const { return constants_; }
  /// Of the cells of the heated zone: gas, then dose; 0 ... 255.
  const std::vector<std::array<std::uint8_t, 2>>& zone_texels() const { return zone_texels_; }
  int zone_version() const { return zone_changes_; }  ///< another one after every change of zone_texels()
  struct Heated {
    float gas = 0;
    float dead = 0;  ///< share
    float rim = 0;   ///< of the zone
  };
  /// At a rest position.
  Heated heated_at(const Eigen::Vector3f& x) const;
  /// What an imager is made for, in the order of the constant_ids in shaders/ultrasound_common.glsl.
  std::vector<std::uint32_t> switches() const;

private:
  void make_geometry();
  void make_tissues();
  void set_receiver();
  void make_runs();
  void take_zone(const content::HeatedZone* zone);
  void place_thin(const state::FrameState& state, const Eigen::Isometry3f& probe_from_patient);
  void mark_tiles(const Eigen::Vector3f& a, const Eigen::Vector3f& b, double across, double before, double behind);
  float slice_reach() const;
  bool out_of_slice(const Eigen::Vector3f& a, const Eigen::Vector3f& b) const;
  void place_needle(const state::FrameState& state, const Eigen::Isometry3f& probe_from_patient);
  void place_wires(const Eigen::Isometry3f& probe_from_patient);
  float wire_amplitude(const content::Wire& wire, const Eigen::Vector3f& at) const;

  const content::Scene& scene_;
  ImagerSettings settings_;
  ScannerControls controls_;
  std::vector<content::Acoustics> acoustics_;  ///< of the rows of tissues_
  ScanGeometry scan_;
  SectorGeometry sector_;
  BeamProfile beam_;
  SpeckleField speckle_;
  std::vector<TissueRow> tissues_;
  std::vector<std::uint16_t> voxels_;
  LayerDepth layers_;
  PlaneSlice slice_;
  std::vector<NeedleSegment> needle_;
  std::vector<WireSegment> wires_;
  std::vector<std::uint8_t> marked_;  ///< [tiles]
  std::vector<std::uint32_t> thin_tiles_;
  std::vector<std::uint32_t> runs_;
  int sector_runs_ = 0;
  FrameConstants constants_{};
  std::vector<std::array<std::uint8_t, 2>> zone_texels_;
  std::uint64_t zone_version_ = 0;  ///< content::HeatedZone::version
  int zone_changes_ = 0;
  int tables_version_ = 0;
  int speckle_version_ = 1;
  bool first_frame_ = true;
};

}  // namespace stylet::ultrasound

// Where probe, image, needle and target are, as tracking systems say it: millimetres, in the patient's RAS.
#pragma once

#include "engine/state/frame_state.h"
#include "engine/tracking/sequence_file.h"
#include "engine/ultrasound/scan_geometry.h"

#include <vector>

namespace stylet::tracking {

/// Tracker is the patient in RAS (+X right, +Y anterior, +Z superior), origin as in the patient frame. Names as PLUS
/// has them:
///   ImageToProbe        pixel centres (column, row, 0) to the probe frame; the third axis makes it right-handed
///   ProbeToTracker      probe frame: +X lateral, +Y elevation, +Z into the body
///   NeedleToTracker     frame of the hub, +Z along the needle          } where the state has a needle
///   NeedleTipToTracker  the same at the tip, which bending turns       }
///   TargetToTracker     centre of the first target, as the tissue carries it
std::vector<NamedTransform> tracked_transforms(const state::FrameState& state,
                                               const ultrasound::SectorGeometry& image);

/// The rotation from the patient frame to RAS.
Eigen::Matrix3d ras_from_patient();
/// Of a frame given in the patient frame (m): to RAS, both in millimetres.
Eigen::Matrix4d ras_pose(const Eigen::Vector3f& position, const Eigen::Quaternionf& orientation);
/// Pixel centres (column, row, 0) to the probe frame in millimetres.
Eigen::Matrix4d image_to_probe(const ultrasound::SectorGeometry& image);

}  // namespace stylet::tracking

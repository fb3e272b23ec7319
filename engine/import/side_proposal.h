// A side file for those who have none: what each part is by its name, which organ deforms, what is the target.
#pragma once

#include "engine/import/organ_source.h"

#include <string>
#include <vector>

namespace stylet::import {

/// Text of a side file (side_file.h) with a scenario that leaves open what the import finds by itself: entry, probe
/// and, where no part is named so, the body. Parts are known by names as TotalSegmentator, 3D Slicer and atlases have
/// them; others are taken for soft tissue. What lies farther than 120 mm from the target's organ is left out.
/// @param target  name of a part. A lesion or cyst: the organ that surrounds it deforms. Else that organ deforms, and
/// a
///                lesion of 20 mm is made up in it.
/// @throws files::ContentError  no part, or no one part, is called so; a lesion that lies in no organ
std::string propose_side_text(const std::vector<SourceFile>& files, const std::string& target,
                              const std::string& name);

}  // namespace stylet::import

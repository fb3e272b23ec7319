// The cores of a biopsy laid beside the ultrasound image: each a strip of the tissues that lie in it.
#pragma once

#include "engine/content/scene.h"
#include "engine/content/texts.h"
#include "engine/figures/canvas.h"
#include "engine/picture/picture.h"
#include "engine/state/frame_state.h"

#include <cstddef>
#include <span>
#include <string>

namespace stylet::scanner {

inline constexpr std::size_t kMostStrips = 4;

/// "core 1: 17 mm, 82 % target". @param number  from 1
std::string core_caption(const state::CoreTrack& core, std::size_t number);

/// Where the strips of so many cores lie in an ultrasound picture of that size, with their captions: in its lower
/// left corner, above the note and beside the TGC curve.
figures::PixelBox core_strips_box(int width, int height, std::size_t cores);

/// Draws the newest kMostStrips of them, the newest lowest, the needle's tip on the left, all to one scale.
/// @param texts  null: English
void draw_core_strips(picture::Picture& picture, std::span<const state::CoreTrack> cores, const content::Scene& scene,
                      const content::Texts* texts, const figures::Font& font);

}  // namespace stylet::scanner

// Pieces of panels, drawn with Dear ImGui into the window that is open between view::Overlay::begin() and draw(): the
// same on a desktop and on the monitor in the room. Lengths are ems of the font.
#pragma once

#include "engine/panels/ending.h"
#include "engine/panels/session_facts.h"

namespace stylet::panels {

/// Size of the font, pixels.
float em();

/// Stage, time, what to do now and the hint.
void draw_course(const SessionFacts& facts, float width);
/// Paragraphs of the briefing.
void draw_briefing(const SessionFacts& facts, float width);
/// Score, result, advice, where points were lost, what is still under way.
void draw_ending(const Ending& ending, float width);
/// Force against depth with its legend, the whole of it in `width` x `height`.
void draw_force(const SessionFacts& facts, float width, float height);
/// Depth of the needle, force on hand and skin.
void draw_readings(const SessionFacts& facts);
/// For an instructor: where the tip is.
void draw_place(const SessionFacts& facts);
/// For an instructor: what to remark on.
void draw_warnings(const SessionFacts& facts);

}  // namespace stylet::panels

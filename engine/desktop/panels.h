// The panels of a session's window: what to do now, force against depth, the scanner's knobs, what an instructor
// watches. Drawn with Dear ImGui between view::Overlay::begin() and draw(); they know no window and no GPU.
#pragma once

#include "engine/panels/session_facts.h"
#include "engine/picture/panes.h"
#include "engine/scanner/scanner_console.h"

#include <optional>
#include <string>
#include <vector>

namespace stylet::desktop {

/// Something the trainee can do now: a button and its key.
struct Choice {
  std::string label;
  std::string key;      ///< as the keyboard calls it: "Enter"
  std::string why_not;  ///< empty: it can be done
};

/// What the panels show.
struct DesktopFacts {
  panels::SessionFacts session{};
  std::vector<Choice> choices{};
  std::string device{};                    ///< what leads the needle
  std::vector<std::string> needle_help{};  ///< keys that lead it, a line each
};

/// How much of the patient is seen.
enum class PatientView { closed, window, see_through };

/// Which panels are open, and what they were last asked.
class Panels {
public:
  /// @param key  GLFW's code. @return whether it means something here; see help_lines()
  bool press(int key);
  /// Draws them for a frame of that size.
  /// @param console   its knobs are turned by the sliders
  /// @param ultrasound  where its image lies
  /// @return  the choice whose button was pressed
  std::optional<std::size_t> draw(const DesktopFacts& facts, scanner::ScannerConsole& console, int width, int height,
                                  const picture::Pane& ultrasound);

  PatientView patient_view() const { return patient_view_; }
  bool hidden() const { return hidden_; }
  bool instructor() const { return instructor_; }

  /// The keys and what they do, a line each.
  static const std::vector<std::string>& help_lines();

private:
  static void draw_briefing(const panels::SessionFacts& facts, int width, int height);
  static void draw_help(const DesktopFacts& facts, int width, int height);
  void draw_instructor(const panels::SessionFacts& facts);

  bool hidden_ = false;
  bool force_ = true;
  bool scanner_ = false;
  bool instructor_ = false;
  PatientView patient_view_ = PatientView::window;
};

}  // namespace stylet::desktop

// The panels of a session's window: what to do now, force against depth, the scanner's knobs, what an instructor
// watches. Drawn with Dear ImGui between view::Overlay::begin() and draw(); they know no window and no GPU.
#pragma once

#include "engine/desktop/layout.h"
#include "engine/panels/ending.h"
#include "engine/panels/session_facts.h"
#include "engine/scanner/scanner_console.h"

#include <cstdint>
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
  bool led_by_keys = false;                ///< the needle
  std::string pictures{};                  ///< how often they come and how old they are
  std::string sound{};                     ///< what there is to say of it; empty: nothing
  const content::Texts* texts = nullptr;   ///< of another language; null: English
  const panels::Ending* ending = nullptr;  ///< the session is over: what it came to
};

/// How much of the patient is seen.
enum class PatientView { closed, window, see_through };

enum class PanelCommand : std::uint8_t {
  toggle_all,
  toggle_force,
  toggle_scanner,
  toggle_instructor,
  toggle_help,
  next_patient_view,
  toggle_figures,
  other_hand,
};

/// What was asked for on the panels since the frame before.
struct PanelInput {
  std::optional<std::size_t> choice{};      ///< whose button was pressed
  std::vector<scanner::Command> scanner{};  ///< by its sliders and buttons
};

/// Which panels are open, and on which side.
class Panels {
public:
  void apply(PanelCommand command);
  /// Draws them for a frame of that size.
  /// @param console  shown on the sliders
  PanelInput draw(const DesktopFacts& facts, const scanner::ScannerConsole& console, int width, int height);
  /// Where they lie while such facts are shown, within a frame of the overlay.
  Layout layout(const DesktopFacts& facts, int width, int height) const;

  PatientView patient_view() const { return patient_view_; }
  bool hidden() const { return hidden_; }
  bool instructor() const { return instructor_; }
  bool help() const { return help_; }
  bool figures() const { return figures_; }
  bool left_handed() const { return left_handed_; }

private:
  OpenPanels open(const DesktopFacts& facts) const;
  static void draw_help(const DesktopFacts& facts, int width, int height);
  void draw_instructor(const panels::SessionFacts& facts);

  bool hidden_ = false;
  bool force_ = true;
  bool scanner_ = false;
  bool instructor_ = false;
  bool help_ = false;
  bool figures_ = false;
  bool left_handed_ = false;
  PatientView patient_view_ = PatientView::window;
};

}  // namespace stylet::desktop

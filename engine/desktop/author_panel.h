// The panel of `stylet author` and its marks in the 3-D view, drawn with Dear ImGui; knows no window and no GPU.
#pragma once

#include "engine/content/scene.h"
#include "engine/content/texts.h"
#include "engine/view/input.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace stylet::desktop {

enum class AuthorTool : std::uint8_t { target, entry, probe, forbidden };
enum class AuthorWish : std::uint8_t {
  nothing,
  next_target,
  camera,
  undo,
  redo,
  larger,
  smaller,
  closed,
  save,
  leave,
  discard
};

/// A place in the patient with a word to it.
struct AuthorMark {
  std::string text{};
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  double radius = 0;     ///< m; 0: a point
  bool problem = false;  ///< in the colour of warnings
};

struct AuthorFacts {
  std::string title{};
  AuthorTool tool = AuthorTool::target;
  std::vector<AuthorMark> marks{};
  std::vector<std::string> targets{};    ///< names
  std::size_t target = 0;                ///< that is edited
  std::vector<std::string> problems{};   ///< all, one line each
  std::vector<std::string> organs{};     ///< ids
  std::vector<std::string> forbidden{};  ///< those of them
  std::string said{};                    ///< what the last action came to
  bool changed = false;
  bool can_undo = false;
  bool can_redo = false;
  bool checking = false;
  bool leaving = false;  ///< asked to leave with something not saved
};

/// Keys 1 to 4 take a tool. @return what other keys ask for
AuthorWish author_keys(const view::Input& input, bool leaving, AuthorTool& tool);

/// What was chosen on the panel.
struct AuthorChoice {
  AuthorTool tool = AuthorTool::target;
  std::size_t target = 0;  ///< to be edited
  std::string toggled{};   ///< an organ that is to be forbidden, or no longer; empty: none
  AuthorWish wish = AuthorWish::nothing;
};

/// Marks over a picture of `camera`, and the panel on the left.
AuthorChoice draw_author(const AuthorFacts& facts, const content::Camera& camera, int width, int height,
                         const content::Texts& texts);

}  // namespace stylet::desktop

// A scenario file being edited: every change can be undone, and nothing of what was there is lost.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace stylet::author {

/// What is edited. Patient frame, metres.
struct TargetPlan {
  std::string name{};
  std::string organ{};  ///< id; empty: centre and radius
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0.01;
};

class Draft {
public:
  /// @throws files::ContentError  unreadable, no JSON object
  explicit Draft(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }
  /// Of the file as it would be saved.
  const std::string& text() const { return now().text; }

  // Each is one change. What says the same as before is none. @throws files::ContentError
  void set_target(std::size_t index, const TargetPlan& target);
  void set_probe(const physics::RigidPose& pose);
  void set_camera(const content::Camera& camera);
  void set_forbidden(const std::vector<std::string>& organs);
  /// The needle goes in there: the motion is to be made anew.
  void set_entry(const Eigen::Vector3d& entry);

  std::vector<TargetPlan> targets() const;  ///< centre and radius of an organ are not known
  std::vector<std::string> forbidden() const;
  std::optional<physics::RigidPose> probe() const;                      ///< none: given by axes, and not changed yet
  std::optional<content::Camera> camera() const;                        ///< none: given in the room's frame
  std::optional<Eigen::Vector3d> entry() const { return now().entry; }  ///< none: as the motion has it

  bool can_undo() const { return at_ > 0; }
  bool can_redo() const { return at_ + 1 < states_.size(); }
  void undo() { at_ -= can_undo() ? 1 : 0; }
  void redo() { at_ += can_redo() ? 1 : 0; }
  /// Since it was read or saved.
  bool changed() const { return now().text != saved_.text || now().entry != saved_.entry; }

  /// Writes the file, whole or not at all, and is done when it is on the disk; nothing where nothing has changed. A
  /// new entry gets a motion file beside it, so that others keep theirs; the next one takes its place.
  /// @param write_motion  writes one for an entry to a path
  /// @throws files::ContentError  not writable, or another program has changed the file meanwhile: it stays as it is
  using WriteMotion = std::function<void(const Eigen::Vector3d& entry, const std::filesystem::path& path)>;
  void save(const WriteMotion& write_motion);
  /// Writes what is not saved beside the file, under a name that is free. @return its path
  std::filesystem::path keep() const;

private:
  struct State {
    std::string text{};
    std::optional<Eigen::Vector3d> entry{};
  };
  const State& now() const { return states_[at_]; }
  void push(State state);
  std::filesystem::path own_motion() const;

  std::filesystem::path path_;
  std::vector<State> states_;
  std::size_t at_ = 0;
  State saved_;
  std::string on_disk_;
};

/// What is odd about a plan, with the place to show it at.
struct Oddity {
  std::string text{};
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
};

/// What can be seen at once, without loading anything.
/// @param targets    with centre and radius
/// @param forbidden  indices into scene.surfaces
std::vector<Oddity> look_over(const content::Scene& scene, const std::vector<TargetPlan>& targets,
                              const std::vector<std::size_t>& forbidden, const std::optional<Eigen::Vector3d>& entry);

/// The JSON pointer of a problem's line "file:/pointer: what"; empty: it has none.
std::string pointer_of(const std::string& line);

}  // namespace stylet::author

#include "engine/immersive/immersive_view.h"

#include "engine/render/room_layout.h"

#include <cmath>

namespace stylet::immersive {

namespace {

/// The eye of a camera in the room, turned about the vertical as it looks.
Eigen::Isometry3d place_of(const content::Scene& scene, const content::Camera& camera) {
  const Eigen::Vector3d eye = scene.room_from_patient * camera.eye;
  const Eigen::Vector3d ahead = scene.room_from_patient * camera.look_at - eye;
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  place.translate(eye);
  place.rotate(Eigen::AngleAxisd(std::atan2(-ahead.x(), -ahead.z()), Eigen::Vector3d::UnitY()));
  return place;
}

}  // namespace

Eigen::Isometry3d standing_place(const content::Scene& scene) {
  return place_of(scene, scene.camera);
}

Eigen::Isometry3d floor_place(const content::Scene& scene) {
  const render::RoomLayout room = render::room_layout(scene);
  Eigen::Isometry3d place = place_of(scene, room.standing_camera());
  const Eigen::Vector3d on_floor = room.patient_from_table * Eigen::Vector3d(0, 0, room.floor_z);
  place.translation().y() = (scene.room_from_patient * on_floor).y();
  return place;
}

std::array<render::EyeView, 2> eyes_in_patient(const content::Scene& scene, const headset::HeadsetFrame& frame) {
  const Eigen::Isometry3d patient_from_room = scene.room_from_patient.inverse();
  std::array<render::EyeView, 2> views;
  for (std::size_t i = 0; i < 2; ++i) {
    const headset::HeadsetEye& eye = frame.eyes[i];
    views[i] = {patient_from_room * eye.room_from_eye, eye.left, eye.right, eye.up, eye.down};
  }
  return views;
}

ImmersiveView::~ImmersiveView() {
  device_.settle();  // the last frame may still be drawn, or copied to the headset
}

const gpu::Image& ImmersiveView::draw(const headset::HeadsetFrame& frame, const state::FrameState& state,
                                      const Pictures& pictures) {
  if (!renderer_ || frame.size != size_) {
    device_.wait_idle();
    renderer_.reset();
    renderer_.emplace(
        device_, scene_,
        render::RenderSettings{
            .width = static_cast<int>(frame.size.width), .height = static_cast<int>(frame.size.height), .views = 2});
    size_ = frame.size;
  }
  render::ViewOptions options{.plane = pictures.plane,
                              .screen = pictures.screen,
                              .panel = pictures.panel,
                              .see_through = pictures.see_through};
  const Eigen::Isometry3d patient_from_room = scene_.room_from_patient.inverse();
  const auto grip = [&](const headset::Hand& hand) {
    return hand.tracked ? std::optional(patient_from_room * hand.room_from_grip) : std::nullopt;
  };
  options.needle_hand = grip(frame.hands.needle());
  options.probe_hand = grip(frame.hands.probe());
  if (pictures.needle != nullptr)
    options.latch_needle = [&](render::NeedlePose needle) {
      pictures.needle->show(needle.positions, needle.orientations);
    };
  return renderer_->render(state, eyes_in_patient(scene_, frame), options);
}

}  // namespace stylet::immersive

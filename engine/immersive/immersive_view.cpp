#include "engine/immersive/immersive_view.h"

#include <cmath>

namespace stylet::immersive {

Eigen::Isometry3d standing_place(const content::Scene& scene) {
  const Eigen::Vector3d eye = scene.room_from_patient * scene.camera.eye;
  const Eigen::Vector3d ahead = scene.room_from_patient * scene.camera.look_at - eye;
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  place.translate(eye);
  place.rotate(Eigen::AngleAxisd(std::atan2(-ahead.x(), -ahead.z()), Eigen::Vector3d::UnitY()));
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
  if (pictures.needle != nullptr)
    options.latch_needle = [&](render::NeedlePose needle) {
      pictures.needle->show(needle.positions, needle.orientations);
    };
  return renderer_->render(state, eyes_in_patient(scene_, frame), options);
}

}  // namespace stylet::immersive

#define XR_USE_GRAPHICS_API_VULKAN
#include "engine/headset/headset.h"

#include <openxr/openxr_platform.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace stylet::headset {

namespace {

constexpr XrTime kSizePeriod = 1'000'000'000;  // ns between looks at the recommended size, which no event tells

/// Place and heading of a pose: what is left when the horizon is kept.
Eigen::Isometry3d upright(const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d back = pose.linear().col(2);
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translate(pose.translation());
  // Looking straight up or down, the top of the head says where it faces.
  const Eigen::Vector3d level = std::hypot(back.x(), back.z()) > 1e-3
                                    ? back
                                    : Eigen::Vector3d(pose.linear().col(1) * (back.y() > 0 ? -1.0 : 1.0));
  out.rotate(Eigen::AngleAxisd(std::atan2(level.x(), level.z()), Eigen::Vector3d::UnitY()));
  return out;
}

bool knows_floor(XrSession session) {
  std::uint32_t count = 0;
  xr::check(xrEnumerateReferenceSpaces(session, 0, &count, nullptr), "xrEnumerateReferenceSpaces");
  std::vector<XrReferenceSpaceType> types(count);
  xr::check(xrEnumerateReferenceSpaces(session, count, &count, types.data()), "xrEnumerateReferenceSpaces");
  return std::ranges::find(types, XR_REFERENCE_SPACE_TYPE_STAGE) != types.end();
}

}  // namespace

Headset::Headset(HeadsetRuntime& runtime, gpu::Device& device, const HeadsetSettings& settings)
    : runtime_(runtime),
      device_(device),
      room_from_standing_(upright(settings.room_from_standing)),
      room_from_local_(room_from_standing_) {
  XrGraphicsBindingVulkan2KHR binding{XR_TYPE_GRAPHICS_BINDING_VULKAN2_KHR};
  binding.instance = device.instance();
  binding.physicalDevice = device.physical();
  binding.device = device.handle();
  binding.queueFamilyIndex = device.queue_family();
  binding.queueIndex = 0;
  XrSessionCreateInfo create{XR_TYPE_SESSION_CREATE_INFO, &binding};
  create.systemId = runtime.system();
  xr::check(xrCreateSession(runtime.instance(), &create, &session_), "xrCreateSession");
  try {
    // STAGE lies on the floor, its middle somewhere: the head says where the trainee stands. LOCAL is where the head
    // was when the runtime started or was last recentred by its own button, level with the horizon; every runtime has
    // it.
    if (settings.room_from_floor && knows_floor(session_)) {
      room_from_local_ = *(room_from_floor_ = upright(*settings.room_from_floor));
      recentre_ = true;
    }
    XrReferenceSpaceCreateInfo space{XR_TYPE_REFERENCE_SPACE_CREATE_INFO};
    space.referenceSpaceType = room_from_floor_ ? XR_REFERENCE_SPACE_TYPE_STAGE : XR_REFERENCE_SPACE_TYPE_LOCAL;
    space.poseInReferenceSpace = xr::kIdentityPose;
    xr::check(xrCreateReferenceSpace(session_, &space, &local_), "xrCreateReferenceSpace");
    controllers_.emplace(runtime.instance(), session_, settings.left_handed);
    swapchain_.emplace(session_, device, runtime.eye_size());
  } catch (...) {
    controllers_.reset();
    xrDestroySession(session_);
    throw;
  }
}

Headset::~Headset() {
  swapchain_.reset();
  controllers_.reset();
  xrDestroySpace(local_);
  xrDestroySession(session_);
}

void Headset::lose(const std::string& why) {
  if (phase_ == HeadsetPhase::lost) return;
  phase_ = HeadsetPhase::lost;
  reason_ = why;
}

HeadsetPhase Headset::poll() {
  try {
    while (phase_ != HeadsetPhase::lost && phase_ != HeadsetPhase::ended) {
      XrEventDataBuffer event{XR_TYPE_EVENT_DATA_BUFFER};
      const XrResult result = xrPollEvent(runtime_.instance(), &event);
      xr::check(result, "xrPollEvent");
      if (result == XR_EVENT_UNAVAILABLE) break;
      handle(event);
    }
    if (phase_ == HeadsetPhase::running) fit_swapchain();
  } catch (const gpu::DeviceLost&) {
    throw;
  } catch (const std::runtime_error& error) {
    lose(error.what());
  }
  return phase_;
}

void Headset::handle(const XrEventDataBuffer& event) {
  if (event.type == XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING) {
    lose("the OpenXR runtime shuts down");
  } else if (event.type == XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING) {
    look_at_size_ = true;  // in LOCAL the poses follow by themselves; what else the user changed may be the size
    if (room_from_floor_) recentre_ = true;
  } else if (event.type == XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED) {
    const auto& change = reinterpret_cast<const XrEventDataSessionStateChanged&>(event);
    if (change.session == session_) change_state(change.state);
  }
}

void Headset::change_state(XrSessionState state) {
  state_ = state;
  look_at_size_ = true;
  switch (state) {
    case XR_SESSION_STATE_READY: {
      XrSessionBeginInfo begin{XR_TYPE_SESSION_BEGIN_INFO};
      begin.primaryViewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
      xr::check(xrBeginSession(session_, &begin), "xrBeginSession");
      phase_ = HeadsetPhase::running;
      break;
    }
    case XR_SESSION_STATE_STOPPING:
      phase_ = HeadsetPhase::waiting;
      xr::check(xrEndSession(session_), "xrEndSession");
      break;
    case XR_SESSION_STATE_EXITING:
      phase_ = HeadsetPhase::ended;
      break;
    case XR_SESSION_STATE_LOSS_PENDING:
      lose("the headset has gone (connection, power or its runtime)");
      break;
    default:
      break;  // idle: frames stop with STOPPING; synchronized, visible, focused: HeadsetFrame says what that means
  }
}

void Headset::fit_swapchain() {
  if (!look_at_size_ && display_time_ < size_looked_at_ + kSizePeriod) return;
  look_at_size_ = false;
  size_looked_at_ = display_time_;
  const EyeSize wanted = runtime_.eye_size();
  if (wanted == swapchain_->size()) return;
  swapchain_.reset();
  swapchain_.emplace(session_, device_, wanted);
}

std::optional<HeadsetFrame> Headset::begin_frame() {
  if (phase_ != HeadsetPhase::running) return std::nullopt;
  try {
    return start_frame();
  } catch (const std::runtime_error& error) {
    lose(error.what());
    return std::nullopt;
  }
}

HeadsetFrame Headset::start_frame() {
  XrFrameState wanted{XR_TYPE_FRAME_STATE};
  xr::check(xrWaitFrame(session_, nullptr, &wanted), "xrWaitFrame");
  xr::check(xrBeginFrame(session_, nullptr), "xrBeginFrame");
  display_time_ = wanted.predictedDisplayTime;

  XrViewLocateInfo locate{XR_TYPE_VIEW_LOCATE_INFO};
  locate.viewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
  locate.displayTime = display_time_;
  locate.space = local_;
  XrViewState state{XR_TYPE_VIEW_STATE};
  for (XrView& view : views_) view = {XR_TYPE_VIEW};
  std::uint32_t count = 0;
  xr::check(xrLocateViews(session_, &locate, &state, 2, &count, views_.data()), "xrLocateViews");
  constexpr XrViewStateFlags kValid = XR_VIEW_STATE_POSITION_VALID_BIT | XR_VIEW_STATE_ORIENTATION_VALID_BIT;
  const bool tracked = (state.viewStateFlags & kValid) == kValid &&
                       std::ranges::all_of(views_, [](const XrView& view) { return xr::is_pose(view.pose); });
  drawable_ = wanted.shouldRender == XR_TRUE && tracked;
  if (recentre_ && tracked) {
    recentre_ = false;
    XrPosef head = views_[0].pose;
    head.position = {(head.position.x + views_[1].pose.position.x) / 2,
                     (head.position.y + views_[1].pose.position.y) / 2,
                     (head.position.z + views_[1].pose.position.z) / 2};
    place_room(head);
  }

  HeadsetFrame frame;
  frame.display_time_ns = display_time_;
  frame.period_s = static_cast<double>(wanted.predictedDisplayPeriod) * 1e-9;
  frame.draw = drawable_;
  frame.size = swapchain_->size();
  for (std::size_t i = 0; i < 2; ++i) {
    const XrFovf& fov = views_[i].fov;
    frame.eyes[i] = {room_from_local_ * xr::pose(views_[i].pose), fov.angleLeft, fov.angleRight, fov.angleUp,
                     fov.angleDown};
  }
  frame.hands = controllers_->read(display_time_, local_, room_from_local_);
  if (frame.hands.recentre_pressed) recentre();
  return frame;
}

void Headset::place_room(const XrPosef& head) {
  Eigen::Isometry3d from = upright(xr::pose(head));
  if (room_from_floor_) from.translation().y() = 0;  // the head stays as high as it is
  room_from_local_ = (room_from_floor_ ? *room_from_floor_ : room_from_standing_) * from.inverse();
}

void Headset::vibrate(const Vibration& vibration) {
  if (phase_ != HeadsetPhase::running || !focused()) return;
  try {
    controllers_->vibrate(vibration);
  } catch (const std::runtime_error& error) {
    lose(error.what());
  }
}

void Headset::end_frame(const gpu::Image* eyes) {
  if (phase_ == HeadsetPhase::lost) return;
  try {
    submit_frame(eyes);
  } catch (const gpu::DeviceLost&) {
    throw;
  } catch (const std::runtime_error& error) {
    lose(error.what());
  }
}

void Headset::submit_frame(const gpu::Image* eyes) {
  const bool draw = drawable_ && eyes != nullptr;
  if (draw) swapchain_->show(*eyes);
  std::array<XrCompositionLayerProjectionView, 2> views{};
  for (std::uint32_t i = 0; i < 2; ++i) {
    views[i].type = XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW;
    views[i].pose = views_[i].pose;
    views[i].fov = views_[i].fov;
    const EyeSize& size = swapchain_->size();
    views[i].subImage = {
        swapchain_->handle(), {{0, 0}, {static_cast<int>(size.width), static_cast<int>(size.height)}}, i};
  }
  XrCompositionLayerProjection layer{XR_TYPE_COMPOSITION_LAYER_PROJECTION};
  layer.space = local_;
  layer.viewCount = 2;
  layer.views = views.data();
  const auto* const layers = reinterpret_cast<const XrCompositionLayerBaseHeader*>(&layer);
  XrFrameEndInfo end{XR_TYPE_FRAME_END_INFO};
  end.displayTime = display_time_;
  end.environmentBlendMode = XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
  end.layerCount = draw ? 1 : 0;
  end.layers = draw ? &layers : nullptr;
  xr::check(xrEndFrame(session_, &end), "xrEndFrame");
}

void Headset::request_exit() {
  if (phase_ != HeadsetPhase::running) return;
  try {
    xr::check(xrRequestExitSession(session_), "xrRequestExitSession");
  } catch (const HeadsetError& error) {
    lose(error.what());
  }
}

}  // namespace stylet::headset

// Session states, spaces, views and frames.
#include "tests/support/openxr/state.h"

#include <cmath>
#include <cstring>
#include <ctime>

namespace stylet::mock_xr {

void change_state(Session& session, XrSessionState state) {
  session.state = state;
  runtime().report.states.push_back(state);
  XrEventDataSessionStateChanged event{XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED};
  event.session = handle_of<XrSession>(&session);
  event.state = state;
  runtime().queue(event);
}

namespace {

XrTime now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return XrTime{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

void sleep_until(XrTime time) {
  const timespec t{time / 1'000'000'000, time % 1'000'000'000};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

XrPosef inverse(const XrPosef& p) {
  const XrPosef turn{{-p.orientation.x, -p.orientation.y, -p.orientation.z, p.orientation.w}, {0, 0, 0}};
  const XrPosef back{{0, 0, 0, 1}, {-p.position.x, -p.position.y, -p.position.z}};
  return turn * back;
}

/// One step a frame towards what the trainee and the script want.
void advance(Session& session) {
  const bool shown = session.worn && !session.exit_requested;
  switch (session.state) {
    case XR_SESSION_STATE_READY:
      return change_state(session, XR_SESSION_STATE_SYNCHRONIZED);
    case XR_SESSION_STATE_SYNCHRONIZED:
      if (shown) return change_state(session, XR_SESSION_STATE_VISIBLE);
      if (session.exit_requested) return change_state(session, XR_SESSION_STATE_STOPPING);
      return;
    case XR_SESSION_STATE_VISIBLE:
      return change_state(session, shown ? XR_SESSION_STATE_FOCUSED : XR_SESSION_STATE_SYNCHRONIZED);
    case XR_SESSION_STATE_FOCUSED:
      if (!shown) change_state(session, XR_SESSION_STATE_VISIBLE);
      return;
    default:
      return;
  }
}

XrResult xrCreateSession(XrInstance instance, const XrSessionCreateInfo* create, XrSession* session) {
  MOCK_OBJECT(Instance, owner, instance);
  MOCK_STRUCT(create, XR_TYPE_SESSION_CREATE_INFO);
  const auto* graphics = static_cast<const XrGraphicsBindingVulkanKHR*>(create->next);
  MOCK_REQUIRE(owner->vulkan && graphics != nullptr && graphics->type == XR_TYPE_GRAPHICS_BINDING_VULKAN2_KHR,
               XR_ERROR_GRAPHICS_DEVICE_INVALID, "no Vulkan binding");
  MOCK_REQUIRE(owner->requirements_asked, XR_ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING, "ask for them first");
  MOCK_REQUIRE(graphics->instance == owner->vk_instance && graphics->physicalDevice == owner->vk_physical &&
                   graphics->device == owner->vk_device && graphics->device != VK_NULL_HANDLE,
               XR_ERROR_GRAPHICS_DEVICE_INVALID, "not the device made through this runtime");
  MOCK_REQUIRE(runtime().only<Session>() == nullptr, XR_ERROR_LIMIT_REACHED, "one session at a time");
  auto made = std::make_unique<Session>();
  made->graphics = *graphics;
  vkGetDeviceQueue(graphics->device, graphics->queueFamilyIndex, graphics->queueIndex, &made->queue);
  VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
  pool.queueFamilyIndex = graphics->queueFamilyIndex;
  MOCK_REQUIRE(vkCreateCommandPool(graphics->device, &pool, nullptr, &made->pool) == VK_SUCCESS,
               XR_ERROR_RUNTIME_FAILURE, "vkCreateCommandPool");
  made->next_time = runtime().script.in_real_time ? now() : 1'000'000'000;
  Session* const added = runtime().add(std::move(made), owner);
  *session = handle_of<XrSession>(added);
  change_state(*added, XR_SESSION_STATE_IDLE);
  change_state(*added, XR_SESSION_STATE_READY);
  return XR_SUCCESS;
}

XrResult xrDestroySession(XrSession session) {
  Session* const found = runtime().find<Session>(session);
  MOCK_REQUIRE(found != nullptr, XR_ERROR_HANDLE_INVALID, "no such session");
  runtime().destroy(found);
  return XR_SUCCESS;
}

XrResult xrBeginSession(XrSession session, const XrSessionBeginInfo* begin) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(begin, XR_TYPE_SESSION_BEGIN_INFO);
  MOCK_REQUIRE(!found->running, XR_ERROR_SESSION_RUNNING, "running already");
  MOCK_REQUIRE(found->state == XR_SESSION_STATE_READY, XR_ERROR_SESSION_NOT_READY, "not ready");
  MOCK_REQUIRE(begin->primaryViewConfigurationType == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO,
               XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED, "stereo only");
  found->running = true;
  found->waited = found->begun = false;
  return XR_SUCCESS;
}

XrResult xrEndSession(XrSession session) {
  MOCK_SESSION(found, session);
  MOCK_REQUIRE(found->running, XR_ERROR_SESSION_NOT_RUNNING, "not running");
  MOCK_REQUIRE(found->state == XR_SESSION_STATE_STOPPING, XR_ERROR_SESSION_NOT_STOPPING, "not stopping");
  found->running = false;
  change_state(*found, XR_SESSION_STATE_IDLE);
  if (found->exit_requested && found->worn) change_state(*found, XR_SESSION_STATE_EXITING);
  found->exit_requested = false;
  return XR_SUCCESS;
}

XrResult xrRequestExitSession(XrSession session) {
  MOCK_SESSION(found, session);
  MOCK_REQUIRE(found->running, XR_ERROR_SESSION_NOT_RUNNING, "not running");
  found->exit_requested = true;
  return XR_SUCCESS;
}

XrResult xrEnumerateReferenceSpaces(XrSession session, std::uint32_t capacity, std::uint32_t* count,
                                    XrReferenceSpaceType* list) {
  MOCK_SESSION(found, session);
  std::vector types{XR_REFERENCE_SPACE_TYPE_VIEW, XR_REFERENCE_SPACE_TYPE_LOCAL};
  if (runtime().script.stage) types.push_back(XR_REFERENCE_SPACE_TYPE_STAGE);
  return give(__func__, types, capacity, count, list);
}

XrResult xrCreateReferenceSpace(XrSession session, const XrReferenceSpaceCreateInfo* create, XrSpace* space) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(create, XR_TYPE_REFERENCE_SPACE_CREATE_INFO);
  const bool stage = create->referenceSpaceType == XR_REFERENCE_SPACE_TYPE_STAGE;
  MOCK_REQUIRE(create->referenceSpaceType == XR_REFERENCE_SPACE_TYPE_LOCAL || (stage && runtime().script.stage),
               XR_ERROR_REFERENCE_SPACE_UNSUPPORTED, "local only, or a stage that the script has");
  MOCK_REQUIRE(is_unit(create->poseInReferenceSpace.orientation), XR_ERROR_POSE_INVALID, "no unit quaternion");
  auto made = std::make_unique<Space>();
  made->type = create->referenceSpaceType;
  made->offset =
      stage ? runtime().script.local_from_stage * create->poseInReferenceSpace : create->poseInReferenceSpace;
  *space = handle_of<XrSpace>(runtime().add(std::move(made), found));
  return XR_SUCCESS;
}

XrResult xrCreateActionSpace(XrSession session, const XrActionSpaceCreateInfo* create, XrSpace* space) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(create, XR_TYPE_ACTION_SPACE_CREATE_INFO);
  MOCK_OBJECT(Action, action, create->action);
  MOCK_REQUIRE(action->type == XR_ACTION_TYPE_POSE_INPUT, XR_ERROR_ACTION_TYPE_MISMATCH, "no pose");
  MOCK_REQUIRE(is_unit(create->poseInActionSpace.orientation), XR_ERROR_POSE_INVALID, "no unit quaternion");
  const std::string* hand = path_text(instance_of(found), create->subactionPath);
  MOCK_REQUIRE(hand != nullptr && (*hand == "/user/hand/left" || *hand == "/user/hand/right"),
               XR_ERROR_PATH_UNSUPPORTED, "name a hand");
  auto made = std::make_unique<Space>();
  made->is_hand = true;
  made->hand = *hand == "/user/hand/left" ? 0 : 1;
  made->offset = create->poseInActionSpace;
  *space = handle_of<XrSpace>(runtime().add(std::move(made), found));
  return XR_SUCCESS;
}

XrResult xrDestroySpace(XrSpace space) {
  Space* const found = runtime().find<Space>(space);
  MOCK_REQUIRE(found != nullptr, XR_ERROR_HANDLE_INVALID, "no such space");
  runtime().destroy(found);
  return XR_SUCCESS;
}

XrResult xrLocateSpace(XrSpace space, XrSpace base, XrTime time, XrSpaceLocation* location) {
  MOCK_OBJECT(Space, found, space);
  MOCK_OBJECT(Space, from, base);
  MOCK_STRUCT(location, XR_TYPE_SPACE_LOCATION);
  MOCK_REQUIRE(!dynamic_cast<Session&>(*found->parent).lost, XR_ERROR_SESSION_LOST, "the session is lost");
  MOCK_REQUIRE(time > 0, XR_ERROR_TIME_INVALID, "no time");
  MOCK_REQUIRE(found->is_hand && !from->is_hand, XR_ERROR_VALIDATION_FAILURE, "hands in the local space only");
  runtime().report.hands_at = time;
  const auto& session = dynamic_cast<const Session&>(*found->parent);
  const Script& script = runtime().script;
  const HandScript hand = found->hand == 0 ? script.left(time) : script.right(time);
  location->locationFlags = 0;
  if (!hand.tracked || session.state != XR_SESSION_STATE_FOCUSED) return XR_SUCCESS;
  location->pose = inverse(from->offset) * (hand.grip * found->offset);
  location->locationFlags = XR_SPACE_LOCATION_ORIENTATION_VALID_BIT | XR_SPACE_LOCATION_POSITION_VALID_BIT |
                            XR_SPACE_LOCATION_ORIENTATION_TRACKED_BIT | XR_SPACE_LOCATION_POSITION_TRACKED_BIT;
  return XR_SUCCESS;
}

XrResult xrLocateViews(XrSession session, const XrViewLocateInfo* locate, XrViewState* state, std::uint32_t capacity,
                       std::uint32_t* count, XrView* views) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(locate, XR_TYPE_VIEW_LOCATE_INFO);
  MOCK_STRUCT(state, XR_TYPE_VIEW_STATE);
  MOCK_OBJECT(Space, base, locate->space);
  MOCK_REQUIRE(locate->displayTime > 0, XR_ERROR_TIME_INVALID, "no time");
  MOCK_REQUIRE(locate->viewConfigurationType == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO,
               XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED, "stereo only");
  for (std::uint32_t i = 0; i < capacity; ++i) MOCK_STRUCT(&views[i], XR_TYPE_VIEW);
  runtime().report.views_at = locate->displayTime;
  const Script& script = runtime().script;
  std::vector<XrView> both(2, {XR_TYPE_VIEW});
  for (std::size_t i = 0; i < 2; ++i) {
    const float side = i == 0 ? -0.5F : 0.5F;
    const XrPosef eye{{0, 0, 0, 1}, {side * script.eye_separation, 0, 0}};
    both[i].pose = inverse(base->offset) * (script.head(locate->displayTime) * eye);
    both[i].fov = script.fov;
    if (i == 1) {
      both[i].fov.angleLeft = -script.fov.angleRight;
      both[i].fov.angleRight = -script.fov.angleLeft;
    }
  }
  state->viewStateFlags =
      script.head_tracked ? XR_VIEW_STATE_ORIENTATION_VALID_BIT | XR_VIEW_STATE_POSITION_VALID_BIT : 0;
  return give(__func__, both, capacity, count, views);
}

XrResult xrWaitFrame(XrSession session, const XrFrameWaitInfo* wait, XrFrameState* state) {
  MOCK_SESSION(found, session);
  MOCK_REQUIRE(wait == nullptr || wait->type == XR_TYPE_FRAME_WAIT_INFO, XR_ERROR_VALIDATION_FAILURE, "wait");
  MOCK_STRUCT(state, XR_TYPE_FRAME_STATE);
  MOCK_REQUIRE(found->running, XR_ERROR_SESSION_NOT_RUNNING, "not running");
  // A real one would block here until another thread begins the frame: for ever.
  MOCK_REQUIRE(!found->waited, XR_ERROR_CALL_ORDER_INVALID, "the last frame waited for was not begun");
  const Script& script = runtime().script;
  if (script.in_real_time) {
    found->next_time = std::max(found->next_time, now());
    sleep_until(found->next_time);
  }
  found->next_time += script.period;
  found->predicted = found->next_time;
  found->waited = true;
  state->predictedDisplayTime = found->predicted;
  state->predictedDisplayPeriod = script.period;
  state->shouldRender =
      found->state == XR_SESSION_STATE_VISIBLE || found->state == XR_SESSION_STATE_FOCUSED ? XR_TRUE : XR_FALSE;
  return XR_SUCCESS;
}

XrResult xrBeginFrame(XrSession session, const XrFrameBeginInfo* begin) {
  MOCK_SESSION(found, session);
  MOCK_REQUIRE(begin == nullptr || begin->type == XR_TYPE_FRAME_BEGIN_INFO, XR_ERROR_VALIDATION_FAILURE, "begin");
  MOCK_REQUIRE(found->running, XR_ERROR_SESSION_NOT_RUNNING, "not running");
  MOCK_REQUIRE(found->waited, XR_ERROR_CALL_ORDER_INVALID, "without xrWaitFrame");
  found->waited = false;
  if (found->begun) return refuse(XR_FRAME_DISCARDED, __func__, "the last frame was not ended");
  found->begun = true;
  return XR_SUCCESS;
}

/// Checks a projection layer and takes it in.
XrResult take_layer(Session& session, const XrCompositionLayerBaseHeader* header, Submitted& out) {
  MOCK_REQUIRE(header != nullptr && header->type == XR_TYPE_COMPOSITION_LAYER_PROJECTION, XR_ERROR_LAYER_INVALID,
               "no projection layer");
  const auto& layer = *reinterpret_cast<const XrCompositionLayerProjection*>(header);
  MOCK_REQUIRE(runtime().find<Space>(layer.space) != nullptr, XR_ERROR_HANDLE_INVALID, "space of the layer");
  MOCK_REQUIRE(layer.viewCount == 2, XR_ERROR_VALIDATION_FAILURE, "two views");
  const Swapchain* swapchain = nullptr;
  for (std::uint32_t i = 0; i < 2; ++i) {
    const XrCompositionLayerProjectionView& view = layer.views[i];
    MOCK_STRUCT(&view, XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW);
    swapchain = runtime().find<Swapchain>(view.subImage.swapchain);
    MOCK_REQUIRE(swapchain != nullptr, XR_ERROR_HANDLE_INVALID, "swapchain of the layer");
    MOCK_REQUIRE(swapchain->released.has_value(), XR_ERROR_LAYER_INVALID, "no image of it was ever released");
    const XrRect2Di& rect = view.subImage.imageRect;
    MOCK_REQUIRE(rect.offset.x >= 0 && rect.offset.y >= 0 && rect.extent.width > 0 && rect.extent.height > 0 &&
                     rect.offset.x + rect.extent.width <= static_cast<int>(swapchain->create.width) &&
                     rect.offset.y + rect.extent.height <= static_cast<int>(swapchain->create.height),
                 XR_ERROR_SWAPCHAIN_RECT_INVALID, "beyond the image");
    MOCK_REQUIRE(view.subImage.imageArrayIndex < swapchain->create.arraySize, XR_ERROR_VALIDATION_FAILURE,
                 "no such layer of the image");
    MOCK_REQUIRE(is_unit(view.pose.orientation), XR_ERROR_POSE_INVALID, "no unit quaternion");
    out.poses[i] = view.pose;
    out.fovs[i] = view.fov;
    out.width = static_cast<std::uint32_t>(rect.extent.width);
    out.height = static_cast<std::uint32_t>(rect.extent.height);
  }
  out.layer = true;
  read_back(session, *swapchain, out);
  return XR_SUCCESS;
}

XrResult xrEndFrame(XrSession session, const XrFrameEndInfo* end) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(end, XR_TYPE_FRAME_END_INFO);
  MOCK_REQUIRE(found->running, XR_ERROR_SESSION_NOT_RUNNING, "not running");
  MOCK_REQUIRE(found->begun, XR_ERROR_CALL_ORDER_INVALID, "without xrBeginFrame");
  MOCK_REQUIRE(end->displayTime > 0, XR_ERROR_TIME_INVALID, "no time");
  MOCK_REQUIRE(end->environmentBlendMode == XR_ENVIRONMENT_BLEND_MODE_OPAQUE,
               XR_ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED, "opaque only");
  MOCK_REQUIRE(end->layerCount <= 1, XR_ERROR_LAYER_LIMIT_EXCEEDED, "one layer at most");
  Submitted frame{.display_time = end->displayTime, .predicted_time = found->predicted};
  if (end->layerCount == 1) {
    const XrResult taken = take_layer(*found, end->layers[0], frame);
    if (taken != XR_SUCCESS) return taken;
    runtime().report.last = std::move(frame);
  }
  found->begun = false;
  ++runtime().report.frames;
  advance(*found);
  follow_environment();
  return XR_SUCCESS;
}

}  // namespace

Session::~Session() {
  if (pool != VK_NULL_HANDLE) vkDestroyCommandPool(graphics.device, pool, nullptr);
}

void take_off() {
  if (auto* session = runtime().only<Session>()) session->worn = false;
}

void put_on() {
  auto* session = runtime().only<Session>();
  if (session == nullptr) return;
  session->worn = true;
  if (session->state == XR_SESSION_STATE_IDLE) change_state(*session, XR_SESSION_STATE_READY);
}

void stop(bool for_good) {
  auto* session = runtime().only<Session>();
  if (session == nullptr) return;
  session->exit_requested = true;
  session->worn = for_good;
}

void lose_session(bool announced) {
  auto* session = runtime().only<Session>();
  if (session == nullptr) return;
  if (announced)
    change_state(*session, XR_SESSION_STATE_LOSS_PENDING);
  else
    session->lost = true;
}

void lose_instance(bool announced) {
  auto* instance = runtime().only<Instance>();
  if (instance == nullptr) return;
  if (announced) {
    XrEventDataInstanceLossPending event{XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING};
    event.lossTime = 1;
    runtime().queue(event);
  } else {
    instance->lost = true;
  }
}

void resize(std::uint32_t width, std::uint32_t height, bool announced) {
  runtime().script.width = width;
  runtime().script.height = height;
  auto* session = runtime().only<Session>();
  if (session == nullptr || !announced) return;
  XrEventDataReferenceSpaceChangePending event{XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING};
  event.session = handle_of<XrSession>(session);
  event.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_LOCAL;
  event.changeTime = session->next_time;
  runtime().queue(event);
}

PFN_xrVoidFunction session_function(const char* name) {
  MOCK_ENTRY(xrCreateSession);
  MOCK_ENTRY(xrDestroySession);
  MOCK_ENTRY(xrBeginSession);
  MOCK_ENTRY(xrEndSession);
  MOCK_ENTRY(xrRequestExitSession);
  MOCK_ENTRY(xrEnumerateReferenceSpaces);
  MOCK_ENTRY(xrCreateReferenceSpace);
  MOCK_ENTRY(xrCreateActionSpace);
  MOCK_ENTRY(xrDestroySpace);
  MOCK_ENTRY(xrLocateSpace);
  MOCK_ENTRY(xrLocateViews);
  MOCK_ENTRY(xrWaitFrame);
  MOCK_ENTRY(xrBeginFrame);
  MOCK_ENTRY(xrEndFrame);
  return nullptr;
}

}  // namespace stylet::mock_xr

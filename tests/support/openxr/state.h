// What the runtime knows: objects behind handles, and the one application.
#pragma once

#define XR_USE_GRAPHICS_API_VULKAN
#include "tests/support/openxr/mock_runtime.h"

#include <vulkan/vulkan.h>

#include <openxr/openxr_platform.h>

#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>

namespace stylet::mock_xr {

/// Anything with a handle. Destroying one destroys what was made from it.
struct Object {
  virtual ~Object() = default;
  virtual const char* kind() const = 0;
  std::uint64_t id = 0;
  Object* parent = nullptr;
};

struct Instance final : Object {
  const char* kind() const override { return "XrInstance"; }
  bool vulkan = false;  ///< extension enabled
  bool requirements_asked = false;
  VkInstance vk_instance = VK_NULL_HANDLE;
  VkPhysicalDevice vk_physical = VK_NULL_HANDLE;
  VkDevice vk_device = VK_NULL_HANDLE;
  std::vector<std::string> paths;                                         ///< XrPath is the index + 1
  std::map<XrPath, std::map<std::uint64_t, std::set<XrPath>>> suggested;  ///< profile -> action -> inputs
  bool lost = false;
};

struct Session final : Object {
  const char* kind() const override { return "XrSession"; }
  XrGraphicsBindingVulkanKHR graphics{};
  VkQueue queue = VK_NULL_HANDLE;
  VkCommandPool pool = VK_NULL_HANDLE;
  XrSessionState state = XR_SESSION_STATE_UNKNOWN;
  bool running = false;
  bool waited = false;  ///< xrWaitFrame without its xrBeginFrame yet
  bool begun = false;   ///< xrBeginFrame without its xrEndFrame yet
  bool exit_requested = false;
  bool lost = false;
  bool worn = true;
  XrTime next_time = 0;
  XrTime predicted = 0;
  std::set<std::uint64_t> attached;  ///< action sets
  bool attached_once = false;
  std::optional<XrTime> synced;
  ~Session() override;
};

struct Space final : Object {
  const char* kind() const override { return "XrSpace"; }
  bool is_hand = false;
  int hand = 0;
  XrReferenceSpaceType type = XR_REFERENCE_SPACE_TYPE_LOCAL;
  XrPosef offset{{0, 0, 0, 1}, {0, 0, 0}};
};

struct ActionSet final : Object {
  const char* kind() const override { return "XrActionSet"; }
  std::string name, title;
  bool attached = false;
};

struct Action final : Object {
  const char* kind() const override { return "XrAction"; }
  std::string name, title;
  XrActionType type{};
  std::vector<XrPath> subactions;
  std::array<bool, 2> now{}, before{};  ///< value at the last two syncs, a hand each
  std::array<XrVector2f, 2> stick{};
};

struct Swapchain final : Object {
  const char* kind() const override { return "XrSwapchain"; }
  XrSwapchainCreateInfo create{};
  VkDevice device = VK_NULL_HANDLE;
  std::vector<VkImage> images;
  std::vector<VkDeviceMemory> memory;
  std::deque<std::uint32_t> acquired;  ///< oldest first
  bool front_waited = false;           ///< the oldest was waited for
  std::uint32_t next = 0;
  std::optional<std::uint32_t> released;  ///< the last one given back
  ~Swapchain() override;
};

struct Runtime {
  Script script;
  Report report;
  std::map<std::uint64_t, std::unique_ptr<Object>> objects;
  std::uint64_t next_id = 1;
  std::deque<XrEventDataBuffer> events;

  template <typename T>
  T* add(std::unique_ptr<T> object, Object* parent) {
    object->id = next_id++;
    object->parent = parent;
    T* out = object.get();
    objects[out->id] = std::move(object);
    return out;
  }
  /// Null: no such handle, or one of another kind.
  template <typename T, typename H>
  T* find(H handle) {
    const auto found = objects.find(reinterpret_cast<std::uint64_t>(handle));
    return found == objects.end() ? nullptr : dynamic_cast<T*>(found->second.get());
  }
  template <typename T>
  T* only() {
    for (auto& [id, object] : objects)
      if (auto* typed = dynamic_cast<T*>(object.get())) return typed;
    return nullptr;
  }
  void destroy(Object* object);
  template <typename Event>
  void queue(const Event& event) {
    XrEventDataBuffer buffer{XR_TYPE_EVENT_DATA_BUFFER};
    std::memcpy(&buffer, &event, sizeof(event));
    events.push_back(buffer);
  }
};

Runtime& runtime();
/// Script and end of a program that knows nothing of this one, from STYLET_MOCK_OPENXR; called once a frame.
void follow_environment();

template <typename H>
H handle_of(const Object* object) {
  return reinterpret_cast<H>(object->id);
}

/// Notes a failed call. @return the code
XrResult refuse(XrResult code, const char* call, const std::string& why);

Instance& instance_of(Object* object);
void change_state(Session& session, XrSessionState state);
XrPosef operator*(const XrPosef& a, const XrPosef& b);
bool is_unit(const XrQuaternionf& q);
const std::string* path_text(const Instance& instance, XrPath path);
/// Copies both layers of a released image to host memory.
void read_back(Session& session, const Swapchain& swapchain, Submitted& out);
/// An entry point by name; null: unknown.
PFN_xrVoidFunction instance_function(const char* name);
PFN_xrVoidFunction session_function(const char* name);
PFN_xrVoidFunction swapchain_function(const char* name);
PFN_xrVoidFunction action_function(const char* name);
PFN_xrVoidFunction vulkan_function(const char* name);

}  // namespace stylet::mock_xr

// The first lines of an entry point: the handle is alive, nothing was lost. `__func__` is the entry point's name.
#define MOCK_REQUIRE(condition, code, why) \
  if (!(condition)) return refuse(code, __func__, why)
#define MOCK_STRUCT(pointer, wanted)                                                             \
  MOCK_REQUIRE((pointer) != nullptr && (pointer)->type == (wanted), XR_ERROR_VALIDATION_FAILURE, \
               #pointer " is no " #wanted)
#define MOCK_OBJECT(Type, name, handle)                                                              \
  Type* const name = runtime().find<Type>(handle);                                                   \
  MOCK_REQUIRE((name) != nullptr, XR_ERROR_HANDLE_INVALID, "no such " #Type " (destroyed before?)"); \
  MOCK_REQUIRE(!instance_of(name).lost, XR_ERROR_INSTANCE_LOST, "the instance is lost")
#define MOCK_SESSION(name, handle)    \
  MOCK_OBJECT(Session, name, handle); \
  MOCK_REQUIRE(!(name)->lost, XR_ERROR_SESSION_LOST, "the session is lost")
#define MOCK_ENTRY(function) \
  if (std::strcmp(name, #function) == 0) return reinterpret_cast<PFN_xrVoidFunction>(function)

namespace stylet::mock_xr {

/// The two-call idiom: how many there are, then all of them.
template <typename T>
XrResult give(const char* call, const std::vector<T>& from, std::uint32_t capacity, std::uint32_t* count, T* out) {
  if (count == nullptr) return refuse(XR_ERROR_VALIDATION_FAILURE, call, "null count");
  *count = static_cast<std::uint32_t>(from.size());
  if (capacity == 0) return XR_SUCCESS;
  if (capacity < from.size()) return refuse(XR_ERROR_SIZE_INSUFFICIENT, call, "array too small");
  for (std::size_t i = 0; i < from.size(); ++i) out[i] = from[i];
  return XR_SUCCESS;
}

}  // namespace stylet::mock_xr

// The entry point of the library, and the script's controls.
#include "tests/support/openxr/negotiation.h"

#include "tests/support/openxr/state.h"

#include <openxr/openxr_reflection.h>

#include <cmath>
#include <cstring>

namespace stylet::mock_xr {

Runtime& runtime() {
  static Runtime the_runtime;
  return the_runtime;
}

void Runtime::destroy(Object* object) {
  std::vector<Object*> children;
  for (auto& [id, other] : objects)
    if (other->parent == object) children.push_back(other.get());
  for (Object* child : children) destroy(child);
  objects.erase(object->id);
}

namespace {

const char* result_text(XrResult code) {
  switch (code) {
#define MOCK_NAME(name, value) \
  case name:                   \
    return #name;
    XR_LIST_ENUM_XrResult(MOCK_NAME)
#undef MOCK_NAME
        default : return "?";
  }
}

XrResult get_instance_function(XrInstance, const char* name, PFN_xrVoidFunction* function) {
  for (const auto find :
       {instance_function, session_function, swapchain_function, action_function, vulkan_function}) {
    *function = find(name);
    if (*function != nullptr) return XR_SUCCESS;
  }
  return XR_ERROR_FUNCTION_UNSUPPORTED;
}

}  // namespace

XrResult refuse(XrResult code, const char* call, const std::string& why) {
  runtime().report.errors.push_back(std::string(call) + ": " + why + " (" + result_text(code) + ")");
  return code;
}

Instance& instance_of(Object* object) {
  while (object->parent != nullptr) object = object->parent;
  return dynamic_cast<Instance&>(*object);
}

XrPosef operator*(const XrPosef& a, const XrPosef& b) {
  const XrQuaternionf &p = a.orientation, &q = b.orientation;
  XrPosef out;
  out.orientation = {p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y, p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
                     p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w, p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z};
  // v + 2 u x (u x v + w v), u the vector part of p.
  const XrVector3f& v = b.position;
  const XrVector3f t{p.y * v.z - p.z * v.y + p.w * v.x, p.z * v.x - p.x * v.z + p.w * v.y,
                     p.x * v.y - p.y * v.x + p.w * v.z};
  out.position = {a.position.x + v.x + 2 * (p.y * t.z - p.z * t.y), a.position.y + v.y + 2 * (p.z * t.x - p.x * t.z),
                  a.position.z + v.z + 2 * (p.x * t.y - p.y * t.x)};
  return out;
}

bool is_unit(const XrQuaternionf& q) {
  return std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) < 0.01F;
}

void play(const Script& script) {
  runtime().script = script;
  runtime().report = {};
  runtime().events.clear();
}

Script& script() {
  return runtime().script;
}

const Report& report() {
  return runtime().report;
}

XrPosef looking(float yaw, float pitch, XrVector3f from) {
  const XrPosef turn{{0, std::sin(yaw / 2), 0, std::cos(yaw / 2)}, from};
  const XrPosef nod{{std::sin(pitch / 2), 0, 0, std::cos(pitch / 2)}, {0, 0, 0}};
  return turn * nod;
}

}  // namespace stylet::mock_xr

extern "C" MOCK_XR_API XrResult xrNegotiateLoaderRuntimeInterface(const XrNegotiateLoaderInfo* loader,
                                                                  XrNegotiateRuntimeRequest* request) {
  using namespace stylet::mock_xr;
  if (loader == nullptr || request == nullptr || loader->structType != XR_LOADER_INTERFACE_STRUCT_LOADER_INFO ||
      loader->structVersion != kLoaderInfoStructVersion || loader->structSize != sizeof(XrNegotiateLoaderInfo) ||
      request->structType != XR_LOADER_INTERFACE_STRUCT_RUNTIME_REQUEST ||
      request->structVersion != kRuntimeRequestStructVersion ||
      request->structSize != sizeof(XrNegotiateRuntimeRequest) ||
      loader->minInterfaceVersion > kLoaderRuntimeVersion || loader->maxInterfaceVersion < kLoaderRuntimeVersion ||
      loader->minApiVersion > XR_CURRENT_API_VERSION || loader->maxApiVersion < XR_MAKE_VERSION(1, 0, 0)) {
    return XR_ERROR_INITIALIZATION_FAILED;
  }
  request->runtimeInterfaceVersion = kLoaderRuntimeVersion;
  request->runtimeApiVersion = XR_CURRENT_API_VERSION;
  request->getInstanceProcAddr = get_instance_function;
  return XR_SUCCESS;
}

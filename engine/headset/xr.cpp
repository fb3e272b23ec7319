#include "engine/headset/xr.h"

#include <openxr/openxr_reflection.h>

#include <string>

namespace stylet::headset::xr {

const char* result_name(XrResult result) {
  switch (result) {
#define STYLET_NAME(name, value) \
  case name:                     \
    return #name;
    XR_LIST_ENUM_XrResult(STYLET_NAME)
#undef STYLET_NAME
        default : return "unlisted XrResult";
  }
}

void check(XrResult result, const char* call) {
  if (XR_FAILED(result)) throw HeadsetError(std::string(call) + ": " + result_name(result), result);
}

}  // namespace stylet::headset::xr

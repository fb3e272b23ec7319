// Finding a runtime and its headset, and the mock's own strictness.
#include "tests/headset/rig.h"

namespace stylet::tests {
namespace {

using headset::HeadsetError;
using headset::HeadsetRuntime;

std::string why_not() {
  try {
    const HeadsetRuntime runtime;
  } catch (const HeadsetError& error) {
    return error.what();
  }
  return "";
}

TEST(HeadsetRuntime, WithoutOneSaysSoInOneLineAndTheLoaderIsSilent) {
  use_no_runtime();
  testing::internal::CaptureStderr();
  const std::string why = why_not();
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_NE(why.find("no OpenXR runtime answers"), std::string::npos) << why;
  EXPECT_EQ(why.find('\n'), std::string::npos) << why;
}

TEST(HeadsetRuntime, WithoutAHeadsetSaysSo) {
  use_mock_runtime();
  mock::play({.connected = false});
  const std::string why = why_not();
  EXPECT_NE(why.find("sees no headset"), std::string::npos) << why;
  EXPECT_EQ(why.find('\n'), std::string::npos) << why;
  EXPECT_TRUE(mock::report().leaks.empty());
}

TEST(HeadsetRuntime, NamesItselfAndTheSizeOfAnEye) {
  use_mock_runtime();
  mock::play({.width = 640, .height = 720});
  const HeadsetRuntime runtime;
  EXPECT_EQ(runtime.name(), "Stylet's mock runtime 0.1.0");
  EXPECT_EQ(runtime.headset_name(), "scripted headset");
  EXPECT_EQ(runtime.eye_size(), (headset::EyeSize{640, 720}));
}

TEST(HeadsetRuntime, ItsGpuIsTheOnlyOne) {
  use_mock_runtime();
  mock::play({});
  HeadsetRuntime runtime;
  try {
    const gpu::Device device({.gpu = "Voodoo 2", .maker = &runtime});
    FAIL() << "no such GPU, yet a device was made";
  } catch (const gpu::GpuError& error) {
    EXPECT_NE(std::string(error.what()).find("Voodoo 2"), std::string::npos) << error.what();
  }
  EXPECT_TRUE(gpu::Device({.gpu = "0", .maker = &runtime}).identity().name == gpu::device_names().front());
}

// What a mistake in the frame loop would look like: the mock refuses it as the specification says.
TEST(MockRuntime, RefusesCallsOutOfOrder) {
  Rig rig;
  const XrSession session = rig.headset().session();
  const XrFrameEndInfo end{XR_TYPE_FRAME_END_INFO, nullptr, 1, XR_ENVIRONMENT_BLEND_MODE_OPAQUE, 0, nullptr};
  XrFrameState state{XR_TYPE_FRAME_STATE};
  EXPECT_EQ(xrWaitFrame(session, nullptr, &state), XR_ERROR_SESSION_NOT_RUNNING);
  EXPECT_EQ(xrEndSession(session), XR_ERROR_SESSION_NOT_RUNNING);
  rig.turn_until_focused();
  EXPECT_EQ(xrBeginFrame(session, nullptr), XR_ERROR_CALL_ORDER_INVALID);
  EXPECT_EQ(xrEndFrame(session, &end), XR_ERROR_CALL_ORDER_INVALID);
  EXPECT_EQ(xrEndSession(session), XR_ERROR_SESSION_NOT_STOPPING);
  XrFrameState wrong{XR_TYPE_FRAME_WAIT_INFO};
  EXPECT_EQ(xrWaitFrame(session, nullptr, &wrong), XR_ERROR_VALIDATION_FAILURE);
  rig.expect_clean(6);
}

}  // namespace
}  // namespace stylet::tests

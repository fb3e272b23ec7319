#include "tools/stylet/version.h"

#include "engine/app/build_name.h"
#include "engine/gltf/draco_decoder.h"
#include "engine/view/window.h"
#include "physics/tissue/blas.h"

#include <OpenMesh/Core/System/config.h>
#include <cholmod.h>
#include <fmt/format.h>
#include <hidapi.h>
#include <imgui.h>
#include <metis.h>
#include <vulkan/vulkan.h>
#include <zlib.h>
#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace stylet::tools {

std::string version_text() {
  int cholmod[3];
  cholmod_version(cholmod);
  std::uint32_t vulkan = VK_API_VERSION_1_0;
  vkEnumerateInstanceVersion(&vulkan);
  std::string text = fmt::format("stylet {}\n", app::build_name());
  text += fmt::format("built     {} {}, g++ {}\n", STYLET_BUILD_TYPE, STYLET_ARCHITECTURE, __VERSION__);
  text += fmt::format("BLAS      {}\n", physics::single_threaded_blas().name);
  text += fmt::format(
      "libraries Eigen {}.{}.{}, CHOLMOD {}.{}.{}, METIS {}.{}.{}, Vulkan loader {}.{}.{}, GLFW {}, hidapi {}, "
      "tinygltf, "
      "stb, OpenMesh {}.{}, zlib {}, Dear ImGui {}, CLI11 {}, fmt {}, nlohmann-json {}.{}.{}\n",
      EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, cholmod[0], cholmod[1], cholmod[2],
      METIS_VER_MAJOR, METIS_VER_MINOR, METIS_VER_SUBMINOR, VK_API_VERSION_MAJOR(vulkan),
      VK_API_VERSION_MINOR(vulkan), VK_API_VERSION_PATCH(vulkan), view::Display::library_version(), hid_version_str(),
      (OM_VERSION & 0xF0000) >> 16, (OM_VERSION & 0x0FF00) >> 8, zlibVersion(), IMGUI_VERSION, CLI11_VERSION,
      FMT_VERSION, NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH);
  const auto draco = gltf::draco_decoder();
  if (!draco.empty()) text += fmt::format("options   Draco, by {}\n", draco.string());
  text +=
      "licence   sources Apache-2.0; this binary links CHOLMOD's supernodal module (GPL-2.0-or-later), so it may be\n"
      "          distributed under GPL-3. No warranty. Not a medical device.";
  return text;
}

}  // namespace stylet::tools

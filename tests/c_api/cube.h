// A cube and a needle in front of it, by the C API.
#pragma once

#include "physics/c_api/stylet_physics.h"
#include "physics/tissue/tet_mesh.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace stylet::c_api {

/// Edge 100 mm, the face z = 100 mm held; the needle's tip 2 mm before the middle of the face z = 0.
struct Cube {
  Cube();
  Cube(const Cube&) = delete;
  Cube& operator=(const Cube&) = delete;

  physics::TetMesh mesh;
  std::vector<double> nodes;
  std::vector<std::int32_t> tets;
  std::vector<std::int32_t> fixed_nodes;
  std::vector<stylet_material> materials{{10e3, 0.45}};
  // As stylet_physics_create() takes them; they refer to the arrays above.
  stylet_body body;
  stylet_needle needle;
  stylet_settings settings;
  stylet_pose hub{{0.047, 0.053, -0.152}, {0, 0, 0, 1}};
};

/// A state to be filled.
template <typename State>
State sized() {
  State state{};
  state.struct_size = sizeof state;
  return state;
}

struct Destroy {
  void operator()(stylet_physics* physics) const { stylet_physics_destroy(physics); }
};
using Handle = std::unique_ptr<stylet_physics, Destroy>;

/// Null where it fails.
Handle create(const Cube& cube);

}  // namespace stylet::c_api

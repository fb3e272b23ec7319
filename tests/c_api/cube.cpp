#include "tests/c_api/cube.h"

#include "tools/reference/kuhn_box.h"

#include <Eigen/Core>

namespace stylet::c_api {

Cube::Cube()
    : mesh(reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {4, 4, 4})),
      fixed_nodes(reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() > 0.0999; })) {
  for (const Eigen::Vector3d& x : mesh.nodes) nodes.insert(nodes.end(), {x.x(), x.y(), x.z()});
  for (const auto& tet : mesh.tets) tets.insert(tets.end(), tet.begin(), tet.end());
  stylet_body_init(&body, sizeof body);
  stylet_needle_init(&needle, sizeof needle);
  stylet_settings_init(&settings, sizeof settings);
  body.nodes = nodes.data();
  body.node_count = static_cast<std::int32_t>(mesh.nodes.size());
  body.tets = tets.data();
  body.tet_count = static_cast<std::int32_t>(mesh.tets.size());
  body.materials = materials.data();
  body.material_count = static_cast<std::int32_t>(materials.size());
  body.fixed_nodes = fixed_nodes.data();
  body.fixed_count = static_cast<std::int32_t>(fixed_nodes.size());
  body.puncture_force = 0.5;
  body.cutting_force = 0.3;
  body.friction_per_length = 10;
}

Handle create(const Cube& cube) {
  stylet_physics* physics = nullptr;
  stylet_physics_create(&cube.body, &cube.needle, &cube.settings, &cube.hub, &physics);
  return Handle(physics);
}

}  // namespace stylet::c_api

/* A needle goes into a cube of soft tissue and comes half out again: prints depth and force at every haptic step, as
 * CSV. */
#include "physics/c_api/stylet_physics.h"

#include <stdio.h>

#define CELLS 5           /* along an edge */
#define EDGE 0.1          /* m */
#define FREE_TRAVEL 0.002 /* from the tip to the cube, m */
#define STEP 4e-5         /* of the hub in a haptic step, m: 40 mm/s */
#define IN 800            /* haptic steps */
#define OUT 400
#define HAPTIC_STEPS 20 /* to a simulation step */
#define NODES ((CELLS + 1) * (CELLS + 1) * (CELLS + 1))
#define TETS (6 * CELLS * CELLS * CELLS)

static double nodes[3 * NODES];
static int32_t tets[4 * TETS];
static int32_t fixed_nodes[(CELLS + 1) * (CELLS + 1)];

/* Six tetrahedra a cell, along the ways from its low corner to its high one. The face z = EDGE is held. */
static void make_cube(stylet_body* body) {
  const int32_t stride[3] = {1, CELLS + 1, (CELLS + 1) * (CELLS + 1)};
  const int ways[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  static const stylet_material material = {10e3, 0.45};
  for (int32_t node = 0; node < NODES; ++node) {
    const int32_t cell[3] = {node % stride[1], node / stride[1] % stride[1], node / stride[2]};
    for (int axis = 0; axis < 3; ++axis) nodes[3 * node + axis] = (double)cell[axis] / CELLS * EDGE;
    if (cell[2] == CELLS) fixed_nodes[body->fixed_count++] = node;
    if (cell[0] == CELLS || cell[1] == CELLS || cell[2] == CELLS) continue;
    for (int way = 0; way < 6; ++way) {
      int32_t* tet = tets + 4 * body->tet_count++;
      const int even = ways[way][1] == (ways[way][0] + 1) % 3;
      const int32_t second = node + stride[ways[way][0]], third = second + stride[ways[way][1]];
      const int32_t last = third + stride[ways[way][2]];
      tet[0] = node;
      tet[1] = second;
      tet[2] = even ? third : last;
      tet[3] = even ? last : third;
    }
  }
  body->nodes = nodes;
  body->node_count = NODES;
  body->tets = tets;
  body->fixed_nodes = fixed_nodes;
  body->materials = &material;
  body->material_count = 1;
}

int main(void) {
  stylet_body body;
  stylet_needle needle;
  stylet_settings settings;
  stylet_body_init(&body, sizeof body);
  stylet_needle_init(&needle, sizeof needle);
  stylet_settings_init(&settings, sizeof settings);
  make_cube(&body);
  body.puncture_force = 0.5;
  body.cutting_force = 0.3;
  body.friction_per_length = 10;

  /* The needle's +Z, from hub to tip, is that of the cube. */
  const double start = -FREE_TRAVEL - needle.length;
  stylet_pose hub = {{0.047, 0.053, start}, {0, 0, 0, 1}};
  stylet_physics* physics;
  if (stylet_physics_create(&body, &needle, &settings, &hub, &physics) != STYLET_OK) {
    fprintf(stderr, "%s\n", stylet_last_error());
    return 1;
  }

  printf("depth_m,force_n\n");
  for (int step = 0; step < IN + OUT; ++step) {
    if (step % HAPTIC_STEPS == 0) {
      stylet_physics_simulation_step(physics);
      stylet_physics_factorise(physics, NULL);
    }
    hub.position[2] = start + STEP * (step < IN ? step : 2 * IN - step);
    stylet_wrench hand;
    stylet_physics_haptic_step(physics, &hub, &hand);
    stylet_needle_state state = {.struct_size = sizeof state};
    stylet_physics_needle_state(physics, &state);
    printf("%.17g,%.17g\n", state.tip_depth, -hand.force[2]);
  }
  stylet_physics_destroy(physics);
  return 0;
}

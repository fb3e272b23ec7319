/* The two loops for programs in C and in what can call C: one deformable body, one needle, a force for the hand.
 *
 *   stylet_physics_create(&body, &needle, &settings, &hub, &physics);
 *   for each simulation step, 1 / simulation_hz apart {
 *     stylet_physics_simulation_step(physics);
 *     stylet_physics_factorise(physics, NULL);
 *     for each of its haptic steps, 1 / haptic_hz apart
 *       stylet_physics_haptic_step(physics, &hub, &wrench);
 *   }
 *   stylet_physics_destroy(physics);
 *
 * Units and frames. SI: m, N, s, Pa, rad. Everything is in one right-handed frame, the patient's. The needle's frame:
 * origin at the hub, +Z from hub to tip, +X the bevel's normal. Orientations are unit quaternions x y z w that turn
 * the needle's or a node's frame into the patient's.
 *
 * Threads. The three kinds of step may run in one thread, as above: then the same calls give the same bits. Or each
 * in a thread of its own: haptic steps in one, simulation steps in another, stylet_physics_factorise in a third or
 * after the simulation's. Each hands the other its latest value without a lock, and none waits. No two calls of one
 * group may run at once: haptic      stylet_physics_haptic_step, _needle_state, _needle_nodes, _contacts simulation
 * stylet_physics_simulation_step, _tissue_state, _tissue_nodes factorise   stylet_physics_factorise Create before the
 * threads start, destroy after they have ended. A coupling has one more thread, which sleeps between simulation steps
 * and shares those of large bodies: the bits do not depend on it. Handles know nothing of each other.
 *
 * Real time. The calls of the haptic group neither allocate, lock nor wait; a haptic step takes tens of microseconds.
 * The others may allocate. Flush denormals in the threads that step: they make a step many times longer.
 *
 * Ownership. Whatever a call is given is copied before it returns. The first create sets the BLAS of the process to
 * one thread.
 *
 * Errors. Every call that can fail returns a stylet_status, with one line of text in stylet_last_error(). No
 * exception leaves. What the loops refuse or limit while they run is no error: it is in the flags of the states.
 *
 * Versions. Every struct with a struct_size begins with it; set it to sizeof the struct, which the _init functions
 * do. Fields are only added, at the end, so a program runs with a newer library of the same STYLET_PHYSICS_VERSION as
 * it is. With an older one, which does not know the fields, it gets STYLET_ERROR_VERSION. */
#ifndef STYLET_PHYSICS_H
#define STYLET_PHYSICS_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define STYLET_PHYSICS_VERSION 1
/* STYLET_PHYSICS_VERSION of the library. Another one than yours is another interface. */
int32_t stylet_physics_version(void);

typedef enum stylet_status {
  STYLET_OK = 0,
  STYLET_ERROR_ARGUMENT = 1, /* a null pointer, an array too small, a value out of its range */
  STYLET_ERROR_VERSION = 2,  /* a struct_size that this library does not know */
  STYLET_ERROR_MODEL = 3,    /* body or needle cannot be simulated: bad index, inverted tetrahedron, not held, ... */
  STYLET_ERROR_MEMORY = 4,
  STYLET_ERROR_INTERNAL = 5 /* a bug */
} stylet_status;

/* What went wrong in the last call of this thread that failed: one line, until the next. Never null. */
const char* stylet_last_error(void);

typedef struct stylet_material {
  double young_modulus; /* Pa, > 0 */
  double poisson_ratio; /* > -1 and < 0.5 */
} stylet_material;

/* A body of tetrahedra, and how it resists the needle. */
typedef struct stylet_body {
  size_t struct_size;
  const double* nodes;              /* [3 * node_count] x y z of each at rest, m */
  const int32_t* tets;              /* [4 * tet_count] nodes of each: det[x1 - x0, x2 - x0, x3 - x0] > 0 */
  const stylet_material* materials; /* [material_count] one a region */
  const int32_t* tet_materials;     /* [tet_count] index into materials; null: all are of materials[0] */
  const int32_t* fixed_nodes;       /* [fixed_count] ascending, at least three, not on one line */
  int32_t node_count;
  int32_t tet_count;
  int32_t material_count;
  int32_t fixed_count;
  double damping_time; /* Kelvin-Voigt, s; 0: quasi-static */
  /* With STYLET_COUPLING_STYLET only; all 0: nothing resists but the shape of the body. */
  double puncture_force;       /* on the tip, that breaks through the surface, N */
  double cutting_force;        /* on the tip in the body, N */
  double cutting_viscosity;    /* what cutting takes more per speed, N s/m */
  double friction_per_length;  /* Coulomb, on the shaft, N/m */
  double friction_coefficient; /* Coulomb, of the lateral force between shaft and body */
  double viscous_friction;     /* per length of shaft and speed, N s/m^2 */
} stylet_body;

typedef struct stylet_needle {
  size_t struct_size;
  double length;         /* hub to tip, m; 0.150 */
  double outer_diameter; /* m; 1.27e-3, 18G */
  double inner_diameter; /* m; 0.838e-3; 0: solid */
  double young_modulus;  /* Pa; 200e9 */
  double poisson_ratio;  /* 0.3 */
  double bevel_ratio;    /* lateral over axial force on a tip that cuts; 0 */
  double tip_radius;     /* of the area that the tip presses on in tissue that does not stiffen, m; 5e-3 */
  double base_stiffness; /* of a spring between hub and needle, N/m; 0, as it is: the hub holds it rigidly */
  double base_rotational_stiffness; /* N m/rad; with base_stiffness only, then > 0 */
  int32_t beams;                    /* 1 to 64; 8 */
  int32_t reserved;                 /* 0 */
} stylet_needle;

typedef enum stylet_coupling {
  STYLET_COUPLING_STYLET = 0,        /* smooth shaft; puncture, cutting, friction */
  STYLET_COUPLING_PAPER_UPDATED = 1, /* Martin, Zeng and Courtecuisse 2023; directions normal to the needle's edges */
  STYLET_COUPLING_PAPER_FROZEN = 2,  /* Peterlik et al. 2011 */
  STYLET_COUPLING_PAPER_TRAJECTORY = 3 /* as 1; directions normal to the line of the contact points (III-C) */
} stylet_coupling;

typedef struct stylet_settings {
  size_t struct_size;
  double haptic_hz;       /* 1000 */
  double simulation_hz;   /* 50 */
  double contact_spacing; /* between contact points along the shaft, m; 0.010 */
  int32_t coupling;       /* a stylet_coupling; STYLET_COUPLING_STYLET */
  int32_t reserved;       /* 0 */
} stylet_settings;

/* Set a struct to its defaults, those above; of a body everything is null or 0.
 * struct_size: sizeof the struct as your program knows it. */
stylet_status stylet_body_init(stylet_body* body, size_t struct_size);
stylet_status stylet_needle_init(stylet_needle* needle, size_t struct_size);
stylet_status stylet_settings_init(stylet_settings* settings, size_t struct_size);

typedef struct stylet_pose {
  double position[3];    /* of the hub, m */
  double orientation[4]; /* x y z w; normalised by who reads it */
} stylet_pose;

/* What the hand feels, about the hub. */
typedef struct stylet_wrench {
  double force[3];  /* N */
  double moment[3]; /* N m */
} stylet_wrench;

typedef struct stylet_physics stylet_physics;

/* Builds both loops: the needle straight and free of stress at `hub`, the body at rest and factorised, so it takes a
 * moment.
 * physics: the handle, null where it fails; the caller's to destroy. */
stylet_status stylet_physics_create(const stylet_body* body, const stylet_needle* needle,
                                    const stylet_settings* settings, const stylet_pose* hub,
                                    stylet_physics** physics);
/* Null is allowed. */
void stylet_physics_destroy(stylet_physics* physics);

/* One step of 1 / haptic_hz: needle and tissue around it, in equilibrium. A pose that is not finite holds the needle
 * where it was (STYLET_NEEDLE_NON_FINITE); the hub follows by at most 1 mm and 20 mrad a step.
 * hub:  where the hand wants the hub to be
 * hand: what the hand feels; may be null
 * Haptic thread, real-time. */
stylet_status stylet_physics_haptic_step(stylet_physics* physics, const stylet_pose* hub, stylet_wrench* hand);

/* One step of 1 / simulation_hz: the body under the needle's forces. Before the first there is no tissue.
 * Simulation thread. */
stylet_status stylet_physics_simulation_step(stylet_physics* physics);

/* Factorises the body's stiffness anew if the simulation has asked for it, else returns at once. Call it after every
 * simulation step, or in a thread of its own again and again, with a sleep of about a simulation step between.
 * Without it the results are those of a body that is deformed little. done: 1 if there was something to do, else 0;
 * may be null */
stylet_status stylet_physics_factorise(stylet_physics* physics, int32_t* done);

typedef enum stylet_tip { STYLET_TIP_OUTSIDE = 0, STYLET_TIP_INDENTING = 1, STYLET_TIP_INSIDE = 2 } stylet_tip;

/* Bits of stylet_needle_state.flags. */
#define STYLET_NEEDLE_BASE_LIMITED 0x001u   /* the hub moved further than a step allows: the rest follows */
#define STYLET_NEEDLE_ROW_OVERFLOW 0x002u   /* too many contacts: the shallowest were left out */
#define STYLET_NEEDLE_SOLVE_FAILED 0x004u   /* the previous forces were kept */
#define STYLET_NEEDLE_NON_FINITE 0x008u     /* input was refused, the previous state kept */
#define STYLET_NEEDLE_STEP_SHORTENED 0x010u /* the needle turned too far for one step: the next ones go on */
#define STYLET_NEEDLE_ROWS_DEPENDENT 0x020u /* contacts too dense for mesh or beams: softened */
#define STYLET_NEEDLE_PATCH_LEFT 0x040u     /* the tip is ahead of the tissue that the simulation has sent */
#define STYLET_NEEDLE_SOLVE_INEXACT 0x080u  /* the bounded solve used its fall-back */
#define STYLET_NEEDLE_BOUNDS_LAGGED 0x100u  /* friction of the step before */

/* After the last haptic step. */
typedef struct stylet_needle_state {
  size_t struct_size;
  uint64_t step;           /* haptic step, from 1; 0: none yet */
  uint64_t tissue_step;    /* simulation step whose tissue it used; 0: none */
  stylet_wrench wrench;    /* as the step gave it */
  double tip_depth;        /* arc length of needle in the body, m */
  double hand_work;        /* of the hand on the needle since the start, J */
  int32_t tip;             /* a stylet_tip */
  int32_t node_count;      /* of the needle: beams + 1 */
  int32_t contact_count;   /* in touch */
  uint32_t puncture_count; /* surfaces broken through since the start */
  uint32_t flags;          /* STYLET_NEEDLE_* */
  uint32_t reserved;
} stylet_needle_state;

/* Fills as much as state->struct_size, which must be set, says. Haptic thread, real-time. */
stylet_status stylet_physics_needle_state(const stylet_physics* physics, stylet_needle_state* state);

/* Node poses of the needle, hub first, tip last. Either array may be null.
 * positions:    [3 * capacity] m
 * orientations: [4 * capacity] x y z w
 * capacity:     nodes that fit; at least node_count
 * Haptic thread, real-time. */
stylet_status stylet_physics_needle_nodes(const stylet_physics* physics, double* positions, double* orientations,
                                          size_t capacity);

typedef struct stylet_contact {
  double position[3]; /* of the point of the tissue, m */
  double force[3];    /* of the needle on the tissue, N */
} stylet_contact;

/* Contacts after the last haptic step, hub to tip.
 * contacts: [capacity]; at least contact_count, 96 are always enough
 * count:    how many there are
 * Haptic thread, real-time. */
stylet_status stylet_physics_contacts(const stylet_physics* physics, stylet_contact* contacts, size_t capacity,
                                      size_t* count);

/* Bits of stylet_tissue_state.flags. */
#define STYLET_TISSUE_INVERTED 0x1u             /* tetrahedra are inverted; their forces push back */
#define STYLET_TISSUE_STEP_LIMITED 0x2u         /* the motion of a step was shortened */
#define STYLET_TISSUE_NON_FINITE 0x4u           /* input or state was refused, the previous one kept */
#define STYLET_TISSUE_FACTORISATION_FAILED 0x8u /* the previous one was kept */

/* After the last simulation step. */
typedef struct stylet_tissue_state {
  size_t struct_size;
  uint64_t step;        /* simulation step, from 1; 0: none yet */
  uint64_t needle_step; /* haptic step whose forces it used */
  double residual;      /* |internal - external force| over the free nodes: how far from equilibrium, N */
  double needle_force;  /* |force of the needle| on the nodes, N */
  uint32_t flags;       /* STYLET_TISSUE_* */
  int32_t node_count;
} stylet_tissue_state;

/* Fills as much as state->struct_size, which must be set, says. Simulation thread. */
stylet_status stylet_physics_tissue_state(const stylet_physics* physics, stylet_tissue_state* state);

/* Where the body's nodes are.
 * positions: [3 * capacity] m
 * capacity:  nodes that fit; at least node_count
 * Simulation thread. */
stylet_status stylet_physics_tissue_nodes(const stylet_physics* physics, double* positions, size_t capacity);

#ifdef __cplusplus
}
#endif

#endif

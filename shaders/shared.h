// What the 3-D view's passes and the C++ side share: the layout of what crosses over. Included by GLSL and by C++.
// Lengths are metres in the patient frame; colours are linear RGB.
#ifdef __cplusplus
#pragma once
#include <array>
#include <cstdint>
namespace stylet::render {
using uint = std::uint32_t;
using vec4 = std::array<float, 4>;
using uvec4 = std::array<std::uint32_t, 4>;
using mat4 = std::array<float, 16>;  // columns
#define STYLET_SHARED constexpr
#else
#define STYLET_SHARED const
#endif

// First node of a vertex that no tetrahedron carries: it stays in the patient, goes with the breath, or rides on the
// probe.
STYLET_SHARED uint kFixedToPatient = 0xffffffffu;
STYLET_SHARED uint kFixedToProbe = 0xfffffffeu;
STYLET_SHARED uint kFixedToBreath = 0xfffffffdu;

// What SurfaceStyle::kind says; surface.frag is made once for each.
STYLET_SHARED uint kSolid = 0u;   // opaque organ
STYLET_SHARED uint kGlass = 1u;   // translucent organ: clear where seen face on, dense at its silhouette
STYLET_SHARED uint kCover = 2u;   // skin, fat, muscle: closed, with a window cut round the focus, or glass
STYLET_SHARED uint kSteel = 3u;   // needle shaft: metal with a mark every centimetre
STYLET_SHARED uint kMatte = 4u;   // plastic, paint, metal: probe, hub, furniture
STYLET_SHARED uint kCloth = 5u;   // drape: open where the field is; seen from both sides
STYLET_SHARED uint kScreen = 6u;  // shows a picture
STYLET_SHARED uint kGlow = 7u;    // the lamp's face
STYLET_SHARED uint kCavity = 8u;  // inside of the trunk
STYLET_SHARED uint kKinds = 9u;

// A screen's picture.
STYLET_SHARED uint kNoPicture = 0u;
STYLET_SHARED uint kPicture = 1u;         // sampling it gives linear colours
STYLET_SHARED uint kEncodedPicture = 2u;  // sampling it gives sRGB

// How far one sees into the patient.
STYLET_SHARED uint kSeeClosed = 0u;
STYLET_SHARED uint kSeeWindow = 1u;
STYLET_SHARED uint kSeeGlass = 2u;

STYLET_SHARED float kDepthUnit = 1e-4f;  // m a unit of the depth map
STYLET_SHARED int kFanRays = 64;         // of the imaging plane, at equal steps from side to side, one more than these ...
STYLET_SHARED int kFanReaches = 17;      // ... in so many fours

/// Rest state of a vertex. For a carried vertex, nodes and weights place it; otherwise weights.xyz is its position.
struct RestVertex {
  uvec4 nodes;   // indices into all bodies' nodes, one after the other
  vec4 weights;  // barycentric
  vec4 normal;   // xyz unit, outward
  vec4 at;       // xy: coordinates on the surface, handed on
};

/// A vertex as drawn, in the patient frame.
struct DrawnVertex {
  vec4 position;  // w: first coordinate on the surface: m along the needle; m from the middle of the drape's field, round
                  // the trunk; u of the screen
  vec4 normal;    // w: second coordinate: m from the middle of the field, along the table; v of the screen
};

/// Everything that is one for a frame. std140: only vec4 and mat4.
struct FrameUniforms {
  mat4 clip_from_patient[2];  // left (or only) eye, right eye
  mat4 patient_from_clip[2];
  vec4 eye[2];  // xyz
  mat4 patient_from_probe;
  mat4 probe_from_patient;
  mat4 table_from_patient;
  mat4 light_clip_from_patient;
  vec4 breath;      // xyz: motion of what goes with the breath
  vec4 up;          // unit, of the room
  vec4 along;       // unit, along the table
  vec4 lamp;        // xyz; w: intensity at the distance below, over pi
  vec4 lamp_axis;   // unit, from the lamp to the field; w: that distance
  vec4 eye_light;   // intensity of a light at the eye, over pi: x: outside, y: on organs
  vec4 shadow;      // x: 1 if there is a shadow map; y: size of its texels; z: m that a receiver is moved along its normal
  vec4 room_min;    // table's frame
  vec4 room_max;
  vec4 table_foot;  // x and y of two corners of what stands on the floor, table's frame
  vec4 cart_foot;
  vec4 field;       // half extents of the drape's opening, radius of its corners, m
  vec4 trunk;       // ends of what there is to see along the table: least and most of dot(along, position)
  vec4 sides[3];    // planes beyond which there is nothing of it either: normal outwards, offset
  vec4 focus;       // xyz: what the window of the covers shows; w: radius of the window
  vec4 focus_axis;  // unit, from the focus to between the eyes; w: distance
  vec4 fan;         // radius of the face (0: linear), half angle or half width, depth, 1 if convex
  vec4 fan_reach[kFanReaches];  // m below the face where the rays leave the patient
  vec4 fan_image;   // picture's origin (x, z) in the probe frame, 1 / width in m, 1 / height in m (0: none)
  vec4 viewport;    // width, height; columns and rows of the ground's grid
  uvec4 see;        // x: how far one sees into the patient
};

/// Push constants of a surface.
struct SurfaceStyle {
  vec4 colour;   // rgb, opacity
  vec4 surface;  // roughness, metalness, wrap, coat; see brdf.glsl
  vec4 glass;    // silhouette opacity, exponent of the silhouette, unused, unused
  uvec4 kind;    // x: one of the above; y: label (content::PictureLabels), 0: none; z: of a screen, one of the below
};

/// Push constants of the deformation pass.
struct DeformPush {
  uint vertex_count;
};

#ifdef __cplusplus
}  // namespace stylet::render
#endif

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

// What SurfaceStyle::kind says.
STYLET_SHARED uint kSolid = 0u;  // opaque, lit
STYLET_SHARED uint kGlass = 1u;  // translucent organ: clear where seen face on, dense at its silhouette
STYLET_SHARED uint kCover = 2u;  // glass with a window cut round the focus: skin, fat, muscle
STYLET_SHARED uint kSteel = 3u;  // needle shaft: metal with a mark every centimetre
STYLET_SHARED uint kMatte = 4u;  // plastic: probe, hub

STYLET_SHARED float kDepthUnit = 1e-4f;  // m a unit of the depth map

/// Rest state of a vertex. For a carried vertex, nodes and weights place it; otherwise weights.xyz is its position.
struct RestVertex {
  uvec4 nodes;   // indices into all bodies' nodes, one after the other
  vec4 weights;  // barycentric
  vec4 normal;   // xyz unit, outward; w: distance along the needle, m
};

/// A vertex as drawn, in the patient frame.
struct DrawnVertex {
  vec4 position;  // w: distance along the needle from the hub, m
  vec4 normal;    // w: unused
};

/// Everything that is one for a frame. std140: only vec4 and mat4.
struct FrameUniforms {
  mat4 clip_from_patient[2];  // left (or only) eye, right eye
  vec4 eye[2];                // xyz
  mat4 patient_from_probe;
  mat4 probe_from_patient;
  vec4 breath;  // xyz: motion of what goes with the breath
  vec4 to_key;  // unit, towards the light; w: intensity
  vec4 to_fill;
  vec4 to_rim;
  vec4 focus;       // xyz: what the window of the covers shows; w: radius of the window
  vec4 focus_axis;  // unit, from the focus to between the eyes; w: distance
  vec4 fan;         // radius of the face (0: linear), half angle or half width, depth, 1 if convex
  vec4 fan_image;   // picture's origin (x, z) in the probe frame, 1 / width in m, 1 / height in m (0: none)
  vec4 viewport;    // width, height; columns and rows of the ground's grid
};

/// Push constants of a surface.
struct SurfaceStyle {
  vec4 colour;   // rgb, opacity
  vec4 surface;  // roughness, silhouette opacity, exponent of the silhouette, unused
  uvec4 kind;    // x: one of the above; y: label (content::PictureLabels)
};

/// Push constants of the deformation pass.
struct DeformPush {
  uint vertex_count;
};

#ifdef __cplusplus
}  // namespace stylet::render
#endif

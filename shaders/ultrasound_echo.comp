// Pass 3: what each sample sends back and what it takes from the beam: backscatter times speckle over the slice
// thickness, and interface echoes from the jump of impedance and its angle to the beam.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"
#define TISSUE_BINDING 1
#define VOXEL_BINDING 2
#include "shaders/ultrasound_labels.glsl"
#define SPECKLE_BINDING 3
#include "shaders/ultrasound_speckle.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 4) readonly buffer Elevation {
  float elevation[];  // [sample][kMaxPlanes / 2 + 1]
};
layout(std430, binding = 5) readonly buffer Rest {
  vec4 rest[];
};
layout(std430, binding = 6) readonly buffer Slope {
  vec4 slope[];
};
layout(std430, binding = 7) readonly buffer Mixes {
  vec4 mixes[];
};
layout(std430, binding = 8) writeonly buffer Echo {
  vec2 echo[];  // [look][sample][line]
};
layout(std430, binding = 9) writeonly buffer Loss {
  float loss[];  // nepers of the sample
};

const float kDbToNepers = 0.115129255;

float log_impedance(int l, int s) {
  return mixes[polar_index(clamp(l, 0, frame.lines - 1), clamp(s, 0, frame.samples - 1))].x;
}

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int s = int(gl_GlobalInvocationID.y);
  if (l >= frame.lines) return;
  int index = polar_index(l, s);
  float range = sample_range(s);
  bool gel = range < frame.coupling;
  vec4 x = rest[index];
  vec3 across_plane = slope[index].xyz;
  vec3 mixed = mixes[index].xyz;

  // The label of each scatterer is drawn from the eight around it (stochastic trilinear interpolation), by bits that
  // belong to its place in the tissue.
  vec4 sum01 = vec4(0.0);
  vec2 sum2 = vec2(0.0);
  for (int off = -(frame.planes / 2); off <= frame.planes / 2; ++off) {
    vec3 point = x.xyz + float(off) * frame.plane_spacing * across_plane;
    uint texel = speckle_texel(point);
    uint bits = hash(texel);
    vec3 jitter = vec3(bits & 1023u, (bits >> 10) & 1023u, (bits >> 20) & 1023u) / 1024.0;
    int tissue = tissue_at(ivec3(floor(voxel_position(point) + jitter)), int(x.w), gel);
    float w = elevation[s * (kMaxPlanes / 2 + 1) + abs(off)] * tissues[tissue].backscatter * 0.70710678;
    uvec2 noise = speckle[texel];
    sum01 += w * first_looks(noise);
    sum2 += w * third_look(noise).xy;
  }
  uvec2 noise = speckle[speckle_texel(x.xyz)];
  vec4 noise01 = first_looks(noise);
  vec4 noise2 = third_look(noise);
  float triads = mixed.z > 0.0 ? smoothstep(kTriadThreshold, kTriadThreshold + 0.5, noise2.z) : 0.0;
  float texture_gain = exp(frame.texture * (mixed.z * noise2.z + triads * kTriadDb * kDbToNepers));

  // Interfaces: the jump of ln Z along the beam, and the angle from a wider stencil.
  float pitch = frame.face_radius == 0.0 ? frame.line_pitch : (frame.face_radius + range) * frame.line_pitch;
  float ramp = max(frame.label_spacing, 2.0 * frame.sample_pitch);
  int a = max(1, int(frame.gradient_reach / frame.sample_pitch + 0.5));
  int b = clamp(int(frame.gradient_reach / pitch + 0.5), 1, 16);
  float jump = (log_impedance(l, s + 1) - log_impedance(l, s - 1)) / (2.0 * frame.sample_pitch) * ramp;
  float corner00 = log_impedance(l - b, s - a);
  float corner01 = log_impedance(l - b, s + a);
  float corner10 = log_impedance(l + b, s - a);
  float corner11 = log_impedance(l + b, s + a);
  float along = (2.0 * (log_impedance(l, s + a) - log_impedance(l, s - a)) + corner01 - corner00 + corner11 - corner10) /
                (8.0 * float(a) * frame.sample_pitch);
  float across = (2.0 * (log_impedance(l + b, s) - log_impedance(l - b, s)) + corner10 - corner00 + corner11 - corner01) /
                 (8.0 * float(b) * pitch);
  float steepness = sqrt(along * along + across * across);
  float cosine = steepness > 1e-3 ? abs(along) / steepness : 1.0;
  float reflection = tanh(0.5 * abs(jump));
  float total = tanh(0.5 * steepness * ramp);
  float beads = exp((frame.texture * kBeadDb * noise2.w - kBeadDb) * kDbToNepers);
  float mirror = kInterfaceGain * reflection * pow(cosine, kInterfaceExponent) * beads;
  float diffuse = kInterfaceGain * total * kInterfaceDiffuse;
  float mirror_like = mirror * kInterfaceCoherent;
  float rough = (mirror * kInterfaceRough + diffuse) * 0.70710678;

  echo[index] = texture_gain * sum01.xy + vec2(mirror_like, 0.0) + rough * noise01.xy;
  if (frame.looks > 1) {
    echo[index + polar_size()] = texture_gain * sum01.zw + vec2(mirror_like, 0.0) + rough * noise01.zw;
  }
  if (frame.looks > 2) {
    echo[index + 2 * polar_size()] = texture_gain * sum2 + vec2(mirror_like, 0.0) + rough * noise2.xy;
  }
  float crossing = -log(max(1.0 - reflection * reflection, 1e-4)) / ramp;
  float grazing = kGrazingLoss * (1.0 - cosine) * (1.0 - cosine) * min(1.0, 20.0 * total);
  loss[index] = (mixed.y + crossing + grazing) * frame.sample_pitch;
}

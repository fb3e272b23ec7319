// Pass 2: the texture of tissue, and interface echoes from the jump of impedance and its angle to the beam, and what they take from it.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/ultrasound_common.glsl"
#define TISSUE_BINDING 6
#include "shaders/ultrasound_labels.glsl"
#define SPECKLE_BINDING 1
#include "shaders/ultrasound_speckle.glsl"

layout(local_size_x = 64) in;
layout(binding = 2) uniform samplerBuffer log_impedance;
layout(std430, binding = 3) readonly buffer Found {
  uint found[];
};
layout(std430, binding = 4) buffer Echo {
  vec2 echo[];
};
layout(std430, binding = 5) buffer Loss {
  float loss[];
};

float impedance_at(int l, int s) {
  return texelFetch(log_impedance, polar_index(clamp(l, 0, frame.lines - 1), clamp(s, 0, frame.samples - 1))).x;
}

void main() {
  int l = int(gl_GlobalInvocationID.x);
  int s = int(gl_GlobalInvocationID.y);
  if (l >= frame.lines) return;
  int index = polar_index(l, s);
  // The jump of ln Z along the beam, and the angle from the corners of a wider square.
  float pitch = !kConvex ? frame.line_pitch : (frame.face_radius + sample_range(s)) * frame.line_pitch;
  float ramp = max(frame.label_spacing, 2.0 * frame.sample_pitch);
  int a = max(1, int(frame.gradient_reach / frame.sample_pitch + 0.5));
  int b = clamp(int(frame.gradient_reach / pitch + 0.5), 1, 16);
  float jump = (impedance_at(l, s + 1) - impedance_at(l, s - 1)) / (2.0 * frame.sample_pitch) * ramp;
  float before_left = impedance_at(l - b, s - a);
  float before_right = impedance_at(l + b, s - a);
  float behind_left = impedance_at(l - b, s + a);
  float behind_right = impedance_at(l + b, s + a);
  float along = (behind_left - before_left + behind_right - before_right) / (4.0 * float(a) * frame.sample_pitch);
  float across = (before_right - before_left + behind_right - behind_left) / (4.0 * float(b) * pitch);
  float steepness = sqrt(along * along + across * across);
  float cosine = steepness > 1e-3 ? abs(along) / steepness : 1.0;
  float reflection = tanh(0.5 * abs(jump));
  float total = tanh(0.5 * steepness * ramp);

  uint texel = found[index] & ((1u << kTexelBits) - 1u);
  vec2 slow = vec2(0.0);
  float texture_gain = 1.0;
  if (kTextured) {
    slow = slow_pair(texel);
    TissueRow row = tissues[found[index] >> kTexelBits];
    float triads = smoothstep(kTriadThreshold, kTriadThreshold + kTriadEdge, slow.x);
    float septa = exp(-slow.x * slow.x / (kSeptumWidth * kSeptumWidth)) * smoothstep(kSeptumGap, kSeptumGap + 1.0, slow.y);
    texture_gain = exp(row.texture * slow.x + row.triads * triads + row.septa * septa);
  }
  float beads = exp((kBeadDb * slow.y - kBeadDb) * kDbToNepers);
  float mirror = kInterfaceGain * reflection * pow(cosine, kInterfaceExponent) * beads;
  float diffuse = kInterfaceGain * total * kInterfaceDiffuse;
  float rough = (mirror * kInterfaceRough + diffuse) * 0.70710678;
  for (int k = 0; k < kLooks; ++k) {
    vec2 noise = speckle_of_look(uint(k), texel & (kSpeckleTexels - 1u));
    int at = index + k * polar_size();
    echo[at] = texture_gain * echo[at] + vec2(mirror * kInterfaceCoherent, 0.0) + rough * noise;
  }
  float crossing = -log(max(1.0 - reflection * reflection, 1e-4)) / ramp;
  float grazing = kGrazingLoss * (1.0 - cosine) * (1.0 - cosine) * min(1.0, 20.0 * total);
  loss[index] += (crossing + grazing) * frame.sample_pitch;
}

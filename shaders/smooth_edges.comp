#version 460
// Smooths the steps of edges, so that a picture without antialiasing can be enlarged: FXAA (Lottes 2009), its short form:
// where the brightness varies, the mean of a few samples along the edge. On bytes as the screen gets them.
layout(local_size_x = 16, local_size_y = 4) in;
layout(set = 0, binding = 0) uniform sampler2D picture;
layout(set = 0, binding = 1, rgba8) uniform writeonly image2D smoothed;

const float kLeast = 0.03, kShare = 0.125;  // of contrast that is an edge: of white, of the brightest round it
const float kSpan = 8.0;                    // pixels along the edge, at most

float luma(vec3 c) { return dot(c, vec3(0.299, 0.587, 0.114)); }

void main() {
  ivec2 size = textureSize(picture, 0), p = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(p, size))) return;
  ivec2 a = max(p - 1, ivec2(0)), b = min(p + 1, size - 1);
  vec3 colour = texelFetch(picture, p, 0).rgb;
  float m = luma(colour);
  float nw = luma(texelFetch(picture, a, 0).rgb), ne = luma(texelFetch(picture, ivec2(b.x, a.y), 0).rgb);
  float sw = luma(texelFetch(picture, ivec2(a.x, b.y), 0).rgb), se = luma(texelFetch(picture, b, 0).rgb);
  float least = min(m, min(min(nw, ne), min(sw, se))), most = max(m, max(max(nw, ne), max(sw, se)));
  if (most - least > max(kLeast, kShare * most)) {
    vec2 along = vec2(sw + se - nw - ne, nw + sw - ne - se);
    float damped = max((nw + ne + sw + se) * 0.03125, 1.0 / 128.0);
    along = clamp(along / (min(abs(along.x), abs(along.y)) + damped), -kSpan, kSpan);
    vec2 at = (vec2(p) + 0.5) / vec2(size), way = along / vec2(size);
    vec3 near = 0.5 * (textureLod(picture, at - way / 6.0, 0.0).rgb + textureLod(picture, at + way / 6.0, 0.0).rgb);
    vec3 far = 0.5 * near + 0.25 * (textureLod(picture, at - 0.5 * way, 0.0).rgb +
                                    textureLod(picture, at + 0.5 * way, 0.0).rgb);
    float mean = luma(far);
    colour = mean < least || mean > most ? near : far;  // beyond the edge's end
  }
  imageStore(smoothed, p, vec4(colour, 1.0));
}

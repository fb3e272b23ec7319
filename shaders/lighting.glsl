// One light for everything drawn: the surgical lamp with its shadow, the room round it, a little light from the eye.
// Needs `frame`, kInside, kMirrors, kCoated, brdf.glsl, room.glsl.

/// Film-like curve (Narkowicz 2015, a fit of the ACES reference transform).
vec3 tone_map(vec3 c) {
  c *= 0.8;
  return clamp(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
}

/// Interleaved gradient noise (Jimenez 2014), half a level of 8 bits: no bands in the dark gradient.
float dither(vec2 pixel) { return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))) - 0.5; }

/// @param lit  share of the lamp that is seen from here
Reflected shade(Material m, vec3 position, vec3 n, vec3 v, float lit) {
  vec3 to_lamp;
  vec3 lamp = lamp_light(position, to_lamp) * kPi * lit;
  // The lamp is wide: its highlight is never smaller than its face.
  Material wide = m;
  wide.roughness = min(m.roughness + 0.09, 1.0);
  Reflected key = reflected(wide, n, v, to_lamp, kMirrors, kCoated);
  float nv = max(dot(n, v), 1e-3);
  Reflected s;
  vec3 base = m.albedo * (1.0 - m.metalness);
  float from_eye = (kInside ? frame.eye_light.y : frame.eye_light.x) * max(nv + m.wrap, 0.0) / (1.0 + m.wrap);
  s.diffuse = key.diffuse * lamp + base * (ambient(n) + from_eye);
  s.specular = vec3(0.0);
  if (!kMirrors) return s;
  vec3 mirror = reflect(-v, n);
  float mirrored = kInside ? 0.3 : 1.0;  // between organs the room is hardly seen
  vec3 base_mirror = mirrored_environment(specular_colour(m), m.roughness, nv);
  s.specular = key.specular * lamp + mirrored * environment(mirror, m.roughness) * base_mirror;
  if (kCoated) {
    vec3 coat_mirror = m.coat * mirrored_environment(vec3(0.04), kCoatRoughness, nv);
    s.specular += mirrored * environment(mirror, kCoatRoughness) * coat_mirror;
  }
  return s;
}

// Light of the 3-D view: soft key, cool fill, rim from behind, GGX highlights, and the curve to what a screen can show.

const float kPi = 3.14159265;

/// GGX distribution with Kelemen's visibility term; returns specular reflectance times n.l (Karis 2013; Kelemen 2001).
float ggx(vec3 n, vec3 v, vec3 l, float roughness, float f0) {
  vec3 h = normalize(v + l);
  float nl = max(dot(n, l), 0.0), nh = max(dot(n, h), 0.0), lh = max(dot(l, h), 0.05);
  float a2 = roughness * roughness * roughness * roughness;
  float d = nh * nh * (a2 - 1.0) + 1.0;
  float fresnel = f0 + (1.0 - f0) * pow(1.0 - lh, 5.0);
  return min(a2 / (kPi * d * d), 40.0) * fresnel * nl / (4.0 * lh * lh);
}

/// Diffuse light that wraps a little round the terminator, as it does in tissue.
float wrapped(vec3 n, vec3 l, float wrap) { return max((dot(n, l) + wrap) / (1.0 + wrap), 0.0); }

struct Shade {
  vec3 diffuse;
  vec3 specular;
};

Shade shade(FrameUniforms frame, vec3 albedo, vec3 n, vec3 v, float roughness, float f0) {
  Shade s;
  vec3 key = vec3(1.0, 0.96, 0.90) * frame.to_key.w;
  vec3 fill = vec3(0.72, 0.84, 1.0) * frame.to_fill.w;
  vec3 rim = vec3(0.85, 0.92, 1.0) * frame.to_rim.w;
  float sky = 0.5 + 0.5 * dot(n, frame.focus_axis.xyz);
  vec3 ambient = mix(vec3(0.05, 0.055, 0.07), vec3(0.22, 0.22, 0.23), sky);
  s.diffuse = albedo * (ambient + key * wrapped(n, frame.to_key.xyz, 0.25) + fill * wrapped(n, frame.to_fill.xyz, 0.4) +
                        rim * 0.3 * max(dot(n, frame.to_rim.xyz), 0.0));
  s.specular = key * ggx(n, v, frame.to_key.xyz, roughness, f0) + rim * ggx(n, v, frame.to_rim.xyz, roughness, f0);
  return s;
}

/// Film-like curve (Narkowicz 2015, a fit of the ACES reference transform).
vec3 tone_map(vec3 c) {
  c *= 0.8;
  return clamp(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
}

/// Calm dark ground, lighter behind the middle. `at` in [-1, 1] across the picture.
vec3 background(vec2 at) {
  float fall = exp(-1.1 * dot(at * vec2(0.8, 1.0), at * vec2(0.8, 1.0)));
  return mix(vec3(0.0045, 0.0050, 0.0065), vec3(0.030, 0.034, 0.041), fall);
}

/// Interleaved gradient noise (Jimenez 2014), half a level of 8 bits: no bands in the dark gradient.
float dither(vec2 pixel) { return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))) - 0.5; }

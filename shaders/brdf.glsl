// How surfaces reflect: GGX metal and plastic (Walter 2007; Heitz 2014) over a diffuse base that wraps a little round the
// terminator, as light does in tissue. Reflects no more light than it gets; tests/render/brdf_test.cpp integrates it.

const float kPi = 3.14159265;

struct Material {
  vec3 albedo;      // of the diffuse base, or of the metal
  float roughness;  // perceptual: alpha is its square
  float metalness;
  float wrap;       // 0: Lambert
  float coat;       // share of a thin wet or lacquered layer, smoother than what it covers
};

vec3 specular_colour(Material m) { return mix(vec3(0.04), m.albedo, m.metalness); }

vec3 fresnel(vec3 f0, float cosine) {
  float c = 1.0 - cosine, c2 = c * c;
  return f0 + (1.0 - f0) * (c2 * c2 * c);
}

/// Distribution times visibility (height-correlated Smith, Hammon's approximation).
float ggx(float nh, float nl, float nv, float roughness) {
  float alpha = max(roughness * roughness, 0.004);
  float d = nh * nh * (alpha * alpha - 1.0) + 1.0;
  float spread = alpha * alpha / (kPi * d * d);
  return spread * 0.5 / mix(2.0 * nl * nv, nl + nv, alpha);
}

const float kCoatRoughness = 0.22;

struct Reflected {
  vec3 diffuse;
  vec3 specular;
};

/// What a direction of light gives, times the cosine of its incidence: for radiance L from a solid angle w the surface
/// shows L w (diffuse + specular).
/// @param mirrors, coated  false: it has no specular part, or no coat, and is spared the work
Reflected reflected(Material m, vec3 n, vec3 v, vec3 l, bool mirrors, bool coated) {
  float nl = dot(n, l), nv = max(dot(n, v), 1e-3), lit = max(nl, 0.0);
  float wrapped = max(nl + m.wrap, 0.0) / ((1.0 + m.wrap) * (1.0 + m.wrap));
  Reflected r = Reflected(m.albedo * (1.0 - m.metalness) * wrapped / kPi, vec3(0.0));
  if (!mirrors) return r;
  vec3 h = normalize(v + l);
  float nh = clamp(dot(n, h), 0.0, 1.0), lh = clamp(dot(l, h), 0.0, 1.0);
  vec3 f0 = specular_colour(m);
  r.specular = fresnel(f0, lh) * ggx(nh, lit, nv, m.roughness) * lit;
  r.diffuse *= (1.0 - fresnel(f0, lit)) * (1.0 - fresnel(f0, nv));  // what is mirrored on the way in and out
  if (!coated) return r;
  float under_coat = 1.0 - m.coat * fresnel(vec3(0.04), nv).x;
  r.diffuse *= under_coat;
  r.specular *= under_coat;
  r.specular += m.coat * fresnel(vec3(0.04), lh).x * ggx(nh, lit, nv, kCoatRoughness) * lit;
  return r;
}

/// Share of an even environment that the surface mirrors (Karis 2014, a fit).
vec3 mirrored_environment(vec3 f0, float roughness, float nv) {
  vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float a004 = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
  vec2 ab = vec2(-1.04, 1.04) * a004 + r.zw;
  return f0 * ab.x + ab.y;
}

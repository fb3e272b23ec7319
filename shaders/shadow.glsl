// What the surgical lamp reaches. Needs `frame`, unforeseen.glsl and `sampler2DShadow shadow_map`.

/// Share of the lamp seen from a place, 0 ... 1; 1 beyond the map. Five taps, each of four texels weighed by nearness, turned
/// from pixel to pixel: soft over about seven texels, as the lamp is wide. A slanting receiver is moved further off itself,
/// and dark before the map's texels and the cloth's triangles show. Reversed depth: what is nearer to the lamp is greater.
float lamp_seen(vec3 position, vec3 n) {
  if (unforeseen(frame.shadow.x) <= 0.0) return 1.0;
  float offset = frame.shadow.z * (3.0 - 2.0 * abs(dot(n, frame.lamp_axis.xyz)));
  vec4 clip = frame.light_clip_from_patient * vec4(position + n * offset, 1.0);
  vec3 at = clip.xyz / clip.w;
  if (clip.w <= 0.0 || any(greaterThan(abs(at.xy), vec2(0.98)))) return 1.0;
  vec2 uv = at.xy * vec2(0.5, -0.5) + 0.5;
  float turn = 6.2831853 * (dither(gl_FragCoord.xy) + 0.5);
  vec2 a = 2.4 * frame.shadow.y * vec2(cos(turn), sin(turn)), b = vec2(-a.y, a.x);
  float sum = 2.0 * texture(shadow_map, vec3(uv, at.z)) + texture(shadow_map, vec3(uv + a, at.z)) +
              texture(shadow_map, vec3(uv - a, at.z)) + texture(shadow_map, vec3(uv + b, at.z)) +
              texture(shadow_map, vec3(uv - b, at.z));
  float edge = smoothstep(0.98, 0.88, max(abs(at.x), abs(at.y)));
  float faces = smoothstep(0.0, 0.22, -dot(n, frame.lamp_axis.xyz));
  return faces * mix(1.0, sum / 6.0, edge);
}

// The window that covers (skin, fat, muscle) and the cloth over them leave open towards the focus. Needs `frame`, unforeseen.glsl.

/// Both or either, with the corner between them rounded, m.
float both(float a, float b, float rounding) {
  float h = max(rounding - abs(a - b), 0.0);
  return max(a, b) + 0.25 * h * h / rounding;
}
float either(float a, float b, float rounding) { return -both(-a, -b, rounding); }

/// A cone with its apex at the eye is a circle on the screen.
float cone_at(float along) { return frame.focus.w * (1.0 - clamp(along / frame.focus_axis.w, -0.5, 0.95)); }

/// Distance across the line of sight from where covers are whole again, m; negative towards the focus. Where nothing of
/// the patient is behind, they stay whole.
/// @param steepness  of the ends beside the cone
float outside_whole(vec3 position, float steepness) {
  vec3 from_focus = position - frame.focus.xyz;
  float along = dot(from_focus, frame.focus_axis.xyz);
  float cone = length(from_focus - along * frame.focus_axis.xyz) - 1.12 * cone_at(along);
  float y = dot(frame.along.xyz, position);
  float beside = max(frame.trunk.x - y, y - frame.trunk.y);
  for (int i = 0; i < 3; ++i) beside = max(beside, dot(frame.sides[i].xyz, position) + frame.sides[i].w);
  return both(cone, steepness * beside, 0.02);
}

/// 0 inside the window, 1 well outside.
float outside_window(vec3 position) {
  float along = dot(position - frame.focus.xyz, frame.focus_axis.xyz);
  return smoothstep(-0.32, 0.0, outside_whole(position, 2.0) / cone_at(along));
}

/// Distance of a place on the drape from the border of the field, m; negative in it.
float outside_field(vec2 at) {
  vec2 d = abs(at) - frame.field.xy + frame.field.z;
  return min(max(d.x, d.y), 0.0) + length(max(d, 0.0)) - frame.field.z;
}

/// Distance of a place on the drape from the border of its opening, m; negative in it. One opening for both: the field,
/// and on the near side as far as skin is cut open.
float outside_opening(vec3 position, vec2 at) {
  float field = outside_field(at);
  if (unforeseen(frame.see.x) != kSeeWindow) return field;
  float near = -0.02 - dot(position - frame.focus.xyz, frame.focus_axis.xyz);
  return either(field, both(outside_whole(position, 1.0), near, 0.02), 0.03);
}

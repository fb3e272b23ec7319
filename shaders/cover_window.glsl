// The window that covers (skin, fat, muscle) and the cloth over them leave open towards the focus. Needs `frame`, unforeseen.glsl.

/// 0 inside the window, 1 well outside.
float outside_window(vec3 position) {
  vec3 from_focus = position - frame.focus.xyz;
  float along = dot(from_focus, frame.focus_axis.xyz);
  // A cone with its apex at the eye is a circle on the screen.
  float cone = frame.focus.w * (1.0 - clamp(along / frame.focus_axis.w, -0.5, 0.95));
  float across = length(from_focus - along * frame.focus_axis.xyz);
  return smoothstep(0.80, 1.12, across / cone);
}

/// Distance of a place on the drape from the border of its opening, m; negative in it.
float outside_field(vec2 at) {
  vec2 d = abs(at) - frame.field.xy + frame.field.z;
  return min(max(d.x, d.y), 0.0) + length(max(d, 0.0)) - frame.field.z;
}

/// Whether the drape is open: in the field, and where one looks into the patient, on the near side. Beyond the far
/// end of a patient who was cut out of a scan, and beside the trunk, there is nothing to look into.
bool cloth_open(vec3 position, vec2 at) {
  bool near = dot(position - frame.focus.xyz, frame.focus_axis.xyz) > -0.02;
  bool window = unforeseen(frame.see.x) == kSeeWindow && near && outside_window(position) < 0.9 &&
                at.y > frame.trunk.x && at.y < frame.trunk.y && abs(at.x - frame.trunk.z) < frame.trunk.w;
  return outside_field(at) < 0.0 || window;
}

// The window that covers (skin, fat, muscle) leave open towards the focus.

/// 0 inside the window, 1 well outside.
float outside_window(FrameUniforms frame, vec3 position) {
  vec3 from_focus = position - frame.focus.xyz;
  float along = dot(from_focus, frame.focus_axis.xyz);
  // A cone with its apex at the eye is a circle on the screen.
  float cone = frame.focus.w * (1.0 - clamp(along / frame.focus_axis.w, -0.5, 0.95));
  float across = length(from_focus - along * frame.focus_axis.xyz);
  return smoothstep(0.80, 1.12, across / cone);
}

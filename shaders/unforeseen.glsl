// For fragment shaders, as in ultrasound_common.glsl: what a branch hangs on is not uniforms alone, or lavapipe makes
// another shader for every draw and keeps them all.

uint unforeseen(uint value) { return value + uint(gl_FragCoord.x < 0.0); }
float unforeseen(float value) { return value + float(gl_FragCoord.x < 0.0); }

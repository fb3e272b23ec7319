#version 460
// One triangle over the whole picture, at infinity (reversed depth: 0).
void main() {
  vec2 corner = vec2(float(gl_VertexIndex & 1) * 4.0 - 1.0, float(gl_VertexIndex >> 1) * 4.0 - 1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}

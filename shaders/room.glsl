// Light of the room, and its floor and walls. Needs `frame` and brdf.glsl.

const vec3 kFloor = vec3(0.33, 0.36, 0.37), kWall = vec3(0.60, 0.62, 0.60), kDado = vec3(0.30, 0.42, 0.42);
const vec3 kLampColour = vec3(1.0, 0.955, 0.89);

/// Radiance of the room from a direction, as a surface of some roughness mirrors it: cloth and floor below, a row
/// of panels above.
vec3 environment(vec3 direction, float roughness) {
  float u = dot(direction, frame.up.xyz);
  vec3 c = mix(vec3(0.22, 0.26, 0.27), vec3(0.36, 0.37, 0.37), smoothstep(-0.35 - roughness, 0.25 + roughness, u));
  float along = dot(direction, frame.along.xyz);
  float panels = smoothstep(0.55 - 0.5 * roughness, 0.78 + 0.2 * roughness, u) *
                 mix(0.5 + 0.5 * cos(9.0 * along), 0.6, smoothstep(0.1, 0.5, roughness));
  return c + vec3(0.95, 1.0, 1.02) * panels * 0.9;
}

/// Light of all directions round a normal, over pi: what a white Lambert surface shows.
vec3 ambient(vec3 n) {
  float u = dot(n, frame.up.xyz);
  return mix(vec3(0.125, 0.120, 0.115), vec3(0.33, 0.345, 0.36), 0.5 + 0.5 * u);
}

/// The surgical lamp at a place, over pi: a pool of light with a soft rim. No shadow here.
vec3 lamp_light(vec3 position, out vec3 to_lamp) {
  vec3 from = position - frame.lamp.xyz;
  float distance = length(from);
  to_lamp = -from / distance;
  float along = max(dot(from, frame.lamp_axis.xyz), 1e-3);
  float off = length(from - along * frame.lamp_axis.xyz) / along;
  float pool = mix(0.22, 1.0, smoothstep(0.62, 0.16, off));
  float reach = frame.lamp_axis.w / max(along, 0.3);
  return kLampColour * frame.lamp.w * pool * min(reach * reach, 2.0);
}

/// Calm dark ground, lighter behind the middle, where there is no room. `at` in [-1, 1] across the picture.
vec3 plain_ground(vec2 at) {
  float fall = exp(-1.1 * dot(at * vec2(0.8, 1.0), at * vec2(0.8, 1.0)));
  return mix(vec3(0.0045, 0.0050, 0.0065), vec3(0.030, 0.034, 0.041), fall);
}

/// Soft dark patch under a thing that stands at `least` ... `most` of the floor.
float under(vec2 at, vec2 least, vec2 most, float reach) {
  vec2 d = max(max(least - at, at - most), 0.0);
  return 1.0 - exp(-dot(d, d) / (reach * reach));
}

/// Floor, walls and ceiling from within: where the ray of a pixel leaves the box of the room. Table's frame.
vec3 room_ground(vec3 eye, vec3 direction) {
  vec3 safe = direction + vec3(equal(direction, vec3(0.0))) * 1e-6;
  vec3 way = mix(frame.room_min.xyz - eye, frame.room_max.xyz - eye, greaterThan(safe, vec3(0.0))) / safe;
  float t = min(way.x, min(way.y, way.z));
  vec3 at = eye + t * direction;
  // Corners gather less light.
  vec3 inside = min(at - frame.room_min.xyz, frame.room_max.xyz - at);
  vec3 open = 1.0 - 0.38 * exp(-inside / 0.45);
  float height = at.z - frame.room_min.z;
  vec3 colour;
  if (t == way.z && direction.z < 0.0) {
    float shade = mix(0.42, 1.0, under(at.xy, frame.table_foot.xy, frame.table_foot.zw, 0.55)) *
                  mix(0.45, 1.0, under(at.xy, frame.cart_foot.xy, frame.cart_foot.zw, 0.28));
    float middle = exp(-dot(at.xy, at.xy) / 5.0);
    colour = kFloor * (0.44 + 0.26 * middle) * shade * open.x * open.y;
    // A trace of the walls in the polish.
    float grazing = 1.0 - clamp(-direction.z, 0.0, 1.0);
    colour += 0.22 * grazing * grazing * grazing * grazing * vec3(0.38, 0.40, 0.41);
  } else if (t == way.z) {
    colour = vec3(0.62, 0.63, 0.64) * 0.75 * open.x * open.y;
  } else {
    float soft = 0.004 + t * 0.0012;
    vec3 paint = mix(kDado, kWall, smoothstep(1.02 - soft, 1.02 + soft, height));
    paint *= 1.0 - 0.25 * smoothstep(0.035 + soft, 0.035 - soft, abs(height - 1.02));  // the handrail
    float glow = mix(0.50, 0.72, smoothstep(0.0, 2.2, height));
    colour = paint * glow * open.z * (t == way.x ? open.y * 0.94 : open.x);
  }
  return colour;
}

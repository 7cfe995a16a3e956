// The camera's rays in view space, by image position in pixels.

vec3 image_vector(vec2 point) {
  Frame f = frame();
  return f.corner.xyz + f.right.xyz * point.x + f.down.xyz * point.y;
}

// Returns a camera ray. It starts at the origin of view space, at frame().view_depth times length_a_depth.
ViewRay camera_ray(vec2 point) {
  Frame f = frame();
  vec3 start = f.start.xyz + f.start_x.xyz * point.x + f.start_y.xyz * point.y;
  if (!has(kPerspective)) return ViewRay(start, f.forward.xyz);
  vec3 d = image_vector(point) + f.forward.xyz;
  return ViewRay(start, d * (1.0 / sqrt(dot(d, d))));
}

// Returns the ray length per unit of depth.
float length_a_depth(vec2 point) {
  if (!has(kPerspective)) return 1.0;
  vec3 d = image_vector(point) + frame().forward.xyz;
  return sqrt(dot(d, d));
}

// The camera's rays, one per invocation, in view space and in the grids of instances.

// ---- pairs ----

// Numbers as sums of two single-precision floats, about 48 bits in total, three at a time: for values that the CPU
// computes in double precision before rounding. So rays along voxel edges equal the CPU's bit for bit and take the same
// side.
//
// Source: T. J. Dekker, "A floating-point technique for extending the available precision" (1971).

struct Pair {
  vec3 high;
  vec3 low;
};

// Normalises a sum whose first part is the larger.
Pair renewed(vec3 high, vec3 low) {
  precise vec3 sum = high + low;
  precise vec3 rest = low - (sum - high);
  return Pair(sum, rest);
}

Pair exact_sum(vec3 a, vec3 b) {
  precise vec3 sum = a + b;
  precise vec3 of_b = sum - a;
  precise vec3 rest = (a - (sum - of_b)) + (b - of_b);
  return Pair(sum, rest);
}

Pair exact_product(vec3 a, vec3 b) {
  precise vec3 product = a * b;
  precise vec3 wide_a = 4097.0 * a;
  precise vec3 a1 = wide_a - (wide_a - a);
  precise vec3 a2 = a - a1;
  precise vec3 wide_b = 4097.0 * b;
  precise vec3 b1 = wide_b - (wide_b - b);
  precise vec3 b2 = b - b1;
  precise vec3 rest = ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
  return Pair(product, rest);
}

Pair sum_of(Pair a, Pair b) {
  Pair sum = exact_sum(a.high, b.high);
  precise vec3 rest = sum.low + (a.low + b.low);
  return renewed(sum.high, rest);
}

Pair product_of(Pair a, Pair b) {
  Pair product = exact_product(a.high, b.high);
  precise vec3 rest = product.low + (a.high * b.low + a.low * b.high);
  return renewed(product.high, rest);
}

Pair quotient_of(Pair a, Pair b) {
  precise vec3 first = a.high / b.high;
  Pair back = product_of(Pair(first, vec3(0.0)), b);
  Pair left = sum_of(a, Pair(-back.high, -back.low));
  precise vec3 second = left.high / b.high;
  return renewed(first, second);
}

// Returns one component, in all three.
Pair component(Pair a, int axis) {
  return Pair(vec3(a.high[axis]), vec3(a.low[axis]));
}

Pair unit_of(Pair a) {
  Pair squares = product_of(a, a);
  Pair length_squared = sum_of(sum_of(component(squares, 0), component(squares, 1)), component(squares, 2));
  // One Newton step towards the inverse square root.
  precise vec3 rough = 1.0 / sqrt(length_squared.high);
  Pair root = Pair(rough, vec3(0.0));
  Pair off = product_of(length_squared, product_of(root, root));
  precise vec3 error = ((1.0 - off.high) - off.low) * 0.5 * rough;
  return product_of(a, renewed(rough, error));
}

// ---- rays ----

// Returns the image position of the invocation's ray, in pixels.
vec2 image_point() {
  return vec2(push.corner + tile_pixel()) + push.point;
}

// Returns the distance of a point on its ray from the origin of view space; undefined for pixels without a hit.
float t_of(Point point, vec2 at) {
  if (point.voxel.w < 0) return kInfinity;
  float ahead = placed_at(point.voxel.w).start.w - frame().view_depth;
  return ahead * length_a_depth(at) + uintBitsToFloat(point.what.w);
}

// Returns an image coordinate, in all three components.
Pair pixel_pair(int axis) {
  Pair sum = exact_sum(vec3(float(push.corner[axis] + tile_pixel()[axis])), vec3(push.point[axis]));
  return renewed(sum.high, sum.low + push.point_low[axis]);
}

// Returns origin + x right + y down at the invocation's image position.
Pair across(Pair origin, Pair right, Pair down) {
  return sum_of(sum_of(origin, product_of(right, pixel_pair(0))), product_of(down, pixel_pair(1)));
}

// A camera ray in an instance's grid, in about double precision. It starts near the grid, so that distance costs no
// precision.
struct ExactRay {
  Pair start;  // from start_base
  Pair direction;
};

// Returns the direction of the invocation's ray in view; unit.
Pair exact_direction() {
  Frame f = frame();
  Pair forward = Pair(f.forward.xyz, f.forward_low.xyz);
  if (!has(kPerspective)) return forward;
  Pair in_image = across(Pair(f.corner.xyz, f.corner_low.xyz), Pair(f.right.xyz, f.right_low.xyz),
                           Pair(f.down.xyz, f.down_low.xyz));
  return unit_of(sum_of(in_image, forward));
}

// `d`: `exact_direction`.
ExactRay exact_ray_in(Placed placed, Pair d) {
  ExactRay ray;
  ray.start = across(Pair(placed.start.xyz, placed.start_low.xyz), Pair(placed.start_x.xyz, placed.start_x_low.xyz),
                     Pair(placed.start_y.xyz, placed.start_y_low.xyz));
  Pair x = product_of(Pair(placed.grid_axes[0].xyz, placed.grid_axes_low[0].xyz), component(d, 0));
  Pair y = product_of(Pair(placed.grid_axes[1].xyz, placed.grid_axes_low[1].xyz), component(d, 1));
  Pair z = product_of(Pair(placed.grid_axes[2].xyz, placed.grid_axes_low[2].xyz), component(d, 2));
  ray.direction = sum_of(sum_of(x, y), z);
  return ray;
}

bool is_before(Pair a, Pair b, int axis) {
  return a.high[axis] != b.high[axis] ? a.high[axis] < b.high[axis] : a.low[axis] < b.low[axis];
}

// Moves a ray that starts more than 64 voxels from a tree's bounds to its entry point, as the CPU does before rounding.
// `axis`: the axis of the entry plane; -1 if the ray is unchanged. Returns false if the ray misses.
bool move_to_bounds(Tree tree, Placed placed, inout ExactRay ray, out float moved_t, out int axis) {
  vec3 low = vec3(tree.low.xyz - placed.start_base.xyz);
  vec3 high = vec3(tree.high.xyz - placed.start_base.xyz);
  moved_t = 0.0;
  axis = -1;
  vec3 p = ray.start.high;
  if (all(lessThanEqual(low - 64.0, p)) && all(lessThanEqual(p, high + 64.0))) return true;
  Pair planes = Pair(mix(high, low, greaterThan(ray.direction.high, vec3(0.0))), vec3(0.0));
  Pair t = quotient_of(sum_of(planes, Pair(-ray.start.high, -ray.start.low)), ray.direction);
  for (int i = 0; i < 3; ++i) {
    bool is_low = p[i] < low[i];
    if (!is_low && p[i] < high[i]) continue;
    float d = ray.direction.high[i];
    if (is_low ? !(d > 0.0) : !(d < 0.0)) return false;
    if (axis < 0 || !is_before(component(t, i), component(t, axis), 0)) axis = i;
  }
  if (axis < 0) return true;
  moved_t = t.high[axis];
  ray.start = sum_of(ray.start, product_of(component(t, axis), ray.direction));
  ray.start.high[axis] = planes.high[axis];
  ray.start.low[axis] = 0.0;
  // The other coordinates are inside now, or the ray misses.
  return all(greaterThanEqual(ray.start.high, low - 1e-3)) && all(lessThanEqual(ray.start.high, high + 1e-3));
}

// Returns the ray relative to the multiple of 64 voxels near its start, rounded to single precision.
GridRay rounded(Placed placed, ExactRay ray, float t) {
  vec3 whole = clamp(floor(ray.start.high), vec3(-1e9), vec3(1e9));
  ivec3 shift = ivec3(whole) & ~63;
  Pair start = sum_of(ray.start, Pair(-vec3(shift), vec3(0.0)));
  return GridRay(placed.start_base.xyz + shift, start.high, ray.direction.high, t);
}

// Returns the distance along a ray from the instance's start to the plane of a voxel's face.
Pair distance_to_face(ExactRay ray, Pair from_voxel, uint face) {
  int axis = int(face >> 1);
  float plane = (face & 1) == 0 ? 1.0 : 0.0;
  Pair from_plane = sum_of(Pair(vec3(plane), vec3(0.0)), component(Pair(-from_voxel.high, -from_voxel.low), axis));
  return quotient_of(from_plane, component(ray.direction, axis));
}

// Returns a ray's start relative to the voxel's lower corner.
Pair start_from(ExactRay ray, Placed placed, ivec3 voxel) {
  return sum_of(ray.start, Pair(-vec3(voxel - placed.start_base.xyz), vec3(0.0)));
}

// Returns the point where a ray enters a voxel through a face, relative to the voxel's lower corner.
vec3 exact_place(Placed placed, Pair d, ivec3 voxel, uint face) {
  ExactRay ray = exact_ray_in(placed, d);
  Pair start = start_from(ray, placed, voxel);
  return sum_of(start, product_of(distance_to_face(ray, start, face), ray.direction)).high;
}

// Returns the point where a ray meets a side of a voxel's shape, relative to the voxel's lower corner. `t`: its
// distance from the instance's start, which may be rounded.
vec3 exact_place_on_shape(Placed placed, Pair d, ivec3 voxel, uint side, float t) {
  ExactRay ray = exact_ray_in(placed, d);
  Pair start = start_from(ray, placed, voxel);
  vec3 near = sum_of(start, product_of(Pair(vec3(t), vec3(0.0)), ray.direction)).high;
  vec4 plane = shape_vector(side_index(side));
  float rest = (plane.w - dot(plane.xyz, near)) / dot(plane.xyz, ray.direction.high);
  return near + rest * ray.direction.high;
}

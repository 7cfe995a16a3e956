// Numbers as sums of two floats, about 48 bits in total, three at a time: src/render/shaders/camera.glsl. If a
// compiler reorders the sums, the first parts remain, with the precision of single floats.
//
// Source: T. J. Dekker, "A floating-point technique for extending the available precision" (1971).

struct Pair {
  high: vec3f,
  low: vec3f,
}

// For a sum whose first part is the larger.
fn renewed(high: vec3f, low: vec3f) -> Pair {
  let sum = high + low;
  return Pair(sum, low - (sum - high));
}
fn exact_sum(a: vec3f, b: vec3f) -> Pair {
  let sum = a + b;
  let of_b = sum - a;
  return Pair(sum, (a - (sum - of_b)) + (b - of_b));
}
fn exact_product(a: vec3f, b: vec3f) -> Pair {
  let product = a * b;
  let wide_a = 4097.0 * a;
  let a1 = wide_a - (wide_a - a);
  let a2 = a - a1;
  let wide_b = 4097.0 * b;
  let b1 = wide_b - (wide_b - b);
  let b2 = b - b1;
  return Pair(product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2);
}
fn sum_of(a: Pair, b: Pair) -> Pair {
  let sum = exact_sum(a.high, b.high);
  return renewed(sum.high, sum.low + (a.low + b.low));
}
fn product_of(a: Pair, b: Pair) -> Pair {
  let product = exact_product(a.high, b.high);
  return renewed(product.high, product.low + (a.high * b.low + a.low * b.high));
}
fn quotient_of(a: Pair, b: Pair) -> Pair {
  let first = a.high / b.high;
  let back = product_of(Pair(first, vec3f()), b);
  let left = sum_of(a, Pair(-back.high, -back.low));
  return renewed(first, left.high / b.high);
}
// Copies one component to all three.
fn component(a: Pair, axis: i32) -> Pair {
  return Pair(vec3f(a.high[axis]), vec3f(a.low[axis]));
}
fn whole(value: vec3f) -> Pair {
  return Pair(value, vec3f());
}
fn negated(a: Pair) -> Pair {
  return Pair(-a.high, -a.low);
}
fn unit_of(a: Pair) -> Pair {
  let squares = product_of(a, a);
  let length_squared = sum_of(sum_of(component(squares, 0), component(squares, 1)), component(squares, 2));
  // One Newton step towards the inverse root.
  let rough = 1.0 / sqrt(length_squared.high);
  let root = whole(rough);
  let off = product_of(length_squared, product_of(root, root));
  let error = ((1.0 - off.high) - off.low) * 0.5 * rough;
  return product_of(a, renewed(rough, error));
}

// The camera's rays, one per invocation, in view space and in instances' grids: src/render/shaders/camera.glsl.

var<private> pixel: vec2i;  // of the invocation, in the image

// The point where the invocation's ray crosses the image, in pixels.
fn image_point() -> vec2f {
  return vec2f(pixel) + push.point;
}
fn image_direction() -> vec3f {
  let point = image_point();
  return frame.corner.xyz + frame.right.xyz * point.x + frame.down.xyz * point.y + frame.forward.xyz;
}
// The ray starts at the origin of view space, at frame.view_depth times length_a_depth.
fn camera_ray() -> ViewRay {
  let point = image_point();
  let start = frame.start.xyz + frame.start_x.xyz * point.x + frame.start_y.xyz * point.y;
  let d = image_direction();
  return ViewRay(start, d * (1.0 / sqrt(dot(d, d))));
}
// The ray length per unit of its forward component.
fn length_a_depth() -> f32 {
  return length(image_direction());
}

// The distance of the point on its ray from the origin of view space; without a hit, infinitely far.
fn t_of(point: Point) -> f32 {
  if (point.voxel.w < 0) {
    return kInfinity;
  }
  let ahead = placed_vector(point.voxel.w, kStart).w - frame.view_depth;
  return ahead * length_a_depth() + bitcast<f32>(point.what.w);
}

// Copies an image coordinate to all three components.
fn pixel_pair(axis: i32) -> Pair {
  let sum = exact_sum(vec3f(f32(pixel[axis])), vec3f(push.point[axis]));
  return renewed(sum.high, sum.low + push.point_low[axis]);
}
// origin + x right + y down at the invocation's point of the image.
fn across(origin: Pair, right: Pair, down: Pair) -> Pair {
  return sum_of(sum_of(origin, product_of(right, pixel_pair(0))), product_of(down, pixel_pair(1)));
}

// A camera ray in an instance's grid, as exact as in double. It starts near the grid, so distance costs no precision.
struct ExactRay {
  start: Pair,  // from start_base
  direction: Pair,
}

// The direction of the invocation's ray in view space; a unit vector.
fn exact_direction() -> Pair {
  let in_image = across(Pair(frame.corner.xyz, frame.corner_low.xyz), Pair(frame.right.xyz, frame.right_low.xyz),
                          Pair(frame.down.xyz, frame.down_low.xyz));
  return unit_of(sum_of(in_image, Pair(frame.forward.xyz, frame.forward_low.xyz)));
}
fn placed_pair(i: i32, field: u32, low: u32) -> Pair {
  return Pair(placed_vector(i, field).xyz, placed_vector(i, low).xyz);
}
// `d`: `exact_direction`.
fn exact_ray_in(i: i32, d: Pair) -> ExactRay {
  let start = across(placed_pair(i, kStart, kStartLow), placed_pair(i, kStartX, kStartXLow),
                     placed_pair(i, kStartY, kStartYLow));
  var direction = product_of(placed_pair(i, kGridAxes, kGridAxesLow), component(d, 0));
  direction = sum_of(direction, product_of(placed_pair(i, kGridAxes + 1u, kGridAxesLow + 1u), component(d, 1)));
  direction = sum_of(direction, product_of(placed_pair(i, kGridAxes + 2u, kGridAxesLow + 2u), component(d, 2)));
  return ExactRay(start, direction);
}

fn is_before(t: Pair, one: i32, other: i32) -> bool {
  return select(t.high[one] < t.high[other], t.low[one] < t.low[other], t.high[one] == t.high[other]);
}

struct Moved {
  ray: ExactRay,
  t: f32,
  axis: i32,  // of the plane that the ray enters through; -1 if it is not moved
  is_hit: bool,
}

// Moves a ray that starts more than 64 voxels from a tree's bounds to its entry point, as the CPU does before rounding.
fn moved_to_bounds(tree: Tree, i: i32, ray: ExactRay) -> Moved {
  let base = placed_whole(i, kStartBase).xyz;
  let low = vec3f(tree.low.xyz - base);
  let high = vec3f(tree.high.xyz - base);
  var moved = Moved(ray, 0.0, -1, true);
  let p = ray.start.high;
  if (all(low - 64.0 <= p) && all(p <= high + 64.0)) {
    return moved;
  }
  let planes = select(high, low, ray.direction.high > vec3f());
  let t = quotient_of(sum_of(whole(planes), negated(ray.start)), ray.direction);
  for (var k = 0; k < 3; k++) {
    let is_low = p[k] < low[k];
    if (!is_low && p[k] < high[k]) {
      continue;
    }
    let d = ray.direction.high[k];
    if (select(!(d < 0.0), !(d > 0.0), is_low)) {
      moved.is_hit = false;
      return moved;
    }
    if (moved.axis < 0 || !is_before(t, k, moved.axis)) {
      moved.axis = k;
    }
  }
  if (moved.axis < 0) {
    return moved;
  }
  moved.t = t.high[moved.axis];
  var start = sum_of(ray.start, product_of(component(t, moved.axis), ray.direction));
  start.high[moved.axis] = planes[moved.axis];
  start.low[moved.axis] = 0.0;
  moved.ray.start = start;
  // The other axes are inside by now, or never will be.
  moved.is_hit = all(start.high >= low - 1e-3) && all(start.high <= high + 1e-3);
  return moved;
}

// Relative to the multiple of 64 voxels nearest to its start, then rounded.
fn rounded(i: i32, ray: ExactRay, t: f32) -> GridRay {
  let below = clamp(floor(ray.start.high), vec3f(-1e9), vec3f(1e9));
  let shift = vec3i(below) & vec3i(~63);
  let start = sum_of(ray.start, whole(-vec3f(shift)));
  return GridRay(placed_whole(i, kStartBase).xyz + shift, start.high, ray.direction.high, t);
}

// The distance along such a ray, from the instance's start, to the plane of a voxel face.
fn distance_to_face(ray: ExactRay, from_voxel: Pair, face: u32) -> Pair {
  let axis = axis_of(face);
  let plane = select(0.0, 1.0, (face & 1u) == 0u);
  let from_plane = sum_of(whole(vec3f(plane)), component(negated(from_voxel), axis));
  return quotient_of(from_plane, component(ray.direction, axis));
}
// A ray's start, from the voxel's lower corner.
fn start_from(ray: ExactRay, i: i32, voxel: vec3i) -> Pair {
  return sum_of(ray.start, whole(-vec3f(voxel - placed_whole(i, kStartBase).xyz)));
}
// The point where such a ray enters a voxel, relative to the voxel's lower corner.
fn exact_place(i: i32, d: Pair, voxel: vec3i, face: u32) -> vec3f {
  let ray = exact_ray_in(i, d);
  let start = start_from(ray, i, voxel);
  return sum_of(start, product_of(distance_to_face(ray, start, face), ray.direction)).high;
}

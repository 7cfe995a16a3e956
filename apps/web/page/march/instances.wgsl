// Rays among many instances: src/render/shaders/instances.glsl.

struct GridRay {
  base: vec3i,
  origin: vec3f,
  direction: vec3f,
  t: f32,  // of its start
}
struct ViewRay {
  origin: vec3f,
  direction: vec3f,
}

const kVisitDepth = 28;

var<private> visit_stack: array<u32, kVisitDepth>;
var<private> visit_height: i32;
var<private> visit_next: u32;
var<private> visit_end: u32;
var<private> visit_origin: vec3f;
var<private> visit_direction: vec3f;
var<private> visit_inverse: vec3f;
var<private> visit_still: vec3<bool>;

// Begins to list the instances whose boxes a ray in view space may hit.
fn start_visit(ray: ViewRay) {
  visit_stack[0] = 0u;
  visit_height = select(0, 1, frame.placed_count > 0u);
  visit_next = 0u;
  visit_end = 0u;
  visit_origin = ray.origin;
  visit_direction = ray.direction;
  visit_still = abs(ray.direction) < vec3f(1e-30);
  visit_inverse = 1.0 / select(ray.direction, vec3f(1.0), visit_still);
}

fn may_meet(low: vec3f, high: vec3f, max_t: f32) -> bool {
  if (any(visit_still & ((visit_origin < low) | (visit_origin > high)))) {
    return false;
  }
  let a = (low - visit_origin) * visit_inverse;
  let b = (high - visit_origin) * visit_inverse;
  let begin = select(min(a, b), vec3f(), visit_still);
  let end = select(max(a, b), vec3f(kNever), visit_still);
  let enter_t = max(max(begin.x, begin.y), max(begin.z, 0.0));
  let exit_t = min(min(end.x, end.y), min(end.z, max_t));
  // The boxes include a margin for rounding; their distances need one too.
  return enter_t <= min(exit_t, kNever) * 1.00001 + 1e-5;
}

// Returns the next instance up to max_t, mostly nearest first; -1: none left.
fn next_instance(max_t: f32) -> i32 {
  loop {
    while (visit_next < visit_end) {
      let low = vector_at(frame.leaves.x, 2u * visit_next);
      let high = vector_at(frame.leaves.x, 2u * visit_next + 1u);
      let number = tables[(frame.leaves.x >> 4u) + 2u * visit_next].w;
      visit_next++;
      if (may_meet(low.xyz, high.xyz, max_t)) {
        return i32(number);
      }
    }
    if (visit_height == 0) {
      break;
    }
    visit_height--;
    let node = visit_stack[visit_height];
    let place = (frame.tree.x >> 4u) + 2u * node;
    let low = tables[place];
    let high = tables[place + 1u];
    if (!may_meet(bitcast<vec4f>(low).xyz, bitcast<vec4f>(high).xyz, max_t)) {
      continue;
    }
    let first = low.w;
    let count = bitcast<i32>(high.w);
    if (count > 0) {
      visit_next = first;
      visit_end = first + u32(count);
      continue;
    }
    let is_forward = visit_direction[-1 - count] >= 0.0;
    visit_stack[visit_height] = select(first - 1u, first, is_forward);
    visit_stack[visit_height + 1] = select(first, first - 1u, is_forward);
    visit_height += 2;
  }
  return -1;
}

fn grid_from_view(i: i32, ray: ViewRay) -> GridRay {
  let origin = placed_vector(i, kRefInside).xyz + turned(i, kGridAxes, ray.origin - placed_vector(i, kRefView).xyz);
  return GridRay(placed_whole(i, kRefBase).xyz, origin, turned(i, kGridAxes, ray.direction), 0.0);
}
fn view_from_grid(i: i32, ray: GridRay) -> ViewRay {
  let from_ref = vec3f(ray.base - placed_whole(i, kRefBase).xyz) + (ray.origin - placed_vector(i, kRefInside).xyz);
  return ViewRay(placed_vector(i, kRefView).xyz + turned(i, kViewAxes, from_ref),
                 turned(i, kViewAxes, ray.direction));
}

// Numbers the contents of an instance's grid: its voxels, then its field.
fn content_count() -> i32 {
  return select(1, 2, kHasFields);
}
fn is_field_content(content: i32) -> bool {
  return kHasFields && content == 1;
}
fn opaque_tree(instance: i32, content: i32) -> Tree {
  return tree_of(instance, select(kOpaque, kField, is_field_content(content)));
}

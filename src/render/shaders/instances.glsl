// Rays among many instances, and the camera's rays in view space.

struct GridRay {
  ivec3 base;
  vec3 origin;
  vec3 direction;
  float t;  // t of its start
};

struct ViewRay {
  vec3 origin;
  vec3 direction;
};

const int kVisitDepth = 28;

uint visit_stack[kVisitDepth];
int visit_height;
uint visit_next;
uint visit_end;
bool visited_is_far;  // true if the last instance is drawn from its impostor

vec3 visit_origin;
vec3 visit_direction;
vec3 visit_inverse;
bvec3 visit_still;

// Starts listing the instances whose boxes a ray in view may meet.
void start_visit(ViewRay ray) {
  visit_stack[0] = 0;
  visit_height = frame().placed_count > 0 ? 1 : 0;
  visit_next = visit_end = 0;
  visit_origin = ray.origin;
  visit_direction = ray.direction;
  visit_still = equal(ray.direction, vec3(0.0));
  visit_inverse = 1.0 / mix(ray.direction, vec3(1.0), visit_still);
}

bool may_meet(vec3 low, vec3 high, float max_t) {
  bvec3 is_outside = either(lessThan(visit_origin, low), greaterThan(visit_origin, high));
  if (any(both(visit_still, is_outside))) return false;
  vec3 a = (low - visit_origin) * visit_inverse;
  vec3 b = (high - visit_origin) * visit_inverse;
  vec3 near = mix(min(a, b), vec3(0.0), visit_still);
  vec3 far = mix(max(a, b), vec3(kNever), visit_still);
  float enter_t = max(max(near.x, near.y), max(near.z, 0.0));
  float exit_t = min(min(far.x, far.y), min(far.z, max_t));
  // The boxes include a rounding margin; their distances need one too.
  return enter_t <= exit_t * 1.00001 + 1e-5;
}

// Returns the next listed instance up to max_t, roughly nearest first; -1 if none is left.
int next_instance(float max_t) {
  Vectors nodes = Vectors(frame().tree);
  Vectors leaves = Vectors(frame().leaves);
  for (;;) {
    while (visit_next < visit_end) {
      vec4 low = leaves.at[2 * visit_next];
      vec4 high = leaves.at[2 * visit_next + 1];
      ++visit_next;
      if (may_meet(low.xyz, high.xyz, max_t)) {
        visited_is_far = floatBitsToInt(high.w) != 0;
        return floatBitsToInt(low.w);
      }
    }
    if (visit_height == 0) return -1;
    uint node = visit_stack[--visit_height];
    vec4 low = nodes.at[2 * node];
    vec4 high = nodes.at[2 * node + 1];
    if (!may_meet(low.xyz, high.xyz, max_t)) continue;
    uint first = floatBitsToUint(low.w);
    int count = floatBitsToInt(high.w);
    if (count > 0) {
      visit_next = first;
      visit_end = first + uint(count);
      continue;
    }
    bool is_forward = visit_direction[-1 - count] >= 0.0;
    visit_stack[visit_height] = is_forward ? first : first - 1;
    visit_stack[visit_height + 1] = is_forward ? first - 1 : first;
    visit_height += 2;
  }
}

vec3 turned(vec4 columns[3], vec3 v) {
  return columns[0].xyz * v.x + columns[1].xyz * v.y + columns[2].xyz * v.z;
}

Placed placed_at(int i) {
  return PlacedGrids(frame().placed).at[i];
}

GridRay grid_from_view(Placed placed, ViewRay ray) {
  vec3 origin = placed.ref_inside.xyz + turned(placed.grid_axes, ray.origin - placed.ref_view.xyz);
  return GridRay(placed.ref_base.xyz, origin, turned(placed.grid_axes, ray.direction), 0.0);
}

ViewRay view_from_grid(Placed placed, GridRay ray) {
  vec3 from_ref = vec3(ray.base - placed.ref_base.xyz) + (ray.origin - placed.ref_inside.xyz);
  return ViewRay(placed.ref_view.xyz + turned(placed.view_axes, from_ref), turned(placed.view_axes, ray.direction));
}

// Returns the tree of a content's opaque part (kContents); for shapes, of all voxels that they touch.
Tree opaque_tree(Placed placed, int content) {
  if (is_shape_content(content)) return shape_trees(placed.ref_base.w).touched;
  if (kHasShapes && !kHasFields && content == 1) return no_tree();
  Tree tree = Grids(frame().grids).at[placed.ref_base.w].opaque;
  if (is_field_content(content)) tree = Grids(frame().grids).at[placed.ref_base.w].field;
  return tree;
}

// Returns true if a ray in an instance's space meets an opaque part of a content up to `max_t`; sets `t` to the
// distance.
bool find_opaque(Placed placed, int content, GridRay ray, float max_t, out float t) {
  Tree tree = opaque_tree(placed, content);
  FieldHit hit;
  return start_walk(tree, ray.base, ray.origin, ray.direction, max_t, -1) &&
         find_content(content, max_t, t, hit);
}

// Returns the part of a camera ray's direction that depends on the image position, in pixels.
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

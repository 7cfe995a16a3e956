#version 460
// Finds the nearest opaque voxel at each pixel of a tile.
#include "compute.glsl"
#include "walk.glsl"
#include "instances.glsl"
#include "camera.glsl"
#include "far.glsl"

// Returns the middle of a surfel, from the lower end of its edge.
vec3 middle_of_surfel(uint side, vec3 shape, vec2 shift) {
  vec3 middle = vec3(0.0);
  middle[side >> 1] = shape.x;
  middle[kFaceU[side]] = shift.x;
  middle[kFaceV[side]] = shift.y;
  return middle;
}

// Returns the point where a ray meets a surfel, from the lower end of its edge, and sets its distance `t`. Computes
// from the ray's point nearest to the surfel's middle, so that only small numbers are rounded. `from_voxel`: the ray's
// start.
vec3 place_on_surfel(ExactRay ray, Pair from_voxel, uint side, vec3 shape, vec2 shift, out float t) {
  int axis = int(side >> 1);
  int u = kFaceU[side];
  int v = kFaceV[side];
  Pair back = Pair(-from_voxel.high, -from_voxel.low);
  vec3 middle = middle_of_surfel(side, shape, shift);
  back = sum_of(back, Pair(middle, vec3(0.0)));
  Pair products = product_of(back, ray.direction);
  Pair squares = product_of(ray.direction, ray.direction);
  Pair along = sum_of(sum_of(component(products, 0), component(products, 1)), component(products, 2));
  Pair length_squared = sum_of(sum_of(component(squares, 0), component(squares, 1)), component(squares, 2));
  Pair nearest_t = quotient_of(along, length_squared);
  vec3 near = sum_of(from_voxel, product_of(nearest_t, ray.direction)).high;
  vec3 off = near - middle;
  vec3 d = ray.direction.high;
  float rest = (shape.y * off[u] + shape.z * off[v] - off[axis]) / (d[axis] - shape.y * d[u] - shape.z * d[v]);
  t = nearest_t.high.x + rest;
  return near + rest * d;
}

// Moves a point onto a piece of a shape's side, between its edges. `shape`: its offset and slopes. `halves`: half its
// sides.
vec3 on_piece(vec3 point, uint side, vec3 shape, vec2 shift, vec2 halves) {
  const float kRim = 1e-6;
  vec3 middle = middle_of_surfel(side, shape, shift);
  vec2 reach = max(halves - kRim, vec2(0.0));
  float u = clamp(point[kFaceU[side]] - middle[kFaceU[side]], -reach.x, reach.x);
  float v = clamp(point[kFaceV[side]] - middle[kFaceV[side]], -reach.y, reach.y);
  vec3 at = middle;
  at[kFaceU[side]] += u;
  at[kFaceV[side]] += v;
  at[side >> 1] += shape.y * u + shape.z * v;
  return at;
}

// Returns the impostor of a rectangle, by its number among all impostors' rectangles.
Far far_with(uint number) {
  Fars fars = Fars(frame().fars);
  uint low = 0;
  uint high = frame().far_count;
  while (high - low > 1) {
    uint middle = (low + high) / 2;
    if (fars.at[middle].faces.z <= number) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return fars.at[low];
}

// Returns the level of a rectangle, by its number among the impostor's parts; `index` becomes the number in its level.
FarLevel level_with(Far far, inout uint index) {
  if (index < far.level.faces.z) return far.level;
  index -= far.level.faces.z;
  if (index < far.coarser.faces.z) return far.coarser;
  index -= far.coarser.faces.z;
  return far.unseen;
}

// Returns the distance along a ray to a rectangle's plane. `voxel`: its corner is the origin of the ray's start.
Pair distance_to_rectangle(ExactRay ray, Pair from_voxel, Far far, FarFace rectangle, ivec3 voxel) {
  int axis = int(rectangle.what.z >> 1);
  float centre = far.centre[axis] - float(voxel[axis]);
  Pair plane = sum_of(Pair(vec3(centre), vec3(0.0)), Pair(vec3(rectangle.centre[axis]), vec3(0.0)));
  Pair from_plane = sum_of(plane, component(Pair(-from_voxel.high, -from_voxel.low), axis));
  return quotient_of(from_plane, component(ray.direction, axis));
}

// Sets `point` to the impostor visible at the pixel. Returns the start of the instance's ray, and the rectangle's
// distance from it.
bool find_far(Pair direction, float scale, inout Point point, out float depth, out float nearest) {
  uint number = FarPixels(frame().far_numbers).at[slot_of_pixel()];
  if (number == kNoFace) return false;
  Far far = far_with(number >> 2);
  uint index = (number >> 2) - far.faces.z;
  FarLevel level = level_with(far, index);
  FarFace rectangle = FarFaces(level.faces.xy).at[index];
  bool is_cell = (level.cells.x | level.cells.y) != 0;
  index = rectangle.what.x;
  if (is_cell) index = FarCells(level.cells.xy).at[index].face[view_of(far.near, number & 3)];
  bool is_surfel = (rectangle.what.z & kIsSurfel) != 0;
  bool has_surfel = index >= far.faces.w;
  if (has_surfel) index = 3 * index - 2 * far.faces.w;
  ivec4 face = VoxelFaces(far.faces.xy).at[index];
  uint what = uint(face.w);
  uint side = what >> 24 & 7;
  uint light = what >> 16 & 0xFF | (what >> 27) << 8;
  int i = far.origin.w;
  Placed placed = placed_at(i);
  ivec3 voxel = face.xyz - far.origin.xyz;
  ExactRay ray = exact_ray_in(placed, direction);
  depth = placed.start.w;
  Pair start = start_from(ray, placed, voxel);
  Pair t = Pair(vec3(0.0), vec3(0.0));
  vec3 at;
  if ((kHasFields || kHasShapes) && is_surfel) {
    at = place_on_surfel(ray, start, side, intBitsToFloat(VoxelFaces(far.faces.xy).at[index + 1].xyz),
                         intBitsToFloat(VoxelFaces(far.faces.xy).at[index + 2].xy), nearest);
  } else {
    t = distance_to_rectangle(ray, start, far, rectangle, voxel);
    if (is_cell) {
      float met = uintBitsToFloat(FarPixels(frame().far_depths).at[slot_of_pixel()]);
      t = Pair(vec3((met - depth) * scale), vec3(0.0));
    }
    nearest = t.high.x;
    at = sum_of(start, product_of(t, ray.direction)).high;
  }
  point.voxel = ivec4(voxel, i);
  point.inside.w = depth * scale + nearest;
  if ((kHasFields || kHasShapes) && has_surfel) {
    ivec4 shape = VoxelFaces(far.faces.xy).at[index + 1];
    ivec4 piece = VoxelFaces(far.faces.xy).at[index + 2];
    vec2 shift = intBitsToFloat(piece.xy);
    if (kHasShapes && piece.w != 0) {
      vec2 halves = vec2(uvec2(piece.z) >> uvec2(0, 16) & 0xFFFF) * kPieceHalves;
      point.inside.xyz = on_piece(at, side, intBitsToFloat(shape.xyz), shift, halves);
      uint kind = kIsShape | kSurface | kIsFar;
      point.what = uvec4(what & 0xFFFF, uint(piece.w) - 1, kind | light << 8, floatBitsToUint(nearest));
      return true;
    }
    uint normal = uint(shape.w);
    float below = dot(middle_of_surfel(side, intBitsToFloat(shape.xyz), shift) - at, normal_of(normal));
    point.inside.xyz = at + (max(below, 0.0) + kSurfelLift) * normal_of(normal);
    uint kind = kIsField | kSurface | kIsBlended | kIsFar;
    point.what = uvec4(what & 0xFFFF, normal, kind | light << 8, floatBitsToUint(nearest));
    return true;
  }
  // Lighting moves it onto the face, which may lie elsewhere in the rectangle's cell.
  point.inside.xyz = at;
  point.what = uvec4(what & 0xFFFF, side, kSurface | kIsFar | light << 8, floatBitsToUint(nearest));
  return true;
}

// Every instance has its own ray start. The ray start of the nearest hit's instance lies at this depth; the hit is `t`
// behind it. Differences of depths are exact.
struct Nearest {
  float depth;
  float t;
};

// Replaces the nearest hit by the pixel ray's hit on a grid's content if that is nearer. `scale`: the ray length per
// unit of depth.
void meet_content(int content, int i, Placed placed, Pair direction, float scale, inout Nearest nearest,
                  inout Point point) {
  bool is_field = is_field_content(content);
  Tree tree = opaque_tree(placed, content);
  if ((tree.root.x | tree.root.y) == 0) return;
  ExactRay exact = exact_ray_in(placed, direction);
  float moved_t;
  int moved;
  if (!move_to_bounds(tree, placed, exact, moved_t, moved)) return;
  GridRay in_grid = rounded(placed, exact, placed.start.w * scale);
  float limit = (nearest.depth - placed.start.w) * scale + nearest.t;
  float rounding = 1e-6 * max(abs(limit), nearest.t);
  float room = limit + rounding - moved_t;
  if (!start_walk(tree, in_grid.base, in_grid.origin, in_grid.direction, room, moved)) return;
  float walked_t;
  FieldHit hit;
  if (!find_content(content, room, walked_t, hit)) return;
  float found_t = moved_t + walked_t;
  // Among equally near hits the first instance wins; equal means within the rounding of each grid's own space.
  bool is_equal = point.voxel.w >= 0 && abs(found_t - limit) <= rounding;
  // A shape counts before a voxel, and a voxel before a field.
  if (is_equal ? i + (is_field ? 1 : 0) > point.voxel.w : found_t > limit) return;
  nearest = Nearest(placed.start.w, found_t);
  point.voxel = ivec4(walk_voxel, i);
  point.inside.w = in_grid.t + found_t;
  if (is_field) {
    bool is_inside = hit.starts_inside && moved < 0;
    point.inside.xyz = hit.inside;
    point.what = uvec4(material_found(tree, hit.inside), packed_normal(normal_found(hit.inside)),
                       kIsField | (is_inside ? kUnlit : kSurface | kIsBlended), floatBitsToUint(found_t));
  } else if (is_shape_content(content)) {
    bool is_inside = shape_met.starts_inside;
    point.voxel = ivec4(shape_met.voxel, i);
    point.what = uvec4(shape_met.type, is_inside ? face_found() : shape_met.side,
                       is_inside ? kUnlit : kSurface | kIsShape, floatBitsToUint(found_t));
  } else {
    point.what = uvec4(type_found(), face_found(), walk_axis < 0 ? kUnlit : kSurface, floatBitsToUint(found_t));
  }
}

Point first_hit(vec2 at) {
  Point point;
  point.voxel = ivec4(0, 0, 0, -1);
  point.inside = vec4(0.0, 0.0, 0.0, kInfinity);
  point.what = uvec4(0);
  ViewRay ray = camera_ray(at);
  Pair direction = exact_direction();
  float scale = length_a_depth(at);
  Nearest nearest = Nearest(0.0, kInfinity);
  if (push.far_count > 0 && !find_far(direction, scale, point, nearest.depth, nearest.t)) {
    nearest = Nearest(0.0, kInfinity);
  }
  start_visit(ray);
  for (;;) {
    int i = next_instance((nearest.depth - frame().view_depth) * scale + nearest.t);
    if (i < 0) break;
    if (visited_is_far) continue;
    Placed placed = placed_at(i);
    for (int content = 0; content < kContents; ++content) {
      meet_content(content, i, placed, direction, scale, nearest, point);
    }
  }
  // Inside a voxel the position is not used; on an impostor it is already known.
  bool is_far = (point.what.z & kIsFar) != 0;
  if (is_of_shape(point) && !is_far) {
    point.inside.xyz = exact_place_on_shape(placed_at(point.voxel.w), direction, point.voxel.xyz, point.what.y,
                                            uintBitsToFloat(point.what.w));
  } else if (point.voxel.w >= 0 && kind_of(point) == kSurface && !is_of_field(point) && !is_far) {
    point.inside.xyz = exact_place(placed_at(point.voxel.w), direction, point.voxel.xyz, point.what.y);
  }
  return point;
}

void main() {
  bool is_active = is_in_tile();
  bool is_hit = false;
  if (is_active) {
    Point point = first_hit(image_point());
    is_hit = point.voxel.w >= 0;
    uint slot = slot_of_pixel();
    Points(frame().points).at[slot] = point;
    State state;
    state.weight = vec4(1.0, 1.0, 1.0, -kNever);
    state.colour = vec4(0.0, 0.0, 0.0, 1.0);
    States(frame().states).at[slot] = state;
    if (push.first != 0) Depths(frame().depths).at[slot] = point.inside.w;
  }
  add_counts(is_active ? 1 : 0, is_hit && push.first != 0, false);
}

// The nearest opaque voxel of each pixel of a tile: src/render/shaders/primary.comp.

// Every instance has its own start. The start of the nearest hit so far is at this depth, and the hit is `t` behind it.
struct Nearest {
  depth: f32,
  t: f32,
}

// Intersects the pixel's ray with a grid's contents and keeps the hit if it is the nearest so far. `scale`: ray length
// per depth.
fn meet_content(content: i32, i: i32, direction: Pair, scale: f32, nearest: ptr<function, Nearest>,
                point: ptr<function, Point>) {
  let is_field = is_field_content(content);
  let tree = opaque_tree(i, content);
  if ((tree.root.x | tree.root.y) == 0u) {
    return;
  }
  let moved = moved_to_bounds(tree, i, exact_ray_in(i, direction));
  if (!moved.is_hit) {
    return;
  }
  let depth = placed_vector(i, kStart).w;
  let in_grid = rounded(i, moved.ray, depth * scale);
  let limit = ((*nearest).depth - depth) * scale + (*nearest).t;
  let rounding = 1e-6 * max(abs(limit), (*nearest).t);
  let room = limit + rounding - moved.t;
  if (!start_walk(tree, in_grid.base, in_grid.origin, in_grid.direction, room, moved.axis)) {
    return;
  }
  var hit: FieldHit;
  if (!find_content(is_field, room, &hit)) {
    return;
  }
  let found_t = moved.t + hit.t;
  // At equal distance, within the rounding of each grid's space, the first instance wins.
  let is_equal = (*point).voxel.w >= 0 && abs(found_t - limit) <= rounding;
  if (select(found_t > limit, i + content > (*point).voxel.w, is_equal)) {
    return;
  }
  *nearest = Nearest(depth, found_t);
  (*point).voxel = vec4i(walk_voxel, i);
  (*point).inside = vec4f(hit.inside, in_grid.t + found_t);
  if (is_field) {
    let is_inside = hit.starts_inside && moved.axis < 0;
    (*point).what = vec4u(material_found(tree, hit.inside), packed_normal(normal_found(hit.inside)),
                          kIsField | select(kSurface | kIsBlended, kUnlit, is_inside), bitcast<u32>(found_t));
  } else {
    (*point).what = vec4u(type_found(), face_found(), select(kSurface, kUnlit, walk_axis < 0), bitcast<u32>(found_t));
  }
}

fn first_hit() -> Point {
  var point = Point(vec4i(0, 0, 0, -1), vec4f(0.0, 0.0, 0.0, kInfinity), vec4u());
  let direction = exact_direction();
  let scale = length_a_depth();
  var nearest = Nearest(0.0, kInfinity);
  start_visit(camera_ray());
  loop {
    let i = next_instance((nearest.depth - frame.view_depth) * scale + nearest.t);
    if (i < 0) {
      break;
    }
    for (var content = 0; content < content_count(); content++) {
      meet_content(content, i, direction, scale, &nearest, &point);
    }
  }
  // If the ray starts inside a voxel, the position does not matter.
  if (point.voxel.w >= 0 && kind_of(point) == kSurface && !is_of_field(point)) {
    let place = exact_place(point.voxel.w, direction, point.voxel.xyz, point.what.y);
    point.inside = vec4f(place, point.inside.w);
  }
  return point;
}

@compute @workgroup_size(8, 8)
fn find_points(@builtin(global_invocation_id) id: vec3u) {
  if (!is_in_tile(id)) {
    return;
  }
  pixel = push.corner + vec2i(id.xy);
  points[slot_of(id)] = first_hit();
}

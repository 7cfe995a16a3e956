// Lights each pixel of a tile: src/render/shaders/light.comp and direct_light.glsl. Compilers inline a function at
// each call, and a walk is long: one loop therefore traces all rays.

// Returns true if a ray in the space of instance `home`, which is tested first, hits an opaque part of any instance.
fn is_blocked(home: i32, home_ray: GridRay, max_t: f32) -> bool {
  let in_view = view_from_grid(home, home_ray);
  start_visit(in_view);
  var ray = home_ray;
  var is_first = true;
  for (var i = home; i >= 0; i = next_instance(max_t)) {
    if (i == home && !is_first) {
      continue;
    }
    if (!is_first) {
      ray = grid_from_view(i, in_view);
    }
    is_first = false;
    for (var content = 0; content < content_count(); content++) {
      let tree = opaque_tree(i, content);
      var hit: FieldHit;
      if (start_walk(tree, ray.base, ray.origin, ray.direction, max_t, -1) &&
          find_content(is_field_content(content), max_t, &hit)) {
        return true;
      }
    }
    if (frame.placed_count == 1u) {
      return false;
    }
  }
  return false;
}

// The transmittance, per channel, of the transparent bodies along a ray.
fn light_passed(home: i32, home_ray: GridRay, max_t: f32) -> vec3f {
  var list = BodyList(kOnWay, 0u, kInfinity);
  var passed = vec3f(1.0);
  let in_view = view_from_grid(home, home_ray);
  let length = voxel_size(home);
  start_visit(in_view);
  loop {
    let i = next_instance(max_t);
    if (i < 0) {
      break;
    }
    var ray = home_ray;
    if (i != home) {
      ray = grid_from_view(i, in_view);
    }
    find_bodies(i, ray, length * placed_vector(i, kRefView).w / voxel_size(i), max_t, 0.0, &list, &passed);
  }
  var next = 0u;
  var body: Body;
  while (next_body(list, &next, &body)) {
    passed *= passed_by(surface_of(body.what.x), body.lengths.z, has_own_length(body));
  }
  return passed;
}

// Lists the bodies in front of the pixel's hit, from `from_t` on.
fn find_seen_bodies(list: ptr<function, BodyList>, max_t: f32, from_t: f32) {
  let direction = exact_direction();
  let scale = length_a_depth();
  var unused = vec3f(1.0);
  start_visit(camera_ray());
  loop {
    let i = next_instance(max_t);
    if (i < 0) {
      break;
    }
    let ahead = (placed_vector(i, kStart).w - frame.view_depth) * scale;
    let in_grid = rounded(i, exact_ray_in(i, direction), ahead);
    find_bodies(i, in_grid, placed_vector(i, kRefView).w / voxel_size(i), max_t, from_t, list, &unused);
  }
}

fn occlusion_direction(face: u32, ray: i32) -> vec3f {
  var direction = vector_at(frame.directions.x, 9u * face + u32(ray)).xyz;
  let u = kFaceU[face];
  let v = kFaceV[face];
  if (ray == 0) {
    direction[u] = push.upright.x;
    direction[v] = push.upright.y;
    direction[axis_of(face)] = sign_of(face) * push.upright.z;
    return direction;
  }
  let before = vec2f(direction[u], direction[v]);
  direction[u] = push.turn.x * before.x - push.turn.y * before.y;
  direction[v] = push.turn.y * before.x + push.turn.x * before.y;
  return direction;
}

// Rotates a direction relative to (0, 1, 0) so that it is relative to a unit `normal`.
fn turned_from_up(direction: vec3f, normal: vec3f) -> vec3f {
  if (normal.y < -1.0 + 1e-6) {
    return vec3f(-direction.xy, direction.z);
  }
  let axis = vec3f(normal.z, 0.0, -normal.x);
  let once = cross(axis, direction);
  return direction + once + cross(axis, once) / (1.0 + normal.y);
}

// The normal of a surface point, in its grid.
fn grid_normal(point: Point) -> vec3f {
  if (is_of_field(point)) {
    return normal_of(point.what.y);
  }
  return face_normal(point.what.y);
}

struct Lit {
  light: vec3f,  // the sun's, and that of lamps
  openness: f32,
}

// The light that reaches a surface point. Ray numbers: -1 is the ray to the sun, followed by the occlusion rays and the
// rays to lamps.
fn trace_light(point: Point) -> Lit {
  const kUp = 2u;
  let i = point.voxel.w;
  let is_field = is_of_field(point);
  let normal = grid_normal(point);
  let cell_size = placed_vector(i, kRefView).w;
  var ray = GridRay(point.voxel.xyz & vec3i(~63), vec3f(point.voxel.xyz & vec3i(63)) + point.inside.xyz, vec3f(), 0.0);
  ray.origin += frame.lift / cell_size * normal;
  let to_sun = placed_vector(i, kToSun);
  let face = select(point.what.y, kUp, is_field);
  var cosine = placed_vector(i, kDiffuse + (face >> 2u))[face & 3u];
  if (is_field) {
    cosine = max(dot(normal, to_sun.xyz), 0.0) * to_sun.w;
  }
  var lamps = vec2u();
  if (has(kLamps)) {
    lamps = lamps_around(point.voxel);
  }
  let in_view = view_from_grid(i, ray).origin;
  let size = voxel_size(i);
  let normal_in_view = turned(i, kViewAxes, normal) / size;
  var sunlight = cosine * frame.sun.xyz;
  var of_lamps = vec3f();
  var open = 0;
  for (var k = select(0, -1, cosine > 0.0); k < frame.occlusion_count + i32(lamps.y); k++) {
    let occlusion_distance = frame.occlusion_distance * select(1.0, frame.light.w, is_field);
    var max_t = select(occlusion_distance, frame.shadow_distance, k < 0) / cell_size;
    var brought = vec3f();
    if (k < 0) {
      ray.direction = to_sun.xyz;
    } else if (k < frame.occlusion_count) {
      ray.direction = occlusion_direction(face, k);
      if (is_field) {
        ray.direction = turned_from_up(ray.direction, normal);
      }
    } else {
      let lamp = words[(frame.lamp_lists.x >> 2u) + lamps.x + u32(k - frame.occlusion_count)];
      let lamp_at = lamp_ray(lamp, in_view, normal_in_view);
      brought = lamp_at.light;
      ray.direction = turned(i, kGridAxes, lamp_at.direction) * size;
      max_t = lamp_at.reach / size;
      if (all(brought == vec3f()) || !(max_t > 0.0)) {
        of_lamps += brought;
        continue;
      }
    }
    let is_open = !is_blocked(i, ray, max_t);
    if (k >= 0 && k < frame.occlusion_count) {
      open += select(0, 1, is_open);
      continue;
    }
    var passed = vec3f(select(0.0, 1.0, is_open));
    if (kHasGlass && is_open) {
      passed = light_passed(i, ray, max_t);
    }
    if (k < 0) {
      sunlight *= passed;
    } else {
      of_lamps += brought * passed;
    }
  }
  let share = f32(open) / f32(frame.occlusion_count);
  return Lit(sunlight + of_lamps, select(share, min(share * frame.ambient.w, 1.0), is_field));
}

fn surface_at(point: Point) -> Surface {
  if (!is_of_field(point)) {
    return surface_of(point.what.x);
  }
  if ((point.what.z & kIsBlended) == 0u) {
    return surface_of_material(point.what.x);
  }
  let cell = floor(point.inside.xyz);
  return blend_of_field(opaque_tree(point.voxel.w, 1), point.voxel.xyz + vec3i(cell), point.inside.xyz - cell,
                        point.what.x);
}

fn light_of(point: Point) -> vec3f {
  let surface = surface_at(point);
  let kind = kind_of(point);
  if (kind == kUnlit) {
    return surface.colour;
  }
  if (kind == kGlow) {
    return surface.emitted * frame.exposure;
  }
  let lit = trace_light(point);
  return colour_in_light(surface, lit.light, lit.openness);
}

// The light of a body at its start.
fn point_of(body: Body) -> Point {
  let i = body.voxel.w;
  let begins_in_field = kHasFieldGlass && (body.what.z & kBeginsInField) != 0u;
  let kind = select(kSurface, kGlow, (body.what.z & kStartsInside) != 0u);
  let ray = exact_ray_in(i, exact_direction());
  let start = start_from(ray, i, body.voxel.xyz);
  var t = whole(vec3f(body.lengths.w));
  if (!begins_in_field) {
    t = distance_to_face(ray, start, body.what.y);
  }
  return Point(body.voxel, vec4f(sum_of(start, product_of(t, ray.direction)).high, body.lengths.x),
               vec4u(body.what.xy, kind | select(0u, kIsField, begins_in_field), 0u));
}

// The point where a ray hits a face: moved onto it, and slightly inside its edges.
fn on_face(inside: vec3f, face: u32) -> vec3f {
  var at = clamp(inside, vec3f(1e-6), vec3f(1.0 - 1e-6));
  at[axis_of(face)] = select(0.0, 1.0, (face & 1u) == 0u);
  return at;
}

// The light of a sample. One loop over all visible surfaces: bodies, a list at a time, and the opaque hit.
fn colour_of_pixel(opaque_point: Point) -> vec3f {
  let opaque_t = t_of(opaque_point);
  var state = State(vec4f(1.0, 1.0, 1.0, -kNever), vec4f());
  var way: Passage;
  way.is_last = true;
  var begins_list = kHasGlass;
  loop {
    if (begins_list) {
      var list = BodyList(kSeen, 0u, kInfinity);
      find_seen_bodies(&list, opaque_t, state.weight.w);
      // The first body of a later list was entered in the previous list.
      way.is_entered = state.weight.w > -kNever;
      way.list = list;
      way.next = 0u;
      way.has_body = false;
      way.is_last = list.dropped_t == kInfinity;
      state.weight.w = list.dropped_t;
      begins_list = false;
    }
    let is_body = kHasGlass && enter_next(&way, opaque_t, &state);
    if (kHasGlass && !is_body && !way.is_last) {
      begins_list = true;
      continue;
    }
    var point = opaque_point;
    var weight = state.weight.xyz;
    if (is_body) {
      weight = pass_body(way.body, &state);
      point = point_of(way.body);
    } else if (point.voxel.w < 0) {
      state.colour += vec4f(weight * sky_colour(camera_ray().direction.y), 0.0);
      break;
    }
    if (!is_of_field(point)) {
      point.inside = vec4f(on_face(point.inside.xyz, point.what.y), point.inside.w);
    }
    state.colour += vec4f(weight * light_of(point), 0.0);
    if (!is_body) {
      break;
    }
  }
  return state.colour.xyz;
}

@compute @workgroup_size(8, 8)
fn light_points(@builtin(global_invocation_id) id: vec3u) {
  if (!is_in_tile(id)) {
    return;
  }
  pixel = push.corner + vec2i(id.xy);
  let colour = clamp(colour_of_pixel(points[slot_of(id)]), vec3f(), vec3f(1.0));
  let place = place_of(id);
  let before = select(sums[place].xyz, vec3f(), push.first != 0u);
  sums[place] = vec4f(before + colour, 0.0);
}

// Density fields: src/render/shaders/walk.glsl. Their trees contain the cells that touch the solid. In a cell, the
// field along a ray is a cubic; the hit is its first root.

const kBlockEdge = 7;

// The samples around the cells of a word, starting one before its first corner. `block`: their address in words.
fn sample_of(block: u32, at: vec3i) -> f32 {
  let i = u32((at.z * kBlockEdge + at.y) * kBlockEdge + at.x);
  let two = unpack2x16float(words[block + (i >> 1u)]);
  return select(two.y, two.x, (i & 1u) == 0u);
}

// A brick's number for the word of a cell.
fn number_in(brick: vec4u, cell: vec3i) -> u32 {
  let child = child_of(brick, index_in(cell, 1));
  let count = countOneBits(brick.x) + countOneBits(brick.y);
  return words[(brick.z >> 2u) + 2u * count + child];
}
fn number_found() -> u32 {
  return number_in(walk_stack[1], walk_voxel);
}

const kNoBlock = 0u;
// The samples around a cell of a brick in a chunk with that record; kNoBlock if all of them are solid.
fn block_in(brick: vec4u, record: u32, cell: vec3i) -> u32 {
  let begin = number_in(brick, cell);
  return select((record >> 2u) + begin, kNoBlock, begin == 0u);
}
// The samples of the found cell; kNoBlock if they and their neighbours are all solid.
fn block_found() -> u32 {
  if (walk_level > 0) {
    return kNoBlock;
  }
  return block_in(walk_stack[1], record_found(), walk_voxel);
}

// A cubic in powers of s.
fn value_at(f: vec4f, s: f32) -> f32 {
  return ((f.w * s + f.z) * s + f.y) * s + f.x;
}

// The root between `from_s`, with a non-negative value, and `to_s`, with a negative one.
fn root_between(f: vec4f, from_s: f32, to_s: f32) -> f32 {
  var low = from_s;
  var high = to_s;
  let f_low = value_at(f, low);
  let f_high = value_at(f, high);
  var s = low + (high - low) * (f_low / (f_low - f_high));
  for (var i = 0; i < 24; i++) {
    let value = value_at(f, s);
    if (value < 0.0) {
      high = s;
    } else {
      low = s;
    }
    if (!(high - low > 1e-7)) {
      break;
    }
    var next = s - value / ((3.0 * f.w * s + 2.0 * f.z) * s + f.y);
    if (!(next > low && next < high)) {
      next = 0.5 * (low + high);
    }
    if (abs(next - s) <= 1e-6) {
      return next;
    }
    s = next;
  }
  return s;
}

// The positions of a cubic's extremes, in order; -1: none.
fn extremes_of(f: vec4f) -> vec2f {
  let a = 3.0 * f.w;
  let b = 2.0 * f.z;
  let discriminant = b * b - 4.0 * a * f.y;
  if (!(discriminant > 0.0)) {
    return vec2f(-1.0);
  }
  let q = -0.5 * (b + select(1.0, -1.0, b < 0.0) * sqrt(discriminant));
  var one = -1.0;
  var other = -1.0;
  if (a != 0.0) {
    one = q / a;
  }
  if (q != 0.0) {
    other = f.y / q;
  }
  return vec2f(min(one, other), max(one, other));
}

// The first s in [0, 1] where the cubic becomes negative; a negative number if it never does.
fn first_negative(f: vec4f) -> f32 {
  if (f.x < 0.0) {
    return 0.0;
  }
  let b1 = f.x + f.y * (1.0 / 3.0);
  let b2 = f.x + (2.0 * f.y + f.z) * (1.0 / 3.0);
  let b3 = f.x + f.y + f.z + f.w;
  if (min(min(b1, b2), b3) >= 0.0) {
    return -1.0;
  }
  var low = 0.0;
  var high = 1.0;
  var is_found = b3 < 0.0;
  if (!(b3 < 0.0 && !(b1 < 0.0 && b2 >= 0.0))) {
    // The curve is monotonic between its extremes.
    let extremes = extremes_of(f);
    for (var i = 0; i < 2; i++) {
      let extreme = extremes[i];
      if (!(extreme > low && extreme < 1.0)) {
        continue;
      }
      if (value_at(f, extreme) < 0.0) {
        high = extreme;
        is_found = true;
        break;
      }
      low = extreme;
    }
  }
  if (!is_found) {
    return -1.0;
  }
  return root_between(f, low, high);
}

// Corners of a cell by x + 2 y, of z and z + 1.
struct Corners {
  low: vec4f,
  high: vec4f,
}
fn corners_of(block: u32, first: vec3i) -> Corners {
  return Corners(vec4f(sample_of(block, first), sample_of(block, first + vec3i(1, 0, 0)),
                       sample_of(block, first + vec3i(0, 1, 0)), sample_of(block, first + vec3i(1, 1, 0))),
                 vec4f(sample_of(block, first + vec3i(0, 0, 1)), sample_of(block, first + vec3i(1, 0, 1)),
                       sample_of(block, first + vec3i(0, 1, 1)), sample_of(block, first + vec3i(1, 1, 1))));
}
fn mixed_corners(corners: Corners, at: vec3f) -> f32 {
  let z = corners.low + (corners.high - corners.low) * at.z;
  let y = z.xy + (z.zw - z.xy) * at.y;
  return y.x + (y.y - y.x) * at.x;
}

// The field of a cell along a ray, in powers of s. `entry` is a point in the cell, 0 to 1 on each axis; `way` is the
// vector from it to the point with s = 1.
fn cubic_of(corners: Corners, entry: vec3f, way: vec3f) -> vec4f {
  let rise = corners.high - corners.low;
  let z0 = corners.low + rise * entry.z;
  let z1 = rise * way.z;
  let rise0 = z0.zw - z0.xy;
  let rise1 = z1.zw - z1.xy;
  let y0 = z0.xy + rise0 * entry.y;
  let y1 = z1.xy + rise1 * entry.y + rise0 * way.y;
  let y2 = rise1 * way.y;
  let x0 = y0.y - y0.x;
  let x1 = y1.y - y1.x;
  let x2 = y2.y - y2.x;
  return vec4f(y0.x + x0 * entry.x, y1.x + x1 * entry.x + x0 * way.x, y2.x + x2 * entry.x + x1 * way.x, x2 * way.x);
}

// A hit of a field.
struct FieldHit {
  t: f32,
  inside: vec3f,  // position in the cell
  starts_inside: bool,
}

// Intersects the ray with the field in the found cell, up to `max_t`.
fn meet_cell(max_t: f32, hit: ptr<function, FieldHit>) -> bool {
  (*hit).t = walk_t;
  (*hit).starts_inside = walk_axis < 0;
  let cell = vec3f(walk_voxel - ray_base);
  let block = block_found();
  if (block == kNoBlock) {
    (*hit).inside = clamp(ray_origin + walk_t * ray_direction - cell, vec3f(), vec3f(1.0));
    return true;
  }
  let first = select((select(cell + 1.0, cell, ray_forward) - ray_origin) * ray_inverse, vec3f(), ray_still);
  let last = select((select(cell, cell + 1.0, ray_forward) - ray_origin) * ray_inverse, vec3f(kNever), ray_still);
  let t_in = max(max(first.x, first.y), max(first.z, 0.0));
  let t_out = max(min(min(last.x, last.y), last.z), t_in);
  let size = min(t_out, max_t) - t_in;
  if (size < 0.0) {
    return false;
  }
  let entry = clamp(ray_origin + t_in * ray_direction - cell, vec3f(), vec3f(1.0));
  let way = ray_direction * size;
  let s = first_negative(cubic_of(corners_of(block, (walk_voxel & vec3i(3)) + 1), entry, way));
  if (s < 0.0) {
    return false;
  }
  (*hit).t = t_in + s * size;
  (*hit).inside = entry + s * way;
  (*hit).starts_inside = (*hit).t <= 0.0;
  return true;
}

// Same as find_voxel, but in a field's tree to the first point where the field is negative.
fn find_content(is_field: bool, max_t: f32, hit: ptr<function, FieldHit>) -> bool {
  while (find_voxel(max_t)) {
    (*hit).t = walk_t;
    if (!is_field) {
      return true;
    }
    if (meet_cell(max_t, hit)) {
      return true;
    }
    if (!leave_block(0u, max_t)) {
      return false;
    }
  }
  return false;
}

fn field_in_block(block: u32, at: vec3f) -> f32 {
  let first = clamp(floor(at), vec3f(), vec3f(f32(kBlockEdge - 2)));
  return mixed_corners(corners_of(block, vec3i(first)), at - first);
}

// The gradient of a cell's field.
fn gradient_of(corners: Corners, inside: vec3f) -> vec3f {
  let z = mix(corners.low, corners.high, inside.z);
  let along_z = corners.high - corners.low;
  let y = mix(z.xy, z.zw, inside.y);
  let along_y = z.zw - z.xy;
  let z_y = mix(along_z.xy, along_z.zw, inside.y);
  return vec3f(y.y - y.x, mix(along_y.x, along_y.y, inside.x), mix(z_y.x, z_y.y, inside.x));
}

// The shading normal of a field in a cell with minimum corner `first` of a block. Unit, or 0.
fn normal_in(block: u32, first: vec3i, inside: vec3f) -> vec3f {
  let at = vec3f(first) + inside;
  // From the cell itself.
  var own = gradient_of(corners_of(block, first), inside);
  let own_size = length(own);
  if (own_size > 0.0) {
    own = own / own_size;
  } else {
    own = vec3f();
  }
  var gradient = vec3f();
  for (var side = 0; side < 6; side++) {
    let forward = select(-1.0, 1.0, (side & 1) == 0);
    var step = vec3f();
    step[side >> 1u] = forward;
    gradient[side >> 1u] += forward * field_in_block(block, at + step);
  }
  let size = length(gradient);
  if (dot(gradient, own) > 0.5 * size) {
    return gradient / size;
  }
  return own;
}
fn normal_found(inside: vec3f) -> vec3f {
  let block = block_found();
  if (block == kNoBlock) {
    return vec3f();
  }
  return normal_in(block, (walk_voxel & vec3i(3)) + 1, inside);
}

// The type of a field's sample; 0 if the tree has no chunk there.
fn type_at(field: Tree, at: vec3i) -> u32 {
  if (any(at < field.low.xyz) || any(at >= field.high.xyz)) {
    return 0u;
  }
  var node = field.root;
  for (var level = field.low.w; level > 2; level--) {
    if ((node.z & 1u) != 0u) {
      break;
    }
    let index = index_in(at, level);
    if (!has_child(node, index)) {
      return 0u;
    }
    node = nodes[(node.z >> 4u) + child_of(node, index)];
  }
  return type_in(record_of(node), at & vec3i(63));
}

// The material of the solid sample nearest to the hit.
fn material_found(field: Tree, inside: vec3f) -> u32 {
  var nearest = vec3i(inside > vec3f(0.5));
  let block = block_found();
  if (block != kNoBlock) {
    var least = kNever;
    for (var i = 0; i < 8; i++) {
      let corner = vec3i(i & 1, (i >> 1u) & 1, i >> 2u);
      let away = vec3f(corner) - inside;
      let distance = dot(away, away);
      if (!(sample_of(block, (walk_voxel & vec3i(3)) + 1 + corner) < 0.0) || !(distance < least)) {
        continue;
      }
      least = distance;
      nearest = corner;
    }
  }
  let at = walk_voxel + nearest;
  if (all(((at ^ walk_voxel) & vec3i(~63)) == vec3i())) {
    return type_in(record_found(), at & vec3i(63));
  }
  // The next chunk owns the sample: its cell there touches it.
  return type_at(field, at);
}

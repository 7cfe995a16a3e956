// The surface of a field, blended from the materials around a point: src/render/shaders/field_blend.glsl.

// The samples around the word of a cell; kNoBlock if the word has none because all samples are solid.
fn samples_around(field: Tree, cell: vec3i) -> u32 {
  if (any(cell < field.low.xyz) || any(cell >= field.high.xyz)) {
    return kNoBlock;
  }
  var node = field.root;
  var record = 0u;
  for (var level = field.low.w; level > 1; level--) {
    let index = index_in(cell, level);
    if ((node.z & 1u) != 0u || !has_child(node, index)) {
      return kNoBlock;
    }
    if (level == 2) {
      record = record_of(node);
    }
    node = nodes[(node.z >> 4u) + child_of(node, index)];
  }
  if ((node.z & 1u) != 0u || !has_child(node, index_in(cell, 1))) {
    return kNoBlock;
  }
  return block_in(node, record, cell);
}

// The surface of a material; fields without materials are white, as in smooth meshes.
fn surface_of_material(kind: u32) -> Surface {
  if (kind == 0u) {
    return white_surface();
  }
  return surface_of(kind);
}

// The look at a point `inside` a cell, blended from the solid samples of the 27 around. `nearest`: the material of the
// nearest sample.
fn blend_of_field(field: Tree, cell: vec3i, inside: vec3f, nearest: u32) -> Surface {
  var blend = surface_of_material(nearest);
  let block = samples_around(field, cell);
  if (block == kNoBlock) {
    return blend;
  }
  let nearer = vec3i(inside >= vec3f(0.5));
  let off = inside - vec3f(nearer);
  var shares = array<vec3f, 3>(0.25 - 0.5 * off, vec3f(0.5), 0.25 + 0.5 * off);
  var known = nearest;
  var look = blend;
  var total = 0.0;
  for (var i = 0; i < 27; i++) {
    let step = vec3i(i % 3, i / 3 % 3, i / 9);
    let corner = nearer + step - 1;
    let share = shares[step.x].x * shares[step.y].y * shares[step.z].z;
    let is_solid = bitcast<i32>(sample_of(block, (cell & vec3i(3)) + 1 + corner)) < 0;
    if (!is_solid || !(share > 0.0)) {
      continue;
    }
    let kind = type_at(field, cell + corner);
    if (kind != known) {
      look = surface_of_material(kind);
    }
    known = kind;
    total += share;
    mix_look(look, share / total, &blend);
  }
  return blend;
}

// The samples' mean as sRGB bytes, rounded exactly: the byte is the number of thresholds that the light reaches.

fn encoded(light: f32) -> u32 {
  var byte = 0u;
  for (var step = 128u; step > 0u; step = step >> 1u) {
    let next = byte + step;
    if (light >= vector_at(frame.thresholds.x, next >> 2u)[next & 3u]) {
      byte = next;
    }
  }
  return byte;
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
  if (!is_in_tile(id)) {
    return;
  }
  let place = place_of(id);
  let mean = sums[place].xyz / f32(push.round + 1u);  // the number of samples so far
  colours[place] = encoded(mean.x) | (encoded(mean.y) << 8u) | (encoded(mean.z) << 16u) | 0xFF000000u;
}

// An invocation and its pixel. The including file declares the push constants: the frame's address, and the size of the
// tile.

layout(local_size_x = 8, local_size_y = 8) in;

Frame frame() {
  return Frame(push.frame_address);
}

bool has(uint flag) {
  return (frame().flags & flag) != 0;
}

// Returns the invocation's position in the tile.
ivec2 tile_pixel() {
  return ivec2(gl_GlobalInvocationID.xy);
}
bool is_in_tile() {
  return all(lessThan(tile_pixel(), push.size));
}
uint slot_of_pixel() {
  return gl_GlobalInvocationID.y * uint(push.size.x) + gl_GlobalInvocationID.x;
}

// An invocation, its pixel and the counts of its workgroup. The including file declares the push
// constants: the frame's address, and the size of the tile.

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

// Counts for a whole image, summed within a workgroup first.
shared uint shared_rays;
shared uint shared_hits;
shared uint shared_pending;

void add_counts(uint rays, bool is_hit, bool is_pending) {
  if (gl_LocalInvocationIndex == 0) shared_rays = shared_hits = shared_pending = 0;
  barrier();
  atomicAdd(shared_rays, rays);
  if (is_hit) atomicAdd(shared_hits, 1);
  if (is_pending) atomicAdd(shared_pending, 1);
  barrier();
  if (gl_LocalInvocationIndex != 0) return;
  Counters counters = Counters(frame().counters);
  uint before = atomicAdd(counters.rays_low, shared_rays);
  if (before + shared_rays < before) atomicAdd(counters.rays_high, 1);
  if (shared_hits != 0) atomicAdd(counters.hits, shared_hits);
  if (shared_pending != 0) atomicAdd(counters.pending, shared_pending);
}

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

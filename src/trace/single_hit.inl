// What a single ray's walk comes to, in double precision. Included after the walks.

inline bool first_single(const TreeView& tree, const Ray& ray, double max_t, RayHit& hit, bool& unfinished) {
  const SingleHit found = QUOIN_TRACE_SINGLE(tree, ray, max_t);
  unfinished = found.is_unfinished;
  if (!found.is_hit) return false;
  hit.voxel = found.voxel + IVec3(tree.origin);
  hit.starts_inside = found.axis < 0;
  hit.t = 0.0;
  if (hit.starts_inside) return true;
  const double d = ray.direction[found.axis];
  hit.face = static_cast<Direction>(2 * found.axis + (d > 0.0 ? 1 : 0));
  const double plane = hit.voxel[found.axis] + (d > 0.0 ? 0.0 : 1.0);
  hit.t = (plane - ray.origin[found.axis]) * (1.0 / d);
  return hit.t <= max_t;
}

// What a single ray's walk comes to, in double precision. Included after trace/single.inl.

inline double distance_of(const TreeView& tree, const Ray& ray, const SingleHit& found) {
  const double d = ray.direction[found.axis];
  const double plane = found.voxel[found.axis] + tree.origin[found.axis] + (d > 0.0 ? 0.0 : 1.0);
  return (plane - ray.origin[found.axis]) * (1.0 / d);
}

inline bool first_single(const TreeView& tree, const Ray& ray, double max_t, RayHit& hit, bool& unfinished) {
  const SingleHit found = trace_one<Ask::Where>(tree, ray, max_t);
  unfinished = found.is_unfinished;
  if (!found.is_hit) return false;
  hit.voxel = found.voxel + IVec3(tree.origin);
  hit.starts_inside = found.axis < 0;
  hit.t = hit.starts_inside ? 0.0 : distance_of(tree, ray, found);
  if (!hit.starts_inside) hit.face = static_cast<Direction>(2 * found.axis + (ray.direction[found.axis] > 0.0 ? 1 : 0));
  return hit.t <= max_t;
}

inline bool any_single(const TreeView& tree, const Ray& ray, double max_t, bool& unfinished) {
  if (max_t == std::numeric_limits<double>::infinity()) {
    const SingleHit found = trace_one<Ask::Whether>(tree, ray, max_t);
    unfinished = found.is_unfinished;
    return found.is_hit;
  }
  const SingleHit found = trace_one<Ask::Where>(tree, ray, max_t);
  unfinished = found.is_unfinished;
  return found.is_hit && (found.axis < 0 ? 0.0 : distance_of(tree, ray, found)) <= max_t;
}

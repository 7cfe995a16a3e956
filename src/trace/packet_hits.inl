// What packets of rays come to, in double precision. Included once for each instruction set, within its namespace,
// after the file that has `trace`.

inline void keep(const Met& met, int first, LaneHits& out) {
  out.hit |= bits(met.hit) << first;
  out.starts_inside |= bits(met.inside) << first;
  store(out.x.data() + first, met.x);
  store(out.y.data() + first, met.y);
  store(out.z.data() + first, met.z);
  store(out.axis.data() + first, met.axis);
}

inline void trace_packet(const TreeView& tree, const RayPacket& rays, LaneHits& out) {
  for (int first = 0; first < RayPacket::kSize; first += kWidth) {
    const std::uint32_t wanted = rays.active >> first & kAllLanes;
    if (wanted == 0) continue;
    F t;
    Crossing entered;
    Lanes lanes = set_up(tree, rays, first, wanted, t, entered);
    if (any(lanes.live)) keep(trace(tree, lanes, t, entered), first, out);
    out.unfinished |= bits(lanes.unfinished) << first;
  }
  out.unfinished &= ~out.hit;
}

// The distances of the faces met, in double precision, and which of them lie within reach.
inline std::uint32_t measure(const TreeView& tree, const RayPacket& rays, const LaneHits& lanes, double* t) {
  alignas(64) std::int64_t is_within[RayPacket::kSize];
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    const bool is_x = lanes.axis[i] == 0;
    const bool is_y = lanes.axis[i] == 1;
    const double direction = is_x ? rays.direction_x[i] : is_y ? rays.direction_y[i] : rays.direction_z[i];
    const double origin = is_x ? rays.origin_x[i] : is_y ? rays.origin_y[i] : rays.origin_z[i];
    const double corner = is_x ? tree.origin.x : is_y ? tree.origin.y : tree.origin.z;
    const std::int32_t voxel = is_x ? lanes.x[i] : is_y ? lanes.y[i] : lanes.z[i];
    const double plane = voxel + corner + (direction > 0.0 ? 0.0 : 1.0);
    const double inside = (lanes.starts_inside >> i & 1U) != 0 ? 0.0 : 1.0;
    const double distance = (plane - origin) * (1.0 / direction);
    t[i] = inside != 0.0 ? distance : 0.0;
    is_within[i] = t[i] <= rays.max_t[i] ? 1 : 0;
  }
  std::uint32_t within = 0;
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) within |= static_cast<std::uint32_t>(is_within[i]) << i;
  return within & lanes.hit;
}

inline void trace_first(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished) {
  LaneHits lanes;
  trace_packet(tree, rays, lanes);
  hits.hit = measure(tree, rays, lanes, hits.t.data());
  hits.starts_inside = lanes.starts_inside & hits.hit;
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    hits.x[i] = lanes.x[i] + static_cast<std::int32_t>(tree.origin.x);
    hits.y[i] = lanes.y[i] + static_cast<std::int32_t>(tree.origin.y);
    hits.z[i] = lanes.z[i] + static_cast<std::int32_t>(tree.origin.z);
    const double d = lanes.axis[i] == 0   ? rays.direction_x[i]
                     : lanes.axis[i] == 1 ? rays.direction_y[i]
                                          : rays.direction_z[i];
    hits.face[i] = static_cast<Direction>(2 * lanes.axis[i] + (d > 0.0 ? 1 : 0));
  }
  unfinished = lanes.unfinished;
}

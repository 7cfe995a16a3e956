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
    if (any(lanes.live)) keep(trace<Ask::Where>(tree, lanes, t, entered), first, out);
    out.unfinished |= bits(lanes.unfinished) << first;
  }
  out.unfinished &= ~out.hit;
}

// Lanes in double precision, as many as a register holds.
using Doubles = double __attribute__((vector_size(kDoubles * 8)));
using Longs = std::int64_t __attribute__((vector_size(kDoubles * 8)));
using Ints = std::int32_t __attribute__((vector_size(kDoubles * 4)));

template <class Vector, class T>
inline Vector lanes_at(const RayPacket::Lanes<T>& from, std::size_t first) {
  Vector out;
  std::memcpy(&out, from.data() + first, sizeof out);
  return out;
}

// The distances of the faces met by the lanes from `first` on, in double precision, and which way rays go through them,
// 1 where forward; answers the lanes within reach.
inline std::uint32_t measure_some(const TreeView& tree, const RayPacket& rays, const LaneHits& lanes, std::size_t first,
                                  RayPacket::Lanes<double>& t, RayPacket::Lanes<std::int32_t>& forward) {
  const Longs axis = __builtin_convertvector(lanes_at<Ints>(lanes.axis, first), Longs);
  const Longs is_x = axis == 0;
  const Longs is_y = axis == 1;
  const auto of_axis = [&](const auto& x, const auto& y, const auto& z) {
    const auto y_or_z = is_y ? lanes_at<Doubles>(y, first) : lanes_at<Doubles>(z, first);
    return is_x ? lanes_at<Doubles>(x, first) : y_or_z;
  };
  const auto to_grid = [&](const RayPacket::Lanes<std::int32_t>& at, double origin) {
    return __builtin_convertvector(lanes_at<Ints>(at, first), Doubles) + origin;
  };
  const Doubles y_or_z = is_y ? to_grid(lanes.y, tree.origin.y) : to_grid(lanes.z, tree.origin.z);
  const Doubles lower = is_x ? to_grid(lanes.x, tree.origin.x) : y_or_z;
  const Doubles direction = of_axis(rays.direction_x, rays.direction_y, rays.direction_z);
  const Longs is_forward = direction > 0.0;
  const Doubles plane = lower + (is_forward ? Doubles{} : Doubles{} + 1.0);
  const Doubles distance = (plane - of_axis(rays.origin_x, rays.origin_y, rays.origin_z)) * (1.0 / direction);
  Longs lane;
  for (std::size_t i = 0; i < kDoubles; ++i) lane[i] = std::int64_t{1} << i;
  const Longs inside = (lane & static_cast<std::int64_t>(lanes.starts_inside >> first)) != 0;
  const Doubles result = inside ? Doubles{} : distance;
  std::memcpy(t.data() + first, &result, sizeof result);
  const Ints ones = __builtin_convertvector(-is_forward, Ints);
  std::memcpy(forward.data() + first, &ones, sizeof ones);
  const Longs within = lane & (result <= lanes_at<Doubles>(rays.max_t, first));
  std::int64_t bits = 0;
  for (std::size_t i = 0; i < kDoubles; ++i) bits |= within[i];
  return static_cast<std::uint32_t>(bits) << first;
}

inline std::uint32_t measure(const TreeView& tree, const RayPacket& rays, const LaneHits& lanes,
                             RayPacket::Lanes<double>& t, RayPacket::Lanes<std::int32_t>& forward) {
  std::uint32_t within = 0;
  for (std::size_t first = 0; first < RayPacket::kSize; first += kDoubles) {
    within |= measure_some(tree, rays, lanes, first, t, forward);
  }
  return within & lanes.hit;
}

inline void trace_first(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished) {
  LaneHits lanes;
  trace_packet(tree, rays, lanes);
  unfinished = lanes.unfinished;
  if (lanes.hit == 0) {
    hits.hit = hits.starts_inside = 0;
    return;
  }
  RayPacket::Lanes<std::int32_t> forward;
  hits.hit = measure(tree, rays, lanes, hits.t, forward);
  hits.starts_inside = lanes.starts_inside & hits.hit;
  const IVec3 corner(tree.origin);
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    hits.x[i] = lanes.x[i] + corner.x;
    hits.y[i] = lanes.y[i] + corner.y;
    hits.z[i] = lanes.z[i] + corner.z;
    hits.face[i] = static_cast<Direction>(2 * lanes.axis[i] + forward[i]);
  }
}

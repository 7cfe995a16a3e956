// The kernel of impostor_raster.h for lanes of any width. Included within a namespace and a target region, after lanes.

constexpr std::size_t kLanes = kWidth;
constexpr float kMargin = 0.01F;  // pixels: for rounding
constexpr std::uint32_t kAllLanes = kWidth == 32 ? ~0U : (1U << kWidth) - 1U;

// The pixels' rays. Numbers of blocks in which nothing may show are not set.
struct Pixels {
  alignas(64) float point[3][kPixels];
  alignas(64) float direction[3][kPixels];
  alignas(64) float inverse[kPixels];  // 1 / direction along the axis of the faces being drawn; where they face away
                                       // it is not a number
};

// What is the same for all faces of one direction.
struct Side {
  int axis;
  int u;
  int v;
  float sign;
  Vector half;  // from a face's middle to its edges
  // No smaller than what a ray may miss the edge by for rounding.
  float reach;
};

struct Areas {
  alignas(64) std::int32_t left[kLanes];
  alignas(64) std::int32_t top[kLanes];
  alignas(64) std::int32_t right[kLanes];  // inclusive
  alignas(64) std::int32_t bottom[kLanes];
  std::uint32_t shown;
};

template <class Visit>
inline void for_each_block(const Job& job, Visit visit) {
  for (int y = job.top / kBlock; y <= (job.bottom - 1) / kBlock; ++y) {
    for (int x = job.left / kBlock; x <= (job.right - 1) / kBlock; ++x) visit(x, y);
  }
}

inline F linear(const LinearVector& vector, std::size_t axis, F x, F y) {
  return all(vector.at[axis]) + all(vector.x[axis]) * x + all(vector.y[axis]) * y;
}

void set_up(const Job& job, Pixels& pixels) {
  alignas(64) float lane_x[16];
  alignas(64) float lane_y[16];
  for (int i = 0; i < 16; ++i) {
    lane_x[i] = static_cast<float>(i % kBlock);
    lane_y[i] = static_cast<float>(i / kBlock);
  }
  for_each_block(job, [&](int block_x, int block_y) {
    const std::size_t first = index_of(block_x * kBlock, block_y * kBlock);
    for (std::size_t i = 0; i < 16; i += kLanes) {
      const F x = load(lane_x + i) + all(static_cast<float>(block_x * kBlock));
      const F y = load(lane_y + i) + all(static_cast<float>(block_y * kBlock));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        store(pixels.point[axis] + first + i, linear(job.point, axis, x, y));
        store(pixels.direction[axis] + first + i, linear(job.direction, axis, x, y));
      }
    }
  });
}

// Whether any ray meets these faces from in front.
bool turn_to(const Job& job, const Side& side, Pixels& pixels) {
  bool is_seen = false;
  const F nothing = all(std::numeric_limits<float>::quiet_NaN());
  for_each_block(job, [&](int block_x, int block_y) {
    const std::size_t first = index_of(block_x * kBlock, block_y * kBlock);
    for (std::size_t i = first; i < first + 16; i += kLanes) {
      const F direction = load(pixels.direction[side.axis] + i);
      const Mask faces = direction * all(side.sign) < all(0.0F);
      store(pixels.inverse + i, select(faces, all(1.0F) / direction, nothing));
      is_seen |= any(faces);
    }
  });
  return is_seen;
}

// The pixels that boxes around `q` may show in: never fewer than they do.
inline void project(const Job& job, const F (&q)[3], const F (&half)[3], Areas& areas) {
  const auto dot = [&](const Vector& by) { return all(by[0]) * q[0] + all(by[1]) * q[1] + all(by[2]) * q[2]; };
  const F ahead = dot(job.ahead) + all(job.ahead_at);
  const F inverse = all(1.0F) / ahead;
  const F column = (dot(job.across) + all(job.across_at)) * inverse;
  const F row = (dot(job.down) + all(job.down_at)) * inverse;
  F deep = all(0.0F);
  F wide = all(0.0F);
  F high = all(0.0F);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const F forward = all(job.ahead[axis]);
    deep = deep + half[axis] * abs(forward);
    wide = wide + half[axis] * abs(all(job.across[axis]) - column * forward);
    high = high + half[axis] * abs(all(job.down[axis]) - row * forward);
  }
  // Boxes that reach to the camera's plane may show anywhere.
  const F nearest = ahead - deep;
  const Mask is_before = all(0.01F) * ahead < nearest;
  const F scale = all(1.0F) / nearest;
  const auto low = [&](F middle, F size, float at, int least) {
    const F value = all(0.0F) - floor(all(0.0F) - (middle - size * scale + all(at - kMargin)));
    return select(is_before, min(max(value, all(static_cast<float>(least))), all(64.0F)), all(static_cast<float>(least)));
  };
  const auto high_of = [&](F middle, F size, float at, int most) {
    const F value = floor(middle + size * scale + all(at + kMargin));
    return select(is_before, max(min(value, all(static_cast<float>(most))), all(-64.0F)), all(static_cast<float>(most)));
  };
  const F left = low(column, wide, job.column_at, job.left);
  const F top = low(row, high, job.row_at, job.top);
  const F right = high_of(column, wide, job.column_at, job.right - 1);
  const F bottom = high_of(row, high, job.row_at, job.bottom - 1);
  areas.shown = bits((left <= right) & (top <= bottom) & (all(0.0F) < ahead + deep));
  store(areas.left, to_int(left)), store(areas.top, to_int(top));
  store(areas.right, to_int(right)), store(areas.bottom, to_int(bottom));
}

// One face, in the blocks of pixels where it may show.
inline void draw_face(const Job& job, const Side& side, const Pixels& pixels, std::size_t at, const Areas& areas,
                      std::size_t lane, Canvas& canvas) {
  const auto axis = static_cast<std::size_t>(side.axis);
  const auto u = static_cast<std::size_t>(side.u);
  const auto v = static_cast<std::size_t>(side.v);
  const ImpostorFaces::Level& level = *job.level;
  const F plane = all(level.centre[axis][at]);
  const F middle_u = all(level.centre[u][at]);
  const F middle_v = all(level.centre[v][at]);
  const F reach = all(side.reach);
  const F depth_at = all(job.depth_at);
  const F depth_step = all(job.depth_step);
  const I id = all(job.id);
  const I face = all(static_cast<int>(level.face[at]));
  for (int y = areas.top[lane] / kBlock; y <= areas.bottom[lane] / kBlock; ++y) {
    for (int x = areas.left[lane] / kBlock; x <= areas.right[lane] / kBlock; ++x) {
      const std::size_t first = index_of(x * kBlock, y * kBlock);
      for (std::size_t i = first; i < first + 16; i += kLanes) {
        const F along = (plane - load(pixels.point[axis] + i)) * load(pixels.inverse + i);
        const F at_u = load(pixels.point[u] + i) + along * load(pixels.direction[u] + i);
        const F at_v = load(pixels.point[v] + i) + along * load(pixels.direction[v] + i);
        const F depth = depth_at + along * depth_step;
        const F nearest = load(canvas.depth.data() + i);
        const I nearest_id = load(canvas.id.data() + i);
        const Mask is_nearer = (depth < nearest) | ((depth == nearest) & (id < nearest_id));
        const Mask met =
            (abs(at_u - middle_u) <= reach) & (abs(at_v - middle_v) <= reach) & is_nearer & (all(0.0F) < depth);
        if (!any(met)) continue;
        store(canvas.depth.data() + i, select(met, depth, nearest));
        store(canvas.id.data() + i, select(met, id, nearest_id));
        store(canvas.face.data() + i, select(met, face, load(canvas.face.data() + i)));
      }
    }
  }
}

void draw_group(const Job& job, const Side& side, const Pixels& pixels, std::size_t begin, Canvas& canvas) {
  const ImpostorFaces::Level& level = *job.level;
  const F half[3] = {all(side.half[0]), all(side.half[1]), all(side.half[2])};
  Areas areas;
  for (std::size_t first = begin; first < begin + ImpostorFaces::kGroup; first += kLanes) {
    const F q[3] = {load(level.centre[0].data() + first), load(level.centre[1].data() + first),
                    load(level.centre[2].data() + first)};
    project(job, q, half, areas);
    const auto* views = reinterpret_cast<const std::int32_t*>(level.views.data() + first);
    areas.shown &= bits(test(load(views), all(static_cast<int>(job.views))));
    for (std::uint32_t left = areas.shown; left != 0; left &= left - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(left));
      draw_face(job, side, pixels, first + lane, areas, lane, canvas);
    }
  }
}

// Whether what is there is nearer than `depth` in all blocks of an area.
inline bool is_hidden(const Areas& areas, std::size_t lane, float depth, const Canvas& canvas) {
  for (int y = areas.top[lane] / kBlock; y <= areas.bottom[lane] / kBlock; ++y) {
    for (int x = areas.left[lane] / kBlock; x <= areas.right[lane] / kBlock; ++x) {
      if (!(canvas.furthest[static_cast<std::size_t>(y * (kTile / kBlock) + x)] < depth)) return false;
    }
  }
  return true;
}

void draw_side(const Job& job, const Side& side, const Pixels& pixels, std::size_t begin, std::size_t end,
               Canvas& canvas) {
  const ImpostorFaces::Groups& groups = job.level->groups;
  Areas areas;
  alignas(64) float least[kLanes];  // depth
  for (std::size_t first = begin; first < end; first += kLanes) {
    F q[3];
    F half[3];
    F near = all(0.0F);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      q[axis] = load(groups.centre[axis].data() + first);
      half[axis] = load(groups.half[axis].data() + first);
      near = near + q[axis] * all(job.forward[axis]) - half[axis] * abs(all(job.forward[axis]));
    }
    store(least, near * all(job.depth_step) + all(job.depth_at));
    project(job, q, half, areas);
    if (end - first < kLanes) areas.shown &= (1U << (end - first)) - 1U;
    for (std::uint32_t left = areas.shown; left != 0; left &= left - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(left));
      if ((groups.views[first + lane] & job.views) == 0 || is_hidden(areas, lane, least[lane], canvas)) continue;
      draw_group(job, side, pixels, (first + lane) * ImpostorFaces::kGroup, canvas);
    }
  }
}

void find_furthest(const Job& job, Canvas& canvas) {
  for_each_block(job, [&](int x, int y) {
    const std::size_t first = index_of(x * kBlock, y * kBlock);
    F most = load(canvas.depth.data() + first);
    for (std::size_t i = kLanes; i < 16; i += kLanes) most = max(most, load(canvas.depth.data() + first + i));
    canvas.furthest[first / 16] = greatest_of(most);
  });
}

void draw_faces(const Job& job, Canvas& canvas) {
  Pixels pixels;
  set_up(job, pixels);
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t begin = job.level->begin[i] / ImpostorFaces::kGroup;
    const std::size_t end = job.level->begin[i + 1] / ImpostorFaces::kGroup;
    if (begin == end) continue;
    const FaceFrame& frame = kFaceFrames[i];
    Side side{frame.axis, frame.u, frame.v, static_cast<float>(frame.sign), {}, job.level->half};
    side.half.fill(side.reach);
    side.half[frame.axis] = 0.0F;
    // Two faces that share an edge meet at slightly different points of it.
    side.reach += 1e-5F + 2e-6F * job.level->size;
    if (turn_to(job, side, pixels)) draw_side(job, side, pixels, begin, end, canvas);
  }
  find_furthest(job, canvas);
}

// One ray, from chunk to chunk. Within a chunk all its bricks that the ray passes are found at once, as bits in the
// order in which it passes them; likewise the cells of a brick and the voxels of a cell. Where they and what is
// occupied have bits in common, the lowest is next. The same answers as trace_single in trace/single.inl. Included
// after trace/path_ray.inl and a file that has the class Paths.

class PathWalk {
 public:
  PathWalk(const TreeView& tree, const PathRay& ray)
      : chunk_(Paths::block(ray.chunk)),
        paths_(ray, ray.exit_t * 1.001F + 1e-6F),
        mirrored_(mask3(ray.backward)),
        tree_(tree),
        ray_(ray),
        flip_(flip_of(mask3(ray.backward))) {
    const F4 upper = ray.chunk + kChunkSize;
    const F4 t = (upper - ray.origin) * ray.inverse;
    const F4 native = mirrored_planes(ray.backward ? upper : ray.chunk, ray.backward);
    const I4 place = (__builtin_convertvector(native, I4) + ray.base) >> 6;
    I4 strides;
    std::memcpy(&strides, tree.chunk_strides, sizeof strides);
    const I4 steps = (strides ^ ray.backward) - ray.backward;
    plane_[0] = upper[0], plane_[1] = upper[1], plane_[2] = upper[2];
    t_[0] = t[0], t_[1] = t[1], t_[2] = t[2];
    stride_[0] = steps[0], stride_[1] = steps[1], stride_[2] = steps[2];
    index_ = place[0] + place[1] * strides[1] + place[2] * strides[2];
  }

  template <Ask kAsk>
  [[gnu::always_inline]] SingleHit find() {
    std::uint64_t allowed = ~std::uint64_t{0};
    std::uint64_t bricks = 0;
    std::uint64_t cells = 0;
    int brick = 0;
    auto block = chunk_;
    if (ray_.is_inside) {
      // From the voxel in which it starts: mostly what it meets is near.
      const Own own = own_units();
      brick = own.brick;
      block = Paths::brick_of(chunk_, brick);
      if (is_set(tree_.chunks[index_].bricks, brick)) {
        if (is_set(node().cells[static_cast<std::size_t>(brick ^ flip_)], own.cell)) {
          const std::uint64_t met = voxels_of(block, brick, own.cell) & kUnits.from[own.voxel];
          if (met != 0) return hit<kAsk>(brick, own.cell, met);
        }
        cells = cells_of(brick) & kUnits.from[own.cell] & ~(std::uint64_t{1} << own.cell);
      }
      allowed = kUnits.from[brick] & ~(std::uint64_t{1} << brick);
    }
    for (bool is_known = false;; is_known = true) {
      for (; cells != 0; cells &= cells - 1) {
        const int cell = std::countr_zero(cells);
        const std::uint64_t met = voxels_of(block, brick, cell);
        if (met != 0) return hit<kAsk>(brick, cell, met);
      }
      while (bricks == 0) {
        if (is_known && !advance()) return {false, ray_.is_cut, -1, IVec3{0}};
        is_known = true;
        bricks = bricks_of_chunk() & allowed;
        allowed = ~std::uint64_t{0};
      }
      brick = std::countr_zero(bricks);
      bricks &= bricks - 1;
      cells = cells_of(brick);
      block = Paths::brick_of(chunk_, brick);
    }
  }

 private:
  // The units in which a ray starts, mirrored.
  struct Own {
    int brick, cell, voxel;
  };
  [[nodiscard]] Own own_units() const {
    const I4 own = ray_.own ^ (ray_.backward & 63);
    return {(own[0] >> 4) + (own[1] >> 4) * 4 + (own[2] >> 4) * 16,
            (own[0] >> 2 & 3) + (own[1] & 12) + (own[2] & 12) * 4, (own[0] & 3) + (own[1] & 3) * 4 + (own[2] & 3) * 16};
  }
  [[nodiscard]] bool is_set(std::uint64_t word, int unit) const { return (word >> (unit ^ flip_) & 1U) != 0; }
  [[nodiscard]] std::uint64_t bits_of_bricks() const { return mirrored_(&tree_.chunks[index_].bricks); }
  [[nodiscard]] const OccupancyTree::ChunkNode& node() const { return *tree_.chunks[index_].node; }
  [[nodiscard]] std::uint64_t bricks_of_chunk() const {
    return tree_.chunks[index_].bricks == 0 ? 0 : paths_.bricks(chunk_) & bits_of_bricks();
  }
  [[nodiscard]] std::uint64_t cells_of(int brick) const {
    return paths_.cells(chunk_, brick) & mirrored_(&node().cells[static_cast<std::size_t>(brick ^ flip_)]);
  }
  [[nodiscard]] std::uint64_t voxels_of(const Paths::Block& block, int brick, int cell) const {
    const OccupancyTree::Node& words = tree_.nodes[node().bricks[static_cast<std::size_t>(brick ^ flip_)]];
    return paths_.voxels(block, cell) & mirrored_(&words[static_cast<std::size_t>(cell ^ flip_)]);
  }

  // Into the next chunk; false when the ray has left its box.
  [[gnu::always_inline]] bool advance() {
    if (t_[0] <= t_[1] && t_[0] <= t_[2]) return cross<0>();
    return t_[1] <= t_[2] ? cross<1>() : cross<2>();
  }
  template <int kAxis>
  [[gnu::always_inline]] bool cross() {
    const float now = t_[kAxis];
    plane_[kAxis] += kChunkSize;
    t_[kAxis] = (plane_[kAxis] - ray_.origin[kAxis]) * ray_.inverse[kAxis];
    index_ += stride_[kAxis];
    chunk_ = Paths::next_chunk<kAxis>(chunk_);
    if (now < ray_.exit_t) return true;
    // At a tie the axis on which it leaves may come later.
    const int exit_axis = std::countr_zero(static_cast<std::uint32_t>(mask3(ray_.far_t == all4(ray_.exit_t))));
    return now == ray_.exit_t && kAxis < exit_axis;
  }

  template <Ask kAsk>
  [[gnu::always_inline]] SingleHit hit(int brick, int cell, std::uint64_t voxels) const {
    const F4 lower = F4{plane_[0], plane_[1], plane_[2], 0.0F} - kChunkSize;
    const F4 in_cell = lower + corner_of(brick) * 16.0F + corner_of(cell) * 4.0F;
    // What lies further than single precision serves is left to others.
    if (ray_.is_cut && greatest3((in_cell - ray_.origin) * ray_.inverse) > ray_.exit_t)
      return {false, true, -1, IVec3{0}};
    if (kAsk == Ask::Whether) return {true, false, -1, IVec3{0}};
    const F4 voxel = in_cell + corner_of(std::countr_zero(voxels));
    const F4 nudge = ray_.is_on_plane ? (ray_.forward ? all4(kNudge) : all4(0.0F)) : all4(0.0F);
    // It came in through the last of its lower planes, at a tie that of the later axis.
    const F4 t = (voxel - ray_.origin) * ray_.inverse - nudge;
    const float last = greatest3(t);
    const int axis = last < 0.0F ? -1 : t[2] == last ? 2 : t[1] == last ? 1 : 0;
    const F4 native = mirrored_planes(ray_.backward ? voxel + 1.0F : voxel, ray_.backward);
    const I4 at = __builtin_convertvector(native, I4) + ray_.base;
    return {true, false, axis, IVec3{at[0], at[1], at[2]}};
  }

  Paths::Block chunk_;
  Paths paths_;
  Mirror mirrored_;
  const TreeView& tree_;
  const PathRay& ray_;
  int flip_;  // from a mirrored unit to the unit
  int index_;
  float plane_[3];  // through which it leaves the chunk
  float t_[3];
  int stride_[3];
};

template <Ask kAsk>
[[gnu::always_inline]] inline SingleHit trace_one(const TreeView& tree, const Ray& ray, double max_t) {
  PathRay path;
  const SetUp ready = set_up_path(tree, ray, max_t, path);
  if (ready != SetUp::Ready) return {false, ready == SetUp::Unusual, -1, IVec3{0}};
  return PathWalk(tree, path).find<kAsk>();
}

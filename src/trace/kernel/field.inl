// One ray in a field of densities: the walk of trace/kernel/single.inl through cells that touch the solid. These are
// gathered, then eight at once are asked whether the field in them may become negative along the ray; of those, in
// order, where it does.
//
//   walk    ..X. .... .XX. X...    words of 4^3 cells, with those that touch the solid and that the ray passes
//   group   | X | X | X | X |      in lanes, see below
//   asked   | . | . | 1 | 1 |      the third: from where on; else the fourth; else the walk goes on

#pragma once

#include <limits>

#include <immintrin.h>

#include "trace/kernel/cell.inl"
#include "trace/kernel/field_cells.inl"
#include "trace/kernel/kernel.h"
#include "trace/kernel/lockstep.inl"
#include "trace/kernel/single.inl"

namespace quoin::trace {
namespace {

// One ray.

constexpr int kGroup = 8;

// `base`: from where the walk counts, in the field.
inline NearRay<float> near_ray(const PathRay& path, const Ray& ray, I4 base) {
  NearRay<float> out;
  out.size = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_back = path.backward[axis] != 0;
    const bool is_still = path.inverse[axis] == kStillInverse;
    // The walk has them in the middle of a voxel where they stand still.
    out.origin[axis] = is_still  ? static_cast<float>(ray.origin[axis] - base[axis])
                       : is_back ? -path.origin[axis]
                                 : path.origin[axis];
    out.direction[axis] = is_still ? 0.0F : static_cast<float>(ray.direction[axis]);
    out.inverse[axis] = is_back ? -path.inverse[axis] : path.inverse[axis];
    out.entry[axis] = is_back ? 1.0F + kStretch : -kStretch;
    out.exit[axis] = is_back ? -kStretch : 1.0F + kStretch;
    out.size = std::max(out.size, std::abs(out.direction[axis]));
  }
  return out;
}

// The next cells of a ray that touch the solid.
class CellGroup {
 public:
  /// `base`: from where the walk counts, in the field.
  CellGroup(const FieldView& field, const Ray& ray, double max_t, const PathRay& path, I4 base)
      : field_(field), ray_(cell_ray(ray, max_t)), near_(near_ray(path, ray, base)) {
    for (int axis = 0; axis < 3; ++axis) backward_[axis] = path.backward[axis], base_[axis] = base[axis];
  }

  [[nodiscard]] bool is_empty() const { return count_ == 0; }
  [[nodiscard]] bool is_full() const { return count_ >= kGroup; }

  /// Cells of a word; `at` is the one of the word that the ray could pass first.
  /// Requires: the group is not full.
  void add(I4 at, std::uint64_t cells) {
    for (int axis = 0; axis < 3; ++axis) words_[axis][word_count_] = at[axis];
    for (; cells != 0; cells &= cells - 1) codes_[count_++] = word_count_ << 6 | std::countr_zero(cells);
    ++word_count_;
  }

  /// Asks all cells, and forgets them.
  template <bool kAsksWhere>
  bool ask(FieldHit& hit) {
    const int count = count_;
    count_ = word_count_ = 0;
    for (int first = 0; first < count; first += kGroup) {
      if (ask_some<kAsksWhere>(first, std::min(count - first, kGroup), hit)) return true;
    }
    return false;
  }

 private:
  // `count` cells from `first` on, of eight at most.
  template <bool kAsksWhere>
  [[gnu::always_inline]] bool ask_some(int first, int count, FieldHit& hit) {
    I8 code;
    std::memcpy(&code, codes_ + first, sizeof code);
    Candidates<kGroup> cells;
    for (int axis = 0; axis < 3; ++axis) {
      const I8 in_word = ((code >> 2 * axis & 3) ^ backward_[axis]) - backward_[axis];
      cells.at[axis] = from_16(words_[axis], code >> 6) + in_word;
    }
    screen(field_, last_, near_, base_, (1U << count) - 1U, cells);
    for (std::uint32_t left = cells.lanes; left != 0; left &= left - 1) {
      cells.describe(std::countr_zero(left), hit);
      if (meets<kAsksWhere>(ray_, hit)) return true;
    }
    return false;
  }

  const FieldView& field_;
  CellRay ray_;
  NearRay<float> near_;
  LastChunk last_;
  std::int32_t backward_[3];
  std::int32_t base_[3];
  int count_ = 0;
  int word_count_ = 0;
  alignas(64) std::int32_t words_[3][16];            // where words begin, by axis; those of the group alone
  alignas(32) std::int32_t codes_[64 + 2 * kGroup];  // cells: which word, six bits of which of its cells
};

template <bool kAsksWhere>
inline bool first_in_field(const FieldView& field, const Ray& ray, double max_t, FieldHit& hit, bool& unfinished) {
  const TreeView& tree = *field.cells;
  unfinished = false;
  PathRay path;
  const SetUp ready = set_up_path(tree, ray, max_t, path);
  if (ready != SetUp::Ready) {
    unfinished = ready == SetUp::Unusual;
    return false;
  }
  const I4 origin = {static_cast<int>(tree.origin.x), static_cast<int>(tree.origin.y), static_cast<int>(tree.origin.z),
                     0};
  unfinished = path.is_cut;
  CellGroup group(field, ray, max_t, path, path.base + origin);
  bool is_hit = false;
  PathWalk walk(tree, path);
  walk.walk([&](int brick, int cell, std::uint64_t met) {
    const F4 in_cell = walk.corner_of_cell(brick, cell);
    if (walk.is_too_far(in_cell)) return unfinished = true;
    group.add(walk.native_voxel(in_cell) + origin, met);
    return (kAsksWhere || group.is_full()) && (is_hit = group.ask<kAsksWhere>(hit));
  });
  if (!is_hit && !group.is_empty()) is_hit = group.ask<kAsksWhere>(hit);
  if (is_hit) unfinished = false;
  return is_hit;
}

// Packets of rays in a field of densities: the walk of trace/kernel/lockstep.inl through cells that touch the solid.
// Lanes go on through such cells without waiting for an answer: the cells go onto a list, and as many as registers hold
// are asked at once whether the field in them may become negative along their ray, and of those each alone where it
// does. Lanes in which it does stop.
//
//   lane          | 0 | 1 | 2 | ... | 15 |
//   stands in     | A | . | B | ... |  C |    a cell that touches the solid, or not
//   then in       | D | E | . | ... |  . |
//
//   list          | A | B | C | D | E | ...    with the lane of each; those of a lane in the order in which it comes there
//   may           | x |   | x |   |   | ...    in single precision
//   met           | x |   |   |   |   | ...    in double, cell by cell: hits[lane] has t, cell and corners
//
// Asked where rays hit, a list is asked to its end before lanes leave their words of 4^3 cells, so that lanes do not go
// far beyond a hit.

// The lanes of a packet from `first_` on, as the cells of a field see them.
template <bool kAsksWhere>
class FieldLanes {
 public:
  /// `hits`: of the packet's lanes; not written where kAsksWhere is false.
  FieldLanes(const FieldView& field, const RayPacket& rays, int first, const Lanes& lanes, FieldHit* hits)
      : field_(field), rays_(rays), first_(first), hits_(hits) {
    const IVec3 origin(field.cells->origin);
    set_axis(lanes.x, 0, origin.x);
    set_axis(lanes.y, 1, origin.y);
    set_axis(lanes.z, 2, origin.z);
    store(size_, lanes.reach_scale);
    std::int32_t lane[kWidth];
    for (int i = 0; i < kWidth; ++i) lane[i] = i;
    lane_numbers_ = load(lane);
  }

  /// Takes the lanes of `walking` through the cells of a word, which begin at `word`; returns all lanes that are known
  /// to have come into the solid.
  Mask walk(const Lanes& lanes, const VoxelSteps& steps, const Cells& word, VoxelWalk& voxels, Mask walking) {
    while (any(walking)) {
      const I half = select(test(voxels.code, all(32)), voxels.high_half, voxels.low_half);
      const Mask touching = test_bit(half, voxels.code) & walking;
      if (any(touching)) {
        add(touching, voxels_at(word, voxels.code));
        if (count_ >= kCellsAtOnce) walking = walking & ~ask(kCellsAtOnce);
      }
      Crossing crossing;
      cross_next(lanes, steps.one, voxels.nexts, crossing);
      voxels.code = stepped(voxels.code, crossing, steps.strides);
      walking = walking & ~test(voxels.code, all(kLeft));
    }
    return kAsksWhere ? ask(1) : mask_of(met_);
  }

  /// Asks what is left of the list.
  Mask finish() { return ask(1); }

 private:
  void set_axis(const Axis& axis, int index, int origin) {
    origin_[index] = origin;
    store(base_[index], axis.base + all(origin));
    store(rays_near_.origin[index], axis.origin);
    store(rays_near_.direction[index], axis.direction);
    store(rays_near_.inverse[index], select(axis.still, all(kNever), axis.inverse));
    const Mask is_back = ~(axis.forward | axis.still);
    store(rays_near_.entry[index], select(is_back, all(1.0F + kStretch), all(-kStretch)));
    store(rays_near_.exit[index], select(is_back, all(-kStretch), all(1.0F + kStretch)));
  }

  void add(Mask which, const Cells& cells) {
    const Packing packing = packing_of(which);
    store_packed(lane_ + count_, packing, lane_numbers_);
    store_packed(at_[0] + count_, packing, cells.x + all(origin_[0]));
    store_packed(at_[1] + count_, packing, cells.y + all(origin_[1]));
    store_packed(at_[2] + count_, packing, cells.z + all(origin_[2]));
    count_ += std::popcount(bits(which));
  }

  // Asks as long as there are that many cells; returns all lanes that are known to have come into the solid.
  Mask ask(int least_count) {
    int first = 0;
    for (; count_ - first >= least_count; first += kCellsAtOnce) {
      ask_some(first, std::min(count_ - first, kCellsAtOnce));
    }
    count_ = std::max(count_ - first, 0);
    if (count_ != 0) {
      store(lane_, load(lane_ + first));
      for (std::int32_t* const at : {at_[0], at_[1], at_[2]}) store(at, load(at + first));
    }
    return mask_of(met_);
  }

  void ask_some(int first, int count) {
    using CellFloats = Floats<kCellsAtOnce>;
    using CellInts = Int32s<kCellsAtOnce>;
    CellInts lane;
    std::memcpy(&lane, lane_ + first, sizeof lane);
    lane &= kWidth - 1;  // what is beyond the end is not set
    Candidates<kCellsAtOnce> cells;
    CellInts base[3];
    NearRay<CellFloats> ray;
    const auto of_lane = [&](const float* from) {
      return reinterpret_cast<CellFloats>(from_16(reinterpret_cast<const std::int32_t*>(from), lane));
    };
    for (int axis = 0; axis < 3; ++axis) {
      std::memcpy(&cells.at[axis], at_[axis] + first, sizeof cells.at[axis]);
      base[axis] = from_16(base_[axis], lane);
      ray.origin[axis] = of_lane(rays_near_.origin[axis]);
      ray.direction[axis] = of_lane(rays_near_.direction[axis]);
      ray.inverse[axis] = of_lane(rays_near_.inverse[axis]);
      ray.entry[axis] = of_lane(rays_near_.entry[axis]);
      ray.exit[axis] = of_lane(rays_near_.exit[axis]);
    }
    ray.size = of_lane(size_);
    screen(field_, last_, ray, base, (1U << count) - 1U, cells);
    for (std::uint32_t left = cells.lanes; left != 0; left &= left - 1) {
      const int i = std::countr_zero(left);
      const int its_lane = lane_[first + i];
      if ((met_ >> its_lane & 1U) != 0) continue;
      FieldHit unused;
      FieldHit& hit = kAsksWhere ? hits_[first_ + its_lane] : unused;
      cells.describe(i, hit);
      if (meets<kAsksWhere>(ray_of(its_lane), hit)) met_ |= 1U << its_lane;
    }
  }

  const CellRay& ray_of(int lane) {
    if ((exact_ready_ >> lane & 1U) == 0) {
      exact_ready_ |= 1U << lane;
      const int i = first_ + lane;
      exact_[lane] = cell_ray(rays_.ray(i), rays_.max_t[static_cast<std::size_t>(i)]);
    }
    return exact_[lane];
  }

  struct NearRays {
    alignas(64) float origin[3][kWidth];
    alignas(64) float direction[3][kWidth];
    alignas(64) float inverse[3][kWidth];
    alignas(64) float entry[3][kWidth];
    alignas(64) float exit[3][kWidth];
  };

  const FieldView& field_;
  const RayPacket& rays_;
  int first_;
  FieldHit* hits_;
  int origin_[3];
  LastChunk last_;
  I lane_numbers_;
  NearRays rays_near_;
  alignas(64) float size_[kWidth];
  alignas(64) std::int32_t base_[3][kWidth];  // from where each lane counts, in the field
  // The list; as packing writes whole registers there is room for one more.
  int count_ = 0;
  alignas(64) std::int32_t lane_[3 * kWidth];
  alignas(64) std::int32_t at_[3][3 * kWidth];
  std::uint32_t met_ = 0;
  std::uint32_t exact_ready_ = 0;
  CellRay exact_[kWidth];
};

// The lanes that come into the solid; `unfinished` are to be traced otherwise.
template <bool kAsksWhere>
inline std::uint32_t packet_in_field(const FieldView& field, const RayPacket& rays, FieldHit* hits,
                                     std::uint32_t& unfinished) {
  const TreeView& tree = *field.cells;
  std::uint32_t hit = 0;
  unfinished = 0;
  for (int first = 0; first < RayPacket::kSize; first += kWidth) {
    const std::uint32_t wanted = rays.active >> first & kAllLanes;
    if (wanted == 0) continue;
    F t;
    Crossing entered;
    Lanes lanes = set_up(tree, rays, first, wanted, t, entered);
    unfinished |= bits(lanes.unfinished) << first;
    if (!any(lanes.live)) continue;
    FieldLanes<kAsksWhere> cells(field, rays, first, lanes, hits);
    const VoxelSteps steps = voxel_steps(lanes);
    walk_apart(tree, lanes, steps, t, entered, [&](const Cells& at, VoxelWalk& voxels, Mask found) {
      return cells.walk(lanes, steps, at, voxels, found);
    });
    const Mask met = cells.finish();
    hit |= bits(met) << first;
  }
  unfinished &= ~hit;
  return hit;
}

inline std::uint32_t first_hits_in_field(const FieldView& field, const RayPacket& rays, FieldHit* hits,
                                         std::uint32_t& unfinished) {
  return packet_in_field<true>(field, rays, hits, unfinished);
}

inline std::uint32_t any_hits_in_field(const FieldView& field, const RayPacket& rays, std::uint32_t& unfinished) {
  return packet_in_field<false>(field, rays, nullptr, unfinished);
}

}  // namespace
}  // namespace quoin::trace

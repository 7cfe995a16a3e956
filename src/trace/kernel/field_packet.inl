// Packets of rays in a field of densities: the walk of trace/kernel/lockstep.inl through cells that touch the solid.
// Where lanes have come to such a cell, all are asked at once whether the field in it may become negative along their
// ray (trace/kernel/field_cells.inl), and of those each alone where it does; lanes in which it does not walk on.
//
//   lane         | 0 | 1 | 2 | ... | 15 |
//   stopped      | x |   | x | ... |  x |    in a cell that touches the solid: x, y, z in cell_
//   may          | x |   |   | ... |  x |    in single precision, eight lanes (a half) and one chunk at a time
//   met          | x |   |   | ... |    |    in double, lane by lane: hits[lane] has t, cell and corners
//   walks on     |   |   | x | ... |  x |    to its next cell
//
// Where registers hold eight lanes (AVX2) a packet goes in two rounds of one half, else in one round of two.

#pragma once

#include "trace/kernel/field_cells.inl"
#include "trace/kernel/lockstep.inl"

namespace quoin::trace {
namespace {

// The lanes of a packet from `first_` on, as the cells of a field see them.
class FieldLanes {
 public:
  FieldLanes(const FieldView& field, const RayPacket& rays, int first, const Lanes& lanes)
      : field_(field), rays_(rays), first_(first) {
    const IVec3 origin(field.cells->origin);
    set_axis(lanes.x, 0, origin.x);
    set_axis(lanes.y, 1, origin.y);
    set_axis(lanes.z, 2, origin.z);
    alignas(64) float size[kWidth];
    store(size, lanes.reach_scale);
    for (int half = 0; half < kHalves; ++half) std::memcpy(&near_[half].size, size + 8 * half, sizeof(F8));
  }

  /// Of the lanes of `asked`, each in a cell: those whose field becomes negative there. `hits`: of the packet's lanes.
  template <bool kAsksWhere>
  Mask ask(Mask asked, const Cells& cells, FieldHit* hits) {
    const std::uint32_t lanes = bits(asked);
    store(cell_[0], cells.x + all(origin_[0]));
    store(cell_[1], cells.y + all(origin_[1]));
    store(cell_[2], cells.z + all(origin_[2]));
    std::uint32_t may = 0;
    for (int half = 0; half < kHalves; ++half) may |= may_be(half, lanes >> 8 * half & 0xFFU) << 8 * half;
    std::uint32_t met = 0;
    for (; may != 0; may &= may - 1) {
      const int lane = std::countr_zero(may);
      const int x = cell_[0][lane];
      const int y = cell_[1][lane];
      const int z = cell_[2][lane];
      set_chunk(x >> 6, y >> 6, z >> 6);
      FieldHit unused;
      FieldHit& hit = kAsksWhere ? hits[first_ + lane] : unused;
      if (meet_at<kAsksWhere>(field_, chunk_, ray_of(lane), x, y, z, hit)) met |= 1U << lane;
    }
    return mask_of(met);
  }

 private:
  static constexpr int kHalves = kWidth / 8;

  void set_axis(const Axis& axis, int index, int origin) {
    origin_[index] = origin;
    store(base_[index], axis.base + all(origin));
    put(axis.origin, index, &NearRay<F8>::origin);
    put(axis.direction, index, &NearRay<F8>::direction);
    put(select(axis.still, all(kNever), axis.inverse), index, &NearRay<F8>::inverse);
    const Mask is_back = ~(axis.forward | axis.still);
    put(select(is_back, all(1.0F + kStretch), all(-kStretch)), index, &NearRay<F8>::entry);
    put(select(is_back, all(-kStretch), all(1.0F + kStretch)), index, &NearRay<F8>::exit);
  }
  void put(F from, int axis, F8 (NearRay<F8>::*to)[3]) {
    alignas(64) float lanes[kWidth];
    store(lanes, from);
    for (int half = 0; half < kHalves; ++half) std::memcpy(&(near_[half].*to)[axis], lanes + 8 * half, sizeof(F8));
  }

  void set_chunk(int x, int y, int z) {
    if (knows_ && x == at_[0] && y == at_[1] && z == at_[2]) return;
    at_[0] = x, at_[1] = y, at_[2] = z;
    knows_ = true;
    chunk_ = field_.find(*field_.grid, x, y, z);
  }

  // Of eight lanes those whose field may become negative.
  std::uint32_t may_be(int half, std::uint32_t left) {
    const I8 lane_bits = {1, 2, 4, 8, 16, 32, 64, 128};
    I8 at[3];
    I8 base[3];
    for (int axis = 0; axis < 3; ++axis) {
      std::memcpy(&at[axis], cell_[axis] + 8 * half, sizeof(I8));
      std::memcpy(&base[axis], base_[axis] + 8 * half, sizeof(I8));
    }
    std::uint32_t may = 0;
    // By chunk; mostly there is one.
    while (left != 0) {
      const int lane = std::countr_zero(left);
      const int x = at[0][lane] >> 6;
      const int y = at[1][lane] >> 6;
      const int z = at[2][lane] >> 6;
      set_chunk(x, y, z);
      const I8 wanted = ((I8{} + static_cast<int>(left)) & lane_bits) != 0;
      const I8 here = wanted & (at[0] >> 6 == x) & (at[1] >> 6 == y) & (at[2] >> 6 == z);
      left &= ~bits8(here);
      may |= lanes_to_ask(near_[half], chunk_, at, base, here);
    }
    return may;
  }

  const CellRay& ray_of(int lane) {
    if ((exact_ready_ >> lane & 1U) == 0) {
      exact_ready_ |= 1U << lane;
      const int i = first_ + lane;
      exact_[lane] = cell_ray(rays_.ray(i), rays_.max_t[static_cast<std::size_t>(i)]);
    }
    return exact_[lane];
  }

  const FieldView& field_;
  const RayPacket& rays_;
  int first_;
  int origin_[3];
  alignas(64) std::int32_t base_[3][kWidth];  // from where each lane counts, in the field
  alignas(64) std::int32_t cell_[3][kWidth];
  NearRay<F8> near_[kHalves];
  std::uint32_t exact_ready_ = 0;
  CellRay exact_[kWidth];
  bool knows_ = false;
  int at_[3];
  const DensityStorage* chunk_ = nullptr;  // at `at_`; null where it is uniform
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
    FieldLanes cells(field, rays, first, lanes);
    const VoxelSteps steps = voxel_steps(lanes);
    const Mask met = walk_apart(tree, lanes, steps, t, entered, [&](const Cells& at, VoxelWalk& voxels, Mask found) {
      Mask done = mask_of(0);
      while (any(found)) {
        const Mask stopped = stop_at_voxels(lanes, steps, voxels, found);
        if (!any(stopped)) break;
        const Mask is_negative = cells.ask<kAsksWhere>(stopped, voxels_at(at, voxels.code), hits);
        done = done | is_negative;
        found = step_on(lanes, steps, stopped & ~is_negative, voxels);
      }
      return done;
    });
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

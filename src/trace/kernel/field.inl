// Traces one ray in a density field: the walk of trace/kernel/single.inl through cells with a solid corner. Eight of
// these cells are gathered and tested at once for a negative value along the ray. The candidates are then solved in
// order.
//
//   walk     ..X. .... .XX. X...    words of 4^3 cells: the cells that the ray passes and that have a solid corner
//   group    | X | X | X | X |      in lanes, see below
//   result   | . | . | 1 | 1 |      solve the third, then the fourth; without a root, the walk continues

#pragma once

#include <limits>

#include <immintrin.h>

#include "trace/kernel/cell_cubic.inl"
#include "trace/kernel/field_cells.inl"
#include "trace/kernel/lockstep.inl"
#include "trace/kernel/ray_kernel.h"
#include "trace/kernel/single.inl"
#include "trace/kernel/window.inl"

namespace quoin::trace {
namespace {

// Single rays.

constexpr int kGroup = 8;

// `base`: the origin of the walk's coordinates, in the field.
inline NearRay<float> near_ray(const PathRay& path, const Ray& ray, I4 base) {
  NearRay<float> out;
  out.size = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_back = path.backward[axis] != 0;
    const bool is_still = path.inverse[axis] == kStillInverse;
    // The walk puts the origin of an axis without motion in the middle of a voxel.
    out.origin[axis] = is_still  ? static_cast<float>(ray.origin[axis] - base[axis])
                       : is_back ? -path.origin[axis]
                                 : path.origin[axis];
    out.direction[axis] = is_still ? 0.0F : static_cast<float>(ray.direction[axis]);
    out.inverse[axis] = is_back ? -path.inverse[axis] : path.inverse[axis];
    out.size = std::max(out.size, std::abs(out.direction[axis]));
  }
  return out;
}

// The next cells of a ray with a solid corner.
class CellGroup {
 public:
  /// `base`: the origin of the walk's coordinates, in the field.
  CellGroup(const FieldView& field, const Ray& ray, double max_t, const PathRay& path, I4 base)
      : field_(field), ray_(ray), max_t_(max_t), near_(near_ray(path, ray, base)) {
    for (int axis = 0; axis < 3; ++axis) backward_[axis] = path.backward[axis], base_[axis] = base[axis];
  }

  [[nodiscard]] bool is_empty() const { return count_ == 0; }
  [[nodiscard]] bool is_full() const { return count_ >= kGroup; }

  /// Adds cells of a word; `at` is the first of the word's cells that the ray could pass.
  /// Requires: the group is not full.
  void add(I4 at, std::uint64_t cells) {
    QUOIN_ASSERT(!is_full() && word_count_ < kGroup && cells != 0, "room for the cells of a word");
    for (int axis = 0; axis < 3; ++axis) words_[axis][word_count_] = at[axis];
    for (; cells != 0; cells &= cells - 1) codes_[count_++] = word_count_ << 6 | std::countr_zero(cells);
    ++word_count_;
  }

  /// Tests all cells, and removes them from the group.
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
  // Tests `count` cells starting at `first`, at most eight.
  template <bool kAsksWhere>
  [[gnu::always_inline]] bool ask_some(int first, int count, FieldHit& hit) {
    I8 code;
    std::memcpy(&code, codes_ + first, sizeof code);
    Candidates<kGroup> cells;
    for (int axis = 0; axis < 3; ++axis) {
      const I8 in_word = ((code >> 2 * axis & 3) ^ backward_[axis]) - backward_[axis];
      cells.at[axis] = from_8(words_[axis], code >> 6) + in_word;
    }
    CornerPairs<kGroup> corners;
    read_cells<kGroup>(field_, chunks_, cells.at, first_lanes(Vectors<kGroup>{}, count), corners);
    screen(corners, near_, base_, count, cells);
    if (cells.lanes == 0) return false;
    const CellRay ray = cell_ray(ray_, max_t_);
    for (std::uint32_t left = cells.lanes; left != 0; left &= left - 1) {
      cells.describe(std::countr_zero(left), hit);
      if (meets<kAsksWhere>(ray, hit)) return true;
    }
    return false;
  }

  const FieldView& field_;
  const Ray& ray_;
  double max_t_;
  NearRay<float> near_;
  NearChunks chunks_;
  std::int32_t backward_[3];
  std::int32_t base_[3];
  int count_ = 0;
  int word_count_ = 0;
  alignas(32) std::int32_t words_[3][kGroup];        // first cells of the words, by axis
  alignas(32) std::int32_t codes_[64 + 2 * kGroup];  // cells: the number of the word, and six bits for the cell in it
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

// Traces packets of rays in a density field: the walk of trace/kernel/lockstep.inl, or of trace/kernel/window.inl for
// short rays, through the cells with a solid corner. With AVX-512, steps append the codes of such cells: no step waits
// for a look-up in the tree, and the only branch is rarely taken. After the cells of a word of 4^3 cells, after a short
// ray, or when there are many codes, lanes with a hit are left out, and the other codes become cells in a list. Packing
// is slow with AVX2, so steps append to the list there. When the list fills the registers, its cells are tested: in
// single precision for a possible negative value along the ray, then the few candidates in double. Lanes stop after a
// hit.
//
//   lane          | 0 | 1 | 2 | ... | 15 |
//   step 1        | A | . | B | ... |  C |    a cell with a solid corner, or none
//   step 2        | D | E | . | ... |  . |
//
//   codes         | A | B | C | D | E | ...    a cell's place in the word or window, and its lane
//   list          | A | C | D | E | ...        x, y, z and lane; the cells of a lane are in the order of its walk
//   candidates    | x | x |   |   | ...        found in single precision
//   hits          | x |   |   |   | ...        found in double; hits[lane] gets the cell and its corners
//
// The positions of hits are roots, which are computed at the end for all lanes at once. If they are requested, the
// rest of the list is tested at the end of each word of 4^3 cells, so that lanes do not walk far beyond a hit.

/// The lanes of a packet, starting at lane `first`.
template <bool kAsksWhere>
class FieldLanes {
 public:
  /// `hits`: by lane of the packet; not written if kAsksWhere is false.
  FieldLanes(const FieldView& field, const RayPacket& rays, int first, const Lanes& lanes, FieldHit* hits)
      : field_(field), first_(first), hits_(hits), exact_from_(lanes_from(rays, first)) {
    if (kAsksWhere) std::memset(&kept_, 0, sizeof kept_);
    const IVec3 origin(field.cells->origin);
    set_axis(lanes.x, 0, origin.x);
    set_axis(lanes.y, 1, origin.y);
    set_axis(lanes.z, 2, origin.z);
    store(size_, lanes.reach_scale);
    std::int32_t lane[kWidth];
    for (int i = 0; i < kWidth; ++i) lane[i] = i << kLaneShift;
    lane_codes_ = load(lane);
  }

  /// Walks the lanes of `walking` through the 4^3 cells of a word. Returns all lanes with a hit so far.
  Mask walk(const Lanes& lanes, const VoxelSteps& steps, const Cells& word, VoxelWalk& voxels, Mask walking) {
    const I first[3] = {shift_left<2>(word.x) + all(origin_[0]), shift_left<2>(word.y) + all(origin_[1]),
                        shift_left<2>(word.z) + all(origin_[2])};
    walk_voxels(lanes, steps, voxels, walking, [&](Mask met) { return visit<in_word>(met, voxels.code, first); });
    if (kPacksFast) list<in_word>(first);
    return ask(kAsksWhere ? 1 : kCellsAtOnce);
  }

  /// Walks short rays to their ends, in the window that begins at `window`.
  void walk_short(const TreeView& tree, const IVec3& window, ShortRays& rays) {
    const I first[3] = {all(origin_[0] + window.x), all(origin_[1] + window.y), all(origin_[2] + window.z)};
    walk_window(tree, window, rays, [&](Mask met, Mask) { return visit<in_window>(met, rays.code, first); });
    if (kPacksFast) list<in_window>(first);
  }

  /// Tests the rest of the list, and completes the hits.
  Mask finish() {
    const Mask met = ask(1);
    if (kAsksWhere && met_ != 0) find_where();
    return met;
  }

 private:
  // A code: 18 bits of a place in a window (trace/kernel/window.inl) or of VoxelWalk::code, then the lane.
  static constexpr int kLaneShift = 18;
  // Codes are tested at the latest when there are so many. Open surfaces rarely have so many per packet.
  static constexpr int kManyCodes = 4 * kWidth;
  // The cells left over of a group, the cells of all codes, and a register.
  static constexpr int kMostCells = kCellsAtOnce + kManyCodes + kWidth;
  using CellInts = Int32s<kCellsAtOnce>;

  void set_axis(const Axis& axis, int index, int origin) {
    origin_[index] = origin;
    store(base_[index], axis.base + all(origin));
    store(rays_near_.origin[index], axis.origin);
    store(rays_near_.direction[index], axis.direction);
    store(rays_near_.inverse[index], select(axis.still, all(kNever), axis.inverse));
  }

  // Return the cells of codes, from the first cells of the words or of the window.
  static Cells in_word(I code) { return {code & all(3), shift_right<2>(code) & all(3), shift_right<4>(code) & all(3)}; }
  static Cells in_window(I code) { return {gathered<0>(code), gathered<1>(code), gathered<2>(code)}; }

  // Appends the codes of these lanes, or their cells if packing is slow. If there are many, tests them. Returns lanes
  // with a hit. `kCellsOf`: in_word or in_window. `first`: the first cells, by lane.
  template <Cells (*kCellsOf)(I)>
  [[gnu::always_inline]] Mask visit(Mask which, I code, const I (&first)[3]) {
    if (kPacksFast) {
      QUOIN_ASSERT(code_count_ < kManyCodes, "room for a register of codes");
      store_packed(codes_ + code_count_, packing_of(which), code + lane_codes_);
      code_count_ += std::popcount(bits(which));
      if (code_count_ < kManyCodes) return mask_of(0);
      list<kCellsOf>(first);
      return ask(kCellsAtOnce);
    }
    if (!any(which)) return mask_of(0);
    const Cells cells = kCellsOf(code);
    add(which, shift_right<kLaneShift>(lane_codes_), {cells.x + first[0], cells.y + first[1], cells.z + first[2]});
    return count_ >= kCellsAtOnce ? ask(kCellsAtOnce) : mask_of(0);
  }

  // Moves the cells of all codes to the list, except those of lanes with a hit.
  template <Cells (*kCellsOf)(I)>
  [[gnu::noinline]] void list(const I (&first)[3]) {
    for (int i = 0; i < code_count_; i += kWidth) {
      const I code = load(codes_ + i);
      const I lane = shift_right<kLaneShift>(code) & all(kWidth - 1);
      const std::uint32_t some = code_count_ - i >= kWidth ? kAllLanes : (1U << (code_count_ - i)) - 1U;
      const Mask wanted = mask_of(some) & ~test_bit(all(static_cast<std::int32_t>(met_)), lane);
      const Cells cells = kCellsOf(code);
      add(wanted, lane,
          {cells.x + from_16(first[0], lane), cells.y + from_16(first[1], lane), cells.z + from_16(first[2], lane)});
      if (kAsksWhere && count_ >= kCellsAtOnce) ask(kCellsAtOnce);
    }
    code_count_ = 0;
  }

  [[gnu::always_inline]] void add(Mask which, I lane, const Cells& cells) {
    const Packing packing = packing_of(which);
    store_packed(lane_ + count_, packing, lane);
    store_packed(at_[0] + count_, packing, cells.x);
    store_packed(at_[1] + count_, packing, cells.y);
    store_packed(at_[2] + count_, packing, cells.z);
    count_ += std::popcount(bits(which));
    QUOIN_ASSERT(count_ <= kMostCells, "room for one more register");
  }

  // Tests groups of cells while at least `least_count` cells are left. Returns all lanes with a hit so far. Reads the
  // corners of all groups first, so that the processor waits for several groups at a time.
  Mask ask(int least_count) {
    int first = 0;
    for (int group = 0; count_ - first >= least_count; ++group, first += kCellsAtOnce) {
      CellInts at[3];
      for (int axis = 0; axis < 3; ++axis) std::memcpy(&at[axis], at_[axis] + first, sizeof at[axis]);
      const CellInts wanted = first_lanes(Vectors<kCellsAtOnce>{}, count_ - first);
      read_cells<kCellsAtOnce>(field_, chunks_, at, wanted, corners_[group]);
    }
    if (first == 0) return mask_of(met_);
    const int end = first;
    first = 0;
    for (int group = 0; first < end; ++group, first += kCellsAtOnce) {
      ask_some(first, std::min(count_ - first, kCellsAtOnce), corners_[group]);
    }
    count_ = std::max(count_ - first, 0);
    if (count_ != 0) {
      store(lane_, load(lane_ + first));
      for (std::int32_t* const at : {at_[0], at_[1], at_[2]}) store(at, load(at + first));
    }
    return mask_of(met_);
  }

  void ask_some(int first, int count, const CornerPairs<kCellsAtOnce>& corners) {
    using CellFloats = Floats<kCellsAtOnce>;
    CellInts lane;
    std::memcpy(&lane, lane_ + first, sizeof lane);
    lane &= kWidth - 1;  // entries beyond the end are not set
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
    }
    ray.size = of_lane(size_);
    screen(corners, ray, base, count, cells);
    if (cells.lanes != 0) meet(cells, lane);
  }

  // Tests the candidates in double.
  void meet(const Candidates<kCellsAtOnce>& cells, Int32s<kCellsAtOnce> lane) {
    // Packed, without gaps.
    const CellInts order = lane_numbers(Vectors<kCellsAtOnce>{}, cells.lanes);
    alignas(64) std::int32_t from[kWidth] = {};
    const auto front = [&](const auto& numbers, auto* to) {
      std::memcpy(from, &numbers, sizeof(CellInts));
      const CellInts first = from_16(from, order);
      std::memcpy(to, &first, sizeof first);
    };
    alignas(64) std::int32_t its_lane[kCellsAtOnce];
    alignas(64) std::int32_t at[3][kCellsAtOnce];
    alignas(64) float corners[8][kCellsAtOnce];
    front(lane, its_lane);
    for (int axis = 0; axis < 3; ++axis) front(cells.at[axis], at[axis]);
    for (int i = 0; i < 8; ++i) front(cells.corners[i], corners[i]);
    const int count = std::popcount(cells.lanes);
    for (int first = 0; first < count; first += int{kDoubles}) {
      CellRayOf<Doubles> ray = rays_of(some<Ints>(its_lane + first));
      Doubles cell[3];
      Doubles density[8];
      using FloatsToDoubles = float __attribute__((vector_size(kDoubles * 4)));
      for (int axis = 0; axis < 3; ++axis) cell[axis] = __builtin_convertvector(some<Ints>(at[axis] + first), Doubles);
      for (int i = 0; i < 8; ++i) {
        density[i] = __builtin_convertvector(some<FloatsToDoubles>(corners[i] + first), Doubles);
      }
      const Meetings meetings = meet_cells<kAsksWhere>(ray, cell, density);
      for (std::uint32_t left = words::lanes_with_bits(meetings.met); left != 0; left &= left - 1) {
        const int place = std::countr_zero(left);
        const int i = first + place;
        if (i >= count) break;
        const std::uint32_t bit = 1U << its_lane[i];
        if ((met_ & bit) != 0) continue;
        met_ |= bit;
        if (!kAsksWhere) continue;
        keep(meetings, place, its_lane[i]);
        FieldHit& hit = hits_[first_ + its_lane[i]];
        hit.x = at[0][i], hit.y = at[1][i], hit.z = at[2][i];
        for (int corner = 0; corner < 8; ++corner) hit.corners[corner] = corners[corner][i];
      }
    }
  }

  // Stores a lane's hit without its t.
  void keep(const Meetings& from, int place, int lane) {
    QUOIN_ASSERT(lane >= 0 && lane < kWidth && place >= 0 && place < int{kDoubles}, "a lane of the packet");
    kept_.c0[lane] = from.field.c0[place];
    kept_.c1[lane] = from.field.c1[place];
    kept_.c2[lane] = from.field.c2[place];
    kept_.c3[lane] = from.field.c3[place];
    kept_.s[lane] = from.s[place];
    kept_.t_in[lane] = from.t_in[place];
    kept_.length[lane] = from.length[place];
    kept_.has_root[lane] = from.has_root[place];
  }

  void find_where() {
    constexpr int kGroups = 2;  // as many as fit in registers
    for (int first = 0; first < kWidth; first += kGroups * int{kDoubles}) {
      CellCubic<Doubles> fields[kGroups];
      Longs wanted[kGroups];
      Doubles roots[kGroups];
      for (int k = 0; k < kGroups; ++k) {
        const int from = first + k * int{kDoubles};
        fields[k] = {some<Doubles>(kept_.c0 + from), some<Doubles>(kept_.c1 + from), some<Doubles>(kept_.c2 + from),
                     some<Doubles>(kept_.c3 + from)};
        wanted[k] = some<Longs>(kept_.has_root + from);
      }
      static_assert(kGroups == 2);
      const Longs has_root[kGroups] = {wanted[0], wanted[1]};
      find_roots(fields, wanted, roots);
      for (int k = 0; k < kGroups; ++k) {
        const int from = first + k * int{kDoubles};
        const Doubles s = has_root[k] ? roots[k] : some<Doubles>(kept_.s + from);
        const Doubles t = some<Doubles>(kept_.t_in + from) + s * some<Doubles>(kept_.length + from);
        std::memcpy(kept_.s + from, &t, sizeof t);
      }
    }
    for (std::uint32_t left = met_; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      hits_[first_ + lane].t = kept_.s[lane];
    }
  }

  CellRayOf<Doubles> rays_of(Ints lanes) {
    if (!knows_exact_) find_exact();
    CellRayOf<Doubles> ray;
    for (int axis = 0; axis < 3; ++axis) {
      ray.origin[axis] = gather_doubles(exact_from_.origins[axis], lanes);
      ray.direction[axis] = gather_doubles(exact_direction_[axis], lanes);
      ray.inverse[axis] = gather_doubles(exact_inverse_[axis], lanes);
      const Longs is_back = ray.direction[axis] < 0.0;
      ray.entry[axis] = is_back ? Doubles{} + 1.0 : Doubles{};
      ray.exit[axis] = is_back ? Doubles{} : Doubles{} + 1.0;
    }
    ray.max_t = gather_doubles(exact_from_.max_t, lanes);
    return ray;
  }

  // Sets up the ray of each lane like cell_ray.
  void find_exact() {
    knows_exact_ = true;
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < kWidth; i += kDoubles) {
        const Doubles given = some<Doubles>(exact_from_.directions[axis] + i);
        const Longs is_still = (given < 0x1p-100) & (given > -0x1p-100);
        const Doubles inverse = is_still ? Doubles{} + 1e300 : 1.0 / (is_still ? Doubles{} + 1.0 : given);
        const Doubles direction = is_still ? Doubles{} : given;
        std::memcpy(exact_direction_[axis] + i, &direction, sizeof direction);
        std::memcpy(exact_inverse_[axis] + i, &inverse, sizeof inverse);
      }
    }
  }

  struct NearRays {
    alignas(64) float origin[3][kWidth];
    alignas(64) float direction[3][kWidth];
    alignas(64) float inverse[3][kWidth];
  };

  const FieldView& field_;
  int first_;
  FieldHit* hits_;
  int origin_[3];
  NearChunks chunks_;
  I lane_codes_;
  NearRays rays_near_;
  alignas(64) float size_[kWidth];
  alignas(64) std::int32_t base_[3][kWidth];  // origin of each lane's coordinates, in the field
  int code_count_ = 0;
  alignas(64) std::int32_t codes_[kManyCodes + 2 * kWidth];
  // The list. Packing writes whole registers, so it has room for one more.
  int count_ = 0;
  alignas(64) std::int32_t lane_[kMostCells + kWidth];
  alignas(64) std::int32_t at_[3][kMostCells + kWidth];
  CornerPairs<kCellsAtOnce> corners_[kMostCells / kCellsAtOnce];
  std::uint32_t met_ = 0;
  // Hits by lane, without their t; has_root is 0 in lanes without a hit.
  struct Kept {
    double c0[kWidth], c1[kWidth], c2[kWidth], c3[kWidth], s[kWidth], t_in[kWidth], length[kWidth];
    std::int64_t has_root[kWidth];
  };
  alignas(64) Kept kept_;
  // In double precision.
  Rays exact_from_;
  bool knows_exact_ = false;
  alignas(64) double exact_direction_[3][kWidth];
  alignas(64) double exact_inverse_[3][kWidth];
};

// Returns the lanes that enter the solid. Other code must trace the `unfinished` lanes.
template <bool kAsksWhere>
inline std::uint32_t packet_in_field(const FieldView& field, const RayPacket& rays, FieldHit* hits,
                                     std::uint32_t& unfinished) {
  const TreeView& tree = *field.cells;
  std::uint32_t hit = 0;
  unfinished = 0;
  for (int first = 0; first < RayPacket::kSize; first += kWidth) {
    std::uint32_t wanted = rays.active >> first & kAllLanes;
    if (!kAsksWhere) {
      std::uint32_t doubtful = 0;
      wanted = trace_short(tree, rays, first, wanted, [&](const IVec3& window, ShortRays& in_window) {
        FieldLanes<kAsksWhere> cells(field, rays, first, in_window.lanes, hits);
        cells.walk_short(tree, window, in_window);
        hit |= bits(cells.finish()) << first;
        doubtful |= bits(in_window.doubtful);
      });
      wanted |= doubtful;
    }
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
  return trace_filled(rays,
                      [&](const RayPacket& filled) { return packet_in_field<true>(field, filled, hits, unfinished); });
}

inline std::uint32_t any_hits_in_field(const FieldView& field, const RayPacket& rays, std::uint32_t& unfinished) {
  return trace_filled(
      rays, [&](const RayPacket& filled) { return packet_in_field<false>(field, filled, nullptr, unfinished); });
}

}  // namespace
}  // namespace quoin::trace

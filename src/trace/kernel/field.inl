// One ray in a field of densities: the walk of trace/kernel/single.inl through cells that touch the solid. These are
// gathered, then eight at once are asked whether the field in them may become negative along the ray; of those, in
// order, where it does.
//
//   walk    ..X. .... .XX. X...    words of 4^3 cells, with those that touch the solid and that the ray passes
//   group   | X | X | X | X |      in lanes (trace/kernel/field_cells.inl)
//   asked   | . | . | 1 | 1 |      the third: from where on; else the fourth; else the walk goes on

#pragma once

#include "trace/kernel/field_cells.inl"
#include "trace/kernel/single.inl"

namespace quoin::trace {
namespace {

constexpr int kGroup = 8;

inline I8 permute8(const std::int32_t* table, I8 at) {
  const __m256i from = _mm256_load_si256(reinterpret_cast<const __m256i*>(table));
  return reinterpret_cast<I8>(_mm256_permutevar8x32_epi32(from, reinterpret_cast<__m256i>(at)));
}

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

// The next cells of a ray that touch the solid, all of one chunk.
class CellGroup {
 public:
  /// `base`: from where the walk counts, in the field.
  CellGroup(const FieldView& field, const Ray& ray, double max_t, const PathRay& path, I4 base)
      : field_(field), ray_(cell_ray(ray, max_t)), near_(near_ray(path, ray, base)) {
    for (int axis = 0; axis < 3; ++axis) backward_[axis] = path.backward[axis], base_[axis] = base[axis];
  }

  [[nodiscard]] bool is_empty() const { return count_ == 0; }
  [[nodiscard]] bool is_full() const { return count_ >= kGroup; }
  /// That of the cells that are added from now on.
  void set_chunk(I4 chunk) { chunk_ = field_.find(*field_.grid, chunk[0], chunk[1], chunk[2]); }

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
      if (ask_some<kAsksWhere>(first, count - first, hit)) return true;
    }
    return false;
  }

 private:
  // The eight cells from `first` on, of which `count` mean something.
  template <bool kAsksWhere>
  [[gnu::always_inline]] bool ask_some(int first, int count, FieldHit& hit) {
    const I8 lanes = I8{0, 1, 2, 3, 4, 5, 6, 7} < count;
    I8 code;
    std::memcpy(&code, codes_ + first, sizeof code);
    I8 at[3];
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = permute8(words_[axis], code >> 6) + ((code >> 2 * axis & 3) ^ backward_[axis]) - backward_[axis];
    }
    std::uint32_t asked = lanes_to_ask(near_, chunk_, at, base_, lanes);
    for (; asked != 0; asked &= asked - 1) {
      const int lane = std::countr_zero(asked);
      if (meet_at<kAsksWhere>(field_, chunk_, ray_, at[0][lane], at[1][lane], at[2][lane], hit)) return true;
    }
    return false;
  }

  const FieldView& field_;
  CellRay ray_;
  NearRay<float> near_;
  const DensityStorage* chunk_ = nullptr;  // null where it is uniform
  std::int32_t backward_[3];
  std::int32_t base_[3];
  int count_ = 0;
  int word_count_ = 0;
  alignas(32) std::int32_t words_[3][kGroup];        // where words begin, by axis
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
  I4 chunk = {};
  bool knows = false;
  bool is_hit = false;
  PathWalk walk(tree, path);
  walk.walk([&](int brick, int cell, std::uint64_t met) {
    const F4 in_cell = walk.corner_of_cell(brick, cell);
    if (walk.is_too_far(in_cell)) return unfinished = true;
    const I4 at = walk.native_voxel(in_cell) + origin;
    if (!knows || mask3(at >> 6 != chunk) != 0) {
      if (!group.is_empty() && group.ask<kAsksWhere>(hit)) return is_hit = true;
      knows = true;
      chunk = at >> 6;
      group.set_chunk(chunk);
    }
    group.add(at, met);
    return (kAsksWhere || group.is_full()) && (is_hit = group.ask<kAsksWhere>(hit));
  });
  if (!is_hit && !group.is_empty()) is_hit = group.ask<kAsksWhere>(hit);
  if (is_hit) unfinished = false;
  return is_hit;
}

}  // namespace
}  // namespace quoin::trace

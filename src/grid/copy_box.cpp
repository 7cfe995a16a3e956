#include <quoin/grid/copy_box.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/grid/chunk.h>

#include "core/coordinates/chunk_order.h"
#include "core/coordinates/long_box.h"

namespace quoin {
namespace {

/// The voxels of one chunk in a plain array, copied from chunks in another orientation.
///
///   types()[(z * 64 + y) * 64 + x]    x, y, z in the chunk
///
/// A row of a chunk lies along the block's x, y or z. Along x it is copied, forwards or backwards. Otherwise a
/// plane's rows are read one below the other, and the block's rows are its columns.
class TurnedBlock {
 public:
  // Not initialised: every voxel is written before it is read.
  TurnedBlock() : types_(new VoxelType[kChunkVoxels]) {}

  /// Starts a box that, once turned, fills `part` of the chunk.
  void begin(AxisOrientation orientation, const IBox& part);
  /// Sets the whole chunk to air.
  void clear();
  /// Puts the voxels of a part of a chunk (null: air) at their turned positions. `offset`: the part's least corner in
  /// the box, before it is turned.
  void put(const Chunk* chunk, const IBox& part, IVec3 offset);

  /// Replaces the type of each put voxel by `change(type)`.
  template <class Change>
  void change_types(Change&& change) {
    for (int z = part_.min.z; z < part_.max.z; ++z) {
      for (int y = part_.min.y; y < part_.max.y; ++y) {
        VoxelType* row = types_.get() + (z * kChunkEdge + y) * kChunkEdge;
        for (int x = part_.min.x; x < part_.max.x; ++x) row[x] = change(row[x]);
      }
    }
  }
  /// Returns the types of the chunk. Positions that were neither put nor cleared are undefined.
  [[nodiscard]] std::span<const VoxelType, kChunkVoxels> types() const {
    return std::span<const VoxelType, kChunkVoxels>(types_.get(), kChunkVoxels);
  }
  [[nodiscard]] const VoxelType* at(int x, int y, int z) const {
    QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
    return types_.get() + (z * kChunkEdge + y) * kChunkEdge + x;
  }

 private:
  [[nodiscard]] VoxelType* place(IVec3 in_box) const;
  void put_rows(const Chunk& chunk, const IBox& part, IVec3 offset);
  void put_columns(const Chunk& chunk, const IBox& part, IVec3 offset);
  void fill(VoxelType type, IVec3 offset, IVec3 size);

  AxisOrientation orientation_;
  IBox part_;         // part of the chunk that the turned box fills
  int first_ = 0;     // index of the box's lowest voxel
  IVec3 strides_{0};  // from a voxel to the next along each of the box's axes
  std::unique_ptr<VoxelType[]> types_;
};

void TurnedBlock::begin(AxisOrientation orientation, const IBox& part) {
  QUOIN_ASSERT(!part.empty() && intersect(part, kWholeChunk) == part, "a part of the chunk");
  orientation_ = orientation;
  part_ = part;
  first_ = 0;
  int stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_negated = orientation.is_negated(axis);
    strides_[orientation.source_axis(axis)] = is_negated ? -stride : stride;
    first_ += (is_negated ? part.max[axis] - 1 : part.min[axis]) * stride;
    stride *= kChunkEdge;
  }
}

void TurnedBlock::clear() {
  std::fill_n(types_.get(), kChunkVoxels, kAir);
}

VoxelType* TurnedBlock::place(IVec3 in_box) const {
  const int index = first_ + in_box.x * strides_.x + in_box.y * strides_.y + in_box.z * strides_.z;
  QUOIN_ASSERT(index >= 0 && index < static_cast<int>(kChunkVoxels), "a voxel of the chunk");
  return types_.get() + index;
}

void TurnedBlock::put(const Chunk* chunk, const IBox& part, IVec3 offset) {
  QUOIN_ASSERT(!part.empty() && intersect(part, kWholeChunk) == part, "a part of the chunk");
  if (chunk == nullptr) return fill(kAir, offset, part.size());
  if (const auto type = chunk->uniform()) return fill(*type, offset, part.size());
  if (orientation_.source_axis(0) == 0) return put_rows(*chunk, part, offset);
  put_columns(*chunk, part, offset);
}

void TurnedBlock::fill(VoxelType type, IVec3 offset, IVec3 size) {
  const int along = orientation_.source_axis(0);
  const int second = orientation_.source_axis(1);
  const int third = orientation_.source_axis(2);
  for (int k = 0; k < size[third]; ++k) {
    for (int j = 0; j < size[second]; ++j) {
      VoxelType* row = place(offset) + j * strides_[second] + k * strides_[third];
      if (strides_[along] < 0) row -= size[along] - 1;
      std::fill_n(row, size[along], type);
    }
  }
}

void TurnedBlock::put_rows(const Chunk& chunk, const IBox& part, IVec3 offset) {
  std::array<VoxelType, kChunkEdge> row{};
  const VoxelType* first = row.data() + part.min.x;
  const int count = part.max.x - part.min.x;
  for (int z = part.min.z; z < part.max.z; ++z) {
    for (int y = part.min.y; y < part.max.y; ++y) {
      chunk.read_row(y, z, row);
      VoxelType* out = place(offset + IVec3(0, y - part.min.y, z - part.min.z));
      if (strides_.x > 0) {
        std::copy_n(first, count, out);
      } else {
        std::reverse_copy(first, first + count, out - (count - 1));
      }
    }
  }
}

void TurnedBlock::put_columns(const Chunk& chunk, const IBox& part, IVec3 offset) {
  // The block's rows lie along this axis of the chunk, the planes across the other.
  const int along = orientation_.source_axis(0);
  const int across = 3 - along;
  const IVec3 size = part.size();
  alignas(64) std::array<VoxelType, std::size_t{kChunkEdge} * kChunkEdge> plane;
  for (int i = 0; i < size[across]; ++i) {
    for (int k = 0; k < size[along]; ++k) {
      IVec3 at = part.min;
      at[across] += i;
      at[along] += k;
      // Reversed here, so that columns need no reversal.
      const int line = strides_[along] > 0 ? k : size[along] - 1 - k;
      chunk.read_row(at.y, at.z,
                     std::span<VoxelType, kChunkEdge>(plane.data() + std::ptrdiff_t{line} * kChunkEdge, kChunkEdge));
    }
    IVec3 start = offset;
    start[across] += i;
    VoxelType* out = place(start);
    if (strides_[along] < 0) out -= size[along] - 1;
    for (int x = 0; x < size.x; ++x, out += strides_.x) {
      const VoxelType* column = plane.data() + part.min.x + x;
      for (int k = 0; k < size[along]; ++k) out[k] = column[std::ptrdiff_t{k} * kChunkEdge];
    }
  }
}

LongBox common_part(const LongBox& a, const LongBox& b) {
  LongBox part;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    part.min[axis] = std::max(a.min[axis], b.min[axis]);
    part.max[axis] = std::min(a.max[axis], b.max[axis]);
  }
  return part;
}

LongBox box_of_chunk(IVec3 chunk) {
  LongBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    box.min[i] = std::int64_t{chunk[axis]} * kChunkEdge;
    box.max[i] = box.min[i] + kChunkEdge;
  }
  return box;
}

// Requires: the box lies in the int32 range.
IBox narrowed(const LongBox& box) {
  IBox narrow;
  for (int axis = 0; axis < 3; ++axis) {
    narrow.min[axis] = static_cast<int>(box.min[static_cast<std::size_t>(axis)]);
    narrow.max[axis] = static_cast<int>(box.max[static_cast<std::size_t>(axis)]);
  }
  QUOIN_ASSERT(box_from(narrow).min == box.min && box_from(narrow).max == box.max, "a box in the int32 range");
  return narrow;
}

double volume(const IBox& box) {
  const DVec3 size = DVec3(box.max) - DVec3(box.min);
  return size.x * size.y * size.z;
}

// A single copy, from a grid that does not change in the meantime.
class BoxCopy {
 public:
  BoxCopy(const Grid& from, const IBox& box, Grid& to, IVec3 to_min, AxisOrientation orientation,
          const CopyOptions& options)
      : from_(from),
        to_(to),
        options_(options),
        orientation_(orientation),
        source_(box_from(box)),
        has_data_(from.data_count() != 0 || to.data_count() != 0) {
    const VoxelRegistry* types = options.types;
    QUOIN_ASSERT(!options.turn_state || types != nullptr, "the types whose states turn");
    const bool turns = types != nullptr && (options.turn_state || types->has_turned_by_state());
    if (orientation != AxisOrientation() && !options.map_state && turns) {
      turning_ = types;
      has_data_ = true;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t along = source_axis(axis);
      origin_[axis] = to_min[static_cast<int>(axis)];
      target_.min[axis] = origin_[axis];
      target_.max[axis] = origin_[axis] + source_.max[along] - source_.min[along];
    }
    target_ = clipped(target_);
  }

  std::int64_t run() {
    if (is_empty(target_)) return 0;
    for (const IVec3 chunk : chunks_to_write()) copy_chunk(chunk);
    return changed_;
  }

 private:
  [[nodiscard]] std::size_t source_axis(std::size_t axis) const {
    return static_cast<std::size_t>(orientation_.source_axis(static_cast<int>(axis)));
  }
  // Returns the source box of a part of the turned box.
  [[nodiscard]] LongBox source_of(const LongBox& part) const {
    LongBox source;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t along = source_axis(axis);
      const bool is_negated = orientation_.is_negated(static_cast<int>(axis));
      const std::int64_t first = part.min[axis] - origin_[axis];
      const std::int64_t end = part.max[axis] - origin_[axis];
      source.min[along] = is_negated ? source_.max[along] - end : source_.min[along] + first;
      source.max[along] = is_negated ? source_.max[along] - first : source_.min[along] + end;
    }
    return source;
  }
  [[nodiscard]] LongBox target_of(const LongBox& part) const {
    LongBox target;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t along = source_axis(axis);
      const bool is_negated = orientation_.is_negated(static_cast<int>(axis));
      const std::int64_t first =
          is_negated ? source_.max[along] - part.max[along] : part.min[along] - source_.min[along];
      target.min[axis] = origin_[axis] + first;
      target.max[axis] = target.min[axis] + part.max[along] - part.min[along];
    }
    return target;
  }

  // Returns all chunks of the turned box or, if there are fewer, those that receive or lose voxels.
  [[nodiscard]] std::vector<IVec3> chunks_to_write() const {
    const IBox all = chunks_of(target_);
    std::vector<IVec3> chunks;
    const auto append = [&chunks](const IBox& box) {
      for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
          for (int x = box.min.x; x < box.max.x; ++x) chunks.emplace_back(x, y, z);
        }
      }
    };
    const std::size_t present = 8 * from_.chunk_count() + (options_.copy_air ? to_.chunk_count() : 0);
    if (volume(all) <= static_cast<double>(present)) {
      append(all);
      return chunks;
    }
    for (const IVec3 chunk : from_.chunks()) {
      const LongBox part = common_part(source_, box_of_chunk(chunk));
      if (is_empty(part)) continue;
      const LongBox target = common_part(target_, target_of(part));
      if (!is_empty(target)) append(chunks_of(target));
    }
    if (options_.copy_air) {
      for (const IVec3 chunk : to_.chunks()) {
        if (all.contains(chunk)) chunks.push_back(chunk);
      }
    }
    sort_and_unite(chunks);
    return chunks;
  }

  [[nodiscard]] VoxelType mapped(VoxelType type) const {
    return type != kAir && type < options_.type_map.size() ? options_.type_map[type] : type;
  }
  [[nodiscard]] bool keeps_types(const Chunk& chunk) const {
    if (options_.type_map.empty()) return true;
    const std::vector<VoxelType> types = chunk.types();
    return std::all_of(types.begin(), types.end(), [this](VoxelType type) { return mapped(type) == type; });
  }
  // Returns the type of all voxels of a part of the box, if its chunks are uniform.
  [[nodiscard]] std::optional<VoxelType> one_type(const IBox& chunks) const {
    std::optional<VoxelType> all;
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          const Chunk* chunk = from_.find_chunk(x, y, z);
          const std::optional<VoxelType> one = chunk == nullptr ? kAir : chunk->uniform();
          if (!one.has_value() || mapped(*one) != mapped(all.value_or(*one))) return std::nullopt;
          all = one;
        }
      }
    }
    QUOIN_ASSERT(all.has_value(), "at least one chunk");
    return mapped(*all);
  }

  // Copies data voxel by voxel; types are already copied.
  void copy_data(IVec3 at, const LongBox& source, const IBox& chunks, const IBox& place) {
    std::vector<IVec3> gone;
    if (const Chunk* const present = to_.find_chunk(at); present != nullptr && present->data_count() != 0) {
      present->for_each_data([&](IVec3 local, const VoxelData&) {
        const IVec3 voxel = at * kChunkEdge + local;
        if (!place.contains(voxel)) return;  // its source may lie outside the int32 range
        if (options_.copy_air || mapped(from_.get(source_of(voxel))) != kAir) gone.push_back(voxel);
      });
    }
    for (const IVec3 voxel : gone) to_.set_data(voxel, {});
    const IBox all = narrowed(source);
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          const Chunk* const chunk = from_.find_chunk(x, y, z);
          if (chunk == nullptr) continue;
          if (turning_ != nullptr) turn_states({x, y, z}, *chunk, all);
          if (chunk->data_count() == 0) continue;
          chunk->for_each_data([&](IVec3 local, const VoxelData& data) {
            const IVec3 voxel = IVec3{x, y, z} * kChunkEdge + local;
            if (all.contains(voxel)) put_data(voxel, data);
          });
        }
      }
    }
  }
  // Sets the states of voxels without data whose type the state turns: state 0 is an orientation too.
  void turn_states(IVec3 at, const Chunk& chunk, const IBox& source) {
    const IVec3 first = at * kChunkEdge;
    const IBox part = intersect({source.min - first, source.max - first}, kWholeChunk);
    for (const VoxelType type : chunk.types()) {
      const VoxelType is_now = mapped(type);
      if (!is_turned(is_now) || turned(is_now, 0) == 0) continue;
      for (int z = part.min.z; z < part.max.z; ++z) {
        for (int y = part.min.y; y < part.max.y; ++y) {
          for (std::uint64_t left = chunk.row_mask(y, z, type); left != 0; left &= left - 1) {
            const IVec3 local{std::countr_zero(left), y, z};
            if (part.contains(local) && chunk.data(local).empty()) put_data(first + local, {});
          }
        }
      }
    }
  }
  /// Returns true if a type's states turn with the copy. Requires: turning_ is not null.
  [[nodiscard]] bool is_turned(VoxelType type) const {
    if (type >= turning_->size()) return false;
    return options_.turn_state ? (*turning_)[type].state_bits != 0 : turning_->is_turned_by_state(type);
  }
  [[nodiscard]] std::uint32_t turned(VoxelType type, std::uint32_t state) const {
    const VoxelProperties& properties = (*turning_)[type];
    return options_.turn_state ? options_.turn_state(properties, state, orientation_)
                               : properties.orientations.turned(state, orientation_);
  }
  void put_data(IVec3 source, const VoxelData& data) {
    const VoxelType type = mapped(from_.get(source));
    if (type == kAir) return;
    const IVec3 voxel = narrowed(target_of(box_of_voxel(source))).min;
    std::uint32_t state = data.state;
    if (turning_ != nullptr && is_turned(type)) {
      state = turned(type, state);
    } else if (state != 0 && options_.map_state != nullptr) {
      state = options_.map_state(type, state);
    }
    to_.set_data(voxel, {state, data.bytes});
  }
  static LongBox box_of_voxel(IVec3 voxel) { return box_from({voxel, voxel + 1}); }
  [[nodiscard]] IVec3 source_of(IVec3 voxel) const { return narrowed(source_of(box_of_voxel(voxel))).min; }

  void copy_chunk(IVec3 at) {
    const LongBox part = common_part(target_, box_of_chunk(at));
    const LongBox source = source_of(part);
    const IBox chunks = chunks_of(source);
    const IBox place = narrowed(part);
    if (!from_.is_loaded_within(narrowed(source))) {
      copy_loaded(source, chunks);
      return;
    }
    if (!is_shared_whole(at, chunks, place)) {
      copy_types(at, source, chunks, place);
      if (has_data_) copy_data(at, source, chunks, place);
    }
  }

  // Copies the loaded chunks of a partly loaded source.
  void copy_loaded(const LongBox& source, const IBox& chunks) {
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          if (!from_.is_loaded({x, y, z})) continue;
          const LongBox part = common_part(source, box_of_chunk({x, y, z}));
          const IVec3 to_min = narrowed(target_of(part)).min;
          changed_ += BoxCopy(from_, narrowed(part), to_, to_min, orientation_, options_).run();
        }
      }
    }
  }

  // Returns true if a chunk is copied unchanged, including its data.
  bool is_shared_whole(IVec3 at, const IBox& chunks, const IBox& place) {
    if (place.size() != IVec3(kChunkEdge) || orientation_ != AxisOrientation() || chunks.size() != IVec3(1))
      return false;
    const Chunk* const chunk = from_.find_chunk(chunks.min);
    if (chunk == nullptr || !keeps_types(*chunk)) return false;
    if (chunk->data_count() != 0 && options_.map_state != nullptr) return false;
    if (!options_.copy_air && !chunk->is_full() && to_.find_chunk(at) != nullptr) return false;
    changed_ += to_.put_chunk(at, *chunk);
    return true;
  }

  void copy_types(IVec3 at, const LongBox& source, const IBox& chunks, const IBox& place) {
    const bool is_whole = place.size() == IVec3(kChunkEdge);
    if (const auto type = one_type(chunks)) {
      if (*type == kAir && !options_.copy_air) return;
      changed_ += is_whole ? to_.put_chunk(at, Chunk(*type)) : to_.fill_box(place, *type);
      return;
    }
    block_.begin(orientation_, part_of(box_from(place), at));
    const bool is_new = to_.find_chunk(at) == nullptr;
    if (is_new && !is_whole) block_.clear();
    gather(source, chunks);
    if (is_new || (is_whole && options_.copy_air)) {
      changed_ += to_.put_chunk(at, Chunk::from_dense(block_.types()));
    } else {
      write_rows(at, place);
    }
  }

  // Copies the chunks that a part of the box overlaps into the block, turned.
  void gather(const LongBox& source, const IBox& chunks) {
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          const LongBox part = common_part(source, box_of_chunk({x, y, z}));
          IVec3 offset{0};
          for (int axis = 0; axis < 3; ++axis) {
            const auto i = static_cast<std::size_t>(axis);
            offset[axis] = static_cast<int>(part.min[i] - source.min[i]);
          }
          block_.put(from_.find_chunk(x, y, z), part_of(part, {x, y, z}), offset);
        }
      }
    }
    if (options_.type_map.empty()) return;
    block_.change_types([this](VoxelType type) { return mapped(type); });
  }

  void write_rows(IVec3 chunk, const IBox& place) {
    changed_ += to_.edit_rows(place, [&](IVec3 first, std::span<VoxelType> types) {
      const IVec3 local = first - chunk * kChunkEdge;
      const VoxelType* row = block_.at(local.x, local.y, local.z);
      if (options_.copy_air) {
        std::copy_n(row, types.size(), types.begin());
        return;
      }
      for (std::size_t i = 0; i < types.size(); ++i) types[i] = row[i] == kAir ? types[i] : row[i];
    });
  }

  const Grid& from_;
  Grid& to_;
  const CopyOptions& options_;
  AxisOrientation orientation_;
  LongBox source_;
  std::array<std::int64_t, 3> origin_{};
  LongBox target_;
  TurnedBlock block_;
  bool has_data_;
  const VoxelRegistry* turning_ = nullptr;  // if orientations of types turn with the copy
  std::int64_t changed_ = 0;
};

}  // namespace

std::int64_t copy_box(const Grid& from, const IBox& box, Grid& to, IVec3 to_min, AxisOrientation orientation,
                      const CopyOptions& options) {
  if (box.empty()) return 0;
  if (&from != &to) return BoxCopy(from, box, to, to_min, orientation, options).run();
  const Grid before = from.snapshot();
  return BoxCopy(before, box, to, to_min, orientation, options).run();
}

}  // namespace quoin

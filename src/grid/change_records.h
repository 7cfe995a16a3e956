#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/chunk.h>

namespace quoin {

/// A box of voxels of one chunk in eight bytes: the minimum x, y, z, and 255 minus the maximum. A bytewise minimum
/// unites two boxes.
class PackedBox {
 public:
  static PackedBox of(int x, int y, int z) {
    QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
    const auto low = static_cast<std::uint32_t>(x | y << 8 | z << 16);
    return PackedBox(low | std::uint64_t{~low} << 32);
  }
  static PackedBox of_row(int y, int z, std::uint64_t voxels) {
    QUOIN_ASSERT(voxels != 0, "voxels of the row");
    PackedBox box = of(std::countr_zero(voxels), y, z);
    box.unite(of(63 - std::countl_zero(voxels), y, z));
    return box;
  }
  static PackedBox of_chunk() {
    PackedBox box = of(0, 0, 0);
    box.unite(of(63, 63, 63));
    return box;
  }

  /// The empty box.
  PackedBox() = default;
  [[nodiscard]] bool empty() const { return bytes_ == ~std::uint64_t{0}; }

  void unite(const PackedBox& other) {
    const auto a = std::bit_cast<Bytes>(bytes_);
    const auto b = std::bit_cast<Bytes>(other.bytes_);
    bytes_ = std::bit_cast<std::uint64_t>(a < b ? a : b);
  }
  [[nodiscard]] IBox box() const {
    const auto byte = [&](int i) { return static_cast<int>(bytes_ >> (8 * i) & 255U); };
    return {{byte(0), byte(1), byte(2)}, {256 - byte(4), 256 - byte(5), 256 - byte(6)}};
  }

 private:
  using Bytes = std::uint8_t __attribute__((vector_size(8)));
  explicit PackedBox(std::uint64_t bytes) : bytes_(bytes) {}

  std::uint64_t bytes_ = ~std::uint64_t{0};
};

/// The chunks that a change of voxels affects, as a bit for each of the 27 offsets in Neighbourhood, and the box of the
/// changed voxels. A bit is set if that chunk contains a changed voxel or one of its 26 neighbours.
struct VoxelRecord {
  static constexpr std::uint32_t kCentreOnly = std::uint32_t{1} << 13;

  IVec3 chunk{0};
  std::uint32_t neighbours = 0;
  PackedBox box;
  PackedBox data;  ///< box of changed data, including voxels that also changed type
  ChunkSlabs slabs;
  bool is_edit = true;  ///< false: only loaded or unloaded

  /// Adds changed voxels of a row.
  void add(int y, int z, std::uint64_t changed) {
    const unsigned x_sides = 0b010U | static_cast<unsigned>(changed & 1) | static_cast<unsigned>(changed >> 63) << 2;
    const unsigned y_sides = sides(y);
    const unsigned z_sides = sides(z);
    for (unsigned dz = 0; dz < 3; ++dz) {
      for (unsigned dy = 0; dy < 3; ++dy) {
        if (((z_sides >> dz) & (y_sides >> dy) & 1U) != 0) neighbours |= x_sides << (dz * 9 + dy * 3);
      }
    }
    box.unite(PackedBox::of_row(y, z, changed));
    slabs.add(y, z);
  }
  /// Adds a changed voxel. Most are on no side of the chunk.
  void add_voxel(int x, int y, int z) {
    if (((sides(x) | sides(y) | sides(z)) & 0b101U) != 0) return add(y, z, std::uint64_t{1} << x);
    neighbours |= kCentreOnly;
    box.unite(PackedBox::of(x, y, z));
    slabs.add(y, z);
  }
  /// Adds all voxels of a non-empty box.
  void add_box(const IBox& all) {
    QUOIN_ASSERT(!all.empty(), "changed voxels");
    neighbours = kEverywhere;
    box.unite(PackedBox::of(all.min.x, all.min.y, all.min.z));
    box.unite(PackedBox::of(all.max.x - 1, all.max.y - 1, all.max.z - 1));
    slabs.add(ChunkSlabs::of(all));
  }
  /// Marks everything as possibly changed, for an interrupted edit.
  void add_all() {
    neighbours = kEverywhere;
    box = PackedBox::of_chunk();
    slabs = ChunkSlabs::all();
  }
  void merge(const VoxelRecord& other) {
    neighbours |= other.neighbours;
    box.unite(other.box);
    data.unite(other.data);
    slabs.add(other.slabs);
    is_edit |= other.is_edit;
  }
  [[nodiscard]] bool has_types() const { return !box.empty(); }
  [[nodiscard]] bool has_data() const { return !data.empty(); }
  [[nodiscard]] ChunkChange change() const { return {chunk, box.box(), neighbours, slabs, is_edit}; }

 private:
  static constexpr std::uint32_t kEverywhere = (std::uint32_t{1} << 27) - 1;

  static unsigned sides(int local) {
    return 0b010U | static_cast<unsigned>(local == 0) | static_cast<unsigned>(local == kChunkEdge - 1) << 2;
  }
};

/// The changes that an edit makes to one chunk of voxels.
struct VoxelEdit {
  std::int64_t voxels = 0;
  int data_before = 0;  ///< voxels with data before the edit; a changed type removes data
  VoxelRecord record{};

  void add(int y, int z, std::uint64_t changed) {
    if (changed == 0) return;
    voxels += std::popcount(changed);
    record.add(y, z, changed);
  }
  void add_voxel(int x, int y, int z) {
    ++voxels;
    record.add_voxel(x, y, z);
  }
  void add_all() {
    voxels = kChunkVoxels;
    record.add_all();
  }
};

/// The distance from a chunk's changed samples to each of its neighbours. It answers exactly if a neighbour that reads
/// `reach` samples past its own reads a changed one.
class ChangeReach {
 public:
  ChangeReach() { least_.fill(kNever); }

  /// Adds changed samples of a row.
  void add(int y, int z, std::uint64_t changed) {
    if (changed == 0) return;
    samples += std::popcount(changed);
    const std::array<std::uint8_t, 3> x_steps = {static_cast<std::uint8_t>(std::countr_zero(changed) + 1), 0,
                                                 static_cast<std::uint8_t>(std::countl_zero(changed) + 1)};
    const std::array<std::uint8_t, 3> y_steps = steps(y);
    const std::array<std::uint8_t, 3> z_steps = steps(z);
    for (std::size_t i = 0; i < least_.size(); ++i) {
      const std::uint8_t farthest = std::max({x_steps[i % 3], y_steps[i / 3 % 3], z_steps[i / 9]});
      least_[i] = std::min(least_[i], farthest);
    }
    box_.unite(PackedBox::of_row(y, z, changed));
  }

  /// Marks everything as possibly changed, for an interrupted edit.
  void add_all() {
    samples = kChunkVoxels;
    for (std::size_t i = 0; i < least_.size(); ++i) least_[i] = i == 13 ? 0 : 1;
    box_ = PackedBox::of_chunk();
  }

  void add(const ChangeReach& other) {
    samples += other.samples;
    for (std::size_t i = 0; i < least_.size(); ++i) least_[i] = std::min(least_[i], other.least_[i]);
    box_.unite(other.box_);
  }

  [[nodiscard]] bool is_within(int reach, int dx, int dy, int dz) const {
    return least_[static_cast<std::size_t>(Neighbourhood::index(dx, dy, dz))] <= reach;
  }
  [[nodiscard]] DensityChange change(IVec3 chunk, bool is_edit = true) const {
    return {chunk, box_.box(), least_, is_edit};
  }

  std::int64_t samples = 0;

 private:
  static constexpr std::uint8_t kNever = 255;

  // For the previous chunk, this one and the next: number of samples past its own that a chunk must read to be
  // affected.
  static std::array<std::uint8_t, 3> steps(int local) {
    return {static_cast<std::uint8_t>(local + 1), 0, static_cast<std::uint8_t>(kChunkEdge - local)};
  }

  std::array<std::uint8_t, 27> least_{};  ///< [(dz + 1) * 9 + (dy + 1) * 3 + (dx + 1)]
  PackedBox box_;
};

/// The record type of a grid's journal.
struct DensityRecord {
  IVec3 chunk{0};
  ChangeReach reach;

  bool is_edit = true;  ///< as in VoxelRecord

  void merge(const DensityRecord& other) {
    reach.add(other.reach);
    is_edit |= other.is_edit;
  }
  [[nodiscard]] DensityChange change() const { return reach.change(chunk, is_edit); }
};

/// The differences between two states of a chunk; null means all air.
struct ChunkDifference {
  ChangeReach solid;  ///< voxels that are air in only one state
  ChangeReach types;  ///< voxels of different types, including `solid`
};

/// Records in `edit` the voxels whose type changes. Ignores data.
void difference_of_types(const Chunk& before, const Chunk& after, VoxelEdit& edit);

/// Calls `visit` for the rows that differ between two states of a chunk, by z, then y; null means all air.
/// Requires: the states are equal outside of the box `within` and of `slabs`. `chunk`: the chunk's coordinates.
void visit_other_rows(const Chunk* before, const Chunk* after, IVec3 chunk, const IBox& within, const ChunkSlabs& slabs,
                      FunctionRef<void(const RowChange&)> visit);

/// Requires: the states are equal outside of the box. Cost: O(rows of 64 voxels of the box); about 20 microseconds for
/// a chunk if both share their storage layout, as after a few edits.
[[nodiscard]] ChunkDifference difference(const Chunk* before, const Chunk* after, const IBox& within = kWholeChunk);

}  // namespace quoin

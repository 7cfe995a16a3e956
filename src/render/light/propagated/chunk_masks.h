#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/propagated_light.h>

#include "render/light/propagated/light_chunk.h"

namespace quoin::propagated {

/// Returns the lamp light that a type emits; 0 for most types. An `emission` of 1 or more gives level 15 in the
/// brightest channel of the type's colour, and the other channels in proportion to their sRGB values. A lower emission
/// scales the levels. `sky` is 0. Levels are per voxel, as in block games: shares of faces (VoxelFace::emission_share)
/// make no difference.
[[nodiscard]] LightLevels lamp_levels(const VoxelProperties& properties);

/// The light properties of a voxel type.
struct TypeLight {
  std::uint16_t lamp = 0;    ///< packed levels that it emits
  std::uint8_t passes = 15;  ///< bit c: channel c passes, and loses one level per step; light of the sky falls freely
  std::uint8_t tolls = 0;    ///< bit c: channel c enters and loses `cost` levels
  std::uint8_t cost = 1;
  bool absorbs = false;    ///< light that enters does not leave
  bool has_sides = false;  ///< its shapes may cover sides, through which no light passes

  bool operator==(const TypeLight&) const = default;
};

/// Returns the light properties of a type. Unregistered types are opaque and dark.
[[nodiscard]] inline TypeLight light_of(const std::vector<TypeLight>& types, VoxelType type) {
  return type < types.size() ? types[type] : TypeLight{0, 0};
}

/// Sets how light passes a type. `colours`: bit c: the type's colour lets channel c through, which holds for the sky.
void set_passage(const VoxelRegistry& types, VoxelType type, unsigned colours, TypeLight& light);

/// Returns the light properties of all types, by id.
[[nodiscard]] std::vector<TypeLight> type_lights(const VoxelRegistry& types, const PropagatedLightOptions& options);
/// Returns true if the shapes of any type may cover sides.
[[nodiscard]] bool has_sides(const std::vector<TypeLight>& lights);

/// Returns true if light of a channel passes voxels of a type as it passes air.
[[nodiscard]] inline bool passes(const std::vector<TypeLight>& types, VoxelType type, std::size_t channel) {
  return type == kAir || (light_of(types, type).passes >> channel & 1U) != 0;
}

/// Finds the sides that shapes of a chunk cover, through which no light passes.
class CoveredSides {
 public:
  /// `types`: null if no type covers sides. Lifetime: that of grid, types and lights. Cost: O(types of the chunk).
  CoveredSides(const Grid& grid, const VoxelRegistry* types, const std::vector<TypeLight>& lights, IVec3 chunk);

  /// Returns true if no shape of the chunk covers a side.
  [[nodiscard]] bool none() const { return shaped_.empty(); }
  /// Returns the voxels of a row whose shapes may cover sides.
  [[nodiscard]] std::uint64_t row(int y, int z) const;
  /// Returns the covered sides of a voxel of such a row.
  [[nodiscard]] DirectionSet at(IVec3 local) const;
  /// Returns the voxels of a row, of those in `where`, that cover a side.
  [[nodiscard]] std::uint64_t covered(int y, int z, Direction side, std::uint64_t where) const;

 private:
  const VoxelRegistry* types_;
  std::vector<VoxelType> shaped_;
  Neighbourhood near_{};
};

/// Columns of voxels in a column of chunks: [z % 64], bit x % 64.
using ColumnSet = std::array<std::uint64_t, kChunkEdge>;

[[nodiscard]] inline bool is_any(const ColumnSet& columns) {
  return std::any_of(columns.begin(), columns.end(), [](std::uint64_t row) { return row != 0; });
}

/// Lets sky columns fall from row `end` to row `begin` of a chunk, and out of it. Removes the columns that stop.
/// Returns the lowest row reached, or `end` if there is none. `voxels`: null if all is air. `sides`: of the chunk.
/// Cost: O(rows of 64 voxels until all columns stop); O(types) if none stops sky light.
int fall(const Chunk* voxels, const std::vector<TypeLight>& types, const CoveredSides& sides, int begin, int end,
         ColumnSet& open);

/// Masks of a box of a chunk: the voxels that light passes and the lamps. Reused between calls: buffers only grow.
class ChunkMasks {
 public:
  struct LampRow {
    std::uint8_t y, z;
    std::uint16_t lamp;  // packed levels
    std::uint64_t where;
  };

  /// A row with voxels that cover sides.
  struct SideRow {
    std::uint8_t y, z;
    std::array<std::uint64_t, 6> covered;  // by Direction
  };

  /// The voxels that light of some channels enters at a cost of one kind.
  struct Toll {
    TypeLight like;  // its `tolls`, `cost` and `absorbs`
    bool is_uniform = true;
    std::uint64_t uniform = 0;         // the rows of the box if they are equal
    BlockVector<std::uint64_t> words;  // else as `rows`

    [[nodiscard]] bool is_of(const TypeLight& type) const {
      return type.tolls == like.tolls && type.cost == like.cost && type.absorbs == like.absorbs;
    }
    [[nodiscard]] const std::uint64_t* rows() const { return is_uniform ? nullptr : words.data(); }
  };

  /// `voxels`: null if all is air. `sides`: of the chunk. `lamp_slabs`: all slabs with lamps, maybe more. Unregistered
  /// types are opaque. Cost: O(rows of the box, and voxels of it whose shapes may cover sides).
  void read(const Chunk* voxels, const std::vector<TypeLight>& types, const CoveredSides& sides, const IBox& box,
            const SlabSet& lamp_slabs);

  /// Returns the rows of the box, [y + 64 z]; null if all are `uniform`.
  [[nodiscard]] const std::uint64_t* rows(std::size_t channel) const {
    QUOIN_ASSERT(channel < kChannels, "one of the channels");
    const Rows& found = rows_[rows_of_[channel]];
    return found.is_uniform ? nullptr : found.words.data();
  }
  [[nodiscard]] std::uint64_t uniform(std::size_t channel) const {
    QUOIN_ASSERT(channel < kChannels && rows(channel) == nullptr, "a channel with equal rows");
    return rows_[rows_of_[channel]].uniform;
  }
  /// Returns true if two channels have the same mask.
  [[nodiscard]] bool are_alike(std::size_t a, std::size_t b) const {
    QUOIN_ASSERT(a < kChannels && b < kChannels, "two of the channels");
    return rows_of_[a] == rows_of_[b];
  }
  [[nodiscard]] std::span<const LampRow> lamps() const { return lamps_; }
  /// The voxels that are in no row of a channel, but that its light enters.
  [[nodiscard]] std::span<const Toll> tolls() const { return {tolls_.data(), toll_count_}; }
  /// The rows of the box with covered sides.
  [[nodiscard]] std::span<const SideRow> side_rows() const { return side_rows_; }
  /// Returns the voxels of a row that light of a channel enters and does not leave.
  [[nodiscard]] std::uint64_t absorbing(std::size_t channel, int y, int z) const {
    std::uint64_t found = 0;
    for (const Toll& toll : tolls()) {
      if (!toll.like.absorbs || (toll.like.tolls >> channel & 1U) == 0) continue;
      found |= toll.is_uniform ? toll.uniform : toll.words[static_cast<std::size_t>(y + kChunkEdge * z)];
    }
    return found;
  }
  /// Slabs that were examined and contain no lamp.
  [[nodiscard]] const SlabSet& without_lamps() const { return without_lamps_; }

 private:
  struct Rows {
    bool is_uniform = true;
    std::uint64_t uniform = 0;
    BlockVector<std::uint64_t> words;
  };
  void read_rows(const Chunk& voxels, const std::vector<TypeLight>& types, std::size_t channel, const IBox& box);
  void read_tolls(const Chunk& voxels, const std::vector<TypeLight>& types, const IBox& box);
  void read_lamps(const Chunk& voxels, const std::vector<TypeLight>& types, const IBox& box, const SlabSet& slabs);
  void add_lamps(const Chunk& voxels, const std::vector<TypeLight>& types, int y, int z, std::uint64_t where);
  void read_sides(const CoveredSides& sides, const IBox& box);

  std::array<Rows, kChannels> rows_;
  std::array<std::size_t, kChannels> rows_of_{};  // [channel]: which of them
  BlockVector<LampRow> lamps_;
  BlockVector<SideRow> side_rows_;
  std::vector<Toll> tolls_;  // the first `toll_count_` are in use
  std::size_t toll_count_ = 0;
  SlabSet without_lamps_{};
  std::vector<VoxelType> found_;
};

}  // namespace quoin::propagated

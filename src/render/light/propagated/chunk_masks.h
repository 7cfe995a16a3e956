#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/propagated_light.h>

#include "render/light/propagated/light_chunk.h"

namespace quoin::propagated {

/// Returns the lamp light that a type emits; 0 for most types. An `emission` of 1 or more gives level 15 in the
/// brightest channel of the type's colour, and the other channels in proportion to their sRGB values. A lower emission
/// scales the levels. `sky` is 0.
[[nodiscard]] LightLevels lamp_levels(const VoxelProperties& properties);

/// The light properties of a voxel type.
struct TypeLight {
  std::uint16_t lamp = 0;    ///< packed levels that it emits
  std::uint8_t passes = 15;  ///< bit c: channel c

  bool operator==(const TypeLight&) const = default;
};

/// Masks of a box of a chunk: the voxels that light passes and the lamps. Reused between calls: buffers only grow.
class ChunkMasks {
 public:
  struct LampRow {
    std::uint8_t y, z;
    std::uint16_t lamp;  // packed levels
    std::uint64_t where;
  };

  /// `voxels`: null if all is air. `lamp_slabs`: all slabs with lamps, maybe more. Unregistered types are opaque. Cost:
  /// O(rows of the box).
  void read(const Chunk* voxels, const std::vector<TypeLight>& types, const IBox& box, const SlabSet& lamp_slabs);

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
  /// Slabs that were examined and contain no lamp.
  [[nodiscard]] const SlabSet& without_lamps() const { return without_lamps_; }

 private:
  struct Rows {
    bool is_uniform = true;
    std::uint64_t uniform = 0;
    std::vector<std::uint64_t> words;
  };
  void read_rows(const Chunk& voxels, const std::vector<TypeLight>& types, std::size_t channel, const IBox& box);
  void read_lamps(const Chunk& voxels, const std::vector<TypeLight>& types, const IBox& box, const SlabSet& slabs);
  void add_lamps(const Chunk& voxels, const std::vector<TypeLight>& types, int y, int z, std::uint64_t where);

  std::array<Rows, kChannels> rows_;
  std::array<std::size_t, kChannels> rows_of_{};  // [channel]: which of them
  std::vector<LampRow> lamps_;
  SlabSet without_lamps_{};
  std::vector<VoxelType> found_;
};

}  // namespace quoin::propagated

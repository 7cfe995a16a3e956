#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>

#include "render/light/propagated/chunk_masks.h"
#include "render/light/propagated/light_chunk.h"
#include "render/light/propagated/light_store.h"

namespace quoin::propagated {

/// Maximum number of steps from a light source until light is dark.
inline constexpr int kReach = 14;
inline constexpr unsigned kAllChannels = (1U << kChannels) - 1;

/// A box per channel, in grid coordinates. Outside of it, an edit changes no light of the channel.
using LightBoxes = std::array<IBox, kChannels>;

/// Returns the box around the boxes of all channels.
[[nodiscard]] inline IBox around_all(const LightBoxes& boxes) {
  IBox all;
  for (const IBox& box : boxes) all = unite(all, box);
  return all;
}
[[nodiscard]] inline std::int64_t volume(const IBox& box) {
  const IVec3 size = box.size();
  return std::int64_t{size.x} * size.y * size.z;
}
/// Returns the number of rows of up to 64 voxels in a box.
[[nodiscard]] inline std::uint64_t rows_of(const IBox& box) {
  const IVec3 size = box.size();
  return static_cast<std::uint64_t>(std::int64_t{(size.x + kChunkEdge - 1) / kChunkEdge} * size.y * size.z);
}

/// A chunk in a region or next to it.
struct ChunkAround {
  bool is_held = false;               ///< false: its light is constant, either dark ...
  bool is_open = false;               ///< ... or all sky
  const ChunkMasks* masks = nullptr;  ///< if held: masks of the chunk's part of the region
  const LightChunk* light = nullptr;  ///< null: dark
  IBox unknown;                       ///< box of the chunk whose light is not valid
};

/// The voxels to compute light for.
struct LightRegion {
  struct Box {
    IBox voxels;  ///< all visited voxels
    IBox wanted;  ///< some of these

    bool operator==(const Box&) const = default;
  };
  std::array<Box, kChannels> channels;  ///< empty: that channel stays as it is
  Box all;                              ///< around these
  IBox chunks;                          ///< the chunks of `all.voxels` and their neighbours
  std::vector<ChunkAround> around;      ///< [x, y, z] of these, x fastest

  [[nodiscard]] std::size_t index(IVec3 chunk) const {
    QUOIN_ASSERT(chunks.contains(chunk), "a chunk in the region or next to it");
    const IVec3 p = chunk - chunks.min;
    const IVec3 size = chunks.max - chunks.min;
    return static_cast<std::size_t>(p.x + size.x * (p.y + size.y * p.z));
  }
  [[nodiscard]] const ChunkAround& at(IVec3 chunk) const { return around[index(chunk)]; }
  [[nodiscard]] ChunkAround& at(IVec3 chunk) { return around[index(chunk)]; }
};

/// Computes the light in a region from the light around it. Reused for many regions: buffers only grow.
///
/// Levels are spread as sets of 64 voxels, from 15 down:
///
///   front[L] = source[L] | (front[L + 1] moved by one along each axis, where light passes and it is dark)
///
/// Sources are the lamps and the light at the region's rim, one voxel around it. One pass over the levels gives every
/// voxel its final level, since no voxel is lit by a lower one. Sky light of level 15 falls first. Each level processes
/// only the blocks of rows next to blocks that contain the previous level.
///
/// Covered sides of shapes stop light between two voxels: a mask per axis says where the side towards the next lower
/// voxel is open. Regions without covered sides do not read these masks.
///
/// Voxels that cost more, or that light does not leave, are in none of these sets. A front of level L that reaches one
/// makes it a source of level L - cost: the first front is the highest, so each becomes a source once.
///
///   words [z][column][y]: bit x of the region is bit x % 64 of column x / 64; x, y and z count from the rim
class LightSolver {
 public:
  /// Returns true if a region of this size fits into the 64-bit block masks.
  [[nodiscard]] static bool fits(IVec3 size);

  /// Returns the visited voxels of a box, extended along x to all that light can reach the wanted voxels from. The rim
  /// there is not read then, which costs more than voxels in words that are visited anyway. Leaves out a side where
  /// more words, or another chunk than that of the rim, would be visited.
  [[nodiscard]] static IBox widened(const LightRegion::Box& box);

  /// Computes the new light of the wanted voxels. The result equals a solution for all voxels if the rim voxels with
  /// unknown light are more than 14 away, and the others have their correct light. `changes`: one entry per chunk with
  /// wanted voxels, x fastest. Requires: fits(all.voxels.size()).
  void solve(const LightRegion& region, std::vector<ChunkLightChange>& changes);

  /// Returns temporary masks for chunks without cached ones. They are reused.
  [[nodiscard]] ChunkMasks& own_masks(std::size_t i) {
    while (own_masks_.size() <= i) own_masks_.push_back(std::make_unique<ChunkMasks>());
    return *own_masks_[i];
  }

 private:
  struct Source {
    std::uint32_t at;
    std::uint16_t z;
    std::uint16_t block;
    std::uint64_t where;
  };
  struct Part;  // of a chunk
  // The voxels of the region that light enters at a cost of one kind.
  struct Toll {
    unsigned cost = 1;
    bool absorbs = false;
    BlockVector<std::uint64_t> left;    // those that no front has reached
    BlockVector<std::uint64_t> blocks;  // [z]: blocks with such voxels
  };
  void solve(const LightRegion::Box& box, unsigned channels, std::vector<ChunkLightChange>& changes);
  void shape(const LightRegion::Box& box);
  template <class Visit>
  void for_each_part(const IBox& box, Visit&& visit) const;
  void read_rim();
  void read_light(const Part& part);
  void read_channel(const Part& part, std::size_t channel, const ChannelLight& light, const IBox& unknown);
  void open(const Part& part);
  void read_inside();
  void read_pass(std::size_t channel);
  void read_sides();
  void close_sides(int axis, IVec3 first, std::uint64_t where);
  void put_rows(const Part& part, const std::uint64_t* rows, std::uint64_t uniform, BlockVector<std::uint64_t>& to);
  void find_passable();
  void add_sky(IVec3 first, std::uint64_t where);
  void read_tolls(std::size_t channel);
  void pay_tolls(std::size_t channel, unsigned level);
  template <bool kHasSides>
  void pay_toll(Toll& toll, std::size_t z, unsigned block, BlockVector<Source>& out);
  [[nodiscard]] std::uint64_t blocks_near_front(std::size_t z) const;
  void touch(const Source& source);
  void absorb(const Source& source, unsigned level);
  void add_sources(std::size_t channel, const RowPlanes& planes, IVec3 first, std::uint64_t mask);
  void add_source(std::size_t channel, unsigned level, IVec3 first, std::uint64_t where);
  void add_word(std::size_t channel, unsigned level, int column, IVec3 at, std::uint64_t where);
  [[nodiscard]] bool has_sources(std::size_t channel) const;
  void light_up(const Source& source, unsigned level);
  void spread(std::size_t channel);
  [[nodiscard]] std::uint64_t blocks_near(int margin) const;
  void activate(unsigned level);
  [[nodiscard]] LevelPass step_to(unsigned level);
  void clear_fronts();
  void complete_planes();
  void write(std::size_t channel, std::vector<ChunkLightChange>& changes);
  bool write_open(const Part& part, const ChannelLight& before, ChunkLightChange& change) const;
  void write_chunk(const Part& part, std::size_t channel, ChunkLightChange& change);
  [[nodiscard]] std::uint64_t touched_blocks(const Part& part, int z) const;
  [[nodiscard]] std::uint64_t blocks_of_slab(const Part& part, int y) const;
  void read_slab(const Part& part, int y, int z, SlabPlanes& now) const;

  const LightRegion* region_ = nullptr;
  LightRegion::Box box_;   // the visited box
  unsigned channels_ = 0;  // bit c: channel c is
  IVec3 size_{0};          // of the box
  IVec3 origin_{0};        // its rim's lowest voxel
  std::size_t columns_ = 0;
  std::size_t blocks_ = 0;  // of a column
  std::size_t column_ = 0;  // words
  std::size_t layer_ = 0;
  std::array<std::array<BlockVector<Source>, 16>, kChannels> sources_;  // [channel][level]
  std::vector<std::unique_ptr<ChunkMasks>> own_masks_;
  std::array<BlockVector<std::uint64_t>, 3> open_sides_;  // by axis, see LevelPass
  bool has_sides_ = false;                                // some chunk of the region has covered sides
  bool has_tolls_ = false;                                // some chunk of the region has any
  std::vector<Toll> tolls_;                               // the first `toll_count_` are in use
  std::size_t toll_count_ = 0;                            // of the channel
  BlockVector<std::uint64_t> lit_tolls_;                  // with tolls: voxels that are sources and were lit
  std::array<BlockVector<Source>, 16> absorbed_;          // [level]: voxels that absorb light
  bool has_sky_ = false;                                  // there is sky light that is not in `sources_`
  bool is_clean_ = true;  // `front_`, `next_` and `absorbed_` are empty: no region failed
  BlockVector<std::uint64_t> pass_;
  BlockVector<std::uint64_t> rest_;   // dark voxels of pass_, in touched blocks
  BlockVector<std::uint64_t> front_;  // voxels of the current level; all 0 between regions
  BlockVector<std::uint64_t> next_;   // voxels of the level above, then of the level below; all 0 between regions
  std::array<BlockVector<std::uint64_t>, kPlanes> plane_words_;
  std::array<std::uint64_t*, kPlanes> planes_{};  // bits of levels, within these
  BlockVector<std::uint64_t> wanted_bits_;        // [column]

  // [z]: blocks
  BlockVector<std::uint64_t> passable_, open_, active_, touched_;
  BlockVector<std::uint64_t> in_front_, in_next_;  // where `front_` and `next_` are not 0
  enum class Outcome : std::uint8_t { Dark, Open, Mixed } outcome_ = Outcome::Dark;
};

}  // namespace quoin::propagated

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/grid/chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/trace/occupancy_tree.h>

#include "render/vulkan/trees/shader_data.h"
#include "trace/density/density_glass.h"

namespace quoin::vulkan {

/// A chunk as shaders read it: its part of the opaque and of the transparent tree, and the types of its voxels.
///
///   Per tree with voxels of the chunk, aligned to 32 bytes: a header (type address, bits per voxel, offset of the
///   voxel words; for a chunk of one type 0 bits and that type), the nodes of its bricks, the words of their cells.
///   Then the types: slabs, palette and words in the layout of ChunkStorage.
struct ChunkRecord {
  std::vector<std::uint32_t> words;
  Node opaque;  ///< of the whole chunk; mask 0 without such voxels
  Node transparent;
  Node field;
  Node glass;

  /// Makes the addresses, which count from the record's beginning, absolute. Called once.
  void move_to(std::uint64_t address);

 private:
  friend class RecordWriter;
  std::vector<std::size_t> addresses_;  // their indices in `words`
};

/// Packs a chunk of voxels. `transparent` may be null.
[[nodiscard]] ChunkRecord pack_chunk(const OccupancyTree& opaque, const OccupancyTree* transparent, const Chunk& voxels,
                                     IVec3 chunk);

/// Packs a field chunk: like a chunk of voxels, a tree of the cells that touch its solid, with the materials of its
/// samples. The words of a brick's cells are followed by one number per word: the offset of its samples in words from
/// the header (see kFieldBlockEdge), 0 if all of them are solid. Only solid bricks and chunks count as full.
/// Requires: `cells` has cells in the chunk.
[[nodiscard]] ChunkRecord pack_field_chunk(const OccupancyTree& cells, const DensityGrid& field, IVec3 chunk);
/// Packs the transparent part of a field's chunk: a tree of the cells that touch it. A word's number gives its samples'
/// position (densities and bodies), or its single type. No brick or chunk counts as full.
[[nodiscard]] ChunkRecord pack_glass_chunk(const DensityGlass& glass, IVec3 chunk);
/// The number of samples that such a record reads beyond the chunk.
constexpr int kFieldRecordReach = 2;

/// The nodes above chunks.
struct TopTree {
  Node root;
  int root_level = 2;
  std::vector<Node> nodes;
};

struct ChunkNodeAt {
  IVec3 chunk{0};  ///< from the tree's origin: not negative
  Node node;
};

/// Builds the nodes above chunks. `address`: device address of the nodes.
[[nodiscard]] TopTree build_top_tree(std::vector<ChunkNodeAt> chunks, std::uint64_t address);

}  // namespace quoin::vulkan

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/trace/occupancy_tree.h>

#include "grid/shapes/shape_index.h"
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
  Node shapes;

  /// Makes the addresses, which count from the record's beginning, absolute. Called once.
  void move_to(std::uint64_t address);

 private:
  friend class RecordWriter;
  std::vector<std::size_t> addresses_;  // their indices in `words`
};

/// Packs a chunk of voxels. `transparent` may be null. With `types`, the voxels' types are preceded by the voxels that
/// their state turns otherwise than `state_turn(orientations of their type, 0)`: the voxel's number x + 64 y + 4096 z,
/// plus its turn from bit 18 on; ascending, then their count.
[[nodiscard]] ChunkRecord pack_chunk(const OccupancyTree& opaque, const OccupancyTree* transparent, const Chunk& voxels,
                                     IVec3 chunk, const VoxelRegistry* types = nullptr);

/// Returns the turn from a cube in the grid to the unturned cube, for a state: three bits per axis of the unturned
/// cube, the number of the grid's axis there, plus 4 if it points against it.
[[nodiscard]] std::uint32_t state_turn(const StateOrientations& orientations, std::uint32_t state);
/// Returns an orientation in the same form: how `apply` moves the axes.
[[nodiscard]] std::uint32_t turn_bits(const AxisOrientation& orientation);

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

/// Packs the shapes that touch voxels of a chunk: a tree of the voxels in `cells`, and their lists (shapes.glsl).
/// `with`: returns true for shapes that belong to the lists; every voxel in `cells` has one of them in `index`. No
/// brick or chunk counts as full.
[[nodiscard]] ChunkRecord pack_shapes_chunk(const OccupancyTree& cells, const ShapeIndex& index, IVec3 chunk,
                                            FunctionRef<bool(const PlacedShape&)> with,
                                            FunctionRef<ShaderShape(const PlacedShape&)> shape_of);

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

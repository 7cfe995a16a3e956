#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

namespace trace {
struct TreeView;
}  // namespace trace

/// Which voxels a tree holds.
enum class Occupancy : std::uint8_t {
  NonAir,       ///< whatever a ray can hit
  Opaque,       ///< what blocks light
  Transparent,  ///< what tints it
};

/// The traversal structure: which voxels of a grid are occupied, as bits, at every level of detail.
///
/// One shape serves all levels: a node is 16^3 units as 64 words, each the bits of 4^3 units (x + 4 y + 16 z). In a
/// brick a unit is a voxel; in a chunk a cell of 4^3 voxels; in a region a chunk. Empty and full bricks are stored
/// once.
///
/// Memory:  about 0.15 bytes a solid voxel of a terrain.
/// Threads: any number may read at once; an update needs the tree to itself.
class OccupancyTree {
 public:
  /// Bits of 16^3 units: word [z / 4][y / 4][x / 4], bit x % 4 + 4 (y % 4) + 16 (z % 4).
  using Node = std::array<std::uint64_t, 64>;

  /// Of 64^3 voxels: which 4^3 cells hold any, and where the bricks of 16^3 voxels lie.
  struct ChunkNode {
    Node cells{};                            ///< word b: the cells of brick b
    std::array<std::uint32_t, 64> bricks{};  ///< index into `bricks()`; 0 is empty, 1 is full
  };

  /// Of 16^3 chunks.
  struct RegionNode {
    Node chunks{};                            ///< which chunks hold any voxel
    std::array<std::uint32_t, 4096> nodes{};  ///< index into `chunk_nodes()`, x + 16 y + 256 z; 0 is none
  };

  /// Two tables over the box of chunks around everything: what kernels of many rays read instead of regions and chunk
  /// nodes, since an address is then a sum of products.
  struct FlatTables {
    IVec3 origin{0};                    ///< the voxel at the least corner
    IVec3 chunks{0};                    ///< size
    std::vector<std::uint32_t> cells;   ///< a bit a cell of 4^3 voxels; one empty cell around everything
    std::vector<std::uint32_t> bricks;  ///< indices into `bricks()`, x first, then y, then z

    /// Cells from one to the next along x, y, z; cell (0, 0, 0) is bit x + y + z of these.
    [[nodiscard]] IVec3 cell_strides() const {
      return {1, 16 * chunks.x + 2, (16 * chunks.x + 2) * (16 * chunks.y + 2)};
    }
    [[nodiscard]] IVec3 brick_strides() const { return {1, 4 * chunks.x, 16 * chunks.x * chunks.y}; }
  };

  OccupancyTree();
  OccupancyTree(OccupancyTree&&) noexcept;
  OccupancyTree& operator=(OccupancyTree&&) noexcept;
  ~OccupancyTree();

  /// From the grid's own storage. Cost: 5 to 20 microseconds a chunk that is not uniform.
  static OccupancyTree build(const Grid& grid, const VoxelRegistry& types, Occupancy which = Occupancy::NonAir);

  /// Takes over what an edit changed, in place; `chunks` are those that it touched (Grid::take_dirty names them).
  ///
  /// Cost: 5 to 20 microseconds a chunk, all of which is read while only bricks that differ are written, and a look at
  ///       the bounds of every other; when the box of chunks around everything grows or shrinks, the flat tables anew
  ///       besides.
  void update(const Grid& grid, const VoxelRegistry& types, std::span<const IVec3> chunks);

  /// The smallest box around the occupied voxels, to the voxel.
  [[nodiscard]] IBox bounds() const;
  [[nodiscard]] bool is_occupied(IVec3 voxel) const;
  /// Bytes held.
  [[nodiscard]] std::size_t bytes() const;

  /// Null where a region of 1,024^3 voxels is empty. Region coordinates are voxel coordinates / 1,024, rounded down.
  [[nodiscard]] const RegionNode* find_region(IVec3 region) const;
  [[nodiscard]] const ChunkNode* chunk_nodes() const;
  [[nodiscard]] const Node* bricks() const;
  /// Null where the world is so sparse (islands far apart) that the tables would be larger than all the rest.
  [[nodiscard]] const FlatTables* flat_tables() const;
  /// The same for the library's own kernels.
  [[nodiscard]] const trace::TreeView* view() const { return view_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  const trace::TreeView* view_ = nullptr;  // in `impl_`
};

}  // namespace quoin

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

#include "grid/halving/halving.h"

namespace quoin {

/// Makes one chunk of a halved grid.
///
/// The four rows of voxels that make a row of cells are masks of 64 bits, one a type; only the cells that hold several
/// types are examined one by one.
class ChunkHalver {
 public:
  ChunkHalver(const Grid& grid, const VoxelRegistry& types, IVec3 chunk) : masks_(grid, chunk), types_(&types) {}

  [[nodiscard]] Chunk make();

 private:
  /// The voxels of one type in the four rows [z][y] of half a row of cells, and the cells that contain it.
  struct Layer {
    VoxelType type = kAir;
    bool is_opaque = false;
    std::array<std::uint64_t, 4> voxels{};
    std::uint64_t cells = 0;
    std::uint64_t won = 0;  ///< the cells with several types that become this one
  };
  /// Cells of one type in a row of 64.
  struct Run {
    VoxelType type = kAir;
    std::uint64_t cells = 0;
  };
  /// The number of exposed faces per voxel of four rows, as bit planes.
  using Exposed = std::array<std::array<std::uint64_t, 3>, 4>;

  /// `half` of the row of cells at (y, z).
  void fill_half(int half, int y, int z, std::uint64_t solid);
  void find_layers(const Chunk& chunk, std::uint32_t slab, int half, int y, int z);
  void fill_mixed(int half, int y, int z, std::uint64_t mixed);
  /// Returns the heaviest of the layers in a cell.
  [[nodiscard]] std::size_t heaviest(const Exposed& exposed, int x) const;
  void add(VoxelType type, int half, std::uint64_t cells);

  HalvingMasks masks_;
  const VoxelRegistry* types_;
  std::vector<Layer> layers_;
  std::vector<Run> runs_;
};

}  // namespace quoin

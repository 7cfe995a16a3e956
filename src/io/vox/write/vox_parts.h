#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/grid.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/scene.h>

#include "io/vox/chunks.h"

namespace quoin {
struct VoxSource;
}

/// The parts of a .vox file made from a scene, before encoding.
namespace quoin::vox {

/// The mapping between colour indices and types.
struct TypeTable {
  std::vector<std::uint8_t> index_of_type;         ///< by type; 0 for types that do not occur
  std::array<VoxelProperties, kColours> by_index;  ///< entry 0 is unused
};

/// Makes the mapping. Types keep their ids as colour indices if all used types are below 256; otherwise the used types
/// are numbered in ascending order. Colour indices without a type get the default palette's colour.
///
/// Errors: LimitExceeded if more than 255 types are used.
[[nodiscard]] Result<TypeTable> make_type_table(const Scene& scene);

struct RevisedTypes {
  TypeTable table;
  std::int64_t replaced = 0;  ///< replaced palette colours that no voxel used
};

/// Makes the table for a scene that was read from a file: the types of its palette keep their indices. Other used types
/// take entries of the same look, otherwise entries of unused types, the least specific first: a duplicate plain
/// colour, or a colour of the default palette.
///
/// Errors: LimitExceeded if more than 255 types are used.
[[nodiscard]] Result<RevisedTypes> revise_type_table(const Scene& scene, const VoxSource& source);

/// A model to write, cut from a grid.
struct Piece {
  IVec3 min{0};            ///< the minimum corner in the grid
  IVec3 size{1};           ///< along Quoin's axes, at most 256 each
  std::size_t voxels = 0;  ///< number of voxels
};

/// Cuts a grid's declared box into pieces of at most 256 voxels per side, sorted by z, then y, then x. Pieces without
/// voxels are omitted unless all are empty.
[[nodiscard]] std::vector<Piece> cut_into_pieces(const SceneGrid& grid);

/// Writes the voxels of all pieces of a grid in XYZI form, each piece from its offset in `starts` on.
///
/// Requires: `pieces` were cut from this grid; the output has four bytes per voxel.
void write_voxels(const Grid& grid, const std::vector<std::uint8_t>& index_of_type, std::span<const Piece> pieces,
                  std::span<const std::size_t> starts, std::span<std::byte> out);

/// Returns the point of the grid at MagicaVoxel's pivot of that piece's model.
[[nodiscard]] DVec3 pivot_of(const Piece& piece);

// .vox files know only voxels of size 1.

/// Returns the common voxel size of all instances; nullopt if it is 1 or they differ.
[[nodiscard]] std::optional<double> common_voxel_size(const Scene& scene);

/// Returns the scene with voxels of size 1 and all positions divided by their size.
[[nodiscard]] Scene divided(const Scene& given, double voxel_size);
[[nodiscard]] LoadedScene divided(const LoadedScene& given, double voxel_size);

/// Returns the warning that the file does not store the voxel size.
[[nodiscard]] std::string size_warning(double voxel_size);

}  // namespace quoin::vox

namespace quoin {

/// Returns the warnings that write_vox would give. Errors: those of write_vox, except for files of more than 4 GiB.
[[nodiscard]] Result<std::vector<std::string>> vox_unsupported_features(const Scene& scene);
[[nodiscard]] Result<std::vector<std::string>> vox_unsupported_features(const LoadedScene& loaded);

/// Calls `visit(voxel, type)` for every non-air voxel of a chunk with minimum corner `origin`, by z, then y, then x.
///
/// Cost: O(rows within the tight bounds + voxels), so that scattered voxels are cheap.
template <class Visit>
void visit_voxels(const Chunk& chunk, IVec3 origin, Visit&& visit) {
  std::array<VoxelType, kChunkEdge> row{};
  const IBox box = chunk.bounds();
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      std::uint64_t solid = ~chunk.row_mask(y, z, kAir);
      if (solid == 0) continue;
      chunk.read_row(y, z, row);
      for (; solid != 0; solid &= solid - 1) {
        const int x = std::countr_zero(solid);
        visit(origin + IVec3{x, y, z}, row[static_cast<std::size_t>(x)]);
      }
    }
  }
}

/// Calls `visit(voxel, type)` for every non-air voxel, in the order of Grid::for_each.
template <class Visit>
void visit_voxels(const Grid& grid, Visit&& visit) {
  for (const IVec3 coords : grid.chunks()) visit_voxels(*grid.find_chunk(coords), coords * kChunkEdge, visit);
}

}  // namespace quoin

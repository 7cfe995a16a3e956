#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>

// The voxels of a grid in a scene file: pieces of some chunks each, which are gzip streams in base64.
//
//   chunk    int32 x, y, z          its coordinates: voxels / 64
//            uint32 n               types of its palette, 1 to 65,536
//            uint16 types[n]
//            if n > 1, 256 slabs of 64 x 4 x 4 voxels, by z / 4, then y / 4:
//              uint32 index         of the palette, for all of the slab; or 0xFFFFFFFF, and then
//              uint8 [128 * bits]   1,024 indices of `bits` bits, x fastest, then y, then z, from the lowest bit up;
//                                   `bits` is the first of 1, 2, 4, 8 and 16 with 2^bits >= n
//
// Little-endian; chunk after chunk to the end of the piece.
//
// The densities of a field, with their materials:
//
//   chunk    a chunk as above, of the materials
//            uint32 density         of all samples, as a half; or 0xFFFFFFFF, and then 256 slabs as above:
//              uint32 density       of all of the slab, as a half; or 0xFFFFFFFF, and then
//              uint8 low[1024], high[1024]  the two bytes of each half's difference, modulo 65,536, from the previous
//                                           half along x; the first in a row is relative to 0
//
// The data of voxels in addition to their types, chunk after chunk; a chunk may be spread over several pieces:
//
//   chunk    int32 x, y, z
//            uint32 n               number of voxels with data after this, 1 to 262,144; each has
//              uint32 place         x + 64 y + 4,096 z in the chunk, ascending
//              uint32 state
//              uint32 length        of its bytes, at most 65,536
//              uint8 bytes[length]

namespace quoin {

inline constexpr std::size_t kMaxSceneFileBytes = std::size_t{2} << 30;

/// The memory limit for all chunks of a file of this size, and the memory that a chunk counts as, including the tree
/// above it. Written files stay within it: if compressed voxels would exceed it, they are stored uncompressed.
[[nodiscard]] std::size_t max_voxel_bytes(std::size_t file_bytes);
[[nodiscard]] std::size_t voxel_bytes(const Chunk& chunk);
[[nodiscard]] std::size_t voxel_bytes(const DensityChunk& chunk);

enum class VoxelCompression : std::uint8_t { Stored, Small };

/// Returns the pieces of each grid, in the order of their chunks. Equal voxels give equal text, at any thread count.
/// Errors: Cancelled by `progress`.
[[nodiscard]] Result<std::vector<std::vector<std::string>>> encode_voxels(std::span<const Grid* const> grids,
                                                                          VoxelCompression compression, Threads threads,
                                                                          const Progress& progress);

/// As above, for fields.
[[nodiscard]] Result<std::vector<std::vector<std::string>>> encode_fields(std::span<const DensityGrid* const> fields,
                                                                          VoxelCompression compression, Threads threads,
                                                                          const Progress& progress);

/// Encodes the voxels' data in the same way; returns no pieces if there are none.
[[nodiscard]] Result<std::vector<std::vector<std::string>>> encode_data(std::span<const Grid* const> grids,
                                                                        VoxelCompression compression, Threads threads,
                                                                        const Progress& progress);

struct PlacedChunk {
  IVec3 place{0};
  Chunk voxels;
};

struct PlacedDensities {
  IVec3 place{0};
  DensityChunk samples{Half{0}};
};

/// Decodes the chunks of a piece.
///
/// Errors: BadFormat, with the character position in the text or the byte offset in its content; also for types of at
/// least `type_count`. LimitExceeded for a piece that would expand to more than 32 MiB, which the writer never
/// produces.
[[nodiscard]] Result<std::vector<PlacedChunk>> decode_voxels(std::string_view piece, std::size_t type_count);
/// As above, for a field with that band; also fails for densities outside the band.
[[nodiscard]] Result<std::vector<PlacedDensities>> decode_field(std::string_view piece, std::size_t type_count,
                                                                float band);

/// A well-formed piece of data; its voxels are checked when it is added to a grid.
struct DataPiece {
  std::vector<std::byte> bytes;
  std::size_t memory = 0;  ///< minimum memory in a grid
};
/// Returns the fault of a voxel's state, or "": more bits than its type allows.
[[nodiscard]] std::string find_state_error(IVec3 voxel, const VoxelData& data, const VoxelProperties& type);
/// Errors: as `decode_voxels`.
[[nodiscard]] Result<DataPiece> decode_data(std::string_view piece);
/// Calls `visit` for each voxel of a piece in order, until it returns false.
void for_each_data(const DataPiece& piece, FunctionRef<bool(IVec3 voxel, const VoxelData& data)> visit);

}  // namespace quoin

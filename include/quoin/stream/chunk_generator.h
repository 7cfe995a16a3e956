#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/store/stored_chunk.h>

namespace quoin {

/// Makes the chunks of a grid that its world does not hold yet: a landscape, another program's world.
///
/// Threads: `make` is called from several at once.
class ChunkGenerator {
 public:
  ChunkGenerator() = default;
  ChunkGenerator(const ChunkGenerator&) = delete;
  ChunkGenerator& operator=(const ChunkGenerator&) = delete;
  virtual ~ChunkGenerator() = default;

  /// The box of chunks (half open) outside of which all is air, which is never asked for; it must not change.
  [[nodiscard]] virtual IBox chunks() const = 0;
  /// One chunk, in types of the world's registry; densities within the band of the grid's field.
  /// Errors: whatever kept it from being made. The chunk is then air, and asked for anew when the world is opened
  ///         again; a StreamedWorld tells of it by `take_problems`. It throws nothing but bad_alloc.
  [[nodiscard]] virtual Result<StoredChunk> make(IVec3 chunk) const = 0;
};

/// A landscape without an end: the worlds of `generate_terrain` and `generate_smooth_terrain`, each of which is a piece
/// of it.
struct EndlessTerrain {
  std::uint64_t seed = 42;
  int height = 4;          ///< chunks from 0 upwards: 1 to 16
  bool is_smooth = false;  ///< a field of densities instead of voxels

  bool operator==(const EndlessTerrain&) const = default;
};

/// Its generator. Bits: as `generate_terrain`; each chunk is that of any piece of this height and seed that holds it,
/// but for what lies within a chunk of the piece's sides. It reaches 2^24 voxels from the origin.
/// Errors: InvalidArgument for heights out of their range; LimitExceeded where the registry is full: `types` gets the
///         landscape's (`add_terrain_types`).
[[nodiscard]] Result<std::shared_ptr<const ChunkGenerator>> make_terrain_generator(const EndlessTerrain& terrain,
                                                                                   VoxelRegistry& types);

}  // namespace quoin

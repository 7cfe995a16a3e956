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

/// Generates the chunks that a world does not hold yet: a landscape, or another program's world.
///
/// Threads: `make` is called from several threads at once.
class ChunkGenerator {
 public:
  ChunkGenerator() = default;
  ChunkGenerator(const ChunkGenerator&) = delete;
  ChunkGenerator& operator=(const ChunkGenerator&) = delete;
  virtual ~ChunkGenerator() = default;

  /// Returns the box of chunks (half open) that `make` can fill. Everything outside is air. The box must not
  /// change.
  [[nodiscard]] virtual IBox chunks() const = 0;
  /// Makes one chunk. It may contain only types of the world's registry, and densities within the band of the grid's
  /// field.
  /// Errors: any. The chunk is then air until the world is opened again, and StreamedWorld::take_problems reports the
  ///         error. Throws only bad_alloc.
  [[nodiscard]] virtual Result<StoredChunk> make(IVec3 chunk) const = 0;
};

/// An endless landscape. The worlds of `generate_terrain` and `generate_smooth_terrain` are pieces of it.
struct EndlessTerrain {
  std::uint64_t seed = 42;
  int height = 4;          ///< in chunks of 64 voxels, upwards from y = 0: 1 to 16
  bool is_smooth = false;  ///< makes a density field instead of voxels

  bool operator==(const EndlessTerrain&) const = default;
};

/// Returns the generator of an endless landscape and adds the landscape's types (`add_terrain_types`) to `types`. Each
/// chunk equals the chunk of any `generate_terrain` piece with the same height and seed, except within a chunk of the
/// piece's sides. The landscape extends 2^24 voxels from the origin.
/// Errors: InvalidArgument for a height out of range; LimitExceeded if the registry is full.
[[nodiscard]] Result<std::shared_ptr<const ChunkGenerator>> make_terrain_generator(const EndlessTerrain& terrain,
                                                                                   VoxelRegistry& types);

}  // namespace quoin

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/formats.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

/// Properties of a source that are known before its chunks are read.
struct ChunkSourceInfo {
  std::string format;                     ///< "minecraft", "luanti_map"
  std::string version;                    ///< of the program that wrote it, for display: "1.18.2"; empty: unknown
  std::string name;                       ///< of the world; may be empty
  double spacing = 1.0;                   ///< world units per voxel
  IBox chunks;                            ///< bounds of all chunks, in chunk coordinates
  std::optional<DVec3> spawn;             ///< the player's spawn point, in voxels of the source's grid
  std::vector<Error> broken{};            ///< files that cannot be read at all and are skipped
  std::vector<std::string> warnings{};    ///< one line per assumption
  std::string dimension{};                ///< Minecraft: the open dimension, "minecraft:overworld"; else empty
  std::vector<std::string> dimensions{};  ///< Minecraft: all dimensions, including the open one
  std::string packs{};  ///< identity of the resource packs that types have their looks from; empty: none
};

/// A chunk in the source's voxel types.
struct SourceChunk {
  IVec3 chunk{0};  ///< chunk coordinates, as in Grid::find_chunk
  Chunk voxels{kAir};
};

/// The content of one part.
struct SourcePart {
  std::vector<SourceChunk> chunks;  ///< by y, without chunks that are all air
  std::vector<Error> broken{};      ///< unreadable items that were skipped, with file and byte offset
  std::map<std::string, std::uint64_t> skipped_blocks{};  ///< number of voxels read as air, by block name
  std::vector<Lamp> lamps{};                              ///< lights without geometry, in voxels of the source's grid
};

/// A sign of a block world.
struct SourceSign {
  IVec3 voxel{0};
  std::string text;  ///< lines without formatting, separated by line feeds; without empty lines at the end
};

/// The result of ChunkSource::visit_columns.
struct VisitedColumns {
  std::vector<Error> broken{};      ///< as SourcePart::broken
  std::vector<SourceSign> signs{};  ///< in any order
  std::uint64_t chunks = 0;         ///< chunks of the format that were read: 16 x 16 blocks in Minecraft
};

/// A world that is read chunk by chunk and never held whole: a folder of region files, a database, a large model.
///
///   auto source = quoin::open_chunk_source("saves/New World");
///   for (std::size_t i = 0; i < (*source)->parts().size(); ++i) {
///     auto part = (*source)->read_part(i);             // from any thread
///     for (auto& [chunk, voxels] : part->chunks) ...   // of types in (*source)->types()
///   }
///
/// Space:   one grid, right-handed with y upwards; chunks of 64^3 voxels, as everywhere.
/// Parts:   a part is the unit that is read at once, such as a column of chunks. Parts do not overlap.
/// Types:   reading parts may add types, in the order in which threads find them; existing types never change. For
///          reproducible type ids, or to merge with other types, use SourceTypes.
/// Threads: every function may be called from any thread, also at once.
/// Memory:  bounded for any world: 40 bytes per part, the parts being read, and a 32 MiB cache of recently read parts
///          for `read`.
/// Files:   must not change while the source is open, except regions of Minecraft: the game may save chunks, which are
///          then read as they were, or as they are.
class ChunkSource {
 public:
  ChunkSource(const ChunkSource&) = delete;
  ChunkSource& operator=(const ChunkSource&) = delete;
  virtual ~ChunkSource();

  [[nodiscard]] const ChunkSourceInfo& info() const { return info_; }
  /// Returns all types of the chunks returned so far. Cost: copies a pointer, until types are added.
  [[nodiscard]] virtual VoxelRegistry types() const = 0;

  /// Returns the box of each part, in chunk coordinates: one chunk along x and z, and the possible range along y. The
  /// order reads every file once, and is the same each time the same files are opened.
  [[nodiscard]] std::span<const IBox> parts() const { return parts_; }
  /// Returns the index of the part that contains a chunk, or nullopt if there is none.
  /// Cost: O(log parts).
  [[nodiscard]] std::optional<std::size_t> part_of(IVec3 chunk) const;

  /// Reads a part. Damage is not an error: the readable content is returned, with one `broken` entry per skipped item.
  /// Errors: LimitExceeded (types, memory); CannotRead if the system fails.
  /// Requires: part < parts().size().
  [[nodiscard]] virtual Result<SourcePart> read_part(std::size_t part) const = 0;
  /// Reads one chunk. Returns nullopt if it is air or outside all parts. Appends the broken items of its part to
  /// `broken` (may be null), but not again while the part is cached. Concurrent or successive reads of chunks in one
  /// part read the part once.
  /// Errors: as read_part.
  [[nodiscard]] Result<std::optional<Chunk>> read(IVec3 chunk, std::vector<Error>* broken = nullptr) const;

  /// Calls `visit` for the voxels of a part up to the height `top`, except air, in each column from the top down, until
  /// it returns false for a voxel of that column. Different columns can take turns. Maps take much less time in this
  /// way than by `read_part`: if the format allows it, the voxels below are not even decoded.
  ///
  /// `visit`: receives the voxel in the source's grid and its type, of `types()`.
  /// Errors:  as read_part. Requires: part < parts().size().
  [[nodiscard]] virtual Result<VisitedColumns> visit_columns(
      std::size_t part, int top, FunctionRef<bool(IVec3 voxel, VoxelType type)> visit) const;
  /// Returns a number that differs after a program has saved content of the part; 0 if that is unknown, also if it may
  /// have been saved at this very moment. Reads the files' times where the format has them, not the content.
  /// Errors: CannotRead. Requires: part < parts().size().
  [[nodiscard]] virtual Result<std::uint64_t> part_stamp(std::size_t part) const;

 protected:
  /// Requires: parts are one chunk along x and z, and do not overlap.
  ChunkSource(ChunkSourceInfo info, std::vector<IBox> parts);

 private:
  struct [[gnu::visibility("hidden")]] Cache;
  ChunkSourceInfo info_;
  std::vector<IBox> parts_;
  std::vector<std::uint32_t> by_position_;  // part indices, by z, x, y
  std::unique_ptr<Cache> cache_;
};

/// Maps the types of a source to ids in another registry, which may also hold other types. A source type that equals an
/// existing type gets that type's id. Renumbering chunks in a fixed order gives the same ids on every run,
/// regardless of the reading order. Threads: one at a time. Lifetime: the source must outlive it.
class SourceTypes {
 public:
  explicit SourceTypes(const ChunkSource& source) : source_(&source) {}

  /// Replaces a source chunk's types with types of `into`, and adds missing ones. `into` must be the same registry in
  /// every call. Cost: O(types of the chunk) and a copy of its storage.
  /// Errors: LimitExceeded: more than kMaxVoxelTypes.
  [[nodiscard]] Status renumber(Chunk& chunk, VoxelRegistry& into);

 private:
  const ChunkSource* source_;
  VoxelRegistry known_;                // of the source
  std::vector<VoxelType> numbers_{0};  // indexed by source type; kAir: not assigned yet
};

/// Opens a Minecraft (Java) world folder, its level.dat or one of its region files; or a Luanti world folder or its
/// map.sqlite. `dimension`: see LoadOptions::dimension.
///
/// Errors: CannotRead; BadFormat or Unsupported if the format is not readable; InvalidArgument for a missing dimension.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_chunk_source(const std::filesystem::path& path,
                                                                     std::string_view dimension = {});
/// Opens a world whose format was detected before.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_chunk_source(const DetectedFile& file,
                                                                     std::string_view dimension = {});

/// Returns true if a type of a source was guessed from its name, because the block or node is unknown.
[[nodiscard]] bool has_guessed_look(const VoxelProperties& properties);

/// Returns a warning that lists the named blocks read as air (SourcePart::skipped_blocks); empty if there are none.
[[nodiscard]] std::string text_of_skipped_blocks(const std::map<std::string, std::uint64_t>& blocks);

/// Loads the chunks in a box of chunk coordinates into a scene with one grid and one instance. Adds warnings for broken
/// items and for content outside the box.
///
/// Memory: holds all chunks of the box.
/// Errors: as ChunkSource::read_part; Cancelled.
[[nodiscard]] Result<LoadedScene> load_source(const ChunkSource& source, const IBox& chunks, Threads threads = {},
                                              const Progress& progress = {});

/// Returns the box of chunks within `radius` chunks of the source's spawn (or its middle, if it has none), over its
/// full height. If no part lies in that box, returns the box around the part nearest to the spawn.
/// Requires: radius >= 0.
[[nodiscard]] IBox chunks_around_spawn(const ChunkSource& source, int radius);

}  // namespace quoin

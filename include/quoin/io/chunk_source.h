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

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/formats.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// What a source says of itself before anything is read of it.
struct ChunkSourceInfo {
  std::string format;                     ///< "minecraft", "luanti_map"
  std::string version;                    ///< of what wrote it, for a person: "1.18.2"; empty: it is not said
  std::string name;                       ///< of the world, where it has one
  double spacing = 1.0;                   ///< world units along a voxel's edge
  IBox chunks;                            ///< in chunk coordinates: all that there is lies within
  std::optional<DVec3> spawn;             ///< where a player begins, in voxels of the source's grid
  std::vector<Error> broken{};            ///< files that cannot be read at all, which are left out
  std::vector<std::string> warnings{};    ///< one line per assumption
  std::string dimension{};                ///< of Minecraft's worlds, "minecraft:overworld"; empty: it has no name
  std::vector<std::string> dimensions{};  ///< all of that world, the chosen one too
};

/// A chunk of a source, in its types.
struct SourceChunk {
  IVec3 place{0};  ///< as Grid::find_chunk
  Chunk voxels{kAir};
};

/// What reading a part gave.
struct SourcePart {
  std::vector<SourceChunk> chunks;  ///< by y; those that are all air are left out
  std::vector<Error> broken{};      ///< what could not be read and is left out, with file and byte offset
  std::map<std::string, std::uint64_t> invisible{};  ///< voxels that are read as air and have a name, by that name
  std::vector<Lamp> lamps{};                         ///< lights without a body, in voxels of the source's grid
};

/// A world that is read chunk by chunk, without being held whole: a folder of region files, a database, a large model.
///
///   auto source = quoin::open_chunk_source("saves/New World");
///   for (std::size_t i = 0; i < (*source)->parts().size(); ++i) {
///     auto part = (*source)->read_part(i);             // from any thread
///     for (auto& [place, voxels] : part->chunks) ...   // of types in (*source)->types()
///   }
///
/// Space:   one grid, right-handed with y upwards; chunks are 64^3, as everywhere.
/// Parts:   what the files hold together and is read at once, such as a column of chunks. They do not overlap.
/// Types:   may be added while parts are read, in the order in which threads come upon them; none is ever changed.
///          Whoever wants the same numbers each time, or has types of others beside them, renumbers: SourceTypes.
/// Threads: every function from any thread, also at once.
/// Memory:  bounded, whatever the world: besides 40 bytes a part, what is being read and 32 MiB of parts that were read
///          last, from which `read` takes chunks.
/// Files:   must not change meanwhile.
class ChunkSource {
 public:
  ChunkSource(const ChunkSource&) = delete;
  ChunkSource& operator=(const ChunkSource&) = delete;
  virtual ~ChunkSource();

  [[nodiscard]] const ChunkSourceInfo& info() const { return info_; }
  /// All types that chunks returned so far have. Cost: a pointer, until more are added.
  [[nodiscard]] virtual VoxelRegistry types() const = 0;

  /// The box of each part, in chunk coordinates: one chunk along x and z, and along y as far as there may be any. In an
  /// order that reads every file once; the same each time the same files are opened.
  [[nodiscard]] std::span<const IBox> parts() const { return parts_; }
  /// The index of the part that holds a chunk; nothing where there is none, and nothing to be read.
  /// Cost: O(log parts).
  [[nodiscard]] std::optional<std::size_t> part_of(IVec3 chunk) const;

  /// Reads a part. Damage is no error: what can be read is returned, with a line for each thing that was left out.
  /// Errors: LimitExceeded (of types, of memory); CannotRead where the system fails.
  /// Requires: part < parts().size().
  [[nodiscard]] virtual Result<SourcePart> read_part(std::size_t part) const = 0;
  /// Reads one chunk: nothing where it is air or outside of all parts. What was broken in its part is added to `broken`
  /// (which may be null), but not again while the part is remembered. Chunks of one part that are wanted at once, or
  /// soon after each other, read it once.
  /// Errors: as read_part.
  [[nodiscard]] Result<std::optional<Chunk>> read(IVec3 chunk, std::vector<Error>* broken = nullptr) const;

 protected:
  /// Requires: parts are one chunk along x and z, and do not overlap.
  ChunkSource(ChunkSourceInfo info, std::vector<IBox> parts);

 private:
  struct Cache;
  ChunkSourceInfo info_;
  std::vector<IBox> parts_;
  std::vector<std::uint32_t> by_place_;  // indices of parts, by z, x, y
  std::unique_ptr<Cache> cache_;
};

/// Numbers in another registry for the types of a source, which may hold other types too. What equals a type that is
/// there in everything gets its number. Chunks renumbered in the same order give the same numbers each time, whatever
/// threads read them before. Threads: one at a time. Lifetime: of the source's.
class SourceTypes {
 public:
  explicit SourceTypes(const ChunkSource& source) : source_(&source) {}

  /// Gives the voxels of a chunk of the source the types of `into`, which gains those that it lacks. It must be the
  /// same registry each time. Cost: O(types of the chunk) and a copy of its storage.
  /// Errors: LimitExceeded: more than kMaxVoxelTypes.
  [[nodiscard]] Status renumber(Chunk& chunk, VoxelRegistry& into);

 private:
  const ChunkSource* source_;
  VoxelRegistry known_;                // of the source
  std::vector<VoxelType> numbers_{0};  // by type of the source; kAir: none yet
};

/// Whether a path leads to what open_chunk_source reads and load_scene does not: a folder that holds a world.
[[nodiscard]] bool is_world_folder(const std::filesystem::path& path);
/// Whether files of a format, as detect_format says it, are what open_chunk_source reads.
[[nodiscard]] bool is_read_by_chunks(std::optional<FileFormat> format);

/// Opens a world: a folder of Minecraft's (Java), its level.dat, or one of its region files; a folder of Luanti's, or
/// its map.sqlite. `dimension`: as LoadOptions::dimension.
///
/// Errors: CannotRead; BadFormat, Unsupported where it is nothing that Quoin reads; InvalidArgument for a dimension
/// that is not there.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_chunk_source(const std::filesystem::path& path,
                                                                     std::string_view dimension = {});

/// Returns a warning that names voxels with a name that are read as air (SourcePart::invisible); empty for none.
[[nodiscard]] std::string text_of_invisible(const std::map<std::string, std::uint64_t>& invisible);

/// Puts what lies in a box of chunk coordinates into a scene: one grid, one instance. What was broken, and that there
/// is more outside, are warnings.
///
/// Memory: all that lies in the box is held.
/// Errors: as ChunkSource::read_part; Cancelled.
[[nodiscard]] Result<LoadedScene> load_source(const ChunkSource& source, const IBox& chunks, Threads threads = {},
                                              const Progress& progress = {});

/// The box of chunks around a source's spawn (or its middle, where it has none), `radius` chunks to each side, as high
/// as the source is. Where no part lies in it, the box around the part that is nearest to the spawn.
[[nodiscard]] IBox chunks_around_spawn(const ChunkSource& source, int radius);

}  // namespace quoin

#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/store/stored_chunk.h>
#include <quoin/store/world_store.h>

// What owners of worlds do with them as files: look, check, repair, back up, compact.

namespace quoin {

/// What a world holds, without its voxels.
struct WorldSummary {
  int version = 0;          ///< of the format
  std::uint64_t bytes = 0;  ///< of the file, its log included
  std::uint64_t saves = 0;  ///< commits since it was made
  std::size_t types = 0;    ///< besides air
  std::size_t instances = 0;
  std::size_t values = 0;
  std::size_t thumbnail_bytes = 0;  ///< 0: there is none
  struct GridSummary {
    WorldGrid grid;
    std::uint64_t chunks = 0;                        ///< of level 0; those that are kept as air too
    std::map<std::uint8_t, std::uint64_t> by_level;  ///< chunks of each level there is
    IBox chunk_bounds;                               ///< around those of level 0, in chunks
  };
  std::map<std::uint32_t, GridSummary> grids;
};

/// Errors: as WorldStore::open. Cost: O(chunks), of which only the keys are read; of version 1 all of the file.
[[nodiscard]] Result<WorldSummary> summarize_world(const std::filesystem::path& path, const Progress& progress = {});

/// Something of a world file that is not as it was written.
struct WorldDamage {
  std::optional<ChunkPlace> chunk;  ///< the chunk that is lost, where it is known
  std::string what;                 ///< one line
};

struct WorldCheck {
  std::uint64_t chunks = 0;  ///< that are sound
  std::uint64_t parts = 0;   ///< types, grids, instances, values ... that are
  std::vector<WorldDamage> damage;
};

/// Reads all of a world: each row's checksum and content, and SQLite's own check of its tables. Others may write it
/// meanwhile.
/// Errors: CannotRead, Cancelled; BadFormat where it cannot even be opened.
[[nodiscard]] Result<WorldCheck> check_world(const std::filesystem::path& path, const Progress& progress = {});

struct WorldRepair {
  WorldCheck check;            ///< what was kept, and what is lost
  std::filesystem::path kept;  ///< where the damaged world is, if the repaired one took its place
};

/// Makes a new world of all that is sound in one, wherever in the file it lies and whether SQLite can still read it or
/// not. `to`: a new file; or `from` itself, whose damaged content is then kept as NAME~ or under another name that the
/// outcome has. Types that are lost become magenta ones.
/// Errors: CannotRead; CannotWrite (another writer, a file `to`); Cancelled; BadFormat where nothing of a world is
///         left; Unsupported for a world of a later version.
[[nodiscard]] Result<WorldRepair> repair_world(const std::filesystem::path& from, const std::filesystem::path& to,
                                               const Progress& progress = {});

/// Copies a world as one commit left it, also while others write it; the copy is compact, and appears whole or not at
/// all. Returns its size. Errors: CannotRead, CannotWrite (there is a file `to`), BadFormat (damaged).
[[nodiscard]] Result<std::uint64_t> back_up_world(const std::filesystem::path& from, const std::filesystem::path& to);

/// What a copy of a world has.
struct WorldCopy {
  std::uint64_t bytes = 0;        ///< of the file
  std::uint64_t chunks = 0;       ///< of all levels
  std::uint64_t voxels = 0;       ///< of level 0 that are not air
  std::uint64_t samples = 0;      ///< of level 0 that are solid, of densities
  std::vector<WorldDamage> lost;  ///< chunks that are damaged, and left out
};

/// Writes all that one commit left in a world as a new one of the present version, compact, in place of what is there;
/// it appears whole or not at all. Each chunk is read and checked, and written as it is; what games keep, thumbnails
/// and what this version does not know go along. Others may write `from` meanwhile.
/// Memory: a chunk, whatever the world.
/// Errors: CannotRead; CannotWrite, also where another program writes the world that is there; Cancelled; BadFormat
///         where parts besides chunks are damaged, which repair_world is for.
[[nodiscard]] Result<WorldCopy> copy_world(const std::filesystem::path& from, const std::filesystem::path& to,
                                           const Progress& progress = {});

/// Gives back to the file system what edits left unused. A crash meanwhile loses nothing. Returns the file's size.
/// Errors: CannotWrite (another writer or reader has it open, a full disk), BadFormat.
[[nodiscard]] Result<std::uint64_t> compact_world(const std::filesystem::path& path);

}  // namespace quoin

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
#include <quoin/store/world_store.h>

// Maintenance of world files: summary, check, repair, backup, compaction.

namespace [[gnu::visibility("default")]] quoin {

/// A summary of a world, without its voxels.
struct WorldSummary {
  int version = 0;          ///< format version
  std::uint64_t bytes = 0;  ///< file size, including its log
  std::uint64_t saves = 0;  ///< commits since the world was created
  std::size_t types = 0;    ///< without air
  std::size_t instances = 0;
  std::size_t values = 0;
  std::size_t thumbnail_bytes = 0;  ///< 0: no thumbnail
  struct GridSummary {
    WorldGrid grid;
    std::uint64_t chunks = 0;                        ///< of level 0, including chunks stored as air
    std::map<std::uint8_t, std::uint64_t> by_level;  ///< number of chunks per existing level
    IBox chunk_bounds;                               ///< of level 0, in chunk coordinates
  };
  std::map<std::uint32_t, GridSummary> grids;
};

/// Summarises a world. Errors: as WorldStore::open. Cost: O(chunks), but reads only their keys; for version 1, reads
/// the whole file.
[[nodiscard]] Result<WorldSummary> summarize_world(const std::filesystem::path& path, const Progress& progress = {});

/// A damaged item in a world file.
struct WorldDamage {
  std::optional<ChunkAddress> chunk;  ///< the lost chunk, if known
  std::string what;                   ///< description, one line
};

struct WorldCheck {
  std::uint64_t chunks = 0;  ///< number of valid chunks
  std::uint64_t parts = 0;   ///< number of other valid items (types, grids, instances, values, ...)
  std::vector<WorldDamage> damage;
};

/// Reads a whole world and verifies each row's checksum and content, and SQLite's tables with its own check. Other
/// processes may write the world during the call.
/// Errors: CannotRead; Cancelled; BadFormat if the file cannot be opened as a world.
[[nodiscard]] Result<WorldCheck> check_world(const std::filesystem::path& path, const Progress& progress = {});

struct WorldRepair {
  WorldCheck check;            ///< counts of the copied items, and the damaged items
  std::filesystem::path kept;  ///< path of the damaged world, if the repaired world replaced it
};

/// Writes all valid content of a damaged world to a new world. It finds content anywhere in the file, even if SQLite
/// can no longer read it. `to` is a new file, or `from` itself; the damaged file is then kept as NAME~ or under the
/// name in WorldRepair::kept. Lost types become magenta.
/// Errors: CannotRead; CannotWrite (another writer, or `to` exists); Cancelled; BadFormat if no world content is left;
///         Unsupported for a world of a later version.
[[nodiscard]] Result<WorldRepair> repair_world(const std::filesystem::path& from, const std::filesystem::path& to,
                                               const Progress& progress = {});

/// Copies the state of a world after one commit, even while other processes write it. The copy is compact and is
/// written atomically. Returns its size. Errors: CannotRead, CannotWrite (`to` exists), BadFormat (damaged).
[[nodiscard]] Result<std::uint64_t> back_up_world(const std::filesystem::path& from, const std::filesystem::path& to);

/// The result of copying a world.
struct WorldCopy {
  std::uint64_t bytes = 0;        ///< file size
  std::uint64_t chunks = 0;       ///< of all levels
  std::uint64_t voxels = 0;       ///< non-air voxels of level 0
  std::uint64_t samples = 0;      ///< solid density samples of level 0
  std::vector<WorldDamage> lost;  ///< damaged chunks that were left out
};

/// Copies the state of a world after one commit to a compact world of the current version, replacing `to` atomically.
/// Chunks are verified and copied unchanged. Game values, thumbnails and content unknown to this version are copied
/// too. Other processes may write `from` during the call.
/// Memory: one chunk, for any world.
/// Errors: CannotRead; CannotWrite, also if another process writes the world at `to`; Cancelled; BadFormat if items
///         other than chunks are damaged (use repair_world).
[[nodiscard]] Result<WorldCopy> copy_world(const std::filesystem::path& from, const std::filesystem::path& to,
                                           const Progress& progress = {});

/// Returns unused space of a world to the file system. A crash during the call loses nothing. Returns the file's size.
/// Errors: CannotWrite (open in another writer or reader, disk full), BadFormat.
[[nodiscard]] Result<std::uint64_t> compact_world(const std::filesystem::path& path);

}  // namespace quoin

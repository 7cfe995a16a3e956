#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/chunk_source.h>

namespace [[gnu::visibility("default")]] quoin {

/// The result of importing a world.
struct ImportedWorld {
  std::uint64_t bytes = 0;                              ///< file size
  std::uint64_t chunks = 0;                             ///< number of written chunks, including earlier runs
  std::uint64_t voxels = 0;                             ///< number of voxels in these chunks
  std::size_t resumed_parts = 0;                        ///< parts of the source that an earlier run had imported
  std::vector<std::string> broken;                      ///< unreadable items that were skipped, one line each
  std::vector<std::string> guessed;                     ///< names of types whose appearance is a guess
  std::map<std::string, std::uint64_t> skipped_blocks;  ///< SourcePart::skipped_blocks, summed over all parts
};

/// Imports a whole source into a world on disk, part by part, without holding it in memory.
///
/// Until the import is complete, the world is named PATH.part and stores the progress. An interrupted import
/// (cancelled, killed, power loss) resumes when called again; the result has bit-identical chunks and types. The
/// complete world is then renamed to PATH and replaces an existing file.
/// Memory:  that of the source and about 100 chunks, for any world.
/// Errors:  those of WorldStore and ChunkSource::read_part; Cancelled; InvalidArgument if PATH.part is from another
///          source or has the looks of other resource packs, or the source's parts have changed. (Changed content
///          within the same parts is not detected.)
[[nodiscard]] Result<ImportedWorld> import_world(const ChunkSource& source, const std::filesystem::path& path,
                                                 Threads threads = {}, const Progress& progress = {});

}  // namespace quoin

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

namespace quoin {

/// What putting a world into another file gave.
struct ImportedWorld {
  std::uint64_t bytes = 0;                         ///< of the file
  std::uint64_t chunks = 0;                        ///< that were written, by an earlier run too
  std::uint64_t voxels = 0;                        ///< of these
  std::size_t resumed_parts = 0;                   ///< of the source, that an earlier run had put there
  std::vector<std::string> broken;                 ///< what could not be read and is left out, a line each
  std::vector<std::string> guessed;                ///< names of types whose looks are guesses
  std::map<std::string, std::uint64_t> invisible;  ///< SourcePart::invisible of all parts
};

/// Puts all of a source into a world on disk, part by part, without holding it.
///
/// Until all is there it is a world named PATH.part, which knows how far it came: whoever ended (Progress, kill -9, a
/// power cut) is gone on with by the same call, and what comes of it has the same chunks and types, bit for bit.
/// Only then does it get the name PATH, in place of what had it.
/// Memory:  what the source takes, and some 100 chunks, whatever the world.
/// Errors:  those of WorldStore and ChunkSource::read_part; Cancelled; InvalidArgument where PATH.part is of another
///          source, or of one that has other parts now. (Whether the same parts hold something else is not noticed.)
[[nodiscard]] Result<ImportedWorld> import_world(const ChunkSource& source, const std::filesystem::path& path,
                                                 Threads threads = {}, const Progress& progress = {});

}  // namespace quoin

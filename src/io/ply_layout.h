#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>

#include <quoin/core/result.h>

#include "io/block_writer.h"

namespace quoin {

/// What a PLY file of triangles holds.
///
/// A vertex is written as x y z and nx ny nz as floats and red green blue as bytes; a face as the byte 3 and three int.
struct PlyCounts {
  std::uint64_t vertices = 0;
  std::uint64_t faces = 0;
};

inline constexpr std::size_t kPlyVertexBytes = 6 * 4 + 3;
inline constexpr std::size_t kPlyFaceBytes = 1 + 3 * 4;

/// Writes a whole file, whose vertices and then faces `write` puts; answers its bytes.
/// Errors: LimitExceeded where an int cannot count them; those of AtomicFile.
[[nodiscard]] Result<std::uint64_t> write_ply_file(const std::filesystem::path& path, const PlyCounts& counts,
                                                   const Progress& progress,
                                                   const std::function<void(BlockWriter&)>& write);

}  // namespace quoin

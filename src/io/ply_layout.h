#pragma once

#include <cstdint>
#include <string>

#include <quoin/core/result.h>

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

/// Errors: LimitExceeded where an int cannot count them.
[[nodiscard]] Status check_counts(const PlyCounts& counts);

[[nodiscard]] std::string ply_header(const PlyCounts& counts);

/// The size of the whole file.
[[nodiscard]] std::uint64_t ply_bytes(const PlyCounts& counts);

}  // namespace quoin

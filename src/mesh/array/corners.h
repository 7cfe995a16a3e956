#pragma once

#include <cstddef>
#include <cstdint>

#include <quoin/grid/volume.h>

#include "mesh/array/density.h"
#include "mesh/array/kernel.h"
#include "mesh/array/lattice.h"

namespace quoin::array {

// The rows of samples at the corners of a row of cells, (y, z) before both, after in y, in z, in both. Beyond the
// array, the adjacent row is repeated as air at the same distance from the surface.
struct CornerRows {
  const std::byte* rows[4];
  bool is_beyond[4];
  const std::byte* next;  // after in y, in the slice after both; null if there is none
  std::ptrdiff_t stride;
  std::int64_t size;  // samples of a row
};

// Returns the rows of samples around a row of cells.
[[nodiscard]] CornerRows corner_rows(const Lattice& lattice, std::int64_t row, std::int64_t slice);

// The raw values at cells' corners, [x + 2 y + 4 z][cell], and the corners beyond the array.
struct RawCorners {
  alignas(64) std::byte values[8 * kBatch * 8];
  std::uint8_t is_beyond[kBatch];
  bool has_beyond = false;
};

struct CornerReader {
  // Reads the corners of cells of a row into `out`, starting at index `at`.
  void (*read)(const CornerRows& rows, const std::int32_t* cells, std::size_t count, std::size_t at, RawCorners& out);
  // Converts the first `count` corners to densities.
  void (*convert)(const RawCorners& raw, const SolidRule& rule, std::size_t count, CornerBatch& out);
};

[[nodiscard]] CornerReader corner_reader(ScalarType type);

// Writes the limit that kernels compare values with. Returns true if all values are solid; the limit has no effect
// then.
[[nodiscard]] bool write_limit(ScalarType type, const SolidRule& rule, std::byte (&limit)[8]);

}  // namespace quoin::array

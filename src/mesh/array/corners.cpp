#include "mesh/array/corners.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include <quoin/core/assert.h>

namespace quoin::array {
namespace {

template <class T>
void copy_values(const CornerRows& rows, std::ptrdiff_t low, std::ptrdiff_t high, std::byte* to) {
  constexpr std::size_t kStep = kBatch * sizeof(T);
  for (std::size_t row = 0; row < 4; ++row) {
    std::memcpy(to + 2 * row * kStep, rows.rows[row] + low, sizeof(T));
    std::memcpy(to + (2 * row + 1) * kStep, rows.rows[row] + high, sizeof(T));
  }
}

// Returns one bit for each corner beyond the array.
std::uint8_t corners_beyond(const CornerRows& rows, bool is_low_beyond, bool is_high_beyond) {
  unsigned bits = (is_low_beyond ? 0x55U : 0U) | (is_high_beyond ? 0xAAU : 0U);
  for (unsigned row = 0; row < 4; ++row) bits |= rows.is_beyond[row] ? 3U << (2 * row) : 0U;
  return static_cast<std::uint8_t>(bits);
}

template <class T>
void read_corners(const CornerRows& rows, const std::int32_t* cells, std::size_t count, std::size_t at,
                  RawCorners& out) {
  QUOIN_ASSERT(at + count <= kBatch, "at most one batch");
  const std::uint8_t inner = corners_beyond(rows, false, false);
  out.has_beyond |= inner != 0;
  std::byte* const to = out.values + at * sizeof(T);
  for (std::size_t i = 0; i < count; ++i) {
    const std::ptrdiff_t cell = cells[i];
    QUOIN_ASSERT(cell >= 0 && cell <= rows.size, "a cell of the row");
    out.is_beyond[at + i] = inner;
    if (cell > 0 && cell < rows.size) {
      copy_values<T>(rows, (cell - 1) * rows.stride, cell * rows.stride, to + i * sizeof(T));
      // Prefetches: the surface probably crosses the next slice nearby.
#if defined(__GNUC__)
      if (rows.next != nullptr) __builtin_prefetch(rows.next + cell * rows.stride);
#endif
      continue;
    }
    const std::ptrdiff_t end = cell == 0 ? 0 : (rows.size - 1) * rows.stride;
    copy_values<T>(rows, end, end, to + i * sizeof(T));
    out.is_beyond[at + i] = corners_beyond(rows, cell == 0, cell == rows.size);
    out.has_beyond = true;
  }
}

// If doubles are too small or too large for floats, the values of a cell are divided by the largest of them.
constexpr double kSmall = 1e-25;
constexpr double kLarge = 1e25;

void convert_doubles(const double* values, const Densities<double>& densities, std::size_t count, CornerBatch& out) {
  for (std::size_t i = 0; i < count; ++i) {
    double d[8];
    double most = 0.0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      d[corner] = densities.difference(values[corner * kBatch + i]);
      if (std::isfinite(d[corner])) most = std::max(most, std::abs(d[corner]));
    }
    const bool is_scaled = most != 0.0 && (most < kSmall || most > kLarge);
    for (std::size_t corner = 0; corner < 8; ++corner) {
      out.densities[corner][i] = Densities<double>::rounded(is_scaled ? d[corner] / most : d[corner]);
    }
  }
}

void convert_floats(const float* values, const Densities<float>& densities, CornerBatch& out) {
  const float iso = densities.iso();
  // Converts the whole batch, so that compilers vectorize the loop. 0 must not have a sign.
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const float* const from = values + corner * kBatch;
    float* const to = out.densities[corner];
    if (densities.is_below()) {
      for (std::size_t i = 0; i < kBatch; ++i) to[i] = (from[i] - iso) + 0.0F;
    } else {
      for (std::size_t i = 0; i < kBatch; ++i) to[i] = (iso - from[i]) + 0.0F;
    }
  }
}

template <class T>
void convert_values(const T* values, const SolidRule& rule, std::size_t count, CornerBatch& out) {
  const Densities<T> densities(rule);
  if constexpr (std::is_same_v<T, double>) {
    return convert_doubles(values, densities, count, out);
  } else {
    if constexpr (std::is_same_v<T, float>) {
      if (densities.is_single()) return convert_floats(values, densities, out);
    }
    for (std::size_t corner = 0; corner < 8; ++corner) {
      for (std::size_t i = 0; i < count; ++i) out.densities[corner][i] = densities(values[corner * kBatch + i]);
    }
  }
}

template <class T>
void convert_corners(const RawCorners& raw, const SolidRule& rule, std::size_t count, CornerBatch& out) {
  QUOIN_ASSERT(count <= kBatch, "at most one batch");
  alignas(64) T values[8 * kBatch];
  std::memcpy(values, raw.values, sizeof(values));
  convert_values(values, rule, count, out);
  if (!raw.has_beyond) return;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    for (std::size_t i = 0; i < count; ++i) {
      float& density = out.densities[corner][i];
      if ((raw.is_beyond[i] >> corner & 1U) != 0) density = std::abs(density);
    }
  }
}

template <class T>
bool write_limit_of(const SolidRule& rule, std::byte (&limit)[8]) {
  const SolidLimit<T> found = limit_of<T>(rule);
  std::memcpy(limit, &found.value, sizeof(T));
  return found.takes_all;
}

// Calls visit with a value of the type that `type` names.
template <class Visit>
auto with_type(ScalarType type, Visit visit) {
  switch (type) {
    case ScalarType::UInt8:
      return visit(std::uint8_t{});
    case ScalarType::Int8:
      return visit(std::int8_t{});
    case ScalarType::UInt16:
      return visit(std::uint16_t{});
    case ScalarType::Int16:
      return visit(std::int16_t{});
    case ScalarType::UInt32:
      return visit(std::uint32_t{});
    case ScalarType::Int32:
      return visit(std::int32_t{});
    case ScalarType::UInt64:
      return visit(std::uint64_t{});
    case ScalarType::Int64:
      return visit(std::int64_t{});
    case ScalarType::Float32:
      return visit(float{});
    default:
      QUOIN_ASSERT(type == ScalarType::Float64, "a known type");
      return visit(double{});
  }
}

}  // namespace

CornerRows corner_rows(const Lattice& lattice, std::int64_t row, std::int64_t slice) {
  QUOIN_ASSERT(row >= 0 && row <= lattice.size[1] && slice >= 0 && slice <= lattice.size[2], "a row of cells");
  CornerRows corners{{}, {}, nullptr, lattice.stride[0], lattice.size[0]};
  for (std::int64_t i = 0; i < 4; ++i) {
    const std::int64_t y = row - 1 + i % 2;
    const std::int64_t z = slice - 1 + i / 2;
    const std::int64_t inner_y = std::clamp<std::int64_t>(y, 0, lattice.size[1] - 1);
    const std::int64_t inner_z = std::clamp<std::int64_t>(z, 0, lattice.size[2] - 1);
    corners.rows[i] = lattice.row(inner_y, inner_z);
    corners.is_beyond[i] = y != inner_y || z != inner_z;
  }
  if (slice + 1 < lattice.size[2]) corners.next = lattice.row(std::min(row, lattice.size[1] - 1), slice + 1);
  return corners;
}

CornerReader corner_reader(ScalarType type) {
  return with_type(type, [](auto value) -> CornerReader {
    return {read_corners<decltype(value)>, convert_corners<decltype(value)>};
  });
}

bool write_limit(ScalarType type, const SolidRule& rule, std::byte (&limit)[8]) {
  return with_type(type, [&](auto value) { return write_limit_of<decltype(value)>(rule, limit); });
}

}  // namespace quoin::array

#include "mesh/array/array_samples.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include <quoin/core/assert.h>

#include "mesh/array/array_cells.h"
#include "mesh/array/array_kernel.h"

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

namespace {

// Returns words with the bits from `first` to before `end`.
std::vector<std::uint64_t> bit_range(std::size_t words, std::int64_t first, std::int64_t end) {
  std::vector<std::uint64_t> bits(words, 0);
  for (std::int64_t i = first; i < end; ++i) bits[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
  return bits;
}

bool is_inner(std::size_t i, std::size_t count) {
  return i > 0 && i + 1 < count;
}

}  // namespace

Signs::Signs(const Lattice& lattice, const ArraySurfaceOptions& options)
    : lattice_(lattice),
      rule_{options.iso, options.solid == SolidSide::Below},
      is_open_(options.border == ArrayBorder::Open),
      along_mask_(bit_range(lattice.words, 1, lattice.size[0])),
      sample_mask_(bit_range(lattice.words, 1, lattice.size[0] - 1)) {
  bits_.resize(lattice.slices() * lattice.slice_words());
}

void Signs::find_row(std::size_t y, std::size_t z, const std::byte* limit, std::vector<std::byte>& packed) {
  const auto row = static_cast<std::int64_t>(y);
  const auto slice = static_cast<std::int64_t>(z);
  QUOIN_ASSERT(static_cast<std::size_t>(lattice_.type) < kScalarTypes, "a known type");
  if (!packed.empty()) pack_row(lattice_, row, slice, packed.data());
  const auto solid_row = kernel().solid_row[static_cast<std::size_t>(lattice_.type)][rule_.is_below ? 1 : 0];
  solid_row(packed.empty() ? lattice_.row(row, slice) : packed.data(), static_cast<std::size_t>(lattice_.size[0]),
            limit, bits_.data() + z * lattice_.slice_words() + y * lattice_.words);
}

Status Signs::find(Threads threads, ProgressSteps& steps) {
  std::byte limit[8] = {};
  const bool takes_all = write_limit(lattice_.type, rule_, limit);
  const std::vector<std::uint64_t> all = bit_range(lattice_.words, 0, lattice_.size[0]);
  const std::size_t row_bytes = static_cast<std::size_t>(lattice_.size[0]) * lattice_.item_bytes();
  return for_each_slab(lattice_, threads, steps, [&](std::size_t, std::size_t first, std::size_t end) {
    std::vector<std::byte> packed(lattice_.has_packed_rows() ? 0 : row_bytes);
    for (std::size_t z = first; z < std::min(end, lattice_.slices()); ++z) {
      for (std::size_t y = 0; y < lattice_.rows(); ++y) {
        if (!takes_all) {
          find_row(y, z, limit, packed);
          continue;
        }
        std::copy(all.begin(), all.end(), bits_.data() + z * lattice_.slice_words() + y * lattice_.words);
      }
    }
  });
}

std::uint32_t Signs::solid_corners(IVec3 cell) const {
  QUOIN_ASSERT(cell.x >= 0 && cell.x <= lattice_.size[0], "a cell of the lattice");
  const auto word = static_cast<std::size_t>(cell.x / 64);
  const auto bit = static_cast<unsigned>(cell.x % 64);
  std::uint32_t solid = 0;
  for (unsigned i = 0; i < 4; ++i) {
    const std::int64_t y = cell.y - 1 + static_cast<int>(i & 1U);
    const std::int64_t z = cell.z - 1 + static_cast<int>(i >> 1);
    if (y < 0 || z < 0 || y >= lattice_.size[1] || z >= lattice_.size[2]) continue;
    const std::uint64_t* const row = slice(static_cast<std::size_t>(z)) + static_cast<std::size_t>(y) * lattice_.words;
    // Samples x - 1 and x.
    const std::uint64_t last = word == 0 ? 0 : row[word - 1] >> 63;
    const std::uint64_t pair = bit == 0 ? row[word] << 1 | last : row[word] >> (bit - 1);
    solid |= static_cast<std::uint32_t>(pair & 3U) << (2 * i);
  }
  return solid;
}

void Signs::within(std::size_t z, std::uint64_t* along_rows, std::uint64_t* between_rows) const {
  const std::size_t rows = lattice_.rows();
  const std::size_t words = lattice_.words;
  if (is_open_ && !is_inner(z, lattice_.slices())) {
    std::fill_n(along_rows, rows * words, 0);
    std::fill_n(between_rows, (rows + 1) * words, 0);
    return;
  }
  const Kernel& k = kernel();
  const std::uint64_t* const solid = slice(z);
  k.differences_along(solid, rows * words, along_rows);
  std::copy_n(solid, words, between_rows);
  k.differences(solid, solid + words, (rows - 1) * words, between_rows + words);
  std::copy_n(solid + (rows - 1) * words, words, between_rows + rows * words);
  if (!is_open_) return;
  keep_inner(along_rows, rows, along_mask_);
  keep_inner(between_rows, rows + 1, sample_mask_);
}
void Signs::between(std::size_t slice_of_cells, std::uint64_t* out) const {
  const std::size_t rows = lattice_.rows();
  const bool is_first = slice_of_cells == 0;
  const bool is_last = slice_of_cells == lattice_.slices();
  if (!is_first && !is_last) {
    kernel().differences(slice(slice_of_cells - 1), slice(slice_of_cells), lattice_.slice_words(), out);
    if (is_open_) keep_inner(out, rows, sample_mask_);
  } else if (is_open_) {
    std::fill_n(out, lattice_.slice_words(), 0);
  } else {
    std::copy_n(slice(is_first ? 0 : slice_of_cells - 1), lattice_.slice_words(), out);
  }
}

// Keeps the edges that get quads with an open border.
void Signs::keep_inner(std::uint64_t* rows, std::size_t count, const std::vector<std::uint64_t>& mask) const {
  for (std::size_t row = 0; row < count; ++row, rows += lattice_.words) {
    const bool is_kept = is_inner(row, count);
    for (std::size_t w = 0; w < lattice_.words; ++w) rows[w] &= is_kept ? mask[w] : 0;
  }
}

}  // namespace quoin::array

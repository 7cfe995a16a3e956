#include "mesh/array/signs.h"

#include <algorithm>

#include <quoin/core/assert.h>

#include "mesh/array/cells.h"
#include "mesh/array/corners.h"
#include "mesh/array/kernel.h"

namespace quoin::array {
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

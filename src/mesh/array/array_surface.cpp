#include <quoin/mesh/array_surface.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "mesh/array/cells.h"
#include "mesh/array/corners.h"

namespace quoin {
namespace {

using namespace array;

// The bits from `first` to before `end`.
std::vector<std::uint64_t> bit_range(std::size_t words, std::int64_t first, std::int64_t end) {
  std::vector<std::uint64_t> bits(words, 0);
  for (std::int64_t i = first; i < end; ++i) bits[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
  return bits;
}

// The signs of an array's samples, and which edges get quads.
class Signs {
 public:
  Signs(const Lattice& lattice, const ArraySurfaceOptions& options)
      : lattice_(lattice),
        rule_{options.iso, options.solid == SolidSide::Below},
        is_open_(options.border == ArrayBorder::Open) {
    const std::int64_t n = lattice.size[0];
    along_mask_ = bit_range(lattice.words, 1, n);
    sample_mask_ = bit_range(lattice.words, 1, n - 1);
    bits_.resize(lattice.slices() * lattice.slice_words());
  }

  [[nodiscard]] const SolidRule& rule() const { return rule_; }

  Status find(Threads threads, ProgressSteps& steps) {
    std::byte limit[8] = {};
    const bool takes_all = write_limit(lattice_.type, rule_, limit);
    const auto solid_row = kernel().solid_row[static_cast<std::size_t>(lattice_.type)][rule_.is_below ? 1 : 0];
    const auto count = static_cast<std::size_t>(lattice_.size[0]);
    const std::vector<std::uint64_t> all = bit_range(lattice_.words, 0, lattice_.size[0]);
    return for_each_slab(lattice_, threads, steps, [&](std::size_t, std::size_t first, std::size_t end) {
      std::vector<std::byte> packed(lattice_.has_packed_rows() ? 0 : count * lattice_.item_bytes());
      for (std::size_t z = first; z < std::min(end, lattice_.slices()); ++z) {
        std::uint64_t* out = bits_.data() + z * lattice_.slice_words();
        for (std::size_t y = 0; y < lattice_.rows(); ++y, out += lattice_.words) {
          if (takes_all) {
            std::copy(all.begin(), all.end(), out);
            continue;
          }
          if (!packed.empty())
            pack_row(lattice_, static_cast<std::int64_t>(y), static_cast<std::int64_t>(z), packed.data());
          solid_row(
              packed.empty() ? lattice_.row(static_cast<std::int64_t>(y), static_cast<std::int64_t>(z)) : packed.data(),
              count, limit, out);
        }
      }
    });
  }

  // Null beyond the array.
  [[nodiscard]] const std::uint64_t* slice(std::size_t z) const {
    return z < lattice_.slices() ? bits_.data() + z * lattice_.slice_words() : nullptr;
  }

  // As EdgeWindow's source.
  void within(std::size_t z, std::uint64_t* along_rows, std::uint64_t* between_rows) const {
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
  void between(std::size_t slice_of_cells, std::uint64_t* out) const {
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

 private:
  static bool is_inner(std::size_t i, std::size_t count) { return i > 0 && i + 1 < count; }
  // Leaves the edges of an open border that get quads.
  void keep_inner(std::uint64_t* rows, std::size_t count, const std::vector<std::uint64_t>& mask) const {
    for (std::size_t row = 0; row < count; ++row, rows += lattice_.words) {
      const bool is_kept = is_inner(row, count);
      for (std::size_t w = 0; w < lattice_.words; ++w) rows[w] &= is_kept ? mask[w] : 0;
    }
  }

  const Lattice& lattice_;
  SolidRule rule_;
  bool is_open_;
  std::vector<std::uint64_t> along_mask_;  // of an open border
  std::vector<std::uint64_t> sample_mask_;
  Buffer<std::uint64_t> bits_;  // [slice][row][word]
};

// Makes vertices, a batch of cells at a time.
class VertexMaker {
 public:
  VertexMaker(const Lattice& lattice, const SolidRule& rule, ArraySurface& out)
      : lattice_(lattice),
        rule_(rule),
        reader_(corner_reader(lattice.type)),
        placement_(placement_of(lattice)),
        out_(out) {}

  // The vertices of a slice of cells.
  void add(const RankedRows& ranked, std::size_t slice) {
    for (std::size_t row = 0; row <= lattice_.rows(); ++row) {
      if (ranked.first[row] == ranked.first[row + 1]) continue;
      if (count_ == 0) first_ = ranked.first[row];
      add_row(ranked.active + row * lattice_.words, static_cast<std::int64_t>(row), static_cast<std::int64_t>(slice));
    }
  }
  void finish() {
    reader_.convert(raw_, rule_, count_, corners_);
    kernel().vertices(corners_, count_, placement_, batch_, out_.positions.data() + first_,
                      out_.normals.data() + first_);
    first_ += static_cast<std::uint32_t>(count_);
    count_ = 0;
    raw_.has_beyond = false;
  }

 private:
  void add_row(const std::uint64_t* active, std::int64_t row, std::int64_t slice) {
    const CornerRows corners = corner_rows(row, slice);
    std::size_t begin = count_;
    for (std::size_t w = 0; w < lattice_.words; ++w) {
      for (std::uint64_t left = active[w]; left != 0; left &= left - 1) {
        batch_.cells[0][count_] = static_cast<std::int32_t>(64 * w) + std::countr_zero(left);
        batch_.cells[1][count_] = static_cast<std::int32_t>(row);
        batch_.cells[2][count_] = static_cast<std::int32_t>(slice);
        if (++count_ < kBatch) continue;
        reader_.read(corners, batch_.cells[0] + begin, count_ - begin, begin, raw_);
        finish();
        begin = 0;
      }
    }
    if (count_ > begin) reader_.read(corners, batch_.cells[0] + begin, count_ - begin, begin, raw_);
  }
  [[nodiscard]] CornerRows corner_rows(std::int64_t row, std::int64_t slice) const {
    CornerRows corners{{}, {}, lattice_.stride[0], lattice_.size[0]};
    for (std::int64_t i = 0; i < 4; ++i) {
      const std::int64_t y = row - 1 + i % 2;
      const std::int64_t z = slice - 1 + i / 2;
      const std::int64_t inner_y = std::clamp<std::int64_t>(y, 0, lattice_.size[1] - 1);
      const std::int64_t inner_z = std::clamp<std::int64_t>(z, 0, lattice_.size[2] - 1);
      corners.rows[i] = lattice_.row(inner_y, inner_z);
      corners.is_beyond[i] = y != inner_y || z != inner_z;
    }
    return corners;
  }

  const Lattice& lattice_;
  SolidRule rule_;
  CornerReader reader_;
  Placement placement_;
  ArraySurface& out_;
  std::uint32_t first_ = 0;  // vertex of the batch
  std::size_t count_ = 0;    // of the batch
  RawCorners raw_{};
  CornerBatch corners_{};
  VertexBatch batch_{};
};

}  // namespace

Result<ArraySurface> surface_from_array(const ArrayView& array, const ArraySurfaceOptions& options, Threads threads,
                                        const Progress& progress) {
  if (std::isnan(options.iso)) {
    return make_error(ErrorCode::InvalidArgument, "the value of the surface is not a number");
  }
  const Result<Lattice> found = lattice_of(array);
  if (!found) return found.error();
  const Lattice& lattice = *found;
  ProgressSteps steps(progress, 4 * slab_count(lattice));
  Signs signs(lattice, options);
  if (Status status = signs.find(threads, steps); !status) return status.error();
  CellIndex index;
  const auto source = [&] { return Borrowed<const Signs>{&signs}; };
  if (Status status = find_cells(lattice, source, threads, steps, index, [](auto...) {}); !status)
    return status.error();
  ArraySurface out;
  out.positions.resize(index.vertices());
  out.normals.resize(index.vertices());
  out.indices.resize(6 * index.quads());
  Status made = for_each_slab(lattice, threads, steps, [&](std::size_t, std::size_t first, std::size_t end) {
    VertexMaker maker(lattice, signs.rule(), out);
    for (std::size_t slice = first; slice < end; ++slice) maker.add(index.rows_of(lattice, slice), slice);
    maker.finish();
  });
  if (!made) return made.error();
  const QuadRules rules{out.positions.data(), lattice.is_mirrored};
  made = for_each_slab(lattice, threads, steps, [&](std::size_t slab, std::size_t first, std::size_t end) {
    EdgeWindow window(lattice, source());
    std::uint32_t* to = out.indices.data() + 6 * index.quads_before[slab];
    for (std::size_t slice = first; slice < end; ++slice) {
      const std::uint64_t* const solid = slice == 0 ? nullptr : signs.slice(slice - 1);
      to = kernel().quads(window.at(slice), solid, index.rows_of(lattice, slice), rules, to);
    }
  });
  if (!made) return made.error();
  return out;
}

}  // namespace quoin

// Converts packed voxels to bit layers: the chunk's own, and the opacity around it from its 26 neighbours.
//
//   packed row, 2 bits per voxel           | 3 0 1 1 2 ... |     palette indices
//   planes, one word each            bit 0 | 1 0 1 1 0 ... |
//                                    bit 1 | 1 0 0 0 1 ... |
//   opaque                                 | 1 0 1 1 0 ... |     from the planes, one index at a time
//   same_bit, same_row, same_z             | 0 0 1 0 . ... |     the next voxel along x, y, z has the same type

#pragma once

#include <cstdint>

#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"
#include "mesh/blocky/blocky_mesher.h"
#include "mesh/blocky/layer_words.inl"

namespace quoin::blocky {
namespace {

#ifdef QUOIN_KERNEL_AVX512
inline constexpr bool kTypesFromRows = false;
#else
// Types are read from packed rows of any width.
inline constexpr bool kTypesFromRows = true;
#endif

QUOIN_INLINE std::uint64_t even_bits(std::uint64_t w) {
#ifdef QUOIN_KERNEL_AVX2
  return _pext_u64(w, 0x5555'5555'5555'5555U);
#else
  return packed_row::gather_even_bits(w);
#endif
}

QUOIN_INLINE std::uint64_t nibble_bits(std::uint64_t w) {
#ifdef QUOIN_KERNEL_AVX2
  return _pext_u64(w, 0x1111'1111'1111'1111U);
#else
  return packed_row::gather_nibble_bits(w);
#endif
}

// Returns bit k of each voxel of a row with 1, 2 or 4 bits per voxel.
template <int kBits>
QUOIN_INLINE std::uint64_t plane_of_row(const std::uint64_t* row, int k) {
  if constexpr (kBits == 1) {
    return row[0];
  } else if constexpr (kBits == 2) {
    return even_bits(row[0] >> k) | (even_bits(row[1] >> k) << 32);
  } else {
    return nibble_bits(row[0] >> k) | (nibble_bits(row[1] >> k) << 16) | (nibble_bits(row[2] >> k) << 32) |
           (nibble_bits(row[3] >> k) << 48);
  }
}

// Returns the voxels of a row that equal the voxels of another row: 8 or 16 bits per voxel.
template <int kBits>
QUOIN_INLINE std::uint64_t equal_cells(const std::uint64_t* a, const std::uint64_t* b) {
#ifdef QUOIN_KERNEL_AVX512
  if constexpr (kBits == 8) {
    return _mm512_cmpeq_epi8_mask(_mm512_loadu_si512(a), _mm512_loadu_si512(b));
  } else {
    const auto half = [&](int i) {
      return std::uint64_t{_mm512_cmpeq_epi16_mask(_mm512_loadu_si512(a + i), _mm512_loadu_si512(b + i))};
    };
    return half(0) | half(8) << 32;
  }
#elif defined(QUOIN_KERNEL_AVX2)
  const auto read = [](const std::uint64_t* p, int i) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p) + i);
  };
  std::uint64_t mask = 0;
  if constexpr (kBits == 8) {
    for (int i = 0; i < 2; ++i) {
      const auto cells = static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(read(a, i), read(b, i))));
      mask |= std::uint64_t{cells} << (32 * i);
    }
  } else {
    for (int i = 0; i < 2; ++i) {
      const __m256i low = _mm256_cmpeq_epi16(read(a, 2 * i), read(b, 2 * i));
      const __m256i high = _mm256_cmpeq_epi16(read(a, 2 * i + 1), read(b, 2 * i + 1));
      const __m256i packed = _mm256_permute4x64_epi64(_mm256_packs_epi16(low, high), 0xD8);
      mask |= std::uint64_t{static_cast<std::uint32_t>(_mm256_movemask_epi8(packed))} << (32 * i);
    }
  }
  return mask;
#else
  std::uint64_t difference[kBits];
  for (int i = 0; i < kBits; ++i) difference[i] = a[i] ^ b[i];
  return packed_row::equal_mask(difference, kBits, 0);
#endif
}

// The slabs of the region and of the voxels around it.
struct SlabRange {
  Range y;  // rows, multiples of kLanes
  Range z;
};

QUOIN_INLINE SlabRange slabs_around(const IBox& region) {
  const auto widened = [](int low, int high) {
    return Range{rounded_down(low > 0 ? low - 1 : 0), rounded_up(high < 64 ? high + 1 : 64)};
  };
  return {widened(region.min.y, region.max.y), widened(region.min.z, region.max.z)};
}

// Four words: the rows of a slab in one plane.
using Four __attribute__((vector_size(32))) = std::uint64_t;
using UnalignedFour __attribute__((vector_size(32), aligned(8))) = std::uint64_t;
// Four pointers, as numbers.
using FourAddresses __attribute__((vector_size(4 * sizeof(std::uintptr_t)))) = std::uintptr_t;

// Finds the address of each row's packed voxels. Rows of uniform slabs are written to a buffer once.
void find_rows(const ChunkStorage& voxels, const SlabRange& range, Scratch& s) {
  for (int z = range.z.begin; z < range.z.end; z += 4) {
    for (int y = range.y.begin; y < range.y.end; y += 4) {
      const std::size_t slab = ChunkStorage::slab_index(y, z);
      const std::uint32_t entry = voxels.slabs[slab];
      const bool is_uniform = (entry & ChunkStorage::kUniformSlab) != 0;
      if (is_uniform) {
        const std::uint64_t pattern = packed_row::repeat(voxels.bits, entry & ~ChunkStorage::kUniformSlab);
        for (int i = 0; i < voxels.bits; ++i) s.patterns[slab][i] = pattern;
      }
      const auto first = reinterpret_cast<std::uintptr_t>(is_uniform ? s.patterns[slab] : voxels.row(entry, 0));
      const std::uintptr_t step = is_uniform ? 0 : static_cast<std::uintptr_t>(voxels.bits) * 8;
      FourAddresses four = FourAddresses{0, step, 2 * step, 3 * step} + first;
      for (int i = 0; i < 4; ++i) {
        static_assert(sizeof(s.rows[0]) == sizeof(std::uintptr_t));
        __builtin_memcpy(s.rows + (z + i) * 64 + y, &four, sizeof(four));
        four += 4 * step;
      }
    }
  }
}

// Returns bit k of the voxels of four rows.
template <int kBits>
QUOIN_INLINE Four plane_of_rows(const std::uint64_t* rows, int k) {
#ifdef QUOIN_KERNEL_AVX512
  if constexpr (kBits == 2) {
    // In each byte, bit k of its four voxels; two adjacent bytes hold eight of them.
    const __m512i pairs = _mm512_set1_epi64(k == 0 ? 0x0104'1040'0000'0000 : 0x0208'2080'0000'0000);
    const __m512i fours = _mm512_gf2p8affine_epi64_epi8(_mm512_loadu_si512(rows), pairs, 0);
    const __m512i eights = _mm512_maddubs_epi16(fours, _mm512_set1_epi16(0x1001));
    return reinterpret_cast<Four>(_mm512_cvtepi16_epi8(eights));
  } else if constexpr (kBits == 4) {
    const __m512i pairs = _mm512_set1_epi64(0x0110'0000'0000'0000LL << k);
    const auto two_rows = [&](const std::uint64_t* from) {
      const __m512i twos = _mm512_gf2p8affine_epi64_epi8(_mm512_loadu_si512(from), pairs, 0);
      const __m512i fours = _mm512_maddubs_epi16(twos, _mm512_set1_epi16(0x0401));
      return _mm512_cvtepi32_epi8(_mm512_madd_epi16(fours, _mm512_set1_epi32(0x0010'0001)));
    };
    return reinterpret_cast<Four>(_mm256_set_m128i(two_rows(rows + 8), two_rows(rows)));
  }
#endif
  return Four{plane_of_row<kBits>(rows, k), plane_of_row<kBits>(rows + kBits, k),
              plane_of_row<kBits>(rows + 2 * kBits, k), plane_of_row<kBits>(rows + 3 * kBits, k)};
}

// Returns the number of bit planes of narrow palette indices that may differ from 0.
int index_planes(const ChunkStorage& voxels) {
  if (voxels.bits > 4) return 0;
  return voxels.bits == 4 && voxels.palette.size() <= 8 ? 3 : voxels.bits;
}

// Extracts the lowest planes of rows with 1, 2 or 4 bits per voxel.
template <int kBits, int kPlanes>
void split_planes(const ChunkStorage& voxels, const SlabRange& range, Scratch& s) {
  for (int z = range.z.begin; z < range.z.end; z += 4) {
    for (int y = range.y.begin; y < range.y.end; y += 4) {
      const std::uint32_t entry = voxels.slabs[ChunkStorage::slab_index(y, z)];
      const bool is_uniform = (entry & ChunkStorage::kUniformSlab) != 0;
      for (int k = 0; k < kPlanes; ++k) {
        for (int i = 0; i < 4; ++i) {
          const Four rows = is_uniform ? Four{} - (entry >> k & 1U) : plane_of_rows<kBits>(voxels.row(entry, 4 * i), k);
          *reinterpret_cast<UnalignedFour*>(s.planes[k].words + word_index(z + i, y)) = rows;
        }
      }
    }
  }
}

// The used palette indices that are not opaque: air, then the transparent ones.
struct OpenIndices {
  std::uint8_t indices[16];
  int air_count;
  int count;
};

OpenIndices open_indices(const ChunkStorage& voxels, const Scratch& s) {
  OpenIndices open{};
  QUOIN_ASSERT(voxels.palette.size() <= 16, "a palette of at most 4 bits");
  for (const std::uint8_t wanted : {0, 2}) {
    for (std::size_t i = 0; i < voxels.palette.size(); ++i) {
      if (s.index_class[i] == wanted && voxels.counts[i] != 0)
        open.indices[open.count++] = static_cast<std::uint8_t>(i);
    }
    if (wanted == 0) open.air_count = open.count;
  }
  return open;
}

// Returns the cells that hold none of some indices.
template <int kPlanes>
QUOIN_INLINE Words hold_none(const Words (&planes)[kPlanes], const std::uint8_t* first, const std::uint8_t* last) {
  Words none = ~Words{};
  for (; first != last; ++first) {
    Words differs{};
    for (int k = 0; k < kPlanes; ++k) {
      differs = or_difference(differs, planes[k], Words{} - static_cast<std::uint64_t>(*first >> k & 1));
    }
    none &= differs;
  }
  return none;
}

// Returns the class of all voxels of kLanes rows if they lie in uniform slabs of one type (Scratch::index_class), else
// -1. Requires: at most 8 bits per voxel.
QUOIN_INLINE int class_of_rows(const ChunkStorage& voxels, int y, int z, const Scratch& s) {
  const std::size_t slab = ChunkStorage::slab_index(y, z);
  const std::uint32_t entry = voxels.slabs[slab];
  if ((entry & ChunkStorage::kUniformSlab) == 0) return -1;
  if (kLanes == 8 && voxels.slabs[slab + 1] != entry) return -1;
  return s.index_class[entry & ~ChunkStorage::kUniformSlab];
}

// Computes opacity, and equality of adjacent types if there are several types.
template <int kPlanes, bool kTypes, bool kTransparent>
void combine_planes(const ChunkStorage& voxels, const SlabRange& range, const OpenIndices& open, Scratch& s) {
  const std::uint8_t* first_transparent = open.indices + open.air_count;
  for (int z = range.z.begin; z < range.z.end; ++z) {
    for (int y = range.y.begin; y < range.y.end; y += kLanes) {
      const int at = word_index(z, y);
      Words here[kPlanes];
      for (int k = 0; k < kPlanes; ++k) here[k] = load(s.planes[k].words + at);
      if constexpr (kTransparent) {
        // There may be many transparent types, mostly in few slabs.
        const int one = class_of_rows(voxels, y, z, s);
        const Words solid =
            one < 0 ? hold_none(here, open.indices, first_transparent) : Words{} - static_cast<std::uint64_t>(one != 0);
        store(s.solid.words + at, solid);
        store(s.z.opaque.words + at, one < 0 ? solid & hold_none(here, first_transparent, open.indices + open.count)
                                             : Words{} - static_cast<std::uint64_t>(one == 1));
      } else {
        store(s.z.opaque.words + at, hold_none(here, open.indices, first_transparent));
      }
      if constexpr (!kTypes) continue;
      Words along_x{};
      Words along_y{};
      Words along_z{};
      for (int k = 0; k < kPlanes; ++k) {
        const std::uint64_t* p = s.planes[k].words + at;
        along_x = or_difference(along_x, here[k], here[k] >> 1);
        along_y = or_difference(along_y, here[k], load(p + 1));
        along_z = or_difference(along_z, here[k], load(p + kRowStride));
      }
      store(s.z.same_bit.words + at, ~along_x);
      store(s.z.same_row.words + at, ~along_y);
      store(s.same_z.words + at, ~along_z);
    }
  }
}

template <int kBits, int kPlanes>
void read_planes(const Job& job, const ChunkStorage& voxels, const SlabRange& range, Scratch& s) {
  split_planes<kBits, kPlanes>(voxels, range, s);
  const OpenIndices open = open_indices(voxels, s);
  if (job.one_type) {
    combine_planes<kPlanes, false, false>(voxels, range, open, s);
  } else if (job.has_transparent) {
    combine_planes<kPlanes, true, true>(voxels, range, open, s);
  } else {
    combine_planes<kPlanes, true, false>(voxels, range, open, s);
  }
}

// Returns the cells of a row that hold an index.
template <int kBits>
QUOIN_INLINE std::uint64_t cells_of(const std::uint64_t* row, std::uint32_t index) {
  std::uint64_t pattern[kBits];
  for (int i = 0; i < kBits; ++i) pattern[i] = packed_row::repeat(kBits, index);
  return equal_cells<kBits>(row, pattern);
}

// Returns the cells of a row that hold a transparent type.
template <int kBits>
QUOIN_INLINE std::uint64_t transparent_cells(const Job& job, const ChunkStorage& voxels, const Scratch& s,
                                             const std::uint64_t* row) {
  std::uint64_t mask = 0;
  if constexpr (kBits == 8) {
    for (std::uint32_t i = 0; i < voxels.palette.size(); ++i) {
      if (s.index_class[i] == 2) mask |= cells_of<kBits>(row, i);
    }
  } else {
    for (int x = 0; x < 64; ++x) {
      const auto type = static_cast<VoxelType>(packed_row::read(row, kBits, x));
      mask |= std::uint64_t{job.visibility(type) == Visibility::Transparent} << x;
    }
  }
  return mask;
}

// As above for 8 and 16 bits: compares whole rows, and classifies a palette index for a row at a time.
template <int kBits>
void classify_wide(const Job& job, const ChunkStorage& voxels, const SlabRange& range, Scratch& s) {
  std::uint32_t air = 0;
  bool has_air = true;
  if constexpr (kBits == 8) {
    for (air = 0; air < voxels.palette.size() && s.index_class[air] != 0;) ++air;
    has_air = air < voxels.palette.size();
  }
  for (int z = range.z.begin; z < range.z.end; ++z) {
    for (int y = range.y.begin; y < range.y.end; ++y) {
      const std::uint64_t* row = s.rows[z * 64 + y];
      const std::uint64_t solid = has_air ? ~cells_of<kBits>(row, air) : ~std::uint64_t{0};
      const int at = word_index(z, y);
      std::uint64_t opaque = solid;
      if (job.has_transparent) {
        s.solid.words[at] = solid;
        if (solid != 0) opaque &= ~transparent_cells<kBits>(job, voxels, s, row);
      }
      s.z.opaque.words[at] = opaque;
      std::uint64_t shifted[kBits];
      for (int i = 0; i < kBits; ++i) {
        shifted[i] = row[i] >> kBits | (i + 1 < kBits ? row[i + 1] << (64 - kBits) : 0);
      }
      s.z.same_bit.words[at] = equal_cells<kBits>(row, shifted);
      s.z.same_row.words[at] = y + 1 < range.y.end ? equal_cells<kBits>(row, s.rows[z * 64 + y + 1]) : 0;
      s.same_z.words[at] = z + 1 < range.z.end ? equal_cells<kBits>(row, s.rows[(z + 1) * 64 + y]) : 0;
    }
  }
}

void classify_uniform(const Job& job, const SlabRange& range, Scratch& s) {
  const VoxelType type = *job.chunks->centre()->uniform();
  const std::uint64_t opaque = job.is_opaque(type) ? ~std::uint64_t{0} : 0;
  for (int z = range.z.begin; z < range.z.end; ++z) {
    for (int y = range.y.begin; y < range.y.end; ++y) {
      const int at = word_index(z, y);
      s.z.opaque.words[at] = opaque;
      s.solid.words[at] = s.z.same_bit.words[at] = s.z.same_row.words[at] = s.same_z.words[at] = ~std::uint64_t{0};
    }
  }
}

void fill_layers(const Job& job, const SlabRange& range, Scratch& s) {
  const ChunkStorage* voxels = ChunkStorage::of(*job.chunks->centre());
  if (voxels == nullptr) {
    classify_uniform(job, range, s);
    return;
  }
  if (kTypesFromRows || voxels->bits > 4) find_rows(*voxels, range, s);
  if (!voxels->direct()) {
    QUOIN_ASSERT(voxels->palette.size() <= 256, "a palette of at most 8 bits");
    __builtin_memset(s.index_class, 1, sizeof(s.index_class));
    for (std::size_t i = 0; i < voxels->palette.size(); ++i) {
      s.index_class[i] = static_cast<std::uint8_t>(job.visibility(voxels->palette[i]));
    }
  }
  switch (index_planes(*voxels)) {
    case 1:
      read_planes<1, 1>(job, *voxels, range, s);
      break;
    case 2:
      read_planes<2, 2>(job, *voxels, range, s);
      break;
    case 3:
      read_planes<4, 3>(job, *voxels, range, s);
      break;
    case 4:
      read_planes<4, 4>(job, *voxels, range, s);
      break;
    default:
      if (voxels->bits == 8) {
        classify_wide<8>(job, *voxels, range, s);
      } else {
        classify_wide<16>(job, *voxels, range, s);
      }
  }
}

// The opaque voxels of a chunk, as bits.
class OpaqueVoxels {
 public:
  OpaqueVoxels(const Chunk* chunk, const Job& job) : job_(&job) {
    if (chunk == nullptr) return;
    voxels_ = ChunkStorage::of(*chunk);
    if (voxels_ == nullptr) {
      all_ = job.is_opaque(*chunk->uniform());
      return;
    }
    if (voxels_->direct()) return;
    QUOIN_ASSERT(voxels_->palette.size() <= 256, "a palette of at most 8 bits");
    bool has_some = false;
    for (std::size_t i = 0; i < voxels_->palette.size(); ++i) {
      is_opaque_[i] = job.is_opaque(voxels_->palette[i]);
      if (voxels_->counts[i] == 0) continue;
      if (is_opaque_[i] == 0) others_[other_count_++] = static_cast<std::uint8_t>(i);
      has_some |= is_opaque_[i] != 0;
    }
    if (!has_some) voxels_ = nullptr;
  }

  [[nodiscard]] bool none() const { return voxels_ == nullptr && !all_; }

  // Returns a row; bit x is the voxel at x.
  [[nodiscard]] std::uint64_t row(int y, int z) const {
    if (voxels_ == nullptr) return std::uint64_t{0} - static_cast<std::uint64_t>(all_);
    const std::uint32_t slab = voxels_->slabs[ChunkStorage::slab_index(y, z)];
    if ((slab & ChunkStorage::kUniformSlab) != 0)
      return std::uint64_t{0} - is_opaque(slab & ~ChunkStorage::kUniformSlab);
    const std::uint64_t* cells = voxels_->row(slab, ChunkStorage::row_in_slab(y, z));
    switch (voxels_->bits) {
      case 1:
        return narrow_row<1>(cells);
      case 2:
        return narrow_row<2>(cells);
      case 4:
        return narrow_row<4>(cells);
      default:
        return wide_row(cells);
    }
  }

  // Returns bits; bit i is the first or last voxel of row i of a slab.
  template <bool kLast>
  [[nodiscard]] std::uint64_t ends_of_slab(std::size_t slab) const {
    constexpr std::uint64_t kAllRows = 0xFFFF;
    if (voxels_ == nullptr) return all_ ? kAllRows : 0;
    const std::uint32_t entry = voxels_->slabs[slab];
    if ((entry & ChunkStorage::kUniformSlab) != 0)
      return is_opaque(entry & ~ChunkStorage::kUniformSlab) != 0 ? kAllRows : 0;
    const auto step = static_cast<std::size_t>(voxels_->bits);
    const std::uint64_t* word = voxels_->row(entry, 0) + (kLast ? step - 1 : 0);
    const unsigned shift = kLast ? 64U - static_cast<unsigned>(step) : 0U;
    const std::uint64_t mask = (std::uint64_t{1} << step) - 1;
    std::uint64_t rows = 0;
    for (unsigned i = 0; i < 16; ++i, word += step) {
      rows |= is_opaque(static_cast<std::uint32_t>(*word >> shift & mask)) << i;
    }
    return rows;
  }

 private:
  [[nodiscard]] QUOIN_INLINE std::uint64_t is_opaque(std::uint32_t index) const {
    if (__builtin_expect(voxels_->direct(), 0)) return job_->is_opaque(static_cast<VoxelType>(index));
    return is_opaque_[index];
  }

  template <int kBits>
  [[nodiscard]] std::uint64_t narrow_row(const std::uint64_t* cells) const {
    std::uint64_t planes[kBits];
    for (int k = 0; k < kBits; ++k) planes[k] = plane_of_row<kBits>(cells, k);
    std::uint64_t open = 0;
    for (int i = 0; i < other_count_; ++i) {
      std::uint64_t differs = 0;
      for (int k = 0; k < kBits; ++k) differs |= planes[k] ^ (std::uint64_t{0} - (others_[i] >> k & 1U));
      open |= ~differs;
    }
    return ~open;
  }

  [[nodiscard]] std::uint64_t wide_row(const std::uint64_t* cells) const {
    std::uint64_t mask = 0;
    if (voxels_->direct()) {
      for (int x = 0; x < kChunkEdge; ++x) mask |= is_opaque(packed_row::read(cells, 16, x)) << x;
      return mask;
    }
    for (int i = 0; i < other_count_; ++i) {
      std::uint64_t pattern[8];
      for (std::uint64_t& word : pattern) word = packed_row::repeat(8, others_[i]);
      mask |= equal_cells<8>(cells, pattern);
    }
    return ~mask;
  }

  const ChunkStorage* voxels_ = nullptr;  // null: all (`all_`) or no voxels are opaque
  const Job* job_;
  bool all_ = false;
  int other_count_ = 0;
  std::uint8_t others_[256];  // palette indices that are in use and not opaque
  std::uint8_t is_opaque_[256];
};

// Gathers the rows of the 8 neighbours with the centre's x. Returns true if a neighbour with another z may have opaque
// voxels.
bool gather_rows(const Job& job, Layer& rows) {
  const auto first = [](int d) { return d > 0 ? 64 : d; };
  const auto last = [](int d) { return d < 0 ? -1 : d > 0 ? 64 : 63; };
  bool other_z = false;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      if (dy == 0 && dz == 0) continue;
      const OpaqueVoxels voxels(job.chunks->at(0, dy, dz), job);
      other_z |= dz != 0 && !voxels.none();
      for (int z = first(dz); z <= last(dz); ++z) {
        for (int y = first(dy); y <= last(dy); ++y) {
          rows.words[word_index(z, y)] = voxels.row(y & 63, z & 63);
        }
      }
    }
  }
  return other_z;
}

// Returns true if one of the 18 neighbours with another x may have opaque voxels. Does not read their palettes.
bool has_row_ends(const Job& job) {
  const auto may_be_opaque = [&](const Chunk* chunk) {
    return chunk != nullptr && (ChunkStorage::of(*chunk) != nullptr || job.is_opaque(*chunk->uniform()));
  };
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      if (may_be_opaque(job.chunks->at(-1, dy, dz)) || may_be_opaque(job.chunks->at(1, dy, dz))) return true;
    }
  }
  return false;
}

// Gathers the voxels before and after the rows of the centre, or of a neighbour with the centre's x.
void gather_row_ends(const Job& job, int dy, int dz, Layer& ends_of_rows) {
  const OpaqueVoxels before(job.chunks->at(-1, dy, dz), job);
  const OpaqueVoxels after(job.chunks->at(1, dy, dz), job);
  const auto first = [](int d) { return d < 0 ? 63 : 0; };
  const auto last = [](int d) { return d > 0 ? 0 : 63; };
  for (int z = first(dz) & ~3; z <= last(dz); z += 4) {
    for (int y = first(dy) & ~3; y <= last(dy); y += 4) {
      const std::size_t slab = ChunkStorage::slab_index(y, z);
      const Four rows_before = Four{} + before.ends_of_slab<true>(slab);
      const Four rows_after = Four{} + after.ends_of_slab<false>(slab);
      for (int i = 0; i < 4; ++i) {
        const int row_z = z + i + 64 * dz;
        if (row_z < -1 || row_z > 64) continue;
        const Four shift = Four{0, 1, 2, 3} + static_cast<std::uint64_t>(4 * i);
        const Four ends = ((rows_before >> shift) << 63) | (rows_after >> shift & 1);
        std::uint64_t* out = ends_of_rows.words + word_index(row_z, y + 64 * dy);
        if (dy == 0) {
          *reinterpret_cast<UnalignedFour*>(out) = ends;
        } else {
          (dy < 0 ? out[3] : out[0]) = dy < 0 ? ends[3] : ends[0];
        }
      }
    }
  }
}

// Gathers rows of opacity around the chunk, from its 26 neighbours, in the z view's layout. Returns true if any voxel
// before or after a row of any view may be opaque; only then is `ends` written.
bool gather_border(const Job& job, Layer& rows, Layer& ends) {
  // The x view's rows are along z, so the voxels before and after them belong to the neighbours in z.
  const bool other_z = gather_rows(job, rows);
  if (!other_z && !has_row_ends(job)) return false;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) gather_row_ends(job, dy, dz, ends);
  }
  return true;
}

// Computes the visible faces if some types are transparent: the z view's faces and `sides`, from the z view's other
// layers. A face is hidden by an opaque voxel, or by a transparent voxel of its own type.
void find_faces_of_all_types(const Job& job, bool row_ends, Scratch& s) {
  for (int z = job.region.min.z; z < job.region.max.z; ++z) {
    for (int y = rounded_down(job.region.min.y); y < job.region.max.y; y += kLanes) {
      const int at = word_index(z, y);
      const std::uint64_t* here = s.z.opaque.words + at;
      const Words opaque = load(here);
      const Words solid = job.has_transparent ? load(s.solid.words + at) : opaque;
      const auto put = [&](Layer& faces, Words opaque_front, Words same) {
        store(faces.words + at, solid & ~opaque_front & (opaque | ~same));
      };
      const Words same_x = load(s.z.same_bit.words + at) & (~std::uint64_t{0} >> 1);
      const Words ends = row_ends ? load(s.z.ends.words + at) : Words{};
      put(s.sides[0], opaque >> 1 | ends << 63, same_x);
      put(s.sides[1], opaque << 1 | ends >> 63, same_x << 1);
      put(s.sides[2], load(here + 1), load(s.z.same_row.words + at));
      put(s.sides[3], load(here - 1), load(s.z.same_row.words + at - 1));
      put(s.z.faces[0], load(here + kRowStride), load(s.same_z.words + at));
      put(s.z.faces[1], load(here - kRowStride), load(s.same_z.words + at - kRowStride));
    }
  }
  if (job.has_transparent && (job.shapes == nullptr || job.shapes->has_transparent_cubes)) hide_faces_at_border(job, s);
}

}  // namespace
}  // namespace quoin::blocky

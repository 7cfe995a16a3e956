// The mesher's inner passes, compiled once for each instruction set: the including file defines QUOIN_KERNEL (a
// namespace), QUOIN_KERNEL_AVX2 (0 or 1), and switches the compiler's target.
// Longer than other files because all of it must be compiled under that target, and inlined into one another.
//
// Design: rows of 64 voxels are words. A corner's level is two bit planes, computed for 64 faces at once; merging along
// a row and from row to row is a handful of word operations (an addition carries "every cell agrees" to a run's end).
// What is left a quad is one flat loop without unpredictable branches.

namespace quoin::blocky::QUOIN_KERNEL {
namespace {

using Words __attribute__((vector_size(32))) = std::uint64_t;
using UnalignedWords __attribute__((vector_size(32), aligned(8))) = std::uint64_t;

#define QUOIN_INLINE inline __attribute__((always_inline))
#define QUOIN_STAGE inline __attribute__((noinline))  // stands apart in a profile

QUOIN_INLINE Words load(const std::uint64_t* p) {
  return *reinterpret_cast<const UnalignedWords*>(p);
}
QUOIN_INLINE void store(std::uint64_t* p, Words v) {
  *reinterpret_cast<UnalignedWords*>(p) = v;
}

QUOIN_INLINE bool any(Words v) {
#if QUOIN_KERNEL_AVX2
  const __m256i bits = reinterpret_cast<__m256i>(v);
  return _mm256_testz_si256(bits, bits) == 0;
#else
  return (v[0] | v[1] | v[2] | v[3]) != 0;
#endif
}

// Position of the lowest bit. Requires: there is one.
QUOIN_INLINE std::uint64_t lowest_bit(std::uint64_t w) {
#if QUOIN_KERNEL_AVX2
  return _tzcnt_u64(w);
#else
  return static_cast<std::uint64_t>(__builtin_ctzll(w));
#endif
}

// From packed voxels to layers of bits.

QUOIN_INLINE std::uint64_t even_bits(std::uint64_t w) {
#if QUOIN_KERNEL_AVX2
  return _pext_u64(w, 0x5555'5555'5555'5555U);
#else
  return packed_row::gather_even_bits(w);
#endif
}

QUOIN_INLINE std::uint64_t nibble_bits(std::uint64_t w) {
#if QUOIN_KERNEL_AVX2
  return _pext_u64(w, 0x1111'1111'1111'1111U);
#else
  return packed_row::gather_nibble_bits(w);
#endif
}

// Bit k of each voxel of a row of 1, 2 or 4 bits a voxel.
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

// The voxels of a row that equal those of another: 8 or 16 bits a voxel.
template <int kBits>
QUOIN_INLINE std::uint64_t equal_cells(const std::uint64_t* a, const std::uint64_t* b) {
#if QUOIN_KERNEL_AVX2
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

struct Range {
  int begin;
  int end;
};

// The slabs that hold the region and the voxels around it.
struct SlabRange {
  Range y;  // rows, multiples of 4
  Range z;
};

QUOIN_INLINE SlabRange slabs_around(const IBox& region) {
  const auto widened = [](int low, int high) {
    return Range{(low > 0 ? low - 1 : 0) & ~3, ((high < 64 ? high + 1 : 64) + 3) & ~3};
  };
  return {widened(region.min.y, region.max.y), widened(region.min.z, region.max.z)};
}

void find_rows(const Chunk::Mixed& voxels, const SlabRange& range, Scratch& s) {
  for (int z = range.z.begin; z < range.z.end; z += 4) {
    for (int y = range.y.begin; y < range.y.end; y += 4) {
      const auto slab = static_cast<unsigned>(z * 4 + y / 4);
      const std::uint32_t entry = voxels.slabs[slab];
      const bool is_uniform = (entry & Chunk::kUniformSlab) != 0;
      if (is_uniform) {
        const std::uint64_t pattern = packed_row::repeat(voxels.bits, entry & ~Chunk::kUniformSlab);
        for (int i = 0; i < voxels.bits; ++i) s.patterns[slab][i] = pattern;
      }
      const auto first = reinterpret_cast<std::uint64_t>(is_uniform ? s.patterns[slab] : voxels.row(entry, 0));
      const std::uint64_t step = is_uniform ? 0 : static_cast<std::uint64_t>(voxels.bits) * 8;
      Words four = Words{0, step, 2 * step, 3 * step} + first;
      for (int i = 0; i < 4; ++i) {
        static_assert(sizeof(s.rows[0]) == sizeof(std::uint64_t));
        __builtin_memcpy(s.rows + (z + i) * 64 + y, &four, sizeof(four));
        four += 4 * step;
      }
    }
  }
}

// The bit planes of rows of 1, 2 or 4 bits a voxel.
template <int kBits>
void split_planes(const Chunk::Mixed& voxels, const SlabRange& range, Scratch& s) {
  for (int z = range.z.begin; z < range.z.end; ++z) {
    for (int y = range.y.begin; y < range.y.end; y += 4) {
      const std::uint32_t slab = voxels.slabs[Chunk::slab_index(y, z)];
      const std::uint64_t* first = s.rows[z * 64 + y];
      for (int k = 0; k < kBits; ++k) {
        std::uint64_t* out = s.planes[k].words + word_index(z, y);
        if ((slab & Chunk::kUniformSlab) != 0) {
          store(out, Words{} - (slab >> k & 1U));
        } else {
          for (int i = 0; i < 4; ++i) out[i] = plane_of_row<kBits>(first + i * kBits, k);
        }
      }
    }
  }
}

// Opacity and "not air" from the bit planes, four rows at a time.
template <int kBits>
void classify_planes(const Job& job, const SlabRange& range, Scratch& s) {
  int others[1 << kBits];  // indices that are not opaque
  int count = 0;
  for (int i = 0; i < (1 << kBits); ++i) {
    if (s.index_class[i] != 1) others[count++] = i;
  }
  for (int z = range.z.begin; z < range.z.end; ++z) {
    for (int y = range.y.begin; y < range.y.end; y += 4) {
      const int at = word_index(z, y);
      Words opaque = ~Words{};
      Words solid = ~Words{};
      for (int i = 0; i < count; ++i) {
        Words differs{};
        for (int k = 0; k < kBits; ++k) {
          differs |= load(s.planes[k].words + at) ^ (Words{} - static_cast<std::uint64_t>(others[i] >> k & 1));
        }
        opaque &= differs;
        if (s.index_class[others[i]] == 0) solid &= differs;
      }
      store(s.z.opaque.words + at, opaque);
      if (job.has_transparent) store(s.solid.words + at, solid);
    }
  }
}

// Where neighbours are of one type; and opacity, where air is the only index that is not opaque.
template <int kBits>
void compare_planes(const SlabRange& range, int air, Scratch& s) {
  Words air_bits[kBits];
  for (int k = 0; k < kBits; ++k) air_bits[k] = Words{} - static_cast<std::uint64_t>(air >> k & 1);
  for (int z = range.z.begin; z < range.z.end; ++z) {
    for (int y = range.y.begin; y < range.y.end; y += 4) {
      const int at = word_index(z, y);
      Words opaque{};
      Words along_x{};
      Words along_y{};
      Words along_z{};
      for (int k = 0; k < kBits; ++k) {
        const std::uint64_t* p = s.planes[k].words + at;
        const Words here = load(p);
        opaque |= here ^ air_bits[k];
        along_x |= here ^ (here >> 1);
        along_y |= here ^ load(p + 1);
        along_z |= here ^ load(p + kRowStride);
      }
      if (air >= 0) store(s.z.opaque.words + at, opaque);
      store(s.z.same_bit.words + at, ~along_x);
      store(s.z.same_row.words + at, ~along_y);
      store(s.same_z.words + at, ~along_z);
    }
  }
}

// The only palette index that is not opaque, if that is air; -1 otherwise.
int sole_air_index(const Scratch& s, int indices) {
  int air = -1;
  for (int i = 0; i < indices; ++i) {
    if (s.index_class[i] == 1) continue;
    if (air >= 0 || s.index_class[i] == 2) return -1;
    air = i;
  }
  return air;
}

template <int kBits>
void read_planes(const Job& job, const Chunk::Mixed& voxels, const SlabRange& range, Scratch& s) {
  split_planes<kBits>(voxels, range, s);
  const int air = sole_air_index(s, 1 << kBits);
  if (air < 0) classify_planes<kBits>(job, range, s);
  compare_planes<kBits>(range, air, s);
}

// As above for 8 and 16 bits: whole rows are compared, a palette index is classified a row at a time.
template <int kBits>
void classify_wide(const Job& job, const Chunk::Mixed& voxels, const SlabRange& range, Scratch& s) {
  const auto cells_of = [&](const std::uint64_t* row, std::uint32_t index) {
    std::uint64_t pattern[kBits];
    for (int i = 0; i < kBits; ++i) pattern[i] = packed_row::repeat(kBits, index);
    return equal_cells<kBits>(row, pattern);
  };
  const auto transparent_cells = [&](const std::uint64_t* row) {
    std::uint64_t mask = 0;
    if constexpr (kBits == 8) {
      for (std::uint32_t i = 0; i < voxels.palette.size(); ++i) {
        if (s.index_class[i] == 2) mask |= cells_of(row, i);
      }
    } else {
      for (int x = 0; x < 64; ++x) {
        const auto type = static_cast<VoxelType>(packed_row::read(row, kBits, x));
        mask |= std::uint64_t{job.types->is_transparent(type)} << x;
      }
    }
    return mask;
  };
  std::uint32_t air = 0;
  bool has_air = true;
  if constexpr (kBits == 8) {
    for (air = 0; air < voxels.palette.size() && s.index_class[air] != 0;) ++air;
    has_air = air < voxels.palette.size();
  }
  for (int z = range.z.begin; z < range.z.end; ++z) {
    for (int y = range.y.begin; y < range.y.end; ++y) {
      const std::uint64_t* row = s.rows[z * 64 + y];
      const std::uint64_t solid = has_air ? ~cells_of(row, air) : ~std::uint64_t{0};
      const int at = word_index(z, y);
      std::uint64_t opaque = solid;
      if (job.has_transparent) {
        s.solid.words[at] = solid;
        opaque &= ~transparent_cells(row);
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
  const std::uint64_t opaque = job.types->is_opaque(type) ? ~std::uint64_t{0} : 0;
  for (int z = range.z.begin; z < range.z.end; ++z) {
    for (int y = range.y.begin; y < range.y.end; ++y) {
      const int at = word_index(z, y);
      s.z.opaque.words[at] = opaque;
      s.solid.words[at] = s.z.same_bit.words[at] = s.z.same_row.words[at] = s.same_z.words[at] = ~std::uint64_t{0};
    }
  }
}

void fill_layers(const Job& job, const SlabRange& range, Scratch& s) {
  const Chunk::Mixed* voxels = job.chunks->centre()->mixed();
  if (voxels == nullptr) {
    classify_uniform(job, range, s);
    return;
  }
  find_rows(*voxels, range, s);
  if (!voxels->direct()) {
    for (std::size_t i = 0; i < 256; ++i) {
      s.index_class[i] =
          i < voxels->palette.size() ? static_cast<std::uint8_t>(job.types->visibility(voxels->palette[i])) : 1;
    }
  }
  switch (voxels->bits) {
    case 1:
      read_planes<1>(job, *voxels, range, s);
      break;
    case 2:
      read_planes<2>(job, *voxels, range, s);
      break;
    case 4:
      read_planes<4>(job, *voxels, range, s);
      break;
    case 8:
      classify_wide<8>(job, *voxels, range, s);
      break;
    default:
      classify_wide<16>(job, *voxels, range, s);
      break;
  }
}

// The layers in the layouts of the other views.

// Word j of vector i becomes word i of vector j.
QUOIN_INLINE void transpose_words(const Words (&in)[4], Words (&out)[4]) {
  const Words a = __builtin_shufflevector(in[0], in[1], 0, 4, 2, 6);
  const Words b = __builtin_shufflevector(in[0], in[1], 1, 5, 3, 7);
  const Words c = __builtin_shufflevector(in[2], in[3], 0, 4, 2, 6);
  const Words d = __builtin_shufflevector(in[2], in[3], 1, 5, 3, 7);
  out[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  out[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  out[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  out[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

// Rows [z][y] to rows [y][z]; words are moved whole.
void swap_planes_and_rows(const Layer& from, Layer& to, Range z_range, Range y_range) {
  for (int z = z_range.begin; z < z_range.end; z += 4) {
    for (int y = y_range.begin; y < y_range.end; y += 4) {
      Words in[4];
      for (int i = 0; i < 4; ++i) in[i] = load(from.words + word_index(z + i, y));
      Words out[4];
      transpose_words(in, out);
      for (int i = 0; i < 4; ++i) store(to.words + word_index(y + i, z), out[i]);
    }
  }
}

template <int kShift>
QUOIN_INLINE void exchange(Words& low, Words& high) {
  constexpr std::uint64_t kMasks[] = {0x5555'5555'5555'5555U, 0x3333'3333'3333'3333U, 0x0F0F'0F0F'0F0F'0F0FU,
                                      0x00FF'00FF'00FF'00FFU, 0x0000'FFFF'0000'FFFFU, 0x0000'0000'FFFF'FFFFU};
  constexpr std::uint64_t kMask = kMasks[__builtin_ctz(kShift)];
  const Words t = ((low >> kShift) ^ high) & kMask;
  high ^= t;
  low ^= t << kShift;
}

// Bits x of 64 rows z become bits z of 64 planes x, for four rows y side by side.
void transpose_bits(const std::uint64_t* from, std::uint64_t* to) {
  Words all_or{};
  Words all_and = ~Words{};
  Words half[64];
  for (int i = 0; i < 64; ++i) {
    half[i] = load(from + i * kRowStride);
    all_or |= half[i];
    all_and &= half[i];
  }
  if (!any(all_or) || !any(~all_and)) {
    for (int i = 0; i < 64; ++i) store(to + i * kRowStride, all_or);
    return;
  }
  for (int i = 0; i < 8; ++i) {
    Words v[8];
    for (int j = 0; j < 8; ++j) v[j] = half[i + 8 * j];
    for (int j = 0; j < 4; ++j) exchange<32>(v[j], v[j + 4]);
    for (int j = 0; j < 8; j += 4) {
      exchange<16>(v[j], v[j + 2]);
      exchange<16>(v[j + 1], v[j + 3]);
    }
    for (int j = 0; j < 8; j += 2) exchange<8>(v[j], v[j + 1]);
    for (int j = 0; j < 8; ++j) half[i + 8 * j] = v[j];
  }
  for (int i = 0; i < 64; i += 8) {
    Words v[8];
    for (int j = 0; j < 8; ++j) v[j] = half[i + j];
    for (int j = 0; j < 4; ++j) exchange<4>(v[j], v[j + 4]);
    for (int j = 0; j < 8; j += 4) {
      exchange<2>(v[j], v[j + 2]);
      exchange<2>(v[j + 1], v[j + 3]);
    }
    for (int j = 0; j < 8; j += 2) exchange<1>(v[j], v[j + 1]);
    for (int j = 0; j < 8; ++j) store(to + (i + j) * kRowStride, v[j]);
  }
}

void turn_bits(const Layer& from, Layer& to, Range y_range) {
  for (int y = y_range.begin; y < y_range.end; y += 4) {
    transpose_bits(from.words + word_index(0, y), to.words + word_index(0, y));
  }
}

// The rows outside the chunk in the y and x views, from those of the z view.
void copy_border(bool row_ends, Scratch& s) {
  for (int row = -1; row <= 64; ++row) {
    for (const int side : {-1, 64}) {
      s.y.opaque.words[word_index(side, row)] = s.z.opaque.words[word_index(row, side)];
      s.y.opaque.words[word_index(row, side)] = s.z.opaque.words[word_index(side, row)];
    }
  }
  for (int y = -1; y <= 64; ++y) {
    std::uint64_t low = 0;
    std::uint64_t high = 0;
    for (int z = 0; z < 64 && row_ends; ++z) {
      low |= (s.z.before.words[word_index(z, y)] & 1) << z;
      high |= (s.z.after.words[word_index(z, y)] >> 63) << z;
    }
    s.x.opaque.words[word_index(-1, y)] = low;
    s.x.opaque.words[word_index(64, y)] = high;
  }
}

void copy_row_ends(Scratch& s) {
  for (int plane = -1; plane <= 64; ++plane) {
    for (int row = -1; row <= 64; ++row) {
      s.y.before.words[word_index(plane, row)] = s.z.before.words[word_index(row, plane)];
      s.y.after.words[word_index(plane, row)] = s.z.after.words[word_index(row, plane)];
    }
  }
  for (int y = -1; y <= 64; ++y) {
    const auto row_end = [&](const Layer& layer, int z, int x) {
      if (x < 0) return s.z.before.words[word_index(z, y)] & 1;
      if (x > 63) return s.z.after.words[word_index(z, y)] >> 63;
      return layer.words[word_index(z, y)] >> x & 1;
    };
    for (int x = -1; x <= 64; ++x) {
      s.x.before.words[word_index(x, y)] = row_end(s.z.opaque, -1, x);
      s.x.after.words[word_index(x, y)] = row_end(s.z.opaque, 64, x) << 63;
    }
  }
}

// The passes over one direction.

struct Pass {
  const View* view;
  const std::uint64_t* row_masks;  // by row: the cells of the region
  Range planes;
  Range rows;
  int side;       // +1 or -1: where the faces look
  bool row_ends;  // some voxel before or after a row may be opaque
};

// Visible faces of a batch of planes, and the list of groups of four rows that have any.
template <bool kTransparent>
QUOIN_STAGE int find_faces(const Pass& pass, int first_plane, int plane_count, Batch& b) {
  int groups = 0;
  for (int i = 0; i < plane_count; ++i) {
    const int plane = first_plane + i;
    const std::uint64_t* here = pass.view->opaque.words + word_index(plane, 0);
    const std::uint64_t* front = here + pass.side * kRowStride;
    const std::uint64_t* given = pass.view->faces[pass.side < 0].words + word_index(plane, 0);
    for (int row = pass.rows.begin; row < pass.rows.end; row += 4) {
      const Words mask = load(pass.row_masks + row);
      const Words faces = (kTransparent ? load(given + row) : load(here + row) & ~load(front + row)) & mask;
      const int at = i * kRowStride + row;
      store(b.faces + at, faces);
      b.groups[groups] = static_cast<std::uint16_t>(at);
      groups += static_cast<int>(any(faces));
    }
    b.faces[i * kRowStride + pass.rows.end] = 0;
  }
  return groups;
}

struct Levels {
  Words low;
  Words high;
};

QUOIN_INLINE Levels corner_levels(Words side1, Words side2, Words corner) {
  const Words one = side1 ^ side2;
  const Words both = side1 & side2;
  return {(one ^ corner) | both, both | (one & corner)};
}

QUOIN_INLINE Words differ(const Levels& a, const Levels& b) {
  return (a.low ^ b.low) | (a.high ^ b.high);
}

// Splits the faces of each listed group into runs of equal type and constant levels.
template <bool kMerge, bool kOcclusion, bool kRowEnds>
QUOIN_STAGE void find_runs(const Pass& pass, int first_plane, int groups, Batch& b) {
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const Words faces = load(b.faces + at);
    if constexpr (!kMerge) {
      store(b.starts + at, faces);
      store(b.ends + at, faces);
      store(b.mergeable + at, Words{});
      continue;
    }
    const int here = word_index(first_plane, 0) + at;
    Words joined = faces;
    if constexpr (kOcclusion) {
      const int front = here + pass.side * kRowStride;
      const auto row_at = [&](int offset, Words& before, Words& middle, Words& after) {
        middle = load(pass.view->opaque.words + front + offset);
        before = middle << 1;
        after = middle >> 1;
        if constexpr (kRowEnds) {
          before |= load(pass.view->before.words + front + offset);
          after |= load(pass.view->after.words + front + offset);
        }
      };
      Words a_before, a, a_after, b_before, unused, b_after, c_before, c, c_after;
      row_at(-1, a_before, a, a_after);
      row_at(0, b_before, unused, b_after);
      row_at(1, c_before, c, c_after);
      const Levels l00 = corner_levels(b_before, a, a_before);
      const Levels l10 = corner_levels(b_after, a, a_after);
      const Levels l01 = corner_levels(b_before, c, c_before);
      const Levels l11 = corner_levels(b_after, c, c_after);
      joined &= ~(differ(l00, l10) | differ(l01, l11));
      store(b.mergeable + at, faces & ~(differ(l00, l01) | differ(l10, l11)));
    } else {
      store(b.mergeable + at, faces);
    }
    const Words merged = joined & (joined >> 1) & load(pass.view->same_bit.words + here);
    store(b.starts + at, faces & ~(merged << 1));
    store(b.ends + at, faces & ~merged);
  }
}

// Which runs go on in the next row: those with the same extent, type and levels constant along the rows.
QUOIN_STAGE void find_growth(const Pass& pass, int first_plane, int groups, Batch& b) {
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const int here = word_index(first_plane, 0) + at;
    const Words starts = load(b.starts + at);
    const Words ends = load(b.ends + at);
    const Words agree = load(b.mergeable + at) & load(b.mergeable + at + 1) & load(b.faces + at + 1) &
                        load(pass.view->same_row.words + here) & ~(starts ^ load(b.starts + at + 1)) &
                        ~(ends ^ load(b.ends + at + 1));
    // The sum carries from a run's first cell to its last only if all cells between agree.
    store(b.closes + at, ends & ~(((agree & ~ends) + starts) & agree));
  }
}

// Where a quad of one direction holds what.
template <int kDirection>
struct Layout {
  static constexpr FaceFrame kFrame = kFaceFrames[kDirection];
  static constexpr int kAxis = kFrame.axis;
  static constexpr int kRowAxis = kAxis == 1 ? 2 : 1;
  static constexpr int kBitAxis = kAxis == 0 ? 2 : 0;
  static constexpr bool kUAlongBits = kFrame.u == kBitAxis;
  static constexpr int kWidthShift = kUAlongBits ? Quad::kSizeUShift : Quad::kSizeVShift;
  static constexpr int kHeightShift = kUAlongBits ? Quad::kSizeVShift : Quad::kSizeUShift;
};

// How quads learn their types: all have one, or each looks into its voxel's packed row.
inline constexpr int kOneType = -1;

struct TypeSource {
  std::uint64_t one;  // in a quad's place; 0 when there are several
  int log_bits;       // of the packed rows, or kOneType
};

// Puts the rows of the listed groups that have runs side by side; answers how many runs those are.
template <int kDirection>
QUOIN_STAGE std::size_t list_rows(const Pass& pass, int first_plane, int groups, const TypeSource& types, Scratch& s) {
  using L = Layout<kDirection>;
  Batch& b = s.batch;
  const std::uint64_t* places = s.levels.places[L::kAxis];
  const std::uint64_t base = (std::uint64_t{kDirection} << Quad::kDirectionShift) + types.one +
                             (static_cast<std::uint64_t>(first_plane) << (6 * L::kAxis));
  const std::uint64_t* front = pass.view->opaque.words + word_index(first_plane + L::kFrame.sign, 0);
  Row* out = b.rows;
  std::int64_t runs = 0;
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const Words columns[4] = {load(b.ends + at), load(b.starts + at), load(b.closes + at), load(places + at) + base};
    Words rows[4];
    transpose_words(columns, rows);
    // All four are written; a row without runs is written over by the next.
    for (int k = 0; k < 4; ++k) {
      const std::uint64_t ends = b.ends[at + k];
      store(&out->ends, rows[k]);
      out->front = front + at + k;
      out += ends != 0;
      runs += __builtin_popcountll(ends);
    }
  }
  out->ends = out->starts = 0;
  return static_cast<std::size_t>(runs);
}

// The bits of the 9 voxels in front of the first or last cell of a row, as the level tables index them.
__attribute__((noinline)) std::uint64_t bits_in_front_at_end(const Pass& pass, const std::uint64_t* front,
                                                             bool is_first) {
  const std::int64_t word = front - pass.view->opaque.words;
  std::uint64_t bits = 0;
  for (int row = 1; row >= -1; --row) {
    const std::uint64_t before = pass.row_ends ? pass.view->before.words[word + row] & 1 : 0;
    const std::uint64_t after = pass.row_ends ? pass.view->after.words[word + row] >> 63 : 0;
    bits = bits << 3 | (is_first ? (front[row] << 1 | before) & 7 : front[row] >> 62 | after << 2);
  }
  return bits;
}

QUOIN_INLINE std::uint64_t bits_in_front(const Pass& pass, const std::uint64_t* front, std::uint64_t cell) {
  const std::uint64_t shift = cell - 1;
  if (__builtin_expect(shift >= 62, 0)) return bits_in_front_at_end(pass, front, cell == 0);
  return (front[-1] >> shift & 7) + (front[0] >> shift & 7) * 8 + (front[1] >> shift & 7) * 64;
}

// Removes the lowest bits of both words; when none are left, takes up the next row, without a branch.
QUOIN_INLINE void next_run(std::uint64_t& starts, std::uint64_t& ends, const Row*& row) {
  const Row* next = row + 1;
  starts &= starts - 1;
#if QUOIN_KERNEL_AVX2
  // Compilers make this a branch, which mispredicts in every other row.
  asm("blsr %[ends], %[ends]\n\t"
      "cmovz %[next_starts], %[starts]\n\t"
      "cmovz %[next_ends], %[ends]\n\t"
      "cmovz %[next], %[row]"
      : [starts] "+&r"(starts), [ends] "+&r"(ends), [row] "+r"(row)
      : [next_starts] "m"(next->starts), [next_ends] "m"(next->ends), [next] "r"(next)
      : "cc");
#else
  ends &= ends - 1;
  const auto done = static_cast<std::uint64_t>(ends == 0);
  starts |= next->starts & (std::uint64_t{0} - done);
  ends |= next->ends & (std::uint64_t{0} - done);
  row += done;
#endif
}

// The type of a cell of a row, in a quad's place. `place` holds the row's plane and number.
template <int kDirection, int kLogBits>
QUOIN_INLINE std::uint64_t type_of(const Scratch& s, std::uint64_t place, std::uint64_t cell) {
  using L = Layout<kDirection>;
  if constexpr (kLogBits == kOneType) {
    return 0;
  } else {
    // Bits 6 to 17 of a quad number its voxel's row; in the x view the cell is the z in that number.
    const std::uint64_t row = (place >> 6 & 0xFFF) + (L::kAxis == 0 ? cell << 6 : 0);
    const std::uint64_t x = L::kAxis == 0 ? place & 63 : cell;
    const std::uint64_t bit = x << kLogBits;
    constexpr std::uint64_t kMask = (std::uint64_t{1} << (1 << kLogBits)) - 1;
    const std::uint64_t index = s.rows[row][bit >> 6] >> static_cast<unsigned>(bit & 63) & kMask;
    return kLogBits == 4 ? index << Quad::kTypeShift : s.palette[index];
  }
}

// Turns the runs of a batch into quads. A run that ends here becomes one; one that grows only counts a row. One flat
// loop over all runs.
template <int kDirection, bool kOcclusion, int kLogBits>
QUOIN_STAGE std::uint64_t* emit(const Pass& pass, std::size_t runs, Scratch& s, std::uint64_t* out) {
  using L = Layout<kDirection>;
  // A row more starts lower and is higher.
  constexpr std::uint64_t kPerRow = (std::uint64_t{1} << L::kHeightShift) - (std::uint64_t{1} << (6 * L::kRowAxis));
  const Row* row = s.batch.rows;
  std::uint64_t starts = row->starts;
  std::uint64_t ends = row->ends;
  for (; runs != 0; --runs) {
    const std::uint64_t first = lowest_bit(starts);
    const std::uint64_t last = lowest_bit(ends);
    const std::uint64_t closes = row->closes >> last & 1;
    const std::uint64_t rows_before = s.batch.rows_before[last];
    s.batch.rows_before[last] = (rows_before + kPerRow) & (closes - 1);
    std::uint64_t quad = row->place + rows_before + (first << (6 * L::kBitAxis)) + ((last - first) << L::kWidthShift);
    if constexpr (kOcclusion) {
      const std::uint64_t around = bits_in_front(pass, row->front, last);
      quad |= L::kUAlongBits ? s.levels.u_along_bits[around] : s.levels.u_along_rows[around];
    }
    *out = quad | type_of<kDirection, kLogBits>(s, row->place, last);
    out += closes;
    next_run(starts, ends, row);
  }
  return out;
}

template <int kDirection, bool kOcclusion>
std::uint64_t* emit(const Pass& pass, int log_bits, std::size_t runs, Scratch& s, std::uint64_t* out) {
  switch (log_bits) {
    case kOneType:
      return emit<kDirection, kOcclusion, kOneType>(pass, runs, s, out);
    case 0:
      return emit<kDirection, kOcclusion, 0>(pass, runs, s, out);
    case 1:
      return emit<kDirection, kOcclusion, 1>(pass, runs, s, out);
    case 2:
      return emit<kDirection, kOcclusion, 2>(pass, runs, s, out);
    case 3:
      return emit<kDirection, kOcclusion, 3>(pass, runs, s, out);
    default:
      return emit<kDirection, kOcclusion, 4>(pass, runs, s, out);
  }
}

template <int kDirection, bool kOcclusion>
void run_pass(const Job& job, const Pass& pass, const TypeSource& types, Scratch& s, QuadBuffer& quads) {
  Batch& b = s.batch;
  for (int first = pass.planes.begin; first < pass.planes.end; first += kBatchPlanes) {
    const int count = pass.planes.end - first < kBatchPlanes ? pass.planes.end - first : kBatchPlanes;
    const int groups =
        job.has_transparent ? find_faces<true>(pass, first, count, b) : find_faces<false>(pass, first, count, b);
    if (groups == 0) continue;
    if (!job.merge) {
      find_runs<false, kOcclusion, false>(pass, first, groups, b);
    } else if (pass.row_ends) {
      find_runs<true, kOcclusion, true>(pass, first, groups, b);
    } else {
      find_runs<true, kOcclusion, false>(pass, first, groups, b);
    }
    find_growth(pass, first, groups, b);
    const std::size_t runs = list_rows<kDirection>(pass, first, groups, types, s);
    std::uint64_t* begin = grow_quads(quads, s.quads, runs + 1);
    const std::uint64_t* end = emit<kDirection, kOcclusion>(pass, types.log_bits, runs, s, begin);
    s.quads += static_cast<std::size_t>(end - begin);
  }
}

// How the axes of a direction map to planes, rows and bits.
Pass pass_for(Direction direction, const Job& job, const Scratch& s, bool row_ends) {
  const FaceFrame& frame = frame_of(direction);
  constexpr int kRowAxis[3] = {1, 2, 1};
  const int row_axis = kRowAxis[frame.axis];
  Pass pass{};
  pass.view = frame.axis == 0 ? &s.x : frame.axis == 1 ? &s.y : &s.z;
  pass.row_masks = s.row_masks[frame.axis];
  pass.planes = {job.region.min[frame.axis], job.region.max[frame.axis]};
  pass.rows = {job.region.min[row_axis] & ~3, (job.region.max[row_axis] + 3) & ~3};
  pass.side = frame.sign;
  pass.row_ends = row_ends;
  return pass;
}

void fill_row_masks(const IBox& region, Scratch& s) {
  constexpr int kRowAxis[3] = {1, 2, 1};
  constexpr int kBitAxis[3] = {2, 0, 0};
  for (int axis = 0; axis < 3; ++axis) {
    const int first = region.min[kBitAxis[axis]];
    const int last = region.max[kBitAxis[axis]] - 1;
    const std::uint64_t cells = (~std::uint64_t{0} << first) & (~std::uint64_t{0} >> (63 - last));
    for (int row = 0; row < 72; ++row) {
      const bool is_inside = row >= region.min[kRowAxis[axis]] && row < region.max[kRowAxis[axis]];
      s.row_masks[axis][row] = is_inside ? cells : 0;
    }
  }
}

// With transparent types a face depends on both voxels' types: all six face layers are made in the z view's layout.
void fill_faces(const Job& job, const SlabRange& range, bool row_ends, Scratch& s) {
  find_faces_of_all_types(job, row_ends, s);
  for (int i = 0; i < 2; ++i) {
    turn_bits(s.sides[i], s.x.faces[i], range.y);
    swap_planes_and_rows(s.sides[2 + i], s.y.faces[i], range.z, range.y);
  }
}

// The type of all of a chunk's voxels besides air, when there is just one.
bool has_one_type(const Chunk& chunk, VoxelType& type) {
  const Chunk::Mixed* voxels = chunk.mixed();
  if (voxels == nullptr) {
    type = *chunk.uniform();
    return true;
  }
  int found = voxels->direct() ? 2 : 0;
  for (std::size_t i = 0; i < voxels->palette.size() && found < 2; ++i) {
    if (voxels->counts[i] == 0 || voxels->palette[i] == kAir) continue;
    type = voxels->palette[i];
    ++found;
  }
  return found == 1;
}

template <int kDirection>
void run_direction(const Job& job, bool row_ends, const TypeSource& types, Scratch& s, QuadBuffer& out) {
  const Pass pass = pass_for(static_cast<Direction>(kDirection), job, s, row_ends);
  if (job.occlusion) {
    run_pass<kDirection, true>(job, pass, types, s, out);
  } else {
    run_pass<kDirection, false>(job, pass, types, s, out);
  }
}

void run_directions(const Job& job, bool row_ends, Scratch& s, QuadBuffer& out) {
  TypeSource types{0, kOneType};
  const Chunk& centre = *job.chunks->centre();
  VoxelType type = kAir;
  if (has_one_type(centre, type)) {
    types.one = std::uint64_t{type} << Quad::kTypeShift;
  } else {
    const Chunk::Mixed& voxels = *centre.mixed();
    types.log_bits = __builtin_ctz(static_cast<unsigned>(voxels.bits));
    for (std::size_t i = 0; i < voxels.palette.size(); ++i) {
      s.palette[i] = std::uint64_t{voxels.palette[i]} << Quad::kTypeShift;
    }
  }
  run_direction<0>(job, row_ends, types, s, out);
  run_direction<1>(job, row_ends, types, s, out);
  run_direction<2>(job, row_ends, types, s, out);
  run_direction<3>(job, row_ends, types, s, out);
  run_direction<4>(job, row_ends, types, s, out);
  run_direction<5>(job, row_ends, types, s, out);
}

// The region without its solid floor: layers in which every voxel, of the region and around it, is opaque, like the
// layers below and above, show no face. A common case, the ground under a terrain's surface.
IBox above_solid_floor(const Job& job, bool row_ends, const Scratch& s) {
  const IBox& region = job.region;
  const std::uint64_t first = region.min.x > 0 ? region.min.x - 1U : 0U;
  const std::uint64_t last = region.max.x < 64 ? static_cast<unsigned>(region.max.x) : 63U;
  const std::uint64_t cells = (~std::uint64_t{0} << first) & (~std::uint64_t{0} >> (63 - last));
  const auto is_solid = [&](int y) {
    for (int z = region.min.z - 1; z <= region.max.z; ++z) {
      const int at = word_index(z, y);
      const bool before = region.min.x > 0 || (row_ends && (s.z.before.words[at] & 1) != 0);
      const bool after = region.max.x < 64 || (row_ends && s.z.after.words[at] >> 63 != 0);
      if ((s.z.opaque.words[at] & cells) != cells || !before || !after) return false;
    }
    return true;
  };
  int y = region.min.y - 1;
  while (y < region.max.y && is_solid(y)) ++y;
  IBox rest = region;
  if (y - 1 > rest.min.y) rest.min.y = y - 1;
  return rest;
}

// Nothing merges across the chunk's last row or plane.
void end_at_border(const SlabRange& range, Scratch& s) {
  for (int z = range.z.begin; z < range.z.end; ++z) s.z.same_row.words[word_index(z, 63)] = 0;
  for (int y = range.y.begin; y < range.y.end; ++y) s.same_z.words[word_index(63, y)] = 0;
}

void find_all_faces(const Job& job, Scratch& s) {
  const SlabRange range = slabs_around(job.region);
  fill_layers(job, range, s);
  find_faces_of_all_types(job, gather_border(job, s), s);
}

void mesh_chunk(const Job& whole, Scratch& s, QuadBuffer& out) {
  const SlabRange read = slabs_around(whole.region);
  fill_layers(whole, read, s);
  end_at_border(read, s);
  const bool row_ends = gather_border(whole, s);
  Job job = whole;
  job.region = above_solid_floor(whole, row_ends, s);
  if (job.region.empty()) return;
  const SlabRange range = slabs_around(job.region);
  fill_row_masks(job.region, s);
  swap_planes_and_rows(s.z.opaque, s.y.opaque, range.z, range.y);
  swap_planes_and_rows(s.z.same_bit, s.y.same_bit, range.z, range.y);
  swap_planes_and_rows(s.same_z, s.y.same_row, range.z, range.y);
  const Range bordered = {range.y.begin - (range.y.begin == 0 ? 4 : 0), range.y.end + (range.y.end == 64 ? 4 : 0)};
  turn_bits(s.z.opaque, s.x.opaque, bordered);
  turn_bits(s.same_z, s.x.same_bit, range.y);
  turn_bits(s.z.same_row, s.x.same_row, range.y);
  copy_border(row_ends, s);
  if (row_ends) copy_row_ends(s);
  if (job.has_transparent) fill_faces(job, range, row_ends, s);
  run_directions(job, row_ends, s, out);
}

#undef QUOIN_INLINE
#undef QUOIN_STAGE

}  // namespace
}  // namespace quoin::blocky::QUOIN_KERNEL

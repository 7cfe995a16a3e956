// The mesher's inner passes, compiled once for each instruction set: the including file defines QUOIN_KERNEL (a
// namespace), QUOIN_KERNEL_AVX2 (0 or 1), and switches the compiler's target.
//
// Design: rows of 64 voxels are words. A corner's level is two bit planes, computed for 64 faces at once; merging along
// a row and from row to row is a handful of word operations (an addition carries "every cell agrees" to a run's end).
// What is left a quad is one flat loop without unpredictable branches.

namespace quoin::blocky::QUOIN_KERNEL {
namespace {

typedef std::uint64_t Words __attribute__((vector_size(32)));
typedef std::uint64_t UnalignedWords __attribute__((vector_size(32), aligned(8)));

#define QUOIN_INLINE inline __attribute__((always_inline))

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

// Position of the lowest bit; 64 of an empty word.
QUOIN_INLINE std::uint32_t lowest_bit(std::uint64_t w) {
#if QUOIN_KERNEL_AVX2
  return static_cast<std::uint32_t>(_tzcnt_u64(w));
#else
  return w == 0 ? 64U : static_cast<std::uint32_t>(__builtin_ctzll(w));
#endif
}

// ---- Packed voxels to bit layers
// -------------------------------------------------------------------------------------

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
      const std::uint64_t* first = is_uniform ? s.patterns[slab] : voxels.row(entry, 0);
      const int step = is_uniform ? 0 : voxels.bits;
      for (int i = 0; i < 16; ++i) s.rows[(z + (i >> 2)) * 64 + y + (i & 3)] = first + i * step;
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

template <int kBits>
void compare_planes(const SlabRange& range, Scratch& s) {
  for (int z = range.z.begin; z < range.z.end; ++z) {
    for (int y = range.y.begin; y < range.y.end; y += 4) {
      Words along_x{};
      Words along_y{};
      Words along_z{};
      for (int k = 0; k < kBits; ++k) {
        const std::uint64_t* p = s.planes[k].words + word_index(z, y);
        const Words here = load(p);
        along_x |= here ^ (here >> 1);
        along_y |= here ^ load(p + 1);
        along_z |= here ^ load(p + kRowStride);
      }
      store(s.z.same_bit.words + word_index(z, y), ~along_x);
      store(s.z.same_row.words + word_index(z, y), ~along_y);
      store(s.same_z.words + word_index(z, y), ~along_z);
    }
  }
}

template <int kBits>
void read_planes(const Job& job, const Chunk::Mixed& voxels, const SlabRange& range, Scratch& s) {
  split_planes<kBits>(voxels, range, s);
  classify_planes<kBits>(job, range, s);
  compare_planes<kBits>(range, s);
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

// ---- Layouts
// ---------------------------------------------------------------------------------------------------------

// Rows [z][y] to rows [y][z]; words are moved whole.
void swap_planes_and_rows(const Layer& from, Layer& to, Range z_range, Range y_range) {
  for (int z = z_range.begin; z < z_range.end; z += 4) {
    for (int y = y_range.begin; y < y_range.end; y += 4) {
      Words in[4];
      for (int i = 0; i < 4; ++i) in[i] = load(from.words + word_index(z + i, y));
      const Words a = __builtin_shufflevector(in[0], in[1], 0, 4, 2, 6);
      const Words b = __builtin_shufflevector(in[0], in[1], 1, 5, 3, 7);
      const Words c = __builtin_shufflevector(in[2], in[3], 0, 4, 2, 6);
      const Words d = __builtin_shufflevector(in[2], in[3], 1, 5, 3, 7);
      store(to.words + word_index(y, z), __builtin_shufflevector(a, c, 0, 1, 4, 5));
      store(to.words + word_index(y + 1, z), __builtin_shufflevector(b, d, 0, 1, 4, 5));
      store(to.words + word_index(y + 2, z), __builtin_shufflevector(a, c, 2, 3, 6, 7));
      store(to.words + word_index(y + 3, z), __builtin_shufflevector(b, d, 2, 3, 6, 7));
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

// ---- One direction
// ---------------------------------------------------------------------------------------------------

struct Pass {
  const View* view;
  const std::uint64_t* row_masks;  // by row: the cells of the region
  Range planes;
  Range rows;
  int side;       // +1 or -1: where the faces look
  bool row_ends;  // some voxel before or after a row is opaque
};

// Visible faces of a batch of planes, and the list of groups of four rows that have any.
template <bool kTransparent>
QUOIN_INLINE int find_faces(const Pass& pass, int first_plane, int plane_count, Batch& b) {
  int groups = 0;
  for (int i = 0; i < plane_count; ++i) {
    const int plane = first_plane + i;
    const std::uint64_t* here = pass.view->opaque.words + word_index(plane, 0);
    const std::uint64_t* front = here + pass.side * kRowStride;
    const std::uint64_t* given = pass.view->faces[pass.side < 0].words + word_index(plane, 0);
    for (int row = pass.rows.begin; row < pass.rows.end; row += 4) {
      const Words mask = load(pass.row_masks + row);
      const Words faces = (kTransparent ? load(given + row) : load(here + row) & ~load(front + row)) & mask;
      const int at = i * 64 + row;
      store(b.faces + at, faces);
      store(b.mergeable + at, Words{});
      b.groups[groups] = static_cast<std::uint16_t>(at);
      groups += static_cast<int>(any(faces));
    }
    b.mergeable[i * 64 + pass.rows.end] = 0;
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
QUOIN_INLINE void find_runs(const Pass& pass, int first_plane, int groups, Batch& b) {
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const Words faces = load(b.faces + at);
    if constexpr (!kMerge) {
      store(b.starts + at, faces);
      store(b.ends + at, faces);
      continue;
    }
    const int here = word_index(first_plane + (at >> 6), at & 63);
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
QUOIN_INLINE void find_growth(const Pass& pass, int first_plane, int groups, Batch& b) {
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const int here = word_index(first_plane + (at >> 6), at & 63);
    const Words starts = load(b.starts + at);
    const Words ends = load(b.ends + at);
    const Words agree = load(b.mergeable + at) & load(b.mergeable + at + 1) & load(pass.view->same_row.words + here) &
                        ~(starts ^ load(b.starts + at + 1)) & ~(ends ^ load(b.ends + at + 1));
    // The sum carries from a run's first cell to its last only if all cells between agree.
    store(b.grows + at, ((agree & ~ends) + starts) & ends & agree);
  }
}

struct RunList {
  std::size_t runs;
  std::int64_t faces;
};

// Lists every run of the listed groups: row of the batch << 16 | last cell << 8 | first cell. Most rows hold at most
// two, which are written without asking how many there are.
QUOIN_INLINE RunList list_runs(int groups, Batch& b) {
  std::uint32_t* out = b.runs;
  std::int64_t faces = 0;
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    for (int row = at; row < at + 4; ++row) {
      std::uint64_t starts = b.starts[row];
      std::uint64_t ends = b.ends[row];
      const auto count = __builtin_popcountll(ends);
      faces += __builtin_popcountll(b.faces[row]);
      const std::uint32_t base = static_cast<std::uint32_t>(row) << 16;
      int written = 0;
      do {
        for (int k = 0; k < 2; ++k) {
          out[written + k] = base | lowest_bit(ends) << 8 | lowest_bit(starts);
          starts &= starts - 1;
          ends &= ends - 1;
        }
        written += 2;
      } while (__builtin_expect(written < count, 0));
      out += count;
    }
  }
  return {static_cast<std::size_t>(out - b.runs), faces};
}

// How a quad learns its type.
struct OneType {
  std::uint64_t bits;
  QUOIN_INLINE std::uint64_t at(unsigned, unsigned, unsigned) const { return bits; }
};

struct PaletteTypes {
  const std::uint64_t* const* rows;
  const VoxelType* palette;
  unsigned log_bits;
  unsigned mask;
  QUOIN_INLINE std::uint64_t at(unsigned x, unsigned y, unsigned z) const {
    const unsigned bit = x << log_bits;
    const std::uint64_t word = rows[z * 64 + y][bit >> 6];
    return static_cast<std::uint64_t>(palette[static_cast<std::uint32_t>(word >> (bit & 63U)) & mask])
           << Quad::kTypeShift;
  }
};

struct DirectTypes {
  const std::uint64_t* const* rows;
  QUOIN_INLINE std::uint64_t at(unsigned x, unsigned y, unsigned z) const {
    return (rows[z * 64 + y][x >> 2] >> (x << 4 & 63U) & 0xFFFFU) << Quad::kTypeShift;
  }
};

// The bits of the 9 voxels in front of a face, as the level tables index them.
QUOIN_INLINE std::uint64_t bits_in_front(const std::uint64_t* front, const std::uint64_t* before,
                                         const std::uint64_t* after, unsigned cell, bool row_ends) {
  if (__builtin_expect(cell - 1U < 62U, 1)) {
    const unsigned shift = cell - 1U;
    return (front[-1] >> shift & 7) + (front[0] >> shift & 7) * 8 + (front[1] >> shift & 7) * 64;
  }
  std::uint64_t bits = 0;
  for (int row = 1; row >= -1; --row) {
    const std::uint64_t outside = !row_ends ? 0 : cell == 0 ? before[row] & 1 : after[row] >> 63;
    bits = bits << 3 | (cell == 0 ? (front[row] << 1 | outside) & 7 : front[row] >> 62 | outside << 2);
  }
  return bits;
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
  // Coordinates in planes, rows and bits -> x, y, z.
  template <class Types>
  static QUOIN_INLINE std::uint64_t type(const Types& types, unsigned plane, unsigned row, unsigned cell) {
    return kAxis == 0   ? types.at(plane, row, cell)
           : kAxis == 1 ? types.at(cell, plane, row)
                        : types.at(cell, row, plane);
  }
};

// Turns the runs of a batch into quads. A run that ends here becomes one; one that grows only counts a row.
template <int kDirection, bool kOcclusion, class Types>
QUOIN_INLINE std::uint64_t* emit(const Pass& pass, int first_plane, std::size_t runs, const Types& types, Scratch& s,
                                 std::uint64_t* out) {
  using L = Layout<kDirection>;
  const Batch& b = s.batch;
  const std::uint16_t* levels = L::kUAlongBits ? level_tables().u_along_bits : level_tables().u_along_rows;
  const int front = word_index(first_plane + L::kFrame.sign, 0);
  const std::uint64_t* opaque = pass.view->opaque.words + front;
  const std::uint64_t* before = pass.view->before.words + front;
  const std::uint64_t* after = pass.view->after.words + front;
  const bool row_ends = pass.row_ends;
  for (std::size_t i = 0; i < runs; ++i) {
    const std::uint32_t run = b.runs[i];
    const unsigned first = run & 63U;
    const unsigned last = run >> 8 & 63U;
    const unsigned at = run >> 16;
    const std::uint64_t grows = b.grows[at] >> last & 1;
    const std::uint64_t height = s.heights[last];  // rows before this one
    s.heights[last] = static_cast<std::uint32_t>(height + 1) & (0U - static_cast<std::uint32_t>(grows));
    const unsigned plane_in_batch = at >> 6;
    const unsigned plane = static_cast<unsigned>(first_plane) + plane_in_batch;
    const unsigned row = at & 63U;
    std::uint64_t quad = std::uint64_t{kDirection} << Quad::kDirectionShift | std::uint64_t{plane} << (6 * L::kAxis) |
                         (row - height) << (6 * L::kRowAxis) | std::uint64_t{first} << (6 * L::kBitAxis) |
                         std::uint64_t{last - first} << L::kWidthShift | height << L::kHeightShift;
    if constexpr (kOcclusion) {
      const std::size_t word = plane_in_batch * kRowStride + row;
      const std::uint64_t around = bits_in_front(opaque + word, before + word, after + word, last, row_ends);
      quad |= std::uint64_t{levels[around]} << Quad::kLevelsShift;
    }
    *out = quad | L::type(types, plane, row, last);
    out += 1 - grows;
  }
  return out;
}

template <int kDirection, bool kOcclusion, class Types>
std::int64_t run_pass(const Job& job, const Pass& pass, const Types& types, Scratch& s, QuadBuffer& quads) {
  Batch& b = s.batch;
  std::int64_t faces = 0;
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
    const RunList list = list_runs(groups, b);
    faces += list.faces;
    std::uint64_t* begin = grow_quads(quads, s.quads, list.runs + 1);
    s.quads += static_cast<std::size_t>(emit<kDirection, kOcclusion>(pass, first, list.runs, types, s, begin) - begin);
  }
  return faces;
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

template <int kDirection, class Types>
std::int64_t run_direction(const Job& job, bool row_ends, const Types& types, Scratch& s, QuadBuffer& out) {
  const Pass pass = pass_for(static_cast<Direction>(kDirection), job, s, row_ends);
  return job.occlusion ? run_pass<kDirection, true>(job, pass, types, s, out)
                       : run_pass<kDirection, false>(job, pass, types, s, out);
}

template <class Types>
QuadStats run_directions(const Job& job, bool row_ends, const Types& types, Scratch& s, QuadBuffer& out) {
  QuadStats stats;
  stats.faces += run_direction<0>(job, row_ends, types, s, out);
  stats.faces += run_direction<1>(job, row_ends, types, s, out);
  stats.faces += run_direction<2>(job, row_ends, types, s, out);
  stats.faces += run_direction<3>(job, row_ends, types, s, out);
  stats.faces += run_direction<4>(job, row_ends, types, s, out);
  stats.faces += run_direction<5>(job, row_ends, types, s, out);
  return stats;
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

QuadStats mesh_chunk(const Job& job, Scratch& s, QuadBuffer& out) {
  const SlabRange range = slabs_around(job.region);
  fill_row_masks(job.region, s);
  fill_layers(job, range, s);
  end_at_border(range, s);
  const bool row_ends = gather_border(job, s);
  swap_planes_and_rows(s.z.opaque, s.y.opaque, range.z, range.y);
  swap_planes_and_rows(s.z.same_bit, s.y.same_bit, range.z, range.y);
  swap_planes_and_rows(s.same_z, s.y.same_row, range.z, range.y);
  turn_bits(s.z.opaque, s.x.opaque, {-4, 68});
  turn_bits(s.same_z, s.x.same_bit, range.y);
  turn_bits(s.z.same_row, s.x.same_row, range.y);
  copy_border(row_ends, s);
  if (row_ends) copy_row_ends(s);
  if (job.has_transparent) fill_faces(job, range, row_ends, s);
  const Chunk& centre = *job.chunks->centre();
  VoxelType type = kAir;
  if (has_one_type(centre, type)) {
    return run_directions(job, row_ends, OneType{std::uint64_t{type} << Quad::kTypeShift}, s, out);
  }
  const Chunk::Mixed& voxels = *centre.mixed();
  if (voxels.direct()) return run_directions(job, row_ends, DirectTypes{s.rows}, s, out);
  const auto bits = static_cast<unsigned>(voxels.bits);
  const auto log_bits = static_cast<unsigned>(__builtin_ctz(bits));
  return run_directions(job, row_ends, PaletteTypes{s.rows, voxels.palette.data(), log_bits, (1U << bits) - 1U}, s,
                        out);
}

#undef QUOIN_INLINE

}  // namespace
}  // namespace quoin::blocky::QUOIN_KERNEL

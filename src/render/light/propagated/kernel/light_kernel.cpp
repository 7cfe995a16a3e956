// The kernel of light_kernel.h, except for slabs as units (slab_units.inl).

#include <bit>
#include <cstring>
#include <utility>

#ifdef QUOIN_KERNEL_AVX2
#include <immintrin.h>
#endif

#include <quoin/core/assert.h>

#include "core/lanes/words.h"
#include "render/light/propagated/kernel/light_kernel.h"
#include "render/light/propagated/kernel/slab_units.inl"

namespace quoin::propagated {
namespace {

#if defined(QUOIN_KERNEL_AVX512)
constexpr std::size_t kWidth = 8;
#elif defined(QUOIN_KERNEL_AVX2)
constexpr std::size_t kWidth = 4;
#else
constexpr std::size_t kWidth = 2;
#endif
using Words = words::WordVector<kWidth>::Type;
using words::any;
using words::lanes_with_bits;
using words::store;

inline Words load(const std::uint64_t* from) {
  return words::load_as<Words>(from);
}

// Adds the voxels of this level to a block's bit planes. Overwrites the planes of a block that is not touched yet.
inline void add_to_planes(const LevelPass& step, std::size_t at, bool is_touched) {
  for (std::size_t plane = 0; plane < kPlanes; ++plane) {
    const bool has_bit = (step.level >> plane & 1U) != 0;
    if (is_touched && !has_bit) continue;
    std::uint64_t* to = step.planes[plane] + at;
    for (std::size_t i = 0; i < kBlockRows; i += kWidth) {
      const Words here = has_bit ? load(step.next + at + i) : Words{};
      store(to + i, is_touched ? here | load(to + i) : here);
    }
  }
}

inline void clear_block(std::uint64_t* to) {
  for (std::size_t i = 0; i < kBlockRows; i += kWidth) store(to + i, Words{});
}

// Writes the voxels that light reaches in a block to `next`. Returns true if there are any. Reads words next to the
// region: these are dark, or belong to the rim of another row, through which no light passes.
template <bool kIsWide, bool kHasSides>
inline bool reach_in_block(const LevelPass& step, std::size_t at, bool is_touched) {
  const std::uint64_t* dark = (is_touched ? step.rest : step.pass) + at;
  Words all{};
  for (std::size_t i = 0; i < kBlockRows; i += kWidth) {
    const std::uint64_t* here = step.front + at + i;
    const Words own = load(here);
    Words around;
    if constexpr (kHasSides) {
      const std::uint64_t* x = step.open_sides[0] + at + i;
      const std::uint64_t* y = step.open_sides[1] + at + i;
      const std::uint64_t* z = step.open_sides[2] + at + i;
      around = (own << 1 & load(x)) | (own & load(x)) >> 1;
      around |= (load(here - 1) & load(y)) | (load(here + 1) & load(y + 1));
      around |= (load(here - step.layer) & load(z)) | (load(here + step.layer) & load(z + step.layer));
      if constexpr (kIsWide) {
        around |= (load(here - step.column) >> 63 & load(x)) | (load(here + step.column) & load(x + step.column)) << 63;
      }
    } else {
      around = own << 1 | own >> 1 | load(here - 1) | load(here + 1);
      around |= load(here - step.layer) | load(here + step.layer);
      if constexpr (kIsWide) around |= load(here - step.column) >> 63 | load(here + step.column) << 63;
    }
    const Words fresh = around & load(dark + i);
    store(step.next + at + i, fresh);
    all |= fresh;
  }
  return any(all);
}

// Removes the reached voxels of a block from the dark ones, and adds them to the bit planes if the block is wanted.
// Returns true if any dark voxels remain.
inline bool light_block(const LevelPass& step, std::size_t at, bool is_touched, bool is_wanted) {
  const std::uint64_t* dark = (is_touched ? step.rest : step.pass) + at;
  Words all{};
  for (std::size_t i = 0; i < kBlockRows; i += kWidth) {
    const Words fresh = load(step.next + at + i);
    const Words left = load(dark + i) & ~fresh;
    store(step.rest + at + i, left);
    all |= left;
  }
  if (is_wanted) add_to_planes(step, at, is_touched);
  return any(all);
}

// Uses two loops, so that the first has no unpredictable branch.
template <bool kIsWide, bool kHasSides>
void spread_layers(const LevelPass& of) {
  const LevelPass step = of;  // so that no store is to one of its members
  for (std::size_t z = 0; z < step.layers; ++z) {
    const std::uint64_t touched = step.touched[z];
    const auto place = [&](std::uint64_t blocks) {
      return z * step.layer + kBlockRows * static_cast<std::size_t>(std::countr_zero(blocks));
    };
    std::uint64_t changed = 0;
    for (std::uint64_t active = step.active[z]; active != 0; active &= active - 1) {
      const std::uint64_t block = active & (~active + 1);
      const bool is_changed = reach_in_block<kIsWide, kHasSides>(step, place(active), (touched & block) != 0);
      changed |= is_changed ? block : 0;
    }
    for (std::uint64_t old = step.changed[z] & ~step.active[z]; old != 0; old &= old - 1) {
      clear_block(step.next + place(old));
    }
    const std::uint64_t wanted = z >= step.wanted_z && z < step.wanted_end_z ? step.wanted : 0;
    std::uint64_t full = 0;
    for (std::uint64_t reached = changed; reached != 0; reached &= reached - 1) {
      const std::uint64_t block = reached & (~reached + 1);
      const bool has_left = light_block(step, place(reached), (touched & block) != 0, (wanted & block) != 0);
      full |= has_left ? 0 : block;
    }
    step.open[z] &= ~full;
    step.touched[z] |= changed;
    step.changed[z] = changed;
  }
}

void spread(const LevelPass& step) {
  QUOIN_ASSERT(step.level > 0 && step.level < 15 && step.layers >= 2, "a level below the highest, and two rims");
  const bool is_wide = step.layer != step.column;
  if (step.open_sides[0] != nullptr) {
    is_wide ? spread_layers<true, true>(step) : spread_layers<false, true>(step);
  } else {
    is_wide ? spread_layers<true, false>(step) : spread_layers<false, false>(step);
  }
}

template <std::size_t kBy, std::size_t... kLanes>
inline Words lanes_from(Words words, Words above, std::index_sequence<kLanes...>) {
  return __builtin_shufflevector(words, above, (kLanes + kBy)...);
}

// Lanes move down by kBy; lanes of `above` enter.
template <std::size_t kBy>
inline Words lanes_down(Words words, Words above) {
  return lanes_from<kBy>(words, above, std::make_index_sequence<kWidth>());
}

// Lanes move up by one; 0 enters.
inline Words lanes_up(Words words) {
  return lanes_from<kWidth - 1>(Words{}, words, std::make_index_sequence<kWidth>());
}

// Spreads light to lower lanes where it can pass, including the light that enters from above.
inline Words fall(Words lit, Words pass, std::uint64_t from_above) {
  const Words none{};
  lit |= pass & lanes_down<1>(lit, none);
  pass &= lanes_down<1>(pass, ~none);
  if constexpr (kWidth > 2) {
    lit |= pass & lanes_down<2>(lit, none);
    pass &= lanes_down<2>(pass, ~none);
  }
  if constexpr (kWidth > 4) {
    lit |= pass & lanes_down<4>(lit, none);
    pass &= lanes_down<4>(pass, ~none);
  }
  return lit | (pass & (none + from_above));
}

inline bool is_wanted(const LevelPass& step, std::size_t z, std::uint64_t block) {
  return z >= step.wanted_z && z < step.wanted_end_z && (step.wanted & block) != 0;
}

inline void take_sky_of_block(const LevelPass& step, std::size_t z, std::size_t at, std::uint64_t block,
                              const Words* lit, const Words* dark) {
  const bool has_planes = is_wanted(step, z, block);
  for (std::size_t i = 0; i < kBlockRows / kWidth; ++i) {
    store(step.front + at + i * kWidth, lit[i]);
    store(step.rest + at + i * kWidth, dark[i]);
    for (std::size_t plane = 0; has_planes && plane < kPlanes; ++plane) {
      store(step.planes[plane] + at + i * kWidth, lit[i]);
    }
  }
}

inline bool has_bits(const std::uint64_t* words, std::size_t count) {
  Words all{};
  for (std::size_t i = 0; i < count; i += kWidth) all |= load(words + i);
  return any(all);
}

// Returns true if some wanted voxels stay dark in a layer with sky light.
template <bool kHasSides>
bool take_sky_of_layer(const LevelPass& step, std::size_t z) {
  QUOIN_ASSERT(step.layer / kBlockRows <= 64 && step.layer % step.column == 0, "at most 64 blocks, in whole columns");
  Words shade{};
  std::uint64_t from_above = 0;
  std::uint64_t lit_blocks = 0;
  std::uint64_t full_blocks = 0;
  for (std::size_t i = step.layer / kBlockRows; i-- > 0;) {
    const std::size_t at = z * step.layer + i * kBlockRows;
    const std::uint64_t block = std::uint64_t{1} << i;
    Words lit[kBlockRows / kWidth];
    Words dark[kBlockRows / kWidth];
    Words all_lit{};
    Words all_dark{};
    // The top row of a column belongs to the rim: no light falls from one column to another.
    for (std::size_t part = kBlockRows / kWidth; part-- > 0;) {
      const Words pass = load(step.pass + at + part * kWidth);
      Words enters = pass;
      if constexpr (kHasSides) enters &= load(step.open_sides[1] + at + part * kWidth + 1);
      lit[part] = fall(load(step.front + at + part * kWidth), enters, from_above);
      from_above = lit[part][0];
      dark[part] = pass & ~lit[part];
      all_lit |= lit[part];
      all_dark |= dark[part];
    }
    if (is_wanted(step, z, block)) shade |= all_dark & (Words{} + step.wanted_bits[i * kBlockRows / step.column]);
    if (!any(all_lit)) continue;
    take_sky_of_block(step, z, at, block, lit, dark);
    lit_blocks |= block;
    if (!any(all_dark)) full_blocks |= block;
  }
  step.changed[z] = lit_blocks;
  step.touched[z] |= lit_blocks;
  step.open[z] &= ~full_blocks;
  return any(shade);
}

template <bool kHasSides>
bool take_sky_of_layers(const LevelPass& of) {
  const LevelPass step = of;
  bool is_shady = false;
  for (std::size_t z = 0; z < step.layers; ++z) {
    if (has_bits(step.front + z * step.layer, step.layer)) {
      is_shady |= take_sky_of_layer<kHasSides>(step, z);
    } else {
      is_shady |= z >= step.wanted_z && z < step.wanted_end_z && (step.wanted & step.open[z]) != 0;
    }
  }
  return is_shady;
}

bool take_sky(const LevelPass& step) {
  return step.open_sides[1] != nullptr ? take_sky_of_layers<true>(step) : take_sky_of_layers<false>(step);
}

std::uint64_t find_blocks(const std::uint64_t* words, std::size_t count) {
  QUOIN_ASSERT(count <= 64, "a bit for each block");
  std::uint64_t blocks = 0;
  for (std::size_t block = 0; block < count; ++block) {
    Words all{};
    for (std::size_t i = 0; i < kBlockRows; i += kWidth) all |= load(words + block * kBlockRows + i);
    blocks |= std::uint64_t{any(all)} << block;
  }
  return blocks;
}

unsigned find_rows(const std::uint64_t* planes, std::size_t count, std::uint64_t mask) {
  unsigned rows = 0;
  for (std::size_t row = 0; row < kSlabWords; row += kWidth) {
    Words all{};
    for (std::size_t plane = 0; plane < count; ++plane) all |= load(planes + plane * kSlabWords + row);
    rows |= lanes_with_bits(all & (Words{} + mask)) << row;
  }
  return rows;
}

#if defined(QUOIN_KERNEL_AVX512)

void unpack(const std::uint64_t* planes, std::uint16_t* out) {
  __m512i bytes[2];
  for (int half = 0; half < 2; ++half) {
    bytes[half] = _mm512_setzero_si512();
    for (int i = 0; i < 8; ++i) {
      const auto bit = _mm512_set1_epi8(static_cast<char>(1U << i));
      bytes[half] = _mm512_mask_add_epi8(bytes[half], planes[8 * half + i], bytes[half], bit);
    }
  }
  const auto join = [](__m256i low, __m256i high) {
    return _mm512_or_si512(_mm512_cvtepu8_epi16(low), _mm512_slli_epi16(_mm512_cvtepu8_epi16(high), 8));
  };
  _mm512_storeu_si512(out, join(_mm512_castsi512_si256(bytes[0]), _mm512_castsi512_si256(bytes[1])));
  _mm512_storeu_si512(out + 32, join(_mm512_extracti64x4_epi64(bytes[0], 1), _mm512_extracti64x4_epi64(bytes[1], 1)));
}

#elif defined(QUOIN_KERNEL_AVX2)

// 16 words at a time: lane x gets bit i where its own bit of the plane is set.
void unpack(const std::uint64_t* planes, std::uint16_t* out) {
  const __m256i own = _mm256_setr_epi16(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, -32768);
  for (int quarter = 0; quarter < 4; ++quarter) {
    __m256i words = _mm256_setzero_si256();
    for (int i = 0; i < 16; ++i) {
      const __m256i all = _mm256_set1_epi16(static_cast<short>(planes[i] >> (16 * quarter)));
      const __m256i is_set = _mm256_cmpeq_epi16(_mm256_and_si256(all, own), own);
      words = _mm256_or_si256(words, _mm256_and_si256(is_set, _mm256_set1_epi16(static_cast<short>(1U << i))));
    }
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + 16 * quarter), words);
  }
}

#else

// Bit j of byte i becomes bit i of byte j.
inline std::uint64_t transpose_bytes(std::uint64_t w) {
  const auto swap = [&w](int distance, std::uint64_t mask) {
    const std::uint64_t other = (w ^ (w >> distance)) & mask;
    w ^= other ^ (other << distance);
  };
  swap(7, 0x00AA'00AA'00AA'00AAU);
  swap(14, 0x0000'CCCC'0000'CCCCU);
  swap(28, 0x0000'0000'F0F0'F0F0U);
  return w;
}

void unpack(const std::uint64_t* planes, std::uint16_t* out) {
  for (std::size_t first = 0; first < 64; first += 8) {
    std::uint64_t halves[2]{};
    for (std::size_t i = 0; i < 16; ++i) halves[i / 8] |= (planes[i] >> first & 255U) << (i % 8 * 8);
    for (std::uint64_t& half : halves) half = transpose_bytes(half);
    for (std::size_t i = 0; i < 8; ++i) {
      out[first + i] = static_cast<std::uint16_t>((halves[0] >> (8 * i) & 255U) | (halves[1] >> (8 * i) & 255U) << 8);
    }
  }
}

#endif

void shift_in(const std::uint64_t* from, std::size_t count, std::uint64_t mask, unsigned shift, std::uint64_t* low,
              std::uint64_t* high) {
  QUOIN_ASSERT(shift < 64, "a bit of a word");
  std::size_t i = 0;
  for (; i + kWidth <= count; i += kWidth) {
    const Words words = load(from + i) & (Words{} + mask);
    store(low + i, load(low + i) | words << shift);
    if (shift != 0) store(high + i, load(high + i) | words >> (64 - shift));
  }
  for (; i < count; ++i) {
    low[i] |= (from[i] & mask) << shift;
    if (shift != 0) high[i] |= (from[i] & mask) >> (64 - shift);
  }
}

void read_slab(const SlabRead& from, std::uint64_t* out) {
  QUOIN_ASSERT(from.shift < 64 && from.end <= 4, "a bit of a word, layers of the slab");
  using Rows __attribute__((vector_size(32))) = std::uint64_t;
  const auto rows_at = [](const std::uint64_t* at) {
    Rows rows;
    std::memcpy(&rows, at, sizeof rows);
    return rows;
  };
  for (std::size_t z = from.begin; z < from.end; ++z) {
    for (std::size_t plane = 0; plane < kPlanes; ++plane) {
      const std::uint64_t* here = from.planes[plane] + z * from.layer;
      const Rows rows = rows_at(here) >> from.shift | rows_at(here + from.column) << 1 << (63 - from.shift);
      std::memcpy(out + plane * kSlabWords + 4 * z, &rows, sizeof rows);
    }
  }
}

SlabKinds merge(const std::uint64_t* before, const std::uint64_t* inside, std::uint64_t* now, std::uint64_t* changed) {
  Words ones[kPlanes]{};
  Words zeros[kPlanes]{};
  Words all_changed{};
  for (std::size_t row = 0; row < kSlabWords; row += kWidth) {
    const Words here = load(inside + row);
    Words changed_here{};
    for (std::size_t plane = 0; plane < kPlanes; ++plane) {
      const std::size_t at = plane * kSlabWords + row;
      const Words old = load(before + at);
      const Words other = (old ^ load(now + at)) & here;
      const Words words = old ^ other;
      store(now + at, words);
      changed_here |= other;
      ones[plane] |= words;
      zeros[plane] |= ~words;
    }
    store(changed + row, changed_here);
    all_changed |= changed_here;
  }
  SlabKinds kinds;
  kinds.is_changed = any(all_changed);
  for (std::size_t plane = 0; kinds.is_changed && plane < kPlanes; ++plane) {
    kinds.has_ones |= static_cast<unsigned>(any(ones[plane])) << plane;
    kinds.has_zeros |= static_cast<unsigned>(any(zeros[plane])) << plane;
  }
  return kinds;
}

}  // namespace

constinit const Kernel QUOIN_KERNEL(Kernel) = {&spread,    &take_sky, &find_blocks, &find_rows,   &unpack,    &shift_in,
                                               &read_slab, &merge,    &pack_slab,   &unpack_slab, &unpack_row};

#ifndef QUOIN_KERNEL_AVX2
constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx512);
#endif

}  // namespace quoin::propagated

// The mesher's passes over a chunk.
//
//   voxels -> layers (z view) -> y and x views -> for each direction, eight planes at a time:
//   faces -> runs -> growth -> quads
//
// Rows of 64 voxels are words. A corner's occlusion is two bit planes, computed for 64 faces at once. Merging along a
// row and from row to row takes a few word operations (an addition carries "every cell agrees" to a run's end). The
// rest of the work is one flat loop over the quads, without unpredictable branches.

#include <array>
#include <tuple>
#include <utility>

#include <quoin/core/assert.h>

#ifdef QUOIN_KERNEL_AVX512
#include "mesh/blocky/emit_rows.inl"
#else
#include "mesh/blocky/emit_words.inl"
#endif
#include "mesh/blocky/layers.inl"
#include "mesh/blocky/runs.inl"

namespace quoin::blocky {
namespace {

// Removes the faces that ShapedVoxels::keys lists from a batch. Requires: batches are in the mesher's order.
void leave_out_faces(ShapedVoxels& shapes, int direction, int first_plane, int plane_count, Batch& b) {
  const std::uint32_t* const keys = shapes.keys.data();
  const std::uint32_t first = static_cast<std::uint32_t>(direction << 6 | first_plane) << 13;
  const std::uint32_t end = first + (static_cast<std::uint32_t>(plane_count) << 13);
  for (; shapes.next_key < shapes.keys.size() && keys[shapes.next_key] < end; ++shapes.next_key) {
    const std::uint32_t key = (keys[shapes.next_key] - first) >> 1;
    b.faces[(key >> 12) * kRowStride + (key >> 6 & 63)] &= ~(std::uint64_t{1} << (key & 63));
  }
}

template <int kDirection, bool kOcclusion>
void run_pass(const Job& job, const Pass& pass, const TypeSource& types, Scratch& s, QuadBuffer& quads) {
  Batch& b = s.batch;
  for (int first = pass.planes.begin; first < pass.planes.end; first += kBatchPlanes) {
    const int count = pass.planes.end - first < kBatchPlanes ? pass.planes.end - first : kBatchPlanes;
    const int groups =
        job.has_transparent ? find_faces<true>(pass, first, count, b) : find_faces<false>(pass, first, count, b);
    if (job.shapes != nullptr) leave_out_faces(*job.shapes, kDirection, first, count, b);
    if (groups == 0) continue;
    if (!job.merge) {
      keep_apart(groups, b);
    } else if (pass.one_type) {
      merge<kOcclusion, false>(pass, first, groups, b);
    } else {
      merge<kOcclusion, true>(pass, first, groups, b);
    }
    emit_batch<kDirection, kOcclusion>(pass, first, groups, types, s, quads);
  }
}

// Returns the mapping of a direction's axes to planes, rows and bits.
Pass pass_for(Direction direction, const Job& job, const Scratch& s, bool row_ends) {
  const FaceFrame& frame = frame_of(direction);
  constexpr int kRowAxis[3] = {1, 2, 1};
  const int row_axis = kRowAxis[frame.axis];
  Pass pass{};
  pass.view = frame.axis == 0 ? &s.x : frame.axis == 1 ? &s.y : &s.z;
  pass.row_masks = s.row_masks[frame.axis];
  pass.planes = {job.region.min[frame.axis], job.region.max[frame.axis]};
  pass.rows = {rounded_down(job.region.min[row_axis]), rounded_up(job.region.max[row_axis])};
  pass.side = frame.sign;
  pass.row_ends = row_ends;
  pass.one_type = job.one_type;
  return pass;
}

void fill_row_masks(const IBox& region, Scratch& s) {
  constexpr int kRowAxis[3] = {1, 2, 1};
  constexpr int kBitAxis[3] = {2, 0, 0};
  for (int axis = 0; axis < 3; ++axis) {
    const int first = region.min[kBitAxis[axis]];
    const int last = region.max[kBitAxis[axis]] - 1;
    QUOIN_ASSERT(first >= 0 && first <= last && last < 64, "a region that is not empty, inside the chunk");
    const std::uint64_t cells = (~std::uint64_t{0} << first) & (~std::uint64_t{0} >> (63 - last));
    for (int row = 0; row < 72; ++row) {
      const bool is_inside = row >= region.min[kRowAxis[axis]] && row < region.max[kRowAxis[axis]];
      s.row_masks[axis][row] = is_inside ? cells : 0;
    }
  }
}

// With transparent types, a face depends on both voxels' types. All six face layers are then computed in the z view's
// layout, and turned to the others'.
void turn_faces(const SlabRange& range, Scratch& s) {
  for (int i = 0; i < 2; ++i) {
    turn_bits(s.sides[i], s.x.faces[i], range.y);
    swap_planes_and_rows(s.sides[2 + i], s.y.faces[i], range.z, range.y);
  }
}

template <int kDirection>
void run_direction(const Job& job, bool row_ends, const TypeSource& types, Scratch& s, QuadBuffer& out) {
  const Pass pass = pass_for(static_cast<Direction>(kDirection), job, s, row_ends);
  if (job.occlusion) {
    run_pass<kDirection, true>(job, pass, types, s, out);
  } else {
    run_pass<kDirection, false>(job, pass, types, s, out);
  }
  if (job.shapes != nullptr) append_quads_next_to_shapes(job, static_cast<Direction>(kDirection), s, out);
}

// Returns true if all voxels of a chunk except air have one type, and sets `type`.
bool has_one_type(const Chunk& chunk, VoxelType& type) {
  const ChunkStorage* voxels = ChunkStorage::of(chunk);
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

// Returns the source of the quads' types.
TypeSource find_types(const Chunk& centre, Scratch& s) {
  VoxelType type = kAir;
  if (has_one_type(centre, type)) return {std::uint64_t{type} << Quad::kTypeShift, kOneType, 0};
  const ChunkStorage& voxels = *ChunkStorage::of(centre);
  QUOIN_ASSERT(voxels.palette.size() <= 256, "room for the palette");
  for (std::size_t i = 0; i < voxels.palette.size(); ++i) {
    s.palette[i] = std::uint64_t{voxels.palette[i]} << Quad::kTypeShift;
    if (i < 16) s.narrow_palette[i] = static_cast<std::uint32_t>(s.palette[i] >> 32);
  }
  return {0, __builtin_ctz(static_cast<unsigned>(voxels.bits)), index_planes(voxels)};
}

void run_directions(const Job& job, bool row_ends, const TypeSource& types, Scratch& s, QuadBuffer& out) {
  run_direction<0>(job, row_ends, types, s, out);
  run_direction<1>(job, row_ends, types, s, out);
  run_direction<2>(job, row_ends, types, s, out);
  run_direction<3>(job, row_ends, types, s, out);
  run_direction<4>(job, row_ends, types, s, out);
  run_direction<5>(job, row_ends, types, s, out);
}

// Returns the region without its solid floor: layers without a visible face, because every voxel in them and around
// them, and in the layers below and above, is opaque. This is common in the ground under terrain.
IBox above_solid_floor(const Job& job, bool row_ends, const Scratch& s) {
  IBox rest = job.region;
  const std::uint64_t before = rest.min.x == 0 ? std::uint64_t{1} << 63 : 0;  // as in a view's ends
  const std::uint64_t after = rest.max.x == 64 ? 1 : 0;
  if ((before | after) != 0 && !row_ends) return rest;
  const std::uint64_t first = rest.min.x > 0 ? rest.min.x - 1U : 0U;
  const std::uint64_t last = rest.max.x < 64 ? static_cast<unsigned>(rest.max.x) : 63U;
  const Words cells = Words{} + ((~std::uint64_t{0} << first) & (~std::uint64_t{0} >> (63 - last)));
  const Words ends = Words{} + (before | after);
  const int bottom = rest.min.y - 1;
  for (int rows = rounded_down(bottom); rows < rest.max.y; rows += kLanes) {
    Words open{};
    for (int z = rest.min.z - 1; z <= rest.max.z; ++z) {
      const int at = word_index(z, rows);
      open |= cells & ~load(s.z.opaque.words + at);
      if (row_ends) open |= ends & ~load(s.z.ends.words + at);
    }
    for (int i = 0; i < kLanes; ++i) {
      const int y = rows + i;
      if (y < bottom) continue;
      if (y < rest.max.y && open[i] == 0) continue;
      rest.min.y = std::max(rest.min.y, y - 1);
      return rest;
    }
  }
  rest.min.y = std::max(rest.min.y, rest.max.y - 1);
  return rest;
}

// Clears the `same` bits across the chunk's border.
void end_at_border(const SlabRange& range, Scratch& s) {
  for (int z = range.z.begin; z < range.z.end; ++z) {
    s.z.same_row.words[word_index(z, -1)] = s.z.same_row.words[word_index(z, 63)] = 0;
  }
  for (int y = range.y.begin; y < range.y.end; ++y) {
    s.same_z.words[word_index(-1, y)] = s.same_z.words[word_index(63, y)] = 0;
  }
}

// Finds the shaped voxels around the chunk, and in it if there are transparent cubes, too: with the passes that find
// opaque voxels.
void find_shapes_around(const Job& whole, Scratch& s) {
  Job job = whole;
  job.by = LayerClass::Shape;
  ShapedVoxels& shapes = *job.shapes;
  if (shapes.is_in_centre && shapes.has_transparent_cubes) {
    fill_layers(job, slabs_around(job.region), s);
    shapes.rows = s.z.opaque;
  }
  const bool has_ends = gather_border(job, shapes.rows, shapes.ends);
  if (!has_ends) __builtin_memset(shapes.ends.words, 0, sizeof(shapes.ends.words));
}

// Lists the rows with shaped voxels in and around the region, and clears the others' bits.
void list_rows_of_shapes(const Job& job, ShapedVoxels& shapes) {
  const IBox around{job.region.min - 1, job.region.max + 1};
  const int first = around.min.x > 0 ? around.min.x : 0;
  const int last = (around.max.x < kChunkEdge ? around.max.x : kChunkEdge) - 1;
  const std::uint64_t cells = (~std::uint64_t{0} << first) & (~std::uint64_t{0} >> (kChunkEdge - 1 - last));
  const std::uint64_t ends = std::uint64_t{around.min.x < 0} << 63 | std::uint64_t{around.max.x > kChunkEdge};
  shapes.listed_count = 0;
  const auto add = [&](int y, int z) {
    const int at = word_index(z, y);
    const std::uint64_t row = shapes.rows.words[at] &= cells;
    const std::uint64_t beyond = shapes.ends.words[at] &= ends;
    shapes.listed[shapes.listed_count] = ShapedVoxels::listed_row(y, z);
    shapes.listed_count += (row | beyond) != 0 ? 1 : 0;
  };
  for (int z = around.min.z; z < around.max.z; ++z) {
    for (int y = around.min.y; y < around.max.y;) {
      const int at = word_index(z, y);
      if (y >= 0 && y % kLanes == 0 && y + kLanes <= around.max.y && y < kChunkEdge) {
        const Words found = (load(shapes.rows.words + at) & cells) | (load(shapes.ends.words + at) & ends);
        if (!any(found)) {
          y += kLanes;
          continue;
        }
      }
      do add(y++, z);
      while (y < around.max.y && y % kLanes != 0);
    }
  }
}

// Lists all shaped voxels of the region and around it. Requires: the layers of the chunk are filled.
void list_all_shapes(const Job& job, bool row_ends, Scratch& s) {
  ShapedVoxels& shapes = *job.shapes;
  if (!shapes.is_in_centre || !shapes.has_transparent_cubes) {
    const Words mask = Words{} - std::uint64_t{shapes.is_in_centre};
    const SlabRange range = slabs_around(job.region);
    for (int z = range.z.begin; z < range.z.end; ++z) {
      for (int y = range.y.begin; y < range.y.end; y += kLanes) {
        const int at = word_index(z, y);
        store(shapes.rows.words + at, load(s.solid.words + at) & ~load(s.z.opaque.words + at) & mask);
      }
    }
  }
  list_rows_of_shapes(job, shapes);
  list_shapes(job, row_ends, s);
}

// Finds the visible faces of cubes: shaped voxels have none in these layers, and hide those that they cover.
void find_faces_of_cubes(const Job& job, bool row_ends, Scratch& s) {
  for (int z = job.region.min.z; z < job.region.max.z; ++z) {
    for (int y = rounded_down(job.region.min.y); y < job.region.max.y; y += kLanes) {
      const int at = word_index(z, y);
      store(s.solid.words + at, load(s.solid.words + at) & ~load(job.shapes->rows.words + at));
    }
  }
  find_faces_of_all_types(job, row_ends, s);
  hide_faces_behind_shapes(job, s);
}

void find_all_faces(const Job& job, Scratch& s) {
  if (job.shapes != nullptr) find_shapes_around(job, s);
  const SlabRange range = slabs_around(job.region);
  fill_layers(job, range, s);
  end_at_border(range, s);
  const bool row_ends = gather_border(job, s.z.opaque, s.z.ends);
  if (job.shapes != nullptr) {
    list_all_shapes(job, row_ends, s);
    return find_faces_of_cubes(job, row_ends, s);
  }
  find_faces_of_all_types(job, row_ends, s);
}

std::int64_t count_all_faces(const Job& job, Scratch& s) {
  find_all_faces(job, s);
  const std::uint64_t cells = (~std::uint64_t{0} >> (64 - (job.region.max.x - job.region.min.x))) << job.region.min.x;
  const Layer* const layers[] = {&s.sides[0], &s.sides[1], &s.sides[2], &s.sides[3], &s.z.faces[0], &s.z.faces[1]};
  std::int64_t count = 0;
  for (const Layer* layer : layers) {
    for (int z = job.region.min.z; z < job.region.max.z; ++z) {
      const std::uint64_t* row = layer->words + word_index(z, job.region.min.y);
      const std::uint64_t* const end = layer->words + word_index(z, job.region.max.y);
      for (; row != end; ++row) count += __builtin_popcountll(*row & cells);
    }
  }
  return count;
}

// Fills the layers of the other views.
void turn_views(const Job& job, bool row_ends, Scratch& s) {
  const SlabRange range = slabs_around(job.region);
  swap_planes_and_rows(s.z.opaque, s.y.opaque, range.z, range.y);
  turn_bits(s.z.opaque, s.x.opaque, range.y);
  turn_border<-1>(s.z.opaque, s.x.opaque);
  turn_border<64>(s.z.opaque, s.x.opaque);
  copy_border(row_ends, s);
  if (row_ends) copy_row_ends(s);
  if (!job.one_type) {
    swap_planes_and_rows(s.z.same_bit, s.y.same_bit, range.z, range.y);
    swap_planes_and_rows(s.same_z, s.y.same_row, range.z, range.y);
    turn_bits(s.same_z, s.x.same_bit, range.y);
    turn_bits(s.z.same_row, s.x.same_row, range.y);
  }
  if (!job.has_transparent) return;
  if (!job.has_faces) find_faces_of_all_types(job, row_ends, s);
  turn_faces(range, s);
}

// Finds the faces, then fills the layers of opaque voxels again with only those that occlude: the passes over
// directions use them only for occlusion if the faces are given. Returns the job with these layers, and `row_ends`.
// Cubes that are all opaque and occlude need no layers of faces, even with shapes.
std::pair<Job, bool> find_faces_first(Job job, bool row_ends, Scratch& s) {
  if (job.shapes != nullptr) find_covered_sides(job, row_ends, s);
  if (job.shapes != nullptr && !job.has_unoccluding && !job.shapes->has_transparent_cubes) {
    job.has_transparent = false;
    take_faces_next_to_shapes(job, row_ends, s);
    return {job, row_ends};
  }
  if (job.shapes != nullptr) {
    find_faces_of_cubes(job, row_ends, s);
  } else {
    find_faces_of_all_types(job, row_ends, s);
  }
  job.has_faces = true;
  if (job.has_unoccluding) {
    job.by = LayerClass::Occlusion;
    const SlabRange range = slabs_around(job.region);
    fill_layers(job, range, s);
    end_at_border(range, s);
    row_ends = gather_border(job, s.z.opaque, s.z.ends);
  }
  if (job.shapes != nullptr) take_faces_next_to_shapes(job, row_ends, s);
  return {job, row_ends};
}

void mesh_chunk(const Job& whole, Scratch& s, QuadBuffer& out) {
  Job job = whole;
  const TypeSource types = find_types(*job.chunks->centre(), s);
  job.one_type = types.log_bits == kOneType && !job.has_transparent;
  if (job.shapes != nullptr) find_shapes_around(job, s);
  const SlabRange range = slabs_around(job.region);
  fill_layers(job, range, s);
  if (!job.one_type) end_at_border(range, s);
  bool row_ends = gather_border(job, s.z.opaque, s.z.ends);
  if (job.shapes != nullptr) list_all_shapes(job, row_ends, s);
  job.region = above_solid_floor(job, row_ends, s);
  if (job.region.empty()) return;
  if (job.has_unoccluding || job.shapes != nullptr) std::tie(job, row_ends) = find_faces_first(job, row_ends, s);
  fill_row_masks(job.region, s);
  turn_views(job, row_ends, s);
  run_directions(job, row_ends, types, s, out);
}

// Writes 64 bytes: `value` for the set bits of a row, else 0.
QUOIN_INLINE void expand_row(std::uint64_t row, std::uint8_t value, std::uint8_t* out) {
#ifdef QUOIN_KERNEL_AVX512
  _mm512_storeu_si512(out, _mm512_maskz_set1_epi8(row, static_cast<char>(value)));
#elif defined(QUOIN_KERNEL_AVX2)
  const __m256i bytes = _mm256_set_epi64x(0x0303'0303'0303'0303, 0x0202'0202'0202'0202, 0x0101'0101'0101'0101, 0);
  const __m256i bits = _mm256_set1_epi64x(static_cast<long long>(0x8040'2010'0804'0201U));
  for (int half = 0; half < 2; ++half) {
    const __m256i word = _mm256_set1_epi32(static_cast<int>(row >> (32 * half)));
    const __m256i set = _mm256_cmpeq_epi8(_mm256_and_si256(_mm256_shuffle_epi8(word, bytes), bits), bits);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out) + half,
                        _mm256_and_si256(set, _mm256_set1_epi8(static_cast<char>(value))));
  }
#else
  for (int i = 0; i < 8; ++i) {
    // Copies the byte to eight, and keeps bit k in byte k.
    const std::uint64_t eight = (row >> 8 * i & 0xFF) * 0x0101'0101'0101'0101U & 0x8040'2010'0804'0201U;
    const std::uint64_t set = (eight + 0x7F7F'7F7F'7F7F'7F7FU) >> 7 & 0x0101'0101'0101'0101U;
    const std::uint64_t cells = set * value;
    __builtin_memcpy(out + 8 * i, &cells, 8);
  }
#endif
}

void fill_cells(const std::uint16_t* listed, std::size_t count, const Layer& rows, const Layer* ends,
                std::uint8_t value, std::uint8_t* cells) {
  for (std::size_t i = 0; i < count; ++i) {
    const int y = (listed[i] & 127) - 1;
    const int z = (listed[i] >> 7) - 1;
    const int at = word_index(z, y);
    std::uint8_t* const out = cells + ShapedVoxels::cell_at({0, y, z});
    expand_row(rows.words[at], value, out);
    const std::uint64_t beyond = ends == nullptr ? 0 : ends->words[at];
    out[-1] = (beyond >> 63) != 0 ? value : 0;
    out[kChunkEdge] = (beyond & 1) != 0 ? value : 0;
  }
}

// By four bits per kind of neighbour, bit i for corner i: eight bits of occlusion. Bits 0 to 3: the first sides, 4 to
// 7: the second ones, 8 to 11: the diagonals.
constexpr std::array<std::uint8_t, 4096> kOcclusionOfNeighbours = [] {
  std::array<std::uint8_t, 4096> made{};
  for (unsigned bits = 0; bits < made.size(); ++bits) {
    for (unsigned i = 0; i < 4; ++i) {
      const unsigned a = bits >> i & 1;
      const unsigned b = bits >> (4 + i) & 1;
      const unsigned c = bits >> (8 + i) & 1;
      made[bits] = static_cast<std::uint8_t>(made[bits] | (a + b + (c | (a & b))) << 2 * i);
    }
  }
  return made;
}();

// Copies the bytes of a voxel and its 26 neighbours, x first, then y, then z.
QUOIN_INLINE void gather_around(const std::uint8_t* cell, std::uint8_t* around) {
  constexpr int kPlane = ShapedVoxels::kEdge * ShapedVoxels::kCellStride;
  for (int row = 0; row < 9; ++row) {
    // Writes one byte more, which the next row replaces.
    __builtin_memcpy(around + 3 * row, cell + (row / 3 - 1) * kPlane + (row % 3 - 1) * ShapedVoxels::kCellStride - 1,
                     4);
  }
}

// Returns the eight bits of occlusion of a face from the bytes around its voxel.
QUOIN_INLINE unsigned occlusion_of(const PackedFace& face, const std::uint8_t* around) {
  unsigned filled = 0;
#ifdef QUOIN_KERNEL_AVX2
  const auto* const words = reinterpret_cast<const __m128i*>(around);
  const __m128i voxels = _mm_load_si128(reinterpret_cast<const __m128i*>(face.voxels.data()));
  const __m128i bits = _mm_load_si128(reinterpret_cast<const __m128i*>(face.eighths.data()));
  // A shuffle gives 0 for numbers with bit 7: those above 15 in the lower half, those below 16 in the upper one.
  const __m128i lower = _mm_shuffle_epi8(_mm_load_si128(words), _mm_adds_epu8(voxels, _mm_set1_epi8(0x70)));
  const __m128i upper = _mm_shuffle_epi8(_mm_load_si128(words + 1), _mm_sub_epi8(voxels, _mm_set1_epi8(16)));
  const __m128i open = _mm_cmpeq_epi8(_mm_and_si128(_mm_or_si128(lower, upper), bits), _mm_setzero_si128());
  filled = ~static_cast<unsigned>(_mm_movemask_epi8(open)) & 0xFFF;
#else
  for (unsigned k = 0; k < 12; ++k) {
    const unsigned byte = around[face.voxels[k]] & face.eighths[k];
    filled |= (byte != 0 ? 1U : 0U) << k;
  }
#endif
  return kOcclusionOfNeighbours[filled];
}

void find_occlusion(const std::uint8_t* eighths, const CornerQuery* queries, std::size_t count, std::uint8_t* answers) {
  alignas(32) std::uint8_t around[32] = {};
  std::uint32_t last = ~std::uint32_t{0};
  for (std::size_t i = 0; i < count; ++i) {
    const CornerQuery query = queries[i];
    if (query.cell != last) gather_around(eighths + query.cell, around);
    last = query.cell;
    answers[i] = static_cast<std::uint8_t>(occlusion_of(*query.face, around));
  }
}

QUOIN_INLINE bool covers_all(const SideMask& squares, const SideMask& mask) {
  std::uint64_t open = 0;
  for (std::size_t i = 0; i < 4; ++i) open |= mask[i] & ~squares[i];
  return open == 0;
}

// Writes the visible faces of a shaped voxel, or of the fluid next to its shape. `shown`: the voxel or the fluid.
template <bool kOcclusion>
QUOIN_INLINE ShapeFace* write_faces(const Job& job, const ShapedVoxel& voxel, const ShapedVoxel& shown,
                                    ShapeFace* out) {
  constexpr int kPlane = ShapedVoxels::kEdge * ShapedVoxels::kCellStride;
  constexpr int kSteps[6] = {1, -1, ShapedVoxels::kCellStride, -ShapedVoxels::kCellStride, kPlane, -kPlane};
  const std::size_t cell = ShapedVoxels::cell_at(voxel.local);
  const std::uint8_t* const sides = job.shapes->sides.data() + cell;
  unsigned hidden = 1U << PackedFace::kNeverSeen;
  if (&shown != &voxel) hidden |= sides[0] & ShapedVoxels::kWhole;  // a fluid behind the sides of the shape
  unsigned asked = 0;
  for (unsigned d = 0; d < 6; ++d) {
    const unsigned side = sides[kSteps[d]];
    hidden |= (side >> (d ^ 1U) & 1U) << d;
    asked |= side / ShapedVoxels::kPartly << d;
  }
  const SideMask* masks[6] = {};
  if ((asked &= ~hidden) != 0) asked = find_covered_squares(job, voxel, shown, asked, masks);
  alignas(32) std::uint8_t around[32] = {};
  if constexpr (kOcclusion) gather_around(job.shapes->eighths.data() + cell, around);
  const ShapeModel& model = *shown.model;
  const auto place = static_cast<std::uint32_t>(voxel.local.x | voxel.local.y << 6 | voxel.local.z << 12);
  const PackedFace* const faces = model.packed_faces.data();
  const std::size_t count = model.packed_faces.size();
  for (std::size_t i = 0; i < count; ++i) {
    const PackedFace& face = faces[i];
    std::uint32_t bits = place;
    if constexpr (kOcclusion) bits |= occlusion_of(face, around) << ShapeFace::kOcclusionShift;
    out->model = &model;
    out->bits = bits;
    out->face = static_cast<std::uint16_t>(i);
    out->type = shown.type;
    bool is_seen = (hidden >> face.side & 1U) == 0;
    if ((asked >> face.side & 1U) != 0) is_seen = !covers_all(*masks[face.side], model.faces[i].mask);
    out += is_seen ? 1 : 0;
  }
  return out;
}

ShapeFace* write_shape_faces(const Job& job, ShapeFace* out) {
  const ShapedVoxel* const voxels = job.shapes->voxels.data();
  const auto write = [&](const ShapedVoxel& voxel, const ShapedVoxel& shown) {
    out = job.occlusion ? write_faces<true>(job, voxel, shown, out) : write_faces<false>(job, voxel, shown, out);
  };
  for (const ShapedVoxel* voxel = voxels; voxel != voxels + job.shapes->voxels.size(); ++voxel) {
    if (job.region.contains(voxel->local)) write(*voxel, *voxel);
  }
  for (const InnerShape& inner : job.shapes->inner) write(voxels[inner.holder], inner.shown);
  return out;
}

}  // namespace

constinit const Kernel QUOIN_KERNEL(Kernel) = {&mesh_chunk, &find_all_faces,    &count_all_faces,
                                               &fill_cells, &write_shape_faces, &find_occlusion};

#ifndef QUOIN_KERNEL_AVX2
constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx2);
#endif

}  // namespace quoin::blocky

// The mesher's passes over a chunk.
//
//   voxels -> layers (z view) -> y and x views -> for each direction, eight planes at a time:
//   faces -> runs -> growth -> quads
//
// Rows of 64 voxels are words. A corner's occlusion is two bit planes, computed for 64 faces at once. Merging along a
// row and from row to row takes a few word operations (an addition carries "every cell agrees" to a run's end). The
// rest of the work is one flat loop over the quads, without unpredictable branches.

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

template <int kDirection, bool kOcclusion>
void run_pass(const Job& job, const Pass& pass, const TypeSource& types, Scratch& s, QuadBuffer& quads) {
  Batch& b = s.batch;
  for (int first = pass.planes.begin; first < pass.planes.end; first += kBatchPlanes) {
    const int count = pass.planes.end - first < kBatchPlanes ? pass.planes.end - first : kBatchPlanes;
    const int groups =
        job.has_transparent ? find_faces<true>(pass, first, count, b) : find_faces<false>(pass, first, count, b);
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
  if (shapes.is_in_centre && shapes.has_transparent_cubes) fill_layers(job, slabs_around(job.region), s);
  const bool has_ends = gather_border(job, s);
  shapes.rows = s.z.opaque;
  if (has_ends) {
    shapes.ends = s.z.ends;
  } else {
    __builtin_memset(shapes.ends.words, 0, sizeof(shapes.ends.words));
  }
}

// Lists all shaped voxels of the region and around it. Requires: the layers of the chunk are filled.
void list_all_shapes(const Job& job, Scratch& s) {
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
  list_shapes(job);
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
  if (job.shapes != nullptr) list_all_shapes(job, s);
  const bool row_ends = gather_border(job, s);
  if (job.shapes != nullptr) return find_faces_of_cubes(job, row_ends, s);
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
std::pair<Job, bool> find_faces_first(Job job, bool row_ends, Scratch& s) {
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
    row_ends = gather_border(job, s);
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
  if (job.shapes != nullptr) list_all_shapes(job, s);
  bool row_ends = gather_border(job, s);
  job.region = above_solid_floor(job, row_ends, s);
  if (job.region.empty()) return;
  if (job.has_unoccluding || job.shapes != nullptr) std::tie(job, row_ends) = find_faces_first(job, row_ends, s);
  fill_row_masks(job.region, s);
  turn_views(job, row_ends, s);
  run_directions(job, row_ends, types, s, out);
}

}  // namespace

constinit const Kernel QUOIN_KERNEL(Kernel) = {&mesh_chunk, &find_all_faces, &count_all_faces};

#ifndef QUOIN_KERNEL_AVX2
constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx2);
#endif

}  // namespace quoin::blocky

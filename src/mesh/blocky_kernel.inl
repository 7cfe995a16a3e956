// The mesher's inner passes, compiled once for each instruction set: the including file defines QUOIN_KERNEL (a
// namespace), QUOIN_KERNEL_AVX2 and QUOIN_KERNEL_AVX512 (0 or 1), and switches the compiler's target.
//
// Design: rows of 64 voxels are words. A corner's level is two bit planes, computed for 64 faces at once; merging along
// a row and from row to row is a handful of word operations (an addition carries "every cell agrees" to a run's end).
// What is left a quad is one flat loop without unpredictable branches.

namespace quoin::blocky::QUOIN_KERNEL {
namespace {

// Whether types are fetched from packed rows, however narrow these are.
inline constexpr bool kTypesFromRows = !QUOIN_KERNEL_AVX512;

#include "mesh/blocky_words.inl"

#include "mesh/blocky_layers.inl"

#include "mesh/blocky_turn.inl"

#include "mesh/blocky_runs.inl"

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

#if QUOIN_KERNEL_AVX512
#include "mesh/blocky_emit_rows.inl"
#else
#include "mesh/blocky_emit.inl"
#endif

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
    emit_batch<kDirection, kOcclusion>(pass, first, groups, types, s, quads);
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
  pass.rows = {rounded_down(job.region.min[row_axis]), rounded_up(job.region.max[row_axis])};
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
      if (i < 16) s.narrow_palette[i] = static_cast<std::uint32_t>(s.palette[i] >> 32);
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
      const std::uint64_t ends = row_ends ? s.z.ends.words[at] : 0;
      const bool before = region.min.x > 0 || ends >> 63 != 0;
      const bool after = region.max.x < 64 || (ends & 1) != 0;
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
  turn_bits(s.z.opaque, s.x.opaque, range.y);
  turn_border<-1>(s.z.opaque, s.x.opaque);
  turn_border<64>(s.z.opaque, s.x.opaque);
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

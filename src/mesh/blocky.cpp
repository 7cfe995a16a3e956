#include <quoin/mesh/blocky.h>

#include <algorithm>
#include <array>

#include "mesh/blocky_scratch.h"

namespace quoin {
namespace blocky {
namespace {

constexpr std::uint64_t kAllCells = ~std::uint64_t{0};

LevelTables make_level_tables() {
  LevelTables tables{};
  for (unsigned around = 0; around < 512; ++around) {
    const auto bit = [&](unsigned i) { return (around >> i & 1U) != 0; };
    // By (bit, row): the sides are the neighbours along each, the corner the one across.
    const std::uint8_t l00 = vertex_occlusion(bit(3), bit(1), bit(0));
    const std::uint8_t l10 = vertex_occlusion(bit(5), bit(1), bit(2));
    const std::uint8_t l01 = vertex_occlusion(bit(3), bit(7), bit(6));
    const std::uint8_t l11 = vertex_occlusion(bit(5), bit(7), bit(8));
    const auto pack = [](const FaceLevels& levels) {
      const int packed = levels[0] | levels[1] << 2 | levels[2] << 4 | levels[3] << 6;
      return static_cast<std::uint64_t>(packed) << Quad::kLevelsShift | std::uint64_t{flips_diagonal(levels)}
                                                                            << Quad::kFlipShift;
    };
    tables.u_along_bits[around] = pack({l00, l10, l11, l01});
    tables.u_along_rows[around] = pack({l00, l01, l11, l10});
  }
  for (unsigned bits = 0; bits < 256; ++bits) {
    const auto level = [&](unsigned corner) { return static_cast<std::uint8_t>(bits >> (2 * corner) & 3U); };
    const bool flips = flips_diagonal({level(0), level(1), level(2), level(3)});
    tables.flips[bits / 32] |= std::uint32_t{flips} << (bits + 6) % 32;
  }
  for (std::uint32_t at = 0; at < kBatchWords; ++at) {
    tables.numbers[at] = (at / kRowStride * 64 + at % kRowStride % 64) * 0x0001'0001U;
  }
  constexpr int kRowAxis[3] = {1, 2, 1};
  for (int axis = 0; axis < 3; ++axis) {
    for (std::uint64_t at = 0; at < kBatchWords; ++at) {
      tables.places[axis][at] = at / kRowStride << (6 * axis) | (at % kRowStride & 63) << (6 * kRowAxis[axis]);
    }
  }
  return tables;
}

// Which of a chunk's voxels are opaque, a row or a single voxel at a time.
class OpaqueVoxels {
 public:
  OpaqueVoxels(const Chunk* chunk, const VoxelRegistry& types) : chunk_(chunk), types_(&types) {
    if (chunk == nullptr || chunk->mixed() == nullptr || chunk->mixed()->direct()) return;
    const Chunk::Mixed& voxels = *chunk->mixed();
    for (std::size_t i = 0; i < voxels.palette.size(); ++i) is_opaque_[i] = types.is_opaque(voxels.palette[i]);
  }

  [[nodiscard]] bool none() const {
    if (chunk_ == nullptr) return true;
    const auto uniform = chunk_->uniform();
    return uniform.has_value() && !types_->is_opaque(*uniform);
  }

  [[nodiscard]] std::uint64_t row(int y, int z) const {
    if (none()) return 0;
    if (chunk_->mixed() == nullptr) return kAllCells;
    std::uint64_t mask = 0;
    if (chunk_->mixed()->direct()) {
      for (int x = 0; x < kChunkEdge; ++x) mask |= std::uint64_t{types_->is_opaque(chunk_->get(x, y, z))} << x;
      return mask;
    }
    const Chunk::Mixed& voxels = *chunk_->mixed();
    for (std::size_t i = 0; i < voxels.palette.size(); ++i) {
      if (is_opaque_[i] && voxels.counts[i] != 0) mask |= chunk_->row_mask(y, z, voxels.palette[i]);
    }
    return mask;
  }

  [[nodiscard]] std::uint64_t at(int x, int y, int z) const {
    if (none()) return 0;
    const Chunk::Mixed* voxels = chunk_->mixed();
    if (voxels == nullptr) return 1;
    if (voxels->direct()) return types_->is_opaque(chunk_->get(x, y, z));
    const std::uint32_t slab = voxels->slabs[Chunk::slab_index(y, z)];
    const std::uint32_t index = (slab & Chunk::kUniformSlab) != 0 ? slab & ~Chunk::kUniformSlab
                                                                  : voxels->read(slab, Chunk::row_in_slab(y, z), x);
    return is_opaque_[index];
  }

 private:
  const Chunk* chunk_;
  const VoxelRegistry* types_;
  std::array<bool, 256> is_opaque_{};
};

}  // namespace

std::uint64_t* grow_quads(QuadBuffer& out, std::size_t used, std::size_t more) {
  if (out.size() < used + more) out.resize(std::max(used + more, out.capacity()));
  static_assert(sizeof(Quad) == sizeof(std::uint64_t));
  return &out[used].bits;
}

namespace {

constexpr int chunk_offset(int voxel) {
  return voxel < 0 ? -1 : voxel > 63 ? 1 : 0;
}

// Rows of the 8 neighbours with the centre's x. Answers whether a voxel of those with another z may be opaque.
bool gather_rows(const Job& job, Scratch& s) {
  const auto first = [](int d) { return d > 0 ? 64 : d; };
  const auto last = [](int d) { return d < 0 ? -1 : d > 0 ? 64 : 63; };
  bool other_z = false;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      if (dy == 0 && dz == 0) continue;
      const OpaqueVoxels voxels(job.chunks->at(0, dy, dz), *job.types);
      other_z |= dz != 0 && !voxels.none();
      for (int z = first(dz); z <= last(dz); ++z) {
        for (int y = first(dy); y <= last(dy); ++y) {
          s.z.opaque.words[word_index(z, y)] = voxels.row(y & 63, z & 63);
        }
      }
    }
  }
  return other_z;
}

// Whether a voxel of the 18 neighbours with another x may be opaque.
bool has_row_ends(const Job& job) {
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (const int dx : {-1, 1}) {
        if (!OpaqueVoxels(job.chunks->at(dx, dy, dz), *job.types).none()) return true;
      }
    }
  }
  return false;
}

void gather_row_ends(const Job& job, Scratch& s) {
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      const OpaqueVoxels before(job.chunks->at(-1, dy, dz), *job.types);
      const OpaqueVoxels after(job.chunks->at(1, dy, dz), *job.types);
      for (int z = -1; z <= 64; ++z) {
        if (chunk_offset(z) != dz) continue;
        for (int y = -1; y <= 64; ++y) {
          if (chunk_offset(y) != dy) continue;
          s.z.ends.words[word_index(z, y)] = before.at(63, y & 63, z & 63) << 63 | after.at(0, y & 63, z & 63);
        }
      }
    }
  }
}

}  // namespace

bool gather_border(const Job& job, Scratch& s) {
  // The x view's rows lie along z, so what stands before and after those are voxels of the neighbours in z.
  const bool other_z = gather_rows(job, s);
  if (!other_z && !has_row_ends(job)) return false;
  gather_row_ends(job, s);
  return true;
}

namespace {

// The voxels of a row that are transparent and of the same type as the voxels of another row.
std::uint64_t same_transparent(const Job& job, const Chunk* other, int y, int z, int other_y, int other_z) {
  if (other == nullptr || !job.has_transparent) return 0;
  std::array<VoxelType, kChunkEdge> row{};
  std::array<VoxelType, kChunkEdge> other_row{};
  job.chunks->centre()->read_row(y, z, row);
  other->read_row(other_y, other_z, other_row);
  std::uint64_t mask = 0;
  for (std::size_t x = 0; x < kChunkEdge; ++x) {
    mask |= std::uint64_t{row[x] == other_row[x] && job.types->is_transparent(row[x])} << x;
  }
  return mask;
}

bool same_transparent_voxel(const Job& job, const Chunk* other, IVec3 here, IVec3 there) {
  if (!job.has_transparent) return false;
  const VoxelType type = job.chunks->centre()->get(here);
  return other != nullptr && job.types->is_transparent(type) && other->get(there) == type;
}

}  // namespace

void find_faces_of_all_types(const Job& job, bool row_ends, Scratch& s) {
  const Neighbourhood& n = *job.chunks;
  const Layer& opaque = s.z.opaque;
  for (int z = job.region.min.z; z < job.region.max.z; ++z) {
    for (int y = job.region.min.y; y < job.region.max.y; ++y) {
      const int at = word_index(z, y);
      const std::uint64_t solid = job.has_transparent ? s.solid.words[at] : opaque.words[at];
      const std::uint64_t transparent = solid & ~opaque.words[at];
      // A face is hidden by an opaque voxel, and by a transparent one of its own type.
      const auto visible = [&](std::uint64_t opaque_front, std::uint64_t same) {
        return solid & ~opaque_front & ~(transparent & same);
      };
      const std::uint64_t same_x = s.z.same_bit.words[at];
      const auto end = [&](int dx, int x) {
        return std::uint64_t{same_transparent_voxel(job, n.at(dx, 0, 0), {x, y, z}, {63 - x, y, z})} << x;
      };
      const std::uint64_t ends = row_ends ? s.z.ends.words[at] : 0;
      const std::uint64_t after = ends << 63;
      const std::uint64_t before = ends >> 63;
      s.sides[0].words[at] = visible(opaque.words[at] >> 1 | after, (same_x & kAllCells >> 1) | end(1, 63));
      s.sides[1].words[at] = visible(opaque.words[at] << 1 | before, same_x << 1 | end(-1, 0));
      s.sides[2].words[at] = visible(
          opaque.words[at + 1], y < 63 ? s.z.same_row.words[at] : same_transparent(job, n.at(0, 1, 0), y, z, 0, z));
      s.sides[3].words[at] = visible(opaque.words[at - 1], y > 0 ? s.z.same_row.words[at - 1]
                                                                 : same_transparent(job, n.at(0, -1, 0), y, z, 63, z));
      s.z.faces[0].words[at] = visible(opaque.words[at + kRowStride],
                                       z < 63 ? s.same_z.words[at] : same_transparent(job, n.at(0, 0, 1), y, z, y, 0));
      s.z.faces[1].words[at] =
          visible(opaque.words[at - kRowStride],
                  z > 0 ? s.same_z.words[at - kRowStride] : same_transparent(job, n.at(0, 0, -1), y, z, y, 63));
    }
  }
}

}  // namespace blocky

namespace {

// A chunk of one type whose six neighbours hide all of it: no voxel need be looked at.
bool is_buried(const Neighbourhood& chunks, const VoxelRegistry& types) {
  const auto type = chunks.centre()->uniform();
  if (!type.has_value()) return false;
  return std::all_of(kDirections.begin(), kDirections.end(), [&](Direction d) {
    const IVec3 n = normal_of(d);
    const Chunk* neighbour = chunks.at(n.x, n.y, n.z);
    if (neighbour == nullptr) return false;
    const auto other = neighbour->uniform();
    return other.has_value() && !face_is_visible(types, *type, *other);
  });
}

bool holds_transparent(const Chunk& chunk, const VoxelRegistry& types) {
  if (!types.has_transparent()) return false;
  const Chunk::Mixed* voxels = chunk.mixed();
  if (voxels == nullptr) return types.is_transparent(*chunk.uniform());
  if (voxels->direct()) return true;
  for (std::size_t i = 0; i < voxels->palette.size(); ++i) {
    if (voxels->counts[i] != 0 && types.is_transparent(voxels->palette[i])) return true;
  }
  return false;
}

struct Kernel {
  void (*mesh)(const blocky::Job&, blocky::Scratch&, QuadBuffer&);
  void (*find_faces)(const blocky::Job&, blocky::Scratch&);
};

Kernel pick_kernel(InstructionSet wanted) {
#ifdef QUOIN_X86_KERNELS
  const InstructionSet found = resolve(wanted);
  if (found == InstructionSet::Avx512 && __builtin_cpu_supports("avx512vbmi") &&
      __builtin_cpu_supports("avx512vbmi2") && __builtin_cpu_supports("avx512vpopcntdq") &&
      __builtin_cpu_supports("gfni")) {
    return {blocky::mesh_avx512, blocky::find_faces_avx512};
  }
  if (found != InstructionSet::Plain) return {blocky::mesh_avx2, blocky::find_faces_avx2};
#endif
  static_cast<void>(wanted);
  return {blocky::mesh_plain, blocky::find_faces_plain};
}

}  // namespace

struct BlockyMesher::Scratch : blocky::Scratch {
  Kernel kernel{};
};

BlockyMesher::BlockyMesher(InstructionSet instructions) : scratch_(new Scratch()) {
  scratch_->levels = blocky::make_level_tables();
  scratch_->kernel = pick_kernel(instructions);
}
BlockyMesher::BlockyMesher(BlockyMesher&&) noexcept = default;
BlockyMesher& BlockyMesher::operator=(BlockyMesher&&) noexcept = default;
BlockyMesher::~BlockyMesher() = default;

void BlockyMesher::mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options,
                        QuadBuffer& out) {
  scratch_->quads = 0;
  const Chunk* centre = chunks.centre();
  if (centre != nullptr && !is_buried(chunks, types)) {
    const IBox region = intersect(intersect(options.region, kWholeChunk), centre->bounds());
    if (!region.empty()) {
      const bool transparent = holds_transparent(*centre, types);
      scratch_->kernel.mesh({&chunks, &types, region, options.merge, options.occlusion, transparent, false}, *scratch_,
                            out);
    }
  }
  out.resize(scratch_->quads);
}

std::int64_t face_count(const QuadBuffer& quads) {
  std::int64_t faces = 0;
  for (const Quad& quad : quads) faces += std::int64_t{quad.size_u()} * quad.size_v();
  return faces;
}

void BlockyMesher::find_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& wanted,
                              FaceRows& out) {
  for (auto& rows : out.rows) rows.assign(std::size_t{kChunkEdge} * kChunkEdge, 0);
  const Chunk* centre = chunks.centre();
  if (centre == nullptr || is_buried(chunks, types)) return;
  const IBox region = intersect(intersect(wanted, kWholeChunk), centre->bounds());
  if (region.empty()) return;
  blocky::Scratch& s = *scratch_;
  scratch_->kernel.find_faces({&chunks, &types, region, false, false, holds_transparent(*centre, types), false}, s);
  const std::array<const blocky::Layer*, 6> layers = {&s.sides[0], &s.sides[1],   &s.sides[2],
                                                      &s.sides[3], &s.z.faces[0], &s.z.faces[1]};
  const int width = region.max.x - region.min.x;
  const std::uint64_t cells = (~std::uint64_t{0} >> (kChunkEdge - width)) << region.min.x;
  for (std::size_t d = 0; d < layers.size(); ++d) {
    for (int z = region.min.z; z < region.max.z; ++z) {
      for (int y = region.min.y; y < region.max.y; ++y) {
        out.rows[d][static_cast<std::size_t>(z * kChunkEdge + y)] = layers[d]->words[blocky::word_index(z, y)] & cells;
      }
    }
  }
}

}  // namespace quoin

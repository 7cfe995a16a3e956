#include <quoin/mesh/blocky.h>

#include <algorithm>
#include <array>
#include <bit>
#include <bitset>
#include <cstring>
#include <map>
#include <memory>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/core/thousands.h>
#include <quoin/mesh/occlusion.h>
#include <quoin/mesh/visible_faces.h>

#include "core/moved_from.h"
#include "grid/chunk/chunk_storage.h"
#include "mesh/blocky/blocky_mesher.h"

namespace quoin {
namespace blocky {
namespace {

OcclusionTables make_occlusion_tables() {
  OcclusionTables tables{};
  for (unsigned around = 0; around < 512; ++around) {
    const auto bit = [&](unsigned i) { return (around >> i & 1U) != 0; };
    // By (bit, row): the sides are the neighbours along each axis, the corner is the diagonal neighbour.
    const std::uint8_t l00 = vertex_occlusion(bit(3), bit(1), bit(0));
    const std::uint8_t l10 = vertex_occlusion(bit(5), bit(1), bit(2));
    const std::uint8_t l01 = vertex_occlusion(bit(3), bit(7), bit(6));
    const std::uint8_t l11 = vertex_occlusion(bit(5), bit(7), bit(8));
    const auto pack = [](const FaceOcclusion& occlusion) {
      const int packed = occlusion[0] | occlusion[1] << 2 | occlusion[2] << 4 | occlusion[3] << 6;
      return static_cast<std::uint64_t>(packed) << Quad::kOcclusionShift | std::uint64_t{flips_diagonal(occlusion)}
                                                                               << Quad::kFlipShift;
    };
    tables.u_along_bits[around] = pack({l00, l10, l11, l01});
    tables.u_along_rows[around] = pack({l00, l01, l11, l10});
  }
  for (unsigned bits = 0; bits < 256; ++bits) {
    const auto occlusion = [&](unsigned corner) { return static_cast<std::uint8_t>(bits >> (2 * corner) & 3U); };
    const bool flips = flips_diagonal({occlusion(0), occlusion(1), occlusion(2), occlusion(3)});
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

}  // namespace

bool holds_transparent(const Chunk& chunk, const VoxelRegistry& types) {
  if (!types.has_transparent()) return false;
  const ChunkStorage* voxels = ChunkStorage::of(chunk);
  if (voxels == nullptr) return types.is_transparent(*chunk.uniform());
  if (voxels->direct()) return true;
  for (std::size_t i = 0; i < voxels->palette.size(); ++i) {
    if (voxels->counts[i] != 0 && types.is_transparent(voxels->palette[i])) return true;
  }
  return false;
}

bool hold_unoccluding(const Neighbourhood& chunks, const VoxelRegistry& types) {
  if (!types.has_unoccluding()) return false;
  const auto holds_any = [&](const Chunk* chunk) {
    if (chunk == nullptr) return false;
    const std::vector<VoxelType> held = chunk->types();
    return std::ranges::any_of(held, [&](VoxelType type) { return types.is_opaque(type) && !types.occludes(type); });
  };
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (holds_any(chunks.at(x, y, z))) return true;
      }
    }
  }
  return false;
}

std::uint64_t* grow_quads(QuadBuffer& out, std::size_t used, std::size_t more) {
  if (out.size() < used + more) out.resize(std::max(used + more, out.capacity()));
  static_assert(sizeof(Quad) == sizeof(std::uint64_t));
  QUOIN_ASSERT(used <= out.size(), "quads that are there");
  return &out[used].bits;
}

namespace {

// Returns the voxels of a row of the centre chunk that are transparent and have the same type as in a neighbour's row.
std::uint64_t same_transparent(const Job& job, const Chunk& other, int y, int z, int other_y, int other_z) {
  QUOIN_ASSERT(job.chunks->centre() != nullptr, "a chunk to mesh");
  const Chunk& centre = *job.chunks->centre();
  std::uint64_t mask = 0;
  const ChunkStorage* voxels = ChunkStorage::of(centre);
  if (voxels != nullptr && !voxels->direct()) {
    for (const VoxelType type : voxels->palette) {
      if (!job.types->is_transparent(type)) continue;
      const std::uint64_t here = centre.row_mask(y, z, type);
      if (here != 0) mask |= here & other.row_mask(other_y, other_z, type);
    }
    return mask;
  }
  std::array<VoxelType, kChunkEdge> row{};
  std::array<VoxelType, kChunkEdge> other_row{};
  centre.read_row(y, z, row);
  other.read_row(other_y, other_z, other_row);
  for (std::size_t x = 0; x < kChunkEdge; ++x) {
    mask |= std::uint64_t{row[x] == other_row[x] && job.types->is_transparent(row[x])} << x;
  }
  return mask;
}

// Returns the layer of faces in a direction, if some types are transparent.
Layer& faces_towards(Direction direction, Scratch& s) {
  const auto d = static_cast<std::size_t>(direction);
  return d < 4 ? s.sides[d] : s.z.faces[d - 4];
}

// Returns the neighbour across the border for the region's faces in a direction; null if no such face is at the border.
const Chunk* chunk_beyond(const Job& job, Direction direction) {
  const FaceFrame& frame = frame_of(direction);
  const bool reaches = frame.sign > 0 ? job.region.max[frame.axis] == kChunkEdge : job.region.min[frame.axis] == 0;
  const IVec3 n = normal_of(direction);
  return reaches ? job.chunks->at(n.x, n.y, n.z) : nullptr;
}

}  // namespace

void hide_faces_at_border(const Job& job, Scratch& s) {
  const Chunk& centre = *job.chunks->centre();
  for (const Direction direction : kDirections) {
    const Chunk* other = chunk_beyond(job, direction);
    if (other == nullptr || !holds_transparent(*other, *job.types)) continue;
    const FaceFrame& frame = frame_of(direction);
    const int border = frame.sign > 0 ? kChunkEdge - 1 : 0;
    IBox box = job.region;  // a box of rows; x is ignored
    if (frame.axis != 0) {
      box.min[frame.axis] = border;
      box.max[frame.axis] = border + 1;
    }
    Layer& faces = faces_towards(direction, s);
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        const int at = word_index(z, y);
        const std::uint64_t transparent = s.solid.words[at] & ~s.z.opaque.words[at];
        if (frame.axis != 0) {
          const int other_y = frame.axis == 1 ? kChunkEdge - 1 - y : y;
          const int other_z = frame.axis == 2 ? kChunkEdge - 1 - z : z;
          if (transparent != 0) faces.words[at] &= ~same_transparent(job, *other, y, z, other_y, other_z);
        } else if ((transparent >> border & 1) != 0) {
          const bool same = centre.get(border, y, z) == other->get(kChunkEdge - 1 - border, y, z);
          faces.words[at] &= ~(std::uint64_t{same} << border);
        }
      }
    }
  }
}

namespace {

Direction opposite(Direction direction) {
  return static_cast<Direction>(static_cast<std::size_t>(direction) ^ 1U);
}

// Returns true if a chunk has voxels with shapes. 16 bits per voxel: it may have some.
bool holds_shapes(const Chunk* chunk, const VoxelRegistry& types) {
  if (chunk == nullptr) return false;
  const ChunkStorage* voxels = ChunkStorage::of(*chunk);
  if (voxels == nullptr) return types.is_shaped(*chunk->uniform());
  if (voxels->direct()) return true;
  for (std::size_t i = 0; i < voxels->palette.size(); ++i) {
    if (voxels->counts[i] != 0 && types.is_shaped(voxels->palette[i])) return true;
  }
  return false;
}

// Returns true if a chunk may have transparent voxels that are cubes.
bool holds_transparent_cubes(const Chunk& chunk, const VoxelRegistry& types) {
  const ChunkStorage* voxels = ChunkStorage::of(chunk);
  if (voxels == nullptr) return types.is_transparent(*chunk.uniform()) && !types.is_shaped(*chunk.uniform());
  if (voxels->direct()) return true;
  for (std::size_t i = 0; i < voxels->palette.size(); ++i) {
    const VoxelType type = voxels->palette[i];
    if (voxels->counts[i] != 0 && types.is_transparent(type) && !types.is_shaped(type)) return true;
  }
  return false;
}

// Returns true if the state may turn cubes of a chunk.
bool holds_turned_cubes(const Chunk& chunk, const VoxelRegistry& types) {
  if (!types.has_turned_by_state()) return false;
  const ChunkStorage* voxels = ChunkStorage::of(chunk);
  if (voxels == nullptr) return types.is_turned_by_state(*chunk.uniform());
  if (voxels->direct()) return true;
  for (std::size_t i = 0; i < voxels->palette.size(); ++i) {
    const VoxelType type = voxels->palette[i];
    if (voxels->counts[i] != 0 && types.is_turned_by_state(type) && !types.is_shaped(type)) return true;
  }
  return false;
}

// Distances from a voxel to its 26 neighbours and itself in ShapedVoxels::cells, by Neighbourhood::index.
constexpr std::array<int, 32> kCellOffsets = [] {
  std::array<int, 32> offsets{};
  for (int i = 0; i < 27; ++i) {
    const auto at = static_cast<std::size_t>(i);
    offsets[at] = ((i / 9 - 1) * ShapedVoxels::kEdge + i / 3 % 3 - 1) * ShapedVoxels::kCellStride + i % 3 - 1;
  }
  return offsets;
}();

using CornerOccluders = std::array<std::array<std::uint8_t, 3>, 4>;  // ModelFace::occluders

// Returns the occluders of a cube's faces, by direction.
const std::array<CornerOccluders, 6>& cube_occluders() {
  static const std::array<CornerOccluders, 6> all = [] {
    const VoxelShapes cube(VoxelShape::box(IVec3(0), IVec3(kShapeUnits)));
    std::array<CornerOccluders, 6> made{};
    for (const ModelFace& face : cube.model(0, {}, {}).faces) {
      made[static_cast<std::size_t>(face.direction)] = face.occluders;
    }
    return made;
  }();
  return all;
}

// Returns the occlusion of a face of a voxel, two bits per corner. `cell`: of the voxel.
inline unsigned occlusion_of(const CornerOccluders& occluders, const ShapedVoxels::Cell* cell) {
  const auto filled = [&](std::uint8_t number) -> unsigned {
    return cell[kCellOffsets[number >> 3U]] >> (number & 7U) & 1U;
  };
  unsigned bits = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& [side1, side2, diagonal] = occluders[i];
    const unsigned a = filled(side1);
    const unsigned b = filled(side2);
    // vertex_occlusion without branches.
    bits |= (a + b + (filled(diagonal) | (a & b))) << 2 * i;
  }
  return bits;
}

FaceOcclusion unpacked_occlusion(unsigned bits) {
  FaceOcclusion corners{};
  for (std::size_t i = 0; i < 4; ++i) corners[i] = static_cast<std::uint8_t>(bits >> 2 * i & 3U);
  return corners;
}

void fill_cells_of_row(std::uint64_t row, std::uint64_t ends, ShapedVoxels::Cell* out) {
  constexpr std::array<std::uint64_t, 16> kSpread = [] {
    std::array<std::uint64_t, 16> made{};
    for (std::size_t bits = 0; bits < made.size(); ++bits) {
      for (unsigned i = 0; i < 4; ++i) made[bits] |= (bits >> i & 1U) * (std::uint64_t{ShapedVoxels::kCube} << 16 * i);
    }
    return made;
  }();
  if (row == 0) {
    std::memset(out, 0, kChunkEdge * sizeof(*out));
  } else {
    for (std::size_t i = 0; i < 16; ++i) std::memcpy(out + 4 * i, &kSpread[row >> 4 * i & 15], 8);
  }
  out[-1] = (ends >> 63) != 0 ? ShapedVoxels::kCube : 0;
  out[kChunkEdge] = (ends & 1) != 0 ? ShapedVoxels::kCube : 0;
}

// Fills the cells of all voxels within two of shaped ones.
void fill_cells(const Job& job, bool row_ends, const Scratch& s) {
  ShapedVoxels& shapes = *job.shapes;
  shapes.cells.resize(ShapedVoxels::kRows * ShapedVoxels::kCellStride);
  // By z: bit y + 1 of each row with shaped voxels within two rows.
  using Mask = std::bitset<ShapedVoxels::kEdge>;
  std::array<Mask, ShapedVoxels::kEdge + 4> near{};
  for (const ShapedVoxel& voxel : shapes.voxels) {
    near[static_cast<std::size_t>(voxel.local.z + 3)].set(static_cast<std::size_t>(voxel.local.y + 1));
  }
  for (Mask& rows : near) rows |= rows << 1 | rows << 2 | rows >> 1 | rows >> 2;
  for (int z = -1; z <= kChunkEdge; ++z) {
    const Mask* const around = &near[static_cast<std::size_t>(z + 3)];
    const Mask rows = around[-2] | around[-1] | around[0] | around[1] | around[2];
    for (int y = -1; y <= kChunkEdge && rows.any(); ++y) {
      if (!rows[static_cast<std::size_t>(y + 1)]) continue;
      const auto at = static_cast<std::size_t>(word_index(z, y));
      fill_cells_of_row(s.z.opaque.words[at], row_ends ? s.z.ends.words[at] : 0,
                        &shapes.cells[ShapedVoxels::cell_at({0, y, z})]);
    }
  }
  for (const ShapedVoxel& voxel : shapes.voxels) {
    unsigned cell = ShapedVoxels::kShaped;
    if (voxel.is_opaque) cell |= voxel.model->filled_octants | unsigned{voxel.covered} << ShapedVoxels::kCoveredShift;
    shapes.cells[ShapedVoxels::cell_at(voxel.local)] = static_cast<ShapedVoxels::Cell>(cell);
  }
  shapes.has_cells = true;
}

// The faces around a voxel whose corners it may darken.
struct DarkenedFaces {
  // The faces that touch one of some octants, as bits: [octants]. A direction has eight faces around the voxel.
  std::array<std::uint8_t, 256> by_octants{};
  std::array<IVec3, 8> offsets{};  // of the faces' voxels
  std::array<int, 8> words{};      // the same in words of a layer, without x
};

const std::array<DarkenedFaces, 6>& darkened_faces() {
  static const std::array<DarkenedFaces, 6> all = [] {
    std::array<DarkenedFaces, 6> made{};
    for (const Direction direction : kDirections) {
      DarkenedFaces& faces = made[static_cast<std::size_t>(direction)];
      const FaceFrame& frame = frame_of(direction);
      std::size_t number = 0;
      for (int i = 0; i < 9; ++i) {
        if (i == 4) continue;  // the voxel in front of a face does not darken it
        IVec3& offset = faces.offsets[number];
        offset = -normal_of(direction);
        offset[frame.u] += i % 3 - 1;
        offset[frame.v] += i / 3 - 1;
        faces.words[number] = word_index(offset.z, offset.y) - word_index(0, 0);
        for (unsigned octants = 0; octants < 256; ++octants) {
          for (unsigned octant = 0; octant < 8; ++octant) {
            if ((octants >> octant & 1U) == 0) continue;
            bool touches = true;
            for (unsigned axis = 0; axis < 3; ++axis) {
              const int side = (octant >> axis & 1U) != 0 ? 1 : -1;
              touches &= offset[static_cast<int>(axis)] == 0 || offset[static_cast<int>(axis)] == side;
            }
            if (touches) faces.by_octants[octants] |= static_cast<std::uint8_t>(1U << number);
          }
        }
        ++number;
      }
    }
    return made;
  }();
  return all;
}

// The place of a face in the mesher's order: direction, plane, row, column.
struct FaceOrder {
  static constexpr std::array<int, 3> kRowAxis = {1, 2, 1};
  static constexpr std::array<int, 3> kBitAxis = {2, 0, 0};

  static std::uint64_t key(Direction direction, const IVec3& voxel) {
    const std::size_t axis = frame_of(direction).axis;
    const auto part = [&](int of) { return static_cast<std::uint64_t>(voxel[of]); };
    return static_cast<std::uint64_t>(direction) << 18 | part(static_cast<int>(axis)) << 12 |
           part(kRowAxis[axis]) << 6 | part(kBitAxis[axis]);
  }
  static std::pair<Direction, IVec3> face(std::uint64_t key) {
    const auto direction = static_cast<Direction>(key >> 18);
    const std::size_t axis = frame_of(direction).axis;
    IVec3 voxel;
    voxel[static_cast<int>(axis)] = static_cast<int>(key >> 12 & 63);
    voxel[kRowAxis[axis]] = static_cast<int>(key >> 6 & 63);
    voxel[kBitAxis[axis]] = static_cast<int>(key & 63);
    return {direction, voxel};
  }
};

// Removes a face from the layers of faces. Returns false if it is not there. Requires: a voxel of the chunk.
bool take_face(Direction direction, const IVec3& voxel, Scratch& s) {
  std::uint64_t& row = faces_towards(direction, s).words[word_index(voxel.z, voxel.y)];
  const std::uint64_t bit = std::uint64_t{1} << voxel.x;
  return (std::exchange(row, row & ~bit) & bit) != 0;
}

// Replaces the keys of single faces, sorted, by their quads.
void make_quads(const Job& job, QuadBuffer& faces) {
  const ShapedVoxels& shapes = *job.shapes;
  const Chunk& centre = *job.chunks->centre();
  const std::array<CornerOccluders, 6>& occluders = cube_occluders();
  std::size_t count = 0;
  std::uint64_t last_key = 0;
  for (const Quad face : faces) {  // read before it is overwritten: there are no more quads than faces
    const auto [direction, voxel] = FaceOrder::face(face.bits);
    const FaceFrame& frame = frame_of(direction);
    const unsigned packed =
        occlusion_of(occluders[static_cast<std::size_t>(direction)], &shapes.cells[ShapedVoxels::cell_at(voxel)]);
    const FaceOcclusion corners = unpacked_occlusion(packed);
    Quad quad;
    quad.bits = static_cast<std::uint64_t>(voxel.x) | static_cast<std::uint64_t>(voxel.y) << 6 |
                static_cast<std::uint64_t>(voxel.z) << 12 | std::uint64_t{packed} << Quad::kOcclusionShift |
                std::uint64_t{flips_diagonal(corners)} << Quad::kFlipShift |
                static_cast<std::uint64_t>(direction) << Quad::kDirectionShift |
                std::uint64_t{centre.get(voxel.x, voxel.y, voxel.z)} << Quad::kTypeShift;
    const bool is_u = FaceOrder::kBitAxis[frame.axis] == frame.u;  // columns are along u
    const bool is_constant = is_u ? corners[0] == corners[1] && corners[3] == corners[2]
                                  : corners[0] == corners[3] && corners[1] == corners[2];
    const int shift = is_u ? Quad::kSizeUShift : Quad::kSizeVShift;
    constexpr std::uint64_t kLook = ~((std::uint64_t{1} << Quad::kOcclusionShift) - 1);
    const bool continues = count > 0 && face.bits == last_key + 1 && (face.bits & 63) != 0;
    last_key = face.bits;
    if (job.merge && continues && is_constant && (faces[count - 1].bits & kLook) == (quad.bits & kLook)) {
      faces[count - 1].bits += std::uint64_t{1} << shift;
    } else {
      faces[count++] = quad;
    }
  }
  faces.resize(count);
}

}  // namespace

const ShapedVoxel* ShapedVoxels::at(const IVec3& local) const {
  const auto word = static_cast<std::size_t>(word_index(local.z, local.y));
  const std::uint64_t row = rows.words[word];
  const std::uint64_t before = ends.words[word] >> 63;
  std::size_t number = first[row_of(local.y, local.z)];
  if (local.x < 0) return before != 0 ? &voxels[number] : nullptr;
  number += before;
  if (local.x == kChunkEdge) {
    number += static_cast<std::size_t>(std::popcount(row));
    return (ends.words[word] & 1U) != 0 ? &voxels[number] : nullptr;
  }
  if ((row >> local.x & 1U) == 0) return nullptr;
  number += static_cast<std::size_t>(std::popcount(row & ((std::uint64_t{1} << local.x) - 1)));
  return &voxels[number];
}

void list_shapes(const Job& job) {
  ShapedVoxels& shapes = *job.shapes;
  shapes.voxels.clear();
  shapes.quads.clear();
  shapes.has_cells = false;
  const IBox around{job.region.min - 1, job.region.max + 1};
  const int first = std::max(around.min.x, 0);
  const int last = std::min(around.max.x, kChunkEdge) - 1;
  const std::uint64_t cells = (~std::uint64_t{0} << first) & (~std::uint64_t{0} >> (kChunkEdge - 1 - last));
  const std::uint64_t ends = std::uint64_t{around.min.x < 0} << 63 | std::uint64_t{around.max.x > kChunkEdge};
  const auto add = [&](const IVec3& local) {
    ShapedVoxel voxel{.local = local, .type = job.chunks->get(local)};
    voxel.is_opaque = (*job.types)[voxel.type].visibility == Visibility::Opaque;
    voxel.model = shape_at(*job.chunks, *job.types, local);
    for (std::size_t side = 0; side < 6 && voxel.is_opaque; ++side) {
      voxel.covered |= static_cast<std::uint8_t>(unsigned{voxel.model->covers_side[side]} << side);
    }
    shapes.voxels.push_back(voxel);
  };
  for (int z = around.min.z; z < around.max.z; ++z) {
    for (int y = around.min.y; y < around.max.y; ++y) {
      const auto at = static_cast<std::size_t>(word_index(z, y));
      const std::uint64_t row = shapes.rows.words[at] &= cells;
      const std::uint64_t beyond = shapes.ends.words[at] &= ends;
      shapes.first[ShapedVoxels::row_of(y, z)] = static_cast<std::uint32_t>(shapes.voxels.size());
      if ((beyond >> 63) != 0) add({-1, y, z});
      for (std::uint64_t left = row; left != 0; left &= left - 1) add({std::countr_zero(left), y, z});
      if ((beyond & 1U) != 0) add({kChunkEdge, y, z});
    }
  }
}

namespace {

// Returns true if the neighbour of a shaped voxel covers a face on its side.
bool is_covered(const Job& job, const ShapedVoxel& voxel, const ModelFace& face) {
  const IVec3 at = voxel.local + normal_of(face.direction);
  const ShapedVoxels& shapes = *job.shapes;
  const auto opposite_side = static_cast<unsigned>(face.direction) ^ 1U;
  const unsigned cell = shapes.cells[ShapedVoxels::cell_at(at)];
  if ((cell >> (ShapedVoxels::kCoveredShift + opposite_side) & 1U) != 0) return true;
  if ((cell & ShapedVoxels::kShaped) != 0) {
    const ShapedVoxel& other = *shapes.at(at);
    return covers(*job.types, other.type, other.model, voxel.type, face.direction, face.mask);
  }
  // The cells of opaque cubes that do not occlude look like air.
  return job.has_unoccluding && covers(*job.types, job.chunks->get(at), nullptr, voxel.type, face.direction, face.mask);
}

}  // namespace

void append_shape_faces(const Job& job, ShapeFaceBuffer& out) {
  const ShapedVoxels& shapes = *job.shapes;
  if (!shapes.has_cells) return;  // all of the region is opaque
  for (const ShapedVoxel& voxel : shapes.voxels) {
    if (!job.region.contains(voxel.local)) continue;
    const ShapedVoxels::Cell* const cell = &shapes.cells[ShapedVoxels::cell_at(voxel.local)];
    const auto place = static_cast<std::uint32_t>(voxel.local.x | voxel.local.y << 6 | voxel.local.z << 12);
    std::uint16_t number = 0;
    for (const ModelFace& face : voxel.model->faces) {
      const std::uint16_t own = number++;
      if (face.is_inner || (face.on_side && is_covered(job, voxel, face))) continue;
      ShapeFace made{voxel.model, place, own, voxel.type};
      if (job.occlusion && face.occluders[0][0] != kNoOccluder) {
        made.bits |= occlusion_of(face.occluders, cell) << ShapeFace::kOcclusionShift;
      }
      out.push_back(made);
    }
  }
}

namespace {

// Inserts quads, each behind those of its direction. Both buffers are sorted by direction.
void insert_by_direction(const QuadBuffer& more, QuadBuffer& quads) {
  std::size_t left = quads.size();
  std::size_t more_left = more.size();
  quads.resize(left + more_left);
  for (std::size_t to = quads.size(); more_left > 0; --to) {
    const bool is_before = left > 0 && quads[left - 1].direction() > more[more_left - 1].direction();
    quads[to - 1] = is_before ? quads[--left] : more[--more_left];
  }
}

}  // namespace

const TurnedTypes::Looks& TurnedTypes::looks_of(VoxelType type, const VoxelFaces& faces) {
  const auto [known, is_new] = looks_.try_emplace(type);
  Looks& looks = known->second;
  if (!is_new && looks.faces == faces) return looks;
  looks.faces = faces;
  for (const Direction direction : kDirections) {
    std::array<VoxelFace, AxisOrientation::kCount> shown;
    auto& first = looks.first[static_cast<std::size_t>(direction)];
    for (std::size_t i = 0; i < shown.size(); ++i) {
      if (!faces.empty()) shown[i] = turned_face(faces, direction, AxisOrientation::at(static_cast<int>(i)));
      first[i] = static_cast<std::uint8_t>(
          faces.empty() ? i
                        : static_cast<std::size_t>(std::find(shown.begin(), shown.end(), shown[i]) - shown.begin()));
    }
  }
  return looks;
}

void TurnedTypes::append_parts(const Quad& quad, const Chunk& chunk, const StateOrientations& orientations,
                               const Looks& looks) {
  const FaceFrame& frame = frame_of(quad.direction());
  const auto& first = looks.first[static_cast<std::size_t>(quad.direction())];
  const int width = quad.size_u();
  const int height = quad.size_v();
  std::array<std::uint8_t, std::size_t{kChunkEdge} * kChunkEdge> of;  // the first width * height are set
  constexpr std::uint8_t kDone = 255;
  const auto at = [&](int u, int v) -> std::uint8_t& { return of[static_cast<std::size_t>(u + width * v)]; };
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      IVec3 voxel = quad.voxel();
      voxel[frame.u] += u;
      voxel[frame.v] += v;
      at(u, v) = first[static_cast<std::size_t>(orientations.of(chunk.data(voxel).state).index())];
    }
  }
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const std::uint8_t orientation = at(u, v);
      if (orientation == kDone) continue;
      int size_u = 1;
      int size_v = 1;
      while (u + size_u < width && at(u + size_u, v) == orientation) ++size_u;
      const auto is_equal = [&](int row) {
        const std::uint8_t* const begin = &at(u, row);
        return std::all_of(begin, begin + size_u, [&](std::uint8_t other) { return other == orientation; });
      };
      while (v + size_v < height && is_equal(v + size_v)) ++size_v;
      for (int row = v; row < v + size_v; ++row) std::fill_n(&at(u, row), size_u, kDone);
      Quad part = quad_part(quad, u, v, size_u, size_v);
      part.bits |= std::uint64_t{orientation} << Quad::kOrientationShift;
      made_.push_back(part);
    }
  }
}

void TurnedTypes::apply(const Chunk& chunk, const VoxelRegistry& types, QuadBuffer& quads) {
  const auto is_turned = [&](const Quad& quad) { return types.is_turned_by_state(quad.type()); };
  if (std::ranges::none_of(quads, is_turned)) return;
  made_.clear();
  for (const Quad quad : quads) {
    if (is_turned(quad)) {
      const VoxelProperties& type = types[quad.type()];
      append_parts(quad, chunk, type.orientations, looks_of(quad.type(), type.faces));
    } else {
      made_.push_back(quad);
    }
  }
  std::swap(made_, quads);
}

void hide_faces_behind_shapes(const Job& job, Scratch& s) {
  for (const ShapedVoxel& voxel : job.shapes->voxels) {
    for (unsigned left = voxel.covered; left != 0; left &= left - 1) {
      const auto side = static_cast<Direction>(std::countr_zero(left));
      const IVec3 behind = voxel.local + normal_of(side);
      if (job.region.contains(behind)) take_face(opposite(side), behind, s);
    }
  }
}

void take_faces_next_to_shapes(const Job& job, bool row_ends, Scratch& s) {
  ShapedVoxels& shapes = *job.shapes;
  if (shapes.voxels.empty()) return;
  fill_cells(job, row_ends, s);
  if (!job.occlusion) return;
  std::array<std::uint64_t*, 6> layers{};
  for (const Direction direction : kDirections) {
    layers[static_cast<std::size_t>(direction)] = faces_towards(direction, s).words;
  }
  const std::array<DarkenedFaces, 6>& darkened = darkened_faces();
  const IBox inner{job.region.min + 1, job.region.max - 1};
  for (const ShapedVoxel& voxel : shapes.voxels) {
    if (!voxel.is_opaque || voxel.model->filled_octants == 0) continue;
    const bool is_inner = inner.contains(voxel.local);
    const int word = word_index(voxel.local.z, voxel.local.y);
    for (std::size_t d = 0; d < 6; ++d) {
      const DarkenedFaces& faces = darkened[d];
      for (unsigned left = faces.by_octants[voxel.model->filled_octants]; left != 0; left &= left - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(left));
        const IVec3 at = voxel.local + faces.offsets[i];
        if (!is_inner && !job.region.contains(at)) continue;
        std::uint64_t& row = layers[d][word + faces.words[i]];
        const std::uint64_t bit = std::uint64_t{1} << at.x;
        if ((row & bit) == 0) continue;
        row &= ~bit;
        shapes.quads.push_back({FaceOrder::key(static_cast<Direction>(d), at)});
      }
    }
  }
  std::ranges::sort(shapes.quads, {}, &Quad::bits);
  make_quads(job, shapes.quads);
}

}  // namespace blocky

namespace {

// Returns true if the face of a voxel of type `a` towards a voxel of type `b` is visible.
bool face_is_visible(const VoxelRegistry& types, VoxelType a, VoxelType b) {
  if (a == kAir) return false;
  if (b == kAir) return true;
  return types.is_transparent(b) && a != b;
}

// Returns true for a chunk of one type that its six neighbours hide completely. No voxel is read then.
bool is_buried(const Neighbourhood& chunks, const VoxelRegistry& types) {
  const auto type = chunks.centre()->uniform();
  if (!type.has_value() || types.is_shaped(*type)) return false;
  return std::all_of(kDirections.begin(), kDirections.end(), [&](Direction d) {
    const IVec3 n = normal_of(d);
    const Chunk* neighbour = chunks.at(n.x, n.y, n.z);
    if (neighbour == nullptr) return false;
    const auto other = neighbour->uniform();
    return other.has_value() && !face_is_visible(types, *type, *other);
  });
}

}  // namespace

struct BlockyMesher::Scratch : blocky::Scratch, LargeObject {
  struct Shapes : blocky::ShapedVoxels, LargeObject {};

  const blocky::Kernel& kernel = blocky::kKernels.widest();
  std::unique_ptr<Shapes> shapes;  // null before the first chunk with shapes
  blocky::TurnedTypes turned;

  // Returns the shapes of a chunk and its neighbours, to be listed by a kernel, or null if they have none.
  [[nodiscard]] blocky::ShapedVoxels* shapes_of(const Neighbourhood& chunks, const VoxelRegistry& types) {
    if (!types.has_shapes()) return nullptr;
    const bool is_in_centre = blocky::holds_shapes(chunks.centre(), types);
    if (!is_in_centre &&
        std::ranges::none_of(chunks.chunks, [&](const Chunk* each) { return blocky::holds_shapes(each, types); })) {
      return nullptr;
    }
    if (shapes == nullptr) shapes = std::make_unique<Shapes>();
    shapes->is_in_centre = is_in_centre;
    shapes->has_transparent_cubes = blocky::holds_transparent_cubes(*chunks.centre(), types);
    return shapes.get();
  }

  // Returns the job for the visible faces of a region.
  [[nodiscard]] blocky::Job job_of_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region) {
    blocky::ShapedVoxels* const shaped = shapes_of(chunks, types);
    return {.chunks = &chunks,
            .types = &types,
            .region = region,
            .merge = false,
            .occlusion = false,
            .has_transparent = shaped != nullptr || blocky::holds_transparent(*chunks.centre(), types),
            .one_type = false,
            .shapes = shaped};
  }
};

BlockyMesher::BlockyMesher() : scratch_(new Scratch()) {
  impl_of(scratch_).occlusion = blocky::make_occlusion_tables();
}
BlockyMesher::BlockyMesher(BlockyMesher&&) noexcept = default;
BlockyMesher& BlockyMesher::operator=(BlockyMesher&&) noexcept = default;
BlockyMesher::~BlockyMesher() = default;

void BlockyMesher::mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options,
                        QuadBuffer& out) {
  mesh(chunks, types, options, out, nullptr);
}

void BlockyMesher::mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options,
                        QuadBuffer& out, ShapeFaceBuffer& shapes) {
  shapes.clear();
  mesh(chunks, types, options, out, &shapes);
}

void BlockyMesher::mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options,
                        QuadBuffer& out, ShapeFaceBuffer* shape_faces) {
  Scratch& scratch = impl_of(scratch_);
  scratch.quads = 0;
  const Chunk* centre = chunks.centre();
  blocky::ShapedVoxels* shapes = nullptr;
  if (centre != nullptr && !is_buried(chunks, types)) {
    const IBox region = intersect(intersect(options.region, kWholeChunk), centre->bounds());
    if (!region.empty()) {
      const bool has_unoccluding = options.bake_occlusion && blocky::hold_unoccluding(chunks, types);
      shapes = options.shapes == ShapeUse::Cubes ? nullptr : scratch.shapes_of(chunks, types);
      const blocky::Job job{
          .chunks = &chunks,
          .types = &types,
          .region = region,
          .merge = options.merge,
          .occlusion = options.bake_occlusion,
          .has_transparent = has_unoccluding || shapes != nullptr || blocky::holds_transparent(*centre, types),
          .one_type = false,
          .has_unoccluding = has_unoccluding,
          .shapes = shapes};
      scratch.kernel.mesh(job, scratch, out);
      if (shapes != nullptr && shape_faces != nullptr) blocky::append_shape_faces(job, *shape_faces);
    }
  }
  out.resize(scratch.quads);
  if (shapes != nullptr) blocky::insert_by_direction(shapes->quads, out);
  if (!out.empty() && blocky::holds_turned_cubes(*centre, types)) scratch.turned.apply(*centre, types, out);
}

Quad quad_part(Quad quad, int u, int v, int size_u, int size_v) {
  QUOIN_ASSERT(
      u >= 0 && v >= 0 && size_u >= 1 && size_v >= 1 && u + size_u <= quad.size_u() && v + size_v <= quad.size_v(),
      "a part of the quad");
  const FaceFrame& frame = frame_of(quad.direction());
  const IVec3 voxel = quad.voxel();
  const auto put = [&](int shift, int value) {
    quad.bits = (quad.bits & ~(std::uint64_t{63} << shift)) | static_cast<std::uint64_t>(value) << shift;
  };
  put(6 * frame.u, voxel[frame.u] + u);
  put(6 * frame.v, voxel[frame.v] + v);
  put(Quad::kSizeUShift, size_u - 1);
  put(Quad::kSizeVShift, size_v - 1);
  return quad;
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
  Scratch& s = impl_of(scratch_);
  s.kernel.find_faces(s.job_of_faces(chunks, types, region), s);
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

std::int64_t BlockyMesher::count_faces(const Neighbourhood& chunks, const VoxelRegistry& types) {
  const Chunk* centre = chunks.centre();
  if (centre == nullptr || is_buried(chunks, types)) return 0;
  const IBox region = centre->bounds();
  if (region.empty()) return 0;
  Scratch& scratch = impl_of(scratch_);
  return scratch.kernel.count_faces(scratch.job_of_faces(chunks, types, region), scratch);
}

std::string to_string(const FaceCounts& faces) {
  return "Faces: " + with_thousands(faces.visible) + " visible of " + with_thousands(faces.total) + " total";
}

std::int64_t FaceRows::count() const {
  std::int64_t total = 0;
  for (const auto& direction : rows) {
    for (const std::uint64_t row : direction) total += std::popcount(row);
  }
  return total;
}

DirectionSet visible_faces(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 voxel) {
  DirectionSet faces;
  const VoxelType type = chunks.get(voxel);
  if (type == kAir || types.is_shaped(type)) return faces;
  SideMask whole;
  whole.fill(~std::uint64_t{0});
  for (const Direction direction : kDirections) {
    const IVec3 at = voxel + normal_of(direction);
    const VoxelType other = chunks.get(at);
    const bool is_hidden =
        types.is_shaped(other) && covers(types, other, shape_at(chunks, types, at), type, direction, whole);
    if (!is_hidden && face_is_visible(types, type, other)) faces.insert(direction);
  }
  return faces;
}

void visible_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region,
                   std::vector<DirectionSet>& out) {
  const IBox inside = intersect(region, kWholeChunk);
  const IVec3 size = inside.size();
  out.assign(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) * static_cast<std::size_t>(size.z),
             {});
  FaceRows faces;
  BlockyMesher().find_faces(chunks, types, inside, faces);
  std::size_t next = 0;
  for (int z = inside.min.z; z < inside.max.z; ++z) {
    for (int y = inside.min.y; y < inside.max.y; ++y) {
      for (int x = inside.min.x; x < inside.max.x; ++x, ++next) {
        for (const Direction direction : kDirections) {
          const auto& rows = faces.rows[static_cast<std::size_t>(direction)];
          if ((rows[static_cast<std::size_t>(z * kChunkEdge + y)] >> x & 1U) != 0) out[next].insert(direction);
        }
      }
    }
  }
}

FaceOcclusion face_occlusion(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 voxel,
                             Direction direction) {
  QUOIN_ASSERT(static_cast<std::size_t>(direction) < kCornerNeighbours.size(), "one of the six directions");
  const auto is_filled = [&](std::uint8_t octant) {
    const IVec3 at = voxel + Neighbourhood::offset(octant >> 3U);
    const VoxelType type = chunks.get(at);
    if (!types.is_shaped(type)) return types.occludes(type);
    return types[type].visibility == Visibility::Opaque &&
           (shape_at(chunks, types, at)->filled_octants >> (octant & 7U) & 1U) != 0;
  };
  FaceOcclusion corners{};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& [side1, side2, diagonal] = blocky::cube_occluders()[static_cast<std::size_t>(direction)][i];
    corners[i] = vertex_occlusion(is_filled(side1), is_filled(side2), is_filled(diagonal));
  }
  return corners;
}

}  // namespace quoin

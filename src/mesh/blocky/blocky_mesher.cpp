#include <quoin/mesh/blocky.h>

#include <algorithm>
#include <array>
#include <bit>
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
            .shapes = shaped,
            .kernel = &kernel};
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
          .shapes = shapes,
          .kernel = &scratch.kernel};
      scratch.kernel.mesh(job, scratch, out);
      if (shapes != nullptr && shape_faces != nullptr) blocky::append_shape_faces(job, *shape_faces);
    }
  }
  if (shapes == nullptr && shape_faces != nullptr) shape_faces->clear();
  out.resize(scratch.quads);
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
    const auto& [side1, side2, diagonal] = blocky::cube_face(direction).occluders[i];
    corners[i] = vertex_occlusion(is_filled(side1), is_filled(side2), is_filled(diagonal));
  }
  return corners;
}

}  // namespace quoin

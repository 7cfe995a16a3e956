#include "mesh/surface/face_materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/srgb.h"
#include "grid/chunk/chunk_storage.h"
#include "mesh/smooth/level_cells.h"

namespace quoin {
namespace {

constexpr LinearRgba16 kWhite = {65'535, 65'535, 65'535, 65'535};

std::uint16_t linear16(std::uint8_t encoded) {
  return static_cast<std::uint16_t>(std::lround(linear_from_srgb(encoded) * 65'535.0F));
}

// The solid samples of all bodies.
struct AnySolid {
  const DensityNeighbourhood& chunks;
  bool operator()(IVec3 sample) const { return smooth::is_solid_at(chunks, sample); }
};

// The solid samples of opaque bodies.
struct OpaqueSolid {
  const DensityNeighbourhood& chunks;
  const VoxelRegistry& types;
  bool operator()(IVec3 sample) const {
    return smooth::is_solid_at(chunks, sample) && !types.is_transparent(chunks.material(sample));
  }
};

// Reads the materials of the solid corners of a cell within a chunk, row by row.
std::size_t materials_of_corners(const DensityChunk& chunk, IVec3 first, VoxelType* out) {
  const ChunkStorage* mixed = ChunkStorage::of(chunk.materials());
  QUOIN_ASSERT(mixed != nullptr, "several materials");
  std::size_t found = 0;
  for (int row = 0; row < 4; ++row) {
    const int y = first.y + (row & 1);
    const int z = first.z + (row >> 1);
    const auto solid = static_cast<std::uint32_t>(smooth::signs_of(chunk, y, z) >> first.x & 3U);
    if (solid == 0) continue;
    const std::uint32_t slab = mixed->slabs[ChunkStorage::slab_index(y, z)];
    const bool is_uniform = (slab & ChunkStorage::kUniformSlab) != 0;
    for (int x = 0; x < 2; ++x) {
      if ((solid >> x & 1U) == 0) continue;
      const std::uint32_t index = is_uniform ? slab & ~ChunkStorage::kUniformSlab
                                             : mixed->read(slab, ChunkStorage::row_in_slab(y, z), first.x + x);
      out[found++] = mixed->direct() ? static_cast<VoxelType>(index) : mixed->palette[index];
    }
  }
  return found;
}

// Reads the materials of the solid samples in the closed box that starts at `first`, `count` per side and `step` apart.
template <class IsSolid>
std::size_t solid_materials(const IsSolid& is_solid, IVec3 first, int count, int step, VoxelType* out) {
  std::size_t found = 0;
  for (int z = 0; z < count; ++z) {
    for (int y = 0; y < count; ++y) {
      for (int x = 0; x < count; ++x) {
        const IVec3 sample = first + IVec3{x, y, z} * step;
        if (is_solid(sample)) out[found++] = is_solid.chunks.material(sample);
      }
    }
  }
  return found;
}

// Reads the materials of the solid samples nearest to the surface along the crossed edges of a cell of width `size`:
// the top layer of the ground, even if the corners are far below it.
template <class IsSolid>
std::size_t materials_under_crossings(const IsSolid& is_solid, IVec3 first, int size, VoxelType* out) {
  std::size_t found = 0;
  for (int edge = 0; edge < 12; ++edge) {
    const int axis = edge / 4;
    IVec3 solid = first;
    solid[(axis + 1) % 3] += (edge & 1) * size;
    solid[(axis + 2) % 3] += (edge >> 1 & 1) * size;
    IVec3 air = solid;
    air[axis] += size;
    if (is_solid(solid) == is_solid(air)) continue;
    if (is_solid(air)) std::swap(solid, air);
    for (int width = size / 2; width >= 1; width /= 2) {
      const IVec3 middle = (solid + air) / 2;
      (is_solid(middle) ? solid : air) = middle;
    }
    out[found++] = is_solid.chunks.material(solid);
  }
  return found;
}

// Reads the materials of the samples whose mean is the colour of a cell that starts at `first`, as
// SurfaceMaterials::of_cell.
template <class IsSolid>
std::size_t materials_of_cell(const IsSolid& is_solid, IVec3 first, int level, VoxelType* out) {
  const int size = 1 << level;
  std::size_t found = level > 0 ? materials_under_crossings(is_solid, first, size, out) : 0;
  for (int step = size; found == 0 && step >= 1; step /= 2) {
    found = solid_materials(is_solid, first, size / step + 1, step, out);
  }
  return found;
}

}  // namespace

LinearRgba16 linear_colour_of(Rgba8 colour) {
  return {linear16(colour.r), linear16(colour.g), linear16(colour.b), static_cast<std::uint16_t>(colour.a * 257)};
}

SurfaceMaterials::SurfaceMaterials(const VoxelRegistry& types) : albedo_(types.size(), kWhite) {
  std::array<std::uint16_t, 256> linear;
  for (std::size_t i = 0; i < 256; ++i) linear[i] = linear16(static_cast<std::uint8_t>(i));
  const auto decoded = [&](Rgba8 colour) -> LinearRgba16 {
    return {linear[colour.r], linear[colour.g], linear[colour.b], static_cast<std::uint16_t>(colour.a * 257)};
  };
  for (std::size_t i = kAir + 1; i < albedo_.size(); ++i) {
    albedo_[i] = decoded(types[static_cast<VoxelType>(i)].colour);
  }
  if (!types.has_textures()) return;
  textured_of_.resize(types.size());
  for (std::size_t i = kAir + 1; i < albedo_.size(); ++i) {
    const VoxelProperties& type = types[static_cast<VoxelType>(i)];
    if (type.faces.empty()) continue;
    Textured& textured = textured_.emplace_back();
    textured_of_[i] = static_cast<std::uint32_t>(textured_.size());
    textured.rule = TriplanarRule(type.field_textures);
    for (const Direction direction : kDirections) {
      const VoxelFace& face = type.faces[direction];
      const Vec3 tint(linear_from_srgb(face.tint.r), linear_from_srgb(face.tint.g), linear_from_srgb(face.tint.b));
      textured.means[static_cast<std::size_t>(direction)] = face.texture.mean() * tint;
    }
  }
}

bool SurfaceMaterials::has_textures(const VertexMaterials& materials) const {
  return std::ranges::any_of(materials.types, [&](VoxelType type) { return textured(type) != nullptr; });
}

LinearRgba16 SurfaceMaterials::albedo(const VertexMaterials& materials, const Vec3& normal) const {
  std::array<float, 4> sum{};
  for (std::size_t i = 0; i < VertexMaterials::kSlots; ++i) {
    const auto weight = static_cast<float>(materials.weights[i]);
    const LinearRgba16 own = albedo(materials.types[i]);
    const Textured* const look = textured(materials.types[i]);
    Vec3 colour = Vec3(own[0], own[1], own[2]);
    if (look != nullptr) {
      const std::array<float, 3> along = look->rule.weights(normal);
      colour = Vec3(0.0F);
      for (int axis = 0; axis < 3; ++axis) {
        const auto side = static_cast<std::size_t>(2 * axis + (normal[axis] < 0.0F ? 1 : 0));
        colour += 65'535.0F * along[static_cast<std::size_t>(axis)] * look->means[side];
      }
    }
    for (int k = 0; k < 3; ++k) sum[static_cast<std::size_t>(k)] += weight * colour[k];
    sum[3] += weight * static_cast<float>(own[3]);
  }
  LinearRgba16 mean;
  for (std::size_t k = 0; k < 4; ++k) {
    mean[k] = static_cast<std::uint16_t>(std::clamp(sum[k] / 255.0F + 0.5F, 0.0F, 65'535.0F));
  }
  return mean;
}

LinearRgba16 SurfaceMaterials::albedo(VoxelType type) const {
  return type < albedo_.size() ? albedo_[type] : kWhite;
}

CellMaterial SurfaceMaterials::blend(std::span<VoxelType> solid) const {
  QUOIN_ASSERT(!solid.empty(), "at least one material");
  if (std::all_of(solid.begin(), solid.end(), [&](VoxelType type) { return type == solid[0]; })) {
    return {albedo(solid[0]), solid[0]};
  }
  std::sort(solid.begin(), solid.end());
  std::array<std::uint32_t, 4> sum{};
  CellMaterial blended;
  std::size_t most = 0;
  for (auto first = solid.begin(); first != solid.end();) {
    const auto end = std::upper_bound(first, solid.end(), *first);
    const auto count = static_cast<std::size_t>(end - first);
    const LinearRgba16 colour = albedo(*first);
    for (std::size_t i = 0; i < 4; ++i) sum[i] += static_cast<std::uint32_t>(count) * colour[i];
    if (count > most) {
      most = count;
      blended.type = *first;
    }
    first = end;
  }
  const auto total = static_cast<std::uint32_t>(solid.size());
  for (std::size_t i = 0; i < 4; ++i) blended.albedo[i] = static_cast<std::uint16_t>((sum[i] + total / 2) / total);
  return blended;
}

std::span<VoxelType> SurfaceMaterials::find_solid(const DensityNeighbourhood& chunks, IVec3 first, int level,
                                                  Solid& solid) const {
  QUOIN_ASSERT(level >= 0 && level <= kMaxSmoothLevel, "a level of detail");
  const int size = 1 << level;
  std::size_t found = 0;
  const DensityChunk* centre = chunks.centre();
  if (centre != nullptr && std::min({first.x, first.y, first.z}) >= 0 &&
      std::max({first.x, first.y, first.z}) + size < kChunkEdge) {
    if (const auto only = centre->materials().uniform()) {
      solid[0] = *only;
      return {solid.data(), 1};
    }
    if (level == 0) found = materials_of_corners(*centre, first, solid.data());
  }
  if (found == 0) found = materials_of_cell(AnySolid{chunks}, first, level, solid.data());
  return {solid.data(), found};
}

CellMaterial SurfaceMaterials::of_cell(const DensityNeighbourhood& chunks, IVec3 first, int level) const {
  Solid found;
  const std::span<VoxelType> solid = find_solid(chunks, first, level, found);
  if (solid.size() == 1) return {albedo(solid[0]), solid[0]};
  return solid.empty() ? CellMaterial{kWhite, kAir} : blend(solid);
}

namespace {

// Returns the four most frequent of some materials, sorted; of equally frequent ones the lowest.
VertexMaterials mixed_from(std::span<const VoxelType> sorted) {
  struct Run {
    VoxelType type;
    std::uint32_t count;
  };
  std::array<Run, VertexMaterials::kSlots> most{};
  std::size_t kept = 0;
  for (auto first = sorted.begin(); first != sorted.end();) {
    const auto end = std::upper_bound(first, sorted.end(), *first);
    const Run run{*first, static_cast<std::uint32_t>(end - first)};
    first = end;
    if (kept < most.size()) {
      most[kept++] = run;
      continue;
    }
    // The last of the least frequent goes.
    const auto least = std::min_element(most.rbegin(), most.rend(), [](Run a, Run b) { return a.count < b.count; });
    if (run.count <= least->count) continue;
    std::move(least.base(), most.end(), least.base() - 1);
    most.back() = run;
  }
  std::uint32_t total = 0;
  for (const Run& run : most) total += run.count;
  VertexMaterials mixed;
  std::uint32_t sum = 0;
  std::uint32_t given = 0;
  for (std::size_t i = 0; i < kept; ++i) {
    sum += most[i].count;
    const std::uint32_t until = (sum * 255 + total / 2) / total;
    mixed.types[i] = most[i].type;
    mixed.weights[i] = static_cast<std::uint8_t>(until - given);
    given = until;
  }
  return mixed;
}

}  // namespace

CellMaterial SurfaceMaterials::of_vertex(const DensityNeighbourhood& chunks, IVec3 first, int level, const Vec3& normal,
                                         VertexMaterials* materials) const {
  if (materials == nullptr && !has_textures()) return of_cell(chunks, first, level);
  Solid found;
  const std::span<VoxelType> solid = find_solid(chunks, first, level, found);
  if (solid.empty()) {
    if (materials != nullptr) *materials = only_material(kAir);
    return {kWhite, kAir};
  }
  std::ranges::sort(solid);
  CellMaterial vertex = blend(solid);
  const VertexMaterials mixed = mixed_from(solid);
  if (has_textures(mixed)) vertex.albedo = albedo(mixed, normal);
  if (materials != nullptr) *materials = mixed;
  return vertex;
}

}  // namespace quoin

namespace quoin::smooth {
namespace {

/// A FaceLook, packed in one non-zero number.
class LookCode {
 public:
  LookCode() = default;
  explicit LookCode(const FaceLook& look)
      : code_(std::uint64_t{look.group} << 32 | std::uint64_t{look.type} << 8 |
              static_cast<std::uint64_t>(look.direction) << 1 | 1U) {}

  [[nodiscard]] bool is_set() const { return code_ != 0; }
  [[nodiscard]] FaceLook look() const {
    return {static_cast<VoxelType>(code_ >> 8 & 0xFFFFU), static_cast<Direction>(code_ >> 1 & 7U),
            static_cast<std::uint32_t>(code_ >> 32)};
  }
  bool operator==(const LookCode&) const = default;

 private:
  std::uint64_t code_ = 0;
};

/// The copies that each vertex needs. Nearly all need one.
class Copies {
 public:
  explicit Copies(std::size_t vertices) : first_(vertices) {}

  /// Returns true if the first copy of the vertex has the look. A vertex without copies gets the look first.
  bool is_first(std::uint32_t vertex, LookCode look) {
    QUOIN_ASSERT(vertex < first_.size() && look.is_set(), "a look of one of the vertices");
    // Without a branch: the first triangle of a vertex is unpredictable.
    const LookCode first = first_[vertex].is_set() ? first_[vertex] : look;
    first_[vertex] = first;
    return first == look;
  }

  /// Returns the index, among the copies of the vertex, of the copy with the look, which is not the first copy.
  std::uint32_t find_or_add_other(std::uint32_t vertex, LookCode look) {
    if (second_.empty()) second_.resize(first_.size());
    std::uint32_t number = 1;
    std::uint32_t* link = &second_[vertex];
    for (; *link != 0; link = &others_[*link - 1].next, ++number) {
      if (others_[*link - 1].look == look) return number;
    }
    *link = static_cast<std::uint32_t>(others_.size() + 1);
    others_.push_back({look, 0});
    return number;
  }

  /// Lists the copies in the order of the vertices, and of their addition for each vertex. `places` gets the index of
  /// each vertex' first copy.
  [[nodiscard]] BlockVector<VertexCopy> list(std::vector<std::uint32_t>& places) const {
    BlockVector<VertexCopy> copies;
    copies.reserve(first_.size() + others_.size());
    places.resize(first_.size());
    for (std::uint32_t vertex = 0; vertex < first_.size(); ++vertex) {
      places[vertex] = static_cast<std::uint32_t>(copies.size());
      if (!first_[vertex].is_set()) continue;
      copies.push_back({vertex, first_[vertex].look()});
      if (second_.empty()) continue;
      for (std::uint32_t at = second_[vertex]; at != 0; at = others_[at - 1].next) {
        copies.push_back({vertex, others_[at - 1].look.look()});
      }
    }
    return copies;
  }

 private:
  // A copy of a vertex after its first one, in a linked list.
  struct Other {
    LookCode look;
    std::uint32_t next = 0;  // 0: none, otherwise the index of the next, plus one
  };

  BlockVector<LookCode> first_;        // by vertex
  std::vector<std::uint32_t> second_;  // by vertex, as Other::next; empty while no vertex has two
  BlockVector<Other> others_;
};

// Returns the face around a crossed lattice edge. The cells that the triangle's vertices are in or between are three or
// four of the cells around the edge.
TriangleFace face_around_edge(const DensityNeighbourhood& chunks, const SmoothChunkMesh& mesh,
                              const std::uint32_t* triangle, bool has_bridges) {
  const auto place_of = [&](std::size_t i) {
    const SmoothCell name = mesh.cells[triangle[i]];
    return name.cell() + name.chunk_offset() * kChunkEdge;
  };
  const std::array<IVec3, 3> places = {place_of(0), place_of(1), place_of(2)};
  const IVec3 first = glm::min(glm::min(places[0], places[1]), places[2]);
  IVec3 last = glm::max(glm::max(places[0], places[1]), places[2]);
  if (has_bridges) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int axis = mesh.cells[triangle[i]].bridge_axis();
      if (axis >= 0) last = glm::max(last, places[i] + unit_axis(axis));
    }
  }
  // These cells have the same extent along the edge; the last of them begins where the edge begins.
  const int axis = first.x == last.x ? 0 : first.y == last.y ? 1 : 2;
  TriangleFace face;
  face.sample = last;
  const bool is_first_solid = is_solid_at(chunks, last);
  if (!is_first_solid) ++face.sample[axis];
  face.direction = static_cast<Direction>(2 * axis + (is_first_solid ? 0 : 1));
  const IVec3 chunk = chunk_of(face.sample);
  const DensityChunk* found = chunks.at(chunk.x, chunk.y, chunk.z);
  face.type = found == nullptr ? kAir : found->materials().get(local_of(face.sample));
  return face;
}

// For cells of several sizes: derives the face from the surroundings of the triangle's vertices.
TriangleFace face_of_triangle(const SmoothChunkMesh& mesh, const std::uint32_t* triangle,
                              const BlockVector<CellMaterial>& materials) {
  const auto type = [&](std::size_t i) { return materials[triangle[i]].type; };
  const DVec3 a(mesh.positions[triangle[0]]);
  const DVec3 b(mesh.positions[triangle[1]]);
  const DVec3 c(mesh.positions[triangle[2]]);
  TriangleFace face;
  face.type = type(1) == type(2) ? type(1) : type(0);
  const DVec3 normal = glm::cross(b - a, c - a);
  face.direction = nearest_direction(normal);
  const DVec3 inside = (a + b + c) / 3.0 - DVec3(normal_of(face.direction)) * 0.5;
  face.sample = IVec3(glm::floor(inside + 0.5));
  return face;
}

}  // namespace

BlockVector<CellMaterial> materials_of(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                                       const SurfaceMaterials& materials, const SmoothChunkMesh& mesh,
                                       BlockVector<VertexMaterials>* mixed) {
  const ChunkLevels levels(options.levels);
  BlockVector<CellMaterial> of_vertex;
  of_vertex.reserve(mesh.cells.size());
  if (mixed != nullptr) mixed->resize(mesh.cells.size());
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) {
    const LevelCell cell = levels.cell_of(mesh.cells[i]);
    VertexMaterials* const out = mixed != nullptr ? &(*mixed)[i] : nullptr;
    of_vertex.push_back(materials.of_vertex(chunks, cell.first, cell.level, mesh.normals[i], out));
  }
  return of_vertex;
}

void append_opaque_materials(const DensityNeighbourhood& chunks, const VoxelRegistry& types,
                             const std::array<std::uint8_t, 27>& levels, SmoothCell name, std::vector<VoxelType>& out) {
  const LevelCell cell = ChunkLevels(levels).cell_of(name);
  std::array<VoxelType, 729> solid;  // as many as a cell can have
  const std::size_t found = materials_of_cell(OpaqueSolid{chunks, types}, cell.first, cell.level, solid.data());
  out.insert(out.end(), solid.begin(), solid.begin() + static_cast<std::ptrdiff_t>(found));
}

std::size_t quad_indices_of(const SmoothChunkMesh& mesh) {
  const auto is_bridge = [&](std::uint32_t vertex) { return mesh.cells[vertex].bridge_axis() >= 0; };
  std::size_t i = 0;
  while (i + 6 <= mesh.indices.size() &&
         std::none_of(mesh.indices.begin() + i, mesh.indices.begin() + i + 6, is_bridge)) {
    i += 6;
  }
  return i;
}

void find_faces(const DensityNeighbourhood& chunks, const SmoothOptions& options, const SurfaceMaterials& materials,
                const SmoothChunkMesh& mesh, std::vector<TriangleFace>& faces) {
  faces.reserve(mesh.indices.size() / 3);
  const ChunkLevels levels(options.levels);
  if (levels.all_same() && options.levels[0] == 0) {
    // The two triangles of a quad are one face.
    const std::size_t quads_end = quad_indices_of(mesh);
    for (std::size_t i = 0; i < quads_end; i += 6) {
      faces.insert(faces.end(), 2, face_around_edge(chunks, mesh, mesh.indices.data() + i, false));
    }
    for (std::size_t i = quads_end; i < mesh.indices.size(); i += 3) {
      faces.push_back(face_around_edge(chunks, mesh, mesh.indices.data() + i, true));
    }
    return;
  }
  const BlockVector<CellMaterial> of_vertex = materials_of(chunks, options, materials, mesh);
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    faces.push_back(face_of_triangle(mesh, mesh.indices.data() + i, of_vertex));
  }
}

BlockVector<VertexCopy> split_by_faces(std::span<std::uint32_t> indices, std::size_t vertices,
                                       std::span<const TriangleFace> faces, const FaceDifferences& differences) {
  QUOIN_ASSERT(faces.size() == indices.size() / 3, "a face per triangle");
  QUOIN_ASSERT(differences.groups.empty() || differences.groups.size() == faces.size(), "a group per triangle");
  Copies copies(vertices);
  struct Exception {
    std::size_t index;
    std::uint32_t number;  // index among the copies of its vertex
  };
  std::vector<Exception> exceptions;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    FaceLook look;
    if (differences.types) look.type = faces[i].type;
    if (differences.directions) look.direction = faces[i].direction;
    if (!differences.groups.empty()) look.group = differences.groups[i];
    const LookCode code(look);
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
      const std::uint32_t vertex = indices[k];
      if (!copies.is_first(vertex, code)) exceptions.push_back({k, copies.find_or_add_other(vertex, code)});
    }
  }
  std::vector<std::uint32_t> places;
  BlockVector<VertexCopy> list = copies.list(places);
  for (std::uint32_t& index : indices) index = places[index];
  for (const Exception& exception : exceptions) indices[exception.index] += exception.number;
  return list;
}

namespace {

using Materials = std::array<VoxelType, VertexMaterials::kSlots>;

// The materials of a triangle, in the order of its vertices' slots.
struct Palette {
  Materials types{};
  std::size_t count = 0;

  [[nodiscard]] std::size_t find(VoxelType type) const {
    return static_cast<std::size_t>(std::find(types.begin(), types.begin() + count, type) - types.begin());
  }
  [[nodiscard]] auto key() const { return std::pair(count, types); }
};

Palette palette_of(const std::array<const VertexMaterials*, 3>& vertices) {
  struct Sum {
    VoxelType type = kAir;
    std::uint32_t weight = 0;
  };
  std::array<Sum, 3 * VertexMaterials::kSlots> sums;
  std::size_t count = 0;
  for (const VertexMaterials* const vertex : vertices) {
    for (std::size_t i = 0; i < VertexMaterials::kSlots; ++i) {
      if (vertex->weights[i] == 0) continue;
      std::size_t k = 0;
      while (k < count && sums[k].type != vertex->types[i]) ++k;
      if (k == count) sums[count++] = {vertex->types[i], 0};
      sums[k].weight += vertex->weights[i];
    }
  }
  const auto end = sums.begin() + static_cast<std::ptrdiff_t>(count);
  std::sort(sums.begin(), end,
            [](Sum a, Sum b) { return a.weight != b.weight ? a.weight > b.weight : a.type < b.type; });
  Palette palette;
  palette.count = std::min(count, palette.types.size());
  std::sort(sums.begin(), sums.begin() + static_cast<std::ptrdiff_t>(palette.count),
            [](Sum x, Sum y) { return x.type < y.type; });
  for (std::size_t i = 0; i < palette.count; ++i) palette.types[i] = sums[i].type;
  return palette;
}

VertexMaterials in_palette(const VertexMaterials& vertex, const Palette& palette) {
  VertexMaterials out;
  out.types = palette.types;
  std::uint32_t dropped = 0;
  for (std::size_t i = 0; i < VertexMaterials::kSlots; ++i) {
    const std::size_t slot = vertex.weights[i] == 0 ? palette.count : palette.find(vertex.types[i]);
    if (slot < palette.count) {
      out.weights[slot] = vertex.weights[i];
    } else {
      dropped += vertex.weights[i];
    }
  }
  if (dropped != 0) *std::ranges::max_element(out.weights) += static_cast<std::uint8_t>(dropped);
  return out;
}

}  // namespace

BlockVector<AlignedVertex> align_materials(std::span<std::uint32_t> indices,
                                           std::span<const VertexMaterials> materials) {
  QUOIN_ASSERT(indices.size() % 3 == 0, "three indices per triangle");
  std::vector<Palette> palettes;
  std::map<std::pair<std::size_t, Materials>, std::uint32_t> known;
  std::vector<std::uint32_t> groups;
  groups.reserve(indices.size() / 3);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const Palette palette =
        palette_of({&materials[indices[i]], &materials[indices[i + 1]], &materials[indices[i + 2]]});
    // Adjacent triangles mostly have the same materials.
    if (!groups.empty() && palettes[groups.back()].key() == palette.key()) {
      groups.push_back(groups.back());
      continue;
    }
    const auto [found, is_new] = known.try_emplace(palette.key(), static_cast<std::uint32_t>(palettes.size()));
    if (is_new) palettes.push_back(palette);
    groups.push_back(found->second);
  }
  const std::vector<TriangleFace> alike(groups.size());
  BlockVector<AlignedVertex> aligned;
  for (const VertexCopy& copy :
       split_by_faces(indices, materials.size(), alike, {.types = false, .directions = false, .groups = groups})) {
    aligned.push_back({copy.vertex, in_palette(materials[copy.vertex], palettes[copy.look.group])});
  }
  return aligned;
}

}  // namespace quoin::smooth

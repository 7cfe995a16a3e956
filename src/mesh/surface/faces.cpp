#include "mesh/surface/faces.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include <quoin/core/assert.h>

#include "mesh/smooth/levels.h"

namespace quoin::smooth {
namespace {

/// A copy of a vertex, in the list of those of its vertex.
struct ListedCopy {
  FaceLook look;
  std::uint32_t next = 0;  // 0: none, else the place of another, plus one
};

/// The copies that each vertex needs.
class Copies {
 public:
  explicit Copies(std::size_t vertices) : first_(vertices), count_(vertices + 1) { all_.reserve(vertices); }

  /// The number, among the copies of the vertex, of that with the look.
  std::uint32_t find_or_add(std::uint32_t vertex, const FaceLook& look) {
    std::uint32_t number = 0;
    std::uint32_t* link = &first_[vertex];
    for (; *link != 0; link = &all_[*link - 1].next, ++number) {
      if (all_[*link - 1].look == look) return number;
    }
    *link = static_cast<std::uint32_t>(all_.size() + 1);
    all_.push_back({look, 0});
    ++count_[vertex + std::size_t{1}];
    return number;
  }

  /// Where the copies of each vertex begin among all.
  [[nodiscard]] std::vector<std::uint32_t> places() const {
    std::vector<std::uint32_t> places(count_.size());
    std::partial_sum(count_.begin(), count_.end(), places.begin());
    return places;
  }

  /// In the order of the vertices, those of one in the order in which they were added.
  [[nodiscard]] std::vector<VertexCopy> list() const {
    std::vector<VertexCopy> copies;
    copies.reserve(all_.size());
    for (std::uint32_t vertex = 0; vertex < first_.size(); ++vertex) {
      for (std::uint32_t at = first_[vertex]; at != 0; at = all_[at - 1].next) {
        copies.push_back({vertex, all_[at - 1].look});
      }
    }
    return copies;
  }

 private:
  std::vector<std::uint32_t> first_;  // by vertex, as ListedCopy::next
  std::vector<std::uint32_t> count_;  // by vertex plus one
  std::vector<ListedCopy> all_;
};

// The face around a crossed edge of the lattice of samples, from the cells that a triangle's vertices lie in or
// between, which are three or four of those around the edge.
TriangleFace face_around_edge(const DensityNeighbourhood& chunks, const SmoothChunkMesh& mesh,
                              const std::uint32_t* triangle) {
  IVec3 first{std::numeric_limits<int>::max()};
  IVec3 last{std::numeric_limits<int>::min()};
  for (std::size_t i = 0; i < 3; ++i) {
    const SmoothCell name = mesh.cells[triangle[i]];
    const IVec3 place = name.cell() + name.chunk_offset() * kChunkEdge;
    first = glm::min(first, place);
    last = glm::max(last, place);
    if (const int axis = name.bridge_axis(); axis >= 0) last = glm::max(last, place + unit_axis(axis));
  }
  // These cells share their extent along the edge; the last of them begins where the edge does.
  int axis = 0;
  while (axis < 2 && first[axis] != last[axis]) ++axis;
  TriangleFace face;
  face.sample = last;
  const bool is_first_solid = DensityChunk::is_solid(chunks.get(last));
  if (!is_first_solid) ++face.sample[axis];
  face.direction = static_cast<Direction>(2 * axis + (is_first_solid ? 0 : 1));
  const IVec3 chunk = chunk_of(face.sample);
  const DensityChunk* found = chunks.at(chunk.x, chunk.y, chunk.z);
  face.type = found == nullptr ? kAir : found->materials().get(local_of(face.sample));
  return face;
}

// Where cells are of several sizes: by what lies around the triangle's vertices.
TriangleFace face_of_triangle(const SmoothChunkMesh& mesh, const std::uint32_t* triangle,
                              const std::vector<CellMaterial>& materials) {
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

std::vector<CellMaterial> materials_of(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                                       const SurfaceMaterials& materials, const SmoothChunkMesh& mesh) {
  const ChunkLevels levels(options.levels);
  std::vector<CellMaterial> of_vertex;
  of_vertex.reserve(mesh.cells.size());
  for (const SmoothCell name : mesh.cells) {
    const LevelCell cell = levels.cell_of(name);
    of_vertex.push_back(materials.of_cell(chunks, cell.first / cell.size(), cell.level));
  }
  return of_vertex;
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
      faces.insert(faces.end(), 2, face_around_edge(chunks, mesh, mesh.indices.data() + i));
    }
    for (std::size_t i = quads_end; i < mesh.indices.size(); i += 3) {
      faces.push_back(face_around_edge(chunks, mesh, mesh.indices.data() + i));
    }
    return;
  }
  const std::vector<CellMaterial> of_vertex = materials_of(chunks, options, materials, mesh);
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    faces.push_back(face_of_triangle(mesh, mesh.indices.data() + i, of_vertex));
  }
}

std::vector<VertexCopy> split_by_faces(std::span<std::uint32_t> indices, std::size_t vertices,
                                       std::span<const TriangleFace> faces, const FaceDifferences& differences) {
  QUOIN_ASSERT(faces.size() == indices.size() / 3);
  Copies copies(vertices);
  std::vector<std::uint32_t> numbers(indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const TriangleFace& face = faces[i / 3];
    FaceLook look;
    if (differences.types) look.type = face.type;
    if (differences.directions) look.direction = face.direction;
    if (!differences.groups.empty()) look.group = differences.groups[i / 3];
    numbers[i] = copies.find_or_add(indices[i], look);
  }
  const std::vector<std::uint32_t> places = copies.places();
  for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = places[indices[i]] + numbers[i];
  return copies.list();
}

}  // namespace quoin::smooth

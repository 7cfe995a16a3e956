#include <quoin/mesh/smooth_mesh.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/caches.h"
#include "core/coordinates/chunk_order.h"
#include "core/work/progress_steps.h"
#include "mesh/smooth/level_cells.h"
#include "mesh/surface/face_materials.h"
#include "mesh/surface/smooth_surface.h"
#include "mesh/surface/voxel_surface.h"

namespace quoin {
namespace smooth {
namespace {

// Returns the index of a chunk in a sorted list, or the list's size if it is not in the list.
std::size_t place_in(const std::vector<IVec3>& chunks, IVec3 chunk) {
  const auto found = std::lower_bound(chunks.begin(), chunks.end(), chunk, by_zyx);
  return static_cast<std::size_t>((found != chunks.end() && *found == chunk ? found : chunks.end()) - chunks.begin());
}

// Returns `chunks` and all chunks at offsets from `first` to `last` on each axis, sorted.
std::vector<IVec3> with_neighbours(const std::vector<IVec3>& chunks, int first, int last) {
  std::vector<IVec3> all;
  for (const IVec3 chunk : chunks) {
    for (int z = first; z <= last; ++z) {
      for (int y = first; y <= last; ++y) {
        for (int x = first; x <= last; ++x) all.push_back(chunk + IVec3{x, y, z});
      }
    }
  }
  sort_and_unite(all);
  return all;
}

// The levels of detail of all meshed chunks and of their neighbours. Each level is requested once.
class LevelMap {
 public:
  Status ask(const std::vector<IVec3>& meshed, const std::function<int(IVec3)>& level_of) {
    if (!level_of) return {};
    chunks_ = with_neighbours(meshed, -1, 1);
    levels_.reserve(chunks_.size());
    for (const IVec3 chunk : chunks_) {
      const int level = level_of(chunk);
      if (level < 0 || level > kMaxSmoothLevel) {
        return make_error(ErrorCode::InvalidArgument, "level of detail " + std::to_string(level) + " of chunk " +
                                                          std::to_string(chunk.x) + ", " + std::to_string(chunk.y) +
                                                          ", " + std::to_string(chunk.z) + " is not 0 to " +
                                                          std::to_string(kMaxSmoothLevel));
      }
      levels_.push_back(static_cast<std::uint8_t>(level));
    }
    return {};
  }

  [[nodiscard]] std::array<std::uint8_t, 27> around(IVec3 chunk) const {
    std::array<std::uint8_t, 27> levels{};
    if (chunks_.empty()) return levels;
    QUOIN_ASSERT(place_in(chunks_, chunk) < chunks_.size(), "a chunk whose level was asked for");
    std::size_t i = 0;
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) levels[i++] = levels_[place_in(chunks_, chunk + IVec3{x, y, z})];
      }
    }
    return levels;
  }

 private:
  std::vector<IVec3> chunks_;  // empty: level 0 everywhere
  std::vector<std::uint8_t> levels_;
};

// A vertex that later chunks may share.
struct BorderVertex {
  std::uint32_t name;   // SmoothCell bits
  std::uint32_t place;  // index among the chunk's own vertices
};

// The contribution of one chunk to the whole mesh: the vertices of its own cells and all its triangles.
struct Part {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<float> occlusion;
  std::vector<CellMaterial> materials;
  BlockVector<VertexMaterials> mixed;  // only if requested
  std::vector<TriangleFace> faces;     // by triangle, in the chunk's coordinates; only if requested
  std::vector<BorderVertex> border;    // sorted by name
  std::vector<SmoothCell> foreign;     // vertices of chunks before this one
  std::vector<std::uint32_t> indices;  // into the own vertices, or kForeign plus an index into `foreign`
  static constexpr std::uint32_t kForeign = 0x8000'0000U;
};

// The data that a thread needs to mesh a chunk.
struct Workspace {
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  std::vector<std::uint32_t> places;  // by the mesh's vertex: as in Part::indices
};

void reserve(const SmoothChunkMesh& mesh, Part& part) {
  part.positions.reserve(mesh.positions.size());
  part.normals.reserve(mesh.normals.size());
  part.occlusion.reserve(mesh.occlusion.size());
  part.materials.reserve(mesh.positions.size());
  part.indices.resize(mesh.indices.size());
}

// `materials`: null for vertices without colours. `mixes`: with Part::mixed.
Part make_part(const DensityNeighbourhood& chunks, int level, const SurfaceMaterials* materials, bool mixes,
               Workspace& workspace) {
  const SmoothChunkMesh& mesh = workspace.mesh;
  QUOIN_ASSERT(mesh.cells.size() == mesh.positions.size() && mesh.normals.size() == mesh.positions.size(),
               "a cell and a normal per vertex");
  const int last = (kChunkEdge >> level) - 1;
  Part part;
  reserve(mesh, part);
  workspace.places.resize(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const SmoothCell name = mesh.cells[i];
    if (name.chunk_offset() != IVec3{0}) {
      workspace.places[i] = Part::kForeign | static_cast<std::uint32_t>(part.foreign.size());
      part.foreign.push_back(name);
      continue;
    }
    const auto place = static_cast<std::uint32_t>(part.positions.size());
    const IVec3 cell = name.cell();
    workspace.places[i] = place;
    part.positions.push_back(mesh.positions[i]);
    part.normals.push_back(mesh.normals[i]);
    if (!mesh.occlusion.empty()) part.occlusion.push_back(mesh.occlusion[i]);
    if (materials != nullptr) {
      if (mixes) part.mixed.emplace_back();
      part.materials.push_back(materials->of_vertex(chunks, cell * (1 << level), level, mesh.normals[i],
                                                    mixes ? &part.mixed.back() : nullptr));
    }
    if (cell.x == last || cell.y == last || cell.z == last) part.border.push_back({name.bits, place});
  }
  QUOIN_ASSERT(part.positions.size() < Part::kForeign && part.foreign.size() < Part::kForeign, "places of 31 bits");
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) part.indices[i] = workspace.places[mesh.indices[i]];
  std::sort(part.border.begin(), part.border.end(), [](BorderVertex a, BorderVertex b) { return a.name < b.name; });
  return part;
}

class Builder {
 public:
  Builder(const DensityGrid& field, const SmoothMeshOptions& options, const SurfaceRequest& request, Threads threads,
          const Progress& progress)
      : field_(field),
        options_(options),
        request_(request),
        threads_(threads),
        // A surface can end in chunks that do not exist: around edges and in cells that start before a solid sample.
        chunks_(with_neighbours(field.chunks(), -1, 0)),
        parts_(chunks_.size()),
        steps_(progress, 2 * chunks_.size()) {}

  Result<Surface> build(const VoxelRegistry& types) {
    types_ = &types;
    if (Status levels = levels_.ask(chunks_, options_.level_of); !levels) return levels.error();
    const SurfaceMaterials materials(types);
    ObjectPool<Workspace> workspaces;
    parallel_for(chunks_.size(), threads_, [&](std::size_t i) {
      if (steps_.cancelled()) return;
      workspaces.with([&](Workspace& workspace) { mesh_chunk(i, materials, workspace); });
      steps_.step();
    });
    if (steps_.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    return weld();
  }

 private:
  void mesh_chunk(std::size_t i, const SurfaceMaterials& materials, Workspace& workspace) {
    SmoothOptions options;
    options.occlusion = options_.occlusion;
    options.split_sheets = options_.split_sheets;
    options.join_diagonals = options_.keep_thin;
    options.levels = levels_.around(chunks_[i]);
    const DensityNeighbourhood neighbourhood = field_.neighbourhood(chunks_[i]);
    workspace.mesher.mesh(neighbourhood, options, workspace.mesh);
    Shape shape{smoothness_of(options_), options_.keep_thin, nullptr, types_};
    DensityNeighbourhood whole;
    if (request_.whole != nullptr) {
      whole = request_.whole->neighbourhood(chunks_[i]);
      shape.whole = &whole;
    }
    shape_vertices(neighbourhood, options, shape, workspace.mesh);
    // Sharp colours come from the faces.
    const bool is_blended = options_.colours == SurfaceColours::Blended;
    parts_[i] =
        make_part(neighbourhood, options.levels[13], is_blended ? &materials : nullptr, options_.materials, workspace);
    if (request_.with_faces) find_faces(neighbourhood, options, materials, workspace.mesh, parts_[i].faces);
  }

  Result<Surface> weld() {
    Surface surface;
    SmoothMesh& mesh = surface.mesh;
    std::size_t vertices = 0;
    std::size_t indices = 0;
    for (const Part& part : parts_) {
      first_vertex_.push_back(static_cast<std::uint32_t>(vertices));
      first_index_.push_back(indices);
      vertices += part.positions.size();
      indices += part.indices.size();
      if (vertices >= std::numeric_limits<std::uint32_t>::max()) {
        return make_error(ErrorCode::LimitExceeded, "the mesh needs more than 2^32 - 2 vertices");
      }
    }
    mesh.positions.resize(vertices);
    mesh.normals.resize(vertices);
    if (options_.occlusion.method != SmoothOcclusion::None) mesh.occlusion.resize(vertices);
    mesh.albedo.resize(vertices);
    mesh.types.resize(vertices);
    if (options_.materials) mesh.materials.resize(vertices);
    mesh.indices.resize(indices);
    if (request_.with_faces) surface.faces.resize(indices / 3);
    parallel_for(chunks_.size(), threads_, [&](std::size_t i) {
      if (steps_.cancelled()) return;
      copy_vertices(i, mesh);
      copy_indices(i, mesh);
      copy_faces(i, surface.faces);
      steps_.step();
    });
    if (steps_.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    return surface;
  }

  void copy_vertices(std::size_t i, SmoothMesh& mesh) const {
    const Part& part = parts_[i];
    const DVec3 origin = DVec3(chunks_[i]) * static_cast<double>(kChunkEdge);
    const std::uint32_t first = first_vertex_[i];
    for (std::size_t v = 0; v < part.positions.size(); ++v) {
      mesh.positions[first + v] = Vec3(DVec3(part.positions[v]) + origin);
      if (part.materials.empty()) continue;
      mesh.albedo[first + v] = part.materials[v].albedo;
      mesh.types[first + v] = part.materials[v].type;
    }
    std::copy(part.normals.begin(), part.normals.end(), mesh.normals.begin() + first);
    if (!part.mixed.empty()) std::copy(part.mixed.begin(), part.mixed.end(), mesh.materials.begin() + first);
    std::copy(part.occlusion.begin(), part.occlusion.end(), mesh.occlusion.begin() + first);
  }

  void copy_indices(std::size_t i, SmoothMesh& mesh) const {
    const Part& part = parts_[i];
    std::vector<std::uint32_t> foreign(part.foreign.size());
    for (std::size_t f = 0; f < foreign.size(); ++f) foreign[f] = vertex_of(chunks_[i], part.foreign[f]);
    std::uint32_t* out = mesh.indices.data() + first_index_[i];
    for (const std::uint32_t index : part.indices) {
      *out++ = (index & Part::kForeign) != 0 ? foreign[index & ~Part::kForeign] : first_vertex_[i] + index;
    }
  }

  void copy_faces(std::size_t i, std::vector<TriangleFace>& faces) const {
    QUOIN_ASSERT(faces.empty() || parts_[i].faces.size() == parts_[i].indices.size() / 3, "a face per triangle");
    const IVec3 origin = chunks_[i] * kChunkEdge;
    TriangleFace* out = faces.data() + first_index_[i] / 3;
    for (TriangleFace face : parts_[i].faces) {
      face.sample += origin;
      *out++ = face;
    }
  }

  // Returns the vertex of the whole mesh for a vertex name of `chunk`. The border of a meshed chunk contains every cell
  // with a vertex.
  [[nodiscard]] std::uint32_t vertex_of(IVec3 chunk, SmoothCell name) const {
    const std::size_t owner = place_in(chunks_, chunk + name.chunk_offset());
    QUOIN_ASSERT(owner < chunks_.size());
    const std::vector<BorderVertex>& border = parts_[owner].border;
    const std::uint32_t own_name = name.bits & ~(7U << SmoothCell::kPreviousShift);
    const auto found = std::lower_bound(border.begin(), border.end(), own_name,
                                        [](BorderVertex vertex, std::uint32_t value) { return vertex.name < value; });
    QUOIN_ASSERT(found != border.end() && found->name == own_name);
    return first_vertex_[owner] + found->place;
  }

  const DensityGrid& field_;
  const SmoothMeshOptions& options_;
  const SurfaceRequest& request_;
  const VoxelRegistry* types_ = nullptr;
  Threads threads_;
  std::vector<IVec3> chunks_;
  LevelMap levels_;
  std::vector<Part> parts_;  // by chunk
  std::vector<std::uint32_t> first_vertex_;
  std::vector<std::size_t> first_index_;
  ProgressSteps steps_;
};

}  // namespace

float smoothness_of(const SmoothMeshOptions& options) {
  return std::isnan(options.smoothness) ? 1.0F : std::clamp(options.smoothness, 0.0F, 1.0F);
}

Result<Surface> build_surface(const DensityGrid& field, const VoxelRegistry& types, const SmoothMeshOptions& options,
                              const SurfaceRequest& request, Threads threads, const Progress& progress) {
  return Builder(field, options, request, threads, progress).build(types);
}

namespace {

/// Interpolates between a face's normal and the surface's. Returns the face's normal if they cancel out.
Vec3 normal_between(Direction direction, Vec3 normal, float smoothness) {
  const Vec3 flat(normal_of(direction));
  const Vec3 sum = flat * (1.0F - smoothness) + normal * smoothness;
  const float length = glm::length(sum);
  return length > 1e-6F ? sum / length : flat;
}

}  // namespace

std::uint32_t append_vertex(SmoothMesh& to, const SmoothMesh& from, std::size_t i) {
  QUOIN_ASSERT(i < from.positions.size(), "a vertex of the mesh");
  const auto index = static_cast<std::uint32_t>(to.positions.size());
  const auto append = [i](auto& values, const auto& source) {
    const auto value = source[i];
    values.push_back(value);
  };
  append(to.positions, from.positions);
  append(to.normals, from.normals);
  if (!from.occlusion.empty()) append(to.occlusion, from.occlusion);
  append(to.albedo, from.albedo);
  append(to.types, from.types);
  if (!from.materials.empty()) append(to.materials, from.materials);
  return index;
}

std::vector<std::uint32_t> finish_surface(Surface& surface, const VoxelRegistry& types,
                                          const SmoothMeshOptions& options, std::span<const std::uint32_t> groups) {
  const bool is_sharp = options.colours == SurfaceColours::Sharp;
  const float smoothness = smoothness_of(options);
  if (!is_sharp && smoothness == 1.0F && groups.empty()) return {};
  const SurfaceMaterials materials(types);
  SmoothMesh& whole = surface.mesh;
  SmoothMesh split;
  const BlockVector<VertexCopy> copies =
      split_by_faces(whole.indices, whole.positions.size(), surface.faces, {is_sharp, smoothness < 1.0F, groups});
  split.indices = std::move(whole.indices);
  split.positions.reserve(copies.size());
  split.normals.reserve(copies.size());
  split.albedo.reserve(copies.size());
  split.types.reserve(copies.size());
  std::vector<std::uint32_t> group_of;
  for (const VertexCopy& copy : copies) {
    append_vertex(split, whole, copy.vertex);
    Vec3& normal = split.normals.back();
    if (smoothness < 1.0F) normal = normal_between(copy.look.direction, normal, smoothness);
    if (is_sharp) {
      split.albedo.back() = materials.albedo(copy.look.type);
      split.types.back() = copy.look.type;
      if (options.materials) split.materials.back() = only_material(copy.look.type);
    }
    if (!groups.empty()) group_of.push_back(copy.look.group);
  }
  whole = std::move(split);
  return group_of;
}

}  // namespace smooth

void align_materials(SmoothMesh& mesh) {
  if (mesh.materials.empty()) return;
  QUOIN_ASSERT(mesh.materials.size() == mesh.positions.size(), "materials of each vertex");
  SmoothMesh aligned;
  aligned.indices = mesh.indices;
  const BlockVector<smooth::AlignedVertex> copies = smooth::align_materials(aligned.indices, mesh.materials);
  aligned.positions.reserve(copies.size());
  aligned.normals.reserve(copies.size());
  aligned.albedo.reserve(copies.size());
  aligned.types.reserve(copies.size());
  aligned.materials.reserve(copies.size());
  for (const smooth::AlignedVertex& copy : copies) {
    smooth::append_vertex(aligned, mesh, copy.vertex);
    aligned.materials.back() = copy.materials;
  }
  mesh = std::move(aligned);
}

Result<SmoothMesh> build_smooth_mesh(const DensityGrid& field, const VoxelRegistry& types,
                                     const SmoothMeshOptions& options, Threads threads, const Progress& progress) {
  smooth::SurfaceRequest request;
  request.with_faces = options.colours == SurfaceColours::Sharp || smooth::smoothness_of(options) < 1.0F;
  auto surface = smooth::build_surface(field, types, options, request, threads, progress);
  if (!surface) return surface.error();
  smooth::finish_surface(*surface, types, options);
  return std::move(surface->mesh);
}

}  // namespace quoin

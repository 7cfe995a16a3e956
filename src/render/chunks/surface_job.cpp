#include "render/chunks/surface_job.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/rows/packed_row.h"
#include "mesh/surface/face_materials.h"
#include "mesh/surface/voxel_surface.h"

namespace quoin {
namespace {

template <class T>
void append(const Buffer<T>& from, Buffer<T>& to) {
  const std::size_t first = to.size();
  to.resize(first + from.size());
  std::copy(from.begin(), from.end(), to.begin() + first);
}

// Bounds along one axis of a quad of `size` voxels from `first` on, cut at multiples of `edge`.
template <class Visit>
void cut(int first, int size, int edge, Visit&& visit) {
  QUOIN_ASSERT(first >= 0 && size > 0 && edge > 0, "voxels from 0 on, and regions with an edge");
  for (int at = first; at < first + size;) {
    const int end = std::min(first + size, (at / edge + 1) * edge);
    visit(at, end - at);
    at = end;
  }
}

// Four chains at a time: each waits only for its own last product.
void mix_into(std::array<std::uint64_t, 4>& lanes, std::span<const Quad> quads) {
  std::size_t i = 0;
  for (; i + 4 <= quads.size(); i += 4) {
    for (std::size_t k = 0; k < 4; ++k) lanes[k] = mixed_with(lanes[k], quads[i + k].bits);
  }
  for (std::size_t k = 0; i < quads.size(); ++i, ++k) lanes[k] = mixed_with(lanes[k], quads[i].bits);
}

void mix_into(std::array<std::uint64_t, 4>& lanes, std::span<const FaceLight> light) {
  for (const FaceLight& corners : light) {
    for (std::size_t k = 0; k < 4; ++k) lanes[k] = mixed_with(lanes[k], corners[k]);
  }
}

void mix_into(std::array<std::uint64_t, 4>& lanes, std::span<const ShapeFace> faces) {
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const ShapeFace& face = faces[i];
    std::uint64_t& model = lanes[i % 2];
    std::uint64_t& place = lanes[2 + i % 2];
    model = mixed_with(model, face.model->hash);
    place = mixed_with(place, std::uint64_t{face.bits} << 32 | std::uint64_t{face.face} << 16 | face.type);
  }
}

// Returns the hash of a region, by its index in the surface.
std::uint64_t hash_of(std::size_t index, const ChunkSurface& surface) {
  const SurfaceRegion& region = surface.regions[index];
  const std::span<const Quad> quads(surface.quads.begin(), surface.quads.size());
  const std::span<const FaceLight> light(surface.light);
  std::array<std::uint64_t, 4> lanes = {1, 2, 3, 4};
  for (const auto& range : {region.opaque, region.transparent}) {
    QUOIN_ASSERT(range[0] <= range[6] && range[6] <= quads.size(), "quads of the surface");
    const std::uint32_t count = range[6] - range[0];
    lanes[0] = mixed_with(lanes[0], count);
    mix_into(lanes, quads.subspan(range[0], count));
    if (!light.empty()) mix_into(lanes, light.subspan(range[0], count));
  }
  if (!surface.shapes.empty()) {
    const RegionShapes& shapes = surface.region_shapes[index];
    for (const auto& [first, end] : {shapes.opaque, shapes.transparent}) {
      QUOIN_ASSERT(first <= end && end <= surface.shapes.size(), "faces of the surface");
      const std::uint32_t count = end - first;
      lanes[0] = mixed_with(lanes[0], count);
      mix_into(lanes, std::span(surface.shapes).subspan(first, count));
      if (!surface.shape_light.empty()) mix_into(lanes, std::span(surface.shape_light).subspan(first, count));
    }
  }
  std::uint64_t hash = kHashSeed;
  for (const std::uint64_t lane : lanes) hash = mixed_with(hash, lane);
  return hash;
}

// Returns the start of each direction's quads, beginning at `first`, and the end of all. Quads are sorted by direction.
std::array<std::uint32_t, 7> directions_of(const QuadBuffer& quads, std::size_t first, std::size_t end) {
  QUOIN_ASSERT(first <= end && end <= quads.size(), "quads of the buffer");
  std::array<std::uint32_t, 7> range{};
  auto at = quads.begin() + static_cast<std::ptrdiff_t>(first);
  const auto last = quads.begin() + static_cast<std::ptrdiff_t>(end);
  for (std::size_t i = 0; i < 6; ++i) {
    range[i] = static_cast<std::uint32_t>(at - quads.begin());
    at = std::partition_point(at, last, [&](Quad quad) { return static_cast<std::size_t>(quad.direction()) <= i; });
  }
  range[6] = static_cast<std::uint32_t>(end);
  return range;
}

// The quads of a chunk and the faces of its shapes, with their light if any.
struct LitFaces {
  const QuadBuffer& quads;
  std::span<const FaceLight> light;
  const ShapeFaceBuffer& shapes;
  std::span<const FaceLight> shape_light;
};

// Returns the number of a voxel's region.
std::size_t region_of(IVec3 voxel, int edge) {
  const int across = kChunkEdge / edge;
  const IVec3 at = voxel / edge;
  return static_cast<std::size_t>(at.x + across * (at.y + across * at.z));
}

std::size_t region_count(int edge) {
  const auto across = static_cast<std::size_t>(kChunkEdge / edge);
  return across * across * across;
}

// The places of faces of shapes in a surface: those of opaque material by region, then the others by region.
class ShapePlaces {
 public:
  // Takes memory only if there are faces.
  ShapePlaces(const ShapeFaceBuffer& faces, const VoxelRegistry& types, int edge)
      : types_(types), edge_(edge), regions_(region_count(edge)) {
    if (faces.empty()) return;
    first_.resize(2 * regions_ + 1);
    for (const ShapeFace& face : faces) ++first_[place_of(face) + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  }

  [[nodiscard]] bool empty() const { return first_.empty(); }
  [[nodiscard]] std::uint32_t opaque_count() const { return first_[regions_]; }
  // Requires: not empty.
  [[nodiscard]] RegionShapes of(std::size_t region) const {
    const std::size_t transparent = regions_ + region;
    return {{first_[region], first_[region + 1]}, {first_[transparent], first_[transparent + 1]}};
  }
  [[nodiscard]] bool has_any(std::size_t region) const {
    if (empty()) return false;
    const RegionShapes shapes = of(region);
    return shapes.opaque[0] != shapes.opaque[1] || shapes.transparent[0] != shapes.transparent[1];
  }
  // Returns the place of the next face. Call it once for each face, in order, and `of` no more.
  [[nodiscard]] std::uint32_t take(const ShapeFace& face) { return first_[place_of(face)]++; }

 private:
  [[nodiscard]] std::size_t place_of(const ShapeFace& face) const {
    const bool is_transparent = types_[face.type].visibility == Visibility::Transparent;
    return (is_transparent ? regions_ : 0) + region_of(face.voxel(), edge_);
  }

  const VoxelRegistry& types_;
  int edge_;
  std::size_t regions_;
  std::vector<std::uint32_t> first_;  // and the end of all
};

// Sets all parts of the surface that belong to shapes. Requires: its regions are set.
void put_shapes(const LitFaces& lit, const VoxelRegistry& types, int edge, ShapePlaces& places, ChunkSurface& surface) {
  if (places.empty()) return;
  surface.opaque_shapes = places.opaque_count();
  surface.region_shapes.reserve(surface.regions.size());
  for (const SurfaceRegion& region : surface.regions) {
    surface.region_shapes.push_back(places.of(region_of(region.region * edge, edge)));
  }
  surface.shapes.resize(lit.shapes.size());
  surface.shape_light.resize(lit.shape_light.size());
  std::vector<bool> is_kept(types.size());
  for (std::size_t i = 0; i < lit.shapes.size(); ++i) {
    const ShapeFace& face = lit.shapes[i];
    const std::uint32_t place = places.take(face);
    surface.shapes[place] = face;
    if (!lit.shape_light.empty()) surface.shape_light[place] = lit.shape_light[i];
    if (is_kept[face.type]) continue;
    is_kept[face.type] = true;
    surface.shapes_of_types.push_back(types[face.type].shapes);
  }
}

// Sorts the quads, opaque types first.
void sort_into_one(const LitFaces& lit, const VoxelRegistry& types, ChunkSurface& surface) {
  const QuadBuffer& quads = lit.quads;
  surface.quads.resize(quads.size());
  surface.light.resize(lit.light.size());
  std::size_t opaque = quads.size();
  if (types.has_transparent()) {
    // Places transparent quads from the end backwards, then reverses them. Branchless, because the branch is
    // unpredictable.
    opaque = 0;
    std::size_t end = quads.size();
    for (std::size_t i = 0; i < quads.size(); ++i) {
      const bool is_transparent = types.is_transparent(quads[i].type());
      const std::size_t place = is_transparent ? end - 1 : opaque;
      surface.quads[place] = quads[i];
      if (!lit.light.empty()) surface.light[place] = lit.light[i];
      opaque += is_transparent ? 0 : 1;
      end -= is_transparent ? 1 : 0;
    }
    QUOIN_ASSERT(opaque == end, "each quad has one place");
    const auto first = static_cast<std::ptrdiff_t>(opaque);
    std::reverse(surface.quads.begin() + first, surface.quads.end());
    if (!lit.light.empty()) std::reverse(surface.light.begin() + first, surface.light.end());
  } else {
    std::copy(quads.begin(), quads.end(), surface.quads.begin());
    std::ranges::copy(lit.light, surface.light.begin());
  }
  surface.opaque_quads = opaque;
  surface.regions.push_back(
      {IVec3{0}, directions_of(surface.quads, 0, opaque), directions_of(surface.quads, opaque, quads.size()), 0});
}

void sort_into_many(const LitFaces& lit, const VoxelRegistry& types, int edge, const ShapePlaces& shapes,
                    ChunkSurface& surface) {
  const QuadBuffer& quads = lit.quads;
  const int across = kChunkEdge / edge;
  const std::size_t regions = region_count(edge);
  const auto place_of = [&](Quad quad) {
    const std::size_t which = types.is_transparent(quad.type()) ? regions : 0;
    return 6 * (which + region_of(quad.voxel(), edge)) + static_cast<std::size_t>(quad.direction());
  };
  std::vector<std::uint32_t> first(12 * regions + 1);
  for (const Quad quad : quads) ++first[place_of(quad) + 1];
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  QUOIN_ASSERT(first.back() == quads.size(), "each quad has one place");
  for (std::size_t i = 0; i < regions; ++i) {
    const auto opaque = first.begin() + static_cast<std::ptrdiff_t>(6 * i);
    const auto transparent = opaque + static_cast<std::ptrdiff_t>(6 * regions);
    if (opaque[0] == opaque[6] && transparent[0] == transparent[6] && !shapes.has_any(i)) continue;
    const auto number = static_cast<int>(i);
    SurfaceRegion region{{number % across, number / across % across, number / across / across}, {}, {}};
    std::copy_n(opaque, 7, region.opaque.begin());
    std::copy_n(transparent, 7, region.transparent.begin());
    surface.regions.push_back(region);
  }
  surface.opaque_quads = first[6 * regions];
  surface.quads.resize(quads.size());
  surface.light.resize(lit.light.size());
  for (std::size_t i = 0; i < quads.size(); ++i) {
    const std::uint32_t place = first[place_of(quads[i])]++;
    surface.quads[place] = quads[i];
    if (!lit.light.empty()) surface.light[place] = lit.light[i];
  }
}

// Sets the faces of the surface, in the order of ChunkSurface.
void sort_into_regions(const LitFaces& lit, const VoxelRegistry& types, int edge, ChunkSurface& surface) {
  QUOIN_ASSERT(lit.light.empty() || lit.light.size() == lit.quads.size(), "the light of each quad, or none");
  QUOIN_ASSERT(lit.shape_light.empty() || lit.shape_light.size() == lit.shapes.size(),
               "the light of each face of shapes, or none");
  ShapePlaces shapes(lit.shapes, types, edge);
  if (edge == kChunkEdge) {
    sort_into_one(lit, types, surface);
  } else {
    sort_into_many(lit, types, edge, shapes, surface);
  }
  put_shapes(lit, types, edge, shapes, surface);
  for (std::size_t i = 0; i < surface.regions.size(); ++i) surface.regions[i].hash = hash_of(i, surface);
}

// Splits quads whose faces differ in light, and lights the faces of shapes in the workspace.
LitFaces lit_by(const SurfaceJob& job, const QuadBuffer& quads, LightMerging merging, SurfaceWorkspace& workspace) {
  QUOIN_ASSERT(job.light != nullptr && job.types != nullptr, "a job with light and types");
  if (workspace.lit != job.light || workspace.lit_types != job.types) {
    workspace.surface_light.reset();
    workspace.lit = job.light;
    workspace.lit_types = job.types;
    workspace.surface_light.emplace(job.light->light, job.light->voxels, *job.types);
  }
  workspace.surface_light->split(quads, job.chunk, merging, workspace.lit_quads, workspace.face_light);
  workspace.surface_light->read(workspace.shapes, job.chunk, workspace.shape_light);
  return {workspace.lit_quads, workspace.face_light, workspace.shapes, workspace.shape_light};
}

// Splits quads that cross the border of a region. Merged faces are all alike, so the parts have the same faces.
void cut_at_regions(const QuadBuffer& quads, int edge, QuadBuffer& out) {
  out.clear();
  for (const Quad quad : quads) {
    const FaceFrame& frame = frame_of(quad.direction());
    cut(quad.voxel()[frame.u], quad.size_u(), edge, [&](int u, int size_u) {
      cut(quad.voxel()[frame.v], quad.size_v(), edge, [&](int v, int size_v) {
        out.push_back(quad_part(quad, u - quad.voxel()[frame.u], v - quad.voxel()[frame.v], size_u, size_v));
      });
    });
  }
}

void make_blocky(const ChunkSurfaceOptions& options, SurfaceJob& job, SurfaceWorkspace& workspace) {
  QUOIN_ASSERT(job.voxels != nullptr, "a job with voxels");
  if (!workspace.blocky) workspace.blocky.emplace();
  QuadOptions wanted;
  wanted.merge = options.merge;
  wanted.shapes = options.shapes;
  const VoxelRegistry& types = *job.types;
  workspace.blocky->mesh(job.voxels->neighbourhood(job.chunk), types, wanted, workspace.quads, workspace.shapes);
  if (workspace.quads.empty() && workspace.shapes.empty()) return;
  auto surface = std::make_shared<ChunkSurface>();
  surface->style = SurfaceStyle::Blocky;
  const bool is_cut = options.region_edge < kChunkEdge;
  if (is_cut) cut_at_regions(workspace.quads, options.region_edge, workspace.cut_quads);
  const QuadBuffer& quads = is_cut ? workspace.cut_quads : workspace.quads;
  const bool is_lit = job.light != nullptr;
  const LitFaces lit =
      is_lit ? lit_by(job, quads, options.light_merging, workspace) : LitFaces{quads, {}, workspace.shapes, {}};
  sort_into_regions(lit, types, options.region_edge, *surface);
  job.surface = std::move(surface);
}

// Appends its triangles and vertices.
void append(const SmoothChunkMesh& from, SmoothChunkMesh& to) {
  const auto first = static_cast<std::uint32_t>(to.positions.size());
  const std::size_t begin = to.indices.size();
  append(from.positions, to.positions);
  append(from.normals, to.normals);
  append(from.occlusion, to.occlusion);
  append(from.cells, to.cells);
  append(from.indices, to.indices);
  for (std::size_t i = begin; i < to.indices.size(); ++i) to.indices[i] += first;
}

// Replaces the mesh's vertices by copies, and keeps its indices. `vertex_of(copy)` is the vertex that it copies.
template <class Copies, class VertexOf>
void copy_vertices(const Copies& copies, const VertexOf& vertex_of, SmoothChunkMesh& mesh) {
  SmoothChunkMesh split;
  split.positions.resize(copies.size());
  split.normals.resize(copies.size());
  if (!mesh.occlusion.empty()) split.occlusion.resize(copies.size());
  split.cells.resize(copies.size());
  for (std::size_t i = 0; i < copies.size(); ++i) {
    const std::uint32_t vertex = vertex_of(copies[i]);
    split.positions[i] = mesh.positions[vertex];
    split.normals[i] = mesh.normals[vertex];
    if (!mesh.occlusion.empty()) split.occlusion[i] = mesh.occlusion[vertex];
    split.cells[i] = mesh.cells[vertex];
  }
  std::swap(split.indices, mesh.indices);
  mesh = std::move(split);
}

// Gives each face the colour of its sample.
void append_by_faces(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                     const SurfaceMaterials& materials, SmoothChunkMesh& mesh, ChunkSurface& surface) {
  std::vector<smooth::TriangleFace> faces;
  smooth::find_faces(chunks, options, materials, mesh, faces);
  const BlockVector<smooth::VertexCopy> copies =
      smooth::split_by_faces({mesh.indices.begin(), mesh.indices.end()}, mesh.positions.size(), faces,
                             {.types = true, .directions = false, .groups = {}});
  surface.albedo.reserve(surface.albedo.size() + copies.size());
  surface.types.reserve(surface.types.size() + copies.size());
  for (const smooth::VertexCopy& copy : copies) {
    surface.albedo.push_back(materials.albedo(copy.look.type));
    surface.types.push_back(copy.look.type);
  }
  copy_vertices(
      copies, [](const smooth::VertexCopy& copy) { return copy.vertex; }, mesh);
  append(mesh, surface.smooth);
}

// Aligns the vertices' materials if any of them has textures; the other vertices of the surface have one material.
void append_with_textures(const SurfaceMaterials& materials, const BlockVector<CellMaterial>& of_vertex,
                          const BlockVector<VertexMaterials>& mixed, SmoothChunkMesh& mesh, ChunkSurface& surface) {
  const bool has_textures = std::any_of(mixed.begin(), mixed.end(),
                                        [&](const VertexMaterials& each) { return materials.has_textures(each); });
  if (!has_textures && surface.materials.empty()) {
    for (const CellMaterial& material : of_vertex) {
      surface.albedo.push_back(material.albedo);
      surface.types.push_back(material.type);
    }
    return append(mesh, surface.smooth);
  }
  for (std::size_t i = surface.materials.size(); i < surface.types.size(); ++i) {
    surface.materials.push_back(only_material(surface.types[i]));
  }
  const BlockVector<smooth::AlignedVertex> copies =
      smooth::align_materials({mesh.indices.begin(), mesh.indices.end()}, mixed);
  for (const smooth::AlignedVertex& copy : copies) {
    surface.albedo.push_back(of_vertex[copy.vertex].albedo);
    surface.types.push_back(of_vertex[copy.vertex].type);
    surface.materials.push_back(copy.materials);
  }
  copy_vertices(
      copies, [](const smooth::AlignedVertex& copy) { return copy.vertex; }, mesh);
  append(mesh, surface.smooth);
}

bool reads_as_before(const SurfaceJob& job, int reach) {
  if (!job.last_stamps.has_value()) return false;
  for (int i = 0; i < 27; ++i) {
    const auto& density = job.densities[static_cast<std::size_t>(i)];
    const std::uint64_t last = (*job.last_stamps)[static_cast<std::size_t>(i)];
    // The offset as seen from that chunk.
    const IVec3 offset = -Neighbourhood::offset(i);
    if (density == nullptr ? last != 0 : !density->reads_as(last, reach, offset)) return false;
  }
  return true;
}

// Computes first the densities that no other worker computes. The remaining ones are then finished or nearly so.
DensityNeighbourhood make_densities(const VoxelDensities& densities) {
  DensityNeighbourhood chunks;
  for (const auto& density : densities) {
    if (density != nullptr) density->try_to_make();
  }
  for (std::size_t i = 0; i < 27; ++i) {
    if (densities[i] == nullptr) continue;
    densities[i]->make();
    chunks.chunks[i] = densities[i]->densities();
  }
  return chunks;
}

// Adds the surface of one body. `whole`: as in smooth::Shape.
void mesh_body(const ChunkSurfaceOptions& options, const DensityNeighbourhood& chunks,
               const DensityNeighbourhood* whole, const SurfaceJob& job, SurfaceWorkspace& workspace,
               ChunkSurface& surface) {
  QUOIN_ASSERT(job.materials != nullptr, "a job with materials");
  if (!workspace.smooth) workspace.smooth.emplace();
  SmoothOptions wanted;
  wanted.occlusion = options.occlusion;
  wanted.split_sheets = true;
  wanted.levels = job.levels;
  const bool is_of_voxels = job.source.content == SurfaceContent::Voxels;
  wanted.join_diagonals = is_of_voxels;
  workspace.smooth->mesh(chunks, wanted, workspace.mesh);
  if (workspace.mesh.indices.empty()) return;
  if (is_of_voxels) {
    smooth::Shape shape{1.0F, true, whole, job.types.get()};
    smooth::shape_vertices(chunks, wanted, shape, workspace.mesh);
  }
  if (is_of_voxels && options.colours == SurfaceColours::Sharp) {
    append_by_faces(chunks, wanted, *job.materials, workspace.mesh, surface);
    return;
  }
  BlockVector<VertexMaterials> mixed;
  const bool has_textures = !is_of_voxels && job.materials->has_textures();
  const BlockVector<CellMaterial> of_vertex =
      smooth::materials_of(chunks, wanted, *job.materials, workspace.mesh, has_textures ? &mixed : nullptr);
  append_with_textures(*job.materials, of_vertex, mixed, workspace.mesh, surface);
}

void finish(std::shared_ptr<ChunkSurface> surface, SurfaceJob& job) {
  if (surface->smooth.indices.empty()) return;
  QUOIN_ASSERT(surface->albedo.size() == surface->smooth.positions.size() &&
                   surface->types.size() == surface->smooth.positions.size(),
               "a colour and a type for each vertex");
  QUOIN_ASSERT(surface->materials.empty() || surface->materials.size() == surface->smooth.positions.size(),
               "materials of each vertex, or of none");
  QUOIN_ASSERT(surface->glass_indices <= surface->smooth.indices.size(), "indices of the surface");
  surface->style = SurfaceStyle::Smooth;
  surface->level = job.levels[13];
  job.surface = std::move(surface);
}

// The bodies whose faces a chunk may own, sorted; `are_several`: a cell may contain several bodies.
struct BodiesAround {
  std::vector<std::uint32_t> own;
  bool are_several = false;
};

BodiesAround bodies_around(const DensityNeighbourhood& chunks, const VoxelRegistry& types, SurfaceContent content) {
  if (!types.has_transparent()) return {{0}, false};
  std::vector<VoxelType> own;
  std::vector<VoxelType> all;
  for (int i = 0; i < 27; ++i) {
    const DensityChunk* chunk = chunks.chunks[static_cast<std::size_t>(i)];
    if (chunk == nullptr) continue;
    const std::vector<VoxelType> materials = chunk->materials().types();
    all.insert(all.end(), materials.begin(), materials.end());
    const IVec3 offset = Neighbourhood::offset(i);
    if (offset.x >= 0 && offset.y >= 0 && offset.z >= 0) own.insert(own.end(), materials.begin(), materials.end());
  }
  BodiesAround bodies{smooth::bodies_of(types, own), false};
  std::vector<std::uint32_t> all_bodies = smooth::bodies_of(types, all);
  // Field solid without a material is opaque.
  if (content == SurfaceContent::Field) {
    for (std::vector<std::uint32_t>* each : {&bodies.own, &all_bodies}) {
      if (each->empty() || each->front() != 0) each->insert(each->begin(), 0);
    }
  }
  bodies.are_several = all_bodies.size() > 1;
  return bodies;
}

// `chunk_of(i, body)` returns the body's densities in the i-th chunk of the neighbourhood.
template <class ChunkOf>
void make_bodies(const ChunkSurfaceOptions& options, const DensityNeighbourhood& whole, SurfaceJob& job,
                 SurfaceWorkspace& workspace, const ChunkOf& chunk_of) {
  auto surface = std::make_shared<ChunkSurface>();
  const BodiesAround bodies = bodies_around(whole, *job.types, job.source.content);
  for (const std::uint32_t body : bodies.own) {
    const std::size_t before = surface->smooth.indices.size();
    if (bodies.are_several) {
      DensityNeighbourhood chunks = whole;
      std::array<std::shared_ptr<const DensityChunk>, 27> held;
      for (std::size_t i = 0; i < 27; ++i) {
        if (whole.chunks[i] != nullptr) held[i] = chunk_of(i, body);
        chunks.chunks[i] = held[i].get();
      }
      mesh_body(options, chunks, &whole, job, workspace, *surface);
    } else {
      mesh_body(options, whole, nullptr, job, workspace, *surface);
    }
    if (body != 0) surface->glass_indices += surface->smooth.indices.size() - before;
  }
  finish(std::move(surface), job);
}

void make_smooth(const ChunkSurfaceOptions& options, SurfaceJob& job, SurfaceWorkspace& workspace) {
  const DensityNeighbourhood chunks = make_densities(job.densities);
  if (reads_as_before(job, reach_of(options.occlusion))) {
    job.outcome = SurfaceJob::Outcome::AsBefore;
    return;
  }
  make_bodies(options, chunks, job, workspace, [&](std::size_t i, std::uint32_t body) {
    return job.densities[i]->bodies().of(chunks.chunks[i], *job.types, body);
  });
}

// Fields have no `last_stamps`: chunks with unchanged densities are not meshed.
void make_field(const ChunkSurfaceOptions& options, SurfaceJob& job, SurfaceWorkspace& workspace) {
  QUOIN_ASSERT(job.field != nullptr, "a job with a field");
  const DensityNeighbourhood chunks = job.field->neighbourhood(job.chunk);
  make_bodies(options, chunks, job, workspace, [&](std::size_t i, std::uint32_t body) {
    const IVec3 at = job.chunk + Neighbourhood::offset(static_cast<int>(i));
    QUOIN_ASSERT(job.bodies != nullptr, "a job with the bodies of the field");
    return job.bodies->at(at)->of(chunks.chunks[i], *job.types, body);
  });
}

}  // namespace

void make_chunk_surface(const ChunkSurfaceOptions& options, SurfaceJob& job, SurfaceWorkspace& workspace) {
  QUOIN_ASSERT(job.types != nullptr, "a job with types");
  job.outcome = SurfaceJob::Outcome::Meshed;
  if (job.source.content == SurfaceContent::Field) {
    make_field(options, job, workspace);
  } else if (options.style == SurfaceStyle::Blocky) {
    make_blocky(options, job, workspace);
  } else {
    make_smooth(options, job, workspace);
  }
}

SurfaceContext surface_context(const SurfaceJob& job, SurfaceWorkspace& workspace) {
  QUOIN_ASSERT(job.surface != nullptr && job.types != nullptr, "a job with a surface");
  SurfaceContext context;
  context.chunk = job.chunk;
  context.types = job.types.get();
  context.levels = job.levels;
  if (job.source.content == SurfaceContent::Field) {
    context.densities = job.field->neighbourhood(job.chunk);
    return context;
  }
  QUOIN_ASSERT(job.voxels != nullptr, "a job with voxels");
  context.voxels = job.voxels->neighbourhood(job.chunk);
  if (job.surface->style == SurfaceStyle::Smooth) {
    context.densities = make_densities(job.densities);
  } else if (job.light != nullptr) {
    QUOIN_ASSERT(workspace.lit == job.light && workspace.surface_light, "the light of the surface");
    context.light = &job.light->light;
    context.corners = &*workspace.surface_light;
  }
  return context;
}

void SurfaceContext::material_weights(const ChunkSurface& surface, std::size_t vertex,
                                      std::vector<MaterialWeight>& out) const {
  QUOIN_ASSERT(surface.style == SurfaceStyle::Smooth && vertex < surface.types.size(), "a vertex of a smooth surface");
  out.clear();
  std::vector<VoxelType> materials;
  const VoxelType most = surface.types[vertex];
  if (!types->is_transparent(most)) {
    smooth::append_opaque_materials(densities, *types, levels, surface.smooth.cells[vertex], materials);
  }
  if (materials.empty()) return out.push_back({most, 1.0F});
  std::sort(materials.begin(), materials.end());
  const float share = 1.0F / static_cast<float>(materials.size());
  for (auto first = materials.begin(); first != materials.end();) {
    const auto end = std::upper_bound(first, materials.end(), *first);
    out.push_back({*first, static_cast<float>(end - first) * share});
    first = end;
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const MaterialWeight& a, const MaterialWeight& b) { return a.weight > b.weight; });
}

std::int64_t ChunkSurface::triangles() const {
  const auto single = std::ranges::count_if(shapes, [](const ShapeFace& face) { return face.is_triangle(); });
  return 2 * static_cast<std::int64_t>(quads.size() + shapes.size()) - static_cast<std::int64_t>(single) +
         static_cast<std::int64_t>(smooth.indices.size() / 3);
}

std::size_t ChunkSurface::bytes() const {
  return sizeof(ChunkSurface) + quads.capacity() * sizeof(Quad) + smooth.positions.capacity() * sizeof(Vec3) +
         smooth.normals.capacity() * sizeof(Vec3) + smooth.occlusion.capacity() * sizeof(float) +
         smooth.cells.capacity() * sizeof(SmoothCell) + smooth.indices.capacity() * sizeof(std::uint32_t) +
         albedo.capacity() * sizeof(LinearRgba16) + types.capacity() * sizeof(VoxelType) +
         materials.capacity() * sizeof(VertexMaterials) + regions.capacity() * sizeof(SurfaceRegion) +
         light.capacity() * sizeof(FaceLight) + shapes.capacity() * sizeof(ShapeFace) +
         shape_light.capacity() * sizeof(FaceLight) + region_shapes.capacity() * sizeof(RegionShapes) +
         shapes_of_types.capacity() * sizeof(VoxelShapes);
}

}  // namespace quoin

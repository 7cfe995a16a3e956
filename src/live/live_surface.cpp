#include <algorithm>
#include <utility>

#include "live/mesh_job_queue.h"
#include "mesh/surface/bodies.h"
#include "mesh/surface/faces.h"
#include "mesh/surface/shape.h"

namespace quoin {
namespace {

template <class T>
void append(const Buffer<T>& from, Buffer<T>& to) {
  const std::size_t first = to.size();
  to.resize(first + from.size());
  std::copy(from.begin(), from.end(), to.begin() + first);
}

void make_blocky(const LiveMeshOptions& options, LiveJob& job, LiveWorkspace& workspace) {
  if (!workspace.blocky) workspace.blocky.emplace();
  QuadOptions wanted;
  wanted.merge = options.merge;
  const VoxelRegistry& types = *job.types;
  workspace.blocky->mesh(job.voxels->neighbourhood(job.chunk), types, wanted, workspace.quads);
  if (workspace.quads.empty()) return;
  auto surface = std::make_shared<ChunkSurface>();
  surface->style = SurfaceStyle::Blocky;
  surface->quads.reserve(workspace.quads.size());
  for (const bool transparent : {false, true}) {
    for (const Quad quad : workspace.quads) {
      if (types.is_transparent(quad.type()) == transparent) surface->quads.push_back(quad);
    }
    if (!transparent) surface->opaque_quads = surface->quads.size();
  }
  job.surface = std::move(surface);
}

// Its triangles and vertices follow those that are there.
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

// Each face in the colour of its sample.
void append_by_faces(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                     const SurfaceMaterials& materials, SmoothChunkMesh& mesh, ChunkSurface& surface) {
  std::vector<smooth::TriangleFace> faces;
  smooth::find_faces(chunks, options, materials, mesh, faces);
  const std::vector<smooth::VertexCopy> copies =
      smooth::split_by_faces({mesh.indices.begin(), mesh.indices.end()}, mesh.positions.size(), faces,
                             {.types = true, .directions = false, .groups = {}});
  SmoothChunkMesh split;
  split.positions.resize(copies.size());
  split.normals.resize(copies.size());
  if (!mesh.occlusion.empty()) split.occlusion.resize(copies.size());
  split.cells.resize(copies.size());
  surface.albedo.reserve(surface.albedo.size() + copies.size());
  surface.types.reserve(surface.types.size() + copies.size());
  for (std::size_t i = 0; i < copies.size(); ++i) {
    const std::uint32_t vertex = copies[i].vertex;
    split.positions[i] = mesh.positions[vertex];
    split.normals[i] = mesh.normals[vertex];
    if (!mesh.occlusion.empty()) split.occlusion[i] = mesh.occlusion[vertex];
    split.cells[i] = mesh.cells[vertex];
    surface.albedo.push_back(materials.albedo(copies[i].look.type));
    surface.types.push_back(copies[i].look.type);
  }
  std::swap(split.indices, mesh.indices);
  append(split, surface.smooth);
  std::swap(split.indices, mesh.indices);
}

bool reads_as_before(const LiveJob& job, int reach) {
  if (!job.last_stamps.has_value()) return false;
  for (int i = 0; i < 27; ++i) {
    const auto& density = job.densities[static_cast<std::size_t>(i)];
    const std::uint64_t last = (*job.last_stamps)[static_cast<std::size_t>(i)];
    // From that chunk, this one lies the other way.
    const IVec3 offset = -Neighbourhood::offset(i);
    if (density == nullptr ? last != 0 : !density->reads_as(last, reach, offset)) return false;
  }
  return true;
}

// What no other worker is about comes first; what others are about is there, or nearly so, by then.
DensityNeighbourhood make_densities(const LiveDensities& densities) {
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

// Adds the surface of one body. `whole`: as smooth::Shape has it.
void mesh_body(const LiveMeshOptions& options, const DensityNeighbourhood& chunks, const DensityNeighbourhood* whole,
               const LiveJob& job, LiveWorkspace& workspace, ChunkSurface& surface) {
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
  for (const CellMaterial& material : smooth::materials_of(chunks, wanted, *job.materials, workspace.mesh)) {
    surface.albedo.push_back(material.albedo);
    surface.types.push_back(material.type);
  }
  append(workspace.mesh, surface.smooth);
}

void finish(std::shared_ptr<ChunkSurface> surface, LiveJob& job) {
  if (surface->smooth.indices.empty()) return;
  surface->style = SurfaceStyle::Smooth;
  surface->level = job.levels[13];
  job.surface = std::move(surface);
}

// The bodies that a chunk may own faces of, sorted, and whether a cell of its may have several.
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
  // What is solid of a field without a material is opaque.
  if (content == SurfaceContent::Field) {
    for (std::vector<std::uint32_t>* each : {&bodies.own, &all_bodies}) {
      if (each->empty() || each->front() != 0) each->insert(each->begin(), 0);
    }
  }
  bodies.are_several = all_bodies.size() > 1;
  return bodies;
}

// `chunk_of(i, body)`: what the body has of the i-th chunk around.
template <class ChunkOf>
void make_bodies(const LiveMeshOptions& options, const DensityNeighbourhood& whole, LiveJob& job,
                 LiveWorkspace& workspace, const ChunkOf& chunk_of) {
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

void make_smooth(const LiveMeshOptions& options, LiveJob& job, LiveWorkspace& workspace) {
  const DensityNeighbourhood chunks = make_densities(job.densities);
  if (reads_as_before(job, reach_of(options.occlusion))) {
    job.outcome = LiveJob::Outcome::AsBefore;
    return;
  }
  make_bodies(options, chunks, job, workspace, [&](std::size_t i, std::uint32_t body) {
    return job.densities[i]->bodies().of(chunks.chunks[i], *job.types, body);
  });
}

// Fields have no `last_stamps`: what reads as before is not meshed.
void make_field(const LiveMeshOptions& options, LiveJob& job, LiveWorkspace& workspace) {
  const DensityNeighbourhood chunks = job.field->neighbourhood(job.chunk);
  make_bodies(options, chunks, job, workspace, [&](std::size_t i, std::uint32_t body) {
    const IVec3 at = job.chunk + Neighbourhood::offset(static_cast<int>(i));
    return job.bodies->at(at)->of(chunks.chunks[i], *job.types, body);
  });
}

}  // namespace

void make_live_surface(const LiveMeshOptions& options, LiveJob& job, LiveWorkspace& workspace) {
  job.outcome = LiveJob::Outcome::Meshed;
  if (job.source.content == SurfaceContent::Field) {
    make_field(options, job, workspace);
  } else if (options.style == SurfaceStyle::Blocky) {
    make_blocky(options, job, workspace);
  } else {
    make_smooth(options, job, workspace);
  }
}

}  // namespace quoin

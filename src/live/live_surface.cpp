#include <algorithm>

#include "live/mesh_job_queue.h"
#include "mesh/surface/faces.h"
#include "mesh/surface/shape.h"

namespace quoin {
namespace {

template <class T>
void copy_exactly(const Buffer<T>& from, Buffer<T>& to) {
  to.resize(from.size());
  std::copy(from.begin(), from.end(), to.begin());
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

void copy_exactly(const SmoothChunkMesh& from, SmoothChunkMesh& to) {
  copy_exactly(from.positions, to.positions);
  copy_exactly(from.normals, to.normals);
  copy_exactly(from.occlusion, to.occlusion);
  copy_exactly(from.cells, to.cells);
  copy_exactly(from.indices, to.indices);
}

// Each face in the colour of its sample.
void copy_by_faces(const DensityNeighbourhood& chunks, const SmoothOptions& options, const SurfaceMaterials& materials,
                   const SmoothChunkMesh& mesh, ChunkSurface& surface) {
  std::vector<smooth::TriangleFace> faces;
  smooth::find_faces(chunks, options, materials, mesh, faces);
  SmoothChunkMesh& out = surface.smooth;
  copy_exactly(mesh.indices, out.indices);
  const std::vector<smooth::VertexCopy> copies =
      smooth::split_by_faces({out.indices.begin(), out.indices.end()}, mesh.positions.size(), faces,
                             {.types = true, .directions = false, .groups = {}});
  out.positions.resize(copies.size());
  out.normals.resize(copies.size());
  if (!mesh.occlusion.empty()) out.occlusion.resize(copies.size());
  out.cells.resize(copies.size());
  surface.albedo.reserve(copies.size());
  surface.types.reserve(copies.size());
  for (std::size_t i = 0; i < copies.size(); ++i) {
    const std::uint32_t vertex = copies[i].vertex;
    out.positions[i] = mesh.positions[vertex];
    out.normals[i] = mesh.normals[vertex];
    if (!mesh.occlusion.empty()) out.occlusion[i] = mesh.occlusion[vertex];
    out.cells[i] = mesh.cells[vertex];
    surface.albedo.push_back(materials.albedo(copies[i].look.type));
    surface.types.push_back(copies[i].look.type);
  }
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

void mesh_smooth(const LiveMeshOptions& options, const DensityNeighbourhood& chunks, LiveJob& job,
                 LiveWorkspace& workspace) {
  if (!workspace.smooth) workspace.smooth.emplace();
  SmoothOptions wanted;
  wanted.occlusion = options.occlusion;
  wanted.split_sheets = true;
  wanted.levels = job.levels;
  const bool is_of_voxels = job.source.content == SurfaceContent::Voxels;
  wanted.join_diagonals = is_of_voxels;
  workspace.smooth->mesh(chunks, wanted, workspace.mesh);
  if (workspace.mesh.indices.empty()) return;
  auto surface = std::make_shared<ChunkSurface>();
  surface->style = SurfaceStyle::Smooth;
  surface->level = job.levels[13];
  if (is_of_voxels) {
    smooth::Shape shape;
    shape.keep_thin = true;
    smooth::shape_vertices(chunks, wanted, shape, workspace.mesh);
  }
  if (is_of_voxels && options.colours == SurfaceColours::Sharp) {
    copy_by_faces(chunks, wanted, *job.materials, workspace.mesh, *surface);
  } else {
    copy_exactly(workspace.mesh, surface->smooth);
    surface->albedo.reserve(surface->smooth.cells.size());
    surface->types.reserve(surface->smooth.cells.size());
    for (const CellMaterial& material : smooth::materials_of(chunks, wanted, *job.materials, surface->smooth)) {
      surface->albedo.push_back(material.albedo);
      surface->types.push_back(material.type);
    }
  }
  job.surface = std::move(surface);
}

void make_smooth(const LiveMeshOptions& options, LiveJob& job, LiveWorkspace& workspace) {
  const DensityNeighbourhood chunks = make_densities(job.densities);
  if (reads_as_before(job, reach_of(options.occlusion))) {
    job.outcome = LiveJob::Outcome::AsBefore;
    return;
  }
  mesh_smooth(options, chunks, job, workspace);
}

// Fields have no `last_stamps`: what reads as before is not meshed.
void make_field(const LiveMeshOptions& options, LiveJob& job, LiveWorkspace& workspace) {
  mesh_smooth(options, job.field->neighbourhood(job.chunk), job, workspace);
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

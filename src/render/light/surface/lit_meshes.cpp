#include <quoin/core/memory.h>
#include <quoin/render/lit_meshes.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/render/propagated_light.h>
#include <quoin/render/surface_light.h>

#include "render/light/light_model.h"

namespace quoin {
namespace {

bool is_of_shape(const MeshView& view, std::size_t vertex) {
  return !view.looks.empty() && view.looks[vertex].is_shape;
}

constexpr std::size_t kAtOnce = 8'192;  // vertices; whole quads of blocks

Status refused(const MeshPart& part, const char* why) {
  return make_error(ErrorCode::InvalidArgument, "part \"" + part.name + "\": " + why);
}

// Computes the light of a mesh's vertices.
class VertexLights {
 public:
  VertexLights(const GridLight& of, const Scene& scene, const LightOptions& options)
      : of_(of),
        types_(scene.types),
        look_(light_look(environment_of(scene), options.least_light)),
        exposure_(exposure_of(environment_of(scene))) {}

  // Vertices from `begin` on.
  void light(const MeshView& view, std::size_t begin, std::span<LinearRgba16> out) const {
    QUOIN_ASSERT(begin + out.size() <= view.positions.size(), "vertices of the mesh");
    SurfaceLight surface(*of_.light, *of_.voxels, types_);
    view.has_albedo() ? light_smooth(surface, view, begin, out) : light_blocks(surface, view, begin, out);
  }

 private:
  void light_smooth(SurfaceLight& surface, const MeshView& view, std::size_t begin, std::span<LinearRgba16> out) const {
    std::vector<MeanLevels> levels(out.size());
    surface.read({view.positions.subspan(begin, out.size()), view.normals.subspan(begin, out.size())}, levels);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = stored(levels[i], view.normals[begin + i], 0.0F);
  }

  // Four vertices are the corners of a quad, except those of shapes.
  void light_blocks(SurfaceLight& surface, const MeshView& view, std::size_t begin, std::span<LinearRgba16> out) const {
    QUOIN_ASSERT(view.types.size() == view.positions.size() && view.directions.size() == view.positions.size(),
                 "a type and a direction for each vertex");
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t vertex = begin + i;
      if (is_of_shape(view, vertex)) {
        const Vec3 normal = normal_at(view, vertex);
        std::array<MeanLevels, 1> mean;
        const Vec3 sample = view.positions[vertex] - 0.5F;  // samples are at the centres of voxels
        surface.read({{&sample, 1}, {&normal, 1}}, mean);
        out[i] = stored(mean[0], normal, emission_at(view, vertex));
        continue;
      }
      const std::size_t corner = vertex % 4;
      const Direction direction = view.directions[vertex];
      const FaceFrame& frame = frame_of(direction);
      IVec3 voxel(view.positions[vertex]);
      if (frame.sign > 0) --voxel[frame.axis];
      if (corner == 1 || corner == 2) --voxel[frame.u];
      if (corner >= 2) --voxel[frame.v];
      const MeanLevels levels = levels_of_corner(surface.face(voxel, direction)[corner]);
      out[i] = stored(levels, Vec3(normal_of(direction)), emission_at(view, vertex));
    }
  }

  [[nodiscard]] float emission_at(const MeshView& view, std::size_t vertex) const {
    const VoxelType type = view.types[vertex];
    if (type >= types_.size() || !(types_[type].emission > 0.0F)) return 0.0F;
    const VoxelFace* const face = face_at(view, vertex, types_);
    return types_[type].emission * (face == nullptr ? 1.0F : emission_factor(*face));
  }

  [[nodiscard]] LinearRgba16 stored(const MeanLevels& levels, Vec3 normal, float emission) const {
    const Vec3 light = exposure_ * (light_colour(levels, normal, look_) + std::max(emission, 0.0F));
    const auto number = [](float share) {
      return static_cast<std::uint16_t>(std::lround(65'535.0F * std::clamp(share, 0.0F, 1.0F)));
    };
    return {number(light.x), number(light.y), number(light.z), 65'535};
  }

  GridLight of_;
  const VoxelRegistry& types_;
  LightLook look_;
  float exposure_;
};

// Data that a part keeps alive.
struct LitPart {
  std::shared_ptr<const void> owner;
  std::vector<std::vector<LinearRgba16>> lights;  // of each surface
};

bool are_corners_of_quads(const MeshView& view) {
  if (view.has_albedo()) return true;
  if (view.positions.size() % 4 != 0) return false;
  // Shapes also have triangles, with a vertex that no index names.
  if (view.looks.empty() && view.indices.size() != view.positions.size() / 4 * 6) return false;
  for (std::size_t i = 0; i < view.positions.size(); i += 4) {
    if (is_of_shape(view, i)) continue;
    const FaceFrame& frame = frame_of(view.directions[i]);
    const Vec3 across = view.positions[i + 2] - view.positions[i];
    Vec3 along(0.0F);
    along[frame.u] = across[frame.u];
    if (across[frame.axis] != 0.0F || view.positions[i + 1] - view.positions[i] != along) return false;
  }
  return true;
}

Status light_part(const VertexLights& lights, Threads threads, MeshPart& part) {
  auto lit = std::make_shared<LitPart>(LitPart{part.owner, {}});
  for (MeshView& view : part.surfaces) {
    if (!view.atlas.empty()) return refused(part, "cannot light a mesh with an atlas");
    if (!are_corners_of_quads(view)) return refused(part, "cannot light watertight block meshes");
    std::vector<LinearRgba16>& light = lit->lights.emplace_back(view.positions.size());
    parallel_for((light.size() + kAtOnce - 1) / kAtOnce, threads, [&](std::size_t i) {
      const std::size_t begin = i * kAtOnce;
      lights.light(view, begin, std::span(light).subspan(begin, std::min(kAtOnce, light.size() - begin)));
    });
  }
  for (std::size_t i = 0; i < part.surfaces.size(); ++i) part.surfaces[i].light = lit->lights[i];
  part.owner = std::move(lit);
  return {};
}

// The grid of each part; none if no instance of the scene places it.
std::vector<std::optional<GridHandle>> grids_of_parts(const Scene& scene, const SceneMeshes& meshes) {
  std::vector<std::optional<GridHandle>> grids(meshes.parts.size());
  for (const MeshPlacement& placement : meshes.placements) {
    const Instance* instance = placement.instance ? scene.instances().find(*placement.instance) : nullptr;
    if (instance != nullptr && placement.part < grids.size()) grids[placement.part] = instance->grid;
  }
  return grids;
}

Status check_light(const Scene& scene, const LightOptions& options) {
  if (Status right = check(options); !right) return right;
  return check(environment_of(scene));
}

Status light_meshes(const Scene& scene, const SceneLight& light, const LightOptions& options, SceneMeshes& meshes,
                    Threads threads) {
  const std::vector<std::optional<GridHandle>> grids = grids_of_parts(scene, meshes);
  for (std::size_t i = 0; i < meshes.parts.size(); ++i) {
    MeshPart& part = meshes.parts[i];
    if (part.surfaces.empty()) continue;
    if (!grids[i]) return refused(part, "cannot light it: no instance of the scene places it");
    const VertexLights lights(light.of(*grids[i]), scene, options);
    if (Status done = light_part(lights, threads, part); !done) return done;
  }
  return {};
}

}  // namespace

Status light_meshes(const Scene& scene, const LightOptions& options, SceneMeshes& meshes, Threads threads) {
  if (Status right = check_light(scene, options); !right) return right;
  SceneLight light;
  light.update(scene, threads);
  return light_meshes(scene, light, options, meshes, threads);
}

Result<SceneMeshes> mesh_lit_scene(const Scene& scene, const LightOptions& light, BlockySceneOptions options,
                                   Threads threads, const Progress& progress) {
  if (Status right = check_light(scene, light); !right) return right.error();
  SceneLight levels;
  levels.update(scene, threads);
  options.cut = [&](GridHandle grid, IVec3 chunk, QuadBuffer& quads) {
    const GridLight of = levels.of(grid);
    SurfaceLight surface(*of.light, *of.voxels, scene.types);
    QuadBuffer lit;
    BlockVector<FaceLight> corners;
    surface.split(quads, chunk, LightMerging::Constant, lit, corners);
    quads = std::move(lit);
  };
  auto meshes = mesh_scene(scene, options, threads, progress);
  if (!meshes) return meshes;
  if (Status done = light_meshes(scene, levels, light, *meshes, threads); !done) return done.error();
  return meshes;
}

}  // namespace quoin

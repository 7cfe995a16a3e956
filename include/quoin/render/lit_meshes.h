#pragma once

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/render/light_options.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_meshes.h>

namespace [[gnu::visibility("default")]] quoin {

/// Bakes propagated light (LightModel::Propagated) into each vertex of a scene's meshes, so that mesh files show it.
/// Fills MeshView::light with light, exposure and the face's emission, 16 bits per channel, at most 1. Vertices of
/// blocks get the light at their face's corners; smooth vertices get the light in front of them. The colours of the
/// light are those of `environment_of(scene)`.
///
///   scene.environment = Environment::natural();
///   auto meshes = mesh_scene_smoothly(scene);
///   Status lit = light_meshes(scene, natural_light(), *meshes);
///   write_mesh(*meshes, "cave.glb");
///
/// Faces:  blocky faces stay merged as they are. Faces merged across changing light show it wrong; use `mesh_lit_scene`
///         to avoid that.
/// Parts:  a part placed by several instances has the light of its grid, which they share.
/// Errors: InvalidArgument if `check` rejects the options or the environment, for a part that no instance of the scene
///         places, for watertight blocks and for blocks with an atlas.
[[nodiscard]] Status light_meshes(const Scene& scene, const LightOptions& options, SceneMeshes& meshes,
                                  Threads threads = {});

/// Meshes a scene as `mesh_scene` does, with light at the vertices. Faces merge only along edges of equal light
/// (LightMerging::Constant).
/// Errors: as `mesh_scene` and `light_meshes`.
[[nodiscard]] Result<SceneMeshes> mesh_lit_scene(const Scene& scene, const LightOptions& light,
                                                 BlockySceneOptions options = {}, Threads threads = {},
                                                 const Progress& progress = {});

}  // namespace quoin

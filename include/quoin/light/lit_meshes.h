#pragma once

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/light/light_options.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_meshes.h>

namespace quoin {

/// Gives each vertex of a scene's meshes the propagated light that it has in pictures (LightModel::Propagated), so that
/// files show it: MeshView::light, with the exposure and what its type emits, as 16 bits a channel, 1 at most. Vertices
/// of blocks have that of their face's corners; smooth ones that before them.
///
///   auto meshes = mesh_scene_smoothly(scene);
///   Status lit = light_meshes(scene, natural_light(), *meshes);
///   write_mesh(*meshes, "cave.glb");
///
/// Faces:  those of blocks are as they were merged. What is merged across light shows it wrong: `mesh_lit_scene`.
/// Parts:  of a part that several instances place, light is that of the grid, which they share.
/// Errors: InvalidArgument for a part that no instance of the scene places, and for blocks that are watertight or in an
///         atlas.
[[nodiscard]] Status light_meshes(const Scene& scene, const LightOptions& options, SceneMeshes& meshes,
                                  Threads threads = {});

/// `mesh_scene`, with light at the vertices and faces merged only along edges of equal light (LightMerging::Constant).
/// Errors: those of both.
[[nodiscard]] Result<SceneMeshes> mesh_lit_scene(const Scene& scene, const LightOptions& light,
                                                 BlockySceneOptions options = {}, Threads threads = {},
                                                 const Progress& progress = {});

}  // namespace quoin

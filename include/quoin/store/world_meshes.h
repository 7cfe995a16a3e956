#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/mesh/visible_faces.h>
#include <quoin/scene/scene_meshes.h>
#include <quoin/store/world_saver.h>
#include <quoin/store/world_store.h>

namespace quoin {

struct WorldMeshOptions {
  BlockySceneOptions scene{};  ///< without `atlas`, `cut` and `part_of`
  /// Where the meshes go that are not held in memory: into files without a name, which are gone with them. As large as
  /// a .ply of them, and half as much again.
  std::filesystem::path folder = ".";
  std::size_t cache_bytes = std::size_t{64} << 20;  ///< of chunks that are kept for those beside them
};

/// Meshes of a world, and what was found while it was read.
struct WorldMeshes {
  SceneMeshes meshes;
  std::int64_t voxels = 0;            ///< of all grids, each once
  std::int64_t voxels_with_data = 0;  ///< likewise
  std::vector<std::string> broken;    ///< a line for each chunk that is damaged, and left out
};

/// Meshes what a world's instances place, as mesh_scene does, without holding its voxels or its meshes: chunk after
/// chunk. `loaded`: of load_partial_world.
///
/// Order:  the same meshes as mesh_scene makes of the whole world, to the byte.
/// Memory: `cache_bytes`, or the chunks around 32 of them if these are more; the triangles of 32 chunks; 80 bytes a
///         chunk of a grid. What is read of the meshes later comes from files, and goes again by itself.
/// Errors: those of mesh_scene and of reading; CannotWrite for `folder`; Unsupported where there are densities, which
///         are meshed as a whole.
/// Requires: `scene` without atlas and cut. Nobody writes the world meanwhile: chunks would not fit those beside them.
[[nodiscard]] Result<WorldMeshes> mesh_world(const WorldStore& world, const LoadedWorld& loaded,
                                             const WorldMeshOptions& options, Threads threads = {},
                                             const Progress& progress = {});

/// Counts the faces of the voxels that a world's instances place and show, each grid's once, as count_faces does of a
/// scene, without holding the world. `loaded`: of load_partial_world. Damaged chunks count as air.
///
/// Cost:   reads all chunks of these grids.
/// Memory: as mesh_world, without its triangles.
/// Errors: those of reading; Cancelled.
[[nodiscard]] Result<FaceCounts> count_world_faces(const WorldStore& world, const LoadedWorld& loaded,
                                                   InstanceFilter filter = InstanceFilter::Visible,
                                                   Threads threads = {}, const Progress& progress = {});

/// About how many bytes of memory a world takes that is loaded whole (load_world), from some of its chunks; nothing
/// where these cannot be read.
[[nodiscard]] std::optional<std::uint64_t> memory_of_world(const WorldStore& world);

}  // namespace quoin

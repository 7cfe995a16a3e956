#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/mesh/visible_faces.h>
#include <quoin/scene/scene_meshes.h>
#include <quoin/store/world_saver.h>
#include <quoin/store/world_store.h>

namespace [[gnu::visibility("default")]] quoin {

struct WorldMeshOptions {
  BlockySceneOptions scene{};  ///< must not set `atlas` or `cut`; `part_of` is ignored
  /// Folder for unnamed temporary files that hold the meshes. Needs about 1.5 times the size of a .ply of them. The
  /// files are deleted with the meshes.
  std::filesystem::path folder = ".";
  std::size_t cache_bytes = std::size_t{64} << 20;  ///< cache for neighbouring chunks
};

/// The meshes of a world, with counts and errors from reading it.
struct WorldMeshes {
  SceneMeshes meshes;
  std::int64_t voxels = 0;            ///< of all grids; each grid counts once
  std::int64_t voxels_with_data = 0;  ///< voxels with per-voxel data; each grid counts once
  std::vector<std::string> broken;    ///< damaged chunks that were left out, one line each
};

/// Meshes the grids that a world's instances place, as mesh_scene does, chunk by chunk. Holds neither the voxels nor
/// the meshes in memory. `loaded`: from load_partial_world.
///
/// Order:    the same meshes as mesh_scene of the whole world, byte for byte.
/// Memory:   `cache_bytes`, or the neighbourhood of 32 chunks if that is more; the triangles of 32 chunks; 80 bytes per
///           chunk of a grid. Later accesses to the meshes read memory-mapped files, which the system can evict.
/// Errors:   those of mesh_scene and of reading; CannotWrite for `folder`; Unsupported for density fields, which can
///           only be meshed as a whole.
/// Requires: `scene` has no atlas and no cut. No process writes the world during the call, because neighbouring chunks
///           would not match.
[[nodiscard]] Result<WorldMeshes> mesh_world(const WorldStore& world, const LoadedWorld& loaded,
                                             const WorldMeshOptions& options, Threads threads = {},
                                             const Progress& progress = {});

/// Counts the voxel faces of a world's placed and visible grids, each once, as count_faces does for a scene, without
/// holding the world. `loaded`: from load_partial_world. Damaged chunks count as air.
///
/// Cost:   reads all chunks of these grids.
/// Memory: as mesh_world, without its triangles.
/// Errors: those of reading; Cancelled.
[[nodiscard]] Result<FaceCounts> count_world_faces(const WorldStore& world, const LoadedWorld& loaded,
                                                   InstanceFilter filter = InstanceFilter::Visible,
                                                   Threads threads = {}, const Progress& progress = {});

}  // namespace quoin

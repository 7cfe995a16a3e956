#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

/// Reads MagicaVoxel's format, versions 150 and 200.
///
/// Source:  the published format description of MagicaVoxel and its extension (github.com/ephtracy/voxel-model);
///          Teardown's compressed models, TDCZ (github.com/vengi-voxel/vengi/pull/778).
/// Axes:    (x, y, z) becomes (x, z, -y): Quoin's +Y is MagicaVoxel's +Z.
/// Grids:   one per model, in file order. The canvas is the model's box, from the origin. Models that are not placed
///          become grids without an instance; a warning counts them.
/// Types:   1 to 255 are the palette as the artist sees it (IMAP applied). The raw material keys are kept in
///          VoxelProperties::attributes. MagicaVoxel ignores the palette's alpha, and so does Quoin.
/// Groups:  each group of the scene graph becomes a SceneGroup, except the root, which is the scene. Consecutive
///          transforms without a group between them are combined.
/// Layers:  the file's layers; none if the file has a single, unnamed, visible layer.
/// Frames:  without a scene graph, each model is a frame. Otherwise `frame` matches the keys' `_f`, from 0 to the last
///          key or the end of the animation range.
/// Hidden:  hidden nodes and layers are kept; `is_shown` returns false for them.
/// Lenient: a MAIN chunk that claims up to 20 bytes more than the file has is read with a warning, if its content is
///          valid.
/// Cameras: all that the user set, with the file's numbers; panoramas are skipped with a warning.
/// Render settings: in LoadedScene::render_settings, if the file has them.
/// Skipped: with a warning, voxels outside their model's box or of colour 0. Other frames, notes and unknown chunks are
///          only in LoadedScene::source. `source_only_features` lists these and everything else that a Scene cannot
///          hold: cameras and render settings.
/// Progress: called after each model.
/// Errors:  BadFormat with the byte offset; Unsupported for SLAB6's format of the same name and git-LFS pointers;
///          InvalidArgument for a missing frame; Cancelled; LimitExceeded if a scene graph or scattered voxels would
///          take far more memory than the file has bytes. Memory stays within a multiple of the input's size.
[[nodiscard]] Result<LoadedScene> read_vox(std::span<const std::byte> bytes, const LoadOptions& options = {},
                                           const Progress& progress = {});
/// Reads a .vox file. Errors: also CannotRead; errors name the file.
[[nodiscard]] Result<LoadedScene> read_vox(const std::filesystem::path& path, const LoadOptions& options = {},
                                           const Progress& progress = {});

/// Returns the scene of another frame. It shares models and colours with the scene that was read, in their original
/// state; grids, groups and layers have the same handles. Cost: O(scene graph), at any number of voxels.
/// Errors: InvalidArgument for a missing frame.
[[nodiscard]] Result<Scene> scene_at_frame(const VoxSource& source, int frame);

/// Lists the content of a file that its scene does not hold, one line each, for display: "animation of 24 frames", "10
/// cameras". Files from write_vox keep it; all other formats lose it.
[[nodiscard]] std::vector<std::string> source_only_features(const VoxSource& source);

/// A scene encoded as a .vox file.
struct VoxBytes {
  std::vector<std::byte> bytes;
  std::vector<std::string> warnings;  ///< one line per kind of content that the format does not support
};

/// Encodes a scene as a .vox file of version 150. The same scene gives the same bytes.
///
/// Reading the result restores the same scene if every canvas is a box from the origin of at most 256 voxels per side,
/// as `read_vox` makes them. Otherwise voxels keep their world positions, but grids move to the origin, and larger
/// grids are split into several under a group.
/// Types:    keep their ids if all used ids are below 256; otherwise the used types are numbered from 1. Properties
///           without a MagicaVoxel key (a type's name, `collides`, numbers that MagicaVoxel rounds) are stored under
///           keys that begin with "_quoin_", which other programs lose when they save.
/// Lost:     names of grids that are not placed. With a warning each: positions between voxels are rounded; group
///           rotations other than quarter turns, and lamps, are dropped.
/// Errors:   Unsupported if an instance's transform is not one of the 48 axis-aligned ones, a voxel size is not 1, or a
///           grid has a density field; LimitExceeded for more than 255 types, positions beyond 32 bits, or more than 4
///           GiB.
/// Progress: called after the voxels of each grid.
[[nodiscard]] Result<VoxBytes> write_vox(const Scene& scene, const Progress& progress = {});
/// Writes a .vox file atomically. Errors: also CannotWrite; errors name the file.
[[nodiscard]] Result<SavedScene> write_vox(const Scene& scene, const std::filesystem::path& path,
                                           const Progress& progress = {});

/// Encodes an edited scene from a .vox file and keeps all other content of that file. Unchanged chunks keep their bytes
/// and order, so an unchanged scene gives an identical file. Cameras and sun (from `look`, else `sun`) are written if
/// they changed. Without `source`, works as the overload for a Scene.
///
/// Voxels:   a changed model keeps the file's voxel order; new voxels follow.
/// Frames:   moving an animated instance or group sets a key at the loaded frame; other frames stay. A shape with
///           several models keeps the models of other frames.
/// Canvas:   a model that outgrew its box grows around its pivot if more than one key shows it.
/// Types:    the file's types keep their palette entries. New types take entries with the same appearance, else unused
///           ones.
/// Lost:     in addition, with a warning each: unused palette colours, if new types need their entries; and, if the
///           scene graph has nodes with several parents and one of these must change: animation, attributes of unknown
///           nodes, and nodes outside the graph.
[[nodiscard]] Result<VoxBytes> write_vox(const LoadedScene& loaded, const Progress& progress = {});
[[nodiscard]] Result<SavedScene> write_vox(const LoadedScene& loaded, const std::filesystem::path& path,
                                           const Progress& progress = {});

}  // namespace quoin

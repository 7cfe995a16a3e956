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

namespace quoin {

/// MagicaVoxel's format, versions 150 and 200.
///
/// Source:  the published format description of MagicaVoxel and its extension (github.com/ephtracy/voxel-model); and
///          Teardown's compressed models, TDCZ (github.com/vengi-voxel/vengi/pull/778).
/// Axes:    (x, y, z) becomes (x, z, -y): Quoin's +Y is MagicaVoxel's +Z.
/// Grids:   one a model, in the file's order, with the model's box, from the origin, as canvas. Models that are placed
///          nowhere stay grids without an instance; a warning counts them.
/// Types:   1 to 255 are the palette as the artist sees it (IMAP applied); the raw material keys are kept in
///          VoxelProperties::attributes. The palette's alpha means nothing to MagicaVoxel and is not read.
/// Groups:  a group of the scene graph is a SceneGroup, but for the topmost, which is the scene. Transforms that follow
///          each other without a group between them are one place.
/// Layers:  those of the file; of a file with a single one, without a name and shown, none.
/// Frames:  without a scene graph each model is a frame; otherwise `frame` counts as the keys' `_f` does, from 0 to the
///          last key or the end of the animation's range.
/// Hidden:  nodes and layers that are hidden are kept; `is_shown` says what is to be drawn.
/// Odd:     a MAIN chunk that claims up to 20 bytes more than there are is read with a warning, when all within is
///          sound.
/// Cameras: those that were set, by the file's numbers; panoramas are skipped with a warning.
/// Look:    the render settings are LoadedScene::look, where the file has them.
/// Skipped: with a warning, voxels outside their model's box or of colour 0. Frames but one, notes and chunks that are
///          not known are in LoadedScene::source alone. `only_in_source` names these, and all else that a Scene cannot
///          hold: cameras and render settings.
/// Progress: told after every model.
/// Errors:  BadFormat with the byte offset; Unsupported for SLAB6's format of the same name and git-LFS pointers;
///          InvalidArgument for a frame that is not there; Cancelled; LimitExceeded when a scene graph or scattered
///          voxels would take far more memory than the file has bytes. Memory stays within a multiple of the input's
///          size.
[[nodiscard]] Result<LoadedScene> read_vox(std::span<const std::byte> bytes, const LoadOptions& options = {},
                                           const Progress& progress = {});
/// The same of a file. Errors: also CannotRead; they name the file.
[[nodiscard]] Result<LoadedScene> read_vox(const std::filesystem::path& path, const LoadOptions& options = {},
                                           const Progress& progress = {});

/// The scene of another frame of a file, whose models and colours are shared with the one that was read, as it was
/// read: its grids, groups and layers have the same handles. Cost: that of the scene graph, however many voxels there
/// are. Errors: InvalidArgument for a frame that is not there.
[[nodiscard]] Result<Scene> scene_at_frame(const VoxSource& source, int frame);

/// What a file holds that its scene does not, for people, a line each: "animation of 24 frames", "10 cameras". A .vox
/// file written by write_vox keeps it; any other format loses it.
[[nodiscard]] std::vector<std::string> only_in_source(const VoxSource& source);

/// A scene as the bytes of a .vox file.
struct VoxBytes {
  std::vector<std::byte> bytes;
  std::vector<std::string> warnings;  ///< one line each: what the format does not hold
};

/// The scene as a .vox file of version 150; the same scene gives the same bytes.
///
/// Reading it again gives the same scene when every canvas is a box of at most 256 voxels a side from the origin, as
/// `read_vox` makes them. Otherwise voxels still stand where they stood, but grids are moved to the origin, and those
/// beyond 256 become several, under a group.
/// Types:    keep their ids when all that occur are below 256; else those that occur are numbered from 1. What
///           MagicaVoxel has no key for (the name of a type, whether it collides, numbers that its own keys round) is
///           kept under keys that begin with "_quoin_", which other programs lose when they save.
/// Lost:     names of grids that are placed nowhere. Positions between voxels are rounded, turns of groups that are not
///           by quarter turns and lamps are left out, each with a warning.
/// Errors:   Unsupported when an instance's transform is not one of the 48 axis-aligned ones, a voxel size is not 1 or
///           a grid holds a field of densities;
///           LimitExceeded for more than 255 types, positions beyond 32 bits, or more than 4 GiB.
/// Progress: told after the voxels of every grid.
[[nodiscard]] Result<VoxBytes> write_vox(const Scene& scene, const Progress& progress = {});
/// The same as a file, which appears whole or not at all. Errors: also CannotWrite; they name the file.
[[nodiscard]] Result<SavedScene> write_vox(const Scene& scene, const std::filesystem::path& path,
                                           const Progress& progress = {});

/// A scene that was read from a .vox file, with what was changed since, as a .vox file that keeps all else of the first
/// one: chunks that no change concerns are the same bytes in the same order, so a scene without a change is the same
/// file. Cameras and the sun (of `look`, else `sun`) are written where they changed. Without `source`: else as above.
///
/// Voxels:   of a model that was changed the file's order stays, new ones follow.
/// Frames:   moving an instance or a group that moves by itself sets a key at the frame that was read; other frames
///           stay. A shape that shows several models keeps those of other frames.
/// Canvas:   a model that has outgrown its box becomes larger about its pivot where more than one key shows it.
/// Types:    those of the file stay where they are in its palette. New ones take entries of the same look, else some
///           that no voxel uses.
/// Lost:     also, with a warning each: colours of the palette that no voxel uses, when new ones need their entries;
///           animation, attributes of nodes that Quoin does not know and nodes apart from the graph, where nodes of
///           the scene graph have several parents and one of them has to change.
[[nodiscard]] Result<VoxBytes> write_vox(const LoadedScene& loaded, const Progress& progress = {});
[[nodiscard]] Result<SavedScene> write_vox(const LoadedScene& loaded, const std::filesystem::path& path,
                                           const Progress& progress = {});

/// What write_vox would warn of. Errors: those of write_vox, but for files of more than 4 GiB.
[[nodiscard]] Result<std::vector<std::string>> losses_of_vox(const Scene& scene);
[[nodiscard]] Result<std::vector<std::string>> losses_of_vox(const LoadedScene& loaded);

}  // namespace quoin

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// What reading a file gave.
struct LoadedScene {
  Scene scene;
  std::string format;                 ///< "vox", ...
  std::vector<std::string> warnings;  ///< one line each: what was skipped, and why
  std::optional<DVec3> sun;           ///< from the surface towards the sun, where the file says it
  std::optional<Camera> camera;       ///< where the file has one
  bool names_files = false;           ///< models came from other files, which saving would put into this one
};

struct LoadOptions {
  bool show_hidden = false;  ///< instances of hidden layers and nodes become visible ones; otherwise `visible` is false
  int frame = 0;             ///< which animation frame to take
  /// Of a volume of values: what is above is solid; without, a value between its two groups (volume_threshold).
  std::optional<float> iso = std::nullopt;
  Threads threads = {};  ///< for the field of a volume
};

/// MagicaVoxel's format, versions 150 and 200.
///
/// Source:  the published format description of MagicaVoxel and its extension (github.com/ephtracy/voxel-model); and
///          Teardown's compressed models, TDCZ (github.com/vengi-voxel/vengi/pull/778).
/// Axes:    (x, y, z) becomes (x, z, -y): Quoin's +Y is MagicaVoxel's +Z.
/// Grids:   one a model, in the file's order, with the model's box, from the origin, as canvas. Models that are placed
///          nowhere stay grids without an instance; a warning counts them.
/// Types:   1 to 255 are the palette as the artist sees it (IMAP applied); the raw material keys are kept in
///          VoxelProperties::attributes. The palette's alpha means nothing to MagicaVoxel and is not read.
/// Frames:  without a scene graph each model is a frame; otherwise `frame` counts as the keys' `_f` does, from 0 to the
///          last key or the end of the animation's range.
/// Hidden:  instances of hidden layers and nodes are kept; `visible` says so.
/// Odd:     a MAIN chunk that claims up to 20 bytes more than there are is read with a warning, when all within is
///          sound.
/// Skipped: with a warning, voxels outside their model's box or of colour 0; cameras, lights, notes and layers' names.
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

/// The scene as a .vox file of version 150; the same scene gives the same bytes.
///
/// Reading it again gives the same scene when every canvas is a box of at most 256 voxels a side from the origin, as
/// `read_vox` makes them. Otherwise voxels still stand where they stood, but grids are moved to the origin, and those
/// beyond 256 become several, under a group.
/// Types:    keep their ids when all that occur are below 256; else those that occur are numbered from 1.
/// Lost:     names of grids that are placed nowhere. Positions between voxels are rounded, and lamps are left out, each
///           with a warning.
/// Errors:   Unsupported when a transform is not one of the 48 axis-aligned ones, a voxel size is not 1 or a grid holds
///           a field of densities;
///           LimitExceeded for more than 255 types, positions beyond 32 bits, or more than 4 GiB.
[[nodiscard]] Result<std::vector<std::byte>> write_vox(const Scene& scene, std::vector<std::string>& warnings);
/// The same as a file, which appears whole or not at all; returns its size. Errors: also CannotWrite; they name the
/// file.
[[nodiscard]] Result<std::uint64_t> write_vox(const Scene& scene, const std::filesystem::path& path,
                                              std::vector<std::string>& warnings);

}  // namespace quoin

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/environment.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

/// The content of a scene file, before the files that it names are read; load_scene reads these too. The format:
/// docs/scene-files.md.
///
/// A scene file may contain models (`types` and `grids`), name model files (`sources`), or both. Types from named files
/// are appended to its own types.
struct SceneFile {
  /// A resource pack of Minecraft. A pack with another hash, or that cannot be read, is not used, and the loaded scene
  /// has a warning.
  struct Pack {
    std::string file;       ///< relative to the scene file, or kBuiltinPack
    std::string hash = {};  ///< 16 hexadecimal digits (hash_of_pack); empty: any content
  };
  struct Source {
    std::string id;
    std::string file;              ///< relative to the scene file
    std::vector<Pack> packs = {};  ///< for the looks of its Minecraft blocks, the lowest first
  };
  /// An instance of a grid, or of all that a source contains. Indices replace the handles of `instance`, which are not
  /// used. A source is scaled by `voxel_size`, and its rotation is unit.
  struct Placement {
    Instance instance;
    std::optional<std::size_t> grid = {};   ///< index into `grids`
    std::optional<std::size_t> group = {};  ///< index into `groups`
    std::optional<std::size_t> layer = {};  ///< index into `layers`
    std::string source = {};                ///< an id from `sources`, if `grid` is not set
    /// True if `instance.categories` replaces the categories of the source's own instances.
    bool sets_categories = false;
  };
  /// A group. Indices replace the handles of `group`, which are not used.
  struct Group {
    SceneGroup group;
    std::optional<std::size_t> parent = {};  ///< index into `groups` of an earlier group
    std::optional<std::size_t> layer = {};   ///< index into `layers`
  };
  VoxelRegistry types;  ///< voxel types of `grids`
  std::vector<SceneGrid> grids;
  std::vector<Source> sources;
  std::vector<SceneLayer> layers = {};
  std::vector<Group> groups = {};
  std::vector<Placement> placements;
  std::vector<Lamp> lamps;
  std::optional<Environment> environment;
  std::optional<Camera> camera;
};

/// Parses the text of a scene file (JSON, UTF-8).
///
/// Errors: BadFormat, with the byte offset for invalid JSON, else with the path of the value ("instances[3].rotation:
///         ..."), also for unknown keys; Unsupported for a later version; LimitExceeded beyond 64 MiB outside of
///         strings or 2 GiB in total, 32 levels of nesting, 65,536 files, 64 packs of a file, or 4,194,304 grids,
///         instances or lamps.
///         LimitExceeded also for voxels that need more memory than 64 MiB plus 64 times the file's size; files from
///         `write_scene_file` never do. Errors inside voxel data include the offset in that data ("grids[0].voxels[2]:
///         byte 37 of the voxel data: ...").
[[nodiscard]] Result<SceneFile> parse_scene_file(std::span<const std::byte> text, Threads threads = {});
/// Parses a scene file without the files that it names. Errors: also CannotRead; errors name the file.
[[nodiscard]] Result<SceneFile> parse_scene_file(const std::filesystem::path& path, Threads threads = {});

/// Converts a scene to a self-contained scene file: all types, grids with voxels and fields (as cheap snapshots),
/// groups, layers, lamps and instances. Handles become list indices, in handle order. The caller adds the camera.
///
/// Errors: InvalidArgument for an instance whose grid does not exist.
[[nodiscard]] Result<SceneFile> scene_file_of(const Scene& scene);

/// Returns the entry of a pack in a scene file: its path relative to the scene's folder if there is one, else its
/// absolute path, and its hash. `scene_path`: the scene file, which need not exist. Errors: those of hash_of_pack.
[[nodiscard]] Result<SceneFile::Pack> scene_pack_of(const std::filesystem::path& pack,
                                                    const std::filesystem::path& scene_path);

/// Returns the text of a scene file. `parse_scene_file` restores every number exactly, except that rotations of
/// placed `sources`, and the sun's direction where nothing else of the environment is stored, are normalised. The same
/// scene gives the same text at any thread count.
///
/// Errors: InvalidArgument for content that `parse_scene_file` would refuse (duplicate or unknown ids, numbers that are
///         not finite, scales that are not positive, ...), unregistered voxel types, and ids or paths that are not
///         UTF-8; LimitExceeded as in `parse_scene_file`; Cancelled.
[[nodiscard]] Result<std::vector<std::byte>> write_scene_file(const SceneFile& scene, Threads threads = {},
                                                              const Progress& progress = {});
/// Writes a scene file atomically and returns its size. Errors: also CannotWrite; errors name the file.
[[nodiscard]] Result<std::uint64_t> write_scene_file(const SceneFile& scene, const std::filesystem::path& path,
                                                     Threads threads = {}, const Progress& progress = {});

}  // namespace quoin

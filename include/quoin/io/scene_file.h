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
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// What a scene file says, before the files that it names are read. The format: docs/scene-files.md.
///
/// It may hold models itself (`types` and `grids`), name files of them (`sources`), or both; types of the files come
/// behind its own.
struct SceneFile {
  struct Source {
    std::string id;
    std::string file;  ///< relative to the scene file
  };
  struct Placement {
    std::string source;               ///< an id, where `grid` is none
    std::optional<std::size_t> grid;  ///< an index into `grids`
    std::string name;
    DVec3 position{0.0};
    DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< unit; of any length for a grid, as Instance::rotation
    double scale = 1.0;                  ///< positive
    bool mirrored = false;
    bool visible = true;
    std::optional<std::size_t> group = {};  ///< an index into `groups`
    std::optional<std::size_t> layer = {};  ///< an index into `layers`
    /// As Instance::categories; nothing: 1, and of a source its own.
    std::optional<std::uint32_t> categories = {};
  };
  /// As SceneGroup.
  struct Group {
    std::string name;
    std::optional<std::size_t> parent = {};  ///< an index into `groups`, of one before it
    std::optional<std::size_t> layer = {};   ///< an index into `layers`
    DVec3 position{0.0};
    DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< of any length
    bool mirrored = false;
    bool visible = true;
  };
  VoxelRegistry types;  ///< of the voxels of `grids`
  std::vector<SceneGrid> grids;
  std::vector<Source> sources;
  std::vector<SceneLayer> layers = {};
  std::vector<Group> groups = {};
  std::vector<Placement> placements;
  std::vector<Lamp> lamps;
  std::optional<DVec3> sun;  ///< not 0
  std::optional<Camera> camera;
};

/// Reads the text of a scene file (JSON, UTF-8).
///
/// Errors: BadFormat, with the byte offset where it is no JSON, else with the place in it
///         ("instances[3].rotation: ..."); unknown keys are refused; Unsupported for a later version; LimitExceeded
///         beyond 64 MiB outside of strings or 2 GiB in all, 32 levels of nesting, 65,536 files, 4,194,304 grids,
///         instances or lamps, and for voxels that would take more than 64 MiB and 64 times the file's size of memory,
///         which what `write_scene_file` writes does not. What is wrong within voxels is told with its place in them
///         ("grids[0].voxels[2]: byte 37 of the voxel data: ...").
[[nodiscard]] Result<SceneFile> parse_scene_file(std::span<const std::byte> text, Threads threads = {});
/// The same of a file, without those that it names. Errors: also CannotRead; they name the file.
[[nodiscard]] Result<SceneFile> parse_scene_file(const std::filesystem::path& path, Threads threads = {});

/// A scene as a file that holds it all: every type, every grid with its voxels and its field (snapshots, which cost
/// pointers), its groups, layers and lamps, and an instance each. Handles become places in the lists, in their order.
/// Add a sun and a camera, if there are any.
///
/// Errors: InvalidArgument for an instance whose grid is not there.
[[nodiscard]] Result<SceneFile> scene_file_of(const Scene& scene);

/// The text of a scene file. `parse_scene_file` reads the same from it, to the last bit of every number, but for the
/// length of a sun that is not unit, which becomes 1, and likewise rotations of what `sources` places. The same scene
/// gives the same text, at any thread count.
///
/// Errors: InvalidArgument for what `parse_scene_file` would refuse (ids given twice or that no file has, numbers that
///         are not finite, scales that are not positive ...), voxels of types that are not registered, and ids and
///         paths that are not UTF-8; LimitExceeded as there; Cancelled.
[[nodiscard]] Result<std::vector<std::byte>> write_scene_file(const SceneFile& scene, Threads threads = {},
                                                              const Progress& progress = {});
/// The same as a file, which appears whole or not at all; returns its size. Errors: also CannotWrite; they name the
/// file.
[[nodiscard]] Result<std::uint64_t> write_scene_file(const SceneFile& scene, const std::filesystem::path& path,
                                                     Threads threads = {}, const Progress& progress = {});

/// Reads a scene file and everything that it names. Each file is read once, however often it is placed; its own
/// instances are placed as one body, which is a group of its own where they are several. Types of the files that equal
/// one that there is in everything become that.
///
/// Errors: those of `parse_scene_file` and of reading the files (with their paths); Unsupported when one of them is a
///         scene file that names files itself; LimitExceeded when all files together have more types than a registry
///         holds.
[[nodiscard]] Result<LoadedScene> read_scene_file(const std::filesystem::path& path, const LoadOptions& options = {},
                                                  Threads threads = {}, const Progress& progress = {});
/// The same of bytes. Errors: Unsupported where they name files, which only a path finds.
[[nodiscard]] Result<LoadedScene> read_scene_file(std::span<const std::byte> text, const LoadOptions& options = {},
                                                  Threads threads = {}, const Progress& progress = {});

/// Whether bytes look like a scene file: an object that names its version near the beginning.
[[nodiscard]] bool is_scene_file(std::span<const std::byte> beginning);

}  // namespace quoin

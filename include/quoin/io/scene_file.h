#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/vox.h>
#include <quoin/scene/camera.h>

namespace quoin {

/// What a scene file says, before the files that it names are read. The format: docs/scene-files.md.
struct SceneFile {
  struct Source {
    std::string id;
    std::string file;  ///< relative to the scene file
  };
  struct Placement {
    std::string source;  ///< an id
    std::string name;
    DVec3 position{0.0};
    DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< unit
    double scale = 1.0;                  ///< positive
    bool mirrored = false;
    bool visible = true;
  };
  std::vector<Source> sources;
  std::vector<Placement> placements;
  std::optional<DVec3> sun;  ///< not 0
  std::optional<Camera> camera;
};

/// Reads the text of a scene file (JSON, UTF-8).
///
/// Errors: BadFormat, with the byte offset where it is no JSON, else with the place in it
///         ("instances[3].rotation: ..."); unknown keys are refused; Unsupported for a later version; LimitExceeded
///         beyond 64 MiB, 32 levels of nesting, 65,536 files or 4,194,304 instances.
[[nodiscard]] Result<SceneFile> parse_scene_file(std::span<const std::byte> text);

/// The text of a scene file; `parse_scene_file` reads the same from it, but for the last bits of
/// rotations and cameras, and the sun's length, which becomes 1.
///
/// Errors: InvalidArgument for what `parse_scene_file` would refuse (ids given twice or that no file has, numbers that
///         are not finite ...) and text that is not UTF-8; LimitExceeded as there; Unsupported for cameras that are
///         orthographic or not upright.
[[nodiscard]] Result<std::vector<std::byte>> write_scene_file(const SceneFile& scene);
/// The same as a file, which appears whole or not at all; returns its size. Errors: also CannotWrite; they name the
/// file.
[[nodiscard]] Result<std::uint64_t> write_scene_file(const SceneFile& scene, const std::filesystem::path& path);

/// Reads a scene file and everything that it names. Each file is read once, however often it is placed; its own
/// instances are placed as one body. Types that are equal in everything become one.
///
/// Errors: those of `parse_scene_file` and of reading the files (with their paths); Unsupported when one of them is a
///         scene file itself or a volume; LimitExceeded when all files together have more types than a registry holds.
[[nodiscard]] Result<LoadedScene> read_scene_file(const std::filesystem::path& path, const LoadOptions& options = {},
                                                  const Progress& progress = {});

/// Whether bytes look like a scene file: an object that names its version near the beginning.
[[nodiscard]] bool is_scene_file(std::span<const std::byte> beginning);

}  // namespace quoin

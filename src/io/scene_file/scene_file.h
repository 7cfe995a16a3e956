#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/io/scene_file.h>

namespace quoin {

/// Reads a scene file and all files that it names. Each file is read once, however often it is placed. The instances of
/// a named file are placed as one body; several instances become a group. Types that equal an existing type in every
/// property are merged with it. Warns of an unreadable sky image.
///
/// Errors: those of `parse_scene_file` and of reading the named files (with their paths); Unsupported if a named file
///         is a scene file that names files itself; LimitExceeded if all files together have more types than a registry
///         holds.
[[nodiscard]] Result<LoadedScene> read_scene_file(const std::filesystem::path& path, const LoadOptions& options = {},
                                                  Threads threads = {}, const Progress& progress = {});
/// Reads a scene file from bytes. Errors: also Unsupported if it names other files, which need a path.
[[nodiscard]] Result<LoadedScene> read_scene_file(std::span<const std::byte> text, const LoadOptions& options = {},
                                                  Threads threads = {}, const Progress& progress = {});

/// Returns true if the bytes look like the start of a scene file: a JSON object with its version near the beginning.
[[nodiscard]] bool is_scene_file(std::span<const std::byte> beginning);

}  // namespace quoin

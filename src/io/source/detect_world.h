#pragma once

#include <filesystem>
#include <optional>

#include <quoin/io/formats.h>

namespace quoin {

/// Returns the format of a world that a path leads to by its name: a folder of Minecraft's or Luanti's, or a level.dat.
/// Nothing for other files and folders.
[[nodiscard]] std::optional<FileFormat> detect_world(const std::filesystem::path& path);

}  // namespace quoin

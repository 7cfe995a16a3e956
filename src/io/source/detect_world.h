#pragma once

#include <filesystem>
#include <optional>

#include <quoin/io/formats.h>

namespace quoin {

/// Returns true if the path is a world folder, which open_chunk_source can read.
[[nodiscard]] bool is_world_folder(const std::filesystem::path& path);
/// Returns the format of a world that a path's name refers to: a Minecraft or Luanti folder, or a level.dat. Returns
/// nullopt for other files and folders.
[[nodiscard]] std::optional<FileFormat> detect_world(const std::filesystem::path& path);

}  // namespace quoin

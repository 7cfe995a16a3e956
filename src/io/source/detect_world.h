#pragma once

#include <filesystem>
#include <optional>

#include <quoin/io/formats.h>

namespace quoin {

/// Returns the format of a world that a path's name refers to: a Minecraft or Luanti folder, or a level.dat. Returns
/// nullopt for other files and folders.
[[nodiscard]] std::optional<FileFormat> detect_world(const std::filesystem::path& path);

}  // namespace quoin

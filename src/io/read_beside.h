#pragma once

#include <filesystem>
#include <vector>

// What files_read_beside asks the formats that read more than one file.
namespace quoin {

/// The files that a scene file names; nothing where it cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> files_named_in_scene(const std::filesystem::path& path);

/// Where the values of a NIfTI pair lie, of which `path` is the header; nothing where it is none.
[[nodiscard]] std::vector<std::filesystem::path> files_of_pair(const std::filesystem::path& path);

}  // namespace quoin

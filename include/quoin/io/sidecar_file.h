#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include <quoin/core/result.h>

namespace quoin {

/// The files that another file may name: buffers and images of glTF, materials and textures of OBJ, values of NRRD and
/// NIfTI, models of scene files, skies.
enum class SidecarFiles : std::uint8_t {
  WithinFolder,  ///< in the naming file's folder or below it; symbolic links are resolved first
  Anywhere       ///< every file that the process can read: only for input from a trusted source
};

/// Returns the path of the file that `from` refers to as `name`, relative to the folder of `from`. Backslashes also
/// separate folders. The file need not exist; reading it then reports the error.
///
/// Requires: `name` is decoded (no percent-encoding).
/// Cost:     resolves both paths in the file system.
/// Errors:   BadFormat for an empty name; CannotRead, with `name` in the message, for a file outside the folder (an
///           absolute path, a drive, `..`, a symbolic link) unless `allowed` is Anywhere.
[[nodiscard]] Result<std::filesystem::path> sidecar_path(const std::filesystem::path& from, std::string_view name,
                                                         SidecarFiles allowed = SidecarFiles::WithinFolder);

}  // namespace quoin

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/file_format.h>
#include <quoin/io/formats.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/io/mesh_file.h>

#include "io/mesh_parts.h"

namespace quoin {

namespace triangles {
class SidecarReader;
}

/// All that the library knows about one format. Functions that do not apply are null. Errors need no path, except of
/// functions that take one.
///
///   const FormatDriver toy_format = {.info = {...}, .detect = is_toy, .read = read_toy};
///
/// Rows of format_drivers.cpp list the drivers of this layer; higher layers call register_format.
struct FormatDriver {
  FormatInfo info;
  /// The CMake option that switched the format off when Quoin was built; empty if it is built. Such a driver has no
  /// capabilities and no functions, and detect_by_name uses its extensions.
  std::string_view left_out{};

  // Detection. detect_format asks all drivers for `detect_path`, then for `detect`, then for `detect_whole`, then for
  // `detect_name`.

  /// Detects a folder or file by its path and size alone, although its content may be that of another format.
  bool (*detect_path)(const std::filesystem::path& path) = nullptr;
  /// Detects a file by its beginning; 64 KiB suffice, also inside gzip.
  bool (*detect)(std::span<const std::byte> beginning) = nullptr;
  /// Detects a file without a header by its whole content.
  bool (*detect_whole)(std::span<const std::byte> whole) = nullptr;
  /// Detects a damaged file, or a folder, by its name. `beginning` is empty for a folder.
  bool (*detect_name)(const std::filesystem::path& path, std::span<const std::byte> beginning) = nullptr;

  // Reading: `read`, `read_mesh` or `open_chunks`.

  /// The form in which a reader gets a file by path. Readers of bytes get `bytes` in addition.
  enum class Source : std::uint8_t {
    Bytes,  ///< FormatInput::bytes
    File,   ///< FormatInput::file, whose bytes the reader frees before it makes the scene
    Path    ///< only FormatInput::path, since the file may be large, a folder, or one of several
  };
  Source source = Source::Bytes;
  Result<LoadedScene> (*read)(const FormatInput& input) = nullptr;
  /// `read` gives types the looks of LoadOptions::packs itself.
  bool applies_packs = false;
  /// Reads triangles in the file's axes. `sidecars` reads the files that it names.
  Result<LoadedMesh> (*read_mesh)(std::span<const std::byte> bytes, triangles::SidecarReader& sidecars) = nullptr;
  /// Opens a world that is read by chunks. Only bytes: `path` is empty.
  Result<std::unique_ptr<ChunkSource>> (*open_chunks)(const std::filesystem::path& path,
                                                      std::span<const std::byte> bytes,
                                                      std::string_view dimension) = nullptr;
  /// Lists the other files that belong to a file and that `allowed` permits. Null: none, or those that `read_mesh`
  /// reads.
  std::vector<std::filesystem::path> (*sidecar_files)(const DetectedFile& file, SidecarFiles allowed) = nullptr;

  // Writing scenes: `encode`, or `write` and `unsupported_features`.

  /// Makes the whole file in memory, with a warning for each kind of unsupported content.
  Result<EncodedFile> (*encode)(const FormatOutput& output) = nullptr;
  /// Writes the file, atomically. Warns of unsupported content.
  Result<SavedScene> (*write)(const FormatOutput& output, const std::filesystem::path& path) = nullptr;
  /// Returns the warnings of `write`. Null: there are none.
  Result<std::vector<std::string>> (*unsupported_features)(const FormatOutput& output) = nullptr;
  /// `write` also warns of cameras, sun and data that only .vox files store.
  bool reports_loaded_data = false;

  // Writing meshes.

  /// Plans the files for meshes that check_meshes accepts, and options that the capabilities allow.
  Result<std::vector<MeshFile>> (*plan_mesh)(const SceneMeshes& meshes, const std::filesystem::path& path,
                                             const MeshFileOptions& options) = nullptr;
  /// Lists the further files of plan_mesh. Null: none.
  std::vector<std::filesystem::path> (*mesh_companions)(const SceneMeshes& meshes, const std::filesystem::path& path,
                                                        const MeshFileOptions& options) = nullptr;
  /// `most_steps` of file_origin for coordinates in this format; 0: they are always relative to the origin.
  double most_steps = 0.0;
};

/// Adds a driver. Higher layers call it before main, so that this layer does not depend on them; programs call
/// add_format. Returns true.
/// Requires: no driver has its name, and no other thread uses the formats.
bool register_format(const FormatDriver& driver);

/// Returns all drivers, in the order of file_formats(). Lifetime: static.
[[nodiscard]] std::span<const FormatDriver* const> format_drivers();

/// Returns the driver of a format. Requires: it is one of file_formats().
[[nodiscard]] const FormatDriver& driver_of(FileFormat format);

/// Returns the error of reading or writing a format that is left out of the build: "cannot read or write .glb: Quoin
/// was built with QUOIN_WITH_MESHES=OFF". Requires: `left_out` is not empty.
[[nodiscard]] Error left_out_error(const FormatDriver& driver);

/// Returns the options that leave formats out: "QUOIN_WITH_MESHES=OFF, QUOIN_WITH_MODELS=OFF"; "" if there are none.
[[nodiscard]] std::string left_out_options();

/// Detects a format by `detect_name`, and a format that is left out by the extension.
[[nodiscard]] std::optional<FileFormat> detect_by_name(const std::filesystem::path& path,
                                                       std::span<const std::byte> beginning);

/// Returns the extension of a path in lower case: ".glb".
[[nodiscard]] std::string lower_case_extension(const std::filesystem::path& path);

/// Returns the extension for writing or, for reading, all extensions of a format. Lifetime: the format's.
[[nodiscard]] std::vector<std::string_view> extensions_of(const FormatInfo& info, FormatCapability wanted);

}  // namespace quoin

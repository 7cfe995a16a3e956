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
#include <quoin/io/file_format.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

/// Returns a file name without folder and extension; also removes the extension inside gzip. NAME.vox and NAME.nii.gz
/// both give NAME.
[[nodiscard]] std::string stem_of_file(const std::filesystem::path& path);

/// Detects a readable format from the first bytes of a file, also inside gzip. Returns nullopt if no format matches.
/// Binary STL, .cub, .kvx, .vxl and SLAB6's .vox are recognised by their total length: pass all bytes.
[[nodiscard]] std::optional<FileFormat> detect_format(std::span<const std::byte> bytes);
/// Detects the format of a file or of a world folder. Reads the first 64 KiB, or all of a .stl, .cub, .kvx, .vxl or
/// .vox that these do not identify. Errors: CannotRead.
[[nodiscard]] Result<std::optional<FileFormat>> detect_format(const std::filesystem::path& path);

/// A file and its format, as detect_format returns it; nullopt if no format matches.
struct DetectedFile {
  std::filesystem::path path;
  std::optional<FileFormat> format;
  /// The file, opened by detect_file. Empty if it was not opened, and for worlds and folders, whose readers open it.
  std::optional<InputFile> input = std::nullopt;

  /// Returns `input`, or opens the path. Errors: those of InputFile::open.
  [[nodiscard]] Result<InputFile> open() const { return input ? *input : InputFile::open(path); }
};

/// Detects the format as detect_format does, and keeps the file open: it is opened once, and its reader gets the same
/// file even if another one replaces it. Errors: CannotRead.
[[nodiscard]] Result<DetectedFile> detect_file(const std::filesystem::path& path);

/// Returns the format in which a file of this name is written, from its extension in any case.
///
/// Errors: Unsupported, listing the writable extensions.
[[nodiscard]] Result<FormatInfo> format_for_writing(const std::filesystem::path& path);

// Readers and writers come in pairs, for paths and for bytes. save_scene has no byte version because it picks the
// format by extension; write_scene_file and write_vox have both. Results include warnings: of skipped content when
// reading, of unsupported content when writing. Options, Threads and Progress come last, in this order, and are
// optional.

/// Reads a file of any readable format, or a world folder. A volume becomes a field at surface_value
/// (scene_from_volume). Triangles become voxels or a field (LoadOptions::mesh), at the mesh's position and in its unit.
/// For worlds of open_chunk_source, only the surroundings of the spawn point are loaded.
///
/// The content determines the format, unless `LoadOptions::raw` or `LoadOptions::heights` sets it. The name is used
/// only for files that the content does not identify: .hgt (with its size), damaged Minecraft regions, some triangle
/// files.
/// Errors: CannotRead, BadFormat (with the byte offset where there is one), Unsupported; those of the format's reader
///         (InvalidArgument for a missing frame, Cancelled, LimitExceeded). `path` is set in all.
[[nodiscard]] Result<LoadedScene> load_scene(const std::filesystem::path& path, const LoadOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});
/// Reads a file whose format was detected before, from DetectedFile::input if it is open. The whole content decides the
/// format again, since some formats are recognised by their length; not for volumes and worlds.
[[nodiscard]] Result<LoadedScene> load_scene(const DetectedFile& file, const LoadOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});
/// Reads a scene from bytes. Errors: also Unsupported for scene files that name other files, which need a path.
[[nodiscard]] Result<LoadedScene> load_scene(std::span<const std::byte> bytes, const LoadOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});

/// Returns the files that load_scene reads in addition to `path`: models and a sky image named by a scene file (which
/// need not exist), the values of a NIfTI or NRRD pair, a world's -wal file, and a mesh's materials, buffers and
/// images. A world's sky image is not listed. Empty if the file cannot be read. Cost: for a mesh, as read_mesh.
/// `allowed`: see LoadOptions::sidecar_files; files that it refuses are not listed.
[[nodiscard]] std::vector<std::filesystem::path> sidecar_files_of(const std::filesystem::path& path,
                                                                  SidecarFiles allowed = SidecarFiles::WithinFolder);

/// Writes a scene's voxels to a file, atomically. The extension selects the format: .quoin (write_world) and .json
/// (write_scene_file) are lossless; .vox (write_vox), .qb, .gox, .vxl, .binvox, .schem, .vdb and .nii are formats of
/// other programs. docs/formats/models.md lists the content that each supports.
///
/// Warnings: one line per kind of content that the format does not support.
/// Errors:   Unsupported for other extensions; those of the format's writer; `path` is set in all.
[[nodiscard]] Result<SavedScene> save_scene(const Scene& scene, const std::filesystem::path& path, Threads threads = {},
                                            const Progress& progress = {});
/// Writes a loaded scene with the additional data of its file. .quoin and .json store sun and camera (.quoin: all
/// cameras); .vox stores the content of `source`, cameras and sun.
[[nodiscard]] Result<SavedScene> save_scene(const LoadedScene& loaded, const std::filesystem::path& path,
                                            Threads threads = {}, const Progress& progress = {});

/// Returns the warnings that `save_scene` would give, for asking the user first; empty if the format keeps everything.
/// Cost: small compared with saving, except that formats of other programs build the file in memory.
/// Errors: those of `save_scene` that are detected before writing.
[[nodiscard]] Result<std::vector<std::string>> unsupported_features(const Scene& scene,
                                                                    const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::string>> unsupported_features(const LoadedScene& loaded,
                                                                    const std::filesystem::path& path);

/// A file to read, with the options of load_scene.
struct FormatInput {
  const std::filesystem::path& path;  ///< empty if there are only bytes
  std::span<const std::byte> bytes;   ///< the whole file; empty for formats that open or read a file themselves
  const LoadOptions& options;
  Threads threads;
  const Progress& progress;
  const InputFile* file = nullptr;  ///< for formats that read the open file themselves
};

/// A scene to save.
struct FormatOutput {
  const Scene& scene;
  const LoadedScene* loaded = nullptr;  ///< the scene with its file's additional data, if it was read from a file
  Threads threads{};
  const Progress& progress;
};

/// A file made from a scene, with one line for each kind of content that it lacks.
struct EncodedFile {
  std::vector<std::byte> bytes;
  std::vector<std::string> warnings;
};

/// A format of the calling program. Functions that do not apply are null. Errors need no path.
struct CustomFormat {
  /// Has Read and Write as there are functions, at least one of them; none of Meshes, Volume and Chunks. Extensions
  /// are in lower case, without blanks, with one point, at the beginning. Lifetime: static.
  FormatInfo info;
  /// Detects a file by its beginning: at least 64 KiB, or the whole file if it is shorter. detect_format(path) passes
  /// the first 64 KiB; detect_format(bytes) and load_scene pass the whole file, load_scene also after detection by
  /// path. Files in gzip are passed as they are, not unpacked, here and to `read`.
  bool (*detect)(std::span<const std::byte> beginning) = nullptr;
  Result<LoadedScene> (*read)(const FormatInput& input) = nullptr;
  Result<EncodedFile> (*encode)(const FormatOutput& output) = nullptr;  ///< makes the file, which save_scene writes
};

/// Adds a format, which all functions for formats then know until the program ends. Detection asks the library's
/// formats first.
///
/// Requires: no other thread reads, writes or lists formats during the call; best called first in main.
/// Errors:   InvalidArgument if the name or an extension exists or is invalid (those of `also` count too), or if the
///           capabilities do not match the functions; LimitExceeded beyond 64 formats, with the library's.
[[nodiscard]] Status add_format(const CustomFormat& format);

}  // namespace quoin

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/scene.h>

namespace quoin {

enum class FileFormat : std::uint8_t {
  Vox,
  Scene,
  World,
  Minecraft,
  Schematic,
  Qubicle,
  Goxel,
  Voxlap,
  Binvox,
  CubeWorld,
  LuantiSchematic,
  LuantiMap,
  Heights,
  Vdb,
  Nifti,
  Nrrd,
  Glb,
  Gltf,
  Obj,
  Ply,
  Stl,
  ThreeMf,
  Off
};

/// What Quoin can do with a file format.
struct FormatInfo {
  FileFormat format;
  std::string_view name;         ///< as in `quoin info`: "vox"
  std::string_view extension;    ///< ".vox"
  std::string_view description;  ///< for a person
  bool readable;
  bool writable;
  bool is_mesh;             ///< written from meshes rather than from voxels
  bool is_volume;           ///< values, which read_volume reads as such and load_scene as a field
  std::string_view also{};  ///< further extensions of the same format, or of kin: ".kv6 .kvx"
};

/// All formats, those that can be read first. Lifetime: for ever.
[[nodiscard]] std::span<const FormatInfo> file_formats();

/// The extensions of all formats that can be read (or written), for messages: ".glb, .gltf, .obj, .ply, .vox".
[[nodiscard]] std::string readable_extensions();
[[nodiscard]] std::string writable_extensions();

/// The name of a file without its folder and its extension, nor that of what is within gzip: NAME of NAME.vox and of
/// NAME.nii.gz.
[[nodiscard]] std::string stem_of_file(const std::filesystem::path& path);

/// What is known of a format. Lifetime: for ever.
[[nodiscard]] const FormatInfo& format_info(FileFormat format);

/// Returns the readable format that bytes are of, by what they begin with, within gzip too; nothing when it is none.
/// Binary STL, .cub, .kvx, .vxl and SLAB6's .vox are known by their whole length: pass all bytes.
[[nodiscard]] std::optional<FileFormat> detect_format(std::span<const std::byte> bytes);
/// The same of a file, or of a folder that holds a world. The first 64 KiB are read; of a .stl, .cub, .kvx, .vxl or
/// .vox that these do not tell, all of it. Errors: CannotRead.
[[nodiscard]] Result<std::optional<FileFormat>> detect_format(const std::filesystem::path& path);

/// Returns the format that a file of this name is written in, by its extension in any case.
///
/// Errors: Unsupported, naming the extensions there are.
[[nodiscard]] Result<FormatInfo> format_for_writing(const std::filesystem::path& path);

// What reads and what writes has a twin for bytes and one for a path; but for save_scene, which goes by a path's
// extension: the writers of its formats, write_scene_file and write_vox, have both. Warnings are part of what is
// returned: of what was read, and of what was written where its format may not hold all. Options, Threads (where
// several are used) and Progress (of what may take long) come last, in this order, and may be left out.

/// Reads a file of any readable format, or a folder that holds a world. A volume becomes a field, as scene_from_volume
/// makes it, at surface_value. Triangles become voxels or a field, as LoadOptions::mesh says, placed where the mesh is,
/// in its unit. Of worlds that open_chunk_source reads it is what lies around their spawn.
///
/// The content decides, unless `LoadOptions::raw` does; the name only helps to say what is wrong with a file that is of
/// no known format.
/// Errors: CannotRead, BadFormat (with the byte offset where there is one), Unsupported; those of
///         the format's own reader (InvalidArgument for a frame that is not there, Cancelled, LimitExceeded); `path` is
///         set in all.
[[nodiscard]] Result<LoadedScene> load_scene(const std::filesystem::path& path, const LoadOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});
/// The same of bytes. Errors: Unsupported also for scene files that name others, which only a path finds.
[[nodiscard]] Result<LoadedScene> load_scene(std::span<const std::byte> bytes, const LoadOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});

/// What load_scene reads beside the file itself: the files that a scene file names, which need not be there, the values
/// of a NIfTI pair, a world's -wal, and the materials, buffers and pictures of a mesh. Nothing where the file cannot be
/// read. Cost: of a mesh that of read_mesh. `allowed`: as LoadOptions::sidecar_files.
[[nodiscard]] std::vector<std::filesystem::path> files_read_beside(const std::filesystem::path& path,
                                                                   SidecarFiles allowed = SidecarFiles::WithinFolder);

/// Writes a scene as a file of voxels, in the format of the name's extension: .quoin (write_world) or .json
/// (write_scene_file), both without loss, .vox (write_vox), or one of other programs: .qb, .gox, .vxl, .binvox, .schem,
/// .vdb, .nii. It appears whole or not at all. docs/formats/models.md says what each of these holds.
///
/// Warnings: one line each of what the format does not hold.
/// Errors:   Unsupported for other extensions; those of the format's writer; `path` is set in all.
[[nodiscard]] Result<SavedScene> save_scene(const Scene& scene, const std::filesystem::path& path, Threads threads = {},
                                            const Progress& progress = {});
/// The same of a scene that was read, with what its file had beside it: in .quoin and .json its sun and camera (.quoin
/// has all cameras), in .vox what `source` holds, its cameras and its sun.
[[nodiscard]] Result<SavedScene> save_scene(const LoadedScene& loaded, const std::filesystem::path& path,
                                            Threads threads = {}, const Progress& progress = {});

/// What `save_scene` would warn of, for who wants to ask before: nothing when all is kept. Cost: little beside saving,
/// but of formats of other programs that of making the file.
/// Errors: those of `save_scene` that are known before anything is written.
[[nodiscard]] Result<std::vector<std::string>> losses_of_saving(const Scene& scene, const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<std::string>> losses_of_saving(const LoadedScene& loaded,
                                                                const std::filesystem::path& path);

}  // namespace quoin

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <quoin/core/result.h>
#include <quoin/io/vox.h>

namespace quoin {

enum class FileFormat : std::uint8_t { Vox, Scene, Nifti, Nrrd, Glb, Gltf, Obj, Ply };

/// What Quoin can do with a file format.
struct FormatInfo {
  FileFormat format;
  std::string_view name;         ///< as in `quoin info`: "vox"
  std::string_view ending;       ///< ".vox"
  std::string_view description;  ///< for a person
  bool readable;
  bool writable;
  bool is_mesh;    ///< written from meshes rather than from voxels
  bool is_volume;  ///< read by read_volume rather than by load_scene
};

/// All formats, those that can be read first.
[[nodiscard]] std::span<const FormatInfo> file_formats();

/// The endings of all formats that can be read (or written), for messages: ".glb, .gltf, .obj, .ply, .vox".
[[nodiscard]] std::string readable_endings();
[[nodiscard]] std::string writable_endings();

/// What is known of a format.
[[nodiscard]] const FormatInfo& format_info(FileFormat format);

/// Recognises a readable format by what the file begins with, within gzip too; nothing when it is none of them.
[[nodiscard]] std::optional<FileFormat> recognise(std::span<const std::byte> bytes);

/// As `recognise`, of a file, of which only the beginning is read. Errors: CannotRead.
[[nodiscard]] Result<std::optional<FileFormat>> recognise_file(const std::filesystem::path& path);

/// The format that a file of this name is written in, by its ending in any case.
///
/// Errors: Unsupported, naming the endings there are.
[[nodiscard]] Result<FormatInfo> format_for_writing(const std::filesystem::path& path);

/// Reads a file of any readable format that holds voxels.
///
/// The content decides; the name only helps to say what is wrong with a file that is of no known format.
/// Errors: CannotRead, BadFormat (with the byte offset where there is one), Unsupported, also for volumes; `path` is
///         set in all.
[[nodiscard]] Result<LoadedScene> load_scene(const std::filesystem::path& path, const LoadOptions& options = {});

}  // namespace quoin

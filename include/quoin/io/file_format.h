#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <quoin/core/result.h>

namespace [[gnu::visibility("default")]] quoin {

/// A file format, identified by its short name, as in `quoin info`: FileFormat("glb") equals FileFormat::Glb.
class FileFormat {
 public:
  /// Lifetime: the characters must outlive all copies; use a string literal.
  explicit constexpr FileFormat(std::string_view name) : name_(name) {}

  [[nodiscard]] constexpr std::string_view name() const { return name_; }
  friend constexpr bool operator==(FileFormat, FileFormat) = default;

  // Named like enumerators, since they are used like these.
  // NOLINTBEGIN(readability-identifier-naming)
  static const FileFormat Vox;
  static const FileFormat Scene;
  static const FileFormat World;
  static const FileFormat Minecraft;
  static const FileFormat Schematic;
  static const FileFormat Qubicle;
  static const FileFormat Goxel;
  static const FileFormat Voxlap;
  static const FileFormat Binvox;
  static const FileFormat CubeWorld;
  static const FileFormat LuantiSchematic;
  static const FileFormat LuantiMap;
  static const FileFormat Heights;
  static const FileFormat Vdb;
  static const FileFormat Nifti;
  static const FileFormat Nrrd;
  static const FileFormat Glb;
  static const FileFormat Gltf;
  static const FileFormat Obj;
  static const FileFormat Ply;
  static const FileFormat Stl;
  static const FileFormat ThreeMf;
  static const FileFormat Off;
  // NOLINTEND(readability-identifier-naming)

 private:
  std::string_view name_;
};

// NOLINTBEGIN(readability-identifier-naming)
inline constexpr FileFormat FileFormat::Vox{"vox"};
inline constexpr FileFormat FileFormat::Scene{"scene"};
inline constexpr FileFormat FileFormat::World{"world"};
inline constexpr FileFormat FileFormat::Minecraft{"minecraft"};
inline constexpr FileFormat FileFormat::Schematic{"schematic"};
inline constexpr FileFormat FileFormat::Qubicle{"qubicle"};
inline constexpr FileFormat FileFormat::Goxel{"goxel"};
inline constexpr FileFormat FileFormat::Voxlap{"voxlap"};
inline constexpr FileFormat FileFormat::Binvox{"binvox"};
inline constexpr FileFormat FileFormat::CubeWorld{"cub"};
inline constexpr FileFormat FileFormat::LuantiSchematic{"luanti"};
inline constexpr FileFormat FileFormat::LuantiMap{"luanti_map"};
inline constexpr FileFormat FileFormat::Heights{"heights"};
inline constexpr FileFormat FileFormat::Vdb{"vdb"};
inline constexpr FileFormat FileFormat::Nifti{"nifti"};
inline constexpr FileFormat FileFormat::Nrrd{"nrrd"};
inline constexpr FileFormat FileFormat::Glb{"glb"};
inline constexpr FileFormat FileFormat::Gltf{"gltf"};
inline constexpr FileFormat FileFormat::Obj{"obj"};
inline constexpr FileFormat FileFormat::Ply{"ply"};
inline constexpr FileFormat FileFormat::Stl{"stl"};
inline constexpr FileFormat FileFormat::ThreeMf{"3mf"};
inline constexpr FileFormat FileFormat::Off{"off"};
// NOLINTEND(readability-identifier-naming)

/// Abilities of a format, combined with |. Those after Chunks concern writing.
enum class FormatCapability : std::uint32_t {
  Read = 1U << 0,    ///< load_scene reads it
  Write = 1U << 1,   ///< save_scene writes it, or write_mesh if it has Meshes
  Meshes = 1U << 2,  ///< triangles instead of voxels
  Volume = 1U << 3,  ///< scalar values: read_volume returns them, load_scene makes a field
  Chunks = 1U << 4,  ///< a world that open_chunk_source reads by chunks

  Printing = 1U << 5,            ///< for 3D printers: closed surfaces in millimetres
  Textures = 1U << 6,            ///< SceneMeshes::atlas
  OcclusionAttribute = 1U << 7,  ///< OcclusionIn::Attribute
  VertexLight = 1U << 8,         ///< MeshView::light
  Lamps = 1U << 9,               ///< lamps and cameras of SceneMeshes
  Animation = 1U << 10,          ///< keys of placements
  Compression = 1U << 11,        ///< MeshFileOptions::compress and quantize
  Environment = 1U << 12,        ///< Scene::environment
  Camera = 1U << 13,             ///< LoadedScene::camera
  Cameras = 1U << 14,            ///< LoadedScene::cameras
  Metres = 1U << 15,             ///< one file unit is a metre
  Fields = 1U << 16,             ///< density fields, and instances of any rotation and voxel size
  Faces = 1U << 17,              ///< textures of voxel types (VoxelProperties::faces)
};

[[nodiscard]] constexpr FormatCapability operator|(FormatCapability a, FormatCapability b) {
  return static_cast<FormatCapability>(static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b));
}

/// The axis that points up in a file. glTF always uses +Y; other formats depend on the program.
enum class UpAxis : std::uint8_t { Y, Z };

/// Properties of a file format.
struct FormatInfo {
  FileFormat format;
  std::string_view extension;    ///< ".vox"
  std::string_view description;  ///< for display
  FormatCapability capabilities;
  std::string_view also{};  ///< further extensions of the same or a related format: ".kv6 .kvx"
  UpAxis up = UpAxis::Y;    ///< of triangle files that do not say

  /// Returns the short name, as in `quoin info`: "vox".
  [[nodiscard]] constexpr std::string_view name() const { return format.name(); }
  /// Returns true if the format has all of the capabilities.
  [[nodiscard]] constexpr bool can(FormatCapability wanted) const { return (capabilities | wanted) == capabilities; }
};

/// Returns all formats. Lifetime: static.
[[nodiscard]] std::span<const FormatInfo> file_formats();

/// Returns the properties of a format. Requires: it is one of file_formats(). Lifetime: static.
[[nodiscard]] const FormatInfo& format_info(FileFormat format);

/// Returns true if there is a format and it has all of the capabilities.
[[nodiscard]] bool can(std::optional<FileFormat> format, FormatCapability wanted);

/// Returns the format with a path's extension, in any case, and the capabilities; nullopt if there is none. For Read,
/// further extensions count too.
[[nodiscard]] std::optional<FormatInfo> format_with_extension(const std::filesystem::path& path,
                                                              FormatCapability wanted);

/// Returns the extensions of all formats with the capabilities, for messages: ".glb, .gltf, .obj". For Read, includes
/// further extensions.
[[nodiscard]] std::string extensions_with(FormatCapability wanted);

/// Returns an error if a mesh format lacks a capability. `content` is the content or option that needs it:
/// "cannot write --texture atlas to .ply: it has no textures; use .glb, .gltf or .obj".
///
/// Errors: Unsupported.
[[nodiscard]] Status check_capability(FileFormat format, FormatCapability capability, std::string_view content);

}  // namespace quoin

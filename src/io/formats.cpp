#include <quoin/io/formats.h>

#include <algorithm>
#include <array>
#include <iterator>

#include <quoin/io/chunk_source.h>
#include <quoin/io/scene_file.h>
#include <quoin/io/volume.h>
#include <quoin/io/vox.h>
#include <quoin/scene/volume_scene.h>

#include "io/byte_stream.h"
#include "io/heights/heights.h"
#include "io/minecraft/minecraft_source.h"
#include "io/minecraft/region/region_file.h"
#include "io/minecraft/schematic.h"
#include "io/models/models.h"
#include "io/models/write/write_models.h"
#include "io/scene_file/scene_file.h"
#include "io/source/detect_world.h"
#include "io/source/luanti_map.h"
#include "io/triangles/triangles.h"
#include "io/vdb/vdb.h"
#include "io/vdb/vdb_tree.h"
#include "io/volume/header.h"
#include "io/volume/write.h"
#include "io/vox/write/write.h"
#include "io/whole_file.h"
#include "io/world_format.h"

namespace quoin {

namespace {

#ifdef QUOIN_HAVE_TINYGLTF
constexpr bool kReadsGltf = true;
#else
constexpr bool kReadsGltf = false;
#endif
#ifdef QUOIN_HAVE_TINYOBJLOADER
constexpr bool kReadsObj = true;
#else
constexpr bool kReadsObj = false;
#endif

#ifdef QUOIN_HAVE_EXPAT
constexpr bool kReadsThreeMf = true;
#else
constexpr bool kReadsThreeMf = false;
#endif

constexpr std::array kFormats = {
    FormatInfo{FileFormat::Vox, "vox", ".vox", "MagicaVoxel", true, true, false, false},
    FormatInfo{FileFormat::Scene, "scene", ".json", "Quoin scene file", true, true, false, false},
    FormatInfo{FileFormat::World, "world", ".quoin", "Quoin world, can be larger than memory", true, true, false,
               false},
    FormatInfo{FileFormat::Minecraft, "minecraft", ".mca", "Minecraft world (Java): its folder or one region file",
               true, false, false, false},
    FormatInfo{FileFormat::Schematic, "schematic", ".schem",
               "Minecraft schematic, also .schematic, .litematic and structures (.nbt)", true, true, false, false,
               ".schematic .litematic .nbt"},
    FormatInfo{FileFormat::Qubicle, "qubicle", ".qb", "Qubicle, also .qbt, .qbcl and .qef", true, true, false, false,
               ".qbt .qbcl .qef"},
    FormatInfo{FileFormat::Goxel, "goxel", ".gox", "Goxel", true, true, false, false},
    FormatInfo{FileFormat::Voxlap, "voxlap", ".vxl", "Voxlap and Ace of Spades map; models: .kv6, .kvx and SLAB6 .vox",
               true, true, false, false, ".kv6 .kvx"},
    FormatInfo{FileFormat::Binvox, "binvox", ".binvox", "binvox", true, true, false, false},
    FormatInfo{FileFormat::CubeWorld, "cub", ".cub", "Cube World model", true, false, false, false},
    FormatInfo{FileFormat::LuantiSchematic, "luanti", ".mts", "Luanti schematic", true, false, false, false},
    FormatInfo{FileFormat::LuantiMap, "luanti_map", ".sqlite", "Luanti world: its folder or map.sqlite", true, false,
               false, false},
    FormatInfo{FileFormat::Heights, "heights", ".hgt", "SRTM heights; height-map images (.png) with --heights", true,
               false, false, false},
    FormatInfo{FileFormat::Vdb, "vdb", ".vdb", "OpenVDB grids, also NanoVDB (.nvdb)", true, true, false, false,
               ".nvdb"},
    FormatInfo{FileFormat::Nifti, "nifti", ".nii", "NIfTI-1 and -2 volumes, also .nii.gz", true, true, false, true},
    FormatInfo{FileFormat::Nrrd, "nrrd", ".nrrd", "NRRD volumes, also .nhdr with a data file", true, false, false, true,
               ".nhdr"},
    FormatInfo{FileFormat::Glb, "glb", ".glb", "glTF 2.0, one file", kReadsGltf, true, true, false},
    FormatInfo{FileFormat::Gltf, "gltf", ".gltf", "glTF 2.0, JSON and .bin", kReadsGltf, true, true, false},
    FormatInfo{FileFormat::Obj, "obj", ".obj", "Wavefront OBJ with .mtl and palette images", kReadsObj, true, true,
               false},
    FormatInfo{FileFormat::Ply, "ply", ".ply", "Polygon File Format, binary (read as text too)", true, true, true,
               false},
    FormatInfo{FileFormat::Stl, "stl", ".stl", "STL, for printing", true, true, true, false},
    FormatInfo{FileFormat::Off, "off", ".off", "Object File Format, as text", true, false, true, false},
    FormatInfo{FileFormat::ThreeMf, "3mf", ".3mf", "3MF, for printing, with colours", kReadsThreeMf, true, true, false},
};

bool begins_with(std::span<const std::byte> bytes, std::string_view text) {
  return bytes.size() >= text.size() && std::equal(text.begin(), text.end(), bytes.begin(),
                                                   [](char c, std::byte b) { return static_cast<std::byte>(c) == b; });
}

std::string lower_case_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return extension;
}

/// Lists the extensions of a format with an ability: one for writing, possibly several for reading.
std::string extensions_with(bool FormatInfo::*ability) {
  std::vector<std::string_view> sorted;
  for (const FormatInfo& info : kFormats) {
    if (!(info.*ability)) continue;
    sorted.push_back(info.extension);
    if (ability == &FormatInfo::writable) continue;
    for (std::string_view rest = info.also; !rest.empty();) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      sorted.push_back(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  std::sort(sorted.begin(), sorted.end());
  std::string list;
  for (const std::string_view extension : sorted) {
    if (!list.empty()) list += ", ";
    list += extension;
  }
  return list;
}

/// Returns the readable format with a path's extension; null if there is none.
const FormatInfo* format_by_name(const std::filesystem::path& path) {
  const std::string extension = lower_case_extension(path);
  const FormatInfo* const end = kFormats.data() + kFormats.size();
  const FormatInfo* const found = std::find_if(kFormats.data(), end, [&](const FormatInfo& info) {
    const std::string all = std::string(info.extension) + " " + std::string(info.also) + " ";
    return info.readable && !extension.empty() && all.find(extension + " ") != std::string::npos;
  });
  return found == end ? nullptr : found;
}

/// Returns the error for a file of unknown format.
Error unrecognised(std::span<const std::byte> bytes, const std::filesystem::path& path) {
  if (bytes.empty()) return {ErrorCode::BadFormat, "the file is empty", {}, {}};
  if (begins_with(bytes, "version https://git-lfs.github.com/spec/")) {
    return {ErrorCode::BadFormat, "a Git LFS pointer, not the file itself (git lfs pull fetches it)", {}, 0};
  }
  if (begins_with(bytes, "Voxel Animation")) {
    return {ErrorCode::Unsupported, "a Westwood model, not a Voxlap map", {}, 0};
  }
  if (heights::is_png(bytes)) {
    return {ErrorCode::BadFormat,
            "an image, not a voxel file; --heights grey, mapbox or terrarium reads it as heights "
            "(in programs the option heights)",
            {},
            {}};
  }
  if (const FormatInfo* const named = format_by_name(path)) {
    return {ErrorCode::BadFormat,
            "its name ends in " + lower_case_extension(path) + ", but its content is not " + std::string(named->name) +
                ", nor any other known format; it may be damaged, or a different format with the same extension",
            {},
            {}};
  }
  return {ErrorCode::BadFormat, "unknown file format; readable are " + readable_extensions(), {}, {}};
}

bool is_volume(const std::optional<FileFormat>& format) {
  return format && format_info(*format).is_volume;
}

/// `source`: a path, or bytes.
template <class Source>
Result<LoadedScene> read_volume_as_scene(const Source& source, const LoadOptions& options, Threads threads,
                                         const Progress& progress) {
  const Progress reading = part_of(progress, 0.0, 0.5);
  VolumeOptions allowed;
  allowed.sidecar_files = options.sidecar_files;
  const auto volume =
      options.raw ? read_raw_volume(source, *options.raw, allowed, reading) : read_volume(source, allowed, reading);
  if (!volume) return volume.error();
  const auto iso = surface_value(*volume, options.iso);
  if (!iso) return iso.error();
  VolumeSceneOptions wanted;
  wanted.iso = *iso;
  auto scene = scene_from_volume(*volume, wanted, threads, part_of(progress, 0.5, 1.0));
  if (!scene) return scene.error();
  LoadedScene loaded;
  loaded.scene = std::move(*scene);
  loaded.format = volume->format;
  loaded.warnings = volume->warnings;
  return loaded;
}

Result<LoadedScene> read_heights_as_scene(std::span<const std::byte> bytes, const LoadOptions& options, Threads threads,
                                          const Progress& progress) {
  const HeightOptions wanted = options.heights.value_or(HeightOptions{});
  auto map = read_height_map(bytes, wanted);
  if (!map) return map.error();
  auto scene = scene_from_heights(*map, wanted, threads, progress);
  if (!scene) return scene.error();
  LoadedScene loaded;
  loaded.scene = std::move(*scene);
  loaded.format = "heights";
  loaded.warnings = std::move(map->warnings);
  return loaded;
}

/// Reads a file of any Voxlap format.
Result<LoadedScene> read_voxlap(std::span<const std::byte> bytes) {
  if (models::is_kv6(bytes)) return models::read_kv6(bytes);
  if (models::is_kvx(bytes)) return models::read_kvx(bytes);
  if (models::is_slab6(bytes)) return models::read_slab6(bytes);
  return models::read_vxl(bytes);
}

/// Returns the reader of a model format; null for other formats.
using ReadModel = Result<LoadedScene> (*)(std::span<const std::byte>);
ReadModel model_reader(const std::optional<FileFormat>& format) {
  if (format == FileFormat::Qubicle) return models::read_qubicle;
  if (format == FileFormat::Goxel) return models::read_goxel;
  if (format == FileFormat::Voxlap) return read_voxlap;
  if (format == FileFormat::Binvox) return models::read_binvox;
  if (format == FileFormat::CubeWorld) return models::read_cub;
  if (format == FileFormat::LuantiSchematic) return models::read_mts;
  return nullptr;
}

/// Detects model formats with a magic number.
std::optional<FileFormat> detect_model(std::span<const std::byte> beginning) {
  if (models::is_goxel(beginning)) return FileFormat::Goxel;
  if (models::is_kv6(beginning)) return FileFormat::Voxlap;
  if (models::is_binvox(beginning)) return FileFormat::Binvox;
  if (models::is_mts(beginning)) return FileFormat::LuantiSchematic;
  if (models::is_qubicle(beginning)) return FileFormat::Qubicle;
  return std::nullopt;
}

bool is_triangles(const std::optional<FileFormat>& format) {
  return format && format_info(*format).is_mesh;
}

Result<LoadedScene> scene_of_triangles(Result<LoadedMesh> loaded, const std::string& name, const LoadOptions& options,
                                       Threads threads, const Progress& progress) {
  if (!loaded) return loaded.error();
  return triangles::scene_from_mesh(std::move(*loaded), options.mesh, name, threads, progress);
}

/// Detects model formats without a header, by their total length.
std::optional<FileFormat> detect_headerless(std::span<const std::byte> whole) {
  if (triangles::is_stl(whole)) return FileFormat::Stl;
  if (models::is_cub(whole)) return FileFormat::CubeWorld;
  if (models::is_slab6(whole) || models::is_kvx(whole) || models::is_vxl(whole)) return FileFormat::Voxlap;
  return std::nullopt;
}

/// Reads the surroundings of the spawn in a world that is read by chunks.
Result<LoadedScene> read_around_spawn(const Result<std::unique_ptr<ChunkSource>>& source, const LoadOptions& options,
                                      Threads threads, const Progress& progress) {
  if (!source) return source.error();
  return load_source(**source, chunks_around_spawn(**source, options.radius), threads, progress);
}

/// `format`: the result of detect_format for the bytes.
Result<LoadedScene> read_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes,
                               std::optional<FileFormat> format, const LoadOptions& options, Threads threads,
                               const Progress& progress) {
  if (format == FileFormat::Vox) return read_vox(bytes, options, progress);
  if (format == FileFormat::Scene) return read_scene_file(bytes, options, threads, progress);
  if (format == FileFormat::World) return read_world_format(bytes, options, threads, progress);
  if (format == FileFormat::Minecraft) {
    return read_around_spawn(minecraft::open_minecraft(bytes), options, threads, progress);
  }
  if (format == FileFormat::LuantiMap) return read_around_spawn(open_luanti(bytes), options, threads, progress);
  if (format == FileFormat::Schematic) return minecraft::read_schematic(bytes, progress);
  if (format == FileFormat::Vdb) return vdb::read_vdb(bytes, options, threads, progress);
  if (const ReadModel read = model_reader(format); read != nullptr) return read(bytes);
  if (is_triangles(format)) {
    return scene_of_triangles(read_mesh(bytes, options.mesh.up), "mesh", options, threads, progress);
  }
  if (is_volume(format)) return read_volume_as_scene(bytes, options, threads, progress);
  Error error = unrecognised(bytes, path);
  // The .vox reader has better errors for other formats with this extension.
  const bool named_vox = !bytes.empty() && !error.byte_offset && lower_case_extension(path) == ".vox";
  if (named_vox) return read_vox(bytes, options, progress);
  return error;
}

/// A scene to be saved, and the loaded file data if it was read from a file.
struct Saved {
  const Scene& scene;
  const LoadedScene* loaded = nullptr;
};

/// Lists the data that only another .vox file can store.
std::vector<std::string> lost_with_source(const Saved& saved) {
  if (saved.loaded == nullptr || saved.loaded->source == nullptr) return {};
  std::vector<std::string> lines = source_only_features(*saved.loaded->source);
  for (std::string& line : lines) line.insert(0, "left out, only .vox stores it: ");
  return lines;
}

/// Lists the cameras and sun that a format other than .vox leaves out, except items of `lost_with_source`.
std::vector<std::string> lost_views(const Saved& saved, FileFormat format) {
  std::vector<std::string> lines;
  if (saved.loaded == nullptr) return lines;
  const LoadedScene& loaded = *saved.loaded;
  // `lost_with_source` already lists the file's own items.
  const auto is_reported = [said = lost_with_source(saved)](std::string_view what) {
    return std::ranges::any_of(said, [&](const std::string& line) { return line.find(what) != std::string::npos; });
  };
  const bool holds_sun = format == FileFormat::Scene || format == FileFormat::World;
  std::ptrdiff_t cameras = std::ssize(loaded.cameras);
  if (format == FileFormat::World) cameras = 0;
  if (format == FileFormat::Scene && loaded.camera) {
    cameras =
        std::ranges::count_if(loaded.cameras, [&](const FileCamera& one) { return one.camera != *loaded.camera; });
  }
  if (cameras > 0 && !is_reported("cameras: ")) lines.push_back("cameras left out: " + std::to_string(cameras));
  const Look usual;
  if (is_reported("render settings: ")) return lines;
  if (!holds_sun && loaded.sun) lines.emplace_back("the sun is left out");
  if (holds_sun && loaded.sun && loaded.look &&
      (loaded.look->look.sun_brightness != usual.sun_brightness || loaded.look->look.sun_colour != usual.sun_colour)) {
    lines.emplace_back("the sun's brightness and colour are left out");
  }
  return lines;
}

Result<FileFormat> format_for_saving(const std::filesystem::path& path) {
  const auto format = format_for_writing(path);
  if (!format) return format.error();
  if (format->is_mesh)
    return make_error(ErrorCode::Unsupported, "a mesh format, which cannot store voxels", path.string());
  return format->format;
}

/// Returns the writer of a model format, which reports unsupported content after writing; null for other formats.
using WriteModel = Result<models::ModelBytes> (*)(const Scene&, const Progress&);
WriteModel model_writer(FileFormat format) {
  if (format == FileFormat::Schematic) return minecraft::write_schematic;
  if (format == FileFormat::Qubicle) return models::write_qb;
  if (format == FileFormat::Goxel) return models::write_goxel;
  if (format == FileFormat::Voxlap) return models::write_vxl;
  if (format == FileFormat::Binvox) return models::write_binvox;
  if (format == FileFormat::Nifti) return write_nifti;
  return nullptr;
}

std::vector<std::string> all_lost(std::vector<std::string> lines, const Saved& saved, FileFormat format) {
  std::ranges::move(lost_with_source(saved), std::back_inserter(lines));
  std::ranges::move(lost_views(saved, format), std::back_inserter(lines));
  return lines;
}

Result<SavedScene> save_model(Result<models::ModelBytes> file, const Saved& saved, FileFormat format,
                              const std::filesystem::path& path) {
  if (!file) return file.error();
  const auto bytes = write_whole(path, std::move(file->bytes));
  if (!bytes) return bytes.error();
  return SavedScene{*bytes, all_lost(std::move(file->warnings), saved, format)};
}

Result<SavedScene> save(const Saved& saved, const std::filesystem::path& path, Threads threads,
                        const Progress& progress) {
  const auto format = format_for_saving(path);
  if (!format) return format.error();
  if (const WriteModel write = model_writer(*format); write != nullptr) {
    return save_model(with_path(write(saved.scene, progress), path), saved, *format, path);
  }
  if (*format == FileFormat::Vox) {
    return saved.loaded != nullptr ? write_vox(*saved.loaded, path, progress) : write_vox(saved.scene, path, progress);
  }
  if (*format == FileFormat::World) {
    auto written = write_world_format(saved.scene, saved.loaded, path, threads, progress);
    if (!written) return written.error();
    return SavedScene{written->bytes, all_lost({}, saved, *format)};
  }
  if (*format == FileFormat::Vdb) {
    const auto written = write_whole(path, vdb::write_vdb(saved.scene));
    if (!written) return written.error();
    return SavedScene{*written, all_lost(vdb::vdb_unsupported_features(saved.scene), saved, *format)};
  }
  auto file = with_path(scene_file_of(saved.scene), path);
  if (!file) return file.error();
  if (saved.loaded != nullptr) {
    file->sun = saved.loaded->sun;
    file->camera = saved.loaded->camera;
  }
  const auto bytes = write_scene_file(*file, path, threads, progress);
  if (!bytes) return bytes.error();
  return SavedScene{*bytes, all_lost({}, saved, *format)};
}

Result<std::vector<std::string>> losses(const Saved& saved, const std::filesystem::path& path) {
  const auto format = format_for_saving(path);
  if (!format) return format.error();
  if (const WriteModel write = model_writer(*format); write != nullptr) {
    auto file = with_path(write(saved.scene, {}), path);
    if (!file) return file.error();
    return all_lost(std::move(file->warnings), saved, *format);
  }
  if (*format == FileFormat::Vdb) return all_lost(vdb::vdb_unsupported_features(saved.scene), saved, *format);
  if (*format != FileFormat::Vox) return all_lost({}, saved, *format);
  return with_path(
      saved.loaded != nullptr ? vox_unsupported_features(*saved.loaded) : vox_unsupported_features(saved.scene), path);
}

}  // namespace

bool is_world_format(std::span<const std::byte> beginning) {
  constexpr std::size_t kIdAt = 68;
  if (beginning.size() < kWorldHeaderBytes || !begins_with(beginning, {"SQLite format 3\0", 16})) return false;
  std::uint32_t id = 0;
  for (std::size_t i = 0; i < 4; ++i) id = id << 8 | std::to_integer<std::uint32_t>(beginning[kIdAt + i]);
  return id == kWorldApplicationId;
}

std::span<const FormatInfo> file_formats() {
  return kFormats;
}

std::string readable_extensions() {
  return extensions_with(&FormatInfo::readable);
}

std::string writable_extensions() {
  return extensions_with(&FormatInfo::writable);
}

std::string stem_of_file(const std::filesystem::path& path) {
  std::filesystem::path name = path.filename();
  if (lower_case_extension(name) == ".gz") name = name.stem();
  return name.stem().string();
}

const FormatInfo& format_info(FileFormat format) {
  return *std::find_if(kFormats.begin(), kFormats.end(), [&](const FormatInfo& info) { return info.format == format; });
}

std::optional<FileFormat> detect_format(std::span<const std::byte> bytes) {
  if (begins_with(bytes, "VOX ")) return FileFormat::Vox;
  if (is_world_format(bytes)) return FileFormat::World;
  if (is_luanti_map(bytes)) return FileFormat::LuantiMap;
  if (vdb::is_vdb(bytes) || vdb::is_nvdb(bytes)) return FileFormat::Vdb;
  if (is_scene_file(bytes)) return FileFormat::Scene;
  if (minecraft::is_region_file(bytes)) return FileFormat::Minecraft;
  const auto first = first_bytes(bytes, nifti::kMaxHeaderBytes);
  if (first && nifti::is_header(*first)) return FileFormat::Nifti;
  if (first && nrrd::is_header(*first)) return FileFormat::Nrrd;
  if (minecraft::begins_nbt(bytes)) return FileFormat::Schematic;
  if (const auto model = detect_model(bytes)) return model;
  if (const auto mesh = triangles::detect(bytes)) return mesh;
  return detect_headerless(bytes);
}

Result<std::optional<FileFormat>> detect_format(const std::filesystem::path& path) {
  std::error_code unknown_size;
  if (lower_case_extension(path) == ".hgt" && heights::is_hgt_size(std::filesystem::file_size(path, unknown_size))) {
    return FileFormat::Heights;
  }
  if (const auto world = detect_world(path)) return world;
  if (std::filesystem::is_directory(path, unknown_size)) {
    return make_error(ErrorCode::CannotRead,
                      "a folder without a Minecraft world (level.dat and region/r.X.Z.mca) or "
                      "Luanti world (world.mt)",
                      path.string());
  }
  // Enough compressed bytes for a decompressed header, with room for names and comments in the gzip header.
  constexpr std::size_t kEnough = 1 << 16;
  const auto bytes = read_file_beginning(path, kEnough);
  if (!bytes) return bytes.error();
  if (const auto format = detect_format(*bytes)) return format;
  // A damaged region is recognised by its name alone.
  if (minecraft::parse_region_name(path)) return FileFormat::Minecraft;
  if (bytes->size() < kEnough) return triangles::detect_by_name(path, *bytes);
  const std::string extension = lower_case_extension(path);
  constexpr std::array<std::string_view, 5> kHeaderless = {".vxl", ".kvx", ".vox", ".cub", ".stl"};
  if (std::ranges::find(kHeaderless, extension) == kHeaderless.end()) return triangles::detect_by_name(path, *bytes);
  const auto whole = read_file(path);
  if (!whole) return whole.error();
  const auto headerless = detect_headerless(*whole);
  return headerless ? headerless : triangles::detect_by_name(path, *whole);
}

Result<FormatInfo> format_for_writing(const std::filesystem::path& path) {
  const std::string extension = lower_case_extension(path);
  for (const FormatInfo& info : kFormats) {
    if (info.writable && info.extension == extension) return info;
  }
  return make_error(ErrorCode::Unsupported, "unknown extension; use one of " + writable_extensions(), path.string());
}

Result<SavedScene> save_scene(const Scene& scene, const std::filesystem::path& path, Threads threads,
                              const Progress& progress) {
  return save({scene}, path, threads, progress);
}

Result<SavedScene> save_scene(const LoadedScene& loaded, const std::filesystem::path& path, Threads threads,
                              const Progress& progress) {
  return save({loaded.scene, &loaded}, path, threads, progress);
}

Result<std::vector<std::string>> unsupported_features(const Scene& scene, const std::filesystem::path& path) {
  return losses({scene}, path);
}

Result<std::vector<std::string>> unsupported_features(const LoadedScene& loaded, const std::filesystem::path& path) {
  return losses({loaded.scene, &loaded}, path);
}

Result<LoadedScene> load_scene(std::span<const std::byte> bytes, const LoadOptions& options, Threads threads,
                               const Progress& progress) {
  if (options.raw) return read_volume_as_scene(bytes, options, threads, progress);
  if (options.heights) return read_heights_as_scene(bytes, options, threads, progress);
  return read_bytes({}, bytes, detect_format(bytes), options, threads, progress);
}

std::vector<std::filesystem::path> sidecar_files_of(const std::filesystem::path& path, SidecarFiles allowed) {
  const auto format = detect_format(path);
  if (!format || !*format) return {};
  if (**format == FileFormat::Scene) return files_named_in_scene(path);
  if (**format == FileFormat::World) return {path.string() + "-wal"};
  if (is_triangles(*format)) {
    const auto mesh = read_mesh(path, {}, allowed);
    return mesh ? mesh->sidecars : std::vector<std::filesystem::path>();
  }
  return is_volume(*format) ? files_of_pair(path) : std::vector<std::filesystem::path>();
}

Result<LoadedScene> load_scene(const std::filesystem::path& path, const LoadOptions& options, Threads threads,
                               const Progress& progress) {
  // Volume readers take the path, since they may read sidecar files.
  if (options.raw) return with_path(read_volume_as_scene(path, options, threads, progress), path);
  const auto format = detect_format(path);
  if (!format) return format.error();
  if (options.heights || *format == FileFormat::Heights) {
    return read_whole(path, [&](std::span<const std::byte> bytes) {
      return read_heights_as_scene(bytes, options, threads, progress);
    });
  }
  if (is_read_by_chunks(*format)) {
    const auto source = open_chunk_source(path, options.dimension);
    return with_path(read_around_spawn(source, options, threads, progress), path);
  }
  if (*format == FileFormat::World) return with_path(read_world_format(path, options, threads, progress), path);
  if (is_volume(*format)) return with_path(read_volume_as_scene(path, options, threads, progress), path);
  const auto bytes = read_file(path);
  if (!bytes) return bytes.error();
  // Detects again from the whole file: some formats need it, and the file may have changed since.
  const auto of_all = detect_format(*bytes);
  if (of_all == FileFormat::Scene) return read_scene_file(path, options, threads, progress);
  if (is_triangles(of_all) || (!of_all && is_triangles(*format))) {
    auto mesh = read_mesh(path, options.mesh.up, options.sidecar_files);
    return with_path(scene_of_triangles(std::move(mesh), stem_of_file(path), options, threads, progress), path);
  }
  return with_path(read_bytes(path, *bytes, of_all, options, threads, progress), path);
}

}  // namespace quoin

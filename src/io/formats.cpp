#include <quoin/io/formats.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <system_error>

#include <quoin/io/block_packs.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/file.h>
#include <quoin/io/vox.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/format_driver.h"
#include "io/heights/heights.h"
#include "io/triangles/triangles.h"
#include "io/volume/volume_file.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

constexpr bool is_reading(FormatCapability wanted) {
  return (wanted | FormatCapability::Read) == wanted;
}

/// Returns the sorted extensions of all formats with the capabilities.
std::vector<std::string_view> sorted_extensions(FormatCapability wanted) {
  std::vector<std::string_view> sorted;
  for (const FormatInfo& info : file_formats()) {
    if (info.can(wanted)) std::ranges::copy(extensions_of(info, wanted), std::back_inserter(sorted));
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

std::string joined(std::span<const std::string_view> words, std::string_view last_separator) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? last_separator : std::string_view(", ");
    text += words[i];
  }
  return text;
}

/// Returns the error for a file of unknown format.
Error unrecognised(std::span<const std::byte> bytes, const std::filesystem::path& path) {
  if (bytes.empty()) return {ErrorCode::BadFormat, "the file is empty", {}, {}};
  if (text_of(bytes).starts_with("version https://git-lfs.github.com/spec/")) {
    return {ErrorCode::BadFormat, "a Git LFS pointer, not the file itself (git lfs pull fetches it)", {}, 0};
  }
  if (text_of(bytes).starts_with("Voxel Animation")) {
    return {ErrorCode::Unsupported, "a Westwood model, not a Voxlap map", {}, 0};
  }
  if (heights::is_png(bytes)) {
    return {ErrorCode::BadFormat,
            "an image, not a voxel file; --heights grey, mapbox or terrarium reads it as heights "
            "(in programs the option heights)",
            {},
            {}};
  }
  if (const auto named = format_with_extension(path, FormatCapability::Read)) {
    return {ErrorCode::BadFormat,
            "its name ends in " + lower_case_extension(path) + ", but its content is not " +
                std::string(named->name()) +
                ", nor any other known format; it may be damaged, or a different format with the same extension",
            {},
            {}};
  }
  std::string message = "unknown file format; readable are " + extensions_with(FormatCapability::Read);
  if (const std::string options = left_out_options(); !options.empty()) message += "; built with " + options;
  return {ErrorCode::BadFormat, std::move(message), {}, {}};
}

/// Reads the surroundings of the spawn in a world that is read by chunks.
Result<LoadedScene> read_around_spawn(const FormatDriver& driver, const FormatInput& input) {
  if (input.options.radius < 0) {
    return make_error(ErrorCode::InvalidArgument, "cannot read a world within a radius of " +
                                                      std::to_string(input.options.radius) + " chunks: it is negative");
  }
  const auto source = driver.open_chunks(input.path, input.bytes, input.options.dimension);
  if (!source) return source.error();
  return load_source(**source, chunks_around_spawn(**source, input.options.radius), input.threads, input.progress);
}

/// Makes voxels or a field of a file of triangles.
Result<LoadedScene> read_triangles(const FormatDriver& driver, const FormatInput& input) {
  const MeshLoadOptions& options = input.options.mesh;
  triangles::SidecarReader sidecars(input.path, input.options.sidecar_files);
  auto mesh = triangles::read_with(driver, input.bytes, sidecars, options.up);
  if (!mesh) return mesh.error();
  const std::string name = input.path.empty() ? "mesh" : stem_of_file(input.path);
  return triangles::scene_from_mesh(std::move(*mesh), options, name, input.threads, input.progress);
}

/// Gives the result of `read` the looks of the packs, which are opened first.
template <class Read>
Result<LoadedScene> read_with_packs(const LoadOptions& options, Read read) {
  if (options.packs.empty() && options.pack_zips.empty()) return read();
  const auto packs = BlockPacks::open(options.packs, options.pack_zips);
  if (!packs) return packs.error();
  Result<LoadedScene> loaded = read();
  if (!loaded) return loaded;
  (*packs)->apply(loaded->scene.types);
  if (std::string line = to_string((*packs)->report()); !line.empty()) loaded->warnings.push_back(std::move(line));
  return loaded;
}

Result<LoadedScene> read_with(const FormatDriver& driver, const FormatInput& input) {
  if (!driver.left_out.empty()) return left_out_error(driver);
  if (driver.applies_packs) return driver.read(input);
  return read_with_packs(input.options, [&] {
    if (driver.read != nullptr) return driver.read(input);
    return driver.open_chunks != nullptr ? read_around_spawn(driver, input) : read_triangles(driver, input);
  });
}

Result<LoadedScene> read_raw(const FormatInput& input) {
  return read_with_packs(input.options, [&] { return read_volume_scene(input); });
}

/// `format`: the result of detect_format.
Result<LoadedScene> read_as(std::optional<FileFormat> format, const FormatInput& input) {
  if (format) return read_with(driver_of(*format), input);
  Error error = unrecognised(input.bytes, input.path);
  // The .vox reader has better errors for other formats with this extension.
  const bool named_vox = !input.bytes.empty() && !error.byte_offset && lower_case_extension(input.path) == ".vox";
  if (named_vox) return read_with(driver_of(FileFormat::Vox), input);
  return error;
}

/// Detects formats without a header, by their total length. Formats of triangles are last in the table and first here,
/// since their lengths are the most specific.
std::optional<FileFormat> detect_headerless(std::span<const std::byte> whole) {
  const auto drivers = format_drivers();
  for (auto driver = drivers.rbegin(); driver != drivers.rend(); ++driver) {
    if ((*driver)->detect_whole != nullptr && (*driver)->detect_whole(whole)) return (*driver)->info.format;
  }
  return std::nullopt;
}

/// Returns true for the extensions of formats without a header. SLAB6 files are named as MagicaVoxel files.
bool is_named_like_headerless(const std::filesystem::path& path) {
  const auto named = format_with_extension(path, FormatCapability::Read);
  return named && (named->format == FileFormat::Vox || driver_of(named->format).detect_whole != nullptr);
}

/// Lists the data that only another .vox file can store.
std::vector<std::string> lost_with_source(const FormatOutput& output) {
  if (output.loaded == nullptr || output.loaded->source == nullptr) return {};
  std::vector<std::string> lines = source_only_features(*output.loaded->source);
  for (std::string& line : lines) line.insert(0, "left out, only .vox stores it: ");
  return lines;
}

/// Returns a warning if a file at `path` would name a sky image that is not there, else "".
std::string lost_sky_image(const Sky& sky, const std::filesystem::path& path) {
  if (sky.model != SkyModel::Image) return "";
  if (sky.image_file.empty()) return "the sky image is left out: it has no file name";
  std::error_code unknown;
  const auto image = sidecar_path(path, sky.image_file, SidecarFiles::WithinFolder);
  if (image && std::filesystem::exists(*image, unknown)) return "";
  return "the sky image is left out: the saved file names \"" + printable(sky.image_file) +
         "\", which is not in its folder";
}

/// Lists the environment, cameras and render settings that a file lacks, except items of `lost_with_source`.
std::vector<std::string> lost_views(const FormatOutput& output, const FormatInfo& format,
                                    const std::filesystem::path& path) {
  std::vector<std::string> lines;
  const std::optional<Environment>& environment = output.scene.environment;
  if (environment && !format.can(FormatCapability::Environment)) {
    lines.emplace_back(is_only_sun(*environment) ? "the sun is left out"
                                                 : "the environment (sun, sky, fog) is left out");
  } else if (environment) {
    std::string line = lost_sky_image(environment->sky, path);
    if (!line.empty()) lines.push_back(std::move(line));
  }
  if (output.loaded == nullptr) return lines;
  const LoadedScene& loaded = *output.loaded;
  for (const std::string& pack : loaded.unused_packs) lines.push_back("resource pack left out: " + printable(pack));
  // `lost_with_source` already lists the file's own items.
  const auto is_reported = [said = lost_with_source(output)](std::string_view item) {
    return std::ranges::any_of(said, [&](const std::string& line) { return line.find(item) != std::string::npos; });
  };
  std::ptrdiff_t cameras = std::ssize(loaded.cameras);
  if (format.can(FormatCapability::Cameras)) cameras = 0;
  if (format.can(FormatCapability::Camera) && loaded.camera) {
    cameras =
        std::ranges::count_if(loaded.cameras, [&](const FileCamera& one) { return one.camera != *loaded.camera; });
  }
  if (cameras > 0 && !is_reported("cameras: ")) lines.push_back("cameras left out: " + std::to_string(cameras));
  if (loaded.render_settings && !is_reported("render settings: ")) lines.emplace_back("render settings left out");
  return lines;
}

/// Returns the driver for saving a scene. Errors: Unsupported.
Result<const FormatDriver*> driver_for_saving(const std::filesystem::path& path) {
  const auto format = format_for_writing(path);
  if (!format) return format.error();
  if (format->can(FormatCapability::Meshes))
    return make_error(ErrorCode::Unsupported, "cannot write voxels: " + path.extension().string() + " is a mesh format",
                      path.string());
  return &driver_of(format->format);
}

/// Returns the number of types that voxels or samples of the scene have and that `counts` accepts.
std::size_t used_types(const Scene& scene, FunctionRef<bool(const VoxelProperties& type)> counts) {
  std::set<VoxelType> used;
  const auto add = [&](const std::vector<VoxelType>& types) {
    for (const VoxelType type : types) {
      if (type != kAir && type < scene.types.size() && counts(scene.types[type])) used.insert(type);
    }
  };
  scene.grids().for_each([&](GridHandle /*handle*/, const SceneGrid& grid) {
    add(grid.grid.types());
    for (const IVec3 chunk : grid.field.chunks()) add(grid.field.find_chunk(chunk)->materials().types());
  });
  return used.size();
}

/// Adds warnings of textures and shapes, and of the loaded file's data, that the saved file lacks.
void add_lost_data(const FormatDriver& driver, const FormatOutput& output, const std::filesystem::path& path,
                   std::vector<std::string>& warnings) {
  const VoxelRegistry& types = output.scene.types;
  const auto add = [&](const char* lost, bool has_any, FunctionRef<bool(const VoxelProperties& type)> counts) {
    const bool is_kept = !has_any || driver.info.can(FormatCapability::Faces);
    const std::size_t count = is_kept ? 0 : used_types(output.scene, counts);
    if (count > 0) warnings.push_back(lost + std::to_string(count));
  };
  add("textures of types left out, their mean colours are kept: ", types.has_textures(),
      [](const VoxelProperties& type) { return !type.faces.empty(); });
  add("shapes of types left out, their voxels are cubes: ", types.has_shapes(),
      [](const VoxelProperties& type) { return !type.shapes.empty(); });
  if (driver.reports_loaded_data) return;
  std::ranges::move(lost_with_source(output), std::back_inserter(warnings));
  std::ranges::move(lost_views(output, driver.info, path), std::back_inserter(warnings));
}

Result<SavedScene> write_with(const FormatDriver& driver, const FormatOutput& output,
                              const std::filesystem::path& path) {
  if (driver.write != nullptr) return driver.write(output, path);
  auto file = driver.encode(output);
  if (!file) return file.error();
  const auto bytes = write_whole(path, std::move(file->bytes));
  if (!bytes) return bytes.error();
  return SavedScene{*bytes, std::move(file->warnings)};
}

Result<SavedScene> save(const FormatOutput& output, const std::filesystem::path& path) {
  const auto driver = driver_for_saving(path);
  if (!driver) return driver.error();
  auto saved = with_path(write_with(**driver, output, path), path);
  if (saved) add_lost_data(**driver, output, path, saved->warnings);
  return saved;
}

Result<std::vector<std::string>> warnings_with(const FormatDriver& driver, const FormatOutput& output) {
  if (driver.unsupported_features != nullptr) return driver.unsupported_features(output);
  if (driver.encode == nullptr) return std::vector<std::string>();
  auto file = driver.encode(output);
  if (!file) return file.error();
  return std::move(file->warnings);
}

Result<std::vector<std::string>> warnings_of_saving(const FormatOutput& output, const std::filesystem::path& path) {
  const auto driver = driver_for_saving(path);
  if (!driver) return driver.error();
  auto warnings = with_path(warnings_with(**driver, output), path);
  if (warnings) add_lost_data(**driver, output, path, *warnings);
  return warnings;
}

/// A capability of writing, as messages name it.
struct CapabilityName {
  FormatCapability capability;
  std::string_view missing;  ///< completes "it has no"
};
constexpr CapabilityName kCapabilityNames[] = {
    {FormatCapability::Textures, "textures"},
    {FormatCapability::OcclusionAttribute, "occlusion apart from colours"},
    {FormatCapability::VertexLight, "unlit materials"},
    {FormatCapability::Lamps, "lamps and cameras"},
    {FormatCapability::Animation, "animation"},
    {FormatCapability::Compression, "compressed or quantized meshes"},
};

}  // namespace

std::string lower_case_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return extension;
}

std::vector<std::string_view> extensions_of(const FormatInfo& info, FormatCapability wanted) {
  std::vector<std::string_view> all = {info.extension};
  for (std::string_view rest = is_reading(wanted) ? info.also : ""; !rest.empty();) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    all.push_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return all;
}

std::optional<FormatInfo> format_with_extension(const std::filesystem::path& path, FormatCapability wanted) {
  const std::string extension = lower_case_extension(path);
  for (const FormatInfo& info : file_formats()) {
    const auto all = extensions_of(info, wanted);
    if (info.can(wanted) && std::ranges::find(all, extension) != all.end()) return info;
  }
  return std::nullopt;
}

std::string extensions_with(FormatCapability wanted) {
  return joined(sorted_extensions(wanted), ", ");
}

Status check_capability(FileFormat format, FormatCapability capability, std::string_view content) {
  const FormatInfo& info = format_info(format);
  if (info.can(capability)) return {};
  const auto* const name = std::ranges::find(kCapabilityNames, capability, &CapabilityName::capability);
  QUOIN_ASSERT(name != std::end(kCapabilityNames), "messages name the capability");
  return make_error(ErrorCode::Unsupported,
                    "cannot write " + std::string(content) + " to " + std::string(info.extension) + ": it has no " +
                        std::string(name->missing) + "; use " +
                        joined(sorted_extensions(capability | FormatCapability::Write), " or "));
}

std::string stem_of_file(const std::filesystem::path& path) {
  std::filesystem::path name = path.filename();
  if (lower_case_extension(name) == ".gz") name = name.stem();
  return name.stem().string();
}

namespace {

/// Returns the driver of a format that is left out of the build and has the path's extension, or null.
const FormatDriver* find_left_out(const std::filesystem::path& path) {
  const std::string extension = lower_case_extension(path);
  for (const FormatDriver* const driver : format_drivers()) {
    const auto all = extensions_of(driver->info, FormatCapability::Read);
    if (!driver->left_out.empty() && std::ranges::find(all, extension) != all.end()) return driver;
  }
  return nullptr;
}

}  // namespace

std::optional<FileFormat> detect_by_name(const std::filesystem::path& path, std::span<const std::byte> beginning) {
  for (const FormatDriver* const driver : format_drivers()) {
    if (driver->detect_name != nullptr && driver->detect_name(path, beginning)) return driver->info.format;
  }
  const FormatDriver* const left_out = find_left_out(path);
  return left_out != nullptr ? std::optional(left_out->info.format) : std::nullopt;
}

std::optional<FileFormat> detect_format(std::span<const std::byte> bytes) {
  for (const FormatDriver* const driver : format_drivers()) {
    if (driver->detect != nullptr && driver->detect(bytes)) return driver->info.format;
  }
  return detect_headerless(bytes);
}

namespace {

/// Detects an open file by its content, else by its name.
Result<std::optional<FileFormat>> detect_opened(const InputFile& file) {
  // Enough compressed bytes for a decompressed header, with room for names and comments in the gzip header.
  constexpr std::size_t kEnough = 1 << 16;
  const auto bytes = file.read_beginning(kEnough);
  if (!bytes) return bytes.error();
  if (const auto format = detect_format(*bytes)) return format;
  if (bytes->size() == kEnough && is_named_like_headerless(file.path())) {
    const auto whole = file.read();
    if (!whole) return whole.error();
    if (const auto format = detect_headerless(*whole)) return format;
  }
  return detect_by_name(file.path(), *bytes);
}

}  // namespace

Result<DetectedFile> detect_file(const std::filesystem::path& path) {
  for (const FormatDriver* const driver : format_drivers()) {
    if (driver->detect_path != nullptr && driver->detect_path(path)) return DetectedFile{path, driver->info.format};
  }
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown)) {
    if (const auto format = detect_by_name(path, {})) return DetectedFile{path, format};
    if (const FormatDriver& worlds = driver_of(FileFormat::Minecraft); !worlds.left_out.empty()) {
      return with_path(Result<DetectedFile>(left_out_error(worlds)), path);
    }
    return make_error(ErrorCode::CannotRead,
                      "a folder without a Minecraft world (level.dat and region/r.X.Z.mca) or "
                      "Luanti world (world.mt)",
                      path.string());
  }
  auto file = InputFile::open(path);
  if (!file) return file.error();
  const auto format = detect_opened(*file);
  if (!format) return format.error();
  // Databases must open their files themselves, with locks.
  const bool is_kept = !*format || driver_of(**format).source != FormatDriver::Source::Path;
  return DetectedFile{path, *format, is_kept ? std::optional(std::move(*file)) : std::nullopt};
}

Result<std::optional<FileFormat>> detect_format(const std::filesystem::path& path) {
  const auto file = detect_file(path);
  return file ? file->format : Result<std::optional<FileFormat>>(file.error());
}

Result<FormatInfo> format_for_writing(const std::filesystem::path& path) {
  if (const auto format = format_with_extension(path, FormatCapability::Write)) return *format;
  if (const FormatDriver* const driver = find_left_out(path)) {
    return with_path(Result<FormatInfo>(left_out_error(*driver)), path);
  }
  return make_error(ErrorCode::Unsupported, "unknown extension; use one of " + extensions_with(FormatCapability::Write),
                    path.string());
}

Result<SavedScene> save_scene(const Scene& scene, const std::filesystem::path& path, Threads threads,
                              const Progress& progress) {
  return save({scene, nullptr, threads, progress}, path);
}

Result<SavedScene> save_scene(const LoadedScene& loaded, const std::filesystem::path& path, Threads threads,
                              const Progress& progress) {
  return save({loaded.scene, &loaded, threads, progress}, path);
}

Result<std::vector<std::string>> unsupported_features(const Scene& scene, const std::filesystem::path& path) {
  return warnings_of_saving({scene, nullptr, {}, {}}, path);
}

Result<std::vector<std::string>> unsupported_features(const LoadedScene& loaded, const std::filesystem::path& path) {
  return warnings_of_saving({loaded.scene, &loaded, {}, {}}, path);
}

Result<LoadedScene> load_scene(std::span<const std::byte> bytes, const LoadOptions& options, Threads threads,
                               const Progress& progress) {
  const FormatInput input{{}, bytes, options, threads, progress};
  if (options.raw) return read_raw(input);
  return read_as(options.heights ? FileFormat::Heights : detect_format(bytes), input);
}

std::vector<std::filesystem::path> sidecar_files_of(const std::filesystem::path& path, SidecarFiles allowed) {
  const auto file = detect_file(path);
  if (!file || !file->format) return {};
  const FormatDriver& driver = driver_of(*file->format);
  if (driver.sidecar_files != nullptr) return driver.sidecar_files(*file, allowed);
  if (driver.read_mesh == nullptr) return {};
  const auto opened = file->open();
  const auto bytes = opened ? opened->read() : Result<std::vector<std::byte>>(opened.error());
  if (!bytes) return {};
  triangles::SidecarReader sidecars(path, allowed);
  const auto mesh = triangles::read_with(driver, *bytes, sidecars, {});
  return mesh ? mesh->sidecars : std::vector<std::filesystem::path>();
}

Result<LoadedScene> load_scene(const std::filesystem::path& path, const LoadOptions& options, Threads threads,
                               const Progress& progress) {
  const auto file = options.raw ? Result<DetectedFile>(DetectedFile{path, std::nullopt}) : detect_file(path);
  return file ? load_scene(*file, options, threads, progress) : Result<LoadedScene>(file.error());
}

Result<LoadedScene> load_scene(const DetectedFile& file, const LoadOptions& options, Threads threads,
                               const Progress& progress) {
  const std::filesystem::path& path = file.path;
  FormatInput input{path, {}, options, threads, progress};
  if (options.raw) return with_path(read_raw(input), path);
  std::optional<FileFormat> format = options.heights ? FileFormat::Heights : file.format;
  const auto source = format ? driver_of(*format).source : FormatDriver::Source::Bytes;
  if (source == FormatDriver::Source::Path) return with_path(read_as(format, input), path);
  const auto opened = file.open();
  if (!opened) return opened.error();
  input.file = &*opened;
  if (source == FormatDriver::Source::File) return with_path(read_as(format, input), path);
  const auto bytes = opened->read();
  if (!bytes) return bytes.error();
  input.bytes = *bytes;
  // Detects again from the whole file: some formats need it.
  if (format != FileFormat::Heights) {
    const auto of_all = detect_format(*bytes);
    if (of_all || !can(format, FormatCapability::Meshes)) format = of_all;
  }
  return with_path(read_as(format, input), path);
}

Result<std::unique_ptr<ChunkSource>> open_chunk_source(const std::filesystem::path& path, std::string_view dimension) {
  const auto file = detect_file(path);
  if (!file) return file.error();
  return open_chunk_source(*file, dimension);
}

Result<std::unique_ptr<ChunkSource>> open_chunk_source(const DetectedFile& file, std::string_view dimension) {
  const std::optional<FileFormat>& format = file.format;
  if (can(format, FormatCapability::Chunks)) return driver_of(*format).open_chunks(file.path, {}, dimension);
  if (format && !driver_of(*format).left_out.empty()) {
    return with_path(Result<std::unique_ptr<ChunkSource>>(left_out_error(driver_of(*format))), file.path);
  }
  return make_error(ErrorCode::Unsupported,
                    format ? "a file of format " + std::string(format->name()) + ", not a world that is read by chunks"
                           : "not a world that is read by chunks",
                    file.path.string());
}

}  // namespace quoin

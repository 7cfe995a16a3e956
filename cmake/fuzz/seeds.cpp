// Writes small valid files as seeds for the fuzz targets, with Quoin's own writers.
//
// Usage: fuzz_seeds OUT CASES
// OUT/TARGET gets a file of each format that the target reads and Quoin writes, and a copy of each file in CASES
// (tests/corpus/cases) whose format the target reads. Fails if a written file cannot be read again.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>
#include <quoin/io/mesh_file.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_meshes.h>

namespace {

namespace fs = std::filesystem;
using namespace quoin;

/// Larger seeds make all inputs derived from them slow.
constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 16;

/// Returns the target that reads a format.
const char* target_of(const FormatInfo& format) {
  if (format.can(FormatCapability::Meshes)) return "triangles";
  if (format.can(FormatCapability::Volume)) return "volume";
  constexpr std::pair<FileFormat, const char*> kTargets[] = {
      {FileFormat::Vox, "vox"},         {FileFormat::Scene, "scene_file"},    {FileFormat::World, "world"},
      {FileFormat::Vdb, "vdb"},         {FileFormat::Minecraft, "minecraft"}, {FileFormat::Schematic, "minecraft"},
      {FileFormat::Heights, "heights"}, {FileFormat::LuantiMap, "luanti"},
  };
  for (const auto& [known, target] : kTargets) {
    if (known == format.format) return target;
  }
  return "models";
}

/// A grid of three types with two instances, one of them rotated.
Scene voxels() {
  Scene scene;
  const auto add = [&](Rgba8 colour, const char* name) {
    VoxelProperties properties;
    properties.colour = colour;
    properties.name = name;
    return scene.types.add(properties).value();
  };
  const VoxelType stone = add({120, 120, 128, 255}, "stone");
  const VoxelType glass = add({160, 200, 240, 120}, "glass");
  const VoxelType wood = add({110, 80, 40, 255}, "wood");
  SceneGrid placed;
  placed.name = "box";
  placed.grid.fill_box({{0, 0, 0}, {4, 3, 2}}, stone);
  placed.grid.set({1, 2, 1}, glass);
  placed.grid.set({5, 0, 0}, wood);
  Instance instance;
  instance.name = "box";
  instance.grid = scene.add_grid(std::move(placed));
  scene.add_instance(instance);
  instance.position = {0.0, 0.0, -8.0};
  instance.rotation = DQuat(0.0, 0.0, 1.0, 0.0);
  scene.add_instance(std::move(instance));
  return scene;
}

Scene field() {
  Scene scene;
  VoxelProperties properties;
  properties.colour = {180, 170, 160, 255};
  const VoxelType rock = scene.types.add(properties).value();
  SceneGrid placed;
  placed.name = "ball";
  placed.whole = true;  // worlds store it
  placed.field.add_sphere({4.0, 4.0, 4.0}, 3.0, rock);
  Instance instance;
  instance.name = "ball";
  instance.grid = scene.add_grid(std::move(placed));
  scene.add_instance(std::move(instance));
  return scene;
}

/// Ends the program if a file cannot be written or read.
void require(bool holds, const fs::path& path, const std::string& reason) {
  if (holds) return;
  std::fprintf(stderr, "fuzz_seeds: %s: %s\n", path.c_str(), reason.c_str());
  std::exit(1);
}

class Seeds {
 public:
  explicit Seeds(fs::path out) : out_(std::move(out)) { fs::remove_all(out_); }

  [[nodiscard]] fs::path file(const char* target, const std::string& name) const {
    fs::create_directories(out_ / target);
    return out_ / target / name;
  }
  void put(const char* target, const std::string& name, std::span<const std::byte> bytes) const {
    const fs::path path = file(target, name);
    const auto written = write_file(bytes, path);
    require(written.has_value(), path, written ? "" : to_string(written.error()));
  }
  /// Writes the scene in every format that supports it; voxel formats need not support fields.
  void put_scene(const Scene& scene, const std::string& name, bool is_field) const {
    for (const FormatInfo& format : file_formats()) {
      if (!format.can(FormatCapability::Write)) continue;
      const bool is_mesh = format.can(FormatCapability::Meshes);
      const fs::path path = file(target_of(format), name + std::string(format.extension));
      const std::string error = is_mesh ? write_as_mesh(scene, path) : write_as_voxels(scene, path);
      require(error.empty() || (is_field && !is_mesh), path, error);
      if (!error.empty()) continue;
      if (fs::file_size(path) > kMostBytes) {
        fs::remove(path);
        continue;
      }
      const auto again = load_scene(path);
      require(again.has_value(), path, again ? "" : to_string(again.error()));
    }
  }

 private:
  static std::string write_as_mesh(const Scene& scene, const fs::path& path) {
    const auto meshes = mesh_scene(scene);
    if (!meshes) return to_string(meshes.error());
    const auto written = write_mesh(*meshes, path);
    return written ? "" : to_string(written.error());
  }
  static std::string write_as_voxels(const Scene& scene, const fs::path& path) {
    const auto written = save_scene(scene, path);
    return written ? "" : to_string(written.error());
  }

  fs::path out_;
};

std::vector<std::byte> read(const fs::path& path) {
  auto bytes = read_file(path);
  require(bytes.has_value(), path, bytes ? "" : to_string(bytes.error()));
  return std::move(*bytes);
}

void put_images(const Seeds& seeds) {
  Image image;
  image.width = 3;
  image.height = 2;
  image.rgb.assign(18, 90);
  const auto png = write_png(image);
  require(png.has_value(), "seed.png", png ? "" : to_string(png.error()));
  for (const char* target : {"png", "heights"}) seeds.put(target, "seed.png", *png);
  FloatImage depths;
  depths.width = 3;
  depths.height = 2;
  depths.values.assign(6, 1.5F);
  const auto pfm = write_pfm(depths);
  require(pfm.has_value(), "seed.pfm", pfm ? "" : to_string(pfm.error()));
  seeds.put("pfm", "seed.pfm", *pfm);
  const std::vector<float> light = {0.0F, 0.5F, 1.0F, 2.0F, 4.0F, 8.0F};
  const auto half = ExrChannel::Type::Float16;
  const auto exr =
      write_exr(3, 2, std::vector<ExrChannel>{{"R", half, light, {}}, {"G", half, light, {}}, {"B", half, light, {}}});
  if (exr) seeds.put("radiance", "seed.exr", *exr);  // not without OpenEXR
}

/// The first byte gives the number of 256-byte blocks that belong to the database; the rest is its log.
void put_pages(const Seeds& seeds) {
  std::vector<std::byte> world = read(seeds.file("world", "voxels.quoin"));
  world.insert(world.begin(), std::byte{255});
  seeds.put("page_scan", "world", world);
}

void put_cases(const Seeds& seeds, const fs::path& cases) {
  for (const auto& entry : fs::recursive_directory_iterator(cases)) {
    if (!entry.is_regular_file() || entry.file_size() > kMostBytes) continue;
    const std::vector<std::byte> bytes = read(entry.path());
    const std::optional<FileFormat> format = detect_format(bytes);
    if (format) seeds.put(target_of(format_info(*format)), "case_" + entry.path().filename().string(), bytes);
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    std::fprintf(stderr, "usage: fuzz_seeds OUT CASES\n");
    return 2;
  }
  const Seeds seeds(arguments[1]);
  seeds.put_scene(voxels(), "voxels", false);
  seeds.put_scene(field(), "field", true);
  put_images(seeds);
  put_pages(seeds);
  put_cases(seeds, arguments[2]);
  return 0;
}

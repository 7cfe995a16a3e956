#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/axis_orientation.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/volume.h>

#include "core/bytes/bytes.h"
#include "io/byte_stream.h"
#include "io/format_driver.h"
#include "io/placed_grids.h"

namespace quoin::models {
namespace {

namespace fs = std::filesystem;

Result<EncodedFile> encoded(FileFormat format, const Scene& scene) {
  return driver_of(format).encode({.scene = scene, .progress = {}});
}

VoxelProperties type_of(Rgba8 colour, const std::string& name = "") {
  VoxelProperties type;
  type.name = name;
  type.colour = colour;
  type.visibility = colour.a == 255 ? Visibility::Opaque : Visibility::Transparent;
  return type;
}

/// Two models: one unchanged, one turned and mirrored. They have three colours, one of them transparent.
Scene two_models() {
  Scene scene;
  const VoxelType red = *scene.types.add(type_of({200, 10, 20, 255}));
  const VoxelType green = *scene.types.add(type_of({20, 180, 30, 255}));
  const VoxelType glass = *scene.types.add(type_of({40, 60, 220, 128}));
  SceneGrid grid;
  grid.name = "step";
  grid.grid.fill_box({{0, 0, 0}, {70, 2, 3}}, red);
  grid.grid.fill_box({{0, 2, 0}, {1, 5, 1}}, green);
  grid.grid.set(5, 3, 2, glass);
  const GridHandle handle = scene.add_grid(std::move(grid));
  Instance first;
  first.name = "first";
  first.grid = handle;
  first.position = {10.0, 4.0, 20.0};
  scene.add_instance(first);
  Instance second;
  second.name = "second";
  second.grid = handle;
  second.position = {200.0, 7.0, 120.0};
  second.rotation = glm::quat_cast(AxisOrientation::quarter_turns(1, 1).matrix());
  second.mirrored = true;
  scene.add_instance(second);
  return scene;
}

using Voxels = std::map<std::tuple<int, int, int>, std::tuple<int, int, int, int>>;

/// Returns the colours of the world's voxels, which are one unit large.
Voxels voxels_of(const Scene& scene) {
  FormatHolds all;
  all.extension = "test";
  const auto merged = merge_grids(scene, all);
  EXPECT_TRUE(merged) << to_string(merged.error());
  const auto colours = colours_of(scene.types);
  Voxels voxels;
  merged->voxels.for_each([&](IVec3 v, VoxelType type) {
    const Rgba8 c = colours[type];
    voxels[{v.x, v.y, v.z}] = {c.r, c.g, c.b, c.a};
  });
  return voxels;
}

/// Returns true if both scenes have the same colours at the same positions.
bool are_alike(const Scene& a, const Scene& b) {
  const auto of_a = merge_grids(a, {});
  const auto of_b = merge_grids(b, {});
  if (!of_a || !of_b || of_a->voxels.voxel_count() != of_b->voxels.voxel_count()) return false;
  const auto colours_a = colours_of(a.types);
  const auto colours_b = colours_of(b.types);
  const IBox box = of_a->voxels.bounds();
  std::vector<VoxelType> row_a(static_cast<std::size_t>(box.size().x));
  std::vector<VoxelType> row_b(row_a.size());
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      read_voxels(of_a->voxels, {box.min.x, y, z}, row_a);
      read_voxels(of_b->voxels, {box.min.x, y, z}, row_b);
      for (std::size_t x = 0; x < row_a.size(); ++x) {
        if (colours_a[row_a[x]] != colours_b[row_b[x]]) return false;
      }
    }
  }
  return true;
}

TEST(PlacedGrids, TurnsAndMirrorsLikeInstances) {
  const Scene scene = two_models();
  const Voxels voxels = voxels_of(scene);
  std::size_t expected = 0;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    const SceneGrid& grid = scene.grids()[instance.grid];
    grid.grid.for_each([&](IVec3 v, VoxelType type) {
      const DVec3 at = world_from_grid(instance, grid, DVec3(v) + 0.5);
      const IVec3 voxel = voxel_of(at);
      const auto found = voxels.find({voxel.x, voxel.y, voxel.z});
      ASSERT_NE(found, voxels.end());
      EXPECT_EQ(std::get<0>(found->second), scene.types[type].colour.r);
      ++expected;
    });
  });
  EXPECT_EQ(voxels.size(), expected);
}

TEST(WriteModels, RoundTripsQubicle) {
  const Scene scene = two_models();
  const auto file = encoded(FileFormat::Qubicle, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  EXPECT_TRUE(file->warnings.empty()) << file->warnings.front();
  const auto read = load_scene(file->bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->scene.instances().size(), 2U);
  EXPECT_EQ(voxels_of(read->scene), voxels_of(scene));
  const auto again = encoded(FileFormat::Qubicle, read->scene);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->bytes == file->bytes);
}

TEST(WriteModels, GoxelKeepsMaterialsAndVisibility) {
  Scene scene = two_models();
  VoxelProperties metal = type_of({90, 90, 90, 255}, "metal");
  metal.metalness = 0.75F;
  metal.roughness = 0.25F;
  metal.emission = 2.0F;
  const VoxelType type = *scene.types.add(metal);
  const GridHandle grid = scene.grids().handles().front();
  scene.edit(grid).grid.set(-20, 1, -33, type);
  scene.edit(scene.instances().handles().back()).visible = false;
  const auto file = encoded(FileFormat::Goxel, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  const auto read = load_scene(file->bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  // Layers for opaque, glass and metal voxels, for each of two instances.
  EXPECT_EQ(read->scene.instances().size(), 6U);
  std::size_t hidden = 0;
  read->scene.instances().for_each(
      [&](InstanceHandle, const Instance& instance) { hidden += instance.visible ? 0 : 1; });
  EXPECT_EQ(hidden, 3U);
  EXPECT_EQ(voxels_of(read->scene), voxels_of(scene));
  bool has_metal = false;
  for (std::size_t i = 1; i < read->scene.types.size(); ++i) {
    const VoxelProperties& t = read->scene.types[static_cast<VoxelType>(i)];
    has_metal |= t.metalness == 0.75F && t.roughness == 0.25F && t.emission == 2.0F && t.colour.r == 90;
  }
  EXPECT_TRUE(has_metal);
  ASSERT_EQ(file->warnings.size(), 2U);
  EXPECT_NE(file->warnings[0].find("names"), std::string::npos) << file->warnings[0];
  EXPECT_NE(file->warnings[1].find("several layers, since a layer has one material: 2"), std::string::npos);
}

TEST(WriteModels, BinvoxKeepsPositionAndSize) {
  Scene scene = two_models();
  for (const InstanceHandle handle : scene.instances().handles()) scene.edit(handle).voxel_size = 0.25;
  const auto file = encoded(FileFormat::Binvox, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  ASSERT_EQ(file->warnings.size(), 3U);
  const auto read = load_scene(file->bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  const Instance& instance = *read->scene.instances().find(read->scene.instances().handles().front());
  EXPECT_DOUBLE_EQ(instance.voxel_size, 0.25);
  FormatHolds all;
  const auto before = merge_grids(scene, all);
  const auto after = merge_grids(read->scene, all);
  EXPECT_EQ(after->box, before->box);
  EXPECT_EQ(after->voxels.voxel_count(), before->voxels.voxel_count());
  after->voxels.for_each([&](IVec3 v, VoxelType) { EXPECT_NE(before->voxels.get(v), kAir); });
}

TEST(WriteModels, BinvoxPadsOnlySmallModelsToCubes) {
  Scene scene;
  const VoxelType grey = scene.types.add({.name = "grey"}).value();
  SceneGrid grid;
  grid.grid.fill_box({{0, 0, 0}, {1'000, 1, 1}}, grey);
  Instance rod;
  rod.grid = scene.add_grid(std::move(grid));
  scene.add_instance(rod);
  const auto file = encoded(FileFormat::Binvox, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  EXPECT_LT(file->bytes.size(), 200U);
  const auto read = load_scene(file->bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->scene.voxel_count(), 1'000);
  // A smaller model is written as a cube: some readers support nothing else.
  scene.edit(rod.grid).grid.fill_box({{100, 0, 0}, {1'000, 1, 1}}, kAir);
  const auto small = encoded(FileFormat::Binvox, scene);
  ASSERT_TRUE(small);
  const std::string text(reinterpret_cast<const char*>(small->bytes.data()), small->bytes.size());
  EXPECT_NE(text.find("dim 100 100 100"), std::string::npos);
}

TEST(WriteModels, VoxlapKeepsColoursAndAddsGround) {
  Scene scene = two_models();
  const auto file = encoded(FileFormat::Voxlap, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  ASSERT_EQ(detect_format(file->bytes), FileFormat::Voxlap);
  const auto read = load_scene(file->bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  Voxels expected = voxels_of(scene);
  for (auto& [place, colour] : expected) std::get<3>(colour) = 255;  // the file has no transparency
  std::size_t ground = 0;
  const Voxels found = voxels_of(read->scene);
  for (const auto& [place, colour] : found) {
    const auto wanted = expected.find(place);
    if (wanted != expected.end()) {
      EXPECT_EQ(wanted->second, colour);
      continue;
    }
    ++ground;
    EXPECT_EQ(std::get<1>(place), 0);
    EXPECT_EQ(colour, std::tuple(101, 77, 51, 255));
  }
  EXPECT_EQ(ground, 512U * 512U - static_cast<std::size_t>(std::ranges::count_if(
                                      expected, [](const auto& e) { return std::get<1>(e.first) == 0; })));
  EXPECT_EQ(found.size(), expected.size() + ground);
  // A file read and written again is unchanged, without losses.
  const auto again = encoded(FileFormat::Voxlap, read->scene);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->bytes == file->bytes);
  EXPECT_TRUE(again->warnings.empty()) << again->warnings.front();
}

// Spans with a bottom and a filling top, and stretches without colours within.
TEST(WriteModels, RoundTripsVoxlapSpans) {
  Scene scene;
  const VoxelType red = *scene.types.add(type_of({200, 10, 20, 255}));
  const VoxelType earth = *scene.types.add(type_of({101, 77, 51, 255}));
  SceneGrid grid;
  grid.grid.fill_box({{0, 0, 0}, {512, 20, 512}}, earth);
  grid.grid.fill_box({{100, 30, 100}, {140, 60, 140}}, earth);
  grid.grid.set(120, 45, 120, red);  // hidden inside the solid
  grid.grid.fill_box({{50, 63, 50}, {60, 64, 60}}, red);
  grid.grid.set(120, 8, 120, red);
  const GridHandle handle = scene.add_grid(std::move(grid));
  Instance instance;
  instance.grid = handle;
  scene.add_instance(instance);
  const auto file = encoded(FileFormat::Voxlap, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  EXPECT_TRUE(file->warnings.empty()) << file->warnings.front();
  // Only the top layer of 20 layers of earth is visible.
  EXPECT_LT(file->bytes.size(), std::size_t{512} * 512 * 9);
  const auto read = load_scene(file->bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_TRUE(are_alike(read->scene, scene));
}

TEST(WriteModels, VoxlapGrowsForLargeMapsAndRefusesTallOnes) {
  Scene scene;
  const VoxelType red = *scene.types.add(type_of({200, 10, 20, 255}));
  SceneGrid grid;
  grid.grid.fill_box({{-3, -9, -3}, {3, 190, 600}}, red);
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  const auto file = encoded(FileFormat::Voxlap, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  const auto read = load_scene(file->bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  const IBox bounds = read->scene.grids()[read->scene.grids().handles().front()].grid.bounds();
  EXPECT_EQ(bounds.size(), IVec3(1024, 199, 1024));
  EXPECT_TRUE(
      std::ranges::any_of(file->warnings, [](const std::string& w) { return w.starts_with("moved to the centre"); }));
  scene.edit(scene.grids().handles().front()).grid.set(0, 400, 0, red);
  const auto refused = encoded(FileFormat::Voxlap, scene);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
}

TEST(WriteModels, SchematicsUseBlocksOfNearestColour) {
  Scene scene = two_models();
  const VoxelType stairs = *scene.types.add(type_of({100, 80, 50, 255}, "minecraft:oak_stairs"));
  scene.edit(scene.grids().handles().front()).grid.set(-4, 9, -4, stairs);
  const auto file = encoded(FileFormat::Schematic, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  EXPECT_TRUE(std::ranges::any_of(file->warnings, [](const std::string& w) {
    return w == "types that are not Minecraft blocks, written as the block of the nearest colour: 3";
  }));
  const auto read = load_scene(file->bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  Voxels expected = voxels_of(scene);
  const Voxels found = voxels_of(read->scene);
  ASSERT_EQ(found.size(), expected.size());
  for (const auto& [place, colour] : found) EXPECT_TRUE(expected.contains(place));
  std::vector<std::string> names;
  for (std::size_t i = 1; i < read->scene.types.size(); ++i)
    names.push_back(read->scene.types[static_cast<VoxelType>(i)].name);
  std::ranges::sort(names);
  EXPECT_EQ(names, (std::vector<std::string>{"minecraft:blue_stained_glass", "minecraft:lime_concrete",
                                             "minecraft:oak_stairs", "minecraft:red_wool"}));
  const auto again = encoded(FileFormat::Schematic, read->scene);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->bytes == file->bytes);
}

/// The written file has properties that the block reader drops because they do not change the appearance.
TEST(WriteModels, SchematicsKeepBlocksStableInTheGame) {
  Scene scene;
  SceneGrid grid;
  int x = 0;
  for (const char* const name :
       {"minecraft:oak_leaves", "minecraft:campfire", "my:odd name [with] {x}\n", "default:stone"}) {
    grid.grid.set(x++, 0, 0, *scene.types.add(type_of({100, 100, 100, 255}, name)));
  }
  const std::array<std::byte, 3> bytes = {};
  EXPECT_TRUE(grid.grid.set_data({3, 0, 0}, {0, bytes}));
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  const auto file = encoded(FileFormat::Schematic, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  const std::string text = [&] {
    const auto expanded = first_bytes(file->bytes, std::size_t{1} << 20);
    return std::string(text_of(*expanded));
  }();
  EXPECT_NE(text.find("minecraft:oak_leaves[persistent=true]"), std::string::npos);
  EXPECT_NE(text.find("minecraft:campfire[lit=false]"), std::string::npos);
  EXPECT_EQ(text.find("odd"), std::string::npos);
  EXPECT_EQ(text.find("default:"), std::string::npos);
  const auto has = [&](std::string_view line) {
    return std::ranges::find(file->warnings, line) != file->warnings.end();
  };
  EXPECT_TRUE(has("types that are not Minecraft blocks, written as the block of the nearest colour: 2"));
  EXPECT_TRUE(has("data of voxels left out, not supported by .schem: 1"));
  EXPECT_TRUE(load_scene(file->bytes));
}

TEST(PlacedGrids, RoundsHalfVoxelsConsistently) {
  Scene scene;
  const VoxelType type = *scene.types.add(type_of({1, 2, 3, 255}));
  SceneGrid grid;
  grid.name = "two\nlines";
  grid.grid.set(0, 0, 0, type);
  const GridHandle handle = scene.add_grid(std::move(grid));
  for (const double x : {-1.5, -0.5, 0.5, 1.5}) {
    Instance instance;
    instance.grid = handle;
    instance.position.x = x;
    scene.add_instance(instance);
  }
  FormatHolds holds;
  holds.extension = ".test";
  const auto merged = merge_grids(scene, holds);
  ASSERT_TRUE(merged);
  EXPECT_EQ(merged->voxels.bounds(), (IBox{{-1, 0, 0}, {3, 1, 1}}));
  EXPECT_EQ(merged->voxels.voxel_count(), 4);
  ASSERT_FALSE(merged->warnings.empty());
  EXPECT_EQ(merged->warnings.front(), "instances rounded to whole voxels: 4");
  // A hidden field is dropped with all hidden instances; names of two lines appear as one line.
  scene.edit(handle).field.add_sphere({0.0, 0.0, 0.0}, 2.0, type);
  const auto refused = merge_grids(scene, holds);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message.find('\n'), std::string::npos);
  for (const InstanceHandle each : scene.instances().handles()) scene.edit(each).visible = false;
  EXPECT_TRUE(merge_grids(scene, holds));
  std::vector<std::string> warnings;
  EXPECT_EQ(cut_name("h\u00e4ll", 2, warnings), "h");
  EXPECT_EQ(warnings.size(), 1U);
}

TEST(WriteModels, RejectsUnregisteredTypes) {
  Scene scene = two_models();
  const GridHandle grid = scene.grids().handles().front();
  scene.edit(grid).grid.set(1, 1, 1, 9);
  scene.edit(grid).grid.set(2, 1, 1, 65'535);
  for (const FileFormat format : {FileFormat::Goxel, FileFormat::Qubicle, FileFormat::Voxlap, FileFormat::Schematic,
                                  FileFormat::Binvox, FileFormat::Nifti}) {
    const auto file = encoded(format, scene);
    ASSERT_FALSE(file) << driver_of(format).info.name();
    EXPECT_EQ(file.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(file.error().message, "the instance \"first\" has voxels of type 9, which is not registered");
  }
}

TEST(WriteModels, VolumesHoldTypesOrDensities) {
  const Scene scene = two_models();
  const auto file = encoded(FileFormat::Nifti, scene);
  ASSERT_TRUE(file) << to_string(file.error());
  const auto volume = read_volume(file->bytes);
  ASSERT_TRUE(volume) << to_string(volume.error());
  EXPECT_EQ(volume->type, ScalarType::UInt8);
  FormatHolds all;
  const auto merged = merge_grids(scene, all);
  std::int64_t solid = 0;
  for (int k = 0; k < volume->size.z; ++k) {
    for (int j = 0; j < volume->size.y; ++j) {
      for (int i = 0; i < volume->size.x; ++i) {
        const float value = volume->values[static_cast<std::size_t>(i + volume->size.x * (j + volume->size.y * k))];
        const DVec3 at(volume->world_from_voxel * glm::dvec4(i, j, k, 1.0));
        ASSERT_EQ(static_cast<VoxelType>(value), merged->voxels.get(voxel_of(at)));
        solid += value > 0.0F ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(solid, merged->voxels.voxel_count());

  Scene smooth;
  const VoxelType type = *smooth.types.add(type_of({200, 10, 20, 255}));
  SceneGrid grid;
  grid.field.add_sphere({3.5, -2.0, 8.0}, 9.0, type);
  Instance instance;
  instance.grid = smooth.add_grid(std::move(grid));
  instance.position = {5.0, 6.0, 7.0};
  instance.voxel_size = 0.5;
  smooth.add_instance(instance);
  const auto densities = encoded(FileFormat::Nifti, smooth);
  ASSERT_TRUE(densities) << to_string(densities.error());
  const auto read = read_volume(densities->bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  const SceneGrid& held = smooth.grids()[instance.grid];
  for (int k = 0; k < read->size.z; ++k) {
    for (int j = 0; j < read->size.y; ++j) {
      for (int i = 0; i < read->size.x; ++i) {
        const float value = read->values[static_cast<std::size_t>(i + read->size.x * (j + read->size.y * k))];
        const DVec3 world(read->world_from_voxel * glm::dvec4(i, j, k, 1.0));
        const DVec3 sample = grid_from_world(instance, held, world);
        ASSERT_NEAR(glm::length(sample - glm::round(sample)), 0.0, 1e-4);
        ASSERT_EQ(value, -held.field.density(IVec3(glm::round(sample))));
      }
    }
  }
  EXPECT_GT(read->max, 0.0F);
  EXPECT_LT(read->min, 0.0F);
}

TEST(WriteModels, RefusesUnsupportedTransformsAndFields) {
  for (const FileFormat format : {FileFormat::Qubicle, FileFormat::Goxel, FileFormat::Voxlap, FileFormat::Binvox,
                                  FileFormat::Schematic, FileFormat::Nifti}) {
    Scene turned = two_models();
    turned.edit(turned.instances().handles().front()).rotation = glm::angleAxis(0.3, DVec3(0.0, 1.0, 0.0));
    Scene scaled = two_models();
    scaled.edit(scaled.instances().handles().front()).voxel_size = 2.0;
    Scene far = two_models();
    far.edit(far.instances().handles().front()).position.x = 1e12;
    Scene with_field = two_models();
    with_field.edit(with_field.grids().handles().front()).field.add_sphere({0.0, 0.0, 0.0}, 3.0, 1);
    for (const Scene* const scene : {&turned, &scaled, &far, &with_field}) {
      const auto refused = encoded(format, *scene);
      ASSERT_FALSE(refused);
      EXPECT_TRUE(refused.error().code == ErrorCode::Unsupported || refused.error().code == ErrorCode::LimitExceeded);
      EXPECT_EQ(refused.error().message.find('\n'), std::string::npos);
    }
    const Scene scene = two_models();
    const Progress cancel = [](double) { return false; };
    const auto cancelled = driver_of(format).encode({.scene = scene, .progress = cancel});
    ASSERT_FALSE(cancelled);
    EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
    // An empty scene gives a file or a clear refusal.
    const auto empty = encoded(format, Scene());
    EXPECT_TRUE(empty || empty.error().code == ErrorCode::Unsupported);
  }
}

#ifdef QUOIN_SOURCE_DIR
/// Real files are unchanged after reading and writing in their own format.
TEST(WriteModels, RoundTripsRealFiles) {
  const fs::path data = fs::path(QUOIN_SOURCE_DIR) / "../shared/data";
  if (!fs::exists(data)) GTEST_SKIP() << "no real files here: " << data;
  std::map<std::string, int> tried;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    const std::string extension = entry.path().extension().string();
    constexpr std::array kExtensions = {".qb", ".gox", ".vxl", ".binvox", ".schem"};
    if (std::ranges::find(kExtensions, extension) == kExtensions.end()) continue;
    const auto read = load_scene(entry.path());
    if (!read || tried[extension] >= 3) continue;
    const fs::path copy = fs::temp_directory_path() / ("quoin_written" + extension);
    const auto written = save_scene(read->scene, copy);
    ASSERT_TRUE(written) << entry.path() << ": " << to_string(written.error());
    const auto again = load_scene(copy);
    ASSERT_TRUE(again) << entry.path() << ": " << to_string(again.error());
    if (extension == ".binvox") {
      EXPECT_EQ(again->scene.voxel_count(), read->scene.voxel_count());
    } else {
      EXPECT_TRUE(are_alike(again->scene, read->scene)) << entry.path();
    }
    ++tried[extension];
    fs::remove(copy);
  }
  EXPECT_EQ(tried.size(), 5U);
}
#endif

}  // namespace
}  // namespace quoin::models

// Density fields in scene files.

#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/half.h>
#include <quoin/io/formats.h>
#include <quoin/io/scene_file.h>

#include "core/bytes/text.h"
#include "io/byte_stream.h"

namespace quoin {
namespace {

Scene scene_with(DensityGrid field) {
  Scene scene;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(scene.types.add({}));
  SceneGrid grid;
  grid.name = "hill";
  grid.field = std::move(field);
  grid.grid.fill_box({{1, 2, 3}, {9, 9, 9}}, 2);
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  return scene;
}

Result<LoadedScene> there_and_back(const Scene& scene) {
  const auto file = scene_file_of(scene);
  if (!file) return file.error();
  const auto bytes = write_scene_file(*file);
  if (!bytes) return bytes.error();
  return load_scene(*bytes);
}

void expect_same(const DensityGrid& a, const DensityGrid& b) {
  EXPECT_EQ(a.band(), b.band());
  ASSERT_EQ(a.chunks(), b.chunks());
  for (const IVec3 chunk : a.chunks()) {
    EXPECT_EQ(a.find_chunk(chunk)->content_hash(), b.find_chunk(chunk)->content_hash());
  }
}

TEST(SceneFields, RoundTripExactly) {
  std::mt19937 random(3);
  for (const float band : {8.0F, 0.3F, 20.0F}) {
    DensityGrid field(band);
    field.add_sphere({20.0, 30.0, -200.0}, 90.0, 1, 2.0);
    field.remove_sphere({20.0, 80.0, -200.0}, 30.0);
    field.edit({{-70, -5, 0}, {10, 20, 70}}, [&](IVec3, DensitySample) {
      const float density = (static_cast<float>(random()) / 2e9F - 1.0F) * 2.0F * band;
      return DensitySample{density, static_cast<VoxelType>(random() % 4)};
    });
    field.set({1'000'000, -1'000'000, 63}, {-0.0F, 3});
    const Scene scene = scene_with(field.snapshot());
    const auto back = there_and_back(scene);
    ASSERT_TRUE(back) << to_string(back.error());
    const SceneGrid& grid = back->scene.grids()[back->scene.grids().handles()[0]];
    ASSERT_NO_FATAL_FAILURE(expect_same(grid.field, field));
    EXPECT_EQ(grid.grid.chunks().size(), 1U) << "voxels beside it";
    EXPECT_EQ(grid.name, "hill");
  }
}

// Voxels precede densities; data so regular that it is stored uncompressed is written twice.
TEST(SceneFields, ReportNonDecreasingProgress) {
  DensityGrid field;
  field.add_sphere({0.0, 0.0, 0.0}, 150.0, 1);
  Scene scene = scene_with(std::move(field));
  Grid& voxels = scene.edit(scene.grids().handles()[0]).grid;
  constexpr int kChunks = 320;
  for (int i = 0; i < kChunks * kChunks; ++i) voxels.put_chunk({i % kChunks, 0, i / kChunks}, Chunk(1));
  for (const bool has_field : {true, false}) {
    if (!has_field) scene.edit(scene.grids().handles()[0]).field.clear();
    const auto file = scene_file_of(scene);
    ASSERT_TRUE(file);
    double last = 0.0;
    int reported = 0;
    ASSERT_TRUE(write_scene_file(*file, {}, [&](double fraction) {
      EXPECT_GE(fraction, last);
      last = fraction;
      ++reported;
      return true;
    }));
    EXPECT_EQ(last, 1.0);
    EXPECT_GT(reported, 2);
    const auto cancelled = write_scene_file(*file, {}, [](double) { return false; });
    ASSERT_FALSE(cancelled);
    EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
  }
}

TEST(SceneFields, RaiseFileVersionOnlyIfPresent) {
  const auto text = write_scene_file(scene_file_of(scene_with(DensityGrid())).value()).value();
  const std::string_view view(reinterpret_cast<const char*>(text.data()), text.size());
  EXPECT_NE(view.find("\"quoin_scene\": 2"), std::string_view::npos);
  EXPECT_EQ(view.find("densities"), std::string_view::npos);
  DensityGrid field;
  field.add_sphere({0, 0, 0}, 4.0, 1);
  const auto third = write_scene_file(scene_file_of(scene_with(std::move(field))).value()).value();
  EXPECT_NE(std::string_view(reinterpret_cast<const char*>(third.data()), 60).find("\"quoin_scene\": 3"),
            std::string_view::npos);
}

TEST(SceneFields, RefuseUnregisteredMaterials) {
  DensityGrid field;
  field.add_sphere({0, 0, 0}, 4.0, 9);
  const auto refused = there_and_back(scene_with(std::move(field)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(to_string(refused.error()), "grids[0] has voxels of type 9, which is not registered");
}

std::string find_grid_error(const std::string& grid) {
  const std::string text = R"({"quoin_scene": 3, "types": [{"colour": [1, 2, 3, 255]}], "grids": [{"voxels": [], )" +
                           grid + R"(}], "instances": [{"grid": 0}]})";
  const auto read = load_scene(std::as_bytes(std::span(text)));
  return read ? "none" : to_string(read.error());
}

/// Returns the error for a piece with these numbers, 16 bits each.
std::string find_densities_error(const std::vector<std::uint16_t>& words, std::size_t cut = 0) {
  std::vector<std::byte> bytes;
  for (const std::uint16_t word : words) {
    bytes.push_back(static_cast<std::byte>(word));
    bytes.push_back(static_cast<std::byte>(word >> 8));
  }
  bytes.resize(bytes.size() - cut);
  return find_grid_error(R"("densities": [")" + to_base64(gzipped(bytes, 9)) + "\"]");
}

TEST(SceneFields, ReportPositionOfDamage) {
  const std::string at = "grids[0].densities[0]: ";
  const Half solid = half_from_float(-8.0F);
  const Half beyond = half_from_float(-9.0F);
  EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, solid, 0}), "none");
  EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, solid, 0}, 1), at + "byte 21 of the voxel data: cut off");
  EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, beyond, 0}),
            at + "byte 18 of the voxel data: a density is outside the band");
  EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, 0x7E00, 0}),
            at + "byte 18 of the voxel data: a density is outside the band");
  for (const std::uint16_t none : {0x8000, 0x0001, 0x83FF}) {
    EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, none, 0}),
              at + "byte 18 of the voxel data: a density is -0 or closer to 0 than 2^-14");
  }
  EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, solid, 1}),
            at + "byte 18 of the voxel data: a density is outside the band");
  EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, 0xFFFF, 0xFFFF, beyond, 0}),
            at + "byte 22 of the voxel data: a density is outside the band");
  EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 1}),
            at + "byte 28 of the voxel data: cut off");
  std::vector<std::uint16_t> differences = {1, 0, 2, 0, 3, 0, 1, 0, 1, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF};
  differences.resize(differences.size() + 1'024, 0x7F7F);
  EXPECT_EQ(find_densities_error(differences), at + "byte 26 of the voxel data: a density is outside the band");
  EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, half_from_float(8.0F), 0}),
            at + "chunk (1, 2, 3) is empty");
  EXPECT_EQ(find_densities_error({1, 0, 2, 0, 3, 0, 1, 0, 1, solid, 0, 1, 0, 2, 0, 3, 0, 1, 0, 1, solid, 0}),
            at + "chunk (1, 2, 3) is a duplicate");
  EXPECT_EQ(find_grid_error(R"("band": 0, "densities": [])"), "grids[0].band: must be more than 0 and at most 65504");
  EXPECT_EQ(find_grid_error(R"("band": 70000, "densities": [])"),
            "grids[0].band: must be more than 0 and at most 65504");
  EXPECT_EQ(find_grid_error(R"("densities": [3])"), "grids[0].densities[0]: must be a string");
}

}  // namespace
}  // namespace quoin

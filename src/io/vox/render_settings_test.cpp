#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "core/srgb.h"
#include "io/vox/vox_for_tests.h"

namespace quoin::vox {
namespace {

using vox_test::Entries;
using vox_test::FileBuilder;

LoadedScene file_with_settings(const std::vector<Entries>& settings) {
  FileBuilder file;
  file.model(1, 1, 1, {{0, 0, 0, 1}});
  for (const Entries& each : settings) {
    file.with("rOBJ", [&](auto& out) { out.dict(each); });
  }
  return read_vox(file.file()).value();
}

FileRenderSettings settings_with(const std::vector<Entries>& settings) {
  const LoadedScene loaded = file_with_settings(settings);
  EXPECT_TRUE(loaded.render_settings.has_value());
  return loaded.render_settings.value_or(FileRenderSettings{});
}

// The settings that MagicaVoxel writes by default.
std::vector<Entries> usual() {
  return {
      {{"_type", "_bounce"}, {"_energy", "3"}, {"_diffuse", "2"}, {"_specular", "5"}, {"_scatter", "5"}},
      {{"_type", "_env"}, {"_mode", "0"}},
      {{"_type", "_inf"}, {"_i", "0.7"}, {"_k", "255 255 255"}, {"_angle", "50 50"}, {"_area", "0.07"}, {"_disk", "0"}},
      {{"_type", "_uni"}, {"_i", "0.7"}, {"_k", "255 255 255"}},
      {{"_type", "_ibl"}, {"_path", "HDR_041_Path_Env.hdr"}, {"_i", "1"}, {"_rot", "0"}},
      {{"_type", "_atm"},
       {"_ray_d", "0.4"},
       {"_ray_k", "45 104 255"},
       {"_mie_d", "0.4"},
       {"_mie_k", "255 255 255"},
       {"_mie_g", "0.85"},
       {"_o3_d", "0"},
       {"_o3_k", "105 255 110"}},
      {{"_type", "_fog_uni"}, {"_d", "0"}, {"_k", "255 255 255"}, {"_g", "0"}},
      {{"_type", "_lens"}, {"_proj", "0"}, {"_fov", "45"}, {"_aperture", "0.25"}, {"_blade_n", "0"}, {"_blade_r", "0"}},
      {{"_type", "_film"}, {"_expo", "1"}, {"_vig", "0"}, {"_aces", "1"}, {"_gam", "2.2"}},
      {{"_type", "_bloom"}, {"_mix", "0.5"}, {"_scale", "0"}, {"_aspect", "0"}, {"_threshold", "1"}},
      {{"_type", "_ground"}, {"_color", "80 80 80"}, {"_hor", "0.1"}},
      {{"_type", "_bg"}, {"_color", "0 0 0"}},
      {{"_type", "_edge"}, {"_color", "0 0 0"}, {"_width", "0.2"}},
      {{"_type", "_grid"}, {"_color", "0 0 0"}, {"_spacing", "1"}, {"_width", "0.02"}, {"_display", "0"}},
      {{"_type", "_setting"},
       {"_ground", "1"},
       {"_grid", "0"},
       {"_edge", "0"},
       {"_bg_c", "0"},
       {"_bg_a", "0"},
       {"_scale", "1 1 1"},
       {"_cell", "1"}}};
}

TEST(VoxRenderSettings, ReadsTheDefaultSettings) {
  const FileRenderSettings file = settings_with(usual());
  const Environment& environment = file.environment;
  EXPECT_TRUE(file.not_drawn.empty()) << file.not_drawn.front();
  EXPECT_EQ(environment.sky.model, SkyModel::Uniform);
  EXPECT_NEAR(environment.sky.brightness, 0.7, 1e-6);
  EXPECT_NEAR(environment.sun.brightness, 0.7, 1e-6);
  EXPECT_NEAR(environment.sun.direction.y, std::sin(50.0 * std::numbers::pi / 180.0), 1e-6);
  EXPECT_GT(environment.sun.direction.x, 0.0);
  EXPECT_GT(environment.sun.direction.z, 0.0);
  EXPECT_NEAR(environment.sun.angle_radians, 2.0 * std::atan(0.07), 1e-6);
  EXPECT_FALSE(environment.sun.is_visible);
  ASSERT_TRUE(environment.ground.has_value());
  EXPECT_NEAR(environment.ground->colour.x, linear_from_srgb(std::uint8_t{80}), 1e-6F);
  EXPECT_NEAR(environment.ground->fade, 0.1, 1e-6);
  EXPECT_FALSE(environment.sky.background.has_value());
  EXPECT_FALSE(environment.fog.has_value());
  EXPECT_NEAR(file.lens.radius, 0.25, 1e-6);
  EXPECT_EQ(file.environment.tone, ToneCurve::Aces);
  EXPECT_EQ(file.environment.bloom, Bloom{});
  EXPECT_EQ(file.max_bounces, 6);
  EXPECT_EQ(file.max_scatterings, 5);
  EXPECT_FALSE(file.is_transparent);
}

TEST(VoxRenderSettings, ReadsNoneIfFileHasNone) {
  EXPECT_FALSE(file_with_settings({}).render_settings.has_value());
}

TEST(VoxRenderSettings, ReadsAirAndSkyImages) {
  const FileRenderSettings air =
      settings_with({{{"_type", "_env"}, {"_mode", "1"}},
                     {{"_type", "_atm"}, {"_ray_d", "0.8"}, {"_ray_k", "90 104 255"}, {"_mie_g", "5"}},
                     {{"_type", "_inf"}, {"_i", "2"}}});
  EXPECT_EQ(air.environment.sky.model, SkyModel::Physical);
  EXPECT_NEAR(air.environment.sky.air.rayleigh, 2.0, 1e-6);
  EXPECT_NEAR(air.environment.sky.air.rayleigh_colour.x, 2.0F, 1e-5F);
  EXPECT_NEAR(air.environment.sky.air.mie_anisotropy, 0.99, 1e-9);
  EXPECT_NEAR(air.environment.sky.brightness, 2.0, 1e-6);
  const FileRenderSettings image = settings_with(
      {{{"_type", "_env"}, {"_mode", "2"}}, {{"_type", "_ibl"}, {"_path", "park.hdr"}, {"_i", "3"}, {"_rot", "90"}}});
  EXPECT_EQ(image.environment.sky.model, SkyModel::Image);
  EXPECT_EQ(image.environment.sky.image_file, "park.hdr");
  EXPECT_NEAR(image.environment.sky.brightness, 3.0, 1e-6);
  EXPECT_NEAR(image.environment.sky.image_turn_radians, std::numbers::pi / 2.0, 1e-6);
}

TEST(VoxRenderSettings, ReadsFogLensFilmBloomAndBackground) {
  const FileRenderSettings file =
      settings_with({{{"_type", "_fog_uni"}, {"_d", "0.02"}, {"_k", "255 0 0"}, {"_g", "0.5"}},
                     {{"_type", "_lens"}, {"_aperture", "2"}, {"_blade_n", "6"}, {"_blade_r", "30"}},
                     {{"_type", "_film"}, {"_expo", "1.5"}, {"_vig", "0.3"}, {"_aces", "0"}, {"_gam", "1.8"}},
                     {{"_type", "_bloom"}, {"_mix", "0.4"}, {"_scale", "0.5"}, {"_aspect", "0.2"}, {"_threshold", "2"}},
                     {{"_type", "_bg"}, {"_color", "255 255 255"}},
                     {{"_type", "_setting"}, {"_ground", "0"}, {"_bg_c", "1"}, {"_bg_a", "1"}}});
  ASSERT_TRUE(file.environment.fog.has_value());
  EXPECT_NEAR(file.environment.fog->density, 0.02, 1e-6);
  EXPECT_EQ(file.environment.fog->colour, Vec3(1.0F, 0.0F, 0.0F));
  EXPECT_NEAR(file.environment.fog->anisotropy, 0.5, 1e-6);
  EXPECT_EQ(file.lens.blades, 6);
  EXPECT_NEAR(file.lens.turn_radians, std::numbers::pi / 6.0, 1e-6);
  EXPECT_NEAR(file.environment.exposure.value(), 1.5, 1e-6);
  EXPECT_NEAR(file.environment.vignette, 0.3, 1e-6);
  EXPECT_EQ(file.environment.tone, ToneCurve::Clamp);
  EXPECT_NEAR(file.environment.gamma, 1.8, 1e-6);
  EXPECT_NEAR(file.environment.bloom.radius, 0.025, 1e-6);
  EXPECT_FALSE(file.environment.ground.has_value());
  EXPECT_EQ(file.environment.sky.background, Vec3(1.0F));
  EXPECT_TRUE(file.is_transparent);
  EXPECT_TRUE(file.not_drawn.empty());
}

TEST(VoxRenderSettings, NamesUnsupportedAndUnreadableSettings) {
  const FileRenderSettings file =
      settings_with({{{"_type", "_lens"}, {"_proj", "2"}, {"_fov", "60"}, {"_aperture", "much"}},
                     {{"_type", "_setting"}, {"_grid", "1"}, {"_scale", "2 2 2"}},
                     {{"_type", "_inf"}, {"_i", "nan"}, {"_angle", "1 2 3"}},
                     {{"_type", "_new"}, {"_key", "7"}}});
  const std::vector<std::string> expected = {"_inf _angle 1 2 3", "_inf _i nan",          "_lens _aperture much",
                                             "_lens _fov 60",     "_lens _proj 2",        "_new _key 7",
                                             "_setting _grid 1",  "_setting _scale 2 2 2"};
  EXPECT_EQ(file.not_drawn, expected);
  EXPECT_EQ(file.lens.radius, 0.0);
}

// Files of older versions switch a group on in the group itself.
TEST(VoxRenderSettings, OlderFilesEnableGroups) {
  const FileRenderSettings file = settings_with({{{"_type", "_ground"}, {"_color", "80 80 80"}, {"_enable", "1"}},
                                                 {{"_type", "_bg"}, {"_color", "0 0 255"}, {"_enable", "1"}},
                                                 {{"_type", "_edge"}, {"_enable", "0"}, {"_width", "0.2"}}});
  EXPECT_TRUE(file.environment.ground.has_value());
  EXPECT_EQ(file.environment.sky.background, Vec3(0.0F, 0.0F, 1.0F));
  EXPECT_TRUE(file.not_drawn.empty());
}

TEST(VoxRenderSettings, ReadsFocusDistanceOfCameras) {
  FileBuilder file;
  file.model(1, 1, 1, {{0, 0, 0, 1}});
  file.with("rCAM", [&](auto& out) {
    out.i32(3);
    out.dict({{"_mode", "pers"}, {"_focus", "1 2 3"}, {"_radius", "10"}, {"_angle", "0 0 0"}});
  });
  const LoadedScene loaded = read_vox(file.file()).value();
  ASSERT_EQ(loaded.cameras.size(), 1U);
  EXPECT_EQ(loaded.cameras.front().focus_distance, 10.0);
}

}  // namespace
}  // namespace quoin::vox

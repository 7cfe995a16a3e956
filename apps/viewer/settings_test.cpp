#include "settings.h"

#include <cstdlib>

#include <gtest/gtest.h>
#include <quoin/io/file.h>

#include "viewer_fixture.h"

namespace quoin::viewer {
namespace {

TEST(Settings, RoundTripThroughFile) {
  const ScratchFolder folder("settings");
  const auto path = folder.file("deep/er/viewer.json");
  Settings settings;
  settings.width = 1'000;
  settings.height = 700;
  settings.is_panel_shown = false;
  settings.camera_mode = CameraMode::Fly;
  settings.ui_scale = 1.5;
  settings.samples = 4;
  settings.detail_by_pixels = true;
  settings.environment.sun.direction = {0.1, 0.2, -0.3};
  settings.light.shadows = false;
  settings.light.occlusion_mode = OcclusionMode::Off;
  settings.light.occlusion_affects = OcclusionAffects::All;
  settings.light.smooth_occlusion = {SmoothOcclusion::WeightedPublished, 0.4F, 0.25F, 3.5F};
  settings.exposure = 1.25;
  settings.light.shading = Shading::UnlitWithOcclusion;
  settings.light.occlusion_distance_voxels = 12.5;
  settings.light.shadow_distance_voxels = 64.0;
  settings.environment.sun.brightness = 0.25;
  settings.environment.sky.brightness = 0.0;
  settings.environment.sky.model = SkyModel::Fixed;
  settings.light.glass_surfaces = false;
  settings.light.model = LightModel::Propagated;
  settings.light.least_light = 0.25;
  settings.light.max_lamps = 12;
  settings.environment.lamp_brightness = 8.0;
  settings.mode = DrawMode::Density;
  settings.slice = {2, 0.25};
  settings.pack = "/tmp/\xC3\xA9 1.21.jar";
  settings.note_recent("/tmp/a.vox");
  settings.note_recent("/tmp/b\n\xff.vox");
  const Status written = write_settings(settings, path);
  ASSERT_TRUE(written) << to_string(written.error());
  const Settings back = read_settings(path);
  EXPECT_EQ(back.width, 1'000);
  EXPECT_EQ(back.height, 700);
  EXPECT_FALSE(back.is_panel_shown);
  EXPECT_EQ(back.camera_mode, CameraMode::Fly);
  EXPECT_EQ(back.mode, DrawMode::Density);
  EXPECT_EQ(back.slice, (SlicePlane{2, 0.25}));
  EXPECT_EQ(back.ui_scale, 1.5);
  EXPECT_EQ(back.samples, 4);
  EXPECT_TRUE(back.detail_by_pixels);
  EXPECT_EQ(back.light, settings.light);
  EXPECT_EQ(back.environment, settings.environment);
  EXPECT_EQ(back.exposure, settings.exposure);
  EXPECT_EQ(back.pack, settings.pack);
  ASSERT_EQ(back.recent.size(), 2U);
  EXPECT_EQ(back.recent[1], "/tmp/a.vox");
}

TEST(Settings, ForgetsShadingsForDebugging) {
  for (const Shading shading : {Shading::Occlusion, Shading::Normals}) {
    Settings settings;
    settings.light.shading = shading;
    EXPECT_EQ(parse_settings(to_json(settings)).light.shading, Shading::Lit);
  }
}

TEST(Settings, ReadsSettingsOfEarlierVersions) {
  const LightOptions light = parse_settings(R"({"light": {"lit": false, "shadows": true, "occlusion": false}})").light;
  EXPECT_EQ(light.shading, Shading::Unlit);
  EXPECT_EQ(light.occlusion_mode, OcclusionMode::Off);
  EXPECT_EQ(parse_settings(R"({"light": {"lit": true, "occlusion": true}})").light, Settings{}.light);
}

TEST(Settings, IgnoresInvalidValues) {
  const std::string defaults = to_json(Settings{});
  for (const char* text : {"",
                           "{",
                           "[]",
                           "7",
                           "null",
                           "\xff\xfe",
                           "{\"width\": \"wide\"}",
                           "{\"width\": 1e300}",
                           "{\"height\": -5}",
                           "{\"samples\": 2.5}",
                           "{\"light\": []}",
                           "{\"light\": {\"sun\": [0,0,0]}}",
                           "{\"light\": {\"sun\": [1,2]}}",
                           "{\"light\": {\"sun\": [1,2,null]}}",
                           "{\"light\": {\"exposure\": 1e400}}",
                           "{\"recent\": {}}",
                           "{\"recent\": [1, \"\"]}",
                           "{\"light\": {\"shading\": \"dark\"}}",
                           "{\"light\": {\"occlusion_distance\": -1}}",
                           "{\"light\": {\"smooth_occlusion\": 3}}",
                           "{\"light\": {\"smooth_occlusion\": {\"form\": \"soft\", \"spread\": 9, \"power\": 0}}}",
                           "{\"fly\": 1}",
                           "{\"pack\": \"\"}",
                           "{\"pack\": [1]}",
                           "{\"ui_scale\": 0}"}) {
    EXPECT_EQ(to_json(parse_settings(text)), defaults) << text;
  }
  EXPECT_EQ(parse_settings("{\"height\": false, \"width\": 800}").width, 800) << "other values are kept";
}

TEST(Settings, NamePacksForImages) {
  using Paths = std::vector<std::filesystem::path>;
  Settings settings;
  EXPECT_EQ(settings.packs(), Paths{kBuiltinPack});
  settings.pack = kNoPack;
  EXPECT_EQ(settings.packs(), Paths{});
  settings.pack = "/tmp/1.21.jar";
  EXPECT_EQ(settings.packs(), (Paths{"/tmp/1.21.jar", kBuiltinPack}));
}

TEST(Settings, KeepsTenRecentFilesNewestFirst) {
  Settings settings;
  for (int i = 0; i < 30; ++i) settings.note_recent("/tmp/" + std::to_string(i % 15) + ".vox");
  EXPECT_EQ(settings.recent.size(), 10U);
  EXPECT_EQ(settings.recent.front(), "/tmp/14.vox");
  settings.note_recent("/tmp/12.vox");
  EXPECT_EQ(settings.recent.front(), "/tmp/12.vox");
  EXPECT_EQ(settings.recent.size(), 10U);
}

TEST(Settings, FollowsXdgConfigPath) {
  const auto old = [](const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? std::string() : std::string(value);
  };
  const std::string config = old("XDG_CONFIG_HOME");
  const std::string home = old("HOME");
  ::setenv("HOME", "/home/someone", 1);
  ::setenv("XDG_CONFIG_HOME", "/else/where", 1);
  EXPECT_EQ(settings_path(), "/else/where/quoin/viewer.json");
  ::setenv("XDG_CONFIG_HOME", "relative", 1);
  EXPECT_EQ(settings_path(), "/home/someone/.config/quoin/viewer.json");
  ::unsetenv("XDG_CONFIG_HOME");
  EXPECT_EQ(settings_path(), "/home/someone/.config/quoin/viewer.json");
  ::unsetenv("HOME");
  EXPECT_TRUE(settings_path().empty());
  if (!config.empty()) ::setenv("XDG_CONFIG_HOME", config.c_str(), 1);
  if (!home.empty()) ::setenv("HOME", home.c_str(), 1);
}

TEST(Settings, UsesDefaultsWithoutFile) {
  EXPECT_EQ(to_json(read_settings("/nowhere/viewer.json")), to_json(Settings{}));
  EXPECT_FALSE(write_settings({}, "/dev/null/viewer.json"));
}

}  // namespace
}  // namespace quoin::viewer

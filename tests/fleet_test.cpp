#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include <quoin/io/formats.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/scene_faces.h>

#include "../apps/demo/demo_scenes.h"
#include "tests/tool_for_tests.h"

namespace quoin {
namespace {

// The demo fleet has properties that no .vox file can hold: ships turned by any angle, with voxels of half a unit.
TEST(Fleet, RendersAlikeAfterRoundTrip) {
  const auto fleet = demo::make_fleet();
  ASSERT_TRUE(fleet);
  const TestFolder folder("fleet");
  const auto written = save_scene(*fleet, folder.file("fleet.json"));
  ASSERT_TRUE(written) << to_string(written.error());
  EXPECT_EQ(written->warnings, std::vector<std::string>());
  EXPECT_FALSE(save_scene(*fleet, folder.file("fleet.vox")));
  const auto read = load_scene(folder.file("fleet.json"));
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(count_faces(read->scene), count_faces(fleet->scene));

  const auto drawn = [](const LoadedScene& scene) {
    RenderOptions options = demo::fleet_options(scene);
    options.width = 320;
    options.height = 180;
    options.samples = 1;
    return CpuRenderer(scene.scene).render(*scene.camera, options);
  };
  const auto original = drawn(*fleet);
  const auto again = drawn(*read);
  ASSERT_TRUE(original && again);
  EXPECT_GT(original->pixels_hit, 10'000);
  EXPECT_TRUE(again->colour.rgb == original->colour.rgb);
  EXPECT_TRUE(again->depth.values == original->depth.values);
}

}  // namespace
}  // namespace quoin

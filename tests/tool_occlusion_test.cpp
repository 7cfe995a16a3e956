// Long-range occlusion rays of `quoin render`.

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>

#include "io/image/image_codecs.h"
#include "tests/tool_for_tests.h"

namespace quoin {
namespace {

class ToolOcclusion : public ToolTest {
 protected:
  /// Writes a floor 160 voxels wide with a wall 60 high on the quarter at the top of an image seen from above.
  void write_wall() {
    Scene scene;
    VoxelProperties grey;
    grey.colour = {200, 200, 200, 255};
    const VoxelType type = scene.types.add(grey).value();
    SceneGrid placed;
    placed.grid.fill_box({{0, 0, 0}, {160, 1, 160}}, type);
    placed.grid.fill_box({{0, 1, 0}, {160, 60, 40}}, type);
    scene.add_instance({"", scene.add_grid(std::move(placed)), DVec3(0.0)});
    ASSERT_TRUE(save_scene(scene, folder_.file("wall.json")));
  }
  /// Returns the largest change of the mean brightness from one floor row to the next.
  double largest_step(const std::string& flags) {
    const ToolRun result = run("render wall.json -o out.png --view top --size 160x160 --preset ao " + flags);
    EXPECT_EQ(result.status, 0) << result.err;
    const auto image = read_png(folder_.file("out.png"));
    if (!image) return 1e9;
    const auto mean = [&](int y) {
      double sum = 0.0;
      for (int x = 40; x < 120; ++x) sum += image->rgb[3 * static_cast<std::size_t>(y * image->width + x)];
      return sum / 80.0;
    };
    double largest = 0.0;
    for (int y = 70; y < 135; ++y) largest = std::max(largest, std::abs(mean(y + 1) - mean(y)));
    return largest;
  }
};

TEST_F(ToolOcclusion, LongRaysShowNoBands) {
  write_wall();
  const double turned = largest_step("--samples 4 --ao-distance 32");
  const double fixed_directions = largest_step("--samples 4 --ao-distance 32 --ao-rays 9");
  EXPECT_LT(turned, 8.0);
  EXPECT_GT(fixed_directions, 2.0 * turned) << "the floor is not where this test looks";
}

}  // namespace
}  // namespace quoin

// Compares images of a terrain with golden images to the last bit. QUOIN_ACCEPT_GOLDEN=1 (`./dev golden --accept`)
// replaces the golden images with the rendered images.

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <ostream>
#include <string>

#include <quoin/render/cpu_renderer.h>
#include <quoin/terrain/terrain.h>

#include "core/instruction_sets_for_tests.h"
#include "io/gltf/glb_for_tests.h"
#include "tests/golden_for_tests.h"
#include "tests/golden_views.h"

namespace quoin {

namespace {

using namespace golden;

const GoldenView& view_called(const std::string& name) {
  return *std::find_if(kViews.begin(), kViews.end(), [&](const GoldenView& view) { return view.name == name; });
}

/// The same terrain, cut off at x = 64.
Scene scene_without_neighbours() {
  VoxelRegistry types;
  Grid grid = terrain(types);
  grid.fill_box({{64, 0, 0}, {128, 64, 128}}, kAir);
  return scene_of(std::move(types), std::move(grid));
}

RenderedImage render(const Scene& scene, const GoldenView& view, const RenderOptions& options, Threads threads = {}) {
  return CpuRenderer(scene).render(camera_for(view), options, threads).value();
}

/// Returns the number of pixels in which an altered image differs from the golden image.
std::int64_t wrong_pixels(const RenderedImage& altered, const GoldenView& view) {
  const auto golden = read_png(golden_folders().golden / (std::string(view.name) + ".png"));
  if (!golden || golden->rgb.size() != altered.colour.rgb.size()) {
    ADD_FAILURE() << "no golden image of this size";
    return 0;
  }
  return difference_of(altered.colour, *golden).pixels;
}

class Golden : public ::testing::TestWithParam<GoldenView> {};

TEST_P(Golden, MatchesGoldenImage) {
  const GoldenView& view = GetParam();
  const RenderedImage image = render(terrain_scene(), view, options_for(view));
  if (const char* accept = std::getenv("QUOIN_ACCEPT_GOLDEN"); accept != nullptr && std::string(accept) == "1") {
    const auto path = golden_folders().golden / (std::string(view.name) + ".png");
    ASSERT_TRUE(write_png(image.colour, path)) << path;
  }
  EXPECT_TRUE(is_golden(image.colour, view.name, golden_folders()));
}

TEST_P(Golden, IsSameWithPlainInstructionsAndOneThread) {
  const GoldenView& view = GetParam();
  const Scene scene = terrain_scene();
  const RenderOptions options = options_for(view);
  const RenderedImage usual = render(scene, view, options);
  const InstructionSetOverride over(InstructionSet::Plain);
  const RenderedImage plain = render(scene, view, options, {1});
  EXPECT_EQ(difference_of(plain.colour, usual.colour).pixels, 0);
  EXPECT_TRUE(plain.depth.values == usual.depth.values);
}

INSTANTIATE_TEST_SUITE_P(Views, Golden, ::testing::ValuesIn(kViews),
                         [](const auto& view) { return std::string(view.param.name); });

TEST(GoldenAltered, ShadowViewFailsWithoutShadows) {
  const GoldenView& view = view_called("shadow");
  RenderOptions options = options_for(view);
  options.light.shadows = false;
  const std::int64_t wrong = wrong_pixels(render(terrain_scene(), view, options), view);
  EXPECT_GT(wrong, kPixels / 8) << "of " << kPixels;
}

TEST(GoldenAltered, AoViewFailsWithoutOcclusion) {
  const GoldenView& view = view_called("ao");
  RenderOptions options = options_for(view);
  options.light.occlusion_mode = OcclusionMode::Off;
  const std::int64_t wrong = wrong_pixels(render(terrain_scene(), view, options), view);
  EXPECT_GT(wrong, kPixels / 2) << "of " << kPixels;
}

TEST(GoldenAltered, BoundaryViewFailsWithoutTheNeighbour) {
  const GoldenView& view = view_called("boundary");
  const RenderOptions options = options_for(view);
  const RenderedImage whole = render(terrain_scene(), view, options);
  const RenderedImage halved = render(scene_without_neighbours(), view, options);
  EXPECT_GT(wrong_pixels(halved, view), kPixels / 3) << "of " << kPixels;
  // The remaining half changes too: the missing half no longer blocks light across the border.
  int same_place = 0;
  int other_light = 0;
  for (std::size_t i = 0; i < whole.depth.values.size(); ++i) {
    if (whole.depth.values[i] != halved.depth.values[i] || std::isinf(whole.depth.values[i])) continue;
    ++same_place;
    const auto pixel = static_cast<std::ptrdiff_t>(3 * i);
    const auto colour = whole.colour.rgb.begin() + pixel;
    if (!std::equal(colour, colour + 3, halved.colour.rgb.begin() + pixel)) ++other_light;
  }
  EXPECT_GT(same_place, kPixels / 5) << "of " << kPixels;
  EXPECT_GT(other_light, 100) << "of " << same_place;
}

TEST(GoldenComparer, WritesDifferenceImages) {
  const TestFolder folder("golden_comparer");
  const GoldenFolders folders{folder.file("golden"), folder.file("failures")};
  std::filesystem::create_directories(folders.golden);
  const Image right{2, 1, {10, 20, 30, 40, 50, 60}};
  ASSERT_TRUE(write_png(right, folders.golden / "a.png"));
  EXPECT_TRUE(is_golden(right, "a", folders));
  EXPECT_FALSE(std::filesystem::exists(folders.failures / "a.actual.png"));
  Image wrong = right;
  wrong.rgb[4] = 51;
  const auto failure = is_golden(wrong, "a", folders);
  EXPECT_FALSE(failure);
  EXPECT_NE(std::string(failure.message()).find("a: 1 of 2 pixels differ, by up to 1\n"), std::string::npos)
      << failure.message();
  EXPECT_EQ(read_png(folders.failures / "a.actual.png")->rgb, wrong.rgb);
  EXPECT_EQ(read_png(folders.failures / "a.difference.png")->rgb, (std::vector<std::uint8_t>{0, 0, 0, 0, 64, 0}));
  EXPECT_TRUE(is_golden(right, "a", folders)) << "and once it is right again";
  EXPECT_FALSE(std::filesystem::exists(folders.failures / "a.actual.png")) << "the images of the failure are deleted";
}

TEST(GoldenComparer, FailsWithoutComparableImage) {
  const TestFolder folder("golden_nothing");
  const GoldenFolders folders{folder.file("golden"), folder.file("failures")};
  std::filesystem::create_directories(folders.golden);
  const Image image{2, 1, {10, 20, 30, 40, 50, 60}};
  EXPECT_FALSE(is_golden(image, "a", folders)) << "no golden image";
  EXPECT_TRUE(std::filesystem::exists(folders.failures / "a.actual.png"));
  ASSERT_TRUE(write_png(Image{1, 2, image.rgb}, folders.golden / "a.png"));
  EXPECT_FALSE(is_golden(image, "a", folders)) << "as many pixels, but another size";
}

}  // namespace

}  // namespace quoin

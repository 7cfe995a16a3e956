// Compares path-traced images with golden images to the last bit. Accepts them in the same way as golden_test.cpp.

#include <array>
#include <cstdlib>
#include <ostream>
#include <string>

#include <quoin/render/path_tracer.h>

#include "core/instruction_sets_for_tests.h"
#include "io/gltf/glb_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/path/town_for_tests.h"
#include "tests/golden_for_tests.h"
#include "tests/golden_views.h"

namespace quoin {
namespace {

using namespace golden;

struct PathView {
  const char* name;
  bool is_town;  // otherwise the terrain
  DVec3 sun;
  double exposure;
};

void PrintTo(const PathView& view, std::ostream* out) {
  *out << view.name;
}

const std::array<PathView, 3> kPathViews = {{
    {"paths_terrain", false, {-1.0, 0.9, -0.5}, 1.0},
    {"paths_day", true, {-0.48, 0.72, 0.5}, 1.0},
    {"paths_dusk", true, {-1.0, -0.03, 0.4}, 6.0},  // lamps, glass and gold
}};

PathOptions options_of(const PathView& view) {
  PathOptions options;
  options.width = options.height = 64;
  options.samples = 16;
  physical_in(options).sun.direction = view.sun;
  return options;
}

Image taken(const PathView& view, const PathOptions& options, Threads threads = {}) {
  const Scene scene = view.is_town ? render_test::town() : terrain_scene();
  const Camera camera = view.is_town ? render_test::of_town() : camera_for(kViews[1]);
  const auto image = PathTracer(scene).render(camera, options, threads);
  return develop(image.value(), {view.exposure, ToneCurve::Neutral}).value();
}

class GoldenPaths : public ::testing::TestWithParam<PathView> {};

TEST_P(GoldenPaths, MatchesGoldenImageWithAnyInstructionsAndThreads) {
  const PathView& view = GetParam();
  const Image usual = taken(view, options_of(view));
  if (const char* accept = std::getenv("QUOIN_ACCEPT_GOLDEN"); accept != nullptr && std::string(accept) == "1") {
    const auto path = golden_folders().golden / (std::string(view.name) + ".png");
    ASSERT_TRUE(write_png(usual, path)) << path;
  }
  EXPECT_TRUE(is_golden(usual, view.name, golden_folders()));
  const InstructionSetOverride over(InstructionSet::Plain);
  EXPECT_EQ(difference_of(taken(view, options_of(view), {1}), usual).pixels, 0);
}

// Each golden image fails when its feature is switched off.
TEST_P(GoldenPaths, DiffersWithoutBouncesLampsOrSun) {
  const PathView& view = GetParam();
  const auto golden = read_png(golden_folders().golden / (std::string(view.name) + ".png"));
  ASSERT_TRUE(golden.has_value());
  PathOptions options = options_of(view);
  options.max_bounces = 0;
  EXPECT_GT(difference_of(taken(view, options), *golden).pixels, 64 * 64 / 4);
  options = options_of(view);
  physical_in(options).lamp_brightness = 0.0;
  EXPECT_EQ(difference_of(taken(view, options), *golden).pixels > 64 * 64 / 4, view.is_town);
  options = options_of(view);
  physical_in(options).sun.brightness = 0.0;
  EXPECT_EQ(difference_of(taken(view, options), *golden).pixels > 64 * 64 / 16, view.sun.y > 0.0);
}

INSTANTIATE_TEST_SUITE_P(Views, GoldenPaths, ::testing::ValuesIn(kPathViews),
                         [](const auto& view) { return std::string(view.param.name); });

}  // namespace
}  // namespace quoin

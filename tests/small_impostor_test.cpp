// Compares impostors at common sizes, 64 to 8 pixels, with the traced image: holes, outlines, colours and steps as the
// distance changes. QUOIN_NIGHTLY=1 tests all directions and all sizes.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <quoin/io/formats.h>
#include <quoin/render/cpu_renderer.h>

#include "../apps/demo/demo_scenes.h"
#include "core/srgb.h"
#include "core/work/nightly_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/impostor/impostor_test_support.h"

namespace quoin {
namespace {

using namespace render_test;

// A model at the world origin, and the same model in white, which shows how much of each pixel it covers.
struct SmallModel {
  std::string name;
  Scene scene;
  Scene white;
  std::unique_ptr<CpuRenderer> renderer;  // renders both models and keeps their impostors
  std::unique_ptr<CpuRenderer> white_renderer;
  double radius = 0.0;

  SmallModel(std::string of_name, Scene with) : name(std::move(of_name)), scene(std::move(with)) {
    const DBox box = scene.bounds();
    const DVec3 centre = 0.5 * (box.min + box.max);
    for (const InstanceHandle handle : scene.instances().handles()) scene.edit(handle).position -= centre;
    radius = 0.5 * glm::length(box.max - box.min);
    white = scene.snapshot();
    for (VoxelType type = 1; type < white.types.size(); ++type) {
      VoxelProperties properties;
      properties.colour = {255, 255, 255, 255};
      white.types.replace(type, properties);
    }
    renderer = std::make_unique<CpuRenderer>(scene);
    white_renderer = std::make_unique<CpuRenderer>(white);
  }
};

// Wires one voxel thick: poles, beams and diagonals.
Grid wires() {
  Grid grid;
  for (int i = 0; i < 96; i += 16) {
    grid.fill_box({{i, 0, 0}, {i + 1, 96, 1}}, 1);
    grid.fill_box({{0, i, 40}, {96, i + 1, 41}}, 2);
    for (int k = 0; k < 96; ++k) grid.set({k, k, i}, 3);
  }
  return grid;
}

// A tree: leaves with gaps between them.
Grid crown() {
  Grid grid;
  std::mt19937 random(3);
  for (int i = 0; i < 9'000; ++i) {
    const auto coordinate = [&] { return static_cast<int>(random() % 61) - 30; };
    const IVec3 at{coordinate(), coordinate(), coordinate()};
    if (glm::length(DVec3(at)) < 30.0) grid.set(at, static_cast<VoxelType>(1 + random() % 2));
  }
  grid.fill_box({{-2, -60, -2}, {2, -20, 2}}, 3);
  return grid;
}

Scene scene_of(Grid grid, DensityGrid field = DensityGrid()) {
  Scene scene;
  scene.types = workloads::three_types();
  SceneGrid placed;
  placed.grid = std::move(grid);
  placed.field = std::move(field);
  Instance instance;
  instance.rotation = glm::angleAxis(0.5, glm::normalize(DVec3(0.3, 1.0, 0.2)));
  instance.grid = scene.add_grid(std::move(placed));
  scene.add_instance(instance);
  return scene;
}

Scene demo_castle() {
  Scene scene;
  const auto palette = demo::add_palette(scene.types);
  SceneGrid placed;
  placed.grid = demo::make_island(*palette);
  Instance instance;
  instance.grid = scene.add_grid(std::move(placed));
  scene.add_instance(instance);
  return scene;
}

struct Source {
  const char* name;
  std::function<Scene()> make;
};

std::vector<Source> made_models() {
  const auto of = [](Model model) { return [model] { return scene_of(voxels_of(model), field_of(model)); }; };
  return {{"demo castle", demo_castle},
          {"ship", of(Model::Ship)},
          {"terrain", of(Model::Terrain)},
          {"wires", [] { return scene_of(wires()); }},
          {"ball", of(Model::Ball)},
          {"box", of(Model::Box)},
          {"comb", of(Model::Comb)},
          {"crown", [] { return scene_of(crown()); }},
          {"smooth hills", of(Model::SmoothHills)},
          {"village", of(Model::Village)}};
}

constexpr std::array kFiles = {"vox__scene_church1.vox", "vox__obj_house4a.vox", "vox__veh_train.vox"};

std::filesystem::path folder_of_files() {
  return std::filesystem::path(QUOIN_SOURCE_DIR) / ".." / "shared" / "data" / "vox" / "mikelovesrobots+mmmm";
}

// Returns directions all around, the first one as far from every view as possible: 27.57 degrees.
DVec3 direction_of(int index, int count) {
  if (index == 0) return glm::normalize(DVec3(1.0, 0.5224, 0.0));
  const double height = 1.0 - 2.0 * (index - 0.5) / (count - 1);
  const double turn = 2.399963229728653 * index;
  const double across = std::sqrt(std::max(1.0 - height * height, 0.0));
  return {across * std::cos(turn), height, across * std::sin(turn)};
}

// Returns a rolled camera that looks at the model; the bounding sphere spans `pixels`.
Camera camera_at(const SmallModel& model, DVec3 direction, double pixels, int size, double roll) {
  const double fov = 0.3;
  const double distance = size / (2.0 * std::tan(fov / 2.0)) * 2.0 * model.radius / pixels;
  Camera camera = towards(direction * distance, {0.001, 0.002, 0.003}, fov);
  const DVec3 right = camera.right;
  camera.right = right * std::cos(roll) + camera.up * std::sin(roll);
  camera.up = camera.up * std::cos(roll) - right * std::sin(roll);
  return camera;
}

Image taken_by(const CpuRenderer& renderer, const Camera& camera, const RenderOptions& options) {
  auto image = renderer.render(camera, options);
  EXPECT_TRUE(image.has_value());
  return image ? std::move(image->colour) : Image{};
}

RenderOptions all_far(RenderOptions options) {
  options.detail.policy.emplace().rule = DetailPolicy::Rule::ByRadius;
  options.detail.policy->near_radii = 0.0;
  options.detail.policy->mid_radii = 0.0;
  return options;
}

// An image, and the model's coverage of each pixel.
struct Seen {
  std::vector<float> coverage;
  Image image;
};

Vec3 linear_at(const Image& image, std::size_t pixel) {
  return linear_colour({image.rgb[3 * pixel], image.rgb[3 * pixel + 1], image.rgb[3 * pixel + 2], 255});
}

Seen seen_in(const SmallModel& model, const Camera& camera, const RenderOptions& options) {
  RenderOptions flat = options;
  flat.light.shading = Shading::Unlit;
  environment_in(flat).sky.brightness = 0.0;
  const Image covered = taken_by(*model.white_renderer, camera, flat);
  Seen seen;
  for (std::size_t i = 0; i < covered.rgb.size() / 3; ++i) seen.coverage.push_back(linear_at(covered, i).x);
  seen.image = taken_by(*model.renderer, camera, options);
  return seen;
}

// Returns the pixels whose 3x3 neighbourhoods are fully covered.
std::vector<std::size_t> interior_of(const Seen& truth, int size) {
  std::vector<std::size_t> inside;
  for (int y = 1; y + 1 < size; ++y) {
    for (int x = 1; x + 1 < size; ++x) {
      float least = 1.0F;
      for (int k = 0; k < 9; ++k) {
        least = std::min(least, truth.coverage[static_cast<std::size_t>((y - 1 + k / 3) * size + x - 1 + k % 3)]);
      }
      if (least >= 1.0F) inside.push_back(static_cast<std::size_t>(y * size + x));
    }
  }
  return inside;
}

// Sums over all directions.
struct Findings {
  std::int64_t holes = 0;
  std::int64_t interior = 0;
  std::int64_t both = 0;  // pixels inside both outlines, where the model covers half of the pixel
  std::int64_t any = 0;   // pixels inside at least one outline
  double worst_overlap = 1.0;
  double worst_colour = 0.0;
  std::array<double, 3> colours{};  // sums over the traced outlines of the colour differences
  std::int64_t outline = 0;

  [[nodiscard]] double hole_share() const {
    return static_cast<double>(holes) / static_cast<double>(std::max<std::int64_t>(interior, 1));
  }
  [[nodiscard]] double overlap() const { return any == 0 ? 1.0 : static_cast<double>(both) / static_cast<double>(any); }

  [[nodiscard]] double colour() const {
    double most = 0.0;
    for (const double sum : colours) most = std::max(most, std::abs(sum));
    return most / static_cast<double>(std::max<std::int64_t>(outline, 1));
  }

  void take(const Seen& truth, const Seen& seen) {
    Findings own;
    for (std::size_t i = 0; i < truth.coverage.size(); ++i) {
      const bool in_truth = truth.coverage[i] >= 0.5F;
      // Differences of two of 64 samples are ignored.
      const bool is_alike = std::abs(truth.coverage[i] - seen.coverage[i]) < 0.035F;
      const bool in_seen = is_alike ? in_truth : seen.coverage[i] >= 0.5F;
      own.both += in_truth && in_seen, own.any += in_truth || in_seen;
      own.outline += in_truth;
      for (std::size_t c = 0; in_truth && c < 3; ++c) {
        own.colours[c] += truth.image.rgb[3 * i + c] - seen.image.rgb[3 * i + c];
      }
    }
    both += own.both, any += own.any;
    worst_overlap = std::min(worst_overlap, own.overlap());
    worst_colour = std::max(worst_colour, own.colour());
    for (std::size_t c = 0; c < 3; ++c) colours[c] += own.colours[c];
    outline += own.outline;
  }
};

struct Views {
  int directions = 24;
  int samples = 64;  // per pixel
};

Findings look_at(const SmallModel& model, int pixels, const Views& views) {
  Findings found;
  const int size = pixels + 8;
  // Small images render fast and contain few pixels, so more of them are rendered.
  const int step = is_nightly() ? 1 : pixels <= 8 ? 2 : 11;
  for (int i = 0; i < views.directions; i += step) {
    const Camera camera = camera_at(model, direction_of(i, views.directions), pixels, size, 0.31 * i);
    RenderOptions options = sized(size, size);
    options.samples = views.samples;
    const Seen truth = seen_in(model, camera, options);
    const Seen seen = seen_in(model, camera, all_far(options));
    RenderOptions single = all_far(options);
    single.samples = 1;
    const Seen once = seen_in(model, camera, single);
    const std::vector<std::size_t> inside = interior_of(truth, size);
    found.interior += static_cast<std::int64_t>(inside.size());
    for (const std::size_t pixel : inside) found.holes += once.coverage[pixel] < 0.5F;
    found.take(truth, seen);
  }
  return found;
}

std::vector<int> sizes_of() {
  if (is_nightly()) return {64, 48, 42, 32, 21, 16, 11, 8};
  return {48, 21, 8};
}

void expect_like_the_traced_image(const SmallModel& model, const Views& views = {}) {
  for (const int pixels : sizes_of()) {
    const Findings found = look_at(model, pixels, views);
    std::printf("%s, %d px: holes %.3f %% of %lld, overlap %.3f (worst %.3f), colour %.1f (worst %.1f)\n",
                model.name.c_str(), pixels, 100.0 * found.hole_share(), static_cast<long long>(found.interior),
                found.overlap(), found.worst_overlap, found.colour(), found.worst_colour);
    EXPECT_LE(found.hole_share(), 0.0005) << model.name << ", " << pixels << " pixels";
    EXPECT_GE(found.overlap(), pixels >= 42 ? 0.97 : 0.95) << model.name << ", " << pixels << " pixels";
    EXPECT_LE(found.colour(), 3.0) << model.name << ", " << pixels << " pixels";
  }
}

TEST(SmallImpostors, LookLikeTracedImage) {
  for (const Source& source : made_models()) {
    expect_like_the_traced_image(SmallModel(source.name, source.make()));
  }
}

TEST(SmallImpostors, RealFilesLookLikeTracedImage) {
  if (!std::filesystem::exists(folder_of_files())) GTEST_SKIP() << "without the real files";
  for (const char* name : kFiles) {
    auto loaded = load_scene(folder_of_files() / name);
    ASSERT_TRUE(loaded.has_value()) << name;
    expect_like_the_traced_image(SmallModel(name, std::move(loaded->scene)));
  }
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(a.rgb[i] - b.rgb[i]);
  return sum / static_cast<double>(a.rgb.size());
}

// Finds the largest changes of both images in steps of half a percent. A single step of a small image turns over a
// handful of samples, of either image by chance; people see the largest of many steps.
struct Changes {
  double drawn = 0.0;
  double traced = 0.0;
};

Changes changes_of(const SmallModel& model, int direction, double from_pixels, double to_pixels) {
  constexpr int kSize = 72;
  Changes most;
  Image last;
  Image last_traced;
  for (double pixels = from_pixels; pixels > to_pixels; pixels /= 1.005) {
    const Camera camera = camera_at(model, direction_of(direction, 24), pixels, kSize, 0.31 * direction);
    Image traced = taken_by(*model.renderer, camera, sized(kSize, kSize));
    Image drawn = taken_by(*model.renderer, camera, all_far(sized(kSize, kSize)));
    if (!last.rgb.empty()) {
      // Relative to the number of pixels that the model's sphere spans.
      const double scale = kSize * kSize / (pixels * pixels);
      most.drawn = std::max(most.drawn, scale * mean_difference(drawn, last));
      most.traced = std::max(most.traced, scale * mean_difference(traced, last_traced));
    }
    last = std::move(drawn), last_traced = std::move(traced);
  }
  return most;
}

// Covers every threshold between two levels, in windows of 45 steps; by day each window with every other model.
TEST(SmallImpostors, ChangeAtMostTwiceAsTracedImage) {
  int models = 0;
  for (const Source& source : made_models()) {
    ++models;
    const SmallModel model(source.name, source.make());
    double worst = 0.0;
    int window = 0;
    for (double pixels = 64.0; pixels > 8.0; pixels /= 1.25, ++window) {
      if (!is_nightly() && (window + models) % 2 != 0) continue;
      const int first = is_nightly() ? 0 : 7 * window % 24;
      for (int direction = first; direction < (is_nightly() ? 24 : first + 1); direction += 5) {
        const Changes most = changes_of(model, direction, pixels, pixels / 1.25);
        // Changes below 1 of 255 are invisible.
        worst = std::max(worst, most.drawn / std::max(most.traced, 1.0));
      }
    }
    std::printf("%s: up to %.2f times the change of the traced image\n", source.name, worst);
    EXPECT_LE(worst, 2.0) << source.name;
  }
}

}  // namespace
}  // namespace quoin

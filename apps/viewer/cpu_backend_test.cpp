#include "cpu_backend.h"

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <numbers>
#include <random>
#include <string>
#include <thread>
#include <vector>

#ifdef __linux__
#include <sys/resource.h>
#endif

#include <gtest/gtest.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>

#include "loader.h"
#include "viewer_fixture.h"

namespace quoin::viewer {
namespace {

/// Counts calls from another thread and waits for them.
class Bell {
 public:
  void ring() {
    const std::lock_guard lock(mutex_);
    ++rings_;
    rung_.notify_all();
  }
  /// Returns false if no call came for a minute.
  bool wait() {
    std::unique_lock lock(mutex_);
    const bool came = rung_.wait_for(lock, std::chrono::seconds(60), [this] { return rings_ > 0; });
    rings_ = 0;
    return came;
  }

 private:
  std::mutex mutex_;
  std::condition_variable rung_;
  int rings_ = 0;
};

ViewRequest request_for(const Scene& scene, View view, int width = 90, int height = 61) {
  ViewRequest request;
  request.width = width;
  request.height = height;
  request.camera = frame_scene(scene, view, static_cast<double>(width) / height);
  request.samples = 4;
  return request;
}

Image expected(const Scene& scene, const ViewRequest& request) {
  RenderOptions options;
  options.width = request.width;
  options.height = request.height;
  options.samples = request.samples;
  options.light = request.light;
  options.environment = marched_environment(request);
  return CpuRenderer(scene).render(request.camera, options).value().colour;
}

/// A backend with counted frames.
struct Watched {
  explicit Watched(const Scene& scene, double first_frame_seconds = 0.0)
      : backend(scene, {InstanceFilter::Visible, {2}, first_frame_seconds}, [this] { bell.ring(); }) {}

  /// Returns the frames until the image has settled; empty if it did not.
  std::vector<ViewFrame> settle() {
    std::vector<ViewFrame> frames;
    while (bell.wait()) {
      auto frame = backend.take();
      if (!frame) continue;
      frames.push_back(std::move(*frame));
      if (frames.back().is_settled) return frames;
    }
    return {};
  }

  Bell bell;
  CpuBackend backend;
};

TEST(CpuBackend, SettlesOnlyLatestRequest) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene, 10.0);
  ViewRequest request = request_for(loaded.scene, View::Iso);
  request.samples = 1;
  watched.backend.show(request);
  ASSERT_FALSE(watched.settle().empty()) << "the speed is known now, and the next image is the last one";
  request.camera.position.x += 1.0;
  watched.backend.show(request);
  ASSERT_TRUE(watched.bell.wait());
  ViewRequest other = request_for(loaded.scene, View::Top, 64, 48);
  watched.backend.show(other);
  const auto frame = watched.backend.take();
  ASSERT_TRUE(frame);
  EXPECT_FALSE(frame->colour.width == request.width && frame->is_settled);
}

TEST(CpuBackend, PathsConvergeToPathTracerImage) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  ViewRequest request = request_for(loaded.scene, View::Iso, 48, 32);
  request.mode = DrawMode::Paths;
  request.exposure = 1.5;
  FileRenderSettings settings;
  settings.environment.sky.model = SkyModel::Uniform;
  settings.environment.ground.emplace();
  settings.environment.tone = ToneCurve::Aces;
  request.render_settings = std::make_shared<const FileRenderSettings>(settings);
  watched.backend.show(request);
  const auto frames = watched.settle();
  ASSERT_GE(frames.size(), 5U);
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_GE(frames[i].samples, frames[i - 1].samples);
  PathOptions options;
  options.environment = settings.environment;
  options.environment->ground->height = loaded.scene.bounds().min.y;
  options.width = 48;
  options.height = 32;
  options.samples = frames.back().samples;
  options.denoise = true;
  const auto image = PathTracer(loaded.scene).render(request.camera, options);
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(frames.back().colour.rgb, develop(*image, {1.5, ToneCurve::Aces}).value().rgb);
  // Switches to another mode and back.
  request.mode = DrawMode::Rays;
  watched.backend.show(request);
  EXPECT_FALSE(watched.settle().empty());
}

TEST(CpuBackend, PathsContinueAcrossEditsAndRestartOnMove) {
  LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  ViewRequest request = request_for(loaded.scene, View::Iso, 96, 64);
  request.mode = DrawMode::Paths;
  watched.backend.show(request);
  const auto frames = watched.settle();
  ASSERT_FALSE(frames.empty());
  const Image before = frames.back().colour;
  EXPECT_GT(frames.size(), 4U);
  const GridHandle grid = loaded.scene.grids().handles().front();
  const auto edited = [&](const IBox& box, VoxelType type) {
    {
      const ScenePause pause(watched.backend);
      loaded.scene.edit(grid).grid.fill_box(box, type);
    }
    return watched.settle();
  };
  const IBox corner{{61, 0, 31}, {71, 4, 41}};  // of the hill's ground, all of one type
  const auto after = edited(corner, kAir);
  ASSERT_FALSE(after.empty());
  ASSERT_EQ(after.front().colour.width, request.width) << "as large as the image before, however coarse the new parts";
  EXPECT_TRUE(after.front().is_whole);
  EXPECT_FALSE(after.front().is_settled);
  EXPECT_LT(differing(after.front().colour, before, 8), 0.25) << "most of it stays";
  EXPECT_GT(differing(after.back().colour, before, 8), 0.001);
  EXPECT_EQ(after.back().samples, kPathSamples);
  PathOptions options = path_options(request, request.width, request.height, kPathSamples, loaded.scene.bounds());
  const auto image = PathTracer(loaded.scene).render(request.camera, options, {2});
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(after.back().colour.rgb, develop(*image, develop_options(request)).value().rgb);
  // The same after undoing the edit.
  const auto again = edited(corner, 1);
  ASSERT_FALSE(again.empty());
  EXPECT_LT(differing(again.front().colour, before, 8), 0.25);
  EXPECT_EQ(again.back().colour.rgb, before.rgb);
  // Another view starts without history.
  request.camera.position.x += 1.0;
  watched.backend.show(request);
  const auto elsewhere = watched.settle();
  ASSERT_FALSE(elsewhere.empty());
  EXPECT_LT(elsewhere.front().colour.width, request.width);
}

TEST(CpuBackend, SettlesOnExactRendererImage) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  for (const View view : {View::Iso, View::Top}) {
    ViewRequest request = request_for(loaded.scene, view);
    request.environment.sun.direction = {-0.5, 0.6, 0.1};
    watched.backend.show(request);
    const auto frames = watched.settle();
    ASSERT_FALSE(frames.empty());
    EXPECT_EQ(frames.back().colour.rgb, expected(loaded.scene, request).rgb);
    EXPECT_TRUE(frames.back().is_whole);
    EXPECT_EQ(frames.back().samples, 4);
    EXPECT_GT(frames.back().rays, 0);
  }
}

// Path-traced images of the night are no darker than half of the marched ones.
TEST(CpuBackend, PathsMatchBrightnessOfRaysAtNight) {
  const LoadedScene loaded = small_scene();
  const auto mean = [](const Image& image) {
    double sum = 0.0;
    for (const auto value : image.rgb) sum += value;
    return sum / static_cast<double>(image.rgb.size());
  };
  for (const double degrees : {30.0, -5.0, -20.0, -60.0}) {
    const double radians = degrees * std::numbers::pi / 180.0;
    ViewRequest request = request_for(loaded.scene, View::Iso, 48, 32);
    request.light = natural_light();
    request.environment.sun.direction = {0.0, std::sin(radians), std::cos(radians)};
    const double marched = mean(expected(loaded.scene, request));
    const auto options = path_options(request, 48, 32, 16, loaded.scene.bounds());
    const auto rendered = PathTracer(loaded.scene).render(request.camera, options, {2});
    ASSERT_TRUE(rendered.has_value());
    const double traced = mean(develop(*rendered, develop_options(request)).value());
    EXPECT_GT(traced, 0.5 * marched) << degrees;
    EXPECT_LT(traced, 2.0 * marched) << degrees;
  }
}

TEST(CpuBackend, DropsFramesOfPreviousMode) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  ViewRequest request = request_for(loaded.scene, View::Iso);
  watched.backend.show(request);
  for (const DrawMode mode : {DrawMode::Paths, DrawMode::Rays, DrawMode::Paths}) {
    // A frame of the previous mode may be ready or in progress.
    ASSERT_TRUE(watched.bell.wait());
    request.mode = mode;
    watched.backend.show(request);
    const auto frame = watched.backend.take();
    EXPECT_TRUE(!frame || frame->mode == mode);
    const auto frames = watched.settle();
    ASSERT_FALSE(frames.empty());
    for (const ViewFrame& one : frames) EXPECT_EQ(one.mode, mode);
    request.camera.position.x += 0.5;
    watched.backend.show(request);
  }
}

#ifdef __linux__
TEST(CpuBackend, DrawsAtLowerThreadPriority) {
  const auto yielding = [] {
    int count = 0;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
      const auto thread = static_cast<id_t>(std::stoul(task.path().filename().string()));
      count += ::getpriority(PRIO_PROCESS, thread) > ::getpriority(PRIO_PROCESS, 0) ? 1 : 0;
    }
    return count;
  };
  const int before = yielding();
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  watched.backend.show(request_for(loaded.scene, View::Iso));
  ASSERT_FALSE(watched.settle().empty());
  EXPECT_GT(yielding(), before);
}
#endif

TEST(CpuBackend, RefinesImages) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  watched.backend.show(request_for(loaded.scene, View::Iso, 400, 300));
  const auto frames = watched.settle();
  ASSERT_FALSE(frames.empty());
  for (std::size_t i = 1; i < frames.size(); ++i) {
    EXPECT_GE(frames[i].colour.width, frames[i - 1].colour.width);
    EXPECT_GE(frames[i].samples, frames[i - 1].samples);
  }
  EXPECT_FALSE(watched.backend.take()) << "a frame is taken once";
}

TEST(CpuBackend, KeepsMovingImagesAboveQuarterSize) {
  const LoadedScene loaded = small_scene();
  // No image is that fast.
  Watched watched(loaded.scene, 1e-9);
  ViewRequest request = request_for(loaded.scene, View::Iso, 403, 299);
  for (int i = 0; i < 40; ++i) {
    request.camera.position.x += 0.1;
    watched.backend.show(request);
    ASSERT_TRUE(watched.bell.wait());
    const auto frame = watched.backend.take();
    if (!frame) continue;
    EXPECT_GE(frame->colour.width, 101);
    EXPECT_GE(frame->colour.height, 75);
    EXPECT_FALSE(frame->is_settled);
  }
  request.camera.position.x += 0.1;
  watched.backend.show(request);
  const auto frames = watched.settle();
  ASSERT_FALSE(frames.empty());
  EXPECT_EQ(frames.back().colour.rgb, expected(loaded.scene, request).rgb);
}

TEST(CpuBackend, DrawsMovingImagesInFullWhenTimeAllows) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene, 1e9);
  ViewRequest request = request_for(loaded.scene, View::Iso);
  request.light = natural_light();
  watched.backend.show(request);
  ASSERT_FALSE(watched.settle().empty());
  request.camera.position.x += 1.0;
  watched.backend.show(request);
  const auto frames = watched.settle();
  ASSERT_FALSE(frames.empty());
  for (const ViewFrame& frame : frames) EXPECT_TRUE(frame.is_whole) << "the time of pixels is known";
  request.samples = 1;
  if (frames.front().samples == 1) {
    EXPECT_EQ(frames.front().colour.rgb, expected(loaded.scene, request).rgb) << "in full light";
  }
}

TEST(CpuBackend, DraftsMovingImagesInReducedLightWhenTimeIsShort) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  ViewRequest request = request_for(loaded.scene, View::Iso);
  request.light = natural_light();
  ASSERT_EQ(request.light.occlusion_mode, OcclusionMode::Rays);
  for (const Shading shading : {Shading::Lit, Shading::Normals}) {
    request.light.shading = shading;
    watched.backend.show(request);
    const auto frames = watched.settle();
    ASSERT_FALSE(frames.empty());
    ViewRequest first = request;
    first.width = (request.width + 3) / 4;
    first.height = (request.height + 3) / 4;
    first.samples = 1;
    if (shading == Shading::Lit) {
      first.light.occlusion_mode = OcclusionMode::Vertex;
      first.light.max_lamps = std::min(first.light.max_lamps, 2);
    }
    // A frame that is not taken in time is replaced by the next.
    if (frames.front().colour.width == first.width) {
      EXPECT_EQ(frames.front().colour.rgb, expected(loaded.scene, first).rgb);
    }
    EXPECT_EQ(frames.back().colour.rgb, expected(loaded.scene, request).rgb);
  }
}

TEST(CpuBackend, IgnoresRepeatedRequest) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  const ViewRequest request = request_for(loaded.scene, View::Iso);
  watched.backend.show(request);
  ASSERT_FALSE(watched.settle().empty());
  watched.backend.show(request);
  watched.backend.pause();
  watched.backend.resume(false);
  EXPECT_FALSE(watched.backend.take());
}

TEST(CpuBackend, SettlesOnLastOfManyRequests) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene, 0.01);
  ViewRequest request;
  for (int i = 0; i < 200; ++i) {
    request = request_for(loaded.scene, static_cast<View>(i % 6), 80 + i % 7, 60 + i % 5);
    watched.backend.show(request);
  }
  while (watched.bell.wait()) {
    const auto frame = watched.backend.take();
    if (!frame || !frame->is_settled) continue;
    EXPECT_EQ(frame->colour.rgb, expected(loaded.scene, request).rgb);
    return;
  }
  FAIL() << "never settled";
}

TEST(CpuBackend, DrawsEdits) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  Document document = small_document();
  Watched watched(document.scene());
  const ViewRequest request = request_for(document.scene(), View::Iso);
  watched.backend.show(request);
  for (int edit = 0; edit < 12; ++edit) {
    {
      const ScenePause pause(watched.backend);
      SceneHit hit;
      hit.instance = document.scene().instances().handles().front();
      hit.voxel = {static_cast<int>(random() % 70), 4, static_cast<int>(random() % 40)};
      const Brush brush{static_cast<BrushAction>(random() % 3), BrushShape::Sphere, 4, 3};
      ASSERT_TRUE(document.begin_stroke(brush, hit));
      document.end_stroke();
    }
    if (edit % 4 != 3) continue;
    const auto frames = watched.settle();
    ASSERT_FALSE(frames.empty());
    EXPECT_EQ(frames.back().colour.rgb, expected(document.scene(), request).rgb);
  }
}

TEST(CpuBackend, DensityModeMatchesSliceExactly) {
  Scene scene;
  SceneGrid ball;
  ball.field.add_sphere({20, 21, 22}, 15.0, kAir);
  scene.add_instance({"", scene.add_grid(std::move(ball))});
  Watched watched(scene);
  ViewRequest request = request_for(scene, View::Iso);
  request.mode = DrawMode::Density;
  for (const SlicePlane place : {SlicePlane{1, 0.5}, SlicePlane{0, 0.25}}) {
    request.slice = place;
    watched.backend.show(request);
    const std::vector<ViewFrame> frames = watched.settle();
    ASSERT_FALSE(frames.empty());
    DensitySliceOptions options;
    options.width = request.width;
    options.height = request.height;
    options.axis = place.axis;
    options.at = place.at;
    EXPECT_EQ(frames.back().colour.rgb, draw_density_slice(scene, options).value().colour.rgb);
    EXPECT_TRUE(frames.back().is_whole);
    EXPECT_FALSE(watched.backend.pick(request.camera, 45, 30, request.width, request.height));
  }
  request.mode = DrawMode::Rays;
  watched.backend.show(request);
  const std::vector<ViewFrame> frames = watched.settle();
  ASSERT_FALSE(frames.empty());
  EXPECT_EQ(frames.back().colour.rgb, expected(scene, request).rgb);
  EXPECT_TRUE(watched.backend.pick(request.camera, 45, 30, request.width, request.height));
}

TEST(CpuBackend, ReportsDensityModeWithoutField) {
  const Scene scene;
  Watched watched(scene);
  ViewRequest request;
  request.width = request.height = 32;
  request.mode = DrawMode::Density;
  watched.backend.show(request);
  ASSERT_TRUE(watched.bell.wait());
  EXPECT_TRUE(watched.backend.fault());
}

TEST(CpuBackend, PicksVisibleVoxel) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  const ViewRequest request = request_for(loaded.scene, View::Top);
  const auto hit = watched.backend.pick(request.camera, 45.0, 30.5, request.width, request.height);
  const auto same = pick(SceneTracer(loaded.scene), request.camera, {45.0, 30.5, request.width, request.height});
  ASSERT_EQ(hit.has_value(), same.has_value());
  if (hit) {
    EXPECT_EQ(hit->voxel, same->voxel);
  }
  EXPECT_FALSE(watched.backend.pick(request.camera, 0.5, 0.5, request.width, request.height));
  EXPECT_FALSE(watched.backend.pick(request.camera, 0.5, 0.5, 0, 0));
}

TEST(CpuBackend, PicksAgainAfterSceneUpdate) {
  LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  EXPECT_TRUE(watched.backend.is_up_to_date());
  const ViewRequest request = request_for(loaded.scene, View::Front);
  const auto hits = [&] {
    int count = 0;
    for (int y = 0; y < request.height; ++y) {
      count += watched.backend.pick(request.camera, 30.5, y + 0.5, request.width, request.height).has_value() ? 1 : 0;
    }
    return count;
  };
  const int before = hits();
  EXPECT_GT(before, 0);
  const auto update_with = [&](auto edit) {
    watched.backend.pause();
    for (const GridHandle grid : loaded.scene.grids().handles()) edit(loaded.scene.edit(grid).grid);
    watched.backend.resume(true);
    while (!watched.backend.is_up_to_date()) ASSERT_TRUE(watched.bell.wait());
  };
  update_with([](Grid& grid) { grid.fill_box({{0, 10, 0}, {71, 20, 41}}, 1); });
  EXPECT_GT(hits(), before) << "a higher scene";
  update_with([](Grid& grid) { grid.clear(); });
  EXPECT_EQ(hits(), 0);
}

TEST(CpuBackend, ReportsInvalidRequests) {
  const LoadedScene loaded = small_scene();
  Watched watched(loaded.scene);
  ViewRequest request = request_for(loaded.scene, View::Iso);
  request.exposure = -1.0;
  watched.backend.show(request);
  while (!watched.backend.fault()) ASSERT_TRUE(watched.bell.wait());
  EXPECT_NE(watched.backend.fault()->message.find("exposure"), std::string::npos);
  request.exposure = 1.0;
  watched.backend.show(request);
  ASSERT_FALSE(watched.settle().empty());
  EXPECT_FALSE(watched.backend.fault());
}

TEST(CpuBackend, StopsDuringRendering) {
  const LoadedScene loaded = small_scene();
  for (int i = 0; i < 30; ++i) {
    Watched watched(loaded.scene);
    watched.backend.show(request_for(loaded.scene, View::Iso, 640, 480));
    if (i % 2 == 0) watched.bell.wait();
    if (i % 3 == 0) watched.backend.pause();
  }
}

TEST(CpuBackend, SettlesOnEmptyScene) {
  const Scene empty;
  Watched watched(empty);
  const ViewRequest request = request_for(empty, View::Iso, 20, 10);
  watched.backend.show(request);
  const auto frames = watched.settle();
  ASSERT_FALSE(frames.empty());
  EXPECT_EQ(frames.back().colour.rgb, expected(empty, request).rgb) << "only sky";
}

MakeBackend by_processor() {
  return [](const Document& document) {
    return std::make_unique<CpuBackend>(document.scene(), CpuBackendOptions{}, nullptr);
  };
}

// Other looks of the same types: a shape, then a cube again.
TEST(CpuBackend, ShowsOtherPacks) {
  const ScratchFolder folder("looks");
  const auto house = write_house(folder);
  const auto document = Document::open(house, {.packs = {write_stone_pack(folder, "red", 16)}});
  ASSERT_TRUE(document) << to_string(document.error());
  Watched watched((*document)->scene());
  const ViewRequest request = request_for((*document)->scene(), View::Iso);
  watched.backend.show(request);
  ASSERT_FALSE(watched.settle().empty());
  const std::vector<std::vector<std::filesystem::path>> lists = {
      {write_stone_pack(folder, "half", 8)}, {}, {kBuiltinPack}, {folder.file("red")}};
  std::vector<std::vector<std::uint8_t>> images;
  for (const auto& packs : lists) {
    const auto packed = packed_types(*(*document)->plain_types(), packs);
    ASSERT_TRUE(packed);
    {
      const ScenePause pause(watched.backend);
      (*document)->set_looks(packed->types);
    }
    const auto frames = watched.settle();
    ASSERT_FALSE(frames.empty());
    const auto fresh = Document::open(house, {.packs = packs});
    ASSERT_TRUE(fresh);
    EXPECT_EQ(frames.back().colour.rgb, expected((*fresh)->scene(), request).rgb);
    for (const auto& other : images) EXPECT_NE(frames.back().colour.rgb, other);
    images.push_back(frames.back().colour.rgb);
  }
  EXPECT_FALSE((*document)->is_dirty());
}

TEST(PackLoader, ReadsInBackground) {
  const ScratchFolder folder("packing");
  const auto document = Document::open(write_house(folder));
  ASSERT_TRUE(document);
  Bell bell;
  const std::string pack = write_stone_pack(folder, "half", 8).string();
  const PackLoader loader(*(*document)->plain_types(), {pack}, pack, [&bell] { bell.ring(); });
  ASSERT_TRUE(bell.wait());
  while (!loader.is_done()) std::this_thread::yield();
  ASSERT_TRUE(loader.result());
  EXPECT_TRUE(loader.result()->types.has_shapes());
  EXPECT_EQ(loader.choice(), pack);
  const PackLoader absent({}, {folder.file("absent.jar")}, "absent.jar", nullptr);
  while (!absent.is_done()) std::this_thread::yield();
  ASSERT_FALSE(absent.result());
  EXPECT_EQ(absent.result().error().code, ErrorCode::CannotRead);
}

TEST(Loader, ReadsInBackground) {
  const ScratchFolder folder("loader");
  std::vector<std::string> warnings;
  ASSERT_TRUE(small_document().write(folder.file("hill.vox"), warnings));
  Bell bell;
  Loader loader(folder.file("hill.vox"), {}, {}, PackFallback::Error, by_processor(), [&bell] { bell.ring(); });
  ASSERT_TRUE(bell.wait());
  ASSERT_TRUE(loader.is_done());
  auto opened = loader.take();
  ASSERT_TRUE(opened) << to_string(opened.error());
  EXPECT_EQ(opened->document->scene().voxel_count(), small_scene().scene.voxel_count());
  EXPECT_EQ(opened->backend->name(), "processor");
}

TEST(Loader, CancelsAtAnyTime) {
  const ScratchFolder folder("cancelled");
  std::vector<std::string> warnings;
  ASSERT_TRUE(small_document().write(folder.file("hill.vox"), warnings));
  for (int attempt = 0; attempt < 50; ++attempt) {
    Loader loader(folder.file("hill.vox"), {}, {}, PackFallback::Error, by_processor(), nullptr);
    loader.cancel();
    while (!loader.is_done()) std::this_thread::yield();
    const auto result = loader.take();
    if (!result) {
      EXPECT_EQ(result.error().code, ErrorCode::Cancelled);
    }
  }
}

TEST(Loader, ReportsReadErrors) {
  Bell bell;
  Loader loader("/nowhere/a.vox", {}, {}, PackFallback::Error, by_processor(), [&bell] { bell.ring(); });
  ASSERT_TRUE(bell.wait());
  EXPECT_EQ(loader.take().error().code, ErrorCode::CannotRead);
}

TEST(Saver, WritesTheDocument) {
  const ScratchFolder folder("saver");
  const Document document = small_document();
  Bell bell;
  {
    Saver saver(document, folder.file("a.glb"), true, [&bell] { bell.ring(); });
    ASSERT_TRUE(bell.wait());
    ASSERT_TRUE(saver.is_done());
    EXPECT_TRUE(saver.status());
    EXPECT_EQ(saver.fraction(), 1.0);
  }
  EXPECT_GT(std::filesystem::file_size(folder.file("a.glb")), 1'000U);
}

}  // namespace
}  // namespace quoin::viewer

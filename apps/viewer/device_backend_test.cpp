#include "device_backend.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <future>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/smooth_scene.h>

#include "core/work/nightly_for_tests.h"
#include "loader.h"
#include "viewer_fixture.h"

namespace quoin::viewer {
namespace {

/// Skipped without a device; fails on every message of the validation layer. All tests of one process share a renderer.
// Software devices compile the path tracer's shader for up to a minute, longer next to other work.
constexpr std::chrono::minutes kLongestWait{4};

class DeviceBackendTest : public ::testing::Test {
 protected:
  static void TearDownTestSuite() { shared_.reset(); }
  void SetUp() override {
    messages_.clear();
    if (!shared_) {
      VulkanOptions options;
      options.on_validation_message = [](const std::string& text) { messages_.push_back(text); };
      auto made = VulkanRenderer::create(options);
      if (!made) made = VulkanRenderer::create();
      if (!made) GTEST_SKIP() << made.error().message;
      shared_ = std::make_shared<VulkanRenderer>(std::move(*made));
    }
    renderer_ = shared_;
  }
  void TearDown() override {
    for (const std::string& message : messages_) ADD_FAILURE() << message;
  }

  [[nodiscard]] std::unique_ptr<DeviceBackend> backend_of(const Document& document, bool rays_on_device = true) {
    DeviceBackendOptions options;
    options.cpu.threads = {2};
    options.rays_on_device = rays_on_device;
    return backend_of(document, options);
  }

  [[nodiscard]] std::unique_ptr<DeviceBackend> backend_of(const Document& document,
                                                          const DeviceBackendOptions& options) {
    const auto open = [opened = renderer_]() -> Result<std::shared_ptr<VulkanRenderer>> { return opened; };
    return std::make_unique<DeviceBackend>(document.scene(), options, open, std::function<void()>());
  }

  static ViewRequest request_for(const Document& document, DrawMode mode) {
    ViewRequest request;
    request.width = cases(112, 160);
    request.height = cases(70, 100);
    request.camera = frame_scene(document.scene(), View::Iso, 1.6);
    request.samples = 4;
    request.mode = mode;
    return request;
  }

  /// Returns the frames until the image has settled, requested as a window does; empty if it did not in time.
  static std::vector<Image> settle(DeviceBackend& backend) {
    std::vector<Image> images;
    const auto end = std::chrono::steady_clock::now() + kLongestWait;
    while (std::chrono::steady_clock::now() < end) {
      const auto frame = backend.take();
      if (const auto fault = backend.fault()) ADD_FAILURE() << to_string(*fault);
      if (!frame) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      auto image = frame->on_device ? frame->on_device->read() : Result<Image>(frame->colour);
      EXPECT_TRUE(image) << to_string(image.error());
      images.push_back(std::move(*image));
      if (frame->is_settled) return images;
    }
    return {};
  }

  /// Returns true if the device is a software device.
  [[nodiscard]] bool is_processor() const { return renderer_->device().kind == "cpu"; }

  std::shared_ptr<VulkanRenderer> renderer_;

 private:
  static inline std::shared_ptr<VulkanRenderer> shared_;
  static inline std::vector<std::string> messages_;
};

Image by_processor(const Scene& scene, const ViewRequest& request) {
  RenderOptions options;
  options.width = request.width;
  options.height = request.height;
  options.samples = request.samples;
  options.light = request.light;
  options.environment = marched_environment(request);
  options.detail.colours = request.detail_colours;
  if (request.detail_by_pixels) options.detail.policy.emplace();
  return CpuRenderer(scene).render(request.camera, options).value().colour;
}

Image by_processor(const Document& document, const ViewRequest& request) {
  return by_processor(document.scene(), request);
}

void edit(Document& document, DeviceBackend& backend, IVec3 voxel) {
  const ScenePause pause(backend);
  SceneHit hit{};
  hit.instance = document.scene().instances().handles().front();
  hit.voxel = voxel;
  hit.face = Direction::PosY;
  Brush brush;
  brush.action = BrushAction::Remove;
  brush.radius = 4;
  ASSERT_TRUE(document.begin_stroke(brush, hit));
  document.end_stroke();
}

/// Returns true if the condition becomes true within a minute.
bool comes(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + kLongestWait;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

TEST_F(DeviceBackendTest, RaysSettleOnTheCpuImageAndFollowEdits) {
  Document document = small_document();
  const auto backend = backend_of(document);
  const ViewRequest request = request_for(document, DrawMode::Rays);
  backend->show(request);
  EXPECT_TRUE(backend->wants_frames());
  auto images = settle(*backend);
  ASSERT_FALSE(images.empty());
  EXPECT_LT(differing(images.back(), by_processor(document, request), 2), 0.001);
  EXPECT_FALSE(backend->wants_frames());
  EXPECT_FALSE(backend->take());
  edit(document, *backend, {30, 12, 20});
  EXPECT_TRUE(backend->wants_frames());
  images = settle(*backend);
  ASSERT_FALSE(images.empty());
  EXPECT_LT(differing(images.back(), by_processor(document, request), 2), 0.001);
}

TEST_F(DeviceBackendTest, MeshesFollowEditsAndUndo) {
  Document document = small_document();
  const auto backend = backend_of(document);
  ViewRequest request = request_for(document, DrawMode::Blocks);
  request.samples = 1;
  request.light.occlusion_mode = OcclusionMode::Vertex;
  request.light.shadows = false;
  backend->show(request);
  auto images = settle(*backend);
  ASSERT_FALSE(images.empty());
  const Image before = images.back();
  // Glass and silhouettes differ a little; see VulkanMeshRenderer.
  EXPECT_LT(differing(before, by_processor(document, request), 6), 0.05);
  edit(document, *backend, {30, 12, 20});
  images = settle(*backend);
  ASSERT_FALSE(images.empty());
  EXPECT_GT(differing(before, images.back(), 6), 0.003) << "the edit is seen";
  EXPECT_LT(differing(images.back(), by_processor(document, request), 6), 0.05);
  {
    const ScenePause pause(*backend);
    ASSERT_TRUE(document.undo());
  }
  images = settle(*backend);
  ASSERT_FALSE(images.empty());
  EXPECT_EQ(images.back().rgb, before.rgb);
  EXPECT_FALSE(backend->stats().empty());
}

TEST_F(DeviceBackendTest, DrawsEveryModeAndShading) {
  Document document = small_document();
  const auto backend = backend_of(document);
  std::vector<Image> all;
  for (const DrawMode mode : {DrawMode::Rays, DrawMode::Blocks, DrawMode::Smooth}) {
    for (const Shading shading : {Shading::Lit, Shading::Occlusion, Shading::Normals}) {
      for (const Wireframe wireframe : {Wireframe::Off, Wireframe::Over, Wireframe::Only}) {
        // Rays have no edges, and edges alone have no shading.
        if (mode == DrawMode::Rays && wireframe != Wireframe::Off) continue;
        if (wireframe == Wireframe::Only && shading != Shading::Lit) continue;
        ViewRequest request = request_for(document, mode);
        request.light.shading = shading;
        request.wireframe = wireframe;
        backend->show(request);
        const auto images = settle(*backend);
        ASSERT_FALSE(images.empty());
        for (const Image& other : all) EXPECT_GT(differing(other, images.back(), 6), 0.001);
        all.push_back(images.back());
      }
    }
  }
  EXPECT_EQ(all.size(), 17U);
}

// The device's path-traced images match the processor's, converge, and continue across edits.
TEST_F(DeviceBackendTest, PathsConvergeAndFollowEdits) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Document document = small_document();
  const auto backend = backend_of(document);
  ViewRequest request = request_for(document, DrawMode::Paths);
  request.width = 48;
  request.height = 32;
  backend->show(request);
  const auto rendered_of = [&](int samples) {
    Image image;
    const bool came = comes([&] {
      const auto frame = backend->take();
      if (!frame || !frame->is_whole || frame->samples != samples) return false;
      image = frame->on_device ? frame->on_device->read().value_or(Image{}) : frame->colour;
      return true;
    });
    EXPECT_TRUE(came);
    return image;
  };
  const auto by_paths = [&] {
    const Scene& scene = document.scene();
    const PathOptions options = path_options(request, request.width, request.height, 4, scene.bounds());
    return develop(PathTracer(scene).render(request.camera, options).value(), develop_options(request)).value();
  };
  const Image before = rendered_of(4);
  EXPECT_LT(differing(before, by_paths(), 4), 0.02);
  edit(document, *backend, {30, 12, 20});
  Image first;
  EXPECT_TRUE(comes([&] {
    const auto frame = backend->take();
    if (frame) first = frame->on_device ? frame->on_device->read().value_or(Image{}) : frame->colour;
    return frame.has_value();
  }));
  EXPECT_EQ(first.width, request.width) << "as large as the image before";
  EXPECT_LT(differing(first, before, 8), 0.3) << "most of it stays";
  const Image after = rendered_of(4);
  EXPECT_GT(differing(before, after, 4), 0.001);
  EXPECT_LT(differing(after, by_paths(), 4), 0.02);
  EXPECT_EQ(backend->name(), renderer_->device().name);
}

// The resolution of the first image follows from the times of earlier images of the same kind.
TEST_F(DeviceBackendTest, PathTracingTimesDoNotAffectRays) {
  const Document document = small_document();
  DeviceBackendOptions options;
  options.cpu.threads = {2};
  options.rays_on_device = true;
  options.frame_seconds = 1e9;
  const auto backend = backend_of(document, options);
  ViewRequest request = request_for(document, DrawMode::Rays);
  const auto width_of_first = [&] {
    backend->show(request);
    const std::vector<Image> images = settle(*backend);
    return images.empty() ? 0 : images.front().width;
  };
  EXPECT_EQ(width_of_first(), request.width / 8) << "no time is known yet";
  request.camera.position.y += 1.0;
  EXPECT_EQ(width_of_first(), request.width);
  ViewRequest of_paths = request;
  of_paths.mode = DrawMode::Paths;
  of_paths.width = 16;
  of_paths.height = 8;
  for (const int width : {2, 16}) {
    backend->show(of_paths);
    std::optional<ViewFrame> first;
    ASSERT_TRUE(comes([&] { return (first = backend->take()).has_value(); }));
    ASSERT_TRUE(first->on_device);
    EXPECT_EQ(first->on_device->read().value_or(Image{}).width, width);
    of_paths.camera.position.y += 1.0;
  }
  EXPECT_EQ(width_of_first(), request.width / 8);
}

TEST_F(DeviceBackendTest, SmoothMeshesUseRequestedOcclusion) {
  Document document = small_document();
  const auto backend = backend_of(document);
  ViewRequest request = request_for(document, DrawMode::Smooth);
  request.light.shading = Shading::Occlusion;
  const auto shown = [&](const SmoothOcclusionOptions& smooth) {
    request.light.smooth_occlusion = smooth;
    backend->show(request);
    const auto images = settle(*backend);
    return images.empty() ? Image{} : images.back();
  };
  const Image plain = shown({});
  ASSERT_FALSE(plain.rgb.empty());
  const Image weighted = shown({SmoothOcclusion::Weighted, 3.0F, 0.4F, 2.0F});
  EXPECT_GT(differing(plain, weighted, 6), 0.005);
  EXPECT_EQ(shown({}).rgb, plain.rgb);
  // After several changes in a row, with an edit among them, the last one counts.
  request.light.smooth_occlusion.spread = 1.0F;
  backend->show(request);
  (void)backend->take();
  edit(document, *backend, {30, 12, 20});
  request.light.smooth_occlusion.spread = 4.0F;
  backend->show(request);
  (void)backend->take();
  const Image edited = shown({SmoothOcclusion::Weighted, 3.0F, 0.4F, 2.0F});
  const auto fresh = backend_of(document);
  fresh->show(request);
  const auto images = settle(*fresh);
  ASSERT_FALSE(images.empty());
  EXPECT_EQ(edited.rgb, images.back().rgb);
}

TEST_F(DeviceBackendTest, MarchesSmoothOcclusionOnCpu) {
  const Document document = small_document();
  const auto backend = backend_of(document);
  ViewRequest request = request_for(document, DrawMode::Rays);
  backend->show(request);
  ASSERT_FALSE(settle(*backend).empty());
  request.light.occlusion_mode = OcclusionMode::Smooth;
  backend->show(request);
  const auto images = settle(*backend);
  ASSERT_FALSE(images.empty());
  EXPECT_EQ(images.back().rgb, by_processor(document, request).rgb);
}

TEST_F(DeviceBackendTest, MarchesRaysOnFasterCpu) {
  const Document document = small_document();
  const auto backend = backend_of(document, false);
  const ViewRequest request = request_for(document, DrawMode::Rays);
  backend->show(request);
  const auto images = settle(*backend);
  ASSERT_FALSE(images.empty());
  EXPECT_EQ(images.back().rgb, by_processor(document, request).rgb);
  EXPECT_EQ(backend->name(), "processor");
}

TEST_F(DeviceBackendTest, DrawsLevelsOfDetailOnDevice) {
  const Document document = small_document();
  const auto backend = backend_of(document, true);
  ViewRequest request = request_for(document, DrawMode::Rays);
  request.detail_by_pixels = true;
  request.detail_colours = true;
  // Far enough away for an impostor, and near enough for none.
  for (const double times : {1.0, 6.0}) {
    request.camera.position *= times;
    backend->show(request);
    const auto images = settle(*backend);
    ASSERT_FALSE(images.empty());
    EXPECT_LT(differing(images.back(), by_processor(document, request), 2), 0.001) << times;
    EXPECT_EQ(backend->name(), renderer_->device().name);
  }
}

TEST_F(DeviceBackendTest, DrawsMeshesWithLevelsOfDetail) {
  const Document document = small_document();
  const auto backend = backend_of(document, true);
  ViewRequest request = request_for(document, DrawMode::Blocks);
  request.samples = 1;
  request.detail_by_pixels = true;
  request.light.occlusion_mode = OcclusionMode::Vertex;
  request.light.shadows = false;
  backend->show(request);
  ASSERT_FALSE(settle(*backend).empty());
  request.light.shadows = backend->traces_light(DrawMode::Blocks);
  for (const double times : {1.1, 6.0}) {
    request.camera.position *= times;
    backend->show(request);
    const auto images = settle(*backend);
    ASSERT_FALSE(images.empty());
    EXPECT_LT(differing(images.back(), by_processor(document, request), 6), 0.05) << times;
    EXPECT_FALSE(backend->wants_frames());
  }
}

TEST_F(DeviceBackendTest, FallsBackToRaysWithoutDevice) {
  const Document document = small_document();
  DeviceBackendOptions options;
  options.cpu.threads = {2};
  DeviceBackend backend(document.scene(), options,
                        []() -> Result<std::shared_ptr<VulkanRenderer>> {
                          return make_error(ErrorCode::Unsupported, "vulkan: nothing here");
                        },
                        {});
  backend.show(request_for(document, DrawMode::Blocks));
  ASSERT_TRUE(comes([&] { return backend.fault().has_value(); }));
  EXPECT_EQ(backend.fault()->message, "vulkan: nothing here");
  EXPECT_EQ(backend.activity(), "");
  EXPECT_FALSE(backend.can_draw(DrawMode::Blocks));
  EXPECT_FALSE(backend.wants_frames()) << "modes that cannot be drawn request no frames";
  EXPECT_TRUE(backend.can_draw(DrawMode::Rays));
  backend.show(request_for(document, DrawMode::Rays));
  EXPECT_FALSE(settle(backend).empty());
}

TEST_F(DeviceBackendTest, DrawsAlikeOnSeparateThread) {
  Document document = small_document();
  const auto at_once = backend_of(document, true);
  // The drawing thread has its own device.
  auto made = VulkanRenderer::create();
  ASSERT_TRUE(made);
  renderer_ = std::make_shared<VulkanRenderer>(std::move(*made));
  const auto separate = backend_of(document, false);
  // Software devices take a minute to compile the shaders of both modes on both devices.
  std::vector<DrawMode> modes{DrawMode::Blocks};
  if (is_nightly()) modes.insert(modes.end(), {DrawMode::Smooth, DrawMode::Blocks});
  for (const DrawMode mode : modes) {
    const ViewRequest request = request_for(document, mode);
    for (const bool is_edited : {false, true}) {
      SCOPED_TRACE(is_edited);
      if (is_edited) {
        const ScenePause pause(*at_once);
        edit(document, *separate, {30, 12, 20});
      }
      separate->show(request);
      at_once->show(request);
      const auto images = settle(*separate);
      const auto same = settle(*at_once);
      ASSERT_FALSE(images.empty());
      ASSERT_FALSE(same.empty());
      // On a software device the processor adds ray-traced light in the end.
      const bool is_lit_after = is_processor();
      const auto drawn = is_lit_after ? std::ranges::find(images, same.back().rgb, &Image::rgb) : images.end() - 1;
      ASSERT_NE(drawn, images.end());
      EXPECT_EQ(drawn->rgb, same.back().rgb);
      EXPECT_EQ(drawn + 1 == images.end(), !is_lit_after);
      EXPECT_FALSE(separate->wants_frames()) << "the thread announces its frames";
      EXPECT_EQ(separate->activity(), "");
      EXPECT_EQ(separate->name(), renderer_->device().name);
      EXPECT_FALSE(separate->stats().empty());
    }
    const ScenePause pause_apart(*separate);
    const ScenePause pause_at_once(*at_once);
    ASSERT_TRUE(document.undo());
  }
}

class DeviceBackendLight : public DeviceBackendTest, public ::testing::WithParamInterface<DrawMode> {};
INSTANTIATE_TEST_SUITE_P(Meshes, DeviceBackendLight, ::testing::Values(DrawMode::Blocks, DrawMode::Smooth),
                         [](const auto& mode) { return mode.param == DrawMode::Blocks ? "Blocks" : "Smooth"; });

TEST_P(DeviceBackendLight, ShowsFullLightAtRestOnSoftwareDevice) {
  if (!is_processor()) GTEST_SKIP() << "a graphics card draws all light itself";
  Document document = small_document();
  const auto backend = backend_of(document, false);
  ViewRequest request = request_for(document, GetParam());
  request.light = natural_light();
  const auto wanted = [&] {
    ViewRequest marched = request;
    marched.light.occlusion_mode = OcclusionMode::Smooth;
    if (GetParam() == DrawMode::Blocks) return by_processor(document, marched);
    SmoothScene smooth;
    EXPECT_TRUE(smooth.update(document.scene()));
    return by_processor(smooth.scene(), marched);
  };
  for (int round = 0; round < 3; ++round) {
    SCOPED_TRACE(round);
    if (round == 1) edit(document, *backend, {30, 12, 20});
    if (round == 2) request.camera.position.x += 3.0;
    backend->show(request);
    const auto images = settle(*backend);
    ASSERT_GE(images.size(), 2U);
    EXPECT_EQ(images.back().rgb, wanted().rgb);
    const auto whole = std::ranges::find(images, request.width, &Image::width);
    ASSERT_NE(whole, images.end());
    EXPECT_GT(differing(*whole, images.back(), 8), 0.02) << "the device's image has no shadows";
    EXPECT_TRUE(backend->traces_light(GetParam()));
    EXPECT_EQ(backend->activity(), "");
    EXPECT_FALSE(backend->take());
  }
  // Images without ray-traced light (values, edges) stay the device's.
  request.light.shading = Shading::Normals;
  backend->show(request);
  ASSERT_FALSE(settle(*backend).empty());
  request.light = natural_light();
  request.wireframe = Wireframe::Over;
  backend->show(request);
  const auto edges = settle(*backend);
  ASSERT_FALSE(edges.empty());
  EXPECT_GT(differing(edges.back(), wanted(), 8), 0.02);
}

TEST_F(DeviceBackendTest, ReportsSmoothScenesTooLargeForLight) {
  if (!is_processor()) GTEST_SKIP() << "a graphics card draws all light itself";
  Document document = small_document();
  DeviceBackendOptions options;
  options.cpu.threads = {2};
  options.cpu.max_density_bytes = 1000;
  const auto backend = backend_of(document, options);
  ViewRequest request = request_for(document, DrawMode::Smooth);
  request.light = natural_light();
  for (int round = 0; round < 3; ++round) {
    SCOPED_TRACE(round);
    if (round == 1) request.camera.position.x += 3.0;
    if (round == 2) edit(document, *backend, {30, 12, 20});
    backend->show(request);
    const auto images = settle(*backend);
    ASSERT_FALSE(images.empty());
    EXPECT_EQ(images.back().width, request.width);
    EXPECT_EQ(backend->activity(), "too large for shadows");
    EXPECT_FALSE(backend->traces_light(DrawMode::Smooth));
    EXPECT_TRUE(backend->traces_light(DrawMode::Blocks));
  }
  request.mode = DrawMode::Blocks;
  backend->show(request);
  ASSERT_FALSE(settle(*backend).empty());
  EXPECT_EQ(backend->activity(), "");
}

TEST_F(DeviceBackendTest, DrawsRaysAndEditsWhileDeviceOpens) {
  Document document = small_document();
  std::promise<void> go_on;
  DeviceBackendOptions options;
  options.cpu.threads = {2};
  DeviceBackend backend(document.scene(), options,
                        [this, opened = go_on.get_future().share()]() -> Result<std::shared_ptr<VulkanRenderer>> {
                          opened.wait();
                          return renderer_;
                        },
                        {});
  ViewRequest request = request_for(document, DrawMode::Blocks);
  request.light.shadows = false;
  backend.show(request);
  EXPECT_TRUE(comes([&] { return backend.activity() == "opening a device"; }));
  EXPECT_TRUE(backend.ends_late());
  for (int i = 0; i < 5; ++i) {
    request.camera.position.x += 0.5;
    backend.show(request);
    EXPECT_TRUE(comes([&] {
      const auto frame = backend.take();
      return frame && !frame->is_settled && !frame->on_device;
    })) << "rays stand in";
    EXPECT_EQ(backend.name(), "processor");
    // Must not wait for the device, or this would never end.
    edit(document, backend, {20 + 4 * i, 12, 20});
  }
  go_on.set_value();
  const auto images = settle(backend);
  ASSERT_FALSE(images.empty());
  EXPECT_TRUE(comes([&] { return !backend.ends_late(); }));
  const auto fresh = backend_of(document);
  fresh->show(request);
  const auto same = settle(*fresh);
  ASSERT_FALSE(same.empty());
  EXPECT_EQ(images.back().rgb, same.back().rgb);
}

TEST_F(DeviceBackendTest, KeepsMeshImagesAboveQuarterSize) {
  const Document document = small_document();
  DeviceBackendOptions options;
  options.cpu.threads = {2};
  options.frame_seconds = 1e-9;
  const auto backend = backend_of(document, options);
  ViewRequest request = request_for(document, DrawMode::Blocks);
  for (int i = 0; i < 10; ++i) {
    request.camera.position.x += 0.5;
    backend->show(request);
    std::optional<ViewFrame> frame;
    ASSERT_TRUE(comes([&] { return (frame = backend->take()).has_value(); }));
    EXPECT_GE(frame->colour.width, request.width / 4);
    EXPECT_GE(frame->colour.height, request.height / 4);
  }
  const auto images = settle(*backend);
  ASSERT_FALSE(images.empty());
  EXPECT_EQ(images.back().width, request.width);
}

TEST_F(DeviceBackendTest, ReportsSlowModes) {
  const Document document = small_document();
  for (const double seconds : {1e-9, 1e9}) {
    DeviceBackendOptions options;
    options.cpu.threads = {2};
    options.slow_seconds = seconds;
    // Only coarse images count.
    options.frame_seconds = 1e-9;
    const auto backend = backend_of(document, options);
    ViewRequest request = request_for(document, DrawMode::Blocks);
    for (int i = 0; i < 4; ++i) {
      request.camera.position.x += 0.5;
      backend->show(request);
      ASSERT_FALSE(settle(*backend).empty());
    }
    EXPECT_EQ(backend->is_slow(DrawMode::Blocks), seconds < 1.0);
    EXPECT_FALSE(backend->is_slow(DrawMode::Rays));
    EXPECT_FALSE(backend->is_slow(DrawMode::Smooth));
    EXPECT_FALSE(backend->is_slow(DrawMode::Paths));
  }
}

// A scene of 441 chunks and a small one.
Document wide_document() {
  SceneGrid wide;
  wide.grid.fill_box({{0, 0, 0}, {1'300, 3, 1'300}}, 1);
  LoadedScene loaded = small_scene();
  loaded.scene.add_instance({"", loaded.scene.add_grid(std::move(wide))});
  return {std::move(loaded), "wide.vox"};
}

TEST_F(DeviceBackendTest, ReportsMeshingProgress) {
  const Document document = wide_document();
  const auto backend = backend_of(document, false);
  backend->show(request_for(document, DrawMode::Blocks));
  std::vector<std::string> reported;
  double furthest = -1.0;
  ASSERT_TRUE(comes([&] {
    const std::string now = backend->activity();
    if (reported.empty() || reported.back() != now) reported.push_back(now);
    if (const auto progress = backend->progress()) {
      EXPECT_GE(*progress, 0.0);
      EXPECT_LT(*progress, 1.0);
      furthest = std::max(furthest, *progress);
    }
    const auto frame = backend->take();
    return frame && frame->is_settled;
  }));
  EXPECT_NE(std::find_if(reported.begin(), reported.end(),
                         [](const std::string& text) { return text.starts_with("meshing "); }),
            reported.end());
  EXPECT_EQ(backend->activity(), "");
  EXPECT_GT(furthest, 0.0);
  EXPECT_FALSE(backend->progress());
}

// An image of the sky alone would not be better than the rays that stand in.
TEST_F(DeviceBackendTest, FirstMeshImageShowsSurfaces) {
  const Document document = wide_document();
  const Scene sky;
  for (const DrawMode mode : {DrawMode::Blocks, DrawMode::Smooth}) {
    const auto backend = backend_of(document, false);
    ViewRequest request = request_for(document, mode);
    request.light.shadows = false;
    request.width = 640;
    request.height = 400;
    backend->show(request);
    std::optional<ViewFrame> frame;
    ASSERT_TRUE(comes([&] {
      frame = backend->take();
      const bool is_stand_in = frame && frame->mode != mode;
      EXPECT_TRUE(!is_stand_in || frame->mode == DrawMode::Rays);
      return frame && frame->mode == mode;
    }));
    request.width = frame->colour.width;
    request.height = frame->colour.height;
    request.samples = 1;
    EXPECT_GT(differing(frame->colour, by_processor(sky, request), 8), 0.0);
  }
}

TEST_F(DeviceBackendTest, SettlesAfterPausesWithoutEdits) {
  const Document document = small_document();
  for (int attempt = 0; attempt < cases(3, 10); ++attempt) {
    const auto backend = backend_of(document, false);
    backend->show(request_for(document, DrawMode::Blocks));
    for (int i = 0; i < 100; ++i) {
      backend->pause();
      backend->resume(false);
      if (i % 10 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_FALSE(settle(*backend).empty());
  }
}

TEST_F(DeviceBackendTest, StopsDuringMeshing) {
  const Document document = wide_document();
  for (int attempt = 0; attempt < 2; ++attempt) {
    const auto backend = backend_of(document, false);
    backend->show(request_for(document, DrawMode::Blocks));
    ASSERT_TRUE(comes([&] { return backend->activity().starts_with("meshing "); }));
  }
}

TEST_F(DeviceBackendTest, FallsBackToCpuWhenOutOfMemory) {
  const Document document = small_document();
  DeviceBackendOptions options;
  options.cpu.threads = {2};
  options.rays_on_device = true;
  DeviceBackend backend(document.scene(), options,
                        []() -> Result<std::shared_ptr<VulkanRenderer>> { throw std::bad_alloc(); }, {});
  const ViewRequest request = request_for(document, DrawMode::Rays);
  backend.show(request);
  EXPECT_FALSE(backend.take());
  ASSERT_TRUE(backend.fault());
  EXPECT_EQ(backend.fault()->code, ErrorCode::LimitExceeded);
  backend.show(request_for(document, DrawMode::Blocks));
  backend.show(request);
  EXPECT_FALSE(settle(backend).empty()) << "the processor stands in";
}

TEST_F(DeviceBackendTest, DrawsCoarseFirstImageAtOnce) {
  const Document document = small_document();
  const auto backend = backend_of(document);
  ViewRequest request = request_for(document, DrawMode::Rays);
  request.samples = 1;
  for (const auto& [width, height] : {std::pair{160, 100}, {1, 1}, {1, 40}, {7, 2}}) {
    request.width = width;
    request.height = height;
    backend->show(request);
    const auto first = backend->take();
    ASSERT_TRUE(first);
    if (width == 160) {
      EXPECT_LT(first->on_device->width(), width) << "its time is not known yet";
    }
    if (first->is_settled) continue;
    const auto images = settle(*backend);
    ASSERT_FALSE(images.empty());
    EXPECT_EQ(images.back().width, width);
    EXPECT_EQ(images.back().height, height);
  }
}

TEST_F(DeviceBackendTest, DrawsOnCpuAfterForgettingDevice) {
  const Document document = small_document();
  const auto backend = backend_of(document);
  const ViewRequest request = request_for(document, DrawMode::Rays);
  backend->show(request);
  ASSERT_FALSE(settle(*backend).empty());
  backend->forget_device();
  const auto images = settle(*backend);
  ASSERT_FALSE(images.empty()) << "also without another request";
  EXPECT_EQ(images.back().rgb, by_processor(document, request).rgb);
}

TEST_F(DeviceBackendTest, SettlesOnLastOfManyRequests) {
  const Document document = small_document();
  const auto backend = backend_of(document);
  ViewRequest request = request_for(document, DrawMode::Rays);
  for (int i = 0; i < 12; ++i) {
    request.camera.position.x += 0.5;
    request.mode = static_cast<DrawMode>(i % 3);
    backend->show(request);
    (void)backend->take();
  }
  request.mode = DrawMode::Rays;
  backend->show(request);
  const auto images = settle(*backend);
  ASSERT_FALSE(images.empty());
  EXPECT_LT(differing(images.back(), by_processor(document, request), 2), 0.001);
}

}  // namespace
}  // namespace quoin::viewer

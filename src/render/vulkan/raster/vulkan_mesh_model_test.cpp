// Draws a real model by all mesh methods. QUOIN_WRITE_VULKAN writes the images for viewing.

#include <filesystem>

#include <quoin/grid/voxel_field.h>
#include <quoin/io/formats.h>

#include "render/vulkan/raster/mesh_for_tests.h"

namespace quoin {
namespace {

namespace fs = std::filesystem;
using vulkan_test::blocky_surfaces;
using vulkan_test::mesh_options;
using vulkan_test::smooth_surfaces;

class VulkanMeshModel : public vulkan_test::VulkanMeshTest {
 protected:
  Image shown(const Camera& camera, const MeshImageOptions& options, const std::string& name) {
    Image image = drawn(camera, options);
    if (std::getenv("QUOIN_WRITE_VULKAN") != nullptr) {
      EXPECT_TRUE(write_png(image, QUOIN_BINARY_DIR "/mesh_model_" + name + ".png"));
    }
    return image;
  }
  /// Each method gives a different image.
  void show_all(const Camera& camera, MeshImageOptions options, const std::string& name) {
    std::vector<Image> images = {shown(camera, options, name + "_lit")};
    options.wireframe = Wireframe::Over;
    images.push_back(shown(camera, options, name + "_edges_over"));
    options.wireframe = Wireframe::Only;
    images.push_back(shown(camera, options, name + "_edges_only"));
    options.wireframe = Wireframe::Off;
    options.light.shading = Shading::Occlusion;
    images.push_back(shown(camera, options, name + "_occlusion"));
    options.light.shading = Shading::Normals;
    images.push_back(shown(camera, options, name + "_normals"));
    for (std::size_t i = 0; i < images.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) EXPECT_NE(images[i].rgb, images[j].rgb) << name << ' ' << i << ' ' << j;
    }
  }
};

TEST_F(VulkanMeshModel, DrawsInEveryMode) {
  const char* chosen = std::getenv("QUOIN_VULKAN_MODEL");
  const fs::path model =
      chosen != nullptr ? fs::path(chosen)
                        : fs::path(QUOIN_SOURCE_DIR) / "../shared/data/vox/mikelovesrobots+mmmm/vox__scene_church1.vox";
  if (!fs::exists(model)) GTEST_SKIP() << model << " is not there";
  const auto loaded = load_scene(model);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const Scene& scene = loaded->scene;
  const RenderOptions options = vulkan_test::without_shadows(render_test::sized(640, 400));
  const Camera camera = frame_scene(scene, View::Iso, 640.0 / 400.0);
  compare(scene, camera, options, "model");

  MeshImageOptions ways = mesh_options(options);
  ways.samples = 4;
  show_all(camera, ways, "blocky");
  meshes_->clear();
  std::vector<SurfaceUpdate> surfaces;
  scene.grids().for_each([&](GridHandle handle, const SceneGrid& grid) {
    for (SurfaceUpdate& update : smooth_surfaces(handle, *field_from_grid(grid.grid), scene.types)) {
      surfaces.push_back(std::move(update));
    }
  });
  put(scene, surfaces);
  show_all(camera, ways, "smooth");
}

}  // namespace
}  // namespace quoin

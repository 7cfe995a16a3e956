#pragma once

// Shared by the mesh drawing tests: surfaces of scenes, and their images.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <quoin/grid/density_grid.h>
#include <quoin/live/live_meshes.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/smooth.h>
#include <quoin/render/vulkan_image.h>
#include <quoin/render/vulkan_mesh_renderer.h>

#include "core/coordinates/chunk_order.h"
#include "mesh/surface/face_materials.h"
#include "render/vulkan/device/vulkan_for_tests.h"

namespace quoin::vulkan_test {

inline std::shared_ptr<ChunkSurface> blocky_surface(const Grid& grid, const VoxelRegistry& types, IVec3 chunk,
                                                    bool merge = true) {
  auto surface = std::make_shared<ChunkSurface>();
  QuadOptions options;
  options.merge = merge;
  BlockyMesher().mesh(grid.neighbourhood(chunk), types, options, surface->quads, surface->shapes);
  const auto clear = std::stable_partition(surface->shapes.begin(), surface->shapes.end(), [&](const ShapeFace& face) {
    return types[face.type].visibility != Visibility::Transparent;
  });
  surface->opaque_shapes = static_cast<std::size_t>(clear - surface->shapes.begin());
  const auto glass = std::stable_partition(surface->quads.begin(), surface->quads.end(),
                                           [&](const Quad& quad) { return !types.is_transparent(quad.type()); });
  surface->opaque_quads = static_cast<std::size_t>(glass - surface->quads.begin());
  return surface;
}

inline std::vector<SurfaceUpdate> blocky_surfaces(const Scene& scene, bool merge = true) {
  std::vector<SurfaceUpdate> updates;
  scene.grids().for_each([&](GridHandle handle, const SceneGrid& grid) {
    for (const IVec3 chunk : grid.grid.chunks()) {
      updates.push_back({handle, chunk, blocky_surface(grid.grid, scene.types, chunk, merge)});
    }
  });
  return updates;
}

inline std::shared_ptr<ChunkSurface> smooth_surface(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk) {
  auto surface = std::make_shared<ChunkSurface>();
  surface->style = SurfaceStyle::Smooth;
  SmoothOptions options;
  options.split_sheets = true;
  SmoothMesher().mesh(field.neighbourhood(chunk), options, surface->smooth);
  const SurfaceMaterials materials(types);
  for (const SmoothCell cell : surface->smooth.cells) {
    const DensityNeighbourhood around = field.neighbourhood(chunk + cell.chunk_offset());
    const CellMaterial material = materials.of_cell(around, cell.cell(), 0);
    surface->albedo.push_back(material.albedo);
    surface->types.push_back(material.type);
  }
  return surface;
}

/// A chunk's mesh has triangles for samples of its own, so one before the first chunk may have some.
inline std::vector<SurfaceUpdate> smooth_surfaces(GridHandle handle, const DensityGrid& field,
                                                  const VoxelRegistry& types) {
  std::vector<IVec3> chunks;
  for (const IVec3 chunk : field.chunks()) {
    for (int i = 0; i < 8; ++i) chunks.push_back(chunk - IVec3(i & 1, i >> 1 & 1, i >> 2));
  }
  sort_and_unite(chunks);
  std::vector<SurfaceUpdate> updates;
  for (const IVec3 chunk : chunks) {
    updates.push_back({handle, chunk, smooth_surface(field, types, chunk)});
  }
  return updates;
}

/// As live meshes make them.
inline std::vector<SurfaceUpdate> live_surfaces(const Scene& scene, SurfaceStyle style) {
  LiveMeshOptions options;
  options.style = style;
  options.region_edge = kChunkEdge;  // as the viewer
  LiveMeshes live(options);
  live.finish(scene, {0, 0, 0});
  return live.take();
}

inline MeshImageOptions mesh_options(const RenderOptions& options) {
  MeshImageOptions mesh;
  mesh.width = options.width;
  mesh.height = options.height;
  mesh.samples = 1;
  mesh.light = options.light;
  mesh.environment = options.environment;
  mesh.detail = options.detail;
  return mesh;
}

/// The light that meshes have.
inline RenderOptions with_mesh_light(RenderOptions options) {
  options.light.occlusion_mode = OcclusionMode::Vertex;
  return options;
}
inline RenderOptions without_shadows(RenderOptions options) {
  options.light.shadows = false;
  return with_mesh_light(options);
}

class VulkanMeshTest : public VulkanTest {
 protected:
  static void TearDownTestSuite() {
    shared_.reset();
    VulkanTest::TearDownTestSuite();
  }

  void SetUp() override {
    VulkanTest::SetUp();
    if (IsSkipped()) return;
    if (!shared_) {
      auto made = VulkanMeshRenderer::create(*renderer_);
      if (!made) GTEST_SKIP() << made.error().message;
      shared_ = std::make_unique<VulkanMeshRenderer>(std::move(*made));
    }
    meshes_ = shared_.get();
    meshes_->clear();
  }

  void put(const Scene& scene, const std::vector<SurfaceUpdate>& surfaces) {
    const Status traced = renderer_->update(scene);
    EXPECT_TRUE(traced) << to_string(traced.error());
    const Status updated = meshes_->update(scene);
    EXPECT_TRUE(updated) << to_string(updated.error());
    const Status done = meshes_->put(surfaces);
    EXPECT_TRUE(done) << to_string(done.error());
  }
  Image drawn(const Camera& camera, const MeshImageOptions& options) {
    VulkanImage rendered(*renderer_);
    const Status done = meshes_->draw(rendered, camera, options);
    EXPECT_TRUE(done) << to_string(done.error());
    auto image = rendered.read();
    EXPECT_TRUE(image) << to_string(image.error());
    return image ? std::move(*image) : Image{};
  }

  /// Compares the scene's blocky meshes with the CPU renderer's image.
  void compare(const Scene& scene, const Camera& camera, const RenderOptions& whole, const std::string& name) {
    const RenderOptions options = of_day(whole);
    meshes_->clear();
    put(scene, blocky_surfaces(scene));
    expect_like(drawn(camera, mesh_options(options)), render_test::taken(scene, camera, options), name);
  }
  /// `per_mille`: of the pixels that may differ elsewhere than at silhouettes.
  void expect_like(Image image, const RenderedImage& cpu, const std::string& name, int per_mille = 1) {
    RenderedImage mesh;
    mesh.colour = std::move(image);
    mesh.depth = cpu.depth;
    const Differences found = differences(mesh, cpu);
    EXPECT_LE(found.elsewhere * 1000, per_mille * found.total) << name;
    EXPECT_LE(found.pixels * 100, found.total) << name;
    const bool is_wanted = std::getenv("QUOIN_WRITE_VULKAN") != nullptr;
    if (is_wanted || ::testing::Test::HasFailure()) {
      EXPECT_TRUE(write_png(mesh.colour, QUOIN_BINARY_DIR "/mesh_" + name + ".vulkan.png"));
      EXPECT_TRUE(write_png(cpu.colour, QUOIN_BINARY_DIR "/mesh_" + name + ".cpu.png"));
    }
    RecordProperty(name, std::to_string(found.pixels) + " pixels, " + std::to_string(found.elsewhere) +
                             " not at silhouettes, of " + std::to_string(found.total));
    if (is_wanted) {
      std::printf("%s: %d pixels (%d not at silhouettes) of %d\n", name.c_str(), found.pixels, found.elsewhere,
                  found.total);
    }
  }

  VulkanMeshRenderer* meshes_ = nullptr;

 private:
  static inline std::unique_ptr<VulkanMeshRenderer> shared_;
};

/// Returns the number of bytes that differ by more than `tolerance` between two images of the same size.
inline int bytes_that_differ(const Image& a, const Image& b, int tolerance) {
  EXPECT_EQ(a.rgb.size(), b.rgb.size());
  int different = 0;
  for (std::size_t i = 0; i < a.rgb.size() && i < b.rgb.size(); ++i) {
    different += std::abs(a.rgb[i] - b.rgb[i]) > tolerance;
  }
  return different;
}

inline Vec3 byte_at(const Image& image, int x, int y) {
  const auto at =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x));
  return {image.rgb.at(at), image.rgb.at(at + 1), image.rgb.at(at + 2)};
}

}  // namespace quoin::vulkan_test

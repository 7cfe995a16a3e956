// Meshes with vertex light.

#include <array>
#include <string>

#include <quoin/render/lit_meshes.h>

#include "io/gltf/gltf_for_tests.h"

namespace quoin {
namespace {

using Json = nlohmann::json;

class GltfLight : public Gltf {
 protected:
  void SetUp() override {
    VoxelProperties stone;
    stone.colour = {120, 120, 120, 255};
    VoxelProperties glass;
    glass.visibility = Visibility::Transparent;
    glass.colour = {10, 20, 200, 100};
    VoxelProperties lamp;
    lamp.emission = 5.0F;
    lamp.colour = {250, 240, 10, 255};
    VoxelProperties weak = lamp;
    weak.emission = 0.2F;
    for (const VoxelProperties& each : {stone, glass, lamp, weak}) EXPECT_TRUE(scene_.types.add(each));
    SceneGrid grid;
    grid.name = "house";
    grid.grid.fill_box({{0, 0, 0}, {12, 6, 12}}, 1);
    grid.grid.fill_box({{1, 1, 1}, {11, 5, 11}}, kAir);
    grid.grid.fill_box({{5, 1, 11}, {7, 4, 12}}, 2);
    grid.grid.set({3, 1, 3}, 3);
    grid.grid.set({9, 4, 9}, 4);
    place(scene_, scene_.add_grid(std::move(grid)), {0, 0, 0});
  }
  [[nodiscard]] SceneMeshes lit() const { return mesh_lit_scene(scene_, {}).value(); }
};

TEST_F(GltfLight, WritesUnlitMaterialsAndLightColours) {
  const SceneMeshes meshes = lit();
  const ParsedGlb glb = write(meshes);
  EXPECT_EQ(glb.document["extensionsUsed"], Json({"KHR_materials_unlit"}));
  ASSERT_EQ(glb.document["images"].size(), 1U);
  for (const Json& material : glb.document["materials"]) {
    EXPECT_EQ(material["extensions"], Json({{"KHR_materials_unlit", Json::object()}}));
    EXPECT_TRUE(material["pbrMetallicRoughness"].contains("baseColorTexture"));
    EXPECT_FALSE(material.contains("emissiveFactor"));
    EXPECT_EQ(material.contains("alphaMode"),
              material["name"].get<std::string>().find("glass") != std::string::npos ||
                  material["name"].get<std::string>().find("trans") != std::string::npos)
        << material["name"];
  }
  std::size_t next = 0;
  for (const Json& primitive : glb.document["meshes"][0]["primitives"]) {
    const auto colours = glb.array<LinearRgba16>(primitive["attributes"]["COLOR_0"].get<std::size_t>());
    EXPECT_EQ(glb.document["accessors"][primitive["attributes"]["COLOR_0"].get<std::size_t>()]["componentType"], 5123);
    EXPECT_EQ(colours.size(), glb.vectors(primitive, "POSITION").size());
    next += colours.size();
  }
  std::size_t vertices = 0;
  for (const MeshView& view : meshes.parts[0].surfaces) vertices += view.positions.size();
  EXPECT_EQ(next, vertices);
}

// Emissive voxels have full brightness; opaque blocks, which need a single material, keep the mesh as it is.
TEST_F(GltfLight, OcclusionDarkensLightUnlessSeparate) {
  const SceneMeshes meshes = lit();
  const MeshView& view = meshes.parts[0].surfaces[0];
  ASSERT_EQ(view.surface, SurfaceClass::Opaque);
  for (const OcclusionIn where : {OcclusionIn::Colour, OcclusionIn::Attribute}) {
    const auto bytes = write_mesh(meshes, FileFormat::Glb, {.occlusion_in = where});
    ASSERT_TRUE(bytes);
    const ParsedGlb glb = parse_glb(*bytes);
    const Json& primitive = glb.document["meshes"][0]["primitives"][0];
    const auto colours = glb.array<LinearRgba16>(primitive["attributes"]["COLOR_0"].get<std::size_t>());
    EXPECT_EQ(primitive["attributes"].contains("_AO"), where == OcclusionIn::Attribute);
    ASSERT_EQ(colours.size(), view.positions.size());
    for (std::size_t i = 0; i < colours.size(); ++i) {
      const double open = where == OcclusionIn::Colour ? 1.0 - 0.25 * view.block_occlusion[i] : 1.0;
      for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(colours[i][c], open * view.light[i][c], 0.51);
    }
  }
  for (const MeshView& each : meshes.parts[0].surfaces) {
    if (each.surface != SurfaceClass::Emissive) continue;
    for (std::size_t i = 0; i < each.positions.size(); ++i) {
      if (each.types[i] != 3) continue;
      EXPECT_EQ(each.light[i], (LinearRgba16{65'535, 65'535, 65'535, 65'535}));
    }
  }
}

TEST_F(GltfLight, MultipliesSmoothColoursByLight) {
  auto meshes = mesh_scene_smoothly(scene_).value();
  ASSERT_TRUE(light_meshes(scene_, {}, meshes));
  const ParsedGlb glb = write(meshes);
  const MeshView& view = meshes.parts[0].surfaces[0];
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  const auto colours = glb.array<LinearRgba16>(primitive["attributes"]["COLOR_0"].get<std::size_t>());
  for (std::size_t i = 0; i < colours.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double wanted = view.albedo[i][c] * (1.0 - double{view.occlusion[i]}) * view.light[i][c] / 65'535.0;
      ASSERT_NEAR(colours[i][c], wanted, 1.0);
    }
  }
  for (const Json& material : glb.document["materials"]) {
    EXPECT_TRUE(material["extensions"].contains("KHR_materials_unlit"));
  }
}

TEST_F(GltfLight, RefusesOtherFormatsAndPartlyLitScenes) {
  SceneMeshes meshes = lit();
  EXPECT_EQ(write_mesh(meshes, FileFormat::Ply).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(write_mesh(meshes, folder_.file("x.obj")).error().code, ErrorCode::Unsupported);
  meshes.parts[0].surfaces[0].light = {};
  EXPECT_EQ(write_mesh(meshes, FileFormat::Glb).error().code, ErrorCode::InvalidArgument);
  meshes = lit();
  meshes.parts[0].surfaces[0].light = meshes.parts[0].surfaces[0].light.first(3);
  EXPECT_EQ(write_mesh(meshes, FileFormat::Glb).error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace quoin

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "io/gltf/gltf_for_tests.h"

namespace quoin {
namespace {

using Json = nlohmann::json;

class GltfAtlas : public Gltf {
 protected:
  void SetUp() override {
    add_asymmetric_grid(scene_, "crane");
    place(scene_, scene_.grids().handles().front(), {0, 0, 0});
  }
  SceneMeshes meshed() { return mesh_scene(scene_, {.atlas = true}).value(); }
  void add_to_grid(IVec3 voxel, const VoxelProperties& properties) {
    const VoxelType type = *scene_.types.add(properties);
    scene_.edit(scene_.grids().handles().front()).grid.set(voxel, type);
  }
};

TEST_F(GltfAtlas, SuppliesBaseColourOfOpaqueBlocks) {
  const ParsedGlb glb = write(meshed());
  const Json& document = glb.document;
  ASSERT_EQ(document["images"].size(), 2U) << "no material needs the palette's colours";
  EXPECT_EQ(document["images"][1]["name"], "atlas");
  const Json& material = document["materials"][0]["pbrMetallicRoughness"];
  EXPECT_EQ(material["baseColorTexture"], Json({{"index", 1}}));
  EXPECT_EQ(material["metallicRoughnessTexture"], Json({{"index", 0}, {"texCoord", 1}}));
  EXPECT_EQ(document["samplers"][document["textures"][1]["sampler"].get<std::size_t>()]["minFilter"], 9729);
  EXPECT_EQ(document["samplers"][document["textures"][0]["sampler"].get<std::size_t>()]["minFilter"], 9728);
  const Json& primitive = document["meshes"][0]["primitives"][0];
  EXPECT_TRUE(primitive["attributes"].contains("TEXCOORD_1"));
  EXPECT_FALSE(primitive["attributes"].contains("COLOR_0"));
}

// The red tip stands on grey: without occlusion the texture shows its own colour.
TEST_F(GltfAtlas, ShowsTypeColours) {
  const SceneMeshes meshes = meshed();
  const ParsedGlb glb = write(meshes);
  const PngImage atlas = glb.image(1);
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  std::set<std::array<int, 4>> seen;
  for (std::size_t i = 0; i < meshes.parts[0].surfaces[0].positions.size(); ++i) {
    seen.insert(glb.texel(atlas, primitive, i));
  }
  EXPECT_TRUE(seen.contains({200, 10, 20, 255}));
  EXPECT_TRUE(seen.contains({120, 120, 120, 255}));
  EXPECT_GT(seen.size(), 2U) << "and darker ones, in the corners";
}

TEST_F(GltfAtlas, KeepsGlassAndEmissionInPalette) {
  VoxelProperties glass;
  glass.visibility = Visibility::Transparent;
  glass.colour = {10, 20, 200, 100};
  add_to_grid({5, 0, 0}, glass);
  VoxelProperties lamp;
  lamp.emission = 2.0F;
  lamp.colour = {250, 240, 10, 255};
  add_to_grid({0, 5, 0}, lamp);
  const ParsedGlb glb = write(meshed());
  const Json& document = glb.document;
  ASSERT_EQ(document["images"].size(), 4U);
  int with_atlas = 0;
  for (const Json& primitive : document["meshes"][0]["primitives"]) {
    const Json& material = document["materials"][primitive["material"].get<std::size_t>()];
    const std::size_t base = material["pbrMetallicRoughness"]["baseColorTexture"]["index"];
    const bool is_atlas = document["images"][base]["name"] == "atlas";
    EXPECT_EQ(is_atlas, primitive["attributes"].contains("TEXCOORD_1"));
    EXPECT_EQ(is_atlas, !primitive["attributes"].contains("COLOR_0"));
    if (material.contains("emissiveTexture")) {
      EXPECT_EQ(document["images"][material["emissiveTexture"]["index"].get<std::size_t>()]["name"],
                "palette emissive");
    }
    with_atlas += is_atlas ? 1 : 0;
  }
  EXPECT_EQ(with_atlas, 1);
  EXPECT_EQ(document["meshes"][0]["primitives"].size(), 3U);
}

TEST_F(GltfAtlas, HasNoAtlasWithoutOcclusion) {
  const auto bytes = write_mesh(meshed(), FileFormat::Glb, {.write_occlusion = false});
  ASSERT_TRUE(bytes.has_value());
  const ParsedGlb glb = parse_glb(*bytes);
  EXPECT_EQ(glb.document["images"][0]["name"], "palette");
  EXPECT_FALSE(glb.document["meshes"][0]["primitives"][0]["attributes"].contains("TEXCOORD_1"));
}

TEST_F(GltfAtlas, NeedsFewerTrianglesForSameFaces) {
  SceneGrid grid;
  grid.grid.fill_box({{0, 0, 0}, {40, 1, 40}}, 1);
  for (int i = 0; i < 10; ++i) grid.grid.fill_box({{4 * i, 1, 3 * i}, {4 * i + 1, 4, 3 * i + 2}}, 1);
  place(scene_, scene_.add_grid(std::move(grid)), {0, 50, 0});
  const MeshStats plain = mesh_scene(scene_).value().stats;
  const MeshStats with_atlas = meshed().stats;
  EXPECT_EQ(with_atlas.faces_visible, plain.faces_visible);
  EXPECT_LT(with_atlas.triangles, 0.7 * static_cast<double>(plain.triangles));
  EXPECT_EQ(with_atlas.triangles, 2 * with_atlas.quads);
  EXPECT_EQ(with_atlas.vertices, 4 * with_atlas.quads);
}

TEST_F(GltfAtlas, HasNoAtlasWithoutOpaqueVoxels) {
  Scene scene;
  VoxelProperties glass;
  glass.visibility = Visibility::Transparent;
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, *scene.types.add(glass));
  place(scene, scene.add_grid(std::move(grid)), {0, 0, 0});
  EXPECT_TRUE(mesh_scene(scene, {.atlas = true}).value().atlas.rgb.empty());
  EXPECT_TRUE(mesh_scene(Scene(), {.atlas = true}).value().atlas.rgb.empty());
}

TEST_F(GltfAtlas, RefusesVoxelsBeyondFloatPrecision) {
  SceneGrid far;
  far.grid.set({1 << 25, 0, 0}, 1);
  place(scene_, scene_.add_grid(std::move(far)), {0, 0, 0});
  EXPECT_EQ(mesh_scene(scene_, {.atlas = true}).error().code, ErrorCode::LimitExceeded);
}

TEST_F(GltfAtlas, RefusesContradictoryOptions) {
  for (const BlockyMeshOptions& mesh : {BlockyMeshOptions{.merge = false}, BlockyMeshOptions{.bake_occlusion = false},
                                        BlockyMeshOptions{.watertight = true}}) {
    EXPECT_EQ(mesh_scene(scene_, {.mesh = mesh, .atlas = true}).error().code, ErrorCode::InvalidArgument);
  }
  EXPECT_EQ(write_mesh(meshed(), FileFormat::Ply).error().code, ErrorCode::Unsupported);
  SceneMeshes without = meshed();
  without.atlas = {};
  EXPECT_EQ(write_mesh(without, FileFormat::Glb).error().code, ErrorCode::InvalidArgument);
  SceneMeshes odd = meshed();
  odd.atlas.rgb.pop_back();
  EXPECT_EQ(write_mesh(odd, FileFormat::Glb).error().code, ErrorCode::InvalidArgument);
  SceneMeshes outside = meshed();
  std::vector<std::array<float, 2>> far(outside.parts[0].surfaces[0].positions.size(), {0.5F, 1.5F});
  outside.parts[0].surfaces[0].atlas = far;
  EXPECT_EQ(write_mesh(outside, FileFormat::Glb).error().code, ErrorCode::InvalidArgument);
  SceneMeshes half = meshed();
  half.parts[0].surfaces[0].atlas = {};
  EXPECT_EQ(write_mesh(half, FileFormat::Glb).error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace quoin

#include <cmath>

#include <gtest/gtest.h>

#include "voxelize/shapes_for_tests.h"

namespace quoin {
namespace {

constexpr int kSide = 16;

/// A square of kSide voxels in the layer y = 0; (0, 0) of its texture is at the least x and z.
TriangleMesh square() {
  TriangleMesh mesh;
  constexpr double kHeight = 0.4;
  mesh.positions = {{0, kHeight, 0}, {0, kHeight, kSide}, {kSide, kHeight, kSide}, {kSide, kHeight, 0}};
  shapes::add_quad(mesh, 0, 1, 2, 3);
  mesh.uvs = {{0, 0}, {0, 1}, {1, 1}, {0, 0}, {1, 1}, {1, 0}};
  mesh.materials.emplace_back();
  mesh.materials[0].texture = 0;
  return mesh;
}

/// Returns a texture of `of(x, y)`.
template <class Of>
MeshTexture texture(int side, const Of& of) {
  MeshTexture made;
  made.image = {side, side, {}};
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const Rgba8 c = of(x, y);
      made.image.rgba.insert(made.image.rgba.end(), {c.r, c.g, c.b, c.a});
    }
  }
  return made;
}

struct Made {
  VoxelRegistry types;
  Grid grid;
  std::vector<std::string> warnings;

  [[nodiscard]] const VoxelProperties& at(int x, int z) const { return types[grid.get(x, 0, z)]; }
};

Made surface_of(const TriangleMesh& mesh) {
  Made made;
  VoxelizeOptions options;
  options.solid = SolidVoxels::None;
  auto voxels = voxelize(mesh, options, made.types);
  if (!voxels) {
    ADD_FAILURE() << to_string(voxels.error());
    return made;
  }
  made.grid = std::move(voxels->grid);
  made.warnings = voxels->warnings;
  return made;
}

TEST(SurfaceColours, MatchTextureWithOnePixelPerVoxel) {
  TriangleMesh mesh = square();
  const auto of = [](int x, int y) {
    return Rgba8{static_cast<std::uint8_t>(x * 16), static_cast<std::uint8_t>(y * 16), 7, 255};
  };
  mesh.textures.push_back(texture(kSide, of));
  const Made made = surface_of(mesh);
  EXPECT_EQ(made.grid.voxel_count(), kSide * kSide);
  for (int z = 0; z < kSide; ++z) {
    for (int x = 0; x < kSide; ++x) {
      const Rgba8 expected = of(x, z);
      const Rgba8 found = made.at(x, z).colour;
      EXPECT_NEAR(found.r, expected.r, 1) << x << " " << z;
      EXPECT_NEAR(found.g, expected.g, 1);
      EXPECT_NEAR(found.b, expected.b, 1);
    }
  }
}

TEST(SurfaceColours, AverageManyPixelsInLinearLight) {
  TriangleMesh mesh = square();
  mesh.textures.push_back(texture(8 * kSide, [](int x, int y) {
    const auto grey = static_cast<std::uint8_t>((x + y) % 2 * 255);
    return Rgba8{grey, grey, grey, 255};
  }));
  const Made made = surface_of(mesh);
  EXPECT_EQ(made.types.size(), 2U);
  // sRGB 188 is half the light of 255.
  EXPECT_EQ(made.at(3, 5).colour, (Rgba8{188, 188, 188, 255}));
}

TEST(SurfaceColours, CoarseTexturesBlendOrStaySharp) {
  TriangleMesh mesh = square();
  const auto of = [](int x, int) { return x == 0 ? Rgba8{0, 0, 0, 255} : Rgba8{255, 255, 255, 255}; };
  mesh.textures.push_back(texture(2, of));
  mesh.textures[0].wrap_u = mesh.textures[0].wrap_v = TextureWrap::Clamp;
  EXPECT_GT(surface_of(mesh).types.size(), 6U);
  EXPECT_EQ(surface_of(mesh).at(0, 0).colour, (Rgba8{0, 0, 0, 255}));
  mesh.textures[0].is_smooth = false;
  const Made sharp = surface_of(mesh);
  EXPECT_EQ(sharp.types.size(), 3U);
  EXPECT_EQ(sharp.at(7, 3).colour, (Rgba8{0, 0, 0, 255}));
  EXPECT_EQ(sharp.at(8, 3).colour, (Rgba8{255, 255, 255, 255}));
}

TEST(SurfaceColours, FollowWrapModeBeyondTexture) {
  TriangleMesh mesh = square();
  for (glm::vec2& place : mesh.uvs) place.x = 4.0F * place.x - 1.0F;
  mesh.textures.push_back(texture(2, [](int x, int) { return Rgba8{static_cast<std::uint8_t>(x * 255), 0, 0, 255}; }));
  mesh.textures[0].is_smooth = false;
  const auto row = [&](TextureWrap wrap) {
    mesh.textures[0].wrap_u = wrap;
    const Made made = surface_of(mesh);
    std::string reds;
    for (int x = 1; x < kSide; x += 2) reds += made.at(x, 2).colour.r > 0 ? '1' : '0';
    return reds;
  };
  EXPECT_EQ(row(TextureWrap::Repeat), "01010101");
  EXPECT_EQ(row(TextureWrap::Mirror), "10011001");
  EXPECT_EQ(row(TextureWrap::Clamp), "00011111");
}

TEST(SurfaceColours, WrapDistantCoordinatesOfWideTextures) {
  constexpr int kWidth = 4096;
  const Rgba8 black{0, 0, 0, 255};
  const Rgba8 red{255, 0, 0, 255};
  const Rgba8 blue{0, 0, 255, 255};
  TriangleMesh mesh = square();
  for (glm::vec2& place : mesh.uvs) place = {999'999.5F, 0.5F};  // 4e9 pixels
  MeshTexture wide;
  wide.image = {kWidth, 1, {}};
  for (int x = 0; x < kWidth; ++x) {
    const Rgba8 c = x < kWidth / 4 ? black : x < kWidth / 4 * 3 ? red : blue;
    wide.image.rgba.insert(wide.image.rgba.end(), {c.r, c.g, c.b, c.a});
  }
  mesh.textures.push_back(std::move(wide));
  for (const bool is_smooth : {false, true}) {
    mesh.textures[0].is_smooth = is_smooth;
    mesh.textures[0].wrap_u = TextureWrap::Repeat;
    EXPECT_EQ(surface_of(mesh).at(3, 5).colour, red);
    mesh.textures[0].wrap_u = TextureWrap::Mirror;
    EXPECT_EQ(surface_of(mesh).at(3, 5).colour, red);
    mesh.textures[0].wrap_u = TextureWrap::Clamp;
    EXPECT_EQ(surface_of(mesh).at(3, 5).colour, blue);
  }
}

TEST(SurfaceColours, AlphaMaskCutsOutVoxels) {
  TriangleMesh mesh = square();
  mesh.materials[0].alpha_mode = AlphaMode::Mask;
  mesh.textures.push_back(texture(kSide, [](int x, int) {
    return Rgba8{9, 200, 9, static_cast<std::uint8_t>(x < 4 ? 60 : 255)};
  }));
  mesh.textures[0].is_smooth = false;
  const Made made = surface_of(mesh);
  // At the cut on the edge of two triangles an adjacent voxel touches one of them.
  EXPECT_NEAR(static_cast<double>(made.grid.voxel_count()), 12 * kSide, 1);
  EXPECT_EQ(made.grid.get(3, 0, 9), kAir);
  EXPECT_EQ(made.at(4, 3).colour, (Rgba8{9, 200, 9, 255}));
  // Enclosed voxels stay.
  TriangleMesh box = shapes::box(DVec3(0.0), DVec3(6.0));
  box.materials.emplace_back();
  box.materials[0].alpha_mode = AlphaMode::Mask;
  box.materials[0].colour.a = 0.2F;
  VoxelRegistry types;
  EXPECT_EQ(voxelize(box, {}, types)->grid.voxel_count(), 216);
}

TEST(SurfaceColours, AlphaBlendModeBlends) {
  TriangleMesh mesh = square();
  mesh.materials[0].alpha_mode = AlphaMode::Blend;
  mesh.materials[0].texture.reset();
  mesh.materials[0].colour = {1.0F, 0.0F, 0.0F, 0.5F};
  const Made made = surface_of(mesh);
  EXPECT_EQ(made.at(1, 1).colour, (Rgba8{255, 0, 0, 128}));
  EXPECT_EQ(made.at(1, 1).visibility, Visibility::Transparent);
}

TEST(SurfaceColours, CombineVertexColoursAndMaterials) {
  TriangleMesh mesh = square();
  mesh.materials[0] = {};
  mesh.materials[0].name = "brass";
  mesh.materials[0].metalness = 1.0F;
  mesh.materials[0].roughness = 0.25F;
  mesh.materials[0].colour = {1.0F, 0.5F, 1.0F, 1.0F};
  mesh.colours = {{0, 1, 0, 1}, {0, 1, 0, 1}, {1, 1, 0, 1}, {1, 1, 0, 1}};
  const Made made = surface_of(mesh);
  EXPECT_EQ(made.at(8, 0).name, "brass");
  EXPECT_EQ(made.at(8, 0).metalness, 1.0F);
  EXPECT_EQ(made.at(8, 0).roughness, 0.25F);
  EXPECT_EQ(made.at(8, 0).colour.g, 188);
  EXPECT_EQ(made.at(8, 0).colour.b, 0);
  // The mean of 8.5 of 16 in linear light.
  EXPECT_NEAR(made.at(8, 0).colour.r, 193, 1);
}

TEST(SurfaceColours, SolidInsideHasMeanColour) {
  TriangleMesh mesh = shapes::box(DVec3(0.0), DVec3(20.0));
  mesh.materials.resize(2);
  mesh.materials[0].colour = {1.0F, 0.0F, 0.0F, 1.0F};
  mesh.materials[1].colour = {0.0F, 0.0F, 1.0F, 1.0F};
  mesh.material_of = {0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1};
  VoxelRegistry types;
  VoxelizeOptions options;
  options.surface = SurfaceVoxels::None;
  const auto made = voxelize(mesh, options, types);
  ASSERT_TRUE(made);
  EXPECT_EQ(types.size(), 4U);
  EXPECT_EQ(types[made->grid.get({10, 10, 10})].colour, (Rgba8{188, 0, 188, 255}));
  EXPECT_EQ(types[made->grid.get({0, 10, 10})].colour, (Rgba8{255, 0, 0, 255}));
  EXPECT_EQ(types[made->grid.get({10, 10, 0})].colour, (Rgba8{0, 0, 255, 255}));
}

TEST(SurfaceColours, SingleMaterialAlsoFillsInside) {
  TriangleMesh mesh = shapes::box({0.25, 0.25, 0.25}, {9.75, 9.75, 9.75});
  MeshMaterial glass;
  glass.name = "glass";
  glass.colour = {0.2F, 0.8F, 0.2F, 0.5F};
  glass.alpha_mode = AlphaMode::Blend;
  glass.emission = 2.0F;
  mesh.materials = {MeshMaterial{}, glass};
  mesh.material_of.assign(mesh.triangles.size(), 1);
  VoxelRegistry types;
  const auto made = voxelize(mesh, {}, types);
  ASSERT_TRUE(made) << to_string(made.error());
  const VoxelProperties& deep = types[made->grid.get({5, 5, 5})];
  EXPECT_EQ(deep.name, "glass");
  EXPECT_EQ(deep.emission, 2.0F);
  EXPECT_EQ(deep.visibility, Visibility::Transparent);
}

TEST(SurfaceColours, RoundColoursBeyondRegistryLimit) {
  TriangleMesh mesh = square();
  constexpr int kWide = 300;
  constexpr int kTimes = kWide / kSide;
  for (DVec3& p : mesh.positions) p *= DVec3(kTimes + 0.75, 1.0, kTimes + 0.75);
  mesh.textures.push_back(texture(kWide, [](int x, int y) {
    const auto byte = [](int n) { return static_cast<std::uint8_t>(n); };
    return Rgba8{byte(x), byte(y), byte(x / 256 * 64 + y / 256 * 128), 255};
  }));
  mesh.textures[0].is_smooth = false;
  const Made made = surface_of(mesh);
  EXPECT_EQ(made.grid.voxel_count(), kWide * kWide);
  EXPECT_LE(made.types.size(), kMaxVoxelTypes + 1);
  EXPECT_GT(made.types.size(), 60'000U);
  ASSERT_EQ(made.warnings.size(), 1U);
  EXPECT_NE(made.warnings[0].find("reduced"), std::string::npos);
}

TEST(SurfaceColours, RespectColourLimit) {
  TriangleMesh mesh = square();
  mesh.textures.push_back(texture(kSide, [](int x, int y) {
    return Rgba8{static_cast<std::uint8_t>(x < 8 ? x : 200 + x), static_cast<std::uint8_t>(y * 2), 0, 255};
  }));
  mesh.textures[0].is_smooth = false;
  VoxelRegistry types;
  VoxelizeOptions options;
  options.solid = SolidVoxels::None;
  options.max_types = 2;
  const auto made = voxelize(mesh, options, types);
  ASSERT_TRUE(made);
  ASSERT_EQ(types.size(), 3U);
  EXPECT_EQ(made->warnings.size(), 1U);
  EXPECT_EQ(types[made->grid.get({0, 0, 0})].colour, (Rgba8{4, 15, 0, 255}));
  EXPECT_EQ(types[made->grid.get({15, 0, 15})].colour, (Rgba8{212, 15, 0, 255}));
}

}  // namespace
}  // namespace quoin

// Emission of single faces (VoxelFace::emission_share): images, lamps, meshes, halved cells and propagated light.
// Paths: render/path/path_textures_test.cpp.

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/downsample.h>
#include <quoin/mesh/blocky.h>
#include <quoin/render/lit_meshes.h>
#include <quoin/render/propagated_light.h>

#include "grid/shapes/shape_index.h"
#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/light/emissive_cells.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr Rgba8 kPlainWhite{255, 255, 255, 255};

Texture plain_texture(Rgba8 colour) {
  AlphaImage image{16, 16, {}};
  for (int i = 0; i < 256; ++i) image.rgba.insert(image.rgba.end(), {colour.r, colour.g, colour.b, colour.a});
  return Texture::from_image("plain", image).value();
}

// A white cube that emits from +Y, half of it from +Z and nothing from its other sides.
VoxelProperties lit_cube(float emission = 0.5F) {
  VoxelProperties cube{.name = "cube", .emission = emission};
  std::array<VoxelFace, 6> faces;
  for (VoxelFace& face : faces) face = {.texture = plain_texture(kPlainWhite), .emission_share = 0};
  faces[static_cast<std::size_t>(Direction::PosY)].emission_share = 255;
  faces[static_cast<std::size_t>(Direction::PosZ)].emission_share = 102;
  cube.faces = VoxelFaces(faces);
  return cube;
}

// A thin post with a head of 2 sixteenths that emits.
VoxelProperties small_torch(std::uint8_t head_share = 255) {
  const VoxelFace stick{.tint = {90, 60, 30}, .emission_share = 0};
  const VoxelFace head{.tint = {255, 220, 120}, .emission_share = head_share};
  std::vector<ShapeElement> elements{{.min = {7, 0, 7}, .max = {9, 8, 9}}, {.min = {7, 8, 7}, .max = {9, 10, 9}}};
  for (ElementFace& face : elements[0].faces) face.face = stick;
  for (ElementFace& face : elements[1].faces) face.face = head;
  VoxelProperties torch{.name = "torch", .colour = {90, 60, 30, 255}, .emission = 1.0F};
  torch.shapes = *VoxelShape::from_elements(elements);
  return torch;
}

RenderOptions dark_night(int size) {
  RenderOptions options = sized(size, size);
  options.light.occlusion_mode = OcclusionMode::Off;
  environment_in(options).sun.brightness = 0.0;
  environment_in(options).sky.brightness = 0.0;
  return options;
}

Pixel shown_from(const Scene& scene, DVec3 eye) {
  return pixel_at(taken(scene, towards(eye, {0.5, 0.5, 0.5}, 0.05), dark_night(5)), 2, 2);
}

TEST(FaceEmission, CubesShowSharesOfTheirFaces) {
  Scene scene;
  VoxelProperties cube = lit_cube();
  cube.state_bits = 2;
  cube.orientations = StateOrientations::about_y();
  const VoxelType type = scene.types.add(cube).value();
  Grid grid;
  grid.set({0, 0, 0}, type);
  const InstanceHandle handle = place(scene, std::move(grid));
  EXPECT_EQ(shown_from(scene, {0.501, 9.0, 0.5}), encoded(Vec3(0.5F)));
  EXPECT_EQ(shown_from(scene, {0.5, 0.5, 9.0}), encoded(Vec3(0.2F)));
  EXPECT_EQ(shown_from(scene, {9.0, 0.5, 0.5}), encoded(Vec3(0.0F)));
  const Direction front = AxisOrientation(cube.orientations.by_value[1]).apply(Direction::PosZ);
  scene.edit(scene.instances()[handle].grid).grid.set_data({0, 0, 0}, {.state = 1});
  EXPECT_EQ(shown_from(scene, DVec3(0.5) + 9.0 * DVec3(normal_of(front))), encoded(Vec3(0.2F)));
  EXPECT_EQ(shown_from(scene, {0.5, 0.5, 9.0}), encoded(Vec3(0.0F)));
}

TEST(FaceEmission, ShapesShowSharesOfTheirSides) {
  Scene scene;
  const VoxelType type = scene.types.add(small_torch(51)).value();
  Grid grid;
  grid.set({0, 0, 0}, type);
  place(scene, std::move(grid));
  const auto shown_at = [&](double y) {
    return pixel_at(taken(scene, towards({0.5, y, 9.0}, {0.5, y, 0.5}, 0.002), dark_night(5)), 2, 2);
  };
  EXPECT_EQ(shown_at(9.0 / 16.0), encoded(linear({255, 220, 120}) * 0.2F));
  EXPECT_EQ(shown_at(4.0 / 16.0), encoded(Vec3(0.0F)));
}

TEST(FaceEmission, HalvedShapesHaveMeanOfAreas) {
  VoxelRegistry types;
  const VoxelType type = types.add(small_torch()).value();
  // Stick: 4 * 16 + 8 squares; head: 4 * 4 + 8.
  EXPECT_NEAR(emission_share_of_shapes(types[type]), 24.0F / (72.0F + 24.0F), 1e-5F);
  EXPECT_NEAR(types_of_halved(types)[type].emission, 0.25F, 1e-5F);
  EXPECT_EQ(glow_of_shapes(types[type]), linear({255, 220, 120}));
  VoxelProperties dark = small_torch(0);
  EXPECT_EQ(glow_of_shapes(dark), Vec3(0.0F));
  EXPECT_EQ(emission_share_of_shapes(dark), 0.0F);
}

// A torch of two plates with a whole texture, cut below its flame: two texels wide, 8 of the stick and 2 of the flame.
VoxelProperties cut_torch(bool has_parts) {
  AlphaImage image{16, 16, {}};
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const bool is_visible = (x == 7 || x == 8) && y >= 6;
      const Rgba8 colour = y < 8 ? Rgba8{255, 220, 120} : Rgba8{90, 60, 30};
      const auto alpha = static_cast<std::uint8_t>(is_visible ? 255 : 0);
      image.rgba.insert(image.rgba.end(), {colour.r, colour.g, colour.b, alpha});
    }
  }
  const Texture texture = Texture::from_image("torch", image).value();
  std::vector<ShapeElement> elements{{.min = {0, 0, 7}, .max = {16, 8, 7}}, {.min = {0, 8, 7}, .max = {16, 16, 7}}};
  for (std::size_t i = 0; i < 2; ++i) {
    for (const Direction direction : kDirections) {
      ElementFace& face = elements[i].faces[static_cast<std::size_t>(direction)];
      face.is_drawn = frame_of(direction).axis == 2;
      const auto share = static_cast<std::uint8_t>(i == 0 ? 0 : 255);
      face.face = VoxelFace{.texture = texture, .alpha = FaceAlpha::Cutout, .emission_share = share};
      if (has_parts) face.part = i == 0 ? std::array{16.0F, 8.0F, 0.0F, 16.0F} : std::array{0.0F, 8.0F, 16.0F, 0.0F};
    }
  }
  VoxelProperties torch{.name = "torch", .emission = 1.0F};
  torch.shapes = *VoxelShape::from_elements(elements);
  return torch;
}

TEST(FaceEmission, SidesCountByTheTexelsThatTheyShow) {
  for (const bool has_parts : {false, true}) {
    const VoxelProperties torch = cut_torch(has_parts);
    EXPECT_NEAR(emission_share_of_shapes(torch), 0.2F, 1e-5F) << has_parts;
    const Vec3 glow = glow_of_shapes(torch);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(glow[i], linear({255, 220, 120})[i], 1e-5F) << has_parts;
  }
}

std::array<Vec3, 6> power_of(const Grid& grid, const VoxelRegistry& types, EmissiveCells& cells) {
  cells.update(grid, types);
  std::array<Vec3, 6> power{};
  cells.for_each([&](const EmissiveCell& cell) {
    for (std::size_t i = 0; i < 6; ++i) power[i] += cell.power[i];
  });
  return power;
}

TEST(FaceEmission, LampsOfCubesShineFromTheirFaces) {
  VoxelRegistry types;
  VoxelProperties cube = lit_cube();
  cube.state_bits = 2;
  cube.orientations = StateOrientations::about_y();
  const VoxelType type = types.add(cube).value();
  Grid grid;
  grid.set({5, 6, 7}, type);
  EmissiveCells cells;
  const auto share_towards = [&](Direction face) {
    return power_of(grid, types, cells)[static_cast<std::size_t>(face)].x;
  };
  EXPECT_FLOAT_EQ(share_towards(Direction::PosY), 0.5F);
  EXPECT_FLOAT_EQ(share_towards(Direction::PosZ), 0.2F);
  EXPECT_EQ(share_towards(Direction::PosX), 0.0F);
  EXPECT_EQ(share_towards(Direction::NegY), 0.0F);
  const Direction front = AxisOrientation(cube.orientations.by_value[1]).apply(Direction::PosZ);
  grid.set_data({5, 6, 7}, {.state = 1});
  EXPECT_FLOAT_EQ(share_towards(front), 0.2F);
  EXPECT_EQ(share_towards(Direction::PosZ), 0.0F);
}

TEST(FaceEmission, LampsOfShapesAreCubes) {
  VoxelRegistry types;
  const VoxelType torch = types.add(small_torch()).value();
  const VoxelType dark = types.add(small_torch(0)).value();
  Grid grid;
  grid.set({0, 0, 0}, torch);
  EmissiveCells cells;
  for (const Vec3& power : power_of(grid, types, cells)) EXPECT_EQ(power, linear({255, 220, 120}));
  grid.set({0, 0, 0}, dark);
  for (const Vec3& power : power_of(grid, types, cells)) EXPECT_EQ(power, Vec3(0.0F));
}

TEST(FaceEmission, MeshesPutDarkFacesWithOthersThatDoNotEmit) {
  VoxelRegistry types;
  const VoxelType cube = types.add(lit_cube()).value();
  const VoxelType torch = types.add(small_torch()).value();
  Grid grid;
  grid.set({0, 0, 0}, cube);
  grid.set({3, 0, 0}, torch);
  for (const bool watertight : {false, true}) {
    const BlockyMesh mesh = build_blocky_mesh(grid, types, {.watertight = watertight}).value();
    const auto faces_of = [&](SurfaceClass surface, VoxelType type) {
      const std::vector<VoxelType>& of = mesh.surfaces[static_cast<std::size_t>(surface)].types;
      return std::ranges::count(of, type) / 4;
    };
    EXPECT_EQ(faces_of(SurfaceClass::Emissive, cube), 2);
    EXPECT_EQ(faces_of(SurfaceClass::Opaque, cube), 4);
    EXPECT_EQ(faces_of(SurfaceClass::Emissive, torch), 5);  // the head's lower side lies on the stick
    EXPECT_EQ(faces_of(SurfaceClass::Opaque, torch), 5);
  }
  EXPECT_EQ(surface_class(types[cube], nullptr), SurfaceClass::Emissive);
}

// Returns the light of a cube's face in a lit mesh at night, 0 to 1.
double light_in_mesh(const VoxelProperties& cube, Direction direction) {
  Scene scene;
  const VoxelType type = scene.types.add(cube).value();
  Grid grid;
  grid.set({0, 0, 0}, type);
  place(scene, std::move(grid));
  scene.environment = Environment{};
  scene.environment->sun.brightness = 0.0;
  scene.environment->sky.brightness = 0.0;
  scene.environment->exposure = 1.0;
  const auto meshes = mesh_lit_scene(scene, LightOptions{});
  EXPECT_TRUE(meshes);
  for (const MeshView& view : meshes->parts[0].surfaces) {
    for (std::size_t i = 0; i < view.positions.size(); ++i) {
      if (view.directions[i] == direction) return view.light[i][0] / 65'535.0;
    }
  }
  return -1.0;
}

TEST(FaceEmission, LitMeshesAddShares) {
  // The cube's own propagated light also shines on its faces.
  VoxelProperties dark = lit_cube();
  dark.faces = VoxelFaces(VoxelFace{.texture = plain_texture(kPlainWhite), .emission_share = 0});
  for (const Direction direction : kDirections) {
    const double share = direction == Direction::PosY ? 1.0 : direction == Direction::PosZ ? 0.4 : 0.0;
    EXPECT_NEAR(light_in_mesh(lit_cube(), direction) - light_in_mesh(dark, direction), 0.5 * share, 1e-3);
  }
}

TEST(FaceEmission, PropagatedLightGoesByType) {
  VoxelRegistry types;
  VoxelProperties whole = lit_cube(7.0F / 15.0F);
  whole.faces = VoxelFaces(plain_texture(kPlainWhite));
  const VoxelType cube = types.add(lit_cube(7.0F / 15.0F)).value();
  const VoxelType bright = types.add(whole).value();
  for (const VoxelType type : {cube, bright}) {
    Grid grid;
    grid.set({0, 0, 0}, type);
    PropagatedLight light;
    light.update(grid, types);
    EXPECT_EQ(light.at({0, -1, 0}).red, 6);
    EXPECT_EQ(light.at({0, 1, 0}).red, 6);
  }
}

}  // namespace
}  // namespace quoin

// Textures on the faces of blocks: a wall of bricks with a meadow on top, as a mesh and as an image.

#include <cstdint>
#include <cstdio>
#include <string>

#include <quoin/quoin.h>

namespace {

// Draws 16 x 16 texels. Programs usually read images from files.
template <class Colour>
quoin::AlphaImage drawn(const Colour& colour_at) {
  quoin::AlphaImage image{16, 16, {}};
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const quoin::Rgba8 texel = colour_at(x, y);
      image.rgba.insert(image.rgba.end(), {texel.r, texel.g, texel.b, 255});
    }
  }
  return image;
}

quoin::Result<quoin::Texture> texture_from(const std::string& name, const std::string& file) {
  const auto image = quoin::read_alpha_image(file);
  if (!image) return image.error();
  return quoin::Texture::from_image(name, *image);
}

quoin::Rgba8 brick(int x, int y) {
  const bool is_joint = y % 4 == 3 || (x + y / 4 % 2 * 4) % 8 == 7;
  if (is_joint) return {150, 145, 140};
  return {static_cast<std::uint8_t>(150 + (x * 7 + y * 13) % 30), 70, 55};
}

quoin::Rgba8 blades(int x, int y) {
  const auto grey = static_cast<std::uint8_t>(150 + (x * 37 + y * 91) % 100);
  return {grey, grey, grey};
}

quoin::Result<int> run() {
  for (const auto& written :
       {quoin::write_png(drawn(brick), "brick.png"), quoin::write_png(drawn(blades), "grass.png")}) {
    if (!written) return written.error();
  }
  const auto brick_texture = texture_from("brick", "brick.png");
  if (!brick_texture) return brick_texture.error();
  const auto grass_texture = texture_from("grass", "grass.png");
  if (!grass_texture) return grass_texture.error();

  quoin::Scene scene;
  const quoin::VoxelFace bricks{.texture = *brick_texture};
  const quoin::VoxelFace grass{.texture = *grass_texture, .tint = {120, 200, 90}};
  const auto wall = scene.types.add({.name = "wall", .faces = bricks});
  const auto meadow = scene.types.add({.name = "meadow", .faces = {bricks, grass, bricks}});
  if (!wall || !meadow) return wall ? meadow.error() : wall.error();

  quoin::SceneGrid house{.name = "house"};
  house.grid.fill_box({{0, 0, 0}, {8, 4, 8}}, *wall);
  house.grid.fill_box({{0, 4, 0}, {8, 5, 8}}, *meadow);
  scene.add_instance({.name = "house", .grid = scene.add_grid(std::move(house))});

  const auto meshes = quoin::mesh_scene(scene);
  if (!meshes) return meshes.error();
  const auto mesh = quoin::write_mesh(*meshes, "textured_blocks.glb");
  if (!mesh) return mesh.error();

  const auto camera = quoin::look_at({20, 14, 18}, {4, 2, 4}, 0.6);
  if (!camera) return camera.error();
  quoin::RenderOptions options;
  options.width = 320;
  options.height = 240;
  options.samples = 4;
  const auto image = quoin::CpuRenderer(scene).render(*camera, options);
  if (!image) return image.error();
  const auto png = quoin::write_png(image->colour, "textured_blocks.png");
  if (!png) return png.error();
  const quoin::Rgba8 mean = scene.types[*meadow].colour;
  std::printf("mean colour of the meadow: %d %d %d\n", mean.r, mean.g, mean.b);
  return 0;
}

}  // namespace

int main() {
  const auto result = run();
  if (result) return *result;
  std::fprintf(stderr, "%s\n", to_string(result.error()).c_str());
  return 1;
}

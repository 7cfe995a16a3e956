// Ambient occlusion at corners: a staircase between walls with every occlusion value from 0 to 3. Writes OUT.png
// (default occlusion_staircase.png) in the classic block style (colours times occlusion, without lighting), and a file
// with the suffix _grey that shows only occlusion.

#include <array>
#include <cstdio>
#include <string>

#include <quoin/io/image_files.h>
#include <quoin/mesh/blocky.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>

namespace {

quoin::Result<quoin::Scene> make_staircase() {
  quoin::Scene scene;
  std::array<quoin::VoxelType, 2> marble{};
  for (std::size_t i = 0; i < 2; ++i) {
    quoin::VoxelProperties properties;
    properties.colour = i == 0 ? quoin::Rgba8{226, 218, 202, 255} : quoin::Rgba8{190, 128, 96, 255};
    const auto added = scene.types.add(properties);
    if (!added) return added.error();
    marble[i] = *added;
  }
  quoin::SceneGrid hall;
  quoin::Grid& grid = hall.grid;
  grid.fill_box({{0, 0, 0}, {22, 1, 26}}, marble[0]);
  grid.fill_box({{0, 1, 0}, {22, 15, 1}}, marble[0]);  // two walls
  grid.fill_box({{0, 1, 0}, {1, 15, 26}}, marble[0]);
  for (int step = 0; step < 9; ++step) {  // two edges and a corner meet where steps touch the wall
    grid.fill_box({{1, 1, 1}, {11, 2 + step, 20 - 2 * step}}, marble[step % 2 == 0 ? 1 : 0]);
  }
  for (const int z : {4, 12, 20}) {
    grid.fill_box({{15, 1, z}, {18, 2, z + 3}}, marble[1]);
    grid.fill_box({{16, 2, z + 1}, {17, 10, z + 2}}, marble[1]);
    grid.fill_box({{15, 10, z}, {18, 11, z + 3}}, marble[1]);
  }
  scene.add_instance({"", scene.add_grid(std::move(hall))});
  return scene;
}

// Counts the occlusion values at quad corners.
std::array<int, 4> count_occlusion(const quoin::Scene& scene) {
  std::array<int, 4> count{};
  quoin::BlockyMesher mesher;
  quoin::QuadBuffer quads;
  scene.grids().for_each([&](quoin::GridHandle, const quoin::SceneGrid& grid) {
    for (const quoin::IVec3 chunk : grid.grid.chunks()) {
      mesher.mesh(grid.grid.neighbourhood(chunk), scene.types, {}, quads);
      for (const quoin::Quad& quad : quads) {
        for (int corner = 0; corner < 4; ++corner) ++count[quad.occlusion(corner)];
      }
    }
  });
  return count;
}

quoin::Status draw(const quoin::Scene& scene, quoin::Shading shading, const std::string& path) {
  quoin::RenderOptions options;
  options.width = 480;
  options.height = 360;
  options.samples = 4;
  options.light.shading = shading;
  options.light.occlusion_mode = quoin::OcclusionMode::Vertex;
  const auto camera = quoin::look_at({44.0, 34.0, 50.0}, {9.0, 4.5, 10.5}, 0.42);
  if (!camera) return camera.error();
  const auto image = quoin::CpuRenderer(scene).render(*camera, options);
  if (!image) return image.error();
  const auto size = quoin::write_png(image->colour, path);
  return size ? quoin::Status() : size.error();
}

}  // namespace

int main(int argc, char** argv) {
  const auto scene = make_staircase();
  std::string path = argc > 1 ? argv[1] : "occlusion_staircase.png";
  quoin::Status status = scene ? draw(*scene, quoin::Shading::UnlitWithOcclusion, path) : scene.error();
  if (status) status = draw(*scene, quoin::Shading::Occlusion, path.insert(path.rfind('.'), "_grey"));
  if (!status) {
    std::fprintf(stderr, "occlusion_staircase: %s\n", quoin::to_string(status.error()).c_str());
    return 1;
  }
  const std::array<int, 4> count = count_occlusion(*scene);
  std::printf("corners of quads with occlusion 0, 1, 2, 3: %d, %d, %d, %d\n", count[0], count[1], count[2], count[3]);
  return count[0] > 0 && count[1] > 0 && count[2] > 0 && count[3] > 0 ? 0 : 1;
}

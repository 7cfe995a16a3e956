// Writes many voxels from the caller's data: GridWriter for single voxels, Grid::edit for changes that depend on
// existing voxels. Makes a vase with running glaze. Writes OUT.png (default vase.png).

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include <quoin/grid/grid.h>
#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>

namespace {

constexpr int kHeight = 72;
constexpr int kReach = 30;

double radius_at(int y) {
  const double t = static_cast<double>(y) / kHeight;
  return 9.0 + 15.0 * std::sin(3.0 * t) * (1.0 - 0.45 * t) + 9.0 * t * t * t * t;
}

// GridWriter collects rows along x and sets them at once: a tenth of the time of Grid::set.
void turn_on_the_wheel(quoin::Grid& grid, quoin::VoxelType clay) {
  quoin::GridWriter writer(grid);
  for (int y = 0; y < kHeight; ++y) {
    const double outer = radius_at(y);
    const double inner = y < 3 ? -1.0 : outer - 2.5;
    for (int z = -kReach; z <= kReach; ++z) {
      for (int x = -kReach; x <= kReach; ++x) {
        const double r = std::hypot(x, z);
        if (r <= outer && r > inner) writer.set(x, y, z, clay);
      }
    }
  }
}

// The callback receives each voxel's type and returns the new one; air stays air. Returns the number of changes.
std::int64_t glaze(quoin::Grid& grid, const std::array<quoin::VoxelType, 2>& colours) {
  const quoin::IBox box{{-kReach, 22, -kReach}, {kReach + 1, kHeight, kReach + 1}};
  return grid.edit(box, [&](quoin::IVec3 v, quoin::VoxelType before) {
    if (before == quoin::kAir) return before;
    const double angle = std::atan2(v.z, v.x);
    const double edge = 44.0 + 9.0 * std::sin(5.0 * angle) + 5.0 * std::sin(11.0 * angle + 1.0);
    if (v.y < edge) return before;
    return colours[static_cast<std::size_t>(v.y - edge < 4.0)];
  });
}

quoin::Status draw(const quoin::Scene& scene, const std::string& path) {
  quoin::RenderOptions options;
  options.width = 300;
  options.height = 360;
  options.samples = 4;
  const quoin::Camera camera = quoin::frame_scene(scene, quoin::View::Iso, 300.0 / 360.0);
  const auto image = quoin::CpuRenderer(scene).render(camera, options);
  if (!image) return image.error();
  const auto size = quoin::write_png(image->colour, path);
  return size ? quoin::Status() : size.error();
}

}  // namespace

int main(int argc, char** argv) {
  quoin::Scene scene;
  std::array<quoin::VoxelType, 3> types{};
  constexpr std::array<quoin::Rgba8, 3> kColours = {{{186, 96, 60, 255}, {38, 92, 140, 255}, {222, 226, 214, 255}}};
  for (std::size_t i = 0; i < types.size(); ++i) {
    quoin::VoxelProperties properties;
    properties.colour = kColours[i];
    const auto added = scene.types.add(properties);
    if (!added) return 1;
    types[i] = *added;
  }
  quoin::SceneGrid vase;
  turn_on_the_wheel(vase.grid, types[0]);
  const std::int64_t glazed = glaze(vase.grid, {types[1], types[2]});
  std::printf("%lld voxels, %lld of them glazed\n", static_cast<long long>(vase.grid.voxel_count()),
              static_cast<long long>(glazed));
  scene.add_instance({"", scene.add_grid(std::move(vase))});
  const quoin::Status status = draw(scene, argc > 1 ? argv[1] : "vase.png");
  if (!status) std::fprintf(stderr, "write_voxels: %s\n", quoin::to_string(status.error()).c_str());
  return status && glazed > 0 ? 0 : 1;
}

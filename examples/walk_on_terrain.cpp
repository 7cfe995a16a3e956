// Moves a player's box over smooth terrain and through a house of blocks: slopes, steps, and a wall that is too high.
// Prints its position every second of 60 frames.

#include <cmath>
#include <cstdio>

#include <quoin/scene/sweep.h>

namespace {

quoin::Scene hill_and_house(quoin::VoxelType ground, quoin::VoxelType wood) {
  quoin::Scene scene;
  quoin::SceneGrid land;
  land.field.edit({{-40, -16, -16}, {41, 17, 17}}, [&](quoin::IVec3 p, quoin::DensitySample) {
    const double height = 3.0 * std::sin(0.16 * p.x) + 1.5 * std::cos(0.21 * p.z);
    return quoin::DensitySample{static_cast<float>(p.y - height), ground};
  });
  land.grid.fill_box({{16, -8, -6}, {30, 1, 6}}, wood);  // the house's floor and far wall
  land.grid.fill_box({{29, 1, -6}, {30, 4, 6}}, wood);
  quoin::Instance instance;
  instance.grid = scene.add_grid(std::move(land));
  scene.add_instance(instance);
  return scene;
}

}  // namespace

int main() {
  quoin::VoxelRegistry types;
  quoin::VoxelProperties properties;
  properties.name = "grass";
  const auto ground = types.add(properties);
  properties.name = "wood";
  const auto wood = types.add(properties);
  if (!ground || !wood) return 1;
  quoin::Scene scene = hill_and_house(*ground, *wood);
  scene.types = types;
  const quoin::SceneTracer tracer(scene);

  // Surfaces of up to 50 degrees are floors. The box climbs steps of 0.6 and stays on the ground on the way down.
  quoin::SlideOptions options;
  options.floor = quoin::FloorOptions{{0, 1, 0}, 50.0, 0.6, 0.4};
  quoin::OrientedBox box{{-30.0, 8.0, 0.3}, {0.4, 0.9, 0.4}};
  constexpr double kFrame = 1.0 / 60.0;
  double falling = 0.0;
  quoin::SlideResult moved;
  for (int frame = 0; frame < 960; ++frame) {
    falling -= 9.81 * kFrame;
    moved = move_and_slide(tracer, box, quoin::DVec3(4.5, falling, 0.0) * kFrame, options);
    box.centre = moved.centre;
    falling = moved.displacement.y / kFrame;
    if (frame % 60 != 59) continue;
    std::printf("%2d s: at x %6.2f, feet at %5.2f, %s%s\n", frame / 60 + 1, box.centre.x, box.centre.y - 0.9,
                moved.is_on_floor ? "on a floor" : "in the air", moved.is_blocked ? ", blocked by a wall" : "");
  }
  // At the far wall of the house, on its floor.
  return moved.is_on_floor && moved.is_blocked && std::abs(box.centre.x - 28.6) < 0.01 ? 0 : 1;
}

#pragma once

#include <quoin/grid/grid.h>
#include <quoin/io/vox.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/scene.h>

namespace demo {

/// The palette of the demo world.
struct Palette {
  quoin::VoxelType grass, meadow, soil, rock, sand, path, wall, wall_dark, trim, roof, roof_dark, wood, plank, leaf,
      leaf_light, water, glass, lamp, flag, sail;
};

/// Registers the palette's types.
[[nodiscard]] quoin::Result<Palette> add_palette(quoin::VoxelRegistry& types);

/// Ground height at a column of the island, 0 to about 30; below kSeaLevel lies under water.
[[nodiscard]] int ground_height(int x, int z);
inline constexpr int kIslandEdge = 192;
inline constexpr int kSeaLevel = 9;

/// The island with its castle, in [0, kIslandEdge) along x and z.
[[nodiscard]] quoin::Grid make_island(const Palette& palette);
/// A tree, its trunk's foot in the middle of the bottom layer.
[[nodiscard]] quoin::Grid make_tree(const Palette& palette, int height);
/// A ship, its bow towards -z.
[[nodiscard]] quoin::Grid make_ship(const Palette& palette);
/// The demo world: the island about the world's origin, trees where the ground is grass, two ships at sea.
[[nodiscard]] quoin::Result<quoin::Scene> make_castle();

/// A fleet of voxel ships over a generated terrain, with a camera and a sun.
[[nodiscard]] quoin::Result<quoin::LoadedScene> make_fleet();

/// Returns the render options of the fleet, with its own sun.
[[nodiscard]] quoin::RenderOptions fleet_options(const quoin::LoadedScene& fleet);

}  // namespace demo

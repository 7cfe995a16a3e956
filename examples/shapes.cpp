// Shapes of blocks that are no cubes: stairs, a slab, fences, torches, a flower and a door, in a small yard.

#include <cstdint>
#include <cstdio>
#include <utility>
#include <vector>

#include <quoin/quoin.h>

namespace {

using quoin::AxisOrientation;
using quoin::Direction;
using quoin::ShapeElement;
using quoin::VoxelShape;

// Half a cube. The state puts it at the bottom or at the top of its voxel.
quoin::VoxelProperties slab() {
  return {.name = "slab",
          .colour = {170, 170, 165},
          .state_bits = 1,
          .orientations = {.by_value = {AxisOrientation(), AxisOrientation::quarter_turns(0, 2)}},
          .shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16})};
}

// A slab and up to four quarters on it: the corners that stairs form with their neighbours.
quoin::Result<quoin::VoxelProperties> stairs() {
  using enum quoin::StairCorner;
  const auto quarter = [](int x, int z, std::vector<quoin::ShapeCondition> when) {
    return quoin::ShapePart{.shape = VoxelShape::box({x, 8, z}, {x + 8, 16, z + 8}), .when = std::move(when)};
  };
  const auto front = [](quoin::StairCorner one) {
    return std::vector<quoin::ShapeCondition>{
        {.corner = Straight}, {.corner = one}, {.corner = InnerLeft}, {.corner = InnerRight}};
  };
  auto shapes = quoin::VoxelShapes::from_rules({.parts = {{.shape = VoxelShape::box({0, 0, 0}, {16, 8, 16})},
                                                          quarter(8, 0, front(OuterLeft)),
                                                          quarter(8, 8, front(OuterRight)),
                                                          quarter(0, 0, {{.corner = InnerLeft}}),
                                                          quarter(0, 8, {{.corner = InnerRight}})},
                                                .neighbours = quoin::ShapeNeighbours::Stairs});
  if (!shapes) return shapes.error();
  return quoin::VoxelProperties{.name = "stairs",
                                .colour = {150, 110, 70},
                                .state_bits = 3,
                                .orientations = quoin::StateOrientations::about_y_and_upside_down(),
                                .shapes = *shapes};
}

// A post, and two rails towards each neighbour that is a fence or a wall.
quoin::Result<quoin::VoxelProperties> fence() {
  std::vector<quoin::ShapePart> parts = {{.shape = VoxelShape::box({6, 0, 6}, {10, 16, 10})}};
  for (int turns = 0; turns < 4; ++turns) {
    const AxisOrientation turn = AxisOrientation::quarter_turns(1, turns);
    parts.push_back({.shape = VoxelShape::boxes({{{10, 6, 7}, {16, 9, 9}}, {{10, 12, 7}, {16, 15, 9}}}),
                     .orientation = turn,
                     .when = {{.connected = {turn.apply(Direction::PosX)}}}});
  }
  auto shapes =
      quoin::VoxelShapes::from_rules({.parts = std::move(parts), .neighbours = quoin::ShapeNeighbours::Connected});
  if (!shapes) return shapes.error();
  return quoin::VoxelProperties{.name = "fence", .colour = {120, 85, 50}, .shapes = *shapes};
}

// A stick that leans from the wall behind it, and glows.
quoin::Result<quoin::VoxelProperties> torch() {
  const ShapeElement stick{
      .min = {-1, 3, 7}, .max = {1, 13, 9}, .turn = {{.origin = {0, 3, 8}, .axis = 2, .degrees = -22.5F}}};
  const auto shape = VoxelShape::from_elements({stick});
  if (!shape) return shape.error();
  return quoin::VoxelProperties{.name = "torch",
                                .colour = {255, 200, 90},
                                .collides = false,
                                .emission = 2.0F,
                                .state_bits = 2,
                                .orientations = quoin::StateOrientations::about_y(),
                                .shapes = *shape};
}

// Two plates with a cutout texture: a stem and a blossom.
quoin::Result<quoin::VoxelProperties> flower() {
  quoin::AlphaImage image{16, 16, std::vector<std::uint8_t>(std::size_t{4} * 16 * 16)};
  for (int y = 4; y < 16; ++y) {
    for (int x = 4; x < 12; ++x) {
      const bool is_blossom = y < 9 && (x + y) % 3 != 0;
      if (!is_blossom && (x < 7 || x > 8 || y < 9)) continue;
      std::uint8_t* const texel = &image.rgba[static_cast<std::size_t>(4 * (x + 16 * y))];
      texel[is_blossom ? 0 : 1] = is_blossom ? 230 : 150;
      texel[3] = 255;
    }
  }
  const auto texture = quoin::Texture::from_image("flower", image);
  if (!texture) return texture.error();
  quoin::VoxelProperties made;
  made.name = "flower";
  made.visibility = quoin::Visibility::Transparent;
  made.collides = false;
  made.faces = quoin::VoxelFace{.texture = *texture, .alpha = quoin::FaceAlpha::Cutout};
  made.shapes = VoxelShape::crossed_plates();
  return made;
}

// A thin board along -X. Bit 2 of the state opens the door: the board turns about its corner.
quoin::Result<quoin::VoxelProperties> door() {
  const VoxelShape board = VoxelShape::box({0, 0, 0}, {3, 16, 16});
  auto shapes = quoin::VoxelShapes::from_rules({.parts = {{.shape = board, .when = {{.state_mask = 0b100, .state = 0}}},
                                                          {.shape = board,
                                                           .orientation = AxisOrientation::quarter_turns(1, -1),
                                                           .when = {{.state_mask = 0b100, .state = 0b100}}}}});
  if (!shapes) return shapes.error();
  return quoin::VoxelProperties{.name = "door",
                                .colour = {140, 95, 45},
                                .state_bits = 3,
                                .orientations = quoin::StateOrientations::about_y(),
                                .shapes = *shapes};
}

struct Blocks {
  quoin::VoxelType ground, wall, slab, stairs, fence, torch, flower, door;
};

quoin::Result<Blocks> add_blocks(quoin::VoxelRegistry& types) {
  std::vector<quoin::VoxelType> made;
  for (const quoin::Result<quoin::VoxelProperties>& type :
       {quoin::Result<quoin::VoxelProperties>({.name = "ground", .colour = {95, 145, 70}}),
        quoin::Result<quoin::VoxelProperties>({.name = "wall", .colour = {190, 180, 160}}),
        quoin::Result<quoin::VoxelProperties>(slab()), stairs(), fence(), torch(), flower(), door()}) {
    if (!type) return type.error();
    const auto added = types.add(*type);
    if (!added) return added.error();
    made.push_back(*added);
  }
  return Blocks{made[0], made[1], made[2], made[3], made[4], made[5], made[6], made[7]};
}

// Places a voxel where a player hits a face of another one, in the grid's space.
void place(quoin::Grid& world, const quoin::VoxelRegistry& types, quoin::VoxelType type, quoin::IVec3 hit_voxel,
           const quoin::PlacingHit& hit) {
  const quoin::VoxelData data{.state = quoin::placed_state(types[type], hit)};
  world.set(hit_voxel + quoin::normal_of(hit.face), type, data);
}

// A hut with a door between two torches, stairs up to its roof of slabs, and a garden behind a fence.
quoin::Grid yard(const quoin::VoxelRegistry& types, const Blocks& b) {
  quoin::Grid grid;
  grid.fill_box({{0, 0, 0}, {14, 1, 12}}, b.ground);
  grid.fill_box({{8, 1, 2}, {13, 4, 8}}, b.wall);
  grid.fill_box({{9, 1, 3}, {12, 4, 7}}, quoin::kAir);
  grid.fill_box({{8, 4, 2}, {13, 5, 8}}, b.slab);
  for (int y = 1; y < 3; ++y) grid.set({8, y, 5}, b.door, {.state = 0b100});
  for (const int z : {4, 6}) place(grid, types, b.torch, {8, 3, z}, {.face = Direction::NegX, .look = {0.8, 0.3, 0.5}});
  for (int i = 0; i < 4; ++i) {
    grid.fill_box({{9 + i, 1, 8}, {10 + i, 1 + i, 9}}, b.wall);
    grid.set({9 + i, 1 + i, 8}, b.stairs);
  }
  for (int i = 0; i < 6; ++i) {
    for (const quoin::IVec3 at : {quoin::IVec3(i, 1, 1), quoin::IVec3(i, 1, 10), quoin::IVec3(0, 1, 2 + i)}) {
      grid.set(at, b.fence);
    }
    grid.set({1 + i % 3 * 2, 1, 3 + i / 3 * 4}, b.flower);
  }
  return grid;
}

quoin::Result<int> run() {
  quoin::Scene scene;
  const auto blocks = add_blocks(scene.types);
  if (!blocks) return blocks.error();
  quoin::SceneGrid entry{.name = "yard", .grid = yard(scene.types, *blocks)};
  const quoin::ShapeModel* const corner = quoin::shape_at(entry.grid, scene.types, {0, 1, 1});
  std::printf("boxes of the fence's corner: %zu\n", corner->boxes.size());
  const quoin::GridHandle grid = scene.add_grid(std::move(entry));
  scene.add_instance({.name = "yard", .grid = grid});
  const auto meshes = quoin::mesh_scene(scene);
  if (!meshes) return meshes.error();
  const auto mesh = quoin::write_mesh(*meshes, "shapes.glb");
  if (!mesh) return mesh.error();
  std::printf("quads: %lld\n", static_cast<long long>(meshes->stats.quads));
  // A game's renderer receives the faces of shapes with the quads, again after each edit: the door closes.
  quoin::LiveMeshes live;
  for (const std::uint32_t state : {0b100U, 0U}) {
    for (int y = 1; y < 3; ++y) scene.edit(grid).grid.set_data({8, y, 5}, {.state = state});
    live.finish(scene, {});
    for (const quoin::SurfaceUpdate& update : live.take()) {
      std::printf("faces of shapes: %zu\n", update.surface->shapes.size());
    }
  }
  return 0;
}

}  // namespace

int main() {
  const auto result = run();
  if (result) return *result;
  std::fprintf(stderr, "%s\n", to_string(result.error()).c_str());
  return 1;
}

// Surfaces of live meshes hold the faces of shapes, equal to those of meshes made from scratch.

#include <quoin/live/live_meshes.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/live/live_light.h>
#include <quoin/mesh/blocky.h>
#include <quoin/render/surface_light.h>

#include "grid/shapes/shape_types_for_tests.h"
#include "live/live_test_support.h"

namespace quoin {
namespace {

Texture plain_texture(std::uint8_t shade) {
  return Texture::from_image("t", AlphaImage{16, 16, std::vector<std::uint8_t>(std::size_t{4} * 16 * 16, shade)})
      .value();
}

VoxelFaces faces_of_furnace(bool has_door) {
  const VoxelFace side{.texture = plain_texture(255)};
  const VoxelFace door{.texture = side.texture, .tint = {200, 0, 0}};
  return VoxelFaces({has_door ? door : side, side, side, side, side, side});
}

/// A shape whose side is covered if its neighbour on the opposite side connects: a change reaches two voxels.
VoxelShapes bridge() {
  ShapeRules rules{.parts = {{.shape = VoxelShape::box({6, 6, 6}, {10, 10, 10})}},
                   .neighbours = ShapeNeighbours::Connected};
  const VoxelShape half = VoxelShape::box({8, 0, 0}, {16, 16, 16});
  for (const auto& [axis, turns] : {std::pair{1, 0}, {1, 1}, {1, 2}, {1, 3}, {2, 1}, {2, 3}}) {
    const AxisOrientation turn = AxisOrientation::quarter_turns(axis, turns);
    rules.parts.push_back({.shape = half, .orientation = turn, .when = {{.connected = {turn.apply(Direction::NegX)}}}});
  }
  return *VoxelShapes::from_rules(std::move(rules));
}

/// A floor and random voxels with shapes around the corner of eight chunks.
class ShapedWorld {
 public:
  explicit ShapedWorld(unsigned seed) : random_(seed), types_(scene.types) {
    VoxelProperties furnace{.name = "furnace", .state_bits = 2};
    furnace.faces = faces_of_furnace(true);
    furnace.orientations = StateOrientations::about_y();
    furnace_ = scene.types.add(furnace).value();
    VoxelProperties stairs{.name = "stairs with corners", .state_bits = 3};
    stairs.orientations = StateOrientations::about_y_and_upside_down();
    stairs.shapes = shapes_for_tests::stairs();
    scene.types.add(stairs).value();
    scene.types.add({.name = "bridge", .shapes = bridge()}).value();
    SceneGrid entry;
    entry.grid.fill_box({{-20, -7, -20}, {20, -3, 20}}, types_.stone);
    handle = scene.add_grid(std::move(entry));
    scene.add_instance({"world", handle});
    for (int i = 0; i < 150; ++i) set_any();
  }

  [[nodiscard]] const Grid& grid() const { return scene.grids()[handle].grid; }
  Grid& edited() { return scene.edit(handle).grid; }
  int below(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }

  void edit_voxels() {
    switch (below(8)) {
      case 0:
        edited().fill_box({place(), place() + IVec3(1 + below(4), 1 + below(2), 1 + below(4))}, any_type());
        break;
      case 1:
      case 2: {
        // Only the state changes.
        const std::vector<IVec3> all = shaped();
        const IVec3 at = all[static_cast<std::size_t>(below(static_cast<int>(all.size())))];
        edited().set(at, grid().get(at), {.state = state_for(grid().get(at))});
        break;
      }
      default:
        set_any();
    }
  }

  void edit_types() {
    const std::array<VoxelType, 5> some = {types_.slab, types_.stairs, types_.pane, furnace_, types_.torch};
    const VoxelType type = some[static_cast<std::size_t>(below(5))];
    VoxelProperties now = scene.types[type];
    const auto height = 1 + below(16);
    if (type == types_.slab) {
      now.shapes = below(3) == 0 ? VoxelShapes() : VoxelShapes(VoxelShape::box({0, 0, 0}, {16, height, 16}));
    } else if (type == types_.stairs) {
      now.orientations = below(2) == 0 ? StateOrientations::about_y() : StateOrientations::about_y_and_upside_down();
      now.state_bits = 3;
    } else if (type == types_.pane) {
      now.visibility = below(2) == 0 ? Visibility::Opaque : Visibility::Transparent;
    } else if (type == furnace_) {
      now.faces = faces_of_furnace(below(2) == 0);
    } else {
      now.emission = static_cast<float>(below(2));
    }
    scene.types.replace(type, now);
  }

  Scene scene;
  GridHandle handle;

 private:
  IVec3 place() { return {below(10) - 5, below(8) - 5, below(10) - 5}; }
  VoxelType any_type() { return static_cast<VoxelType>(below(static_cast<int>(scene.types.size()))); }
  std::uint32_t state_for(VoxelType type) {
    return static_cast<std::uint32_t>(below(16)) & ((1U << scene.types[type].state_bits) - 1);
  }
  void set_any() {
    const VoxelType type = any_type();
    if (type == kAir) {
      edited().set(place(), kAir);
    } else {
      edited().set(place(), type, {.state = state_for(type)});
    }
  }
  std::vector<IVec3> shaped() {
    std::vector<IVec3> all;
    for (int i = 0; i < 1'000; ++i) {
      const IVec3 at{i % 10 - 5, i / 10 % 10 - 5, i / 100 - 5};
      if (scene.types[grid().get(at)].state_bits != 0) all.push_back(at);
    }
    return all.empty() ? std::vector<IVec3>{IVec3(0)} : all;
  }

  std::mt19937 random_;
  ShapeTypes types_;
  VoxelType furnace_ = kAir;
};

/// The faces of a chunk in the order of its surface. Quads are sorted by their bits.
struct Faces {
  std::vector<std::pair<std::uint64_t, FaceLight>> quads;
  ShapeFaceBuffer shapes;
  std::size_t opaque_shapes = 0;
  BlockVector<FaceLight> shape_light;

  [[nodiscard]] bool empty() const { return quads.empty() && shapes.empty(); }
  bool operator==(const Faces&) const = default;
};

bool is_transparent(const VoxelRegistry& types, const ShapeFace& face) {
  return types[face.type].visibility == Visibility::Transparent;
}

/// Meshes chunks from scratch.
class FreshMeshes {
 public:
  FreshMeshes(const ShapedWorld& world, int edge, const SceneLight* light) : world_(world), edge_(edge) {
    if (light == nullptr) return;
    const GridLight lit = light->of(world.handle);
    light_.emplace(*lit.light, *lit.voxels, world.scene.types);
  }
  Faces of(IVec3 chunk) {
    const VoxelRegistry& types = world_.scene.types;
    Faces made;
    QuadBuffer quads;
    mesher_.mesh(world_.grid().neighbourhood(chunk), types, {}, quads, made.shapes);
    std::ranges::stable_sort(made.shapes, {}, [&](const ShapeFace& face) {
      const IVec3 at = face.voxel() / edge_;
      return std::tuple(is_transparent(types, face), at.z, at.y, at.x);
    });
    made.opaque_shapes = static_cast<std::size_t>(
        std::ranges::count_if(made.shapes, [&](const ShapeFace& face) { return !is_transparent(types, face); }));
    if (!light_) {
      for (const std::uint64_t bits : cut_at(quads, edge_)) made.quads.emplace_back(bits, FaceLight{});
      return made;
    }
    QuadBuffer split;
    BlockVector<FaceLight> corners;
    light_->split(quads, chunk, LightMerging::Linear, split, corners);
    for (std::size_t i = 0; i < split.size(); ++i) made.quads.emplace_back(split[i].bits, corners[i]);
    std::ranges::sort(made.quads);
    light_->read(made.shapes, chunk, made.shape_light);
    return made;
  }

 private:
  const ShapedWorld& world_;
  int edge_;
  BlockyMesher mesher_;
  std::optional<SurfaceLight> light_;
};

Faces faces_of(const ChunkSurface& surface) {
  Faces held;
  held.shapes = surface.shapes;
  held.opaque_shapes = surface.opaque_shapes;
  held.shape_light = surface.shape_light;
  for (std::size_t i = 0; i < surface.quads.size(); ++i) {
    held.quads.emplace_back(surface.quads[i].bits, surface.light.empty() ? FaceLight{} : surface.light[i]);
  }
  std::ranges::sort(held.quads);
  return held;
}

// Expects that each face is in the range of its region.
void expect_regions(const ChunkSurface& surface, int edge) {
  ASSERT_EQ(surface.region_shapes.size(), surface.shapes.empty() ? 0 : surface.regions.size());
  std::size_t faces = 0;
  for (std::size_t i = 0; i < surface.region_shapes.size(); ++i) {
    for (const auto& [first, end] : {surface.region_shapes[i].opaque, surface.region_shapes[i].transparent}) {
      for (std::uint32_t face = first; face < end; ++face, ++faces) {
        ASSERT_EQ(surface.shapes[face].voxel() / edge, surface.regions[i].region);
      }
    }
  }
  EXPECT_EQ(faces, surface.shapes.size());
}

// Returns the number of faces of shapes.
std::size_t expect_fresh(const ShownSurfaces& shown, const ShapedWorld& world, int edge, const SceneLight* light) {
  FreshMeshes fresh(world, edge, light);
  std::size_t faces = 0;
  for (const IVec3 chunk : world.grid().chunks()) {
    const Faces expected = fresh.of(chunk);
    const ChunkSurface* const surface = shown.find(world.handle, chunk);
    EXPECT_EQ(surface == nullptr, expected.empty());
    if (surface == nullptr) continue;
    EXPECT_TRUE(faces_of(*surface) == expected) << chunk.x << " " << chunk.y << " " << chunk.z;
    expect_regions(*surface, edge);
    faces += expected.shapes.size();
  }
  return faces;
}

// Compares live meshes with fresh ones between random edits. `light`: null for meshes without light.
void expect_fresh_after_edits(unsigned seed, int edge, SceneLight* light) {
  ShapedWorld world(seed);
  LiveMeshOptions options;
  options.region_edge = edge;
  LiveMeshes meshes(options);
  if (light != nullptr) meshes.use_light(light);
  ShownSurfaces shown;
  for (int round = 0; round < 40 && !testing::Test::HasFailure(); ++round) {
    SCOPED_TRACE("edge " + std::to_string(edge) + ", round " + std::to_string(round));
    if (light != nullptr) light->update(world.scene);
    meshes.finish(world.scene, {});
    shown.apply(meshes.take());
    EXPECT_GT(expect_fresh(shown, world, edge, light), 300U);
    for (int i = world.below(3); i >= 0; --i) world.edit_voxels();
    if (round % 4 == 3) world.edit_types();
  }
}

TEST(LiveShapes, MatchFreshMeshesAfterEdits) {
  for (const int edge : {16, 64}) expect_fresh_after_edits(static_cast<unsigned>(edge), edge, nullptr);
}

TEST(LiveShapes, MatchFreshLightAfterEdits) {
  SceneLight light;
  expect_fresh_after_edits(3, kChunkEdge, &light);
}

TEST(LiveShapes, FollowLiveLight) {
  ShapedWorld world(4);
  LiveLight light;
  LiveMeshOptions options;
  options.region_edge = kChunkEdge;
  LiveMeshes meshes(options);
  meshes.use_light(light);
  ShownSurfaces shown;
  for (int frame = 0; frame < 20; ++frame) {
    world.edit_voxels();
    meshes.update(world.scene, {});
    shown.apply(meshes.take());
  }
  meshes.finish(world.scene, {});
  shown.apply(meshes.take());
  EXPECT_GT(expect_fresh(shown, world, kChunkEdge, &light.shown()), 300U);
}

// The random edits reach farther than one voxel, and some change only states.
TEST(LiveShapes, EditsReachFartherThanOneVoxel) {
  ShapedWorld world(5);
  std::map<IVec3, Faces, ByZyx> held;
  ChangeCursor cursor;
  int stale = 0;
  for (int round = 0; round < 30; ++round) {
    FreshMeshes fresh(world, kChunkEdge, nullptr);
    const GridChanges changes = world.grid().changes_since(cursor);
    for (const IVec3 chunk : chunks_to_mesh(world.grid(), changes)) held[chunk] = fresh.of(chunk);
    for (const IVec3 chunk : world.grid().chunks()) {
      Faces now = fresh.of(chunk);
      if (held[chunk] == now) continue;
      ++stale;
      held[chunk] = std::move(now);
    }
    world.edit_voxels();
  }
  EXPECT_GT(stale, 3);
}

// The end of an arm that reaches out of its chunk has the light of a voxel two away from the chunk.
TEST(LiveShapes, FollowLightTwoVoxelsAway) {
  Scene scene;
  EXPECT_TRUE(scene.types.add({.name = "stone"}));
  EXPECT_TRUE(scene.types.add({.name = "lamp", .colour = {255, 255, 255}, .emission = 1.0F}));
  ShapeElement arm{.min = {-16, 2, 2}, .max = {4, 14, 14}};
  EXPECT_TRUE(scene.types.add({.name = "arm", .shapes = VoxelShape::from_elements({arm}).value()}));
  SceneGrid entry;
  entry.grid.fill_box({{-30, 0, 0}, {10, 12, 12}}, 1);
  entry.grid.fill_box({{-29, 1, 1}, {9, 11, 11}}, kAir);
  entry.grid.set({0, 5, 5}, 3);
  entry.grid.set({-16, 5, 5}, 2);  // 14 voxels away from (-2, 5, 5), where the last of its light is
  const GridHandle handle = scene.add_grid(std::move(entry));
  scene.add_instance({"", handle});
  SceneLight light;
  LiveMeshes meshes;
  meshes.use_light(&light);
  std::uint32_t with_lamp = 0;
  for (const bool has_lamp : {true, false}) {
    if (!has_lamp) scene.edit(handle).grid.set({-16, 5, 5}, kAir);
    light.update(scene, {1});
    meshes.finish(scene, {});
    std::uint32_t brightest = 0;
    bool is_given = false;
    for (const SurfaceUpdate& update : meshes.take()) {
      for (const FaceLight& corners : update.surface->shape_light) {
        is_given = true;
        for (const std::uint32_t corner : corners) brightest = std::max(brightest, corner);
      }
    }
    EXPECT_TRUE(is_given);
    if (has_lamp) with_lamp = brightest;
    if (!has_lamp) {
      EXPECT_EQ(brightest, 0U);
    }
  }
  EXPECT_GT(with_lamp, 0U);
}

// The light of a face in the open is that of the voxels around it, as the corners of quads have it.
TEST(LiveShapes, LightOfFullBoxEqualsThatOfCube) {
  Scene scene;
  EXPECT_TRUE(scene.types.add({.name = "stone"}));
  EXPECT_TRUE(scene.types.add({.name = "lamp", .emission = 0.9F}));
  EXPECT_TRUE(scene.types.add({.name = "glass", .visibility = Visibility::Transparent}));
  EXPECT_TRUE(scene.types.add(
      {.name = "box", .visibility = Visibility::Transparent, .shapes = VoxelShape::box(IVec3(0), IVec3(kShapeUnits))}));
  SceneGrid entry;
  entry.grid.fill_box({{0, 0, 0}, {12, 1, 12}}, 1);
  entry.grid.set({2, 1, 3}, 2);
  entry.grid.fill_box({{8, 1, 2}, {9, 5, 9}}, 1);
  entry.grid.set({6, 2, 5}, 4);
  const GridHandle handle = scene.add_grid(std::move(entry));
  scene.add_instance({"", handle});
  SceneLight light;
  light.update(scene, {1});
  const GridLight lit = light.of(handle);
  SurfaceLight surface(*lit.light, *lit.voxels, scene.types);
  QuadBuffer quads;
  ShapeFaceBuffer shapes;
  BlockyMesher().mesh(lit.voxels->neighbourhood(IVec3(0)), scene.types, {}, quads, shapes);
  ASSERT_EQ(shapes.size(), 6U);
  BlockVector<FaceLight> corners;
  surface.read(shapes, IVec3(0), corners);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const ModelFace& face = shapes[i].model_face();
    const FaceFrame& frame = frame_of(face.direction);
    const FaceLight cube = surface.face({6, 2, 5}, face.direction);
    EXPECT_GT(cube[0], 0U);
    for (std::size_t c = 0; c < 4; ++c) {
      const bool is_far_u = face.corners[c][frame.u] == 1.0F;
      const bool is_far_v = face.corners[c][frame.v] == 1.0F;
      EXPECT_EQ(corners[i][c], cube[is_far_v ? (is_far_u ? 2U : 3U) : (is_far_u ? 1U : 0U)]) << i << " " << c;
    }
  }
}

TEST(LiveShapes, LightEqualsThatOfVertices) {
  ShapedWorld world(8);
  world.edited().fill_box({{-5, 3, -5}, {4, 4, 4}}, 1);
  SceneLight light;
  light.update(world.scene);
  const GridLight lit = light.of(world.handle);
  SurfaceLight surface(*lit.light, *lit.voxels, world.scene.types);
  BlockyMesher mesher;
  QuadBuffer quads;
  ShapeFaceBuffer shapes;
  BlockVector<FaceLight> corners;
  for (const IVec3 chunk : world.grid().chunks()) {
    mesher.mesh(world.grid().neighbourhood(chunk), world.scene.types, {}, quads, shapes);
    surface.read(shapes, chunk, corners);
    ASSERT_EQ(corners.size(), shapes.size());
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      for (std::size_t c = 0; c < 4; ++c) {
        const Vec3 normal = shapes[i].model_face().normal;
        const Vec3 sample = shapes[i].corner(c) - 0.5F;
        std::array<MeanLevels, 1> levels;
        surface.read({{&sample, 1}, {&normal, 1}, chunk * kChunkEdge}, levels);
        const MeanLevels rounded = levels_of_corner(corners[i][c]);
        for (const auto level : {&MeanLevels::sky, &MeanLevels::red, &MeanLevels::green, &MeanLevels::blue}) {
          ASSERT_NEAR(rounded.*level, levels[0].*level, 0.5F / 12.0F + 1e-5F);
        }
      }
    }
  }
}

TEST(LiveShapes, OutliveTheirTypesAndMeshes) {
  std::vector<SurfaceUpdate> held;
  std::vector<std::uint64_t> models;
  {
    ShapedWorld world(6);
    LiveMeshes meshes;
    meshes.finish(world.scene, {});
    held = meshes.take();
    for (const SurfaceUpdate& update : held) {
      for (const ShapeFace& face : update.surface->shapes) models.push_back(face.model->hash);
    }
  }
  ASSERT_GT(models.size(), 300U);
  auto model = models.begin();
  for (const SurfaceUpdate& update : held) {
    for (const ShapeFace& face : update.surface->shapes) {
      ASSERT_EQ(face.model->hash, *model++);
      ASSERT_LT(face.face, face.model->faces.size());
    }
  }
}

TEST(LiveShapes, StatesChangeOnlyTheirRegion) {
  Scene scene;
  const ShapeTypes types(scene.types);
  SceneGrid entry;
  entry.grid.fill_box({{0, 0, 0}, {64, 2, 64}}, types.stone);
  entry.grid.set({20, 2, 40}, types.door, {.state = 0});
  entry.grid.set({50, 2, 40}, types.door, {.state = 0});
  const GridHandle handle = scene.add_grid(std::move(entry));
  scene.add_instance({"", handle});
  LiveMeshes meshes;
  meshes.finish(scene, {});
  ASSERT_EQ(meshes.take().size(), 1U);
  scene.edit(handle).grid.set({20, 2, 40}, types.door, {.state = 1});
  meshes.finish(scene, {});
  const std::vector<SurfaceUpdate> updates = meshes.take();
  ASSERT_EQ(updates.size(), 1U);
  EXPECT_EQ(updates[0].changed_regions, std::uint64_t{1} << (1 + 4 * (0 + 4 * 2)));
  EXPECT_EQ(updates[0].surface->shapes.size(), 10U);
  EXPECT_EQ(updates[0].surface->triangles(), 2 * static_cast<std::int64_t>(updates[0].surface->quads.size()) + 20);
}

// A door next to the last voxel of a chunk closes the bridge there, which then covers a cube of the next chunk.
TEST(LiveShapes, FollowStatesTwoVoxelsAway) {
  Scene scene;
  const ShapeTypes types(scene.types);
  const VoxelType over = scene.types.add({.name = "bridge", .shapes = bridge()}).value();
  SceneGrid entry;
  entry.grid.set({62, 5, 5}, types.door, {.state = 0});
  entry.grid.set({63, 5, 5}, over);
  entry.grid.set({64, 5, 5}, types.stone);
  const GridHandle handle = scene.add_grid(std::move(entry));
  scene.add_instance({"", handle});
  LiveMeshes meshes;
  ShownSurfaces shown;
  for (const std::uint32_t state : {0U, 2U, 0U}) {
    scene.edit(handle).grid.set_data({62, 5, 5}, {.state = state});
    meshes.finish(scene, {});
    shown.apply(meshes.take());
    EXPECT_EQ(shown.find(handle, {1, 0, 0})->quads.size(), state == 0 ? 6U : 5U);
  }
}

// No voxel is of the fluid that the slab contains.
TEST(LiveShapes, ContainedFluidsFollowTheirTypes) {
  Scene scene;
  const VoxelProperties of_sea{.name = "sea",
                               .visibility = Visibility::Transparent,
                               .shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid, .groups = 2})};
  ShapeRules rules{.parts = {{.shape = VoxelShape::box({0, 0, 0}, {16, 8, 16})}}};
  rules.fluid = ContainedFluid{.groups = 2};
  const VoxelType slab = *scene.types.add({.name = "slab", .shapes = *VoxelShapes::from_rules(std::move(rules))});
  SceneGrid entry;
  entry.grid.set({5, 5, 5}, slab);
  const GridHandle handle = scene.add_grid(std::move(entry));
  scene.add_instance({"", handle});
  LiveMeshes meshes;
  ShownSurfaces shown;
  const auto shown_faces = [&] {
    meshes.finish(scene, {});
    shown.apply(meshes.take());
    return shown.find(handle, {0, 0, 0})->shapes.size();
  };
  EXPECT_EQ(shown_faces(), 6U);
  const VoxelType sea = *scene.types.add(of_sea);
  EXPECT_GT(shown_faces(), 6U);
  scene.types.replace(sea, {.name = "ice"});
  EXPECT_EQ(shown_faces(), 6U);
}

TEST(LiveShapes, AreCubesOnRequest) {
  ShapedWorld world(7);
  LiveMeshOptions options;
  options.shapes = ShapeUse::Cubes;
  options.region_edge = kChunkEdge;
  LiveMeshes meshes(options);
  meshes.finish(world.scene, {});
  for (const SurfaceUpdate& update : meshes.take()) {
    QuadBuffer quads;
    BlockyMesher().mesh(world.grid().neighbourhood(update.chunk), world.scene.types, {.shapes = ShapeUse::Cubes},
                        quads);
    EXPECT_EQ(cut_at(update.surface->quads, kChunkEdge), cut_at(quads, kChunkEdge));
    EXPECT_TRUE(update.surface->shapes.empty() && update.surface->region_shapes.empty());
  }
}

}  // namespace
}  // namespace quoin

#pragma once

// A scene that changes at random, and comparisons of its tracers.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/scene.h>
#include <quoin/scene/scene_query.h>
#include <quoin/scene/scene_tracer.h>

#include "core/not_finite_for_tests.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/scene_view.h"
#include "scene/tracer/tree_cache.h"

namespace quoin {

/// A scene with random changes of every kind.
class ChangingScene {
 public:
  /// `has_fields`: some changes edit fields, or load and unload chunks of partial grids.
  /// `has_shapes`: some types have shapes, which their state selects, or are fluids, which shapes contain, and some
  /// changes edit states.
  explicit ChangingScene(unsigned seed, bool has_fields = false, bool has_shapes = false)
      : has_fields_(has_fields), has_shapes_(has_shapes), random_(seed) {
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(scene.types.add(properties()).has_value());
    for (int i = 0; i < 4; ++i) add_grid();
    for (int i = 0; i < 12; ++i) add_instance();
  }

  void change() {
    if (has_fields_ && below(3) == 0) return change_field_or_load();
    if (has_shapes_ && below(4) == 0) return change_states();
    switch (below(14)) {
      case 0:
        return add_grid();
      case 1:
        return remove_grid();
      case 2:
        return add_instance();
      case 3:
        return remove_instance();
      case 4:
        return replace_grid();
      case 5:
        return change_types();
      case 6:
        if (SceneGrid* grid = any_grid()) grid->pivot = vector() * 20.0;
        return;
      case 7:
        if (SceneGrid* grid = any_grid()) (void)grid->grid.cursor();
        return;
      case 8:
        if (SceneGrid* grid = any_grid()) empty(grid->grid);
        return;
      case 9:
      case 10:
      case 11:
        if (SceneGrid* grid = any_grid()) edit(grid->grid);
        return;
      default:
        if (Instance* instance = any_instance()) move(*instance);
    }
  }

  DVec3 vector() { return {share(), share(), share()}; }
  double share() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random_); }
  int below(int limit) { return static_cast<int>(random_() % static_cast<unsigned>(limit)); }

  Scene scene;

 private:
  VoxelProperties properties() {
    VoxelProperties properties;
    properties.visibility = below(3) == 0 ? Visibility::Transparent : Visibility::Opaque;
    if (!has_shapes_) return properties;
    properties.state_bits = 2;
    if (below(3) == 0) return properties;
    if (below(4) == 0) {
      properties.visibility = Visibility::Transparent;
      properties.shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid, .groups = 1U << below(2)});
      return properties;
    }
    properties.orientations = StateOrientations::about_y();
    const auto box = [](IVec3 lower, IVec3 upper) { return ShapePart{.shape = VoxelShape::box(lower, upper)}; };
    ShapeRules rules{.parts = {box({0, 0, 0}, {16, 4 + 4 * below(3), 8})}};
    if (below(2) == 0) {
      rules.parts.push_back({.shape = *VoxelShape::from_elements({{.min = {-6, 2, 6}, .max = {0, 20, 10}}})});
      rules.neighbours = ShapeNeighbours::Connected;
      rules.parts.back().when = {{.connected = {Direction::PosX}}};
    }
    if (below(2) == 0) {
      rules.fluid = ContainedFluid{.groups = 1U << below(2), .when = {{.state_mask = 1, .state = 1}}};
    }
    properties.shapes = *VoxelShapes::from_rules(std::move(rules));
    return properties;
  }
  // Returns a type, which may be unregistered.
  VoxelType type() { return static_cast<VoxelType>(1 + static_cast<unsigned>(below(4))); }

  SceneGrid* any_grid() {
    const auto handles = scene.grids().handles();
    return handles.empty() ? nullptr : &scene.edit(handles[random_() % handles.size()]);
  }
  Instance* any_instance() {
    const auto handles = scene.instances().handles();
    return handles.empty() ? nullptr : &scene.edit(handles[random_() % handles.size()]);
  }

  void edit(Grid& grid) {
    const IVec3 at = IVec3(vector() * 60.0) * 2;
    if (below(3) == 0) {
      grid.set(at, below(3) == 0 ? kAir : type());
    } else {
      const IVec3 size(1 + 2 * below(30), 1 + 2 * below(30), 1 + 2 * below(30));
      grid.fill_box({at, at + size + 1}, below(4) == 0 ? kAir : type());
    }
  }
  void change_field_or_load() {
    SceneGrid* grid = any_grid();
    if (grid == nullptr) return;
    const DVec3 at = vector() * 60.0;
    if (below(8) == 0) grid->grid.make_partial();
    if (grid->grid.is_partial()) {
      const IVec3 chunk(below(3) - 1, below(3) - 1, below(3) - 1);
      if (!grid->grid.unload_chunk(chunk)) grid->grid.load_chunk(chunk, Chunk(below(2) == 0 ? kAir : type()));
    } else if (below(4) == 0) {
      grid->field.remove_sphere(at, 4.0 + below(12));
    } else {
      grid->field.add_sphere(at, 4.0 + below(12), type());
    }
  }
  void change_states() {
    SceneGrid* grid = any_grid();
    if (grid == nullptr || grid->grid.bounds().empty()) return;
    const IBox box = grid->grid.bounds();
    for (int i = 0; i < 20; ++i) {
      const IVec3 size = box.size();
      const IVec3 at = box.min + IVec3(below(size.x), below(size.y), below(size.z));
      (void)grid->grid.set_data(at, {static_cast<std::uint32_t>(below(4)), {}});
    }
  }
  void empty(Grid& grid) {
    if (below(2) == 0) grid.clear();
    if (!grid.bounds().empty()) grid.fill_box(grid.bounds(), kAir);
  }
  // Replaces a grid.
  void replace_grid() {
    SceneGrid* grid = any_grid();
    if (grid == nullptr) return;
    if (below(2) == 0) {
      grid->grid = grid->grid.snapshot();
      return;
    }
    grid->grid = Grid();
    for (int i = below(20); i > 0; --i) grid->grid.set({i, below(5), below(5)}, type());
  }
  void change_types() {
    if (below(3) == 0 && scene.types.size() < 6) {
      EXPECT_TRUE(scene.types.add(properties()).has_value());
    } else {
      scene.types.replace(static_cast<VoxelType>(1 + below(3)), properties());
    }
  }
  void add_grid() {
    SceneGrid grid;
    grid.pivot = vector() * 20.0;
    for (int i = below(4); i >= 0; --i) edit(grid.grid);
    scene.add_grid(std::move(grid));
  }
  void remove_grid() {
    const auto handles = scene.grids().handles();
    if (handles.size() > 1) scene.remove_grid(handles[random_() % handles.size()]);
  }
  void add_instance() {
    const auto handles = scene.grids().handles();
    if (handles.empty()) return;
    Instance instance;
    instance.grid = handles[random_() % handles.size()];
    instance.position = vector() * 300.0;
    scene.add_instance(instance);
    move(scene.edit(scene.instances().handles().back()));
  }
  void remove_instance() {
    const auto handles = scene.instances().handles();
    if (!handles.empty()) scene.remove_instance(handles[random_() % handles.size()]);
  }
  void move(Instance& instance) {
    const int what = below(12);
    if (what < 5) instance.position = vector() * 300.0;
    if (what == 5 || what == 6) instance.rotation = DQuat(share(), share(), share(), share());
    if (what == 7) instance.voxel_size = 1.0 + 0.5 * share();
    if (what == 8) instance.mirrored = !instance.mirrored;
    if (what == 9) instance.visible = !instance.visible;
    if (what == 10) instance.position.x = std::isfinite(instance.position.x) ? kInfinity : 0.0;
    if (what == 11) instance.grid = scene.grids().handles()[0];
  }

  bool has_fields_;
  bool has_shapes_;
  std::mt19937 random_;
};

/// Numbers of compared results, so that a test can require that there were some.
struct TracerCounts {
  int hits = 0;
  int transparent = 0;
  int halved = 0;
  int shapes = 0;
};

inline void expect_same_shapes(const TracedShapes* a, const TracedShapes* b, TracerCounts& counts) {
  ASSERT_EQ(a == nullptr, b == nullptr);
  if (a == nullptr) return;
  ++counts.shapes;
  EXPECT_EQ(a->index.chunks(), b->index.chunks());
  EXPECT_EQ(a->index.bounds(), b->index.bounds());
  EXPECT_EQ(a->touched.bounds(), b->index.bounds());
  for (const IVec3 chunk : b->index.chunks()) {
    EXPECT_TRUE(std::ranges::equal(a->index.cubes_in(chunk), b->index.cubes_in(chunk)));
    for (int i = 0; i < kChunkEdge * kChunkEdge; i += 7) {
      const IVec3 first = chunk * kChunkEdge + IVec3(0, i % kChunkEdge, i / kChunkEdge);
      const std::uint64_t row = b->index.touched_row(first);
      ASSERT_EQ(a->index.touched_row(first), row);
      for (int x = 0; x < kChunkEdge; x += 5) {
        const IVec3 voxel = first + IVec3(x, 0, 0);
        ASSERT_EQ(a->touched.is_occupied(voxel), (row >> x & 1U) != 0);
        const auto shapes_a = a->index.at(voxel);
        const auto shapes_b = b->index.at(voxel);
        ASSERT_EQ(shapes_a.size(), shapes_b.size());
        for (std::size_t k = 0; k < shapes_a.size(); ++k) {
          EXPECT_EQ(shapes_a[k].voxel, shapes_b[k].voxel);
          EXPECT_EQ(shapes_a[k].type, shapes_b[k].type);
          EXPECT_EQ(shapes_a[k].model, shapes_b[k].model);
        }
      }
    }
  }
}

inline void expect_same_placed(const SceneTracer& updated, const SceneTracer& fresh, bool is_detailed,
                               TracerCounts& counts) {
  ASSERT_EQ(placed_in(updated).size(), placed_in(fresh).size());
  EXPECT_EQ(updated.has_transparent(), fresh.has_transparent());
  for (std::size_t i = 0; i < placed_in(fresh).size(); ++i) {
    const PlacedGrid& a = placed_in(updated)[i];
    const PlacedGrid& b = placed_in(fresh)[i];
    EXPECT_EQ(a.instance, b.instance);
    EXPECT_EQ(a.grid, b.grid);
    EXPECT_TRUE(is_detailed || a.voxels == b.voxels);
    EXPECT_EQ(a.voxels->voxel_count(), b.voxels->voxel_count());
    EXPECT_EQ(a.pivot, b.pivot);
    EXPECT_EQ(a.world_axes, b.world_axes);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.voxel_size, b.voxel_size);
    EXPECT_EQ(a.detail, b.detail);
    EXPECT_EQ(a.level, b.level);
    EXPECT_EQ(a.opaque->bounds(), b.opaque->bounds());
    ASSERT_EQ(a.transparent == nullptr, b.transparent == nullptr);
    if (a.transparent != nullptr) {
      EXPECT_EQ(a.transparent->bounds(), b.transparent->bounds());
    }
    for (const auto tree : {&PlacedGrid::glass_voxels, &PlacedGrid::face_cells}) {
      ASSERT_EQ(a.*tree == nullptr, b.*tree == nullptr);
      if (b.*tree != nullptr) {
        EXPECT_EQ((a.*tree)->bounds(), (b.*tree)->bounds());
      }
    }
    counts.halved += b.level > 0;
    EXPECT_TRUE(b.level == 0 || b.shapes == nullptr);
    // Instances share them.
    if (i == 0 || b.shapes != placed_in(fresh)[i - 1].shapes) expect_same_shapes(a.shapes, b.shapes, counts);
  }
}

/// Compares the hits of two tracers for all kinds of ray queries.
inline void expect_same_hits(const SceneTracer& updated, const SceneTracer& fresh, ChangingScene& world,
                             TracerCounts& counts) {
  const DVec3 origin = world.vector() * 300.0;
  const SceneView a(updated, origin);
  const SceneView b(fresh, origin);
  for (int round = 0; round < 12 && !placed_in(fresh).empty(); ++round) {
    const auto home = static_cast<std::int32_t>(world.below(static_cast<int>(placed_in(fresh).size())));
    const DVec3 towards = placed_in(fresh)[static_cast<std::size_t>(home)].position - origin + world.vector() * 40.0;
    RayPacket rays;
    const DVec3 from = world.vector() * 300.0;
    for (int lane = 0; lane < 16; ++lane) {
      rays.set(lane, {from, glm::normalize(towards - from) + world.vector() * 0.05}, lane == 3 ? 200.0 : kInfinity);
    }
    SceneHits hits_a;
    SceneHits hits_b;
    a.first_hits(rays, hits_a);
    b.first_hits(rays, hits_b);
    ASSERT_EQ(hits_a.grids.hit, hits_b.grids.hit);
    EXPECT_EQ(a.any_transparent(rays), b.any_transparent(rays));
    EXPECT_EQ(a.any_hits(home, rays), b.any_hits(home, rays));
    counts.hits += hits_b.grids.hit != 0;
    counts.transparent += b.any_transparent(rays) != 0;
    for (int lane = 0; lane < 16; ++lane) {
      if ((hits_b.grids.hit >> lane & 1U) == 0) continue;
      const auto i = static_cast<std::size_t>(lane);
      EXPECT_EQ(hits_a.placed[i], hits_b.placed[i]);
      EXPECT_EQ(hits_a.grids[lane].t, hits_b.grids[lane].t);
      EXPECT_EQ(hits_a.grids[lane].voxel, hits_b.grids[lane].voxel);
    }
    const Ray ray{rays.ray(5).origin + origin, rays.ray(5).direction};
    const auto found_a = first_hit(updated, ray);
    const auto found_b = first_hit(fresh, ray);
    ASSERT_EQ(found_a.has_value(), found_b.has_value());
    if (found_b) {
      EXPECT_EQ(found_a->instance, found_b->instance);
      EXPECT_EQ(found_a->voxel, found_b->voxel);
      EXPECT_EQ(found_a->type, found_b->type);
    }
  }
}

}  // namespace quoin

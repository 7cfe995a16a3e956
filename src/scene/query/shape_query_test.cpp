#include <cmath>
#include <limits>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/scene.h>
#include <quoin/scene/scene_query.h>

#include "grid/shapes/shape_index.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "scene/query/field_scene_for_tests.h"
#include "scene/tracer/scene_view.h"

namespace quoin {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

// A convex or closed solid as triangles, relative to `away`.
struct PlainSolid {
  InstanceHandle instance;
  IVec3 voxel;
  bool collides = true;
  std::vector<std::array<DVec3, 3>> triangles;
};

void add_polygon(PlainSolid& solid, const std::array<DVec3, 4>& p) {
  solid.triangles.push_back({p[0], p[1], p[2]});
  if (p[3] != p[2]) solid.triangles.push_back({p[0], p[2], p[3]});
}

// The corners of a box in its voxel: those of the box's own space, moved back.
std::array<DVec3, 8> corners_of(const ModelBox& box) {
  std::array<DVec3, 8> corners;
  glm::dmat3 inverse(1.0);
  if (box.is_turned) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        inverse[column][row] = box.inverse[static_cast<std::size_t>(row)][column];
      }
    }
  }
  const glm::dmat3 turn = glm::inverse(inverse);
  for (unsigned i = 0; i < 8; ++i) {
    const DVec3 p((i & 1U) != 0 ? box.max.x : box.min.x, (i & 2U) != 0 ? box.max.y : box.min.y,
                  (i & 4U) != 0 ? box.max.z : box.min.z);
    corners[i] = box.is_turned ? turn * p + DVec3(box.origin) : p;
  }
  return corners;
}

std::vector<PlainSolid> all_solids(const Scene& scene) {
  constexpr std::array<std::array<std::size_t, 4>, 6> kSides = {
      {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}}};
  std::vector<PlainSolid> all;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    grid.grid.for_each([&](IVec3 voxel, VoxelType type) {
      const auto at = [&](const DVec3& p) { return world_from_grid(instance, grid, DVec3(voxel) + p); };
      const auto add_box = [&](const ModelBox& box) {
        PlainSolid& solid = all.emplace_back(PlainSolid{handle, voxel, box.collides && scene.types[type].collides, {}});
        const std::array<DVec3, 8> corners = corners_of(box);
        for (const auto& side : kSides) {
          add_polygon(solid, {at(corners[side[0]]), at(corners[side[1]]), at(corners[side[2]]), at(corners[side[3]])});
        }
      };
      const ShapeModel* const model = shape_at(grid.grid, scene.types, voxel);
      if (model == nullptr) return add_box({});
      for (const ModelBox& box : model->boxes) add_box(box);
      if (model->free_faces == 0) return;
      PlainSolid& solid = all.emplace_back(PlainSolid{handle, voxel, true, {}});
      for (std::size_t i = model->faces.size() - model->free_faces; i < model->faces.size(); ++i) {
        const std::array<Vec3, 4>& c = model->faces[i].corners;
        add_polygon(solid, {at(DVec3(c[0])), at(DVec3(c[1])), at(DVec3(c[2])), at(DVec3(c[3]))});
      }
    });
  }
  return all;
}

// Source: T. Moeller, B. Trumbore, "Fast, minimum storage ray-triangle intersection" (1997).
double crossing(const std::array<DVec3, 3>& triangle, const Ray& ray) {
  const DVec3 a = triangle[1] - triangle[0];
  const DVec3 b = triangle[2] - triangle[0];
  const DVec3 p = glm::cross(ray.direction, b);
  const double determinant = glm::dot(a, p);
  if (std::abs(determinant) < 1e-12 * glm::length(a) * glm::length(b) * glm::length(ray.direction)) return kNone;
  const DVec3 from = ray.origin - triangle[0];
  const double u = glm::dot(from, p) / determinant;
  const DVec3 q = glm::cross(from, a);
  const double v = glm::dot(ray.direction, q) / determinant;
  return u < 0.0 || v < 0.0 || u + v > 1.0 ? kNone : glm::dot(b, q) / determinant;
}

struct PlainHit {
  double t = kNone;
  bool starts_inside = false;
};

PlainHit nearest_of(const std::vector<PlainSolid>& solids, const Ray& ray, bool only_colliding) {
  PlainHit best;
  for (const PlainSolid& solid : solids) {
    if (only_colliding && !solid.collides) continue;
    int crossings = 0;
    double t = kNone;
    for (const auto& triangle : solid.triangles) {
      const double at = crossing(triangle, ray);
      if (!(at >= 0.0) || at == kNone) continue;
      ++crossings;
      t = std::min(t, at);
    }
    // Plates have both their sides at the same place.
    const bool is_inside = crossings % 2 == 1;
    if (is_inside) t = 0.0;
    if (t < best.t) best = {t, is_inside};
  }
  return best;
}

Scene random_shapes(Random& random) {
  Scene scene;
  const ShapeTypes types(scene.types);
  const std::vector<VoxelType> all = {types.stone, types.slab, types.stairs, types.fence, types.torch, types.flower,
                                      types.door,  types.beam, types.water,  types.pane,  types.rubble};
  std::vector<GridHandle> grids;
  for (int i = 0; i < 3; ++i) {
    SceneGrid grid;
    grid.pivot = random.vector() * 4.0;
    for (int voxel = 0; voxel < 150; ++voxel) {
      // Across the corner of eight chunks.
      const IVec3 at(random.vector() * 5.0);
      const VoxelType type = all[random.engine() % all.size()];
      grid.grid.set(at, type, {static_cast<std::uint32_t>(random.engine() % 6), {}});
    }
    grids.push_back(scene.add_grid(std::move(grid)));
  }
  for (int i = 0; i < 12; ++i) {
    Instance instance;
    instance.grid = grids[static_cast<std::size_t>(i % 3)];
    instance.position = random.vector() * 12.0;
    if (i % 3 != 0) instance.rotation = random.rotation();
    instance.voxel_size = 1.0 + 0.5 * random.share();
    instance.mirrored = i % 4 == 0;
    scene.add_instance(instance);
  }
  return scene;
}

// Rays in the directions to the 26 neighbours, then random ones.
Ray ray_of(int i, Random& random) {
  const int number = i % 52;
  if (number >= 27 || number == 13) return {random.vector() * 25.0, random.vector() * 2.0};
  return {random.vector() * 12.0, DVec3(number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1)};
}

TEST(ShapeQuery, RaysHitNearestPartOfAnyShape) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    Random random(seed);
    const Scene scene = random_shapes(random);
    const SceneTracer tracer(scene);
    const std::vector<PlainSolid> solids = all_solids(scene);
    int hits = 0;
    int inside = 0;
    for (int i = 0; i < 400; ++i) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", ray " << i);
      const bool only_colliding = i % 5 == 0;
      QueryFilter filter;
      if (only_colliding) filter.types = QueryTypes::Colliding;
      const Ray ray = ray_of(i, random);
      const PlainHit wanted = nearest_of(solids, ray, only_colliding);
      const auto hit = first_hit(tracer, ray, kNone, filter);
      ASSERT_EQ(hit.has_value(), wanted.t != kNone);
      ASSERT_EQ(any_hit(tracer, ray, kNone, filter), wanted.t != kNone);
      if (!hit) continue;
      ++hits;
      ASSERT_NEAR(hit->t, wanted.t, 1e-5);
      EXPECT_EQ(hit->starts_inside, wanted.starts_inside);
      inside += hit->starts_inside ? 1 : 0;
      EXPECT_NEAR(glm::length(hit->normal), 1.0, 1e-6);
      EXPECT_LT(glm::dot(hit->normal, ray.direction), 0.0);
      EXPECT_EQ(hit->type, scene.grids()[scene.instances()[hit->instance].grid].grid.get(hit->voxel));
      if (hit->starts_inside) continue;
      EXPECT_FALSE(first_hit(tracer, ray, hit->t * 0.9999 - 1e-5, filter));
      EXPECT_TRUE(any_hit(tracer, ray, hit->t * 1.0001 + 1e-5, filter));
    }
    EXPECT_GT(hits, 100);
    EXPECT_GT(inside, 0);
  }
}

struct OneVoxel {
  Scene scene;
  ShapeTypes types{scene.types};
  OneVoxel(VoxelType ShapeTypes::*type, std::uint32_t state = 0) {
    SceneGrid grid;
    grid.grid.set({0, 0, 0}, types.*type, {state, {}});
    scene.add_instance({.grid = scene.add_grid(std::move(grid))});
  }
};

TEST(ShapeQuery, SlabIsHitAtHalfItsHeight) {
  const OneVoxel world(&ShapeTypes::slab);
  const SceneTracer tracer(world.scene);
  const auto hit = first_hit(tracer, {{0.5, 5.0, 0.5}, {0.0, -1.0, 0.0}});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->position, DVec3(0.5, 0.5, 0.5));
  EXPECT_EQ(hit->face, Direction::PosY);
  EXPECT_EQ(hit->normal, DVec3(0.0, 1.0, 0.0));
  EXPECT_EQ(hit->voxel, IVec3(0));
  EXPECT_FALSE(hit->starts_inside);
  // Above the slab, in its voxel.
  EXPECT_FALSE(first_hit(tracer, {{0.5, 0.75, -2.0}, {0.0, 0.0, 1.0}}));
  EXPECT_TRUE(first_hit(tracer, {{0.5, 0.25, 0.5}, {0.0, 1.0, 0.0}})->starts_inside);
  EXPECT_FALSE(first_hit(tracer, {{0.5, 0.75, 0.5}, {0.0, -1.0, 0.0}})->starts_inside);
  // A point on the upper side is outside.
  EXPECT_FALSE(first_hit(tracer, {{0.5, 0.5, 0.5}, {0.0, 1.0, 0.0}}));
}

TEST(ShapeQuery, HitOutsideItsVoxelNamesTheVoxel) {
  const OneVoxel world(&ShapeTypes::beam);
  const SceneTracer tracer(world.scene);
  const auto hit = first_hit(tracer, {{0.5, 1.5, -5.0}, {0.0, 0.0, 1.0}});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->voxel, IVec3(0));
  EXPECT_EQ(hit->type, world.types.beam);
  EXPECT_DOUBLE_EQ(hit->t, 5.0 + 7.0 / 16.0);
  // The upright element does not collide.
  EXPECT_FALSE(first_hit(tracer, {{0.5, 1.5, -5.0}, {0.0, 0.0, 1.0}}, 100.0, {.types = QueryTypes::Colliding}));
}

TEST(ShapeQuery, OpaqueQueriesFollowTheMaterial) {
  const OneVoxel slab(&ShapeTypes::slab);
  const OneVoxel pane(&ShapeTypes::pane);
  const Ray ray{{0.5, 0.25, -5.0}, {0.0, 0.0, 1.0}};
  const QueryFilter opaque{.types = QueryTypes::Opaque};
  EXPECT_TRUE(any_hit(SceneTracer(slab.scene), ray, 100.0, opaque));
  EXPECT_FALSE(any_hit(SceneTracer(pane.scene), ray, 100.0, opaque));
  EXPECT_TRUE(any_hit(SceneTracer(pane.scene), ray));
}

TEST(ShapeQuery, TurnedElementsGiveTheirNormal) {
  const OneVoxel world(&ShapeTypes::flower);
  const SceneTracer tracer(world.scene);
  const auto hit = first_hit(tracer, {{0.25, 0.5, -5.0}, {0.0, 0.0, 1.0}});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->t, 5.25, 1e-6);
  EXPECT_NEAR(std::abs(hit->normal.x), std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(hit->normal.z, -std::sqrt(0.5), 1e-6);
  EXPECT_LT(glm::dot(DVec3(normal_of(hit->face)), DVec3(0.0, 0.0, 1.0)) - 0.5, 0.0);
}

// A town whose shapes and cubes are near each other, and some far away.
Scene shapes_and_cubes(Random& random) {
  Scene scene;
  const ShapeTypes types(scene.types);
  const std::vector<VoxelType> all = {types.stone, types.slab, types.stairs, types.fence, types.torch, types.flower,
                                      types.door,  types.beam, types.water,  types.pane,  types.rubble};
  SceneGrid grid;
  const auto put = [&](IVec3 at) {
    grid.grid.set(at, all[random.engine() % all.size()], {static_cast<std::uint32_t>(random.engine() % 6), {}});
  };
  for (int i = 0; i < 300; ++i) put(IVec3(random.vector() * 9.0));  // across the corner of eight chunks
  for (int i = 0; i < 60; ++i) put(IVec3(random.vector() * 150.0));
  scene.add_instance({.grid = scene.add_grid(std::move(grid))});
  return scene;
}

// Rays of packets ask lists of shapes and trees of voxels together; single rays ask one after the other.
TEST(ShapeQuery, PacketsAgreeWithSingleRays) {
  int in_shapes = 0;
  int in_cubes = 0;
  int blocked = 0;
  for (unsigned seed = 0; seed < 4; ++seed) {
    Random random(seed);
    const Scene scene = shapes_and_cubes(random);
    const SceneTracer tracer(scene);
    const SceneView view(tracer, DVec3(0.0));
    const QueryFilter filter{.types = QueryTypes::Opaque};
    for (int number = 0; number < 60; ++number) {
      RayPacket packet;
      const Ray middle = ray_of(number, random);
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        const double spread = number % 3 == 0 ? 0.0 : number % 3 == 1 ? 0.02 : 1.0;
        const Ray ray{middle.origin + (0.5 + spread) * random.vector(), middle.direction + spread * random.vector()};
        packet.set(lane, ray, lane % 4 == 0 ? 8.0 * random.share() : kNone);
      }
      packet.active = number % 5 == 0 ? 0x5A5AU : 0xFFFFU;
      SceneHits hits;
      view.first_hits(packet, hits);
      const std::uint32_t any = view.any_hits(0, packet);
      EXPECT_EQ(hits.grids.hit & ~packet.active, 0U);
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        if ((packet.active >> lane & 1U) == 0) continue;
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", packet " << number << ", lane " << lane);
        const auto i = static_cast<std::size_t>(lane);
        const auto wanted = first_hit(tracer, packet.ray(lane), packet.max_t[i], filter);
        ASSERT_EQ((hits.grids.hit >> lane & 1U) != 0, wanted.has_value());
        ASSERT_EQ((any >> lane & 1U) != 0, wanted.has_value());
        blocked += wanted.has_value() ? 0 : 1;
        if (!wanted) continue;
        const RayHit hit = hits.grids[lane];
        ASSERT_EQ(hit.t, wanted->t);
        EXPECT_EQ(hit.voxel, wanted->voxel);
        EXPECT_EQ(hit.face, wanted->face);
        EXPECT_EQ(hit.starts_inside, wanted->starts_inside);
        const bool in_shape = (hits.in_shape >> lane & 1U) != 0;
        EXPECT_EQ(in_shape, scene.types.is_shaped(wanted->type));
        if (in_shape) {
          EXPECT_EQ(hits.shapes[i].type, wanted->type);
          EXPECT_LT(glm::distance(glm::normalize(DVec3(hits.shapes[i].normal)), wanted->normal), 1e-6);
        }
        (in_shape ? in_shapes : in_cubes) += 1;
      }
    }
  }
  EXPECT_GT(in_shapes, 100);
  EXPECT_GT(in_cubes, 20);
  EXPECT_GT(blocked, 300);
}

TEST(ShapeQuery, DepthOfPixelFindsShape) {
  const OneVoxel world(&ShapeTypes::slab);
  const SceneTracer tracer(world.scene);
  const Camera camera = *look_at({0.5, 3.0, 4.0}, {0.5, 0.5, 0.5}, 0.7);
  const ImagePoint middle{8.0, 8.0, 16, 16};
  const auto hit = pick(tracer, camera, middle);
  ASSERT_TRUE(hit);
  const auto again = voxel_at_depth(tracer, camera, middle, static_cast<float>(hit->t));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->voxel, hit->voxel);
  EXPECT_EQ(again->face, hit->face);
  EXPECT_NEAR(again->t, hit->t, 1e-5);
}

}  // namespace
}  // namespace quoin

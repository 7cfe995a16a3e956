// Groups and layers: visibility, reported changes, and the effect of moving and removing groups on their contents.

#include <quoin/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace quoin {
namespace {

constexpr unsigned kHierarchySeed = 18;

GroupHandle group_below(Scene& scene, GroupHandle parent, const char* name = "") {
  return scene.add_group({.name = name, .parent = parent});
}

InstanceHandle instance_below(Scene& scene, GridHandle grid, GroupHandle group) {
  return scene.add_instance({.name = "", .grid = grid, .group = group});
}

GridHandle add_voxel(Scene& scene) {
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, 1);
  return scene.add_grid(std::move(grid));
}

TEST(Hierarchy, ShowsInstanceIfAllAncestorsAreShown) {
  Scene scene;
  const GridHandle grid = add_voxel(scene);
  const LayerHandle layer = scene.add_layer({"houses"});
  const GroupHandle street = group_below(scene, {});
  const GroupHandle house = group_below(scene, street);
  const InstanceHandle door = instance_below(scene, grid, house);
  const auto shown = [&] { return is_shown(scene, scene.instances()[door]); };
  EXPECT_TRUE(shown());
  scene.edit(street).visible = false;
  EXPECT_FALSE(shown());
  EXPECT_TRUE(scene.bounds().empty());
  EXPECT_FALSE(scene.bounds(InstanceFilter::All).empty());
  scene.edit(street).visible = true;
  scene.edit(street).layer = layer;
  EXPECT_TRUE(shown());
  scene.edit(layer).visible = false;
  EXPECT_FALSE(shown());
  EXPECT_FALSE(is_shown(scene, scene.groups()[house]));
  scene.remove_layer(layer);
  EXPECT_TRUE(shown());
  scene.edit(door).visible = false;
  EXPECT_FALSE(shown());
}

TEST(Hierarchy, SavesInstanceIfGridAndAncestorsAreSaved) {
  Scene scene;
  const GridHandle grid = add_voxel(scene);
  const GroupHandle street = group_below(scene, {});
  const GroupHandle house = group_below(scene, street);
  const InstanceHandle door = instance_below(scene, grid, house);
  const InstanceHandle tree = instance_below(scene, grid, {});
  const auto saved = [&](InstanceHandle handle) { return is_saved(scene, scene.instances()[handle]); };
  ChangeCursor cursor = scene.cursor();
  const auto expect_changed = [&](bool door_saved, bool tree_saved) {
    EXPECT_EQ(saved(door), door_saved);
    EXPECT_EQ(saved(tree), tree_saved);
    EXPECT_FALSE(scene.changes_since(cursor).empty());
    const Scene copy = scene.snapshot();
    EXPECT_EQ(is_saved(copy, copy.instances()[door]), door_saved);
    EXPECT_EQ(is_saved(copy, copy.instances()[tree]), tree_saved);
  };
  EXPECT_TRUE(saved(door) && saved(tree));
  scene.edit(street).saved = false;
  expect_changed(false, true);
  EXPECT_FALSE(is_saved(scene, scene.groups()[house]));
  scene.edit(street).saved = true;
  scene.edit(house).saved = false;
  expect_changed(false, true);
  EXPECT_TRUE(is_saved(scene, scene.groups()[street]));
  scene.edit(house).saved = true;
  scene.edit(grid).saved = false;
  expect_changed(false, false);
  EXPECT_TRUE(is_saved(scene, scene.groups()[house]));
  scene.edit(grid).saved = true;
  scene.edit(tree).saved = false;
  expect_changed(true, false);
  scene.edit(door).grid = {};  // a missing grid is another error
  expect_changed(true, false);
}

TEST(Hierarchy, ShowsAll) {
  Scene scene;
  const LayerHandle layer = scene.add_layer({"houses", false});
  const GroupHandle street = scene.add_group({.name = "street", .layer = layer, .visible = false});
  const InstanceHandle door = instance_below(scene, add_voxel(scene), street);
  scene.edit(door).visible = false;
  ChangeCursor before = scene.cursor();
  show_all(scene);
  EXPECT_TRUE(is_shown(scene, scene.instances()[door]));
  EXPECT_TRUE(is_shown(scene, scene.groups()[street]));
  EXPECT_TRUE(scene.layers()[layer].visible);
  EXPECT_EQ(scene.changes_since(before).instances, std::vector<InstanceHandle>{door});
}

TEST(Hierarchy, TreatsCyclicGroupsAsTopLevel) {
  Scene scene;
  const GridHandle grid = add_voxel(scene);
  const GroupHandle a = group_below(scene, {});
  const GroupHandle b = group_below(scene, a);
  const GroupHandle below = group_below(scene, b);
  scene.edit(a).parent = b;
  const InstanceHandle instance = instance_below(scene, grid, below);
  EXPECT_EQ(parent_of(scene, a), GroupHandle{});
  EXPECT_EQ(parent_of(scene, b), GroupHandle{});
  EXPECT_EQ(parent_of(scene, below), b);
  EXPECT_EQ(groups_from_top(scene), (std::vector{a, b, below}));
  EXPECT_TRUE(is_shown(scene, scene.instances()[instance]));
  scene.edit(a).visible = false;
  EXPECT_TRUE(is_shown(scene, scene.instances()[instance])) << "b stands at the top, and is not below a";
  scene.edit(b).visible = false;
  EXPECT_FALSE(is_shown(scene, scene.instances()[instance]));
  scene.edit(a).saved = false;
  EXPECT_TRUE(is_saved(scene, scene.instances()[instance]));
  EXPECT_TRUE(is_saved(scene, scene.groups()[b]) && is_saved(scene, scene.groups()[below]));
  scene.edit(b).saved = false;
  EXPECT_FALSE(is_saved(scene, scene.instances()[instance]));
  EXPECT_FALSE(is_saved(scene, scene.groups()[below]));
  scene.edit(below).parent = below;
  EXPECT_EQ(parent_of(scene, below), GroupHandle{});
}

TEST(Hierarchy, SortsDeepGroupChains) {
  Scene scene;
  std::vector<GroupHandle> chain;
  for (int i = 0; i < 4'000; ++i) {
    SceneGroup group;
    if (!chain.empty()) group.parent = chain.back();
    chain.push_back(scene.add_group(group));
  }
  const auto sorted = groups_from_top(scene);
  EXPECT_EQ(sorted, chain);
  // With a circle at the top, its three groups stay, and the others follow below the third.
  scene.edit(chain[0]).parent = chain[2];
  const auto around = groups_from_top(scene);
  ASSERT_EQ(around.size(), chain.size());
  EXPECT_EQ(parent_of(scene, chain[3]), chain[2]);
  EXPECT_EQ(std::vector(around.begin(), around.begin() + 3), std::vector(chain.begin(), chain.begin() + 3));
  EXPECT_EQ(std::vector(around.begin() + 3, around.end()), std::vector(chain.begin() + 3, chain.end()));
}

TEST(Hierarchy, MovesChildrenOfRemovedGroupToParent) {
  Scene scene;
  const GridHandle grid = add_voxel(scene);
  const GroupHandle top = group_below(scene, {});
  const GroupHandle middle = group_below(scene, top);
  const GroupHandle low = group_below(scene, middle);
  const InstanceHandle instance = instance_below(scene, grid, middle);
  ChangeCursor cursor = scene.cursor();
  EXPECT_TRUE(scene.remove_group(middle));
  EXPECT_FALSE(scene.remove_group(middle));
  EXPECT_EQ(scene.groups()[low].parent, top);
  EXPECT_EQ(scene.instances()[instance].group, top);
  const SceneChanges changes = scene.changes_since(cursor);
  EXPECT_EQ(changes.groups, (std::vector{middle, low}));
  EXPECT_EQ(changes.instances, std::vector{instance});
}

TEST(Hierarchy, MovesDescendantsWithGroup) {
  Scene scene;
  const GridHandle grid = add_voxel(scene);
  const GroupHandle ship = group_below(scene, {});
  const GroupHandle turret = group_below(scene, ship);
  const InstanceHandle gun = instance_below(scene, grid, turret);
  const InstanceHandle shore = instance_below(scene, grid, {});
  scene.edit(ship).position = {10, 0, 0};
  scene.edit(turret).position = {12, 0, 0};
  scene.edit(gun).position = {13, 1, 0};
  const double half = std::sqrt(0.5);
  move_group(scene, ship, {0, 5, 0}, {half, 0, half, 0});  // a quarter turn about +Y: +X becomes -Z
  EXPECT_LT(glm::length(scene.instances()[gun].position - DVec3(0, 6, -3)), 1e-12);
  EXPECT_LT(glm::length(scene.groups()[turret].position - DVec3(0, 5, -2)), 1e-12);
  EXPECT_EQ(scene.groups()[ship].position, DVec3(0, 5, 0));
  EXPECT_EQ(scene.instances()[shore].position, DVec3(0));
  const DVec3 corner = world_from_grid_direction(scene.instances()[gun], {1, 0, 0});
  EXPECT_LT(glm::length(corner - DVec3(0, 0, -1)), 1e-12);
}

/// The simple slow version for hierarchies without circles.
bool slowly_shown(const Scene& scene, const Instance& instance) {
  const auto layer_shows = [&](LayerHandle handle) {
    const SceneLayer* layer = scene.layers().find(handle);
    return layer == nullptr || layer->visible;
  };
  bool shown = instance.visible && layer_shows(instance.layer);
  for (auto* group = scene.groups().find(instance.group); group != nullptr; group = scene.groups().find(group->parent))
    shown = shown && group->visible && layer_shows(group->layer);
  return shown;
}

// A renderer that redraws only changes must read every instance that appears or disappears.
TEST(Hierarchy, ReportsInstancesThatAppearOrDisappear) {
  std::mt19937 random(kHierarchySeed);
  Scene scene;
  const GridHandle grid = add_voxel(scene);
  std::vector<GroupHandle> groups{GroupHandle{}};
  std::vector<LayerHandle> layers{LayerHandle{}};
  std::vector<InstanceHandle> instances;
  const auto any = [&](const auto& of) { return of[random() % of.size()]; };
  layers.reserve(5);
  groups.reserve(13);
  for (int i = 0; i < 4; ++i) layers.push_back(scene.add_layer({"layer", random() % 4 != 0}));
  for (int i = 0; i < 12; ++i)
    groups.push_back(scene.add_group({.name = "", .parent = any(groups), .layer = any(layers)}));
  for (int i = 0; i < 60; ++i) {
    instances.push_back(scene.add_instance({.name = "", .grid = grid, .group = any(groups), .layer = any(layers)}));
  }
  ChangeCursor cursor = scene.cursor();
  for (int round = 0; round < 800; ++round) {
    std::vector<bool> before;
    before.reserve(instances.size());
    for (const InstanceHandle each : instances) before.push_back(slowly_shown(scene, scene.instances()[each]));
    const GroupHandle group = groups[1 + random() % (groups.size() - 1)];
    const LayerHandle layer = layers[1 + random() % (layers.size() - 1)];
    switch (random() % 5) {
      case 0:
        if (scene.groups().find(group) != nullptr) scene.edit(group).visible = random() % 3 != 0;
        break;
      case 1:
        if (scene.layers().find(layer) != nullptr) scene.edit(layer).visible = random() % 3 != 0;
        break;
      case 2:
        // Only below an earlier one: avoids cycles.
        if (scene.groups().find(group) != nullptr) {
          const GroupHandle parent = any(groups);
          if (parent.index < group.index || parent == GroupHandle{}) scene.edit(group).parent = parent;
        }
        break;
      case 3:
        if (random() % 20 == 0) scene.remove_group(group);
        if (random() % 60 == 0) scene.remove_layer(layer);
        break;
      default:
        scene.edit(any(instances)).group = any(groups);
    }
    const SceneChanges changes =
        random() % 2 == 0 ? scene.changes_since(cursor) : scene.snapshot().changes_since(cursor);
    ASSERT_FALSE(changes.all);
    const std::set<InstanceHandle> reported(changes.instances.begin(), changes.instances.end());
    for (std::size_t i = 0; i < instances.size(); ++i) {
      const bool now = slowly_shown(scene, scene.instances()[instances[i]]);
      ASSERT_EQ(is_shown(scene, scene.instances()[instances[i]]), now)
          << "seed " << kHierarchySeed << " round " << round;
      ASSERT_TRUE(now == before[i] || reported.contains(instances[i]))
          << "seed " << kHierarchySeed << " round " << round;
    }
  }
}

}  // namespace
}  // namespace quoin

#include "scene_tree.h"

#include <gtest/gtest.h>

#include "viewer/viewer_fixture.h"

namespace quoin::viewer {
namespace {

// A hidden layer without a name leaves an empty image, so the panel must list it as the reason.
TEST(SceneTree, CountsHiddenLayersAndInstances) {
  LoadedScene loaded = small_scene();
  Scene& scene = loaded.scene;
  SceneTree tree;
  tree.update(scene);
  EXPECT_EQ(tree.hidden().layers, 0U);
  EXPECT_EQ(tree.hidden().instances, 0U);
  const LayerHandle layer = scene.add_layer({"", false});
  tree.update(scene);
  EXPECT_EQ(tree.hidden().layers, 1U);
  EXPECT_EQ(tree.hidden().instances, 0U) << "nothing is on it";
  for (const InstanceHandle handle : scene.instances().handles()) scene.edit(handle).layer = layer;
  tree.update(scene);
  EXPECT_EQ(tree.hidden().instances, scene.instances().size());
  scene.edit(layer).visible = true;
  tree.update(scene);
  EXPECT_EQ(tree.hidden().layers, 0U);
  EXPECT_EQ(tree.hidden().instances, 0U);
}

TEST(SceneTree, NestsGroupsAndInstancesUnderParents) {
  LoadedScene loaded = small_scene();
  Scene& scene = loaded.scene;
  const GroupHandle outer = scene.add_group({});
  SceneGroup inside;
  inside.parent = outer;
  const GroupHandle inner = scene.add_group(inside);
  const InstanceHandle moved = scene.instances().handles().front();
  scene.edit(moved).group = inner;
  SceneTree tree;
  tree.update(scene);
  ASSERT_NE(tree.find(outer), nullptr);
  EXPECT_EQ(tree.find(outer)->groups, std::vector<GroupHandle>{inner});
  ASSERT_NE(tree.find(inner), nullptr);
  EXPECT_EQ(tree.find(inner)->instances, std::vector<InstanceHandle>{moved});
  ASSERT_NE(tree.find({}), nullptr);
  EXPECT_EQ(tree.find({})->groups, std::vector<GroupHandle>{outer});
  EXPECT_EQ(tree.find({})->instances.size(), scene.instances().size() - 1);
}

}  // namespace
}  // namespace quoin::viewer

// A file that is read, edited and written again contains the edit and no other change.

#include <quoin/io/vox.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/vox/vox_for_tests.h"
#include "io/vox/vox_reader.h"
#include "io/vox/write/vox_parts.h"

namespace quoin {
namespace {

using vox_test::Entries;
using vox_test::FileBuilder;
using vox_test::FileVoxel;

LoadedScene load(const std::vector<std::byte>& bytes, int frame = 0) {
  auto loaded = read_vox(bytes, {.frame = frame});
  EXPECT_TRUE(loaded) << to_string(loaded.error());
  return loaded ? std::move(*loaded) : LoadedScene{};
}

std::vector<std::byte> save(const LoadedScene& loaded, std::vector<std::string>* warnings = nullptr) {
  const auto written = write_vox(loaded);
  EXPECT_TRUE(written) << to_string(written.error());
  if (!written) return {};
  if (warnings != nullptr) *warnings = written->warnings;
  return written->bytes;
}

struct FileChunk {
  std::string id;
  std::vector<std::byte> bytes;
  bool operator==(const FileChunk&) const = default;
};

std::vector<FileChunk> chunks_of(const std::vector<std::byte>& file) {
  const auto document = vox::parse_document(file);
  EXPECT_TRUE(document) << to_string(document.error());
  std::vector<FileChunk> chunks;
  if (!document) return chunks;
  for (const vox::ChunkSpan& place : document->chunks) {
    const auto begin = file.begin() + static_cast<std::ptrdiff_t>(place.begin);
    const auto size = static_cast<std::ptrdiff_t>(vox::kChunkHeaderBytes + place.content_bytes + place.children_bytes);
    FileChunk chunk{{}, {begin, begin + size}};
    for (int i = 0; i < 4; ++i) chunk.id += static_cast<char>(chunk.bytes[static_cast<std::size_t>(i)]);
    chunks.push_back(std::move(chunk));
  }
  return chunks;
}

/// Returns the names of chunks that differ between both files: "+" is new, "-" is removed, "~" is changed.
std::string changed_chunks(const std::vector<std::byte>& before, const std::vector<std::byte>& after) {
  const auto a = chunks_of(before);
  const auto b = chunks_of(after);
  std::string changed;
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() || j < b.size()) {
    if (i < a.size() && j < b.size() && a[i].id == b[j].id) {
      if (!(a[i] == b[j])) changed += " ~" + a[i].id;
      ++i, ++j;
    } else if (j < b.size() && (i == a.size() || a.size() - i < b.size() - j)) {
      changed += " +" + b[j++].id;
    } else {
      changed += " -" + a[i++].id;
    }
  }
  return changed;
}

/// Lists the visible and named content: every instance's path in the graph, and each of its voxels in the world.
std::multiset<std::string> said_by(const Scene& scene) {
  std::multiset<std::string> said;
  const auto layer_text = [&](LayerHandle handle) {
    const SceneLayer* layer = scene.layers().find(handle);
    if (layer == nullptr || (layer->name.empty() && layer->visible)) return std::string();
    return " on " + layer->name + (layer->visible ? "" : "(hidden)");
  };
  const auto group_text = [&](GroupHandle from) {
    std::string way;
    for (; scene.groups().find(from) != nullptr; from = parent_of(scene, from)) {
      const SceneGroup& group = scene.groups()[from];
      way.insert(0, "/" + group.name + (group.visible ? "" : "(hidden)") + layer_text(group.layer));
    }
    return way;
  };
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    std::set<std::string> voxels;
    visit_voxels(grid.grid, [&](IVec3 voxel, VoxelType type) {
      const DVec3 at = world_from_grid(instance, grid, DVec3(voxel) + 0.5);
      const VoxelProperties& look = scene.types[type];
      std::string text;
      for (int axis = 0; axis < 3; ++axis) text += std::to_string(std::llround(2.0 * at[axis])) + " ";
      text += std::to_string(look.colour.r) + "," + std::to_string(look.colour.g) + "," + std::to_string(look.colour.b);
      text += "," + std::to_string(look.emission) + "," + std::to_string(look.roughness);
      voxels.insert(text);
    });
    std::string text = group_text(instance.group) + "/" + instance.name + (instance.visible ? "" : "(hidden)") +
                       layer_text(instance.layer) + " = " + grid.name;
    std::size_t hash = 0;
    for (const std::string& voxel : voxels) hash = hash * 31 + std::hash<std::string>()(voxel);
    said.insert(text + ": " + std::to_string(voxels.size()) + " voxels " + std::to_string(hash));
  }
  for (const GroupHandle handle : scene.groups().handles()) said.insert("group " + group_text(handle));
  return said;
}

std::string text_of(const std::multiset<std::string>& said) {
  std::string text;
  for (const std::string& line : said) text += line + "\n";
  return text;
}

/// Clears grid names: a file that cannot hold them names grids after their instances, which other tests cover.
void drop_grid_names(Scene& scene) {
  for (const GridHandle handle : scene.grids().handles()) scene.edit(handle).name.clear();
}

const std::vector<std::byte> kSecret = {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{0xFF}, std::byte{7}};

/// Returns a house as a MagicaVoxel file: layers, groups, animation, a camera, notes, and unknown chunks.
std::vector<std::byte> house() {
  FileBuilder file;
  file.chunk("PACK", std::array{std::byte{4}, std::byte{0}, std::byte{0}, std::byte{0}});
  file.model(4, 5, 6, {{0, 0, 0, 1}, {3, 4, 5, 2}, {1, 1, 1, 3}, {9, 9, 9, 4}, {2, 2, 2, 0}});
  file.model(2, 2, 2, {{0, 0, 0, 5}, {1, 1, 1, 5}});
  file.chunk("xxxx", kSecret);
  file.model(3, 3, 3, {{2, 0, 1, 6}});
  file.model(1, 1, 1, {{0, 0, 0, 7}});
  file.transform(0, 1, {{}}, {}, -1).group(1, {2, 6, 20});
  file.transform(2, 3, {{{"_t", "10 20 30"}}}, {{"_name", "walls"}, {"_colour", "x"}}, 1).shape(3, 0);
  file.transform(6, 7, {{{"_t", "5 0 0"}, {"_r", "17"}}}, {{"_name", "garden"}}, 2).group(7, {8, 10, 12});
  file.transform(8, 9, {{{"_t", "1 2 3"}}}, {{"_name", "tree"}}, 0).shape(9, 1);
  file.transform(10, 11, {{{"_t", "0 0 0"}, {"_f", "0"}}, {{"_t", "30 0 0"}, {"_f", "10"}}}, {{"_name", "bird"}}, 0);
  file.shape(11, {{1, {{"_f", "0"}}}, {2, {{"_f", "5"}}}}, {{"_loop", "1"}});
  file.transform(12, 13, {{{"_t", "7 7 7"}}}, {}, 0).transform(13, 14, {{{"_r", "40"}}}, {{"_name", "bench"}}, 0);
  file.shape(14, 2);
  file.transform(20, 21, {{}}, {{"_name", "hut"}, {"_hidden", "1"}}, 3).shape(21, 0);
  file.layer(0, {{"_name", "first"}}).layer(1, {{"_name", "walls"}, {"_color", "255 0 0"}}).layer(2, {});
  file.layer(3, {{"_hidden", "1"}});
  for (int i = 0; i < 10; ++i) {
    file.with("rCAM", [&](auto& out) {
      out.i32(i);
      out.dict({{"_mode", "pers"}});
    });
  }
  file.with("RGBA", [](auto& out) {
    for (int i = 0; i < 256; ++i) out.u32(static_cast<std::uint32_t>(i | (255 - i) << 8 | 7 << 16));
  });
  file.material(5, {{"_type", "_glass"}, {"_unknown", "kept"}, {"_alpha", "0.5"}}).material(6, {{"_type", "_emit"}});
  file.chunk("rOBJ", kSecret).chunk("NOTE", kSecret).chunk("QQQQ", kSecret);
  file.with("META", [](auto& out) { out.dict({{"_anim_range", "0 24"}}); });
  return file.file(200);
}

TEST(VoxRevision, WritesTheSameFileWithoutEdits) {
  const auto bytes = house();
  for (const int frame : {0, 3, 5, 12}) EXPECT_EQ(save(load(bytes, frame)), bytes) << frame;
}

TEST(VoxRevision, PaintedVoxelChangesOneByte) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes);
  Grid& grid = loaded.scene.edit(loaded.scene.grids().handles()[0]).grid;
  grid.set({1, 1, 3}, 9);  // (1, 1, 1) of the file
  const auto saved = save(loaded);
  EXPECT_EQ(changed_chunks(bytes, saved), " ~XYZI");
  int different = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) different += bytes[i] != saved[i] ? 1 : 0;
  EXPECT_EQ(different, 1) << "voxels that cannot be seen stay, and so does the order";
}

TEST(VoxRevision, IgnoresUndoneEdits) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes);
  const GridHandle grid = loaded.scene.grids().handles()[0];
  loaded.scene.edit(grid).grid.set({0, 0, 0}, 9);
  loaded.scene.edit(grid).grid.set({0, 0, 0}, kAir);
  EXPECT_EQ(save(loaded), bytes);
}

TEST(VoxRevision, NamesAndVisibilityChangeOnlyTheirChunks) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes);
  Scene& scene = loaded.scene;
  for (const InstanceHandle handle : scene.instances().handles()) {
    if (scene.instances()[handle].name == "bird") scene.edit(handle).name = "owl";
    if (scene.instances()[handle].name == "hut") scene.edit(handle).visible = true;
  }
  const auto saved = save(loaded);
  EXPECT_EQ(changed_chunks(bytes, saved), " ~nTRN ~nTRN");
  EXPECT_EQ(text_of(said_by(load(saved).scene)), text_of(said_by(scene)));
  scene.edit(scene.layers().handles()[3]).visible = true;
  scene.edit(scene.layers().handles()[1]).name = "outside";
  EXPECT_EQ(changed_chunks(saved, save(loaded)), " ~LAYR ~LAYR");
}

TEST(VoxRevision, EditingOneFrameKeepsAnimation) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes, 7);  // the bird shows model 2
  const GridHandle bird = loaded.scene.grids().handles()[2];
  loaded.scene.edit(bird).grid.set({0, 0, 0}, 8);
  const auto saved = save(loaded);
  EXPECT_EQ(changed_chunks(bytes, saved), " ~XYZI");
  EXPECT_EQ(text_of(said_by(load(saved, 0).scene)).find("bench"), text_of(said_by(load(bytes, 0).scene)).find("bench"));
  EXPECT_EQ(text_of(said_by(load(saved, 7).scene)), text_of(said_by(loaded.scene)));
}

TEST(VoxRevision, MovingAnimatedNodeSetsKeyFrame) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes, 5);
  Scene& scene = loaded.scene;
  for (const InstanceHandle handle : scene.instances().handles()) {
    if (scene.instances()[handle].name == "bird") scene.edit(handle).position.y += 9;
  }
  const auto saved = save(loaded);
  EXPECT_EQ(changed_chunks(bytes, saved), " ~nTRN");
  EXPECT_EQ(text_of(said_by(load(saved, 5).scene)), text_of(said_by(scene)));
  for (const int frame : {0, 10, 20}) {
    EXPECT_EQ(text_of(said_by(load(saved, frame).scene)), text_of(said_by(load(bytes, frame).scene))) << frame;
  }
}

TEST(VoxRevision, MovedGroupChangesOneTransform) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes);
  const GroupHandle garden = loaded.scene.groups().handles()[0];
  const SceneGroup before = loaded.scene.groups()[garden];
  move_group(loaded.scene, garden, before.position + DVec3(3, 4, 5), {std::sqrt(0.5), 0, std::sqrt(0.5), 0});
  const auto saved = save(loaded);
  EXPECT_EQ(changed_chunks(bytes, saved), " ~nTRN");
  EXPECT_EQ(text_of(said_by(load(saved).scene)), text_of(said_by(loaded.scene)));
}

TEST(VoxRevision, KeepsGrownModelInPlaceInEveryFrame) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes);
  // The tree and the bird share model 1, and the bird moves.
  loaded.scene.edit(loaded.scene.grids().handles()[1]).grid.set({5, -3, 1}, 4);
  const auto saved = save(loaded);
  EXPECT_EQ(changed_chunks(bytes, saved), " ~SIZE ~XYZI");
  EXPECT_EQ(text_of(said_by(load(saved).scene)), text_of(said_by(loaded.scene)));
  EXPECT_EQ(text_of(said_by(load(saved, 5).scene)).find("bird"), text_of(said_by(load(bytes, 5).scene)).find("bird"));
}

TEST(VoxRevision, SplitsModelBeyond256AndKeepsOtherFrames) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes);
  loaded.scene.edit(loaded.scene.grids().handles()[1]).grid.set({400, 0, 0}, 4);
  const auto saved = save(loaded);
  const LoadedScene again = load(saved);
  EXPECT_GT(again.scene.instances().size(), loaded.scene.instances().size());
  std::set<std::string> voxels[2];
  for (int i = 0; i < 2; ++i) {
    const Scene& scene = i == 0 ? loaded.scene : again.scene;
    for (const InstanceHandle handle : scene.instances().handles()) {
      const Instance& instance = scene.instances()[handle];
      const SceneGrid& grid = scene.grids()[instance.grid];
      visit_voxels(grid.grid, [&](IVec3 voxel, VoxelType type) {
        const DVec3 at = world_from_grid(instance, grid, DVec3(voxel) + 0.5);
        voxels[i].insert(std::to_string(at.x) + " " + std::to_string(at.y) + " " + std::to_string(at.z) + " " +
                         std::to_string(type));
      });
    }
  }
  EXPECT_EQ(voxels[0], voxels[1]);
  const LoadedScene later = load(saved, 5);
  bool has_bird = false;
  for (const InstanceHandle handle : later.scene.instances().handles()) {
    const Instance& instance = later.scene.instances()[handle];
    has_bird = has_bird || later.scene.grids()[instance.grid].canvas.max == IVec3(3, 3, 3);
  }
  EXPECT_TRUE(has_bird) << "the model of frame 5 is shown there";
}

TEST(VoxRevision, NewColoursReplaceUnusedEntries) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes);
  VoxelProperties gold;
  gold.colour = {250, 200, 30, 255};
  gold.emission = 2.0F;
  const auto type = loaded.scene.types.add(gold);
  ASSERT_TRUE(type);
  ASSERT_EQ(*type, 256);
  loaded.scene.edit(loaded.scene.grids().handles()[3]).grid.set({0, 0, 0}, *type);
  std::vector<std::string> warnings;
  const auto saved = save(loaded, &warnings);
  EXPECT_EQ(changed_chunks(bytes, saved), " ~XYZI ~RGBA +MATL");
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0], "unused palette colours replaced by new ones: 1");
  const LoadedScene again = load(saved);
  const VoxelType read = again.scene.grids()[again.scene.grids().handles()[3]].grid.get({0, 0, 0});
  EXPECT_EQ(again.scene.types[read].colour, gold.colour);
  EXPECT_EQ(again.scene.types[read].emission, 2.0F);
  // A palette with duplicate colours loses a duplicate, without any loss of content.
  FileBuilder twice;
  twice.model(1, 1, 1, {{0, 0, 0, 1}});
  twice.with("RGBA", [](auto& out) {
    for (int i = 0; i < 256; ++i) out.u32(static_cast<std::uint32_t>(std::max(i, 2) | 7 << 16));
  });
  const auto twice_bytes = twice.file();
  LoadedScene with_room = load(twice_bytes);
  ASSERT_TRUE(with_room.scene.types.add(gold));
  with_room.scene.edit(with_room.scene.grids().handles()[0]).grid.set({0, 0, 0}, 256);
  warnings.clear();
  EXPECT_EQ(changed_chunks(twice_bytes, save(with_room, &warnings)), " ~XYZI ~RGBA +MATL");
  EXPECT_TRUE(warnings.empty());
  // A type with the look of a palette colour uses that colour.
  VoxelProperties known = loaded.scene.types[3];
  known.name = "mine";
  loaded = load(bytes);
  loaded.scene.edit(loaded.scene.grids().handles()[3]).grid.set({0, 0, 0}, *loaded.scene.types.add(known));
  EXPECT_EQ(changed_chunks(bytes, save(loaded)), " ~XYZI");
}

TEST(VoxRevision, ChangedMaterialKeepsUnknownKeys) {
  const auto bytes = house();
  LoadedScene loaded = load(bytes);
  VoxelProperties glass = loaded.scene.types[5];
  glass.colour.a = 40;
  loaded.scene.types.replace(5, glass);
  const auto saved = save(loaded);
  EXPECT_EQ(changed_chunks(bytes, saved), " ~MATL");
  const LoadedScene again = load(saved);
  EXPECT_EQ(again.scene.types[5].colour.a, 40);
  EXPECT_EQ(again.scene.types[5].attributes.at("_unknown"), "kept");
}

TEST(VoxRevision, KeepsFramesWithoutSceneGraph) {
  FileBuilder file;
  file.model(3, 3, 5, {{0, 0, 0, 1}}).model(3, 3, 3, {{1, 0, 0, 2}}).model(1, 1, 1, {{0, 0, 0, 3}});
  const auto bytes = file.file();
  LoadedScene loaded = load(bytes, 1);
  EXPECT_EQ(save(loaded), bytes);
  loaded.scene.edit(loaded.scene.grids().handles()[0]).grid.set({2, 2, 2}, 9);
  EXPECT_EQ(changed_chunks(bytes, save(loaded)), " ~XYZI") << "no graph is needed for that";
  // A graph is needed once another instance is added.
  Instance other;
  other.name = "new";
  other.grid = loaded.scene.grids().handles()[2];
  other.position = {10, 0, 0};
  loaded.scene.add_instance(other);
  const auto saved = save(loaded);
  const auto shown = [](LoadedScene at_frame) {
    drop_grid_names(at_frame.scene);
    return text_of(said_by(at_frame.scene));
  };
  const std::string at_1 = shown(load(saved, 1));
  EXPECT_EQ(at_1, shown(std::move(loaded)));
  for (const int frame : {0, 2}) {
    // The frame's former model, and the new instance.
    LoadedScene before = load(bytes, frame);
    before.scene.edit(before.scene.grids().handles()[0]).grid.set({2, 2, 2}, 9);
    EXPECT_EQ(shown(load(saved, frame)), shown(std::move(before)) + at_1.substr(at_1.find("/new"))) << frame;
  }
}

/// Returns the position and type of each visible voxel.
std::set<std::string> voxels_of(const Scene& scene) {
  std::set<std::string> voxels;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    visit_voxels(grid.grid, [&](IVec3 voxel, VoxelType type) {
      const DVec3 at = world_from_grid(instance, grid, DVec3(voxel) + 0.5);
      voxels.insert(std::to_string(at.x) + " " + std::to_string(at.y) + " " + std::to_string(at.z) + " " +
                    std::to_string(type));
    });
  }
  return voxels;
}

std::vector<std::byte> three_frames() {
  FileBuilder file;
  file.with("PACK", [](auto& out) { out.u32(3); });
  file.model(4, 4, 4, {{0, 0, 0, 1}}).model(3, 5, 3, {{1, 0, 0, 2}}).model(1, 1, 1, {{0, 0, 0, 3}});
  return file.file();
}

TEST(VoxRevision, GrownFrameLeavesOthersInPlace) {
  const auto bytes = three_frames();
  for (const int edited : {0, 1}) {
    // Voxels beyond each side, beyond two sides at once, and too far away for any model.
    for (const IVec3 voxel : {IVec3(-1, 0, 0), IVec3(0, -2, 0), IVec3(0, 0, -1), IVec3(5, 0, 0), IVec3(0, 6, 9),
                              IVec3(300, 0, 0), IVec3(-400, 20, 300)}) {
      SCOPED_TRACE(std::to_string(edited) + " " + std::to_string(voxel.x));
      LoadedScene loaded = load(bytes, edited);
      loaded.scene.edit(loaded.scene.grids().handles()[static_cast<std::size_t>(edited)]).grid.set(voxel, 9);
      std::vector<std::string> warnings;
      const auto saved = save(loaded, &warnings);
      EXPECT_TRUE(warnings.empty()) << warnings.front();
      for (const int frame : {0, 1, 2}) {
        const auto before = frame == edited ? voxels_of(loaded.scene) : voxels_of(load(bytes, frame).scene);
        EXPECT_EQ(voxels_of(load(saved, frame).scene), before) << frame;
      }
      EXPECT_EQ(save(load(saved, 1)), saved);
    }
  }
}

TEST(VoxRevision, AllowsGrowthOfOtherFrames) {
  const auto bytes = three_frames();
  for (const IVec3 voxel : {IVec3(0, 0, 3), IVec3(1, 6, 0), IVec3(0, 280, 0)}) {
    SCOPED_TRACE(voxel.y);
    LoadedScene loaded = load(bytes, 0);
    const GridHandle other = loaded.scene.grids().handles()[1];
    loaded.scene.edit(other).grid.set(voxel, 9);
    loaded.scene.edit(loaded.scene.instances().handles()[0]).position.x += 7;
    const auto saved = save(loaded);
    EXPECT_EQ(voxels_of(load(saved, 0).scene), voxels_of(loaded.scene));
    // Each frame matches the same edits made at that frame.
    for (const int frame : {1, 2}) {
      LoadedScene at_frame = load(bytes, frame);
      if (frame == 1) at_frame.scene.edit(at_frame.scene.grids().handles()[1]).grid.set(voxel, 9);
      at_frame.scene.edit(at_frame.scene.instances().handles()[0]).position.x += 7;
      EXPECT_EQ(voxels_of(load(saved, frame).scene), voxels_of(at_frame.scene)) << frame;
    }
  }
}

TEST(VoxRevision, ReportsLostFrames) {
  LoadedScene loaded = load(three_frames(), 0);
  loaded.scene.remove_instance(loaded.scene.instances().handles()[0]);
  Instance other;
  other.grid = loaded.scene.grids().handles()[1];
  loaded.scene.add_instance(other);
  const auto losses = vox_unsupported_features(loaded).value();
  ASSERT_EQ(losses.size(), 1U);
  EXPECT_EQ(losses[0], "animation frames left out, since their model was removed: 3");
}

TEST(VoxRevision, ReportsUnchangedModelsBeyond256) {
  LoadedScene loaded = load(house());
  // Both the bird and the bench show model 2 later.
  for (const InstanceHandle handle : loaded.scene.instances().handles()) {
    if (loaded.scene.instances()[handle].name == "bench") loaded.scene.remove_instance(handle);
  }
  loaded.scene.edit(loaded.scene.grids().handles()[2]).grid.set({400, 0, 0}, 4);
  const auto losses = vox_unsupported_features(loaded).value();
  ASSERT_EQ(losses.size(), 1U);
  EXPECT_EQ(losses[0], "models of other frames left unchanged, since they exceed 256 voxels: 1");
}

TEST(VoxRevision, RewritesSharedNodesWithWarning) {
  FileBuilder file;
  file.model(2, 2, 2, {{0, 0, 0, 1}});
  file.transform(0, 1, {{}}).group(1, {2, 4});
  file.transform(2, 6, {{{"_t", "5 0 0"}}}).transform(4, 6, {{{"_t", "0 5 0"}}}).group(6, {8});
  file.transform(8, 9, {{}, {{"_t", "1 0 0"}}}, {{"_name", "shared"}}).shape(9, 0);
  const auto bytes = file.file();
  LoadedScene loaded = load(bytes);
  EXPECT_EQ(loaded.scene.instances().size(), 2U);
  loaded.scene.edit(loaded.scene.grids().handles()[0]).grid.set({1, 1, 1}, 2);
  EXPECT_EQ(changed_chunks(bytes, save(loaded)), " ~XYZI") << "voxels are no part of the graph";
  loaded.scene.edit(loaded.scene.instances().handles()[0]).position.y += 3;
  std::vector<std::string> warnings;
  const auto saved = save(loaded, &warnings);
  EXPECT_EQ(text_of(said_by(load(saved).scene)), text_of(said_by(loaded.scene)));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("animation is left out"), std::string::npos);
  EXPECT_EQ(vox_unsupported_features(loaded).value(), warnings) << "said before it is written";
}

TEST(VoxRevision, ReportsLostCategories) {
  FileBuilder file;
  file.model(2, 2, 2, {{0, 0, 0, 1}});
  LoadedScene loaded = load(file.file());
  EXPECT_TRUE(vox_unsupported_features(loaded).value().empty());
  loaded.scene.edit(loaded.scene.instances().handles()[0]).categories = 6;
  std::vector<std::string> warnings;
  (void)save(loaded, &warnings);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("categories of instances left out"), std::string::npos);
  EXPECT_EQ(vox_unsupported_features(loaded).value(), warnings);
}

/// Returns a walk of three frames whose topmost node follows the arguments, with unknown attributes on every node.
std::vector<std::byte> lone_walk(bool has_hidden_group) {
  FileBuilder file;
  file.model(2, 2, 2, {{0, 0, 0, 5}});
  file.model(1, 1, 1, {{0, 0, 0, 6}});
  if (has_hidden_group) {
    file.with("nGRP", [](auto& out) {
      out.i32(0);
      out.dict({{"_hidden", "1"}, {"_odd", "group"}});
      out.u32(1);
      out.i32(4);
    });
  }
  const std::int32_t walk = has_hidden_group ? 4 : 0;
  file.transform(walk, 7, {{{"_t", "0 0 1"}}, {{"_t", "5 0 1"}, {"_f", "2"}}}, {{"_odd", "walk"}}, -1);
  file.shape(7, {{0, {}}, {1, {{"_f", "1"}}}}, {{"_odd", "shape"}});
  file.transform(30, 31, {{}}, {{"_name", "apart"}}, -1).shape(31, 1);
  return file.file();
}

std::string text_in(const std::vector<std::byte>& file) {
  return {reinterpret_cast<const char*>(file.data()), file.size()};
}

TEST(VoxRevision, EditsFilesWithLoneRoot) {
  for (const bool has_hidden_group : {false, true}) {
    const auto file = lone_walk(has_hidden_group);
    for (const char* edit : {"add", "name", "show", "leave the group", "remove"}) {
      LoadedScene loaded = load(file, 2);
      Scene& scene = loaded.scene;
      const InstanceHandle walk = scene.instances().handles().front();
      const GroupHandle group = scene.groups().empty() ? GroupHandle{} : scene.groups().handles().front();
      const bool is_of_group = std::string_view(edit) == "show" || std::string_view(edit) == "leave the group";
      if (is_of_group && !has_hidden_group) continue;
      if (std::string_view(edit) == "add") {
        Instance second = scene.instances()[walk];
        second.group = {};
        second.position += DVec3(20, 0, 0);
        scene.add_instance(second);
      } else if (std::string_view(edit) == "name") {
        scene.edit(walk).name = "walker";
      } else if (std::string_view(edit) == "show") {
        scene.edit(group).visible = true;
      } else if (std::string_view(edit) == "leave the group") {
        scene.edit(walk).group = {};
      } else {
        scene.remove_instance(walk);
        scene.add_group({.name = "new"});
      }
      std::vector<std::string> warnings;
      const auto written = save(loaded, &warnings);
      EXPECT_TRUE(warnings.empty()) << edit << ": " << warnings.front();
      LoadedScene again = load(written, std::string_view(edit) == "remove" ? 0 : 2);
      drop_grid_names(again.scene);
      drop_grid_names(scene);
      EXPECT_EQ(text_of(said_by(again.scene)), text_of(said_by(scene))) << edit;
      const std::string text = text_in(written);
      EXPECT_EQ(text.find("walk") != std::string::npos, std::string_view(edit) != "remove") << edit;
      EXPECT_EQ(text.find("shape") != std::string::npos, std::string_view(edit) != "remove") << edit;
      EXPECT_NE(text.find("apart"), std::string::npos) << edit;
      EXPECT_EQ(text.find("group") != std::string::npos, has_hidden_group) << edit;
      if (std::string_view(edit) == "remove") continue;
      // The other frames are unchanged too.
      const Scene first = load(file, 0).scene;
      const Scene first_again = load(written, 0).scene;
      const auto place_of = [](const Scene& at) { return at.instances()[at.instances().handles().front()].position; };
      EXPECT_EQ(place_of(first_again), place_of(first)) << edit;
      EXPECT_EQ(first_again.voxel_count(), first.voxel_count()) << edit;
    }
  }
}

TEST(VoxRevision, KeepsBytesAfterVoxels) {
  FileBuilder file;
  file.size(2, 2, 2).with("XYZI", [](auto& out) {
    out.u32(1);
    out.raw(std::array{std::byte{1}, std::byte{1}, std::byte{1}, std::byte{9}});
    out.raw(kSecret);
  });
  LoadedScene loaded = load(file.file());
  loaded.scene.edit(loaded.scene.grids().handles().front()).grid.set({0, 0, 0}, VoxelType{3});
  const auto written = save(loaded);
  EXPECT_NE(std::ranges::search(written, kSecret).begin(), written.end());
}

TEST(VoxRevision, SavesHiddenModelsAsShownWhenTheyWereShown) {
  const auto bytes = house();
  const auto shown = read_vox(bytes, {.show_hidden = true});
  ASSERT_TRUE(shown);
  const LoadedScene again = load(save(*shown));
  for (const InstanceHandle handle : again.scene.instances().handles()) {
    EXPECT_TRUE(is_shown(again.scene, again.scene.instances()[handle]));
  }
}

TEST(VoxRevision, NamesContentThatScenesCannotHold) {
  const auto lines = source_only_features(*load(house()).source);
  const std::vector<std::string> expected = {
      "animation: frames 0 to 24", "cameras: 10", "chunks QQQQ: 1", "chunks xxxx: 1", "notes: 1", "render settings: 1"};
  EXPECT_EQ(lines, expected);
  const auto without = read_vox(house(), {.keep_source = false});
  ASSERT_TRUE(without);
  EXPECT_EQ(without->source, nullptr);
}

/// Applies random operations of every kind to a scene.
class History {
 public:
  History(std::uint32_t seed, LoadedScene& loaded) : random_(seed), scene_(loaded.scene) {}

  void step() {
    switch (pick(16)) {
      case 0:
      case 1:
      case 2:
        return edit_voxel();
      case 3:
        if (Instance* each = instance()) each->name = name();
        return;
      case 4:
        if (Instance* each = instance()) each->visible = pick(2) == 0;
        return;
      case 5:
        if (Instance* each = instance()) each->position += DVec3(pick(9) - 4, pick(9) - 4, pick(9) - 4);
        return;
      case 6:
        if (Instance* each = instance()) each->group = group();
        return;
      case 7:
        if (Instance* each = instance()) each->layer = layer();
        return;
      case 8:
        return add_instance();
      case 9:
        if (pick(3) == 0 && !scene_.instances().empty()) scene_.remove_instance(any(scene_.instances()));
        return;
      case 10:
        scene_.add_group({.name = name(), .parent = group(), .layer = layer(), .position = place()});
        return;
      case 11:
        return edit_group();
      case 12:
        return edit_layer();
      case 13:
        return edit_type();
      case 14:
        if (Instance* each = instance(); each != nullptr && !scene_.grids().empty()) each->grid = any(scene_.grids());
        return;
      default:
        return edit_grids();
    }
  }

 private:
  int pick(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  std::string name() { return pick(4) == 0 ? std::string() : "name " + std::to_string(pick(6)); }
  DVec3 place() { return {pick(100) - 50, pick(100) - 50, pick(100) - 50}; }
  template <class T>
  Handle<T> any(const SlotMap<T>& map) {
    return map.handles()[static_cast<std::size_t>(pick(static_cast<int>(map.size())))];
  }
  Instance* instance() { return scene_.instances().empty() ? nullptr : &scene_.edit(any(scene_.instances())); }
  GroupHandle group() { return scene_.groups().empty() || pick(3) == 0 ? GroupHandle{} : any(scene_.groups()); }
  LayerHandle layer() { return scene_.layers().empty() || pick(3) == 0 ? LayerHandle{} : any(scene_.layers()); }

  void edit_voxel() {
    if (scene_.grids().empty()) return;
    SceneGrid& grid = scene_.edit(any(scene_.grids()));
    const IVec3 size = grid.declared_box().empty() ? IVec3(4) : grid.declared_box().max;
    const int beyond = pick(6) == 0 ? 3 : 0;
    IVec3 at{0};
    for (int axis = 0; axis < 3; ++axis) at[axis] = pick(std::max(1, size[axis]) + 2 * beyond) - beyond;
    const auto types = static_cast<int>(scene_.types.size());
    grid.grid.set(at, static_cast<VoxelType>(pick(3) == 0 ? 0 : pick(12) == 0 ? pick(types) : 1 + pick(8)));
  }
  void add_instance() {
    if (scene_.grids().empty()) return;
    const InstanceHandle like = scene_.instances().empty() ? InstanceHandle{} : any(scene_.instances());
    Instance made;
    if (const Instance* found = scene_.instances().find(like)) made = *found;  // keeps its rotation
    made.name = name();
    made.grid = any(scene_.grids());
    made.position = place();
    made.group = group();
    made.layer = layer();
    scene_.add_instance(made);
  }
  void edit_group() {
    if (scene_.groups().empty()) return;
    const GroupHandle handle = any(scene_.groups());
    if (pick(8) == 0) {
      scene_.remove_group(handle);
      return;
    }
    if (pick(3) == 0) {
      move_group(scene_, handle, place(), scene_.groups()[handle].rotation);
      return;
    }
    SceneGroup& edited = scene_.edit(handle);
    if (pick(2) == 0) edited.name = name();
    if (pick(3) == 0) edited.visible = !edited.visible;
    if (pick(3) == 0) edited.layer = layer();
    if (pick(3) == 0) edited.position = place();
    if (pick(4) == 0) {
      const GroupHandle parent = group();
      scene_.edit(handle).parent = parent;
      // Circles move to the top, since a file has no other way to express them.
      for (GroupHandle each = parent; scene_.groups().find(each) != nullptr; each = scene_.groups()[each].parent) {
        if (each != handle) continue;
        scene_.edit(handle).parent = {};
        break;
      }
    }
  }
  void edit_layer() {
    if (scene_.layers().empty() || pick(4) == 0) {
      scene_.add_layer({"layer " + std::to_string(pick(5)), pick(3) != 0});
    } else if (pick(8) == 0) {
      scene_.remove_layer(any(scene_.layers()));
    } else {
      SceneLayer& edited = scene_.edit(any(scene_.layers()));
      edited.name = "layer " + std::to_string(pick(5));
      edited.visible = pick(2) == 0;
    }
  }
  void edit_type() {
    const auto channel = [&] { return static_cast<std::uint8_t>(pick(256)); };
    VoxelProperties look;
    look.colour = {channel(), channel(), channel(), 255};
    if (pick(2) == 0) look.emission = static_cast<float>(1 + pick(3));
    if (pick(2) == 0) {
      static_cast<void>(scene_.types.add(look));
    } else {
      scene_.types.replace(static_cast<VoxelType>(1 + pick(255)), look);
    }
  }
  void edit_grids() {
    if (pick(3) == 0 && !scene_.grids().empty()) {
      scene_.remove_grid(any(scene_.grids()));
    } else if (pick(2) == 0 && !scene_.grids().empty()) {
      scene_.edit(any(scene_.grids())).pivot += DVec3(pick(3), pick(3), pick(3));
    } else {
      SceneGrid made;
      for (int i = pick(5); i >= 0; --i) {
        made.grid.set({pick(9), pick(9), pick(9)}, static_cast<VoxelType>(1 + pick(9)));
      }
      scene_.add_grid(std::move(made));
    }
  }

  std::mt19937 random_;
  Scene& scene_;
};

TEST(VoxRevision, RoundTripsAnyEditHistory) {
  FileBuilder lone;
  lone.model(3, 3, 5, {{0, 0, 0, 1}}).model(3, 3, 3, {{1, 0, 0, 2}});
  FileBuilder shared;
  shared.model(2, 2, 2, {{0, 0, 0, 1}}).transform(0, 1, {{}}).group(1, {2, 4});
  shared.transform(2, 6, {{{"_t", "5 0 0"}}}).transform(4, 6, {{{"_t", "0 5 0"}}}).group(6, {8});
  shared.transform(8, 9, {{}, {{"_t", "1 0 0"}}}, {{"_name", "shared"}}).shape(9, 0);
  const std::vector<std::vector<std::byte>> files = {house(), lone.file(), shared.file(), FileBuilder().file()};
  for (std::uint32_t seed = 0; seed < 600; ++seed) {
    const std::size_t which = seed % 8 < 5 ? 0 : seed % 8 - 4;
    const int frame = which == 3 ? 0 : static_cast<int>(seed / 8 % 2) * (which == 0 ? 7 : 1);
    std::vector<std::byte> bytes = files[which];
    for (int round = 0; round < 3; ++round) {
      LoadedScene loaded = load(bytes, frame);
      History history(seed * 3 + static_cast<std::uint32_t>(round), loaded);
      for (unsigned steps = 1 + seed % 23; steps > 0; --steps) history.step();
      const auto written = write_vox(loaded);
      if (!written) {
        ASSERT_EQ(written.error().code, ErrorCode::LimitExceeded) << "seed " << seed << to_string(written.error());
        break;
      }
      // The last frame may be gone with its node.
      auto again = read_vox(written->bytes, {.frame = frame});
      if (!again && again.error().code == ErrorCode::InvalidArgument) break;
      ASSERT_TRUE(again) << "seed " << seed << ": " << to_string(again.error());
      ASSERT_EQ(save(*again), written->bytes) << "seed " << seed;
      drop_grid_names(loaded.scene);
      drop_grid_names(again->scene);
      ASSERT_EQ(text_of(said_by(again->scene)), text_of(said_by(loaded.scene)))
          << "seed " << seed << " round " << round;
      if (which == 0) {
        for (const FileChunk& chunk : chunks_of(files[0])) {
          const bool unknown = chunk.id == "rCAM" || chunk.id == "rOBJ" || chunk.id == "NOTE" || chunk.id == "QQQQ" ||
                               chunk.id == "xxxx" || chunk.id == "META";
          const auto all = chunks_of(written->bytes);
          ASSERT_TRUE(!unknown || std::ranges::find(all, chunk) != all.end()) << "seed " << seed << " " << chunk.id;
        }
      }
      bytes = written->bytes;
    }
  }
}

}  // namespace
}  // namespace quoin

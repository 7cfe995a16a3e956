#include "document.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <set>
#include <span>
#include <string_view>
#include <thread>

#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <gtest/gtest.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/scene_file.h>

#include "io/vox/vox_for_tests.h"
#include "loader.h"
#include "viewer_fixture.h"

namespace quoin::viewer {
namespace {

std::vector<std::byte> vox_bytes(const Scene& scene) {
  return write_vox(scene).value().bytes;
}

const Grid& only_grid(const Document& document) {
  return document.scene().grids()[document.scene().grids().handles().front()].grid;
}

SceneHit hit_at(const Document& document, IVec3 voxel, Direction face) {
  SceneHit hit;
  hit.instance = document.scene().instances().handles().front();
  hit.voxel = voxel;
  hit.face = face;
  hit.type = only_grid(document).get(voxel);
  return hit;
}

TEST(Brush, CoversExactShape) {
  for (const BrushShape shape : {BrushShape::Box, BrushShape::Sphere}) {
    for (const int radius : {0, 1, 3}) {
      Grid grid;
      const IVec3 centre{-2, 63, 7};
      const std::int64_t changed = apply({BrushAction::Place, shape, radius, 3}, centre, grid);
      std::int64_t expected = 0;
      for (int z = -radius; z <= radius; ++z) {
        for (int y = -radius; y <= radius; ++y) {
          for (int x = -radius; x <= radius; ++x) {
            const bool is_in = shape == BrushShape::Box || x * x + y * y + z * z <= (radius + 0.5) * (radius + 0.5);
            expected += is_in ? 1 : 0;
            EXPECT_EQ(grid.get(centre + IVec3{x, y, z}), is_in ? 3 : kAir);
          }
        }
      }
      EXPECT_EQ(changed, expected);
      EXPECT_EQ(grid.voxel_count(), expected);
    }
  }
}

TEST(Brush, ActionsTouchOnlyTheirTargets) {
  Grid grid;
  grid.set({0, 0, 0}, 1);
  EXPECT_EQ(apply({BrushAction::Paint, BrushShape::Box, 1, 2}, {0, 0, 0}, grid), 1);
  EXPECT_EQ(grid.get({0, 0, 0}), 2);
  EXPECT_EQ(grid.voxel_count(), 1) << "paint adds nothing";
  EXPECT_EQ(apply({BrushAction::Place, BrushShape::Box, 1, 3}, {0, 0, 0}, grid), 26);
  EXPECT_EQ(grid.get({0, 0, 0}), 2) << "placing replaces nothing";
  EXPECT_EQ(apply({BrushAction::Remove, BrushShape::Box, 1, 3}, {0, 0, 0}, grid), 27);
  EXPECT_EQ(grid.voxel_count(), 0);
}

TEST(Brush, DoesNothingAtTheCoordinateLimits) {
  Grid grid;
  const int most = std::numeric_limits<int>::max();
  EXPECT_EQ(apply({BrushAction::Place, BrushShape::Box, 9, 3}, {most, 0, 0}, grid), 0);
  EXPECT_EQ(apply({BrushAction::Place, BrushShape::Sphere, 9, 3}, {0, std::numeric_limits<int>::min(), 0}, grid), 0);
}

TEST(Brush, GridRayMatchesWorldRay) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::normal_distribution<double> number;
  for (int i = 0; i < 200; ++i) {
    SceneGrid grid;
    grid.pivot = {number(random) * 10, number(random) * 10, number(random) * 10};
    Instance instance;
    instance.position = {number(random) * 1e6, number(random) * 100, number(random)};
    instance.rotation = glm::normalize(DQuat{number(random), number(random), number(random), number(random)});
    instance.voxel_size = std::exp(number(random));
    instance.mirrored = (i & 1) != 0;
    const Ray world{{number(random), number(random), number(random)}, {number(random), number(random), number(random)}};
    const auto ray = ray_in_grid(instance, grid, world);
    ASSERT_TRUE(ray);
    for (const double t : {0.0, 1.0, 17.0}) {
      const DVec3 back = world_from_grid(instance, grid, ray->origin + t * ray->direction);
      EXPECT_LT(glm::length(back - (world.origin + t * world.direction)), 1e-6);
    }
  }
}

TEST(Document, SavesOnlySelfContainedSceneFilesInPlace) {
  const ScratchFolder folder("scene");
  std::vector<std::string> warnings;
  Document document = small_document();
  EXPECT_TRUE(can_write("hill.json"));
  ASSERT_TRUE(document.write(folder.file("hill.vox"), warnings));
  std::ofstream(folder.file("hills.json")) << R"({"quoin_scene": 1, "files": [{"id": "a", "path": "hill.vox"}],
      "instances": [{"file": "a", "rotation": {"axis": [1, 2, 3], "degrees": 40}, "scale": 0.3}]})";
  const auto hills = Document::open(folder.file("hills.json"));
  ASSERT_TRUE(hills);
  EXPECT_FALSE((*hills)->can_save_in_place()) << "models would be written into the scene file";
  EXPECT_FALSE((*hills)->write(folder.file("hills.vox"), warnings)) << "turned";
  const Brush brush{BrushAction::Place, BrushShape::Sphere, 2, 3};
  ASSERT_TRUE((*hills)->begin_stroke(brush, hit_at(**hills, {63, 3, 20}, Direction::PosY)));
  (*hills)->end_stroke();
  ASSERT_TRUE((*hills)->write(folder.file("whole.json"), warnings));
  (*hills)->note_written(folder.file("whole.json"), (*hills)->history().state());
  EXPECT_FALSE((*hills)->is_dirty());
  EXPECT_TRUE((*hills)->can_save_in_place());
  const auto again = Document::open(folder.file("whole.json"));
  ASSERT_TRUE(again);
  EXPECT_TRUE((*again)->can_save_in_place());
  EXPECT_EQ((*again)->faces(), (*hills)->faces());
  const auto first = [](const Document& d) { return d.scene().instances()[d.scene().instances().handles()[0]]; };
  EXPECT_EQ(first(**again).rotation, first(**hills).rotation);
  EXPECT_EQ(first(**again).position, first(**hills).position);
}

TEST(Document, ProposesFormatThatHoldsContent) {
  const auto proposed = [](const char* path, const char* format, bool has_field) {
    LoadedScene loaded;
    loaded.format = format;
    SceneGrid grid;
    if (has_field) grid.field.add_sphere({0, 0, 0}, 4.0, 1);
    loaded.scene.add_grid(std::move(grid));
    return Document(std::move(loaded), path).proposed_path().string();
  };
  EXPECT_EQ(proposed("a/castle.vox", "vox", false), "a/castle.vox");
  EXPECT_EQ(proposed("a/hills.json", "scene", true), "a/hills.json");
  EXPECT_EQ(proposed("a/scan.nii.gz", "nifti", true), "a/scan.json");
  EXPECT_EQ(proposed("a/scan.nrrd", "nrrd", true), "a/scan.json");
  EXPECT_EQ(proposed("a/SCAN.NII.GZ", "nifti", true), "a/SCAN.json");
  EXPECT_EQ(proposed("a/dug.vox", "vox", true), "a/dug.json");
  EXPECT_EQ(proposed("a/model.qb", "qubicle", false), "a/model.vox");
}

TEST(Document, FaceCountsFollowEdits) {
  Document document = small_document();
  const FaceCounts before = document.faces();
  EXPECT_EQ(before, count_faces(document.scene()));
  EXPECT_GT(before.visible, 0);
  const Brush brush{BrushAction::Place, BrushShape::Sphere, 2, 3};
  ASSERT_TRUE(document.begin_stroke(brush, hit_at(document, {63, 3, 20}, Direction::PosY)));
  document.end_stroke();
  EXPECT_GT(document.faces().total, before.total);
  EXPECT_EQ(document.faces(), count_faces(document.scene()));
  EXPECT_TRUE(document.type_of_colour({1, 2, 3, 255}));
  ASSERT_TRUE(document.undo());
  EXPECT_EQ(document.faces(), before);
}

TEST(Document, UndoAndRedoRestoreExactBytes) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  Document document = small_document();
  std::vector<std::vector<std::byte>> states{vox_bytes(document.scene())};
  const auto pick = [&random](int from, int to) { return std::uniform_int_distribution<int>(from, to)(random); };
  for (int edit = 0; edit < 30; ++edit) {
    const Brush brush{static_cast<BrushAction>(pick(0, 2)), static_cast<BrushShape>(pick(0, 1)), pick(0, 6),
                      static_cast<VoxelType>(pick(1, 4))};
    const IVec3 start{pick(-5, 75), pick(-3, 14), pick(-5, 45)};
    ASSERT_TRUE(document.begin_stroke(brush, hit_at(document, start, static_cast<Direction>(pick(0, 5)))));
    for (int move = pick(0, 4); move > 0; --move) {
      const DVec3 origin{pick(-50, 100), pick(20, 60), pick(-50, 100)};
      const DVec3 aim{pick(0, 70), pick(0, 10), pick(0, 40)};
      document.drag_to({origin, aim - origin}, hit_at(document, IVec3(aim), Direction::PosY));
    }
    EXPECT_FALSE(document.undo()) << "in a stroke";
    document.end_stroke();
    auto bytes = vox_bytes(document.scene());
    if (document.history().steps() >= states.size()) states.push_back(std::move(bytes));
  }
  ASSERT_EQ(document.history().steps() + 1, states.size());
  ASSERT_GT(states.size(), 10U);
  EXPECT_TRUE(document.is_dirty());
  for (std::size_t i = states.size() - 1; i > 0; --i) {
    ASSERT_EQ(vox_bytes(document.scene()), states[i]) << i;
    ASSERT_TRUE(document.undo());
  }
  EXPECT_EQ(vox_bytes(document.scene()), states[0]);
  EXPECT_FALSE(document.undo());
  EXPECT_FALSE(document.is_dirty()) << "back in the saved state";
  for (std::size_t i = 1; i < states.size(); ++i) {
    ASSERT_TRUE(document.redo());
    ASSERT_EQ(vox_bytes(document.scene()), states[i]) << i;
  }
  EXPECT_FALSE(document.redo());
}

TEST(Document, SculptsPaintsAndUndoesFields) {
  LoadedScene loaded;
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(loaded.scene.types.add({}));
  SceneGrid ground;
  ground.field.add_box({0.0, 0.0, 0.0}, {120.0, 20.0, 120.0}, 1);
  Instance instance;
  instance.voxel_size = 0.5;
  instance.position = {10.0, 0.0, -30.0};
  const GridHandle handle = instance.grid = loaded.scene.add_grid(std::move(ground));
  SceneHit hit;
  hit.instance = loaded.scene.add_instance(instance);
  hit.in_field = true;
  hit.position = {10.0 + 30.0, 10.0, -30.0 + 30.0};  // sample (60, 20, 60): across the border of chunks
  hit.normal = {0.0, 1.0, 0.0};
  hit.type = 1;
  Document document(std::move(loaded), "hill.json");
  const auto field = [&]() -> const DensityGrid& { return document.scene().grids()[handle].field; };
  const DensityGrid before = field().snapshot();
  Brush brush;
  brush.shape = BrushShape::Sphere;
  brush.radius = 4;
  brush.type = 2;
  const auto stroke = [&](BrushAction action, DVec3 to) {
    brush.action = action;
    ASSERT_TRUE(document.begin_stroke(brush, hit));
    SceneHit there = hit;
    there.position = to;
    (void)document.drag_to({to + DVec3(0.0, 20.0, 0.0), {0.0, -1.0, 0.0}}, there);
    document.end_stroke();
  };
  stroke(BrushAction::Place, hit.position + DVec3(8.0, 0.0, 0.0));
  EXPECT_LT(field().density_at({60.0, 23.0, 60.0}), 0.0F);
  EXPECT_LT(field().density_at({76.0, 23.0, 60.0}), 0.0F) << "the end of the stroke";
  EXPECT_LT(field().density_at({68.0, 23.0, 60.0}), 0.0F) << "without gaps";
  EXPECT_EQ(field().material({60, 23, 60}), 2);
  stroke(BrushAction::Remove, hit.position);
  EXPECT_GT(field().density_at({60.0, 22.0, 60.0}), 0.0F);
  stroke(BrushAction::Paint, hit.position + DVec3(0.0, 0.0, 9.0));
  EXPECT_EQ(field().material({60, 18, 77}), 2);
  stroke(BrushAction::Smooth, hit.position);
  // Flattening fills the hole with the ground's material, not the brush's.
  for (int i = 0; i < 12; ++i) stroke(BrushAction::Flatten, hit.position + DVec3(3.0, 0.0, 0.0));
  EXPECT_LT(field().density_at({60.0, 19.0, 60.0}), 0.0F);
  const DVec3 filled{60.0, 18.0, 54.0};
  EXPECT_LT(field().density_at(filled), 0.0F);
  EXPECT_EQ(field().material(IVec3(filled)), 1);
  EXPECT_GT(document.history().steps(), 5U);
  const DensityGrid after = field().snapshot();
  const auto expect_same = [&](const DensityGrid& wanted) {
    ASSERT_EQ(field().chunks(), wanted.chunks());
    for (const IVec3 chunk : wanted.chunks()) {
      EXPECT_EQ(field().find_chunk(chunk)->content_hash(), wanted.find_chunk(chunk)->content_hash());
    }
  };
  while (document.undo()) continue;
  expect_same(before);
  EXPECT_FALSE(document.is_dirty());
  while (document.redo()) continue;
  expect_same(after);
  hit.in_field = false;
  brush.action = BrushAction::Smooth;
  EXPECT_FALSE(document.begin_stroke(brush, hit)) << "blocks are not smoothed";
}

TEST(Document, ClearsRedoOnNewEdit) {
  Document document = small_document();
  const Brush brush{BrushAction::Place, BrushShape::Box, 0, 3};
  for (const int x : {5, 9}) {
    ASSERT_TRUE(document.begin_stroke(brush, hit_at(document, {x, 3, 5}, Direction::PosY)));
    document.end_stroke();
  }
  ASSERT_TRUE(document.undo());
  EXPECT_EQ(document.history().redo_name(), "place");
  ASSERT_TRUE(document.begin_stroke(brush, hit_at(document, {20, 3, 5}, Direction::PosY)));
  document.end_stroke();
  EXPECT_FALSE(document.redo());
  EXPECT_EQ(document.history().steps(), 2U);
  EXPECT_EQ(only_grid(document).get({9, 4, 5}), kAir);
  EXPECT_EQ(only_grid(document).get({20, 4, 5}), 3);
}

TEST(Document, IgnoresStrokeWithoutChanges) {
  Document document = small_document();
  ASSERT_TRUE(
      document.begin_stroke({BrushAction::Paint, BrushShape::Box, 0, 1}, hit_at(document, {0, 3, 0}, Direction::PosY)));
  document.end_stroke();
  EXPECT_EQ(document.history().steps(), 0U);
  EXPECT_FALSE(document.is_dirty());
}

TEST(Document, StrokeStaysInLayerWithoutGaps) {
  Document document = small_document();
  const Brush brush{BrushAction::Place, BrushShape::Box, 0, 3};
  ASSERT_TRUE(document.begin_stroke(brush, hit_at(document, {2, 3, 2}, Direction::PosY)));
  const auto from_above = [](double x, double z) { return Ray{{x, 50.0, z}, {0.0, -1.0, 0.0}}; };
  EXPECT_EQ(document.drag_to(from_above(12.5, 2.5), std::nullopt), 10);
  EXPECT_EQ(document.drag_to(from_above(12.5, 2.5), std::nullopt), 0) << "nothing piles up";
  EXPECT_EQ(document.drag_to({{0.0, 50.0, 0.0}, {1.0, 0.0, 0.0}}, std::nullopt), 0) << "along the layer";
  document.end_stroke();
  for (int x = 2; x <= 12; ++x) {
    EXPECT_EQ(only_grid(document).get({x, 4, 2}), 3);
    EXPECT_EQ(only_grid(document).get({x, 5, 2}), kAir);
  }
  EXPECT_EQ(document.history().steps(), 1U) << "a drag is one step";
}

TEST(Document, RejectsStrokeOnInvalidTarget) {
  Document document = small_document();
  SceneHit gone = hit_at(document, {0, 0, 0}, Direction::PosY);
  gone.instance.generation += 1;
  EXPECT_FALSE(document.begin_stroke({}, gone));
  const Brush unknown{BrushAction::Place, BrushShape::Box, 0, 99};
  EXPECT_FALSE(document.begin_stroke(unknown, hit_at(document, {0, 0, 0}, Direction::PosY)));
  EXPECT_EQ(document.drag_to({}, std::nullopt), 0);
}

TEST(EditHistory, DropsOldestStepsBeyondLimit) {
  LoadedScene loaded = small_scene();
  Scene& scene = loaded.scene;
  const GridHandle handle = scene.grids().handles().front();
  EditHistory history(64'000);
  std::mt19937 random(3);
  for (int edit = 0; edit < 60; ++edit) {
    history.begin("edit");
    Grid& grid = scene.edit(handle).grid;
    const IVec3 centre{static_cast<int>(random() % 60), 8, static_cast<int>(random() % 40)};
    const Brush brush{BrushAction::Place, BrushShape::Sphere, 2, 3};
    history.touch(handle, grid, reach_of(brush, centre));
    apply(brush, centre, grid);
    history.end(scene);
    EXPECT_LE(history.bytes(), 64'000U);
  }
  EXPECT_LT(history.steps(), 60U);
  EXPECT_GT(history.steps(), 0U);
  std::size_t undone = 0;
  while (history.undo(scene)) ++undone;
  EXPECT_EQ(undone, history.steps());
}

TEST(Document, TracksUnsavedChangesAcrossSaves) {
  const ScratchFolder folder("document");
  Document document = small_document();
  ASSERT_TRUE(document.begin_stroke({BrushAction::Place, BrushShape::Sphere, 3, 3},
                                    hit_at(document, {20, 3, 20}, Direction::PosY)));
  document.end_stroke();
  std::vector<std::string> warnings;
  const auto mesh = folder.file("hill.glb");
  ASSERT_TRUE(document.write(mesh, warnings));
  document.note_written(mesh, document.history().state());
  EXPECT_TRUE(document.is_dirty()) << "a mesh is a copy";
  const auto path = folder.file("saved.VOX");
  ASSERT_TRUE(document.write(path, warnings));
  document.note_written(path, document.history().state());
  EXPECT_FALSE(document.is_dirty());
  EXPECT_EQ(document.name(), "saved.VOX");
  ASSERT_TRUE(document.undo());
  EXPECT_TRUE(document.is_dirty());
  ASSERT_TRUE(document.redo());
  EXPECT_FALSE(document.is_dirty());
  const auto again = Document::open(path);
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ((*again)->scene().voxel_count(), document.scene().voxel_count());
  EXPECT_EQ((*again)->scene().bounds().max, document.scene().bounds().max);
}

/// A .vox file with a group, a hidden layer, two frames and a camera.
std::filesystem::path write_layered(const ScratchFolder& folder) {
  vox_test::FileBuilder file;
  file.model(4, 4, 4, {{0, 0, 0, 1}, {1, 1, 1, 2}}).model(2, 2, 2, {{0, 0, 0, 3}});
  file.transform(0, 1, {{}}, {}, -1).group(1, {2, 6});
  file.transform(2, 3, {{}}, {{"_name", "group"}}).group(3, {4});
  file.transform(4, 5, {{}}, {{"_name", "walker"}}, 0).shape(5, {{0, {{"_f", "0"}}}, {1, {{"_f", "3"}}}});
  file.transform(6, 7, {{{"_t", "9 0 0"}}}, {{"_name", "hidden"}}, 1).shape(7, 1);
  file.layer(0, {{"_name", "shown"}}).layer(1, {{"_hidden", "1"}});
  file.with("rCAM", [](auto& out) {
    out.i32(0);
    out.dict({});
  });
  const auto path = folder.file("layered.vox");
  EXPECT_TRUE(write_file(file.file(), path));
  return path;
}

TEST(Document, SaveChangesOnlyStrokeAndKeepsBackup) {
  const ScratchFolder folder("keeping");
  const auto path = write_layered(folder);
  const auto before = read_file(path).value();
  // Opening with hidden parts shown keeps them hidden in the file.
  const auto document = Document::open(path, {.show_hidden = true});
  ASSERT_TRUE(document);
  const InstanceHandle walker = (*document)->scene().instances().handles().front();
  SceneHit hit;
  hit.instance = walker;
  hit.voxel = {0, 0, 3};
  hit.face = Direction::PosX;
  ASSERT_TRUE((*document)->begin_stroke({BrushAction::Paint, BrushShape::Box, 0, 7}, hit));
  (*document)->end_stroke();
  EXPECT_TRUE((*document)->losses(path).value().empty());
  std::vector<std::string> warnings;
  ASSERT_TRUE((*document)->write(path, warnings));
  EXPECT_TRUE(warnings.empty());
  (*document)->note_written(path, (*document)->history().state());
  const auto after = read_file(path).value();
  ASSERT_EQ(after.size(), before.size());
  int different = 0;
  for (std::size_t i = 0; i < before.size(); ++i) different += before[i] != after[i] ? 1 : 0;
  EXPECT_EQ(different, 1);
  EXPECT_EQ(read_file(folder.file("layered.vox~")).value(), before);
  EXPECT_TRUE((*document)->losses(path).value().empty()) << "written by this document";
}

TEST(Document, ChangesLooksOfTypesAsRead) {
  const ScratchFolder folder("packs");
  const auto house = write_house(folder);
  const auto half = write_stone_pack(folder, "half", 8);
  const auto document = Document::open(house, {.packs = {half, kBuiltinPack}});
  ASSERT_TRUE(document) << to_string(document.error());
  Document& opened = **document;
  const VoxelRegistry& types = opened.scene().types;
  ASSERT_GE(types.size(), 2U);
  EXPECT_FALSE(types[1].shapes.empty());
  ASSERT_NE(opened.plain_types(), nullptr);
  EXPECT_TRUE((*opened.plain_types())[1].shapes.empty());
  const auto added = opened.type_of_colour({1, 2, 3, 255});
  ASSERT_TRUE(added);
  const auto own = packed_types(*opened.plain_types(), packs_for_images({}));
  ASSERT_TRUE(own);
  opened.set_looks(own->types);
  EXPECT_TRUE(types[1].shapes.empty());
  EXPECT_FALSE(types[1].faces.empty());
  opened.set_looks(*opened.plain_types());
  EXPECT_TRUE(types[1].faces.empty());
  EXPECT_EQ(types[*added].colour, (Rgba8{1, 2, 3, 255})) << "types that the user added stay";
}

TEST(Document, FallsBackToTheOwnPackWithAWarning) {
  const ScratchFolder folder("fallback");
  const auto house = write_house(folder);
  const LoadOptions options{.packs = {folder.file("absent.jar"), kBuiltinPack}};
  const auto refused = Document::open(house, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::CannotRead);
  const auto document = Document::open(house, options, {}, {}, PackFallback::OwnPack);
  ASSERT_TRUE(document);
  ASSERT_EQ((*document)->loaded().warnings.size(), 1U);
  EXPECT_NE((*document)->loaded().warnings[0].find("absent.jar"), std::string::npos);
  EXPECT_FALSE((*document)->scene().types[1].faces.empty());
}

TEST(Document, ShowsSceneFilesThatNamePacksAsLoadSceneDoes) {
  const ScratchFolder folder("scene_packs");
  write_house(folder);
  const auto textures = write_stone_pack(folder, "textures", 16);
  std::filesystem::remove_all(textures / "assets/minecraft/blockstates");
  std::filesystem::remove_all(textures / "assets/minecraft/models");
  const auto half = write_stone_pack(folder, "half", 8);
  std::filesystem::remove_all(half / "assets/minecraft/textures");
  SceneFile file;
  file.sources.push_back({"house", "house.schem", {{"textures"}}});
  file.placements.push_back({.instance = {}, .source = "house"});
  const auto path = folder.file("scene.json");
  ASSERT_TRUE(write_scene_file(file, path));

  const LoadOptions with_half{.packs = {half}};
  const LoadOptions with_own{.packs = packs_for_images({})};
  LoadOptions none;
  none.scene_packs = false;
  for (const LoadOptions& options : {with_half, with_own, none}) {
    const auto loaded = load_scene(path, options);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    const auto document = Document::open(path, options);
    ASSERT_TRUE(document) << to_string(document.error());
    EXPECT_TRUE((*document)->reopens_for_looks());
    EXPECT_EQ((*document)->plain_types(), nullptr);
    EXPECT_EQ((*document)->loaded().warnings, loaded->warnings);
    const VoxelRegistry& types = (*document)->scene().types;
    ASSERT_EQ(types.size(), loaded->scene.types.size());
    EXPECT_EQ(types[1].colour, loaded->scene.types[1].colour);
    EXPECT_TRUE(types[1].shapes == loaded->scene.types[1].shapes);
    EXPECT_EQ(types[1].faces.empty(), loaded->scene.types[1].faces.empty());
  }
  const auto document = Document::open(path, with_half);
  ASSERT_TRUE(document);
  EXPECT_TRUE((*document)->loaded().warnings.empty()) << (*document)->loaded().warnings.front();
  EXPECT_FALSE((*document)->scene().types[1].shapes.empty()) << "the model of one pack";
  EXPECT_EQ((*document)->scene().types[1].colour, (Rgba8{200, 40, 40, 255})) << "the texture of the other";

  const LoadOptions absent{.packs = {folder.file("absent.jar"), kBuiltinPack}};
  EXPECT_FALSE(Document::open(path, absent));
  const auto fallback = Document::open(path, absent, {}, {}, PackFallback::OwnPack);
  ASSERT_TRUE(fallback) << to_string(fallback.error());
  ASSERT_FALSE((*fallback)->loaded().warnings.empty());
  EXPECT_NE((*fallback)->loaded().warnings[0].find("absent.jar"), std::string::npos);
  EXPECT_EQ((*fallback)->scene().types[1].colour, (Rgba8{200, 40, 40, 255}));
}

TEST(Document, ReportsUnsupportedFeaturesOnce) {
  const ScratchFolder folder("losing");
  const auto path = write_layered(folder);
  const auto document = Document::open(path);
  ASSERT_TRUE(document);
  const auto losses = (*document)->losses(folder.file("as.json"));
  ASSERT_TRUE(losses);
  EXPECT_EQ(*losses, (std::vector<std::string>{"left out, only .vox stores it: animation: frames 0 to 3",
                                               "left out, only .vox stores it: cameras: 1"}));
  {
    Saver saver(**document, folder.file("as.json"), false, nullptr);
    while (!saver.is_done()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_TRUE(saver.status());
    EXPECT_EQ(saver.losses(), *losses);
  }
  EXPECT_FALSE(std::filesystem::exists(folder.file("as.json"))) << "the user is asked first";
  (*document)->accept_unsupported(*losses);
  EXPECT_TRUE((*document)->losses(folder.file("as.json")).value().empty());
  EXPECT_TRUE((*document)->losses(folder.file("mesh.glb")).value().empty()) << "a copy";
  // Another program changes the file.
  ASSERT_TRUE(write_file(std::as_bytes(std::span(std::string_view("VOX another"))), path));
  const auto of_others = (*document)->losses(path);
  ASSERT_TRUE(of_others);
  ASSERT_EQ(of_others->size(), 1U);
  EXPECT_NE(of_others->front().find("another program"), std::string::npos);
}

TEST(Document, KeepsBackupOfOriginalAfterLossySave) {
  const ScratchFolder folder("lost_once");
  const auto path = folder.file("scene.json");
  const auto document = Document::open(write_layered(folder));
  ASSERT_TRUE(document);
  const auto save = [&] {
    std::vector<std::string> warnings;
    EXPECT_TRUE((*document)->write(path, warnings));
    (*document)->note_written(path, (*document)->history().state());
  };
  const auto accept = [&](const char* loss) { (*document)->accept_unsupported({loss}); };
  const auto content = [&](const char* name) {
    return read_file(folder.file(name)).value_or(std::vector<std::byte>{});
  };
  ASSERT_TRUE(write_file(std::as_bytes(std::span(std::string_view("the original"))), path));
  const auto original = content("scene.json");
  accept("animation");
  EXPECT_EQ((*document)->kept_as(path).filename(), "scene.json~");
  save();
  save();
  save();
  EXPECT_EQ(content("scene.json~"), original);
  EXPECT_FALSE(std::filesystem::exists(folder.file("scene.json.~1~"))) << "nothing more was lost";
  ASSERT_TRUE(write_file(std::as_bytes(std::span(std::string_view("another's work"))), path));
  const auto of_another = content("scene.json");
  accept("another's");
  EXPECT_EQ((*document)->kept_as(path).filename(), "scene.json.~1~");
  save();
  save();
  EXPECT_EQ(content("scene.json~"), original);
  EXPECT_EQ(content("scene.json.~1~"), of_another);
}

TEST(Document, UndoesAndSavesVisibility) {
  const ScratchFolder folder("switches");
  const auto path = write_layered(folder);
  const auto document = Document::open(path);
  ASSERT_TRUE(document);
  const GroupHandle group = (*document)->scene().groups().handles().front();
  const LayerHandle layer = (*document)->scene().layers().handles()[1];
  EXPECT_FALSE((*document)->show(layer, false)) << "already hidden";
  EXPECT_TRUE((*document)->show(layer, true));
  EXPECT_TRUE((*document)->show(group, false));
  EXPECT_TRUE((*document)->is_dirty());
  EXPECT_EQ((*document)->history().undo_name(), "hide");
  EXPECT_TRUE((*document)->undo());
  EXPECT_TRUE((*document)->scene().groups()[group].visible);
  EXPECT_TRUE((*document)->redo());
  std::vector<std::string> warnings;
  ASSERT_TRUE((*document)->write(path, warnings));
  const auto again = Document::open(path);
  ASSERT_TRUE(again);
  const Scene& saved = (*again)->scene();
  EXPECT_FALSE(saved.groups()[saved.groups().handles().front()].visible);
  EXPECT_TRUE(saved.layers()[saved.layers().handles()[1]].visible);
  EXPECT_FALSE((*document)->show(GroupHandle{9, 9}, true)) << "no such group";
}

TEST(Document, ReportsErrors) {
  const ScratchFolder folder("errors");
  Document document = small_document();
  std::vector<std::string> warnings;
  EXPECT_EQ(document.write(folder.file("a.obj"), warnings).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(document.write(folder.file("none") / "a.vox", warnings).error().code, ErrorCode::CannotWrite);
  EXPECT_EQ(document.write(folder.file("a.glb"), warnings, [](double) { return false; }).error().code,
            ErrorCode::Cancelled);
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.glb")));
  EXPECT_EQ(Document::open(folder.file("absent.vox")).error().code, ErrorCode::CannotRead);
  const std::string text = "not a voxel in sight";
  ASSERT_TRUE(write_file(std::as_bytes(std::span(text)), folder.file("text.vox")));
  EXPECT_FALSE(Document::open(folder.file("text.vox")));
}

TEST(Document, ReusesTypeOfEqualColour) {
  Document document = small_document();
  EXPECT_EQ(document.type_of_colour({200, 40, 40, 255}).value(), 3);
  const VoxelType fresh = document.type_of_colour({1, 2, 3, 255}).value();
  EXPECT_EQ(fresh, 5);
  EXPECT_EQ(document.type_of_colour({1, 2, 3, 255}).value(), fresh);
  const VoxelType torch = document.type_of_colour({1, 2, 3, 255}, 8.0F).value();
  EXPECT_NE(torch, fresh);
  EXPECT_EQ(document.scene().types[torch].emission, 8.0F);
}

TEST(Document, PaintsColoursWithoutTextures) {
  LoadedScene loaded = small_scene();
  std::vector<std::uint8_t> texels(4 * 16 * 16, 255);
  for (std::size_t i = 0; i < texels.size(); i += 4) texels[i] = 7;
  const VoxelFaces faces = Texture::from_image("teal", AlphaImage{16, 16, texels}).value();
  const VoxelType textured = loaded.scene.types.add({.name = "teal", .faces = faces}).value();
  ASSERT_EQ(loaded.scene.types[textured].colour, (Rgba8{7, 255, 255, 255}));
  Document document(std::move(loaded), "hill.vox");
  const VoxelType painted = document.type_of_colour({7, 255, 255, 255}).value();
  EXPECT_NE(painted, textured);
  EXPECT_TRUE(document.scene().types[painted].faces.empty());
}

// The types of small_scene, then a torch (5), a slab (6) and stairs (7).
Document document_of_shapes() {
  LoadedScene loaded = small_scene();
  VoxelRegistry& types = loaded.scene.types;
  const auto add = [&](VoxelProperties type) { (void)types.add(std::move(type)).value(); };
  add({.name = "torch",
       .state_bits = 3,
       .orientations = StateOrientations::to_directions(),
       .shapes = VoxelShape::box({7, 0, 7}, {9, 10, 9})});
  add({.name = "slab",
       .state_bits = 1,
       .orientations = {.by_value = {AxisOrientation(), AxisOrientation::quarter_turns(0, 2)}},
       .shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16})});
  add({.name = "stairs",
       .state_bits = 3,
       .orientations = StateOrientations::about_y_and_upside_down(),
       .shapes = VoxelShape::boxes({{{0, 0, 0}, {16, 8, 16}}, {{8, 8, 0}, {16, 16, 16}}})});
  return {std::move(loaded), "hill.vox"};
}

// A hit of an instance's voxel at a point of its face, given in the grid.
SceneHit hit_at(const Document& document, std::size_t instance, IVec3 voxel, Direction face, DVec3 point) {
  SceneHit hit = hit_at(document, voxel, face);
  hit.instance = document.scene().instances().handles()[instance];
  const Instance& placed = document.scene().instances()[hit.instance];
  hit.position = world_from_grid(placed, document.scene().grids()[placed.grid], DVec3(voxel) + point);
  return hit;
}

TEST(Document, PlacesShapesInTheOrientationOfTheFace) {
  for (const std::size_t instance : {0U, 1U}) {  // the second is turned and mirrored
    Document document = document_of_shapes();
    const Instance& placed = document.scene().instances()[document.scene().instances().handles()[instance]];
    const SceneGrid& grid = document.scene().grids()[placed.grid];
    const auto look = [&](DVec3 in_grid) {
      return world_from_grid(placed, grid, in_grid) - world_from_grid(placed, grid, DVec3(0.0));
    };
    const auto place = [&](VoxelType type, Direction face, double height, DVec3 looks) {
      Brush brush;
      brush.choose(type);
      const IVec3 voxel{52, 7, 10};
      EXPECT_TRUE(
          document.begin_stroke(brush, hit_at(document, instance, voxel, face, {0.5, height, 0.0}), look(looks)));
      document.end_stroke();
      const IVec3 at = voxel + normal_of(face);
      EXPECT_EQ(only_grid(document).get(at), type);
      const std::uint32_t state = only_grid(document).data(at).state;
      EXPECT_TRUE(document.undo());
      EXPECT_EQ(only_grid(document).get(at), kAir);
      EXPECT_TRUE(document.redo());
      EXPECT_EQ(only_grid(document).data(at).state, state) << "undo keeps states";
      EXPECT_TRUE(document.undo());
      return state;
    };
    EXPECT_EQ(place(5, Direction::NegZ, 0.3, {0.8, 0.0, 0.7}), 5U) << "a torch points away from the wall";
    EXPECT_EQ(place(6, Direction::NegZ, 0.3, {0.0, 0.0, 1.0}), 0U);
    EXPECT_EQ(place(6, Direction::NegZ, 0.7, {0.0, 0.0, 1.0}), 1U) << "the upper half";
    EXPECT_EQ(place(7, Direction::NegZ, 0.3, {0.2, -0.5, 1.0}), 3U) << "the high side is away from the player";
    EXPECT_EQ(place(7, Direction::NegZ, 0.7, {0.9, -0.5, 0.1}), 4U);
  }
}

TEST(Document, PlacesAndPaintsPickedStates) {
  Document document = document_of_shapes();
  Brush brush;
  brush.choose(7, 6);
  const auto stroke = [&](IVec3 voxel) {
    ASSERT_TRUE(document.begin_stroke(brush, hit_at(document, 0, voxel, Direction::PosY, {0.5, 1.0, 0.5}), {1, 0, 0}));
    document.end_stroke();
  };
  stroke({2, 3, 2});
  EXPECT_EQ(only_grid(document).data({2, 4, 2}).state, 6U);
  brush.radius = 1;
  stroke({20, 5, 2});  // a cube in the air
  EXPECT_EQ(only_grid(document).get({21, 7, 3}), 7);
  EXPECT_EQ(only_grid(document).data({21, 7, 3}).state, 6U);
  brush.radius = 0;
  // Painting gives the state to voxels of the same type and of others.
  brush.action = BrushAction::Paint;
  brush.choose(7, 1);
  stroke({2, 4, 2});
  EXPECT_EQ(only_grid(document).data({2, 4, 2}).state, 1U);
  stroke({2, 3, 2});
  EXPECT_EQ(only_grid(document).get({2, 3, 2}), 7);
  EXPECT_EQ(only_grid(document).data({2, 3, 2}).state, 1U);
  EXPECT_TRUE(document.undo());
  EXPECT_TRUE(document.undo());
  EXPECT_EQ(only_grid(document).data({2, 4, 2}).state, 6U);
  // A type from the palette keeps the states of its own voxels.
  brush.choose(7);
  stroke({2, 4, 2});
  EXPECT_EQ(only_grid(document).data({2, 4, 2}).state, 6U);
  Grid grid;
  grid.set({0, 0, 0}, 7, {.state = 1});
  brush.choose(7, 5);
  EXPECT_EQ(apply(brush, {0, 0, 0}, grid), 1) << "a change of the state counts";
  EXPECT_EQ(apply(brush, {0, 0, 0}, grid), 0);
}

TEST(Document, NewColoursAreNotShapes) {
  LoadedScene loaded = small_scene();
  const VoxelType half =
      loaded.scene.types
          .add({.name = "slab", .colour = {1, 2, 3, 255}, .shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16})})
          .value();
  Document document(std::move(loaded), "hill.vox");
  EXPECT_NE(document.type_of_colour({1, 2, 3, 255}).value(), half);
}

}  // namespace
}  // namespace quoin::viewer

#include <quoin/io/scene_file.h>

#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/io/formats.h>
#include <quoin/io/vox.h>

#include "core/bytes/text.h"
#include "io/byte_stream.h"
#include "io/gltf/glb_for_tests.h"
#include "io/scene_file/voxel_data.h"
#include "io/vox/write/vox_parts.h"

// Voxel data in scene files.

namespace quoin {
namespace {

constexpr VoxelType kPlain = 1;
constexpr VoxelType kTurned = 2;

// The types are stone without a state, and stairs with a state of two bits.
Scene scene_of(Grid grid) {
  Scene scene;
  EXPECT_TRUE(scene.types.add({.name = "stone", .colour = {}}));
  EXPECT_TRUE(scene.types.add({.name = "stairs", .colour = {}, .state_bits = 2}));
  SceneGrid model;
  model.grid = std::move(grid);
  Instance instance;
  instance.grid = scene.add_grid(std::move(model));
  scene.add_instance(instance);
  return scene;
}

std::string text_of(const Scene& scene, Threads threads = {}) {
  const auto bytes = write_scene_file(scene_file_of(scene).value(), threads);
  EXPECT_TRUE(bytes) << to_string(bytes.error());
  return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : std::string();
}

Result<LoadedScene> read(const std::string& text) {
  return load_scene(std::as_bytes(std::span(text)));
}

const Grid& only_grid(const Scene& scene) {
  return scene.grids()[scene.grids().handles().front()].grid;
}

void expect_same_chunks(const Grid& a, const Grid& b) {
  ASSERT_EQ(a.chunks(), b.chunks());
  for (const IVec3 at : a.chunks()) ASSERT_TRUE(*a.find_chunk(at) == *b.find_chunk(at));
  ASSERT_EQ(a.data_count(), b.data_count());
}

TEST(SceneData, RoundTripsEveryVoxel) {
  std::mt19937 random(5);
  Grid grid;
  for (int i = 0; i < 3'000; ++i) {
    const IVec3 at = IVec3(random() % 150U, random() % 150U, random() % 150U) - 70;
    const VoxelType type = random() % 2U == 0 ? kPlain : kTurned;
    grid.set(at, type);
    const std::vector<std::byte> bytes(random() % 4U == 0 ? random() % 300U : 0, std::byte(random()));
    grid.set_data(at, {type == kTurned ? static_cast<std::uint32_t>(random() % 4U) : 0, bytes});
  }
  ASSERT_GT(grid.data_count(), 500);
  const Scene scene = scene_of(grid.snapshot());
  const std::string text = text_of(scene);
  EXPECT_NE(text.find("\"quoin_scene\": 5"), std::string::npos);
  const auto loaded = read(text);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  expect_same_chunks(only_grid(loaded->scene), grid);
  EXPECT_EQ(loaded->scene.types[kTurned], scene.types[kTurned]);
  EXPECT_EQ(text_of(loaded->scene, Threads{1}), text) << "by any number of threads";
}

TEST(SceneData, SplitsManyMegabytesIntoPieces) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {64, 64, 64}}, kTurned);
  std::mt19937 random(6);
  std::vector<std::byte> bytes(kMaxVoxelDataBytes);
  for (std::byte& byte : bytes) byte = std::byte(random());
  for (int i = 0; i < 300; ++i) grid.set_data({i % 64, i / 64, 7}, {3, bytes});
  const auto loaded = read(text_of(scene_of(grid.snapshot())));
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  expect_same_chunks(only_grid(loaded->scene), grid);
  const Grid* const all = &grid;
  EXPECT_EQ(encode_data({&all, 1}, VoxelCompression::Stored, {}, {}).value()[0].size(), 3U);
}

// The writer stores data uncompressed that compresses too well for the reader's limit.
TEST(SceneData, StoresHighlyRegularDataUncompressed) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {64, 64, 1}}, kPlain);
  const std::vector<std::byte> zeros(kMaxVoxelDataBytes);
  for (int i = 0; i < 1'200; ++i) grid.set_data({i % 64, i / 64, 0}, {.bytes = zeros});
  const auto loaded = read(text_of(scene_of(grid.snapshot())));
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(only_grid(loaded->scene).data_count(), grid.data_count());
}

TEST(SceneData, SurvivesRenumberingOfTypes) {
  const TestFolder folder("scene_data");
  Grid grid;
  grid.set({1, 2, 3}, kTurned, {.state = 2});
  ASSERT_TRUE(save_scene(scene_of(grid.snapshot()), folder.file("inner.json")));
  SceneFile outer;
  ASSERT_TRUE(outer.types.add({.name = "sand", .colour = {}}));
  outer.sources.push_back({"inner", "inner.json"});
  SceneFile::Placement placement;
  placement.source = "inner";
  outer.placements.push_back(placement);
  ASSERT_TRUE(write_scene_file(outer, folder.file("outer.json")));
  const auto loaded = load_scene(folder.file("outer.json"));
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(only_grid(loaded->scene).get({1, 2, 3}), 3) << "behind the file's own type";
  EXPECT_EQ(only_grid(loaded->scene).data({1, 2, 3}).state, 2U);
}

TEST(SceneData, LeavesFilesWithoutDataUnchanged) {
  Scene scene;
  ASSERT_TRUE(scene.types.add({.name = "stone", .colour = {}}));
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, kPlain);
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  const std::string before = text_of(scene);
  EXPECT_NE(before.find("\"quoin_scene\": 2"), std::string::npos);
  Grid& edited = scene.edit(instance.grid).grid;
  const std::vector<std::byte> bytes(3);
  edited.set_data({0, 0, 0}, {.bytes = bytes});
  EXPECT_NE(text_of(scene), before);
  edited.set_data({0, 0, 0}, {});
  EXPECT_EQ(text_of(scene), before);
}

TEST(SceneData, RefusesStatesWithMoreBitsThanTheType) {
  Grid grid;
  grid.set({1, 2, 3}, kTurned, {.state = 4});
  const auto written = write_scene_file(scene_file_of(scene_of(std::move(grid))).value());
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(written.error().message, "grids[0]: state 4 of voxel (1, 2, 3) has more than the 2 bits of its type");
}

TEST(SceneData, KeepsTypesWhoseDataChangesMeshes) {
  Grid grid;
  grid.set({1, 2, 3}, kTurned, {.state = 3});
  Scene scene = scene_of(std::move(grid));
  EXPECT_EQ(text_of(scene).find("remesh_on_data"), std::string::npos);
  VoxelProperties door = scene.types[kTurned];
  door.remesh_on_data = true;
  scene.types.replace(kTurned, door);
  EXPECT_NE(text_of(scene).find("\"quoin_scene\": 7"), std::string::npos) << "programs that do not know it refuse it";
  const auto again = read(text_of(scene));
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->scene.types[kTurned], door);
}

TEST(SceneData, NamesDataThatVoxCannotHold) {
  Grid grid;
  grid.set({1, 2, 3}, kTurned, {.state = 3});
  const Scene scene = scene_of(std::move(grid));
  const auto losses = vox_unsupported_features(scene);
  ASSERT_TRUE(losses);
  ASSERT_EQ(losses->size(), 1U);
  EXPECT_EQ((*losses)[0], "data of voxels left out, not supported by .vox (.json stores it): 1");
  const auto written = write_vox(scene);
  ASSERT_TRUE(written);
  const auto again = load_scene(written->bytes);
  ASSERT_TRUE(again) << to_string(again.error());
  const VoxelType type = only_grid(again->scene).types().at(0);
  EXPECT_EQ(again->scene.types[type].state_bits, 2) << "keeps the properties of a type";
}

// A data record as stored in a file.
struct Record {
  IVec3 chunk{0};
  std::uint32_t count = 1;
  struct Voxel {
    std::uint32_t place = 0;
    std::uint32_t state = 1;
    std::uint32_t length = 0;
    std::size_t bytes = 0;
  };
  std::vector<Voxel> voxels;
};

std::vector<std::byte> bytes_of(const std::vector<Record>& records) {
  std::vector<std::byte> bytes;
  const auto put = [&](std::uint32_t number) {
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<std::byte>(number >> (8 * i)));
  };
  for (const Record& record : records) {
    for (int axis = 0; axis < 3; ++axis) put(static_cast<std::uint32_t>(record.chunk[axis]));
    put(record.count);
    for (const Record::Voxel& voxel : record.voxels) {
      put(voxel.place);
      put(voxel.state);
      put(voxel.length);
      bytes.resize(bytes.size() + voxel.bytes);
    }
  }
  return bytes;
}

// Returns the error for such data in a grid with stairs at (1, 0, 0) and stone at (2, 0, 0).
std::string find_bytes_error(const std::vector<std::byte>& data, const std::string& further = "") {
  Grid grid;
  grid.set({1, 0, 0}, kTurned);
  grid.set({2, 0, 0}, kPlain);
  std::string text = text_of(scene_of(std::move(grid)));
  const std::size_t end = text.find("]}", text.find("\"voxels\""));
  text.insert(end + 1, ",\"data\":[\"" + to_base64(gzipped(data, 9)) + "\"" + further + "]");
  const auto loaded = read(text);
  if (loaded) return "";
  EXPECT_EQ(loaded.error().code, ErrorCode::BadFormat);
  return loaded.error().message;
}
std::string find_error(const std::vector<Record>& records) {
  return find_bytes_error(bytes_of(records));
}

TEST(SceneData, RefusesInvalidDataWithItsPosition) {
  const std::string piece = "grids[0].data[0]: ";
  const std::string at = piece + "byte 16 of the voxel data: ";
  EXPECT_EQ(find_error({{.voxels = {{.place = 1}}}}), "");
  EXPECT_EQ(find_error({{.voxels = {{.place = 2}}}}),
            piece + "state 1 of voxel (2, 0, 0) has more than the 0 bits of its type");
  EXPECT_EQ(find_error({{.voxels = {{.place = 3}}}}), piece + "chunk (0, 0, 0) has data for an air voxel");
  EXPECT_EQ(find_error({{.chunk = {7, 0, 0}, .voxels = {{.place = 1}}}}),
            piece + "chunk (7, 0, 0) has data for an air voxel");
  EXPECT_EQ(find_error({{.voxels = {{.place = 1}}}, {.voxels = {{.place = 1}}}}),
            piece + "chunk (0, 0, 0) has data twice for one voxel");
  EXPECT_EQ(find_error({{.voxels = {{.place = 262'144}}}}), at + "a voxel is outside its chunk");
  EXPECT_EQ(find_error({{.count = 2, .voxels = {{.place = 1}, {.place = 1}}}}),
            piece + "byte 28 of the voxel data: voxels with data are not in ascending order");
  EXPECT_EQ(find_error({{.voxels = {{.place = 1, .state = 0}}}}), at + "a voxel has no data");
  EXPECT_EQ(find_error({{.voxels = {{.place = 1, .length = 65'537, .bytes = 65'537}}}}),
            piece + "byte 24 of the voxel data: invalid data length: 65537 bytes for one voxel");
  EXPECT_EQ(find_error({{.voxels = {{.place = 1, .length = 9, .bytes = 8}}}}),
            piece + "byte 36 of the voxel data: cut off");
  EXPECT_EQ(find_error({{.count = 0, .voxels = {}}}),
            piece + "byte 12 of the voxel data: invalid number of voxels with data: 0");
  EXPECT_EQ(find_error({{.count = 262'145, .voxels = {}}}),
            piece + "byte 12 of the voxel data: invalid number of voxels with data: 262145");
  EXPECT_EQ(find_error({{.count = 200'000, .voxels = {{.place = 1}}}}), piece + "byte 28 of the voxel data: cut off");
  EXPECT_EQ(find_error({{.chunk = {1 << 30, 0, 0}, .voxels = {{.place = 1}}}}),
            piece + "byte 0 of the voxel data: a chunk position is out of range");
  EXPECT_EQ(find_bytes_error(std::vector<std::byte>(5)), piece + "byte 5 of the voxel data: cut off");
  EXPECT_EQ(find_bytes_error(bytes_of({{.voxels = {{.place = 1}}}}), ", 5"), "grids[0].data[1]: must be a string");
}

// A file of types that follow their visibility is as before.
TEST(SceneData, KeepsLightAndOcclusionOfTypes) {
  Scene scene = scene_of(Grid());
  const std::string before = text_of(scene);
  EXPECT_NE(before.find("\"quoin_scene\": 5"), std::string::npos);
  for (const char* key : {"light", "occludes"}) EXPECT_EQ(before.find(key), std::string::npos) << key;
  VoxelProperties stone = scene.types[kPlain];
  stone.blocks_light = true;
  stone.occludes = true;
  scene.types.replace(kPlain, stone);
  EXPECT_EQ(text_of(scene), before) << "the defaults of an opaque type";
  constexpr auto kClear = Visibility::Transparent;
  EXPECT_TRUE(scene.types.add({.name = "water", .colour = {}, .visibility = kClear, .light_cost = 1}));
  EXPECT_TRUE(scene.types.add({.name = "roof", .colour = {}, .visibility = kClear, .blocks_light = true}));
  EXPECT_TRUE(scene.types.add({.name = "grate", .colour = {}, .blocks_light = false, .occludes = false}));
  const std::string text = text_of(scene);
  EXPECT_NE(text.find("\"quoin_scene\": 7"), std::string::npos) << "programs that do not know them refuse it";
  const auto again = read(text);
  ASSERT_TRUE(again) << to_string(again.error());
  ASSERT_EQ(again->scene.types.size(), scene.types.size());
  for (std::size_t i = 0; i < scene.types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    EXPECT_EQ(again->scene.types[type], scene.types[type]) << i;
  }
}

TEST(SceneData, RejectsLightAndOcclusionOutOfRange) {
  Scene scene = scene_of(Grid());
  VoxelProperties water{.name = "water", .colour = {}, .visibility = Visibility::Transparent, .light_cost = 1};
  water.blocks_light = true;
  EXPECT_TRUE(scene.types.add(water));
  const std::string text = text_of(scene);
  const auto error_with = [&](const std::string& wanted, const std::string& other) {
    std::string changed = text;
    const std::size_t place = text.find(wanted);
    EXPECT_NE(place, std::string::npos);
    changed.replace(place, wanted.size(), other);
    const auto loaded = read(changed);
    return loaded ? std::string() : loaded.error().message;
  };
  for (const char* cost : {"16", "-1", "1.5", "true"}) {
    EXPECT_EQ(error_with("\"light_cost\":1", std::string("\"light_cost\":") + cost),
              "types[2].light_cost: must be a whole number from 0 to 15");
  }
  EXPECT_EQ(error_with("\"blocks_light\":true", "\"blocks_light\":1"), "types[2].blocks_light: must be true or false");
  EXPECT_EQ(error_with("\"blocks_light\":true", "\"occludes\":true"),
            "types[2].occludes: must be false for a transparent type");
}

Texture random_texture(const std::string& name, int size, unsigned seed, bool with_alpha) {
  std::mt19937 random(seed);
  AlphaImage image{size, size, {}};
  for (int i = 0; i < 4 * size * size; ++i) {
    image.rgba.push_back(i % 4 == 3 && !with_alpha ? 255 : static_cast<std::uint8_t>(random()));
  }
  return Texture::from_image(name, image).value();
}

VoxelProperties textured_type() {
  VoxelProperties type{.name = "window", .visibility = Visibility::Transparent};
  const Texture frame = random_texture("frame", 32, 1, false);
  const Texture pane = random_texture("pane \xff", 16, 2, true);
  type.faces = VoxelFaces(std::array<VoxelFace, 6>{VoxelFace{.texture = frame, .turn = 3},
                                                   {.texture = frame, .mirrored = true},
                                                   {.texture = frame, .tint = {1, 2, 3, 4}},
                                                   {.texture = pane, .alpha = FaceAlpha::Cutout},
                                                   {.texture = pane, .alpha = FaceAlpha::Translucent},
                                                   {.texture = frame}});
  return type;
}

TEST(SceneData, KeepsTextures) {
  Scene scene = scene_of(Grid());
  ASSERT_TRUE(scene.types.add({.name = "wall", .faces = random_texture("wall", 16, 3, false)}));
  ASSERT_TRUE(scene.types.add(textured_type()));
  const std::string text = text_of(scene);
  EXPECT_NE(text.find("\"quoin_scene\": 8"), std::string::npos);
  const auto loaded = read(text);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->scene.types.size(), scene.types.size());
  for (VoxelType type = 1; type < scene.types.size(); ++type) {
    EXPECT_EQ(loaded->scene.types[type], scene.types[type]) << scene.types[type].name;
  }
  EXPECT_EQ(text_of(loaded->scene), text);
  const TestFolder folder("scene_textures");
  for (const char* name : {"a.json", "a.quoin"}) {
    ASSERT_TRUE(unsupported_features(scene, folder.file(name)).value().empty()) << name;
    const auto saved = save_scene(scene, folder.file(name));
    ASSERT_TRUE(saved) << to_string(saved.error());
    EXPECT_TRUE(saved->warnings.empty());
    const auto again = load_scene(folder.file(name));
    ASSERT_TRUE(again) << to_string(again.error());
    ASSERT_EQ(again->scene.types.size(), scene.types.size());
    EXPECT_EQ(again->scene.types[4], scene.types[4]) << name;
  }
}

// 400 types with the same two textures, each on all or some of their faces.
VoxelRegistry types_with_shared_textures() {
  const Texture bark = random_texture("bark", 64, 1, false);
  const Texture wood = random_texture("wood", 64, 2, false);
  VoxelRegistry types;
  EXPECT_TRUE(types.add({.name = "plain"}));
  for (int i = 0; i < 400; ++i) {
    const VoxelFace tinted{.texture = bark, .tint = {static_cast<std::uint8_t>(i % 256), 9, 9}};
    const std::string name = "log " + std::to_string(i);
    const VoxelFaces faces = i % 3 == 0 ? VoxelFaces(tinted) : VoxelFaces(tinted, {wood}, {wood});
    EXPECT_TRUE(types.add({.name = name, .faces = faces}));
  }
  return types;
}

TEST(SceneData, WritesSharedTexturesOnce) {
  Scene scene;
  scene.types = types_with_shared_textures();
  const std::string text = text_of(scene);
  constexpr std::size_t kTexture = 64 * 64 * 4;  // base64 of 3 bytes per texel
  EXPECT_LT(text.size(), 2 * kTexture + 401 * 400);
  EXPECT_NE(text.find(R"({"type":2,"texture":0})"), std::string::npos);
  const auto loaded = read(text);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->scene.types.size(), scene.types.size());
  for (VoxelType type = 1; type < scene.types.size(); ++type) {
    ASSERT_EQ(loaded->scene.types[type], scene.types[type]) << type;
  }
  EXPECT_EQ(text_of(loaded->scene), text);
}

TEST(SceneData, RefusesInvalidReferencesToTextures) {
  Scene scene;
  scene.types = types_with_shared_textures();
  const std::string text = text_of(scene);
  const std::string wanted = R"({"type":2,"texture":0})";
  const std::size_t at = text.find(wanted);
  ASSERT_NE(at, std::string::npos);
  const auto error_of = [&](const std::string& reference) {
    const auto loaded = read(std::string(text).replace(at, wanted.size(), reference));
    return loaded ? "" : loaded.error().message;
  };
  const std::string place = "types[2].faces.textures[0]";
  EXPECT_EQ(error_of(wanted), "");
  EXPECT_EQ(error_of(R"({"type":3,"texture":0})"), place + ".type: type 3 does not come before this type") << "itself";
  EXPECT_EQ(error_of(R"({"type":4,"texture":0})"), place + ".type: type 4 does not come before this type");
  EXPECT_EQ(error_of(R"({"type":65535,"texture":0})"), place + ".type: type 65535 does not come before this type");
  EXPECT_EQ(error_of(R"({"type":0,"texture":0})"), place + ".type: type 0 does not come before this type");
  EXPECT_EQ(error_of(R"({"type":1,"texture":0})"), place + ".texture: type 1 has no texture 0 in its list");
  EXPECT_EQ(error_of(R"({"type":2,"texture":1})"), place + ".texture: type 2 has no texture 1 in its list");
  EXPECT_EQ(error_of(R"({"type":2,"texture":6})"), place + ".texture: type 2 has no texture 6 in its list");
  EXPECT_EQ(error_of(R"({"type":2,"texture":9999})"), place + ".texture: must be a whole number from 0 to 3077");
  EXPECT_EQ(error_of(R"({"type":-1,"texture":0})"), place + ".type: must be a whole number from 0 to 65535");
  EXPECT_EQ(error_of(R"({"type":1e99,"texture":0})"), place + ".type: must be a whole number from 0 to 65535");
  EXPECT_EQ(error_of(R"({"type":[2],"texture":0})"), place + ".type: must be a whole number from 0 to 65535");
  EXPECT_EQ(error_of(R"({"type":2})"), place + ": \"texture\" is missing");
  EXPECT_EQ(error_of(R"({"type":2,"texture":0,"size":64})"), place + ": \"size\" is unknown here");
}

TEST(SceneData, NamesTexturesAndShapesThatAFormatLacks) {
  Scene scene = scene_of(Grid());
  ASSERT_TRUE(scene.types.add({.name = "wall", .faces = random_texture("wall", 16, 3, false)}));
  ASSERT_TRUE(scene.types.add({.name = "unused", .faces = random_texture("roof", 16, 4, false)}));
  Grid grid;
  grid.set({0, 0, 0}, 3);
  grid.set({1, 0, 0}, *scene.types.add({.name = "slab", .shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16})}));
  const GridHandle handle = scene.add_grid({.grid = std::move(grid)});
  scene.add_instance({.grid = handle});
  const TestFolder folder("scene_textures");
  const std::string line = "textures of types left out, their mean colours are kept: 1";
  for (const char* name : {"a.vox", "a.qb"}) {
    const auto warnings = unsupported_features(scene, folder.file(name)).value();
    EXPECT_EQ(std::ranges::count(warnings, line), 1) << name;
    EXPECT_EQ(std::ranges::count(warnings, "shapes of types left out, their voxels are cubes: 1"), 1) << name;
    const auto saved = save_scene(scene, folder.file(name));
    ASSERT_TRUE(saved) << to_string(saved.error());
    EXPECT_EQ(std::ranges::count(saved->warnings, line), 1) << name;
  }
}

// Replaces a piece of the text of a scene with textures, and returns the reader's error.
std::string error_after(const std::string& from, const std::string& to) {
  Scene scene;
  EXPECT_TRUE(scene.types.add(textured_type()));
  std::string text = text_of(scene);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const auto loaded = read(text);
  return loaded ? "" : loaded.error().message;
}

TEST(SceneData, KeepsSharesOfEmission) {
  VoxelProperties type = textured_type();
  EXPECT_EQ(text_of([&] {
              Scene scene = scene_of(Grid());
              EXPECT_TRUE(scene.types.add(type));
              return scene;
            }())
                .find("emission_share"),
            std::string::npos)
      << "files without shares stay as they were";
  std::array<VoxelFace, 6> faces;
  for (const Direction direction : kDirections) faces[static_cast<std::size_t>(direction)] = type.faces[direction];
  faces[0].emission_share = 0;
  faces[4].emission_share = 254;
  type.faces = VoxelFaces(faces);
  type.emission = 2.0F;
  VoxelProperties post{.name = "post", .emission = 1.0F};
  ShapeElement element;
  element.faces[2].face = VoxelFace{.tint = {9, 9, 9}, .emission_share = 17};
  post.shapes = *VoxelShape::from_elements({element});
  Scene scene = scene_of(Grid());
  ASSERT_TRUE(scene.types.add(type));
  ASSERT_TRUE(scene.types.add(post));
  const std::string text = text_of(scene);
  EXPECT_NE(text.find("\"quoin_scene\": 11"), std::string::npos);
  const auto loaded = read(text);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  for (VoxelType i = 1; i < scene.types.size(); ++i) EXPECT_EQ(loaded->scene.types[i], scene.types[i]);
  for (const char* wrong : {"256", "-1", "0.5", "\"all\""}) {
    std::string changed = text;
    const std::string from = "\"emission_share\":254";
    changed.replace(changed.find(from), from.size(), std::string("\"emission_share\":") + wrong);
    const auto refused = read(changed);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_EQ(refused.error().message, "types[2].faces.sides[4].emission_share: must be a whole number from 0 to 255");
  }
  const TestFolder folder("scene_shares");
  ASSERT_TRUE(save_scene(scene, folder.file("a.quoin")));
  const auto world = load_scene(folder.file("a.quoin"));
  ASSERT_TRUE(world) << to_string(world.error());
  for (VoxelType i = 1; i < scene.types.size(); ++i) EXPECT_EQ(world->scene.types[i], scene.types[i]);
}

TEST(SceneData, RefusesInvalidTexturesWithTheirPosition) {
  const std::string faces = "types[0].faces";
  EXPECT_EQ(error_after("\"size\":32", "\"size\":31"),
            faces +
                ".textures[0]: cannot use texture \"frame\": its sides must be equal, and 16, 32, 64, 128, 256, 512 "
                "or 1024 texels long, not 31 x 31 texels");
  EXPECT_EQ(error_after("\"size\":32", "\"size\":64"),
            faces + ".textures[0].texels: must have 3 or 4 bytes for each of the 64 x 64 texels, not 3072 bytes");
  EXPECT_EQ(error_after("\"size\":32", "\"size\":-1"),
            faces + ".textures[0].size: must be a whole number from 0 to 1024");
  EXPECT_EQ(error_after("\"size\":32,", ""), faces + ".textures[0]: \"size\" is missing");
  EXPECT_EQ(error_after("\"texels\":\"", "\"texels\":\"*"),
            faces + ".textures[0].texels: the base64 text is cut off: its length is not a multiple of 4");
  EXPECT_EQ(error_after("\"texture\":1", "\"texture\":2"),
            faces + ".sides[3].texture: must be an index into textures, from 0");
  EXPECT_EQ(error_after("\"turn\":3", "\"turn\":4"), faces + ".sides[0].turn: must be a whole number from 0 to 3");
  EXPECT_EQ(error_after("\"tint\":[1,2,3,255]", "\"tint\":[1,2,3]"),
            faces + ".sides[2].tint: must be a list of 4 numbers");
  EXPECT_EQ(error_after("\"alpha\":\"cutout\"", "\"alpha\":\"no\""),
            faces + ".sides[3].alpha: must be one of opaque, cutout, translucent");
  EXPECT_EQ(error_after("{\"texture\":0,\"turn\":3},", ""), faces + ".sides: must be a list of 6 faces");
  EXPECT_EQ(
      error_after("\"visibility\":\"transparent\"", "\"visibility\":\"opaque\""),
      faces + ": cannot use voxel type \"window\": faces: the face -Y is not opaque, which needs a transparent type");
  EXPECT_EQ(error_after(",\"alpha\":\"translucent\"", ""),
            faces +
                ": cannot use voxel type \"window\": faces: the face +Z is opaque, but its texture \"pane \xff\" has "
                "transparent texels");
}

// A pane with all that shapes can have, also textures that its faces do not have.
VoxelProperties shaped_type() {
  VoxelProperties type = textured_type();
  type.name = "pane";
  type.state_bits = 5;
  type.orientations = StateOrientations::to_directions(2);
  type.orientations.front = Direction::NegZ;
  type.field_textures = {.voxels = 4.0F, .flat_degrees = 20.0F, .steep_degrees = 30.5F};
  const Texture knob = random_texture("knob", 16, 7, false);
  ShapeElement tilted{.min = Vec3(-15.5F, 0.1F, 3.0F), .max = Vec3(24.0F, 1.0F / 3.0F, 3.0F), .collides = false};
  tilted.turn = ElementTurn{.origin = Vec3(1.0F, 2.5F, -3.0F), .axis = 2, .degrees = 22.5F, .rescales = true};
  tilted.faces[0].is_drawn = false;
  tilted.faces[1].face = VoxelFace{.texture = knob, .turn = 2, .tint = {9, 8, 7, 255}};
  tilted.faces[1].part = {16.0F, 0.5F, 0.0F, 1e-3F};
  tilted.faces[3].face = type.faces[Direction::NegY];
  tilted.faces[4].face = VoxelFace{.tint = {1, 2, 3, 255}, .alpha = FaceAlpha::Translucent};
  ShapePart bar{.shape = *VoxelShape::from_elements({ShapeElement{}, tilted}), .orientation = AxisOrientation::at(29)};
  bar.when = {{.state_mask = 3, .state = 2, .connected = {Direction::NegX, Direction::PosZ}},
              {.unconnected = {Direction::PosY}, .corner = StairCorner::InnerLeft, .positions = {12, 3, 7}}};
  ShapeRules rules{.parts = {{.shape = VoxelShape::box({1, 2, 3}, {4, 5, 6})}, bar},
                   .neighbours = ShapeNeighbours::Connected,
                   .groups = 0xF000'0001U,
                   .connects_to_full_sides = false};
  rules.fluid = ContainedFluid{.groups = 32, .when = {{.state_mask = 16, .state = 16}, {.state_mask = 12}}};
  type.shapes = *VoxelShapes::from_rules(std::move(rules));
  return type;
}

TEST(SceneData, KeepsOrientationsAndShapes) {
  Scene scene = scene_of(Grid());
  ASSERT_TRUE(scene.types.add(textured_type()));
  ASSERT_TRUE(scene.types.add(shaped_type()));
  ASSERT_TRUE(scene.types.add(
      {.name = "log", .state_bits = 2, .blocks_light = false, .orientations = StateOrientations::along_axes()}));
  ASSERT_TRUE(scene.types.add({.name = "water",
                               .visibility = Visibility::Transparent,
                               .state_bits = 4,
                               .shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid})}));
  ASSERT_TRUE(scene.types.add({.name = "slab", .blocks_light = false, .shapes = VoxelShape::crossed_plates(12)}));
  const std::string text = text_of(scene);
  EXPECT_NE(text.find("\"quoin_scene\": 10"), std::string::npos);
  std::size_t textures = 0;
  for (std::size_t at = 0; (at = text.find("\"texels\"", at)) != std::string::npos; ++at) ++textures;
  EXPECT_EQ(textures, 3U) << "each texture once";
  const auto loaded = read(text);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->scene.types.size(), scene.types.size());
  for (VoxelType type = 1; type < scene.types.size(); ++type) {
    EXPECT_EQ(loaded->scene.types[type], scene.types[type]) << scene.types[type].name;
  }
  EXPECT_EQ(text_of(loaded->scene), text);
  TextureSet layers;
  layers.add(loaded->scene.types);
  EXPECT_TRUE(layers.find(random_texture("knob", 16, 7, false)));
  const TestFolder folder("scene_shapes");
  for (const char* name : {"a.json", "a.quoin"}) {
    const auto saved = save_scene(scene, folder.file(name));
    ASSERT_TRUE(saved) << to_string(saved.error());
    const auto again = load_scene(folder.file(name));
    ASSERT_TRUE(again) << to_string(again.error());
    ASSERT_EQ(again->scene.types.size(), scene.types.size());
    for (VoxelType type = 1; type < scene.types.size(); ++type) {
      EXPECT_EQ(again->scene.types[type], scene.types[type]) << name << " " << scene.types[type].name;
    }
  }
}

TEST(SceneData, OnlyNewPartsOfShapesNeedVersionTen) {
  const auto version_with = [](ShapeCondition when, std::optional<ContainedFluid> fluid) {
    Scene scene = scene_of(Grid());
    ShapeRules rules{.parts = {{.shape = VoxelShape::box({0, 0, 0}, {16, 8, 16}), .when = {std::move(when)}}}};
    rules.fluid = std::move(fluid);
    EXPECT_TRUE(scene.types.add({.name = "slab", .shapes = *VoxelShapes::from_rules(std::move(rules))}));
    const std::string text = text_of(scene);
    EXPECT_TRUE(read(text));
    const std::string key = "\"quoin_scene\": ";
    const std::size_t at = text.find(key) + key.size();
    return text.substr(at, text.find(',', at) - at);
  };
  const ShapeCondition to_east{.connected = {Direction::PosX}};
  EXPECT_EQ(version_with(to_east, {}), "9");
  EXPECT_EQ(version_with({.positions = {4, 0, 1}}, {}), "10");
  EXPECT_EQ(version_with(to_east, ContainedFluid{.groups = 2}), "10");
}

TEST(SceneData, RefusesInvalidShapesWithTheirPosition) {
  Scene scene;
  ASSERT_TRUE(scene.types.add(shaped_type()));
  const std::string text = text_of(scene);
  const auto error_with = [&](const std::string& wanted, const std::string& instead) {
    std::string other = text;
    const std::size_t at = other.find(wanted);
    EXPECT_NE(at, std::string::npos) << wanted;
    if (at != std::string::npos) other.replace(at, wanted.size(), instead);
    const auto loaded = read(other);
    return loaded ? "" : loaded.error().message;
  };
  const std::string shapes = "types[0].shapes";
  const std::string element = shapes + ".parts[1].elements[1]";
  EXPECT_EQ(error_with("\"name\"", "\"name\""), "");
  EXPECT_EQ(error_with("\"connected\",", "\"beside\","),
            shapes + ".neighbours: must be one of none, connected, stairs, fluid");
  EXPECT_EQ(error_with("\"groups\":4026531841", "\"groups\":-1"),
            shapes + ".groups: must be a whole number from 0 to 4294967295");
  EXPECT_EQ(error_with("\"fluid\":{\"groups\":32", "\"fluid\":{\"groups\":0"),
            shapes + ": cannot use the shapes of a type: the fluid that voxels contain has no group");
  EXPECT_EQ(error_with("\"fluid\":{\"groups\":32", "\"fluid\":{\"groups\":48"),
            shapes + ": cannot use the shapes of a type: the fluid that voxels contain has more than one group");
  EXPECT_EQ(error_with("\"fluid\":{\"groups\":32,", "\"fluid\":{"), shapes + ".fluid: \"groups\" is missing");
  EXPECT_EQ(error_with("\"state_mask\":12", "\"connected\":[\"+X\"]"),
            shapes + ": cannot use the shapes of a type: the fluid that voxels contain depends on neighbours");
  EXPECT_EQ(error_with("\"orientation\":29", "\"orientation\":48"),
            shapes + ".parts[1].orientation: must be a whole number from 0 to 47");
  EXPECT_EQ(error_with("\"+Z\"", "\"up\""),
            shapes + ".parts[1].when[0].connected[1]: must be one of +X, -X, +Y, -Y, +Z, -Z");
  EXPECT_EQ(
      error_with("\"inner_left\"", "\"left\""),
      shapes + ".parts[1].when[1].corner: must be one of straight, outer_left, outer_right, inner_left, inner_right");
  const std::string condition = shapes + ".parts[1].when[1]";
  EXPECT_EQ(error_with("[12,3,7]", "[12,3,7]"), "");
  EXPECT_EQ(error_with("[12,3,7]", "[0,3,7]"), condition + ".positions: the count must be at least 1");
  EXPECT_EQ(error_with("[12,3,7]", "[12,7,7]"),
            shapes + ": cannot use the shapes of a type: a share of positions is empty");
  for (const char* const wrong : {"[12,3]", "[12,3,-7]", "[4097,3,7]", "[12,3,7.5]", "7"}) {
    EXPECT_TRUE(error_with("[12,3,7]", wrong).starts_with(condition + ".positions")) << wrong;
  }
  EXPECT_EQ(error_with("\"degrees\":22.5", "\"degrees\":1e300"), element + ".turn.degrees: is too large");
  EXPECT_EQ(error_with("\"axis\":2", "\"axis\":3"), element + ".turn.axis: must be a whole number from 0 to 2");
  EXPECT_EQ(error_with("[-15.5,", "[-17,"), shapes +
                                                ".parts[1].elements: cannot use element 1 of a shape: a corner is "
                                                "outside -16 to 32 sixteenths");
  EXPECT_EQ(error_with("{\"drawn\":false},", ""), element + ".faces: must be a list of 6 faces");
  EXPECT_EQ(error_with("\"texture\":2,\"turn\":2", "\"texture\":3,\"turn\":2"),
            element + ".faces[1].face.texture: must be an index into textures, from 0");
  EXPECT_EQ(error_with("\"elements\"", "\"boxes\""), shapes + ".parts[0]: \"boxes\" is unknown here");
  EXPECT_EQ(error_with("\"by_value\":[", "\"by_value\":[99,"),
            "types[0].orientations.by_value[0]: must be the number of an orientation, 0 to 47");
  EXPECT_EQ(error_with("\"front\":\"-Z\"", "\"front\":2"),
            "types[0].orientations.front: must be one of +X, -X, +Y, -Y, +Z, -Z");
  EXPECT_EQ(
      error_with("\"steep_degrees\":30.5", "\"steep_degrees\":10"),
      shapes + ": cannot use voxel type \"pane\": field_textures: slopes must be 0 <= flat < steep <= 90 degrees");
  EXPECT_EQ(error_with("\"state_bits\":5", "\"state_bits\":2"),
            shapes +
                ": cannot use voxel type \"pane\": orientations: they use bits of the state that `state_bits` does "
                "not declare");
  std::string many = "[";
  for (int i = 0; i < 200; ++i) many += i == 0 ? "{}" : ",{}";
  EXPECT_EQ(error_with("\"elements\":[", "\"elements\":" + many + "],\"rest\":["),
            shapes + ".parts[0]: \"rest\" is unknown here");
  EXPECT_EQ(error_with("\"elements\":[{", "\"elements\":" + many + ",{"),
            shapes + ".parts[0].elements: has more than 128 entries");
}

TEST(SceneData, RejectsMoreThan32StateBits) {
  std::string text = text_of(scene_of(Grid()));
  const std::string wanted = "\"state_bits\":2";
  const std::size_t place = text.find(wanted);
  ASSERT_NE(place, std::string::npos);
  for (const char* bits : {"33", "-1", "1.5", "\"2\""}) {
    std::string other = text;
    other.replace(place, wanted.size(), std::string("\"state_bits\":") + bits);
    const auto loaded = read(other);
    ASSERT_FALSE(loaded);
    EXPECT_EQ(loaded.error().message, "types[1].state_bits: must be a whole number from 0 to 32");
  }
  VoxelRegistry types;
  EXPECT_FALSE(types.add({.name = "much", .colour = {}, .state_bits = 33}));
}

}  // namespace
}  // namespace quoin

#include <quoin/io/scene_file.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "core/bytes/text.h"
#include "core/work/nightly_for_tests.h"
#include "io/byte_stream.h"
#include "io/gltf/glb_for_tests.h"
#include "io/scene_file/voxel_data.h"

// Scene files that contain their models.

namespace quoin {
namespace {

class RandomScene {
 public:
  explicit RandomScene(unsigned seed) : random_(seed) {}

  Scene scene() {
    Scene scene;
    const int types = 1 + below(below(4) == 0 ? 3'000 : 40);
    for (int i = 0; i < types; ++i) EXPECT_TRUE(scene.types.add(properties()));
    std::vector<GridHandle> grids;
    for (int i = below(4); i >= 0; --i) grids.push_back(scene.add_grid(grid(types)));
    if (grids.size() > 2) {  // handles must differ from list positions
      scene.remove_grid(grids[1]);
      grids.erase(grids.begin() + 1);
    }
    add_hierarchy(scene);
    for (int i = below(9); i > 0; --i) {
      Instance made = instance(grids[static_cast<std::size_t>(below(grids.size()))]);
      made.group = any(scene.groups());
      made.layer = any(scene.layers());
      scene.add_instance(made);
    }
    for (int i = is_rare() ? 3 : 0; i > 0; --i) scene.lamps.push_back(lamp());
    return scene;
  }

 private:
  template <class Count>
  int below(Count count) {
    return static_cast<int>(random_() % static_cast<unsigned>(count));
  }
  bool is_rare() { return below(4) == 0; }

  // Numbers of every size, and -0.
  double number() {
    std::normal_distribution<double> normal;
    const double value = normal(random_) * std::pow(10.0, below(40) - 20);
    return below(12) == 0 ? std::copysign(0.0, value) : value;
  }
  std::string text() {
    const std::vector<std::string> texts = {
        "", "hull", "a \"b\"\\\n", "\xC3\xA9\xE6\x97\xA5", "\xFF\xFE", std::string("\0x", 2)};
    return texts[static_cast<std::size_t>(below(texts.size()))];
  }
  template <class T>
  Handle<T> any(const SlotMap<T>& all) {
    if (all.empty() || is_rare()) return {};
    return all.handles()[static_cast<std::size_t>(below(all.size()))];
  }
  void add_hierarchy(Scene& scene) {
    if (is_rare()) return;  // imitates files of earlier versions
    for (int i = below(4); i > 0; --i) scene.add_layer({text(), !is_rare()});
    for (int i = below(6); i > 0; --i) {
      SceneGroup group;
      group.name = text();
      group.parent = any(scene.groups());
      group.layer = any(scene.layers());
      if (!is_rare()) group.position = {number(), number(), number()};
      if (!is_rare()) group.rotation = DQuat(number(), number(), number(), number());
      group.mirrored = is_rare();
      group.visible = !is_rare();
      scene.add_group(group);
    }
  }
  VoxelProperties properties() {
    VoxelProperties made;
    made.name = text();
    const auto channel = [this] { return static_cast<std::uint8_t>(below(256)); };
    made.colour = {channel(), channel(), channel(), channel()};
    if (is_rare()) made.visibility = Visibility::Transparent;
    made.collides = !is_rare();
    if (is_rare()) made.roughness = static_cast<float>(below(1000)) / 999.0F;
    if (is_rare()) made.metalness = 0.1F;
    if (is_rare()) made.emission = std::numeric_limits<float>::denorm_min();
    if (is_rare()) made.ior = 1.0F / 3.0F;
    for (int i = is_rare() ? 3 : 0; i > 0; --i) made.attributes[text()] = text();
    return made;
  }
  SceneGrid grid(int types) {
    SceneGrid made;
    made.name = text();
    if (is_rare()) made.pivot = {number(), number(), number()};
    if (is_rare()) made.canvas = {{-below(300), 5, below(9)}, {below(300), -5, std::numeric_limits<int>::max()}};
    const auto type = [&] { return static_cast<VoxelType>(below(types + 1)); };
    const auto place = [&] { return IVec3(below(200), below(200), below(200)) - 100; };
    for (int i = below(6); i > 0; --i) {
      const IVec3 corner = place();
      made.grid.fill_box({corner, corner + place() / 2}, type());
    }
    for (int i = below(2'000); i > 0; --i) made.grid.set(place(), type());
    if (is_rare()) made.grid.set(IVec3(std::numeric_limits<int>::max() - 64), 1);
    if (is_rare()) made.grid.set(IVec3(std::numeric_limits<int>::min() + 64), 1);
    return made;
  }
  Lamp lamp() {
    Lamp made;
    made.name = text();
    if (is_rare()) made.kind = Lamp::Kind::Spot;
    made.position = {number(), number(), number()};
    if (is_rare()) made.direction = {number(), number(), number()};
    made.colour = {0.1F, 1.0F / 3.0F, static_cast<float>(below(9))};
    made.intensity = number();
    if (is_rare()) made.range = number();
    if (is_rare()) made.inner_angle_radians = number();
    if (is_rare()) made.outer_angle_radians = number();
    return made;
  }
  Instance instance(GridHandle grid) {
    Instance made;
    made.name = text();
    made.grid = grid;
    if (!is_rare()) made.position = {number(), number(), number()};
    if (!is_rare()) made.rotation = DQuat(number(), number(), number(), number());
    if (!is_rare()) made.voxel_size = std::abs(number()) + 1e-300;
    made.mirrored = is_rare();
    made.visible = !is_rare();
    if (is_rare()) made.categories = static_cast<std::uint32_t>(random_());
    return made;
  }

  std::mt19937 random_;
};

std::uint64_t bits(double value) {
  return std::bit_cast<std::uint64_t>(value);
}
template <class V>
std::vector<std::uint64_t> bits_of(const V& v, int count) {
  std::vector<std::uint64_t> all;
  for (int i = 0; i < count; ++i) all.push_back(bits(v[i]));
  return all;
}

void expect_equal(const Grid& a, const Grid& b) {
  ASSERT_EQ(a.chunks(), b.chunks());
  for (const IVec3 chunk : a.chunks()) EXPECT_TRUE(*a.find_chunk(chunk) == *b.find_chunk(chunk));
}

template <class T>
std::ptrdiff_t place_of(const std::vector<Handle<T>>& all, Handle<T> handle) {
  return std::find(all.begin(), all.end(), handle) - all.begin();
}

void expect_equal_hierarchy(const Scene& a, const Scene& b) {
  const auto layers_a = a.layers().handles();
  const auto layers_b = b.layers().handles();
  ASSERT_EQ(layers_a.size(), layers_b.size());
  for (std::size_t i = 0; i < layers_a.size(); ++i) {
    EXPECT_EQ(a.layers()[layers_a[i]].name, b.layers()[layers_b[i]].name);
    EXPECT_EQ(a.layers()[layers_a[i]].visible, b.layers()[layers_b[i]].visible);
  }
  const auto groups_a = groups_from_top(a);
  const auto groups_b = groups_from_top(b);
  ASSERT_EQ(groups_a.size(), groups_b.size());
  for (std::size_t i = 0; i < groups_a.size(); ++i) {
    const SceneGroup& group = a.groups()[groups_a[i]];
    const SceneGroup& other = b.groups()[groups_b[i]];
    EXPECT_EQ(group.name, other.name);
    EXPECT_EQ(place_of(groups_a, group.parent), place_of(groups_b, other.parent));
    EXPECT_EQ(place_of(layers_a, group.layer), place_of(layers_b, other.layer));
    EXPECT_EQ(bits_of(group.position, 3), bits_of(other.position, 3));
    EXPECT_EQ(bits_of(group.rotation, 4), bits_of(other.rotation, 4));
    EXPECT_EQ(group.mirrored, other.mirrored);
    EXPECT_EQ(group.visible, other.visible);
  }
}

// Expects equality to the last bit, independent of handles.
void expect_equal(const Scene& a, const Scene& b) {
  ASSERT_EQ(a.types.size(), b.types.size());
  for (std::size_t i = 0; i < a.types.size(); ++i) {
    EXPECT_EQ(a.types[static_cast<VoxelType>(i)], b.types[static_cast<VoxelType>(i)]);
  }
  EXPECT_EQ(a.lamps, b.lamps);
  const auto grids_a = a.grids().handles();
  const auto grids_b = b.grids().handles();
  ASSERT_EQ(grids_a.size(), grids_b.size());
  for (std::size_t i = 0; i < grids_a.size(); ++i) {
    const SceneGrid& grid = a.grids()[grids_a[i]];
    const SceneGrid& other = b.grids()[grids_b[i]];
    EXPECT_EQ(grid.name, other.name);
    EXPECT_EQ(grid.canvas, other.canvas);
    EXPECT_EQ(bits_of(grid.pivot, 3), bits_of(other.pivot, 3));
    expect_equal(grid.grid, other.grid);
  }
  const auto places_a = a.instances().handles();
  const auto places_b = b.instances().handles();
  ASSERT_EQ(places_a.size(), places_b.size());
  for (std::size_t i = 0; i < places_a.size(); ++i) {
    const Instance& instance = a.instances()[places_a[i]];
    const Instance& other = b.instances()[places_b[i]];
    EXPECT_EQ(instance.name, other.name);
    const auto index = [](const std::vector<GridHandle>& grids, GridHandle grid) {
      return std::find(grids.begin(), grids.end(), grid) - grids.begin();
    };
    EXPECT_EQ(index(grids_a, instance.grid), index(grids_b, other.grid));
    EXPECT_EQ(bits_of(instance.position, 3), bits_of(other.position, 3));
    EXPECT_EQ(bits_of(instance.rotation, 4), bits_of(other.rotation, 4));
    EXPECT_EQ(bits(instance.voxel_size), bits(other.voxel_size));
    EXPECT_EQ(instance.mirrored, other.mirrored);
    EXPECT_EQ(instance.visible, other.visible);
    EXPECT_EQ(instance.categories, other.categories);
    EXPECT_EQ(place_of(groups_from_top(a), instance.group), place_of(groups_from_top(b), other.group));
    EXPECT_EQ(place_of(a.layers().handles(), instance.layer), place_of(b.layers().handles(), other.layer));
  }
  expect_equal_hierarchy(a, b);
}

std::vector<std::byte> written(const Scene& scene, Threads threads = {}) {
  const auto file = scene_file_of(scene);
  EXPECT_TRUE(file);
  auto bytes = write_scene_file(*file, threads);
  EXPECT_TRUE(bytes) << to_string(bytes.error());
  return bytes ? std::move(*bytes) : std::vector<std::byte>();
}

TEST(SceneModels, RoundTripsAnySceneExactly) {
  for (unsigned seed = 0; seed < static_cast<unsigned>(cases(10, 30)); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Scene scene = RandomScene(seed).scene();
    const auto bytes = written(scene);
    EXPECT_EQ(detect_format(bytes), FileFormat::Scene);
    const auto read = load_scene(bytes);
    ASSERT_TRUE(read) << to_string(read.error());
    expect_equal(scene, read->scene);
    EXPECT_EQ(written(read->scene, Threads{1}), bytes) << "and is written as the same bytes by any number of threads";
  }
}

TEST(SceneModels, RoundTripsChunksOfEveryWidth) {
  Scene scene;
  for (int i = 0; i < 65'535; ++i) {
    VoxelProperties properties;
    ASSERT_TRUE(scene.types.add(properties));
  }
  std::mt19937 random(4);
  for (const unsigned types : {1U, 2U, 3U, 4U, 5U, 16U, 17U, 256U, 257U, 65'536U}) {
    SceneGrid grid;
    grid.grid.edit({IVec3{0}, IVec3{64}}, [&](IVec3, VoxelType) { return static_cast<VoxelType>(random() % types); });
    // All types of a palette except one, so that no position holds an index beyond the palette.
    grid.grid.edit({{64, 0, 0}, IVec3{128, 64, 64}},
                   [&](IVec3 v, VoxelType) { return static_cast<VoxelType>(v.y < 4 ? random() % types : types - 1); });
    scene.add_grid(std::move(grid));
  }
  const auto read = load_scene(written(scene));
  ASSERT_TRUE(read) << to_string(read.error());
  expect_equal(scene, read->scene);
}

// The reader refuses data that compresses too well, so the writer stores it uncompressed.
TEST(SceneModels, StoresHighlyRegularVoxelsUncompressed) {
  Scene scene;
  ASSERT_TRUE(scene.types.add({}));
  SceneGrid grid;
  constexpr int kChunks = 320;
  for (int i = 0; i < kChunks * kChunks; ++i) grid.grid.put_chunk({i % kChunks, 0, i / kChunks}, Chunk(1));
  scene.add_grid(std::move(grid));
  const auto bytes = written(scene);
  EXPECT_GT(bytes.size(), std::size_t{kChunks} * kChunks * 18) << "18 bytes per chunk";
  const auto read = load_scene(bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  expect_equal(scene, read->scene);
}

TEST(SceneModels, CombinesWithModelFiles) {
  const TestFolder folder("scene_models");
  const Scene ship = RandomScene(1).scene();
  Scene red;
  VoxelProperties properties;
  properties.colour = {200, 0, 0, 255};
  ASSERT_TRUE(red.types.add(properties));
  SceneGrid cube;
  cube.grid.set({0, 0, 0}, 1);
  const GridHandle handle = red.add_grid(std::move(cube));
  red.add_instance({.name = "", .grid = handle});
  ASSERT_TRUE(save_scene(red, folder.file("red.vox")));
  auto file = scene_file_of(ship).value();
  file.sources.push_back({"r", "red.vox"});
  SceneFile::Placement placement;
  placement.source = "r";
  file.placements.insert(file.placements.begin(), placement);
  ASSERT_TRUE(write_scene_file(file, folder.file("both.json")));
  const auto read = load_scene(folder.file("both.json"));
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_FALSE(read->named_files.empty());
  EXPECT_EQ(read->scene.grids().size(), ship.grids().size() + 1);
  EXPECT_EQ(read->scene.instances().size(), ship.instances().size() + 1);
  const Instance& first = read->scene.instances()[read->scene.instances().handles()[0]];
  EXPECT_EQ(first.grid, read->scene.grids().handles().back());
  const auto bytes = read_file(folder.file("both.json"));
  ASSERT_TRUE(bytes);
  const auto alone = load_scene(*bytes);
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().message, "the scene file references other files; load it by path, not from bytes");
}

TEST(SceneModels, RefusesScenesThatNoFileCanHold) {
  const auto fault = [](auto change) {
    Scene scene;
    EXPECT_TRUE(scene.types.add({}));
    SceneGrid grid;
    grid.grid.set({0, 0, 0}, 1);
    Instance instance;
    instance.name = "ship";
    instance.grid = scene.add_grid(std::move(grid));
    const InstanceHandle handle = scene.add_instance(instance);
    change(scene, scene.edit(handle));
    const auto file = scene_file_of(scene);
    if (!file) return to_string(file.error());
    const auto bytes = write_scene_file(*file);
    return bytes ? std::string("none") : to_string(bytes.error());
  };
  EXPECT_EQ(fault([](Scene&, Instance&) {}), "none");
  EXPECT_EQ(fault([](Scene&, Instance& i) { i.position.y = NAN; }), "instances[0].position[1]: must be a number");
  EXPECT_EQ(fault([](Scene&, Instance& i) { i.rotation.w = INFINITY; }), "instances[0].rotation[3]: must be a number");
  EXPECT_EQ(fault([](Scene&, Instance& i) { i.voxel_size = 0; }), "instances[0].scale: must be more than 0");
  EXPECT_EQ(fault([](Scene&, Instance& i) { i.grid = {}; }), "instance \"ship\" refers to a grid that does not exist");
  EXPECT_EQ(fault([](Scene& s, Instance& i) {
              s.edit(i.grid).grid.set({1, 0, 0}, 7);
            }),
            "grids[0] has voxels of type 7, which is not registered");
}

std::string file_with_voxels(const std::string& voxels) {
  return R"({"quoin_scene": 2, "types": [{"colour": [1, 2, 3, 255]}], "grids": [{"voxels": [)" + voxels +
         R"(]}], "instances": [{"grid": 0}]})";
}

std::string find_scene_error(const std::string& text) {
  const auto read = load_scene(std::as_bytes(std::span(text)));
  return read ? "none" : to_string(read.error());
}

/// Returns the error for a file whose only voxel piece has these numbers, 16 bits each.
std::string find_piece_error(std::vector<std::uint16_t> words, std::size_t cut = 0) {
  std::vector<std::byte> bytes;
  for (const std::uint16_t word : words) {
    bytes.push_back(static_cast<std::byte>(word));
    bytes.push_back(static_cast<std::byte>(word >> 8));
  }
  bytes.resize(bytes.size() - cut);
  return find_scene_error(file_with_voxels("\"" + to_base64(gzipped(bytes, 9)) + "\""));
}

TEST(SceneModels, ReportsPositionOfDamagedVoxels) {
  const std::string at = "grids[0].voxels[0]: ";
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3, 0, 1, 0, 1}), "none");
  EXPECT_EQ(find_piece_error({}), "none");
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3, 0, 1, 0, 1}, 1), at + "byte 17 of the voxel data: cut off");
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3}), at + "byte 10 of the voxel data: cut off");
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3, 0, 1, 0, 2}),
            at + "byte 16 of the voxel data: type 2, but the last type of the file is 1");
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3, 0, 0, 0}), at + "byte 12 of the voxel data: invalid palette size 0");
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3, 0, 1, 1}), at + "byte 12 of the voxel data: invalid palette size 65537");
  EXPECT_EQ(find_piece_error({0xFFFF, 0x7FFF, 2, 0, 3, 0, 1, 0, 1}),
            at + "byte 0 of the voxel data: a chunk position is out of range");
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3, 0, 1, 0, 0}), at + "chunk (1, 2, 3) is empty");
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3, 0, 1, 0, 1, 1, 0, 2, 0, 3, 0, 1, 0, 1}),
            at + "chunk (1, 2, 3) is a duplicate");
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3, 0, 2, 0, 0, 1, 2, 0}),
            at + "byte 20 of the voxel data: index 2 is beyond the palette of 2");
  EXPECT_EQ(find_piece_error({1, 0, 2, 0, 3, 0, 2, 0, 0, 1, 0xFFFF, 0xFFFF, 1, 2, 3}),
            at + "byte 30 of the voxel data: cut off");
}

TEST(SceneModels, ReportsPositionOfInvalidLamps) {
  const auto fault = [](const std::string& lamp) {
    return find_scene_error(R"({"quoin_scene": 2, "grids": [], "instances": [], "lamps": [)" + lamp + "]}");
  };
  EXPECT_EQ(fault(R"({"position": [1, 2, 3]})"), "none");
  EXPECT_EQ(fault("{}"), "lamps[0]: \"position\" is missing");
  EXPECT_EQ(fault(R"({"position": [1, 2, 3], "kind": "sun"})"), "lamps[0].kind: must be point or spot");
  EXPECT_EQ(fault(R"({"position": [1, 2, 3], "colour": [1, 1e39, 0]})"), "lamps[0].colour: is too large");
  EXPECT_EQ(fault(R"({"position": [1, 2]})"), "lamps[0].position: must be a list of 3 numbers");
}

TEST(SceneModels, ReportsPositionOfDamagedText) {
  const std::string at = "grids[0].voxels[0]: ";
  EXPECT_EQ(find_scene_error(file_with_voxels("")), "none");
  EXPECT_EQ(find_scene_error(file_with_voxels("7")), at + "must be a string");
  EXPECT_EQ(find_scene_error(file_with_voxels("\"A*==\"")), at + "character 1: not a base64 character");
  EXPECT_EQ(find_scene_error(file_with_voxels("\"\"")), at + "not a gzip stream");
  EXPECT_EQ(find_scene_error(file_with_voxels("\"AAAA\"")), at + "not a gzip stream");
  std::vector<std::byte> piece = gzipped(std::vector<std::byte>(100), 9);
  const auto fault = [&] { return find_scene_error(file_with_voxels("\"" + to_base64(piece) + "\"")); };
  piece.push_back({});
  EXPECT_EQ(fault(), at + "bytes follow the compressed data");
  piece.resize(piece.size() - 3);
  EXPECT_NE(fault().find("the compressed data is cut off"), std::string::npos) << fault();
  piece[12] ^= std::byte{0xFF};
  EXPECT_NE(fault().find(at + "byte "), std::string::npos) << fault();
  EXPECT_NE(fault().find("the compressed data is damaged"), std::string::npos) << fault();
  EXPECT_EQ(find_scene_error(R"({"quoin_scene": 2, "grids": [], "instances": [{"grid": 0}]})"),
            "instances[0].grid: grid 0 does not exist");
  EXPECT_EQ(find_scene_error(R"({"quoin_scene": 2, "grids": [], "instances": [{"grid": -1}]})"),
            "instances[0].grid: must be an index into grids, from 0");
  EXPECT_EQ(
      find_scene_error(R"({"quoin_scene": 2, "types": [{"colour": [1, 2, 3, 256]}], "grids": [], "instances": []})"),
      "types[0].colour: must be whole numbers from 0 to 255");
  EXPECT_EQ(
      find_scene_error(R"({"quoin_scene": 2, "types": [{"colour": [1, 2, 3, 4], "visibility": "air"}], "grids": [],
                         "instances": []})"),
      "types[0].visibility: must be \"opaque\" or \"transparent\"");
  EXPECT_EQ(find_scene_error(R"({"quoin_scene": 2, "types": [{"colour": [1, 2, 3, 4], "ior": 1e39}], "grids": [],
                         "instances": []})"),
            "types[0].ior: is too large");
  EXPECT_EQ(
      find_scene_error(R"({"quoin_scene": 2, "grids": [{"name": {"base64": "*"}, "voxels": []}], "instances": []})"),
      "grids[0].name: must be a string, or {\"base64\": \"...\"} if it is not UTF-8");
}

// Deflate can expand data to about a thousand times its size.
TEST(SceneModels, RefusesBombsBeforeExpansion) {
  const std::vector<std::byte> zeros(std::size_t{64} << 20);
  EXPECT_EQ(find_scene_error(file_with_voxels("\"" + to_base64(gzipped(zeros, 9)) + "\"")),
            "grids[0].voxels[0]: expands to more than 32 MiB");
  std::vector<std::byte> chunks;
  for (int i = 0; i < 100'000; ++i) {
    for (const int number : {i, 0, 0, 1}) {
      for (int byte = 0; byte < 4; ++byte) chunks.push_back(static_cast<std::byte>(number >> (8 * byte)));
    }
    chunks.push_back(std::byte{1});
    chunks.push_back(std::byte{0});
  }
  EXPECT_EQ(find_scene_error(file_with_voxels("\"" + to_base64(gzipped(chunks, 9)) + "\"")),
            "grids: the voxels need far more memory than the file has bytes");
}

}  // namespace
}  // namespace quoin

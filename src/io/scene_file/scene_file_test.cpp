#include <quoin/io/scene_file.h>

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <type_traits>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/vox.h>

namespace quoin {
namespace {

namespace fs = std::filesystem;

Result<SceneFile> parse(const std::string& text) {
  return parse_scene_file(std::as_bytes(std::span(text)));
}

std::string file_with(const std::string& instance) {
  return R"({"quoin_scene": 1, "files": [{"id": "a", "path": "a.vox"}], "instances": [)" + instance + "]}";
}

std::string find_error(const std::string& text) {
  const auto parsed = parse(text);
  return parsed ? "none" : to_string(parsed.error());
}

TEST(SceneFile, ReadsEveryKey) {
  std::ifstream in(fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "scene_file" / "all.json");
  const auto scene = parse(std::string(std::istreambuf_iterator<char>(in), {}));
  ASSERT_TRUE(scene) << to_string(scene.error());
  ASSERT_EQ(scene->placements.size(), 2U);
  const SceneFile::Placement& first = scene->placements[0];
  EXPECT_EQ(first.source, "a");
  EXPECT_EQ(first.instance.name, "n");
  EXPECT_EQ(first.instance.position, DVec3(1, 2, 3));
  EXPECT_EQ(first.instance.voxel_size, 0.5);
  EXPECT_TRUE(first.instance.mirrored);
  EXPECT_FALSE(first.instance.visible);
  EXPECT_NEAR(glm::length(first.instance.rotation * DVec3(0, 0, 1) - DVec3(0.5, 0, std::sqrt(0.75))), 0.0, 1e-12);
  EXPECT_NEAR(glm::length(scene->environment.value().sun.direction - glm::normalize(DVec3(1, 2, 3))), 0.0, 1e-15);
  EXPECT_EQ(scene->camera->position, DVec3(9));
}

TEST(SceneFile, RoundTripsRandomScenes) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1e6, 1e6);
  for (int seed = 0; seed < 50; ++seed) {
    SceneFile scene;
    for (int i = 0; i < seed % 5; ++i) scene.sources.push_back({"id " + std::to_string(i), "models/\"\xC3\xA9\".vox"});
    for (std::size_t i = 0; i < scene.sources.size() * 3; ++i) {
      SceneFile::Placement placement;
      placement.source = scene.sources[i % scene.sources.size()].id;
      Instance& instance = placement.instance;
      if (random() % 2 == 0) instance.name = "n\n" + std::to_string(i);
      if (random() % 2 == 0) instance.position = {number(random), number(random) * 1e-12, 0.1};
      if (random() % 2 == 0) {
        instance.rotation = glm::normalize(DQuat(number(random), number(random), number(random), number(random)));
      }
      if (random() % 2 == 0) instance.voxel_size = std::abs(number(random)) + 1e-9;
      instance.mirrored = random() % 2 == 0;
      instance.visible = random() % 2 == 0;
      placement.sets_categories = random() % 2 == 0;
      if (placement.sets_categories) instance.categories = static_cast<std::uint32_t>(random());
      scene.placements.push_back(placement);
    }
    if (seed % 2 == 0) {
      scene.environment = Environment::natural(glm::normalize(DVec3(number(random), number(random), number(random))));
    }
    if (seed % 3 == 0) scene.camera = look_at({number(random), 4, 5}, {number(random), 7, 8}, 0.8).value();
    const auto bytes = write_scene_file(scene);
    ASSERT_TRUE(bytes) << to_string(bytes.error());
    EXPECT_EQ(detect_format(*bytes), FileFormat::Scene);
    const auto read = parse_scene_file(*bytes);
    ASSERT_TRUE(read) << to_string(read.error());
    ASSERT_EQ(read->sources.size(), scene.sources.size());
    for (std::size_t i = 0; i < scene.sources.size(); ++i) {
      EXPECT_EQ(read->sources[i].id, scene.sources[i].id);
      EXPECT_EQ(read->sources[i].file, scene.sources[i].file);
    }
    ASSERT_EQ(read->placements.size(), scene.placements.size());
    for (std::size_t i = 0; i < scene.placements.size(); ++i) {
      EXPECT_EQ(read->placements[i].source, scene.placements[i].source);
      EXPECT_EQ(read->placements[i].sets_categories, scene.placements[i].sets_categories);
      const Instance& a = scene.placements[i].instance;
      const Instance& b = read->placements[i].instance;
      EXPECT_EQ(b.name, a.name);
      EXPECT_EQ(b.position, a.position);
      EXPECT_EQ(b.rotation, a.rotation);
      EXPECT_EQ(b.voxel_size, a.voxel_size);
      EXPECT_EQ(b.mirrored, a.mirrored);
      EXPECT_EQ(b.visible, a.visible);
      EXPECT_EQ(b.categories, a.categories);
    }
    ASSERT_EQ(read->environment.has_value(), scene.environment.has_value());
    if (scene.environment) {
      EXPECT_EQ(read->environment->sun.direction, scene.environment->sun.direction);
    }
    ASSERT_EQ(read->camera.has_value(), scene.camera.has_value());
    if (scene.camera) {
      EXPECT_EQ(read->camera->position, scene.camera->position);
      EXPECT_EQ(read->camera->forward, scene.camera->forward);
      EXPECT_EQ(read->camera->up, scene.camera->up);
      EXPECT_EQ(read->camera->right, scene.camera->right);
      EXPECT_EQ(read->camera->vertical_fov_radians, scene.camera->vertical_fov_radians);
    }
  }
}

TEST(SceneFile, HoldsCamerasOfEveryKind) {
  std::mt19937 random(8);
  std::normal_distribution<double> number;
  for (int i = 0; i < 30; ++i) {
    SceneFile scene;
    const DQuat turn = glm::normalize(DQuat(number(random), number(random), number(random), number(random)));
    Camera camera;
    camera.position = {number(random) * 1e9, number(random), number(random)};
    camera.right = turn * camera.right;
    camera.up = turn * camera.up;
    camera.forward = turn * camera.forward;
    if (i % 2 == 0) {
      camera.projection = Camera::Projection::Orthographic;
      camera.view_height = std::exp(number(random));
    } else {
      camera.vertical_fov_radians = 0.1 + std::abs(std::atan(number(random)));
    }
    scene.camera = camera;
    const auto bytes = write_scene_file(scene);
    ASSERT_TRUE(bytes) << to_string(bytes.error());
    const auto read = parse_scene_file(*bytes);
    ASSERT_TRUE(read) << to_string(read.error());
    EXPECT_EQ(read->camera->position, camera.position);
    EXPECT_EQ(read->camera->right, camera.right);
    EXPECT_EQ(read->camera->up, camera.up);
    EXPECT_EQ(read->camera->forward, camera.forward);
    EXPECT_EQ(read->camera->projection, camera.projection);
    EXPECT_EQ(read->camera->vertical_fov_radians, camera.vertical_fov_radians);
    EXPECT_EQ(read->camera->view_height, camera.view_height);
  }
}

TEST(SceneFile, ReadsOrRefusesCorpus) {
  int read = 0;
  int refused = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "scene_file")) {
    const auto bytes = read_file(entry.path());
    ASSERT_TRUE(bytes);
    const auto scene = parse_scene_file(*bytes);
    scene ? ++read : ++refused;
    if (!scene) {
      EXPECT_EQ(scene.error().message.find('\n'), std::string::npos) << entry.path();
    }
  }
  EXPECT_GE(read, 3);
  EXPECT_GE(refused, 4);
}

TEST(SceneFile, RefusesToWriteUnreadableScenes) {
  const auto code_of = [](const std::function<void(SceneFile&)>& change) {
    SceneFile scene;
    scene.sources = {{"a", "a.vox"}};
    scene.placements.emplace_back().source = "a";
    EXPECT_TRUE(write_scene_file(scene));
    change(scene);
    const auto written = write_scene_file(scene);
    return written ? std::optional<ErrorCode>() : written.error().code;
  };
  EXPECT_EQ(code_of([](SceneFile& s) { s.placements[0].source = "b"; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_of([](SceneFile& s) { s.sources.push_back(s.sources[0]); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_of([](SceneFile& s) { s.placements[0].instance.position.y = NAN; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_of([](SceneFile& s) { s.placements[0].instance.voxel_size = 0.0; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_of([](SceneFile& s) {
              s.placements[0].instance.rotation = {0, 0, 0, 0};
            }),
            ErrorCode::InvalidArgument);
  EXPECT_EQ(code_of([](SceneFile& s) { s.sources[0].file = "\xFF"; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_of([](SceneFile& s) { s.placements[0].grid = 0; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_of([](SceneFile& s) { s.sources[0].file.clear(); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_of([](SceneFile& s) {
              s.camera = look_at({0, 0, 5}, {0, 0, 0}, 1.0).value();
              s.camera->vertical_fov_radians = 4.0;
            }),
            ErrorCode::InvalidArgument);
  EXPECT_EQ(code_of([](SceneFile& s) {
              s.camera = look_at({0, 0, 5}, {0, 0, 0}, 1.0).value();
              std::swap(s.camera->right, s.camera->up);
            }),
            ErrorCode::InvalidArgument)
      << "a left-handed one";
}

TEST(SceneFile, ErrorsHaveAPosition) {
  EXPECT_EQ(find_error("{"), "byte 1: not valid JSON");
  EXPECT_EQ(find_error(file_with(R"({"file": "a", "rotation": [1, 2, 3]})")),
            "instances[0].rotation: must be a list of 4 numbers");
  EXPECT_EQ(find_error(file_with(R"({"file": "a", "rotation": [0, 0, 0, 0]})")),
            "instances[0].rotation: must not be all 0");
  EXPECT_EQ(find_error(file_with(R"({"file": "a"}, {"file": "b"})")), "instances[1].file: no file has the id \"b\"");
  EXPECT_EQ(find_error(file_with(R"({"file": "a", "colour": 3})")), "instances[0]: \"colour\" is unknown here");
  EXPECT_EQ(find_error(file_with(R"({"position": [1, 2, 3]})")), "instances[0]: \"file\" is missing");
  EXPECT_EQ(find_error(file_with(R"({"file": "a", "scale": 0})")), "instances[0].scale: must be more than 0");
  EXPECT_EQ(find_error(file_with(R"({"file": "a", "position": [1, "2", 3]})")),
            "instances[0].position[1]: must be a number");
  for (const char* wrong : {"-1", "4294967296", "1.5", "\"1\""}) {
    EXPECT_EQ(find_error(file_with(std::string(R"({"file": "a", "categories": )") + wrong + "}")),
              "instances[0].categories: must be a whole number from 0 to 4294967295");
  }
  EXPECT_EQ(find_error(file_with(R"({"file": "a", "visible": 1})")), "instances[0].visible: must be true or false");
  EXPECT_EQ(find_error(file_with("7")), "instances[0]: must be an object");
  EXPECT_EQ(find_error(R"({"quoin_scene": 12, "files": [], "instances": []})"),
            "quoin_scene: version 12 is not supported (1 to 11 are)");
  EXPECT_EQ(find_error(R"({"quoin_scene": 0, "files": [], "instances": []})"),
            "quoin_scene: version 0 is not supported (1 to 11 are)");
  EXPECT_EQ(find_error(R"({"quoin_scene": 1, "files": []})"), "\"instances\" is missing");
  const auto hierarchy = [](const std::string& lists, const std::string& instance) {
    return R"({"quoin_scene": 4, "files": [{"id": "a", "path": "x"}], )" + lists + R"("instances": [{"file": "a")" +
           instance + "}]}";
  };
  EXPECT_EQ(find_error(hierarchy(R"("groups": [{"parent": 0}], )", "")),
            "groups[0].parent: group 0 does not come before it");
  EXPECT_EQ(find_error(hierarchy(R"("groups": [{"layer": 1}], "layers": [{}], )", "")),
            "groups[0].layer: layer 1 does not exist");
  EXPECT_EQ(find_error(hierarchy("", R"(, "group": 0)")), "instances[0].group: group 0 does not exist");
  EXPECT_EQ(find_error(hierarchy("", R"(, "layer": -1)")), "instances[0].layer: must be an index into layers, from 0");
  EXPECT_EQ(find_error(R"({"quoin_scene": 1, "files": [{"id": "a", "path": ""}], "instances": []})"),
            "files[0].path: must name a file");
  EXPECT_EQ(
      find_error(
          R"({"quoin_scene": 1, "files": [{"id": "a", "path": "x"}, {"id": "a", "path": "y"}], "instances": []})"),
      "files[1].id: \"a\" is a duplicate");
}

TEST(SceneFile, RejectsHarmfulInput) {
  EXPECT_NE(find_error(std::string(100'000, '[')), "none");
  EXPECT_NE(find_error(file_with(R"({"file": "a", "scale": 1e400})")), "none");
  EXPECT_NE(find_error(file_with(R"({"file": "a", "position": [NaN, 0, 0]})")), "none");
  EXPECT_NE(find_error(R"({"quoin_scene": 1, "files": [], "instances": [], "sun": [0, 0, 0]})"), "none");
  EXPECT_NE(
      find_error(
          R"({"quoin_scene": 1, "files": [], "instances": [], "camera": {"position": [1,1,1], "look_at": [1,1,1]}})"),
      "none");
  // Very small and very large numbers.
  EXPECT_EQ(find_error(file_with(R"({"file": "a", "rotation": [1e-300, 0, 1e-308, 0]})")), "none");
  EXPECT_EQ(find_error(file_with(R"({"file": "a", "rotation": [1e300, 1e300, 0, 0]})")), "none");
}

/// A folder with two .vox files that is removed at the end.
class SceneFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("quoin_scene_file_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    write_model("red.vox", {200, 0, 0, 255});
    write_model("blue.vox", {0, 0, 200, 255});
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write_model(const std::string& name, Rgba8 colour) const {
    Scene scene;
    VoxelProperties properties;
    properties.colour = colour;
    const auto type = scene.types.add(properties);
    ASSERT_TRUE(type);
    SceneGrid grid;
    grid.canvas = {IVec3(0), IVec3(4, 4, 4)};
    grid.grid.set({0, 0, 0}, *type);
    grid.grid.set({3, 1, 0}, *type);
    Instance instance;
    instance.grid = scene.add_grid(std::move(grid));
    scene.add_instance(instance);
    const auto written = write_vox(scene, folder_ / name);
    ASSERT_TRUE(written) << to_string(written.error());
  }
  fs::path write_text(const std::string& text) const {
    const fs::path path = folder_ / "scene.json";
    std::ofstream(path) << text;
    return path;
  }

  fs::path folder_;
};

TEST_F(SceneFiles, PlaceFilesRepeatedly) {
  const auto loaded = load_scene(write_text(R"({"quoin_scene": 1,
      "files": [{"id": "r", "path": "red.vox"}, {"id": "b", "path": "blue.vox"}],
      "instances": [{"file": "r"}, {"file": "b", "name": "second", "position": [10, 0, 0], "scale": 2, "mirrored": true,
                     "rotation": {"axis": [0, 1, 0], "degrees": 90}}, {"file": "r", "position": [0, 20, 0]}],
      "sun": [0, 1, 0]})"));
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->format, "scene");
  const Scene& scene = loaded->scene;
  EXPECT_EQ(scene.grids().size(), 2U);
  ASSERT_EQ(scene.instances().size(), 3U);
  EXPECT_EQ(loaded->scene.environment, Environment::natural({0, 1, 0}));
  const auto handles = scene.instances().handles();
  // Both files call their colour type 1; here they differ.
  const auto colour_of = [&](InstanceHandle handle) {
    const Grid& grid = scene.grids()[scene.instances()[handle].grid].grid;
    return scene.types[grid.types().at(0)].colour;
  };
  EXPECT_EQ(colour_of(handles[0]), (Rgba8{200, 0, 0, 255}));
  EXPECT_EQ(colour_of(handles[1]), (Rgba8{0, 0, 200, 255}));
  EXPECT_EQ(scene.instances()[handles[0]].grid, scene.instances()[handles[2]].grid);
  const Instance& second = scene.instances()[handles[1]];
  EXPECT_EQ(second.name, "second");
  // The expected position of a point, by the definition: scale, mirror, rotation, then position; applied after the
  // file's own placement.
  const auto alone = load_scene(folder_ / "blue.vox");
  ASSERT_TRUE(alone);
  const Instance& inner = alone->scene.instances()[alone->scene.instances().handles()[0]];
  const SceneGrid& grid = alone->scene.grids()[inner.grid];
  const DVec3 in_file = world_from_grid(inner, grid, DVec3(3, 1, 0));
  const DVec3 mirrored(-in_file.x, in_file.y, in_file.z);
  const DVec3 expected = DVec3(10, 0, 0) + glm::angleAxis(glm::radians(90.0), DVec3(0, 1, 0)) * (2.0 * mirrored);
  EXPECT_LT(glm::length(world_from_grid(second, scene.grids()[second.grid], DVec3(3, 1, 0)) - expected), 1e-12);
}

// A smooth world with a lamp, saved as a whole, below a house of blocks.
TEST_F(SceneFiles, PlaceSelfContainedSceneFiles) {
  Scene world;
  VoxelProperties grass;
  grass.colour = {10, 180, 20, 255};
  ASSERT_TRUE(world.types.add(grass));
  SceneGrid ground;
  ground.field.add_sphere({0, 0, 0}, 20.0, 1);
  world.add_instance({"ground", world.add_grid(std::move(ground)), {1, 2, 3}});
  Lamp lamp;
  lamp.position = {5, 0, 0};
  lamp.direction = {1, 0, 0};
  lamp.intensity = 3.0;
  lamp.range = 10.0;
  world.lamps.push_back(lamp);
  ASSERT_TRUE(save_scene(world, folder_ / "world.json"));
  const auto loaded = load_scene(write_text(R"({"quoin_scene": 1,
      "files": [{"id": "w", "path": "world.json"}, {"id": "house", "path": "red.vox"}],
      "instances": [{"file": "w", "position": [100, 0, 0], "scale": 2, "mirrored": true}, {"file": "house"},
                    {"file": "w", "visible": false}]})"));
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const Scene& scene = loaded->scene;
  ASSERT_EQ(scene.instances().size(), 3U);
  const Instance& placed = scene.instances()[scene.instances().handles()[0]];
  EXPECT_EQ(placed.position, DVec3(98, 4, 6));
  EXPECT_TRUE(placed.mirrored);
  const DensityGrid& field = scene.grids()[placed.grid].field;
  EXPECT_EQ(field.solid_count(), world.grids()[world.grids().handles()[0]].field.solid_count());
  EXPECT_EQ(scene.types[field.material({0, 0, 0})].colour, grass.colour);
  ASSERT_EQ(scene.lamps.size(), 1U) << "of what is shown";
  EXPECT_EQ(scene.lamps[0].position, DVec3(90, 0, 0));
  EXPECT_EQ(scene.lamps[0].direction, DVec3(-1, 0, 0));
  EXPECT_EQ(scene.lamps[0].intensity, 12.0);
  EXPECT_EQ(scene.lamps[0].range, 20.0);
}

TEST_F(SceneFiles, KeepCategoriesOfSourcesUnlessSet) {
  Scene world;
  Instance ship;
  ship.grid = world.add_grid({});
  ship.categories = 6;
  world.add_instance(ship);
  ASSERT_TRUE(save_scene(world, folder_ / "ship.json"));
  ship.categories = 1;
  world.add_instance(ship);
  ASSERT_TRUE(save_scene(world, folder_ / "fleet.json"));
  const auto loaded = load_scene(write_text(R"({"quoin_scene": 1,
      "files": [{"id": "ship", "path": "ship.json"}, {"id": "fleet", "path": "fleet.json"}],
      "instances": [{"file": "ship"}, {"file": "ship", "categories": 1}, {"file": "fleet"},
                    {"file": "fleet", "categories": 3}]})"));
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  std::vector<std::uint32_t> categories;
  loaded->scene.instances().for_each(
      [&](InstanceHandle, const Instance& instance) { categories.push_back(instance.categories); });
  EXPECT_EQ(categories, (std::vector<std::uint32_t>{6, 1, 6, 1, 3, 3}));
}

TEST_F(SceneFiles, ErrorsNameTheFile) {
  const auto with_path = [&](const std::string& name) {
    const auto loaded = load_scene(write_text(R"({"quoin_scene": 1, "files": [{"id": "a", "path": ")" + name +
                                              R"("}], "instances": [{"file": "a"}]})"));
    return loaded ? std::string("none") : to_string(loaded.error());
  };
  EXPECT_EQ(with_path("red.vox"), "none");
  EXPECT_NE(with_path("absent.vox").find("absent.vox"), std::string::npos);
  // The file refers to itself.
  EXPECT_NE(with_path("scene.json").find("a scene file that references files cannot be referenced"), std::string::npos);
  std::ofstream(folder_ / "noise.vox") << "not voxels";
  EXPECT_NE(with_path("noise.vox").find("noise.vox"), std::string::npos);
}

TEST_F(SceneFiles, ReadSkyImages) {
  const auto sky_of = [&](const std::string& image, const LoadOptions& options = {}) {
    return load_scene(write_text(R"({"quoin_scene": 6, "environment": {"sky": {"model": "image", "image": ")" + image +
                                 R"("}}, "files": [{"id": "r", "path": "red.vox"}], "instances": [{"file": "r"}]})"),
                      options);
  };
  const auto missing = sky_of("sky.hdr");
  ASSERT_TRUE(missing) << to_string(missing.error());
  EXPECT_TRUE(lacks_image(missing->scene.environment->sky));
  ASSERT_EQ(missing->warnings.size(), 1U);
  EXPECT_EQ(missing->warnings[0].find("left out: the image of the sky \"sky.hdr\": "), 0U) << missing->warnings[0];
  EXPECT_TRUE(sky_of("sky.hdr", {.sky_image = false})->warnings.empty());

  std::ofstream(folder_ / "sky.hdr", std::ios::binary) << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n"
                                                       << std::string("\x80\0\0\x81", 4);
  const auto loaded = sky_of("sky.hdr");
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_TRUE(loaded->warnings.empty()) << loaded->warnings[0];
  ASSERT_NE(loaded->scene.environment->sky.image, nullptr);
  EXPECT_EQ(loaded->scene.environment->sky.image->width, 1);
  EXPECT_GT(loaded->scene.environment->sky.image->rgb[0], 0.9F);
  EXPECT_EQ(sidecar_files_of(folder_ / "scene.json"),
            (std::vector<fs::path>{folder_ / "red.vox", folder_ / "sky.hdr"}));

  const auto outside = sky_of("../sky.hdr");
  ASSERT_TRUE(outside && outside->warnings.size() == 1U);
  EXPECT_NE(outside->warnings[0].find("outside the folder"), std::string::npos) << outside->warnings[0];
  fs::rename(folder_ / "sky.hdr", folder_ / "other.hdr");
  EXPECT_TRUE(sky_of((folder_ / "other.hdr").string(), {.sidecar_files = SidecarFiles::Anywhere})->warnings.empty());

  const std::string text = R"({"quoin_scene": 6, "files": [], "instances": [],
      "environment": {"sky": {"model": "image", "image": "other.hdr"}}})";
  const auto from_bytes = load_scene(std::as_bytes(std::span(text)));
  ASSERT_TRUE(from_bytes) << to_string(from_bytes.error());
  ASSERT_EQ(from_bytes->warnings.size(), 1U);
  EXPECT_NE(from_bytes->warnings[0].find("by path, not from bytes"), std::string::npos) << from_bytes->warnings[0];
}

TEST_F(SceneFiles, ListOnlyReadableSidecarFiles) {
  const auto files_of = [&](const std::string& sky, const std::string& model, SidecarFiles allowed) {
    return sidecar_files_of(write_text(R"({"quoin_scene": 6, "environment": {"sky": {"model": "image")" + sky +
                                       R"(}}, "files": [{"id": "r", "path": ")" + model + R"("}], "instances": []})"),
                            allowed);
  };
  using Files = std::vector<fs::path>;
  constexpr auto kWithin = SidecarFiles::WithinFolder;
  EXPECT_EQ(files_of("", "red.vox", kWithin), Files{folder_ / "red.vox"}) << "no image";
  EXPECT_EQ(files_of(R"(, "image": "skies\\day.hdr")", "red.vox", kWithin),
            (Files{folder_ / "red.vox", folder_ / "skies/day.hdr"}));
  EXPECT_EQ(files_of(R"(, "image": "../day.hdr")", "../red.vox", kWithin), Files{});
  EXPECT_EQ(files_of(R"(, "image": "../day.hdr")", "../red.vox", SidecarFiles::Anywhere),
            (Files{folder_ / "../red.vox", folder_ / "../day.hdr"}));
}

TEST_F(SceneFiles, WarnWhenSavedAwayFromTheSkyImage) {
  LoadedScene loaded;
  Sky& sky = loaded.scene.environment.emplace().sky;
  sky.model = SkyModel::Image;
  const auto warnings_at = [&](const fs::path& path) {
    const auto saved = save_scene(loaded, path);
    EXPECT_TRUE(saved) << to_string(saved.error());
    EXPECT_EQ(unsupported_features(loaded, path).value(), saved->warnings);
    return saved->warnings;
  };
  EXPECT_EQ(warnings_at(folder_ / "a.json"),
            std::vector<std::string>{"the sky image is left out: it has no file name"});
  sky.image_file = "sky.hdr";
  std::ofstream(folder_ / "sky.hdr") << "an image";
  EXPECT_TRUE(warnings_at(folder_ / "a.json").empty());
  fs::create_directory(folder_ / "other");
  EXPECT_EQ(warnings_at(folder_ / "other/a.json"),
            std::vector<std::string>{
                "the sky image is left out: the saved file names \"sky.hdr\", which is not in its folder"});
}

TEST_F(SceneFiles, AreParsedByPath) {
  const auto file = parse_scene_file(write_text(R"({"quoin_scene": 1, "files": [{"id": "a", "path": "absent.vox"}],
                                                    "instances": [{"file": "a"}]})"));
  ASSERT_TRUE(file) << to_string(file.error());
  ASSERT_EQ(file->sources.size(), 1U);
  EXPECT_EQ(file->sources[0].file, "absent.vox");
  const auto absent = parse_scene_file(folder_ / "nothing.json");
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().code, ErrorCode::CannotRead);
  EXPECT_EQ(absent.error().path, (folder_ / "nothing.json").string());
  const auto broken = parse_scene_file(write_text("{"));
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().code, ErrorCode::BadFormat);
  EXPECT_FALSE(broken.error().path.empty());
}

// Returns an environment in which every setting differs from the natural one.
Environment changed_environment() {
  Environment environment;
  environment.sun = {.direction = {0.1, -3.0, 1e-7},
                     .brightness = 2.5,
                     .colour = {1.0F, 0.7F, 0.1F},
                     .angle_radians = 0.25,
                     .is_visible = false};
  environment.sky.model = SkyModel::Image;
  environment.sky.brightness = 0.3;
  environment.sky.colour = {0.2F, 0.4F, 0.6F};
  environment.sky.air = {.rayleigh = 0.5,
                         .mie = 3.0,
                         .ozone = 0.0,
                         .mie_anisotropy = -0.3,
                         .rayleigh_colour = {1.0F, 2.0F, 3.0F},
                         .mie_colour = {0.5F, 0.5F, 0.25F},
                         .ozone_colour = {0.0F, 0.0F, 1.0F}};
  environment.sky.image_file = "skies/park \xFF.hdr";
  environment.sky.image_turn_radians = 1.0 / 3.0;
  environment.sky.background = Vec3(0.1F, 0.2F, 0.3F);
  environment.ground = GroundPlane{.height = -7.25, .colour = Vec3(0.9F), .only_shadows = true, .fade = 0.1};
  environment.fog = Fog{.density = 0.02, .colour = {0.9F, 0.8F, 0.7F}, .anisotropy = 0.4, .top = 31.5};
  environment.lamp_brightness = 4.0;
  environment.exposure = 1.7;
  environment.tone = ToneCurve::Agx;
  environment.vignette = 0.2;
  environment.gamma = 2.4;
  environment.bloom = {.mix = 0.3, .radius = 0.05, .aspect = -0.5, .threshold = 1.5};
  return environment;
}

std::string text_of(const SceneFile& scene) {
  const auto bytes = write_scene_file(scene).value();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(SceneFile, RestoresEnvironmentsExactly) {
  SceneFile scene;
  for (const SkyModel model :
       {SkyModel::Fixed, SkyModel::Gradient, SkyModel::Physical, SkyModel::Uniform, SkyModel::Image}) {
    for (const ToneCurve tone : {ToneCurve::Clamp, ToneCurve::Neutral, ToneCurve::Agx, ToneCurve::Aces}) {
      scene.environment = changed_environment();
      scene.environment->sky.model = model;
      scene.environment->tone = tone;
      const auto read = parse(text_of(scene));
      ASSERT_TRUE(read) << to_string(read.error());
      EXPECT_EQ(read->environment, scene.environment);
    }
  }
  scene.environment = Environment::reference();
  EXPECT_EQ(parse(text_of(scene)).value().environment, Environment::reference());
}

using TestSetting = std::function<void(const std::string& key)>;

template <class T>
void change_setting(std::optional<T>& value, const TestSetting& test, const std::string& key);

// Changes a setting and calls `test` with its key; of a part, each of its settings in turn.
template <class T>
void change_setting(T& value, const TestSetting& test, const std::string& key) {
  if constexpr (EnvironmentPart<T>) {
    visit_settings(std::type_identity<T>{}, [&](const char* inner, auto member, const SettingRange& /*range*/ = {}) {
      const auto before = value.*member;
      change_setting(value.*member, test, inner);
      value.*member = before;
    });
    return;
  } else if constexpr (std::is_same_v<T, Vec3> || std::is_same_v<T, DVec3>) {
    value = T(0.0, 0.6, 0.8);
  } else if constexpr (std::is_same_v<T, std::string>) {
    value = "park.exr";
  } else if constexpr (std::is_floating_point_v<T>) {
    value = 0.37;
  } else {
    value = static_cast<T>(!static_cast<bool>(value));  // the other flag, or an enumerator
  }
  test(key);
}
template <class T>
void change_setting(std::optional<T>& value, const TestSetting& test, const std::string& key) {
  change_setting(value.emplace(), test, key);
}

TEST(SceneFile, StoresAndDocumentsEverySetting) {
  std::ostringstream documented;
  documented << std::ifstream(QUOIN_SOURCE_DIR "/docs/scene-files.md").rdbuf();
  SceneFile scene;
  scene.environment = Environment::natural();
  int settings = 0;
  const auto test = [&](const std::string& key) {
    ++settings;
    const auto read = parse(text_of(scene));
    ASSERT_TRUE(read) << key << ": " << to_string(read.error());
    EXPECT_EQ(read->environment, scene.environment) << key;
    EXPECT_NE(scene.environment, Environment::natural()) << key;
    EXPECT_NE(documented.str().find("`" + key + "`"), std::string::npos) << key << ": describe it in the table of keys";
  };
  change_setting(*scene.environment, test, "");
  EXPECT_GE(settings, 30);
}

TEST(SceneFile, NeedsVersion6ForMoreThanASun) {
  SceneFile scene;
  EXPECT_NE(text_of(scene).find("\"quoin_scene\": 1"), std::string::npos);
  scene.environment = Environment::natural({0.0, 1.0, 0.0});
  const std::string sun = text_of(scene);
  EXPECT_NE(sun.find("\"quoin_scene\": 1"), std::string::npos) << sun;
  EXPECT_NE(sun.find("\"sun\": [0.0,1.0,0.0]"), std::string::npos) << sun;
  scene.environment->exposure = 2.0;
  EXPECT_NE(text_of(scene).find("\"quoin_scene\": 6"), std::string::npos);
}

TEST(SceneFile, RejectsInvalidEnvironments) {
  const auto error_of = [](const std::string& environment) {
    return find_error(R"({"quoin_scene": 6, "files": [], "instances": [], "environment": )" + environment + "}");
  };
  EXPECT_EQ(error_of("{}"), "none");
  for (const char* wrong :
       {"[]", R"({"sun": {"direction": [0, 0, 0]}})", R"({"sun": {"brightness": -1}})",
        R"({"sky": {"model": "green"}})", R"({"sky": {"brightness": 1e10}})", R"({"fog": {"density": -1}})",
        R"({"ground": {"colour": [2, 0, 0]}})", R"({"exposure": -1})", R"({"exposure": "auto"})", R"({"tone": "film"})",
        R"({"gamma": 0})", R"({"bloom": {"mix": 2}})", R"({"moon": {}})", R"({"sky": {"background": [1, 2]}})"}) {
    EXPECT_NE(error_of(wrong), "none") << wrong;
  }
  EXPECT_NE(find_error(R"({"quoin_scene": 6, "files": [], "instances": [], "sun": [0, 1, 0], "environment": {}})"),
            "none");
  SceneFile scene;
  scene.environment = Environment::natural();
  scene.environment->fog = Fog{.density = std::numeric_limits<double>::quiet_NaN()};
  EXPECT_EQ(write_scene_file(scene).error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace quoin

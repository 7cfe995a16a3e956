// Tests scenes of the C interface: instances, groups, cameras, lamps, types; and voxelising triangles.

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "quoin.h"
#include "structs_for_tests.h"

namespace {

// A scene file with everything except voxels.
constexpr const char* kSceneFile = R"({
  "quoin_scene": 4,
  "grids": [{"name": "nothing", "voxels": []}],
  "layers": [{"name": "upper", "visible": false}],
  "groups": [{"name": "house"}, {"name": "room", "parent": 0, "layer": 0}],
  "instances": [{"grid": 0, "name": "chair", "group": 1}],
  "lamps": [{"name": "torch", "kind": "spot", "position": [1, 2, 3], "direction": [0, -1, 0], "intensity": 5}],
  "sun": [0, 1, 0],
  "camera": {"position": [0, 0, 50], "look_at": [0, 0, 0], "fov": 40}
})";

// Three voxels, one of glass between two that are opaque, 7 above the ground.
class CScene : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(quoin_scene_create(&scene_), QUOIN_OK);
    for (const int red : {100, 200}) {
      auto type = sized<quoin_type>();
      type.rgba[0] = static_cast<std::uint8_t>(red);
      type.rgba[3] = red == 100 ? 255 : 90;
      type.ior = 1.33F;
      std::uint16_t number = 0;
      ASSERT_EQ(quoin_type_add(scene_, &type, &number), QUOIN_OK);
    }
    const std::vector<std::uint8_t> voxels = {1, 2, 1};
    auto array = sized<quoin_array>();
    array.data = voxels.data();
    array.scalar = QUOIN_UINT8;
    array.shape[0] = 3;
    array.shape[1] = array.shape[2] = 1;
    array.strides[0] = array.strides[1] = array.strides[2] = 1;
    array.origin[1] = 7.0;
    ASSERT_EQ(quoin_grid_add(scene_, &array, "row", nullptr), QUOIN_OK);
  }
  void TearDown() override { EXPECT_EQ(quoin_free(scene_), QUOIN_OK); }

  // Returns the first hit of a ray straight down at (x, z).
  double t_below(double x, double z) const {
    const std::array<double, 3> origin = {x, 100.0, z};
    const std::array<double, 3> down = {0.0, -1.0, 0.0};
    double t = 0.0;
    auto hits = sized<quoin_hits>();
    hits.t = &t;
    EXPECT_EQ(quoin_scene_rays(scene_, 1, origin.data(), down.data(), 1e9, &hits), QUOIN_OK);
    return t;
  }

  quoin_scene scene_ = 0;
};

TEST_F(CScene, ReportsAddsAndMovesInstances) {
  auto place = sized<quoin_instance>();
  ASSERT_EQ(quoin_instance_get(scene_, 0, &place), QUOIN_OK);
  EXPECT_STREQ(place.name, "row");
  EXPECT_EQ(place.grid, 0U);
  EXPECT_TRUE(place.visible == 1 && place.shown == 1);
  const std::array<double, 12> raised = {1, 0, 0, 0, 0, 1, 0, 7, 0, 0, 1, 0};
  EXPECT_EQ(std::memcmp(place.world_from_grid, raised.data(), sizeof raised), 0);
  EXPECT_EQ(t_below(0.5, 0.5), 92.0);

  // A quarter turn about the vertical, mirrored and twice as large: x goes to -z.
  const std::array<double, 12> turned = {0, 0, 2, 10, 0, 2, 0, 0, 2, 0, 0, 20};
  std::memcpy(place.world_from_grid, turned.data(), sizeof turned);
  std::size_t number = 0;
  ASSERT_EQ(quoin_instance_add(scene_, &place, &number), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(number, 1U);
  auto again = sized<quoin_instance>();
  ASSERT_EQ(quoin_instance_get(scene_, 1, &again), QUOIN_OK);
  for (std::size_t i = 0; i < turned.size(); ++i) EXPECT_NEAR(again.world_from_grid[i], turned[i], 1e-12) << i;
  EXPECT_EQ(t_below(11.0, 25.0), 98.0);  // the kept tree is updated

  place.visible = 0;
  ASSERT_EQ(quoin_instance_set(scene_, 1, &place), QUOIN_OK);
  EXPECT_TRUE(std::isinf(t_below(11.0, 25.0)));
  place.world_from_grid[0] = 1.0;  // sheared
  EXPECT_EQ(quoin_instance_set(scene_, 1, &place), QUOIN_INVALID_ARGUMENT);
  place.world_from_grid[0] = std::nan("");
  EXPECT_EQ(quoin_instance_add(scene_, &place, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_instance_set(scene_, 2, &again), QUOIN_INVALID_ARGUMENT);
  again.grid = 1;
  EXPECT_EQ(quoin_instance_add(scene_, &again, nullptr), QUOIN_INVALID_ARGUMENT);
  std::size_t count = 0;
  ASSERT_EQ(quoin_instance_count(scene_, &count), QUOIN_OK);
  EXPECT_EQ(count, 2U);
}

TEST_F(CScene, ReportsOpticsOfTypes) {
  auto type = sized<quoin_type>();
  ASSERT_EQ(quoin_type_get(scene_, 2, &type), QUOIN_OK);
  EXPECT_EQ(type.rgba[3], 90);
  EXPECT_TRUE(type.transparent == 1 && type.ior == 1.33F);
  ASSERT_EQ(quoin_type_get(scene_, 1, &type), QUOIN_OK);
  EXPECT_EQ(type.transparent, 0);
  auto info = sized<quoin_scene_info>();
  ASSERT_EQ(quoin_scene_get_info(scene_, &info), QUOIN_OK);
  EXPECT_TRUE(info.min[1] == 7.0 && info.max[0] == 3.0 && info.has_sun == 0);
}

TEST_F(CScene, ReportsTypesOfBlocks) {
  quoin_mesh mesh = 0;
  ASSERT_EQ(quoin_grid_mesh(scene_, 0, nullptr, &mesh), QUOIN_OK);
  auto data = sized<quoin_mesh_data>();
  ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  ASSERT_NE(data.types, nullptr);
  EXPECT_EQ(data.index_count / 6, data.vertex_count / 4);
  bool has_both[3] = {};
  for (std::size_t i = 0; i < data.vertex_count; ++i) {
    has_both[data.types[i]] = true;
    EXPECT_EQ(data.types[i], data.types[i / 4 * 4]);
    EXPECT_EQ(data.colours[4 * i], data.types[i] == 1 ? 100 : 200);
  }
  EXPECT_TRUE(!has_both[0] && has_both[1] && has_both[2]);
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
}

// As programs compiled with the first header do.
TEST_F(CScene, AcceptsShorterStructs) {
  std::array<std::byte, sizeof(quoin_type)> room;
  room.fill(std::byte{0xA5});
  auto* type = reinterpret_cast<quoin_type*>(room.data());
  type->size = offsetof(quoin_type, transparent);
  ASSERT_EQ(quoin_type_get(scene_, 1, type), QUOIN_OK);
  EXPECT_EQ(type->rgba[0], 100);
  for (std::size_t i = type->size; i < room.size(); ++i) EXPECT_EQ(room[i], std::byte{0xA5});
  std::uint16_t number = 0;
  EXPECT_EQ(quoin_type_add(scene_, type, &number), QUOIN_OK);
  for (const std::size_t size : {std::size_t{0}, type->size - 1, sizeof(quoin_type) + 1}) {
    type->size = size;
    EXPECT_EQ(quoin_type_get(scene_, 1, type), QUOIN_INVALID_ARGUMENT) << size;
    EXPECT_EQ(quoin_type_add(scene_, type, &number), QUOIN_INVALID_ARGUMENT) << size;
  }
}

TEST(CFile, ReportsGroupsLayersLampsAndCameras) {
  quoin_scene scene = 0;
  ASSERT_EQ(quoin_scene_load_bytes(kSceneFile, std::strlen(kSceneFile), &scene), QUOIN_OK) << quoin_last_error();
  auto info = sized<quoin_scene_info>();
  ASSERT_EQ(quoin_scene_get_info(scene, &info), QUOIN_OK);
  EXPECT_STREQ(info.format, "scene");
  EXPECT_TRUE(info.has_sun == 1 && info.sun[1] == 1.0);
  std::size_t count = 0;
  ASSERT_EQ(quoin_group_count(scene, &count), QUOIN_OK);
  ASSERT_EQ(count, 2U);
  auto group = sized<quoin_group>();
  ASSERT_EQ(quoin_group_get(scene, 2, &group), QUOIN_OK);
  EXPECT_STREQ(group.name, "room");
  EXPECT_EQ(group.parent, 1U);
  EXPECT_STREQ(group.layer, "upper");
  EXPECT_EQ(group.shown, 0);
  auto chair = sized<quoin_instance>();
  ASSERT_EQ(quoin_instance_get(scene, 0, &chair), QUOIN_OK);
  EXPECT_EQ(chair.group, 2U);
  EXPECT_TRUE(chair.visible == 1 && chair.shown == 0);
  EXPECT_EQ(quoin_group_get(scene, 0, &group), QUOIN_INVALID_ARGUMENT);
  auto lamp = sized<quoin_lamp>();
  ASSERT_EQ(quoin_lamp_get(scene, 0, &lamp), QUOIN_OK);
  EXPECT_STREQ(lamp.name, "torch");
  EXPECT_TRUE(lamp.is_spot == 1 && lamp.position[2] == 3.0 && lamp.intensity == 5.0 && std::isinf(lamp.range));
  EXPECT_NEAR(lamp.outer_angle_degrees, 45.0, 1e-6);
  ASSERT_EQ(quoin_camera_count(scene, &count), QUOIN_OK);
  ASSERT_EQ(count, 1U);
  auto camera = sized<quoin_camera>();
  ASSERT_EQ(quoin_camera_get(scene, 0, &camera), QUOIN_OK);
  EXPECT_TRUE(camera.is_first == 1 && camera.position[2] == 50.0 && camera.forward[2] == -1.0);
  EXPECT_NEAR(camera.vertical_fov_degrees, 40.0, 1e-9);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

TEST_F(CScene, LeavesOutWhatIsNotSaved) {
  auto place = sized<quoin_instance>();
  ASSERT_EQ(quoin_instance_get(scene_, 0, &place), QUOIN_OK);
  EXPECT_EQ(place.unsaved, 0);
  place.unsaved = 1;
  ASSERT_EQ(quoin_instance_add(scene_, &place, nullptr), QUOIN_OK);
  auto group = sized<quoin_group>();
  group.unsaved = 1;
  ASSERT_EQ(quoin_group_add(scene_, &group, &place.group), QUOIN_OK);
  ASSERT_EQ(quoin_group_get(scene_, place.group, &group), QUOIN_OK);
  EXPECT_EQ(group.unsaved, 1);
  place.unsaved = 0;
  ASSERT_EQ(quoin_instance_add(scene_, &place, nullptr), QUOIN_OK);
  // A program that was compiled with an older header keeps the flag that it does not know.
  auto marked = sized<quoin_instance>();
  ASSERT_EQ(quoin_instance_get(scene_, 1, &marked), QUOIN_OK);
  marked.size = offsetof(quoin_instance, unsaved);
  marked.unsaved = 0;
  ASSERT_EQ(quoin_instance_set(scene_, 1, &marked), QUOIN_OK) << quoin_last_error();
  marked.size = sizeof marked;
  ASSERT_EQ(quoin_instance_get(scene_, 1, &marked), QUOIN_OK);
  EXPECT_EQ(marked.unsaved, 1);
  ASSERT_EQ(quoin_grid_set_storage(scene_, 0, 0, 1), QUOIN_OK);
  EXPECT_EQ(quoin_grid_set_storage(scene_, 1, 0, 1), QUOIN_INVALID_ARGUMENT);
  // Only the first instance, of a whole grid, is in the file.
  const std::string file = test_file("marked.quoin");
  const quoin_status saved = quoin_scene_save(scene_, file.c_str());
  if (saved == QUOIN_UNSUPPORTED) GTEST_SKIP() << quoin_last_error();
  ASSERT_EQ(saved, QUOIN_OK) << quoin_last_error();
  quoin_scene again = 0;
  ASSERT_EQ(quoin_scene_load(file.c_str(), &again), QUOIN_OK);
  std::size_t count = 0;
  ASSERT_EQ(quoin_instance_count(again, &count), QUOIN_OK);
  EXPECT_EQ(count, 1U);
  ASSERT_EQ(quoin_group_count(again, &count), QUOIN_OK);
  EXPECT_EQ(count, 0U);
  auto info = sized<quoin_grid_info>();
  ASSERT_EQ(quoin_grid_get_info(again, 0, &info), QUOIN_OK);
  EXPECT_TRUE(info.whole == 1 && info.unsaved == 0);
  ASSERT_EQ(quoin_grid_set_storage(again, 0, 1, 0), QUOIN_OK);
  ASSERT_EQ(quoin_grid_get_info(again, 0, &info), QUOIN_OK);
  EXPECT_TRUE(info.whole == 0 && info.unsaved == 1);
  ASSERT_EQ(quoin_scene_save(again, file.c_str()), QUOIN_OK) << quoin_last_error();
  ASSERT_EQ(quoin_free(again), QUOIN_OK);
  ASSERT_EQ(quoin_scene_load(file.c_str(), &again), QUOIN_OK);
  ASSERT_EQ(quoin_grid_count(again, &count), QUOIN_OK);
  EXPECT_EQ(count, 0U);
  EXPECT_EQ(quoin_free(again), QUOIN_OK);
}

TEST_F(CScene, AddsLayersAndGroups) {
  auto layer = sized<quoin_layer>();
  EXPECT_EQ(quoin_layer_set(scene_, &layer), QUOIN_INVALID_ARGUMENT);  // without a name
  std::strcpy(layer.name, "attic");
  ASSERT_EQ(quoin_layer_set(scene_, &layer), QUOIN_OK);
  auto group = sized<quoin_group>();
  std::strcpy(group.name, "house");
  group.shown = 1;
  std::size_t house = 0;
  ASSERT_EQ(quoin_group_add(scene_, &group, &house), QUOIN_OK);
  std::strcpy(group.name, "room");
  std::strcpy(group.layer, "attic");
  group.parent = house;
  std::size_t room = 0;
  ASSERT_EQ(quoin_group_add(scene_, &group, &room), QUOIN_OK);
  auto place = sized<quoin_instance>();
  ASSERT_EQ(quoin_instance_get(scene_, 0, &place), QUOIN_OK);
  place.group = room;
  ASSERT_EQ(quoin_instance_set(scene_, 0, &place), QUOIN_OK);
  ASSERT_EQ(quoin_instance_get(scene_, 0, &place), QUOIN_OK);
  EXPECT_TRUE(place.group == room && place.visible == 1 && place.shown == 0);
  EXPECT_STREQ(place.layer, "");
  ASSERT_EQ(quoin_instance_set_layer(scene_, 0, "attic"), QUOIN_OK);
  layer.visible = 1;
  ASSERT_EQ(quoin_layer_set(scene_, &layer), QUOIN_OK);
  std::size_t count = 0;
  ASSERT_EQ(quoin_layer_count(scene_, &count), QUOIN_OK);
  EXPECT_EQ(count, 1U);
  ASSERT_EQ(quoin_instance_get(scene_, 0, &place), QUOIN_OK);
  EXPECT_EQ(place.shown, 1);
  EXPECT_STREQ(place.layer, "attic");
  ASSERT_EQ(quoin_group_get(scene_, room, &group), QUOIN_OK);
  EXPECT_EQ(group.parent, house);
  EXPECT_EQ(quoin_instance_set_layer(scene_, 0, "cellar"), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_instance_set_layer(scene_, 1, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_instance_set_layer(scene_, 0, nullptr), QUOIN_OK);
  group.parent = 3;
  EXPECT_EQ(quoin_group_add(scene_, &group, nullptr), QUOIN_INVALID_ARGUMENT);
  group.parent = 0;
  std::strcpy(group.layer, "cellar");
  EXPECT_EQ(quoin_group_add(scene_, &group, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_layer_get(scene_, 1, &layer), QUOIN_INVALID_ARGUMENT);
}

quoin_camera camera_ahead(std::int32_t number) {
  auto camera = sized<quoin_camera>();
  camera.number = number;
  camera.position[2] = 50.0;
  camera.right[0] = camera.up[1] = 1.0;
  camera.forward[2] = -1.0;
  camera.vertical_fov_degrees = 40.0;
  return camera;
}

TEST_F(CScene, AddsCamerasLampsAndSun) {
  quoin_camera camera = camera_ahead(4);
  camera.is_first = 1;
  ASSERT_EQ(quoin_camera_add(scene_, &camera), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(quoin_camera_add(scene_, &camera), QUOIN_INVALID_ARGUMENT);  // the number is taken
  auto reported = sized<quoin_camera>();
  ASSERT_EQ(quoin_camera_get(scene_, 0, &reported), QUOIN_OK);
  EXPECT_TRUE(reported.number == 4 && reported.is_first == 1 && reported.position[2] == 50.0);
  quoin_camera wrong = camera_ahead(5);
  wrong.up[1] = 2.0;
  EXPECT_EQ(quoin_camera_add(scene_, &wrong), QUOIN_INVALID_ARGUMENT);
  wrong = camera_ahead(5);
  wrong.right[0] = -1.0;  // left-handed
  EXPECT_EQ(quoin_camera_add(scene_, &wrong), QUOIN_INVALID_ARGUMENT);
  wrong = camera_ahead(5);
  wrong.vertical_fov_degrees = 180.0;
  EXPECT_EQ(quoin_camera_add(scene_, &wrong), QUOIN_INVALID_ARGUMENT);
  wrong = camera_ahead(5);
  wrong.is_orthographic = 1;  // of no height
  EXPECT_EQ(quoin_camera_add(scene_, &wrong), QUOIN_INVALID_ARGUMENT);

  auto lamp = sized<quoin_lamp>();
  lamp.intensity = 3.0;
  ASSERT_EQ(quoin_lamp_add(scene_, &lamp), QUOIN_OK);
  ASSERT_EQ(quoin_lamp_get(scene_, 0, &lamp), QUOIN_OK);
  EXPECT_TRUE(std::isinf(lamp.range) && lamp.intensity == 3.0);
  lamp.is_spot = 1;
  lamp.direction[1] = 0.0;
  lamp.direction[0] = lamp.direction[2] = 0.0;
  EXPECT_EQ(quoin_lamp_add(scene_, &lamp), QUOIN_INVALID_ARGUMENT);

  auto sun = sized<quoin_sun>();
  ASSERT_EQ(quoin_sun_get(scene_, &sun), QUOIN_OK);
  EXPECT_EQ(sun.brightness, 0.0);
  EXPECT_EQ(quoin_sun_set(scene_, &sun), QUOIN_INVALID_ARGUMENT);  // without a direction
  sun.direction[1] = 2.0;
  sun.brightness = 1.5;
  sun.colour[0] = 1.0F;
  ASSERT_EQ(quoin_sun_set(scene_, &sun), QUOIN_OK);
  auto info = sized<quoin_scene_info>();
  ASSERT_EQ(quoin_scene_get_info(scene_, &info), QUOIN_OK);
  EXPECT_TRUE(info.has_sun == 1 && info.sun[1] == 1.0);
  ASSERT_EQ(quoin_sun_get(scene_, &sun), QUOIN_OK);
  EXPECT_TRUE(sun.brightness == 1.5 && sun.colour[0] == 1.0F && sun.colour[1] == 0.0F);
}

TEST_F(CScene, SetsEnvironment) {
  auto environment = sized<quoin_environment>();
  ASSERT_EQ(quoin_environment_get(scene_, &environment), QUOIN_OK);
  EXPECT_TRUE(environment.sky == QUOIN_SKY_GRADIENT && environment.tone == QUOIN_TONE_AUTOMATIC);
  EXPECT_TRUE(environment.sky_brightness == 1.0 && environment.has_exposure == 0 && environment.has_fog == 0);
  environment.sky = QUOIN_SKY_UNIFORM;
  environment.tone = QUOIN_TONE_ACES;
  environment.has_exposure = environment.has_fog = environment.has_ground = environment.has_background = 1;
  environment.exposure = 0.5;
  environment.fog_density = 0.25;
  environment.ground_height = -3.0;
  environment.background[1] = 0.75F;
  ASSERT_EQ(quoin_environment_set(scene_, &environment), QUOIN_OK);
  auto again = sized<quoin_environment>();
  ASSERT_EQ(quoin_environment_get(scene_, &again), QUOIN_OK);
  EXPECT_TRUE(again.sky == QUOIN_SKY_UNIFORM && again.tone == QUOIN_TONE_ACES && again.exposure == 0.5);
  EXPECT_TRUE(again.has_fog == 1 && again.fog_density == 0.25 && again.ground_height == -3.0);
  EXPECT_EQ(again.background[1], 0.75F);
  for (const std::int32_t wrong : {-1, 5, 1'000'000}) {
    again.sky = wrong;
    EXPECT_EQ(quoin_environment_set(scene_, &again), QUOIN_INVALID_ARGUMENT);
    again.sky = QUOIN_SKY_FIXED;
    again.tone = wrong;
    EXPECT_EQ(quoin_environment_set(scene_, &again), QUOIN_INVALID_ARGUMENT);
    again.tone = QUOIN_TONE_CLAMP;
  }
  again.lamp_brightness = -1.0;
  EXPECT_EQ(quoin_environment_set(scene_, &again), QUOIN_INVALID_ARGUMENT);
  EXPECT_NE(std::string(quoin_last_error()).find("lamp_brightness"), std::string::npos);
  EXPECT_EQ(quoin_environment_get(scene_, nullptr), QUOIN_INVALID_ARGUMENT);
  ASSERT_EQ(quoin_environment_set(scene_, nullptr), QUOIN_OK);
  ASSERT_EQ(quoin_environment_get(scene_, &environment), QUOIN_OK);
  EXPECT_EQ(environment.sky, QUOIN_SKY_GRADIENT);
}

TEST_F(CScene, WritesVoxels) {
  std::array<std::uint8_t, 4> types = {2, 0, 1, 2};  // x = 1, 2; y = 0; z = 0, 1
  auto array = sized<quoin_array>();
  array.data = types.data();
  array.shape[0] = 2;
  array.shape[1] = 1;
  array.shape[2] = 2;
  array.origin[0] = 1.25;  // rounded down
  ASSERT_EQ(quoin_grid_write(scene_, 0, &array), QUOIN_OK) << quoin_last_error();
  std::array<std::uint16_t, 6> read{};
  const std::array<std::int32_t, 3> min = {0, 0, 0};
  const std::array<std::int32_t, 3> shape = {3, 1, 2};
  ASSERT_EQ(quoin_grid_read(scene_, 0, min.data(), shape.data(), read.data(), read.size()), QUOIN_OK);
  EXPECT_EQ(read, (std::array<std::uint16_t, 6>{1, 0, 2, 0, 1, 2}));
  EXPECT_EQ(t_below(2.5, 1.5), 100.0 - 8.0);  // rays see it
  types[3] = 3;
  EXPECT_EQ(quoin_grid_write(scene_, 0, &array), QUOIN_INVALID_ARGUMENT);
  EXPECT_STREQ(quoin_last_error(), "the array has the type 3; those of the scene are 0 to 2");
  types[0] = 1;
  EXPECT_EQ(quoin_grid_write(scene_, 0, &array), QUOIN_INVALID_ARGUMENT);
  ASSERT_EQ(quoin_grid_read(scene_, 0, min.data(), shape.data(), read.data(), read.size()), QUOIN_OK);
  EXPECT_EQ(read[2], 2);  // nothing of it was written
  EXPECT_EQ(quoin_grid_write(scene_, 1, &array), QUOIN_INVALID_ARGUMENT);
  array.shape[1] = std::int64_t{1} << 62;
  EXPECT_EQ(quoin_grid_write(scene_, 0, &array), QUOIN_INVALID_ARGUMENT);
}

TEST(CTypes, KeepLightAndOcclusion) {
  quoin_scene scene = 0;
  ASSERT_EQ(quoin_scene_create(&scene), QUOIN_OK);
  auto type = sized<quoin_type>();
  type.rgba[3] = 255;
  std::uint16_t number = 0;
  const auto again = [&] {
    auto read = sized<quoin_type>();
    EXPECT_EQ(quoin_type_add(scene, &type, &number), QUOIN_OK);
    EXPECT_EQ(quoin_type_get(scene, number, &read), QUOIN_OK);
    return read;
  };
  type.light_cost = 15;
  type.blocks_light = type.occludes = -1;
  EXPECT_TRUE(again().light_cost == 15 && again().blocks_light == -1 && again().occludes == -1);
  type.occludes = type.blocks_light = 1;
  EXPECT_TRUE(again().blocks_light == 0 && again().occludes == 0) << "the defaults of an opaque type";
  type.transparent = 1;
  EXPECT_EQ(quoin_type_add(scene, &type, &number), QUOIN_INVALID_ARGUMENT) << "a transparent type cannot occlude";
  type.occludes = 0;
  EXPECT_EQ(again().blocks_light, 1);
  type.light_cost = 16;
  EXPECT_EQ(quoin_type_add(scene, &type, &number), QUOIN_INVALID_ARGUMENT);
  type.light_cost = 0;
  type.blocks_light = 2;
  EXPECT_EQ(quoin_type_add(scene, &type, &number), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

TEST(CArrays, ArePackedWithoutStrides) {
  const std::array<std::uint16_t, 24> types = {1, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  quoin_scene scene = 0;
  ASSERT_EQ(quoin_scene_create(&scene), QUOIN_OK);
  auto type = sized<quoin_type>();
  std::uint16_t number = 0;
  ASSERT_EQ(quoin_type_add(scene, &type, &number), QUOIN_OK);
  auto array = sized<quoin_array>();
  array.data = types.data();
  array.scalar = QUOIN_UINT16;
  array.shape[0] = 2;
  array.shape[1] = 3;
  array.shape[2] = 4;
  ASSERT_EQ(quoin_grid_add(scene, &array, nullptr, nullptr), QUOIN_OK);
  std::array<std::uint16_t, 24> read{};
  const std::array<std::int32_t, 3> min = {0, 0, 0};
  const std::array<std::int32_t, 3> shape = {2, 3, 4};
  ASSERT_EQ(quoin_grid_read(scene, 0, min.data(), shape.data(), read.data(), read.size()), QUOIN_OK);
  EXPECT_EQ(read, types);
  quoin_mesh mesh = 0;
  ASSERT_EQ(quoin_mesh_labels(&array, 0, 0, 1, &mesh), QUOIN_OK);
  auto data = sized<quoin_mesh_data>();
  ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  EXPECT_GT(data.index_count, 0U);
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

TEST(CFormats, ListReadableFormats) {
  std::size_t count = 0;
  ASSERT_EQ(quoin_format_count(&count), QUOIN_OK);
  std::string readable;
  for (std::size_t i = 0; i < count; ++i) {
    auto format = sized<quoin_format>();
    ASSERT_EQ(quoin_format_get(i, &format), QUOIN_OK);
    if (format.readable != 0) readable += format.extensions + std::string(" ");
  }
  for (const char* one : {".vox ", ".qb ", ".kvx ", ".vdb "}) EXPECT_NE(readable.find(one), std::string::npos) << one;
  auto format = sized<quoin_format>();
  EXPECT_EQ(quoin_format_get(count, &format), QUOIN_INVALID_ARGUMENT);
}

// A cube of 4 units, red except for its top, with corners at -2 and 2: its sides lie between voxels.
TEST(CTriangles, BecomeVoxelsInPlace) {
  std::vector<float> positions;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) positions.push_back((corner >> axis & 1) != 0 ? 2.0F : -2.0F);
  }
  const std::vector<std::uint32_t> indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                              2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  std::vector<std::uint32_t> materials(12, 0);
  materials[6] = materials[7] = 1;
  std::vector<quoin_type> types(2, sized<quoin_type>());
  types[0].rgba[0] = types[1].rgba[1] = 255;
  types[0].rgba[3] = types[1].rgba[3] = 255;
  types[1].roughness = 0.25F;
  auto triangles = sized<quoin_triangles>();
  triangles.vertex_count = 8;
  triangles.triangle_count = 12;
  triangles.positions = positions.data();
  triangles.indices = indices.data();
  triangles.materials = materials.data();
  triangles.types = types.data();
  triangles.type_count = types.size();
  auto options = sized<quoin_voxelize_options>();
  options.voxel_size = 0.5;
  options.fill = QUOIN_FILL_SOLID;
  quoin_scene scene = 0;
  ASSERT_EQ(quoin_scene_create(&scene), QUOIN_OK);
  ASSERT_EQ(quoin_grid_voxelize(scene, &triangles, &options, "cube", nullptr), QUOIN_OK) << quoin_last_error();
  auto info = sized<quoin_grid_info>();
  ASSERT_EQ(quoin_grid_get_info(scene, 0, &info), QUOIN_OK);
  auto box = sized<quoin_scene_info>();
  ASSERT_EQ(quoin_scene_get_info(scene, &box), QUOIN_OK);
  for (int axis = 0; axis < 3; ++axis) EXPECT_TRUE(box.min[axis] == -4.0 && box.max[axis] == 4.0) << axis;
  EXPECT_EQ(info.voxels, 8 * 8 * 8);
  const std::array<double, 3> origin = {0.5, 50.0, 0.5};
  const std::array<double, 3> down = {0.0, -1.0, 0.0};
  std::uint16_t met = 0;
  auto hits = sized<quoin_hits>();
  hits.type = &met;
  ASSERT_EQ(quoin_scene_rays(scene, 1, origin.data(), down.data(), 1e9, &hits), QUOIN_OK);
  auto type = sized<quoin_type>();
  ASSERT_EQ(quoin_type_get(scene, met, &type), QUOIN_OK);
  EXPECT_TRUE(type.rgba[1] == 255 && type.rgba[0] == 0 && type.roughness == 0.25F);

  std::size_t before = 0;
  ASSERT_EQ(quoin_type_count(scene, &before), QUOIN_OK);
  materials[3] = 2;
  EXPECT_EQ(quoin_grid_voxelize(scene, &triangles, &options, nullptr, nullptr), QUOIN_INVALID_ARGUMENT);
  materials[3] = 0;
  positions[5] = std::nanf("");
  EXPECT_EQ(quoin_grid_voxelize(scene, &triangles, &options, nullptr, nullptr), QUOIN_INVALID_ARGUMENT);
  positions[5] = 1e30F;
  EXPECT_NE(quoin_grid_voxelize(scene, &triangles, &options, nullptr, nullptr), QUOIN_OK);
  positions[5] = -2.0F;
  options.fill = 3;
  EXPECT_EQ(quoin_grid_voxelize(scene, &triangles, &options, nullptr, nullptr), QUOIN_INVALID_ARGUMENT);
  options.fill = QUOIN_FILL_ALL;
  options.voxel_size = -1.0;
  EXPECT_EQ(quoin_grid_voxelize(scene, &triangles, &options, nullptr, nullptr), QUOIN_INVALID_ARGUMENT);
  options.voxel_size = 1e-30;
  EXPECT_EQ(quoin_grid_voxelize(scene, &triangles, &options, nullptr, nullptr), QUOIN_LIMIT_EXCEEDED);
  std::vector<std::uint32_t> wrong(36, 8);
  triangles.indices = wrong.data();
  EXPECT_EQ(quoin_grid_voxelize(scene, &triangles, nullptr, nullptr, nullptr), QUOIN_INVALID_ARGUMENT);
  std::size_t after = 0;
  ASSERT_EQ(quoin_type_count(scene, &after), QUOIN_OK);
  EXPECT_EQ(after, before);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

// Two sheets at x = 0 and x = 4, of 8 x 8 voxels each, of two types.
class CTriangleTypes : public testing::Test {
 protected:
  void SetUp() override {
    for (const float x : {0.5F, 4.5F}) {
      for (const auto& [y, z] : {std::pair{0.0F, 0.0F}, {8.0F, 0.0F}, {8.0F, 8.0F}, {0.0F, 8.0F}})
        positions_.insert(positions_.end(), {x, y, z});
    }
    types_[0].rgba[0] = types_[1].rgba[0] = 100;
    types_[1].rgba[0] = 104;
    types_[0].rgba[3] = types_[1].rgba[3] = 255;
    triangles_.vertex_count = 8;
    triangles_.triangle_count = 4;
    triangles_.positions = positions_.data();
    triangles_.indices = indices_.data();
    triangles_.materials = materials_.data();
    triangles_.types = types_.data();
    triangles_.type_count = types_.size();
    ASSERT_EQ(quoin_scene_create(&scene_), QUOIN_OK);
  }
  void TearDown() override { EXPECT_EQ(quoin_free(scene_), QUOIN_OK); }

  // The added types.
  std::vector<quoin_type> added(int max_types = 0) {
    auto options = sized<quoin_voxelize_options>();
    options.fill = QUOIN_FILL_SURFACE;
    options.max_types = max_types;
    std::size_t before = 0;
    std::size_t after = 0;
    EXPECT_EQ(quoin_type_count(scene_, &before), QUOIN_OK);
    EXPECT_EQ(quoin_grid_voxelize(scene_, &triangles_, &options, nullptr, nullptr), QUOIN_OK) << quoin_last_error();
    EXPECT_EQ(quoin_type_count(scene_, &after), QUOIN_OK);
    std::vector<quoin_type> found(after - before, sized<quoin_type>());
    for (std::size_t i = before; i < after; ++i) EXPECT_EQ(quoin_type_get(scene_, i, &found[i - before]), QUOIN_OK);
    return found;
  }

  std::vector<float> positions_;
  const std::vector<std::uint32_t> indices_ = {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
  const std::vector<std::uint32_t> materials_ = {0, 0, 1, 1};
  std::vector<quoin_type> types_ = std::vector<quoin_type>(2, sized<quoin_type>());
  quoin_triangles triangles_ = sized<quoin_triangles>();
  quoin_scene scene_ = 0;
};

TEST_F(CTriangleTypes, KeepTheirProperties) {
  std::strcpy(types_[0].name, "ice");
  types_[0].transparent = 1;
  types_[0].ior = 1.31F;
  std::strcpy(types_[1].name, "cloud");
  types_[1].rgba[3] = 90;
  types_[1].scattering = 0.5F;
  types_[1].anisotropy = 0.25F;
  types_[0].blocks_light = 1;
  types_[1].light_cost = 2;
  const auto found = added();
  ASSERT_EQ(found.size(), 2U);
  const bool is_first = std::string(found[0].name) == "ice";
  const quoin_type& ice = found[is_first ? 0 : 1];
  const quoin_type& cloud = found[is_first ? 1 : 0];
  EXPECT_STREQ(ice.name, "ice");
  EXPECT_TRUE(ice.transparent == 1 && ice.ior == 1.31F && ice.rgba[3] == 255 && ice.rgba[0] == 100);
  EXPECT_TRUE(ice.blocks_light == 1 && ice.light_cost == 0 && cloud.light_cost == 2 && cloud.blocks_light == 0);
  EXPECT_STREQ(cloud.name, "cloud");
  EXPECT_TRUE(cloud.transparent == 1 && cloud.scattering == 0.5F && cloud.anisotropy == 0.25F && cloud.rgba[3] == 90);
}

TEST_F(CTriangleTypes, MergeIfOnlyColoursDiffer) {
  auto found = added();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(std::max(found[0].rgba[0], found[1].rgba[0]), 104);
  EXPECT_EQ(std::min(found[0].rgba[0], found[1].rgba[0]), 100);
  found = added(1);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].rgba[0], 102);
  std::size_t warnings = 0;
  ASSERT_EQ(quoin_scene_warning_count(scene_, &warnings), QUOIN_OK);
  EXPECT_EQ(warnings, 1U);
  // A save keeps earlier warnings and does not repeat them.
  ASSERT_EQ(quoin_scene_save(scene_, test_file("c_test_sheets.json").c_str()), QUOIN_OK) << quoin_last_error();
  ASSERT_EQ(quoin_scene_save(scene_, test_file("c_test_sheets.glb").c_str()), QUOIN_OK) << quoin_last_error();
  ASSERT_EQ(quoin_scene_warning_count(scene_, &warnings), QUOIN_OK);
  EXPECT_EQ(warnings, 1U);
}

TEST_F(CTriangleTypes, KeepAlphaOfColours) {
  std::vector<float> colours;
  for (int corner = 0; corner < 8; ++corner)
    colours.insert(colours.end(), {1.0F, 1.0F, 1.0F, corner < 4 ? 0.0F : 0.5F});
  triangles_.colours = colours.data();
  const auto found = added();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].rgba[3] == 128 && found[0].rgba[0] == 104 && found[0].transparent == 1);
}

TEST_F(CScene, KeepsLongInstanceNames) {
  const std::string name(300, 'n');
  const std::string path = test_file("c_test_name.json");
  std::ofstream(path) << R"({"quoin_scene": 4, "grids": [{"voxels": []}], "instances": [{"grid": 0, "name": ")" << name
                      << R"("}]})";
  quoin_scene scene = 0;
  ASSERT_EQ(quoin_scene_load(path.c_str(), &scene), QUOIN_OK) << quoin_last_error();
  auto place = sized<quoin_instance>();
  ASSERT_EQ(quoin_instance_get(scene, 0, &place), QUOIN_OK);
  const std::array<double, 12> moved = {1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0};
  std::memcpy(place.world_from_grid, moved.data(), sizeof moved);
  const auto saved = [&] {
    EXPECT_EQ(quoin_instance_set(scene, 0, &place), QUOIN_OK) << quoin_last_error();
    EXPECT_EQ(quoin_scene_save(scene, path.c_str()), QUOIN_OK) << quoin_last_error();
    std::ifstream file(path);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  EXPECT_NE(saved().find(name), std::string::npos);
  std::strcpy(place.name, "short");
  EXPECT_EQ(saved().find("nnn"), std::string::npos);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

struct Listener {
  std::atomic<int> calls = 0;
  int stop_at = -1;
  double last = 0.0;  // of the call
};
std::int32_t listen(double fraction, void* user) {
  auto* listener = static_cast<Listener*>(user);
  EXPECT_TRUE(fraction >= listener->last && fraction <= 1.0) << fraction << " after " << listener->last;
  listener->last = fraction;
  return ++listener->calls == listener->stop_at ? 0 : 1;
}

TEST_F(CScene, ReportsProgressAndCanBeCancelled) {
  Listener listener;
  ASSERT_EQ(quoin_set_progress(listen, &listener), QUOIN_OK);
  auto options = sized<quoin_render_options>();
  options.width = options.height = 64;
  options.samples = 1;
  std::vector<std::uint8_t> image(std::size_t{3} * 64 * 64);
  EXPECT_EQ(quoin_scene_render(scene_, &options, image.data(), image.size()), QUOIN_OK);
  const int calls = listener.calls;
  EXPECT_GT(calls, 2);
  std::thread([&] {  // a thread without a callback
    EXPECT_EQ(quoin_scene_render(scene_, &options, image.data(), image.size()), QUOIN_OK);
  })
      .join();
  EXPECT_EQ(listener.calls, calls);
  listener.last = 0.0;
  listener.stop_at = calls + 2;
  EXPECT_EQ(quoin_scene_render(scene_, &options, image.data(), image.size()), QUOIN_CANCELLED);
  ASSERT_EQ(quoin_set_progress(nullptr, nullptr), QUOIN_OK);
  EXPECT_EQ(quoin_scene_render(scene_, &options, image.data(), image.size()), QUOIN_OK);
  EXPECT_EQ(listener.calls, calls + 2);
}

TEST_F(CScene, ReportsNonDecreasingProgress) {
  Listener listener;
  const std::vector<std::uint16_t> voxels(std::size_t{200} * 80 * 80, 1);
  auto array = sized<quoin_array>();
  array.data = voxels.data();
  array.scalar = QUOIN_UINT16;
  array.shape[0] = 200;
  array.shape[1] = array.shape[2] = 80;
  array.strides[0] = std::int64_t{2} * 80 * 80;
  array.strides[1] = 2 * 80;
  array.strides[2] = 2;
  ASSERT_EQ(quoin_set_progress(listen, &listener), QUOIN_OK);
  ASSERT_EQ(quoin_grid_add(scene_, &array, "wall", nullptr), QUOIN_OK) << quoin_last_error();
  EXPECT_GT(listener.calls, 2);
  EXPECT_EQ(listener.last, 1.0);
  listener.last = 0.0;
  EXPECT_EQ(quoin_scene_save(scene_, test_file("c_test_wall.glb").c_str()), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(listener.last, 1.0);
  listener.last = 0.0;
  listener.stop_at = listener.calls + 2;
  EXPECT_EQ(quoin_grid_add(scene_, &array, "wall", nullptr), QUOIN_CANCELLED);
  std::size_t count = 0;
  EXPECT_EQ(quoin_grid_count(scene_, &count), QUOIN_OK);
  EXPECT_EQ(count, 2U);
  EXPECT_EQ(quoin_set_progress(nullptr, nullptr), QUOIN_OK);
}

// As the header says, concurrent readers and a writer need no lock of their own.
TEST_F(CScene, AllowsConcurrentReadersAndWriter) {
  std::vector<std::thread> readers;
  readers.reserve(4);
  for (int i = 0; i < 4; ++i) {
    readers.emplace_back([&] {
      for (int turn = 0; turn < 50; ++turn) EXPECT_GT(t_below(0.5, 0.5), 0.0);
    });
  }
  auto place = sized<quoin_instance>();
  ASSERT_EQ(quoin_instance_get(scene_, 0, &place), QUOIN_OK);
  for (int turn = 0; turn < 50; ++turn) {
    place.world_from_grid[7] = turn;
    EXPECT_EQ(quoin_instance_set(scene_, 0, &place), QUOIN_OK);
  }
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(t_below(0.5, 0.5), 50.0);
}

TEST(CLoading, AppliesOptions) {
  quoin_scene scene = 0;
  std::ofstream(test_file("c_test.obj")) << "v 0 0 0\nv 8 0 0\nv 0 8 0\nv 0 0 8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  auto options = sized<quoin_load_options>();
  options.mesh_voxels = 20;
  ASSERT_EQ(quoin_scene_load_with(test_file("c_test.obj").c_str(), &options, &scene), QUOIN_OK) << quoin_last_error();
  auto info = sized<quoin_grid_info>();
  ASSERT_EQ(quoin_grid_get_info(scene, 0, &info), QUOIN_OK);
  EXPECT_EQ(info.extent[0], 20);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
  options.voxel_size = 1.0;
  EXPECT_EQ(quoin_scene_load_with(test_file("c_test.obj").c_str(), &options, &scene), QUOIN_INVALID_ARGUMENT);
  options.mesh_voxels = 0;
  options.voxel_size = std::nan("");
  EXPECT_EQ(quoin_scene_load_with(test_file("c_test.obj").c_str(), &options, &scene), QUOIN_INVALID_ARGUMENT);
  options = sized<quoin_load_options>();
  options.frame = -1;
  EXPECT_EQ(quoin_scene_load_with(test_file("c_test.obj").c_str(), &options, &scene), QUOIN_INVALID_ARGUMENT);
  options.size = 3;
  EXPECT_EQ(quoin_scene_load_with(test_file("c_test.obj").c_str(), &options, &scene), QUOIN_INVALID_ARGUMENT);
}

TEST(CLoading, SelectsDimension) {
  // A world of two dimensions, the overworld with the region of another.
  namespace fs = std::filesystem;
  const fs::path cases = QUOIN_SOURCE_DIR "/tests/corpus/cases";
  const std::string world = test_file("dimensions");
  fs::copy(cases / "minecraft-26.1-layout", world, fs::copy_options::recursive);
  fs::copy(cases / "minecraft-section-without-longs/region/r.0.0.mca",
           fs::path(world) / "dimensions/minecraft/overworld/region/r.0.0.mca", fs::copy_options::overwrite_existing);
  auto options = sized<quoin_load_options>();
  quoin_scene scene = 0;
  // The voxels of the world's first grid.
  const auto voxels_of = [&](const char* dimension) {
    options.dimension = dimension;
    EXPECT_EQ(quoin_scene_load_with(world.c_str(), &options, &scene), QUOIN_OK) << quoin_last_error();
    auto info = sized<quoin_grid_info>();
    EXPECT_EQ(quoin_grid_get_info(scene, 0, &info), QUOIN_OK);
    EXPECT_EQ(quoin_free(scene), QUOIN_OK);
    return info.voxels;
  };
  EXPECT_EQ(voxels_of(nullptr), 8192);
  EXPECT_EQ(voxels_of(""), 8192);
  EXPECT_EQ(voxels_of("minecraft:overworld"), 8192);
  EXPECT_EQ(voxels_of("nether"), 8704);
  options.dimension = "end";
  EXPECT_EQ(quoin_scene_load_with(world.c_str(), &options, &scene), QUOIN_INVALID_ARGUMENT);
  EXPECT_NE(std::string(quoin_last_error()).find("the world has minecraft:overworld, minecraft:the_nether"),
            std::string::npos)
      << quoin_last_error();
  // A program that was compiled with an older header has no such field.
  options.size = offsetof(quoin_load_options, dimension);
  EXPECT_EQ(quoin_scene_load_with(world.c_str(), &options, &scene), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

TEST(CLoading, ReadsRawValues) {
  // A box of 40 within 10, from (2, 0, 0) on, of 6 x 4 x 3 values of 16 bits, the most significant byte first.
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 6 * 4 * 3; ++i) bytes.insert(bytes.end(), {0, static_cast<std::uint8_t>(i % 6 >= 2 ? 40 : 10)});
  auto options = sized<quoin_load_options>();
  options.raw_shape[0] = 6;
  options.raw_shape[1] = 4;
  options.raw_shape[2] = 3;
  options.raw_scalar = QUOIN_UINT16;
  options.raw_big_endian = 1;
  options.has_iso = 1;
  options.iso = 25.0F;
  quoin_scene scene = 0;
  const auto load = [&] { return quoin_scene_load_bytes_with(bytes.data(), bytes.size(), &options, &scene); };
  ASSERT_EQ(load(), QUOIN_OK) << quoin_last_error();
  auto info = sized<quoin_grid_info>();
  ASSERT_EQ(quoin_grid_get_info(scene, 0, &info), QUOIN_OK);
  EXPECT_NE(info.has_field, 0);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
  options.raw_shape[2] = 4;  // more than there are
  EXPECT_EQ(load(), QUOIN_BAD_FORMAT);
  options.raw_shape[2] = -3;
  EXPECT_EQ(load(), QUOIN_INVALID_ARGUMENT);
  options.raw_shape[2] = 3;
  options.raw_scalar = 10;
  EXPECT_EQ(load(), QUOIN_INVALID_ARGUMENT);
  options.raw_scalar = QUOIN_UINT16;
  options.heights = QUOIN_HEIGHTS_GREY;
  EXPECT_EQ(load(), QUOIN_INVALID_ARGUMENT);
  // A program compiled with an older header lacks these fields: the bytes then have no known format.
  options.size = offsetof(quoin_load_options, raw_shape);
  EXPECT_EQ(load(), QUOIN_BAD_FORMAT);
  EXPECT_EQ(quoin_scene_load_bytes_with(nullptr, 3, nullptr, &scene), QUOIN_INVALID_ARGUMENT);
}

TEST(CLoading, ReadsHeights) {
  const std::vector<char> png = [] {
    std::ifstream file(QUOIN_SOURCE_DIR "/tests/corpus/png/grey_1_bit.png", std::ios::binary);
    return std::vector<char>(std::istreambuf_iterator<char>(file), {});
  }();
  auto options = sized<quoin_load_options>();
  quoin_scene scene = 0;
  const auto load = [&] { return quoin_scene_load_bytes_with(png.data(), png.size(), &options, &scene); };
  EXPECT_EQ(load(), QUOIN_BAD_FORMAT);
  options.heights = QUOIN_HEIGHTS_GREY;
  options.metres_per_pixel = 1.0;
  const auto height_of = [&] {
    EXPECT_EQ(load(), QUOIN_OK) << quoin_last_error();
    auto info = sized<quoin_grid_info>();
    EXPECT_EQ(quoin_grid_get_info(scene, 0, &info), QUOIN_OK);
    EXPECT_EQ(quoin_free(scene), QUOIN_OK);
    return info.extent[1];
  };
  const std::int32_t low = height_of();
  options.ground_depth = 18;
  EXPECT_EQ(height_of(), low + 10);
  options.exaggeration = 3.0;
  EXPECT_GT(height_of(), low + 10);
  options.exaggeration = -3.0;
  EXPECT_EQ(load(), QUOIN_INVALID_ARGUMENT);
  options.exaggeration = std::nan("");
  EXPECT_EQ(load(), QUOIN_INVALID_ARGUMENT);
  options.exaggeration = 0.0;
  options.heights = 4;
  EXPECT_EQ(load(), QUOIN_INVALID_ARGUMENT);
  options.heights = QUOIN_HEIGHTS_NONE;
  EXPECT_EQ(load(), QUOIN_INVALID_ARGUMENT);
}

}  // namespace

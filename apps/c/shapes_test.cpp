// Tests shapes, orientations and states through the C interface.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "quoin.h"
#include "structs_for_tests.h"

namespace {

thread_local std::int64_t allocations_left = -1;  // before one fails; negative: none fails

}  // namespace

// The library calls the operators of the test program.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  if (allocations_left >= 0 && allocations_left-- == 0) throw std::bad_alloc();
  if (void* const memory = std::malloc(bytes == 0 ? 1 : bytes)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace {

// A row of voxels along x: stone (1), then stairs (2) and a post (3).
class CShapes : public testing::Test {
 protected:
  CShapes() {
    EXPECT_EQ(quoin_scene_create(&scene_), QUOIN_OK);
    EXPECT_EQ(added(0), 1);
    EXPECT_EQ(added(4), 2);
    EXPECT_EQ(added(0), 3);
    auto array = sized<quoin_array>();
    array.data = voxels_.data();
    array.shape[0] = static_cast<std::int64_t>(voxels_.size());
    array.shape[1] = array.shape[2] = 1;
    EXPECT_EQ(quoin_grid_add(scene_, &array, nullptr, nullptr), QUOIN_OK) << quoin_last_error();
    EXPECT_EQ(quoin_type_set_shapes(scene_, 2, &shapes_of_stairs()), QUOIN_OK) << quoin_last_error();
    auto orientations = sized<quoin_orientations>();
    orientations.kind = QUOIN_ORIENTATIONS_ABOUT_Y_AND_UPSIDE_DOWN;
    orientations.first_bit = 1;
    EXPECT_EQ(quoin_type_set_orientations(scene_, 2, &orientations), QUOIN_OK) << quoin_last_error();
  }
  ~CShapes() override { EXPECT_EQ(quoin_free(scene_), QUOIN_OK); }
  CShapes(const CShapes&) = delete;
  CShapes& operator=(const CShapes&) = delete;

  std::uint16_t added(int state_bits) {
    auto type = sized<quoin_type>();
    type.rgba[0] = 90;
    type.rgba[3] = 255;
    type.roughness = 1.0F;
    type.state_bits = state_bits;
    std::uint16_t number = 0;
    EXPECT_EQ(quoin_type_add(scene_, &type, &number), QUOIN_OK) << quoin_last_error();
    return number;
  }

  static quoin_shape_element box(std::array<float, 3> min, std::array<float, 3> max) {
    auto made = sized<quoin_shape_element>();
    std::copy(min.begin(), min.end(), made.min);
    std::copy(max.begin(), max.end(), made.max);
    return made;
  }

  // A slab, and the half on it that state bit 0 removes.
  const quoin_shapes& shapes_of_stairs() {
    parts_ = {sized<quoin_shape_part>(), sized<quoin_shape_part>()};
    parts_[0].element_count = parts_[1].element_count = parts_[1].condition_count = 1;
    elements_ = {box({0, 0, 0}, {16, 8, 16}), box({8, 8, 0}, {16, 16, 16})};
    conditions_ = {sized<quoin_shape_condition>()};
    conditions_[0].state_mask = 1;
    return list();
  }

  const quoin_shapes& list() {
    shapes_ = sized<quoin_shapes>();
    shapes_.parts = parts_.data();
    shapes_.part_count = parts_.size();
    shapes_.elements = elements_.data();
    shapes_.element_count = elements_.size();
    shapes_.conditions = conditions_.data();
    shapes_.condition_count = conditions_.size();
    shapes_.looks = looks_.data();
    shapes_.look_count = looks_.size();
    shapes_.groups = 1;
    return shapes_;
  }

  quoin_status write(const std::vector<std::uint32_t>& states) {
    auto array = sized<quoin_array>();
    array.data = states.data();
    array.scalar = QUOIN_UINT32;
    array.shape[0] = static_cast<std::int64_t>(states.size());
    array.shape[1] = array.shape[2] = 1;
    return quoin_grid_write_states(scene_, 0, &array);
  }

  std::vector<std::uint32_t> states() {
    const std::array<std::int32_t, 3> min{0, 0, 0};
    const std::array<std::int32_t, 3> shape{static_cast<std::int32_t>(voxels_.size()), 1, 1};
    std::vector<std::uint32_t> read(voxels_.size(), 99);
    EXPECT_EQ(quoin_grid_read_states(scene_, 0, min.data(), shape.data(), read.data(), read.size()), QUOIN_OK);
    return read;
  }

  // The bounds of a type's faces in the grid's mesh, and their number.
  struct Faces {
    std::array<float, 3> min{9, 9, 9};
    std::array<float, 3> max{-9, -9, -9};
    std::size_t count = 0;
    float darkest = 0.0F;
  };
  Faces faces(std::uint16_t type) {
    quoin_mesh mesh = 0;
    EXPECT_EQ(quoin_grid_mesh(scene_, 0, nullptr, &mesh), QUOIN_OK) << quoin_last_error();
    auto data = sized<quoin_mesh_data>();
    EXPECT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
    Faces found;
    for (std::size_t i = 0; i < data.vertex_count; ++i) {
      if (data.types[i] != type) continue;
      found.count += i % 4 == 0 ? 1 : 0;
      found.darkest = std::max(found.darkest, data.occlusion[i]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        found.min[axis] = std::min(found.min[axis], data.positions[3 * i + axis]);
        found.max[axis] = std::max(found.max[axis], data.positions[3 * i + axis]);
      }
    }
    EXPECT_EQ(data.index_count, data.vertex_count / 4 * 6);
    EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
    return found;
  }

  std::string error(const quoin_shapes& shapes) {
    EXPECT_EQ(quoin_type_set_shapes(scene_, 3, &shapes), QUOIN_INVALID_ARGUMENT);
    return quoin_last_error();
  }

  quoin_scene scene_ = 0;
  std::vector<std::uint8_t> voxels_{1, 2, 0, 3};
  std::vector<quoin_shape_part> parts_;
  std::vector<quoin_shape_element> elements_;
  std::vector<quoin_shape_condition> conditions_;
  std::vector<quoin_face> looks_;
  quoin_shapes shapes_{};
};

TEST_F(CShapes, StatesSelectPartsAndOrientations) {
  EXPECT_EQ(states(), std::vector<std::uint32_t>(4, 0));
  EXPECT_EQ(faces(2).max[1], 1.0F);
  EXPECT_GT(faces(2).count, 6U);
  EXPECT_GT(faces(2).darkest, 0.0F) << "the step's corner is darkened";
  ASSERT_EQ(write({0, 1, 7, 0}), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(states(), (std::vector<std::uint32_t>{0, 1, 0, 0})) << "air has no state";
  EXPECT_EQ(faces(2).max[1], 0.5F) << "only the slab";
  ASSERT_EQ(write({0, 0b1001, 0, 0}), QUOIN_OK);
  EXPECT_EQ(faces(2).min[1], 0.5F) << "upside down";

  // The state's bits are those of the type; then nothing changes.
  EXPECT_EQ(write({1, 2, 0, 0}), QUOIN_INVALID_ARGUMENT);
  EXPECT_NE(std::string(quoin_last_error()).find("type 1 has 0 state bits"), std::string::npos) << quoin_last_error();
  EXPECT_EQ(write({0, 16, 0, 0}), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(states()[1], 0b1001U);
  // Another type loses the state, the same type keeps it.
  auto array = sized<quoin_array>();
  array.data = voxels_.data();
  array.shape[0] = 2;
  array.shape[1] = array.shape[2] = 1;
  ASSERT_EQ(quoin_grid_write(scene_, 0, &array), QUOIN_OK);
  EXPECT_EQ(states()[1], 0b1001U);
}

TEST_F(CShapes, AreReadBackAndKeptInFiles) {
  looks_ = {sized<quoin_face>(), sized<quoin_face>()};
  std::vector<std::uint8_t> texels(std::size_t{4} * 16 * 16, 255);
  for (std::size_t i = 0; i < texels.size(); i += 4) texels[i] = static_cast<std::uint8_t>(i);
  std::strcpy(looks_[0].name, "bark");
  looks_[0].rgba = texels.data();
  looks_[0].texels = 16;
  looks_[0].turn = 3;
  looks_[1].has_tint = 1;
  looks_[1].tint[1] = 200;
  parts_ = {sized<quoin_shape_part>(), sized<quoin_shape_part>()};
  parts_[0].element_count = 2;
  parts_[0].orientation = 29;
  parts_[1].element_count = 1;
  parts_[1].condition_count = 2;
  elements_ = {box({6, 0, 6}, {10, 16, 10}), box({0, 3, 8}, {16, 3, 24}), box({1, 2, 3}, {4, 5, 6})};
  elements_[0].looks[2] = 1;
  elements_[0].looks[3] = 2;
  elements_[0].looks[4] = QUOIN_LOOK_NONE;
  elements_[0].has_parts = 0b100;
  elements_[0].parts[2][0] = 12.5F;
  elements_[0].parts[2][3] = -1.0F;
  elements_[1].has_turn = 1;
  elements_[1].turn_axis = 0;
  elements_[1].turn_degrees = 22.5F;
  elements_[1].turn_origin[1] = 3.0F;
  elements_[1].turn_origin[2] = 8.0F;
  elements_[1].turn_rescales = 1;
  elements_[1].passable = 1;
  conditions_ = {sized<quoin_shape_condition>(), sized<quoin_shape_condition>()};
  conditions_[0].connected = 0b1;
  conditions_[0].unconnected = 0b10'0000;
  conditions_[1].corner = QUOIN_CORNER_INNER_RIGHT;
  conditions_[1].position_count = 12;
  conditions_[1].position_first = 3;
  conditions_[1].position_end = 7;
  quoin_shapes given = list();
  given.neighbours = QUOIN_NEIGHBOURS_CONNECTED;
  given.groups = 6;
  given.ignores_full_sides = 1;
  ASSERT_EQ(quoin_type_set_shapes(scene_, 3, &given), QUOIN_OK) << quoin_last_error();

  const std::string path = test_file("shapes.json");
  ASSERT_EQ(quoin_scene_save(scene_, path.c_str()), QUOIN_OK) << quoin_last_error();
  quoin_scene again = 0;
  ASSERT_EQ(quoin_scene_load(path.c_str(), &again), QUOIN_OK) << quoin_last_error();
  for (const quoin_scene scene : {scene_, again}) {
    quoin_textures textures = 0;
    ASSERT_EQ(quoin_scene_textures(scene, 0, &textures), QUOIN_OK);
    auto whole = sized<quoin_shapes>();
    ASSERT_EQ(quoin_textures_shapes(textures, 3, &whole), QUOIN_OK) << quoin_last_error();
    ASSERT_EQ(whole.part_count, 2U);
    ASSERT_EQ(whole.element_count, 3U);
    ASSERT_EQ(whole.condition_count, 2U);
    ASSERT_EQ(whole.look_count, 2U);
    EXPECT_EQ(whole.parts, nullptr);
    EXPECT_EQ(whole.neighbours, QUOIN_NEIGHBOURS_CONNECTED);
    EXPECT_EQ(whole.groups, 6U);
    EXPECT_EQ(whole.ignores_full_sides, 1);
    std::vector parts(2, sized<quoin_shape_part>());
    std::vector elements(3, sized<quoin_shape_element>());
    std::vector conditions(2, sized<quoin_shape_condition>());
    std::vector looks(2, sized<quoin_face>());
    ASSERT_EQ(quoin_textures_read_shapes(textures, 3, parts.data(), elements.data(), conditions.data(), looks.data()),
              QUOIN_OK);
    const auto equal = [](const auto& a, const auto& b) {
      return std::memcmp(a.data(), b.data(), sizeof a[0] * a.size()) == 0;
    };
    EXPECT_TRUE(equal(parts, parts_));
    EXPECT_TRUE(equal(elements, elements_));
    EXPECT_TRUE(equal(conditions, conditions_));
    EXPECT_STREQ(looks[0].name, "bark");
    EXPECT_EQ(looks[0].turn, 3);
    EXPECT_EQ(looks[0].texture, 0U);
    EXPECT_TRUE(std::equal(texels.begin(), texels.end(), looks[0].rgba));
    EXPECT_EQ(looks[1].rgba, nullptr);
    EXPECT_EQ(looks[1].texels, 0);
    EXPECT_EQ(looks[1].tint[1], 200);
    EXPECT_EQ(looks[1].texture, QUOIN_NO_TEXTURE);
    // The same look of a second element keeps its number, and null arrays are not filled.
    ASSERT_EQ(quoin_textures_read_shapes(textures, 3, nullptr, nullptr, nullptr, nullptr), QUOIN_OK);
    ASSERT_EQ(quoin_textures_shapes(textures, 1, &whole), QUOIN_OK);
    EXPECT_EQ(whole.part_count, 0U);
    EXPECT_EQ(whole.neighbours, QUOIN_NEIGHBOURS_NONE);
    EXPECT_EQ(quoin_free(textures), QUOIN_OK);
  }
  EXPECT_EQ(quoin_free(again), QUOIN_OK);
  // A cube again.
  EXPECT_LT(faces(3).max[0] - faces(3).min[0], 4.0F);
  ASSERT_EQ(quoin_type_set_shapes(scene_, 3, nullptr), QUOIN_OK);
  EXPECT_EQ(faces(3).count, 6U);
}

// A fence with water if bit 0 of the state is set, as in packs.
TEST_F(CShapes, KeepContainedFluids) {
  quoin_shapes given = shapes_of_stairs();
  conditions_.resize(3, sized<quoin_shape_condition>());
  conditions_[1].state_mask = conditions_[1].state = 1;
  conditions_[2].state_mask = conditions_[2].state = 4;
  given = list();
  given.fluid_groups = 4;
  given.fluid_condition_count = 2;
  ASSERT_EQ(quoin_type_set_shapes(scene_, 2, &given), QUOIN_OK) << quoin_last_error();
  quoin_textures textures = 0;
  ASSERT_EQ(quoin_scene_textures(scene_, 0, &textures), QUOIN_OK);
  auto whole = sized<quoin_shapes>();
  ASSERT_EQ(quoin_textures_shapes(textures, 2, &whole), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(whole.fluid_groups, 4U);
  EXPECT_EQ(whole.fluid_condition_count, 2U);
  ASSERT_EQ(whole.condition_count, 3U);
  std::vector conditions(3, sized<quoin_shape_condition>());
  ASSERT_EQ(quoin_textures_read_shapes(textures, 2, nullptr, nullptr, conditions.data(), nullptr), QUOIN_OK);
  EXPECT_EQ(std::memcmp(conditions.data(), conditions_.data(), 3 * sizeof conditions[0]), 0);

  given.fluid_condition_count = 4;
  EXPECT_EQ(error(given), "the fluid has more conditions than the array");
  given.fluid_condition_count = 1;
  EXPECT_EQ(error(given), "the shapes have elements or conditions that no part counts");
  given.fluid_condition_count = 2;
  conditions_[2].connected = 1;
  EXPECT_NE(error(given).find("fluid"), std::string::npos) << "a condition of neighbours";
  conditions_[2].connected = 0;
  given.fluid_groups = 0;
  EXPECT_EQ(error(given), "the fluid has conditions, but no groups");
  // A program compiled with an older header reads all conditions, and writes the shapes back without the fluid.
  given.size = whole.size = offsetof(quoin_shapes, fluid_groups);
  ASSERT_EQ(quoin_textures_shapes(textures, 2, &whole), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(whole.condition_count, 3U);
  EXPECT_EQ(quoin_type_set_shapes(scene_, 2, &given), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(quoin_free(textures), QUOIN_OK);
}

// Structs of the header before shares of positions had 32 bytes.
TEST_F(CShapes, TakeConditionsOfAnOlderHeader) {
  constexpr std::size_t kOldSize = offsetof(quoin_shape_condition, position_count);
  EXPECT_EQ(kOldSize, 32U);
  quoin_shapes given = shapes_of_stairs();
  conditions_[0].size = kOldSize;
  ASSERT_EQ(quoin_type_set_shapes(scene_, 2, &given), QUOIN_OK) << quoin_last_error();
  quoin_textures textures = 0;
  ASSERT_EQ(quoin_scene_textures(scene_, 0, &textures), QUOIN_OK);
  auto read = sized<quoin_shape_condition>();
  read.size = kOldSize;
  read.position_count = 99;
  ASSERT_EQ(quoin_textures_read_shapes(textures, 2, nullptr, nullptr, &read, nullptr), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(read.state_mask, 1U);
  EXPECT_EQ(read.position_count, 99U) << "is not written";
  EXPECT_EQ(quoin_free(textures), QUOIN_OK);
  conditions_[0].size = kOldSize - 4;
  EXPECT_EQ(error(given), "the condition 0 is null, or its size");
}

TEST_F(CShapes, AcceptFluidsWithoutParts) {
  auto water = sized<quoin_shapes>();
  water.neighbours = QUOIN_NEIGHBOURS_FLUID;
  water.groups = 1;
  ASSERT_EQ(quoin_type_set_shapes(scene_, 3, &water), QUOIN_OK) << quoin_last_error();
  EXPECT_FLOAT_EQ(faces(3).max[1], 11.0F / 16.0F) << "inclined towards air on all sides";
}

TEST_F(CShapes, ErrorsNamePartsElementsAndLooks) {
  quoin_shapes wrong = shapes_of_stairs();
  elements_[1].max[1] = 33.0F;
  EXPECT_EQ(error(wrong),
            "part 1 of the shapes: cannot use element 0 of a shape: a corner is outside -16 to 32 sixteenths");
  elements_[1].max[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(error(wrong), "part 1 of the shapes: cannot use element 0 of a shape: a corner is not finite");
  elements_[1].max[1] = 16.0F;
  elements_[1].looks[4] = 1;
  EXPECT_EQ(error(wrong), "element 1: no look has the number 1");
  elements_[1].looks[4] = -2;
  EXPECT_EQ(error(wrong), "element 1: no look has the number -2");
  elements_[1].looks[4] = 0;
  parts_[1].orientation = 48;
  EXPECT_EQ(error(wrong), "part 1 of the shapes: an orientation must be 0 to 47");
  parts_[1].orientation = 0;
  parts_[1].element_count = 2;
  EXPECT_EQ(error(wrong), "part 1 of the shapes: it has more elements or conditions than the arrays");
  parts_[1].element_count = std::numeric_limits<std::size_t>::max();
  EXPECT_EQ(error(wrong), "part 1 of the shapes: it has more elements or conditions than the arrays");
  parts_[1].element_count = 1;
  parts_[1].condition_count = 0;
  EXPECT_EQ(error(wrong), "the shapes have elements or conditions that no part counts");
  parts_[1].condition_count = 1;
  conditions_[0].connected = 64;
  EXPECT_EQ(error(wrong), "condition 0: connected and unconnected have a bit per direction");
  conditions_[0].connected = 0;
  conditions_[0].corner = 6;
  EXPECT_EQ(error(wrong), "condition 0: the corner is not a QUOIN_CORNER value");
  conditions_[0].corner = 0;
  conditions_[0].size = 3;
  EXPECT_EQ(error(wrong), "the condition 0 is null, or its size");
  conditions_[0].size = sizeof(quoin_shape_condition);
  wrong.neighbours = 4;
  EXPECT_EQ(error(wrong), "neighbours is not a QUOIN_NEIGHBOURS value");
  wrong.neighbours = 0;
  wrong.element_count = 513;
  EXPECT_EQ(error(wrong), "a type has at most 512 elements of shapes");
  wrong.element_count = 2;
  wrong.parts = nullptr;
  EXPECT_EQ(error(wrong), "an array of the shapes is null, but has a count");
  wrong.parts = parts_.data();
  // The condition uses bit 0, which type 3 does not have.
  EXPECT_NE(error(wrong).find("state_bits"), std::string::npos);
  looks_ = {sized<quoin_face>()};
  looks_[0].texels = 15;
  EXPECT_EQ(error(list()), "look 0: the texels of a face are null");
  looks_[0].alpha = 3;
  EXPECT_EQ(error(list()), "look 0: the alpha of a face is not a QUOIN_FACE value");
  EXPECT_EQ(faces(3).count, 6U) << "nothing has changed";
  EXPECT_EQ(quoin_type_set_shapes(scene_, 0, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_type_set_shapes(scene_, 4, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_textures_shapes(scene_, 1, &wrong), QUOIN_BAD_HANDLE);
}

TEST_F(CShapes, OrientationsAreReadBack) {
  auto read = sized<quoin_orientations>();
  ASSERT_EQ(quoin_type_get_orientations(scene_, 2, &read), QUOIN_OK);
  EXPECT_EQ(read.kind, QUOIN_ORIENTATIONS_ABOUT_Y_AND_UPSIDE_DOWN);
  EXPECT_EQ(read.first_bit, 1);
  EXPECT_EQ(read.count, 8);
  ASSERT_EQ(quoin_type_get_orientations(scene_, 1, &read), QUOIN_OK);
  EXPECT_EQ(read.count, 0);
  auto listed = sized<quoin_orientations>();
  listed.front = 5;
  listed.count = 2;
  std::int32_t turned = 0;
  ASSERT_EQ(quoin_orientation_turn(0, 0, 2, &turned), QUOIN_OK);
  listed.by_value[1] = static_cast<std::uint8_t>(turned);
  ASSERT_EQ(quoin_type_set_orientations(scene_, 2, &listed), QUOIN_OK) << quoin_last_error();
  ASSERT_EQ(quoin_type_get_orientations(scene_, 2, &read), QUOIN_OK);
  EXPECT_EQ(std::memcmp(&read, &listed, sizeof read), 0);
  ASSERT_EQ(quoin_type_set_orientations(scene_, 2, nullptr), QUOIN_OK);
  ASSERT_EQ(quoin_type_get_orientations(scene_, 2, &read), QUOIN_OK);
  EXPECT_EQ(read.count, 0);
  // A quarter turn about y takes +X to -Z, and four of them turn nothing. Negative turns go the other way.
  ASSERT_EQ(quoin_orientation_turn(0, 1, 1, &turned), QUOIN_OK);
  EXPECT_EQ(turned, 8 * 5 + 4) << "the new x is the old z, the new z the old -x";
  ASSERT_EQ(quoin_orientation_turn(turned, 1, std::numeric_limits<std::int32_t>::min() + 3, &turned), QUOIN_OK);
  EXPECT_EQ(turned, 0);
  EXPECT_EQ(quoin_orientation_turn(48, 1, 1, &turned), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_orientation_turn(0, 3, 1, &turned), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_orientation_turn(0, 0, 1, nullptr), QUOIN_INVALID_ARGUMENT);

  const auto refuses = [&](auto&& change) {
    auto wrong = sized<quoin_orientations>();
    change(wrong);
    return quoin_type_set_orientations(scene_, 2, &wrong) == QUOIN_INVALID_ARGUMENT;
  };
  EXPECT_TRUE(refuses([](auto& wrong) { wrong.kind = 5; }));
  EXPECT_TRUE(refuses([](auto& wrong) { wrong.front = 6; }));
  EXPECT_TRUE(refuses([](auto& wrong) { wrong.first_bit = 32; }));
  EXPECT_TRUE(refuses([](auto& wrong) { wrong.count = 49; }));
  EXPECT_TRUE(refuses([](auto& wrong) { wrong.count = 1, wrong.by_value[0] = 48; }));
  EXPECT_TRUE(refuses([](auto& wrong) { wrong.kind = QUOIN_ORIENTATIONS_ABOUT_Y, wrong.first_bit = 3; }));
  EXPECT_TRUE(refuses([](auto& wrong) { wrong.size = 1; }));
}

TEST_F(CShapes, StatesArePlacedAndTurned) {
  auto placing = sized<quoin_placing>();
  placing.face = 4;  // +Z
  placing.look[2] = -2.0;
  placing.point[1] = 0.75F;
  std::uint32_t state = 99;
  ASSERT_EQ(quoin_type_placed_state(scene_, 2, &placing, 0, &state), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(state, (4U + 1U) << 1U) << "upside down, the front (+X) turned to -Z";
  placing.front = QUOIN_FRONT_TOWARDS_PLAYER;
  placing.point[1] = 0.25F;
  ASSERT_EQ(quoin_type_placed_state(scene_, 2, &placing, 1, &state), QUOIN_OK);
  EXPECT_EQ(state, 1U | 3U << 1U) << "the front turned to +Z, bit 0 kept";
  std::int32_t half = 0;
  ASSERT_EQ(quoin_orientation_turn(0, 1, 2, &half), QUOIN_OK);
  ASSERT_EQ(quoin_type_turned_state(scene_, 2, state, half, &state), QUOIN_OK);
  EXPECT_EQ(state, 1U | 1U << 1U);

  EXPECT_EQ(quoin_type_turned_state(scene_, 2, 0, 48, &state), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_type_turned_state(scene_, 4, 0, 0, &state), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_type_turned_state(scene_, 2, 0, 0, nullptr), QUOIN_INVALID_ARGUMENT);
  placing.front = 4;
  EXPECT_EQ(quoin_type_placed_state(scene_, 2, &placing, 0, &state), QUOIN_INVALID_ARGUMENT);
  placing.front = 0;
  placing.face = 6;
  EXPECT_EQ(quoin_type_placed_state(scene_, 2, &placing, 0, &state), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_type_placed_state(scene_, 2, nullptr, 0, &state), QUOIN_INVALID_ARGUMENT);
}

TEST_F(CShapes, StayWhenTypesAreReplaced) {
  auto type = sized<quoin_type>();
  ASSERT_EQ(quoin_type_get(scene_, 2, &type), QUOIN_OK);
  EXPECT_EQ(type.blocks_light, 0) << "shapes let light through";
  type.blocks_light = 1;
  type.rgba[0] = 7;
  ASSERT_EQ(quoin_type_set(scene_, 2, &type), QUOIN_OK) << quoin_last_error();
  const Faces stairs = faces(2);
  EXPECT_GT(stairs.count, 6U);
  ASSERT_EQ(quoin_type_get(scene_, 2, &type), QUOIN_OK);
  EXPECT_EQ(type.blocks_light, 1);
  EXPECT_EQ(type.rgba[0], 7);
  type.state_bits = 3;
  EXPECT_EQ(quoin_type_set(scene_, 2, &type), QUOIN_INVALID_ARGUMENT) << "its orientations need bits 1 to 3";
  type.state_bits = 33;
  EXPECT_EQ(quoin_type_set(scene_, 2, &type), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_type_set(scene_, 2, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_type_set(scene_, 0, &type), QUOIN_INVALID_ARGUMENT);
  ASSERT_EQ(quoin_type_get(scene_, 2, &type), QUOIN_OK);
  EXPECT_EQ(type.state_bits, 4);
}

TEST_F(CShapes, StatesStayWhenTypesDeclareFewerBits) {
  ASSERT_EQ(write({0, 0b1001, 0, 0}), QUOIN_OK);
  ASSERT_EQ(quoin_type_set_shapes(scene_, 2, nullptr), QUOIN_OK);
  ASSERT_EQ(quoin_type_set_orientations(scene_, 2, nullptr), QUOIN_OK);
  auto type = sized<quoin_type>();
  ASSERT_EQ(quoin_type_get(scene_, 2, &type), QUOIN_OK);
  type.state_bits = 3;
  ASSERT_EQ(quoin_type_set(scene_, 2, &type), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(states()[1], 0b1001U);
  const std::string path = test_file("fewer_bits.json");
  EXPECT_NE(quoin_scene_save(scene_, path.c_str()), QUOIN_OK);
  EXPECT_NE(std::string(quoin_last_error()).find("more than the 3 bits"), std::string::npos) << quoin_last_error();
  ASSERT_EQ(write({0, 1, 0, 0}), QUOIN_OK);
  EXPECT_EQ(quoin_scene_save(scene_, path.c_str()), QUOIN_OK) << quoin_last_error();
}

TEST_F(CShapes, FailedWritesOfStatesChangeNothing) {
  // Three chunks along x, without a state at first and with some later.
  const std::vector<std::uint8_t> stairs(150, 2);
  auto array = sized<quoin_array>();
  array.data = stairs.data();
  array.shape[0] = static_cast<std::int64_t>(stairs.size());
  array.shape[1] = array.shape[2] = 1;
  std::size_t grid = 0;
  ASSERT_EQ(quoin_grid_add(scene_, &array, nullptr, &grid), QUOIN_OK) << quoin_last_error();
  const auto read = [&] {
    const std::array<std::int32_t, 3> min{0, 0, 0};
    const std::array<std::int32_t, 3> shape{150, 1, 1};
    std::vector<std::uint32_t> all(150, 99);
    EXPECT_EQ(quoin_grid_read_states(scene_, grid, min.data(), shape.data(), all.data(), all.size()), QUOIN_OK);
    return all;
  };
  std::vector<std::uint32_t> before(150, 0);
  for (const std::uint32_t turn : {1U, 2U}) {
    std::vector<std::uint32_t> states(150);
    for (std::size_t i = 0; i < states.size(); ++i) states[i] = (turn * static_cast<std::uint32_t>(i)) % 16U;
    array.data = states.data();
    array.scalar = QUOIN_UINT32;
    int failures = 0;
    quoin_status status = QUOIN_OUT_OF_MEMORY;
    for (std::int64_t n = 0; status != QUOIN_OK; ++n) {
      allocations_left = n;
      status = quoin_grid_write_states(scene_, grid, &array);
      allocations_left = -1;
      if (status == QUOIN_OK) break;
      ASSERT_EQ(status, QUOIN_OUT_OF_MEMORY);
      ASSERT_EQ(read(), before) << "allocation " << n << " failed";
      ++failures;
    }
    EXPECT_GT(failures, 5);
    EXPECT_EQ(read(), states);
    before = states;
  }
}

TEST_F(CShapes, TypesDeclareStateBits) {
  auto type = sized<quoin_type>();
  ASSERT_EQ(quoin_type_get(scene_, 2, &type), QUOIN_OK);
  EXPECT_EQ(type.state_bits, 4);
  EXPECT_EQ(type.passable, 0);
  type.passable = 1;
  std::uint16_t number = 0;
  ASSERT_EQ(quoin_type_add(scene_, &type, &number), QUOIN_OK);
  ASSERT_EQ(quoin_type_get(scene_, number, &type), QUOIN_OK);
  EXPECT_EQ(type.passable, 1);
  type.state_bits = 33;
  EXPECT_EQ(quoin_type_add(scene_, &type, &number), QUOIN_INVALID_ARGUMENT);
  // A program compiled before types had states.
  struct Older {
    quoin_type type{};
    std::uint64_t beyond = ~std::uint64_t{0};
  } older;
  older.type.size = offsetof(quoin_type, state_bits);
  std::memset(&older.type.reserved, 0xFF, sizeof older.type - offsetof(quoin_type, reserved));
  older.type.roughness = 1.0F;
  ASSERT_EQ(quoin_type_add(scene_, &older.type, &number), QUOIN_OK) << quoin_last_error();
  ASSERT_EQ(quoin_type_get(scene_, number, &type), QUOIN_OK);
  EXPECT_EQ(type.state_bits, 0);
}

}  // namespace

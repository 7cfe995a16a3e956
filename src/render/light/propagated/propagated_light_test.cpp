#include <quoin/render/propagated_light.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/mesh/blocky.h>

#include "core/death_for_tests.h"
#include "core/instruction_sets_for_tests.h"
#include "core/work/nightly_for_tests.h"
#include "render/light/propagated/chunk_masks.h"

namespace quoin {
namespace {

constexpr VoxelType kStone = 1, kLamp = 2, kRedLamp = 3, kGlass = 4, kBlueGlass = 5, kGlowGlass = 6;
constexpr VoxelType kWater = 7, kLeaves = 8, kThickWater = 9, kStairs = 10, kDimStairs = 11, kGlowStairs = 12,
                    kGrate = 13, kFog = 14;

// As `light_types`, and then types with costs, types that light enters and does not leave, and an opaque one that it
// passes.
VoxelRegistry light_types();
VoxelRegistry costly_types() {
  VoxelRegistry types = light_types();
  const auto add = [&](Rgba8 colour, Visibility visibility, float emission, std::uint8_t cost,
                       std::optional<bool> blocks_light = {}) {
    VoxelProperties properties;
    properties.colour = colour;
    properties.visibility = visibility;
    properties.emission = emission;
    properties.light_cost = cost;
    properties.blocks_light = blocks_light;
    EXPECT_TRUE(types.add(properties));
  };
  add({60, 80, 250, 90}, Visibility::Transparent, 0.0F, 1);
  add({240, 250, 200, 255}, Visibility::Transparent, 0.0F, 2);
  add({60, 250, 250, 90}, Visibility::Transparent, 0.4F, 3);
  add({150, 110, 70, 255}, Visibility::Transparent, 0.0F, 0, true);
  add({150, 110, 70, 255}, Visibility::Transparent, 0.0F, 5, true);
  add({250, 20, 250, 255}, Visibility::Transparent, 0.5F, 2, true);
  add({200, 60, 40, 255}, Visibility::Opaque, 0.0F, 0, false);
  add({200, 200, 200, 255}, Visibility::Transparent, 0.0F, 15);
  return types;
}

VoxelRegistry light_types() {
  VoxelRegistry types;
  const auto add = [&](Rgba8 colour, Visibility visibility, float emission) {
    VoxelProperties properties;
    properties.colour = colour;
    properties.visibility = visibility;
    properties.emission = emission;
    EXPECT_TRUE(types.add(properties));
  };
  add({120, 120, 120, 255}, Visibility::Opaque, 0.0F);
  add({255, 220, 160, 255}, Visibility::Opaque, 1.0F);
  add({250, 30, 0, 255}, Visibility::Opaque, 0.6F);
  add({240, 240, 240, 60}, Visibility::Transparent, 0.0F);
  add({20, 40, 250, 60}, Visibility::Transparent, 0.0F);
  add({100, 255, 100, 60}, Visibility::Transparent, 2.0F);
  return types;
}

// As `light_types`, and then types with shapes.
VoxelRegistry shaped_types() {
  VoxelRegistry types = light_types();
  const auto add = [&](VoxelProperties properties, VoxelShapes shapes) {
    properties.colour = {180, 20, 180, 255};
    properties.shapes = std::move(shapes);
    properties.state_bits = 3;
    if (properties.orientations.empty()) properties.orientations = StateOrientations::to_directions();
    EXPECT_TRUE(types.add(properties));
  };
  const VoxelShape slab = VoxelShape::box({0, 0, 0}, {16, 8, 16});
  add({.name = "slab"}, slab);
  add({.name = "glass slab", .visibility = Visibility::Transparent}, slab);
  add({.name = "glowing slab", .emission = 0.7F}, slab);
  add({.name = "thick slab", .light_cost = 3}, slab);
  add({.name = "dark slab", .blocks_light = true}, slab);
  add({.name = "light slab", .blocks_light = false}, slab);
  add({.name = "door", .orientations = StateOrientations::about_y()}, VoxelShape::box({13, 0, 0}, {16, 16, 16}));
  add({.name = "corner"}, VoxelShape::boxes({{{0, 0, 0}, {16, 2, 16}}, {{0, 0, 0}, {2, 16, 16}}}));
  add({.name = "full"}, VoxelShape::box({0, 0, 0}, {16, 16, 16}));
  std::vector<ShapePart> plates = {{.shape = VoxelShape::box({6, 6, 6}, {10, 10, 10})}};
  for (const AxisOrientation& turn : StateOrientations::to_directions().by_value) {
    plates.push_back({.shape = VoxelShape::box({0, 15, 0}, {16, 16, 16}),
                      .orientation = turn,
                      .when = {{.connected = {turn.apply(Direction::PosY)}}}});
  }
  add({.name = "plates"},
      *VoxelShapes::from_rules({.parts = std::move(plates), .neighbours = ShapeNeighbours::Connected}));
  const auto quarter = [](int x, int z) { return VoxelShape::box({x, 8, z}, {x + 8, 16, z + 8}); };
  const auto at = [](StairCorner corner) { return ShapeCondition{.corner = corner}; };
  using enum StairCorner;
  add({.name = "stairs", .orientations = StateOrientations::about_y_and_upside_down()},
      *VoxelShapes::from_rules(
          {.parts = {{.shape = slab},
                     {.shape = quarter(8, 0), .when = {at(Straight), at(OuterLeft), at(InnerLeft), at(InnerRight)}},
                     {.shape = quarter(8, 8), .when = {at(Straight), at(OuterRight), at(InnerLeft), at(InnerRight)}},
                     {.shape = quarter(0, 0), .when = {at(InnerLeft)}},
                     {.shape = quarter(0, 8), .when = {at(InnerRight)}}},
           .neighbours = ShapeNeighbours::Stairs}));
  return types;
}

/// Searches from every lamp and all of the sky, level by level, one voxel at a time. Its box contains all voxels plus
/// the range of light, so that light from outside reaches a voxel in the middle only as sky light.
class Search {
 public:
  Search(const Grid& grid, const VoxelRegistry& types, const IBox& box)
      : grid_(grid), types_(types), box_(box), size_(box.max - box.min) {
    levels_.resize(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y) *
                   static_cast<std::size_t>(size_.z));
    for (int channel = 0; channel < 4; ++channel) find(channel);
  }
  [[nodiscard]] std::uint16_t at(IVec3 voxel) const {
    unsigned word = 0;
    for (std::size_t c = 0; c < 4; ++c) word |= static_cast<unsigned>(levels_[index(voxel)][c]) << (4 * c);
    return static_cast<std::uint16_t>(word);
  }

 private:
  [[nodiscard]] std::size_t index(IVec3 voxel) const {
    const IVec3 p = voxel - box_.min;
    return static_cast<std::size_t>(p.x + size_.x * (p.y + size_.y * p.z));
  }
  [[nodiscard]] bool passes(IVec3 voxel, int channel) const {
    const VoxelType type = grid_.get(voxel);
    if (type == kAir) return true;
    if (type >= types_.size()) return false;
    const VoxelProperties& properties = types_[type];
    if (properties.blocks_light.value_or(is_opaque(properties))) {
      // Light enters only where faces behind it show, and where it has no light of its own.
      return !is_opaque(properties) && lamp(type, channel) == 0;
    }
    const Rgba8& colour = types_[type].colour;
    const std::array<int, 3> rgb{colour.r, colour.g, colour.b};
    return channel == 0 || properties.visibility == Visibility::Opaque ||
           2 * rgb.at(static_cast<std::size_t>(channel) - 1) >= *std::max_element(rgb.begin(), rgb.end());
  }
  [[nodiscard]] static bool is_opaque(const VoxelProperties& properties) {
    return properties.shapes.empty() && properties.visibility == Visibility::Opaque;
  }
  // Returns true if the shape of a voxel covers a side.
  [[nodiscard]] bool covers(IVec3 voxel, Direction side) const {
    const VoxelType type = grid_.get(voxel);
    if (type >= types_.size() || types_[type].shapes.empty()) return false;
    if (types_[type].visibility != Visibility::Opaque || types_[type].blocks_light) return false;
    return shape_at(grid_, types_, voxel)->covers_side.at(static_cast<std::size_t>(side));
  }
  [[nodiscard]] int lamp(VoxelType type, int channel) const {
    const LightLevels lamp = propagated::lamp_levels(types_[type]);
    return channel == 0 ? 0
                        : std::array<int, 3>{lamp.red, lamp.green, lamp.blue}.at(static_cast<std::size_t>(channel) - 1);
  }
  // Returns true if light that entered the voxel stays in it.
  [[nodiscard]] bool absorbs(IVec3 voxel, int channel) const {
    const VoxelType type = grid_.get(voxel);
    return type != kAir && type < types_.size() && !is_opaque(types_[type]) &&
           types_[type].blocks_light.value_or(false) && lamp(type, channel) == 0;
  }
  [[nodiscard]] int cost(IVec3 voxel) const {
    const VoxelType type = grid_.get(voxel);
    return type == kAir || type >= types_.size() ? 0 : types_[type].light_cost;
  }
  void find(int channel) {
    const auto c = static_cast<std::size_t>(channel);
    std::array<std::vector<IVec3>, 16> open;
    const auto raise = [&](IVec3 voxel, int level) {
      if (!box_.contains(voxel) || levels_[index(voxel)][c] >= level) return;
      levels_[index(voxel)][c] = static_cast<std::uint8_t>(level);
      open.at(static_cast<std::size_t>(level)).push_back(voxel);
    };
    for (int z = box_.min.z; z < box_.max.z; ++z) {
      for (int y = box_.min.y; y < box_.max.y; ++y) {
        for (int x = box_.min.x; x < box_.max.x; ++x) start({x, y, z}, channel, raise);
      }
    }
    for (int level = 15; level > 0; --level) {
      for (std::size_t i = 0; i < open.at(static_cast<std::size_t>(level)).size(); ++i) {
        const IVec3 voxel = open.at(static_cast<std::size_t>(level))[i];
        if (levels_[index(voxel)][c] != level || absorbs(voxel, channel)) continue;
        for (const Direction direction : kDirections) {
          const IVec3 next = voxel + normal_of(direction);
          const bool may_fall = channel == 0 && level == 15 && direction == Direction::NegY;
          // Voxels that are already as bright stay as they are; most do.
          if (!box_.contains(next) || levels_[index(next)][c] >= level - (may_fall ? 0 : 1)) continue;
          if (!passes(next, channel) || covers(voxel, direction)) continue;
          if (covers(next, static_cast<Direction>(static_cast<int>(direction) ^ 1))) continue;
          const bool falls = may_fall && !absorbs(next, channel);
          raise(next, level - std::max(cost(next), falls ? 0 : 1));
        }
      }
    }
  }
  template <class Raise>
  void start(IVec3 voxel, int channel, const Raise& raise) {
    const VoxelType type = grid_.get(voxel);
    if (type < types_.size() && type != kAir) raise(voxel, lamp(type, channel));
    if (channel == 0 && voxel.y == box_.max.y - 1) raise(voxel, 15);
  }

  const Grid& grid_;
  const VoxelRegistry& types_;
  IBox box_;
  IVec3 size_;
  std::vector<std::array<std::uint8_t, 4>> levels_;
};

void expect_searched(const PropagatedLight& light, const Grid& grid, const VoxelRegistry& types) {
  const IBox bounds = grid.bounds();
  if (bounds.empty()) return;
  const Search search(grid, types, {bounds.min - 16, bounds.max + 16});
  std::array<std::uint16_t, kChunkEdge> row;
  for (int z = bounds.min.z - 1; z <= bounds.max.z; ++z) {
    for (int y = bounds.min.y - 1; y <= bounds.max.y; ++y) {
      for (int x = bounds.min.x - 1; x <= bounds.max.x; ++x) {
        const IVec3 voxel{x, y, z};
        if (x == bounds.min.x - 1 || local_of(voxel).x == 0) light.read_row(voxel, row);
        ASSERT_EQ(row.at(static_cast<std::size_t>(local_of(voxel).x)), search.at(voxel)) << x << " " << y << " " << z;
      }
    }
  }
}

// `types`: number of types to place. The last is not registered.
void edit(Grid& grid, std::mt19937& random, unsigned types = 8) {
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  const IVec3 at{below(60) - 20, below(70) - 30, below(60) - 20};
  const auto type = static_cast<VoxelType>(random() % types);
  switch (below(6)) {
    case 0:
      grid.fill_box({at, at + IVec3(1 + below(30), 1 + below(5), 1 + below(30))}, type);
      break;
    case 1:
      grid.fill_box({at, at + IVec3(1 + below(5), 1 + below(40), 1 + below(5))}, kAir);
      break;
    case 2:
      grid.fill_sphere(DVec3(at), 2.0 + below(9), kStone);
      grid.fill_sphere(DVec3(at), 1.0 + below(8), kAir);
      grid.set(at, below(2) == 0 ? kLamp : kRedLamp);
      break;
    case 3:
      for (int i = 0; i < 40; ++i) grid.set(at + IVec3(below(12), below(12), below(12)), type);
      break;
    default:
      grid.set(at, type);
  }
}

TEST(PropagatedLight, MatchesSearchAfterRandomEdits) {
  const std::vector<InstructionSet> sets = sets_of_this_machine();
  for (unsigned seed = 0; seed < static_cast<unsigned>(cases(6, 8)); ++seed) {
    SCOPED_TRACE(seed);
    const InstructionSetOverride set(sets[seed % sets.size()]);
    std::mt19937 random(seed);
    VoxelRegistry types = seed < 4 ? light_types() : costly_types();
    const auto type_count = static_cast<unsigned>(types.size() + 1);
    Grid grid;
    PropagatedLight light;
    if (seed % 2 == 0) grid.fill_box({{-20, -30, -20}, {40, 0, 40}}, kStone);
    for (int step = 0; step < 12; ++step) {
      for (unsigned i = 0; i < 1 + random() % 6; ++i) edit(grid, random, type_count);
      if (step == 7) {
        VoxelProperties stone = types[kStone];
        stone.emission = 0.4F;
        types.replace(kStone, stone);
      }
      light.update(grid, types, {1 + seed % 2});
      if ((step + 1) % cases(12, 3) == 0) expect_searched(light, grid, types);
      if (HasFatalFailure()) return;
    }
    PropagatedLight fresh;
    fresh.update(grid, types);
    for (int i = 0; i < 5000; ++i) {
      const IVec3 at{static_cast<int>(random() % 150) - 60, static_cast<int>(random() % 150) - 70,
                     static_cast<int>(random() % 150) - 60};
      ASSERT_EQ(light.at(at), fresh.at(at));
    }
  }
}

// Edits of types, of states alone, and of both, in a labyrinth of shapes and in the open.
TEST(PropagatedLight, StopsAtCoveredSidesAfterRandomEdits) {
  const std::vector<InstructionSet> sets = sets_of_this_machine();
  const VoxelRegistry types = shaped_types();
  for (unsigned seed = 0; seed < static_cast<unsigned>(cases(3, 24)); ++seed) {
    SCOPED_TRACE(seed);
    const InstructionSetOverride set(sets[seed % sets.size()]);
    std::mt19937 random(seed);
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    Grid grid;
    if (seed % 2 == 0) grid.fill_box({{40, 50, 50}, {90, 75, 80}}, kStone);
    PropagatedLight light;
    for (int step = 0; step < 9; ++step) {
      const int count = step == 0 ? 6'000 : 1 + below(30);
      for (int i = 0; i < count; ++i) {
        const IVec3 at{48 + below(34), 54 + below(18), 54 + below(20)};
        const auto type =
            static_cast<VoxelType>(step == 0 || below(2) == 0 ? below(static_cast<int>(types.size())) : 0);
        if (step > 0 && below(3) > 0) {
          grid.set_data(at, {.state = static_cast<std::uint32_t>(below(8))});
        } else {
          grid.set(at, type, {.state = static_cast<std::uint32_t>(below(8))});
        }
      }
      light.update(grid, types, {1 + seed % 2});
      if (step % 4 == 0) expect_searched(light, grid, types);
      if (HasFatalFailure()) return;
    }
  }
}

TEST(PropagatedLight, FollowsADoorASlabAndReplacedShapes) {
  VoxelRegistry types = light_types();
  VoxelProperties door{.name = "door",
                       .state_bits = 2,
                       .orientations = StateOrientations::about_y(),
                       .shapes = VoxelShape::box({13, 0, 0}, {16, 16, 16})};
  const VoxelType kDoor = *types.add(door);
  const VoxelType kSlab = *types.add({.name = "slab", .shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16})});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {20, 12, 12}}, kStone);
  grid.fill_box({{2, 2, 5}, {18, 4, 6}}, kAir);
  grid.set({3, 2, 5}, kLamp);
  grid.set({9, 2, 5}, kDoor, {.state = 0});
  grid.set({9, 3, 5}, kDoor, {.state = 0});
  PropagatedLight light;
  light.update(grid, types);
  EXPECT_EQ(light.at({9, 2, 5}).red, 9);
  EXPECT_EQ(light.at({10, 2, 5}).red, 0) << "a closed door";
  for (const std::uint32_t state : {1U, 0U, 3U, 2U, 1U}) {
    grid.set_data({9, 2, 5}, {.state = state});
    grid.set_data({9, 3, 5}, {.state = state});
    light.update(grid, types);
    EXPECT_EQ(light.at({10, 2, 5}).red, state % 2 == 1 ? 8 : 0) << "state " << state;
    expect_searched(light, grid, types);
  }
  // Sky light stops at the lower side of a slab, and lights the slab's own voxel.
  grid.set({-5, 100, 5}, kSlab);
  light.update(grid, types);
  EXPECT_EQ(light.at({-5, 100, 5}).sky, 15);
  EXPECT_EQ(light.at({-5, 99, 5}).sky, 14);
  expect_searched(light, grid, types);
  door.shapes = VoxelShape::box({13, 0, 0}, {16, 15, 16});
  types.replace(kDoor, door);
  light.update(grid, types);
  expect_searched(light, grid, types);
  // An override makes a door stop all light.
  door.blocks_light = true;
  types.replace(kDoor, door);
  EXPECT_TRUE(types.blocks_light(kDoor));
  light.update(grid, types);
  EXPECT_EQ(light.at({10, 2, 5}).red, 0);
  expect_searched(light, grid, types);
}

// Mostly edits single voxels, so that neither rock nor air prevails.
void edit_little(Grid& grid, std::mt19937& random) {
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  const IVec3 at{below(70) - 30, below(60) - 40, below(70) - 30};
  const VoxelType type = below(3) == 0 ? static_cast<VoxelType>(1 + below(7)) : kAir;
  if (below(50) > 0) {
    grid.set(at, type);
    return;
  }
  grid.fill_box({at, at + IVec3(1 + below(12), 1 + below(4), 1 + below(12))}, below(2) == 0 ? kStone : kAir);
}

TEST(PropagatedLight, MatchesSearchAfterManyEdits) {
  // A million edits only in nightly runs and in fast builds: debug and sanitizer builds take ten times as long.
#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  const bool is_night = is_nightly();
#else
  const bool is_night = false;
#endif
  const int edits = is_night ? 1'000'000 : 6'000;
  const int checks = is_night ? 40 : 4;
  std::mt19937 random(11);
  VoxelRegistry types = light_types();
  Grid grid;
  grid.fill_box({{-30, -40, -30}, {40, 0, 40}}, kStone);
  PropagatedLight light;
  int checked = 0;
  for (int done = 0; done < edits;) {
    // Sometimes enough edits that boxes overlap.
    const int count = random() % 100 == 0 ? 200 : 1 + static_cast<int>(random() % 30);
    for (int i = 0; i < count; ++i) edit_little(grid, random);
    done += count;
    light.update(grid, types, {1 + static_cast<unsigned>(random() % 2)});
    if (done < (checked + 1) * (edits / checks)) continue;
    ++checked;
    expect_searched(light, grid, types);
    ASSERT_FALSE(HasFatalFailure()) << "after " << done << " edits";
  }
  EXPECT_GE(checked, checks);
}

TEST(PropagatedLight, CastsSkyShadowsOfAnyLength) {
  const VoxelRegistry types = light_types();
  Grid grid;
  grid.fill_box({{-4, -900, -4}, {12, -890, 12}}, kStone);  // ground
  grid.set({2, -890, 3}, kLamp);
  grid.set({0, -500, 0}, kGlass);
  PropagatedLight light;
  light.update(grid, types);
  for (const int y : {-100, -600, 3}) {  // one shadow longer than the solver's regions, and shorter ones
    const IBox roof{{-2, y, -2}, {3, y + 1, 3}};
    grid.fill_box(roof, kStone);
    light.update(grid, types);
    EXPECT_LT(light.at({0, y - 1, 0}).sky, 15);
    expect_searched(light, grid, types);
    grid.fill_box(roof, kAir);
    light.update(grid, types);
    EXPECT_EQ(light.at({0, y - 1, 0}).sky, 15);
    expect_searched(light, grid, types);
  }
}

// Small edits are solved as a whole: lamps, stones, glass and holes at corners of chunks, one or several per update,
// with every kernel.
TEST(PropagatedLight, MatchesFreshLightAfterSmallEdits) {
  const VoxelRegistry types = costly_types();
  for (const InstructionSet set : sets_of_this_machine()) {
    const InstructionSetOverride only(set);
    SCOPED_TRACE(name_in_tests(set));
    std::mt19937 random(static_cast<unsigned>(set));
    const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
    Grid grid;
    grid.fill_box({{-90, -100, -90}, {90, 10, 90}}, kStone);
    for (int i = 0; i < 40; ++i) grid.fill_sphere(DVec3(below(60) - 30, below(60) - 50, below(60) - 30), 7.0, kAir);
    PropagatedLight light;
    light.update(grid, types, {1});
    for (int step = 0; step < 60; ++step) {
      for (int i = 1 + step % 3 * below(5); i > 0; --i) {
        const IVec3 at{below(40) - 20, below(60) - 40, below(40) - 20};
        grid.set(at, static_cast<VoxelType>(below(3) == 0 ? 0 : below(15)));
      }
      if (step % 20 == 7) grid.fill_box({{3, -30, 3}, {4, 30, 4}}, step == 7 ? kAir : kStone);
      light.update(grid, types, {1});
      if (step % 6 != 5) continue;
      PropagatedLight fresh;
      fresh.update(grid, types, {1});
      std::array<std::uint16_t, kChunkEdge> row;
      std::array<std::uint16_t, kChunkEdge> expected;
      for (int z = -60; z < 60; ++z) {
        for (int y = -80; y < 40; ++y) {
          for (const int x : {-64, 0}) {
            light.read_row({x, y, z}, row);
            fresh.read_row({x, y, z}, expected);
            ASSERT_EQ(row, expected) << x << ' ' << y << ' ' << z << ", step " << step;
          }
        }
      }
    }
  }
}

// Two pairs of boxes of one update touch but are not merged, so they are queued. The queue's box around the parts in
// one chunk covers the light next to a fifth box, which is solved by itself.
TEST(PropagatedLight, KeepsLightNextToQueuedBoxes) {
  const VoxelRegistry types = light_types();
  Grid grid;
  grid.fill_box({{-60, -60, -60}, {130, 130, 140}}, kStone);
  grid.fill_box({{-50, -50, -50}, {120, 120, 130}}, kAir);
  grid.fill_box({{45, 32, -20}, {75, 33, 50}}, kStone);  // light of the first lamp passes it on one side only
  grid.set({40, 31, 15}, kLamp);
  PropagatedLight light;
  light.update(grid, types, {1});
  for (const IVec3 lamp : {IVec3(30, -2, 15), IVec3(78, -31, -15), IVec3(30, 47, 66), IVec3(78, 78, 96)}) {
    grid.set(lamp, kLamp);
  }
  grid.set({40, 47, 15}, kLamp);
  light.update(grid, types, {1});
  EXPECT_EQ(light.at({47, 34, 15}).red, 15 - 7 - 3);
  PropagatedLight fresh;
  fresh.update(grid, types, {1});
  for (int z = -30; z < 112; ++z) {
    for (int y = -46; y < 94; ++y) {
      for (int x = 10; x < 94; ++x) ASSERT_EQ(light.at({x, y, z}), fresh.at({x, y, z})) << x << ' ' << y << ' ' << z;
    }
  }
}

TEST(PropagatedLight, LightsShaftFromSkyAndCaveFromLamps) {
  VoxelRegistry types = light_types();
  Grid grid;
  grid.fill_box({{0, -200, 0}, {130, 0, 130}}, kStone);
  PropagatedLight light;
  light.update(grid, types);
  EXPECT_EQ(light.at({50, 0, 50}), (LightLevels{15, 0, 0, 0}));
  EXPECT_EQ(light.at({50, 5000, 50}), (LightLevels{15, 0, 0, 0}));
  EXPECT_EQ(light.at({50, -1, 50}), LightLevels{});
  grid.fill_box({{50, -180, 50}, {51, 0, 51}}, kAir);     // a shaft
  grid.fill_box({{20, -185, 45}, {60, -180, 55}}, kAir);  // a cave
  light.update(grid, types);
  EXPECT_EQ(light.at({50, -185, 50}).sky, 15);
  EXPECT_EQ(light.at({53, -185, 50}).sky, 12);
  EXPECT_EQ(light.at({50, -183, 53}).sky, 12);
  EXPECT_EQ(light.at({30, -183, 50}).sky, 0);
  grid.set({25, -185, 50}, kRedLamp);
  light.update(grid, types);
  EXPECT_EQ(light.at({25, -185, 50}), (LightLevels{0, 9, 1, 0}));
  EXPECT_EQ(light.at({28, -185, 50}), (LightLevels{0, 6, 0, 0}));
  grid.set({50, -1, 50}, kStone);  // closed
  light.update(grid, types);
  EXPECT_EQ(light.at({50, -180, 50}).sky, 0);
  grid.set({50, -1, 50}, kGlass);  // the sky passes glass
  grid.set({25, -185, 50}, kAir);
  light.update(grid, types);
  EXPECT_EQ(light.at({50, -185, 50}), (LightLevels{15, 0, 0, 0}));
  EXPECT_EQ(light.at({28, -185, 50}), LightLevels{});
}

TEST(PropagatedLight, KeepsSealedRoomDark) {
  VoxelRegistry types = light_types();
  Grid grid;
  grid.fill_box({{40, 40, 40}, {90, 90, 90}}, kStone);
  grid.fill_box({{41, 41, 41}, {89, 89, 89}}, kAir);
  grid.set({39, 60, 60}, kLamp);  // outside, next to the wall
  PropagatedLight light;
  light.update(grid, types);
  for (int z = 41; z < 89; ++z) {
    for (int y = 41; y < 89; ++y) {
      for (int x = 41; x < 89; ++x) ASSERT_EQ(light.at({x, y, z}), LightLevels{});
    }
  }
  EXPECT_EQ(light.at({38, 60, 60}).red, 14);
}

TEST(PropagatedLight, ColouredGlassFiltersLampsButNotSky) {
  VoxelRegistry types = light_types();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {20, 20, 20}}, kStone);
  grid.fill_box({{1, 5, 5}, {19, 6, 6}}, kAir);  // a corridor
  grid.set({2, 5, 5}, kLamp);
  grid.set({6, 5, 5}, kBlueGlass);
  PropagatedLight light;
  light.update(grid, types);
  EXPECT_GT(light.at({5, 5, 5}).red, 0);
  EXPECT_EQ(light.at({7, 5, 5}).red, 0);
  EXPECT_EQ(light.at({7, 5, 5}).green, 0);
  EXPECT_EQ(light.at({7, 5, 5}).blue, propagated::lamp_levels(types[kLamp]).blue - 5);
  grid.fill_box({{6, 6, 5}, {7, 20, 6}}, kBlueGlass);  // a shaft filled with it
  light.update(grid, types);
  EXPECT_EQ(light.at({6, 5, 5}).sky, 15);
}

// Water and leaves as in block games.
TEST(PropagatedLight, CostsLevelsInWaterAndLeaves) {
  const VoxelRegistry types = costly_types();
  Grid grid;
  grid.fill_box({{-64, -40, -64}, {64, -30, 64}}, kStone);
  grid.fill_box({{-64, -30, -64}, {64, 0, 64}}, kWater);
  PropagatedLight light;
  light.update(grid, types);
  EXPECT_EQ(light.at({0, 0, 0}).sky, 15);
  EXPECT_EQ(light.at({0, -1, 0}).sky, 14) << "1 voxel deep";
  EXPECT_EQ(light.at({0, -7, 0}).sky, 8);
  EXPECT_EQ(light.at({0, -14, 0}).sky, 1);
  EXPECT_EQ(light.at({0, -27, 0}).sky, 0);
  grid.fill_box({{-64, -30, -64}, {64, 0, 64}}, kThickWater);
  grid.fill_box({{-3, 10, -3}, {4, 12, 4}}, kLeaves);
  light.update(grid, types);
  EXPECT_EQ(light.at({0, -1, 0}).sky, 15 - 3 - 4) << "in the shade of the leaves, from their side";
  EXPECT_EQ(light.at({20, -4, 0}).sky, 15 - 4 * 3);
  EXPECT_EQ(light.at({20, -5, 0}).sky, 0);
  EXPECT_EQ(light.at({0, 11, 0}).sky, 13);
  EXPECT_EQ(light.at({0, 10, 0}).sky, 11) << "two layers of leaves";
  grid.fill_box({{-64, -30, -64}, {64, 0, 64}}, kAir);
  grid.set({0, -29, 0}, kLamp);
  grid.set({2, -29, 0}, kLeaves);
  grid.set({0, -27, 0}, kFog);
  light.update(grid, types);
  EXPECT_EQ(light.at({1, -29, 0}).red, 14);
  EXPECT_EQ(light.at({2, -29, 0}).red, 12);
  EXPECT_EQ(light.at({3, -29, 0}).red, 11) << "from the leaves; around them it is as far";
  EXPECT_EQ(light.at({0, -27, 0}).red, 0);
  PropagatedLight fresh;
  fresh.update(grid, types);
  for (int y = -30; y < 14; ++y) ASSERT_EQ(light.at({1, y, 1}), fresh.at({1, y, 1})) << y;
}

// The walls next to the stairs are visible, so light is in front of them. It does not reach the room.
TEST(PropagatedLight, RoofOfStairsKeepsRoomDarkAndLightsWallsBehindIt) {
  const VoxelRegistry types = costly_types();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {10, 8, 10}}, kStone);
  grid.fill_box({{1, 1, 1}, {9, 8, 9}}, kAir);
  grid.fill_box({{1, 7, 1}, {9, 8, 9}}, kStairs);
  PropagatedLight light;
  light.update(grid, types);
  const auto expect_dark_room = [&] {
    for (int z = 1; z < 9; ++z) {
      for (int y = 1; y < 7; ++y) {
        for (int x = 1; x < 9; ++x) ASSERT_EQ(light.at({x, y, z}).sky, 0);
      }
    }
    EXPECT_EQ(light.at({1, 7, 4}).sky, 14) << "in the stairs, before the wall";
  };
  expect_dark_room();
  QuadBuffer quads;
  BlockyMesher().mesh(grid.neighbourhood({0, 0, 0}), types, {}, quads);
  const bool shows_wall = std::any_of(quads.begin(), quads.end(), [](const Quad& quad) {
    return quad.type() == kStone && quad.direction() == Direction::PosX && quad.voxel().x == 0 &&
           quad.voxel().y + std::max(quad.size_u(), quad.size_v()) >= 8;
  });
  EXPECT_TRUE(shows_wall);
  grid.set({4, 3, 4}, kRedLamp);  // an update whose region ends at stairs
  light.update(grid, types);
  grid.set({4, 3, 4}, kAir);
  light.update(grid, types);
  expect_dark_room();
  grid.set({4, 7, 4}, kAir);
  light.update(grid, types);
  EXPECT_EQ(light.at({4, 1, 4}).sky, 15);
  grid.set({4, 7, 4}, kDimStairs);
  light.update(grid, types);
  expect_dark_room();
  EXPECT_EQ(light.at({4, 7, 4}).sky, 10);
}

TEST(PropagatedLight, FollowsCostAndPassageOfTypes) {
  VoxelRegistry types = costly_types();
  Grid grid;
  grid.fill_box({{-30, 0, -30}, {31, 1, 31}}, kGlass);
  PropagatedLight light;
  const auto level_after = [&](auto&& change) {
    VoxelProperties glass = types[kGlass];
    change(glass);
    types.replace(kGlass, glass);
    light.update(grid, types);
    return light.at({0, -1, 0}).sky;
  };
  EXPECT_EQ(level_after([](VoxelProperties&) {}), 15);
  EXPECT_EQ(level_after([](VoxelProperties& glass) { glass.light_cost = 4; }), 10);
  EXPECT_EQ(level_after([](VoxelProperties& glass) { glass.blocks_light = true; }), 0);
  EXPECT_EQ(level_after([](VoxelProperties& glass) { glass = {}; }), 0) << "an opaque type";
  EXPECT_EQ(level_after([](VoxelProperties& glass) { glass.blocks_light = false; }), 15);
}

TEST(PropagatedLight, ReportsChangedRegions) {
  VoxelRegistry types = light_types();
  std::mt19937 random(5);
  Grid grid;
  grid.fill_box({{-20, -30, -20}, {40, 0, 40}}, kStone);
  PropagatedLight light;
  light.update(grid, types);
  ChangeCursor cursor;
  static_cast<void>(light.changes_since(cursor));
  EXPECT_TRUE(light.changes_since(cursor).empty());
  const IBox all{{-60, -60, -60}, {100, 100, 100}};
  const auto snapshot = [&] {
    std::vector<std::uint16_t> words;
    for (int z = all.min.z; z < all.max.z; ++z) {
      for (int y = all.min.y; y < all.max.y; ++y) {
        for (int x = all.min.x; x < all.max.x; ++x) words.push_back(packed(light.at({x, y, z})));
      }
    }
    return words;
  };
  std::vector<std::uint16_t> before = snapshot();
  for (int step = 0; step < 5; ++step) {
    edit(grid, random);
    light.update(grid, types);
    std::vector<std::uint16_t> now = snapshot();
    const GridChanges changes = light.changes_since(cursor);
    std::size_t i = 0;
    for (int z = all.min.z; z < all.max.z; ++z) {
      for (int y = all.min.y; y < all.max.y; ++y) {
        for (int x = all.min.x; x < all.max.x; ++x, ++i) {
          if (before[i] == now[i]) continue;
          const IVec3 voxel{x, y, z};
          const bool is_reported = std::any_of(changes.items_unless_all().begin(), changes.items_unless_all().end(),
                                               [&](const ChunkChange& change) {
                                                 const IVec3 local = local_of(voxel);
                                                 return change.chunk == chunk_of(voxel) && change.box.contains(local) &&
                                                        change.slabs.has(local.y, local.z);
                                               });
          // Light above all chunks is not stored.
          ASSERT_TRUE(is_reported || changes.all) << x << " " << y << " " << z;
        }
      }
    }
    before = std::move(now);
  }
}

TEST(PropagatedLight, ReportsChunksAddedAndRemovedInOpenSky) {
  const VoxelRegistry types = light_types();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {20, 5, 20}}, kStone);
  PropagatedLight light;
  light.update(grid, types);
  ChangeCursor cursor;
  static_cast<void>(light.changes_since(cursor));
  const IVec3 voxel{200, 200, 5};
  const auto is_reported = [&] {
    const GridChanges changes = light.changes_since(cursor);
    return std::any_of(changes.items_unless_all().begin(), changes.items_unless_all().end(),
                       [&](const ChunkChange& change) {
                         return change.chunk == chunk_of(voxel) && change.box.contains(local_of(voxel));
                       });
  };
  EXPECT_EQ(light.at(voxel).sky, 15);
  grid.fill_box({{192, 192, 0}, {256, 256, 64}}, kStone);
  light.update(grid, types);
  EXPECT_EQ(light.at(voxel).sky, 0);
  EXPECT_TRUE(is_reported());
  grid.put_chunk(chunk_of(voxel), Chunk());
  light.update(grid, types);
  EXPECT_EQ(light.at(voxel).sky, 15);
  EXPECT_TRUE(is_reported());
}

TEST(PropagatedLight, SplitsQuadsAtLightChanges) {
  VoxelRegistry types = light_types();
  std::mt19937 random(9);
  Grid grid;
  grid.fill_box({{-10, -30, -10}, {80, 0, 80}}, kStone);
  for (int i = 0; i < 20; ++i) edit(grid, random);
  PropagatedLight light;
  light.update(grid, types);
  BlockyMesher mesher;
  QuadBuffer quads;
  QuadBuffer lit;
  std::vector<std::uint16_t> levels;
  std::size_t more = 0;
  for (const IVec3 chunk : grid.chunks()) {
    mesher.mesh(grid.neighbourhood(chunk), types, {}, quads);
    light.split(quads, chunk, lit, levels);
    ASSERT_EQ(lit.size(), levels.size());
    ASSERT_EQ(face_count(lit), face_count(quads));
    more += lit.size() - quads.size();
    for (std::size_t i = 0; i < lit.size(); ++i) {
      const FaceFrame& frame = frame_of(lit[i].direction());
      for (int v = 0; v < lit[i].size_v(); ++v) {
        for (int u = 0; u < lit[i].size_u(); ++u) {
          IVec3 at = chunk * kChunkEdge + lit[i].voxel() + normal_of(lit[i].direction());
          at[frame.u] += u;
          at[frame.v] += v;
          ASSERT_EQ(packed(light.at(at)), levels[i]);
        }
      }
    }
  }
  EXPECT_GT(more, 0U);
}

TEST(PropagatedLight, UsesCustomLevelsOfTypes) {
  VoxelRegistry types = light_types();
  Grid grid;
  grid.set({5, 5, 5}, kStone);
  PropagatedLight light({[](VoxelType type, const VoxelProperties&) {
    return type == kStone ? LightLevels{9, 3, 2, 1} : LightLevels{};
  }});
  light.update(grid, types);
  EXPECT_EQ(light.at({5, 5, 5}), (LightLevels{0, 3, 2, 1}));
  EXPECT_EQ(light.at({6, 5, 5}), (LightLevels{15, 2, 1, 0}));
  EXPECT_EQ(light.at({5, 4, 5}), (LightLevels{14, 2, 1, 0})) << "next to columns of sky";
}

TEST(PropagatedLight, SnapshotsKeepLightAndUpdateIndependently) {
  const VoxelRegistry types = light_types();
  std::mt19937 random(17);
  Grid grid;
  for (int i = 0; i < 6; ++i) edit(grid, random);
  PropagatedLight light;
  light.update(grid, types);
  ChangeCursor cursor;
  EXPECT_TRUE(light.changes_since(cursor).all);
  for (int round = 0; round < cases(2, 4); ++round) {
    const PropagatedLight kept = light.snapshot();
    PropagatedLight other = light.snapshot();
    const Grid before = grid.snapshot();
    Grid branch = grid.snapshot();
    edit(grid, random);
    edit(branch, random);
    light.update(grid, types);
    other.update(branch, types);
    expect_searched(kept, before, types);
    expect_searched(light, grid, types);
    expect_searched(other, branch, types);
    ASSERT_FALSE(HasFatalFailure()) << round;
    // The updated object continues with its journal; an updated snapshot has a separate one.
    ChangeCursor of_kept = cursor;
    EXPECT_TRUE(kept.changes_since(of_kept).empty());
    EXPECT_FALSE(light.changes_since(cursor).all);
  }
}

TEST(PropagatedLightDeathTest, RejectsLevelsThatDoNotFitFourBits) {
  QUOIN_EXPECT_MISTAKE((void)packed({.sky = 16}), "levels from 0 to 15");
  QUOIN_EXPECT_MISTAKE((void)packed({.blue = 200}), "levels from 0 to 15");
}

}  // namespace
}  // namespace quoin

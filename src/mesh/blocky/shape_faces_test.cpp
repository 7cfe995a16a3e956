// Faces of shapes, and of cubes next to them, against one voxel, one face, one neighbour at a time.

#include <quoin/mesh/blocky.h>

#include <array>
#include <bit>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_shape.h>

#include "core/instruction_sets_for_tests.h"
#include "core/made_with_for_tests.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "mesh/blocky/blocky_mesher.h"
#include "mesh/mesh_oracle.h"

namespace quoin {
namespace {

using oracle::FaceKey;
using oracle::FaceSet;
using oracle::UnitFace;

// Cubes (stone, one that does not occlude, glass), then shapes.
VoxelRegistry shaped_types() {
  VoxelRegistry types;
  const auto add = [&](VoxelProperties properties) { EXPECT_TRUE(types.add(std::move(properties)).has_value()); };
  add({.name = "stone"});
  add({.name = "cloud", .occludes = false});
  add({.name = "glass", .visibility = Visibility::Transparent});
  const auto turns = StateOrientations::about_y_and_upside_down();
  add({.name = "slab", .state_bits = 3, .orientations = turns, .shapes = shapes_for_tests::slab()});
  add({.name = "stairs", .state_bits = 3, .orientations = turns, .shapes = shapes_for_tests::stairs()});
  add({.name = "fence", .shapes = shapes_for_tests::fence()});
  add({.name = "flower", .visibility = Visibility::Transparent, .shapes = VoxelShape::crossed_plates()});
  add({.name = "pane",
       .visibility = Visibility::Transparent,
       .state_bits = 3,
       .orientations = turns,
       .shapes = shapes_for_tests::slab()});
  add({.name = "post",
       .state_bits = 3,
       .orientations = StateOrientations::to_directions(),
       .shapes = *VoxelShape::from_elements({{.min = Vec3(2, -8, 2), .max = Vec3(14, 24, 14)}})});
  add({.name = "block", .shapes = VoxelShape::box(IVec3(0), IVec3(16))});
  add({.name = "rubble", .state_bits = 3, .orientations = turns, .shapes = shapes_for_tests::rubble()});
  add({.name = "turned fence", .state_bits = 3, .orientations = turns, .shapes = shapes_for_tests::fence()});
  for (const std::uint8_t red : {10, 20}) {
    add({.name = "water",
         .colour = {red, 90, 200, 120},
         .visibility = Visibility::Transparent,
         .state_bits = 3,
         .shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid, .groups = 2})});
  }
  // Slabs and fences in water, if bit 0 of their state is set.
  const ContainedFluid fluid{.groups = 2, .when = {{.state_mask = 1, .state = 1}}};
  ShapeRules wet_slab{.parts = {{.shape = shapes_for_tests::slab()}}};
  wet_slab.fluid = fluid;
  add({.name = "wet slab",
       .state_bits = 3,
       .orientations = turns,
       .shapes = *VoxelShapes::from_rules(std::move(wet_slab))});
  ShapeRules wet_fence = shapes_for_tests::fence().rules();
  wet_fence.fluid = fluid;
  add({.name = "wet fence", .state_bits = 1, .shapes = *VoxelShapes::from_rules(std::move(wet_fence))});
  return types;
}

// Returns a world of cubes of the first types with many shapes on, in and around them.
Grid shaped_world(unsigned seed, const IBox& box, const VoxelRegistry& types, int cube_types = 3) {
  Grid grid = oracle::random_world(seed, box, cube_types, 0.02);
  std::mt19937 random(seed + 1);
  const IVec3 size = box.size();
  for (int i = 0; i < size.x * size.y * size.z / 6; ++i) {
    IVec3 at;
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = box.min[axis] + static_cast<int>(random() % static_cast<unsigned>(size[axis]));
    }
    const auto type = static_cast<VoxelType>(4 + random() % static_cast<unsigned>(types.size() - 4));
    grid.set(at, type, {.state = types[type].state_bits == 0 ? 0U : static_cast<std::uint32_t>(random() % 8)});
  }
  return grid;
}

// Returns true if the eighth of a voxel that contains a point darkens corners.
bool darkens(const Grid& grid, const VoxelRegistry& types, const Vec3& point) {
  const IVec3 voxel(glm::floor(point));
  const VoxelType type = grid.get(voxel);
  const VoxelProperties& properties = types[type];
  if (properties.visibility != Visibility::Opaque) return false;
  if (properties.shapes.empty()) return properties.occludes.value_or(true);
  const ShapeModel& model = *shape_at(grid, types, voxel);
  const IVec3 first = IVec3(glm::floor((point - Vec3(voxel)) * 2.0F)) * 8;
  int filled = 0;
  for (int z = first.z; z < first.z + 8; ++z) {
    for (int y = first.y; y < first.y + 8; ++y) {
      filled +=
          std::popcount(static_cast<unsigned>(model.bits[static_cast<std::size_t>(y + 16 * z)] >> first.x & 0xFF));
    }
  }
  return 2 * filled >= 512;
}

// Returns the occlusion of a corner of a face that lies at `corner` and extends towards `middle`.
std::uint8_t corner_occlusion(const Grid& grid, const VoxelRegistry& types, const IVec3& voxel, const Vec3& corner,
                              const Vec3& middle, Direction direction) {
  const FaceFrame& frame = frame_of(direction);
  Vec3 at = glm::round(corner * 2.0F) * 0.5F + Vec3(voxel) + 0.25F * Vec3(normal_of(direction));
  const auto shifted = [&](bool is_beyond_u, bool is_beyond_v) {
    Vec3 p = at;
    p[frame.u] += (corner[frame.u] > middle[frame.u]) == is_beyond_u ? 0.25F : -0.25F;
    p[frame.v] += (corner[frame.v] > middle[frame.v]) == is_beyond_v ? 0.25F : -0.25F;
    return p;
  };
  return vertex_occlusion(darkens(grid, types, shifted(true, false)), darkens(grid, types, shifted(false, true)),
                          darkens(grid, types, shifted(true, true)));
}

bool shows_cube_face(const Grid& grid, const VoxelRegistry& types, VoxelType type, const IVec3& neighbour,
                     Direction direction) {
  const VoxelType other = grid.get(neighbour);
  if (other == kAir) return true;
  const VoxelProperties& properties = types[other];
  if (properties.shapes.empty()) return properties.visibility == Visibility::Transparent && other != type;
  const auto back = static_cast<std::size_t>(direction) ^ 1U;
  return properties.visibility != Visibility::Opaque || !shape_at(grid, types, neighbour)->covers_side[back];
}

FaceSet cube_faces(const Grid& grid, const VoxelRegistry& types, bool occlusion) {
  FaceSet faces;
  grid.for_each([&](IVec3 v, VoxelType type) {
    if (types.is_shaped(type)) return;
    for (const Direction d : kDirections) {
      if (!shows_cube_face(grid, types, type, v + normal_of(d), d)) continue;
      UnitFace face{type, {}};
      const FaceFrame& frame = frame_of(d);
      constexpr std::array<std::array<float, 2>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
      for (std::size_t i = 0; i < 4 && occlusion; ++i) {
        Vec3 corner(0.0F);
        corner[frame.axis] = frame.sign > 0 ? 1.0F : 0.0F;
        corner[frame.u] = kCorners[i][0];
        corner[frame.v] = kCorners[i][1];
        face.corners[i] = corner_occlusion(grid, types, v, corner, Vec3(0.5F), d);
      }
      faces[{v.x, v.y, v.z, static_cast<int>(d)}] = face;
    }
  });
  return faces;
}

// Returns true if boxes of the model fill the space in front of a face: at 16 x 16 points of it.
bool is_behind_own_boxes(const ShapeModel& model, const ModelFace& face) {
  const Vec3 out = Vec3(normal_of(face.direction)) / 64.0F;
  for (int i = 0; i < 16 * 16; ++i) {
    const float u = (static_cast<float>(i % 16) + 0.5F) / 16.0F;
    const float v = (static_cast<float>(i / 16) + 0.5F) / 16.0F;
    const Vec3 at =
        face.corners[0] + u * (face.corners[1] - face.corners[0]) + v * (face.corners[3] - face.corners[0]) + out;
    const IVec3 cell(glm::floor(at * 16.0F));
    if (!IBox{IVec3(0), IVec3(16)}.contains(cell)) return false;
    if ((model.bits[static_cast<std::size_t>(cell.y + 16 * cell.z)] >> cell.x & 1U) == 0) return false;
  }
  return true;
}

using ShapeKey = std::tuple<int, int, int, std::size_t>;  // x, y, z, number of the face
using ShapeSet = std::map<ShapeKey, UnitFace>;
constexpr std::size_t kOfInnerFluid = 1'000;  // added to the number of a face

// Adds the visible faces of the model of a voxel.
void add_shape_faces(const Grid& grid, const VoxelRegistry& types, const IVec3& v, VoxelType type,
                     const ShapeModel& model, bool occlusion, std::size_t first, ShapeSet& faces) {
  for (std::size_t i = 0; i < model.faces.size(); ++i) {
    const ModelFace& face = model.faces[i];
    const IVec3 at = v + normal_of(face.direction);
    const auto side = static_cast<std::size_t>(face.direction);
    const ShapeModel& own = *shape_at(grid, types, v);
    const bool is_behind_own_side =
        &own != &model && types[grid.get(v)].visibility == Visibility::Opaque && own.covers_side[side];
    const bool is_in_fluid = (fluid_at(grid, types, at).groups & types.fluid_groups(type)) != 0;
    if (face.on_side && (is_behind_own_side || is_in_fluid ||
                         covers(types, grid.get(at), shape_at(grid, types, at), type, face.direction, face.mask))) {
      continue;
    }
    if (is_behind_own_boxes(model, face)) continue;
    UnitFace made{type, {}};
    const bool is_inclined = glm::abs(face.normal[frame_of(face.direction).axis]) < 0.999F;
    const bool is_free_top = model.free_faces != 0 && face.direction == Direction::PosY;
    for (std::size_t corner = 0; corner < 4 && occlusion && !is_inclined && !is_free_top; ++corner) {
      Vec3 lower = face.corners[0];
      Vec3 upper = face.corners[0];
      for (const Vec3& each : face.corners) {
        lower = glm::min(lower, each);
        upper = glm::max(upper, each);
      }
      const Vec3 middle = 0.5F * (lower + upper);
      made.corners[corner] = corner_occlusion(grid, types, v, face.corners[corner], middle, face.direction);
    }
    faces[{v.x, v.y, v.z, first + i}] = made;
  }
}

ShapeSet shape_faces(const Grid& grid, const VoxelRegistry& types, bool occlusion) {
  ShapeSet faces;
  grid.for_each([&](IVec3 v, VoxelType type) {
    const ShapeModel* const model = shape_at(grid, types, v);
    if (model == nullptr) return;
    add_shape_faces(grid, types, v, type, *model, occlusion, 0, faces);
    const InnerFluid fluid = fluid_at(grid, types, v);
    if (fluid.model == nullptr) return;
    add_shape_faces(grid, types, v, fluid.type, *fluid.model, occlusion, kOfInnerFluid, faces);
  });
  return faces;
}

struct Meshed {
  FaceSet cubes;
  ShapeSet shapes;
};

Meshed meshed(const Grid& grid, const VoxelRegistry& types, const QuadOptions& options, BlockyMesher& mesher) {
  Meshed result;
  QuadBuffer quads;
  ShapeFaceBuffer shapes;
  for (const IVec3 chunk : grid.chunks()) {
    mesher.mesh(grid.neighbourhood(chunk), types, options, quads, shapes);
    for (const Quad& quad : quads) oracle::add_quad(quad, chunk * kChunkEdge, result.cubes);
    for (std::size_t i = 1; i < quads.size(); ++i) EXPECT_LE(quads[i - 1].direction(), quads[i].direction());
    for (const ShapeFace& face : shapes) {
      const IVec3 at = chunk * kChunkEdge + face.voxel();
      const bool is_own = face.model == shape_at(grid, types, at);
      EXPECT_TRUE(is_own || face.model == fluid_at(grid, types, at).model);
      const ShapeKey key{at.x, at.y, at.z, face.face + (is_own ? 0 : kOfInnerFluid)};
      EXPECT_TRUE(result.shapes.emplace(key, UnitFace{face.type, face.occlusion()}).second);
    }
  }
  return result;
}

class ShapeFaces : public testing::TestWithParam<InstructionSet> {};

TEST_P(ShapeFaces, MatchOracleInRandomWorlds) {
  QUOIN_SKIP_WITHOUT(GetParam());
  const VoxelRegistry types = shaped_types();
  BlockyMesher mesher = made_with<BlockyMesher>(GetParam());
  for (unsigned seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    // Spans a corner where eight chunks meet. Chunks whose cubes all occlude are meshed without layers of faces.
    const Grid grid = shaped_world(seed, {IVec3{-9, -12, -7}, IVec3{11, 8, 10}}, types, seed % 2 == 0 ? 3 : 1);
    for (const bool occlusion : {true, false}) {
      const FaceSet cubes = cube_faces(grid, types, occlusion);
      const ShapeSet shapes = shape_faces(grid, types, occlusion);
      for (const bool merge : {true, false}) {
        const Meshed found = meshed(grid, types, {.merge = merge, .bake_occlusion = occlusion}, mesher);
        EXPECT_EQ(found.cubes, cubes);
        EXPECT_EQ(found.shapes, shapes);
      }
    }
  }
}

TEST_P(ShapeFaces, MatchOracleWithManyTypesAndInRegions) {
  QUOIN_SKIP_WITHOUT(GetParam());
  VoxelRegistry types = shaped_types();
  Grid grid = shaped_world(7, {IVec3{40, 40, 40}, IVec3{64, 60, 64}}, types);
  const FaceSet some = cube_faces(grid, types, true);
  BlockyMesher mesher = made_with<BlockyMesher>(GetParam());
  const IBox region{{45, 41, 50}, {64, 58, 63}};
  QuadBuffer quads;
  ShapeFaceBuffer shapes;
  for (const int more : {0, 30, 400}) {  // palettes of 4, 8 and 16 bits
    for (int i = 0; i < more; ++i) {
      const VoxelType type = *types.add({.name = "cube", .colour = {static_cast<std::uint8_t>(i), 0, 0}});
      grid.set({20 + i % 20, 10 + i / 20 % 20, 10}, type);
    }
    mesher.mesh(grid.neighbourhood(IVec3(0)), types, {.region = region}, quads, shapes);
    FaceSet found;
    for (const Quad& quad : quads) oracle::add_quad(quad, IVec3(0), found);
    FaceSet expected;
    for (const auto& [key, face] : some) {
      const auto [x, y, z, d] = key;
      if (region.contains({x, y, z})) expected[key] = face;
    }
    EXPECT_EQ(found, expected);
    for (const ShapeFace& face : shapes) EXPECT_TRUE(region.contains(face.voxel()));
    EXPECT_FALSE(shapes.empty());
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, ShapeFaces, testing::ValuesIn(sets_of_this_machine()), name_of_set);

TEST(ShapeFacesOfCubes, AgreeInAllFunctions) {
  const VoxelRegistry types = shaped_types();
  const Grid grid = shaped_world(3, {IVec3{-6, -6, -6}, IVec3{8, 8, 8}}, types);
  const FaceSet expected = cube_faces(grid, types, true);
  BlockyMesher mesher;
  std::int64_t count = 0;
  for (const IVec3 chunk : grid.chunks()) {
    const Neighbourhood near = grid.neighbourhood(chunk);
    FaceRows rows;
    mesher.find_faces(near, types, kWholeChunk, rows);
    EXPECT_EQ(rows.count(), mesher.count_faces(near, types));
    count += rows.count();
    for (int i = 0; i < 14 * 14 * 14; ++i) {
      const IVec3 at = IVec3(i % 14, i / 14 % 14, i / 196) - 6;
      if (chunk_of(at) != chunk) continue;
      const IVec3 local = local_of(at);
      const DirectionSet faces = visible_faces(near, types, local);
      for (const Direction d : kDirections) {
        const auto found = expected.find({at.x, at.y, at.z, static_cast<int>(d)});
        EXPECT_EQ(faces.contains(d), found != expected.end());
        if (found == expected.end()) continue;
        EXPECT_EQ(face_occlusion(near, types, local, d), found->second.corners);
      }
    }
  }
  EXPECT_EQ(count, static_cast<std::int64_t>(expected.size()));
}

TEST(ShapeFacesOfCubes, AreCubesForRenderersWithoutShapes) {
  const VoxelRegistry types = shaped_types();
  const Grid grid = shaped_world(4, {IVec3{0}, IVec3{12}}, types);
  QuadBuffer quads;
  ShapeFaceBuffer shapes;
  BlockyMesher().mesh(grid.neighbourhood(IVec3(0)), types, {.bake_occlusion = false, .shapes = ShapeUse::Cubes}, quads,
                      shapes);
  EXPECT_TRUE(shapes.empty());
  FaceSet found;
  for (const Quad& quad : quads) oracle::add_quad(quad, IVec3(0), found);
  FaceSet expected;
  grid.for_each([&](IVec3 v, VoxelType type) {
    for (const Direction d : kDirections) {
      const VoxelType other = grid.get(v + normal_of(d));
      if (other != kAir && (types.is_opaque(other) || other == type)) continue;
      expected[{v.x, v.y, v.z, static_cast<int>(d)}] = {type, {}};
    }
  });
  EXPECT_EQ(found, expected);
}

TEST(ShapeFacesOfCubes, SlabHasSixFacesAndDarkensTheGround) {
  const VoxelRegistry types = shaped_types();
  Grid grid;
  grid.fill_box({IVec3(0), IVec3(5, 1, 5)}, 1);
  grid.set({2, 1, 2}, 4);
  QuadBuffer quads;
  ShapeFaceBuffer shapes;
  BlockyMesher().mesh(grid.neighbourhood(IVec3(0)), types, {}, quads, shapes);
  EXPECT_EQ(shapes.size(), 5U);  // the bottom is covered
  FaceSet faces;
  for (const Quad& quad : quads) oracle::add_quad(quad, IVec3(0), faces);
  const auto top = static_cast<int>(Direction::PosY);
  EXPECT_FALSE(faces.contains({2, 0, 2, top}));
  EXPECT_EQ((faces.at({1, 0, 2, top}).corners), (FaceOcclusion{0, 0, 1, 1}));  // u is z, v is x
  for (const ShapeFace& face : shapes) {
    const bool is_top = face.model_face().direction == Direction::PosY;
    for (std::size_t i = 0; i < 4; ++i) {
      const bool is_at_foot = face.corner(i).y == 1.0F;
      EXPECT_EQ(face.occlusion()[i], is_top || !is_at_foot ? 0 : 2);
    }
  }
}

Texture texture_of(const char* name, std::uint8_t grey) {
  AlphaImage image{16, 16, std::vector<std::uint8_t>(4 * 16 * 16, grey)};
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return *Texture::from_image(name, image);
}

// Four voxels in a row along x, turned four ways.
QuadBuffer quads_of_row(const VoxelProperties& properties) {
  VoxelRegistry types;
  const VoxelType type = *types.add(properties);
  Grid grid;
  for (int i = 0; i < 4; ++i) grid.set({i, 0, 0}, type, {.state = static_cast<std::uint32_t>(i)});
  QuadBuffer quads;
  BlockyMesher().mesh(grid.neighbourhood(IVec3(0)), types, {}, quads);
  return quads;
}

TEST(TurnedFaces, KeepFacesThatLookDifferentApart) {
  std::array<VoxelFace, 6> faces;
  for (std::size_t i = 0; i < 6; ++i) faces[i].texture = texture_of("face", static_cast<std::uint8_t>(40 * i));
  VoxelProperties furnace{.name = "furnace", .state_bits = 2, .orientations = StateOrientations::about_y()};
  EXPECT_EQ(quads_of_row(furnace).size(), 18U);  // without textures: the game draws them
  furnace.faces = VoxelFaces(faces);
  const QuadBuffer quads = quads_of_row(furnace);
  EXPECT_EQ(quads.size(), 18U);
  for (const Quad& quad : quads) {
    const AxisOrientation turn = furnace.orientations.of(static_cast<std::uint32_t>(quad.voxel().x));
    EXPECT_EQ(turned_face(furnace.faces, quad.direction(), quad.orientation()),
              turned_face(furnace.faces, quad.direction(), turn));
    const Direction own = turn.inverse().apply(quad.direction());
    EXPECT_EQ(turned_face(furnace.faces, quad.direction(), turn).texture, furnace.faces[own].texture);
  }
  // Fronts differ from the three other sides; tops and bottoms differ in their turn alone.
  const Texture side = texture_of("side", 90);
  furnace.faces = VoxelFaces({VoxelFace{texture_of("front", 10)}, VoxelFace{side}, VoxelFace{side}, VoxelFace{side},
                              VoxelFace{side}, VoxelFace{side}});
  // +X: front of the first; -X; +Z, -Z: front, and equal sides next to it; tops and bottoms.
  for (const Quad& quad : quads_of_row(furnace)) {
    const auto face = turned_face(furnace.faces, quad.direction(), quad.orientation());
    if (face.texture != side) {
      EXPECT_EQ(quad.size_u() * quad.size_v(), 1);
    }
  }
}

TEST(TurnedFaces, SidesOfALogMerge) {
  const Texture bark = texture_of("bark", 60);
  const Texture end = texture_of("end", 120);
  VoxelProperties log{.name = "log", .state_bits = 2, .faces = VoxelFaces({bark}, {end}, {end})};
  log.orientations = StateOrientations::along_axes();
  VoxelRegistry types;
  const VoxelType type = *types.add(log);
  Grid grid;
  for (int i = 0; i < 4; ++i) grid.set({0, i, 0}, type);
  for (int i = 0; i < 4; ++i) grid.set({5 + i, 0, 0}, type, {.state = 1});
  for (int i = 0; i < 4; ++i) grid.set({10 + i, 0, 0}, type, {.state = static_cast<std::uint32_t>(i % 2)});
  QuadBuffer quads;
  BlockyMesher().mesh(grid.neighbourhood(IVec3(0)), types, {}, quads);
  const auto count = [&](int low, int high) {
    return std::ranges::count_if(quads, [&](Quad q) { return q.voxel().x >= low && q.voxel().x < high; });
  };
  EXPECT_EQ(count(0, 1), 6);
  EXPECT_EQ(count(5, 9), 6);
  EXPECT_EQ(count(10, 14), 18);
}

}  // namespace
}  // namespace quoin

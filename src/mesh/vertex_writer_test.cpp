#include <quoin/mesh/vertex_writer.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <quoin/grid/density_grid.h>
#include <quoin/mesh/blocky.h>

#include "core/death_for_tests.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "mesh/mesh_oracle.h"

namespace quoin {
namespace {

using enum VertexFormat;

template <class Value>
Value read(const std::vector<std::byte>& bytes, std::size_t at) {
  Value value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// All elements that a block vertex can have; some of them twice, at unusual offsets.
VertexLayout full_layout() {
  return {60,
          {{VertexAttribute::Position, Float32x3, 0},
           {VertexAttribute::Normal, Float32x3, 13},
           {VertexAttribute::Face, Uint8, 25},
           {VertexAttribute::Occlusion, Uint8, 26},
           {VertexAttribute::Type, Uint16, 27},
           {VertexAttribute::Colour, Unorm8x4Srgb, 30},
           {VertexAttribute::Uv, Uint8x2, 34},
           {VertexAttribute::Brightness, Unorm8, 36},
           {VertexAttribute::Normal, Snorm8x4, 37},
           {VertexAttribute::Position, Sint16x4, 41}}};
}

// The vertices and triangles of a grid, written by a VertexWriter.
struct Written {
  std::vector<std::byte> vertices;
  std::vector<std::uint32_t> indices;
};

// Writes the quads whose types have one surface class, chunk by chunk.
Written written(const Grid& grid, const VoxelRegistry& types, const VertexWriter& writer, SurfaceClass surface) {
  Written all;
  BlockyMesher mesher;
  QuadBuffer quads;
  for (const IVec3 chunk : grid.chunks()) {
    mesher.mesh(grid.neighbourhood(chunk), types, {}, quads);
    std::erase_if(quads, [&](const Quad& quad) { return surface_class(types[quad.type()]) != surface; });
    const std::size_t before = all.vertices.size() / writer.layout().stride;
    all.vertices.resize(all.vertices.size() + writer.bytes_needed(vertices_needed(quads.size())));
    writer.write(quads, Vec3(chunk * kChunkEdge), std::span(all.vertices).subspan(writer.bytes_needed(before)));
    const std::size_t indices = all.indices.size();
    all.indices.resize(indices + indices_needed(quads.size()));
    write_indices<std::uint32_t>(std::span<const Quad>(quads), before, std::span(all.indices).subspan(indices));
  }
  return all;
}

TEST(VertexWriter, MatchesBlockyMesh) {
  const VoxelRegistry types = oracle::mixed_types();
  const VertexWriter writer(full_layout(), types);
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Grid grid = oracle::random_world(seed, {IVec3{-90, -70, -20}, IVec3{40, 20, 75}}, 5, 0.004);
    const auto mesh = build_blocky_mesh(grid, types, {});
    ASSERT_TRUE(mesh.has_value());
    for (const SurfaceClass surface : {SurfaceClass::Opaque, SurfaceClass::Transparent}) {
      const BlockyTriangles& expected = mesh->surfaces[static_cast<std::size_t>(surface)];
      const Written found = written(grid, types, writer, surface);
      EXPECT_EQ(found.indices, expected.indices);
      ASSERT_EQ(found.vertices.size(), writer.bytes_needed(expected.positions.size()));
      for (std::size_t i = 0; i < expected.positions.size(); ++i) {
        const std::size_t at = i * writer.layout().stride;
        ASSERT_EQ(read<Vec3>(found.vertices, at), expected.positions[i]);
        const Vec3 normal(normal_of(expected.directions[i]));
        ASSERT_EQ(read<Vec3>(found.vertices, at + 13), normal);
        ASSERT_EQ(read<Direction>(found.vertices, at + 25), expected.directions[i]);
        ASSERT_EQ(read<std::uint8_t>(found.vertices, at + 26), expected.occlusion[i]);
        ASSERT_EQ(read<VoxelType>(found.vertices, at + 27), expected.types[i]);
        ASSERT_EQ(read<Rgba8>(found.vertices, at + 30), types[expected.types[i]].colour);
        constexpr std::array<std::uint8_t, 4> kGrey = {255, 191, 128, 64};
        ASSERT_EQ(read<std::uint8_t>(found.vertices, at + 36), kGrey[expected.occlusion[i]]);
        const auto snorm = read<std::array<std::int8_t, 4>>(found.vertices, at + 37);
        for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(snorm[static_cast<std::size_t>(axis)], 127 * int(normal[axis]));
        const auto whole = read<std::array<std::int16_t, 4>>(found.vertices, at + 41);
        ASSERT_EQ(IVec3(whole[0], whole[1], whole[2]), IVec3(expected.positions[i]));
        ASSERT_EQ(whole[3], 1);
        for (std::size_t rest = 49; rest < 60; ++rest) ASSERT_EQ(found.vertices[at + rest], std::byte{0});
      }
    }
  }
}

TEST(VertexWriter, WritesViewLikeQuads) {
  const VoxelRegistry types = oracle::mixed_types();
  VertexLayout layout = full_layout();
  std::erase_if(layout.elements, [](const VertexElement& element) {
    return element.attribute == VertexAttribute::Uv || element.format == Sint16x4;
  });
  ASSERT_TRUE(can_write(layout, VertexSource::Blocks));
  const VertexWriter writer(layout, types);
  const Grid grid = oracle::random_world(3, {IVec3{-30}, IVec3{70}}, 5, 0.01);
  const auto mesh = build_blocky_mesh(grid, types, {});
  const MeshView view = view_of(mesh->surfaces[0], SurfaceClass::Opaque);
  std::vector<std::byte> found(writer.bytes_needed(view.positions.size()));
  writer.write(view, Vec3(0.0F), found);
  EXPECT_EQ(found, written(grid, types, writer, SurfaceClass::Opaque).vertices);
}

AlphaImage noise(int size, unsigned seed) {
  std::mt19937 random(seed);
  AlphaImage image{size, size, {}};
  for (int i = 0; i < 4 * size * size; ++i) {
    image.rgba.push_back(i % 4 == 3 ? 255 : static_cast<std::uint8_t>(random()));
  }
  return image;
}

// Types with random textures, turns, mirrors and tints, and a plain one.
VoxelRegistry textured_types() {
  std::mt19937 random(9);
  VoxelRegistry types;
  for (int i = 0; i < 3; ++i) {
    std::array<VoxelFace, 6> faces;
    for (VoxelFace& face : faces) {
      face.texture = Texture::from_image("t", noise(16 << (random() % 2), random() % 4)).value();
      face.turn = static_cast<std::uint8_t>(random() % 4);
      face.mirrored = random() % 2 == 0;
      face.tint = {static_cast<std::uint8_t>(random()), 7, 8, 9};
    }
    EXPECT_TRUE(types.add({.name = std::to_string(i), .faces = VoxelFaces(faces)}));
  }
  EXPECT_TRUE(types.add({.name = "plain", .colour = {1, 2, 3, 4}}));
  return types;
}

TEST(VertexWriter, WritesTexturesOfFaces) {
  VoxelRegistry types = textured_types();
  StateOrientations turns;
  for (int i = 0; i < AxisOrientation::kCount; ++i) turns.by_value.push_back(AxisOrientation::at(i));
  const VoxelType turned =
      types.add({.name = "turned", .state_bits = 6, .faces = types[2].faces, .orientations = turns}).value();
  TextureSet textures;
  textures.add(types);
  ASSERT_EQ(textures.arrays().size(), 2U);
  const VertexLayout layout{16,
                            {{VertexAttribute::Texture, Uint32, 0},
                             {VertexAttribute::TextureUv, Float32x2, 4},
                             {VertexAttribute::Tint, Unorm8x4Srgb, 12}}};
  ASSERT_TRUE(can_write(layout, VertexSource::Quads));
  ASSERT_FALSE(can_write(layout, VertexSource::Smooth));
  const VertexWriter writer(layout, types, textures);
  Grid grid;
  std::mt19937 random(2);
  for (int i = 0; i < 60; ++i) {
    const IVec3 low(random() % 40, random() % 40, random() % 40);
    grid.fill_box({low, low + IVec3(1 + random() % 9, 1 + random() % 5, 1 + random() % 7)},
                  static_cast<VoxelType>(random() % 7));  // 6 is not registered
  }
  for (int i = 0; i < 300; ++i)
    grid.set(IVec3(random() % 40, random() % 40, random() % 40), turned,
             {.state = static_cast<std::uint32_t>(random() % 48)});
  QuadBuffer quads;
  BlockyMesher().mesh(grid.neighbourhood({0, 0, 0}), types, {}, quads);
  std::vector<std::byte> bytes(writer.bytes_needed(vertices_needed(quads.size())));
  writer.write(quads, Vec3(0.0F), bytes);
  for (std::size_t i = 0; i < 4 * quads.size(); ++i) {
    const Quad& quad = quads[i / 4];
    const std::size_t at = 16 * i;
    const auto number = read<std::uint32_t>(bytes, at);
    const auto tint = read<Rgba8>(bytes, at + 12);
    VoxelFace face;
    if (quad.type() < 4 || quad.type() == turned) {
      face = turned_face(types[quad.type()].faces, quad.direction(), quad.orientation());
      ASSERT_EQ(textures[(TextureLayer{number >> 16, number & 0xFFFF})], face.texture);
      ASSERT_EQ(tint, (Rgba8{face.tint.r, face.tint.g, face.tint.b, 255}));
    } else {
      ASSERT_EQ(number, 0xFFFF'FFFFU);
      ASSERT_EQ(tint, (quad.type() == 4 ? Rgba8{1, 2, 3, 4} : Rgba8{255, 255, 255, 255}));
    }
    const IVec3 corner = quad.corner(static_cast<int>(i % 4)) - quad.voxel();
    const auto expected = texture_coordinates(texture_frame(face, quad.direction()), Vec3(corner));
    ASSERT_EQ((read<std::array<float, 2>>(bytes, at + 4)), expected);
  }
}

TEST(VertexWriter, WritesTexturesOfViewsAndOfOneArray) {
  VoxelRegistry types;
  const Texture first = Texture::from_image("a", noise(16, 1)).value();
  const Texture second = Texture::from_image("b", noise(16, 2)).value();
  const VoxelFace tinted{.texture = second, .turn = 1, .mirrored = true, .tint = {9, 8, 7, 6}};
  const VoxelType type = types.add({.name = "block", .faces = {{first}, tinted, {first}}}).value();
  TextureSet textures;
  textures.add(types);
  const VertexLayout layout{14,
                            {{VertexAttribute::Texture, Uint16, 0},
                             {VertexAttribute::Tint, Unorm8x4Srgb, 2},
                             {VertexAttribute::TextureUv, Float32x2, 6}}};
  ASSERT_TRUE(can_write(layout, VertexSource::Blocks));
  Grid grid;
  grid.fill_box({{1, 2, 3}, {4, 4, 70}}, type);
  const auto mesh = build_blocky_mesh(grid, types, {});
  const MeshView view = view_of(mesh->surfaces[0], SurfaceClass::Opaque);
  for (const bool has_textures : {false, true}) {
    const VertexWriter writer = has_textures ? VertexWriter(layout, types, textures) : VertexWriter(layout, types);
    std::vector<std::byte> bytes(writer.bytes_needed(view.positions.size()));
    writer.write(view, Vec3(0.0F), bytes);
    for (std::size_t i = 0; i < view.positions.size(); ++i) {
      const bool is_top = view.directions[i] == Direction::PosY;
      const int layer = is_top ? 1 : 0;
      EXPECT_EQ(read<std::uint16_t>(bytes, 14 * i), has_textures ? layer : 0xFFFF);
      EXPECT_EQ(read<Rgba8>(bytes, 14 * i + 2), (is_top ? Rgba8{9, 8, 7, 255} : Rgba8{255, 255, 255, 255}));
    }
    EXPECT_EQ(bytes, written(grid, types, writer, SurfaceClass::Opaque).vertices);
  }
}

// Views name the faces of shapes and of cubes that their state turns.
TEST(VertexWriter, WritesLooksOfViews) {
  VoxelRegistry types = textured_types();
  const StateOrientations turns = StateOrientations::about_y_and_upside_down();
  const VoxelType turned =
      types.add({.name = "turned", .state_bits = 3, .faces = types[2].faces, .orientations = turns}).value();
  const VoxelFace drawn{.texture = Texture::from_image("s", noise(16, 9)).value(), .tint = {90, 80, 70, 255}};
  ShapeElement post{.min = {4, 0, 4}, .max = {12, 16, 12}, .turn = ElementTurn{.axis = 1, .degrees = 30.0F}};
  post.faces.fill({.face = drawn});
  const VoxelType shaped = types.add({.name = "post", .shapes = VoxelShape::from_elements({post}).value()}).value();
  TextureSet textures;
  textures.add(types);
  Grid grid;
  for (int i = 0; i < 8; ++i) grid.set({2 * i, 0, 0}, turned, {.state = static_cast<std::uint32_t>(i)});
  grid.set({0, 4, 0}, shaped);
  grid.set({0, 8, 0}, 1);
  const auto mesh = build_blocky_mesh(grid, types, {});
  const MeshView view = view_of(mesh->surfaces[0], SurfaceClass::Opaque);
  ASSERT_FALSE(view.looks.empty());
  const VertexWriter writer({28,
                             {{VertexAttribute::Texture, Uint32, 0},
                              {VertexAttribute::TextureUv, Float32x2, 4},
                              {VertexAttribute::Tint, Unorm8x4Srgb, 12},
                              {VertexAttribute::Normal, Float32x3, 16}}},
                            types, textures);
  std::vector<std::byte> bytes(writer.bytes_needed(view.positions.size()));
  writer.write(view, Vec3(0.0F), bytes);
  for (std::size_t i = 0; i < view.positions.size(); ++i) {
    const VoxelFace* const face = face_at(view, i, types);
    ASSERT_NE(face, nullptr);
    const auto number = read<std::uint32_t>(bytes, 28 * i);
    ASSERT_NE(number, 0xFFFF'FFFFU);
    EXPECT_EQ(textures[(TextureLayer{number >> 16, number & 0xFFFF})], face->texture);
    EXPECT_EQ(read<Rgba8>(bytes, 28 * i + 12), (Rgba8{face->tint.r, face->tint.g, face->tint.b, 255}));
    EXPECT_EQ(read<Vec3>(bytes, 28 * i + 16), normal_at(view, i));
    if (view.looks[i].face == 0) continue;
    EXPECT_EQ((read<std::array<float, 2>>(bytes, 28 * i + 4)), view.looks[i].uv);
  }
}

// Types with random shapes, with textures of their own and of the type.
Grid shaped_world(VoxelRegistry& types) {
  types = textured_types();
  ShapeTypes shapes(types);
  VoxelProperties stairs = types[shapes.stairs];
  stairs.faces = types[2].faces;
  types.replace(shapes.stairs, stairs);
  ShapeElement post{.min = {4, 0, 4}, .max = {12, 16, 12}, .turn = ElementTurn{.axis = 1, .degrees = 30.0F}};
  const VoxelFace drawn{.texture = Texture::from_image("s", noise(16, 9)).value(), .tint = {90, 80, 70, 255}};
  post.faces.fill({.face = drawn});
  post.faces[2].face->tint.r = 1;
  const VoxelType own = types.add({.name = "post", .shapes = VoxelShape::from_elements({post}).value()}).value();
  Grid grid;
  std::mt19937 random(6);
  for (int i = 0; i < 500; ++i) {
    const IVec3 at(random() % 12, random() % 12, random() % 12);
    const auto type = static_cast<VoxelType>(random() % (own + 1U));
    const std::uint32_t states = (1U << types[type].state_bits) - 1;
    if (type != kAir) grid.set(at, type, {.state = static_cast<std::uint32_t>(random()) & states});
  }
  return grid;
}

TEST(VertexWriter, WritesShapesLikeViews) {
  VoxelRegistry types;
  const Grid grid = shaped_world(types);
  TextureSet textures;
  textures.add(types);
  const VertexLayout layout{55,
                            {{VertexAttribute::Position, Float32x3, 0},
                             {VertexAttribute::Normal, Float32x3, 12},
                             {VertexAttribute::Texture, Uint32, 24},
                             {VertexAttribute::Tint, Unorm16x4, 28},
                             {VertexAttribute::Colour, Unorm8x4, 36},
                             {VertexAttribute::Brightness, Float32, 40},
                             {VertexAttribute::Type, Uint16, 44},
                             {VertexAttribute::Face, Uint8, 46},
                             {VertexAttribute::TextureUv, Float32x2, 47}}};
  ASSERT_TRUE(can_write(layout, VertexSource::Shapes));
  const VertexWriter writer(layout, types, textures);
  const auto mesh = build_blocky_mesh(grid, types, {});
  QuadBuffer quads;
  ShapeFaceBuffer all;
  BlockyMesher().mesh(grid.neighbourhood(IVec3(0)), types, {}, quads, all);
  std::size_t textured = 0;
  for (std::size_t which = 0; which < kSurfaceClasses; ++which) {
    const auto surface = static_cast<SurfaceClass>(which);
    ShapeFaceBuffer faces = all;
    std::erase_if(faces, [&](const ShapeFace& face) { return surface_class(types[face.type]) != surface; });
    const MeshView view = view_of(mesh->surfaces[which], surface);
    const std::size_t vertices = vertices_needed(faces.size());
    ASSERT_GE(view.positions.size(), vertices);
    const std::size_t first = view.positions.size() - vertices;  // shapes come last
    const Vec3 origin(8.0F, -16.0F, 0.5F);
    std::vector<std::byte> expected(writer.bytes_needed(view.positions.size()));
    writer.write(view, origin, expected);
    std::vector<std::byte> found(writer.bytes_needed(vertices));
    writer.write(faces, origin, found);
    for (std::size_t i = 0; i < vertices; ++i) {
      const ShapeFace& face = faces[i / 4];
      const bool has_look = look_of(*face.model, face.model_face(), types[face.type].faces) != nullptr;
      textured += has_look ? 1 : 0;
      const std::size_t at = 55 * (first + i);
      ASSERT_EQ(read<Vec3>(found, 55 * i), read<Vec3>(expected, at));
      ASSERT_EQ(read<Vec3>(found, 55 * i + 12), read<Vec3>(expected, at + 12));
      // Coordinates count only where there is a texture.
      for (std::size_t byte = 24; byte < (has_look ? 55 : 47); ++byte) {
        ASSERT_EQ(found[55 * i + byte], expected[at + byte]) << "vertex " << i << ", byte " << byte;
      }
    }
    std::vector<std::uint32_t> indices(indices_needed(faces.size()));
    write_indices<std::uint32_t>(std::span<const ShapeFace>(faces), first, indices);
    std::vector<std::uint32_t> triangles;  // those with an area
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      if (i % 6 == 3 && faces[i / 6].is_triangle()) continue;
      triangles.insert(triangles.end(), &indices[i], &indices[i] + 3);
    }
    ASSERT_GE(view.indices.size(), triangles.size());
    EXPECT_TRUE(std::ranges::equal(triangles, view.indices.last(triangles.size())));
  }
  EXPECT_GT(textured, 400U);
  EXPECT_GT(vertices_needed(all.size()), textured + 400);
}

TEST(VertexWriter, WritesShapesInFractionsOfVoxels) {
  using Attribute = VertexAttribute;
  EXPECT_FALSE(can_write({8, {{Attribute::Position, Sint16x4, 0}}}, VertexSource::Shapes));
  EXPECT_FALSE(can_write({4, {{Attribute::Position, Uint8x4, 0}}}, VertexSource::Shapes));
  EXPECT_FALSE(can_write({2, {{Attribute::Uv, Uint8x2, 0}}}, VertexSource::Shapes));
  const VertexLayout layout{12, {{Attribute::Uv, Float32x2, 0}, {Attribute::Occlusion, Uint8, 9}}};
  ASSERT_TRUE(can_write(layout, VertexSource::Shapes));
  VoxelRegistry types;
  const VoxelType slab = types.add({.name = "slab", .shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16})}).value();
  Grid grid;
  grid.set({1, 2, 3}, slab);
  QuadBuffer quads;
  ShapeFaceBuffer faces;
  BlockyMesher().mesh(grid.neighbourhood(IVec3(0)), types, {}, quads, faces);
  ASSERT_EQ(faces.size(), 6U);
  const VertexWriter writer(layout, types);
  std::vector<std::byte> found(writer.bytes_needed(vertices_needed(faces.size())), std::byte{9});
  writer.write(faces, Vec3(0.0F), found);
  for (std::size_t i = 0; i < 24; ++i) {
    const ModelFace& face = faces[i / 4].model_face();
    const FaceFrame& frame = frame_of(face.direction);
    const auto uv = read<std::array<float, 2>>(found, 12 * i);
    EXPECT_EQ(uv[0], face.corners[i % 4][frame.u]);
    EXPECT_EQ(uv[1], face.corners[i % 4][frame.v]);
    if (frame.axis != 1) {
      EXPECT_EQ(uv[frame.u == 1 ? 0 : 1] == 0.5F, face.corners[i % 4].y == 0.5F);
    }
    EXPECT_EQ(read<std::uint32_t>(found, 12 * i + 8), 0U);
  }
}

// Files can have textures of several sizes, so a set can have more arrays than 16 bits can name.
TEST(VertexWriter, WritesNoTextureForArraysBeyondItsFormat) {
  VoxelRegistry types;
  const Texture small = Texture::from_image("a", noise(16, 1)).value();
  const Texture large = Texture::from_image("b", noise(32, 2)).value();
  const VoxelType type = types.add({.name = "block", .faces = {{small}, {large}, {small}}}).value();
  TextureSet textures;
  textures.add(types);
  ASSERT_EQ(textures.arrays().size(), 2U);
  const VertexLayout layout{6, {{VertexAttribute::Texture, Uint16, 0}, {VertexAttribute::Texture, Uint32, 2}}};
  Grid grid;
  grid.set({1, 2, 3}, type);
  QuadBuffer quads;
  BlockyMesher().mesh(grid.neighbourhood({0, 0, 0}), types, {}, quads);
  const VertexWriter writer(layout, types, textures);
  std::vector<std::byte> bytes(writer.bytes_needed(vertices_needed(quads.size())));
  writer.write(quads, Vec3(0.0F), bytes);
  for (std::size_t i = 0; i < 4 * quads.size(); ++i) {
    const bool is_top = quads[i / 4].direction() == Direction::PosY;
    EXPECT_EQ(read<std::uint16_t>(bytes, 6 * i), is_top ? 0xFFFF : 0);
    EXPECT_EQ(read<std::uint32_t>(bytes, 6 * i + 2), is_top ? 0x10000U : 0U);
  }
}

TEST(VertexWriter, MatchesLayoutOfStruct) {
  struct Vertex {
    Vec3 position;
    std::uint16_t type;
    std::uint8_t face;
    std::uint8_t occlusion;
    float u;
    float v;
  };
  static_assert(sizeof(Vertex) == 24);
  const VoxelRegistry types = oracle::mixed_types();
  const Grid grid = oracle::random_world(4, {IVec3{0}, IVec3{64}}, 5, 0.01);
  QuadBuffer quads;
  BlockyMesher().mesh(grid.neighbourhood(IVec3(0)), types, {}, quads);
  ASSERT_GT(quads.size(), 1'000U);
  const Vec3 origin(0.25F, -100.0F, 7.5F);
  std::vector<Vertex> expected(vertices_needed(quads.size()));
  for_each_vertex(quads, [&](std::size_t i, const QuadVertex& vertex) {
    expected[i] = {Vec3(vertex.position) + origin,
                   vertex.type,
                   static_cast<std::uint8_t>(vertex.direction),
                   vertex.occlusion,
                   static_cast<float>(vertex.u),
                   static_cast<float>(vertex.v)};
  });
  const VertexWriter writer({sizeof(Vertex),
                             {{VertexAttribute::Uv, Float32x2, offsetof(Vertex, u)},
                              {VertexAttribute::Position, Float32x3, offsetof(Vertex, position)},
                              {VertexAttribute::Type, Uint16, offsetof(Vertex, type)},
                              {VertexAttribute::Face, Uint8, offsetof(Vertex, face)},
                              {VertexAttribute::Occlusion, Uint8, offsetof(Vertex, occlusion)}}},
                            types);
  std::vector<std::byte> found(writer.bytes_needed(expected.size()));
  writer.write(quads, origin, found);
  EXPECT_EQ(std::memcmp(found.data(), expected.data(), found.size()), 0);
}

TEST(VertexWriter, CornersMatchQuad) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 1'000; ++i) {
    Quad quad{random() & 0x3FF'FFFF'FFFF'FFFFU};
    quad.bits &= ~(std::uint64_t{7} << Quad::kDirectionShift);
    quad.bits |= random() % 6 << Quad::kDirectionShift;
    const std::array<IVec3, 4> corners = corners_of(quad);
    for (int corner = 0; corner < 4; ++corner) {
      EXPECT_EQ(corners[static_cast<std::size_t>(corner)], quad.corner(corner));
    }
  }
}

TEST(VertexWriter, WritesColoursInEveryFormat) {
  VoxelRegistry types;
  VoxelProperties properties;
  properties.colour = {255, 128, 1, 51};
  properties.visibility = Visibility::Transparent;
  ASSERT_TRUE(types.add(properties).has_value());
  const VertexWriter writer({32,
                             {{VertexAttribute::Colour, Float32x4, 0},
                              {VertexAttribute::Colour, Unorm16x4, 16},
                              {VertexAttribute::Colour, Unorm8x4, 24},
                              {VertexAttribute::Colour, Unorm8x4Srgb, 28}}},
                            types);
  std::vector<std::byte> found(writer.bytes_needed(8));
  // The type of the second quad is not registered.
  const QuadBuffer quads = {{std::uint64_t{1} << Quad::kTypeShift}, {std::uint64_t{9} << Quad::kTypeShift}};
  writer.write(quads, Vec3(0.0F), found);
  const auto linear = read<std::array<float, 4>>(found, 0);
  const double green = std::pow((128.0 / 255.0 + 0.055) / 1.055, 2.4);
  const double blue = 1.0 / 255.0 / 12.92;
  EXPECT_FLOAT_EQ(linear[0], 1.0F);
  EXPECT_NEAR(linear[1], green, 1e-6);
  EXPECT_NEAR(linear[2], blue, 1e-7);
  EXPECT_FLOAT_EQ(linear[3], 0.2F);
  const auto wide = read<std::array<std::uint16_t, 4>>(found, 16);
  EXPECT_EQ(wide, (std::array<std::uint16_t, 4>{65'535, static_cast<std::uint16_t>(std::lround(green * 65'535.0)),
                                                static_cast<std::uint16_t>(std::lround(blue * 65'535.0)), 13'107}));
  const auto bytes = read<std::array<std::uint8_t, 4>>(found, 24);
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 4>{255, 55, 0, 51}));
  EXPECT_EQ(read<Rgba8>(found, 28), properties.colour);
  for (std::size_t i = 16; i < 32; ++i) EXPECT_EQ(found[4 * 32 + i], std::byte{255});
}

TEST(VertexWriter, WritesSmoothMeshes) {
  DensityGrid field;
  field.add_sphere({30.0, 31.0, 29.0}, 12.5, 1);
  VoxelRegistry types = oracle::mixed_types();
  const VertexLayout layout = {24,
                               {{VertexAttribute::Position, Float32x3, 0},
                                {VertexAttribute::Normal, Snorm8x4, 12},
                                {VertexAttribute::Brightness, Unorm8, 16},
                                {VertexAttribute::Brightness, Float32, 20}}};
  ASSERT_TRUE(can_write(layout, VertexSource::SmoothChunk));
  const VertexWriter writer(layout, types);
  SmoothChunkMesh chunk;
  SmoothMesher().mesh(field.neighbourhood(IVec3(0)), {}, chunk);
  ASSERT_GT(chunk.positions.size(), 1'000U);
  std::vector<std::byte> found(writer.bytes_needed(chunk.positions.size()));
  const Vec3 origin(1.5F, -20.0F, 64.0F);
  writer.write(chunk, origin, found);
  for (std::size_t i = 0; i < chunk.positions.size(); ++i) {
    const std::size_t at = i * 24;
    ASSERT_EQ(read<Vec3>(found, at), chunk.positions[i] + origin);
    const auto normal = read<std::array<std::int8_t, 4>>(found, at + 12);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_NEAR(normal[static_cast<std::size_t>(axis)] / 127.0, chunk.normals[i][axis], 0.5 / 127.0 + 1e-6);
    }
    ASSERT_NEAR(read<std::uint8_t>(found, at + 16) / 255.0, 1.0F - chunk.occlusion[i], 0.5 / 255.0 + 1e-6);
    ASSERT_EQ(read<float>(found, at + 20), 1.0F - chunk.occlusion[i]);
  }

  const auto mesh = build_smooth_mesh(field, types, {});
  ASSERT_TRUE(mesh.has_value());
  const VertexWriter coloured({8, {{VertexAttribute::Colour, Unorm16x4, 0}}}, types);
  std::vector<std::byte> colours(coloured.bytes_needed(mesh->positions.size()));
  coloured.write(view_of(*mesh), Vec3(0.0F), colours);
  EXPECT_EQ(std::memcmp(colours.data(), mesh->albedo.data(), colours.size()), 0);

  std::vector<std::uint16_t> indices(chunk.indices.size());
  write_indices<std::uint16_t>(std::span<const std::uint32_t>(chunk.indices.data(), chunk.indices.size()), 100,
                               indices);
  std::vector<std::uint16_t> turned(indices.size());
  write_indices<std::uint16_t>(std::span<const std::uint32_t>(chunk.indices.data(), chunk.indices.size()), 100, turned,
                               Winding::Clockwise);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(indices[i + k], chunk.indices[i + k] + 100);
    ASSERT_EQ(turned[i], indices[i]);
    ASSERT_EQ(turned[i + 1], indices[i + 2]);
    ASSERT_EQ(turned[i + 2], indices[i + 1]);
  }
}

TEST(VertexWriter, WritesMaterialsOfSmoothMeshes) {
  VoxelRegistry types = oracle::mixed_types();
  DensityGrid field;
  field.add_sphere({30.0, 31.0, 29.0}, 7.5, 1);
  field.add_sphere({36.0, 31.0, 29.0}, 7.5, 2);
  SmoothMeshOptions options;
  options.materials = true;
  SmoothMesh mesh = build_smooth_mesh(field, types, options).value();
  align_materials(mesh);
  const VertexLayout layout = {28,
                               {{VertexAttribute::Materials, Uint16x4, 0},
                                {VertexAttribute::Weights, Unorm8x4, 8},
                                {VertexAttribute::Weights, Float32x4, 12}}};
  ASSERT_TRUE(can_write(layout, VertexSource::Smooth));
  EXPECT_FALSE(can_write(layout, VertexSource::SmoothChunk));
  EXPECT_FALSE(can_write(layout, VertexSource::Quads));
  const VertexWriter writer(layout, types);
  std::vector<std::byte> found(writer.bytes_needed(mesh.positions.size()));
  writer.write(view_of(mesh), Vec3(0.0F), found);
  std::size_t mixed = 0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const VertexMaterials& expected = mesh.materials[i];
    ASSERT_EQ((read<std::array<VoxelType, 4>>(found, 28 * i)), expected.types);
    ASSERT_EQ((read<std::array<std::uint8_t, 4>>(found, 28 * i + 8)), expected.weights);
    const auto shares = read<std::array<float, 4>>(found, 28 * i + 12);
    for (std::size_t k = 0; k < 4; ++k) ASSERT_EQ(shares[k], static_cast<float>(expected.weights[k]) / 255.0F);
    mixed += expected.weights[1] != 0 ? 1 : 0;
  }
  EXPECT_GT(mixed, 10U);
  // Without materials a vertex has its type.
  mesh.materials.clear();
  MeshView view = view_of(mesh);
  view.types = mesh.types;
  writer.write(view, Vec3(0.0F), found);
  EXPECT_EQ((read<std::array<VoxelType, 4>>(found, 0)), (std::array<VoxelType, 4>{mesh.types[0], 0, 0, 0}));
  EXPECT_EQ((read<std::array<std::uint8_t, 4>>(found, 8)), (std::array<std::uint8_t, 4>{255, 0, 0, 0}));
}

TEST(VertexWriter, ReversesClockwiseTriangles) {
  for (const bool flipped : {false, true}) {
    const auto& plain = triangle_corners(flipped);
    const auto& turned = triangle_corners(flipped, Winding::Clockwise);
    for (std::size_t i = 0; i < 6; i += 3) {
      EXPECT_EQ(turned[i], plain[i]);
      EXPECT_EQ(turned[i + 1], plain[i + 2]);
      EXPECT_EQ(turned[i + 2], plain[i + 1]);
    }
  }
}

TEST(VertexLayout, RejectsUnwritableLayouts) {
  const VertexElement position{VertexAttribute::Position, Float32x3, 0};
  EXPECT_TRUE(can_write({12, {position}}, VertexSource::Quads));
  EXPECT_TRUE(can_write({2'048, {position}}, VertexSource::Smooth));
  EXPECT_TRUE(can_write({1, {}}, VertexSource::Quads));
  EXPECT_FALSE(can_write({0, {}}, VertexSource::Quads));
  EXPECT_FALSE(can_write({2'049, {position}}, VertexSource::Quads));
  EXPECT_FALSE(can_write({11, {position}}, VertexSource::Quads));
  EXPECT_FALSE(can_write({16, {position, {VertexAttribute::Type, Uint16, 11}}}, VertexSource::Quads));
  EXPECT_FALSE(can_write({16, {{VertexAttribute::Type, Uint16, 0xFFFF'FFFFU}}}, VertexSource::Quads));
  EXPECT_FALSE(can_write({16, {{VertexAttribute::Position, Snorm8x4, 0}}}, VertexSource::Quads));
  EXPECT_FALSE(can_write({16, {{VertexAttribute::Position, Sint16x4, 0}}}, VertexSource::SmoothChunk));
  EXPECT_FALSE(can_write({16, {{VertexAttribute::Type, Uint16, 0}}}, VertexSource::Smooth));
  EXPECT_FALSE(can_write({16, {{VertexAttribute::Colour, Unorm8x4, 0}}}, VertexSource::SmoothChunk));
  EXPECT_FALSE(can_write({16, {{VertexAttribute::Uv, Uint8x2, 0}}}, VertexSource::Blocks));
}

TEST(VertexWriterDeathTest, AssertsOnUnwritableLayout) {
  QUOIN_EXPECT_MISTAKE(VertexWriter({4, {{VertexAttribute::Position, Float32x3, 0}}}, {}),
                       "a layout that can be written");
}

TEST(VertexWriterDeathTest, AssertsOnMismatchedBuffersAndLayouts) {
  const VertexWriter writer({16, {{VertexAttribute::Position, Sint16x4, 0}, {VertexAttribute::Uv, Uint8x2, 8}}}, {});
  const QuadBuffer quads(2);
  std::vector<std::byte> out(8 * 16 - 1);
  QUOIN_EXPECT_MISTAKE(writer.write(quads, Vec3(0.0F), out), "out holds 4 vertices per quad");
  out.resize(8 * 16);
  QUOIN_EXPECT_MISTAKE(writer.write(quads, Vec3(0.5F), out), "positions are integers within the format's range");
  QUOIN_EXPECT_MISTAKE(writer.write(quads, Vec3(32'704.0F), out), "positions are integers within the format's range");
  QUOIN_EXPECT_MISTAKE(writer.write(SmoothChunkMesh(), Vec3(0.0F), out), "a layout for smooth chunks");
  QUOIN_EXPECT_MISTAKE(writer.write(MeshView(), Vec3(0.0F), out), "a layout for this kind of mesh");
  const VertexWriter positions({12, {{VertexAttribute::Position, Float32x3, 0}}}, {});
  const std::vector<Vec3> three(3);
  MeshView view;
  view.positions = three;
  QUOIN_EXPECT_MISTAKE(positions.write(view, Vec3(0.0F), std::span(out).first(35)), "room for the vertices");
  SmoothChunkMesh chunk;
  chunk.positions.resize(3);
  QUOIN_EXPECT_MISTAKE(positions.write(chunk, Vec3(0.0F), std::span(out).first(35)), "room for the vertices");
  std::vector<std::uint16_t> indices(11);
  QUOIN_EXPECT_MISTAKE(write_indices<std::uint16_t>(std::span(quads), 0, indices), "out holds 6 indices per quad");
  indices.resize(12);
  QUOIN_EXPECT_MISTAKE(write_indices<std::uint16_t>(std::span(quads), 65'528, indices), "indices fit their type");
  const std::vector<std::uint32_t> far = {0, 1, 65'535};
  QUOIN_EXPECT_MISTAKE(write_indices<std::uint16_t>(std::span(far), 0, indices), "indices fit their type");
  indices.resize(2);
  QUOIN_EXPECT_MISTAKE(write_indices<std::uint16_t>(std::span(far), 0, indices), "whole triangles");
}

}  // namespace
}  // namespace quoin

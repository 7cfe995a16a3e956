// Tests the C interface: its results, and that bad input gives an error and never a crash.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "quoin.h"
#include "structs_for_tests.h"

namespace {

constexpr int kEdge = 12;

template <class T>
quoin_array array_of(const std::vector<T>& values, quoin_scalar scalar, int edge = kEdge) {
  auto array = sized<quoin_array>();
  array.data = values.data();
  array.scalar = scalar;
  const auto bytes = static_cast<std::int64_t>(sizeof(T));
  for (int axis = 0; axis < 3; ++axis) array.shape[axis] = edge;
  array.strides[0] = bytes * edge * edge;
  array.strides[1] = bytes * edge;
  array.strides[2] = bytes;
  return array;
}

// A scene of one grid: a box of kEdge with alternating types 1 and 2.
quoin_scene made_scene(std::vector<std::uint16_t>& voxels) {
  quoin_scene scene = 0;
  EXPECT_EQ(quoin_scene_create(&scene), QUOIN_OK);
  auto type = sized<quoin_type>();
  type.rgba[0] = 200;
  type.rgba[3] = 255;
  type.roughness = 1.0F;
  std::uint16_t number = 0;
  EXPECT_EQ(quoin_type_add(scene, &type, &number), QUOIN_OK);
  EXPECT_EQ(quoin_type_add(scene, &type, &number), QUOIN_OK);
  EXPECT_EQ(number, 2);
  voxels.resize(std::size_t{kEdge} * kEdge * kEdge);
  for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i] = static_cast<std::uint16_t>((i + i / kEdge) % 3);
  const quoin_array array = array_of(voxels, QUOIN_UINT16);
  std::size_t grid = 7;
  EXPECT_EQ(quoin_grid_add(scene, &array, "box", &grid), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(grid, 0U);
  return scene;
}

TEST(C, RoundTripsArrays) {
  std::vector<std::uint16_t> voxels;
  const quoin_scene scene = made_scene(voxels);
  auto info = sized<quoin_grid_info>();
  ASSERT_EQ(quoin_grid_get_info(scene, 0, &info), QUOIN_OK);
  EXPECT_STREQ(info.name, "box");
  EXPECT_EQ(info.extent[1], kEdge);
  std::vector<std::uint16_t> read(voxels.size());
  ASSERT_EQ(quoin_grid_read(scene, 0, info.min, info.extent, read.data(), read.size()), QUOIN_OK);
  EXPECT_EQ(read, voxels);
  EXPECT_EQ(quoin_grid_read(scene, 0, info.min, info.extent, read.data(), read.size() - 1), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

TEST(C, RoundTripsFiles) {
  std::vector<std::uint16_t> voxels;
  const quoin_scene scene = made_scene(voxels);
  ASSERT_EQ(quoin_scene_save(scene, test_file("c_test.json").c_str()), QUOIN_OK) << quoin_last_error();
  ASSERT_EQ(quoin_scene_save(scene, test_file("c_test.glb").c_str()), QUOIN_OK) << quoin_last_error();
  quoin_scene again = 0;
  ASSERT_EQ(quoin_scene_load(test_file("c_test.json").c_str(), &again), QUOIN_OK) << quoin_last_error();
  const std::array<std::int32_t, 3> min{};
  const std::array<std::int32_t, 3> shape{kEdge, kEdge, kEdge};
  std::vector<std::uint16_t> read(voxels.size());
  ASSERT_EQ(quoin_grid_read(again, 0, min.data(), shape.data(), read.data(), read.size()), QUOIN_OK);
  EXPECT_EQ(read, voxels);
  EXPECT_EQ(quoin_free(again), QUOIN_OK);
  EXPECT_EQ(quoin_scene_load(test_file("c_test.nothing").c_str(), &again), QUOIN_CANNOT_READ);
  EXPECT_NE(std::string(quoin_last_error()).find("c_test.nothing"), std::string::npos);
  EXPECT_EQ(quoin_scene_load_bytes("VOX ????", 8, &again), QUOIN_BAD_FORMAT);
  EXPECT_EQ(quoin_scene_save(scene, test_file("c_test.unknown").c_str()), QUOIN_UNSUPPORTED);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

TEST(C, MeshesBallInPlace) {
  std::vector<float> values(std::size_t{kEdge} * kEdge * kEdge);
  for (int i = 0; i < kEdge * kEdge * kEdge; ++i) {
    const double x = static_cast<double>(i / (kEdge * kEdge)) - 5.5;
    const double y = static_cast<double>(i / kEdge % kEdge) - 5.5;
    const double z = static_cast<double>(i % kEdge) - 5.5;
    values[static_cast<std::size_t>(i)] = static_cast<float>(std::sqrt(x * x + y * y + z * z) - 4.0);
  }
  quoin_array array = array_of(values, QUOIN_FLOAT32);
  quoin_mesh mesh = 0;
  ASSERT_EQ(quoin_surface_nets(&array, 0.0, 1, 0, &mesh), QUOIN_OK) << quoin_last_error();
  auto data = sized<quoin_mesh_data>();
  ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  ASSERT_GT(data.vertex_count, 100U);
  for (std::size_t i = 0; i < data.vertex_count; ++i) {
    const float* p = data.positions + 3 * i;
    EXPECT_NEAR(std::hypot(p[0] - 5.5, p[1] - 5.5, p[2] - 5.5), 4.0, 0.25);
  }
  auto twice = sized<quoin_mesh_data>();
  ASSERT_EQ(quoin_mesh_view(mesh, &twice), QUOIN_OK);
  EXPECT_EQ(data.positions, twice.positions);
  EXPECT_EQ(data.colours, nullptr);
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
  EXPECT_EQ(quoin_mesh_view(mesh, &data), QUOIN_BAD_HANDLE);
  for (float& value : values) value = std::numeric_limits<float>::quiet_NaN();
  ASSERT_EQ(quoin_surface_nets(&array, 0.0, 1, 0, &mesh), QUOIN_OK);
  ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  EXPECT_EQ(data.index_count, 0U);
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
  EXPECT_EQ(quoin_mesh_labels(&array, 0, 4, 0, &mesh), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_surface_nets(&array, std::nan(""), 0, 0, &mesh), QUOIN_INVALID_ARGUMENT);
}

TEST(C, SurfacesHaveNoDegenerateTrianglesAtIso) {
  std::vector<std::uint8_t> values(std::size_t{kEdge} * kEdge * kEdge);
  for (int i = 0; i < kEdge * kEdge * kEdge; ++i) {
    const int x = i / (kEdge * kEdge) - 5;
    const int y = i / kEdge % kEdge - 5;
    const int z = i % kEdge - 5;
    values[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::abs(x) + std::abs(y) + std::abs(z));
  }
  const quoin_array array = array_of(values, QUOIN_UINT8);
  quoin_mesh mesh = 0;
  ASSERT_EQ(quoin_surface_nets(&array, 4.0, 1, 0, &mesh), QUOIN_OK) << quoin_last_error();
  auto data = sized<quoin_mesh_data>();
  ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  ASSERT_GT(data.index_count, 100U);
  const auto is_one_point = [&](std::uint32_t a, std::uint32_t b) {
    return std::equal(data.positions + 3 * a, data.positions + 3 * a + 3, data.positions + 3 * b);
  };
  for (std::size_t i = 0; i < data.index_count; i += 3) {
    const std::uint32_t* corner = data.indices + i;
    EXPECT_FALSE(is_one_point(corner[0], corner[1]) || is_one_point(corner[1], corner[2]) ||
                 is_one_point(corner[2], corner[0]));
  }
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
}

TEST(C, MeshesLabelsAndGrids) {
  std::vector<std::uint16_t> voxels;
  const quoin_scene scene = made_scene(voxels);
  const quoin_array array = array_of(voxels, QUOIN_UINT16);
  quoin_mesh mesh = 0;
  auto data = sized<quoin_mesh_data>();
  ASSERT_EQ(quoin_mesh_labels(&array, 0, 4, 1, &mesh), QUOIN_OK);
  ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  EXPECT_EQ(data.interface_count, 3U);  // 1 and 2 with air, and with each other
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
  for (const int smooth : {0, 1}) {
    auto options = sized<quoin_mesh_options>();
    options.smooth = smooth;
    ASSERT_EQ(quoin_grid_mesh(scene, 0, &options, &mesh), QUOIN_OK) << quoin_last_error();
    ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
    EXPECT_GT(data.index_count, 0U);
    for (std::size_t i = 0; i < data.index_count; ++i) ASSERT_LT(data.indices[i], data.vertex_count);
    for (std::size_t i = 0; i < data.vertex_count; ++i) EXPECT_EQ(data.colours[4 * i + 3], 255);
    EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
  }
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

// Finds vertices inside triangle edges: a plate with a pillar of another type on its middle.
std::size_t corners_in_edges(std::int32_t watertight) {
  std::vector<std::uint16_t> voxels(std::size_t{kEdge} * kEdge * kEdge);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const std::size_t y = i / kEdge % kEdge;
    const bool is_pillar = i % kEdge == 5 && i / kEdge / kEdge == 5;
    if (y == 0 || (is_pillar && y < 4)) voxels[i] = y == 0 ? 1 : 2;
  }
  std::vector<std::uint16_t> mixed;
  const quoin_scene scene = made_scene(mixed);
  const quoin_array array = array_of(voxels, QUOIN_UINT16);
  std::size_t grid = 0;
  EXPECT_EQ(quoin_grid_add(scene, &array, "plate", &grid), QUOIN_OK);
  auto options = sized<quoin_mesh_options>();
  options.watertight = watertight;
  quoin_mesh mesh = 0;
  EXPECT_EQ(quoin_grid_mesh(scene, grid, &options, &mesh), QUOIN_OK) << quoin_last_error();
  auto data = sized<quoin_mesh_data>();
  EXPECT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  const auto at = [&](std::size_t vertex, int axis) {
    return data.positions[3 * vertex + static_cast<unsigned>(axis)];
  };
  std::size_t found = 0;
  for (std::size_t i = 0; i < data.index_count; ++i) {
    const std::size_t a = data.indices[i];
    const std::size_t b = data.indices[i % 3 == 2 ? i - 2 : i + 1];
    for (std::size_t vertex = 0; vertex < data.vertex_count; ++vertex) {
      double from_a = 0.0, from_b = 0.0, whole = 0.0;
      for (int axis = 0; axis < 3; ++axis) {
        from_a += std::pow(at(vertex, axis) - at(a, axis), 2);
        from_b += std::pow(at(vertex, axis) - at(b, axis), 2);
        whole += std::pow(at(b, axis) - at(a, axis), 2);
      }
      // Corners have integer coordinates: distances of a point between two corners add up to the edge's length.
      const bool is_between = std::abs(std::sqrt(from_a) + std::sqrt(from_b) - std::sqrt(whole)) < 1e-9;
      if (is_between && from_a > 0.0 && from_b > 0.0) ++found;
    }
  }
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
  return found;
}

TEST(C, WatertightMeshesHaveNoCornerInsideEdge) {
  EXPECT_GT(corners_in_edges(0), 0U);
  EXPECT_EQ(corners_in_edges(1), 0U);
}

TEST(C, RendersRequestedSun) {
  std::vector<std::uint16_t> voxels;
  const quoin_scene scene = made_scene(voxels);
  auto options = sized<quoin_render_options>();
  options.width = 32;
  options.height = 24;
  options.samples = 1;
  const auto taken = [&] {
    std::vector<std::uint8_t> image(std::size_t{3} * 32 * 24);
    EXPECT_EQ(quoin_scene_render(scene, &options, image.data(), image.size()), QUOIN_OK) << quoin_last_error();
    return image;
  };
  for (const int paths : {0, 1}) {
    options.paths = paths;
    options.has_sun = 0;
    options.sun[0] = options.sun[1] = options.sun[2] = 0.0;
    const auto without = taken();
    options.has_sun = 1;
    options.sun[0] = -0.48;
    options.sun[1] = 0.72;
    options.sun[2] = 0.5;
    EXPECT_EQ(taken(), without) << "Quoin's own";
    options.sun[0] = 0.9;
    options.sun[1] = 0.2;
    EXPECT_NE(taken(), without);
    options.size = offsetof(quoin_render_options, has_sun);  // as in older programs
    EXPECT_EQ(taken(), without);
    options.size = sizeof options;
  }
  std::vector<std::uint8_t> image(std::size_t{3} * 32 * 24);
  for (const double wrong : {0.0, std::nan("")}) {
    options.sun[0] = options.sun[1] = options.sun[2] = wrong;
    EXPECT_EQ(quoin_scene_render(scene, &options, image.data(), image.size()), QUOIN_INVALID_ARGUMENT);
    EXPECT_NE(std::string(quoin_last_error()).find("sun"), std::string::npos);
  }
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

TEST(C, RendersAndTracesScene) {
  std::vector<std::uint16_t> voxels;
  const quoin_scene scene = made_scene(voxels);
  auto options = sized<quoin_render_options>();
  options.width = 32;
  options.height = 24;
  std::vector<std::uint8_t> image(std::size_t{3} * 32 * 24, 1);
  for (const int paths : {0, 1}) {
    options.paths = paths;
    options.samples = 1;
    ASSERT_EQ(quoin_scene_render(scene, &options, image.data(), image.size()), QUOIN_OK) << quoin_last_error();
    EXPECT_NE(image, std::vector<std::uint8_t>(image.size(), image[0]));
  }
  EXPECT_EQ(quoin_scene_render(scene, &options, image.data(), image.size() - 1), QUOIN_INVALID_ARGUMENT);
  options.has_camera = 1;
  options.camera[0] = std::nan("");
  EXPECT_EQ(quoin_scene_render(scene, &options, image.data(), image.size()), QUOIN_INVALID_ARGUMENT);
  const std::vector<double> origins = {2.5, 50.0, 2.5, -9.0, -9.0, -9.0, std::nan(""), 0.0, 0.0};
  const std::vector<double> directions = {0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0};
  std::array<double, 3> t{};
  std::array<std::int32_t, 9> voxel{};
  auto hits = sized<quoin_hits>();
  hits.t = t.data();
  hits.voxel = voxel.data();
  ASSERT_EQ(quoin_scene_rays(scene, 3, origins.data(), directions.data(), 1e9, &hits), QUOIN_OK);
  EXPECT_EQ(t[0], 50.0 - voxel[1] - 1.0);
  EXPECT_EQ(voxel[0], 2);
  EXPECT_TRUE(std::isinf(t[1]) && std::isinf(t[2]));
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

TEST(C, WeighsGridsAndPieces) {
  std::vector<std::uint16_t> voxels;
  const quoin_scene scene = made_scene(voxels);
  // Two voxels of type 1, and a column of two voxels of type 2.
  std::vector<std::uint16_t> types(5 * 2 * 1);
  types[0 * 2] = types[1 * 2] = 1;
  types[4 * 2] = types[4 * 2 + 1] = 2;
  quoin_array array = array_of(types, QUOIN_UINT16);
  array.shape[0] = 5;
  array.shape[1] = 2;
  array.shape[2] = 1;
  array.strides[0] = 4;
  array.strides[1] = array.strides[2] = 2;
  array.origin[0] = 10.0;
  std::size_t grid = 0;
  ASSERT_EQ(quoin_grid_add(scene, &array, "pieces", &grid), QUOIN_OK) << quoin_last_error();
  const std::array<double, 3> densities{0.0, 1.0, 3.0};
  auto whole = sized<quoin_body>();
  ASSERT_EQ(quoin_grid_body(scene, grid, densities.data(), densities.size(), &whole), QUOIN_OK) << quoin_last_error();
  EXPECT_DOUBLE_EQ(whole.mass, 8.0);
  EXPECT_EQ(whole.voxels, 4);
  EXPECT_DOUBLE_EQ(whole.centre[0], whole.min[0] + (2.0 * 1.0 + 6.0 * 4.5) / 8.0);
  EXPECT_EQ(whole.extent[0], 5);
  ASSERT_EQ(quoin_grid_body(scene, grid, nullptr, 0, &whole), QUOIN_OK);
  EXPECT_DOUBLE_EQ(whole.mass, 4.0);

  std::size_t pieces = 0;
  ASSERT_EQ(quoin_grid_pieces(scene, grid, nullptr, 0, nullptr, 0, &pieces), QUOIN_OK);
  ASSERT_EQ(pieces, 2U);
  std::array<quoin_body, 3> bodies{sized<quoin_body>(), {}, {}};
  ASSERT_EQ(quoin_grid_pieces(scene, grid, densities.data(), densities.size(), bodies.data(), 3, &pieces), QUOIN_OK);
  EXPECT_EQ(bodies[1].size, sizeof(quoin_body));
  EXPECT_EQ(bodies[2].size, 0U) << "there are only two";
  EXPECT_EQ(bodies[0].voxels, 2);
  EXPECT_EQ(bodies[0].first[0], whole.min[0]);
  EXPECT_DOUBLE_EQ(bodies[1].mass, 6.0);
  EXPECT_DOUBLE_EQ(bodies[1].centre[0], whole.min[0] + 4.5);
  EXPECT_EQ(bodies[1].extent[1], 2);
  // A box of 1x2x1 with the mass 6: mass * (a^2 + b^2) / 12.
  EXPECT_NEAR(bodies[1].inertia[0], 6.0 * (4.0 + 1.0) / 12.0, 1e-12);
  EXPECT_NEAR(bodies[1].inertia[4], 6.0 * (1.0 + 1.0) / 12.0, 1e-12);
  EXPECT_NEAR(bodies[1].inertia[1], 0.0, 1e-12);

  const double wrong = std::nan("");
  EXPECT_EQ(quoin_grid_body(scene, grid, &wrong, 1, &whole), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_grid_body(scene, 9, nullptr, 0, &whole), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_grid_body(scene, grid, nullptr, 0, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_grid_pieces(scene, grid, nullptr, 0, nullptr, 1, &pieces), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_grid_pieces(scene, grid, nullptr, 0, nullptr, 0, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

std::vector<std::uint8_t> texels(int size, std::uint8_t seed) {
  std::vector<std::uint8_t> rgba;
  for (int i = 0; i < 4 * size * size; ++i) rgba.push_back(i % 4 == 3 ? 255 : static_cast<std::uint8_t>(i * 7 + seed));
  return rgba;
}

class CTextures : public testing::Test {
 protected:
  CTextures() : scene_(made_scene(voxels_)), stone_(texels(16, 1)), moss_(texels(32, 5)) {
    faces_.fill(sized<quoin_face>());
    for (quoin_face& face : faces_) {
      std::strcpy(face.name, "stone");
      face.rgba = stone_.data();
      face.texels = 16;
    }
    std::strcpy(faces_[2].name, "moss");  // +Y
    faces_[2].rgba = moss_.data();
    faces_[2].texels = 32;
    faces_[2].turn = 1;
    faces_[2].mirrored = 1;
    faces_[2].has_tint = 1;
    faces_[2].tint[0] = 255;
    faces_[2].tint[1] = 128;
  }
  ~CTextures() override { EXPECT_EQ(quoin_free(scene_), QUOIN_OK); }
  CTextures(const CTextures&) = delete;
  CTextures& operator=(const CTextures&) = delete;

  quoin_textures textures(std::size_t max_layers = 0) {
    quoin_textures made = 0;
    EXPECT_EQ(quoin_scene_textures(scene_, max_layers, &made), QUOIN_OK) << quoin_last_error();
    return made;
  }

  std::vector<std::uint16_t> voxels_;
  quoin_scene scene_;
  std::vector<std::uint8_t> stone_;
  std::vector<std::uint8_t> moss_;
  std::array<quoin_face, 6> faces_{};
};

TEST_F(CTextures, AreReadFromTypes) {
  ASSERT_EQ(quoin_type_set_faces(scene_, 1, faces_.data()), QUOIN_OK) << quoin_last_error();
  const quoin_textures made = textures();
  std::array<quoin_face, 6> read{};
  read.fill(sized<quoin_face>());
  std::size_t count = 9;
  ASSERT_EQ(quoin_textures_faces(made, 1, read.data(), &count), QUOIN_OK) << quoin_last_error();
  ASSERT_EQ(count, 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(read[i].size, sizeof(quoin_face));
    EXPECT_STREQ(read[i].name, faces_[i].name);
    EXPECT_EQ(read[i].texels, faces_[i].texels);
    EXPECT_TRUE(std::equal(read[i].rgba, read[i].rgba + 4 * read[i].texels * read[i].texels, faces_[i].rgba));
    EXPECT_EQ(read[i].turn, faces_[i].turn);
    EXPECT_EQ(read[i].mirrored, faces_[i].mirrored);
    EXPECT_EQ(read[i].has_tint, faces_[i].has_tint);
    EXPECT_EQ(read[i].alpha, QUOIN_FACE_OPAQUE);
    EXPECT_EQ(read[i].texture, i == 2 ? 0x10000U : 0U);
  }
  EXPECT_EQ(read[2].tint[1], 128);
  ASSERT_EQ(quoin_textures_faces(made, 2, read.data(), &count), QUOIN_OK);
  EXPECT_EQ(count, 0U);
  // They belong to the handle: changes of the scene do not affect them.
  ASSERT_EQ(quoin_type_set_faces(scene_, 1, nullptr), QUOIN_OK);
  EXPECT_TRUE(std::equal(stone_.begin(), stone_.end(), read[0].rgba));
  const quoin_textures none = textures();
  ASSERT_EQ(quoin_textures_faces(none, 1, read.data(), &count), QUOIN_OK);
  EXPECT_EQ(count, 0U);
  EXPECT_EQ(quoin_free(none), QUOIN_OK);
  EXPECT_EQ(quoin_free(made), QUOIN_OK);
  EXPECT_EQ(quoin_textures_faces(made, 1, read.data(), &count), QUOIN_BAD_HANDLE);
}

TEST_F(CTextures, AreLayersOfArrays) {
  std::vector<std::uint8_t> sand = texels(16, 9);
  ASSERT_EQ(quoin_type_set_faces(scene_, 1, faces_.data()), QUOIN_OK);
  for (quoin_face& face : faces_) face.rgba = sand.data();
  faces_[2].rgba = moss_.data();
  ASSERT_EQ(quoin_type_set_faces(scene_, 2, faces_.data()), QUOIN_OK);
  const quoin_textures made = textures();
  std::size_t count = 0;
  ASSERT_EQ(quoin_textures_array_count(made, &count), QUOIN_OK);
  ASSERT_EQ(count, 2U);
  auto array = sized<quoin_texture_array>();
  ASSERT_EQ(quoin_textures_array_get(made, 0, &array), QUOIN_OK);
  EXPECT_EQ(array.texels, 16);
  EXPECT_EQ(array.levels, 5);
  ASSERT_EQ(array.layers, 2U);
  std::vector<std::uint8_t> rgba(2 * stone_.size());
  ASSERT_EQ(quoin_textures_read(made, 0, 0, rgba.data(), rgba.size()), QUOIN_OK);
  EXPECT_TRUE(std::equal(stone_.begin(), stone_.end(), rgba.begin()));
  EXPECT_TRUE(std::equal(sand.begin(), sand.end(), rgba.begin() + static_cast<std::ptrdiff_t>(stone_.size())));
  ASSERT_EQ(quoin_textures_read(made, 0, 4, rgba.data(), 8), QUOIN_OK);  // one texel each
  EXPECT_EQ(quoin_textures_read(made, 0, 4, rgba.data(), 7), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_textures_read(made, 0, 5, rgba.data(), rgba.size()), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_textures_read(made, 0, -1, rgba.data(), rgba.size()), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_textures_read(made, 2, 0, rgba.data(), rgba.size()), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_textures_read(made, 0, 0, nullptr, rgba.size()), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_textures_array_get(made, 2, &array), QUOIN_INVALID_ARGUMENT);
  const quoin_textures split = textures(1);
  ASSERT_EQ(quoin_textures_array_count(split, &count), QUOIN_OK);
  EXPECT_EQ(count, 3U);
  EXPECT_EQ(quoin_free(split), QUOIN_OK);
  EXPECT_EQ(quoin_free(made), QUOIN_OK);
}

TEST_F(CTextures, GiveMeshesNumbersCoordinatesAndTints) {
  ASSERT_EQ(quoin_type_set_faces(scene_, 1, faces_.data()), QUOIN_OK);
  const std::vector<std::uint8_t> bar(3, 1);  // 3 x 1 x 1 voxels
  auto array = sized<quoin_array>();
  array.data = bar.data();
  array.shape[0] = 3;
  array.shape[1] = array.shape[2] = 1;
  array.origin[0] = 9.0;
  std::size_t grid = 0;
  ASSERT_EQ(quoin_grid_add(scene_, &array, nullptr, &grid), QUOIN_OK) << quoin_last_error();
  const quoin_textures split = textures(1);
  for (const quoin_textures numbers : {quoin_textures{0}, split}) {
    for (const int watertight : {0, 1}) {
      auto options = sized<quoin_mesh_options>();
      options.textures = numbers;
      options.watertight = watertight;
      quoin_mesh mesh = 0;
      ASSERT_EQ(quoin_grid_mesh(scene_, grid, &options, &mesh), QUOIN_OK) << quoin_last_error();
      auto data = sized<quoin_mesh_data>();
      ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
      ASSERT_NE(data.textures, nullptr);
      for (std::size_t i = 0; i < data.vertex_count; ++i) {
        const float* const at = data.positions + 3 * i;
        const float* const uv = data.texture_uvs + 2 * i;
        const bool is_top = data.normals[3 * i + 1] > 0.5F;
        EXPECT_EQ(data.textures[i], is_top ? 0x10000U : 0U);
        EXPECT_EQ(data.tints[4 * i + 1], is_top ? 128 : 255);
        if (data.normals[3 * i + 2] > 0.5F) {  // +Z: right is +X, down is -Y
          EXPECT_EQ(uv[0], at[0]);
          EXPECT_EQ(uv[1], -at[1]);
        } else if (is_top) {  // right is +Z and down -X; turned: -X and -Z; mirrored: +X and -Z
          EXPECT_EQ(uv[0], at[0]);
          EXPECT_EQ(uv[1], -at[2]);
        }
      }
      EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
    }
  }
  // Untextured types show their colours; smooth surfaces have no textures.
  auto options = sized<quoin_mesh_options>();
  quoin_mesh mesh = 0;
  ASSERT_EQ(quoin_grid_mesh(scene_, 0, &options, &mesh), QUOIN_OK);
  auto data = sized<quoin_mesh_data>();
  ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  std::size_t plain = 0;
  for (std::size_t i = 0; i < data.vertex_count; ++i) {
    if (data.types[i] != 2) continue;
    ++plain;
    EXPECT_EQ(data.textures[i], QUOIN_NO_TEXTURE);
    EXPECT_TRUE(std::equal(data.tints + 4 * i, data.tints + 4 * i + 4, data.colours + 4 * i));
  }
  EXPECT_GT(plain, 0U);
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
  options.smooth = 1;
  ASSERT_EQ(quoin_grid_mesh(scene_, 0, &options, &mesh), QUOIN_OK);
  ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  EXPECT_EQ(data.textures, nullptr);
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
  EXPECT_EQ(quoin_free(split), QUOIN_OK);
}

// A post, turned by 30 degrees, whose sides have a texture or only a tint.
TEST_F(CTextures, GiveMeshesOfShapesTheirOwnLooks) {
  ASSERT_EQ(quoin_scene_save(scene_, test_file("cubes.json").c_str()), QUOIN_OK) << quoin_last_error();
  std::ifstream file(test_file("cubes.json"));
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string texels(1'024, 'A');  // 16 x 16 black texels
  const std::string post =
      R"("shapes": {"textures": [{"name": "post", "size": 16, "texels": ")" + texels +
      R"("}], "parts": [{"elements": [{"min": [4, 0, 4], "max": [12, 16, 12], "turn": {"degrees": 30}, "faces": [)"
      R"({"face": {"tint": [10, 20, 30, 255]}}, {"face": {"tint": [10, 20, 30, 255]}}, {"face": {"texture": 0}},)"
      R"({"face": {"texture": 0}}, {"face": {"texture": 0}}, {"face": {"texture": 0}}]}]}]}, )";
  text.insert(text.find('{', text.find("\"types\"")) + 1, post);
  const std::string version = "\"quoin_scene\": 2";
  ASSERT_NE(text.find(version), std::string::npos) << text.substr(0, 99);
  text.replace(text.find(version), version.size(), "\"quoin_scene\": 9");
  std::ofstream(test_file("posts.json")) << text;
  quoin_scene scene = 0;
  ASSERT_EQ(quoin_scene_load(test_file("posts.json").c_str(), &scene), QUOIN_OK) << quoin_last_error();
  auto options = sized<quoin_mesh_options>();
  quoin_mesh mesh = 0;
  ASSERT_EQ(quoin_grid_mesh(scene, 0, &options, &mesh), QUOIN_OK) << quoin_last_error();
  auto data = sized<quoin_mesh_data>();
  ASSERT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
  ASSERT_NE(data.textures, nullptr);
  std::size_t sides = 0;
  for (std::size_t i = 0; i < data.vertex_count; ++i) {
    const float* const normal = data.normals + 3 * i;
    if (data.types[i] != 1 || std::abs(normal[1]) > 0.5F) continue;
    ++sides;
    EXPECT_NEAR(std::max(std::abs(normal[0]), std::abs(normal[2])), std::sqrt(0.75F), 1e-5F);
    const bool is_tinted = std::abs(normal[0]) > std::abs(normal[2]);
    EXPECT_EQ(data.textures[i], is_tinted ? QUOIN_NO_TEXTURE : 0U);
    EXPECT_EQ(data.tints[4 * i + 2], is_tinted ? 30 : 255);
    EXPECT_EQ(data.colours[4 * i + 2], is_tinted ? 30 : 0);
  }
  EXPECT_GT(sides, 0U);
  EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
}

TEST_F(CTextures, KeepSharesOfEmission) {
  faces_[2].has_emission_share = 1;
  faces_[2].emission_share = 0;
  faces_[3].has_emission_share = 1;
  faces_[3].emission_share = 90;
  faces_[4].emission_share = 7;  // without effect
  ASSERT_EQ(quoin_type_set_faces(scene_, 1, faces_.data()), QUOIN_OK) << quoin_last_error();
  const quoin_textures all = textures(1);
  std::array<quoin_face, 6> read{};
  for (quoin_face& face : read) face.size = sizeof face;
  std::size_t count = read.size();
  ASSERT_EQ(quoin_textures_faces(all, 1, read.data(), &count), QUOIN_OK) << quoin_last_error();
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].has_emission_share, i == 2 || i == 3 ? 1 : 0);
    EXPECT_EQ(read[i].emission_share, i == 2 ? 0 : i == 3 ? 90 : 255);
  }
  EXPECT_EQ(quoin_free(all), QUOIN_OK);
  for (const int wrong : {-1, 256}) {
    faces_[2].emission_share = wrong;
    EXPECT_EQ(quoin_type_set_faces(scene_, 1, faces_.data()), QUOIN_INVALID_ARGUMENT);
    EXPECT_STREQ(quoin_last_error(), "the emission_share of a face must be 0 to 255");
  }
}

TEST_F(CTextures, GiveTypesTheirMeanColour) {
  auto type = sized<quoin_type>();
  std::vector<std::uint8_t> half = texels(16, 0);
  for (std::size_t i = 0; i < half.size(); ++i) half[i] = i % 4 == 3 ? (i % 8 == 3 ? 255 : 0) : 90;
  for (quoin_face& face : faces_) {
    face = faces_[0];
    face.rgba = half.data();
    face.alpha = QUOIN_FACE_CUTOUT;
  }
  EXPECT_EQ(quoin_type_set_faces(scene_, 1, faces_.data()), QUOIN_INVALID_ARGUMENT);
  EXPECT_NE(std::string(quoin_last_error()).find("transparent"), std::string::npos) << quoin_last_error();
  type.rgba[3] = 100;
  std::uint16_t leaves = 0;
  ASSERT_EQ(quoin_type_add(scene_, &type, &leaves), QUOIN_OK);
  ASSERT_EQ(quoin_type_set_faces(scene_, leaves, faces_.data()), QUOIN_OK) << quoin_last_error();
  ASSERT_EQ(quoin_type_get(scene_, leaves, &type), QUOIN_OK);
  EXPECT_EQ(type.rgba[0], 90);
  EXPECT_EQ(type.rgba[3], 128);
  // Files of voxels keep textures.
  ASSERT_EQ(quoin_scene_save(scene_, test_file("textures.json").c_str()), QUOIN_OK) << quoin_last_error();
  quoin_scene again = 0;
  ASSERT_EQ(quoin_scene_load(test_file("textures.json").c_str(), &again), QUOIN_OK) << quoin_last_error();
  quoin_textures made = 0;
  ASSERT_EQ(quoin_scene_textures(again, 0, &made), QUOIN_OK);
  std::array<quoin_face, 6> read{};
  read[0] = sized<quoin_face>();
  std::size_t count = 0;
  ASSERT_EQ(quoin_textures_faces(made, leaves, read.data(), &count), QUOIN_OK);
  ASSERT_EQ(count, 6U);
  EXPECT_EQ(read[5].alpha, QUOIN_FACE_CUTOUT);
  EXPECT_TRUE(std::equal(half.begin(), half.end(), read[5].rgba));
  EXPECT_EQ(quoin_free(made), QUOIN_OK);
  EXPECT_EQ(quoin_free(again), QUOIN_OK);
}

TEST_F(CTextures, ReportErrorsForInvalidArguments) {
  const auto refuses = [&](auto&& change) {
    std::array<quoin_face, 6> wrong = faces_;
    change(wrong[3]);
    return quoin_type_set_faces(scene_, 1, wrong.data()) == QUOIN_INVALID_ARGUMENT;
  };
  EXPECT_TRUE(refuses([](quoin_face& face) { face.size = 0; }));
  EXPECT_TRUE(refuses([](quoin_face& face) { face.rgba = nullptr; }));
  for (const int size : {0, -16, 8, 17, 48, 2048}) EXPECT_TRUE(refuses([&](quoin_face& face) { face.texels = size; }));
  EXPECT_TRUE(refuses([](quoin_face& face) { face.turn = 4; }));
  EXPECT_TRUE(refuses([](quoin_face& face) { face.turn = -1; }));
  EXPECT_TRUE(refuses([](quoin_face& face) { face.alpha = 3; }));
  EXPECT_EQ(quoin_type_set_faces(scene_, 0, faces_.data()), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_type_set_faces(scene_, 3, faces_.data()), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_scene_textures(scene_, 0, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_type_set_faces(0, 1, nullptr), QUOIN_BAD_HANDLE);
  // Nothing has changed, and a scene is not a set of textures.
  const quoin_textures made = textures();
  std::size_t count = 5;
  ASSERT_EQ(quoin_textures_array_count(made, &count), QUOIN_OK);
  EXPECT_EQ(count, 0U);
  EXPECT_EQ(quoin_textures_array_count(made, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_textures_array_count(scene_, &count), QUOIN_BAD_HANDLE);
  EXPECT_EQ(quoin_textures_faces(made, 1, nullptr, &count), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_textures_faces(made, 1, faces_.data(), nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_textures_faces(made, 3, faces_.data(), &count), QUOIN_INVALID_ARGUMENT);
  auto options = sized<quoin_mesh_options>();
  options.textures = scene_;
  quoin_mesh mesh = 0;
  EXPECT_EQ(quoin_grid_mesh(scene_, 0, &options, &mesh), QUOIN_BAD_HANDLE);
  EXPECT_EQ(quoin_free(made), QUOIN_OK);
}

/// Returns a zip file of a folder's files, without compression.
std::vector<unsigned char> zip_of_folder(const std::filesystem::path& folder) {
  std::vector<unsigned char> zip;
  std::vector<unsigned char> directory;
  unsigned count = 0;
  const auto put = [](std::vector<unsigned char>& to, std::uint32_t number, int bytes) {
    for (int i = 0; i < bytes; ++i) to.push_back(static_cast<unsigned char>(number >> 8 * i));
  };
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string text(std::istreambuf_iterator<char>(file), {});
    const std::string name = entry.path().lexically_relative(folder).generic_string();
    std::uint32_t crc = ~0U;
    for (const char c : text) {
      crc ^= static_cast<unsigned char>(c);
      for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc % 2 == 0 ? 0U : 0xEDB88320U);
    }
    const auto at = static_cast<std::uint32_t>(zip.size());
    // Version, flags, method and time; sums and sizes; lengths of the name and of extra fields.
    const auto put_header = [&](std::vector<unsigned char>& to) {
      for (const std::uint32_t number : {20U, 0U, 0U, 0U, 0U}) put(to, number, 2);
      put(to, ~crc, 4);
      for (int i = 0; i < 2; ++i) put(to, static_cast<std::uint32_t>(text.size()), 4);
      put(to, static_cast<std::uint32_t>(name.size()), 2);
      put(to, 0, 2);
    };
    put(zip, 0x04034B50, 4);
    put_header(zip);
    zip.insert(zip.end(), name.begin(), name.end());
    zip.insert(zip.end(), text.begin(), text.end());
    put(directory, 0x02014B50, 4);
    put(directory, 20, 2);
    put_header(directory);
    for (int i = 0; i < 5; ++i) put(directory, 0, 2);
    put(directory, at, 4);
    directory.insert(directory.end(), name.begin(), name.end());
    ++count;
  }
  const auto at = static_cast<std::uint32_t>(zip.size());
  zip.insert(zip.end(), directory.begin(), directory.end());
  put(zip, 0x06054B50, 4);
  put(zip, 0, 4);
  for (int i = 0; i < 2; ++i) put(zip, count, 2);
  put(zip, static_cast<std::uint32_t>(directory.size()), 4);
  put(zip, at, 4);
  put(zip, 0, 2);
  return zip;
}

/// Writes a resource pack, a folder, whose stone is a box of that height, in sixteenths.
std::string write_stone_pack(const std::string& name, int height) {
  namespace fs = std::filesystem;
  const fs::path pack = fs::path(test_file(name));
  fs::create_directories(pack / "assets/minecraft/blockstates");
  fs::create_directories(pack / "assets/minecraft/models/block");
  std::ofstream(pack / "assets/minecraft/blockstates/stone.json") << R"({"variants": {"": {"model": "block/stone"}}})";
  std::ofstream(pack / "assets/minecraft/models/block/stone.json")
      << R"({"elements": [{"from": [0, 0, 0], "to": [16, )" << height << R"(, 16], "faces": {
           "down": {"texture": "#a"}, "up": {"texture": "#a"}, "north": {"texture": "#a"}, "south": {"texture": "#a"},
           "west": {"texture": "#a"}, "east": {"texture": "#a"}}}]})";
  return pack.string();
}

TEST(C, PacksGiveBlocksTheirLooks) {
  quoin_scene scene = 0;
  ASSERT_EQ(quoin_scene_create(&scene), QUOIN_OK);
  auto type = sized<quoin_type>();
  type.rgba[3] = 255;
  type.roughness = 1.0F;
  std::strcpy(type.name, "minecraft:stone");
  std::uint16_t number = 0;
  ASSERT_EQ(quoin_type_add(scene, &type, &number), QUOIN_OK);
  const std::vector<std::uint16_t> voxels = {1};
  const quoin_array array = array_of(voxels, QUOIN_UINT16, 1);
  ASSERT_EQ(quoin_grid_add(scene, &array, "", nullptr), QUOIN_OK);
  const std::string house = test_file("house.schem");
  ASSERT_EQ(quoin_scene_save(scene, house.c_str()), QUOIN_OK) << quoin_last_error();
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);

  auto options = sized<quoin_load_options>();
  // Returns the height of the stone; 0 if it cannot be loaded.
  const auto height = [&] {
    if (quoin_scene_load_with(house.c_str(), &options, &scene) != QUOIN_OK) return 0.0F;
    quoin_mesh mesh = 0;
    auto data = sized<quoin_mesh_data>();
    EXPECT_EQ(quoin_grid_mesh(scene, 0, nullptr, &mesh), QUOIN_OK);
    EXPECT_EQ(quoin_mesh_view(mesh, &data), QUOIN_OK);
    float top = 0.0F;
    for (std::size_t i = 0; i < data.vertex_count; ++i) top = std::max(top, data.positions[3 * i + 1]);
    EXPECT_EQ(quoin_free(mesh), QUOIN_OK);
    EXPECT_EQ(quoin_free(scene), QUOIN_OK);
    return top;
  };
  const std::string half = write_stone_pack("half", 8);
  const std::string quarter = write_stone_pack("quarter", 4);
  std::vector<const char*> packs = {half.c_str(), quarter.c_str(), "builtin"};
  EXPECT_EQ(height(), 1.0F);
  options.packs = packs.data();
  EXPECT_EQ(height(), 1.0F) << "none of them";
  options.pack_count = 1;
  EXPECT_EQ(height(), 0.5F);
  options.pack_count = 3;
  EXPECT_EQ(height(), 0.25F);
  // A program compiled with an older header has no such fields.
  options.size = offsetof(quoin_load_options, packs);
  EXPECT_EQ(height(), 1.0F);
  options = sized<quoin_load_options>();
  options.pack_count = 1;
  EXPECT_EQ(height(), 0.0F) << "packs is null";
  options.packs = packs.data();
  packs[0] = nullptr;
  EXPECT_EQ(height(), 0.0F);
  packs[0] = "";
  EXPECT_EQ(height(), 0.0F);
  options.pack_count = 1'025;
  EXPECT_EQ(height(), 0.0F);
  const std::string absent = test_file("absent.zip");
  packs[0] = absent.c_str();
  options.pack_count = 1;
  EXPECT_EQ(height(), 0.0F);
  EXPECT_NE(std::string(quoin_last_error()).find("absent.zip"), std::string::npos) << quoin_last_error();

  // The bytes of a zip file that has the pack's files without compression.
  std::vector<unsigned char> zip = zip_of_folder(test_file("quarter"));
  const void* bytes = zip.data();
  std::size_t size = zip.size();
  packs[0] = half.c_str();
  options.pack_zips = &bytes;
  options.pack_zip_bytes = &size;
  options.pack_zip_count = 1;
  EXPECT_EQ(height(), 0.25F) << quoin_last_error();
  options.pack_count = 0;
  EXPECT_EQ(height(), 0.25F) << quoin_last_error();
  size -= 30;
  EXPECT_EQ(height(), 0.0F) << "cut off";
  options.pack_zip_bytes = nullptr;
  EXPECT_EQ(height(), 0.0F);
  options.pack_zip_bytes = &size;
  bytes = nullptr;
  EXPECT_EQ(height(), 0.0F);
}

TEST(C, ReportsErrorsForInvalidArguments) {
  std::vector<std::uint16_t> voxels;
  const quoin_scene scene = made_scene(voxels);
  std::size_t count = 0;
  quoin_mesh mesh = 0;
  EXPECT_EQ(quoin_free(0), QUOIN_OK);
  EXPECT_EQ(quoin_free(1'000'000), QUOIN_BAD_HANDLE);
  EXPECT_EQ(quoin_grid_count(0, &count), QUOIN_BAD_HANDLE);
  EXPECT_EQ(quoin_grid_count(scene, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_mesh_view(scene, nullptr), QUOIN_BAD_HANDLE);
  EXPECT_EQ(quoin_scene_create(nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_scene_load(nullptr, nullptr), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_grid_mesh(scene, 5, nullptr, &mesh), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_surface_nets(nullptr, 0.0, 0, 0, &mesh), QUOIN_INVALID_ARGUMENT);
  quoin_array array = array_of(voxels, QUOIN_UINT16);
  array.shape[0] = -1;
  EXPECT_EQ(quoin_surface_nets(&array, 0.5, 0, 0, &mesh), QUOIN_INVALID_ARGUMENT);
  EXPECT_EQ(quoin_grid_add(scene, &array, nullptr, nullptr), QUOIN_INVALID_ARGUMENT);
  array = array_of(voxels, QUOIN_UINT16);
  array.scalar = 99;
  EXPECT_EQ(quoin_mesh_labels(&array, 0, 0, 0, &mesh), QUOIN_INVALID_ARGUMENT);
  array = array_of(voxels, QUOIN_UINT16);
  array.origin[1] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(quoin_grid_add(scene, &array, nullptr, nullptr), QUOIN_INVALID_ARGUMENT);
  voxels[5] = 900;
  array = array_of(voxels, QUOIN_UINT16);
  EXPECT_EQ(quoin_grid_add(scene, &array, nullptr, nullptr), QUOIN_INVALID_ARGUMENT);
  auto type = quoin_type{};  // without its size
  std::uint16_t number = 0;
  EXPECT_EQ(quoin_type_add(scene, &type, &number), QUOIN_INVALID_ARGUMENT);
  type.size = sizeof type;
  type.emission = std::nanf("");
  EXPECT_EQ(quoin_type_add(scene, &type, &number), QUOIN_INVALID_ARGUMENT);
  std::memset(type.name, 'x', sizeof type.name);  // without an end
  type.emission = 0.0F;
  EXPECT_EQ(quoin_type_add(scene, &type, &number), QUOIN_OK);
  EXPECT_EQ(quoin_free(scene), QUOIN_OK);
  EXPECT_EQ(quoin_free(scene), QUOIN_BAD_HANDLE);
  EXPECT_EQ(quoin_scene_render(scene, nullptr, nullptr, 0), QUOIN_BAD_HANDLE);
  EXPECT_STRNE(quoin_last_error(), "");
}

}  // namespace

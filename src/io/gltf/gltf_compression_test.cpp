#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "io/gltf/gltf_for_tests.h"
#include "io/gltf/gltf_layout.h"
#include "io/mesh_file_for_tests.h"

#ifdef QUOIN_HAVE_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace quoin {

namespace {

using Json = nlohmann::json;

/// Returns the bytes of a view, decoded if they are compressed.
std::vector<std::byte> bytes_of_view(const ParsedGlb& glb, const Json& view) {
  const auto slice = [&](const Json& of) {
    const auto first = glb.binary.begin() + of.value("byteOffset", std::ptrdiff_t{0});
    return std::vector<std::byte>(first, first + of["byteLength"].get<std::ptrdiff_t>());
  };
  if (!view.contains("extensions")) return slice(view);
  const Json& extension = view["extensions"]["EXT_meshopt_compression"];
  const auto packed = slice(extension);
  const std::size_t count = extension["count"];
  const std::size_t stride = extension["byteStride"];
  std::vector<std::byte> bytes(count * stride);
#ifdef QUOIN_HAVE_MESHOPTIMIZER
  const auto* from = reinterpret_cast<const unsigned char*>(packed.data());
  const int failed = extension["mode"] == "TRIANGLES"
                         ? meshopt_decodeIndexBuffer(bytes.data(), count, stride, from, packed.size())
                         : meshopt_decodeVertexBuffer(bytes.data(), count, stride, from, packed.size());
  EXPECT_EQ(failed, 0);
#endif
  EXPECT_EQ(view["byteLength"].get<std::size_t>(), bytes.size());
  return bytes;
}

template <class T>
double number_at(const std::byte* at, bool normalized) {
  T value{};
  std::memcpy(&value, at, sizeof(T));
  const auto number = static_cast<double>(value);
  return normalized ? std::max(number / static_cast<double>(std::numeric_limits<T>::max()), -1.0) : number;
}

double number_at(const std::byte* at, int component, bool normalized) {
  switch (component) {
    case 5120:
      return number_at<std::int8_t>(at, normalized);
    case 5121:
      return number_at<std::uint8_t>(at, normalized);
    case 5122:
      return number_at<std::int16_t>(at, normalized);
    case 5123:
      return number_at<std::uint16_t>(at, normalized);
    case 5125:
      return number_at<std::uint32_t>(at, normalized);
    default:
      return number_at<float>(at, false);
  }
}

/// Reads an accessor of any component type, by the specification.
std::vector<std::array<double, 4>> elements(const ParsedGlb& glb, std::size_t accessor) {
  const Json& entry = glb.document["accessors"][accessor];
  const Json& view = glb.document["bufferViews"][entry["bufferView"].get<std::size_t>()];
  const auto bytes = bytes_of_view(glb, view);
  const int component = entry["componentType"];
  const std::string type = entry["type"];
  const std::size_t components = type == "SCALAR" ? 1 : static_cast<std::size_t>(type[3] - '0');
  const std::size_t size = component < 5122 ? 1 : component < 5124 ? 2 : 4;
  const std::size_t stride = view.value("byteStride", components * size);
  std::vector<std::array<double, 4>> all(entry["count"].get<std::size_t>());
  EXPECT_LE((all.size() - 1) * stride + components * size, bytes.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < components; ++k) {
      all[i][k] = number_at(bytes.data() + i * stride + k * size, component, entry.value("normalized", false));
    }
  }
  return all;
}

DVec3 xyz(const std::array<double, 4>& element) {
  return {element[0], element[1], element[2]};
}

/// The visible content of a file by triangle corners: world position, normal and the other vertex attributes.
struct Corners {
  std::vector<DVec3> positions;
  std::vector<DVec3> normals;
  std::vector<std::array<double, 4>> others;
};

/// Triangles begin with their least position if they are compared with a file that rotates them.
Corners corners_of(const ParsedGlb& glb, bool from_least = false) {
  Corners corners;
  for (const Json& node : glb.document["nodes"]) {
    if (!node.contains("mesh")) continue;
    const glm::dmat4 matrix = matrix_of(node);
    const glm::dmat3 normal_matrix = glm::transpose(glm::inverse(glm::dmat3(matrix)));
    for (const Json& primitive : glb.document["meshes"][node["mesh"].get<std::size_t>()]["primitives"]) {
      const Json& attributes = primitive["attributes"];
      const auto positions = elements(glb, attributes["POSITION"]);
      const auto normals = elements(glb, attributes["NORMAL"]);
      const auto indices = elements(glb, primitive["indices"]);
      std::vector<std::vector<std::array<double, 4>>> others;
      for (const char* name : {"TEXCOORD_0", "COLOR_0", "_AO"}) {
        if (attributes.contains(name)) others.push_back(elements(glb, attributes[name]));
      }
      for (std::size_t i = 0; i < indices.size(); i += 3) {
        std::array<std::size_t, 3> triangle{};
        for (std::size_t k = 0; k < 3; ++k) triangle[k] = static_cast<std::size_t>(indices[i + k][0]);
        const auto position = [&](std::size_t vertex) { return positions[vertex]; };
        if (from_least) std::ranges::rotate(triangle, std::ranges::min_element(triangle, {}, position));
        for (const std::size_t vertex : triangle) {
          corners.positions.emplace_back(matrix * glm::dvec4(xyz(positions[vertex]), 1.0));
          corners.normals.push_back(glm::normalize(normal_matrix * xyz(normals[vertex])));
          for (const auto& other : others) corners.others.push_back(other[vertex]);
        }
      }
    }
  }
  return corners;
}

double farthest(const std::vector<DVec3>& a, const std::vector<DVec3>& b) {
  EXPECT_EQ(a.size(), b.size());
  double most = 0.0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) most = std::max(most, glm::length(a[i] - b[i]));
  return most;
}

ParsedGlb glb_of(const SceneMeshes& meshes, const MeshFileOptions& options) {
  const auto bytes = write_mesh(meshes, FileFormat::Glb, options);
  EXPECT_TRUE(bytes.has_value()) << to_string(bytes.error());
  return bytes ? parse_glb(*bytes) : ParsedGlb{};
}

/// Expects the min and max of positions to equal those of the stored numbers.
void expect_exact_bounds(const ParsedGlb& glb) {
  for (const Json& mesh : glb.document["meshes"]) {
    for (const Json& primitive : mesh["primitives"]) {
      const std::size_t accessor = primitive["attributes"]["POSITION"];
      DVec3 least(1e9);
      DVec3 most(-1e9);
      for (const auto& element : elements(glb, accessor)) {
        least = glm::min(least, xyz(element));
        most = glm::max(most, xyz(element));
      }
      const Json& entry = glb.document["accessors"][accessor];
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(entry["min"][static_cast<std::size_t>(axis)].get<double>(), least[axis]);
        EXPECT_EQ(entry["max"][static_cast<std::size_t>(axis)].get<double>(), most[axis]);
      }
    }
  }
}

int component_of(const ParsedGlb& glb, const char* attribute) {
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  return glb.document["accessors"][primitive["attributes"][attribute].get<std::size_t>()]["componentType"];
}

/// The asymmetric grid: unchanged, turned and mirrored, scaled, and below a group.
class GltfCompression : public Gltf {
 protected:
  GltfCompression() {
    const GridHandle grid = add_asymmetric_grid(scene_, "crane");
    place(scene_, grid, {0, 0, 0});
    Instance turned;
    turned.grid = grid;
    turned.position = {10.25, -3, 7};
    turned.rotation = glm::angleAxis(0.7, glm::normalize(DVec3(1, 2, 3)));
    turned.mirrored = true;
    turned.voxel_size = 0.25;
    scene_.add_instance(turned);
  }

  [[nodiscard]] SceneMeshes meshes() const { return *mesh_scene(scene_); }

  static void expect_same(const Corners& a, const Corners& b, double position, double normal, double other) {
    EXPECT_LE(farthest(a.positions, b.positions), position);
    EXPECT_LE(farthest(a.normals, b.normals), normal);
    ASSERT_EQ(a.others.size(), b.others.size());
    for (std::size_t i = 0; i < b.others.size(); ++i) {
      for (std::size_t k = 0; k < 4; ++k) ASSERT_NEAR(a.others[i][k], b.others[i][k], other);
    }
  }

  /// Expects files with either option, and with both, to differ from floats by at most `error`.
  static void expect_alike(const SceneMeshes& meshes, double error) {
    const Corners plain = corners_of(glb_of(meshes, {}));
    ASSERT_FALSE(plain.positions.empty());
    for (const bool quantize : {false, true}) {
      for (const bool compress : {false, true}) {
        if (compress && !can_compress_gltf()) continue;
        MeshFileOptions options;
        options.quantize = quantize;
        options.compress = compress;
        const ParsedGlb glb = glb_of(meshes, options);
        expect_exact_bounds(glb);
        if (compress) {
          options.compress = false;
          expect_same(corners_of(glb, true), corners_of(glb_of(meshes, options), true), 0.0, 0.0, 0.0);
        } else {
          expect_same(corners_of(glb), plain, quantize ? error : 0.0, 1e-4, 1.0 / 65535.0);
        }
        EXPECT_EQ(glb.document.contains("extensionsRequired"), quantize || compress);
      }
    }
  }
};

TEST_F(GltfCompression, KeepsBlockPositions) {
  expect_alike(meshes(), 1e-12);
}

TEST_F(GltfCompression, StoresBlocksAsBytesAroundPivot) {
  MeshFileOptions options;
  options.quantize = true;
  const ParsedGlb glb = glb_of(meshes(), options);
  EXPECT_EQ(component_of(glb, "POSITION"), 5120);
  EXPECT_EQ(component_of(glb, "NORMAL"), 5120);
  EXPECT_EQ(component_of(glb, "TEXCOORD_0"), 5123);
  EXPECT_EQ(glb.document["extensionsRequired"], Json::array({"KHR_mesh_quantization"}));
}

TEST_F(GltfCompression, KeepsTexelsOfTypes) {
  for (int i = 0; i < 700; ++i) add_type(scene_, "spare" + std::to_string(i), {1, 2, 3, 255});
  const VoxelType last = add_type(scene_, "last", {9, 8, 7, 255});
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, last);
  place(scene_, scene_.add_grid(std::move(grid)), {0, 9, 0});
  MeshFileOptions options;
  options.quantize = true;
  const ParsedGlb glb = glb_of(meshes(), options);
  const PngImage palette = glb.image(0);
  const auto& primitive = glb.document["meshes"].back()["primitives"][0];
  for (const auto& uv : elements(glb, primitive["attributes"]["TEXCOORD_0"])) {
    const auto x = static_cast<std::size_t>(uv[0] * palette.width);
    const auto y = static_cast<std::size_t>(uv[1] * palette.height);
    EXPECT_EQ(palette.pixels[(y * palette.width + x) * 4], 9);
  }
}

TEST_F(GltfCompression, KeepsPositionsFarFromPivot) {
  SceneGrid grid;
  grid.grid.fill_box({{900'000, 0, -5}, {900'040, 300, 2}}, VoxelType{1});
  grid.pivot = {0.5, 0.0, 0.25};
  place(scene_, scene_.add_grid(std::move(grid)), {-900'000, 0, 0});
  expect_alike(meshes(), 1e-9);
}

TEST_F(GltfCompression, StoresFloatsBeyondIntegerRange) {
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, VoxelType{1});
  grid.grid.set({70'000, 0, 0}, VoxelType{2});
  Scene wide;
  wide.types = scene_.types;
  place(wide, wide.add_grid(std::move(grid)), {0, 0, 0});
  const auto meshes = mesh_scene(wide);
  ASSERT_TRUE(meshes.has_value());
  expect_alike(*meshes, 0.0);
  MeshFileOptions options;
  options.quantize = true;
  EXPECT_EQ(component_of(glb_of(*meshes, options), "POSITION"), 5126);
}

TEST_F(GltfCompression, KeepsPositionsOfShearedBlocks) {
  SceneMeshes sheared = meshes();
  glm::dmat4 matrix(1.0);
  matrix[1][0] = 0.3;
  sheared.placements[0].world_from_part = matrix;
  expect_alike(sheared, 1e-12);
}

TEST_F(GltfCompression, StoresOcclusionAttribute) {
  SceneMeshes all = meshes();
  MeshFileOptions options;
  options.occlusion_in = OcclusionIn::Attribute;
  const Corners plain = corners_of(glb_of(all, options));
  options.quantize = true;
  options.compress = can_compress_gltf();
  EXPECT_EQ(corners_of(glb_of(all, options)).others.size(), plain.others.size());
}

TEST_F(GltfCompression, BoundsErrorOfSmoothMeshes) {
  for (const double pivot : {0.0, 4.5, 1000.0}) {
    SceneMeshes smooth;
    smooth.parts.push_back(mesh_part("body", test_mesh(), DVec3(pivot)));
    smooth.placements.push_back({0, "", Similarity{{1, 2, 3}, {0.5, 0.5, 0.5, 0.5}, 2.0, true}});
    // At most 6 across on either side of the pivot, twice as large in the world, with half a step of error per axis.
    expect_alike(smooth, 2.0 * 6.0 / 65'534.0 * std::sqrt(3.0));
  }
}

TEST_F(GltfCompression, ShrinksFiles) {
  if (!can_compress_gltf()) GTEST_SKIP() << "this build has no meshoptimizer";
  SceneGrid hill;
  for (int x = 0; x < 60; ++x) {
    for (int z = 0; z < 60; ++z) {
      const int top = static_cast<int>(8 + 5 * std::sin(x * 0.2) + 4 * std::cos(z * 0.17));
      hill.grid.fill_box({{x, 0, z}, {x + 1, top, z + 1}}, VoxelType{1});
    }
  }
  place(scene_, scene_.add_grid(std::move(hill)), {});
  MeshFileOptions options;
  const auto plain = write_mesh(meshes(), FileFormat::Glb, options);
  options.compress = options.quantize = true;
  const auto small = write_mesh(meshes(), FileFormat::Glb, options);
  ASSERT_TRUE(plain && small);
  EXPECT_LT(small->size() * 5, plain->size());
  EXPECT_EQ(*write_mesh(meshes(), FileFormat::Glb, options), *small) << "the same bytes on every run";
}

TEST_F(GltfCompression, StoresCompressedDataInBinFile) {
  if (!can_compress_gltf()) GTEST_SKIP() << "this build has no meshoptimizer";
  MeshFileOptions options;
  options.compress = true;
  const auto path = folder_.file("out.gltf");
  ASSERT_TRUE(write_mesh(meshes(), path, options).has_value());
  const auto text = read_file(path);
  const auto binary = read_file(folder_.file("out.bin"));
  ASSERT_TRUE(text && binary);
  const auto* first = reinterpret_cast<const char*>(text->data());
  const Json document = Json::parse(first, first + text->size());
  EXPECT_EQ(document["buffers"][0]["byteLength"], binary->size());
  EXPECT_EQ(document["buffers"][0]["uri"], "out.bin");
  EXPECT_FALSE(document["buffers"][1].contains("uri"));
  EXPECT_EQ(corners_of({document, *binary}, true).positions, corners_of(glb_of(meshes(), {}), true).positions);
}

TEST_F(GltfCompression, RefusesOtherFormats) {
  for (const auto format : {FileFormat::Obj, FileFormat::Ply}) {
    MeshFileOptions options;
    options.compress = true;
    EXPECT_EQ(write_mesh(meshes(), format, options).error().code, ErrorCode::Unsupported);
    options = {};
    options.quantize = true;
    EXPECT_EQ(write_mesh(meshes(), format, options).error().code, ErrorCode::Unsupported);
  }
}

TEST_F(GltfCompression, WritesNoBuffersForEmptyMeshes) {
  MeshFileOptions options;
  options.quantize = options.compress = can_compress_gltf();
  const ParsedGlb glb = glb_of({}, options);
  EXPECT_FALSE(glb.document.contains("extensionsRequired"));
  EXPECT_FALSE(glb.document.contains("buffers"));
}

}  // namespace

}  // namespace quoin

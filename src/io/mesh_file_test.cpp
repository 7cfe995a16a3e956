#include <quoin/io/mesh_file.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <quoin/mesh/array_surface.h>
#include <quoin/mesh/label_surfaces.h>

#include "core/death_for_tests.h"
#include "core/srgb.h"
#include "io/gltf/gltf_for_tests.h"
#include "io/gltf/gltf_layout.h"
#include "io/mesh_file_for_tests.h"

namespace quoin {

namespace {

struct Format {
  const char* extension;
  FileFormat format;
  std::function<WorldMesh(const std::vector<std::byte>&)> read;
  bool linear;  /// colours are linear light rather than sRGB
};

const std::array kFormats = {
    Format{".glb", FileFormat::Glb, [](const auto& bytes) { return world_of(parse_glb(bytes)); }, true},
    Format{".ply", FileFormat::Ply, world_of_ply, false}, Format{".obj", FileFormat::Obj, world_of_obj, false}};

/// A part whose arrays a test may corrupt.
struct TestPart {
  std::string name;
  SmoothMesh mesh;
  DVec3 pivot{0.0};
  std::vector<std::pair<std::string, glm::dmat4>> placements;
};

SceneMeshes meshes_of(const std::vector<TestPart>& parts) {
  SceneMeshes meshes;
  for (const TestPart& part : parts) {
    for (const auto& [name, matrix] : part.placements) meshes.placements.push_back({meshes.parts.size(), name, matrix});
    meshes.parts.push_back({part.name, {view_of(part.mesh)}, part.pivot});
  }
  return meshes;
}

class SmoothMeshFiles : public ::testing::Test {
 protected:
  /// Writes with `format` and reads the result.
  WorldMesh write(const Format& format, const MeshFileOptions& options = {}) {
    const auto path = folder_.file(std::string("out") + format.extension);
    const SceneMeshes meshes = meshes_of(parts_);
    const auto bytes = write_mesh(meshes, path, options);
    EXPECT_TRUE(bytes.has_value()) << to_string(bytes.error());
    const auto file = read_file(path);
    EXPECT_TRUE(file && bytes && file->size() == *bytes);
    EXPECT_EQ(write_mesh(meshes, format.format, options).value(), file.value()) << "the same in memory";
    return file ? format.read(*file) : WorldMesh{};
  }

  ParsedGlb write_glb_file() {
    write(kFormats[0]);
    return parse_glb(read_file(folder_.file("out.glb")).value());
  }

  void place(const glm::dmat4& matrix, const std::string& name = "") {
    parts_[0].placements.emplace_back(name, matrix);
  }

  /// Every file must match the product of the matrices and the mesh, computed by plain arithmetic.
  void expect_all_formats_agree(bool sheared = false) {
    for (const Format& format : kFormats) {
      const WorldMesh world = write(format);
      std::size_t vertex = 0;
      double volume = 0.0;
      for (const TestPart& part : parts_) {
        for (const auto& [name, matrix] : part.placements) {
          expect_placed(world, part, matrix, vertex, format.extension);
          vertex += part.mesh.positions.size();
          volume += std::abs(glm::determinant(glm::dmat3(matrix))) * 12.0;
        }
      }
      EXPECT_EQ(world.positions.size(), vertex) << format.extension;
      // A shear may turn a vertex's normal far from those of its triangles.
      EXPECT_TRUE(sheared || world.inward_normals() == 0) << format.extension;
      EXPECT_NEAR(world.volume(), volume, 1e-4 * volume) << format.extension;
    }
  }

  static void expect_placed(const WorldMesh& world, const TestPart& part, const glm::dmat4& matrix, std::size_t first,
                            const char* extension) {
    ASSERT_GE(world.positions.size(), first + part.mesh.positions.size());
    const double scale = glm::length(DVec3(matrix[0])) * 5.0 + glm::length(DVec3(matrix[3]));
    const glm::dmat3 inverse_transpose = glm::transpose(glm::inverse(glm::dmat3(matrix)));
    for (std::size_t i = 0; i < part.mesh.positions.size(); ++i) {
      const DVec3 expected(matrix * glm::dvec4(DVec3(part.mesh.positions[i]) - part.pivot, 1.0));
      EXPECT_LT(glm::length(world.positions[first + i] - expected), 1e-6 * scale) << extension << " vertex " << i;
      const DVec3 normal = glm::normalize(inverse_transpose * DVec3(part.mesh.normals[i]));
      EXPECT_LT(glm::length(world.normals[first + i] - normal), 1e-5) << extension << " vertex " << i;
    }
  }

  std::vector<TestPart> parts_{{"thing", test_mesh(), {}, {}}};
  TestFolder folder_{std::string("mesh_files_") + ::testing::UnitTest::GetInstance()->current_test_info()->name()};
};

glm::dmat4 random_placement(std::mt19937& random, bool mirrored) {
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  glm::dmat4 matrix = glm::translate(glm::dmat4(1.0), 50.0 * DVec3(any(random), any(random), any(random)));
  matrix *= glm::mat4_cast(glm::normalize(DQuat(any(random), any(random), any(random), any(random))));
  const double scale = std::exp(3.0 * any(random));
  return glm::scale(matrix, DVec3(mirrored ? -scale : scale, scale, scale));
}

TEST_F(SmoothMeshFiles, PlacesVerticesInEveryFormat) {
  const std::uint32_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  parts_[0].pivot = {1.5, -2.0, 0.25};
  for (int i = 0; i < 20; ++i) place(random_placement(random, i % 3 == 0));
  parts_.push_back({"other", test_mesh(), {}, {{"", random_placement(random, true)}}});
  expect_all_formats_agree();
}

TEST_F(SmoothMeshFiles, KeepsNormalsUnderShearAndUnevenScale) {
  glm::dmat4 sheared(1.0);
  sheared[1].x = 0.7;
  place(sheared);
  place(sheared);
  place(glm::scale(sheared, DVec3(-1, 1, 1)));
  place(glm::scale(glm::dmat4(1.0), DVec3(0.5, 2.0, 3.0)));
  expect_all_formats_agree(true);
  const ParsedGlb glb = write_glb_file();
  EXPECT_EQ(glb.document["meshes"].size(), 3U) << "the two sheared ones that are alike share one";
  EXPECT_FALSE(glb.document["nodes"][0].contains("scale"));
  EXPECT_EQ(glb.document["nodes"][3]["scale"], nlohmann::json({0.5, 2.0, 3.0}));
}

TEST_F(SmoothMeshFiles, AcceptsTinyUnits) {
  place(glm::scale(glm::dmat4(1.0), DVec3(1e-6)));
  place(glm::scale(glm::dmat4(1.0), DVec3(-1e-9, 1e-9, 1e-9)));
  expect_all_formats_agree();
}

TEST_F(SmoothMeshFiles, SharesOneMeshPerHandedness) {
  place(glm::dmat4(1.0), "first");
  place(glm::translate(glm::dmat4(1.0), DVec3(0, 9, 0)));
  place(glm::scale(glm::dmat4(1.0), DVec3(-1, 1, 1)));
  place(glm::scale(glm::dmat4(1.0), DVec3(1, 1, -1)));
  const ParsedGlb glb = write_glb_file();
  ASSERT_EQ(glb.document["nodes"].size(), 4U);
  EXPECT_EQ(glb.document["meshes"].size(), 2U);
  const auto& nodes = glb.document["nodes"];
  EXPECT_EQ(nodes[0], nlohmann::json({{"name", "first"}, {"mesh", 0}})) << "only required keys";
  EXPECT_EQ(nodes[1], nlohmann::json({{"name", "thing"}, {"mesh", 0}, {"translation", {0.0, 9.0, 0.0}}}));
  EXPECT_EQ(nodes[2]["mesh"], 1);
  EXPECT_EQ(nodes[3]["mesh"], 1);
  expect_all_formats_agree();
}

TEST_F(SmoothMeshFiles, MultipliesAlbedoByOcclusion) {
  place(glm::dmat4(1.0));
  const SmoothMesh& mesh = parts_[0].mesh;
  for (const Format& format : kFormats) {
    for (const bool occlusion : {true, false}) {
      const WorldMesh world = write(format, {.write_occlusion = occlusion});
      ASSERT_EQ(world.colours.size(), mesh.positions.size());
      for (std::size_t i = 0; i < world.colours.size(); ++i) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
          const double light = mesh.albedo[i][channel] / 65535.0 * (occlusion ? 1.0F - mesh.occlusion[i] : 1.0F);
          const double stored = world.colours[i][channel];
          if (format.linear) {
            EXPECT_NEAR(stored, light, 0.5001 / 65535) << i;
          } else {
            const double byte = SrgbEncoder::shared()(static_cast<float>(light));
            EXPECT_NEAR(stored, byte / 255.0, 1e-4) << format.extension << i;
          }
        }
      }
    }
  }
  EXPECT_EQ(write(kFormats[1]).colours[1][1], 188 / 255.0) << "half of the light is 188 in sRGB";
}

TEST_F(SmoothMeshFiles, WritesValidGlb) {
  place(glm::dmat4(1.0));
  const ParsedGlb glb = write_glb_file();
  const auto& primitive = glb.document["meshes"][0]["primitives"][0];
  const auto& position = glb.document["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
  EXPECT_EQ(position["min"], nlohmann::json({-1.0, -1.0, -1.0}));
  EXPECT_EQ(position["max"], nlohmann::json({5.0, 3.0, 2.0}));
  const auto& colour = glb.document["accessors"][primitive["attributes"]["COLOR_0"].get<std::size_t>()];
  EXPECT_EQ(colour["componentType"], 5123);
  EXPECT_EQ(colour["normalized"], true);
  EXPECT_EQ(glb.document["bufferViews"][colour["bufferView"].get<std::size_t>()]["byteLength"].get<int>(), 6 * 8);
  for (const auto& view : glb.document["bufferViews"]) EXPECT_EQ(view["byteOffset"].get<int>() % 4, 0);
  const auto& material = glb.document["materials"][0];
  EXPECT_EQ(material["pbrMetallicRoughness"]["metallicFactor"], 0.0);
  EXPECT_EQ(material["pbrMetallicRoughness"]["roughnessFactor"], 1.0);
  EXPECT_FALSE(material.contains("doubleSided"));
  EXPECT_EQ(glb.binary.size() % 4, 0U);
}

TEST_F(SmoothMeshFiles, Uses16BitIndicesBelowRestartValue) {
  for (const std::size_t vertices : {65'534U, 65'535U, 65'536U}) {
    SmoothMesh mesh = test_mesh();
    mesh.positions.resize(vertices, Vec3(0.0F));
    mesh.normals.resize(vertices, Vec3(0.0F, 1.0F, 0.0F));
    mesh.albedo.resize(vertices);
    mesh.occlusion.resize(vertices, 0.0F);
    mesh.indices.back() = static_cast<std::uint32_t>(vertices - 1);
    parts_ = {{"large", mesh, {}, {{"", glm::dmat4(1.0)}}}};
    const ParsedGlb glb = write_glb_file();
    const auto& primitive = glb.document["meshes"][0]["primitives"][0];
    const auto& indices = glb.document["accessors"][primitive["indices"].get<std::size_t>()];
    EXPECT_EQ(indices["componentType"], vertices < 65'535 ? 5123 : 5125) << vertices;
    EXPECT_EQ(glb.indices(primitive), mesh.indices);
  }
}

TEST_F(SmoothMeshFiles, GltfWithBinFileMatchesGlb) {
  place(glm::dmat4(1.0));
  const auto path = folder_.file("a b.gltf");
  const SceneMeshes meshes = meshes_of(parts_);
  const auto bytes = write_mesh(meshes, path);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  EXPECT_EQ(mesh_files(meshes, path).value(), (std::vector{path, folder_.file("a b.bin")}));
  const auto refused = write_mesh(meshes, FileFormat::Gltf);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  ParsedGlb glb = write_glb_file();
  nlohmann::json document = nlohmann::json::parse(bytes_as_text(read_file(path).value()));
  EXPECT_EQ(document["buffers"][0]["uri"], "a%20b.bin");
  document["buffers"][0].erase("uri");
  EXPECT_EQ(document, glb.document);
  EXPECT_EQ(read_file(folder_.file("a b.bin")).value(), glb.binary);
}

TEST_F(SmoothMeshFiles, WritesValidEmptyFiles) {
  parts_ = {{"empty", {}, {}, {}}};
  for (const Format& format : kFormats) EXPECT_TRUE(write(format).positions.empty()) << format.extension;
  const ParsedGlb glb = write_glb_file();
  EXPECT_EQ(glb.document["asset"]["version"], "2.0");
  EXPECT_FALSE(glb.document.contains("nodes")) << "glTF forbids empty arrays";
  EXPECT_FALSE(glb.document.contains("meshes"));
  EXPECT_FALSE(glb.document.contains("buffers"));
  const std::string ply = bytes_as_text(read_file(folder_.file("out.ply")).value());
  EXPECT_NE(ply.find("element vertex 0\n"), std::string::npos);
}

TEST_F(SmoothMeshFiles, WritesUniqueObjNames) {
  place(glm::dmat4(1.0), "a b");
  place(glm::dmat4(1.0), "a b");
  place(glm::dmat4(1.0));
  write(kFormats[2]);
  const std::string text = bytes_as_text(read_file(folder_.file("out.obj")).value());
  for (const char* line : {"\no a_b\n", "\no a_b_2\n", "\no thing\n"}) EXPECT_NE(text.find(line), std::string::npos);
}

TEST_F(SmoothMeshFiles, RefusesUnsoundInputWithoutFile) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::pair<std::string, TestPart>> wrong;
  const auto add = [&](const std::string& message, const std::function<void(TestPart&)>& spoil) {
    TestPart part{"thing", test_mesh(), {}, {{"", glm::dmat4(1.0)}}};
    spoil(part);
    wrong.emplace_back(message, part);
  };
  add("a transform that is not finite", [](TestPart& part) { part.placements[0].second[3].x = kNan; });
  add("a transform that is singular", [](TestPart& part) { part.placements[0].second[1] *= 0.0; });
  add("a transform that is singular",
      [](TestPart& part) { part.placements[0].second[1] = part.placements[0].second[0]; });
  add("a transform that is not affine", [](TestPart& part) { part.placements[0].second[1].w = 0.1; });
  add("a vertex too far away for a float", [](TestPart& part) { part.placements[0].second[3].x = 1e39; });
  add("a vertex too far away for a float", [](TestPart& part) { part.placements[0].second[0].x = 2e38; });
  add("a vertex too far away for a float", [](TestPart& part) {
    part.pivot.z = 1e200;
    part.placements[0].second[3].z = 1e200;
  });
  add("a pivot that is not finite", [](TestPart& part) { part.pivot.y = kNan; });
  add("arrays of different lengths", [](TestPart& part) { part.mesh.normals.pop_back(); });
  add("arrays of different lengths", [](TestPart& part) { part.mesh.occlusion.pop_back(); });
  add("an index beyond its vertices", [](TestPart& part) { part.mesh.indices[3] = 6; });
  add("an index count that is not a multiple of 3", [](TestPart& part) { part.mesh.indices.pop_back(); });
  add("a position that is not finite", [](TestPart& part) { part.mesh.positions[2].x = NAN; });
  add("a normal that is not finite", [](TestPart& part) { part.mesh.normals[2].x = INFINITY; });
  add("an occlusion outside 0 to 1", [](TestPart& part) { part.mesh.occlusion[2] = NAN; });
  for (const auto& [message, part] : wrong) {
    for (const Format& format : kFormats) {
      const auto path = folder_.file(std::string("wrong") + format.extension);
      const auto refused = write_mesh(meshes_of({part}), path);
      ASSERT_FALSE(refused) << message;
      EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
      EXPECT_EQ(refused.error().path, path.string());
      EXPECT_EQ(refused.error().message, "part \"thing\" has " + message);
      EXPECT_FALSE(std::filesystem::exists(path));
    }
  }
}

TEST_F(SmoothMeshFiles, CancellingKeepsOldFile) {
  place(glm::dmat4(1.0));
  for (const Format& format : kFormats) {
    const auto path = folder_.file(std::string("old") + format.extension);
    ASSERT_TRUE(write_file(std::as_bytes(std::span("old", 3)), path));
    const auto refused = write_mesh(meshes_of(parts_), path, {}, [](double) { return false; });
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Cancelled);
    EXPECT_EQ(bytes_as_text(read_file(path).value()), "old");
  }
  EXPECT_EQ(folder_.count(), kFormats.size());
}

TEST_F(SmoothMeshFiles, ReportsMissingFolder) {
  place(glm::dmat4(1.0));
  for (const Format& format : kFormats) {
    const auto refused = write_mesh(meshes_of(parts_), folder_.file(std::string("none/out") + format.extension));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::CannotWrite);
  }
}

TEST_F(SmoothMeshFiles, WritesEmptyPartAsNodeWithoutMesh) {
  parts_ = {{"empty", {}, {}, {{"here", glm::translate(glm::dmat4(1.0), DVec3(1, 2, 3))}}}};
  for (const Format& format : kFormats) {
    if (format.format == FileFormat::Glb) continue;
    EXPECT_TRUE(write(format).positions.empty()) << format.extension;
  }
  ASSERT_TRUE(write_mesh(meshes_of(parts_), folder_.file("out.glb")));
  const ParsedGlb glb = parse_glb(read_file(folder_.file("out.glb")).value());
  EXPECT_EQ(glb.document["nodes"][0]["name"], "here");
  EXPECT_FALSE(glb.document["nodes"][0].contains("mesh"));
}

/// Writes blocks and a smooth mesh in one file.
TEST(MeshFiles, CombinesBlocksAndSmoothMeshes) {
  Scene scene;
  place(scene, add_asymmetric_grid(scene, "L"), {});
  SceneMeshes meshes = mesh_scene(scene).value();
  meshes.parts.push_back(mesh_part("smooth", test_mesh()));
  meshes.placements.push_back({1, "", Similarity{.position = {50, 0, 0}}});
  const auto blocks = static_cast<std::size_t>(meshes.stats.vertices);
  const WorldMesh ply = world_of_ply(write_mesh(meshes, FileFormat::Ply).value());
  EXPECT_EQ(ply.positions.size(), blocks + 6);
  EXPECT_EQ(ply.inward_normals(), 0U);
  const ParsedGlb glb = parse_glb(write_mesh(meshes, FileFormat::Glb).value());
  ASSERT_EQ(glb.document["materials"].size(), 2U);
  EXPECT_EQ(glb.document["materials"][1]["name"], "smooth");
  EXPECT_TRUE(glb.document["meshes"][0]["primitives"][0]["attributes"].contains("TEXCOORD_0"));
  const auto& smooth = glb.document["meshes"][1]["primitives"][0];
  EXPECT_EQ(smooth["material"], 1);
  EXPECT_FALSE(smooth["attributes"].contains("TEXCOORD_0"));
  const TestFolder folder("mixed_mesh_file");
  EXPECT_TRUE(write_mesh(meshes, folder.file("out.obj")));
  EXPECT_EQ(folder.count(), 3U) << "palette and materials of the blocks";
}

TEST(MeshFiles, HoldsArrayAndLabelSurfaces) {
  // Two balls that touch, in an array of labels.
  constexpr int kEdge = 16;
  std::vector<std::uint8_t> labels(std::size_t{kEdge} * kEdge * kEdge);
  for (int i = 0; i < kEdge * kEdge * kEdge; ++i) {
    const DVec3 at(i % kEdge, i / kEdge % kEdge, i / kEdge / kEdge);
    if (glm::distance(at, DVec3(7, 7, 4)) < 3.6) labels[static_cast<std::size_t>(i)] = 1;
    if (glm::distance(at, DVec3(7, 7, 11)) < 3.6) labels[static_cast<std::size_t>(i)] = 2;
  }
  ArrayView array{labels.data(), ScalarType::UInt8, {kEdge, kEdge, kEdge}};
  array.strides = strides_of_first_fastest(array.size, array.type);
  ArraySurface all = surface_from_array(array, {.iso = 0.5}).value();
  const auto by_label = surfaces_from_labels(array).value();
  SceneMeshes meshes;
  const std::array<std::size_t, 3> vertices = {all.positions.size(), surface_of_label(by_label, 1).positions.size(),
                                               surface_of_label(by_label, 2).positions.size()};
  meshes.parts.push_back(mesh_part("both", std::move(all), {255, 0, 0}));
  for (const std::int64_t label : labels_of(by_label)) {
    meshes.parts.push_back(mesh_part("ball", surface_of_label(by_label, label), {0, 0, 255}, DVec3(7)));
  }
  meshes.parts.push_back(mesh_part("nothing", ArraySurface(), {}));
  ASSERT_EQ(meshes.parts.size(), 4U);
  EXPECT_TRUE(meshes.parts[3].surfaces.empty());
  for (std::size_t part = 0; part < 3; ++part) meshes.placements.push_back({part, ""});
  const WorldMesh ply = world_of_ply(write_mesh(meshes, FileFormat::Ply).value());
  EXPECT_EQ(ply.positions.size(), vertices[0] + vertices[1] + vertices[2]);
  EXPECT_EQ(ply.inward_normals(), 0U);
  const ParsedGlb glb = parse_glb(write_mesh(meshes, FileFormat::Glb).value());
  ASSERT_EQ(glb.document["meshes"].size(), 3U);
  const auto colours = [&](std::size_t mesh) {
    return glb.array<std::array<std::uint16_t, 4>>(
        glb.document["meshes"][mesh]["primitives"][0]["attributes"]["COLOR_0"]);
  };
  using Colour = std::array<std::uint16_t, 4>;
  EXPECT_EQ(colours(0), std::vector<Colour>(vertices[0], Colour{65'535, 0, 0, 65'535}));
  EXPECT_EQ(colours(2), std::vector<Colour>(vertices[2], Colour{0, 0, 65'535, 65'535}));
}

/// The floats of a PLY file's vertices after their 27 bytes of position, normal and colour.
std::vector<float> ply_occlusion(const std::vector<std::byte>& bytes, std::size_t vertices) {
  const std::string text = bytes_as_text(bytes);
  const std::string end = "property uchar blue\nproperty float ao\nelement face";
  EXPECT_NE(text.find(end), std::string::npos);
  const std::size_t data = text.find("end_header\n") + 11;
  std::vector<float> found(vertices);
  for (std::size_t i = 0; i < vertices && data + 31 * (i + 1) <= text.size(); ++i) {
    std::memcpy(&found[i], text.data() + data + 31 * i + 27, 4);
  }
  return found;
}

TEST(MeshFiles, WritesOcclusionAttributeOnRequest) {
  Scene scene;
  const VoxelType grey = add_type(scene, "grey", {120, 120, 120, 255});
  SceneGrid grid;
  grid.grid.fill_box({{0, 0, 0}, {3, 1, 3}}, grey);
  grid.grid.set({1, 1, 1}, grey);
  place(scene, scene.add_grid(std::move(grid)), {});
  auto meshes = mesh_scene(scene);
  ASSERT_TRUE(meshes);
  meshes->parts.push_back(mesh_part("smooth", test_mesh()));
  meshes->placements.push_back({1, "smooth", {}});
  const MeshView& blocks = meshes->parts[0].surfaces[0];
  const MeshView& smooth = meshes->parts[1].surfaces[0];
  std::vector<float> of_blocks;
  for (const std::uint8_t occlusion : blocks.block_occlusion) of_blocks.push_back(1.0F - 0.25F * occlusion);
  std::vector<float> of_smooth;
  for (const float occlusion : smooth.occlusion) of_smooth.push_back(1.0F - occlusion);
  ASSERT_LT(*std::ranges::min_element(of_blocks), 1.0F);

  MeshFileOptions options;
  options.occlusion_in = OcclusionIn::Attribute;
  const auto bytes = write_mesh(*meshes, FileFormat::Glb, options);
  ASSERT_TRUE(bytes);
  const ParsedGlb glb = parse_glb(*bytes);
  const auto attributes = [&](std::size_t mesh) { return glb.document["meshes"][mesh]["primitives"][0]["attributes"]; };
  EXPECT_FALSE(attributes(0).contains("COLOR_0"));
  EXPECT_EQ(glb.array<float>(attributes(0)["_AO"]), of_blocks);
  EXPECT_EQ(glb.array<float>(attributes(1)["_AO"]), of_smooth);
  const auto& accessor = glb.document["accessors"][attributes(1)["_AO"].get<std::size_t>()];
  EXPECT_EQ(accessor["type"], "SCALAR");
  EXPECT_EQ(accessor["componentType"], 5126);
  const auto colours = glb.array<LinearRgba16>(attributes(1)["COLOR_0"]);
  EXPECT_TRUE(std::ranges::equal(colours, smooth.albedo));

  const auto ply = write_mesh(*meshes, FileFormat::Ply, options);
  ASSERT_TRUE(ply);
  std::vector<float> both = of_blocks;
  both.insert(both.end(), of_smooth.begin(), of_smooth.end());
  EXPECT_EQ(ply_occlusion(*ply, both.size()), both);

  const auto obj = write_mesh(*meshes, FileFormat::Obj, options);
  ASSERT_FALSE(obj);
  EXPECT_EQ(obj.error().code, ErrorCode::Unsupported);

  // Without occlusion glTF has no such attribute; in PLY, which has one vertex layout for all parts, it is 1.
  options.write_occlusion = false;
  const ParsedGlb plain = parse_glb(*write_mesh(*meshes, FileFormat::Glb, options));
  EXPECT_FALSE(plain.document["meshes"][1]["primitives"][0]["attributes"].contains("_AO"));
  EXPECT_EQ(ply_occlusion(*write_mesh(*meshes, FileFormat::Ply, options), both.size()),
            std::vector<float>(both.size(), 1.0F));
}

TEST(MeshFiles, RefusesInconsistentBlocks) {
  Scene scene;
  const GridHandle grid = add_asymmetric_grid(scene, "L");
  const TestFolder folder("blocky_unsound");
  const BlockyMesh sound = build_blocky_mesh(scene.grids()[grid].grid, scene.types, {}).value();
  const auto refuses = [&](const std::function<void(BlockyTriangles&)>& spoil) {
    SceneMeshes meshes;
    meshes.types = scene.types;
    BlockyMesh mesh = sound;
    spoil(mesh.surfaces[0]);
    meshes.parts.push_back(mesh_part("L", std::move(mesh)));
    meshes.placements.emplace_back();
    for (const char* name : {"out.glb", "out.gltf", "out.obj", "out.ply"}) {
      const auto written = write_mesh(meshes, folder.file(name));
      if (written || written.error().code != ErrorCode::InvalidArgument) return false;
    }
    return folder.count() == 0;
  };
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.directions.pop_back(); }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.directions[0] = static_cast<Direction>(6); }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.types[0] = 60'000; }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.occlusion[0] = 4; }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.indices.pop_back(); }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.indices[0] = static_cast<std::uint32_t>(t.positions.size()); }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.positions[0].y = std::numeric_limits<float>::infinity(); }));
}

TEST(MeshFiles, RefusesUnregisteredTypes) {
  for (const VoxelType type : std::array<VoxelType, 5>{3, 255, 256, 300, 65535}) {
    Scene scene;
    const GridHandle grid = add_asymmetric_grid(scene, "L");
    place(scene, grid, {});
    scene.edit(grid).grid.set({1, 7, 0}, type);
    const auto refused = write_mesh(mesh_scene(scene).value(), FileFormat::Glb);
    ASSERT_FALSE(refused) << type;
    EXPECT_EQ(refused.error().message, "part \"L\" has an unregistered type");
  }
}

TEST(MeshFiles, RefusesPlacementOfMissingPart) {
  SceneMeshes meshes;
  meshes.placements.push_back({1, "lost", Similarity{}});
  const auto refused = write_mesh(meshes, FileFormat::Ply);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "placement \"lost\" has a part that does not exist");
}

TEST(MeshFiles, SelectsFormatByOptionOrPath) {
  const TestFolder folder("mesh_file_format");
  EXPECT_TRUE(write_mesh({}, folder.file("image"), {.format = FileFormat::Ply}));
  for (const char* name : {"out.png", "out.vox", "out"}) {
    const auto refused = write_mesh({}, folder.file(name));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_EQ(refused.error().path, folder.file(name).string());
    EXPECT_FALSE(mesh_files({}, folder.file(name)));
  }
  EXPECT_EQ(folder.count(), 1U);
}

TEST(MeshFiles, RefusesUnknownFormat) {
  const TestFolder folder("mesh_file_unknown_format");
  const FileFormat mistyped("glbb");
  const auto path = folder.file("out.glb");
  const auto file = write_mesh({}, path, {.format = mistyped});
  const auto bytes = write_mesh({}, mistyped);
  const auto files = mesh_files({}, path, {.format = mistyped});
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(to_string(file.error()), path.string() + ": cannot write meshes: no format is named \"glbb\"");
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().code, ErrorCode::InvalidArgument);
  ASSERT_FALSE(files);
  EXPECT_EQ(files.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(mesh_file_offset({}, mistyped), DVec3(0.0));
  EXPECT_EQ(folder.count(), 0U);
}

/// Positive inside; samples of a ball.
Volume ball(IVec3 size, DVec3 centre, double radius) {
  Volume volume;
  volume.size = size;
  for (int i = 0; i < size.x * size.y * size.z; ++i) {
    const DVec3 p(i % size.x, i / size.x % size.y, i / (size.x * size.y));
    volume.values.push_back(static_cast<float>(radius - glm::length(p - centre)));
  }
  volume.min = *std::ranges::min_element(volume.values);
  volume.max = *std::ranges::max_element(volume.values);
  return volume;
}

TEST(MeshFiles, MeshesBallWhereVolumePlacesIt) {
  for (const double x_axis : {2.0, -2.0}) {
    Volume volume = ball({70, 30, 28}, {40, 15, 13}, 10);
    volume.world_from_voxel = glm::dmat4{{x_axis, 0, 0, 0}, {0, 0, 3, 0}, {0, 1, 0, 0}, {100, 50, 20, 1}};
    const auto meshes = mesh_volume(volume);
    ASSERT_TRUE(meshes) << to_string(meshes.error());
    EXPECT_NEAR(static_cast<double>(meshes->stats.solid_samples), 4189.0, 150.0);
    const WorldMesh world = world_of_ply(write_mesh(*meshes, FileFormat::Ply).value());
    EXPECT_NEAR(world.volume(), 6.0 * 4189.0, 6.0 * 80.0) << "outside is outside, mirrored or not";
    for (const DVec3& p : world.positions) {
      const DVec3 in_voxels((p.x - 100) / x_axis, (p.z - 20) / 3, p.y - 50);
      EXPECT_NEAR(glm::length(in_voxels - DVec3(40, 15, 13)), 10.0, 0.06);
    }
  }
}

TEST(UniqueNames, TakesTheFirstFreeNumber) {
  const std::array<std::string, 5> bases = {"a", "a 2", "a 3", "", "b 2 2"};
  std::mt19937 random(1);
  UniqueNames names;
  std::set<std::string> taken;
  for (int i = 0; i < 2'000; ++i) {
    const std::string& name = bases[random() % bases.size()];
    std::string expected = name;
    for (int n = 2; !taken.insert(expected).second; ++n) expected = name + " " + std::to_string(n);
    ASSERT_EQ(names.add(name, " "), expected);
  }
}

TEST(UniqueNames, NumberManyEqualNames) {
  UniqueNames names;
  std::string last;
  for (int i = 0; i < 300'000; ++i) last = names.add("stone", "_");
  EXPECT_EQ(last, "stone_300000");
}

TEST(MeshFileDeathTest, AssertsOnSingularTransforms) {
  QUOIN_EXPECT_MISTAKE((void)VertexTransform(glm::dmat4(0.0), DVec3(0.0)), "not singular");
}

TEST(MeshFileDeathTest, AssertsOnUnsoundMeshes) {
  SceneMeshes meshes;
  meshes.placements.emplace_back();
  QUOIN_EXPECT_MISTAKE((void)lay_out_gltf(meshes), "sound meshes");
}

TEST(MeshFileDeathTest, AssertsOnTypesWithoutTriangles) {
  const SceneMeshes meshes;
  const MaterialPalette palette(meshes);
  QUOIN_EXPECT_MISTAKE((void)palette.material_of(SurfaceClass::Opaque, 0), "that the meshes have");
}

}  // namespace

}  // namespace quoin

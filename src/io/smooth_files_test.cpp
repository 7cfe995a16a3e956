#include <quoin/io/smooth_files.h>

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/srgb.h"
#include "io/smooth_files_fixture.h"

namespace quoin {

namespace {

using Writer = Result<std::uint64_t> (*)(std::span<const SmoothPart>, const std::filesystem::path&,
                                         const SmoothFileOptions&, const Progress&);

struct Format {
  const char* ending;
  Writer write;
  std::function<WorldMesh(const std::vector<std::byte>&)> read;
  bool linear;  ///< its colours are linear light rather than sRGB
};

const std::array kFormats = {
    Format{".glb", write_smooth_glb, [](const auto& bytes) { return world_of(parse_glb(bytes)); }, true},
    Format{".ply", write_ply, world_of_ply, false}, Format{".obj", write_smooth_obj, world_of_obj, false}};

class SmoothFiles : public ::testing::Test {
 protected:
  /// Writes with `format` and reads again.
  WorldMesh write(const Format& format, const SmoothFileOptions& options = {}) {
    const auto path = folder_.file(std::string("out") + format.ending);
    const auto bytes = format.write(parts_, path, options, {});
    EXPECT_TRUE(bytes.has_value()) << to_string(bytes.error());
    const auto file = read_file(path);
    EXPECT_TRUE(file && bytes && file->size() == *bytes);
    return file ? format.read(*file) : WorldMesh{};
  }

  ParsedGlb write_glb_file() {
    write(kFormats[0]);
    return parse_glb(read_file(folder_.file("out.glb")).value());
  }

  void place(const glm::dmat4& matrix, const std::string& name = "") { parts_[0].placements.push_back({name, matrix}); }

  /// Every file holds what the matrices and the mesh say, by plain arithmetic.
  void expect_all_formats_agree(bool sheared = false) {
    for (const Format& format : kFormats) {
      const WorldMesh world = write(format);
      std::size_t vertex = 0;
      double volume = 0.0;
      for (const SmoothPart& part : parts_) {
        for (const SmoothPlacement& placement : part.placements) {
          expect_placed(world, part, placement.world_from_mesh, vertex, format.ending);
          vertex += part.mesh.positions.size();
          volume += std::abs(glm::determinant(glm::dmat3(placement.world_from_mesh))) * 12.0;
        }
      }
      EXPECT_EQ(world.positions.size(), vertex) << format.ending;
      // A shear may turn a vertex's normal far from those of its triangles.
      EXPECT_TRUE(sheared || world.inward_normals() == 0) << format.ending;
      EXPECT_NEAR(world.volume(), volume, 1e-4 * volume) << format.ending;
    }
  }

  static void expect_placed(const WorldMesh& world, const SmoothPart& part, const glm::dmat4& matrix, std::size_t first,
                            const char* ending) {
    ASSERT_GE(world.positions.size(), first + part.mesh.positions.size());
    const double scale = glm::length(DVec3(matrix[0])) * 5.0 + glm::length(DVec3(matrix[3]));
    const glm::dmat3 inverse_transpose = glm::transpose(glm::inverse(glm::dmat3(matrix)));
    for (std::size_t i = 0; i < part.mesh.positions.size(); ++i) {
      const DVec3 expected(matrix * glm::dvec4(DVec3(part.mesh.positions[i]) - part.pivot, 1.0));
      EXPECT_LT(glm::length(world.positions[first + i] - expected), 1e-6 * scale) << ending << " vertex " << i;
      const DVec3 normal = glm::normalize(inverse_transpose * DVec3(part.mesh.normals[i]));
      EXPECT_LT(glm::length(world.normals[first + i] - normal), 1e-5) << ending << " vertex " << i;
    }
  }

  std::vector<SmoothPart> parts_{{"thing", test_mesh(), {}, {}}};
  TestFolder folder_{std::string("smooth_files_") + ::testing::UnitTest::GetInstance()->current_test_info()->name()};
};

glm::dmat4 random_placement(std::mt19937& random, bool mirrored) {
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  glm::dmat4 matrix = glm::translate(glm::dmat4(1.0), 50.0 * DVec3(any(random), any(random), any(random)));
  matrix *= glm::mat4_cast(glm::normalize(DQuat(any(random), any(random), any(random), any(random))));
  const double scale = std::exp(3.0 * any(random));
  return glm::scale(matrix, DVec3(mirrored ? -scale : scale, scale, scale));
}

TEST_F(SmoothFiles, every_format_puts_vertices_where_the_placement_says) {
  const std::uint32_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  parts_[0].pivot = {1.5, -2.0, 0.25};
  for (int i = 0; i < 20; ++i) place(random_placement(random, i % 3 == 0));
  parts_.push_back({"other", test_mesh(), {}, {{"", random_placement(random, true)}}});
  expect_all_formats_agree();
}

TEST_F(SmoothFiles, shear_and_uneven_scale_keep_normals_and_outside) {
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

TEST_F(SmoothFiles, tiny_units_are_no_reason_to_refuse) {
  place(glm::scale(glm::dmat4(1.0), DVec3(1e-6)));
  place(glm::scale(glm::dmat4(1.0), DVec3(-1e-9, 1e-9, 1e-9)));
  expect_all_formats_agree();
}

TEST_F(SmoothFiles, placements_share_a_mesh_and_mirrored_ones_another) {
  place(glm::dmat4(1.0), "first");
  place(glm::translate(glm::dmat4(1.0), DVec3(0, 9, 0)));
  place(glm::scale(glm::dmat4(1.0), DVec3(-1, 1, 1)));
  place(glm::scale(glm::dmat4(1.0), DVec3(1, 1, -1)));
  const ParsedGlb glb = write_glb_file();
  ASSERT_EQ(glb.document["nodes"].size(), 4U);
  EXPECT_EQ(glb.document["meshes"].size(), 2U);
  const auto& nodes = glb.document["nodes"];
  EXPECT_EQ(nodes[0], nlohmann::json({{"name", "first"}, {"mesh", 0}})) << "nothing but what is needed";
  EXPECT_EQ(nodes[1], nlohmann::json({{"name", "thing"}, {"mesh", 0}, {"translation", {0.0, 9.0, 0.0}}}));
  EXPECT_EQ(nodes[2]["mesh"], 1);
  EXPECT_EQ(nodes[3]["mesh"], 1);
  expect_all_formats_agree();
}

TEST_F(SmoothFiles, colours_are_albedo_times_openness) {
  place(glm::dmat4(1.0));
  const SmoothMesh& mesh = parts_[0].mesh;
  for (const Format& format : kFormats) {
    for (const bool occlusion : {true, false}) {
      const WorldMesh world = write(format, {occlusion});
      ASSERT_EQ(world.colours.size(), mesh.positions.size());
      for (std::size_t i = 0; i < world.colours.size(); ++i) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
          const double light = mesh.albedo[i][channel] / 65535.0 * (occlusion ? mesh.openness[i] : 1.0F);
          const double stored = world.colours[i][channel];
          if (format.linear) {
            EXPECT_NEAR(stored, light, 0.5001 / 65535) << i;
          } else {
            const double byte = SrgbEncoder::shared()(static_cast<float>(light));
            EXPECT_NEAR(stored, byte / 255.0, 1e-4) << format.ending << i;
          }
        }
      }
    }
  }
  EXPECT_EQ(write(kFormats[1]).colours[1][1], 188 / 255.0) << "half of the light is 188 in sRGB";
}

TEST_F(SmoothFiles, a_glb_has_what_the_specification_asks_for) {
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

TEST_F(SmoothFiles, indices_take_16_bits_as_long_as_none_is_the_restart_value) {
  for (const std::size_t vertices : {65'534U, 65'535U, 65'536U}) {
    SmoothMesh mesh = test_mesh();
    mesh.positions.resize(vertices, Vec3(0.0F));
    mesh.normals.resize(vertices, Vec3(0.0F, 1.0F, 0.0F));
    mesh.albedo.resize(vertices);
    mesh.openness.resize(vertices, 1.0F);
    mesh.indices.back() = static_cast<std::uint32_t>(vertices - 1);
    parts_ = {{"large", mesh, {}, {{"", glm::dmat4(1.0)}}}};
    const ParsedGlb glb = write_glb_file();
    const auto& primitive = glb.document["meshes"][0]["primitives"][0];
    const auto& indices = glb.document["accessors"][primitive["indices"].get<std::size_t>()];
    EXPECT_EQ(indices["componentType"], vertices < 65'535 ? 5123 : 5125) << vertices;
    EXPECT_EQ(glb.indices(primitive), mesh.indices);
  }
}

TEST_F(SmoothFiles, gltf_is_the_same_in_two_files) {
  place(glm::dmat4(1.0));
  const auto path = folder_.file("a b.gltf");
  const auto bytes = write_smooth_gltf(parts_, path);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  EXPECT_EQ(smooth_gltf_files(parts_, path), (std::vector{path, folder_.file("a b.bin")}));
  ParsedGlb glb = write_glb_file();
  nlohmann::json document = nlohmann::json::parse(bytes_as_text(read_file(path).value()));
  EXPECT_EQ(document["buffers"][0]["uri"], "a%20b.bin");
  document["buffers"][0].erase("uri");
  EXPECT_EQ(document, glb.document);
  EXPECT_EQ(read_file(folder_.file("a b.bin")).value(), glb.binary);
}

TEST_F(SmoothFiles, nothing_to_draw_is_a_valid_file) {
  parts_.push_back({"empty", {}, {}, {{"", glm::dmat4(1.0)}}});
  for (const Format& format : kFormats) EXPECT_TRUE(write(format).positions.empty()) << format.ending;
  const ParsedGlb glb = write_glb_file();
  EXPECT_EQ(glb.document["asset"]["version"], "2.0");
  EXPECT_FALSE(glb.document.contains("nodes")) << "glTF forbids empty arrays";
  EXPECT_FALSE(glb.document.contains("meshes"));
  EXPECT_FALSE(glb.document.contains("buffers"));
  const std::string ply = bytes_as_text(read_file(folder_.file("out.ply")).value());
  EXPECT_NE(ply.find("element vertex 0\n"), std::string::npos);
}

TEST_F(SmoothFiles, objects_of_obj_have_names_that_differ) {
  place(glm::dmat4(1.0), "a b");
  place(glm::dmat4(1.0), "a b");
  place(glm::dmat4(1.0));
  write(kFormats[2]);
  const std::string text = bytes_as_text(read_file(folder_.file("out.obj")).value());
  for (const char* line : {"\no a_b\n", "\no a_b_2\n", "\no thing\n"}) EXPECT_NE(text.find(line), std::string::npos);
}

TEST_F(SmoothFiles, unsound_input_is_refused_and_leaves_no_file) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::pair<std::string, SmoothPart>> wrong;
  const auto add = [&](const std::string& message, const std::function<void(SmoothPart&)>& spoil) {
    SmoothPart part{"thing", test_mesh(), {}, {{"", glm::dmat4(1.0)}}};
    spoil(part);
    wrong.emplace_back(message, part);
  };
  add("a transform that is not finite", [](SmoothPart& part) { part.placements[0].world_from_mesh[3].x = kNan; });
  add("a transform that is singular", [](SmoothPart& part) { part.placements[0].world_from_mesh[1] *= 0.0; });
  add("a transform that is singular",
      [](SmoothPart& part) { part.placements[0].world_from_mesh[1] = part.placements[0].world_from_mesh[0]; });
  add("a transform that is not affine", [](SmoothPart& part) { part.placements[0].world_from_mesh[1].w = 0.1; });
  add("a vertex farther away than a float can say",
      [](SmoothPart& part) { part.placements[0].world_from_mesh[3].x = 1e39; });
  add("a vertex farther away than a float can say",
      [](SmoothPart& part) { part.placements[0].world_from_mesh[0].x = 2e38; });
  add("a vertex farther away than a float can say", [](SmoothPart& part) {
    part.pivot.z = 1e200;
    part.placements[0].world_from_mesh[3].z = 1e200;
  });
  add("a pivot that is not finite", [](SmoothPart& part) { part.pivot.y = kNan; });
  add("arrays of different lengths", [](SmoothPart& part) { part.mesh.normals.pop_back(); });
  add("arrays of different lengths", [](SmoothPart& part) { part.mesh.openness.pop_back(); });
  add("an index of no vertex", [](SmoothPart& part) { part.mesh.indices[3] = 6; });
  add("indices that make no whole triangles", [](SmoothPart& part) { part.mesh.indices.pop_back(); });
  add("a position that is not finite", [](SmoothPart& part) { part.mesh.positions[2].x = NAN; });
  add("a normal that is not finite", [](SmoothPart& part) { part.mesh.normals[2].x = INFINITY; });
  add("an openness beyond 0 to 1", [](SmoothPart& part) { part.mesh.openness[2] = NAN; });
  for (const auto& [message, part] : wrong) {
    for (const Format& format : kFormats) {
      const auto path = folder_.file(std::string("wrong") + format.ending);
      const auto refused = format.write(std::span(&part, 1), path, {}, {});
      ASSERT_FALSE(refused) << message;
      EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
      EXPECT_EQ(refused.error().path, path.string());
      EXPECT_EQ(refused.error().message, "part \"thing\" has " + message);
      EXPECT_FALSE(std::filesystem::exists(path));
    }
  }
}

TEST_F(SmoothFiles, cancelling_leaves_the_old_file) {
  place(glm::dmat4(1.0));
  for (const Format& format : kFormats) {
    const auto path = folder_.file(std::string("old") + format.ending);
    ASSERT_TRUE(write_file(path, std::as_bytes(std::span("old", 3))));
    const auto refused = format.write(parts_, path, {}, [](double) { return false; });
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Cancelled);
    EXPECT_EQ(bytes_as_text(read_file(path).value()), "old");
  }
  EXPECT_EQ(folder_.count(), kFormats.size());
}

TEST_F(SmoothFiles, a_folder_that_is_not_there_is_an_error) {
  place(glm::dmat4(1.0));
  for (const Format& format : kFormats) {
    const auto refused = format.write(parts_, folder_.file(std::string("none/out") + format.ending), {}, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::CannotWrite);
  }
}

}  // namespace

}  // namespace quoin

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>
#include <quoin/io/mesh_file.h>
#include <quoin/scene/scene_meshes.h>

#include "core/bytes/text.h"
#include "io/format_driver.h"
#include "io/triangles/triangles.h"

namespace quoin {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// Returns the mesh read; fails the test on an error.
LoadedMesh mesh_of(const std::string& text, std::optional<UpAxis> up = UpAxis::Y) {
  auto loaded = read_mesh(bytes_of(text), up);
  if (!loaded) {
    ADD_FAILURE() << to_string(loaded.error());
    return {};
  }
  EXPECT_TRUE(check_mesh(loaded->mesh));
  return std::move(*loaded);
}

Error error_of(const std::string& text) {
  const auto loaded = read_mesh(bytes_of(text));
  if (!loaded) return loaded.error();
  ADD_FAILURE() << "it was read";
  return {};
}

template <class T>
void put(std::string& text, T value, bool big = false) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  if (big) std::reverse(raw.begin(), raw.end());
  text.append(raw.data(), raw.size());
}

bool reads(FileFormat format) {
  return can(format, FormatCapability::Read);
}

/// A tetrahedron of volume 1/6 in the syntax of each format.
const std::string kObj =
    "# a tetrahedron\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nv 0 0 1 1 1 1\n"
    "f 1 3 2\nf 1 2 4\nf 2 3 4\nf -2 -4 -1\n";

std::string ply_header(const std::string& format) {
  return "ply\nformat " + format +
         " 1.0\ncomment of nobody\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n"
         "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 4\n"
         "property list uchar int vertex_indices\nproperty float quality\nend_header\n";
}

const int kCorners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};

std::string ply_bytes(bool big) {
  std::string text = ply_header(big ? "binary_big_endian" : "binary_little_endian");
  for (const auto& corner : kCorners) {
    put(text, static_cast<float>(corner[0]), big);
    put(text, static_cast<float>(corner[1]), big);
    put(text, static_cast<double>(corner[2]), big);
    text += "\x80\x40\xFF";
  }
  for (const auto& face : kFaces) {
    text += '\x03';
    for (const int index : face) put(text, index, big);
    put(text, 0.5F, big);
  }
  return text;
}

std::string stl_bytes(std::uint16_t colour = 0, const std::string& header = "") {
  std::string text = header;
  text.resize(80, '\0');
  put(text, std::uint32_t{4});
  for (const auto& face : kFaces) {
    for (int i = 0; i < 3; ++i) put(text, 0.0F);
    for (const int index : face) {
      for (const int at : kCorners[index]) put(text, static_cast<float>(at));
    }
    put(text, colour);
  }
  return text;
}

std::string stl_text() {
  std::string text = "solid thing\n";
  for (const auto& face : kFaces) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (const int i : face) {
      text += "   vertex " + std::to_string(kCorners[i][0]) + " " + std::to_string(kCorners[i][1]) + ".0e0 " +
              std::to_string(kCorners[i][2]) + "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid thing\n";
}

double volume_of(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) {
    sum += glm::dot(mesh.positions[t[0]], glm::cross(mesh.positions[t[1]], mesh.positions[t[2]])) / 6.0;
  }
  return sum;
}

std::string data_uri(const std::string& bytes) {
  return "data:application/octet-stream;base64," + to_base64(bytes_of(bytes));
}

/// Returns a glTF file whose buffer is `bytes`.
std::string gltf(const std::string& bytes, const std::string& rest) {
  return R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":)" + std::to_string(bytes.size()) + R"(,"uri":")" +
         data_uri(bytes) + "\"}]," + rest + "}";
}

/// Positions as floats, then faces as bytes.
std::string tetrahedron_buffer() {
  std::string bytes;
  for (const auto& corner : kCorners) {
    for (const int at : corner) put(bytes, static_cast<float>(at));
  }
  for (const auto& face : kFaces) {
    for (const int index : face) bytes += static_cast<char>(index);
  }
  return bytes;
}

std::string tetrahedron_gltf(const std::string& nodes, const std::string& materials = "", int count = 4) {
  return gltf(tetrahedron_buffer(),
              R"("bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],)"
              R"("accessors":[{"bufferView":0,"componentType":5126,"count":)" +
                  std::to_string(count) +
                  R"(,"type":"VEC3"},{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}],)"
                  R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
                  R"("scenes":[{"nodes":[0]}],"scene":0,)" +
                  materials + R"("nodes":)" + nodes);
}

TEST(Triangles, ReadsSameTrianglesFromEveryFormat) {
  std::vector<std::string> files = {ply_bytes(false), ply_bytes(true), stl_bytes(), stl_text()};
  std::string text = ply_header("ascii");
  for (const auto& c : kCorners) {
    text += std::to_string(c[0]) + " " + std::to_string(c[1]) + " " + std::to_string(c[2]) + " 128 64 255\n";
  }
  for (const auto& f : kFaces) {
    text += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) + " 0.5\n";
  }
  files.push_back(text);
  if (reads(FileFormat::Obj)) files.push_back(kObj);
  if (reads(FileFormat::Gltf)) files.push_back(tetrahedron_gltf(R"([{"mesh":0}])"));
  for (const std::string& file : files) {
    const LoadedMesh loaded = mesh_of(file);
    EXPECT_EQ(loaded.mesh.triangles.size(), 4U) << loaded.format;
    EXPECT_NEAR(volume_of(loaded.mesh), 1.0 / 6.0, 1e-12) << loaded.format;
    EXPECT_TRUE(loaded.warnings.empty()) << loaded.format << loaded.warnings.front();
  }
}

TEST(Triangles, RotatesFilesWithZUp) {
  EXPECT_EQ(mesh_of(stl_bytes(), std::nullopt).mesh.bounds().min.z, -1.0);
  EXPECT_EQ(mesh_of(stl_bytes(), UpAxis::Y).mesh.bounds().min.z, 0.0);
  EXPECT_NEAR(volume_of(mesh_of(stl_bytes(), UpAxis::Z).mesh), 1.0 / 6.0, 1e-12);
}

TEST(Triangles, ReadsVertexColours) {
  const LoadedMesh ply = mesh_of(ply_bytes(true));
  ASSERT_EQ(ply.mesh.colours.size(), 4U);
  EXPECT_NEAR(ply.mesh.colours[0].r, 0.2158F, 1e-3F);
  EXPECT_NEAR(ply.mesh.colours[0].b, 1.0F, 1e-6F);
  // Red by VisCAM's order and by Magics'.
  EXPECT_EQ(mesh_of(stl_bytes(0x8000 | 31 << 10)).mesh.colours.at(0), glm::vec4(1, 0, 0, 1));
  EXPECT_EQ(mesh_of(stl_bytes(31, std::string("COLOR=\x01\x02\x03\xFF", 10))).mesh.colours.at(0),
            glm::vec4(1, 0, 0, 1));
  if (!reads(FileFormat::Obj)) return;
  const LoadedMesh obj = mesh_of(kObj);
  ASSERT_EQ(obj.mesh.colours.size(), 4U);
  EXPECT_EQ(obj.mesh.colours[1], glm::vec4(0, 1, 0, 1));
}

TEST(Triangles, ReadsPlyStrips) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 2 1 0\n";
  const LoadedMesh loaded = mesh_of(text);
  ASSERT_EQ(loaded.mesh.triangles.size(), 3U);
  EXPECT_EQ(loaded.mesh.triangles[1], (std::array<std::uint32_t, 3>{1, 3, 2}));
}

TEST(Triangles, SplitsPolygonsAndSkipsBadCorners) {
  if (!reads(FileFormat::Obj)) return;
  const LoadedMesh loaded = mesh_of("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv nan 0 0\nf 1 2 3 4\nf 1 2 900\nl 1 2\n");
  EXPECT_EQ(loaded.mesh.triangles.size(), 2U);
  EXPECT_GE(loaded.warnings.size(), 3U);
  EXPECT_NE(loaded.warnings.front().find("not finite numbers"), std::string::npos);
}

TEST(GltfTriangles, AppliesNodeTransforms) {
  if (!reads(FileFormat::Gltf)) return;
  const LoadedMesh loaded = mesh_of(tetrahedron_gltf(
      R"([{"children":[1,2],"translation":[10,0,0]},{"mesh":0,"scale":[2,2,2]},{"mesh":0,"scale":[-1,1,1]}])"));
  EXPECT_EQ(loaded.mesh.triangles.size(), 8U);
  EXPECT_EQ(loaded.mesh.bounds().min.x, 9.0);
  EXPECT_EQ(loaded.mesh.bounds().max.x, 12.0);
  // The mirrored tetrahedron still faces outwards.
  EXPECT_NEAR(volume_of(loaded.mesh), 9.0 / 6.0, 1e-9);
}

TEST(GltfTriangles, ReadsBaseColoursTexturesAndCutOuts) {
  if (!reads(FileFormat::Gltf)) return;
  const LoadedMesh loaded = mesh_of(tetrahedron_gltf(
      R"([{"mesh":0}])",
      R"("materials":[{"name":"leaf","alphaMode":"MASK","alphaCutoff":0.25,"emissiveFactor":[0,0.5,0],)"
      R"("pbrMetallicRoughness":{"baseColorFactor":[0.5,1,0.25,1],"metallicFactor":0.5,"roughnessFactor":0.75},)"
      R"("extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":4}}}],)"));
  ASSERT_GE(loaded.mesh.materials.size(), 1U);
  const MeshMaterial& leaf = loaded.mesh.materials[0];
  EXPECT_EQ(leaf.name, "leaf");
  EXPECT_EQ(leaf.colour, glm::vec4(0.5F, 1.0F, 0.25F, 1.0F));
  EXPECT_EQ(leaf.alpha_mode, AlphaMode::Mask);
  EXPECT_EQ(leaf.alpha_cutoff, 0.25F);
  EXPECT_EQ(leaf.metalness, 0.5F);
  EXPECT_EQ(leaf.roughness, 0.75F);
  EXPECT_EQ(leaf.emission, 2.0F);
}

TEST(GltfTriangles, ReadsSparseStripsAndFans) {
  if (!reads(FileFormat::Gltf)) return;
  std::string bytes;
  for (const float at : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 1.0F, 1.0F, 0.0F}) put(bytes, at);
  put(bytes, std::uint16_t{3});
  put(bytes, std::uint16_t{0});
  for (const float at : {5.0F, 5.0F, 0.0F}) put(bytes, at);
  for (const int mode : {5, 6}) {
    const LoadedMesh loaded = mesh_of(gltf(
        bytes, R"("bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":2},)"
               R"({"buffer":0,"byteOffset":52,"byteLength":12}],"accessors":[{"bufferView":0,"componentType":5126,)"
               R"("count":4,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},)"
               R"("values":{"bufferView":2}}}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":)" +
                   std::to_string(mode) + R"(}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}])"));
    ASSERT_EQ(loaded.mesh.triangles.size(), 2U);
    EXPECT_EQ(loaded.mesh.positions[3], DVec3(5.0, 5.0, 0.0));
    const auto& t = loaded.mesh.triangles;
    if (mode == 5) {
      EXPECT_EQ(t[1], (std::array<std::uint32_t, 3>{1, 3, 2}));
    }
    if (mode == 6) {
      EXPECT_EQ(t[1], (std::array<std::uint32_t, 3>{2, 3, 0}));
    }
  }
}

TEST(GltfTriangles, RejectsContradictoryFiles) {
  if (!reads(FileFormat::Gltf)) return;
  EXPECT_EQ(error_of(tetrahedron_gltf(R"([{"mesh":0}])", "", 5)).code, ErrorCode::BadFormat);
  EXPECT_EQ(error_of(tetrahedron_gltf(R"([{"mesh":0}])", "", 2'147'483'647)).code, ErrorCode::BadFormat);
  EXPECT_EQ(error_of(tetrahedron_gltf(R"([{"mesh":7}])")).code, ErrorCode::BadFormat);
  EXPECT_EQ(error_of(tetrahedron_gltf(R"([{"children":[1]},{"children":[0]}])")).code, ErrorCode::BadFormat);
  EXPECT_EQ(error_of(tetrahedron_gltf(R"([{"mesh":0}])", R"("extensionsRequired":["KHR_made_up"],)")).code,
            ErrorCode::Unsupported);
  std::string deep = R"({"asset":{"version":"2.0"},"extras":)";
  deep.append(100'000, '[');
  EXPECT_EQ(error_of(deep).code, ErrorCode::BadFormat);
  std::string cut = tetrahedron_gltf(R"([{"mesh":0}])");
  cut.resize(cut.size() - 3);
  EXPECT_EQ(error_of(cut).code, ErrorCode::BadFormat);
}

TEST(Triangles, RejectsInconsistentFilesWithAPosition) {
  std::string stl = stl_bytes();
  put(stl, 0);
  std::string claims = stl_bytes().substr(0, 80);
  put(claims, std::uint32_t{0x7FFF'FFFF});
  claims += stl_bytes().substr(84);
  // Its length matches no STL file, so only the reader reports the reason.
  triangles::SidecarReader nothing;
  const auto refused = driver_of(FileFormat::Stl).read_mesh(bytes_of(claims), nothing);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().byte_offset, 80U);
  EXPECT_EQ(error_of("solid x\n facet\n vertex 1 2 oops\n").code, ErrorCode::BadFormat);
  std::string ply = ply_header("ascii");
  ply.replace(ply.find("vertex 4"), 8, "vertex 2147483648");
  EXPECT_TRUE(error_of(ply).byte_offset.has_value());
  std::string cut = ply_bytes(false);
  cut.resize(cut.size() - 5);
  EXPECT_TRUE(error_of(cut).byte_offset.has_value());
  EXPECT_EQ(error_of("ply\nformat ascii 1.0\nelement vertex 1\n").code, ErrorCode::BadFormat);
}

TEST(Triangles, RecognisesFormatsByContent) {
  EXPECT_EQ(detect_format(bytes_of(stl_bytes(0, "solid binary"))), FileFormat::Stl);
  EXPECT_EQ(detect_format(bytes_of(stl_text())), FileFormat::Stl);
  EXPECT_EQ(detect_format(bytes_of(ply_bytes(true))), FileFormat::Ply);
  EXPECT_EQ(detect_format(bytes_of(kObj)), FileFormat::Obj);
  EXPECT_EQ(detect_format(bytes_of(tetrahedron_gltf(R"([{"mesh":0}])"))), FileFormat::Gltf);
  EXPECT_NE(detect_format(bytes_of("v is for victory\nand f for nothing\n")), FileFormat::Obj);
}

/// A temporary folder.
struct Folder {
  fs::path path = fs::temp_directory_path() / "quoin_triangles_test";
  Folder() {
    fs::remove_all(path);
    fs::create_directories(path / "below");
  }
  ~Folder() { fs::remove_all(path); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
  }
};

TEST(Triangles, FindsFilesOnlyBelowTheirFolder) {
  if (!reads(FileFormat::Obj)) return;
  const Folder folder;
  Image red;
  red.width = red.height = 2;
  red.rgb.assign(12, 0);
  for (std::size_t i = 0; i < 12; i += 3) red.rgb[i] = 255;
  ASSERT_TRUE(write_png(red, folder.path / "red.png"));
  if (has_jpeg()) {
    ASSERT_TRUE(write_jpeg(red, folder.path / "below" / "red.jpg"));
  }
  if (has_webp()) {
    ASSERT_TRUE(write_webp(red, folder.path / "red.webp"));
  }
  folder.write("one.obj",
               "mtllib one.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
               "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 2/2\nusemtl c\nf 1/1 2/2 3/3\nusemtl d\nf 1/1 2/2 3/3\n");
  folder.write("one.mtl",
               "newmtl a\nmap_Kd ../../elsewhere/red.png\nnewmtl b\nmap_Kd below\\red.jpg\nnewmtl c\nmap_Kd gone.png\n"
               "newmtl d\nmap_Kd red.webp\n");
  const auto loaded = read_mesh(folder.path / "one.obj");
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->warnings.size(), 1U) << loaded->warnings.back();
  EXPECT_NE(loaded->warnings[0].find("gone.png"), std::string::npos);
  EXPECT_EQ(loaded->mesh.textures.size(), 3U);
  EXPECT_EQ(loaded->sidecars.size(), 4U);
  for (const MeshTexture& texture : loaded->mesh.textures) {
    EXPECT_NEAR(texture.image.rgba[0], 255, 2);
    EXPECT_NEAR(texture.image.rgba[1], 0, 2);
  }
  EXPECT_EQ(sidecar_files_of(folder.path / "one.obj").size(), 4U);
  const auto scene = load_scene(folder.path / "one.obj");
  ASSERT_TRUE(scene) << to_string(scene.error());
  EXPECT_GT(scene->scene.voxel_count(), 4'000);
  EXPECT_EQ(scene->scene.grids()[scene->scene.grids().handles().front()].name, "one");
}

TEST(Triangles, VoxelizesAtOriginalSize) {
  LoadOptions options;
  options.mesh.up = UpAxis::Y;
  auto scene = load_scene(bytes_of(stl_bytes()), options);
  ASSERT_TRUE(scene) << to_string(scene.error());
  ASSERT_EQ(scene->warnings.size(), 1U);
  EXPECT_NE(scene->warnings[0].find("128 voxels"), std::string::npos);
  const Instance& placed = scene->scene.instances()[scene->scene.instances().handles().front()];
  EXPECT_NEAR(placed.voxel_size, 1.0 / 128.0, 1e-4);
  EXPECT_NEAR(placed.position.x, 0.0, 1e-4);
  options.mesh.size = 32;
  scene = load_scene(bytes_of(stl_bytes()), options);
  ASSERT_TRUE(scene);
  EXPECT_TRUE(scene->warnings.empty());
  EXPECT_EQ(scene->scene.grids()[scene->scene.grids().handles().front()].grid.bounds().size(), IVec3(32));
  options.mesh.as_field = true;
  scene = load_scene(bytes_of(stl_bytes()), options);
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->scene.voxel_count(), 0);
  EXPECT_NEAR(static_cast<double>(scene->scene.grids()[scene->scene.grids().handles().front()].field.solid_count()),
              32.0 * 32.0 * 32.0 / 6.0, 300.0);
  EXPECT_FALSE(load_scene(bytes_of("solid nothing\nendsolid nothing\n")));
}

TEST(Triangles, ReadsCorpusFilesAsScenes) {
  std::size_t read = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "triangles")) {
    const auto loaded = load_scene(entry.path());
    const auto format = detect_format(entry.path());
    ASSERT_TRUE(format && *format) << entry.path();
    EXPECT_EQ(loaded.has_value(), reads(**format)) << entry.path() << (loaded ? "" : to_string(loaded.error()));
    if (!loaded) continue;
    EXPECT_GT(loaded->scene.voxel_count(), 0) << entry.path();
    ++read;
  }
  EXPECT_GE(read, 6U);
}

TEST(Triangles, RealFilesHaveExpectedCounts) {
  const fs::path folder = fs::path(QUOIN_SOURCE_DIR).parent_path() / "shared" / "data" / "mesh";
  if (!fs::exists(folder)) GTEST_SKIP() << "the files are not here";
  const fs::path models = folder / "alecjacobson+common-3d-test-models";
  const fs::path lox = folder / "LukasKalbertodt+lox";
  for (const auto& [path, triangles] : std::vector<std::pair<fs::path, std::size_t>>{
           {models / "data__stanford-bunny.obj", 69'451},
           {models / "data__spot.obj", 5'856},
           {models / "data__teapot.obj", 6'320},
           {folder / "Forceflow+cuda_voxelizer" / "test_models__bunny.OBJ", 5'110},
           {lox / "old_code__tests__files__ply__sphere_bbe.ply", 768},
           {lox / "old_code__tests__files__ply__sphere_ascii.ply", 768},
           {lox / "old_code__tests__files__stl__sphere_binary.stl", 768},
           {lox / "old_code__tests__files__stl__sphere_ascii.stl", 768}}) {
    const auto format = detect_format(path);
    if (!format || !*format || !reads(**format)) continue;
    const auto loaded = read_mesh(path);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(loaded->mesh.triangles.size(), triangles) << path;
  }
}

TEST(MeshFiles, ReadsPolygonsOfManyCorners) {
  if (!reads(FileFormat::Obj)) GTEST_SKIP() << "without OBJ";
  // A comb of 1,000 teeth: not convex, and more corners than a byte can count.
  std::string text;
  std::string face = "f";
  for (int i = 0; i < 1000; ++i) {
    text += "v " + std::to_string(2 * i) + " 0 0\nv " + std::to_string(2 * i + 1) + " 9 0\n";
  }
  text += "v 1999 -1 0\nv 0 -1 0\n";
  for (int i = 1; i <= 2002; ++i) face += " " + std::to_string(i);
  const LoadedMesh loaded = mesh_of(text + face + "\nf -1 -2 1\n");
  EXPECT_EQ(loaded.mesh.triangles.size(), 2001U);
  double area = 0.0;
  for (std::size_t i = 0; i < 2000; ++i) {
    const auto& t = loaded.mesh.triangles[i];
    const auto& p = loaded.mesh.positions;
    area += 0.5 * glm::length(glm::cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]));
  }
  EXPECT_NEAR(area, 1999.0 * 1.0 + 1999.0 * 4.5 + 0.0, 1e-6 * area);
  EXPECT_TRUE(loaded.warnings.empty());
}

TEST(MeshFiles, ReadsEveryObjLineEnding) {
  if (!reads(FileFormat::Obj)) GTEST_SKIP() << "without OBJ";
  for (const std::string end : {"\r", "\r\n", "\n"}) {
    const std::string text =
        "v 0 0 0" + end + "v 1 0 \\" + end + "0" + end + "v 0 1 0" + end + "vt 0 0" + end + "f 1/1/ 2/1/ 3/1/" + end;
    EXPECT_EQ(mesh_of(text).mesh.triangles.size(), 1U) << static_cast<int>(end[0]);
  }
}

std::string corpus_file(const char* name) {
  const auto bytes = read_file(fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "triangles" / name);
  EXPECT_TRUE(bytes);
  return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : std::string();
}

TEST(Triangles, RefusesSecondVertexElement) {
  const auto bytes = read_file(fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "cases" / "fuzz-ply-unsound.ply");
  ASSERT_TRUE(bytes.has_value());
  const auto loaded = read_mesh(*bytes);
  ASSERT_FALSE(loaded.has_value());
  EXPECT_NE(to_string(loaded.error()).find("more than one element is named vertex"), std::string::npos);
}

TEST(OffFiles, ReadsCornersFacesAndColours) {
  const LoadedMesh plain = mesh_of(corpus_file("off"), std::nullopt);
  EXPECT_EQ(plain.format, "off");
  EXPECT_EQ(plain.mesh.positions[3], DVec3(0, 0, 1)) << "y is up";
  EXPECT_EQ(plain.mesh.triangles.size(), 4U);
  EXPECT_TRUE(plain.warnings.empty());
  const LoadedMesh coloured = mesh_of(corpus_file("off__colours"));
  EXPECT_EQ(coloured.mesh.triangles.size(), 5U);
  ASSERT_EQ(coloured.mesh.colours.size(), 5U);
  EXPECT_EQ(coloured.mesh.colours[0], glm::vec4(1, 0, 0, 1));
  EXPECT_NEAR(coloured.mesh.colours[3].a, 128.0 / 255.0, 1e-6);
  ASSERT_EQ(coloured.mesh.materials.size(), 3U);
  EXPECT_EQ(coloured.mesh.material_of, (std::vector<std::uint32_t>{0, 0, 0, 1, 2}));
  EXPECT_NEAR(coloured.mesh.materials[1].colour.r, 0.214, 1e-3) << "0.5 of sRGB";
  EXPECT_EQ(coloured.mesh.materials[2].colour, glm::vec4(1, 0, 0, 1));
}

TEST(OffFiles, ReadsOneLineHeadersAndSkipsNormals) {
  EXPECT_EQ(mesh_of("OFF 3 1 3\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").mesh.triangles.size(), 1U);
  EXPECT_EQ(mesh_of("# first\n\nSTCNOFF\n3 1 0\n0 0 0 0 0 1 1 1 1 1 0.5 0.5\n1 0 0 0 0 1 1 1 1 1 0 0\n"
                    "0 1 0 0 0 1 1 1 1 1 1 1\n3 0 1 2\n")
                .mesh.colours[0],
            glm::vec4(1.0F / 255.0F / 12.92F, 1.0F / 255.0F / 12.92F, 1.0F / 255.0F / 12.92F, 1.0F / 255.0F));
}

TEST(OffFiles, DescribesDamage) {
  EXPECT_EQ(error_of("OFF\n9999999 1 0\n0 0 0\n").message, "the file claims 9999999 vertices and 1 faces in 6 bytes");
  EXPECT_EQ(error_of("OFF\n2 1 0\n0 0 0\n1 x 0\n3 0 1 1\n").byte_offset, 16U);
  EXPECT_EQ(error_of("OFF\n2 1 0\n0 0 0\n1 0 0\n3 0 1\n").message, "a face has fewer corners than it claims");
  EXPECT_EQ(error_of("4OFF\n1 0 0\n0 0 0 1\n").code, ErrorCode::Unsupported);
  EXPECT_EQ(error_of("OFF BINARY\n????").code, ErrorCode::Unsupported);
}

TEST(ThreeMfFiles, PlacesColouredObjectsInMillimetres) {
  if (!reads(FileFormat::ThreeMf)) GTEST_SKIP() << "without expat";
  const LoadedMesh loaded = mesh_of(corpus_file("3mf__components"));
  EXPECT_EQ(loaded.format, "3mf");
  const TriangleMesh& mesh = loaded.mesh;
  ASSERT_EQ(mesh.triangles.size(), 12U);
  const DBox box = mesh.bounds();
  EXPECT_EQ(box.min, DVec3(0, 0, 50));
  EXPECT_EQ(box.max, DVec3(100, 220, 70));
  // All three tetrahedra are closed and face outwards, including the mirrored one.
  for (std::size_t part = 0; part < 3; ++part) {
    double volume = 0.0;
    for (std::size_t i = 4 * part; i < 4 * part + 4; ++i) {
      const auto& t = mesh.triangles[i];
      const DVec3 a = mesh.positions[t[0]] - box.min;
      volume += glm::dot(a, glm::cross(mesh.positions[t[1]] - box.min, mesh.positions[t[2]] - box.min)) / 6.0;
    }
    EXPECT_NEAR(volume, (part == 2 ? 8.0 : 1.0) * 1000.0 / 6.0, 1e-6) << part;
  }
  const auto colour = [&](std::size_t triangle, std::size_t corner) {
    return mesh.colours[mesh.triangles[triangle][corner]];
  };
  EXPECT_EQ(colour(0, 0), glm::vec4(1, 0, 0, 1)) << "of its object";
  EXPECT_EQ(colour(1, 2), glm::vec4(0, 1, 0, 1)) << "of the triangle";
  EXPECT_EQ(colour(2, 0), glm::vec4(0, 1, 0, 1));
  EXPECT_NEAR(colour(2, 1).a, 128.0 / 255.0, 1e-6);
  EXPECT_EQ(mesh.materials[0].alpha_mode, AlphaMode::Blend);
  ASSERT_EQ(loaded.warnings.size(), 1U) << "a group that is not there";
  const LoadedMesh up = mesh_of(corpus_file("3mf"), std::nullopt);
  EXPECT_EQ(up.mesh.bounds().max, DVec3(1, 1, 0)) << "z is up";
}

TEST(ThreeMfFiles, ReadsFilesWrittenByQuoin) {
  if (!reads(FileFormat::ThreeMf) || !reads(FileFormat::Obj)) GTEST_SKIP() << "without expat or OBJ";
  LoadedScene scene = load_scene(bytes_of(kObj), {.mesh = {.size = 6}}).value();
  const fs::path path = fs::path(testing::TempDir()) / "quoin_again.3mf";
  const auto meshes = mesh_scene(scene.scene, {});
  ASSERT_TRUE(meshes);
  ASSERT_TRUE(write_mesh(*meshes, path));
  const auto again = read_mesh(path);
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_GT(again->mesh.triangles.size(), 20U);
  EXPECT_TRUE(again->warnings.empty());
  fs::remove(path);
}

TEST(ThreeMfFiles, SurvivesDamageAnywhere) {
  for (const char* name : {"3mf", "3mf__components"}) {
    const std::string whole = corpus_file(name);
    for (std::size_t size = 0; size < whole.size(); size += 3) (void)read_mesh(bytes_of(whole.substr(0, size)));
    for (std::size_t at = 0; at < whole.size(); ++at) {
      std::string turned = whole;
      turned[at] = static_cast<char>(turned[at] ^ 4);
      (void)read_mesh(bytes_of(turned));
    }
  }
}

}  // namespace
}  // namespace quoin

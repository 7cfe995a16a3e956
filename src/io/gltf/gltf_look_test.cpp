#include <cstring>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/io/formats.h>
#include <quoin/io/mesh_file.h>
#include <quoin/scene/scene_meshes.h>

#include "core/bytes/text.h"
#include "io/gltf/gltf_decoders.h"
#include "io/image/image_codecs.h"

namespace quoin {
namespace {

std::span<const std::byte> text_bytes(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

std::string uri_of(std::span<const std::byte> bytes, const char* type) {
  return "data:" + std::string(type) + ";base64," + to_base64(bytes);
}

/// An image of one row of colours.
std::string image_of(const std::vector<Rgba8>& colours) {
  PngImage image;
  image.width = static_cast<std::uint32_t>(colours.size());
  image.height = 1;
  image.channels = 4;
  for (const Rgba8 c : colours) image.pixels.insert(image.pixels.end(), {c.r, c.g, c.b, c.a});
  const auto png = encode_png(image);
  EXPECT_TRUE(png);
  return uri_of(*png, "image/png");
}

/// Returns a square of one material with the textures numbered from 0; u goes along x.
std::string square_gltf(const std::string& material, const std::vector<std::string>& images) {
  const float numbers[] = {0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 0, 0, 1, 0, 1, 1, 0, 1};
  const auto buffer = std::as_bytes(std::span(numbers));
  std::string textures;
  std::string sources;
  for (std::size_t i = 0; i < images.size(); ++i) {
    textures += (i == 0 ? "" : ",") + (R"({"sampler":0,"source":)" + std::to_string(i) + "}");
    sources += (i == 0 ? "" : ",") + (R"({"uri":")" + images[i] + "\"}");
  }
  return R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":80,"uri":")" +
         uri_of(buffer, "application/octet-stream") +
         R"("}],"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":32}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
         R"({"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"mode":6,"material":0}]}],)"
         R"("nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0,"samplers":[{"magFilter":9728}],"textures":[)" +
         textures + R"(],"images":[)" + sources + R"(],"materials":[)" + material + "]}";
}

/// Returns the properties of the square's voxel types, by column along x.
std::vector<VoxelProperties> columns_of(const std::string& gltf) {
  LoadOptions options;
  options.mesh.voxel_size = 1.0;
  options.mesh.solid = SolidVoxels::None;
  const auto loaded = load_scene(text_bytes(gltf), options);
  EXPECT_TRUE(loaded) << (loaded ? "" : to_string(loaded.error()));
  std::vector<VoxelProperties> columns;
  if (!loaded) return columns;
  const Grid& grid = loaded->scene.grids()[loaded->scene.grids().handles().front()].grid;
  const IBox box = grid.bounds();
  for (int x = box.min.x; x < box.max.x; ++x) {
    columns.push_back(loaded->scene.types[grid.get(x, box.min.y, box.min.z)]);
  }
  return columns;
}

TEST(GltfReader, MultipliesEmissionByItsTexture) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  const std::string material =
      R"({"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0},"pbrMetallicRoughness":{"baseColorFactor":[1,1,1,1]},)"
      R"("extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":4}}})";
  const auto half = columns_of(square_gltf(material, {image_of({{0, 0, 0, 255}, {255, 255, 255, 255}})}));
  ASSERT_EQ(half.size(), 4U);
  EXPECT_EQ(half[0].emission, 0.0F);
  EXPECT_EQ(half[1].emission, 0.0F);
  EXPECT_EQ(half[2].emission, 4.0F);
  EXPECT_EQ(half[3].emission, 4.0F);
  for (const VoxelProperties& type : columns_of(square_gltf(material, {image_of({{0, 0, 0, 255}})}))) {
    EXPECT_EQ(type.emission, 0.0F) << "a black texture";
  }
  // sRGB 188 is half the light of 255.
  for (const VoxelProperties& type : columns_of(square_gltf(material, {image_of({{188, 188, 188, 255}})}))) {
    EXPECT_NEAR(type.emission, 2.0F, 0.13F);
  }
}

TEST(GltfReader, DoesNotGlowWithoutEmissiveImage) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  const std::string gltf = square_gltf(R"({"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0}})", {"missing.png"});
  const auto mesh = read_mesh(text_bytes(gltf));
  ASSERT_TRUE(mesh) << to_string(mesh.error());
  EXPECT_EQ(mesh->mesh.materials[0].emission, 0.0F);
  ASSERT_EQ(mesh->warnings.size(), 1U);
  EXPECT_NE(mesh->warnings[0].find("missing.png"), std::string::npos);
}

// tinygltf reads on beyond the buffer.
TEST(GltfReader, LeavesOutImagesThatEndBeyondTheirBuffer) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  std::string gltf = square_gltf(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})", {"bricks"});
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(gltf.find(from), std::string::npos) << from;
    gltf.replace(gltf.find(from), from.size(), to);
  };
  const std::string last_view = R"({"buffer":0,"byteOffset":48,"byteLength":32})";
  replace(R"("uri":"bricks")", R"("name":"bricks","mimeType":"image/png","bufferView":2)");
  for (const std::string place : {R"("byteOffset":5616,"byteLength":89)", R"("byteOffset":48,"byteLength":33)",
                                  R"("byteOffset":81,"byteLength":1)", R"("byteOffset":4294967295,"byteLength":9)"}) {
    const std::string before = gltf;
    replace(last_view, last_view + R"(,{"buffer":0,)" + place + "}");
    const auto mesh = read_mesh(text_bytes(gltf));
    ASSERT_TRUE(mesh) << place << ": " << to_string(mesh.error());
    EXPECT_TRUE(mesh->mesh.textures.empty()) << place;
    ASSERT_EQ(mesh->warnings.size(), 1U) << place;
    EXPECT_NE(mesh->warnings[0].find("bricks"), std::string::npos) << mesh->warnings[0];
    gltf = before;
  }
}

TEST(GltfReader, ReadsTextureOnceDespiteMissingIndices) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  const std::string textured = R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})";
  const std::string missing =
      R"({"extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseTexture":{"texCoord":0}}}})";
  const std::string image = image_of({{255, 0, 0, 255}});
  const auto mesh = read_mesh(text_bytes(square_gltf(textured + "," + missing + "," + textured, {image})));
  ASSERT_TRUE(mesh) << to_string(mesh.error());
  EXPECT_EQ(mesh->mesh.textures.size(), 1U);
  ASSERT_GE(mesh->mesh.materials.size(), 3U);
  EXPECT_EQ(mesh->mesh.materials[2].texture, 0U);
}

TEST(GltfReader, LeavesOutWebpSourcesOutOfRange) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  for (const std::string source : {"1e300", "-1e300", "4294967296.0", "-7"}) {
    std::string gltf =
        square_gltf(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})", {image_of({{255, 0, 0, 255}})});
    const std::string texture = R"("source":0})";
    ASSERT_NE(gltf.find(texture), std::string::npos);
    gltf.replace(gltf.find(texture), texture.size(),
                 R"("source":0,"extensions":{"EXT_texture_webp":{"source":)" + source + "}}}");
    const auto mesh = read_mesh(text_bytes(gltf));
    ASSERT_TRUE(mesh) << source << ": " << to_string(mesh.error());
    EXPECT_TRUE(mesh->mesh.textures.empty()) << source;
    ASSERT_EQ(mesh->warnings.size(), 1U) << source;
    EXPECT_EQ(mesh->warnings[0], "left out: the texture texture 0, whose image does not exist");
  }
}

TEST(GltfReader, ReadsSpecularGlossiness) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  const std::string material = R"({"extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[1,0.5,1,1],)"
                               R"("diffuseTexture":{"index":0},"glossinessFactor":0.25}}})";
  const auto columns = columns_of(square_gltf(material, {image_of({{255, 0, 0, 255}, {0, 255, 0, 255}})}));
  ASSERT_EQ(columns.size(), 4U);
  EXPECT_EQ(columns[0].colour, (Rgba8{255, 0, 0, 255}));
  EXPECT_EQ(columns[3].colour, (Rgba8{0, 188, 0, 255}));
  EXPECT_EQ(columns[0].roughness, 0.75F);
  EXPECT_EQ(columns[0].metalness, 0.0F);
}

TEST(GltfReader, NamesUnsupportedVersions) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  for (const std::string text :
       {R"({"asset": {"version": "1.0"}, "scene": "s", "scenes": {"s": {"nodes": []}}, "nodes": {}, "meshes": {}})",
        R"({"asset": {"version": "1.0"}, "nodes": [], "meshes": []})"}) {
    const auto read = read_mesh(text_bytes(text));
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::Unsupported);
    EXPECT_NE(read.error().message.find("glTF 1.0 is not supported"), std::string::npos) << read.error().message;
  }
  const std::string binary("glTF\x01\0\0\0\x20\0\0\0\x0C\0\0\0\0\0\0\0{\"a\":1}     ", 32);
  const auto read = read_mesh(text_bytes(binary));
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("glTF 1.0 is not supported"), std::string::npos) << read.error().message;
}

/// Returns a staircase of three types, with occlusion in its corners.
Scene scene_of_stairs() {
  Scene scene;
  SceneGrid grid;
  std::vector<VoxelType> types;
  for (const Rgba8 colour : {Rgba8{200, 30, 30, 255}, Rgba8{30, 200, 30, 255}, Rgba8{30, 30, 200, 255}}) {
    VoxelProperties type;
    type.colour = colour;
    types.push_back(*scene.types.find_or_add(type));
  }
  for (int i = 0; i < 8 * 8 * 8; ++i) {
    const IVec3 at(i % 8, i / 8 % 8, i / 64);
    if (at.y <= at.x) grid.grid.set(at, types[static_cast<std::size_t>((at.x + at.z) % 3)]);
  }
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  return scene;
}

TEST(GltfReader, IgnoresOcclusionColoursOfQuoinFiles) {
  const auto meshes = mesh_scene(scene_of_stairs());
  ASSERT_TRUE(meshes);
  const auto folder = std::filesystem::temp_directory_path() / "quoin_gltf_look_test";
  std::filesystem::create_directories(folder);
  for (const FileFormat format : {FileFormat::Glb, FileFormat::Obj}) {
    if (!can(format, FormatCapability::Read)) continue;
    const auto path = folder / ("stairs" + std::string(format_info(format).extension));
    ASSERT_TRUE(write_mesh(*meshes, path));
    LoadOptions options;
    options.mesh.voxel_size = 1.0;
    options.mesh.surface = SurfaceVoxels::None;
    const auto loaded = load_scene(path, options);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(loaded->scene.types.size(), 4U) << "air and the three types in " << path;
    EXPECT_EQ(loaded->scene.voxel_count(), 8 * 36) << path;
  }
  std::filesystem::remove_all(folder);
}

/// A tetrahedron with a corner at the origin and a colour per corner, encoded by Draco 1.5.
constexpr const char* kDracoTetrahedron =
    "RFJBQ08CAgEBAAAABAQBAwAAAS8BARD/AmZAAv8AAAAAAAEACQMAAAIBAgIEAAEBAQEBAAMDARABMAMAUIIkkQQAAAAA/wcAAAAAAAAAAAAAAAAA"
    "AAAAgD8LAQEBAAMDASABIAMA8IOvECIAAAAA/wAAAA==";

std::string draco_gltf(int vertices, const std::string& code) {
  return R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_draco_mesh_compression"],)"
         R"("extensionsRequired":["KHR_draco_mesh_compression"],"buffers":[{"byteLength":115,)"
         R"("uri":"data:application/octet-stream;base64,)" +
         code +
         R"("}],"bufferViews":[{"buffer":0,"byteLength":115}],)"
         R"("accessors":[{"componentType":5126,"count":)" +
         std::to_string(vertices) +
         R"(,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},)"
         R"({"componentType":5121,"normalized":true,"count":4,"type":"VEC4"},)"
         R"({"componentType":5123,"count":12,"type":"SCALAR"}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,)"
         R"("COLOR_0":1},"indices":2,"extensions":{"KHR_draco_mesh_compression":{"bufferView":0,)"
         R"("attributes":{"POSITION":0,"COLOR_0":1}}}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0})";
}

TEST(GltfReader, ReadsDraco) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  const auto read = read_mesh(text_bytes(draco_gltf(4, kDracoTetrahedron)));
  if (!triangles::has_draco()) {
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::Unsupported);
    EXPECT_NE(read.error().message.find("libdraco-dev"), std::string::npos) << read.error().message;
    return;
  }
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->mesh.triangles.size(), 4U);
  double volume = 0.0;
  for (const auto& t : read->mesh.triangles) {
    const auto& p = read->mesh.positions;
    volume += glm::dot(p[t[0]], glm::cross(p[t[1]], p[t[2]])) / 6.0;
  }
  EXPECT_NEAR(volume, 1.0 / 6.0, 1e-3);
  std::set<std::array<float, 3>> colours;
  for (const glm::vec4& c : read->mesh.colours) colours.insert({c.r, c.g, c.b});
  EXPECT_EQ(colours, (std::set<std::array<float, 3>>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}));
}

TEST(GltfReader, RefusesDracoThatContradictsTheFile) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  if (!triangles::has_draco()) GTEST_SKIP() << "the build has no Draco";
  EXPECT_EQ(read_mesh(text_bytes(draco_gltf(5, kDracoTetrahedron))).error().code, ErrorCode::BadFormat);
  EXPECT_EQ(read_mesh(text_bytes(draco_gltf(2'000'000'000, kDracoTetrahedron))).error().code, ErrorCode::BadFormat);
  std::string broken = kDracoTetrahedron;
  for (std::size_t at = 16; at < broken.size() - 4; at += 7) {
    std::string other = broken;
    other[at] = other[at] == 'A' ? '/' : 'A';
    // An error or a mesh, but no crash.
    (void)read_mesh(text_bytes(draco_gltf(4, other)));
  }
}

}  // namespace
}  // namespace quoin

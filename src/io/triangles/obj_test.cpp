#include <sys/resource.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <sstream>
#include <string>

#include "io/gltf/glb_for_tests.h"

namespace quoin {

namespace {

/// An OBJ file by its lines; indices count from 0.
struct ParsedObj {
  struct Corner {
    std::size_t position, texture, normal;
  };
  std::vector<DVec3> positions;
  std::vector<double> greys;
  std::vector<std::array<double, 2>> textures;
  std::vector<DVec3> normals;
  std::vector<std::array<Corner, 3>> faces;
  std::vector<std::size_t> material_of_face;  ///< index into `materials`
  std::vector<std::string> objects;
  std::vector<std::string> materials;
  std::string library;
};

void parse_line(const std::string& line, ParsedObj& obj) {
  std::istringstream in(line);
  std::string keyword;
  in >> keyword;
  DVec3 v(0.0);
  if (keyword == "v" || keyword == "vn") in >> v.x >> v.y >> v.z;
  if (keyword == "v") obj.positions.push_back(v);
  if (keyword == "vn") obj.normals.push_back(v);
  if (double grey = 0; keyword == "v" && in >> grey) obj.greys.push_back(grey);
  if (keyword == "vt") {
    in >> v.x >> v.y;
    obj.textures.push_back({v.x, v.y});
  }
  if (keyword == "o") obj.objects.push_back(line.substr(2));
  if (keyword == "usemtl") obj.materials.push_back(line.substr(7));
  if (keyword == "mtllib") obj.library = line.substr(7);
  if (keyword != "f") return;
  std::array<ParsedObj::Corner, 3> face{};
  char slash = '/';
  for (auto& corner : face) {
    in >> corner.position >> slash >> corner.texture >> slash >> corner.normal;
    --corner.position, --corner.texture, --corner.normal;
  }
  obj.faces.push_back(face);
  obj.material_of_face.push_back(obj.materials.size() - 1);
}

std::string text_of(const std::filesystem::path& path) {
  const auto bytes = read_file(path).value_or(std::vector<std::byte>{});
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

ParsedObj parse_obj(const std::filesystem::path& path) {
  ParsedObj obj;
  std::istringstream lines(text_of(path));
  for (std::string line; std::getline(lines, line);) parse_line(line, obj);
  return obj;
}

/// Returns the value of a material's line that starts with `key`.
std::string value_in(const std::string& library, const std::string& material, const std::string& key) {
  const std::size_t begin = library.find("newmtl " + material + "\n");
  const std::size_t at = library.find("\n" + key, begin) + 1 + key.size();
  return begin == std::string::npos ? "" : library.substr(at, library.find('\n', at) - at);
}

class Obj : public ::testing::Test {
 protected:
  void SetUp() override {
    VoxelProperties stone;
    stone.colour = {90, 80, 70, 255};
    VoxelProperties glass;
    glass.colour = {10, 200, 220, 90};
    glass.visibility = Visibility::Transparent;
    VoxelProperties lamp;
    lamp.colour = {250, 240, 10, 255};
    lamp.emission = 3.0F;
    SceneGrid grid;
    grid.name = "a crane";
    grid.grid.fill_box({{0, 0, 0}, {4, 1, 1}}, *scene_.types.add(stone));
    grid.grid.set({0, 1, 0}, *scene_.types.add(glass));
    grid.grid.set({3, 1, 0}, *scene_.types.add(lamp));
    grid.pivot = {2, 1, 0.5};
    grid_ = scene_.add_grid(std::move(grid));
  }

  Instance& place(DVec3 position) {
    Instance instance;
    instance.grid = grid_;
    instance.position = position;
    return scene_.edit(scene_.add_instance(instance));
  }

  ParsedObj write(bool occlusion = true) {
    meshes_ = *mesh_scene(scene_, {.mesh = {.bake_occlusion = occlusion}});
    const auto bytes = write_mesh(meshes_, folder_.file("my model.obj"));
    EXPECT_TRUE(bytes) << to_string(bytes.error());
    return parse_obj(folder_.file("my model.obj"));
  }

  Scene scene_;
  GridHandle grid_;
  SceneMeshes meshes_;
  TestFolder folder_{std::string("obj_") + ::testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(Obj, KeepsWindingsOutwardInMirroredObjects) {
  place({0, 0, 0});
  Instance& turned = place({100, 5, -7.25});
  turned.rotation = glm::normalize(DQuat(0.3, 0.5, -0.1, 0.7));
  turned.mirrored = true;
  turned.voxel_size = 0.1;
  const ParsedObj obj = write();
  EXPECT_EQ(obj.objects, (std::vector<std::string>{"a_crane", "a_crane_2"}));
  EXPECT_EQ(static_cast<std::int64_t>(obj.faces.size()), 2 * meshes_.stats.triangles);
  for (const auto& face : obj.faces) {
    const DVec3 a = obj.positions.at(face[0].position);
    const DVec3 across = glm::cross(obj.positions.at(face[1].position) - a, obj.positions.at(face[2].position) - a);
    ASSERT_GT(glm::length(across), 0.0);
    EXPECT_NEAR(glm::dot(glm::normalize(across), obj.normals.at(face[0].normal)), 1.0, 1e-3);
  }
  DBox second;
  for (std::size_t i = obj.positions.size() / 2; i < obj.positions.size(); ++i) second.extend(obj.positions[i]);
  const DBox all = scene_.bounds();
  EXPECT_NEAR(second.max.x, all.max.x, 1e-5);
  EXPECT_NEAR(second.max.y, all.max.y, 1e-5);
}

TEST_F(Obj, TextureCoordinatesMatchPalette) {
  place({0, 0, 0});
  const ParsedObj obj = write();
  const PngImage palette = *decode_png(*read_file(folder_.file("my model_palette.png")));
  std::set<std::array<int, 3>> seen;
  for (const auto& face : obj.faces) {
    const auto uv = obj.textures.at(face[0].texture);
    const auto x = static_cast<std::size_t>(uv[0] * palette.width);
    const auto y = static_cast<std::size_t>((1.0 - uv[1]) * palette.height);
    const std::uint8_t* texel = palette.pixels.data() + (y * palette.width + x) * 4;
    seen.insert({texel[0], texel[1], texel[2]});
  }
  EXPECT_EQ(seen, (std::set<std::array<int, 3>>{{90, 80, 70}, {10, 200, 220}, {250, 240, 10}}));
}

TEST_F(Obj, TexturesOpaqueBlocksWithAtlas) {
  place({0, 0, 0});
  place({50, 0, 0});
  meshes_ = mesh_scene(scene_, {.atlas = true}).value();
  const auto path = folder_.file("my model.obj");
  ASSERT_TRUE(write_mesh(meshes_, path).has_value());
  const ParsedObj obj = parse_obj(path);
  const std::string library = text_of(folder_.file("my model.mtl"));
  EXPECT_NE(library.find("map_Kd my model_atlas.png\n"), std::string::npos);
  EXPECT_NE(library.find("map_Kd my model_palette.png\n"), std::string::npos) << "of what glows";
  const PngImage atlas = *decode_png(*read_file(folder_.file("my model_atlas.png")));
  std::set<std::array<int, 3>> seen;
  for (const auto& face : obj.faces) {
    const auto uv = obj.textures.at(face[0].texture);
    if (face[0].texture < meshes_.types.size() - 1) continue;
    const auto x = static_cast<std::size_t>(uv[0] * atlas.width);
    const auto y = static_cast<std::size_t>((1.0 - uv[1]) * atlas.height);
    const std::uint8_t* texel = atlas.pixels.data() + (y * atlas.width + x) * 4;
    seen.insert({texel[0], texel[1], texel[2]});
  }
  EXPECT_TRUE(seen.contains({90, 80, 70}));
  const auto files = mesh_files(meshes_, path).value();
  for (const auto& file : files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  EXPECT_EQ(files.size(), folder_.count());
}

TEST_F(Obj, WritesMaterialsToLibrary) {
  place({0, 0, 0});
  const ParsedObj obj = write();
  EXPECT_EQ(obj.library, "my model.mtl");
  const std::string library = text_of(folder_.file("my model.mtl"));
  ASSERT_EQ(obj.materials.size(), 3U);
  for (const std::string& name : obj.materials) EXPECT_NE(library.find("newmtl " + name + "\n"), std::string::npos);
  EXPECT_NE(library.find("map_Kd my model_palette.png\n"), std::string::npos);
  EXPECT_NE(library.find("Ke 3 3 3\nmap_Ke my model_emissive.png\n"), std::string::npos);
  EXPECT_TRUE(decode_png(*read_file(folder_.file("my model_emissive.png"))));
  const auto files = mesh_files(meshes_, folder_.file("my model.obj")).value();
  EXPECT_EQ(files.front(), folder_.file("my model.obj"));
  EXPECT_EQ(files.size(), 4U);
  for (const auto& file : files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  EXPECT_EQ(folder_.count(), 4U);
}

TEST_F(Obj, WritesGlassAlphaPerMaterial) {
  place({0, 0, 0});
  write();
  const std::string library = text_of(folder_.file("my model.mtl"));
  EXPECT_EQ(library.find("map_d"), std::string::npos);
  EXPECT_EQ(library.find("imfchan"), std::string::npos);
  const auto at = library.find("newmtl voxels_transparent\n");
  ASSERT_NE(at, std::string::npos);
  const std::string glass = library.substr(at, library.find("\n\n", at) - at);
  EXPECT_NE(glass.find("\nd 0.454\n"), std::string::npos) << glass;
  EXPECT_NE(glass.find("\nTf 0.648 "), std::string::npos) << glass;
  EXPECT_NE(glass.find("\nNi 1.5"), std::string::npos) << glass;
  const PngImage palette = *decode_png(*read_file(folder_.file("my model_palette.png")));
  for (std::size_t i = 7; i < 16; i += 4) EXPECT_EQ(palette.pixels[i], 255) << "some clients multiply it";
}

TEST_F(Obj, WritesOcclusionAsVertexColoursIfPresent) {
  place({0, 0, 0});
  const ParsedObj shaded = write();
  EXPECT_EQ(shaded.greys.size(), shaded.positions.size());
  EXPECT_EQ(std::set<double>(shaded.greys.begin(), shaded.greys.end()), (std::set<double>{0.75, 1.0}));
  EXPECT_TRUE(write(false).greys.empty());
}

// Each triangle shows the texels of its voxel's face at points within it.
TEST_F(Obj, RepeatsTexturesOnFaces) {
  AlphaImage noise{16, 16, {}};
  for (int i = 0; i < 4 * 16 * 16; ++i) noise.rgba.push_back(i % 4 == 3 ? 255 : static_cast<std::uint8_t>(i * i % 251));
  AlphaImage leaves = noise;
  leaves.rgba[3] = 0;
  const Texture bark = Texture::from_image("bark/1", noise).value();
  const VoxelFace turned{.texture = bark, .turn = 1, .mirrored = true, .tint = {255, 188, 0, 255}};
  const auto log = scene_.types.add({.name = "log", .faces = {{bark}, turned, {.texture = bark, .turn = 2}}}).value();
  VoxelProperties leaf{.name = "leaf", .visibility = Visibility::Transparent};
  leaf.faces = VoxelFace{.texture = Texture::from_image("leaf", leaves).value(), .alpha = FaceAlpha::Cutout};
  const auto bush = scene_.types.add(leaf).value();
  Grid& grid = scene_.edit(grid_).grid;
  grid.fill_box({{-9, 0, 0}, {-2, 5, 3}}, log);
  grid.fill_box({{-9, 5, 0}, {-2, 7, 3}}, bush);
  scene_.edit(grid_).pivot = DVec3(0.0);
  place({0, 0, 0});
  const ParsedObj obj = write();
  const std::string library = text_of(folder_.file("my model.mtl"));
  EXPECT_EQ(library.find("Kd 1 0.7"), std::string::npos) << "programs that ignore Kd would lose the tint";
  int points = 0;
  // Compares an image on a triangle with the face of its voxel. Coordinates start at the image's top left corner.
  const auto expect_face = [&](const std::array<DVec3, 3>& corner, const std::array<glm::dvec2, 3>& uv,
                               const std::vector<std::uint8_t>& rgba) {
    const Direction direction =
        nearest_direction(glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0])));
    for (const auto& [a, b] : {std::pair{0.61, 0.23}, {0.11, 0.57}, {0.29, 0.05}}) {
      const double c = 1.0 - a - b;
      const DVec3 at = a * corner[0] + b * corner[1] + c * corner[2];
      const glm::dvec2 in_image = glm::fract(a * uv[0] + b * uv[1] + c * uv[2]) * 16.0;
      const IVec3 voxel = voxel_of(at - DVec3(normal_of(direction)) * 0.5);
      const VoxelFaces& faces = scene_.types[grid.get(voxel)].faces;
      ASSERT_FALSE(faces.empty());
      const auto expected = texel_at(faces[direction], direction, at - DVec3(voxel), 0);
      const auto x = static_cast<std::size_t>(in_image.x);
      const std::uint8_t* texel = rgba.data() + (static_cast<std::size_t>(in_image.y) * 16 + x) * 4;
      EXPECT_EQ((Rgba8{texel[0], texel[1], texel[2]}), srgb_colour(Vec3(expected[0], expected[1], expected[2])));
      EXPECT_EQ(texel[3], std::lround(expected[3] * 255.0F));
      ++points;
    }
  };
  for (std::size_t i = 0; i < obj.faces.size(); ++i) {
    const std::string& material = obj.materials[obj.material_of_face[i]];
    if (material.find("_texture_") == std::string::npos) continue;
    const std::string file = value_in(library, material, "map_Kd ");
    EXPECT_EQ(value_in(library, material, "Kd "), "1 1 1");
    std::array<DVec3, 3> corners;
    std::array<glm::dvec2, 3> uv;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& at = obj.faces[i][k];
      corners[k] = obj.positions.at(at.position);
      uv[k] = {obj.textures.at(at.texture)[0], 1.0 - obj.textures.at(at.texture)[1]};
    }
    expect_face(corners, uv, decode_png(*read_file(folder_.file(file)))->pixels);
  }
  EXPECT_GT(points, 50);
  const auto alpha = decode_png(*read_file(folder_.file("my model_alpha_1.png")));
  ASSERT_TRUE(alpha);
  EXPECT_EQ((std::vector(alpha->pixels.begin(), alpha->pixels.begin() + 8)),
            (std::vector<std::uint8_t>{0, 0, 0, 255, 255, 255, 255, 255}));
  EXPECT_NE(library.find("\nmap_d my model_alpha_1.png\n"), std::string::npos);
  EXPECT_EQ(library.find("my model_alpha_2.png"), std::string::npos);
  const TestFolder second("obj_read_back");  // readers end the name of a library at a space
  ASSERT_TRUE(write_mesh(meshes_, second.file("model.obj")));
  if (const auto loaded = read_mesh(second.file("model.obj")); loaded) {
    const TriangleMesh& mesh = loaded->mesh;
    const int written = std::exchange(points, 0);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const MeshMaterial& material = mesh.materials[mesh.material_of[i]];
      if (material.name.find("_texture_") == std::string::npos) continue;
      const auto& [p, q, r] = mesh.triangles[i];
      EXPECT_EQ(material.colour, glm::vec4(1.0F));
      expect_face({mesh.positions[p], mesh.positions[q], mesh.positions[r]},
                  {mesh.uvs[3 * i], mesh.uvs[3 * i + 1], mesh.uvs[3 * i + 2]},
                  mesh.textures[material.texture.value()].image.rgba);
    }
    EXPECT_EQ(points, written);
  } else {
    EXPECT_EQ(loaded.error().code, ErrorCode::Unsupported) << to_string(loaded.error());
  }
  const auto files = mesh_files(meshes_, folder_.file("my model.obj")).value();
  for (const auto& file : files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  EXPECT_EQ(files.size(), folder_.count());
}

// Programs ask before they replace the files that are listed.
TEST_F(Obj, ListsImagesOfShapes) {
  const AlphaImage image{16, 16, std::vector<std::uint8_t>(std::size_t{16} * 16 * 4, 255)};
  ShapeElement post{.min = {4, 0, 4}, .max = {12, 16, 12}};
  post.faces.fill({.face = VoxelFace{.texture = Texture::from_image("t", image).value()}});
  const auto type = scene_.types.add({.name = "post", .shapes = VoxelShape::from_elements({post}).value()});
  scene_.edit(grid_).grid.set({0, 9, 0}, type.value());
  place({0, 0, 0});
  meshes_ = *mesh_scene(scene_);
  const auto path = folder_.file("post.obj");
  ASSERT_TRUE(write_mesh(meshes_, path));
  EXPECT_TRUE(std::filesystem::exists(folder_.file("post_texture_1.png")));
  EXPECT_EQ(mesh_files(meshes_, path).value().size(), folder_.count());
}

// A beam that reaches into both neighbours, with the textures of its type.
TEST_F(Obj, PutsTexturesOfLargeShapesIntoOneImage) {
  const AlphaImage image{16, 16, std::vector<std::uint8_t>(std::size_t{16} * 16 * 4, 255)};
  const ShapeElement beam{.min = {-14, 4, 4}, .max = {30, 12, 12}};
  VoxelProperties type{.name = "beam", .faces = VoxelFace{.texture = Texture::from_image("t", image).value()}};
  type.shapes = VoxelShape::from_elements({beam}).value();
  scene_.edit(grid_).grid.set({0, 9, 0}, scene_.types.add(type).value());
  place({0, 0, 0});
  meshes_ = *mesh_scene(scene_, {.mesh = {.merge = false}});
  const auto bytes = write_mesh(meshes_, folder_.file("beam.obj"), {.textures_in = TexturesIn::Atlas});
  ASSERT_TRUE(bytes) << to_string(bytes.error());
}

TEST_F(Obj, PutsTexturesIntoOneImage) {
  Grid& grid = scene_.edit(grid_).grid;
  for (std::uint8_t i = 0; i < 6; ++i) {
    const bool is_leaf = i % 2 == 1;
    const int size = 16 << (i % 3);
    AlphaImage image{size, size, {}};
    for (int k = 0; k < size * size; ++k) {
      image.rgba.insert(image.rgba.end(), {200, 30, std::uint8_t(20 * i), std::uint8_t(is_leaf ? 140 + i : 255)});
    }
    VoxelFace face{.texture = Texture::from_image("t", image).value(), .tint = {255, 255, std::uint8_t(255 - i)}};
    if (is_leaf) face.alpha = i == 1 ? FaceAlpha::Cutout : FaceAlpha::Translucent;
    VoxelProperties type{.name = "t"};
    if (is_leaf) type.visibility = Visibility::Transparent;
    type.faces = face;
    grid.fill_box({{3 * i, 5, 0}, {3 * i + 2, 6, 2}}, scene_.types.add(type).value());
  }
  scene_.edit(grid_).pivot = DVec3(0.0);
  place({0, 0, 0});
  meshes_ = *mesh_scene(scene_, {.atlas = true});
  const MeshFileOptions options{.textures_in = TexturesIn::Atlas};
  const auto path = folder_.file("my model.obj");
  ASSERT_TRUE(write_mesh(meshes_, path, options));
  const auto files = mesh_files(meshes_, path, options).value();
  for (const auto& file : files) EXPECT_TRUE(std::filesystem::exists(file)) << file;
  EXPECT_EQ(files.size(), folder_.count());
  const ParsedObj obj = parse_obj(path);
  const std::string library = text_of(folder_.file("my model.mtl"));
  const PngImage image = *decode_png(*read_file(folder_.file("my model_texture_1.png")));
  const PngImage alpha = *decode_png(*read_file(folder_.file("my model_alpha_1.png")));
  EXPECT_FALSE(std::filesystem::exists(folder_.file("my model_texture_2.png")));
  std::set<std::string> materials;
  for (std::size_t i = 0; i < obj.faces.size(); ++i) {
    const std::string& material = obj.materials[obj.material_of_face[i]];
    if (value_in(library, material, "map_Kd ") != "my model_texture_1.png") continue;
    materials.insert(material);
    DVec3 at(0.0);
    glm::dvec2 uv(0.0);
    std::array<DVec3, 3> corner;
    for (std::size_t k = 0; k < 3; ++k) {
      corner[k] = obj.positions.at(obj.faces[i][k].position);
      at += corner[k] / 3.0;
      uv += glm::dvec2(obj.textures.at(obj.faces[i][k].texture)[0], obj.textures.at(obj.faces[i][k].texture)[1]) / 3.0;
    }
    const DVec3 normal = glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
    const VoxelType type = grid.get(voxel_of(at - normal * 0.5));
    const Rgba8 expected = scene_.types[type].colour;
    const auto x = static_cast<std::size_t>(uv.x * image.width);
    const auto y = static_cast<std::size_t>((1.0 - uv.y) * image.height);
    const std::uint8_t* const pixel = image.pixels.data() + 4 * (y * image.width + x);
    ASSERT_EQ((Rgba8{pixel[0], pixel[1], pixel[2]}), (Rgba8{expected.r, expected.g, expected.b}));
    ASSERT_EQ(alpha.pixels[4 * (y * image.width + x)], pixel[3]);
    ASSERT_EQ(pixel[3] == 255, scene_.types[type].visibility == Visibility::Opaque);
  }
  EXPECT_EQ(materials.size(), 3U) << "opaque, cutout and translucent";
}

// Lowers the number of files that the process may open.
class OpenFiles {
 public:
  explicit OpenFiles(int more) {
    EXPECT_EQ(::getrlimit(RLIMIT_NOFILE, &before_), 0);
    const int next = ::dup(0);
    EXPECT_GE(next, 0);
    ::close(next);
    const rlimit lower{static_cast<rlim_t>(next + more), before_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_NOFILE, &lower), 0);
  }
  ~OpenFiles() { ::setrlimit(RLIMIT_NOFILE, &before_); }
  OpenFiles(const OpenFiles&) = delete;
  OpenFiles& operator=(const OpenFiles&) = delete;

 private:
  rlimit before_{};
};

TEST_F(Obj, NeedsFewOpenFilesForManyTextures) {
  constexpr int kTextures = 40;
  for (int i = 0; i < kTextures; ++i) {
    AlphaImage image{16, 16, std::vector<std::uint8_t>(std::size_t{16} * 16 * 4, 255)};
    image.rgba[0] = static_cast<std::uint8_t>(i);
    const auto texture = Texture::from_image("t", image);
    const auto type = scene_.types.add({.name = "block", .faces = texture.value()});
    scene_.edit(grid_).grid.set({i, 9, 0}, type.value());
  }
  place({0, 0, 0});
  meshes_ = *mesh_scene(scene_);
  {
    const OpenFiles few(10);
    const auto bytes = write_mesh(meshes_, folder_.file("out.obj"));
    ASSERT_TRUE(bytes) << to_string(bytes.error());
  }
  EXPECT_EQ(folder_.count(), kTextures + 4U);  // .obj, .mtl, the palette and emission
  EXPECT_TRUE(decode_png(*read_file(folder_.file("out_texture_40.png"))));
}

TEST_F(Obj, FailuresLeaveNoFile) {
  place({0, 0, 0});
  const SceneMeshes meshes = *mesh_scene(scene_);
  EXPECT_FALSE(write_mesh(meshes, folder_.file("out.obj"), {}, [](double) { return false; }));
  EXPECT_FALSE(write_mesh(meshes, folder_.file("none/out.obj")));
  EXPECT_EQ(folder_.count(), 0U);
}

TEST_F(Obj, WritesEmptySceneWithoutObjects) {
  EXPECT_TRUE(write().objects.empty());
}

}  // namespace

}  // namespace quoin

// The materials of vertices of smooth meshes, and their weights.

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/hash.h>
#include <quoin/mesh/smooth_mesh.h>

#include "core/srgb.h"
#include "mesh/smooth/level_cells.h"
#include "mesh/smooth/smooth_oracle.h"
#include "mesh/surface/face_materials.h"

namespace quoin {
namespace {

Texture plain_texture(Rgba8 colour) {
  AlphaImage image{16, 16, {}};
  for (int i = 0; i < 16 * 16; ++i) image.rgba.insert(image.rgba.end(), {colour.r, colour.g, colour.b, 255});
  return Texture::from_image("plain", image).value();
}

VoxelType add_textured(VoxelRegistry& types, Rgba8 sides, Rgba8 top, Rgba8 bottom) {
  VoxelProperties type;
  type.faces = VoxelFaces({plain_texture(sides)}, {plain_texture(top)}, {plain_texture(bottom)});
  return types.add(type).value();
}

// Types 1 to `count`; those with odd numbers have textures.
VoxelRegistry types_with_textures(int count) {
  VoxelRegistry types;
  for (int i = 1; i <= count; ++i) {
    const auto shade = [&](int k) { return static_cast<std::uint8_t>(mix_bits(static_cast<unsigned>(8 * i + k))); };
    const auto colour = [&](int k) { return Rgba8{shade(k), shade(k + 1), shade(k + 2), 255}; };
    if (i % 2 == 1) {
      add_textured(types, colour(0), colour(3), colour(6));
    } else {
      (void)types.add({.name = std::to_string(i), .colour = colour(0)}).value();
    }
  }
  return types;
}

// Hills with steps and random materials, over 3x2x3 chunks around the origin.
DensityGrid random_field(unsigned seed, int types, int edge) {
  DensityGrid field;
  field.edit({IVec3(-16, -30, -16), IVec3(80, 22, 80)}, [&](IVec3 p, DensitySample) {
    const double height = 9.0 * std::sin(0.11 * p.x + seed) * std::cos(0.09 * p.z) + 3.0 * std::sin(0.7 * p.x + p.z);
    const IVec3 at = voxel_of(DVec3(p) / static_cast<double>(edge));
    const std::uint32_t bits =
        mix_bits(mix_bits(mix_bits(static_cast<unsigned>(at.x) ^ seed) + static_cast<unsigned>(at.y)) +
                 static_cast<unsigned>(at.z));
    return DensitySample{static_cast<float>(0.6 * (p.y - height)),
                         static_cast<VoxelType>(1 + bits % static_cast<unsigned>(types))};
  });
  return field;
}

struct Vertex {
  Vec3 position{0.0F};  // relative to the chunk of its cell
  Vec3 normal{0.0F};
  VertexMaterials materials;
  LinearRgba16 albedo{};

  bool operator==(const Vertex&) const = default;
};

int level_of(IVec3 chunk, unsigned seed) {
  return static_cast<int>(mix_bits(static_cast<unsigned>(chunk.x * 9 + chunk.y * 3 + chunk.z) + seed) % 4);
}

using Mixed = BlockVector<VertexMaterials>;

// As smooth::materials_of, but wrong: with the level of the chunk for all cells.
BlockVector<CellMaterial> materials_by_own_level(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                                                 const SurfaceMaterials& materials, const SmoothChunkMesh& mesh,
                                                 Mixed* mixed) {
  BlockVector<CellMaterial> of_vertex;
  mixed->resize(mesh.cells.size());
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) {
    const IVec3 first = smooth::ChunkLevels(options.levels).cell_of(mesh.cells[i]).first;
    of_vertex.push_back(materials.of_vertex(chunks, first, options.levels[13], mesh.normals[i], &(*mixed)[i]));
  }
  return of_vertex;
}

// Calls `visit(cell's chunk, cell's name there, vertex)` for all vertices of all chunks of a field with random levels.
// `materials_of`: smooth::materials_of.
template <class MaterialsOf, class Visit>
void for_each_vertex(const DensityGrid& field, const VoxelRegistry& types, unsigned seed,
                     const MaterialsOf& materials_of, const Visit& visit) {
  const SurfaceMaterials materials(types);
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  for (const IVec3 chunk : field.chunks()) {
    SmoothOptions options;
    options.occlusion.method = SmoothOcclusion::None;
    for (int i = 0; i < 27; ++i) {
      options.levels[static_cast<std::size_t>(i)] =
          static_cast<std::uint8_t>(level_of(chunk + Neighbourhood::offset(i), seed));
    }
    const DensityNeighbourhood chunks = field.neighbourhood(chunk);
    mesher.mesh(chunks, options, mesh);
    Mixed mixed;
    const auto of_vertex = materials_of(chunks, options, materials, mesh, &mixed);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const SmoothCell name = mesh.cells[i];
      const IVec3 offset = name.chunk_offset();
      const Vec3 position = mesh.positions[i] - Vec3(offset * kChunkEdge);
      visit(chunk + offset, name.bits & ~(7U << SmoothCell::kPreviousShift),
            Vertex{position, mesh.normals[i], mixed[i], of_vertex[i].albedo});
    }
  }
}

struct Shared {
  std::size_t vertices = 0;  // that occur in several chunks
  std::size_t unequal = 0;
  int most = 0;  // greatest difference of colours, of 255
};

template <class MaterialsOf>
Shared shared_of(const DensityGrid& field, const VoxelRegistry& types, unsigned seed, const MaterialsOf& materials_of) {
  std::map<std::array<std::int64_t, 4>, Vertex> known;
  Shared shared;
  for_each_vertex(field, types, seed, materials_of, [&](IVec3 chunk, std::uint32_t name, const Vertex& vertex) {
    const auto [found, is_new] = known.try_emplace({chunk.x, chunk.y, chunk.z, name}, vertex);
    if (is_new) return;
    ++shared.vertices;
    shared.unequal += found->second == vertex ? 0 : 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto byte = [&](const Vertex& of) {
        return int{SrgbEncoder::shared()(static_cast<float>(of.albedo[k]) / 65'535.0F)};
      };
      shared.most = std::max(shared.most, std::abs(byte(vertex) - byte(found->second)));
    }
  });
  return shared;
}

TEST(VertexMaterials, SharedVerticesAreEqualInAllChunks) {
  for (const unsigned seed : {1U, 2U}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const VoxelRegistry types = types_with_textures(9);
    const DensityGrid field = random_field(seed, 9, seed == 1 ? 1 : 5);
    const Shared shared = shared_of(field, types, seed, smooth::materials_of);
    EXPECT_GT(shared.vertices, 500U);
    EXPECT_EQ(shared.unequal, 0U);
    EXPECT_LE(shared.most, 2) << "at seams";
  }
}

// The comparison above notices chunks that mix the materials of their neighbours' vertices by their own level.
TEST(VertexMaterials, SeamsWouldBeSeenWithLevelsOfTheirOwn) {
  const VoxelRegistry types = types_with_textures(9);
  const Shared shared = shared_of(random_field(2, 9, 5), types, 2, materials_by_own_level);
  EXPECT_GT(shared.unequal, 100U);
  EXPECT_GT(shared.most, 2);
}

TEST(VertexMaterials, AreTheMostFrequentWithAllOfTheWeight) {
  const VoxelRegistry types = types_with_textures(9);
  std::size_t full = 0;
  for_each_vertex(random_field(1, 9, 1), types, 1, smooth::materials_of,
                  [&](IVec3, std::uint32_t, const Vertex& vertex) {
                    const auto& [names, weights] = vertex.materials;
                    ASSERT_EQ(weights[0] + weights[1] + weights[2] + weights[3], 255);
                    full += weights[3] != 0 ? 1 : 0;
                    for (std::size_t i = 1; i < names.size(); ++i) {
                      ASSERT_TRUE(weights[i] != 0 ? names[i - 1] < names[i] : names[i] == kAir);
                    }
                  });
  EXPECT_GT(full, 1'000U);
}

// Returns the weight of each material.
std::map<VoxelType, int> weights_of(const VertexMaterials& materials) {
  std::map<VoxelType, int> weights;
  for (std::size_t i = 0; i < VertexMaterials::kSlots; ++i) {
    if (materials.weights[i] != 0) weights[materials.types[i]] += materials.weights[i];
  }
  return weights;
}

SmoothMesh mesh_with_materials(const DensityGrid& field, const VoxelRegistry& types) {
  SmoothMeshOptions options;
  options.occlusion.method = SmoothOcclusion::None;
  options.materials = true;
  return build_smooth_mesh(field, types, options).value();
}

TEST(VertexMaterials, AlignedTrianglesHaveTheSameSlots) {
  const VoxelRegistry types = types_with_textures(4);
  SmoothMesh mesh = mesh_with_materials(random_field(3, 4, 3), types);
  const SmoothMesh before = mesh;
  align_materials(mesh);
  ASSERT_EQ(mesh.materials.size(), mesh.positions.size());
  ASSERT_EQ(mesh.indices.size(), before.indices.size());
  EXPECT_GT(mesh.positions.size(), before.positions.size());
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const std::uint32_t vertex = mesh.indices[i];
    const std::uint32_t former = before.indices[i];
    ASSERT_EQ(mesh.materials[vertex].types, mesh.materials[mesh.indices[i / 3 * 3]].types);
    ASSERT_EQ(weights_of(mesh.materials[vertex]), weights_of(before.materials[former]));
    ASSERT_EQ(mesh.positions[vertex], before.positions[former]);
    ASSERT_EQ(mesh.normals[vertex], before.normals[former]);
    ASSERT_EQ(mesh.albedo[vertex], before.albedo[former]);
  }
}

TEST(VertexMaterials, TrianglesOfManyMaterialsKeepTheHeaviest) {
  SmoothMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  mesh.normals.resize(3, {0, 1, 0});
  mesh.albedo.resize(3);
  mesh.types = {1, 2, 3};
  mesh.indices = {0, 2, 1};
  mesh.materials = {
      {{1, 2, 3, 4}, {100, 100, 30, 25}}, {{2, 5, 6, 0}, {200, 50, 5, 0}}, {{7, 0, 0, 0}, {255, 0, 0, 0}}};
  align_materials(mesh);
  const std::array<VoxelType, 4> kept{1, 2, 5, 7};
  EXPECT_EQ(mesh.materials[0], (VertexMaterials{kept, {155, 100, 0, 0}}));
  EXPECT_EQ(mesh.materials[1], (VertexMaterials{kept, {0, 205, 50, 0}}));
  EXPECT_EQ(mesh.materials[2], (VertexMaterials{kept, {0, 0, 0, 255}}));
}

LinearRgba16 encoded_as(Rgba8 colour) {
  return linear_colour_of(colour);
}

int farthest(const LinearRgba16& a, const LinearRgba16& b) {
  int most = 0;
  for (std::size_t k = 0; k < 4; ++k) most = std::max(most, std::abs(int{a[k]} - int{b[k]}));
  return most;
}

// The mean colour of a vertex is that of the textures which its slope shows.
TEST(VertexMaterials, AlbedoFollowsTheSlope) {
  constexpr Rgba8 kRock{120, 110, 100, 255};
  constexpr Rgba8 kGrass{40, 200, 60, 255};
  constexpr Rgba8 kEarth{90, 60, 30, 255};
  VoxelRegistry types;
  const VoxelType hill = add_textured(types, kRock, kGrass, kEarth);
  DensityGrid field;
  field.add_box({-9, -9, -9}, {9, 9, 9}, hill);
  const SmoothMesh mesh = mesh_with_materials(field, types);
  std::set<float> seen;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const float y = mesh.normals[i].y;
    if (std::abs(y) > 0.1F && std::abs(y) < 0.9F) continue;
    const Rgba8 expected = y > 0.9F ? kGrass : y < -0.9F ? kEarth : kRock;
    EXPECT_LE(farthest(mesh.albedo[i], encoded_as(expected)), 2) << "y " << y;
    seen.insert(y > 0.9F ? 1.0F : y < -0.9F ? -1.0F : 0.0F);
    EXPECT_EQ(mesh.materials[i], only_material(hill));
  }
  EXPECT_EQ(seen.size(), 3U);
}

// Without textures and without the option nothing changes.
TEST(VertexMaterials, MeshesWithoutTexturesHaveNone) {
  VoxelRegistry types;
  (void)types.add({.name = "a", .colour = {200, 0, 0}}).value();
  (void)types.add({.name = "b", .colour = {0, 100, 0}}).value();
  const DensityGrid field = random_field(5, 2, 3);
  SmoothMeshOptions options;
  options.occlusion.method = SmoothOcclusion::None;
  const SmoothMesh plain = build_smooth_mesh(field, types, options).value();
  EXPECT_TRUE(plain.materials.empty());
  const SmoothMesh with = mesh_with_materials(field, types);
  EXPECT_EQ(with.materials.size(), with.positions.size());
  EXPECT_EQ(with.albedo, plain.albedo);
  EXPECT_EQ(with.positions, plain.positions);
}

TEST(VertexMaterials, SharpColoursHaveOneMaterialPerVertex) {
  const VoxelRegistry types = types_with_textures(4);
  SmoothMeshOptions options;
  options.occlusion.method = SmoothOcclusion::None;
  options.materials = true;
  options.colours = SurfaceColours::Sharp;
  const SmoothMesh mesh = build_smooth_mesh(random_field(3, 4, 3), types, options).value();
  ASSERT_EQ(mesh.materials.size(), mesh.positions.size());
  for (std::size_t i = 0; i < mesh.types.size(); ++i) ASSERT_EQ(mesh.materials[i], only_material(mesh.types[i]));
}

TEST(VertexMaterials, SimplifiedMeshesKeepThem) {
  if (!can_simplify()) GTEST_SKIP() << "this build has no meshoptimizer";
  VoxelRegistry types = types_with_textures(4);
  DensityGrid field;
  field.add_sphere(DVec3(0.0), 14.0, 1);
  field.add_sphere({10.0, 0.0, 0.0}, 9.0, 3);
  SmoothMesh mesh = mesh_with_materials(field, types);
  const std::size_t before = mesh.positions.size();
  ASSERT_TRUE(simplify_smooth_mesh(mesh, 0.2F));
  EXPECT_LT(mesh.positions.size(), before);
  ASSERT_EQ(mesh.materials.size(), mesh.positions.size());
  for (std::size_t i = 0; i < mesh.materials.size(); ++i) {
    ASSERT_TRUE(weights_of(mesh.materials[i]).contains(mesh.types[i]));
  }
  align_materials(mesh);
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    ASSERT_EQ(mesh.materials[mesh.indices[i]].types, mesh.materials[mesh.indices[i / 3 * 3]].types);
  }
}

}  // namespace
}  // namespace quoin

// blocky/* of the workload specification: 62^3 interiors of padded 64^3 chunks, from the grid's own palette storage to
// complete packed quads.

#include <quoin/mesh/blocky.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/town_workload.h"
#include "bench/workloads.h"
#include "core/made_with_for_tests.h"

namespace quoin {
namespace {

using workloads::Blocky;

struct Case {
  const char* name;
  Blocky which;
};
constexpr Case kCases[] = {{"w1", Blocky::W1},       {"w2", Blocky::W2},
                           {"w3a", Blocky::W3a},     {"w3b", Blocky::W3b},
                           {"w3c", Blocky::W3c},     {"w4", Blocky::W4},
                           {"empty", Blocky::Empty}, {"full", Blocky::Full},
                           {"glass", Blocky::Glass}, {"glass_columns", Blocky::GlassColumns}};
constexpr struct {
  const char* prefix;
  InstructionSet set;
} kLesserSets[] = {{"avx2/", InstructionSet::Avx2}, {"plain/", InstructionSet::Plain}};

// W1's terrain over 4x2x4 whole chunks; its surface crosses the tops of the lower chunks.
Grid terrain_of_chunks() {
  std::vector<double> heights;
  for (int z = 0; z < 256; ++z) {
    for (int x = 0; x < 256; ++x) heights.push_back(workloads::height(x, z) + 24);
  }
  Grid grid;
  grid.edit({IVec3{0}, {256, 128, 256}}, [&](IVec3 v, VoxelType) {
    return workloads::terrain_type(v.y, heights[static_cast<std::size_t>(v.z * 256 + v.x)]);
  });
  return grid;
}

// Meshes chunks with their neighbours; a time is per chunk.
void mesh_world(benchmark::State& state, bool occlusion, InstructionSet instructions) {
  const Grid grid = terrain_of_chunks();
  const VoxelRegistry types = workloads::three_types();
  std::vector<Neighbourhood> chunks;
  for (const IVec3 chunk : grid.chunks()) chunks.push_back(grid.neighbourhood(chunk));
  QuadOptions options;
  options.bake_occlusion = occlusion;
  auto mesher = made_with<BlockyMesher>(instructions);
  QuadBuffer quads;
  std::size_t next = 0;
  for (auto _ : state) {
    mesher.mesh(chunks[next], types, options, quads);
    benchmark::DoNotOptimize(quads.data());
    next = next + 1 == chunks.size() ? 0 : next + 1;
  }
  std::int64_t faces = 0;
  for (const Neighbourhood& chunk : chunks) {
    mesher.mesh(chunk, types, options, quads);
    faces += face_count(quads);
  }
  state.counters["chunks"] = static_cast<double>(chunks.size());
  state.counters["faces"] = static_cast<double>(faces);
}

// Empty and full chunks are surrounded by chunks of the same kind.
Neighbourhood surrounded(const Chunk& chunk, Blocky which) {
  Neighbourhood n = isolated(chunk);
  if (which == Blocky::Full) n.chunks.fill(&chunk);
  return n;
}

void check(Blocky which, std::int64_t faces) {
  if (faces == workloads::expected_faces(which)) return;
  std::fprintf(stderr, "blocky benchmark: %lld faces, expected %lld\n", static_cast<long long>(faces),
               static_cast<long long>(workloads::expected_faces(which)));
  std::exit(1);
}

void mesh(benchmark::State& state, Blocky which, int chunk_count, bool occlusion, InstructionSet instructions) {
  std::vector<Chunk> chunks;
  for (int i = 0; i < chunk_count; ++i) chunks.push_back(workloads::blocky_chunk(which, i % 8, i / 8));
  const VoxelRegistry types = workloads::glass_types();
  QuadOptions options;
  options.bake_occlusion = occlusion;
  options.region = which == Blocky::Full ? kWholeChunk : workloads::kInterior;
  auto mesher = made_with<BlockyMesher>(instructions);
  QuadBuffer quads;
  mesher.mesh(surrounded(chunks[0], which), types, options, quads);
  const std::int64_t faces = face_count(quads);
  check(which, faces);
  const auto first_quads = static_cast<double>(quads.size());
  std::size_t next = 0;
  for (auto _ : state) {
    mesher.mesh(surrounded(chunks[next], which), types, options, quads);
    benchmark::DoNotOptimize(quads.data());
    next = next + 1 == chunks.size() ? 0 : next + 1;
  }
  state.counters["quads"] = first_quads;
  state.counters["faces"] = static_cast<double>(faces);
}

// Selects all workloads for the widest instructions, and for the others those that the specification lists.
bool is_wanted(const Case& c, int count, bool is_widest) {
  return is_widest || (count > 1 && (c.which == Blocky::W1 || c.which == Blocky::W2));
}

void register_set(const std::string& prefix, InstructionSet set) {
  if (!has_instruction_set(set)) return;
  for (const bool occlusion : {true, false}) {
    const std::string style = occlusion ? "/ao" : "/no_ao";
    for (const Case& c : kCases) {
      for (const int count : {1, 64}) {
        if (!is_wanted(c, count, prefix.empty())) continue;
        const std::string name = prefix + "blocky/" + c.name + (count == 1 ? "/hot" : "/cold64") + style;
        benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
          mesh(state, c.which, count, occlusion, set);
        })->Unit(benchmark::kMicrosecond);
      }
    }
    benchmark::RegisterBenchmark((prefix + "blocky/world" + style).c_str(), [=](benchmark::State& state) {
      mesh_world(state, occlusion, set);
    })->Unit(benchmark::kMicrosecond);
  }
}

void visible_faces(benchmark::State& state) {
  std::vector<Chunk> chunks;
  for (int i = 0; i < 64; ++i) chunks.push_back(workloads::blocky_chunk(Blocky::W1, i % 8, i / 8));
  const VoxelRegistry types = workloads::three_types();
  BlockyMesher mesher;
  FaceRows faces;
  mesher.find_faces(isolated(chunks[0]), types, workloads::kInterior, faces);
  check(Blocky::W1, faces.count());
  std::size_t next = 0;
  for (auto _ : state) {
    mesher.find_faces(isolated(chunks[next]), types, workloads::kInterior, faces);
    benchmark::DoNotOptimize(faces.rows[0].data());
    next = next + 1 == chunks.size() ? 0 : next + 1;
  }
  state.counters["faces"] = static_cast<double>(workloads::expected_faces(Blocky::W1));
}
BENCHMARK(visible_faces)->Name("visible_faces/w1/cold64")->Unit(benchmark::kMicrosecond);

// Counts faces as `quoin info` does; a time is per chunk.
void count_faces(benchmark::State& state) {
  const Grid grid = terrain_of_chunks();
  const VoxelRegistry types = workloads::three_types();
  BlockyMesher mesher;
  QuadBuffer quads;
  std::vector<Neighbourhood> chunks;
  std::int64_t meshed = 0;
  std::int64_t counted = 0;
  for (const IVec3 chunk : grid.chunks()) {
    chunks.push_back(grid.neighbourhood(chunk));
    mesher.mesh(chunks.back(), types, {}, quads);
    meshed += face_count(quads);
    counted += mesher.count_faces(chunks.back(), types);
  }
  if (counted != meshed) state.SkipWithError("faces were counted wrongly");
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(mesher.count_faces(chunks[next], types));
    next = next + 1 == chunks.size() ? 0 : next + 1;
  }
  state.counters["faces"] = static_cast<double>(counted);
}
BENCHMARK(count_faces)->Name("count_faces/world")->Unit(benchmark::kMicrosecond);

// Meshes a town; a time is per chunk. `is_shaped` false: the same blocks as cubes.
void mesh_town(benchmark::State& state, bool is_shaped) {
  const Scene scene = workloads::town_scene(is_shaped);
  const VoxelRegistry& types = scene.types;
  const Grid& grid = scene.grids()[scene.grids().handles().front()].grid;
  std::vector<Neighbourhood> chunks;
  for (const IVec3 chunk : grid.chunks()) chunks.push_back(grid.neighbourhood(chunk));
  BlockyMesher mesher;
  QuadBuffer quads;
  ShapeFaceBuffer shapes;
  std::int64_t quad_count = 0;
  std::int64_t face_count = 0;
  for (const Neighbourhood& chunk : chunks) {
    mesher.mesh(chunk, types, {}, quads, shapes);
    quad_count += static_cast<std::int64_t>(quads.size());
    face_count += static_cast<std::int64_t>(shapes.size());
  }
  if ((face_count > 0) != is_shaped) state.SkipWithError("faces of shapes where none should be, or none");
  std::size_t next = 0;
  for (auto _ : state) {
    mesher.mesh(chunks[next], types, {}, quads, shapes);
    benchmark::DoNotOptimize(quads.data());
    benchmark::DoNotOptimize(shapes.data());
    next = next + 1 == chunks.size() ? 0 : next + 1;
  }
  state.counters["chunks"] = static_cast<double>(chunks.size());
  state.counters["quads"] = static_cast<double>(quad_count);
  state.counters["shape_faces"] = static_cast<double>(face_count);
}
BENCHMARK_CAPTURE(mesh_town, shapes, true)->Name("shapes/town/mesh")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(mesh_town, cubes, false)->Name("shapes/town/mesh_cubes")->Unit(benchmark::kMicrosecond);

VoxelFaces faces_of(VoxelType type) {
  const auto texture = [&](int part) {
    AlphaImage image{16, 16, std::vector<std::uint8_t>(std::size_t{4} * 16 * 16, 255)};
    for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
      image.rgba[i] = static_cast<std::uint8_t>(16 * type + part);
      image.rgba[i + 1] = static_cast<std::uint8_t>(i / 4);
    }
    return *Texture::from_image("texture", image);
  };
  return VoxelFaces({texture(0)}, {texture(1)}, {texture(2)});
}

// Meshes the town with textures on its cubes; a time is per chunk. States turn some cubes. Compares the number of quads
// with the same voxels without textures and orientations.
void mesh_textured_town(benchmark::State& state) {
  const Scene scene = workloads::town_scene(false);
  VoxelRegistry textured;
  VoxelRegistry plain;
  bool is_added = true;
  for (std::size_t i = 1; i < scene.types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    VoxelProperties properties = scene.types[type];
    properties.faces = faces_of(type);
    is_added &= textured.add(properties).has_value();
    properties.faces = {};
    properties.orientations = {};
    is_added &= plain.add(std::move(properties)).has_value();
  }
  const Grid& grid = scene.grids()[scene.grids().handles().front()].grid;
  BlockyMesher mesher;
  QuadBuffer quads;
  std::size_t textured_quads = 0;
  std::size_t plain_quads = 0;
  std::vector<Neighbourhood> chunks;
  for (const IVec3 chunk : grid.chunks()) {
    chunks.push_back(grid.neighbourhood(chunk));
    mesher.mesh(chunks.back(), textured, {}, quads);
    textured_quads += quads.size();
    mesher.mesh(chunks.back(), plain, {}, quads);
    plain_quads += quads.size();
  }
  const double share = static_cast<double>(textured_quads) / static_cast<double>(plain_quads);
  if (!is_added || !(share <= 1.35)) state.SkipWithError("more than 1.35 times the quads of untextured blocks");
  std::size_t next = 0;
  for (auto _ : state) {
    mesher.mesh(chunks[next], textured, {}, quads);
    benchmark::DoNotOptimize(quads.data());
    next = next + 1 == chunks.size() ? 0 : next + 1;
  }
  state.counters["quads"] = static_cast<double>(textured_quads);
  state.counters["of_untextured"] = share;
}
BENCHMARK(mesh_textured_town)->Name("textures/town/quads")->Unit(benchmark::kMicrosecond);

const bool kRegistered = [] {
  register_set("", instruction_set());
  for (const auto& [prefix, set] : kLesserSets) register_set(prefix, set);
  return true;
}();

}  // namespace
}  // namespace quoin

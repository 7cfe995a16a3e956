// rays/*: the 256x128x256 terrain, primary, shadow and occlusion rays, one at a time.

#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 360;
constexpr double kOcclusionLength = 6.0;

struct Query {
  Ray ray;
  double max_t;
};

struct RayWorld {
  Grid grid;
  VoxelRegistry types = workloads::three_types();
  OccupancyTree tree;
  std::vector<Query> primary;
  std::vector<Query> shadow;
  std::vector<Query> occlusion;
};

std::vector<Query> camera_rays() {
  const DVec3 eye{20, 90, 20};
  const DVec3 forward = glm::normalize(DVec3{128, 40, 128} - eye);
  const DVec3 right = glm::normalize(glm::cross(forward, DVec3{0, 1, 0}));
  const DVec3 up = glm::cross(right, forward);
  const double half = std::tan(70.0 * std::numbers::pi / 360.0);
  std::vector<Query> rays;
  for (int tile = 0; tile < kWidth * kHeight / 16; ++tile) {
    for (int i = 0; i < 16; ++i) {
      const int column = tile % (kWidth / 4) * 4 + i % 4;
      const int row = tile / (kWidth / 4) * 4 + i / 4;
      const double x = ((column + 0.5) / kWidth * 2 - 1) * half * kWidth / kHeight;
      const double y = (1 - (row + 0.5) / kHeight * 2) * half;
      rays.push_back({{eye, glm::normalize(forward + right * x + up * y)}, std::numeric_limits<double>::infinity()});
    }
  }
  return rays;
}

void add_secondary(RayWorld& world, std::size_t index) {
  const Query& query = world.primary[index];
  const auto hit = first_hit(world.tree, query.ray);
  if (!hit) return;
  const DVec3 n(normal_of(hit->face));
  const int axis = frame_of(hit->face).axis;
  DVec3 tangent{0};
  DVec3 bitangent{0};
  tangent[(axis + 1) % 3] = 1;
  bitangent[(axis + 2) % 3] = 1;
  const DVec3 origin = query.ray.origin + query.ray.direction * hit->t + n * 0.001;
  world.shadow.push_back(
      {{origin, glm::normalize(DVec3{0.371, 0.743, 0.223})}, std::numeric_limits<double>::infinity()});
  const std::size_t tile = index / 16;
  const std::size_t column = tile % (kWidth / 4) * 4 + index % 4;
  const std::size_t row = tile / (kWidth / 4) * 4 + index % 16 / 4;
  const auto pixel = static_cast<std::uint32_t>(row * kWidth + column);
  const double xi = static_cast<double>(pixel * 2654435761U) / 4294967296.0;
  for (int s = 0; s < 6; ++s) {
    const double sin2 = (s + 0.5) / 6;
    const double phi = 2 * std::numbers::pi * (s + xi) / 6;
    const double r = std::sqrt(sin2);
    const DVec3 d = n * std::sqrt(1 - sin2) + tangent * (r * std::cos(phi)) + bitangent * (r * std::sin(phi));
    world.occlusion.push_back({{origin, d}, kOcclusionLength});
  }
}

const RayWorld& world() {
  static const RayWorld shared = [] {
    RayWorld w;
    w.grid.edit({IVec3{0}, IVec3{256, 128, 256}},
                [](IVec3 v, VoxelType) { return static_cast<VoxelType>(v.y <= workloads::height(v.x, v.z)); });
    w.tree = OccupancyTree::build(w.grid, w.types);
    w.primary = camera_rays();
    for (std::size_t i = 0; i < w.primary.size(); ++i) add_secondary(w, i);
    return w;
  }();
  return shared;
}

void report(benchmark::State& state, std::size_t rays, int hits, int expected) {
  if (std::abs(hits - expected) > 30) {
    std::fprintf(stderr, "ray benchmark: %d hits, expected %d\n", hits, expected);
    std::exit(1);
  }
  state.counters["hits"] = hits;
  state.counters["rays_per_second"] =
      benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsIterationInvariantRate);
}

void trace(benchmark::State& state, const std::vector<Query>& rays, int expected) {
  int hits = 0;
  for (auto _ : state) {
    hits = 0;
    for (const Query& query : rays) hits += any_hit(world().tree, query.ray, query.max_t);
  }
  report(state, rays.size(), hits, expected);
}

// Packets of 16 in the order of the rays.
std::vector<RayPacket> packets_of(const std::vector<Query>& rays) {
  std::vector<RayPacket> packets((rays.size() + 15) / 16);
  for (std::size_t i = 0; i < rays.size(); ++i)
    packets[i / 16].set(static_cast<int>(i % 16), rays[i].ray, rays[i].max_t);
  return packets;
}

void trace_packets(benchmark::State& state, const std::vector<Query>& rays, int expected, InstructionSet set) {
  const std::vector<RayPacket> packets = packets_of(rays);
  int hits = 0;
  for (auto _ : state) {
    hits = 0;
    for (const RayPacket& packet : packets) hits += std::popcount(any_hits(world().tree, packet, set));
  }
  report(state, rays.size(), hits, expected);
}

void primary(benchmark::State& state) {
  trace(state, world().primary, 118'582);
}
void shadow(benchmark::State& state) {
  trace(state, world().shadow, 86'217);
}
void occlusion(benchmark::State& state) {
  trace(state, world().occlusion, 242'773);
}
BENCHMARK(primary)->Name("rays/primary/single")->Unit(benchmark::kMillisecond);
BENCHMARK(shadow)->Name("rays/shadow/single")->Unit(benchmark::kMillisecond);
BENCHMARK(occlusion)->Name("rays/ao/single")->Unit(benchmark::kMillisecond);

void primary_packets(benchmark::State& state, InstructionSet set) {
  trace_packets(state, world().primary, 118'582, set);
}
void shadow_packets(benchmark::State& state, InstructionSet set) {
  trace_packets(state, world().shadow, 86'217, set);
}
void occlusion_packets(benchmark::State& state, InstructionSet set) {
  trace_packets(state, world().occlusion, 242'773, set);
}

[[maybe_unused]] const bool registered = [] {
  const struct {
    const char* suffix;
    InstructionSet set;
  } sets[] = {{"", InstructionSet::Best}, {"/avx2", InstructionSet::Avx2}, {"/plain", InstructionSet::Plain}};
  for (const auto& s : sets) {
    const auto add = [&](const char* name, void (*run)(benchmark::State&, InstructionSet)) {
      benchmark::RegisterBenchmark((std::string("rays/") + name + "/packet" + s.suffix).c_str(), run, s.set)
          ->Unit(benchmark::kMillisecond);
    };
    add("primary", primary_packets);
    add("shadow", shadow_packets);
    add("ao", occlusion_packets);
  }
  return true;
}();

void build(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(OccupancyTree::build(world().grid, world().types).bytes());
  state.counters["bytes"] = static_cast<double>(world().tree.bytes());
}
BENCHMARK(build)->Name("rays/build")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin

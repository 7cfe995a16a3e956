// peer/embree/*: Embree 3 on the greedy mesh as triangles; one thread, one ray at a time and packets of 16.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <vector>

#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

#include <quoin/mesh/blocky.h>

#include "bench/peers/peer_report.h"

namespace quoin::peers {
namespace {

using workloads::RayQuery;

std::atomic<std::int64_t> bytes_held{0};

RTCDevice device() {
  static const RTCDevice shared = [] {
    const RTCDevice made = rtcNewDevice("threads=1,set_affinity=0");
    const auto count = [](void*, ssize_t bytes, bool) {
      bytes_held += bytes;
      return true;
    };
    rtcSetDeviceMemoryMonitorFunction(made, count, nullptr);
    return made;
  }();
  return shared;
}

struct Triangles {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
};

Triangles triangles_of(const Grid& grid) {
  BlockyMeshOptions options;
  options.bake_occlusion = false;
  auto mesh = build_blocky_mesh(grid, workloads::three_types(), options, {1}).value();
  auto& opaque = mesh.surfaces[static_cast<std::size_t>(SurfaceClass::Opaque)];
  return {std::move(opaque.positions), std::move(opaque.indices)};
}

class EmbreeScene {
 public:
  EmbreeScene(const Triangles& triangles, RTCBuildQuality quality) {
    const std::int64_t before = bytes_held;
    scene_ = rtcNewScene(device());
    rtcSetSceneBuildQuality(scene_, quality);
    const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, quality);
    void* positions = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3),
                                              triangles.positions.size());
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), triangles.indices.size() / 3);
    std::copy(triangles.positions.begin(), triangles.positions.end(), static_cast<Vec3*>(positions));
    std::copy(triangles.indices.begin(), triangles.indices.end(), static_cast<std::uint32_t*>(indices));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
    bytes_ = bytes_held - before;
  }
  ~EmbreeScene() { rtcReleaseScene(scene_); }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  [[nodiscard]] RTCScene get() const { return scene_; }
  [[nodiscard]] std::int64_t bytes() const { return bytes_; }

 private:
  RTCScene scene_;
  std::int64_t bytes_ = 0;
};

RTCScene world() {
  static const EmbreeScene shared(triangles_of(workloads::ray_workload().grid), RTC_BUILD_QUALITY_HIGH);
  return shared.get();
}

// 11 million triangles: of medium quality, since the best takes 20 seconds to build and gains nothing here.
RTCScene random_world() {
  static const EmbreeScene shared(triangles_of(workloads::random_ray_workload().grid), RTC_BUILD_QUALITY_MEDIUM);
  return shared.get();
}

// Denormal numbers count as zero while this lives, as Embree's manual advises.
class FlushDenormals {
 public:
  FlushDenormals() : before_(_mm_getcsr()) {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  }
  ~FlushDenormals() { _mm_setcsr(before_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned before_;
};

float far_end(const RayQuery& query) {
  return static_cast<float>(query.max_t);
}

RTCRay ray_of(const RayQuery& query) {
  const Vec3 origin(query.ray.origin);
  const Vec3 direction(query.ray.direction);
  RTCRay ray{};
  ray.org_x = origin.x, ray.org_y = origin.y, ray.org_z = origin.z;
  ray.dir_x = direction.x, ray.dir_y = direction.y, ray.dir_z = direction.z;
  ray.tfar = far_end(query);
  ray.mask = ~0U;
  return ray;
}

int first_one_by_one(RTCScene scene, const std::vector<RayQuery>& rays) {
  const FlushDenormals flush;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  int hits = 0;
  for (const RayQuery& query : rays) {
    RTCRayHit ray{};
    ray.ray = ray_of(query);
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &ray);
    hits += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }
  return hits;
}

int any_one_by_one(RTCScene scene, const std::vector<RayQuery>& rays) {
  const FlushDenormals flush;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  int hits = 0;
  for (const RayQuery& query : rays) {
    RTCRay ray = ray_of(query);
    rtcOccluded1(scene, &context, &ray);
    hits += ray.tfar < 0.0F;
  }
  return hits;
}

struct Packet {
  RTCRay16 rays{};
  alignas(64) int valid[16] = {};
};

// Made before the clock runs, as Quoin's are.
std::vector<Packet> packets_of(const std::vector<RayQuery>& rays) {
  std::vector<Packet> packets((rays.size() + 15) / 16);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const RTCRay ray = ray_of(rays[i]);
    Packet& packet = packets[i / 16];
    const std::size_t lane = i % 16;
    packet.rays.org_x[lane] = ray.org_x, packet.rays.org_y[lane] = ray.org_y, packet.rays.org_z[lane] = ray.org_z;
    packet.rays.dir_x[lane] = ray.dir_x, packet.rays.dir_y[lane] = ray.dir_y, packet.rays.dir_z[lane] = ray.dir_z;
    packet.rays.tfar[lane] = ray.tfar;
    packet.rays.mask[lane] = ~0U;
    packet.valid[lane] = -1;
  }
  return packets;
}

// Remembers the packets of the last rays asked for.
const std::vector<Packet>& shared_packets(const std::vector<RayQuery>& rays) {
  static const RayQuery* known = nullptr;
  static std::vector<Packet> packets;
  if (known != rays.data()) {
    packets = packets_of(rays);
    known = rays.data();
  }
  return packets;
}

int first_in_packets(RTCScene scene, const std::vector<RayQuery>& rays) {
  const FlushDenormals flush;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  int hits = 0;
  for (const Packet& packet : shared_packets(rays)) {
    RTCRayHit16 query{};
    query.ray = packet.rays;
    std::fill(std::begin(query.hit.geomID), std::end(query.hit.geomID), RTC_INVALID_GEOMETRY_ID);
    rtcIntersect16(packet.valid, scene, &context, &query);
    for (int i = 0; i < 16; ++i) hits += packet.valid[i] != 0 && query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
  }
  return hits;
}

int any_in_packets(RTCScene scene, const std::vector<RayQuery>& rays, RTCIntersectContextFlags flags) {
  const FlushDenormals flush;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  int hits = 0;
  for (const Packet& packet : shared_packets(rays)) {
    RTCRay16 query = packet.rays;
    rtcOccluded16(packet.valid, scene, &context, &query);
    for (int i = 0; i < 16; ++i) hits += packet.valid[i] != 0 && query.tfar[i] < 0.0F;
  }
  return hits;
}

void build(benchmark::State& state, RTCBuildQuality quality) {
  const Triangles triangles = triangles_of(workloads::ray_workload().grid);
  std::int64_t bytes = 0;
  for (auto _ : state) bytes = EmbreeScene(triangles, quality).bytes();
  state.counters["bytes"] = static_cast<double>(bytes);
  state.counters["triangles"] = static_cast<double>(triangles.indices.size() / 3);
}

[[maybe_unused]] const bool registered = [] {
  using Rays = const std::vector<RayQuery>&;
  const std::string prefix = "peer/embree/";
  const auto first = [](Rays rays) { return first_one_by_one(world(), rays); };
  const auto any = [](Rays rays) { return any_one_by_one(world(), rays); };
  add_workload(prefix, "single", first, any, any);
  // Each with the flag that is the faster: for occlusion rays by half, for primary ones by a factor of two.
  const auto first_16 = [](Rays rays) { return first_in_packets(world(), rays); };
  const auto shadow_16 = [](Rays rays) { return any_in_packets(world(), rays, RTC_INTERSECT_CONTEXT_FLAG_COHERENT); };
  const auto ao_16 = [](Rays rays) { return any_in_packets(world(), rays, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT); };
  add_workload(prefix, "packet", first_16, shadow_16, ao_16);
  add_random(prefix, [](Rays rays) { return first_one_by_one(random_world(), rays); });
  const auto add_build = [](const char* name, RTCBuildQuality quality) {
    benchmark::RegisterBenchmark(name, build, quality)->Unit(benchmark::kMillisecond);
  };
  add_build("peer/embree/rays/build", RTC_BUILD_QUALITY_HIGH);
  add_build("peer/embree/rays/build/medium", RTC_BUILD_QUALITY_MEDIUM);
  add_build("peer/embree/rays/build/low", RTC_BUILD_QUALITY_LOW);
  return true;
}();

}  // namespace
}  // namespace quoin::peers

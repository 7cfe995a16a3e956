// peer/embree/*: Embree 3 on the greedy mesh as triangles; one thread, one ray at a time and packets of 16.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <vector>

#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

#include <glm/geometric.hpp>

#include <quoin/mesh/blocky.h>
#include <quoin/render/path_tracer.h>

#include "bench/image_workload.h"
#include "bench/peers/peer_report.h"
#include "render/light/light_model.h"
#include "render/light/occlusion_directions.h"
#include "render/path/path_math.h"
#include "render/path/path_tile.h"
#include "render/path/sky_light.h"
#include "render/shared/image_request.h"

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

// 11 million triangles, at medium build quality: the best takes 20 seconds and gains nothing here.
RTCScene random_world() {
  static const EmbreeScene shared(triangles_of(workloads::random_ray_workload().grid), RTC_BUILD_QUALITY_MEDIUM);
  return shared.get();
}

// Treats denormal numbers as zero during its lifetime, as Embree's manual advises.
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

// Built outside the timing, like Quoin's.
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

// Caches the packets of the last rays.
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

// Traces the same paths as PathTracer, number for number, with Embree's hits: matte surfaces under sun and sky.
class EmbreePaths {
 public:
  EmbreePaths(const Grid& grid, const VoxelRegistry& types)
      : triangles_(triangles_of(grid)), scene_(triangles_, RTC_BUILD_QUALITY_HIGH) {
    const Surfaces surfaces(types, Clouds::Scatter);
    for (std::size_t i = 0; i < triangles_.indices.size(); i += 3) {
      const auto corner = [&](std::size_t k) { return triangles_.positions[triangles_.indices[i + k]]; };
      const Vec3 normal = glm::normalize(glm::cross(corner(1) - corner(0), corner(2) - corner(0)));
      const Vec3 inside = (corner(0) + corner(1) + corner(2)) / 3.0F - normal * 0.5F;
      faces_.push_back({normal, surfaces[grid.get(IVec3(glm::floor(inside)))].colour});
    }
  }

  // Returns the mean of all pixels.
  Vec3 image(const Camera& camera, const PathOptions& options, const path::SkyLight& sky) {
    const FlushDenormals flush;
    const CameraRays view(camera, options.width, options.height);
    Vec3 sum(0.0F);
    for (int y = 0; y < options.height; ++y) {
      for (int x = 0; x < options.width; ++x) {
        const std::uint32_t pixel = mix_bits(hash_of(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) ^
                                             options.seed * 0x9E37'79B9U);
        for (int i = 0; i < options.samples; ++i) {
          const path::Random random(pixel, static_cast<std::uint32_t>(i));
          const path::Pair jitter = random.pair(0);
          const DVec3 across = view.corner() + view.right() * (x + static_cast<double>(jitter.x)) +
                               view.down() * (y + static_cast<double>(jitter.y));
          sum += light_of(sky, random, Vec3(camera.position), Vec3(glm::normalize(view.forward() + across)),
                          options.max_bounces);
        }
      }
    }
    return sum / static_cast<float>(options.width * options.height * options.samples);
  }
  [[nodiscard]] std::int64_t rays() const { return rays_; }

 private:
  struct Face {
    Vec3 normal;
    Vec3 colour;
  };

  static RTCRay ray_from(Vec3 origin, Vec3 direction) {
    return ray_of({{DVec3(origin), DVec3(direction)}, std::numeric_limits<double>::infinity()});
  }

  Vec3 light_of(const path::SkyLight& sky, const path::Random& random, Vec3 origin, Vec3 direction, int max_bounces) {
    Vec3 light(0.0F);
    Vec3 throughput(1.0F);
    float density = path::kNoOther;
    std::uint32_t dimension = 2;
    for (int bounces = 0;; ++bounces) {
      RTCRayHit hit{};
      hit.ray = ray_from(origin, direction);
      hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene_.get(), &context_, &hit);
      ++rays_;
      if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
        Vec3 found = sky.sky(direction);
        if (const float sun = sky.sun_density(direction); sun > 0.0F)
          found += sky.sun(direction) * (density < path::kNoOther ? path::balance(density, sun) : 1.0F);
        return light + throughput * found;
      }
      if (bounces >= max_bounces) return light;
      const Face& face = faces_[hit.hit.primID];
      origin += direction * hit.ray.tfar + face.normal * static_cast<float>(kRayLift);
      const path::SkySample sun = sky.sample_sun(random.pair(dimension + path::dimension::kSun));
      const float cosine = glm::dot(sun.direction, face.normal);
      if (cosine > 0.0F) {
        RTCRay shadow = ray_from(origin, sun.direction);
        rtcOccluded1(scene_.get(), &context_, &shadow);
        ++rays_;
        const float by_scatter = cosine / path::kPi;
        if (!(shadow.tfar < 0.0F)) {
          light += throughput * face.colour * by_scatter *
                   (sun.radiance / sun.density * path::balance(sun.density, by_scatter));
        }
      }
      const Vec3 local = path::cosine_weighted(random.pair(dimension + path::dimension::kDirection));
      throughput *= face.colour;
      if (bounces >= 3) {
        const float likely = std::min(path::largest(throughput), 0.95F);
        if (!(random.one(dimension + path::dimension::kRoulette) < likely)) return light;
        throughput /= likely;
      }
      direction = glm::normalize(path::Frame(face.normal).to_world(local));
      density = local.z / path::kPi;
      dimension += path::kDimensions;
    }
  }

  Triangles triangles_;
  EmbreeScene scene_;
  RTCIntersectContext context_ = [] {
    RTCIntersectContext made;
    rtcInitIntersectContext(&made);
    return made;
  }();
  std::vector<Face> faces_;
  std::int64_t rays_ = 0;
};

// The same workload as path/terrain/640x360.
void paths(benchmark::State& state) {
  static const Scene scene = workloads::image_scene();
  const SceneGrid& grid = *scene.grids().find(scene.grids().handles().front());
  EmbreePaths tracer(grid.grid, scene.types);
  PathOptions options;
  options.width = 640;
  options.height = 360;
  options.samples = 4;
  options.max_bounces = 4;
  const Camera camera = frame_view(scene.bounds(), View::Iso, 16.0 / 9.0);
  const PathImage ours = PathTracer(scene, InstanceFilter::Visible, {1}).render(camera, options, {1}).value();
  DVec3 expected(0.0);
  for (const Vec3& each : ours.radiance) expected += DVec3(each) / static_cast<double>(ours.radiance.size());
  const path::SkyLight sky(options);  // as a tracer keeps it
  std::int64_t rays = 0;
  for (auto _ : state) {
    const Vec3 mean = tracer.image(camera, options, sky);
    const double difference = glm::length(DVec3(mean) - expected) / glm::length(expected);
    // Some rays slip through T-junctions of merged faces.
    workloads::fail_unless(difference < 5e-3, "the difference of images, in millionths,",
                           std::llround(difference * 1e6));
    rays = tracer.rays();
  }
  state.counters["rays"] = benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsRate);
  state.counters["rays_of_ours"] = static_cast<double>(ours.rays) * static_cast<double>(state.iterations());
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
  // Each uses its faster flag: by half for occlusion rays, by a factor of two for primary rays.
  const auto first_16 = [](Rays rays) { return first_in_packets(world(), rays); };
  const auto shadow_16 = [](Rays rays) { return any_in_packets(world(), rays, RTC_INTERSECT_CONTEXT_FLAG_COHERENT); };
  const auto ao_16 = [](Rays rays) { return any_in_packets(world(), rays, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT); };
  add_workload(prefix, "packet", first_16, shadow_16, ao_16);
  add_random(prefix, [](Rays rays) { return first_one_by_one(random_world(), rays); });
  const auto add_build = [](const char* name, RTCBuildQuality quality) {
    benchmark::RegisterBenchmark(name, build, quality)->Unit(benchmark::kMillisecond);
  };
  benchmark::RegisterBenchmark("peer/embree/path/terrain/640x360", &paths)
      ->Unit(benchmark::kMillisecond)
      ->Iterations(3);
  add_build("peer/embree/rays/build", RTC_BUILD_QUALITY_HIGH);
  add_build("peer/embree/rays/build/medium", RTC_BUILD_QUALITY_MEDIUM);
  add_build("peer/embree/rays/build/low", RTC_BUILD_QUALITY_LOW);
  return true;
}();

}  // namespace
}  // namespace quoin::peers

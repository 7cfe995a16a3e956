// array/*: surfaces directly from dense arrays of 256^3, on one thread and on all. The sphere has float samples and a
// radius of 100; the labels are the nearest of 50 seeds within a ball, as 8-bit and 32-bit integers.

#include <quoin/mesh/array_surface.h>
#include <quoin/mesh/label_surfaces.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

namespace quoin {
namespace {

constexpr int kEdge = 256;
constexpr double kCentre = (kEdge - 1) / 2.0;
constexpr double kRadius = 100.0;
constexpr int kLabels = 50;

template <class T, class Value>
std::vector<T> fill(Value value) {
  std::vector<T> values;
  values.reserve(std::size_t{kEdge} * kEdge * kEdge);
  for (int x = 0; x < kEdge; ++x) {
    for (int y = 0; y < kEdge; ++y) {
      for (int z = 0; z < kEdge; ++z) values.push_back(static_cast<T>(value(DVec3(x, y, z))));
    }
  }
  return values;
}

template <class T>
std::vector<T> label_values() {
  std::mt19937 random(7);
  std::vector<DVec3> seeds;
  for (int i = 0; i < kLabels; ++i) {
    DVec3 seed;
    for (int axis = 0; axis < 3; ++axis) seed[axis] = random() * 0x1p-32 * kEdge;
    seeds.push_back(seed);
  }
  return fill<T>([&](DVec3 p) {
    if (glm::length(p - kCentre) > 0.47 * kEdge) return 0;
    int nearest = 0;
    for (int i = 1; i < kLabels; ++i) {
      const auto squared = [&](int s) {
        const DVec3 d = seeds[static_cast<std::size_t>(s)] - p;
        return glm::dot(d, d);
      };
      if (squared(i) < squared(nearest)) nearest = i;
    }
    return nearest + 1;
  });
}

template <class T>
ArrayView view_of_cube(const std::vector<T>& values, ScalarType type) {
  ArrayView view;
  view.data = values.data();
  view.type = type;
  view.size = {kEdge, kEdge, kEdge};
  view.strides = strides_of_last_fastest(view.size, type);
  return view;
}

void require(bool is_right, const char* what) {
  if (is_right) return;
  std::fprintf(stderr, "array benchmark: %s is wrong\n", what);
  std::exit(1);
}

void check_sphere(const ArraySurface& surface) {
  const auto vertices = static_cast<std::int64_t>(surface.positions.size());
  require(vertices - static_cast<std::int64_t>(surface.indices.size()) / 6 == 2, "the sphere's Euler characteristic");
  require(std::all_of(surface.positions.begin(), surface.positions.end(),
                      [](const Vec3& p) { return std::abs(glm::length(DVec3(p) - kCentre) - kRadius) < 0.01; }),
          "a vertex of the sphere");
}

void sphere(benchmark::State& state) {
  const std::vector<float> values = fill<float>([](DVec3 p) { return glm::length(p - kCentre) - kRadius; });
  const ArrayView view = view_of_cube(values, ScalarType::Float32);
  ArraySurfaceOptions options;
  options.solid = SolidSide::Below;
  options.split_sheets = false;
  const Threads threads{static_cast<unsigned>(state.range(0))};
  const auto made = surface_from_array(view, options, threads);
  require(made.has_value(), "the sphere");
  check_sphere(*made);
  for (auto _ : state) benchmark::DoNotOptimize(surface_from_array(view, options, threads));
  state.counters["vertices"] = static_cast<double>(made->positions.size());
}
BENCHMARK(sphere)
    ->Name("array/sphere")
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(0)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

template <class T, ScalarType kType>
void labels(benchmark::State& state) {
  const std::vector<T> values = label_values<T>();
  const ArrayView view = view_of_cube(values, kType);
  LabelSurfaceOptions options;
  options.relaxation_steps = static_cast<int>(state.range(1));
  const Threads threads{static_cast<unsigned>(state.range(0))};
  const auto made = surfaces_from_labels(view, options, threads);
  require(made.has_value(), "the labels");
  const std::size_t faces = made->indices.size() / 6;
  std::size_t around_all = 0;
  for (const std::int64_t label : labels_of(*made)) around_all += indices_of_label(*made, label).size() / 6;
  require(around_all + indices_of_label(*made, 0).size() / 6 == 2 * faces, "the faces of the labels");
  for (auto _ : state) benchmark::DoNotOptimize(surfaces_from_labels(view, options, threads));
  state.counters["vertices"] = static_cast<double>(made->positions.size());
  state.counters["interfaces"] = static_cast<double>(made->interfaces.size());
}
BENCHMARK(labels<std::uint8_t, ScalarType::UInt8>)
    ->Name("array/labels/uint8")
    ->ArgNames({"threads", "relaxation"})
    ->ArgsProduct({{1, 0}, {0, 4}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(labels<std::int32_t, ScalarType::Int32>)
    ->Name("array/labels/int32")
    ->ArgNames({"threads", "relaxation"})
    ->ArgsProduct({{1}, {0, 4}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace quoin

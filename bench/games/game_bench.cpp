#include "game_bench.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <new>
#include <thread>
#include <unordered_set>

#include <malloc.h>
#include <unistd.h>

namespace {

thread_local std::int64_t thread_allocations = 0;

// Bytes of the large blocks in use. They are counted from the start of `main` on, with --arena.
bool counts_large = false;
std::atomic<std::int64_t> large_of_new{0}, large_of_arena{0};

void* counted(void* memory) {
  if (!counts_large || memory == nullptr) return memory;
  const std::size_t bytes = malloc_usable_size(memory);
  if (bytes > quoin::kLargeBlock) large_of_new += static_cast<std::int64_t>(bytes);
  return memory;
}

void release(void* memory) {
  if (counts_large && memory != nullptr) {
    const std::size_t bytes = malloc_usable_size(memory);
    if (bytes > quoin::kLargeBlock) large_of_new -= static_cast<std::int64_t>(bytes);
  }
  std::free(memory);
}

void* allocate(std::size_t bytes) {
  ++thread_allocations;
  if (void* const memory = counted(std::malloc(std::max<std::size_t>(bytes, 1)))) return memory;
  throw std::bad_alloc();
}

void* allocate(std::size_t bytes, std::align_val_t alignment) {
  ++thread_allocations;
  const auto edge = static_cast<std::size_t>(alignment);
  if (void* const memory = counted(std::aligned_alloc(edge, (bytes + edge - 1) / edge * edge))) return memory;
  throw std::bad_alloc();
}

// The memory of a game with an arena: blocks of malloc, counted.
void use_arena() {
  quoin::BlockFunctions arena;
  arena.allocate = [](std::size_t bytes, std::size_t alignment, void* /*context*/) noexcept {
    void* const block = std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    if (block != nullptr) large_of_arena += static_cast<std::int64_t>(bytes);
    return block;
  };
  arena.free = [](void* block, std::size_t bytes, std::size_t /*alignment*/, void* /*context*/) noexcept {
    large_of_arena -= static_cast<std::int64_t>(bytes);
    std::free(block);
  };
  if (!quoin::set_block_functions(arena)) {
    std::fprintf(stderr, "a large block was made before main\n");
    std::exit(2);
  }
  counts_large = true;
}

}  // namespace

// The program's allocations are counted, also those of the library.
void* operator new(std::size_t bytes) {
  return allocate(bytes);
}
void* operator new[](std::size_t bytes) {
  return allocate(bytes);
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return allocate(bytes, alignment);
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return allocate(bytes, alignment);
}
void operator delete(void* memory) noexcept {
  release(memory);
}
void operator delete[](void* memory) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  release(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  release(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  release(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  release(memory);
}

namespace games {
namespace {

using quoin::Direction;
using quoin::IVec3;

double clock_ms(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

// Median, p99, p99.9 and maximum. Sorts `all`.
std::array<double, 4> statistics_of(std::vector<double>& all) {
  std::sort(all.begin(), all.end());
  const auto at = [&](double share) {
    return all.empty() ? 0.0 : all[static_cast<std::size_t>(std::lround(share * static_cast<double>(all.size() - 1)))];
  };
  return {at(0.5), at(0.99), at(0.999), at(1.0)};
}

std::string number(double value) {
  char text[32];
  const char* const format = value == std::round(value) && std::abs(value) < 1e7 ? "%.0f"
                             : std::abs(value) < 1.0                             ? "%.3f"
                             : std::abs(value) < 100.0                           ? "%.2f"
                                                                                 : "%.0f";
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// Returns the light of a unit face within a merged quad. Corner light is a linear function within a quad.
std::uint32_t brightest_of(const quoin::Quad& quad, const quoin::FaceLight& light, int u, int v) {
  const auto at = [&](double s, double t, int shift) {
    const auto corner = [&](std::size_t i) { return static_cast<double>(light[i] >> shift & 255U); };
    return (1 - s) * ((1 - t) * corner(0) + t * corner(3)) + s * ((1 - t) * corner(1) + t * corner(2));
  };
  double most = 0.0;
  for (const int du : {0, 1}) {
    for (const int dv : {0, 1}) {
      for (const int shift : {0, 8, 16, 24}) {
        most = std::max(
            most, at(static_cast<double>(u + du) / quad.size_u(), static_cast<double>(v + dv) / quad.size_v(), shift));
      }
    }
  }
  return static_cast<std::uint32_t>(std::lround(most));
}

struct FaceFinder {
  const quoin::ChunkSurface& surface;
  IVec3 local;
  Direction side;

  [[nodiscard]] std::optional<ShownFace> in(const std::array<std::uint32_t, 7>& ranges) const {
    const auto d = static_cast<std::size_t>(side);
    const quoin::FaceFrame& frame = quoin::frame_of(side);
    for (std::uint32_t i = ranges[d]; i < ranges[d + 1]; ++i) {
      const quoin::Quad& quad = surface.quads[i];
      const IVec3 from = local - quad.voxel();
      const int u = from[frame.u], v = from[frame.v];
      if (from[frame.axis] != 0 || u < 0 || v < 0 || u >= quad.size_u() || v >= quad.size_v()) continue;
      ShownFace face{0, quad.type()};
      if (!surface.light.empty()) face.brightest = brightest_of(quad, surface.light[i], u, v);
      return face;
    }
    return std::nullopt;
  }
};

bool is_visible(const quoin::VoxelRegistry& types, quoin::VoxelType own, quoin::VoxelType other) {
  return own != quoin::kAir && own != other && (other == quoin::kAir || !types.is_opaque(other));
}

bool same_surface(const quoin::ChunkSurface& a, const quoin::ChunkSurface& b) {
  const auto same = [](const auto& x, const auto& y) { return std::equal(x.begin(), x.end(), y.begin(), y.end()); };
  return a.level == b.level && a.quads == b.quads && a.light == b.light && a.types == b.types &&
         same(a.smooth.positions, b.smooth.positions) && same(a.smooth.indices, b.smooth.indices);
}

}  // namespace

struct Shown::EdgeHash {
  std::size_t operator()(const Edge& edge) const {
    std::uint64_t hash = 0;
    for (const Corner& corner : {edge.first, edge.second}) {
      for (const std::int64_t value : corner.at) {
        hash = (hash ^ static_cast<std::uint64_t>(value)) * 0x9E37'79B9'7F4A'7C15U;
        hash ^= hash >> 29;
      }
    }
    return hash;
  }
};

// The edges that were added an odd number of times.
struct Shown::OddEdges {
  std::unordered_set<Edge, EdgeHash> all;
  void add(const Edge& edge) {
    const auto [at, is_new] = all.insert(edge);
    if (!is_new) all.erase(at);
  }
};

double wall_ms() {
  return clock_ms(CLOCK_MONOTONIC);
}
double thread_ms() {
  return clock_ms(CLOCK_THREAD_CPUTIME_ID);
}
double process_ms() {
  return clock_ms(CLOCK_PROCESS_CPUTIME_ID);
}

void report_memory(Report& report, const std::vector<std::pair<std::string, std::size_t>>& parts) {
  double pages = 0.0, resident = 0.0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  resident *= static_cast<double>(sysconf(_SC_PAGESIZE));
  const struct mallinfo2 heap = mallinfo2();
  const auto allocated = static_cast<double>(heap.uordblks + heap.hblkhd);
  double counted = 0.0;
  report.value("memory: process", "MB", 1e-6 * resident);
  for (const auto& [name, bytes] : parts) {
    counted += static_cast<double>(bytes);
    report.value("memory:   " + name, "MB", 1e-6 * static_cast<double>(bytes));
  }
  report.value("memory:   allocated for anything else", "MB", 1e-6 * (allocated - counted));
  report.value("memory:   code, stacks, free blocks of the allocator", "MB", 1e-6 * (resident - allocated));
  if (!counts_large) return;
  report.value("large blocks of Quoin from the arena", "MB", 1e-6 * static_cast<double>(large_of_arena));
  report.value("large blocks of operator new, also of the game", "MB", 1e-6 * static_cast<double>(large_of_new));
}

std::int64_t allocations() {
  return thread_allocations;
}

Options parse(int argc, char** argv) {
  Options options;
  std::optional<double> radius, edits;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const char* const value = i + 1 < argc ? argv[i + 1] : nullptr;
    if (name == "--short") {
      options.is_short = true;
      continue;
    }
    if (name == "--parts") {
      options.with_parts = true;
      continue;
    }
    if (name == "--arena") {
      options.with_arena = true;
      continue;
    }
    const bool known = name == "--radius" || name == "--edits" || name == "--folder";
    if (!known || value == nullptr) {
      std::fprintf(stderr, "usage: %s [--radius VOXELS] [--edits N] [--folder FOLDER] [--short] [--parts] [--arena]\n",
                   argv[0]);
      std::exit(2);
    }
    if (name == "--radius") radius = std::atof(value);
    if (name == "--edits") edits = std::atof(value);
    if (name == "--folder") options.folder = value;
    ++i;
  }
  options.radius = radius.value_or(options.is_short ? 160.0 : 1024.0);
  options.edits = static_cast<int>(edits.value_or(options.is_short ? 200.0 : 10'000.0));
  if (!(options.radius >= 128.0 && options.radius <= 8192.0) || options.edits < 1) {
    std::fprintf(stderr, "the radius must be from 128 to 8192, and the number of edits positive\n");
    std::exit(2);
  }
  if (options.with_arena) use_arena();
  return options;
}

Pace::Pace(const Options& options)
    : frame_(options.is_short ? 2'000 : 16'667), next_(std::chrono::steady_clock::now() + frame_) {}

void Pace::wait() {
  std::this_thread::sleep_until(next_);
  // A game that is late does not catch up.
  next_ = std::max(next_, std::chrono::steady_clock::now() - frame_) + frame_;
}

void Report::line(const std::string& row, const std::string& unit, const std::array<double, 4>& values, bool is_single,
                  const std::vector<Goal>& goals) {
  constexpr std::array kNames = {"median", "p99", "p99.9", "max"};
  std::string text = game_ + '\t' + row + '\t' + unit;
  for (std::size_t i = 0; i < values.size(); ++i) text += '\t' + (is_single && i < 3 ? "" : number(values[i]));
  std::string wanted, missed;
  for (const Goal& goal : goals) {
    const auto of = static_cast<std::size_t>(goal.of);
    wanted += (wanted.empty() ? "" : ", ") + (is_single ? "" : std::string(kNames[of]) + ' ') + number(goal.limit);
    if (values[of] > goal.limit) missed += (missed.empty() ? "" : ", ") + std::string(is_single ? "yes" : kNames[of]);
  }
  std::printf("%s\t%s\t%s\n", text.c_str(), wanted.c_str(), missed.c_str());
  std::fflush(stdout);
}

void Report::samples(const std::string& row, const std::string& unit, std::vector<double> all,
                     std::vector<Goal> goals) {
  if (options_.is_short) return;
  line(row, unit, statistics_of(all), false, goals);
}

void Report::value(const std::string& row, const std::string& unit, double value, std::optional<double> limit) {
  if (options_.is_short) return;
  line(row, unit, {value, value, value, value}, true,
       limit ? std::vector<Goal>{{Statistic::Max, *limit}} : std::vector<Goal>{});
}

void Report::faults(const std::string& row, std::int64_t found, std::int64_t of, const std::string& things) {
  const auto value = static_cast<double>(found);
  line(row, "of " + std::to_string(of) + ' ' + things, {value, value, value, value}, true, {{Statistic::Max, 0.0}});
  if (found != 0) failed_.push_back(row + ": " + std::to_string(found) + " of " + std::to_string(of));
  if (of == 0) failed_.push_back(row + ": nothing was checked");
}

void Report::expect(bool condition, const std::string& text) {
  if (!condition) failed_.push_back(text);
}

int Report::finish() const {
  for (const std::string& text : failed_) std::fprintf(stderr, "%s: failed: %s\n", game_.c_str(), text.c_str());
  return failed_.empty() ? 0 : 1;
}

void FrameMeter::begin() {
  own_ = 0.0;
  own_allocations_ = 0;
  allocations_at_stop_.reset();
  allocations_at_start_ = part_allocations_ = allocations();
  start_ = part_start_ = thread_ms();
}

void FrameMeter::part(const char* name) {
  const double now = thread_ms();
  const std::int64_t before = allocations();
  auto found = parts_.find(name);
  if (found == parts_.end()) found = parts_.emplace(name, Part()).first;
  found->second.ms.push_back(now - part_start_);
  found->second.allocations.push_back(static_cast<double>(before - part_allocations_));
  part_allocations_ = allocations();
  own_allocations_ += part_allocations_ - before;
  part_start_ = thread_ms();
  own_ += part_start_ - now;
}

void FrameMeter::skip() {
  const double now = thread_ms();
  own_ += now - part_start_;
  part_start_ = now;
  own_allocations_ += allocations() - part_allocations_;
  part_allocations_ = allocations();
}

void FrameMeter::stop_counting() {
  allocations_at_stop_ = allocations();
}

void FrameMeter::end() {
  const double time = thread_ms() - start_ - own_;
  const std::int64_t last = allocations_at_stop_.value_or(allocations());
  const auto count = static_cast<double>(last - allocations_at_start_ - own_allocations_);
  frames_.push_back(time);
  allocations_.push_back(count);
}

void FrameMeter::report(Report& report, const Options& options, const std::string& phase, std::vector<Goal> goals,
                        std::optional<double> most_allocations) const {
  report.samples(phase + ": frame", "ms", frames_, std::move(goals));
  for (const auto& [name, part] : parts_) {
    const bool is_update = name == "StreamedWorld::update" || name == "LiveTracer::update";
    const std::vector<Goal> limits{{Statistic::P999, 1.0}, {Statistic::Max, 2.0}};
    if (is_update) report.samples(phase + ":   " + name, "ms", part.ms, limits);
    if (options.with_parts && !is_update) report.samples(phase + ":   " + name, "ms", part.ms);
  }
  std::vector<Goal> few;
  if (most_allocations) few.push_back({Statistic::Median, *most_allocations});
  report.samples(phase + ": allocations", "", allocations_, few);
  if (!options.with_parts) return;
  for (const auto& [name, part] : parts_) report.samples(phase + ":   " + name, "allocations", part.allocations);
}

bool Shown::Key::operator<(const Key& other) const {
  if (grid != other.grid) return grid < other.grid;
  if (chunk != other.chunk) return quoin::ByZyx{}(chunk, other.chunk);
  return content < other.content;
}

void Shown::apply(const std::vector<quoin::SurfaceUpdate>& updates) {
  for (const quoin::SurfaceUpdate& update : updates) {
    const Key key{update.grid, update.chunk, update.content};
    if (update.surface == nullptr) {
      surfaces_.erase(key);
    } else {
      surfaces_[key] = {update.surface, nullptr};
    }
  }
}

const quoin::ChunkSurface* Shown::find(quoin::GridHandle grid, IVec3 chunk, quoin::SurfaceContent content) const {
  const auto found = surfaces_.find({grid, chunk, content});
  return found == surfaces_.end() ? nullptr : found->second.surface.get();
}

std::optional<ShownFace> Shown::face(quoin::GridHandle grid, IVec3 voxel, Direction side) const {
  const quoin::ChunkSurface* const surface = find(grid, quoin::chunk_of(voxel), quoin::SurfaceContent::Voxels);
  if (surface == nullptr) return std::nullopt;
  const FaceFinder finder{*surface, quoin::local_of(voxel), side};
  const IVec3 wanted = finder.local / 16;  // LiveMeshOptions::region_edge
  for (const quoin::SurfaceRegion& region : surface->regions) {
    if (region.region != wanted) continue;
    if (const auto opaque = finder.in(region.opaque)) return opaque;
    return finder.in(region.transparent);
  }
  return std::nullopt;
}

unsigned Shown::faces_around(quoin::GridHandle grid, IVec3 voxel) const {
  unsigned faces = 0;
  for (const Direction side : quoin::kDirections) {
    const auto bit = 2 * static_cast<unsigned>(side);
    const auto opposite = static_cast<Direction>(static_cast<unsigned>(side) ^ 1U);
    if (face(grid, voxel, side)) faces |= 1U << bit;
    if (face(grid, voxel + quoin::normal_of(side), opposite)) faces |= 2U << bit;
  }
  return faces;
}

int Shown::open_edges(quoin::GridHandle grid, const quoin::IBox& chunks) const {
  OddEdges edges;
  for (const auto& [key, entry] : surfaces_) {
    const bool is_inside =
        glm::all(glm::greaterThanEqual(key.chunk, chunks.min)) && glm::all(glm::lessThan(key.chunk, chunks.max));
    if (key.grid != grid || key.content != quoin::SurfaceContent::Field || !is_inside) continue;
    if (entry.open == nullptr) entry.open = std::make_shared<const std::vector<Edge>>(open_edges_of(entry, key.chunk));
    for (const Edge& edge : *entry.open) edges.add(edge);
  }
  const auto is_at_side = [&](const Corner& corner) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t at = corner.at[static_cast<std::size_t>(axis)];
      if (at < (std::int64_t{64} * chunks.min[axis] + 2) * Corner::kUnit) return true;
      if (at > (std::int64_t{64} * chunks.max[axis] - 2) * Corner::kUnit) return true;
    }
    return false;
  };
  return static_cast<int>(std::count_if(edges.all.begin(), edges.all.end(), [&](const Edge& edge) {
    return !is_at_side(edge.first) && !is_at_side(edge.second);
  }));
}

std::vector<Shown::Edge> Shown::open_edges_of(const Entry& entry, IVec3 chunk) {
  std::vector<Corner> corners;
  for (const quoin::Vec3& p : entry.surface->smooth.positions) {
    Corner corner;
    for (int axis = 0; axis < 3; ++axis) {
      corner.at[static_cast<std::size_t>(axis)] =
          std::llround(static_cast<double>(p[axis]) * Corner::kUnit) + std::int64_t{64} * chunk[axis] * Corner::kUnit;
    }
    corners.push_back(corner);
  }
  OddEdges edges;
  const auto& indices = entry.surface->smooth.indices;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Corner& a = corners[indices[i]];
    const Corner& b = corners[indices[i % 3 == 2 ? i - 2 : i + 1]];
    if (!(a == b)) edges.add(std::minmax(a, b));
  }
  return {edges.all.begin(), edges.all.end()};
}

int Shown::differences(const quoin::Scene& scene, bool with_light, quoin::DVec3 eye) const {
  quoin::LiveLight light;
  quoin::LiveMeshes meshes;
  if (with_light) meshes.use_light(light);
  meshes.finish(scene, eye);
  Shown fresh;
  fresh.apply(meshes.take());
  int differences = 0;
  for (const auto& [key, entry] : surfaces_) {
    const auto found = fresh.surfaces_.find(key);
    if (found == fresh.surfaces_.end() || !same_surface(*entry.surface, *found->second.surface)) ++differences;
  }
  for (const auto& [key, entry] : fresh.surfaces_) differences += surfaces_.contains(key) ? 0 : 1;
  return differences;
}

std::pair<std::size_t, std::size_t> Shown::bytes() const {
  std::pair<std::size_t, std::size_t> sum{0, 0};
  for (const auto& [key, entry] : surfaces_) {
    sum.first += entry.surface->bytes();
    sum.second += entry.surface->converted_bytes;
  }
  return sum;
}

unsigned expected_faces(const quoin::Grid& grid, const quoin::VoxelRegistry& types, IVec3 voxel) {
  unsigned faces = 0;
  const quoin::VoxelType own = grid.get(voxel);
  for (const Direction side : quoin::kDirections) {
    const auto bit = 2 * static_cast<unsigned>(side);
    const quoin::VoxelType other = grid.get(voxel + quoin::normal_of(side));
    if (is_visible(types, own, other)) faces |= 1U << bit;
    if (is_visible(types, other, own)) faces |= 2U << bit;
  }
  return faces;
}

void EditWatch::add(std::vector<Voxel> voxels) {
  edits_ += static_cast<std::int64_t>(voxels.size());
  ++frames_;
  waiting_.push_back({std::move(voxels), wall_ms(), process_ms()});
}

void EditWatch::check(const Shown& shown) {
  // Before the checks, which take time themselves.
  const double now_ms = wall_ms(), process_now_ms = process_ms();
  std::erase_if(waiting_, [&](Edits& edits) {
    if (!are_complete(shown, edits)) return false;
    torn_ += edits.was_torn ? 1 : 0;
    doubled_ += edits.was_doubled ? 1 : 0;
    black_ += is_black(shown, edits) ? 1 : 0;
    latencies_ms_.push_back(now_ms - edits.start_ms);
    process_latencies_ms_.push_back(process_now_ms - edits.process_start_ms);
    return true;
  });
}

bool EditWatch::are_complete(const Shown& shown, Edits& edits) {
  std::size_t before = 0, after = 0;
  bool is_doubled = false;
  for (const Voxel& voxel : edits.voxels) {
    const unsigned faces = shown.faces_around(voxel.grid, voxel.voxel);
    before += faces == voxel.before ? 1U : 0U;
    after += faces == voxel.after ? 1U : 0U;
    is_doubled = is_doubled || ((faces & voxel.before) == voxel.before && (faces & ~voxel.before) != 0);
  }
  if (after == edits.voxels.size()) return true;
  if (before == edits.voxels.size()) return false;
  const bool only_doubled = is_doubled && before + after < edits.voxels.size();
  (only_doubled ? edits.was_doubled : edits.was_torn) = true;
  return false;
}

bool EditWatch::is_black(const Shown& shown, const Edits& edits) {
  for (const Voxel& voxel : edits.voxels) {
    if (!voxel.in_daylight) continue;
    for (const Direction side : quoin::kDirections) {
      const auto opposite = static_cast<Direction>(static_cast<unsigned>(side) ^ 1U);
      const bool is_dug = (voxel.after >> (2 * static_cast<unsigned>(side)) & 2U) != 0;
      if (!is_dug) continue;
      const auto face = shown.face(voxel.grid, voxel.voxel + quoin::normal_of(side), opposite);
      if (face && face->brightest == 0) return true;
    }
  }
  return false;
}

bool EditWatch::waits_near(IVec3 voxel) const {
  for (const Edits& edits : waiting_) {
    for (const Voxel& other : edits.voxels) {
      const IVec3 distance = glm::abs(other.voxel - voxel);
      if (std::max({distance.x, distance.y, distance.z}) < 3) return true;
    }
  }
  return false;
}

void EditWatch::report(Report& report, const std::string& phase, std::vector<Goal> latency_goals) {
  report.samples(phase + ": edit to mesh, wall time", "ms", latencies_ms_, std::move(latency_goals));
  report.samples(phase + ": edit to mesh, processor time of the process", "ms", process_latencies_ms_);
  const std::string things = "frames with " + std::to_string(edits_) + " edits";
  report.faults(phase + ": black frames", black_, frames_, things);
  report.faults(phase + ": torn frames", torn_, frames_, things);
  report.faults(phase + ": doubled frames", doubled_, frames_, things);
  report.faults(phase + ": frames never shown", static_cast<std::int64_t>(waiting_.size()), frames_, things);
  *this = EditWatch();
}

void Staging::copy(std::span<const std::byte> bytes) {
  total_ += bytes.size();
  while (!bytes.empty()) {
    const std::size_t part = std::min(bytes.size(), memory_.size() - at_);
    std::memcpy(memory_.data() + at_, bytes.data(), part);
    bytes = bytes.subspan(part);
    at_ = (at_ + part) % memory_.size();
  }
}

bool Staging::ends_with(std::span<const std::byte> bytes) const {
  if (bytes.size() > std::min(total_, memory_.size())) return false;
  const std::size_t before_start = std::min(bytes.size(), at_);
  const auto end_of_last = bytes.last(before_start), at_the_back = bytes.first(bytes.size() - before_start);
  return std::equal(end_of_last.begin(), end_of_last.end(), memory_.data() + at_ - before_start) &&
         std::equal(at_the_back.begin(), at_the_back.end(), memory_.data() + memory_.size() - at_the_back.size());
}

std::map<IVec3, std::uint64_t, quoin::ByZyx> hashes_of(const quoin::SceneGrid& grid) {
  std::map<IVec3, std::uint64_t, quoin::ByZyx> hashes;
  for (const IVec3 at : grid.grid.chunks()) hashes[at] = grid.grid.find_chunk(at)->content_hash();
  for (const IVec3 at : grid.field.chunks()) hashes[at] ^= 31 * grid.field.find_chunk(at)->content_hash();
  return hashes;
}

void fail(const quoin::Error& error) {
  std::fprintf(stderr, "%s\n", quoin::to_string(error).c_str());
  std::exit(error.code == quoin::ErrorCode::Unsupported ? 77 : 2);
}

void report_loading(Report& report, double wall_start_ms, double process_start_ms, std::optional<double> most_seconds) {
  report.value("loading: wall time", "s", 1e-3 * (wall_ms() - wall_start_ms), most_seconds);
  // Two cores that do nothing else need half of it.
  report.value("loading: processor time of the process", "s", 1e-3 * (process_ms() - process_start_ms),
               most_seconds ? std::optional(2.0 * *most_seconds) : std::nullopt);
}

quoin::StreamedWorld open_world(const std::filesystem::path& path) {
  auto world = quoin::StreamedWorld::open_or_create(path);
  require(world);
  return std::move(*world);
}

}  // namespace games

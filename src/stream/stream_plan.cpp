#include "stream/stream_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/chunk.h>

#include "core/coordinates/chunk_order.h"
#include "core/coordinates/long_box.h"

namespace quoin::stream {
namespace {

// Share of the budget to fill when it is too small; the rest avoids reloading chunks at the border.
constexpr double kShareOfWanted = 0.95;
// Chunks outside the view are ranked as if they were this much farther away, if they are not close by.
constexpr double kBehind = 1.75;
constexpr double kCloseBy = 2.0 * kChunkEdge;

double distance_to_chunk(DVec3 point, IVec3 chunk) {
  const DVec3 low = DVec3(chunk) * double{kChunkEdge};
  const DVec3 nearest = glm::clamp(point, low, low + double{kChunkEdge});
  return glm::length(nearest - point);
}

bool is_looked_at(const Eye& eye, IVec3 chunk) {
  const DVec3 to = (DVec3(chunk) + 0.5) * double{kChunkEdge} - eye.position;
  const double length = glm::length(to);
  return length <= kCloseBy || glm::dot(to, eye.direction) >= 0.5 * length || eye.direction == DVec3(0.0);
}

// Maximum number of chunks in a plan at any budget and radius: a ball with a radius of 40 chunks.
constexpr std::size_t kMaxPlanned = std::size_t{1} << 18;

// Returns the radius of a ball of `max_chunks` chunks.
double ball_of(std::size_t max_chunks) {
  return (std::cbrt(static_cast<double>(max_chunks) * 0.75 / std::numbers::pi) + 2.0) * kChunkEdge;
}

// Returns a box of chunks around a ball.
IBox chunks_around(DVec3 centre, DVec3 radius) {
  const LongBox box = clipped(box_around(centre - radius, centre + radius));
  return is_empty(box) ? IBox{} : chunks_of(box);
}

// Calls `visit(chunk)` for the chunks of a box within a radius of a point, row by row, until it returns false.
template <class Visit>
void for_each_within(DVec3 centre, double radius, const IBox& chunks, Visit&& visit) {
  const IBox box = intersect(chunks, chunks_around(centre, DVec3(radius)));
  if (box.empty()) return;
  // The other half edge of a right triangle; the box of its chunks has a margin for rounding.
  const auto other_edge = [](double longest, double edge) {
    return std::sqrt(std::max(longest * longest - edge * edge, 0.0));
  };
  const auto from_slab = [&](int axis, int at) {
    const double low = double{kChunkEdge} * at;
    return std::max({low - centre[axis], centre[axis] - low - kChunkEdge, 0.0});
  };
  for (int z = box.min.z; z < box.max.z; ++z) {
    const double in_layer = other_edge(radius, from_slab(2, z));
    const IBox layer = intersect(box, chunks_around(centre, {radius, in_layer, radius}));
    if (layer.empty()) continue;
    for (int y = layer.min.y; y < layer.max.y; ++y) {
      const double in_row = other_edge(in_layer, from_slab(1, y));
      const IBox row = intersect(box, chunks_around(centre, {in_row, radius, radius}));
      if (row.empty()) continue;
      for (int x = row.min.x; x < row.max.x; ++x) {
        const IVec3 chunk{x, y, z};
        if (distance_to_chunk(centre, chunk) <= radius && !visit(chunk)) return;
      }
    }
  }
}

// Viewers that move less (voxels) and turn less (cosine) than this need no new plan.
constexpr double kMoves = 12.0;
constexpr double kTurns = 0.94;

bool sees_alike(const Eye& a, const Eye& b) {
  if (a.radius != b.radius || a.voxel_size != b.voxel_size) return false;
  if (glm::length(a.position - b.position) > kMoves) return false;
  return a.direction == b.direction || glm::dot(a.direction, b.direction) >= kTurns;
}

}  // namespace

bool see_alike(const Eyes& a, const Eyes& b) {
  return std::ranges::equal(a, b, [](const auto& one, const auto& other) {
    return one.first == other.first && std::ranges::equal(one.second, other.second, sees_alike);
  });
}

bool stays_for(const Eye& eye, IVec3 chunk) {
  // Voxels beyond a viewer's radius.
  constexpr double kMargin = 96.0;
  return distance_to_chunk(eye.position, chunk) <= eye.radius + kMargin;
}

bool is_needed(const StreamRequests& requests, const ChunkAddress& place) {
  const auto eyes = requests.eyes.find(place.grid);
  return (eyes != requests.eyes.end() &&
          std::ranges::any_of(eyes->second, [&](const Eye& eye) { return stays_for(eye, place.chunk); })) ||
         std::ranges::find(requests.asked, place) != requests.asked.end();
}

bool StreamPlan::is_nearer(const Wanted& a, const Wanted& b) {
  const auto key = [](const Wanted& w) {
    return std::tuple(w.distance, w.place.grid, w.place.chunk.z, w.place.chunk.y, w.place.chunk.x);
  };
  return key(a) < key(b);
}

void StreamPlan::set_extent(std::uint32_t grid, const IBox& chunks, std::span<const IVec3> others) {
  Extent extent{chunks, {}};
  for (const IVec3 other : others) extent.others.find_or_create(other, [](auto&) {});
  extents_[grid] = std::move(extent);
}

StreamPlan::State StreamPlan::state_of(const ChunkAddress& place) const {
  const auto grid = known_.find(place.grid);
  if (grid == known_.end()) return State::Unknown;
  const auto found = grid->second.find(place.chunk);
  return found == grid->second.end() ? State::Unknown : found->second.state;
}

void StreamPlan::set_state(const ChunkAddress& place, State state) {
  Grid& grid = known_[place.grid];
  if (const auto extent = extents_.find(place.grid);
      extent != extents_.end() && state != State::Unknown && !extent->second.chunks.contains(place.chunk)) {
    extent->second.others.find_or_create(place.chunk, [](auto&) {});
  }
  auto known = grid.find(place.chunk);
  if (known == grid.end()) {
    if (state == State::Unknown) return;
    known = grid.try_emplace(place.chunk).first;
  }
  const std::uint32_t wanted = known->second.wanted;
  if (wanted != kUnwanted && state == State::Unknown && known->second.state != State::Unknown) {
    queue_.push_back(place);  // it left, or its load was dropped, after the plan was made
  }
  known.value().state = state;
  if (wanted == kUnwanted) {
    if (state == State::Unknown) grid.erase(known);
    return;
  }
  QUOIN_ASSERT(wanted < is_missing_.size(), "an index of this plan");
  if (is_missing_[wanted] == is_missing(state)) return;
  is_missing_[wanted] = is_missing(state);
  if (is_missing(state)) {
    ++missing_count_;
    here_ = std::min(here_, std::size_t{wanted});
  } else {
    --missing_count_;
  }
}

std::size_t StreamPlan::entries() const {
  std::size_t sum = 0;
  for (const auto& [grid, known] : known_) sum += known.size();
  return sum;
}

void StreamPlan::plan(StreamRequests requests) {
  begin_plan();
  requests_ = std::move(requests);
  requests_.max_chunks = std::min(requests_.max_chunks, kMaxPlanned);
  find_wanted();
  cut_to_budget();
  mark_wanted();
  find_queue();
  find_leaving();
}

// Drops the last plan, so that no stale entries are left if memory runs out.
void StreamPlan::begin_plan() {
  queue_.clear();
  leaving_.clear();
  wanted_.clear();
  is_missing_.clear();
  next_ = asked_ = here_ = missing_count_ = 0;
  for (auto& [grid, known] : known_) {
    for (auto each = known.begin(); each != known.end();) {
      if (each->second.state == State::Unknown) {
        each = known.erase(each);
      } else {
        each.value().wanted = kUnwanted;
        ++each;
      }
    }
  }
}

StreamPlan::Wanted StreamPlan::measured(const ChunkAddress& place, const std::vector<Eye>& eyes) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Wanted all{place, kFar, kFar};
  for (const Eye& eye : eyes) {
    const double distance = distance_to_chunk(eye.position, place.chunk) * eye.voxel_size;
    all.distance = std::min(all.distance, distance);
    all.rank = std::min(all.rank, is_looked_at(eye, place.chunk) ? distance : distance * kBehind);
  }
  return all;
}

// Returns the radius to look at: the viewer's or, if the budget cuts the plan anyway, a smaller one with more chunks
// than the budget allows.
double StreamPlan::reach_of(const Eye& eye, const Extent& extent) const {
  const std::size_t most = requests_.max_chunks;
  for (double reach = ball_of(most); reach < eye.radius; reach *= 1.25) {
    std::size_t count = 0;
    for_each_within(eye.position, reach, extent.chunks, [&](IVec3) { return ++count <= most; });
    if (count > most) return reach;
    extent.others.for_each_in(chunks_around(eye.position, DVec3(reach)), [&](IVec3 chunk, const Mark&) {
      count += static_cast<std::size_t>(distance_to_chunk(eye.position, chunk) <= reach);
    });
    if (count > most) return reach;
  }
  return eye.radius;
}

void StreamPlan::find_wanted() {
  for (const auto& [grid, eyes] : requests_.eyes) {
    add_wanted(grid, eyes);
    // With many grids, keeps as many as could be wanted, plus one that shows that there were more.
    if (wanted_.size() > 2 * requests_.max_chunks + 1) {
      const auto end = wanted_.begin() + static_cast<std::ptrdiff_t>(requests_.max_chunks + 1);
      std::nth_element(wanted_.begin(), end, wanted_.end(), is_nearer);
      wanted_.erase(end, wanted_.end());
    }
  }
  std::ranges::sort(wanted_, is_nearer);
}

// Appends the chunks of a grid's extent around its viewers.
void StreamPlan::add_wanted(std::uint32_t grid, const std::vector<Eye>& eyes) {
  static const Extent whole{{IVec3(kMinChunk + 1), IVec3(kMaxChunk)}, {}};
  const auto limited = extents_.find(grid);
  const Extent& extent = limited == extents_.end() ? whole : limited->second;
  std::vector<IVec3> chunks;
  for (const Eye& eye : eyes) {
    QUOIN_ASSERT(is_finite(eye.position) && eye.radius >= 0.0 && eye.voxel_size > 0.0,
                 "a finite position, a radius, and a positive voxel size");
    const double radius = reach_of(eye, extent);
    for_each_within(eye.position, radius, extent.chunks, [&](IVec3 chunk) {
      if (is_inside_world(chunk)) chunks.push_back(chunk);
      return true;
    });
    extent.others.for_each_in(chunks_around(eye.position, DVec3(radius)), [&](IVec3 chunk, const Mark&) {
      if (distance_to_chunk(eye.position, chunk) <= radius) chunks.push_back(chunk);
    });
  }
  if (eyes.size() > 1) sort_and_unite(chunks);
  for (const IVec3 chunk : chunks) wanted_.push_back(measured({grid, 0, chunk}, eyes));
}

void StreamPlan::cut_to_budget() {
  is_cut_ = wanted_.size() > requests_.max_chunks;
  if (!is_cut_) return;
  const auto fits = static_cast<std::size_t>(static_cast<double>(requests_.max_chunks) * kShareOfWanted);
  wanted_.resize(std::min(wanted_.size(), fits));
}

// Lists the wanted chunks by their coordinates, and which of them are not loaded.
void StreamPlan::mark_wanted() {
  QUOIN_ASSERT(wanted_.size() < kUnwanted, "indices of 32 bits");
  is_missing_.assign(wanted_.size(), false);
  for (std::size_t i = 0; i < wanted_.size(); ++i) {
    const auto known = known_[wanted_[i].place.grid].try_emplace(wanted_[i].place.chunk).first;
    known.value().wanted = static_cast<std::uint32_t>(i);
    if (!is_missing(known->second.state)) continue;
    is_missing_[i] = true;
    ++missing_count_;
  }
}

void StreamPlan::find_queue() {
  std::vector<Wanted> missing;
  for (std::size_t i = 0; i < wanted_.size(); ++i) {
    if (is_missing_[i] && state_of(wanted_[i].place) == State::Unknown) missing.push_back(wanted_[i]);
  }
  std::ranges::stable_sort(missing, [](const Wanted& a, const Wanted& b) { return a.rank < b.rank; });
  for (const Wanted& each : missing) queue_.push_back(each.place);
}

// Collects the loaded chunks to unload. Unwanted chunks stay while they are near and there is room.
void StreamPlan::find_leaving() {
  std::vector<Wanted> others;
  const std::vector<Eye> nobody;
  for (const auto& [grid, states] : known_) {
    const auto eyes = requests_.eyes.find(grid);
    for (const auto& [chunk, known] : states) {
      if (known.state != State::Here || known.wanted != kUnwanted) continue;
      others.push_back(measured({grid, 0, chunk}, eyes == requests_.eyes.end() ? nobody : eyes->second));
    }
  }
  std::ranges::sort(others, is_nearer);
  std::size_t room = requests_.max_chunks > wanted_.size() ? requests_.max_chunks - wanted_.size() : 0;
  const auto is_near = [&](const Wanted& each) {
    const auto eyes = requests_.eyes.find(each.place.grid);
    return eyes != requests_.eyes.end() &&
           std::ranges::any_of(eyes->second, [&](const Eye& eye) { return stays_for(eye, each.place.chunk); });
  };
  for (const Wanted& each : others) {
    if (room != 0 && is_near(each)) {
      --room;
    } else {
      leaving_.push_back(each.place);
    }
  }
  std::ranges::reverse(leaving_);
}

bool StreamPlan::next(ChunkAddress& place, bool has_room) {
  const auto take_from = [&](const std::vector<ChunkAddress>& places, std::size_t& at) {
    while (at < places.size()) {
      place = places[at];
      const bool is_new = state_of(place) == State::Unknown;
      if (is_new) set_state(place, State::Begun);
      ++at;
      if (is_new) return true;
    }
    return false;
  };
  return take_from(requests_.asked, asked_) || (has_room && take_from(queue_, next_));
}

std::vector<ChunkAddress> StreamPlan::take_leaving() {
  return std::exchange(leaving_, {});
}

double StreamPlan::complete_radius() {
  while (here_ < wanted_.size() && !is_missing_[here_]) ++here_;
  if (here_ < wanted_.size()) return wanted_[here_].distance;
  if (is_cut_) return wanted_.empty() ? 0.0 : wanted_.back().distance;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [grid, eyes] : requests_.eyes) {
    for (const Eye& eye : eyes) least = std::min(least, eye.radius * eye.voxel_size);
  }
  return std::isfinite(least) ? least : 0.0;
}

namespace {

// World units: placements farther away are ignored.
constexpr double kMaxRadius = 1e12;
// Number of other placements checked per update.
constexpr std::size_t kSlice = 256;

void add_eyes(const Instance& instance, const SceneGrid& grid, std::span<const Viewer> viewers,
              std::vector<Eye>& eyes) {
  for (const Viewer& viewer : viewers) {
    if (!is_finite(viewer.position) || !(viewer.radius > 0.0)) continue;
    Eye eye;
    eye.position = grid_from_world(instance, grid, viewer.position);
    eye.radius = std::min(viewer.radius, kMaxRadius) / instance.voxel_size;
    eye.voxel_size = instance.voxel_size;
    const double length = glm::length(viewer.direction);
    if (std::isfinite(length) && length > 0.0) {
      eye.direction = glm::normalize(grid_from_world_direction(instance, viewer.direction / length));
    }
    if (is_finite(eye.position) && std::isfinite(eye.radius)) eyes.push_back(eye);
  }
}

double distance_of(const Eye& eye, const SceneGrid& grid) {
  return glm::length(eye.position - grid.pivot) * eye.voxel_size;
}

double distance_of(const Instance& instance, const SceneGrid& grid, std::span<const Viewer> viewers) {
  double least = std::numeric_limits<double>::infinity();
  for (const Viewer& viewer : viewers) {
    const double distance =
        glm::length(grid_from_world(instance, grid, viewer.position) - grid.pivot) * instance.voxel_size;
    if (distance < least) least = distance;  // false of NaN
  }
  return least;
}

}  // namespace

void Placements::clear() {
  placed_.clear();
  index_.clear();
  moved_.clear();
  looked_at_ = false;
}

void Placements::put(InstanceHandle instance) {
  const auto [found, is_new] = index_.try_emplace(instance, placed_.size());
  if (is_new) placed_.push_back({instance});
  if (found->second >= kNearest) moved_.push_back(instance);
}

void Placements::swap(std::size_t a, std::size_t b) {
  QUOIN_ASSERT(a < placed_.size() && b < placed_.size(), "two of the placements");
  std::swap(placed_[a], placed_[b]);
  index_[placed_[a].instance] = a;
  index_[placed_[b].instance] = b;
}

void Placements::remove(InstanceHandle instance) {
  const auto found = index_.find(instance);
  if (found == index_.end()) return;
  const std::size_t at = found->second;
  QUOIN_ASSERT(at < placed_.size() && placed_[at].instance == instance, "an index that matches the list");
  if (at + 1 != placed_.size()) swap(at, placed_.size() - 1);
  placed_.pop_back();
  index_.erase(instance);
  // The set of nearest placements has changed, even if another placement moved last.
  if (at < kNearest && placed_.size() > kNearest) looked_at_ = false;
}

void extend(DBox& world, const Scene& scene, const Instance& instance, const DBox& voxels) {
  const SceneGrid& grid = scene.grids()[instance.grid];
  for (int i = 0; i < 8; ++i) world.extend(world_from_grid(instance, grid, box_corner(voxels, i)));
}

void Placements::extend(DBox& world, const Scene& scene, const IBox& chunks) const {
  if (chunks.empty()) return;
  const DBox voxels{DVec3(chunks.min) * double{kChunkEdge}, DVec3(chunks.max) * double{kChunkEdge}};
  for (const Placed& placed : placed_) {
    const Instance* const instance = scene.instances().find(placed.instance);
    if (instance != nullptr) stream::extend(world, scene, *instance, voxels);
  }
}

// Moves placements that are nearer than the farthest of the nearest set into that set.
void Placements::look(const Scene& scene, const SceneGrid& grid, std::span<const Viewer> viewers) {
  QUOIN_ASSERT(placed_.size() > kNearest, "more placements than are checked each time");
  const auto measure = [&](std::size_t at) {
    const Instance* const instance = scene.instances().find(placed_[at].instance);
    placed_[at].distance =
        instance == nullptr ? std::numeric_limits<double>::infinity() : distance_of(*instance, grid, viewers);
  };
  if (!looked_at_) {
    for (std::size_t i = 0; i < placed_.size(); ++i) measure(i);
    const auto end = placed_.begin() + static_cast<std::ptrdiff_t>(kNearest);
    std::nth_element(placed_.begin(), end, placed_.end(), [](const Placed& a, const Placed& b) {
      return a.distance != b.distance ? a.distance < b.distance : a.instance < b.instance;
    });
    for (std::size_t i = 0; i < placed_.size(); ++i) index_[placed_[i].instance] = i;
    moved_.clear();
    looked_at_ = true;
    return;
  }
  for (std::size_t i = 0; i < kNearest; ++i) measure(i);
  const auto bring = [&](std::size_t at) {
    measure(at);
    const auto near = std::span(placed_).first(kNearest);
    const auto farthest = std::ranges::max_element(near, {}, &Placed::distance);
    if (placed_[at].distance < farthest->distance) swap(at, static_cast<std::size_t>(farthest - near.begin()));
  };
  for (const InstanceHandle instance : std::exchange(moved_, {})) {
    const auto found = index_.find(instance);
    if (found != index_.end() && found->second >= kNearest) bring(found->second);
  }
  for (std::size_t i = 0; i < std::min(kSlice, placed_.size() - kNearest); ++i) {
    if (next_ >= placed_.size()) next_ = kNearest;
    bring(next_++);
  }
}

void Placements::find_eyes(const Scene& scene, const SceneGrid& grid, std::span<const Viewer> viewers,
                           std::vector<Eye>& eyes) {
  if (placed_.size() > kNearest) look(scene, grid, viewers);
  // The order depends only on the instances.
  near_.clear();
  for (std::size_t i = 0; i < std::min(kNearest, placed_.size()); ++i) near_.push_back(placed_[i].instance);
  std::sort(near_.begin(), near_.end());
  eyes.clear();
  for (const InstanceHandle handle : near_) {
    const Instance* const instance = scene.instances().find(handle);
    if (instance != nullptr) add_eyes(*instance, grid, viewers, eyes);
  }
  if (eyes.size() <= kNearest) return;
  std::ranges::stable_sort(eyes, {}, [&](const Eye& eye) { return distance_of(eye, grid); });
  eyes.resize(kNearest);
}

namespace {

// Bytes per loaded chunk in addition to its voxels and densities: marks, sizes and states.
constexpr std::size_t kChunkBytes = 256;
// Assumed bytes per chunk before any is loaded.
constexpr double kGuessedChunkBytes = 24.0 * 1024.0;
constexpr std::size_t kGuessBelow = 64;
constexpr std::size_t kLeastChunks = 8;
// Largest growth from one plan to the next. No growth while many chunks are missing, whose size is unknown.
constexpr double kGrows = 1.1;
constexpr double kMostMissing = 0.25;
// Bytes derived per chunk byte before any measurement: meshes of smooth ground take more, of blocks less.
constexpr double kGuessedRatio = 1.5;
// Seconds in which new measurements replace two thirds of the estimate. The estimate falls more slowly than it rises.
constexpr double kRises = 3.0;
constexpr double kFalls = 8.0;
// Share of the budget to plan for. The rest covers uncounted memory (journals, plans, worker and store caches) and
// allocator fragmentation: 10 % on average in half-hour flights, 12.5 % at most.
constexpr double kShareOfBudget = 0.86;

}  // namespace

std::size_t loaded_bytes(const StoredChunk& chunk) {
  return kChunkBytes + chunk.voxels.bytes() + (chunk.densities ? chunk.densities->bytes() : 0);
}

std::size_t loaded_bytes(const SceneGrid& content, IVec3 chunk) {
  const Chunk* const voxels = content.grid.find_chunk(chunk);
  const DensityChunk* const densities = content.field.find_chunk(chunk);
  return kChunkBytes + (voxels == nullptr ? 0 : voxels->bytes()) + (densities == nullptr ? 0 : densities->bytes());
}

StreamBudget::StreamBudget(std::size_t bytes, bool has_others)
    : budget_(bytes), ratio_(has_others ? kGuessedRatio : 0.0) {}

void StreamBudget::set_others(std::size_t reported, std::size_t pending, bool is_quiet, Clock::time_point now) {
  const double seconds = is_reported_ ? std::chrono::duration<double>(now - announced_).count() : 0.0;
  const bool is_other = !is_reported_ || reported != reported_;
  if (!is_reported_ || chunks_ == 0) {
    fixed_ = reported;
  } else {
    fixed_ = std::min(fixed_, reported);
  }
  if (is_reported_ && (is_other || is_quiet) && chunks_ >= kGuessBelow) {
    const double found =
        static_cast<double>(reported - fixed_) / static_cast<double>(std::max(chunk_bytes_, std::size_t{1}));
    ratio_ += (found - ratio_) * (1.0 - std::exp(-seconds / (found > ratio_ ? kRises : kFalls)));
  }
  reported_ = reported;
  pending_ = pending;
  announced_ = now;
  is_reported_ = true;
}

double StreamBudget::limit() const {
  return static_cast<double>(budget_) * kShareOfBudget;
}

double StreamBudget::used() const {
  return static_cast<double>(chunk_bytes_ + arrived_bytes_ + reported_ + pending_);
}

double StreamBudget::expected() const {
  const double made = (1.0 + ratio_) * static_cast<double>(chunk_bytes_ + arrived_bytes_);
  return std::max(used(), made + static_cast<double>(fixed_ + pending_));
}

std::int64_t StreamBudget::guess() const {
  const double mean = chunks_ == 0 ? 0.0 : static_cast<double>(chunk_bytes_) / static_cast<double>(chunks_);
  return static_cast<std::int64_t>(std::max(mean, kGuessedChunkBytes));
}

std::int64_t StreamBudget::room(std::size_t begun) const {
  return static_cast<std::int64_t>((limit() - expected()) / (1.0 + ratio_)) -
         guess() * static_cast<std::int64_t>(begun);
}

// Near chunks take more bytes than far ones. If the budget limits the plan, the count is found step by step: it shrinks
// at once and grows when nearly all wanted chunks are loaded.
std::size_t StreamBudget::chunks(std::size_t planned, bool is_cut, double missing) const {
  QUOIN_ASSERT(missing >= 0.0 && missing <= 1.0, "a share of 0 to 1");
  const double total = expected();
  const auto at_least = [](double count) { return std::max(static_cast<std::size_t>(count), kLeastChunks); };
  if (chunks_ < kGuessBelow && !is_cut) {
    const double each = std::max(kGuessedChunkBytes * (1.0 + ratio_), total / static_cast<double>(kGuessBelow));
    return at_least(limit() / each);
  }
  const double ratio = limit() / std::max(total, 1.0);
  const double fit = static_cast<double>(chunks_) * std::min(ratio, 1e6);
  if (!is_cut) return at_least(fit);
  const auto were = static_cast<double>(planned);
  if (ratio < 1.0) return at_least(std::min(fit, were));
  // Extrapolates to all wanted chunks: a moving viewer never has all of them.
  const double ratio_of_all = missing < kMostMissing ? ratio * (1.0 - missing) : 1.0;
  return at_least(were * std::clamp(ratio_of_all, 1.0, kGrows));
}

}  // namespace quoin::stream

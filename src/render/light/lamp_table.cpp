#include "render/light/lamp_table.h"
#include "scene/tracer/placed_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"
#include "trace/tree_view.h"

namespace quoin {
namespace {

// Maximum light on a white surface at a lamp's reach: less than one step of an 8-bit image.
constexpr double kLeastLight = 1.0 / 4096.0;
constexpr std::size_t kMaxKept = 2;  // tables
constexpr int kBricksAChunk = kChunkEdge / LampTable::kBrick;

double largest(Vec3 light) {
  return std::max({light.x, light.y, light.z});
}

// Returns the maximum light over all directions, times the squared distance.
double most_power(const PlacedLamp& lamp) {
  if (lamp.is_point) return largest(lamp.power[0]);
  double sum = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double most = std::max(largest(lamp.power[2 * axis]), largest(lamp.power[2 * axis + 1]));
    sum += most * most;
  }
  return std::sqrt(sum);
}

// Limited so that sums and squares stay finite.
constexpr double kMostPower = 1e30;
Vec3 capped(DVec3 power) {
  return Vec3(glm::clamp(power, DVec3(0.0), DVec3(kMostPower)));
}

PlacedLamp placed_cell(const EmissiveCell& cell, const LampPlace& place, double brightness) {
  QUOIN_ASSERT(place.voxel_size > 0.0, "a positive voxel size");
  const double size = place.voxel_size;
  PlacedLamp lamp;
  lamp.position = place.position + place.axes * ((cell.centre - place.pivot) * size);
  lamp.axes = place.axes;
  // A face of radiance L lights a facing surface by L / pi, since the sun's 1 is an irradiance of pi.
  const double scale = brightness * size * size / std::numbers::pi;
  for (std::size_t face = 0; face < 6; ++face) lamp.power[face] = capped(DVec3(cell.power[face]) * scale);
  lamp.spread_squared = cell.spread_squared * size * size;
  lamp.low = (DVec3(cell.box.min) - cell.centre) * size;
  lamp.high = (DVec3(cell.box.max) - cell.centre) * size;
  lamp.reach = std::sqrt(most_power(lamp) / kLeastLight);
  return lamp;
}

bool shines(const Lamp& lamp) {
  const bool is_finite_lamp =
      is_finite(lamp.position) && std::isfinite(lamp.intensity) && is_finite(DVec3(lamp.colour));
  if (!is_finite_lamp || !(lamp.intensity > 0.0) || !(lamp.range > 0.0)) return false;
  if (lamp.kind == Lamp::Kind::Point) return true;
  return is_finite(lamp.direction) && lamp.direction != DVec3(0.0) && std::isfinite(lamp.inner_angle_radians) &&
         std::isfinite(lamp.outer_angle_radians);
}

PlacedLamp placed_lamp(const Lamp& from, double brightness) {
  PlacedLamp lamp;
  lamp.position = from.position;
  lamp.is_point = true;
  lamp.power[0] = capped(DVec3(from.colour) * std::min(from.intensity * brightness, kMostPower));
  lamp.reach = std::min(std::sqrt(most_power(lamp) / kLeastLight), from.range);
  if (from.kind == Lamp::Kind::Point) return lamp;
  const DVec3 size = glm::abs(from.direction);
  lamp.direction = glm::normalize(from.direction / std::max({size.x, size.y, size.z}));
  lamp.cos_inner = std::cos(std::clamp(from.inner_angle_radians, 0.0, std::numbers::pi));
  lamp.cos_outer =
      std::min(std::cos(std::clamp(from.outer_angle_radians, 0.0, std::numbers::pi)), lamp.cos_inner - 1e-6);
  return lamp;
}

struct Sphere {
  DVec3 centre{0.0};
  double radius = 0.0;
};

// In the world, of a cube of `edge` voxels.
Sphere sphere_of(const LampPlace& place, IVec3 corner, int edge) {
  const DVec3 middle = DVec3(corner) + 0.5 * edge - place.pivot;
  return {place.position + place.axes * (middle * place.voxel_size),
          0.5 * edge * std::numbers::sqrt3 * place.voxel_size};
}

// Returns the maximum light that a lamp can add to any point of a sphere; 0 if the sphere is out of reach.
double most_light(const PlacedLamp& lamp, double power, const Sphere& sphere) {
  const double nearest = std::max(glm::length(lamp.position - sphere.centre) - sphere.radius, 0.0);
  if (nearest >= lamp.reach) return 0.0;
  constexpr double kNearest = 1e-4;
  return power / (nearest * nearest + std::max(lamp.spread_squared, kNearest));
}

// The bricks of a chunk that hold anything, as bits.
std::uint64_t bricks_of(const trace::TreeNodes& nodes, IVec3 chunk) {
  const trace::ChunkNode* node = nodes.find_chunk(chunk);
  std::uint64_t held = 0;
  for (std::size_t brick = 0; node != nullptr && brick < 64; ++brick) {
    held |= static_cast<std::uint64_t>(node->bricks[brick] != trace::kEmptyBrick) << brick;
  }
  return held;
}

// The lists of one placed grid.
class ListMaker {
 public:
  ListMaker(const std::vector<PlacedLamp>& lamps, const std::vector<double>& power, int max_lamps)
      : lamps_(&lamps), power_(&power), max_lamps_(static_cast<std::size_t>(max_lamps)) {
    QUOIN_ASSERT(power.size() == lamps.size() && max_lamps >= 1, "the power of each lamp, and lists with room for one");
  }

  // Adds some chunks of a placed grid.
  void add(const LampPlace& place, std::int32_t index, std::span<const IVec3> chunks) {
    QUOIN_ASSERT(place.opaque != nullptr, "the tree of the grid's opaque voxels");
    const trace::TreeNodes opaque(*place.opaque);
    for (const IVec3 chunk : chunks) {
      const IVec3 corner = chunk * kChunkEdge;
      find_near(sphere_of(place, corner, kChunkEdge));
      if (near_.empty()) continue;
      std::uint64_t held = bricks_of(opaque, chunk);
      for (const OccupancyTree* const other : {place.transparent, place.cells, place.shapes}) {
        if (other != nullptr) held |= bricks_of(trace::TreeNodes(*other), chunk);
      }
      for (std::uint64_t left = held; left != 0; left &= left - 1) {
        const int bit = std::countr_zero(left);
        const IVec3 brick = chunk * kBricksAChunk + IVec3{bit & 3, bit >> 2 & 3, bit >> 4};
        add_brick(brick, index, sphere_of(place, brick * LampTable::kBrick, LampTable::kBrick));
      }
    }
  }

  std::vector<LampTable::Brick> bricks;
  std::vector<std::uint32_t> lists;

 private:
  void find_near(const Sphere& sphere) {
    near_.clear();
    for (std::size_t i = 0; i < lamps_->size(); ++i) {
      if (most_light((*lamps_)[i], (*power_)[i], sphere) > 0.0) near_.push_back(static_cast<std::uint32_t>(i));
    }
  }

  void add_brick(IVec3 brick, std::int32_t placed, const Sphere& sphere) {
    found_.clear();
    for (const std::uint32_t i : near_) {
      const double most = most_light((*lamps_)[i], (*power_)[i], sphere);
      if (most > 0.0) found_.emplace_back(-most, i);
    }
    if (found_.empty()) return;
    if (found_.size() > max_lamps_) {
      std::nth_element(found_.begin(), found_.begin() + static_cast<std::ptrdiff_t>(max_lamps_) - 1, found_.end());
      found_.resize(max_lamps_);
    }
    std::sort(found_.begin(), found_.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    bricks.push_back(
        {brick, placed, static_cast<std::uint32_t>(lists.size()), static_cast<std::uint32_t>(found_.size()), {}});
    for (const auto& [most, i] : found_) lists.push_back(i);
  }

  const std::vector<PlacedLamp>* lamps_;
  const std::vector<double>* power_;
  std::size_t max_lamps_;
  std::vector<std::uint32_t> near_;
  std::vector<std::pair<double, std::uint32_t>> found_;
};

void put_bricks(std::vector<ListMaker>& made, LampTable& table) {
  std::size_t count = 0;
  for (const ListMaker& each : made) count += each.bricks.size();
  table.bricks.resize(std::bit_ceil(2 * count + 1));
  const std::size_t mask = table.bricks.size() - 1;
  for (ListMaker& each : made) {
    const auto first = static_cast<std::uint32_t>(table.lists.size());
    table.lists.insert(table.lists.end(), each.lists.begin(), each.lists.end());
    for (LampTable::Brick brick : each.bricks) {
      QUOIN_ASSERT(brick.count != 0 && std::size_t{brick.first} + brick.count <= each.lists.size(),
                   "lamps of its list");
      table.longest = std::max(table.longest, static_cast<int>(brick.count));
      brick.first += first;
      std::size_t slot = LampTable::slot_of(brick.brick, brick.placed) & mask;
      while (table.bricks[slot].count != 0) slot = (slot + 1) & mask;
      table.bricks[slot] = brick;
    }
  }
}

// Returns the chunks with voxels or field cells. Cells begin one sample before their chunk.
std::vector<IVec3> chunks_of(const LampPlace& place) {
  std::vector<IVec3> chunks = place.voxels->chunks();
  if (place.cells == nullptr) return chunks;
  for (const IVec3 chunk : place.field->chunks()) {
    for (int i = 0; i < 8; ++i) chunks.push_back(chunk - IVec3{i & 1, i >> 1 & 1, i >> 2});
  }
  sort_and_unite(chunks);
  return chunks;
}

// Works on several threads, some chunks at a time; the result is in the order of places and chunks.
void make_lists(std::span<const LampPlace> places, int max_lamps, Threads threads, LampTable& table) {
  constexpr std::size_t kChunksATask = 16;
  struct Task {
    std::size_t place = 0;
    std::span<const IVec3> chunks;
  };
  std::vector<std::vector<IVec3>> chunks;
  chunks.reserve(places.size());
  for (const LampPlace& place : places) chunks.push_back(chunks_of(place));
  std::vector<Task> tasks;
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t first = 0; first < chunks[i].size(); first += kChunksATask) {
      tasks.push_back({i, std::span(chunks[i]).subspan(first, std::min(kChunksATask, chunks[i].size() - first))});
    }
  }
  std::vector<double> power;
  power.reserve(table.lamps.size());
  for (const PlacedLamp& lamp : table.lamps) power.push_back(most_power(lamp));
  std::vector<ListMaker> made(tasks.size(), ListMaker(table.lamps, power, max_lamps));
  parallel_for(tasks.size(), threads, [&](std::size_t i) {
    made[i].add(places[tasks[i].place], static_cast<std::int32_t>(tasks[i].place), tasks[i].chunks);
  });
  put_bricks(made, table);
}

}  // namespace

std::vector<PlacedLamp> placed_lamps(const Scene& scene, double brightness) {
  std::vector<PlacedLamp> lamps;
  for (const Lamp& lamp : scene.lamps) {
    if (shines(lamp)) lamps.push_back(placed_lamp(lamp, brightness));
  }
  return lamps;
}

LampRay lamp_ray(const PlacedLamp& lamp, DVec3 to_lamp, DVec3 normal) {
  LampRay ray;
  const double squared = glm::dot(to_lamp, to_lamp);
  const double distance = std::sqrt(squared);
  if (!(distance < lamp.reach) || !(distance > 0.0)) return ray;
  ray.direction = to_lamp / distance;
  const double cosine = glm::dot(normal, ray.direction);
  if (!(cosine > 0.0)) return ray;
  const double share = distance / lamp.reach;
  const double fading = 1.0 - share * share * share * share;
  double factor = cosine * fading / (squared + lamp.spread_squared);
  ray.distance = distance;
  if (lamp.is_point) {
    if (lamp.cos_inner > -2.0) {
      const double towards = -glm::dot(lamp.direction, ray.direction);
      const double cone = std::clamp((towards - lamp.cos_outer) / (lamp.cos_inner - lamp.cos_outer), 0.0, 1.0);
      factor *= cone * cone;
    }
    ray.light = lamp.power[0] * static_cast<float>(factor);
    return ray;
  }
  const DVec3 own = -ray.direction * lamp.axes;  // the transposed matrix times it
  double inside = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double along = own[axis];
    const auto face = static_cast<std::size_t>(2 * axis + (along < 0.0 ? 1 : 0));
    ray.light += lamp.power[face] * static_cast<float>(std::abs(along) * factor);
    if (along != 0.0) inside = std::min(inside, (along > 0.0 ? lamp.high : lamp.low)[axis] / along);
  }
  // Slightly in front of the box, because of rounding.
  ray.distance = distance - inside * (1.0 + 1e-6) - 1e-3 * (lamp.high.x - lamp.low.x);
  return ray;
}

std::span<const std::uint32_t> LampTable::at(IVec3 brick, std::int32_t placed) const {
  QUOIN_ASSERT(std::has_single_bit(bricks.size()), "a power of two");
  const std::size_t mask = bricks.size() - 1;
  for (std::size_t slot = slot_of(brick, placed) & mask; bricks[slot].count != 0; slot = (slot + 1) & mask) {
    const Brick& found = bricks[slot];
    if (found.brick == brick && found.placed == placed) return std::span(lists).subspan(found.first, found.count);
  }
  return {};
}

LampPlace lamp_place(const Scene& scene, const PlacedGrid& placed, const OccupancyTree& opaque,
                     const OccupancyTree* transparent, const DensityTree* field) {
  const GridHandle grid = scene.instances()[placed.instance].grid;
  const SceneGrid& content = scene.grids()[grid];
  return {grid,
          &content.grid,
          &content.field,
          placed.pivot,
          placed.world_axes,
          placed.position,
          placed.voxel_size,
          &opaque,
          transparent,
          field == nullptr ? nullptr : &field->cells()};
}

void LampCache::update() {
  const std::lock_guard lock(mutex_);
  kept_.clear();
}

std::shared_ptr<const LampTable> LampCache::table(const Scene& scene, const LightOptions& light, double brightness,
                                                  Threads threads, FunctionRef<std::vector<LampPlace>()> places_of) {
  if (light.max_lamps == 0 || brightness == 0.0 || light.shading != Shading::Lit) return nullptr;
  const std::lock_guard lock(mutex_);
  const auto known = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) {
    return kept.max_lamps == light.max_lamps && kept.brightness == brightness;
  });
  if (known != kept_.end()) {
    std::rotate(known, known + 1, kept_.end());
    return kept_.back().table;
  }
  const std::vector<LampPlace> places = places_of();
  auto made = std::make_shared<LampTable>();
  made->lamps = lamps_of(scene, places, brightness);
  if (!made->lamps.empty()) make_lists(places, light.max_lamps, threads, *made);
  if (kept_.size() == kMaxKept) kept_.erase(kept_.begin());
  kept_.push_back({light.max_lamps, brightness, made->lists.empty() ? nullptr : std::move(made)});
  return kept_.back().table;
}

std::vector<PlacedLamp> LampCache::lamps_of(const Scene& scene, std::span<const LampPlace> places, double brightness) {
  for (auto* const kept : {&cells_, &field_cells_}) {
    std::erase_if(*kept, [&](const auto& each) { return scene.grids().find(each.first) == nullptr; });
  }
  std::vector<PlacedLamp> lamps = placed_lamps(scene, brightness);
  std::map<GridHandle, bool> is_known;
  for (const LampPlace& place : places) {
    EmissiveCells& cells = cells_[place.grid];
    if (is_known.try_emplace(place.grid, true).second) cells.update(*place.voxels, scene.types);
    cells.for_each([&](const EmissiveCell& cell) { lamps.push_back(placed_cell(cell, place, brightness)); });
    if (place.cells == nullptr) continue;
    EmissiveCells& of_field = field_cells_[place.grid];
    of_field.update(*place.field, scene.types);
    of_field.for_each([&](const EmissiveCell& cell) { lamps.push_back(placed_cell(cell, place, brightness)); });
  }
  return lamps;
}

}  // namespace quoin

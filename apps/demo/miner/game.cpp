#include "game.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <quoin/terrain/terrain.h>

namespace miner {

namespace {

using quoin::DVec3;
using quoin::IVec3;
using quoin::kAir;

constexpr double kFrame = 1.0 / 60.0;
constexpr DVec3 kUp{0.0, 1.0, 0.0};
// Of instances.
constexpr std::uint32_t kLand = 1;
constexpr std::uint32_t kShips = 2;

quoin::SlideOptions on_foot() {
  quoin::SlideOptions options;
  options.floor = quoin::FloorOptions{kUp, 50.0, 1.05, 0.3};
  return options;
}

quoin::SceneGrid ship_of(quoin::VoxelType hull, quoin::VoxelType light) {
  quoin::SceneGrid ship;
  ship.name = "ship";
  ship.grid.fill_box({{2, 0, 0}, {7, 2, 16}}, hull);
  ship.grid.fill_box({{0, 1, 5}, {9, 2, 12}}, hull);
  ship.grid.fill_box({{3, 2, 4}, {6, 4, 10}}, hull);
  ship.grid.set({4, 1, 15}, light);
  ship.pivot = {4.5, 2.0, 8.0};
  return ship;
}

}  // namespace

quoin::Result<std::unique_ptr<Game>> Game::create(const GameOptions& options) {
  std::unique_ptr<Game> game(new Game(options));
  if (const auto made = game->make_land(); !made) return made.error();
  if (const auto made = game->add_ships(); !made) return made.error();
  game->tracer_.emplace(game->scene_);
  game->place_player();
  quoin::Grid& land = game->land();
  game->known_ = land.snapshot();
  (void)land.changes_since(game->changes_);
  return game;
}

quoin::Status Game::make_land() {
  const auto types = quoin::add_terrain_types(scene_.types);
  if (!types) return types.error();
  quoin::VoxelProperties torch;
  torch.name = "torch";
  torch.colour = {255, 190, 90, 255};
  torch.emission = 6.0F;
  torch.collides = false;
  const auto torch_type = scene_.types.add(torch);
  if (!torch_type) return torch_type.error();
  sand_ = types->sand;
  stone_ = types->stone;
  torch_ = *torch_type;
  const quoin::TerrainOptions terrain{.seed = options_.seed, .size = {options_.units, 8, options_.units}};
  auto grid = quoin::generate_terrain(terrain, *types);
  if (!grid) return grid.error();
  size_ = terrain.size * quoin::kTerrainUnit;
  heights_.assign(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.z), 0);
  grid->for_each_row([&](IVec3 first, std::span<const quoin::VoxelType> row) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      auto& height = heights_[static_cast<std::size_t>(first.z * size_.x + first.x) + i];
      if (row[i] != kAir) height = std::max(height, static_cast<std::int16_t>(first.y));
    }
  });
  quoin::SceneGrid land;
  land.name = "land";
  land.grid = std::move(*grid);
  land_ = scene_.add_grid(std::move(land));
  quoin::Instance instance{"land", land_};
  instance.categories = kLand;
  scene_.add_instance(instance);
  return {};
}

quoin::Status Game::add_ships() {
  quoin::VoxelProperties hull;
  for (int kind = 0; kind < 4; ++kind) {
    hull.name = "hull " + std::to_string(kind);
    hull.colour = {static_cast<std::uint8_t>(90 + 40 * kind), 100, static_cast<std::uint8_t>(200 - 40 * kind), 255};
    const auto type = scene_.types.add(hull);
    if (!type) return type.error();
    const quoin::GridHandle grid = scene_.add_grid(ship_of(*type, torch_));
    for (int i = kind; i < options_.ships; i += 4) {
      quoin::Instance ship{"ship", grid};
      ship.position = {random(20.0, size_.x - 20.0), 0.0, random(20.0, size_.z - 20.0)};
      ship.position.y = surface_at(int(ship.position.x), int(ship.position.z)) + random(10.0, 30.0);
      const double heading = random(0.0, 6.28);
      ship.rotation = glm::angleAxis(heading, kUp);
      ship.voxel_size = 0.5;
      ship.categories = kShips;
      const DVec3 velocity = ship.rotation * DVec3(0.0, random(-0.15, 0.15), 1.0) * random(6.0, 14.0);
      const quoin::OrientedBox box{ship.position, {2.25, 1.0, 4.0}, ship.rotation};
      ships_.push_back({scene_.add_instance(ship), box, velocity});
    }
  }
  return {};
}

void Game::place_player() {
  player_.centre = {size_.x / 2.0 + 0.5, surface_at(size_.x / 2, size_.z / 2) + 4.0, size_.z / 2.0 + 0.5};
  if (const auto away = displacement_to_free_place(*tracer_, player_, 16.0)) player_.centre += *away;
}

double Game::random(double low, double high) {
  state_ = state_ * 6'364'136'223'846'793'005U + 1'442'695'040'888'963'407U;
  return low + (high - low) * static_cast<double>(state_ >> 40) / 16'777'216.0;
}

int Game::surface_at(int x, int z) const {
  return heights_[static_cast<std::size_t>(std::clamp(z, 0, size_.z - 1) * size_.x + std::clamp(x, 0, size_.x - 1))];
}

FrameTimes Game::step(const Input& input) {
  using Clock = std::chrono::steady_clock;
  FrameTimes times;
  auto last = Clock::now();
  const auto done = [&](FrameTimes::Part part) {
    const auto now = Clock::now();
    times.parts.at(part) += std::chrono::duration<double, std::milli>(now - last).count();
    last = now;
  };
  edit_elsewhere();
  if (options_.slide_chunks > 0) slide();
  act(input);
  done(FrameTimes::Edits);
  note_changes();
  drop_sand();
  done(FrameTimes::Sand);
  tracer_->update();
  done(FrameTimes::Tracer);
  fly();
  done(FrameTimes::Ships);
  walk(input);
  done(FrameTimes::Player);
  meshes_.update(scene_, eye());
  (void)meshes_.take();  // a renderer would upload them
  done(FrameTimes::Meshes);
  for (const double part : times.parts) times.total += part;
  return times;
}

// Half of them dig, half build.
void Game::edit_elsewhere() {
  quoin::Grid& grid = land();
  for (int i = 0; i < options_.edits; ++i) {
    const int x = int(random(0.0, size_.x));
    const int z = int(random(0.0, size_.z));
    const int y = surface_at(x, z);
    i % 2 == 0 ? grid.set({x, y, z}, kAir) : grid.set({x, y + 1, z}, stone_);
  }
}

// A few voxels of sand over each of some chunks.
void Game::slide() {
  std::vector<quoin::PlacedVoxel> voxels;
  const int wide = size_.x / quoin::kChunkEdge;
  for (int i = 0; i < options_.slide_chunks; ++i) {
    const int chunk = i % (wide * wide);
    for (int n = 0; n < 3; ++n) {
      const int x = chunk % wide * quoin::kChunkEdge + int(random(0.0, 64.0));
      const int z = chunk / wide * quoin::kChunkEdge + int(random(0.0, 64.0));
      voxels.push_back({{x, surface_at(x, z) + 4 + 60 * (i / (wide * wide)), z}, sand_});
    }
  }
  land().set(voxels);
}

// What others than the sand changed since the last frame: the sand above and in it is loose.
void Game::note_changes() {
  quoin::Grid& grid = land();
  const quoin::GridChanges changes = grid.changes_since(changes_);
  if (changes.empty()) return;
  visit_changes(known_, grid, changes, [&](const quoin::RowChange& row) {
    row.for_each([&](IVec3 voxel, quoin::VoxelType, quoin::VoxelType now) {
      if (now == kAir) loose_.push_back(voxel + IVec3{0, 1, 0});
      if (now == sand_) loose_.push_back(voxel);
    });
  });
}

void Game::drop_sand() {
  quoin::Grid& grid = land();
  std::vector<quoin::PlacedVoxel> moves;
  for (const IVec3 voxel : std::exchange(loose_, {})) {
    const IVec3 below = voxel - IVec3{0, 1, 0};
    const IVec3 above = voxel + IVec3{0, 1, 0};
    if (voxel.y <= 0 || grid.get(voxel) != sand_ || grid.get(below) != kAir) continue;
    moves.push_back({voxel, kAir});
    moves.push_back({below, sand_});
    loose_.push_back(below);
    if (grid.get(above) == sand_) loose_.push_back(above);
    ++sand_fallen_;
  }
  grid.set(moves);
  (void)grid.changes_since(changes_);  // its own are known
  known_ = grid.snapshot();
}

void Game::act(const Input& input) {
  if (!input.digs && !input.lights) return;
  const DVec3 ahead(-std::sin(input.yaw) * std::cos(input.pitch), std::sin(input.pitch),
                    -std::cos(input.yaw) * std::cos(input.pitch));
  quoin::QueryFilter filter;
  filter.categories = kLand;
  const auto hit = first_hit(*tracer_, {eye(), ahead}, 8.0, filter);
  if (!hit) return;
  if (input.digs) land().fill_sphere(hit->position - 0.5 * hit->normal, 2.0, kAir);
  if (!input.lights) return;
  const IVec3 before = quoin::voxel_of(hit->position + 0.5 * hit->normal);
  land().set(before, torch_);
  quoin::Lamp lamp;
  lamp.position = DVec3(before) + 0.5;
  scene_.lamps.push_back(lamp);
}

// Off whatever they meet, but for themselves, and off the ends of the world.
void Game::fly() {
  for (Ship& ship : ships_) {
    quoin::QueryFilter filter;
    filter.ignored = {&ship.instance, 1};
    DVec3 way = ship.velocity * kFrame;
    if (const auto hit = sweep_box(*tracer_, ship.box, way, filter)) {
      way *= std::max(0.0, hit->fraction - 0.01);
      ship.velocity -= 2.0 * std::min(glm::dot(ship.velocity, hit->normal), 0.0) * hit->normal;
      if (hit->depth > 0.0) way = hit->normal * std::min(hit->depth, 0.2);
    }
    ship.box.centre += way;
    for (const int axis : {0, 1, 2}) {
      const double end = axis == 1 ? size_.y + 40.0 : size_[axis];
      const double at = ship.box.centre[axis];
      if (at < 5.0) ship.velocity[axis] = std::abs(ship.velocity[axis]);
      if (at > end - 5.0) ship.velocity[axis] = -std::abs(ship.velocity[axis]);
    }
    const double heading = std::atan2(ship.velocity.x, ship.velocity.z);
    ship.box.rotation = glm::angleAxis(heading, kUp);
    quoin::Instance& instance = scene_.edit(ship.instance);
    instance.position = ship.box.centre;
    instance.rotation = ship.box.rotation;
  }
}

void Game::walk(const Input& input) {
  // What it stood on may have moved meanwhile.
  if (moved_.is_on_floor) {
    const quoin::Instance* now = scene_.instances().find(moved_.floor.instance);
    if (now != nullptr) player_.centre = carried_point(floor_, *now, player_.centre);
  }
  falling_ -= kUp * (9.81 * 2.0 * kFrame);
  if (input.jumps && moved_.is_on_floor) falling_ = kUp * 8.0;
  moved_ = move_and_slide(*tracer_, player_, (input.walk * 5.0 + falling_) * kFrame, on_foot());
  player_.centre = moved_.centre;
  falling_ = kUp * (glm::dot(moved_.displacement, kUp) / kFrame);
  if (moved_.is_on_floor) floor_ = scene_.instances()[moved_.floor.instance];
}

Game::Memory Game::memory() const {
  return {known_.bytes(), tracer_->bytes()};
}

}  // namespace miner

#include "game.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

namespace miner {
namespace {

using quoin::DVec3;
using quoin::IVec3;
using quoin::kAir;

constexpr DVec3 kUp{0.0, 1.0, 0.0};
constexpr std::uint32_t kLand = 1;  // instance category
const quoin::QueryFilter kOnLand{.categories = kLand};
constexpr quoin::Rgba8 kTorchColours[]{{255, 170, 60, 255}, {70, 130, 255, 255}, {90, 255, 110, 255}};

quoin::SceneGrid ship_of(quoin::VoxelType hull, quoin::VoxelType light) {
  quoin::SceneGrid ship;
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
  for (const auto part : {&Game::open_world, &Game::make_land, &Game::add_ships}) {
    if (const quoin::Status made = (*game.*part)(); !made) return made.error();
  }
  game->tracer_->update();
  game->place_player();
  game->known_ = game->land().snapshot();
  game->changes_ = game->known_.cursor();
  return game;
}

// Ships are not saved with the land: they start again.
quoin::Status Game::open_world() {
  if (options_.world.empty()) return {};
  auto world = quoin::WorldStore::open_or_create(options_.world);
  if (!world) return world.error();
  auto loaded = load_world(*world);
  if (!loaded) return loaded.error();
  world_ = std::move(*world);
  scene_ = std::move(loaded->loaded.scene);
  saver_ = std::move(loaded->saver);
  for (const quoin::GridHandle grid : scene_.grids().handles()) {
    if (scene_.grids()[grid].name != "land") scene_.remove_grid(grid);
  }
  land_ = scene_.grids().handles().front();
  return {};
}

// Saves the changes since the last call; the world's own thread writes them.
void Game::save() {
  if (!world_) return;
  quoin::WorldChanges more;
  const auto* place = reinterpret_cast<const std::byte*>(&player_.centre);
  more.put_value("player", {place, place + sizeof(player_.centre)});
  if (const auto begun = saver_.save(*world_, scene_, std::move(more)); !begun) saved_ = begun.error();
}

quoin::Status Game::finish() {
  save();
  return world_ && saved_ ? world_->flush() : saved_;
}

quoin::Status Game::make_land() {
  const auto types = quoin::add_terrain_types(scene_.types);
  if (!types) return types.error();
  for (std::size_t i = 0; i < torches_.size(); ++i) {
    const auto torch = scene_.types.find_or_add({.colour = kTorchColours[i], .collides = false, .emission = 1.0F});
    if (!torch) return torch.error();
    torches_[i] = *torch;
  }
  sand_ = types->sand;
  stone_ = types->stone;
  if (const quoin::SceneGrid* const kept = scene_.grids().find(land_)) {
    size_ = kept->canvas.max;
    return {};
  }
  const quoin::TerrainOptions terrain{.seed = options_.seed, .size = {options_.units, 8, options_.units}};
  auto grid = quoin::generate_terrain(terrain, *types);
  if (!grid) return grid.error();
  size_ = terrain.size * quoin::kTerrainUnit;
  land_ = scene_.add_grid({.name = "land", .grid = std::move(*grid), .canvas = {{0, 0, 0}, size_}});
  scene_.add_instance({.name = "land", .grid = land_, .categories = kLand});
  return {};
}

quoin::Status Game::add_ships() {
  tracer_.emplace(scene_);
  const auto hull = scene_.types.find_or_add({.colour = {130, 100, 160, 255}});
  if (!hull) return hull.error();
  const quoin::GridHandle grid = scene_.add_grid(ship_of(*hull, torches_[0]));
  for (int i = 0; i < options_.ships; ++i) {
    quoin::Instance ship{.name = "ship", .grid = grid, .voxel_size = 0.5, .categories = ~kLand};
    ship.position = {random(20.0, size_.x - 20.0), random(10.0, 30.0), random(20.0, size_.z - 20.0)};
    ship.position.y += surface_at(int(ship.position.x), int(ship.position.z));
    ship.rotation = glm::angleAxis(random(0.0, 6.28), kUp);
    const DVec3 velocity = ship.rotation * DVec3(0.0, random(-0.15, 0.15), 1.0) * random(6.0, 14.0);
    ships_.push_back({scene_.add_instance(ship), {ship.position, {2.25, 1.0, 4.0}, ship.rotation}, velocity});
  }
  return {};
}

void Game::place_player() {
  player_.centre = {size_.x / 2.0 + 0.5, surface_at(size_.x / 2, size_.z / 2) + 4.0, size_.z / 2.0 + 0.5};
  if (world_ && frame_ == 0) {
    const auto kept = world_->value("player");
    if (kept && *kept && (*kept)->size() == sizeof(DVec3)) std::memcpy(&player_.centre, (*kept)->data(), sizeof(DVec3));
  }
  if (const auto away = depenetration(*tracer_, player_, 16.0)) player_.centre += *away;
}

double Game::random(double low, double high) {
  state_ = state_ * 6'364'136'223'846'793'005U + 1'442'695'040'888'963'407U;
  return low + (high - low) * static_cast<double>(state_ >> 40) / 16'777'216.0;
}

int Game::surface_at(int x, int z) const {
  const auto hit = first_hit(*tracer_, {{x + 0.5, size_.y + 1.0, z + 0.5}, -kUp}, size_.y, kOnLand);
  return hit ? hit->voxel.y : 0;
}

FrameTimes Game::step(const Input& input) {
  FrameTimes times;
  auto last = std::chrono::steady_clock::now();
  const auto done = [&](const char* part) {
    const auto before = std::exchange(last, std::chrono::steady_clock::now());
    times["frame"] += times[part] = std::chrono::duration<double, std::milli>(last - before).count();
  };
  edit_elsewhere();
  act(input);
  done("edits");
  drop_sand();
  done("sand");
  tracer_->update();
  done("tracer");
  fly();
  done("ships");
  walk(input);
  done("player");
  if (options_.meshes) meshes_.update(scene_, eye());
  (void)meshes_.take();  // a renderer would upload these
  done("meshes");
  light_.update(scene_);
  light_.take();
  done("light");
  if (++frame_ % 300 == 0) save();  // every 5 s
  done("saving");
  return times;
}

// Applies random edits, half digging and half building, and drops a few voxels of sand over some chunks.
void Game::edit_elsewhere() {
  for (int i = 0; i < options_.edits; ++i) {
    const int x = int(random(0.0, size_.x)), z = int(random(0.0, size_.z));
    land().set({x, surface_at(x, z) + i % 2, z}, i % 2 == 0 ? kAir : stone_);
  }
  std::vector<quoin::PlacedVoxel> voxels;
  const int wide = size_.x / quoin::kChunkEdge;
  for (int i = 0; i < 3 * options_.slide_chunks; ++i) {
    const int chunk = i / 3 % (wide * wide), storey = i / 3 / (wide * wide);
    const int x = chunk % wide * quoin::kChunkEdge + int(random(0.0, 64.0));
    const int z = chunk / wide * quoin::kChunkEdge + int(random(0.0, 64.0));
    voxels.push_back({{x, surface_at(x, z) + 4 + 60 * storey, z}, sand_});
  }
  land().set(voxels);
}

void Game::drop_sand() {
  quoin::Grid& grid = land();
  // Sand in and above changes since the last frame, except the sand's own, is loose.
  visit_changes(known_, grid, grid.changes_since(changes_), [&](const quoin::RowChange& row) {
    row.for_each([&](IVec3 voxel, quoin::VoxelType, quoin::VoxelType now) {
      if (now == kAir) loose_.push_back(voxel + IVec3{0, 1, 0});
      if (now == sand_) loose_.push_back(voxel);
    });
  });
  std::vector<quoin::PlacedVoxel> moves;
  for (const IVec3 voxel : std::exchange(loose_, {})) {
    const IVec3 below = voxel - IVec3{0, 1, 0};
    if (voxel.y <= 0 || grid.get(voxel) != sand_ || grid.get(below) != kAir) continue;
    moves.push_back({voxel, kAir});
    moves.push_back({below, sand_});
    loose_.push_back(below);
    if (grid.get(voxel + IVec3{0, 1, 0}) == sand_) loose_.push_back(voxel + IVec3{0, 1, 0});
    ++sand_fallen_;
  }
  grid.set(moves);
  (void)grid.changes_since(changes_);  // skips the sand's own changes
  known_ = grid.snapshot();
}

void Game::act(const Input& input) {
  gaze_ = quoin::direction_of(glm::degrees(input.yaw), glm::degrees(-input.pitch));
  if (!input.digs && !input.places && input.torch < 0 && !input.slides) return;
  const auto hit = first_hit(*tracer_, {eye(), gaze_}, input.slides ? 60.0 : 8.0, kOnLand);
  if (!hit) return;
  const IVec3 before = quoin::voxel_of(hit->position + 0.5 * hit->normal);
  if (input.digs) land().fill_sphere(hit->position - 0.5 * hit->normal, 2.0, kAir);
  if (input.places) land().set(before, stone_);
  if (input.torch >= 0) land().set(before, torches_.at(std::size_t(input.torch)));
  if (input.slides) land().fill_sphere(eye() + std::max(hit->t, 14.0) * gaze_ + 14.0 * kUp, 5.0, sand_);
}

// Ships bounce off obstacles, except themselves, and off the ends of the world.
void Game::fly() {
  for (Ship& ship : ships_) {
    DVec3 way = ship.velocity * kFrame;
    if (const auto hit = sweep_box(*tracer_, ship.box, way, {.ignored = {&ship.instance, 1}})) {
      way *= std::max(0.0, hit->fraction - 0.01);
      ship.velocity -= 2.0 * std::min(glm::dot(ship.velocity, hit->normal), 0.0) * hit->normal;
      if (hit->depth > 0.0) way = hit->normal * std::min(hit->depth, 0.2);
    }
    ship.box.centre += way;
    for (const int axis : {0, 1, 2}) {
      const double end = axis == 1 ? size_.y + 40.0 : size_[axis];
      if (ship.box.centre[axis] < 5.0) ship.velocity[axis] = std::abs(ship.velocity[axis]);
      if (ship.box.centre[axis] > end - 5.0) ship.velocity[axis] = -std::abs(ship.velocity[axis]);
    }
    ship.box.rotation = glm::angleAxis(std::atan2(ship.velocity.x, ship.velocity.z), kUp);
    quoin::Instance& instance = scene_.edit(ship.instance);
    instance.position = ship.box.centre;
    instance.rotation = ship.box.rotation;
  }
}

void Game::walk(const Input& input) {
  // The floor under the player may have moved meanwhile.
  const quoin::Instance* floor = moved_.is_on_floor ? scene_.instances().find(moved_.floor.instance) : nullptr;
  if (floor != nullptr) player_.centre = transformed_point(floor_, *floor, player_.centre);
  falling_ -= kUp * (9.81 * 2.0 * kFrame);
  if (input.jumps && moved_.is_on_floor) falling_ = kUp * 8.0;
  const DVec3 ahead(-std::sin(input.yaw), 0.0, -std::cos(input.yaw));
  const DVec3 way = 5.0 * (input.ahead * ahead + input.aside * glm::cross(ahead, kUp));
  const quoin::FloorOptions on_foot{kUp, 50.0, 1.05, 0.3};
  moved_ = move_and_slide(*tracer_, player_, (way + falling_) * kFrame, {.floor = on_foot});
  player_.centre = moved_.centre;
  falling_ = kUp * (glm::dot(moved_.displacement, kUp) / kFrame);
  if (moved_.is_on_floor) floor_ = scene_.instances()[moved_.floor.instance];
  if (player_.centre.y < -50.0) place_player();
}

std::string Game::status() const {
  const IVec3 at = quoin::voxel_of(eye());
  const quoin::LightLevels levels = light_.shown().of(land_).light->at(at);
  const int lamps = std::max({levels.red, levels.green, levels.blue});
  return "Miner at " + std::to_string(at.x) + " " + std::to_string(at.y) + " " + std::to_string(at.z) + ", sky " +
         std::to_string(levels.sky) + ", lamps " + std::to_string(lamps) + ", fallen " + std::to_string(sand_fallen_);
}

}  // namespace miner

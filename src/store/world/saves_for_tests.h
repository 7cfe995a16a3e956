#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "core/database/connection.h"
#include "store/world/world_changes.h"
#include "store/world/world_for_tests.h"

// A sequence of saves with a known world content after each of them.

namespace quoin {

inline constexpr int kPlaces = 24;
inline constexpr int kTypes = 200;

/// The content of a world after a number of saves: the type of each chunk; 0: none. Save i does not depend on earlier
/// state, so that saves can be replayed.
struct Expected {
  std::array<VoxelType, kPlaces> types{};
  int saves = 0;
};

/// Performs save number `i` (from 1): a counter, the grid's mark and some chunks, sometimes a removal.
template <class Put, class Remove>
void each_of_save(int i, Put put, Remove remove) {
  std::minstd_rand random(static_cast<unsigned>(i) * 7919U);
  const unsigned count = 1 + random() % 5;
  std::set<int> places;
  while (places.size() < count) places.insert(static_cast<int>(random() % kPlaces));
  bool may_remove = random() % 4 == 0;
  for (const int place : places) {
    if (may_remove) {
      remove(place);
    } else {
      put(place, static_cast<VoxelType>(1 + (i * 13 + place) % kTypes));
    }
    may_remove = false;
  }
}

inline void apply(Expected& expected, int i) {
  each_of_save(
      i, [&](int place, VoxelType type) { expected.types[static_cast<std::size_t>(place)] = type; },
      [&](int place) { expected.types[static_cast<std::size_t>(place)] = kAir; });
  expected.saves = i;
}

inline ChunkAddress place_of(int place) {
  return {0, 0, {place % 5 - 2, place / 5, 31 + place % 3}};
}

// Returns a content of several rows, identified by its type.
inline Chunk impl_of(VoxelType type) {
  Chunk chunk(type);
  for (int i = 0; i < 40; ++i) chunk.set(i, (i * type) % 64, (i * 5) % 64, kAir);
  return chunk;
}

inline WorldChanges changes_of(int i) {
  WorldChanges changes;
  const std::string number = std::to_string(i);
  const auto bytes = std::as_bytes(std::span(number));
  changes.put_value("saves", {bytes.begin(), bytes.end()});
  changes.put_grid(0, {.whole = i % 2 == 1});
  each_of_save(
      i, [&](int place, VoxelType type) { changes.put_chunk(place_of(place), {impl_of(type)}); },
      [&](int place) { changes.remove_chunk(place_of(place)); });
  return changes;
}

/// `vfs`: as WorldParts::create.
inline Result<WorldStore> create_for_saves(const std::string& file, const char* vfs) {
  auto world = WorldParts::create(file, {1}, vfs);
  if (!world) return world.error();
  WorldChanges first;
  first.put_types(coloured_types(kTypes));
  first.put_grid(0, {});
  if (auto saved = world->save(std::move(first)); !saved) return saved.error();
  if (auto saved = world->flush(); !saved) return saved.error();
  return world;
}

/// The number of saves in a world; -1 with a reason if the world matches no number of saves.
struct Found {
  int saves = -1;
  std::string why;
};

inline Found look_at(const std::string& file, const char* vfs) {
  auto connection = Connection::open(file, Connection::Mode::Write, vfs);
  if (!connection) return {-1, "it does not open: " + connection.error().message};
  const auto sound = connection->text("PRAGMA integrity_check");
  if (!sound || *sound != "ok") return {-1, "integrity_check: " + (sound ? *sound : sound.error().message)};
  static_cast<void>(connection->close());
  auto world = WorldParts::open(file, WorldAccess::Write, {1}, vfs);
  if (!world) return {-1, "the world does not open: " + world.error().message};
  const auto value = world->value("saves");
  if (!value) return {-1, value.error().message};
  int saves = 0;
  if (*value) saves = std::atoi(std::string(reinterpret_cast<const char*>((*value)->data()), (*value)->size()).c_str());
  const auto grids = world->grids();
  if (!grids) return {-1, grids.error().message};
  if (grids->size() != 1 || grids->at(0).whole != (saves % 2 == 1)) {
    return {-1, "after " + std::to_string(saves) + " saves the grid has the mark of another save"};
  }
  Expected expected;
  for (int i = 1; i <= saves; ++i) apply(expected, i);
  for (int place = 0; place < kPlaces; ++place) {
    const auto chunk = world->load_chunk(place_of(place));
    if (!chunk) return {-1, chunk.error().message};
    const VoxelType type = expected.types[static_cast<std::size_t>(place)];
    const bool is_right = chunk->has_value() ? type != kAir && (*chunk)->voxels == impl_of(type) : type == kAir;
    if (!is_right) return {-1, "after " + std::to_string(saves) + " saves place " + std::to_string(place)};
  }
  return {saves, ""};
}

}  // namespace quoin

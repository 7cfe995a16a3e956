#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/store/world_saver.h>

#include "store/database/schema.h"

namespace quoin::store {

/// The numbers of a scene's elements in a world.
template <class T>
struct Numbers {
  std::map<Handle<T>, std::int64_t> numbers;
  std::int64_t next = 0;

  /// Returns an element's number; assigns a new number if it has none.
  std::int64_t of(Handle<T> handle) {
    const auto [found, is_new] = numbers.try_emplace(handle, next);
    if (is_new) ++next;
    return found->second;
  }
  /// Removes an element and returns its number.
  std::optional<std::int64_t> take(Handle<T> handle) {
    const auto found = numbers.find(handle);
    if (found == numbers.end()) return std::nullopt;
    const std::int64_t number = found->second;
    numbers.erase(found);
    return number;
  }
  void add(Handle<T> handle, std::int64_t number) {
    QUOIN_ASSERT(number >= 0 && !numbers.contains(handle), "a number for a new element");
    numbers.emplace(handle, number);
    next = std::max(next, number + 1);
  }
};

struct SavedGrid {
  std::uint32_t number = 0;
  WorldGrid header;
  ChangeCursor voxels;
  ChangeCursor data;
  ChangeCursor densities;
  std::vector<IVec3> unread;    ///< damaged chunks: missing in the scene, and kept in the world
  bool is_partly_read = false;  ///< the scene may lack other chunks
};

/// The part of a scene that a world has stored.
struct SaverState {
  ChangeCursor scene;
  ChangeCursor types;
  std::map<GridHandle, SavedGrid> grids;
  Numbers<Instance> instances;
  Numbers<SceneGroup> groups;
  Numbers<SceneLayer> layers;
  std::vector<Lamp> lamps;
  std::vector<std::int64_t> lamp_numbers;  ///< numbers of the lamps in the world
  std::optional<Environment> environment;
  WorldView view;
  std::size_t saved_cameras = 0;
  bool is_view_new = false;
  bool is_begun = false;         ///< the world has a state of this scene
  bool needs_lamp_save = false;  ///< lamp numbers differ from the scene's order
  bool needs_full_save = false;  ///< a save was refused: the next save must contain everything
  std::vector<PartKey> pending_removals;
};

}  // namespace quoin::store

namespace quoin {

struct WorldSaver::Impl {
  store::SaverState state;
};

}  // namespace quoin

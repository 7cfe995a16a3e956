#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/grid/chunk.h>
#include <quoin/store/world_store.h>

namespace quoin::store {

/// The chunks of a world's grid, level 0; the most recently used ones are in memory.
class ChunkCache {
 public:
  /// `bytes`: limit of the kept voxels. `world` must outlive it. Errors of reading keys: see `status`.
  ChunkCache(const WorldStore& world, std::uint32_t grid, std::size_t bytes);
  /// Returns the errors of reading the world itself.
  [[nodiscard]] const Status& status() const { return status_; }

  /// Returns the coordinates of all chunks, sorted by z, then y, then x.
  [[nodiscard]] std::span<const IVec3> places() const { return places_; }
  /// Reads the missing chunks on several threads; skips addresses without a chunk.
  void load(std::span<const IVec3> places, Threads threads);
  /// Returns null if the chunk does not exist or is not loaded. Lifetime: until the next `trim`.
  [[nodiscard]] const Chunk* find(IVec3 place) const;
  /// Drops chunks that are not part of the last load and exceed the limit.
  void trim();

  /// Totals over all chunks read, each counted once: non-air voxels, voxels with data.
  [[nodiscard]] std::int64_t voxels() const { return voxels_; }
  [[nodiscard]] std::int64_t data() const { return data_; }
  [[nodiscard]] bool has_densities() const { return has_densities_; }
  /// Returns a line for each damaged chunk; these count as air.
  [[nodiscard]] const std::vector<std::string>& damage() const { return damage_; }

 private:
  struct Entry {
    Chunk chunk{kAir};
    std::uint64_t last_use = 0;
  };

  const WorldStore& world_;
  std::uint32_t grid_;
  std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::uint64_t now_ = 0;
  Status status_;
  std::vector<IVec3> places_;
  std::unordered_map<IVec3, Entry, CoordinateHash> loaded_;
  std::unordered_set<IVec3, CoordinateHash> counted_;
  std::int64_t voxels_ = 0;
  std::int64_t data_ = 0;
  bool has_densities_ = false;
  std::vector<std::string> damage_;
};

}  // namespace quoin::store

#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/neighbourhood.h>

#include "grid/coordinate_hash.h"

namespace quoin {

/// Bytes of all copies that are still held.
using CopiedBytes = std::shared_ptr<std::atomic<std::size_t>>;

/// A grid's chunk as it was at one moment, for threads that must not touch the grid.
class CopiedChunk {
 public:
  CopiedChunk(const Chunk& chunk, CopiedBytes total) : chunk_(chunk), bytes_(chunk_.bytes()), total_(std::move(total)) {
    total_->fetch_add(bytes_, std::memory_order_relaxed);
  }
  CopiedChunk(const CopiedChunk&) = delete;
  CopiedChunk& operator=(const CopiedChunk&) = delete;
  ~CopiedChunk() { total_->fetch_sub(bytes_, std::memory_order_relaxed); }

  [[nodiscard]] const Chunk& chunk() const { return chunk_; }

 private:
  Chunk chunk_;
  std::size_t bytes_;
  CopiedBytes total_;
};

/// As Neighbourhood, but holding what it names.
struct CopiedNeighbourhood {
  std::array<std::shared_ptr<const CopiedChunk>, 27> chunks;

  [[nodiscard]] Neighbourhood view() const {
    Neighbourhood all;
    for (std::size_t i = 0; i < 27; ++i) all.chunks[i] = chunks[i] == nullptr ? nullptr : &chunks[i]->chunk();
    return all;
  }
};

/// The chunk beside another, `i` as in Neighbourhood.
[[nodiscard]] inline IVec3 neighbour_of(IVec3 chunk, int i) {
  return chunk + IVec3{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
}

/// Copies chunks of one grid, each state once for all who hold it at the same time.
class ChunkCopies {
 public:
  explicit ChunkCopies(CopiedBytes total) : total_(std::move(total)) {}

  [[nodiscard]] CopiedNeighbourhood around(const Grid& grid, IVec3 chunk) {
    CopiedNeighbourhood all;
    for (int i = 0; i < 27; ++i) all.chunks[static_cast<std::size_t>(i)] = copy(grid, neighbour_of(chunk, i));
    return all;
  }
  /// A copy that someone holds still; null otherwise.
  [[nodiscard]] std::shared_ptr<const CopiedChunk> find(IVec3 chunk, std::uint64_t version) const {
    const auto found = kept_.find(chunk);
    return found == kept_.end() || found->second.version != version ? nullptr : found->second.copy.lock();
  }
  /// Forgets what nobody holds any more. Cost: now and then that of all.
  void tidy() {
    if (kept_.size() < tidy_at_) return;
    std::erase_if(kept_, [](const auto& each) { return each.second.copy.expired(); });
    tidy_at_ = 64 + 2 * kept_.size();
  }
  void clear() { kept_.clear(); }

 private:
  struct Kept {
    std::uint64_t version = 0;
    std::weak_ptr<const CopiedChunk> copy;
  };

  std::shared_ptr<const CopiedChunk> copy(const Grid& grid, IVec3 at) {
    const Chunk* chunk = grid.find_chunk(at);
    if (chunk == nullptr) return nullptr;
    const std::uint64_t version = grid.version(at);
    if (std::shared_ptr<const CopiedChunk> held = find(at, version)) return held;
    // Not in one allocation with its counts, which would keep the memory of what is only remembered.
    std::shared_ptr<const CopiedChunk> made(new CopiedChunk(*chunk, total_));
    kept_.insert_or_assign(at, Kept{version, made});
    return made;
  }

  CopiedBytes total_;
  std::unordered_map<IVec3, Kept, CoordinateHash> kept_;
  std::size_t tidy_at_ = 64;
};

}  // namespace quoin

#pragma once

#include <bit>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/grid/density_grid.h>

#include "grid/bounds_cache.h"
#include "grid/density/density_store.h"

namespace quoin {

/// The box of a chunk's solid samples. Cost: O(4096).
struct SolidBox {
  static IBox of(const DensityStore::Entry& entry) {
    IBox box;
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        const std::uint64_t solid = entry.samples.solid_row(y, z);
        if (solid == 0) continue;
        box = unite(box, {{std::countr_zero(solid), y, z}, {kChunkEdge - std::countl_zero(solid), y + 1, z + 1}});
      }
    }
    return box;
  }
};

struct DensityGrid::Impl {
  explicit Impl(float band) : store(band) {}
  DensityStore store;
  BoundsCache<DensityRecord, ChunkTrie<DensityStore::Entry>, SolidBox> solid;
};

// Asserts that the field was not moved from. Accesses to single samples and chunks skip this check.
inline DensityGrid::Impl& DensityGrid::impl() const {
  QUOIN_ASSERT(impl_ != nullptr, "a field that was not moved from");
  return *impl_;
}

/// Notifies followers, on destruction, of edits made during its lifetime, even after an exception.
class NoticeOfEdits {
 public:
  NoticeOfEdits(const DensityStore& store, EditNotice& notice)
      : store_(store), notice_(notice), before_(store.edits()) {}
  NoticeOfEdits(const NoticeOfEdits&) = delete;
  NoticeOfEdits& operator=(const NoticeOfEdits&) = delete;
  ~NoticeOfEdits() {
    if (store_.edits() != before_) notice_.notify();
  }

 private:
  const DensityStore& store_;
  EditNotice& notice_;
  std::uint64_t before_;
};

}  // namespace quoin

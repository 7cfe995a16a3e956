#pragma once

#include <vector>

#include <quoin/grid/changes.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>

namespace quoin {

/// For tests: a consumer of a grid's changes, from the moment it begins to follow.
class ChangeFollower {
 public:
  template <class AnyGrid>
  explicit ChangeFollower(const AnyGrid& grid) : cursor_(grid.cursor()) {}

  [[nodiscard]] GridChanges changes(const Grid& grid) { return grid.changes_since(cursor_); }
  /// The chunks to be meshed since the last time.
  std::vector<IVec3> take(const Grid& grid) { return chunks_to_mesh(grid, grid.changes_since(cursor_)); }
  std::vector<IVec3> take(const DensityGrid& grid, int reach) {
    return chunks_to_mesh(grid, grid.changes_since(cursor_), reach);
  }
  /// Returns true if anything changed. Does not call `take`.
  template <class AnyGrid>
  [[nodiscard]] bool is_behind(const AnyGrid& grid) const {
    return grid.has_changed_since(cursor_);
  }

 private:
  ChangeCursor cursor_;
};

}  // namespace quoin

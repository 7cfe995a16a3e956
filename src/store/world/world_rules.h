#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <quoin/grid/voxel_registry.h>
#include <quoin/store/world_store.h>

#include "store/world/world_changes.h"
#include "store/world/world_reader.h"

namespace quoin::store {

/// The types and grids of a world, for checking chunks.
struct WorldRules {
  VoxelRegistry types;
  std::map<std::uint32_t, WorldGrid> grids;
  std::vector<std::string> damage;  ///< a line for each item replaced by a visible placeholder

  /// Returns the rules after changes. Errors: InvalidArgument, as WorldStore::save.
  [[nodiscard]] Result<WorldRules> after(const ChangeSet& changes) const;
  /// Returns true if changes include types or grids.
  [[nodiscard]] static bool concern(const ChangeSet& changes);
};

/// Reads the rules of a world on disk. Damaged types become magenta, so that their voxels are visible; damaged grids
/// lose their names.
[[nodiscard]] Result<WorldRules> read_rules(WorldReader& reader);
/// Returns the placeholder of a lost type: magenta, so that it is visible.
[[nodiscard]] VoxelProperties lost_type(std::int64_t number);
/// Returns a text such as "chunk (1, 2, 3) of grid 0".
[[nodiscard]] std::string about(const ChunkAddress& place);
/// Checks that a world can list the chunk. Errors: InvalidArgument for coordinates outside kAllChunks, or a grid number
/// above kMaxGridNumber.
[[nodiscard]] Status check_address(const ChunkAddress& place);
/// Checks changes as documented for WorldStore::save.
[[nodiscard]] Status check_changes(const ChangeSet& changes, const WorldRules& rules);

}  // namespace quoin::store

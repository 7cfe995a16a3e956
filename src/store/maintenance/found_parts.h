#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <quoin/store/world_maintenance.h>

#include "store/salvage/page_scan.h"
#include "store/world/world_changes.h"

namespace quoin::store {

/// The sound parts of a damaged world except its chunks, and placeholders for lost parts.
class FoundParts {
 public:
  FoundParts();

  /// Takes all parts that SQLite can read. Returns false if it cannot read all of them.
  bool read(Connection& connection, std::vector<WorldDamage>& damage);
  /// Takes a record found in the file's pages, if it is a sound part and newer than the stored version.
  void add(const PageRecord& record);

  /// Returns the format version, if a record is the sound part that holds it.
  [[nodiscard]] static std::optional<int> version_of(const PageRecord& record);

  [[nodiscard]] float band(std::uint32_t grid) const;
  /// The maximum number of types: chunks are checked against these until the lost types are known.
  [[nodiscard]] const VoxelRegistry& any_types() const { return any_types_; }
  /// `add_grid` ensures that a grid exists, `add_types_up_to` that all types up to a number exist.
  void add_grid(std::uint32_t grid);
  void add_types_up_to(VoxelType last);
  /// Moves the parts added since the last call into `changes`.
  void move_to(WorldChanges& changes);

  /// Returns the number of sound parts.
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Returns a line for each lost item.
  [[nodiscard]] std::vector<std::string> lost() const { return lost_; }

 private:
  struct Found {
    std::uint64_t revision = 0;
    PartBody body;
  };
  void take(const Part& part);

  VoxelRegistry any_types_;
  std::map<PartKey, Found> parts_;
  std::set<PartKey> put_;
  std::size_t count_ = 0;
  std::int64_t types_put_ = 0;
  std::map<std::uint32_t, WorldGrid> grids_;
  std::set<std::uint32_t> placed_grids_;
  std::int64_t next_instance_ = 0;
  std::vector<std::string> lost_;
};

}  // namespace quoin::store

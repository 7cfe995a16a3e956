#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/function_ref.h>

#include "store/database/connection.h"
#include "store/database/schema.h"

namespace quoin::store {

/// Reads a world by a connection of its own: one thread at a time. Each call sees the world as the last commit left it.
class WorldReader {
 public:
  explicit WorldReader(Connection connection) : connection_(std::move(connection)) {}

  /// Returns the chunk's row; nullopt if there is none.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> chunk_body(const ChunkPlace& place);
  /// Adds the places of a grid's and level's chunks in a box of chunks to `out`, in no order.
  [[nodiscard]] Status find_chunks(std::uint32_t grid, std::uint8_t level, const IBox& box, std::vector<IVec3>& out);
  /// Calls `visit` for the chunks' rows in the order of their keys, until it returns false.
  [[nodiscard]] Status each_body(std::uint32_t grid, std::uint8_t level,
                                 FunctionRef<bool(const ChunkPlace& place, std::span<const std::byte> body)> visit);
  /// Calls `visit` for the places of all chunks of all grids and levels, in no order, until it returns false; without
  /// reading their bodies. Chunks in regions that are not there are left out.
  [[nodiscard]] Status each_place(FunctionRef<bool(const ChunkPlace& place)> visit);
  [[nodiscard]] Result<std::vector<RegionPlace>> regions();

  /// The part's body. Errors: BadFormat where its sum is another.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> part(const PartKey& key);
  /// Calls `visit` for the parts of a kind by their ids, with whether each is as it was written.
  [[nodiscard]] Status each_part(std::string_view kind, FunctionRef<void(const Part& part, bool is_sound)> visit);

  [[nodiscard]] Connection& connection() { return connection_; }

 private:
  struct Region {
    std::int64_t id = 0;
    RegionPlace place;
  };
  /// Prepares a statement the first time.
  [[nodiscard]] Result<Statement*> ready(Statement& statement, const char* sql);
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> body_in_region(const RegionPlace& place, IVec3 chunk);
  [[nodiscard]] Result<std::optional<std::int64_t>> region_id(const RegionPlace& place);
  /// The regions of a grid and level that meet a box of regions.
  [[nodiscard]] Result<std::vector<Region>> find_regions(std::uint32_t grid, std::uint8_t level, const IBox& box);

  Connection connection_;
  Statement chunk_;
  Statement region_;
  Statement regions_in_;
  Statement keys_;
  Statement bodies_;
  Statement part_;
  Statement parts_;
  std::map<RegionPlace, std::int64_t>
      known_regions_;  // an id is never another region's, though a region may get another
};

/// Returns a part from a row with columns id, revision, sum, body; nullopt for other column types.
[[nodiscard]] std::optional<Part> part_of(Statement& row, std::string_view kind, std::uint64_t& sum);

}  // namespace quoin::store

#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/core/memory.h>
#include <quoin/core/progress.h>

#include "core/database/connection.h"
#include "store/database/schema.h"

namespace quoin::store {

/// Selects the number of the region at a place.
inline constexpr const char* kSelectRegion = "SELECT id FROM regions WHERE grid=? AND level=? AND x=? AND y=? AND z=?";

/// Reads a world through its own connection, one thread at a time. Each call sees the state of the last commit.
class WorldReader {
 public:
  explicit WorldReader(Connection connection) : connection_(std::move(connection)) {}

  /// Returns the chunk's row; nullopt if there is none.
  [[nodiscard]] Result<std::optional<BlockVector<std::byte>>> chunk_body(const ChunkAddress& place);
  /// Adds the addresses of a grid's and level's chunks in a box of chunks to `out`, in no order.
  [[nodiscard]] Status find_chunks(std::uint32_t grid, std::uint8_t level, const IBox& box, std::vector<IVec3>& out);
  /// Calls `visit` for the chunks' rows in the order of their keys, until it returns false.
  [[nodiscard]] Status each_body(std::uint32_t grid, std::uint8_t level,
                                 FunctionRef<bool(const ChunkAddress& place, std::span<const std::byte> body)> visit);
  /// Calls `visit` for the addresses of all chunks of all grids and levels, in no order, until it returns false. Does
  /// not read their bodies. Skips chunks in missing regions.
  [[nodiscard]] Status each_place(FunctionRef<bool(const ChunkAddress& place)> visit);
  [[nodiscard]] Result<std::vector<RegionPlace>> regions();

  /// Returns the part's body. Errors: BadFormat if its checksum is wrong.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> part(const PartKey& key);
  /// Calls `visit(part, is_sound)` for the parts of a kind in id order.
  [[nodiscard]] Status each_part(std::string_view kind, FunctionRef<void(const Part& part, bool is_sound)> visit);

  [[nodiscard]] Connection& connection() { return connection_; }

 private:
  struct Region {
    std::int64_t id = 0;
    RegionPlace place;
  };
  /// Prepares a statement on first use.
  [[nodiscard]] Result<Statement*> ready(Statement& statement, const char* sql);
  [[nodiscard]] Result<std::optional<BlockVector<std::byte>>> body_in_region(const RegionPlace& place, IVec3 chunk);
  [[nodiscard]] Result<std::optional<std::int64_t>> region_id(const RegionPlace& place);
  /// Returns the regions of a grid and level in a box of regions.
  [[nodiscard]] Result<std::vector<Region>> find_regions(std::uint32_t grid, std::uint8_t level, const IBox& box);

  Connection connection_;
  Statement chunk_;
  Statement region_;
  Statement regions_in_;
  Statement keys_;
  Statement bodies_;
  Statement part_;
  Statement parts_;
  std::map<RegionPlace, std::int64_t> known_regions_;  // ids are never reused, but a region may get a new id
};

/// Returns a part from a row with columns id, revision, sum, body; nullopt for other column types.
[[nodiscard]] std::optional<Part> part_of(Statement& row, std::string_view kind, std::uint64_t& sum);

/// Keys of chunks that SQLite cannot read, because pages of the table are damaged: from the first to the last.
struct KeyGap {
  std::int64_t first = 0;
  std::int64_t last = 0;
  std::string why;
};

/// A visitor's verdict on a row.
enum class RowVerdict : std::uint8_t { Sound, Damaged, Stop };

/// Reads every row of the chunk table by its key, despite damage elsewhere.
class ChunkRows {
 public:
  explicit ChunkRows(Connection& connection) : connection_(connection) {}

  /// Returns the regions' positions. Skips unreadable ones, with a line each in `damage`.
  [[nodiscard]] std::map<std::int64_t, RegionPlace> regions(std::vector<std::string>& damage);
  /// Calls `visit(key, body)` for each readable row until it returns Stop. Returns the key ranges of unreadable rows.
  /// Errors: CannotRead.
  [[nodiscard]] Result<std::vector<KeyGap>> each(
      FunctionRef<RowVerdict(std::int64_t key, std::span<const std::byte> body)> visit);

 private:
  Connection& connection_;
};

/// Returns a description such as "chunks (0, 0, 0) to (31, 4, 2) of grid 0", as far as known.
[[nodiscard]] std::string about(const KeyGap& gap, const std::map<std::int64_t, RegionPlace>& regions);

}  // namespace quoin::store

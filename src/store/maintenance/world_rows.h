#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/core/progress.h>

#include "store/world/world_reader.h"

namespace quoin::store {

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

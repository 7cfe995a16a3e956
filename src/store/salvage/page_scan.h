#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/core/result.h>

// Finds the remains in a database file and its write-ahead log, page by page without SQLite: also if the first page,
// inner tree pages or page headers are damaged, and on unused pages. Source: https://sqlite.org/fileformat2.html.
//
// Ignores trees and cell pointers: each byte of each page may be the start of a cell. Bytes are a record if the lengths
// agree, and a chunk's body if the checksum is right.
//
// Errors:  CannotRead if the file cannot be opened. Unreadable pages count as damaged.
//          LimitExceeded for a file with crafted page cycles.
// Memory:  a page or two, the largest record, and 16 bytes for each page in the log.
// Cost:    about 10 ns per byte for records, 0.5 ns for bodies, plus reading the file twice. If no body that spans
//          pages reveals the page size, up to 1 GiB is scanned for each possible size.

namespace quoin::store {

using ColumnValue = std::variant<std::monostate, std::int64_t, double, std::string, std::vector<std::byte>>;

/// A row of a table, with its values by column; monostate is NULL.
struct PageRecord {
  std::int64_t row = 0;
  std::vector<ColumnValue> columns;
};

/// Calls `visit` for each possible row of a table with at least two columns, possibly several times. This includes
/// older states of rows, and bytes that look like rows by chance: the caller must verify its own checksums.
[[nodiscard]] Status scan_records(const std::filesystem::path& database, FunctionRef<void(const PageRecord&)> visit);

/// A body whose own row cannot be read has this key.
inline constexpr std::int64_t kLostKey = -1;

/// Calls `visit` for the chunk bodies with a correct checksum, possibly several times, including older states of
/// chunks. `body`: valid during the call.
[[nodiscard]] Status scan_bodies(const std::filesystem::path& database,
                                 FunctionRef<void(std::int64_t key, std::span<const std::byte> body)> visit);

}  // namespace quoin::store

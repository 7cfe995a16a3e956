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

// What is left in the file of a database, and in its write-ahead log, read page by page without SQLite: also where the
// first page, the inner pages of trees or pages' own headers are damaged, and what lies on pages that are no longer
// used. Source: https://sqlite.org/fileformat2.html.
//
// Neither trees nor the places of cells are followed: each byte of each page may be where a cell begins. What follows
// is a record if its lengths agree, and a chunk's body if its checksum is right.
//
// Errors:  CannotRead where the file cannot be opened. Pages that the disk does not give count as damaged.
//          LimitExceeded for a file whose pages were made to lead back to themselves again and again.
// Memory:  a page or two, the largest record, and 16 bytes for each page in the log.
// Cost:    about 10 ns a byte for records, 0.5 ns for bodies, besides reading the file twice; where no body that spans pages
//          says how large these are, 1 GiB of it at most for each size that there may be.

namespace quoin::store {

using ColumnValue = std::variant<std::monostate, std::int64_t, double, std::string, std::vector<std::byte>>;

/// A row of a table, with its values by column; monostate is NULL.
struct PageRecord {
  std::int64_t row = 0;
  std::vector<ColumnValue> columns;
};

/// Calls `visit` for all that may be a row of a table of two columns or more, as often as it is found: also older
/// states of rows, and bytes that look like rows by chance. Whoever reads them has checksums of his own.
[[nodiscard]] Status scan_records(const std::filesystem::path& database, FunctionRef<void(const PageRecord&)> visit);

/// A body whose own row cannot be read has this key.
inline constexpr std::int64_t kLostKey = -1;

/// Calls `visit` for the bodies of chunks whose checksum is right, as often as they are found: also older states of
/// chunks. `body`: valid during the call.
[[nodiscard]] Status scan_bodies(const std::filesystem::path& database,
                                 FunctionRef<void(std::int64_t key, std::span<const std::byte> body)> visit);

}  // namespace quoin::store

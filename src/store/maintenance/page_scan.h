#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
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

/// A file with random access. Owns its descriptor.
class RandomFile {
 public:
  /// Returns nullopt if there is no such file. Errors: CannotRead.
  [[nodiscard]] static Result<std::optional<RandomFile>> open(const std::filesystem::path& path);
  RandomFile(RandomFile&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)), size_(std::exchange(other.size_, 0)) {}
  RandomFile& operator=(RandomFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~RandomFile();

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Fills `out` from an offset on. Bytes beyond the file's end or unreadable bytes become 0.
  void read(std::uint64_t offset, std::span<std::byte> out) const;

 private:
  RandomFile(int descriptor, std::uint64_t size) : descriptor_(descriptor), size_(size) {}
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// The page size of a file.
struct PageLayout {
  std::size_t page_size = 8'192;
  std::size_t usable = 8'192;  ///< the part that SQLite uses
};

/// The state of the pages: the file alone, or with the log's frames up to a given one.
struct PageView {
  std::size_t frames = 0;  ///< number of log frames in this state
};

/// The pages of a database and of its log. Log pages are numbered by frame: several frames may hold one page.
class PageFile {
 public:
  /// Errors: CannotRead.
  [[nodiscard]] static Result<PageFile> open(const std::filesystem::path& database);

  /// Returns the possible layouts, most likely first.
  [[nodiscard]] std::vector<PageLayout> layouts() const;
  void set_layout(const PageLayout& layout);
  [[nodiscard]] const PageLayout& layout() const { return layout_; }

  /// Returns the number of pages in the file, including a partial last one, and in the log after them.
  [[nodiscard]] std::size_t page_count() const { return file_pages_ + frames_.size(); }
  [[nodiscard]] std::uint64_t bytes() const { return file_.size() + (log_ ? log_->size() : 0); }
  /// Requires: index < page_count(); `page` holds a page.
  void read(std::size_t index, std::span<std::byte> page) const;
  /// Returns the states in which references from a page to other pages may be valid, most likely first.
  [[nodiscard]] std::vector<PageView> views(std::size_t index) const;
  /// Reads a page by its number, 1 or more, in a state. Returns false if there is none.
  [[nodiscard]] bool read(std::uint32_t number, PageView view, std::span<std::byte> page) const;

 private:
  PageFile(RandomFile file, std::optional<RandomFile> log) : file_(std::move(file)), log_(std::move(log)) {}
  [[nodiscard]] std::uint64_t offset_of_frame(std::size_t frame) const;

  RandomFile file_;
  std::optional<RandomFile> log_;
  PageLayout layout_;
  std::size_t file_pages_ = 0;
  struct Frame {
    std::uint32_t page = 0;
    bool ends_transaction = false;
  };
  std::vector<Frame> frames_;
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> frames_of_;  // by page
};

}  // namespace quoin::store

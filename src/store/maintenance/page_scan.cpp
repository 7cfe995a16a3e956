#include "store/maintenance/page_scan.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "store/chunk/chunk_body.h"

namespace quoin::store {
namespace {

// Longer records are assumed to be bytes that look like a record by chance.
constexpr std::uint64_t kMaxPayload = std::uint64_t{128} << 20;
// Limit of overflow page reads relative to the file's size: a sound page is read once or twice.
constexpr std::uint64_t kMaxReadsOfByte = 64;
// Number of bytes of a file scanned to find its page size.
constexpr std::uint64_t kSampledBytes = std::uint64_t{1} << 30;
constexpr std::size_t kMaxColumns = 64;

/// A SQLite varint: seven bits per byte, highest first, eight in the ninth byte.
struct Varint {
  std::uint64_t value = 0;
  std::size_t bytes = 0;  ///< 0: incomplete
};

Varint varint_at(std::span<const std::byte> from, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 9 && at + i < from.size(); ++i) {
    const auto byte = std::to_integer<std::uint64_t>(from[at + i]);
    if (i == 8) return {value << 8 | byte, 9};
    value = value << 7 | (byte & 0x7FU);
    if (byte < 0x80) return {value, i + 1};
  }
  return {};
}

/// Returns the varint that ends before `end` and has exactly `bytes` bytes.
std::optional<std::uint64_t> varint_before(std::span<const std::byte> from, std::size_t end, std::size_t bytes) {
  if (end < bytes) return std::nullopt;
  const Varint found = varint_at(from.first(end), end - bytes);
  return found.bytes == bytes ? std::optional(found.value) : std::nullopt;
}

/// Returns the size of a value in a record; nullopt for the two types reserved by SQLite.
std::optional<std::uint64_t> bytes_of_type(std::uint64_t type) {
  constexpr std::array<std::uint8_t, 10> kFixed = {0, 1, 2, 3, 4, 6, 8, 8, 0, 0};
  if (type < kFixed.size()) return kFixed[type];
  return type < 12 ? std::nullopt : std::optional((type - 12) / 2);
}

/// Returns the bytes of a payload within the page of its cell.
std::size_t local_bytes(std::uint64_t payload, std::size_t usable) {
  QUOIN_ASSERT(usable >= 480, "at least 480 usable bytes in a page");
  if (payload <= usable - 35) return static_cast<std::size_t>(payload);
  const std::size_t least = (usable - 12) * 32 / 255 - 23;
  const std::size_t local = least + static_cast<std::size_t>((payload - least) % (usable - 4));
  return local <= usable - 35 ? local : least;
}

/// A payload that begins in a page.
struct Payload {
  std::size_t at = 0;  ///< in the page
  std::uint64_t bytes = 0;
};

class Scan {
 public:
  explicit Scan(PageFile file) : file_(std::move(file)) {}

  /// Calls `visit(page, its index)`, until it returns false.
  template <class Visit>
  void each_page(std::uint64_t most_bytes, Visit&& visit) {
    std::vector<std::byte> page(file_.layout().page_size);
    const std::uint64_t pages = std::min<std::uint64_t>(file_.page_count(), most_bytes / page.size() + 1);
    for (std::size_t i = 0; i < pages; ++i) {
      file_.read(i, page);
      if (!visit(std::span<const std::byte>(page), i)) return;
    }
  }

  [[nodiscard]] std::size_t usable() const { return file_.layout().usable; }
  [[nodiscard]] bool fits(const Payload& payload) const {
    if (payload.bytes > std::min(kMaxPayload, file_.bytes())) return false;
    const std::size_t local = local_bytes(payload.bytes, usable());
    const std::size_t end = payload.at + local + (local < payload.bytes ? 4 : 0);
    return payload.at <= usable() && end <= usable();
  }
  /// Calls `is_it(payload)` for each possible state of a payload's pages, until it returns true.
  /// Requires: fits(payload).
  template <class IsIt>
  void each_state(std::span<const std::byte> page, std::size_t index, const Payload& payload, IsIt&& is_it) {
    QUOIN_ASSERT(page.size() == file_.layout().page_size && fits(payload), "a payload that fits its page");
    const std::size_t local = local_bytes(payload.bytes, usable());
    const auto here = page.subspan(payload.at, local);
    if (local == payload.bytes) {
      is_it(here);
      return;
    }
    const auto next = load<std::uint32_t>(page.data() + payload.at + local, std::endian::big);
    for (const PageView view : file_.views(index)) {
      gathered_.assign(here.begin(), here.end());
      if (gather(next, view, payload.bytes) && is_it(std::span<const std::byte>(gathered_))) break;
    }
    if (gathered_.capacity() > kKeptBytes) gathered_ = {};
  }
  [[nodiscard]] Status status() const {
    if (!is_too_slow_) return {};
    return make_error(ErrorCode::LimitExceeded, "too many page references: the pages form cycles");
  }
  [[nodiscard]] bool is_too_slow() const { return is_too_slow_; }

  /// Determines the page layout: the layout where a body that spans several pages has a correct checksum, or if
  /// there is none, the layout with the most correct bodies.
  void find_layout();

 private:
  static constexpr std::size_t kKeptBytes = std::size_t{4} << 20;

  // Appends overflow pages to the gathered payload. Returns false if they end too early.
  bool gather(std::uint32_t next, PageView view, std::uint64_t payload_bytes) {
    overflow_.resize(file_.layout().page_size);
    const std::uint64_t limit = kMaxReadsOfByte * file_.bytes();
    while (gathered_.size() < payload_bytes) {
      read_bytes_ += overflow_.size();
      is_too_slow_ = is_too_slow_ || read_bytes_ > limit;
      if (is_too_slow_ || !file_.read(next, view, overflow_)) return false;
      next = load<std::uint32_t>(overflow_.data(), std::endian::big);
      const std::size_t count = std::min<std::uint64_t>(usable() - 4, payload_bytes - gathered_.size());
      gathered_.insert(gathered_.end(), overflow_.begin() + 4,
                       overflow_.begin() + 4 + static_cast<std::ptrdiff_t>(count));
    }
    return true;
  }

  PageFile file_;
  std::vector<std::byte> gathered_;
  std::vector<std::byte> overflow_;
  std::uint64_t read_bytes_ = 0;
  bool is_too_slow_ = false;
};

/// A chunk's row whose body begins within a page: a payload of NULL and the body.
struct FoundBody {
  Payload payload;
  std::size_t header_bytes = 0;  ///< of the record
};

/// Parses the record header before a body: its length, NULL, and the blob's length as 2 n + 12.
std::optional<FoundBody> row_of_body(std::span<const std::byte> page, std::size_t body_at) {
  for (std::size_t bytes = 1; bytes <= 5; ++bytes) {
    const std::size_t header = bytes + 2;
    if (body_at < header) break;
    const auto type = varint_before(page, body_at, bytes);
    if (!type || *type < 12 || *type % 2 != 0 || std::to_integer<std::size_t>(page[body_at - header]) != header ||
        page[body_at - header + 1] != std::byte{0}) {
      continue;
    }
    return FoundBody{{body_at - header, header + (*type - 12) / 2}, header};
  }
  return std::nullopt;
}

/// Returns the row's key, which lies between the payload's length and the payload.
std::int64_t key_before(std::span<const std::byte> page, const Payload& payload) {
  QUOIN_ASSERT(payload.at <= page.size(), "a payload of this page");
  for (std::size_t bytes = 1; bytes <= 9 && bytes < payload.at; ++bytes) {
    const auto key = varint_before(page, payload.at, bytes);
    if (!key) continue;
    for (std::size_t of_length = 1; of_length <= 5; ++of_length) {
      if (varint_before(page, payload.at - bytes, of_length) == payload.bytes) return static_cast<std::int64_t>(*key);
    }
  }
  return kLostKey;
}

/// Calls `visit(key, body, spans_pages)` for the bodies that begin in a page, until it returns false.
template <class Visit>
bool bodies_of_page(Scan& scan, std::span<const std::byte> page, std::size_t index, Visit&& visit) {
  constexpr std::size_t kMagicInBody = 8;
  const auto usable = page.first(scan.usable());
  for (std::size_t at = kMagicInBody; at + 4 <= usable.size(); ++at) {
    const void* const found = std::memchr(usable.data() + at, 'Q', usable.size() - 3 - at);
    if (found == nullptr) break;
    at = static_cast<std::size_t>(static_cast<const std::byte*>(found) - usable.data());
    if (std::memcmp(usable.data() + at, "QCB", 3) != 0) continue;
    const auto row = row_of_body(usable, at - kMagicInBody);
    if (!row || !scan.fits(row->payload)) continue;
    bool goes_on = true;
    scan.each_state(page, index, row->payload, [&](std::span<const std::byte> payload) {
      const auto body = payload.subspan(row->header_bytes);
      if (!read_header(body)) return false;
      const bool is_spilled = local_bytes(row->payload.bytes, usable.size()) < row->payload.bytes;
      goes_on = visit(key_before(usable, row->payload), body, is_spilled);
      return true;
    });
    if (!goes_on || scan.is_too_slow()) return false;
  }
  return true;
}

void Scan::find_layout() {
  const std::vector<PageLayout> layouts = file_.layouts();
  PageLayout best = layouts.front();
  std::size_t most = 0;
  for (const PageLayout& layout : layouts) {
    file_.set_layout(layout);
    bool is_found = false;
    std::size_t bodies = 0;
    each_page(kSampledBytes, [&](std::span<const std::byte> page, std::size_t index) {
      return bodies_of_page(*this, page, index, [&](std::int64_t, std::span<const std::byte>, bool is_spilled) {
        is_found = is_found || is_spilled;
        ++bodies;
        return !is_found;
      });
    });
    // Discards the counters of a wrong layout.
    read_bytes_ = 0;
    is_too_slow_ = false;
    if (is_found) return;
    if (bodies > std::exchange(most, std::max(most, bodies))) best = layout;
  }
  file_.set_layout(best);
}

/// Reads the header of a record. Returns false if its lengths disagree with the payload's.
bool read_types(std::span<const std::byte> page, const Payload& payload, std::vector<std::uint64_t>& types) {
  QUOIN_ASSERT(payload.at <= page.size(), "a payload of this page");
  const std::size_t local = std::min<std::uint64_t>(payload.bytes, page.size() - payload.at);
  const auto record = page.subspan(payload.at, local);
  const Varint header = varint_at(record, 0);
  if (header.bytes == 0 || header.value > record.size() || header.value < header.bytes + 2) return false;
  types.clear();
  std::uint64_t total = header.value;
  std::size_t at = header.bytes;
  while (at < header.value) {
    const Varint type = varint_at(record.first(static_cast<std::size_t>(header.value)), at);
    const auto bytes = type.bytes == 0 ? std::nullopt : bytes_of_type(type.value);
    if (!bytes || *bytes > payload.bytes - total || types.size() == kMaxColumns) return false;
    total += *bytes;
    at += type.bytes;
    types.push_back(type.value);
  }
  return total == payload.bytes && types.size() >= 2;
}

ColumnValue value_of(std::uint64_t type, std::span<const std::byte> bytes) {
  QUOIN_ASSERT(bytes_of_type(type) == bytes.size(), "the bytes of that type");
  if (type == 0) return {};
  if (type >= 12) {
    if (type % 2 == 0) return std::vector<std::byte>(bytes.begin(), bytes.end());
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  if (type == 7) return load<double>(bytes.data(), std::endian::big);
  if (type >= 8) return static_cast<std::int64_t>(type - 8);
  std::uint64_t number = (bytes[0] & std::byte{0x80}) != std::byte{0} ? ~std::uint64_t{0} : 0;
  for (const std::byte byte : bytes) number = number << 8 | std::to_integer<std::uint64_t>(byte);
  return static_cast<std::int64_t>(number);
}

// Requires: the types agree with the payload.
void read_columns(std::span<const std::byte> payload, const std::vector<std::uint64_t>& types, PageRecord& record) {
  record.columns.clear();
  std::size_t at = static_cast<std::size_t>(varint_at(payload, 0).value);
  for (const std::uint64_t type : types) {
    const auto bytes = static_cast<std::size_t>(*bytes_of_type(type));
    QUOIN_ASSERT(at <= payload.size() && bytes <= payload.size() - at, "columns within the payload");
    record.columns.push_back(value_of(type, payload.subspan(at, bytes)));
    at += bytes;
  }
}

Result<Scan> open_scan(const std::filesystem::path& database) {
  auto file = PageFile::open(database);
  if (!file) return file.error();
  Scan scan(std::move(*file));
  scan.find_layout();
  return scan;
}

Status named(Status status, const std::filesystem::path& database) {
  if (!status) status.error().path = database.string();
  return status;
}

}  // namespace

Status scan_records(const std::filesystem::path& database, FunctionRef<void(const PageRecord&)> visit) {
  auto scan = open_scan(database);
  if (!scan) return scan.error();
  PageRecord record;
  std::vector<std::uint64_t> types;
  scan->each_page(~std::uint64_t{0}, [&](std::span<const std::byte> page, std::size_t index) {
    const auto usable = page.first(scan->usable());
    for (std::size_t at = 0; at < usable.size() && !scan->is_too_slow(); ++at) {
      const Varint bytes = varint_at(usable, at);
      if (bytes.bytes == 0 || bytes.value < 3 || bytes.value > kMaxPayload) continue;
      const Varint row = varint_at(usable, at + bytes.bytes);
      const Payload payload{at + bytes.bytes + row.bytes, bytes.value};
      if (row.bytes == 0 || !scan->fits(payload) || !read_types(usable, payload, types)) continue;
      record.row = static_cast<std::int64_t>(row.value);
      scan->each_state(page, index, payload, [&](std::span<const std::byte> whole) {
        read_columns(whole, types, record);
        visit(record);
        return false;  // the caller's checksum selects the correct state
      });
    }
    return !scan->is_too_slow();
  });
  return named(scan->status(), database);
}

Status scan_bodies(const std::filesystem::path& database,
                   FunctionRef<void(std::int64_t key, std::span<const std::byte> body)> visit) {
  auto scan = open_scan(database);
  if (!scan) return scan.error();
  scan->each_page(~std::uint64_t{0}, [&](std::span<const std::byte> page, std::size_t index) {
    return bodies_of_page(*scan, page, index, [&](std::int64_t key, std::span<const std::byte> body, bool) {
      visit(key, body);
      return true;
    });
  });
  return named(scan->status(), database);
}

namespace {

constexpr std::size_t kDatabaseHeader = 100;
constexpr std::size_t kPageSizeAt = 16;
constexpr std::size_t kReservedAt = 20;
constexpr std::size_t kLogHeader = 32;
constexpr std::size_t kFrameHeader = 24;
constexpr std::size_t kMinUsable = 480;

bool is_page_size(std::uint32_t size) {
  return std::has_single_bit(size) && size >= 512 && size <= 65'536;
}

}  // namespace

Result<std::optional<RandomFile>> RandomFile::open(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    if (errno == ENOENT) return std::optional<RandomFile>();
    return make_error(ErrorCode::CannotRead, std::generic_category().message(errno), path.string());
  }
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(descriptor);
    return make_error(ErrorCode::CannotRead, "not a regular file", path.string());
  }
  return std::optional(RandomFile(descriptor, static_cast<std::uint64_t>(status.st_size)));
}

RandomFile::~RandomFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void RandomFile::read(std::uint64_t offset, std::span<std::byte> out) const {
  std::size_t done = 0;
  while (done < out.size() && offset + done < size_) {
    const ssize_t count = ::pread(descriptor_, out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    done += static_cast<std::size_t>(count);
  }
  std::fill(out.begin() + static_cast<std::ptrdiff_t>(done), out.end(), std::byte{0});
}

Result<PageFile> PageFile::open(const std::filesystem::path& database) {
  auto file = RandomFile::open(database);
  if (!file) return file.error();
  if (!*file) return make_error(ErrorCode::CannotRead, "no such file", database.string());
  std::filesystem::path log_path = database;
  log_path += "-wal";
  auto log = RandomFile::open(log_path);
  if (!log) return log.error();
  PageFile pages(std::move(**file), std::move(*log));
  pages.set_layout(pages.layouts().front());
  return pages;
}

std::vector<PageLayout> PageFile::layouts() const {
  std::vector<PageLayout> found;
  const auto add = [&](std::uint32_t size, std::size_t reserved) {
    if (!is_page_size(size) || size - reserved < kMinUsable) return;
    const auto is_same = [&](const PageLayout& l) { return l.page_size == size && l.usable == size - reserved; };
    if (std::ranges::none_of(found, is_same)) found.push_back({size, size - reserved});
  };
  std::array<std::byte, kDatabaseHeader> header{};
  file_.read(0, header);
  const std::uint32_t stored = load<std::uint16_t>(header.data() + kPageSizeAt, std::endian::big);
  const std::uint32_t size = stored == 1 ? 65'536 : stored;
  const auto reserved = std::to_integer<std::size_t>(header[kReservedAt]);
  add(size, reserved);
  add(size, 0);
  if (log_) {
    std::array<std::byte, kLogHeader> of_log{};
    log_->read(0, of_log);
    add(load<std::uint32_t>(of_log.data() + 8, std::endian::big), reserved);
    add(load<std::uint32_t>(of_log.data() + 8, std::endian::big), 0);
  }
  for (const std::uint32_t guess : {8'192U, 4'096U, 16'384U, 32'768U, 65'536U, 2'048U, 1'024U, 512U}) add(guess, 0);
  return found;
}

void PageFile::set_layout(const PageLayout& layout) {
  QUOIN_ASSERT(is_page_size(static_cast<std::uint32_t>(layout.page_size)) && layout.usable <= layout.page_size &&
                   layout.usable >= kMinUsable,
               "a layout of `layouts`");
  layout_ = layout;
  file_pages_ = static_cast<std::size_t>((file_.size() + layout.page_size - 1) / layout.page_size);
  frames_.clear();
  frames_of_.clear();
  if (!log_ || log_->size() <= kLogHeader) return;
  const auto frames = static_cast<std::size_t>((log_->size() - kLogHeader) / (kFrameHeader + layout.page_size));
  for (std::size_t i = 0; i < frames; ++i) {
    std::array<std::byte, kFrameHeader> header{};
    log_->read(offset_of_frame(i), header);
    const auto page = load<std::uint32_t>(header.data(), std::endian::big);
    frames_.push_back({page, load<std::uint32_t>(header.data() + 4, std::endian::big) != 0});
    frames_of_[page].push_back(static_cast<std::uint32_t>(i));
  }
}

std::uint64_t PageFile::offset_of_frame(std::size_t frame) const {
  QUOIN_ASSERT(log_.has_value(), "a database with a log");
  return kLogHeader + std::uint64_t{frame} * (kFrameHeader + layout_.page_size);
}

void PageFile::read(std::size_t index, std::span<std::byte> page) const {
  QUOIN_ASSERT(index < page_count() && page.size() == layout_.page_size, "a page, and room for it");
  if (index < file_pages_) return file_.read(std::uint64_t{index} * layout_.page_size, page);
  log_->read(offset_of_frame(index - file_pages_) + kFrameHeader, page);
}

std::vector<PageView> PageFile::views(std::size_t index) const {
  QUOIN_ASSERT(index < page_count(), "a page of the file or of its log");
  if (frames_.empty()) return {{0}};
  if (index < file_pages_) return {{0}, {frames_.size()}};
  std::size_t end = index - file_pages_;
  while (end + 1 < frames_.size() && !frames_[end].ends_transaction) ++end;
  return {{end + 1}, {frames_.size()}, {0}};
}

bool PageFile::read(std::uint32_t number, PageView view, std::span<std::byte> page) const {
  if (number == 0) return false;
  if (const auto found = frames_of_.find(number); view.frames > 0 && found != frames_of_.end()) {
    const auto after = std::ranges::lower_bound(found->second, view.frames);
    if (after != found->second.begin()) {
      read(file_pages_ + *std::prev(after), page);
      return true;
    }
  }
  if (number > file_pages_) return false;
  read(std::size_t{number} - 1, page);
  return true;
}

}  // namespace quoin::store

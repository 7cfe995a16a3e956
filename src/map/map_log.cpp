#include "map/map_log.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/io/file.h>

#include "core/bytes/bytes.h"
#include "core/rows/packed_row.h"

namespace quoin::map {

namespace {

constexpr std::string_view kMagic = "quoin map 1 ";
constexpr std::string_view kAnyVersion = "quoin map ";
constexpr std::size_t kFixedBytes = 3 * 4 + 8 + 1;
constexpr std::size_t kHashBytes = 8;
constexpr std::size_t kMaxRecord = std::size_t{1} << 24;
constexpr std::uint8_t kHasFile = 1;
constexpr std::uint8_t kIsGone = 2;

std::vector<std::byte> record_of(TilePlace place, const TileRecord& record, bool is_gone) {
  ByteWriter out;
  out.u32(static_cast<std::uint32_t>(kFixedBytes + record.signs.size() + kHashBytes));
  out.i32(place.z);
  out.i32(place.x);
  out.i32(place.y);
  out.u64(record.stamp);
  out.u8(static_cast<std::uint8_t>((record.has_file ? kHasFile : 0) | (is_gone ? kIsGone : 0)));
  out.text(record.signs);
  out.u64(hash_of_bytes(kHashSeed, out.bytes()));
  return out.take();
}

Error cannot_write(const std::filesystem::path& path) {
  return make_error(ErrorCode::CannotWrite, std::generic_category().message(errno), path.string());
}

std::vector<std::byte> heading(const std::string& identity) {
  QUOIN_ASSERT(identity.find('\n') == std::string::npos, "an identity of one line");
  ByteWriter out;
  out.text(std::string(kMagic) + identity + "\n");
  return out.take();
}

}  // namespace

MapLog::MapLog(MapLog&& other) noexcept
    : path_(std::move(other.path_)),
      identity_(std::move(other.identity_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      tiles_(std::move(other.tiles_)),
      records_(other.records_),
      size_(other.size_) {}

MapLog::~MapLog() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<MapLog> MapLog::open(const std::filesystem::path& path, const std::string& identity) {
  MapLog log(path);
  log.identity_ = identity;
  log.descriptor_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_APPEND, 0644);
  if (log.descriptor_ < 0) return cannot_write(path);
  if (::flock(log.descriptor_, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return cannot_write(path);
    return make_error(ErrorCode::InvalidArgument, "another process is drawing this map", path.string());
  }
  // A process that ended meanwhile may have replaced the file (`compact`): the lock is then of the old one.
  struct stat locked {};
  struct stat present {};
  const bool is_same = ::fstat(log.descriptor_, &locked) == 0 && ::stat(path.c_str(), &present) == 0 &&
                       locked.st_dev == present.st_dev && locked.st_ino == present.st_ino;
  if (!is_same) return make_error(ErrorCode::InvalidArgument, "another process is drawing this map", path.string());
  auto bytes = read_file(path);
  if (!bytes) return bytes.error();
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  const std::size_t end = text.find('\n');
  std::size_t used = 0;
  if (end != std::string_view::npos) {
    const std::string_view line = text.substr(0, end);
    if (!line.starts_with(kAnyVersion)) {
      return make_error(ErrorCode::InvalidArgument, "not the log of a map", path.string());
    }
    if (!line.starts_with(kMagic)) {
      return make_error(ErrorCode::InvalidArgument,
                        "the map was drawn by another version of Quoin; delete the folder or choose another one",
                        path.string());
    }
    if (line.substr(kMagic.size()) != identity) {
      return make_error(ErrorCode::InvalidArgument,
                        "the folder holds a map of another world, or with other options: " +
                            std::string(line.substr(kMagic.size())) + "; delete it or choose another folder",
                        path.string());
    }
    used = end + 1 + log.read(std::span(*bytes).subspan(end + 1));
  }
  if (used == 0) {
    if (::ftruncate(log.descriptor_, 0) != 0) return cannot_write(path);
    if (auto done = log.append(heading(identity)); !done) return done.error();
  } else if (used < bytes->size() && ::ftruncate(log.descriptor_, static_cast<off_t>(used)) != 0) {
    return cannot_write(path);
  } else {
    log.size_ = used;
  }
  return log;
}

std::size_t MapLog::read(std::span<const std::byte> bytes) {
  std::size_t at = 0;
  while (bytes.size() - at >= 4) {
    const std::size_t size = load<std::uint32_t>(bytes.data() + at, std::endian::little);
    if (size < kFixedBytes + kHashBytes || size > kMaxRecord || size > bytes.size() - at - 4) break;
    const std::span<const std::byte> record = bytes.subspan(at, 4 + size - kHashBytes);
    const auto hash = load<std::uint64_t>(record.data() + record.size(), std::endian::little);
    if (hash != hash_of_bytes(kHashSeed, record)) break;
    const auto number = [&](std::size_t i) {
      return load<std::int32_t>(record.data() + 4 + 4 * i, std::endian::little);
    };
    const TilePlace place{number(0), number(1), number(2)};
    const auto flags = std::to_integer<std::uint8_t>(record[4 + kFixedBytes - 1]);
    if ((flags & kIsGone) != 0) {
      tiles_.erase(place);
    } else {
      const auto signs = record.subspan(4 + kFixedBytes);
      tiles_[place] = {load<std::uint64_t>(record.data() + 4 + 12, std::endian::little), (flags & kHasFile) != 0,
                       std::string(reinterpret_cast<const char*>(signs.data()), signs.size())};
    }
    ++records_;
    at += 4 + size;
  }
  return at;
}

Status MapLog::append(const std::vector<std::byte>& record) {
  std::size_t written = 0;
  while (written < record.size()) {
    const ssize_t count = ::write(descriptor_, record.data() + written, record.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const Error error = cannot_write(path_);
      // Without half of a record, later ones can be read.
      if (::ftruncate(descriptor_, static_cast<off_t>(size_)) != 0) return cannot_write(path_);
      return error;
    }
    written += static_cast<std::size_t>(count);
  }
  size_ += record.size();
  return {};
}

std::optional<TileRecord> MapLog::find(TilePlace place) {
  const std::scoped_lock lock(mutex_);
  const auto found = tiles_.find(place);
  return found == tiles_.end() ? std::nullopt : std::optional(found->second);
}

Status MapLog::put(TilePlace place, TileRecord record) {
  QUOIN_ASSERT(record.signs.size() < kMaxRecord / 2, "a record that can be read again");
  const std::vector<std::byte> bytes = record_of(place, record, false);
  const std::scoped_lock lock(mutex_);
  if (auto done = append(bytes); !done) return done;
  tiles_[place] = std::move(record);
  ++records_;
  return {};
}

Status MapLog::remove(TilePlace place) {
  const std::scoped_lock lock(mutex_);
  if (auto done = append(record_of(place, {}, true)); !done) return done;
  tiles_.erase(place);
  ++records_;
  return {};
}

Status MapLog::compact() {
  constexpr std::size_t kFew = 100;
  if (records_ <= 2 * tiles_.size() + kFew) return {};
  std::vector<std::byte> bytes = heading(identity_);
  for (const auto& [place, record] : tiles_) {
    const std::vector<std::byte> one = record_of(place, record, false);
    bytes.insert(bytes.end(), one.begin(), one.end());
  }
  // The lock is on the file that this one replaces; the run ends before another one can tell.
  if (auto done = write_file(bytes, path_); !done) return done;
  records_ = tiles_.size();
  return {};
}

}  // namespace quoin::map

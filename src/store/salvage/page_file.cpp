#include "store/salvage/page_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include <quoin/core/assert.h>

#include "core/bytes/byte_order.h"

namespace quoin::store {
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

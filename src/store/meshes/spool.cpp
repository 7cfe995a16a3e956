#include "store/meshes/spool.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::store {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

Status failed(int number) {
  return make_error(ErrorCode::CannotWrite,
                    "cannot write a temporary file: " + std::generic_category().message(number));
}

// Opens a file without a name, or removes its name at once.
int open_nameless(const std::filesystem::path& folder) {
  const std::string where = folder.empty() ? "." : folder.string();
  const int file = ::open(where.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL)) return file;
  std::string name = where + "/.quoin-spool-XXXXXX";
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

Spool::Spool(Spool&& other) noexcept
    : file_(std::exchange(other.file_, -1)),
      buffer_(std::move(other.buffer_)),
      written_(std::exchange(other.written_, 0)),
      mapped_(std::exchange(other.mapped_, nullptr)) {}

Spool& Spool::operator=(Spool&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(buffer_, other.buffer_);
  std::swap(written_, other.written_);
  std::swap(mapped_, other.mapped_);
  return *this;
}

Spool::~Spool() {
  if (mapped_ != nullptr) ::munmap(mapped_, written_);
  if (file_ >= 0) ::close(file_);
}

Status Spool::append(std::span<const std::byte> bytes, const std::filesystem::path& folder) {
  QUOIN_ASSERT(mapped_ == nullptr, "not finished");
  if (file_ < 0) {
    file_ = open_nameless(folder);
    if (file_ < 0) return failed(errno);
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return buffer_.size() < kBufferBytes ? Status() : write_buffer();
}

Status Spool::write_buffer() {
  for (std::size_t done = 0; done < buffer_.size();) {
    const ssize_t count = ::write(file_, buffer_.data() + done, buffer_.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return failed(count < 0 ? errno : ENOSPC);
    done += static_cast<std::size_t>(count);
  }
  written_ += buffer_.size();
  buffer_.clear();
  return {};
}

Status Spool::finish() {
  if (file_ < 0) return {};
  if (auto done = write_buffer(); !done) return done;
  buffer_ = {};
  if (written_ == 0) return {};
  void* const mapped = ::mmap(nullptr, written_, PROT_READ, MAP_SHARED, file_, 0);
  if (mapped == MAP_FAILED) return failed(errno);
  mapped_ = mapped;
  ::close(std::exchange(file_, -1));
  return {};
}

void Spool::give_back() const {
  if (mapped_ != nullptr) ::madvise(mapped_, written_, MADV_DONTNEED);
}

}  // namespace quoin::store

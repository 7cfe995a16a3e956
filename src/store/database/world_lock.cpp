#include "store/database/world_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

namespace quoin::store {

namespace {

bool is_without_locks(int number) {
  return number == ENOLCK || number == EOPNOTSUPP || number == ENOSYS || number == EINVAL;
}

Error refused(int number) {
  if (number == EWOULDBLOCK) {
    return make_error(ErrorCode::CannotWrite, "it is already open for writing, in this or another program");
  }
  if (is_without_locks(number)) {
    return make_error(ErrorCode::CannotWrite, "cannot write it safely: its file system has no locks");
  }
  return make_error(ErrorCode::CannotWrite, "cannot lock it: " + std::generic_category().message(number));
}

// Returns true if the open file still has that name: its last holder may have removed it.
bool is_named(int descriptor, const std::filesystem::path& file) {
  struct stat open_file {};
  struct stat named {};
  return ::fstat(descriptor, &open_file) == 0 && ::stat(file.c_str(), &named) == 0 &&
         open_file.st_ino == named.st_ino && open_file.st_dev == named.st_dev;
}

}  // namespace

Result<WorldLock> WorldLock::take(const std::filesystem::path& world) {
  constexpr int kAttempts = 100;
  WorldLock lock;
  lock.file_ = world.string() + "-lock";
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    lock.descriptor_ = ::open(lock.file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (lock.descriptor_ < 0) {
      const int number = errno;
      if (number == ENOENT) return make_error(ErrorCode::CannotWrite, "its folder does not exist");
      return make_error(ErrorCode::CannotWrite,
                        "cannot create its lock file: " + std::generic_category().message(number));
    }
    const int number = ::flock(lock.descriptor_, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
    if (number == 0 && is_named(lock.descriptor_, lock.file_)) return lock;
    ::close(std::exchange(lock.descriptor_, -1));
    if (is_without_locks(number)) ::unlink(lock.file_.c_str());
    if (number != 0) return refused(number);
  }
  return refused(EWOULDBLOCK);
}

WorldLock::WorldLock(WorldLock&& other) noexcept
    : file_(std::move(other.file_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

WorldLock& WorldLock::operator=(WorldLock&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

WorldLock::~WorldLock() {
  if (descriptor_ < 0) return;
  ::unlink(file_.c_str());  // unlinked while locked: a waiting process detects that the name refers to another file
  ::close(descriptor_);
}

bool has_locks(const std::filesystem::path& world) {
  // Queries the folder: closing a descriptor of the world itself would release this process's locks on it.
  const std::filesystem::path folder = world.parent_path();
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return true;
  const int number = ::flock(descriptor, LOCK_SH | LOCK_NB) == 0 ? 0 : errno;
  ::close(descriptor);
  return !is_without_locks(number);
}

bool is_on_network(const std::filesystem::path& world) {
  // NFS, SMB, CIFS, SMB2, 9P, Ceph, FUSE (sshfs and others), AFS, Coda.
  constexpr std::array<unsigned long, 9> kKinds = {0x6969,     0x517B,     0xFF534D42, 0xFE534D42, 0x01021997,
                                                   0x00C36400, 0x65735546, 0x5346414F, 0x73757245};
  const std::filesystem::path folder = world.parent_path();
  struct statfs info {};
  if (::statfs(folder.empty() ? "." : folder.c_str(), &info) != 0) return false;
  const auto kind = static_cast<unsigned long>(info.f_type) & 0xFFFFFFFFUL;
  return std::ranges::find(kKinds, kind) != kKinds.end();
}

}  // namespace quoin::store

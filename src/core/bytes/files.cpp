#include "core/bytes/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <map>
#include <mutex>
#include <tuple>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin {

namespace {

using FileNumber = std::pair<unsigned long, unsigned long>;

// Locks belong to the process, so this registry is global.
struct Held {
  int databases = 0;
  int descriptor = -1;  // opened for reading; kept open as long as databases or readers need it
  int readers = 0;      // that got the descriptor and have not closed it
};
struct HeldFiles {
  std::mutex mutex;
  std::map<FileNumber, Held> files;

  /// Removes a file that neither databases nor readers need. Requires: the caller has the mutex.
  void release_unused(std::map<FileNumber, Held>::iterator file) {
    if (file->second.databases != 0 || file->second.readers != 0) return;
    if (file->second.descriptor >= 0) ::close(file->second.descriptor);
    files.erase(file);
  }
};

HeldFiles& held_files() {
  static HeldFiles files;
  return files;
}

FileNumber number_of(const struct stat& info) {
  return {static_cast<unsigned long>(info.st_dev), static_cast<unsigned long>(info.st_ino)};
}

}  // namespace

HeldFile::HeldFile(const std::filesystem::path& file) {
  struct stat info {};
  if (::stat(file.c_str(), &info) != 0) return;
  std::tie(device_, number_) = number_of(info);
  holds_ = true;
  HeldFiles& held = held_files();
  const std::scoped_lock lock(held.mutex);
  ++held.files[{device_, number_}].databases;
}

HeldFile::HeldFile(HeldFile&& other) noexcept
    : device_(other.device_), number_(other.number_), holds_(std::exchange(other.holds_, false)) {}

HeldFile& HeldFile::operator=(HeldFile&& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(number_, other.number_);
  std::swap(holds_, other.holds_);
  return *this;
}

HeldFile::~HeldFile() {
  if (!holds_) return;
  HeldFiles& held = held_files();
  const std::scoped_lock lock(held.mutex);
  const auto found = held.files.find({device_, number_});
  QUOIN_ASSERT(found != held.files.end() && found->second.databases > 0, "a file that is held");
  --found->second.databases;
  held.release_unused(found);
}

int open_for_reading(const std::filesystem::path& file) {
  HeldFiles& held = held_files();
  const std::scoped_lock lock(held.mutex);
  struct stat info {};
  const auto found = ::stat(file.c_str(), &info) == 0 ? held.files.find(number_of(info)) : held.files.end();
  const bool is_held = found != held.files.end();
  int descriptor = is_held ? found->second.descriptor : -1;
  // O_NONBLOCK: a FIFO without a writer would otherwise block before it can be refused.
  if (descriptor < 0) descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (is_held && descriptor >= 0) {
    found->second.descriptor = descriptor;
    ++found->second.readers;
  }
  return descriptor;
}

void close_after_reading(int descriptor) {
  HeldFiles& held = held_files();
  const std::scoped_lock lock(held.mutex);
  struct stat info {};
  if (::fstat(descriptor, &info) == 0) {
    const auto found = held.files.find(number_of(info));
    // Without databases, a descriptor of its own is closed like that of any file.
    if (found != held.files.end() && (found->second.databases > 0 || found->second.descriptor == descriptor)) {
      Held& file = found->second;
      // A descriptor opened before the database also stays open. It leaks if the file already has one, which is rare.
      if (file.descriptor < 0) file.descriptor = descriptor;
      if (file.descriptor == descriptor && file.readers > 0) --file.readers;
      held.release_unused(found);
      return;
    }
  }
  ::close(descriptor);
}

void sync_folder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace quoin

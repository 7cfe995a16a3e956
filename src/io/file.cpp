#include <quoin/io/file.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "core/bytes/files.h"
#include "core/bytes/text.h"

namespace quoin {

namespace {

// Far above any valid input. Keeps a sparse file of terabytes from exhausting the memory.
constexpr std::uint64_t kMaxFileBytes = std::uint64_t{8} << 30;

constexpr mode_t kPermissionBits = 07777;

std::string reason(int error_number) {
  return std::generic_category().message(error_number);
}

Error cannot_read(std::string message, const std::filesystem::path& path) {
  return make_error(ErrorCode::CannotRead, std::move(message), path.string());
}

Error cannot_write(std::string message, const std::filesystem::path& path) {
  return make_error(ErrorCode::CannotWrite, std::move(message), path.string());
}

/// Returns an error if the folder of `path` does not exist.
Status check_folder(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.parent_path();
  std::error_code unknown;
  if (folder.empty() || std::filesystem::is_directory(folder, unknown)) return {};
  const auto kind = std::filesystem::status(folder, unknown).type();
  if (kind == std::filesystem::file_type::none || kind == std::filesystem::file_type::unknown) return {};
  const bool is_absent = kind == std::filesystem::file_type::not_found;
  std::string why = is_absent ? "the folder \"" : "\"";
  why.append(folder.string()).append(is_absent ? "\" does not exist" : "\" is not a folder");
  return cannot_write(std::move(why), path);
}

/// Returns a name in the folder of `path` that no other writer in any process uses.
std::filesystem::path temporary_name(const std::filesystem::path& path, unsigned attempt) {
  static std::atomic<unsigned> counter{0};
  const std::string name =
      ".quoin-" + std::to_string(::getpid()) + "-" + std::to_string(counter++) + "-" + std::to_string(attempt) + ".tmp";
  return path.parent_path() / name;
}

/// Returns the reason why `path` cannot be replaced by a file, or 0. `mode` becomes the permissions of the existing
/// file.
Status check_replaceable(const std::filesystem::path& path, std::optional<mode_t>& mode) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) {
    if (errno == ENOENT) return {};
    return cannot_write(reason(errno), path);
  }
  if (S_ISDIR(info.st_mode)) return cannot_write("it is a folder", path);
  if (!S_ISREG(info.st_mode)) return cannot_write("it is not a regular file", path);
  if (::access(path.c_str(), W_OK) != 0) return cannot_write(reason(errno), path);
  mode = info.st_mode & kPermissionBits;
  return {};
}

}  // namespace

std::filesystem::path follow_links(std::filesystem::path path) {
  constexpr int kMaxLinks = 40;
  std::error_code error;
  for (int i = 0; i < kMaxLinks && std::filesystem::is_symlink(path, error); ++i) {
    const std::filesystem::path target = std::filesystem::read_symlink(path, error);
    if (error) break;
    path = path.parent_path() / target;
  }
  return path;
}

bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code missing;
  if (std::filesystem::equivalent(a, b, missing)) return true;
  const std::filesystem::path whole = std::filesystem::weakly_canonical(follow_links(a), missing);
  return !missing && whole == std::filesystem::weakly_canonical(follow_links(b), missing) && !missing;
}

struct InputFile::Opened {
  std::filesystem::path path;
  int descriptor;

  Opened(std::filesystem::path name, int opened) : path(std::move(name)), descriptor(opened) {}
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  ~Opened() {
    if (descriptor >= 0) close_after_reading(descriptor);
  }
};

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
  const auto opened = std::make_shared<Opened>(path, -1);
  opened->descriptor = open_for_reading(path);
  struct stat info {};
  if (opened->descriptor < 0 || ::fstat(opened->descriptor, &info) != 0) return cannot_read(reason(errno), path);
  if (S_ISDIR(info.st_mode)) return cannot_read("it is a folder", path);
  if (!S_ISREG(info.st_mode)) return cannot_read("it is not a regular file", path);
  return InputFile(opened);
}

const std::filesystem::path& InputFile::path() const {
  return opened_->path;
}

Result<std::vector<std::byte>> InputFile::read() const {
  return read_beginning(std::numeric_limits<std::size_t>::max());
}

Result<std::vector<std::byte>> InputFile::read_beginning(std::size_t max_bytes) const {
  const auto& [path, descriptor] = *opened_;
  struct stat info {};
  if (::fstat(descriptor, &info) != 0) return cannot_read(reason(errno), path);
  const auto held = static_cast<std::uint64_t>(info.st_size);
  const std::uint64_t wanted = std::min<std::uint64_t>(held, max_bytes);
  if (wanted > kMaxFileBytes) {
    return make_error(ErrorCode::LimitExceeded, "the file has " + std::to_string(held) + " bytes", path.string());
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(wanted));
  std::size_t filled = 0;
  while (filled < bytes.size()) {
    const ssize_t count = ::pread(descriptor, bytes.data() + filled, bytes.size() - filled, static_cast<off_t>(filled));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return cannot_read(reason(errno), path);
    if (count == 0) break;
    filled += static_cast<std::size_t>(count);
  }
  bytes.resize(filled);
  return bytes;
}

Result<std::vector<std::byte>> read_file(const std::filesystem::path& path) {
  const auto file = InputFile::open(path);
  return file ? file->read() : Result<std::vector<std::byte>>(file.error());
}

Result<std::vector<std::byte>> read_file_beginning(const std::filesystem::path& path, std::size_t max_bytes) {
  const auto file = InputFile::open(path);
  return file ? file->read_beginning(max_bytes) : Result<std::vector<std::byte>>(file.error());
}

Result<AtomicFile> AtomicFile::create(const std::filesystem::path& path) {
  AtomicFile file;
  file.path_ = follow_links(path);
  std::optional<mode_t> mode;
  Status status = check_folder(file.path_);
  if (status) status = check_replaceable(file.path_, mode);
  if (!status) {
    status.error().path = path.string();
    return status.error();
  }
  constexpr unsigned kAttempts = 100;
  for (unsigned attempt = 0; attempt < kAttempts && file.descriptor_ < 0; ++attempt) {
    std::filesystem::path name = temporary_name(file.path_, attempt);
    file.descriptor_ = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file.descriptor_ >= 0) file.temporary_ = std::move(name);  // before: another writer's file
    if (file.descriptor_ < 0 && errno != EEXIST) break;
  }
  if (file.descriptor_ < 0) return cannot_write(reason(errno), path);
  // Some file systems have no permissions, so a failure is ignored.
  if (mode.has_value()) static_cast<void>(::fchmod(file.descriptor_, *mode));
  return file;
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)),
      failed_(other.failed_) {}

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
  if (this == &other) return *this;
  discard();
  path_ = std::move(other.path_);
  temporary_ = std::exchange(other.temporary_, {});
  descriptor_ = std::exchange(other.descriptor_, -1);
  failed_ = other.failed_;
  return *this;
}

AtomicFile::~AtomicFile() {
  discard();
}

void AtomicFile::discard() noexcept {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  temporary_.clear();
}

Status AtomicFile::write(std::span<const std::byte> bytes) {
  if (descriptor_ < 0 || failed_) return cannot_write("an earlier write failed", path_);
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      failed_ = true;
      return cannot_write(reason(errno), path_);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return {};
}

Status AtomicFile::finish() {
  if (temporary_.empty() || failed_) return cannot_write("an earlier write failed", path_);
  if (descriptor_ < 0) return {};
  const int synced = ::fsync(descriptor_);
  const int sync_error = errno;
  const int closed = ::close(std::exchange(descriptor_, -1));
  const int close_error = errno;
  // EINVAL: this kind of file cannot be synced (some network and virtual file systems).
  const bool sync_failed = synced != 0 && sync_error != EINVAL;
  failed_ = sync_failed || closed != 0;
  if (failed_) return cannot_write(reason(sync_failed ? sync_error : close_error), path_);
  return {};
}

Status AtomicFile::commit() {
  if (Status finished = finish(); !finished) {
    discard();
    return finished;
  }
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) {
    const int error = errno;
    discard();
    return cannot_write(reason(error), path_);
  }
  temporary_.clear();
  sync_folder(path_.parent_path());
  return {};
}

namespace {

bool is_there(const std::filesystem::path& path) {
  struct stat info {};
  return ::lstat(path.c_str(), &info) == 0 || errno != ENOENT;
}

/// Makes a synced copy with the same permissions.
Status copy_whole(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::error_code failed;
  std::filesystem::copy_file(from, to, failed);
  if (failed) return cannot_write(failed.message(), to);
  const int descriptor = ::open(to.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return {};  // unreadable, like the original
  ::fsync(descriptor);
  ::close(descriptor);
  return {};
}

}  // namespace

std::filesystem::path FileBackup::name_for(const std::filesystem::path& path, Older older) {
  const std::filesystem::path file = follow_links(path);
  if (!is_there(file)) return {};
  std::filesystem::path backup = file;
  backup += "~";
  std::optional<mode_t> mode;
  if (!is_there(backup)) return backup;
  if (older == Older::Replaced && check_replaceable(backup, mode).has_value()) return backup;
  constexpr int kMost = 99;
  for (int number = 1; number <= kMost; ++number) {
    std::filesystem::path numbered = file;
    numbered += ".~" + std::to_string(number) + "~";
    if (!is_there(numbered)) return numbered;
  }
  return {};
}

Result<FileBackup> FileBackup::of(const std::filesystem::path& path, Older older) {
  FileBackup backup;
  const std::filesystem::path file = follow_links(path);
  if (!is_there(file)) return backup;
  const std::filesystem::path name = name_for(path, older);
  if (name.empty()) return cannot_write("no free name for a backup: NAME~ to NAME.~99~ exist", file);
  backup.backup_ = name;
  const std::filesystem::path second_name = temporary_name(file, 0);
  if (::link(file.c_str(), second_name.c_str()) == 0) {
    backup.second_name_ = second_name;
    return backup;
  }
  // An existing file is not overwritten; `backup` removes a partial copy.
  const bool was_there = is_there(second_name);
  if (!was_there) backup.second_name_ = second_name;
  if (Status copied = copy_whole(file, second_name); !copied) return copied.error();
  return backup;
}

FileBackup::FileBackup(FileBackup&& other) noexcept
    : second_name_(std::exchange(other.second_name_, {})), backup_(std::move(other.backup_)) {}

FileBackup& FileBackup::operator=(FileBackup&& other) noexcept {
  std::swap(second_name_, other.second_name_);
  std::swap(backup_, other.backup_);
  return *this;
}

FileBackup::~FileBackup() {
  if (!second_name_.empty()) ::unlink(second_name_.c_str());
}

Status FileBackup::keep() {
  if (second_name_.empty()) return {};
  if (::rename(second_name_.c_str(), backup_.c_str()) != 0) {
    const int error = errno;
    const std::string left = std::exchange(second_name_, {}).string();
    return cannot_write(reason(error) + "; the previous content is in " + left, backup_);
  }
  // Renaming does nothing if both names already refer to the same file.
  ::unlink(std::exchange(second_name_, {}).c_str());
  sync_folder(backup_.parent_path());
  return {};
}

Status write_file(std::span<const std::byte> bytes, const std::filesystem::path& path) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  if (Status status = file->write(bytes); !status) return status;
  return file->commit();
}

std::optional<FileStamp> FileStamp::of(const std::filesystem::path& path) {
  std::error_code failed;
  FileStamp stamp;
  stamp.time = std::filesystem::last_write_time(path, failed);
  if (!failed) stamp.bytes = std::filesystem::file_size(path, failed);
  return failed ? std::nullopt : std::optional(stamp);
}

namespace {

namespace fs = std::filesystem;

/// Returns true for "C:" and "C:/file", which are absolute on one system and plain names on the others.
bool begins_with_drive(const std::string& name) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return name.size() >= 2 && name[1] == ':' && is_letter(name[0]);
}

/// Returns true if a name without symbolic links stays in its folder.
bool stays_in_folder(const std::string& name) {
  const fs::path path = fs::path(name).lexically_normal();
  return path.is_relative() && !begins_with_drive(name) && path.begin() != path.end() && *path.begin() != "..";
}

/// Returns true if a file lies in a folder or below it once links are followed, and if it does not exist.
bool leads_into_folder(const fs::path& folder, const fs::path& file) {
  std::error_code failed;
  const fs::path whole = fs::canonical(file, failed);
  // Reading fails for the same reasons and reports them.
  if (failed) {
    return failed == std::errc::no_such_file_or_directory || failed == std::errc::not_a_directory ||
           failed == std::errc::permission_denied || failed == std::errc::too_many_symbolic_link_levels;
  }
  const fs::path top = fs::canonical(folder.empty() ? fs::path(".") : folder, failed);
  if (failed) return false;
  return std::mismatch(top.begin(), top.end(), whole.begin(), whole.end()).first == top.end();
}

}  // namespace

Result<fs::path> sidecar_path(const fs::path& from, std::string_view name, SidecarFiles allowed) {
  std::string plain(name);
  std::replace(plain.begin(), plain.end(), '\\', '/');
  if (plain.empty() || plain.find('\0') != std::string::npos) {
    return make_error(ErrorCode::BadFormat, "cannot read a sidecar file: its name is empty");
  }
  const fs::path folder = from.parent_path();
  const fs::path path = folder / plain;
  if (allowed == SidecarFiles::Anywhere) return path;
  if (stays_in_folder(plain) && leads_into_folder(folder, path)) return path;
  return make_error(ErrorCode::CannotRead,
                    "cannot read \"" + printable(std::string(name)) +
                        "\": it is outside the folder of the main file (allow it with --allow-outside-files; in "
                        "programs SidecarFiles::Anywhere)");
}

}  // namespace quoin

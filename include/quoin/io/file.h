#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/result.h>

namespace [[gnu::visibility("default")]] quoin {

/// A regular file that is open for reading. Its content is that of the file which had the name when it was opened, also
/// after another file has replaced it. Copies share the open file; the last one closes it.
/// Threads: any number may read at a time.
class InputFile {
 public:
  /// Opens a file. Errors: CannotRead, with the system's reason (a folder, no permission, not found).
  [[nodiscard]] static Result<InputFile> open(const std::filesystem::path& path);

  /// Reads the whole file. Errors: CannotRead; LimitExceeded beyond 8 GiB.
  [[nodiscard]] Result<std::vector<std::byte>> read() const;
  /// Reads up to the first `max_bytes` bytes of a file of any size. Errors: as `read`.
  [[nodiscard]] Result<std::vector<std::byte>> read_beginning(std::size_t max_bytes) const;
  /// Returns the path that was opened.
  [[nodiscard]] const std::filesystem::path& path() const;

 private:
  struct [[gnu::visibility("hidden")]] Opened;
  explicit InputFile(std::shared_ptr<const Opened> opened) : opened_(std::move(opened)) {}
  std::shared_ptr<const Opened> opened_;
};

/// Reads a whole regular file. Errors: CannotRead, with the system's reason (a folder, no permission, not found);
/// LimitExceeded beyond 8 GiB.
[[nodiscard]] Result<std::vector<std::byte>> read_file(const std::filesystem::path& path);

/// Reads up to the first `max_bytes` bytes of a regular file of any size. Errors: CannotRead, as read_file.
[[nodiscard]] Result<std::vector<std::byte>> read_file_beginning(const std::filesystem::path& path,
                                                                 std::size_t max_bytes);

/// Returns the target of a chain of symbolic links, which need not exist. Returns other paths unchanged.
[[nodiscard]] std::filesystem::path follow_links(std::filesystem::path path);
/// Returns true if both paths refer to one file, through links of any kind. The file need not exist.
[[nodiscard]] bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Writes a file atomically: bytes go to a temporary file next to `path`; `commit` syncs and renames it. Without a
/// commit, the destructor removes the temporary file and the old file stays unchanged.
class AtomicFile {
 public:
  /// Creates the temporary file. Errors: CannotWrite, with the reason: missing folder, no permission, `path` is a
  /// folder.
  [[nodiscard]] static Result<AtomicFile> create(const std::filesystem::path& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  ~AtomicFile();

  /// Appends bytes. Errors: CannotWrite (disk full), and `commit` then fails too; CannotWrite after `finish`.
  [[nodiscard]] Status write(std::span<const std::byte> bytes);
  /// Syncs and closes the temporary file, so that many files can wait for their commits without being open. Optional.
  /// Errors: CannotWrite; `commit` then fails too.
  [[nodiscard]] Status finish();
  /// Finishes the new file, if it is not finished, and replaces `path` with it. Errors: CannotWrite; the old file stays
  /// unchanged.
  [[nodiscard]] Status commit();

 private:
  AtomicFile() = default;
  void discard() noexcept;

  std::filesystem::path path_;
  std::filesystem::path temporary_;  // empty: committed, discarded or moved from
  int descriptor_ = -1;
  bool failed_ = false;
};

/// Keeps the current content of a file as a backup while a new file is written. Follows links.
///
///   auto before = FileBackup::of(path);            // does nothing if there is no file
///   if (write(path)) before->keep();               // as NAME~, replacing an older backup
///
/// Without `keep`, the destructor removes the backup and an older NAME~ stays unchanged. If NAME~ cannot or must not be
/// replaced (a folder, another user's file, Older::Kept), the backup is the first free name of NAME.~1~ to NAME.~99~.
class FileBackup {
 public:
  enum class Older : std::uint8_t { Replaced, Kept };

  /// Backs up a file. Cost: none on file systems with links; otherwise a copy with the file's permissions.
  /// Errors: CannotWrite, CannotRead; nothing changes.
  [[nodiscard]] static Result<FileBackup> of(const std::filesystem::path& path, Older older = Older::Replaced);
  /// Returns the path that `of` would back up the file as; empty if there is no file or no free name.
  [[nodiscard]] static std::filesystem::path name_for(const std::filesystem::path& path, Older older = Older::Replaced);
  FileBackup(FileBackup&& other) noexcept;
  FileBackup& operator=(FileBackup&& other) noexcept;
  ~FileBackup();

  /// Keeps the backup. Errors: CannotWrite, which names the temporary file that still holds the content.
  [[nodiscard]] Status keep();

 private:
  FileBackup() = default;
  std::filesystem::path second_name_;  // empty: nothing to keep
  std::filesystem::path backup_;
};

/// Size and modification time of a file, to detect changes; `of` returns nullopt if there is no file.
struct FileStamp {
  std::filesystem::file_time_type time{};
  std::uintmax_t bytes = 0;
  bool operator==(const FileStamp&) const = default;

  [[nodiscard]] static std::optional<FileStamp> of(const std::filesystem::path& path);
};

/// Writes `bytes` to `path` through an AtomicFile. Errors: CannotWrite.
[[nodiscard]] Status write_file(std::span<const std::byte> bytes, const std::filesystem::path& path);

/// The files that another file may name: buffers and images of glTF, materials and textures of OBJ, values of NRRD and
/// NIfTI, models of scene files, skies.
enum class SidecarFiles : std::uint8_t {
  WithinFolder,  ///< in the naming file's folder or below it; symbolic links are resolved first
  Anywhere       ///< every file that the process can read: only for input from a trusted source
};

/// Returns the path of the file that `from` refers to as `name`, relative to the folder of `from`. Backslashes also
/// separate folders. The file need not exist; reading it then reports the error.
///
/// Requires: `name` is decoded (no percent-encoding).
/// Cost:     resolves both paths in the file system.
/// Errors:   BadFormat for an empty name; CannotRead, with `name` in the message, for a file outside the folder (an
///           absolute path, a drive, `..`, a symbolic link) unless `allowed` is Anywhere.
[[nodiscard]] Result<std::filesystem::path> sidecar_path(const std::filesystem::path& from, std::string_view name,
                                                         SidecarFiles allowed = SidecarFiles::WithinFolder);

}  // namespace quoin

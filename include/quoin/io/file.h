#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/result.h>

namespace quoin {

/// The whole of a regular file. Errors: CannotRead, with the system's reason (a folder, no permission, not there);
/// LimitExceeded beyond 8 GiB.
[[nodiscard]] Result<std::vector<std::byte>> read_file(const std::filesystem::path& path);

/// The first `max_bytes` bytes of a regular file, or all that it has. Errors: as read_file, whatever the file's size.
[[nodiscard]] Result<std::vector<std::byte>> read_file_beginning(const std::filesystem::path& path,
                                                                 std::size_t max_bytes);

/// The file at the end of a chain of symbolic links; it need not be there. A path that is no link is itself.
[[nodiscard]] std::filesystem::path follow_links(std::filesystem::path path);
/// Whether both names lead to one file, by links of any kind or none; it need not be there yet.
[[nodiscard]] bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// A file that appears whole or not at all: bytes go to a temporary file beside `path`, `commit` syncs and renames it.
/// Destroyed without a commit, it leaves nothing behind and the old file as it was.
class AtomicFile {
 public:
  /// Errors: CannotWrite, with the reason: no such folder, no permission, a folder of that name.
  [[nodiscard]] static Result<AtomicFile> create(const std::filesystem::path& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  ~AtomicFile();

  /// Errors: CannotWrite (a full disk). Afterwards `commit` fails too.
  [[nodiscard]] Status write(std::span<const std::byte> bytes);
  /// Puts the file in place. Errors: CannotWrite; the old file is then as it was.
  [[nodiscard]] Status commit();

 private:
  AtomicFile() = default;
  void discard() noexcept;

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  bool failed_ = false;
};

/// What a file holds now, kept under another name while something else is put there. Links are followed.
///
///   auto before = FileBackup::of(path);            // nothing to keep where there is no file
///   if (write(path)) before->keep();               // as NAME~, in place of an older one
///
/// Destroyed without `keep`, it leaves nothing behind and an older NAME~ as it was. Where NAME~ cannot be replaced (it
/// is a folder, or somebody else's), or must not be, it is NAME.~1~ to NAME.~99~, the first that is not there.
class FileBackup {
 public:
  enum class Older : std::uint8_t { Replaced, Kept };

  /// Cost: none, where the file system has links; else a copy, with the file's permissions. Errors: CannotWrite,
  /// CannotRead: nothing was changed.
  [[nodiscard]] static Result<FileBackup> of(const std::filesystem::path& path, Older older = Older::Replaced);
  /// What `of` would keep the file as; empty where there is nothing to keep, or no name for it.
  [[nodiscard]] static std::filesystem::path name_for(const std::filesystem::path& path, Older older = Older::Replaced);
  FileBackup(FileBackup&& other) noexcept;
  FileBackup& operator=(FileBackup&& other) noexcept;
  ~FileBackup();

  /// Errors: CannotWrite; what was to be kept is then left behind under the name that the error has.
  [[nodiscard]] Status keep();

 private:
  FileBackup() = default;
  std::filesystem::path second_name_;  // empty: there is nothing to keep
  std::filesystem::path backup_;
};

/// What tells a file from a later one of the same name: nothing where there is none.
struct FileStamp {
  std::filesystem::file_time_type time{};
  std::uintmax_t bytes = 0;
  bool operator==(const FileStamp&) const = default;

  [[nodiscard]] static std::optional<FileStamp> of(const std::filesystem::path& path);
};

/// Writes all of `bytes` to `path` by way of an AtomicFile. Errors: CannotWrite.
[[nodiscard]] Status write_file(std::span<const std::byte> bytes, const std::filesystem::path& path);

}  // namespace quoin

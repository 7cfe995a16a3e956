#pragma once

#include <filesystem>

#include <quoin/core/result.h>

// A process loses its fcntl locks on a file (used by SQLite) when it closes any descriptor of that file. Therefore this
// registry tracks the files of open databases, and other readers keep their descriptors open.

namespace quoin {

/// Marks a file as opened by a database of this process, for its lifetime. Threads: any.
class HeldFile {
 public:
  /// Marks no file.
  HeldFile() = default;
  explicit HeldFile(const std::filesystem::path& file);
  HeldFile(HeldFile&& other) noexcept;
  HeldFile& operator=(HeldFile&& other) noexcept;
  ~HeldFile();

 private:
  unsigned long device_ = 0;
  unsigned long number_ = 0;
  bool holds_ = false;
};

/// Opens a file for reading. For a held file the descriptor may be an earlier one with an arbitrary offset. Returns -1
/// and sets errno if the file cannot be opened.
[[nodiscard]] int open_for_reading(const std::filesystem::path& file);
/// Closes a descriptor from `open_for_reading`, once the file is no longer held and no other reader has it.
void close_after_reading(int descriptor);

/// Syncs a folder, so that a power cut cannot undo a rename. Some file systems do not support it.
void sync_folder(const std::filesystem::path& folder);

/// Returns `result`; its error names `path` unless it already names a file.
template <class T>
[[nodiscard]] Result<T> with_path(Result<T> result, const std::filesystem::path& path) {
  if (!result && result.error().path.empty()) result.error().path = path.string();
  return result;
}

}  // namespace quoin

#pragma once

#include <filesystem>

// A process has its locks on a file (fcntl's, which SQLite takes) only as long as it closes no descriptor of that file,
// whoever opened it. So files of open databases are known here, and what else reads them keeps its descriptor open.

namespace quoin {

/// That a database of this process has a file open, from its making to its end. Threads: any.
class HeldFile {
 public:
  /// Of nothing.
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

/// Opens a file to be read; of one that is held the descriptor may have been opened before, and its offset is anywhere.
/// Returns -1, with errno, where it cannot be opened.
[[nodiscard]] int open_for_reading(const std::filesystem::path& file);
/// Closes what `open_for_reading` returned, once the file is not held any more.
void close_after_reading(int descriptor);

}  // namespace quoin

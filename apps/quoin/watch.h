#pragma once

#include <filesystem>
#include <functional>
#include <vector>

namespace quoin::tool {

/// What a piece of work came to, for `watch`.
struct WatchedWork {
  int status = 0;
  std::vector<std::filesystem::path> read;     ///< files, and folders for all that is in them
  std::vector<std::filesystem::path> written;  ///< whose changes count for nothing
};

/// Does a piece of work, and again whenever what it read has changed and rests, until the program is interrupted, which
/// ends it. Returns only where the first time was wrong usage. Files are looked at, not listened to, so that any file
/// system will do: four times a second.
[[nodiscard]] int watch(const std::function<WatchedWork()>& work);

}  // namespace quoin::tool

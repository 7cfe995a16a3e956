#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include <quoin/io/file.h>

namespace quoin::tool {

/// What a piece of work came to. Of files `watch` alone needs to know.
struct WatchedWork {
  int status = 0;
  std::vector<std::filesystem::path> read;     ///< files, and folders for all that is in them
  std::vector<std::filesystem::path> written;  ///< whose changes count for nothing
};

/// What files are, by their names; of folders all that is in them.
using Stamps = std::map<std::filesystem::path, std::optional<FileStamp>>;
[[nodiscard]] Stamps stamps_of(const std::vector<std::filesystem::path>& paths);

/// A file, and all that is read beside it, as far as can be known before.
[[nodiscard]] std::vector<std::filesystem::path> files_read(const std::filesystem::path& input, SidecarFiles allowed);

/// Does a piece of work, and again whenever what it read has changed and rests, until the program is interrupted, which
/// ends it. `read`: what it will read, as far as is known. Returns only where the first time was wrong usage. Files are
/// looked at, not listened to, so that any file system will do: four times a second.
[[nodiscard]] int watch(const std::vector<std::filesystem::path>& read, const std::function<WatchedWork()>& work);

}  // namespace quoin::tool

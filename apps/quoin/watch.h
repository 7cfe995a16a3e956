#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include <quoin/io/file.h>

namespace quoin::tool {

/// The result of one run of watched work. Only `watch` uses the files.
struct WatchedWork {
  int status = 0;
  std::vector<std::filesystem::path> read;     ///< files, and folders with all their files
  std::vector<std::filesystem::path> written;  ///< changes to these files are ignored
};

/// File stamps by path; folders include all files in them.
using Stamps = std::map<std::filesystem::path, std::optional<FileStamp>>;
[[nodiscard]] Stamps stamps_of(const std::vector<std::filesystem::path>& paths);

/// Returns a file and its sidecar files, as far as they are known before reading.
[[nodiscard]] std::vector<std::filesystem::path> files_read(const std::filesystem::path& input, SidecarFiles allowed);

/// Runs `work`, and again each time its input files have changed and are stable, until an interrupt ends the program.
/// `read`: the files it will read, as far as known. Returns only if the first run fails with wrong usage. Polls the
/// files four times per second, which works on any file system.
[[nodiscard]] int watch(const std::vector<std::filesystem::path>& read, const std::function<WatchedWork()>& work);

}  // namespace quoin::tool

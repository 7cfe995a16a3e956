#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/io/file.h>

#include "core/bytes/files.h"

// Adapts readers and writers of bytes to files; lists the sidecar files of a file.

namespace quoin {

struct DetectedFile;

/// Returns the result of `read(bytes)` on a file. Errors: also CannotRead; they name the file.
template <class Read>
[[nodiscard]] auto read_whole(const InputFile& file, Read read)
    -> std::invoke_result_t<Read, std::span<const std::byte>> {
  const auto bytes = file.read();
  if (!bytes) return bytes.error();
  return with_path(read(std::span<const std::byte>(*bytes)), file.path());
}
template <class Read>
[[nodiscard]] auto read_whole(const std::filesystem::path& path, Read read)
    -> std::invoke_result_t<Read, std::span<const std::byte>> {
  const auto file = InputFile::open(path);
  if (!file) return file.error();
  return read_whole(*file, std::move(read));
}

/// Writes bytes to a file atomically; returns its size. Errors: also CannotWrite; they name the file.
[[nodiscard]] inline Result<std::uint64_t> write_whole(const std::filesystem::path& path,
                                                       Result<std::vector<std::byte>> bytes) {
  if (!bytes) return with_path(Result<std::uint64_t>(bytes.error()), path);
  if (auto done = write_file(*bytes, path); !done) return with_path(Result<std::uint64_t>(done.error()), path);
  return bytes->size();
}

/// Returns the files that a scene file refers to, without those that sidecar_path refuses; empty if it cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> files_named_in_scene(const DetectedFile& file, SidecarFiles allowed);

/// Returns the data file of a NIfTI or NRRD pair with the header `file`; empty if it is no pair or is refused.
[[nodiscard]] std::vector<std::filesystem::path> files_of_pair(const DetectedFile& file, SidecarFiles allowed);

}  // namespace quoin

#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/result.h>

namespace quoin::tool {

/// Fails if one of the files cannot be written, before the work starts. Ignores empty names.
[[nodiscard]] Status check_outputs(const std::vector<std::filesystem::path>& files);

/// A set of files, identified by device and inode, not by name.
class FileSet {
 public:
  FileSet() = default;
  /// Adds the named files that exist.
  explicit FileSet(std::span<const std::filesystem::path> names);
  [[nodiscard]] bool contains(const std::filesystem::path& name) const;

 private:
  std::set<std::pair<std::uint64_t, std::uint64_t>> files_;  // device and inode
};

/// Creates the folder of a file and its parents. Errors: CannotWrite.
[[nodiscard]] Status make_folder_of(const std::filesystem::path& file);

/// Fails if `output` is one of `inputs`, or, unless `force`, an existing model, world or volume. Meshes, images and
/// files in unknown formats may be overwritten.
[[nodiscard]] Status check_replaced(const std::filesystem::path& output, const FileSet& inputs, bool force);

}  // namespace quoin::tool

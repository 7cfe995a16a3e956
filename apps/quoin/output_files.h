#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/result.h>

namespace quoin::tool {

/// Fails now rather than after all the work where one of the files cannot be written. Empty names are left out.
[[nodiscard]] Status check_outputs(const std::vector<std::filesystem::path>& files);

/// Files, by what they are rather than by their names.
class FileSet {
 public:
  FileSet() = default;
  /// Those of the names that there are.
  explicit FileSet(std::span<const std::filesystem::path> names);
  [[nodiscard]] bool contains(const std::filesystem::path& name) const;

 private:
  std::set<std::pair<std::uint64_t, std::uint64_t>> files_;  // device and number
};

/// Makes the folder that a file is to lie in. Errors: CannotWrite.
[[nodiscard]] Status make_folder_of(const std::filesystem::path& file);

/// Refuses to lose what a person made: to replace one of `inputs`, and, unless `force`, a file that can be read as a
/// model, a world or a volume. Meshes, pictures and what is no format of ours are replaced.
[[nodiscard]] Status check_replaced(const std::filesystem::path& output, const FileSet& inputs, bool force);

}  // namespace quoin::tool

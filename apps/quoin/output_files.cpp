#include "output_files.h"

#include <sys/stat.h>

#include <optional>
#include <string>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

namespace quoin::tool {

Status check_outputs(const std::vector<std::filesystem::path>& files) {
  for (const auto& path : files) {
    if (path.empty()) continue;
    if (auto file = AtomicFile::create(path); !file) return file.error();
  }
  return {};
}

namespace {

std::optional<std::pair<std::uint64_t, std::uint64_t>> identity_of(const std::filesystem::path& name) {
  struct stat found {};
  if (::stat(name.c_str(), &found) != 0) return std::nullopt;
  return std::pair{static_cast<std::uint64_t>(found.st_dev), static_cast<std::uint64_t>(found.st_ino)};
}

}  // namespace

FileSet::FileSet(std::span<const std::filesystem::path> names) {
  for (const auto& name : names) {
    if (const auto file = identity_of(name)) files_.insert(*file);
  }
}

bool FileSet::contains(const std::filesystem::path& name) const {
  const auto file = identity_of(name);
  return file && files_.contains(*file);
}

Status make_folder_of(const std::filesystem::path& file) {
  if (!file.has_parent_path()) return {};
  std::error_code code;
  std::filesystem::create_directories(file.parent_path(), code);
  if (!code) return {};
  return make_error(ErrorCode::CannotWrite, code.message(), file.parent_path().string());
}

Status check_replaced(const std::filesystem::path& output, const FileSet& inputs, bool force) {
  if (inputs.contains(output)) {
    return make_error(ErrorCode::InvalidArgument,
                      "cannot write " + output.string() + ": it is an input file; choose another name");
  }
  std::error_code unknown;
  if (force || !std::filesystem::is_regular_file(output, unknown)) return {};
  const auto format = detect_format(output);
  // A file that cannot be read may be a model.
  if (!format) {
    return make_error(ErrorCode::CannotWrite, "cannot write " + output.string() +
                                                  ": the file exists and cannot be read; use --force to overwrite it");
  }
  // Meshes are results that can be made again, so they are overwritten even if they are readable.
  if (!*format || can(*format, FormatCapability::Meshes)) return {};
  return make_error(ErrorCode::InvalidArgument,
                    "cannot write " + output.string() + ": the file exists; use --force to overwrite it");
}

}  // namespace quoin::tool

#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/io/formats.h>

namespace quoin::tool {

/// The input of a command, opened and recognised once. `file` stays open, except for worlds and folders.
struct OpenedInput {
  DetectedFile file;
  bool is_volume = false;  ///< by --raw-size or by its content

  /// Returns true if --iso applies: to a volume, or to a .vdb, which may have fog grids.
  [[nodiscard]] bool heeds_iso() const { return is_volume || file.format == FileFormat::Vdb; }
};

/// Recognises the input. Errors: CannotRead; InvalidArgument if --dimension was given and the file has no dimensions.
[[nodiscard]] Result<OpenedInput> open_input(const std::filesystem::path& path, const LoadOptions& load);

/// The file name that stands for standard input or output.
inline constexpr const char* kStandardStream = "-";

/// Makes standard input and output available as files in a temporary folder, which the destructor removes.
class StandardStreams {
 public:
  StandardStreams() = default;
  StandardStreams(const StandardStreams&) = delete;
  StandardStreams& operator=(const StandardStreams&) = delete;
  ~StandardStreams();

  /// Copies standard input to a file. Returns its name. Errors: CannotRead, CannotWrite.
  [[nodiscard]] Result<std::filesystem::path> input();
  /// If `name` is "-", calls catch_interrupts() and replaces `name` by that of input(). Errors: those of input().
  [[nodiscard]] Status take_input(std::filesystem::path& name);
  /// Returns the name of a file with this extension, for `write_output`. Errors: CannotWrite.
  [[nodiscard]] Result<std::filesystem::path> output(const std::string& extension);
  /// Copies the file of output() to standard output. Errors: CannotRead, CannotWrite.
  [[nodiscard]] Status write_output() const;
  /// Returns the display name of a file, without its folder.
  [[nodiscard]] std::string name_of(const std::filesystem::path& path) const;
  /// Replaces the names of the temporary files in an error by "standard input" and "standard output".
  [[nodiscard]] Error named(Error error) const;
  /// Removes the temporary folder.
  void remove();

 private:
  [[nodiscard]] Status make_folder();

  std::filesystem::path folder_;
  std::filesystem::path input_;
  std::filesystem::path output_;
};

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

#pragma once

#include <filesystem>
#include <string>

#include <quoin/core/result.h>

namespace quoin::tool {

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

}  // namespace quoin::tool

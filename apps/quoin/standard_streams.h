#pragma once

#include <filesystem>
#include <string>

#include <quoin/core/result.h>

namespace quoin::tool {

/// What stands for standard input and output among the names of files.
inline constexpr const char* kStandardStream = "-";

/// Standard input and output as files, for what reads and writes files: in a folder of their own that goes with this.
class StandardStreams {
 public:
  StandardStreams() = default;
  StandardStreams(const StandardStreams&) = delete;
  StandardStreams& operator=(const StandardStreams&) = delete;
  ~StandardStreams();

  /// Reads standard input to its end; the name of the file that has it. Errors: CannotRead, CannotWrite.
  [[nodiscard]] Result<std::filesystem::path> input();
  /// Where the name is "-", does so and gives it the file's; from then on interrupts are heard of. Errors: those.
  [[nodiscard]] Status take_input(std::filesystem::path& name);
  /// The name of a file with this ending, for `write_output`. Errors: CannotWrite.
  [[nodiscard]] Result<std::filesystem::path> output(const std::string& extension);
  /// Copies that file to standard output. Errors: CannotRead, CannotWrite.
  [[nodiscard]] Status write_output() const;
  /// A file's name for people, without its folder.
  [[nodiscard]] std::string name_of(const std::filesystem::path& path) const;
  /// The error in words of the streams, instead of the files' names.
  [[nodiscard]] Error named(Error error) const;
  /// Removes the folder.
  void remove();

 private:
  [[nodiscard]] Status make_folder();

  std::filesystem::path folder_;
  std::filesystem::path input_;
  std::filesystem::path output_;
};

}  // namespace quoin::tool

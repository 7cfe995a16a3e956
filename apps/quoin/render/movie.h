#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include <quoin/core/result.h>

namespace quoin::tool {

/// Whether a name is that of a film in one file: .mp4 or .webm.
[[nodiscard]] bool is_movie(const std::filesystem::path& path);

/// A film in one file, which the program ffmpeg makes of numbered pictures. These lie in a folder beside it until it is
/// done, so that one that was interrupted can be gone on with.
class Movie {
 public:
  explicit Movie(std::filesystem::path output) : output_(std::move(output)) {}

  /// The folder of the pictures, and OUT.png in it, of which their numbered names are made.
  [[nodiscard]] std::filesystem::path folder() const;
  [[nodiscard]] std::filesystem::path picture() const;

  /// Makes the folder; unless `resume` an empty one. Errors: Unsupported where there is no ffmpeg; CannotWrite.
  [[nodiscard]] Status begin(bool resume) const;
  /// Makes the film, which appears whole or not at all, and removes the pictures. Returns its size.
  /// `pictures`: numbered one after the other. Errors: CannotWrite, with the exit status of ffmpeg, which says the rest.
  [[nodiscard]] Result<std::uint64_t> write(const std::vector<std::filesystem::path>& pictures,
                                            double frames_per_second) const;

 private:
  std::filesystem::path output_;
};

}  // namespace quoin::tool

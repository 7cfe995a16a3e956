#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/progress.h>
#include <quoin/core/vec.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/mesh_file.h>

// Files of triangles. docs/formats/meshes.md lists the supported content of each.
//
// Recognition is by content: `is_...` take the beginning of a file (64 KiB suffice), or the whole file for binary STL,
// identified by its length only.

namespace quoin {
struct FormatDriver;
}

namespace quoin::triangles {

inline constexpr std::size_t kMostTriangles = std::size_t{1} << 27;

/// Sidecar files that a file refers to. Bytes without a path have none.
class SidecarReader {
 public:
  SidecarReader() = default;
  SidecarReader(std::filesystem::path file, SidecarFiles allowed) : file_(std::move(file)), allowed_(allowed) {}

  /// Reads a file that sidecar_path allows. Errors: CannotRead; the caller adds `name`. A refusal includes the name,
  /// and is also stored in `refused`.
  [[nodiscard]] Result<std::vector<std::byte>> read(const std::string& name);
  /// Reads a file or, if `name` leads out of the folder, the file of the same name in the folder. Errors: as `read`.
  [[nodiscard]] Result<std::vector<std::byte>> read_or_same_name(const std::string& name);
  /// The first refusal of `read`.
  [[nodiscard]] const std::optional<Error>& refused() const { return refused_; }
  /// The files that were read.
  [[nodiscard]] std::vector<std::filesystem::path>& files() { return files_; }

 private:
  [[nodiscard]] Result<std::vector<std::byte>> read_path(const std::filesystem::path& path);

  std::filesystem::path file_;  // empty if there is none
  SidecarFiles allowed_ = SidecarFiles::WithinFolder;
  std::vector<std::filesystem::path> files_;
  std::optional<Error> refused_;
};

/// Appends connected data to a mesh, and counts dropped items.
class MeshBuilder {
 public:
  explicit MeshBuilder(LoadedMesh& loaded) : loaded_(loaded) {}
  /// Adds a triangle. Returns false and adds no triangle if a position is missing or not finite.
  /// Errors: LimitExceeded.
  [[nodiscard]] Result<bool> add(std::size_t a, std::size_t b, std::size_t c);
  /// Adds the triangles of a polygon, cut by cut_polygon. `added` receives the corners of each added triangle as
  /// indices into `corners`. Errors: LimitExceeded.
  [[nodiscard]] Status add_polygon(std::span<const std::size_t> corners,
                                   FunctionRef<void(const std::array<std::uint32_t, 3>&)> added);
  /// Adds warnings for dropped items. Call at the end.
  void finish();

 private:
  LoadedMesh& loaded_;
  std::size_t not_finite_ = 0;
  std::size_t not_there_ = 0;
  std::size_t too_large_ = 0;
  std::vector<DVec3> polygon_;
  std::vector<std::array<std::uint32_t, 3>> cut_;
};

/// Returns true for the occlusion greys that Quoin writes at the corners of blocks: quarters, exact or as bytes.
[[nodiscard]] bool is_occlusion_grey(double linear);

/// Adds an image as a texture; returns nullopt, with a warning, if it cannot be decoded.
[[nodiscard]] std::optional<std::size_t> add_texture(std::span<const std::byte> image, const std::string& name,
                                                     LoadedMesh& loaded);

/// Reads triangles of a known format, and converts them to Quoin's axes. `up`: default: the format's.
/// Requires: driver.read_mesh.
[[nodiscard]] Result<LoadedMesh> read_with(const FormatDriver& driver, std::span<const std::byte> bytes,
                                           SidecarReader& sidecars, std::optional<UpAxis> up);

/// Converts a mesh to a scene with one grid. `name`: the grid's name.
[[nodiscard]] Result<LoadedScene> scene_from_mesh(LoadedMesh loaded, const MeshLoadOptions& options,
                                                  const std::string& name, Threads threads, const Progress& progress);

/// Larger polygons that are not convex are cut as if they were convex.
inline constexpr std::size_t kMostCornersOfConcave = std::size_t{1} << 14;

/// Cuts a polygon into `corners.size() - 2` triangles of its corners with the same orientation.
///
/// Convex polygons become a fan from corner 0. Others are cut ear by ear: concave polygons, and polygons whose hole is
/// connected to the outline by an edge (a keyhole). Corners may coincide or be collinear; such triangles have no area.
/// The triangles of polygons that cross themselves, or are not flat, still use each edge once.
/// Requires: finite corners. Cost: O(n) for a convex polygon, else about O(n^2).
/// Returns false if the polygon was too large and was cut as a fan.
/// Source: G. Meisters, "Polygons have ears" (1975).
bool cut_polygon(std::span<const DVec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Parses a decimal number, "nan" or "inf" that is the whole word.
[[nodiscard]] inline std::optional<double> number_in(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || word.empty()) return std::nullopt;
  // Too large or too small numbers are not finite.
  if (error == std::errc::result_out_of_range) return value;
  return error == std::errc() ? std::optional(value) : std::nullopt;
}

/// Reads the words of a text, separated by blanks and line ends. Lifetime: the text.
class Words {
 public:
  explicit Words(std::string_view text, std::size_t position = 0) : text_(text), at_(position) {
    QUOIN_ASSERT(position <= text.size(), "a position within the text");
  }

  [[nodiscard]] std::optional<std::string_view> next() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
    const std::size_t first = at_;
    while (at_ < text_.size() && !is_blank(text_[at_])) ++at_;
    if (first == at_) return std::nullopt;
    return text_.substr(first, at_ - first);
  }
  [[nodiscard]] std::optional<double> next_number() {
    const auto word = next();
    return word ? number_in(*word) : std::nullopt;
  }
  /// Returns the position where the search for the next word starts.
  [[nodiscard]] std::size_t position() const { return at_; }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

  std::string_view text_;
  std::size_t at_;
};

}  // namespace quoin::triangles

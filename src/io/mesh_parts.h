#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/mesh_file.h>
#include <quoin/scene/scene_meshes.h>

namespace quoin {

/// Makes the names of a file unique.
class UniqueNames {
 public:
  /// Returns the name; if it was returned before, with `separator` and the first free number from 2 on after it.
  /// Cost: O(log names), averaged over all calls with one separator.
  [[nodiscard]] std::string add(const std::string& name, std::string_view separator);

 private:
  std::map<std::string, std::uint32_t> next_number_;  // by returned name: all lower numbers are taken
};

/// Collects small values in blocks of 1 MiB on their way to a file or to memory. After an error it ignores further
/// writes; `finish` returns the error.
class BlockWriter {
 public:
  using Sink = std::function<Status(std::span<const std::byte>)>;

  /// `expected_bytes`: the total that progress is relative to; 0 when unknown.
  BlockWriter(Sink sink, const Progress& progress, std::uint64_t expected_bytes)
      : sink_(std::move(sink)), progress_(progress), expected_bytes_(expected_bytes) {
    block_.resize(kBlockBytes);
  }

  /// Writes the value's bytes as they are in memory.
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= kBlockBytes);
    QUOIN_ASSERT(used_ <= kBlockBytes, "a position within the block");
    if (used_ + sizeof(T) > kBlockBytes) flush();
    std::memcpy(block_.data() + used_, &value, sizeof(T));
    used_ += sizeof(T);
  }

  void put(std::span<const std::byte> bytes);
  /// Reserves space for up to `most` bytes of text; `advance` sets the end of the written part.
  [[nodiscard]] char* room(std::size_t most) {
    QUOIN_ASSERT(most <= kBlockBytes, "text that fits a block");
    if (used_ + most > kBlockBytes) flush();
    return reinterpret_cast<char*>(block_.data() + used_);
  }
  void advance(const char* end) {
    const auto used = static_cast<std::size_t>(reinterpret_cast<const std::byte*>(end) - block_.data());
    QUOIN_ASSERT(used >= used_ && used <= kBlockBytes, "text within its room");
    used_ = used;
  }
  void put_text(std::string_view text) { put(std::as_bytes(std::span(text))); }
  /// Ends with an error of the caller, unless there was one before.
  void fail(Error error) {
    if (status_) status_ = std::move(error);
  }
  /// Pads to a multiple of four bytes since the start.
  void align(char filler);

  /// Returns true if further writes are ignored; lets long loops end early.
  [[nodiscard]] bool failed() const { return !status_.has_value(); }
  [[nodiscard]] std::uint64_t bytes() const { return written_ + used_; }
  /// Errors: the first error of the sink or of `fail`; Cancelled.
  [[nodiscard]] Status finish();

 private:
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 20;

  void flush();

  Sink sink_;
  const Progress& progress_;
  std::uint64_t expected_bytes_;
  std::vector<std::byte> block_;
  std::size_t used_ = 0;
  std::uint64_t written_ = 0;
  Status status_;
};

/// One of the files of a mesh. All are written before the first one is put in place, in order.
struct MeshFile {
  std::filesystem::path path;
  std::uint64_t expected_bytes = 0;  ///< the total for progress; 0: too small to report
  std::function<void(BlockWriter&)> write;
};

/// Checks all parts and placements. Errors: InvalidArgument, with the first invalid part (see mesh_file.h).
[[nodiscard]] Status check_meshes(const SceneMeshes& meshes);

/// Returns true if any surface has light at its vertices; in valid meshes all surfaces then have it.
[[nodiscard]] bool has_light(const SceneMeshes& meshes);

/// Returns the box of all vertices; empty without vertices.
[[nodiscard]] DBox bounds_of(const MeshView& view);

/// Returns the point that positions of all placements are relative to in a file with floats in world units: 0, unless
/// vertices lie more than `most_steps` steps from the origin.
[[nodiscard]] DVec3 file_origin(const SceneMeshes& meshes, double most_steps);

/// The placements by part, in order within a part.
[[nodiscard]] std::vector<const MeshPlacement*> placements_by_part(const SceneMeshes& meshes);

/// Returns a placement's name, or its part's if it has none.
[[nodiscard]] const std::string& name_of(const SceneMeshes& meshes, const MeshPlacement& placement);

/// Transforms vertices for one placement, or for a mesh that a file shares. Requires: the linear part is not singular.
class VertexTransform {
 public:
  VertexTransform(const glm::dmat4& world_from_part, DVec3 pivot);

  [[nodiscard]] DVec3 position(Vec3 in_part) const { return linear_ * (DVec3(in_part) - pivot_) + translation_; }
  /// Returns the unit normal.
  [[nodiscard]] DVec3 normal(Vec3 in_part) const;
  /// Returns the normals of a block's six faces, by Direction.
  [[nodiscard]] std::array<Vec3, 6> face_normals() const;
  /// Returns the inverse, which maps positions back to those of the part.
  [[nodiscard]] glm::dmat4 part_from_position() const;
  /// Returns true if axis-aligned boxes stay axis-aligned, with each axis mapped to itself.
  [[nodiscard]] bool keeps_axes() const {
    return linear_ == glm::dmat3(linear_[0].x, 0, 0, 0, linear_[1].y, 0, 0, 0, linear_[2].z);
  }
  /// Returns true if triangles must be reversed.
  [[nodiscard]] bool mirrors() const { return mirrors_; }
  /// Returns the length of the shortest axis after the transform.
  [[nodiscard]] double least_step() const;
  /// Returns the transform with positions relative to `origin`.
  [[nodiscard]] VertexTransform relative_to(const DVec3& origin) const;

 private:
  glm::dmat3 linear_;
  glm::dmat3 normal_matrix_;  ///< cofactor matrix: the inverse transpose except for scale and, if mirrored, sign
  DVec3 translation_;
  DVec3 pivot_;
  bool mirrors_;
};

/// Returns the transformed bounds of a part's vertices; empty without vertices.
[[nodiscard]] DBox bounds_of(const MeshPart& part, const VertexTransform& transform);

/// Returns the point that stored positions are relative to: 0, or the centre of `bounds` in whole coordinates if the
/// bounds exceed `most` along an axis.
[[nodiscard]] DVec3 float_origin(const DBox& bounds, double most);

/// Returns the corners of the triangle whose indices begin at `i`, in the order of writing.
[[nodiscard]] inline std::array<std::uint32_t, 3> corners_of(const MeshView& view, std::size_t i, bool turned) {
  QUOIN_ASSERT(i + 2 < view.indices.size(), "a triangle of the surface");
  const std::uint32_t* at = view.indices.data() + i;
  return {at[0], at[turned ? 2 : 1], at[turned ? 1 : 2]};
}

/// Returns the ambient light left by occlusion at a vertex: 1 open to 0 dark; 1 without occlusion.
[[nodiscard]] float openness_at(const MeshView& view, std::size_t vertex);

/// Returns the mesh without occlusion, and therefore without an atlas.
[[nodiscard]] MeshView without_occlusion(const MeshView& view);

/// Returns true if surfaces of a class show the background.
[[nodiscard]] inline bool is_transparent(SurfaceClass surface) {
  return surface == SurfaceClass::Transparent || surface == SurfaceClass::EmissiveTransparent;
}

/// Returns the colour of a smooth mesh's vertex, darkened by its occlusion and multiplied by its light, if present:
/// linear light, alpha below 1 only for transparent surfaces; from sRGB.
[[nodiscard]] LinearRgba16 linear_colour(const MeshView& view, std::size_t vertex);
[[nodiscard]] std::array<std::uint8_t, 3> srgb_colour(const MeshView& view, std::size_t vertex);

}  // namespace quoin

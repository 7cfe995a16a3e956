#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <span>
#include <string>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/smooth_files.h>

namespace quoin {

/// Errors: InvalidArgument, naming the first part whose mesh or placement is unsound (see smooth_files.h).
[[nodiscard]] Status check_parts(std::span<const SmoothPart> parts);

/// What is wrong with where a mesh of these bounds, without a vertex where they are empty, is placed; null when nothing
/// is. Requires: finite bounds and pivot.
[[nodiscard]] const char* fault_of_places(const DBox& bounds, const DVec3& pivot,
                                          std::span<const SmoothPlacement> placements);

/// The error that says so.
[[nodiscard]] Status unsound_part(const std::string& name, const char* fault);

/// What `write()` answers, once the parts are found sound; every error names the file.
template <class Write>
[[nodiscard]] Result<std::uint64_t> write_sound_parts(std::span<const SmoothPart> parts,
                                                      const std::filesystem::path& path, Write write) {
  const Status sound = check_parts(parts);
  Result<std::uint64_t> bytes = sound ? write() : Result<std::uint64_t>(tl::unexpected<Error>(sound.error()));
  if (!bytes && bytes.error().path.empty()) bytes.error().path = path.string();
  return bytes;
}

/// Whether anything of the part is drawn.
[[nodiscard]] inline bool is_drawn(const SmoothPart& part) {
  return !part.mesh.indices.empty() && !part.placements.empty();
}

/// Vertices as one placement, or one shared mesh of a file, has them. Requires: the linear part is not singular.
class VertexTransform {
 public:
  VertexTransform(const glm::dmat4& world_from_mesh, DVec3 pivot);

  [[nodiscard]] DVec3 position(Vec3 in_mesh) const { return linear_ * (DVec3(in_mesh) - pivot_) + translation_; }
  /// Unit.
  [[nodiscard]] DVec3 normal(Vec3 in_mesh) const;
  /// Whether triangles are to be turned round.
  [[nodiscard]] bool mirrors() const { return mirrors_; }

 private:
  glm::dmat3 linear_;
  glm::dmat3 normal_matrix_;  ///< the cofactors: as the inverse transpose, but for size and, when mirrored, sign
  DVec3 translation_;
  DVec3 pivot_;
  bool mirrors_;
};

/// The corners of triangle `i` in the order in which they are written.
[[nodiscard]] inline std::array<std::uint32_t, 3> corners_of(const SmoothMesh& mesh, std::size_t i, bool turned) {
  const std::uint32_t* at = mesh.indices.data() + 3 * i;
  return {at[0], at[turned ? 2 : 1], at[turned ? 1 : 2]};
}

/// The share of its light that a vertex shows: openness, unless it is left out or the mesh has none.
[[nodiscard]] inline float openness_of(const SmoothMesh& mesh, std::size_t vertex, bool occlusion) {
  return occlusion && !mesh.openness.empty() ? mesh.openness[vertex] : 1.0F;
}

/// Linear light, opaque.
[[nodiscard]] LinearRgba16 linear_colour(const SmoothMesh& mesh, std::size_t vertex, bool occlusion);
[[nodiscard]] std::array<std::uint8_t, 3> srgb_colour(const SmoothMesh& mesh, std::size_t vertex, bool occlusion);

}  // namespace quoin

#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// One place of a mesh in the world.
struct SmoothPlacement {
  std::string name;  ///< empty: that of the part
  /// Takes points of the mesh, relative to the part's pivot, to the world. Affine; a negative determinant mirrors.
  glm::dmat4 world_from_mesh{1.0};
};

/// A mesh and all its places in the world.
struct SmoothPart {
  std::string name;
  SmoothMesh mesh;
  DVec3 pivot{0.0};  ///< the mesh's point that placements take to their translation
  std::vector<SmoothPlacement> placements;
};

struct SmoothFileOptions {
  bool occlusion = true;  ///< the openness of vertices, where a mesh has it, is multiplied into their colours
};

// What the writers below have in common:
//
// Left out: parts without a triangle or a placement.
// Mirrored: placements of negative determinant have their triangles turned round, so that outside stays outside.
// Answers:  the size of all that was written.
// Order:    the same bytes on every run.
// Errors:   CannotWrite; Cancelled; InvalidArgument when a transform is not finite, not affine or singular, when a
//           vertex comes to lie beyond the range of floats, or when a mesh contradicts itself (arrays of different
//           lengths, indices of no vertex, numbers that are not finite). No file is left or replaced then.

/// Writes smooth meshes as one binary glTF 2.0 file.
///
/// Space:    glTF's axes are Quoin's; its unit is the metre. A node per placement, with translation, rotation and
///           scale; placements share the part's mesh, mirrored ones a second, reflected mesh, and those that shear one
///           that is sheared, since glTF's nodes cannot.
/// Colours:  COLOR_0, 16 bits a channel, in linear light: albedo times openness. One rough material, opaque.
/// Errors:   also LimitExceeded beyond glTF's 4 GiB a file.
/// Source:   Khronos glTF 2.0 specification, sections 3.6, 3.7 and 4.4.
[[nodiscard]] Result<std::uint64_t> write_smooth_glb(std::span<const SmoothPart> parts,
                                                     const std::filesystem::path& path,
                                                     const SmoothFileOptions& options = {},
                                                     const Progress& progress = {});

/// The same content as JSON in `path` and, when anything is drawn, a buffer of the same name ending in ".bin".
[[nodiscard]] Result<std::uint64_t> write_smooth_gltf(std::span<const SmoothPart> parts,
                                                      const std::filesystem::path& path,
                                                      const SmoothFileOptions& options = {},
                                                      const Progress& progress = {});

/// Writes smooth meshes as a binary, little-endian PLY 1.0 file: x y z and nx ny nz as floats, red green blue as bytes,
/// triangles as lists of int.
///
/// Space:    world units, baked: PLY knows neither transforms nor sharing.
/// Colours:  sRGB; occlusion is multiplied in linear light.
/// Errors:   also LimitExceeded beyond 2^31 - 1 vertices or triangles.
[[nodiscard]] Result<std::uint64_t> write_ply(std::span<const SmoothPart> parts, const std::filesystem::path& path,
                                              const SmoothFileOptions& options = {}, const Progress& progress = {});

/// Writes smooth meshes as Wavefront OBJ without materials: an object a placement, in world units with nine digits,
/// sRGB colours from 0 to 1 after the coordinates of a vertex, an extension that many programs read.
[[nodiscard]] Result<std::uint64_t> write_smooth_obj(std::span<const SmoothPart> parts,
                                                     const std::filesystem::path& path,
                                                     const SmoothFileOptions& options = {},
                                                     const Progress& progress = {});

/// The files that write_smooth_gltf writes or replaces, `path` first.
[[nodiscard]] std::vector<std::filesystem::path> smooth_gltf_files(std::span<const SmoothPart> parts,
                                                                   const std::filesystem::path& path);

}  // namespace quoin

#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <quoin/mesh/blocky_mesh.h>

#include "io/material_palette.h"

namespace quoin {

/// Triangles of a mesh that are drawn with one material.
struct SurfacePart {
  const BlockyTriangles* triangles = nullptr;
  std::size_t material = 0;
};

/// A mesh's surfaces, one part a material. Surfaces that need one material only are borrowed, not copied.
///
/// Requires: the mesh outlives this.
class SurfaceParts {
 public:
  SurfaceParts(const BlockyMesh& mesh, const MaterialPalette& palette);

  [[nodiscard]] const std::vector<SurfacePart>& parts() const { return parts_; }

 private:
  void add_surface(const BlockyTriangles& surface, SurfaceClass surface_class, const MaterialPalette& palette);

  std::vector<SurfacePart> parts_;
  std::vector<std::unique_ptr<BlockyTriangles>> owned_;
};

/// Grey of a vertex's occlusion level, linear: 255, 191, 128, 64.
[[nodiscard]] constexpr std::uint8_t occlusion_grey(std::uint8_t level) {
  return static_cast<std::uint8_t>((255 * (4 - level) + 2) / 4);
}

}  // namespace quoin

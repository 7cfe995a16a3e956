#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/vec4.hpp>

#include <quoin/grid/voxel_registry.h>

#include "voxelize/frame.h"

namespace quoin::voxelizing {

/// What colours a mesh has at its points.
class SurfaceColours {
 public:
  /// Lifetime: the frame must outlive it.
  explicit SurfaceColours(const Frame& frame);

  /// Whether all of the surface looks the same, and nothing is cut out.
  [[nodiscard]] bool is_plain() const { return is_plain_; }
  [[nodiscard]] bool may_have_holes(std::uint32_t triangle) const {
    return material_of(triangle).alpha_mode != AlphaMode::Opaque;
  }
  /// Whether there is a surface at a point of a triangle, given by shares of its corners.
  [[nodiscard]] bool has_surface(std::uint32_t triangle, DVec3 shares) const;
  [[nodiscard]] Rgba8 colour(std::uint32_t triangle, DVec3 shares) const;
  [[nodiscard]] std::uint32_t material_index(std::uint32_t triangle) const {
    const auto& of = frame_->mesh().material_of;
    return of.empty() ? 0 : of[triangle];
  }
  /// The material that all triangles are of; nothing where there are several.
  [[nodiscard]] std::optional<std::uint32_t> only_material() const;
  /// The mean colour, by area, of what lies at the triangles' middles; with its alpha where one material alone blends.
  [[nodiscard]] Rgba8 mean() const { return mean_; }
  /// What types have of the materials besides their colour.
  [[nodiscard]] const std::vector<VoxelProperties>& materials() const { return properties_; }

 private:
  /// A texture's picture and its halves down to one pixel.
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<std::uint16_t> pixels;  // linear light times alpha, and alpha, of 65,535; of the first level none
  };
  struct Pictures {
    std::vector<Level> levels;
  };

  [[nodiscard]] const MeshMaterial& material_of(std::uint32_t triangle) const {
    return materials_[material_index(triangle)];
  }
  /// Linear light and alpha.
  [[nodiscard]] glm::vec4 light(std::uint32_t triangle, DVec3 shares) const;
  [[nodiscard]] glm::vec4 texel(std::size_t texture, std::size_t level, int x, int y) const;
  [[nodiscard]] glm::vec4 sample(std::size_t texture, std::size_t level, DVec3 place) const;
  [[nodiscard]] std::size_t level_of(std::uint32_t triangle, std::size_t texture) const;
  void make_halves(std::size_t texture);
  void find_mean();

  const Frame* frame_;
  std::vector<MeshMaterial> materials_;
  std::vector<VoxelProperties> properties_;
  std::vector<Pictures> pictures_;
  Rgba8 mean_;
  bool is_plain_ = false;
};

}  // namespace quoin::voxelizing

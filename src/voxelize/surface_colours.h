#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/vec4.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/voxel_registry.h>

#include "voxelize/voxel_frame.h"

namespace quoin::voxelizing {

/// The colours of a mesh at its surface points.
class SurfaceColours {
 public:
  /// Lifetime: the frame must outlive it.
  explicit SurfaceColours(const Frame& frame);

  /// Returns true if the whole surface has one colour and no cut-outs.
  [[nodiscard]] bool is_plain() const { return is_plain_; }
  [[nodiscard]] bool may_have_holes(std::uint32_t triangle) const {
    return material_of(triangle).alpha_mode != AlphaMode::Opaque;
  }
  /// Returns true if there is a surface at a point of a triangle, given in barycentric coordinates.
  [[nodiscard]] bool has_surface(std::uint32_t triangle, DVec3 shares) const;
  [[nodiscard]] Rgba8 colour(std::uint32_t triangle, DVec3 shares) const;
  [[nodiscard]] std::uint32_t material_index(std::uint32_t triangle) const {
    const auto& of = frame_->mesh().material_of;
    QUOIN_ASSERT(of.empty() || triangle < of.size(), "a triangle of the mesh");
    return of.empty() ? 0 : of[triangle];
  }
  /// Returns the index into `looks` of a point: its material with the emission of its texture there.
  [[nodiscard]] std::uint32_t look_index(std::uint32_t triangle, DVec3 shares) const;
  /// Returns the look of the single material of all triangles, with its mean emission; nullopt if there are several.
  [[nodiscard]] std::optional<std::uint32_t> deep_look() const;
  /// The area-weighted mean colour at the triangles' centres, with alpha if the only material blends.
  [[nodiscard]] Rgba8 mean() const { return mean_; }
  /// The properties of types except their colour: of the materials, then of those with parts of their emission.
  [[nodiscard]] const std::vector<VoxelProperties>& looks() const { return properties_; }

 private:
  /// An image of a texture's mip chain, down to one pixel.
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<std::uint16_t> pixels;  // linear light times alpha, and alpha, of 65,535; of the first level none
  };
  struct Images {
    std::vector<Level> levels;
  };

  [[nodiscard]] const MeshMaterial& material_of(std::uint32_t triangle) const {
    return materials_[material_index(triangle)];
  }
  /// Returns the single material of all triangles; nullopt if there are several.
  [[nodiscard]] std::optional<std::uint32_t> only_material() const;
  /// Returns the look of a material with a share of its emission.
  [[nodiscard]] std::uint32_t look_of(std::uint32_t material, float share) const;
  /// Returns the share of its material's emission, 0 to 1.
  [[nodiscard]] float emission_share(std::uint32_t triangle, DVec3 shares) const;
  /// Returns the texture's colour at a point of a triangle; `places` are its corners' texture coordinates.
  [[nodiscard]] glm::vec4 colour_in(std::size_t texture, std::uint32_t triangle, const glm::vec2* places,
                                    DVec3 shares) const;
  /// Linear light and alpha.
  [[nodiscard]] glm::vec4 light(std::uint32_t triangle, DVec3 shares) const;
  [[nodiscard]] glm::vec4 texel(std::size_t texture, std::size_t level, int x, int y) const;
  [[nodiscard]] glm::vec4 sample(std::size_t texture, std::size_t level, DVec3 place) const;
  [[nodiscard]] std::size_t level_of(std::uint32_t triangle, const glm::vec2* places, std::size_t texture) const;
  void make_halves(std::size_t texture);
  void find_mean();

  const Frame* frame_;
  std::vector<MeshMaterial> materials_;
  std::vector<VoxelProperties> properties_;
  std::vector<std::uint32_t> first_steps_;  ///< of materials: the look with no emission, of those with a texture of it
  std::vector<Images> images_;
  Rgba8 mean_;
  float mean_emission_ = 1.0F;  ///< share, by area
  bool is_plain_ = false;
};

}  // namespace quoin::voxelizing

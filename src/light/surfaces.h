#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include <quoin/core/changes.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// What light needs to know of a type, in linear light.
struct Surface {
  Vec3 colour{0.0F};
  Vec3 emitted{0.0F};  ///< colour * emission
  /// Natural logarithms of what one voxel's length lets through: of each channel, and of what is not tinted but seen
  /// past altogether. 0 for what is clear; minus infinity for what lets nothing through.
  Vec3 log_transmittance{0.0F};
  float log_clarity = 0.0F;
  float ior = 1.0F;        ///< of what is transparent, see glass_ior; else that of air
  float roughness = 1.0F;  ///< as VoxelProperties', within 0 and 1; 1 of what is not a number
  float metalness = 0.0F;  ///< likewise; 0 of what is not a number
  /// As VoxelProperties', of what is transparent; 0 where pictures show clouds as glass.
  float scattering = 0.0F;
  float anisotropy = 0.0F;  ///< -0.99 to 0.99
};

/// The index of refraction with which a transparent type is drawn and written to files; none where its own is not one:
/// less than that of air, infinite or not a number.
[[nodiscard]] std::optional<float> glass_ior(const VoxelProperties& properties);

/// Sets what a voxel's length of a transparent surface lets through, by its colour and alpha.
void set_absorption(float alpha, Surface& surface);

/// What becomes of types that scatter light within.
enum class Clouds : std::uint8_t {
  AsGlass,
  Scatter,  ///< they refract, tint and absorb nothing; `log_clarity` is of light that is not scattered
};

/// Surfaces by type; an id that is not registered gives a magenta that shows.
class Surfaces {
 public:
  explicit Surfaces(const VoxelRegistry& types, Clouds clouds = Clouds::AsGlass) : clouds_(clouds) { update(types); }
  /// Takes over the types that changed; false: none did. Cost: O(these).
  bool update(const VoxelRegistry& types);
  /// Whether any type scatters light within: never with Clouds::AsGlass.
  [[nodiscard]] bool has_clouds() const {
    return std::ranges::any_of(surfaces_, [](const Surface& each) { return each.scattering > 0.0F; });
  }
  [[nodiscard]] const Surface& operator[](VoxelType type) const {
    return surfaces_[type < surfaces_.size() - 1 ? type : surfaces_.size() - 1];
  }
  /// Of a field's material; kAir: it has none, and is white as in smooth meshes.
  [[nodiscard]] const Surface& of_field(VoxelType material) const;
  /// The colour, emission, roughness and metalness at a point of a field's surface: those of the solid samples of the
  /// 27 around it, each by its share. A flat smooth mesh has the same colours: at the middle of a cell the samples of
  /// its corners have equal shares, and between the middles of cells the shares change linearly.
  ///
  /// `inside`: where in the cell, 0 to 1 on each axis. `nearest`: the material where no sample around is solid.
  /// Cost: 9 rows of samples, and 27 materials where these differ.
  [[nodiscard]] Surface blend_of_field(const DensityGrid& field, IVec3 cell, const DVec3& inside,
                                       VoxelType nearest) const;

 private:
  Clouds clouds_;
  std::vector<Surface> surfaces_;  // that of unregistered types comes last
  ChangeCursor followed_;
};

}  // namespace quoin

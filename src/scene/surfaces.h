#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// The shading properties of a voxel type, in linear light.
struct Surface {
  Vec3 colour{0.0F};
  Vec3 emitted{0.0F};  ///< colour * emission
  /// Natural logarithms of the transmittance per voxel length: per channel, and for the share that passes without tint.
  /// 0 if clear; minus infinity if opaque.
  Vec3 log_transmittance{0.0F};
  float log_clarity = 0.0F;
  float ior = 1.0F;        ///< transparent types: see glass_ior; others: air
  float roughness = 1.0F;  ///< VoxelProperties::roughness clamped to [0, 1]; 1 for NaN
  float metalness = 0.0F;  ///< VoxelProperties::metalness clamped to [0, 1]; 0 for NaN
  /// VoxelProperties::scattering of a transparent type; 0 with Clouds::AsGlass.
  float scattering = 0.0F;
  float anisotropy = 0.0F;  ///< -0.99 to 0.99
};

/// Returns the index of refraction used to draw and export a transparent type. Returns nothing if the type's own value
/// is invalid: less than that of air, infinite or NaN.
[[nodiscard]] std::optional<float> glass_ior(const VoxelProperties& properties);

/// Returns the emission of a type, as a multiple of its colour: 0 for negative values and NaN, finite.
[[nodiscard]] float emission_of(const VoxelProperties& properties);

/// Sets the transmittance per voxel length of a transparent surface from its colour and alpha.
void set_absorption(float alpha, Surface& surface);

/// Treatment of types that scatter light inside.
enum class Clouds : std::uint8_t {
  AsGlass,
  Scatter,  ///< no refraction, tint or absorption; `log_clarity` is the unscattered light
};

/// Surfaces by type. Unregistered ids give a conspicuous magenta.
class Surfaces {
 public:
  explicit Surfaces(const VoxelRegistry& types, Clouds clouds = Clouds::AsGlass) : clouds_(clouds) { update(types); }
  /// Takes over the changed types. Returns false if there are none. Cost: O(changed types).
  bool update(const VoxelRegistry& types);
  /// Returns true if any type scatters light inside; always false with Clouds::AsGlass.
  [[nodiscard]] bool has_clouds() const {
    return std::ranges::any_of(surfaces_, [](const Surface& each) { return each.scattering > 0.0F; });
  }
  [[nodiscard]] const Surface& operator[](VoxelType type) const {
    QUOIN_ASSERT(!surfaces_.empty(), "an entry for unregistered types");
    return surfaces_[type < surfaces_.size() - 1 ? type : surfaces_.size() - 1];
  }
  /// Returns the surface of a field's material. kAir has no material and is white, as in smooth meshes.
  [[nodiscard]] const Surface& of_field(VoxelType material) const;
  /// Returns the colour, emission, roughness and metalness at a point of a field's surface: the weighted mean of the
  /// solid samples among the 27 around it. A flat smooth mesh has the same colours: at the middle of a cell the
  /// samples of its corners have equal weights, and between cell centres the weights change linearly.
  ///
  /// `inside`: the position in the cell, 0 to 1 on each axis. `nearest`: the material if no sample around is solid.
  /// Cost: 9 rows of samples, and 27 materials if these differ.
  [[nodiscard]] Surface blend_of_field(const DensityGrid& field, IVec3 cell, const DVec3& inside,
                                       VoxelType nearest) const;

 private:
  Clouds clouds_;
  std::vector<Surface> surfaces_;  // the last entry is for unregistered types
  ChangeCursor followed_;
};

}  // namespace quoin

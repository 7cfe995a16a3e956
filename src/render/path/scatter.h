#pragma once

#include <span>

#include <quoin/core/vec.h>

#include "render/path/path_math.h"

namespace quoin::path {

/// A surface material: glTF's metallic-roughness model.
struct Material {
  Vec3 colour{0.0F};
  float roughness = 1.0F;  ///< perceptual; a dielectric with 1 is matte, without any gloss
  float metalness = 0.0F;
};

/// A scattered direction and its weight.
struct Scattered {
  Vec3 direction{0.0F};
  Vec3 weight{0.0F};     ///< the scattering function times the cosine, divided by the density
  float density = 0.0F;  ///< by solid angle; infinite for a mirror
};

/// Scatters light towards a viewer who looks along -`out`: Lambert's law below a layer of gloss.
///
/// The gloss is the GGX microfacet model with Smith's height-correlated shadowing. Energy lost to multiple scattering
/// is compensated, and the matte layer gets the light that the gloss transmits, so that white surfaces reflect all
/// light. Directions are unit vectors in the frame whose +z is the normal.
///
/// Sources: B. Walter et al. (2007); E. Heitz (2014, 2018); E. Turquin, "Practical multiple scattering compensation
///          for microfacet models" (2019); J. Dupuy, A. Benyoub, "Sampling visible GGX normals with spherical caps"
///          (2023).
class Scatter {
 public:
  /// Requires: out.z > 0.
  Scatter(const Material& material, Vec3 out);
  /// Constructs the scattering of fog and clouds instead: +z is the direction in which the traced light travels, and
  /// light arrives from all directions. `anisotropy`: -0.99 to 0.99.
  ///
  /// Source: L. Henyey, J. Greenstein, "Diffuse radiation in the galaxy" (1941).
  Scatter(Vec3 colour, float anisotropy);

  /// Returns the scattering function times the cosine of `in`; 0 below the surface.
  [[nodiscard]] Vec3 value(Vec3 in) const;
  /// Returns the probability density of `in` in `sample`.
  [[nodiscard]] float density(Vec3 in) const;
  /// Samples a direction. The weight is 0 if no light arrives from there.
  [[nodiscard]] Scattered sample(Pair u, float choice) const;

 private:
  struct Both {
    Vec3 value{0.0F};
    float density = 0.0F;
  };
  [[nodiscard]] Both evaluate(Vec3 in) const;
  // Returns the gloss reflectance at that cosine with a facet's normal, with compensation.
  [[nodiscard]] Vec3 gloss_at(float cosine) const;

  [[nodiscard]] float phase(float cosine) const;

  Vec3 out_{0.0F};
  Vec3 colour_;
  Vec3 matte_{0.0F};  // the part of the colour below the gloss
  // Compensation for multiple scattering by facets, times the shares of metal and dielectric.
  Vec3 metal_gain_{0.0F};
  Vec3 dielectric_gain_{0.0F};
  float alpha_ = 1.0F;
  float gloss_share_ = 0.0F;  // of samples
  bool is_mirror_ = false;    // only `sample` finds gloss this sharp
  bool is_medium_ = false;
  float anisotropy_ = 0.0F;
};

/// The gloss reflectance of uniform light from all directions, a lookup table of Scatter: [roughness][cosine] in
/// kGlossEdge steps from 0 to 1 each. Each entry has two numbers; the first is scaled by the reflectance at normal
/// incidence.
constexpr int kGlossEdge = 32;
[[nodiscard]] std::span<const float> gloss_table();

}  // namespace quoin::path

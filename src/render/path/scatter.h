#pragma once

#include <span>

#include <quoin/core/vec.h>

#include "render/path/numbers/path_math.h"

namespace quoin::path {

/// What a surface is made of: glTF's metallic-roughness model.
struct Material {
  Vec3 colour{0.0F};
  float roughness = 1.0F;  ///< perceptual; 1 of what is no metal: matte, without any gloss
  float metalness = 0.0F;
};

/// A direction into which light is scattered, and how much of it.
struct Scattered {
  Vec3 direction{0.0F};
  Vec3 weight{0.0F};     ///< the scattering function times the cosine, divided by the density
  float density = 0.0F;  ///< by solid angle; infinite of a mirror
};

/// How a surface scatters light that comes to one who looks along -`out`: Lambert's law below a layer of gloss.
///
/// The gloss is the GGX microfacet model with Smith's shadowing of correlated heights; what it loses by light that
/// facets scatter more than once is put back, and the matte layer gets what the gloss lets through, so that white
/// surfaces reflect all light. Directions are unit vectors of the frame in which the normal is +z.
///
/// Sources: B. Walter et al. (2007); E. Heitz (2014, 2018); E. Turquin, "Practical multiple scattering compensation
///          for microfacet models" (2019); J. Dupuy, A. Benyoub, "Sampling visible GGX normals with spherical caps"
///          (2023).
class Scatter {
 public:
  /// Requires: out.z > 0.
  Scatter(const Material& material, Vec3 out);
  /// That of fog and clouds instead: +z is where the light that is traced goes, from all around of which it comes.
  /// `anisotropy`: -0.99 to 0.99.
  ///
  /// Source: L. Henyey, J. Greenstein, "Diffuse radiation in the galaxy" (1941).
  Scatter(Vec3 colour, float anisotropy);

  /// The scattering function times the cosine of `in`; 0 below the surface.
  [[nodiscard]] Vec3 value(Vec3 in) const;
  /// With which `sample` finds `in`.
  [[nodiscard]] float density(Vec3 in) const;
  /// A weight of 0: nothing comes from there.
  [[nodiscard]] Scattered sample(Pair u, float choice) const;

 private:
  struct Both {
    Vec3 value{0.0F};
    float density = 0.0F;
  };
  [[nodiscard]] Both evaluate(Vec3 in) const;
  // What the gloss reflects of light at that cosine with a facet's normal, with what is put back.
  [[nodiscard]] Vec3 gloss_at(float cosine) const;

  [[nodiscard]] float phase(float cosine) const;

  Vec3 out_{0.0F};
  Vec3 colour_;
  Vec3 matte_{0.0F};  // of it, what the gloss lets through
  // Put back what facets scatter more than once; times the shares of metal and of what is none.
  Vec3 metal_gain_{0.0F};
  Vec3 dielectric_gain_{0.0F};
  float alpha_ = 1.0F;
  float gloss_share_ = 0.0F;  // of samples
  bool is_mirror_ = false;    // only `sample` finds gloss that is so sharp
  bool is_medium_ = false;
  float anisotropy_ = 0.0F;
};

/// What gloss reflects of all light that comes from everywhere, as Scatter looks it up: [roughness][cosine] in
/// kGlossEdge steps from 0 to 1 each, two numbers each, of which the first is times what it reflects straight down.
constexpr int kGlossEdge = 32;
[[nodiscard]] std::span<const float> gloss_table();

}  // namespace quoin::path

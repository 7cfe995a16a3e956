#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>
#include <quoin/core/vec.h>

namespace quoin {

/// The directions of the occlusion rays of each face, as unit vectors in the grid's space.
///
/// 6: the normal, the four directions tilted 45 degrees towards the tangents, and (1,1,1)/sqrt(3) with the normal's
///    sign along the normal. The set is asymmetric, like the reference renderer's.
/// 9: the normal, the four tilted ones and all four diagonals. Each further sample of a pixel rotates them about the
///    normal and tilts the first one. Without this, flat faces would keep bands at any number of samples.
/// Any other number: cosine-weighted, one ray in each of as many rings of equal weight, a golden angle apart. A hash of
///    the pixel rotates the whole set and shifts it within the rings.
class OcclusionDirections {
 public:
  explicit OcclusionDirections(int rays);

  [[nodiscard]] int count() const { return count_; }
  /// Returns true if all pixels use the same directions.
  [[nodiscard]] bool is_fixed() const { return is_fixed_; }
  /// Requires: `is_fixed`. `face`: a Direction.
  [[nodiscard]] DVec3 fixed(std::size_t face, int ray) const {
    QUOIN_ASSERT(is_fixed_ && ray >= 0 && ray < count_, "a ray of those that all pixels have");
    QUOIN_ASSERT(face < fixed_.size(), "one of the six faces");
    return fixed_[face][static_cast<std::size_t>(ray)];
  }
  /// Requires: not `is_fixed`. `hash`: of the pixel.
  [[nodiscard]] DVec3 spread(std::size_t face, int ray, std::uint32_t hash) const;

  struct Angle {
    double cosine = 1.0;
    double sine = 0.0;
  };
  /// The rotation of the nine directions for one sample of a pixel.
  struct Turn {
    /// Rotation about the normal, from u towards v: less than a quarter turn. Samples spread evenly over this range.
    Angle about_normal;
    /// The new direction of the first ray, which rotation leaves unchanged, along u, v and the normal. It lies within
    /// half the angle to the next four rays. Samples spread evenly over this range.
    DVec3 upright{0.0, 0.0, 1.0};
  };
  /// Returns the identity for the first sample, and if there are not nine directions.
  [[nodiscard]] static Turn turn_of(int sample, int rays);

  using Fixed = std::array<std::array<DVec3, 9>, 6>;
  /// Returns all fixed directions, by face, with this rotation. Requires: `is_fixed`.
  [[nodiscard]] Fixed turned(const Turn& turn) const;

  /// Data of `spread`: the angles of the rings and the rotations of pixels; empty if `spread` is not used.
  [[nodiscard]] const std::vector<Angle>& ring_angles() const { return ring_angles_; }
  [[nodiscard]] const std::vector<Angle>& turns() const { return turns_; }

 private:
  int count_;
  bool is_fixed_;
  Fixed fixed_{};
  std::vector<Angle> ring_angles_;
  std::vector<Angle> turns_;
};

/// Rotates a direction by the rotation from (0, 1, 0) to a unit `normal`, about the axis perpendicular to both.
[[nodiscard]] DVec3 turned_from_up(const DVec3& direction, const DVec3& normal);

/// Returns a well-mixed hash of two numbers, by integer operations only.
[[nodiscard]] constexpr std::uint32_t hash_of(std::uint32_t a, std::uint32_t b) {
  return mix_bits(a * 0x9E37'79B9U + b * 0x85EB'CA6BU + 0x27D4'EB2FU);
}

}  // namespace quoin

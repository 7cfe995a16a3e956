#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>
#include <quoin/core/vec.h>

namespace quoin {

/// Where the occlusion rays of each face point, as unit vectors in the grid's frame.
///
/// 6: the normal, the four directions tilted 45 degrees towards the tangents, and (1,1,1)/sqrt(3) with the normal's
///    sign along the normal: lopsided, as the reference has it. 9: the normal, the four tilted ones and all four
///    diagonals; each further sample of a pixel turns them about the normal and leans the first one, or flat faces
///    would keep bands at any number of samples. Any other number: cosine-weighted, one ray in each of as
///    many rings of equal weight, a golden angle apart; the whole is turned and shifted within the rings by a hash of
///    the pixel.
class OcclusionDirections {
 public:
  explicit OcclusionDirections(int rays);

  [[nodiscard]] int count() const { return count_; }
  /// Whether all pixels have the same.
  [[nodiscard]] bool is_fixed() const { return is_fixed_; }
  /// Requires: `is_fixed`. `face`: a Direction.
  [[nodiscard]] DVec3 fixed(std::size_t face, int ray) const {
    QUOIN_ASSERT(is_fixed_ && ray >= 0 && ray < count_, "a ray of those that all pixels have");
    return fixed_[face][static_cast<std::size_t>(ray)];
  }
  /// Requires: not `is_fixed`. `hash`: of the pixel.
  [[nodiscard]] DVec3 spread(std::size_t face, int ray, std::uint32_t hash) const;

  struct Angle {
    double cosine = 1.0;
    double sine = 0.0;
  };
  /// What a pixel's sample does to the nine.
  struct Turn {
    /// By how much they turn about the normal, from u towards v: less than a quarter, over which samples are spread
    /// evenly.
    Angle about_normal;
    /// Where the first one, which turning leaves in its place, then points, along u, v and the normal: within half the
    /// way to the four next to it, over which samples are spread evenly.
    DVec3 upright{0.0, 0.0, 1.0};
  };
  /// Nothing for the first sample, nor where there are not nine.
  [[nodiscard]] static Turn turn_of(int sample, int rays);

  using Fixed = std::array<std::array<DVec3, 9>, 6>;
  /// All fixed directions, by face, so turned. Requires: `is_fixed`.
  [[nodiscard]] Fixed turned(const Turn& turn) const;

  /// What `spread` is made of: the rings' angles, and those by which pixels turn them; empty where it is not.
  [[nodiscard]] const std::vector<Angle>& ring_angles() const { return ring_angles_; }
  [[nodiscard]] const std::vector<Angle>& turns() const { return turns_; }

 private:
  int count_;
  bool is_fixed_;
  Fixed fixed_{};
  std::vector<Angle> ring_angles_;
  std::vector<Angle> turns_;
};

/// A direction that stands to (0, 1, 0) as the result stands to a unit `normal`: turned about the axis upright to both.
[[nodiscard]] DVec3 turned_from_up(const DVec3& direction, const DVec3& normal);

/// A well-mixed number of two, by integers only.
[[nodiscard]] constexpr std::uint32_t hash_of(std::uint32_t a, std::uint32_t b) {
  return mix_bits(a * 0x9E37'79B9U + b * 0x85EB'CA6BU + 0x27D4'EB2FU);
}

}  // namespace quoin

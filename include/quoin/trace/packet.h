#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/ray.h>

namespace quoin {

/// Sixteen rays side by side, in grid space. Rays that start near each other and point the same way are traced together
/// several times as fast as one by one; with the same results.
struct alignas(64) RayPacket {
  static constexpr int kSize = 16;
  template <class T>
  using Lanes = std::array<T, kSize>;

  Lanes<double> origin_x{}, origin_y{}, origin_z{};
  Lanes<double> direction_x{}, direction_y{}, direction_z{};
  Lanes<double> max_t{};     ///< up to and including; infinity is none, a negative number or NaN hits nothing
  std::uint32_t active = 0;  ///< bit i: ray i counts

  /// Puts a ray into a lane, which becomes active; to drop a lane, clear its bit in `active`.
  /// Requires: 0 <= lane < kSize.
  void set(int lane, const Ray& ray, double ray_max_t) {
    QUOIN_ASSERT(lane >= 0 && lane < kSize, "0 <= lane < kSize");
    const auto i = static_cast<std::size_t>(lane);
    origin_x[i] = ray.origin.x, origin_y[i] = ray.origin.y, origin_z[i] = ray.origin.z;
    direction_x[i] = ray.direction.x, direction_y[i] = ray.direction.y, direction_z[i] = ray.direction.z;
    max_t[i] = ray_max_t;
    active |= 1U << lane;
  }
  /// The ray of a lane, active or not. Requires: 0 <= lane < kSize.
  [[nodiscard]] Ray ray(int lane) const {
    QUOIN_ASSERT(lane >= 0 && lane < kSize, "0 <= lane < kSize");
    const auto i = static_cast<std::size_t>(lane);
    return {{origin_x[i], origin_y[i], origin_z[i]}, {direction_x[i], direction_y[i], direction_z[i]}};
  }
};

/// What `first_hits` found; lanes whose bit in `hit` is not set hold nothing of meaning.
struct alignas(64) PacketHits {
  std::uint32_t hit = 0;
  std::uint32_t starts_inside = 0;
  RayPacket::Lanes<std::int32_t> x{}, y{}, z{};  ///< the voxel
  RayPacket::Lanes<double> t{};
  RayPacket::Lanes<Direction> face{};

  /// Puts what a ray alone hit into its lane, which counts as hit. Requires: 0 <= lane < RayPacket::kSize.
  void set(int lane, const RayHit& found) {
    QUOIN_ASSERT(lane >= 0 && lane < RayPacket::kSize, "0 <= lane < kSize");
    const auto i = static_cast<std::size_t>(lane);
    hit |= 1U << lane;
    starts_inside |= std::uint32_t{found.starts_inside} << lane;
    x[i] = found.voxel.x, y[i] = found.voxel.y, z[i] = found.voxel.z;
    t[i] = found.t;
    face[i] = found.face;
  }
  /// What a lane hit. Requires: 0 <= lane < RayPacket::kSize, and its bit in `hit` is set.
  [[nodiscard]] RayHit operator[](int lane) const {
    QUOIN_ASSERT(lane >= 0 && lane < RayPacket::kSize, "0 <= lane < kSize");
    QUOIN_ASSERT((hit >> lane & 1U) != 0, "a lane that hit something");
    const auto i = static_cast<std::size_t>(lane);
    return {{x[i], y[i], z[i]}, face[i], t[i], (starts_inside >> lane & 1U) != 0};
  }
};

/// As the function for single rays, for each active ray: equal in every bit, whatever the other rays.
void first_hits(const OccupancyTree& tree, const RayPacket& rays, PacketHits& hits);

/// Bit i: ray i is active and blocked.
[[nodiscard]] std::uint32_t any_hits(const OccupancyTree& tree, const RayPacket& rays);

}  // namespace quoin

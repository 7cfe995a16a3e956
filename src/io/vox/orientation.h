#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/vec.h>

namespace quoin::vox {

/// A translation that sums of many 32-bit ones cannot overflow.
using Offset = std::array<std::int64_t, 3>;

[[nodiscard]] Offset operator*(const AxisOrientation& orientation, const Offset& offset);

/// A rotation followed by a translation. Requires for computations: offsets stay below 2^62, as all file offsets do.
struct Motion {
  AxisOrientation orientation;
  Offset translation{0, 0, 0};

  bool operator==(const Motion&) const = default;
};

/// First `b`, then `a`.
[[nodiscard]] Motion operator*(const Motion& a, const Motion& b);
[[nodiscard]] Motion inverse(const Motion& motion);

/// Converts from and to the `_r` byte: bits 0-1 and 2-3 the columns of the first and second row's entry, bits 4-6 the
/// rows' signs. Returns nullopt if the two rows have the same or an invalid column.
[[nodiscard]] std::optional<AxisOrientation> orientation_from_byte(std::uint8_t byte);
[[nodiscard]] std::uint8_t byte_from_orientation(const AxisOrientation& orientation);

/// An orientation as an Instance holds it: mirror x, then rotate.
struct InstanceTurn {
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  bool mirrored = false;
};

/// From MagicaVoxel's axes (z up) to Quoin's (y up): the same motion seen from axes (x, z, -y).
[[nodiscard]] InstanceTurn turn_from_orientation(const AxisOrientation& in_vox);
/// The inverse conversion; nullopt if the rotation is not a multiple of quarter turns.
[[nodiscard]] std::optional<AxisOrientation> orientation_from_turn(const InstanceTurn& turn);

/// (x, y, z) of MagicaVoxel as Quoin's (x, z, -y), and back.
[[nodiscard]] Offset quoin_from_vox(const Offset& offset);
[[nodiscard]] Offset vox_from_quoin(const Offset& offset);

}  // namespace quoin::vox

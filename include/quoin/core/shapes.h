#pragma once

#include <quoin/core/vec.h>

namespace quoin {

/// A box in any place and rotation, in world units.
struct OrientedBox {
  DVec3 centre{0.0};
  DVec3 half_size{0.5};                ///< 0 or more: a box, a plate, a rod or a point
  DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< world from box; of any length; a zero one counts as no rotation
};

/// All that is within a distance of a line between two points, in world units: a rod with round ends, or a ball.
// The radius comes first, so that what is in braces is a box or a capsule, and never either.
struct Capsule {
  double radius = 0.5;  ///< 0 or less: it meets nothing
  DVec3 centre{0.0};
  DVec3 half_axis{0.0, 0.5, 0.0};  ///< from the centre to the middle of one of the ends; 0: a ball
};

}  // namespace quoin

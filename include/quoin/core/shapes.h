#pragma once

#include <quoin/core/vec.h>

namespace quoin {

/// A box with any position and rotation, in world units.
struct OrientedBox {
  DVec3 centre{0.0};
  DVec3 half_size{0.5};                ///< 0 or more per axis; zeros give a plate, a rod or a point
  DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< world from box; need not be normalised; zero counts as no rotation
};

/// A capsule in world units: all points within `radius` of a line segment.
// The radius comes first, so that a braced initialiser fits either a box or a capsule but never both.
struct Capsule {
  double radius = 0.5;  ///< 0 or less: the capsule hits nothing
  DVec3 centre{0.0};
  DVec3 half_axis{0.0, 0.5, 0.0};  ///< from the centre to one end of the segment; zero gives a ball
};

}  // namespace quoin

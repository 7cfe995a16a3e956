#pragma once

#include <quoin/core/vec.h>

namespace quoin {

/// A box in any place and rotation, in world units.
struct OrientedBox {
  DVec3 centre{0.0};
  DVec3 half_size{0.5};                ///< 0 or more: a box, a plate, a rod or a point
  DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< world from box; of any length; a zero one counts as no rotation
};

}  // namespace quoin

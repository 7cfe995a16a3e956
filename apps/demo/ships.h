#pragma once

#include <vector>

#include <quoin/grid/grid.h>
#include <quoin/scene/scene.h>

namespace demo {

/// The designs of the fleet, each with its pivot in the middle: a scout, a freighter, a cruiser and a carrier, 40 to
/// 420 voxels long, their bows towards -z.
[[nodiscard]] quoin::Result<std::vector<quoin::GridHandle>> add_ships(quoin::Scene& scene);

}  // namespace demo

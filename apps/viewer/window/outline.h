#pragma once

#include "view_state.h"

namespace quoin::viewer {

/// Draws what the brush would reach about the voxel under the mouse, as lines over the picture.
void draw_outline(const ViewState& state);

}  // namespace quoin::viewer

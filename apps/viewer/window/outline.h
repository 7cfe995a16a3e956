#pragma once

#include "view_state.h"

namespace quoin::viewer {

/// Draws the outline of the brush at the voxel under the mouse, as lines over the image.
void draw_outline(const ViewState& state);

}  // namespace quoin::viewer

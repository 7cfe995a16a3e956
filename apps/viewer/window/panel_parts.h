#pragma once

#include "panels.h"

namespace quoin::viewer {

/// The parts of the panel, from the top.
void draw_tool_part(ViewState& state, MenuChoice& choice);
void draw_picture_part(ViewState& state);
void draw_camera_part(ViewState& state, MenuChoice& choice);
void draw_light_part(ViewState& state);
void draw_statistics_part(const ViewState& state);

/// What keys and the mouse do.
void draw_help_table(float scale);

}  // namespace quoin::viewer

#pragma once

#include "viewer/window/panel/panels.h"

namespace quoin::viewer {

/// A heading that can be folded. Returns whether what follows is shown.
bool heading(const char* name, bool is_open = true);

/// The parts of the panel, from the top.
void draw_tool_part(ViewState& state, MenuChoice& choice);
/// Layers, groups and instances, to be shown and hidden.
void draw_scene_part(ViewState& state);
void draw_picture_part(ViewState& state);
void draw_camera_part(ViewState& state, MenuChoice& choice);
void draw_light_part(ViewState& state);
void draw_statistics_part(const ViewState& state);

/// What keys and the mouse do.
void draw_help_table(float scale);

}  // namespace quoin::viewer

#pragma once

#include "viewer/window/panel/panels.h"

namespace quoin::viewer {

/// Draws a heading that can be folded. Returns true if it is unfolded.
bool heading(const char* name, bool is_open = true);

/// The parts of the panel, from the top.
void draw_tool_part(ViewState& state, MenuChoice& choice);
/// Layers, groups and instances, with switches to show and hide them.
void draw_scene_part(ViewState& state);
void draw_image_part(ViewState& state);
void draw_camera_part(ViewState& state, MenuChoice& choice);
void draw_light_part(ViewState& state);
void draw_statistics_part(const ViewState& state);

/// Draws the table of keys and mouse actions.
void draw_help_table(float scale);

}  // namespace quoin::viewer

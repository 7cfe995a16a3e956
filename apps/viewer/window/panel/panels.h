#pragma once

#include <vector>

#include "viewer/window/input.h"
#include "viewer/window/view_state.h"

namespace quoin::viewer {

/// The legend of the level-of-detail colours.
inline constexpr const char* kDetailLegend = "green: full detail; yellow to red: coarser cells; blue: impostors";

/// The user's choices in menus and panels.
struct MenuChoice {
  std::vector<Command> commands;
  std::optional<std::string> recent;  ///< recent file to open
  std::optional<Camera> camera;       ///< camera of the file to look through
  std::optional<std::string> pack;    ///< Settings::pack to use
};

/// Draws the menu bar at the top. Returns its height in window units.
float draw_menu(ViewState& state, MenuChoice& choice);
/// Draws the status line at the bottom. Returns its height.
float draw_status(const ViewState& state);
/// Draws the panel on the right, `top` and `bottom` units from the edges. Returns its width.
float draw_panel(ViewState& state, float scale, float top, float bottom, MenuChoice& choice);
/// Draws the help on keys and mouse, if it is shown.
void draw_help(ViewState& state, float scale);
/// Draws the message over the image. Requires: `state.message`.
void draw_message(ViewState& state, float bottom);
/// Draws a note over the image while it does not fully show the mode of the settings: the remaining work, its progress,
/// and the mode that is shown meanwhile.
void draw_progress(ViewState& state, float scale, float top);
/// Draws the outline of the brush at the voxel under the mouse, as lines over the image.
void draw_outline(const ViewState& state);
/// Draws the welcome text of an empty window.
void draw_welcome(const ViewState& state, MenuChoice& choice);

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

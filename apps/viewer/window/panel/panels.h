#pragma once

#include <vector>

#include "viewer/window/commands.h"
#include "viewer/window/view_state.h"

namespace quoin::viewer {

/// What the colours of levels of detail mean.
inline constexpr const char* kDetailLegend = "green: in full; yellow to red: in coarser cells; blue: impostors";

/// What the menus ask for beyond commands.
struct MenuChoice {
  std::vector<Command> commands;
  std::optional<std::string> recent;  ///< a file to open
  std::optional<Camera> camera;       ///< one of the file's, to look through
};

/// The bar at the top. Returns its height, in the window's units.
float draw_menu(ViewState& state, MenuChoice& choice);
/// The line at the bottom. Returns its height.
float draw_status(const ViewState& state);
/// What stands at the right, `top` and `bottom` units off the edges. Returns its width.
float draw_panel(ViewState& state, float scale, float top, float bottom, MenuChoice& choice);
/// Keys and mouse, if shown.
void draw_help(ViewState& state, float scale);
/// A note over the picture: errors, what was saved. Requires: `state.message`.
void draw_message(ViewState& state, float bottom);
/// A note over the image while it does not show the mode of the settings, or not all of it: the work that is left, how
/// far it has come, and the mode that is shown meanwhile.
void draw_progress(ViewState& state, float scale, float top);
/// What an empty window says.
void draw_welcome(const ViewState& state, MenuChoice& choice);

}  // namespace quoin::viewer

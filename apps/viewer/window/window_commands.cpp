#include "window_commands.h"

#include <array>

namespace quoin::viewer {

namespace {

constexpr std::array kCommands = {
    CommandInfo{Command::Open, "Open...", "Ctrl+O", SDLK_o, true, false},
    CommandInfo{Command::Save, "Save", "Ctrl+S", SDLK_s, true, false},
    CommandInfo{Command::SaveAs, "Save as...", "Ctrl+Shift+S", SDLK_s, true, true},
    CommandInfo{Command::Screenshot, "Save the image", "F12", SDLK_F12, false, false},
    CommandInfo{Command::Quit, "Quit", "Ctrl+Q", SDLK_q, true, false},
    CommandInfo{Command::Undo, "Undo", "Ctrl+Z", SDLK_z, true, false},
    CommandInfo{Command::Redo, "Redo", "Ctrl+Y", SDLK_y, true, false},
    CommandInfo{Command::ToolLook, "Look", "1", SDLK_1, false, false},
    CommandInfo{Command::ToolPlace, "Place", "2", SDLK_2, false, false},
    CommandInfo{Command::ToolRemove, "Remove", "3", SDLK_3, false, false},
    CommandInfo{Command::ToolPaint, "Paint", "4", SDLK_4, false, false},
    CommandInfo{Command::ToolSmooth, "Smooth (fields)", "5", SDLK_5, false, false},
    CommandInfo{Command::ToolFlatten, "Flatten (fields)", "6", SDLK_6, false, false},
    CommandInfo{Command::BrushSmaller, "Smaller brush", "[", SDLK_LEFTBRACKET, false, false},
    CommandInfo{Command::BrushLarger, "Larger brush", "]", SDLK_RIGHTBRACKET, false, false},
    CommandInfo{Command::BrushShape, "Box or sphere", "B", SDLK_b, false, false},
    CommandInfo{Command::PickType, "Pick the type under the mouse", "I", SDLK_i, false, false},
    CommandInfo{Command::CameraMode, "Orbit, fly or walk", "C", SDLK_c, false, false},
    CommandInfo{Command::Focus, "Look at the point under the mouse", "F", SDLK_f, false, false},
    CommandInfo{Command::ViewIso, "Show all", "Home", SDLK_HOME, false, false},
    CommandInfo{Command::ViewFront, "From the front", "Shift+1", SDLK_1, false, true},
    CommandInfo{Command::ViewBack, "From the back", "Shift+2", SDLK_2, false, true},
    CommandInfo{Command::ViewLeft, "From the left", "Shift+3", SDLK_3, false, true},
    CommandInfo{Command::ViewRight, "From the right", "Shift+4", SDLK_4, false, true},
    CommandInfo{Command::ViewTop, "From above", "Shift+5", SDLK_5, false, true},
    CommandInfo{Command::DrawRays, "Ray marching", "F5", SDLK_F5, false, false},
    CommandInfo{Command::DrawBlocks, "Blocky meshes", "F6", SDLK_F6, false, false},
    CommandInfo{Command::DrawSmooth, "Smooth meshes", "F7", SDLK_F7, false, false},
    CommandInfo{Command::DrawDensity, "Density slice", "F4", SDLK_F4, false, false},
    CommandInfo{Command::DrawPaths, "Path tracing", "F3", SDLK_F3, false, false},
    CommandInfo{Command::NextWireframe, "Triangle edges", "F8", SDLK_F8, false, false},
    CommandInfo{Command::NextShading, "Next shading (lit, unlit, occlusion, normals)", "F9", SDLK_F9, false, false},
    CommandInfo{Command::DetailColours, "Level-of-detail colours", "F10", SDLK_F10, false, false},
    CommandInfo{Command::Panel, "Panel", "F2", SDLK_F2, false, false},
    CommandInfo{Command::Help, "Keys and mouse", "F1", SDLK_F1, false, false},
};

}  // namespace

std::span<const CommandInfo> commands() {
  return kCommands;
}

const CommandInfo& info_of(Command command) {
  for (const CommandInfo& info : kCommands) {
    if (info.command == command) return info;
  }
  return kCommands.front();
}

std::optional<Command> command_of(const SDL_Keysym& key) {
  const bool has_control = (key.mod & (KMOD_CTRL | KMOD_GUI)) != 0;
  const bool has_shift = (key.mod & KMOD_SHIFT) != 0;
  if (has_control && has_shift && key.sym == SDLK_z) return Command::Redo;
  for (const CommandInfo& info : kCommands) {
    if (info.key == key.sym && info.with_control == has_control && info.with_shift == has_shift) return info.command;
  }
  return std::nullopt;
}

}  // namespace quoin::viewer

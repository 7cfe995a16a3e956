#pragma once

#include <SDL.h>

#include <cstdint>
#include <optional>
#include <span>

namespace quoin::viewer {

/// The commands of keys and menus.
enum class Command : std::uint8_t {
  Open,
  Save,
  SaveAs,
  Screenshot,
  Quit,
  Undo,
  Redo,
  ToolLook,
  ToolPlace,
  ToolRemove,
  ToolPaint,
  ToolSmooth,
  ToolFlatten,
  BrushSmaller,
  BrushLarger,
  BrushShape,
  PickType,
  CameraMode,
  Focus,
  ViewFront,
  ViewBack,
  ViewLeft,
  ViewRight,
  ViewTop,
  ViewIso,
  DrawRays,
  DrawBlocks,
  DrawSmooth,
  DrawDensity,
  DrawPaths,
  NextWireframe,
  NextShading,
  DetailColours,
  Panel,
  Help,
};

struct CommandInfo {
  Command command;
  const char* name;  ///< label in menus
  const char* keys;  ///< key names to show
  SDL_Keycode key;
  bool with_control;
  bool with_shift;
};

/// Returns all commands in the order of the help.
[[nodiscard]] std::span<const CommandInfo> commands();
[[nodiscard]] const CommandInfo& info_of(Command command);

/// Returns the command of a key, if it has one.
[[nodiscard]] std::optional<Command> command_of(const SDL_Keysym& key);

}  // namespace quoin::viewer

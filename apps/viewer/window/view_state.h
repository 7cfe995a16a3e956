#pragma once

#include <SDL.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/camera/camera_control.h"
#include "viewer/clients.h"
#include "viewer/loader.h"
#include "viewer/settings.h"
#include "viewer/window/panel/scene_tree.h"

namespace quoin::viewer {

/// The action of the left mouse button.
enum class Tool : std::uint8_t { Look, Place, Remove, Paint, Smooth, Flatten };

/// A line of text shown to the user for some seconds.
struct Message {
  std::string text;
  bool is_error = false;
  std::chrono::steady_clock::time_point since = std::chrono::steady_clock::now();

  [[nodiscard]] bool is_old() const {
    constexpr std::chrono::seconds kShown{6};
    return std::chrono::steady_clock::now() - since > (is_error ? 3 : 1) * kShown;
  }
};

/// Statistics of the shown image.
struct FrameStats {
  int width = 0;
  int height = 0;
  int samples = 0;
  bool is_settled = false;
  double seconds = 0.0;
  std::int64_t rays = 0;
};

/// The mouse position in image pixels, from the upper left corner.
struct MousePosition {
  double x = 0.0;
  double y = 0.0;
  bool is_over = false;  ///< over the image, and no part of the GUI covers it
};

/// The state shared by the parts of the window.
struct ViewState {
  Settings settings;
  CameraControl camera;
  Walker walker;  ///< moves the camera in CameraMode::Walk
  double fov_before_walk = 0.0;
  Tool tool = Tool::Look;
  Brush brush;
  VoxelType palette_shows = kAir;                            ///< the type that the palette has scrolled to
  OpenDocument open{std::make_unique<Document>(), nullptr};  ///< there is always a document
  SceneTree scene_tree;                                      ///< the tree shown in the panel

  SDL_Rect image_place{0, 0, 0, 0};  ///< in output pixels
  double pixels_per_unit = 1.0;
  MousePosition mouse;
  std::optional<SceneHit> hover;  ///< the hit under the mouse

  ViewFrame image;  ///< the last frame that arrived
  FrameStats stats;
  double frame_seconds = 0.0;         ///< processing time of a window frame, smoothed
  double longest_wait_seconds = 0.0;  ///< longest time that an edit waited for rendering to stop
  double last_wait_seconds = 0.0;
  std::chrono::steady_clock::time_point edited_at{};  ///< last edit of the document

  /// Time since the image shows another mode than the settings, or chunks remain to be meshed.
  std::optional<std::chrono::steady_clock::time_point> waiting_since;
  std::optional<Message> message;
  bool is_help_shown = false;
  std::unique_ptr<Loader> loader;
  std::unique_ptr<Saver> saver;
  std::unique_ptr<PackLoader> pack_loader;
  std::optional<std::vector<InstalledClient>> clients;  ///< for the menu; searched when it is first opened
  bool has_named_packs = false;                         ///< packs of the command line replace Settings::pack

  [[nodiscard]] const Scene& scene() const { return open.document->scene(); }
  /// Returns the environment of the images, which the panel changes.
  [[nodiscard]] Environment& environment() { return open.environment ? *open.environment : settings.environment; }
  [[nodiscard]] const Environment& environment() const {
    return open.environment ? *open.environment : settings.environment;
  }
  [[nodiscard]] double aspect() const { return static_cast<double>(image_place.w) / std::max(image_place.h, 1); }
  /// Returns the bounds that set the scale of speeds and distances at a point.
  [[nodiscard]] DBox bounds(DVec3 from, InstanceFilter filter = InstanceFilter::Visible) const {
    return open.document->world() ? open.document->world()->bounds(from) : scene().bounds(filter);
  }
  [[nodiscard]] bool has_image_place() const { return image_place.w > 0 && image_place.h > 0; }
  /// Returns true if the document can be changed now.
  [[nodiscard]] bool can_edit() const { return open.backend != nullptr && !saver && !loader; }
  /// Returns true if another resource pack can be chosen now.
  [[nodiscard]] bool can_choose_pack() const { return !saver && !loader && !pack_loader; }
  /// Returns the reason to show if the scene cannot be drawn in that mode, else null.
  [[nodiscard]] const char* why_not_drawn_as(DrawMode mode) const;
  /// Changes the camera mode. Walking starts at the point under the mouse or the middle of the scene, with a person's
  /// field of view until the mode changes.
  void set_camera_mode(CameraMode mode);
  void report(std::string text) { message = Message{std::move(text), false}; }
  void report(const Error& error) { message = Message{to_string(error), true}; }
};

}  // namespace quoin::viewer

#pragma once

#include <SDL.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/camera/walker.h"
#include "viewer/loader.h"
#include "viewer/settings.h"
#include "viewer/window/panel/scene_tree.h"

namespace quoin::viewer {

/// What the left mouse button does.
enum class Tool : std::uint8_t { Look, Place, Remove, Paint, Smooth, Flatten };

/// One line that tells the user something, for a while.
struct Message {
  std::string text;
  bool is_error = false;
  std::chrono::steady_clock::time_point since = std::chrono::steady_clock::now();

  [[nodiscard]] bool is_old() const {
    constexpr std::chrono::seconds kShown{6};
    return std::chrono::steady_clock::now() - since > (is_error ? 3 : 1) * kShown;
  }
};

/// Stats about the picture that is shown.
struct FrameStats {
  int width = 0;
  int height = 0;
  int samples = 0;
  bool is_settled = false;
  double seconds = 0.0;
  std::int64_t rays = 0;
};

/// Where the mouse is, in pixels of the picture from its upper left corner.
struct MousePlace {
  double x = 0.0;
  double y = 0.0;
  bool is_over = false;  ///< the picture, with nothing before it
};

/// All that the window knows; its parts read and change it.
struct ViewState {
  Settings settings;
  CameraControl camera;
  Walker walker;  ///< whose eyes the camera is while its mode says so
  double fov_before_walk = 0.0;
  Tool tool = Tool::Look;
  Brush brush;
  VoxelType palette_shows = kAir;                            ///< the type that the palette has scrolled to
  OpenDocument open{std::make_unique<Document>(), nullptr};  ///< there is always a document
  SceneTree scene_tree;                                      ///< as the panel shows it

  SDL_Rect picture_place{0, 0, 0, 0};  ///< in pixels of the output
  double pixels_per_unit = 1.0;
  MousePlace mouse;
  std::optional<SceneHit> hover;  ///< what is under the mouse

  ViewFrame picture;  ///< the last that arrived
  FrameStats stats;
  double frame_seconds = 0.0;         ///< the work of a frame of the window, smoothed
  double longest_wait_seconds = 0.0;  ///< of an edit for the picture to stop
  double last_wait_seconds = 0.0;
  std::chrono::steady_clock::time_point edited_at{};  ///< the document, last

  /// Since when the image shows another mode than the settings, or chunks remain to be meshed.
  std::optional<std::chrono::steady_clock::time_point> waiting_since;
  std::optional<Message> message;
  bool is_help_shown = false;
  std::unique_ptr<Loader> loader;
  std::unique_ptr<Saver> saver;

  [[nodiscard]] const Scene& scene() const { return open.document->scene(); }
  [[nodiscard]] double aspect() const { return static_cast<double>(picture_place.w) / std::max(picture_place.h, 1); }
  /// Of what speeds and distances at a place go by.
  [[nodiscard]] DBox bounds(DVec3 from, InstanceFilter filter = InstanceFilter::Visible) const {
    return open.document->world() ? open.document->world()->bounds(from) : scene().bounds(filter);
  }
  [[nodiscard]] bool has_picture_place() const { return picture_place.w > 0 && picture_place.h > 0; }
  /// Whether the document may be changed now.
  [[nodiscard]] bool can_edit() const { return open.backend != nullptr && !saver && !loader; }
  /// Why the scene cannot be drawn as that; null where it can.
  [[nodiscard]] const char* why_not_drawn_as(DrawMode mode) const;
  /// Changes what dragging does. One walks from the place under the mouse, or from the middle of the scene, and sees
  /// with the angle of view of a person meanwhile.
  void set_camera_mode(CameraMode mode);
  void tell(std::string text) { message = Message{std::move(text), false}; }
  void tell(const Error& error) { message = Message{to_string(error), true}; }
};

}  // namespace quoin::viewer

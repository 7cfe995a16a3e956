#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/render/light_options.h>
#include <quoin/render/path_history.h>
#include <quoin/render/path_tracer.h>
#include <quoin/render/vulkan_image.h>
#include <quoin/render/vulkan_mesh_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/environment.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_query.h>
#include <quoin/scene/sweep.h>

namespace quoin::viewer {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Lowers the priority of the calling thread and of threads that it starts, so that rendering does not delay the
/// window's thread or the display server. Does nothing on systems without thread priorities. The workers of parallel
/// loops are shared and keep the priority of the thread that ran the first such loop.
void yield_to_window();

/// Hysteresis of the image size in motion: the size of the last image is kept up to this factor of the target time,
/// so that it does not oscillate.
inline constexpr double kConstancy = 1.3;
/// Returns the running average of a time, in seconds, after one more measurement. `known` is 0 before the first one.
/// Averaging evens out the load of other programs.
[[nodiscard]] double seconds_known(double known, double measured);

/// A way to draw the scene.
enum class DrawMode : std::uint8_t {
  Rays,     ///< ray marching
  Blocks,   ///< blocky meshes of its chunks
  Smooth,   ///< smooth meshes of its chunks
  Density,  ///< a slice of its fields' densities, seen from the positive end of an axis: draw_density_slice
  Paths,    ///< path tracing, which converges while the view stays the same: PathTracer
};

inline constexpr std::size_t kDrawModes = 5;

[[nodiscard]] inline bool has_meshes(DrawMode mode) {
  return mode == DrawMode::Blocks || mode == DrawMode::Smooth;
}

/// The plane of a density slice, as in DensitySliceOptions.
struct SlicePlane {
  int axis = 1;
  double at = 0.5;
  bool operator==(const SlicePlane&) const = default;
};

/// The image that the window wants to show.
struct ViewRequest {
  Camera camera;
  int width = 0;  ///< pixels; nothing is drawn unless both are positive
  int height = 0;
  LightOptions light;             ///< `smooth` also applies to smooth meshes and to meshes of fields
  bool detail_by_pixels = false;  ///< draws far models with coarser cells
  bool detail_colours = false;    ///< rays: colours instances by their level of detail
  int samples = 16;               ///< per pixel of the settled image; meshes use 4, or 1 if 1 is requested
  DrawMode mode = DrawMode::Rays;
  Wireframe wireframe = Wireframe::Off;  ///< meshes only
  Environment environment;
  double exposure = 1.0;  ///< factor on the environment's exposure
  /// Paths only: the file's render settings; null if it has none.
  std::shared_ptr<const FileRenderSettings> render_settings;
  SlicePlane slice;         ///< densities only; these use neither camera nor light
  bool whole_only = false;  ///< skips smaller images in the meantime
};

/// Returns true if both request the same image.
[[nodiscard]] bool is_same(const ViewRequest& a, const ViewRequest& b);

constexpr int kPathSamples = 256;  ///< per pixel of a settled path-traced image

/// Returns the environment of images other than path-traced ones.
[[nodiscard]] Environment marched_environment(const ViewRequest& request);

/// Returns the path tracing options: the file's settings with the light of the window's panel, denoised within
/// surfaces. `bounds` are the scene's.
[[nodiscard]] PathOptions path_options(const ViewRequest& request, int width, int height, int samples,
                                       const DBox& bounds);
/// Returns the options for developing an image with these path tracing options.
[[nodiscard]] DevelopOptions develop_options(const ViewRequest& request);

/// The history that the path-traced images of one request share, across edits of the scene.
class PathMemory {
 public:
  /// Returns the history of a request. Clears it first if it belongs to another request.
  PathHistory& of(const ViewRequest& request);
  void note_edit() { history_.note_edit(); }
  void clear();
  /// Returns true if a request may begin with an image of 1 / `divisor` of its width and height.
  [[nodiscard]] bool may_begin(const ViewRequest& request, int divisor) const;
  /// Returns the first of `divisors` that the request may begin with, or the first one if there is none.
  [[nodiscard]] int first_divisor(const ViewRequest& request, std::span<const int> divisors) const;
  [[nodiscard]] std::size_t bytes() const { return history_.bytes(); }

 private:
  [[nodiscard]] bool is_of(const ViewRequest& request) const;

  std::optional<ViewRequest> request_;  // with the samples of a settled image
  PathHistory history_;
};

/// An image for the last request, or for a request shortly before it.
struct ViewFrame {
  Image colour;  ///< may be smaller than requested; the window stretches it
  /// Replaces `colour` where the image stays on a graphics device. The next frame may be drawn into it.
  std::shared_ptr<const VulkanImage> on_device;
  DrawMode mode = DrawMode::Rays;  ///< the mode that it shows; a stand-in shows another mode than the request
  int samples = 0;                 ///< per pixel
  bool is_whole = false;           ///< has the requested size
  bool is_settled = false;         ///< is the final image of this request
  double seconds = 0.0;
  std::int64_t rays = 0;
};

/// Renders a scene for the window, on the processor or on a graphics device.
///
/// Threads: all calls come from the window's thread. Only `pause` waits for images that the processor renders; the
/// device that shows the window draws in `take`.
class ViewBackend {
 public:
  ViewBackend() = default;
  ViewBackend(const ViewBackend&) = delete;
  ViewBackend& operator=(const ViewBackend&) = delete;
  virtual ~ViewBackend() = default;

  /// Returns the name to show, such as "processor".
  [[nodiscard]] virtual std::string name() const = 0;

  /// Returns true if the backend can draw the mode. The answer may change after a fault.
  [[nodiscard]] virtual bool can_draw(DrawMode mode) const { return !has_meshes(mode); }

  /// Returns true if the mode draws shadows and the light of lamps.
  [[nodiscard]] virtual bool traces_light(DrawMode mode) const {
    return mode == DrawMode::Rays || mode == DrawMode::Paths;
  }

  /// Sets the request to draw. Repeating the same request does nothing.
  virtual void show(const ViewRequest& request) = 0;

  /// Returns the newest frame if it has not been taken yet. After a change of mode no frame shows the previous mode,
  /// except marched rays that stand in for meshes.
  [[nodiscard]] virtual std::optional<ViewFrame> take() = 0;

  /// Returns true if `take` has something to draw and should be called soon. Other frames are announced by `on_frame`.
  [[nodiscard]] virtual bool wants_frames() const { return false; }

  /// Returns statistics to show, as names and values.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::string>> stats() const { return {}; }

  /// Returns the bytes held for the scene on all devices, as of the last image. Tables of a fixed size do not count.
  [[nodiscard]] virtual std::size_t bytes() const { return 0; }

  /// Returns the work that the image waits for, such as "meshing 120/480". Empty while the image is being drawn.
  [[nodiscard]] virtual std::string activity() const { return {}; }

  /// Returns the completed fraction of meshing, in [0, 1]; empty if no meshing is under way.
  [[nodiscard]] virtual std::optional<double> progress() const { return std::nullopt; }

  /// Returns true if images of the mode proved too slow for the viewer to start with.
  [[nodiscard]] virtual bool is_slow(DrawMode /*mode*/) const { return false; }

  /// Returns true if the destructor would wait for a device that is being opened or that draws; neither can be stopped.
  [[nodiscard]] virtual bool ends_late() const { return false; }

  /// Returns the error of the last request, if it failed.
  [[nodiscard]] virtual std::optional<Error> fault() = 0;

  /// Stops work in progress and waits until the scene is no longer read; it may then be edited. Returns the seconds
  /// waited.
  virtual double pause() = 0;
  /// Continues after `pause`; the scene must not be edited until the next `pause`. Redraws everything if it `changed`.
  virtual void resume(bool changed) = 0;

  /// Returns the hit at a point of an image of that size. Empty for sky and for densities, and also while an edit is
  /// being applied: then `is_up_to_date` returns false.
  [[nodiscard]] virtual std::optional<SceneHit> pick(const Camera& camera, double x, double y, int width,
                                                     int height) = 0;
  [[nodiscard]] virtual bool is_up_to_date() = 0;
  /// Calls `move_and_slide` in the scene. Empty while an edit is being applied.
  [[nodiscard]] virtual std::optional<SlideResult> slide(const OrientedBox& box, DVec3 displacement,
                                                         const SlideOptions& options) = 0;

  /// Releases the graphics device, if there is one, after it was lost.
  virtual void forget_device() {}
};

/// Pauses a backend for an edit of its scene, and resumes it at the end of the scope.
class ScenePause {
 public:
  explicit ScenePause(ViewBackend& backend) : backend_(&backend), waited_(backend.pause()) {}
  ScenePause(const ScenePause&) = delete;
  ScenePause& operator=(const ScenePause&) = delete;
  ~ScenePause() { backend_->resume(changed); }

  [[nodiscard]] double waited_seconds() const { return waited_; }
  bool changed = true;

 private:
  ViewBackend* backend_;
  double waited_;
};

}  // namespace quoin::viewer

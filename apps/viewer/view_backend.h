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
#include <quoin/light/light_options.h>
#include <quoin/render/path_history.h>
#include <quoin/render/path_tracer.h>
#include <quoin/render_vk/vulkan_mesh_renderer.h>
#include <quoin/render_vk/vulkan_picture.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/look.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_query.h>
#include <quoin/scene/sweep.h>

namespace quoin::viewer {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Lowers the priority of the calling thread and of the threads that it starts, so that threads that draw do not delay
/// the window's thread, nor the display's process. Does nothing where the system has no priority for a thread. The
/// workers of parallel loops are shared: they keep the priority of the thread that ran the first such loop.
void yield_to_window();

/// Times as long as a picture in motion should take is what lets its size be as it was: it does not go to and fro.
inline constexpr double kConstancy = 1.3;
/// What is known of a time, in seconds, after one more measurement of it; 0: nothing was known. One measurement says
/// little where other programs take their share.
[[nodiscard]] double seconds_known(double known, double measured);

/// What the scene is drawn as.
enum class DrawMode : std::uint8_t {
  Rays,     ///< a ray-marched picture
  Blocks,   ///< blocky meshes of its chunks
  Smooth,   ///< smooth meshes of its chunks
  Density,  ///< the densities of its fields on a plane, from the positive end of an axis: draw_density_slice
  Paths,    ///< paths of light, which converge while one looks: PathTracer
};

inline constexpr std::size_t kDrawModes = 5;

[[nodiscard]] inline bool has_meshes(DrawMode mode) {
  return mode == DrawMode::Blocks || mode == DrawMode::Smooth;
}

/// Where densities are cut, as DensitySliceOptions has it.
struct SlicePlace {
  int axis = 1;
  double at = 0.5;
  bool operator==(const SlicePlace&) const = default;
};

/// What the window wants to show.
struct ViewRequest {
  Camera camera;
  int width = 0;  ///< pixels; nothing is drawn unless both are positive
  int height = 0;
  LightOptions light;             ///< `smooth` is of meshes of fields and smooth ones too
  bool detail_by_pixels = false;  ///< far models in coarser cells
  bool detail_colours = false;    ///< rays: instances in colours that tell their detail
  int samples = 16;               ///< a pixel, once the picture has settled; meshes: 4, or 1 if that is wanted
  DrawMode mode = DrawMode::Rays;
  Wireframe wireframe = Wireframe::Off;  ///< of meshes
  std::shared_ptr<const FileLook> look;  ///< of paths: what the file says of them; null: nothing
  SlicePlace slice;                      ///< of densities, which know no camera and no light
  bool whole_only = false;               ///< smaller pictures are of no use in the meantime
};

/// Whether both want the same picture.
[[nodiscard]] bool is_same(const ViewRequest& a, const ViewRequest& b);

constexpr int kPathSamples = 256;  ///< of a settled picture by paths

/// How a picture by paths is taken: what the file says, in the light of the window's panel, without noise within
/// surfaces. `bounds`: of the scene.
[[nodiscard]] PathOptions path_options(const ViewRequest& request, int width, int height, int samples,
                                       const DBox& bounds);
/// And how it is developed.
[[nodiscard]] DevelopOptions develop_options(const ViewRequest& request);

/// What the pictures by paths of one request know of each other, across edits of the scene.
class PathMemory {
 public:
  /// Forgets what it knows of another request.
  PathHistory& of(const ViewRequest& request);
  void note_edit() { history_.note_edit(); }
  void clear();
  /// Whether a request may begin with a picture that so many of its pixels along each axis are one of.
  [[nodiscard]] bool may_begin(const ViewRequest& request, int divisor) const;
  /// The first of these that it may begin with; of all that are none, the first.
  [[nodiscard]] int first_divisor(const ViewRequest& request, std::span<const int> divisors) const;
  [[nodiscard]] std::size_t bytes() const { return history_.bytes(); }

 private:
  [[nodiscard]] bool is_of(const ViewRequest& request) const;

  std::optional<ViewRequest> request_;  // with the samples of a settled picture
  PathHistory history_;
};

/// An image for the last request, or for a request shortly before it.
struct ViewFrame {
  Image colour;  ///< perhaps smaller than was asked for: to be stretched
  /// Instead of `colour` where the picture stays on a graphics device. The next frame may be drawn into it.
  std::shared_ptr<const VulkanPicture> on_device;
  DrawMode mode = DrawMode::Rays;  ///< the mode that it shows; a stand-in shows another mode than the request
  int samples = 0;                 ///< a pixel
  bool is_whole = false;           ///< as large as was asked for
  bool is_settled = false;         ///< nothing better will come of this request
  double seconds = 0.0;
  std::int64_t rays = 0;
};

/// What makes the picture of a scene: the processor here, a graphics card elsewhere.
///
/// Threads: all calls come from one thread, the window's. None but `pause` ever waits for the processor's pictures;
/// those of the device that shows the window are drawn in `take`.
class ViewBackend {
 public:
  ViewBackend() = default;
  ViewBackend(const ViewBackend&) = delete;
  ViewBackend& operator=(const ViewBackend&) = delete;
  virtual ~ViewBackend() = default;

  /// For people: "processor".
  [[nodiscard]] virtual std::string name() const = 0;

  /// Whether there is a way to draw that; asked again after a fault.
  [[nodiscard]] virtual bool can_draw(DrawMode mode) const { return !has_meshes(mode); }

  /// Whether what is drawn so has shadows and the light of lamps.
  [[nodiscard]] virtual bool traces_light(DrawMode mode) const {
    return mode == DrawMode::Rays || mode == DrawMode::Paths;
  }

  /// From now on this is wanted. The same request again changes nothing.
  virtual void show(const ViewRequest& request) = 0;

  /// The newest frame, if it has not been taken yet. After a change of mode no frame shows the mode before, except
  /// marched rays that stand in for meshes.
  [[nodiscard]] virtual std::optional<ViewFrame> take() = 0;

  /// Whether `take` would have something to draw, so that it should be called soon. Other frames are told of.
  [[nodiscard]] virtual bool wants_frames() const { return false; }

  /// What people may want to know of it: names and values.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::string>> stats() const { return {}; }

  /// Bytes that are held because of the scene, on whatever device, as of the last picture; not counted are tables of a
  /// fixed size.
  [[nodiscard]] virtual std::size_t bytes() const { return 0; }

  /// For people, the work that an image waits for: "meshing 120/480". Empty: the image is being drawn.
  [[nodiscard]] virtual std::string activity() const { return {}; }

  /// The completed fraction of meshing, in [0, 1]; nothing while nothing is meshed.
  [[nodiscard]] virtual std::optional<double> progress() const { return std::nullopt; }

  /// Whether pictures of the mode turned out to take too long for anybody to want to start with them.
  [[nodiscard]] virtual bool is_slow(DrawMode /*mode*/) const { return false; }

  /// Whether its end would wait for what cannot be stopped: a device that is being opened, or that draws.
  [[nodiscard]] virtual bool ends_late() const { return false; }

  /// What went wrong with the last request, if anything.
  [[nodiscard]] virtual std::optional<Error> fault() = 0;

  /// Stops what is under way and returns once nothing reads the scene any more, which may then be edited. Returns how
  /// many seconds that took.
  virtual double pause() = 0;
  /// The scene is left alone again, until the next `pause`; everything is drawn anew if it `changed`.
  virtual void resume(bool changed) = 0;

  /// What is seen at a point of the picture that `request` asks for. Nothing where there is sky or densities are shown,
  /// and nothing while an edit is being taken over: `is_up_to_date` tells that apart.
  [[nodiscard]] virtual std::optional<SceneHit> pick(const Camera& camera, double x, double y, int width,
                                                     int height) = 0;
  [[nodiscard]] virtual bool is_up_to_date() = 0;
  /// `move_and_slide` in the scene; nothing while an edit is being taken over.
  [[nodiscard]] virtual std::optional<SlideResult> slide(const OrientedBox& box, DVec3 displacement,
                                                         const SlideOptions& options) = 0;

  /// Lets go of its graphics device, if it has one: for one that was lost.
  virtual void forget_device() {}
};

/// Edits the scene of a backend: pauses it now, and lets it go on at the end of the scope.
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

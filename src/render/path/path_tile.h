#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include <glm/common.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/hash.h>
#include <quoin/core/vec.h>
#include <quoin/render/path_tracer.h>

#include "render/light/glass_bodies.h"
#include "render/path/denoise.h"
#include "render/path/kernel/shade.h"
#include "render/path/light_tree.h"
#include "render/path/path_lamps.h"
#include "render/path/path_math.h"
#include "render/path/path_request.h"
#include "render/path/scatter.h"
#include "render/path/sky_light.h"
#include "render/shared/image_request.h"
#include "scene/surfaces.h"
#include "scene/tracer/scene_view.h"

namespace quoin::path {

/// The unit world normals of each placed grid, by face direction.
using FaceNormals = std::vector<std::array<Vec3, 6>>;
[[nodiscard]] FaceNormals face_normals(std::span<const PlacedGrid> placed);

/// The data shared by all tiles of an image.
struct TileContext {
  const SceneView* view = nullptr;
  std::span<const PlacedGrid> placed;         ///< of the view's tracer
  const FaceNormals* face_normals = nullptr;  ///< of each placed grid
  const Surfaces* surfaces = nullptr;
  const PathLamps* lamps = nullptr;
  const SkyLight* sky = nullptr;
  const CameraRays* rays = nullptr;
  const Camera* camera = nullptr;
  const PathOptions* options = nullptr;
  const Environment* environment = nullptr;
  SurfaceParts* parts = nullptr;  ///< of the image, to be filled; null: not requested
  bool has_media = false;         ///< true if there are fog or clouds
};

/// One square of an image.
///
///   begin -> [ order -> meet -> shade by sixteens -> trace shadow rays ] until no path is left -> add
///
/// All paths of some samples advance one step at a time. Paths of similar direction are adjacent, so that ray packets
/// are full and coherent. A path's result depends only on its pixel and sample.
class PathTile {
 public:
  static constexpr int kEdge = 32;  ///< pixels

  /// `column` and `row`: its upper left pixel.
  PathTile(const TileContext& context, int column, int row);

  /// Renders all samples of all pixels. Calls `goes_on(samples)` after some of them. If that returns false, this
  /// returns false and the tile must not be used.
  [[nodiscard]] bool render(const std::function<bool(std::size_t samples)>& goes_on);
  /// Writes the pixels within the image.
  void write_to(PathImage& image) const;

  [[nodiscard]] std::int64_t rays() const { return rays_; }
  [[nodiscard]] std::int64_t pixels_hit() const;

 private:
  static constexpr std::size_t kPixels = std::size_t{kEdge} * kEdge;
  static constexpr int kSamplesAtOnce = 4;
  static constexpr std::uint8_t kNoPart = 255;

  struct Path {
    Path() {}              // NOLINT: a defaulted one is cleared whole before its members are made, which takes longer
    DVec3 origin{0.0};     // start of its next ray, in view space
    Vec3 direction{0.0F};  // unit
    float density = 0.0F;  // density of the last sampled direction; infinite if no other strategy can sample it
    Vec3 throughput{1.0F};
    Vec3 radiance{0.0F};
    Vec3 normal{0.0F};  // at the last scattering
    Random random;
    std::uint32_t dimension = 0;  // the next unused dimension
    std::uint16_t pixel = 0;      // in the tile
    std::uint16_t bounces = 0;
    std::uint16_t scatterings = 0;  // in fog and clouds
    std::uint8_t part = kNoPart;    // index among the pixel's surfaces
    VoxelType inside = kAir;        // the glass around it
    std::int32_t place = 0;         // of the last scattering
    bool is_seen = true;            // by the camera, directly or through glass and mirrors
    bool is_first = true;           // no surface has been hit yet
    bool is_caught = false;         // it passed shadow-catching ground
    bool is_first_sample = false;
    bool is_noted = false;  // recorded in the layers
    std::uint8_t bin = 0;   // of its direction
  };
  // A point where a path scatters.
  struct Vertex {
    Vertex() {}  // NOLINT: as Path
    std::uint32_t path = 0;
    std::int32_t placed = 0;
    DVec3 in_grid{0.0};  // a hundredth of a voxel above the surface, so that rays start in front of it
    DVec3 in_view{0.0};  // the same point in view space
    Vec3 normal{0.0F};   // in the world, towards the path's origin
    Material material;
    std::int32_t place = 0;
    bool is_ground = false;
    bool is_medium = false;   // in the air; it has no normal
    float anisotropy = 0.0F;  // of the medium

    // Returns true without any gloss.
    [[nodiscard]] bool is_matte() const {
      return !is_medium && material.roughness >= 1.0F && material.metalness <= 0.0F;
    }
  };
  // The light that reaches a vertex if unblocked.
  struct Request {
    DVec3 origin{0.0};     // in the grid `home`
    Vec3 direction{0.0F};  // in the world
    float max_t = 0.0F;    // world units
    Vec3 light{0.0F};
    std::int32_t home = 0;
    std::uint32_t path = 0;
    std::uint32_t bin = 0;
    std::int32_t lamp = -1;  // the lamp that sends it
    std::int32_t place = 0;
    float brightness = 0.0F;  // of the lamp's light at the point
  };
  struct Interval {
    double begin = 0.0;
    double end = 0.0;
  };

  // Applies the lamp results of samples before `first`, a power of two.
  void learn(int first);
  void begin(int first, int count);
  // Returns a point of the lens, scaled to radius 1.
  [[nodiscard]] Pair on_lens(Pair u) const;
  void begin_path(std::size_t pixel, Pair jitter, int sample);
  void order_paths();
  void meet();
  void meet_packet(std::span<const std::uint32_t> paths);
  // Adds the sky's light to a path that leaves the scene towards `direction`.
  void leave(Path& path, Vec3 direction);
  // Traces a ray through glass before `t`, if the scene has glass. Returns true if the path's ray ends there.
  bool meet_glass(std::uint32_t index, double t);
  bool pass_glass(std::uint32_t index);
  // In the following, `u` is a random number between 0 and 1, which stays uniform for paths that go on.
  // Traces the scattering bodies and the faces before the first glass, and removes them from `seen_`.
  bool pass_clouds(std::uint32_t index, float& u);
  // Traces the faces up to `max_t`, from `seen_.faces[next]` on. Returns true if the path ends at one of them.
  bool pass_faces(std::uint32_t index, double max_t, std::size_t& next, float& u);
  // Scatters a path in a body if `u` is below the share of paths that scatter there.
  void scatter_in(std::uint32_t index, const GlassBody& body, float u);
  // Returns the part of a ray that lies in fog, up to `max_t`.
  [[nodiscard]] Interval in_fog(const DVec3& origin, Vec3 direction, double max_t) const;
  // Returns true if the path scatters in fog before `until`, and sets `until` to that distance.
  [[nodiscard]] bool ends_in_fog(const Path& path, double& until) const;
  void hit_air(std::uint32_t index, double t, Vec3 colour, float anisotropy, std::int32_t placed);
  bool enter_glass(std::uint32_t index, float u);
  bool leave_glass(std::uint32_t index, float u);
  void turn_at(Path& path, const DVec3& point, Vec3 direction, Vec3 normal, double lift, VoxelType inside);
  // Processes one ray of a packet that neither glass nor fog stops.
  void meet_lane(std::uint32_t index, const RayPacket& rays, const SceneHits& hits, int lane, double until);
  void hit_matter(std::uint32_t index, const RayPacket& rays, const SceneHits& hits, int lane);
  // Gives a surface the texel at a position on a voxel's face, in the grid, if its type has textures.
  __attribute__((noinline)) void show_texel(const PlacedGrid& placed, VoxelType type, Direction face,
                                            const DVec3& position, IVec3 voxel, Surface& surface) const;
  void hit_glass(std::uint32_t index, const GlassBody& body, const DVec3& normal_in_grid);
  void hit_face(std::uint32_t index, const MetFace& face);
  void hit_ground(std::uint32_t index, double t);
  [[nodiscard]] double ground_at(const DVec3& origin, Vec3 direction) const;  // infinite: nowhere
  void add_emitted(Path& path, Vec3 emitted, std::int32_t lamp, float distance) const;
  // Returns true if a ray meets a side of a shape that is a lamp.
  [[nodiscard]] bool is_lamp(const ShapeHit& hit) const;
  void note_layers(Path& path, const Vertex& vertex, double t, VoxelType type);
  // Records the surface that a path would meet without fog and clouds, which it meets at random.
  void note_behind(Path& path, const SceneHits& hits, int lane, double t);
  // Returns the part of the pixel that shows a surface. `surface`: not 0.
  [[nodiscard]] SurfacePart& part_of(const Path& path);
  void note_part(Path& path, const Vertex& vertex, std::uint32_t surface, bool is_curved);

  void shade_all();
  [[nodiscard]] bool may_scatter(const Vertex& vertex) const;
  void put_into_block(const Vertex& vertex, std::size_t lane);
  // Scatters a path, from the kernel's results in `block_`.
  void shade(const Vertex& vertex, std::size_t lane);
  // Continues a scattered path in a direction of the world.
  void go_on(const Vertex& vertex, std::size_t lane, Vec3 normal, const Scattered& next);
  [[nodiscard]] Scatter scatter_at(const Vertex& vertex, const Path& path, const Frame& frame) const;
  // Counts the current scattering, and ends the path at random. Returns true if it continues.
  [[nodiscard]] bool survives(Path& path, bool in_medium) const;
  void ask_sun(const Vertex& vertex, std::size_t lane, const Frame& frame, const Scatter& scatter);
  void ask_sky(const Vertex& vertex, const Path& path, const Frame& frame, const Scatter& scatter);
  void ask_lamp(const Vertex& vertex, std::size_t lane, const Frame& frame, const Scatter& scatter);
  // Requests a shadow ray. Returns false if no light would arrive from there.
  bool ask(const Vertex& vertex, Vec3 direction, float max_t, Vec3 light, bool is_sun);
  void trace_requests();
  // Traces the rays of requests of one placed grid, at most as many as fit into `shadow_packets_`.
  void trace_some_requests(std::span<const std::uint32_t> requests);
  // Uses the results of a packet of requests.
  void finish_requests(std::span<const std::uint32_t> requests, RayPacket& rays, std::uint32_t blocked);

  const TileContext* context_;
  int column_;
  int row_;
  double ground_ = 0.0;   // height in view space
  double fog_top_ = 0.0;  // the top of the fog
  std::int64_t rays_ = 0;
  const Kernel* kernel_;
  ShadeLight light_;
  bool has_textures_or_lamps_;  // one check per hit for both
  ShadeBlock block_;
  LampMemory memory_;
  std::vector<std::uint32_t> pixels_;  // hashes for Random
  std::vector<Path> paths_;
  std::vector<std::uint32_t> active_, next_;
  std::vector<Vertex> vertices_;
  std::vector<Request> requests_;
  std::vector<std::uint32_t> order_;
  std::vector<std::uint32_t> starts_;  // of counting sorts
  SeenThrough seen_;                   // of the current ray
  RayPacket packet_;                   // of `meet_packet`
  static constexpr std::size_t kShadowPackets = 16;
  std::vector<RayPacket> shadow_packets_;
  SceneHits hits_;
  std::vector<PixelSums> sums_;
};

// Shared by the two halves of PathTile: path_tile.cpp has surfaces and light, path_tile_media.cpp has glass, fog and
// clouds.

inline constexpr double kInfinite = std::numeric_limits<double>::infinity();
inline constexpr float kNoOther = std::numeric_limits<float>::infinity();  // a density without an alternative strategy
inline constexpr std::uint32_t kDimensions = 8;                            // per vertex
inline constexpr std::uint32_t kFog = 0x4000'0000;  // added to a vertex's dimensions for separate random numbers
inline constexpr std::uint32_t kFade = 0x5000'0000;
inline constexpr std::uint32_t kGroundSurface = 2;  // distinct from all results of surface_id

// Returns a direction's bin, below kBins.
inline std::uint32_t bin_of(Vec3 direction) {
  const Vec3 size = glm::abs(direction);
  const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
  const float scale = 2.0F / std::max(size[axis], 1e-20F);
  const auto step = [&](float v) {
    return static_cast<std::uint32_t>(std::clamp(static_cast<int>(v * scale + 2.0F), 0, 3));
  };
  const std::uint32_t side = direction[axis] < 0.0F ? 1U : 0U;
  return 1 + (static_cast<std::uint32_t>(axis) * 2 + side) * 16 + step(direction[(axis + 1) % 3]) * 4 +
         step(direction[(axis + 2) % 3]);
}

// Makes a random number that is at least `cover` uniform between 0 and 1 again.
inline float rest_of(float u, float cover) {
  return std::min((u - cover) / (1.0F - cover), 0x1.fffffep-1F);
}

inline Vec3 tint_of(const Surface& surface, double voxels) {
  const auto length = static_cast<float>(voxels);
  if (!(length > 0.0F)) return Vec3(1.0F);
  Vec3 tint;
  for (int i = 0; i < 3; ++i) {
    // Glass with full coverage transmits no light: the difference of infinities would be NaN.
    const float log = surface.log_clarity > -kNoOther ? surface.log_transmittance[i] - surface.log_clarity : 0.0F;
    tint[i] = exponential(log * length);
  }
  return tint;
}

inline float cover_of(const Surface& surface, double voxels) {
  return voxels > 0.0 ? 1.0F - exponential(surface.log_clarity * static_cast<float>(voxels)) : 0.0F;
}

// Returns a body's length; at least one voxel if its edges must be crisp.
inline double length_of(const Surface& surface, const GlassBody& body) {
  const bool is_soft = body.starts_inside || body.in_field || surface.scattering > 0.0F;
  return std::max(body.voxels, is_soft ? 0.0 : 1.0);
}

// Returns an id for the plane of a voxel's face, or for a field, of one grid and type; odd.
inline std::uint32_t surface_id(IVec3 voxel, Direction face, bool in_field, std::int32_t placed, VoxelType type) {
  const auto plane = in_field ? 0U : static_cast<std::uint32_t>(voxel[frame_of(face).axis]);
  std::uint32_t id = mix_bits(plane ^ (in_field ? 6U : static_cast<std::uint32_t>(face)) << 28);
  id = mix_bits(id ^ static_cast<std::uint32_t>(placed));
  return mix_bits(id ^ static_cast<std::uint32_t>(type)) | 1U;
}

// Returns a free path length in a medium that scatters `density` times per unit length on average.
inline double free_way(float u, double density) {
  QUOIN_ASSERT(u >= 0.0F && u < 1.0F && density > 0.0, "0 <= u < 1, and a positive density");
  return -static_cast<double>(log_of_two(1.0F - u)) * std::numbers::ln2 / density;
}

}  // namespace quoin::path

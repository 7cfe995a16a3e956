#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <glm/mat3x3.hpp>

#include <quoin/render/vulkan_mesh_renderer.h>
#include <quoin/scene/camera.h>

#include "render/vulkan/march/shader_scene.h"
#include "render/vulkan/raster/mesh_shader_data.h"
#include "render/vulkan/raster/mesh_store.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::vulkan {

/// An impostor in device memory, for one instance.
struct MeshImpostor {
  /// The rectangles of a level.
  struct Part {
    ShaderFarLevel faces;                  ///< count 0: none
    std::array<std::uint32_t, 7> begin{};  ///< start of each direction; end of the last
    bool is_coarser = false;
  };
  std::vector<Part> parts;              ///< the drawn levels
  std::uint32_t coarser = 0;            ///< the number of pixels, of 2^24, that show the coarser level
  std::array<std::uint32_t, 4> near{};  ///< as in ShaderFar
  std::uint64_t faces = 0;              ///< address
  DVec3 centre{0.0};                    ///< of the content, in the grid
  double radius = 0.0;                  ///< of the content, voxels: no face is farther away
};

/// An instance whose meshes are drawn.
struct MeshInstance {
  InstanceHandle handle;
  MeshKey mesh;
  glm::dmat3 world_axes{1.0};  ///< as in PlacedGrid
  DVec3 position{0.0};
  DVec3 pivot{0.0};  ///< in the coordinates of the mesh's grid, which may be halved
  double voxel_size = 1.0;
  bool mirrored = false;
  std::int32_t placed = -1;  ///< index among the frame's placed grids; -1: not placed
  IVec3 origin{0};           ///< of its tree's coordinates
  bool is_far = false;       ///< only the transparent parts of its own meshes are drawn
  bool shows_means = false;  ///< of textures, as halved grids and impostors do
  MeshImpostor impostor;     ///< of a far instance, if visible
};

/// A chunk of an instance in the image.
struct MeshDraw {
  const StoredMesh* mesh = nullptr;
  std::uint32_t instance = 0;  ///< index into MeshFrameData::instances
  Vec3 offset{0.0F};           ///< of the chunk, from its instance's reference point
  double distance = 0.0;       ///< of its middle, in world units; orthographic: along the view
  std::uint8_t faces = 0;      ///< the directions, as bits, of faces that the camera can see
  bool mirrored = false;
  bool is_far = false;  ///< only transparent parts are drawn
};

/// Half-open ranges of a chunk's quads or an impostor's faces.
using QuadRuns = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Faces of an impostor in the image.
struct FarDraw {
  ShaderFarLevel level;
  QuadRuns runs;  ///< faces in directions that the camera may see
  std::uint64_t faces = 0;
  std::uint32_t instance = 0;
  Vec3 offset{0.0F};          ///< of the content's centre
  std::uint32_t numbers = 0;  ///< of ShaderMeshPush: the share of the pixels
  double distance = 0.0;
};

/// Returns the quads of a blocky chunk that face the camera, as far as directions decide; all transparent quads or
/// none.
[[nodiscard]] QuadRuns visible_quads(const MeshDraw& draw, bool with_glass);

/// The faces of transparent types that hide the background, where their texels are visible: cutout and opaque ones.
struct SolidFaces {
  std::vector<std::uint8_t> by_type;  ///< a bit per direction; empty if no transparent type has textures
  bool has_any = false;

  [[nodiscard]] static SolidFaces of(const VoxelRegistry& types);
  /// Returns true if a type that is transparent has other faces.
  [[nodiscard]] bool leaves_glass(VoxelType type) const {
    constexpr std::uint8_t kAll = 63;
    return type >= by_type.size() || by_type[type] != kAll;
  }
  [[nodiscard]] bool contains(VoxelType type, std::size_t face) const {
    return type < by_type.size() && (by_type[type] >> face & 1U) != 0;
  }
  [[nodiscard]] bool contains(const Quad& quad) const {
    if (quad.type() >= by_type.size() || by_type[quad.type()] == 0) return false;
    return contains(quad.type(), static_cast<std::size_t>(quad.orientation().inverse().apply(quad.direction())));
  }
};

/// The data for drawing one image, without memory addresses.
struct MeshFrameData {
  FrameData image;  ///< the rays' content, and light
  ShaderMeshFrame frame;
  ShaderMeshPush push;  ///< the constants shared by all draws
  ShaderMeshPush sky;
  std::vector<ShaderMeshInstance> instances;
  std::vector<MeshDraw> draws;  ///< the nearest first
  std::vector<FarDraw> far;     ///< of the far instances, in the same form
  /// Transparent quads and faces of shapes, farthest first, by their centres. Empty if there are more than
  /// `kMaxOrdered`, or if rays find transparent surfaces: chunks are then drawn in their order, each with its quads in
  /// stored order.
  std::vector<ShaderGlassQuad> order;
  std::vector<ShaderGlassDraw> glass;  ///< the draws that `order` refers to
  std::vector<ShaderLamp> lamps;
  std::size_t glass_quads = 0;  ///< and faces of shapes
  bool has_shape_glass = false;
  bool has_smooth_glass = false;
  bool has_fields = false;          ///< among the placed content
  bool has_shapes = false;          ///< among the placed content
  bool has_cells = false;           ///< transparent types with textures are among it
  bool has_textures = false;        ///< colours are shown, and types have textures
  bool has_type_textures = false;   ///< types have textures
  bool has_cutouts = false;         ///< quads of transparent types have textures that hide the background
  bool has_textured_glass = false;  ///< transparent types have textures
  bool glass_by_rays = false;  ///< only the nearest glass of a pixel is drawn, including everything visible through it

  [[nodiscard]] bool has(std::uint32_t flag) const { return (image.frame.flags & flag) != 0; }
  /// Returns the number of triangles drawn.
  [[nodiscard]] std::int64_t triangles() const;
};

constexpr std::size_t kMaxOrdered = std::size_t{1} << 20;

/// Makes all positions relative to the camera, in double precision. Each instance then uses a chunk corner near the
/// camera as its origin, so that a corner shared by chunks has the same coordinates in each of them.
///
/// Depth: reversed, 1 at the near plane. The near plane lies at the nearest chunk in the image, but at least 1/1024 of
///        the smallest voxel away. Perspective has no far plane; the orthographic far plane lies behind the last
///        chunk.
/// `subpixels`: the device's subpixel positions per pixel and axis.
/// `glass_by_rays`: as in the result; if values are shown, glass is drawn like opaque surfaces.
/// `solid`: faces that are not glass.
/// The caller fills in `image`. Requires: `check` accepts the camera and the options.
/// Errors: InvalidArgument for a camera whose axes lie in one plane.
/// Cost: O(chunks of the instances), and sorting the visible chunks and the transparent quads.
[[nodiscard]] Result<MeshFrameData> make_mesh_frame(MeshStore& store, std::span<const MeshInstance> instances,
                                                    const Camera& camera, const RenderOptions& options, int subpixels,
                                                    bool glass_by_rays, const SolidFaces& solid);

}  // namespace quoin::vulkan

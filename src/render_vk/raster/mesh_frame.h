#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <glm/mat3x3.hpp>

#include <quoin/render_vk/vulkan_mesh_renderer.h>
#include <quoin/scene/camera.h>

#include "render_vk/march/frame.h"
#include "render_vk/raster/mesh_shader_data.h"
#include "render_vk/raster/mesh_store.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::vulkan {

/// An impostor in device memory, as one instance shows it.
struct MeshImpostor {
  /// The rectangles of a level.
  struct Part {
    ShaderFarLevel faces;                  ///< count 0: none
    std::array<std::uint32_t, 7> begin{};  ///< of each direction; the end of the last
    bool is_coarser = false;
  };
  std::vector<Part> parts;              ///< the levels that are drawn
  std::uint32_t coarser = 0;            ///< the number of pixels, of 2^24, that show the coarser level
  std::array<std::uint32_t, 4> near{};  ///< as ShaderFar
  std::uint64_t faces = 0;              ///< address
  DVec3 centre{0.0};                    ///< of the content, in the grid
  double radius = 0.0;                  ///< of the content, voxels: no face lies further away
};

/// An instance whose meshes are drawn.
struct MeshInstance {
  InstanceHandle handle;
  MeshKey mesh;
  glm::dmat3 world_axes{1.0};  ///< as PlacedGrid's
  DVec3 position{0.0};
  DVec3 pivot{0.0};  ///< in the coordinates of the mesh's grid, which may be a halved one
  double voxel_size = 1.0;
  bool mirrored = false;
  std::int32_t placed = -1;  ///< among what the frame's rays meet; -1: it is not there
  IVec3 origin{0};           ///< of its tree's coordinates
  bool is_far = false;       ///< of its own meshes only what is transparent is drawn
  MeshImpostor impostor;     ///< of a far one, if it shows
};

/// A chunk of an instance that is in the picture.
struct MeshDraw {
  const StoredMesh* mesh = nullptr;
  std::uint32_t instance = 0;  ///< index into MeshFrameData::instances
  Vec3 offset{0.0F};           ///< of the chunk, from where its instance is counted
  double distance = 0.0;       ///< of its middle, in world units; orthographic: along the view
  std::uint8_t faces = 0;      ///< the directions, as bits, of which the camera can see any
  bool mirrored = false;
  bool is_far = false;  ///< only what is transparent
};

/// Runs of a chunk's quads, or of an impostor's faces, each from one number to before the next.
using QuadRuns = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Faces of an impostor that are in the picture.
struct FarDraw {
  ShaderFarLevel level;
  QuadRuns runs;  ///< of its faces, those whose direction the camera may see
  std::uint64_t faces = 0;
  std::uint32_t instance = 0;
  Vec3 offset{0.0F};          ///< of the content's centre
  std::uint32_t numbers = 0;  ///< of ShaderMeshPush: the share of the pixels
  double distance = 0.0;
};

/// Those of a blocky chunk that face the camera, as far as can be told by directions; the transparent ones all, if
/// at all.
[[nodiscard]] QuadRuns visible_quads(const MeshDraw& draw, bool with_glass);

/// What drawing one picture takes, but for where things lie in memory.
struct MeshFrameData {
  FrameData picture;  ///< what rays meet, and light
  ShaderMeshFrame frame;
  ShaderMeshPush push;  ///< what all draws have in common
  ShaderMeshPush sky;
  std::vector<ShaderMeshInstance> instances;
  std::vector<MeshDraw> draws;  ///< the nearest first
  std::vector<FarDraw> far;     ///< likewise
  /// Transparent quads, the furthest first, by their middles; empty when there are more than `kMaxOrdered`, or rays
  /// find what is transparent: then chunks are drawn in their order, and the quads of each as they come.
  std::vector<ShaderGlassQuad> order;
  std::vector<ShaderGlassDraw> glass;  ///< what `order` names
  std::vector<ShaderLamp> lamps;
  std::size_t glass_quads = 0;
  bool has_smooth_glass = false;
  bool has_fields = false;     ///< among what rays meet
  bool glass_by_rays = false;  ///< only the nearest glass of a pixel is drawn, with all that is seen through it

  [[nodiscard]] bool has(std::uint32_t flag) const { return (picture.frame.flags & flag) != 0; }
  /// Of the surfaces that are drawn.
  [[nodiscard]] std::int64_t triangles() const;
};

constexpr std::size_t kMaxOrdered = std::size_t{1} << 20;

/// All that is in the world is made relative to the camera here, in double precision; then each instance is counted
/// from a corner of a chunk near the camera, so that a corner that chunks share is the same number in each of them.
///
/// Depth: reversed, 1 at the near plane. It lies at the nearest chunk in the picture, but not nearer than 1/1024 of the
///        smallest voxel; perspective has no far plane, orthographic pictures' lies behind the last chunk.
/// `subpixels`: in how many places per pixel and axis a device tells corners apart.
/// `glass_by_rays`: as the result has it; where values are shown glass is drawn like anything else.
/// `picture` is left to the caller. Requires: `check` accepts the camera and the options.
/// Errors:   InvalidArgument for a camera whose axes lie in one plane.
/// Cost:     O(chunks of the instances), and sorting those in the picture and the transparent quads.
[[nodiscard]] Result<MeshFrameData> make_mesh_frame(MeshStore& store, std::span<const MeshInstance> instances,
                                                    const Camera& camera, const RenderOptions& options, int subpixels,
                                                    bool glass_by_rays);

}  // namespace quoin::vulkan

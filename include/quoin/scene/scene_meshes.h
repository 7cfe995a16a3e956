#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <glm/mat4x4.hpp>

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/array_surface.h>
#include <quoin/mesh/mesh_view.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// A similarity transform: scale, rotation, translation, and perhaps a reflection.
struct Similarity {
  DVec3 position{0.0};
  DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< of any length but 0
  double scale = 1.0;                  ///< positive
  bool mirrored = false;               ///< x is negated before the rotation
  bool operator==(const Similarity&) const = default;
};

/// From a time on, whether a placement is shown, and where.
struct MeshKey {
  double seconds = 0.0;
  bool visible = true;
  Similarity world_from_part{};
};

/// A group of placements and other groups: SceneGroup, as files of meshes have it.
struct MeshGroup {
  std::string name{};
  std::optional<std::size_t> parent{};  ///< index into SceneMeshes::groups, of one before it
  std::string layer{};                  ///< the name of its layer
  Similarity world_from_group{};        ///< without a scale
};

/// One place of a part in the world.
struct MeshPlacement {
  std::size_t part = 0;  ///< index into SceneMeshes::parts
  std::string name{};    ///< empty: that of the part
  /// Takes points of the part, relative to its pivot, to the world. A matrix must be affine; a negative determinant
  /// mirrors.
  std::variant<Similarity, glm::dmat4> world_from_part{Similarity{}};
  std::optional<std::size_t> group{};        ///< index into SceneMeshes::groups; nothing at the top
  std::string layer{};                       ///< the name of its layer
  std::optional<InstanceHandle> instance{};  ///< of the scene that was meshed
  /// What it does while time goes by (SceneAnimation), by ascending seconds from 0; none: it stands. Each mirrors as
  /// `world_from_part` does.
  std::vector<MeshKey> keys{};

  [[nodiscard]] glm::dmat4 matrix() const;
};

/// How far it is through a part's bodies of a transparent type, straight in from their faces: the median, by area.
struct GlassThickness {
  VoxelType type = kAir;
  float voxels = 1.0F;
};

/// A body that is placed as one, any number of times.
struct MeshPart {
  std::string name;
  std::vector<MeshView> surfaces{};  ///< all of one kind; may be none
  DVec3 pivot{0.0};                  ///< the point that placements take to their translation
  /// Of the arrays of `surfaces`. Lifetime: they live as long as it does; where it is null they must outlive the part.
  std::shared_ptr<const void> owner{};
  /// By type, of blocks: files have one alpha a type, for bodies of that thickness. For types without, and for smooth
  /// surfaces, they are taken from the volume where the surface is closed, and else as one voxel thick.
  std::vector<GlassThickness> thickness{};
};

/// A part that owns its mesh. Surfaces without a triangle are left out.
[[nodiscard]] MeshPart mesh_part(std::string name, BlockyMesh mesh, const DVec3& pivot = DVec3(0.0));
[[nodiscard]] MeshPart mesh_part(std::string name, SmoothMesh mesh, const DVec3& pivot = DVec3(0.0));
/// A surface from an array, or of one label (`surface_of_label`), all of one colour. Where `surface_from_array` was
/// given spacing and origin, its places are those of the world.
///
///   meshes.parts.push_back(mesh_part("bone", std::move(*surface), {230, 220, 200}));
///   meshes.placements.push_back({.part = 0});
[[nodiscard]] MeshPart mesh_part(std::string name, ArraySurface surface, Rgba8 colour, const DVec3& pivot = DVec3(0.0));

/// What was counted while meshing; a part that is placed several times counts once.
struct MeshStats {
  std::int64_t faces_visible = 0;  ///< of blocks
  std::int64_t faces_total = 0;    ///< of blocks
  std::int64_t quads = 0;          ///< of blocks
  std::int64_t triangles = 0;
  std::int64_t vertices = 0;
  std::int64_t solid_samples = 0;    ///< of a volume
  float simplify_error = 0.0F;       ///< the largest that was reached, in voxels or samples
  std::int64_t simplified_away = 0;  ///< triangles that simplifying removed
};

/// A camera of a file of meshes.
struct MeshCamera {
  std::string name{};
  Camera camera{};
};

/// Meshes and where they stand: what files of meshes are written from, whoever made them.
struct SceneMeshes {
  std::vector<MeshPart> parts;
  std::vector<MeshPlacement> placements;
  std::vector<MeshGroup> groups{};    ///< parents first; of scenes those with a placement below
  VoxelRegistry types;                ///< the materials of blocks and of smooth surfaces with MeshView::types
  double seconds = 0.0;               ///< how long its placements' keys take; 0 without any
  Image atlas{};                      ///< what MeshView::atlas points into, colours times occlusion; perhaps empty
  std::vector<Lamp> lamps{};          ///< to be written too, where the format has lamps; mesh_scene leaves it empty
  std::vector<MeshCamera> cameras{};  ///< to be written too, where the format has cameras
  MeshStats stats;
};

struct BlockySceneOptions {
  BlockyMeshOptions mesh{};
  InstanceFilter instances = InstanceFilter::Visible;  ///< that count as drawn
  /// Whether the colours and occlusion of opaque blocks that emit nothing go into a texture, SceneMeshes::atlas. Faces
  /// then merge across their occlusion, which leaves about a third fewer triangles. A linear filter shades each voxel's
  /// face between its four corners as a saddle, where two triangles have an edge.
  bool atlas = false;
  /// As BlockyMeshOptions::cut, of each grid; instead of that of `mesh`.
  std::function<void(GridHandle grid, IVec3 chunk, QuadBuffer& quads)> cut{};
  /// If given, makes the surfaces of a grid instead of build_blocky_mesh; its name is not read, and its pivot is
  /// added to that of the grid. Adds their numbers to `stats`: for grids that are too large for memory (mesh_world).
  /// Not for an atlas.
  std::function<Result<MeshPart>(GridHandle grid, MeshStats& stats)> part_of{};
};

/// Meshes every grid that a drawn instance places, once, as build_blocky_mesh does. Parts are in the order of the
/// grids' handles, a placement per drawn instance in that of theirs, under the groups of the scene. After
/// these come the surfaces of the grids' fields, as build_smooth_mesh makes them, with placements of their own.
///
/// Far:    vertices are floats: of grids beyond 2^16 voxels mesh near_grids(scene).
/// Order:  the same bytes at any thread count.
/// Errors: those of build_blocky_mesh; InvalidArgument when a drawn instance's transform is not finite or its voxel
///         size not positive, and for an atlas of faces that are not merged, cut, watertight or without occlusion;
///         LimitExceeded when an atlas of 16,384 texels a side does not hold them, or
///         voxels of it lie beyond 2^24; Cancelled when `progress` says so.
[[nodiscard]] Result<SceneMeshes> mesh_scene(const Scene& scene, const BlockySceneOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});

/// How voxels become smooth surfaces unless told otherwise: colours as sharp as the voxels', thin things kept.
[[nodiscard]] SmoothMeshOptions smooth_voxels();

struct SmoothSceneOptions {
  /// Of voxels; of fields occlusion, `split_sheets` and `level_of` alone. Where voxels have transparent types, or
  /// instances are united, all is of level 0.
  SmoothMeshOptions mesh = smooth_voxels();
  std::optional<float> simplify_error{};  ///< in voxels, as simplify_smooth_mesh has it; without, nothing is simplified
  InstanceFilter instances = InstanceFilter::Visible;  ///< that count as drawn
  /// Whether instances whose voxels lie on one lattice and touch are one body: without seams, grooves and slits
  /// between them. Such instances have a part each then, even of one grid.
  bool unite = true;
};

/// Meshes what drawn instances place with smooth surfaces around the voxels, as field_from_grid and build_smooth_mesh
/// make them; then the surfaces of the grids' fields.
///
/// Parts:  a grid whose instances are alone is one part, in the order of the grids' handles; then follow the instances
///         that were united, each with what of the surface is its own voxels', in the order of their groups and of
///         their handles. Where several have a voxel, it is the last one's. Vertices between two parts are the same in
///         both. Placements are in the order of their parts; what has no surface is left out.
/// Bodies: all opaque voxels of a part are one surface, each transparent type is a closed one of its own, all of these
///         in one view. In a cell that several share, their vertices are the same, but where a body touches itself by
///         edges and with `simplify_error`: each body is simplified by itself. Transparent voxels occlude no others.
/// Types:  MeshView::types of every vertex, in the scene's types.
/// Cost:   what touches is found by boxes: O(n log n + pairs that overlap along one axis) of instances. Each
///         transparent type is meshed for itself, in the chunks that have it and those around them.
/// Errors: also those of build_smooth_mesh and simplify_smooth_mesh.
[[nodiscard]] Result<SceneMeshes> mesh_scene_smoothly(const Scene& scene, const SmoothSceneOptions& options = {},
                                                      Threads threads = {}, const Progress& progress = {});

struct VolumeMeshOptions {
  float iso = 0.0F;  ///< solid where values are above
  SmoothMeshOptions mesh{};
  std::optional<float> simplify_error{};  ///< in samples
  Rgba8 colour{180, 176, 168, 255};
};

/// The surface of a volume, as field_from_volume and build_smooth_mesh find it: one part, named as the volume and
/// placed where it says, in its units; none when there is no surface. Errors: theirs, and those of
/// simplify_smooth_mesh.
[[nodiscard]] Result<SceneMeshes> mesh_volume(const Volume& volume, const VolumeMeshOptions& options = {},
                                              Threads threads = {}, const Progress& progress = {});

}  // namespace quoin

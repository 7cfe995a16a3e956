#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <glm/mat4x4.hpp>

#include <quoin/core/function_ref.h>
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

namespace [[gnu::visibility("default")]] quoin {

/// A similarity transform: uniform scale, rotation, translation, and an optional reflection.
struct Similarity {
  DVec3 position{0.0};
  DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< any non-zero length
  double scale = 1.0;                  ///< positive
  bool mirrored = false;               ///< x is negated before the rotation
  bool operator==(const Similarity&) const = default;
};

/// An animation key: sets the visibility and transform of a placement from a time on.
struct MeshKey {
  double seconds = 0.0;
  bool visible = true;
  Similarity world_from_part{};
};

/// A group of placements and other groups in a mesh file; corresponds to SceneGroup.
struct MeshGroup {
  std::string name{};
  std::optional<std::size_t> parent{};  ///< index into SceneMeshes::groups of an earlier group
  std::string layer{};                  ///< layer name
  Similarity world_from_group{};        ///< has no scale
};

/// One placement of a part in the world.
struct MeshPlacement {
  std::size_t part = 0;  ///< index into SceneMeshes::parts
  std::string name{};    ///< empty: the part's name
  /// Transforms points relative to the part's pivot to the world. A matrix must be affine; a negative determinant
  /// mirrors.
  std::variant<Similarity, glm::dmat4> world_from_part{Similarity{}};
  std::optional<std::size_t> group{};        ///< index into SceneMeshes::groups; nullopt: top level
  std::string layer{};                       ///< layer name
  std::optional<InstanceHandle> instance{};  ///< the source instance in the meshed scene
  /// Animation keys (SceneAnimation) with ascending times in seconds, from 0; empty: not animated. All keys mirror, or
  /// none do, as `world_from_part`.
  std::vector<MeshKey> keys{};

  [[nodiscard]] glm::dmat4 matrix() const;
};

/// The area-weighted median thickness of a transparent type in a part, measured from its faces along their normals.
struct GlassThickness {
  VoxelType type = kAir;
  float voxels = 1.0F;
};

/// A mesh that may be placed any number of times.
struct MeshPart {
  std::string name;
  std::vector<MeshView> surfaces{};  ///< all of one kind; may be empty
  DVec3 pivot{0.0};                  ///< the point that placements move to their translation
  /// Keeps the arrays behind `surfaces` alive. If null, the arrays must outlive the part.
  std::shared_ptr<const void> owner{};
  /// Thickness per type, for blocks: files store one alpha per type, for bodies of this thickness. For smooth surfaces
  /// and for types without an entry, writers compute the thickness from the volume of a closed surface, or else assume
  /// one voxel.
  std::vector<GlassThickness> thickness{};
};

/// Returns a part that owns its mesh. Drops surfaces without triangles.
[[nodiscard]] MeshPart mesh_part(std::string name, BlockyMesh mesh, const DVec3& pivot = DVec3(0.0));
[[nodiscard]] MeshPart mesh_part(std::string name, SmoothMesh mesh, const DVec3& pivot = DVec3(0.0));
/// Returns a part of one colour from an array's surface or from one label's surface (`surface_of_label`). If
/// `surface_from_array` got a spacing and origin, the positions are in world space.
///
///   meshes.parts.push_back(mesh_part("bone", std::move(*surface), {230, 220, 200}));
///   meshes.placements.push_back({.part = 0});
[[nodiscard]] MeshPart mesh_part(std::string name, ArraySurface surface, Rgba8 colour, const DVec3& pivot = DVec3(0.0));

/// Returns the thickness of the bodies of each transparent type, by type: MeshPart::thickness of blocks. Measures
/// straight inwards from the middle of each triangle of a grid's surfaces, at most 1,024 voxels deep. `type_at`: the
/// grid's voxels, in the coordinates of the surfaces. Cost: one lookup per voxel behind the middle of a triangle.
[[nodiscard]] std::vector<GlassThickness> glass_thickness(const FunctionRef<VoxelType(IVec3)>& type_at,
                                                          std::span<const MeshView> surfaces);

/// Meshing statistics; a part that is placed several times counts once.
struct MeshStats {
  std::int64_t faces_visible = 0;  ///< of blocks
  std::int64_t faces_total = 0;    ///< of blocks
  std::int64_t quads = 0;          ///< of blocks
  std::int64_t triangles = 0;
  std::int64_t vertices = 0;
  std::int64_t solid_samples = 0;    ///< for a volume
  float simplify_error = 0.0F;       ///< largest simplification error, in voxels or samples
  std::int64_t simplified_away = 0;  ///< number of triangles removed by simplification
};

/// A camera in a mesh file.
struct MeshCamera {
  std::string name{};
  Camera camera{};
};

/// Meshes and their placements: the input of all mesh file writers.
struct SceneMeshes {
  std::vector<MeshPart> parts;
  std::vector<MeshPlacement> placements;
  std::vector<MeshGroup> groups{};  ///< parents first; from a scene, only groups with a placement below them
  VoxelRegistry types;              ///< the materials of blocks and of smooth surfaces with MeshView::types
  double seconds = 0.0;             ///< duration of the animation; 0 without keys
  Image atlas{};                    ///< the texture that MeshView::atlas indexes: colours times occlusion; may be empty
  std::vector<Lamp> lamps{};        ///< written if the format has lamps; mesh_scene leaves it empty
  std::vector<MeshCamera> cameras{};  ///< written if the format has cameras
  MeshStats stats;
};

struct BlockySceneOptions {
  BlockyMeshOptions mesh{};
  InstanceFilter instances = InstanceFilter::Visible;  ///< the instances to mesh
  /// Stores colours and occlusion of opaque, non-emissive blocks in a texture, SceneMeshes::atlas. Faces then merge
  /// across occlusion changes, which saves about a third of the triangles. With linear filtering, each voxel face is
  /// shaded bilinearly between its four corners, without a visible diagonal edge.
  ///
  /// If the scene has types with textures, splits their faces into those of voxels instead, so that a file can have all
  /// textures in one image (MeshFileOptions::textures_in). Occlusion then stays at the vertices.
  bool atlas = false;
  /// BlockyMeshOptions::cut for each grid; replaces the one in `mesh`.
  std::function<void(GridHandle grid, IVec3 chunk, QuadBuffer& quads)> cut{};
  /// If set, makes the surfaces of a grid instead of build_blocky_mesh, and adds to `stats`. For grids that do not fit
  /// in memory (mesh_world). The name is ignored and the pivot is added to the grid's pivot. Not available with
  /// `atlas`.
  std::function<Result<MeshPart>(GridHandle grid, MeshStats& stats)> part_of{};
};

/// Meshes each grid that a drawn instance places, once per grid, with build_blocky_mesh. Parts are in the order of the
/// grid handles. There is one placement per drawn instance, in handle order, under the groups of the scene. The
/// surfaces of the grids' fields (build_smooth_mesh) follow, with their own placements.
///
/// Far:    vertices are floats; for grids beyond 2^16 voxels, mesh near_grids(scene).
/// Order:  the same bytes at any thread count.
/// Errors: those of build_blocky_mesh; InvalidArgument if a drawn instance's transform is not finite or its voxel size
///         is not positive; InvalidArgument for `atlas` with unmerged, cut or watertight faces, or without occlusion;
///         LimitExceeded if the faces do not fit in an atlas of 16,384 x 16,384 texels, or atlas voxels lie beyond
///         2^24; Cancelled if `progress` returns false.
[[nodiscard]] Result<SceneMeshes> mesh_scene(const Scene& scene, const BlockySceneOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});

/// Returns the default options for smooth surfaces around voxels: colours as sharp as the voxels, thin features kept.
[[nodiscard]] SmoothMeshOptions smooth_voxels();

struct SmoothSceneOptions {
  /// Options for voxels. Fields use only occlusion, `split_sheets` and `level_of`. With transparent types or united
  /// instances, every chunk is meshed at level 0.
  SmoothMeshOptions mesh = smooth_voxels();
  std::optional<float> simplify_error{};  ///< as in simplify_smooth_mesh, in voxels; nullopt: no simplification
  InstanceFilter instances = InstanceFilter::Visible;  ///< the instances to mesh
  /// Joins instances that touch and share one voxel lattice into one body, without seams, grooves or slits between
  /// them. Each such instance becomes its own part, even if instances share a grid.
  bool unite = true;
};

/// Meshes drawn instances with smooth surfaces around the voxels (field_from_grid, build_smooth_mesh), then the
/// surfaces of the grids' fields.
///
/// Parts:  a grid whose instances touch no others is one part, in the order of the grid handles. United instances
///         follow, ordered by group and handle. Each contains the surface of its own voxels; a voxel in several
///         instances belongs to the last one. Vertices on the border of two parts are identical in both. Placements are
///         in the order of their parts; parts without a surface are left out.
/// Bodies: all opaque voxels of a part form one surface, and each transparent type forms a closed surface; all are in
///         one view. Bodies that share a cell share its vertices, except where a body touches itself along edges, and
///         except with `simplify_error`, which simplifies each body separately. Transparent voxels cast no occlusion on
///         others.
/// Types:  MeshView::types for every vertex, in the scene's types.
/// Cost:   finds touching instances by their boxes: O(n log n + pairs that overlap along one axis). Each transparent
///         type is meshed separately, in its own chunks and their neighbours.
/// Errors: those of mesh_scene, build_smooth_mesh and simplify_smooth_mesh.
[[nodiscard]] Result<SceneMeshes> mesh_scene_smoothly(const Scene& scene, const SmoothSceneOptions& options = {},
                                                      Threads threads = {}, const Progress& progress = {});

struct VolumeMeshOptions {
  float iso = 0.0F;  ///< values above are solid
  SmoothMeshOptions mesh{};
  std::optional<float> simplify_error{};  ///< in samples
  Rgba8 colour{180, 176, 168, 255};
};

/// Meshes the surface of a volume with field_from_volume and build_smooth_mesh. The result has one part, with the
/// volume's name, position and units, or none if there is no surface. Errors: those of both functions and of
/// simplify_smooth_mesh.
[[nodiscard]] Result<SceneMeshes> mesh_volume(const Volume& volume, const VolumeMeshOptions& options = {},
                                              Threads threads = {}, const Progress& progress = {});

/// The range around a grid's origin, in voxels, in which float vertices resolve 1/128 voxel.
inline constexpr int kNearVoxels = 1 << 16;

/// Returns a snapshot whose grids lie near their own origins. Use it before meshing, because mesh vertices are floats:
/// at 20,000,000 voxels, neighbouring floats are 2 apart. The snapshot shows the same voxels and densities at the same
/// world positions.
///
/// Grids within kNearVoxels of their origin stay as they are. In other grids, chunks and pivot move towards the origin
/// by whole chunks. Groups of chunks that are far apart become separate grids ("pieces"), placed by copies of the
/// instances. The first piece keeps the handles of the grid and its instances; further pieces get new handles.
///
///   const Scene near = near_grids(scene);
///   auto meshes = mesh_scene(near);
///
/// Pieces: at least two chunks apart, so faces and occlusion do not change.
/// Order:  pieces by the z, y, x of their position; the same on every run.
/// Cost:   one pointer per grid and chunk; O(chunks) for grids that move.
[[nodiscard]] Scene near_grids(const Scene& scene);

}  // namespace quoin

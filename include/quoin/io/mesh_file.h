#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/formats.h>
#include <quoin/scene/scene_meshes.h>
#include <quoin/voxelize/triangle_mesh.h>

namespace quoin {

/// Where a file of meshes has their occlusion.
enum class OcclusionIn : std::uint8_t {
  Colour,     ///< multiplied into the colours of vertices: everybody reads it, but it dims the sun as well
  Attribute,  ///< as a float a vertex of its own, beside colours without it: what of ambient light arrives, 1 open to 0
              ///< dark, as in glTF's occlusion textures; for a shader that dims ambient light alone
};

struct MeshFileOptions {
  std::optional<FileFormat> format{};  ///< of the mesh formats; without, that of the path's extension
  bool write_occlusion = true;         ///< without, the meshes' occlusion is left out
  OcclusionIn occlusion_in = OcclusionIn::Colour;
  double scale = 1.0;     ///< units of the file a world unit; positive
  UpAxis up = UpAxis::Y;  ///< Z: what is at (x, y, z) is written at (x, -z, y)
  bool quantize = false;  ///< of glTF: vertices as integers, which only newer clients read
  bool compress = false;  ///< of glTF: arrays as meshoptimizer packs them; clients need its decoder
};

/// Writes meshes as a file; returns the size of all that was written.
///
///            auto meshes = mesh_scene(scene);
///            auto bytes = write_mesh(*meshes, "castle.glb");
///
/// GLB, glTF: version 2.0. Quoin's axes are glTF's (+Y up, the front towards +Z); one world unit is a metre. A node per
///            placement carries translation, rotation and positive scale; vertices are relative to the part's pivot.
///            A group is a node too, of translation and rotation, whose children are what belongs to it; the name of a
///            layer is `extras.layer`.
///            Placements share the part's mesh, mirrored ones a second, reflected mesh, those that shear one that is
///            sheared, since nodes cannot. Vertices more than 65,536 from the pivot are relative to the middle of
///            their mesh instead, where the node stands then. `.gltf` is the same as text, with a file of the same
///            name ending in ".bin" next to it (none when nothing is drawn).
///            Blocks have a palette texture, 256 texels wide, with one texel a voxel type (nearest, clamped), and one
///            with roughness (green) and metalness (blue); occlusion is grey in COLOR_0. Materials are opaque,
///            transparent, and emissive: texture times emissiveFactor times
///            KHR_materials_emissive_strength; strengths within a factor of two share a material and are scaled in the
///            texture, so that its 8 bits cost them at most one more bit. Transparent types have a material each,
///            blended, with KHR_materials_transmission, KHR_materials_volume and KHR_materials_ior; those and alpha say
///            what pictures show through the type's bodies of typical thickness (MeshPart::thickness).
///            Smooth meshes have COLOR_0, 16 bits a channel in linear light, albedo times 1 - occlusion. Those with
///            MeshView::types have a material for each roughness and metalness, and for each type that emits or is
///            transparent; a triangle has that of its first corner. Others have one rough, opaque material.
///            Of meshes with light at their vertices (MeshView::light; then all have it) materials are those of
///            KHR_materials_unlit, and COLOR_0 has 16 bits a channel: light, of smooth meshes times albedo, times what
///            occlusion leaves. Such materials have no roughness, no emission and no glass but its alpha.
///            OcclusionIn::Attribute: a scalar _AO of every
///            primitive with occlusion; blocks then have no COLOR_0, smooth meshes one of albedo alone.
///            Of meshes with an atlas, opaque blocks that emit nothing have that as their colours, with a linear filter
///            and without mipmaps, in TEXCOORD_0, no COLOR_0 and no occlusion of their own, and the palette's roughness
///            in TEXCOORD_1.
///            SceneMeshes::lamps are nodes with KHR_lights_punctual (a lamp of intensity 1 has pi candela; cones of
///            spots end at 90 degrees), SceneMeshes::cameras nodes with cameras. Other formats have neither.
///            Keys of placements are one animation, "frames", of translations, rotations and scales, each value from
///            its time on; what is hidden has a scale of 0. Other formats have the placements as they stand.
///            `quantize` needs clients that know KHR_mesh_quantization. Blocks lose nothing by it: positions are
///            whole voxels in 8 or 16 bits (floats where a shear or more than 65,535 voxels do not allow that), and a
///            node stands up to a voxel from its part's pivot where that lies between voxels, or near the middle of a
///            mesh that is far from its pivot. Positions of smooth meshes are off by at most a 65,534th of what the
///            mesh spans from its pivot (where that lies outside: from its middle) and have their step in the node's
///            scale; normals have 16 bits.
///            `compress` needs clients that know EXT_meshopt_compression, and loses nothing but the order of vertices
///            and which corner of a triangle is its first.
/// Far away:  vertices of a part are floats: of grids beyond 2^16 voxels mesh near_grids(scene). OBJ has all digits.
///            mesh_file_offset says what PLY and STL are relative to; 3MF has it as the transform of its items.
/// OBJ:       an object a placement, in world units. Blocks: coordinates to a millionth of a unit, and beside NAME.obj
///            NAME.mtl, NAME_palette.png and, where something emits light, NAME_emissive.png, and of meshes with an
///            atlas NAME_atlas.png; other occlusion is grey after
///            the coordinates of a vertex ("v x y z r g b"), an extension that many programs read. Transparent
///            types have a material each, with d, Tf and Ni. Smooth meshes: nine
///            digits, sRGB colours after the coordinates, no materials. Has no place for OcclusionIn::Attribute.
/// PLY:       version 1.0, binary, little-endian, in world units: x y z and nx ny nz as floats, red green blue as bytes
///            (sRGB; occlusion is multiplied in linear light), triangles as lists of int. Transparency, metal and
///            emission are lost. OcclusionIn::Attribute: a float ao after these, 1 where a mesh has no occlusion.
/// STL, 3MF:  for printing, in millimetres: `scale` is those of a world unit. Programs for printing want closed,
///            manifold meshes with +Z up: those of closed_surface, as BlockySceneOptions::part_of may give them, and
///            smooth ones; count_open_edges tells. STL: binary, no colours. 3MF: an object a placement, its vertices
///            joined by their places, a colour (sRGB) a corner or a triangle, by the materials extension; compressed in
///            memory before it is written. No occlusion in either.
/// Occlusion: in meshes 0 is open, and 3 (of blocks) or 1 is dark. Files have what it leaves, 1 open to 0 dark, as a
///            factor of colours or as the attribute: 1 - occlusion / 4 of blocks (1, 0.75, 0.5, 0.25), 1 - occlusion of
///            smooth meshes.
/// Left out:  parts without a triangle (their placements are glTF nodes without a mesh) or a placement.
/// Order:     the same bytes on every run.
/// Memory:    vertices are streamed: a mebibyte, what glTF's JSON takes and, of one part at a time (in glTF all), a
///            copy of surfaces whose emission takes several materials; with `compress` also all that is compressed, and
///            the largest array as it is stored.
/// Errors:    Unsupported for a format that is none of meshes, for light, `quantize` and `compress` in others than
///            glTF, for an atlas in PLY, STL and 3MF with its occlusion, for OcclusionIn::Attribute in OBJ, STL and
///            3MF, and for `compress`
///            where the build has no meshoptimizer; CannotWrite; Cancelled; LimitExceeded beyond 4 GiB of GLB or 2^31 -
///            1 vertices or triangles of PLY; InvalidArgument when a transform is not finite, not affine or singular,
///            the scale is not positive, a vertex comes to lie beyond the range of floats, or when a mesh contradicts
///            itself (arrays of different lengths, indices of no vertex, types that are not registered, numbers that
///            are not finite). Each file appears whole or not at all; of several, those before one that fails stay.
/// Sources:   Khronos glTF 2.0 specification, sections 3 and 4.4; KHR_materials_emissive_strength, _transmission,
///            _volume, _ior and _unlit; KHR_mesh_quantization; EXT_meshopt_compression; Alias/Wavefront's OBJ and MTL.
[[nodiscard]] Result<std::uint64_t> write_mesh(const SceneMeshes& meshes, const std::filesystem::path& path,
                                               const MeshFileOptions& options = {}, const Progress& progress = {});

/// The same as bytes, for formats that are one file: GLB, PLY, STL, 3MF and OBJ of smooth meshes. `options.format`
/// means nothing here.
///
/// Errors: also Unsupported for what takes several files.
[[nodiscard]] Result<std::vector<std::byte>> write_mesh(const SceneMeshes& meshes, FileFormat format,
                                                        const MeshFileOptions& options = {},
                                                        const Progress& progress = {});

/// Returns the point that write_mesh makes the coordinates of a PLY or STL file relative to, in the file's units and
/// axes: whole numbers, (0, 0, 0) unless vertices lie so far from the origin that floats would join them. Add it to
/// the file's coordinates; the PLY header has it as a comment, the STL header behind "offset". (0, 0, 0) of other
/// formats and of meshes that are not sound.
[[nodiscard]] DVec3 mesh_file_offset(const SceneMeshes& meshes, FileFormat format, const MeshFileOptions& options = {});

/// The files that write_mesh writes or replaces, `path` first. Errors: Unsupported.
[[nodiscard]] Result<std::vector<std::filesystem::path>> mesh_files(const SceneMeshes& meshes,
                                                                    const std::filesystem::path& path,
                                                                    const MeshFileOptions& options = {});

/// Edges of placed meshes, of which each joins the vertices of one part by their positions, that are not in just two
/// triangles, once in each direction: 0 of what is closed and manifold. Requires: the meshes are sound.
[[nodiscard]] std::uint64_t count_open_edges(const SceneMeshes& meshes);

/// A mesh as a file holds it.
struct LoadedMesh {
  TriangleMesh mesh;
  std::string format;                         ///< "obj", "gltf", "glb", "ply" or "stl"
  std::vector<std::string> warnings;          ///< one line each: what was left out, and why
  std::vector<std::filesystem::path> beside;  ///< files that were read beside it
};

/// Reads the triangles of a file, all nodes of its scene in one mesh, with colours, in the axes of Quoin.
///
/// OBJ:    polygons of any size, colours after coordinates (sRGB), of .mtl files Kd (sRGB) or map_Kd in its place, d,
///         Ke, Pr and Pm. Needs tinyobjloader in the build.
/// glTF:   version 2.0, .gltf and .glb: the default scene's nodes with their transforms, as they stand (no animation,
///         no skin), triangles, strips and fans, of materials base colour, alpha mode, roughness, metalness, emission,
///         KHR_materials_emissive_strength and KHR_texture_transform, COLOR_0. Needs tinygltf in the build.
/// PLY:    version 1.0, as text or binary of either byte order; red, green, blue and alpha of vertices (sRGB); polygons
///         are taken as fans; strips too.
/// STL:    text or binary, with colours as VisCAM or Magics write them.
/// Sidecar files: sidecar_path resolves them, with `sidecar_files`. glTF that names a file outside its folder is
///         refused. OBJ and MTL often hold absolute paths of another machine: the file of the same name in the folder
///         is read instead, and a warning names the file if there is none. Missing images (PNG, JPEG, WebP) and .mtl
///         files are left out with a warning; missing glTF buffers are an error.
/// Left out, with a warning: triangles with a corner that is not finite or not there; points and lines.
/// `up`:   of the file; without, Z of STL and PLY, Y of all others.
/// Errors: CannotRead, BadFormat (with the byte offset where there is one), Unsupported for other formats, for those
///         that the build cannot read, and for glTF that requires an extension that is not known; LimitExceeded beyond
///         2^27 triangles. Memory stays within a multiple of what the files hold.
[[nodiscard]] Result<LoadedMesh> read_mesh(const std::filesystem::path& path, std::optional<UpAxis> up = {},
                                           SidecarFiles sidecar_files = SidecarFiles::WithinFolder);
/// The same of bytes, without what lies beside.
[[nodiscard]] Result<LoadedMesh> read_mesh(std::span<const std::byte> bytes, std::optional<UpAxis> up = {});

}  // namespace quoin

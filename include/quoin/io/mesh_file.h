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

namespace [[gnu::visibility("default")]] quoin {

/// The storage of ambient occlusion in a mesh file.
enum class OcclusionIn : std::uint8_t {
  Colour,  ///< multiplied into vertex colours: every program reads it, but it also dims sunlight
  /// A separate float attribute per vertex, with colours free of occlusion: the fraction of ambient light that arrives,
  /// 1 open to 0 dark, as in glTF's occlusion textures; for shaders that dim only ambient light.
  Attribute,
};

/// The storage of the textures of faces (VoxelProperties::faces) in a mesh file.
enum class TexturesIn : std::uint8_t {
  Images,  ///< an image and materials per texture, which repeat on merged faces
  /// One image of all textures and tints, and a material per use of alpha, so that clients draw the faces at once. A
  /// margin around each texture keeps its colours apart from those of others in the mipmap levels 0 to 4. Textures
  /// cannot repeat in it, so each textured face must cover one voxel (BlockySceneOptions::atlas).
  Atlas,
};

struct MeshFileOptions {
  std::optional<FileFormat> format{};  ///< a mesh format; default: from the path's extension
  bool write_occlusion = true;         ///< false drops the meshes' occlusion
  OcclusionIn occlusion_in = OcclusionIn::Colour;
  double scale = 1.0;     ///< file units per world unit; positive
  UpAxis up = UpAxis::Y;  ///< Z: the point (x, y, z) is written as (x, -z, y)
  bool quantize = false;  ///< glTF: integer vertices, which need a recent loader
  bool compress = false;  ///< glTF: meshoptimizer compression, which the loader must support
  TexturesIn textures_in = TexturesIn::Images;
};

/// Writes meshes to a file. Returns the total size of all written files.
///
///            auto meshes = mesh_scene(scene);
///            auto bytes = write_mesh(*meshes, "castle.glb");
///
/// GLB, glTF: version 2.0. The axes are Quoin's (+Y up, front towards +Z); one world unit is a metre.
///            Nodes: one node per placement, with translation, rotation and positive scale. Vertices are relative to
///            the part's pivot. A group is a node with translation and rotation, and its members are child
///            nodes. A layer's name is `extras.layer`.
///            Meshes: placements share the part's mesh. Mirrored placements share a second, reflected mesh. A placement
///            with shear has its own sheared mesh, because nodes cannot shear. If vertices are more than 65,536
///            from the pivot, they are relative to the middle of their mesh, and the node moves there.
///            Files: `.gltf` is the same as text, with a ".bin" file of the same name next to it (none if the meshes
///            are empty).
///            Blocks: a palette texture, 256 texels wide, with one texel per voxel type (nearest filter, clamped), and
///            a second one with roughness (green) and metalness (blue). Occlusion is grey in COLOR_0. Materials
///            are opaque, transparent or emissive. Emission is texture times emissiveFactor times
///            KHR_materials_emissive_strength. Strengths within a factor of two share a material and are scaled
///            in the texture, which costs at most one of its 8 bits.
///            Textured faces (VoxelProperties::faces): one material per texture, tint, use of alpha, roughness,
///            metalness and emission, instead of the palette. TEXCOORD_0 counts voxels, and the texture repeats:
///            nearest filter when enlarged, mipmaps when reduced. The tint is the baseColorFactor. Emission has the
///            colours of the texture. Cutout faces have the alpha mode MASK and two sides, translucent ones BLEND,
///            without transmission. With SceneMeshes::atlas, blocks have the mean colours of their textures.
///            TexturesIn::Atlas: one image of all textures and tints, which does not repeat; materials differ in alpha,
///            roughness, metalness and emission. Each texture has a margin of 16 texels that repeats its edge, so
///            mipmap levels 0 to 4 do not mix textures. Clients also use higher levels, which do.
///            Transparent types: one blended material each, with KHR_materials_transmission, KHR_materials_volume and
///            KHR_materials_ior. These and alpha match rendered images of the type's bodies at typical thickness
///            (MeshPart::thickness).
///            Smooth meshes: COLOR_0 with 16 bits per channel in linear light, albedo times 1 - occlusion. With
///            MeshView::types, there is one material per roughness and metalness, and per emissive or
///            transparent type; a triangle uses the material of its first corner. Otherwise, one rough,
///            opaque material.
///            Lit meshes (MeshView::light; all meshes must then have it): KHR_materials_unlit, and COLOR_0 with 16 bits
///            per channel: light, times albedo for smooth meshes, times the remaining ambient light. These materials
///            have no roughness, no emission, and only alpha for glass.
///            OcclusionIn::Attribute: a scalar _AO for each primitive with occlusion. Blocks then have no COLOR_0;
///            smooth meshes store only albedo there.
///            Atlas: opaque, non-emissive blocks use the atlas as colour texture (linear filter, no mipmaps) with
///            TEXCOORD_0, no COLOR_0 and no separate occlusion; the palette's roughness uses TEXCOORD_1.
///            Lamps and cameras: SceneMeshes::lamps are nodes with KHR_lights_punctual (intensity 1 is pi candela; spot
///            cones are limited to 90 degrees), SceneMeshes::cameras are camera nodes. Other formats store neither.
///            Animation: the placements' keys form one animation, "frames", of translations, rotations and scales with
///            step interpolation. Hidden placements have a scale of 0. Other formats store the initial
///            transforms.
///            `quantize` requires KHR_mesh_quantization. Blocks stay exact: positions are whole voxels in 8 or 16 bits
///            (floats for shear or more than 65,535 voxels). A node moves by up to one voxel if the pivot lies between
///            voxels, or to the middle of a mesh far from its pivot. Smooth positions have an error of at most
///            1/65,534 of the mesh's extent from its pivot (from its middle if the pivot is outside); the node's scale
///            holds the step. Normals have 16 bits.
///            `compress` requires EXT_meshopt_compression. It is lossless, but reorders vertices and rotates triangle
///            corners.
/// Far away:  vertices are floats; for grids beyond 2^16 voxels, mesh near_grids(scene). OBJ stores all digits. PLY and
///            STL are relative to mesh_file_offset; 3MF stores that offset in the transform of its items.
/// OBJ:       one object per placement, in world units. Blocks: coordinates to a millionth of a unit, with NAME.mtl,
///            NAME_palette.png, NAME_emissive.png (if a type emits light) and NAME_atlas.png (with an atlas) next to
///            NAME.obj. Textured faces have materials as in glTF: map_Kd is NAME_texture_1.png and so on, an image of
///            each texture and tint, with the texture's alpha; map_d of cutout and translucent faces is a grey image,
///            NAME_alpha_1.png and so on. With TexturesIn::Atlas, there is one of each. Without an occlusion atlas,
///            occlusion is a grey colour after the vertex coordinates ("v x y z r g b"), an extension that many
///            programs read. Each transparent type has its own material with
///            d, Tf and Ni. Smooth meshes: nine digits, sRGB colours after the coordinates, no materials.
///            OcclusionIn::Attribute is not supported.
/// PLY:       version 1.0, binary, little-endian, in world units: floats x y z and nx ny nz, bytes red green blue
///            (sRGB; occlusion is multiplied in linear light), triangles as lists of int. Transparency, metalness and
///            emission are lost. OcclusionIn::Attribute adds a float ao, which is 1 for meshes without occlusion.
/// STL, 3MF:  for printing, in millimetres: `scale` is millimetres per world unit. Printing programs expect closed,
///            manifold meshes with +Z up: use closed_surface (BlockySceneOptions::part_of) or smooth meshes, and check
///            them with count_open_edges. STL: binary, no colours. 3MF: one object per placement, vertices joined by
///            position, an sRGB colour per corner or triangle (materials extension); compressed in memory before
///            writing. Neither stores occlusion.
/// Occlusion: in meshes, 0 is open, and 3 (blocks) or 1 is dark. Files store the remaining light, 1 open to 0 dark, as
///            a colour factor or as the attribute: 1 - occlusion / 4 for blocks (1, 0.75, 0.5, 0.25), 1 - occlusion for
///            smooth meshes.
/// Left out:  parts without triangles (their placements become glTF nodes without a mesh) or without placements;
///            outside glTF and OBJ, textures of types, whose mean colours are written.
/// Order:     the same bytes on every run.
/// Memory:    vertices are streamed: 1 MiB, the glTF JSON, and, for one part at a time (in glTF for all), a copy of
///            surfaces with several materials (emission, glass, textures). Coordinates of textured faces need up to 20
///            bytes per vertex of a material while they are written. `compress` adds all compressed data and the
///            largest array as stored.
/// Errors:    Unsupported for formats without meshes; for light, `quantize` and `compress` outside glTF; for an atlas
///            with occlusion in PLY, STL and 3MF; for OcclusionIn::Attribute in OBJ, STL and 3MF; for `compress` in
///            builds without meshoptimizer. CannotWrite. Cancelled. LimitExceeded beyond 4 GiB of GLB, 2^31 - 1
///            vertices or triangles of PLY, or 16,384 texels per side of an atlas of textures. InvalidArgument if no
///            format has the name of `format`, a transform is not finite, not affine or singular, the scale is not
///            positive, a vertex exceeds the range of floats, a mesh is inconsistent (array lengths that differ, vertex
///            indices out of range, unregistered types, infinite numbers), or its textured faces are merged with
///            TexturesIn::Atlas. Each file is written atomically; if a later file fails, earlier ones stay.
/// Sources:   Khronos glTF 2.0 specification, sections 3 and 4.4; KHR_materials_emissive_strength, _transmission,
///            _volume, _ior and _unlit; KHR_mesh_quantization; EXT_meshopt_compression; Alias/Wavefront's OBJ and MTL.
[[nodiscard]] Result<std::uint64_t> write_mesh(const SceneMeshes& meshes, const std::filesystem::path& path,
                                               const MeshFileOptions& options = {}, const Progress& progress = {});

/// Returns meshes as the bytes of a single-file format: GLB, PLY, STL, 3MF, or OBJ of smooth meshes. Ignores
/// `options.format`.
///
/// Errors: as above; also Unsupported for output that needs several files.
[[nodiscard]] Result<std::vector<std::byte>> write_mesh(const SceneMeshes& meshes, FileFormat format,
                                                        const MeshFileOptions& options = {},
                                                        const Progress& progress = {});

/// Returns the offset that write_mesh subtracts from the coordinates of a PLY or STL file, in the file's units and
/// axes. It consists of whole numbers, and is (0, 0, 0) unless vertices are so far from the origin that floats would
/// merge them. Add it to the file's coordinates to restore world positions. The PLY header stores it in a comment, the
/// STL header after "offset". Returns (0, 0, 0) for other formats and for invalid meshes.
[[nodiscard]] DVec3 mesh_file_offset(const SceneMeshes& meshes, FileFormat format, const MeshFileOptions& options = {});

/// Returns the files that write_mesh writes or replaces, `path` first. Errors: Unsupported, InvalidArgument.
[[nodiscard]] Result<std::vector<std::filesystem::path>> mesh_files(const SceneMeshes& meshes,
                                                                    const std::filesystem::path& path,
                                                                    const MeshFileOptions& options = {});

/// Returns the number of open edges: edges of placed meshes that are not shared by exactly two triangles, once in each
/// direction. Vertices of a part are joined by position. 0 means closed and manifold. Requires: the meshes are valid.
[[nodiscard]] std::uint64_t count_open_edges(const SceneMeshes& meshes);

/// A mesh read from a file.
struct LoadedMesh {
  TriangleMesh mesh;
  std::string format;                 ///< "obj", "gltf", "glb", "ply", "stl", "3mf" or "off"
  std::vector<std::string> warnings;  ///< one line per skipped item, with the reason
  /// Other files that were read.
  std::vector<std::filesystem::path> sidecars;
};

/// Reads the triangles of a file into one mesh with colours, in Quoin's axes. All nodes of a file's scene are merged.
///
/// OBJ:    polygons of any size, colours after coordinates (sRGB); from .mtl files Kd (sRGB) or map_Kd instead, d, Ke,
///         Pr and Pm. Needs tinyobjloader in the build.
/// glTF:   version 2.0, .gltf and .glb: the nodes of the default scene with their static transforms (no animation, no
///         skins); triangles, strips and fans; of materials, base colour and emission with their textures, alpha mode,
///         roughness, metalness, KHR_materials_emissive_strength, KHR_materials_pbrSpecularGlossiness and
///         KHR_texture_transform; COLOR_0; KHR_mesh_quantization, EXT_meshopt_compression and
///         KHR_draco_mesh_compression. Needs tinygltf in the build, for meshopt data also meshoptimizer, for Draco data
///         also libdraco.
/// PLY:    version 1.0, text or binary of either byte order; red, green, blue and alpha per vertex (sRGB); polygons are
///         read as fans; triangle strips too.
/// STL:    text or binary, with VisCAM or Magics colours.
/// 3MF:    objects, components and build items with their transforms; colours of base materials and colour groups
///         (sRGB). Positions are converted to millimetres. Needs expat in the build.
/// OFF:    text; polygons are triangulated; colours per vertex or face (sRGB).
/// Sidecar files: sidecar_path resolves them with `sidecar_files`. A glTF file that names a file outside its folder is
///                refused. OBJ and MTL often contain absolute paths of another machine: the file of the same name in
///                the folder is read instead, with a warning if there is none. Missing images (PNG, JPEG, WebP) and
///                .mtl files give a warning; missing glTF buffers are an error.
/// Left out, with a warning: triangles with a missing or non-finite corner; points and lines.
/// `up`:   the file's up axis; default: Z for PLY, STL and 3MF, Y for all others.
/// Errors: CannotRead; BadFormat (with the byte offset where there is one); Unsupported for other formats, for
///         formats that the build cannot read, and for glTF that requires an unknown extension; LimitExceeded beyond
///         2^27 triangles. Memory stays within a multiple of the files' size.
[[nodiscard]] Result<LoadedMesh> read_mesh(const std::filesystem::path& path, std::optional<UpAxis> up = {},
                                           SidecarFiles sidecar_files = SidecarFiles::WithinFolder);
/// Reads a mesh from bytes, without sidecar files.
[[nodiscard]] Result<LoadedMesh> read_mesh(std::span<const std::byte> bytes, std::optional<UpAxis> up = {});

}  // namespace quoin

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/io/vox.h>
#include <quoin/scene/scene.h>

#include "io/vox/chunks.h"

namespace quoin::vox {

inline constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// The position of a shape or a group in the scene graph: below its nearest ancestor group, through a chain of
/// transforms, usually one.
struct PlacedNode {
  std::size_t node = kNone;         ///< the shape or group in Document::nodes; kNone without a scene graph
  std::size_t parent = kNone;       ///< in Placements::groups; kNone: the scene itself
  std::size_t first_transform = 0;  ///< in Placements::chains, from the top down
  std::size_t transform_count = 0;
  Motion parent_motion;     ///< the parent group's motion in the world
  Motion before;            ///< the combined motion of all transforms of the chain except the last
  Motion world;             ///< the combined motion down to here
  bool hidden = false;      ///< by itself or its chain, regardless of the groups above
  std::int32_t layer = -1;  ///< the last transform's layer
  std::string_view name;    ///< the last transform's name
};

/// A model in the scene graph: the combined motion of all transforms on one path down to a shape. MagicaVoxel's axes.
struct PlacedShape : PlacedNode {
  std::uint32_t model = 0;
  std::string_view shape_name;  ///< the shape's own name; Quoin's writer stores a grid's name there
};

/// The placements at one frame, in the order of the graph, with warnings.
struct Placements {
  std::vector<PlacedShape> all;
  /// All groups except the topmost, which is the scene itself unless it is hidden, on a layer or named. Parents come
  /// first.
  std::vector<PlacedNode> groups;
  std::vector<std::size_t> chains;  ///< transforms, as indices into Document::nodes
  std::size_t top_group = kNone;    ///< the topmost group's node; kNone if it is in `groups` or does not exist
  Motion top_motion;                ///< its motion
  bool is_tree = true;              ///< no node has two parents
  std::size_t nodes_apart = 0;      ///< number of nodes that are not reachable from the root
  std::vector<bool> is_model_used;  ///< true if a model is used at any frame
  std::vector<std::string> warnings;
};

/// Returns a transform's motion at a frame, as in `place_models`.
[[nodiscard]] Motion motion_at(const Document& document, const Node& node, int frame);
/// Returns the index of the key that a shape shows at a frame, in the file's order sorted by frames.
[[nodiscard]] std::size_t key_of_shape(const Document& document, const Node& shape, int frame);
/// Returns a frame as a node's keys count it: folded into their range if the node loops.
[[nodiscard]] std::int64_t frame_of_transform(const Document& document, const Node& node, int frame);

/// Walks the scene graph of the document.
///
/// Without nodes every model is a frame of an animation, and the chosen model stands on the ground, centred. Between
/// two keys of a transform the position is interpolated, rounded towards zero, and the rotation is the earlier key's.
/// Cost:   memory and time within a small multiple of the file's size, for any graph.
/// Errors: BadFormat for cycles and for missing nodes or models; LimitExceeded when nodes with several parents multiply
///         beyond `file_bytes`; InvalidArgument for a missing frame.
[[nodiscard]] Result<Placements> place_models(const Document& document, int frame, std::size_t file_bytes);

/// Counts of dropped voxels, over all models.
struct ModelOmissions {
  std::int64_t outside = 0;     ///< voxels beyond their model's size
  std::int64_t colourless = 0;  ///< voxels of colour index 0, which is air
};

/// Turns models into grids, one after another; keeps the scratch memory between them.
class ModelBuilder {
 public:
  explicit ModelBuilder(const std::array<std::uint8_t, kColours>& type_of) : type_of_(type_of) {}

  /// Voxel (x, y, z) of the model becomes voxel (x, z, size.y - 1 - y) of the grid; canvas and pivot as in SceneGrid.
  /// If a position occurs twice, the last voxel counts. Voxels outside the model or without a colour are dropped.
  ///
  /// Cost: O(voxels), independent of the model's size.
  [[nodiscard]] SceneGrid build(const Model& model);

  [[nodiscard]] const ModelOmissions& losses() const { return losses_; }

 private:
  void build_densely(const Model& model, Grid& grid);
  void sort_into_chunks(const Model& model);
  void fill_chunk(IVec3 chunk, std::size_t first, std::size_t count, Grid& grid);

  std::array<std::uint8_t, kColours> type_of_;
  ModelOmissions losses_;
  std::array<std::size_t, 65> chunk_begins_{};
  std::vector<std::uint32_t> sorted_;  ///< by chunk: place in the chunk in bits 0-17, type above
  std::vector<VoxelType> dense_;       ///< chunks, one after the other
};

/// Returns the box and pivot of a grid made from a model of that size.
[[nodiscard]] IBox canvas_of(IVec3 model_size);
[[nodiscard]] DVec3 pivot_of(IVec3 model_size);

}  // namespace quoin::vox

namespace quoin {

/// A .vox file as read, together with the scene made from it. Neither changes: an edited scene is compared with it.
///
///  file                          scene, by the slots of its handles
///  document.models[i]            grid i
///  document.layers[i]            layer layer_of[i]; kNone: not in the scene
///  placements.all[i]             instance i
///  placements.groups[i]          group i
///  colour index i                type type_of[i]
struct VoxSource {
  std::vector<std::byte> bytes;
  vox::Document document;  // views of `bytes`
  vox::Placements placements;
  std::vector<std::size_t> layer_of;
  std::array<std::uint8_t, vox::kColours> type_of{};
  int frame = 0;
  Scene scene;
};

/// Returns the handle of a slot in the scene as read, which is also valid in its edited copies; a null handle if the
/// slot is empty.
template <class T>
[[nodiscard]] Handle<T> handle_read(const SlotMap<T>& read, std::size_t slot) {
  return read.handle_at(static_cast<std::uint32_t>(slot)).value_or(Handle<T>{});
}

}  // namespace quoin

namespace quoin::vox {

/// Returns the file's cameras that were set, in order, in Quoin's axes. MagicaVoxel writes ten; unused ones look from
/// the origin along the front.
///
///   _focus   look-at point, in voxels                 _mode   pers, free; orth, iso; pano
///   _angle   pitch, yaw and roll in degrees           _fov    vertical, in degrees
///   _radius  from the focus to the camera             _frustum tan(fov / 2)
///
/// At 0, 0, 0 it looks along +y; pitch turns it up, yaw to the left, roll rotates the image to the left. An
/// orthographic camera shows the same extent at the focus as a perspective one, and lies in front of all of `bounds`.
/// Skips invalid or unsupported cameras, with a warning.
/// Source: github.com/AstrorEnales/blender_magicavoxel (blender_magicavoxel.py) and github.com/vengi-voxel/vengi
/// (MagicaVoxel.cpp), which agree on the placement; the format's description lists only the key names.
[[nodiscard]] std::vector<FileCamera> cameras_of(const Document& document, const DBox& bounds,
                                                 std::vector<std::string>& warnings);

/// MagicaVoxel's colours for a file without RGBA, by colour index; 0 is air.
[[nodiscard]] std::array<Rgba8, kColours> default_palette();

/// The name of a type that has no name of its own.
[[nodiscard]] std::string default_type_name(int type);

/// Returns the type of each colour index of XYZI: the index itself, unless IMAP reorders the palette. Then type i is
/// the i-th colour in the displayed palette. An IMAP that is no permutation is ignored, with a warning.
[[nodiscard]] std::array<std::uint8_t, kColours> types_by_colour_index(const Document& document,
                                                                       std::vector<std::string>& warnings);

/// Registers types 1 to 255: colours of RGBA (its alpha is ignored), materials of MATL or MATT.
///
/// Requires: `types` holds air only.
[[nodiscard]] Status register_palette(const Document& document, const std::array<std::uint8_t, kColours>& type_of,
                                      VoxelRegistry& types);

/// Converts MagicaVoxel's material keys to Quoin's properties. `attributes` are kept unchanged.
///
/// `_type` decides which keys count; without one, or with an unknown one, the material is diffuse regardless of other
/// keys (MagicaVoxel keeps the sliders of a material that was made diffuse again):
///  _diffuse  roughness 1
///  _metal    metalness `_metal`, else `_weight`, else 1; 0 with `_plastic`; roughness `_rough`
///  _plastic  roughness `_rough`
///  _glass    transparent; alpha 1 - `_trans` (else `_alpha`, which holds the same; else `_weight`; else 0.5), at
///            least a tenth so that clear glass still shows; roughness `_rough`
///  _blend    metalness `_metal`; transparent when `_trans` (`_alpha`) is above 0; roughness `_rough`
///  _media    (cloud) as glass; with `_media_type` _scatter or _sss, scattering `_d` (0.05 per voxel), anisotropy `_g`
///  _emit     emission (`_emit`, else `_weight`, else 1) * 2^`_flux`
/// For all: index of refraction `_ri`, else 1 + `_ior`. `_rough` missing is 0.1, MagicaVoxel's default.
/// Keys that start with "quoin_" override these; `encode_material` writes them for properties without a MagicaVoxel
/// key.
[[nodiscard]] VoxelProperties decode_material(const std::string& default_name, Rgba8 colour,
                                              const Attributes& attributes);

/// Returns keys and values that `decode_material` converts to the same properties: `properties.attributes` unchanged if
/// they still do, otherwise with the keys above updated.
[[nodiscard]] Attributes encode_material(const std::string& default_name, const VoxelProperties& properties);

/// Converts the file's render settings to Quoin's; nullopt for a file without any.
///
///   _bounce  _diffuse, _specular: the larger, and direct light; _scatter
///   _env     _mode: 0 _uni, 1 _atm, 2 _ibl
///   _inf     the sun: _i, _k, _angle (pitch above the horizon; yaw, as cameras that look from there), _area
///            (tangent of half its disc), _disk (1: it is visible)
///   _uni     the sky: _i, _k                         _atm  _ray_, _mie_, _o3_: _d (0.4 is the Earth's), _k; _mie_g
///   _ibl     _path, _i, _rot or _angle (its yaw)     _fog_uni  _d (per voxel), _k, _g
///   _lens    _aperture (radius in voxels), _blade_n, _blade_r (degrees)
///   _film    _expo, _vig, _aces, _gam                _bloom    _mix, _scale, _aspect, _threshold
///   _ground  _color, _hor                            _bg       _color
///   _setting _ground, _bg_c, _bg_a: 1 if these are drawn; or _enable of the group, in older files
///
/// FileRenderSettings::not_drawn lists the other keys with a value other than MagicaVoxel's default, and invalid
/// values. Colours are sRGB; numbers out of range are clamped.
/// Source: no documentation by MagicaVoxel; names and defaults are from its files, units from its images. See
/// docs/decisions/archive/098.
[[nodiscard]] std::optional<FileRenderSettings> render_settings_of(const Document& document);

}  // namespace quoin::vox

#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/grid.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/scene.h>

#include "io/vox/chunks.h"
#include "io/vox/vox_reader.h"
#include "io/vox/write/node_content.h"

/// The parts of a .vox file made from a scene, before encoding.
namespace quoin::vox {

/// The mapping between colour indices and types.
struct TypeTable {
  std::vector<std::uint8_t> index_of_type;         ///< by type; 0 for types that do not occur
  std::array<VoxelProperties, kColours> by_index;  ///< entry 0 is unused
};

/// Makes the mapping. Types keep their ids as colour indices if all used types are below 256; otherwise the used types
/// are numbered in ascending order. Colour indices without a type get the default palette's colour.
///
/// Errors: LimitExceeded if more than 255 types are used.
[[nodiscard]] Result<TypeTable> make_type_table(const Scene& scene);

struct RevisedTypes {
  TypeTable table;
  std::int64_t replaced = 0;  ///< replaced palette colours that no voxel used
};

/// Makes the table for a scene that was read from a file: the types of its palette keep their indices. Other used types
/// take entries of the same look, otherwise entries of unused types, the least specific first: a duplicate plain
/// colour, or a colour of the default palette.
///
/// Errors: LimitExceeded if more than 255 types are used.
[[nodiscard]] Result<RevisedTypes> revise_type_table(const Scene& scene, const VoxSource& source);

/// A model to write, cut from a grid.
struct Piece {
  IVec3 min{0};            ///< the minimum corner in the grid
  IVec3 size{1};           ///< along Quoin's axes, at most 256 each
  std::size_t voxels = 0;  ///< number of voxels
};

/// Cuts a grid's declared box into pieces of at most 256 voxels per side, sorted by z, then y, then x. Pieces without
/// voxels are omitted unless all are empty.
[[nodiscard]] std::vector<Piece> cut_into_pieces(const SceneGrid& grid);

/// Writes the voxels of all pieces of a grid in XYZI form, each piece from its offset in `starts` on.
///
/// Requires: `pieces` were cut from this grid; the output has four bytes per voxel.
void write_voxels(const Grid& grid, const std::vector<std::uint8_t>& index_of_type, std::span<const Piece> pieces,
                  std::span<const std::size_t> starts, std::span<std::byte> out);

/// Returns the point of the grid at MagicaVoxel's pivot of that piece's model.
[[nodiscard]] DVec3 pivot_of(const Piece& piece);

// .vox files know only voxels of size 1.

/// Returns the common voxel size of all instances; nullopt if it is 1 or they differ.
[[nodiscard]] std::optional<double> common_voxel_size(const Scene& scene);

/// Returns the scene with voxels of size 1 and all positions divided by their size.
[[nodiscard]] Scene divided(const Scene& given, double voxel_size);
[[nodiscard]] LoadedScene divided(const LoadedScene& given, double voxel_size);

/// Returns the warning that the file does not store the voxel size.
[[nodiscard]] std::string size_warning(double voxel_size);

}  // namespace quoin::vox

namespace quoin {

/// Returns the warnings that write_vox would give. Errors: those of write_vox, except for files of more than 4 GiB.
[[nodiscard]] Result<std::vector<std::string>> vox_unsupported_features(const Scene& scene);
[[nodiscard]] Result<std::vector<std::string>> vox_unsupported_features(const LoadedScene& loaded);

/// Calls `visit(voxel, type)` for every non-air voxel of a chunk with minimum corner `origin`, by z, then y, then x.
///
/// Cost: O(rows within the tight bounds + voxels), so that scattered voxels are cheap.
template <class Visit>
void visit_voxels(const Chunk& chunk, IVec3 origin, Visit&& visit) {
  std::array<VoxelType, kChunkEdge> row{};
  const IBox box = chunk.bounds();
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      std::uint64_t solid = ~chunk.row_mask(y, z, kAir);
      if (solid == 0) continue;
      chunk.read_row(y, z, row);
      for (; solid != 0; solid &= solid - 1) {
        const int x = std::countr_zero(solid);
        visit(origin + IVec3{x, y, z}, row[static_cast<std::size_t>(x)]);
      }
    }
  }
}

/// Calls `visit(voxel, type)` for every non-air voxel, in the order of Grid::for_each.
template <class Visit>
void visit_voxels(const Grid& grid, Visit&& visit) {
  for (const IVec3 coords : grid.chunks()) visit_voxels(*grid.find_chunk(coords), coords * kChunkEdge, visit);
}

}  // namespace quoin

namespace quoin::vox {

/// The models of a grid in the file.
struct GridPlan {
  GridHandle grid;
  std::vector<Piece> pieces;         ///< never empty; a single piece for a model of the source
  std::size_t source_model = kNone;  ///< the source's model that it keeps; kNone for new models
  bool is_resized = false;           ///< for a model of the source: its box changed
  bool is_changed = false;           ///< for a model of the source: its voxels changed, or their positions in the box
  std::uint32_t first_model = 0;     ///< model number of its first piece: the source's models come first, then new ones
};

/// All grids, in the order of their handles.
struct ModelPlan {
  std::vector<GridPlan> grids;
  std::uint32_t count = 0;  ///< number of models, including the source's

  /// Returns null for a grid that is not in the scene.
  [[nodiscard]] const GridPlan* find(GridHandle grid) const;
};

/// Plans the models of all grids. `keeps_graph`: the transforms of the source stay, so a model shown by several keys
/// must keep its pivot.
[[nodiscard]] ModelPlan plan_models(const Scene& scene, const VoxSource& source, bool keeps_graph);

/// Returns the content of a changed model's XYZI (or TDCZ) chunk: remaining voxels in the file's order, then new
/// voxels. Invisible voxels, outside the model or of colour 0, stay if the box is unchanged.
///
/// Memory: up to one byte per voxel of the box and, for a TDCZ, four bytes per voxel.
/// Errors: as unpack_voxels.
[[nodiscard]] Result<std::vector<std::byte>> revised_voxels(const Grid& grid, const GridPlan& plan,
                                                            const VoxSource& source,
                                                            const std::vector<std::uint8_t>& index_of_type);

/// The changes to cameras and sun relative to the source.
struct ViewPlan {
  std::map<std::int32_t, FileCamera> cameras;  ///< new and changed cameras, by number
  std::vector<std::int32_t> order;             ///< their numbers, in the scene's order
  std::vector<std::int32_t> removed;           ///< numbers of removed source cameras
  std::optional<Sun> sun;
  bool has_more_settings = false;  ///< there are settings other than the sun's, which are not written
};

/// Compares a loaded scene with its source. The initial camera gets a free number, if it is none of the others.
[[nodiscard]] ViewPlan plan_view(const LoadedScene& loaded, const VoxSource& source, bool is_new);

/// Sets the keys of an rCAM chunk so that `cameras_of` returns the same camera, except for an orthographic camera that
/// is not in front of the whole scene. Other keys stay.
///
/// Without a focus the radius is 0.
void set_camera_keys(const FileCamera& camera, Entries& keys);

/// Sets the keys of an rOBJ chunk of `_type` `_inf` so that `render_settings_of` returns the sun. Other keys stay. The
/// colour becomes bytes; brightness above white goes into `_i`.
void set_sun_keys(const Sun& sun, Entries& keys);

/// Returns the number of an rCAM chunk; nullopt for other chunks.
[[nodiscard]] std::optional<std::int32_t> camera_number(std::string_view id, std::span<const std::byte> content);
/// Returns true if a chunk is an rOBJ of the sun.
[[nodiscard]] bool is_sun(std::string_view id, std::span<const std::byte> content);

}  // namespace quoin::vox

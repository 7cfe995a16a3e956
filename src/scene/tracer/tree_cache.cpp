#include "scene/tracer/tree_cache.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include <quoin/core/assert.h>
#include <quoin/scene/scene_tracer.h>

#include "core/coordinates/chunk_order.h"
#include "mesh/surface/voxel_surface.h"
#include "scene/tracer/placed_grid.h"
#include "trace/chunk_rows.h"

namespace quoin {
namespace {

constexpr std::uint32_t kOpaqueBody = 0;

// Returns true if any chunk of a grid that may have changed has a type that `counts` accepts.
template <class Counts>
bool has_new_types(const Grid& grid, const GridChanges& changes, const Counts& counts) {
  const std::vector<IVec3> chunks = changes.chunks(grid);
  return std::any_of(chunks.begin(), chunks.end(), [&](IVec3 at) {
    const Chunk* const chunk = grid.find_chunk(at);
    if (chunk == nullptr) return false;
    const std::vector<VoxelType> all = chunk->types();
    return std::any_of(all.begin(), all.end(), counts);
  });
}

// Returns a flag per type: its shapes have glass. Empty if no type's have.
std::vector<std::uint8_t> glass_types(const VoxelRegistry& types) {
  std::vector<std::uint8_t> is_glass(types.size());
  for (std::size_t i = 0; i < types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    is_glass[i] = types.is_shaped(type) && has_glass_parts(types[type]) ? 1 : 0;
  }
  if (std::ranges::count(is_glass, 1) == 0) is_glass.clear();
  return is_glass;
}

// Returns true if no part of a type's shapes hides the background: all are glass. Requires: the type has shapes.
bool is_only_glass(const VoxelProperties& type) {
  bool has_visible = type.visibility == Visibility::Opaque;
  for_each_look(type, [&](const VoxelFace& look) {
    has_visible = has_visible || (!look.texture.is_null() && look.alpha != FaceAlpha::Translucent);
  });
  return !has_visible;
}

// Returns a flag per type: rays for visible parts need not look at its shapes.
std::vector<std::uint8_t> unseen_types(const VoxelRegistry& types) {
  std::vector<std::uint8_t> is_unseen(types.size());
  for (std::size_t i = 0; i < types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    is_unseen[i] = types.is_shaped(type) && is_only_glass(types[type]) ? 1 : 0;
  }
  return is_unseen;
}

// Returns the voxels of a row that shapes touch which a flag per type does not leave out.
std::uint64_t row_without(const std::vector<std::uint8_t>& is_left_out, const ShapeIndex& index, IVec3 first) {
  std::uint64_t row = 0;
  for (std::uint64_t left = index.touched_row(first); left != 0; left &= left - 1) {
    const int x = std::countr_zero(left);
    const auto counts = [&](const ListedShape& shape) {
      return shape.type >= is_left_out.size() || is_left_out[shape.type] == 0;
    };
    if (std::ranges::any_of(index.at(first + IVec3(x, 0, 0)).listed(), counts)) row |= std::uint64_t{1} << x;
  }
  return row;
}

// Returns the voxels of a row that shapes with glass touch.
std::uint64_t glass_row(const TracedShapes& shapes, IVec3 first) {
  std::uint64_t row = 0;
  for (std::uint64_t left = shapes.index.touched_row(first); left != 0; left &= left - 1) {
    const int x = std::countr_zero(left);
    const auto is_glass = [&](const ListedShape& shape) {
      return shape.type < shapes.is_glass.size() && shapes.is_glass[shape.type] != 0;
    };
    if (std::ranges::any_of(shapes.index.at(first + IVec3(x, 0, 0)).listed(), is_glass)) row |= std::uint64_t{1} << x;
  }
  return row;
}

// Rows of the voxels that are opaque or that shapes with visible parts touch. Remembers the rows around the last one.
class OpaqueRows {
 public:
  OpaqueRows(const Grid& grid, const VoxelRegistry& types, const TracedShapes& shapes)
      : grid_(grid), types_(types), shapes_(shapes), is_unseen_(unseen_types(types)) {}
  std::uint64_t operator()(IVec3 first) {
    const IVec3 chunk = chunk_of(first);
    const IVec3 local = local_of(first);
    if (!is_begun_ || chunk != chunk_) {
      is_begun_ = true;
      chunk_ = chunk;
      slab_ = IVec3(-1);
      rows_.reset();
      if (const Chunk* const voxels = grid_.find_chunk(chunk)) rows_.emplace(*voxels, types_, Occupancy::Opaque);
    }
    const std::uint64_t touched = row_without(is_unseen_, shapes_.index, first);
    if (!rows_) return touched;
    const IVec3 slab{0, local.y & ~3, local.z & ~3};
    if (slab != slab_) {
      slab_ = slab;
      const trace::Slab kind = rows_->read(slab.y, slab.z, slab_rows_);
      if (kind == trace::Slab::Empty) slab_rows_.fill(0);
      if (kind == trace::Slab::Full) slab_rows_.fill(~std::uint64_t{0});
    }
    const std::uint64_t opaque = slab_rows_[static_cast<std::size_t>((local.y & 3) + 4 * (local.z & 3))];
    return opaque | touched;
  }

 private:
  const Grid& grid_;
  const VoxelRegistry& types_;
  const TracedShapes& shapes_;
  std::vector<std::uint8_t> is_unseen_;  // by type
  bool is_begun_ = false;
  IVec3 chunk_{0};
  IVec3 slab_{-1};
  std::optional<trace::ChunkRows> rows_;  // of `chunk_`
  trace::SlabRows slab_rows_{};
};

// Returns the chunks whose opaque or touched voxels may have changed: all chunks of a grid whose shapes are new.
std::vector<IVec3> chunks_of_both(std::vector<IVec3> touched, const std::vector<IVec3>& changed, bool is_new,
                                  const Grid& grid) {
  const std::vector<IVec3> all = is_new ? grid.chunks() : changed;
  touched.insert(touched.end(), all.begin(), all.end());
  sort_and_unite(touched);
  return touched;
}

// The voxel data of a grid, for PendingChanges.
struct GridData {
  const Grid* grid;  // null: none
  [[nodiscard]] DataChanges changes_since(ChangeCursor& cursor) const {
    return grid == nullptr ? DataChanges() : grid->data_changes_since(cursor);
  }
};

}  // namespace

int reach_of_shapes(const VoxelRegistry& types) {
  if (!types.has_shapes()) return 0;
  const auto stays_inside = [](const ShapeElement& element) {
    return !element.turn && glm::all(glm::greaterThanEqual(element.min, Vec3(0.0F))) &&
           glm::all(glm::lessThanEqual(element.max, Vec3(kShapeUnits)));
  };
  for (std::size_t type = 0; type < types.size(); ++type) {
    if (!types.is_shaped(static_cast<VoxelType>(type))) continue;
    for (const ShapePart& part : types[static_cast<VoxelType>(type)].shapes.rules().parts) {
      if (!std::ranges::all_of(part.shape.elements(), stays_inside)) return 1;
    }
  }
  return 0;
}

bool has_other_shapes(const TypeChanges& changes, const VoxelRegistry& types) {
  return changes.all || std::ranges::any_of(changes.items_unless_all(), [&](const TypeChange& change) {
           return change.shape_changed || (change.colour_changed && types.is_shaped(change.type));
         });
}

SplitField::SplitField(const DensityGrid& whole, const VoxelRegistry& types)
    : whole_(&whole),
      opaque_field_(smooth::field_of_body(whole, types, kOpaqueBody, Threads{1})),
      glass_(whole, types) {
  (void)opaque_field_.changes_since(followed_opaque_);
  opaque_.emplace(opaque_field_);
}

void SplitField::update(const VoxelRegistry& types, const DensityChanges& changes) {
  for (const DensityChange& change : changes.items_unless_all()) {
    const DensityChunk* const chunk = whole_->find_chunk(change.chunk);
    const DensityChunk air(stored_density(opaque_field_.band(), opaque_field_.band()));
    opaque_field_.put_chunk(change.chunk, chunk == nullptr ? air : smooth::chunk_of_body(*chunk, types, kOpaqueBody));
  }
  opaque_->update(opaque_field_.changes_since(followed_opaque_));
  glass_.update(types, changes);
}

bool has_glass(const DensityGrid& field, const VoxelRegistry& types) {
  if (!types.has_transparent()) return false;
  const std::vector<IVec3> chunks = field.chunks();
  return std::any_of(chunks.begin(), chunks.end(),
                     [&](IVec3 chunk) { return trace::has_glass(*field.find_chunk(chunk), types); });
}

bool has_glass(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes) {
  return std::any_of(changes.items_unless_all().begin(), changes.items_unless_all().end(),
                     [&](const DensityChange& change) {
                       const DensityChunk* const chunk = field.find_chunk(change.chunk);
                       return chunk != nullptr && trace::has_glass(*chunk, types);
                     });
}

bool TreeCache::update(const Grid& grid, const VoxelRegistry& types) {
  PendingChanges changes(followed_, grid);
  if (changes->all) transparent_.reset();
  const std::optional<std::vector<IVec3>> with_other_shapes = update_shapes(grid, types, *changes);
  if (changes->empty() && !with_other_shapes) return false;
  if (!changes->empty()) {
    opaque_.update(grid, types, *changes);
    if (!with_other_shapes) update_transparent(grid, types, *changes);
  }
  if (changes->all) sight_.reset();
  const bool may_differ = sight_ != nullptr || shapes_ != nullptr || types.has_textures();
  if (shaped_ == ShapedVoxels::ForSight && may_differ) {
    // If this fails, the trees differ: the next update makes all again.
    const ChangeCursor followed = std::exchange(followed_, {});
    update_sight(grid, types, with_other_shapes ? *with_other_shapes : changes->chunks(grid));
    followed_ = followed;
  }
  changes.commit();
  return true;
}

// If there were no shapes, only the changed chunks can contain some. Returns the chunks whose opaque or touched voxels
// may have changed if it has updated the trees of shapes and of transparent cubes.
std::optional<std::vector<IVec3>> TreeCache::update_shapes(const Grid& grid, const VoxelRegistry& types,
                                                           const GridChanges& changes) {
  if (shaped_ == ShapedVoxels::AsCubes || (!types.has_shapes() && shapes_ == nullptr)) return std::nullopt;
  if (changes.all) shapes_.reset();
  const bool is_new = shapes_ == nullptr;
  if (is_new) {
    if (changes.empty()) return std::nullopt;
    if (!has_new_types(grid, changes, [&](VoxelType type) { return types.is_shaped(type); })) return std::nullopt;
    followed_data_ = {};
  }
  const GridData data{&grid};
  PendingChanges data_changes(followed_data_, data);
  if (changes.empty() && data_changes->empty()) return std::nullopt;
  // If an update fails, the parts of `shapes_` differ: the next one makes all again, also without edits of voxels.
  const ChangeCursor followed = std::exchange(followed_, {});
  if (is_new) shapes_ = std::make_unique<TracedShapes>();
  const std::vector<IVec3> changed = shapes_->index.update(grid, types, changes, *data_changes);
  const TracedShapes& shapes = *shapes_;
  const auto rows = [&](IVec3 first) { return shapes.index.touched_row(first); };
  shapes_->touched.update(changed, rows);
  shapes_->is_glass = glass_types(types);
  OpaqueRows solid_rows(grid, types, shapes);
  shapes_->solid.update(chunks_of_both(changed, changes.chunks(grid), is_new, grid), solid_rows);
  const auto glass_rows = [&](IVec3 first) { return glass_row(shapes, first); };
  if (!shapes_->is_glass.empty() && shaped_ == ShapedVoxels::ByShape) shapes_->glass.update(changed, glass_rows);
  std::vector<IVec3> all = chunks_of_both(changed, changes.chunks(grid), false, grid);
  update_glass_cubes(grid, types, all);
  if (shapes_->index.empty()) shapes_.reset();
  data_changes.commit();
  followed_ = followed;
  return all;
}

bool is_cell_of_faces(const VoxelRegistry& types, VoxelType type) {
  if (!types.is_transparent(type) || types.is_shaped(type)) return false;
  const VoxelFaces& faces = types[type].faces;
  return !faces.empty() &&
         std::ranges::any_of(kDirections, [&](Direction each) { return faces[each].alpha != FaceAlpha::Translucent; });
}

bool TreeCache::has_other_cells(const VoxelRegistry& types, VoxelType type) const {
  const bool was_cell = sight_ != nullptr && type < sight_->is_cell.size() && sight_->is_cell[type] != 0;
  return shaped_ == ShapedVoxels::ForSight && was_cell != is_cell_of_faces(types, type);
}

namespace {

using ChunkBits = BlockVector<std::uint64_t>;  // rows along x by y + 64 z

std::size_t row_number(int y, int z) {
  return static_cast<std::size_t>(y + kChunkEdge * z);
}

void add_rows(const trace::ChunkRows& rows, ChunkBits& bits) {
  if (rows.none()) return;
  rows.for_each_row(kWholeChunk, [&](int y, int z, std::uint64_t row) { bits[row_number(y, z)] |= row; });
}

// Adds a chunk's voxels of one type of cells of faces. Leaves out those that `opaque` voxels and voxels of the type
// surround: no side of them is drawn. Neighbours in other chunks count as different.
void add_visible_cells(const Chunk& chunk, VoxelType type, const ChunkBits& opaque, ChunkBits& cells) {
  ChunkBits own(opaque.size());
  add_rows(trace::ChunkRows(chunk, type), own);
  const auto hiding = [&](int y, int z) { return own[row_number(y, z)] | opaque[row_number(y, z)]; };
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::uint64_t row = own[row_number(y, z)];
      if (row == 0) continue;
      std::uint64_t inner = 0;
      if (y > 0 && z > 0 && y < kChunkEdge - 1 && z < kChunkEdge - 1) {
        const std::uint64_t along = hiding(y, z);
        inner = along << 1U & along >> 1U & hiding(y - 1, z) & hiding(y + 1, z) & hiding(y, z - 1) & hiding(y, z + 1);
      }
      cells[row_number(y, z)] |= row & ~inner;
    }
  }
}

}  // namespace

void TreeCache::update_sight(const Grid& grid, const VoxelRegistry& types, std::vector<IVec3> chunks) {
  std::vector<std::uint8_t> is_cell(types.has_textures() ? types.size() : 0);
  for (std::size_t i = 0; i < is_cell.size(); ++i) {
    is_cell[i] = is_cell_of_faces(types, static_cast<VoxelType>(i)) ? 1 : 0;
  }
  const auto counts_as_cell = [&](VoxelType type) { return type < is_cell.size() && is_cell[type] != 0; };
  const auto has_cells = [&](IVec3 at) {
    const Chunk* const chunk = grid.find_chunk(at);
    return chunk != nullptr && std::ranges::any_of(chunk->types(), counts_as_cell);
  };
  const bool has_glass_shapes = shapes_ != nullptr && !shapes_->is_glass.empty();
  if (sight_ == nullptr) {
    if (!has_glass_shapes && (is_cell.empty() || std::ranges::none_of(chunks, has_cells))) return;
    sight_ = std::make_unique<SightTrees>();
    const std::vector<IVec3> shaped = shapes_ == nullptr ? std::vector<IVec3>() : shapes_->index.chunks();
    chunks = chunks_of_both(shaped, grid.chunks(), false, grid);
  }
  sight_->is_cell = is_cell;
  const auto is_glass = [&](VoxelType type) {
    return types.is_transparent(type) && !types.is_shaped(type) && !counts_as_cell(type);
  };
  ChunkBits bits(std::size_t{kChunkEdge} * kChunkEdge);
  const auto glass_in = [&](IVec3 chunk) -> OccupancyTree::GlassOfChunk {
    if (shapes_ == nullptr) return {};
    std::uint64_t any = 0;
    for (int i = 0; has_glass_shapes && i < kChunkEdge * kChunkEdge; ++i) {
      const IVec3 first = chunk * kChunkEdge + IVec3(0, i % kChunkEdge, i / kChunkEdge);
      any |= bits[static_cast<std::size_t>(i)] = glass_row(*shapes_, first);
    }
    return {shapes_->index.cubes_in(chunk), any == 0 ? std::span<const std::uint64_t>() : bits};
  };
  sight_->glass.update(grid, types, chunks, is_glass, glass_in);
  if (sight_->is_cell.empty()) return;
  ChunkBits opaque(bits.size());
  const auto cells_in = [&](IVec3 at) -> OccupancyTree::GlassOfChunk {
    if (!has_cells(at)) return {};
    const Chunk& chunk = *grid.find_chunk(at);
    std::ranges::fill(bits, 0);
    std::ranges::fill(opaque, 0);
    add_rows(trace::ChunkRows(chunk, types, Occupancy::Opaque), opaque);
    for (const VoxelType type : chunk.types()) {
      if (counts_as_cell(type)) add_visible_cells(chunk, type, opaque, bits);
    }
    return {{}, bits};
  };
  sight_->cells.update(
      grid, types, chunks, [](VoxelType) { return false; }, cells_in);
}

// Replaces chunks of the tree of transparent cubes, which has shapes that are cubes.
void TreeCache::update_glass_cubes(const Grid& grid, const VoxelRegistry& types, const std::vector<IVec3>& chunks) {
  const ShapeIndex& index = shapes_->index;
  const auto cubes_in = [&](IVec3 chunk) { return index.cubes_in(chunk); };
  if (!transparent_) {
    const auto is_glass = [&](VoxelType type) { return types.is_transparent(type) && !types.is_shaped(type); };
    const bool has_any = std::ranges::any_of(chunks, [&](IVec3 at) {
      const Chunk* const chunk = grid.find_chunk(at);
      return !index.cubes_in(at).empty() || (chunk != nullptr && std::ranges::any_of(chunk->types(), is_glass));
    });
    if (!has_any) return;
    transparent_.emplace(Occupancy::Glass);
  }
  transparent_->update(grid, types, chunks, cubes_in);
  if (transparent_->bounds().empty()) transparent_.reset();
}

bool TreeCache::update(const DensityGrid& field, const VoxelRegistry& types) {
  const bool is_known = field_ && &field_->field() == &field;
  if (!is_known && field.chunk_count() == 0) {
    field_.reset();
    split_.reset();
    return false;
  }
  if (!is_known) followed_field_ = {};
  PendingChanges changes(followed_field_, field);
  if (changes->empty()) return false;
  if (is_known) {
    field_->update(*changes);
  } else {
    field_.emplace(field);
  }
  update_split(field, types, *changes);
  changes.commit();
  return true;
}

// If there was no transparent material, only the changed chunks can contain some.
void TreeCache::update_split(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes) {
  if (changes.all) split_.reset();
  if (split_ != nullptr) {
    split_->update(types, changes);
  } else if (changes.all ? has_glass(field, types) : has_glass(field, types, changes)) {
    split_ = std::make_unique<SplitField>(field, types);
  }
  if (split_ != nullptr && split_->glass().cells().bounds().empty()) split_.reset();
}

// If there was no tree, only the changed chunks can contain transparent voxels.
void TreeCache::update_transparent(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes) {
  if (!transparent_) {
    if (!types.has_transparent()) return;
    const bool has_cubes_only = shaped_ != ShapedVoxels::AsCubes;
    const auto counts = [&](VoxelType type) {
      return types.is_transparent(type) && !(has_cubes_only && types.is_shaped(type));
    };
    if (!has_new_types(grid, changes, counts)) return;
    transparent_.emplace(has_cubes_only ? Occupancy::Glass : Occupancy::Transparent);
  }
  transparent_->update(grid, types, changes);
  if (transparent_->bounds().empty()) transparent_.reset();
}

namespace {

const DensityGrid& no_field() {
  static const DensityGrid none;
  return none;
}

// Returns true if a halved grid fills the same volume as the full one, within an eighth.
bool has_volume_of(const Grid& coarse, int halvings, const Grid& full) {
  const auto cells = std::ldexp(static_cast<double>(coarse.voxel_count()), 3 * halvings);
  const auto voxels = static_cast<double>(full.voxel_count());
  return std::abs(cells - voxels) <= 0.125 * voxels;
}

// As above, for a field. Also returns false if so much of its surface is thin that the next halving would make holes.
bool has_shape_of(const DensityPyramid& fields, int halvings) {
  const DownsampledDensityCounts& now = fields.counts(halvings);
  const auto cells = std::ldexp(static_cast<double>(now.solid), 3 * halvings);
  const auto samples = static_cast<double>(fields.counts(1).finer_solid);
  return std::abs(cells - samples) <= 0.125 * samples && 8 * now.thin <= now.surface;
}

}  // namespace

void CoarseLevel::put_in(PlacedGrid& placed) const {
  QUOIN_ASSERT(voxels != nullptr && placed.grid != nullptr && level >= 1, "a level that was made, and a placed grid");
  const double cell = std::ldexp(1.0, level);
  placed.voxels = voxels;
  placed.opaque = &trees.opaque();
  placed.transparent = placed.glass_voxels = trees.transparent();
  placed.face_cells = nullptr;
  placed.shapes = nullptr;
  placed.field = trees.field();
  placed.opaque_field = trees.opaque_field();
  placed.glass = trees.glass();
  placed.pivot = placed.grid->pivot / cell;
  placed.voxel_size *= cell;
  placed.level = level;
}

void HalvedGridCache::Entry::make(const SceneGrid& grid, const Types& types, int halvings, Threads threads) {
  PendingChanges changes(followed, grid.grid);
  PendingChanges field_changes(followed_field, grid.field);
  const GridData states{types.full.has_shapes() || types.full.has_turned_by_state() ? &grid.grid : nullptr};
  PendingChanges state_changes(followed_states, states);
  if (changes->all || field_changes->all || state_changes->all) {
    *this = {};
  } else if (!changes->empty() || !field_changes->empty() || !state_changes->empty()) {
    renew(grid, types, threads);
  }
  state_changes.commit();
  changes.commit();
  field_changes.commit();
  const int known = static_cast<int>(levels.size());
  if (known < halvings && !is_coarsest) is_coarsest = has_glass(grid.field, types.full);
  for (int level = known + 1; level <= halvings && !is_coarsest; ++level) {
    pyramid.update(grid.grid, types.full, types.halved, level, threads);
    fields.update(grid.field, level, threads);
    is_coarsest = !take_level(grid, types, level);
  }
}

// Updates the existing levels after an edit.
void HalvedGridCache::Entry::renew(const SceneGrid& grid, const Types& types, Threads threads) {
  is_coarsest = has_glass(grid.field, types.full);
  if (is_coarsest) return levels.clear();
  const int most = std::max(pyramid.levels(), fields.levels());
  pyramid.update(grid.grid, types.full, types.halved, most, threads);
  fields.update(grid.field, most, threads);
  for (int level = 1; level <= most && !is_coarsest; ++level) is_coarsest = !take_level(grid, types, level);
}

bool HalvedGridCache::Entry::is_alike(const SceneGrid& grid, int halvings) const {
  const bool has_voxels = grid.grid.chunk_count() != 0;
  const bool has_field = grid.field.chunk_count() != 0;
  if (has_voxels && (pyramid.levels() < halvings || !has_volume_of(pyramid.level(halvings), halvings, grid.grid))) {
    return false;
  }
  if (has_field && (fields.levels() < halvings || !has_shape_of(fields, halvings))) return false;
  return has_voxels || has_field;
}

// Adds a level of the pyramids if it is similar to the grid. Otherwise removes it and all coarser levels, and returns
// false.
bool HalvedGridCache::Entry::take_level(const SceneGrid& grid, const Types& types, int halvings) {
  QUOIN_ASSERT(halvings >= 1, "1 <= halvings");
  const auto index = static_cast<std::size_t>(halvings - 1);
  if (!is_alike(grid, halvings)) {
    levels.resize(std::min(levels.size(), index));
    return false;
  }
  QUOIN_ASSERT(index <= levels.size(), "levels in their order");
  if (levels.size() == index) levels.push_back(std::make_unique<CoarseLevel>());
  CoarseLevel& level = *levels[index];
  level.voxels = grid.grid.chunk_count() != 0 ? &pyramid.level(halvings) : &no_voxels;
  level.field = grid.field.chunk_count() != 0 ? &fields.level(halvings) : nullptr;
  level.level = halvings;
  const DensityGrid& field = level.field == nullptr ? no_field() : *level.field;
  level.trees.update(*level.voxels, types.halved);
  level.trees.update(field, types.full);
  level.tight = unite(level.voxels->bounds(), field.bounds());
  return true;
}

const CoarseLevel* HalvedGridCache::Lock::find(GridHandle grid, int halvings) const {
  const auto found = grids_->entries_.find(grid);
  if (halvings <= 0 || found == grids_->entries_.end() || found->second.levels.empty()) return nullptr;
  const auto& levels = found->second.levels;
  return levels[std::min(static_cast<std::size_t>(halvings), levels.size()) - 1].get();
}

HalvedGridCache::Lock HalvedGridCache::make(const Scene& scene, std::span<const SelectedInstance> selected,
                                            Threads threads) {
  Lock lock(*this);
  std::map<GridHandle, int> wanted;
  for (const SelectedInstance& choice : selected) {
    if (choice.level <= 0) continue;
    int& most = wanted[scene.instances()[choice.instance].grid];
    most = std::max(most, choice.level);
  }
  std::vector<std::pair<GridHandle, int>> tasks(wanted.begin(), wanted.end());
  for (const auto& [grid, halvings] : tasks) entries_[grid];
  if (tasks.empty()) return lock;
  const Types types{scene.types, halved_types_.of(scene.types)};
  const Threads inner = tasks.size() > 1 ? Threads{1} : threads;
  parallel_for(tasks.size(), threads, [&](std::size_t i) {
    const auto& [handle, halvings] = tasks[i];
    entries_.find(handle)->second.make(scene.grids()[handle], types, halvings, inner);
  });
  return lock;
}

}  // namespace quoin

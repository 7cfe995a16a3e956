#include "io/vox/write/vox_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <zlib.h>
#include <quoin/core/assert.h>

#include "core/bytes/text.h"
#include "core/srgb.h"
#include "io/vox/chunks.h"
#include "io/vox/vox_reader.h"

namespace quoin::vox {

namespace {

using Cell = std::array<std::int64_t, 3>;

/// Returns the piece of a box that contains a voxel, ordered z, y, x so that pieces sort that way.
Cell cell_of(IVec3 voxel, IVec3 box_min) {
  Cell cell{};
  for (int axis = 0; axis < 3; ++axis) {
    cell[static_cast<std::size_t>(2 - axis)] = (std::int64_t{voxel[axis]} - box_min[axis]) / kMaxModelEdge;
  }
  return cell;
}

Piece piece_at(const Cell& cell, const IBox& box) {
  Piece piece;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t begin = box.min[axis] + cell[static_cast<std::size_t>(2 - axis)] * kMaxModelEdge;
    piece.min[axis] = static_cast<int>(begin);
    piece.size[axis] = static_cast<int>(std::min<std::int64_t>(kMaxModelEdge, box.max[axis] - begin));
  }
  return piece;
}

/// Ascending.
std::vector<VoxelType> occurring_types(const Scene& scene) {
  std::vector<VoxelType> types;
  for (const GridHandle handle : scene.grids().handles()) {
    const std::vector<VoxelType> of_grid = scene.grids()[handle].grid.types();
    types.insert(types.end(), of_grid.begin(), of_grid.end());
  }
  std::ranges::sort(types);
  types.erase(std::unique(types.begin(), types.end()), types.end());
  return types;
}

}  // namespace

Result<TypeTable> make_type_table(const Scene& scene) {
  std::vector<VoxelType> types = occurring_types(scene);
  const bool keeps_ids = types.empty() || types.back() < kColours;
  if (keeps_ids) {
    types.clear();
    for (std::size_t type = 1; type < kColours; ++type) types.push_back(static_cast<VoxelType>(type));
  }
  if (types.size() >= kColours) {
    return make_error(ErrorCode::LimitExceeded, "the scene uses " + std::to_string(types.size()) +
                                                    " voxel types, more than the 255 of a .vox file");
  }
  TypeTable table;
  table.index_of_type.resize(std::size_t{types.back()} + 1);
  const std::array<Rgba8, kColours> fallback = default_palette();
  for (std::size_t index = 1; index < kColours; ++index) {
    VoxelProperties& properties = table.by_index[index];
    properties.name = default_type_name(static_cast<int>(index));
    properties.colour = fallback[index];
    if (index > types.size()) continue;
    const VoxelType type = types[index - 1];
    table.index_of_type[type] = static_cast<std::uint8_t>(index);
    if (type < scene.types.size()) properties = scene.types[type];
  }
  return table;
}

namespace {

/// Returns true if two types differ at most in name and attributes.
bool looks_the_same(VoxelProperties a, VoxelProperties b) {
  a.name.clear();
  b.name.clear();
  a.attributes.clear();
  b.attributes.clear();
  return a == b;
}

/// Assigns palette entries to types outside the palette.
class PaletteRoom {
 public:
  PaletteRoom(const Scene& scene, const VoxSource& source, TypeTable& table) : source_(source), table_(table) {
    for (const VoxelType type : occurring_types(scene)) {
      if (type < kColours) {
        occurs_[type] = true;
      } else {
        strangers_.push_back(type);
      }
    }
  }

  [[nodiscard]] const std::vector<VoxelType>& strangers() const { return strangers_; }

  /// Returns an entry of the same look, or one that no voxel uses; nullopt if there is none.
  std::optional<std::size_t> place(const VoxelProperties& wanted) {
    for (std::size_t index = 1; index < kColours; ++index) {
      if (!looks_the_same(table_.by_index[index], wanted)) continue;
      occurs_[source_.type_of[index]] = true;
      return index;
    }
    const auto free = best_free();
    if (!free) return std::nullopt;
    if (!says_little(*free)) ++replaced_;
    const VoxelType type = source_.type_of[*free];
    occurs_[type] = true;
    VoxelProperties& entry = table_.by_index[*free];
    entry = wanted;
    if (entry.name.empty()) entry.name = default_type_name(type);
    return free;
  }

  [[nodiscard]] std::int64_t replaced() const { return replaced_; }

 private:
  /// Returns true for a plain colour that is a duplicate or in MagicaVoxel's own palette.
  [[nodiscard]] bool says_little(std::size_t index) const {
    const VoxelProperties& entry = table_.by_index[index];
    if (entry.visibility != Visibility::Opaque || entry.emission > 0.0F || entry.metalness > 0.0F) return false;
    if (std::ranges::find(usual_, entry.colour) != usual_.end()) return true;
    for (std::size_t other = 1; other < kColours; ++other) {
      if (other != index && table_.by_index[other].colour == entry.colour) return true;
    }
    return false;
  }
  /// Returns a free entry, from the end of the displayed palette.
  [[nodiscard]] std::optional<std::size_t> best_free() const {
    std::array<std::size_t, kColours> index_of{};
    for (std::size_t i = 0; i < kColours; ++i) index_of[source_.type_of[i]] = i;
    std::optional<std::size_t> free;
    for (std::size_t type = kColours - 1; type > 0; --type) {
      if (occurs_[type]) continue;
      if (says_little(index_of[type])) return index_of[type];
      if (!free) free = index_of[type];
    }
    return free;
  }

  const VoxSource& source_;
  TypeTable& table_;
  const std::array<Rgba8, kColours> usual_ = default_palette();
  std::array<bool, kColours> occurs_{true};
  std::vector<VoxelType> strangers_;
  std::int64_t replaced_ = 0;
};

}  // namespace

Result<RevisedTypes> revise_type_table(const Scene& scene, const VoxSource& source) {
  RevisedTypes revised;
  TypeTable& table = revised.table;
  table.index_of_type.resize(kColours);
  for (std::size_t index = 1; index < kColours; ++index) {
    const VoxelType type = source.type_of[index];
    table.index_of_type[type] = static_cast<std::uint8_t>(index);
    table.by_index[index] = (type < scene.types.size() ? scene.types : source.scene.types)[type];
  }
  PaletteRoom room(scene, source, table);
  for (const VoxelType type : room.strangers()) {
    const auto index = room.place(type < scene.types.size() ? scene.types[type] : VoxelProperties{});
    if (!index) {
      return make_error(ErrorCode::LimitExceeded, "the scene uses more than the 255 voxel types of a .vox file");
    }
    if (type >= table.index_of_type.size()) table.index_of_type.resize(std::size_t{type} + 1);
    table.index_of_type[type] = static_cast<std::uint8_t>(*index);
  }
  revised.replaced = room.replaced();
  return revised;
}

namespace {

bool is_inside(IVec3 voxel, const Piece& piece) {
  const IVec3 end = piece.min + piece.size;
  return voxel.x >= piece.min.x && voxel.y >= piece.min.y && voxel.z >= piece.min.z && voxel.x < end.x &&
         voxel.y < end.y && voxel.z < end.z;
}

/// The pieces of a box by position, with a cache of the last lookup.
class PieceMap {
 public:
  explicit PieceMap(const IBox& box) : box_(box) {}

  Piece& of(IVec3 voxel) {
    if (last_ != nullptr && is_inside(voxel, *last_)) return *last_;
    const Cell cell = cell_of(voxel, box_.min);
    last_ = &pieces_.try_emplace(cell, piece_at(cell, box_)).first->second;
    return *last_;
  }

  void count(const Chunk& chunk, IVec3 origin) {
    const IBox bounds = chunk.bounds();
    const IVec3 low = origin + bounds.min;
    if (cell_of(low, box_.min) == cell_of(origin + bounds.max - 1, box_.min)) {
      of(low).voxels += static_cast<std::size_t>(chunk.non_air_count());
    } else {
      visit_voxels(chunk, origin, [&](IVec3 voxel, VoxelType) { ++of(voxel).voxels; });
    }
  }

  std::vector<Piece> take() {
    if (pieces_.empty()) pieces_.emplace(Cell{}, piece_at(Cell{}, box_));
    std::vector<Piece> sorted;
    sorted.reserve(pieces_.size());
    for (const auto& [cell, piece] : pieces_) sorted.push_back(piece);
    return sorted;
  }

 private:
  IBox box_;
  std::map<Cell, Piece> pieces_;
  Piece* last_ = nullptr;
};

/// The write position of each piece's next voxel.
class Cursors {
 public:
  Cursors(std::span<const Piece> pieces, std::span<const std::size_t> starts)
      : pieces_(pieces), next_(starts.begin(), starts.end()) {
    for (std::size_t i = 0; i < pieces_.size(); ++i) number_of_.emplace(cell(pieces_[i].min), i);
  }

  /// Returns the piece that contains a voxel. Requires: there is one.
  std::size_t piece_of(IVec3 voxel) {
    if (is_inside(voxel, pieces_[last_])) return last_;
    const auto found = number_of_.find(cell(voxel));
    QUOIN_ASSERT(found != number_of_.end(), "a voxel of one of the pieces");
    last_ = found->second;
    return last_;
  }
  std::size_t advance(std::size_t piece) { return std::exchange(next_[piece], next_[piece] + 4); }

 private:
  /// Relative to the first piece.
  [[nodiscard]] Cell cell(IVec3 voxel) const {
    Cell found{};
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t offset = std::int64_t{voxel[axis]} - pieces_.front().min[axis];
      found[static_cast<std::size_t>(axis)] = (offset - (offset < 0 ? kMaxModelEdge - 1 : 0)) / kMaxModelEdge;
    }
    return found;
  }

  std::span<const Piece> pieces_;
  std::map<Cell, std::size_t> number_of_;
  std::vector<std::size_t> next_;
  std::size_t last_ = 0;
};

}  // namespace

std::vector<Piece> cut_into_pieces(const SceneGrid& grid) {
  IBox box = grid.declared_box();
  if (box.empty()) box = {box.min, box.min + 1};
  PieceMap pieces(box);
  for (const IVec3 at : grid.grid.chunks()) pieces.count(*grid.grid.find_chunk(at), at * kChunkEdge);
  return pieces.take();
}

void write_voxels(const Grid& grid, const std::vector<std::uint8_t>& index_of_type, std::span<const Piece> pieces,
                  std::span<const std::size_t> starts, std::span<std::byte> out) {
  QUOIN_ASSERT(pieces.size() == starts.size(), "a place for every piece");
  Cursors cursors(pieces, starts);
  visit_voxels(grid, [&](IVec3 voxel, VoxelType type) {
    const std::size_t number = cursors.piece_of(voxel);
    const Piece& piece = pieces[number];
    const IVec3 local = voxel - piece.min;
    const std::size_t at = cursors.advance(number);
    QUOIN_ASSERT(at + 4 <= out.size() && type < index_of_type.size(), "room for the voxel, and a type with a colour");
    std::byte* to = out.data() + at;
    to[0] = static_cast<std::byte>(local.x);
    to[1] = static_cast<std::byte>(piece.size.z - 1 - local.z);
    to[2] = static_cast<std::byte>(local.y);
    to[3] = static_cast<std::byte>(index_of_type[type]);
  });
}

DVec3 pivot_of(const Piece& piece) {
  return DVec3(piece.min) + pivot_of(IVec3{piece.size.x, piece.size.z, piece.size.y});
}

std::optional<double> common_voxel_size(const Scene& scene) {
  constexpr double kRounding = 1e-6;
  std::optional<double> common;
  bool is_same = true;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    if (!common) common = instance.voxel_size;
    is_same = is_same && std::abs(instance.voxel_size - *common) <= kRounding * *common;
  });
  const bool is_scaled = common && is_same && *common != 1.0 && *common > 0.0 && std::isfinite(*common);
  return is_scaled ? common : std::nullopt;
}

Scene divided(const Scene& given, double voxel_size) {
  Scene scene = given.snapshot();
  for (const InstanceHandle handle : scene.instances().handles()) {
    Instance& instance = scene.edit(handle);
    instance.voxel_size = 1.0;
    instance.position /= voxel_size;
  }
  for (const GroupHandle handle : scene.groups().handles()) scene.edit(handle).position /= voxel_size;
  return scene;
}

LoadedScene divided(const LoadedScene& given, double voxel_size) {
  LoadedScene unit;
  unit.scene = divided(given.scene, voxel_size);
  unit.format = given.format;
  unit.camera = given.camera;
  unit.cameras = given.cameras;
  unit.render_settings = given.render_settings;
  unit.last_frame = given.last_frame;
  unit.source = given.source;
  if (unit.camera) unit.camera->position /= voxel_size;
  for (FileCamera& each : unit.cameras) {
    each.camera.position /= voxel_size;
    each.focus_distance /= voxel_size;
  }
  return unit;
}

std::string size_warning(double voxel_size) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", voxel_size);
  return std::string("voxel size left out, not supported by .vox: a voxel was ") + text + " units long";
}

namespace {

/// Finds the source models that are only shown at one key of a transform, so that their pivot may move.
std::vector<bool> models_of_one_key(const VoxSource& source) {
  const Document& document = source.document;
  std::vector<bool> free(document.models.size(), document.models.size() == 1 || !document.nodes.empty());
  std::vector<bool> has_one_key(document.nodes.size());
  for (const PlacedShape& placement : source.placements.all) {
    if (placement.node == kNone || placement.transform_count == 0) continue;
    const std::size_t last = placement.first_transform + placement.transform_count - 1;
    has_one_key[placement.node] = document.nodes[source.placements.chains[last]].key_count == 1;
  }
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    const Node& node = document.nodes[i];
    if (node.kind != NodeKind::Shape || (source.placements.is_tree && node.key_count == 1 && has_one_key[i])) continue;
    for (std::size_t key = 0; key < node.key_count; ++key)
      free[document.model_keys[node.first_key + key].model] = false;
  }
  return free;
}

bool has_same_voxels(const Grid& a, const Grid& b) {
  for (const IVec3 at : a.chunks()) {
    const Chunk& chunk = *a.find_chunk(at);
    const Chunk* other = b.find_chunk(at);
    if (other == nullptr ? chunk.non_air_count() > 0 : !(chunk == *other)) return false;
  }
  for (const IVec3 at : b.chunks()) {
    if (a.find_chunk(at) == nullptr && b.find_chunk(at)->non_air_count() > 0) return false;
  }
  return true;
}

bool fits_a_model(const IBox& box) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::int64_t{box.max[axis]} - box.min[axis] > kMaxModelEdge) return false;
  }
  return true;
}

/// Returns the smallest box around another whose pivot, with MagicaVoxel's rounding, is at a point of the grid.
IBox grown_about(const IBox& box, IVec3 pivot) {
  IBox grown = box;
  for (int axis = 0; axis < 3; ++axis) {
    const int below = pivot[axis] - box.min[axis];
    const int above = box.max[axis] - pivot[axis];
    // For odd lengths the longer half is above the pivot, or below it along the reversed axis.
    const bool turned = axis == 2;
    const int shorter = std::max({turned ? above : below, (turned ? below : above) - 1, 0});
    const int longer = std::max(shorter, turned ? below : above);
    grown.min[axis] = pivot[axis] - (turned ? longer : shorter);
    grown.max[axis] = pivot[axis] + (turned ? shorter : longer);
  }
  return grown;
}

Piece piece_of(const IBox& box) {
  return {box.min, box.max - box.min, 0};
}

/// Plans a grid that was a model of the source. Returns false if it becomes new models.
bool plan_in_place(const SceneGrid& now, const VoxSource& source, std::size_t model, bool may_move, GridPlan& plan) {
  const SceneGrid& before = source.scene.grids()[plan.grid];
  const IBox box = canvas_of(source.document.models[model].size);
  IBox wanted = now.canvas == before.canvas ? unite(box, now.grid.bounds()) : now.declared_box();
  if (wanted.empty()) wanted = {wanted.min, wanted.min + 1};
  if (!fits_a_model(wanted)) return false;
  if (!(wanted == box) && !may_move) {
    // Too far from the pivot for one model.
    if (!fits_a_model(unite(wanted, box))) return false;
    wanted = grown_about(wanted, IVec3(pivot_of(source.document.models[model].size)));
    if (!fits_a_model(wanted)) return false;
  }
  plan.source_model = model;
  plan.first_model = static_cast<std::uint32_t>(model);
  plan.is_resized = !(wanted == box);
  plan.is_changed = plan.is_resized || !has_same_voxels(now.grid, before.grid);
  plan.pieces = {piece_of(wanted)};
  return true;
}

/// Returns the content of a TDCZ: its size, then the compressed colour indices of the whole box.
Result<std::vector<std::byte>> packed(IVec3 model_size, std::span<const std::byte> colours) {
  QUOIN_ASSERT(colours.size() == static_cast<std::size_t>(model_size.x) * static_cast<std::size_t>(model_size.y) *
                                     static_cast<std::size_t>(model_size.z),
               "one colour per voxel");
  ChunkWriter out;
  for (int axis = 0; axis < 3; ++axis) out.i32(model_size[axis]);
  uLongf bytes = compressBound(static_cast<uLong>(colours.size()));
  std::vector<std::byte> compressed(bytes);
  const int status =
      compress2(reinterpret_cast<Bytef*>(compressed.data()), &bytes, reinterpret_cast<const Bytef*>(colours.data()),
                static_cast<uLong>(colours.size()), Z_DEFAULT_COMPRESSION);
  if (status != Z_OK) return make_error(ErrorCode::LimitExceeded, "cannot compress voxels: out of memory");
  compressed.resize(bytes);
  out.raw(compressed);
  return out.take();
}

}  // namespace

const GridPlan* ModelPlan::find(GridHandle grid) const {
  const auto found = std::ranges::lower_bound(grids, grid, std::less<>(), &GridPlan::grid);
  return found != grids.end() && found->grid == grid ? &*found : nullptr;
}

ModelPlan plan_models(const Scene& scene, const VoxSource& source, bool keeps_graph) {
  ModelPlan plan;
  plan.count = static_cast<std::uint32_t>(source.document.models.size());
  const std::vector<bool> of_one_key = models_of_one_key(source);
  for (const GridHandle handle : scene.grids().handles()) {
    GridPlan& grid = plan.grids.emplace_back();
    grid.grid = handle;
    const bool was_there = source.scene.grids().find(handle) != nullptr;
    if (was_there &&
        plan_in_place(scene.grids()[handle], source, handle.index, !keeps_graph || of_one_key[handle.index], grid)) {
      continue;
    }
    grid.pieces = cut_into_pieces(scene.grids()[handle]);
    grid.first_model = plan.count;
    plan.count += static_cast<std::uint32_t>(grid.pieces.size());
  }
  return plan;
}

namespace {

/// The colour indices of a box in TDCZ order: x fastest, then y, then z, along the file's axes. 0 is air.
class ColourBox {
 public:
  ColourBox(const Grid& grid, const Piece& piece, const std::vector<std::uint8_t>& index_of_type)
      : size_(piece.size.x, piece.size.z, piece.size.y),
        colours_(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y) *
                 static_cast<std::size_t>(size_.z)) {
    visit_voxels(grid, [&](IVec3 voxel, VoxelType type) {
      const IVec3 local = voxel - piece.min;
      QUOIN_ASSERT((IBox{IVec3{0}, piece.size}.contains(local)), "the piece holds all of the grid");
      QUOIN_ASSERT(type < index_of_type.size(), "a type that has a colour");
      colours_[place({local.x, piece.size.z - 1 - local.z, local.y})] = static_cast<std::byte>(index_of_type[type]);
    });
  }

  [[nodiscard]] IVec3 size() const { return size_; }
  [[nodiscard]] std::size_t place(IVec3 at) const {
    QUOIN_ASSERT((IBox{IVec3{0}, size_}.contains(at)), "a voxel of the box");
    return (static_cast<std::size_t>(at.z) * static_cast<std::size_t>(size_.y) + static_cast<std::size_t>(at.y)) *
               static_cast<std::size_t>(size_.x) +
           static_cast<std::size_t>(at.x);
  }
  [[nodiscard]] bool contains(IVec3 at) const { return at.x < size_.x && at.y < size_.y && at.z < size_.z; }
  /// Returns a voxel's colour and sets the voxel to air.
  std::byte take(std::size_t place) {
    QUOIN_ASSERT(place < colours_.size(), "a place of the box");
    return std::exchange(colours_[place], std::byte{0});
  }
  [[nodiscard]] std::span<const std::byte> colours() const { return colours_; }

 private:
  IVec3 size_;
  std::vector<std::byte> colours_;
};

using FileVoxel = std::array<std::byte, 4>;

/// Returns the remaining voxels of the file, from last to first: if a position occurs twice, the last one counts.
std::vector<FileVoxel> kept_backwards(std::span<const std::byte> voxels, bool keeps_unseen, ColourBox& box) {
  std::vector<FileVoxel> kept;
  for (std::size_t i = voxels.size() / 4; i-- > 0;) {
    FileVoxel voxel{voxels[4 * i], voxels[4 * i + 1], voxels[4 * i + 2], voxels[4 * i + 3]};
    const IVec3 at{static_cast<int>(voxel[0]), static_cast<int>(voxel[1]), static_cast<int>(voxel[2])};
    if (!box.contains(at) || voxel[3] == std::byte{0}) {
      if (keeps_unseen) kept.push_back(voxel);
      continue;
    }
    voxel[3] = box.take(box.place(at));
    if (voxel[3] != std::byte{0}) kept.push_back(voxel);
  }
  return kept;
}

}  // namespace

Result<std::vector<std::byte>> revised_voxels(const Grid& grid, const GridPlan& plan, const VoxSource& source,
                                              const std::vector<std::uint8_t>& index_of_type) {
  QUOIN_ASSERT(plan.source_model < source.document.models.size() && plan.pieces.size() == 1, "a model of the source");
  const Model& model = source.document.models[plan.source_model];
  ColourBox box(grid, plan.pieces.front(), index_of_type);
  if (model.packed_end > 0) return packed(box.size(), box.colours());
  // A resized box gets new positions, so the old order is meaningless.
  const std::span<const std::byte> before = plan.is_resized ? std::span<const std::byte>{} : model.voxels;
  std::vector<FileVoxel> voxels = kept_backwards(before, !plan.is_resized, box);
  std::ranges::reverse(voxels);
  const IVec3 size = box.size();
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        const std::byte colour = box.take(box.place({x, y, z}));
        if (colour == std::byte{0}) continue;
        voxels.push_back({static_cast<std::byte>(x), static_cast<std::byte>(y), static_cast<std::byte>(z), colour});
      }
    }
  }
  ChunkWriter out;
  out.reserve(4 + 4 * voxels.size());
  out.u32(static_cast<std::uint32_t>(voxels.size()));
  out.raw(std::as_bytes(std::span(voxels)));
  return out.take();
}

namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kUsualFov = 45.0;

bool is_same(const FileCamera& a, const FileCamera& b) {
  return a.camera == b.camera && a.focus_distance == b.focus_distance;
}

std::vector<FileCamera> wanted_cameras(const LoadedScene& loaded, const Document& document) {
  std::vector<FileCamera> all = loaded.cameras;
  const auto is_first = [&](const FileCamera& one) { return one.camera == *loaded.camera; };
  if (!loaded.camera || std::ranges::any_of(all, is_first)) return all;
  std::set<std::int32_t> taken;
  for (const FileCamera& one : all) taken.insert(one.number);
  for (const CameraChunk& one : document.cameras) taken.insert(one.id);
  std::int32_t number = 0;
  while (taken.contains(number)) ++number;
  all.insert(all.begin(), {number, *loaded.camera});
  return all;
}

void plan_cameras(const LoadedScene& loaded, const VoxSource& source, ViewPlan& plan) {
  std::vector<std::string> said_before;
  const std::vector<FileCamera> before =
      cameras_of(source.document, source.scene.bounds(InstanceFilter::All), said_before);
  const std::vector<FileCamera> wanted = wanted_cameras(loaded, source.document);
  for (const FileCamera& one : wanted) {
    const auto known = std::ranges::find(before, one.number, &FileCamera::number);
    if (known != before.end() && is_same(*known, one)) continue;
    if (plan.cameras.emplace(one.number, one).second) plan.order.push_back(one.number);
  }
  for (const FileCamera& one : before) {
    if (std::ranges::find(wanted, one.number, &FileCamera::number) == wanted.end()) plan.removed.push_back(one.number);
  }
}

// Returns true if there are settings other than the sun's.
bool says_more(const FileRenderSettings& all) {
  Environment only_sun;
  only_sun.sun = all.environment.sun;
  only_sun.sky.model = SkyModel::Uniform;
  only_sun.exposure = 1.0;
  only_sun.tone = ToneCurve::Aces;
  return all.environment != only_sun || all.lens != Lens{};
}

bool says_more(const Environment& all) {
  Environment only_sun;
  only_sun.sun = all.sun;
  return all != only_sun;
}

std::string text_of(double x, double y, double z) {
  return to_text(static_cast<float>(x)) + " " + to_text(static_cast<float>(y)) + " " + to_text(static_cast<float>(z));
}

}  // namespace

ViewPlan plan_view(const LoadedScene& loaded, const VoxSource& source, bool is_new) {
  ViewPlan plan;
  plan_cameras(loaded, source, plan);
  const std::optional<Environment>& environment = loaded.scene.environment;
  const std::optional<FileRenderSettings>& settings = loaded.render_settings;
  if (!environment && !settings) return plan;
  const Sun& wanted = environment ? environment->sun : settings->environment.sun;
  const auto before = render_settings_of(source.document);
  if (!before || before->environment.sun != wanted) plan.sun = wanted;
  plan.has_more_settings = is_new && (settings ? says_more(*settings) : says_more(*environment));
  return plan;
}

void set_camera_keys(const FileCamera& file_camera, Entries& keys) {
  const Camera& camera = file_camera.camera;
  const bool is_flat = camera.projection == Camera::Projection::Orthographic;
  const double fov = is_flat ? kUsualFov / kDegrees : camera.vertical_fov_radians;
  const double half = std::tan(fov / 2.0);
  const double radius = is_flat ? camera.view_height / (2.0 * half) : file_camera.focus_distance;
  const DVec3 focus = camera.position + camera.forward * radius;
  const double pitch = std::asin(std::clamp(camera.forward.y, -1.0, 1.0));
  // If the camera looks straight up or down, the yaw is the whole rotation of the image.
  constexpr double kLeast = 1e-6;
  const bool is_upright = std::hypot(camera.forward.x, camera.forward.z) < kLeast;
  const double yaw =
      is_upright ? std::atan2(-camera.right.z, camera.right.x) : std::atan2(-camera.forward.x, -camera.forward.z);
  const DVec3 level(std::cos(yaw), 0.0, -std::sin(yaw));
  const double roll =
      std::atan2(glm::dot(camera.right, glm::cross(level, camera.forward)), glm::dot(camera.right, level));
  DVec3 angle = DVec3(pitch, yaw, roll) * kDegrees;
  // Unused cameras have these values.
  const bool looks_unset = focus == DVec3(0.0) && angle == DVec3(0.0) && (radius == 0.0 || radius == 1.0);
  if (looks_unset) angle.z = 360.0;
  keys.set("_mode", is_flat ? "orth" : "pers");
  keys.set("_focus", text_of(focus.x, -focus.z, focus.y));
  keys.set("_angle", text_of(angle.x, angle.y, angle.z));
  keys.set("_radius", to_text(static_cast<float>(radius)));
  keys.set("_frustum", to_text(static_cast<float>(half)));
  keys.set("_fov", to_text(static_cast<float>(fov * kDegrees)));
}

void set_sun_keys(const Sun& sun, Entries& keys) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  const DVec3 towards = sun.unit_direction();
  const float most = std::max({sun.colour.x, sun.colour.y, sun.colour.z, 1.0F});
  const auto byte = [&](float channel) { return std::to_string(int{encode(channel / most)}); };
  const double pitch = std::asin(std::clamp(towards.y, -1.0, 1.0));
  const double yaw = std::atan2(towards.x, towards.z);
  keys.set("_type", "_inf");
  keys.set("_i", to_text(static_cast<float>(sun.brightness * static_cast<double>(most))));
  keys.set("_k", byte(sun.colour.x) + " " + byte(sun.colour.y) + " " + byte(sun.colour.z));
  keys.set("_angle", to_text(static_cast<float>(pitch * kDegrees)) + " " + to_text(static_cast<float>(yaw * kDegrees)));
  keys.set("_area", to_text(static_cast<float>(std::tan(sun.angle_radians / 2.0))));
  keys.set("_disk", sun.is_visible ? "1" : "0");
}

std::optional<std::int32_t> camera_number(std::string_view id, std::span<const std::byte> content) {
  if (id != "rCAM" || content.size() < sizeof(std::int32_t)) return std::nullopt;
  return ChunkReader(content, "rCAM", 0, 0, content.size()).i32();
}

bool is_sun(std::string_view id, std::span<const std::byte> content) {
  if (id != "rOBJ") return false;
  ChunkReader reader(content, "rOBJ", 0, 0, content.size());
  const Dict keys = reader.dict();
  return !reader.failed() && keys.get("_type") == "_inf";
}

}  // namespace quoin::vox

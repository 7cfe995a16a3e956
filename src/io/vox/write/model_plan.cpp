#include "io/vox/write/model_plan.h"

#include <algorithm>
#include <array>

#include <zlib.h>

#include <quoin/core/assert.h>

#include "io/vox/chunks.h"

namespace quoin::vox {

namespace {

/// Finds the source models that are only shown at one key of a transform, so that their pivot may move.
std::vector<bool> models_of_one_key(const VoxSource& source) {
  const Document& document = source.document;
  std::vector<bool> free(document.models.size(), document.models.size() == 1 || !document.nodes.empty());
  std::vector<bool> has_one_key(document.nodes.size());
  for (const Placement& placement : source.placements.all) {
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

}  // namespace quoin::vox

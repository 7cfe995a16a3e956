#include "stream/edit_fit.h"

#include <algorithm>
#include <utility>
#include <variant>

#include <quoin/core/assert.h>

namespace quoin::stream {

Status check_types(const WorldEdit& edit, const VoxelRegistry& types) {
  const auto is_known = [&](VoxelType type) { return type < types.size(); };
  bool fits = true;
  if (const auto* const set = std::get_if<WorldEdit::SetVoxels>(&edit.content)) {
    fits = std::ranges::all_of(set->voxels, is_known, &PlacedVoxel::type);
  } else if (const auto* const box = std::get_if<WorldEdit::FillBox>(&edit.content)) {
    fits = is_known(box->type);
  } else if (const auto* const ball = std::get_if<WorldEdit::FillSphere>(&edit.content)) {
    fits = is_known(ball->type);
  } else if (const auto* const field_ball = std::get_if<WorldEdit::FieldSphere>(&edit.content)) {
    fits = is_known(field_ball->material);
  } else if (const auto* const field_box = std::get_if<WorldEdit::FieldBox>(&edit.content)) {
    fits = is_known(field_box->material);
  }
  if (fits) return {};
  return make_error(ErrorCode::InvalidArgument, "the edit uses a type that the world does not have");
}

std::int64_t apply_fitting(const WorldEdit& edit, Grid& grid, DensityGrid& field, const VoxelRegistry& types) {
  if (const auto* const set = std::get_if<WorldEdit::SetData>(&edit.content)) {
    const VoxelType type = grid.get(set->voxel);
    if (type >= types.size()) return 0;
    const std::uint8_t bits = types[type].state_bits;
    if (bits < 32 && set->state >> bits != 0) return 0;
  }
  return apply_edit(edit, grid, field);
}

void keep_for(const WorldEdit& edit, const std::vector<IVec3>& chunks, WaitingEdits& waiting) {
  QUOIN_ASSERT(!chunks.empty(), "at least one chunk");
  const auto* const set = std::get_if<WorldEdit::SetVoxels>(&edit.content);
  if (set == nullptr) {
    const auto shared = std::make_shared<const WorldEdit>(edit);
    for (const IVec3 chunk : chunks) waiting[chunk].push_back(shared);
    return;
  }
  std::unordered_map<IVec3, WorldEdit::SetVoxels, CoordinateHash> parts;
  for (const IVec3 chunk : chunks) parts[chunk];
  for (const PlacedVoxel& voxel : set->voxels) {
    const auto part = parts.find(chunk_of(voxel.voxel));
    if (part != parts.end()) part->second.voxels.push_back(voxel);
  }
  for (auto& [chunk, part] : parts) {
    waiting[chunk].push_back(std::make_shared<const WorldEdit>(WorldEdit{edit.grid, std::move(part)}));
  }
}

}  // namespace quoin::stream

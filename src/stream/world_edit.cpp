#include <quoin/stream/world_edit.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <variant>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"
#include "core/coordinates/long_box.h"
#include "stream/edit_fit.h"

namespace quoin {
namespace {

template <class... Each>
struct Overloaded : Each... {
  using Each::operator()...;
};
template <class... Each>
Overloaded(Each...) -> Overloaded<Each...>;

bool is_length(double value) {
  return std::isfinite(value) && value >= 0.0;
}

Error not_sound(const char* what) {
  return make_error(ErrorCode::InvalidArgument,
                    std::string(what) + ": coordinates must be finite, lengths finite and not negative");
}

Result<std::vector<IVec3>> chunks_of_box(const LongBox& wanted) {
  const LongBox box = clipped(wanted);
  std::vector<IVec3> chunks;
  if (is_empty(box)) return chunks;
  const IBox range = chunks_of(box);
  const DVec3 size(range.size());
  if (size.x * size.y * size.z > static_cast<double>(kMaxEditChunks)) {
    return make_error(ErrorCode::LimitExceeded,
                      "an edit must not touch more than " + std::to_string(kMaxEditChunks) + " chunks");
  }
  for (int z = range.min.z; z < range.max.z; ++z) {
    for (int y = range.min.y; y < range.max.y; ++y) {
      for (int x = range.min.x; x < range.max.x; ++x) chunks.push_back({x, y, z});
    }
  }
  return chunks;
}

Result<std::vector<IVec3>> chunks_of_voxels(std::span<const PlacedVoxel> voxels) {
  std::vector<IVec3> chunks;
  for (const PlacedVoxel& each : voxels) {
    const IVec3 at = chunk_of(each.voxel);
    if (is_inside_world(at) && (chunks.empty() || chunks.back() != at)) chunks.push_back(at);
  }
  sort_and_unite(chunks);
  if (chunks.size() > kMaxEditChunks) {
    return make_error(ErrorCode::LimitExceeded,
                      "an edit must not touch more than " + std::to_string(kMaxEditChunks) + " chunks");
  }
  return chunks;
}

}  // namespace

Result<std::vector<IVec3>> chunks_of_edit(const WorldEdit& edit, float band) {
  using Chunks = Result<std::vector<IVec3>>;
  return std::visit(
      Overloaded{[](const WorldEdit::SetVoxels& set) { return chunks_of_voxels(set.voxels); },
                 [](const WorldEdit::SetData& set) -> Chunks {
                   if (set.bytes.size() > kMaxVoxelDataBytes) {
                     return make_error(ErrorCode::LimitExceeded, "the data exceeds the limit of a voxel");
                   }
                   const PlacedVoxel voxel{set.voxel, 0};
                   return chunks_of_voxels({&voxel, 1});
                 },
                 [](const WorldEdit::FillBox& fill) { return chunks_of_box(box_from(fill.box)); },
                 [](const WorldEdit::FillSphere& fill) -> Chunks {
                   if (!is_finite(fill.centre) || !is_length(fill.radius)) return not_sound("sphere");
                   return chunks_of_box(box_around(fill.centre - fill.radius, fill.centre + fill.radius));
                 },
                 [&](const WorldEdit::FieldSphere& sphere) -> Chunks {
                   if (!is_finite(sphere.centre) || !is_length(sphere.radius) || !is_length(sphere.blend)) {
                     return not_sound("sphere");
                   }
                   const double reach = sphere.radius + double{band};
                   return chunks_of_box(box_around(sphere.centre - reach, sphere.centre + reach));
                 },
                 [&](const WorldEdit::FieldBox& box) -> Chunks {
                   if (!is_finite(box.min) || !is_finite(box.max) || !is_length(box.rounding) ||
                       !is_length(box.blend)) {
                     return not_sound("box");
                   }
                   return chunks_of_box(box_around(box.min - double{band}, box.max + double{band}));
                 }},
      edit.content);
}

std::int64_t apply_edit(const WorldEdit& edit, Grid& grid, DensityGrid& field) {
  return std::visit(Overloaded{[&](const WorldEdit::SetVoxels& set) { return grid.set(set.voxels); },
                               [&](const WorldEdit::SetData& set) {
                                 return std::int64_t{grid.set_data(set.voxel, {set.state, set.bytes})};
                               },
                               [&](const WorldEdit::FillBox& fill) { return grid.fill_box(fill.box, fill.type); },
                               [&](const WorldEdit::FillSphere& fill) {
                                 return grid.fill_sphere(fill.centre, fill.radius, fill.type);
                               },
                               [&](const WorldEdit::FieldSphere& sphere) {
                                 if (sphere.material == kAir)
                                   return field.remove_sphere(sphere.centre, sphere.radius, sphere.blend);
                                 return field.add_sphere(sphere.centre, sphere.radius, sphere.material, sphere.blend);
                               },
                               [&](const WorldEdit::FieldBox& box) {
                                 if (box.material == kAir)
                                   return field.remove_box(box.min, box.max, box.rounding, box.blend);
                                 return field.add_box(box.min, box.max, box.material, box.rounding, box.blend);
                               }},
                    edit.content);
}

}  // namespace quoin

namespace quoin::stream {

Status check_types(const WorldEdit& edit, const VoxelRegistry& types) {
  VoxelType unknown = kAir;
  const auto is_known = [&](VoxelType type) {
    if (type < types.size()) return true;
    unknown = type;
    return false;
  };
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
  return make_error(ErrorCode::InvalidArgument,
                    "the edit uses type " + std::to_string(unknown) + ", which the world does not have");
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

std::optional<StoredChunk> edited(const std::vector<std::shared_ptr<const WorldEdit>>& edits, IVec3 at,
                                  const StoredChunk& chunk, float band, const VoxelRegistry& types) {
  // Uses grids that hold this chunk only: the edits' effects elsewhere are dropped.
  Grid voxels;
  voxels.make_partial();
  voxels.load_chunk(at, chunk.voxels);
  DensityGrid field(band);
  field.make_partial();
  if (chunk.densities) {
    field.load_chunk(at, *chunk.densities);
  } else {
    field.load_air_chunk(at);
  }
  std::int64_t changed = 0;
  for (const auto& edit : edits) changed += apply_fitting(*edit, voxels, field, types);
  if (changed == 0) return std::nullopt;
  StoredChunk result;
  if (const Chunk* const now = voxels.find_chunk(at)) result.voxels = *now;
  if (const DensityChunk* const now = field.find_chunk(at)) result.densities = *now;
  return result;
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

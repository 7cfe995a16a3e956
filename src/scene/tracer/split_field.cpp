#include "scene/tracer/split_field.h"

#include <algorithm>
#include <vector>

#include "mesh/surface/bodies.h"
#include "trace/glass_rows.h"

namespace quoin {
namespace {

constexpr std::uint32_t kOpaqueBody = 0;

}  // namespace

SplitField::SplitField(const DensityGrid& whole, const VoxelRegistry& types)
    : whole_(&whole),
      opaque_field_(smooth::field_of_body(whole, types, kOpaqueBody, Threads{1})),
      glass_(whole, types) {
  (void)opaque_field_.changes_since(followed_opaque_);
  opaque_.emplace(opaque_field_);
}

void SplitField::update(const VoxelRegistry& types, const DensityChanges& changes) {
  for (const DensityChange& change : changes.items) {
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
  return std::any_of(changes.items.begin(), changes.items.end(), [&](const DensityChange& change) {
    const DensityChunk* const chunk = field.find_chunk(change.chunk);
    return chunk != nullptr && trace::has_glass(*chunk, types);
  });
}

}  // namespace quoin

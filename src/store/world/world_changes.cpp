#include "store/world/world_changes.h"

#include <string>
#include <utility>

#include <quoin/core/assert.h>

#include "store/world/part_text.h"

namespace quoin::store {

void ChangeSet::remove_grid(std::uint32_t number) {
  std::erase_if(chunks, [&](const auto& each) { return each.first.grid == number; });
  parts.insert_or_assign({part::kGrid, std::int64_t{number}}, std::nullopt);
  removed_grids.insert(number);
}

void ChangeSet::add(ChangeSet&& later) {
  chunks.reserve(chunks.size() + later.chunks.size());
  // No allocation from here on: existing nodes move one by one.
  for (const std::uint32_t grid : later.removed_grids) {
    std::erase_if(chunks, [&](const auto& each) { return each.first.grid == grid; });
  }
  removed_grids.merge(later.removed_grids);
  while (!later.chunks.empty()) {
    auto node = later.chunks.extract(later.chunks.begin());
    chunks.erase(node.key());
    chunks.insert(std::move(node));
  }
  while (!later.parts.empty()) {
    auto node = later.parts.extract(later.parts.begin());
    parts.erase(node.key());
    parts.insert(std::move(node));
  }
  later.removed_grids.clear();
}

}  // namespace quoin::store

namespace quoin {

WorldChanges::WorldChanges() : content_(std::make_unique<store::ChangeSet>()) {}
WorldChanges::WorldChanges(WorldChanges&&) noexcept = default;
WorldChanges& WorldChanges::operator=(WorldChanges&&) noexcept = default;
WorldChanges::~WorldChanges() = default;

void WorldChanges::put_chunk(const ChunkAddress& address, StoredChunk chunk) {
  content_->chunks.insert_or_assign(address, std::move(chunk));
}

void WorldChanges::remove_chunk(const ChunkAddress& address) {
  content_->chunks.insert_or_assign(address, std::nullopt);
}

void WorldChanges::put_types(const VoxelRegistry& types, VoxelType first) {
  for (std::size_t type = std::max<VoxelType>(first, 1); type < types.size(); ++type) {
    put_type(static_cast<VoxelType>(type), types[static_cast<VoxelType>(type)]);
  }
}

void WorldChanges::put_type(VoxelType type, const VoxelProperties& properties) {
  QUOIN_ASSERT(type != kAir, "a type other than air");
  WorldParts::put(*this, store::part::kType, type, store::text_of(properties));
}

void WorldChanges::put_grid(std::uint32_t number, const WorldGrid& grid) {
  WorldParts::put(*this, store::part::kGrid, number, store::text_of(grid));
}

void WorldChanges::remove_grid(std::uint32_t number) {
  content_->remove_grid(number);
}

void WorldChanges::put_value(std::string name, std::vector<std::byte> bytes) {
  WorldParts::put(*this, {store::part::kValue, std::move(name)}, std::move(bytes));
}

void WorldChanges::remove_value(std::string name) {
  WorldParts::put(*this, {store::part::kValue, std::move(name)}, std::nullopt);
}

void WorldChanges::put_thumbnail(std::vector<std::byte> png) {
  WorldParts::put(*this, {store::part::kThumbnail, std::int64_t{0}}, std::move(png));
}

void WorldChanges::remove_thumbnail() {
  WorldParts::put(*this, {store::part::kThumbnail, std::int64_t{0}}, std::nullopt);
}

bool WorldChanges::empty() const {
  return content_->empty();
}

std::size_t WorldChanges::chunk_count() const {
  return content_->chunks.size();
}

void WorldParts::put(WorldChanges& changes, store::PartKey key, std::optional<PartBody> body) {
  changes.content().parts.insert_or_assign(std::move(key), std::move(body));
}

void WorldParts::put(WorldChanges& changes, const char* kind, std::int64_t id, std::string_view text) {
  put(changes, {kind, id}, store::body_of(text));
}

void WorldParts::remove(WorldChanges& changes, const char* kind, std::int64_t id) {
  put(changes, {kind, id}, std::nullopt);
}

}  // namespace quoin

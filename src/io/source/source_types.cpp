#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include <quoin/core/function_ref.h>
#include <quoin/io/chunk_source.h>

#include "grid/chunk/chunk_storage.h"

namespace quoin {

namespace {

/// Orders types by their properties, independent of the order of discovery.
bool comes_before(const VoxelProperties& a, const VoxelProperties& b) {
  const auto key = [](const VoxelProperties& p) {
    const std::array colour{p.colour.r, p.colour.g, p.colour.b, p.colour.a};
    const std::tuple rest(colour, p.visibility, p.collides, p.state_bits, p.emission, p.roughness, p.metalness, p.ior,
                          p.scattering, p.anisotropy);
    return std::tuple<const std::string&, const std::map<std::string, std::string>&, decltype(rest)>(
        p.name, p.attributes, rest);
  };
  return key(a) < key(b);
}

/// Requires: the chunk is compact; `number` maps its types to distinct numbers, and only air to air.
Chunk renumbered(const Chunk& chunk, FunctionRef<VoxelType(VoxelType)> number) {
  if (const auto uniform = chunk.uniform()) {
    Chunk result(number(*uniform));
    chunk.for_each_data([&](IVec3 local, const VoxelData& data) { result.set_data(local, data); });
    return result;
  }
  const ChunkStorage& from = *ChunkStorage::of(chunk);
  Chunk result;
  if (from.direct()) {
    std::array<VoxelType, kChunkEdge> row{};
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        chunk.read_row(y, z, row);
        for (VoxelType& type : row) type = number(type);
        result.write_row(y, z, row);
      }
    }
  } else {
    auto storage = make_ref<ChunkStorage>(from);
    for (std::size_t i = 0; i < storage->palette.size(); ++i) {
      QUOIN_ASSERT(storage->counts[i] > 0, "a compact chunk");
      storage->palette[i] = number(storage->palette[i]);
    }
    result = ChunkStorage::chunk_of(std::move(storage));
  }
  chunk.for_each_data([&](IVec3 local, const VoxelData& data) { result.set_data(local, data); });
  return result;
}

}  // namespace

Status SourceTypes::renumber(Chunk& chunk, VoxelRegistry& into) {
  chunk.compact();
  std::vector<VoxelType> fresh;
  for (const VoxelType type : chunk.types()) {
    if (type != kAir && (type >= numbers_.size() || numbers_[type] == kAir)) fresh.push_back(type);
  }
  if (!fresh.empty()) {
    if (fresh.back() >= known_.size()) known_ = source_->types();
    QUOIN_ASSERT(fresh.back() < known_.size(), "a chunk of the source");
    std::ranges::sort(fresh, [&](VoxelType a, VoxelType b) { return comes_before(known_[a], known_[b]); });
    numbers_.resize(known_.size(), kAir);
  }
  for (const VoxelType type : fresh) {
    const auto number = into.find_or_add(known_[type]);
    if (!number) return number.error();
    numbers_[type] = *number;
  }
  chunk = renumbered(chunk, [&](VoxelType type) { return numbers_[type]; });
  return {};
}

}  // namespace quoin

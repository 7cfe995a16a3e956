#include "render_vk/march/device_grid.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace quoin::vulkan {
namespace {

constexpr std::size_t kPage = 4096;

ShaderTree shader_tree(const TopTree& top, const OccupancyTree* tree, IVec3 origin) {
  ShaderTree shader;
  if (tree == nullptr || top.root.mask == 0) return shader;
  const IBox bounds = tree->bounds();
  shader.root = top.root;
  shader.low = IVec4(bounds.min - origin, top.root_level);
  shader.high = IVec4(bounds.max - origin, 0);
  return shader;
}

}  // namespace

void DeviceGrid::release(DeviceMemory& memory) {
  for (auto& [at, chunk] : chunks_) memory.release(chunk.place);
  memory.release(opaque_.place);
  memory.release(transparent_.place);
  *this = {};
}

std::uint64_t DeviceGrid::bytes() const {
  std::uint64_t sum = opaque_.place.size + transparent_.place.size;
  for (const auto& [at, chunk] : chunks_) sum += chunk.place.size;
  return sum;
}

Status DeviceGrid::update(DeviceMemory& memory, const Grid& grid, const OccupancyTree& opaque,
                          const OccupancyTree* transparent) {
  ChangeCursor now = followed_;
  const GridChanges changes = grid.changes_since(now);
  if (changes.empty()) return {};
  if (changes.all) {
    release(memory);
    for (const IVec3 at : grid.chunks()) {
      if (Status done = put_chunk(memory, grid, opaque, transparent, at); !done) return done;
    }
  }
  for (const ChunkChange& change : changes.items) {
    if (Status done = put_chunk(memory, grid, opaque, transparent, change.chunk); !done) return done;
  }
  origin_ = chunk_of(grid.bounds().min);
  if (Status done = put_top(memory, opaque_, &DeviceChunk::opaque); !done) return done;
  if (Status done = put_top(memory, transparent_, &DeviceChunk::transparent); !done) return done;
  shader_grid_ = {shader_tree(opaque_.top, &opaque, origin()), shader_tree(transparent_.top, transparent, origin())};
  followed_ = now;
  return {};
}

Status DeviceGrid::put_chunk(DeviceMemory& memory, const Grid& grid, const OccupancyTree& opaque,
                             const OccupancyTree* transparent, IVec3 chunk) {
  const Chunk* voxels = grid.find_chunk(chunk);
  if (voxels == nullptr) {
    const auto old = chunks_.find(chunk);
    if (old == chunks_.end()) return {};
    memory.release(old->second.place);
    chunks_.erase(old);
    return {};
  }
  DeviceChunk& entry = chunks_[chunk];
  memory.release(entry.place);
  ChunkRecord record = pack_chunk(opaque, transparent, *voxels, chunk);
  const auto place = memory.allocate(record.words.size() * 4, "uploading voxels");
  if (!place) return place.error();
  entry.place = *place;
  record.move_to(place->address);
  entry.opaque = record.opaque;
  entry.transparent = record.transparent;
  return memory.write(entry.place, std::as_bytes(std::span(record.words)));
}

Status DeviceGrid::put_top(DeviceMemory& memory, DeviceTree& tree, Node DeviceChunk::*node) {
  std::vector<ChunkNodeAt> chunks;
  for (const auto& [at, chunk] : chunks_) {
    if ((chunk.*node).mask != 0) chunks.push_back({at - origin_, chunk.*node});
  }
  TopTree top = build_top_tree(chunks, tree.place.address);
  const std::size_t bytes = top.nodes.size() * sizeof(Node);
  if (bytes > tree.place.size) {
    memory.release(tree.place);
    // Half as much again, so that a growing world does not move each time.
    const auto place = memory.allocate(bytes + bytes / 2, "uploading voxels");
    if (!place) return place.error();
    tree.place = *place;
    tree.top.nodes.clear();
    top = build_top_tree(std::move(chunks), tree.place.address);
  }
  // Only the pages that changed.
  constexpr std::size_t kNodes = kPage / sizeof(Node);
  const std::span<const Node> now(top.nodes);
  const std::span<const Node> before(tree.top.nodes);
  for (std::size_t first = 0; first < now.size(); first += kNodes) {
    const auto page = now.subspan(first, std::min(kNodes, now.size() - first));
    const bool is_same = before.size() >= first + page.size() &&
                         std::equal(page.begin(), page.end(), before.begin() + static_cast<std::ptrdiff_t>(first));
    if (is_same) continue;
    if (Status done = memory.write(tree.place, std::as_bytes(page), first * sizeof(Node)); !done) return done;
  }
  tree.top = std::move(top);
  return {};
}

}  // namespace quoin::vulkan

#include "render/vulkan/trees/device_grid.h"

#include <algorithm>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

namespace quoin::vulkan {
namespace {

constexpr std::size_t kPage = 4096;

ShaderTree shader_tree(const DeviceTree& tree, const OccupancyTree* of, IVec3 origin) {
  return of == nullptr ? ShaderTree{} : tree.shader_tree(of->bounds(), origin);
}

}  // namespace

Status DeviceTree::put(ShaderMemory& memory, std::vector<ChunkNodeAt> chunks) {
  TopTree top = build_top_tree(chunks, place_.address);
  const std::size_t bytes = top.nodes.size() * sizeof(Node);
  if (bytes > place_.size) {
    memory.release(place_);
    // Half as much again, so that a growing world is not moved at each update.
    const auto place = memory.allocate(bytes + bytes / 2, "uploading voxels");
    if (!place) return place.error();
    place_ = *place;
    top_.nodes.clear();
    top = build_top_tree(std::move(chunks), place_.address);
  }
  // Writes only the changed pages.
  constexpr std::size_t kNodes = kPage / sizeof(Node);
  const std::span<const Node> now(top.nodes);
  const std::span<const Node> before(top_.nodes);
  for (std::size_t first = 0; first < now.size(); first += kNodes) {
    const auto page = now.subspan(first, std::min(kNodes, now.size() - first));
    const bool is_same = before.size() >= first + page.size() &&
                         std::equal(page.begin(), page.end(), before.begin() + static_cast<std::ptrdiff_t>(first));
    if (is_same) continue;
    if (Status done = memory.write(place_, std::as_bytes(page), first * sizeof(Node)); !done) return done;
  }
  top_ = std::move(top);
  return {};
}

void DeviceTree::release(ShaderMemory& memory) {
  memory.release(place_);
  *this = {};
}

ShaderTree DeviceTree::shader_tree(const IBox& bounds, IVec3 origin) const {
  ShaderTree shader;
  if (empty()) return shader;
  QUOIN_ASSERT(!bounds.empty(), "the bounds of a tree with nodes");
  shader.root = top_.root;
  shader.low = IVec4(bounds.min - origin, top_.root_level);
  shader.high = IVec4(bounds.max - origin, 0);
  return shader;
}

void DeviceGrid::release(ShaderMemory& memory) {
  for (Chunks* const chunks : {&chunks_, &field_chunks_, &glass_chunks_, &shape_chunks_, &shape_glass_chunks_}) {
    drop_all(memory, *chunks);
  }
  for (DeviceTree* const tree : {&opaque_, &transparent_, &field_, &glass_, &shapes_, &shape_glass_}) {
    tree->release(memory);
  }
  *this = {};
}

std::uint64_t DeviceGrid::bytes() const {
  std::uint64_t sum = 0;
  for (const DeviceTree* const tree : {&opaque_, &transparent_, &field_, &glass_, &shapes_, &shape_glass_}) {
    sum += tree->bytes();
  }
  for (const Chunks* const chunks : {&chunks_, &field_chunks_, &glass_chunks_, &shape_chunks_, &shape_glass_chunks_}) {
    for (const auto& [at, chunk] : *chunks) sum += chunk.place.size;
  }
  return sum;
}

Status DeviceGrid::update(ShaderMemory& memory, const Content& content) {
  QUOIN_ASSERT(content.voxels != nullptr && content.opaque != nullptr, "voxels, and their tree");
  const DensityGrid* const field = content.field == nullptr ? nullptr : &content.field->field();
  const DensityGrid* const glass = content.glass == nullptr ? nullptr : &content.glass->field();
  const auto is_same = [](const DensityGrid* now, const Chunks& chunks, const ChangeCursor& followed) {
    return now == nullptr ? chunks.empty() : !now->has_changed_since(followed);
  };
  const std::vector<IVec3> with_other_shapes = chunks_with_other_shapes(content.shapes);
  const bool has_turned = content.turned_types != nullptr && content.voxels->has_data_changed_since(followed_data_);
  if (!has_turned && is_same(field, field_chunks_, followed_field_) && is_same(glass, glass_chunks_, followed_glass_) &&
      with_other_shapes.empty() && !content.voxels->has_changed_since(followed_)) {
    return {};
  }
  Status done = update_voxels(memory, content, with_other_shapes);
  if (done) {
    done = update_field(memory, field, field_chunks_, followed_field_, [&](IVec3 chunk) {
      return put_part(memory, field_chunks_, chunk, pack_field_chunk(content.field->cells(), *field, chunk));
    });
  }
  if (done) {
    done = update_field(memory, glass, glass_chunks_, followed_glass_, [&](IVec3 chunk) {
      return put_part(memory, glass_chunks_, chunk, pack_glass_chunk(*content.glass, chunk));
    });
  }
  for (const IVec3 chunk : with_other_shapes) {
    if (done) done = put_shapes(memory, content, chunk);
  }
  return done ? update_tops(memory, content) : done;
}

// Returns the chunks whose shapes differ from those that were sent. `shapes`: null if there are none.
std::vector<IVec3> DeviceGrid::chunks_with_other_shapes(const TracedShapes* shapes) const {
  std::vector<IVec3> changed;
  for (const auto& [chunk, sent] : sent_shapes_) {
    if (shapes == nullptr || shapes->index.content(chunk) != sent) changed.push_back(chunk);
  }
  if (shapes == nullptr) return changed;
  for (const IVec3 chunk : shapes->index.chunks()) {
    if (!sent_shapes_.contains(chunk)) changed.push_back(chunk);
  }
  return changed;
}

Status DeviceGrid::put_shapes(ShaderMemory& memory, const Content& content, IVec3 chunk) {
  sent_shapes_.erase(chunk);
  const TracedShapes* const shapes = content.shapes;
  auto now = shapes == nullptr ? nullptr : shapes->index.content(chunk);
  if (now == nullptr) {
    drop(memory, shape_chunks_, chunk);
    drop(memory, shape_glass_chunks_, chunk);
    return {};
  }
  QUOIN_ASSERT(content.models != nullptr, "models of the shapes");
  Status done;
  const auto shape_of = [&](const PlacedShape& shape) {
    const auto found = content.models->shape_of(shape);
    if (!found && done) done = found.error();
    return found ? *found : ShaderShape{};
  };
  const auto all = [](const PlacedShape&) { return true; };
  ChunkRecord record = pack_shapes_chunk(shapes->touched, shapes->index, chunk, all, shape_of);
  if (done) done = put_part(memory, shape_chunks_, chunk, std::move(record));
  const auto is_glass = [&](const PlacedShape& shape) {
    return shape.type < shapes->is_glass.size() && shapes->is_glass[shape.type] != 0;
  };
  record = pack_shapes_chunk(shapes->glass, shapes->index, chunk, is_glass, shape_of);
  if (done) done = put_part(memory, shape_glass_chunks_, chunk, std::move(record));
  if (done) sent_shapes_[chunk] = std::move(now);
  return done;
}

// Updates the nodes above the chunks.
Status DeviceGrid::update_tops(ShaderMemory& memory, const Content& content) {
  const OccupancyTree* const cells = content.field == nullptr ? nullptr : &content.field->cells();
  const OccupancyTree* const glass = content.glass == nullptr ? nullptr : &content.glass->cells();
  IBox bounds = content.voxels->bounds();
  const OccupancyTree* const shapes = content.shapes == nullptr ? nullptr : &content.shapes->touched;
  const OccupancyTree* const shape_glass = content.shapes == nullptr ? nullptr : &content.shapes->glass;
  for (const OccupancyTree* const tree : {cells, glass, shapes}) {
    if (tree != nullptr) bounds = unite(bounds, tree->bounds());
  }
  origin_ = chunk_of(bounds.min);
  if (Status done = put_top(memory, opaque_, chunks_, &DeviceChunk::opaque); !done) return done;
  if (Status done = put_top(memory, transparent_, chunks_, &DeviceChunk::transparent); !done) return done;
  if (Status done = put_top(memory, field_, field_chunks_, &DeviceChunk::field); !done) return done;
  if (Status done = put_top(memory, glass_, glass_chunks_, &DeviceChunk::glass); !done) return done;
  if (Status done = put_top(memory, shapes_, shape_chunks_, &DeviceChunk::shapes); !done) return done;
  if (Status done = put_top(memory, shape_glass_, shape_glass_chunks_, &DeviceChunk::shapes); !done) return done;
  shader_grid_ = {shader_tree(opaque_, content.opaque, this->origin()),
                  shader_tree(transparent_, content.transparent, this->origin()),
                  shader_tree(field_, cells, this->origin()), shader_tree(glass_, glass, this->origin())};
  shader_shapes_ = {shader_tree(shapes_, shapes, this->origin()),
                    shader_tree(shape_glass_, shape_glass, this->origin())};
  return {};
}

// `with_other_shapes`: chunks whose voxels may have changed, too: the tree of transparent voxels has shapes that are
// cubes.
Status DeviceGrid::update_voxels(ShaderMemory& memory, const Content& content,
                                 std::span<const IVec3> with_other_shapes) {
  PendingChanges changes(followed_, *content.voxels);
  if (changes->all) {
    drop_all(memory, chunks_);
    for (const IVec3 at : content.voxels->chunks()) {
      if (Status done = put_voxels(memory, content, at); !done) return done;
    }
  }
  std::set<IVec3, ByPlace> chunks;
  for (const ChunkChange& change : changes->items_unless_all()) chunks.insert(change.chunk);
  if (!changes->all) chunks.insert(with_other_shapes.begin(), with_other_shapes.end());
  ChangeCursor at_data = std::exchange(followed_data_, {});
  if (content.turned_types != nullptr) {
    const DataChanges data = content.voxels->data_changes_since(at_data);
    for (const DataChange& change : data.items_unless_all()) chunks.insert(change.chunk);
    if (data.all && !changes->all) {
      for (const IVec3 at : content.voxels->chunks()) chunks.insert(at);
    }
  }
  for (const IVec3 chunk : chunks) {
    if (Status done = put_voxels(memory, content, chunk); !done) return done;
  }
  changes.commit();
  followed_data_ = at_data;
  return {};
}

// `field`: null if there is none.
template <class PutChunk>
Status DeviceGrid::update_field(ShaderMemory& memory, const DensityGrid* field, Chunks& chunks, ChangeCursor& followed,
                                const PutChunk& put_chunk) {
  if (field == nullptr) {
    drop_all(memory, chunks);
    followed = {};
    return {};
  }
  PendingChanges changes(followed, *field);
  if (changes->all) drop_all(memory, chunks);
  for (const IVec3 chunk : chunks_to_mesh(*field, *changes, kFieldRecordReach)) {
    if (Status done = put_chunk(chunk); !done) return done;
  }
  changes.commit();
  return {};
}

void DeviceGrid::drop(ShaderMemory& memory, Chunks& chunks, IVec3 chunk) {
  const auto old = chunks.find(chunk);
  if (old == chunks.end()) return;
  memory.release(old->second.place);
  chunks.erase(old);
}

void DeviceGrid::drop_all(ShaderMemory& memory, Chunks& chunks) {
  for (auto& [at, chunk] : chunks) memory.release(chunk.place);
  chunks.clear();
}

Status DeviceGrid::put_voxels(ShaderMemory& memory, const Content& content, IVec3 chunk) {
  const Chunk* voxels = content.voxels->find_chunk(chunk);
  if (voxels == nullptr) {
    drop(memory, chunks_, chunk);
    return {};
  }
  return put_record(memory, chunks_[chunk],
                    pack_chunk(*content.opaque, content.transparent, *voxels, chunk, content.turned_types));
}

Status DeviceGrid::put_part(ShaderMemory& memory, Chunks& chunks, IVec3 chunk, ChunkRecord record) {
  if (record.field.mask == 0 && record.glass.mask == 0 && record.shapes.mask == 0) {
    drop(memory, chunks, chunk);
    return {};
  }
  return put_record(memory, chunks[chunk], std::move(record));
}

Status DeviceGrid::put_record(ShaderMemory& memory, DeviceChunk& entry, ChunkRecord record) {
  QUOIN_ASSERT(!record.words.empty(), "a record with content");
  memory.release(entry.place);
  const auto place = memory.allocate(record.words.size() * 4, "uploading voxels");
  if (!place) return place.error();
  entry.place = *place;
  record.move_to(place->address);
  entry.opaque = record.opaque;
  entry.transparent = record.transparent;
  entry.field = record.field;
  entry.glass = record.glass;
  entry.shapes = record.shapes;
  return memory.write(entry.place, std::as_bytes(std::span(record.words)));
}

Status DeviceGrid::put_top(ShaderMemory& memory, DeviceTree& tree, const Chunks& chunks,
                           Node DeviceChunk::*node) const {
  std::vector<ChunkNodeAt> nodes;
  for (const auto& [at, chunk] : chunks) {
    if ((chunk.*node).mask != 0) nodes.push_back({at - origin_, chunk.*node});
  }
  return tree.put(memory, std::move(nodes));
}

}  // namespace quoin::vulkan

#include <quoin/trace/occupancy_tree.h>

#include <algorithm>
#include <bit>

#include <tsl/robin_map.h>

#include "grid/coordinate_hash.h"
#include "trace/tree_view.h"

namespace quoin {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};
constexpr int kRegionShift = 4;  // chunks, per axis
// Flat tables up to this size are made however sparse the world is.
constexpr std::int64_t kSmallTables = std::int64_t{1} << 20;

bool belongs(const VoxelRegistry& types, VoxelType type, Occupancy which) {
  if (type == kAir) return false;
  if (which == Occupancy::NonAir) return true;
  return types.is_transparent(type) == (which == Occupancy::Transparent);
}

// Rows of a chunk as bits, by asking the palette which types count.
class Rows {
 public:
  Rows(const Chunk& chunk, const VoxelRegistry& types, Occupancy which) : chunk_(&chunk) {
    for (const VoxelType type : chunk.types()) (belongs(types, type, which) ? in_ : out_).push_back(type);
  }
  [[nodiscard]] bool none() const { return in_.empty(); }
  [[nodiscard]] bool all() const { return out_.empty(); }
  [[nodiscard]] std::uint64_t row(int y, int z) const {
    // Whichever list is shorter.
    const bool by_absence = out_.size() < in_.size();
    std::uint64_t mask = 0;
    for (const VoxelType type : by_absence ? out_ : in_) mask |= chunk_->row_mask(y, z, type);
    return by_absence ? ~mask : mask;
  }

 private:
  const Chunk* chunk_;
  std::vector<VoxelType> in_;
  std::vector<VoxelType> out_;
};

// 16 rows of 16 nibbles, [z][y][x / 4], become 16 words of 4^3 bits: nibble j of word i becomes nibble i of word j.
void transpose_nibbles(std::array<std::uint64_t, 16>& w) {
  constexpr std::uint64_t kMasks[] = {0x0F0F'0F0F'0F0F'0F0FU, 0x00FF'00FF'00FF'00FFU, 0x0000'FFFF'0000'FFFFU,
                                      0x0000'0000'FFFF'FFFFU};
  for (unsigned stage = 0; stage < 4; ++stage) {
    const unsigned distance = 1U << stage;
    const unsigned shift = 4U << stage;
    for (unsigned i = 0; i < 16; ++i) {
      if ((i & distance) != 0) continue;
      const std::uint64_t t = ((w[i] >> shift) ^ w[i + distance]) & kMasks[stage];
      w[i + distance] ^= t;
      w[i] ^= t << shift;
    }
  }
}

// Index of a unit in a node's table of 16^3, and its word and bit in a node.
std::size_t table_index(IVec3 unit) {
  return static_cast<std::size_t>(unit.x + 16 * unit.y + 256 * unit.z);
}
std::size_t word_of(IVec3 unit) {
  return static_cast<std::size_t>((unit.x >> 2) + 4 * (unit.y >> 2) + 16 * (unit.z >> 2));
}
unsigned bit_of(IVec3 unit) {
  return static_cast<unsigned>((unit.x & 3) + 4 * (unit.y & 3) + 16 * (unit.z & 3));
}

}  // namespace

struct OccupancyTree::Impl {
  Occupancy which = Occupancy::NonAir;
  tsl::robin_map<IVec3, std::unique_ptr<RegionNode>, CoordinateHash> regions;
  std::vector<ChunkNode> chunk_nodes = std::vector<ChunkNode>(1);  // 0: none
  std::vector<Node> bricks = std::vector<Node>(2);                 // 0: empty, 1: full
  std::vector<std::uint32_t> free_chunks;
  std::vector<std::uint32_t> free_bricks;
  tsl::robin_map<IVec3, IBox, CoordinateHash> chunk_bounds;  // occupied voxels of each chunk, in grid coordinates
  IBox bounds;
  FlatTables flat;  // no chunks: none
  std::vector<trace::FlatChunk> flat_nodes;
  const ChunkNode* known_nodes = nullptr;  // where they were when `flat_nodes` was made
  IBox flat_chunks;
  trace::TreeView view{};

  Impl() { bricks[1].fill(kAll); }

  std::uint32_t allocate_brick() {
    if (!free_bricks.empty()) {
      const std::uint32_t index = free_bricks.back();
      free_bricks.pop_back();
      return index;
    }
    bricks.emplace_back();
    return static_cast<std::uint32_t>(bricks.size() - 1);
  }

  void release_bricks(ChunkNode& node) {
    for (std::uint32_t& brick : node.bricks) {
      if (brick > 1) free_bricks.push_back(brick);
      brick = 0;
    }
    node.cells.fill(0);
  }

  void remove(IVec3 chunk) {
    const IVec3 at{chunk.x >> kRegionShift, chunk.y >> kRegionShift, chunk.z >> kRegionShift};
    const auto found = regions.find(at);
    if (found == regions.end()) return;
    RegionNode& region = *found.value();
    const IVec3 unit{chunk.x & 15, chunk.y & 15, chunk.z & 15};
    std::uint32_t& index = region.nodes[table_index(unit)];
    if (index == 0) return;
    release_bricks(chunk_nodes[index]);
    free_chunks.push_back(index);
    index = 0;
    region.chunks[word_of(unit)] &= ~(std::uint64_t{1} << bit_of(unit));
    if (std::all_of(region.chunks.begin(), region.chunks.end(), [](std::uint64_t w) { return w == 0; })) {
      regions.erase(at);
    }
  }

  ChunkNode& find_or_create(IVec3 chunk) {
    auto& region = regions[{chunk.x >> kRegionShift, chunk.y >> kRegionShift, chunk.z >> kRegionShift}];
    if (region == nullptr) region = std::make_unique<RegionNode>();
    const IVec3 unit{chunk.x & 15, chunk.y & 15, chunk.z & 15};
    std::uint32_t& index = region->nodes[table_index(unit)];
    if (index == 0) {
      if (free_chunks.empty()) {
        chunk_nodes.emplace_back();
        index = static_cast<std::uint32_t>(chunk_nodes.size() - 1);
      } else {
        index = free_chunks.back();
        free_chunks.pop_back();
      }
      region->chunks[word_of(unit)] |= std::uint64_t{1} << bit_of(unit);
    }
    return chunk_nodes[index];
  }

  // Puts the words of one brick in place.
  void set_brick(ChunkNode& node, std::size_t brick, const Node& words) {
    std::uint64_t cells = 0;
    bool is_full = true;
    for (std::size_t i = 0; i < 64; ++i) {
      cells |= std::uint64_t{words[i] != 0} << i;
      is_full &= words[i] == kAll;
    }
    node.cells[brick] = cells;
    if (cells == 0 || is_full) {
      node.bricks[brick] = is_full ? 1 : 0;
      return;
    }
    const std::uint32_t index = allocate_brick();
    bricks[index] = words;
    node.bricks[brick] = index;
  }

  // Answers the box of the chunk's occupied voxels, in chunk coordinates.
  IBox fill(ChunkNode& node, const Rows& rows) {
    IBox box;
    std::array<Node, 4> four{};  // the bricks along x
    for (int brick_z = 0; brick_z < 4; ++brick_z) {
      for (int brick_y = 0; brick_y < 4; ++brick_y) {
        for (int slab = 0; slab < 16; ++slab) {
          const int y = brick_y * 16 + (slab & 3) * 4;
          const int z = brick_z * 16 + (slab >> 2) * 4;
          std::array<std::uint64_t, 16> words{};
          for (int i = 0; i < 16; ++i) {
            const std::uint64_t row = rows.row(y + (i & 3), z + (i >> 2));
            words[static_cast<std::size_t>(i)] = row;
            if (row == 0) continue;
            const IVec3 low{std::countr_zero(row), y + (i & 3), z + (i >> 2)};
            box = unite(box, {low, {64 - std::countl_zero(row), low.y + 1, low.z + 1}});
          }
          transpose_nibbles(words);
          for (std::size_t i = 0; i < 16; ++i) four[i / 4][i % 4 + static_cast<std::size_t>(slab) * 4] = words[i];
        }
        for (int brick_x = 0; brick_x < 4; ++brick_x) {
          const auto brick = static_cast<std::size_t>(brick_x + 4 * brick_y + 16 * brick_z);
          set_brick(node, brick, four[static_cast<std::size_t>(brick_x)]);
        }
      }
    }
    return box;
  }

  void put(const Chunk* voxels, const VoxelRegistry& types, IVec3 chunk) {
    chunk_bounds.erase(chunk);
    if (voxels == nullptr) return remove(chunk);
    const Rows rows(*voxels, types, which);
    if (rows.none()) return remove(chunk);
    ChunkNode& node = find_or_create(chunk);
    release_bricks(node);
    IBox box = kWholeChunkBox;
    if (rows.all()) {
      node.cells.fill(kAll);
      node.bricks.fill(1);
    } else {
      box = fill(node, rows);
      if (box.empty()) return remove(chunk);
    }
    chunk_bounds[chunk] = {box.min + chunk * kChunkEdge, box.max + chunk * kChunkEdge};
  }

  // The 16 cells along x at (y, z) of a chunk, as bits.
  static std::uint64_t cell_row(const ChunkNode& node, int y, int z) {
    std::uint64_t row = 0;
    for (int brick_x = 0; brick_x < 4; ++brick_x) {
      const auto brick = static_cast<std::size_t>(brick_x + 4 * (y >> 2) + 16 * (z >> 2));
      row |= (node.cells[brick] >> (4 * (y & 3) + 16 * (z & 3)) & 15U) << (4 * brick_x);
    }
    return row;
  }

  // Puts 16 bits in place of those at `bit`.
  static void put_bits(std::vector<std::uint32_t>& words, std::size_t bit, std::uint64_t bits) {
    const std::size_t word = bit / 32;
    const unsigned shift = bit % 32;
    const std::uint64_t mask = std::uint64_t{0xFFFF} << shift;
    std::uint64_t both = words[word] | std::uint64_t{words[word + 1]} << 32;
    both = (both & ~mask) | bits << shift;
    words[word] = static_cast<std::uint32_t>(both);
    words[word + 1] = static_cast<std::uint32_t>(both >> 32);
  }

  [[nodiscard]] const ChunkNode& node_of(IVec3 chunk) const {
    const RegionNode* region = find({chunk.x >> kRegionShift, chunk.y >> kRegionShift, chunk.z >> kRegionShift});
    return chunk_nodes[region == nullptr ? 0 : region->nodes[table_index(chunk & 15)]];
  }

  void name_node(IVec3 chunk) {
    const ChunkNode& node = node_of(chunk);
    std::uint64_t bricks_there = 0;
    for (std::size_t i = 0; i < 64; ++i) bricks_there |= std::uint64_t{node.cells[i] != 0} << i;
    const IVec3 at = chunk - flat_chunks.min;
    flat_nodes[static_cast<std::size_t>(at.x + flat.chunks.x * (at.y + flat.chunks.y * at.z))] = {bricks_there, &node};
  }

  // Copies a chunk's cells and bricks into the flat tables.
  void flatten(IVec3 chunk) {
    name_node(chunk);
    const ChunkNode& node = node_of(chunk);
    const IVec3 at = chunk - flat_chunks.min;
    const IVec3 cells = flat.cell_strides();
    const IVec3 bricks_at = flat.brick_strides();
    for (int z = 0; z < 16; ++z) {
      for (int y = 0; y < 16; ++y) {
        const IVec3 cell = at * 16 + IVec3{1, y + 1, z + 1};
        const auto bit = static_cast<std::size_t>(cell.x) + static_cast<std::size_t>(cell.y) * cells.y +
                         static_cast<std::size_t>(cell.z) * cells.z;
        put_bits(flat.cells, bit, cell_row(node, y, z));
      }
    }
    for (int i = 0; i < 64; ++i) {
      const IVec3 brick = at * 4 + IVec3{i & 3, i >> 2 & 3, i >> 4};
      const auto to = static_cast<std::size_t>(brick.x) + static_cast<std::size_t>(brick.y) * bricks_at.y +
                      static_cast<std::size_t>(brick.z) * bricks_at.z;
      flat.bricks[to] = node.bricks[static_cast<std::size_t>(i)];
    }
  }

  [[nodiscard]] const RegionNode* find(IVec3 region) const {
    const auto found = regions.find(region);
    return found == regions.end() ? nullptr : found->second.get();
  }

  // Whether tables for the box of chunks are not too large for what is in it.
  [[nodiscard]] bool can_be_flat(const IBox& chunks) const {
    const IVec3 size = chunks.size();
    const std::int64_t cells = (16 * std::int64_t{size.x} + 2) * (16 * std::int64_t{size.y} + 2);
    const std::size_t used_bytes = (bricks.size() - free_bricks.size()) * sizeof(Node) +
                                   (chunk_nodes.size() - free_chunks.size()) * sizeof(ChunkNode);
    const auto limit = static_cast<double>(std::max(kSmallTables, static_cast<std::int64_t>(used_bytes)));
    const double brick_bytes = 4.0 * 64.0 * size.x * static_cast<double>(size.y) * size.z;
    // Kernels count bits in 32 bits.
    return !chunks.empty() && bits_of(cells, size.z) / 8 + brick_bytes <= limit && bits_of(cells, size.z) <= 2e9;
  }
  static double bits_of(std::int64_t cells, int chunks_along_z) {
    return static_cast<double>(cells) * (16.0 * chunks_along_z + 2.0);
  }

  void make_flat(const IBox& chunks) {
    flat = {};
    const IVec3 size = flat.chunks = chunks.size();
    const std::int64_t cells = (16 * std::int64_t{size.x} + 2) * (16 * std::int64_t{size.y} + 2);
    flat.origin = chunks.min * kChunkEdge;
    flat.cells.assign(static_cast<std::size_t>(bits_of(cells, size.z)) / 32 + 2, 0);
    flat.bricks.assign(
        64 * static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) * static_cast<std::size_t>(size.z), 0);
    flat_nodes.assign(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) * static_cast<std::size_t>(size.z),
                      {0, chunk_nodes.data()});
    known_nodes = chunk_nodes.data();
    flat_chunks = chunks;
    for (const auto& [chunk, box] : chunk_bounds) flatten(chunk);
  }

  // After chunks have been put: the bounds, and the tables where they concern `changed`.
  void finish(std::span<const IVec3> changed) {
    renew_tables(changed);
    if (!flat_chunks.empty()) view = trace::make_view(flat, flat_nodes.data(), bricks.data(), bounds);
  }

  [[nodiscard]] const trace::TreeView* kernel_view() const { return flat_chunks.empty() ? nullptr : &view; }

  void renew_tables(std::span<const IVec3> changed) {
    bounds = {};
    IBox chunks;
    for (const auto& [chunk, box] : chunk_bounds) {
      bounds = unite(bounds, box);
      chunks = unite(chunks, {chunk, chunk + 1});
    }
    // As a tree built from scratch would have it.
    if (!can_be_flat(chunks)) {
      flat = {};
      flat_nodes = {};
      flat_chunks = {};
      return;
    }
    if (!(chunks == flat_chunks)) return make_flat(chunks);
    if (chunk_nodes.data() != known_nodes) {
      known_nodes = chunk_nodes.data();
      for (const auto& [chunk, box] : chunk_bounds) name_node(chunk);
    }
    for (const IVec3 chunk : changed) {
      if (flat_chunks.contains(chunk)) flatten(chunk);
    }
  }

  static constexpr IBox kWholeChunkBox = {IVec3{0}, IVec3{kChunkEdge}};
};

OccupancyTree::OccupancyTree() : impl_(std::make_unique<Impl>()) {}
OccupancyTree::OccupancyTree(OccupancyTree&&) noexcept = default;
OccupancyTree& OccupancyTree::operator=(OccupancyTree&&) noexcept = default;
OccupancyTree::~OccupancyTree() = default;

OccupancyTree OccupancyTree::build(const Grid& grid, const VoxelRegistry& types, Occupancy which) {
  OccupancyTree tree;
  tree.impl_->which = which;
  for (const IVec3 chunk : grid.chunks()) tree.impl_->put(grid.find_chunk(chunk), types, chunk);
  tree.impl_->chunk_nodes.shrink_to_fit();
  tree.impl_->bricks.shrink_to_fit();
  tree.impl_->finish({});
  tree.view_ = tree.impl_->kernel_view();
  return tree;
}

void OccupancyTree::update(const Grid& grid, const VoxelRegistry& types, std::span<const IVec3> chunks) {
  for (const IVec3 chunk : chunks) impl_->put(grid.find_chunk(chunk), types, chunk);
  impl_->finish(chunks);
  view_ = impl_->kernel_view();
}

IBox OccupancyTree::bounds() const {
  return impl_->bounds;
}

bool OccupancyTree::is_occupied(IVec3 voxel) const {
  const RegionNode* region = find_region({voxel.x >> 10, voxel.y >> 10, voxel.z >> 10});
  if (region == nullptr) return false;
  const IVec3 chunk = (voxel >> kChunkShift) & 15;
  const ChunkNode& node = impl_->chunk_nodes[region->nodes[table_index(chunk)]];
  const IVec3 brick = (voxel >> 4) & 3;
  const Node& words = impl_->bricks[node.bricks[static_cast<std::size_t>(brick.x + 4 * brick.y + 16 * brick.z)]];
  const IVec3 unit = voxel & 15;
  return (words[word_of(unit)] >> bit_of(unit) & 1U) != 0;
}

std::size_t OccupancyTree::bytes() const {
  return sizeof(OccupancyTree) + sizeof(Impl) + impl_->regions.size() * sizeof(RegionNode) +
         impl_->chunk_nodes.capacity() * sizeof(ChunkNode) + impl_->bricks.capacity() * sizeof(Node) +
         impl_->chunk_bounds.bucket_count() * (sizeof(IVec3) + sizeof(IBox)) +
         impl_->flat_nodes.capacity() * sizeof(trace::FlatChunk) +
         (impl_->flat.cells.capacity() + impl_->flat.bricks.capacity()) * sizeof(std::uint32_t);
}

const OccupancyTree::RegionNode* OccupancyTree::find_region(IVec3 region) const {
  return impl_->find(region);
}

const OccupancyTree::ChunkNode* OccupancyTree::chunk_nodes() const {
  return impl_->chunk_nodes.data();
}
const OccupancyTree::Node* OccupancyTree::bricks() const {
  return impl_->bricks.data();
}
const OccupancyTree::FlatTables* OccupancyTree::flat_tables() const {
  return impl_->flat_chunks.empty() ? nullptr : &impl_->flat;
}

}  // namespace quoin

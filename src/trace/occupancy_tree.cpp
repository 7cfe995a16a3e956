#include <quoin/trace/occupancy_tree.h>

#include <algorithm>
#include <bit>
#include <type_traits>
#include <utility>

#include <glm/common.hpp>
#include <tsl/robin_map.h>
#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/coordinates/chunk_boxes.h"
#include "core/coordinates/chunk_order.h"
#include "core/memory/large_array.h"
#include "trace/brick_store.h"
#include "trace/chunk_rows.h"
#include "trace/tree_view.h"

namespace quoin {
namespace {

using trace::ChunkBricks, trace::ChunkNode, trace::Node, trace::RegionNode;

// Tables over a box around all chunks. Kernels read them instead of regions, because an address is then a sum of
// products.
struct FlatTables {
  IBox box;                             // of chunks; empty: no tables
  IBox first;                           // the box of all chunks when the tables were made
  LargeArray<std::uint32_t> cells;      // one bit per cell of 4^3 voxels, with a border of empty cells
  LargeArray<trace::BrickCode> bricks;  // x first, then y, then z; an empty one before and after, for pairs along x
  BlockVector<trace::FlatChunk> nodes;

  [[nodiscard]] IVec3 chunks() const { return box.size(); }
  // The steps between cells along x, y, z; cell (0, 0, 0) is bit x + y + z of them.
  [[nodiscard]] IVec3 cell_strides() const {
    const IVec3 size = chunks();
    return {1, 16 * size.x + 2, (16 * size.x + 2) * (16 * size.y + 2)};
  }
  [[nodiscard]] IVec3 chunk_strides() const { return {1, chunks().x, chunks().x * chunks().y}; }
  [[nodiscard]] IVec3 brick_strides() const { return {1, 4 * chunks().x, 16 * chunks().x * chunks().y}; }
  [[nodiscard]] const trace::BrickCode* first_brick() const { return bricks.data() + 1; }
  [[nodiscard]] trace::BrickCode* first_brick() { return bricks.data() + 1; }
  [[nodiscard]] std::size_t bytes() const {
    return cells.capacity() * sizeof(std::uint32_t) + bricks.capacity() * sizeof(trace::BrickCode) +
           nodes.capacity() * sizeof(trace::FlatChunk);
  }
};

// Returns the index of a unit in a table with these strides.
std::size_t place_in(IVec3 strides, IVec3 unit) {
  QUOIN_ASSERT((unit.x | unit.y | unit.z) >= 0, "a unit of the table");
  return static_cast<std::size_t>(unit.x) + static_cast<std::size_t>(unit.y) * static_cast<std::size_t>(strides.y) +
         static_cast<std::size_t>(unit.z) * static_cast<std::size_t>(strides.z);
}

constexpr int kRegionShift = 4;  // chunks, per axis
// If more slabs than this of a row of four bricks change, fill_row assembles each brick once.
constexpr int kFewSlabs = 2;
// Chunks whose tables an update copies in advance.
constexpr int kChunksCopied = 256;
// Flat tables up to this size are made for any world, even a sparse one.
constexpr std::int64_t kSmallTables = std::int64_t{1} << 20;

// The word and bit of a unit in a node.
std::size_t word_of(IVec3 unit) {
  QUOIN_ASSERT(((unit.x | unit.y | unit.z) & ~15) == 0, "0 <= x, y, z < 16");
  return static_cast<std::size_t>((unit.x >> 2) + 4 * (unit.y >> 2) + 16 * (unit.z >> 2));
}
unsigned bit_of(IVec3 unit) {
  return static_cast<unsigned>((unit.x & 3) + 4 * (unit.y & 3) + 16 * (unit.z & 3));
}

// A chunk and its lower neighbours: some of the neighbours' cells end in the chunk.
constexpr std::array<IVec3, 8> kBelow = {IVec3{0, 0, 0}, {-1, 0, 0},  {0, -1, 0},  {-1, -1, 0},
                                         {0, 0, -1},     {-1, 0, -1}, {0, -1, -1}, {-1, -1, -1}};

struct SlabsOfChunk {
  IVec3 chunk{0};
  ChunkSlabs slabs;
};

// Returns the slabs with cells that touch a sample changed by an edit of the field.
std::vector<SlabsOfChunk> cells_reached(const DensityChanges& changes) {
  std::vector<SlabsOfChunk> reached;
  for (const DensityChange& each : changes.items_unless_all()) {
    for (const IVec3 offset : kBelow) {
      // A cell begins one sample before each of its ends.
      const IBox cells{each.box.min - 1 - offset * kChunkEdge, each.box.max - offset * kChunkEdge};
      const IBox own = intersect(cells, kWholeChunk);
      if (!own.empty()) reached.push_back({each.chunk + offset, ChunkSlabs::of(own)});
    }
  }
  std::sort(reached.begin(), reached.end(),
            [](const SlabsOfChunk& a, const SlabsOfChunk& b) { return by_zyx(a.chunk, b.chunk); });
  std::size_t kept = 0;
  for (const SlabsOfChunk& each : reached) {
    if (kept != 0 && reached[kept - 1].chunk == each.chunk) {
      reached[kept - 1].slabs.add(each.slabs);
    } else {
      reached[kept++] = each;
    }
  }
  reached.resize(kept);
  return reached;
}

// Returns the chunks of the cells between the samples of some chunks.
std::vector<IVec3> cells_of(const std::vector<IVec3>& chunks) {
  std::vector<IVec3> cells;
  cells.reserve(chunks.size() * kBelow.size());
  for (const IVec3 chunk : chunks) {
    for (const IVec3 offset : kBelow) cells.push_back(chunk + offset);
  }
  sort_and_unite(cells);
  return cells;
}

// The rows of one chunk, for a tree of listed voxels.
class ListedRows {
 public:
  ListedRows(const OccupancyTree::RowsOfVoxels& rows, IVec3 chunk) : rows_(rows), origin_(chunk * kChunkEdge) {
    for (int i = 0; i < kChunkEdge * kChunkEdge && is_empty_; ++i) {
      is_empty_ = rows_(origin_ + IVec3(0, i % kChunkEdge, i / kChunkEdge)) == 0;
    }
  }
  [[nodiscard]] bool none() const { return is_empty_; }
  [[nodiscard]] trace::Slab read(int y, int z, trace::SlabRows& rows) const {
    for (int i = 0; i < 16; ++i)
      rows[static_cast<std::size_t>(i)] = rows_(origin_ + IVec3(0, y + (i & 3), z + (i >> 2)));
    return trace::slab_of(rows);
  }

 private:
  const OccupancyTree::RowsOfVoxels& rows_;
  IVec3 origin_;
  bool is_empty_ = true;
};

trace::TreeView make_view(const FlatTables& tables, const trace::BrickLine* lines, const IBox& bounds) {
  const IVec3 origin = tables.box.min * kChunkEdge;
  const IVec3 chunks = tables.chunks();
  trace::TreeView view{};
  view.cells = tables.cells.data();
  view.bricks = tables.first_brick();
  view.lines = lines;
  view.chunks = tables.nodes.data();
  view.words = reinterpret_cast<const std::uint32_t*>(lines);
  view.last_cell_word = static_cast<std::uint32_t>(tables.cells.size() - 1);
  view.cell_strides = tables.cell_strides();
  view.brick_strides = tables.brick_strides();
  view.brick_sizes = chunks * 4;
  view.first_cell = view.cell_strides.x + view.cell_strides.y + view.cell_strides.z;
  view.origin = DVec3(origin);
  view.box = {bounds.min - origin, bounds.max - origin};
  QUOIN_ASSERT((intersect(view.box, {IVec3(0), chunks * kChunkEdge}) == view.box), "tables of every voxel");
  const std::int32_t strides[3] = {1, chunks.x, chunks.x * chunks.y};
  std::copy_n(strides, 3, view.chunk_strides);
  const IVec3 size = view.box.size();
  view.is_small = std::max(std::max(size.x, size.y), size.z) <= 1'900;
  for (int axis = 0; axis < 3; ++axis) {
    view.corner[axis] = view.origin[axis];
    view.low[axis] = static_cast<float>(view.box.min[axis]);
    view.high[axis] = static_cast<float>(view.box.max[axis]);
    view.low_voxel[axis] = view.box.min[axis];
    view.high_voxel[axis] = view.box.max[axis];
  }
  return view;
}

}  // namespace

struct OccupancyTree::Impl {
  Impl() { chunk_nodes.push_back(std::make_unique<ChunkNode>()); }

  Occupancy which = Occupancy::NonAir;
  tsl::robin_map<IVec3, std::unique_ptr<RegionNode>, CoordinateHash> regions;
  // Index 0: an empty node. Nodes keep their addresses, which the flat tables hold, so growth copies none.
  BlockVector<std::unique_ptr<ChunkNode>> chunk_nodes;
  trace::BrickStore bricks;
  BlockVector<std::uint32_t> free_chunks;
  ChunkBoxes chunk_boxes;  // around the occupied voxels of each chunk, in grid coordinates
  IBox bounds;
  FlatTables flat;
  // When the box of all chunks is about to outgrow the tables, updates copy them in steps to larger ones.
  FlatTables next;
  int next_rows = 0;  // rows of the chunks in both boxes that `next` has
  // A chunk far from all others would make the tables too large. The tables then stay as they are until that chunk is
  // gone, together with the changes that they missed.
  bool is_flat = false;
  std::vector<ChunkBricks> missed;
  trace::TreeView view{};

  [[nodiscard]] bool has_blocks() const { return which == Occupancy::Transparent || which == Occupancy::Glass; }

  void release_bricks(ChunkNode& node) {
    for (trace::BrickCode& brick : node.bricks) {
      bricks.release(brick);
      brick = trace::kEmptyBrick;
    }
    node.cells.fill(0);
  }

  void remove(IVec3 chunk) {
    const IVec3 at{chunk.x >> kRegionShift, chunk.y >> kRegionShift, chunk.z >> kRegionShift};
    const auto found = regions.find(at);
    if (found == regions.end()) return;
    RegionNode& region = *found.value();
    const IVec3 unit{chunk.x & 15, chunk.y & 15, chunk.z & 15};
    const std::uint32_t index = region.node(word_of(unit), bit_of(unit));
    if (index == 0) return;
    QUOIN_ASSERT(index < chunk_nodes.size(), "an existing node");
    release_bricks(*chunk_nodes[index]);
    free_chunks.push_back(index);
    region.erase(word_of(unit), bit_of(unit));
    if (region.nodes.empty()) regions.erase(at);
  }

  ChunkNode& find_or_create(IVec3 chunk) {
    auto& region = regions[{chunk.x >> kRegionShift, chunk.y >> kRegionShift, chunk.z >> kRegionShift}];
    if (region == nullptr) region = std::make_unique<RegionNode>();
    const IVec3 unit{chunk.x & 15, chunk.y & 15, chunk.z & 15};
    std::uint32_t index = region->node(word_of(unit), bit_of(unit));
    if (index == 0) {
      if (free_chunks.empty()) {
        chunk_nodes.push_back(std::make_unique<ChunkNode>());
        free_chunks.push_back(static_cast<std::uint32_t>(chunk_nodes.size() - 1));
      }
      index = free_chunks.back();
      region->insert(word_of(unit), bit_of(unit), index);
      free_chunks.pop_back();
    }
    QUOIN_ASSERT(index != 0 && index < chunk_nodes.size(), "an existing node");
    return *chunk_nodes[index];
  }

  // Replaces the words of one brick. Returns true if they changed.
  bool set_brick(ChunkNode& node, std::size_t brick, const Node& words) {
    if (bricks.words(node.bricks[brick]).node() == words) return false;
    std::uint64_t cells = 0;
    for (std::size_t i = 0; i < 64; ++i) cells |= std::uint64_t{words[i] != 0} << i;
    replace_brick(node, brick, words, cells);
    return true;
  }

  // `cells`: the words that are not 0.
  void replace_brick(ChunkNode& node, std::size_t brick, const Node& words, std::uint64_t cells) {
    QUOIN_ASSERT(brick < node.bricks.size(), "one of the node's 64 bricks");
    const bool is_full =
        cells == trace::kAll && std::all_of(words.begin(), words.end(), [](auto word) { return word == trace::kAll; });
    if (cells == 0 || is_full) {
      set_uniform(node, brick, is_full);
      return;
    }
    node.cells[brick] = cells;
    node.bricks[brick] = bricks.put(node.bricks[brick], words);
  }

  bool set_uniform(ChunkNode& node, std::size_t brick, bool is_full) {
    QUOIN_ASSERT(brick < node.bricks.size(), "one of the node's 64 bricks");
    trace::BrickCode& code = node.bricks[brick];
    const trace::BrickCode wanted = is_full ? trace::kFullBrick : trace::kEmptyBrick;
    if (code == wanted) return false;
    bricks.release(code);
    code = wanted;
    node.cells[brick] = is_full ? trace::kAll : 0;
    return true;
  }

  // Returns the non-empty cells of a brick after replacing the words of one slab.
  static std::uint64_t with_slab(std::uint64_t cells, std::size_t slab, std::span<const std::uint64_t, 4> words) {
    QUOIN_ASSERT(slab < 16, "one of the brick's 16 slabs");
    cells &= ~(std::uint64_t{15} << (4 * slab));
    for (std::size_t i = 0; i < 4; ++i) cells |= std::uint64_t{words[i] != 0} << (4 * slab + i);
    return cells;
  }

  // Replaces the words of one slab in a brick, four of its 64. Returns true if they changed.
  bool set_slab(ChunkNode& node, std::size_t brick, std::size_t slab, std::span<const std::uint64_t, 4> words) {
    QUOIN_ASSERT(brick < node.bricks.size(), "one of the node's 64 bricks");
    trace::BrickCode& code = node.bricks[brick];
    if (bricks.words(code).has_four(4 * slab, words.data())) return false;
    code = bricks.put_slab(code, slab, words);
    const std::uint64_t cells = node.cells[brick] = with_slab(node.cells[brick], slab, words);
    const bool is_full = cells == trace::kAll && bricks.is_full(code);
    if (cells == 0 || is_full) set_uniform(node, brick, is_full);
    return true;
  }

  // Replaces all slabs. Returns the bricks that changed, and adds the occupied voxels to `box`.
  template <class Rows>
  std::uint64_t fill(ChunkNode& node, const Rows& rows, trace::RowsBox& box) {
    std::uint64_t changed = 0;
    trace::BrickRow four;
    for (int row = 0; row < 16; ++row) {
      const bool is_mixed = four.read(rows, (row & 3) * 16, (row >> 2) * 16, box);
      for (std::size_t x = 0; x < 4; ++x) {
        const std::size_t brick = x + 4 * static_cast<std::size_t>(row);
        const bool is_other =
            is_mixed ? set_brick(node, brick, four.bricks[x]) : set_uniform(node, brick, four.is_full);
        changed |= std::uint64_t{is_other} << brick;
      }
    }
    return changed;
  }

  // Replaces only the `wanted` slabs. Returns the bricks that changed, and adds their occupied voxels to `box`.
  template <class Rows>
  std::uint64_t fill(ChunkNode& node, const Rows& rows, const ChunkSlabs& wanted, trace::RowsBox& box) {
    std::uint64_t changed = 0;
    trace::SlabRows words;
    for (int row = 0; row < 16; ++row) {
      const int y = (row & 3) * 16;
      const int z = (row >> 2) * 16;
      std::uint32_t slabs = wanted.block(y, z);
      if (std::popcount(slabs) > kFewSlabs) {
        changed |= fill_row(node, rows, row, slabs, box);
        continue;
      }
      for (; slabs != 0; slabs &= slabs - 1) {
        const int slab = std::countr_zero(slabs);
        trace::read_cells(rows, y + 4 * (slab & 3), z + 4 * (slab >> 2), words, box);
        for (std::size_t x = 0; x < 4; ++x) {
          const std::size_t brick = x + 4 * static_cast<std::size_t>(row);
          const std::span<const std::uint64_t, 4> four(&words[4 * x], 4);
          const bool is_other = set_slab(node, brick, static_cast<std::size_t>(slab), four);
          changed |= std::uint64_t{is_other} << brick;
        }
      }
    }
    return changed;
  }

  // Replaces some slabs of a row of four bricks, and stores each brick once.
  template <class Rows>
  std::uint64_t fill_row(ChunkNode& node, const Rows& rows, int row, std::uint32_t slabs, trace::RowsBox& box) {
    QUOIN_ASSERT(row >= 0 && row < 16 && slabs >> 16 == 0, "one of the node's 16 rows, and some of its 16 slabs");
    const std::size_t first = 4 * static_cast<std::size_t>(row);
    std::array<Node, 4> four;
    std::array<std::uint64_t, 4> cells;
    std::array<bool, 4> is_other{};
    trace::SlabRows words;
    for (; slabs != 0; slabs &= slabs - 1) {
      const int slab = std::countr_zero(slabs);
      trace::read_cells(rows, (row & 3) * 16 + 4 * (slab & 3), (row >> 2) * 16 + 4 * (slab >> 2), words, box);
      for (std::size_t x = 0; x < 4; ++x) {
        const std::span<const std::uint64_t, 4> now(&words[4 * x], 4);
        if (!is_other[x]) {
          const trace::BrickWords before = bricks.words(node.bricks[first + x]);
          if (before.has_four(4 * static_cast<std::size_t>(slab), now.data())) continue;
          before.read(four[x]);
          cells[x] = node.cells[first + x];
          is_other[x] = true;
        }
        std::copy_n(now.begin(), 4, &four[x][4 * static_cast<std::size_t>(slab)]);
        cells[x] = with_slab(cells[x], static_cast<std::size_t>(slab), now);
      }
    }
    std::uint64_t changed = 0;
    for (std::size_t x = 0; x < 4; ++x) {
      if (!is_other[x]) continue;
      replace_brick(node, first + x, four[x], cells[x]);
      changed |= std::uint64_t{1} << (first + x);
    }
    return changed;
  }

  // Returns the box of a node's occupied voxels, in chunk coordinates.
  [[nodiscard]] IBox box_of(const ChunkNode& node) const {
    trace::RowsBox box;
    for (int i = 0; i < 64; ++i) {
      const trace::BrickCode brick = node.bricks[static_cast<std::size_t>(i)];
      const IVec3 at = 16 * IVec3{i & 3, i >> 2 & 3, i >> 4};
      if (brick == trace::kEmptyBrick || box.covers_brick(at)) continue;
      const trace::BrickWords words = bricks.words(brick);
      for (std::uint64_t cells = node.cells[static_cast<std::size_t>(i)]; cells != 0; cells &= cells - 1) {
        const int cell = std::countr_zero(cells);
        const IVec3 first = at + 4 * IVec3{cell & 3, cell >> 2 & 3, cell >> 4};
        if (!box.covers_cell(first)) box.add_cell(first, words[static_cast<std::size_t>(cell)]);
      }
    }
    return box.box();
  }

  std::uint64_t drop(IVec3 chunk) {
    chunk_boxes.put(chunk, {});
    remove(chunk);
    return trace::kAll;
  }

  // Replaces the `wanted` slabs of a chunk; other slabs stay unchanged. Returns the bricks that changed.
  template <class Rows>
  std::uint64_t put(const Rows& rows, IVec3 chunk, ChunkSlabs wanted = ChunkSlabs::all()) {
    if (rows.none()) return drop(chunk);
    const IBox* const known = chunk_boxes.find(chunk);
    if (known == nullptr) wanted = ChunkSlabs::all();
    const bool is_partial = !(wanted == ChunkSlabs::all());
    IBox before = known == nullptr ? IBox{} : *known;
    before = {before.min - chunk * kChunkEdge, before.max - chunk * kChunkEdge};
    ChunkNode& node = find_or_create(chunk);
    trace::RowsBox rows_box;
    const std::uint64_t changed = is_partial ? fill(node, rows, wanted, rows_box) : fill(node, rows, rows_box);
    IBox box = rows_box.box();
    if (is_partial && changed == 0) return 0;
    if (is_partial) box = box_after(rows, node, changed, before, box);
    if (box.empty()) return drop(chunk);
    QUOIN_ASSERT(intersect(box, kWholeChunk) == box, "voxels of the chunk");
    chunk_boxes.put(chunk, {box.min + chunk * kChunkEdge, box.max + chunk * kChunkEdge});
    return changed;
  }
  // Returns true if none of the bricks touches a side of a box in their chunk.
  static bool is_inside(std::uint64_t bricks, const IBox& box) {
    const IBox inner{(box.min >> 4) + 1, (box.max - 1) >> 4};  // bricks
    for (; bricks != 0; bricks &= bricks - 1) {
      const int i = std::countr_zero(bricks);
      if (!inner.contains(IVec3{i & 3, i >> 2 & 3, i >> 4})) return false;
    }
    return true;
  }
  // Returns the box of a chunk's occupied voxels after some slabs were replaced. `found` is their box within these
  // slabs.
  template <class Rows>
  [[nodiscard]] IBox box_after(const Rows& rows, const ChunkNode& node, std::uint64_t changed, const IBox& before,
                               const IBox& found) const {
    // If no changed brick touches a side of the old box, every side stays or moves outward.
    if (is_inside(changed, before)) return unite(before, found);
    if constexpr (std::is_same_v<Rows, trace::ChunkRows>) {
      if (const auto known = rows.known_bounds()) return *known;
    }
    return box_of(node);
  }
  std::uint64_t put(const Chunk* voxels, const VoxelRegistry& types, IVec3 chunk,
                    const ChunkSlabs& wanted = ChunkSlabs::all()) {
    if (voxels == nullptr) return drop(chunk);
    const bool was_there = chunk_boxes.find(chunk) != nullptr;
    const std::uint64_t changed = put(trace::ChunkRows(*voxels, types, which), chunk, wanted);
    // A voxel may have changed its type without a change of occupancy. Then no brick has changed.
    if (has_blocks()) {
      set_uniform_blocks(chunk, [&](trace::UniformBlocks& blocks) {
        const ChunkSlabs part = was_there ? with_any(node_of(chunk), changed, wanted) : ChunkSlabs::all();
        if (!(part == ChunkSlabs())) trace::find_uniform_blocks(*voxels, types, part, blocks);
      });
    }
    return changed;
  }
  // As above, with the types that `counts` accepts, and with listed voxels.
  std::uint64_t put(const Chunk* voxels, const VoxelRegistry& types, IVec3 chunk,
                    const FunctionRef<bool(VoxelType)>& counts, const GlassOfChunk& glass) {
    static const Chunk air;
    const trace::ChunkRows rows(voxels == nullptr ? air : *voxels, counts);
    if (rows.none() && glass.cubes.empty() && glass.touched.empty()) return drop(chunk);
    BlockVector<std::uint64_t> listed(std::max(glass.cubes.size(), glass.touched.size()));
    for (const std::span<const std::uint64_t> each : {glass.cubes, glass.touched}) {
      for (std::size_t i = 0; i < each.size(); ++i) listed[i] |= each[i];
    }
    using Rows = trace::ListedChunkRows;
    const std::uint64_t changed =
        listed.empty() ? put(rows, chunk) : put(Rows(rows, listed, Rows::Join::Either), chunk);
    set_uniform_blocks(chunk, [&](trace::UniformBlocks& blocks) {
      blocks = {};
      if (voxels == nullptr || (rows.none() && glass.cubes.empty())) return;
      if (glass.cubes.empty()) {
        trace::find_uniform_blocks(*voxels, types, ChunkSlabs::all(), blocks);
      } else {
        trace::find_uniform_blocks(*voxels, types, glass.cubes, blocks);
      }
      trace::split_blocks(glass.touched, blocks);
    });
    return changed;
  }
  // Returns the wanted slabs that contain voxels, and all wanted slabs in rows with changed bricks. The uniform
  // blocks of other slabs cannot have changed.
  static ChunkSlabs with_any(const ChunkNode& node, std::uint64_t changed, const ChunkSlabs& wanted) {
    ChunkSlabs slabs;
    for (std::size_t row = 0; row < 16; ++row) {
      const IVec3 first{0, static_cast<int>(row & 3) * 16, static_cast<int>(row >> 2) * 16};
      const bool is_changed = (changed >> (4 * row) & 15U) != 0;
      std::uint64_t cells = 0;
      for (std::size_t x = 0; x < 4; ++x) cells |= node.cells[x + 4 * row];
      for (std::uint32_t left = wanted.block(first.y, first.z); left != 0; left &= left - 1) {
        const int slab = std::countr_zero(left);
        if (!is_changed && (cells >> (4 * slab) & 15U) == 0) continue;
        slabs.add(first.y + 4 * (slab & 3), first.z + 4 * (slab >> 2));
      }
    }
    return slabs;
  }

  std::uint64_t put_glass(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk) {
    const std::uint64_t changed = put(trace::GlassRows(field, types, chunk), chunk);
    set_uniform_blocks(chunk,
                       [&](trace::UniformBlocks& blocks) { blocks = trace::uniform_glass(field, types, chunk); });
    return changed;
  }

  template <class Find>
  void set_uniform_blocks(IVec3 chunk, const Find& find_blocks) {
    const std::uint32_t index = index_of(chunk);
    if (index == 0) return;
    std::unique_ptr<trace::UniformBlocks>& blocks = chunk_nodes[index]->uniform;
    if (blocks == nullptr) blocks = std::make_unique<trace::UniformBlocks>();
    find_blocks(*blocks);
  }

  // Replaces the 4 bits at `bit`.
  static void put_bits(LargeArray<std::uint32_t>& words, std::size_t bit, std::uint64_t bits) {
    const std::size_t word = bit / 32;
    QUOIN_ASSERT(bits < 16 && word + 1 < words.size(), "bits of the table");
    const unsigned shift = bit % 32;
    const std::uint64_t mask = std::uint64_t{15} << shift;
    std::uint64_t both = words[word] | std::uint64_t{words[word + 1]} << 32;
    both = (both & ~mask) | bits << shift;
    words[word] = static_cast<std::uint32_t>(both);
    words[word + 1] = static_cast<std::uint32_t>(both >> 32);
  }

  [[nodiscard]] std::uint32_t index_of(IVec3 chunk) const {
    const RegionNode* region = find(chunk >> kRegionShift);
    return region == nullptr ? 0 : region->node(word_of(chunk & 15), bit_of(chunk & 15));
  }
  [[nodiscard]] const ChunkNode& node_of(IVec3 chunk) const { return *chunk_nodes[index_of(chunk)]; }

  // Copies some of a chunk's bricks and their cells into flat tables.
  void flatten(FlatTables& tables, IVec3 chunk, std::uint64_t changed) const {
    if (changed == 0) return;
    QUOIN_ASSERT(tables.box.contains(chunk), "a chunk of the tables");
    const ChunkNode& node = node_of(chunk);
    const IVec3 at = chunk - tables.box.min;
    std::uint64_t bricks_there = 0;
    for (std::size_t i = 0; i < 64; ++i) bricks_there |= std::uint64_t{node.cells[i] != 0} << i;
    tables.nodes[place_in(tables.chunk_strides(), at)] = {bricks_there, &node};
    const IVec3 cells = tables.cell_strides();
    const IVec3 bricks_at = tables.brick_strides();
    for (; changed != 0; changed &= changed - 1) {
      const int i = std::countr_zero(changed);
      const IVec3 brick = at * 4 + IVec3{i & 3, i >> 2 & 3, i >> 4};
      tables.first_brick()[place_in(bricks_at, brick)] = node.bricks[static_cast<std::size_t>(i)];
      for (int row = 0; row < 16; ++row) {
        const IVec3 cell = brick * 4 + IVec3{1, (row & 3) + 1, (row >> 2) + 1};
        put_bits(tables.cells, place_in(cells, cell), node.cells[static_cast<std::size_t>(i)] >> (4 * row) & 15U);
      }
    }
  }

  [[nodiscard]] const RegionNode* find(IVec3 region) const {
    const auto found = regions.find(region);
    return found == regions.end() ? nullptr : found->second.get();
  }

  // Returns true if tables for this box of chunks are not too large for its content.
  [[nodiscard]] bool can_be_flat(const IBox& chunks) const {
    const IVec3 size = chunks.size();
    const std::int64_t cells = (16 * std::int64_t{size.x} + 2) * (16 * std::int64_t{size.y} + 2);
    const std::size_t used_bytes =
        bricks.count() * sizeof(Node) + (chunk_nodes.size() - free_chunks.size()) * sizeof(ChunkNode);
    const auto limit = static_cast<double>(std::max(kSmallTables, static_cast<std::int64_t>(used_bytes)));
    const double brick_bytes = 4.0 * 64.0 * size.x * static_cast<double>(size.y) * size.z;
    // Kernels count cell bits and half words of bricks in 32 bits.
    return !chunks.empty() && bricks.line_count() <= trace::kMaxBrickLines &&
           bits_of(cells, size.z) / 8 + brick_bytes <= limit && bits_of(cells, size.z) <= 2e9;
  }
  static double bits_of(std::int64_t cells, int chunks_along_z) {
    return static_cast<double>(cells) * (16.0 * chunks_along_z + 2.0);
  }

  // Makes empty tables for a box of chunks around `all`.
  [[nodiscard]] FlatTables empty_tables(const IBox& box, const IBox& all) const {
    static_assert(trace::kEmptyBrick == 0, "as the bytes of a new array");
    const IVec3 size = box.size();
    const std::int64_t cells = (16 * std::int64_t{size.x} + 2) * (16 * std::int64_t{size.y} + 2);
    QUOIN_ASSERT(bits_of(cells, size.z) <= 2e9, "cells that kernels can count in 32 bits");
    FlatTables tables;
    tables.cells = LargeArray<std::uint32_t>(static_cast<std::size_t>(bits_of(cells, size.z)) / 32 + 2);
    tables.bricks = LargeArray<trace::BrickCode>(64 * volume(size) + 2);
    tables.nodes.assign(volume(size), {0, chunk_nodes.front().get()});
    tables.box = box;
    tables.first = all;
    return tables;
  }
  static std::size_t volume(IVec3 size) {
    return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) * static_cast<std::size_t>(size.z);
  }

  void make_flat(const IBox& chunks) {
    next = {};
    flat = {};
    flat = empty_tables(chunks, chunks);
    for (const auto& [chunk, box] : chunk_boxes) flatten(flat, chunk, trace::kAll);
  }

  // ORs a row of bits from one table into another, where the bits are 0.
  static void copy_bits(const LargeArray<std::uint32_t>& from, std::size_t from_bit, LargeArray<std::uint32_t>& to,
                        std::size_t to_bit, std::size_t count) {
    QUOIN_ASSERT((from_bit + count - 1) / 32 + 1 < from.size() && (to_bit + count - 1) / 32 + 1 < to.size(),
                 "bits of the tables");
    for (std::size_t i = 0; i < count; i += 32) {
      const std::size_t a = from_bit + i;
      const std::size_t b = to_bit + i;
      std::uint64_t bits = (from[a / 32] | std::uint64_t{from[a / 32 + 1]} << 32) >> (a % 32) & 0xFFFF'FFFFU;
      if (count - i < 32) bits &= (std::uint64_t{1} << (count - i)) - 1;
      bits <<= b % 32;
      to[b / 32] |= static_cast<std::uint32_t>(bits);
      to[b / 32 + 1] |= static_cast<std::uint32_t>(bits >> 32);
    }
  }

  // The rows along x of the chunks that `flat` and `next` share: their count, and the number of a chunk's row.
  [[nodiscard]] static int rows_of(const IBox& shared) { return shared.size().y * shared.size().z; }
  [[nodiscard]] static int row_of(const IBox& shared, IVec3 chunk) {
    return chunk.y - shared.min.y + (chunk.z - shared.min.z) * shared.size().y;
  }

  static void copy_row(const FlatTables& from, FlatTables& to, const IBox& shared, int row) {
    const IVec3 first = shared.min + IVec3{0, row % shared.size().y, row / shared.size().y};
    QUOIN_ASSERT(row >= 0 && shared.contains(first), "a row of the shared chunks");
    const IVec3 a = first - from.box.min;
    const IVec3 b = first - to.box.min;
    const int count = shared.size().x;
    std::copy_n(&from.nodes[place_in(from.chunk_strides(), a)], count, &to.nodes[place_in(to.chunk_strides(), b)]);
    for (int i = 0; i < 16; ++i) {
      const IVec3 at{0, i & 3, i >> 2};
      std::copy_n(from.first_brick() + place_in(from.brick_strides(), 4 * a + at), 4 * count,
                  to.first_brick() + place_in(to.brick_strides(), 4 * b + at));
    }
    for (int i = 0; i < 256; ++i) {
      const IVec3 at{1, 1 + (i & 15), 1 + (i >> 4)};
      copy_bits(from.cells, place_in(from.cell_strides(), 16 * a + at), to.cells,
                place_in(to.cell_strides(), 16 * b + at), 16 * static_cast<std::size_t>(count));
    }
  }

  // Copies up to `count` further rows to `next`. Returns true if it then has all.
  bool copy_rows(int count) {
    const IBox shared = intersect(flat.box, next.box);
    const int rows = rows_of(shared);
    for (; next_rows < rows && count > 0; --count) copy_row(flat, next, shared, next_rows++);
    return next_rows == rows;
  }

  void start_next(const IBox& box, const IBox& chunks) {
    next = {};
    next = empty_tables(box, chunks);
    next_rows = 0;
  }

  // Replaces the tables, which do not have all chunks, by tables that do. Copies what `next` does not have yet.
  void move_flat(const IBox& chunks) {
    if (!(intersect(chunks, next.box) == chunks)) start_next(with_room(chunks), chunks);
    (void)copy_rows(rows_of(next.box));
    flat = std::exchange(next, {});
  }

  // Does a part of the work of the next `move_flat`, so that no single update does it all.
  void prepare_next(const IBox& chunks) {
    if (!(intersect(chunks, next.box) == chunks)) {
      next = {};
      if (!needs_room_soon(chunks)) return;
      const IBox box = with_room(chunks);
      if (intersect(box, flat.box) == box) return;  // larger tables would be too large
      start_next(box, chunks);
    }
    if (copy_rows(std::max(1, kChunksCopied / flat.chunks().x))) flat = std::exchange(next, {});
  }

  // The room, in chunks, for growth on one side of a box of all chunks.
  static int room_along(const IBox& chunks, int axis) { return std::max(1, chunks.size()[axis] / 8); }

  // Adds room to a box of all chunks, on the sides where it has grown since the tables were made.
  [[nodiscard]] IBox with_room(const IBox& chunks) const {
    IBox grown = chunks;
    for (int axis = 0; axis < 3; ++axis) {
      if (chunks.min[axis] < flat.first.min[axis]) grown.min[axis] -= room_along(chunks, axis);
      if (chunks.max[axis] > flat.first.max[axis]) grown.max[axis] += room_along(chunks, axis);
    }
    return can_be_flat(grown) ? grown : chunks;
  }

  // Returns true if half of the room is used up on a side where the box of all chunks has grown.
  [[nodiscard]] bool needs_room_soon(const IBox& chunks) const {
    for (int axis = 0; axis < 3; ++axis) {
      const int half = room_along(chunks, axis) / 2;
      if (chunks.min[axis] < flat.first.min[axis] && chunks.min[axis] - flat.box.min[axis] <= half) return true;
      if (chunks.max[axis] > flat.first.max[axis] && flat.box.max[axis] - chunks.max[axis] <= half) return true;
    }
    return false;
  }

  // Updates the bounds after chunks were replaced, and the tables for the `changed` chunks.
  void finish(std::span<const ChunkBricks> changed) {
    renew_tables(changed);
    QUOIN_ASSERT(flat.box.empty() || flat.nodes.size() == volume(flat.chunks()), "tables of their chunks");
    if (is_flat) view = make_view(flat, bricks.middle(), bounds);
  }

  [[nodiscard]] const trace::TreeView* kernel_view() const { return is_flat ? &view : nullptr; }

  // Keeps changes for unused tables, up to a limit.
  void miss(std::span<const ChunkBricks> changed) {
    constexpr std::size_t kMostMissed = 1024;
    next = {};
    if (flat.box.empty()) return;
    missed.insert(missed.end(), changed.begin(), changed.end());
    if (missed.size() <= kMostMissed) return;
    flat = {};
    missed = {};
  }
  void put_changes(std::span<const ChunkBricks> changed) {
    const IBox shared = intersect(flat.box, next.box);
    for (const auto& [chunk, changed_bricks] : changed) {
      if (!flat.box.contains(chunk)) continue;
      flatten(flat, chunk, changed_bricks);
      if (shared.contains(chunk) && row_of(shared, chunk) < next_rows) flatten(next, chunk, changed_bricks);
    }
  }

  void renew_tables(std::span<const ChunkBricks> changed) {
    bounds = chunk_boxes.bounds();
    const IBox chunks = bounds.empty() ? IBox{} : IBox{chunk_of(bounds.min), chunk_of(bounds.max - 1) + 1};
    // As in a tree built from scratch.
    is_flat = can_be_flat(chunks);
    if (!is_flat) return miss(changed);
    const bool is_little = !flat.box.empty() && volume(chunks.size()) < volume(flat.chunks()) / 4;
    if (flat.box.empty() || (is_little && !can_be_flat(flat.box))) {
      missed = {};
      return make_flat(chunks);
    }
    if (!(intersect(chunks, flat.box) == chunks)) move_flat(chunks);
    put_changes(missed);
    missed.clear();
    put_changes(changed);
    prepare_next(chunks);
  }
};

OccupancyTree::OccupancyTree(Occupancy which) : impl_(std::make_unique<Impl>()) {
  impl_->which = which;
}
OccupancyTree::OccupancyTree(OccupancyTree&& other) noexcept
    : impl_(std::move(other.impl_)), view_(std::exchange(other.view_, nullptr)) {}
OccupancyTree& OccupancyTree::operator=(OccupancyTree&& other) noexcept {
  impl_ = std::move(other.impl_);
  view_ = std::exchange(other.view_, nullptr);
  return *this;
}
OccupancyTree::~OccupancyTree() = default;

OccupancyTree OccupancyTree::build(const Grid& grid, const VoxelRegistry& types, Occupancy which) {
  OccupancyTree tree(which);
  for (const IVec3 chunk : grid.chunks()) tree.impl_->put(grid.find_chunk(chunk), types, chunk);
  tree.finish_build();
  return tree;
}

OccupancyTree OccupancyTree::build(const DensityGrid& field) {
  OccupancyTree tree;
  for (const IVec3 chunk : cells_of(field.chunks())) tree.impl_->put(trace::CellRows(field, chunk), chunk);
  tree.finish_build();
  return tree;
}

OccupancyTree OccupancyTree::build(const DensityGrid& field, const VoxelRegistry& types) {
  OccupancyTree tree(Occupancy::Transparent);
  std::vector<IVec3> chunks = field.chunks();
  std::erase_if(chunks, [&](IVec3 chunk) { return !trace::has_glass(*field.find_chunk(chunk), types); });
  for (const IVec3 chunk : cells_of(chunks)) tree.impl_->put_glass(field, types, chunk);
  tree.finish_build();
  return tree;
}

OccupancyTree OccupancyTree::build(std::span<const IVec3> chunks, const RowsOfVoxels& rows) {
  OccupancyTree tree;
  for (const IVec3 chunk : chunks) tree.impl_->put(ListedRows(rows, chunk), chunk);
  tree.finish_build();
  return tree;
}

void OccupancyTree::finish_build() {
  impl_->bricks.finish_build();
  impl_->finish({});
  view_ = impl_->kernel_view();
}

void OccupancyTree::finish_update(std::span<const trace::ChunkBricks> changed) {
  impl_->finish(changed);
  view_ = impl_->kernel_view();
}

void OccupancyTree::update(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes) {
  QUOIN_ASSERT(impl_ != nullptr, "a tree that was not moved from");
  if (changes.all) {
    *this = build(grid, types, impl_->which);
    return;
  }
  std::vector<ChunkBricks> changed;
  changed.reserve(changes.items_unless_all().size());
  for (const ChunkChange& each : changes.items_unless_all()) {
    changed.push_back({each.chunk, impl_->put(grid.find_chunk(each.chunk), types, each.chunk, each.slabs)});
  }
  finish_update(changed);
}

void OccupancyTree::update(const DensityGrid& field, const DensityChanges& changes) {
  QUOIN_ASSERT(impl_ != nullptr, "a tree that was not moved from");
  if (changes.all) {
    *this = build(field);
    return;
  }
  std::vector<ChunkBricks> changed;
  for (const SlabsOfChunk& each : cells_reached(changes)) {
    changed.push_back({each.chunk, impl_->put(trace::CellRows(field, each.chunk), each.chunk, each.slabs)});
  }
  finish_update(changed);
}

void OccupancyTree::update(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes) {
  QUOIN_ASSERT(impl_ != nullptr, "a tree that was not moved from");
  if (changes.all) {
    *this = build(field, types);
    return;
  }
  std::vector<ChunkBricks> changed;
  for (const SlabsOfChunk& each : cells_reached(changes)) {
    changed.push_back({each.chunk, impl_->put_glass(field, types, each.chunk)});
  }
  finish_update(changed);
}

void OccupancyTree::update(const Grid& grid, const VoxelRegistry& types, std::span<const IVec3> chunks,
                           const CubesOfChunk& cubes_in) {
  const auto is_glass = [&](VoxelType type) { return types.is_transparent(type) && !types.is_shaped(type); };
  update(grid, types, chunks, is_glass, [&](IVec3 chunk) { return GlassOfChunk{cubes_in(chunk), {}}; });
}

void OccupancyTree::update(const Grid& grid, const VoxelRegistry& types, std::span<const IVec3> chunks,
                           const FunctionRef<bool(VoxelType)>& counts,
                           const FunctionRef<GlassOfChunk(IVec3 chunk)>& glass_in) {
  QUOIN_ASSERT(impl_ != nullptr && impl_->which == Occupancy::Glass, "a tree of glass that was not moved from");
  std::vector<ChunkBricks> changed;
  changed.reserve(chunks.size());
  for (const IVec3 chunk : chunks) {
    changed.push_back({chunk, impl_->put(grid.find_chunk(chunk), types, chunk, counts, glass_in(chunk))});
  }
  finish_update(changed);
}

void OccupancyTree::update(std::span<const IVec3> chunks, const RowsOfVoxels& rows) {
  QUOIN_ASSERT(impl_ != nullptr, "a tree that was not moved from");
  std::vector<ChunkBricks> changed;
  for (const IVec3 chunk : chunks) changed.push_back({chunk, impl_->put(ListedRows(rows, chunk), chunk)});
  finish_update(changed);
}

IBox OccupancyTree::bounds() const {
  QUOIN_ASSERT(impl_ != nullptr, "a tree that was not moved from");
  return impl_->bounds;
}

bool OccupancyTree::is_occupied(IVec3 voxel) const {
  QUOIN_ASSERT(impl_ != nullptr, "a tree that was not moved from");
  const RegionNode* region = impl_->find({voxel.x >> 10, voxel.y >> 10, voxel.z >> 10});
  if (region == nullptr) return false;
  const IVec3 chunk = (voxel >> kChunkShift) & 15;
  const ChunkNode& node = *impl_->chunk_nodes[region->node(word_of(chunk), bit_of(chunk))];
  const IVec3 brick = (voxel >> 4) & 3;
  const trace::BrickWords words =
      impl_->bricks.words(node.bricks[static_cast<std::size_t>(brick.x + 4 * brick.y + 16 * brick.z)]);
  const IVec3 unit = voxel & 15;
  return (words[word_of(unit)] >> bit_of(unit) & 1U) != 0;
}

std::size_t OccupancyTree::bytes() const {
  QUOIN_ASSERT(impl_ != nullptr, "a tree that was not moved from");
  const std::size_t node_bytes = sizeof(ChunkNode) + (impl_->has_blocks() ? sizeof(trace::UniformBlocks) : 0);
  std::size_t region_bytes = 0;
  for (const auto& [at, region] : impl_->regions) region_bytes += region->bytes();
  return sizeof(OccupancyTree) + sizeof(Impl) + region_bytes + impl_->chunk_nodes.capacity() * sizeof(void*) +
         impl_->chunk_nodes.size() * node_bytes + impl_->bricks.bytes() + impl_->chunk_boxes.bytes() +
         impl_->missed.capacity() * sizeof(ChunkBricks) + impl_->flat.bytes() + impl_->next.bytes();
}

const OccupancyTree::Impl& OccupancyTree::impl() const {
  QUOIN_ASSERT(impl_ != nullptr, "a tree that was not moved from");
  return *impl_;
}

trace::TreeNodes::TreeNodes(const OccupancyTree& tree)
    : tree_(&tree.impl()), chunks_(tree_->chunk_nodes.data()), lines_(tree_->bricks.middle()) {}

const RegionNode* trace::TreeNodes::find_region(IVec3 region) const {
  return tree_->find(region);
}

const ChunkNode* trace::TreeNodes::find_chunk(IVec3 chunk) const {
  const RegionNode* region = find_region(chunk >> kRegionShift);
  const std::uint32_t index = region == nullptr ? 0 : region->node(word_of(chunk & 15), bit_of(chunk & 15));
  return index == 0 ? nullptr : chunks_[index].get();
}

}  // namespace quoin

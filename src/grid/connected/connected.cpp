// Runs of voxels are joined into parts of chunks (chunk_parts.h). Parts that touch across chunk borders are linked, and
// linked parts form pieces. An edit recomputes the parts and links of its chunks. Pieces are rebuilt from all
// links, which are few.

#include <quoin/grid/connected.h>

#include <algorithm>
#include <array>
#include <map>
#include <tuple>
#include <utility>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"
#include "core/moved_from.h"
#include "grid/connected/chunk_parts.h"
#include "grid/connected/mass_sum.h"

namespace quoin {
namespace {

// The offsets of following chunks; with their opposites these are all neighbours. The first three share faces.
constexpr std::array<std::array<int, 3>, 13> kNextChunks = {{{1, 0, 0},
                                                             {0, 1, 0},
                                                             {0, 0, 1},
                                                             {1, -1, -1},
                                                             {1, 0, -1},
                                                             {1, 1, -1},
                                                             {1, -1, 0},
                                                             {1, 1, 0},
                                                             {1, -1, 1},
                                                             {1, 0, 1},
                                                             {1, 1, 1},
                                                             {0, -1, 1},
                                                             {0, 1, 1}}};

IVec3 next_chunk(std::size_t i) {
  QUOIN_ASSERT(i < kNextChunks.size(), "the index of a following chunk");
  return {kNextChunks[i][0], kNextChunks[i][1], kNextChunks[i][2]};
}

// Two parts that touch: one in a chunk, the other in a later chunk.
struct Link {
  std::uint32_t part = 0;
  std::uint32_t other = 0;
  std::uint8_t next = 0;  // index of the later chunk's offset

  auto operator<=>(const Link&) const = default;
};

struct Entry {
  IVec3 at{0};
  ChunkParts parts;
  std::vector<Link> links;
  std::vector<std::uint32_t> open_parts;  // ascending: parts that touch an unloaded chunk
  std::size_t first_node = 0;             // node of its first part
};

using Entries = std::map<IVec3, Entry, ByZyx>;

// Finds which parts of two chunks touch, the second at `offset` from the first.
class Linker {
 public:
  Linker(const ChunkParts& a, const ChunkParts& b, std::size_t next, Connectivity connectivity)
      : a_(a), b_(b), next_(next), connectivity_(connectivity) {}

  std::vector<Link> find() {
    const IVec3 offset = next_chunk(next_);
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        const int steps = std::abs(offset.x) + std::abs(dy) + std::abs(dz);
        if (connectivity_ == Connectivity::Faces6 && steps != 1) continue;
        const auto [first_y, end_y] = rows_that_reach(offset.y, dy);
        const auto [first_z, end_z] = rows_that_reach(offset.z, dz);
        for (int z = first_z; z < end_z; ++z) {
          for (int y = first_y; y < end_y; ++y) {
            join_rows(y, z, y + dy - offset.y * kChunkEdge, z + dz - offset.z * kChunkEdge, offset.x);
            // Two parts need only one link.
            if (!links_.empty() && a_.parts().size() == 1 && b_.parts().size() == 1) return std::move(links_);
          }
        }
      }
    }
    std::sort(links_.begin(), links_.end());
    links_.erase(std::unique(links_.begin(), links_.end()), links_.end());
    return std::move(links_);
  }

 private:
  // Returns the range of coordinates that a step of -1, 0 or 1 moves into the chunk at an offset.
  static std::pair<int, int> rows_that_reach(int offset, int step) {
    const int first = std::max(offset * kChunkEdge - step, 0);
    return {first, std::min((offset + 1) * kChunkEdge - step, kChunkEdge)};
  }
  void join_rows(int y, int z, int other_y, int other_z, int offset_x) {
    const std::uint64_t row = a_.row(y, z);
    if (row == 0 || (offset_x != 0 && row >> 63 == 0)) return;
    const std::uint64_t other = b_.row(other_y, other_z);
    const auto touch = [&](int x, int other_x) {
      const Link link{a_.part_at(row, x, y, z), b_.part_at(other, other_x, other_y, other_z),
                      static_cast<std::uint8_t>(next_)};
      if (links_.empty() || links_.back() != link) links_.push_back(link);
    };
    if (offset_x == 0) {
      for_each_contact(row, other, connectivity_, touch);
    } else if ((other & 1U) != 0) {
      touch(kChunkEdge - 1, 0);
    }
  }

  const ChunkParts& a_;
  const ChunkParts& b_;
  std::size_t next_;
  Connectivity connectivity_;
  std::vector<Link> links_;
};

// Returns true if a part has a voxel at the side, edge or corner of its chunk towards a neighbour.
bool touches(const ChunkParts& parts, std::uint32_t part, IVec3 towards) {
  QUOIN_ASSERT(part < parts.parts().size() && towards != IVec3(0), "a part and a neighbour");
  const IBox box = parts.parts()[part].box();
  IBox side{IVec3(0), IVec3(kChunkEdge)};
  int fixed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (towards[axis] == 0) continue;
    ++fixed;
    side.min[axis] = towards[axis] < 0 ? 0 : kChunkEdge - 1;
    side.max[axis] = side.min[axis] + 1;
  }
  const IBox rows = intersect(box, side);
  if (rows.empty()) return false;
  if (fixed == 1) return true;  // its box is tight
  const auto width = static_cast<unsigned>(rows.size().x);
  const std::uint64_t columns = (width == kChunkEdge ? ~std::uint64_t{0} : (std::uint64_t{1} << width) - 1)
                                << rows.min.x;
  for (int z = rows.min.z; z < rows.max.z; ++z) {
    for (int y = rows.min.y; y < rows.max.y; ++y) {
      if ((parts.row_of_part(parts.row(y, z), y, z, part) & columns) != 0) return true;
    }
  }
  return false;
}

IBox moved(const IBox& box, IVec3 by) {
  return {box.min + by, box.max + by};
}

bool holds(const IBox& box, const IBox& inner) {
  return intersect(box, inner) == inner;
}

// Returns a mask of the voxels of a row within an x range.
std::uint64_t columns(int first, int end) {
  QUOIN_ASSERT(first >= 0 && first < end && end <= kChunkEdge, "0 <= first < end <= 64");
  const std::uint64_t up_to_end = end == kChunkEdge ? ~std::uint64_t{0} : (std::uint64_t{1} << end) - 1;
  return up_to_end & ~std::uint64_t{0} << first;
}

}  // namespace

struct ConnectedPieces::Impl {
  void take_data(IVec3 at, const Chunk* chunk);

  ConnectedOptions options;
  ChangeCursor followed;
  Entries entries;
  std::vector<ConnectedPiece> pieces;
  std::vector<std::size_t> piece_of_node;
  std::vector<std::size_t> nodes;        // by piece, then ascending
  std::vector<std::size_t> first_nodes;  // [piece]: in `nodes`; one more at the end
  std::vector<const Entry*> in_order;    // the entries, by their first nodes

  void find_parts(const Grid& grid, const std::vector<IVec3>& chunks, Threads threads);
  void find_links(const std::vector<IVec3>& chunks, Threads threads);
  void find_open_parts(const Grid& grid, const std::vector<IVec3>& chunks);
  void find_open_parts(const Grid& grid, Entry& entry) const;
  void make_pieces();
  void number_pieces(UnionFind<std::size_t>& sets);
  void add_node(std::size_t piece, const Entry& entry, std::size_t part);
  [[nodiscard]] const Entry& entry_of_node(std::size_t node) const {
    const auto after = std::upper_bound(in_order.begin(), in_order.end(), node,
                                        [](std::size_t n, const Entry* entry) { return n < entry->first_node; });
    QUOIN_ASSERT(after != in_order.begin(), "the first entry's nodes begin at 0");
    return **std::prev(after);
  }
  // Calls `visit(entry, nodes of the piece in it)` for the chunks of a piece.
  template <class Visit>
  void for_each_chunk(std::size_t piece, Visit&& visit) const {
    QUOIN_ASSERT(piece < pieces.size(), "piece < size()");
    for (std::size_t i = first_nodes[piece]; i < first_nodes[piece + 1];) {
      const Entry& entry = entry_of_node(nodes[i]);
      const std::size_t end_node = entry.first_node + entry.parts.parts().size();
      std::size_t end = i;
      while (end < first_nodes[piece + 1] && nodes[end] < end_node) ++end;
      visit(entry, std::span(nodes).subspan(i, end - i));
      i = end;
    }
  }
  // Returns true if the nodes contain all non-air voxels of the chunk.
  static bool are_all(const Entry& entry, std::span<const std::size_t> of_piece) {
    std::int64_t voxels = 0;
    for (const std::size_t node : of_piece) voxels += entry.parts.parts()[node - entry.first_node].voxels;
    return voxels == entry.parts.chunk().non_air_count();
  }
  template <class Visit>
  static void for_each_row(const Entry& entry, std::span<const std::size_t> of_piece, Visit&& visit);
  void mark_touching(const Entry& entry, const IBox& box, std::vector<bool>& marks) const;
  [[nodiscard]] std::vector<std::size_t> listed(const IBox& box, bool touching) const;
};

// Recomputes the parts of these chunks.
void ConnectedPieces::Impl::find_parts(const Grid& grid, const std::vector<IVec3>& chunks, Threads threads) {
  std::vector<ChunkParts> made(chunks.size());
  const std::size_t tasks = std::min<std::size_t>(chunks.size(), std::size_t{8} * thread_count(threads));
  parallel_for(tasks, threads, [&](std::size_t task) {
    const auto scratch = std::make_unique<ChunkParts::Scratch>();
    for (std::size_t i = task; i < chunks.size(); i += tasks) {
      const Chunk* chunk = grid.find_chunk(chunks[i]);
      if (chunk != nullptr) made[i] = ChunkParts(*chunk, options, *scratch);
    }
  });
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (made[i].parts().empty()) {
      entries.erase(chunks[i]);
      continue;
    }
    Entry& entry = entries[chunks[i]];
    entry.at = chunks[i];
    entry.parts = std::move(made[i]);
  }
}

// Recomputes the links of these chunks to their neighbours.
void ConnectedPieces::Impl::find_links(const std::vector<IVec3>& chunks, Threads threads) {
  struct Pair {
    IVec3 at;
    std::size_t next;
    Entry* entry;
    std::vector<Link> links;
  };
  std::vector<Pair> pairs;
  const std::size_t nexts = options.connectivity == Connectivity::Faces6 ? 3 : kNextChunks.size();
  const auto add = [&](IVec3 at, std::size_t next) {
    const auto found = entries.find(at);
    if (found != entries.end()) pairs.push_back({at, next, &found->second, {}});
  };
  for (const IVec3 chunk : chunks) {
    for (std::size_t next = 0; next < nexts; ++next) {
      add(chunk, next);
      // Links from a chunk that also changed are found anyway.
      const IVec3 before = chunk - next_chunk(next);
      if (!std::binary_search(chunks.begin(), chunks.end(), before, by_zyx)) add(before, next);
    }
  }
  const std::size_t tasks = std::min<std::size_t>(pairs.size(), std::size_t{8} * thread_count(threads));
  parallel_for(tasks, threads, [&](std::size_t task) {
    for (std::size_t i = task; i < pairs.size(); i += tasks) {
      const auto other = entries.find(pairs[i].at + next_chunk(pairs[i].next));
      if (other == entries.end()) continue;
      pairs[i].links = Linker(pairs[i].entry->parts, other->second.parts, pairs[i].next, options.connectivity).find();
    }
  });
  for (Pair& pair : pairs) {
    std::vector<Link>& links = pair.entry->links;
    std::erase_if(links, [&](const Link& link) { return link.next == pair.next; });
    links.insert(links.end(), pair.links.begin(), pair.links.end());
  }
}

// Recomputes which parts of these chunks and their neighbours touch unloaded chunks.
void ConnectedPieces::Impl::find_open_parts(const Grid& grid, const std::vector<IVec3>& chunks) {
  if (!grid.is_partial()) return;
  std::vector<IVec3> around;
  for (const IVec3 chunk : chunks) {
    for (int i = 0; i < 27; ++i) around.push_back(chunk + IVec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
  }
  sort_and_unite(around);
  for (const IVec3 chunk : around) {
    const auto found = entries.find(chunk);
    if (found != entries.end()) find_open_parts(grid, found->second);
  }
}

void ConnectedPieces::Impl::find_open_parts(const Grid& grid, Entry& entry) const {
  entry.open_parts.clear();
  for (int i = 0; i < 27; ++i) {
    const IVec3 towards(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    const int steps = std::abs(towards.x) + std::abs(towards.y) + std::abs(towards.z);
    if (steps == 0 || (options.connectivity == Connectivity::Faces6 && steps != 1)) continue;
    if (grid.is_loaded(entry.at + towards)) continue;
    for (std::uint32_t part = 0; part < entry.parts.parts().size(); ++part) {
      if (touches(entry.parts, part, towards)) entry.open_parts.push_back(part);
    }
  }
  std::sort(entry.open_parts.begin(), entry.open_parts.end());
  entry.open_parts.erase(std::unique(entry.open_parts.begin(), entry.open_parts.end()), entry.open_parts.end());
}

void ConnectedPieces::Impl::make_pieces() {
  std::size_t count = 0;
  in_order.clear();
  for (auto& [at, entry] : entries) {
    entry.first_node = count;
    count += entry.parts.parts().size();
    in_order.push_back(&entry);
  }
  UnionFind<std::size_t> sets;
  sets.reset(count);
  for (const Entry* entry : in_order) {
    const Entry* other = nullptr;
    std::size_t next = kNextChunks.size();
    for (const Link& link : entry->links) {
      if (link.next != next) {
        const auto found = entries.find(entry->at + next_chunk(link.next));
        QUOIN_ASSERT(found != entries.end(), "links lead to existing chunks");
        other = &found->second;
      }
      next = link.next;
      QUOIN_ASSERT(link.part < entry->parts.parts().size() && link.other < other->parts.parts().size(),
                   "links lead to existing parts");
      sets.unite(entry->first_node + link.part, other->first_node + link.other);
    }
  }
  number_pieces(sets);
}

void ConnectedPieces::Impl::number_pieces(UnionFind<std::size_t>& sets) {
  const std::size_t count = sets.size();
  pieces.clear();
  piece_of_node.resize(count);
  for (const Entry* entry : in_order) {
    for (std::size_t part = 0; part < entry->parts.parts().size(); ++part) {
      const std::size_t node = entry->first_node + part;
      const std::size_t root = sets.find(node);
      QUOIN_ASSERT(root <= node, "the first node of a piece represents it");
      piece_of_node[node] = root == node ? pieces.size() : piece_of_node[root];
      if (root == node) pieces.emplace_back();
      add_node(piece_of_node[node], *entry, part);
    }
  }
  // Sorts by first voxels: a piece may begin in a later chunk, but at a lower z.
  std::vector<std::size_t> order(pieces.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [this](std::size_t a, std::size_t b) { return by_zyx(pieces[a].first, pieces[b].first); });
  std::vector<std::size_t> place(pieces.size());
  std::vector<ConnectedPiece> sorted(pieces.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    place[order[i]] = i;
    sorted[i] = pieces[order[i]];
  }
  pieces = std::move(sorted);

  first_nodes.assign(pieces.size() + 1, 0);
  for (std::size_t& piece : piece_of_node) {
    piece = place[piece];
    ++first_nodes[piece + 1];
  }
  for (std::size_t i = 0; i < pieces.size(); ++i) first_nodes[i + 1] += first_nodes[i];
  QUOIN_ASSERT(first_nodes.back() == count, "each node is in one piece");
  nodes.resize(count);
  std::vector<std::size_t> next(first_nodes.begin(), first_nodes.end() - 1);
  for (std::size_t node = 0; node < count; ++node) nodes[next[piece_of_node[node]]++] = node;
}

void ConnectedPieces::Impl::add_node(std::size_t piece, const Entry& entry, std::size_t part) {
  QUOIN_ASSERT(piece < pieces.size() && part < entry.parts.parts().size(), "a piece and a part of the chunk");
  const ChunkPart& added = entry.parts.parts()[part];
  const IVec3 origin = entry.at * kChunkEdge;
  const IVec3 first = origin + added.first_voxel();
  ConnectedPiece& whole = pieces[piece];
  if (whole.voxels == 0 || by_zyx(first, whole.first)) whole.first = first;
  whole.box = unite(whole.box, moved(added.box(), origin));
  whole.voxels += added.voxels;
  whole.touches_unloaded |= std::binary_search(entry.open_parts.begin(), entry.open_parts.end(), part);
}

template <class Visit>
void ConnectedPieces::Impl::for_each_row(const Entry& entry, std::span<const std::size_t> of_piece, Visit&& visit) {
  IBox box;
  for (const std::size_t node : of_piece) box = unite(box, entry.parts.parts()[node - entry.first_node].box());
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      const std::uint64_t row = entry.parts.row(y, z);
      std::uint64_t voxels = 0;
      for (const std::size_t node : of_piece) {
        const std::size_t part = node - entry.first_node;
        const IBox part_box = entry.parts.parts()[part].box();
        if (y < part_box.min.y || y >= part_box.max.y || z < part_box.min.z || z >= part_box.max.z) continue;
        voxels |= entry.parts.row_of_part(row, y, z, static_cast<std::uint32_t>(part));
      }
      if (voxels != 0) visit(IVec3(0, y, z), voxels);
    }
  }
}

void ConnectedPieces::Impl::mark_touching(const Entry& entry, const IBox& box, std::vector<bool>& marks) const {
  const IVec3 origin = entry.at * kChunkEdge;
  const std::span<const ChunkPart> parts = entry.parts.parts();
  std::size_t undecided = 0;
  IBox rows;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const std::size_t piece = piece_of_node[entry.first_node + part];
    const IBox part_box = moved(parts[part].box(), origin);
    const IBox common = intersect(part_box, box);
    if (marks[piece] || common.empty()) continue;
    if (holds(box, part_box)) {
      marks[piece] = true;
      continue;
    }
    ++undecided;
    rows = unite(rows, moved(common, -origin));
  }
  for (int z = rows.min.z; z < rows.max.z && undecided != 0; ++z) {
    for (int y = rows.min.y; y < rows.max.y && undecided != 0; ++y) {
      const std::uint64_t row = entry.parts.row(y, z);
      for (std::uint64_t left = row & columns(rows.min.x, rows.max.x); left != 0; left = without_lowest_run(left)) {
        const std::size_t part = entry.parts.part_at(row, std::countr_zero(left), y, z);
        const std::size_t piece = piece_of_node[entry.first_node + part];
        if (marks[piece]) continue;
        marks[piece] = true;
        if (parts.size() == 1) undecided = 0;
      }
    }
  }
}

std::vector<std::size_t> ConnectedPieces::Impl::listed(const IBox& box, bool touching) const {
  std::vector<bool> marks(pieces.size());
  const IBox chunks = box.empty() ? IBox{} : IBox{chunk_of(box.min), chunk_of(box.max - 1) + 1};
  for (const Entry* entry : in_order) {
    if (chunks.contains(entry->at)) mark_touching(*entry, box, marks);
  }
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (marks[i] == touching) found.push_back(i);
  }
  return found;
}

ConnectedPieces::ConnectedPieces(ConnectedOptions options) : impl_(std::make_unique<Impl>()) {
  impl_of(impl_).options = std::move(options);
}
ConnectedPieces::ConnectedPieces(ConnectedPieces&&) noexcept = default;
ConnectedPieces& ConnectedPieces::operator=(ConnectedPieces&&) noexcept = default;
ConnectedPieces::~ConnectedPieces() = default;

void ConnectedPieces::Impl::take_data(IVec3 at, const Chunk* chunk) {
  const auto found = entries.find(at);
  if (found != entries.end() && chunk != nullptr) found->second.parts.take_data(*chunk);
}

void ConnectedPieces::update(const Grid& grid, Threads threads) {
  ChangeCursor of_data = impl_of(impl_).followed;
  // Voxels that also changed their type are handled below.
  for (const DataChange& change : grid.data_changes_since(of_data).items_unless_all()) {
    impl_of(impl_).take_data(change.chunk, grid.find_chunk(change.chunk));
  }
  PendingChanges changes(impl_of(impl_).followed, grid);
  if (changes->empty()) return;
  std::vector<IVec3> chunks;
  if (changes->all) {
    impl_of(impl_).entries.clear();
    chunks = grid.chunks();
  }
  for (const ChunkChange& change : changes->items_unless_all()) chunks.push_back(change.chunk);
  impl_of(impl_).find_parts(grid, chunks, threads);
  impl_of(impl_).find_links(chunks, threads);
  impl_of(impl_).find_open_parts(grid, chunks);
  impl_of(impl_).make_pieces();
  changes.commit();
}

std::span<const ConnectedPiece> ConnectedPieces::pieces() const {
  return impl_of(impl_).pieces;
}

std::optional<std::size_t> ConnectedPieces::piece_at(IVec3 voxel) const {
  const auto found = impl_of(impl_).entries.find(chunk_of(voxel));
  if (found == impl_of(impl_).entries.end()) return std::nullopt;
  const Entry& entry = found->second;
  const IVec3 local = local_of(voxel);
  const std::uint64_t row = entry.parts.row(local.y, local.z);
  if ((row >> local.x & 1U) == 0) return std::nullopt;
  return impl_of(impl_).piece_of_node[entry.first_node + entry.parts.part_at(row, local.x, local.y, local.z)];
}

std::vector<std::size_t> ConnectedPieces::touching(const IBox& box) const {
  return impl_of(impl_).listed(box, true);
}

std::vector<std::size_t> ConnectedPieces::not_touching(const IBox& box) const {
  std::vector<std::size_t> separate = impl_of(impl_).listed(box, false);
  std::erase_if(separate, [&](std::size_t piece) { return impl_of(impl_).pieces[piece].touches_unloaded; });
  return separate;
}

void ConnectedPieces::for_each_row(std::size_t piece, FunctionRef<void(IVec3 row, std::uint64_t voxels)> visit) const {
  impl_of(impl_).for_each_chunk(piece, [&](const Entry& entry, std::span<const std::size_t> of_piece) {
    Impl::for_each_row(entry, of_piece,
                       [&](IVec3 row, std::uint64_t voxels) { visit(entry.at * kChunkEdge + row, voxels); });
  });
}

MassProperties mass_properties(const ConnectedPieces& pieces, std::size_t piece, DensityOfType density) {
  VoxelMass sum(density);
  impl_of(pieces.impl_).for_each_chunk(piece, [&](const Entry& entry, std::span<const std::size_t> of_piece) {
    sum.begin(entry.at, entry.parts.chunk());
    if (ConnectedPieces::Impl::are_all(entry, of_piece)) return sum.add_chunk();
    ConnectedPieces::Impl::for_each_row(entry, of_piece,
                                        [&](IVec3 row, std::uint64_t voxels) { sum.add_row(row.y, row.z, voxels); });
  });
  return sum.properties();
}

Grid ConnectedPieces::extract(std::size_t piece) const {
  Grid grid;
  std::array<VoxelType, kChunkEdge> types{};
  impl_of(impl_).for_each_chunk(piece, [&](const Entry& entry, std::span<const std::size_t> of_piece) {
    if (Impl::are_all(entry, of_piece)) {
      grid.put_chunk(entry.at, entry.parts.chunk());
      return;
    }
    Impl::for_each_row(entry, of_piece, [&](IVec3 row, std::uint64_t voxels) {
      entry.parts.chunk().read_row(row.y, row.z, types);
      grid.write_row(entry.at * kChunkEdge + row, voxels, types);
    });
    entry.parts.chunk().for_each_data([&](IVec3 local, const VoxelData& data) {
      // Outside of the piece there is air, which accepts no data.
      grid.set_data(entry.at * kChunkEdge + local, data);
    });
  });
  return grid;
}

std::int64_t ConnectedPieces::remove_from(Grid& grid, std::size_t piece) const {
  static constexpr std::array<VoxelType, kChunkEdge> kAirRow{};
  std::int64_t changed = 0;
  impl_of(impl_).for_each_chunk(piece, [&](const Entry& entry, std::span<const std::size_t> of_piece) {
    const Chunk* present = grid.find_chunk(entry.at);
    if (present == nullptr) return;
    if (present->shares_storage_with(entry.parts.chunk()) && Impl::are_all(entry, of_piece)) {
      changed += grid.put_chunk(entry.at, Chunk());
      return;
    }
    Impl::for_each_row(entry, of_piece, [&](IVec3 row, std::uint64_t voxels) {
      changed += grid.write_row(entry.at * kChunkEdge + row, voxels, kAirRow);
    });
  });
  return changed;
}

std::size_t ConnectedPieces::bytes() const {
  std::size_t total = sizeof(*this) + sizeof(Impl) + impl_of(impl_).pieces.capacity() * sizeof(ConnectedPiece);
  total += (impl_of(impl_).piece_of_node.capacity() + impl_of(impl_).nodes.capacity() +
            impl_of(impl_).first_nodes.capacity()) *
               sizeof(std::size_t) +
           impl_of(impl_).in_order.capacity() * sizeof(const Entry*);
  for (const auto& [at, entry] : impl_of(impl_).entries) {
    constexpr std::size_t kMapNode = 4 * sizeof(void*);
    total += kMapNode + sizeof(std::pair<IVec3, Entry>) - sizeof(ChunkParts) + entry.parts.bytes() +
             entry.links.capacity() * sizeof(Link) + entry.open_parts.capacity() * sizeof(std::uint32_t);
  }
  return total;
}

}  // namespace quoin

#include "render/vulkan/trees/tree_packing.h"

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>

#include <quoin/core/assert.h>

#include "grid/chunk/chunk_storage.h"
#include "trace/tree_view.h"

namespace quoin::vulkan {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

// The densities of a chunk's samples, and of one before and two past these along each axis.
class FieldSamples {
 public:
  FieldSamples(const DensityGrid& field, IVec3 chunk) : halves_(std::size_t{kEdge} * kEdge * kEdge) {
    const DensityNeighbourhood around = field.neighbourhood(chunk);
    std::array<Half, kChunkEdge> row;
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        const IVec3 at{0, y - 1, z - 1};
        Half* const out =
            halves_.data() + (std::size_t{kEdge} * static_cast<std::size_t>(z) + static_cast<std::size_t>(y)) * kEdge;
        for (int dx = -1; dx <= 1; ++dx) {
          read_row(around, dx, at, row);
          const int first = dx < 0 ? kChunkEdge - 1 : 0;
          const int last = dx > 0 ? kFieldRecordReach : kChunkEdge;
          std::copy(row.begin() + first, row.begin() + last, out + (dx < 0 ? 0 : dx == 0 ? 1 : kChunkEdge + 1));
        }
      }
    }
  }

  [[nodiscard]] Half operator()(IVec3 sample) const {
    const IVec3 at = sample + 1;
    QUOIN_ASSERT((IBox{IVec3{0}, IVec3{kEdge}}.contains(at)), "a sample of the record");
    return halves_[static_cast<std::size_t>((at.z * kEdge + at.y) * kEdge + at.x)];
  }
  // Returns true if a box of samples, `max` excluded, is all solid.
  [[nodiscard]] bool is_solid(IVec3 min, IVec3 max) const {
    for (int z = min.z; z < max.z; ++z) {
      for (int y = min.y; y < max.y; ++y) {
        for (int x = min.x; x < max.x; ++x) {
          if (!DensityChunk::is_solid((*this)({x, y, z}))) return false;
        }
      }
    }
    return true;
  }

 private:
  static constexpr int kEdge = kChunkEdge + 1 + kFieldRecordReach;

  static void read_row(const DensityNeighbourhood& around, int dx, IVec3 at, std::array<Half, kChunkEdge>& row) {
    const DensityChunk* const samples = around.at(dx, at.y >> 6, at.z >> 6);
    if (samples == nullptr) {
      row.fill(around.outside);
    } else {
      samples->read_row(at.y & 63, at.z & 63, row);
    }
  }

  std::vector<Half> halves_;
};

// The bodies of a chunk's samples and of their neighbours: 0 for air, kOpaqueBody, or a transparent type.
class FieldBodies {
 public:
  FieldBodies(const DensityGlass& glass, IVec3 chunk)
      : around_(glass.field().neighbourhood(chunk)), types_(&glass.types()) {}

  [[nodiscard]] std::uint32_t operator()(IVec3 sample) const {
    const IVec3 chunk = chunk_of(sample);
    const DensityChunk* const samples = around_.at(chunk.x, chunk.y, chunk.z);
    const IVec3 at = local_of(sample);
    if (samples == nullptr || !DensityChunk::is_solid(samples->get(at.x, at.y, at.z))) return 0;
    const VoxelType material = samples->materials().get(at);
    return types_->is_transparent(material) ? material : kOpaqueBody;
  }

 private:
  DensityNeighbourhood around_;
  const VoxelRegistry* types_;
};

// Bit of a place in its node.
int place_of(IVec3 at) {
  return (at.x & 3) + 4 * (at.y & 3) + 16 * (at.z & 3);
}

}  // namespace

class RecordWriter {
 public:
  Node add_tree(const OccupancyTree& tree, IVec3 chunk) {
    const trace::TreeNodes nodes(tree);
    const trace::ChunkNode* node = nodes.find_chunk(chunk);
    Node root;
    if (node == nullptr) return root;
    while (record.words.size() % 8 != 0) record.words.push_back(0);
    headers_.push_back(record.words.size());
    record.words.resize(record.words.size() + 4);
    const std::size_t bricks = record.words.size();
    for (unsigned i = 0; i < 64; ++i) root.mask |= std::uint64_t{node->cells[i] != 0} << i;
    record.words.resize(bricks + 4 * static_cast<std::size_t>(std::popcount(root.mask)));
    std::size_t at = bricks;
    bool is_full = root.mask == kAll;
    for (std::size_t i = 0; i < 64; ++i) {
      if (node->cells[i] == 0) continue;
      is_full &= node->bricks[i] == trace::kFullBrick;
      put(at, node->cells[i]);
      if (node->bricks[i] == trace::kFullBrick) {
        put(at + 2, 1);
      } else {
        put_address(at + 2, record.words.size());
        add_words(nodes.brick(node->bricks[i]));
      }
      at += 4;
    }
    root.children = bricks * 4 + (is_full ? 1 : 0);
    return root;
  }

  Node add_field(const OccupancyTree& cells, const DensityGrid& of, IVec3 chunk) {
    const trace::TreeNodes nodes(cells);
    const trace::ChunkNode* node = nodes.find_chunk(chunk);
    if (node == nullptr) return {};
    const FieldSamples samples(of, chunk);
    const auto is_solid = [&](IVec3 brick) { return samples.is_solid(brick, brick + 17); };
    return add_cells(nodes, *node, is_solid, [&](std::size_t, std::size_t, IVec3 word) {
      return samples.is_solid(word, word + 5) ? 0U : add_block(samples, word - 1);
    });
  }

  Node add_glass(const DensityGlass& glass, IVec3 chunk) {
    const trace::TreeNodes nodes(glass.cells());
    const trace::ChunkNode* node = nodes.find_chunk(chunk);
    if (node == nullptr) return {};
    const FieldSamples samples(glass.field(), chunk);
    const FieldBodies bodies(glass, chunk);
    const trace::UniformBlocks& uniform = nodes.uniform_blocks(*node);
    const auto never = [](IVec3) { return false; };
    return add_cells(nodes, *node, never, [&](std::size_t brick, std::size_t cell, IVec3 word) {
      if ((uniform.cells[brick] >> cell & 1) != 0) return kIsUniform | bodies(word);
      const std::uint32_t place = add_block(samples, word - 1);
      add_bodies(bodies, word);
      return place;
    });
  }

  Node add_shapes(const OccupancyTree& cells, const ShapeIndex& index, IVec3 chunk,
                  FunctionRef<bool(const PlacedShape&)> with, FunctionRef<ShaderShape(const PlacedShape&)> shape_of) {
    const trace::TreeNodes nodes(cells);
    const trace::ChunkNode* node = nodes.find_chunk(chunk);
    if (node == nullptr) return {};
    ShapeIndex::Reader reader(index);
    const auto never = [](IVec3) { return false; };
    return add_cells(nodes, *node, never, [&](std::size_t, std::size_t, IVec3 word) {
      return add_lists(reader, chunk * kChunkEdge + word, with, shape_of);
    });
  }

  // `types`: see pack_chunk.
  void add_types(const Chunk& voxels, const VoxelRegistry* types = nullptr) {
    const ChunkStorage* mixed = ChunkStorage::of(voxels);
    if (types != nullptr) add_turned(voxels, *types);
    const std::size_t begin = record.words.size();
    for (const std::size_t header : headers_) {
      QUOIN_ASSERT(header + 3 < record.words.size(), "a header of the record");
      if (mixed == nullptr) {
        record.words[header + 3] = *voxels.uniform();
        if (types != nullptr) put_address(header, begin);
        continue;
      }
      put_address(header, begin);
      record.words[header + 2] = static_cast<std::uint32_t>(mixed->bits);
      record.words[header + 3] = static_cast<std::uint32_t>(256 + (mixed->palette.size() + 1) / 2);
    }
    if (mixed == nullptr) return;
    record.words.insert(record.words.end(), mixed->slabs.begin(), mixed->slabs.end());
    for (std::size_t i = 0; i < mixed->palette.size(); i += 2) {
      const std::uint32_t next = i + 1 < mixed->palette.size() ? mixed->palette[i + 1] : 0;
      record.words.push_back(mixed->palette[i] | next << 16);
    }
    mixed->words.for_each_page([this](std::span<const std::uint64_t> page) {
      for (const std::uint64_t word : page) add(word);
    });
  }

  ChunkRecord record;

 private:
  void put(std::size_t at, std::uint64_t value) {
    QUOIN_ASSERT(at + 1 < record.words.size(), "words of the record");
    record.words[at] = static_cast<std::uint32_t>(value);
    record.words[at + 1] = static_cast<std::uint32_t>(value >> 32);
  }
  void put_address(std::size_t at, std::size_t word) {
    put(at, word * 4);
    record.addresses_.push_back(at);
  }
  void add(std::uint64_t value) {
    record.words.resize(record.words.size() + 2);
    put(record.words.size() - 2, value);
  }
  // Packs a chunk's node with a number for each word of its cells, except full bricks with `is_plain(first)`.
  // `number_of(brick, cell, first)` may append to the record.
  template <class IsPlain, class NumberOf>
  Node add_cells(const trace::TreeNodes& nodes, const trace::ChunkNode& node, const IsPlain& is_plain,
                 const NumberOf& number_of) {
    Node root;
    headers_.push_back(0);
    for (unsigned i = 0; i < 64; ++i) root.mask |= std::uint64_t{node.cells[i] != 0} << i;
    const std::size_t bricks = 4;
    QUOIN_ASSERT(record.words.size() <= bricks, "the record's only tree");
    record.words.resize(bricks + 4 * static_cast<std::size_t>(std::popcount(root.mask)));
    std::size_t at = bricks;
    bool is_full = root.mask == kAll;
    for (int i = 0; i < 64; ++i) {
      const auto place = static_cast<std::size_t>(i);
      if (node.cells[place] == 0) continue;
      const IVec3 first = IVec3{i & 3, i >> 2 & 3, i >> 4} * 16;
      put(at, node.cells[place]);
      if (node.bricks[place] == trace::kFullBrick && is_plain(first)) {
        put(at + 2, 1);
      } else {
        is_full = false;
        put_address(at + 2, record.words.size());
        add_numbered(node.cells[place], nodes.brick(node.bricks[place]), first,
                     [&](std::size_t cell, IVec3 word) { return number_of(place, cell, word); });
      }
      at += 4;
    }
    root.children = bricks * 4 + (is_full ? 1 : 0);
    return root;
  }
  // The words of a brick's cells, and a number for each.
  template <class NumberOf>
  void add_numbered(std::uint64_t mask, const trace::BrickWords& words, IVec3 first, const NumberOf& number_of) {
    for (std::size_t i = 0; i < 64; ++i) {
      if ((mask >> i & 1) != 0) add(words[i]);
    }
    std::size_t place = record.words.size();
    record.words.resize(place + static_cast<std::size_t>(std::popcount(mask)));
    for (int i = 0; i < 64; ++i) {
      if ((mask >> i & 1) == 0) continue;
      const std::uint32_t number = number_of(static_cast<std::size_t>(i), first + IVec3{i & 3, i >> 2 & 3, i >> 4} * 4);
      record.words[place++] = number;
    }
    // Aligns the next entry to 8 bytes.
    if (record.words.size() % 2 != 0) record.words.push_back(0);
  }
  // Returns where it lies.
  std::uint32_t add_block(const FieldSamples& samples, IVec3 first) {
    const std::size_t begin = record.words.size();
    record.words.resize(begin + kFieldBlockWords);
    std::size_t i = 0;
    for (int z = 0; z < kFieldBlockEdge; ++z) {
      for (int y = 0; y < kFieldBlockEdge; ++y) {
        for (int x = 0; x < kFieldBlockEdge; ++x, ++i) {
          record.words[begin + i / 2] |= std::uint32_t{samples(first + IVec3{x, y, z})} << (16 * (i % 2));
        }
      }
    }
    QUOIN_ASSERT(begin < kIsUniform, "a number of 31 bits");
    return static_cast<std::uint32_t>(begin);
  }
  void add_bodies(const FieldBodies& bodies, IVec3 first) {
    const std::size_t begin = record.words.size();
    record.words.resize(begin + kGlassBlockWords);
    std::size_t i = 0;
    for (int z = 0; z < kGlassBlockEdge; ++z) {
      for (int y = 0; y < kGlassBlockEdge; ++y) {
        for (int x = 0; x < kGlassBlockEdge; ++x, ++i) {
          record.words[begin + i / 2] |= bodies(first + IVec3{x, y, z}) << (16 * (i % 2));
        }
      }
    }
  }
  void add_turned(const Chunk& voxels, const VoxelRegistry& types) {
    const std::size_t begin = record.words.size();
    voxels.for_each_data([&](IVec3 local, const VoxelData& data) {
      const VoxelType type = voxels.get(local);
      if (!types.is_turned_by_state(type)) return;
      const StateOrientations& orientations = types[type].orientations;
      const std::uint32_t turn = state_turn(orientations, data.state);
      if (turn == state_turn(orientations, 0)) return;
      const auto number = static_cast<std::uint32_t>(local.x + kChunkEdge * (local.y + kChunkEdge * local.z));
      record.words.push_back(number | turn << 18);
    });
    const auto first = record.words.begin() + static_cast<std::ptrdiff_t>(begin);
    std::sort(first, record.words.end(), [](std::uint32_t a, std::uint32_t b) { return a << 14 < b << 14; });
    record.words.push_back(static_cast<std::uint32_t>(record.words.size() - begin));
  }
  // Adds the lists of a word of 4^3 voxels. Returns where they lie.
  std::uint32_t add_lists(ShapeIndex::Reader& reader, IVec3 first, FunctionRef<bool(const PlacedShape&)> with,
                          FunctionRef<ShaderShape(const PlacedShape&)> shape_of) {
    const std::size_t begin = record.words.size();
    std::vector<std::uint32_t> starts;
    std::vector<std::uint32_t> lists;
    for (int i = 0; i < 64; ++i) {
      const IVec3 cell = first + IVec3{i & 3, i >> 2 & 3, i >> 4};
      const std::size_t start = lists.size();
      for (const PlacedShape& shape : reader.at(cell)) {
        if (!with(shape)) continue;
        const IVec3 place = shape.voxel - cell + 1;
        QUOIN_ASSERT((IBox{IVec3(0), IVec3(3)}.contains(place)), "a shape within a voxel");
        const ShaderShape made = shape_of(shape);
        lists.push_back(made.what | static_cast<std::uint32_t>(place.x + 3 * place.y + 9 * place.z) << kShapePlace);
        lists.push_back(made.model);
      }
      if (lists.size() == start) continue;
      lists[lists.size() - 2] |= kShapeIsLast;
      starts.push_back(static_cast<std::uint32_t>(start));
    }
    for (const std::uint32_t start : starts) {
      record.words.push_back(static_cast<std::uint32_t>(starts.size()) + start);
    }
    record.words.insert(record.words.end(), lists.begin(), lists.end());
    return static_cast<std::uint32_t>(begin);
  }
  void add_words(const trace::BrickWords& brick) {
    for (std::size_t i = 0; i < 64; ++i) {
      if (brick[i] != 0) add(brick[i]);
    }
  }

  std::vector<std::size_t> headers_;
};

void ChunkRecord::move_to(std::uint64_t address) {
  QUOIN_ASSERT(address % 8 == 0, "an aligned address");
  for (const std::size_t at : addresses_) {
    QUOIN_ASSERT(at + 1 < words.size(), "words of the record");
    const std::uint64_t moved = (words[at] | std::uint64_t{words[at + 1]} << 32) + address;
    words[at] = static_cast<std::uint32_t>(moved);
    words[at + 1] = static_cast<std::uint32_t>(moved >> 32);
  }
  for (Node* node : {&opaque, &transparent, &field, &glass, &shapes}) {
    if (node->mask != 0) node->children += address;
  }
}

std::uint32_t state_turn(const StateOrientations& orientations, std::uint32_t state) {
  return turn_bits(orientations.of(state).inverse());
}

std::uint32_t turn_bits(const AxisOrientation& orientation) {
  std::uint32_t turn = 0;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    IVec3 along(0);
    along[static_cast<int>(axis)] = 1;
    const IVec3 turned = orientation.apply(along);
    for (int i = 0; i < 3; ++i) {
      if (turned[i] != 0) turn |= (axis | (turned[i] < 0 ? 4U : 0U)) << (3 * i);
    }
  }
  return turn;
}

ChunkRecord pack_chunk(const OccupancyTree& opaque, const OccupancyTree* transparent, const Chunk& voxels, IVec3 chunk,
                       const VoxelRegistry* types) {
  RecordWriter writer;
  writer.record.opaque = writer.add_tree(opaque, chunk);
  if (transparent != nullptr) writer.record.transparent = writer.add_tree(*transparent, chunk);
  writer.add_types(voxels, types);
  return std::move(writer.record);
}

ChunkRecord pack_field_chunk(const OccupancyTree& cells, const DensityGrid& field, IVec3 chunk) {
  static const Chunk none;
  RecordWriter writer;
  writer.record.field = writer.add_field(cells, field, chunk);
  const DensityChunk* const samples = field.find_chunk(chunk);
  writer.add_types(samples == nullptr ? none : samples->materials());
  return std::move(writer.record);
}

ChunkRecord pack_glass_chunk(const DensityGlass& glass, IVec3 chunk) {
  static const Chunk none;
  RecordWriter writer;
  writer.record.glass = writer.add_glass(glass, chunk);
  writer.add_types(none);
  return std::move(writer.record);
}

ChunkRecord pack_shapes_chunk(const OccupancyTree& cells, const ShapeIndex& index, IVec3 chunk,
                              FunctionRef<bool(const PlacedShape&)> with,
                              FunctionRef<ShaderShape(const PlacedShape&)> shape_of) {
  static const Chunk none;
  RecordWriter writer;
  writer.record.shapes = writer.add_shapes(cells, index, chunk, with, shape_of);
  writer.add_types(none);
  return std::move(writer.record);
}

TopTree build_top_tree(std::vector<ChunkNodeAt> level, std::uint64_t address) {
  TopTree tree;
  if (level.empty()) return tree;
  while (level.size() > 1 || level.front().chunk != IVec3(0)) {
    const auto key = [](const ChunkNodeAt& n) {
      const IVec3 parent = n.chunk >> 2;
      return std::tuple(parent.z, parent.y, parent.x, place_of(n.chunk));
    };
    std::sort(level.begin(), level.end(), [&](const ChunkNodeAt& a, const ChunkNodeAt& b) { return key(a) < key(b); });
    std::vector<ChunkNodeAt> parents;
    for (const ChunkNodeAt& child : level) {
      QUOIN_ASSERT((child.chunk.x | child.chunk.y | child.chunk.z) >= 0, "chunks from the tree's origin");
      const IVec3 parent = child.chunk >> 2;
      if (parents.empty() || parents.back().chunk != parent) {
        parents.push_back({parent, {0, address + tree.nodes.size() * sizeof(Node)}});
      }
      parents.back().node.mask |= std::uint64_t{1} << place_of(child.chunk);
      tree.nodes.push_back(child.node);
    }
    level = std::move(parents);
    ++tree.root_level;
  }
  tree.root = level.front().node;
  return tree;
}

}  // namespace quoin::vulkan

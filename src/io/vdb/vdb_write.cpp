// Writes files that vdb_file.cpp reads, with zip and active values only. Densities become a level set with the band of
// the field; voxels become true.

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "io/vdb/vdb.h"

namespace quoin::vdb {

namespace {

constexpr std::uint32_t kVersion = 224;
constexpr std::uint32_t kZipOfActive = 3;
constexpr int kLeavesOfChunk = kChunkEdge / kLeafEdge;

class Writer {
 public:
  std::vector<std::byte> bytes;

  template <class T>
  void number(T value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof(T));
    put_number(bytes.data() + at, value, std::endian::little);
  }
  void text(std::string_view value) {
    const auto* const begin = reinterpret_cast<const std::byte*>(value.data());
    bytes.insert(bytes.end(), begin, begin + value.size());
  }
  void string(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    text(value);
  }
  void words(std::span<const std::uint64_t> values) {
    for (const std::uint64_t value : values) number(value);
  }
  void place(IVec3 value) {
    for (int axis = 0; axis < 3; ++axis) number(value[axis]);
  }
  void vector(const DVec3& value) {
    for (int axis = 0; axis < 3; ++axis) number(value[axis]);
  }
  /// Writes the current offset at `at`.
  void mark(std::size_t at) {
    QUOIN_ASSERT(at + sizeof(std::uint64_t) <= bytes.size(), "eight bytes that were written");
    put_number(bytes.data() + at, static_cast<std::uint64_t>(bytes.size()), std::endian::little);
  }

  /// Writes zlib data, or the content itself if that is not longer.
  void zipped(std::span<const std::byte> content) {
    uLongf size = compressBound(static_cast<uLong>(content.size()));
    packed_.resize(size);
    const int code =
        compress2(reinterpret_cast<Bytef*>(packed_.data()), &size, reinterpret_cast<const Bytef*>(content.data()),
                  static_cast<uLong>(content.size()), Z_DEFAULT_COMPRESSION);
    if (code == Z_MEM_ERROR) throw std::bad_alloc();
    const bool is_shorter = code == Z_OK && size < content.size();
    const std::span<const std::byte> chosen = is_shorter ? std::span<const std::byte>(packed_).first(size) : content;
    number(is_shorter ? static_cast<std::int64_t>(size) : -static_cast<std::int64_t>(content.size()));
    bytes.insert(bytes.end(), chosen.begin(), chosen.end());
  }

 private:
  std::vector<std::byte> packed_;
};

/// A node of 16^3 entries, x slowest.
struct Lower {
  std::array<std::uint64_t, 64> inside{};  // entries without a leaf that are solid
  std::map<int, LeafMask> leaves;          // active voxels by entry
};
using Place = std::tuple<int, int, int>;
using Upper = std::map<int, Lower>;
using Tree = std::map<Place, Upper>;

void set_bit(std::span<std::uint64_t> bits, int i) {
  QUOIN_ASSERT(i >= 0 && static_cast<std::size_t>(i) >> 6 < bits.size(), "a bit of the mask");
  bits[static_cast<std::size_t>(i) >> 6] |= std::uint64_t{1} << (i & 63);
}

/// Adds an 8^3 block of a chunk to its nodes.
void add_block(Tree& tree, IVec3 origin, bool is_inside, const LeafMask* leaf) {
  const IVec3 upper = origin >> 12;  // rounded down
  static_assert(kUpperEdge == 1 << 12);
  const IVec3 in_upper = origin - upper * kUpperEdge;
  const IVec3 lower = in_upper / kLowerEdge;
  const IVec3 in_lower = (in_upper - lower * kLowerEdge) / kLeafEdge;
  Lower& node = tree[{upper.x, upper.y, upper.z}][lower.x << 10 | lower.y << 5 | lower.z];
  const int place = in_lower.x << 8 | in_lower.y << 4 | in_lower.z;
  if (leaf != nullptr) node.leaves.emplace(place, *leaf);
  if (leaf == nullptr && is_inside) set_bit(node.inside, place);
}

template <class Visit>
void for_blocks(IVec3 chunk, Visit visit) {
  for (int i = 0; i < kLeavesOfChunk * kLeavesOfChunk * kLeavesOfChunk; ++i) {
    const IVec3 local = IVec3{i & 7, i >> 3 & 7, i >> 6} * kLeafEdge;
    visit(chunk * kChunkEdge + local, local);
  }
}

/// The densities of a chunk, x fastest.
using Dense = std::vector<Half>;

Dense dense_of(const DensityChunk& chunk) {
  Dense dense(kChunkVoxels);
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::size_t row = static_cast<std::size_t>(z * kChunkEdge + y) * kChunkEdge;
      chunk.read_row(y, z, std::span<Half, kChunkEdge>(dense.data() + row, kChunkEdge));
    }
  }
  return dense;
}

std::size_t place_in_chunk(IVec3 local) {
  QUOIN_ASSERT(((local.x | local.y | local.z) & ~(kChunkEdge - 1)) == 0, "a voxel of the chunk");
  return static_cast<std::size_t>((local.z * kChunkEdge + local.y) * kChunkEdge + local.x);
}

template <class Visit>
void for_voxels(IVec3 corner, Visit visit) {
  for (int x = 0; x < kLeafEdge; ++x) {
    for (int y = 0; y < kLeafEdge; ++y) {
      for (int z = 0; z < kLeafEdge; ++z) visit(corner + IVec3{x, y, z}, place_in_leaf(x, y, z));
    }
  }
}

Tree tree_of(const DensityGrid& field) {
  Tree tree;
  const Half outside = stored_density(field.band(), field.band());
  const Half inside = stored_density(-field.band(), field.band());
  for (const IVec3 place : field.chunks()) {
    const DensityChunk& chunk = *field.find_chunk(place);
    if (const auto uniform = chunk.uniform(); uniform && (*uniform == outside || *uniform == inside)) {
      for_blocks(place, [&](IVec3 origin, IVec3) { add_block(tree, origin, *uniform == inside, nullptr); });
      continue;
    }
    const Dense dense = dense_of(chunk);
    for_blocks(place, [&](IVec3 origin, IVec3 local) {
      LeafMask active{};
      bool is_mixed = false;
      const Half first = dense[place_in_chunk(local)];
      for_voxels(local, [&](IVec3 at, std::size_t i) {
        const Half value = dense[place_in_chunk(at)];
        is_mixed |= value != first;
        if (value != outside && value != inside) active[i >> 6] |= std::uint64_t{1} << (i & 63U);
      });
      const bool is_leaf = is_mixed || (first != outside && first != inside);
      add_block(tree, origin, first == inside, is_leaf ? &active : nullptr);
    });
  }
  return tree;
}

Tree tree_of(const quoin::Grid& voxels) {
  Tree tree;
  std::vector<VoxelType> dense(kChunkVoxels);
  for (const IVec3 place : voxels.chunks()) {
    const Chunk& chunk = *voxels.find_chunk(place);
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        const std::size_t row = static_cast<std::size_t>(z * kChunkEdge + y) * kChunkEdge;
        chunk.read_row(y, z, std::span<VoxelType, kChunkEdge>(dense.data() + row, kChunkEdge));
      }
    }
    for_blocks(place, [&](IVec3 origin, IVec3 local) {
      LeafMask there{};
      for_voxels(local, [&](IVec3 at, std::size_t i) {
        if (dense[place_in_chunk(at)] != kAir) there[i >> 6] |= std::uint64_t{1} << (i & 63U);
      });
      const auto is = [&](std::uint64_t word) { return std::ranges::all_of(there, [&](auto w) { return w == word; }); };
      const bool is_full = is(~std::uint64_t{0});
      if (is_full || is(0)) {
        if (is_full) add_block(tree, origin, true, nullptr);
      } else {
        add_block(tree, origin, false, &there);
      }
    });
  }
  return tree;
}

/// Writes trees of `field`, or of voxels if it is null.
class TreeWriter {
 public:
  TreeWriter(Writer& out, const DensityGrid* field, double voxel_size) : out_(out), field_(field) {
    if (field != nullptr) scale_ = static_cast<float>(voxel_size);
  }

  void topology(const Tree& tree) {
    out_.number(std::uint32_t{1});
    value(background());
    out_.number(std::uint32_t{0});
    out_.number(static_cast<std::uint32_t>(tree.size()));
    for (const auto& [place, upper] : tree) {
      const auto [x, y, z] = place;
      out_.place(IVec3{x, y, z} * kUpperEdge);
      std::array<std::uint64_t, 512> children{};
      for (const auto& [i, lower] : upper) set_bit(children, i);
      out_.words(children);
      out_.words(std::array<std::uint64_t, 512>{});
      out_.number(std::uint8_t{0});  // all other entries are background
      out_.zipped({});
      for (const auto& [i, lower] : upper) write_lower(lower);
    }
  }

  void buffers(const Tree& tree) {
    for (const auto& [place, upper] : tree) {
      const auto [x, y, z] = place;
      for (const auto& [i, lower] : upper) {
        const IVec3 corner = IVec3{x, y, z} * kUpperEdge + IVec3{i >> 10, i >> 5 & 31, i & 31} * kLowerEdge;
        std::map<Place, Dense> chunks;  // chunks of this node
        for (const auto& [leaf, mask] : lower.leaves) {
          const IVec3 origin = corner + IVec3{leaf >> 8, leaf >> 4 & 15, leaf & 15} * kLeafEdge;
          out_.words(mask);
          if (field_ == nullptr) {
            out_.place(origin);
            out_.words(mask);
            continue;
          }
          const IVec3 chunk = chunk_of(origin);
          Dense& dense = chunks[{chunk.x, chunk.y, chunk.z}];
          if (dense.empty()) dense = dense_of(*field_->find_chunk(chunk));
          write_leaf(dense, local_of(origin), mask);
        }
      }
    }
  }

 private:
  [[nodiscard]] float background() const { return field_ != nullptr ? field_->band() * scale_ : 0.0F; }
  void value(float value) {
    if (field_ != nullptr) {
      out_.number(value);
    } else {
      out_.number(static_cast<std::uint8_t>(value != 0.0F));
    }
  }

  void write_lower(const Lower& lower) {
    std::array<std::uint64_t, 64> children{};
    for (const auto& [i, mask] : lower.leaves) set_bit(children, i);
    out_.words(children);
    if (field_ == nullptr) {
      // Inside voxels are active and true.
      out_.words(lower.inside);
      out_.number(std::uint8_t{0});
      std::size_t count = 0;
      for (const std::uint64_t word : lower.inside) count += static_cast<std::size_t>(std::popcount(word));
      out_.zipped(std::vector<std::byte>(count, std::byte{1}));
    } else {
      // No voxel is active; set bits select the background, clear bits its negative.
      out_.words(std::array<std::uint64_t, 64>{});
      out_.number(std::uint8_t{3});
      std::array<std::uint64_t, 64> outside{};
      for (std::size_t i = 0; i < outside.size(); ++i) outside[i] = ~lower.inside[i];
      out_.words(outside);
      out_.zipped({});
    }
    for (const auto& [i, mask] : lower.leaves) out_.words(mask);
  }

  void write_leaf(const Dense& dense, IVec3 local, const LeafMask& active) {
    QUOIN_ASSERT(dense.size() == kChunkVoxels, "the densities of a chunk");
    LeafMask outside{};
    std::vector<std::byte> values;
    for_voxels(local, [&](IVec3 at, std::size_t i) {
      const Half value = dense[place_in_chunk(at)];
      if ((active[i >> 6] >> (i & 63U) & 1U) == 0) {
        if (!DensityChunk::is_solid(value)) outside[i >> 6] |= std::uint64_t{1} << (i & 63U);
        return;
      }
      const std::size_t end = values.size();
      values.resize(end + sizeof(float));
      put_number(values.data() + end, float_from_half(value) * scale_, std::endian::little);
    });
    out_.number(std::uint8_t{3});
    out_.words(outside);
    out_.zipped(values);
  }

  Writer& out_;
  const DensityGrid* field_;
  float scale_ = 1.0F;
};

/// A grid of the file: the densities of an instance, or its voxels.
struct Wanted {
  const Instance* instance = nullptr;
  const SceneGrid* grid = nullptr;
  bool is_field = false;
};

class SceneWriter {
 public:
  explicit SceneWriter(const Scene& scene) {
    for (const InstanceHandle handle : scene.instances().handles()) {
      const Instance& instance = scene.instances()[handle];
      const SceneGrid* const grid = scene.grids().find(instance.grid);
      if (grid == nullptr || !has_valid_transform(instance)) continue;
      if (grid->field.chunk_count() > 0) wanted_.push_back({&instance, grid, true});
      if (grid->grid.chunk_count() > 0) wanted_.push_back({&instance, grid, false});
    }
  }

  std::vector<std::byte> write() {
    out_.text({" BDV\0\0\0\0", 8});
    out_.number(kVersion);
    out_.number(std::uint32_t{10});  // the library version of that file version
    out_.number(std::uint32_t{0});
    out_.number(std::uint8_t{1});
    out_.text("00000000-0000-0000-0000-000000000000");
    out_.number(std::uint32_t{1});
    metadata("creator", "Quoin");
    out_.number(static_cast<std::uint32_t>(wanted_.size()));
    for (const Wanted& each : wanted_) write_grid(each);
    return std::move(out_.bytes);
  }

 private:
  void metadata(std::string_view name, std::string_view value) {
    out_.string(name);
    out_.string("string");
    out_.string(value);
  }

  /// Returns a unique name: duplicates get a number.
  std::string unique(const std::string& name) {
    const int count = names_[name]++;
    return count == 0 ? name : name + '\x1e' + std::to_string(count);
  }

  void write_grid(const Wanted& wanted) {
    const std::string& shown = wanted.instance->name.empty() ? wanted.grid->name : wanted.instance->name;
    const std::string name = unique(shown);
    // Densities are in world units, so only instances of equal voxel size share a tree.
    const auto key = std::tuple(wanted.grid, wanted.is_field ? wanted.instance->voxel_size : 0.0);
    const auto known = trees_.find(key);
    out_.string(name);
    out_.string(wanted.is_field ? "Tree_float_5_4_3" : "Tree_bool_5_4_3");
    out_.string(known != trees_.end() ? known->second : std::string());
    const std::size_t offsets = out_.bytes.size();
    for (int i = 0; i < 3; ++i) out_.number(std::uint64_t{0});
    out_.mark(offsets);
    out_.number(kZipOfActive);
    out_.number(std::uint32_t{2});
    metadata("class", wanted.is_field ? "level set" : "unknown");
    metadata("name", shown);
    write_transform(wanted);
    if (known != trees_.end()) {
      out_.mark(offsets + 8);
      out_.mark(offsets + 16);
      return;
    }
    trees_.emplace(key, name);
    const Tree tree = wanted.is_field ? tree_of(wanted.grid->field) : tree_of(wanted.grid->grid);
    TreeWriter writer(out_, wanted.is_field ? &wanted.grid->field : nullptr, wanted.instance->voxel_size);
    writer.topology(tree);
    out_.mark(offsets + 8);
    writer.buffers(tree);
    out_.mark(offsets + 16);
  }

  void write_transform(const Wanted& wanted) {
    glm::dmat4 matrix = world_from_grid(*wanted.instance, *wanted.grid);
    // Voxels are centred at their indices; samples are at them.
    if (!wanted.is_field) matrix[3] = matrix * glm::dvec4(0.5, 0.5, 0.5, 1.0);
    const double size = wanted.instance->voxel_size;
    const bool is_upright = glm::dmat3(matrix) == glm::dmat3(size);
    if (is_upright) {
      out_.string("UniformScaleTranslateMap");
      out_.vector(DVec3(matrix[3]));
      out_.vector(DVec3(size));
      out_.vector(DVec3(size));
      out_.vector(DVec3(1.0 / size));
      out_.vector(DVec3(1.0 / (size * size)));
      out_.vector(DVec3(0.5 / size));
      return;
    }
    out_.string("AffineMap");
    for (int column = 0; column < 4; ++column) {
      for (int row = 0; row < 4; ++row) out_.number(matrix[column][row]);
    }
  }

  Writer out_;
  std::vector<Wanted> wanted_;
  std::map<std::string, int> names_;
  std::map<std::tuple<const SceneGrid*, double>, std::string> trees_;  // names of written trees, by content
};

}  // namespace

Result<std::vector<std::byte>> write_vdb(const Scene& scene) {
  return SceneWriter(scene).write();
}

std::vector<std::string> vdb_unsupported_features(const Scene& scene) {
  std::vector<std::string> lines;
  std::int64_t with_data = 0;
  for (const GridHandle handle : scene.grids().handles()) with_data += scene.grids()[handle].grid.data_count();
  if (scene.types.size() > 1) {
    lines.emplace_back("left out: voxel types (.vdb stores only where voxels and densities are)");
  }
  if (with_data > 0) {
    lines.push_back("data of voxels left out, not supported by .vdb: " + std::to_string(with_data));
  }
  std::int64_t without_place = 0;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    if (scene.grids().find(instance.grid) != nullptr && !has_valid_transform(instance)) ++without_place;
  });
  if (without_place > 0) {
    lines.push_back("instances without a valid placement left out, not supported by .vdb: " +
                    std::to_string(without_place));
  }
  if (!scene.groups().handles().empty() || !scene.layers().handles().empty()) {
    lines.emplace_back("left out: groups and layers");
  }
  const auto is_hidden = [&](InstanceHandle handle) { return !is_shown(scene, scene.instances()[handle]); };
  if (std::ranges::any_of(scene.instances().handles(), is_hidden)) {
    lines.emplace_back("hidden instances become visible: .vdb cannot store visibility");
  }
  return lines;
}

}  // namespace quoin::vdb

// A file has segments: u64 "NanoVDB0", u32 version, u16 grids, u16 codec; then 176 bytes and the name for each grid;
// then the bytes of each grid, uncompressed, or as u64 size and a zlib stream or Blosc frames. A grid's bytes:
//
//   at     0  u64 "NanoVDB0"; 384: 9 doubles, the rows of a matrix; 528: its translation; 632: u32 class; 636: u32 type
//        672  the tree: 4 u64; the last is the offset of its root
//   root       u32 tiles at 24, then the background; tiles of 32 bytes: u64 position, i64 child, u32 active, value
//   nodes      active mask at 32, child mask, entries of 8 bytes (a value or an i64 child) aligned to 32 bytes
//   leaves     mask of active voxels at 16, values
// Child offsets are relative to their parent.

#include "io/vdb/vdb.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/byte_stream.h"

namespace quoin::vdb {

namespace {

constexpr std::string_view kMagic = "NanoVDB0";
constexpr std::uint32_t kMajor = 32;
constexpr std::size_t kHeader = 16;
constexpr std::size_t kMetadata = 176;
constexpr std::size_t kGridBytes = 672;
constexpr std::uint64_t kMaxGrid = std::uint64_t{1} << 31;

enum class Type : std::uint32_t { Float = 1, Double = 2, Mask = 8, Bool = 11 };

/// The layout of a node's bytes.
struct NodeShape {
  std::size_t places;  // 32^3 or 16^3
  std::size_t table;   // offset of the table of entries
  std::size_t bytes;
  int bits;  // position bits per axis
  int edge;  // edge of an entry, in voxels
};
constexpr NodeShape kUpper{32'768, 8'256, 8'256 + 8 * 32'768, 5, kLowerEdge};
constexpr NodeShape kLower{4'096, 1'088, 1'088 + 8 * 4'096, 4, kLeafEdge};

/// Reads the tree of one grid from untrusted bytes.
class GridReader {
 public:
  GridReader(std::span<const std::byte> bytes, Type type, Grid& grid)
      : bytes_(bytes),
        type_(type),
        grid_(grid),
        most_leaves_(bytes.size() / leaf_bytes()),
        most_lower_(bytes.size() / kLower.bytes),
        most_upper_(bytes.size() / kUpper.bytes) {}

  Status read() {
    const std::uint64_t root_of_tree = load_at<std::uint64_t>(kGridBytes + 24);
    if (root_of_tree > bytes_.size()) return bad_at(kGridBytes + 24, "the root node extends past the grid");
    const std::size_t root = kGridBytes + root_of_tree;
    const bool is_double = type_ == Type::Double;
    const std::size_t root_bytes = is_double ? 96 : 64;
    if (!has(root, root_bytes)) return bad_at(kGridBytes + 24, "the root node extends past the grid");
    const std::size_t tiles = load_at<std::uint32_t>(root + 24);
    constexpr std::size_t kTile = 32;
    if (tiles > (bytes_.size() - root - root_bytes) / kTile)
      return bad_at(root + 24, "more tiles than the grid can hold");
    grid_.background = value_at(root + (is_double ? 32 : 28));
    for (std::size_t i = 0; i < tiles; ++i) {
      const std::size_t tile = root + root_bytes + i * kTile;
      const auto origin = origin_at(tile);
      if (!origin) return bad_at(tile, "a node position is invalid");
      const auto child = load_at<std::int64_t>(tile + 8);
      if (child == 0) {
        add_tile(*origin, kUpperEdge, value_at(tile + (is_double ? 24 : 20)), load_at<std::uint32_t>(tile + 16) != 0);
      } else if (auto done = read_node(kUpper, place_of(root, child), *origin, tile); !done) {
        return done;
      }
    }
    return {};
  }

 private:
  [[nodiscard]] bool is_truth() const { return type_ == Type::Mask || type_ == Type::Bool; }
  [[nodiscard]] std::size_t leaf_bytes() const {
    constexpr std::size_t kMask = 96;
    switch (type_) {
      case Type::Float:
        return 96 + 4 * kLeafVoxels;
      case Type::Double:
        return 128 + 8 * kLeafVoxels;
      case Type::Bool:
        return 160;
      case Type::Mask:
        break;
    }
    return kMask;
  }
  [[nodiscard]] bool has(std::size_t at, std::size_t count) const {
    return at <= bytes_.size() && count <= bytes_.size() - at;
  }
  template <class T>
  [[nodiscard]] T load_at(std::size_t at) const {
    QUOIN_ASSERT(has(at, sizeof(T)), "bytes of the grid");
    return load<T>(bytes_.data() + at, std::endian::little);
  }
  [[nodiscard]] float value_at(std::size_t at) const {
    if (type_ == Type::Float) return load_at<float>(at);
    if (type_ == Type::Double) return static_cast<float>(load_at<double>(at));
    QUOIN_ASSERT(has(at, 1), "a byte of the grid");
    return bytes_[at] != std::byte{0} ? 1.0F : 0.0F;
  }
  /// Returns the position of a child; past the end of the grid if the offset is invalid.
  [[nodiscard]] std::size_t place_of(std::size_t parent, std::int64_t distance) const {
    const auto place = static_cast<std::int64_t>(parent) + distance % (std::int64_t{1} << 40);
    return place < 0 ? bytes_.size() + 1 : static_cast<std::size_t>(place);
  }
  [[nodiscard]] std::optional<IVec3> origin_at(std::size_t at) const {
    const auto key = load_at<std::uint64_t>(at);
    const auto part = [&](int shift) {
      return static_cast<std::int32_t>(static_cast<std::uint32_t>(key >> shift & 0x1FFFFFU) << 12);
    };
    const IVec3 origin{part(42), part(21), part(0)};
    constexpr std::int32_t kMaxCoordinate = 1 << 30;
    for (int axis = 0; axis < 3; ++axis) {
      if (origin[axis] < -kMaxCoordinate || origin[axis] >= kMaxCoordinate) return std::nullopt;
    }
    return origin;
  }
  void add_tile(IVec3 origin, int edge, float value, bool is_active) {
    if (type_ == Type::Mask) value = is_active ? 1.0F : 0.0F;
    if (!is_active && value == grid_.background) return;
    grid_.tiles.push_back({origin, edge, value, is_active});
  }
  [[nodiscard]] LeafMask mask_at(std::size_t at) const {
    LeafMask mask{};
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = load_at<std::uint64_t>(at + 8 * i);
    return mask;
  }

  /// `said_at`: the position of the node's offset.
  Status read_node(const NodeShape& shape, std::size_t node, IVec3 origin, std::size_t said_at) {
    std::size_t& left = &shape == &kUpper ? most_upper_ : most_lower_;
    if (!has(node, shape.bytes) || left == 0) return bad_at(said_at, "a node offset is out of bounds");
    --left;
    const auto bit = [&](std::size_t mask, std::size_t i) {
      return (std::to_integer<unsigned>(bytes_[mask + (i >> 3)]) >> (i & 7U) & 1U) != 0;
    };
    const std::size_t active = node + 32;
    const std::size_t children = active + shape.places / 8;
    QUOIN_ASSERT(shape.places == std::size_t{1} << 3 * shape.bits, "2^bits entries along each axis");
    for (std::size_t i = 0; i < shape.places; ++i) {
      const auto at = static_cast<int>(i);
      const int low = (1 << shape.bits) - 1;
      const IVec3 place = origin + IVec3{at >> (2 * shape.bits), at >> shape.bits & low, at & low} * shape.edge;
      const std::size_t entry = node + shape.table + 8 * i;
      if (!bit(children, i)) {
        add_tile(place, shape.edge, value_at(entry), bit(active, i));
        continue;
      }
      const std::size_t child = place_of(node, load_at<std::int64_t>(entry));
      Status done = &shape == &kUpper ? read_node(kLower, child, place, entry) : read_leaf(child, place, entry);
      if (!done) return done;
    }
    return {};
  }

  Status read_leaf(std::size_t leaf, IVec3 origin, std::size_t said_at) {
    if (!has(leaf, leaf_bytes()) || grid_.leaves.size() >= most_leaves_) {
      return bad_at(said_at, "a leaf offset is out of bounds");
    }
    Leaf read{origin, mask_at(leaf + 16)};
    if (type_ == Type::Bool) {
      const LeafMask is_true = mask_at(leaf + 80);
      for (std::size_t i = 0; i < is_true.size(); ++i) read.active[i] &= is_true[i];
    }
    grid_.leaves.push_back(read);
    if (is_truth()) return {};
    const bool is_double = type_ == Type::Double;
    for (std::size_t i = 0; i < kLeafVoxels; ++i) {
      grid_.values.push_back(value_at(leaf + (is_double ? 128 + 8 * i : 96 + 4 * i)));
    }
    return {};
  }

  std::span<const std::byte> bytes_;
  Type type_;
  Grid& grid_;
  // Upper limits; more nodes would share bytes.
  std::size_t most_leaves_;
  std::size_t most_lower_;
  std::size_t most_upper_;
};

/// A grid's entry in a segment.
struct Entry {
  std::uint64_t bytes = 0;
  std::uint64_t stored = 0;
  std::string name;
};

Result<std::vector<std::byte>> expand(std::span<const std::byte> stored, unsigned codec, std::uint64_t bytes,
                                      std::size_t at) {
  ByteReader reader(stored);
  if (codec == 0) {
    if (stored.size() != bytes) return bad_at(at, "the stored size of a grid differs from its size");
    return std::vector<std::byte>(stored.begin(), stored.end());
  }
  constexpr std::uint64_t kMostOfAByte = 1032;
  if (bytes / kMostOfAByte > stored.size()) return bad_at(at, "a grid claims more bytes than it can expand to");
  std::vector<std::byte> out(bytes);
  for (std::size_t done = 0; done < out.size();) {
    const std::uint64_t size = reader.u32() | std::uint64_t{reader.u32()} << 32;
    const std::size_t place = at + reader.position();
    const auto packed = reader.take(size);
    if (reader.failed()) return bad_at(place, "a grid is cut off");
    if (codec == 1) {
      ByteStream stream(packed, 0, Compression::Zlib);
      const auto count = stream.read(out);
      if (!count || *count != out.size()) return bad_at(place, "a zlib stream is damaged");
      return out;
    }
    constexpr std::size_t kMostOfAFrame = std::size_t{1} << 30;
    const auto part = std::span(out).subspan(done, std::min(out.size() - done, kMostOfAFrame));
    if (auto expanded = expand_blosc(packed, part); !expanded) {
      return make_error(expanded.error().code, expanded.error().message, {},
                        place + expanded.error().byte_offset.value_or(0));
    }
    done += part.size();
  }
  return out;
}

std::optional<Type> type_of(std::uint32_t number) {
  for (const Type type : {Type::Float, Type::Double, Type::Mask, Type::Bool}) {
    if (number == static_cast<std::uint32_t>(type)) return type;
  }
  return std::nullopt;
}

Status read_grid(std::span<const std::byte> bytes, const Entry& entry, File& file) {
  if (bytes.size() < kGridBytes + 64 || !is_nvdb(bytes)) return bad_at(0, "not the start of a NanoVDB grid");
  const auto number = [&](std::size_t at) { return load<std::uint32_t>(bytes.data() + at, std::endian::little); };
  Grid grid;
  grid.name = printable(std::string_view(entry.name).substr(0, entry.name.find('\0')));
  const auto type = type_of(number(636));
  if (!type) {
    file.warnings.push_back("left out: the grid \"" + grid.name + "\", of NanoVDB type " + std::to_string(number(636)));
    return {};
  }
  constexpr std::uint32_t kLevelSet = 1;
  grid.meaning = *type == Type::Mask || *type == Type::Bool ? Meaning::Mask
                 : number(632) == kLevelSet                 ? Meaning::LevelSet
                                                            : Meaning::Fog;
  const auto real = [&](std::size_t at) { return load<double>(bytes.data() + at, std::endian::little); };
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      grid.world_from_index[column][row] = real(384 + 8 * static_cast<std::size_t>(3 * row + column));
    }
    grid.world_from_index[3][row] = real(528 + 8 * static_cast<std::size_t>(row));
  }
  if (auto done = GridReader(bytes, *type, grid).read(); !done) return done;
  file.grids.push_back(std::move(grid));
  return {};
}

}  // namespace

bool is_nvdb(std::span<const std::byte> beginning) {
  return text_of(beginning).starts_with(kMagic);
}

Result<File> read_nvdb_file(std::span<const std::byte> bytes) {
  File file;
  for (std::size_t segment = 0; segment < bytes.size();) {
    ByteReader reader(bytes, segment, bytes.size());
    if (!is_nvdb(bytes.subspan(segment)) || reader.remaining() < kHeader) {
      return bad_at(segment, "not the start of a NanoVDB segment");
    }
    static_cast<void>(reader.take(kMagic.size()));
    const std::uint32_t version = reader.u32() >> 21;
    if (version != kMajor) {
      return make_error(ErrorCode::Unsupported,
                        ".nvdb version " + std::to_string(version) + " is not supported (32 is)", {}, segment + 8);
    }
    const std::size_t count = reader.u16();
    const unsigned codec = reader.u16();
    if (codec > 2) return bad_at(segment + 14, "unknown compression method");
    std::vector<Entry> entries;
    for (std::size_t i = 0; i < count; ++i) {
      ByteReader metadata(bytes, reader.position(), bytes.size());
      Entry entry;
      entry.bytes = metadata.u32() | std::uint64_t{metadata.u32()} << 32;
      entry.stored = metadata.u32() | std::uint64_t{metadata.u32()} << 32;
      static_cast<void>(metadata.take(120));
      const std::size_t name = metadata.u32();
      static_cast<void>(reader.take(kMetadata));
      entry.name = reader.text(name);
      if (reader.failed()) return bad_at(reader.position(), "the file ends before its grids");
      entries.push_back(std::move(entry));
    }
    for (const Entry& entry : entries) {
      const std::size_t at = reader.position();
      const auto stored = reader.take(entry.stored);
      if (reader.failed()) return bad_at(at, "a grid extends past the end of the file");
      if (entry.bytes > kMaxGrid) return make_error(ErrorCode::LimitExceeded, "a grid has more than 2 GiB", {}, at);
      const auto grid = expand(stored, codec, entry.bytes, at);
      if (!grid) return grid.error();
      auto read = read_grid(*grid, entry, file);
      if (!read) {
        // Offsets refer to the decompressed grid.
        const std::uint64_t inside = read.error().byte_offset.value_or(0);
        const std::string within = codec == 0 ? "" : " (byte " + std::to_string(inside) + " of the expanded data)";
        return make_error(read.error().code, read.error().message + within, {}, codec == 0 ? at + inside : at);
      }
    }
    segment = reader.position();
  }
  return file;
}

}  // namespace quoin::vdb

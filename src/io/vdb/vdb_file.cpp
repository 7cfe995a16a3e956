#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/half.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/byte_stream.h"
#include "io/vdb/vdb.h"

#ifdef QUOIN_HAVE_LZ4
#include <lz4.h>
#endif

// A file, all numbers little-endian (strings: u32 size, bytes):
//
//   i64 "VDB ", u32 version, u32 major, u32 minor, u8 has offsets, 36 bytes of an id, metadata, u32 grids
//   each grid has a descriptor: string name, string type, string name of the grid whose tree it shares; i64 offsets of
//   its start, of its buffers, and of its end
//   at its start: u32 compression, metadata, string kind of map, its doubles
//          i32 1, background, u32 tiles, u32 nodes; tiles: 3 i32, value, u8 active; nodes: 3 i32, then as below
//          a node: child mask, active mask, values of all entries; children
//          leaves: mask of active voxels
//   buffers: for each leaf: mask of active voxels, values
//   values: u8 code, up to two inactive values, bits that choose between them; then the active values only, or all
//   values, uncompressed, or as i64 size and a zlib stream or Blosc frame (a negative size: uncompressed)

namespace quoin::vdb {
namespace {

constexpr std::string_view kVdbMagic{" BDV\0\0\0\0", 8};
constexpr std::uint32_t kOldest = 222;
constexpr std::uint32_t kNewest = 225;
constexpr std::uint32_t kZip = 1;
constexpr std::uint32_t kActiveAlone = 2;
constexpr std::uint32_t kBlosc = 4;
constexpr std::string_view kHalfSuffix = "_HalfFloat";
/// Larger coordinates would leave no space for reads past the border.
constexpr std::int32_t kMaxCoordinate = 1 << 30;

/// The value type of a tree.
enum class Scalar : std::uint8_t { Float, Double, Bool, Mask };

struct Descriptor {
  std::string name;
  std::string type;
  std::string parent;
  std::uint64_t begin = 0;
  std::size_t at = 0;
};

std::string read_string(ByteReader& reader) {
  return std::string(reader.text(reader.u32()));
}

std::uint64_t read_u64(ByteReader& reader) {
  const std::uint64_t low = reader.u32();
  return low | std::uint64_t{reader.u32()} << 32;
}

double read_f64(ByteReader& reader) {
  return std::bit_cast<double>(read_u64(reader));
}

/// The metadata used here; other entries are skipped.
struct Metadata {
  std::string kind;  // the value of "class"
  bool is_half = false;
};

Metadata read_metadata(ByteReader& reader) {
  Metadata metadata;
  const std::size_t count = reader.count(12);
  for (std::size_t i = 0; i < count && !reader.failed(); ++i) {
    const std::string name = read_string(reader);
    const std::string type = read_string(reader);
    const std::string_view value = reader.text(reader.u32());
    if (name == "class" && type == "string") metadata.kind = value;
    if (name == "is_saved_as_half_float") metadata.is_half = !value.empty() && value[0] != '\0';
  }
  return metadata;
}

/// Returns nullopt for maps that are not affine.
std::optional<glm::dmat4> read_map(ByteReader& reader, const std::string& kind) {
  glm::dmat4 matrix(1.0);
  const auto vector = [&] {
    DVec3 v(0.0);
    for (int axis = 0; axis < 3; ++axis) v[axis] = read_f64(reader);
    return v;
  };
  if (kind == "AffineMap" || kind == "UnitaryMap") {
    for (int column = 0; column < 4; ++column) {
      for (int row = 0; row < 4; ++row) matrix[column][row] = read_f64(reader);
    }
    return matrix;
  }
  const bool is_moved = kind == "TranslationMap" || kind == "ScaleTranslateMap" || kind == "UniformScaleTranslateMap";
  const bool is_scaled = kind.ends_with("ScaleMap") || kind.ends_with("ScaleTranslateMap");
  if (!is_moved && !is_scaled) return std::nullopt;
  if (is_moved) matrix[3] = glm::dvec4(vector(), 1.0);
  if (is_scaled) {
    const DVec3 scale = vector();
    for (int axis = 0; axis < 3; ++axis) matrix[axis][axis] = scale[axis];
    static_cast<void>(reader.take(std::size_t{4} * 3 * 8));  // values derived from the scale
  }
  return matrix;
}

bool bit_of(std::span<const std::byte> bits, std::size_t i) {
  QUOIN_ASSERT(i >> 3 < bits.size(), "a bit of the mask");
  return (std::to_integer<unsigned>(bits[i >> 3]) >> (i & 7U) & 1U) != 0;
}

std::size_t count_of(std::span<const std::byte> bits) {
  std::size_t count = 0;
  for (const std::byte byte : bits) count += static_cast<std::size_t>(std::popcount(std::to_integer<unsigned>(byte)));
  return count;
}

/// Reads one grid's tree.
class TreeReader {
 public:
  TreeReader(ByteReader& reader, Scalar scalar, std::uint32_t compression, bool is_half, Grid& grid)
      : reader_(reader), scalar_(scalar), compression_(compression), is_half_(is_half), grid_(grid) {}

  Status read() {
    const std::size_t at = reader_.position();
    if (reader_.u32() != 1) return bad_at(at, "a tree has several buffers");
    if (auto done = read_root(); !done) return done;
    if (scalar_ != Scalar::Bool && scalar_ != Scalar::Mask) grid_.values.reserve(grid_.leaves.size() * kLeafVoxels);
    for (Leaf& leaf : grid_.leaves) {
      if (auto done = read_buffer(leaf); !done) return done;
    }
    return {};
  }

 private:
  [[nodiscard]] bool is_truth() const { return scalar_ == Scalar::Bool || scalar_ == Scalar::Mask; }
  [[nodiscard]] std::size_t value_bytes() const {
    return scalar_ == Scalar::Float ? 4 : scalar_ == Scalar::Double ? 8 : 1;
  }
  [[nodiscard]] Error too_short() const { return bad_at(reader_.position(), "the file ends before its trees"); }

  float read_value() {
    if (scalar_ == Scalar::Float) return reader_.f32();
    if (scalar_ == Scalar::Double) return static_cast<float>(read_f64(reader_));
    return reader_.u8() != 0 ? 1.0F : 0.0F;
  }

  Result<IVec3> read_origin(int edge) {
    const std::size_t at = reader_.position();
    IVec3 origin{0};
    for (int axis = 0; axis < 3; ++axis) {
      origin[axis] = reader_.i32();
      if (origin[axis] < -kMaxCoordinate || origin[axis] >= kMaxCoordinate || (origin[axis] & (edge - 1)) != 0) {
        return bad_at(at, "a node position is invalid");
      }
    }
    return origin;
  }

  Status read_root();
  Status read_upper(IVec3 origin);
  Status read_lower(IVec3 origin);
  Result<std::vector<float>> read_values(std::size_t count, std::span<const std::byte> active);
  Status read_data(std::size_t count, std::span<float> out);
  Status read_buffer(Leaf& leaf);
  void add_tile(IVec3 origin, int edge, float value, bool is_active) {
    // In a mask, active voxels are set; in a bool grid, true voxels.
    if (scalar_ == Scalar::Mask) value = is_active ? 1.0F : 0.0F;
    if (!is_active && value == grid_.background) return;
    grid_.tiles.push_back({origin, edge, value, is_active});
  }

  ByteReader& reader_;
  Scalar scalar_;
  std::uint32_t compression_;
  bool is_half_;
  Grid& grid_;
  std::vector<std::byte> expanded_;
};

Status TreeReader::read_root() {
  grid_.background = read_value();
  const std::size_t tiles = reader_.u32();
  const std::size_t nodes = reader_.u32();
  for (std::size_t i = 0; i < tiles; ++i) {
    const auto origin = read_origin(kUpperEdge);
    if (!origin) return origin.error();
    const float value = read_value();
    const bool is_active = reader_.u8() != 0;
    if (reader_.failed()) return too_short();
    add_tile(*origin, kUpperEdge, value, is_active);
  }
  for (std::size_t i = 0; i < nodes; ++i) {
    const auto origin = read_origin(kUpperEdge);
    if (!origin) return origin.error();
    if (reader_.failed()) return too_short();
    if (auto done = read_upper(*origin); !done) return done;
  }
  return {};
}

Status TreeReader::read_upper(IVec3 origin) {
  constexpr std::size_t kPlaces = 32 * 32 * 32;
  const auto children = reader_.take(kPlaces / 8);
  const auto active = reader_.take(kPlaces / 8);
  if (reader_.failed()) return too_short();
  const auto values = read_values(kPlaces, active);
  if (!values) return values.error();
  const auto place = [&](std::size_t i) {
    const auto at = static_cast<int>(i);
    return origin + IVec3{at >> 10, at >> 5 & 31, at & 31} * kLowerEdge;
  };
  for (std::size_t i = 0; i < kPlaces; ++i) {
    if (!bit_of(children, i)) add_tile(place(i), kLowerEdge, (*values)[i], bit_of(active, i));
  }
  for (std::size_t i = 0; i < kPlaces; ++i) {
    if (!bit_of(children, i)) continue;
    if (auto done = read_lower(place(i)); !done) return done;
  }
  return {};
}

Status TreeReader::read_lower(IVec3 origin) {
  constexpr std::size_t kPlaces = 16 * 16 * 16;
  const auto children = reader_.take(kPlaces / 8);
  const auto active = reader_.take(kPlaces / 8);
  if (reader_.failed()) return too_short();
  const auto values = read_values(kPlaces, active);
  if (!values) return values.error();
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const auto at = static_cast<int>(i);
    const IVec3 place = origin + IVec3{at >> 8, at >> 4 & 15, at & 15} * kLeafEdge;
    if (!bit_of(children, i)) {
      add_tile(place, kLeafEdge, (*values)[i], bit_of(active, i));
      continue;
    }
    static_cast<void>(reader_.take(kLeafVoxels / 8));  // the mask, which the leaf's buffer repeats
    if (reader_.failed()) return too_short();
    grid_.leaves.push_back({place, {}});
  }
  return {};
}

Result<std::vector<float>> TreeReader::read_values(std::size_t count, std::span<const std::byte> active) {
  enum Code : std::uint8_t { Background, MinusBackground, OneValue, MaskOfBackground, MaskOfOne, MaskOfTwo, All };
  const std::size_t at = reader_.position();
  QUOIN_ASSERT(active.size() * 8 == count, "one bit per value");
  const unsigned code = reader_.u8();
  if (code > All) return bad_at(at, "unknown value encoding");
  float first = code == Background ? grid_.background : is_truth() ? 1.0F - grid_.background : -grid_.background;
  float second = grid_.background;
  if (code == OneValue || code == MaskOfOne || code == MaskOfTwo) first = read_value();
  if (code == MaskOfTwo) second = read_value();
  std::span<const std::byte> choice;
  if (code == MaskOfBackground || code == MaskOfOne || code == MaskOfTwo) choice = reader_.take(count / 8);
  if (reader_.failed()) return too_short();
  const bool are_active_alone = (compression_ & kActiveAlone) != 0 && code != All;
  const std::size_t stored = are_active_alone ? count_of(active) : count;
  std::vector<float> values(count);
  if (auto done = read_data(stored, std::span(values).first(stored)); !done) return done.error();
  if (stored == count) return values;
  QUOIN_ASSERT(stored < count, "at most as many active values as places");
  // From the end, so that no value is overwritten before it is moved.
  std::size_t next = stored;
  for (std::size_t i = count; i-- > 0;) {
    if (bit_of(active, i)) {
      values[i] = values[--next];
    } else {
      values[i] = !choice.empty() && bit_of(choice, i) ? second : first;
    }
  }
  return values;
}

Status TreeReader::read_data(std::size_t count, std::span<float> out) {
  QUOIN_ASSERT(out.size() >= count, "room for the values");
  const bool is_half = is_half_ && !is_truth();
  const std::size_t size = is_half ? 2 : value_bytes();
  if (is_half && count == 0) return {};  // other types store a size even then
  const std::size_t bytes = count * size;
  std::span<const std::byte> data;
  if ((compression_ & (kZip | kBlosc)) == 0) {
    data = reader_.take(bytes);
    if (reader_.failed()) return too_short();
  } else {
    const std::size_t at = reader_.position();
    const auto claimed = static_cast<std::int64_t>(read_u64(reader_));
    const std::uint64_t packed_size =
        claimed < 0 ? 0 - static_cast<std::uint64_t>(claimed) : static_cast<std::uint64_t>(claimed);
    if (reader_.failed() || packed_size > reader_.remaining())
      return bad_at(at, "values extend past the end of the file");
    const auto packed = reader_.take(packed_size);
    if (claimed <= 0) {
      if (packed_size != bytes) return bad_at(at, "the size of the values differs from the node's");
      data = packed;
    } else {
      expanded_.resize(bytes);
      if ((compression_ & kBlosc) != 0) {
        if (auto done = expand_blosc(packed, expanded_); !done) {
          return make_error(done.error().code, done.error().message, {}, at + 8 + done.error().byte_offset.value_or(0));
        }
      } else {
        ByteStream stream(packed, 0, Compression::Zlib);
        const auto read = stream.read(expanded_);
        if (!read || *read != bytes) return bad_at(at + 8, "a zlib stream is damaged");
      }
      data = expanded_;
    }
  }
  QUOIN_ASSERT(data.size() >= bytes, "as many bytes as the values need");
  for (std::size_t i = 0; i < count; ++i) {
    const std::byte* const value = data.data() + i * size;
    if (is_half) {
      out[i] = float_from_half(load<std::uint16_t>(value, std::endian::little));
    } else if (scalar_ == Scalar::Float) {
      out[i] = load<float>(value, std::endian::little);
    } else if (scalar_ == Scalar::Double) {
      out[i] = static_cast<float>(load<double>(value, std::endian::little));
    } else {
      out[i] = *value != std::byte{0} ? 1.0F : 0.0F;
    }
  }
  return {};
}

Status TreeReader::read_buffer(Leaf& leaf) {
  constexpr std::size_t kMaskBytes = kLeafVoxels / 8;
  const auto active = reader_.take(kMaskBytes);
  if (reader_.failed()) return too_short();
  const auto load_mask = [](std::span<const std::byte> bytes) {
    LeafMask mask{};
    for (std::size_t i = 0; i < mask.size(); ++i)
      mask[i] = load<std::uint64_t>(bytes.data() + 8 * i, std::endian::little);
    return mask;
  };
  leaf.active = load_mask(active);
  if (!is_truth()) {
    const auto values = read_values(kLeafVoxels, active);
    if (!values) return values.error();
    grid_.values.insert(grid_.values.end(), values->begin(), values->end());
    return {};
  }
  static_cast<void>(reader_.take(12));  // origin
  if (scalar_ == Scalar::Bool) {
    const auto truth = reader_.take(kMaskBytes);
    if (reader_.failed()) return too_short();
    const LeafMask is_true = load_mask(truth);
    for (std::size_t i = 0; i < is_true.size(); ++i) leaf.active[i] &= is_true[i];
  }
  return reader_.failed() ? Status(too_short()) : Status();
}

std::optional<Scalar> scalar_of(std::string_view type) {
  if (type == "Tree_float_5_4_3") return Scalar::Float;
  if (type == "Tree_double_5_4_3") return Scalar::Double;
  if (type == "Tree_bool_5_4_3") return Scalar::Bool;
  if (type == "Tree_mask_5_4_3") return Scalar::Mask;
  return std::nullopt;
}

/// Returns a name without the number that OpenVDB appends to duplicate names.
std::string shown_name(const std::string& name) {
  return printable(std::string_view(name).substr(0, name.find('\x1e')));
}

class FileReader {
 public:
  explicit FileReader(std::span<const std::byte> bytes) : bytes_(bytes), reader_(bytes) {}

  Result<File> read() {
    static_cast<void>(reader_.take(kVdbMagic.size()));
    const std::uint32_t version = reader_.u32();
    if (version < kOldest || version > kNewest) {
      return make_error(ErrorCode::Unsupported,
                        ".vdb version " + std::to_string(version) + " is not supported (222 to 225 are)", {},
                        kVdbMagic.size());
    }
    static_cast<void>(reader_.take(8));  // version of the library
    const std::size_t offsets_at = reader_.position();
    const bool has_offsets = reader_.u8() != 0;
    static_cast<void>(reader_.take(36));
    static_cast<void>(read_metadata(reader_));
    const std::size_t count = reader_.count(12 + 24);
    if (reader_.failed()) return bad_at(bytes_.size(), "the file ends before its grids");
    if (!has_offsets) {
      return make_error(ErrorCode::Unsupported, "a streamed .vdb file without grid offsets is not supported", {},
                        offsets_at);
    }
    std::vector<Descriptor> descriptors;
    for (std::size_t i = 0; i < count; ++i) {
      if (auto done = read_next(descriptors); !done) return done.error();
    }
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      if (auto done = read_grid(descriptors[i], i); !done) return done.error();
    }
    for (const auto& [grid, parent] : parents_) {
      const auto found = place_of_.find(parent);
      if (found != place_of_.end() && file_.grids[found->second].same_as == SIZE_MAX) {
        file_.grids[grid].same_as = found->second;
        file_.grids[grid].meaning = file_.grids[found->second].meaning;
      } else {
        file_.warnings.push_back("left out: " + file_.grids[grid].name + ", whose tree does not exist");
      }
    }
    return std::move(file_);
  }

 private:
  /// Reads a descriptor and moves to the next one.
  Status read_next(std::vector<Descriptor>& descriptors) {
    Descriptor next;
    next.at = reader_.position();
    next.name = read_string(reader_);
    next.type = read_string(reader_);
    next.parent = read_string(reader_);
    next.begin = read_u64(reader_);
    static_cast<void>(read_u64(reader_));
    const std::uint64_t end = read_u64(reader_);
    if (reader_.failed() || next.begin < reader_.position() || end < next.begin || end > bytes_.size()) {
      return bad_at(next.at, "a grid's start or end is out of bounds");
    }
    // Ensures that grids do not overlap, so each byte is read once.
    reader_ = ByteReader(bytes_, end, bytes_.size());
    ends_.push_back(end);
    descriptors.push_back(std::move(next));
    return {};
  }

  Status read_grid(const Descriptor& descriptor, std::size_t number) {
    QUOIN_ASSERT(number < ends_.size(), "a grid of the file");
    ByteReader reader(bytes_, descriptor.begin, ends_[number]);
    const std::uint32_t compression = reader.u32();
    const Metadata metadata = read_metadata(reader);
    const std::string map = read_string(reader);
    if (reader.failed()) return bad_at(descriptor.begin, "a grid ends before its tree");
    Grid grid;
    grid.name = shown_name(descriptor.name);
    std::string type = descriptor.type;
    const bool has_suffix = type.ends_with(kHalfSuffix);
    if (has_suffix) type.resize(type.size() - kHalfSuffix.size());
    const auto scalar = scalar_of(type);
    const auto matrix = read_map(reader, map);
    if (!scalar || !matrix) {
      file_.warnings.push_back(
          "left out: the grid \"" + grid.name + "\", " +
          (scalar ? "whose transform is not affine (" + printable(map) + ")" : "of type " + printable(type)));
      return {};
    }
    grid.world_from_index = *matrix;
    grid.meaning = *scalar == Scalar::Bool || *scalar == Scalar::Mask ? Meaning::Mask
                   : metadata.kind == "level set"                     ? Meaning::LevelSet
                                                                      : Meaning::Fog;
    if (!descriptor.parent.empty()) {
      parents_.emplace_back(file_.grids.size(), descriptor.parent);
    } else if (auto done = TreeReader(reader, *scalar, compression, metadata.is_half || has_suffix, grid).read();
               !done) {
      return done;
    }
    place_of_.emplace(descriptor.name, file_.grids.size());
    file_.grids.push_back(std::move(grid));
    return {};
  }

  std::span<const std::byte> bytes_;
  ByteReader reader_;
  File file_;
  std::vector<std::uint64_t> ends_;
  std::map<std::string, std::size_t> place_of_;
  std::vector<std::pair<std::size_t, std::string>> parents_;
};

}  // namespace

bool is_vdb(std::span<const std::byte> beginning) {
  return text_of(beginning).starts_with(kVdbMagic);
}

Result<File> read_vdb_file(std::span<const std::byte> bytes) {
  return FileReader(bytes).read();
}

// A Blosc frame: u8 version, u8, u8 flags, u8 bytes of an element, u32 bytes, u32 bytes of a block, u32 bytes of the
// frame; then the offset of each block (i32), and the blocks: streams of i32 size and bytes; split blocks have a stream
// for each byte of an element. Shuffled: the first bytes of all elements come first.

namespace {

constexpr std::size_t kBloscHeader = 16;

struct Header {
  unsigned flags = 0;
  std::size_t element = 1;
  std::size_t bytes = 0;
  std::size_t block = 0;

  [[nodiscard]] bool is_shuffled() const { return (flags & 1U) != 0; }
  [[nodiscard]] bool is_stored() const { return (flags & 2U) != 0; }
  [[nodiscard]] bool is_shuffled_by_bits() const { return (flags & 4U) != 0; }
  [[nodiscard]] unsigned compressor() const { return flags >> 5; }
  [[nodiscard]] bool is_split() const {
    constexpr std::size_t kMostStreams = 16;
    constexpr std::size_t kLeastElements = 128;
    return (flags & 0x10U) == 0 && element <= kMostStreams && block / element >= kLeastElements;
  }
};

Status expand_lz4([[maybe_unused]] std::span<const std::byte> packed, [[maybe_unused]] std::span<std::byte> out,
                  std::size_t at) {
#ifdef QUOIN_HAVE_LZ4
  const int count =
      LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()), reinterpret_cast<char*>(out.data()),
                          static_cast<int>(packed.size()), static_cast<int>(out.size()));
  if (count == static_cast<int>(out.size())) return {};
  return bad_at(at, "Blosc: an LZ4 stream is damaged");
#else
  return make_error(ErrorCode::Unsupported, "cannot read LZ4: Quoin was built without it", {}, at);
#endif
}

Status expand_stream(const Header& header, std::span<const std::byte> packed, std::span<std::byte> out,
                     std::size_t at) {
  if (packed.size() == out.size()) {
    std::ranges::copy(packed, out.begin());
    return {};
  }
  constexpr unsigned kLz4 = 1;
  constexpr unsigned kZlib = 3;
  if (header.compressor() == kLz4) return expand_lz4(packed, out, at);
  if (header.compressor() != kZlib) {
    return make_error(
        ErrorCode::Unsupported,
        "Blosc: compressor " + std::to_string(header.compressor()) + " is not supported (LZ4 and zlib are)", {}, at);
  }
  ByteStream stream(packed, 0, Compression::Zlib);
  const auto count = stream.read(out);
  if (!count || *count != out.size()) return bad_at(at, "Blosc: a zlib stream is damaged");
  return {};
}

void unshuffle(std::span<const std::byte> shuffled, std::size_t element, std::span<std::byte> out) {
  QUOIN_ASSERT(element > 0 && out.size() == shuffled.size(), "as many bytes as before");
  const std::size_t count = shuffled.size() / element;
  for (std::size_t byte = 0; byte < element; ++byte) {
    for (std::size_t i = 0; i < count; ++i) out[i * element + byte] = shuffled[byte * count + i];
  }
  std::ranges::copy(shuffled.subspan(count * element), out.begin() + static_cast<std::ptrdiff_t>(count * element));
}

}  // namespace

Status expand_blosc(std::span<const std::byte> frame, std::span<std::byte> out) {
  ByteReader reader(frame);
  Header header;
  static_cast<void>(reader.take(2));
  header.flags = reader.u8();
  header.element = std::max<std::size_t>(reader.u8(), 1);
  header.bytes = reader.u32();
  header.block = reader.u32();
  static_cast<void>(reader.u32());
  if (reader.failed() || header.bytes != out.size())
    return bad_at(0, "Blosc: the frame does not have the expected number of bytes");
  if (header.is_stored()) {
    const auto stored = reader.take(out.size());
    if (reader.failed()) return bad_at(kBloscHeader, "Blosc: cut off");
    std::ranges::copy(stored, out.begin());
    return {};
  }
  if (header.is_shuffled_by_bits())
    return make_error(ErrorCode::Unsupported, "Blosc: bit shuffle is not supported", {}, 2);
  if (header.block == 0 || (out.size() + header.block - 1) / header.block > reader.remaining() / 4) {
    return bad_at(8, "Blosc: invalid block size");
  }
  std::vector<std::byte> shuffled(std::min(header.block, out.size()));
  for (std::size_t begin = 0; begin < out.size(); begin += header.block) {
    const std::size_t at = reader.u32();
    if (at > frame.size()) return bad_at(reader.position(), "Blosc: a block starts past the end of the frame");
    const auto block = out.subspan(begin, std::min(header.block, out.size() - begin));
    const auto target = header.is_shuffled() ? std::span(shuffled).first(block.size()) : block;
    const bool is_split = header.is_split() && block.size() == header.block && block.size() % header.element == 0;
    const std::size_t stream = is_split ? block.size() / header.element : block.size();
    QUOIN_ASSERT(stream > 0, "a stream of at least one byte");
    ByteReader streams(frame, at, frame.size());
    for (std::size_t done = 0; done < block.size(); done += stream) {
      const std::size_t place = streams.position();
      const auto packed = streams.take(streams.u32());
      if (streams.failed()) return bad_at(place, "Blosc: cut off");
      if (auto expanded = expand_stream(header, packed, target.subspan(done, stream), place); !expanded)
        return expanded;
    }
    if (header.is_shuffled()) unshuffle(target, header.element, block);
  }
  return {};
}

}  // namespace quoin::vdb

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"

/// The content of a MagicaVoxel file: axes, ids and colour indices are the file's.
///
/// Source: MagicaVoxel-file-format-vox.txt and -vox-extension.txt, github.com/ephtracy/voxel-model. Of TDCZ, Teardown's
///         compressed models, the description of github.com/vengi-voxel/vengi/pull/778 and the order in which
///         github.com/TTFH/Teardown-Converter writes voxels (src/vox_writer.cpp, src/math_utils.cpp).
namespace quoin::vox {

inline constexpr std::size_t kColours = 256;
/// Maximum voxels along a model's axis: XYZI has one byte per coordinate.
inline constexpr int kMaxModelEdge = 256;

/// Keys and values of a DICT, in the file's order.
struct Dict {
  std::vector<std::pair<std::string_view, std::string_view>> entries;

  /// Returns the last value of that key; empty if there is none.
  [[nodiscard]] std::string_view get(std::string_view key) const;
  [[nodiscard]] bool is_set(std::string_view key) const { return get(key) == "1"; }
};

/// A SIZE and its XYZI, or a TDCZ.
struct Model {
  IVec3 size{1};
  std::span<const std::byte> voxels;  ///< x, y, z, colour index: a byte each
  std::uint64_t offset = 0;           ///< offset of the SIZE chunk, or of the TDCZ
  std::size_t packed_begin = 0;  ///< offset in the file of the compressed voxels of a TDCZ, which `unpack_voxels` reads
  std::size_t packed_end = 0;    ///< 0 for uncompressed voxels
};

struct TransformKey {
  std::int32_t frame = 0;
  AxisOrientation orientation;
  IVec3 translation{0};
};

struct ModelKey {
  std::int32_t frame = 0;
  std::uint32_t model = 0;
};

enum class NodeKind : std::uint8_t { Transform, Group, Shape };

/// An nTRN, nGRP or nSHP chunk.
struct Node {
  NodeKind kind = NodeKind::Group;
  bool hidden = false;
  bool loops = false;
  std::int32_t id = 0;
  std::int32_t layer = -1;
  std::uint64_t offset = 0;
  std::string_view name;
  std::size_t first_child = 0;  ///< in Document::children
  std::size_t child_count = 0;
  std::size_t first_key = 0;  ///< in Document::transform_keys or model_keys; never empty for these kinds
  std::size_t key_count = 0;
};

struct Layer {
  std::int32_t id = 0;
  bool hidden = false;
  std::string_view name;
};

/// An rCAM chunk.
struct CameraChunk {
  std::int32_t id = 0;
  Dict attributes;
};

/// An rOBJ chunk.
struct SettingChunk {
  Dict attributes;
};

/// The type of a chunk within MAIN.
enum class ChunkKind : std::uint8_t { Other, ModelCount, Size, Voxels, PackedVoxels, Palette, Material, Node, Layer };

struct ChunkSpan {
  ChunkKind kind = ChunkKind::Other;
  std::size_t begin = 0;  ///< offset of its header
  std::size_t content_bytes = 0;
  std::size_t children_bytes = 0;
  std::size_t number = 0;  ///< index in the list of its kind; for voxels the model's, for a material its colour index
};

/// The keys and values of a MATL, or of a MATT under MATL's names.
using Attributes = std::map<std::string, std::string>;

/// Views point into the file's bytes.
struct Document {
  std::int32_t version = 0;
  std::vector<Model> models;
  std::span<const std::byte> palette;          ///< RGBA's entries: entry i is colour index i + 1; may be fewer than 255
  std::span<const std::byte> index_map;        ///< IMAP's 256 bytes, or empty
  std::array<Attributes, kColours> materials;  ///< by colour index
  std::vector<Node> nodes;
  std::vector<std::int32_t> children;        ///< node ids
  std::vector<TransformKey> transform_keys;  ///< keys of each node by ascending frame
  std::vector<ModelKey> model_keys;          ///< keys of each node by ascending frame
  std::vector<Layer> layers;
  std::vector<CameraChunk> cameras;
  std::vector<SettingChunk> settings;
  std::int32_t last_frame = 0;       ///< over the keys and META's range
  std::int64_t stray_materials = 0;  ///< MATL and MATT chunks whose id is not a colour index
  std::vector<std::string> warnings;
  std::vector<ChunkSpan> chunks;
  std::size_t main_content = 0;  ///< bytes of a MAIN with content of its own
  std::size_t chunks_begin = 0;  ///< offset of the first chunk within MAIN
  std::size_t chunks_end = 0;    ///< end of the last one
};

/// The size of a chunk's header: its id, the size of its content, and of its children.
inline constexpr std::size_t kChunkHeaderBytes = 12;

/// Returns the frame of a transform's or a shape's key; without `_f` it is the key's index in the list. Returns nullopt
/// if it is invalid.
[[nodiscard]] std::optional<std::int32_t> frame_of_key(std::string_view text, std::size_t place);
/// Parses `_r` and `_t` of a transform's key; nullopt if they are invalid.
[[nodiscard]] std::optional<AxisOrientation> parse_orientation(std::string_view text);
[[nodiscard]] std::optional<IVec3> parse_translation(std::string_view text);

/// Returns true if the file has several frames.
[[nodiscard]] bool is_animated(const Document& document);
/// Returns the last frame of the file.
[[nodiscard]] std::int64_t last_frame(const Document& document);

/// Returns true for the layout of SLAB6's .vox, which Voxlap's reader reads: three sizes from 1 to 4,096, the voxels,
/// and a palette of 768 bytes.
[[nodiscard]] bool is_slab6(std::span<const std::byte> bytes);

/// Reads all chunks and checks each against the available bytes; references of nodes are not checked.
///
/// Memory: views, plus a small multiple of the file's size.
/// Errors: Unsupported for other formats with this extension; BadFormat with the byte offset.
[[nodiscard]] Result<Document> parse_document(std::span<const std::byte> bytes);

/// Decodes the voxels of a TDCZ to the form of an XYZI: x, y, z, colour index of each voxel with a colour. The
/// compressed data has one byte per voxel of the whole box, x fastest, then y, then z. Some writers leave the stream
/// unterminated.
///
/// Memory: 64 MiB at most, since no edge is longer than 256.
/// Errors: BadFormat with the byte offset, for damaged data and for more or fewer voxels than the box has.
[[nodiscard]] Result<std::vector<std::byte>> unpack_voxels(std::span<const std::byte> file, const Model& model);

// One chunk's content each; `reader` covers exactly that content.
class ChunkReader;
[[nodiscard]] Status parse_transform(ChunkReader& chunk, Document& out);
[[nodiscard]] Status parse_group(ChunkReader& chunk, Document& out);
[[nodiscard]] Status parse_shape(ChunkReader& chunk, Document& out);
[[nodiscard]] Status parse_layer(ChunkReader& chunk, Document& out);
[[nodiscard]] Status parse_animation_range(ChunkReader& chunk, Document& out);
[[nodiscard]] Status parse_material(ChunkReader& chunk, Document& out);
[[nodiscard]] Status parse_old_material(ChunkReader& chunk, Document& out);

/// The content of one chunk, with the errors that name it.
class ChunkReader : public ByteReader {
 public:
  ChunkReader(std::span<const std::byte> file, std::string_view id, std::size_t offset, std::size_t begin,
              std::size_t end)
      : ByteReader(file, begin, end), id_(id), offset_(offset) {}

  [[nodiscard]] std::string_view id() const { return id_; }
  /// Returns the offset of the chunk's header.
  [[nodiscard]] std::size_t offset() const { return offset_; }

  [[nodiscard]] std::string_view string() { return text(u32()); }
  [[nodiscard]] Dict dict();

  /// Returns BadFormat at the chunk: "chunk nTRN <what>".
  [[nodiscard]] Error error(const std::string& what) const {
    return bad_at(offset_, "chunk " + printable(id_) + " " + what);
  }
  [[nodiscard]] Error too_short() const { return error("ends before its content"); }

 private:
  std::string_view id_;
  std::size_t offset_;
};

/// Builds the bytes of a .vox file.
class ChunkWriter : public ByteWriter {
 public:
  using Entries = std::vector<std::pair<std::string, std::string>>;

  void string(std::string_view value) {
    u32(static_cast<std::uint32_t>(value.size()));
    text(value);
  }
  void dict(const Entries& entries) {
    u32(static_cast<std::uint32_t>(entries.size()));
    for (const auto& [key, value] : entries) {
      string(key);
      string(value);
    }
  }

  /// Starts a chunk; writes until `end_chunk` are its content.
  [[nodiscard]] std::size_t begin_chunk(std::string_view id) {
    text(id);
    u32(0);
    u32(0);
    return size();
  }
  /// `begin`: the result of begin_chunk. Content beyond 4 GiB wraps: check `size` before using the bytes. `children`:
  /// bytes of child chunks after it.
  void end_chunk(std::size_t begin, std::size_t children = 0) {
    QUOIN_ASSERT(begin >= 12 && begin <= size(), "a chunk that was begun");
    patch(begin - 8, size() - begin);
    patch(begin - 4, children);
  }
};

/// A translation that sums of many 32-bit ones cannot overflow.
using Offset = std::array<std::int64_t, 3>;

[[nodiscard]] Offset operator*(const AxisOrientation& orientation, const Offset& offset);

/// A rotation followed by a translation. Requires for computations: offsets stay below 2^62, as all file offsets do.
struct Motion {
  AxisOrientation orientation;
  Offset translation{0, 0, 0};

  bool operator==(const Motion&) const = default;
};

/// First `b`, then `a`.
[[nodiscard]] Motion operator*(const Motion& a, const Motion& b);
[[nodiscard]] Motion inverse(const Motion& motion);

/// Converts from and to the `_r` byte: bits 0-1 and 2-3 the columns of the first and second row's entry, bits 4-6 the
/// rows' signs. Returns nullopt if the two rows have the same or an invalid column.
[[nodiscard]] std::optional<AxisOrientation> orientation_from_byte(std::uint8_t byte);
[[nodiscard]] std::uint8_t byte_from_orientation(const AxisOrientation& orientation);

/// An orientation as an Instance holds it: mirror x, then rotate.
struct InstanceTurn {
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  bool mirrored = false;
};

/// From MagicaVoxel's axes (z up) to Quoin's (y up): the same motion seen from axes (x, z, -y).
[[nodiscard]] InstanceTurn turn_from_orientation(const AxisOrientation& in_vox);
/// The inverse conversion; nullopt if the rotation is not a multiple of quarter turns.
[[nodiscard]] std::optional<AxisOrientation> orientation_from_turn(const InstanceTurn& turn);

/// (x, y, z) of MagicaVoxel as Quoin's (x, z, -y), and back.
[[nodiscard]] Offset quoin_from_vox(const Offset& offset);
[[nodiscard]] Offset vox_from_quoin(const Offset& offset);

}  // namespace quoin::vox

#include "io/vox/chunks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <glm/mat3x3.hpp>

#include <quoin/core/assert.h>

#include "core/bytes/text.h"

namespace quoin::vox {

namespace {

constexpr std::size_t kFileHeaderBytes = 8;
constexpr std::string_view kMagic = "VOX ";
// Some writers include the headers before MAIN's children in its child size, at most 20 bytes. Such a file still ends
// with a complete chunk. A truncated file does not, unless it lost a chunk of at most 8 bytes of content, which no
// meaningful chunk has.
constexpr std::size_t kMostOverstated = kFileHeaderBytes + kChunkHeaderBytes;
constexpr std::string_view kLfsPointer = "version https://git-lfs";

struct ChunkHeader {
  std::size_t offset = 0;
  std::string_view id;
  std::uint64_t content_bytes = 0;
  std::uint64_t children_bytes = 0;
};

std::string_view text_of(std::span<const std::byte> bytes, std::size_t count) {
  return {reinterpret_cast<const char*>(bytes.data()), std::min(count, bytes.size())};
}

}  // namespace

bool is_slab6(std::span<const std::byte> bytes) {
  constexpr std::uint64_t kMaxEdge = 4096;
  constexpr std::uint64_t kPaletteBytes = 768;
  ByteReader reader(bytes);
  std::uint64_t voxels = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint64_t edge = reader.u32();
    if (edge == 0 || edge > kMaxEdge) return false;
    voxels *= edge;
  }
  return reader.remaining() == voxels + kPaletteBytes;
}

namespace {

Status check_signature(std::span<const std::byte> bytes) {
  if (bytes.empty()) return make_error(ErrorCode::BadFormat, "the file is empty");
  if (text_of(bytes, 4) == kMagic) return {};
  if (text_of(bytes, kLfsPointer.size()) == kLfsPointer) {
    return make_error(ErrorCode::Unsupported, "a Git LFS pointer, not the file itself (git lfs pull fetches it)");
  }
  if (is_slab6(bytes)) {
    return make_error(ErrorCode::Unsupported, "a SLAB6 .vox file, not a MagicaVoxel .vox file");
  }
  return bad_at(0, "a MagicaVoxel file starts with \"VOX \", this file with \"" + printable(text_of(bytes, 4)) + "\"");
}

/// Reads a header and checks that its sizes end before `end`; its children may extend up to `spare` bytes further.
Result<ChunkHeader> read_header(std::span<const std::byte> bytes, std::size_t begin, std::size_t end,
                                std::size_t spare = 0) {
  ByteReader reader(bytes, begin, end);
  ChunkHeader header;
  header.offset = begin;
  header.id = reader.text(4);
  header.content_bytes = reader.u32();
  header.children_bytes = reader.u32();
  if (reader.failed()) return bad_at(begin, "a chunk's header is cut off");
  const std::uint64_t claimed = header.content_bytes + header.children_bytes;
  if (claimed > reader.remaining() + std::min<std::uint64_t>(spare, header.children_bytes)) {
    return bad_at(begin, "chunk " + printable(header.id) + " claims " + std::to_string(claimed) + " bytes, but " +
                             std::to_string(reader.remaining()) + " are left");
  }
  return header;
}

using FileSize = std::array<std::uint32_t, 3>;

std::string text_of(const FileSize& size) {
  return std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(size[2]) + " voxels";
}

/// Reads three edges of at most `kMaxModelEdge`.
Result<FileSize> read_size(ChunkReader& chunk) {
  FileSize size{};
  for (std::uint32_t& edge : size) edge = chunk.u32();
  if (chunk.failed()) return chunk.too_short();
  const bool fits = std::ranges::all_of(size, [](std::uint32_t edge) { return edge <= kMaxModelEdge; });
  if (!fits) return chunk.error("claims " + text_of(size));
  return size;
}

Status parse_size(ChunkReader& chunk, Document& out) {
  const Result<FileSize> read = read_size(chunk);
  if (!read) return read.error();
  const FileSize& size = *read;
  if (std::ranges::find(size, 0U) != size.end()) {
    out.warnings.push_back("model " + std::to_string(out.models.size()) + " has size 0 on an axis; 1 is used");
  }
  Model model;
  for (int axis = 0; axis < 3; ++axis) {
    model.size[axis] = std::max(1, static_cast<int>(size[static_cast<std::size_t>(axis)]));
  }
  model.offset = chunk.offset();
  out.models.push_back(model);
  return {};
}

Status parse_voxels(ChunkReader& chunk, Model& model) {
  const std::uint32_t claimed = chunk.u32();
  if (chunk.failed()) return chunk.too_short();
  if (claimed > chunk.remaining() / 4) {
    return chunk.error("claims " + std::to_string(claimed) + " voxels in " + std::to_string(chunk.remaining()) +
                       " bytes");
  }
  model.voxels = chunk.take(std::size_t{claimed} * 4);
  return {};
}

/// A TDCZ stores its size; a SIZE before it must agree.
Status parse_packed_voxels(ChunkReader& chunk, bool has_size, Document& out) {
  const Result<FileSize> size = read_size(chunk);
  if (!size) return size.error();
  if (std::ranges::find(*size, 0U) != size->end()) return chunk.error("claims " + text_of(*size));
  Model model;
  for (int axis = 0; axis < 3; ++axis) model.size[axis] = static_cast<int>((*size)[static_cast<std::size_t>(axis)]);
  model.offset = chunk.offset();
  model.packed_begin = chunk.position();
  model.packed_end = chunk.position() + chunk.remaining();
  if (has_size) {
    if (out.models.back().size != model.size) return chunk.error("has a different size than the SIZE before it");
    out.models.back() = model;
  } else {
    out.models.push_back(model);
  }
  return {};
}

/// The 256th entry belongs to air, and Teardown omits it. Other programs write only the colours that they use.
Status parse_palette(ChunkReader& chunk, Document& out) {
  const std::size_t entries = std::min(chunk.remaining() / 4, kColours);
  if (entries == 0) return chunk.too_short();
  if (entries + 1 < kColours) {
    out.warnings.push_back("the palette has " + std::to_string(entries) +
                           " of 255 colours; the others come from the default palette");
  }
  out.palette = chunk.take(entries * 4);
  return {};
}

Status parse_index_map(ChunkReader& chunk, Document& out) {
  if (chunk.remaining() < kColours) return chunk.too_short();
  out.index_map = chunk.take(kColours);
  return {};
}

/// A damaged camera does not invalidate the voxels: its chunk is kept unchanged, like unknown chunks.
void parse_camera(ChunkReader& chunk, Document& out) {
  CameraChunk camera;
  camera.id = chunk.i32();
  camera.attributes = chunk.dict();
  if (chunk.failed()) {
    out.warnings.push_back("a camera skipped: " + chunk.too_short().message);
  } else {
    out.cameras.push_back(std::move(camera));
  }
}

void parse_setting(ChunkReader& chunk, Document& out) {
  SettingChunk setting{chunk.dict()};
  if (chunk.failed()) {
    out.warnings.push_back("render settings skipped: " + chunk.too_short().message);
  } else {
    out.settings.push_back(std::move(setting));
  }
}

/// The last SIZE chunk, while its XYZI is pending.
struct ModelState {
  bool has_size = false;
};

/// Classifies a chunk by its id and the chunks before it. Requires: `out` holds the chunks before it, not the chunk
/// itself.
ChunkSpan place_of(const ChunkHeader& header, const ModelState& state, const Document& out) {
  ChunkSpan place;
  place.begin = header.offset;
  place.content_bytes = header.content_bytes;
  place.children_bytes = header.children_bytes;
  const auto is = [&](ChunkKind kind, std::size_t number) {
    place.kind = kind;
    place.number = number;
    return place;
  };
  const std::string_view id = header.id;
  if (id == "PACK") return is(ChunkKind::ModelCount, 0);
  if (id == "SIZE") return is(ChunkKind::Size, out.models.size());
  if (id == "XYZI") return is(ChunkKind::Voxels, out.models.size() - 1);
  if (id == "TDCZ") return is(ChunkKind::PackedVoxels, out.models.size() - (state.has_size ? 1 : 0));
  if (id == "RGBA") return is(ChunkKind::Palette, 0);
  if (id == "nTRN" || id == "nGRP" || id == "nSHP") return is(ChunkKind::Node, out.nodes.size());
  if (id == "LAYR") return is(ChunkKind::Layer, out.layers.size());
  return place;
}

Status parse_chunk(ChunkReader& chunk, ModelState& state, Document& out) {
  const std::string_view id = chunk.id();
  if (id == "SIZE") {
    if (state.has_size) return chunk.error("follows another SIZE, whose XYZI is missing");
    state.has_size = true;
    return parse_size(chunk, out);
  }
  if (id == "XYZI") {
    if (!state.has_size) return chunk.error("has no SIZE before it");
    state.has_size = false;
    return parse_voxels(chunk, out.models.back());
  }
  if (id == "TDCZ") return parse_packed_voxels(chunk, std::exchange(state.has_size, false), out);
  if (id == "RGBA") return parse_palette(chunk, out);
  if (id == "IMAP") return parse_index_map(chunk, out);
  if (id == "MATL") return parse_material(chunk, out);
  if (id == "MATT") return parse_old_material(chunk, out);
  if (id == "nTRN") return parse_transform(chunk, out);
  if (id == "nGRP") return parse_group(chunk, out);
  if (id == "nSHP") return parse_shape(chunk, out);
  if (id == "LAYR") return parse_layer(chunk, out);
  if (id == "META") return parse_animation_range(chunk, out);
  if (id == "rCAM") parse_camera(chunk, out);
  if (id == "rOBJ") parse_setting(chunk, out);
  return {};  // PACK repeats the number of models; lights and notes have no place in a scene.
}

Status parse_chunks(std::span<const std::byte> bytes, std::size_t begin, std::size_t end, Document& out) {
  ModelState state;
  std::size_t at = begin;
  while (at < end) {
    const Result<ChunkHeader> header = read_header(bytes, at, end);
    if (!header) return header.error();
    const std::size_t content = at + kChunkHeaderBytes;
    ChunkReader chunk(bytes, header->id, at, content, content + header->content_bytes);
    out.chunks.push_back(place_of(*header, state, out));
    if (Status status = parse_chunk(chunk, state, out); !status) return status;
    at = content + header->content_bytes + header->children_bytes;
  }
  if (state.has_size) return bad_at(out.models.back().offset, "chunk SIZE has no XYZI after it");
  return {};
}

/// Returns true if chunks follow each other from `begin` to the end of the file.
bool is_chain(std::span<const std::byte> bytes, std::size_t begin) {
  std::size_t at = begin;
  while (at < bytes.size()) {
    const Result<ChunkHeader> header = read_header(bytes, at, bytes.size());
    if (!header) return false;
    at += kChunkHeaderBytes + header->content_bytes + header->children_bytes;
  }
  return at == bytes.size() && at > begin;
}

/// Returns the offset of MAIN's children. MAIN has no content, even where a writer put another number into that field.
std::size_t begin_of_children(std::span<const std::byte> bytes, const ChunkHeader& main, Document& out) {
  const std::size_t content = kFileHeaderBytes + kChunkHeaderBytes;
  const std::size_t claimed = content + main.content_bytes;
  out.main_content = main.content_bytes;
  if (main.content_bytes == 0 || !is_chain(bytes, content)) return claimed;
  out.warnings.push_back("MAIN claims " + std::to_string(main.content_bytes) +
                         " bytes of content but has none; ignored");
  out.main_content = 0;
  return content;
}

}  // namespace

std::string_view Dict::get(std::string_view key) const {
  const auto found =
      std::find_if(entries.rbegin(), entries.rend(), [&](const auto& entry) { return entry.first == key; });
  return found == entries.rend() ? std::string_view{} : found->second;
}

Dict ChunkReader::dict() {
  constexpr std::size_t kLeastEntryBytes = 8;
  Dict dict;
  const std::size_t count = this->count(kLeastEntryBytes);
  dict.entries.reserve(count);
  for (std::size_t i = 0; i < count && !failed(); ++i) {
    const std::string_view key = string();
    const std::string_view value = string();
    dict.entries.emplace_back(key, value);
  }
  return dict;
}

Result<Document> parse_document(std::span<const std::byte> bytes) {
  if (Status status = check_signature(bytes); !status) return status.error();
  Document document;
  ByteReader reader(bytes);
  static_cast<void>(reader.u32());
  document.version = reader.i32();
  if (reader.failed()) return bad_at(4, "the version number is cut off");
  if (document.version != 150 && document.version != 200) {
    document.warnings.push_back("version " + std::to_string(document.version) + " is unknown; read like 150 and 200");
  }
  const Result<ChunkHeader> main = read_header(bytes, kFileHeaderBytes, bytes.size(), kMostOverstated);
  if (!main) return main.error();
  if (main->id != "MAIN") {
    return bad_at(kFileHeaderBytes, "the first chunk must be MAIN, not \"" + printable(main->id) + "\"");
  }
  const std::size_t begin = begin_of_children(bytes, *main, document);
  const std::size_t claimed_end = begin + main->children_bytes;
  const std::size_t end = std::min(claimed_end, bytes.size());
  document.chunks_begin = begin;
  document.chunks_end = end;
  if (Status status = parse_chunks(bytes, begin, end, document); !status) return status.error();
  if (claimed_end > end) {
    document.warnings.push_back("MAIN claims " + std::to_string(claimed_end - end) +
                                " bytes past the end of the file; the rest was read");
  }
  if (end < bytes.size()) {
    document.warnings.push_back("the last " + std::to_string(bytes.size() - end) + " bytes are outside MAIN; skipped");
  }
  return document;
}

namespace {

constexpr std::int64_t kMaxInt32 = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t kMinInt32 = std::numeric_limits<std::int32_t>::min();

// The minimum sizes: a frame is an empty DICT, a shape's model an id and an empty DICT.
constexpr std::size_t kLeastFrameBytes = 4;
constexpr std::size_t kLeastModelBytes = 8;
constexpr std::size_t kChildBytes = 4;

std::string quoted(std::string_view text) {
  constexpr std::size_t kMost = 40;
  std::string out = "\"";
  out += printable(text.substr(0, kMost));
  out += '"';
  return out;
}

/// Reads `_f`; a key without it has its index as its frame.
Result<std::int32_t> parse_frame(const ChunkReader& chunk, const Dict& dict, std::size_t place) {
  const std::string_view text = dict.get("_f");
  const std::optional<std::int32_t> frame = frame_of_key(text, place);
  if (!frame.has_value()) return chunk.error("has the invalid frame " + quoted(text));
  return *frame;
}

Result<TransformKey> parse_transform_key(ChunkReader& chunk, std::size_t place) {
  const Dict dict = chunk.dict();
  if (chunk.failed()) return chunk.too_short();
  const Result<std::int32_t> frame = parse_frame(chunk, dict, place);
  if (!frame) return frame.error();
  const std::optional<AxisOrientation> orientation = parse_orientation(dict.get("_r"));
  if (!orientation) return chunk.error("has the invalid rotation " + quoted(dict.get("_r")));
  const std::optional<IVec3> translation = parse_translation(dict.get("_t"));
  if (!translation) return chunk.error("has the invalid translation " + quoted(dict.get("_t")));
  return TransformKey{*frame, *orientation, *translation};
}

Result<ModelKey> parse_model_key(ChunkReader& chunk, std::size_t place) {
  const std::uint32_t model = chunk.u32();
  const Dict dict = chunk.dict();
  if (chunk.failed()) return chunk.too_short();
  const Result<std::int32_t> frame = parse_frame(chunk, dict, place);
  if (!frame) return frame.error();
  return ModelKey{*frame, model};
}

/// Reads the `node.key_count` keys of a node, and sorts them by frame.
template <class Key>
Status parse_keys(ChunkReader& chunk, Result<Key> (*parse)(ChunkReader&, std::size_t), std::vector<Key>& keys,
                  Node& node, Document& out) {
  node.first_key = keys.size();
  for (std::size_t i = 0; i < node.key_count; ++i) {
    const Result<Key> key = parse(chunk, i);
    if (!key) return key.error();
    out.last_frame = std::max(out.last_frame, key->frame);
    keys.push_back(*key);
  }
  const auto first = keys.begin() + static_cast<std::ptrdiff_t>(node.first_key);
  std::stable_sort(first, keys.end(), [](const Key& a, const Key& b) { return a.frame < b.frame; });
  return {};
}

/// Parses the common start of all nodes: an id and attributes.
Node parse_node(ChunkReader& chunk, NodeKind kind) {
  Node node;
  node.kind = kind;
  node.offset = chunk.offset();
  node.id = chunk.i32();
  const Dict attributes = chunk.dict();
  node.name = attributes.get("_name");
  node.hidden = attributes.is_set("_hidden");
  node.loops = attributes.is_set("_loop");
  return node;
}

}  // namespace

std::optional<std::int32_t> frame_of_key(std::string_view text, std::size_t place) {
  if (text.empty()) return static_cast<std::int32_t>(place);
  const std::optional<std::int64_t> frame = parse_integer(text);
  if (!frame.has_value() || *frame < 0 || *frame > kMaxInt32) return std::nullopt;
  return static_cast<std::int32_t>(*frame);
}

std::optional<AxisOrientation> parse_orientation(std::string_view text) {
  if (text.empty()) return AxisOrientation{};
  const std::optional<std::int64_t> byte = parse_integer(text);
  if (!byte.has_value() || *byte < 0 || *byte > 255) return std::nullopt;
  return orientation_from_byte(static_cast<std::uint8_t>(*byte));
}

/// Reads three integers separated by blanks.
std::optional<IVec3> parse_translation(std::string_view text) {
  IVec3 translation{0};
  std::string_view rest = text;
  for (int axis = 0; axis < 3 && !text.empty(); ++axis) {
    rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
    const std::size_t length = std::min(rest.find(' '), rest.size());
    const std::optional<std::int64_t> value = parse_integer(rest.substr(0, length));
    if (!value.has_value() || *value < kMinInt32 || *value > kMaxInt32) return std::nullopt;
    translation[axis] = static_cast<int>(*value);
    rest.remove_prefix(length);
  }
  if (rest.find_first_not_of(' ') != std::string_view::npos) return std::nullopt;
  return translation;
}

bool is_animated(const Document& document) {
  if (document.nodes.empty()) return document.models.size() > 1;
  return std::ranges::any_of(document.nodes, [](const Node& node) { return node.key_count > 1; });
}

std::int64_t last_frame(const Document& document) {
  if (!document.nodes.empty()) return document.last_frame;
  return std::max<std::int64_t>(static_cast<std::int64_t>(document.models.size()) - 1, 0);
}

Status parse_transform(ChunkReader& chunk, Document& out) {
  Node node = parse_node(chunk, NodeKind::Transform);
  const std::int32_t child = chunk.i32();
  static_cast<void>(chunk.i32());  // reserved
  node.layer = chunk.i32();
  node.key_count = chunk.count(kLeastFrameBytes);
  if (chunk.failed()) return chunk.too_short();
  node.first_child = out.children.size();
  node.child_count = 1;
  out.children.push_back(child);
  if (Status status = parse_keys(chunk, &parse_transform_key, out.transform_keys, node, out); !status) return status;
  if (node.key_count == 0) {
    out.transform_keys.emplace_back();
    node.key_count = 1;
  }
  out.nodes.push_back(node);
  return {};
}

Status parse_group(ChunkReader& chunk, Document& out) {
  Node node = parse_node(chunk, NodeKind::Group);
  node.first_child = out.children.size();
  node.child_count = chunk.count(kChildBytes);
  for (std::size_t i = 0; i < node.child_count; ++i) out.children.push_back(chunk.i32());
  if (chunk.failed()) return chunk.too_short();
  out.nodes.push_back(node);
  return {};
}

Status parse_shape(ChunkReader& chunk, Document& out) {
  Node node = parse_node(chunk, NodeKind::Shape);
  node.key_count = chunk.count(kLeastModelBytes);
  if (chunk.failed()) return chunk.too_short();
  if (node.key_count == 0) return chunk.error("has no model");
  if (Status status = parse_keys(chunk, &parse_model_key, out.model_keys, node, out); !status) return status;
  out.nodes.push_back(node);
  return {};
}

Status parse_layer(ChunkReader& chunk, Document& out) {
  Layer layer;
  layer.id = chunk.i32();
  const Dict attributes = chunk.dict();
  layer.hidden = attributes.is_set("_hidden");
  layer.name = attributes.get("_name");
  if (chunk.failed()) return chunk.too_short();
  out.layers.push_back(layer);
  return {};
}

Status parse_animation_range(ChunkReader& chunk, Document& out) {
  const Dict dict = chunk.dict();
  if (chunk.failed()) return chunk.too_short();
  const std::string_view range = dict.get("_anim_range");
  const std::optional<std::int64_t> last = parse_integer(range.substr(range.rfind(' ') + 1));
  if (last.has_value() && *last > out.last_frame && *last <= kMaxInt32) {
    out.last_frame = static_cast<std::int32_t>(*last);
  }
  return {};
}

namespace {

constexpr AxisOrientation kQuoinFromVox = AxisOrientation::quarter_turns(0, -1);
constexpr AxisOrientation kVoxFromQuoin = AxisOrientation::quarter_turns(0, 1);
constexpr AxisOrientation kMirrorX = AxisOrientation::mirror(0);

DQuat quaternion(const AxisOrientation& rotation) {
  DQuat q = glm::normalize(glm::quat_cast(rotation.matrix()));
  if (q.w < 0.0) q = -q;
  // Adding zero turns -0.0 into 0.0.
  return {q.w + 0.0, q.x + 0.0, q.y + 0.0, q.z + 0.0};
}

}  // namespace

Offset operator*(const AxisOrientation& orientation, const Offset& offset) {
  Offset turned{};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t value = offset[static_cast<std::size_t>(orientation.source_axis(axis))];
    turned[static_cast<std::size_t>(axis)] = orientation.is_negated(axis) ? -value : value;
  }
  return turned;
}

Motion operator*(const Motion& a, const Motion& b) {
  Motion both{a.orientation * b.orientation, a.orientation * b.translation};
  for (std::size_t axis = 0; axis < 3; ++axis) both.translation[axis] += a.translation[axis];
  return both;
}

Motion inverse(const Motion& motion) {
  Motion back{motion.orientation.inverse(), {}};
  back.translation = back.orientation * motion.translation;
  for (std::int64_t& value : back.translation) value = -value;
  return back;
}

std::optional<AxisOrientation> orientation_from_byte(std::uint8_t byte) {
  const std::array<int, 2> columns = {byte & 3, byte >> 2 & 3};
  if (columns[0] > 2 || columns[1] > 2 || columns[0] == columns[1]) return std::nullopt;
  const std::array<int, 3> column_of_row = {columns[0], columns[1], 3 - columns[0] - columns[1]};
  glm::dmat3 matrix(0.0);
  for (int row = 0; row < 3; ++row) {
    matrix[column_of_row[static_cast<std::size_t>(row)]][row] = (byte >> (4 + row) & 1) != 0 ? -1.0 : 1.0;
  }
  return AxisOrientation::near_matrix(matrix, 0.0);
}

std::uint8_t byte_from_orientation(const AxisOrientation& orientation) {
  int byte = orientation.source_axis(0) | orientation.source_axis(1) << 2;
  for (int row = 0; row < 3; ++row) byte |= int{orientation.is_negated(row)} << (4 + row);
  return static_cast<std::uint8_t>(byte);
}

InstanceTurn turn_from_orientation(const AxisOrientation& in_vox) {
  const AxisOrientation in_quoin = kQuoinFromVox * in_vox * kVoxFromQuoin;
  const bool mirrored = in_quoin.is_mirrored();
  return {quaternion(mirrored ? in_quoin * kMirrorX : in_quoin), mirrored};
}

std::optional<AxisOrientation> orientation_from_turn(const InstanceTurn& turn) {
  constexpr double kRounding = 1e-6;
  if (!(std::abs(glm::length(turn.rotation) - 1.0) <= kRounding)) return std::nullopt;
  const auto rotation = AxisOrientation::near_matrix(glm::mat3_cast(turn.rotation), kRounding);
  if (!rotation) return std::nullopt;
  const AxisOrientation in_quoin = turn.mirrored ? *rotation * kMirrorX : *rotation;
  return kVoxFromQuoin * in_quoin * kQuoinFromVox;
}

Offset quoin_from_vox(const Offset& offset) {
  return kQuoinFromVox * offset;
}
Offset vox_from_quoin(const Offset& offset) {
  return kVoxFromQuoin * offset;
}

}  // namespace quoin::vox

#include "io/vox_chunks.h"

#include <algorithm>

#include "io/byte_reader.h"
#include "io/text.h"
#include "io/vox_chunk_reader.h"

namespace quoin::vox {

namespace {

constexpr std::size_t kFileHeaderBytes = 8;
constexpr std::size_t kChunkHeaderBytes = 12;
constexpr std::string_view kMagic = "VOX ";
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

/// SLAB6's .vox: three sizes, that many bytes, and a palette of 768.
bool is_slab6(std::span<const std::byte> bytes) {
  constexpr std::uint64_t kPaletteBytes = 768;
  ByteReader reader(bytes);
  const std::uint64_t x = reader.u32();
  const std::uint64_t y = reader.u32();
  const std::uint64_t z = reader.u32();
  // Below 2^16 each, so that the product cannot overflow.
  if (reader.failed() || x == 0 || y == 0 || z == 0 || (x | y | z) >= (1U << 16U)) return false;
  return bytes.size() == 12 + x * y * z + kPaletteBytes;
}

Status check_signature(std::span<const std::byte> bytes) {
  if (bytes.empty()) return fail(ErrorCode::BadFormat, "the file is empty");
  if (text_of(bytes, 4) == kMagic) return {};
  if (text_of(bytes, kLfsPointer.size()) == kLfsPointer) {
    return fail(ErrorCode::Unsupported, "this is a git-LFS pointer, not the file that it stands for");
  }
  if (is_slab6(bytes)) {
    return fail(ErrorCode::Unsupported, "this is SLAB6's .vox format, not MagicaVoxel's of the same name");
  }
  return bad_at(0, "a MagicaVoxel file starts with \"VOX \", this one with \"" + printable(text_of(bytes, 4)) + "\"");
}

/// Reads a header and checks that what it claims lies before `end`.
Result<ChunkHeader> read_header(std::span<const std::byte> bytes, std::size_t begin, std::size_t end) {
  ByteReader reader(bytes, begin, end);
  ChunkHeader header;
  header.offset = begin;
  header.id = reader.text(4);
  header.content_bytes = reader.u32();
  header.children_bytes = reader.u32();
  if (reader.failed()) return bad_at(begin, "a chunk's header is cut off");
  const std::uint64_t claimed = header.content_bytes + header.children_bytes;
  if (claimed > reader.remaining()) {
    return bad_at(begin, "chunk " + printable(header.id) + " claims " + std::to_string(claimed) + " bytes, but " +
                             std::to_string(reader.remaining()) + " are left");
  }
  return header;
}

Status parse_size(ChunkReader& chunk, Document& out) {
  std::array<std::uint32_t, 3> size{};
  for (std::uint32_t& edge : size) edge = chunk.u32();
  if (chunk.failed()) return chunk.too_short();
  const bool fits = std::ranges::all_of(size, [](std::uint32_t edge) { return edge <= kMaxModelEdge; });
  if (!fits) {
    return chunk.error("claims " + std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " +
                       std::to_string(size[2]) + " voxels");
  }
  if (std::ranges::find(size, 0U) != size.end()) {
    out.warnings.push_back("model " + std::to_string(out.models.size()) + " has no extent on an axis; 1 is taken");
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

Status parse_palette(ChunkReader& chunk, Document& out) {
  if (chunk.remaining() < kColours * 4) return chunk.too_short();
  out.palette = chunk.take(kColours * 4);
  return {};
}

Status parse_index_map(ChunkReader& chunk, Document& out) {
  if (chunk.remaining() < kColours) return chunk.too_short();
  out.index_map = chunk.take(kColours);
  return {};
}

/// Whether the last SIZE still waits for its XYZI.
struct ModelState {
  bool has_size = false;
};

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
  if (id == "RGBA") return parse_palette(chunk, out);
  if (id == "IMAP") return parse_index_map(chunk, out);
  if (id == "MATL") return parse_material(chunk, out);
  if (id == "MATT") return parse_old_material(chunk, out);
  if (id == "nTRN") return parse_transform(chunk, out);
  if (id == "nGRP") return parse_group(chunk, out);
  if (id == "nSHP") return parse_shape(chunk, out);
  if (id == "LAYR") return parse_layer(chunk, out);
  if (id == "META") return parse_animation_range(chunk, out);
  return {};  // PACK repeats the number of models; cameras, lights and notes have no place in a scene.
}

Status parse_chunks(std::span<const std::byte> bytes, std::size_t begin, std::size_t end, Document& out) {
  ModelState state;
  std::size_t at = begin;
  while (at < end) {
    const Result<ChunkHeader> header = read_header(bytes, at, end);
    if (!header) return tl::unexpected(header.error());
    const std::size_t content = at + kChunkHeaderBytes;
    ChunkReader chunk(bytes, header->id, at, content, content + header->content_bytes);
    if (Status status = parse_chunk(chunk, state, out); !status) return status;
    at = content + header->content_bytes + header->children_bytes;
  }
  if (state.has_size) return bad_at(out.models.back().offset, "chunk SIZE has no XYZI after it");
  return {};
}

}  // namespace

tl::unexpected<Error> bad_at(std::uint64_t offset, std::string message) {
  return fail(ErrorCode::BadFormat, std::move(message), {}, offset);
}

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
  if (Status status = check_signature(bytes); !status) return tl::unexpected(status.error());
  Document document;
  ByteReader reader(bytes);
  static_cast<void>(reader.u32());
  document.version = reader.i32();
  if (reader.failed()) return bad_at(4, "the version number is cut off");
  if (document.version != 150 && document.version != 200) {
    document.warnings.push_back("version " + std::to_string(document.version) + " is unknown; read as 150 and 200 are");
  }
  const Result<ChunkHeader> main = read_header(bytes, kFileHeaderBytes, bytes.size());
  if (!main) return tl::unexpected(main.error());
  if (main->id != "MAIN") {
    return bad_at(kFileHeaderBytes, "the first chunk must be MAIN, not \"" + printable(main->id) + "\"");
  }
  const std::size_t begin = kFileHeaderBytes + kChunkHeaderBytes + main->content_bytes;
  const std::size_t end = begin + main->children_bytes;
  if (Status status = parse_chunks(bytes, begin, end, document); !status) return tl::unexpected(status.error());
  if (end < bytes.size()) {
    document.warnings.push_back("the last " + std::to_string(bytes.size() - end) + " bytes lie outside MAIN; skipped");
  }
  return document;
}

}  // namespace quoin::vox

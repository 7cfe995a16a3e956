#include "store/chunk/chunk_body.h"

#include <array>
#include <cstring>
#include <new>
#include <string>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include <zstd.h>
#include <zstd_errors.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

namespace quoin::store {
namespace {

constexpr std::array<char, 4> kMagic = {'Q', 'C', 'B', '1'};
constexpr std::size_t kMagicAt = 8;
constexpr std::size_t kSectionsAt = 12;
constexpr std::size_t kContentBytesAt = 40;
// docs/decisions/archive/102-chunks-on-disk.md
constexpr int kCompressionLevel = 1;
// Larger buffers are freed after use.
constexpr std::size_t kKeptBytes = std::size_t{4} << 20;

std::uint64_t checksum_of(std::span<const std::byte> body) {
  QUOIN_ASSERT(body.size() >= sizeof(std::uint64_t), "a body with a checksum");
  return XXH3_64bits(body.data() + sizeof(std::uint64_t), body.size() - sizeof(std::uint64_t));
}

Error fault(const std::string& what, std::size_t at) {
  return make_error(ErrorCode::BadFormat, what, {}, at);
}

std::string text_of(const ChunkAddress& place) {
  return "chunk (" + std::to_string(place.chunk.x) + ", " + std::to_string(place.chunk.y) + ", " +
         std::to_string(place.chunk.z) + ") of level " + std::to_string(place.level) + " of grid " +
         std::to_string(place.grid);
}

/// Returns an upper bound of the content size with these sections.
std::size_t max_content(std::uint8_t sections) {
  return ((sections & chunk_sections::kVoxels) != 0 ? kMaxVoxelSection : 0) +
         ((sections & chunk_sections::kData) != 0 ? kMaxDataSection : 0) +
         ((sections & chunk_sections::kDensities) != 0 ? kMaxDensitySection : 0);
}

Status check_magic(std::span<const std::byte> body) {
  if (std::memcmp(body.data() + kMagicAt, kMagic.data(), kMagic.size() - 1) != 0) {
    return fault("not a chunk body", kMagicAt);
  }
  const auto version = std::to_integer<char>(body[kMagicAt + kMagic.size() - 1]);
  if (version == kMagic.back()) return {};
  return make_error(ErrorCode::Unsupported, "the chunk has a later format version", {}, kMagicAt + kMagic.size() - 1);
}

Status check_sections(const ChunkBodyHeader& header, std::size_t stored_bytes) {
  using namespace chunk_sections;
  constexpr std::uint8_t kKnown = kVoxels | kData | kDensities | kCompressed;
  const bool is_compressed = (header.sections & kCompressed) != 0;
  const bool has_content = (header.sections & (kVoxels | kDensities)) != 0;
  if ((header.sections & ~kKnown) != 0 || (has_content ? header.content_bytes == 0 : header.sections != 0) ||
      ((header.sections & kData) != 0 && (header.sections & kVoxels) == 0)) {
    return fault("invalid sections " + std::to_string(header.sections), kSectionsAt);
  }
  if (header.content_bytes > max_content(header.sections) || (!is_compressed && header.content_bytes != stored_bytes) ||
      (is_compressed && header.content_bytes <= stored_bytes)) {
    return fault("invalid content size of " + std::to_string(header.content_bytes) + " bytes", kContentBytesAt);
  }
  return {};
}

}  // namespace

void put_checksum(std::span<std::byte> body) {
  QUOIN_ASSERT(body.size() >= kChunkBodyHeader, "a whole header");
  const std::uint64_t checksum = checksum_of(body);
  for (std::size_t i = 0; i < sizeof(checksum); ++i) body[i] = static_cast<std::byte>(checksum >> (8 * i));
}

Result<ChunkBodyHeader> read_header(std::span<const std::byte> body) {
  if (body.size() < kChunkBodyHeader) return fault("unexpected end", body.size());
  if (auto status = check_magic(body); !status) return status.error();
  if (number_at<std::uint64_t>(body.data()) != checksum_of(body)) return fault("wrong checksum", 0);
  ContentReader reader(body.subspan(kSectionsAt, kChunkBodyHeader - kSectionsAt));
  ChunkBodyHeader header;
  header.sections = reader.take<std::uint8_t>();
  header.place.level = reader.take<std::uint8_t>();
  if (reader.take<std::uint16_t>() != 0) return fault("reserved bytes are not 0", kSectionsAt + 2);
  header.place.grid = reader.take<std::uint32_t>();
  for (int axis = 0; axis < 3; ++axis)
    header.place.chunk[axis] = static_cast<std::int32_t>(reader.take<std::uint32_t>());
  header.revision = reader.take<std::uint64_t>();
  header.content_bytes = reader.take<std::uint32_t>();
  if (auto status = check_sections(header, body.size() - kChunkBodyHeader); !status) return status.error();
  return header;
}

struct ChunkEncoder::Compressor {
  Compressor() : context(ZSTD_createCCtx()) {
    if (context == nullptr) throw std::bad_alloc();
  }
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;
  ~Compressor() { ZSTD_freeCCtx(context); }

  ZSTD_CCtx* context;
};

ChunkEncoder::ChunkEncoder() : compressor_(std::make_unique<Compressor>()) {}
ChunkEncoder::ChunkEncoder(ChunkEncoder&&) noexcept = default;
ChunkEncoder& ChunkEncoder::operator=(ChunkEncoder&&) noexcept = default;
ChunkEncoder::~ChunkEncoder() = default;

Status ChunkEncoder::encode(const ChunkAddress& place, std::uint64_t revision, const Chunk& voxels,
                            const DensityChunk* densities, BlockVector<std::byte>& out) {
  out.clear();
  content_.clear();
  std::uint8_t sections = 0;
  if (voxels.non_air_count() != 0) {
    sections |= chunk_sections::kVoxels;
    voxel_writer_.write(voxels, content_);
  }
  if (voxels.data_count() != 0) {
    sections |= chunk_sections::kData;
    if (auto status = write_placed_data(voxels, content_); !status) return status;
  }
  if (densities != nullptr) {
    sections |= chunk_sections::kDensities;
    density_writer_.write(*densities, voxel_writer_, content_);
  }
  QUOIN_ASSERT(content_.size() <= kMaxChunkContent, "at most the content that a reader accepts");
  put_number(out, std::uint64_t{0});
  for (const char letter : kMagic) out.push_back(static_cast<std::byte>(letter));
  put_number(out, sections);
  put_number(out, place.level);
  put_number(out, std::uint16_t{0});
  put_number(out, place.grid);
  for (int axis = 0; axis < 3; ++axis) put_number(out, static_cast<std::uint32_t>(place.chunk[axis]));
  put_number(out, revision);
  put_number(out, static_cast<std::uint32_t>(content_.size()));
  QUOIN_ASSERT(out.size() == kChunkBodyHeader, "the header");
  if (compress(out)) {
    out[kSectionsAt] |= static_cast<std::byte>(chunk_sections::kCompressed);
  } else {
    out.insert(out.end(), content_.begin(), content_.end());
  }
  put_checksum(out);
  if (content_.capacity() > kKeptBytes) content_ = {};
  return {};
}

// Appends the compressed content if it is smaller.
bool ChunkEncoder::compress(BlockVector<std::byte>& out) {
  const std::size_t begin = out.size();
  if (content_.empty()) return false;
  out.resize(begin + ZSTD_compressBound(content_.size()));
  const std::size_t bytes = ZSTD_compressCCtx(compressor_->context, out.data() + begin, out.size() - begin,
                                              content_.data(), content_.size(), kCompressionLevel);
  if (ZSTD_isError(bytes) != 0 && ZSTD_getErrorCode(bytes) == ZSTD_error_memory_allocation) throw std::bad_alloc();
  QUOIN_ASSERT(ZSTD_isError(bytes) == 0, "room for incompressible content");
  const bool is_smaller = bytes < content_.size();
  out.resize(is_smaller ? begin + bytes : begin);
  return is_smaller;
}

struct ChunkDecoder::Expander {
  Expander() : context(ZSTD_createDCtx()) {
    if (context == nullptr) throw std::bad_alloc();
  }
  Expander(const Expander&) = delete;
  Expander& operator=(const Expander&) = delete;
  ~Expander() { ZSTD_freeDCtx(context); }

  ZSTD_DCtx* context;
};

ChunkDecoder::ChunkDecoder() : expander_(std::make_unique<Expander>()) {}
ChunkDecoder::ChunkDecoder(ChunkDecoder&&) noexcept = default;
ChunkDecoder& ChunkDecoder::operator=(ChunkDecoder&&) noexcept = default;
ChunkDecoder::~ChunkDecoder() = default;

Result<std::span<const std::byte>> ChunkDecoder::impl_of(const ChunkBodyHeader& header,
                                                         std::span<const std::byte> body) {
  QUOIN_ASSERT(body.size() >= kChunkBodyHeader, "a body with a header");
  const auto stored = body.subspan(kChunkBodyHeader);
  if ((header.sections & chunk_sections::kCompressed) == 0) return stored;
  // Checked before memory is allocated; the encoder always stores the size in the frame.
  if (ZSTD_getFrameContentSize(stored.data(), stored.size()) != header.content_bytes) {
    return fault("not a zstd frame of " + std::to_string(header.content_bytes) + " bytes", kChunkBodyHeader);
  }
  content_.resize(header.content_bytes);
  const std::size_t bytes =
      ZSTD_decompressDCtx(expander_->context, content_.data(), content_.size(), stored.data(), stored.size());
  if (ZSTD_isError(bytes) != 0) {
    if (ZSTD_getErrorCode(bytes) == ZSTD_error_memory_allocation) throw std::bad_alloc();
    return fault(std::string("zstd: ") + ZSTD_getErrorName(bytes), kChunkBodyHeader);
  }
  if (bytes != content_.size()) return fault("zstd: unexpected end", kChunkBodyHeader);
  return std::span<const std::byte>(content_);
}

Result<StoredChunk> ChunkDecoder::read_sections(const ChunkBodyHeader& header, std::span<const std::byte> content,
                                                const ChunkLimits& limits) {
  ContentReader reader(content);
  StoredChunk chunk;
  if ((header.sections & chunk_sections::kVoxels) != 0) {
    auto voxels = voxel_reader_.read(reader, limits.types->size());
    if (!voxels) return voxels.error();
    chunk.voxels = std::move(*voxels);
  }
  if ((header.sections & chunk_sections::kData) != 0) {
    if (auto status = read_placed_data(reader, *limits.types, chunk.voxels); !status) return status.error();
  }
  if ((header.sections & chunk_sections::kDensities) != 0) {
    auto densities = density_reader_.read(reader, voxel_reader_, limits.types->size(), limits.band);
    if (!densities) return densities.error();
    chunk.densities = std::move(*densities);
  }
  if (!reader.is_at_end()) return ContentReader::fault("extra bytes after the last section", reader.at());
  return chunk;
}

Result<StoredChunk> ChunkDecoder::decode(const ChunkAddress& expected, std::span<const std::byte> body,
                                         const ChunkLimits& limits) {
  QUOIN_ASSERT(limits.types != nullptr && limits.band > 0.0F, "types, and a positive band");
  const auto header = read_header(body);
  if (!header) return header.error();
  if (header->place != expected) {
    return fault("it is " + text_of(header->place) + ", not " + text_of(expected), kSectionsAt);
  }
  const auto content = impl_of(*header, body);
  if (!content) return content.error();
  auto chunk = read_sections(*header, *content, limits);
  if (content_.capacity() > kKeptBytes) content_ = {};
  if (chunk) return chunk;
  const bool is_compressed = (header->sections & chunk_sections::kCompressed) != 0;
  Error error = chunk.error();
  const std::size_t at = error.byte_offset.value_or(0);
  if (is_compressed) error.message = "byte " + std::to_string(at) + " of the content: " + error.message;
  error.byte_offset = kChunkBodyHeader + (is_compressed ? 0 : at);
  return error;
}

}  // namespace quoin::store

#include "io/byte_stream.h"

#include <quoin/core/assert.h>

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <string>

namespace quoin {

namespace {

// A match of 258 bytes takes at least two bits (RFC 1951).
constexpr std::uint64_t kMaxDeflateRatio = 1032;

// zlib counts in 32 bits.
constexpr std::size_t kMaxAtOnce = std::size_t{1} << 30;

// The window bits of deflate. zlib adds 16 for gzip headers and trailers.
constexpr int kWindow = 15;
constexpr int kGzipWindow = kWindow + 16;

}  // namespace

bool begins_gzip(std::span<const std::byte> bytes) {
  return bytes.size() >= 2 && bytes[0] == std::byte{0x1F} && bytes[1] == std::byte{0x8B};
}

struct ByteStream::Inflater {
  explicit Inflater(Compression compression) : has_members(compression == Compression::Gzip) {
    const int window = has_members ? kGzipWindow : compression == Compression::Deflate ? -kWindow : kWindow;
    if (inflateInit2(&state, window) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&state); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  z_stream state{};
  bool has_members;
  bool is_done = false;
};

ByteStream::ByteStream(std::span<const std::byte> file, std::size_t begin, Compression compression)
    : file_(file), begin_(begin), position_(begin) {
  QUOIN_ASSERT(begin <= file.size(), "the stream begins in the file");
  if (compression != Compression::None) inflater_ = std::make_unique<Inflater>(compression);
}

ByteStream::~ByteStream() = default;

std::uint64_t ByteStream::max_bytes() const {
  QUOIN_ASSERT(begin_ <= file_.size(), "a stream that begins in the file");
  const std::uint64_t held = file_.size() - begin_;
  return inflater_ ? held * kMaxDeflateRatio : held;
}

Result<std::size_t> ByteStream::read(std::span<std::byte> out) {
  if (!inflater_) {
    QUOIN_ASSERT(position_ <= file_.size(), "a position within the file");
    const std::size_t count = std::min(out.size(), file_.size() - position_);
    if (count > 0) std::memcpy(out.data(), file_.data() + position_, count);
    position_ += count;
    return count;
  }
  std::size_t filled = 0;
  while (filled < out.size() && !inflater_->is_done) {
    auto count = inflate_some(out.subspan(filled, std::min(out.size() - filled, kMaxAtOnce)));
    if (!count) return count;
    filled += *count;
  }
  return filled;
}

/// Calls inflate once. It may produce no output and still make progress.
Result<std::size_t> ByteStream::inflate_some(std::span<std::byte> out) {
  QUOIN_ASSERT(position_ <= file_.size() && !out.empty(), "bytes of the file, and room for some");
  z_stream& state = inflater_->state;
  const std::size_t offered = std::min(file_.size() - position_, kMaxAtOnce);
  // zlib only reads through this pointer, which is not const for historical reasons.
  state.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(file_.data() + position_));
  state.avail_in = static_cast<uInt>(offered);
  state.next_out = reinterpret_cast<Bytef*>(out.data());
  state.avail_out = static_cast<uInt>(out.size());
  const int outcome = inflate(&state, Z_NO_FLUSH);
  const std::size_t written = out.size() - state.avail_out;
  position_ += offered - state.avail_in;
  if (outcome == Z_MEM_ERROR) throw std::bad_alloc();
  if (outcome == Z_STREAM_END) {
    if (auto next = begin_next_member(); !next) return next.error();
    return written;
  }
  if (outcome == Z_BUF_ERROR || (outcome == Z_OK && written == 0 && position_ == file_.size())) {
    is_cut_off_ = true;
    return make_error(ErrorCode::BadFormat, "the compressed data is cut off", {}, file_.size());
  }
  if (outcome == Z_OK) return written;
  const std::string why = state.msg != nullptr ? std::string(" (") + state.msg + ")" : "";
  return make_error(ErrorCode::BadFormat, "the compressed data is damaged" + why, {}, position_);
}

Status ByteStream::begin_next_member() {
  if (!inflater_->has_members || !begins_gzip(file_.subspan(position_))) {
    inflater_->is_done = true;
    return {};
  }
  if (inflateReset(&inflater_->state) == Z_OK) return {};
  return make_error(ErrorCode::BadFormat, "the compressed data is damaged", {}, position_);
}

Result<std::uint64_t> ByteStream::skip(std::uint64_t count) {
  if (!inflater_) {
    const std::uint64_t skipped = std::min<std::uint64_t>(count, file_.size() - position_);
    position_ += static_cast<std::size_t>(skipped);
    return skipped;
  }
  constexpr std::uint64_t kPiece = 1 << 16;
  std::vector<std::byte> piece(static_cast<std::size_t>(std::min(count, kPiece)));
  std::uint64_t skipped = 0;
  while (skipped < count) {
    const auto wanted = static_cast<std::size_t>(std::min(count - skipped, kPiece));
    const auto read_now = read(std::span(piece).first(wanted));
    if (!read_now) return read_now.error();
    skipped += *read_now;
    if (*read_now < wanted) break;
  }
  return skipped;
}

std::vector<std::byte> gzipped(std::span<const std::byte> bytes, int level) {
  QUOIN_ASSERT(bytes.size() < (std::size_t{1} << 31), "fewer than 2^31 bytes");
  constexpr int kMemory = 8;  // zlib's default
  z_stream state{};
  if (deflateInit2(&state, level, Z_DEFLATED, kGzipWindow, kMemory, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  std::vector<std::byte> out(deflateBound(&state, static_cast<uLong>(bytes.size())));
  state.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes.data()));
  state.avail_in = static_cast<uInt>(bytes.size());
  state.next_out = reinterpret_cast<Bytef*>(out.data());
  state.avail_out = static_cast<uInt>(out.size());
  [[maybe_unused]] const int outcome = deflate(&state, Z_FINISH);
  out.resize(state.total_out);
  deflateEnd(&state);
  QUOIN_ASSERT(outcome == Z_STREAM_END, "deflateBound is a bound");
  return out;
}

Result<std::vector<std::byte>> first_bytes(std::span<const std::byte> file, std::size_t most) {
  const bool is_gzip = begins_gzip(file);
  ByteStream stream(file, 0, is_gzip ? Compression::Gzip : Compression::None);
  std::vector<std::byte> bytes(static_cast<std::size_t>(std::min<std::uint64_t>(most, stream.max_bytes())));
  const auto count = stream.read(bytes);
  if (!count) return count.error();
  bytes.resize(*count);
  return bytes;
}

}  // namespace quoin

#include "io/print/zip_file.h"

#include <array>
#include <utility>

#include <zlib.h>

#include <quoin/core/assert.h>

namespace quoin {

namespace {

constexpr std::uint64_t kMost = 0xFFFF'FFFF;
constexpr std::size_t kLocalHeader = 30;
// Offset in the local header of the checksum and both sizes, which are known only at the end.
constexpr std::size_t kSumAt = 14;

void put_number(std::vector<std::byte>& to, std::uint64_t value, int bytes) {
  // `bytes` may exceed the size of a number, to write zeros.
  for (int i = 0; i < bytes; ++i) to.push_back(i < 8 ? static_cast<std::byte>(value >> (8 * i)) : std::byte{0});
}

void set_number(std::vector<std::byte>& in, std::uint64_t at, std::uint64_t value) {
  for (std::size_t i = 0; i < 4; ++i) in[static_cast<std::size_t>(at) + i] = static_cast<std::byte>(value >> (8 * i));
}

// 1980-01-01, the first day of the format.
constexpr std::uint32_t kDate = 0x0021;

void put_text(std::vector<std::byte>& to, std::string_view text) {
  for (const char c : text) to.push_back(static_cast<std::byte>(c));
}

}  // namespace

struct ZipFile::Deflater {
  z_stream stream{};
  Deflater() {
    // Without a zlib header. Fails only if memory runs out.
    const int made = deflateInit2(&stream, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    if (made != Z_OK) throw std::bad_alloc();
  }
  ~Deflater() { deflateEnd(&stream); }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;

  void run(std::string_view text, int flush, std::vector<std::byte>& out) {
    std::array<Bytef, 1 << 16> room;
    // zlib only reads through this pointer.
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(text.data()));  // NOLINT
    stream.avail_in = static_cast<uInt>(text.size());
    do {
      stream.next_out = room.data();
      stream.avail_out = static_cast<uInt>(room.size());
      deflate(&stream, flush);
      const std::size_t got = room.size() - stream.avail_out;
      const auto* const first = reinterpret_cast<const std::byte*>(room.data());
      out.insert(out.end(), first, first + got);
    } while (stream.avail_out == 0);
  }
};

ZipFile::ZipFile() = default;
ZipFile::~ZipFile() = default;

void ZipFile::begin(std::string name) {
  end();
  Entry entry;
  entry.name = std::move(name);
  entry.at = bytes_.size();
  put_number(bytes_, 0x0403'4B50, 4);
  put_number(bytes_, 20, 2);  // needs version 2.0
  put_number(bytes_, 0, 2);
  put_number(bytes_, Z_DEFLATED, 2);
  put_number(bytes_, 0, 2);
  put_number(bytes_, kDate, 2);
  put_number(bytes_, 0, 12);
  put_number(bytes_, entry.name.size(), 2);
  put_number(bytes_, 0, 2);
  put_text(bytes_, entry.name);
  entries_.push_back(std::move(entry));
  deflater_ = std::make_unique<Deflater>();
}

void ZipFile::put(std::string_view text) {
  QUOIN_ASSERT(deflater_ != nullptr, "a file has begun");
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  Entry& entry = entries_.back();
  for (; !text.empty(); text.remove_prefix(std::min(kPiece, text.size()))) {
    const std::string_view piece = text.substr(0, kPiece);
    entry.crc = static_cast<std::uint32_t>(
        crc32(entry.crc, reinterpret_cast<const Bytef*>(piece.data()), static_cast<uInt>(piece.size())));
    entry.size += piece.size();
    deflater_->run(piece, Z_NO_FLUSH, bytes_);
  }
}

void ZipFile::end() {
  if (deflater_ == nullptr) return;
  deflater_->run({}, Z_FINISH, bytes_);
  deflater_.reset();
  Entry& entry = entries_.back();
  entry.packed = bytes_.size() - entry.at - kLocalHeader - entry.name.size();
  set_number(bytes_, entry.at + kSumAt, entry.crc);
  set_number(bytes_, entry.at + kSumAt + 4, entry.packed);
  set_number(bytes_, entry.at + kSumAt + 8, entry.size);
}

Result<std::vector<std::byte>> ZipFile::take() {
  end();
  const std::uint64_t directory = bytes_.size();
  for (const Entry& entry : entries_) {
    if (entry.size > kMost || directory > kMost)
      return make_error(ErrorCode::LimitExceeded, "the zip file would have 4 GiB or more");
    put_number(bytes_, 0x0201'4B50, 4);
    put_number(bytes_, 20, 2);  // made by version 2.0
    put_number(bytes_, 20, 2);
    put_number(bytes_, 0, 2);
    put_number(bytes_, Z_DEFLATED, 2);
    put_number(bytes_, 0, 2);
    put_number(bytes_, kDate, 2);
    put_number(bytes_, entry.crc, 4);
    put_number(bytes_, entry.packed, 4);
    put_number(bytes_, entry.size, 4);
    put_number(bytes_, entry.name.size(), 2);
    put_number(bytes_, 0, 12);
    put_number(bytes_, entry.at, 4);
    put_text(bytes_, entry.name);
  }
  const std::uint64_t size = bytes_.size() - directory;
  put_number(bytes_, 0x0605'4B50, 4);
  put_number(bytes_, 0, 4);
  put_number(bytes_, entries_.size(), 2);
  put_number(bytes_, entries_.size(), 2);
  put_number(bytes_, size, 4);
  put_number(bytes_, directory, 4);
  put_number(bytes_, 0, 2);
  return std::move(bytes_);
}

}  // namespace quoin

#include <algorithm>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/volume/header.h"

#ifdef QUOIN_HAVE_BZIP2
#include <bzlib.h>
#endif

// NRRD encodings other than raw bytes: http://teem.sourceforge.net/nrrd/format.html#encoding.

namespace quoin::nrrd {

namespace {

Error bad(std::string message, std::size_t at) {
  return make_error(ErrorCode::BadFormat, std::move(message), {}, at);
}

/// Returns a text, shortened for a message, in quotation marks.
std::string quoted(std::string_view text) {
  constexpr std::size_t kMost = 40;
  // Appended piece by piece: GCC 12 warns of operator+ here.
  std::string shown = "\"";
  return shown.append(printable(text.substr(0, kMost))).append("\"");
}

template <class T>
void append(T value, std::endian order, std::vector<std::byte>& out) {
  std::array<std::byte, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  if (order != std::endian::native) std::ranges::reverse(raw);
  out.insert(out.end(), raw.begin(), raw.end());
}

/// Appends a number of a text. Returns false for a word that is not a number, or out of the type's range.
template <class T>
bool append_number(std::string_view word, std::endian order, std::vector<std::byte>& out) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || word.empty()) return false;
  append(value, order, out);
  return true;
}

using Append = bool (*)(std::string_view, std::endian, std::vector<std::byte>&);

Append appender(ScalarType type) {
  switch (type) {
    case ScalarType::UInt8:
      return append_number<std::uint8_t>;
    case ScalarType::Int8:
      return append_number<std::int8_t>;
    case ScalarType::UInt16:
      return append_number<std::uint16_t>;
    case ScalarType::Int16:
      return append_number<std::int16_t>;
    case ScalarType::UInt32:
      return append_number<std::uint32_t>;
    case ScalarType::Int32:
      return append_number<std::int32_t>;
    case ScalarType::UInt64:
      return append_number<std::uint64_t>;
    case ScalarType::Int64:
      return append_number<std::int64_t>;
    case ScalarType::Float32:
      return append_number<float>;
    case ScalarType::Float64:
      return append_number<double>;
  }
  return nullptr;
}

/// Reads numbers separated by blanks or commas.
Result<std::vector<std::byte>> decode_ascii(std::string_view text, std::size_t begin, const VolumeHeader& header) {
  constexpr std::string_view kBetween = " \t\r\n,";
  const Append append_one = appender(header.volume.type);
  QUOIN_ASSERT(append_one != nullptr && begin <= text.size(), "a known type, and values in the file");
  const std::uint64_t wanted = bytes_of_values(header);
  std::vector<std::byte> out;
  for (std::size_t at = text.find_first_not_of(kBetween, begin); at != std::string_view::npos && out.size() < wanted;) {
    const std::size_t end = std::min(text.find_first_of(kBetween, at), text.size());
    const std::string_view word = text.substr(at, end - at);
    if (!append_one(word, header.order, out)) {
      return bad(quoted(word).append(" is not a value of type ").append(name_of(header.volume.type)), at);
    }
    at = text.find_first_not_of(kBetween, end);
  }
  return out;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// Reads two digits per byte; blanks may be anywhere.
Result<std::vector<std::byte>> decode_hex(std::string_view text, std::size_t begin, const VolumeHeader& header) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::uint64_t wanted = bytes_of_values(header);
  std::vector<std::byte> out;
  int high = -1;
  for (std::size_t at = begin; at < text.size() && out.size() < wanted; ++at) {
    if (kBlanks.find(text[at]) != std::string_view::npos) continue;
    const int digit = hex_digit(text[at]);
    if (digit < 0) return bad(quoted(text.substr(at, 1)).append(" is not a hexadecimal digit"), at);
    if (high >= 0) out.push_back(static_cast<std::byte>(high << 4 | digit));
    high = high >= 0 ? -1 : digit;
  }
  return out;
}

#ifdef QUOIN_HAVE_BZIP2

/// Ends a bzip2 stream at the end of its scope.
struct Decompressor {
  bz_stream state{};
  Decompressor() {
    if (BZ2_bzDecompressInit(&state, 0, 0) != BZ_OK) throw std::bad_alloc();
  }
  ~Decompressor() { BZ2_bzDecompressEnd(&state); }
  Decompressor(const Decompressor&) = delete;
  Decompressor& operator=(const Decompressor&) = delete;
};

Result<std::vector<std::byte>> decode_bzip2(std::span<const std::byte> bytes, std::size_t begin,
                                            const VolumeHeader& header) {
  constexpr std::size_t kMaxAtOnce = std::size_t{1} << 30;
  const std::uint64_t wanted = header.skip + bytes_of_values(header);
  Decompressor decompressor;
  bz_stream& state = decompressor.state;
  std::vector<std::byte> out;
  std::size_t at = begin;
  for (int outcome = BZ_OK; out.size() < wanted && outcome != BZ_STREAM_END;) {
    constexpr std::size_t kStep = std::size_t{1} << 18;
    const std::size_t filled = out.size();
    out.resize(filled + static_cast<std::size_t>(std::min<std::uint64_t>(wanted - filled, std::max(kStep, filled))));
    const std::size_t offered = std::min(bytes.size() - at, kMaxAtOnce);
    const std::size_t room = std::min(out.size() - filled, kMaxAtOnce);
    // bzip2 only reads through this pointer.
    state.next_in = const_cast<char*>(reinterpret_cast<const char*>(bytes.data() + at));  // NOLINT
    state.avail_in = static_cast<unsigned>(offered);
    state.next_out = reinterpret_cast<char*>(out.data() + filled);
    state.avail_out = static_cast<unsigned>(room);
    outcome = BZ2_bzDecompress(&state);
    const std::size_t written = room - state.avail_out;
    const std::size_t taken = offered - state.avail_in;
    out.resize(filled + written);
    at += taken;
    QUOIN_ASSERT(written <= room && at <= bytes.size(), "no more than was offered");
    if (outcome != BZ_OK && outcome != BZ_STREAM_END) return bad("the compressed data is damaged", at);
    if (outcome == BZ_OK && written == 0 && taken == 0) return bad("the compressed data is cut off", at);
  }
  return out;
}

#else

Result<std::vector<std::byte>> decode_bzip2(std::span<const std::byte>, std::size_t begin, const VolumeHeader&) {
  return make_error(ErrorCode::Unsupported, "cannot read bzip2: Quoin was built without it (Debian: libbz2-dev)", {},
                    begin);
}

#endif

}  // namespace

Result<std::vector<std::byte>> decode_values(std::span<const std::byte> bytes, std::size_t begin,
                                             const VolumeHeader& header) {
  QUOIN_ASSERT(begin <= bytes.size(), "the values begin in the file");
  if (header.data_encoding == DataEncoding::Bzip2) return decode_bzip2(bytes, begin, header);
  const std::uint64_t skipped = begin + header.skip;
  if (skipped > bytes.size()) {
    return bad(
        "the values begin at byte " + std::to_string(skipped) + ", but the file has " + std::to_string(bytes.size()),
        begin);
  }
  const std::string_view text = text_of(bytes);
  return header.data_encoding == DataEncoding::Ascii ? decode_ascii(text, static_cast<std::size_t>(skipped), header)
                                                     : decode_hex(text, static_cast<std::size_t>(skipped), header);
}

}  // namespace quoin::nrrd

#include <quoin/core/assert.h>
#include <quoin/io/image_files.h>

#include <bit>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "core/bytes/text.h"
#include "io/image/image_codecs.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

constexpr bool is_blank(char c) {
  return c == ' ' || c == '\n' || c == '\r' || c == '\t';
}

/// Reads the words of a PFM header. Each ends at blanks, the last at exactly one blank.
class HeaderReader {
 public:
  explicit HeaderReader(std::span<const std::byte> bytes)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

  /// The offset of the last word, and the position where the search for the next one starts.
  [[nodiscard]] std::size_t word_at() const { return word_at_; }
  [[nodiscard]] std::size_t position() const { return position_; }

  /// Returns the next word and skips the one blank after it; empty at the end.
  std::string_view word() {
    while (position_ < text_.size() && is_blank(text_[position_])) ++position_;
    word_at_ = position_;
    // No valid number is longer, so files without blanks are not read to the end.
    constexpr std::size_t kLongest = 64;
    while (position_ < text_.size() && position_ - word_at_ < kLongest && !is_blank(text_[position_])) ++position_;
    const std::string_view found = text_.substr(word_at_, position_ - word_at_);
    if (position_ < text_.size() && is_blank(text_[position_])) ++position_;
    return found;
  }

 private:
  std::string_view text_;
  std::size_t position_ = 0;
  std::size_t word_at_ = 0;
};

struct Header {
  int width = 0;
  int height = 0;
  bool is_little_endian = true;
  std::size_t data_at = 0;
};

Error bad(std::string message, std::size_t at) {
  return make_error(ErrorCode::BadFormat, std::move(message), {}, at);
}

Result<int> read_size(HeaderReader& reader, const char* what) {
  const std::string_view word = reader.word();
  const auto size = parse_integer(word);
  constexpr std::int64_t kMost = 1 << 28;
  if (size && *size > 0 && *size <= kMost) return static_cast<int>(*size);
  return bad(std::string("the ") + what + " is \"" + printable(word) + "\"", reader.word_at());
}

Result<Header> read_header(std::span<const std::byte> bytes) {
  HeaderReader reader(bytes);
  const std::string_view magic = reader.word();
  if (magic == "PF") return make_error(ErrorCode::Unsupported, "a colour PFM; only greyscale PFM is supported", {}, 0);
  if (magic != "Pf" || reader.word_at() != 0) return bad("not a PFM: it does not begin with \"Pf\"", 0);
  Header header;
  const auto width = read_size(reader, "width");
  if (!width) return width.error();
  const auto height = read_size(reader, "height");
  if (!height) return height.error();
  const std::string_view word = reader.word();
  const auto scale = parse_float(word);
  if (!scale || *scale == 0.0F) return bad("the scale is \"" + printable(word) + "\"", reader.word_at());
  header = {*width, *height, *scale < 0.0F, reader.position()};
  return header;
}

float float_at(std::span<const std::byte> bytes, bool is_little_endian) {
  QUOIN_ASSERT(bytes.size() >= 4, "four bytes");
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t place = is_little_endian ? i : 3 - i;
    bits |= static_cast<std::uint32_t>(bytes[i]) << (8 * place);
  }
  return std::bit_cast<float>(bits);
}

}  // namespace

Result<FloatImage> read_pfm(std::span<const std::byte> bytes) {
  const auto header = read_header(bytes);
  if (!header) return header.error();
  const auto width = static_cast<std::size_t>(header->width);
  const auto height = static_cast<std::size_t>(header->height);
  QUOIN_ASSERT(header->data_at <= bytes.size(), "values that begin in the file");
  const std::size_t held = (bytes.size() - header->data_at) / 4;
  if (held < width * height) {
    return bad("it claims " + std::to_string(width) + " x " + std::to_string(height) + " pixels but holds " +
                   std::to_string(held),
               header->data_at);
  }
  FloatImage image{header->width, header->height, std::vector<float>(width * height)};
  for (std::size_t y = 0; y < height; ++y) {
    const auto row = bytes.subspan(header->data_at + 4 * width * (height - 1 - y), 4 * width);
    for (std::size_t x = 0; x < width; ++x) {
      image.values[y * width + x] = float_at(row.subspan(4 * x, 4), header->is_little_endian);
    }
  }
  return image;
}

Result<FloatImage> read_pfm(const std::filesystem::path& path) {
  return read_whole(path, [](std::span<const std::byte> bytes) { return read_pfm(bytes); });
}

Result<std::vector<std::byte>> write_pfm(const FloatImage& image) {
  const auto width = static_cast<std::size_t>(image.width);
  const auto height = static_cast<std::size_t>(image.height);
  if (image.width <= 0 || image.height <= 0 || image.values.size() != width * height) {
    return make_error(ErrorCode::InvalidArgument, "the number of values is not width x height");
  }
  const std::string header = "Pf\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
  const auto head = std::as_bytes(std::span(header));
  std::vector<std::byte> bytes(head.begin(), head.end());
  bytes.reserve(bytes.size() + 4 * image.values.size());
  for (std::size_t y = height; y-- > 0;) {
    for (std::size_t x = 0; x < width; ++x) {
      const auto bits = std::bit_cast<std::uint32_t>(image.values[y * width + x]);
      for (unsigned shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::byte>(bits >> shift & 0xFFU));
    }
  }
  return bytes;
}

Result<std::uint64_t> write_pfm(const FloatImage& image, const std::filesystem::path& path) {
  return write_whole(path, write_pfm(image));
}

}  // namespace quoin

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/io/image_files.h>

#include "core/bytes/text.h"
#include "io/image/image_codecs.h"
#include "io/whole_file.h"

#ifdef QUOIN_HAVE_OPENEXR
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfThreading.h>
#include <half.h>
#endif

namespace quoin {

namespace {

Status check_channels(int width, int height, std::span<const ExrChannel> channels) {
  const auto refuse = [](const std::string& message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (width <= 0 || height <= 0) return refuse("the image's width or height is not positive");
  if (channels.empty()) return refuse("the image has no channels");
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::set<std::string> names;
  for (const ExrChannel& channel : channels) {
    if (channel.name.empty() || !names.insert(channel.name).second) return refuse("two channels have the same name");
    const std::size_t count = channel.type == ExrChannel::Type::Uint32 ? channel.numbers.size() : channel.values.size();
    if (count != pixels) return refuse("the channel " + channel.name + " does not have width x height values");
  }
  return {};
}

#ifdef QUOIN_HAVE_OPENEXR

// OpenEXR's streams over memory.
class MemoryOut : public OPENEXR_IMF_NAMESPACE::OStream {
 public:
  MemoryOut() : OStream("memory") {}
  void write(const char* from, int count) override {
    QUOIN_ASSERT(count >= 0, "count >= 0");
    const auto size = static_cast<std::size_t>(count);
    if (bytes.size() < at_ + size) bytes.resize(at_ + size);
    std::copy_n(reinterpret_cast<const std::byte*>(from), size, bytes.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += size;
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t position) override { at_ = position; }

  std::vector<std::byte> bytes;

 private:
  std::size_t at_ = 0;
};

class MemoryIn : public OPENEXR_IMF_NAMESPACE::IStream {
 public:
  explicit MemoryIn(std::span<const std::byte> bytes) : IStream("memory"), bytes_(bytes) {}
  bool read(char* to, int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (at_ > bytes_.size() || bytes_.size() - at_ < size) throw IEX_NAMESPACE::InputExc("the file ends early");
    std::copy_n(reinterpret_cast<const char*>(bytes_.data()) + at_, size, to);
    at_ += size;
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t position) override { at_ = position; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

namespace imf = OPENEXR_IMF_NAMESPACE;

imf::PixelType type_of(ExrChannel::Type type) {
  if (type == ExrChannel::Type::Float16) return imf::HALF;
  return type == ExrChannel::Type::Float32 ? imf::FLOAT : imf::UINT;
}

std::vector<half> halves_of(const std::vector<float>& values) {
  std::vector<half> halves;
  halves.reserve(values.size());
  for (const float value : values) {
    constexpr float kMost = 65504.0F;
    halves.emplace_back(std::isfinite(value) ? std::clamp(value, -kMost, kMost) : value);
  }
  return halves;
}

std::vector<std::byte> encode(int width, int height, std::span<const ExrChannel> channels) {
  imf::Header header(width, height);
  header.compression() = imf::ZIP_COMPRESSION;
  imf::FrameBuffer frame;
  std::vector<std::vector<half>> halves;
  halves.reserve(channels.size());
  for (const ExrChannel& channel : channels) {
    const imf::PixelType type = type_of(channel.type);
    header.channels().insert(channel.name, imf::Channel(type));
    const void* data = channel.type == ExrChannel::Type::Uint32 ? static_cast<const void*>(channel.numbers.data())
                                                                : static_cast<const void*>(channel.values.data());
    std::size_t size = sizeof(float);
    if (channel.type == ExrChannel::Type::Float16) {
      data = halves.emplace_back(halves_of(channel.values)).data();
      size = sizeof(half);
    }
    // The data is only read, but the slice's type is not const.
    char* const base = static_cast<char*>(const_cast<void*>(data));  // NOLINT
    frame.insert(channel.name, imf::Slice(type, base, size, size * static_cast<std::size_t>(width)));
  }
  MemoryOut out;
  {
    imf::OutputFile file(out, header, 0);
    file.setFrameBuffer(frame);
    file.writePixels(height);
  }
  return std::move(out.bytes);
}

#endif

}  // namespace

bool has_exr() {
#ifdef QUOIN_HAVE_OPENEXR
  return true;
#else
  return false;
#endif
}

#ifdef QUOIN_HAVE_OPENEXR

namespace {

// Deflate gives at most 1,032 bytes per byte, which is 516 grey pixels of 16 bits, so that longer images are not in the
// file. The wavelet codecs compress only flat images more; the constant part lets small ones pass.
constexpr std::size_t max_pixels_in(std::size_t file_bytes) {
  return (std::size_t{1} << 16) + 516 * file_bytes;
}

// Requires: the width and height are the differences of 32-bit numbers.
Status check_exr_size(std::int64_t width, std::int64_t height, std::size_t file_bytes, std::size_t max_pixels) {
  if (width <= 0 || height <= 0) return make_error(ErrorCode::BadFormat, "the OpenEXR file has no pixels");
  if (static_cast<std::uint64_t>(width) > max_pixels / static_cast<std::uint64_t>(height)) {
    return make_error(ErrorCode::LimitExceeded, "the image has more than " + std::to_string(max_pixels) + " pixels");
  }
  if (static_cast<std::size_t>(width * height) <= max_pixels_in(file_bytes)) return {};
  return make_error(ErrorCode::BadFormat, "the OpenEXR file is too short for its " + std::to_string(width) + " x " +
                                              std::to_string(height) + " pixels");
}

// Checks the sizes of attributes, thumbnails, images and tiles: OpenEXR allocates memory by them before it reads the
// content.
//
// Layout: 8 bytes; per attribute a name and a type with terminators, 32 bits of length and the value; an empty name
//         ends a header. Files with several parts have a header for each, and an empty one.
class ExrHeaders {
 public:
  ExrHeaders(std::span<const std::byte> bytes, std::size_t max_pixels)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), max_pixels_(max_pixels) {}

  Status check() const {
    constexpr unsigned char kManyParts = 0x10;  // in the second byte of the version
    const bool has_parts = text_.size() > 5 && (static_cast<unsigned char>(text_[5]) & kManyParts) != 0;
    std::size_t header = 8;
    for (std::size_t at = header; at < text_.size();) {
      if (text_[at] == '\0') {
        if (!has_parts || at == header) return {};
        header = ++at;
        continue;
      }
      const std::size_t type = text_.find('\0', at);
      const std::size_t length = type == std::string_view::npos ? type : text_.find('\0', type + 1);
      if (length == std::string_view::npos || text_.size() - length <= 4) return {};  // OpenEXR reports the early end
      const std::size_t value = length + 5;
      const std::uint64_t size = number_at(length + 1);
      if (size > text_.size() - value) return too_long(at);
      const std::string_view name = text_.substr(at, type - at);
      if (Status sound = check_value(name, text_.substr(type + 1, length - type - 1), at, value, size); !sound)
        return sound;
      at = value + static_cast<std::size_t>(size);
    }
    return {};
  }

 private:
  [[nodiscard]] std::uint32_t number_at(std::size_t at) const {
    QUOIN_ASSERT(at + 4 <= text_.size(), "four bytes of the file");
    std::uint32_t number = 0;
    for (std::size_t i = 4; i > 0; --i) number = number << 8 | static_cast<unsigned char>(text_[at + i - 1]);
    return number;
  }
  static Status too_long(std::size_t at) {
    return make_error(ErrorCode::BadFormat, "the attribute is longer than the file", {}, at);
  }
  Status check_value(std::string_view name, std::string_view type, std::size_t at, std::size_t value,
                     std::uint64_t size) const {
    // Width, height, pixels of four bytes.
    if (type == "preview") {
      const bool is_sound = size >= 8 && std::uint64_t{number_at(value)} * number_at(value + 4) == (size - 8) / 4;
      return is_sound ? Status() : too_long(at);
    }
    // The first and the last x and y.
    if (name == "dataWindow" && type == "box2i" && size == 16) {
      const auto side = [&](std::size_t axis) {
        const auto first = static_cast<std::int32_t>(number_at(value + axis));
        return std::int64_t{static_cast<std::int32_t>(number_at(value + axis + 8))} - first + 1;
      };
      return check_exr_size(side(0), side(4), text_.size(), max_pixels_);
    }
    // Tiles may be larger than the image.
    constexpr std::uint64_t kUsualTile = std::uint64_t{1} << 22;
    if (type == "tiledesc" && size >= 8 &&
        std::uint64_t{number_at(value)} * number_at(value + 4) > kUsualTile + max_pixels_in(text_.size())) {
      return make_error(ErrorCode::BadFormat, "the OpenEXR file is too short for its tiles", {}, at);
    }
    return {};
  }

  std::string_view text_;
  std::size_t max_pixels_;
};

// Reads the channels R, G and B, or Y. OpenEXR reports errors by exceptions, which must not leave this file.
Result<RadianceImage> decode_exr(std::span<const std::byte> bytes, std::size_t max_pixels) {
  if (Status sound = ExrHeaders(bytes, max_pixels).check(); !sound) return sound.error();
  try {
    MemoryIn in(bytes);
    imf::InputFile file(in, 0);
    const auto window = file.header().dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
    const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
    if (Status sound = check_exr_size(width, height, bytes.size(), max_pixels); !sound) return sound.error();
    const imf::ChannelList& channels = file.header().channels();
    const bool is_grey = channels.findChannel("R") == nullptr && channels.findChannel("Y") != nullptr;
    if (!is_grey && channels.findChannel("R") == nullptr) {
      return make_error(ErrorCode::BadFormat, "the OpenEXR file has no channels R, G, B or Y");
    }
    RadianceImage image{static_cast<int>(width), static_cast<int>(height),
                        std::vector<float>(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
    imf::FrameBuffer frame;
    constexpr std::size_t kPixel = 3 * sizeof(float);
    const auto insert = [&](const char* name, int channel) {
      frame.insert(name, imf::Slice::Make(imf::FLOAT, image.rgb.data() + channel, window, kPixel,
                                          kPixel * static_cast<std::size_t>(width)));
    };
    if (is_grey) {
      insert("Y", 0);
    } else {
      insert("R", 0), insert("G", 1), insert("B", 2);
    }
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    for (std::size_t i = 0; is_grey && i < image.rgb.size(); i += 3) image.rgb[i + 1] = image.rgb[i + 2] = image.rgb[i];
    return image;
  } catch (const std::exception& exception) {
    std::string message = exception.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    return make_error(ErrorCode::BadFormat, "not a readable OpenEXR file: " + message);
  }
}

}  // namespace

Result<std::vector<std::byte>> write_exr(int width, int height, std::span<const ExrChannel> channels) {
  if (Status status = check_channels(width, height, channels); !status) return status.error();
  try {
    return encode(width, height, channels);
  } catch (const std::exception& exception) {
    return make_error(ErrorCode::LimitExceeded, std::string("cannot encode the image: ") + exception.what());
  }
}

#else

namespace {

Result<RadianceImage> decode_exr(std::span<const std::byte>, std::size_t) {
  return make_error(ErrorCode::Unsupported, "cannot read OpenEXR: Quoin was built without OpenEXR" QUOIN_IMAGES_OPTION);
}

}  // namespace

Result<std::vector<std::byte>> write_exr(int width, int height, std::span<const ExrChannel> channels) {
  if (Status status = check_channels(width, height, channels); !status) return status.error();
  return make_error(ErrorCode::Unsupported,
                    "cannot write OpenEXR: Quoin was built without OpenEXR" QUOIN_IMAGES_OPTION);
}

#endif

Result<std::uint64_t> write_exr(int width, int height, std::span<const ExrChannel> channels,
                                const std::filesystem::path& path) {
  return write_whole(path, write_exr(width, height, channels));
}

namespace {

constexpr std::size_t kMaxPixels = std::size_t{1} << 26;
// Shorter and longer rows are never run-length encoded.
constexpr std::size_t kShortestRuns = 8;
constexpr std::size_t kLongestRuns = 32'767;

Error bad(std::string message, std::size_t at) {
  return make_error(ErrorCode::BadFormat, std::move(message), {}, at);
}

// A Radiance image has four bytes per pixel: three mantissas and a shared exponent.
class HdrReader {
 public:
  explicit HdrReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  Result<RadianceImage> read() {
    if (Status header = read_header(); !header) return header.error();
    const std::size_t pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    if (pixels > kMaxPixels)
      return make_error(ErrorCode::LimitExceeded, "the image has more than 67,108,864 pixels", {}, at_);
    // Two bytes of runs give at most 127 bytes, which limits the number of pixels.
    if (pixels > 128 * (bytes_.size() - at_)) return bad("the file ends before the pixels", at_);
    RadianceImage image{width_, height_, {}};
    image.rgb.reserve(3 * pixels);
    std::vector<std::uint8_t> row(4 * static_cast<std::size_t>(width_));
    for (int y = 0; y < height_; ++y) {
      if (Status status = read_row(row); !status) return status.error();
      for (std::size_t x = 0; x < static_cast<std::size_t>(width_); ++x) {
        const int exponent = row[4 * x + 3];
        const float scale = exponent == 0 ? 0.0F : std::ldexp(exposure_, exponent - (128 + 8));
        for (std::size_t channel = 0; channel < 3; ++channel) {
          const float mantissa = exponent == 0 ? 0.0F : static_cast<float>(row[4 * x + channel]) + 0.5F;
          image.rgb.push_back(mantissa * scale);
        }
      }
    }
    return image;
  }

 private:
  [[nodiscard]] std::string_view line() {
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()) + at_, bytes_.size() - at_);
    const std::size_t end = std::min(text.find('\n'), text.size());
    at_ += std::min(end + 1, text.size());
    return text.substr(0, end);
  }

  Status read_header() {
    (void)line();  // "#?RADIANCE", already checked
    float shown = 1.0F;
    while (true) {
      if (at_ >= bytes_.size()) return bad("the header has no end", at_);
      const std::size_t begin = at_;
      const std::string_view text = line();
      if (text.empty()) break;
      if (text.starts_with("FORMAT=") && text != "FORMAT=32-bit_rle_rgbe") {
        return make_error(ErrorCode::Unsupported, "a Radiance image that is not RGBE", {}, begin);
      }
      if (!text.starts_with("EXPOSURE=")) continue;
      const auto value = number_of(text.substr(9));
      if (!value || !(*value > 0.0F)) return bad("the exposure is not a number above 0", begin);
      shown *= *value;
    }
    if (!(shown > 0.0F) || !std::isfinite(shown)) return bad("the exposure is not a number above 0", at_);
    exposure_ = 1.0F / shown;
    return read_size(at_, line());
  }

  static std::optional<float> number_of(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\r')) text.remove_suffix(1);
    return parse_float(text);
  }

  // "-Y 512 +X 1024": from the top, from the left. Other orders are rare and rejected.
  Status read_size(std::size_t begin, std::string_view text) {
    const std::size_t x_at = text.find(" +X ");
    if (!text.starts_with("-Y ") || x_at == std::string_view::npos) {
      return make_error(ErrorCode::Unsupported, "a Radiance image whose axes are not -Y +X", {}, begin);
    }
    const auto height = number_of(text.substr(3, x_at - 3));
    const auto width = number_of(text.substr(x_at + 4));
    const auto is_size = [](const std::optional<float>& n) {
      return n && *n >= 1.0F && *n <= 1e6F && *n == std::floor(*n);
    };
    if (!is_size(height) || !is_size(width)) return bad("the size is not a number from 1 to 1,000,000", begin);
    width_ = static_cast<int>(*width);
    height_ = static_cast<int>(*height);
    return {};
  }

  [[nodiscard]] std::uint8_t byte(std::size_t offset = 0) const {
    QUOIN_ASSERT(at_ + offset < bytes_.size(), "a byte of the file");
    return std::to_integer<std::uint8_t>(bytes_[at_ + offset]);
  }
  [[nodiscard]] bool has(std::size_t count) const {
    QUOIN_ASSERT(at_ <= bytes_.size(), "a position within the file");
    return bytes_.size() - at_ >= count;
  }

  Status read_row(std::vector<std::uint8_t>& row) {
    const std::size_t width = row.size() / 4;
    if (!has(4)) return bad("the file ends within the pixels", at_);
    const bool in_runs =
        width >= kShortestRuns && width <= kLongestRuns && byte() == 2 && byte(1) == 2 && byte(2) < 128;
    if (in_runs) {
      if (static_cast<std::size_t>(byte(2)) * 256 + byte(3) != width)
        return bad("the row length differs from the image width", at_);
      at_ += 4;
      return read_runs(row);
    }
    for (std::size_t x = 0; x < width;) {
      if (!has(4)) return bad("the file ends within the pixels", at_);
      if (byte() == 1 && byte(1) == 1 && byte(2) == 1)
        return make_error(ErrorCode::Unsupported, "the oldest run-length encoding is not supported", {}, at_);
      for (std::size_t i = 0; i < 4; ++i) row[4 * x + i] = byte(i);
      at_ += 4;
      ++x;
    }
    return {};
  }

  // Each component is encoded separately.
  Status read_runs(std::vector<std::uint8_t>& row) {
    const std::size_t width = row.size() / 4;
    for (std::size_t component = 0; component < 4; ++component) {
      for (std::size_t x = 0; x < width;) {
        if (!has(2)) return bad("the file ends within the pixels", at_);
        const std::size_t code = byte();
        const bool is_run = code > 128;
        const std::size_t count = is_run ? code - 128 : code;
        if (count == 0 || count > width - x) return bad("a run extends past its row", at_);
        ++at_;
        if (!has(is_run ? 1 : count)) return bad("the file ends within the pixels", at_);
        for (std::size_t i = 0; i < count; ++i) row[4 * (x + i) + component] = byte(is_run ? 0 : i);
        at_ += is_run ? 1 : count;
        x += count;
      }
    }
    return {};
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  int width_ = 0;
  int height_ = 0;
  float exposure_ = 1.0F;
};

bool begins_with(std::span<const std::byte> bytes, std::string_view magic) {
  return bytes.size() >= magic.size() &&
         std::string_view(reinterpret_cast<const char*>(bytes.data()), magic.size()) == magic;
}

}  // namespace

Result<RadianceImage> read_radiance(std::span<const std::byte> bytes) {
  if (begins_with(bytes, "#?")) return HdrReader(bytes).read();
  if (begins_with(bytes, "\x76\x2f\x31\x01")) return decode_exr(bytes, kMaxPixels);
  return bad("neither a Radiance .hdr nor an OpenEXR file", 0);
}

Result<RadianceImage> read_radiance(const std::filesystem::path& path) {
  return read_whole(path, [](std::span<const std::byte> bytes) { return read_radiance(bytes); });
}

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

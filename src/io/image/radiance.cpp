#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/io/image_files.h>

#include "core/bytes/text.h"
#include "io/image/exr.h"
#include "io/whole_file.h"

namespace quoin {
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

}  // namespace quoin

// Two formats that consist of an array of voxels.

#include <array>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "io/byte_reader.h"
#include "io/models/model_builder.h"
#include "io/models/models.h"

namespace quoin::models {

namespace {

constexpr std::string_view kBinvox = "#binvox";
constexpr int kMaxEdge = 1 << 14;
constexpr std::uint64_t kMaxVoxels = std::uint64_t{1} << 32;

/// Lines of text, and then bytes.
struct BinvoxHeader {
  IVec3 size{0};  ///< x, z, y, in the file's order
  DVec3 translate{0.0};
  double scale = 1.0;
  std::size_t data_at = 0;
};

bool parse_numbers(std::string_view text, std::span<double> out) {
  for (double& number : out) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc()) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  }
  return true;
}

Result<BinvoxHeader> parse_binvox_header(std::span<const std::byte> bytes) {
  constexpr std::size_t kLongestHeader = 4096;
  const std::string_view text = text_of(bytes.first(std::min(bytes.size(), kLongestHeader)));
  BinvoxHeader header;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string_view::npos) break;
    std::string_view line = text.substr(at, end - at);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    const std::size_t space = std::min(line.find(' '), line.size());
    const std::string_view key = line.substr(0, space);
    std::array<double, 3> numbers{};
    if (key == "data") {
      header.data_at = end + 1;
      if (header.size.x == 0) return bad_at(at, "no dim line before the data");
      return header;
    }
    const std::size_t wanted = key == "dim" || key == "translate" ? 3 : key == "scale" ? 1 : 0;
    if (!parse_numbers(line.substr(space), std::span(numbers).first(wanted))) {
      return bad_at(at, std::string("missing numbers in the line ").append(key));
    }
    if (key == "dim") {
      for (int axis = 0; axis < 3; ++axis) {
        const double edge = numbers.at(static_cast<std::size_t>(axis));
        if (!(edge >= 1.0 && edge <= kMaxEdge)) return bad_at(at, "the size is out of range");
        header.size[axis] = static_cast<int>(edge);
      }
    }
    if (key == "translate") header.translate = {numbers[0], numbers[1], numbers[2]};
    if (key == "scale") header.scale = numbers[0];
    at = end + 1;
  }
  return bad_at(text.size(), "the file has no data line");
}

}  // namespace

bool is_binvox(std::span<const std::byte> beginning) {
  return text_of(beginning).starts_with(kBinvox);
}

// Runs of a value and a count; y changes fastest, then z, then x.
Result<LoadedScene> read_binvox(std::span<const std::byte> bytes) {
  const auto header = parse_binvox_header(bytes);
  if (!header) return header.error();
  const IVec3 size{header->size.x, header->size.z, header->size.y};
  const std::uint64_t volume =
      static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) * static_cast<std::uint64_t>(size.z);
  if (volume > kMaxVoxels) return make_error(ErrorCode::LimitExceeded, "more than 2^32 voxels");
  ModelBuilder builder;
  Model model;
  const double voxel_size = header->scale / std::max({size.x, size.y, size.z});
  if (voxel_size > 1e-9 && voxel_size < 1e9 && is_finite(header->translate)) {
    model.position = header->translate;
    model.voxel_size = voxel_size;
  } else {
    builder.warn("translate or scale is out of range and ignored: a voxel is one unit");
  }
  model.canvas = {IVec3(0), size};
  builder.begin(std::move(model));
  std::uint64_t at = 0;
  for (std::size_t byte = header->data_at; at < volume; byte += 2) {
    if (byte + 2 > bytes.size()) return bad_at(bytes.size(), "the file ends before its voxels");
    const auto value = std::to_integer<unsigned>(bytes[byte]);
    std::uint64_t count = std::to_integer<unsigned>(bytes[byte + 1]);
    if (count > volume - at) return bad_at(byte, "more voxels than the size allows");
    while (count > 0) {
      const auto y = static_cast<int>(at % static_cast<std::uint64_t>(size.y));
      const std::uint64_t run = std::min(count, static_cast<std::uint64_t>(size.y - y));
      const std::uint64_t column = at / static_cast<std::uint64_t>(size.y);
      const IVec3 voxel{static_cast<int>(column / static_cast<std::uint64_t>(size.z)), y,
                        static_cast<int>(column % static_cast<std::uint64_t>(size.z))};
      if (value != 0) {
        if (auto put = builder.put(voxel, {190, 190, 190, 255}, static_cast<int>(run)); !put) return put.error();
      }
      at += run;
      count -= run;
    }
  }
  return builder.take("binvox");
}

bool is_cub(std::span<const std::byte> whole) {
  ByteReader reader(whole);
  std::uint64_t volume = 3;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t edge = reader.u32();
    if (edge == 0 || edge > static_cast<std::uint32_t>(kMaxEdge)) return false;
    volume *= edge;
  }
  return !reader.failed() && volume == reader.remaining();
}

// x changes fastest, then the second ground axis, then the height. Rotated so that up is +y.
Result<LoadedScene> read_cub(std::span<const std::byte> bytes) {
  if (!is_cub(bytes)) return bad_at(0, "the file size does not match the model's three sizes");
  ByteReader reader(bytes);
  const auto width = static_cast<int>(reader.u32());
  const auto depth = static_cast<int>(reader.u32());
  const auto height = static_cast<int>(reader.u32());
  ModelBuilder builder;
  Model model;
  model.canvas = {IVec3(0), {width, height, depth}};
  builder.begin(std::move(model));
  for (int y = 0; y < height; ++y) {
    for (int z = depth - 1; z >= 0; --z) {
      for (int x = 0; x < width; ++x) {
        const auto rgb = reader.take(3);
        const Rgba8 colour{static_cast<std::uint8_t>(rgb[0]), static_cast<std::uint8_t>(rgb[1]),
                           static_cast<std::uint8_t>(rgb[2]), 255};
        if (colour.r == 0 && colour.g == 0 && colour.b == 0) continue;
        if (auto put = builder.put({x, y, z}, colour); !put) return put.error();
      }
    }
  }
  return builder.take("cub");
}

}  // namespace quoin::models

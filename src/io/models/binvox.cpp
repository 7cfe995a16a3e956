// https://www.patrickmin.com/binvox/binvox.html. The voxels have no colours: they are grey.
//
// Writes lines of text, then runs of a value and a count: y changes fastest, then z, then x.

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/work/progress_steps.h"
#include "io/format_driver.h"
#include "io/models/model_builder.h"
#include "io/placed_grids.h"

namespace quoin::models {

namespace {

constexpr std::string_view kBinvox = "#binvox";
constexpr std::int64_t kMaxVoxels = std::int64_t{1} << 32;

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
  if (volume > std::uint64_t{kMaxVoxels}) return make_error(ErrorCode::LimitExceeded, "more than 2^32 voxels");
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

constexpr FormatHolds kBinvoxHolds = {.extension = ".binvox", .colours = false, .place_in_units = true};
/// Some readers accept only cubes (trimesh). A cube is written if it is not much larger than the box, or small anyway.
constexpr int kMaxCube = 1 << 8;
constexpr std::int64_t kMostAir = 8;  // times the box

bool is_better_a_cube(const IVec3& size, int longest) {
  if (longest <= kMaxCube || longest > kMaxEdge) return longest <= kMaxCube;
  const std::int64_t cube = std::int64_t{longest} * longest * longest;
  return cube <= kMaxVoxels && cube <= kMostAir * size.x * size.y * size.z;
}

constexpr unsigned kLongestRun = 255;

/// Returns the shortest text that parses to the same number.
std::string decimal(double number) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  QUOIN_ASSERT(end != text.data(), "at least one digit");
  return {text.data(), end};
}

class RunWriter {
 public:
  explicit RunWriter(ByteWriter& out) : out_(out) {}
  void put(bool solid) {
    if (count_ == kLongestRun || (count_ != 0 && solid != solid_)) end();
    solid_ = solid;
    ++count_;
  }
  void end() {
    if (count_ == 0) return;
    out_.u8(solid_ ? 1 : 0);
    QUOIN_ASSERT(count_ <= kLongestRun, "a run of one byte");
    out_.u8(static_cast<std::uint8_t>(count_));
    count_ = 0;
  }

 private:
  ByteWriter& out_;
  bool solid_ = false;
  unsigned count_ = 0;
};

/// Writes one grid of full and empty voxels, with its position and voxel size.
Result<EncodedFile> write_binvox(const FormatOutput& output) {
  auto merged = merge_grids(output.scene, kBinvoxHolds);
  if (!merged) return merged.error();
  if (merged->box.empty())
    return make_error(ErrorCode::Unsupported, "the scene has no voxels, and .binvox needs at least one");
  const IBox& box = merged->box;
  const int longest = std::max({box.size().x, box.size().y, box.size().z});
  const IVec3 size = is_better_a_cube(box.size(), longest) ? IVec3(longest) : box.size();
  const std::int64_t volume = std::int64_t{size.x} * size.y;
  if (longest > kMaxEdge || volume > kMaxVoxels / std::max(size.z, 1)) {
    return make_error(ErrorCode::LimitExceeded, "more than 16,384 voxels per side, or 2^32 in total");
  }
  // The size limits of readers.
  constexpr double kLeastVoxel = 1e-8;
  constexpr double kMostVoxel = 1e8;
  if (!(merged->voxel_size > kLeastVoxel && merged->voxel_size < kMostVoxel)) {
    return make_error(ErrorCode::Unsupported, "the voxel size is outside 1e-8 to 1e8 units");
  }
  const auto numbers = [](const DVec3& v) { return decimal(v.x) + " " + decimal(v.y) + " " + decimal(v.z); };
  ByteWriter out;
  out.text("#binvox 1\n");
  out.text("dim " + std::to_string(size.x) + " " + std::to_string(size.z) + " " + std::to_string(size.y) + "\n");
  out.text("translate " + numbers(DVec3(box.min) * merged->voxel_size) + "\n");
  out.text("scale " + decimal(merged->voxel_size * longest) + "\ndata\n");
  RunWriter runs(out);
  // A slice of x crosses all rows, so slices are read at once for the width of a chunk.
  std::vector<bool> slices;
  std::vector<VoxelType> row;
  ProgressSteps steps(output.progress, static_cast<std::size_t>((size.x + kChunkEdge - 1) / kChunkEdge));
  for (int x = 0; x < size.x; x += kChunkEdge) {
    const int width = std::min(kChunkEdge, size.x - x);
    const auto area = static_cast<std::size_t>(size.y) * static_cast<std::size_t>(size.z);
    row.resize(static_cast<std::size_t>(width));
    slices.assign(area * static_cast<std::size_t>(width), false);
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        read_voxels(merged->voxels, box.min + IVec3(x, y, z), row);
        const auto at = static_cast<std::size_t>(z) * static_cast<std::size_t>(size.y) + static_cast<std::size_t>(y);
        for (std::size_t i = 0; i < row.size(); ++i) slices[i * area + at] = row[i] != kAir;
      }
    }
    for (const bool solid : slices) runs.put(solid);
    steps.step();
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  runs.end();
  return EncodedFile{out.take(), std::move(merged->warnings)};
}

}  // namespace

}  // namespace quoin::models

namespace quoin {

extern constinit const FormatDriver kBinvoxFormat = {
    .info = {FileFormat::Binvox, ".binvox", "binvox", FormatCapability::Read | FormatCapability::Write},
    .detect = models::is_binvox,
    .read = [](const FormatInput& input) { return models::read_binvox(input.bytes); },
    .encode = models::write_binvox,
};

}  // namespace quoin

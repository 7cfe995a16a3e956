// Writes lines of text, then runs of a value and a count: y changes fastest, then z, then x.

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <utility>

#include "core/progress_steps.h"
#include "io/byte_writer.h"
#include "io/models/write/write_models.h"
#include "io/placed/placed_grids.h"

namespace quoin::models {

namespace {

constexpr FormatHolds kHolds = {.extension = ".binvox", .colours = false, .place_in_units = true};
constexpr int kMaxEdge = 1 << 14;
constexpr std::int64_t kMaxVoxels = std::int64_t{1} << 32;
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
std::string text_of(double number) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
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
    out_.u8(static_cast<std::uint8_t>(count_));
    count_ = 0;
  }

 private:
  ByteWriter& out_;
  bool solid_ = false;
  unsigned count_ = 0;
};

}  // namespace

Result<ModelBytes> write_binvox(const Scene& scene, const Progress& progress) {
  auto merged = merge_grids(scene, kHolds);
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
  const auto numbers = [](const DVec3& v) { return text_of(v.x) + " " + text_of(v.y) + " " + text_of(v.z); };
  ByteWriter out;
  out.text("#binvox 1\n");
  out.text("dim " + std::to_string(size.x) + " " + std::to_string(size.z) + " " + std::to_string(size.y) + "\n");
  out.text("translate " + numbers(DVec3(box.min) * merged->voxel_size) + "\n");
  out.text("scale " + text_of(merged->voxel_size * longest) + "\ndata\n");
  RunWriter runs(out);
  // A slice of x crosses all rows, so slices are read at once for the width of a chunk.
  std::vector<bool> slices;
  std::vector<VoxelType> row;
  ProgressSteps steps(progress, static_cast<std::size_t>((size.x + kChunkEdge - 1) / kChunkEdge));
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
  return ModelBytes{out.take(), std::move(merged->warnings)};
}

}  // namespace quoin::models

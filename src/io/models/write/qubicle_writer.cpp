// Writes a matrix for each instance: slices by z, rows by y, runs of equal colours along x.

#include <algorithm>
#include <string>
#include <utility>

#include "core/progress_steps.h"
#include "io/byte_writer.h"
#include "io/models/write/write_models.h"
#include "io/placed/placed_grids.h"
#include "io/text.h"

namespace quoin::models {

namespace {

constexpr FormatHolds kHolds = {.extension = ".qb", .names = true, .several = true, .transparency = true};
constexpr std::uint32_t kVersion = 0x0000'0101;
constexpr std::uint32_t kRun = 2;
constexpr std::uint32_t kNextSlice = 6;
constexpr std::size_t kLongestName = 255;
// The size limit of readers.
constexpr int kMaxEdge = 1 << 14;
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 32;

std::uint32_t word_of(Rgba8 colour) {
  const auto shifted = [](std::uint8_t channel, int bits) { return static_cast<std::uint32_t>(channel) << bits; };
  return shifted(colour.r, 0) | shifted(colour.g, 8) | shifted(colour.b, 16) | shifted(colour.a, 24);
}

/// Writes runs of equal words, which do not extend past a slice.
class RunWriter {
 public:
  explicit RunWriter(ByteWriter& out) : out_(out) {}
  void put(std::uint32_t word, std::uint32_t count = 1) {
    if (count_ != 0 && word == word_) {
      count_ += count;
      return;
    }
    end_run();
    word_ = word;
    count_ = count;
  }
  void end_slice() {
    end_run();
    out_.u32(kNextSlice);
  }

 private:
  // Runs of up to three are not longer as plain words. Colours cannot be mistaken for codes, since solid voxels have
  // non-zero alpha.
  void end_run() {
    constexpr std::uint32_t kWords = 3;
    if (count_ > kWords) {
      out_.u32(kRun);
      out_.u32(count_);
      out_.u32(word_);
    } else {
      for (std::uint32_t i = 0; i < count_; ++i) out_.u32(word_);
    }
    count_ = 0;
  }

  ByteWriter& out_;
  std::uint32_t word_ = 0;
  std::uint32_t count_ = 0;
};

Status write_matrix(const PlacedGrid& grid, const std::vector<Rgba8>& colours, ByteWriter& out,
                    std::vector<std::string>& warnings, ProgressSteps& steps) {
  const IVec3 size = grid.box.size();
  if (std::max({size.x, size.y, size.z}) > kMaxEdge) {
    std::string line = "more than 16,384 voxels per side in ";
    return make_error(ErrorCode::LimitExceeded, line.append(printable(grid.name)));
  }
  const std::string name = cut_name(grid.name, kLongestName, warnings);
  out.u8(static_cast<std::uint8_t>(name.size()));
  out.text(name);
  for (int axis = 0; axis < 3; ++axis) out.i32(size[axis]);
  for (int axis = 0; axis < 3; ++axis) out.i32(grid.box.min[axis]);
  std::vector<VoxelType> row(static_cast<std::size_t>(size.x));
  RunWriter runs(out);
  for (int z = grid.box.min.z; z < grid.box.max.z; ++z) {
    for (int y = grid.box.min.y; y < grid.box.max.y; ++y) {
      read_voxels(grid.voxels, {grid.box.min.x, y, z}, row);
      if (std::ranges::all_of(row, [&](VoxelType type) { return type == row.front(); })) {
        runs.put(word_of(colours[row.front()]), static_cast<std::uint32_t>(row.size()));
      } else {
        for (const VoxelType type : row) runs.put(word_of(colours[type]));
      }
    }
    runs.end_slice();
    steps.step();
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    if (out.size() > kMaxBytes) return make_error(ErrorCode::LimitExceeded, "more than 4 GiB of voxels");
  }
  return {};
}

}  // namespace

Result<ModelBytes> write_qb(const Scene& scene, const Progress& progress) {
  auto placed = place_grids(scene, kHolds);
  if (!placed) return placed.error();
  if (placed->grids.empty())
    return make_error(ErrorCode::Unsupported, "the scene has no voxels, and .qb needs at least one");
  const std::vector<Rgba8> colours = colours_of(scene.types);
  ByteWriter out;
  out.u32(kVersion);
  out.u32(0);  // colours are red, green, blue, alpha
  out.u32(1);  // right-handed
  out.u32(1);  // runs
  out.u32(0);  // alpha is alpha, not a mask of visible faces
  out.u32(static_cast<std::uint32_t>(placed->grids.size()));
  std::size_t slices = 0;
  for (const PlacedGrid& grid : placed->grids) slices += static_cast<std::size_t>(grid.box.size().z);
  ProgressSteps steps(progress, slices);
  for (const PlacedGrid& grid : placed->grids) {
    if (auto done = write_matrix(grid, colours, out, placed->warnings, steps); !done) return done.error();
  }
  return ModelBytes{out.take(), std::move(placed->warnings)};
}

}  // namespace quoin::models

// Columns of spans, each with air and with solid voxels coloured at its top and its bottom. The voxels between have no
// colour, and readers take them as earth. So colours are written for visible voxels and for voxels that are not earth.
// The file's z points down: +x, -z, +y are this library's axes.

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <quoin/core/thousands.h>

#include "core/progress_steps.h"
#include "io/byte_writer.h"
#include "io/models/models.h"
#include "io/models/write/write_models.h"
#include "io/placed/placed_grids.h"

namespace quoin::models {

namespace {

constexpr FormatHolds kHolds = {.extension = ".vxl"};
constexpr std::uint8_t kFullLight = 0x7F;

struct Map {
  IVec3 size{0};  ///< in this library's axes
  bool has_header = false;
};
constexpr IVec3 kAceOfSpades{512, 64, 512};
constexpr IVec3 kVoxlap{1024, 256, 1024};

bool holds(IVec3 outer, IVec3 inner) {
  return inner.x <= outer.x && inner.y <= outer.y && inner.z <= outer.z;
}

/// The columns of a map, from above.
class MapWriter {
 public:
  MapWriter(const MergedGrid& merged, const std::vector<Rgba8>& colours, IVec3 size, IVec3 min)
      : merged_(merged), colours_(colours), size_(size), min_(min) {}

  Status run(ByteWriter& out, const Progress& progress);
  [[nodiscard]] std::int64_t grounded() const { return grounded_; }

 private:
  using Slice = std::vector<VoxelType>;  // of a z: [y][x] in this library's axes
  void read_slice(int z, Slice& slice) const;
  void write_column(int x, ByteWriter& out);
  void write_span(int begin, int end, bool is_last, int air, ByteWriter& out);
  [[nodiscard]] VoxelType at(const Slice& slice, int x, int depth) const {
    return slice[static_cast<std::size_t>(size_.y - 1 - depth) * static_cast<std::size_t>(size_.x) +
                 static_cast<std::size_t>(x)];
  }
  void colour(int depth, ByteWriter& out) const;

  const MergedGrid& merged_;
  const std::vector<Rgba8>& colours_;
  IVec3 size_;
  IVec3 min_;                    // minimum corner of the map, in the grid
  std::array<Slice, 3> slices_;  // the column's z, and its two neighbours
  std::vector<VoxelType> column_;
  std::vector<bool> has_colour_;
  std::int64_t grounded_ = 0;
};

void MapWriter::read_slice(int z, Slice& slice) const {
  slice.assign(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y), kAir);
  if (z < 0 || z >= size_.z) return;
  for (int y = 0; y < size_.y; ++y) {
    const auto row = std::span(slice).subspan(static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x),
                                              static_cast<std::size_t>(size_.x));
    read_voxels(merged_.voxels, min_ + IVec3(0, y, z), row);
  }
}

void MapWriter::colour(int depth, ByteWriter& out) const {
  const VoxelType type = column_[static_cast<std::size_t>(depth)];
  const Rgba8 colour = type == kAir ? kEarth : colours_[type];
  out.u8(colour.b);
  out.u8(colour.g);
  out.u8(colour.r);
  out.u8(kFullLight);
}

void MapWriter::write_column(int x, ByteWriter& out) {
  const int depth = size_.y;
  column_.resize(static_cast<std::size_t>(depth));
  has_colour_.assign(static_cast<std::size_t>(depth), false);
  // The outside of the map counts as solid.
  const auto is_air = [&](std::size_t slice, int adjacent, int z) {
    if (adjacent < 0 || adjacent >= size_.x) return false;
    return at(slices_.at(slice), adjacent, z) == kAir;
  };
  const auto is_open = [&](int z) { return z >= 0 && z < depth && at(slices_[1], x, z) == kAir; };
  const bool has_before = !slices_[0].empty();
  const bool has_behind = !slices_[2].empty();
  for (int z = 0; z < depth; ++z) {
    const VoxelType type = at(slices_[1], x, z);
    column_[static_cast<std::size_t>(z)] = type;
    if (type == kAir) continue;
    const bool is_seen = is_open(z - 1) || is_open(z + 1) || is_air(1, x - 1, z) || is_air(1, x + 1, z) ||
                         (has_before && is_air(0, x, z)) || (has_behind && is_air(2, x, z));
    const Rgba8 colour = colours_[type];
    const bool is_earth = colour.r == kEarth.r && colour.g == kEarth.g && colour.b == kEarth.b;
    has_colour_[static_cast<std::size_t>(z)] = is_seen || !is_earth;
  }
  if (column_.back() == kAir) ++grounded_;
  const auto is_solid = [&](int z) { return z == depth - 1 || column_[static_cast<std::size_t>(z)] != kAir; };
  int air = 0;
  for (int begin = 0; begin < depth;) {
    if (!is_solid(begin)) {
      ++begin;
      continue;
    }
    int end = begin;
    while (end < depth && is_solid(end)) ++end;
    write_span(begin, end, end == depth, air, out);
    air = end;
    begin = end;
  }
}

/// `air`: the top of the air above, where the previous span ended.
void MapWriter::write_span(int begin, int end, bool is_last, int air, ByteWriter& out) {
  const auto has_colour = [&](int z) { return has_colour_[static_cast<std::size_t>(z)]; };
  // The longest stretch without colours separates the top from the bottom; a span down to the ground has no bottom.
  int top_end = begin + 1;
  int bottom = end;
  int last = end;
  while (last > begin + 1 && !has_colour(last - 1)) --last;
  if (is_last) {
    top_end = last;
  } else {
    int longest = 0;
    for (int z = begin + 1; z < end;) {
      int next = z;
      while (next < end && !has_colour(next)) ++next;
      if (next - z > longest) {
        longest = next - z;
        top_end = z;
        bottom = next;
      }
      z = next + 1;
    }
    if (longest == 0) top_end = end;
  }
  const int words = 1 + (top_end - begin) + (end - bottom);
  out.u8(static_cast<std::uint8_t>(is_last ? 0 : words));
  out.u8(static_cast<std::uint8_t>(begin));
  out.u8(static_cast<std::uint8_t>(top_end - 1));
  out.u8(static_cast<std::uint8_t>(air));
  for (int z = begin; z < top_end; ++z) colour(z, out);
  for (int z = bottom; z < end && !is_last; ++z) colour(z, out);
}

Status MapWriter::run(ByteWriter& out, const Progress& progress) {
  ProgressSteps steps(progress, static_cast<std::size_t>(size_.z));
  read_slice(0, slices_[1]);
  read_slice(1, slices_[2]);
  for (int z = 0; z < size_.z; ++z) {
    for (int x = 0; x < size_.x; ++x) write_column(x, out);
    std::rotate(slices_.begin(), slices_.begin() + 1, slices_.end());
    if (z + 2 < size_.z) {
      read_slice(z + 2, slices_[2]);
    } else {
      slices_[2].clear();
    }
    steps.step();
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return {};
}

/// Writes the sizes and the start position: a point in the middle of the map's sky, and three axes.
void write_header(IVec3 size, ByteWriter& out) {
  out.u32(kVoxlapMagic);
  out.u32(static_cast<std::uint32_t>(size.x));
  out.u32(static_cast<std::uint32_t>(size.z));
  const std::array<double, 12> view = {size.x / 2.0, size.z / 2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0};
  for (const double number : view) out.f64(number);
}

}  // namespace

Result<ModelBytes> write_vxl(const Scene& scene, const Progress& progress) {
  auto merged = merge_grids(scene, kHolds);
  if (!merged) return merged.error();
  const IVec3 extent = merged->box.empty() ? IVec3(0) : merged->box.size();
  const bool is_small = holds(kAceOfSpades, extent);
  if (!is_small && !holds(kVoxlap, extent)) {
    return make_error(ErrorCode::LimitExceeded, "larger than the 1024 x 256 x 1024 voxels of a .vxl map");
  }
  const IVec3 size = is_small ? kAceOfSpades : kVoxlap;
  IVec3 min(0);
  const bool fits = merged->box.empty() || (merged->box.min.x >= 0 && merged->box.min.y >= 0 &&
                                            merged->box.min.z >= 0 && holds(size, merged->box.max));
  if (!fits) {
    min = merged->box.min - (size - extent) / 2;
    min.y = merged->box.min.y;
    merged->warnings.push_back("moved to the centre of the map by " + std::to_string(-min.x) + ", " +
                               std::to_string(-min.y) + ", " + std::to_string(-min.z));
  }
  const std::vector<Rgba8> colours = colours_of(scene.types);
  MapWriter writer(*merged, colours, size, min);
  ByteWriter out;
  if (!is_small) write_header(size, out);
  if (auto done = writer.run(out, progress); !done) return done.error();
  if (writer.grounded() != 0) {
    merged->warnings.push_back("columns given a ground voxel, since .vxl needs one in every column: " +
                               with_thousands(writer.grounded()));
  }
  return ModelBytes{out.take(), std::move(merged->warnings)};
}

}  // namespace quoin::models

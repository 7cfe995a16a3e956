// Ken Silverman's formats. The files' z points down; +x, -z, +y are this library's axes.
//
//   KV6    voxels of the surface by columns of x, then y: colour, height, faces
//   KVX    the same as slabs with a palette, for each level of detail; the first is read
//   SLAB6  an array of palette indices, 255 is empty
//   VXL    columns of spans: air, colours of an upper surface, solid ground, colours of a lower surface
//
// Columns of spans, each with air and with solid voxels coloured at its top and its bottom. The voxels between have no
// colour, and readers take them as earth. So colours are written for visible voxels and for voxels that are not earth.
// The file's z points down: +x, -z, +y are this library's axes.

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>

#include "core/bytes/bytes.h"
#include "core/work/progress_steps.h"
#include "io/format_driver.h"
#include "io/models/model_builder.h"
#include "io/placed_grids.h"
#include "io/vox/chunks.h"

namespace quoin::models {

namespace {

/// The colour of .vxl ground that no surface shows; the file has none for it.
constexpr Rgba8 kEarth{101, 77, 51, 255};
constexpr std::uint32_t kVoxlapMagic = 0x09072000;
constexpr std::uint32_t kMaxVoxlapEdge = 4096;
constexpr std::size_t kPaletteBytes = 768;

struct Sizes {
  int x = 0, y = 0, z = 0;  ///< in the file's axes
  [[nodiscard]] IVec3 place(int at_x, int at_y, int at_z) const { return {at_x, z - 1 - at_z, at_y}; }
  [[nodiscard]] DVec3 place(DVec3 at) const { return {at.x, z - at.z, at.y}; }
  [[nodiscard]] IBox canvas() const { return {IVec3(0), {x, z, y}}; }
};

std::optional<Sizes> read_sizes(ByteReader& reader) {
  const std::array<std::uint32_t, 3> edges = {reader.u32(), reader.u32(), reader.u32()};
  for (const std::uint32_t edge : edges) {
    if (edge == 0 || edge > kMaxVoxlapEdge) return std::nullopt;
  }
  return Sizes{static_cast<int>(edges[0]), static_cast<int>(edges[1]), static_cast<int>(edges[2])};
}

Model model_of(const Sizes& sizes, DVec3 pivot) {
  Model model;
  model.canvas = sizes.canvas();
  if (is_finite(pivot) && glm::length(pivot) < 1e6) model.pivot = model.position = sizes.place(pivot);
  return model;
}

// Blue, green, red and a byte of light.
Rgba8 colour_of(std::span<const std::byte> bgr) {
  QUOIN_ASSERT(bgr.size() >= 3, "three channels");
  return {std::to_integer<std::uint8_t>(bgr[2]), std::to_integer<std::uint8_t>(bgr[1]),
          std::to_integer<std::uint8_t>(bgr[0]), 255};
}

// Six bits per channel, like VGA palettes.
Rgba8 colour_of(std::span<const std::byte> palette, std::uint8_t index) {
  QUOIN_ASSERT(palette.size() == kPaletteBytes, "a palette of 256 colours");
  const auto channel = [&](std::size_t i) {
    const auto six = std::to_integer<unsigned>(palette[std::size_t{3} * index + i]) & 63U;
    return static_cast<std::uint8_t>(six << 2 | six >> 4);
  };
  return {channel(0), channel(1), channel(2), 255};
}

bool is_kv6(std::span<const std::byte> beginning) {
  return ByteReader(beginning).text(4) == "Kvxl";
}

Result<LoadedScene> read_kv6(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  static_cast<void>(reader.u32());
  const auto sizes = read_sizes(reader);
  if (!sizes) return bad_at(4, "the size is out of range");
  const float pivot_x = reader.f32();
  const float pivot_y = reader.f32();
  const float pivot_z = reader.f32();
  const std::size_t voxels = reader.count(8);
  ByteReader voxel = reader;
  static_cast<void>(reader.take(voxels * 8));
  static_cast<void>(reader.take(std::size_t{4} * static_cast<std::size_t>(sizes->x)));  // voxels of each x
  if (reader.failed()) return bad_at(bytes.size(), "the file ends before its voxels");
  ModelBuilder builder;
  builder.begin(model_of(*sizes, DVec3(pivot_x, pivot_y, pivot_z)));
  std::size_t read = 0;
  for (int x = 0; x < sizes->x; ++x) {
    for (int y = 0; y < sizes->y; ++y) {
      const std::size_t at = reader.position();
      const std::size_t count = reader.u16();
      if (reader.failed()) return bad_at(bytes.size(), "the file ends before its columns");
      read += count;
      if (read > voxels) return bad_at(at, "the columns have more voxels than the file");
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t place = voxel.position();
        const Rgba8 colour = colour_of(voxel.take(4));
        const int z = voxel.u16();
        static_cast<void>(voxel.u16());  // faces that are seen, and a normal
        if (z >= sizes->z) return bad_at(place, "a voxel is below its model");
        if (auto put = builder.put(sizes->place(x, y, z), colour); !put) return put.error();
      }
    }
  }
  if (read != voxels)
    return bad_at(reader.position(),
                  "the columns have " + std::to_string(read) + " of the file's " + std::to_string(voxels) + " voxels");
  return builder.take("voxlap");
}

/// The offsets of a KVX file's parts.
struct KvxLayout {
  Sizes sizes;
  DVec3 pivot{0.0};
  std::size_t tables = 0;  ///< offsets of x, then of x and y, from here
  std::size_t end = 0;     ///< of the first level of detail
};

std::optional<KvxLayout> kvx_layout(std::span<const std::byte> whole) {
  if (whole.size() < kPaletteBytes + 28) return std::nullopt;
  ByteReader reader(whole);
  const std::uint64_t level = reader.u32();
  if (level + 4 + kPaletteBytes > whole.size()) return std::nullopt;
  const auto sizes = read_sizes(reader);
  if (!sizes || sizes->z > 255) return std::nullopt;
  KvxLayout layout{*sizes};
  constexpr double kFixed = 256.0;
  layout.pivot.x = reader.i32() / kFixed;
  layout.pivot.y = reader.i32() / kFixed;
  layout.pivot.z = reader.i32() / kFixed;
  layout.tables = reader.position();
  layout.end = static_cast<std::size_t>(level) + 4;
  const std::size_t slabs = 4 * (static_cast<std::size_t>(sizes->x) + 1) +
                            2 * static_cast<std::size_t>(sizes->x) * (static_cast<std::size_t>(sizes->y) + 1);
  if (reader.u32() != slabs || layout.tables + slabs > layout.end) return std::nullopt;
  return layout;
}

bool is_kvx(std::span<const std::byte> whole) {
  return kvx_layout(whole).has_value();
}

Result<LoadedScene> read_kvx(std::span<const std::byte> bytes) {
  const auto layout = kvx_layout(bytes);
  if (!layout) return bad_at(0, "the column tables do not match the model's size");
  const Sizes& sizes = layout->sizes;
  const std::span<const std::byte> palette = bytes.last(kPaletteBytes);
  ModelBuilder builder;
  builder.begin(model_of(sizes, layout->pivot));
  const std::size_t columns = layout->tables + 4 * (static_cast<std::size_t>(sizes.x) + 1);
  for (int x = 0; x < sizes.x; ++x) {
    ByteReader of_x(bytes, layout->tables + std::size_t{4} * static_cast<std::size_t>(x), bytes.size());
    const std::size_t first = of_x.u32();
    ByteReader of_y(bytes, columns + 2 * static_cast<std::size_t>(x) * (static_cast<std::size_t>(sizes.y) + 1),
                    bytes.size());
    std::size_t begin = of_y.u16();
    for (int y = 0; y < sizes.y; ++y) {
      const std::size_t end = of_y.u16();
      const std::size_t from = layout->tables + first + std::exchange(begin, end);
      const std::size_t to = layout->tables + first + end;
      if (from > to || to > layout->end) return bad_at(of_y.position() - 2, "a column is outside the voxel data");
      ByteReader slab(bytes, from, to);
      while (slab.remaining() > 0) {
        const std::size_t at = slab.position();
        const int top = slab.u8();
        const int length = slab.u8();
        static_cast<void>(slab.u8());  // faces that are seen
        const auto indices = slab.take(static_cast<std::size_t>(length));
        if (slab.failed() || top + length > sizes.z) return bad_at(at, "a slab extends past its column");
        for (int i = 0; i < length; ++i) {
          const auto index = std::to_integer<std::uint8_t>(indices[static_cast<std::size_t>(i)]);
          if (auto put = builder.put(sizes.place(x, y, top + i), colour_of(palette, index)); !put) return put.error();
        }
      }
    }
  }
  return builder.take("voxlap");
}

Result<LoadedScene> read_slab6(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  const auto read = read_sizes(reader);
  if (!read || !vox::is_slab6(bytes)) return bad_at(0, "the file size does not match the model's three sizes");
  constexpr std::uint8_t kEmpty = 255;
  const Sizes& sizes = *read;
  const std::span<const std::byte> palette = bytes.last(kPaletteBytes);
  ModelBuilder builder;
  builder.begin(model_of(sizes, DVec3(0.0, 0.0, sizes.z)));
  for (int x = 0; x < sizes.x; ++x) {
    for (int y = 0; y < sizes.y; ++y) {
      for (int z = 0; z < sizes.z; ++z) {
        const std::uint8_t index = reader.u8();
        if (index == kEmpty) continue;
        if (auto put = builder.put(sizes.place(x, y, z), colour_of(palette, index)); !put) return put.error();
      }
    }
  }
  return builder.take("voxlap");
}

// Ace of Spades maps have no header. They are 64 high; since version 1.0 they are 240 high and columns may be empty.
constexpr std::array<Sizes, 2> kAceOfSpades = {{{512, 512, 64}, {512, 512, 240}}};
constexpr Sizes kVoxlapMap{1024, 1024, 256};

/// The offset and number of a map's columns.
struct VxlLayout {
  Sizes sizes = kAceOfSpades[0];
  std::size_t columns = 0;
};

/// Returns the layout from a header; the lower map has none.
VxlLayout layout_in_header(std::span<const std::byte> whole) {
  ByteReader reader(whole);
  if (reader.u32() != kVoxlapMagic) return {};
  // The two sizes and the start position: a point and three axes.
  constexpr std::size_t kHeader = 12 + 12 * sizeof(double);
  VxlLayout layout{kVoxlapMap, kHeader};
  layout.sizes.x = static_cast<int>(std::min(reader.u32(), kMaxVoxlapEdge));
  layout.sizes.y = static_cast<int>(std::min(reader.u32(), kMaxVoxlapEdge));
  return layout;
}

/// Reads one column from above. `take(z, count, colour)`: a null colour is ground without a colour. Returns false if
/// the column does not fit its map.
template <class Take>
bool read_column(ByteReader& reader, int depth, Take take) {
  QUOIN_ASSERT(depth > 0 && depth <= 256, "depths of one byte");
  int z = 0;
  for (;;) {
    const int words = reader.u8();
    const int top_begin = reader.u8();
    const int top_end = reader.u8();
    static_cast<void>(reader.u8());  // the top of the air above, from the previous span
    const int top = top_end - top_begin + 1;
    if (reader.failed() || top_begin < z || top < 0 || top_end >= depth) return false;
    for (int i = 0; i < top; ++i) {
      const auto colour = reader.take(4);
      if (colour.empty()) return false;
      take(top_begin + i, 1, &colour);
    }
    if (words == 0) {
      if (top_end + 1 < depth) take(top_end + 1, depth - top_end - 1, nullptr);
      return true;
    }
    const int bottom = words - 1 - top;
    if (bottom < 0 || reader.remaining() < static_cast<std::size_t>(bottom) * 4 + 4) return false;
    const auto colours = reader.take(static_cast<std::size_t>(bottom) * 4);
    ByteReader next = reader;
    static_cast<void>(next.take(3));
    const int air = next.u8();
    const int bottom_begin = air - bottom;
    if (bottom_begin < top_end + 1 || air > depth) return false;
    if (bottom_begin > top_end + 1) take(top_end + 1, bottom_begin - top_end - 1, nullptr);
    for (int i = 0; i < bottom; ++i) {
      const auto colour = colours.subspan(static_cast<std::size_t>(i) * 4, 4);
      take(bottom_begin + i, 1, &colour);
    }
    z = air;
  }
}

/// Returns true if all columns fit a map, and fill its file if it has no header.
bool fits(std::span<const std::byte> whole, const VxlLayout& layout) {
  if (layout.columns > whole.size() || layout.sizes.x == 0 || layout.sizes.y == 0) return false;
  ByteReader reader(whole, layout.columns, whole.size());
  const std::int64_t columns = std::int64_t{layout.sizes.x} * layout.sizes.y;
  for (std::int64_t i = 0; i < columns; ++i) {
    if (!read_column(reader, layout.sizes.z, [](int, int, const std::span<const std::byte>*) {})) return false;
  }
  return layout.columns != 0 || reader.remaining() == 0;
}

/// Returns the lowest map that the columns fit, for files without a header.
VxlLayout vxl_layout(std::span<const std::byte> whole) {
  const VxlLayout said = layout_in_header(whole);
  if (said.columns != 0) return said;
  for (const Sizes& sizes : kAceOfSpades) {
    if (fits(whole, {sizes, 0})) return {sizes, 0};
  }
  return said;
}

bool is_vxl(std::span<const std::byte> whole) {
  return fits(whole, vxl_layout(whole));
}

Result<LoadedScene> read_vxl(std::span<const std::byte> bytes) {
  const VxlLayout layout = vxl_layout(bytes);
  const Sizes& sizes = layout.sizes;
  ModelBuilder builder;
  builder.begin(model_of(sizes, DVec3(0.0, 0.0, sizes.z)));
  ByteReader reader(bytes, std::min(layout.columns, bytes.size()), bytes.size());
  for (int y = 0; y < sizes.y; ++y) {
    for (int x = 0; x < sizes.x; ++x) {
      const std::size_t at = reader.position();
      Status done;
      const auto take = [&](int z, int count, const std::span<const std::byte>* colour) {
        if (!done) return;
        done = builder.put(sizes.place(x, y, z + count - 1), colour != nullptr ? colour_of(*colour) : kEarth, count);
      };
      if (!read_column(reader, sizes.z, take)) {
        return bad_at(at, "column (" + std::to_string(x) + ", " + std::to_string(y) + ") extends past the map");
      }
      if (!done) return done.error();
    }
  }
  return builder.take("voxlap");
}

/// Reads a file of any of the formats.
Result<LoadedScene> read_voxlap(const FormatInput& input) {
  if (is_kv6(input.bytes)) return read_kv6(input.bytes);
  if (is_kvx(input.bytes)) return read_kvx(input.bytes);
  if (vox::is_slab6(input.bytes)) return read_slab6(input.bytes);
  return read_vxl(input.bytes);
}

constexpr FormatHolds kHolds = {.extension = ".vxl"};
constexpr std::uint8_t kFullLight = 0x7F;

// The maps that are written, in this library's axes.
constexpr IVec3 kSmallMap{512, 64, 512};
constexpr IVec3 kLargeMap{1024, 256, 1024};

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
  /// Returns true if the scene's box reaches into the columns of a z.
  [[nodiscard]] bool reaches_slice(int z) const;
  void write_column(int x, ByteWriter& out);
  void write_bare_columns(int count, ByteWriter& out);
  void write_span(int begin, int end, bool is_last, int air, ByteWriter& out);
  [[nodiscard]] VoxelType at(const Slice& slice, int x, int depth) const {
    return slice[static_cast<std::size_t>(size_.y - 1 - depth) * static_cast<std::size_t>(size_.x) +
                 static_cast<std::size_t>(x)];
  }
  void colour(int depth, ByteWriter& out) const;
  static void write_colour(Rgba8 colour, ByteWriter& out);

  const MergedGrid& merged_;
  const std::vector<Rgba8>& colours_;
  IVec3 size_;
  IVec3 min_;                    // minimum corner of the map, in the grid
  std::array<Slice, 3> slices_;  // the column's z, and its two neighbours
  std::vector<VoxelType> column_;
  std::vector<bool> has_colour_;
  std::int64_t grounded_ = 0;
  ByteWriter bare_;  // a row of columns of air
};

void MapWriter::read_slice(int z, Slice& slice) const {
  slice.assign(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y), kAir);
  if (z < 0 || z >= size_.z || !reaches_slice(z)) return;
  for (int y = 0; y < size_.y; ++y) {
    const auto row = std::span(slice).subspan(static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x),
                                              static_cast<std::size_t>(size_.x));
    read_voxels(merged_.voxels, min_ + IVec3(0, y, z), row);
  }
}

bool MapWriter::reaches_slice(int z) const {
  return min_.z + z >= merged_.box.min.z && min_.z + z < merged_.box.max.z;
}

void MapWriter::colour(int depth, ByteWriter& out) const {
  const VoxelType type = column_[static_cast<std::size_t>(depth)];
  write_colour(type == kAir ? kEarth : colours_[type], out);
}

void MapWriter::write_colour(Rgba8 colour, ByteWriter& out) {
  out.u8(colour.b);
  out.u8(colour.g);
  out.u8(colour.r);
  out.u8(kFullLight);
}

/// Writes columns of air, with their ground.
void MapWriter::write_bare_columns(int count, ByteWriter& out) {
  QUOIN_ASSERT(count <= size_.x, "at most a row of columns");
  if (bare_.size() == 0) {
    const auto ground = static_cast<std::uint8_t>(size_.y - 1);
    for (int x = 0; x < size_.x; ++x) {
      for (const std::uint8_t part : {std::uint8_t{0}, ground, ground, std::uint8_t{0}}) bare_.u8(part);
      write_colour(kEarth, bare_);
    }
  }
  grounded_ += count;
  out.raw(bare_.bytes().first(bare_.size() / static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(count)));
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
    const int first = reaches_slice(z) ? std::clamp(merged_.box.min.x - min_.x, 0, size_.x) : size_.x;
    const int last = reaches_slice(z) ? std::clamp(merged_.box.max.x - min_.x, first, size_.x) : size_.x;
    write_bare_columns(first, out);
    for (int x = first; x < last; ++x) write_column(x, out);
    write_bare_columns(size_.x - last, out);
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

/// Writes an Ace of Spades map if the scene fits 512 x 64 x 512 voxels, or a Voxlap map if it fits 1024 x 256 x 1024.
/// The scene keeps its position if that is within the map, and is centred otherwise. Each column gets ground below it,
/// since the format requires it.
Result<EncodedFile> write_vxl(const FormatOutput& output) {
  auto merged = merge_grids(output.scene, kHolds);
  if (!merged) return merged.error();
  const IVec3 extent = merged->box.empty() ? IVec3(0) : merged->box.size();
  const bool is_small = holds(kSmallMap, extent);
  if (!is_small && !holds(kLargeMap, extent)) {
    return make_error(ErrorCode::LimitExceeded, "larger than the 1024 x 256 x 1024 voxels of a .vxl map");
  }
  const IVec3 size = is_small ? kSmallMap : kLargeMap;
  IVec3 min(0);
  const bool fits = merged->box.empty() || (merged->box.min.x >= 0 && merged->box.min.y >= 0 &&
                                            merged->box.min.z >= 0 && holds(size, merged->box.max));
  if (!fits) {
    min = merged->box.min - (size - extent) / 2;
    min.y = merged->box.min.y;
    merged->warnings.push_back("moved to the centre of the map by " + std::to_string(-min.x) + ", " +
                               std::to_string(-min.y) + ", " + std::to_string(-min.z));
  }
  const std::vector<Rgba8> colours = colours_of(output.scene.types);
  MapWriter writer(*merged, colours, size, min);
  ByteWriter out;
  if (!is_small) write_header(size, out);
  if (auto done = writer.run(out, output.progress); !done) return done.error();
  if (writer.grounded() != 0) {
    merged->warnings.push_back("columns given a ground voxel, since .vxl needs one in every column: " +
                               with_thousands(writer.grounded()));
  }
  return EncodedFile{out.take(), std::move(merged->warnings)};
}

}  // namespace

}  // namespace quoin::models

namespace quoin {

extern constinit const FormatDriver kVoxlapFormat = {
    .info = {FileFormat::Voxlap, ".vxl", "Voxlap and Ace of Spades map; models: .kv6, .kvx and SLAB6 .vox",
             FormatCapability::Read | FormatCapability::Write, ".kv6 .kvx"},
    .detect = models::is_kv6,
    .detect_whole =
        [](std::span<const std::byte> whole) {
          return vox::is_slab6(whole) || models::is_kvx(whole) || models::is_vxl(whole);
        },
    .read = models::read_voxlap,
    .encode = models::write_vxl,
};

}  // namespace quoin

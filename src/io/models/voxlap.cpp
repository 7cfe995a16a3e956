// Ken Silverman's formats. The files' z points down; +x, -z, +y are this library's axes.
//
//   KV6    voxels of the surface by columns of x, then y: colour, height, faces
//   KVX    the same as slabs with a palette, for each level of detail; the first is read
//   SLAB6  an array of palette indices, 255 is empty
//   VXL    columns of spans: air, colours of an upper surface, solid ground, colours of a lower surface

#include <array>
#include <optional>
#include <string>
#include <utility>

#include "io/byte_reader.h"
#include "io/models/model_builder.h"
#include "io/models/models.h"

namespace quoin::models {

namespace {

constexpr std::uint32_t kMaxEdge = 4096;
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
    if (edge == 0 || edge > kMaxEdge) return std::nullopt;
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
  return {std::to_integer<std::uint8_t>(bgr[2]), std::to_integer<std::uint8_t>(bgr[1]),
          std::to_integer<std::uint8_t>(bgr[0]), 255};
}

// Six bits per channel, like VGA palettes.
Rgba8 colour_of(std::span<const std::byte> palette, std::uint8_t index) {
  const auto channel = [&](std::size_t i) {
    const auto six = std::to_integer<unsigned>(palette[std::size_t{3} * index + i]) & 63U;
    return static_cast<std::uint8_t>(six << 2 | six >> 4);
  };
  return {channel(0), channel(1), channel(2), 255};
}

}  // namespace

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

namespace {

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

}  // namespace

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

bool is_slab6(std::span<const std::byte> whole) {
  ByteReader reader(whole);
  const auto sizes = read_sizes(reader);
  return sizes && static_cast<std::uint64_t>(sizes->x) * static_cast<std::uint64_t>(sizes->y) *
                              static_cast<std::uint64_t>(sizes->z) +
                          kPaletteBytes ==
                      reader.remaining();
}

Result<LoadedScene> read_slab6(std::span<const std::byte> bytes) {
  if (!is_slab6(bytes)) return bad_at(0, "the file size does not match the model's three sizes");
  constexpr std::uint8_t kEmpty = 255;
  ByteReader reader(bytes);
  const Sizes sizes = *read_sizes(reader);
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

namespace {

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
  layout.sizes.x = static_cast<int>(std::min(reader.u32(), kMaxEdge));
  layout.sizes.y = static_cast<int>(std::min(reader.u32(), kMaxEdge));
  return layout;
}

/// Reads one column from above. `take(z, count, colour)`: a null colour is ground without a colour. Returns false if
/// the column does not fit its map.
template <class Take>
bool read_column(ByteReader& reader, int depth, Take take) {
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

}  // namespace

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

}  // namespace quoin::models

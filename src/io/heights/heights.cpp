#include "io/heights/heights.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/io/heights.h>
#include <quoin/terrain/terrain.h>

#include "core/bytes/bytes.h"
#include "io/format_driver.h"
#include "io/image/image_codecs.h"

namespace quoin {

namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";
/// The length of a degree of latitude.
constexpr double kMetresOfDegree = 111'320.0;
/// The edge lengths of .hgt files: three arc-seconds and one.
constexpr std::size_t kHgtEdges[] = {1201, 3601};

std::optional<std::size_t> hgt_edge(std::uint64_t bytes) {
  for (const std::size_t edge : kHgtEdges) {
    if (bytes == 2 * edge * edge) return edge;
  }
  return std::nullopt;
}

std::string_view name_of(HeightEncoding encoding) {
  switch (encoding) {
    case HeightEncoding::Grey:
      return "grey";
    case HeightEncoding::Mapbox:
      return "mapbox";
    case HeightEncoding::Terrarium:
      break;
  }
  return "terrarium";
}

HeightMap read_hgt(std::span<const std::byte> bytes, std::size_t edge) {
  QUOIN_ASSERT(edge > 1 && bytes.size() == 2 * edge * edge, "two bytes for each height");
  constexpr std::int16_t kVoid = -32'768;
  HeightMap map;
  map.format = "hgt";
  map.width = map.height = static_cast<int>(edge);
  map.metres_per_pixel = kMetresOfDegree / static_cast<double>(edge - 1);
  map.metres.resize(edge * edge);
  std::size_t voids = 0;
  for (std::size_t i = 0; i < map.metres.size(); ++i) {
    const auto height = load<std::int16_t>(bytes.data() + 2 * i, std::endian::big);
    voids += height == kVoid ? 1 : 0;
    map.metres[i] = height == kVoid ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(height);
  }
  if (voids > 0) {
    map.warnings.push_back(std::to_string(voids) + " of " + std::to_string(map.metres.size()) +
                           " heights are unknown (voids) and stay empty");
  }
  return map;
}

float metres_of(HeightEncoding encoding, const std::byte* rgb) {
  QUOIN_ASSERT(encoding != HeightEncoding::Grey && rgb != nullptr, "a pixel with three channels");
  const auto r = std::to_integer<std::uint32_t>(rgb[0]);
  const auto g = std::to_integer<std::uint32_t>(rgb[1]);
  const auto b = std::to_integer<std::uint32_t>(rgb[2]);
  const auto number = static_cast<double>(r << 16 | g << 8 | b);
  return static_cast<float>(encoding == HeightEncoding::Mapbox ? number / 10.0 - 10'000.0 : number / 256.0 - 32'768.0);
}

Result<HeightMap> read_image(std::span<const std::byte> bytes, HeightEncoding encoding, double metres_per_level) {
  const auto image = decode_png_samples(bytes);
  if (!image) return image.error();
  const bool is_grey = encoding == HeightEncoding::Grey;
  if (is_grey && image->channels != 1) {
    return make_error(ErrorCode::BadFormat,
                      "the image has colours, and grey heights need a greyscale image (colours: mapbox or terrarium)");
  }
  if (!is_grey && (image->channels != 3 || image->bits != 8)) {
    return make_error(ErrorCode::BadFormat,
                      std::string(name_of(encoding)) + " heights need an RGB image with 8 bits per channel");
  }
  HeightMap map;
  map.format = name_of(encoding);
  map.width = static_cast<int>(image->width);
  map.height = static_cast<int>(image->height);
  map.metres.resize(std::size_t{image->width} * image->height);
  QUOIN_ASSERT(image->bytes.size() == map.metres.size() * image->channels * (image->bits / 8),
               "a sample for each channel");
  const std::byte* const samples = image->bytes.data();
  for (std::size_t i = 0; i < map.metres.size(); ++i) {
    if (!is_grey) {
      map.metres[i] = metres_of(encoding, samples + 3 * i);
      continue;
    }
    const unsigned level = image->bits == 16 ? load<std::uint16_t>(samples + 2 * i, std::endian::big)
                                             : std::to_integer<unsigned>(samples[i]);
    map.metres[i] = static_cast<float>(level * metres_per_level);
  }
  return map;
}

}  // namespace

namespace heights {

bool is_hgt_size(std::uint64_t bytes) {
  return hgt_edge(bytes).has_value();
}

bool is_png(std::span<const std::byte> beginning) {
  return text_of(beginning).starts_with(kPngSignature);
}

Status check(const HeightOptions& options) {
  const auto is_length = [](double length) { return length >= 1e-6 && length <= 1e6; };
  const bool are_lengths = is_length(options.metres_per_level) && is_length(options.metres_per_pixel.value_or(1.0)) &&
                           is_length(options.metres_per_voxel.value_or(1.0)) &&
                           is_length(options.vertical_exaggeration);
  if (!are_lengths) {
    return make_error(
        ErrorCode::InvalidArgument,
        "metres per level, pixel and voxel, and the vertical exaggeration, must be 0.000001 to 1,000,000");
  }
  if (options.depth < 1 || options.depth > kMaxDepth) {
    return make_error(ErrorCode::InvalidArgument,
                      "the ground must be 1 to " + std::to_string(kMaxDepth) + " voxels deep");
  }
  return {};
}

}  // namespace heights

Result<HeightMap> read_height_map(std::span<const std::byte> bytes, const HeightOptions& options) {
  if (auto sound = heights::check(options); !sound) return sound.error();
  if (!options.encoding) {
    if (const auto edge = hgt_edge(bytes.size()); edge && !heights::is_png(bytes)) {
      HeightMap map = read_hgt(bytes, *edge);
      if (options.metres_per_pixel) map.metres_per_pixel = *options.metres_per_pixel;
      return map;
    }
    return make_error(ErrorCode::BadFormat,
                      heights::is_png(bytes)
                          ? "an image needs a height encoding: grey, mapbox or terrarium"
                          : "not an .hgt file, which has 1201 x 1201 or 3601 x 3601 values of 2 bytes");
  }
  if (!heights::is_png(bytes)) return bad_at(0, "not a PNG, which height-map images must be");
  auto map = read_image(bytes, *options.encoding, options.metres_per_level);
  if (!map) return map.error();
  if (options.metres_per_pixel) {
    map->metres_per_pixel = *options.metres_per_pixel;
  } else {
    map->warnings.emplace_back("the pixel distance is unknown and taken as 1 metre (--metres-per-pixel)");
  }
  return map;
}

namespace {

constexpr float kBand = 8.0F;
constexpr float kSteep = 1.0F;       // rise of a voxel
constexpr float kSandMetres = 2.0F;  // the highest level with sand
constexpr float kSnowMetres = 3'000.0F;
constexpr float kTopsoil = 4.0F;  // depth of soil above stone, in voxels

/// The materials of a ground column, from the top down.
struct Ground {
  VoxelType surface = kAir;
  VoxelType below = kAir;
};

/// The height above each column's corner, in voxels, and its materials.
struct Surface {
  int width = 0;
  int depth = 0;                 // along z
  std::vector<float> heights{};  // [z][x]; NaN: a void
  int base = 0;                  // the lowest voxel
  int top = 0;                   // above all voxels
  float metres_of_height = 1.0F;

  [[nodiscard]] float at(int x, int z) const {
    QUOIN_ASSERT(x >= 0 && x < width && z >= 0 && z < depth, "a column of the surface");
    return heights[static_cast<std::size_t>(z) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  [[nodiscard]] bool has(int x, int z) const {
    return x >= 0 && z >= 0 && x < width && z < depth && !std::isnan(at(x, z));
  }
  /// Returns the slope per voxel along an axis; one-sided next to a void or the border. Requires: has(x, z).
  [[nodiscard]] float rise(int x, int z, int step_x, int step_z) const {
    const bool has_before = has(x - step_x, z - step_z);
    const bool has_after = has(x + step_x, z + step_z);
    const float before = has_before ? at(x - step_x, z - step_z) : at(x, z);
    const float after = has_after ? at(x + step_x, z + step_z) : at(x, z);
    return (after - before) / (has_before && has_after ? 2.0F : 1.0F);
  }
  [[nodiscard]] float steepness(int x, int z) const { return std::hypot(rise(x, z, 1, 0), rise(x, z, 0, 1)); }
  [[nodiscard]] Ground ground(int x, int z, const TerrainTypes& types) const {
    const float metres = at(x, z) * metres_of_height;
    if (steepness(x, z) > kSteep) return {types.stone, types.stone};
    if (metres > kSnowMetres) return {types.snow, types.stone};
    if (metres <= kSandMetres) return {types.sand, types.sand};
    return {types.grass, types.earth};
  }
};

/// The range of heights in a column of chunks.
struct Range {
  float lowest = std::numeric_limits<float>::infinity();
  float highest = -std::numeric_limits<float>::infinity();
  bool is_whole = true;  // no voids, and nothing beyond the border
};

Result<Surface> surface_of(const HeightMap& map, const HeightOptions& options) {
  const double voxel = options.metres_per_voxel.value_or(map.metres_per_pixel);
  const double step = voxel / map.metres_per_pixel;  // pixels per voxel
  const double scale = options.vertical_exaggeration / voxel;
  const auto count = [&](int pixels) { return std::floor((pixels - 1) / step + 1e-6) + 1.0; };
  constexpr double kMaxColumns = 0x1p26;
  if (!(count(map.width) * count(map.height) <= kMaxColumns)) {
    return make_error(ErrorCode::LimitExceeded, "the landscape has more than 2^26 columns; use larger voxels");
  }
  Surface surface;
  surface.width = static_cast<int>(count(map.width));
  surface.depth = static_cast<int>(count(map.height));
  surface.metres_of_height = static_cast<float>(1.0 / scale);
  surface.heights.resize(static_cast<std::size_t>(surface.width) * static_cast<std::size_t>(surface.depth));
  const auto pixel = [&](int x, int y) {
    QUOIN_ASSERT(x >= 0 && y >= 0, "a pixel of the map");
    const std::size_t row = static_cast<std::size_t>(std::min(y, map.height - 1)) * static_cast<std::size_t>(map.width);
    return double{map.metres[row + static_cast<std::size_t>(std::min(x, map.width - 1))]};
  };
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (int z = 0; z < surface.depth; ++z) {
    for (int x = 0; x < surface.width; ++x) {
      const double at_x = std::min(x * step, map.width - 1.0);
      const double at_y = std::min(z * step, map.height - 1.0);
      const int px = static_cast<int>(at_x);
      const int py = static_cast<int>(at_y);
      const double fx = at_x - px;
      const double fy = at_y - py;
      // At a pixel the result is the pixel's height, even next to a void.
      const auto mix = [](double a, double b, double share) { return share < 1e-6 ? a : a + share * (b - a); };
      const double metres =
          mix(mix(pixel(px, py), pixel(px + 1, py), fx), mix(pixel(px, py + 1), pixel(px + 1, py + 1), fx), fy);
      const double height = metres * scale;
      surface.heights[static_cast<std::size_t>(z) * static_cast<std::size_t>(surface.width) +
                      static_cast<std::size_t>(x)] = static_cast<float>(height);
      if (std::isnan(height)) continue;
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
  }
  if (lowest > highest) return surface;
  constexpr double kMaxHeight = 0x1p16;
  constexpr double kMaxPlace = 0x1p24;
  if (highest - lowest + options.depth > kMaxHeight || std::max(-lowest, highest) > kMaxPlace) {
    return make_error(ErrorCode::LimitExceeded, "a column has more than 2^16 voxels; use larger voxels");
  }
  surface.base = static_cast<int>(std::floor(lowest)) - options.depth;
  surface.top = static_cast<int>(std::ceil(highest)) + 1;
  return surface;
}

Range range_of(const Surface& surface, int first_x, int first_z) {
  Range range;
  for (int z = first_z - 1; z <= first_z + kChunkEdge; ++z) {
    for (int x = first_x - 1; x <= first_x + kChunkEdge; ++x) {
      if (!surface.has(x, z)) {
        range.is_whole = false;
        continue;
      }
      range.lowest = std::min(range.lowest, surface.at(x, z));
      range.highest = std::max(range.highest, surface.at(x, z));
    }
  }
  return range;
}

/// Makes the chunks column by column. Each thread has its own instance.
class ColumnMaker {
 public:
  ColumnMaker(const Surface& surface, const TerrainTypes& types, int chunk_x, int chunk_z)
      : surface_(surface),
        types_(types),
        first_x_(chunk_x * kChunkEdge),
        first_z_(chunk_z * kChunkEdge),
        range_(range_of(surface, first_x_, first_z_)) {
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int x = 0; x < kChunkEdge; ++x) {
        if (!surface.has(first_x_ + x, first_z_ + z)) continue;
        ground_[place(x, z)] = surface.ground(first_x_ + x, first_z_ + z, types);
        const float steepness = surface.steepness(first_x_ + x, first_z_ + z);
        slope_[place(x, z)] = std::sqrt(1.0F + steepness * steepness);
      }
    }
  }

  /// Returns null if the chunk is all air.
  [[nodiscard]] std::optional<Chunk> voxels(int chunk_y) {
    const int first_y = chunk_y * kChunkEdge;
    if (static_cast<float>(first_y) > range_.highest + 1.0F) return std::nullopt;
    if (is_within(first_y, kTopsoil + 1.0F)) return Chunk(types_.stone);
    dense_.assign(kChunkVoxels, kAir);
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int x = 0; x < kChunkEdge; ++x) {
        if (ground_[place(x, z)].surface == kAir) continue;
        const float height = surface_.at(first_x_ + x, first_z_ + z);
        const int top = std::max(static_cast<int>(std::lround(height)), surface_.base + 1);
        for (int y = std::max(first_y, surface_.base); y < std::min(first_y + kChunkEdge, top); ++y) {
          dense_[static_cast<std::size_t>((z * kChunkEdge + y - first_y) * kChunkEdge + x)] =
              type_at(ground_[place(x, z)], static_cast<float>(top - 1 - y));
        }
      }
    }
    return Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense_));
  }

  /// Returns null if the chunk is all far air.
  [[nodiscard]] std::optional<DensityChunk> densities(int chunk_y) {
    const int first_y = chunk_y * kChunkEdge;
    if (static_cast<float>(first_y) > range_.highest + kBand * 2.0F) return std::nullopt;
    if (is_within(first_y, kBand * steepest())) return DensityChunk(stored_density(-kBand, kBand), types_.stone);
    DensityChunk chunk(stored_density(kBand, kBand));
    dense_.assign(kChunkVoxels, kAir);
    std::array<float, kChunkEdge> row{};
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        for (int x = 0; x < kChunkEdge; ++x) {
          const float density = density_at(x, first_y + y, z);
          row[static_cast<std::size_t>(x)] = density;
          if (density >= kBand || ground_[place(x, z)].surface == kAir) continue;
          const float below = surface_.at(first_x_ + x, first_z_ + z) - static_cast<float>(first_y + y);
          dense_[static_cast<std::size_t>((z * kChunkEdge + y) * kChunkEdge + x)] =
              type_at(ground_[place(x, z)], std::max(below, 0.0F));
        }
        chunk.write_row(y, z, row, kBand);
      }
    }
    chunk.materials() = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense_));
    chunk.compact();
    return chunk;
  }

 private:
  [[nodiscard]] static std::size_t place(int x, int z) {
    QUOIN_ASSERT(((x | z) & ~(kChunkEdge - 1)) == 0, "a column of the chunk");
    return static_cast<std::size_t>(z * kChunkEdge + x);
  }
  /// Returns true if a chunk lies at least `below` under the ground and above the bottom.
  [[nodiscard]] bool is_within(int first_y, float below) const {
    return range_.is_whole && static_cast<float>(first_y + kChunkEdge) + below <= range_.lowest &&
           first_y >= surface_.base + static_cast<int>(kBand) && is_far_from_border();
  }
  [[nodiscard]] bool is_far_from_border() const {
    const int reach = static_cast<int>(kBand) + 1;
    return first_x_ >= reach && first_z_ >= reach && first_x_ + kChunkEdge + reach < surface_.width &&
           first_z_ + kChunkEdge + reach < surface_.depth;
  }
  [[nodiscard]] float steepest() const { return *std::ranges::max_element(slope_); }
  /// `below`: the surface, in voxels.
  [[nodiscard]] VoxelType type_at(const Ground& ground, float below) const {
    if (below < 1.0F) return ground.surface;
    return below < kTopsoil ? ground.below : types_.stone;
  }
  [[nodiscard]] float density_at(int x, int y, int z) const {
    const int world_x = first_x_ + x;
    const int world_z = first_z_ + z;
    // The ground ends halfway between a ground sample and an air sample.
    constexpr float kHalf = 0.5F;
    float highest = -std::numeric_limits<float>::infinity();
    bool is_next_to_void = false;
    for (int i = 0; i < 9; ++i) {
      const int near_x = world_x + i % 3 - 1;
      const int near_z = world_z + i / 3 - 1;
      if (surface_.has(near_x, near_z)) highest = std::max(highest, surface_.at(near_x, near_z));
      is_next_to_void |= !surface_.has(near_x, near_z);
    }
    const auto height = static_cast<float>(y);
    if (!surface_.has(world_x, world_z)) {
      return std::isinf(highest) ? kBand : std::max(kHalf, height - highest);
    }
    QUOIN_ASSERT(slope_[place(x, z)] >= 1.0F, "1 <= slope");
    float density = (height - surface_.at(world_x, world_z)) / slope_[place(x, z)];
    density = std::max(density, static_cast<float>(surface_.base - y) + kHalf);
    const int inside = std::min({world_x, world_z, surface_.width - 1 - world_x, surface_.depth - 1 - world_z});
    density = std::max(density, kHalf - static_cast<float>(inside));
    return is_next_to_void && inside > 0 ? std::max(density, -kHalf) : density;
  }

  const Surface& surface_;
  const TerrainTypes& types_;
  int first_x_;
  int first_z_;
  Range range_;
  std::array<Ground, std::size_t{kChunkEdge} * kChunkEdge> ground_{};
  std::array<float, std::size_t{kChunkEdge} * kChunkEdge> slope_{};
  std::vector<VoxelType> dense_;
};

Status make_ground(const Surface& surface, const TerrainTypes& types, bool is_field, Threads threads,
                   const Progress& progress, SceneGrid& content) {
  const IVec3 first{0, chunk_of(IVec3(surface.base - 1)).y, 0};
  // Continues the field until it is far air.
  const IVec3 last = chunk_of({surface.width, surface.top + static_cast<int>(kBand) * 2, surface.depth});
  QUOIN_ASSERT(last.x >= 0 && last.z >= 0 && last.y >= first.y, "at least one chunk");
  const std::size_t across = static_cast<std::size_t>(last.x) + 1;
  const std::size_t count = across * (static_cast<std::size_t>(last.z) + 1);
  const std::size_t up = static_cast<std::size_t>(last.y - first.y) + 1;
  constexpr std::size_t kBatch = 16;
  struct Made {
    std::vector<std::optional<Chunk>> voxels;
    std::vector<std::optional<DensityChunk>> densities;
  };
  std::vector<Made> made(std::min(kBatch, count));
  const auto place = [&](std::size_t i) {
    return IVec3{static_cast<int>(i % across), 0, static_cast<int>(i / across)};
  };
  for (std::size_t begin = 0; begin < count; begin += kBatch) {
    if (progress && !progress(static_cast<double>(begin) / static_cast<double>(count))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
    const std::size_t batch = std::min(kBatch, count - begin);
    parallel_for(batch, threads, [&](std::size_t i) {
      ColumnMaker maker(surface, types, place(begin + i).x, place(begin + i).z);
      made[i] = {};
      for (std::size_t y = 0; y < up; ++y) {
        const int chunk_y = first.y + static_cast<int>(y);
        if (is_field) {
          made[i].densities.push_back(maker.densities(chunk_y));
        } else {
          made[i].voxels.push_back(maker.voxels(chunk_y));
        }
      }
    });
    for (std::size_t i = 0; i < batch; ++i) {
      for (std::size_t y = 0; y < up; ++y) {
        const IVec3 chunk = place(begin + i) + IVec3{0, first.y + static_cast<int>(y), 0};
        if (is_field && made[i].densities[y]) content.field.put_chunk(chunk, std::move(*made[i].densities[y]));
        if (!is_field && made[i].voxels[y]) content.grid.put_chunk(chunk, std::move(*made[i].voxels[y]));
      }
    }
  }
  return {};
}

}  // namespace

Result<Scene> scene_from_heights(const HeightMap& map, const HeightOptions& options, Threads threads,
                                 const Progress& progress) {
  if (auto sound = heights::check(options); !sound) return sound.error();
  const bool is_sound = map.width > 0 && map.height > 0 && std::isfinite(map.metres_per_pixel) &&
                        map.metres_per_pixel > 0.0 &&
                        map.metres.size() == static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height);
  if (!is_sound) return make_error(ErrorCode::InvalidArgument, "the number of heights is not width x height");
  const auto surface = surface_of(map, options);
  if (!surface) return surface.error();
  Scene scene;
  const auto types = add_terrain_types(scene.types);
  if (!types) return types.error();
  SceneGrid content;
  content.name = "heights";
  content.field = DensityGrid(kBand);
  if (surface->top > surface->base) {
    content.canvas = {{0, surface->base, 0}, {surface->width, surface->top, surface->depth}};
    if (auto done = make_ground(*surface, *types, options.as_field, threads, progress, content); !done) {
      return done.error();
    }
  }
  Instance instance;
  instance.name = content.name;
  instance.voxel_size = options.metres_per_voxel.value_or(map.metres_per_pixel);
  instance.grid = scene.add_grid(std::move(content));
  scene.add_instance(std::move(instance));
  return scene;
}

extern constinit const FormatDriver kHeightsFormat = {
    .info = {FileFormat::Heights, ".hgt", "SRTM heights; height-map images (.png) with --heights",
             FormatCapability::Read},
    .detect_path =
        [](const std::filesystem::path& path) {
          std::error_code unknown_size;
          return lower_case_extension(path) == ".hgt" &&
                 heights::is_hgt_size(std::filesystem::file_size(path, unknown_size));
        },
    .read = [](const FormatInput& input) -> Result<LoadedScene> {
      const HeightOptions wanted = input.options.heights.value_or(HeightOptions{});
      auto map = read_height_map(input.bytes, wanted);
      if (!map) return map.error();
      auto scene = scene_from_heights(*map, wanted, input.threads, input.progress);
      if (!scene) return scene.error();
      LoadedScene loaded;
      loaded.scene = std::move(*scene);
      loaded.format = "heights";
      loaded.warnings = std::move(map->warnings);
      return loaded;
    },
};

}  // namespace quoin

#include <quoin/terrain/terrain.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/terrain/noise.h>

#include "terrain/landform.h"
#include "terrain/noise_lattice.h"

namespace quoin::terrain {
namespace {

/// The heights of one column of chunks, and other data that its chunks share. Generates the chunks one by one.
class SmoothColumn {
 public:
  /// `world`: the samples of the world.
  SmoothColumn(const Landform& land, const SmoothTerrainOptions& options, const IBox& world, int chunk_x, int chunk_z);
  ~SmoothColumn();

  [[nodiscard]] DensityChunk make(const TerrainTypes& types, int chunk_y);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

constexpr std::uint32_t kOverhangs = 0xC00;
constexpr std::uint32_t kWild = 0xD00;
constexpr std::uint32_t kCaveA = 0xE00;
constexpr std::uint32_t kCaveB = 0xF00;
constexpr std::uint32_t kMeadow = 0x1000;

constexpr float kBand = 8.0F;
// Maximum steepness: a density is the height above the ground divided by the steepness of its field.
constexpr float kSteepest = 4.0F;
constexpr float kFarHeight = kBand * kSteepest;

// Cliffs, in parts of the world's height.
constexpr double kAmplitude = 0.26;
constexpr double kWavelength = 0.2;
constexpr double kMaxNoise = 1.45;  // of both octaves together

constexpr double kCaveAcross = 1.0 / 56.0;
constexpr double kCaveUp = 1.0 / 38.0;
constexpr float kCaveWidth = 0.15F;    // in units of the noises
constexpr float kCaveSamples = 34.0F;  // to a unit of the noises
constexpr float kUncavedLayers = 12.0F;

constexpr float kSteepNormal = 0.62F;
constexpr float kSoilDepth = 3.5F;
constexpr float kTurfDepth = 2.2F;

// The cover of flat ground, by height.
struct Cover {
  VoxelType turf = kAir;
  VoxelType soil = kAir;
};

struct SmoothColumn::Impl {
  Impl(const Landform& landform, const SmoothTerrainOptions& options, const IBox& samples, IVec3 first)
      : land(landform), has_overhangs(options.overhangs), has_caves(options.caves), world(samples), origin(first) {
    measure_columns();
    measure_overhangs();
  }

  Landform land;
  bool has_overhangs;
  bool has_caves;
  IBox world;
  IVec3 origin{0};  // of the column; y is 0

  std::array<float, kFieldEdge * kFieldEdge> heights{};          // [z][x], of samples -1 to 64
  std::array<double, kLatticeEdge * kLatticeEdge> amplitudes{};  // [z][x], of overhangs
  std::array<bool, kChunkEdge * kChunkEdge> is_meadow{};         // [z][x]
  float highest = 0.0F;
  float lowest = 0.0F;
  double largest_amplitude = 0.0;

  Lattice lattice;
  Lattice lattice_b;
  Field above;  // height above the ground, displaced by overhangs
  Field cave_a;
  Field cave_b;
  std::vector<VoxelType> materials = std::vector<VoxelType>(kChunkVoxels);

  void measure_columns();
  void measure_overhangs();
  bool fill_ground(IVec3 corner);
  bool fill_caves(IVec3 corner);
  [[nodiscard]] float cave(int x, int y, int z, int world_y) const;
  [[nodiscard]] float outside_of_world(IVec3 sample) const;
  [[nodiscard]] bool is_deep_in_world(IVec3 corner) const {
    return outside_of_world(corner) <= -kBand && outside_of_world(corner + (kChunkEdge - 1)) <= -kBand;
  }
  [[nodiscard]] Cover cover(const TerrainTypes& types, int x, int world_y, int z) const;
  void write_row(const TerrainTypes& types, IVec3 corner, int y, int z, bool is_caved, DensityChunk& out);
};

void SmoothColumn::Impl::measure_columns() {
  for (int z = 0; z < kFieldEdge; ++z) {
    for (int x = 0; x < kFieldEdge; ++x) {
      heights[static_cast<std::size_t>(z * kFieldEdge + x)] =
          static_cast<float>(land.exact_height(origin.x + x - 1, origin.z + z - 1));
    }
  }
  const auto [least, most] = std::minmax_element(heights.begin(), heights.end());
  lowest = *least;
  highest = *most;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int x = 0; x < kChunkEdge; ++x) {
      const double noise = fractal2(land.seed() + kMeadow, 0.035 * (origin.x + x), 0.035 * (origin.z + z), 2);
      is_meadow[static_cast<std::size_t>(z * kChunkEdge + x)] = noise > 0.16;
    }
  }
}

// Overhangs grow where a low-frequency noise is high, and never through the floor or the top of the world.
void SmoothColumn::Impl::measure_overhangs() {
  if (!has_overhangs) return;
  const double top = land.top();
  for (int z = 0; z < kLatticeEdge; ++z) {
    for (int x = 0; x < kLatticeEdge; ++x) {
      const int px = origin.x + (x - 1) * kLatticeStep;
      const int pz = origin.z + (z - 1) * kLatticeStep;
      const double frequency = 1.0 / (1.7 * top);
      const double wild = smooth_step(-0.12, 0.3, fractal2(land.seed() + kWild, frequency * px, frequency * pz, 2));
      const double height = land.exact_height(px, pz);
      const double room = std::max(0.0, std::min(0.6 * (top - 6.0 - height), 0.6 * (height - 4.0)));
      const double amplitude = std::min(kAmplitude * top * wild, room);
      amplitudes[static_cast<std::size_t>(z * kLatticeEdge + x)] = amplitude;
      largest_amplitude = std::max(largest_amplitude, amplitude);
    }
  }
}

// Returns false if everything is so far above or below the ground that only caves matter.
bool SmoothColumn::Impl::fill_ground(IVec3 corner) {
  const auto most = static_cast<float>(largest_amplitude * kMaxNoise);
  const auto first = static_cast<float>(corner.y - 1);
  const auto last = static_cast<float>(corner.y + kChunkEdge);
  if (first - highest - most >= kFarHeight) return above.fill(kFarHeight), false;
  if (last - lowest + most <= -kFarHeight) return above.fill(-kFarHeight), false;
  const double frequency = 1.0 / (kWavelength * land.top());
  lattice.fill(corner, [&](IVec3 at, std::size_t column) {
    const double amplitude = amplitudes[column];
    if (amplitude == 0.0) return 0.0;
    const double px = frequency * at.x;
    const double py = 1.3 * frequency * at.y;
    const double pz = frequency * at.z;
    const double coarse = noise3(land.seed() + kOverhangs, px, py, pz);
    return amplitude * (coarse + 0.4 * noise3(land.seed() + kOverhangs + 1, 2.1 * px, 2.1 * py, 2.1 * pz));
  });
  above.upsample(lattice);
  for (int z = 0; z < kFieldEdge; ++z) {
    for (int y = 0; y < kFieldEdge; ++y) {
      float* row = above.row(y, z);
      const float* height = heights.data() + z * kFieldEdge;
      const auto level = static_cast<float>(corner.y + y - 1);
      for (int x = 0; x < kFieldEdge; ++x) row[x] = (level - height[x]) - row[x];
    }
  }
  return true;
}

// Returns true if a cave comes near the chunk.
bool SmoothColumn::Impl::fill_caves(IVec3 corner) {
  if (!has_caves ||
      static_cast<float>(corner.y) > highest + kFarHeight + static_cast<float>(largest_amplitude * kMaxNoise))
    return false;
  const auto at = [](IVec3 p) { return DVec3{kCaveAcross * p.x, kCaveUp * p.y, kCaveAcross * p.z}; };
  lattice.fill(corner, [&](IVec3 p, std::size_t) { return noise3(land.seed() + kCaveA, at(p).x, at(p).y, at(p).z); });
  lattice_b.fill(corner, [&](IVec3 p, std::size_t) { return noise3(land.seed() + kCaveB, at(p).x, at(p).y, at(p).z); });
  constexpr double kNear = kCaveWidth + kBand / kCaveSamples;
  if (!lattice.comes_within(kNear) || !lattice_b.comes_within(kNear)) return false;
  cave_a.upsample(lattice);
  cave_b.upsample(lattice_b);
  return true;
}

// Returns the density of a cave: positive inside it. Caves end above the floor.
float SmoothColumn::Impl::cave(int x, int y, int z, int world_y) const {
  const float a = cave_a.at(x, y, z);
  const float b = cave_b.at(x, y, z);
  const float sealed = std::max(0.0F, kUncavedLayers - static_cast<float>(world_y)) * 0.04F;
  return (kCaveWidth - sealed - std::sqrt(a * a + b * b)) * kCaveSamples;
}

// Returns a positive value outside the world's box.
float SmoothColumn::Impl::outside_of_world(IVec3 sample) const {
  int least = sample.x - world.min.x;
  for (int axis = 0; axis < 3; ++axis) {
    least = std::min({least, sample[axis] - world.min[axis], world.max[axis] - 1 - sample[axis]});
  }
  return 0.5F - static_cast<float>(least);
}

Cover SmoothColumn::Impl::cover(const TerrainTypes& types, int x, int world_y, int z) const {
  const int fringe = static_cast<int>(hash_of(land.seed(), origin.x + x, origin.z + z) & 3U) - 1;
  if (world_y > land.snow_line() + fringe) return {types.snow, types.stone};
  if (world_y > land.snow_line() - land.top() / 10 + fringe) return {types.gravel, types.stone};
  if (world_y <= land.sea() + 1) return {types.sand, types.sand};
  const bool meadow = is_meadow[static_cast<std::size_t>(z * kChunkEdge + x)];
  return {meadow ? types.meadow : types.grass, types.earth};
}

void SmoothColumn::Impl::write_row(const TerrainTypes& types, IVec3 corner, int y, int z, bool is_caved,
                                   DensityChunk& out) {
  std::array<float, kChunkEdge> row;
  VoxelType* material = materials.data() + (z * kChunkEdge + y) * kChunkEdge;
  for (int x = 0; x < kChunkEdge; ++x) {
    const Slope slope = above.slope(x, y, z);
    const float ground = above.at(x, y, z) / std::clamp(slope.length, 1.0F, kSteepest);
    float density = ground;
    if (is_caved) density = std::max(density, cave(x, y, z, corner.y + y));
    density = std::max(density, outside_of_world(corner + IVec3{x, y, z}));
    row[static_cast<std::size_t>(x)] = density;
    material[x] = kAir;
    if (!(density < 0.0F)) continue;
    material[x] = types.stone;
    if (-ground >= kSoilDepth || slope.up < kSteepNormal * slope.length) continue;
    const Cover cover_here = cover(types, x, corner.y + y, z);
    material[x] = -ground < kTurfDepth ? cover_here.turf : cover_here.soil;
  }
  out.write_row(y, z, row, kBand);
}

SmoothColumn::SmoothColumn(const Landform& land, const SmoothTerrainOptions& options, const IBox& world, int chunk_x,
                           int chunk_z)
    : impl_(std::make_unique<Impl>(land, options, world, IVec3{chunk_x * kChunkEdge, 0, chunk_z * kChunkEdge})) {}
SmoothColumn::~SmoothColumn() = default;

DensityChunk SmoothColumn::make(const TerrainTypes& types, int chunk_y) {
  Impl& impl = *impl_;
  const IVec3 corner = impl.origin + IVec3{0, chunk_y * kChunkEdge, 0};
  QUOIN_ASSERT(corner.y >= impl.world.min.y && corner.y < impl.world.max.y, "a chunk of the world");
  DensityChunk chunk(stored_density(kBand, kBand));
  const bool is_near_ground = impl.fill_ground(corner);
  const bool is_air = !is_near_ground && impl.above.at(0, 0, 0) > 0.0F;
  if (is_air) return chunk;
  const bool is_caved = impl.fill_caves(corner);
  if (!is_near_ground && !is_caved && impl.is_deep_in_world(corner)) {
    return DensityChunk(stored_density(-kBand, kBand), types.stone);
  }
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) impl.write_row(types, corner, y, z, is_caved, chunk);
  }
  chunk.unite_slabs();
  chunk.materials() = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(impl.materials));
  chunk.compact();  // a third of the memory is room to grow
  return chunk;
}

}  // namespace
}  // namespace quoin::terrain

namespace quoin {
namespace {

constexpr int kUnitsPerChunk = kChunkEdge / kTerrainUnit;
constexpr float kBand = 8.0F;

// Returns true if all types of a smooth world are set, as by add_terrain_types.
[[maybe_unused]] bool are_smooth_filled(const TerrainTypes& t) {
  const VoxelType all[] = {t.grass, t.earth, t.stone, t.sand, t.snow};
  return std::find(std::begin(all), std::end(all), kAir) == std::end(all);
}

Status check(const SmoothTerrainOptions& options) {
  constexpr int kMaxAcross = 512;
  constexpr int kMaxUp = 16;
  constexpr int kMaxPlace = 1 << 19;
  const IVec3 size = options.size;
  if (std::min({size.x, size.y, size.z}) < 1 || size.y > kMaxUp || std::max(size.x, size.z) > kMaxAcross) {
    return make_error(ErrorCode::InvalidArgument,
                      "smooth terrain size: must be 1 to 512 chunks of 64 samples wide and deep, 1 to 16 high");
  }
  if (std::min(options.first_x, options.first_z) < -kMaxPlace ||
      std::max(options.first_x, options.first_z) > kMaxPlace) {
    return make_error(ErrorCode::InvalidArgument, "smooth terrain origin: must be at most 524288 chunks from 0");
  }
  return {};
}

terrain::Landform landform_of(const SmoothTerrainOptions& options) {
  TerrainOptions blocky;
  blocky.seed = options.seed;
  blocky.size = options.size * kUnitsPerChunk;
  blocky.water = false;
  return terrain::Landform(blocky);
}

IBox chunks_of(const SmoothTerrainOptions& options) {
  const IVec3 first{options.first_x, 0, options.first_z};
  return {first, first + options.size};
}

IBox samples_of(const IBox& chunks) {
  return {chunks.min * kChunkEdge, chunks.max * kChunkEdge};
}

}  // namespace

DensityChunk generate_smooth_terrain_chunk(const SmoothTerrainOptions& options, const TerrainTypes& types,
                                           IVec3 chunk) {
  QUOIN_ASSERT(check(options).has_value(), "sizes and origins within their ranges");
  QUOIN_ASSERT(are_smooth_filled(types), "types that add_terrain_types filled");
  const IBox chunks = chunks_of(options);
  if (!chunks.contains(chunk)) return DensityChunk(stored_density(kBand, kBand));
  const terrain::Landform land = landform_of(options);
  return terrain::SmoothColumn(land, options, samples_of(chunks), chunk.x, chunk.z).make(types, chunk.y);
}

Result<DensityGrid> generate_smooth_terrain(const SmoothTerrainOptions& options, const TerrainTypes& types,
                                            Threads threads, const Progress& progress) {
  if (auto sound = check(options); !sound) return sound.error();
  QUOIN_ASSERT(are_smooth_filled(types), "types that add_terrain_types filled");
  const terrain::Landform land = landform_of(options);
  const IBox chunks = chunks_of(options);
  const auto across = static_cast<std::size_t>(options.size.x);
  const auto up = static_cast<std::size_t>(options.size.y);
  const std::size_t count = across * static_cast<std::size_t>(options.size.z);
  // Batches allow progress reports and store chunks in a fixed order.
  constexpr std::size_t kBatch = 32;
  DensityGrid field(kBand);
  std::vector<std::optional<DensityChunk>> made(std::min(kBatch, count) * up);
  for (std::size_t first = 0; first < count; first += kBatch) {
    if (progress && !progress(static_cast<double>(first) / static_cast<double>(count))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
    const std::size_t batch = std::min(kBatch, count - first);
    const auto place = [&](std::size_t i) {
      return chunks.min + IVec3{static_cast<int>((first + i) % across), 0, static_cast<int>((first + i) / across)};
    };
    parallel_for(batch, threads, [&](std::size_t i) {
      terrain::SmoothColumn column(land, options, samples_of(chunks), place(i).x, place(i).z);
      for (std::size_t y = 0; y < up; ++y) made[i * up + y] = column.make(types, static_cast<int>(y));
    });
    for (std::size_t i = 0; i < batch * up; ++i) {
      field.put_chunk(place(i / up) + IVec3{0, static_cast<int>(i % up), 0}, std::move(*made[i]));
    }
  }
  if (progress) progress(1.0);
  return field;
}

}  // namespace quoin

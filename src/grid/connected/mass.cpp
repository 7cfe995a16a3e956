#include <quoin/grid/mass.h>

#include <array>
#include <bit>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/half.h>

#include "core/coordinates/chunk_order.h"
#include "core/trilinear.h"
#include "grid/connected/mass_sum.h"

namespace quoin {

double DensityTable::operator[](VoxelType type) {
  if (type >= known_.size()) known_.resize(std::size_t{type} + 1, std::numeric_limits<double>::quiet_NaN());
  double& density = known_[type];
  if (std::isnan(density)) {
    density = density_(type);
    QUOIN_ASSERT(std::isfinite(density) && density >= 0.0, "a finite density of at least 0");
  }
  return density;
}

void MassMoments::add(const MassMoments& other, const DVec3& offset) {
  const DVec3& s = other.first;
  const DVec3& d = offset;
  squares += other.squares + 2.0 * d * s + other.mass * d * d;
  mixed += other.mixed + DVec3(d.y * s.z + d.z * s.y, d.x * s.z + d.z * s.x, d.x * s.y + d.y * s.x) +
           other.mass * DVec3(d.y * d.z, d.x * d.z, d.x * d.y);
  first += s + other.mass * d;
  mass += other.mass;
}

MassProperties MassMoments::properties(const DVec3& origin, double edge) const {
  if (!(mass > 0.0)) return {};
  const DVec3 c = first / mass;
  // The second moments about the centre. A cube's own is its mass times a twelfth of the square of its edge.
  const DVec3 spread = glm::max(squares - mass * c * c, 0.0) + mass * edge * edge / 12.0;
  const DVec3 products = mixed - mass * DVec3(c.y * c.z, c.x * c.z, c.x * c.y);
  MassProperties found{mass, origin + c, {}};
  found.inertia[0] = {spread.y + spread.z, -products.z, -products.y};
  found.inertia[1] = {-products.z, spread.x + spread.z, -products.x};
  found.inertia[2] = {-products.y, -products.x, spread.x + spread.y};
  return found;
}

MassProperties MassProperties::scaled(double voxel_size) const {
  QUOIN_ASSERT(voxel_size > 0.0, "a positive voxel size");
  const double volume = voxel_size * voxel_size * voxel_size;
  return {mass * volume, centre * voxel_size, inertia * (volume * voxel_size * voxel_size)};
}

namespace {

// Sums of the first numbers from 0, and of their squares.
constexpr auto kSums = [] {
  std::array<std::int64_t, kChunkEdge + 1> sums{};
  for (std::size_t i = 0; i < kChunkEdge; ++i) sums[i + 1] = sums[i] + static_cast<std::int64_t>(i);
  return sums;
}();
constexpr auto kSumsOfSquares = [] {
  std::array<std::int64_t, kChunkEdge + 1> sums{};
  for (std::size_t i = 0; i < kChunkEdge; ++i) sums[i + 1] = sums[i] + static_cast<std::int64_t>(i * i);
  return sums;
}();

}  // namespace

void VoxelMass::begin(IVec3 at, const Chunk& chunk) {
  finish_chunk();
  if (!has_origin_) origin_ = at * kChunkEdge;
  has_origin_ = true;
  at_ = at;
  chunk_ = &chunk;
  types_ = chunk.types();
  std::erase(types_, kAir);
}

VoxelMass::Counts& VoxelMass::counts_of(VoxelType type) {
  if (type >= slots_.size()) slots_.resize(std::size_t{type} + 1);
  if (slots_[type] == 0) {
    counts_.push_back({.type = type});
    slots_[type] = static_cast<std::uint32_t>(counts_.size());
  }
  return counts_[slots_[type] - 1];
}

void VoxelMass::add_run(VoxelType type, int begin, int end, int y, int z) {
  QUOIN_ASSERT(begin >= 0 && begin < end && end <= kChunkEdge, "a run within a row");
  Counts& counts = counts_of(type);
  const auto from = static_cast<std::size_t>(begin);
  const auto to = static_cast<std::size_t>(end);
  const std::int64_t voxels = end - begin;
  const std::int64_t x = kSums[to] - kSums[from];
  counts.voxels += voxels;
  counts.x += x;
  counts.y += voxels * y;
  counts.z += voxels * z;
  counts.xx += kSumsOfSquares[to] - kSumsOfSquares[from];
  counts.yy += voxels * y * y;
  counts.zz += voxels * z * z;
  counts.yz += voxels * y * z;
  counts.xz += x * z;
  counts.xy += x * y;
}

void VoxelMass::add_runs(VoxelType type, std::uint64_t voxels, int y, int z) {
  while (voxels != 0) {
    const int begin = std::countr_zero(voxels);
    const int end = begin + std::countr_one(voxels >> begin);
    add_run(type, begin, end, y, z);
    if (end == kChunkEdge) break;
    voxels &= ~std::uint64_t{0} << end;
  }
}

void VoxelMass::add_row(int y, int z, std::uint64_t voxels) {
  QUOIN_ASSERT(chunk_ != nullptr, "a chunk was begun");
  // With few types, their masks are faster than reading the row.
  constexpr std::size_t kFewTypes = 6;
  if (types_.size() <= kFewTypes) {
    for (const VoxelType type : types_) add_runs(type, chunk_->row_mask(y, z, type) & voxels, y, z);
    return;
  }
  std::array<VoxelType, kChunkEdge> types{};
  chunk_->read_row(y, z, types);
  while (voxels != 0) {
    const VoxelType type = types[static_cast<std::size_t>(std::countr_zero(voxels))];
    std::uint64_t same = 0;
    for (std::size_t i = 0; i < kChunkEdge; ++i) same |= std::uint64_t{types[i] == type} << i;
    if (type != kAir) add_runs(type, same & voxels, y, z);
    voxels &= ~same;
  }
}

void VoxelMass::add_chunk() {
  QUOIN_ASSERT(chunk_ != nullptr, "a chunk was begun");
  if (const auto type = chunk_->uniform()) {
    if (*type == kAir) return;
    const std::int64_t area = std::int64_t{kChunkEdge} * kChunkEdge;
    const std::int64_t line = kSums[kChunkEdge];
    Counts& counts = counts_of(*type);
    counts.voxels += area * kChunkEdge;
    for (std::int64_t* const first : {&counts.x, &counts.y, &counts.z}) *first += area * line;
    for (std::int64_t* const square : {&counts.xx, &counts.yy, &counts.zz})
      *square += area * kSumsOfSquares[kChunkEdge];
    for (std::int64_t* const mixed : {&counts.yz, &counts.xz, &counts.xy}) *mixed += line * line * kChunkEdge;
    return;
  }
  const IBox box = chunk_->bounds();
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) add_row(y, z, ~std::uint64_t{0});
  }
}

void VoxelMass::finish_chunk() {
  const DVec3 offset = DVec3(at_ * kChunkEdge) - DVec3(origin_);  // more than an int can hold
  for (const Counts& counts : counts_) {
    const auto value = [](std::int64_t count) { return static_cast<double>(count); };
    const double density = densities_[counts.type];
    const MassMoments moments{density * value(counts.voxels),
                              density * DVec3(value(counts.x), value(counts.y), value(counts.z)),
                              density * DVec3(value(counts.xx), value(counts.yy), value(counts.zz)),
                              density * DVec3(value(counts.yz), value(counts.xz), value(counts.xy))};
    moments_.add(moments, offset);
    slots_[counts.type] = 0;
  }
  counts_.clear();
}

MassProperties VoxelMass::properties() {
  finish_chunk();
  return moments_.properties(DVec3(origin_) + 0.5, 1.0);
}

MassProperties mass_properties(const Grid& grid, DensityOfType density) {
  VoxelMass sum(density);
  for (const IVec3 at : grid.chunks()) {
    sum.begin(at, *grid.find_chunk(at));
    sum.add_chunk();
  }
  return sum.properties();
}

namespace {

// The solid of the cells whose lowest samples lie in one chunk.
class FieldMass {
 public:
  FieldMass(const DensityGrid& field, DensityOfType density)
      : field_(field), densities_(density), band_(field.band()) {}

  void add(IVec3 chunk);
  [[nodiscard]] MassProperties properties() const { return moments_.properties(DVec3(origin_), 0.0); }

 private:
  // A line of 65 samples along x. Bit i of `solid` is sample i, `is_last_solid` sample 64.
  struct Line {
    std::uint64_t solid = 0;
    bool is_last_solid = false;
  };
  [[nodiscard]] const DensityChunk* chunk_of(int x, int y, int z) const {
    return chunks_[static_cast<std::size_t>((x >> 6) + 2 * (y >> 6) + 4 * (z >> 6))];
  }
  [[nodiscard]] Line line(int y, int z) const {
    const DensityChunk* const first = chunk_of(0, y, z);
    const DensityChunk* const next = chunk_of(kChunkEdge, y, z);
    return {first == nullptr ? 0 : first->solid_row(y & 63, z & 63),
            next != nullptr && DensityChunk::is_solid(next->get(0, y & 63, z & 63))};
  }
  [[nodiscard]] double sample(int x, int y, int z) const {
    const DensityChunk* const chunk = chunk_of(x, y, z);
    return chunk == nullptr ? band_ : double{float_from_half(chunk->get(x & 63, y & 63, z & 63))};
  }
  [[nodiscard]] double density_of_cell(int x, int y, int z, const CellCorners* corners);
  void add_row(int y, int z, MassMoments& moments);
  void add_mixed(int x, int y, int z, MassMoments& moments);

  static void add_cube(double mass, double edge, const DVec3& c, MassMoments& moments) {
    moments.mass += mass;
    moments.first += mass * c;
    moments.squares += mass * (c * c + edge * edge / 12.0);
    moments.mixed += mass * DVec3(c.y * c.z, c.x * c.z, c.x * c.y);
  }

  const DensityGrid& field_;
  DensityTable densities_;
  double band_;
  std::array<const DensityChunk*, 8> chunks_{};  // the chunk and those after it, by x + 2 y + 4 z
  MassMoments moments_;
  IVec3 origin_{0};
  bool has_origin_ = false;
};

void FieldMass::add(IVec3 chunk) {
  for (int i = 0; i < 8; ++i) {
    chunks_[static_cast<std::size_t>(i)] = field_.find_chunk(chunk + IVec3{i & 1, i >> 1 & 1, i >> 2});
  }
  if (!has_origin_) origin_ = chunk * kChunkEdge;
  has_origin_ = true;
  MassMoments moments;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) add_row(y, z, moments);
  }
  moments_.add(moments, DVec3(chunk * kChunkEdge) - DVec3(origin_));
}

void FieldMass::add_row(int y, int z, MassMoments& moments) {
  std::uint64_t any = 0;
  std::uint64_t all = ~std::uint64_t{0};
  for (const auto& [solid, is_last_solid] : {line(y, z), line(y + 1, z), line(y, z + 1), line(y + 1, z + 1)}) {
    const std::uint64_t next = solid >> 1 | std::uint64_t{is_last_solid} << 63;
    any |= solid | next;
    all &= solid & next;
  }
  for (std::uint64_t left = all; left != 0; left &= left - 1) {
    const int x = std::countr_zero(left);
    add_cube(density_of_cell(x, y, z, nullptr), 1.0, DVec3(x, y, z) + 0.5, moments);
  }
  for (std::uint64_t left = any & ~all; left != 0; left &= left - 1) add_mixed(std::countr_zero(left), y, z, moments);
}

// The mean of the cell's solid samples; without corners all are solid.
double FieldMass::density_of_cell(int x, int y, int z, const CellCorners* corners) {
  double sum = 0.0;
  int count = 0;
  for (int i = 0; i < 8; ++i) {
    if (corners != nullptr && !((*corners)[static_cast<std::size_t>(i)] < 0.0)) continue;
    const IVec3 at{x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)};
    const DensityChunk* const chunk = chunk_of(at.x, at.y, at.z);
    QUOIN_ASSERT(chunk != nullptr, "solid samples are in chunks");
    sum += densities_[chunk->materials().get(at.x & 63, at.y & 63, at.z & 63)];
    ++count;
  }
  return count == 0 ? 0.0 : sum / count;
}

void FieldMass::add_mixed(int x, int y, int z, MassMoments& moments) {
  constexpr int kParts = 4;
  constexpr double kEdge = 1.0 / kParts;
  CellCorners corners;
  for (int i = 0; i < 8; ++i)
    corners[static_cast<std::size_t>(i)] = sample(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
  const double mass = density_of_cell(x, y, z, &corners) * kEdge * kEdge * kEdge;
  const DVec3 cell(x, y, z);
  for (int i = 0; i < kParts * kParts * kParts; ++i) {
    const DVec3 at = kEdge * (DVec3(i % kParts, i / kParts % kParts, i / (kParts * kParts)) + 0.5);
    if (trilinear(corners, at) < 0.0) add_cube(mass, kEdge, cell + at, moments);
  }
}

}  // namespace

MassProperties mass_properties(const DensityGrid& field, DensityOfType density) {
  // A chunk's samples are corners of its own cells and of cells of the seven chunks before it.
  std::vector<IVec3> chunks;
  for (const IVec3 at : field.chunks()) {
    for (int i = 0; i < 8; ++i) chunks.push_back(at - IVec3{i & 1, i >> 1 & 1, i >> 2});
  }
  sort_and_unite(chunks);
  FieldMass sum(field, density);
  for (const IVec3 at : chunks) sum.add(at);
  return sum.properties();
}

}  // namespace quoin

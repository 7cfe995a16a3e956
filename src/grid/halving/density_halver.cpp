#include "grid/halving/density_halver.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <span>

#include <quoin/core/assert.h>

#include "grid/density/density_storage.h"
#include "grid/halving/halving.h"

namespace quoin {
namespace {

constexpr std::size_t kHalf = kChunkEdge / 2;

bool is_solid(const DensityChunk* chunk, int x, int y, int z) {
  return chunk != nullptr && (chunk->solid_row(y, z) >> x & 1U) != 0;
}

}  // namespace

DensityHalver::DensityHalver(const DensityGrid& field, IVec3 chunk)
    : far_(largest_within(field.band())), coarse_far_(largest_within(0.5F * field.band())) {
  for (int i = 0; i < 64; ++i) {
    const IVec3 at{i & 3, i >> 2 & 3, i >> 4};
    chunks_[static_cast<std::size_t>(i)] = field.find_chunk(2 * chunk + at - 1);
  }
  signs_.resize(std::size_t{kRows} * kRows);
  for (int z = -1; z <= kChunkEdge; ++z) {
    for (int y = -1; y <= kChunkEdge; ++y) read_signs(y, z);
  }
}

void DensityHalver::read_signs(int y, int z) {
  const int row_y = 2 * y & (kChunkEdge - 1);
  const int row_z = 2 * z & (kChunkEdge - 1);
  const auto row = [&](int x) {
    const DensityChunk* const chunk = chunk_at({x, 2 * y, 2 * z});
    return chunk == nullptr ? 0 : even_bits(chunk->solid_row(row_y, row_z));
  };
  Signs& signs = signs_[static_cast<std::size_t>((z + 1) * kRows + y + 1)];
  signs.bits = row(0) | row(kChunkEdge) << kHalf;
  signs.before = is_solid(chunk_at({-2, 2 * y, 2 * z}), kChunkEdge - 2, row_y, row_z);
  signs.after = is_solid(chunk_at({2 * kChunkEdge, 2 * y, 2 * z}), 0, row_y, row_z);
}

HalvedDensityChunk DensityHalver::make() const {
  HalvedDensityChunk made;
  const Half corner = density(IVec3(0));
  made.samples = DensityChunk(stored_within(0.5F * float_from_half(corner), coarse_far_));
  halve_densities(made.samples);
  copy_materials(made.samples.materials());
  if (!is_of_one_material()) choose_materials(made.samples.materials());
  made.samples.compact();
  made.counts = counts();
  return made;
}

// `made` is of one density, which rows that are of that alone keep.
void DensityHalver::halve_densities(DensityChunk& made) const {
  QUOIN_ASSERT(made.uniform().has_value(), "a chunk of one density");
  const Half uniform = *made.uniform();
  std::array<Half, kChunkEdge> coarse{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      bool is_uniform = true;
      for (int part = 0; part < 2; ++part) {
        const IVec3 first{part * kChunkEdge, 2 * y, 2 * z};
        const DensityChunk* const chunk = chunk_at(first);
        const IVec3 p = first & (kChunkEdge - 1);
        const Half* const row = chunk == nullptr ? nullptr : chunk->row(p.y, p.z);
        const auto out = coarse.begin() + part * static_cast<std::ptrdiff_t>(kHalf);
        if (row == nullptr) {
          const Half value = stored_within(0.5F * float_from_half(density(first)), coarse_far_);
          std::fill_n(out, kHalf, value);
          is_uniform = is_uniform && value == uniform;
          continue;
        }
        for (std::size_t x = 0; x < kHalf; ++x) {
          out[static_cast<std::ptrdiff_t>(x)] = stored_within(0.5F * float_from_half(row[2 * x]), coarse_far_);
        }
        is_uniform = false;
      }
      if (!is_uniform) made.write_row(y, z, coarse);
    }
  }
}

// Copies the materials of the coinciding fine samples to the solid samples.
void DensityHalver::copy_materials(Chunk& made) const {
  std::array<VoxelType, kChunkEdge> fine{};
  std::array<VoxelType, kChunkEdge> coarse{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::uint64_t solid = signs(y, z).bits;
      for (int part = 0; part < 2; ++part) {
        const std::uint64_t mask = solid & (~std::uint64_t{0} >> kHalf) << (part * static_cast<int>(kHalf));
        if (mask == 0) continue;
        const IVec3 first{part * kChunkEdge, 2 * y, 2 * z};
        QUOIN_ASSERT(chunk_at(first) != nullptr, "solid samples belong to a chunk");
        const Chunk& materials = chunk_at(first)->materials();
        if (const std::optional<VoxelType> one = materials.uniform()) {
          made.fill_row(y, z, mask, *one);
          continue;
        }
        const IVec3 p = first & (kChunkEdge - 1);
        materials.read_row(p.y, p.z, fine);
        for (std::size_t x = 0; x < kHalf; ++x) coarse[static_cast<std::size_t>(part) * kHalf + x] = fine[2 * x];
        made.write_row(y, z, mask, coarse);
      }
    }
  }
}

// Returns the solid samples of a row that have air neighbours.
std::uint64_t DensityHalver::beside_air(int y, int z) const {
  std::uint64_t inside = ~std::uint64_t{0};
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) inside &= signs(y + dy, z + dz).all_three();
  }
  return signs(y, z).bits & ~inside;
}

bool DensityHalver::is_of_one_material() const {
  std::optional<VoxelType> known;
  for (const DensityChunk* const chunk : chunks_) {
    if (chunk == nullptr) continue;
    const std::optional<VoxelType> one = chunk->materials().uniform();
    if (!one || (known && *known != *one)) return false;
    known = one;
  }
  return true;
}

void DensityHalver::read_rows(int y, int z, NearRows& rows) const {
  for (int i = 0; i < 9; ++i) {
    auto& row = rows[static_cast<std::size_t>(i)];
    const IVec3 first{0, 2 * y + i % 3 - 1, 2 * z + i / 3 - 1};
    row[0] = density(first - IVec3{1, 0, 0});
    for (int part = 0; part < 2; ++part) {
      const std::span<Half, kChunkEdge> out(row.data() + 1 + part * kChunkEdge, std::size_t{kChunkEdge});
      const DensityChunk* const chunk = chunk_at(first + IVec3{part * kChunkEdge, 0, 0});
      if (chunk == nullptr) {
        std::fill(out.begin(), out.end(), far_);
      } else {
        chunk->read_row(first.y & (kChunkEdge - 1), first.z & (kChunkEdge - 1), out);
      }
    }
  }
}

void DensityHalver::choose_materials(Chunk& made) const {
  NearRows rows;
  std::array<VoxelType, kChunkEdge> chosen{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::uint64_t open = beside_air(y, z);
      if (open == 0) continue;
      read_rows(y, z, rows);
      for (std::uint64_t left = open; left != 0; left &= left - 1) {
        const int x = std::countr_zero(left);
        chosen[static_cast<std::size_t>(x)] = outermost(rows, 2 * IVec3{x, y, z});
      }
      made.write_row(y, z, open, chosen);
    }
  }
}

// Halves of one sign are in the order of their bits.
VoxelType DensityHalver::outermost(const NearRows& rows, IVec3 fine) const {
  IVec3 best = fine;
  Half least = rows[4][static_cast<std::size_t>(fine.x) + 1];
  for (int i = 0; i < 27; ++i) {
    const Half found = rows[static_cast<std::size_t>(i / 3)][static_cast<std::size_t>(fine.x + i % 3)];
    if (!DensityChunk::is_solid(found) || found >= least) continue;
    best = fine + Neighbourhood::offset(i);
    least = found;
  }
  const IVec3 p = best & (kChunkEdge - 1);
  return chunk_at(best)->materials().get(p);
}

DownsampledDensityCounts DensityHalver::counts() const {
  DownsampledDensityCounts counts;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const Signs& row = signs(y, z);
      const std::uint64_t y_low = signs(y - 1, z).bits;
      const std::uint64_t y_high = signs(y + 1, z).bits;
      const std::uint64_t z_low = signs(y, z - 1).bits;
      const std::uint64_t z_high = signs(y, z + 1).bits;
      counts.solid += std::popcount(row.bits);
      const std::uint64_t around = row.lower() & row.upper() & y_low & y_high & z_low & z_high;
      counts.surface += std::popcount(row.bits & ~around);
      const std::uint64_t held = (row.lower() | row.upper()) & (y_low | y_high) & (z_low | z_high);
      counts.thin += std::popcount(row.bits & ~held);
    }
  }
  for (int i = 0; i < 8; ++i) {
    const DensityChunk* const chunk = chunk_at(kChunkEdge * IVec3{i & 1, i >> 1 & 1, i >> 2});
    if (chunk == nullptr) continue;
    for (int row = 0; row < kChunkEdge * kChunkEdge; ++row) {
      counts.finer_solid += std::popcount(chunk->solid_row(row % kChunkEdge, row / kChunkEdge));
    }
  }
  return counts;
}

}  // namespace quoin

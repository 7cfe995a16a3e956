#include <quoin/grid/downsample.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <glm/vector_relational.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/texture.h>

#include "core/coordinates/chunk_order.h"
#include "core/moved_from.h"
#include "core/work/progress_steps.h"
#include "grid/density/density_storage.h"
#include "grid/halving/chunk_halver.h"
#include "grid/shapes/shape_index.h"

namespace quoin {
namespace {

/// A chunk of a halved field and the counts kept for updates.
struct HalvedDensityChunk {
  DensityChunk samples{Half{0}};
  DownsampledDensityCounts counts;
};

/// Makes one chunk of a halved field.
///
/// Space: fine, samples from the chunk's least corner, -2 to 129 on each axis; coarse, -1 to 64. Reads no other
/// samples: an edit elsewhere does not change the chunk.
class DensityHalver {
 public:
  /// `chunk`: coordinates in the halved field.
  DensityHalver(const DensityGrid& field, IVec3 chunk);

  [[nodiscard]] HalvedDensityChunk make() const;

 private:
  static constexpr int kRows = kChunkEdge + 2;

  /// The solid samples of a coarse row as bits, plus the sample before and the one after.
  struct Signs {
    std::uint64_t bits = 0;
    bool before = false;
    bool after = false;
    [[nodiscard]] std::uint64_t lower() const { return bits << 1 | std::uint64_t{before}; }
    [[nodiscard]] std::uint64_t upper() const { return bits >> 1 | std::uint64_t{after} << 63; }
    [[nodiscard]] std::uint64_t all_three() const { return bits & lower() & upper(); }
  };

  [[nodiscard]] const DensityChunk* chunk_at(IVec3 fine) const {
    const IVec3 at = (fine >> kChunkShift) + 1;
    QUOIN_ASSERT((IBox{IVec3(0), IVec3(4)}.contains(at)), "-64 <= x, y, z < 192");
    return chunks_[static_cast<std::size_t>(at.x + 4 * at.y + 16 * at.z)];
  }
  [[nodiscard]] Half density(IVec3 fine) const {
    const DensityChunk* const chunk = chunk_at(fine);
    const IVec3 p = fine & (kChunkEdge - 1);
    return chunk == nullptr ? far_ : chunk->get(p.x, p.y, p.z);
  }
  [[nodiscard]] const Signs& signs(int y, int z) const {
    QUOIN_ASSERT(std::min(y, z) >= -1 && std::max(y, z) <= kChunkEdge, "-1 <= y, z <= 64");
    return signs_[static_cast<std::size_t>((z + 1) * kRows + y + 1)];
  }
  void read_signs(int y, int z);
  void halve_densities(DensityChunk& made) const;
  void copy_materials(Chunk& made) const;
  void choose_materials(Chunk& made) const;
  /// The densities of the 3x3 rows around coarse row (y, z), from the sample before the chunk's first on.
  using NearRows = std::array<std::array<Half, 2 * kChunkEdge + 1>, 9>;
  void read_rows(int y, int z, NearRows& rows) const;
  [[nodiscard]] VoxelType outermost(const NearRows& rows, IVec3 fine) const;
  [[nodiscard]] std::uint64_t beside_air(int y, int z) const;
  [[nodiscard]] bool is_of_one_material() const;
  [[nodiscard]] DownsampledDensityCounts counts() const;

  Half far_;         // of the field
  Half coarse_far_;  // of the result
  std::array<const DensityChunk*, 64> chunks_{};
  std::vector<Signs> signs_;
};

constexpr std::size_t kHalf = kChunkEdge / 2;

bool is_solid(const DensityChunk* chunk, int x, int y, int z) {
  return chunk != nullptr && (chunk->solid_row(y, z) >> x & 1U) != 0;
}

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

IVec3 halved_coordinates(IVec3 chunk) {
  return {chunk.x >> 1, chunk.y >> 1, chunk.z >> 1};
}

// The voxel data that halving reads.
struct States {
  const Grid* grid;  // null: none
  [[nodiscard]] DataChanges changes_since(ChangeCursor& cursor) const {
    return grid == nullptr ? DataChanges() : grid->data_changes_since(cursor);
  }
};

// A halved chunk of voxels.
struct VoxelHalving {
  using Content = Grid;
  using Made = Chunk;
  const VoxelRegistry* types;

  [[nodiscard]] States states(const Grid& finer) const {
    return {types->has_shapes() || types->has_turned_by_state() ? &finer : nullptr};
  }
  [[nodiscard]] Chunk make(const Grid& finer, IVec3 chunk) const { return downsample_chunk(finer, *types, chunk); }
};

// A halved chunk of densities.
struct DensityHalving {
  using Content = DensityGrid;
  using Made = HalvedDensityChunk;

  [[nodiscard]] static States states(const DensityGrid& finer) {
    static_cast<void>(finer);
    return {nullptr};
  }
  [[nodiscard]] static HalvedDensityChunk make(const DensityGrid& finer, IVec3 chunk) {
    return DensityHalver(finer, chunk).make();
  }
};

// Adds the halved chunks that read a voxel, or a sample, of the change: their own and those of one cell past them.
template <class Change>
void add_readers(const Change& change, std::vector<IVec3>& chunks) {
  constexpr int kReach = 2;
  const IVec3 low = halved_coordinates(change.chunk - IVec3(glm::lessThan(change.box.min, IVec3(kReach))));
  const IVec3 high =
      halved_coordinates(change.chunk + IVec3(glm::greaterThan(change.box.max, IVec3(kChunkEdge - kReach))));
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) chunks.emplace_back(x, y, z);
    }
  }
}

// A level of voxels.
struct VoxelLevel {
  Grid content;

  void begin(const Grid& finer) { static_cast<void>(finer); }
  void put(IVec3 chunk, Chunk made) { content.put_chunk(chunk, std::move(made)); }
};

// A level of a field.
struct DensityLevel {
  DensityGrid content;
  std::map<IVec3, DownsampledDensityCounts, ByZyx> chunks;  // that hold any solid
  DownsampledDensityCounts counts;                          // of all

  // Resets the level if the band of the finer field differs.
  void begin(const DensityGrid& finer) {
    const float band = DensityGrid(0.5F * finer.band()).band();
    if (content.band() == band) return;
    content = DensityGrid(band);
    chunks.clear();
    counts = {};
  }
  void put(IVec3 chunk, HalvedDensityChunk made) {
    content.put_chunk(chunk, std::move(made.samples));
    DownsampledDensityCounts& known = chunks[chunk];
    counts -= known;
    counts += known = made.counts;
    if (known == DownsampledDensityCounts{}) chunks.erase(chunk);
  }
};

// The stored data of a level and its read position in the changes of the finer level.
template <class Halving, class Kept>
struct Level : Kept {
  using Content = typename Halving::Content;
  using Kept::content;
  ChangeCursor followed;
  ChangeCursor followed_states;

  // Returns false, without a change, if `progress` cancelled the update.
  bool update(const Content& finer, const Halving& halving, Threads threads, const Progress& progress = {}) {
    PendingChanges changes(followed, finer);
    const States states = halving.states(finer);
    PendingChanges state_changes(followed_states, states);
    std::vector<IVec3> dirty;
    if (changes->all) Kept::begin(finer);
    if (changes->all || state_changes->all) {
      dirty = content.chunks();
      for (const IVec3 chunk : finer.chunks()) dirty.push_back(halved_coordinates(chunk));
    }
    for (const auto& change : changes->items_unless_all()) add_readers(change, dirty);
    for (const auto& change : state_changes->items_unless_all()) add_readers(change, dirty);
    sort_and_unite(dirty);
    std::erase_if(dirty, [&](IVec3 chunk) {
      for (int i = 0; i < 8; ++i) {
        if (finer.find_chunk(2 * chunk + IVec3{i & 1, i >> 1 & 1, i >> 2}) != nullptr) return false;
      }
      return content.find_chunk(chunk) == nullptr;
    });
    std::vector<typename Halving::Made> made(dirty.size());
    ProgressSteps steps(progress, dirty.size());
    parallel_for(dirty.size(), threads, [&](std::size_t i) {
      if (steps.cancelled()) return;
      made[i] = halving.make(finer, dirty[i]);
      steps.step();
    });
    if (steps.cancelled()) return false;
    for (std::size_t i = 0; i < dirty.size(); ++i) Kept::put(dirty[i], std::move(made[i]));
    changes.commit();
    state_changes.commit();
    return true;
  }
};

// The levels of a grid or a field.
template <class Halving, class Kept>
struct Levels {
  using Content = typename Halving::Content;
  std::vector<std::unique_ptr<Level<Halving, Kept>>> kept;

  // `first`: for the first level, `others`: for the ones after it.
  void update(const Content& full, const Halving& first, const Halving& others, int levels, Threads threads) {
    const Content* finer = &full;
    const auto wanted = static_cast<std::size_t>(std::max(levels, 0));
    kept.resize(std::min(kept.size(), wanted));
    for (std::size_t i = 0; i < wanted; ++i) {
      if (i == kept.size()) kept.push_back(std::make_unique<Level<Halving, Kept>>());
      kept[i]->update(*finer, i == 0 ? first : others, threads);
      finer = &kept[i]->content;
      if (finer->chunk_count() != 0) continue;
      // An empty level stays, although it does not count, so that the next edit does not rebuild it.
      kept.resize(i + 1);
      return;
    }
  }
  [[nodiscard]] int count() const {
    const bool is_last_empty = !kept.empty() && kept.back()->content.chunk_count() == 0;
    return static_cast<int>(kept.size()) - static_cast<int>(is_last_empty);
  }
  [[nodiscard]] const Level<Halving, Kept>& at(int level) const {
    QUOIN_ASSERT(level >= 1 && level <= count(), "1 <= level <= levels()");
    return *kept[static_cast<std::size_t>(level) - 1];
  }
};

}  // namespace

VoxelRegistry types_of_halved(const VoxelRegistry& types) {
  VoxelRegistry cubes = types;
  for (std::size_t i = 0; types.has_shapes() && i < types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    if (!types.is_shaped(type)) continue;
    VoxelProperties cube = types[type];
    const std::uint8_t alpha = cube.colour.a;
    cube.colour = srgb_colour(mean_of_shapes(cube));
    cube.emission *= emission_share_of_shapes(cube);
    const bool is_glass = has_glass_parts(cube);
    cube.visibility = is_glass ? Visibility::Transparent : Visibility::Opaque;
    cube.colour.a = is_glass ? alpha : 255;
    cube.faces = {};
    cube.shapes = {};
    cubes.replace(type, std::move(cube));
  }
  return cubes;
}

const VoxelRegistry& HalvedTypes::of(const VoxelRegistry& types) {
  if (!types.has_shapes()) return types;
  if (!cubes_ || types.has_changed_since(cursor_)) {
    cubes_ = types_of_halved(types);
    cursor_ = types.cursor();
  }
  return *cubes_;
}

Chunk downsample_chunk(const Grid& grid, const VoxelRegistry& types, IVec3 chunk) {
  return ChunkHalver(grid, types, chunk).make();
}

Result<Grid> downsample(const Grid& grid, const VoxelRegistry& types, Threads threads, const Progress& progress) {
  Level<VoxelHalving, VoxelLevel> level;
  if (!level.update(grid, {&types}, threads, progress)) return make_error(ErrorCode::Cancelled, "cancelled");
  return std::move(level.content);
}

Result<DensityGrid> downsample(const DensityGrid& field, Threads threads, const Progress& progress) {
  Level<DensityHalving, DensityLevel> level;
  if (!level.update(field, {}, threads, progress)) return make_error(ErrorCode::Cancelled, "cancelled");
  return std::move(level.content);
}

struct GridPyramid::Impl : Levels<VoxelHalving, VoxelLevel> {
  HalvedTypes halved_types;
};

GridPyramid::GridPyramid() : impl_(std::make_unique<Impl>()) {}
GridPyramid::GridPyramid(GridPyramid&&) noexcept = default;
GridPyramid& GridPyramid::operator=(GridPyramid&&) noexcept = default;
GridPyramid::~GridPyramid() = default;

void GridPyramid::update(const Grid& grid, const VoxelRegistry& types, int levels, Threads threads) {
  update(grid, types, impl_of(impl_).halved_types.of(types), levels, threads);
}

void GridPyramid::update(const Grid& grid, const VoxelRegistry& types, const VoxelRegistry& halved_types, int levels,
                         Threads threads) {
  impl_of(impl_).update(grid, {&types}, {&halved_types}, levels, threads);
}

int GridPyramid::levels() const {
  return impl_of(impl_).count();
}

const Grid& GridPyramid::level(int level) const {
  return impl_of(impl_).at(level).content;
}

struct DensityPyramid::Impl : Levels<DensityHalving, DensityLevel> {};

DensityPyramid::DensityPyramid() : impl_(std::make_unique<Impl>()) {}
DensityPyramid::DensityPyramid(DensityPyramid&&) noexcept = default;
DensityPyramid& DensityPyramid::operator=(DensityPyramid&&) noexcept = default;
DensityPyramid::~DensityPyramid() = default;

void DensityPyramid::update(const DensityGrid& field, int levels, Threads threads) {
  impl_of(impl_).update(field, {}, {}, levels, threads);
}

int DensityPyramid::levels() const {
  return impl_of(impl_).count();
}

const DensityGrid& DensityPyramid::level(int level) const {
  return impl_of(impl_).at(level).content;
}

const DownsampledDensityCounts& DensityPyramid::counts(int level) const {
  return impl_of(impl_).at(level).counts;
}

}  // namespace quoin

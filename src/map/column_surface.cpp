#include "map/column_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::map {

namespace {

constexpr int kEdge = ColumnSurface::kEdge;
/// Less light than this cannot be seen.
constexpr float kDark = 0.01F;
/// A tower of glass ends here.
constexpr std::uint16_t kMostVoxels = 512;

// The light that passes the surface of water and each voxel of depth, by colour: red goes first.
const Vec3 kPastSurface{0.30F, 0.44F, 0.56F};
const Vec3 kPastVoxel{0.72F, 0.82F, 0.87F};

std::uint8_t root_of(float light) {
  constexpr float kMost = 255.0F;
  return static_cast<std::uint8_t>(std::lround(std::sqrt(std::clamp(light, 0.0F, 1.0F)) * kMost));
}

std::array<std::uint8_t, 3> roots_of(const Vec3& light) {
  return {root_of(light.x), root_of(light.y), root_of(light.z)};
}

}  // namespace

SurfaceBuilder::SurfaceBuilder(TypeLooks& looks, std::optional<int> ceiling)
    : looks_(&looks), ceiling_(ceiling), columns_(std::size_t{kEdge} * kEdge) {}

bool SurfaceBuilder::add(int x, int z, int y, VoxelType type) {
  QUOIN_ASSERT(x >= 0 && x < kEdge && z >= 0 && z < kEdge, "0 <= x, z < 64");
  Column& column = columns_[static_cast<std::size_t>(z * kEdge + x)];
  if (column.is_closed) return false;
  const bool is_first = column.voxels == 0;
  if (ceiling_ && !column.is_below_roof) {
    const bool goes_on = y == (is_first ? *ceiling_ : column.last_y - 1);
    column.last_y = y;
    ++column.voxels;
    if (goes_on) return column.voxels < std::numeric_limits<std::uint16_t>::max();
    column.is_below_roof = true;
    column.voxels = 0;
  }
  const TypeLook& look = (*looks_)[type];
  column.last_y = y;
  if (++column.voxels > kMostVoxels) column.is_closed = true;
  is_empty_ = false;
  if (look.is_fluid && look.coverage < 1.0F) {
    if (!column.has_surface) {
      column.y = y;
      column.has_surface = true;
    }
    const Vec3 passes = column.was_fluid ? kPastVoxel : kPastSurface;
    // Below the surface, the colour of the light that comes back is the fluid's.
    column.cover += column.open * column.fluid * (1.0F - passes) * look.colour;
    column.fluid *= passes;
    column.was_fluid = true;
    if (column.open * std::max({column.fluid.x, column.fluid.y, column.fluid.z}) < kDark) {
      column.floor_y = y;
      column.is_closed = true;
    }
    return !column.is_closed;
  }
  constexpr float kHides = 0.5F;
  const bool hides = look.coverage >= kHides;
  const Vec3 light = column.open * column.fluid * look.colour;
  if (!hides) {
    column.cover += light * look.coverage;
    column.open *= 1.0F - look.coverage;
    return !column.is_closed;
  }
  column.floor = light;
  column.floor_y = y;
  column.glows = look.glows;
  column.open = 0.0F;
  if (!column.has_surface) {
    column.y = y;
    column.has_surface = true;
  }
  column.is_closed = true;
  return false;
}

std::shared_ptr<const ColumnSurface> SurfaceBuilder::take() {
  std::shared_ptr<ColumnSurface> surface;
  if (!is_empty_) surface = std::make_shared<ColumnSurface>();
  for (std::size_t i = 0; i < columns_.size() && surface; ++i) {
    const Column& column = columns_[i];
    SeenColumn& seen = surface->columns[i];
    if (column.voxels == 0 || (ceiling_ && !column.is_below_roof)) continue;
    constexpr float kOpaque = 255.0F;
    const float hidden = 1.0F - column.open * std::max({column.fluid.x, column.fluid.y, column.fluid.z});
    seen.alpha = static_cast<std::uint8_t>(std::lround(std::clamp(hidden, 0.0F, 1.0F) * kOpaque));
    if (seen.alpha == 0) continue;
    // A colour that is not premultiplied.
    const float share = 1.0F / hidden;
    seen.floor = roots_of(column.floor * share);
    seen.cover = roots_of(column.cover * share);
    seen.glows = column.glows;
    seen.y = column.has_surface ? column.y : column.last_y;
    seen.floor_y = column.open > 0.0F && !column.is_closed ? column.last_y : column.floor_y;
  }
  std::ranges::fill(columns_, Column());
  is_empty_ = true;
  return surface;
}

std::vector<Square> squares_of(const ChunkSource& source) {
  const std::span<const IBox> parts = source.parts();
  std::vector<std::size_t> order(parts.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {},
                    [&](std::size_t i) { return std::tuple(parts[i].min.z, parts[i].min.x, -parts[i].min.y); });
  std::vector<Square> squares;
  for (const std::size_t part : order) {
    const IVec3 place = parts[part].min;
    if (squares.empty() || squares.back().x != place.x || squares.back().z != place.z) {
      squares.push_back({place.x, place.z, {}});
    }
    squares.back().parts.push_back(part);
  }
  return squares;
}

SurfaceCache::SurfaceCache(const ChunkSource& source, std::optional<int> ceiling)
    : source_(&source), ceiling_(ceiling), squares_(squares_of(source)) {}

std::optional<std::size_t> SurfaceCache::find(int x, int z) const {
  const Square wanted{x, z, {}};
  const auto found = std::ranges::lower_bound(squares_, wanted, std::less());
  if (found == squares_.end() || found->x != x || found->z != z) return std::nullopt;
  return static_cast<std::size_t>(found - squares_.begin());
}

Result<std::shared_ptr<const ColumnSurface>> SurfaceCache::read(int x, int z) {
  constexpr std::size_t kMostBytes = std::size_t{64} << 20;
  using Surface = std::shared_ptr<const ColumnSurface>;
  const auto square = find(x, z);
  if (!square) return Surface();
  std::shared_ptr<Entry> entry;
  {
    const std::scoped_lock lock(mutex_);
    KnownSquare& known = entries_[*square];
    if (!known.entry) known.entry = std::make_shared<Entry>();
    known.last_use = ++uses_;
    entry = known.entry;
    if (const std::size_t held = entries_.size() * sizeof(ColumnSurface); held > kMostBytes) {
      drop_oldest(
          entries_, held, kMostBytes / 8 * 7, [&](auto each) { return each->first != *square; },
          [](auto) { return sizeof(ColumnSurface); }, [&](auto each) { entries_.erase(each); });
    }
  }
  const std::scoped_lock lock(entry->mutex);
  if (entry->is_read) return entry->surface;
  auto surface = read_square(*square);
  if (!surface) return surface;
  entry->surface = *surface;
  entry->is_read = true;
  return surface;
}

Result<std::shared_ptr<const ColumnSurface>> SurfaceCache::read_square(std::size_t number) {
  QUOIN_ASSERT(number < squares_.size(), "a square of the source");
  Result<std::shared_ptr<const ColumnSurface>> surface = std::shared_ptr<const ColumnSurface>();
  scratch_.with([&](Scratch& scratch) {
    if (!scratch.looks) {
      scratch.looks.emplace(*source_);
      scratch.builder.emplace(*scratch.looks, ceiling_);
    }
    surface = read_square(number, *scratch.builder);
  });
  return surface;
}

Result<std::shared_ptr<const ColumnSurface>> SurfaceCache::read_square(std::size_t number, SurfaceBuilder& builder) {
  std::vector<SourceSign> signs;
  std::vector<Error> broken;
  std::uint64_t chunks = 0;
  std::optional<Error> failure;
  const int top = ceiling_.value_or(std::numeric_limits<int>::max());
  for (const std::size_t part : squares_[number].parts) {
    auto visited = source_->visit_columns(part, top, [&](IVec3 voxel, VoxelType type) {
      return builder.add(voxel.x & (kEdge - 1), voxel.z & (kEdge - 1), voxel.y, type);
    });
    if (!visited) {
      failure = visited.error();
      break;
    }
    chunks += visited->chunks;
    std::ranges::move(visited->signs, std::back_inserter(signs));
    std::ranges::move(visited->broken, std::back_inserter(broken));
  }
  std::shared_ptr<const ColumnSurface> surface = builder.take();  // also after an error: the builder is used again
  if (failure) return *failure;
  const std::scoped_lock lock(mutex_);
  chunks_ += chunks;
  for (Error& error : broken) broken_.try_emplace(to_string(error), error);
  if (signs.empty()) {
    signs_.erase(number);
  } else {
    signs_[number] = std::move(signs);
  }
  return surface;
}

SurfaceCache::Counts SurfaceCache::counts() const {
  const std::scoped_lock lock(mutex_);
  Counts counts{.chunks = chunks_};
  for (const auto& [line, error] : broken_) counts.broken.push_back(error);
  return counts;
}

std::vector<SourceSign> SurfaceCache::signs_of(std::size_t square) const {
  const std::scoped_lock lock(mutex_);
  const auto found = signs_.find(square);
  return found == signs_.end() ? std::vector<SourceSign>() : found->second;
}

}  // namespace quoin::map

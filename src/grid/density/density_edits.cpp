#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/buffer.h>
#include <quoin/core/vec.h>

#include "core/coordinates/long_box.h"
#include "grid/density/density_grid_impl.h"

namespace quoin {
namespace {

// Shapes that edits add, remove or work within. Not sound: a size or place that is negative, infinite or NaN.

class Sphere {
 public:
  Sphere(DVec3 centre, double radius) : centre_(centre), radius_(radius) {}

  [[nodiscard]] bool is_sound() const { return is_finite(centre_) && radius_ >= 0.0 && std::isfinite(radius_); }
  [[nodiscard]] DVec3 min() const { return centre_ - radius_; }
  [[nodiscard]] DVec3 max() const { return centre_ + radius_; }
  /// Negative inside.
  [[nodiscard]] double distance(DVec3 point) const {
    const DVec3 d = point - centre_;
    return std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z) - radius_;
  }

 private:
  DVec3 centre_;
  double radius_;
};

/// A box with rounded edges. The radius is at most half its shortest side.
class RoundedBox {
 public:
  RoundedBox(DVec3 min, DVec3 max, double rounding)
      : min_(min),
        max_(max),
        middle_(0.5 * min + 0.5 * max),
        half_size_(0.5 * max - 0.5 * min),
        rounding_(std::min(rounding, std::min({half_size_.x, half_size_.y, half_size_.z}))),
        is_sound_(is_finite(min) && is_finite(max) && min.x <= max.x && min.y <= max.y && min.z <= max.z &&
                  rounding >= 0.0 && std::isfinite(rounding)) {}

  [[nodiscard]] bool is_sound() const { return is_sound_; }
  [[nodiscard]] DVec3 min() const { return min_; }
  [[nodiscard]] DVec3 max() const { return max_; }
  /// Negative inside.
  [[nodiscard]] double distance(DVec3 point) const {
    QUOIN_ASSERT(is_sound_, "a valid box");
    const DVec3 beyond = glm::abs(point - middle_) - (half_size_ - rounding_);
    const DVec3 outside = glm::max(beyond, DVec3(0.0));
    const double inside = std::min(std::max({beyond.x, beyond.y, beyond.z}), 0.0);
    return std::sqrt(outside.x * outside.x + outside.y * outside.y + outside.z * outside.z) + inside - rounding_;
  }

 private:
  DVec3 min_;
  DVec3 max_;
  DVec3 middle_;
  DVec3 half_size_;
  double rounding_;
  bool is_sound_;
};

class Plane {
 public:
  /// `normal`: of any length except 0.
  Plane(DVec3 point, DVec3 normal) : point_(point) {
    const double largest = std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
    is_sound_ = is_finite(point) && is_finite(normal) && largest > 0.0;
    if (!is_sound_) return;
    const DVec3 scaled = normal / largest;
    normal_ = scaled / std::sqrt(scaled.x * scaled.x + scaled.y * scaled.y + scaled.z * scaled.z);
  }

  [[nodiscard]] bool is_sound() const { return is_sound_; }
  /// Positive on the side that the normal points to.
  [[nodiscard]] double distance(DVec3 point) const {
    QUOIN_ASSERT(is_sound_, "a valid plane");
    // A quarter of each part, so that no sum of finite numbers overflows.
    const DVec3 d = 0.25 * point - 0.25 * point_;
    return 4.0 * (d.x * normal_.x + d.y * normal_.y + d.z * normal_.z);
  }

 private:
  DVec3 point_;
  DVec3 normal_{0.0};
  bool is_sound_ = false;
};

/// A sphere whose effect on an edit fades towards its rim.
class Brush {
 public:
  /// `strength`: at the centre; more than 1 counts as 1.
  Brush(DVec3 centre, double radius, double strength)
      : sphere_(centre, radius), centre_(centre), radius_(radius), strength_(std::min(strength, 1.0)) {}

  [[nodiscard]] bool is_sound() const { return sphere_.is_sound() && radius_ > 0.0 && strength_ > 0.0; }
  [[nodiscard]] const Sphere& sphere() const { return sphere_; }
  /// Returns strength * (1 - (distance / radius)^2)^2 inside, 0 outside.
  [[nodiscard]] double weight(DVec3 point) const {
    QUOIN_ASSERT(is_sound(), "a valid brush");
    const DVec3 d = (point - centre_) / radius_;
    const double left = 1.0 - (d.x * d.x + d.y * d.y + d.z * d.z);
    return left > 0.0 ? strength_ * left * left : 0.0;
  }

 private:
  Sphere sphere_;
  DVec3 centre_;
  double radius_;
  double strength_;
};

// Distances from the middle of a chunk's samples, and of a row's, to the farthest sample.
constexpr double kMiddle = 0.5 * (kChunkEdge - 1);
constexpr double kChunkRadius = 54.6;
constexpr double kRowRadius = kMiddle;

/// Returns the minimum of two distances. If they differ by less than `blend`, a parabola joins both smoothly.
///
/// Densities end at the band: a value of `band` may be anything larger, so the blend narrows to 0 towards it.
/// Source: I. Quilez, "smooth minimum": min(a, b) - h^2 / (4 k), h = max(k - |a - b|, 0).
double united(double a, double b, double blend, double band) {
  const double width = std::min(blend, band - std::max(a, b));
  if (!(width > 0.0)) return std::min(a, b);
  const double overlap = std::max(width - std::abs(a - b), 0.0);
  return std::min(a, b) - overlap * overlap / (4.0 * width);
}

bool is_length(double value) {
  return value >= 0.0 && std::isfinite(value);
}

// Sets the densities of part of a row to `combine(density, distance to the shape)`. Samples that become solid get
// `material`.
template <class Shape, class Combine>
void combine_row(const Shape& shape, IVec3 start, int first, int end, VoxelType material, SampleRow& row,
                 Combine&& combine) {
  QUOIN_ASSERT(first >= 0 && first <= end && end <= kChunkEdge, "0 <= first <= end <= 64");
  for (int x = first; x < end; ++x) {
    const auto i = static_cast<std::size_t>(x);
    const float before = row.densities[i];
    const double distance = shape.distance(DVec3(start) + DVec3{static_cast<double>(x), 0.0, 0.0});
    row.densities[i] = static_cast<float>(combine(double{before}, distance));
    if (!(before < 0.0F) && row.densities[i] < 0.0F) row.materials[i] = material;
  }
}

// Applies `combine` wherever the shape's distance is below the band; elsewhere it must leave densities as they are.
template <class Shape, class Combine>
std::int64_t apply_shape(DensityStore& store, const Shape& shape, bool adds, VoxelType material,
                         const Progress& progress, Combine&& combine) {
  const double band = store.band();
  const auto choose = [&](IVec3 chunk) {
    const double distance = shape.distance(DVec3(chunk) * double{kChunkEdge} + kMiddle);
    if (distance - kChunkRadius >= band) return ChunkEdit::Nothing;
    return adds && distance + kChunkRadius <= -band ? ChunkEdit::Solid : ChunkEdit::Rows;
  };
  const auto change = [&](IVec3 start, int first, int end, SampleRow& row) {
    if (shape.distance(DVec3(start) + DVec3{kMiddle, 0.0, 0.0}) - kRowRadius >= band) return false;
    combine_row(shape, start, first, end, material, row, combine);
    return true;
  };
  return store.edit(box_around(shape.min() - band, shape.max() + band), adds, material, choose, change, progress);
}

template <class Shape>
std::int64_t add_shape(DensityStore& store, const Shape& shape, VoxelType material, double blend,
                       const Progress& progress) {
  if (!shape.is_sound() || !is_length(blend)) return 0;
  return apply_shape(store, shape, true, material, progress,
                     [&](double a, double b) { return united(a, b, blend, store.band()); });
}

template <class Shape>
std::int64_t remove_shape(DensityStore& store, const Shape& shape, double blend) {
  if (!shape.is_sound() || !is_length(blend)) return 0;
  return apply_shape(store, shape, false, kAir, {},
                     [&](double a, double b) { return -united(-a, b, blend, store.band()); });
}

}  // namespace

bool DensityGrid::set(IVec3 sample, DensitySample value) {
  const auto replace = [&](IVec3 start, int, int, SampleRow& row) {
    const auto i = static_cast<std::size_t>(sample.x - start.x);
    row.densities[i] = value.density;
    row.materials[i] = value.material;
    return true;
  };
  const auto rows = [](IVec3) { return ChunkEdit::Rows; };
  const NotifyOnExit notify(impl_->store, notifier_);
  return impl_->store.edit(box_from(sample, sample), true, kAir, rows, replace, {}) != 0;
}

std::int64_t DensityGrid::edit_rows(
    const IBox& box, FunctionRef<void(IVec3 first, std::span<float> densities, std::span<VoxelType> materials)> change,
    const Progress& progress) {
  const auto change_part = [&](IVec3 start, int first, int end, SampleRow& row) {
    const auto from = static_cast<std::size_t>(first);
    const auto count = static_cast<std::size_t>(end - first);
    change(start + IVec3{first, 0, 0}, std::span(row.densities).subspan(from, count),
           std::span(row.materials).subspan(from, count));
    return true;
  };
  const auto rows = [](IVec3) { return ChunkEdit::Rows; };
  const NotifyOnExit notify(impl().store, notifier_);
  return impl().store.edit(box_from(box), true, kAir, rows, change_part, progress);
}

std::int64_t DensityGrid::add_sphere(DVec3 centre, double radius, VoxelType material, double blend,
                                     const Progress& progress) {
  const NotifyOnExit notify(impl().store, notifier_);
  return add_shape(impl().store, Sphere(centre, radius), material, blend, progress);
}

std::int64_t DensityGrid::remove_sphere(DVec3 centre, double radius, double blend) {
  const NotifyOnExit notify(impl().store, notifier_);
  return remove_shape(impl().store, Sphere(centre, radius), blend);
}

std::int64_t DensityGrid::add_box(DVec3 min, DVec3 max, VoxelType material, double rounding, double blend,
                                  const Progress& progress) {
  const NotifyOnExit notify(impl().store, notifier_);
  return add_shape(impl().store, RoundedBox(min, max, rounding), material, blend, progress);
}

std::int64_t DensityGrid::remove_box(DVec3 min, DVec3 max, double rounding, double blend) {
  const NotifyOnExit notify(impl().store, notifier_);
  return remove_shape(impl().store, RoundedBox(min, max, rounding), blend);
}

std::int64_t DensityGrid::flatten(DVec3 centre, double radius, const FlattenOptions& options,
                                  const Progress& progress) {
  const Brush brush(centre, radius, options.strength);
  const Plane plane(options.point, options.normal);
  if (!brush.is_sound() || !plane.is_sound()) return 0;
  const NotifyOnExit notify(impl().store, notifier_);
  DensityStore& store = impl().store;
  const double band = store.band();
  const auto choose = [&](IVec3 chunk) {
    const DVec3 middle = DVec3(chunk) * double{kChunkEdge} + kMiddle;
    if (brush.sphere().distance(middle) >= kChunkRadius) return ChunkEdit::Nothing;
    const bool stays_air = plane.distance(middle) - kChunkRadius >= band && store.find(chunk) == nullptr;
    return stays_air ? ChunkEdit::Nothing : ChunkEdit::Rows;
  };
  const auto change = [&](IVec3 start, int first, int end, SampleRow& row) {
    for (int x = first; x < end; ++x) {
      const DVec3 at = DVec3(start) + DVec3{static_cast<double>(x), 0.0, 0.0};
      const double weight = brush.weight(at);
      if (weight == 0.0) continue;
      float& density = row.densities[static_cast<std::size_t>(x)];
      const double wanted = std::clamp(plane.distance(at), -band, band);
      const auto moved = static_cast<float>(density + weight * (wanted - density));
      if (!(density < 0.0F) && moved < 0.0F) row.materials[static_cast<std::size_t>(x)] = options.material;
      density = moved;
    }
    return true;
  };
  return store.edit(box_around(brush.sphere().min(), brush.sphere().max()), true, options.material, choose, change,
                    progress);
}

namespace {

constexpr int kSide = kChunkEdge + 2;

/// New values of a part of a chunk, computed before any sample changes.
struct Smoothed {
  ChunkPart part;
  std::vector<float> densities;                         // x fastest, of the part
  std::vector<std::pair<IVec3, VoxelType>> new_solids;  // samples and their materials, in the order of `densities`
};

bool is_one_value(const DensityNeighbourhood& around) {
  const auto value = [&](const DensityChunk* chunk) {
    return chunk == nullptr ? std::optional(around.outside) : chunk->uniform();
  };
  const std::optional<Half> first = value(around.chunks[0]);
  return first.has_value() && std::all_of(around.chunks.begin(), around.chunks.end(),
                                          [&](const DensityChunk* chunk) { return value(chunk) == first; });
}

/// The densities of a part of a chunk and one sample around it.
class SampledPart {
 public:
  SampledPart() {
    values_.resize(std::size_t{kSide} * kSide * kSide);
    row_sums_.resize(values_.size());
  }

  void read(const DensityNeighbourhood& around, const IBox& part) {
    QUOIN_ASSERT(intersect(part, kWholeChunk) == part, "a part of the chunk");
    part_ = part;
    for (int z = part.min.z - 1; z <= part.max.z; ++z) {
      for (int y = part.min.y - 1; y <= part.max.y; ++y) {
        double* row = values_.data() + index({0, y, z});
        for (int x = part.min.x - 1; x <= part.max.x; ++x) row[x] = float_from_half(around.get({x, y, z}));
        double* sums = row_sums_.data() + index({0, y, z});
        for (int x = part.min.x; x < part.max.x; ++x) sums[x] = row[x - 1] + row[x] + row[x + 1];
      }
    }
  }
  [[nodiscard]] double at(IVec3 p) const { return values_[index(p)]; }
  // Sums of halves are exact in double, in any order.
  [[nodiscard]] double mean_of_neighbours(IVec3 p) const {
    double sum = 0.0;
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) sum += row_sums_[index(p + IVec3{0, dy, dz})];
    }
    return (sum - at(p)) / 26.0;
  }

 private:
  [[nodiscard]] static std::size_t index(IVec3 p) {
    return static_cast<std::size_t>(((p.z + 1) * kSide + p.y + 1) * kSide + p.x + 1);
  }

  IBox part_;
  Buffer<double> values_;
  Buffer<double> row_sums_;
};

// Returns the most frequent material of the solid samples among the 26 neighbours; at ties the lowest.
VoxelType prevailing_material(const DensityStore& store, IVec3 sample) {
  std::map<VoxelType, int> counts;
  for (int i = 0; i < 27; ++i) {
    const IVec3 at = sample + Neighbourhood::offset(i);
    if (i != 13 && DensityChunk::is_solid(store.get(at))) ++counts[store.material(at)];
  }
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == counts.end() ? kAir : most->first;
}

Smoothed smoothed(const DensityStore& store, const Brush& brush, const ChunkPart& part, const SampledPart& window) {
  Smoothed result{part, {}, {}};
  const IVec3 size = part.box.size();
  result.densities.reserve(static_cast<std::size_t>(size.x * size.y * size.z));
  for (int z = part.box.min.z; z < part.box.max.z; ++z) {
    for (int y = part.box.min.y; y < part.box.max.y; ++y) {
      for (int x = part.box.min.x; x < part.box.max.x; ++x) {
        const IVec3 sample = part.chunk * kChunkEdge + IVec3{x, y, z};
        const double before = window.at({x, y, z});
        const double weight = brush.weight(DVec3(sample));
        const double mean = weight == 0.0 ? before : window.mean_of_neighbours({x, y, z});
        const auto after = static_cast<float>(before + weight * (mean - before));
        result.densities.push_back(after);
        if (!(before < 0.0) && after < 0.0F) {
          result.new_solids.emplace_back(sample, prevailing_material(store, sample));
        }
      }
    }
  }
  return result;
}

// Returns the parts of a box that can change: far air changes only next to a chunk.
std::vector<ChunkPart> parts_near_chunks(const DensityStore& store, const LongBox& box) {
  std::vector<IVec3> chunks;
  const IBox wanted = chunks_of(box);
  const IBox near{wanted.min - 1, wanted.max + 1};
  store.entries().for_each_in(near, [&](IVec3 at, const DensityStore::Entry&) {
    for (int i = 0; i < 27; ++i) {
      const IVec3 chunk = at + Neighbourhood::offset(i);
      if (wanted.contains(chunk)) chunks.push_back(chunk);
    }
  });
  sort_and_unite(chunks);
  std::vector<ChunkPart> parts;
  parts.reserve(chunks.size());
  for (const IVec3 chunk : chunks) parts.push_back({chunk, part_of(box, chunk)});
  return parts;
}

}  // namespace

std::int64_t DensityGrid::smooth(DVec3 centre, double radius, double strength) {
  const Brush brush(centre, radius, strength);
  if (!brush.is_sound()) return 0;
  const NotifyOnExit notify(impl().store, notifier_);
  DensityStore& store = impl().store;
  const LongBox box = clipped(box_around(brush.sphere().min(), brush.sphere().max()));
  if (is_empty(box)) return 0;
  std::vector<ChunkPart> parts;
  std::vector<Smoothed> news;
  SampledPart window;
  for (const ChunkPart& part : parts_near_chunks(store, box)) {
    if (!is_loaded_around(part.chunk)) continue;  // the result would depend on unknown samples
    const DensityNeighbourhood around = neighbourhood(part.chunk);
    if (is_one_value(around)) continue;
    window.read(around, part.box);
    news.push_back(smoothed(store, brush, part, window));
    parts.push_back(part);
  }
  // Parts and their rows come in the order of computation.
  auto current = news.begin();
  std::size_t next = 0;
  std::size_t next_solid = 0;
  return store.edit_parts(parts, [&](IVec3 start, int first, int end, SampleRow& row) {
    if (next == current->densities.size()) {
      ++current;
      next = 0;
      next_solid = 0;
    }
    QUOIN_ASSERT(current != news.end() && next < current->densities.size(), "a row that was computed");
    for (int x = first; x < end; ++x) {
      const auto i = static_cast<std::size_t>(x);
      row.densities[i] = current->densities[next++];
      const auto& solids = current->new_solids;
      if (next_solid < solids.size() && solids[next_solid].first == start + IVec3{x, 0, 0}) {
        row.materials[i] = solids[next_solid++].second;
      }
    }
    return true;
  });
}

}  // namespace quoin

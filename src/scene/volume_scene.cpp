#include <quoin/scene/volume_scene.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

// Tolerances: for unit axes, and for spacings relative to the smallest.
constexpr double kSkew = 1e-4;
constexpr double kUneven = 1e-3;

// The positions of samples: along unit axes, at these distances, from a corner.
struct Lattice {
  glm::dmat3 axes{1.0};
  DVec3 spacing{1.0};
  DVec3 corner{0.0};
};

Result<Lattice> lattice_of(const Volume& volume) {
  Lattice lattice;
  lattice.corner = DVec3(volume.world_from_voxel[3]);
  for (int axis = 0; axis < 3; ++axis) {
    const DVec3 step(volume.world_from_voxel[axis]);
    const double length = glm::length(step);
    if (!(length > 0.0) || !std::isfinite(length) || !is_finite(lattice.corner)) {
      return make_error(ErrorCode::InvalidArgument, "the volume's transform must be finite, with axes that are not 0");
    }
    lattice.spacing[axis] = length;
    lattice.axes[axis] = step / length;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(glm::dot(lattice.axes[axis], lattice.axes[(axis + 1) % 3])) > kSkew) {
      return make_error(ErrorCode::Unsupported, "the volume's axes are not perpendicular");
    }
  }
  return lattice;
}

// The position of a finer lattice's sample between two samples of the volume along an axis.
struct Between {
  std::size_t low = 0;
  std::size_t high = 0;
  float share = 0.0F;
};

double station_count(int size, double spacing, double step) {
  return std::floor((size - 1) * spacing / step + kUneven) + 1.0;
}

// Requires: station_count fits.
std::vector<Between> stations(int size, double spacing, double step) {
  QUOIN_ASSERT(size > 0 && spacing > 0.0 && step > 0.0, "samples with a positive spacing");
  std::vector<Between> all(static_cast<std::size_t>(station_count(size, spacing, step)));
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double at = std::min(static_cast<double>(i) * step / spacing, size - 1.0);
    all[i].low = static_cast<std::size_t>(at);
    all[i].high = std::min(all[i].low + 1, static_cast<std::size_t>(size - 1));
    all[i].share = static_cast<float>(at - std::floor(at));
  }
  return all;
}

float mix(float a, float b, float share) {
  // A sample next to an infinite one keeps its own value: the difference alone would give NaN.
  return share == 0.0F ? a : a + share * (b - a);
}

Result<Volume> with_even_spacing(const Volume& volume, const Lattice& lattice, double step, Threads threads) {
  double samples = 1.0;
  for (int axis = 0; axis < 3; ++axis) samples *= station_count(volume.size[axis], lattice.spacing[axis], step);
  // A small file whose spacings differ by a factor of a million must not take memory and minutes.
  constexpr double kMostSamples = 0x1p31;
  constexpr double kMostTimes = 1024.0;
  constexpr double kFew = 0x1p22;
  const double most = std::min(kMostSamples, kFew + kMostTimes * static_cast<double>(volume.values.size()));
  if (!(samples <= most)) {
    return make_error(ErrorCode::LimitExceeded,
                      "cannot resample the volume: its spacings differ so much that the result would exceed " +
                          std::to_string(static_cast<std::int64_t>(most)) + " samples; make them more alike");
  }
  const std::vector<Between> x = stations(volume.size.x, lattice.spacing.x, step);
  const std::vector<Between> y = stations(volume.size.y, lattice.spacing.y, step);
  const std::vector<Between> z = stations(volume.size.z, lattice.spacing.z, step);
  Volume even;
  even.size = {static_cast<int>(x.size()), static_cast<int>(y.size()), static_cast<int>(z.size())};
  even.min = volume.min;
  even.max = volume.max;
  even.values.resize(x.size() * y.size() * z.size());
  const auto width = static_cast<std::size_t>(volume.size.x);
  const auto height = static_cast<std::size_t>(volume.size.y);
  parallel_for(z.size(), threads, [&](std::size_t k) {
    for (std::size_t j = 0; j < y.size(); ++j) {
      const auto row = [&](std::size_t sample_y, std::size_t sample_z) {
        return volume.values.data() + width * (sample_y + height * sample_z);
      };
      const float* const rows[4] = {row(y[j].low, z[k].low), row(y[j].high, z[k].low), row(y[j].low, z[k].high),
                                    row(y[j].high, z[k].high)};
      float* out = even.values.data() + x.size() * (j + y.size() * k);
      for (const Between& at : x) {
        const auto along = [&](const float* values) { return mix(values[at.low], values[at.high], at.share); };
        const float low = mix(along(rows[0]), along(rows[1]), y[j].share);
        const float high = mix(along(rows[2]), along(rows[3]), y[j].share);
        *out++ = mix(low, high, z[k].share);
      }
    }
  });
  return even;
}

/// Returns the field of a volume with equal spacings.
Result<DensityGrid> field_of(const Volume& volume, const Lattice& lattice, double step,
                             const VolumeFieldOptions& options, Threads threads, const Progress& progress) {
  const auto samples = static_cast<std::size_t>(std::max(volume.size.x, 0)) *
                       static_cast<std::size_t>(std::max(volume.size.y, 0)) *
                       static_cast<std::size_t>(std::max(volume.size.z, 0));
  const DVec3 spacing = lattice.spacing;
  const bool is_even = std::max(std::max(spacing.x, spacing.y), spacing.z) <= step * (1.0 + kUneven);
  // Invalid volumes go to field_from_volume, which reports the error.
  const bool is_sound = samples > 0 && volume.values.size() == samples;
  if (is_even || !is_sound) return field_from_volume(volume, options, threads, progress);
  const auto even = with_even_spacing(volume, lattice, step, threads);
  if (!even) return even.error();
  return field_from_volume(*even, options, threads, progress);
}

Instance placed_by(const Lattice& lattice, double step) {
  Instance placed;
  placed.position = lattice.corner;
  placed.voxel_size = step;
  glm::dmat3 axes = lattice.axes;
  placed.mirrored = glm::determinant(axes) < 0.0;
  if (placed.mirrored) axes[0] = -axes[0];
  placed.rotation = glm::normalize(glm::quat_cast(axes));
  return placed;
}

}  // namespace

Result<Scene> scene_from_volume(const Volume& volume, const VolumeSceneOptions& options, Threads threads,
                                const Progress& progress) {
  const auto lattice = lattice_of(volume);
  if (!lattice) return lattice.error();
  Scene scene;
  VoxelProperties look;
  look.name = volume.name;
  look.colour = options.colour;
  const auto material = scene.types.add(look);
  if (!material) return material.error();

  const DVec3 spacing = lattice->spacing;
  const double step = std::min(std::min(spacing.x, spacing.y), spacing.z);
  auto field = field_of(volume, *lattice, step, {options.iso, *material}, threads, progress);
  if (!field) return field.error();

  SceneGrid grid;
  grid.name = volume.name;
  grid.field = std::move(*field);
  Instance placed = placed_by(*lattice, step);
  placed.name = volume.name;
  placed.grid = scene.add_grid(std::move(grid));
  scene.add_instance(std::move(placed));
  return scene;
}

}  // namespace quoin

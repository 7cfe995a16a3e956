#include "grid/density_grid_impl.h"

namespace quoin {

bool DensityGrid::set(IVec3 sample, DensitySample value) {
  const auto replace = [&](IVec3 start, int, int, SampleRow& row) {
    const auto i = static_cast<std::size_t>(sample.x - start.x);
    row.densities[i] = value.density;
    row.materials[i] = value.material;
  };
  const auto rows = [](IVec3) { return ChunkEdit::Rows; };
  return impl_->store.edit(box_from(sample, sample), true, kAir, rows, replace) != 0;
}

std::int64_t DensityGrid::edit(const IBox& box,
                               const std::function<DensitySample(IVec3 sample, DensitySample current)>& pick) {
  return impl_->store.edit(
      box_from(box), true, kAir, [](IVec3) { return ChunkEdit::Rows; },
      [&](IVec3 start, int first, int end, SampleRow& row) {
        for (int x = first; x < end; ++x) {
          const auto i = static_cast<std::size_t>(x);
          const DensitySample picked = pick(start + IVec3{x, 0, 0}, {row.densities[i], row.materials[i]});
          row.densities[i] = picked.density;
          row.materials[i] = picked.material;
        }
      });
}

}  // namespace quoin

#include "terrain/lattice.h"

#include <array>

namespace quoin::terrain {
namespace {

constexpr float kParts = 1.0F / kLatticeStep;

// Sample -1 lies in the lattice's first cell, three quarters along.
int cell_of(int i) {
  return (i + kLatticeStep - 1) / kLatticeStep;
}

float place_in_cell(int i) {
  return static_cast<float>((i + kLatticeStep - 1) % kLatticeStep) * kParts;
}

}  // namespace

void Field::upsample(const Lattice& lattice) {
  std::array<float, kLatticeEdge> between;
  for (int z = 0; z < kFieldEdge; ++z) {
    const float tz = place_in_cell(z);
    for (int y = 0; y < kFieldEdge; ++y) {
      const float ty = place_in_cell(y);
      const float* v00 = lattice.row(cell_of(y), cell_of(z));
      const float* v10 = lattice.row(cell_of(y) + 1, cell_of(z));
      const float* v01 = lattice.row(cell_of(y), cell_of(z) + 1);
      const float* v11 = lattice.row(cell_of(y) + 1, cell_of(z) + 1);
      for (std::size_t i = 0; i < between.size(); ++i) {
        const float low = v00[i] + ty * (v10[i] - v00[i]);
        const float high = v01[i] + ty * (v11[i] - v01[i]);
        between[i] = low + tz * (high - low);
      }
      float* out = row(y, z);
      for (int x = 0; x < kFieldEdge; ++x) {
        const auto cell = static_cast<std::size_t>(cell_of(x));
        out[x] = between[cell] + place_in_cell(x) * (between[cell + 1] - between[cell]);
      }
    }
  }
}

}  // namespace quoin::terrain

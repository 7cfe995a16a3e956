#include "scene/smooth/marched_density.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/voxel_field.h>

#include "mesh/surface/voxel_surface.h"

namespace quoin {
namespace {

constexpr int kThickness = 4;            // of slabs, at most
constexpr int kMargin = kThickness + 1;  // rows read past the chunk
constexpr int kRows = kChunkEdge + 2 * kMargin;
constexpr float kHalf = 0.5F;
/// Density of air next to solid voxels that touch only by an edge. Below this value they are joined. A wall of such
/// voxels, at 45 degrees, becomes 0.79 voxels thick.
constexpr float kBesideEdge = 0.4F;

/// The voxels of a row along x, in two words that overlap by half: bit i is voxel i - 16 in the first word and voxel i
/// + 16 in the second. The neighbours up to 16 away of a chunk's voxel are then in the same word.
using RowWords = std::array<std::uint64_t, 2>;
constexpr int kShift = 16;

constexpr std::uint64_t moved(std::uint64_t word, int by) {
  QUOIN_ASSERT(by > -kShift && by < kShift, "a distance within the overlap");
  return by >= 0 ? word >> by : word << -by;
}

/// Finds the samples whose densities need a correction.
class Marks {
 public:
  explicit Marks(const Neighbourhood& voxels)
      : solid_(kRows * kRows), at_faces_(kRows * kRows), at_edges_(kRows * kRows) {
    for (int z = -kMargin; z < kChunkEdge + kMargin; ++z) {
      for (int y = -kMargin; y < kChunkEdge + kMargin; ++y) solid_[at(y, z)] = read(voxels, y, z);
    }
    for (int z = -1; z <= kChunkEdge; ++z) {
      for (int y = -1; y <= kChunkEdge; ++y) {
        for (const std::size_t half : {0, 1}) {
          for (int axis = 0; axis < 3; ++axis) {
            mark_along(axis, {y, z, half});
            mark_edges(axis, {y, z, half});
          }
        }
      }
    }
  }

  /// Samples half a voxel from the surface.
  [[nodiscard]] std::uint64_t at_faces(int y, int z) const { return row(at_faces_[at(y, z)]); }
  /// Samples around an edge shared by two solid voxels.
  [[nodiscard]] std::uint64_t at_edges(int y, int z) const { return row(at_edges_[at(y, z)]); }

 private:
  using Rows = std::vector<RowWords>;  // [z][y]

  static std::uint64_t row(const RowWords& words) {
    constexpr std::uint64_t kLow = 0xFFFF'FFFF;
    return (words[0] >> kShift & kLow) | (words[1] << kShift & ~kLow);
  }

  struct Place {
    int y;
    int z;
    std::size_t half;  // of the row
  };

  static std::size_t at(int y, int z) {
    QUOIN_ASSERT(std::min(y, z) >= -kMargin && std::max(y, z) < kChunkEdge + kMargin, "-5 <= y, z < 69");
    return static_cast<std::size_t>((z + kMargin) * kRows + y + kMargin);
  }

  static RowWords read(const Neighbourhood& voxels, int y, int z) {
    const auto part = [&](int dx) -> std::uint64_t {
      const Chunk* chunk = voxels.at(dx, y >> kChunkShift, z >> kChunkShift);
      return chunk == nullptr ? 0 : ~chunk->row_mask(y & (kChunkEdge - 1), z & (kChunkEdge - 1), kAir);
    };
    const std::uint64_t middle = part(0);
    return {part(-1) >> (kChunkEdge - kShift) | middle << kShift, middle >> kShift | part(1) << (kChunkEdge - kShift)};
  }

  // Returns the voxels of a row that have a voxel of the kind at `offset`.
  [[nodiscard]] std::uint64_t of_kind(bool is_solid, const Place& place, IVec3 offset) const {
    const std::uint64_t solid = solid_[at(place.y + offset.y, place.z + offset.z)][place.half];
    return moved(is_solid ? solid : ~solid, offset.x);
  }

  static void mark(Rows& rows, std::uint64_t found, const Place& place, IVec3 offset) {
    rows[at(place.y + offset.y, place.z + offset.z)][place.half] |= moved(found, -offset.x);
  }

  void mark_along(int axis, const Place& place) {
    IVec3 step{0};
    step[axis] = 1;
    for (const bool is_solid : {true, false}) {
      const std::uint64_t own = of_kind(is_solid, place, IVec3{0});
      const std::uint64_t after = own & of_kind(!is_solid, place, step);
      const std::uint64_t before = own & of_kind(!is_solid, place, -step);
      if (after != 0) mark_slab(after, is_solid, axis, step, place);
      if (before != 0) mark_slab(before, is_solid, axis, -step, place);
      if ((after & before) != 0) mark_thin(after & before, is_solid, axis, place);
    }
  }

  // Marks faces towards `out` in the middle of 3x3 faces of a thin slab.
  void mark_slab(std::uint64_t faces, bool is_solid, int axis, IVec3 out, const Place& place) {
    std::uint64_t ends = 0;
    for (int k = 1; k <= kThickness; ++k) ends |= of_kind(!is_solid, place, out * -k);
    faces &= ends;
    for (int i = 0; i < 9 && faces != 0; ++i) {
      IVec3 side{0};
      side[(axis + 1) % 3] = i % 3 - 1;
      side[(axis + 2) % 3] = i / 3 - 1;
      faces &= of_kind(is_solid, place, side) & of_kind(!is_solid, place, side + out);
    }
    mark(at_faces_, faces, place, IVec3{0});
    mark(at_faces_, faces, place, out);
  }

  // Marks both faces of features one voxel thick, except at a slant: there the voxel to the side is of the other kind,
  // but one of its neighbours along the axis is of this kind.
  void mark_thin(std::uint64_t found, bool is_solid, int axis, const Place& place) {
    IVec3 step{0};
    step[axis] = 1;
    for (const int other : {(axis + 1) % 3, (axis + 2) % 3}) {
      for (const int sign : {-1, 1}) {
        IVec3 side{0};
        side[other] = sign;
        found &= of_kind(is_solid, place, side) |
                 ~(of_kind(is_solid, place, side - step) | of_kind(is_solid, place, side + step));
      }
    }
    for (const int k : {-1, 0, 1}) mark(at_faces_, found, place, step * k);
  }

  // Marks edges along the axis where the only two solid voxels of four touch diagonally.
  void mark_edges(int axis, const Place& place) {
    IVec3 first{0};
    IVec3 second{0};
    first[(axis + 1) % 3] = 1;
    second[(axis + 2) % 3] = 1;
    const std::uint64_t here = of_kind(true, place, IVec3{0});
    const std::uint64_t across = of_kind(true, place, first + second);
    const std::uint64_t a = of_kind(true, place, first);
    const std::uint64_t b = of_kind(true, place, second);
    const std::uint64_t found = ~(here ^ across) & ~(a ^ b) & (here ^ a);
    if (found == 0) return;
    for (const IVec3 offset : {IVec3{0}, first, second, first + second}) mark(at_edges_, found, place, offset);
  }

  Rows solid_;
  Rows at_faces_;
  Rows at_edges_;
};

/// The solid voxels of a chunk that share a face with a voxel of another body.
class BodyBorders {
 public:
  BodyBorders(const Neighbourhood& voxels, const VoxelRegistry& types) {
    if (!has_several(voxels, types)) return;
    bodies_.resize(std::size_t{kWide} * kWide * kWide, kNone);
    for (int z = -1; z <= kChunkEdge; ++z) {
      for (int y = -1; y <= kChunkEdge; ++y) read_row(voxels, types, y, z);
    }
  }

  [[nodiscard]] bool is_empty() const { return bodies_.empty(); }

  /// Requires: not empty.
  [[nodiscard]] std::uint64_t row(int y, int z) const {
    QUOIN_ASSERT(!is_empty(), "borders between bodies");
    std::uint64_t found = 0;
    for (int x = 0; x < kChunkEdge; ++x) found |= std::uint64_t{has(x, y, z)} << x;
    return found;
  }

 private:
  [[nodiscard]] bool has(int x, int y, int z) const {
    const std::size_t here = at(x, y, z);
    const std::uint32_t own = bodies_[here];
    if (own == kNone) return false;
    const auto differs = [&](std::size_t other) { return bodies_[other] != kNone && bodies_[other] != own; };
    constexpr std::size_t kRow = kWide;
    constexpr std::size_t kLayer = kRow * kWide;
    return differs(here - 1) || differs(here + 1) || differs(here - kRow) || differs(here + kRow) ||
           differs(here - kLayer) || differs(here + kLayer);
  }

  static constexpr std::uint32_t kNone = ~0U;
  static constexpr int kWide = kChunkEdge + 2;

  static std::size_t at(int x, int y, int z) {
    QUOIN_ASSERT(std::min({x, y, z}) >= -1 && std::max({x, y, z}) <= kChunkEdge, "-1 <= x, y, z <= 64");
    return static_cast<std::size_t>(((z + 1) * kWide + y + 1) * kWide + x + 1);
  }

  static bool has_several(const Neighbourhood& voxels, const VoxelRegistry& types) {
    return types.has_transparent() && std::ranges::any_of(voxels.chunks, [&](const Chunk* chunk) {
             return chunk != nullptr && smooth::bodies_of(types, chunk->types()) != std::vector<std::uint32_t>{0};
           });
  }

  void read_row(const Neighbourhood& voxels, const VoxelRegistry& types, int y, int z) {
    const IVec3 local = local_of({0, y, z});
    const auto body = [&](VoxelType type) { return type == kAir ? kNone : smooth::body_of(types, type); };
    for (const int dx : {-1, 0, 1}) {
      const Chunk* chunk = voxels.at(dx, y >> kChunkShift, z >> kChunkShift);
      if (chunk == nullptr) continue;
      std::array<VoxelType, kChunkEdge> row;
      chunk->read_row(local.y, local.z, row);
      const int first = dx < 0 ? kChunkEdge - 1 : 0;
      const int last = dx > 0 ? 1 : kChunkEdge;
      for (int x = first; x < last; ++x) {
        bodies_[at(dx * kChunkEdge + x, y, z)] = body(row[static_cast<std::size_t>(x)]);
      }
    }
  }

  std::vector<std::uint32_t> bodies_;  // empty if there is at most one
};

}  // namespace

DensityChunk marched_density(const Neighbourhood& voxels, const VoxelRegistry& types) {
  DensityChunk made = density_of_voxels(voxels);
  if (made.uniform() == DensityNeighbourhood{}.outside) return made;
  const Marks marks(voxels);
  const BodyBorders borders(voxels, types);
  const Half in = stored_density(-kHalf, kHalf);
  const Half out = stored_density(kHalf, kHalf);
  const Half beside_edge = stored_density(kBesideEdge, kHalf);
  std::array<Half, kChunkEdge> row;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::uint64_t solid = made.solid_row(y, z);
      const std::uint64_t at_edges = marks.at_edges(y, z);
      const std::uint64_t at_faces = marks.at_faces(y, z) | (borders.is_empty() ? 0 : borders.row(y, z));
      if ((at_faces | at_edges) == 0) continue;
      made.read_row(y, z, row);
      for (std::size_t x = 0; x < kChunkEdge; ++x) {
        const std::uint64_t bit = std::uint64_t{1} << x;
        if (((at_faces | at_edges) & bit) == 0) continue;
        if ((solid & bit) != 0) {
          row[x] = in;
        } else {
          if ((at_faces & bit) != 0) row[x] = out;
          // For positive half floats the order of bits is the order of values.
          if ((at_edges & bit) != 0) row[x] = std::min(row[x], beside_edge);
        }
      }
      made.write_row(y, z, row);
    }
  }
  made.unite_slabs();
  return made;
}

}  // namespace quoin

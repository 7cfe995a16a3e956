#include "mesh/blocky/watertight.h"

#include <algorithm>

#include <quoin/core/assert.h>
#include <quoin/grid/chunk.h>

namespace quoin {
namespace {

constexpr int kLattice = kChunkEdge + 1;

std::size_t lattice_index(IVec3 p) {
  QUOIN_ASSERT(std::min({p.x, p.y, p.z}) >= 0 && std::max({p.x, p.y, p.z}) < kLattice,
               "a corner of the chunk's voxels");
  return static_cast<std::size_t>((p.z * kLattice + p.y) * kLattice + p.x);
}

bool is_on_border(int coordinate) {
  return coordinate == 0 || coordinate == kChunkEdge;
}

// Returns true if an edge along `axis` through `p` is in a border plane of the chunk.
bool edge_is_on_border(IVec3 p, int axis) {
  for (int other = 0; other < 3; ++other) {
    if (other != axis && is_on_border(p[other])) return true;
  }
  return false;
}

// Returns the indices of the four corners in an outline.
std::array<std::size_t, 4> corner_places(const std::vector<OutlinePoint>& outline) {
  std::array<std::size_t, 4> places{};
  std::size_t found = 1;
  for (std::size_t i = 1; i < outline.size() && found < 4; ++i) {
    const IVec3 before = outline[i].position - outline[i - 1].position;
    const IVec3 after = outline[(i + 1) % outline.size()].position - outline[i].position;
    const bool is_straight = glm::sign(before) == glm::sign(after);
    if (!is_straight) places[found++] = i;
  }
  QUOIN_ASSERT(found == 4, "an outline with four corners");
  return places;
}

}  // namespace

void OutlineFinder::prepare(const QuadBuffer& quads) {
  corners_.assign((static_cast<std::size_t>(kLattice) * kLattice * kLattice + 63) / 64, 0);
  for (const Quad& quad : quads) {
    for (int corner = 0; corner < 4; ++corner) {
      const std::size_t index = lattice_index(quad.corner(corner));
      corners_[index / 64] |= std::uint64_t{1} << (index % 64);
    }
  }
}

bool OutlineFinder::is_vertex(IVec3 p) const {
  QUOIN_ASSERT(!corners_.empty(), "quads that were prepared");
  const std::size_t index = lattice_index(p);
  return (corners_[index / 64] >> (index % 64) & 1U) != 0;
}

void OutlineFinder::outline(const Quad& quad, std::vector<OutlinePoint>& out) const {
  out.clear();
  for (int corner = 0; corner < 4; ++corner) {
    const IVec3 from = quad.corner(corner);
    const IVec3 to = quad.corner((corner + 1) % 4);
    const IVec3 step = glm::sign(to - from);
    const int axis = step.x != 0 ? 0 : step.y != 0 ? 1 : 2;
    const bool all = edge_is_on_border(from, axis);
    out.push_back({from, quad.occlusion(corner)});
    for (IVec3 p = from + step; p != to; p += step) {
      // Quads merge only where occlusion is constant, so occlusion is constant along an edge longer than a voxel.
      if (all || is_vertex(p)) out.push_back({p, quad.occlusion(corner)});
    }
  }
}

// A and C are the ends of the diagonal. Fans from C cover side A-B, fans from the last point before B cover side B-C.
// The other half works in the same way.
void triangulate_outline(const std::vector<OutlinePoint>& outline, bool flipped, std::uint32_t base,
                         std::vector<std::uint32_t>& indices) {
  const std::array<std::size_t, 4> corners = corner_places(outline);
  const std::size_t count = outline.size();
  const auto emit = [&](std::size_t a, std::size_t b, std::size_t c) {
    for (const std::size_t i : {a, b, c}) indices.push_back(base + static_cast<std::uint32_t>(i % count));
  };
  const auto half = [&](std::size_t a, std::size_t b, std::size_t c) {
    // Indices increase from a to b to c, modulo the count.
    const std::size_t to_b = (b + count - a) % count;
    const std::size_t to_c = (c + count - a) % count;
    for (std::size_t i = 0; i + 1 < to_b; ++i) emit(a + i, a + i + 1, c);
    for (std::size_t i = to_b; i < to_c; ++i) emit(a + to_b - 1, a + i, a + i + 1);
  };
  const std::size_t first = flipped ? 1 : 0;
  half(corners[first], corners[first + 1], corners[(first + 2) % 4]);
  half(corners[(first + 2) % 4], corners[(first + 3) % 4], corners[first]);
}

}  // namespace quoin

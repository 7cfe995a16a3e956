#include "mesh/surface/manifold.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include <quoin/core/assert.h>

namespace quoin {

namespace {

/// A triangle as seen from one of its vertices: it leads from one neighbour to the next.
struct Arc {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::uint32_t triangle = 0;
};

/// The triangles of each vertex.
class Corners {
 public:
  explicit Corners(const Triangulation& mesh) : first_(mesh.positions.size() + 1), triangles_(mesh.indices.size()) {
    for (const std::uint32_t index : mesh.indices) {
      QUOIN_ASSERT(index < mesh.positions.size(), "a vertex of the mesh");
      ++first_[index + std::size_t{1}];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
      triangles_[next[mesh.indices[i]]++] = static_cast<std::uint32_t>(i / 3);
    }
  }

  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t vertex) const {
    QUOIN_ASSERT(vertex + std::size_t{1} < first_.size(), "a vertex of the mesh");
    return std::span(triangles_).subspan(first_[vertex], first_[vertex + std::size_t{1}] - first_[vertex]);
  }

 private:
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> triangles_;
};

/// Replaces `arcs` by the arcs around a vertex, sorted by their start.
void arcs_around(const Triangulation& mesh, const Corners& corners, std::uint32_t vertex, std::vector<Arc>& arcs) {
  arcs.clear();
  for (const std::uint32_t triangle : corners.of(vertex)) {
    const std::uint32_t* at = mesh.indices.data() + std::size_t{3} * triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      if (at[k] == vertex) arcs.push_back({at[(k + 1) % 3], at[(k + 2) % 3], triangle});
    }
  }
  std::sort(arcs.begin(), arcs.end(),
            [](const Arc& a, const Arc& b) { return a.from != b.from ? a.from < b.from : a.triangle < b.triangle; });
}

void remove_back_to_back(Triangulation& mesh) {
  QUOIN_ASSERT(mesh.corners.size() == mesh.indices.size(), "one corner per index");
  const Corners corners(mesh);
  std::vector<bool> is_removed(mesh.indices.size() / 3);
  std::vector<Arc> arcs;
  for (std::uint32_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    arcs_around(mesh, corners, vertex, arcs);
    for (const Arc& arc : arcs) {
      if (vertex > std::min(arc.from, arc.to) || arc.from > arc.to || is_removed[arc.triangle]) continue;
      const auto opposite = std::find_if(arcs.begin(), arcs.end(), [&](const Arc& other) {
        return other.from == arc.to && other.to == arc.from && !is_removed[other.triangle];
      });
      if (opposite == arcs.end()) continue;
      is_removed[arc.triangle] = is_removed[opposite->triangle] = true;
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < is_removed.size(); ++i) {
    if (is_removed[i]) continue;
    for (std::size_t k = 0; k < 3; ++k, ++kept) {
      mesh.indices[kept] = mesh.indices[3 * i + k];
      mesh.corners[kept] = mesh.corners[3 * i + k];
    }
  }
  mesh.indices.resize(kept);
  mesh.corners.resize(kept);
}

/// Returns the first arc that starts at a neighbour, or the number of arcs if there is none.
std::size_t first_from(const std::vector<Arc>& arcs, std::uint32_t neighbour) {
  const auto found = std::lower_bound(arcs.begin(), arcs.end(), neighbour,
                                      [](const Arc& arc, std::uint32_t value) { return arc.from < value; });
  if (found == arcs.end() || found->from != neighbour) return arcs.size();
  return static_cast<std::size_t>(found - arcs.begin());
}

/// Returns true if the arcs form one ring: following them from the first leads back to it through all others.
bool are_one_ring(const std::vector<Arc>& arcs) {
  std::size_t at = 0;
  for (std::size_t passed = 1; passed <= arcs.size(); ++passed) {
    at = first_from(arcs, arcs[at].to);
    if (at == 0) return passed == arcs.size();
    if (at == arcs.size()) return false;
  }
  return arcs.empty();
}

/// Splits arcs into rings that pass no neighbour twice. Returns the ring number of each arc, starting at 0. Arcs
/// outside of any ring are in ring 0.
std::vector<std::uint32_t> rings_of(const std::vector<Arc>& arcs) {
  std::vector<std::uint32_t> ring(arcs.size(), 0);
  std::vector<bool> is_used(arcs.size());
  std::vector<std::size_t> path;
  std::uint32_t rings = 0;
  for (std::size_t start = 0; start < arcs.size(); ++start) {
    if (is_used[start]) continue;
    path.assign(1, start);
    is_used[start] = true;
    while (!path.empty()) {
      const std::uint32_t at = arcs[path.back()].to;
      // A neighbour that is already on the path closes a ring, which is removed from the path.
      const auto begin = std::find_if(path.begin(), path.end(), [&](std::size_t i) { return arcs[i].from == at; });
      if (begin != path.end()) {
        std::for_each(begin, path.end(), [&](std::size_t i) { ring[i] = rings; });
        path.erase(begin, path.end());
        ++rings;
        continue;
      }
      std::size_t next = first_from(arcs, at);
      while (next < arcs.size() && arcs[next].from == at && is_used[next]) ++next;
      if (next == arcs.size() || arcs[next].from != at) break;
      is_used[next] = true;
      path.push_back(next);
    }
  }
  return ring;
}

/// Makes one vertex per ring, each moved towards the middle of its neighbours.
void split(Triangulation& mesh, std::uint32_t vertex, const std::vector<Arc>& arcs, float distance) {
  QUOIN_ASSERT(!arcs.empty(), "a vertex of triangles");
  const std::vector<std::uint32_t> ring = rings_of(arcs);
  const std::size_t rings = *std::max_element(ring.begin(), ring.end()) + std::size_t{1};
  if (rings == 1) return;
  const Vec3 place = mesh.positions[vertex];
  std::vector<std::uint32_t> vertex_of(rings, vertex);
  std::vector<Vec3> sum(rings, Vec3(0.0F));
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    const Vec3 away = mesh.positions[arcs[i].from] - place;
    const float length = glm::length(away);
    if (length > 0.0F) sum[ring[i]] += away / length;
  }
  for (std::size_t i = 0; i < rings; ++i) {
    const float length = glm::length(sum[i]);
    const Vec3 moved = length > 1e-6F ? place + sum[i] * (distance / length) : place;
    if (i == 0) {
      mesh.positions[vertex] = moved;
      continue;
    }
    vertex_of[i] = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(moved);
  }
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    std::uint32_t* at = mesh.indices.data() + std::size_t{3} * arcs[i].triangle;
    *std::find(at, at + 3, vertex) = vertex_of[ring[i]];
  }
}

}  // namespace

void make_manifold(Triangulation& mesh, float distance) {
  remove_back_to_back(mesh);
  const Corners corners(mesh);
  const auto count = static_cast<std::uint32_t>(mesh.positions.size());
  std::vector<Arc> arcs;
  for (std::uint32_t vertex = 0; vertex < count; ++vertex) {
    arcs_around(mesh, corners, vertex, arcs);
    if (!are_one_ring(arcs)) split(mesh, vertex, arcs, distance);
  }
}

}  // namespace quoin

#include "mesh/smooth/level_cells.h"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <vector>

#include <quoin/core/assert.h>

#include "mesh/nets/cell.h"

namespace quoin::smooth {
namespace {

// The sum of the crossings on a cell's boundary. Computed in double and in the cell's own order, so that every
// chunk that computes the vertex gets the same bits.
struct Crossings {
  DVec3 sum{0.0};  // weighted sum of fractions of the cell
  double weight = 0.0;
  DVec3 slopes{0.0};  // towards the air
};

class Transitions {
 public:
  Transitions(const DensityNeighbourhood& chunks, const SmoothOptions& options, SmoothChunkMesh& out)
      : chunks_(chunks), options_(options), levels_(options.levels), out_(out) {}

  void run(const MeshOwnCells& mesh_own_cells) {
    mesh_own_cells(out_);
    kernel_vertices_ = out_.cells.size();
    recompute_own_cells();
    recompute_diagonals();
    for (int axis = 0; axis < 3; ++axis) add_polygons_on_lower_faces(axis);
    if (options_.split_sheets) split_sheets(chunks_, options_, out_.indices.size(), out_);
    for (const std::uint32_t index : triangles_) out_.indices.push_back(index);
  }

 private:
  [[nodiscard]] float density(IVec3 sample) const { return float_from_half(chunks_.get(sample)); }
  [[nodiscard]] bool is_solid(IVec3 sample) const { return is_solid_at(chunks_, sample); }

  // Computes the vertices of the chunk's own cells that touch a finer chunk.
  void recompute_own_cells() {
    const int level = levels_.of_chunk(IVec3{0});
    if (level == 0) return;
    const int last = (kChunkEdge >> level) - 1;
    for (int z = 0; z <= last; ++z) {
      for (int y = 0; y <= last; ++y) {
        const bool is_border_row = y == 0 || y == last || z == 0 || z == last;
        for (int x = 0; x <= last; x += is_border_row ? 1 : last) {
          const LevelCell cell{IVec3{0}, IVec3{x, y, z} * (1 << level), level};
          if (levels_.touches_finer(cell)) recompute(cell);
        }
      }
    }
  }

  void recompute(const LevelCell& cell) {
    const std::optional<CellVertex> vertex = transition_vertex(cell);
    if (!vertex) return;
    if (const auto found = kernel_vertex(cell.name())) {
      write_vertex(chunks_, options_.occlusion, cell, *vertex, *found, out_);
      if (recomputed_.empty()) recomputed_.resize(kernel_vertices_);
      recomputed_[*found] = true;
    } else {
      append(cell, *vertex);
    }
  }

  // The kernel chose the diagonals with its own vertices.
  void recompute_diagonals() {
    if (recomputed_.empty()) return;
    for (std::size_t i = 0; i < out_.indices.size(); i += 6) {
      std::uint32_t* quad = out_.indices.data() + i;
      if (!(recomputed_[quad[0]] || recomputed_[quad[1]] || recomputed_[quad[2]] || recomputed_[quad[5]])) continue;
      std::array<QuadCorner, 4> corners;
      const std::array<std::uint32_t, 4> cycle = corners_of_quad(quad, out_);
      for (std::size_t c = 0; c < 4; ++c) corners[c] = corner(cycle[c], levels_.cell_of(out_.cells[cycle[c]]));
      const std::array<std::uint32_t, 6> triangles = triangles_of(corners);
      std::copy(triangles.begin(), triangles.end(), quad);
    }
  }

  // Returns the vertex of a cell that touches a finer chunk, if its boundary is crossed.
  [[nodiscard]] std::optional<CellVertex> transition_vertex(const LevelCell& cell) const {
    if (is_of_one_sign(chunks_, cell)) return std::nullopt;
    Crossings crossings;
    const int step = 1 << levels_.around_cell(cell).finest;
    for (int axis = 0; axis < 3; ++axis) {
      for (int v = 0; v <= cell.size(); v += step) {
        const bool is_side = v == 0 || v == cell.size();
        for (int u = 0; u <= cell.size(); u += is_side ? step : cell.size()) add_line(cell, axis, u, v, crossings);
      }
    }
    if (crossings.weight == 0.0) return std::nullopt;
    const Vec3 fraction(crossings.sum / crossings.weight);
    const Vec3 gradient = trilinear_gradient(corners_of(chunks_, cell), fraction);
    const bool has_direction = glm::dot(gradient, gradient) >= kLeastSquaredGradient;
    return vertex_at(fraction, unit_normal(has_direction ? gradient : Vec3(crossings.slopes)));
  }

  // Adds the crossings of the shortest edges along a line on the cell's boundary, if there is such a line.
  void add_line(const LevelCell& cell, int axis, int u, int v, Crossings& crossings) const {
    IVec3 from = cell.first;
    from[(axis + 1) % 3] += u;
    from[(axis + 2) % 3] += v;
    const int length = 1 << levels_.around_line(from, axis).finest;
    if (((u | v) & (length - 1)) != 0) return;
    float a = density(from);
    for (int along = 0; along < cell.size(); along += length) {
      const IVec3 to = from + unit_axis(axis) * length;
      const float b = density(to);
      if ((a < 0.0F) != (b < 0.0F)) {
        DVec3 at(from - cell.first);
        at[axis] += length * (static_cast<double>(a) / (static_cast<double>(a) - static_cast<double>(b)));
        crossings.sum += at / static_cast<double>(cell.size()) * static_cast<double>(length);
        crossings.weight += length;
        crossings.slopes[axis] += (static_cast<double>(b) - static_cast<double>(a)) / length;
      }
      from = to;
      a = b;
    }
  }

  // Adds the polygons around edges that start in the chunk and are in one or two of its planes x = 0, y = 0, z = 0.
  void add_polygons_on_lower_faces(int axis) {
    const int u_axis = (axis + 1) % 3;
    const int v_axis = (axis + 2) % 3;
    for (int v = 0; v < kChunkEdge; ++v) {
      for (int u = 0; u < kChunkEdge; u += v == 0 ? 1 : kChunkEdge) {
        IVec3 from{0};
        from[u_axis] = u;
        from[v_axis] = v;
        const int length = 1 << levels_.around_line(from, axis).finest;
        if (((u | v) & (length - 1)) != 0) continue;
        bool solid = is_solid(from);
        for (; from[axis] < kChunkEdge; from[axis] += length) {
          const bool next_solid = is_solid(from + unit_axis(axis) * length);
          if (solid != next_solid) add_polygon(from, axis, solid);
          solid = next_solid;
        }
      }
    }
  }

  void add_polygon(IVec3 from, int axis, bool solid_first) {
    const std::array<IVec3, 4> samples = cells_around(from, axis);
    std::array<QuadCorner, 4> corners;
    std::size_t count = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const LevelCell cell = levels_.cell_at(samples[solid_first ? i : (4 - i) % 4]);
      const std::uint32_t vertex = vertex_of(cell);
      if (count > 0 && corners[count - 1].vertex == vertex) continue;
      corners[count++] = corner(vertex, cell);
    }
    if (corners[count - 1].vertex == corners[0].vertex) --count;
    QUOIN_ASSERT(count >= 3, "at least three cells around an edge");
    if (count == 3) {
      for (std::size_t i = 0; i < 3; ++i) triangles_.push_back(corners[i].vertex);
    } else {
      for (const std::uint32_t index : triangles_of(corners)) out_.indices.push_back(index);
    }
  }

  [[nodiscard]] QuadCorner corner(std::uint32_t vertex, const LevelCell& cell) const {
    return quad_corner(vertex, out_.positions[vertex], cell.first, cell.level);
  }

  // Returns the vertex of a cell that has one; creates it if needed.
  std::uint32_t vertex_of(const LevelCell& cell) {
    const SmoothCell name = cell.name();
    if (const auto found = kernel_vertex(name)) return *found;
    if (const auto found = appended_.find(name.bits); found != appended_.end()) return found->second;
    if (!levels_.touches_finer(cell)) return append(cell, cell_vertex(corners_of(chunks_, cell)));
    const std::optional<CellVertex> vertex = transition_vertex(cell);
    QUOIN_ASSERT(vertex.has_value(), "a cell with a crossed edge");
    return append(cell, *vertex);
  }

  std::uint32_t append(const LevelCell& cell, const CellVertex& vertex) {
    const SmoothCell name = cell.name();
    const std::uint32_t index = append_vertex(chunks_, options_.occlusion, cell, vertex, name, out_);
    appended_.emplace(name.bits, index);
    return index;
  }

  [[nodiscard]] std::optional<std::uint32_t> kernel_vertex(SmoothCell name) const {
    const SmoothCell* begin = out_.cells.data();
    const SmoothCell* end = begin + kernel_vertices_;
    const SmoothCell* found =
        std::lower_bound(begin, end, name, [](SmoothCell a, SmoothCell b) { return a.bits < b.bits; });
    if (found == end || !(*found == name)) return std::nullopt;
    return static_cast<std::uint32_t>(found - begin);
  }

  const DensityNeighbourhood& chunks_;
  const SmoothOptions& options_;
  ChunkLevels levels_;
  SmoothChunkMesh& out_;
  std::size_t kernel_vertices_ = 0;
  std::vector<bool> recomputed_;                               // by the kernel's vertex; empty: none
  std::unordered_map<std::uint32_t, std::uint32_t> appended_;  // by name
  std::vector<std::uint32_t> triangles_;
};

}  // namespace

void mesh_with_transitions(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                           const MeshOwnCells& mesh_own_cells, SmoothChunkMesh& out) {
  QUOIN_ASSERT(options.border == SmoothBorder::Shared, "options.border must be Shared");
  QUOIN_ASSERT(
      std::all_of(options.levels.begin(), options.levels.end(), [](int level) { return level <= kMaxSmoothLevel; }));
  Transitions(chunks, options, out).run(mesh_own_cells);
}

}  // namespace quoin::smooth

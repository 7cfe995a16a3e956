#include <algorithm>
#include <optional>
#include <unordered_map>
#include <vector>

#include <quoin/core/assert.h>

#include "mesh/nets/cell.h"
#include "mesh/nets/sheets.h"
#include "mesh/smooth/level_cells.h"

namespace quoin::smooth {
namespace {

class Splitter {
 public:
  Splitter(const DensityNeighbourhood& chunks, const SmoothOptions& options, SmoothChunkMesh& out)
      : chunks_(chunks), options_(options), levels_(options.levels), same_levels_(levels_.all_same()), out_(out) {}

  void run(std::size_t quad_indices) {
    const std::size_t vertices = out_.cells.size();
    const std::array<bool, 256>& has_one_sheet = cells_with_one_sheet();
    for (std::size_t i = 0; i < vertices; ++i) {
      const LevelCell cell = levels_.cell_of(out_.cells[i]);
      const std::uint32_t solid = parted_corners(cell);
      if (!has_one_sheet[solid]) split_vertex(static_cast<std::uint32_t>(i), cell, solid);
    }
    if (split_.empty() && bridges_.empty()) return;
    is_split_.assign(vertices, false);
    for (const auto& [vertex, split] : split_) is_split_[vertex] = true;
    for (const auto& [vertex, bridge] : bridges_) is_split_[vertex] = true;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < quad_indices; i += 6) {
      const std::uint32_t* quad = out_.indices.data() + i;
      const bool is_other = is_split_[quad[0]] || is_split_[quad[1]] || is_split_[quad[2]] || is_split_[quad[5]];
      if (is_other && rewire_quad(i)) continue;
      if (kept != i) std::copy_n(out_.indices.begin() + i, 6, out_.indices.begin() + kept);
      kept += 6;
    }
    if (kept == quad_indices) return;
    std::copy(out_.indices.begin() + quad_indices, out_.indices.end(), out_.indices.begin() + kept);
    out_.indices.resize(out_.indices.size() - (quad_indices - kept));
    for (const std::uint32_t index : polygons_) out_.indices.push_back(index);
  }

 private:
  struct Split {
    Sheets sheets;
    std::uint32_t second;  // the vertices of sheets 1, 2, ... are consecutive from here
  };

  // The two vertices between a cell and the next one along an axis, one for each air corner of their common face.
  struct Bridge {
    int axis;
    std::uint32_t first;  // vertex of the lesser corner; the other follows
  };

  void split_vertex(std::uint32_t vertex, const LevelCell& cell, std::uint32_t solid) {
    if (!same_levels_ && levels_.touches_another(cell)) return;
    const int joined = face_joined_in_both(solid, [&](int face) { return parted_beyond(cell, face); });
    // With `join_diagonals`, a bridge replaces the flip. The lower of the two cells makes it.
    if (options_.join_diagonals && joined != kNoFace && joined % 2 == 1) add_bridge(vertex, cell, joined);
    const Sheets& sheets = sheets_of(solid, options_.join_diagonals ? kNoFace : joined);
    if (sheets.count < 2) return;
    split_.emplace(vertex, Split{sheets, static_cast<std::uint32_t>(out_.positions.size())});
    const Corners corners = corners_of(chunks_, cell);
    for (int sheet = 0; sheet < sheets.count; ++sheet) {
      const SheetCrossings crossings =
          crossings_of_sheet(corners, sheets, sheet, [](float a, float b) { return a / (a - b); });
      const CellVertex placed = vertex_in(corners, crossings.sum / crossings.count);
      const SmoothCell name{out_.cells[vertex].bits | static_cast<std::uint32_t>(sheet) << SmoothCell::kSheetShift};
      if (sheet == 0) {
        write_vertex(chunks_, options_.occlusion, cell, placed, vertex, out_);
      } else {
        append_vertex(chunks_, options_.occlusion, cell, placed, name, out_);
      }
    }
  }

  void add_bridge(std::uint32_t vertex, const LevelCell& cell, int face) {
    const int axis = face / 2;
    bridges_.emplace(vertex, Bridge{axis, static_cast<std::uint32_t>(out_.positions.size())});
    const Corners corners = corners_of(chunks_, cell);
    const std::uint32_t air = parted_corners(cell);
    const std::array<int, 4> around = face_corners(face);
    std::uint32_t side = 0;
    for (const int corner : sorted(around)) {
      if (!is_solid_corner(air, corner)) continue;
      const auto at = static_cast<std::size_t>(std::find(around.begin(), around.end(), corner) - around.begin());
      const Vec3 fraction =
          (crossing(corners, corner, around[(at + 1) % 4]) + crossing(corners, corner, around[(at + 3) % 4])) * 0.5F;
      const SmoothCell name{out_.cells[vertex].bits | side << SmoothCell::kSheetShift |
                            static_cast<std::uint32_t>(axis + 1) << SmoothCell::kBridgeShift};
      append_vertex(chunks_, options_.occlusion, cell, vertex_in(corners, fraction), name, out_);
      ++side;
    }
    QUOIN_ASSERT(side == 2, "two air corners");
  }

  // Returns a vertex at a position in a cell, with the gradient there.
  static CellVertex vertex_in(const Corners& corners, Vec3 fraction) {
    return vertex_at(fraction, unit_normal(trilinear_gradient(corners, fraction)));
  }

  static std::array<int, 4> sorted(std::array<int, 4> corners) {
    std::sort(corners.begin(), corners.end());
    return corners;
  }

  // Returns the point where the surface crosses the edge between two corners.
  static Vec3 crossing(const Corners& corners, int a, int b) {
    const float from = corners[static_cast<std::size_t>(a)];
    const float to = corners[static_cast<std::size_t>(b)];
    const Vec3 first(corner_place(a));
    return first + (Vec3(corner_place(b)) - first) * (from / (from - to));
  }

  // Returns the vertex of a bridge on the side of a quad's edge from one cell to the next; empty if there is no bridge.
  [[nodiscard]] std::optional<std::uint32_t> bridge_between(std::uint32_t vertex, const LevelCell& cell,
                                                            std::uint32_t next, const LevelCell& next_cell, IVec3 start,
                                                            int axis) const {
    if (bridges_.empty()) return std::nullopt;
    const IVec3 step = next_cell.first - cell.first;
    const bool is_lower = step.x + step.y + step.z > 0;
    const auto found = bridges_.find(is_lower ? vertex : next);
    if (found == bridges_.end() || step[found->second.axis] == 0) return std::nullopt;
    const LevelCell& lower = is_lower ? cell : next_cell;
    const std::uint32_t air = parted_corners(lower);
    int corner = corner_at((start - lower.first) / lower.size());
    if (!is_solid_corner(air, corner)) corner += corner_at(unit_axis(axis));
    // The other air corner of the face is diagonally opposite.
    const int other = corner ^ 7 ^ corner_at(unit_axis(found->second.axis));
    return found->second.first + (corner < other ? 0U : 1U);
  }

  // Returns the corners of a cell that stay separate on faces with alternating corners.
  [[nodiscard]] std::uint32_t parted_corners(const LevelCell& cell) const {
    return solid_corners_of(chunks_, cell) ^ (options_.join_diagonals ? 255U : 0U);
  }

  // Returns these corners of the cell on the other side of a face, 0 if the mesh has no such cell.
  [[nodiscard]] std::uint32_t parted_beyond(LevelCell cell, int face) const {
    cell.first += step_across(face) * cell.size();
    if (options_.border == SmoothBorder::Open) {
      const int last = kChunkEdge - 2 * cell.size();
      const bool inside = std::min({cell.first.x, cell.first.y, cell.first.z}) >= 0 &&
                          std::max({cell.first.x, cell.first.y, cell.first.z}) <= last;
      if (!inside) return 0;
    }
    cell.chunk = chunk_of(cell.first);
    return parted_corners(cell);
  }

  // Returns false if the quad remains; otherwise adds its triangles to the polygons.
  bool rewire_quad(std::size_t first_index) {
    std::uint32_t* quad = out_.indices.data() + first_index;
    std::array<std::uint32_t, 4> cycle = corners_of_quad(quad, out_);
    std::array<LevelCell, 4> cells{};
    for (std::size_t i = 0; i < 4; ++i) cells[i] = levels_.cell_of(out_.cells[cycle[i]]);
    // The cells around an edge share its start (the first corner of the last cell) and their extent along it.
    const IVec3 start = cells[2].first;
    const IVec3 across = start - cells[0].first;
    const int axis = across.x == 0 ? 0 : across.y == 0 ? 1 : 2;
    std::array<QuadCorner, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t vertex = sheet_vertex(cycle[i], cells[i], start, axis);
      corners[i] = quad_corner(vertex, out_.positions[vertex], cells[i].first, cells[i].level);
    }
    std::array<std::uint32_t, 8> polygon{};
    std::size_t count = 0;
    std::size_t first_bridge = polygon.size();
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t next = (i + 1) % 4;
      polygon[count++] = corners[i].vertex;
      const auto bridge = bridge_between(cycle[i], cells[i], cycle[next], cells[next], start, axis);
      if (!bridge) continue;
      first_bridge = std::min(first_bridge, count);
      polygon[count++] = *bridge;
    }
    if (count > 4) {
      for (std::size_t i = 1; i + 1 < count; ++i) {
        polygons_.push_back(polygon[first_bridge]);
        polygons_.push_back(polygon[(first_bridge + i) % count]);
        polygons_.push_back(polygon[(first_bridge + i + 1) % count]);
      }
      return true;
    }
    const std::array<std::uint32_t, 6> triangles = triangles_of(corners);
    std::copy(triangles.begin(), triangles.end(), quad);
    return false;
  }

  // Returns the vertex of the sheet that an edge crosses, among the vertices that `vertex` was split into.
  [[nodiscard]] std::uint32_t sheet_vertex(std::uint32_t vertex, const LevelCell& cell, IVec3 start, int axis) const {
    const auto found = split_.find(vertex);
    if (found == split_.end()) return vertex;
    const Split& split = found->second;
    const std::uint8_t sheet = split.sheets.of_edge[edge_at(axis, (start - cell.first) / cell.size())];
    QUOIN_ASSERT(sheet != Sheets::kUncrossed, "an edge that the surface crosses");
    return sheet == 0 ? vertex : split.second + sheet - 1U;
  }

  const DensityNeighbourhood& chunks_;
  const SmoothOptions& options_;
  ChunkLevels levels_;
  bool same_levels_;
  SmoothChunkMesh& out_;
  std::unordered_map<std::uint32_t, Split> split_;     // by vertex
  std::unordered_map<std::uint32_t, Bridge> bridges_;  // by vertex of the lower cell
  std::vector<bool> is_split_;                         // by original vertex: split or with a bridge
  std::vector<std::uint32_t> polygons_;                // triangles that replace quads with more corners
};

}  // namespace

void split_sheets(const DensityNeighbourhood& chunks, const SmoothOptions& options, std::size_t quad_indices,
                  SmoothChunkMesh& out) {
  QUOIN_ASSERT(quad_indices % 6 == 0 && quad_indices <= out.indices.size(), "whole quads of the mesh");
  Splitter(chunks, options, out).run(quad_indices);
}

}  // namespace quoin::smooth

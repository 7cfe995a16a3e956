#include "mesh/smooth/sheets.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <unordered_map>
#include <vector>

#include <quoin/core/assert.h>

#include "mesh/smooth/level_cells.h"

namespace quoin::smooth {
namespace {

constexpr std::size_t kEdges = 12;

int corner_at(IVec3 place) {
  return place.x + 2 * place.y + 4 * place.z;
}

// Returns the start of an edge of a cell, in cells.
IVec3 edge_start(std::size_t edge) {
  QUOIN_ASSERT(edge < kEdges, "one of twelve edges");
  const int axis = static_cast<int>(edge / 4);
  IVec3 start{0};
  start[(axis + 1) % 3] = static_cast<int>(edge & 1U);
  start[(axis + 2) % 3] = static_cast<int>(edge >> 1U & 1U);
  return start;
}

// Returns the edge between two adjacent corners.
std::size_t edge_between(int a, int b) {
  QUOIN_ASSERT(std::has_single_bit(static_cast<unsigned>(a ^ b)), "adjacent corners");
  const IVec3 first = corner_place(a & b);
  const IVec3 step = corner_place(a ^ b);
  const int axis = step.x != 0 ? 0 : step.y != 0 ? 1 : 2;
  return static_cast<std::size_t>(4 * axis + first[(axis + 1) % 3] + 2 * first[(axis + 2) % 3]);
}

// Returns the corners of a face, in order around it.
std::array<int, 4> face_corners(int face) {
  QUOIN_ASSERT(face >= 0 && face < kNoFace, "one of six faces");
  const int axis = face / 2;
  const IVec3 base = unit_axis(axis) * (face % 2);
  const IVec3 u = unit_axis((axis + 1) % 3);
  const IVec3 v = unit_axis((axis + 2) % 3);
  return {corner_at(base), corner_at(base + u), corner_at(base + u + v), corner_at(base + v)};
}

// The edges on both sides of each corner of a face. A sheet that cuts off the corner contains both.
struct FaceEdges {
  std::array<std::size_t, 4> before{};
  std::array<std::size_t, 4> after{};
};

FaceEdges edges_of_face(const std::array<int, 4>& corners) {
  FaceEdges edges;
  for (std::size_t i = 0; i < 4; ++i) {
    edges.after[i] = edge_between(corners[i], corners[(i + 1) % 4]);
    edges.before[(i + 1) % 4] = edges.after[i];
  }
  return edges;
}

bool is_solid_corner(std::uint32_t solid, int corner) {
  return (solid >> corner & 1U) != 0;
}

// Returns true if a face has four crossings: opposite corners are equal, adjacent corners differ.
bool has_four_crossings(std::uint32_t solid, const std::array<int, 4>& corners) {
  return is_solid_corner(solid, corners[0]) == is_solid_corner(solid, corners[2]) &&
         is_solid_corner(solid, corners[1]) == is_solid_corner(solid, corners[3]) &&
         is_solid_corner(solid, corners[0]) != is_solid_corner(solid, corners[1]);
}

using SheetOfEdge = std::array<std::uint8_t, kEdges>;

void join(SheetOfEdge& sheets, std::size_t a, std::size_t b) {
  const std::uint8_t from = std::max(sheets[a], sheets[b]);
  const std::uint8_t to = std::min(sheets[a], sheets[b]);
  std::replace(sheets.begin(), sheets.end(), from, to);
}

void join_on_face(std::uint32_t solid, int face, bool flipped, SheetOfEdge& sheets) {
  const std::array<int, 4> corners = face_corners(face);
  const FaceEdges edges = edges_of_face(corners);
  if (has_four_crossings(solid, corners)) {
    for (std::size_t i = 0; i < 4; ++i) {
      if (is_solid_corner(solid, corners[i]) != flipped) join(sheets, edges.before[i], edges.after[i]);
    }
    return;
  }
  std::size_t last = kEdges;
  for (const std::size_t edge : edges.after) {
    if (sheets[edge] == Sheets::kUncrossed) continue;
    if (last != kEdges) join(sheets, last, edge);
    last = edge;
  }
}

Sheets find_sheets(std::uint32_t solid, int flipped_face) {
  Sheets sheets;
  for (std::size_t edge = 0; edge < kEdges; ++edge) {
    const int first = corner_at(edge_start(edge));
    const int second = first + corner_at(unit_axis(static_cast<int>(edge / 4)));
    const bool crossed = is_solid_corner(solid, first) != is_solid_corner(solid, second);
    sheets.of_edge[edge] = crossed ? static_cast<std::uint8_t>(edge) : Sheets::kUncrossed;
  }
  for (int face = 0; face < 6; ++face) join_on_face(solid, face, face == flipped_face, sheets.of_edge);
  // Sheets have the numbers of their first edges; now they are renumbered 0, 1, ...
  for (std::size_t edge = 0; edge < kEdges; ++edge) {
    if (sheets.of_edge[edge] != edge) continue;
    std::replace(sheets.of_edge.begin() + static_cast<std::ptrdiff_t>(edge), sheets.of_edge.end(),
                 static_cast<std::uint8_t>(edge), static_cast<std::uint8_t>(sheets.count));
    ++sheets.count;
  }
  return sheets;
}

int find_joined_face(std::uint32_t solid) {
  const Sheets sheets = find_sheets(solid, kNoFace);
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> corners = face_corners(face);
    if (!has_four_crossings(solid, corners)) continue;
    const FaceEdges edges = edges_of_face(corners);
    if (sheets.of_edge[edges.before[0]] == sheets.of_edge[edges.before[2]] &&
        sheets.of_edge[edges.after[0]] == sheets.of_edge[edges.after[2]] &&
        sheets.of_edge[edges.before[0]] == sheets.of_edge[edges.after[0]]) {
      return face;
    }
  }
  return kNoFace;
}

struct SheetTables {
  std::array<std::array<Sheets, kNoFace + 1>, 256> sheets;  // by solid corners, then flipped face
  std::array<std::uint8_t, 256> joined_face;
  std::array<bool, 256> is_plain;  // by solid corners: at most one sheet, independent of the neighbouring cells
  SheetTables() {
    for (std::uint32_t solid = 0; solid < 256; ++solid) {
      joined_face[solid] = static_cast<std::uint8_t>(find_joined_face(solid));
      for (int face = 0; face <= kNoFace; ++face) {
        sheets[solid][static_cast<std::size_t>(face)] = find_sheets(solid, face);
      }
      is_plain[solid] = joined_face[solid] == kNoFace && sheets[solid][kNoFace].count < 2;
    }
  }
};

const SheetTables& tables() {
  static const SheetTables built;
  return built;
}

// Returns the mean of the crossings of one sheet.
Vec3 mean_of_crossings(const Corners& corners, const Sheets& sheets, int sheet) {
  Vec3 sum{0.0F};
  float count = 0.0F;
  for (std::size_t edge = 0; edge < kEdges; ++edge) {
    if (sheets.of_edge[edge] != sheet) continue;
    const int axis = static_cast<int>(edge / 4);
    const IVec3 start = edge_start(edge);
    const float a = corners[static_cast<std::size_t>(corner_at(start))];
    const float b = corners[static_cast<std::size_t>(corner_at(start + unit_axis(axis)))];
    Vec3 at(start);
    at[axis] = a / (a - b);
    sum += at;
    count += 1.0F;
  }
  QUOIN_ASSERT(count > 0.0F, "a sheet of the cell");
  return sum / count;
}

class Splitter {
 public:
  Splitter(const DensityNeighbourhood& chunks, const SmoothOptions& options, SmoothChunkMesh& out)
      : chunks_(chunks), options_(options), levels_(options.levels), same_levels_(levels_.all_same()), out_(out) {}

  void run(std::size_t quad_indices) {
    const std::size_t vertices = out_.cells.size();
    const std::array<bool, 256>& is_plain = tables().is_plain;
    for (std::size_t i = 0; i < vertices; ++i) {
      const LevelCell cell = levels_.cell_of(out_.cells[i]);
      const std::uint32_t solid = parted_corners(cell);
      if (!is_plain[solid]) split_vertex(static_cast<std::uint32_t>(i), cell, solid);
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
    const int joined = tables().joined_face[solid];
    if (!same_levels_ && levels_.touches_another(cell)) return;
    const bool joins = joined != kNoFace && joins_as_well(cell, joined);
    // With `join_diagonals`, a bridge replaces the flip. The lower of the two cells makes it.
    const bool flipped = joins && !options_.join_diagonals;
    if (joins && !flipped && joined % 2 == 1) add_bridge(vertex, cell, joined);
    const Sheets& sheets = tables().sheets[solid][static_cast<std::size_t>(flipped ? joined : kNoFace)];
    if (sheets.count < 2) return;
    split_.emplace(vertex, Split{sheets, static_cast<std::uint32_t>(out_.positions.size())});
    const Corners corners = corners_of(chunks_, cell);
    for (int sheet = 0; sheet < sheets.count; ++sheet) {
      const Vec3 fraction = mean_of_crossings(corners, sheets, sheet);
      const CellVertex placed = vertex_at(fraction, trilinear_gradient(corners, fraction));
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
      append_vertex(chunks_, options_.occlusion, cell, vertex_at(fraction, trilinear_gradient(corners, fraction)), name,
                    out_);
      ++side;
    }
    QUOIN_ASSERT(side == 2, "two air corners");
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

  // Returns true if the cell on the other side of a face also has all four crossings of that face in one sheet.
  [[nodiscard]] bool joins_as_well(const LevelCell& cell, int face) const {
    const IVec3 step = unit_axis(face / 2) * (face % 2 == 1 ? cell.size() : -cell.size());
    LevelCell other = cell;
    other.first += step;
    if (options_.border == SmoothBorder::Open) {
      const int last = kChunkEdge - 2 * cell.size();
      const bool inside = std::min({other.first.x, other.first.y, other.first.z}) >= 0 &&
                          std::max({other.first.x, other.first.y, other.first.z}) <= last;
      if (!inside) return false;
    }
    other.chunk = chunk_of(other.first);
    return tables().joined_face[parted_corners(other)] == (face ^ 1);
  }

  // Returns the corners of a cell that stay separate on faces with alternating corners.
  [[nodiscard]] std::uint32_t parted_corners(const LevelCell& cell) const {
    return solid_corners_of(chunks_, cell) ^ (options_.join_diagonals ? 255U : 0U);
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
    const IVec3 place = (start - cell.first) / cell.size();
    const auto edge = static_cast<std::size_t>(4 * axis + place[(axis + 1) % 3] + 2 * place[(axis + 2) % 3]);
    const std::uint8_t sheet = split.sheets.of_edge[edge];
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

Sheets sheets_of(std::uint32_t solid, int flipped_face) {
  QUOIN_ASSERT(solid < 256 && flipped_face >= 0 && flipped_face <= kNoFace, "eight corners, and a face or none");
  return tables().sheets[solid][static_cast<std::size_t>(flipped_face)];
}

int joined_face(std::uint32_t solid) {
  QUOIN_ASSERT(solid < 256, "eight corners");
  return tables().joined_face[solid];
}

void split_sheets(const DensityNeighbourhood& chunks, const SmoothOptions& options, std::size_t quad_indices,
                  SmoothChunkMesh& out) {
  QUOIN_ASSERT(quad_indices % 6 == 0 && quad_indices <= out.indices.size(), "whole quads of the mesh");
  Splitter(chunks, options, out).run(quad_indices);
}

}  // namespace quoin::smooth

#include "mesh/nets/sheets.h"

#include <algorithm>
#include <bit>

namespace quoin::smooth {
namespace {

// Returns the edge between two adjacent corners.
std::size_t edge_between(int a, int b) {
  QUOIN_ASSERT(std::has_single_bit(static_cast<unsigned>(a ^ b)), "adjacent corners");
  return edge_at(std::countr_zero(static_cast<unsigned>(a ^ b)), corner_place(a & b));
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
    const bool crossed = (solid >> edge_start(edge) & 1U) != (solid >> edge_end(edge) & 1U);
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
  std::array<bool, 256> has_one_sheet;
  SheetTables() {
    for (std::uint32_t solid = 0; solid < 256; ++solid) {
      joined_face[solid] = static_cast<std::uint8_t>(find_joined_face(solid));
      for (int face = 0; face <= kNoFace; ++face) {
        sheets[solid][static_cast<std::size_t>(face)] = find_sheets(solid, face);
      }
      has_one_sheet[solid] = joined_face[solid] == kNoFace && sheets[solid][kNoFace].count < 2;
    }
  }
};

const SheetTables& tables() {
  static const SheetTables built;
  return built;
}

}  // namespace

std::array<int, 4> face_corners(int face) {
  QUOIN_ASSERT(face >= 0 && face < kNoFace, "one of six faces");
  const int axis = face / 2;
  const IVec3 base = unit_axis(axis) * (face % 2);
  const IVec3 u = unit_axis((axis + 1) % 3);
  const IVec3 v = unit_axis((axis + 2) % 3);
  return {corner_at(base), corner_at(base + u), corner_at(base + u + v), corner_at(base + v)};
}

const Sheets& sheets_of(std::uint32_t solid, int flipped_face) {
  QUOIN_ASSERT(solid < 256 && flipped_face >= 0 && flipped_face <= kNoFace, "eight corners, and a face or none");
  return tables().sheets[solid][static_cast<std::size_t>(flipped_face)];
}

int joined_face(std::uint32_t solid) {
  QUOIN_ASSERT(solid < 256, "eight corners");
  return tables().joined_face[solid];
}

const std::array<bool, 256>& cells_with_one_sheet() {
  return tables().has_one_sheet;
}

}  // namespace quoin::smooth

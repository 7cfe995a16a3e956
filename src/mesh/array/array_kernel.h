#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>

#include "core/instruction_set.h"
#include "grid/density/density_storage.h"
#include "mesh/array/array_lattice.h"

// Functions that are compiled for each instruction set. Every kernel gives the same bits.

namespace quoin::array {

// The interfaces between labels: a slot for each pair of labels that meet, with a number, which is first a count of
// triangles and then a write position.
//
// Labels are stored as keys: their bits, changed so that the order as unsigned numbers is the order of the labels.
class InterfaceTable {
 public:
  struct Slot {
    std::uint64_t back = 0;
    std::uint64_t front = 0;  // equal to `back`: empty
    std::uint64_t number = 0;
  };

  // Returns the slot of a pair; new slots have number 0. The reference is valid until the next call.
  [[gnu::always_inline]] Slot& slot(std::uint64_t back, std::uint64_t front) {
    for (std::size_t i = place(back, front);; i = (i + 1) & mask_) {
      Slot& slot = slots_[i];
      if (slot.back == back && slot.front == front) return slot;
      if (slot.back == slot.front) return insert(back, front);
    }
  }
  // Returns all used slots, in unspecified order.
  [[nodiscard]] std::vector<Slot> used() const;

  InterfaceTable();

 private:
  [[nodiscard, gnu::always_inline]] std::size_t place(std::uint64_t back, std::uint64_t front) const {
    const std::uint64_t mixed = (back * 0x9E37'79B9'7F4A'7C15U + front) * 0xD6E8'FEB8'6659'FD93U;
    return static_cast<std::size_t>(mixed >> 32) & mask_;
  }
  Slot& insert(std::uint64_t back, std::uint64_t front);

  std::vector<Slot> storage_;
  Slot* slots_ = nullptr;  // data of storage_
  std::size_t mask_ = 0;
  std::size_t count_ = 0;
};

inline constexpr std::size_t kScalarTypes = 10;

// The crossing of an edge whose first sample equals iso, as a fraction of the edge: the sample counts as
// kDensityAtSurface if the other end's density is -1.
inline constexpr float kLeastFraction = kDensityAtSurface / (kDensityAtSurface + 1.0F);

// The number of cells per batch.
inline constexpr std::size_t kBatch = 128;

// Densities of cells' corners: [x + 2 y + 4 z][cell]; solid below 0, never -0. They may be infinite; NaN
// is air.
struct CornerBatch {
  alignas(64) float densities[8][kBatch];
};

// The same cells and their vertices: the position in the cell, in multiples of 1/65,536, and the unit gradient in
// space.
struct VertexBatch {
  alignas(64) std::int32_t cells[3][kBatch];  // by walked axis
  alignas(64) float fractions[3][kBatch];
  alignas(64) float normals[3][kBatch];
};

// The crossed edges of a slice of samples that get quads. Along rows: bit c is between samples c - 1 and c. Between
// rows: row r is between rows r - 1 and r.
struct EdgePlanes {
  const std::uint64_t* along_rows;    // [row][word]
  const std::uint64_t* between_rows;  // [row, one more][word]
};

// A slice of cells: the crossed edges around it.
struct CellSlice {
  std::size_t rows;  // of samples; cells have one more
  std::size_t words;
  const std::uint64_t* no_edges;        // a row without any
  EdgePlanes low;                       // of the slice of samples before
  EdgePlanes high;                      // of the slice of samples after
  const std::uint64_t* between_slices;  // [row][word], bit x: of sample x
};

// The cells that have a vertex, and the first vertex of each of their rows; slices are consecutive.
struct RankedRows {
  const std::uint64_t* active;
  const std::uint32_t* first;
};

// Common data of all quads of a mesh.
struct QuadRules {
  const Vec3* positions;
  bool is_mirrored;
  // `split` has one bit per vertex, set for cells with several sheets; null if there are none. `vertex_on_edge` returns
  // the vertex of such a cell on an edge, given 4 * axis + du + 2 dv of the edge's start in the cell.
  const std::uint64_t* split = nullptr;
  const void* split_cells = nullptr;
  std::uint32_t (*vertex_on_edge)(const void* split_cells, std::uint32_t vertex, unsigned edge) = nullptr;
};

// A label array in the form that kernels read.
struct LabelRows {
  const std::byte* data;
  std::ptrdiff_t stride[3];
  std::int64_t size[3];
  std::uint64_t background;  // its key
  std::uint64_t sign;        // XORed with a label's bits to get its key
};

// One relaxation step of a slice of cells.
struct RelaxStep {
  std::size_t rows;  // number of rows of samples
  std::size_t words;
  bool is_first_slice;
  bool is_last_slice;
  const std::uint8_t* links;  // of all vertices, in the order of their fractions
  const Vec3* from;
  Vec3* to;
};

// Differences of densities beyond this would overflow.
inline constexpr float kFarthest = 0x1p100F;
// Shorter gradients have no direction.
inline constexpr float kLeastGradient = std::numeric_limits<float>::min();

struct Kernel {
  /// Finds the solid ones of `count` adjacent values, by type and side (above, below), compared with a limit of that
  /// type. Writes whole words; bits from `count` on are 0.
  void (*solid_row[kScalarTypes][2])(const std::byte* row, std::size_t count, const std::byte* limit,
                                     std::uint64_t* out);
  /// Finds the values, of `count` adjacent values of 1, 2, 4 or 8 bytes, that differ from another row, or from `value`
  /// if `other` is null. Writes whole words.
  void (*differing[4])(const std::byte* row, const std::byte* other, std::uint64_t value, std::size_t count,
                       std::uint64_t* out);
  /// Finds the edges between two rows of samples, and between neighbours in a row: bit c is between c - 1 and c.
  void (*differences)(const std::uint64_t* a, const std::uint64_t* b, std::size_t words, std::uint64_t* out);
  void (*differences_along)(const std::uint64_t* a, std::size_t words, std::uint64_t* out);
  /// Finds the cells of a slice that touch an edge. `count` gets the number in each row.
  void (*find_active)(const CellSlice& slice, std::uint64_t* active, std::uint32_t* count);
  std::uint64_t (*count_bits)(const std::uint64_t* words, std::size_t count);
  /// Computes the vertices of the first `count` cells of a batch, and writes their positions and normals.
  void (*vertices)(const CornerBatch& corners, std::size_t count, const Placement& placement, VertexBatch& batch,
                   Vec3* positions, Vec3* normals);
  /// Computes the positions of vertices from their cells and fractions.
  void (*place)(const VertexBatch& batch, std::size_t count, const Placement& placement, Vec3* positions);
  /// Writes the triangles around the edges that start in the slice of samples before a slice of cells. Returns the
  /// end of the written triangles. `solid` contains the signs of these samples, null beyond the array; `ranked` begins
  /// at this slice.
  std::uint32_t* (*quads)(const CellSlice& slice, const std::uint64_t* solid, const RankedRows& ranked,
                          const QuadRules& rules, std::uint32_t* out);
  /// As above for labels, by their sizes in bytes: counts quads in the interfaces' slots, ...
  void (*count_interfaces[4])(const CellSlice& slice, const LabelRows& labels, std::int64_t z, InterfaceTable& table);
  /// ... and writes them to the positions in the interfaces' slots.
  void (*label_quads[4])(const CellSlice& slice, const LabelRows& labels, std::int64_t z, const RankedRows& ranked,
                         const QuadRules& rules, InterfaceTable& table, std::uint32_t* out);
  /// Computes the vertices of a slice of cells: the mean of the midpoints of crossed edges, as fractions of their
  /// cells. `links` gets one bit per neighbour that the vertex is linked with: -x, x, -y, y, -z, z.
  void (*label_vertices)(const CellSlice& slice, const RankedRows& ranked, Vec3* fractions, std::uint8_t* links);
  /// Moves the vertices of a slice of cells towards the mean of their linked neighbours, within their cells.
  void (*relax)(const RelaxStep& step, const RankedRows& ranked);
};

// Kernels for wider instructions are defined only where they are compiled. The tables list the available ones.
extern const Kernel kPlainKernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
extern const KernelTable<Kernel> kKernels;

/// Returns the kernel with the widest instructions that this machine supports.
[[nodiscard]] inline const Kernel& kernel() {
  return kKernels.widest();
}

}  // namespace quoin::array

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/buffer.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/mesh/array_surface.h>

#include "core/work/progress_steps.h"
#include "mesh/array/density.h"
#include "mesh/array/lattice.h"

namespace quoin::array {

// The signs of an array's samples, and the edges that get quads.
class Signs {
 public:
  Signs(const Lattice& lattice, const ArraySurfaceOptions& options);

  [[nodiscard]] const SolidRule& rule() const { return rule_; }
  [[nodiscard]] bool is_open() const { return is_open_; }

  Status find(Threads threads, ProgressSteps& steps);

  // Returns a slice of signs; null beyond the array.
  [[nodiscard]] const std::uint64_t* slice(std::size_t z) const {
    return z < lattice_.slices() ? bits_.data() + z * lattice_.slice_words() : nullptr;
  }
  // Returns the solid corners of a cell, by x + 2 y + 4 z.
  [[nodiscard]] std::uint32_t solid_corners(IVec3 cell) const;

  // The functions of a source for EdgeWindow.
  void within(std::size_t z, std::uint64_t* along_rows, std::uint64_t* between_rows) const;
  void between(std::size_t slice_of_cells, std::uint64_t* out) const;

 private:
  void find_row(std::size_t y, std::size_t z, const std::byte* limit, std::vector<std::byte>& packed);
  void keep_inner(std::uint64_t* rows, std::size_t count, const std::vector<std::uint64_t>& mask) const;

  const Lattice& lattice_;
  SolidRule rule_;
  bool is_open_;
  std::vector<std::uint64_t> along_mask_;  // for an open border
  std::vector<std::uint64_t> sample_mask_;
  Buffer<std::uint64_t> bits_;  // [slice][row][word]
};

}  // namespace quoin::array

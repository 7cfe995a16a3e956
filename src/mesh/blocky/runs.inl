// Faces and runs of a batch of planes.
//
//   faces        . X X X X . X X      a row: visible faces
//   merged       . X X . . . X .      the next cell has the same type and occlusion
//   starts       . X . . X . X .      first cells of runs
//   ends         . . . X X . . X      last cells of runs
//   closes       . . . . X . . X      ends of runs that do not continue in the next row, by the carry of one addition

#pragma once

#include <cstdint>
#include <type_traits>

#include <quoin/core/assert.h>

#include "mesh/blocky/blocky_mesher.h"
#include "mesh/blocky/layer_words.inl"

namespace quoin::blocky {
namespace {

struct Pass {
  const View* view;
  const std::uint64_t* row_masks;  // by row: the cells of the region
  Range planes;
  Range rows;
  int side;       // +1 or -1: side that the faces point to
  bool row_ends;  // some voxel before or after a row may be opaque
  bool one_type;  // all faces have one type: the layers of equal types are not filled
};

// Finds the visible faces of a batch of planes, and lists the groups of kLanes rows that have any.
template <bool kTransparent>
QUOIN_STAGE int find_faces(const Pass& pass, int first_plane, int plane_count, Batch& b) {
  QUOIN_ASSERT(first_plane >= 0 && first_plane + plane_count <= 64, "planes of the chunk");
  QUOIN_ASSERT(plane_count > 0 && plane_count <= kBatchPlanes, "planes of one batch");
  int groups = 0;
  for (int i = 0; i < plane_count; ++i) {
    const int plane = first_plane + i;
    const std::uint64_t* here = pass.view->opaque.words + word_index(plane, 0);
    const std::uint64_t* front = here + pass.side * kRowStride;
    const std::uint64_t* given = pass.view->faces[pass.side < 0].words + word_index(plane, 0);
    for (int row = pass.rows.begin; row < pass.rows.end; row += kLanes) {
      const Words mask = load(pass.row_masks + row);
      const Words faces = kTransparent ? load(given + row) & mask : and_not(load(here + row), load(front + row), mask);
      const int at = i * kRowStride + row;
      store(b.faces + at, faces);
      b.groups[groups] = static_cast<std::uint16_t>(at);
      groups += static_cast<int>(any(faces));
    }
    b.faces[i * kRowStride + pass.rows.end] = 0;
  }
  return groups;
}

struct CornerOcclusion {
  Words low;
  Words high;
};

QUOIN_INLINE CornerOcclusion corner_occlusion(Words side1, Words side2, Words corner) {
  return {occlusion_low(side1, side2, corner), occlusion_high(side1, side2, corner)};
}

// Returns the faces where `a` has the same occlusion as `b`, and `c` the same as `d`.
QUOIN_INLINE Words agree(const CornerOcclusion& a, const CornerOcclusion& b, const CornerOcclusion& c,
                         const CornerOcclusion& d) {
  return ~or_difference(or_difference(or_difference(a.low ^ b.low, a.high, b.high), c.low, d.low), c.high, d.high);
}

// Makes each face a run: no merging.
QUOIN_STAGE void keep_apart(int groups, Batch& b) {
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const Words faces = load(b.faces + at);
    store(b.starts + at, faces);
    store(b.ends + at, faces);
    store(b.closes + at, faces);
  }
}

// Finds the faces of a group with constant occlusion along the bits, and along the rows.
template <bool kRowEnds>
QUOIN_INLINE void constant_occlusion(const Pass& pass, int front, Words& along_bits, Words& along_rows) {
  const auto row_at = [&](int offset, Words& before, Words& middle, Words& after) {
    middle = load(pass.view->opaque.words + front + offset);
    before = middle << 1;
    after = middle >> 1;
    if constexpr (kRowEnds) {
      const Words ends = load(pass.view->ends.words + front + offset);
      before |= ends >> 63;
      after |= ends << 63;
    }
  };
  Words a_before, a, a_after, b_before, unused, b_after, c_before, c, c_after;
  row_at(-1, a_before, a, a_after);
  row_at(0, b_before, unused, b_after);
  row_at(1, c_before, c, c_after);
  const CornerOcclusion l00 = corner_occlusion(b_before, a, a_before);
  const CornerOcclusion l10 = corner_occlusion(b_after, a, a_after);
  const CornerOcclusion l01 = corner_occlusion(b_before, c, c_before);
  const CornerOcclusion l11 = corner_occlusion(b_after, c, c_after);
  along_bits = agree(l00, l10, l01, l11);
  along_rows = agree(l00, l01, l10, l11);
}

// Splits the faces of each listed group into runs of equal type and constant occlusion.
template <bool kOcclusion, bool kRowEnds, bool kTypes>
QUOIN_STAGE void find_runs(const Pass& pass, int first_plane, int groups, Batch& b) {
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const int here = word_index(first_plane, 0) + at;
    const Words faces = load(b.faces + at);
    Words joined = faces;
    Words mergeable = faces;
    if constexpr (kOcclusion) {
      Words along_bits;
      Words along_rows;
      constant_occlusion<kRowEnds>(pass, here + pass.side * kRowStride, along_bits, along_rows);
      joined &= along_bits;
      mergeable &= along_rows;
    }
    store(b.mergeable + at, mergeable);
    Words merged = joined & (joined >> 1);
    if constexpr (kTypes) merged &= load(pass.view->same_bit.words + here);
    store(b.starts + at, faces & ~(merged << 1));
    store(b.ends + at, faces & ~merged);
  }
}

// Finds the runs that continue in the next row: the row has a run of the same extent and type, and the occlusion is
// constant along the rows.
template <bool kTypes>
QUOIN_STAGE void find_growth(const Pass& pass, int first_plane, int groups, Batch& b) {
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const Words starts = load(b.starts + at);
    const Words ends = load(b.ends + at);
    // The next row may belong to a group that is not listed. Only its empty face words are valid then.
    Words agreed = load(b.mergeable + at) & load(b.mergeable + at + 1) & load(b.faces + at + 1);
    if constexpr (kTypes) agreed &= load(pass.view->same_row.words + word_index(first_plane, 0) + at);
    agreed = and_same(and_same(agreed, starts, load(b.starts + at + 1)), ends, load(b.ends + at + 1));
    // The sum carries from a run's first cell to its last only if all cells between agree.
    store(b.closes + at, ends & ~(((agreed & ~ends) + starts) & agreed));
  }
}

template <bool kOcclusion, bool kTypes>
void merge(const Pass& pass, int first_plane, int groups, Batch& b) {
  const auto find = [&](auto row_ends) {
    find_runs<kOcclusion, kOcclusion && row_ends, kTypes>(pass, first_plane, groups, b);
  };
  pass.row_ends ? find(std::true_type{}) : find(std::false_type{});
  find_growth<kTypes>(pass, first_plane, groups, b);
}

// The bit layout of a quad for one direction.
template <int kDirection>
struct Layout {
  static constexpr FaceFrame kFrame = kFaceFrames[kDirection];
  static constexpr int kAxis = kFrame.axis;
  static constexpr int kRowAxis = kAxis == 1 ? 2 : 1;
  static constexpr int kBitAxis = kAxis == 0 ? 2 : 0;
  static constexpr bool kUAlongBits = kFrame.u == kBitAxis;
  static constexpr int kWidthShift = kUAlongBits ? Quad::kSizeUShift : Quad::kSizeVShift;
  static constexpr int kHeightShift = kUAlongBits ? Quad::kSizeVShift : Quad::kSizeUShift;
};

// Quads get their types in one of two ways: all have one type, or each reads its voxel's packed row.
inline constexpr int kOneType = -1;

struct TypeSource {
  std::uint64_t one;  // in a quad's place; 0 when there are several
  int log_bits;       // log2 of the bits per voxel of the packed rows, or kOneType
  int planes;         // number of palette index planes; 0 if there are none
};

}  // namespace
}  // namespace quoin::blocky

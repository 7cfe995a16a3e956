#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/packet.h>

namespace quoin::trace {

/// A chunk as walks of single rays read it.
struct FlatChunk {
  std::uint64_t bricks = 0;  ///< those that are not empty, x + 4 y + 16 z
  const OccupancyTree::ChunkNode* node = nullptr;
};

/// What the kernels read of a tree with flat tables.
struct TreeView {
  // `origin`, `box` and the strides of chunks, as registers read them.
  alignas(32) double corner[4];
  alignas(16) float low[4];
  alignas(16) float high[4];
  alignas(16) std::int32_t low_voxel[4];
  alignas(16) std::int32_t high_voxel[4];
  alignas(16) std::int32_t chunk_strides[4];
  // As everything else reads it.
  const std::uint32_t* cells;        ///< bits
  const std::uint32_t* bricks;       ///< indices
  const std::uint32_t* words;        ///< of bricks: 128 halves each, the lower half of a cell's word first
  const OccupancyTree::Node* nodes;  ///< the bricks again
  const FlatChunk* chunks;           ///< x first, then y, then z
  DVec3 origin;                      ///< of the tables, in the grid
  std::uint32_t last_cell_word;
  int first_cell;  ///< bit of the table's cell (0, 0, 0)
  IVec3 cell_strides;
  IVec3 brick_strides;
  IVec3 brick_sizes;
  IBox box;       ///< tight, from `origin`
  bool is_small;  ///< no ray from nearby reaches further within the box than kernels go
};

/// What a kernel leaves of the lanes it was asked about.
struct LaneHits {
  std::uint32_t hit = 0;
  std::uint32_t starts_inside = 0;
  std::uint32_t unfinished = 0;                  ///< went further than a kernel goes: to be traced in double precision
  RayPacket::Lanes<std::int32_t> x{}, y{}, z{};  ///< voxels, from the tables' origin
  RayPacket::Lanes<std::int32_t> axis{};         ///< of the face
};

// Every kernel gives the same answers, those of a walk from one lattice plane to the next where the plane P of an axis
// is crossed at t = (P - origin) * (1 / direction), in single precision and rounded after each operation, in the order
// of t and at ties of axes; origin is relative to a multiple of 64 voxels next to the ray's start.
struct Kernel {
  /// One ray; `face` is not set where it starts inside.
  bool (*first_hit)(const TreeView& tree, const Ray& ray, double max_t, RayHit& hit, bool& unfinished);
  /// Whether one ray is blocked.
  bool (*any_hit)(const TreeView& tree, const Ray& ray, double max_t, bool& unfinished);
  /// Fills in what `PacketHits` says; lanes of `unfinished` are to be traced otherwise.
  void (*first_hits)(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished);
  /// Answers the lanes that are blocked.
  std::uint32_t (*any_hits)(const TreeView& tree, const RayPacket& rays, std::uint32_t& unfinished);
};

extern const Kernel kPlainKernel;
#ifdef QUOIN_X86_KERNELS
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
#endif

#ifdef QUOIN_X86_KERNELS
/// By instruction set, the widest that this machine has and that is no wider than asked.
using Kernels = std::array<const Kernel*, 4>;
[[nodiscard]] Kernels kernels_here();

[[nodiscard]] inline const Kernel& kernel_of(InstructionSet instructions) {
  static const Kernels kernels = kernels_here();
  return *kernels[static_cast<std::size_t>(instructions)];
}
#else
[[nodiscard]] inline const Kernel& kernel_of(InstructionSet) {
  return kPlainKernel;
}
#endif
[[nodiscard]] TreeView make_view(const OccupancyTree::FlatTables& tables, const FlatChunk* chunks,
                                 const OccupancyTree::Node* bricks, const IBox& bounds);

}  // namespace quoin::trace

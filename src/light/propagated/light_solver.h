#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/function_ref.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin::propagated {

inline constexpr std::size_t kChannels = 4;  // sky, red, green, blue
inline constexpr std::size_t kPlanes = 4;    // bits of a level

/// Of a row of 64 voxels: bit x of [channel][i] is bit i of the level at x.
using RowPlanes = std::array<std::array<std::uint64_t, kPlanes>, kChannels>;

/// What a type does to light.
struct TypeLight {
  std::uint16_t lamp = 0;    ///< packed levels that it gives off
  std::uint8_t passes = 15;  ///< bit c: channel c

  bool operator==(const TypeLight&) const = default;
};

/// Light of a row that is the same at all its voxels.
[[nodiscard]] RowPlanes uniform_planes(std::uint16_t word);
/// Requires: 0 <= y, z < 64. Null reads as dark.
[[nodiscard]] RowPlanes read_planes(const Chunk* light, int y, int z);
void write_planes(const RowPlanes& planes, std::span<std::uint16_t, kChunkEdge> out);

/// The light around a chunk, one voxel beyond each side.
struct LightBorder {
  /// [direction]: null where it is `beyond` everywhere.
  std::array<const Chunk*, 6> chunk{};
  std::array<std::uint16_t, 6> beyond{};
};

/// What a solution changed.
struct LightChange {
  IBox box;  ///< the smallest around what changed, in the chunk's coordinates; empty: nothing
  struct Row {
    std::uint8_t y, z;
    std::uint64_t changed;
    std::array<std::uint16_t, kChunkEdge> now;
  };
  std::vector<Row> rows;
};

/// Light in a box of a chunk, given that around it. Reused from chunk to chunk: it only grows.
///
/// Levels are spread as sets of 64 voxels, from 15 down:
///
///   lit[L] = source[L] | lit[L + 1] | (lit[L + 1] moved by one along each axis, where light passes)
///
/// Sources are what lamps give off and, outside of the box, the light that is there. In one pass over the 15 levels
/// every voxel has its own, since none is lit by a lower one. Sky of level 15 goes down first.
class LightSolver {
 public:
  /// `voxels`: null where all is air. `light`: what there was; null where that was dark.
  [[nodiscard]] LightChange solve(const Chunk* voxels, const std::vector<TypeLight>& types, const Chunk* light,
                                  const LightBorder& border, const IBox& box);

 private:
  static constexpr std::size_t kStride = kChunkEdge + 2;
  static constexpr std::size_t kRows = kStride * kStride;
  [[nodiscard]] static std::size_t at(int y, int z) {
    return static_cast<std::size_t>(z + 1) * kStride + static_cast<std::size_t>(y + 1);
  }
  void read_voxels(const Chunk* voxels, const std::vector<TypeLight>& types);
  void read_light(const Chunk* light, const LightBorder& border);
  void read_sides(const LightBorder& border);
  void add_lamps(const Chunk& voxels, const std::vector<TypeLight>& types);
  template <class Visit>
  void for_each_row(Visit&& visit) const;
  /// Rows of a chunk and around it: a rectangle of y and z.
  struct RowRange {
    int low_y = kChunkEdge, low_z = kChunkEdge, high_y = -1, high_z = -1;  // with both ends

    [[nodiscard]] bool empty() const { return high_y < low_y; }
    void add(int y, int z);
    void add(const RowRange& other);
    void grow();
    [[nodiscard]] RowRange within(const IBox& box) const;
    template <class Visit>
    void for_each(Visit&& visit) const {
      for (int z = low_z; z <= high_z; ++z) {
        for (int y = low_y; y <= high_y; ++y) visit(y, z);
      }
    }
  };
  [[nodiscard]] unsigned highest_source(std::size_t channel, std::size_t i) const;
  [[nodiscard]] std::array<RowRange, 16> source_rows(std::size_t channel) const;
  void spread(std::size_t channel);
  void let_sky_fall();
  void add_level(std::size_t channel, unsigned level);
  [[nodiscard]] LightChange differences() const;

  IBox box_;
  std::uint64_t inside_ = 0;                                // of a row
  std::array<std::vector<std::uint64_t>, kChannels> pass_;  // [at]: where light passes, in the box
  std::vector<RowPlanes> source_;                           // [at]
  std::vector<RowPlanes> before_;                           // [at], of the rows of the box
  std::vector<RowPlanes> now_;                              // likewise
  std::vector<std::array<std::uint16_t, 2>> sides_;         // [at]: light at x = -1 and 64
  std::vector<std::uint64_t> lit_;                          // [at]
  std::vector<std::uint64_t> next_;
};

}  // namespace quoin::propagated

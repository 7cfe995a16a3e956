#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

#include "light/propagated/light_store.h"
#include "light/propagated/spread.h"

namespace quoin::propagated {

/// What a type does to light.
struct TypeLight {
  std::uint16_t lamp = 0;    ///< packed levels that it gives off
  std::uint8_t passes = 15;  ///< bit c: channel c

  bool operator==(const TypeLight&) const = default;
};

/// The light around a chunk, one voxel beyond each side.
struct LightBorder {
  /// [direction]: null where it is `beyond` everywhere.
  std::array<const ChunkLight*, 6> chunk{};
  std::array<std::uint16_t, 6> beyond{};
};

/// Light in a box of a chunk, given that around it. Reused from chunk to chunk: it only grows.
///
/// Levels are spread as sets of 64 voxels, from 15 down:
///
///   front[L] = (front[L + 1] moved by one along each axis, or sources[L]), where no higher level has been
///
/// Sources are what lamps give off, and what the light around the box becomes one step within it. In one pass over the
/// 15 levels every voxel has its own, since none is lit by a lower one. Sky of level 15 goes down first.
class LightSolver {
 public:
  LightSolver();
  /// Replaces the light of the box. `voxels`: null where all is air.
  [[nodiscard]] ChangedRows solve(const Chunk* voxels, const std::vector<TypeLight>& types, const LightBorder& border,
                                  const IBox& box, ChunkLight& light);

 private:
  /// Voxels of a row that get a level, if no higher one.
  struct Source {
    std::uint32_t row;
    std::uint32_t block;  // z * 8 + y / 8
    std::uint64_t voxels;
  };
  struct Front {
    Plane plane;  // empty but for the blocks of `lit`
    BlockSet lit{};
  };
  struct Scratch {
    std::array<Plane, kChannels> pass;  // where light passes, in the box
    std::array<Plane, kPlanes> level;
    Plane open;
    std::array<Front, 2> fronts;
    BlockSet blocks{};
    BlockSet touched{};  // of `level`, which is empty elsewhere
  };
  /// Of a channel: what lies beside the box, in the chunk or beyond it.
  struct Side {
    const ChannelLight* light;  // null: `level` everywhere
    unsigned level;
    [[nodiscard]] unsigned uniform() const;
    [[nodiscard]] std::array<std::uint64_t, kPlanes> row(int y, int z) const;
  };

  template <class Visit>
  void for_each_row(Visit&& visit) const;
  template <class Visit>
  void for_each_block(Visit&& visit) const;
  void read_voxels(const Chunk* voxels, const std::vector<TypeLight>& types);
  void read_lamps(const Chunk& voxels, const std::vector<TypeLight>& types, ChunkLight& light);
  void begin_channel(std::size_t channel);
  [[nodiscard]] Side side(Direction direction, std::size_t channel, const LightBorder& border,
                          const ChunkLight& light) const;
  void let_sky_fall(const Side& above);
  void add_rows(Direction direction, const Side& beside);
  void add_row(const std::array<std::uint64_t, kPlanes>& planes, int y, int z);
  void add_end(Direction direction, const Side& beside);
  void add_lamps(std::size_t channel);
  void add(unsigned level, int y, int z, std::uint64_t voxels);
  void spread(std::size_t channel);
  bool spread_to(std::size_t channel, unsigned level, Front& from, Front& to);
  void set(unsigned level, std::size_t row, std::uint64_t voxels);
  void replace(ChannelLight& light, ChangedRows& changed);
  void clear(Plane& plane, std::size_t z, unsigned blocks) const;

  const SpreadKernel* kernel_ = nullptr;
  IBox box_;
  std::uint64_t inside_ = 0;  // of a row
  std::unique_ptr<Scratch> scratch_;
  std::array<std::size_t, kChannels> pass_of_{};  // the plane that a channel has
  std::array<std::vector<Source>, 16> sources_;   // [level], of a channel
  struct Lamp {
    std::uint16_t light;
    int y, z;
    std::uint64_t voxels;
  };
  std::vector<Lamp> lamps_;
};

}  // namespace quoin::propagated

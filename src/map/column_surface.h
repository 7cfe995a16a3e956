#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/chunk_source.h>

#include "core/caches.h"
#include "map/type_looks.h"

namespace quoin::map {

/// One column of voxels, seen from above. Colours are square roots of linear light, as bytes.
struct SeenColumn {
  std::array<std::uint8_t, 3> floor{};  ///< light of the highest voxel that hides those below, as far as it is seen
  std::array<std::uint8_t, 3> cover{};  ///< light of the voxels above it: water, glass, plants
  std::uint8_t alpha = 0;               ///< 0: nothing
  bool glows = false;                   ///< the floor emits light
  std::int32_t y = 0;                   ///< height of the surface: of a fluid, else of the floor
  std::int32_t floor_y = 0;
};

/// The columns of one part's square, by z, then x.
struct ColumnSurface {
  static constexpr int kEdge = 64;
  std::array<SeenColumn, std::size_t{kEdge} * kEdge> columns{};
  [[nodiscard]] const SeenColumn& at(int x, int z) const { return columns[static_cast<std::size_t>(z * kEdge + x)]; }
};

/// Accumulates the voxels of columns from the top down.
class SurfaceBuilder {
 public:
  /// `ceiling`: the columns are cut at this height, and solid voxels there are skipped down to the first air.
  SurfaceBuilder(TypeLooks& looks, std::optional<int> ceiling);

  /// Adds a voxel, the next one of its column. Returns false if nothing below it can be seen.
  /// `x`, `z`: the position in the square, 0 to 63.
  bool add(int x, int z, int y, VoxelType type);
  /// Returns the surface, and starts over. Null if there is nothing.
  [[nodiscard]] std::shared_ptr<const ColumnSurface> take();

 private:
  struct Column {
    Vec3 floor{0.0F};
    Vec3 cover{0.0F};
    Vec3 fluid{1.0F};   // the share of light that passes the fluid so far
    float open = 1.0F;  // the share of the square that is still open
    std::int32_t y = 0;
    std::int32_t floor_y = 0;
    std::int32_t last_y = 0;  // of the voxel before
    std::uint16_t voxels = 0;
    bool has_surface = false;
    bool is_closed = false;
    bool is_below_roof = false;  // of the ceiling
    bool was_fluid = false;
    bool glows = false;
  };
  TypeLooks* looks_;
  std::optional<int> ceiling_;
  std::vector<Column> columns_;
  bool is_empty_ = true;
};

/// A square of 64 x 64 columns of a source, with its parts from the top down.
struct Square {
  int x = 0;  ///< in chunks
  int z = 0;
  std::vector<std::size_t> parts;
  bool operator<(const Square& other) const { return z != other.z ? z < other.z : x < other.x; }
};
/// Returns the squares of a source, by z, then x.
[[nodiscard]] std::vector<Square> squares_of(const ChunkSource& source);

/// The surfaces of squares that were read lately. Threads: any number at once; each square is read once at a time.
class SurfaceCache {
 public:
  struct Counts {
    std::uint64_t chunks = 0;     ///< chunks of the format that were read
    std::vector<Error> broken{};  ///< without repetitions
  };

  /// Lifetime: the source must outlive it.
  SurfaceCache(const ChunkSource& source, std::optional<int> ceiling);

  /// Returns the surface of a square; null if it does not exist or is empty. Errors: those of the source.
  [[nodiscard]] Result<std::shared_ptr<const ColumnSurface>> read(int x, int z);
  [[nodiscard]] const std::vector<Square>& squares() const { return squares_; }
  /// Returns the number of a square; nullopt if the source has none there.
  [[nodiscard]] std::optional<std::size_t> find(int x, int z) const;
  [[nodiscard]] Counts counts() const;
  /// Returns the signs of a square that was read.
  [[nodiscard]] std::vector<SourceSign> signs_of(std::size_t square) const;

 private:
  struct Entry {
    std::mutex mutex;  // held while the square is read
    bool is_read = false;
    std::shared_ptr<const ColumnSurface> surface;
  };
  struct KnownSquare {
    std::shared_ptr<Entry> entry;  // kept by its readers when it is dropped
    std::uint64_t last_use = 0;
  };
  struct Scratch {
    std::optional<TypeLooks> looks;
    std::optional<SurfaceBuilder> builder;
  };
  [[nodiscard]] Result<std::shared_ptr<const ColumnSurface>> read_square(std::size_t square);
  [[nodiscard]] Result<std::shared_ptr<const ColumnSurface>> read_square(std::size_t number, SurfaceBuilder& builder);

  const ChunkSource* source_;
  std::optional<int> ceiling_;
  std::vector<Square> squares_;
  ObjectPool<Scratch> scratch_;
  mutable std::mutex mutex_;
  std::unordered_map<std::size_t, KnownSquare> entries_;
  std::map<std::size_t, std::vector<SourceSign>> signs_;
  std::map<std::string, Error> broken_;
  std::uint64_t chunks_ = 0;
  std::uint64_t uses_ = 0;
};

}  // namespace quoin::map

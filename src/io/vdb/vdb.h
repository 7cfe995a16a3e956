#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/loaded_scene.h>

// OpenVDB trees of the usual shape: below the root, nodes of 32^3 entries, nodes of 16^3 entries, and leaves of 8^3
// voxels. z is the fastest axis in all of them.

namespace quoin::vdb {

inline constexpr int kLeafEdge = 8;
inline constexpr int kLowerEdge = 16 * kLeafEdge;
inline constexpr int kUpperEdge = 32 * kLowerEdge;
inline constexpr std::size_t kLeafVoxels = 512;

/// Returns the index of a leaf's voxel among its values and in its masks.
[[nodiscard]] constexpr std::size_t place_in_leaf(int x, int y, int z) {
  QUOIN_ASSERT(((x | y | z) & ~(kLeafEdge - 1)) == 0, "0 <= x, y, z < 8");
  return static_cast<std::size_t>(x << 6 | y << 3 | z);
}

/// The meaning of a grid's values.
enum class Meaning : std::uint8_t {
  LevelSet,  ///< signed distances in world units, negative inside
  Fog,       ///< densities: larger values are denser
  Mask,      ///< voxels: the active ones are set
};

using LeafMask = std::array<std::uint64_t, kLeafVoxels / 64>;

struct Leaf {
  IVec3 origin{0};
  LeafMask active{};
};

/// A cube with a single value.
struct Tile {
  IVec3 origin{0};
  std::int32_t edge = kLeafEdge;
  float value = 0.0F;
  bool is_active = false;
};

struct Grid {
  std::string name;
  Meaning meaning = Meaning::Fog;
  float background = 0.0F;
  std::vector<Leaf> leaves;
  std::vector<float> values;  ///< 512 per leaf, in order; empty for masks, where `active` has the voxels
  std::vector<Tile> tiles;    ///< tiles that are active, or differ from the background
  glm::dmat4 world_from_index{1.0};
  std::size_t same_as = SIZE_MAX;  ///< index of the grid whose tree it shares; its own tree is then empty
};

struct File {
  std::vector<Grid> grids;
  std::vector<std::string> warnings;  ///< for skipped grids
};

/// " BDV" and zeros.
[[nodiscard]] bool is_vdb(std::span<const std::byte> beginning);
/// Reads a file, versions 222 (OpenVDB 1.1) to 225: grids of float, double and bool, and masks; uncompressed, zip and
/// Blosc.
///
/// Source: openvdb/io and openvdb/tree of OpenVDB 10.
/// Errors: BadFormat with the offset; LimitExceeded; Unsupported.
/// Memory: 2 KiB per leaf, which takes at least 128 bytes in the file; 24 bytes per non-background tile.
[[nodiscard]] Result<File> read_vdb_file(std::span<const std::byte> bytes);

/// "NanoVDB0".
[[nodiscard]] bool is_nvdb(std::span<const std::byte> beginning);
/// As above, for NanoVDB files, version 32. Errors: as read_vdb_file.
[[nodiscard]] Result<File> read_nvdb_file(std::span<const std::byte> bytes);

/// Reads .vdb and .nvdb: one grid per VDB grid, see docs/formats/vdb.md. `LoadOptions::iso`: the value above which fog
/// is solid.
///
/// Errors: BadFormat with the offset; LimitExceeded beyond 2^27 fog values, or 2^20 chunks filled by tiles; Unsupported
/// if no grid can be read; Cancelled.
[[nodiscard]] Result<LoadedScene> read_vdb(std::span<const std::byte> bytes, const LoadOptions& options,
                                           Threads threads, const Progress& progress);

/// Writes a scene as .vdb, version 224, zip: for each instance its densities as a level set, and its voxels as a bool
/// grid. Instances of one grid share its tree. Instances with an invalid transform are left out. Equal scenes give
/// equal bytes.
[[nodiscard]] Result<std::vector<std::byte>> write_vdb(const Scene& scene);
/// Returns the parts of a scene that a VDB file cannot store, one line each.
[[nodiscard]] std::vector<std::string> vdb_unsupported_features(const Scene& scene);

/// Expands a Blosc frame (version 1) into all of `out`: stored, LZ4 or zlib, with or without byte shuffle.
///
/// Errors: BadFormat with the offset in the frame, also if its size differs from `out`; Unsupported for other
/// compressors, and for LZ4 in builds without it.
[[nodiscard]] Status expand_blosc(std::span<const std::byte> frame, std::span<std::byte> out);

}  // namespace quoin::vdb

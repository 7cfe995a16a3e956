#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/chunk_source.h>

struct ZSTD_DCtx_s;

namespace quoin::models {

/// The attribute of node types with a guessed look, as for Minecraft blocks.
inline constexpr const char* kNodeGuessAttribute = "luanti.look";

/// Returns the type of a Luanti node by its name ("default:stone"): from a table for the names of Luanti's own game,
/// otherwise by the words of the name. Returns nullopt for "air" and for "ignore" (not generated).
/// Its attribute kNodeStatesAttribute lists the fields of `node_state`.
[[nodiscard]] std::optional<VoxelProperties> node_properties(std::string_view name);

/// The attribute of a node's type that lists the fields of its state bits.
inline constexpr const char* kNodeStatesAttribute = "luanti.states";

/// Returns the state of a node: its param2. The level of a flowing liquid (the lowest 3 bits, 7 is the highest) becomes
/// its drop below the source, as in ShapeNeighbours::Fluid.
[[nodiscard]] std::uint32_t node_state(std::string_view name, std::uint8_t param2);

}  // namespace quoin::models

namespace quoin {

/// Returns true if bytes begin like a Luanti map: with SQLite's header, and the table of blocks.
[[nodiscard]] bool is_luanti_map(std::span<const std::byte> beginning);

/// Opens a Luanti world: its folder, or the database in it (map.sqlite).
/// Errors: CannotRead; BadFormat; Unsupported if world.mt names another storage, and in builds without SQLite.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_luanti(const std::filesystem::path& path);
/// Opens the bytes of a database, which are copied.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_luanti(std::span<const std::byte> database);

}  // namespace quoin

namespace quoin::luanti {

inline constexpr int kBlockEdge = 16;
inline constexpr std::size_t kBlockNodes = 4096;

/// A block of a map, 16^3 nodes, x fastest, then y, then z, in Luanti's axes.
struct MapBlock {
  std::vector<std::string> names;                  ///< of the nodes in the block
  std::array<std::uint16_t, kBlockNodes> nodes{};  ///< indices into `names`
  std::array<std::uint8_t, kBlockNodes>
      param2{};  ///< rotation, liquid level or colour, as defined by the node's definition
};

/// Reads blocks in the database's form. Ignores node metadata, objects, timers, and light (param1).
///
/// Source: Luanti's doc/world_format.md.
class MapBlockReader {
 public:
  MapBlockReader();

  /// Decodes a row's bytes into `block` and reuses its memory.
  ///
  /// Versions: 25 to 29.
  /// Errors:   BadFormat with the offset in the row, or in the decompressed row of version 29, as the message says;
  ///           Unsupported for other versions. The block is then invalid.
  /// Memory:   4 MiB of decompressed bytes.
  [[nodiscard]] Status read(std::span<const std::byte> row, MapBlock& block);

 private:
  [[nodiscard]] Status expand(std::span<const std::byte> frame);

  struct Free {
    void operator()(ZSTD_DCtx_s* context) const;
  };
  std::unique_ptr<ZSTD_DCtx_s, Free> context_;
  std::vector<std::byte> content_;
  std::vector<std::uint32_t> name_of_;  // index into the block's names, by number in its table
};

}  // namespace quoin::luanti

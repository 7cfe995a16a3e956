#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/result.h>

struct ZSTD_DCtx_s;

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

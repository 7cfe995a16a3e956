#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/loaded_scene.h>

// Formats of voxel models, and of maps that consist of one model. docs/formats/models.md lists the supported content of
// each.
//
// Recognition is by content: `is_...` take the beginning of a file (64 KiB suffice), or the whole file for formats
// without a header.
// Errors of readers: BadFormat with the byte offset; LimitExceeded; Unsupported.

namespace quoin::models {

/// https://www.patrickmin.com/binvox/binvox.html. The voxels have no colours: they are grey.
[[nodiscard]] bool is_binvox(std::span<const std::byte> beginning);
[[nodiscard]] Result<LoadedScene> read_binvox(std::span<const std::byte> bytes);

/// Cube World models: three sizes, and three bytes per voxel; black is empty.
[[nodiscard]] bool is_cub(std::span<const std::byte> whole);
[[nodiscard]] Result<LoadedScene> read_cub(std::span<const std::byte> bytes);

/// Ken Silverman's formats: KV6 and KVX models, SLAB6 .vox, and .vxl maps of Ace of Spades (without a header, 64 or 240
/// high) and of Voxlap.
[[nodiscard]] bool is_kv6(std::span<const std::byte> beginning);
[[nodiscard]] Result<LoadedScene> read_kv6(std::span<const std::byte> bytes);
[[nodiscard]] bool is_kvx(std::span<const std::byte> whole);
[[nodiscard]] Result<LoadedScene> read_kvx(std::span<const std::byte> bytes);
[[nodiscard]] bool is_slab6(std::span<const std::byte> whole);
[[nodiscard]] Result<LoadedScene> read_slab6(std::span<const std::byte> bytes);
/// The colour of .vxl ground that no surface shows; the file has none for it.
inline constexpr Rgba8 kEarth{101, 77, 51, 255};
inline constexpr std::uint32_t kVoxlapMagic = 0x09072000;
[[nodiscard]] bool is_vxl(std::span<const std::byte> whole);
[[nodiscard]] Result<LoadedScene> read_vxl(std::span<const std::byte> bytes);

/// Qubicle's .qb, .qbt, .qbcl and .qef.
[[nodiscard]] bool is_qubicle(std::span<const std::byte> beginning);
[[nodiscard]] Result<LoadedScene> read_qubicle(std::span<const std::byte> bytes);

/// Goxel's .gox, versions 1 and 2.
[[nodiscard]] bool is_goxel(std::span<const std::byte> beginning);
[[nodiscard]] Result<LoadedScene> read_goxel(std::span<const std::byte> bytes);

/// Luanti's schematics (.mts), versions 1 to 4.
[[nodiscard]] bool is_mts(std::span<const std::byte> beginning);
[[nodiscard]] Result<LoadedScene> read_mts(std::span<const std::byte> bytes);

}  // namespace quoin::models

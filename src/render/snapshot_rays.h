#pragma once

#include <quoin/render/impostor.h>
#include <quoin/trace/packet.h>

namespace quoin {

/// Texels of a snapshot, `right` and `bottom` exclusive.
struct TexelArea {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;
};

/// Whole blocks within which a box shows in a snapshot of `edge` texels a side.
[[nodiscard]] TexelArea texels_of(const SnapshotCamera& camera, const IBox& box, int edge);

/// The rays of a snapshot's 4x4 texels from (`column`, `row`); lane x + 4 y. Texels beyond the snapshot are not active.
[[nodiscard]] RayPacket rays_of_texels(const SnapshotCamera& camera, int edge, int column, int row);

inline constexpr int kTexelBlock = 4;

}  // namespace quoin

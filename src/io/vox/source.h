#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/io/vox.h>

#include "io/vox/chunks.h"
#include "io/vox/read.h"

namespace quoin {

/// A .vox file as it was read, beside the scene that it became. Neither changes: a scene that did is compared with it.
///
///   file                          scene, by the slots of its handles
///   document.models[i]            grid i
///   document.layers[i]            layer layer_of[i]; kNone: not in the scene
///   placements.all[i]             instance i
///   placements.groups[i]          group i
///   colour index i                type type_of[i]
struct VoxSource {
  std::vector<std::byte> bytes;
  vox::Document document;  // views of `bytes`
  vox::Placements placements;
  std::vector<std::size_t> layer_of;
  std::array<std::uint8_t, vox::kColours> type_of{};
  int frame = 0;
  Scene scene;
};

}  // namespace quoin

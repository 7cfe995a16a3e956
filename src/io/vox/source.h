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

/// The handle of what has a slot of the scene as it was read, there and in what became of it; of nothing where there
/// was none.
template <class T>
[[nodiscard]] Handle<T> handle_read(const SlotMap<T>& read, std::size_t slot) {
  return read.handle_at(static_cast<std::uint32_t>(slot)).value_or(Handle<T>{});
}

}  // namespace quoin

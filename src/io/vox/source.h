#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/io/vox.h>

#include "io/vox/chunks.h"
#include "io/vox/read.h"

namespace quoin {

/// A .vox file as read, together with the scene made from it. Neither changes: an edited scene is compared with it.
///
///  file                          scene, by the slots of its handles
///  document.models[i]            grid i
///  document.layers[i]            layer layer_of[i]; kNone: not in the scene
///  placements.all[i]             instance i
///  placements.groups[i]          group i
///  colour index i                type type_of[i]
struct VoxSource {
  std::vector<std::byte> bytes;
  vox::Document document;  // views of `bytes`
  vox::Placements placements;
  std::vector<std::size_t> layer_of;
  std::array<std::uint8_t, vox::kColours> type_of{};
  int frame = 0;
  Scene scene;
};

/// Returns the handle of a slot in the scene as read, which is also valid in its edited copies; a null handle if the
/// slot is empty.
template <class T>
[[nodiscard]] Handle<T> handle_read(const SlotMap<T>& read, std::size_t slot) {
  return read.handle_at(static_cast<std::uint32_t>(slot)).value_or(Handle<T>{});
}

}  // namespace quoin

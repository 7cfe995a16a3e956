#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <quoin/core/assert.h>

#include "core/bytes/byte_stream.h"
#include "core/bytes/bytes.h"
#include "io/vox/chunks.h"

namespace quoin::vox {
namespace {

Error wrong_count(const Model& model, const std::string& held) {
  const std::int64_t wanted = std::int64_t{model.size.x} * model.size.y * model.size.z;
  return bad_at(model.offset, "chunk TDCZ holds " + held + " voxels, but its size needs " + std::to_string(wanted));
}

// The data must end after the last voxel. Unterminated streams are accepted.
Status check_end(ByteStream& stream, const Model& model) {
  std::array<std::byte, 1> more{};
  const auto count = stream.read(more);
  if (!count) return stream.is_cut_off() ? Status() : Status(count.error());
  if (*count > 0) return wrong_count(model, "more");
  return {};
}

}  // namespace

Result<std::vector<std::byte>> unpack_voxels(std::span<const std::byte> file, const Model& model) {
  QUOIN_ASSERT(model.packed_begin <= model.packed_end && model.packed_end <= file.size(),
               "a compressed model of the file");
  ByteStream stream(file.first(model.packed_end), model.packed_begin, Compression::Zlib);
  std::vector<std::byte> layer(static_cast<std::size_t>(model.size.x) * static_cast<std::size_t>(model.size.y));
  std::vector<std::byte> voxels;
  for (int z = 0; z < model.size.z; ++z) {
    const auto count = stream.read(layer);
    if (!count) return count.error();
    if (*count < layer.size()) {
      return wrong_count(model, std::to_string(static_cast<std::size_t>(z) * layer.size() + *count));
    }
    auto colour = layer.begin();
    for (int y = 0; y < model.size.y; ++y) {
      for (int x = 0; x < model.size.x; ++x, ++colour) {
        if (*colour == std::byte{0}) continue;
        for (const int coordinate : {x, y, z}) voxels.push_back(static_cast<std::byte>(coordinate));
        voxels.push_back(*colour);
      }
    }
  }
  if (auto sound = check_end(stream, model); !sound) return sound.error();
  return voxels;
}

}  // namespace quoin::vox

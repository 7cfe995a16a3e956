#include <cstdint>
#include <cstdlib>
#include <span>

#include <glm/geometric.hpp>
#include <quoin/io/scene_file.h>

#include "core/bytes/text.h"
#include "io/byte_stream.h"
#include "io/scene_file/voxel_data.h"

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

/// Any bytes must give an error or a scene with valid numbers that can be written again.
void read_as_text(std::span<const std::byte> bytes) {
  const auto scene = quoin::parse_scene_file(bytes);
  if (!scene) return;
  for (const auto& placement : scene->placements) {
    const double length = glm::length(placement.instance.rotation);
    require(placement.grid ? *placement.grid < scene->grids.size() : length > 0.999 && length < 1.001);
    require(quoin::is_finite(placement.instance.position) && placement.instance.voxel_size > 0.0);
  }
  require(!scene->environment || check(*scene->environment));
  const auto again = quoin::write_scene_file(*scene, quoin::Threads{1});
  require(again.has_value() && quoin::parse_scene_file(*again).has_value());
}

/// Decodes bytes as the content of voxel pieces, without base64 and the checksum that random input never passes.
void read_as_voxels(std::span<const std::byte> bytes) {
  constexpr std::size_t kTypes = 300;
  const auto chunks = quoin::decode_voxels(quoin::to_base64(quoin::gzipped(bytes, 0)), kTypes);
  if (!chunks) return;
  for (const quoin::PlacedChunk& chunk : *chunks) {
    for (const quoin::VoxelType type : chunk.voxels.types()) require(type < kTypes);
  }
}

/// Decodes bytes as the content of data pieces, for a grid with air at every second voxel.
void read_as_data(std::span<const std::byte> bytes) {
  const auto piece = quoin::decode_data(quoin::to_base64(quoin::gzipped(bytes, 0)));
  if (!piece) return;
  quoin::Grid grid;
  quoin::for_each_data(*piece, [&](quoin::IVec3 voxel, const quoin::VoxelData& data) {
    require(!data.empty() && data.bytes.size() <= quoin::kMaxVoxelDataBytes);
    if ((voxel.x & 1) == 0) grid.set(voxel, 1);
    require(grid.set_data(voxel, data) == (grid.get(voxel) != quoin::kAir) || grid.data(voxel) == data);
    return grid.chunk_count() < 100;
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  read_as_text(bytes);
  read_as_voxels(bytes);
  read_as_data(bytes);
  return 0;
}

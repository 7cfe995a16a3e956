#include "store/chunk/chunk_body.h"
#include <cstring>
#include <zstd.h>
namespace quoin::store {
void ChunkEncoder::encode(const ChunkPlace&, std::uint64_t, const Chunk& voxels, const DensityChunk* d,
                          std::vector<std::byte>& out) {
  std::vector<std::byte> raw(kChunkVoxels * 2 + (d ? kChunkVoxels * 4 : 0));
  auto* t = reinterpret_cast<VoxelType*>(raw.data());
  for (int z = 0; z < 64; ++z)
    for (int y = 0; y < 64; ++y) {
      voxels.read_row(y, z, std::span<VoxelType, 64>(t + (z * 64 + y) * 64, 64));
      if (d) {
        d->read_row(y, z, std::span<Half, 64>(t + kChunkVoxels + (z * 64 + y) * 64, 64));
        d->materials().read_row(y, z, std::span<VoxelType, 64>(t + 2 * kChunkVoxels + (z * 64 + y) * 64, 64));
      }
    }
  out.resize(ZSTD_compressBound(raw.size()));
  out.resize(ZSTD_compress(out.data(), out.size(), raw.data(), raw.size(), 1));
}
Result<StoredChunk> ChunkDecoder::decode(const ChunkPlace&, std::span<const std::byte> body, const ChunkLimits& l) {
  std::vector<VoxelType> t(kChunkVoxels * 3);
  size_t n = ZSTD_decompress(t.data(), t.size() * 2, body.data(), body.size());
  if (ZSTD_isError(n)) return make_error(ErrorCode::BadFormat, "bad zstd");
  StoredChunk s;
  s.voxels = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(t.data(), kChunkVoxels));
  if (n > kChunkVoxels * 2) {
    DensityChunk d(stored_density(l.band, l.band));
    for (int z = 0; z < 64; ++z)
      for (int y = 0; y < 64; ++y) {
        d.write_row(y, z, std::span<const Half, 64>(t.data() + kChunkVoxels + (z * 64 + y) * 64, 64));
        d.materials().write_row(y, z,
                                std::span<const VoxelType, 64>(t.data() + 2 * kChunkVoxels + (z * 64 + y) * 64, 64));
      }
    d.compact();
    s.densities = d;
  }
  return s;
}
}  // namespace quoin::store

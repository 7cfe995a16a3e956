#include "io/minecraft/region/linear_region.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "io/minecraft/region/region_file.h"

#ifdef QUOIN_HAVE_ZSTD
#include <zstd.h>
#endif

namespace quoin::minecraft {

namespace {

constexpr std::uint64_t kMagic = 0xC3FF13183CCA9D9A;
constexpr std::size_t kVersionAt = 8;
constexpr std::size_t kStreamBytesAt = 20;
constexpr std::size_t kTableBytes = LinearRegion::kChunks * 8;
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;

template <class T>
T big(std::span<const std::byte> bytes, std::size_t at) {
  QUOIN_ASSERT(at + sizeof(T) <= bytes.size(), "bytes of a number");
  return load<T>(bytes.data() + at, std::endian::big);
}

Error bad(std::string message, std::size_t at) {
  return make_error(ErrorCode::BadFormat, "Linear region: " + std::move(message), {}, at);
}

#ifdef QUOIN_HAVE_ZSTD

/// Expands the first `wanted` bytes of a zstd stream. Memory grows with the output.
Result<std::vector<std::byte>> expand_zstd(std::span<const std::byte> stream, std::size_t wanted) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  if (!context) return make_error(ErrorCode::LimitExceeded, "not enough memory");
  std::vector<std::byte> out;
  ZSTD_inBuffer input{stream.data(), stream.size(), 0};
  while (out.size() < wanted) {
    constexpr std::size_t kStep = std::size_t{1} << 17;
    const std::size_t filled = out.size();
    out.resize(filled + std::min(wanted - filled, std::max(kStep, filled)));
    ZSTD_outBuffer output{out.data() + filled, out.size() - filled, 0};
    for (bool has_moved = true; has_moved && output.pos < output.size;) {
      const std::size_t before = input.pos + output.pos;
      const std::size_t state = ZSTD_decompressStream(context.get(), &output, &input);
      const std::size_t at = LinearRegion::kDataOffset + input.pos;
      if (ZSTD_isError(state) != 0) return bad(std::string("damaged zstd data: ") + ZSTD_getErrorName(state), at);
      has_moved = input.pos + output.pos != before;
    }
    out.resize(filled + output.pos);
    if (output.pos < output.size) {
      return bad(
          "the data expands to " + std::to_string(out.size()) + " bytes, not the promised " + std::to_string(wanted),
          LinearRegion::kDataOffset + input.pos);
    }
  }
  return out;
}

#else

Result<std::vector<std::byte>> expand_zstd(std::span<const std::byte>, std::size_t) {
  return make_error(ErrorCode::Unsupported,
                    "cannot read Linear regions (.linear): Quoin was built without zstd (Debian: libzstd-dev)");
}

#endif

}  // namespace

bool LinearRegion::begins(std::span<const std::byte> beginning) {
  return beginning.size() >= sizeof(kMagic) && big<std::uint64_t>(beginning, 0) == kMagic;
}

Result<std::unique_ptr<const LinearRegion>> LinearRegion::parse(std::vector<std::byte> file) {
  QUOIN_ASSERT(begins(file), "a Linear region");
  if (file.size() < kDataOffset) return bad("the header is cut off", file.size());
  const auto version = std::to_integer<int>(file[kVersionAt]);
  if (version != 1 && version != 2) {
    return make_error(ErrorCode::Unsupported,
                      "Linear region: version " + std::to_string(version) + " is not supported (1 and 2 are)", {},
                      kVersionAt);
  }
  std::unique_ptr<LinearRegion> region(new LinearRegion(std::move(file)));
  const std::span<const std::byte> bytes = region->file_;
  region->stream_bytes_ = big<std::uint32_t>(bytes, kStreamBytesAt);
  if (region->stream_bytes_ > bytes.size() - kDataOffset) {
    return bad("the header claims " + std::to_string(region->stream_bytes_) + " compressed bytes, but " +
                   std::to_string(bytes.size() - kDataOffset) + " are left",
               kStreamBytesAt);
  }
  const auto table = expand_zstd(bytes.subspan(kDataOffset, region->stream_bytes_), kTableBytes);
  if (!table) return table.error();
  std::uint64_t sum = kTableBytes;
  for (std::size_t i = 0; i < kChunks; ++i) {
    region->sizes_[i] = big<std::uint32_t>(*table, 8 * i);
    sum += region->sizes_[i];
    if (region->sizes_[i] > kMaxChunkBytes || sum > kMaxBytes) {
      return make_error(ErrorCode::LimitExceeded, "Linear region: the chunks claim too many bytes", {}, kDataOffset);
    }
  }
  return std::unique_ptr<const LinearRegion>(std::move(region));
}

void LinearRegion::expand() const {
  const auto all = std::accumulate(sizes_.begin(), sizes_.end(), kTableBytes);
  expanded_ = expand_zstd(std::span(file_).subspan(kDataOffset, stream_bytes_), all);
}

Result<std::vector<std::byte>> LinearRegion::read(std::size_t chunk) const {
  QUOIN_ASSERT(has(chunk), "a chunk of the region");
  std::call_once(once_, [this] { expand(); });
  if (!expanded_) return expanded_.error();
  const auto begin = std::accumulate(sizes_.begin(), sizes_.begin() + static_cast<std::ptrdiff_t>(chunk), kTableBytes);
  QUOIN_ASSERT(begin + sizes_[chunk] <= expanded_->size(), "a chunk within the expanded bytes");
  const auto first = expanded_->begin() + static_cast<std::ptrdiff_t>(begin);
  return std::vector<std::byte>(first, first + static_cast<std::ptrdiff_t>(sizes_[chunk]));
}

}  // namespace quoin::minecraft

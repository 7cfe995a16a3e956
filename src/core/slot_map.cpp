#include <quoin/core/slot_map.h>

#include <atomic>

namespace quoin {

// Multiples of the golden ratio: of n of them no two are much nearer to each other than 2^32 / n.
std::uint32_t next_first_generation() {
  static std::atomic<std::uint32_t> maps{0};
  return maps.fetch_add(1, std::memory_order_relaxed) * 0x9E37'79B1U;
}

}  // namespace quoin

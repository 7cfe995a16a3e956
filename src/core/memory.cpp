#include <quoin/core/memory.h>

#ifndef __wasm__
#include <sys/resource.h>
#include <unistd.h>
#endif
#ifdef __linux__
#include <sys/mman.h>
#endif
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <string>

#include <quoin/core/assert.h>

#include "core/large_array.h"

namespace quoin {
namespace {

#ifndef __wasm__
// Returns the number after a word in a file of lines "WORD NUMBER ...".
std::optional<std::uint64_t> number_in(const std::string& path, const std::string& word) {
  std::ifstream file(path);
  for (std::string key; file >> key;) {
    std::uint64_t number = 0;
    if (key == word && file >> number) return number;
    std::string rest;
    std::getline(file, rest);
  }
  return std::nullopt;
}

// Reads the number in a file; nullopt for "max".
std::optional<std::uint64_t> number_of(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  if (!(file >> number)) return std::nullopt;
  return number;
}

std::optional<std::uint64_t> of_machine() {
  const auto free = number_in("/proc/meminfo", "MemAvailable:");
  if (!free) return std::nullopt;
  return (*free + number_in("/proc/meminfo", "SwapFree:").value_or(0)) * 1024;
}

// Returns the limit of a control group minus its usage. Cached files do not count as usage, since the kernel can free
// them.
std::optional<std::uint64_t> of_group(const std::string& folder) {
  const auto limit = number_of(folder + "/memory.max");
  const auto used = number_of(folder + "/memory.current");
  if (!limit || !used) return std::nullopt;
  const std::uint64_t files = number_in(folder + "/memory.stat", "inactive_file").value_or(0) +
                              number_in(folder + "/memory.stat", "active_file").value_or(0);
  const std::uint64_t kept = *used > files ? *used - files : 0;
  return *limit > kept ? *limit - kept : 0;
}

// Returns the minimum over the nested control groups of this process.
std::optional<std::uint64_t> of_groups() {
  std::ifstream file("/proc/self/cgroup");
  std::optional<std::uint64_t> least;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("0::")) continue;
    for (std::string group = line.substr(3);; group.erase(group.rfind('/'))) {
      if (const auto left = of_group("/sys/fs/cgroup" + group)) least = std::min(least.value_or(*left), *left);
      if (group.empty() || group.rfind('/') == std::string::npos) break;
    }
  }
  return least;
}

std::optional<std::uint64_t> of_process() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return std::nullopt;
  const std::uint64_t used = number_of("/proc/self/statm").value_or(0) * static_cast<std::uint64_t>(::getpagesize());
  return limit.rlim_cur > used ? limit.rlim_cur - used : 0;
}
#endif

// Returns true if a block of this size is pages of the system.
bool is_system_block([[maybe_unused]] std::size_t bytes) {
#ifdef __linux__
  return bytes >= kSystemBlock;
#else
  return false;
#endif
}

// Returns null if there is no memory.
void* new_block(std::size_t bytes) {
#ifdef __linux__
  if (is_system_block(bytes)) {
    void* const block = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return block == MAP_FAILED ? nullptr : block;
  }
#endif
  return std::calloc(1, bytes);  // NOLINT(*-no-malloc): zeroed pages that are never written take no memory
}

void free_block(void* block, [[maybe_unused]] std::size_t bytes) {
#ifdef __linux__
  if (is_system_block(bytes)) {
    ::munmap(block, bytes);
    return;
  }
#endif
  std::free(block);  // NOLINT(*-no-malloc)
}

}  // namespace

void* resize_block(void* block, std::size_t bytes, std::size_t wanted) {
  QUOIN_ASSERT((block == nullptr) == (bytes == 0), "an empty block or one with bytes");
  if (bytes == wanted) return block;
  if (wanted == 0) {
    free_block(block, bytes);
    return nullptr;
  }
#ifdef __linux__
  if (is_system_block(bytes) && is_system_block(wanted)) {
    void* const moved = ::mremap(block, bytes, wanted, MREMAP_MAYMOVE);
    if (moved == MAP_FAILED) throw std::bad_alloc();
    return moved;
  }
#endif
  const bool is_new = block == nullptr || is_system_block(wanted);
  void* const made = is_new ? new_block(wanted) : std::malloc(wanted);  // NOLINT(*-no-malloc)
  if (made == nullptr) throw std::bad_alloc();
  if (block != nullptr) {
    std::memcpy(made, block, std::min(bytes, wanted));
    free_block(block, bytes);
  }
  return made;
}

std::optional<std::uint64_t> available_memory() {
#ifdef __wasm__
  constexpr std::uint64_t kPage = 65'536;
  return (std::uint64_t{1} << 32) - __builtin_wasm_memory_size(0) * kPage;
#else
  std::optional<std::uint64_t> least;
  for (const auto& each : {of_machine(), of_groups(), of_process()}) {
    if (each) least = std::min(least.value_or(*each), *each);
  }
  return least;
#endif
}

bool return_freed_memory() {
#ifdef __GLIBC__
  // Setting the size keeps it fixed. Otherwise glibc would raise it to the largest freed block and keep all smaller
  // blocks.
  constexpr int kLargeBlock = 32 * 1024;
  return ::mallopt(M_MMAP_THRESHOLD, kLargeBlock) == 1;
#else
  return false;
#endif
}

}  // namespace quoin

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
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <string>

#include <quoin/core/assert.h>

#include "core/memory/large_array.h"

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

// The functions that supply large blocks. The first large block, or set_block_functions, decides them for good.
constexpr BlockFunctions kNoFunctions;
constinit BlockFunctions functions_of_program;  // not written after `decided` points to them
constinit std::atomic<const BlockFunctions*> decided{nullptr};

const BlockFunctions& block_functions() {
  const BlockFunctions* functions = decided.load(std::memory_order_acquire);
  if (functions == nullptr && decided.compare_exchange_strong(functions, &kNoFunctions)) return kNoFunctions;
  return *functions;
}

std::size_t alignment_of_block(std::size_t alignment) {
  QUOIN_ASSERT(alignment != 0 && (alignment & (alignment - 1)) == 0, "an alignment");
  return std::max<std::size_t>(alignment, __STDCPP_DEFAULT_NEW_ALIGNMENT__);
}

// Returns true if the functions of the program supply blocks of this size.
bool is_of_program(std::size_t bytes) {
  return bytes > kLargeBlock && block_functions().allocate != nullptr;
}

// Returns true if a block of this size is pages of the system.
bool is_system_block([[maybe_unused]] std::size_t bytes) {
#ifdef __linux__
  return bytes >= kSystemBlock && !is_of_program(bytes);
#else
  return false;
#endif
}

// All bytes are 0. Returns null if there is no memory.
void* new_block(std::size_t bytes) {
  if (is_of_program(bytes)) {
    const BlockFunctions& functions = block_functions();
    void* const block = functions.allocate(bytes, __STDCPP_DEFAULT_NEW_ALIGNMENT__, functions.context);
    return block == nullptr ? nullptr : std::memset(block, 0, bytes);
  }
#ifdef __linux__
  if (is_system_block(bytes)) {
    void* const block = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return block == MAP_FAILED ? nullptr : block;
  }
#endif
  return std::calloc(1, bytes);  // NOLINT(*-no-malloc): zeroed pages that are never written take no memory
}

// Returns null if there is no memory. Requires: not a block of the system.
void* block_without_content(std::size_t bytes) {
  if (!is_of_program(bytes)) return std::malloc(bytes);  // NOLINT(*-no-malloc)
  const BlockFunctions& functions = block_functions();
  return functions.allocate(bytes, __STDCPP_DEFAULT_NEW_ALIGNMENT__, functions.context);
}

void free_resizable(void* block, [[maybe_unused]] std::size_t bytes) {
  if (is_of_program(bytes)) {
    const BlockFunctions& functions = block_functions();
    return functions.free(block, bytes, __STDCPP_DEFAULT_NEW_ALIGNMENT__, functions.context);
  }
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
    free_resizable(block, bytes);
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
  void* const made = is_new ? new_block(wanted) : block_without_content(wanted);
  if (made == nullptr) throw std::bad_alloc();
  if (block != nullptr) {
    std::memcpy(made, block, std::min(bytes, wanted));
    free_resizable(block, bytes);
  }
  return made;
}

bool set_block_functions(const BlockFunctions& functions) {
  QUOIN_ASSERT(functions.allocate != nullptr && functions.free != nullptr, "both functions");
  static constinit std::atomic_flag is_taken;
  if (decided.load() != nullptr || is_taken.test_and_set()) return false;
  functions_of_program = functions;
  const BlockFunctions* none = nullptr;
  return decided.compare_exchange_strong(none, &functions_of_program);
}

void* allocate_large_block(std::size_t bytes, std::size_t alignment) {
  QUOIN_ASSERT(bytes > kLargeBlock, "a large block");
  const BlockFunctions& functions = block_functions();
  alignment = alignment_of_block(alignment);
  if (functions.allocate == nullptr) {
    if (alignment <= __STDCPP_DEFAULT_NEW_ALIGNMENT__) return ::operator new(bytes);
    return ::operator new(bytes, std::align_val_t(alignment));
  }
  void* const block = functions.allocate(bytes, alignment, functions.context);
  if (block == nullptr) throw std::bad_alloc();
  QUOIN_ASSERT(reinterpret_cast<std::uintptr_t>(block) % alignment == 0, "a block with the alignment");
  return block;
}

void free_large_block(void* block, std::size_t bytes, std::size_t alignment) noexcept {
  QUOIN_ASSERT(bytes > kLargeBlock, "a large block");
  const BlockFunctions& functions = block_functions();
  alignment = alignment_of_block(alignment);
  if (functions.free != nullptr) return functions.free(block, bytes, alignment, functions.context);
  if (alignment <= __STDCPP_DEFAULT_NEW_ALIGNMENT__) return ::operator delete(block);
  ::operator delete(block, std::align_val_t(alignment));
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
  constexpr int kReturnedBlock = 32 * 1024;
  return ::mallopt(M_MMAP_THRESHOLD, kReturnedBlock) == 1;
#else
  return false;
#endif
}

}  // namespace quoin

#include <quoin/core/memory.h>

#include <sys/resource.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <fstream>
#include <string>

namespace quoin {
namespace {

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

}  // namespace

std::optional<std::uint64_t> available_memory() {
  std::optional<std::uint64_t> least;
  for (const auto& each : {of_machine(), of_groups(), of_process()}) {
    if (each) least = std::min(least.value_or(*each), *each);
  }
  return least;
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

#pragma once

#include <functional>
#include <string>
#include <vector>

namespace quoin::counts {

/// A workload for counting instructions. It is small, since valgrind runs programs 50 times slower.
struct Counted {
  std::string name;
  std::function<void()> work;  ///< does the same on each call; run once beforehand, uncounted
};

/// Returns all workloads, created on the first call.
[[nodiscard]] std::vector<Counted> mesh_work();
[[nodiscard]] std::vector<Counted> ray_work();
[[nodiscard]] std::vector<Counted> file_work();
[[nodiscard]] std::vector<Counted> scene_work();

}  // namespace quoin::counts

#pragma once

#include <functional>
#include <string>
#include <vector>

namespace quoin::counts {

/// Work of which the instructions are counted. It is small, for valgrind runs programs fifty times slower.
struct Counted {
  std::string name;
  std::function<void()> work;  ///< the same whenever it is called; run once beforehand, uncounted
};

/// All of it, made at the first call.
[[nodiscard]] std::vector<Counted> mesh_work();
[[nodiscard]] std::vector<Counted> ray_work();
[[nodiscard]] std::vector<Counted> file_work();
[[nodiscard]] std::vector<Counted> scene_work();

}  // namespace quoin::counts

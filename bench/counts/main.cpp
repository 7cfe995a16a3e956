// Runs small fixed workloads, each between two callgrind marks. `./dev bench --check` compares their instruction counts
// with bench/counts/counts.txt.

#include <cstdio>
#include <string_view>

#include <valgrind/callgrind.h>

#include "counted.h"

int main(int argc, char** argv) {
  using quoin::counts::Counted;
  const std::string_view only = argc > 1 ? argv[1] : "";
  for (const auto& group :
       {quoin::counts::mesh_work, quoin::counts::ray_work, quoin::counts::file_work, quoin::counts::scene_work}) {
    for (const Counted& one : group()) {
      if (one.name.find(only) == std::string::npos) continue;
      one.work();
      CALLGRIND_START_INSTRUMENTATION;
      CALLGRIND_ZERO_STATS;
      one.work();
      CALLGRIND_DUMP_STATS_AT(one.name.c_str());
      CALLGRIND_STOP_INSTRUMENTATION;
      std::puts(one.name.c_str());
    }
  }
}

#include "watch.h"

#include <chrono>
#include <cstdio>
#include <thread>

#include <quoin/io/formats.h>

#include "commands.h"
#include "output.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

namespace fs = std::filesystem;

constexpr auto kTimeBetweenLooks = std::chrono::milliseconds(250);

void add_folder(const fs::path& folder, Stamps& stamps) {
  std::error_code code;
  for (fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, code);
       !code && at != fs::recursive_directory_iterator(); at.increment(code)) {
    std::error_code unknown;
    if (at->is_regular_file(unknown)) stamps[at->path().lexically_normal()] = FileStamp::of(at->path());
  }
}

Stamps stamps_of(const WatchedWork& work) {
  Stamps stamps = tool::stamps_of(work.read);
  for (const fs::path& path : work.written) stamps.erase(path.lexically_normal());
  return stamps;
}

/// Waits until the files differ from `known` and did not change for one interval, because a writer may be unfinished.
void wait_for_change(const WatchedWork& work, const Stamps& known) {
  Stamps last = known;
  while (!was_interrupted()) {
    std::this_thread::sleep_for(kTimeBetweenLooks);
    Stamps now = stamps_of(work);
    if (now != known && now == last) return;
    last = std::move(now);
  }
}

void report_watching(const WatchedWork& work) {
  if (is_quiet()) return;
  const std::string more = work.read.size() > 1 ? " and " + std::to_string(work.read.size() - 1) + " more" : "";
  std::fprintf(stderr, "quoin: watching %s%s; press Ctrl-C to stop\n", on_one_line(work.read.front().string()).c_str(),
               more.c_str());
}

}  // namespace

Stamps stamps_of(const std::vector<fs::path>& paths) {
  Stamps stamps;
  for (const fs::path& path : paths) {
    std::error_code unknown;
    if (fs::is_directory(path, unknown)) {
      add_folder(path, stamps);
    } else {
      stamps[path.lexically_normal()] = FileStamp::of(path);
    }
  }
  return stamps;
}

std::vector<fs::path> files_read(const fs::path& input, SidecarFiles allowed) {
  std::vector<fs::path> files = sidecar_files_of(input, allowed);
  files.insert(files.begin(), input);
  return files;
}

int watch(const std::vector<fs::path>& read, const std::function<WatchedWork()>& work) {
  catch_interrupts();
  bool is_first = true;
  WatchedWork done;
  done.read = read;
  while (!was_interrupted()) {
    // Taken before the run, so that changes during the run count, also for files that were read before.
    const Stamps before = stamps_of(done);
    done = work();
    if (is_first && done.status == kWrongUsage) return done.status;
    if (is_first) report_watching(done);
    is_first = false;
    Stamps known = stamps_of(done);
    for (auto& [path, stamp] : known) {
      if (const auto found = before.find(path); found != before.end()) stamp = found->second;
    }
    wait_for_change(done, known);
  }
  die_if_interrupted();
  return kDone;
}

}  // namespace quoin::tool

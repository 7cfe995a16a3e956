// Kills a saving process: all acknowledged saves are on disk, and each save is complete or absent.

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "store/world/saves_for_tests.h"

namespace quoin {
namespace {

// Runs in the process to be killed: saves repeatedly from a number onwards, and reports the numbers of the saves on
// disk.
[[noreturn]] void save_until_killed(const std::string& file, int first, int out) {
  auto world = WorldStore::open(file, WorldAccess::Write, {1});
  if (!world) ::_exit(3);
  const int before = first - 1;
  if (::write(out, &before, sizeof(before)) != sizeof(before)) ::_exit(4);
  for (int i = first;; ++i) {
    const auto ticket = world->save(changes_of(i), [out, i](const Status& saved) {
      if (!saved || ::write(out, &i, sizeof(i)) != sizeof(i)) ::_exit(4);
    });
    if (!ticket) ::_exit(5);
    if (i % 3 == 0 && !world->wait(*ticket)) ::_exit(6);
  }
}

/// Returns the last number written into a pipe.
int last_of(int in, int before) {
  int number = before;
  for (int read = 0; ::read(in, &read, sizeof(read)) == sizeof(read);) number = read;
  return number;
}

int wanted_kills() {
  const char* const wanted = std::getenv("QUOIN_KILLS");
  return wanted != nullptr ? std::atoi(wanted) : 15;
}

TEST(WorldKill, LosesNoAcknowledgedSave) {
  const WorldFolder folder;
  const std::string file = folder / "w.quoin";
  { ASSERT_TRUE(create_for_saves(file, nullptr)); }
  std::minstd_rand random(11);
  int saves = 0;
  for (int kill = 0; kill < wanted_kills(); ++kill) {
    int ends[2] = {};
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      ::close(ends[0]);
      save_until_killed(file, saves + 1, ends[1]);
    }
    ::close(ends[1]);
    int ready = 0;
    if (kill % 4 != 0) {  // otherwise it may not even have opened the world
      ASSERT_EQ(::read(ends[0], &ready, sizeof(ready)), static_cast<ssize_t>(sizeof(ready)));
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 60'000));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it ended by itself, with " << WEXITSTATUS(status);
    const int acknowledged = last_of(ends[0], saves);
    ::close(ends[0]);
    const Found found = look_at(file, nullptr);
    ASSERT_GE(found.saves, acknowledged) << found.why << ", kill " << kill;
    saves = found.saves;
  }
  EXPECT_GT(saves, 0);
  std::printf("%d kills, %d saves, nothing lost\n", wanted_kills(), saves);
}

}  // namespace
}  // namespace quoin

#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <quoin/store/world_store.h>
#include <quoin/stream/streamed_world.h>

#include "core/work/workers.h"
#include "stream/stream_plan.h"

namespace quoin::stream {

/// Maximum number of problems kept for the caller.
inline constexpr std::size_t kMaxProblems = 1000;

[[nodiscard]] inline bool is_air(const StoredChunk& chunk) {
  return chunk.voxels.uniform() == kAir && !chunk.densities;
}
[[nodiscard]] inline bool is_air(const SceneGrid& content, IVec3 chunk) {
  return content.grid.find_chunk(chunk) == nullptr && content.field.find_chunk(chunk) == nullptr;
}

/// Returns "chunk (1, 2, 3) of grid 4".
[[nodiscard]] std::string name_of(const ChunkAddress& place);
/// Returns a time such as "10 s" or "250 ms".
[[nodiscard]] std::string text_of(std::chrono::milliseconds time);

/// Results of saves, reported by the store's thread. A save fails again with each retry, and chunks that generators
/// make cause many of them: each save gives at most one error, and none if it failed together with an earlier one.
class DiskOutcome {
 public:
  /// Returns the number of a save that the store receives.
  std::uint64_t begin() {
    const std::scoped_lock lock(mutex_);
    return ++begun_;
  }
  /// Returns the next result of `begin`, for a save that is collected in steps first.
  [[nodiscard]] std::uint64_t next() const {
    const std::scoped_lock lock(mutex_);
    return begun_ + 1;
  }
  void put(std::uint64_t save, const Status& outcome) {
    const std::scoped_lock lock(mutex_);
    has_failed_ = !outcome;
    if (outcome) {
      error_ = {};  // retried before it was taken
    } else if (save > reported_) {
      error_ = outcome;
    }
  }
  /// Takes the error of the saves that failed since the last call, with the world's path.
  [[nodiscard]] Status take(const std::filesystem::path& path) {
    const std::scoped_lock lock(mutex_);
    if (error_) return {};
    reported_ = begun_;
    error_.error().path = path.string();
    return std::exchange(error_, {});
  }
  /// Returns true if the last finished save failed.
  [[nodiscard]] bool has_failed() const {
    const std::scoped_lock lock(mutex_);
    return has_failed_;
  }

 private:
  mutable std::mutex mutex_;
  std::uint64_t begun_ = 0;
  std::uint64_t reported_ = 0;  // the error of this save and earlier ones was taken
  bool has_failed_ = false;
  Status error_;
};

/// The saves of a world's scene, numbered from 1. Each is collected in steps.
/// Lifetime: both arguments must outlive it. Threads: those of the saver.
class SceneSaves {
 public:
  using Clock = std::chrono::steady_clock;

  SceneSaves(WorldSaver& saver, WorldStore& store) : saver_(saver), store_(store) {}

  /// Begins a save of the scene as it is now. Requires: none is begun. Errors: as WorldSaver::begin.
  Status begin(const Scene& scene);
  /// Continues the save that is begun, if there is one. Errors: as WorldSaver::step; the next save has everything.
  Status step(double seconds);
  [[nodiscard]] bool is_begun() const { return saver_.is_begun(); }
  /// Returns true if `interval` has passed since the last save began.
  [[nodiscard]] bool is_due(Clock::duration interval) const { return Clock::now() - time_ >= interval; }
  /// Returns the number of the first save that contains an edit of now.
  [[nodiscard]] std::uint64_t next() const { return begun_ + 1; }
  /// Returns true if the store has the save, on disk or pending. A save has all edits of the saves before it.
  [[nodiscard]] bool has(std::uint64_t save) const { return save <= handed_; }
  /// Returns the number of the last save that the store has.
  [[nodiscard]] std::uint64_t handed() const { return handed_; }
  /// Returns true if the store refused the last save, or memory ran out.
  [[nodiscard]] bool is_refused() const { return is_refused_; }
  [[nodiscard]] DiskOutcome& disk() { return *disk_; }

 private:
  WorldSaver& saver_;
  WorldStore& store_;
  Clock::time_point time_{};
  std::uint64_t begun_ = 0;
  std::uint64_t handed_ = 0;
  bool is_refused_ = false;
  std::shared_ptr<DiskOutcome> disk_ = std::make_shared<DiskOutcome>();  // shared with the store's callbacks
};

/// A chunk that was read or generated.
struct CompletedLoad {
  ChunkAddress place;
  StoredChunk chunk{};
  enum class Outcome : std::uint8_t {
    Came,
    Broken,       ///< it is damaged in the world's file and will not arrive
    OutOfMemory,  ///< to be tried again
    Cancelled,    ///< not needed any more
  };
  Outcome outcome = Outcome::Came;
};

/// Workers that plan, read, generate and save chunks:
///
///   caller  -- post -->  inbox  -->  plan -> read or make -> save new chunks  -->  outbox  -- take -->  caller
///
/// The caller waits for neither the plan nor the disk: both boxes are swapped as a whole.
class ChunkStreamer {
 public:
  struct Options {
    bool keeps_made = true;
    unsigned workers = 1;
    std::chrono::milliseconds generator_timeout{10'000};
  };
  /// Limits that generated chunks are checked against.
  struct Rules {
    VoxelRegistry types;
    std::map<std::uint32_t, float> bands;  ///< by grid
  };
  /// A result for a chunk that the caller's thread reports to the workers.
  struct Event {
    enum class What : std::uint8_t {
      Here,    ///< it was put in place
      Broken,  ///< it will not arrive
      Gone,    ///< it was unloaded or dropped
    };
    ChunkAddress place;
    What what = What::Here;
  };
  struct Note {
    std::optional<StreamRequests> requests{};  ///< set if they changed
    std::vector<Event> events;                 ///< in order
    std::vector<StoredChunk> released{};       ///< destroyed on a worker thread, off the caller's thread
    void add(const ChunkAddress& place, Event::What what) { events.push_back({place, what}); }
    [[nodiscard]] bool empty() const { return !requests && events.empty() && released.empty(); }
  };
  struct Outbox {
    std::vector<CompletedLoad> completed_loads;
    std::vector<ChunkAddress> leaving;  ///< chunks to unload by the last plan
    bool has_leaving = false;           ///< there was a plan
    std::vector<std::string> problems;
    std::size_t wanted = 0;
    std::size_t missing = 0;
    double complete_radius = 0.0;
    std::uint64_t plans = 0;  ///< the number of the last planned requests
    std::uint64_t read = 0;   ///< total number of chunks
    std::uint64_t made = 0;
    std::size_t begun = 0;  ///< chunks that workers are processing
  };

  /// Lifetime: the store must outlive it.
  ChunkStreamer(WorldStore& store, Options options);
  ChunkStreamer(const ChunkStreamer&) = delete;
  ChunkStreamer& operator=(const ChunkStreamer&) = delete;
  /// Waits for the chunks that workers are processing.
  ~ChunkStreamer();

  /// Sets the generator of a grid, and the chunks that can be loaded: a box, and others outside of it. All other chunks
  /// are air that is never loaded. Chunks that the world does not store and the generator does not make are air.
  /// Returns when no worker uses the grid's former generator any more. If it throws, nothing has changed.
  void set_generator(std::uint32_t grid, std::shared_ptr<const ChunkGenerator> generator, const IBox& chunks,
                     std::span<const IVec3> others);
  [[nodiscard]] std::shared_ptr<const ChunkGenerator> generator_of(std::uint32_t grid) const;
  /// Replaces the rules. They have the bands of all grids with generators, except grids that were removed: their chunks
  /// are dropped.
  void set_rules(std::shared_ptr<const Rules> rules);
  /// Queues a note, which is empty afterwards and keeps memory for the next one. Unless `is_urgent`, wakes no sleeping
  /// worker: a wake-up costs the caller more than the rest.
  /// Cancels calls of generators for chunks that its requests do not need.
  void post(Note& note, bool is_urgent = true);
  /// Sets the bytes of chunks that may be read or made in addition to those in progress, and the expected bytes per
  /// chunk. Chunks that edits wait for are always loaded.
  void set_room(std::int64_t bytes, std::int64_t each);
  /// Takes all results since the last call, with the current counters.
  void take(Outbox& out);
  /// Waits until there are results, all posted work is done, or there is no room for more. Returns false after
  /// `at_most` without any of them. With a job system, `helps` lets the calling thread make chunks too, which can take
  /// longer.
  bool wait(std::chrono::milliseconds at_most, bool helps);
  /// Returns the number of chunks that are being read or made.
  [[nodiscard]] std::size_t working();
  [[nodiscard]] unsigned workers() const { return options_.workers; }
  /// Returns the chunks whose generators have not returned for Options::generator_timeout.
  [[nodiscard]] std::vector<ChunkAddress> slow_chunks() const;
  /// Appends a line for each of them that no earlier call reported.
  void report_slow_chunks(std::vector<std::string>& problems);

 private:
  using Generator = Replaceable<std::shared_ptr<const ChunkGenerator>>;
  using Clock = std::chrono::steady_clock;
  /// A call of a generator, on a worker's stack.
  struct Call {
    ChunkAddress place;
    Clock::time_point begun = Clock::now();
    std::atomic<bool> is_cancelled{false};
    bool is_reported = false;
  };
  struct Listed;

  [[nodiscard]] Workers::Clock::time_point step(Workers::Lock& lock);
  [[nodiscard]] Workers::Clock::time_point work_once(Workers::Lock& lock);
  void read_inbox();
  void hand_over(CompletedLoad completed);
  void note_shortage();
  [[nodiscard]] bool has_room() const;
  [[nodiscard]] CompletedLoad fetch(const ChunkAddress& place);
  void read_or_make(CompletedLoad& completed);
  void make(const ChunkGenerator& generator, const Call& call, CompletedLoad& completed);
  void cancel_calls(const StreamRequests* needs);
  [[nodiscard]] bool is_slow(const Call& call) const;
  [[nodiscard]] bool must_wait_for_disk();
  void add_problem(const ChunkAddress& place, const std::string& text);
  void report();

  WorldStore& store_;
  const Options options_;

  std::mutex inbox_mutex_;
  Note inbox_;
  std::uint64_t posted_ = 0;

  mutable std::mutex plan_mutex_;  ///< guards the members below
  StreamPlan plan_;
  /// Entries stay, so that workers can use one without the mutex.
  std::map<std::uint32_t, Generator> generators_;
  Note reading_;  ///< its first events have already been processed
  std::size_t read_events_ = 0;
  std::uint64_t read_posts_ = 0;
  std::uint64_t plans_ = 0;
  std::size_t released_bytes_ = 0;                           ///< since memory was last returned
  std::optional<Workers::Clock::time_point> disk_deadline_;  ///< while the disk is behind: time of the next chunk
  std::atomic<bool> is_ending_{false};
  std::atomic<std::int64_t> room_{0};  ///< bytes
  std::atomic<std::int64_t> each_{0};

  std::mutex outbox_mutex_;
  Outbox outbox_;
  std::size_t working_ = 0;
  bool is_short_ = false;  ///< memory ran short since the last report to the caller
  std::uint64_t reported_posts_ = 0;
  bool has_more_ = false;

  mutable std::mutex calls_mutex_;       ///< guards the members below, and Call::is_reported; never held for long
  std::vector<Call*> calls_;             ///< running; at most one per worker
  std::optional<StreamRequests> needs_;  ///< the last requests, for calls that begin later
  std::shared_ptr<const Rules> rules_ = std::make_shared<const Rules>();

  Workers workers_{plan_mutex_};  ///< last: they end first
};

}  // namespace quoin::stream

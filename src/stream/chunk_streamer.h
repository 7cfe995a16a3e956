#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <quoin/store/world_store.h>
#include <quoin/stream/streamed_world.h>

#include "core/work/workers.h"
#include "stream/stream_plan.h"

namespace quoin::stream {

[[nodiscard]] inline bool is_air(const StoredChunk& chunk) {
  return chunk.voxels.uniform() == kAir && !chunk.densities;
}

/// Results of saves, reported by the store's thread.
class DiskOutcome {
 public:
  void put(const Status& outcome) {
    const std::scoped_lock lock(mutex_);
    last_ = outcome;
  }
  [[nodiscard]] Status last() const {
    const std::scoped_lock lock(mutex_);
    return last_;
  }

 private:
  mutable std::mutex mutex_;
  Status last_;
};

/// A chunk that was read or generated.
struct CompletedLoad {
  ChunkAddress place;
  StoredChunk chunk{};
  enum class Outcome : std::uint8_t {
    Came,
    Broken,       ///< it is damaged in the world's file and will not arrive
    OutOfMemory,  ///< to be tried again
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
  /// Queues a note. Unless `is_urgent`, wakes no sleeping worker: a wake-up costs the caller more than the rest.
  void post(Note note, bool is_urgent = true);
  /// Sets the bytes of chunks that may be read or made in addition to those in progress, and the expected bytes per
  /// chunk. Chunks that edits wait for are always loaded.
  void set_room(std::int64_t bytes, std::int64_t each);
  /// Takes all results since the last call, with the current counters.
  void take(Outbox& out);
  /// Returns when there are results, when all posted work is done, or when there is no room for more.
  void wait();

 private:
  using Generator = Replaceable<std::shared_ptr<const ChunkGenerator>>;

  void run();
  bool work_once();
  void read_inbox();
  void hand_over(CompletedLoad completed);
  void note_shortage();
  [[nodiscard]] bool has_room() const;
  [[nodiscard]] CompletedLoad fetch(const ChunkAddress& place);
  void read_or_make(CompletedLoad& completed);
  void make(const ChunkGenerator& generator, CompletedLoad& completed);
  void wait_for_disk();
  void add_problem(const ChunkAddress& place, const Error& error);
  void report();
  void signal();

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
  std::size_t released_bytes_ = 0;  ///< since memory was last returned
  std::atomic<bool> is_ending_{false};
  std::atomic<std::int64_t> room_{0};  ///< bytes
  std::atomic<std::int64_t> each_{0};
  std::atomic<std::uint32_t> signal_{0};  ///< incremented when there may be work

  std::mutex outbox_mutex_;
  Outbox outbox_;
  std::condition_variable came_;
  std::size_t working_ = 0;
  bool is_short_ = false;  ///< memory ran short since the last report to the caller
  std::uint64_t reported_posts_ = 0;
  bool has_more_ = false;

  std::vector<std::jthread> workers_;  ///< last: they end first
};

}  // namespace quoin::stream

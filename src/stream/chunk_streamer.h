#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <quoin/store/world_store.h>
#include <quoin/stream/chunk_generator.h>

#include "stream/stream_plan.h"

namespace quoin::stream {

/// A chunk that was read or made.
struct Arrival {
  ChunkPlace place;
  StoredChunk chunk{};
  enum class Outcome : std::uint8_t {
    Came,
    Broken,       ///< it is damaged in the world's file, and stays away
    OutOfMemory,  ///< to be tried again
  };
  Outcome outcome = Outcome::Came;
};

/// Workers that plan, read, make and save:
///
///   caller  -- post -->  inbox  -->  plan -> read or make -> save what was made  -->  outbox  -- take -->  caller
///
/// The caller waits for neither plan nor disk: both boxes are exchanged as a whole.
class ChunkStreamer {
 public:
  struct Options {
    bool keeps_made = true;
    unsigned workers = 1;
  };
  /// What became of a chunk on the caller's thread.
  struct Event {
    enum class What : std::uint8_t {
      Here,    ///< it was put in place
      Broken,  ///< it will not come
      Gone,    ///< it was taken away, or dropped
    };
    ChunkPlace place;
    What what = What::Here;
  };
  struct Note {
    std::optional<Wishes> wishes{};     ///< where they are others than before
    std::vector<Event> events;          ///< in their order
    std::vector<StoredChunk> let_go{};  ///< to be destroyed where nobody waits for it
    void add(const ChunkPlace& place, Event::What what) { events.push_back({place, what}); }
    [[nodiscard]] bool empty() const { return !wishes && events.empty() && let_go.empty(); }
  };
  struct Outbox {
    std::vector<Arrival> arrivals;
    std::vector<ChunkPlace> leaving;  ///< of the last plan
    bool has_leaving = false;         ///< there was a plan
    std::vector<std::string> problems;
    std::size_t wanted = 0;
    std::size_t missing = 0;
    double complete_radius = 0.0;
    std::uint64_t plans = 0;  ///< the number of the wishes that were planned for last
    std::uint64_t read = 0;   ///< chunks, in all
    std::uint64_t made = 0;
    std::size_t begun = 0;  ///< chunks that workers are at
  };

  /// Lifetime: the store must outlive it.
  ChunkStreamer(WorldStore& store, Options options);
  ChunkStreamer(const ChunkStreamer&) = delete;
  ChunkStreamer& operator=(const ChunkStreamer&) = delete;
  /// Waits for the chunks that workers are at.
  ~ChunkStreamer();

  /// Null: what is not in the world is air.
  void set_generator(std::uint32_t grid, std::shared_ptr<const ChunkGenerator> generator);
  [[nodiscard]] std::shared_ptr<const ChunkGenerator> generator_of(std::uint32_t grid) const;
  void post(Note note);
  /// What came since the last call; the numbers are those of the present.
  void take(Outbox& out);
  /// Returns once something came, or nothing is left to do for what was posted.
  void wait();

 private:
  void run();
  void read_inbox();
  [[nodiscard]] Arrival fetch(const ChunkPlace& place);
  void read_or_make(Arrival& arrival);
  void make(const ChunkGenerator& generator, Arrival& arrival);
  void wait_for_disk();
  void add_problem(const ChunkPlace& place, const Error& error);
  void tell();
  void signal();

  WorldStore& store_;
  const Options options_;

  std::mutex inbox_mutex_;
  Note inbox_;
  std::uint64_t posted_ = 0;

  mutable std::mutex plan_mutex_;  ///< of what follows
  StreamPlan plan_;
  std::map<std::uint32_t, std::shared_ptr<const ChunkGenerator>> generators_;
  std::uint64_t read_posts_ = 0;
  std::uint64_t plans_ = 0;
  std::atomic<bool> is_ending_{false};
  std::atomic<std::uint32_t> signal_{0};  ///< raised when there may be something to do

  std::mutex outbox_mutex_;
  Outbox outbox_;
  std::condition_variable came_;
  std::size_t working_ = 0;
  std::uint64_t told_posts_ = 0;
  bool has_more_ = false;

  std::vector<std::jthread> workers_;  ///< last: they end first
};

}  // namespace quoin::stream

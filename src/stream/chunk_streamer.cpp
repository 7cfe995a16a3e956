#include "stream/chunk_streamer.h"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <thread>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::stream {
namespace {

// Workers stop making chunks while more bytes than this wait to be written.
constexpr std::uint64_t kMaxPendingBytes = std::uint64_t{128} << 20;
// After this many bytes of unloaded chunks, memory is returned to the system.
constexpr std::size_t kTrimBytes = std::size_t{16} << 20;

std::size_t bytes_of(const StoredChunk& chunk) {
  return chunk.voxels.bytes() + (chunk.densities ? chunk.densities->bytes() : 0);
}

// Returns freed pages to the system: allocators keep the pages between live blocks until asked.
void trim_heaps() {
#if defined(__GLIBC__)
  ::malloc_trim(0);
#endif
}

// Moves all elements to the end of a list. Keeps the memory of both.
template <class T>
void append(std::vector<T>& to, std::vector<T>& from) {
  if (to.empty()) {
    std::swap(to, from);
  } else {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
    from.clear();
  }
}

}  // namespace

std::string name_of(const ChunkAddress& place) {
  return "chunk (" + std::to_string(place.chunk.x) + ", " + std::to_string(place.chunk.y) + ", " +
         std::to_string(place.chunk.z) + ") of grid " + std::to_string(place.grid);
}

std::string text_of(std::chrono::milliseconds time) {
  if (time.count() % 1000 == 0) return std::to_string(time.count() / 1000) + " s";
  return std::to_string(time.count()) + " ms";
}

Status SceneSaves::begin(const Scene& scene) {
  time_ = Clock::now();
  is_refused_ = true;  // if it throws: not retried in each frame, so that chunks can leave memory
  Status begun = saver_.begin(store_, scene, {},
                              [to = disk_, save = disk_->next()](const Status& outcome) { to->put(save, outcome); });
  is_refused_ = !begun;
  if (begun) ++begun_;
  return begun;
}

Status SceneSaves::step(double seconds) {
  if (!is_begun()) return {};
  is_refused_ = true;
  const auto ticket = saver_.step(store_, seconds);
  is_refused_ = !ticket;
  if (!ticket) return ticket.error();
  if (!ticket->has_value()) return {};
  handed_ = begun_;
  disk_->begin();
  return {};
}

ChunkStreamer::ChunkStreamer(WorldStore& store, Options options) : store_(store), options_(options) {
  QUOIN_ASSERT(options.workers > 0, "at least one worker");
  workers_.start(options.workers, [this](Workers::Lock& lock, unsigned /*worker*/) { return step(lock); },
                 {.name = "stream"});
}

ChunkStreamer::~ChunkStreamer() {
  is_ending_ = true;
  cancel_calls(nullptr);
  workers_.stop();
}

void ChunkStreamer::set_generator(std::uint32_t grid, std::shared_ptr<const ChunkGenerator> generator,
                                  const IBox& chunks, std::span<const IVec3> others) {
  Generator::Value next(std::move(generator));
  Generator* kept = nullptr;
  {
    const std::scoped_lock lock(plan_mutex_);
    kept = &generators_[grid];
    plan_.set_extent(grid, chunks, others);
    kept->exchange(next);
  }
  {
    // Every call that uses the former generator was listed before.
    const std::scoped_lock lock(calls_mutex_);
    for (Call* const call : calls_) {
      if (call->place.grid == grid) call->is_cancelled = true;
    }
  }
  kept->wait_until_unused(next);
}

std::shared_ptr<const ChunkGenerator> ChunkStreamer::generator_of(std::uint32_t grid) const {
  const std::scoped_lock lock(plan_mutex_);
  const auto found = generators_.find(grid);
  return found == generators_.end() ? nullptr : *found->second.use();
}

void ChunkStreamer::set_rules(std::shared_ptr<const Rules> rules) {
  QUOIN_ASSERT(rules != nullptr, "rules");
  const std::scoped_lock lock(calls_mutex_);
  rules_ = std::move(rules);
}

void ChunkStreamer::post(Note& note, bool is_urgent) {
  if (note.empty()) return;
  if (note.requests) cancel_calls(&*note.requests);
  is_urgent |= note.requests.has_value();
  {
    const std::scoped_lock lock(inbox_mutex_);
    if (note.requests) inbox_.requests = std::exchange(note.requests, std::nullopt);
    append(inbox_.events, note.events);
    append(inbox_.released, note.released);
    ++posted_;
  }
  if (is_urgent) {
    workers_.wake_one();  // the planning worker wakes the others
  } else {
    workers_.note_work();
  }
}

void ChunkStreamer::set_room(std::int64_t bytes, std::int64_t each) {
  each_ = each;
  if (room_.exchange(bytes) > 0 || bytes <= 0) return;
  workers_.wake_all();
}

std::size_t ChunkStreamer::working() {
  const std::scoped_lock lock(outbox_mutex_);
  return working_;
}

void ChunkStreamer::take(Outbox& out) {
  out.completed_loads.clear();
  out.problems.clear();
  out.leaving.clear();
  const std::scoped_lock lock(outbox_mutex_);
  std::swap(out.completed_loads, outbox_.completed_loads);
  std::swap(out.problems, outbox_.problems);
  out.has_leaving = std::exchange(outbox_.has_leaving, false);
  if (out.has_leaving) std::swap(out.leaving, outbox_.leaving);
  out.wanted = outbox_.wanted;
  out.missing = outbox_.missing;
  out.complete_radius = outbox_.complete_radius;
  out.plans = outbox_.plans;
  out.read = outbox_.read;
  out.made = outbox_.made;
  out.begun = working_;
  if (std::exchange(is_short_, false)) out.problems.emplace_back("not enough memory to load all requested chunks");
}

bool ChunkStreamer::wait(std::chrono::milliseconds at_most, bool helps) {
  std::uint64_t posted = 0;
  {
    const std::scoped_lock lock(inbox_mutex_);
    posted = posted_;
  }
  workers_.wake_one();
  // Only the caller can make room.
  if (room_ <= 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::unique_lock lock(plan_mutex_);
  const auto has_news = [&] {
    const std::scoped_lock outbox(outbox_mutex_);
    return !outbox_.completed_loads.empty() || (working_ == 0 && !has_more_ && reported_posts_ >= posted);
  };
  return workers_.wait_for(lock, std::chrono::duration<double>(at_most).count(), has_news, helps);
}

// Processes the inbox. Requires: the plan's lock is held. If memory runs out, the next call continues there.
void ChunkStreamer::read_inbox() {
  if (read_events_ == reading_.events.size() && !reading_.requests) {
    reading_.events.clear();
    read_events_ = 0;
    const std::scoped_lock lock(inbox_mutex_);
    std::swap(reading_, inbox_);
    read_posts_ = posted_;
    for (const StoredChunk& chunk : reading_.released) released_bytes_ += bytes_of(chunk);
  }
  reading_.released.clear();
  QUOIN_ASSERT(read_events_ <= reading_.events.size(), "events that are left to read");
  for (; read_events_ < reading_.events.size(); ++read_events_) {
    const Event& event = reading_.events[read_events_];
    if (event.what == Event::What::Gone) {
      plan_.forget(event.place);
    } else {
      plan_.set_state(event.place,
                      event.what == Event::What::Here ? StreamPlan::State::Here : StreamPlan::State::Broken);
    }
  }
  if (!reading_.requests) return;
  plan_.plan(*reading_.requests);
  plans_ = reading_.requests->number;
  reading_.requests.reset();
}

// Publishes the state for the caller. Requires: the plan's lock is held.
void ChunkStreamer::report() {
  // Computed outside the lock that the caller takes.
  const std::size_t missing = plan_.missing();
  const double complete_radius = plan_.complete_radius();
  {
    const std::scoped_lock lock(outbox_mutex_);
    if (outbox_.plans != plans_) {
      outbox_.leaving = plan_.take_leaving();
      outbox_.has_leaving = true;
      outbox_.plans = plans_;
    }
    outbox_.wanted = plan_.wanted();
    outbox_.missing = missing;
    outbox_.complete_radius = complete_radius;
    has_more_ = plan_.has_next(has_room());
    reported_posts_ = read_posts_;
  }
}

// Always admits a few chunks, so that the viewer never stands in empty space.
bool ChunkStreamer::has_room() const {
  constexpr std::size_t kFew = 64;
  return room_ > 0 || plan_.max_chunks() <= kFew;
}

Workers::Clock::time_point ChunkStreamer::step(Workers::Lock& lock) {
  constexpr auto kUntilThereIsMemory = std::chrono::milliseconds(20);
  try {
    return work_once(lock);
  } catch (const std::bad_alloc&) {
    note_shortage();
    if (!lock.owns_lock()) lock.lock();
    return Workers::Clock::now() + kUntilThereIsMemory;
  }
}

// Waits for a limited time: a full disk must not stop the streamer. Requires: the plan's lock is held.
bool ChunkStreamer::must_wait_for_disk() {
  constexpr auto kLongest = std::chrono::seconds(2);
  std::optional<Workers::Clock::time_point> deadline = std::exchange(disk_deadline_, std::nullopt);
  if (!options_.keeps_made || store_.stats().pending_bytes <= kMaxPendingBytes) return false;
  const Workers::Clock::time_point now = Workers::Clock::now();
  if (!deadline) deadline = now + kLongest;
  if (now >= *deadline) return false;
  disk_deadline_ = deadline;
  return true;
}

// Processes the inbox and one chunk. Requires: the plan's lock is held.
Workers::Clock::time_point ChunkStreamer::work_once(Workers::Lock& lock) {
  constexpr auto kUntilSomeIsWritten = std::chrono::milliseconds(5);
  const auto has_post = [&] {
    const std::scoped_lock inbox(inbox_mutex_);
    return read_posts_ != posted_ || read_events_ != reading_.events.size() || reading_.requests;
  };
  const bool is_new = has_post();
  if (is_new) {
    read_inbox();
    report();
  }
  if (plan_.has_next(has_room()) && must_wait_for_disk()) return Workers::Clock::now() + kUntilSomeIsWritten;
  ChunkAddress place;
  if (!plan_.next(place, has_room())) {
    report();
    return Workers::kWhenWoken;
  }
  {
    const std::scoped_lock outbox(outbox_mutex_);
    ++working_;
  }
  if (is_new && plan_.has_next(has_room())) workers_.wake_all();
  const bool must_trim = released_bytes_ > kTrimBytes;
  if (must_trim) released_bytes_ = 0;
  lock.unlock();
  if (must_trim) trim_heaps();
  const std::int64_t reserved = each_;
  room_ -= reserved;
  CompletedLoad completed = fetch(place);
  room_ += reserved - static_cast<std::int64_t>(bytes_of(completed.chunk));
  hand_over(std::move(completed));
  lock.lock();
  return Workers::kAgain;
}

namespace {

// Reserves room for one more completed load. Returns false if memory runs out.
bool reserve_one(std::vector<CompletedLoad>& completed_loads) {
  constexpr std::size_t kLeast = 16;
  try {
    if (completed_loads.size() == completed_loads.capacity())
      completed_loads.reserve(std::max(kLeast, 2 * completed_loads.capacity()));
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

}  // namespace

// Retries until there is memory for the list entry, so that no completed load is lost.
void ChunkStreamer::hand_over(CompletedLoad completed) {
  for (;;) {
    {
      const std::scoped_lock outbox(outbox_mutex_);
      if (reserve_one(outbox_.completed_loads)) {
        QUOIN_ASSERT(working_ > 0, "a chunk that a worker began");
        outbox_.completed_loads.push_back(std::move(completed));
        --working_;
        break;
      }
    }
    note_shortage();
    if (is_ending_) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void ChunkStreamer::note_shortage() {
  const std::scoped_lock lock(outbox_mutex_);
  is_short_ = true;
}

CompletedLoad ChunkStreamer::fetch(const ChunkAddress& place) {
  CompletedLoad completed;
  completed.place = place;
  try {
    read_or_make(completed);
  } catch (const std::bad_alloc&) {
    completed.chunk = {};
    completed.outcome = CompletedLoad::Outcome::OutOfMemory;
  } catch (const std::exception& thrown) {
    completed.chunk = {};
    add_problem(place, std::string("its generator threw an exception: ") + thrown.what());
  } catch (...) {
    completed.chunk = {};
    add_problem(place, "its generator threw an exception");
  }
  return completed;
}

// Lists a call while it exists.
struct ChunkStreamer::Listed {
  Listed(ChunkStreamer& owner, Call& running) : streamer(owner), call(running) {
    const std::scoped_lock lock(streamer.calls_mutex_);
    streamer.calls_.push_back(&call);
    // The calls may have been cancelled before, while this worker looked for the chunk in the file.
    const auto& needs = streamer.needs_;
    if (streamer.is_ending_ || (needs && !is_needed(*needs, call.place))) call.is_cancelled = true;
  }
  Listed(const Listed&) = delete;
  Listed& operator=(const Listed&) = delete;
  ~Listed() {
    const std::scoped_lock lock(streamer.calls_mutex_);
    std::erase(streamer.calls_, &call);
  }

  ChunkStreamer& streamer;
  Call& call;
};

void ChunkStreamer::read_or_make(CompletedLoad& completed) {
  const ChunkAddress& place = completed.place;
  auto kept = store_.load_chunk(place);
  if (!kept) {
    completed.outcome = CompletedLoad::Outcome::Broken;
    return add_problem(place, to_string(kept.error()));
  }
  if (*kept) {
    completed.chunk = std::move(**kept);
    const std::scoped_lock lock(outbox_mutex_);
    ++outbox_.read;
    return;
  }
  const Generator* set = nullptr;
  {
    const std::scoped_lock lock(plan_mutex_);
    const auto found = generators_.find(place.grid);
    if (found == generators_.end()) return;
    set = &found->second;
  }
  Call call{place};
  const Listed listed(*this, call);  // before it takes the generator: see set_generator
  const auto generator = set->use();
  if (*generator != nullptr && (*generator)->chunks().contains(place.chunk)) make(**generator, call, completed);
}

void ChunkStreamer::make(const ChunkGenerator& generator, const Call& call, CompletedLoad& completed) {
  QUOIN_ASSERT(generator.chunks().contains(completed.place.chunk), "a chunk that the generator can make");
  auto made = call.is_cancelled ? Result<StoredChunk>(make_error(ErrorCode::Cancelled, "cancelled"))
                                : generator.make(call.place.chunk, Cancellation(call.is_cancelled));
  if (!made && made.error().code == ErrorCode::Cancelled && call.is_cancelled) {
    completed.outcome = CompletedLoad::Outcome::Cancelled;
    return;
  }
  if (!made) return add_problem(completed.place, to_string(made.error()));
  std::shared_ptr<const Rules> rules;
  {
    const std::scoped_lock lock(calls_mutex_);
    rules = rules_;
  }
  const auto band = rules->bands.find(completed.place.grid);
  if (band == rules->bands.end()) {  // the application removed the grid during the call
    completed.outcome = CompletedLoad::Outcome::Cancelled;
    return;
  }
  if (const auto valid = validate_chunk(*made, rules->types, band->second); !valid) {
    return add_problem(completed.place, "its generator made content that is not valid: " + to_string(valid.error()));
  }
  completed.chunk = std::move(*made);
  {
    const std::scoped_lock lock(outbox_mutex_);
    ++outbox_.made;
  }
  if (!options_.keeps_made) return;
  WorldChanges changes;
  changes.put_chunk(completed.place, completed.chunk);
  // The store keeps failed changes and retries them.
  if (const auto saved = store_.save(std::move(changes)); !saved) {
    add_problem(completed.place, to_string(saved.error()));
  }
}

// Cancels the calls whose chunks would be dropped on arrival; without requests, all calls. Done by the caller's thread,
// because all workers may be in calls.
void ChunkStreamer::cancel_calls(const StreamRequests* needs) {
  const std::scoped_lock lock(calls_mutex_);
  try {
    if (needs != nullptr) needs_ = *needs;
  } catch (const std::bad_alloc&) {
    needs_.reset();
  }
  for (Call* const call : calls_) {
    if (needs == nullptr || !is_needed(*needs, call->place)) call->is_cancelled = true;
  }
}

bool ChunkStreamer::is_slow(const Call& call) const {
  return Clock::now() - call.begun >= options_.generator_timeout;
}

std::vector<ChunkAddress> ChunkStreamer::slow_chunks() const {
  const std::scoped_lock lock(calls_mutex_);
  std::vector<ChunkAddress> slow;
  for (const Call* const call : calls_) {
    if (is_slow(*call)) slow.push_back(call->place);
  }
  return slow;
}

void ChunkStreamer::report_slow_chunks(std::vector<std::string>& problems) {
  const std::scoped_lock lock(calls_mutex_);
  for (Call* const call : calls_) {
    if (call->is_reported || !is_slow(*call)) continue;
    problems.push_back(name_of(call->place) + ": its generator has not returned for " +
                       text_of(options_.generator_timeout));
    call->is_reported = true;
  }
}

void ChunkStreamer::add_problem(const ChunkAddress& place, const std::string& text) {
  try {
    const std::scoped_lock lock(outbox_mutex_);
    if (outbox_.problems.size() < kMaxProblems) outbox_.problems.push_back(name_of(place) + ": " + text);
  } catch (const std::bad_alloc&) {  // the caller learns that memory is short
    note_shortage();
  }
}

}  // namespace quoin::stream

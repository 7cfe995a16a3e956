#include "stream/chunk_streamer.h"

#include <chrono>
#include <new>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::stream {
namespace {

// Bytes that wait to be written, from which on nothing is made until there are fewer.
constexpr std::uint64_t kMaxPendingBytes = std::uint64_t{128} << 20;
constexpr std::size_t kMaxProblems = 1000;

std::string name_of(const ChunkPlace& place) {
  return "chunk (" + std::to_string(place.chunk.x) + ", " + std::to_string(place.chunk.y) + ", " +
         std::to_string(place.chunk.z) + ") of grid " + std::to_string(place.grid);
}

template <class T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

}  // namespace

ChunkStreamer::ChunkStreamer(WorldStore& store, Options options) : store_(store), options_(options) {
  try {
    for (unsigned i = 0; i < options.workers; ++i) workers_.emplace_back([this] { run(); });
  } catch (...) {
    is_ending_ = true;
    signal();
    throw;
  }
}

ChunkStreamer::~ChunkStreamer() {
  is_ending_ = true;
  signal();
  workers_.clear();
}

void ChunkStreamer::signal() {
  ++signal_;
  signal_.notify_all();
}

void ChunkStreamer::set_generator(std::uint32_t grid, std::shared_ptr<const ChunkGenerator> generator) {
  const std::scoped_lock lock(plan_mutex_);
  generators_[grid] = std::move(generator);
}

std::shared_ptr<const ChunkGenerator> ChunkStreamer::generator_of(std::uint32_t grid) const {
  const std::scoped_lock lock(plan_mutex_);
  const auto found = generators_.find(grid);
  return found == generators_.end() ? nullptr : found->second;
}

void ChunkStreamer::post(Note note) {
  if (note.empty()) return;
  {
    const std::scoped_lock lock(inbox_mutex_);
    if (note.wishes) inbox_.wishes = std::move(note.wishes);
    append(inbox_.events, note.events);
    append(inbox_.let_go, note.let_go);
    ++posted_;
  }
  ++signal_;
  signal_.notify_one();  // whoever plans tells the others
}

void ChunkStreamer::take(Outbox& out) {
  out.arrivals.clear();
  out.problems.clear();
  out.leaving.clear();
  const std::scoped_lock lock(outbox_mutex_);
  std::swap(out.arrivals, outbox_.arrivals);
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
}

void ChunkStreamer::wait() {
  std::uint64_t posted = 0;
  {
    const std::scoped_lock lock(inbox_mutex_);
    posted = posted_;
  }
  std::unique_lock lock(outbox_mutex_);
  came_.wait(lock, [&] { return !outbox_.arrivals.empty() || (working_ == 0 && !has_more_ && told_posts_ >= posted); });
}

// Under the plan's lock.
void ChunkStreamer::read_inbox() {
  Note note;
  {
    const std::scoped_lock lock(inbox_mutex_);
    std::swap(note, inbox_);
    read_posts_ = posted_;
  }
  for (const Event& event : note.events) {
    if (event.what == Event::What::Gone) {
      plan_.forget(event.place);
    } else {
      plan_.set_state(event.place,
                      event.what == Event::What::Here ? StreamPlan::State::Here : StreamPlan::State::Broken);
    }
  }
  if (note.wishes) {
    plans_ = note.wishes->number;
    plan_.plan(std::move(*note.wishes));
  }
}

// Under the plan's lock: what the caller is to know of it.
void ChunkStreamer::tell() {
  // Not under the lock that the caller takes.
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
    has_more_ = plan_.has_next();
    told_posts_ = read_posts_;
  }
  came_.notify_all();
}

void ChunkStreamer::run() {
  const auto has_post = [&] {
    const std::scoped_lock inbox(inbox_mutex_);
    return read_posts_ != posted_;
  };
  std::unique_lock lock(plan_mutex_);
  while (!is_ending_) {
    const std::uint32_t seen = signal_;
    const bool is_new = has_post();
    if (is_new) {
      read_inbox();
      tell();
    }
    ChunkPlace place;
    if (!plan_.next(place)) {
      tell();
      lock.unlock();
      signal_.wait(seen);
      lock.lock();
      continue;
    }
    {
      const std::scoped_lock outbox(outbox_mutex_);
      ++working_;
    }
    if (is_new && plan_.has_next()) signal();
    lock.unlock();
    Arrival arrival = fetch(place);
    {
      const std::scoped_lock outbox(outbox_mutex_);
      outbox_.arrivals.push_back(std::move(arrival));
      --working_;
    }
    came_.notify_all();
    lock.lock();
  }
}

Arrival ChunkStreamer::fetch(const ChunkPlace& place) {
  Arrival arrival;
  arrival.place = place;
  try {
    read_or_make(arrival);
  } catch (const std::bad_alloc&) {
    arrival.chunk = {};
    arrival.outcome = Arrival::Outcome::OutOfMemory;
  }
  return arrival;
}

void ChunkStreamer::read_or_make(Arrival& arrival) {
  const ChunkPlace& place = arrival.place;
  auto kept = store_.load_chunk(place);
  if (!kept) {
    arrival.outcome = Arrival::Outcome::Broken;
    return add_problem(place, kept.error());
  }
  if (*kept) {
    arrival.chunk = std::move(**kept);
    const std::scoped_lock lock(outbox_mutex_);
    ++outbox_.read;
    return;
  }
  std::shared_ptr<const ChunkGenerator> generator;
  {
    const std::scoped_lock lock(plan_mutex_);
    const auto found = generators_.find(place.grid);
    if (found != generators_.end()) generator = found->second;
  }
  if (generator != nullptr && generator->chunks().contains(place.chunk)) make(*generator, arrival);
}

// Not for ever: a full disk is no reason to stand still.
void ChunkStreamer::wait_for_disk() {
  for (int i = 0; i < 400 && !is_ending_ && store_.stats().pending_bytes > kMaxPendingBytes; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void ChunkStreamer::make(const ChunkGenerator& generator, Arrival& arrival) {
  if (options_.keeps_made) wait_for_disk();
  auto made = generator.make(arrival.place.chunk);
  if (!made) return add_problem(arrival.place, made.error());
  arrival.chunk = std::move(*made);
  {
    const std::scoped_lock lock(outbox_mutex_);
    ++outbox_.made;
  }
  if (!options_.keeps_made) return;
  WorldChanges changes;
  changes.put_chunk(arrival.place, arrival.chunk);
  // What could not be written is kept by the store, and tried again.
  if (const auto saved = store_.save(std::move(changes)); !saved) add_problem(arrival.place, saved.error());
}

void ChunkStreamer::add_problem(const ChunkPlace& place, const Error& error) {
  const std::scoped_lock lock(outbox_mutex_);
  if (outbox_.problems.size() < kMaxProblems) outbox_.problems.push_back(name_of(place) + ": " + to_string(error));
}

}  // namespace quoin::stream

#include <quoin/stream/streamed_world.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_set>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/text.h"
#include "core/coordinates/chunk_trie.h"
#include "core/coordinates/long_box.h"
#include "core/memory/make_room.h"
#include "core/work/workers.h"
#include "stream/chunk_streamer.h"
#include "stream/edit_fit.h"
#include "stream/stream_plan.h"
#include "stream/terrain_generator.h"

namespace quoin {

using namespace stream;

namespace {

using Clock = std::chrono::steady_clock;
using What = ChunkStreamer::Event::What;

// Maximum number of arrivals that wait to be put in place.
constexpr std::size_t kMaxCompletedLoads = 128;
// Maximum number of chunks that edits wait for, per plan.
constexpr std::size_t kMaxAsked = 1024;
constexpr double kSaveShare = 0.5;  // part of `update_seconds` in which a call copies chunks for a save
// Longest wait for workers before the caller checks again whether they are all in generators that do not return.
constexpr auto kWait = std::chrono::milliseconds(100);
constexpr int kHelpAfter = 10;  // such waits without a chunk in progress, after which `flush` makes chunks itself
constexpr double kAsLongAsItTakes = std::numeric_limits<double>::infinity();
constexpr auto kAskOthers = std::chrono::milliseconds(100);
// Seconds between plans that only the budget causes.
constexpr double kReplan = 0.2;
// After this time without moved chunks all derived data is complete, seconds.
constexpr double kQuiet = 3.0;

// For tries whose entries have no pointers elsewhere.
constexpr auto kStays = [](auto&) {};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

struct StreamedWorld::Impl {
  struct Loaded {
    std::size_t bytes = 0;
    std::uint64_t save = 0;  // the first save that contains all its edits
  };
  struct Streamed {
    GridHandle handle;
    std::uint32_t number = 0;
    Placements placements;
    ChunkTrie<Loaded> loaded;  // grows without copies
    WaitingEdits waiting;
    std::unordered_set<IVec3, CoordinateHash> broken;
    bool has_extent = false;  // set_generator was called; until then no chunk is loaded
  };

  Impl(WorldStore opened_store, LoadedWorld opened_world, StreamOptions wanted, bool made)
      : options(std::move(wanted)),
        store(std::move(opened_store)),
        world(std::move(opened_world)),
        is_new(made),
        budget(options.budget_bytes, options.other_bytes != nullptr),
        streamer(store, {options.keep_generated && store.is_writable(), worker_count(options.workers),
                         options.generator_timeout}) {}

  [[nodiscard]] Scene& scene() { return world.loaded.scene; }
  Status begin();
  Streamed& add_streamed(GridHandle handle, std::uint32_t number);
  void set_generator(Streamed& grid, std::shared_ptr<const ChunkGenerator> generator);
  void limit_grids();
  [[nodiscard]] bool has_unlimited_grids() const {
    return std::ranges::any_of(grids, [](const auto& each) { return !each.second.has_extent; });
  }
  Streamed* streamed(std::uint32_t number) {
    const auto found = grids.find(number);
    return found == grids.end() ? nullptr : &found->second;
  }
  [[nodiscard]] const std::uint32_t* number_of(GridHandle handle) const {
    const auto found = numbers.find(handle);
    return found == numbers.end() ? nullptr : &found->second;
  }
  // Returns null if the application removed the grid.
  SceneGrid* content_of_grid(const Streamed& grid) {
    return scene().grids().find(grid.handle) == nullptr ? nullptr : &scene().edit(grid.handle);
  }

  Status update(std::span<const Viewer> viewers, double seconds);
  Status plan(std::span<const Viewer> viewers);  // without changing the scene
  void notify_workers();
  [[nodiscard]] bool has_chunks_to_move() const { return !completed_loads.empty() || ready_to_leave != 0; }
  void take_in();
  void move_chunks(double seconds, Clock::time_point start, ChunkStreamer::Note& note);
  void follow_instances();
  void find_eyes(std::span<const Viewer> viewers);
  void request(ChunkStreamer::Note& note);
  [[nodiscard]] bool is_cut() const;
  // Returns true if no requested chunk is on its way.
  [[nodiscard]] bool is_quiet() const {
    return box.missing == 0 && box.begun == 0 && completed_loads.empty() && box.plans == posted_plans;
  }
  [[nodiscard]] std::size_t chunks_of_budget() const;
  [[nodiscard]] bool is_near_anyone(const ChunkAddress& place) const;
  void put(CompletedLoad completed, ChunkStreamer::Note& note);
  std::optional<StoredChunk> edited_on_arrival(Streamed& grid, const CompletedLoad& completed,
                                               const SceneGrid& content);
  void take_away(const ChunkAddress& place, ChunkStreamer::Note& note);
  void note_edits();
  void note_edit(Streamed& grid, const SceneGrid& content, IVec3 chunk);
  Loaded& adopt(Streamed& grid, const SceneGrid& content, IVec3 chunk);
  void sort_leaving();
  Status save_now();
  Status begin_save();
  void share_rules();
  [[nodiscard]] std::size_t waiting_chunks() const;
  [[nodiscard]] bool waits_for_broken_alone() const;
  [[nodiscard]] Status blocked_edits(const std::vector<ChunkAddress>& slow) const;

  StreamOptions options;
  WorldStore store;
  LoadedWorld world;
  SceneSaves saves{world.saver, store};
  bool is_new = false;
  StreamBudget budget;
  std::map<std::uint32_t, Streamed> grids;
  std::map<GridHandle, std::uint32_t> numbers;  // of `grids`
  std::map<InstanceHandle, std::uint32_t> grid_of_instance;
  ChangeCursor followed_scene;
  SceneChanges scene_changes;  // kept for its memory

  Eyes eyes;          // now
  Eyes planned_eyes;  // eyes of the last requests
  std::size_t planned_chunks = 0;
  std::size_t asked_left = 0;  // chunks that edits wait for, as of the last requests
  std::uint64_t posted_plans = 0;
  bool must_plan = true;
  Clock::time_point planned{};
  KeptQueue<CompletedLoad> completed_loads;
  KeptQueue<ChunkAddress> leaving;
  std::size_t ready_to_leave = 0;  // the first of `leaving`: the store has their edits

  std::size_t arrived_bytes = 0;  // of `arrivals`
  Clock::time_point asked_others{};
  Clock::time_point moved{};      // when a chunk last arrived or left
  std::uint64_t edited_save = 0;  // the first save that contains all edits
  ChangeCursor saved_types;
  ChunkStreamer::Note unposted;
  bool has_moved = false;  // chunks arrived or left in the last update
  std::vector<std::string> problems;
  ChunkStreamer::Outbox box;
  StreamStats totals;

  ChunkStreamer streamer;  // last: its workers end first
};

Status StreamedWorld::Impl::begin() {
  for (const GridHandle handle : scene().grids().handles()) {
    const auto number = world.saver.number_of(handle);
    QUOIN_ASSERT(number.has_value(), "a loaded grid has a number");
    const auto value = store.value(terrain_value(*number));
    if (!value) return value.error();
    if (!scene().grids()[handle].grid.is_partial()) {  // a whole grid
      if (*value) {
        problems.push_back("grid " + std::to_string(*number) +
                           " is whole, so its terrain is not generated (to stream " +
                           "it again, open the file with load_world, clear SceneGrid::whole, and save)");
      }
      continue;
    }
    Streamed& grid = add_streamed(handle, *number);
    const auto terrain = *value ? terrain_from(**value) : std::nullopt;
    if (*value && !terrain) {
      problems.push_back("the terrain of grid " + std::to_string(*number) +
                         " has an unknown kind and is not generated");
    }
    if (!terrain) continue;  // the program may set a generator
    auto generator = make_terrain_generator(*terrain, scene().types);
    if (!generator) return generator.error();
    set_generator(grid, std::move(*generator));
  }
  return save_now();
}

// Limits the grid to the chunks that the generator makes, and to others: those that are stored, loaded or have waiting
// edits. If the stored chunks cannot be listed, the grid is not limited, so that each is looked up. If it throws, the
// grid's chunks are as before. Requires: `note_edits` has seen all edits.
void StreamedWorld::Impl::set_generator(Streamed& grid, std::shared_ptr<const ChunkGenerator> generator) {
  static constexpr IBox kAllChunks{IVec3(kMinChunk + 1), IVec3(kMaxChunk)};
  SceneGrid* const content = content_of_grid(grid);
  grid.has_extent |= content == nullptr;  // removed: there is nothing to limit
  if (content == nullptr) return;
  std::vector<IVec3> others;
  IBox extent = generator == nullptr ? IBox{} : generator->chunks();
  if (auto stored = store.chunks(grid.number, 0)) {
    others = std::move(*stored);
  } else {
    problems.push_back("the stored chunks of grid " + std::to_string(grid.number) +
                       " cannot be listed, so all its chunks are looked up: " + to_string(stored.error()));
    extent = kAllChunks;
  }
  grid.loaded.for_each([&](IVec3 chunk, const Loaded&) { others.push_back(chunk); });
  for (const auto& [chunk, edits] : grid.waiting) others.push_back(chunk);
  std::erase_if(others, [&](IVec3 chunk) { return extent.contains(chunk); });
  Grid voxels_before = content->grid.snapshot();
  DensityGrid field_before = content->field.snapshot();
  share_rules();
  try {
    content->grid.set_extent(extent, others);
    content->field.set_extent(extent, others);
    // Air chunks that were loaded because they lay outside of the extent have no marks.
    grid.loaded.for_each([&](IVec3 chunk, const Loaded&) {
      content->grid.load_chunk(chunk, Chunk(kAir));
      content->field.load_air_chunk(chunk);
    });
    content->grid.share_loaded(content->field);
    streamer.set_generator(grid.number, std::move(generator), extent, others);
  } catch (...) {
    content->grid = std::move(voxels_before);
    content->field = std::move(field_before);
    throw;
  }
  grid.has_extent = true;
  must_plan = true;
}

// Limits the grids from the file that have no generator to their stored chunks.
void StreamedWorld::Impl::limit_grids() {
  if (has_unlimited_grids()) note_edits();
  for (auto& [number, grid] : grids) {
    if (!grid.has_extent) set_generator(grid, nullptr);
  }
}

StreamedWorld::Impl::Streamed& StreamedWorld::Impl::add_streamed(GridHandle handle, std::uint32_t number) {
  Streamed& added = grids[number];
  added.handle = handle;
  added.number = number;
  numbers[handle] = number;
  followed_scene = {};
  return added;
}

void StreamedWorld::Impl::follow_instances() {
  PendingChanges changes(followed_scene, scene(), scene_changes);
  const auto follow = [&](InstanceHandle handle) {
    const Instance* const instance = scene().instances().find(handle);
    const auto was = grid_of_instance.find(handle);
    const auto* const number =
        instance == nullptr || !has_valid_transform(*instance) ? nullptr : number_of(instance->grid);
    if (was != grid_of_instance.end() && (number == nullptr || was->second != *number)) {
      if (Streamed* const grid = streamed(was->second)) grid->placements.remove(handle);
      grid_of_instance.erase(was);
    }
    if (number == nullptr) return;
    grid_of_instance[handle] = *number;
    streamed(*number)->placements.put(handle);
  };
  if (changes->all) {
    for (auto& [number, grid] : grids) grid.placements.clear();
    grid_of_instance.clear();
    for (const InstanceHandle handle : scene().instances().handles()) follow(handle);
  }
  for (const InstanceHandle handle : changes->instances) follow(handle);
  changes.commit();
}

// Updates `eyes` in place, without allocations while the viewers move.
void StreamedWorld::Impl::find_eyes(std::span<const Viewer> viewers) {
  follow_instances();
  for (auto& [number, grid] : grids) {
    const SceneGrid* const content = scene().grids().find(grid.handle);
    // A grid that is not limited yet could load any chunk, of endless air. The next `update` limits it.
    if (content == nullptr || !grid.has_extent) {
      eyes.erase(number);
      continue;
    }
    grid.placements.find_eyes(scene(), *content, viewers, eyes[number]);
  }
}

bool StreamedWorld::Impl::is_cut() const {
  return planned_chunks != 0 && static_cast<double>(box.wanted) > 0.9 * static_cast<double>(planned_chunks);
}

std::size_t StreamedWorld::Impl::chunks_of_budget() const {
  const bool has_all = box.missing == 0 && box.begun == 0 && completed_loads.empty();
  const double missing = static_cast<double>(box.missing) / static_cast<double>(std::max<std::size_t>(box.wanted, 1));
  const std::size_t fit = budget.chunks(planned_chunks, is_cut(), missing);
  // Edited chunks that cannot be saved count too: the plan shrinks until they fit.
  const bool is_stuck = !has_all && !has_chunks_to_move() && budget.room(0) <= 0 && seconds_since(planned) > kReplan;
  return is_stuck ? std::min(fit, planned_chunks * 9 / 10) : fit;
}

void StreamedWorld::Impl::request(ChunkStreamer::Note& note) {
  const std::size_t fit = chunks_of_budget();
  const bool is_over = budget.is_over();
  const double change = static_cast<double>(fit) / static_cast<double>(std::max<std::size_t>(planned_chunks, 1));
  // If all requested chunks fit, additional room changes nothing.
  const bool is_limited = is_cut() || fit <= box.wanted || is_over;
  const bool is_other_budget = is_limited && (change < 0.99 || change > 1.05) && seconds_since(planned) > kReplan;
  if (asked_left == 0 && waiting_chunks() != 0 && !waits_for_broken_alone()) must_plan = true;
  if (!must_plan && !is_other_budget && see_alike(eyes, planned_eyes)) return;
  StreamRequests requests;
  requests.eyes = eyes;
  requests.max_chunks = fit;
  for (const auto& [number, grid] : grids) {
    for (const auto& [chunk, edits] : grid.waiting) {
      if (requests.asked.size() == kMaxAsked) break;
      if (!grid.broken.contains(chunk)) requests.asked.push_back({number, 0, chunk});
    }
  }
  asked_left = requests.asked.size();
  std::ranges::sort(requests.asked, [](const ChunkAddress& a, const ChunkAddress& b) {
    return std::tie(a.grid, a.chunk.z, a.chunk.y, a.chunk.x) < std::tie(b.grid, b.chunk.z, b.chunk.y, b.chunk.x);
  });
  requests.number = ++posted_plans;
  note.requests = std::move(requests);
  planned_eyes = eyes;
  planned_chunks = fit;
  must_plan = false;
  planned = Clock::now();
}

bool StreamedWorld::Impl::is_near_anyone(const ChunkAddress& place) const {
  const auto found = eyes.find(place.grid);
  if (found == eyes.end()) return false;
  return std::ranges::any_of(found->second, [&](const Eye& eye) { return stays_for(eye, place.chunk); });
}

// Records the edits since the last call; chunks that workers brought are not edits.
void StreamedWorld::Impl::note_edits() {
  for (auto& [number, grid] : grids) {
    if (scene().grids().find(grid.handle) != nullptr) continue;  // else removed, with its loaded chunks
    grid.loaded.for_each([&](IVec3, const Loaded& chunk) { budget.remove_chunk(chunk.bytes); });
    grid.loaded.clear();
    grid.waiting.clear();
  }
  world.saver.follow(scene(), [&](GridHandle handle, std::optional<IVec3> chunk) {
    const std::uint32_t* const number = number_of(handle);
    if (number == nullptr) return;  // a whole grid
    Streamed& grid = *streamed(*number);
    const SceneGrid& content = scene().grids()[handle];
    edited_save = saves.next();
    if (chunk) return note_edit(grid, content, *chunk);
    // Too many changes to list: any loaded chunk may have been edited.
    for (const IVec3 each : content.grid.loaded_chunks()) note_edit(grid, content, each);
    for (const IVec3 each : content.field.loaded_chunks()) note_edit(grid, content, each);
  });
}

void StreamedWorld::Impl::note_edit(Streamed& grid, const SceneGrid& content, IVec3 chunk) {
  Loaded* known = grid.loaded.find_to_edit(chunk, kStays);
  if (known == nullptr) {
    if (!content.grid.is_loaded(chunk)) return;
    known = &adopt(grid, content, chunk);
  } else {
    const std::size_t now = loaded_bytes(content, chunk);
    budget.resize_chunk(known->bytes, now);
    known->bytes = now;
  }
  known->save = edited_save;
}

// Counts a chunk that was edited without being loaded, outside of the extent. From now on it is one of the others.
StreamedWorld::Impl::Loaded& StreamedWorld::Impl::adopt(Streamed& grid, const SceneGrid& content, IVec3 chunk) {
  if (Loaded* const known = grid.loaded.find_to_edit(chunk, kStays)) return *known;
  const ChunkAddress place{grid.number, 0, chunk};
  must_plan |= !is_near_anyone(place);  // no plan would unload it
  unposted.add(place, What::Here);
  Loaded& added = grid.loaded.find_or_create(chunk, kStays);
  added.bytes = loaded_bytes(content, chunk);
  budget.add_chunk(added.bytes);
  return added;
}

// Moves the chunks whose edits the store does not have yet behind the others. In a read-only world they stay loaded.
void StreamedWorld::Impl::sort_leaving() {
  ready_to_leave = leaving.size();
  if (saves.has(edited_save) || leaving.empty()) return;
  const auto unsaved = std::stable_partition(leaving.begin(), leaving.end(), [&](const ChunkAddress& place) {
    const auto found = grids.find(place.grid);
    if (found == grids.end()) return true;
    const Loaded* const chunk = found->second.loaded.find(place.chunk.x, place.chunk.y, place.chunk.z);
    return chunk == nullptr || saves.has(chunk->save);
  });
  ready_to_leave = static_cast<std::size_t>(unsaved - leaving.begin());
  if (!store.is_writable()) leaving.erase_from(unsaved);
}

Status StreamedWorld::Impl::begin_save() {
  note_edits();
  return store.is_writable() ? saves.begin(scene()) : Status();
}

// Finishes a save in steps, if one is begun, and saves everything.
Status StreamedWorld::Impl::save_now() {
  static_cast<void>(saves.step(kAsLongAsItTakes));  // if this fails, the next save contains everything
  if (auto done = begin_save(); !done) return done;
  if (auto done = saves.step(kAsLongAsItTakes); !done) return done;
  if (scene().types.has_changed_since(saved_types)) share_rules();
  saved_types = scene().types.cursor();
  return {};
}

// Hands the workers the types and bands that generated chunks are checked against.
void StreamedWorld::Impl::share_rules() {
  auto rules = std::make_shared<ChunkStreamer::Rules>();
  rules->types = scene().types;
  for (const auto& [number, grid] : grids) {
    const SceneGrid* const content = scene().grids().find(grid.handle);
    if (content != nullptr) rules->bands[number] = content->field.band();
  }
  streamer.set_rules(std::move(rules));
}

// Applies waiting edits to an arriving chunk. Returns nullopt if no edit waited or none changed it.
std::optional<StoredChunk> StreamedWorld::Impl::edited_on_arrival(Streamed& grid, const CompletedLoad& completed,
                                                                  const SceneGrid& content) {
  const auto waiting = grid.waiting.find(completed.place.chunk);
  if (waiting == grid.waiting.end()) return std::nullopt;
  if (asked_left != 0) --asked_left;
  auto changed = edited(waiting->second, completed.place.chunk, completed.chunk, content.field.band(), scene().types);
  grid.waiting.erase(waiting);
  return changed;
}

void StreamedWorld::Impl::put(CompletedLoad completed, ChunkStreamer::Note& note) {
  const ChunkAddress place = completed.place;
  Streamed* const grid = streamed(place.grid);
  SceneGrid* const content = grid == nullptr ? nullptr : content_of_grid(*grid);
  if (content == nullptr) {
    if (grid != nullptr) grid->waiting.clear();
    return note.add(place, What::Gone);
  }
  if (completed.outcome == CompletedLoad::Outcome::Broken) {
    grid->broken.insert(place.chunk);
    if (asked_left != 0 && grid->waiting.contains(place.chunk)) --asked_left;
    return note.add(place, What::Broken);
  }
  if (completed.outcome != CompletedLoad::Outcome::Came) {  // requested again, if it is still needed
    must_plan |= completed.outcome == CompletedLoad::Outcome::OutOfMemory || is_near_anyone(place) ||
                 grid->waiting.contains(place.chunk);
    return note.add(place, What::Gone);
  }
  // If the extent has changed since the chunk was requested, it may count as air. It is stored all the same.
  const bool is_air_by_extent = content->grid.is_loaded(place.chunk) && is_air(*content, place.chunk) &&
                                grid->loaded.find(place.chunk.x, place.chunk.y, place.chunk.z) == nullptr;
  const bool is_late = is_air_by_extent && !is_air(completed.chunk);
  if (is_late) {
    content->grid.unload_chunk(place.chunk, content->field);
  } else if (content->grid.is_loaded(place.chunk)) {
    adopt(*grid, *content, place.chunk);
    ++totals.chunks_dropped;
    note.released.push_back(std::move(completed.chunk));
    return note.add(place, What::Here);
  }
  std::optional<StoredChunk> edited = edited_on_arrival(*grid, completed, *content);
  const bool is_near = is_near_anyone(place);
  if (!is_near && !edited && !is_late) {
    ++totals.chunks_dropped;
    note.released.push_back(std::move(completed.chunk));
    return note.add(place, What::Gone);
  }
  const std::size_t size = loaded_bytes(completed.chunk);
  content->grid.load_chunk(place.chunk, std::move(completed.chunk.voxels), content->field,
                           std::move(completed.chunk.densities));
  // An edited chunk is saved before it is unloaded.
  if (edited) edited_save = saves.next();
  grid->loaded.find_or_create(place.chunk, kStays) = {size, edited ? edited_save : 0};
  budget.add_chunk(size);
  note.add(place, What::Here);
  if (!is_near) must_plan = true;
  if (!edited) return;
  content->grid.put_chunk(place.chunk, std::move(edited->voxels));
  content->field.put_chunk(place.chunk, edited->densities
                                            ? std::move(*edited->densities)
                                            : DensityChunk(content->field.neighbourhood(place.chunk).outside));
}

void StreamedWorld::Impl::take_away(const ChunkAddress& place, ChunkStreamer::Note& note) {
  Streamed* const grid = streamed(place.grid);
  SceneGrid* const content = grid == nullptr ? nullptr : content_of_grid(*grid);
  if (content == nullptr) return note.add(place, What::Gone);
  if (!content->grid.is_loaded(place.chunk)) return;
  StoredChunk last;  // destroyed on another thread
  if (const Chunk* const voxels = content->grid.find_chunk(place.chunk)) last.voxels = *voxels;
  if (const DensityChunk* const densities = content->field.find_chunk(place.chunk)) last.densities = *densities;
  content->grid.unload_chunk(place.chunk, content->field);
  note.released.push_back(std::move(last));
  note.add(place, What::Gone);
  const Loaded* const counted = grid->loaded.find(place.chunk.x, place.chunk.y, place.chunk.z);
  QUOIN_ASSERT(counted != nullptr, "loaded chunks are counted");
  budget.remove_chunk(counted->bytes);
  grid->loaded.erase(place.chunk, kStays);
  ++totals.chunks_unloaded;
}

// Moves arrived and leaving chunks within the time limit, at least one. A short list is moved over several updates: it
// gets the part of the limit that it has of the longest list that workers make. Requires: `sort_leaving`.
void StreamedWorld::Impl::move_chunks(double seconds, Clock::time_point start, ChunkStreamer::Note& note) {
  has_moved = false;
  const std::size_t waiting = completed_loads.size() + ready_to_leave;
  const double share = std::min(static_cast<double>(waiting) / static_cast<double>(kMaxCompletedLoads), 1.0);
  const Clock::time_point begun = Clock::now();
  while (has_chunks_to_move()) {
    if (has_moved && (seconds_since(start) >= seconds || seconds_since(begun) >= share * seconds)) break;
    has_moved = true;
    // Unloads chunks first to make room for arrivals.
    const bool is_over = budget.is_over();
    if (ready_to_leave != 0 && (is_over || ready_to_leave >= completed_loads.size())) {
      take_away(leaving.front(), note);
      leaving.pop_front();
      --ready_to_leave;
    } else {
      arrived_bytes -= loaded_bytes(completed_loads.front().chunk);
      budget.set_arrived(arrived_bytes);
      put(std::move(completed_loads.front()), note);
      completed_loads.pop_front();
    }
  }
}

// Takes the chunks and plans from the workers since the last call.
void StreamedWorld::Impl::take_in() {
  streamer.take(box);
  for (CompletedLoad& completed : box.completed_loads) {
    arrived_bytes += loaded_bytes(completed.chunk);
    completed_loads.push_back(std::move(completed));
  }
  budget.set_arrived(arrived_bytes);
  if (box.has_leaving) leaving.assign(box.leaving);
  for (std::string& problem : box.problems) {
    if (problems.size() < kMaxProblems) problems.push_back(std::move(problem));
  }
}

Status StreamedWorld::Impl::plan(std::span<const Viewer> viewers) {
  const Clock::time_point start = Clock::now();
  note_edits();
  take_in();
  if (start - asked_others >= kAskOthers) {
    const std::size_t others = options.other_bytes ? options.other_bytes() : 0;
    const auto pending = static_cast<std::size_t>(store.stats().pending_bytes);
    budget.set_others(others, pending, is_quiet() && seconds_since(moved) > kQuiet, start);
    asked_others = start;
  }
  Status outcome;
  sort_leaving();
  const std::uint64_t handed = saves.handed();
  // Chunks are queued for the disk before they leave memory, and before workers save chunks with new types.
  const bool has_types = scene().types.has_changed_since(saved_types);
  const bool is_wanted = has_types || ready_to_leave < leaving.size();
  const bool begins = saves.is_due(options.save_interval) || (is_wanted && !saves.is_refused());
  if (begins && has_types) {
    outcome = save_now();
  } else if (begins && !saves.is_begun()) {
    outcome = begin_save();  // the next call copies
  } else {
    outcome = saves.step(kSaveShare * options.update_seconds);
  }
  if (saves.handed() != handed) sort_leaving();
  if (outcome) outcome = saves.disk().take(store.path());
  find_eyes(viewers);
  return outcome;
}

Status StreamedWorld::Impl::update(std::span<const Viewer> viewers, double seconds) {
  const Clock::time_point start = Clock::now();
  limit_grids();
  Status outcome = plan(viewers);
  move_chunks(seconds, start, unposted);
  notify_workers();
  totals.longest_update_seconds = std::max(totals.longest_update_seconds, seconds_since(start));
  return outcome;
}

void StreamedWorld::Impl::notify_workers() {
  request(unposted);
  if (has_moved) moved = Clock::now();
  // Workers bring no more than the caller takes.
  streamer.set_room(completed_loads.size() > kMaxCompletedLoads ? 0 : budget.room(box.begun), budget.guess());
  streamer.post(unposted, !has_chunks_to_move());
}

std::size_t StreamedWorld::Impl::waiting_chunks() const {
  std::size_t sum = 0;
  for (const auto& [number, grid] : grids) sum += grid.waiting.size();
  return sum;
}

// Returns true if all waiting edits wait for broken chunks, which never arrive.
bool StreamedWorld::Impl::waits_for_broken_alone() const {
  return std::ranges::all_of(grids, [](const auto& each) {
    const Streamed& grid = each.second;
    return std::ranges::all_of(grid.waiting, [&](const auto& waits) { return grid.broken.contains(waits.first); });
  });
}

// Returns the reason if no waiting edit can be applied: its chunk is damaged or, if it is among `slow`, its generator
// does not return. If all workers are in such generators, no other chunk can come either.
Status StreamedWorld::Impl::blocked_edits(const std::vector<ChunkAddress>& slow) const {
  const bool has_worker = slow.size() < streamer.workers();
  std::string reason;
  for (const auto& [number, grid] : grids) {
    for (const auto& [chunk, edits] : grid.waiting) {
      const ChunkAddress place{number, 0, chunk};
      const bool is_slow = std::ranges::find(slow, place) != slow.end();
      if (grid.broken.contains(chunk)) {
        reason = name_of(place) + ", which is damaged";
      } else if (is_slow || !has_worker) {
        reason = name_of(is_slow ? place : slow.front()) + ", whose generator has not returned for " +
                 text_of(options.generator_timeout);
      } else {
        return {};
      }
    }
  }
  if (reason.empty()) return {};
  return make_error(ErrorCode::CannotRead, "edits wait for " + reason, store.path().string());
}

StreamedWorld::StreamedWorld(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StreamedWorld::StreamedWorld(StreamedWorld&&) noexcept = default;
StreamedWorld& StreamedWorld::operator=(StreamedWorld&& other) noexcept {
  if (this != &other) {
    if (impl_ != nullptr) (void)flush();
    impl_ = std::move(other.impl_);
  }
  return *this;
}
StreamedWorld::~StreamedWorld() {
  if (impl_ == nullptr || !impl_->store.is_writable()) return;
  try {
    (void)flush();
  } catch (const std::bad_alloc&) {  // earlier saves remain valid
  }
}

Result<StreamedWorld> StreamedWorld::open(const std::filesystem::path& path, WorldAccess access,
                                          const StreamOptions& options) {
  auto store = WorldStore::open(path, access);
  if (!store) return store.error();
  const std::uint64_t whole_bytes = std::max<std::size_t>(options.max_whole_bytes, 1);  // 0 would leave them unloaded
  auto loaded = load_partial_world(*store, {}, whole_bytes);
  if (!loaded) return loaded.error();
  StreamedWorld world(std::make_unique<Impl>(std::move(*store), std::move(*loaded), options, false));
  if (auto done = world.impl_->begin(); !done) return done.error();
  return world;
}

Result<StreamedWorld> StreamedWorld::open_or_create(const std::filesystem::path& path, const StreamOptions& options) {
  std::error_code error;
  const bool is_there = std::filesystem::exists(path, error);
  if (!is_there) {
    if (const auto made = WorldStore::create(path); !made) return made.error();
  }
  auto world = open(path, WorldAccess::Write, options);
  if (world) world->impl_->is_new = !is_there;
  return world;
}

Scene& StreamedWorld::scene() {
  return impl_->scene();
}
const Scene& StreamedWorld::scene() const {
  return impl_->scene();
}
bool StreamedWorld::is_new() const {
  return impl_->is_new;
}
const LoadedScene& StreamedWorld::opened() const {
  return impl_->world.loaded;
}
void StreamedWorld::set_view(WorldView view) {
  impl_->world.saver.set_view(std::move(view));
}

Result<WorldExtent> StreamedWorld::extent() const {
  WorldExtent found;
  impl_->follow_instances();
  scene().instances().for_each([&](InstanceHandle, const Instance& instance) {
    const SceneGrid* const grid = scene().grids().find(instance.grid);
    if (grid == nullptr || impl_->number_of(instance.grid) != nullptr || !has_valid_transform(instance)) return;
    const IBox voxels = grid->bounds();
    if (!voxels.empty()) extend(found.stored, scene(), instance, {DVec3(voxels.min), DVec3(voxels.max)});
  });
  for (const auto& [number, grid] : impl_->grids) {
    if (scene().grids().find(grid.handle) == nullptr) continue;
    const auto chunks = impl_->store.chunks(number, 0);
    if (!chunks) return chunks.error();
    found.stored_chunks += chunks->size();
    IBox stored;
    for (const IVec3 chunk : *chunks) stored = unite(stored, {chunk, chunk + 1});
    grid.placements.extend(found.stored, scene(), stored);
    const auto generator = impl_->streamer.generator_of(number);
    if (generator != nullptr) grid.placements.extend(found.generated, scene(), generator->chunks());
  }
  return found;
}

Result<GridHandle> StreamedWorld::add_grid(SceneGrid grid, std::shared_ptr<const ChunkGenerator> generator) {
  QUOIN_ASSERT(grid.grid.voxel_count() == 0 && grid.field.chunk_count() == 0, "an empty grid and an empty field");
  if (!impl_->store.is_writable()) {
    return make_error(ErrorCode::CannotWrite, "opened read-only", impl_->store.path().string());
  }
  const char* const mark = !grid.saved  ? "not saved, and its chunks need the file"
                           : grid.whole ? "whole, so it would not be streamed when the world is opened again"
                                        : nullptr;
  if (mark != nullptr) {
    return make_error(ErrorCode::InvalidArgument,
                      "cannot stream grid \"" + printable(grid.name) + "\": it is marked as " + mark);
  }
  grid.grid.make_partial();
  grid.field.make_partial();
  const GridHandle handle = scene().add_grid(std::move(grid));
  if (auto saved = impl_->save_now(); !saved) {
    scene().remove_grid(handle);
    return saved.error();
  }
  const auto number = impl_->world.saver.number_of(handle);
  QUOIN_ASSERT(number.has_value(), "a saved grid has a number");
  impl_->set_generator(impl_->add_streamed(handle, *number), std::move(generator));
  return handle;
}

std::optional<std::uint32_t> StreamedWorld::number_of(GridHandle grid) const {
  const std::uint32_t* const number = impl_->number_of(grid);
  return number == nullptr ? std::nullopt : std::optional(*number);
}

void StreamedWorld::use_generator(GridHandle grid, std::shared_ptr<const ChunkGenerator> generator) {
  const std::uint32_t* const number = impl_->number_of(grid);
  if (number == nullptr) {  // the file decides it, so it is no programming error
    const SceneGrid* const content = scene().grids().find(grid);
    QUOIN_ASSERT(content != nullptr, "a grid of the scene");
    impl_->problems.push_back("grid \"" + printable(content->name) + "\" is whole, so its generator is not used");
    return;
  }
  // Saves the generator's types first.
  if (const auto saved = impl_->save_now(); !saved) impl_->problems.push_back(to_string(saved.error()));
  impl_->set_generator(*impl_->streamed(*number), std::move(generator));
}

Result<GridHandle> StreamedWorld::add_terrain(const EndlessTerrain& terrain) {
  auto generator = make_terrain_generator(terrain, scene().types);
  if (!generator) return generator.error();
  SceneGrid grid;
  grid.name = "terrain";
  auto handle = add_grid(std::move(grid), std::move(*generator));
  if (!handle) return handle;
  WorldChanges changes;
  changes.put_value(terrain_value(*impl_->world.saver.number_of(*handle)), bytes_of(terrain));
  if (auto saved = store().save(std::move(changes)); !saved) {
    scene().remove_grid(*handle);
    return saved.error();
  }
  Instance instance;
  instance.name = "terrain";
  instance.grid = *handle;
  scene().add_instance(instance);
  if (auto saved = impl_->save_now(); !saved) return saved.error();
  return handle;
}

Status StreamedWorld::update(std::span<const Viewer> viewers) {
  return impl_->update(viewers, impl_->options.update_seconds);
}

Status StreamedWorld::plan(std::span<const Viewer> viewers) {
  Status outcome = impl_->plan(viewers);
  impl_->notify_workers();
  return outcome;
}

bool StreamedWorld::has_chunks_to_move() const {
  return impl_->has_chunks_to_move() || impl_->has_unlimited_grids();
}

Status StreamedWorld::load_all(std::span<const Viewer> viewers) {
  for (auto& [number, grid] : impl_->grids) grid.placements.look_at_all();
  for (;;) {
    if (auto done = impl_->update(viewers, kAsLongAsItTakes); !done) return done;
    if (!impl_->has_moved && impl_->is_quiet()) return {};
    (void)impl_->streamer.wait(kWait, true);
  }
}

bool StreamedWorld::is_loaded(GridHandle grid, IVec3 chunk) const {
  const SceneGrid* const content = scene().grids().find(grid);
  return content != nullptr && content->grid.is_loaded(chunk);
}

Status StreamedWorld::apply(const WorldEdit& edit) {
  Impl::Streamed* const grid = impl_->streamed(edit.grid);
  SceneGrid* const content = grid == nullptr ? nullptr : impl_->content_of_grid(*grid);
  if (content == nullptr) {
    return make_error(ErrorCode::InvalidArgument, "the world has no grid " + std::to_string(edit.grid));
  }
  const auto chunks = chunks_of_edit(edit, content->field.band());
  if (!chunks) return chunks.error();
  if (auto known = check_types(edit, scene().types); !known) return known;
  std::vector<IVec3> absent;
  for (const IVec3 chunk : *chunks) {
    if (!content->grid.is_loaded(chunk)) absent.push_back(chunk);
  }
  if (!absent.empty()) {
    keep_for(edit, absent, grid->waiting);
    impl_->must_plan = true;
  }
  apply_fitting(edit, content->grid, content->field, scene().types);
  return {};
}

Status StreamedWorld::flush() {
  std::vector<ChunkAddress> slow;
  // With a job system: a generator that never returns must not run on this thread, unless no worker is free.
  int idle_waits = 0;
  impl_->limit_grids();
  // Saves types first: chunks from workers and edits may need them.
  if (auto saved = impl_->save_now(); !saved) return saved;
  while (!impl_->waits_for_broken_alone()) {
    // Loads around the viewers of the last update: other chunks are edited, saved and unloaded again.
    impl_->take_in();
    impl_->note_edits();
    if (!impl_->saves.has(impl_->edited_save)) {
      if (auto saved = impl_->save_now(); !saved) return saved;
    }
    impl_->must_plan |= impl_->asked_left == 0;
    impl_->sort_leaving();
    impl_->move_chunks(kAsLongAsItTakes, Clock::now(), impl_->unposted);
    impl_->notify_workers();
    if (impl_->waits_for_broken_alone() || impl_->streamer.wait(kWait, idle_waits >= kHelpAfter)) continue;
    slow = impl_->streamer.slow_chunks();
    if (!slow.empty() && !impl_->blocked_edits(slow)) break;
    if (idle_waits < kHelpAfter) idle_waits = impl_->streamer.working() <= slow.size() ? idle_waits + 1 : 0;
  }
  Status waits = impl_->blocked_edits(slow);
  if (auto saved = impl_->save_now(); !saved) return saved;
  if (impl_->store.is_writable()) {
    if (auto flushed = impl_->store.flush(); !flushed) return flushed;
    impl_->saves.disk().put(impl_->saves.disk().begin(), {});  // the store may not have reported it yet
  }
  return waits;
}

std::vector<std::string> StreamedWorld::take_problems() {
  impl_->streamer.report_slow_chunks(impl_->problems);
  return std::exchange(impl_->problems, {});
}

StreamStats StreamedWorld::stats() {
  StreamStats now = impl_->totals;
  impl_->totals.longest_update_seconds = 0.0;
  now.loaded_chunks = impl_->budget.loaded_chunks();
  now.loaded_bytes = impl_->budget.loaded_bytes();
  now.other_bytes = impl_->budget.reported_bytes();
  now.wanted_chunks = impl_->box.wanted;
  now.missing_chunks = impl_->box.missing;
  now.is_complete = impl_->is_quiet() && !impl_->has_unlimited_grids();
  now.waiting_edits = impl_->waiting_chunks();
  now.complete_radius = impl_->box.complete_radius;
  now.has_save_failed = impl_->saves.is_refused() || impl_->saves.disk().has_failed();
  now.chunks_read = impl_->box.read;
  now.chunks_made = impl_->box.made;
  return now;
}

WorldStore& StreamedWorld::store() {
  return impl_->store;
}

}  // namespace quoin

// An update is a queue of boxes, a chunk's each, that are to be solved again: those around edits first. What a solution
// changes at the side of its box puts what lies beyond into the queue, until nothing changes any more. Since light is
// one level less with every step, there is one state in which nothing does.
#include <quoin/light/propagated_light.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include <quoin/grid/changes.h>

#include "core/change_journal.h"
#include "grid/change_records.h"
#include "grid/chunk_order.h"
#include "grid/coordinate_hash.h"
#include "light/propagated/light_domain.h"
#include "light/propagated/light_solver.h"
#include "light/propagated/light_store.h"

namespace quoin {
namespace {

using propagated::ChangedRows;
using propagated::ChunkLight;
using propagated::LightBorder;
using propagated::LightDomain;
using propagated::LightSolver;
using propagated::TypeLight;

constexpr int kReach = 15;
constexpr std::uint16_t kOpenSky = 15;

std::vector<TypeLight> type_lights(const VoxelRegistry& types, const PropagatedLightOptions& options) {
  std::vector<TypeLight> lights(types.size());
  for (std::size_t i = 1; i < lights.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    const VoxelProperties& properties = types[type];
    LightLevels lamp = options.lamp ? options.lamp(type, properties) : lamp_levels(properties);
    lamp.sky = 0;
    lights[i].lamp = packed(lamp);
    if (types.is_opaque(type)) {
      lights[i].passes = 0;
    } else {
      const Rgba8 colour = properties.colour;
      const int half = (std::max({colour.r, colour.g, colour.b}) + 1) / 2;
      lights[i].passes =
          static_cast<std::uint8_t>(1 | (colour.r >= half) << 1 | (colour.g >= half) << 2 | (colour.b >= half) << 3);
    }
  }
  return lights;
}

IBox grown(const IBox& box, int by) {
  return {box.min - by, box.max + by};
}

}  // namespace

LightLevels lamp_levels(const VoxelProperties& properties) {
  const float strength = 15.0F * std::clamp(properties.emission, 0.0F, 1.0F);
  const Rgba8& colour = properties.colour;
  const float greatest = std::max({colour.r, colour.g, colour.b, std::uint8_t{1}});
  const auto level = [&](std::uint8_t channel) {
    return static_cast<std::uint8_t>(std::lround(strength * static_cast<float>(channel) / greatest));
  };
  return {0, level(colour.r), level(colour.g), level(colour.b)};
}

struct PropagatedLight::Impl {
  using Queue = std::map<IVec3, IBox, bool (*)(IVec3, IVec3)>;
  struct Job {
    IVec3 chunk;
    IBox box;  // of the chunk
    ChunkLight* light;
    ChangedRows changed;
  };

  // Null: dark.
  [[nodiscard]] const ChunkLight* stored(IVec3 chunk) const {
    const auto found = levels.find(chunk);
    return found == levels.end() ? nullptr : found->second.get();
  }
  class WordReader;
  void begin_anew(const Grid& grid);
  void take_over(const Grid& grid, const GridChanges& changes);
  void change_domain(const Grid& grid, const std::vector<IVec3>& chunks);
  void take_in(IVec3 chunk);
  void let_go(IVec3 chunk);
  void add_beside(IVec3 chunk);
  void add(IVec3 chunk, const IBox& box);
  void add_part(IVec3 chunk, const IBox& voxels);
  void add_all(const IBox& voxels);
  [[nodiscard]] IBox reach_of(const Grid& grid, const IBox& voxels) const;
  void run(const Grid& grid, Threads threads);
  [[nodiscard]] std::vector<Job> next_jobs();
  void solve(const Grid& grid, LightSolver& solver, Job& job) const;
  [[nodiscard]] LightBorder border_of(IVec3 chunk) const;
  [[nodiscard]] std::optional<std::uint16_t> uniform_light(const Grid& grid, IVec3 chunk,
                                                           const LightBorder& border) const;
  void note_all(IVec3 chunk, ChunkLight& light);
  void go_on(const Job& job, const IBox& changed);

  PropagatedLightOptions options;
  ChangeCursor followed_grid;
  ChangeCursor followed_types;
  std::vector<TypeLight> lights;
  LightDomain domain;
  std::unordered_map<IVec3, std::unique_ptr<ChunkLight>, CoordinateHash> levels;  // of the chunks of the domain
  ChangeJournal<VoxelRecord> journal;                                             // of `levels`
  Queue queue{by_zyx};
};

/// Remembers the chunk that it read last.
class PropagatedLight::Impl::WordReader {
 public:
  explicit WordReader(const Impl& of) : of_(of) {}
  std::uint16_t at(IVec3 voxel) {
    const IVec3 chunk = chunk_of(voxel);
    if (!is_known_ || chunk != last_) look_at(chunk);
    return stored_ == nullptr ? word_ : stored_->at(local_of(voxel));
  }

 private:
  void look_at(IVec3 chunk) {
    is_known_ = true;
    last_ = chunk;
    const bool is_held = of_.domain.holds(chunk);
    stored_ = is_held ? of_.stored(chunk) : nullptr;
    word_ = is_held ? std::uint16_t{0} : of_.domain.beyond(chunk);
  }

  const Impl& of_;
  bool is_known_ = false;
  IVec3 last_{0};
  const ChunkLight* stored_ = nullptr;
  std::uint16_t word_ = 0;
};

void PropagatedLight::Impl::begin_anew(const Grid& grid) {
  queue.clear();
  domain.clear();
  for (const auto& [chunk, light] : levels) note_all(chunk, *light);
  levels.clear();
  change_domain(grid, grid.chunks());
}

// Chunks that came or went, or may have: light of what the domain has now is found from nothing.
void PropagatedLight::Impl::change_domain(const Grid& grid, const std::vector<IVec3>& chunks) {
  std::vector<LightDomain::Change> changed;
  for (const IVec3 chunk : chunks) domain.set(chunk, grid.find_chunk(chunk) != nullptr, changed);
  for (const LightDomain::Change& column : changed) {
    const LightDomain::Range old = column.before;
    for (int y = old.begin; y < old.end; ++y) {
      if (y < column.now.begin || y >= column.now.end) let_go({column.x, y, column.z});
    }
    for (int y = column.now.begin; y < column.now.end; ++y) {
      if (y < old.begin || y >= old.end) take_in({column.x, y, column.z});
    }
  }
}

// It begins in the dark: light that grows comes to its end in fewer steps than light that dwindles. To those beside it
// it was as the domain said, and so it was to readers, the open sky nearly always.
void PropagatedLight::Impl::take_in(IVec3 chunk) {
  std::unique_ptr<ChunkLight>& light = levels[chunk];
  if (light == nullptr) light = std::make_unique<ChunkLight>();
  note_all(chunk, *light);
  add(chunk, kWholeChunk);
  add_beside(chunk);
}

void PropagatedLight::Impl::let_go(IVec3 chunk) {
  const auto found = levels.find(chunk);
  if (found != levels.end()) {
    note_all(chunk, *found->second);
    levels.erase(found);
  }
  add_beside(chunk);
}

// It is about to go, or has just come: readers have what the domain says on the other side.
void PropagatedLight::Impl::note_all(IVec3 chunk, ChunkLight& light) {
  VoxelRecord record;
  record.chunk = chunk;
  record.add_all();
  journal.note(light.serial, record, levels.size());
}

void PropagatedLight::Impl::add_beside(IVec3 chunk) {
  for (const Direction direction : kDirections) add(chunk + normal_of(direction), kWholeChunk);
}

// A box of the chunk's voxels is to be solved again, if the domain holds it.
void PropagatedLight::Impl::add(IVec3 chunk, const IBox& box) {
  if (box.empty() || !domain.holds(chunk)) return;
  IBox& known = queue[chunk];
  known = unite(known, box);
}

void PropagatedLight::Impl::add_part(IVec3 chunk, const IBox& voxels) {
  const IVec3 low = chunk * kChunkEdge;
  add(chunk, intersect({voxels.min - low, voxels.max - low}, kWholeChunk));
}

// Where light may differ for edits of these voxels: as far as it reaches, around columns that the sky falls down too.
IBox PropagatedLight::Impl::reach_of(const Grid& grid, const IBox& voxels) const {
  int low = voxels.min.y;
  WordReader words(*this);
  for (int z = voxels.min.z; z < voxels.max.z; ++z) {
    for (int x = voxels.min.x; x < voxels.max.x; ++x) {
      bool has_sky = (words.at({x, voxels.max.y, z}) & 15) == kOpenSky;
      for (int y = voxels.min.y; y < voxels.max.y; ++y) has_sky |= (words.at({x, y, z}) & 15) == kOpenSky;
      if (!has_sky) continue;
      const LightDomain::Range range = domain.range(x >> kChunkShift, z >> kChunkShift);
      int y = voxels.min.y;
      const auto passes = [&] {
        const VoxelType type = grid.get(x, y - 1, z);
        return type < lights.size() && (type == kAir || (lights[type].passes & 1U) != 0);
      };
      while (y - 1 >= range.begin * kChunkEdge && passes()) --y;
      low = std::min(low, y);
    }
  }
  return grown({{voxels.min.x, low, voxels.min.z}, voxels.max}, kReach);
}

void PropagatedLight::Impl::add_all(const IBox& voxels) {
  const IVec3 first = chunk_of(voxels.min);
  const IVec3 last = chunk_of(voxels.max - 1);
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) add_part({x, y, z}, voxels);
    }
  }
}

void PropagatedLight::Impl::take_over(const Grid& grid, const GridChanges& changes) {
  std::vector<IVec3> chunks;
  chunks.reserve(changes.items.size());
  for (const ChunkChange& change : changes.items) chunks.push_back(change.chunk);
  change_domain(grid, chunks);
  for (const ChunkChange& change : changes.items) {
    const IVec3 low = change.chunk * kChunkEdge;
    if (const auto found = levels.find(change.chunk); found != levels.end()) found->second->forget_lamps(change.box);
    add_all(reach_of(grid, {change.box.min + low, change.box.max + low}));
  }
}

LightBorder PropagatedLight::Impl::border_of(IVec3 chunk) const {
  LightBorder border;
  for (const Direction direction : kDirections) {
    const IVec3 other = chunk + normal_of(direction);
    const auto i = static_cast<std::size_t>(direction);
    if (domain.holds(other)) {
      border.chunk[i] = stored(other);  // dark where nothing is stored
    } else {
      border.beyond[i] = domain.beyond(other);
    }
  }
  return border;
}

// Of chunks of air under the open sky, and in the dark.
std::optional<std::uint16_t> PropagatedLight::Impl::uniform_light(const Grid& grid, IVec3 chunk,
                                                                  const LightBorder& border) const {
  if (grid.find_chunk(chunk) != nullptr) return std::nullopt;
  std::array<std::uint16_t, 6> around{};
  for (std::size_t i = 0; i < around.size(); ++i) {
    const std::optional<std::uint16_t> word =
        border.chunk[i] != nullptr ? border.chunk[i]->uniform() : std::optional(border.beyond[i]);
    if (!word) return std::nullopt;
    around[i] = *word;
    if (around[i] != 0 && around[i] != kOpenSky) return std::nullopt;
  }
  if (around[static_cast<std::size_t>(Direction::PosY)] == kOpenSky) return kOpenSky;
  return std::all_of(around.begin(), around.end(), [](std::uint16_t word) { return word == 0; })
             ? std::optional<std::uint16_t>(0)
             : std::nullopt;
}

void PropagatedLight::Impl::solve(const Grid& grid, LightSolver& solver, Job& job) const {
  const LightBorder border = border_of(job.chunk);
  if (const std::optional<std::uint16_t> word = uniform_light(grid, job.chunk, border)) {
    job.changed = fill(*job.light, *word);
    job.box = kWholeChunk;
  } else {
    job.changed = solver.solve(grid.find_chunk(job.chunk), lights, border, job.box, *job.light);
  }
}

// The highest chunks of the queue, since sky falls: what lies below is solved once with what comes from above. Of these
// every second one, so that none is read by another while its light is replaced.
std::vector<PropagatedLight::Impl::Job> PropagatedLight::Impl::next_jobs() {
  IVec3 first = queue.begin()->first;
  for (const auto& [chunk, box] : queue) {
    if (chunk.y > first.y) first = chunk;
  }
  const auto is_next = [&](IVec3 chunk) {
    return chunk.y == first.y && ((chunk.x + chunk.z) & 1) == ((first.x + first.z) & 1);
  };
  std::vector<Job> jobs;
  for (auto next = queue.begin(); next != queue.end();) {
    const auto each = next++;
    if (!is_next(each->first)) continue;
    std::unique_ptr<ChunkLight>& light = levels[each->first];
    if (light == nullptr) light = std::make_unique<ChunkLight>();
    jobs.push_back({each->first, each->second, light.get(), {}});
    queue.erase(each);
  }
  return jobs;
}

// What changed at a side of the box may change what lies beyond it: as far as light reaches, and down the whole chunk.
void PropagatedLight::Impl::go_on(const Job& job, const IBox& changed) {
  const IVec3 low = job.chunk * kChunkEdge;
  const IBox world{changed.min + low, changed.max + low};
  for (const Direction direction : kDirections) {
    const FaceFrame& frame = frame_of(direction);
    const bool is_up = frame.sign > 0;
    const bool touches =
        is_up ? changed.max[frame.axis] == job.box.max[frame.axis] : changed.min[frame.axis] == job.box.min[frame.axis];
    if (!touches) continue;
    IBox beyond = grown(world, kReach - 1);
    (is_up ? beyond.min : beyond.max)[frame.axis] = is_up ? world.max[frame.axis] : world.min[frame.axis];
    if (direction == Direction::NegY) beyond.min.y = std::min(beyond.min.y, (beyond.max.y - 1) & ~(kChunkEdge - 1));
    // No farther than the chunk beside it, whose own changes go on from there.
    const bool leaves = is_up ? job.box.max[frame.axis] == kChunkEdge : job.box.min[frame.axis] == 0;
    add_part(leaves ? job.chunk + normal_of(direction) : job.chunk, beyond);
  }
}

void PropagatedLight::Impl::run(const Grid& grid, Threads threads) {
  while (!queue.empty()) {
    std::vector<Job> jobs = next_jobs();
    parallel_for(jobs.size(), threads, [&](std::size_t i) {
      thread_local LightSolver solver;
      solve(grid, solver, jobs[i]);
    });
    for (const Job& job : jobs) {
      const IBox changed = job.changed.box();
      if (changed.empty()) continue;
      journal.note(job.light->serial, job.changed.record(job.chunk), levels.size());
      go_on(job, changed);
    }
  }
}

PropagatedLight::PropagatedLight(PropagatedLightOptions options) : impl_(std::make_unique<Impl>()) {
  impl_->options = std::move(options);
}
PropagatedLight::PropagatedLight(PropagatedLight&&) noexcept = default;
PropagatedLight& PropagatedLight::operator=(PropagatedLight&&) noexcept = default;
PropagatedLight::~PropagatedLight() = default;

void PropagatedLight::update(const Grid& grid, const VoxelRegistry& types, Threads threads) {
  Impl& me = *impl_;
  try {
    GridChanges changes = grid.changes_since(me.followed_grid);
    if (me.lights.empty() || types.has_changed_since(me.followed_types)) {
      me.followed_types = types.cursor();
      std::vector<TypeLight> lights = type_lights(types, me.options);
      // A type that was not registered was opaque: those that are new are others than before.
      changes.all |= lights != me.lights;
      me.lights = std::move(lights);
    }
    changes.all ? me.begin_anew(grid) : me.take_over(grid, changes);
    me.run(grid, threads);
  } catch (...) {
    me.followed_grid = {};
    throw;
  }
}

LightLevels PropagatedLight::at(IVec3 voxel) const {
  return unpacked_light(Impl::WordReader(*impl_).at(voxel));
}

void PropagatedLight::read_row(IVec3 voxel, std::span<std::uint16_t, kChunkEdge> out) const {
  const IVec3 chunk = chunk_of(voxel);
  if (!impl_->domain.holds(chunk)) {
    std::fill(out.begin(), out.end(), impl_->domain.beyond(chunk));
    return;
  }
  const ChunkLight* stored = impl_->stored(chunk);
  if (stored == nullptr) {
    std::fill(out.begin(), out.end(), std::uint16_t{0});
    return;
  }
  const IVec3 local = local_of(voxel);
  stored->read_row(local.y, local.z, out);
}

GridChanges PropagatedLight::changes_since(ChangeCursor& cursor) const {
  return impl_->journal.changes_since<ChunkChange>(cursor, by_chunk);
}

namespace {

// The light in front of a quad's faces: [u + width * v].
struct QuadLight {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> words;

  [[nodiscard]] std::uint16_t& at(int u, int v) { return words[static_cast<std::size_t>(u + width * v)]; }
  [[nodiscard]] bool is_uniform() const {
    return std::all_of(words.begin(), words.end(), [&](std::uint16_t word) { return word == words.front(); });
  }
  // How far the light of a cell goes on along u, and then along v.
  [[nodiscard]] std::pair<int, int> extent(int u, int v, const std::vector<bool>& done) {
    const std::uint16_t word = at(u, v);
    const auto is_free = [&](int x, int y) {
      return !done[static_cast<std::size_t>(x + width * y)] && at(x, y) == word;
    };
    int right = u + 1;
    while (right < width && is_free(right, v)) ++right;
    int top = v + 1;
    const auto is_row = [&](int y) {
      for (int x = u; x < right; ++x) {
        if (!is_free(x, y)) return false;
      }
      return true;
    };
    while (top < height && is_row(top)) ++top;
    return {right - u, top - v};
  }
};

}  // namespace

void PropagatedLight::split(const QuadBuffer& quads, IVec3 chunk, QuadBuffer& out,
                            std::vector<std::uint16_t>& light) const {
  out.clear();
  light.clear();
  Impl::WordReader words(*impl_);
  QuadLight of_quad;
  std::vector<bool> done;
  for (const Quad quad : quads) {
    const FaceFrame& frame = frame_of(quad.direction());
    const IVec3 first = chunk * kChunkEdge + quad.voxel() + normal_of(quad.direction());
    of_quad.width = quad.size_u();
    of_quad.height = quad.size_v();
    of_quad.words.clear();
    for (int v = 0; v < quad.size_v(); ++v) {
      for (int u = 0; u < quad.size_u(); ++u) {
        IVec3 at = first;
        at[frame.u] += u;
        at[frame.v] += v;
        of_quad.words.push_back(words.at(at));
      }
    }
    if (of_quad.is_uniform()) {
      out.push_back(quad);
      light.push_back(of_quad.words.front());
      continue;
    }
    done.assign(of_quad.words.size(), false);
    for (int v = 0; v < quad.size_v(); ++v) {
      for (int u = 0; u < quad.size_u(); ++u) {
        if (done[static_cast<std::size_t>(u + of_quad.width * v)]) continue;
        const auto [along_u, along_v] = of_quad.extent(u, v, done);
        for (int y = v; y < v + along_v; ++y) {
          for (int x = u; x < u + along_u; ++x) done[static_cast<std::size_t>(x + of_quad.width * y)] = true;
        }
        out.push_back(quad_part(quad, u, v, along_u, along_v));
        light.push_back(of_quad.at(u, v));
      }
    }
  }
}

std::size_t PropagatedLight::bytes() const {
  std::size_t sum = impl_->lights.capacity() * sizeof(TypeLight) + impl_->journal.bytes();
  for (const auto& [chunk, light] : impl_->levels) sum += sizeof(chunk) + light->bytes();
  return sum;
}

}  // namespace quoin

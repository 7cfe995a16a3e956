#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/store/world_saver.h>

#include "core/bytes/error_path.h"
#include "scene/hierarchy.h"
#include "store/scene/saver_state.h"
#include "store/world/part_text.h"
#include "store/world/world_changes.h"
#include "store/world/world_rules.h"

namespace quoin {

using namespace store;

namespace {

// Maximum number of damage lines, for readable reports on broken worlds.
constexpr std::size_t kMaxLines = 20;

/// Loads a world's parts and chunks into a scene.
class Load {
 public:
  enum class Chunks : std::uint8_t { All, None };

  Load(const WorldStore& world, Chunks chunks, LoadedScene& loaded, SaverState& state)
      : world_(world), wanted_(chunks), scene_(loaded.scene), loaded_(loaded), state_(state) {}

  Status run(Threads threads, const Progress& progress) {
    auto types = world_.types();
    if (!types) return types.error();
    scene_.types = std::move(*types);
    for (std::string& line : WorldParts::damage(world_)) add_line(std::move(line));
    const auto grids = world_.grids();
    if (!grids) return grids.error();
    std::size_t done = 0;
    for (const auto& [number, header] : *grids) {
      const auto share = [&] { return static_cast<double>(done) / static_cast<double>(grids->size()); };
      if (progress && !progress(share())) return make_error(ErrorCode::Cancelled, "cancelled", world_.path().string());
      if (auto read = read_grid(number, header, threads, progress, share()); !read) return read;
      ++done;
    }
    if (auto read = read_parts(); !read) return read;
    report_rest();
    remember();
    return {};
  }

 private:
  void add_line(std::string line) {
    if (lines_++ < kMaxLines) loaded_.warnings.push_back(std::move(line));
  }
  void report_rest() {
    if (lines_ > kMaxLines) {
      loaded_.warnings.push_back("and " + std::to_string(lines_ - kMaxLines) + " more (quoin world check)");
    }
  }

  Status read_grid(std::uint32_t number, const WorldGrid& header, Threads threads, const Progress& progress,
                   double share) {
    SceneGrid grid;
    grid.name = header.name;
    grid.pivot = header.pivot;
    grid.canvas = header.canvas;
    grid.field = DensityGrid(header.band);
    SavedGrid saved;
    saved.number = number;
    saved.header = header;
    if (wanted_ == Chunks::None) {
      grid.grid.make_partial();
      grid.field.make_partial();
      add_grid(number, std::move(grid), std::move(saved));
      return {};
    }
    bool is_cancelled = false;
    Status read =
        WorldParts::each_chunk(world_, number, 0, threads, [&](const ChunkAddress& place, Result<StoredChunk> chunk) {
          if (!chunk) {
            add_line(chunk.error().message);
            saved.unread.push_back(place.chunk);
            return true;
          }
          if (chunk->voxels.uniform() != kAir) grid.grid.put_chunk(place.chunk, std::move(chunk->voxels));
          if (chunk->densities) grid.field.put_chunk(place.chunk, std::move(*chunk->densities));
          is_cancelled = progress && (++chunks_ & 255U) == 0 && !progress(share);
          return !is_cancelled;
        });
    if (is_cancelled) return make_error(ErrorCode::Cancelled, "cancelled", world_.path().string());
    if (!read) {
      // If the tables themselves are damaged, the parts read so far are kept.
      if (read.error().code != ErrorCode::BadFormat) return read;
      saved.is_partly_read = true;
      add_line("grid " + std::to_string(number) + ": read in part: " + read.error().message);
    }
    add_grid(number, std::move(grid), std::move(saved));
    return {};
  }

  void add_grid(std::uint32_t number, SceneGrid grid, SavedGrid saved) {
    QUOIN_ASSERT(!handles_.contains(number), "each grid is loaded once");
    const GridHandle handle = scene_.add_grid(std::move(grid));
    handles_[number] = handle;
    state_.grids.emplace(handle, std::move(saved));
  }

  // Reads the parts of a kind; reports and skips damaged parts.
  template <class T, class Put>
  Status each(const char* kind, Put put) {
    return WorldParts::each(world_, kind, [&](const Part& part, bool is_sound) {
      const auto* const number = std::get_if<std::int64_t>(&part.key.id);
      const std::string name = name_of(part.key);
      const bool is_number = number != nullptr && *number >= 0 && *number <= kMaxPartNumber;
      if (is_number) last_[kind] = std::max(last_[kind], *number);
      if (is_number && kind == std::string_view(part::kLamp)) lamp_numbers_.push_back(*number);
      if (!is_sound || !is_number) {
        add_line(name + " is damaged");
        return;
      }
      auto content = part_from<T>(part.body, name);
      if (!content) {
        add_line(content.error().message);
        return;
      }
      put(*number, std::move(*content));
    });
  }

  Status read_parts() {
    if (auto read = read_hierarchy(); !read) return read;
    if (auto read = read_instances(); !read) return read;
    Status read = each<Lamp>(part::kLamp, [&](std::int64_t, Lamp lamp) { scene_.lamps.push_back(std::move(lamp)); });
    if (!read) return read;
    read = each<DVec3>(part::kSun, [&](std::int64_t, DVec3 sun) {
      if (sun != DVec3(0.0)) scene_.environment = Environment::natural(sun);
    });
    if (!read) return read;
    read = each<Environment>(part::kEnvironment, [&](std::int64_t, Environment environment) {
      scene_.environment = std::move(environment);
    });
    if (!read) return read;
    read = each<Camera>(part::kView, [&](std::int64_t, Camera camera) { loaded_.camera = camera; });
    if (!read) return read;
    return each<FileCamera>(part::kCamera, [&](std::int64_t, FileCamera camera) { loaded_.cameras.push_back(camera); });
  }

  Status read_hierarchy() {
    Status read = each<SceneLayer>(part::kLayer, [&](std::int64_t number, SceneLayer layer) {
      const LayerHandle handle = scene_.add_layer(std::move(layer));
      layers_[number] = handle;
      state_.layers.add(handle, number);
    });
    if (!read) return read;
    std::vector<std::pair<GroupHandle, std::int64_t>> parents;
    read = each<SceneFile::Group>(part::kGroup, [&](std::int64_t number, const SceneFile::Group& group) {
      const GroupHandle handle = scene_.add_group(
          {group.name, {}, named(layers_, group.layer), group.position, group.rotation, group.mirrored, group.visible});
      groups_[number] = handle;
      state_.groups.add(handle, number);
      if (group.parent) parents.emplace_back(handle, static_cast<std::int64_t>(*group.parent));
    });
    for (const auto& [handle, parent] : parents) {
      scene_.edit(handle).parent = named(groups_, static_cast<std::size_t>(parent));
    }
    return read;
  }

  Status read_instances() {
    return each<SceneFile::Placement>(part::kInstance, [&](std::int64_t number, const SceneFile::Placement& text) {
      QUOIN_ASSERT(text.grid.has_value(), "a placement that was read has a grid");
      const auto grid = handles_.find(static_cast<std::int64_t>(*text.grid));
      if (grid == handles_.end()) {
        add_line("instance " + std::to_string(number) + ": its grid is lost");
        return;
      }
      const InstanceHandle handle = scene_.add_instance(
          {text.name, grid->second, text.position, text.rotation, text.scale, text.mirrored, text.visible,
           named(groups_, text.group), named(layers_, text.layer), text.categories.value_or(Instance().categories)});
      state_.instances.add(handle, number);
    });
  }

  template <class T>
  static Handle<T> named(const std::map<std::int64_t, Handle<T>>& handles, std::optional<std::size_t> number) {
    if (!number) return {};
    const auto found = handles.find(static_cast<std::int64_t>(*number));
    return found == handles.end() ? Handle<T>{} : found->second;
  }

  void remember() {
    state_.scene = scene_.cursor();
    state_.types = scene_.types.cursor();
    for (auto& [handle, saved] : state_.grids) {
      const SceneGrid& grid = scene_.grids()[handle];
      saved.voxels = saved.data = grid.grid.cursor();
      saved.densities = grid.field.cursor();
    }
    // The numbers of damaged parts stay reserved.
    const auto after = [&](const char* kind) { return last_.contains(kind) ? last_[kind] + 1 : 0; };
    state_.instances.next = after(part::kInstance);
    state_.groups.next = after(part::kGroup);
    state_.layers.next = after(part::kLayer);
    state_.lamps = scene_.lamps;
    for (std::size_t i = 0; i < lamp_numbers_.size(); ++i) {
      state_.needs_lamp_save |= lamp_numbers_[i] != static_cast<std::int64_t>(i);
    }
    state_.needs_lamp_save |= lamp_numbers_.size() != scene_.lamps.size();
    state_.lamp_numbers = std::move(lamp_numbers_);
    state_.environment = scene_.environment;
    state_.view = {loaded_.camera, loaded_.cameras};
    state_.saved_cameras = loaded_.cameras.size();
    state_.is_begun = true;
  }

  const WorldStore& world_;
  const Chunks wanted_;
  Scene& scene_;
  LoadedScene& loaded_;
  SaverState& state_;
  std::map<std::int64_t, GridHandle> handles_;
  std::map<std::int64_t, LayerHandle> layers_;
  std::map<std::int64_t, GroupHandle> groups_;
  std::map<std::string, std::int64_t> last_;  // greatest number of each kind
  std::vector<std::int64_t> lamp_numbers_;
  std::size_t lines_ = 0;
  std::size_t chunks_ = 0;
};

Result<LoadedWorld> load(const WorldStore& world, Load::Chunks chunks, LoadedWorld result, SaverState& state,
                         const LoadOptions& options, Threads threads, const Progress& progress) {
  result.loaded.format = "world";
  Load load(world, chunks, result.loaded, state);
  if (auto done = load.run(threads, progress); !done) return with_path(Result<LoadedWorld>(done.error()), world.path());
  if (options.show_hidden) show_all(result.loaded.scene);
  return result;
}

}  // namespace

// The address of the saver's state is stable when the saver is moved.
Result<LoadedWorld> load_world(const WorldStore& world, const LoadOptions& options, Threads threads,
                               const Progress& progress) {
  LoadedWorld result;
  SaverState& state = result.saver.impl().state;
  return load(world, Load::Chunks::All, std::move(result), state, options, threads, progress);
}

Result<LoadedWorld> load_partial_world(const WorldStore& world, const LoadOptions& options) {
  LoadedWorld result;
  SaverState& state = result.saver.impl().state;
  return load(world, Load::Chunks::None, std::move(result), state, options, {}, {});
}

std::optional<std::uint32_t> WorldSaver::number_of(GridHandle grid) const {
  const auto found = impl_->state.grids.find(grid);
  return found == impl_->state.grids.end() ? std::nullopt : std::optional(found->second.number);
}

}  // namespace quoin

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include <quoin/io/block_packs.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "core/bytes/text.h"
#include "io/format_driver.h"
#include "io/scene_file/scene_parts.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

/// Renumbers types. Returns true if any number changed.
bool renumber(Chunk& chunk, const std::vector<VoxelType>& new_type_of) {
  bool is_same = true;
  for (const VoxelType type : chunk.types()) is_same = is_same && new_type_of[type] == type;
  if (is_same) return false;
  const Chunk before = chunk;
  std::array<VoxelType, kChunkEdge> row{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      chunk.read_row(y, z, row);
      for (VoxelType& type : row) type = new_type_of[type];
      chunk.write_row(y, z, row);
    }
  }
  before.for_each_data([&](IVec3 local, const VoxelData& data) { chunk.set_data(local, data); });
  chunk.compact();
  return true;
}

void renumber(SceneGrid& grid, const std::vector<VoxelType>& new_type_of) {
  for (const IVec3 at : grid.grid.chunks()) {
    Chunk chunk = *grid.grid.find_chunk(at);
    if (renumber(chunk, new_type_of)) grid.grid.put_chunk(at, std::move(chunk));
  }
  for (const IVec3 at : grid.field.chunks()) {
    DensityChunk chunk = *grid.field.find_chunk(at);
    if (renumber(chunk.materials(), new_type_of)) grid.field.put_chunk(at, std::move(chunk));
  }
}

/// A loaded file whose grids and layers were moved into the scene.
struct Body {
  struct Group {
    GroupHandle handle;  ///< in the file's own scene
    SceneGroup group;    ///< its parent in that scene, its layer in the new one
  };
  std::vector<Group> groups;  ///< parents come first
  std::vector<Instance> instances;
  std::vector<Lamp> lamps;
};

/// Moves the types and grids of a file's scene into `into`; returns their new handles.
Result<std::map<GridHandle, GridHandle>> take_over_grids(Scene& from, Scene& into) {
  std::vector<VoxelType> new_type_of = {kAir};
  for (std::size_t type = 1; type < from.types.size(); ++type) {
    const auto added = into.types.find_or_add(from.types[static_cast<VoxelType>(type)]);
    if (!added) return added.error();
    new_type_of.push_back(*added);
  }
  std::map<GridHandle, GridHandle> new_grid_of;
  for (const GridHandle handle : from.grids().handles()) {
    SceneGrid grid = std::move(from.edit(handle));
    renumber(grid, new_type_of);
    new_grid_of[handle] = into.add_grid(std::move(grid));
  }
  return new_grid_of;
}

/// Moves the grids and layers of a file's scene into `into`.
Result<Body> take_over(Scene& from, Scene& into) {
  auto new_grid_of = take_over_grids(from, into);
  if (!new_grid_of) return new_grid_of.error();
  // Layers without content are dropped: MagicaVoxel files have 8 or more.
  std::map<LayerHandle, LayerHandle> new_layer_of;
  const auto layer_of = [&](LayerHandle handle) {
    const SceneLayer* layer = from.layers().find(handle);
    if (layer == nullptr) return LayerHandle{};
    const auto [place, is_new] = new_layer_of.try_emplace(handle);
    if (is_new) place->second = into.add_layer(*layer);
    return place->second;
  };
  Body body;
  for (const GroupHandle handle : groups_from_top(from)) {
    SceneGroup group = from.groups()[handle];
    group.parent = parent_of(from, handle);
    group.layer = layer_of(group.layer);
    body.groups.push_back({handle, std::move(group)});
  }
  const std::vector<InstanceHandle> handles = from.instances().handles();
  for (const InstanceHandle handle : handles) {
    Instance instance = from.instances()[handle];
    instance.grid = new_grid_of->at(instance.grid);
    // If it is the only item, its groups are dropped but its layer stays.
    const SceneGroup* group = handles.size() == 1 ? from.groups().find(instance.group) : nullptr;
    if (group != nullptr) instance.visible = instance.visible && is_shown(from, *group);
    instance.layer = layer_of(instance.layer);
    body.instances.push_back(std::move(instance));
  }
  body.lamps = std::move(from.lamps);
  return body;
}

/// Returns the direction, or point, of a body under a placement of the body.
DVec3 placed_direction(DVec3 direction, const Instance& outer) {
  return outer.rotation * (direction * DVec3(outer.mirrored ? -1.0 : 1.0, 1.0, 1.0));
}
DVec3 placed_point(DVec3 point, const Instance& outer) {
  return outer.position + placed_direction(point * outer.voxel_size, outer);
}

/// Moves an instance or a group of a body by a placement of the body.
template <class Placed>
void put(const Instance& outer, Placed& placed) {
  const double side = outer.mirrored ? -1.0 : 1.0;
  placed.position = placed_point(placed.position, outer);
  // A mirror before a rotation is the mirrored rotation before the mirror.
  const DQuat q = placed.rotation;
  placed.rotation = outer.rotation * DQuat(q.w, q.x, side * q.y, side * q.z);
  placed.mirrored = placed.mirrored != outer.mirrored;
}

/// Moves a lamp of a body. Its brightness at the scaled distance is unchanged.
Lamp placed(const Lamp& inner, const Instance& outer) {
  Lamp lamp = inner;
  lamp.position = placed_point(inner.position, outer);
  lamp.direction = placed_direction(inner.direction, outer);
  lamp.intensity *= outer.voxel_size * outer.voxel_size;
  lamp.range *= outer.voxel_size;
  return lamp;
}

/// Moves an instance of a body by a placement of the body.
Instance placed(const Instance& inner, const Instance& outer, bool is_alone) {
  Instance instance = inner;
  put(outer, instance);
  instance.voxel_size = inner.voxel_size * outer.voxel_size;
  if (is_alone && !outer.name.empty()) {
    instance.name = outer.name;
  } else if (!outer.name.empty()) {
    instance.name = inner.name.empty() ? outer.name : outer.name + "/" + inner.name;
  }
  return instance;
}

/// The resource packs of a scene: LoadOptions::packs for its own types, below them the packs that it names for a file.
/// Each pack is in memory once. Limits: 2 GiB of zip files that the scene names, and 256 different lists of packs.
class ScenePacks {
 public:
  /// `path`: the scene file.
  ScenePacks(const std::filesystem::path& path, const LoadOptions& options) : path_(path), options_(options) {}

  /// Gives types of the scene itself their looks. Errors: those of BlockPacks::open.
  Status apply(VoxelRegistry& types) { return apply_stack({}, types); }

  /// Gives the types of a file that the scene names their looks. Leaves out packs that cannot be used, with a warning.
  /// Only the last place of a repeated pack counts. Errors: LimitExceeded for too many lists.
  Status apply(const SceneFile::Source& source, VoxelRegistry& types, LoadedScene& loaded) {
    std::vector<Named> usable;
    for (const SceneFile::Pack& pack : source.packs) {
      if (!options_.scene_packs) break;
      auto found = find(pack, loaded);
      if (found == nullptr) continue;
      std::erase_if(usable, [&](const Named& other) { return other.pack == found; });
      usable.push_back({std::move(found), printable(pack.file)});
    }
    return apply_stack(usable, types);
  }

  /// Adds a warning for each stack of packs that lacks something.
  void report(LoadedScene& loaded) const {
    for (const Stack& stack : stacks_) {
      const std::string line = to_string(stack.looks->report());
      if (!line.empty()) loaded.warnings.push_back(stack.names + line);
    }
  }

 private:
  using Pack = std::shared_ptr<BlockPacks>;
  enum class NamedBy : std::uint8_t { Options, Scene };
  struct Named {
    Pack pack;
    std::string name;
  };
  struct Stack {
    std::vector<Pack> packs;
    Pack looks;
    std::string names;  // of the scene's packs, each with a colon
  };
  struct Opened {
    Result<Pack> pack;
    std::optional<Result<std::string>> hash{};
  };

  Status apply_stack(const std::vector<Named>& of_scene, VoxelRegistry& types) {
    if (Status opened = open_options(); !opened) return opened;
    std::vector<Pack> packs = of_options_;
    std::string names;
    // A pack of the options is above the same pack of the scene.
    auto above = packs.begin();
    for (const Named& named : of_scene) {
      if (std::ranges::find(of_options_, named.pack) != of_options_.end()) continue;
      above = packs.insert(above, named.pack) + 1;
      names += named.name + ": ";
    }
    if (packs.empty()) return {};
    auto stack = std::ranges::find(stacks_, packs, &Stack::packs);
    if (stack == stacks_.end()) {
      if (stacks_.size() == kMaxStacks) {
        return make_error(ErrorCode::LimitExceeded, "the scene file has more than " + std::to_string(kMaxStacks) +
                                                        " different lists of resource packs");
      }
      Pack looks = BlockPacks::stacked(packs);
      stack = stacks_.insert(stacks_.end(), {std::move(packs), std::move(looks), std::move(names)});
    }
    stack->looks->apply(types);
    return {};
  }

  /// Opens the packs of the options, once.
  Status open_options() {
    if (has_options_) return {};
    for (const std::filesystem::path& path : options_.packs) {
      const Opened& opened = open(path, NamedBy::Options);
      if (!opened.pack) return opened.pack.error();
      std::erase(of_options_, *opened.pack);
      of_options_.push_back(*opened.pack);
    }
    if (!options_.pack_zips.empty()) {
      auto zips = BlockPacks::open(options_.pack_zips);
      if (!zips) return zips.error();
      of_options_.push_back(std::move(*zips));
    }
    has_options_ = true;
    return {};
  }

  /// Opens a pack, or returns it if it is open.
  Opened& open(const std::filesystem::path& path, NamedBy named_by) {
    std::error_code error;
    std::filesystem::path real = path == kBuiltinPack ? path : std::filesystem::canonical(path, error);
    if (error) real = path;
    const auto known = opened_.find(real);
    if (known != opened_.end()) return known->second;
    const bool is_zip = path != kBuiltinPack && std::filesystem::is_regular_file(real, error);
    const std::uint64_t size = is_zip ? std::filesystem::file_size(real, error) : 0;
    const bool counts = !error && named_by == NamedBy::Scene;  // users may name as many packs as they like
    if (counts && size > kMaxZipBytes - zip_bytes_) {
      return add(real, make_error(ErrorCode::LimitExceeded,
                                  "the packs of the scene file together have more than " +
                                      std::to_string(kMaxZipBytes) + " bytes",
                                  path.string()));
    }
    Opened& opened = add(real, BlockPacks::open(std::span(&path, 1)));
    if (opened.pack && counts) zip_bytes_ += size;
    return opened;
  }
  Opened& add(const std::filesystem::path& real, Result<Pack> pack) {
    return opened_.emplace(real, Opened{std::move(pack)}).first->second;
  }

  /// Returns a pack that can be used, else null and adds a warning when it is first asked for.
  Pack find(const SceneFile::Pack& pack, LoadedScene& loaded) {
    const auto [at, is_new] = found_.try_emplace({pack.file, pack.hash});
    if (!is_new) return at->second;
    auto found = check(pack);
    if (found) {
      at->second = std::move(*found);
    } else {
      loaded.warnings.push_back("cannot use the resource pack \"" + printable(pack.file) +
                                "\" of the scene file: " + to_string(found.error()));
      loaded.unused_packs.push_back(pack.file);
    }
    return at->second;
  }

  Result<Pack> check(const SceneFile::Pack& pack) {
    if (pack.file == kBuiltinPack) return open(kBuiltinPack, NamedBy::Scene).pack;
    const auto path = sidecar_path(path_, pack.file, options_.sidecar_files);
    if (!path) return path.error();
    Opened& opened = open(*path, NamedBy::Scene);
    if (!opened.pack || pack.hash.empty()) return opened.pack;
    if (!opened.hash) opened.hash = hash_of_pack(*path);
    const Result<std::string>& hash = *opened.hash;
    if (!hash) return hash.error();
    if (*hash == pack.hash) return opened.pack;
    return make_error(ErrorCode::BadFormat, "it has changed: its hash is " + *hash + ", not " + pack.hash +
                                                "; without \"hash\" the scene file accepts any content");
  }

  static constexpr std::uint64_t kMaxZipBytes = std::uint64_t{2} << 30;  // of all packs that the scene names
  static constexpr std::size_t kMaxStacks = 256;

  const std::filesystem::path& path_;
  const LoadOptions& options_;
  std::map<std::filesystem::path, Opened> opened_;             // by canonical path
  std::uint64_t zip_bytes_ = 0;                                // of the opened packs that only the scene names
  std::map<std::pair<std::string, std::string>, Pack> found_;  // by path and hash; null: cannot be used
  std::vector<Pack> of_options_;
  bool has_options_ = false;
  std::vector<Stack> stacks_;
};

Result<LoadedScene> put_together(SceneFile& file, const std::filesystem::path& path, const LoadOptions& options,
                                 Threads threads, const Progress& progress);

/// Parses a scene file that may be open. Errors name the file.
Result<SceneFile> parse_opened(const DetectedFile& file, Threads threads) {
  const auto opened = file.open();
  if (!opened) return opened.error();
  return read_whole(*opened, [&](std::span<const std::byte> text) { return parse_scene_file(text, threads); });
}

Result<LoadedScene> load_source(const std::filesystem::path& path, const LoadOptions& options, Threads threads,
                                const Progress& progress) {
  const auto detected = detect_file(path);
  if (!detected) return detected.error();
  LoadOptions taken_over = options;
  taken_over.keep_source = false;
  taken_over.sky_image = false;  // the environment is not taken over
  taken_over.packs.clear();      // ScenePacks gives types their looks
  taken_over.pack_zips.clear();
  if (detected->format == FileFormat::Scene) {
    auto file = parse_opened(*detected, threads);
    if (!file) return file.error();
    // References between scene files could be circular.
    if (!file->sources.empty()) {
      return make_error(ErrorCode::Unsupported,
                        "a scene file that references files cannot be referenced itself; save it as one file first",
                        path.string());
    }
    return with_path(put_together(*file, {}, taken_over, threads, progress), path);
  }
  return load_scene(*detected, taken_over, threads, progress);
}

using Bodies = std::map<std::string, Body, std::less<>>;

/// Reads the files that the scene file `path` references.
Result<Bodies> read_sources(const std::vector<SceneFile::Source>& sources, const std::filesystem::path& path,
                            const LoadOptions& options, Threads threads, ScenePacks& packs, LoadedScene& loaded,
                            const Progress& progress) {
  Bodies bodies;
  for (const SceneFile::Source& source : sources) {
    const auto share = [&](std::size_t read) {
      return static_cast<double>(read) / static_cast<double>(sources.size());
    };
    const Progress of_source = part_of(progress, share(bodies.size()), share(bodies.size() + 1));
    const auto file = sidecar_path(path, source.file, options.sidecar_files);
    auto part = file ? load_source(*file, options, threads, of_source) : Result<LoadedScene>(file.error());
    if (!part) {
      Error error = part.error();
      error.message += " (source \"" + printable(source.id) + "\" of the scene file)";
      return error;
    }
    for (const std::string& warning : part->warnings) loaded.warnings.push_back(source.file + ": " + warning);
    if (Status applied = packs.apply(source, part->scene.types, loaded); !applied) return applied.error();
    auto body = take_over(part->scene, loaded.scene);
    if (!body) return body.error();
    bodies.emplace(source.id, std::move(*body));
    loaded.named_files.push_back(*file);
  }
  return bodies;
}

/// Makes a scene of the file's own content; instances are added later.
LoadedScene begin_scene(SceneFile& file, std::vector<GridHandle>& grids) {
  LoadedScene loaded;
  loaded.format = "scene";
  loaded.scene.environment = std::move(file.environment);
  loaded.camera = file.camera;
  if (file.camera) loaded.cameras.push_back({0, *file.camera});
  loaded.scene.types = std::move(file.types);
  loaded.scene.lamps = std::move(file.lamps);
  for (SceneGrid& grid : file.grids) grids.push_back(loaded.scene.add_grid(std::move(grid)));
  return loaded;
}

/// Places a file's content, after its grids are in the scene.
class Placer {
 public:
  Placer(const SceneFile& file, const std::vector<GridHandle>& grids, const Bodies& bodies, Scene& scene)
      : file_(file), grids_(grids), bodies_(bodies), scene_(scene) {}

  void place() {
    for (const SceneLayer& layer : file_.layers) layers_.push_back(scene_.add_layer(layer));
    for (const SceneFile::Group& entry : file_.groups) {
      SceneGroup group = entry.group;
      group.parent = named(groups_, entry.parent);
      group.layer = named(layers_, entry.layer);
      groups_.push_back(scene_.add_group(std::move(group)));
    }
    for (const SceneFile::Placement& placement : file_.placements) {
      Instance instance = placement.instance;
      instance.grid = named(grids_, placement.grid);
      instance.group = named(groups_, placement.group);
      instance.layer = named(layers_, placement.layer);
      if (placement.grid) {
        scene_.add_instance(std::move(instance));
      } else {
        place_body(instance, placement.sets_categories, bodies_.at(placement.source));
      }
    }
  }

 private:
  template <class T>
  static Handle<T> named(const std::vector<Handle<T>>& handles, const std::optional<std::size_t>& place) {
    return place ? handles[*place] : Handle<T>{};
  }

  void place_body(const Instance& outer, bool sets_categories, const Body& body) {
    if (outer.visible) {
      for (const Lamp& lamp : body.lamps) scene_.lamps.push_back(placed(lamp, outer));
    }
    if (body.instances.size() == 1) {
      Instance instance = placed(body.instances.front(), outer, true);
      instance.visible = instance.visible && outer.visible;
      instance.group = outer.group;
      if (outer.layer != LayerHandle{}) instance.layer = outer.layer;
      if (sets_categories) instance.categories = outer.categories;
      scene_.add_instance(std::move(instance));
      return;
    }
    const GroupHandle whole = scene_.add_group(
        {outer.name, outer.group, outer.layer, outer.position, outer.rotation, outer.mirrored, outer.visible});
    std::map<GroupHandle, GroupHandle> new_group_of;
    const auto group_of = [&](GroupHandle handle) {
      const auto found = new_group_of.find(handle);
      return found == new_group_of.end() ? whole : found->second;
    };
    for (const Body::Group& inner : body.groups) {
      SceneGroup group = inner.group;
      group.parent = group_of(group.parent);
      put(outer, group);
      new_group_of[inner.handle] = scene_.add_group(std::move(group));
    }
    for (const Instance& inner : body.instances) {
      Instance instance = placed(inner, outer, false);
      instance.group = group_of(inner.group);
      if (sets_categories) instance.categories = outer.categories;
      scene_.add_instance(std::move(instance));
    }
  }

  const SceneFile& file_;
  const std::vector<GridHandle>& grids_;
  const Bodies& bodies_;
  Scene& scene_;
  std::vector<LayerHandle> layers_;
  std::vector<GroupHandle> groups_;
};

/// `path`: the scene file, whose folder source paths are relative to.
Result<LoadedScene> put_together(SceneFile& file, const std::filesystem::path& path, const LoadOptions& options,
                                 Threads threads, const Progress& progress) {
  std::vector<GridHandle> grids;
  LoadedScene loaded = begin_scene(file, grids);
  ScenePacks packs(path, options);
  if (Status applied = packs.apply(loaded.scene.types); !applied) return applied.error();
  const auto bodies = read_sources(file.sources, path, options, threads, packs, loaded, progress);
  if (!bodies) return bodies.error();
  packs.report(loaded);
  Placer(file, grids, *bodies, loaded.scene).place();
  if (std::optional<Environment>& environment = loaded.scene.environment) {
    std::string warning = scene_json::read_sky_image(path, options, environment->sky);
    if (!warning.empty()) loaded.warnings.push_back(std::move(warning));
  }
  if (options.show_hidden) show_all(loaded.scene);
  return loaded;
}

/// Reads a scene file and all files that it names. Each file is read once, however often it is placed. The instances of
/// a named file are placed as one body; several instances become a group. Types that equal an existing type in every
/// property are merged with it. Warns of an unreadable sky image.
///
/// Errors: those of `parse_scene_file` and of reading the named files (with their paths); Unsupported if a named file
///         is a scene file that names files itself, and for named files without a path; LimitExceeded if all files
///         together have more types than a registry holds.
Result<LoadedScene> read_scene_file(const FormatInput& input) {
  auto file = parse_scene_file(input.bytes, input.threads);
  if (!file) return file.error();
  if (input.path.empty() && !file->sources.empty()) {
    return make_error(ErrorCode::Unsupported, "the scene file references other files; load it by path, not from bytes");
  }
  return put_together(*file, input.path, input.options, input.threads, input.progress);
}

}  // namespace

std::vector<std::filesystem::path> files_named_in_scene(const DetectedFile& from, SidecarFiles allowed) {
  const auto file = parse_opened(from, {});
  std::vector<std::filesystem::path> named;
  if (!file) return named;
  const auto add = [&](const std::string& name) {
    if (auto found = sidecar_path(from.path, name, allowed)) named.push_back(std::move(*found));
  };
  for (const SceneFile::Source& source : file->sources) {
    add(source.file);
    for (const SceneFile::Pack& pack : source.packs) {
      if (pack.file != kBuiltinPack) add(pack.file);
    }
  }
  if (file->environment && lacks_image(file->environment->sky)) add(file->environment->sky.image_file);
  return named;
}

Result<SceneFile::Pack> scene_pack_of(const std::filesystem::path& pack, const std::filesystem::path& scene_path) {
  auto hash = hash_of_pack(pack);
  if (!hash) return hash.error();
  std::error_code failed;
  const std::filesystem::path whole = std::filesystem::canonical(pack, failed);
  if (failed) return make_error(ErrorCode::CannotRead, failed.message(), pack.string());
  std::filesystem::path folder = std::filesystem::absolute(scene_path, failed).parent_path();
  if (!failed) folder = std::filesystem::weakly_canonical(folder, failed);
  const std::filesystem::path relative = failed ? std::filesystem::path() : whole.lexically_relative(folder);
  return SceneFile::Pack{(relative.empty() ? whole : relative).generic_string(), std::move(*hash)};
}

extern constinit const FormatDriver kSceneFormat = {
    .info = {FileFormat::Scene, ".json", "Quoin scene file",
             FormatCapability::Read | FormatCapability::Write | FormatCapability::Fields | FormatCapability::Faces |
                 FormatCapability::Environment | FormatCapability::Camera},
    .detect = is_scene_file,
    .read = read_scene_file,
    .applies_packs = true,
    .sidecar_files = files_named_in_scene,
    .write = [](const FormatOutput& output, const std::filesystem::path& path) -> Result<SavedScene> {
      auto file = scene_file_of(output.scene);
      if (!file) return file.error();
      if (output.loaded != nullptr) file->camera = output.loaded->camera;
      const auto bytes = write_scene_file(*file, path, output.threads, output.progress);
      if (!bytes) return bytes.error();
      return SavedScene{*bytes, {}};
    },
};

}  // namespace quoin

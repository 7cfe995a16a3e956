#include <array>
#include <map>
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
class ScenePacks {
 public:
  /// `path`: the scene file.
  ScenePacks(const std::filesystem::path& path, const LoadOptions& options) : path_(path), options_(options) {}

  /// Gives types of the scene itself their looks. Errors: those of BlockPacks::open.
  Status apply(VoxelRegistry& types) { return apply_stack({}, "", types); }

  /// Gives the types of a file that the scene names their looks. Leaves out packs that cannot be used, with a warning.
  Status apply(const SceneFile::Source& source, VoxelRegistry& types, LoadedScene& loaded) {
    std::vector<std::filesystem::path> usable;
    std::string names;
    for (const SceneFile::Pack& pack : source.packs) {
      if (!options_.scene_packs) break;
      auto found = find(pack, loaded);
      if (!found) continue;
      usable.push_back(std::move(*found));
      names += printable(pack.file) + ": ";
    }
    return apply_stack(std::move(usable), names, types);
  }

  /// Adds a warning for each stack of packs that lacks something.
  void report(LoadedScene& loaded) const {
    for (const auto& [list, stack] : opened_) {
      const std::string line = stack.packs == nullptr ? "" : to_string(stack.packs->report());
      if (!line.empty()) loaded.warnings.push_back(stack.names + line);
    }
  }

 private:
  struct Stack {
    std::shared_ptr<BlockPacks> packs = nullptr;  // null: none
    std::string names{};                          // of the scene's packs, each with a colon
  };

  Status apply_stack(std::vector<std::filesystem::path> paths, const std::string& names, VoxelRegistry& types) {
    paths.insert(paths.end(), options_.packs.begin(), options_.packs.end());
    const auto [at, is_new] = opened_.try_emplace(paths);
    Stack& stack = at->second;
    if (is_new && !(paths.empty() && options_.pack_zips.empty())) {
      auto packs = BlockPacks::open(paths, options_.pack_zips);
      if (!packs) return packs.error();
      stack = {std::move(*packs), names};
    }
    if (stack.packs != nullptr) stack.packs->apply(types);
    return {};
  }

  /// Returns the path of a pack that can be used, else nullopt and adds a warning when it is first asked for.
  std::optional<std::filesystem::path> find(const SceneFile::Pack& pack, LoadedScene& loaded) {
    const auto [at, is_new] = found_.try_emplace({pack.file, pack.hash});
    if (!is_new) return at->second;
    auto path = check(pack);
    if (path) {
      at->second = std::move(*path);
    } else {
      loaded.warnings.push_back("cannot use the resource pack \"" + printable(pack.file) +
                                "\" of the scene file: " + to_string(path.error()));
      loaded.unused_packs.push_back(pack.file);
    }
    return at->second;
  }

  [[nodiscard]] Result<std::filesystem::path> check(const SceneFile::Pack& pack) const {
    if (pack.file == kBuiltinPack) return std::filesystem::path(kBuiltinPack);
    auto path = sidecar_path(path_, pack.file, options_.sidecar_files);
    if (!path) return path;
    if (pack.hash.empty()) {
      const auto opened = BlockPacks::open(std::span(&*path, 1));
      return opened ? path : opened.error();
    }
    const auto hash = hash_of_pack(*path);
    if (!hash) return hash.error();
    if (*hash == pack.hash) return path;
    return make_error(ErrorCode::BadFormat, "it has changed: its hash is " + *hash + ", not " + pack.hash +
                                                "; without \"hash\" the scene file accepts any content");
  }

  const std::filesystem::path& path_;
  const LoadOptions& options_;
  std::map<std::vector<std::filesystem::path>, Stack> opened_;
  std::map<std::pair<std::string, std::string>, std::optional<std::filesystem::path>> found_;  // by path and hash
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

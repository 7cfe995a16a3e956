#include "io/vox/vox_reader.h"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/io/vox.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/vox/chunks.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

// Scattered voxels need up to a few hundred times their four bytes in the file. Grids may use this much memory, plus a
// multiple of the file's size; real files stay far below.
constexpr std::size_t kFreeGridBytes = std::size_t{256} << 20;
constexpr std::size_t kGridBytesPerFileByte = 64;

Result<SceneGrid> grid_of(std::span<const std::byte> file, vox::Model model, vox::ModelBuilder& builder) {
  if (model.packed_end == 0) return builder.build(model);
  const auto voxels = vox::unpack_voxels(file, model);
  if (!voxels) return voxels.error();
  model.voxels = *voxels;
  return builder.build(model);
}

Result<std::vector<GridHandle>> add_grids(const vox::Document& document, vox::ModelBuilder& builder,
                                          std::span<const std::byte> file, const Progress& progress, Scene& scene) {
  const std::size_t max_bytes = kFreeGridBytes + kGridBytesPerFileByte * file.size();
  std::size_t grid_bytes = 0;
  std::vector<GridHandle> handles;
  handles.reserve(document.models.size());
  for (const vox::Model& model : document.models) {
    auto grid = grid_of(file, model, builder);
    if (!grid) return grid.error();
    grid_bytes += grid->grid.bytes();
    if (grid_bytes > max_bytes) {
      return make_error(ErrorCode::LimitExceeded, "scattered voxels need far more memory than the file has bytes", {},
                        model.offset);
    }
    handles.push_back(scene.add_grid(std::move(*grid)));
    const double share = static_cast<double>(handles.size()) / static_cast<double>(document.models.size());
    if (progress && !progress(share)) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return handles;
}

template <class Placed>
void put_place(const vox::Motion& motion, Placed& out) {
  const vox::InstanceTurn turn = vox::turn_from_orientation(motion.orientation);
  const vox::Offset position = vox::quoin_from_vox(motion.translation);
  for (int axis = 0; axis < 3; ++axis) {
    out.position[axis] = static_cast<double>(position[static_cast<std::size_t>(axis)]);
  }
  out.rotation = turn.rotation;
  out.mirrored = turn.mirrored;
}

/// Layers by id. Among layers of equal id, a hidden one takes precedence.
using LayersById = std::map<std::int32_t, LayerHandle>;

LayersById add_layers(VoxSource& source, Scene& scene) {
  LayersById by_id;
  const std::vector<vox::Layer>& layers = source.document.layers;
  source.layer_of.assign(layers.size(), vox::kNone);
  if (layers.size() == 1 && layers[0].name.empty() && !layers[0].hidden) return by_id;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const LayerHandle handle = scene.add_layer({printable(layers[i].name), !layers[i].hidden});
    source.layer_of[i] = handle.index;
    const auto [known, is_new] = by_id.try_emplace(layers[i].id, handle);
    if (!is_new && layers[i].hidden) known->second = handle;
  }
  return by_id;
}

LayerHandle layer_named(const LayersById& layers, std::int32_t id) {
  const auto found = layers.find(id);
  return found == layers.end() ? LayerHandle{} : found->second;
}

std::vector<GroupHandle> add_groups(const vox::Placements& placements, const LayersById& layers, Scene& scene) {
  std::vector<GroupHandle> handles;
  handles.reserve(placements.groups.size());
  for (const vox::PlacedNode& placed : placements.groups) {
    SceneGroup group;
    group.name = printable(placed.name);
    if (placed.parent != vox::kNone) group.parent = handles[placed.parent];
    group.layer = layer_named(layers, placed.layer);
    put_place(placed.world, group);
    group.visible = !placed.hidden;
    handles.push_back(scene.add_group(std::move(group)));
  }
  return handles;
}

/// Adds the instances. Names a grid after its shape, else after its first instance with a name.
void add_instances(const vox::Placements& placements, const std::vector<GridHandle>& grids, const LayersById& layers,
                   Scene& scene) {
  const std::vector<GroupHandle> groups = add_groups(placements, layers, scene);
  for (const vox::PlacedShape& placement : placements.all) {
    Instance instance;
    instance.name = printable(placement.name);
    instance.grid = grids[placement.model];
    put_place(placement.world, instance);
    instance.visible = !placement.hidden;
    if (placement.parent != vox::kNone) instance.group = groups[placement.parent];
    instance.layer = layer_named(layers, placement.layer);
    scene.add_instance(std::move(instance));
    std::string& name = scene.edit(grids[placement.model]).name;
    if (name.empty()) name = printable(placement.shape_name);
  }
  for (const vox::PlacedShape& placement : placements.all) {
    std::string& name = scene.edit(grids[placement.model]).name;
    if (name.empty()) name = printable(placement.name);
  }
}

void warn(const std::string& of_what, std::int64_t count, std::vector<std::string>& warnings) {
  if (count > 0) warnings.push_back(of_what + ": " + std::to_string(count));
}

void add_warnings(const vox::Placements& placements, const vox::ModelOmissions& losses,
                  std::vector<std::string>& warnings) {
  warnings.insert(warnings.end(), placements.warnings.begin(), placements.warnings.end());
  warn("voxels outside their model's size skipped", losses.outside, warnings);
  warn("voxels of colour 0, which is air, skipped", losses.colourless, warnings);
  warn("models without a placement", std::ranges::count(placements.is_model_used, false), warnings);
}

}  // namespace

Result<LoadedScene> read_vox(std::span<const std::byte> bytes, const LoadOptions& options, const Progress& progress) {
  const auto source = std::make_shared<VoxSource>();
  if (options.keep_source) {
    source->bytes.assign(bytes.begin(), bytes.end());
    bytes = source->bytes;
  }
  Result<vox::Document> document = vox::parse_document(bytes);
  if (!document) return document.error();
  source->document = std::move(*document);
  source->frame = options.frame;
  Result<vox::Placements> placements = vox::place_models(source->document, options.frame, bytes.size());
  if (!placements) return placements.error();
  source->placements = std::move(*placements);

  LoadedScene loaded;
  loaded.format = "vox";
  loaded.warnings = source->document.warnings;
  if (vox::is_animated(source->document)) loaded.last_frame = vox::last_frame(source->document);
  source->type_of = vox::types_by_colour_index(source->document, loaded.warnings);
  if (Status status = vox::register_palette(source->document, source->type_of, loaded.scene.types); !status) {
    return status.error();
  }
  vox::ModelBuilder builder(source->type_of);
  const Result<std::vector<GridHandle>> grids = add_grids(source->document, builder, bytes, progress, loaded.scene);
  if (!grids) return grids.error();
  add_instances(source->placements, *grids, add_layers(*source, loaded.scene), loaded.scene);
  loaded.cameras = vox::cameras_of(source->document, loaded.scene.bounds(InstanceFilter::All), loaded.warnings);
  loaded.render_settings = vox::render_settings_of(source->document);
  warn("materials without a colour skipped", source->document.stray_materials, loaded.warnings);
  add_warnings(source->placements, builder.losses(), loaded.warnings);
  if (options.keep_source) {
    source->scene = loaded.scene.snapshot();
    loaded.source = source;
  }
  if (options.show_hidden) show_all(loaded.scene);
  return loaded;
}

Result<Scene> scene_at_frame(const VoxSource& source, int frame) {
  const auto placements = vox::place_models(source.document, frame, source.bytes.size());
  if (!placements) return placements.error();
  Scene scene = source.scene.snapshot();
  const std::vector<InstanceHandle> instances = scene.instances().handles();
  const std::vector<GroupHandle> groups = scene.groups().handles();
  const std::vector<GridHandle> grids = scene.grids().handles();
  QUOIN_ASSERT(placements->all.size() == instances.size() && placements->groups.size() == groups.size(),
               "frames must differ only in placements and models");
  for (std::size_t i = 0; i < instances.size(); ++i) {
    Instance& instance = scene.edit(instances[i]);
    const vox::PlacedShape& placement = placements->all[i];
    instance.grid = grids[placement.model];
    put_place(placement.world, instance);
  }
  for (std::size_t i = 0; i < groups.size(); ++i) put_place(placements->groups[i].world, scene.edit(groups[i]));
  return scene;
}

Result<LoadedScene> read_vox(const std::filesystem::path& path, const LoadOptions& options, const Progress& progress) {
  return read_whole(path, [&](std::span<const std::byte> bytes) { return read_vox(bytes, options, progress); });
}

namespace {

/// Returns a display name for chunks without a place in a scene; "" for chunks that a scene represents.
std::string kept_as(std::string_view id) {
  if (id == "rCAM") return "cameras";
  if (id == "rOBJ") return "render settings";
  if (id == "NOTE") return "notes";
  // IMAP is stored as the order of the types, META as the frame range.
  if (id == "IMAP" || id == "META" || id == "MATL" || id == "MATT") return {};
  return "chunks " + printable(id);
}

}  // namespace

std::vector<std::string> source_only_features(const VoxSource& source) {
  std::vector<std::string> lines;
  if (vox::is_animated(source.document)) {
    lines.push_back("animation: frames 0 to " + std::to_string(vox::last_frame(source.document)));
  }
  std::map<std::string, int> counts;
  for (const vox::ChunkSpan& place : source.document.chunks) {
    if (place.kind != vox::ChunkKind::Other) continue;
    QUOIN_ASSERT(place.begin + vox::kChunkHeaderBytes <= source.bytes.size(), "a chunk of the file");
    const std::string_view id(reinterpret_cast<const char*>(source.bytes.data()) + place.begin, 4);
    std::string kept = kept_as(id);
    if (!kept.empty()) ++counts[std::move(kept)];
  }
  for (const auto& [kept, count] : counts) lines.push_back(kept + ": " + std::to_string(count));
  return lines;
}

}  // namespace quoin

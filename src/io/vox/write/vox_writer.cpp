#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/io/vox.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/format_driver.h"
#include "io/vox/chunks.h"
#include "io/vox/vox_reader.h"
#include "io/vox/write/graph_revision.h"
#include "io/vox/write/node_content.h"
#include "io/vox/write/vox_parts.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

// Rejects density fields, so that they are not lost silently.
Status check_has_no_field(const SceneGrid& grid) {
  if (grid.field.chunk_count() == 0) return {};
  return make_error(ErrorCode::Unsupported, "grid \"" + grid.name + "\" is a density field, which .vox cannot store");
}

constexpr std::uint32_t kVersion = 150;
constexpr std::uint32_t kGone = std::numeric_limits<std::uint32_t>::max();
// The offsets of MAIN's two sizes in a file, after its name, its version and MAIN's id.
constexpr std::size_t kContentOfMain = 12;
constexpr std::size_t kChildrenOfMain = 16;

/// An empty file: the source of scenes that were not read from a file.
const VoxSource& no_source() {
  static const VoxSource source = [] {
    VoxSource empty;
    for (std::size_t i = 0; i < vox::kColours; ++i) empty.type_of[i] = static_cast<std::uint8_t>(i);
    return empty;
  }();
  return source;
}

/// The source chunks after which new chunks are written; kNone: before the first.
struct Anchors {
  std::size_t models = vox::kNone;
  std::size_t nodes = vox::kNone;
  std::size_t layers = vox::kNone;
  std::size_t palette = vox::kNone;
  std::size_t materials = vox::kNone;
};

Anchors anchors_of(const vox::Document& document) {
  Anchors last;
  for (std::size_t i = 0; i < document.chunks.size(); ++i) {
    switch (document.chunks[i].kind) {
      case vox::ChunkKind::ModelCount:
      case vox::ChunkKind::Size:
      case vox::ChunkKind::Voxels:
      case vox::ChunkKind::PackedVoxels:
        last.models = i;
        break;
      case vox::ChunkKind::Node:
        last.nodes = i;
        break;
      case vox::ChunkKind::Layer:
        last.layers = i;
        break;
      case vox::ChunkKind::Palette:
        last.palette = i;
        break;
      case vox::ChunkKind::Material:
        last.materials = i;
        break;
      case vox::ChunkKind::Other:
        break;
    }
  }
  const auto after = [](std::size_t place, std::size_t before) { return place == vox::kNone ? before : place; };
  last.nodes = after(last.nodes, last.models);
  last.layers = after(last.layers, last.nodes);
  last.palette = after(last.palette, last.layers);
  last.materials = after(last.materials, last.palette);
  return last;
}

struct Chunk {
  std::string_view id;
  std::vector<std::byte> content;
};

/// Rewrites a file with a scene's changes; for a scene without a file everything is new.
class Writer {
 public:
  Writer(const Scene& scene, const VoxSource& source, const Progress& progress = {})
      : scene_(scene), source_(source), progress_(progress) {}
  /// Also writes the data read with a scene.
  Writer(const LoadedScene& loaded, const VoxSource& source, const Progress& progress = {})
      : Writer(loaded.scene, source, progress) {
    view_ = vox::plan_view(loaded, source, is_new());
  }

  Result<VoxBytes> run();
  /// Returns only the warnings of `run`. Errors: as `run`, except for the size.
  Result<std::vector<std::string>> losses();

 private:
  [[nodiscard]] bool is_new() const { return &source_ == &no_source(); }
  Status plan();
  Status plan_types();
  Status plan_graph();
  void number_models();
  void renumber_shapes();
  [[nodiscard]] std::vector<bool> shown_models() const;
  [[nodiscard]] std::int64_t models_left_as_they_were() const;
  void warn(std::vector<std::string>& warnings) const;
  [[nodiscard]] std::vector<std::string> lost_with_graph() const;

  [[nodiscard]] std::size_t bytes_of_new_models() const;
  void write_chunks();
  void write_after(std::size_t chunk);
  void write_chunk(const vox::ChunkSpan& place);
  [[nodiscard]] std::optional<Chunk> revised(const vox::ChunkSpan& place);
  [[nodiscard]] std::optional<Chunk> revised_count(const vox::ChunkSpan& place) const;
  [[nodiscard]] std::optional<Chunk> revised_size(const vox::ChunkSpan& place) const;
  [[nodiscard]] std::optional<Chunk> revised_model(const vox::ChunkSpan& place);
  [[nodiscard]] std::optional<Chunk> revised_node(const vox::ChunkSpan& place) const;
  [[nodiscard]] std::optional<Chunk> revised_layer(const vox::ChunkSpan& place) const;
  [[nodiscard]] std::optional<Chunk> revised_material(const vox::ChunkSpan& place) const;
  [[nodiscard]] std::optional<Chunk> revised_palette(const vox::ChunkSpan& place) const;
  [[nodiscard]] std::optional<Chunk> revised_view(const vox::ChunkSpan& place);
  [[nodiscard]] bool is_removed(const vox::ChunkSpan& place) const;
  [[nodiscard]] std::string_view id_of(const vox::ChunkSpan& place) const;
  [[nodiscard]] std::span<const std::byte> payload_of(const vox::ChunkSpan& place) const;
  [[nodiscard]] const SceneLayer* layer_of(std::size_t number) const;
  [[nodiscard]] vox::Attributes material(std::size_t index) const;
  [[nodiscard]] bool has_changed_material(std::size_t index) const;
  [[nodiscard]] bool has_changed_colour() const;

  void note_model();
  void write_new_models();
  void write_new_nodes();
  void write_new_layers();
  void write_new_palette();
  void write_new_materials();
  void write_new_view();

  const Scene& scene_;
  const VoxSource& source_;
  const Progress progress_;
  std::size_t done_ = 0;  // grids done
  vox::RevisedTypes types_;
  vox::ModelPlan models_;
  vox::RevisedGraph graph_;
  vox::ViewPlan view_;
  std::vector<std::int32_t> written_cameras_;  // numbers in `view_` of cameras that replaced source chunks
  bool has_written_sun_ = false;               // true if a source chunk had the sun
  std::vector<std::string> lost_;              ///< data lost with the file's scene graph if it is rewritten
  std::vector<const vox::GridPlan*> plan_of_;  // by the source's models; null for removed models
  std::vector<std::uint32_t> number_of_;       // number of each model of the plan in the file; kGone for omitted models
  std::vector<bool> shown_;                    // by the plan's numbers: true if a shape shows the model at any frame
  std::uint32_t model_count_ = 0;
  std::array<std::size_t, vox::kColours> material_chunk_{};  // by colour index, the last chunk; kNone if there is none
  std::size_t palette_chunk_ = vox::kNone;
  Anchors anchors_;
  Status failure_;
  vox::ChunkWriter out_;
};

Status Writer::plan_types() {
  if (is_new()) {
    Result<vox::TypeTable> table = vox::make_type_table(scene_);
    if (!table) return table.error();
    types_.table = std::move(*table);
    return {};
  }
  Result<vox::RevisedTypes> types = vox::revise_type_table(scene_, source_);
  if (!types) return types.error();
  types_ = std::move(*types);
  return {};
}

Status Writer::plan_graph() {
  const bool has_nodes = !source_.document.nodes.empty();
  models_ = vox::plan_models(scene_, source_, has_nodes);
  if (!has_nodes && !is_new() && !vox::needs_graph(scene_, source_, models_)) {
    graph_ = vox::revise_layers(scene_, source_);
    return {};
  }
  Result<vox::RevisedGraph> graph = vox::revise_graph(scene_, source_, models_, has_nodes);
  if (!graph) return graph.error();
  if (graph->must_be_new) {
    lost_ = lost_with_graph();
    models_ = vox::plan_models(scene_, source_, false);
    graph = vox::revise_graph(scene_, source_, models_, false);
    if (!graph) return graph.error();
  }
  graph_ = std::move(*graph);
  return {};
}

/// Returns, by the plan's numbers, which models a shape of the new file shows at any frame.
std::vector<bool> Writer::shown_models() const {
  const vox::Document& document = source_.document;
  std::vector<bool> shown(std::size_t{models_.count} + 1);
  const auto show = [&](const vox::NodeContent& node) {
    for (const auto& [model, key] : node.models) shown[model] = true;
  };
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    const vox::Node& node = document.nodes[i];
    if (node.kind != vox::NodeKind::Shape || graph_.is_removed[i] || graph_.changed.contains(i)) continue;
    for (std::size_t key = 0; key < node.key_count; ++key)
      shown[document.model_keys[node.first_key + key].model] = true;
  }
  for (const auto& [place, node] : graph_.changed) {
    if (!graph_.is_removed[place]) show(node);
  }
  for (const vox::NodeContent& node : graph_.added) show(node);
  return shown;
}

/// Numbers the models. Omits models whose grid was removed or split, and that no shape shows any more.
void Writer::number_models() {
  shown_ = shown_models();
  const std::size_t known = source_.document.models.size();
  plan_of_.assign(known, nullptr);
  for (const vox::GridPlan& grid : models_.grids) {
    if (grid.source_model != vox::kNone) plan_of_[grid.source_model] = &grid;
  }
  number_of_.assign(shown_.size(), kGone);
  bool is_same = true;
  for (std::uint32_t model = 0; model < models_.count; ++model) {
    if (model < known && plan_of_[model] == nullptr && !shown_[model]) {
      is_same = false;
    } else {
      number_of_[model] = model_count_++;
    }
  }
  if (graph_.has_empty_model) number_of_[models_.count] = model_count_++;
  if (!is_same) renumber_shapes();
}

void Writer::renumber_shapes() {
  for (std::size_t i = 0; i < source_.document.nodes.size(); ++i) {
    const bool stays = source_.document.nodes[i].kind == vox::NodeKind::Shape && !graph_.is_removed[i];
    if (stays) graph_.changed.try_emplace(i, vox::node_of(source_, i));
  }
  const auto renumber = [&](vox::NodeContent& shape) {
    for (auto& [model, key] : shape.models) model = number_of_[model];
  };
  for (auto& [place, node] : graph_.changed) {
    if (!graph_.is_removed[place]) renumber(node);
  }
  for (vox::NodeContent& node : graph_.added) renumber(node);
}

Status Writer::plan() {
  for (const GridHandle handle : scene_.grids().handles()) {
    if (Status sound = check_has_no_field(scene_.grids()[handle]); !sound) return sound;
  }
  if (Status done = plan_types(); !done) return done;
  if (Status done = plan_graph(); !done) return done;
  number_models();
  anchors_ = anchors_of(source_.document);
  material_chunk_.fill(vox::kNone);
  for (std::size_t i = 0; i < source_.document.chunks.size(); ++i) {
    const vox::ChunkSpan& place = source_.document.chunks[i];
    if (place.kind == vox::ChunkKind::Material) material_chunk_[place.number] = i;
    if (place.kind == vox::ChunkKind::Palette) palette_chunk_ = i;
  }
  return {};
}

void Writer::warn(std::vector<std::string>& warnings) const {
  const auto count = [&](const char* of_what, std::int64_t number) {
    if (number > 0) warnings.push_back(std::string(of_what) + ": " + std::to_string(number));
  };
  count("instances rounded to whole voxels", graph_.rounded);
  count("instances more than 1,000 voxels from the origin, outside MagicaVoxel's world", graph_.beyond_limit);
  count("rotations of groups left out, not supported by .vox", graph_.turns_left_out);
  count("animation frames left out, since their model was removed", graph_.frames_left_out);
  count("models of other frames left unchanged, since they exceed 256 voxels", models_left_as_they_were());
  count("unused palette colours replaced by new ones", types_.replaced);
  count("lamps left out, not supported by .vox (.json stores them)", static_cast<std::int64_t>(scene_.lamps.size()));
  std::int64_t categories = 0;
  scene_.instances().for_each([&](InstanceHandle, const Instance& instance) {
    categories += instance.categories == Instance().categories ? 0 : 1;
  });
  std::int64_t with_data = 0;
  scene_.grids().for_each([&](GridHandle, const SceneGrid& grid) { with_data += grid.grid.data_count(); });
  count("data of voxels left out, not supported by .vox (.json stores it)", with_data);
  count("categories of instances left out, not supported by .vox (.json stores them)", categories);
  if (view_.has_more_settings) warnings.emplace_back("render settings left out, except the sun's");
  warnings.insert(warnings.end(), lost_.begin(), lost_.end());
}

/// Counts models of the file that shapes show only at frames outside the scene, and whose grids were split into pieces.
std::int64_t Writer::models_left_as_they_were() const {
  return std::ranges::count_if(models_.grids, [&](const vox::GridPlan& plan) {
    const bool was_model = plan.source_model == vox::kNone && source_.scene.grids().find(plan.grid) != nullptr;
    return was_model && !shown_[plan.first_model] && shown_[plan.grid.index];
  });
}

/// Lists the content of the file's nodes that scenes cannot hold.
std::vector<std::string> Writer::lost_with_graph() const {
  constexpr const char* kWhy = " left out: a node with several parents in the file's scene graph changed";
  std::vector<std::string> lost;
  if (vox::is_animated(source_.document)) lost.push_back(std::string("animation is") + kWhy);
  std::int64_t nodes = 0;
  for (std::size_t i = 0; i < source_.document.nodes.size(); ++i) {
    nodes += vox::says_more(vox::node_of(source_, i)) ? 1 : 0;
  }
  if (nodes > 0)
    lost.push_back("attributes of " + std::to_string(nodes) + " nodes that are unknown to Quoin are" + kWhy);
  if (source_.placements.nodes_apart > 0) {
    lost.push_back(std::to_string(source_.placements.nodes_apart) + " nodes outside the scene graph are" + kWhy);
  }
  return lost;
}

std::string_view Writer::id_of(const vox::ChunkSpan& place) const {
  return {reinterpret_cast<const char*>(source_.bytes.data()) + place.begin, 4};
}

std::span<const std::byte> Writer::payload_of(const vox::ChunkSpan& place) const {
  return std::span(source_.bytes).subspan(place.begin + vox::kChunkHeaderBytes, place.content_bytes);
}

/// Returns null if the scene no longer has the layer.
const SceneLayer* Writer::layer_of(std::size_t number) const {
  const std::size_t slot = source_.layer_of[number];
  return slot == vox::kNone ? nullptr : scene_.layers().find(handle_read(source_.scene.layers(), slot));
}

bool Writer::is_removed(const vox::ChunkSpan& place) const {
  switch (place.kind) {
    case vox::ChunkKind::Size:
    case vox::ChunkKind::Voxels:
    case vox::ChunkKind::PackedVoxels:
      return number_of_[place.number] == kGone;
    case vox::ChunkKind::Node:
      return graph_.is_removed[place.number];
    case vox::ChunkKind::Layer:
      return source_.layer_of[place.number] != vox::kNone && layer_of(place.number) == nullptr;
    case vox::ChunkKind::Other: {
      const auto camera = vox::camera_number(id_of(place), payload_of(place));
      return camera && std::ranges::find(view_.removed, *camera) != view_.removed.end();
    }
    default:
      return false;
  }
}

std::optional<Chunk> Writer::revised_count(const vox::ChunkSpan& place) const {
  if (place.content_bytes < 4 || model_count_ == source_.document.models.size()) return std::nullopt;
  vox::ChunkWriter content;
  content.u32(model_count_);
  content.raw(payload_of(place).subspan(4));
  return Chunk{"PACK", content.take()};
}

std::optional<Chunk> Writer::revised_size(const vox::ChunkSpan& place) const {
  const vox::GridPlan* plan = plan_of_[place.number];
  if (plan == nullptr || !plan->is_resized) return std::nullopt;
  vox::ChunkWriter content;
  const IVec3 size = plan->pieces.front().size;
  for (const int edge : {size.x, size.z, size.y}) content.i32(edge);
  content.raw(payload_of(place).subspan(12));
  return Chunk{"SIZE", content.take()};
}

std::optional<Chunk> Writer::revised_model(const vox::ChunkSpan& place) {
  const vox::GridPlan* plan = plan_of_[place.number];
  if (plan == nullptr || !plan->is_changed) return std::nullopt;
  auto content = vox::revised_voxels(scene_.grids()[plan->grid].grid, *plan, source_, types_.table.index_of_type);
  if (!content) {
    failure_ = content.error();
    return std::nullopt;
  }
  if (place.kind == vox::ChunkKind::Voxels) {
    // Bytes after the voxels in their chunk are kept.
    const std::size_t voxel_bytes = source_.document.models[place.number].voxels.size();
    const std::span<const std::byte> tail = payload_of(place).subspan(4 + voxel_bytes);
    content->insert(content->end(), tail.begin(), tail.end());
  }
  return Chunk{place.kind == vox::ChunkKind::Voxels ? "XYZI" : "TDCZ", std::move(*content)};
}

std::optional<Chunk> Writer::revised_node(const vox::ChunkSpan& place) const {
  const auto changed = graph_.changed.find(place.number);
  if (changed == graph_.changed.end()) return std::nullopt;
  vox::ChunkWriter content;
  vox::write_node(changed->second, content);
  return Chunk{vox::chunk_id(changed->second.kind), content.take()};
}

std::optional<Chunk> Writer::revised_layer(const vox::ChunkSpan& place) const {
  const SceneLayer* layer = layer_of(place.number);
  if (layer == nullptr) return std::nullopt;
  const vox::Layer& before = source_.document.layers[place.number];
  if (layer->name == printable(before.name) && layer->visible == !before.hidden) return std::nullopt;
  const std::span<const std::byte> bytes = payload_of(place);
  vox::ChunkReader reader(bytes, "LAYR", 0, 0, bytes.size());
  vox::ChunkWriter content;
  content.i32(reader.i32());
  vox::Entries attributes(reader.dict());
  if (layer->name != printable(before.name)) attributes.set_or_erase("_name", printable(layer->name));
  if (layer->visible == before.hidden) attributes.set_or_erase("_hidden", layer->visible ? "" : "1");
  content.dict(attributes.all());
  content.raw(reader.take(reader.remaining()));
  return Chunk{"LAYR", content.take()};
}

vox::Attributes Writer::material(std::size_t index) const {
  return vox::encode_material(vox::default_type_name(source_.type_of[index]), types_.table.by_index[index]);
}

bool Writer::has_changed_material(std::size_t index) const {
  const VoxelProperties& now = types_.table.by_index[index];
  if (is_new()) return !material(index).empty();
  const VoxelProperties& before = source_.scene.types[source_.type_of[index]];
  return now != before && material(index) != before.attributes;
}

std::optional<Chunk> Writer::revised_material(const vox::ChunkSpan& place) const {
  const std::size_t index = place.number;
  const auto chunk = static_cast<std::size_t>(&place - source_.document.chunks.data());
  if (index == 0 || material_chunk_[index] != chunk || !has_changed_material(index)) return std::nullopt;
  const std::span<const std::byte> bytes = payload_of(place);
  vox::ChunkReader reader(bytes, "MATL", 0, 0, bytes.size());
  vox::ChunkWriter content;
  content.i32(reader.i32());
  // MATT has no keys, so a MATL replaces it.
  vox::Attributes wanted = material(index);
  vox::ChunkWriter::Entries entries;
  const std::string_view id = id_of(place);
  if (id == "MATL") {
    for (const auto& [key, value] : reader.dict().entries) {
      const auto found = wanted.find(std::string(key));
      if (found == wanted.end()) continue;
      entries.emplace_back(found->first, found->second);
      wanted.erase(found);
    }
  }
  entries.insert(entries.end(), wanted.begin(), wanted.end());
  content.dict(entries);
  if (id == "MATL") content.raw(reader.take(reader.remaining()));
  return Chunk{"MATL", content.take()};
}

bool Writer::has_changed_colour() const {
  for (std::size_t index = 1; index < vox::kColours; ++index) {
    const Rgba8 now = types_.table.by_index[index].colour;
    const Rgba8 before = source_.scene.types[source_.type_of[index]].colour;
    if (now.r != before.r || now.g != before.g || now.b != before.b) return true;
  }
  return false;
}

std::optional<Chunk> Writer::revised_palette(const vox::ChunkSpan& place) const {
  const auto chunk = static_cast<std::size_t>(&place - source_.document.chunks.data());
  if (chunk != palette_chunk_ || !has_changed_colour()) return std::nullopt;
  const std::span<const std::byte> bytes = payload_of(place);
  std::vector<std::byte> content(bytes.begin(), bytes.end());
  content.resize(std::max(content.size(), vox::kColours * 4), std::byte{255});
  for (std::size_t index = 1; index < vox::kColours; ++index) {
    const Rgba8& colour = types_.table.by_index[index].colour;
    const std::size_t entry = 4 * (index - 1);
    content[entry] = std::byte{colour.r};
    content[entry + 1] = std::byte{colour.g};
    content[entry + 2] = std::byte{colour.b};
  }
  return Chunk{"RGBA", std::move(content)};
}

/// Returns the revised chunk of a camera or of the sun; nullopt if it is unchanged.
std::optional<Chunk> Writer::revised_view(const vox::ChunkSpan& place) {
  const std::span<const std::byte> bytes = payload_of(place);
  const auto number = vox::camera_number(id_of(place), bytes);
  const auto camera = number ? view_.cameras.find(*number) : view_.cameras.end();
  const bool is_sun = view_.sun && vox::is_sun(id_of(place), bytes);
  if (camera == view_.cameras.end() && !is_sun) return std::nullopt;
  vox::ChunkReader reader(bytes, id_of(place), place.begin, 0, bytes.size());
  vox::ChunkWriter content;
  if (!is_sun) content.i32(reader.i32());
  vox::Entries keys(reader.dict());
  if (is_sun) {
    vox::set_sun_keys(*view_.sun, keys);
    has_written_sun_ = true;
  } else {
    vox::set_camera_keys(camera->second, keys);
    written_cameras_.push_back(*number);
  }
  content.dict(keys.all());
  content.raw(reader.take(reader.remaining()));
  return Chunk{is_sun ? "rOBJ" : "rCAM", content.take()};
}

/// Returns the revised chunk; nullopt if it is unchanged.
std::optional<Chunk> Writer::revised(const vox::ChunkSpan& place) {
  switch (place.kind) {
    case vox::ChunkKind::ModelCount:
      return revised_count(place);
    case vox::ChunkKind::Size:
      return revised_size(place);
    case vox::ChunkKind::Voxels:
    case vox::ChunkKind::PackedVoxels:
      return revised_model(place);
    case vox::ChunkKind::Palette:
      return revised_palette(place);
    case vox::ChunkKind::Material:
      return revised_material(place);
    case vox::ChunkKind::Node:
      return revised_node(place);
    case vox::ChunkKind::Layer:
      return revised_layer(place);
    case vox::ChunkKind::Other:
      return revised_view(place);
  }
  return std::nullopt;
}

void Writer::write_chunk(const vox::ChunkSpan& place) {
  if (is_removed(place)) return;
  const std::optional<Chunk> now = revised(place);
  const bool has_voxels = place.kind == vox::ChunkKind::Voxels || place.kind == vox::ChunkKind::PackedVoxels;
  if (has_voxels && plan_of_[place.number] != nullptr) note_model();
  const std::span<const std::byte> file = source_.bytes;
  const std::size_t header_and_content = vox::kChunkHeaderBytes + place.content_bytes;
  if (!now) {
    out_.raw(file.subspan(place.begin, header_and_content + place.children_bytes));
    return;
  }
  const std::size_t chunk = out_.begin_chunk(now->id);
  out_.raw(now->content);
  out_.end_chunk(chunk, place.children_bytes);
  out_.raw(file.subspan(place.begin + header_and_content, place.children_bytes));
}

/// Reserves the memory of new models. Voxels dominate the file's size, so the output does not move as it grows.
std::size_t Writer::bytes_of_new_models() const {
  constexpr std::size_t kHeadBytes = 64;          // of a model's headers
  constexpr std::size_t kNodeBytes = 128;         // of a node with a short name
  constexpr std::size_t kPaletteBytes = 262'144;  // with materials
  std::size_t bytes = kPaletteBytes + kNodeBytes * graph_.added.size();
  for (const vox::GridPlan& plan : models_.grids) {
    if (plan.source_model != vox::kNone) continue;
    for (const vox::Piece& piece : plan.pieces) bytes += kHeadBytes + 4 * piece.voxels;
  }
  return bytes;
}

void Writer::note_model() {
  ++done_;
  const double share = static_cast<double>(done_) / static_cast<double>(models_.grids.size());
  if (failure_ && progress_ && !progress_(share)) failure_ = make_error(ErrorCode::Cancelled, "cancelled");
}

void Writer::write_new_models() {
  // Returns the offset of the voxels, which are written later.
  const auto begin_model = [&](IVec3 size, std::size_t voxels) {
    const std::size_t size_chunk = out_.begin_chunk("SIZE");
    for (const int edge : {size.x, size.z, size.y}) out_.i32(edge);
    out_.end_chunk(size_chunk);
    const std::size_t voxel_chunk = out_.begin_chunk("XYZI");
    out_.u32(static_cast<std::uint32_t>(voxels));
    const std::size_t start = out_.size();
    out_.leave(4 * voxels);
    out_.end_chunk(voxel_chunk);
    return start;
  };
  for (const vox::GridPlan& plan : models_.grids) {
    if (plan.source_model != vox::kNone) continue;
    if (!failure_) return;
    std::vector<std::size_t> starts;
    for (const vox::Piece& piece : plan.pieces) starts.push_back(begin_model(piece.size, piece.voxels));
    vox::write_voxels(scene_.grids()[plan.grid].grid, types_.table.index_of_type, plan.pieces, starts, out_.bytes());
    note_model();
  }
  if (graph_.has_empty_model) static_cast<void>(begin_model(IVec3(1), 0));
}

void Writer::write_new_nodes() {
  for (const vox::NodeContent& node : graph_.added) {
    const std::size_t chunk = out_.begin_chunk(vox::chunk_id(node.kind));
    vox::write_node(node, out_);
    out_.end_chunk(chunk);
  }
}

void Writer::write_new_layers() {
  const auto write = [&](std::int32_t id, const SceneLayer& layer) {
    vox::Entries attributes;
    attributes.set_or_erase("_name", printable(layer.name));
    if (!layer.visible) attributes.set("_hidden", "1");
    const std::size_t chunk = out_.begin_chunk("LAYR");
    out_.i32(id);
    out_.dict(attributes.all());
    out_.i32(-1);  // reserved
    out_.end_chunk(chunk);
  };
  if (graph_.adds_only_layer) write(0, {});
  scene_.layers().for_each([&](LayerHandle handle, const SceneLayer& layer) {
    const bool was_there = source_.scene.layers().find(handle) != nullptr &&
                           std::ranges::find(source_.layer_of, std::size_t{handle.index}) != source_.layer_of.end();
    if (!was_there) write(graph_.layer_ids[handle.index], layer);
  });
}

void Writer::write_new_palette() {
  if (palette_chunk_ != vox::kNone || !(is_new() || has_changed_colour())) return;
  const std::size_t chunk = out_.begin_chunk("RGBA");
  for (std::size_t index = 1; index < vox::kColours; ++index) {
    const Rgba8& colour = types_.table.by_index[index].colour;
    out_.raw(std::array{std::byte{colour.r}, std::byte{colour.g}, std::byte{colour.b}, std::byte{255}});
  }
  out_.u32(0);  // air's entry is last
  out_.end_chunk(chunk);
}

void Writer::write_new_materials() {
  for (std::size_t index = 1; index < vox::kColours; ++index) {
    if (material_chunk_[index] != vox::kNone || !has_changed_material(index)) continue;
    const vox::Attributes attributes = material(index);
    const std::size_t chunk = out_.begin_chunk("MATL");
    out_.i32(static_cast<std::int32_t>(index));
    out_.dict({attributes.begin(), attributes.end()});
    out_.end_chunk(chunk);
  }
}

/// Writes the cameras and sun that the source lacks.
void Writer::write_new_view() {
  const auto write = [&](std::string_view id, const vox::Entries& keys, const auto& write_number) {
    const std::size_t chunk = out_.begin_chunk(id);
    write_number();
    out_.dict(keys.all());
    out_.end_chunk(chunk);
  };
  if (view_.sun && !has_written_sun_) {
    vox::Entries keys;
    vox::set_sun_keys(*view_.sun, keys);
    write("rOBJ", keys, [] {});
  }
  for (const std::int32_t number : view_.order) {
    if (std::ranges::find(written_cameras_, number) != written_cameras_.end()) continue;
    vox::Entries keys;
    vox::set_camera_keys(view_.cameras.at(number), keys);
    write("rCAM", keys, [&] { out_.i32(number); });
  }
}

/// Writes new chunks after the last chunk of their kind.
void Writer::write_after(std::size_t chunk) {
  if (anchors_.models == chunk) write_new_models();
  if (anchors_.nodes == chunk) write_new_nodes();
  if (anchors_.layers == chunk) write_new_layers();
  if (anchors_.palette == chunk) write_new_palette();
  if (anchors_.materials == chunk) write_new_materials();
}

void Writer::write_chunks() {
  write_after(vox::kNone);
  for (std::size_t i = 0; i < source_.document.chunks.size() && failure_; ++i) {
    write_chunk(source_.document.chunks[i]);
    write_after(i);
  }
  write_new_view();
}

Result<VoxBytes> Writer::run() {
  if (Status planned = plan(); !planned) return planned.error();
  const std::span<const std::byte> file = source_.bytes;
  out_.reserve(file.size() + bytes_of_new_models());
  if (is_new()) {
    out_.text("VOX ");
    out_.u32(kVersion);
    static_cast<void>(out_.begin_chunk("MAIN"));
  } else {
    out_.raw(file.first(source_.document.chunks_begin));
  }
  const std::size_t begin = out_.size();
  write_chunks();
  if (!failure_) return failure_.error();
  if (out_.size() > std::numeric_limits<std::uint32_t>::max()) {
    return make_error(ErrorCode::LimitExceeded, "the scene needs more than the 4 GiB of a .vox file");
  }
  std::vector<std::string> warnings;
  warn(warnings);
  const auto before =
      file.subspan(source_.document.chunks_begin, source_.document.chunks_end - source_.document.chunks_begin);
  if (!is_new() && std::ranges::equal(out_.bytes().subspan(begin), before)) return VoxBytes{source_.bytes, warnings};
  out_.patch(kContentOfMain, source_.document.main_content);
  out_.patch(kChildrenOfMain, out_.size() - begin);
  out_.raw(file.subspan(source_.document.chunks_end));
  return VoxBytes{out_.take(), warnings};
}

Result<std::vector<std::string>> Writer::losses() {
  if (Status planned = plan(); !planned) return planned.error();
  std::vector<std::string> warnings;
  warn(warnings);
  return warnings;
}

Result<SavedScene> save(Result<VoxBytes> file, const std::filesystem::path& path) {
  if (!file) return with_path(Result<SavedScene>(file.error()), path);
  const auto bytes = write_whole(path, std::move(file->bytes));
  if (!bytes) return bytes.error();
  return SavedScene{*bytes, std::move(file->warnings)};
}

const VoxSource& source_of(const LoadedScene& loaded) {
  return loaded.source != nullptr ? *loaded.source : no_source();
}

const Scene& scene_in(const Scene& scene) {
  return scene;
}
const Scene& scene_in(const LoadedScene& loaded) {
  return loaded.scene;
}
const VoxSource& source_of(const Scene&) {
  return no_source();
}

/// `given`: a Scene, or a LoadedScene.
template <class Given>
Result<VoxBytes> write_any(const Given& given, const Progress& progress) {
  const auto voxel_size = vox::common_voxel_size(scene_in(given));
  if (!voxel_size) return Writer(given, source_of(given), progress).run();
  const Given unit = vox::divided(given, *voxel_size);
  auto written = Writer(unit, source_of(unit), progress).run();
  if (written) written->warnings.push_back(vox::size_warning(*voxel_size));
  return written;
}

template <class Given>
Result<std::vector<std::string>> unsupported_features_of(const Given& given) {
  const auto voxel_size = vox::common_voxel_size(scene_in(given));
  if (!voxel_size) return Writer(given, source_of(given)).losses();
  const Given unit = vox::divided(given, *voxel_size);
  auto lines = Writer(unit, source_of(unit)).losses();
  if (lines) lines->push_back(vox::size_warning(*voxel_size));
  return lines;
}

}  // namespace

Result<VoxBytes> write_vox(const Scene& scene, const Progress& progress) {
  return write_any(scene, progress);
}

Result<VoxBytes> write_vox(const LoadedScene& loaded, const Progress& progress) {
  return write_any(loaded, progress);
}

Result<SavedScene> write_vox(const Scene& scene, const std::filesystem::path& path, const Progress& progress) {
  return save(write_vox(scene, progress), path);
}

Result<SavedScene> write_vox(const LoadedScene& loaded, const std::filesystem::path& path, const Progress& progress) {
  return save(write_vox(loaded, progress), path);
}

Result<std::vector<std::string>> vox_unsupported_features(const Scene& scene) {
  return unsupported_features_of(scene);
}

Result<std::vector<std::string>> vox_unsupported_features(const LoadedScene& loaded) {
  return unsupported_features_of(loaded);
}

extern constinit const FormatDriver kVoxFormat = {
    .info = {FileFormat::Vox, ".vox", "MagicaVoxel", FormatCapability::Read | FormatCapability::Write},
    .detect = [](std::span<const std::byte> beginning) { return text_of(beginning).starts_with("VOX "); },
    .read = [](const FormatInput& input) -> Result<LoadedScene> {
      return read_vox(input.bytes, input.options, input.progress);
    },
    .write = [](const FormatOutput& output, const std::filesystem::path& path) -> Result<SavedScene> {
      return output.loaded != nullptr ? write_vox(*output.loaded, path, output.progress)
                                      : write_vox(output.scene, path, output.progress);
    },
    .unsupported_features = [](const FormatOutput& output) -> Result<std::vector<std::string>> {
      return output.loaded != nullptr ? vox_unsupported_features(*output.loaded)
                                      : vox_unsupported_features(output.scene);
    },
    .reports_loaded_data = true,
};

}  // namespace quoin

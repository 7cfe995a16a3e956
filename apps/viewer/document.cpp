#include "document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <quoin/core/assert.h>
#include <quoin/io/block_packs.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/mesh_file.h>
#include <quoin/scene/scene_meshes.h>

namespace quoin::viewer {

namespace {

const char* name_of(BrushAction action) {
  switch (action) {
    case BrushAction::Place:
      return "place";
    case BrushAction::Remove:
      return "remove";
    case BrushAction::Paint:
      return "paint";
    case BrushAction::Smooth:
      return "smooth";
    case BrushAction::Flatten:
      return "flatten";
  }
  return "";
}

Status write_as_glb(const Scene& scene, const std::filesystem::path& path, const Progress& progress) {
  const auto half = [&progress](double offset) -> Progress {
    if (!progress) return {};
    return [&progress, offset](double fraction) { return progress(offset + 0.5 * fraction); };
  };
  const auto meshes = mesh_scene(near_grids(scene), {}, {}, half(0.0));
  if (!meshes) return meshes.error();
  const auto written = write_mesh(*meshes, path, {.format = FileFormat::Glb}, half(0.5));
  if (!written) return written.error();
  return {};
}

Result<FileFormat> format_to_write(const std::filesystem::path& path) {
  // Other programs' formats are refused, because their files hold more than load_scene reads.
  constexpr std::array kFormats = {FileFormat::World, FileFormat::Vox, FileFormat::Scene, FileFormat::Glb};
  const auto format = format_for_writing(path);
  if (format && std::ranges::find(kFormats, format->format) != kFormats.end()) return format->format;
  return make_error(
      ErrorCode::Unsupported,
      "cannot save this format: the viewer saves .quoin, .vox, .json and .glb; `quoin convert` writes the others",
      path.string());
}

std::string unusable(const Error& error) {
  return "cannot use the chosen resource pack: " + to_string(error);
}

}  // namespace

bool can_write(const std::filesystem::path& path) {
  return format_to_write(path).has_value();
}

Document::Document(LoadedScene loaded, std::filesystem::path path)
    : loaded_(std::move(loaded)),
      plain_types_(loaded_.scene.types),
      path_(std::move(path)),
      stamp_(FileStamp::of(path_)) {
  faces_.update(loaded_.scene);
}

Document::Document(WorldWindow world, std::filesystem::path path)
    : world_(std::make_unique<WorldWindow>(std::move(world))), path_(std::move(path)) {}

Result<PackedTypes> packed_types(VoxelRegistry plain, std::span<const std::filesystem::path> packs) {
  PackedTypes packed{std::move(plain), {}};
  if (packs.empty()) return packed;
  const auto opened = BlockPacks::open(packs);
  if (!opened) return opened.error();
  (*opened)->apply(packed.types);
  packed.warning = to_string((*opened)->report());
  return packed;
}

Result<std::unique_ptr<Document>> Document::open(const std::filesystem::path& path, const LoadOptions& options,
                                                 const Progress& progress, const WorldOptions& world,
                                                 PackFallback fallback) {
  // Taken before opening, so that a write during the read counts as a change.
  const auto stamp = FileStamp::of(path);
  const auto file = options.raw ? Result<DetectedFile>(DetectedFile{path, std::nullopt}) : detect_file(path);
  if (!file) return file.error();
  if (file->format == FileFormat::World) {
    auto window = WorldWindow::open(path, world);
    if (!window) return window.error();
    return std::make_unique<Document>(std::move(*window), path);
  }
  LoadOptions as_saved = options;
  as_saved.show_hidden = false;
  if (file->format == FileFormat::Scene) return open_scene_file(*file, std::move(as_saved), progress, fallback, stamp);
  as_saved.packs.clear();  // so that the types as read are known
  auto loaded = load_scene(*file, as_saved, {}, progress);
  if (!loaded) return loaded.error();
  const VoxelRegistry plain = loaded->scene.types;
  auto packed = packed_types(plain, options.packs);
  if (!packed && fallback == PackFallback::OwnPack) {
    loaded->warnings.push_back(unusable(packed.error()));
    packed = packed_types(plain, packs_for_images({}));
  }
  if (!packed) return packed.error();
  loaded->scene.types = std::move(packed->types);
  if (!packed->warning.empty()) loaded->warnings.push_back(std::move(packed->warning));
  auto document = std::make_unique<Document>(std::move(*loaded), path);
  document->plain_types_ = plain;
  document->stamp_ = stamp;
  return document;
}

Result<std::unique_ptr<Document>> Document::open_scene_file(const DetectedFile& file, LoadOptions options,
                                                            const Progress& progress, PackFallback fallback,
                                                            const std::optional<FileStamp>& stamp) {
  std::string warning;
  if (fallback == PackFallback::OwnPack) {
    if (const auto opened = BlockPacks::open(options.packs); !opened) {
      warning = unusable(opened.error());
      options.packs = packs_for_images({});
    }
  }
  auto loaded = load_scene(file, options, {}, progress);
  if (!loaded) return loaded.error();
  if (!warning.empty()) loaded->warnings.insert(loaded->warnings.begin(), std::move(warning));
  auto document = std::make_unique<Document>(std::move(*loaded), file.path);
  document->is_scene_file_ = true;
  document->stamp_ = stamp;
  return document;
}

void Document::set_looks(const VoxelRegistry& types) {
  QUOIN_ASSERT(plain_types() != nullptr && types.size() == plain_types_.size(), "types made of the plain ones");
  VoxelRegistry& now = loaded_.scene.types;
  for (std::size_t i = 1; i < types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    if (!(now[type] == types[type])) now.replace(type, types[type]);
  }
}

const char* Document::why_not_edited() const {
  return world_ && !world_->why_not_written().empty() ? world_->why_not_written().c_str() : nullptr;
}

bool Document::can_save_in_place() const {
  if (world_) return why_not_edited() == nullptr;
  return can_write(path_) && loaded_.named_files.empty();
}

std::filesystem::path Document::proposed_path() const {
  if (world_) return path_.parent_path() / (stem_of_file(path_) + "-copy.quoin");
  bool has_field = false;
  loaded_.scene.grids().for_each(
      [&](GridHandle, const SceneGrid& grid) { has_field = has_field || grid.field.chunk_count() > 0; });
  const auto own = format_to_write(path_);
  if (own && !(has_field && *own == FileFormat::Vox)) return path_;
  const std::string stem = stem_of_file(path_);
  return path_.parent_path() / (stem + (has_field || loaded_.format == "scene" ? ".json" : ".vox"));
}

std::string Document::name() const {
  return path_.empty() ? "empty scene" : path_.filename().string();
}

bool Document::begin_stroke(const Brush& brush, const SceneHit& hit, DVec3 look) {
  end_stroke();
  if (why_not_edited() != nullptr) return false;
  const Instance* instance = scene().instances().find(hit.instance);
  if (instance == nullptr || scene().grids().find(instance->grid) == nullptr) return false;
  const bool needs_type = brush.action != BrushAction::Remove && brush.action != BrushAction::Smooth;
  if (needs_type && (brush.type == kAir || brush.type >= scene().types.size())) return false;
  if (const auto surface = SurfacePlace::of(hit, *instance, scene().grids()[instance->grid])) {
    stroke_ = Stroke{brush, instance->grid, hit.instance, {}, {}, surface, surface->point};
    history_.begin(name_of(brush.action));
    touch_surface(surface->point);
    return true;
  }
  if (brush.action == BrushAction::Smooth || brush.action == BrushAction::Flatten) return false;
  const IVec3 target = target_of(brush.action, hit.voxel, hit.face);
  stroke_ = Stroke{brush, instance->grid, hit.instance, {hit.voxel, hit.face}, target, {}, {}};
  stroke_->brush.state = state_of(brush, hit, look, *instance, scene().grids()[instance->grid], scene().types);
  history_.begin(name_of(brush.action));
  touch(target);
  return true;
}

std::int64_t Document::touch(IVec3 voxel) {
  Grid& grid = edited_scene().edit(stroke_->grid).grid;
  history_.touch(stroke_->grid, grid, reach_of(stroke_->brush, voxel));
  return apply(stroke_->brush, voxel, grid);
}

std::int64_t Document::touch_surface(DVec3 point) {
  DensityGrid& field = edited_scene().edit(stroke_->grid).field;
  history_.touch(stroke_->grid, field, reach_of(stroke_->brush, point, field));
  return sculpt(stroke_->brush, point, *stroke_->surface, field);
}

std::int64_t Document::drag_surface(const Ray& ray_in_world, const std::optional<SceneHit>& hit,
                                    const Instance& instance, const SceneGrid& grid) {
  std::optional<DVec3> target;
  if (follows_surface(stroke_->brush.action)) {
    const bool is_same_grid = hit && hit->instance == stroke_->instance;
    const auto place = is_same_grid ? SurfacePlace::of(*hit, instance, grid) : std::nullopt;
    if (place) target = place->point;
  } else if (const auto ray = ray_in_grid(instance, grid, ray_in_world)) {
    target = stroke_->surface->in_plane(*ray);
  }
  if (!target) return 0;
  const DVec3 from = stroke_->last_point;
  const double length = glm::length(*target - from);
  const double stride = 0.5 * sculpt_radius(stroke_->brush);
  constexpr double kLongestWay = 512.0;  // longer leaps are not drags by hand
  if (!(length >= 0.5 * stride) || length > kLongestWay) return 0;
  std::int64_t changed = 0;
  const int steps = std::max(1, static_cast<int>(std::ceil(length / stride)));
  for (int step = 1; step <= steps; ++step) {
    changed += touch_surface(from + (*target - from) * (static_cast<double>(step) / steps));
  }
  stroke_->last_point = *target;
  return changed;
}

std::int64_t Document::drag_to(const Ray& ray_in_world, const std::optional<SceneHit>& hit) {
  if (!stroke_) return 0;
  const Instance* instance = scene().instances().find(stroke_->instance);
  const SceneGrid* grid = scene().grids().find(stroke_->grid);
  if (instance == nullptr || grid == nullptr) return 0;
  if (stroke_->surface) return drag_surface(ray_in_world, hit, *instance, *grid);
  if (stroke_->brush.action == BrushAction::Paint) {
    const bool is_same_grid = hit && hit->instance == stroke_->instance;
    if (!is_same_grid || hit->voxel == stroke_->last) return 0;
    stroke_->last = hit->voxel;
    return touch(hit->voxel);
  }
  const auto ray = ray_in_grid(*instance, *grid, ray_in_world);
  const auto met = ray ? stroke_->layer.at(*ray) : std::nullopt;
  if (!met) return 0;
  const IVec3 target = target_of(stroke_->brush.action, *met, stroke_->layer.face);
  const IVec3 way = target - stroke_->last;
  const int steps = std::max({std::abs(way.x), std::abs(way.y), std::abs(way.z)});
  constexpr int kLongestWay = 512;  // longer leaps are not drags by hand
  if (steps > kLongestWay) return 0;
  std::int64_t changed = 0;
  const IVec3 from = stroke_->last;
  const int stride = std::max(1, stroke_->brush.radius / 2);
  for (int step = std::min(stride, steps); steps > 0; step = std::min(step + stride, steps)) {
    changed += touch(from + IVec3(glm::round(DVec3(way) * (static_cast<double>(step) / steps))));
    if (step == steps) break;
  }
  stroke_->last = target;
  return changed;
}

void Document::end_stroke() {
  if (!stroke_) return;
  stroke_.reset();
  history_.end(scene());
}

bool Document::undo() {
  return !stroke_ && history_.undo(edited_scene());
}

bool Document::redo() {
  return !stroke_ && history_.redo(edited_scene());
}

bool Document::show(const SceneNode& node, bool is_visible) {
  if (stroke_ || visibility_of(scene(), node).value_or(is_visible) == is_visible) return false;
  history_.show(edited_scene(), node, is_visible);
  return true;
}

Result<VoxelType> Document::type_of_colour(Rgba8 colour, float emission) {
  for (std::size_t type = 1; type < scene().types.size(); ++type) {
    const VoxelProperties& known = scene().types[static_cast<VoxelType>(type)];
    // The colour of a textured type is only a mean.
    const bool is_plain = known.visibility == Visibility::Opaque && known.faces.empty() && known.shapes.empty();
    if (is_plain && known.colour == colour && known.emission == emission) return static_cast<VoxelType>(type);
  }
  VoxelProperties properties;
  properties.colour = colour;
  properties.emission = emission;
  return edited_scene().types.add(std::move(properties));
}

Result<std::vector<std::string>> Document::losses(const std::filesystem::path& path) const {
  const auto format = format_to_write(path);
  if (!format) return format.error();
  std::vector<std::string> all;
  if (world_) return all;                      // the world itself, or a copy
  if (*format == FileFormat::Glb) return all;  // a copy
  auto of_format = unsupported_features(loaded_, path);
  if (!of_format) return of_format.error();
  all = std::move(*of_format);
  std::error_code ignored;
  const bool is_own = is_same_file(path, path_);
  if (is_own && FileStamp::of(path) != stamp_ && std::filesystem::exists(path, ignored)) {
    all.emplace_back("changes that another program made to the file since it was opened (kept as " +
                     kept_as(path).filename().string() + ")");
  }
  std::erase_if(all, [&](const std::string& line) { return accepted_unsupported_.contains(line); });
  return all;
}

Status Document::write(const std::filesystem::path& path, std::vector<std::string>& warnings,
                       const Progress& progress) const {
  if (world_) return write_world(path, warnings, progress);
  const auto format = format_to_write(path);
  if (!format) return format.error();
  if (*format == FileFormat::Glb) return write_as_glb(loaded_.scene, path, progress);
  const bool has_original = originals_.contains(path);
  std::optional<FileBackup> backup;
  if (!has_original || has_newly_accepted_) {
    auto before = FileBackup::of(path, has_original ? FileBackup::Older::Kept : FileBackup::Older::Replaced);
    if (!before) return before.error();
    backup = std::move(*before);
  }
  const auto saved = save_scene(loaded_, path, {}, progress);
  if (!saved) return saved.error();
  warnings.insert(warnings.end(), saved->warnings.begin(), saved->warnings.end());
  // The file is written correctly, so a backup with the wrong name is only a warning.
  if (Status kept = backup ? backup->keep() : Status(); !kept) warnings.push_back(to_string(kept.error()));
  return {};
}

Status Document::write_world(const std::filesystem::path& path, std::vector<std::string>& warnings,
                             const Progress& progress) const {
  if (is_same_file(path, path_)) return world_->flush();
  const auto format = format_to_write(path);
  if (!format || *format != FileFormat::World) {
    return make_error(ErrorCode::Unsupported,
                      "cannot save a world in this format: only a part of it is loaded; copy it as .quoin, or use "
                      "`quoin convert`",
                      path.string());
  }
  // Replacing the world would lose the changes in its write-ahead log.
  std::error_code none;
  const auto waiting = std::filesystem::file_size(path.string() + "-wal", none);
  if (!none && waiting > 0) {
    return make_error(ErrorCode::CannotWrite,
                      "cannot replace the world: it was not closed; open it once, or choose another name",
                      path.string());
  }
  auto backup = FileBackup::of(path);
  if (!backup) return backup.error();
  const auto copied = world_->copy_to(path, progress);
  if (!copied) return copied.error();
  if (!copied->lost.empty()) {
    warnings.push_back("damaged chunks missing in the copy: " + std::to_string(copied->lost.size()));
  }
  if (Status kept = backup->keep(); !kept) warnings.push_back(to_string(kept.error()));
  return {};
}

std::filesystem::path Document::kept_as(const std::filesystem::path& path) const {
  return FileBackup::name_for(path, originals_.contains(path) ? FileBackup::Older::Kept : FileBackup::Older::Replaced);
}

void Document::note_written(const std::filesystem::path& path, std::uint64_t state) {
  if (world_) return note_saving({});
  const auto format = format_to_write(path);
  if (!format || *format == FileFormat::Glb) return;
  path_ = path;
  stamp_ = FileStamp::of(path);
  if (std::exchange(has_newly_accepted_, false)) originals_.insert(path);
  loaded_.named_files.clear();
  saved_state_ = state;
}

}  // namespace quoin::viewer

#include <algorithm>

#include <quoin/io/vox.h>

#include "io/text.h"
#include "io/vox/chunks.h"
#include "io/vox/materials.h"
#include "io/vox/read.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

// Voxels that lie far apart cost up to a few hundred times the four bytes that they take in the file. Grids may take
// this much, and so many times the file's size above it; real files stay far below.
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
      return make_error(ErrorCode::LimitExceeded, "scattered voxels take far more memory than the file has bytes", {},
                        model.offset);
    }
    handles.push_back(scene.add_grid(std::move(*grid)));
    const double share = static_cast<double>(handles.size()) / static_cast<double>(document.models.size());
    if (progress && !progress(share)) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return handles;
}

Instance instance_of(const vox::Placement& placement, GridHandle grid, const LoadOptions& options) {
  const vox::InstanceTurn turn = vox::turn_from_orientation(placement.orientation);
  const vox::Offset position = vox::quoin_from_vox(placement.translation);
  Instance instance;
  instance.name = printable(placement.name);
  instance.grid = grid;
  for (int axis = 0; axis < 3; ++axis) {
    instance.position[axis] = static_cast<double>(position[static_cast<std::size_t>(axis)]);
  }
  instance.rotation = turn.rotation;
  instance.mirrored = turn.mirrored;
  instance.visible = !placement.hidden || options.show_hidden;
  return instance;
}

/// A grid is called what its shape is called, else as the first of its instances that has a name.
void add_instances(const vox::Placements& placements, const std::vector<GridHandle>& grids, const LoadOptions& options,
                   Scene& scene) {
  for (const vox::Placement& placement : placements.all) {
    const GridHandle grid = grids[placement.model];
    scene.add_instance(instance_of(placement, grid, options));
    std::string& name = scene.edit(grid).name;
    if (name.empty()) name = printable(placement.shape_name);
  }
  for (const vox::Placement& placement : placements.all) {
    std::string& name = scene.edit(grids[placement.model]).name;
    if (name.empty()) name = printable(placement.name);
  }
}

void warn(const std::string& of_what, std::int64_t count, std::vector<std::string>& warnings) {
  if (count > 0) warnings.push_back(of_what + ": " + std::to_string(count));
}

void add_warnings(const vox::Placements& placements, const vox::ModelLosses& losses,
                  std::vector<std::string>& warnings) {
  warnings.insert(warnings.end(), placements.warnings.begin(), placements.warnings.end());
  warn("voxels outside their model's size skipped", losses.outside, warnings);
  warn("voxels of colour 0, which is air, skipped", losses.colourless, warnings);
  warn("models placed nowhere", std::ranges::count(placements.is_model_used, false), warnings);
}

}  // namespace

Result<LoadedScene> read_vox(std::span<const std::byte> bytes, const LoadOptions& options, const Progress& progress) {
  Result<vox::Document> document = vox::parse_document(bytes);
  if (!document) return document.error();
  const Result<vox::Placements> placements = vox::place_models(*document, options.frame, bytes.size());
  if (!placements) return placements.error();

  LoadedScene loaded;
  loaded.format = "vox";
  loaded.warnings = std::move(document->warnings);
  const auto type_of = vox::types_by_colour_index(*document, loaded.warnings);
  if (Status status = vox::register_palette(*document, type_of, loaded.scene.types); !status) {
    return status.error();
  }
  vox::ModelBuilder builder(type_of);
  const Result<std::vector<GridHandle>> grids = add_grids(*document, builder, bytes, progress, loaded.scene);
  if (!grids) return grids.error();
  add_instances(*placements, *grids, options, loaded.scene);
  warn("materials of no colour skipped", document->stray_materials, loaded.warnings);
  add_warnings(*placements, builder.losses(), loaded.warnings);
  return loaded;
}

Result<LoadedScene> read_vox(const std::filesystem::path& path, const LoadOptions& options, const Progress& progress) {
  return read_whole(path, [&](std::span<const std::byte> bytes) { return read_vox(bytes, options, progress); });
}

}  // namespace quoin

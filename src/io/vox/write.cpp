#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <quoin/io/vox.h>

#include "io/field_check.h"
#include "io/text.h"
#include "io/vox/chunk_writer.h"
#include "io/vox/materials.h"
#include "io/vox/orientation.h"
#include "io/vox/write.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

constexpr std::uint32_t kVersion = 150;
constexpr std::int32_t kRootTransform = 0;
constexpr std::int32_t kRootGroup = 1;
constexpr std::int32_t kFirstFreeId = 2;
constexpr std::int32_t kOnlyLayer = 0;
constexpr std::int32_t kNoLayer = -1;

struct GridParts {
  GridHandle grid;
  std::vector<vox::Piece> pieces;
  std::uint32_t first_model = 0;
  std::string instance_name;  ///< of the first instance that has a name
};

struct TransformChunk {
  std::int32_t id = 0;
  std::int32_t child = 0;
  std::int32_t layer = kOnlyLayer;
  std::string name;
  bool hidden = false;
  vox::Orientation orientation;
  vox::Offset translation{0, 0, 0};
};

class Writer {
 public:
  explicit Writer(const Scene& scene) : scene_(scene) {}

  Result<std::vector<std::byte>> run(std::vector<std::string>& warnings);

 private:
  void gather_grids();
  void gather_instances();
  void write_models(const vox::TypeTable& table);
  Status write_nodes();
  void write_instance(const Instance& instance, const GridParts& parts, TransformChunk transform);
  void write_transform(const TransformChunk& transform);
  void write_group(std::int32_t id, const std::vector<std::int32_t>& children);
  void write_shape(std::int32_t id, std::uint32_t model, const std::string& name);
  void write_layer();
  void write_palette(const vox::TypeTable& table);
  void write_materials(const vox::TypeTable& table);
  [[nodiscard]] GridParts* parts_of(GridHandle grid);
  Status place(const Instance& instance, const GridParts& parts, TransformChunk& out);

  const Scene& scene_;
  std::vector<GridParts> grids_;
  std::vector<InstanceHandle> instances_;
  std::int64_t rounded_ = 0;
  vox::ChunkWriter out_;
};

std::string instance_text(const Instance& instance) {
  if (instance.name.empty()) return "an instance";
  std::string text = "instance \"";
  text += printable(instance.name);
  text += '"';
  return text;
}

std::int32_t nodes_of(const GridParts& parts) {
  const auto pieces = static_cast<std::int32_t>(parts.pieces.size());
  return pieces == 1 ? 2 : 2 + 2 * pieces;
}

/// `grids_` is in slot order, and so are handles.
GridParts* Writer::parts_of(GridHandle grid) {
  const auto before = [](const GridParts& a, GridHandle b) { return a.grid < b; };
  const auto found = std::lower_bound(grids_.begin(), grids_.end(), grid, before);
  return found != grids_.end() && found->grid == grid ? &*found : nullptr;
}

void Writer::gather_grids() {
  std::uint32_t model = 0;
  for (const GridHandle handle : scene_.grids().handles()) {
    GridParts parts;
    parts.grid = handle;
    parts.pieces = vox::cut_into_pieces(scene_.grids()[handle]);
    parts.first_model = model;
    model += static_cast<std::uint32_t>(parts.pieces.size());
    grids_.push_back(std::move(parts));
  }
}

/// Leaves out instances of grids that are not there.
void Writer::gather_instances() {
  for (const InstanceHandle handle : scene_.instances().handles()) {
    const Instance& instance = scene_.instances()[handle];
    GridParts* parts = parts_of(instance.grid);
    if (parts == nullptr) continue;
    if (parts->instance_name.empty()) parts->instance_name = printable(instance.name);
    instances_.push_back(handle);
  }
}

/// The voxels are what takes memory: they go where they belong in the file at once, and the file has room for all that
/// follows, so that it is not moved.
void Writer::write_models(const vox::TypeTable& table) {
  constexpr std::size_t kHeadBytes = 64;          // of a model, and more
  constexpr std::size_t kNodeBytes = 128;         // of a node, with a name that is not long
  constexpr std::size_t kPaletteBytes = 262'144;  // with materials, and more
  std::size_t bytes = kPaletteBytes;
  for (const InstanceHandle handle : instances_) {
    bytes += kNodeBytes * static_cast<std::size_t>(nodes_of(*parts_of(scene_.instances()[handle].grid)));
  }
  for (const GridParts& parts : grids_) {
    for (const vox::Piece& piece : parts.pieces) bytes += kHeadBytes + 4 * piece.voxels;
  }
  out_.reserve(bytes);
  for (const GridParts& parts : grids_) {
    std::vector<std::size_t> starts;
    for (const vox::Piece& piece : parts.pieces) {
      const std::size_t size_chunk = out_.begin_chunk("SIZE");
      out_.i32(piece.size.x);
      out_.i32(piece.size.z);
      out_.i32(piece.size.y);
      out_.end_chunk(size_chunk);
      const std::size_t voxel_chunk = out_.begin_chunk("XYZI");
      out_.u32(static_cast<std::uint32_t>(piece.voxels));
      starts.push_back(out_.size());
      out_.leave(4 * piece.voxels);
      out_.end_chunk(voxel_chunk);
    }
    vox::write_voxels(scene_.grids()[parts.grid].grid, table.index_of_type, parts.pieces, starts, out_.bytes());
  }
}

/// Where the first piece of an instance goes.
Status Writer::place(const Instance& instance, const GridParts& parts, TransformChunk& out) {
  if (instance.voxel_size != 1.0) {
    return make_error(ErrorCode::Unsupported, instance_text(instance) + " is scaled, which a .vox file cannot say");
  }
  const auto orientation = vox::orientation_from_turn({instance.rotation, instance.mirrored});
  if (!orientation.has_value()) {
    return make_error(ErrorCode::Unsupported,
                      instance_text(instance) + " is not turned by quarter turns, as .vox requires");
  }
  const DVec3 world = world_from_grid(instance, scene_.grids()[parts.grid], vox::pivot_of(parts.pieces.front()));
  vox::Offset rounded{};
  bool exact = true;
  for (int axis = 0; axis < 3; ++axis) {
    // Less than the largest, so that it can be negated.
    if (!(std::abs(world[axis]) < std::numeric_limits<std::int32_t>::max())) {
      return make_error(ErrorCode::LimitExceeded, instance_text(instance) + " lies too far out for a .vox file");
    }
    constexpr double kRounding = 1e-6;
    exact = exact && std::abs(world[axis] - std::round(world[axis])) < kRounding;
    rounded[static_cast<std::size_t>(axis)] = std::llround(world[axis]);
  }
  if (!exact) ++rounded_;
  out.orientation = *orientation;
  out.translation = vox::vox_from_quoin(rounded);
  return {};
}

void Writer::write_transform(const TransformChunk& transform) {
  vox::ChunkWriter::Entries attributes;
  if (!transform.name.empty()) attributes.emplace_back("_name", transform.name);
  if (transform.hidden) attributes.emplace_back("_hidden", "1");
  vox::ChunkWriter::Entries frame;
  if (transform.orientation != vox::Orientation{}) {
    frame.emplace_back("_r", std::to_string(vox::byte_from_orientation(transform.orientation)));
  }
  if (transform.translation != vox::Offset{0, 0, 0}) {
    const vox::Offset& t = transform.translation;
    frame.emplace_back("_t", std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]));
  }
  const std::size_t chunk = out_.begin_chunk("nTRN");
  out_.i32(transform.id);
  out_.dict(attributes);
  out_.i32(transform.child);
  out_.i32(-1);  // reserved
  out_.i32(transform.layer);
  out_.u32(1);  // frames
  out_.dict(frame);
  out_.end_chunk(chunk);
}

void Writer::write_group(std::int32_t id, const std::vector<std::int32_t>& children) {
  const std::size_t chunk = out_.begin_chunk("nGRP");
  out_.i32(id);
  out_.dict({});
  out_.u32(static_cast<std::uint32_t>(children.size()));
  for (const std::int32_t child : children) out_.i32(child);
  out_.end_chunk(chunk);
}

void Writer::write_shape(std::int32_t id, std::uint32_t model, const std::string& name) {
  const std::size_t chunk = out_.begin_chunk("nSHP");
  out_.i32(id);
  out_.dict(name.empty() ? vox::ChunkWriter::Entries{} : vox::ChunkWriter::Entries{{"_name", name}});
  out_.u32(1);  // models
  out_.u32(model);
  out_.dict({});
  out_.end_chunk(chunk);
}

/// A transform over a shape, or over a group of transforms over shapes when the grid had to be cut.
void Writer::write_instance(const Instance& instance, const GridParts& parts, TransformChunk transform) {
  const std::string grid_name = printable(scene_.grids()[parts.grid].name);
  const std::string shape_name = grid_name == parts.instance_name ? std::string{} : grid_name;
  transform.name = printable(instance.name);
  transform.hidden = !instance.visible;
  transform.child = transform.id + 1;
  write_transform(transform);
  if (parts.pieces.size() == 1) {
    write_shape(transform.child, parts.first_model, shape_name);
    return;
  }
  std::vector<std::int32_t> children;
  for (std::size_t i = 0; i < parts.pieces.size(); ++i) {
    children.push_back(transform.id + 2 + 2 * static_cast<std::int32_t>(i));
  }
  write_group(transform.child, children);
  for (std::size_t i = 0; i < parts.pieces.size(); ++i) {
    const DVec3 from_first = vox::pivot_of(parts.pieces[i]) - vox::pivot_of(parts.pieces.front());
    TransformChunk piece;
    piece.id = children[i];
    piece.child = piece.id + 1;
    piece.name = transform.name;
    piece.translation =
        vox::vox_from_quoin({std::llround(from_first.x), std::llround(from_first.y), std::llround(from_first.z)});
    write_transform(piece);
    write_shape(piece.child, parts.first_model + static_cast<std::uint32_t>(i), shape_name);
  }
}

Status Writer::write_nodes() {
  std::vector<std::int32_t> ids;
  std::int32_t next_id = kFirstFreeId;
  for (const InstanceHandle handle : instances_) {
    ids.push_back(next_id);
    next_id += nodes_of(*parts_of(scene_.instances()[handle].grid));
  }
  TransformChunk root;
  root.id = kRootTransform;
  root.child = kRootGroup;
  root.layer = kNoLayer;
  write_transform(root);
  write_group(kRootGroup, ids);
  for (std::size_t i = 0; i < instances_.size(); ++i) {
    const Instance& instance = scene_.instances()[instances_[i]];
    const GridParts& parts = *parts_of(instance.grid);
    TransformChunk transform;
    transform.id = ids[i];
    if (Status status = place(instance, parts, transform); !status) return status;
    write_instance(instance, parts, transform);
  }
  return {};
}

void Writer::write_layer() {
  const std::size_t chunk = out_.begin_chunk("LAYR");
  out_.i32(kOnlyLayer);
  out_.dict({});
  out_.i32(-1);  // reserved
  out_.end_chunk(chunk);
}

void Writer::write_palette(const vox::TypeTable& table) {
  const std::size_t chunk = out_.begin_chunk("RGBA");
  for (std::size_t index = 1; index < vox::kColours; ++index) {
    const Rgba8& colour = table.by_index[index].colour;
    out_.raw(std::array{std::byte{colour.r}, std::byte{colour.g}, std::byte{colour.b}, std::byte{255}});
  }
  out_.u32(0);  // air's entry stands last
  out_.end_chunk(chunk);
}

void Writer::write_materials(const vox::TypeTable& table) {
  for (std::size_t index = 1; index < vox::kColours; ++index) {
    const std::string name = vox::default_type_name(static_cast<int>(index));
    const vox::Attributes attributes = vox::encode_material(name, table.by_index[index]);
    if (attributes.empty()) continue;
    const std::size_t chunk = out_.begin_chunk("MATL");
    out_.i32(static_cast<std::int32_t>(index));
    out_.dict({attributes.begin(), attributes.end()});
    out_.end_chunk(chunk);
  }
}

Result<std::vector<std::byte>> Writer::run(std::vector<std::string>& warnings) {
  for (const GridHandle handle : scene_.grids().handles()) {
    if (Status sound = check_has_no_field(scene_.grids()[handle]); !sound) return sound.error();
  }
  const Result<vox::TypeTable> table = vox::make_type_table(scene_);
  if (!table) return table.error();
  gather_grids();
  gather_instances();
  out_.text("VOX ");
  out_.u32(kVersion);
  const std::size_t main = out_.begin_chunk("MAIN");
  write_models(*table);
  if (Status status = write_nodes(); !status) return status.error();
  write_layer();
  write_palette(*table);
  write_materials(*table);
  out_.end_parent(main);
  if (out_.size() > std::numeric_limits<std::uint32_t>::max()) {
    return make_error(ErrorCode::LimitExceeded, "the scene takes more than the 4 GiB that a .vox file can hold");
  }
  if (rounded_ > 0) {
    warnings.push_back("instances between voxels moved to the nearest: " + std::to_string(rounded_));
  }
  if (!scene_.lamps.empty()) {
    warnings.push_back("lamps left out, which .vox does not hold (a .json keeps them): " +
                       std::to_string(scene_.lamps.size()));
  }
  return out_.take();
}

}  // namespace

Result<std::vector<std::byte>> write_vox(const Scene& scene, std::vector<std::string>& warnings) {
  return Writer(scene).run(warnings);
}

Result<std::uint64_t> write_vox(const Scene& scene, const std::filesystem::path& path,
                                std::vector<std::string>& warnings) {
  return write_whole(path, write_vox(scene, warnings));
}

}  // namespace quoin

#include <quoin/grid/voxel_registry.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

#include <quoin/core/assert.h>

#include "core/change_journal.h"
#include "core/memory/make_room.h"
#include "core/rows/packed_row.h"

namespace quoin {
namespace {

// Hashes only properties that are cheap to mix. Equal properties have equal hashes; `find_or_add` compares the rest.
std::uint64_t hash_of(const VoxelProperties& p) {
  const std::uint64_t colour = (std::uint64_t{p.colour.r} << 24) | (std::uint64_t{p.colour.g} << 16) |
                               (std::uint64_t{p.colour.b} << 8) | p.colour.a;
  std::uint64_t hash =
      std::hash<std::string>{}(p.name) * 0x9E37'79B9'7F4A'7C15U + colour * 4 + static_cast<std::uint64_t>(p.visibility);
  // Types of one name and colour often differ in their shapes alone. Adding 0 makes -0 and 0 equal.
  for (std::size_t part = 0; !p.shapes.empty() && part < p.shapes.rules().parts.size(); ++part) {
    for (const ShapeElement& element : p.shapes.rules().parts[part].shape.elements()) {
      const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value + 0.0F); };
      const auto pair = [&](float low, float high) { return std::uint64_t{bits(low)} << 32 | bits(high); };
      for (int axis = 0; axis < 3; ++axis) hash = mixed_with(hash, pair(element.min[axis], element.max[axis]));
    }
  }
  if (p.faces.empty()) return hash;
  // Types of one name and mean colour often differ in their faces alone.
  for (const Direction direction : kDirections) {
    const VoxelFace& face = p.faces[direction];
    const std::uint64_t tint = (std::uint64_t{face.tint.r} << 16) | (std::uint64_t{face.tint.g} << 8) | face.tint.b;
    const std::uint64_t rest =
        tint * 32 + static_cast<std::uint64_t>(face.alpha) * 8 + std::uint64_t{face.turn} * 2 + (face.mirrored ? 1 : 0);
    hash = mixed_with(mixed_with(hash, face.texture.hash()), rest);
    if (face.emission_share != 255) hash = mixed_with(hash, face.emission_share);
  }
  return hash;
}

// Returns the visibility of a whole voxel of a type (VoxelRegistry::visibility).
Visibility visibility_of(const VoxelProperties& p) {
  return p.shapes.empty() ? p.visibility : Visibility::Transparent;
}

// Returns the class of a type for occlusion (VoxelRegistry::occlusion).
Visibility occlusion_of(const VoxelProperties& p) {
  const Visibility visibility = visibility_of(p);
  const bool is_clear = visibility == Visibility::Opaque && !p.occludes.value_or(true);
  return is_clear ? Visibility::Transparent : visibility;
}

// Returns true if a change of a voxel's state changes its mesh (VoxelRegistry::remeshes_on_data).
bool remeshes(const VoxelProperties& p) {
  return p.remesh_on_data || !p.shapes.empty() || !p.orientations.empty();
}

// Makes types that behave alike equal: empties properties that equal the defaults of the type's visibility, and derives
// the colour of textured types, whose tints become opaque. Returns true if a property changed.
bool settle(VoxelProperties& p) {
  bool has_changed = false;
  for (std::optional<bool>* property : {&p.blocks_light, &p.occludes}) {
    if (*property != (visibility_of(p) == Visibility::Opaque)) continue;
    // Shapes let light through in some directions, which no value says.
    if (property == &p.blocks_light && !p.shapes.empty()) continue;
    property->reset();
    has_changed = true;
  }
  if (p.faces.empty()) return has_changed;
  std::array<VoxelFace, 6> faces;
  bool is_opaque = true;
  for (const Direction direction : kDirections) {
    VoxelFace& face = faces[static_cast<std::size_t>(direction)];
    face = p.faces[direction];
    is_opaque &= std::exchange(face.tint.a, std::uint8_t{255}) == 255;
  }
  if (!is_opaque) {
    p.faces = VoxelFaces(faces);
    has_changed = true;
  }
  const Rgba8 colour = std::exchange(p.colour, p.faces.mean_colour());
  return has_changed || !(colour == p.colour);
}

// Returns the reason if a textured face is not valid, or an empty string. `where` begins the reason.
std::string error_of_face(const VoxelFace& face, const VoxelProperties& p, const std::string& where) {
  if (face.turn > 3) return where + "has a turn that is not 0 to 3";
  if (face.alpha > FaceAlpha::Translucent) return where + "has an unknown alpha mode";
  if (face.alpha == FaceAlpha::Opaque && !face.texture.is_null() && !face.texture.is_opaque()) {
    std::string reason = where + "is opaque, but its texture \"";
    return reason.append(face.texture.name()).append("\" has transparent texels");
  }
  if (face.alpha != FaceAlpha::Opaque && p.visibility != Visibility::Transparent) {
    return where + "is not opaque, which needs a transparent type";
  }
  return {};
}

// Returns the reason if a type's faces are not valid, or an empty string.
std::string error_of_faces(const VoxelProperties& p) {
  if (p.faces.empty()) return {};
  for (const Direction direction : kDirections) {
    const VoxelFace& face = p.faces[direction];
    const std::string where = "the face " + std::string(name_of(direction)) + " ";
    if (face.texture.is_null()) return where + "has no texture";
    if (std::string reason = error_of_face(face, p, where); !reason.empty()) return reason;
  }
  return {};
}

// Returns the reason if a type does not declare the bits of its state that select its orientation, or an empty string.
std::string error_of_orientations(const VoxelProperties& p) {
  if (p.orientations.by_value.size() > AxisOrientation::kCount) return "more than 48 orientations";
  if (p.orientations.first_bit >= kMaxStateBits) return "the first bit is not 0 to 31";
  if (p.orientations.first_bit + p.orientations.bit_count() > p.state_bits) {
    return "they use bits of the state that `state_bits` does not declare";
  }
  return {};
}

// Returns the reason if a type's shapes are not valid, or an empty string.
std::string error_of_shapes(const VoxelProperties& p) {
  if (p.shapes.empty()) return {};
  if (static_cast<int>(std::bit_width(p.shapes.state_mask())) > p.state_bits &&
      p.shapes.rules().neighbours != ShapeNeighbours::Fluid) {
    return "they use bits of the state that `state_bits` does not declare";
  }
  if (p.occludes.value_or(false)) return "leave `occludes` empty: a type with shapes darkens corners by their content";
  for (std::size_t part = 0; part < p.shapes.rules().parts.size(); ++part) {
    for (const ShapeElement& element : p.shapes.rules().parts[part].shape.elements()) {
      for (const Direction direction : kDirections) {
        const ElementFace& face = element.faces[static_cast<std::size_t>(direction)];
        if (!face.face) continue;
        const std::string where =
            "the face " + std::string(name_of(direction)) + " of an element of part " + std::to_string(part) + " ";
        if (std::string reason = error_of_face(*face.face, p, where); !reason.empty()) return reason;
      }
    }
  }
  return {};
}

// See VoxelRegistry::fluid_groups.
std::uint32_t fluid_groups_of(const VoxelProperties& p) {
  if (p.shapes.empty() || p.shapes.rules().neighbours != ShapeNeighbours::Fluid) return 0;
  return p.shapes.rules().groups;
}

// Calls `visit(type)` for each type whose voxels can contain a fluid of any of these groups (ShapeRules::fluid). Cost:
// O(types), O(1) without groups.
void for_each_holder(const std::vector<VoxelProperties>& types, std::uint32_t groups,
                     FunctionRef<void(VoxelType type)> visit) {
  for (std::size_t type = 1; groups != 0 && type < types.size(); ++type) {
    const VoxelShapes& shapes = types[type].shapes;
    if (shapes.empty() || !shapes.rules().fluid || (shapes.rules().fluid->groups & groups) == 0) continue;
    visit(static_cast<VoxelType>(type));
  }
}

// As ==, but NaN equals itself. Otherwise each lookup would add a type.
bool is_same(const VoxelProperties& a, const VoxelProperties& b) {
  if (a == b) return true;
  VoxelProperties left = a;
  VoxelProperties right = b;
  for (float VoxelProperties::*const number :
       {&VoxelProperties::roughness, &VoxelProperties::metalness, &VoxelProperties::emission, &VoxelProperties::ior,
        &VoxelProperties::scattering, &VoxelProperties::anisotropy}) {
    if (std::isnan(left.*number) && std::isnan(right.*number)) left.*number = right.*number = 0.0F;
  }
  return left == right;
}

}  // namespace

struct TypeRecord : TypeChange {
  void merge(const TypeRecord& other) {
    visibility_changed |= other.visibility_changed;
    colour_changed |= other.colour_changed;
    shape_changed |= other.shape_changed;
  }
  [[nodiscard]] TypeChange change() const { return *this; }
};

void VoxelRegistry::Content::share_textures(VoxelFaces& faces) {
  if (faces.empty()) return;
  std::array<VoxelFace, 6> shared;
  bool is_shared = true;
  for (const Direction direction : kDirections) {
    VoxelFace& face = shared[static_cast<std::size_t>(direction)];
    face = faces[direction];
    const auto [first, last] = textures.equal_range(face.texture.hash());
    auto known = std::find_if(first, last, [&](const auto& each) { return each.second.texture == face.texture; });
    if (known == last) known = textures.emplace(face.texture.hash(), SharedTexture{face.texture});
    ++known->second.faces;
    is_shared = is_shared && known->second.texture.shares_texels_with(face.texture);
    face.texture = known->second.texture;
  }
  if (!is_shared) faces = VoxelFaces(shared);
}

void VoxelRegistry::Content::release_textures(const VoxelFaces& faces) noexcept {
  if (faces.empty()) return;
  for (const Direction direction : kDirections) {
    const Texture& texture = faces[direction].texture;
    const auto [first, last] = textures.equal_range(texture.hash());
    const auto known = std::find_if(first, last, [&](const auto& each) { return each.second.texture == texture; });
    QUOIN_ASSERT(known != last && known->second.faces > 0, "a texture that the faces of types share");
    if (--known->second.faces == 0) textures.erase(known);
  }
}

struct VoxelRegistry::Journal : ChangeJournal<TypeRecord> {};

void for_each_look(const VoxelProperties& type, FunctionRef<void(const VoxelFace& look)> visit) {
  for (const Direction direction : kDirections) {
    if (!type.faces.empty()) visit(type.faces[direction]);
  }
  if (type.shapes.empty()) return;
  for (const ShapePart& part : type.shapes.rules().parts) {
    for (const ShapeElement& element : part.shape.elements()) {
      for (const ElementFace& face : element.faces) {
        if (face.face) visit(*face.face);
      }
    }
  }
}

const VoxelRegistry& decode_textures(const VoxelRegistry& types, Threads threads) {
  if (!types.has_textures() && !types.has_shapes()) return types;
  std::vector<Texture> deferred;
  for (std::size_t type = 1; type < types.size(); ++type) {
    for_each_look(types[static_cast<VoxelType>(type)], [&](const VoxelFace& look) {
      const Texture& texture = look.texture;
      if (texture.is_null() || texture.has_texels()) return;
      if (deferred.empty() || !deferred.back().shares_texels_with(texture)) deferred.push_back(texture);
    });
  }
  parallel_for(deferred.size(), threads, [&](std::size_t i) { static_cast<void>(deferred[i].level(0)); });
  return types;
}

Status validate_type(const VoxelProperties& properties) {
  const auto wrong = [&](const char* property, const char* reason) {
    return make_error(ErrorCode::InvalidArgument,
                      "cannot use voxel type \"" + properties.name + "\": " + property + ": " + reason);
  };
  if (properties.visibility == Visibility::Air) return wrong("visibility", "only type 0 can be air");
  if (properties.state_bits > kMaxStateBits) return wrong("state_bits", "must be 0 to 32");
  if (properties.light_cost > kMaxLightCost) return wrong("light_cost", "must be 0 to 15");
  if (properties.visibility == Visibility::Transparent && properties.occludes.value_or(false)) {
    return wrong("occludes", "must be false for a transparent type, since only types that hide faces can occlude");
  }
  if (const std::string fault = error_of_faces(properties); !fault.empty()) return wrong("faces", fault.c_str());
  const FieldTextures& field = properties.field_textures;
  if (!(field.voxels >= 1.0F / 64.0F && field.voxels <= 4'096.0F)) {
    return wrong("field_textures", "the edge of a texture must be from 1/64 to 4,096 voxels");
  }
  if (!(field.flat_degrees >= 0.0F && field.flat_degrees < field.steep_degrees && field.steep_degrees <= 90.0F)) {
    return wrong("field_textures", "slopes must be 0 <= flat < steep <= 90 degrees");
  }
  if (const std::string fault = error_of_orientations(properties); !fault.empty()) {
    return wrong("orientations", fault.c_str());
  }
  if (const std::string fault = error_of_shapes(properties); !fault.empty()) return wrong("shapes", fault.c_str());
  return {};
}

bool has_other_visibility(const TypeChanges& changes) {
  return changes.all || std::any_of(changes.items_unless_all().begin(), changes.items_unless_all().end(),
                                    [](const TypeChange& change) { return change.visibility_changed; });
}

// All new registries share the content that is only air, until a type is added.
VoxelRegistry::VoxelRegistry() : journal_(std::make_unique<Journal>()) {
  static const Ref<Content> air_only = [] {
    VoxelProperties air;
    air.name = "air";
    air.colour = {0, 0, 0, 0};
    air.visibility = Visibility::Air;
    air.collides = false;
    Ref<Content> content = make_ref<Content>();
    content->properties.push_back(std::move(air));
    content->visibility.push_back(Visibility::Air);
    content->occlusion.push_back(Visibility::Air);
    content->serials.push_back(0);
    content->fluid_groups.push_back(0);
    return content;
  }();
  content_ = air_only;
}

VoxelRegistry::VoxelRegistry(const VoxelRegistry& other)
    : content_((QUOIN_ASSERT(other.journal_ != nullptr, "a registry that was not moved from"), other.content_)),
      journal_(std::make_unique<Journal>(*other.journal_)) {}
VoxelRegistry::VoxelRegistry(VoxelRegistry&&) noexcept = default;
VoxelRegistry& VoxelRegistry::operator=(const VoxelRegistry& other) {
  if (this != &other) *this = VoxelRegistry(other);
  return *this;
}
VoxelRegistry& VoxelRegistry::operator=(VoxelRegistry&&) noexcept = default;
VoxelRegistry::~VoxelRegistry() = default;

void VoxelRegistry::note(TypeChange change) {
  QUOIN_ASSERT(change.type < content_->serials.size(), "a registered type");
  journal_->note(content_->serials[change.type], {change}, size());
}

Result<VoxelType> VoxelRegistry::add(VoxelProperties properties) {
  if (Status valid = validate_type(properties); !valid) return valid.error();
  if (size() > kMaxVoxelTypes) {
    return make_error(ErrorCode::LimitExceeded, "more than 65,535 distinct voxel types");
  }
  settle(properties);
  journal_->begin_change();
  content_.make_own();
  Content& c = *content_;
  const auto type = static_cast<VoxelType>(size());
  const Visibility visibility = visibility_of(properties);
  const Visibility occlusion = occlusion_of(properties);
  // Reserves memory first, so that a failure leaves nothing half done.
  make_room(c.serials);
  make_room(c.visibility);
  make_room(c.occlusion);
  make_room(c.properties);
  make_room(c.fluid_groups);
  c.share_textures(properties.faces);
  c.by_hash.emplace(hash_of(properties), type);
  c.serials.push_back(0);
  c.visibility.push_back(visibility);
  c.occlusion.push_back(occlusion);
  if (!properties.collides) ++c.passable_count;
  const bool is_shaped = !properties.shapes.empty();
  const bool is_turned = !properties.orientations.empty();
  if (remeshes(properties)) ++c.remesh_on_data_count;
  if (!properties.faces.empty()) ++c.textured_count;
  if (is_shaped) ++c.shaped_count;
  if (is_turned) ++c.turned_count;
  c.fluid_groups.push_back(fluid_groups_of(properties));
  if (c.fluid_groups.back() != 0) ++c.fluid_count;
  std::uint32_t first_of = 0;  // groups that had no fluid
  for (std::uint32_t left = c.fluid_groups.back(); left != 0; left &= left - 1) {
    VoxelType& first = c.first_fluid_of[static_cast<std::size_t>(std::countr_zero(left))];
    if (first != kAir) continue;
    first = type;
    first_of |= left & (~left + 1);
  }
  c.properties.push_back(std::move(properties));
  if (visibility == Visibility::Transparent) ++c.transparent_count;
  if (occlusion != visibility) ++c.unoccluding_count;
  note({type, occlusion != Visibility::Opaque, true, is_shaped || is_turned});
  // Voxels that contain a fluid show it by its type, which no voxel may have.
  for_each_holder(c.properties, first_of, [&](VoxelType holder) { note({holder, false, false, true}); });
  return type;
}

void VoxelRegistry::Content::find_first_fluids() noexcept {
  first_fluid_of.fill(kAir);
  for (std::size_t type = fluid_groups.size(); type-- > 1;) {
    for (std::uint32_t left = fluid_groups[type]; left != 0; left &= left - 1) {
      first_fluid_of[static_cast<std::size_t>(std::countr_zero(left))] = static_cast<VoxelType>(type);
    }
  }
}

VoxelType VoxelRegistry::first_fluid(std::uint32_t groups) const {
  if (!has_fluids()) return kAir;
  VoxelType first = kAir;
  for (; groups != 0; groups &= groups - 1) {
    const VoxelType each = content_->first_fluid_of[static_cast<std::size_t>(std::countr_zero(groups))];
    if (each != kAir && (first == kAir || each < first)) first = each;
  }
  return first;
}

std::optional<VoxelType> VoxelRegistry::find(std::string_view name) const {
  for (std::size_t type = 1; type < size(); ++type) {
    if (content_->properties[type].name == name) return static_cast<VoxelType>(type);
  }
  return std::nullopt;
}

Result<VoxelType> VoxelRegistry::find_or_add(const VoxelProperties& properties) {
  if (properties.blocks_light || properties.occludes || !properties.faces.empty()) {
    if (Status valid = validate_type(properties); !valid) return valid.error();
    if (VoxelProperties stored = properties; settle(stored)) return find_or_add(stored);
  }
  const auto [first, last] = std::as_const(content_->by_hash).equal_range(hash_of(properties));
  for (auto it = first; it != last; ++it) {
    if (is_same((*this)[it->second], properties)) return it->second;
  }
  return add(properties);
}

void VoxelRegistry::replace(VoxelType type, VoxelProperties properties) {
  QUOIN_ASSERT(type != kAir && type < size(), "a registered type, not air");
  QUOIN_ASSERT(properties.visibility != Visibility::Air, "type 0 is the only air");
  QUOIN_ASSERT(validate_type(properties), "properties that `validate_type` accepts");
  settle(properties);
  journal_->begin_change();
  content_.make_own();
  Content& c = *content_;
  c.share_textures(properties.faces);
  const auto [first, last] = c.by_hash.equal_range(hash_of(c.properties[type]));
  const auto old = std::find_if(first, last, [type](const auto& each) { return each.second == type; });
  c.by_hash.emplace(hash_of(properties), type);
  if (old != last) c.by_hash.erase(old);
  const Visibility visibility = visibility_of(properties);
  const Visibility was = std::exchange(c.visibility[type], visibility);
  QUOIN_ASSERT(was != Visibility::Transparent || c.transparent_count != 0, "transparent types are counted");
  if (was == Visibility::Transparent) --c.transparent_count;
  if (visibility == Visibility::Transparent) ++c.transparent_count;
  const Visibility occluded = std::exchange(c.occlusion[type], occlusion_of(properties));
  QUOIN_ASSERT(occluded == was || c.unoccluding_count != 0, "types that do not occlude are counted");
  if (occluded != was) --c.unoccluding_count;
  if (c.occlusion[type] != visibility) ++c.unoccluding_count;
  QUOIN_ASSERT(c.properties[type].collides || c.passable_count != 0, "passable types are counted");
  if (!c.properties[type].collides) --c.passable_count;
  if (!properties.collides) ++c.passable_count;
  const VoxelProperties& old_properties = c.properties[type];
  c.remesh_on_data_count += std::size_t{remeshes(properties)} - std::size_t{remeshes(old_properties)};
  c.shaped_count += std::size_t{!properties.shapes.empty()} - std::size_t{!old_properties.shapes.empty()};
  c.turned_count += std::size_t{!properties.orientations.empty()} - std::size_t{!old_properties.orientations.empty()};
  c.release_textures(c.properties[type].faces);
  if (!c.properties[type].faces.empty()) --c.textured_count;
  if (!properties.faces.empty()) ++c.textured_count;
  // Shapes of types without states take state 0, also where a fluid's data says otherwise.
  const bool reads_state_otherwise =
      !properties.shapes.empty() && (c.properties[type].state_bits == 0) != (properties.state_bits == 0);
  const bool is_formed_otherwise =
      reads_state_otherwise ||
      !(c.properties[type].shapes == properties.shapes && c.properties[type].orientations == properties.orientations);
  // Equal shapes stay the same, with the models that consumers know.
  if (!is_formed_otherwise) properties.shapes = c.properties[type].shapes;
  // Shapes hide and light by their material, which VoxelRegistry::visibility does not show.
  const bool is_seen_otherwise =
      was != visibility || occluded != c.occlusion[type] || c.properties[type].visibility != properties.visibility;
  const bool is_coloured_otherwise =
      !(c.properties[type].colour == properties.colour && c.properties[type].faces == properties.faces &&
        c.properties[type].field_textures == properties.field_textures);
  const std::uint32_t groups = fluid_groups_of(properties);
  const std::uint32_t had = std::exchange(c.fluid_groups[type], groups);
  if (had != groups) {
    c.fluid_count += std::size_t{groups != 0} - std::size_t{had != 0};
    c.find_first_fluids();
  }
  const TypeChange change{type, is_seen_otherwise, is_coloured_otherwise, is_formed_otherwise};
  c.properties[type] = std::move(properties);
  note(change);
  if (!is_seen_otherwise && !is_coloured_otherwise && !is_formed_otherwise) return;
  for_each_holder(c.properties, had | groups, [&](VoxelType holder) { note({holder, false, false, true}); });
}

ChangeCursor VoxelRegistry::cursor() const {
  QUOIN_ASSERT(journal_ != nullptr, "a registry that was not moved from");
  return journal_->present();
}

bool VoxelRegistry::has_changed_since(const ChangeCursor& cursor) const {
  QUOIN_ASSERT(journal_ != nullptr, "a registry that was not moved from");
  return journal_->has_changed_since(cursor);
}

TypeChanges VoxelRegistry::changes_since(ChangeCursor& cursor) const {
  QUOIN_ASSERT(journal_ != nullptr, "a registry that was not moved from");
  const auto by_type = [](const TypeRecord& a, const TypeRecord& b) { return a.type < b.type; };
  return journal_->changes_since<TypeChange>(cursor, by_type);
}

}  // namespace quoin

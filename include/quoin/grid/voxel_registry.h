#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/parallel.h>
#include <quoin/core/ref.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_shape.h>

namespace [[gnu::visibility("default")]] quoin {

/// The id of a voxel type: an index into a VoxelRegistry. 0 is air in every registry.
using VoxelType = std::uint16_t;
inline constexpr VoxelType kAir = 0;
/// Maximum number of types in a registry, without air.
inline constexpr std::size_t kMaxVoxelTypes = 65'535;

/// Number of bits in the state word of a voxel (VoxelData).
inline constexpr std::uint8_t kMaxStateBits = 32;
/// The level of full propagated light, and so the highest cost of a step (VoxelProperties::light_cost).
inline constexpr std::uint8_t kMaxLightCost = 15;

/// The role of a voxel type in sight, and the default of its other optical properties (VoxelProperties):
///
///              faces behind it   `blocks_light`   `occludes`
///   Opaque     hidden            true             true
///   Transparent  shown           false            false
///
/// Rays see an opaque type as a solid surface and a transparent one as glass (or as a medium, if it scatters light).
/// Textured transparent types can also be hollow cells of faces (FaceAlpha), such as leaves.
/// A transparent type also hides the faces between two of its own voxels.
enum class Visibility : std::uint8_t { Air, Opaque, Transparent };

/// The look of a type's textures on the surfaces of density fields, where each texture is projected along its axis: the
/// upper and the lower one on flat ground, those of the sides on slopes. Grass above and rock at the sides thus give
/// hills whose steep parts are bare.
struct FieldTextures {
  float voxels = 1.0F;          ///< edge of the square that a texture covers, in voxels
  float flat_degrees = 35.0F;   ///< up to this slope, ground shows the upper (or lower) texture only
  float steep_degrees = 55.0F;  ///< from this slope on, it shows those of the sides only; blended in between

  bool operator==(const FieldTextures&) const = default;
};

/// The rule of FieldTextures, prepared for many points. A point of a field's surface shows up to three of a type's
/// textures, one per axis of the grid: the upper side's (PosX, PosY, PosZ) where the normal's component is at least 0,
/// else the lower side's. A texture lies on the surface as it lies on its face of a voxel at the position
/// fract(p * textures_per_voxel), where p is the point in voxels of the full grid.
///
/// Source: R. Geiss, "Generating complex procedural terrains using the GPU" (GPU Gems 3, 2007), triplanar texturing.
struct TriplanarRule {
  float textures_per_voxel = 1.0F;
  float steep_y = 0.0F;  ///< unit normals with at most this |y| show textures of sides only
  float flat_y = 1.0F;   ///< unit normals with at least this |y| show the upper or lower texture only

  TriplanarRule() = default;
  explicit TriplanarRule(const FieldTextures& textures) : textures_per_voxel(1.0F / textures.voxels) {
    constexpr float kRadians = std::numbers::pi_v<float> / 180.0F;
    flat_y = std::cos(textures.flat_degrees * kRadians);
    // Slopes that hardly differ can have the same cosine.
    steep_y = std::min(std::cos(textures.steep_degrees * kRadians), std::nextafter(flat_y, 0.0F));
  }

  /// Returns the weights of the textures along x, y and z. Their sum is 1. `normal`: unit, or 0 for sides in equal
  /// parts.
  [[nodiscard]] std::array<float, 3> weights(const Vec3& normal) const {
    const float rise = std::clamp((std::abs(normal.y) - steep_y) / (flat_y - steep_y), 0.0F, 1.0F);
    const float upper = rise * rise * (3.0F - 2.0F * rise);
    // Fourth powers keep the range narrow in which both pairs of sides are seen.
    const float x = normal.x * normal.x * normal.x * normal.x;
    const float z = normal.z * normal.z * normal.z * normal.z;
    const float share_of_x = x + z > 0.0F ? x / (x + z) : 0.5F;
    return {(1.0F - upper) * share_of_x, upper, (1.0F - upper) * (1.0F - share_of_x)};
  }
};

/// The properties of a voxel type.
struct VoxelProperties {
  std::string name{};
  Rgba8 colour{};  ///< sRGB; an alpha below 255 matters only for transparent types; see `faces`
  Visibility visibility = Visibility::Opaque;
  bool collides = true;    ///< true if it stops moving bodies
  float roughness = 1.0F;  ///< glTF's perceptual roughness, 0 to 1
  float metalness = 0.0F;  ///< 0 to 1
  /// Radiance emitted, as a multiple of the colour in linear light; 0 is none. Each face has a share of it
  /// (VoxelFace::emission_share), by default all. Propagated light goes by the type alone, as in block games.
  float emission = 0.0F;
  float ior = 1.5F;  ///< index of refraction, used by transparent types
  /// Mean number of scattering events per voxel length in path tracing, for transparent media such as clouds. `colour`
  /// is then the albedo: the fraction of light that each event keeps. 0: glass.
  float scattering = 0.0F;
  float anisotropy = 0.0F;  ///< mean cosine of the scattering angle, -1 to 1
  /// Additional properties of a file format ("_spec" -> "0.3"), kept so that writing the format again loses nothing.
  std::map<std::string, std::string> attributes{};
  /// Number of bits that the state word (VoxelData) of this type may use, from the lowest bit up; 0 means no state.
  /// `Grid::set_data` does not know the types and accepts any state. `save_scene` and WorldStore::save refuse a scene
  /// in which a state uses more bits.
  std::uint8_t state_bits = 0;
  /// True for types that a game draws by their data in ways of its own (types with `shapes` or `orientations` need no
  /// flag). When the data of such a voxel changes, LiveMeshes
  /// meshes its chunk again.
  bool remesh_on_data = false;

  // Each of the following properties affects the named users only. Traced shadows, traced occlusion, traced light and
  // path tracing follow `visibility`.

  /// True if propagated light does not leave a voxel of this type: a lamp's own light does, which spreads from any
  /// type. Light enters a transparent type that blocks light, or one with shapes, so that faces behind it are lit, and
  /// a room below stays dark: a roof of stairs. It enters no opaque one. Default: true for opaque types without shapes.
  /// Opaque types with shapes then stop light at the sides that a shape covers wholly (ShapeModel::covers_side).
  std::optional<bool> blocks_light{};
  /// True if voxels of this type darken the corners of faces next to them: in blocky meshes, `face_occlusion`,
  /// impostors and images with OcclusionMode::Vertex. Requires an opaque type: merging faces without loss needs
  /// occluders that hide faces. Default: true for opaque types.
  std::optional<bool> occludes{};
  /// Levels of propagated light that a step into a voxel of this type costs, 0 to 15, if more than the 1 level that any
  /// step costs. Sky light of level 15, which falls straight down through air without loss, also loses it. 1 is usual
  /// for water and leaves: the sky's level is 8 at a depth of 7 voxels, and 0 from 15 on. 15 keeps all light out.
  /// As in block games ("light block", opacity).
  std::uint8_t light_cost = 0;

  /// Textures of the six faces. With textures, `colour` is their mean, for all uses that show one colour per type:
  /// a registry sets it. Opaque types have opaque faces; cutout and translucent faces need a transparent type. Equal
  /// textures of a registry's types share their texels.
  VoxelFaces faces{};
  /// Used if the type has textures and is the material of a density field.
  FieldTextures field_textures{};
  /// The orientations of this type's faces and shapes that the state selects.
  StateOrientations orientations{};
  /// The shapes of a type that is no cube. `visibility` is then that of their material: a stair of stone is opaque,
  /// although faces behind it are shown. VoxelRegistry::visibility is Transparent for it.
  VoxelShapes shapes{};

  bool operator==(const VoxelProperties&) const = default;
};

/// The rule for a placed voxel's front (StateOrientations::front).
enum class PlacedFront : std::uint8_t {
  TowardsPlayer,   ///< a furnace
  AwayFromPlayer,  ///< stairs: the low side is at the player
  AwayFromWall,    ///< away from the face that was hit, if it is a side: a ladder; else towards the player
};

/// A player's hit on the face of a voxel, next to the voxel to place. Vectors are in the grid's space.
struct PlacingHit {
  Direction face = Direction::PosY;  ///< the face that was hit (SceneHit::face)
  Vec3 point{0.5F, 1.0F, 0.5F};      ///< the point that was hit, in voxels from the hit voxel's minimum corner
  DVec3 look{1.0, 0.0, 0.0};         ///< direction of the player's view, of any length
  /// nullopt: by the unturned shape. AwayFromPlayer if most of its surface is on the side of the front (stairs),
  /// AwayFromWall if most of it is at the back (a torch at a wall, a ladder), else TowardsPlayer (cubes).
  std::optional<PlacedFront> front{};
};

/// Returns the state of a voxel that a player places: selects the type's orientation that fits the hit best, and keeps
/// the other bits of `state`.
///
/// +Y matters first. If orientations turn it sideways (a torch, a log), it points away from the face that was hit, or
/// at least along its axis. If they only turn it up or down (slabs, stairs), it points down below a ceiling and in the
/// upper half of a side. Among equal ones, the front decides (PlacedFront); then the lowest value.
///
///   if (const auto hit = pick(tracer, camera, pixel)) {
///     const PlacingHit at{.face = hit->face, .point = Vec3(hit->position - DVec3(hit->voxel)), .look = ray.direction};
///     world.set(hit->voxel + normal_of(hit->face), stairs, {.state = placed_state(types[stairs], at)});
///   }
[[nodiscard]] std::uint32_t placed_state(const VoxelProperties& type, const PlacingHit& hit, std::uint32_t state = 0);

/// Calls `visit` for each face of a type (`faces`, in the order of kDirections) and each face of its shapes that has a
/// look of its own, in the order of parts, elements and kDirections. Equal textures occur several times.
void for_each_look(const VoxelProperties& type, FunctionRef<void(const VoxelFace& look)> visit);

class VoxelRegistry;

/// Makes the texels of all deferred textures of types (Texture::deferred) on several threads, for a caller that then
/// reads them all. Returns the types. Cost: a look at each face if there are none. Memory: all texels, from now on.
const VoxelRegistry& decode_textures(const VoxelRegistry& types, Threads threads);

/// Returns an error if a registry does not accept a type's properties. The message names the type and the property.
///
/// Errors: InvalidArgument if `visibility` is Air, `state_bits` exceeds 32, `light_cost` exceeds 15, a type that is
/// transparent or has shapes occludes, a face (of the type or of its shapes) has no texture, a turn above 3, an alpha
/// mode that its texture or `visibility` does not allow, or orientations or shapes use bits that `state_bits` does not
/// declare, or `field_textures` has an edge that is not from 1/64 to 4,096, or slopes that are not
/// 0 <= flat < steep <= 90.
[[nodiscard]] Status validate_type(const VoxelProperties& properties);

/// A type that was added or replaced, or can contain a fluid that was. Properties without a flag below can differ too.
struct TypeChange {
  VoxelType type = kAir;
  bool visibility_changed =
      false;                    ///< `visibility`, also of shapes' material, or `occludes`; an unregistered type counts
                                ///< as opaque, with defaults
  bool colour_changed = false;  ///< `colour`, `faces`, `field_textures`; also true if it was added
  bool shape_changed = false;   ///< `shapes` or `orientations`, also if it was added with some; or a fluid that its
                                ///< voxels can contain (ShapeRules::fluid) changed or became the first of its group
};
using TypeChanges = Changes<TypeChange>;

/// Returns true if the visibility or occlusion of any type changed or may have changed. It is then not enough to
/// update changed chunks: rebuild all meshes and ray-tracing trees.
[[nodiscard]] bool has_other_visibility(const TypeChanges& changes);

/// The voxel types of a scene. Meshing, tracing and lighting look up type visibility here.
///
/// Copies share their content until either is changed, as Grid snapshots do. Until then, a cursor of either also works
/// with the other. Threads: same as Grid. Cost: `visibility` is one array lookup.
/// Moving: a moved-from registry can only be assigned to or destroyed.
class VoxelRegistry {
 public:
  /// Creates a registry that contains only air.
  VoxelRegistry();
  VoxelRegistry(const VoxelRegistry& other);
  VoxelRegistry(VoxelRegistry&&) noexcept;
  VoxelRegistry& operator=(const VoxelRegistry& other);
  VoxelRegistry& operator=(VoxelRegistry&&) noexcept;
  ~VoxelRegistry();

  /// Adds a type and returns its id. Ids count up from 1. `blocks_light` and `occludes` become empty if they equal
  /// their defaults. If the type has textures, `colour` becomes the mean of `faces`, and the alpha of tints 255.
  ///
  /// Errors: LimitExceeded above kMaxVoxelTypes types; those of `validate_type`.
  [[nodiscard]] Result<VoxelType> add(VoxelProperties properties);

  /// Returns the id of a type with equal properties, or adds one. Errors: same as `add`. Cost: O(log types).
  [[nodiscard]] Result<VoxelType> find_or_add(const VoxelProperties& properties);

  /// Returns the type with a name, or nullopt; the lowest id if there are several. Cost: O(types).
  [[nodiscard]] std::optional<VoxelType> find(std::string_view name) const;

  /// Replaces the properties of a type, as `add` stores them. Existing meshes and images are not updated;
  /// `changes_since` reports the change.
  ///
  /// Requires: type is not air and is registered; `validate_type` returns no error.
  void replace(VoxelType type, VoxelProperties properties);

  /// Returns the properties of a type. Lifetime: until a type is added or replaced. Requires: `type < size()`.
  [[nodiscard]] const VoxelProperties& operator[](VoxelType type) const {
    QUOIN_ASSERT(type < size(), "a registered type");
    return content_->properties[type];
  }

  /// Returns the number of ids in use, including air. Every id below it is valid.
  [[nodiscard]] std::size_t size() const {
    QUOIN_ASSERT(content_ != nullptr, "a registry that was not moved from");
    return content_->properties.size();
  }

  /// Returns the visibility of a whole voxel of a type: Transparent for types with shapes, else
  /// VoxelProperties::visibility. An unregistered id counts as opaque, so that a wrong id is visible.
  [[nodiscard]] Visibility visibility(VoxelType type) const {
    const std::vector<Visibility>& all = content_->visibility;
    return type < all.size() ? all[type] : Visibility::Opaque;
  }
  [[nodiscard]] bool is_opaque(VoxelType type) const { return visibility(type) == Visibility::Opaque; }
  [[nodiscard]] bool is_transparent(VoxelType type) const { return visibility(type) == Visibility::Transparent; }
  /// Returns true if a type darkens corners (VoxelProperties::occludes). An unregistered id does.
  [[nodiscard]] bool occludes(VoxelType type) const { return occlusion(type) == Visibility::Opaque; }
  /// Returns Transparent for opaque types that do not occlude, else the visibility. Cost: as `visibility`.
  [[nodiscard]] Visibility occlusion(VoxelType type) const {
    const std::vector<Visibility>& all = content_->occlusion;
    return type < all.size() ? all[type] : Visibility::Opaque;
  }
  /// Returns true if propagated light does not leave a type (VoxelProperties::blocks_light). An unregistered id blocks.
  [[nodiscard]] bool blocks_light(VoxelType type) const {
    return type >= size() || content_->properties[type].blocks_light.value_or(is_opaque(type));
  }
  /// Returns true if any registered opaque type does not occlude.
  [[nodiscard]] bool has_unoccluding() const { return content_->unoccluding_count > 0; }
  /// Returns true if any registered type is transparent.
  [[nodiscard]] bool has_transparent() const { return content_->transparent_count > 0; }
  /// Returns true if any registered type except air does not stop moving bodies (VoxelProperties::collides).
  [[nodiscard]] bool has_passable() const { return content_->passable_count > 0; }
  /// Returns true if the type is registered and its data changes meshes: it has shapes or orientations, or
  /// VoxelProperties::remesh_on_data.
  [[nodiscard]] bool remeshes_on_data(VoxelType type) const {
    if (!has_remesh_on_data() || type >= size()) return false;
    const VoxelProperties& properties = content_->properties[type];
    return properties.remesh_on_data || !properties.shapes.empty() || !properties.orientations.empty();
  }
  /// Returns true if the data of any registered type changes meshes.
  [[nodiscard]] bool has_remesh_on_data() const { return content_->remesh_on_data_count > 0; }
  /// Returns true if any registered type has textures (VoxelProperties::faces).
  [[nodiscard]] bool has_textures() const { return content_->textured_count > 0; }

  /// Returns true if the type is registered and has shapes (VoxelProperties::shapes).
  [[nodiscard]] bool is_shaped(VoxelType type) const {
    return has_shapes() && type < size() && !content_->properties[type].shapes.empty();
  }
  /// Returns the groups of a fluid (ShapeNeighbours::Fluid); 0 for other types.
  [[nodiscard]] std::uint32_t fluid_groups(VoxelType type) const {
    return has_fluids() && type < size() ? content_->fluid_groups[type] : 0;
  }
  /// Returns true if both types are one type, or fluids of the same group: they hide their common faces.
  [[nodiscard]] bool joins(VoxelType a, VoxelType b) const {
    return a == b || (fluid_groups(a) & fluid_groups(b)) != 0;
  }
  /// Returns the first registered fluid with any of these groups; kAir if there is none. Cost: O(groups), O(1) without
  /// fluids.
  [[nodiscard]] VoxelType first_fluid(std::uint32_t groups) const;
  /// Returns true if any registered type is a fluid.
  [[nodiscard]] bool has_fluids() const { return content_->fluid_count > 0; }
  /// Returns true if any registered type has shapes.
  [[nodiscard]] bool has_shapes() const { return content_->shaped_count > 0; }
  /// Returns true if the state of a type turns it (VoxelProperties::orientations).
  [[nodiscard]] bool is_turned_by_state(VoxelType type) const {
    return has_turned_by_state() && type < size() && !content_->properties[type].orientations.empty();
  }
  /// Returns true if the state turns any registered type.
  [[nodiscard]] bool has_turned_by_state() const { return content_->turned_count > 0; }

  /// Returns the types that were added or replaced since the cursor's last read, and types that can contain such a
  /// fluid (TypeChange::shape_changed), ordered by id, and moves the cursor to the present. Cost: O(changed types).
  /// See ChangeCursor.
  [[nodiscard]] TypeChanges changes_since(ChangeCursor& cursor) const;
  /// Returns true if any type has changed since the cursor. Cost: O(1).
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const;
  /// Returns a cursor at the present. It reports changes from now on.
  [[nodiscard]] ChangeCursor cursor() const;

 private:
  struct Content : RefCounted {
    std::vector<VoxelProperties> properties;
    std::vector<Visibility> visibility;
    std::vector<std::uint64_t> serials;  // serial of each type's last record in the journal
    std::multimap<std::uint64_t, VoxelType> by_hash;
    std::size_t transparent_count = 0;
    std::size_t passable_count = 0;
    std::vector<Visibility> occlusion;  // see `occlusion`
    std::size_t unoccluding_count = 0;  // opaque types that do not occlude
    std::size_t remesh_on_data_count = 0;
    std::size_t textured_count = 0;
    std::size_t shaped_count = 0;
    std::size_t turned_count = 0;  // types that their state turns
    std::size_t fluid_count = 0;
    std::vector<std::uint32_t> fluid_groups;     // by type; see `fluid_groups`
    std::array<VoxelType, 32> first_fluid_of{};  // by the bit of a group; kAir: there is none

    struct SharedTexture {
      Texture texture;
      std::size_t faces = 0;  // that use it
    };
    std::multimap<std::uint64_t, SharedTexture> textures;  // of all types, each once, by hash

    // Finds `first_fluid_of` after the fluids have changed.
    [[gnu::visibility("hidden")]] void find_first_fluids() noexcept;
    // Makes a type's faces use the texels of equal textures of other types. If it throws, some texels are kept longer.
    [[gnu::visibility("hidden")]] void share_textures(VoxelFaces& faces);
    [[gnu::visibility("hidden")]] void release_textures(const VoxelFaces& faces) noexcept;
  };
  struct [[gnu::visibility("hidden")]] Journal;
  void note(TypeChange change);

  Ref<Content> content_;
  std::unique_ptr<Journal> journal_;
};

/// Returns true if the neighbour of a voxel in a direction covers a face (ModelFace::mask) on the voxel's side there.
/// `neighbour_model`: null for a cube. `type`: of the voxel with the face: voxels of one transparent type, and
/// fluids of the same group (VoxelRegistry::joins), hide each other's common faces.
[[nodiscard]] bool covers(const VoxelRegistry& types, VoxelType neighbour, const ShapeModel* neighbour_model,
                          VoxelType type, Direction direction, const SideMask& mask);

}  // namespace quoin

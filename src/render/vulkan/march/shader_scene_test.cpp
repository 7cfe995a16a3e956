// Reads the tables for shaders outside of this library as those shaders do: 32-bit words, and addresses in bytes.

#include "render/vulkan/march/shader_scene.h"

#include <array>
#include <bit>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/vulkan/march/device_scene.h"
#include "render/vulkan/trees/tree_packing.h"
#include "scene/surfaces.h"

namespace quoin {
namespace {

using render_test::add_type;

class Words {
 public:
  explicit Words(std::span<const std::byte> bytes) : words_(bytes.size() / 4) {
    std::memcpy(words_.data(), bytes.data(), words_.size() * 4);
  }
  [[nodiscard]] std::uint32_t operator()(std::uint64_t address) const { return words_.at(address / 4); }
  [[nodiscard]] std::uint64_t wide(std::uint64_t address) const {
    return (*this)(address) | std::uint64_t{(*this)(address + 4)} << 32;
  }
  template <class T>
  [[nodiscard]] T read(std::uint64_t address) const {
    std::array<std::uint32_t, sizeof(T) / 4> raw{};
    for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = (*this)(address + 4 * i);
    return std::bit_cast<T>(raw);
  }

 private:
  std::vector<std::uint32_t> words_;
};

// Descends a tree in the same way as walk.wgsl, to the type of a voxel; nullopt if the tree does not contain it.
std::optional<VoxelType> type_in(const Words& words, const vulkan::ShaderTree& tree, IVec3 voxel) {
  for (int axis = 0; axis < 3; ++axis) {
    if (voxel[axis] < tree.low[axis] || voxel[axis] >= tree.high[axis]) return std::nullopt;
  }
  std::uint64_t mask = tree.root.mask;
  std::uint64_t children = tree.root.children;
  std::uint64_t record = 0;
  for (int level = tree.low.w;; --level) {
    if (level == 2) record = children & ~std::uint64_t{31};
    const IVec3 place = (voxel >> (2 * level)) & 3;
    const int index = place.x + 4 * place.y + 16 * place.z;
    if ((mask >> index & 1) == 0) return std::nullopt;
    if (level == 0 || (children & 1) != 0) break;
    const auto child = static_cast<std::uint64_t>(std::popcount(mask & ((std::uint64_t{1} << index) - 1)));
    const std::uint64_t at = children + child * (level > 1 ? 16 : 8);
    mask = words.wide(at);
    children = level > 1 ? words.wide(at + 8) : 1;
  }
  const std::uint32_t bits = words(record + 8);
  if (bits == 0) return static_cast<VoxelType>(words(record + 12));
  const std::uint64_t types = words.wide(record);
  const IVec3 at = voxel & 63;
  const std::uint32_t slab = words(types + 4 * static_cast<std::uint64_t>((at.z >> 2) * 16 + (at.y >> 2)));
  std::uint32_t index = slab & 0x7FFF'FFFF;
  if (index == slab) {
    const std::uint32_t row = slab * 16 + static_cast<std::uint32_t>((at.z & 3) * 4 + (at.y & 3));
    const std::uint32_t first = static_cast<std::uint32_t>(at.x) * bits;
    const std::uint32_t word = words(types + 4 * std::uint64_t{words(record + 12) + row * bits * 2 + first / 32});
    index = word >> (first & 31) & ((1U << bits) - 1);
  }
  if (bits == 16) return static_cast<VoxelType>(index);
  return static_cast<VoxelType>(words(types + 4 * std::uint64_t{256 + index / 2}) >> (16 * (index & 1)));
}

struct Scattered {
  Scene scene;
  VoxelType stone = add_type(scene, {90, 160, 70});
  VoxelType brick = add_type(scene, {190, 60, 30});
  VoxelType glass = add_type(scene, {60, 120, 160, 90}, Visibility::Transparent);
  VoxelType lamp = add_type(scene, {250, 220, 120}, Visibility::Opaque, 3.0F);
  GridHandle grid;

  Scattered() {
    constexpr unsigned kSeed = 20261126;
    std::mt19937 random(kSeed);
    const VoxelType types[] = {stone, brick, glass, lamp};
    SceneGrid placed;
    placed.grid.fill_box({{-70, -5, -70}, {64, 64, 10}}, stone);  // includes whole chunks, bricks and slabs
    for (int i = 0; i < 3'000; ++i) {
      const auto at = [&](int least, int most) { return std::uniform_int_distribution<int>(least, most)(random); };
      placed.grid.set({at(-90, 200), at(-20, 80), at(-80, 90)}, types[at(0, 3)]);
    }
    grid = scene.add_grid(std::move(placed));
    for (int i = 0; i < 2; ++i) {
      Instance instance;
      instance.grid = grid;
      instance.position = DVec3(300.0 * i, 0.0, 0.0);
      instance.voxel_size = 1.0 - 0.5 * i;
      scene.add_instance(std::move(instance));
    }
  }
};

TEST(ShaderScene, ReadsTreesByByteAddress) {
  Scattered made;
  const auto shaders = vulkan::ShaderScene::of(made.scene, InstanceFilter::Visible, natural_light(), {});
  ASSERT_TRUE(shaders) << to_string(shaders.error());
  const vulkan::ShaderScene& scene = **shaders;
  EXPECT_TRUE(scene.placement().has_transparent);
  EXPECT_FALSE(scene.placement().has_fields);
  const Words words(scene.bytes());
  const auto trees = words.read<vulkan::ShaderGrid>(scene.placement().grids);
  const IVec3 origin = scene.placement().placed.front().origin;
  const Grid& grid = made.scene.grids()[made.grid].grid;
  const IBox bounds = grid.bounds();
  std::int64_t opaque = 0;
  std::int64_t transparent = 0;
  for (int z = bounds.min.z - 1; z <= bounds.max.z; ++z) {
    for (int y = bounds.min.y - 1; y <= bounds.max.y; ++y) {
      for (int x = bounds.min.x - 1; x <= bounds.max.x; ++x) {
        const VoxelType expected = grid.get({x, y, z});
        const bool is_glass = expected == made.glass;
        const auto solid = type_in(words, trees.opaque, IVec3{x, y, z} - origin);
        const auto clear = type_in(words, trees.transparent, IVec3{x, y, z} - origin);
        ASSERT_EQ(solid.value_or(kAir), is_glass ? kAir : expected) << x << ' ' << y << ' ' << z;
        ASSERT_EQ(clear.value_or(kAir), is_glass ? expected : kAir) << x << ' ' << y << ' ' << z;
        opaque += solid ? 1 : 0;
        transparent += clear ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(opaque + transparent, grid.voxel_count());
  EXPECT_GT(transparent, 100);
}

TEST(ShaderScene, FrameIsFollowedByItsTables) {
  Scattered made;
  const auto shaders = vulkan::ShaderScene::of(made.scene, InstanceFilter::Visible, natural_light(), {});
  ASSERT_TRUE(shaders);
  const Camera camera = look_at({200, 120, 260}, {20, 10, 0}, 0.8).value();
  RenderOptions options;
  options.width = 32;
  options.height = 20;
  options.light = natural_light();
  options.environment = Environment::natural();
  const auto bytes = (*shaders)->frame(camera, options);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  const Words words(*bytes);
  const auto frame = words.read<vulkan::ShaderFrame>(0);
  EXPECT_EQ(frame.placed_count, 2U);
  EXPECT_NE(frame.flags & vulkan::kLamps, 0U);
  EXPECT_NE(frame.flags & vulkan::kFixedDirections, 0U);
  for (const std::uint64_t table : {frame.placed, frame.tree, frame.leaves, frame.directions, frame.lamps}) {
    EXPECT_GE(table, sizeof(vulkan::ShaderFrame));
    EXPECT_EQ(table % 16, 0U);
  }
  const auto second = words.read<vulkan::ShaderPlaced>(frame.placed + sizeof(vulkan::ShaderPlaced));
  EXPECT_FLOAT_EQ(second.ref_inside.w, 0.5F) << "the size of its voxels";
  // The surfaces of types are stored with the scene.
  const Words scene((*shaders)->bytes());
  const auto colour = scene.read<vulkan::Vec4>(frame.surfaces + std::uint64_t{made.brick} * 3 * sizeof(vulkan::Vec4));
  EXPECT_EQ(Vec3(colour), Surfaces(made.scene.types)[made.brick].colour);
  EXPECT_EQ(words.read<float>(frame.thresholds + 4 * 255), words.read<float>(bytes->size() - 4));
}

TEST(ShaderScene, RejectsEmptyImage) {
  Scattered made;
  const auto shaders = vulkan::ShaderScene::of(made.scene, InstanceFilter::Visible, natural_light(), {});
  ASSERT_TRUE(shaders);
  RenderOptions options;
  options.light = natural_light();
  options.environment = Environment::natural();
  options.width = 0;
  const auto frame = (*shaders)->frame(look_at({9, 9, 9}, {0, 0, 0}, 0.8).value(), options);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::InvalidArgument);
}

TEST(ShaderBytes, RejectsMoreThanAddressableBytes) {
  vulkan::ShaderBytes memory;
  const auto first = memory.allocate(1, "trying");
  ASSERT_TRUE(first);
  EXPECT_EQ(first->size, vulkan::ShaderMemory::kAlignment);
  EXPECT_EQ(first->address % vulkan::ShaderMemory::kAlignment, 0U);
  EXPECT_NE(first->address, 0U);
  const std::byte value{7};
  ASSERT_TRUE(memory.write(*first, {&value, 1}, 5));
  EXPECT_EQ(memory.bytes()[first->address + 5], value);
  for (const std::uint64_t size : {vulkan::ShaderBytes::kMost, ~std::uint64_t{0}}) {
    const auto second = memory.allocate(size, "trying");
    ASSERT_FALSE(second) << size;
    EXPECT_EQ(second.error().code, ErrorCode::LimitExceeded);
  }
}

/// Counts the places in use and the writes that wait for `flush`. One allocation fails, or throws.
class QueuedMemory final : public vulkan::ShaderMemory {
 public:
  Result<vulkan::Place> allocate(std::uint64_t size, const std::string& doing) override {
    if (left == 0 && throws) throw std::bad_alloc();
    if (left-- == 0) return make_error(ErrorCode::LimitExceeded, doing);
    ++held;
    return vulkan::Place{.size = size};
  }
  void release(vulkan::Place& place) override {
    held -= place.size != 0 ? 1 : 0;
    place = {};
  }
  Status write(const vulkan::Place& /*place*/, std::span<const std::byte> /*bytes*/,
               std::uint64_t /*offset*/) override {
    ++queued;
    ++written;
    return {};
  }
  Status flush() override {
    flushed = std::exchange(queued, 0);
    return {};
  }
  void discard() override { queued = 0; }

  int left = -1;  // allocations before the one that fails; negative: none fails
  bool throws = false;
  int held = 0;
  int queued = 0;
  int flushed = 0;  // by the last flush
  int written = 0;
};

TEST(DeviceLamps, DiscardsWritesOfFailedCall) {
  const auto table = std::make_shared<LampTable>();
  table->bricks.resize(4);
  table->lists.resize(4);
  QueuedMemory memory;
  vulkan::DeviceLamps lamps;
  memory.left = 1;  // the lists find no place, after the bricks were written
  EXPECT_FALSE(lamps.put(memory, table));
  EXPECT_EQ(lamps.table, nullptr);
  EXPECT_EQ(memory.queued, 0);
  memory.left = 0;
  memory.throws = true;
  EXPECT_THROW(static_cast<void>(lamps.put(memory, table)), std::bad_alloc);
  memory.left = -1;
  ASSERT_TRUE(lamps.put(memory, table));
  EXPECT_EQ(lamps.table, table);
  EXPECT_EQ(memory.flushed, 2) << "bricks and lists";
}

Texture grey(int size, std::uint8_t value) {
  AlphaImage image{size, size, std::vector<std::uint8_t>(static_cast<std::size_t>(4 * size * size), value)};
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return Texture::from_image("grey", image).value();
}

VoxelProperties textured(const VoxelFaces& faces) {
  VoxelProperties type;
  type.faces = faces;
  return type;
}

TEST(DeviceTextures, SendsEachTextureOnce) {
  constexpr int kTables = 2;  // numbers of types, and faces
  VoxelRegistry types;
  const Texture shared = grey(16, 20);
  const VoxelType first =
      types.add(textured(VoxelFaces(VoxelFace{shared}, VoxelFace{grey(32, 90)}, VoxelFace{shared}))).value();
  ASSERT_TRUE(types.add(textured(VoxelFace{.texture = grey(16, 20), .turn = 3})));
  QueuedMemory memory;
  vulkan::KnownTexels known;
  vulkan::DeviceTextures textures(memory, known);
  EXPECT_TRUE(textures.empty());
  ASSERT_TRUE(textures.put(types));
  EXPECT_FALSE(textures.empty());
  EXPECT_EQ(memory.flushed, 2 + kTables);
  memory.flushed = 0;
  ASSERT_TRUE(textures.put(types));
  EXPECT_EQ(memory.flushed, 0) << "unchanged types";
  {
    vulkan::DeviceTextures other(memory, known);
    ASSERT_TRUE(other.put(types));
    EXPECT_EQ(memory.flushed, kTables);
    EXPECT_EQ(memory.held, 2 + 2 * kTables);
    types.replace(first, textured(grey(64, 70)));
    ASSERT_TRUE(textures.put(types));
    EXPECT_EQ(memory.flushed, 1 + kTables);
    EXPECT_EQ(known.size(), 3U) << "the other table still shows the texture that was replaced";
  }
  EXPECT_EQ(known.size(), 2U);
  EXPECT_EQ(memory.held, 2 + kTables);
  for (VoxelType type = first; type < types.size(); ++type) types.replace(type, {});
  ASSERT_TRUE(textures.put(types));
  EXPECT_TRUE(textures.empty());
  EXPECT_EQ(memory.held, 0);
}

// Meshes show the textures of cutouts and glass.
TEST(DeviceTextures, SendsTransparentTypes) {
  VoxelRegistry types;
  VoxelProperties glass = textured(grey(16, 20));
  glass.visibility = Visibility::Transparent;
  const VoxelType type = types.add(glass).value();
  QueuedMemory memory;
  vulkan::KnownTexels known;
  vulkan::DeviceTextures textures(memory, known);
  ASSERT_TRUE(textures.put(types));
  EXPECT_FALSE(textures.empty());
  EXPECT_TRUE(textures.has_cells());
  EXPECT_EQ(known.size(), 1U);
  VoxelProperties shaped = glass;
  shaped.shapes = VoxelShape::crossed_plates();
  types.replace(type, shaped);
  ASSERT_TRUE(textures.put(types));
  EXPECT_FALSE(textures.empty());
  EXPECT_FALSE(textures.has_cells()) << "a shape";
  types.replace(type, textured(grey(16, 20)));
  ASSERT_TRUE(textures.put(types));
  EXPECT_FALSE(textures.has_cells()) << "an opaque type";
  types.replace(type, glass);
  ASSERT_TRUE(textures.put(types));
  EXPECT_TRUE(textures.has_cells());
  types.replace(type, {});
  ASSERT_TRUE(textures.put(types));
  EXPECT_TRUE(textures.empty());
  EXPECT_FALSE(textures.has_cells());
}

TEST(DeviceTextures, IsEmptyAfterFailedCall) {
  VoxelRegistry types;
  ASSERT_TRUE(types.add(textured(VoxelFaces(VoxelFace{grey(16, 1)}, VoxelFace{grey(16, 2)}, VoxelFace{grey(16, 3)}))));
  for (const bool throws : {false, true}) {
    for (int successes = 0; successes < 5; ++successes) {  // three textures and two tables
      QueuedMemory memory;
      memory.left = successes;
      memory.throws = throws;
      vulkan::KnownTexels known;
      vulkan::DeviceTextures textures(memory, known);
      if (throws) {
        EXPECT_THROW(static_cast<void>(textures.put(types)), std::bad_alloc);
      } else {
        const Status done = textures.put(types);
        ASSERT_FALSE(done);
        EXPECT_EQ(done.error().code, ErrorCode::LimitExceeded);
        EXPECT_EQ(done.error().message, successes < 3 ? "uploading textures" : "uploading the scene");
      }
      EXPECT_TRUE(textures.empty());
      EXPECT_TRUE(known.empty());
      EXPECT_EQ(memory.held, 0);
      EXPECT_EQ(memory.queued, 0);
      memory.left = -1;
      ASSERT_TRUE(textures.put(types));
      EXPECT_EQ(memory.flushed, 5);
    }
  }
}

// An image that shows new models may fail; the scene's models must survive that.
TEST(DeviceShapes, KeepsSentModelsIfMemoryIsFull) {
  VoxelRegistry types;
  const ShapeTypes all(types);
  QueuedMemory memory;
  vulkan::KnownTexels known;
  vulkan::DeviceShapes shapes(memory, known);
  shapes.use(types);
  const auto add = [&](VoxelType type) {
    return static_cast<bool>(shapes.shape_of({IVec3(0), type, &types[type].shapes.model(0, {}, {})}));
  };
  ASSERT_TRUE(add(all.slab));
  ASSERT_TRUE(shapes.send());
  ASSERT_TRUE(add(all.stairs));
  const int held = memory.held;
  memory.left = 0;
  EXPECT_FALSE(shapes.send());
  EXPECT_EQ(memory.held, held);
  memory.left = -1;
  ASSERT_TRUE(shapes.send());
  EXPECT_EQ(memory.held, held) << "the smaller table is released";
  EXPECT_EQ(memory.queued, 0) << "nothing that a failed image would discard";
}

// Device memory for textures is that of their texels: 22 MB for 1,024 textures of 64 texels per side.
TEST(DeviceTextures, TakesMemoryOfTexels) {
  VoxelRegistry types;
  TextureSet set;
  for (int i = 0; i < 200; ++i) {
    const Texture texture = grey(64, static_cast<std::uint8_t>(i));
    set.add(texture);
    ASSERT_TRUE(types.add(textured(texture)));
  }
  vulkan::ShaderBytes memory;
  vulkan::KnownTexels known;
  vulkan::DeviceTextures textures(memory, known);
  ASSERT_TRUE(textures.put(types));
  EXPECT_GE(memory.bytes().size(), set.bytes());
  constexpr std::size_t kFaceTables = 200 * 6 * sizeof(vulkan::ShaderTexturedFace);
  EXPECT_LE(memory.bytes().size(), set.bytes() + kFaceTables + set.bytes() / 1000);
}

// Shapes in two distant chunks, textured and with glass.
struct ShapedScene {
  Scene scene;
  ShapeTypes types{scene.types};

  ShapedScene() {
    VoxelProperties slab = textured(grey(16, 20));
    slab.shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16});
    const VoxelType type = scene.types.add(slab).value();
    Grid grid;
    grid.fill_box({{0, 0, 0}, {3, 1, 3}}, type);
    grid.fill_box({{0, 1, 0}, {3, 2, 1}}, types.pane);
    grid.fill_box({{300, 0, 0}, {303, 1, 1}}, types.fence);
    render_test::place(scene, std::move(grid));
  }
};

TEST(DeviceScene, IsEmptyAfterFailedUpdateOfShapes) {
  const ShapedScene shaped;
  const Scene& scene = shaped.scene;
  int allocations = 0;
  for (const bool throws : {false, true}) {
    for (int successes = 0;; ++successes) {
      QueuedMemory memory;
      memory.left = successes;
      memory.throws = throws;
      vulkan::KnownTexels known;
      vulkan::DeviceScene device(memory, known);
      Status done;
      try {
        done = device.update(scene, InstanceFilter::Visible, {});
      } catch (const std::bad_alloc&) {
        done = make_error(ErrorCode::LimitExceeded, "thrown");
      }
      if (done) {
        allocations = successes;
        break;
      }
      EXPECT_EQ(done.error().code, ErrorCode::LimitExceeded);
      EXPECT_EQ(memory.held, 0) << successes;
      EXPECT_EQ(memory.queued, 0) << successes;
      EXPECT_TRUE(known.empty());
      memory.left = -1;
      ASSERT_TRUE(device.update(scene, InstanceFilter::Visible, {}));
      EXPECT_TRUE(device.placement().has_shapes);
      EXPECT_TRUE(device.placement().has_transparent);
    }
    EXPECT_GT(allocations, 10);
  }
}

TEST(DeviceScene, SendsShapesOfChangedChunks) {
  ShapedScene shaped;
  Scene& scene = shaped.scene;
  QueuedMemory memory;
  vulkan::KnownTexels known;
  vulkan::DeviceScene device(memory, known);
  ASSERT_TRUE(device.update(scene, InstanceFilter::Visible, {}));
  const int all = std::exchange(memory.written, 0);
  EXPECT_EQ(known.size(), 1U);
  ASSERT_TRUE(device.update(scene, InstanceFilter::Visible, {}));
  EXPECT_EQ(memory.written, 0);
  const GridHandle grid = scene.grids().handles().front();
  ASSERT_TRUE(scene.edit(grid).grid.set_data({301, 0, 0}, {.state = 1}));
  ASSERT_TRUE(device.update(scene, InstanceFilter::Visible, {}));
  EXPECT_GT(memory.written, 0);
  EXPECT_LT(memory.written, all / 2);
  EXPECT_EQ(memory.queued, 0);
  scene.edit(grid).grid.fill_box({{0, 0, 0}, {303, 2, 3}}, shaped.types.stone);
  ASSERT_TRUE(device.update(scene, InstanceFilter::Visible, {}));
  EXPECT_FALSE(device.placement().has_shapes);
  EXPECT_FALSE(device.placement().has_transparent);
  // Scenes for other shaders show cubes.
  vulkan::DeviceScene cubes(memory);
  ASSERT_TRUE(cubes.update(ShapedScene().scene, InstanceFilter::Visible, {}));
  EXPECT_FALSE(cubes.placement().has_shapes);
  EXPECT_TRUE(cubes.placement().has_transparent);
}

TEST(ShaderBytesDeathTest, RejectsWriteBeyondPlace) {
  vulkan::ShaderBytes memory;
  const auto place = memory.allocate(32, "trying");
  ASSERT_TRUE(place);
  const std::vector<std::byte> bytes(8);
  QUOIN_EXPECT_MISTAKE(static_cast<void>(memory.write(*place, bytes, 25)), "bytes within the place");
}

TEST(ShaderBytesDeathTest, RejectsPlaceOfAnotherMemory) {
  vulkan::ShaderBytes memory;
  vulkan::ShaderBytes other;
  const auto place = other.allocate(320, "trying");
  ASSERT_TRUE(place);
  QUOIN_EXPECT_MISTAKE(static_cast<void>(memory.write(*place, {})), "an allocated place");
}

TEST(TopTreeDeathTest, RejectsChunkBeforeTreeOrigin) {
  std::vector<vulkan::ChunkNodeAt> chunks(1);
  chunks.front().chunk = {-1, 0, 0};
  QUOIN_EXPECT_MISTAKE(static_cast<void>(vulkan::build_top_tree(chunks, 32)), "chunks from the tree's origin");
}

}  // namespace
}  // namespace quoin

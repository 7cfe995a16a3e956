#pragma once

#include <array>
#include <cstdint>
#include <map>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/direction.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/occlusion.h>
#include <quoin/mesh/quad.h>

#include "core/instruction_set.h"

namespace quoin::blocky {

// A layer has one bit per voxel of a chunk and of the rows around it: planes and rows run from -1 to 64, and a word
// holds the 64 voxels of a row. Row 0 of every plane is aligned to eight words. Rows -8 to 71 may be read; those beyond
// -1 and 64 belong to the adjacent planes.
inline constexpr int kRowStride = 72;
inline constexpr int kFirstRow = 8;
inline constexpr int kLayerWords = 66 * kRowStride + kFirstRow;

constexpr int word_index(int plane, int row) {
  return (plane + 1) * kRowStride + row + kFirstRow;
}

struct alignas(64) Layer {
  std::uint64_t words[kLayerWords];
};

// The chunk seen along one axis: faces point along `plane`, runs are along `bit`, and runs of equal extent merge along
// `row`.
struct View {
  Layer opaque;    // all 66 x 66 rows
  Layer same_bit;  // same type as the next voxel in the row
  Layer same_row;  // same type as the voxel of the next row
  Layer ends;      // bit 63: the voxel before the row's first is opaque; bit 0: the one after its last (as rotated in)
  Layer faces[2];  // visible faces towards the next and the previous plane; only used with transparent types
};

// All data that the passes over one direction need for a batch of planes. Rows are numbered as in a layer: a plane
// starts kRowStride after the one before.
inline constexpr int kBatchPlanes = 8;
inline constexpr int kBatchWords = kBatchPlanes * kRowStride;

struct alignas(64) Row {
  std::uint64_t ends;
  std::uint64_t starts;
  std::uint64_t closes;
  std::uint64_t place;         // a quad's bits for its direction, plane and row
  const std::uint64_t* front;  // the row before the faces
};

struct alignas(64) Batch {
  std::uint64_t faces[kBatchWords + 8];
  std::uint64_t mergeable[kBatchWords + 8];  // faces with constant occlusion along the rows
  std::uint64_t starts[kBatchWords + 8];     // first cell of each run
  std::uint64_t ends[kBatchWords + 8];       // last cell of each run
  std::uint64_t closes[kBatchWords + 8];     // at a run's last cell: the run does not continue in the next row
  // By the column in which a run ends: its rows so far, as a quad's bits; 0 between batches.
  std::uint64_t rows_before[64];
  std::uint16_t groups[kBatchWords / 4 + 8];
  Row rows[kBatchPlanes * 64 + 8];
};

// Temporary quads for kernels that process a whole row at once: rows with runs, then the parts of each quad in separate
// arrays. Includes room for one vector after the last.
inline constexpr std::size_t kBatchQuads = std::size_t{kBatchPlanes} * 64 * 64 + 64;

struct alignas(64) Parts {
  // The first and last cell of the row in which a quad ends, the rows before it, and its eight bits of occlusion.
  static constexpr std::size_t kFirst = 0;
  static constexpr std::size_t kLast = 1;
  static constexpr std::size_t kRowsBefore = 2;
  static constexpr std::size_t kOcclusion = 3;

  std::uint16_t rows[kBatchPlanes * 64 + 8];  // words of a batch
  std::uint8_t bytes[4][kBatchQuads];
  std::uint16_t places[kBatchQuads];  // 64 * plane of the batch + row
};

// Tables from 9 front neighbours' bits to a quad's bits for occlusion and diagonal, for faces whose u is along the
// bits, and along the rows. Index: bits 0-2 the previous row (before, at, after), 3-5 this row, 6-8 the next row.
struct OcclusionTables {
  std::uint64_t u_along_bits[512];
  std::uint64_t u_along_rows[512];
  std::uint64_t places[3][kBatchWords];  // by axis: a quad's bits for the plane and row of a word of a batch
  std::uint32_t numbers[kBatchWords];    // by word of a batch: 64 * plane + row, twice
  std::uint32_t
      flips[8];  // by a quad's eight bits of occlusion: set if the quad is flipped; bit (occlusion + 6) % 32 of a word
};

// A voxel with a shape, of the chunk or next to it.
struct ShapedVoxel {
  IVec3 local{0};  // -1 to 64
  VoxelType type = kAir;
  bool is_opaque = false;   // its material: it hides and darkens faces
  bool is_fluid = false;    // the shape is that of a fluid
  std::uint32_t fluid = 0;  // groups of the fluid in the voxel, also next to another shape (ShapeRules::fluid)
  const ShapeModel* model = nullptr;
};

// The fluid next to the shape of a voxel, within the region.
struct InnerShape {
  std::uint32_t holder = 0;  // index of the voxel in ShapedVoxels::voxels
  ShapedVoxel shown;         // the fluid
};

// A question: the occlusion of a face of a voxel.
struct CornerQuery {
  const PackedFace* face;
  std::uint32_t cell;  // of the voxel, in ShapedVoxels::eighths
};

// The shaped voxels of a region and of the voxels around it.
struct ShapedVoxels {
  static constexpr int kEdge = kChunkEdge + 2;
  static constexpr int kCellStride = kChunkEdge + 16;
  static constexpr std::size_t kRows = std::size_t{kEdge} * kEdge;

  static constexpr std::uint8_t kWhole = 0x3F;     // an entry of `sides`: a voxel that covers all sides
  static constexpr std::uint8_t kPartly = 1 << 6;  // also set for shapes that cover parts of sides: ask them

  bool is_in_centre = false;           // the centre has some
  bool has_transparent_cubes = false;  // the centre has some
  Layer rows;                          // shaped voxels, in the z view's layout
  Layer ends;                          // as View::ends
  std::uint16_t listed[kRows];         // rows with shaped voxels, by z, y: 128 (z + 1) + y + 1
  std::size_t listed_count = 0;
  std::uint32_t first[kRows];       // by row_of, of listed rows: the number of voxels before the row
  BlockVector<ShapedVoxel> voxels;  // by z, y, x
  BlockVector<InnerShape> inner;    // in the order of `voxels`
  // By cell_at, valid within two voxels of shaped ones: the eighths of a voxel that darken corners
  // (ShapeModel::filled_octants), and the sides that it covers wholly, by direction.
  BlockVector<std::uint8_t> eighths;
  BlockVector<std::uint8_t> sides;
  BlockVector<std::uint16_t> near_rows;  // the rows of these cells, as in `listed`
  bool has_cells = false;
  QuadBuffer quads;  // of cubes next to shapes, which the kernel leaves out

  // The models of this job so far, in slots that their keys select.
  struct KnownModel {
    std::uint64_t job = 0;
    std::uint64_t key = 0;  // type, state and neighbours
    const ShapeModel* model = nullptr;
  };
  struct KnownType {
    std::uint64_t job = 0;
    VoxelType type = kAir;
    bool is_opaque = false;
    bool has_state = false;
    bool is_turned = false;
    bool uses_position = false;
    std::uint32_t fluid_groups = 0;  // of fluids
    const ShapeRules* rules = nullptr;
    const ShapeModel* only_model = nullptr;  // if neither state, neighbours nor position matter
  };
  std::array<KnownModel, 256> known_models{};
  std::array<KnownType, 64> known_types{};
  std::uint64_t job = 0;  // number of the present one
  // Temporary lists: shapes that follow their neighbours, keys of faces, and questions with their answers.
  struct Pending {
    std::uint32_t voxel;  // index of `voxels`
    std::uint32_t state;
  };
  BlockVector<Pending> pending;
  // The faces that passes over directions leave out, in their order: 2 (4096 plane + 64 row + bit), from 2^19 on by
  // direction; plus 1 if a shape covers the face.
  BlockVector<std::uint32_t> keys;
  BlockVector<std::uint32_t> other_keys;
  std::size_t next_key = 0;  // index of the next one of the present pass
  BlockVector<CornerQuery> queries;
  BlockVector<std::uint8_t> answers;

  static std::size_t row_of(int y, int z) { return static_cast<std::size_t>((z + 1) * kEdge + y + 1); }
  static std::uint16_t listed_row(int y, int z) { return static_cast<std::uint16_t>((z + 1) << 7 | (y + 1)); }
  static std::size_t cell_at(const IVec3& local) {
    return row_of(local.y, local.z) * kCellStride + static_cast<std::size_t>(local.x + 8);
  }
  // Returns the shaped voxel at a position within the region or next to it, or null.
  [[nodiscard]] const ShapedVoxel* at(const IVec3& local) const;
};

struct Scratch {
  View z;           // planes z, rows y, bits x
  View y;           // planes y, rows z, bits x
  View x;           // planes x, rows y, bits z
  Layer solid;      // planes z, rows y: not air
  Layer same_z;     // planes z, rows y: same type as the voxel at z + 1
  Layer planes[4];  // planes z, rows y: the bits of the palette index
  Layer sides[4];   // planes z, rows y: visible faces towards +x, -x, +y, -y; unused if all types are opaque
  Batch batch;
  Parts parts;
  OcclusionTables occlusion;
  std::uint64_t palette[256];          // types in quad position, by palette index
  std::uint32_t narrow_palette[16];    // the first entries, as in the upper half of a quad
  std::uint64_t row_masks[3][64 + 8];  // by axis of the rows: the cells of the region
  std::uint64_t patterns[256][16];     // a row of each uniform slab
  const std::uint64_t* rows[4096];     // [z * 64 + y]: packed voxels
  std::uint8_t index_class[256];       // by palette index: 0 air, 1 opaque, 2 transparent
  std::size_t quads;                   // written so far
};

// The property of types that layers of opaque voxels show.
enum class LayerClass : std::uint8_t {
  Sight,      // VoxelRegistry::visibility
  Occlusion,  // VoxelRegistry::occlusion: of opaque voxels only occluders
  Shape,      // opaque: types with shapes; transparent: all others
};

struct Kernel;

// The input of a kernel.
struct Job {
  const Neighbourhood* chunks;
  const VoxelRegistry* types;
  IBox region;  // not empty, inside the chunk, no larger than the voxels' bounds
  bool merge;
  bool occlusion;
  bool has_transparent;  // some voxel of the centre chunk is transparent
  bool one_type;         // all its voxels except air have one opaque type: the layers of equal types are not filled
  // Some opaque voxel of the 27 chunks does not occlude, and occlusion is wanted. Set only with `has_transparent`.
  bool has_unoccluding = false;
  ShapedVoxels* shapes = nullptr;  // not null: some voxel of the 27 chunks has a shape. Then `has_transparent`, too.
  const Kernel* kernel = nullptr;  // not null if there are shapes
  LayerClass by = LayerClass::Sight;
  bool has_faces = false;  // the visible faces are found: the layers of opaque voxels serve occlusion alone

  // Returns the class of a type for the layers.
  [[nodiscard]] Visibility visibility(VoxelType type) const {
    if (by == LayerClass::Sight) [[likely]]
      return types->visibility(type);
    if (by == LayerClass::Occlusion) return types->occlusion(type);
    if (type == kAir) return Visibility::Air;
    return types->is_shaped(type) ? Visibility::Opaque : Visibility::Transparent;
  }
  [[nodiscard]] bool is_opaque(VoxelType type) const { return visibility(type) == Visibility::Opaque; }
};

// One kernel per instruction set; all give the same bytes.
struct Kernel {
  void (*mesh)(const Job& job, Scratch& scratch, QuadBuffer& out);
  // Leaves the visible faces in `sides` and in the z view's `faces`, for the rows of the region.
  void (*find_faces)(const Job& job, Scratch& scratch);
  // Counts the visible faces of the region instead.
  std::int64_t (*count_faces)(const Job& job, Scratch& scratch);
  // Fills rows of cells, listed as in ShapedVoxels::listed, and the cells before and after them: `value` for the set
  // bits of `rows`, else 0. `ends`: null if the layer is not valid.
  void (*fill_cells)(const std::uint16_t* listed, std::size_t count, const Layer& rows, const Layer* ends,
                     std::uint8_t value, std::uint8_t* cells);
  // Writes the visible faces of the shapes of the job's region. Returns the end of those written.
  ShapeFace* (*write_shape_faces)(const Job& job, ShapeFace* out);
  // Answers queries: eight bits of occlusion per face, as in a quad.
  void (*find_occlusion)(const std::uint8_t* eighths, const CornerQuery* queries, std::size_t count,
                         std::uint8_t* answers);
};

// The wider kernels exist only in builds that compile them. `kKernels` contains the available ones.
extern const Kernel kPlainKernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
extern const KernelTable<Kernel> kKernels;

// Reserves `more` quads after the first `used`. Returns a pointer to them.
std::uint64_t* grow_quads(QuadBuffer& out, std::size_t used, std::size_t more);

// Returns true if a voxel of the chunk is transparent.
bool holds_transparent(const Chunk& chunk, const VoxelRegistry& types);

// Returns true if an opaque voxel of the chunks may not occlude.
bool hold_unoccluding(const Neighbourhood& chunks, const VoxelRegistry& types);

// Returns the layer of faces in a direction, if some types are transparent.
inline Layer& faces_towards(Direction direction, Scratch& s) {
  const auto d = static_cast<std::size_t>(direction);
  return d < 4 ? s.sides[d] : s.z.faces[d - 4];
}

// Removes, from `sides` and the z view's faces, the faces of transparent voxels that a voxel of the same type beyond
// the chunk's border hides.
void hide_faces_at_border(const Job& job, Scratch& scratch);

// Finds the squares that shaped neighbours cover of some sides of a shaped voxel: sets `masks`, by direction. Returns
// the sides with such squares. Both sets of sides are bits.
unsigned find_covered_squares(const Job& job, const ShapedVoxel& voxel, const ShapedVoxel& shown, unsigned sides,
                              const SideMask** masks);

// Replaces `out` with the visible faces of the region's shapes. Requires: a kernel meshed the job.
void append_shape_faces(const Job& job, ShapeFaceBuffer& out);

// The orientations of types that their state turns, in quads.
class TurnedTypes {
 public:
  // Sets the orientations of quads of such types. Splits those whose voxels look different.
  void apply(const Chunk& chunk, const VoxelRegistry& types, QuadBuffer& quads);

 private:
  struct Looks {
    VoxelFaces faces;
    // By direction and index of an orientation: the first orientation that shows the same face.
    std::array<std::array<std::uint8_t, AxisOrientation::kCount>, 6> first{};
  };

  [[nodiscard]] const Looks& looks_of(VoxelType type, const VoxelFaces& faces);
  void append_parts(const Quad& quad, const Chunk& chunk, const StateOrientations& orientations, const Looks& looks);

  std::map<VoxelType, Looks> looks_;
  QuadBuffer made_;
};

// Lists the shaped voxels in and around the region, with their models, from `rows`, `ends` and `listed`. Requires: the
// z view's opaque voxels are valid, with those around the chunk. `row_ends`: its ends are valid.
void list_shapes(const Job& job, bool row_ends, Scratch& scratch);

// Removes, from the layers of faces, the faces of cubes that shapes cover.
void hide_faces_behind_shapes(const Job& job, Scratch& scratch);

// Fills `shapes->sides`. Requires: as list_shapes, and the shapes are listed.
void find_covered_sides(const Job& job, bool row_ends, Scratch& scratch);

// Lists the faces of cubes that the passes over directions leave out: if `job.has_faces` is false, those that shapes
// cover; and those whose corners shapes may darken, which become `shapes->quads`, in the mesher's order. Requires: the
// z view's opaque voxels are the occluders, and `shapes->sides` is filled. `row_ends`: its ends are valid.
void take_faces_next_to_shapes(const Job& job, bool row_ends, Scratch& scratch);

// Appends the quads of `shapes->quads` in a direction.
void append_quads_next_to_shapes(const Job& job, Direction direction, Scratch& scratch, QuadBuffer& out);

// Returns a face of a cube.
const ModelFace& cube_face(Direction direction);

// Returns true if a chunk has voxels with shapes. 16 bits per voxel: it may have some.
bool holds_shapes(const Chunk* chunk, const VoxelRegistry& types);

}  // namespace quoin::blocky

namespace quoin {

/// Returns the occlusion of the four corners of a face of `voxel` (coordinates in the centre chunk). Types occlude as
/// VoxelRegistry::occludes says: glass and water do not darken.
///
/// Cost: 12 voxel look-ups; meshers do 64 faces at once instead.
[[nodiscard]] FaceOcclusion face_occlusion(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 voxel,
                                           Direction direction);

}  // namespace quoin

#include <quoin/mesh/label_surfaces.h>

#include <algorithm>
#include <bit>
#include <string>
#include <tuple>
#include <utility>

#include <quoin/core/assert.h>

#include "mesh/array/array_cells.h"
#include "mesh/array/array_kernel.h"
#include "mesh/array/array_lattice.h"

namespace quoin::array {
namespace {

constexpr std::size_t kFirstSlots = 256;

}  // namespace

InterfaceTable::InterfaceTable() : storage_(kFirstSlots), slots_(storage_.data()), mask_(kFirstSlots - 1) {}

InterfaceTable::Slot& InterfaceTable::insert(std::uint64_t back, std::uint64_t front) {
  if (2 * count_ >= storage_.size()) {
    std::vector<Slot> larger(2 * storage_.size());
    mask_ = larger.size() - 1;
    for (const Slot& slot : storage_) {
      if (slot.back == slot.front) continue;
      std::size_t i = place(slot.back, slot.front);
      while (larger[i].back != larger[i].front) i = (i + 1) & mask_;
      larger[i] = slot;
    }
    storage_ = std::move(larger);
    slots_ = storage_.data();
  }
  ++count_;
  QUOIN_ASSERT(back != front && 2 * count_ <= storage_.size(), "two labels, and room for their slot");
  std::size_t i = place(back, front);
  while (slots_[i].back != slots_[i].front) i = (i + 1) & mask_;
  slots_[i] = {back, front, 0};
  return slots_[i];
}

std::vector<InterfaceTable::Slot> InterfaceTable::used() const {
  std::vector<Slot> all;
  all.reserve(count_);
  for (const Slot& slot : storage_) {
    if (slot.back != slot.front) all.push_back(slot);
  }
  return all;
}

}  // namespace quoin::array

namespace quoin {
namespace {

using namespace array;

constexpr int kMaxRelaxationSteps = 1'000;

bool is_signed(ScalarType type) {
  return type == ScalarType::Int8 || type == ScalarType::Int16 || type == ScalarType::Int32 ||
         type == ScalarType::Int64;
}

/// Converts labels between bits, keys in label order, and numbers.
class LabelCode {
 public:
  explicit LabelCode(ScalarType type)
      : bits_(8 * static_cast<unsigned>(size_of(type))), sign_(is_signed(type) ? std::uint64_t{1} << (bits_ - 1) : 0) {
    QUOIN_ASSERT(type != ScalarType::Float32 && type != ScalarType::Float64, "labels are integers");
  }

  [[nodiscard]] std::uint64_t sign() const { return sign_; }
  [[nodiscard]] std::uint64_t bits_of(std::int64_t label) const {
    return static_cast<std::uint64_t>(label) & ~std::uint64_t{0} >> (64 - bits_);
  }
  [[nodiscard]] std::uint64_t key_of(std::int64_t label) const { return bits_of(label) ^ sign_; }
  [[nodiscard]] std::int64_t label_of(std::uint64_t key) const {
    const std::uint64_t bits = key ^ sign_;
    // Extends the sign to all bits above it.
    return static_cast<std::int64_t>((bits ^ sign_) - sign_);
  }
  [[nodiscard]] bool holds(std::int64_t label) const { return label_of(key_of(label)) == label; }
  // The index of the label size among the functions of a kernel.
  [[nodiscard]] std::size_t size_index() const { return static_cast<std::size_t>(std::countr_zero(bits_ / 8)); }

 private:
  unsigned bits_;
  std::uint64_t sign_;
};

/// The edges between samples of different labels, as a source for EdgeWindow. Packs two slices if rows are not
/// contiguous.
class LabelEdges {
 public:
  LabelEdges(const Lattice& lattice, const LabelCode& code, std::int64_t background)
      : lattice_(&lattice),
        differing_(kernel().differing[code.size_index()]),
        background_(code.bits_of(background)),
        item_(lattice.item_bytes()),
        count_(static_cast<std::size_t>(lattice.size[0])) {
    if (lattice.has_packed_rows()) return;
    for (std::vector<std::byte>& slice : packed_) slice.resize(lattice.rows() * count_ * item_);
  }

  void within(std::size_t z, std::uint64_t* along_rows, std::uint64_t* between_rows) {
    const std::size_t rows = lattice_->rows();
    const std::size_t words = lattice_->words;
    pack(z);
    for (std::size_t y = 0; y < rows; ++y) {
      find_along(row(y, z), along_rows + y * words);
      differing_(row(y, z), y == 0 ? nullptr : row(y - 1, z), background_, count_, between_rows + y * words);
    }
    differing_(row(rows - 1, z), nullptr, background_, count_, between_rows + rows * words);
  }
  void between(std::size_t slice, std::uint64_t* out) {
    const bool is_end = slice == 0 || slice == lattice_->slices();
    const std::size_t here = slice == lattice_->slices() ? slice - 1 : slice;
    for (std::size_t y = 0; y < lattice_->rows(); ++y, out += lattice_->words) {
      differing_(row(y, here), is_end ? nullptr : row(y, slice - 1), background_, count_, out);
    }
  }

 private:
  void pack(std::size_t z) {
    std::vector<std::byte>& slice = packed_[z & 1];
    if (slice.empty()) return;
    for (std::size_t y = 0; y < lattice_->rows(); ++y) {
      pack_row(*lattice_, static_cast<std::int64_t>(y), static_cast<std::int64_t>(z),
               slice.data() + y * count_ * item_);
    }
  }
  [[nodiscard]] const std::byte* row(std::size_t y, std::size_t z) const {
    const std::vector<std::byte>& slice = packed_[z & 1];
    if (!slice.empty()) return slice.data() + y * count_ * item_;
    return lattice_->row(static_cast<std::int64_t>(y), static_cast<std::int64_t>(z));
  }
  [[nodiscard]] bool is_background(const std::byte* at) const {
    std::uint64_t differs = 0;
    differing_(at, nullptr, background_, 1, &differs);
    return differs == 0;
  }
  void find_along(const std::byte* row, std::uint64_t* out) const {
    const std::size_t words = lattice_->words;
    out[words - 1] = 0;
    differing_(row, row + item_, background_, count_ - 1, out);
    // Moves each bit to the index of the later sample.
    for (std::size_t w = words; w-- > 1;) out[w] = out[w] << 1 | out[w - 1] >> 63;
    out[0] <<= 1;
    if (!is_background(row)) out[0] |= 1;
    if (!is_background(row + (count_ - 1) * item_)) out[count_ / 64] |= std::uint64_t{1} << (count_ % 64);
  }

  const Lattice* lattice_;
  void (*differing_)(const std::byte*, const std::byte*, std::uint64_t, std::size_t, std::uint64_t*);
  std::uint64_t background_;
  std::size_t item_;
  std::size_t count_;
  std::vector<std::byte> packed_[2];
};

/// Builds the surfaces, step by step.
class Builder {
 public:
  Builder(const Lattice& lattice, const LabelSurfaceOptions& options, Threads threads, const Progress& progress)
      : lattice_(lattice),
        options_(options),
        threads_(threads),
        code_(lattice.type),
        tables_(slab_count(lattice)),
        steps_(progress, (4 + static_cast<std::size_t>(options.relaxation_steps)) * slab_count(lattice)) {
    labels_.data = lattice.data;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      labels_.stride[axis] = lattice.stride[axis];
      labels_.size[axis] = lattice.size[axis];
    }
    labels_.background = code_.key_of(options.background);
    labels_.sign = code_.sign();
  }

  Result<LabelSurfaces> build() {
    const auto count = kernel().count_interfaces[code_.size_index()];
    const auto also = [&](std::size_t slab, std::size_t slice, const CellSlice& edges) {
      count(edges, labels_, static_cast<std::int64_t>(slice), tables_[slab]);
    };
    Status done = find_cells(
        lattice_, [this] { return edges(); }, threads_, steps_, index_, also);
    if (done) {
      list_interfaces();
      out_.positions.resize(index_.vertices());
      done = add_vertices();
    }
    if (done) done = relax();
    if (done) done = place();
    if (done) done = add_quads();
    if (!done) return done.error();
    return std::move(out_);
  }

 private:
  [[nodiscard]] LabelEdges edges() const { return {lattice_, code_, options_.background}; }

  // Converts counts of quads to write positions: by interface, and within it by slab.
  void list_interfaces() {
    struct Part {
      InterfaceTable::Slot slot;
      std::size_t slab;
    };
    std::vector<Part> parts;
    for (std::size_t slab = 0; slab < tables_.size(); ++slab) {
      for (const InterfaceTable::Slot& slot : tables_[slab].used()) parts.push_back({slot, slab});
    }
    const auto order = [&](const Part& p) {
      return std::tuple(p.slot.back, p.slot.front != labels_.background, p.slot.front, p.slab);
    };
    std::sort(parts.begin(), parts.end(), [&](const Part& a, const Part& b) { return order(a) < order(b); });
    std::uint64_t quads = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const InterfaceTable::Slot& slot = parts[i].slot;
      if (i == 0 || parts[i - 1].slot.back != slot.back || parts[i - 1].slot.front != slot.front) {
        out_.interfaces.push_back(
            {code_.label_of(slot.back), code_.label_of(slot.front), static_cast<std::size_t>(6 * quads), 0});
      }
      tables_[parts[i].slab].slot(slot.back, slot.front).number = quads;
      quads += slot.number;
      out_.interfaces.back().index_count += 6 * slot.number;
    }
    QUOIN_ASSERT(quads == index_.quads(), "each quad is in one interface");
    out_.background = options_.background;
  }

  Status add_vertices() {
    if (options_.relaxation_steps > 0) links_.resize(index_.vertices());
    return for_each_slab(lattice_, threads_, steps_, [&](std::size_t, std::size_t first, std::size_t end) {
      EdgeWindow window(lattice_, edges());
      for (std::size_t slice = first; slice < end; ++slice) {
        kernel().label_vertices(window.at(slice), index_.rows_of(lattice_, slice), out_.positions.data(),
                                links_.data());
      }
    });
  }

  // Returns the first vertex of a slice of cells; slices before the first are empty.
  [[nodiscard]] std::uint32_t first_of(std::size_t slice) const {
    return index_.first[std::min(slice, lattice_.slices() + 1) * (lattice_.rows() + 1)];
  }

  // Moves all vertices in one pass from one buffer to the other. The triangles are not allocated yet.
  Status relax() {
    if (options_.relaxation_steps == 0) return {};
    Buffer<Vec3> relaxed;
    relaxed.resize(index_.vertices());
    Status done;
    for (int step = 0; done && step < options_.relaxation_steps; ++step) {
      done = for_each_slab(lattice_, threads_, steps_, [&](std::size_t, std::size_t first, std::size_t end) {
        for (std::size_t slice = first; slice < end; ++slice) {
          const RelaxStep from{lattice_.rows(), lattice_.words,        slice == 0,    slice == lattice_.slices(),
                               links_.data(),   out_.positions.data(), relaxed.data()};
          kernel().relax(from, index_.rows_of(lattice_, slice));
        }
      });
      std::swap(out_.positions, relaxed);
    }
    return done;
  }

  // Converts vertices from cell fractions to space.
  Status place() {
    const Placement placement = placement_of(lattice_);
    return for_each_slab(lattice_, threads_, steps_, [&](std::size_t, std::size_t first, std::size_t end) {
      VertexBatch batch{};
      std::size_t count = 0;
      Vec3* to = out_.positions.data() + first_of(first);
      const auto finish = [&] {
        if (count == 0) return;
        for (std::size_t i = 0; i < count; ++i) {
          for (int axis = 0; axis < 3; ++axis) batch.fractions[axis][i] = to[i][axis];
        }
        kernel().place(batch, count, placement, to);
        to += count;
        count = 0;
      };
      for_each_cell(lattice_, index_, first, end, [&](IVec3 cell) {
        for (int axis = 0; axis < 3; ++axis) batch.cells[axis][count] = cell[axis];
        if (++count == kBatch) finish();
      });
      finish();
      QUOIN_ASSERT(to == out_.positions.data() + first_of(end), "the vertices that were counted");
    });
  }
  Status add_quads() {
    out_.indices.resize(6 * index_.quads());
    const QuadRules rules{out_.positions.data(), lattice_.is_mirrored};
    const auto quads = kernel().label_quads[code_.size_index()];
    return for_each_slab(lattice_, threads_, steps_, [&](std::size_t slab, std::size_t first, std::size_t end) {
      EdgeWindow window(lattice_, edges());
      for (std::size_t slice = first; slice < end; ++slice) {
        quads(window.at(slice), labels_, static_cast<std::int64_t>(slice), index_.rows_of(lattice_, slice), rules,
              tables_[slab], out_.indices.data());
      }
    });
  }

  const Lattice& lattice_;
  const LabelSurfaceOptions& options_;
  Threads threads_;
  LabelCode code_;
  LabelRows labels_{};
  CellIndex index_;
  std::vector<InterfaceTable> tables_;  // by slab
  Buffer<std::uint8_t> links_;          // by vertex
  ProgressSteps steps_;
  LabelSurfaces out_;
};

}  // namespace

Result<LabelSurfaces> surfaces_from_labels(const ArrayView& labels, const LabelSurfaceOptions& options, Threads threads,
                                           const Progress& progress) {
  if (labels.type == ScalarType::Float32 || labels.type == ScalarType::Float64) {
    return make_error(ErrorCode::InvalidArgument, "labels must be integers");
  }
  if (options.relaxation_steps < 0 || options.relaxation_steps > kMaxRelaxationSteps) {
    return make_error(ErrorCode::InvalidArgument, "relaxation steps: must be 0 to 1,000");
  }
  const Result<Lattice> lattice = lattice_of(labels);
  if (!lattice) return lattice.error();
  if (!LabelCode(labels.type).holds(options.background)) {
    return make_error(ErrorCode::InvalidArgument,
                      "the array's type cannot represent the background label " + std::to_string(options.background));
  }
  return Builder(*lattice, options, threads, progress).build();
}

std::vector<std::int64_t> labels_of(const LabelSurfaces& surfaces) {
  // Labels that do not touch the background are the front or the back of an interface with another label.
  std::vector<std::int64_t> labels;
  for (const LabelInterface& interface : surfaces.interfaces) {
    labels.push_back(interface.back);
    if (interface.front != surfaces.background) labels.push_back(interface.front);
  }
  std::sort(labels.begin(), labels.end());
  labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
  return labels;
}

Buffer<std::uint32_t> indices_of_label(const LabelSurfaces& surfaces, std::int64_t label) {
  Buffer<std::uint32_t> indices;
  for (const LabelInterface& interface : surfaces.interfaces) {
    const bool is_front = interface.front == label;
    if (interface.back != label && !is_front) continue;
    QUOIN_ASSERT(
        interface.first_index + interface.index_count <= surfaces.indices.size() && interface.index_count % 3 == 0,
        "whole triangles of the surfaces");
    const std::size_t before = indices.size();
    const std::uint32_t* from = surfaces.indices.data() + interface.first_index;
    indices.resize(before + interface.index_count);
    for (std::size_t i = 0; i < interface.index_count; i += 3) {
      indices[before + i] = from[i];
      indices[before + i + 1] = from[i + (is_front ? 2 : 1)];
      indices[before + i + 2] = from[i + (is_front ? 1 : 2)];
    }
  }
  return indices;
}

namespace {

void add_normals(ArraySurface& surface) {
  surface.normals.resize(surface.positions.size());
  std::fill(surface.normals.begin(), surface.normals.end(), Vec3(0.0F));
  for (std::size_t i = 0; i < surface.indices.size(); i += 3) {
    const std::uint32_t* const v = surface.indices.data() + i;
    const Vec3 a = surface.positions[v[0]];
    const Vec3 twice_area = glm::cross(surface.positions[v[1]] - a, surface.positions[v[2]] - a);
    for (int k = 0; k < 3; ++k) surface.normals[v[k]] += twice_area;
  }
  for (Vec3& normal : surface.normals) {
    const float length = glm::length(normal);
    normal = length > 0.0F ? normal / length : Vec3(0.0F, 1.0F, 0.0F);
  }
}

}  // namespace

ArraySurface surface_of_label(const LabelSurfaces& surfaces, std::int64_t label) {
  ArraySurface out;
  out.indices = indices_of_label(surfaces, label);
  constexpr std::uint32_t kUnused = ~std::uint32_t{0};
  std::vector<std::uint32_t> own(surfaces.positions.size(), kUnused);
  for (const std::uint32_t vertex : out.indices) own[vertex] = 0;
  std::uint32_t count = 0;
  for (std::uint32_t& vertex : own) {
    if (vertex != kUnused) vertex = count++;
  }
  out.positions.resize(count);
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (own[i] != kUnused) out.positions[own[i]] = surfaces.positions[i];
  }
  for (std::uint32_t& vertex : out.indices) vertex = own[vertex];
  add_normals(out);
  return out;
}

}  // namespace quoin

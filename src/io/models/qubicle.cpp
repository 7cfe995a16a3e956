// Qubicle's formats. Matrices have integer positions. For compounds the visible result is read, not the source
// matrices.
//
//   .qb    matrices of colours, as they are or as runs a slice
//   .qbt   a tree of matrices, each a zlib stream
//   .qbcl  projects: the same tree with a thumbnail before it, columns as runs
//   .qef   text: colours, then voxels
//
// Writes a matrix for each instance: slices by z, rows by y, runs of equal colours along x.

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "core/work/progress_steps.h"
#include "io/byte_stream.h"
#include "io/format_driver.h"
#include "io/models/model_builder.h"
#include "io/placed_grids.h"

namespace quoin::models {

namespace {

constexpr std::string_view kTree = "QB 2";
constexpr std::string_view kProject = "QBCL";
constexpr std::string_view kExchange = "Qubicle Exchange Format";
constexpr std::int32_t kMaxQubiclePlace = 1 << 26;

Rgba8 colour_of(std::uint32_t rgba, bool is_bgra) {
  const auto low = static_cast<std::uint8_t>(rgba);
  const auto high = static_cast<std::uint8_t>(rgba >> 16);
  return {is_bgra ? high : low, static_cast<std::uint8_t>(rgba >> 8), is_bgra ? low : high,
          static_cast<std::uint8_t>(rgba >> 24)};
}

constexpr std::uint32_t kRun = 2;
constexpr std::uint32_t kNextSlice = 6;

/// The properties of a matrix, except its voxels.
struct Matrix {
  std::string name{};
  IVec3 size{0};
  IVec3 place{0};
  DVec3 pivot{0.0};  ///< voxels from `place`
  bool is_visible = true;
};

IVec3 read_ivec3(ByteReader& reader) {
  IVec3 value{0};
  for (int axis = 0; axis < 3; ++axis) value[axis] = reader.i32();
  return value;
}

DVec3 read_pivot(ByteReader& reader) {
  DVec3 pivot{0.0};
  for (int axis = 0; axis < 3; ++axis) pivot[axis] = reader.f32();
  return pivot;
}

bool is_empty(const Matrix& matrix) {
  return matrix.size.x == 0 || matrix.size.y == 0 || matrix.size.z == 0;
}

/// Checks the size and position of the matrix at an offset. Qubicle gives empty matrices any position.
Status check_range(const Matrix& matrix, std::size_t at) {
  bool is_sound = true;
  for (int axis = 0; axis < 3; ++axis) {
    const int place = matrix.place[axis];
    is_sound &= matrix.size[axis] >= 0 && matrix.size[axis] <= kMaxEdge;
    is_sound &= is_empty(matrix) || (place >= -kMaxQubiclePlace && place <= kMaxQubiclePlace);
  }
  return is_sound ? Status() : Status(bad_at(at, "a matrix's size or position is out of range"));
}

/// Starts a model that rotates about the matrix's pivot, or about its position if the pivot is out of range. Returns
/// false, with a warning, for empty matrices.
bool begin_model(const Matrix& matrix, ModelBuilder& builder) {
  if (is_empty(matrix)) {
    builder.warn("left out: the matrix \"" + printable(matrix.name) + "\", which has no voxels");
    return false;
  }
  constexpr double kFarthest = 1e6;
  Model model;
  model.name = matrix.name;
  model.canvas = {IVec3(0), matrix.size};
  if (is_finite(matrix.pivot) && glm::length(matrix.pivot) < kFarthest) model.pivot = matrix.pivot;
  model.position = DVec3(matrix.place) + model.pivot;
  model.visible = matrix.is_visible;
  builder.begin(std::move(model));
  return true;
}

/// Reads the zlib stream of a matrix.
class PackedColumns {
 public:
  /// Takes the stream and its size before it.
  explicit PackedColumns(ByteReader& reader)
      : at_(reader.position() + 4), stream_(reader.take(reader.u32()), 0, Compression::Zlib) {}

  /// Takes the next bytes. Lifetime: until the next call.
  Result<ByteReader> take(std::size_t count) {
    bytes_.resize(count);
    const auto read = stream_.read(bytes_);
    if (!read)
      return make_error(read.error().code, read.error().message, {}, at_ + read.error().byte_offset.value_or(0));
    if (*read != count) return bad_at(at_, "a matrix has fewer voxels than its size requires");
    return ByteReader(bytes_);
  }

  /// Calls put_column(x, z) for each column, in the order of the stream, until it fails.
  template <class PutColumn>
  Status for_each(IVec3 size, PutColumn put_column) {
    for (int x = 0; x < size.x; ++x) {
      for (int z = 0; z < size.z; ++z) {
        if (Status done = put_column(x, z); !done) return done;
      }
    }
    return {};
  }

  /// Returns the offset of the stream.
  [[nodiscard]] std::size_t position() const { return at_; }

 private:
  std::size_t at_;
  ByteStream stream_;
  std::vector<std::byte> bytes_;
};

enum class NodeKind : std::uint32_t { Matrix, Model, Compound };

Status check_depth(int depth, std::size_t at) {
  constexpr int kDeepest = 64;
  if (depth <= kDeepest) return {};
  return make_error(ErrorCode::LimitExceeded, "nodes are nested more than 64 deep", {}, at);
}

/// Reads the number of a node's children. A child takes at least `least_bytes`.
Result<std::size_t> read_child_count(ByteReader& reader, std::size_t least_bytes, std::size_t at) {
  const std::size_t children = reader.count(least_bytes);
  if (reader.failed()) return bad_at(at, "a node claims more children than the file can hold");
  return children;
}

class QbReader {
 public:
  explicit QbReader(std::span<const std::byte> bytes) : bytes_(bytes), reader_(bytes) {}

  Result<LoadedScene> read() {
    static_cast<void>(reader_.u32());  // version
    is_bgra_ = reader_.u32() == 1;
    static_cast<void>(reader_.u32());  // z axis: affects only Qubicle's display; the data is the same
    is_packed_ = reader_.u32() != 0;
    has_masks_ = reader_.u32() != 0;
    const std::uint32_t matrices = reader_.u32();
    for (std::uint32_t i = 0; i < matrices; ++i) {
      if (auto done = read_matrix(); !done) return done.error();
    }
    return builder_.take("qubicle");
  }

 private:
  Status read_matrix();
  Status read_slices(const Matrix& matrix);
  Status read_run(const Matrix& matrix, int z, std::uint64_t& at, std::uint64_t count, std::uint32_t data);
  Status read_slice(const Matrix& matrix, int z);
  [[nodiscard]] Error too_short() const { return bad_at(bytes_.size(), "the file ends before its matrices"); }

  std::span<const std::byte> bytes_;
  ByteReader reader_;
  ModelBuilder builder_;
  bool is_bgra_ = false;
  bool is_packed_ = false;
  bool has_masks_ = false;
};

Status QbReader::read_matrix() {
  const std::size_t at = reader_.position();
  Matrix matrix;
  matrix.name = reader_.text(reader_.u8());
  matrix.size = read_ivec3(reader_);
  matrix.place = read_ivec3(reader_);
  if (reader_.failed()) return too_short();
  if (Status sound = check_range(matrix, at); !sound) return sound;
  begin_model(matrix, builder_);
  return read_slices(matrix);  // in the packed form, slices of empty matrices have end marks
}

Status QbReader::read_slices(const Matrix& matrix) {
  for (int z = 0; z < matrix.size.z; ++z) {
    if (auto done = read_slice(matrix, z); !done) return done;
  }
  return {};
}

Status QbReader::read_slice(const Matrix& matrix, int z) {
  const std::uint64_t area = static_cast<std::uint64_t>(matrix.size.x) * static_cast<std::uint64_t>(matrix.size.y);
  std::uint64_t at = 0;
  if (!is_packed_) {
    while (at < area) {
      if (auto done = read_run(matrix, z, at, 1, reader_.u32()); !done) return done;
    }
    return {};
  }
  for (;;) {
    const std::uint32_t data = reader_.u32();
    if (reader_.failed()) return too_short();
    if (data == kNextSlice) return {};
    std::uint64_t count = 1;
    std::uint32_t colour = data;
    if (data == kRun) {
      count = reader_.u32();
      colour = reader_.u32();
    }
    if (count > area - at) return bad_at(reader_.position(), "a slice has more voxels than its matrix");
    if (auto done = read_run(matrix, z, at, count, colour); !done) return done;
  }
}

Status QbReader::read_run(const Matrix& matrix, int z, std::uint64_t& at, std::uint64_t count, std::uint32_t data) {
  if (reader_.failed()) return too_short();
  Rgba8 colour = colour_of(data, is_bgra_);
  if (has_masks_ && colour.a != 0) colour.a = 255;
  const auto width = static_cast<std::uint64_t>(matrix.size.x);
  QUOIN_ASSERT(count <= width * static_cast<std::uint64_t>(matrix.size.y) - at, "a run within its slice");
  const std::uint64_t end = at + count;
  if (colour.a == 0) {
    at = end;
    return {};
  }
  while (at < end) {
    QUOIN_ASSERT(width > 0, "a matrix with voxels");
    const IVec3 voxel{static_cast<int>(at % width), static_cast<int>(at / width), z};
    const std::uint64_t row = std::min(end - at, width - at % width);
    if (auto put = builder_.put(voxel, colour, static_cast<int>(row), 0); !put) return put;
    at += row;
  }
  return {};
}

class QbtReader {
 public:
  explicit QbtReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  Result<LoadedScene> read() {
    ByteReader reader(bytes_);
    static_cast<void>(reader.take(4 + 2 + 12));  // magic, version, scale
    // Before version 1.1 only voxels had colours.
    std::size_t at = reader.position();
    std::string_view part = reader.text(8);
    if (part == "COLORMAP") {
      const std::size_t colours = reader.count(4);
      for (std::size_t i = 0; i < colours; ++i) colours_.push_back(colour_of(reader.u32(), false));
      at = reader.position();
      part = reader.text(8);
    }
    if (part != "DATATREE") return bad_at(at, "the file has no DATATREE");
    if (auto done = read_node(reader, 0); !done) return done.error();
    return builder_.take("qubicle");
  }

 private:
  Status read_node(ByteReader& reader, int depth);
  Status read_matrix(ByteReader& reader);
  Status put_column(ByteReader voxels, int x, int z, std::size_t at);

  std::span<const std::byte> bytes_;
  std::vector<Rgba8> colours_;
  ModelBuilder builder_;
};

Status QbtReader::read_node(ByteReader& reader, int depth) {
  const std::size_t at = reader.position();
  const auto kind = static_cast<NodeKind>(reader.u32());
  const std::size_t size = reader.u32();
  if (reader.failed() || size > reader.remaining()) return bad_at(at, "a node extends past the end of the file");
  if (Status sound = check_depth(depth, at); !sound) return sound;
  ByteReader node(bytes_, reader.position(), reader.position() + size);
  static_cast<void>(reader.take(size));
  if (kind == NodeKind::Matrix || kind == NodeKind::Compound) return read_matrix(node);
  if (kind != NodeKind::Model) {
    builder_.warn("left out: a node of unknown kind " + std::to_string(static_cast<std::uint32_t>(kind)));
    return {};
  }
  const auto children = read_child_count(node, 8, at);
  if (!children) return children.error();
  for (std::size_t i = 0; i < *children; ++i) {
    if (auto done = read_node(node, depth + 1); !done) return done;
  }
  return {};
}

Status QbtReader::read_matrix(ByteReader& reader) {
  const std::size_t at = reader.position();
  Matrix matrix;
  matrix.name = reader.text(reader.u32());
  matrix.place = read_ivec3(reader);
  static_cast<void>(reader.take(12));  // scale
  matrix.pivot = read_pivot(reader);
  matrix.size = read_ivec3(reader);
  PackedColumns columns(reader);
  if (reader.failed()) return bad_at(at, "a matrix ends too early");
  if (Status sound = check_range(matrix, at); !sound) return sound;
  if (!begin_model(matrix, builder_)) return {};
  return columns.for_each(matrix.size, [&](int x, int z) -> Status {
    const auto voxels = columns.take(static_cast<std::size_t>(matrix.size.y) * 4);
    return voxels ? put_column(*voxels, x, z, columns.position()) : Status(voxels.error());
  });
}

// The last byte of a voxel is the mask of visible faces: 0 for empty voxels.
Status QbtReader::put_column(ByteReader voxels, int x, int z, std::size_t at) {
  for (int y = 0; voxels.remaining() > 0; ++y) {
    Rgba8 colour = colour_of(voxels.u32(), false);
    if (colour.a == 0) continue;
    if (!colours_.empty()) {
      if (colour.r >= colours_.size()) return bad_at(at, "a colour index is beyond the colour map");
      colour = colours_[colour.r];
    }
    colour.a = 255;
    if (auto put = builder_.put({x, y, z}, colour); !put) return put;
  }
  return {};
}

/// Projects. Strings are u32 size and bytes:
///
///   "QBCL"      8 bytes of versions, u32 width and height of a thumbnail and its pixels, 7 strings, 16 bytes of times;
///               a node
///   a node      u32 kind, u32, string name, 3 bytes (visible, locked ...); a model: 36 bytes, u32 number of nodes, the
///               nodes; a matrix: size, position, pivot, u32 bytes, a zlib stream; a compound: both
///   a stream    for each column (x slowest, then z): u16 entries, each of 4 bytes: r, g, b and a mask of visible
///               faces; mask 2 means that the next entry repeats r times
class QbclReader {
 public:
  explicit QbclReader(std::span<const std::byte> bytes) : reader_(bytes) {}

  Result<LoadedScene> read() {
    static_cast<void>(reader_.take(4 + 4));
    const std::size_t version_at = reader_.position();
    const std::uint32_t version = reader_.u32();
    constexpr std::uint32_t kTreeVersion = 2;
    if (!reader_.failed() && version != kTreeVersion) {
      return make_error(ErrorCode::Unsupported,
                        "Qubicle project version " + std::to_string(version) + " is not supported", {}, version_at);
    }
    const std::uint64_t pixels = std::uint64_t{reader_.u32()} * reader_.u32();
    if (pixels > reader_.remaining() / 4)
      return bad_at(version_at + 4, "the thumbnail extends past the end of the file");
    static_cast<void>(reader_.take(pixels * 4));
    for (int i = 0; i < 7; ++i) static_cast<void>(reader_.take(reader_.u32()));
    static_cast<void>(reader_.take(16));
    if (auto done = read_node(0, true, true); !done) return done.error();
    return builder_.take("qubicle");
  }

 private:
  [[nodiscard]] Error too_short() const { return bad_at(reader_.position(), "the file ends before its nodes"); }
  Status read_node(int depth, bool is_used, bool is_shown);
  Status read_matrix(std::string name, bool is_used, bool is_shown);
  Status put_column(ByteReader column, const Matrix& matrix, int x, int z, std::size_t at);
  Status read_children(int depth, bool is_used, bool is_shown);

  ByteReader reader_;
  ModelBuilder builder_;
};

/// `is_used`: false for the source matrices of a compound.
Status QbclReader::read_node(int depth, bool is_used, bool is_shown) {
  const std::size_t at = reader_.position();
  const auto kind = static_cast<NodeKind>(reader_.u32());
  static_cast<void>(reader_.u32());
  std::string name(reader_.text(reader_.u32()));
  is_shown &= reader_.u8() != 0;
  static_cast<void>(reader_.take(2));
  if (reader_.failed()) return too_short();
  if (Status sound = check_depth(depth, at); !sound) return sound;
  if (kind == NodeKind::Model) {
    static_cast<void>(reader_.take(36));
    return read_children(depth, is_used, is_shown);
  }
  // The file does not store a node's size.
  if (kind != NodeKind::Matrix && kind != NodeKind::Compound) return bad_at(at, "unknown node kind");
  if (auto done = read_matrix(std::move(name), is_used, is_shown); !done) return done;
  return kind == NodeKind::Compound ? read_children(depth, false, is_shown) : Status();
}

Status QbclReader::read_children(int depth, bool is_used, bool is_shown) {
  const auto children = read_child_count(reader_, 15, reader_.position());
  if (!children) return children.error();
  for (std::size_t i = 0; i < *children; ++i) {
    if (auto done = read_node(depth + 1, is_used, is_shown); !done) return done;
  }
  return {};
}

Status QbclReader::read_matrix(std::string name, bool is_used, bool is_shown) {
  const std::size_t at = reader_.position();
  Matrix matrix;
  matrix.name = std::move(name);
  matrix.is_visible = is_shown;
  matrix.size = read_ivec3(reader_);
  matrix.place = read_ivec3(reader_);
  if (reader_.failed()) return too_short();
  if (Status sound = check_range(matrix, at); !sound) return sound;
  matrix.pivot = read_pivot(reader_);
  PackedColumns columns(reader_);
  if (reader_.failed()) return too_short();
  if (!is_used || !begin_model(matrix, builder_)) return {};
  return columns.for_each(matrix.size, [&](int x, int z) -> Status {
    auto entries = columns.take(2);
    if (entries) entries = columns.take(std::size_t{entries->u16()} * 4);
    return entries ? put_column(*entries, matrix, x, z, columns.position()) : Status(entries.error());
  });
}

Status QbclReader::put_column(ByteReader column, const Matrix& matrix, int x, int z, std::size_t at) {
  std::uint32_t y = 0;
  while (column.remaining() > 0) {
    std::uint32_t entry = column.u32();
    std::uint32_t length = 1;
    if (entry >> 24 == kRun) {
      length = entry & 0xFFU;  // the other bytes are unused
      entry = column.u32();
    }
    if (column.failed() || length > static_cast<std::uint32_t>(matrix.size.y) - y) {
      return bad_at(at, "a column has more voxels than its matrix");
    }
    Rgba8 colour = colour_of(entry, false);
    if (colour.a != 0 && length > 0) {
      colour.a = 255;
      if (auto put = builder_.put({x, static_cast<int>(y), z}, colour, static_cast<int>(length)); !put) return put;
    }
    y += length;
  }
  return {};
}

/// Reads the numbers of a text, line by line.
class NumberReader {
 public:
  NumberReader(std::string_view text, std::size_t begin) : text_(text), at_(begin) {}
  [[nodiscard]] std::size_t position() const { return at_; }
  [[nodiscard]] bool is_at_end() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
    return at_ >= text_.size();
  }
  template <class T>
  [[nodiscard]] bool next(T& number) {
    if (is_at_end()) return false;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), number);
    if (error != std::errc()) return false;
    at_ = static_cast<std::size_t>(end - text_.data());
    return true;
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  std::string_view text_;
  std::size_t at_;
};

Result<LoadedScene> read_qef(std::span<const std::byte> bytes) {
  const std::string_view text = text_of(bytes);
  std::size_t at = 0;
  for (int line = 0; line < 3; ++line) at = std::min(text.find('\n', at), text.size() - 1) + 1;
  NumberReader numbers(text, at);
  IVec3 size{0};
  std::uint32_t count = 0;
  const bool is_sound = numbers.next(size.x) && numbers.next(size.y) && numbers.next(size.z) && numbers.next(count);
  constexpr std::uint32_t kMost = 1 << 20;
  const auto is_edge = [](int edge) { return edge > 0 && edge <= kMaxEdge; };
  if (!is_sound || !is_edge(size.x) || !is_edge(size.y) || !is_edge(size.z) || count > kMost) {
    return bad_at(numbers.position(), "the size or the number of colours is out of range");
  }
  std::vector<Rgba8> colours;
  for (std::uint32_t i = 0; i < count; ++i) {
    std::array<float, 3> rgb{};
    for (float& channel : rgb) {
      if (!numbers.next(channel)) return bad_at(numbers.position(), "a colour is not a number");
    }
    const auto byte = [](float channel) {
      return static_cast<std::uint8_t>(std::lround(std::clamp(channel, 0.0F, 1.0F) * 255.0F));
    };
    colours.push_back({byte(rgb[0]), byte(rgb[1]), byte(rgb[2]), 255});
  }
  ModelBuilder builder;
  Model model;
  model.canvas = {IVec3(0), size};
  builder.begin(std::move(model));
  while (!numbers.is_at_end()) {
    const std::size_t place = numbers.position();
    IVec3 voxel{0};
    std::uint32_t colour = 0;
    std::uint32_t faces = 0;
    const bool is_read = numbers.next(voxel.x) && numbers.next(voxel.y) && numbers.next(voxel.z) &&
                         numbers.next(colour) && numbers.next(faces);
    if (!is_read || colour >= colours.size() || !IBox{IVec3(0), size}.contains(voxel)) {
      return bad_at(place, "a voxel is outside the model, or its colour outside the palette");
    }
    if (auto put = builder.put(voxel, colours[colour]); !put) return put.error();
  }
  return builder.take("qubicle");
}

bool is_qb(std::span<const std::byte> beginning) {
  ByteReader reader(beginning);
  const std::uint32_t version = reader.u32();
  const bool is_version = (version & 0xFFU) <= 3 && (version >> 8 & 0xFFU) <= 3 && (version >> 24) == 0 && version != 0;
  for (int flag = 0; flag < 4; ++flag) {
    if (reader.u32() > 1) return false;
  }
  const std::uint32_t matrices = reader.u32();
  return is_version && matrices > 0 && matrices < (1U << 20) && !reader.failed() && reader.remaining() > 0;
}

bool is_qubicle(std::span<const std::byte> beginning) {
  const std::string_view text = text_of(beginning);
  return text.starts_with(kTree) || text.starts_with(kExchange) || text.starts_with(kProject) || is_qb(beginning);
}

Result<LoadedScene> read_qubicle(std::span<const std::byte> bytes) {
  const std::string_view text = text_of(bytes);
  if (text.starts_with(kProject)) return QbclReader(bytes).read();
  if (text.starts_with(kExchange)) return read_qef(bytes);
  if (text.starts_with(kTree)) return QbtReader(bytes).read();
  return QbReader(bytes).read();
}

constexpr FormatHolds kQubicleHolds = {.extension = ".qb", .names = true, .several = true, .transparency = true};
constexpr std::uint32_t kQubicleVersion = 0x0000'0101;
constexpr std::size_t kLongestName = 255;
// The size limit of readers.
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 32;

std::uint32_t word_of(Rgba8 colour) {
  const auto shifted = [](std::uint8_t channel, int bits) { return static_cast<std::uint32_t>(channel) << bits; };
  return shifted(colour.r, 0) | shifted(colour.g, 8) | shifted(colour.b, 16) | shifted(colour.a, 24);
}

/// Writes runs of equal words, which do not extend past a slice.
class QubicleRuns {
 public:
  explicit QubicleRuns(ByteWriter& out) : out_(out) {}
  void put(std::uint32_t word, std::uint32_t count = 1) {
    QUOIN_ASSERT(count > 0, "at least one voxel");
    if (count_ != 0 && word == word_) {
      count_ += count;
      return;
    }
    end_run();
    word_ = word;
    count_ = count;
  }
  void end_slice() {
    end_run();
    out_.u32(kNextSlice);
  }

 private:
  // Runs of up to three are not longer as plain words. Colours cannot be mistaken for codes, since solid voxels have
  // non-zero alpha.
  void end_run() {
    constexpr std::uint32_t kWords = 3;
    if (count_ > kWords) {
      out_.u32(kRun);
      out_.u32(count_);
      out_.u32(word_);
    } else {
      for (std::uint32_t i = 0; i < count_; ++i) out_.u32(word_);
    }
    count_ = 0;
  }

  ByteWriter& out_;
  std::uint32_t word_ = 0;
  std::uint32_t count_ = 0;
};

Status write_matrix(const PlacedGrid& grid, const std::vector<Rgba8>& colours, ByteWriter& out,
                    std::vector<std::string>& warnings, ProgressSteps& steps) {
  const IVec3 size = grid.box.size();
  if (std::max({size.x, size.y, size.z}) > kMaxEdge) {
    std::string line = "more than 16,384 voxels per side in ";
    return make_error(ErrorCode::LimitExceeded, line.append(printable(grid.name)));
  }
  const std::string name = cut_name(grid.name, kLongestName, warnings);
  QUOIN_ASSERT(name.size() <= kLongestName, "a name of at most 255 bytes");
  out.u8(static_cast<std::uint8_t>(name.size()));
  out.text(name);
  for (int axis = 0; axis < 3; ++axis) out.i32(size[axis]);
  for (int axis = 0; axis < 3; ++axis) out.i32(grid.box.min[axis]);
  std::vector<VoxelType> row(static_cast<std::size_t>(size.x));
  QubicleRuns runs(out);
  for (int z = grid.box.min.z; z < grid.box.max.z; ++z) {
    for (int y = grid.box.min.y; y < grid.box.max.y; ++y) {
      read_voxels(grid.voxels, {grid.box.min.x, y, z}, row);
      if (std::ranges::all_of(row, [&](VoxelType type) { return type == row.front(); })) {
        runs.put(word_of(colours[row.front()]), static_cast<std::uint32_t>(row.size()));
      } else {
        for (const VoxelType type : row) runs.put(word_of(colours[type]));
      }
    }
    runs.end_slice();
    steps.step();
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    if (out.size() > kMaxBytes) return make_error(ErrorCode::LimitExceeded, "more than 4 GiB of voxels");
  }
  return {};
}

/// Writes .qb: a matrix for each instance, with runs.
Result<EncodedFile> write_qb(const FormatOutput& output) {
  auto placed = place_grids(output.scene, kQubicleHolds);
  if (!placed) return placed.error();
  if (placed->grids.empty())
    return make_error(ErrorCode::Unsupported, "the scene has no voxels, and .qb needs at least one");
  const std::vector<Rgba8> colours = colours_of(output.scene.types);
  ByteWriter out;
  out.u32(kQubicleVersion);
  out.u32(0);  // colours are red, green, blue, alpha
  out.u32(1);  // right-handed
  out.u32(1);  // runs
  out.u32(0);  // alpha is alpha, not a mask of visible faces
  out.u32(static_cast<std::uint32_t>(placed->grids.size()));
  std::size_t slices = 0;
  for (const PlacedGrid& grid : placed->grids) slices += static_cast<std::size_t>(grid.box.size().z);
  ProgressSteps steps(output.progress, slices);
  for (const PlacedGrid& grid : placed->grids) {
    if (auto done = write_matrix(grid, colours, out, placed->warnings, steps); !done) return done.error();
  }
  return EncodedFile{out.take(), std::move(placed->warnings)};
}

}  // namespace

}  // namespace quoin::models

namespace quoin {

extern constinit const FormatDriver kQubicleFormat = {
    .info = {FileFormat::Qubicle, ".qb", "Qubicle, also .qbt, .qbcl and .qef",
             FormatCapability::Read | FormatCapability::Write, ".qbt .qbcl .qef"},
    .detect = models::is_qubicle,
    .read = [](const FormatInput& input) { return models::read_qubicle(input.bytes); },
    .encode = models::write_qb,
};

}  // namespace quoin

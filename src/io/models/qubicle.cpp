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
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/byte_stream.h"
#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "core/work/progress_steps.h"
#include "io/format_driver.h"
#include "io/models/model_builder.h"
#include "io/placed_grids.h"

namespace quoin::models {

namespace {

constexpr std::string_view kTree = "QB 2";
constexpr std::string_view kProject = "QBCL";
constexpr std::string_view kExchange = "Qubicle Exchange Format";
constexpr std::int32_t kMaxPlace = 1 << 26;
constexpr int kMaxEdge = 1 << 14;

Rgba8 colour_of(std::uint32_t rgba, bool is_bgra) {
  const auto low = static_cast<std::uint8_t>(rgba);
  const auto high = static_cast<std::uint8_t>(rgba >> 16);
  return {is_bgra ? high : low, static_cast<std::uint8_t>(rgba >> 8), is_bgra ? low : high,
          static_cast<std::uint8_t>(rgba >> 24)};
}

/// A matrix's size and position. Qubicle gives empty matrices any position.
struct Matrix {
  std::string name;
  IVec3 size{0};
  IVec3 place{0};
};

std::optional<IVec3> read_size(ByteReader& reader) {
  IVec3 size{0};
  bool is_sound = true;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t edge = reader.u32();
    is_sound &= edge <= std::uint32_t{kMaxEdge};
    size[axis] = static_cast<int>(edge);
  }
  return is_sound ? std::optional(size) : std::nullopt;
}

bool is_empty(IVec3 size) {
  return size.x == 0 || size.y == 0 || size.z == 0;
}

std::string empty_text(const std::string& name) {
  return "left out: the matrix \"" + printable(name) + "\", which has no voxels";
}

std::optional<IVec3> read_place(ByteReader& reader) {
  IVec3 place{0};
  bool is_sound = true;
  for (int axis = 0; axis < 3; ++axis) {
    place[axis] = reader.i32();
    is_sound &= place[axis] >= -kMaxPlace && place[axis] <= kMaxPlace;
  }
  return is_sound ? std::optional(place) : std::nullopt;
}

/// Returns a model that rotates about a pivot, in voxels from its position. If the pivot is out of range it rotates
/// about the position.
Model model_about(const Matrix& matrix, const DVec3& pivot) {
  constexpr double kFarthest = 1e6;
  Model model;
  model.name = matrix.name;
  model.canvas = {IVec3(0), matrix.size};
  if (is_finite(pivot) && glm::length(pivot) < kFarthest) model.pivot = pivot;
  model.position = DVec3(matrix.place) + model.pivot;
  return model;
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
  const auto size = read_size(reader_);
  const auto place = read_place(reader_);
  if (reader_.failed()) return too_short();
  if (!size || (!place && !is_empty(*size))) return bad_at(at, "a matrix's size or position is out of range");
  matrix.size = *size;
  if (is_empty(matrix.size)) {
    builder_.warn(empty_text(matrix.name));
    return read_slices(matrix);  // in the packed form, slices have end marks
  }
  matrix.place = *place;
  Model model;
  model.name = matrix.name;
  model.position = DVec3(matrix.place);
  model.canvas = {IVec3(0), matrix.size};
  builder_.begin(std::move(model));
  return read_slices(matrix);
}

Status QbReader::read_slices(const Matrix& matrix) {
  for (int z = 0; z < matrix.size.z; ++z) {
    if (auto done = read_slice(matrix, z); !done) return done;
  }
  return {};
}

Status QbReader::read_slice(const Matrix& matrix, int z) {
  constexpr std::uint32_t kRun = 2;
  constexpr std::uint32_t kNextSlice = 6;
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
  Status put_voxels(const Matrix& matrix, std::span<const std::byte> packed, std::size_t at);

  std::span<const std::byte> bytes_;
  std::vector<Rgba8> colours_;
  ModelBuilder builder_;
};

Status QbtReader::read_node(ByteReader& reader, int depth) {
  enum class Kind : std::uint32_t { Matrix, Model, Compound };
  constexpr int kDeepest = 64;
  const std::size_t at = reader.position();
  const auto kind = static_cast<Kind>(reader.u32());
  const std::size_t size = reader.u32();
  if (reader.failed() || size > reader.remaining()) return bad_at(at, "a node extends past the end of the file");
  if (depth > kDeepest) return make_error(ErrorCode::LimitExceeded, "nodes are nested more than 64 deep", {}, at);
  ByteReader node(bytes_, reader.position(), reader.position() + size);
  static_cast<void>(reader.take(size));
  if (kind == Kind::Matrix || kind == Kind::Compound) return read_matrix(node);
  if (kind != Kind::Model) {
    builder_.warn("left out: a node of unknown kind " + std::to_string(static_cast<std::uint32_t>(kind)));
    return {};
  }
  const std::size_t children = node.count(8);
  if (node.failed()) return bad_at(at, "a node claims more children than the file can hold");
  for (std::size_t i = 0; i < children; ++i) {
    if (auto done = read_node(node, depth + 1); !done) return done;
  }
  return {};
}

Status QbtReader::read_matrix(ByteReader& reader) {
  const std::size_t at = reader.position();
  Matrix matrix;
  matrix.name = reader.text(reader.u32());
  const auto place = read_place(reader);
  static_cast<void>(reader.take(12));  // scale
  const std::array<float, 3> pivot = {reader.f32(), reader.f32(), reader.f32()};
  const auto size = read_size(reader);
  const std::size_t packed_at = reader.position() + 4;
  const auto packed = reader.take(reader.u32());
  if (reader.failed()) return bad_at(at, "a matrix ends too early");
  if (!size || (!place && !is_empty(*size))) return bad_at(at, "a matrix's size or position is out of range");
  if (is_empty(*size)) {
    builder_.warn(empty_text(matrix.name));
    return {};
  }
  matrix.size = *size;
  matrix.place = *place;
  Model model = model_about(matrix, DVec3(pivot[0], pivot[1], pivot[2]));
  builder_.begin(std::move(model));
  return put_voxels(matrix, packed, packed_at);
}

// x changes slowest, then z, then y. The last byte is the mask of visible faces: 0 for empty voxels.
Status QbtReader::put_voxels(const Matrix& matrix, std::span<const std::byte> packed, std::size_t at) {
  ByteStream stream(packed, 0, Compression::Zlib);
  std::vector<std::byte> column(static_cast<std::size_t>(matrix.size.y) * 4);
  for (int x = 0; x < matrix.size.x; ++x) {
    for (int z = 0; z < matrix.size.z; ++z) {
      const auto read = stream.read(column);
      if (!read)
        return make_error(read.error().code, read.error().message, {}, at + read.error().byte_offset.value_or(0));
      if (*read != column.size()) return bad_at(at, "a matrix has fewer voxels than its size requires");
      ByteReader voxels(column);
      for (int y = 0; y < matrix.size.y; ++y) {
        Rgba8 colour = colour_of(voxels.u32(), false);
        if (colour.a == 0) continue;
        if (!colours_.empty()) {
          if (colour.r >= colours_.size()) return bad_at(at, "a colour index is beyond the colour map");
          colour = colours_[colour.r];
        }
        colour.a = 255;
        if (auto put = builder_.put({x, y, z}, colour); !put) return put;
      }
    }
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
    constexpr std::uint32_t kVersion = 2;
    if (!reader_.failed() && version != kVersion) {
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
  Status put_columns(const Matrix& matrix, std::span<const std::byte> packed, std::size_t at);
  Status read_children(int depth, bool is_used, bool is_shown);

  ByteReader reader_;
  ModelBuilder builder_;
};

/// `is_used`: false for the source matrices of a compound.
Status QbclReader::read_node(int depth, bool is_used, bool is_shown) {
  enum class Kind : std::uint32_t { Matrix, Model, Compound };
  constexpr int kDeepest = 64;
  const std::size_t at = reader_.position();
  const auto kind = static_cast<Kind>(reader_.u32());
  static_cast<void>(reader_.u32());
  std::string name(reader_.text(reader_.u32()));
  is_shown &= reader_.u8() != 0;
  static_cast<void>(reader_.take(2));
  if (reader_.failed()) return too_short();
  if (depth > kDeepest) return make_error(ErrorCode::LimitExceeded, "nodes are nested more than 64 deep", {}, at);
  if (kind == Kind::Model) {
    static_cast<void>(reader_.take(36));
    return read_children(depth, is_used, is_shown);
  }
  // The file does not store a node's size.
  if (kind != Kind::Matrix && kind != Kind::Compound) return bad_at(at, "unknown node kind");
  if (auto done = read_matrix(std::move(name), is_used, is_shown); !done) return done;
  return kind == Kind::Compound ? read_children(depth, false, is_shown) : Status();
}

Status QbclReader::read_children(int depth, bool is_used, bool is_shown) {
  const std::size_t at = reader_.position();
  const std::size_t children = reader_.count(15);
  if (reader_.failed()) return bad_at(at, "a node claims more children than the file can hold");
  for (std::size_t i = 0; i < children; ++i) {
    if (auto done = read_node(depth + 1, is_used, is_shown); !done) return done;
  }
  return {};
}

Status QbclReader::read_matrix(std::string name, bool is_used, bool is_shown) {
  const std::size_t at = reader_.position();
  Matrix matrix;
  matrix.name = std::move(name);
  const auto size = read_size(reader_);
  const auto place = read_place(reader_);
  if (reader_.failed()) return too_short();
  if (!size || (!place && !is_empty(*size))) return bad_at(at, "a matrix's size or position is out of range");
  std::array<float, 3> pivot{};
  for (float& part : pivot) part = reader_.f32();
  const std::size_t packed_at = reader_.position() + 4;
  const auto packed = reader_.take(reader_.u32());
  if (reader_.failed()) return too_short();
  if (!is_used) return {};
  if (is_empty(*size)) {
    builder_.warn(empty_text(matrix.name));
    return {};
  }
  matrix.size = *size;
  matrix.place = *place;
  Model model = model_about(matrix, DVec3(pivot[0], pivot[1], pivot[2]));
  model.visible = is_shown;
  builder_.begin(std::move(model));
  return put_columns(matrix, packed, packed_at);
}

Status QbclReader::put_columns(const Matrix& matrix, std::span<const std::byte> packed, std::size_t at) {
  constexpr std::uint32_t kRun = 2;
  ByteStream stream(packed, 0, Compression::Zlib);
  std::vector<std::byte> entries;
  const auto read = [&](std::size_t count) -> Status {
    entries.resize(count);
    const auto got = stream.read(entries);
    if (!got) return make_error(got.error().code, got.error().message, {}, at + got.error().byte_offset.value_or(0));
    return *got == count ? Status() : Status(bad_at(at, "a matrix has fewer voxels than its size requires"));
  };
  for (int x = 0; x < matrix.size.x; ++x) {
    for (int z = 0; z < matrix.size.z; ++z) {
      if (auto done = read(2); !done) return done;
      const std::size_t count = ByteReader(entries).u16();
      if (auto done = read(count * 4); !done) return done;
      ByteReader column(entries);
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
          const IVec3 first{x, static_cast<int>(y), z};
          if (auto put = builder_.put(first, colour, static_cast<int>(length), 1); !put) return put;
        }
        y += length;
      }
    }
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

constexpr FormatHolds kHolds = {.extension = ".qb", .names = true, .several = true, .transparency = true};
constexpr std::uint32_t kVersion = 0x0000'0101;
constexpr std::uint32_t kRun = 2;
constexpr std::uint32_t kNextSlice = 6;
constexpr std::size_t kLongestName = 255;
// The size limit of readers.
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 32;

std::uint32_t word_of(Rgba8 colour) {
  const auto shifted = [](std::uint8_t channel, int bits) { return static_cast<std::uint32_t>(channel) << bits; };
  return shifted(colour.r, 0) | shifted(colour.g, 8) | shifted(colour.b, 16) | shifted(colour.a, 24);
}

/// Writes runs of equal words, which do not extend past a slice.
class RunWriter {
 public:
  explicit RunWriter(ByteWriter& out) : out_(out) {}
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
  RunWriter runs(out);
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
  auto placed = place_grids(output.scene, kHolds);
  if (!placed) return placed.error();
  if (placed->grids.empty())
    return make_error(ErrorCode::Unsupported, "the scene has no voxels, and .qb needs at least one");
  const std::vector<Rgba8> colours = colours_of(output.scene.types);
  ByteWriter out;
  out.u32(kVersion);
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

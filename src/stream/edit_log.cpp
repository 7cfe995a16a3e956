#include <algorithm>
#include <array>
#include <bit>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/stream/world_edit.h>

#include "core/bytes/bytes.h"

namespace quoin {
namespace {

// docs/formats/edit_log.md
constexpr std::string_view kMagic = "QuoinEdt";
constexpr std::uint32_t kVersion = 1;

auto order_of(const LoggedEdit& each) {
  return std::tuple(each.number, each.author);
}

// The CRC-32 of each byte value: polynomial 0xEDB88320, lowest bit first.
constexpr std::array<std::uint32_t, 256> kChecksums = [] {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t value = 0; value < table.size(); ++value) {
    std::uint32_t rest = value;
    for (int bit = 0; bit < 8; ++bit) rest = (rest >> 1) ^ ((rest & 1) != 0 ? 0xEDB88320U : 0U);
    table[value] = rest;
  }
  return table;
}();

// Not with zlib, which the core library does not link.
std::uint32_t checksum_of(std::span<const std::byte> bytes) {
  std::uint32_t rest = ~0U;
  for (const std::byte byte : bytes)
    rest = (rest >> 8) ^ kChecksums[(rest ^ std::to_integer<std::uint32_t>(byte)) & 255];
  return ~rest;
}

/// Writes an edit's content as bytes. `visit_fields` describes each kind for reading and writing.
class Writer {
 public:
  explicit Writer(ByteWriter& out) : out_(out) {}

  bool operator()(const std::uint32_t& number) { return out_.u32(number), true; }
  bool operator()(const VoxelType& type) { return out_.u16(type), true; }
  bool operator()(const double& number) { return out_.f64(number), true; }
  bool operator()(const IVec3& v) {
    for (int axis = 0; axis < 3; ++axis) out_.i32(v[axis]);
    return true;
  }
  bool operator()(const DVec3& v) {
    for (int axis = 0; axis < 3; ++axis) out_.f64(v[axis]);
    return true;
  }
  bool operator()(const std::vector<PlacedVoxel>& voxels) {
    out_.u32(static_cast<std::uint32_t>(voxels.size()));
    for (const PlacedVoxel& each : voxels) (*this)(each.voxel), (*this)(each.type);
    return true;
  }
  bool operator()(const std::vector<std::byte>& bytes) {
    out_.u32(static_cast<std::uint32_t>(bytes.size()));
    out_.raw(bytes);
    return true;
  }

 private:
  ByteWriter& out_;
};

class Reader {
 public:
  explicit Reader(ByteReader& in) : in_(in) {}

  bool operator()(std::uint32_t& number) { return take(number); }
  bool operator()(VoxelType& type) { return take(type); }
  bool operator()(double& number) { return take(number); }
  bool operator()(IVec3& v) { return take(v.x) && take(v.y) && take(v.z); }
  bool operator()(DVec3& v) { return take(v.x) && take(v.y) && take(v.z); }
  bool operator()(std::vector<PlacedVoxel>& voxels) {
    constexpr std::size_t kBytes = 14;
    std::uint32_t count = 0;
    if (!take(count) || in_.remaining() / kBytes < count) return false;
    voxels.resize(count);
    return std::ranges::all_of(voxels, [&](PlacedVoxel& each) { return (*this)(each.voxel) && (*this)(each.type); });
  }
  bool operator()(std::vector<std::byte>& bytes) {
    std::uint32_t count = 0;
    if (!take(count) || in_.remaining() < count) return false;
    const auto taken = in_.take(count);
    bytes.assign(taken.begin(), taken.end());
    return true;
  }

 private:
  // Takes nothing if too few bytes are left, so that errors name the byte where the field begins.
  template <class T>
  bool take(T& number) {
    if (in_.remaining() < sizeof(T)) return false;
    number = load<T>(in_.take(sizeof(T)).data(), std::endian::little);
    return true;
  }
  ByteReader& in_;
};

// The fields of each kind, in file order. `Edit` is const for writing.
template <class Edit, class Each>
bool visit_fields(Edit& edit, Each& each) {
  using Kind = std::remove_const_t<Edit>;
  if constexpr (std::is_same_v<Kind, WorldEdit::SetVoxels>) {
    return each(edit.voxels);
  } else if constexpr (std::is_same_v<Kind, WorldEdit::SetData>) {
    return each(edit.voxel) && each(edit.state) && each(edit.bytes);
  } else if constexpr (std::is_same_v<Kind, WorldEdit::FillBox>) {
    return each(edit.box.min) && each(edit.box.max) && each(edit.type);
  } else if constexpr (std::is_same_v<Kind, WorldEdit::FillSphere>) {
    return each(edit.centre) && each(edit.radius) && each(edit.type);
  } else if constexpr (std::is_same_v<Kind, WorldEdit::FieldSphere>) {
    return each(edit.centre) && each(edit.radius) && each(edit.blend) && each(edit.material);
  } else {
    static_assert(std::is_same_v<Kind, WorldEdit::FieldBox>);
    return each(edit.min) && each(edit.max) && each(edit.rounding) && each(edit.blend) && each(edit.material);
  }
}

// Creates an empty edit of a kind by its number. Returns false if there is no such kind.
template <std::size_t Kind = 0>
bool begin_kind(std::uint32_t number, WorldEdit::Content& content) {
  if constexpr (Kind < std::variant_size_v<WorldEdit::Content>) {
    if (number != Kind) return begin_kind<Kind + 1>(number, content);
    content.emplace<Kind>();
    return true;
  } else {
    return false;
  }
}

Result<LoggedEdit> read_edit(std::span<const std::byte> body, std::size_t offset) {
  ByteReader in(body);
  const auto fault = [&](const char* what) { return bad_at(offset + in.position(), what); };
  constexpr std::size_t kFixed = 8 + 4 + 4 + 4;
  if (in.remaining() < kFixed) return fault("unexpected end in an edit");
  LoggedEdit read;
  read.number = in.u64();
  read.author = in.u32();
  read.edit.grid = in.u32();
  if (!begin_kind(in.u32(), read.edit.content)) return fault("unknown kind of edit");
  Reader fields(in);
  if (!std::visit([&](auto& content) { return visit_fields(content, fields); }, read.edit.content)) {
    return fault("unexpected end in an edit");
  }
  if (in.remaining() > 0) return fault("extra bytes in an edit");
  return read;
}

}  // namespace

void EditLog::add(LoggedEdit edit) {
  QUOIN_ASSERT(edits_.empty() || order_of(edits_.back()) < order_of(edit), "an edit later than the last one");
  edits_.push_back(std::move(edit));
}

Result<EditLog> EditLog::merged(const EditLog& a, const EditLog& b) {
  EditLog both;
  auto one = a.edits_.begin();
  auto other = b.edits_.begin();
  while (one != a.edits_.end() || other != b.edits_.end()) {
    if (other == b.edits_.end() || (one != a.edits_.end() && order_of(*one) < order_of(*other))) {
      both.edits_.push_back(*one++);
    } else if (one == a.edits_.end() || order_of(*other) < order_of(*one)) {
      both.edits_.push_back(*other++);
    } else {
      if (*one != *other) {
        return make_error(ErrorCode::InvalidArgument, "edit " + std::to_string(one->number) + " of author " +
                                                          std::to_string(one->author) + " differs between the logs");
      }
      both.edits_.push_back(*one++);
      ++other;
    }
  }
  return both;
}

std::vector<std::byte> EditLog::encode() const {
  ByteWriter out;
  out.text(kMagic);
  out.u32(kVersion);
  for (const LoggedEdit& each : edits_) {
    ByteWriter body;
    body.reserve(64);
    body.u64(each.number);
    body.u32(each.author);
    body.u32(each.edit.grid);
    body.u32(static_cast<std::uint32_t>(each.edit.content.index()));
    Writer fields(body);
    std::visit([&](const auto& content) { visit_fields(content, fields); }, each.edit.content);
    out.u32(static_cast<std::uint32_t>(body.size()));
    out.u32(checksum_of(body.bytes()));
    out.raw(body.bytes());
  }
  return out.take();
}

Result<EditLog> EditLog::decode(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  if (in.remaining() < kMagic.size() + sizeof(kVersion) || in.text(kMagic.size()) != kMagic) {
    return bad_at(0, "not an edit log");
  }
  if (const std::uint32_t version = in.u32(); version != kVersion) {
    return make_error(ErrorCode::Unsupported, "unsupported edit log version " + std::to_string(version), {},
                      kMagic.size());
  }
  EditLog log;
  while (in.remaining() > 0) {
    const std::size_t start = in.position();
    const std::uint32_t size = in.u32();
    const std::uint32_t checksum = in.u32();
    const auto body = in.take(size);
    if (in.failed()) return bad_at(start, "unexpected end in an edit");
    if (checksum_of(body) != checksum) return bad_at(start, "wrong checksum of an edit");
    auto edit = read_edit(body, start + 8);
    if (!edit) return edit.error();
    if (!log.edits_.empty() && order_of(log.edits_.back()) >= order_of(*edit)) {
      return bad_at(start, "edit out of order");
    }
    log.edits_.push_back(std::move(*edit));
  }
  return log;
}

}  // namespace quoin

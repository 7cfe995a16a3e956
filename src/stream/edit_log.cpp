#include <zlib.h>

#include <algorithm>
#include <bit>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/stream/world_edit.h>

#include "store/chunk/content.h"

namespace quoin {
namespace {

using store::ContentReader;
using store::put_number;

// docs/formats/edit_log.md
constexpr std::string_view kMagic = "QuoinEdt";
constexpr std::uint32_t kVersion = 1;

auto order_of(const LoggedEdit& each) {
  return std::tuple(each.number, each.author);
}

std::uint32_t checksum_of(std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));  // NOLINT: zlib's bytes
}

/// Writes an edit's content as bytes. `visit_fields` describes each kind for reading and writing.
class Writer {
 public:
  explicit Writer(std::vector<std::byte>& out) : out_(out) {}

  bool operator()(const std::uint32_t& number) { return put(number); }
  bool operator()(const VoxelType& type) { return put(type); }
  bool operator()(const double& number) { return put(std::bit_cast<std::uint64_t>(number)); }
  bool operator()(const IVec3& v) {
    for (int axis = 0; axis < 3; ++axis) put(static_cast<std::uint32_t>(v[axis]));
    return true;
  }
  bool operator()(const DVec3& v) {
    for (int axis = 0; axis < 3; ++axis) (*this)(v[axis]);
    return true;
  }
  bool operator()(const std::vector<PlacedVoxel>& voxels) {
    put(static_cast<std::uint32_t>(voxels.size()));
    for (const PlacedVoxel& each : voxels) (*this)(each.voxel), (*this)(each.type);
    return true;
  }
  bool operator()(const std::vector<std::byte>& bytes) {
    put(static_cast<std::uint32_t>(bytes.size()));
    out_.insert(out_.end(), bytes.begin(), bytes.end());
    return true;
  }

 private:
  template <class T>
  bool put(T number) {
    put_number(out_, number);
    return true;
  }
  std::vector<std::byte>& out_;
};

class Reader {
 public:
  explicit Reader(ContentReader& in) : in_(in) {}

  bool operator()(std::uint32_t& number) { return take(number); }
  bool operator()(VoxelType& type) { return take(type); }
  bool operator()(double& number) {
    std::uint64_t bits = 0;
    if (!take(bits)) return false;
    number = std::bit_cast<double>(bits);
    return true;
  }
  bool operator()(IVec3& v) {
    for (int axis = 0; axis < 3; ++axis) {
      std::uint32_t number = 0;
      if (!take(number)) return false;
      v[axis] = static_cast<int>(number);
    }
    return true;
  }
  bool operator()(DVec3& v) { return (*this)(v.x) && (*this)(v.y) && (*this)(v.z); }
  bool operator()(std::vector<PlacedVoxel>& voxels) {
    constexpr std::size_t kBytes = 14;
    std::uint32_t count = 0;
    if (!take(count) || !in_.has(count * kBytes)) return false;
    voxels.resize(count);
    return std::ranges::all_of(voxels, [&](PlacedVoxel& each) { return (*this)(each.voxel) && (*this)(each.type); });
  }
  bool operator()(std::vector<std::byte>& bytes) {
    std::uint32_t count = 0;
    if (!take(count) || !in_.has(count)) return false;
    const auto taken = in_.take_bytes(count);
    bytes.assign(taken.begin(), taken.end());
    return true;
  }

 private:
  template <class T>
  bool take(T& number) {
    if (!in_.has(sizeof(T))) return false;
    number = in_.take<T>();
    return true;
  }
  ContentReader& in_;
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
  ContentReader in(body);
  const auto fault = [&](const char* what) { return make_error(ErrorCode::BadFormat, what, {}, offset + in.at()); };
  constexpr std::size_t kFixed = 8 + 4 + 4 + 4;
  if (!in.has(kFixed)) return fault("unexpected end in an edit");
  LoggedEdit read;
  read.number = in.take<std::uint64_t>();
  read.author = in.take<std::uint32_t>();
  read.edit.grid = in.take<std::uint32_t>();
  if (!begin_kind(in.take<std::uint32_t>(), read.edit.content)) return fault("unknown kind of edit");
  Reader fields(in);
  if (!std::visit([&](auto& content) { return visit_fields(content, fields); }, read.edit.content)) {
    return fault("unexpected end in an edit");
  }
  if (!in.is_at_end()) return fault("extra bytes in an edit");
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
  std::vector<std::byte> out;
  for (const char c : kMagic) out.push_back(static_cast<std::byte>(c));
  put_number(out, kVersion);
  for (const LoggedEdit& each : edits_) {
    std::vector<std::byte> body;
    put_number(body, each.number);
    put_number(body, each.author);
    put_number(body, each.edit.grid);
    put_number(body, static_cast<std::uint32_t>(each.edit.content.index()));
    Writer fields(body);
    std::visit([&](const auto& content) { visit_fields(content, fields); }, each.edit.content);
    put_number(out, static_cast<std::uint32_t>(body.size()));
    put_number(out, checksum_of(body));
    out.insert(out.end(), body.begin(), body.end());
  }
  return out;
}

Result<EditLog> EditLog::decode(std::span<const std::byte> bytes) {
  ContentReader in(bytes);
  const auto fault = [](const char* what, std::size_t at) { return make_error(ErrorCode::BadFormat, what, {}, at); };
  const auto has_magic = [&] {
    return std::ranges::equal(in.take_bytes(kMagic.size()), kMagic,
                              [](std::byte a, char b) { return a == static_cast<std::byte>(b); });
  };
  if (!in.has(kMagic.size() + sizeof(kVersion)) || !has_magic()) return fault("not an edit log", 0);
  if (const auto version = in.take<std::uint32_t>(); version != kVersion) {
    return make_error(ErrorCode::Unsupported, "unsupported edit log version " + std::to_string(version), {},
                      kMagic.size());
  }
  EditLog log;
  while (!in.is_at_end()) {
    const std::size_t start = in.at();
    if (!in.has(8)) return fault("unexpected end in an edit", start);
    const auto size = in.take<std::uint32_t>();
    const auto checksum = in.take<std::uint32_t>();
    if (!in.has(size)) return fault("unexpected end in an edit", start);
    const auto body = in.take_bytes(size);
    if (checksum_of(body) != checksum) return fault("wrong checksum of an edit", start);
    auto edit = read_edit(body, start + 8);
    if (!edit) return edit.error();
    if (!log.edits_.empty() && order_of(log.edits_.back()) >= order_of(*edit)) {
      return fault("edit out of order", start);
    }
    log.edits_.push_back(std::move(*edit));
  }
  return log;
}

}  // namespace quoin

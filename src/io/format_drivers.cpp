#include <algorithm>
#include <deque>
#include <string>
#include <vector>

#include <quoin/core/assert.h>

#include "io/format_driver.h"

namespace quoin {

// The formats of this layer, one row each. Adding a format: a folder with a FormatDriver, and a row here.
// Weak detection comes late: the first driver that accepts a file's beginning gets it.
#define QUOIN_FORMATS(ROW)    \
  ROW(kVoxFormat)             \
  ROW(kSceneFormat)           \
  ROW(kMinecraftFormat)       \
  ROW(kSchematicFormat)       \
  ROW(kQubicleFormat)         \
  ROW(kGoxelFormat)           \
  ROW(kVoxlapFormat)          \
  ROW(kBinvoxFormat)          \
  ROW(kCubeWorldFormat)       \
  ROW(kLuantiSchematicFormat) \
  ROW(kHeightsFormat)         \
  ROW(kVdbFormat)             \
  ROW(kNiftiFormat)           \
  ROW(kNrrdFormat)            \
  ROW(kGlbFormat)             \
  ROW(kGltfFormat)            \
  ROW(kPlyFormat)             \
  ROW(kStlFormat)             \
  ROW(kThreeMfFormat)         \
  ROW(kOffFormat)             \
  ROW(kObjFormat)             \
  ROW(kLuantiMapFormat)

#define QUOIN_DECLARE(driver) extern const FormatDriver driver;
QUOIN_FORMATS(QUOIN_DECLARE)
#undef QUOIN_DECLARE

namespace {

/// All drivers, and their properties in the same order. Spans of them stay valid when drivers are added.
class FormatTable {
 public:
  FormatTable() {
    drivers_.reserve(kMost);
    infos_.reserve(kMost);
#define QUOIN_ADD(driver) add(driver);
    QUOIN_FORMATS(QUOIN_ADD)
#undef QUOIN_ADD
  }

  void add(const FormatDriver& driver) {
    const FormatInfo& info = driver.info;
    const auto is_same = [&](const FormatInfo& known) { return known.format == info.format; };
    QUOIN_ASSERT(drivers_.size() < kMost, "the table has room for the driver");
    QUOIN_ASSERT(std::ranges::none_of(infos_, is_same), "each format has one driver");
    QUOIN_ASSERT(info.extension.starts_with('.'), "the extension starts with a point");
    const bool is_mesh = info.can(FormatCapability::Meshes);
    QUOIN_ASSERT(!info.can(FormatCapability::Read) || driver.read != nullptr || driver.read_mesh != nullptr ||
                     driver.open_chunks != nullptr,
                 "a format that can be read has a reader");
    QUOIN_ASSERT(!info.can(FormatCapability::Write) ||
                     (is_mesh ? driver.plan_mesh != nullptr : driver.encode != nullptr || driver.write != nullptr),
                 "a format that can be written has a writer");
    QUOIN_ASSERT(info.can(FormatCapability::Chunks) == (driver.open_chunks != nullptr),
                 "a format that is read by chunks opens them");
    drivers_.push_back(&driver);
    infos_.push_back(info);
  }

  [[nodiscard]] bool is_full() const { return drivers_.size() == kMost; }
  [[nodiscard]] std::span<const FormatDriver* const> drivers() const { return drivers_; }
  [[nodiscard]] std::span<const FormatInfo> infos() const { return infos_; }

 private:
  static constexpr std::size_t kMost = 64;
  std::vector<const FormatDriver*> drivers_;
  std::vector<FormatInfo> infos_;
};

FormatTable& table() {
  static FormatTable all;
  return all;
}

}  // namespace

bool register_format(const FormatDriver& driver) {
  table().add(driver);
  return true;
}

Status add_format(const CustomFormat& format) {
  const FormatInfo& info = format.info;
  const auto refuse = [&](const std::string& reason) {
    return make_error(ErrorCode::InvalidArgument, "cannot add format " + std::string(info.name()) + ": " + reason);
  };
  if (info.name().empty() || info.extension.size() < 2 || !info.extension.starts_with('.')) {
    return refuse("it needs a name and an extension that starts with a point");
  }
  for (const FormatInfo& known : file_formats()) {
    if (known.format == info.format) return refuse("the name exists");
    if (known.extension == info.extension) return refuse("the extension exists");
  }
  const bool has_others =
      info.can(FormatCapability::Meshes) || info.can(FormatCapability::Volume) || info.can(FormatCapability::Chunks);
  if (has_others || info.can(FormatCapability::Read) != (format.read != nullptr && format.detect != nullptr) ||
      info.can(FormatCapability::Write) != (format.encode != nullptr)) {
    return refuse("its capabilities do not match its functions");
  }
  if (table().is_full()) return make_error(ErrorCode::LimitExceeded, "cannot add a format: there are 64");
  static std::deque<FormatDriver> added;  // with stable addresses
  added.push_back({.info = info, .detect = format.detect, .read = format.read, .encode = format.encode});
  table().add(added.back());
  return {};
}

std::span<const FormatDriver* const> format_drivers() {
  return table().drivers();
}

std::span<const FormatInfo> file_formats() {
  return table().infos();
}

const FormatDriver& driver_of(FileFormat format) {
  const auto drivers = format_drivers();
  const auto found = std::find_if(drivers.begin(), drivers.end(),
                                  [&](const FormatDriver* driver) { return driver->info.format == format; });
  QUOIN_ASSERT(found != drivers.end(), "the format is one of file_formats()");
  return **found;
}

const FormatInfo& format_info(FileFormat format) {
  return driver_of(format).info;
}

bool can(std::optional<FileFormat> format, FormatCapability wanted) {
  return format && format_info(*format).can(wanted);
}

}  // namespace quoin

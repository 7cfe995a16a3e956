#include <algorithm>
#include <deque>
#include <string>
#include <string_view>
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

  static constexpr std::size_t kMost = 64;
  [[nodiscard]] bool is_full() const { return drivers_.size() == kMost; }
  [[nodiscard]] std::span<const FormatDriver* const> drivers() const { return drivers_; }
  [[nodiscard]] std::span<const FormatInfo> infos() const { return infos_; }

 private:
  std::vector<const FormatDriver*> drivers_;
  std::vector<FormatInfo> infos_;
};

FormatTable& table() {
  static FormatTable all;
  return all;
}

/// Returns true if a file can have this extension as format_with_extension compares it: in lower case, with one point,
/// at the beginning. Blanks separate extensions.
bool is_extension(std::string_view text) {
  return text.size() > 1 && text.find(' ') == std::string_view::npos &&
         lower_case_extension(std::string("a").append(text)) == text;
}

/// Returns the reason why the extensions of a new format cannot be used; empty if there is none.
std::string find_extension_error(const FormatInfo& info) {
  for (const std::string_view extension : extensions_of(info, FormatCapability::Read)) {
    const std::string quoted = "extension \"" + std::string(extension) + "\"";
    if (!is_extension(extension)) return "invalid " + quoted;
    for (const FormatInfo& known : file_formats()) {
      const auto others = extensions_of(known, FormatCapability::Read);
      if (std::ranges::find(others, extension) != others.end()) return quoted + " exists";
    }
  }
  return {};
}

}  // namespace

bool register_format(const FormatDriver& driver) {
  table().add(driver);
  return true;
}

Status add_format(const CustomFormat& format) {
  const FormatInfo& info = format.info;
  const auto refuse = [&](const std::string& reason, ErrorCode code = ErrorCode::InvalidArgument) {
    return make_error(code, "cannot add format " + std::string(info.name()) + ": " + reason);
  };
  if (info.name().empty()) return refuse("it has no name");
  const auto has_name = [&](const FormatInfo& known) { return known.format == info.format; };
  if (std::ranges::any_of(file_formats(), has_name)) return refuse("the name exists");
  if (const std::string error = find_extension_error(info); !error.empty()) return refuse(error);
  if (!info.can(FormatCapability::Read) && !info.can(FormatCapability::Write)) {
    return refuse("it can be neither read nor written");
  }
  const bool has_others =
      info.can(FormatCapability::Meshes) || info.can(FormatCapability::Volume) || info.can(FormatCapability::Chunks);
  if (has_others || info.can(FormatCapability::Read) != (format.read != nullptr && format.detect != nullptr) ||
      info.can(FormatCapability::Write) != (format.encode != nullptr)) {
    return refuse("its capabilities do not match its functions");
  }
  if (table().is_full()) {
    return refuse("there are " + std::to_string(FormatTable::kMost), ErrorCode::LimitExceeded);
  }
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

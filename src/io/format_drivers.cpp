#include <algorithm>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/assert.h>

#include "io/format_driver.h"

namespace quoin {

namespace {

/// Formats that a CMake option switches off together.
struct FormatGroup {
  std::string_view option;
  bool is_built = true;
};

// cmake/QuoinFormats.cmake defines QUOIN_WITHOUT_X for the groups that are switched off.
#ifdef QUOIN_WITHOUT_MESHES
constexpr FormatGroup kMeshes{"QUOIN_WITH_MESHES", false};
#else
constexpr FormatGroup kMeshes{"QUOIN_WITH_MESHES"};
#endif
#ifdef QUOIN_WITHOUT_MODELS
constexpr FormatGroup kModels{"QUOIN_WITH_MODELS", false};
#else
constexpr FormatGroup kModels{"QUOIN_WITH_MODELS"};
#endif
#ifdef QUOIN_WITHOUT_GAME_WORLDS
constexpr FormatGroup kGameWorlds{"QUOIN_WITH_GAME_WORLDS", false};
#else
constexpr FormatGroup kGameWorlds{"QUOIN_WITH_GAME_WORLDS"};
#endif
#ifdef QUOIN_WITHOUT_VOLUMES
constexpr FormatGroup kVolumes{"QUOIN_WITH_VOLUMES", false};
#else
constexpr FormatGroup kVolumes{"QUOIN_WITH_VOLUMES"};
#endif

}  // namespace

// The formats of this layer, one row each. Adding a format: a folder with a FormatDriver, and a row here. Rows of a
// group repeat the format and its extensions, for builds without it; cmake/QuoinFormats.cmake lists its sources.
// Weak detection comes late: the first driver that accepts a file's beginning gets it.
#define QUOIN_FORMATS(ROW, GROUPED)                                                                                  \
  ROW(kVoxFormat)                                                                                                    \
  ROW(kSceneFormat)                                                                                                  \
  GROUPED(kGameWorlds, kMinecraftFormat, FileFormat::Minecraft, ".mca", "")                                          \
  GROUPED(kGameWorlds, kSchematicFormat, FileFormat::Schematic, ".schem", ".schematic .litematic .nbt .mcstructure") \
  GROUPED(kModels, kQubicleFormat, FileFormat::Qubicle, ".qb", ".qbt .qbcl .qef")                                    \
  GROUPED(kModels, kGoxelFormat, FileFormat::Goxel, ".gox", "")                                                      \
  GROUPED(kModels, kVoxlapFormat, FileFormat::Voxlap, ".vxl", ".kv6 .kvx")                                           \
  GROUPED(kModels, kBinvoxFormat, FileFormat::Binvox, ".binvox", "")                                                 \
  GROUPED(kModels, kCubeWorldFormat, FileFormat::CubeWorld, ".cub", "")                                              \
  GROUPED(kGameWorlds, kLuantiSchematicFormat, FileFormat::LuantiSchematic, ".mts", "")                              \
  ROW(kHeightsFormat)                                                                                                \
  GROUPED(kVolumes, kVdbFormat, FileFormat::Vdb, ".vdb", ".nvdb")                                                    \
  GROUPED(kVolumes, kNiftiFormat, FileFormat::Nifti, ".nii", "")                                                     \
  GROUPED(kVolumes, kNrrdFormat, FileFormat::Nrrd, ".nrrd", ".nhdr")                                                 \
  GROUPED(kMeshes, kGlbFormat, FileFormat::Glb, ".glb", "")                                                          \
  GROUPED(kMeshes, kGltfFormat, FileFormat::Gltf, ".gltf", "")                                                       \
  GROUPED(kMeshes, kPlyFormat, FileFormat::Ply, ".ply", "")                                                          \
  GROUPED(kMeshes, kStlFormat, FileFormat::Stl, ".stl", "")                                                          \
  GROUPED(kMeshes, kThreeMfFormat, FileFormat::ThreeMf, ".3mf", "")                                                  \
  GROUPED(kMeshes, kOffFormat, FileFormat::Off, ".off", "")                                                          \
  GROUPED(kMeshes, kObjFormat, FileFormat::Obj, ".obj", "")                                                          \
  GROUPED(kGameWorlds, kLuantiMapFormat, FileFormat::LuantiMap, ".sqlite", "")

// Drivers of groups that are switched off are declared, but neither defined nor used.
#define QUOIN_DECLARE(driver) extern const FormatDriver driver;
#define QUOIN_DECLARE_GROUPED(group, driver, id, first, others) extern const FormatDriver driver;
QUOIN_FORMATS(QUOIN_DECLARE, QUOIN_DECLARE_GROUPED)
#undef QUOIN_DECLARE
#undef QUOIN_DECLARE_GROUPED

namespace {

/// All drivers, and their properties in the same order. Spans of them stay valid when drivers are added.
class FormatTable {
 public:
  FormatTable() {
    drivers_.reserve(kMost);
    infos_.reserve(kMost);
// NOLINTBEGIN(bugprone-macro-parentheses,readability-container-size-empty): the arguments are names and literals
#define QUOIN_ADD(driver) add(driver);
#define QUOIN_ADD_GROUPED(group, driver, id, first, others)                                                   \
  if constexpr (group.is_built) {                                                                             \
    QUOIN_ASSERT(driver.info.extension == first && driver.info.also == others, "the row repeats the driver"); \
    add(driver);                                                                                              \
  } else {                                                                                                    \
    add_left_out({id, first, "left out of this build", {}, others}, group.option);                            \
  }
    QUOIN_FORMATS(QUOIN_ADD, QUOIN_ADD_GROUPED)
    // NOLINTEND(bugprone-macro-parentheses,readability-container-size-empty)
#undef QUOIN_ADD
#undef QUOIN_ADD_GROUPED
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

  /// Adds a format of a group that is switched off: it can neither be read nor written.
  void add_left_out(const FormatInfo& info, std::string_view option) {
    // Its content is never read.
    left_out_.push_back({.info = info, .left_out = option, .source = FormatDriver::Source::Path});
    add(left_out_.back());
  }

  static constexpr std::size_t kMost = 64;
  [[nodiscard]] bool is_full() const { return drivers_.size() == kMost; }
  [[nodiscard]] std::span<const FormatDriver* const> drivers() const { return drivers_; }
  [[nodiscard]] std::span<const FormatInfo> infos() const { return infos_; }

 private:
  std::vector<const FormatDriver*> drivers_;
  std::vector<FormatInfo> infos_;
  std::deque<FormatDriver> left_out_;  // with stable addresses
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

Error left_out_error(const FormatDriver& driver) {
  QUOIN_ASSERT(!driver.left_out.empty(), "the format is left out");
  return {ErrorCode::Unsupported,
          "cannot read or write " + std::string(driver.info.extension) + ": Quoin was built with " +
              std::string(driver.left_out) + "=OFF",
          {},
          {}};
}

std::string left_out_options() {
  std::vector<std::string_view> options;
  for (const FormatDriver* const driver : format_drivers()) {
    if (!driver->left_out.empty() && std::ranges::find(options, driver->left_out) == options.end()) {
      options.push_back(driver->left_out);
    }
  }
  std::string text;
  for (const std::string_view option : options) text.append(text.empty() ? "" : ", ").append(option).append("=OFF");
  return text;
}

const FormatInfo& format_info(FileFormat format) {
  return driver_of(format).info;
}

bool can(std::optional<FileFormat> format, FormatCapability wanted) {
  return format && format_info(*format).can(wanted);
}

}  // namespace quoin

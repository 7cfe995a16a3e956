// Compares images of blocks with the own pack with those of npm's deepslate (MIT), an independent renderer of resource
// packs, in Chromium: outlines and texels.

#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <quoin/io/block_packs.h>
#include <quoin/io/file.h>
#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

#include "core/srgb.h"
#include "core/work/nightly_for_tests.h"
#include "io/gltf/glb_for_tests.h"
#include "io/minecraft/block_types.h"
#include "io/packs/families.h"
#include "io/packs/pack_looks.h"
#include "io/packs/pack_own.h"
#include "tests/minecraft_data_for_tests.h"

namespace quoin {
namespace {

namespace fs = std::filesystem;
using minecraft_data::Json;
using minecraft_data::Values;

constexpr int kIconSize = 96;
constexpr std::size_t kIconPixels = std::size_t{kIconSize} * kIconSize;
constexpr std::size_t kViews = 3;
constexpr double kViewHeight = 2.1;     // blocks; some models reach out of their block
constexpr double kNearEdge = 1.0 / 64;  // pixels
constexpr int kMaxDifference = 2;
constexpr std::size_t kStatesPerRun = 1'500;

/// A state of a block in the oracle's data.
struct State {
  std::string block;
  Values values;

  [[nodiscard]] std::string text() const {
    std::string all;
    for (const auto& [key, value] : values) all += (all.empty() ? "" : ",") + key + "=" + value;
    return block + "[" + all + "]";
  }
};

/// The pixels of an image: texels of the first visible surfaces, before tinting. Alpha 0: no surface.
struct Icon {
  std::vector<Rgba8> texels;
  std::vector<std::uint8_t> is_tinted;
};

struct OracleLook {
  Rgba8 tint;
  std::array<Icon, kViews> icons;
};

/// The oracle's looks, and the number of each state's look.
struct OracleAnswer {
  std::vector<OracleLook> looks;
  std::vector<std::uint32_t> look_of_state;
};

/// Cameras without symmetry, so that no edge of a block meets a row of pixel centres: from the south-east above, from
/// the north-west, from the west below.
std::array<Camera, kViews> icon_cameras() {
  constexpr std::array<std::array<double, 2>, kViews> kAngles = {{{36.0, 30.0}, {229.0, 17.0}, {283.0, -41.0}}};
  std::array<Camera, kViews> cameras;
  for (std::size_t i = 0; i < kViews; ++i) {
    const DVec3 forward = direction_of(kAngles[i][0], kAngles[i][1]);
    cameras[i] = look_along(DVec3(0.5) - forward * 4.0, forward, 1.0).value();
    cameras[i].projection = Camera::Projection::Orthographic;
    cameras[i].view_height = kViewHeight;
  }
  return cameras;
}

/// Returns the matrix to the image's cube from -1 to 1, column by column.
std::vector<double> clip_from_block(const Camera& camera) {
  const std::array<DVec3, 3> rows = {camera.right * (2.0 / kViewHeight), camera.up * (2.0 / kViewHeight),
                                     camera.forward * (1.0 / 8.0)};
  std::vector<double> columns;
  for (int column = 0; column < 3; ++column) {
    for (const DVec3& row : rows) columns.push_back(row[column]);
    columns.push_back(0.0);
  }
  for (const DVec3& row : rows) columns.push_back(-glm::dot(row, DVec3(0.5)));
  columns.push_back(1.0);
  return columns;
}

/// Returns true if deepslate and minecraft-data are installed.
bool has_oracle() {
  return fs::exists(minecraft_data::data_folder()) && fs::exists(minecraft_data::oracle_modules() / "deepslate");
}

/// Draws states with deepslate. Errors: Unsupported, with the reason, if a program is not installed; CannotRead.
Result<OracleAnswer> drawn_by_oracle(std::span<const State> states) {
  const TestFolder folder("pack_images");
  std::set<std::string> names;
  Json request = {{"modules", minecraft_data::oracle_modules().string()},
                  {"pack", folder.file("pack.zip").string()},
                  {"out", folder.file("icons").string()},
                  {"size", kIconSize}};
  for (const Camera& camera : icon_cameras()) request["cameras"].push_back(clip_from_block(camera));
  for (const State& state : states) {
    names.insert(state.block);
    request["states"].push_back({"minecraft:" + state.block, state.values});
  }
  const auto zip = write_builtin_pack(std::vector<std::string>(names.begin(), names.end()));
  if (!zip) return zip.error();
  if (Status done = write_file(*zip, folder.file("pack.zip")); !done) return done.error();
  std::ofstream(folder.file("request.json")) << request.dump();
  const std::string command = "node '" QUOIN_SOURCE_DIR "/tests/web/block_icons.mjs' '" +
                              folder.file("request.json").string() + "' > '" + folder.file("log").string() + "' 2>&1";
  const int status = std::system(command.c_str());
  std::ifstream log(folder.file("log"));
  const std::string said{std::istreambuf_iterator<char>(log), {}};
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  if (code == 77 || code == 127) return make_error(ErrorCode::Unsupported, said);
  if (code != 0 || !said.empty()) return make_error(ErrorCode::CannotRead, "block_icons.mjs: " + said);
  const auto bytes = read_file(folder.file("icons"));
  if (!bytes) return bytes.error();
  OracleAnswer answer;
  std::uint32_t count = 0;
  std::memcpy(&count, bytes->data(), 4);
  answer.look_of_state.resize(states.size());
  std::memcpy(answer.look_of_state.data(), bytes->data() + 4, 4 * states.size());
  answer.looks.resize(count);
  const std::byte* at = bytes->data() + 4 + 4 * states.size();
  if (bytes->size() != 4 + 4 * states.size() + count * (4 + kViews * kIconPixels * 5)) {
    return make_error(ErrorCode::BadFormat, "block_icons.mjs wrote a file of another size");
  }
  for (OracleLook& look : answer.looks) {
    const auto* const tint = reinterpret_cast<const std::uint8_t*>(at);
    look.tint = {tint[0], tint[1], tint[2]};
    at += 4;
    for (Icon& icon : look.icons) {
      icon.texels.resize(kIconPixels);
      std::memcpy(icon.texels.data(), at, kIconPixels * 4);
      icon.is_tinted.resize(kIconPixels);
      std::memcpy(icon.is_tinted.data(), at + kIconPixels * 4, kIconPixels);
      at += kIconPixels * 5;
    }
  }
  return answer;
}

/// The own pack without translucent texels, so that images show single texels: with their colours, or with their alpha
/// in place of them.
class SolidTexels final : public packs::PackFiles {
 public:
  explicit SolidTexels(bool shows_alpha) : shows_alpha_(shows_alpha) {}

  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> read(std::string_view path,
                                                                   std::size_t max_bytes) const override {
    auto bytes = packs::OwnPack::instance()->read(path, max_bytes);
    if (!bytes || !*bytes || !path.ends_with(".png")) return bytes;
    auto image = read_alpha_image(**bytes);
    if (!image) return image.error();
    for (std::size_t i = 0; i < image->rgba.size(); i += 4) {
      std::uint8_t& alpha = image->rgba[i + 3];
      if (shows_alpha_) std::fill_n(image->rgba.begin() + static_cast<std::ptrdiff_t>(i), 3, alpha);
      alpha = alpha <= kOracleClear ? 0 : 255;
    }
    auto png = write_png(*image);
    if (!png) return png.error();
    return std::optional(std::move(*png));
  }
  [[nodiscard]] std::string identity() const override { return shows_alpha_ ? "alpha" : "solid"; }

 private:
  static constexpr std::uint8_t kOracleClear = 2;  // of 255: deepslate discards less than 0.01
  bool shows_alpha_;
};

/// Deepslate's tints of biomes.
constexpr minecraft::BiomeTints kOracleTints{.grass = 0x7CBD6B, .foliage = 0x48B518, .water = 0x3F76E4};

/// The type, model and orientation of a state.
using ModelKey = std::tuple<const VoxelProperties*, const ShapeModel*, int>;

/// Draws states as the tool does.
class Painter {
 public:
  explicit Painter(bool shows_alpha)
      : looks_(std::make_shared<packs::MemoryPack>(), std::make_shared<SolidTexels>(shows_alpha)) {}

  /// Returns the scene of a state: one voxel at the origin. No voxel for invisible blocks.
  Scene scene(const State& state) {
    const Voxel voxel = this->voxel(state);
    Scene scene;
    SceneGrid one;
    if (voxel.type != nullptr) one.grid.set({0, 0, 0}, scene.types.add(*voxel.type).value(), {voxel.state, {}});
    scene.add_instance(Instance{.grid = scene.add_grid(std::move(one))});
    return scene;
  }

  /// Returns a key that states share if they are drawn from the same model.
  ModelKey model(const State& state) {
    const Voxel voxel = this->voxel(state);
    if (voxel.type == nullptr) return {};
    const AxisOrientation turn = voxel.type->orientations.of(voxel.state);
    if (voxel.type->shapes.empty()) return {voxel.type, nullptr, turn.index()};
    return {voxel.type, &voxel.type->shapes.model(voxel.state, turn, {}), turn.index()};
  }

 private:
  struct Voxel {
    const VoxelProperties* type = nullptr;  ///< null: invisible
    std::uint32_t state = 0;
  };

  Voxel voxel(const State& state) {
    const auto block = types_.block("minecraft:" + state.block, {state.values.begin(), state.values.end()});
    EXPECT_TRUE(block) << state.text();
    VoxelType type = block->type;
    if (block->tint != minecraft::Tint::None) type = types_.tinted(*block, kOracleTints).value();
    if (type == kAir) return {};
    if (!made_.contains(type)) made_[type] = looks_.applied(types_.types()[type]);
    return {&made_[type], block->state};
  }

  minecraft::BlockTypes types_;
  packs::BlockLooks looks_;
  std::map<VoxelType, VoxelProperties> made_;
};

/// Draws one view. `right`, `down`: shifts the sampled points, in pixels.
RenderedImage drawn(const CpuRenderer& renderer, Camera camera, Shading shading = Shading::Unlit, double right = 0.0,
                    double down = 0.0) {
  constexpr double kPixel = kViewHeight / kIconSize;
  camera.position += camera.right * (right * kPixel) - camera.up * (down * kPixel);
  RenderOptions options{.width = kIconSize, .height = kIconSize, .depth = true};
  options.light.shading = shading;
  return renderer.render(camera, options, Threads{1}).value();
}

/// The pixels that no point near their centre explains.
struct Difference {
  int outline = 0;  ///< only one of both shows a surface
  int colour = 0;
};

/// Returns the expected colour of a pixel. Quoin multiplies tints in linear light, as glTF does.
Rgba8 expected_colour(const Icon& icon, Rgba8 tint, std::size_t pixel, bool of_alpha) {
  Rgba8 texel = icon.texels[pixel];
  if (of_alpha) texel = {texel.a, texel.a, texel.a};
  if (icon.is_tinted[pixel] != 0) texel = srgb_colour(linear_colour(texel) * linear_colour(tint));
  return texel;
}

enum class Match : std::uint8_t { Equal, OtherColour, OtherOutline };

Match match_pixel(const RenderedImage& image, const Icon& icon, Rgba8 expected, std::size_t pixel) {
  const bool is_hit = std::isfinite(image.depth.values[pixel]);
  if (is_hit != (icon.texels[pixel].a > 2)) return Match::OtherOutline;
  if (!is_hit) return Match::Equal;
  const std::array<int, 3> wanted = {expected.r, expected.g, expected.b};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    if (std::abs(image.colour.rgb[3 * pixel + channel] - wanted[channel]) > kMaxDifference) return Match::OtherColour;
  }
  return Match::Equal;
}

using Differences = std::vector<std::pair<std::size_t, Match>>;

/// Removes pixels that equal a point near their centre.
void erase_near_edges(const CpuRenderer& renderer, const Camera& camera, const OracleLook& look, const Icon& icon,
                      bool of_alpha, Differences& different) {
  constexpr int kSteps = 2;  // from the centre to the furthest point
  std::vector<std::pair<int, int>> steps;
  for (int right = -kSteps; right <= kSteps; ++right) {
    for (int down = -kSteps; down <= kSteps; ++down) steps.emplace_back(right, down);
  }
  // Corners first: they explain most pixels.
  std::ranges::stable_sort(steps, std::ranges::greater(),
                           [](const auto& step) { return std::abs(step.first) + std::abs(step.second); });
  for (const auto& [right, down] : steps) {
    if (different.empty()) return;
    const RenderedImage moved =
        drawn(renderer, camera, Shading::Unlit, right * kNearEdge / kSteps, down * kNearEdge / kSteps);
    std::erase_if(different, [&](const auto& each) {
      const Rgba8 expected = expected_colour(icon, look.tint, each.first, of_alpha);
      return match_pixel(moved, icon, expected, each.first) == Match::Equal;
    });
  }
}

/// Removes pixels whose points near the centre show surfaces of different directions: where they meet, each of both may
/// show the texels of the other that lie just inside it.
void erase_at_joints(const CpuRenderer& renderer, const Camera& camera, Differences& different) {
  if (different.empty()) return;
  std::vector<RenderedImage> images;
  for (const double right : {-kNearEdge, kNearEdge}) {
    for (const double down : {-kNearEdge, kNearEdge}) {
      images.push_back(drawn(renderer, camera, Shading::Normals, right, down));
    }
  }
  std::erase_if(different, [&](const auto& each) {
    if (each.second == Match::OtherOutline) return false;
    return std::ranges::any_of(images, [&](const RenderedImage& image) {
      const auto at = static_cast<std::ptrdiff_t>(3 * each.first);
      return !std::equal(image.colour.rgb.begin() + at, image.colour.rgb.begin() + at + 3,
                         images.front().colour.rgb.begin() + at);
    });
  });
}

/// Compares one view.
Difference compared(const CpuRenderer& renderer, const Camera& camera, const OracleLook& look, const Icon& icon,
                    bool of_alpha) {
  const RenderedImage image = drawn(renderer, camera);
  Differences different;
  for (std::size_t pixel = 0; pixel < kIconPixels; ++pixel) {
    const Match match = match_pixel(image, icon, expected_colour(icon, look.tint, pixel, of_alpha), pixel);
    if (match != Match::Equal) different.emplace_back(pixel, match);
  }
  erase_near_edges(renderer, camera, look, icon, of_alpha, different);
  erase_at_joints(renderer, camera, different);
  Difference sum;
  for (const auto& [pixel, match] : different) ++(match == Match::OtherOutline ? sum.outline : sum.colour);
  return sum;
}

/// Images of states that differ: for each view ours, the oracle's, and the pixels that differ.
class Sheet {
 public:
  void add(const std::string& block, const CpuRenderer& renderer, const OracleLook& look, bool of_alpha) {
    if (rows_ == kMaxRows || !blocks_.insert(block).second) return;
    ++rows_;
    rgb_.resize(rgb_.size() + kRowBytes, 255);
    static const std::array<Camera, kViews> cameras = icon_cameras();
    for (std::size_t view = 0; view < kViews; ++view) {
      const RenderedImage image = drawn(renderer, cameras[view]);
      const Icon& icon = look.icons[view];
      for (std::size_t pixel = 0; pixel < kIconPixels; ++pixel) {
        const Rgba8 expected = expected_colour(icon, look.tint, pixel, of_alpha);
        const auto* const ours = &image.colour.rgb[3 * pixel];
        if (std::isfinite(image.depth.values[pixel])) put(3 * view, pixel, {ours[0], ours[1], ours[2]});
        if (icon.texels[pixel].a > 2) put(3 * view + 1, pixel, expected);
        const Match match = match_pixel(image, icon, expected, pixel);
        if (match != Match::Equal) put(3 * view + 2, pixel, match == Match::OtherColour ? Rgba8{255, 0, 255} : Rgba8{});
      }
    }
  }

  void write(const fs::path& path) const {
    const Image image{static_cast<int>(kColumns) * kIconSize, static_cast<int>(rows_) * kIconSize, rgb_};
    EXPECT_TRUE(rows_ == 0 || write_png(image, path));
  }

 private:
  void put(std::size_t column, std::size_t pixel, Rgba8 colour) {
    const std::size_t x = column * kIconSize + pixel % kIconSize;
    const std::size_t at = (rows_ - 1) * kRowBytes + 3 * (pixel / kIconSize * kColumns * kIconSize + x);
    rgb_[at] = colour.r;
    rgb_[at + 1] = colour.g;
    rgb_[at + 2] = colour.b;
  }

  static constexpr std::size_t kMaxRows = 14;
  static constexpr std::size_t kColumns = 3 * kViews;
  static constexpr std::size_t kRowBytes = 3 * kColumns * kIconPixels;
  std::size_t rows_ = 0;
  std::set<std::string> blocks_;
  std::vector<std::uint8_t> rgb_;
};

bool has_translucent_texels(const OracleLook& look) {
  return std::ranges::any_of(look.icons, [](const Icon& icon) {
    return std::ranges::any_of(icon.texels, [](const Rgba8& texel) { return texel.a > 2 && texel.a < 255; });
  });
}

/// A difference that is known, and the states that show it.
struct Exception {
  std::string reason;
  std::vector<std::string> blocks;  ///< names or patterns
  std::string property;             ///< empty: all states
  std::vector<std::string> values;
  int max_pixels = std::numeric_limits<int>::max();
  bool is_outline_equal = false;
  std::size_t state_count = 0;

  [[nodiscard]] bool covers(const State& state, const Difference& difference) const {
    const bool is_named = std::ranges::any_of(
        blocks, [&](const std::string& each) { return packs::match_name(each, state.block).has_value(); });
    if (!is_named || difference.outline + difference.colour > max_pixels) return false;
    // Single pixels at joints have an exception of their own.
    constexpr int kJoints = 3;
    if (is_outline_equal && difference.outline > kJoints) return false;
    const auto found = state.values.find(property);
    return property.empty() ||
           (found != state.values.end() && std::ranges::find(values, found->second) != values.end());
  }
};

std::vector<Exception> known_exceptions() {
  std::vector<Exception> all;
  const Json file = minecraft_data::parsed(fs::path(QUOIN_SOURCE_DIR) / "tests/web/block_icons.json");
  for (const Json& json : file["exceptions"]) {
    Exception& made = all.emplace_back();
    made.reason = json["reason"].get<std::string>();
    made.blocks = packs::words(json["blocks"].get<std::string>());
    made.is_outline_equal = json.value("differs", "") == "colour";
    made.max_pixels = json.value("pixels", made.max_pixels);
    const std::string states = json.value("states", "");
    if (states.empty()) continue;
    made.property = states.substr(0, states.find('='));
    made.values = packs::words(states.substr(states.find('=') + 1), '|');
  }
  return all;
}

/// Compares states with their looks in the oracle.
class Comparison {
 public:
  /// Compares a state with a look. States of one type with one model are drawn once.
  Difference add(const State& state, const OracleLook& look) {
    auto [at, is_new] = known_.try_emplace({&look, colours_.model(state)});
    if (is_new) at->second = difference(state, look);
    ++state_count_;
    if (at->second.outline + at->second.colour > 0) {
      note(state, at->second);
      if (is_new) {
        const Scene scene = colours_.scene(state);
        sheet_.add(state.block, CpuRenderer(scene, InstanceFilter::Visible, Threads{1}), look, false);
      }
    }
    return at->second;
  }

  /// Forgets results whose looks will be gone.
  void forget_looks() {
    drawn_count_ += known_.size();
    known_.clear();
  }

  /// Prints the counts, and writes images of different states. Expects that exceptions explain all differences, and if
  /// `is_complete` that there are no others.
  void report(bool is_complete) {
    forget_looks();
    std::cout << state_count_ << " states, drawn " << drawn_count_ << " times: " << different_count_ << " differ\n";
    for (const Exception& each : exceptions_) {
      std::cout << "  " << each.state_count << " states: " << each.reason << "\n";
      EXPECT_TRUE(each.state_count > 0 || !is_complete) << each.reason;
    }
    const fs::path path = fs::path(QUOIN_SOURCE_DIR) / "build/oracle/different.png";
    sheet_.write(path);
    std::string list;
    constexpr std::size_t kMaxListed = 40;
    for (std::size_t i = 0; i < std::min(unexplained_.size(), kMaxListed); ++i) list += "  " + unexplained_[i] + "\n";
    EXPECT_EQ(unexplained_.size(), 0U) << "see " << path.string() << "\n" << list;
  }

 private:
  Difference difference(const State& state, const OracleLook& look) {
    static const std::array<Camera, kViews> cameras = icon_cameras();
    Difference sum;
    const auto add_views = [&](Painter& painter, bool of_alpha) {
      const Scene scene = painter.scene(state);
      const CpuRenderer renderer(scene, InstanceFilter::Visible, Threads{1});
      for (std::size_t i = 0; i < kViews; ++i) {
        const Difference one = compared(renderer, cameras[i], look, look.icons[i], of_alpha);
        sum.outline += one.outline;
        sum.colour += one.colour;
      }
    };
    add_views(colours_, false);
    if (has_translucent_texels(look)) add_views(alphas_, true);
    return sum;
  }

  void note(const State& state, const Difference& difference) {
    ++different_count_;
    const auto known =
        std::ranges::find_if(exceptions_, [&](const Exception& each) { return each.covers(state, difference); });
    if (known != exceptions_.end()) {
      ++known->state_count;
      return;
    }
    unexplained_.push_back(state.text() + ": " + std::to_string(difference.outline) + " pixels of outlines, " +
                           std::to_string(difference.colour) + " colours");
  }

  Painter colours_{false};
  Painter alphas_{true};
  std::vector<Exception> exceptions_ = known_exceptions();
  std::map<std::pair<const OracleLook*, ModelKey>, Difference> known_;
  std::size_t state_count_ = 0;
  std::size_t drawn_count_ = 0;
  std::size_t different_count_ = 0;
  std::vector<std::string> unexplained_;
  Sheet sheet_;
};

/// Returns all states, or those of the blocks that QUOIN_ORACLE_BLOCKS names, in random order.
std::vector<State> shuffled_states() {
  const char* const only = std::getenv("QUOIN_ORACLE_BLOCKS");
  const std::vector<std::string> patterns = packs::words(only == nullptr ? "*" : only);
  std::vector<State> states;
  for (const Json& block : minecraft_data::parsed(minecraft_data::data_folder() / "blocks.json")) {
    const auto name = block["name"].get<std::string>();
    const auto matches = [&](const std::string& each) { return packs::match_name(each, name).has_value(); };
    if (std::ranges::none_of(patterns, matches)) continue;
    for (int i = 0; i < minecraft_data::state_count(block); ++i) {
      states.push_back({name, minecraft_data::values_of(block, i)});
    }
  }
  constexpr unsigned kSeed = 57;
  std::mt19937 random(kSeed);
  std::ranges::shuffle(states, random);
  return states;
}

TEST(OwnPackOracle, ImagesEqualThoseOfDeepslate) {
  if (!has_oracle()) GTEST_SKIP() << minecraft_data::kInstall;
  std::vector<State> states = shuffled_states();
  const bool is_complete = is_nightly() && std::getenv("QUOIN_ORACLE_BLOCKS") == nullptr;
  constexpr int kByDay = 500;
  states.resize(std::min(states.size(), static_cast<std::size_t>(cases(kByDay, static_cast<int>(states.size())))));
  Comparison comparison;
  for (std::size_t first = 0; first < states.size(); first += kStatesPerRun) {
    const std::span some = std::span(states).subspan(first, std::min(states.size() - first, kStatesPerRun));
    const auto answer = drawn_by_oracle(some);
    if (!answer && answer.error().code == ErrorCode::Unsupported) GTEST_SKIP() << answer.error().message;
    ASSERT_TRUE(answer) << answer.error().message;
    for (std::size_t i = 0; i < some.size(); ++i) {
      comparison.add(some[i], answer->looks[answer->look_of_state[i]]);
    }
    comparison.forget_looks();
  }
  comparison.report(is_complete);
}

/// Checks the test above: it must notice looks of other states.
TEST(OwnPackOracle, ImagesNoticeOtherStates) {
  if (!has_oracle()) GTEST_SKIP() << minecraft_data::kInstall;
  const auto stairs = [](const char* facing, const char* half) {
    return State{"oak_stairs", {{"facing", facing}, {"half", half}, {"shape", "straight"}, {"waterlogged", "false"}}};
  };
  const std::vector<State> states = {stairs("east", "bottom"),
                                     stairs("east", "top"),
                                     stairs("north", "bottom"),
                                     {"oak_log", {{"axis", "x"}}},
                                     {"oak_log", {{"axis", "z"}}},
                                     {"oak_leaves", {}},
                                     {"birch_leaves", {}},
                                     {"white_stained_glass", {}},
                                     {"light_gray_stained_glass", {}},
                                     {"magenta_glazed_terracotta", {{"facing", "south"}}},
                                     {"magenta_glazed_terracotta", {{"facing", "north"}}},
                                     {"snow", {{"layers", "3"}}},
                                     {"snow", {{"layers", "4"}}}};
  const auto answer = drawn_by_oracle(states);
  if (!answer && answer.error().code == ErrorCode::Unsupported) GTEST_SKIP() << answer.error().message;
  ASSERT_TRUE(answer) << answer.error().message;
  Comparison comparison;
  constexpr int kClear = 300;  // pixels of three views
  for (std::size_t i = 0; i < states.size(); ++i) {
    for (const std::size_t k : {i, (i + 1) % states.size()}) {
      const Difference difference = comparison.add(states[i], answer->looks[answer->look_of_state[k]]);
      const int pixels = difference.outline + difference.colour;
      EXPECT_TRUE(i == k ? pixels <= 3 : pixels > kClear)
          << states[i].text() << " " << states[k].text() << " " << pixels;
    }
  }
}

}  // namespace
}  // namespace quoin

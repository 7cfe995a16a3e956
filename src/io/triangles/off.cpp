// The Object File Format of Geomview. Source: "Geomview manual", OFF files: http://www.geomview.org/docs/html/OFF.html

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec4.hpp>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "core/srgb.h"
#include "io/format_driver.h"
#include "io/triangles/triangles.h"

namespace quoin::triangles {

namespace {

/// The numbers of a vertex in addition to its coordinates, as declared in the first word of the file.
struct Layout {
  bool has_texture = false;
  bool has_colour = false;
  bool has_normal = false;
  bool has_fourth = false;
  bool has_dimension = false;
};

bool take_prefix(std::string_view& word, std::string_view prefix) {
  if (!word.starts_with(prefix)) return false;
  word.remove_prefix(prefix.size());
  return true;
}

/// Parses the first word: [ST][C][N][4][n]OFF.
std::optional<Layout> layout_of(std::string_view word) {
  Layout layout;
  layout.has_texture = take_prefix(word, "ST");
  layout.has_colour = take_prefix(word, "C");
  layout.has_normal = take_prefix(word, "N");
  layout.has_fourth = take_prefix(word, "4");
  layout.has_dimension = take_prefix(word, "n");
  return word == "OFF" ? std::optional(layout) : std::nullopt;
}

/// The lines of a text that have words, without comments.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}

  /// Moves on to the next line. Returns false at the end.
  bool next() {
    while (at_ < text_.size()) {
      begin_ = at_;
      const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
      at_ = std::min(end + 1, text_.size());
      line_ = text_.substr(begin_, end - begin_);
      line_ = line_.substr(0, line_.find('#'));
      if (line_.find_first_not_of(" \t") != std::string_view::npos) return true;
    }
    begin_ = text_.size();
    line_ = {};
    return false;
  }
  [[nodiscard]] std::string_view line() const { return line_; }
  /// Returns the offset of the line.
  [[nodiscard]] std::size_t position() const { return begin_; }
  [[nodiscard]] std::size_t remaining() const { return text_.size() - at_; }
  /// Drops bytes at the beginning of the line.
  void drop(std::size_t bytes) {
    QUOIN_ASSERT(bytes <= line_.size(), "bytes of the line");
    line_.remove_prefix(bytes);
  }

 private:
  std::string_view text_;
  std::string_view line_;
  std::size_t begin_ = 0;
  std::size_t at_ = 0;
};

std::vector<double> numbers_in(std::string_view line) {
  std::vector<double> numbers;
  Words words(line);
  while (const auto number = words.next_number()) numbers.push_back(*number);
  return numbers;
}

/// Reads three or four channels: 0 to 1 if the text has a decimal point, else 0 to 255.
glm::vec4 colour_of(std::span<const double> channels, std::string_view text) {
  QUOIN_ASSERT(channels.size() >= 3, "three or four channels");
  const bool is_fraction = text.find('.') != std::string_view::npos;
  const double most = is_fraction ? 1.0 : 255.0;
  const auto share = [&](std::size_t i) { return static_cast<float>(std::clamp(channels[i] / most, 0.0, 1.0)); };
  return {linear_from_srgb(share(0)), linear_from_srgb(share(1)), linear_from_srgb(share(2)),
          channels.size() > 3 ? share(3) : 1.0F};
}

class OffReader {
 public:
  explicit OffReader(std::span<const std::byte> bytes) : lines_(text_of(bytes)) {}

  Result<LoadedMesh> read() {
    Status done = read_head();
    if (done) done = read_vertices();
    if (done) done = read_faces();
    if (!done) return done.error();
    builder_.finish();
    finish_colours();
    return std::move(loaded_);
  }

 private:
  [[nodiscard]] Error bad(std::string what) const { return bad_at(lines_.position(), std::move(what)); }

  Status read_head() {
    if (!lines_.next()) return bad("the file is empty");
    Words words(lines_.line());
    const auto layout = layout_of(words.next().value_or(""));
    if (!layout) return bad("not an OFF file: it does not begin with OFF, COFF, NOFF or similar");
    layout_ = *layout;
    if (layout->has_fourth || layout->has_dimension) {
      return make_error(ErrorCode::Unsupported, "only 3-dimensional OFF files are supported", {}, 0);
    }
    lines_.drop(words.position());
    if (Words(lines_.line()).next() == "BINARY") {
      return make_error(ErrorCode::Unsupported, "a binary OFF file; save it as text", {}, 0);
    }
    if (!Words(lines_.line()).next() && !lines_.next()) return bad("the file ends before its counts");
    const std::vector<double> counts = numbers_in(lines_.line());
    const auto is_count = [](double c) { return c >= 0.0 && c <= 1e15 && c == std::floor(c); };
    if (counts.size() < 2 || !is_count(counts[0]) || !is_count(counts[1]))
      return bad("the numbers of vertices and faces are missing or invalid");
    vertices_ = static_cast<std::uint64_t>(counts[0]);
    faces_ = static_cast<std::uint64_t>(counts[1]);
    // The minimum: "0 0 0" and "3 0 1 2" with their line ends.
    constexpr std::uint64_t kLeastVertex = 6;
    if (vertices_ > (lines_.remaining() + 1) / kLeastVertex || faces_ > (lines_.remaining() + 1) / 2) {
      return bad("the file claims " + std::to_string(vertices_) + " vertices and " + std::to_string(faces_) +
                 " faces in " + std::to_string(lines_.remaining()) + " bytes");
    }
    return {};
  }

  Status read_vertices() {
    for (std::uint64_t i = 0; i < vertices_; ++i) {
      if (!lines_.next()) return bad("the file ends within its " + std::to_string(vertices_) + " vertices");
      const std::vector<double> numbers = numbers_in(lines_.line());
      const std::size_t first = layout_.has_normal ? 6 : 3;
      const std::size_t last = numbers.size() - std::min<std::size_t>(numbers.size(), layout_.has_texture ? 2 : 0);
      if (numbers.size() < 3 || last < first) return bad("a vertex has " + std::to_string(numbers.size()) + " numbers");
      loaded_.mesh.positions.emplace_back(numbers[0], numbers[1], numbers[2]);
      if (!layout_.has_colour) {
        has_more_ |= last > first;
        continue;
      }
      const std::size_t channels = std::min<std::size_t>(last - first, 4);
      if (channels < 3) return bad("a vertex has no colour");
      loaded_.mesh.colours.push_back(
          colour_of(std::span(numbers).subspan(first, channels), colour_text(first, channels)));
    }
    return {};
  }
  /// Returns the text of some words of the line.
  [[nodiscard]] std::string_view colour_text(std::size_t first, std::size_t count) const {
    Words words(lines_.line());
    for (std::size_t i = 0; i < first; ++i) (void)words.next();
    const std::size_t begin = words.position();
    for (std::size_t i = 0; i < count; ++i) (void)words.next();
    return lines_.line().substr(begin, words.position() - begin);
  }

  Status read_faces() {
    std::vector<std::size_t> corners;
    for (std::uint64_t i = 0; i < faces_; ++i) {
      if (!lines_.next()) return bad("the file ends within its " + std::to_string(faces_) + " faces");
      const std::vector<double> numbers = numbers_in(lines_.line());
      const double count = numbers.empty() ? -1.0 : numbers[0];
      if (!(count >= 0.0) || count > static_cast<double>(numbers.size() - 1))
        return bad("a face has fewer corners than it claims");
      const auto end = static_cast<std::size_t>(count) + 1;
      corners.clear();
      for (std::size_t k = 1; k < end; ++k) {
        const bool is_index = numbers[k] >= 0.0 && numbers[k] < static_cast<double>(vertices_);
        corners.push_back(is_index ? static_cast<std::size_t>(numbers[k]) : kNowhere);
      }
      const std::uint32_t material = material_of(std::span(numbers).subspan(end), end);
      const auto added = [&](const std::array<std::uint32_t, 3>&) { loaded_.mesh.material_of.push_back(material); };
      if (Status done = builder_.add_polygon(corners, added); !done) return done;
    }
    return {};
  }
  /// Returns the number of a face's colour; 0 without one.
  std::uint32_t material_of(std::span<const double> channels, std::size_t first) {
    if (channels.size() == 1 || channels.size() == 2) has_map_ = true;
    if (channels.size() < 3) return 0;
    const std::size_t count = std::min<std::size_t>(channels.size(), 4);
    const glm::vec4 colour = colour_of(channels.first(count), colour_text(first, count));
    const auto [known, is_new] = materials_.try_emplace(std::array{colour.r, colour.g, colour.b, colour.a},
                                                        static_cast<std::uint32_t>(materials_.size() + 1));
    return known->second;
  }

  void finish_colours() {
    TriangleMesh& mesh = loaded_.mesh;
    MeshMaterial plain;
    constexpr float kGrey = 0.577580F;
    if (mesh.colours.empty()) plain.colour = {kGrey, kGrey, kGrey, 1.0F};
    const bool is_clear = std::ranges::any_of(mesh.colours, [](const glm::vec4& c) { return c.a < 1.0F; });
    if (is_clear) plain.alpha_mode = AlphaMode::Blend;
    mesh.materials.assign(materials_.size() + 1, plain);
    for (const auto& [colour, number] : materials_) {
      MeshMaterial& material = mesh.materials[number];
      material.colour = {colour[0], colour[1], colour[2], colour[3]};
      if (colour[3] < 1.0F) material.alpha_mode = AlphaMode::Blend;
    }
    if (has_map_) loaded_.warnings.emplace_back("left out: face colours that index a colour map");
    if (has_more_)
      loaded_.warnings.emplace_back("left out: extra numbers after coordinates, not declared in the first line");
  }

  static constexpr std::size_t kNowhere = std::string_view::npos;
  Lines lines_;
  Layout layout_;
  LoadedMesh loaded_;
  MeshBuilder builder_{loaded_};
  std::map<std::array<float, 4>, std::uint32_t> materials_;
  std::uint64_t vertices_ = 0;
  std::uint64_t faces_ = 0;
  bool has_map_ = false;
  bool has_more_ = false;
};

bool is_off(std::span<const std::byte> beginning) {
  constexpr std::size_t kBeginning = 1 << 12;
  Lines lines(text_of(beginning.first(std::min(beginning.size(), kBeginning))));
  if (!lines.next()) return false;
  Words words(lines.line());
  return layout_of(words.next().value_or("")).has_value();
}

Result<LoadedMesh> read_off(std::span<const std::byte> bytes, SidecarReader&) {
  return OffReader(bytes).read();
}

}  // namespace

}  // namespace quoin::triangles

namespace quoin {

extern constinit const FormatDriver kOffFormat = {
    .info = {FileFormat::Off, ".off", "Object File Format, as text", FormatCapability::Read | FormatCapability::Meshes},
    .detect = triangles::is_off,
    .read_mesh = triangles::read_off,
};

}  // namespace quoin

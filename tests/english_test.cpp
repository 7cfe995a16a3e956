// Counts phrases that make comments, documents and messages hard to read (nominal "what", "of which", "beside", ...).
// tests/english_limits.txt holds the number of such lines per file. A file must not exceed its limit; a file without a
// limit must have none. `./dev english --accept` lowers the limits.

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace quoin::english {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

const std::set<std::string> kAfterWhat = {
    "is",     "was",   "are",   "were",   "it",      "they",   "one",     "a",     "an",   "the",   "that", "has",
    "had",    "have",  "lies",  "stands", "changed", "became", "becomes", "comes", "goes", "does",  "did",  "can",
    "cannot", "must",  "may",   "of",     "no",      "this",   "there",   "in",    "work", "works", "make", "makes",
    "hold",   "holds", "other", "others", "file",    "files",  "edit",    "edits", "ray",  "rays"};
const std::set<std::string> kPronouns = {"whoever", "whatever", "whichever", "nobody"};
const std::set<std::string> kPrepositions = {"of",   "by",  "to",    "from",   "at",     "on",
                                             "with", "for", "about", "beyond", "behind", "beside"};
const std::set<std::string> kOldWords = {"beside",   "besides", "anew",  "likewise", "mend",
                                         "mended",   "mends",   "tells", "told",     "picture",
                                         "pictures", "twin",    "twins", "movie",    "movies"};
const std::set<std::string> kOpeners = {"what", "whether", "of", "how", "where", "that", "whoever", "which"};

Words words_of(std::string_view text) {
  Words words;
  std::string word;
  for (const char c : text) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else if (!word.empty()) {
      words.push_back(std::move(word));
      word.clear();
    }
  }
  if (!word.empty()) words.push_back(std::move(word));
  return words;
}

/// Returns the first hard phrase, or "".
std::string hard_phrase(const Words& words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    const std::string next = i + 1 < words.size() ? words[i + 1] : "";
    if (kPronouns.contains(word) || kOldWords.contains(word)) return word;
    if (word == "what" && kAfterWhat.contains(next)) return word + " " + next;
    if (kPrepositions.contains(word) && (next == "which" || next == "whom" || next == "what")) return word + " " + next;
    const bool is_pair =
        (word == "no" && next == "one") || (word == "but" && next == "for") || (word == "for" && next == "ever");
    if (is_pair) return word + " " + next;
    const bool is_comparison = word == "as" && (next == "those" || next == "that") && i + 2 < words.size();
    if (is_comparison && words[i + 2] == "of") return word + " " + next + " of";
  }
  return "";
}

/// Returns a share without "per" ("4 bits a voxel" instead of "4 bits per voxel"), or "".
std::string share_without_per(const std::string& text) {
  if (text.find(" a ") == std::string::npos) return "";
  static const std::regex share(
      "\\b(bits?|bytes?|words?|numbers?|values?|indices|vertices|triangles|quads|samples|rays|cycles|instructions) "
      "a (voxel|vertex|cell|quad|face|pixel|chunk|row|sample|slab|brick|corner|triangle|ray|node|frame)\\b");
  std::smatch found;
  return std::regex_search(text, found, share) ? found.str() : "";
}

enum class Kind { Code, Script, Python, Document };

/// Reads the prose of a file line by line: comments, long string literals, documents outside of code blocks and link
/// targets.
class Prose {
 public:
  explicit Prose(Kind kind) : kind_(kind) {}

  [[nodiscard]] std::string of_line(const std::string& line) {
    if (kind_ == Kind::Document) return of_document(line);
    if (kind_ == Kind::Python) return of_python(line);
    if (kind_ == Kind::Script) return line;
    return of_code(line, "//");
  }

 private:
  std::string of_document(const std::string& line) {
    if (line.starts_with("```")) {
      is_in_block_ = !is_in_block_;
      return "";
    }
    static const std::regex link_target(R"(\]\([^)]*\))");
    return is_in_block_ ? "" : std::regex_replace(line, link_target, "]");
  }
  std::string of_python(const std::string& line) {
    const bool was_in_block = is_in_block_;
    for (std::size_t at = line.find("\"\"\""); at != std::string::npos; at = line.find("\"\"\"", at + 3)) {
      is_in_block_ = !is_in_block_;
    }
    return was_in_block || is_in_block_ ? line : of_code(line, "#");
  }
  static std::string of_code(const std::string& line, std::string_view comment) {
    constexpr std::size_t kLongLiteral = 20;
    std::string text;
    bool is_in_literal = false;
    std::string literal;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (is_in_literal && line[i] == '\\') {
        ++i;
        literal += ' ';
      } else if (line[i] == '"') {
        if (is_in_literal && literal.size() >= kLongLiteral) text += literal + ". ";
        literal.clear();
        is_in_literal = !is_in_literal;
      } else if (is_in_literal) {
        literal += line[i];
      } else if (line[i] == '\'' && i + 2 < line.size() && line[i + 2] == '\'') {
        i += 2;  // a character, which may be a quotation mark
      } else if (line.compare(i, comment.size(), comment) == 0 || line.compare(i, 2, "/*") == 0) {
        return text + line.substr(i + comment.size());
      }
    }
    return text;
  }

  Kind kind_;
  bool is_in_block_ = false;
};

/// Returns the reason why a line is hard to read, or "".
std::string find_error(const std::string& line, Prose& prose) {
  const std::string text = prose.of_line(line);
  if (const std::string phrase = hard_phrase(words_of(text)); !phrase.empty()) return phrase;
  if (const std::string share = share_without_per(text); !share.empty()) return share;
  const std::size_t begin = line.find_first_not_of(' ');
  if (begin == std::string::npos) return "";
  if (line.compare(begin, 2, "//") == 0) {
    const Words words = words_of(std::string_view(line).substr(begin));
    if (!words.empty() && kOpeners.contains(words[0])) return "comment opens with " + words[0];
  }
  for (const char* opening : {"\"Of --", "\"Of a ", "\"Of the "}) {
    if (line.find(opening) != std::string::npos) return opening;
  }
  if (line.starts_with("TEST")) {
    static const std::regex kOldName(", (That|What|Whether|It|Its|The|A|An|Every|No|Of|Where)[A-Z]");
    if (std::smatch found; std::regex_search(line, found, kOldName)) return "test name opens with " + found[1].str();
  }
  return "";
}

const fs::path kRoot = QUOIN_SOURCE_DIR;

bool is_left_out(const fs::path& folder) {
  static const std::set<std::string> kNames = {"node_modules", "archive", "corpus", "golden", "build", "__pycache__"};
  const std::string name = folder.filename().string();
  return kNames.contains(name) || name.starts_with('.');
}

/// Returns the kind of a file by its name; nothing for files without prose.
std::optional<Kind> kind_of(const fs::path& path) {
  static const std::set<std::string> kCode = {".cpp",  ".h",    ".inl",  ".c",  ".comp", ".glsl",
                                              ".frag", ".vert", ".wgsl", ".js", ".mjs",  ".ts"};
  const std::string ending = path.extension().string();
  if (kCode.contains(ending)) return Kind::Code;
  if (ending == ".md") return Kind::Document;
  if (ending == ".py") return Kind::Python;
  if (path.filename() == "dev" || ending == ".sh") return Kind::Script;
  return std::nullopt;
}

struct Counted {
  std::map<std::string, int> lines;            // by file
  std::map<std::string, std::string> example;  // the first, by file
};

Counted count_all() {
  Counted out;
  const auto add = [&](const fs::path& path) {
    const auto kind = kind_of(path);
    if (!kind || path.filename() == "english_test.cpp") return;
    const std::string name = fs::relative(path, kRoot).generic_string();
    std::ifstream file(path);
    Prose prose(*kind);
    int number = 0;
    for (std::string line; std::getline(file, line);) {
      ++number;
      const std::string fault = find_error(line, prose);
      if (fault.empty()) continue;
      if (out.lines[name]++ == 0) out.example[name] = "line " + std::to_string(number) + " (" + fault + "): " + line;
    }
  };
  for (const char* file : {"README.md", "CONTRIBUTING.md", "CHANGELOG.md", "dev"}) add(kRoot / file);
  for (const char* folder : {"src", "include", "apps", "tests", "docs", "examples", "bench"}) {
    for (fs::recursive_directory_iterator at(kRoot / folder), end; at != end; ++at) {
      if (at->is_directory() && is_left_out(at->path())) at.disable_recursion_pending();
      if (at->is_regular_file()) add(at->path());
    }
  }
  return out;
}

const fs::path kLimits = kRoot / "tests/english_limits.txt";

std::map<std::string, int> read_limits() {
  std::map<std::string, int> limits;
  std::ifstream file(kLimits);
  std::string name;
  int count = 0;
  while (file >> count >> name) limits[name] = count;
  return limits;
}

TEST(English, KeepsHardPhrasesWithinLimits) {
  const Counted counted = count_all();
  const bool lowers = std::getenv("QUOIN_LOWER_ENGLISH_LIMITS") != nullptr;
  const std::map<std::string, int> limits = lowers && !fs::exists(kLimits) ? counted.lines : read_limits();
  std::map<std::string, int> lowered;
  int all = 0;
  for (const auto& [name, count] : counted.lines) {
    all += count;
    const auto limit = limits.find(name);
    const int most = limit == limits.end() ? 0 : limit->second;
    EXPECT_LE(count, most) << name << ", the first: " << counted.example.at(name);
    if (std::min(count, most) > 0) lowered[name] = std::min(count, most);
  }
  for (const auto& [name, most] : limits)
    EXPECT_TRUE(counted.lines.contains(name)) << "a limit that nothing needs: " << name;
  RecordProperty("hard_phrases", all);
  if (!lowers) return;
  std::ofstream file(kLimits);
  for (const auto& [name, count] : lowered) file << count << ' ' << name << '\n';
  std::printf("%d lines with hard phrases in %zu files\n", all, lowered.size());
}

// Names that a reader could not guess, and that were replaced by the field's terms.
TEST(English, UsesNoOldNames) {
  const std::regex old(
      R"re(\b(losses_of_\w*|fault_of_\w*|files_read_beside|only_in_source|FieldOfMesh|SmoothPlaces|ChunkPlace|)re"
      R"re(PicturePoint|texture_places|has_place|displacement_to_free_place|carried_point|apart_from|)re"
      R"re(is_beside|kApart|kNobody|Lender|EditNotices?|NoticeOfEdits|Wishes|Arrival|hurries|let_go|owes_all|)re"
      R"re(owed_removals|keep_what_is_asked_for|stand_at_unit_size|occlusion_apart|SlicePlace|MousePlace|)re"
      R"re(by_place_|what_is_wrong\w*|mend_\w+|mended_?|trespass|room_of|circle_in|[Tt]wins?|DataTwin)\b|)re"
      R"re([Pp]icture)re");
  int files = 0;
  std::map<std::string, std::string> places;  // by name, of the first
  for (const char* const top : {"src", "include", "apps", "examples", "bench", "tests"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(QUOIN_SOURCE_DIR) / top)) {
      const std::string kind = entry.path().extension().string();
      const bool is_source = kind == ".h" || kind == ".cpp" || kind == ".inl";
      if (!is_source || entry.path().filename() == "english_test.cpp") continue;
      std::ifstream in(entry.path());
      int number = 0;
      for (std::string line; std::getline(in, line);) {
        ++number;
        const auto is_part = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
        for (auto at = std::ranges::find_if(line, is_part); at != line.end();) {
          const auto end = std::find_if_not(at, line.end(), is_part);
          const auto [place, is_new] = places.try_emplace(std::string(at, end));
          if (is_new) place->second = entry.path().string() + ":" + std::to_string(number);
          at = std::find_if(end, line.end(), is_part);
        }
      }
      ++files;
    }
  }
  for (const auto& [name, place] : places) {
    const bool is_of_libwebp = name.starts_with("WebPPicture");
    EXPECT_TRUE(is_of_libwebp || !std::regex_search(name, old)) << place << ": " << name;
  }
  EXPECT_GT(files, 1000);
}

TEST(English, FindsHardPhrases) {
  const auto found = [](Kind kind, const std::string& line) {
    Prose prose(kind);
    return find_error(line, prose);
  };
  EXPECT_EQ(found(Kind::Code, "  /// Whether the grid is empty."), "comment opens with whether");
  EXPECT_EQ(found(Kind::Code, "  // Keeps what is there."), "what is");
  EXPECT_EQ(found(Kind::Code, "  int what = is_there();"), "");
  EXPECT_EQ(found(Kind::Code, "  add(\"the file of which nothing is known\");"), "of which");
  EXPECT_EQ(found(Kind::Code, "  add(\"beside\");  // Adds a file."), "");
  EXPECT_EQ(found(Kind::Document, "Files go beside the input."), "beside");
  EXPECT_EQ(found(Kind::Document, "See [066](archive/066-what-a-view-shows.md)."), "");
  EXPECT_EQ(found(Kind::Document, "See [beside](a.md)."), "beside");
  EXPECT_EQ(found(Kind::Document, "It takes 4 bits a voxel."), "bits a voxel");
  EXPECT_EQ(found(Kind::Document, "It takes 4 bits per voxel. A row has 64 bits. A voxel has one."), "");
  EXPECT_EQ(found(Kind::Python, "x = 1  # as those of the grid"), "as those of");
  EXPECT_EQ(found(Kind::Code, "TEST(Ray, ThatMisses) {"), "test name opens with That");
  EXPECT_EQ(found(Kind::Code, "TEST(Ray, ItMisses) {"), "test name opens with It");
  EXPECT_EQ(found(Kind::Code, "TEST_F(Rays, AMissIsInfinite) {"), "test name opens with A");
  EXPECT_EQ(found(Kind::Code, "TEST(Ray, AssertsOnNullDirection) {"), "");
  EXPECT_EQ(found(Kind::Code, "/// Returns true if the grid is empty."), "");
}

}  // namespace
}  // namespace quoin::english

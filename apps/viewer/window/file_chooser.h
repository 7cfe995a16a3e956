#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace quoin::viewer {

/// A dialogue in the window that asks for a file to open or to write.
class FileChooser {
 public:
  enum class Purpose : std::uint8_t { Open, Save };

  /// Shows it, in the folder of `start`, whose name it proposes.
  void show(Purpose purpose, const std::filesystem::path& start);
  [[nodiscard]] bool is_shown() const { return is_shown_; }
  [[nodiscard]] Purpose purpose() const { return purpose_; }

  /// Draws it, if shown. Returns the file once the user has chosen.
  [[nodiscard]] std::optional<std::filesystem::path> draw(float scale);

 private:
  struct Entry {
    std::string name;
    bool is_folder = false;
    std::uintmax_t bytes = 0;
  };

  void enter(const std::filesystem::path& folder);
  void draw_folder_line();
  /// Returns true when an entry was chosen for good.
  [[nodiscard]] bool draw_entries(float height);
  [[nodiscard]] std::optional<std::filesystem::path> accept();
  [[nodiscard]] bool is_listed(const Entry& entry) const;

  Purpose purpose_ = Purpose::Open;
  bool is_shown_ = false;
  bool is_new_ = false;
  bool shows_all_ = false;
  std::filesystem::path folder_;
  std::string name_;
  std::string problem_;
  std::string default_extension_;  // of a name without one, in saving
  std::string asked_about_;        // the file whose replacement was warned of
  std::vector<Entry> entries_;
};

}  // namespace quoin::viewer

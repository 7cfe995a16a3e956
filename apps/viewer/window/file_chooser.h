#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace quoin::viewer {

/// A dialogue in the window to choose a file to open or save.
class FileChooser {
 public:
  enum class Purpose : std::uint8_t { Open, Save };

  /// Shows the dialogue in the folder of `start`, with its file name filled in.
  void show(Purpose purpose, const std::filesystem::path& start);
  [[nodiscard]] bool is_shown() const { return is_shown_; }
  [[nodiscard]] Purpose purpose() const { return purpose_; }

  /// Draws the dialogue if it is shown. Returns the file once the user has chosen.
  [[nodiscard]] std::optional<std::filesystem::path> draw(float scale);

 private:
  struct Entry {
    std::string name;
    bool is_folder = false;
    std::uintmax_t bytes = 0;
  };

  void enter(const std::filesystem::path& folder);
  void draw_folder_line();
  /// Returns true when the user has confirmed an entry.
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
  std::string default_extension_;  // added when saving to a name without one
  std::string asked_about_;        // the file whose replacement the user was asked about
  std::vector<Entry> entries_;
};

}  // namespace quoin::viewer

#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include <quoin/core/vec.h>

#include "io/block_writer.h"

namespace quoin {

/// Writes the parts that lines of an OBJ file consist of.
class ObjLines {
 public:
  explicit ObjLines(BlockWriter& out) : out_(out) {}

  [[nodiscard]] BlockWriter& out() { return out_; }
  void text(std::string_view text) { out_.put_text(text); }
  void character(char c) { out_.put(c); }
  void index(std::uint64_t value);
  /// Rounded to a millionth.
  void number(double value);
  /// What `number` writes.
  [[nodiscard]] static std::string text_of(double value);
  /// Rounded to that many significant digits.
  void number(double value, int digits);
  /// "KEYWORD x y z", without a line's end; `digits` 0: to a millionth.
  void triple(std::string_view keyword, const DVec3& v, int digits = 0);
  /// "o NAME" and a line's end: the name as one word, told apart from those before by a number; "object" for an empty
  /// one.
  void object(const std::string& name);

 private:
  BlockWriter& out_;
  std::set<std::string> names_;
};

}  // namespace quoin

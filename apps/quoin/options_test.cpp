#include "options.h"

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/io/block_packs.h>

#include "commands.h"

namespace quoin::tool {

namespace {

/// Parses a command line. Returns the message of a usage error, or "".
std::string parsed(CLI::App& command, const std::string& line, const std::vector<OptionRule>& rules = {}) {
  try {
    command.parse(line);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  const Status fits = check_rules(command, rules);
  return fits ? "" : to_string(fits.error());
}

TEST(Options, ReadPacks) {
  using Paths = std::vector<std::filesystem::path>;
  const auto packs_of = [](const std::string& line, PlainBlocks plain, bool uses_those_of_scenes = true) {
    CLI::App command;
    LoadOptions load;
    add_pack_option(command, load, plain);
    EXPECT_EQ(parsed(command, line), "");
    EXPECT_EQ(load.scene_packs, uses_those_of_scenes) << line;
    return load.packs;
  };
  EXPECT_EQ(packs_of("", PlainBlocks::OwnPack), Paths{kBuiltinPack});
  EXPECT_EQ(packs_of("--pack a.zip --pack b", PlainBlocks::OwnPack), (Paths{"a.zip", "b", kBuiltinPack}));
  EXPECT_EQ(packs_of("--pack none", PlainBlocks::OwnPack, false), Paths{});
  EXPECT_EQ(packs_of("", PlainBlocks::Cubes), Paths{});
  EXPECT_EQ(packs_of("--pack a.zip --pack b", PlainBlocks::Cubes), (Paths{"a.zip", "b"}));
  EXPECT_EQ(packs_of("--pack none", PlainBlocks::Cubes, false), Paths{});
}

TEST(Options, StoreParsedValues) {
  CLI::App command;
  std::optional<double> fov;
  add_parsed(command, "--fov", "DEGREES", number_between(0.0, 180.0, "from 0 to 180"), fov, "Field of view");
  EXPECT_EQ(parsed(command, ""), "");
  EXPECT_EQ(fov, std::nullopt);
  EXPECT_EQ(parsed(command, "--fov 45.5"), "");
  EXPECT_EQ(fov, 45.5);
}

TEST(Options, NameOptionAndRefusedText) {
  CLI::App command;
  double fov = 1.0;
  add_parsed(command, "--fov", "DEGREES", number_between(0.0, 180.0, "from 0 to 180"), fov, "Field of view");
  for (const std::string text : {"181", "-1", "x", "nan", "4 5"}) {
    EXPECT_EQ(parsed(command, "--fov=\"" + text + "\""), "--fov: must be from 0 to 180, not \"" + text + "\"");
  }
  EXPECT_EQ(fov, 1.0);
}

TEST(Options, AcceptLargestNumber) {
  const auto parse = number_from_0().parse;
  EXPECT_EQ(parse("0"), 0.0);
  EXPECT_EQ(parse("1.7976931348623157e308"), std::numeric_limits<double>::max());
  for (const char* text : {"-0.1", "inf", "", " 1"}) EXPECT_EQ(parse(text), std::nullopt) << text;
}

TEST(Options, MapChoicesToValues) {
  enum class Colour { Red, Blue };
  CLI::App command;
  Colour colour = Colour::Red;
  add_choice<Colour>(command, "--colour", {{"red", Colour::Red}, {"blue", Colour::Blue}}, colour, "Colour");
  EXPECT_EQ(parsed(command, "--colour blue"), "");
  EXPECT_EQ(colour, Colour::Blue);
  EXPECT_EQ(parsed(command, "--colour 0"), "--colour: 0 not in {red,blue}");
}

/// A command with the flags --a and --b under "First", --c under "Second".
struct Flags {
  CLI::App command;
  Flags() {
    for (const char* name : {"--a", "--b"}) command.add_flag(name)->group("First");
    command.add_flag("--c")->group("Second");
  }
};

std::string broken(const std::string& line, const std::vector<OptionRule>& rules) {
  Flags flags;
  return parsed(flags.command, line, rules);
}

TEST(OptionRules, ApplyToGivenOptionsOnly) {
  EXPECT_EQ(broken("", {{{"--a"}, needs("--b")}}), "");
  EXPECT_EQ(broken("--a", {{{"--a"}, needs("--b")}}), "--a needs --b");
  EXPECT_EQ(broken("--a --b", {{{"--a"}, needs("--b")}}), "");
  EXPECT_EQ(broken("--b", {{{"--a"}, needs("--b")}}), "");
}

TEST(OptionRules, ExcludeOtherOptionsInBothOrders) {
  const std::vector<OptionRule> rules = {{{"--a"}, excludes({"--b", "--c"})}};
  EXPECT_EQ(broken("--c --a", rules), "--a and --c cannot be used together");
  EXPECT_EQ(broken("--a --b", rules), "--a and --b cannot be used together");
  EXPECT_EQ(broken("--b --c", rules), "");
}

TEST(OptionRules, EvaluateConditionsWhenChecked) {
  bool is_on = false;
  const std::vector<OptionRule> rules = {{{"--a"}, needs("a lamp", [&] { return is_on; })},
                                         {{"--b"}, excludes("a lamp", [&] { return is_on; })}};
  EXPECT_EQ(broken("--a", rules), "--a needs a lamp");
  EXPECT_EQ(broken("--b", rules), "");
  is_on = true;
  EXPECT_EQ(broken("--a", rules), "");
  EXPECT_EQ(broken("--b", rules), "--b and a lamp cannot be used together");
}

TEST(OptionRules, CoverOptionsUnderHeadings) {
  const std::vector<OptionRule> rules = {{{"First"}, needs("--c"), {"--b"}}};
  EXPECT_EQ(broken("--a", rules), "--a needs --c");
  EXPECT_EQ(broken("--b", rules), "") << "an exception";
  EXPECT_EQ(broken("--a --c", rules), "");
}

}  // namespace

}  // namespace quoin::tool

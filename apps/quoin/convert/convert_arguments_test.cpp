#include "convert/convert_arguments.h"

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "convert/convert.h"
#include "parsed_line_for_tests.h"

namespace quoin::tool {

namespace {

std::string convert_fault_of(const std::string& line) {
  return ParsedLine<ConvertArguments>(line, add_convert_options).fault;
}

ConvertArguments convert_arguments_of(const std::string& line) {
  const ParsedLine<ConvertArguments> parsed(line, add_convert_options);
  EXPECT_EQ(parsed.fault, "") << line;
  return parsed.arguments;
}

MeshLoadOptions options_of(const std::string& options) {
  return convert_arguments_of("in.obj out.json " + options).options.common.load.mesh;
}

/// A command line that breaks a rule, its usage error, and a similar command line that keeps the rule.
struct RuleCase {
  std::string breaking;
  std::string fault;
  std::string fitting;
};

void expect_rules(const std::vector<RuleCase>& cases) {
  for (const RuleCase& each : cases) {
    EXPECT_EQ(convert_fault_of(each.breaking), each.fault) << each.breaking;
    EXPECT_EQ(convert_fault_of(each.fitting), "") << each.fitting;
  }
}

TEST(ConvertArguments, RefusesContradictoryFiles) {
  expect_rules({
      {"a.vox", "OUT is required", "a.vox b.glb"},
      {"a.vox b.vox c.vox", "cannot convert 3 files: several inputs need --to FORMAT", "a.vox b.vox c.vox --to glb"},
      {"- --to glb", "standard input (-) must be the only input and needs OUT", "- - --to glb"},
      {"a.vox - --to glb --out-dir d", "--out-dir and standard output cannot be used together",
       "a.vox --to glb --out-dir d"},
      {"a.vox b.glb --out-dir d", "--out-dir needs --to FORMAT", "a.vox b.vox --to glb --out-dir d"},
      {"a b.glb --recursive", "--recursive needs --to FORMAT", "a b --to glb --recursive"},
      {"a.vox b.glb --watch --json", "--watch and --json cannot be used together", "a.vox b.glb --watch"},
      {"- b.glb --watch", "--watch and standard input or output cannot be used together", "a.vox --to glb --watch"},
      {"a.vox - --to glb --watch", "--watch and standard input or output cannot be used together", "a.vox - --to glb"},
      {"a.vox b.json --watch", "--watch needs --force: it overwrites OUT, a model, after each change",
       "a.vox b.json --watch --force"},
      {"a.vox --to json --watch", "--watch needs --force: it overwrites OUT, a model, after each change",
       "a.vox --to json --watch --force"},
  });
}

TEST(ConvertArguments, RefusesFormatsThatOutputCannotHave) {
  expect_rules({
      {"a.vox - --to obj", "cannot write .obj to standard output: it consists of several files", "a.vox - --to ply"},
      {"a.vox - --to gltf", "cannot write .gltf to standard output: it consists of several files", "a.vox - --to glb"},
      {"a.vox - --to glb --json", "cannot use --json: OUT is standard output", "a.vox b.glb --json"},
  });
  EXPECT_TRUE(convert_fault_of("a.vox -").starts_with("writing to standard output needs --to FORMAT, one of ."));
  EXPECT_TRUE(
      convert_fault_of("a.vox - --to xyz").starts_with("writing to standard output needs --to FORMAT, one of ."));
  EXPECT_TRUE(convert_fault_of("a.vox --to xyz").starts_with("--to: unknown extension; use one of .3mf"));
  EXPECT_TRUE(convert_fault_of("a.vox --to xyz").ends_with(", not \"xyz\""));
  EXPECT_TRUE(convert_fault_of("a.vox b.xyz").starts_with("b.xyz: unknown extension; use one of .3mf"));
}

TEST(ConvertArguments, RefusesContradictoryMeshOptions) {
  const std::string occlusion = " cannot be used together: the atlas holds the occlusion of merged faces";
  const std::string light = " cannot be used together: light is stored at the corners of faces";
  expect_rules({
      {"a.vox b.glb --texture atlas --mesher culled", "--mesher and --texture atlas" + occlusion,
       "a.vox b.glb --texture atlas --mesher greedy"},
      {"a.vox b.glb --texture atlas --no-ao", "--no-ao and --texture atlas" + occlusion,
       "a.vox b.glb --texture palette --no-ao"},
      {"a.vox b.glb --texture atlas --ao-attribute", "--ao-attribute and --texture atlas" + occlusion,
       "a.vox b.glb --ao-attribute"},
      {"a.vox b.glb --texture atlas --watertight", "--watertight and --texture atlas" + occlusion,
       "a.vox b.glb --watertight"},
      {"a.vox b.glb --light propagated --texture atlas", "--light and --texture atlas" + light,
       "a.vox b.glb --light none --texture atlas"},
      {"a.vox b.glb --light propagated --watertight", "--watertight and --light propagated" + light,
       "a.vox b.glb --light propagated --watertight --mesher smooth"},
      {"a.vox b.glb --no-ao --ao-attribute", "--ao-attribute and --no-ao cannot be used together",
       "a.vox b.glb --no-ao"},
      {"a.vox b.glb --no-ao --ao-form share", "--ao-form and --no-ao cannot be used together",
       "a.vox b.glb --ao-form share"},
      {"a.vox b.glb --ao-form none --ao-attribute", "--ao-attribute and --ao-form none cannot be used together",
       "a.vox b.glb --ao-form share --ao-attribute"},
      {"a.vox b.glb --ao-form none --ao-spread 1", "--ao-spread and --ao-form none cannot be used together",
       "a.vox b.glb --ao-spread 1"},
      {"a.vox b.glb --ao-offset 0.2", "--ao-offset needs --ao-form weighted",
       "a.vox b.glb --ao-offset 0.2 --ao-form weighted"},
      {"a.vox b.glb --fps 3", "--fps needs --animate", "a.vox b.glb --fps 3 --animate"},
      {"a.vox b.glb --animate --frame 2", "--frame and --animate cannot be used together", "a.vox b.glb --frame 2"},
      {"a.vox b.stl --voxel-mm 2 --scale 3", "--voxel-mm and --scale cannot be used together",
       "a.vox b.stl --voxel-mm 2"},
      {"a.vox b.glb --voxel-mm 2", "--voxel-mm needs .stl or .3mf; use --scale for other mesh formats",
       "a.vox b.3mf --voxel-mm 2"},
      {"a.vox b.vox --voxel-mm 2", "--voxel-mm needs .stl or .3mf; use --scale for other mesh formats",
       "a.vox --to stl --voxel-mm 2"},
  });
}

TEST(ConvertArguments, AcceptsContentOnlyForFormatsThatHoldIt) {
  struct Needed {
    std::string option;
    std::string named;  ///< the option in the message
    std::string without;
    std::string with;
  };
  for (const Needed& each : std::vector<Needed>{{"--ao-attribute", "--ao-attribute", "obj", "ply"},
                                                {"--texture atlas", "--texture atlas", "ply", "obj"},
                                                {"--lights", "--lights", "obj", "gltf"},
                                                {"--light propagated", "--light", "obj", "glb"},
                                                {"--animate", "--animate", "stl", "glb"},
                                                {"--compress", "--compress", "ply", "glb"},
                                                {"--quantize", "--quantize", "3mf", "gltf"}}) {
    const std::string fault = convert_fault_of("a.vox b." + each.without + " " + each.option);
    EXPECT_TRUE(fault.starts_with("cannot write " + each.named + " to ." + each.without + ": ")) << fault;
    EXPECT_EQ(convert_fault_of("a.vox b." + each.with + " " + each.option), "");
    EXPECT_EQ(convert_fault_of("a.vox --to " + each.without + " " + each.option), fault);
  }
}

TEST(ConvertArguments, AcceptsMeshOptionsOnlyForMeshes) {
  for (const std::string options :
       {"--mesher greedy", "--scale 2", "--up z", "--simplify 1", "--smoothness 1", "--colours sharp",
        "--texture palette", "--no-ao", "--watertight", "--no-unite", "--ao-attribute", "--ao-form share",
        "--light propagated", "--lights", "--animate", "--animate --fps 3", "--compress", "--quantize"}) {
    EXPECT_EQ(convert_fault_of("a.vox b.glb " + options), "");
    for (const auto& [files, output] : std::vector<std::pair<std::string, std::string>>{
             {"a.vox b.json", "b.json"}, {"a.vox --to .qb", ".qb"}, {"a.vox - --to vox", ".vox"}}) {
      const std::string fault = convert_fault_of(files + " " + options);
      EXPECT_TRUE(fault.starts_with("--mesher, --no-ao, ")) << files << " " << options << ": " << fault;
      EXPECT_TRUE(fault.ends_with(" need a mesh format; " + output + " is not one")) << fault;
    }
  }
}

TEST(ConvertArguments, RefusesOptionsOfMissingRawVolume) {
  expect_rules({
      {"a.raw b.glb --raw-type int8", "--raw-type needs --raw-size", "a.raw b.glb --raw-type int8 --raw-size 2x2x2"},
      {"a.raw b.glb --raw-order big", "--raw-order needs --raw-size", "a.raw b.glb --raw-order big --raw-size 2x2x2"},
  });
}

TEST(ConvertArguments, SettlesFilesAndFormat) {
  const ConvertArguments one = convert_arguments_of("a.vox b.glb");
  EXPECT_EQ(one.options.common.input, "a.vox");
  EXPECT_EQ(one.options.output, "b.glb");
  EXPECT_EQ(one.format->format, FileFormat::Glb);
  EXPECT_FALSE(one.has_many_inputs());
  const ConvertArguments many = convert_arguments_of("a.vox b.vox --to .ply --out-dir d");
  EXPECT_EQ(many.many.inputs, (std::vector<std::filesystem::path>{"a.vox", "b.vox"}));
  EXPECT_EQ(many.many.folder, "d");
  EXPECT_EQ(many.format->format, FileFormat::Ply);
  EXPECT_TRUE(many.has_many_inputs());
  const ConvertArguments stream = convert_arguments_of("a.vox - --to vox");
  EXPECT_TRUE(stream.is_to_stream());
  EXPECT_FALSE(stream.has_many_inputs());
  EXPECT_EQ(stream.format->format, FileFormat::Vox);
}

TEST(ConvertArguments, SettlesGivenOptions) {
  const ConvertOptions plain = convert_arguments_of("a.obj b.glb").options;
  EXPECT_FALSE(plain.has_field_occlusion);
  EXPECT_FALSE(plain.as_voxels);
  EXPECT_EQ(plain.mesh_input, "");
  EXPECT_FALSE(plain.mesher);
  const ConvertOptions options =
      convert_arguments_of(
          "a.obj b.glb --solid --max-colours 9 --ao-power 3 --ao-form weighted --mesher smooth --iso 0.1")
          .options;
  EXPECT_TRUE(options.has_field_occlusion);
  EXPECT_TRUE(options.as_voxels);
  EXPECT_EQ(options.mesh_input, "--solid");
  EXPECT_EQ(options.mesher, Mesher::Smooth);
  EXPECT_EQ(options.iso, 0.1);
  EXPECT_TRUE(convert_arguments_of("a.vox b.glb --light propagated").options.light);
  EXPECT_FALSE(convert_arguments_of("a.vox b.glb --light none").options.light);
}

TEST(MeshInput, SelectsSurfaceAndInside) {
  EXPECT_EQ(options_of("").surface, SurfaceVoxels::Separating6);
  EXPECT_EQ(options_of("").solid, SolidVoxels::Winding);
  EXPECT_EQ(options_of("--separating 26").surface, SurfaceVoxels::Separating26);
  EXPECT_EQ(options_of("--solid --parity").surface, SurfaceVoxels::None);
  EXPECT_EQ(options_of("--solid --parity").solid, SolidVoxels::Parity);
  EXPECT_EQ(options_of("--surface --separating 6").solid, SolidVoxels::None);
}

TEST(MeshInput, ReadsSizesAndAxes) {
  EXPECT_EQ(options_of("--size 200").size, 200);
  EXPECT_EQ(options_of("--voxel 0.5").voxel_size, 0.5);
  EXPECT_EQ(options_of("--field --band 4").band, 4.0F);
  EXPECT_TRUE(options_of("--field").as_field);
  EXPECT_EQ(options_of("--max-colours 9").max_types, 9U);
  EXPECT_EQ(options_of("").up, std::nullopt);
  EXPECT_EQ(options_of("--input-up z").up, UpAxis::Z);
}

TEST(MeshInput, RefusesOptionsThatContradictEachOther) {
  expect_rules({
      {"a.obj b.vox --size 3 --voxel 1", "--size and --voxel cannot be used together", "a.obj b.vox --voxel 1"},
      {"a.obj b.vox --solid --surface", "--solid and --surface cannot be used together", "a.obj b.vox --surface"},
      {"a.obj b.vox --parity --surface", "--parity and --surface cannot be used together",
       "a.obj b.vox --parity --solid"},
      {"a.obj b.json --field --surface", "--field and --surface cannot be used together", "a.obj b.json --field"},
      {"a.obj b.json --field --separating 6", "--field and --separating cannot be used together",
       "a.obj b.json --separating 6"},
      {"a.obj b.vox --solid --separating 26", "--separating and --solid cannot be used together",
       "a.obj b.vox --surface --separating 26"},
      {"a.obj b.json --band 3", "--band needs --field", "a.obj b.json --band 3 --field"},
      {"a.obj b.vox --separating 7", "--separating: 7 not in {6,26}", "a.obj b.vox --separating 26"},
  });
}

/// Opens an input of this format without reading a file. No format: a raw volume.
OpenedInput input_of(std::optional<FileFormat> format) {
  return {{"in", format}, !format || can(format, FormatCapability::Volume)};
}

/// Returns the error of the rules that need the opened input, or "".
std::string input_fault(const std::string& line, std::optional<FileFormat> input, bool is_one_of_many = false) {
  ConvertArguments arguments = convert_arguments_of(line);
  arguments.options.is_one_of_many = is_one_of_many;
  const Status fits = check_input_rules(arguments.options, *arguments.format, input_of(input));
  return fits ? "" : to_string(fits.error());
}

TEST(ConvertInput, RefusesOptionsThatVolumesIgnore) {
  for (const auto& [options, named, needed] : std::vector<std::array<std::string, 3>>{
           {"--light propagated", "--light", "voxels or a field"},
           {"--texture atlas", "--texture atlas", "voxels"},
           {"--animate", "--animate", "a .vox file"},
           {"--smoothness 1 --mesher smooth", "--smoothness, --colours or --no-unite", "voxels"},
           {"--colours sharp --mesher smooth", "--smoothness, --colours or --no-unite", "voxels"},
           {"--no-unite --mesher smooth", "--smoothness, --colours or --no-unite", "voxels"},
           {"--hidden", "--hidden or --frame", "voxels"},
           {"--frame 2", "--hidden or --frame", "voxels"}}) {
    const std::string fault = "cannot use " + named + ": the input is a volume, not " + needed;
    EXPECT_EQ(input_fault("in out.glb " + options, FileFormat::Nifti), fault) << options;
    EXPECT_EQ(input_fault("in out.glb " + options, std::nullopt), fault) << options;
    EXPECT_EQ(input_fault("in out.glb " + options, FileFormat::Vox), "") << options;
  }
  EXPECT_EQ(input_fault("in out.glb --mesher greedy", FileFormat::Nrrd),
            "cannot use --mesher greedy: the input is a volume; use --mesher smooth");
  EXPECT_EQ(input_fault("in out.glb --mesher smooth", FileFormat::Nrrd), "");
}

TEST(ConvertInput, AcceptsIsoOnlyForVolumes) {
  EXPECT_EQ(input_fault("in out.glb --iso 1", FileFormat::Vox),
            "cannot use --iso: the input holds voxels, not a volume");
  for (const auto format : {FileFormat::Nrrd, FileFormat::Vdb}) {
    EXPECT_EQ(input_fault("in out.glb --iso 1", format), "") << format.name();
  }
}

TEST(ConvertInput, AcceptsTriangleOptionsOnlyForTriangles) {
  EXPECT_EQ(input_fault("in out.vox --voxel 1", FileFormat::Vox),
            "cannot use --voxel: it needs a triangle mesh, and the input is vox");
  EXPECT_EQ(input_fault("in out.vox --voxel 1", FileFormat::Obj), "");
  EXPECT_EQ(input_fault("in out.vox --voxel 1", FileFormat::Vox, true), "") << "another input may have triangles";
  EXPECT_EQ(input_fault("in out.json --solid", FileFormat::Scene), "");
  EXPECT_EQ(input_fault("in out.glb --solid", FileFormat::Scene),
            "cannot use --solid: it converts fields to voxels, but .glb is a mesh format");
}

TEST(ConvertInput, RefusesSmoothOptionsForBlocks) {
  const std::vector<std::pair<std::string, std::string>> faults = {
      {"--ao-form share", "--ao-form, --ao-spread, --ao-offset and --ao-power need --mesher smooth"},
      {"--smoothness 1", "--smoothness, --colours and --no-unite need --mesher smooth"},
      {"--colours sharp", "--smoothness, --colours and --no-unite need --mesher smooth"},
      {"--no-unite", "--smoothness, --colours and --no-unite need --mesher smooth"}};
  for (const auto& [options, fault] : faults) {
    const std::string line = "in out.glb " + options;
    EXPECT_EQ(input_fault(line, FileFormat::Vox), fault) << options;
    EXPECT_EQ(input_fault(line + " --mesher culled", FileFormat::Scene), fault) << options;
    EXPECT_EQ(input_fault(line + " --mesher smooth", FileFormat::Vox), "") << options;
    // Only its content decides on the mesher.
    EXPECT_EQ(input_fault(line, FileFormat::Scene), "") << options;
    const ConvertOptions read = convert_arguments_of(line).options;
    EXPECT_TRUE(check_mesher_rules(read, Mesher::Smooth)) << options;
    const Status refused = check_mesher_rules(read, Mesher::Greedy);
    ASSERT_FALSE(refused) << options;
    EXPECT_EQ(to_string(refused.error()), fault) << options;
  }
  EXPECT_FALSE(check_mesher_rules(convert_arguments_of("in out.glb --simplify 1").options, Mesher::Greedy));
  EXPECT_TRUE(check_mesher_rules(convert_arguments_of("in out.glb").options, Mesher::Greedy));
}

TEST(ConvertInput, RequiresFormatOfFrom) {
  const ConvertOptions options = convert_arguments_of("in out.glb --from vox").options;
  EXPECT_TRUE(check_input_format(options, input_of(FileFormat::Vox)));
  EXPECT_TRUE(check_input_format(convert_arguments_of("in out.glb").options, input_of(FileFormat::Vox)));
  const Status refused = check_input_format(options, input_of(FileFormat::Nifti));
  ASSERT_FALSE(refused);
  EXPECT_EQ(to_string(refused.error()), "in: the format is nifti, not vox");
}

}  // namespace

}  // namespace quoin::tool

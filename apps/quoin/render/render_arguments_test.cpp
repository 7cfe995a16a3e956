#include "render/render_arguments.h"

#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include <quoin/render/light_options.h>

#include "options.h"
#include "parsed_line_for_tests.h"

namespace quoin::tool {

namespace {

std::string render_fault_of(const std::string& options) {
  return ParsedLine<RenderArguments>("in.vox -o out.png " + options, add_render_options).fault;
}

RenderArguments render_arguments_of(const std::string& options) {
  const ParsedLine<RenderArguments> parsed("in.vox -o out.png " + options, add_render_options);
  EXPECT_EQ(parsed.fault, "") << options;
  return parsed.arguments;
}

struct Mode {
  std::string name;
  std::string options;
};

const std::vector<Mode> kModes = {{"rays", ""},
                                  {"path", "--light path"},
                                  {"propagated", "--light propagated"},
                                  {"no-shadows", "--preset no-shadows"},
                                  {"no-ao", "--preset no-ao"},
                                  {"unlit", "--preset unlit"},
                                  {"ao", "--preset ao"},
                                  {"density", "--preset density"}};

const std::string kAll = "rays path propagated no-shadows no-ao unlit ao density";
const std::string kImages = "rays path propagated no-shadows no-ao unlit ao";  // not slices
const std::string kOfMarching = "rays propagated no-shadows no-ao unlit ao";   // not path tracing
const std::string kLit = "rays path propagated no-shadows no-ao";
const std::string kLitByMarching = "rays propagated no-shadows no-ao";
const std::string kOccluded = "rays propagated no-shadows ao";
const std::string kOfSmooth = "rays propagated no-shadows unlit ao";  // --ao is given

/// An option with a value, other options that it needs, and the modes that accept it.
struct Sample {
  std::string option;
  std::string value;
  std::string modes;
};

const std::vector<Sample> kSamples = {{"--size", "9x9", kAll},
                                      {"--samples", "2", kImages},
                                      {"--depth", "d.pfm", kImages},
                                      {"--watch", "", kAll},
                                      {"--view", "top", kImages},
                                      {"--azimuth", "10", kImages},
                                      {"--elevation", "20", kImages},
                                      {"--camera", "file:1", kImages},
                                      {"--look-at", "1,2,3 --camera 0,0,0", kImages},
                                      {"--fov", "30 --camera 0,0,0 --look-at 1,2,3", kImages},
                                      {"--turntable", "3", kImages},
                                      {"--frames", "0:3", kImages},
                                      {"--path", "cameras.json", kImages},
                                      {"--resume", "--turntable 3", kImages},
                                      {"--sun", "off", kLit},
                                      {"--fixed-sky", "", kLitByMarching},
                                      {"--sky-brightness", "2", kLit},
                                      {"--lamps", "3", "rays no-shadows no-ao"},
                                      {"--lamp-brightness", "2", kLit},
                                      {"--emission-scale", "2", kImages},
                                      {"--exposure", "2", kLit},
                                      {"--shadow-distance", "3", "rays no-ao"},
                                      {"--least-light", "0.1", "propagated"},
                                      {"--plain-glass", "", kLitByMarching},
                                      {"--ao", "vertex", kOfSmooth},
                                      {"--ao-rays", "9", kOccluded},
                                      {"--ao-distance", "3", kOccluded},
                                      {"--ao-affects", "all", "rays no-shadows"},
                                      {"--ao-form", "weighted --ao smooth", kOfSmooth},
                                      {"--ao-spread", "1 --ao smooth", kOfSmooth},
                                      {"--ao-offset", "0.3 --ao smooth --ao-form weighted", kOfSmooth},
                                      {"--ao-power", "3 --ao smooth --ao-form weighted", kOfSmooth},
                                      {"--bounces", "3", "path"},
                                      {"--sky", "physical", "path"},
                                      {"--sky-turn", "5 --sky a.hdr", "path"},
                                      {"--sun-angle", "3", "path"},
                                      {"--sun-time", "06-21,12,0", "path"},
                                      {"--ground", "", "path"},
                                      {"--transparent", "", "path"},
                                      {"--lens-radius", "1", "path"},
                                      {"--focus", "3", "path"},
                                      {"--fog", "0.1", "path"},
                                      {"--fog-colour", "1,1,1 --fog 0.1", "path"},
                                      {"--tone", "agx", "path"},
                                      {"--bloom", "0.1", "path"},
                                      {"--vignette", "0.1", "path"},
                                      {"--look", "plain", "path"},
                                      {"--denoise", "", "path"},
                                      {"--iso", "3", kAll},
                                      {"--raw-size", "1x1x1", kAll},
                                      {"--raw-type", "int8 --raw-size 1x1x1", kAll},
                                      {"--raw-order", "big --raw-size 1x1x1", kAll},
                                      {"--slice", "y:0.5", "density"},
                                      {"--detail", "pixels", kOfMarching},
                                      {"--lod-colours", "", kOfMarching},
                                      {"--backend", "vulkan", kImages},
                                      {"--device", "0 --backend vulkan", kImages}};

TEST(RenderArguments, SamplesCoverEveryOption) {
  // Options of all commands, the options of kModes, and --fps, which needs a video.
  std::set<std::string> sampled = {"--help",   "--hidden",    "--frame", "--allow-outside-files",
                                   "--around", "--dimension", "--pack",  "--json",
                                   "--quiet",  "--threads",   "--light", "--preset",
                                   "--fps"};
  for (const Sample& sample : kSamples) sampled.insert(sample.option);
  CLI::App command;
  RenderArguments arguments;
  add_render_options(command, arguments);
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional() || option->get_required() || option->get_group() == heading::kHeights) continue;
    EXPECT_TRUE(sampled.contains(option->get_name())) << option->get_name() << ": add it to kSamples";
  }
}

TEST(RenderArguments, AcceptOptionsOnlyInFittingModes) {
  for (const Sample& sample : kSamples) {
    std::istringstream words(sample.modes);
    const std::set<std::string> fitting{std::istream_iterator<std::string>(words), {}};
    for (const Mode& mode : kModes) {
      const std::string line = mode.options + " " + sample.option + " " + sample.value;
      const std::string fault = render_fault_of(line);
      EXPECT_EQ(fault.empty(), fitting.contains(mode.name)) << line << ": " << fault;
      EXPECT_TRUE(fault.empty() || fault.starts_with("--")) << line << ": " << fault;
    }
  }
}

TEST(RenderArguments, RefusesOptionsThatContradictEachOther) {
  const std::vector<std::pair<std::string, std::string>> faults = {
      {"--view top --azimuth 3", "--view and --azimuth cannot be used together"},
      {"--camera file:0 --elevation 3", "--camera and --elevation cannot be used together"},
      {"--turntable 3 --frames 0:2", "--turntable and --frames cannot be used together"},
      {"--frames 0:2 --frame 1", "--frame and --frames cannot be used together"},
      {"--path cameras.json --view top", "--path and --view cannot be used together"},
      {"--frames 0:2 --depth d.pfm", "--frames and --depth cannot be used together"},
      {"--fps 3", "--fps needs a video: .mp4 or .webm"},
      {"--resume", "--resume needs an image series: --turntable, --frames or --path"},
      {"--camera 1,2,3", "--camera needs --look-at"},
      {"--camera file:0 --look-at 1,2,3", "--look-at needs --camera X,Y,Z"},
      {"--camera file:0 --fov 3", "--fov needs --camera and --look-at; views frame the scene"},
      {"--camera 1,2,3 --look-at 1,2,3", "camera: position and target must differ"},
      {"--ao vertex --ao-rays 4", "--ao-rays needs --ao rays"},
      {"--ao-form weighted", "--ao-form needs --ao smooth"},
      {"--ao smooth --ao-form none --ao-spread 1", "--ao-spread and --ao-form none cannot be used together"},
      {"--ao smooth --ao-offset 0.2", "--ao-offset needs --ao-form weighted"},
      {"--ao smooth --backend vulkan", "--ao smooth and --backend vulkan cannot be used together; use --backend cpu"},
      {"--lamps 0 --lamp-brightness 2", "--lamp-brightness has no effect with --lamps 0"},
      {"--preset unlit --ao-affects all", "--ao-affects: the preset unlit has no ambient occlusion without --ao"},
      {"--preset unlit --ao vertex --ao-affects all", "--ao-affects: the preset unlit has no light"},
      {"--light propagated --preset ao", "--light propagated and --preset ao cannot be used together"},
      {"--exposure auto", "--exposure auto needs --light path"},
      {"--light path --fog-colour 1,1,1", "--fog-colour needs --fog"},
      {"--light path --sun 1,1,1 --sun-time 06-21,12,0", "--sun and --sun-time cannot be used together"},
      {"--light path --sky physical --sky-turn 3", "--sky-turn needs an image file for --sky"},
      {"--raw-type int8", "--raw-type needs --raw-size"},
      {"--device 0", "--device needs --backend vulkan"},
      {"--watch --json", "--watch and --json cannot be used together"},
      {"--depth d.png", "--depth: the name must end in .pfm, not \"d.png\""}};
  for (const auto& [options, fault] : faults) EXPECT_EQ(render_fault_of(options), fault) << options;
}

TEST(RenderArguments, RefusesOutputsThatCannotHoldImage) {
  const std::vector<std::pair<std::string, std::string>> faults = {
      {"in.vox -o out.gif", "-o: the image name must end in .png, .jpg, .webp or .exr, not \"out.gif\""},
      {"in.vox -o out.exr", "-o: .exr needs --light path"},
      {"in.vox -o out.jpg --light path --transparent", "-o: .jpg has no alpha channel"},
      {"in.vox -o out.mp4", "-o: the video out.mp4 needs --turntable, --frames or --path"},
      {"in.vox -o out.mp4 --turntable 3 --light path --transparent", "-o: videos have no alpha channel"},
      {"in.vox -o out.webm --turntable 3 --fps 30", ""},
      {"- -o out.png --watch", "--watch and standard input cannot be used together"},
      {"in.vox", "--output is required"}};
  for (const auto& [line, fault] : faults)
    EXPECT_EQ(ParsedLine<RenderArguments>(line, add_render_options).fault, fault) << line;
}

TEST(RenderArguments, NamesOptionOfRefusedValue) {
  for (const std::string options :
       {"--size 0x9",        "--size 40000x25000", "--samples 0",      "--view side",
        "--elevation 91",    "--camera file:x",    "--camera 1,2",     "--look-at 1,2,nan",
        "--fov 180",         "--turntable 1",      "--frames 3:1",     "--fps 0",
        "--light x",         "--preset x",         "--sun 0,0,0",      "--sky-brightness -1",
        "--lamps 1025",      "--exposure x",       "--ao none",        "--ao-form deep",
        "--ao-spread 5",     "--sky sky.png",      "--sun-angle 171",  "--sun-time 02-30,12,0",
        "--lens-radius nan", "--focus 0",          "--fog 1,2,3",      "--fog-colour 1,1,2",
        "--tone x",          "--bloom 0.1,0.1,-1", "--vignette 1.1",   "--look mine",
        "--iso nan",         "--iso 1e39",         "--raw-size 1x0x1", "--raw-type half",
        "--slice w:0.5",     "--slice y:2",        "--detail far",     "--backend gpu",
        "--device ''"}) {
    const std::string name = options.substr(0, options.find(' '));
    EXPECT_TRUE(render_fault_of(options).starts_with(name + ": ")) << options << ": " << render_fault_of(options);
  }
}

TEST(RenderArguments, DefaultsToNaturalLightAndFewSamples) {
  const RenderArguments plain = render_arguments_of("");
  EXPECT_EQ(plain.render.light, natural_light());
  EXPECT_EQ(plain.render.samples, 4);
  EXPECT_EQ(render_arguments_of("--light path").render.samples, 64);
  EXPECT_EQ(render_arguments_of("--light path --samples 3").render.samples, 3);
  Environment environment;
  plain.environment.apply_to(environment);
  EXPECT_EQ(environment, Environment::natural());
  EXPECT_FALSE(plain.has_view());
  EXPECT_FALSE(plain.is_image_series());
  EXPECT_EQ(plain.forward(), direction_of(View::Iso));
}

TEST(RenderArguments, ReadsLight) {
  const RenderArguments day =
      render_arguments_of("--sun 0,2,0 --fixed-sky --plain-glass --lamps 3 --exposure 2 --shadow-distance 9");
  EXPECT_FALSE(day.render.light.glass_surfaces);
  EXPECT_EQ(day.render.light.max_lamps, 3);
  EXPECT_EQ(day.render.light.shadow_distance_voxels, 9.0);
  Environment environment;
  day.environment.apply_to(environment);
  EXPECT_EQ(environment.sun.direction, DVec3(0, 1, 0));
  EXPECT_EQ(environment.sky.model, SkyModel::Fixed);
  EXPECT_EQ(environment.exposure, 2.0);
  Environment night;
  render_arguments_of("--sun off").environment.apply_to(night);
  EXPECT_EQ(night.sun.brightness, 0.0);
  EXPECT_EQ(night.sun.direction, Environment::natural().sun.direction);
  EXPECT_TRUE(render_arguments_of("--light path --exposure auto").is_exposure_automatic);
  EXPECT_EQ(render_arguments_of("--light propagated").render.light.model, LightModel::Propagated);
}

TEST(RenderArguments, PresetsAndOcclusionSelectShading) {
  const auto light = [](const std::string& options) { return render_arguments_of(options).render.light; };
  EXPECT_EQ(light("--preset no-ao").occlusion_mode, OcclusionMode::Off);
  EXPECT_EQ(light("--ao vertex").occlusion_mode, OcclusionMode::Vertex);
  EXPECT_FALSE(light("--preset no-shadows").shadows);
  EXPECT_EQ(light("--preset ao").shading, Shading::Occlusion);
  EXPECT_EQ(light("--preset unlit").shading, Shading::Unlit);
  EXPECT_EQ(light("--preset unlit --ao vertex").shading, Shading::UnlitWithOcclusion);
  EXPECT_EQ(light("--ao-affects all").occlusion_affects, OcclusionAffects::All);
}

TEST(RenderArguments, UsesMoreRaysForLongOcclusion) {
  const auto light = [](const std::string& options) { return render_arguments_of(options).render.light; };
  EXPECT_EQ(light("--ao-distance 12").occlusion_rays, natural_light().occlusion_rays);
  EXPECT_EQ(light("--ao-distance 13").occlusion_rays, 16);
  EXPECT_EQ(light("--ao-distance 13 --ao-rays 5").occlusion_rays, 5);
  EXPECT_EQ(light("--ao-distance 3").field_occlusion_reach, 1.0);
}

TEST(RenderArguments, LodColoursImplyPixels) {
  EXPECT_FALSE(render_arguments_of("").render.detail.policy);
  EXPECT_FALSE(render_arguments_of("--lod-colours --detail near").render.detail.policy);
  EXPECT_EQ(render_arguments_of("--lod-colours").render.detail.policy->rule, DetailPolicy::Rule::ByPixels);
  EXPECT_EQ(render_arguments_of("--detail radius").render.detail.policy->rule, DetailPolicy::Rule::ByRadius);
}

TEST(RenderArguments, ReadsCamerasAndSeries) {
  const RenderArguments camera = render_arguments_of("--camera 1,-2.5,3 --look-at 0,0,0 --fov 30");
  EXPECT_EQ(camera.position, DVec3(1, -2.5, 3));
  EXPECT_EQ(camera.fov_degrees, 30.0);
  EXPECT_EQ(render_arguments_of("--camera file:7").file_camera, 7);
  const RenderArguments frames = render_arguments_of("--frames 2:5 --view left");
  EXPECT_TRUE(frames.is_image_series() && frames.has_view());
  EXPECT_EQ(frames.frames->first, 2);
  EXPECT_EQ(frames.frames->last, 5);
  EXPECT_EQ(frames.view, View::Left);
  EXPECT_TRUE(render_arguments_of("--turntable 5").has_view());
}

TEST(RenderArguments, ReadsPathTracing) {
  const PathArguments path =
      render_arguments_of("--light path --sky sky.HDR --sky-turn 90 --no-ground --fog 0.5,8 --bloom 0.1 --look plain")
          .path;
  EXPECT_EQ(path.sky->model, SkyModel::Image);
  EXPECT_EQ(path.sky->image, "sky.HDR");
  EXPECT_EQ(path.sky_turn_degrees, 90.0);
  EXPECT_EQ(path.ground, false);
  EXPECT_EQ(path.fog->top, 8.0);
  EXPECT_EQ(path.bloom->mix, 0.1);
  EXPECT_FALSE(path.uses_file_look);
  EXPECT_EQ(render_arguments_of("--light path --ground").path.ground, true);
  EXPECT_EQ(render_arguments_of("--light path --no-ground --ground").path.ground, true) << "the last applies";
  EXPECT_EQ(render_arguments_of("--light path").path.ground, std::nullopt);
}

TEST(RenderArguments, ReadsVolumesAndSlices) {
  const RenderArguments raw = render_arguments_of(
      "--raw-size 2x3x4 --raw-type uint16 --raw-order big --iso 0.5 --preset density --slice z:0.25");
  ASSERT_TRUE(raw.common.load.raw);
  EXPECT_EQ(raw.common.load.raw->size, IVec3(2, 3, 4));
  EXPECT_EQ(raw.common.load.raw->type, ScalarType::UInt16);
  EXPECT_EQ(raw.common.load.raw->order, std::endian::big);
  EXPECT_EQ(raw.common.load.iso, 0.5F);
  EXPECT_EQ(raw.slice.axis, 2);
  EXPECT_EQ(raw.slice.at, 0.25);
}

}  // namespace

}  // namespace quoin::tool

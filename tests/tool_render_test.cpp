#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/io/image_files.h>
#include <quoin/render/vulkan_renderer.h>

#include "io/image/image_codecs.h"
#include "io/vox/vox_for_tests.h"
#include "tests/tool_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

class ToolRender : public ToolTest {
 protected:
  /// Renders and returns the JSON report.
  Json drawn(const std::string& arguments) {
    const ToolRun result = run("render " + arguments + " --json");
    EXPECT_EQ(result.status, 0) << arguments << ": " << result.err;
    return result.status == 0 ? Json::parse(result.out) : Json();
  }
  std::string bytes(const std::string& name) { return text_of(folder_.file(name)); }
  /// Writes a file of one voxel: in Quoin's axes from (0, 0, -1) to (1, 1, 0).
  void write_one_voxel() {
    std::ofstream(folder_.file("one.vox"), std::ios::binary) << vox_file({1, 1, 1}, std::string("\0\0\0\1", 4));
  }
};

DVec3 triple(const Json& json) {
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

TEST_F(ToolRender, WritesAndReportsImageOfRequestedSize) {
  const Json said = drawn("tiny.vox -o out.png --size 64x48 --threads 2");
  EXPECT_EQ(said["size"], Json({64, 48}));
  EXPECT_GT(said["rays"], 64 * 48);
  EXPECT_GT(said["pixels_hit"], 100);
  EXPECT_LT(said["pixels_hit"], 64 * 48);
  EXPECT_EQ(said["faces_visible"], 18);
  EXPECT_EQ(said["faces_total"], 24);
  EXPECT_EQ(said["backend"], "cpu");
  EXPECT_EQ(said["threads"], 2);
  EXPECT_EQ(said["files"], Json({"out.png"}));
  EXPECT_EQ(said["bytes"], std::filesystem::file_size(folder_.file("out.png")));
  for (const char* key : {"read", "build", "trace"}) EXPECT_GE(said["seconds"][key], 0.0);
  EXPECT_EQ(said["warnings"], Json::array());
  const auto image = read_png(folder_.file("out.png"));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->width, 64);
  EXPECT_EQ(image->height, 48);
  const ToolRun text = run("render tiny.vox -o out.png");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("Image: 1280 x 720, "), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("\nFaces: 18 visible of 24 total\n"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("\nWrote out.png, "), std::string::npos) << text.out;
}

TEST_F(ToolRender, WritesSameBytesAtAnyThreadCount) {
  const std::string flags = " --size 80x60 --samples 3 --ao-rays 12 --depth ";
  drawn("tiny.vox -o a.png --threads 1" + flags + "a.pfm");
  drawn("tiny.vox -o b.png --threads 7" + flags + "b.pfm");
  drawn("tiny.vox -o c.png" + flags + "c.pfm");
  EXPECT_FALSE(bytes("a.png").empty());
  EXPECT_EQ(bytes("a.png"), bytes("b.png"));
  EXPECT_EQ(bytes("a.png"), bytes("c.png"));
  EXPECT_EQ(bytes("a.pfm"), bytes("b.pfm"));
  EXPECT_EQ(bytes("a.pfm"), bytes("c.pfm"));
}

TEST_F(ToolRender, DepthIsDistanceAlongRay) {
  write_one_voxel();
  const DBox box = [&] {
    const Json info = Json::parse(run("info one.vox --json").out);
    return DBox{triple(info["bounds"]["min"]), triple(info["bounds"]["max"])};
  }();
  const DVec3 middle = 0.5 * (box.min + box.max);
  const std::string x = std::to_string(middle.x);
  const std::string y = std::to_string(middle.y);
  const std::string camera = " --camera " + x + "," + y + "," + std::to_string(box.max.z + 2.0);
  const std::string target = " --look-at " + x + "," + y + "," + std::to_string(middle.z);
  const Json said = drawn("one.vox -o out.png --depth out.pfm --size 31x21 --fov 60" + camera + target);
  EXPECT_EQ(said["files"], Json({"out.png", "out.pfm"}));
  const auto depth = read_pfm(folder_.file("out.pfm"));
  ASSERT_TRUE(depth);
  ASSERT_EQ(depth->width, 31);
  ASSERT_EQ(depth->height, 21);
  const double half = std::tan(std::acos(-1.0) / 6.0);
  int hit = 0;
  for (int row = 0; row < 21; ++row) {
    for (int column = 0; column < 31; ++column) {
      const double right = ((column + 0.5) / 31 * 2 - 1) * half * 31 / 21;
      const double up = (1 - (row + 0.5) / 21 * 2) * half;
      const float value = depth->values[static_cast<std::size_t>(row * 31 + column)];
      // The front face lies 2 in front of the camera.
      if (std::abs(2 * right) < 0.5 && std::abs(2 * up) < 0.5) {
        EXPECT_NEAR(value, 2 * std::sqrt(1 + right * right + up * up), 1e-5);
        ++hit;
      } else {
        EXPECT_EQ(value, std::numeric_limits<float>::infinity());
      }
    }
  }
  EXPECT_GT(hit, 20);
  EXPECT_EQ(said["pixels_hit"], hit);
}

TEST_F(ToolRender, SelectsFileCameraByNumber) {
  vox_test::FileBuilder file;
  file.model(4, 4, 4, {{0, 0, 0, 1}, {3, 0, 0, 2}, {0, 3, 3, 3}});
  for (const std::int32_t number : {0, 2, 5}) {
    file.with("rCAM", [&](auto& out) {
      out.i32(number);
      out.dict({{"_angle", number == 0 ? "0 0 0" : "-20 " + std::to_string(10 * number) + " 0"},
                {"_radius", number == 0 ? "0" : "12"},
                {"_focus", number == 0 ? "0 0 0" : "0 0 2"}});
    });
  }
  ASSERT_TRUE(write_file(file.file(), folder_.file("seen.vox")));
  const Json listed = Json::parse(run("info seen.vox --json").out)["cameras"];
  ASSERT_EQ(listed.size(), 2U) << "the first was never set";
  EXPECT_EQ(listed[0]["number"], 2);
  EXPECT_EQ(listed[1]["number"], 5);
  EXPECT_NE(run("info seen.vox").out.find("Camera 5: at "), std::string::npos);
  const std::string size = "seen.vox -o out.png --size 40x30 --samples 1 --camera ";
  const Json camera = drawn(size + "file:5")["camera"];
  EXPECT_EQ(camera["position"], listed[1]["position"]);
  EXPECT_GT(triple(camera["position"]).y, 2.0) << "above its focus, since it looks down";
  EXPECT_GT(triple(camera["position"]).x, 1.0) << "to the right, since it is turned to the left";
  const std::string second = bytes("out.png");
  drawn(size + "file:2");
  EXPECT_NE(bytes("out.png"), second);
  for (const std::string number : {"0", "1", "2147483647"}) {
    const ToolRun none = run("render " + size + "file:" + number);
    EXPECT_EQ(none.status, 1);
    expect_one_error_line(none);
    EXPECT_NE(none.err.find("the file has cameras 2, 5"), std::string::npos) << none.err;
  }
  EXPECT_NE(run("render tiny.vox -o out.png --camera file:0").err.find("no saved cameras"), std::string::npos);
  for (const std::string wrong : {"file:", "file:-1", "file:x", "file:2147483648", "file:2 --look-at 0,0,0",
                                  "file:2 --fov 30", "file:2 --view front"}) {
    const ToolRun refused = run("render " + size + wrong);
    EXPECT_EQ(refused.status, 2) << wrong;
    expect_one_error_line(refused);
  }
}

TEST_F(ToolRender, AcceptsNegativeNumbersAsValues) {
  const std::string size = "tiny.vox -o out.png --size 8x8 ";
  const Json camera = drawn(size + "--camera -3,5,2 --look-at -.5,-1e0,-0 --sun -1,.5,0")["camera"];
  EXPECT_EQ(triple(camera["position"]), DVec3(-3, 5, 2));
  const Json again = drawn(size + "--camera=-3,5,2 --look-at=-0.5,-1,0 --sun=-1,0.5,0")["camera"];
  EXPECT_EQ(camera, again);
  EXPECT_EQ(drawn(size + "--camera -.25,5,2 --look-at 0,0,0")["camera"]["position"][0], -0.25);
  EXPECT_EQ(camera["fov"], 45.0);
}

TEST_F(ToolRender, OptionsChangeTheImage) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(8);
  const std::string base = "many.vox -o out.png --size 64x48";
  drawn(base);
  const std::string plain = bytes("out.png");
  for (const std::string flags : {"--view front",
                                  "--view top",
                                  "--sun=-1,1,0",
                                  "--preset no-shadows",
                                  "--preset no-ao",
                                  "--preset unlit",
                                  "--preset ao",
                                  "--preset unlit --ao vertex",
                                  "--ao-distance 0.4",
                                  "--shadow-distance 0.4",
                                  "--ao vertex",
                                  "--ao-rays 6",
                                  "--ao-affects all",
                                  "--exposure 0.5",
                                  "--samples 1",
                                  "--light propagated",
                                  "--sun 1,-0.1,0",
                                  "--sun 1,-0.1,0 --fixed-sky",
                                  "--camera 30,30,30 --look-at 0,0,0",
                                  "--camera 30,30,30 --look-at 0,0,0 --fov 20"}) {
    drawn(base + " " + flags);
    EXPECT_NE(bytes("out.png"), plain) << flags;
  }
  drawn(base + " --preset unlit");
  const std::string unlit = bytes("out.png");
  for (const std::string flags : {"--ao vertex", "--ao rays", "--ao rays --ao-distance 0.4"}) {
    drawn(base + " --preset unlit " + flags);
    EXPECT_NE(bytes("out.png"), unlit) << flags;
  }
  const std::string propagated = base + " --light propagated";
  drawn(propagated);
  const std::string levels = bytes("out.png");
  for (const std::string flags : {"--ao vertex", "--preset no-ao", "--least-light 0.3", "--sun 1,-0.1,0",
                                  "--sky-brightness 2", "--exposure 0.5"}) {
    drawn(propagated + " " + flags);
    EXPECT_NE(bytes("out.png"), levels) << flags;
  }
  drawn(propagated + " --least-light 0 --preset full");
  EXPECT_EQ(bytes("out.png"), levels) << "these are the defaults";
  drawn(base +
        " --preset full --ao rays --ao-rays 9 --ao-distance 6 --ao-affects ambient --exposure 1 --samples 4 --view iso "
        "--sun=-0.48,0.72,0.5 --lamps 64 --light rays");
  EXPECT_EQ(bytes("out.png"), plain) << "these are the defaults";
}

TEST_F(ToolRender, PathTracingOptionsChangeTheImage) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(8);
  const std::string base = "many.vox -o out.png --size 64x48 --light path --samples 4";
  drawn(base);
  const std::string plain = bytes("out.png");
  for (const std::string flags : {"--bounces 1",        "--sky physical",
                                  "--sky uniform",      "--tone clamp",
                                  "--tone agx",         "--tone aces",
                                  "--sun-angle 20",     "--ground",
                                  "--transparent",      "--ground --transparent",
                                  "--lens-radius 1",    "--lens-radius 1 --focus 5",
                                  "--exposure auto",    "--exposure 0.5",
                                  "--sun=-1,1,0",       "--sun off",
                                  "--sky-brightness 2", "--fog 0.1",
                                  "--fog 0.1,4",        "--fog 0.1 --fog-colour 1,0,0",
                                  "--bloom 0.5",        "--vignette 0.5",
                                  "--denoise",          "--sun-time 12-21,15,50"}) {
    drawn(base + " " + flags);
    EXPECT_NE(bytes("out.png"), plain) << flags;
  }
  drawn(base +
        " --bounces 8 --sky gradient --tone neutral --sun-angle 0.53 --exposure 1.3 --emission-scale 1 --look file "
        "--no-ground --bloom 0 --vignette 0 --fog 0");
  EXPECT_EQ(bytes("out.png"), plain) << "these are the defaults";
}

TEST_F(ToolRender, PathTracedImagesHaveBrightBackground) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(4);
  const auto corners = [&](const std::string& flags) {
    drawn("many.vox -o out.png --size 32x24 --light path --samples 4 " + flags);
    const auto image = read_png(folder_.file("out.png"));
    EXPECT_TRUE(image.has_value());
    if (!image) return std::array{0, 0};
    const std::size_t last = image->rgb.size() - 3;
    return std::array{int{*std::min_element(image->rgb.begin(), image->rgb.begin() + 3)},
                      int{*std::min_element(image->rgb.begin() + static_cast<std::ptrdiff_t>(last), image->rgb.end())}};
  };
  for (const int corner : corners("")) EXPECT_GE(corner, 150);
  for (const int corner : corners("--sky physical")) EXPECT_GE(corner, 150);
  for (const int corner : corners("--sky uniform")) EXPECT_GE(corner, 250);
  for (const int corner : corners("--sky uniform --ground")) EXPECT_GE(corner, 250);
  // Exposure rises at night, also if --sun-time places the sun.
  const std::string midnight = "--sun-time 12-21,0,48";
  EXPECT_GT(corners(midnight)[0], corners(midnight + " --exposure 1.3")[0] + 10);
}

// A cave is wider than rooms of blocks. A distance set by an option applies to fields too.
TEST_F(ToolRender, OcclusionShapesCaveOfField) {
  ASSERT_EQ(run("generate smooth-terrain s.json --chunks 3x2x3").status, 0);
  const auto image = [&](const std::string& flags) {
    drawn("s.json -o out.png --size 64x48 --camera 98,35,161 --look-at 100.8,41.2,142.2 --fov 80 --exposure 3 " +
          flags);
    const auto read = read_png(folder_.file("out.png"));
    return read ? read->rgb : std::vector<std::uint8_t>(3 * 64 * 48);
  };
  const std::vector<std::uint8_t> open = image("--preset no-ao");
  // Returns the mean and the standard deviation of the rock that no sunlight reaches, which has one colour in `open`.
  const auto rock = [&open](const std::vector<std::uint8_t>& rgb) {
    double sum = 0.0;
    double squares = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < rgb.size(); i += 3) {
      if (std::abs(open[i] - 72) > 1 || std::abs(open[i + 1] - 72) > 1) continue;
      sum += rgb[i + 1];
      squares += rgb[i + 1] * rgb[i + 1];
      count += 1.0;
    }
    EXPECT_GT(count, 2800.0);
    const double mean = sum / std::max(count, 1.0);
    return std::array{mean, std::sqrt(squares / std::max(count, 1.0) - mean * mean)};
  };
  const auto plain = rock(image(""));
  EXPECT_GE(plain[1], 15.0);
  EXPECT_LE(plain[0], rock(open)[0]);
  EXPECT_LT(rock(open)[1], 1.0) << "it is not the sun's light that varies";
  EXPECT_LT(rock(image("--ao-distance 18 --ao-rays 9"))[0], plain[0] - 3.0);
  EXPECT_GT(rock(image("--ao-distance 6"))[0], plain[0] + 10.0);
}

// Long rays from open slopes of fields also meet the ground.
TEST_F(ToolRender, LongOcclusionRaysKeepOpenSlopesOfField) {
  ASSERT_EQ(run("generate smooth-terrain s.json --chunks 3x2x3").status, 0);
  const auto image = [&](const std::string& flags) {
    drawn("s.json -o out.png --size 96x72 " + flags);
    const auto read = read_png(folder_.file("out.png"));
    return read ? read->rgb : std::vector<std::uint8_t>();
  };
  const std::vector<std::uint8_t> longer = image("");
  const std::vector<std::uint8_t> shorter = image("--ao-distance 6");
  ASSERT_EQ(longer.size(), shorter.size());
  ASSERT_FALSE(longer.empty());
  std::size_t changed = 0;
  for (std::size_t i = 0; i < longer.size(); i += 3) {
    int most = 0;
    for (std::size_t k = i; k < i + 3; ++k) most = std::max(most, std::abs(longer[k] - shorter[k]));
    changed += most > 4;
  }
  EXPECT_LE(static_cast<double>(changed), 0.03 * static_cast<double>(longer.size() / 3));
}

TEST_F(ToolRender, FileSettingsApplyWithoutOptions) {
  vox_test::FileBuilder file;
  file.model(4, 4, 4, {{0, 0, 0, 1}, {3, 0, 0, 2}, {0, 3, 3, 3}});
  file.with("rOBJ", [&](auto& out) { out.dict({{"_type", "_env"}, {"_mode", "0"}}); });
  file.with("rOBJ", [&](auto& out) { out.dict({{"_type", "_uni"}, {"_i", "0.5"}, {"_k", "255 0 0"}}); });
  file.with("rOBJ", [&](auto& out) { out.dict({{"_type", "_film"}, {"_aces", "0"}}); });
  file.with("rOBJ", [&](auto& out) { out.dict({{"_type", "_setting"}, {"_grid", "1"}}); });
  ASSERT_TRUE(write_file(file.file(), folder_.file("look.vox")));
  const std::string base = "look.vox -o out.png --size 32x24 --light path --samples 1";
  const auto corner = [&] {
    const auto image = read_png(folder_.file("out.png"));
    return image ? std::array{int{image->rgb[0]}, int{image->rgb[1]}, int{image->rgb[2]}} : std::array{-1, -1, -1};
  };
  const Json said = drawn(base);
  EXPECT_EQ(corner(), (std::array{188, 0, 0})) << "the file's sky";
  EXPECT_EQ(said["warnings"], Json({"unsupported render settings of the file: _setting _grid 1"}));
  drawn(base + " --sky-brightness 1");
  EXPECT_EQ(corner(), (std::array{255, 0, 0}));
  drawn(base + " --sky uniform --tone clamp");
  EXPECT_EQ(corner(), (std::array{255, 255, 255})) << "another sky has nothing of the file's";
  EXPECT_EQ(drawn(base + " --look plain")["warnings"], Json::array());
  EXPECT_NE(corner()[2], 0);

  file.with("rOBJ", [&](auto& out) { out.dict({{"_type", "_env"}, {"_mode", "2"}}); });
  file.with("rOBJ", [&](auto& out) { out.dict({{"_type", "_ibl"}, {"_path", "C:\\hdr\\green.hdr"}, {"_i", "1"}}); });
  ASSERT_TRUE(write_file(file.file(), folder_.file("look.vox")));
  EXPECT_NE(drawn(base)["warnings"].dump().find("uniform sky instead of the file's sky"), std::string::npos);
  std::ofstream(folder_.file("green.hdr"), std::ios::binary) << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n"
                                                             << std::string("\0\x80\0\x80", 4);
  drawn(base);
  EXPECT_EQ(corner()[0], 0);
  EXPECT_GT(corner()[1], 150);
}

TEST_F(ToolRender, UsesInitialCameraOfSceneFileByDefault) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(2);
  std::ofstream(folder_.file("scene.json")) << R"({"quoin_scene": 1, "files": [{"id": "a", "path": "many.vox"}],
      "instances": [{"file": "a"}], "camera": {"position": [9, 8, 7], "look_at": [0, 0, 0]}})";
  const std::string base = "scene.json -o out.png --size 9x9 --samples 1";
  EXPECT_EQ(triple(drawn(base)["camera"]["position"]), DVec3(9, 8, 7));
  EXPECT_EQ(triple(drawn(base + " --camera 1,2,3 --look-at 0,0,0")["camera"]["position"]), DVec3(1, 2, 3));
  EXPECT_EQ(drawn(base + " --view iso")["camera"], drawn("many.vox -o out.png --size 9x9 --samples 1")["camera"]);
  EXPECT_NE(triple(drawn(base + " --azimuth 45")["camera"]["position"]), DVec3(9, 8, 7));
}

TEST_F(ToolRender, ShowsSkyImageOfSceneFile) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(2);
  std::ofstream(folder_.file("green.hdr"), std::ios::binary) << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n"
                                                             << std::string("\0\x80\0\x80", 4);
  std::ofstream(folder_.file("scene.json")) << R"({"quoin_scene": 6, "files": [{"id": "a", "path": "many.vox"}],
      "instances": [{"file": "a"}], "environment": {"sky": {"model": "image", "image": "green.hdr"}}})";
  const std::string base = "scene.json -o out.png --size 32x24 --light path --samples 1";
  EXPECT_EQ(drawn(base)["warnings"], Json::array());
  const auto image = read_png(folder_.file("out.png"));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->rgb[0], 0);
  EXPECT_GT(image->rgb[1], 150);
  std::filesystem::remove(folder_.file("green.hdr"));
  const Json warnings = drawn(base)["warnings"];
  ASSERT_EQ(warnings.size(), 1U) << warnings;
  EXPECT_NE(warnings[0].dump().find("the image of the sky"), std::string::npos) << warnings;
  for (const char* unused : {"--light path --sky uniform", "--light path --look plain", "--light rays"}) {
    const std::string options = std::string("scene.json -o out.png --size 32x24 --samples 1 ") + unused;
    EXPECT_EQ(drawn(options)["warnings"], Json::array()) << unused;
  }
  EXPECT_EQ(Json::parse(run("info scene.json --json").out)["warnings"], Json::array());
}

TEST_F(ToolRender, WritesVideos) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(2);
  for (const std::string wrong :
       {"-o film.mp4", "-o film.mp4 --turntable 2 --light path --transparent", "-o film.png --turntable 2 --fps 12",
        "-o film.webm --turntable 2 --fps 0", "-o film.avi --turntable 2"}) {
    EXPECT_EQ(run("render many.vox " + wrong).status, 2) << wrong;
  }
  const std::string film = "render many.vox -o film.mp4 --size 31x21 --turntable 3 --json";
  const ToolRun without = shell("PATH=/nowhere '" QUOIN_TOOL "' " + film);
  EXPECT_EQ(without.status, 1);
  EXPECT_NE(without.err.find("ffmpeg is not installed"), std::string::npos) << without.err;
  if (std::system("ffmpeg -version > /dev/null 2>&1") != 0) GTEST_SKIP() << "ffmpeg is not installed";
  const ToolRun made = run(film);
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(Json::parse(made.out)["files"], Json({"film.mp4"}));
  EXPECT_EQ(bytes("film.mp4").substr(4, 4), "ftyp");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("film.mp4.images")));
  // An interrupted film continues from its existing frames.
  std::filesystem::create_directory(folder_.file("film.mp4.images"));
  drawn("many.vox -o film.mp4.images/image.png --size 31x21 --turntable 3");
  std::filesystem::remove(folder_.file("film.mp4.images/image-02.png"));
  EXPECT_EQ(Json::parse(run(film + " --resume").out)["kept"], 2);
  EXPECT_EQ(run("render many.vox -o film.webm --size 32x24 --turntable 2 --fps 10").status, 0);
  EXPECT_EQ(bytes("film.webm").substr(0, 4), "\x1A\x45\xDF\xA3");
}

TEST_F(ToolRender, PathTracingReadsSkyFileAndWritesLinearLight) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(8);
  std::ofstream(folder_.file("red.hdr"), std::ios::binary) << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n"
                                                           << std::string("\x80\x00\x00\x81", 4);
  drawn("many.vox -o red.png --size 32x24 --light path --samples 2 --sky red.hdr --sun off --tone clamp");
  const auto red = read_png(folder_.file("red.png"));
  ASSERT_TRUE(red.has_value());
  EXPECT_GT(red->rgb[0], 250);
  EXPECT_LT(red->rgb[1], 30);
  EXPECT_EQ(run("render many.vox -o x.png --light path --sky none.hdr").status, 1);
  EXPECT_EQ(run("render many.vox -o x.png --light path --sky none.jpg").status, 2);
  if (!has_exr()) GTEST_SKIP() << "built without OpenEXR";
  drawn("many.vox -o out.exr --size 32x24 --light path --samples 2 --sky red.hdr --sun off");
  const auto light = read_radiance(folder_.file("out.exr"));
  ASSERT_TRUE(light.has_value());
  EXPECT_NEAR(light->rgb[0], 128.5F / 128, 1e-3F);
  drawn("many.vox -o again.png --size 32x24 --light path --samples 2 --sky out.exr --sky-turn 90");
}

TEST_F(ToolRender, SelectsImageFormatByExtension) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(4);
  if (has_jpeg()) {
    drawn("many.vox -o out.JPG --size 64x48");
    EXPECT_EQ(bytes("out.JPG").substr(0, 3), "\xFF\xD8\xFF");
    EXPECT_EQ(run("render many.vox -o out.jpg --light path --transparent").status, 2) << "it has no alpha";
  }
  if (has_webp()) {
    drawn("many.vox -o out.webp --size 64x48");
    EXPECT_EQ(bytes("out.webp").substr(8, 4), "WEBP");
    drawn("many.vox -o clear.webp --size 64x48 --light path --samples 1 --transparent");
    EXPECT_NE(bytes("clear.webp"), bytes("out.webp"));
  }
  if (!has_jpeg() || !has_webp()) GTEST_SKIP() << "built without libjpeg or libwebp";
}

TEST_F(ToolRender, PathTracingRejectsOtherOptions) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(2);
  for (const std::string flags : {"--light path --lamps 4",
                                  "--light path --preset ao",
                                  "--light path --detail pixels",
                                  "--bounces 4",
                                  "--transparent",
                                  "--exposure auto",
                                  "--light path --bounces -1",
                                  "--light path --sky-turn 4",
                                  "--light path --sun-angle 171",
                                  "--light path --lens-radius nan",
                                  "--fog 0.1",
                                  "--denoise",
                                  "--light path --fog -1",
                                  "--light path --fog 1,2,3",
                                  "--light path --fog-colour 1,1,1",
                                  "--light path --fog 1 --fog-colour 1,1,2",
                                  "--light path --bloom 2",
                                  "--light path --bloom 0.1,0.1,-1",
                                  "--light path --vignette 1.1",
                                  "--light path --look mine",
                                  "--light path --sun-time 13-01,12,0",
                                  "--light path --sun-time 02-30,12,0",
                                  "--light path --sun-time 06-21,25,0",
                                  "--light path --sun-time 06-21",
                                  "--light path --sun-time 06-21,12,0 --sun 0,1,0"}) {
    EXPECT_EQ(run("render many.vox -o out.png " + flags).status, 2) << flags;
  }
  EXPECT_EQ(run("render many.vox -o out.exr").status, 2);
}

TEST_F(ToolRender, ResumesSeriesAlongCameraPath) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(4);
  const Json said = drawn("many.vox -o one.png --size 64x48 --camera 12,10,14 --look-at 2,2,-2 --fov 40");
  std::ofstream(folder_.file("path.json"))
      << Json({said["camera"],
               {{"position", {12, 10, 14}}, {"look_at", {2, 2, -2}}, {"fov", 40}},
               {{"position", {0, 30, 0}}, {"forward", {0, -1, 0}}, {"up", {1, 0, 0}}, {"view_height", 12}}});
  const Json film = drawn("many.vox -o film.png --size 64x48 --path path.json");
  EXPECT_EQ(film["files"], Json({"film-00.png", "film-01.png", "film-02.png"}));
  EXPECT_EQ(bytes("film-00.png"), bytes("one.png"));
  EXPECT_EQ(bytes("film-01.png"), bytes("one.png"));
  EXPECT_NE(bytes("film-02.png"), bytes("one.png"));
  const std::string last = bytes("film-02.png");
  std::filesystem::remove(folder_.file("film-02.png"));
  std::ofstream(folder_.file("film-00.png")) << "as it was";
  const Json rest = drawn("many.vox -o film.png --size 64x48 --path path.json --resume");
  EXPECT_EQ(rest["files"], Json({"film-02.png"}));
  EXPECT_EQ(rest["kept"], 2);
  EXPECT_EQ(bytes("film-00.png"), "as it was");
  EXPECT_EQ(bytes("film-02.png"), last);
  EXPECT_EQ(drawn("many.vox -o film.png --size 64x48 --path path.json --resume")["files"], Json::array());
  // Existing frames do not change the exposure of the remaining frames.
  const std::string turns = "many.vox -o turn.png --size 32x24 --turntable 3 --light path --samples 1 --exposure auto";
  drawn(turns);
  const std::string third = bytes("turn-02.png");
  std::filesystem::remove(folder_.file("turn-02.png"));
  EXPECT_EQ(drawn(turns + " --resume")["kept"], 1);
  EXPECT_EQ(bytes("turn-02.png"), third);
}

TEST_F(ToolRender, ReportsInvalidCameraPaths) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(2);
  for (const std::string text :
       {"", "{}", "[]", "[1]", "[{}]", R"([{"position":[1,2,3]}])", R"([{"position":[1,2,3],"look_at":[1,2,3]}])",
        R"([{"position":[1,2,3],"forward":[0,0,1],"look_at":[0,0,0]}])", R"([{"position":[1,2],"forward":[0,0,1]}])",
        R"([{"position":[1,2,3],"forward":[0,0,1],"fov":180}])",
        R"([{"position":[1,2,3],"forward":[0,0,1],"fov":"wide"}])",
        R"([{"position":[1,2,3],"forward":[0,0,1],"up":[0,0,1]}])",
        R"([{"position":[1,2,3],"forward":[0,0,1],"view_height":0}])",
        R"([{"position":[1,2,3],"forward":[0,0,1],"zoom":1}])"}) {
    std::ofstream(folder_.file("path.json")) << text;
    const ToolRun result = run("render many.vox -o film.png --path path.json");
    EXPECT_EQ(result.status, 1) << text;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << text << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder_.file("film-00.png")));
  }
  EXPECT_EQ(run("render many.vox -o film.png --path none.json").status, 1);
  EXPECT_EQ(run("render many.vox -o film.png --path path.json --view top").status, 2);
  EXPECT_EQ(run("render many.vox -o film.png --resume").status, 2);
}

TEST_F(ToolRender, ThumbnailsAreSmallWithTransparentBackground) {
  std::ofstream(folder_.file("many.vox"), std::ios::binary) << checkerboard_vox(8);
  const auto made = run("thumbnail many.vox small.png --size 40 --json");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(Json::parse(made.out)["size"], Json({40, 40}));
  const std::string file = bytes("small.png");
  const auto image = decode_png(std::as_bytes(std::span(file)));
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(image->width, 40U);
  EXPECT_EQ(image->pixels[3], 0) << "a corner";
  EXPECT_EQ(image->pixels[4 * (20 * 40 + 20) + 3], 255) << "the middle";
  EXPECT_EQ(run("thumbnail many.vox small.jpg").status, 2);
  EXPECT_EQ(run("thumbnail many.vox many.vox").status, 2);
  EXPECT_EQ(run("thumbnail none.vox small.png").status, 1);
  EXPECT_EQ(run("thumbnail many.vox small.png --size 0").status, 2);
}

TEST_F(ToolRender, FieldsShowDensitiesAndMeshOcclusion) {
  ASSERT_EQ(run("generate smooth-terrain hills.json --chunks 2x1x2").status, 0);
  const std::string base = "hills.json -o out.png --size 64x48 --preset ";
  const auto image = [&](const std::string& flags) {
    drawn(base + flags);
    return bytes("out.png");
  };
  const std::string smooth = image("ao --ao smooth");
  EXPECT_NE(smooth, image("ao"));
  EXPECT_EQ(smooth, image("ao --ao smooth --ao-form soft-share --ao-spread 2"));
  for (const std::string flags : {"--ao-form none", "--ao-form share", "--ao-spread 4", "--ao-form weighted",
                                  "--ao-form weighted-published --ao-offset 0.2", "--ao-form weighted --ao-power 5"}) {
    EXPECT_NE(image("ao --ao smooth " + flags), smooth) << flags;
  }
  EXPECT_NE(image("full --ao smooth"), image("full"));
  const std::string middle = image("density");
  EXPECT_EQ(image("density --slice y:0.5 --threads 2"), middle);
  EXPECT_NE(image("density --slice y:0.9"), middle);
  EXPECT_NE(image("density --slice x:0.5"), image("density --slice z:0.5"));
  const Json said = drawn(base + "density --slice z:0.25");
  EXPECT_EQ(said["camera"], nullptr);
  EXPECT_EQ(said["slice"]["axis"], "z");
  EXPECT_GT(said["pixels_hit"], 100);
  const ToolRun blocks = run("render tiny.vox -o out2.png --preset density");
  EXPECT_EQ(blocks.status, 1);
  expect_one_error_line(blocks);
  EXPECT_FALSE(exists("out2.png"));
}

TEST_F(ToolRender, WarnsIfImageShowsOnlySky) {
  std::ofstream(folder_.file("none.vox"), std::ios::binary) << vox_file({1, 1, 1}, "");
  EXPECT_EQ(drawn("none.vox -o a.png --size 9x9")["warnings"], Json({"nothing visible; the image shows only sky"}));
  EXPECT_TRUE(exists("a.png"));
  EXPECT_EQ(drawn("tiny.vox -o b.png --size 9x9 --camera 0,90,0 --look-at 0,99,0")["warnings"],
            Json({"no voxel is in view of this camera; the image shows only sky"}));
}

TEST_F(ToolRender, DrawsHiddenInstancesOnlyOnRequest) {
  std::ofstream(folder_.file("one.vox"), std::ios::binary) << vox_with_hidden(1);
  std::ofstream(folder_.file("both.vox"), std::ios::binary) << vox_with_hidden(0);
  const Json without = drawn("one.vox -o one.png --size 64x48");
  EXPECT_EQ(without["warnings"], Json({"1 hidden instance left out; --hidden includes it"}));
  const Json with = drawn("one.vox -o hidden.png --size 64x48 --hidden");
  EXPECT_EQ(with["warnings"], Json::array());
  EXPECT_NE(with["camera"], without["camera"]);
  drawn("both.vox -o both.png --size 64x48");
  EXPECT_EQ(bytes("hidden.png"), bytes("both.png"));
}

TEST_F(ToolRender, ReportsWrongUsageInOneLine) {
  std::ofstream(folder_.file("vox.png"), std::ios::binary) << tiny_vox();
  std::filesystem::create_hard_link(folder_.file("tiny.vox"), folder_.file("link.png"));
  std::filesystem::create_hard_link(folder_.file("tiny.vox"), folder_.file("link.pfm"));
  std::filesystem::create_symlink("out.png", folder_.file("ahead.pfm"));
  const std::string out = "tiny.vox -o out.png ";
  const std::vector<std::pair<std::string, std::string>> errors = {
      {"tiny.vox", "-o OUT is required"},
      {"tiny.vox -o out.gif", "-o: the image name must end in .png, .jpg, .webp or .exr, not \"out.gif\""},
      {"tiny.vox -o ''", "--output: must be a file name"},
      {"tiny.vox -o", "--output needs a value: FILE (try --help)"},
      {out + "--samples", "--samples needs a value: N (try --help)"},
      {out + "--view", "--view needs a value: NAME (try --help)"},
      {"vox.png -o vox.png", "-o: vox.png is the input"},
      {"tiny.vox -o link.png", "-o: link.png is the input"},
      {out + "--depth link.pfm", "--depth: link.pfm is the input"},
      {out + "--depth ahead.pfm", "--depth: ahead.pfm is the same file as -o"},
      {out + "--depth depth.png", "--depth: the name must end in .pfm"},
      {out + "--size 0x9", "--size: must be"},
      {out + "--size 9x-9", "--size: must be"},
      {out + "--size 9", "--size: must be"},
      {out + "--size 9x9x9", "--size: must be"},
      {out + "--size 9.5x9", "--size: must be"},
      {out + "--size 99999999999x1", "--size: must be"},
      {out + "--size 1000001x1", "--size: must be WIDTHxHEIGHT of at most 2^28 pixels and 1000000 per side"},
      {out + "--size 1x1000001", "--size: must be"},
      {out + "--size 40000x25000", "--size: must be WIDTHxHEIGHT of at most 2^28 pixels"},
      {out + "--view side", "--view: "},
      {out + "--camera 1,2,3", "--camera needs --look-at"},
      {out + "--look-at 1,2,3", "--look-at needs --camera"},
      {out + "--fov 30", "--fov needs --camera"},
      {out + "--view top --camera 1,2,3 --look-at 0,0,0", "--view and --camera cannot be used together"},
      {out + "--camera 1,2 --look-at 0,0,0", "--camera: must be three numbers"},
      {out + "--camera 1,2,3x --look-at 0,0,0", "--camera: must be three numbers"},
      {out + "--camera 1,2,3,4 --look-at 0,0,0", "--camera: must be three numbers"},
      {out + "--camera 1,,3 --look-at 0,0,0", "--camera: must be three numbers"},
      {out + "--camera nan,2,3 --look-at 0,0,0", "--camera: must be three numbers"},
      {out + "--camera 1,2,3 --look-at inf,0,0", "--look-at: must be three numbers"},
      {out + "--camera 1,2,3 --look-at 1e999,0,0", "--look-at: must be three numbers"},
      {out + "--camera 1,2,3 --look-at 1,2,3", "camera: position and target must differ"},
      {out + "--camera 1,2,3 --look-at 0,0,0 --fov 0", "--fov: must be more than 0 and less than 180, not \"0\""},
      {out + "--camera 1,2,3 --look-at 0,0,0 --fov 180", "--fov: must be"},
      {out + "--camera 1,2,3 --look-at 0,0,0 --fov nan", "--fov: must be"},
      {out + "--sun 0,0,0", "--sun: must be three numbers that are not all 0"},
      {out + "--sun 1,2", "--sun: must be three numbers"},
      {out + "--sun nan,1,1", "--sun: must be three numbers"},
      {out + "--preset dark", "--preset: "},
      {out + "--ao none", "--ao: "},
      {out + "--ao-rays 0", "--ao-rays: "},
      {out + "--ao-rays 5000", "--ao-rays: "},
      {out + "--ao vertex --ao-rays 9", "--ao-rays needs --ao rays"},
      {out + "--preset no-ao --ao rays", "--ao: the preset no-ao has no ambient occlusion"},
      {out + "--preset unlit --ao-affects all", "--ao-affects: the preset unlit has no ambient occlusion without --ao"},
      {out + "--preset unlit --ao rays --ao-affects all", "--ao-affects: the preset unlit has no light"},
      {out + "--preset ao --ao-affects all", "--ao-affects: the preset ao has no light"},
      {out + "--ao vertex --ao-distance 3", "--ao-distance needs --ao rays"},
      {out + "--ao-distance -1", "--ao-distance: must be a number of at least 0"},
      {out + "--preset ao --shadow-distance 3", "--shadow-distance: the preset ao has no shadows"},
      {out + "--exposure -1", "--exposure: must be a number of at least 0"},
      {out + "--exposure 1e", "--exposure: must be"},
      {out + "--samples 0", "--samples: "},
      {out + "--samples 4097", "--samples: "},
      {out + "--samples 2.5", "--samples: "},
      {out + "--ao-form weighted", "--ao-form needs --ao smooth"},
      {out + "--ao smooth --ao-form deep", "--ao-form: must be none, soft-share, share, weighted or"},
      {out + "--ao smooth --ao-spread 5", "--ao-spread: must be 0.0625 to 4, not \"5\""},
      {out + "--ao smooth --ao-power 3", "--ao-power needs --ao-form weighted"},
      {out + "--ao smooth --backend vulkan", "--ao smooth and --backend vulkan cannot be used together"},
      {out + "--preset no-ao --ao-spread 1", "--ao-spread: the preset no-ao has no ambient occlusion"},
      {out + "--light baked", "--light: "},
      {out + "--least-light 0.1", "--least-light needs --light propagated"},
      {out + "--light propagated --least-light -1", "--least-light: must be a number of at least 0"},
      {out + "--light propagated --preset unlit", "--light propagated and --preset unlit cannot be used together"},
      {out + "--light propagated --preset no-shadows", "--light propagated and --preset no-shadows cannot be"},
      {out + "--light propagated --lamps 3", "--lamps and --light propagated cannot be used together"},
      {out + "--light propagated --shadow-distance 3", "--shadow-distance and --light propagated cannot be"},
      {out + "--preset density --light rays", "--light and --preset density cannot be used together"},
      {out + "--slice y:0.5", "--slice needs --preset density"},
      {out + "--preset density --slice y:2", "--slice: must be x, y or z, and a position from 0 to 1"},
      {out + "--preset density --slice w:0.5", "--slice: must be"},
      {out + "--preset density --slice 0.5", "--slice: must be"},
      {out + "--preset unlit --fixed-sky", "--fixed-sky: the preset unlit has no light"},
      {out + "--preset unlit --plain-glass", "--plain-glass: the preset unlit has no light"},
      {out + "--preset density --fixed-sky", "--fixed-sky and --preset density cannot be used together"},
      {out + "--preset density --samples 4", "--samples and --preset density cannot be used together"},
      {out + "--backend gpu", "--backend: "},
      {out + "--device 0", "--device needs --backend vulkan"},
      {out + "--backend vulkan --device ''", "--device: must be a number or a name"}};
  for (const auto& [arguments, error] : errors) {
    const ToolRun result = run("render " + arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    expect_one_error_line(result);
    EXPECT_TRUE(result.err.starts_with("quoin: " + error)) << arguments << ": " << result.err;
  }
  EXPECT_FALSE(exists("out.png"));
  EXPECT_EQ(bytes("tiny.vox"), tiny_vox());
}

TEST_F(ToolRender, SelectsDetailAndLodColours) {
  drawn("tiny.vox -o plain.png --size 64x48");
  drawn("tiny.vox -o near.png --size 64x48 --detail near");
  EXPECT_EQ(bytes("near.png"), bytes("plain.png")) << "near is the default";
  drawn("tiny.vox -o colours.png --size 64x48 --lod-colours");
  drawn("tiny.vox -o pixels.png --size 64x48 --lod-colours --detail pixels");
  EXPECT_EQ(bytes("colours.png"), bytes("pixels.png")) << "colours alone are those of pixels";
  drawn("tiny.vox -o green.png --size 64x48 --lod-colours --detail near");
  EXPECT_NE(bytes("green.png"), bytes("colours.png"));
  drawn("tiny.vox -o radius.png --size 64x48 --detail radius");
  EXPECT_EQ(run("render tiny.vox -o out.png --detail far").status, 2);
  EXPECT_FALSE(exists("out.png"));
}

TEST_F(ToolRender, ReportsFailuresInOneLineWithoutFile) {
  std::ofstream(folder_.file("broken.vox"), std::ios::binary) << tiny_vox().substr(0, 60);
  std::filesystem::create_directory(folder_.file("folder.png"));
  for (const std::string arguments : {"broken.vox -o out.png", "missing.vox -o out.png", "tiny.vox -o none/out.png",
                                      "tiny.vox -o folder.png", "tiny.vox -o out.png --depth none/out.pfm"}) {
    const ToolRun result = run("render " + arguments);
    EXPECT_EQ(result.status, 1) << arguments;
    expect_one_error_line(result);
    EXPECT_FALSE(exists("out.png")) << arguments;
  }
  EXPECT_EQ(shell("ls -A").out.find(".quoin-"), std::string::npos);
}

TEST_F(ToolRender, LeavesNoFileAfterSignal) {
  for (const auto& [signal, status] : {std::pair{"INT", 130}, {"TERM", 143}}) {
    // A non-interactive shell makes background jobs ignore SIGINT; env restores the default.
    const ToolRun result = shell("env --default-signal=INT '" QUOIN_TOOL
                                 "' render tiny.vox -o out.png --samples 4096 --depth out.pfm & sleep 0.4; kill -" +
                                 std::string(signal) + " $!; wait $!");
    EXPECT_EQ(result.status, status) << result.err;
    const std::string files = shell("ls -A").out;
    EXPECT_EQ(files.find(".quoin-"), std::string::npos) << files;
    EXPECT_FALSE(exists("out.png") || exists("out.pfm"));
  }
}

TEST_F(ToolRender, LeavesNoFileAtFileSizeLimit) {
  const ToolRun result =
      shell("ulimit -f 40; '" QUOIN_TOOL "' render tiny.vox -o out.png --size 320x200 --depth d.pfm");
  EXPECT_EQ(result.status, 1);
  expect_one_error_line(result);
  EXPECT_TRUE(result.err.starts_with("quoin: d.pfm: ")) << result.err;
  EXPECT_FALSE(exists("d.pfm"));
}

/// A separate suite, since drivers keep memory that sanitizers report as leaks.
class VulkanTool : public ToolRender {};

TEST_F(VulkanTool, MatchesCpuImage) {
  const auto devices = vulkan_devices();
  const ToolRun result = run("render tiny.vox -o device.png --size 160x120 --backend vulkan --json --depth d.pfm");
  if (!devices) {
    EXPECT_EQ(result.status, 1);
    EXPECT_EQ(result.err, "quoin: " + devices.error().message + "\n");
    GTEST_SKIP() << devices.error().message;
  }
  if (std::none_of(devices->begin(), devices->end(), [](const VulkanDeviceInfo& d) { return d.missing.empty(); })) {
    GTEST_SKIP() << devices->front().name << " lacks " << devices->front().missing;
  }
  ASSERT_EQ(result.status, 0) << result.err;
  const Json said = Json::parse(result.out);
  const Json cpu = drawn("tiny.vox -o cpu.png --size 160x120");
  EXPECT_EQ(said["backend"], "vulkan");
  EXPECT_EQ(said["pixels_hit"], cpu["pixels_hit"]);
  EXPECT_EQ(said["files"], Json({"device.png", "d.pfm"}));
  const Json named = drawn("tiny.vox -o named.png --size 160x120 --backend vulkan --device '" +
                           said["device"].get<std::string>() + "'");
  EXPECT_EQ(named["device"], said["device"]);
  EXPECT_EQ(bytes("named.png"), bytes("device.png"));
  const auto different = [&](const char* one, const char* other) {
    const Image a = read_png(folder_.file(one)).value();
    const Image b = read_png(folder_.file(other)).value();
    EXPECT_EQ(a.rgb.size(), b.rgb.size());
    int count = 0;
    for (std::size_t i = 0; i < a.rgb.size() && i < b.rgb.size(); ++i) count += std::abs(a.rgb[i] - b.rgb[i]) > 2;
    return count;
  };
  EXPECT_LE(different("device.png", "cpu.png"), 160 * 120 * 3 / 1000);
  static_cast<void>(drawn("tiny.vox -o levels.png --size 160x120 --light propagated"));
  static_cast<void>(drawn("tiny.vox -o device_levels.png --size 160x120 --light propagated --backend vulkan"));
  EXPECT_LE(different("device_levels.png", "levels.png"), 160 * 120 * 3 / 1000);
  EXPECT_GT(different("device_levels.png", "device.png"), 100);
  static_cast<void>(drawn("tiny.vox -o detail.png --size 160x120 --lod-colours --detail pixels"));
  static_cast<void>(drawn("tiny.vox -o far.png --size 160x120 --lod-colours --detail pixels --backend vulkan"));
  EXPECT_LE(different("far.png", "detail.png"), 160 * 120 * 3 / 1000);
  EXPECT_GT(different("far.png", "device.png"), 100) << "in the colours of its detail";
}

TEST_F(VulkanTool, ReportsMissingDevicesInOneLineWithoutFile) {
  for (const std::string device : {"999", "nobody"}) {
    const ToolRun result = run("render tiny.vox -o out.png --backend vulkan --device " + device);
    EXPECT_EQ(result.status, 1) << device;
    expect_one_error_line(result);
    EXPECT_TRUE(result.err.starts_with("quoin: vulkan: ")) << result.err;
    EXPECT_FALSE(exists("out.png"));
  }
}

TEST_F(ToolRender, HelpHasExample) {
  const ToolRun help = run("render --help");
  EXPECT_EQ(help.status, 0);
  EXPECT_NE(help.out.find("Example: quoin render"), std::string::npos) << help.out;
}

// All frames of a film share one framing: static objects keep their position.
TEST_F(ToolRender, FramesOfSeriesShareOneCamera) {
  vox_test::FileBuilder file;
  file.model(1, 1, 1, {{0, 0, 0, 1}});
  file.transform(0, 1, {{}}, {}, -1).group(1, {2, 4});
  file.transform(2, 3, {{{"_t", "0 0 0"}, {"_f", "0"}}, {{"_t", "40 0 0"}, {"_f", "10"}}}).shape(3, 0);
  file.transform(4, 5, {{}}).shape(5, 0);
  ASSERT_TRUE(write_file(file.file(), folder_.file("film.vox")));
  const ToolRun said = run("render film.vox -o film.png --frames 8:10 --size 64x48 --json");
  ASSERT_EQ(said.status, 0) << said.err;
  const Json object = Json::parse(said.out);
  EXPECT_EQ(object["files"], Json({"film-08.png", "film-09.png", "film-10.png"}));
  const Json one = Json::parse(run("render film.vox -o one.png --frame 8 --size 64x48 --json").out);
  EXPECT_NE(one["camera"], object["camera"]) << "alone it is closer";
  // The widest frame alone needs the film's camera.
  const Json widest = Json::parse(run("render film.vox -o ten.png --frame 10 --size 64x48 --json").out);
  for (const char* axis : {"position", "forward"}) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(widest["camera"][axis][i].get<double>(), object["camera"][axis][i].get<double>(), 1e-9) << axis;
    }
  }
  EXPECT_EQ(bytes("ten.png"), bytes("film-10.png"));
  EXPECT_EQ(run("render film.vox -o b.png --frames 5:12").status, 1) << "there is no frame 12";
  EXPECT_EQ(run("render film.vox -o b.png --frames 5:2").status, 2);
  EXPECT_EQ(run("render film.vox -o b.png --frames 0:1 --frame 0").status, 2);
}

TEST_F(ToolRender, RendersTurntablesAndViewsByAngle) {
  const ToolRun said = run("render tiny.vox -o round.png --turntable 12 --size 32x24 --elevation 10 --json");
  ASSERT_EQ(said.status, 0) << said.err;
  EXPECT_EQ(Json::parse(said.out)["files"].size(), 12U);
  EXPECT_EQ(Json::parse(said.out)["files"][11], "round-11.png");
  EXPECT_EQ(run("render tiny.vox -o round.png --turntable 1").status, 2);
  EXPECT_EQ(run("render tiny.vox -o b.png --turntable 4 --frames 0:0").status, 2);
  EXPECT_EQ(run("render tiny.vox -o b.png --azimuth 20 --view left").status, 2);
  EXPECT_EQ(run("render tiny.vox -o b.png --elevation 91").status, 2);
  // Named views equal the same directions given as angles.
  ASSERT_EQ(run("render tiny.vox -o right.png --view right --size 64x48").status, 0);
  ASSERT_EQ(run("render tiny.vox -o ninety.png --azimuth 90 --elevation 0 --size 64x48").status, 0);
  EXPECT_EQ(bytes("right.png"), bytes("ninety.png"));
}

}  // namespace

}  // namespace quoin

#include <gtest/gtest.h>

#include <filesystem>

#include <glm/matrix.hpp>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "io/volume/volume_for_tests.h"

namespace quoin {
namespace {

using volume_test::Bytes;
using volume_test::encode;
using volume_test::gzipped;
using volume_test::kTwelve;
using volume_test::kTwelveFloats;
using volume_test::position_of;

Bytes file_of(const std::string& header, const Bytes& data) {
  Bytes bytes;
  volume_test::append_text(bytes, header);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

/// Returns three times two times two bytes, with additional header lines.
Bytes tiny(const std::string& lines, const Bytes& data = encode(kTwelve, ScalarType::UInt8)) {
  return file_of("NRRD0004\n# a comment\ntype: uint8\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n" + lines + "\n",
                 data);
}

Volume volume_of(const Bytes& bytes) {
  const auto volume = read_volume(bytes);
  EXPECT_TRUE(volume) << to_string(volume.error());
  return volume.value_or(Volume{});
}

std::string error_of(const Bytes& bytes) {
  const auto volume = read_volume(bytes);
  return volume ? "none" : to_string(volume.error());
}

TEST(Nrrd, ReadsEveryTypeNameAndByteOrder) {
  const std::vector<std::pair<ScalarType, std::vector<std::string>>> names = {
      {ScalarType::UInt8, {"uchar", "unsigned char", "uint8", "uint8_t"}},
      {ScalarType::Int8, {"signed char", "int8", "int8_t"}},
      {ScalarType::UInt16, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}},
      {ScalarType::Int16, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"}},
      {ScalarType::UInt32, {"uint", "unsigned int", "uint32", "uint32_t"}},
      {ScalarType::Int32, {"int", "signed int", "int32", "int32_t"}},
      {ScalarType::UInt64, {"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"}},
      {ScalarType::Int64, {"longlong", "long long", "long long int", "signed long long", "int64", "int64_t"}},
      {ScalarType::Float32, {"float"}},
      {ScalarType::Float64, {"double"}}};
  for (const auto& [type, spellings] : names) {
    for (const std::string& name : spellings) {
      for (const std::endian order : {std::endian::little, std::endian::big}) {
        const std::string endian = order == std::endian::big ? "Big" : "little";
        const std::string header = "NRRD0001\nType: " + name + "\ndimension: 3\nsizes: 3 2 2\nendian: " + endian;
        const Bytes data = encode(kTwelve, type, order);
        const Volume raw = volume_of(file_of(header + "\nencoding: raw\n\n", data));
        EXPECT_EQ(raw.values, kTwelveFloats) << name;
        EXPECT_EQ(raw.type, type) << name;
        EXPECT_EQ(raw.format, "nrrd");
        EXPECT_EQ(volume_of(file_of(header + "\nencoding: gzip\n\n", gzipped(data))).values, kTwelveFloats);
      }
    }
  }
  EXPECT_NE(error_of(file_of("NRRD0001\ntype: uint8|uint8_t\n\n", {})), "none");
}

TEST(Nrrd, ReadsCompressedFile) {
  EXPECT_EQ(volume_of(gzipped(tiny(""))).values, kTwelveFloats);
}

TEST(Nrrd, AcceptsCrLfAndTrailingBlanks) {
  const std::string header =
      "NRRD0005\r\ntype:  unsigned  char \r\ndimension: 3\r\nkey:=value: x\r\nsizes: 3\t2 2 \r\n"
      "encoding: raw\r\ncontent: a name\r\n\r\n";
  const Volume volume = volume_of(file_of(header, encode(kTwelve, ScalarType::UInt8)));
  EXPECT_EQ(volume.values, kTwelveFloats);
  EXPECT_EQ(volume.name, "a name");
}

TEST(Nrrd, PlacesSamplesBySpacings) {
  const Volume volume = volume_of(tiny("spacings: 2 0.5 +4\n"));
  EXPECT_EQ(volume.spacing, DVec3(2, 0.5, 4));
  EXPECT_EQ(position_of(volume, {1, 1, 1}), DVec3(2, 4, -0.5));
  EXPECT_EQ(volume_of(tiny("spacings: 2 nan 4\n")).spacing, DVec3(2, 1, 4));
  const Volume turned = volume_of(tiny("spacings: 2 -3 4\n"));
  EXPECT_EQ(turned.spacing, DVec3(2, 3, 4));
  EXPECT_EQ(turned.warnings, std::vector<std::string>{"a spacing is negative; its absolute value is used"});
}

TEST(Nrrd, PlacesSamplesByDirectionsAndOrigin) {
  const Volume volume =
      volume_of(tiny("space: left-posterior-superior\nspace directions: (2,0,0) (0,0,3) ( 0, -4, 0 )\n"
                     "space origin: (10,20,30)\nspace units: \"mm\" \"mm\" \"mm\"\n"));
  EXPECT_EQ(volume.spacing, DVec3(2, 3, 4));
  EXPECT_EQ(volume.units, "mm");
  EXPECT_EQ(position_of(volume, {0, 0, 0}), DVec3(10, 30, -20));
  EXPECT_EQ(position_of(volume, {1, 0, 0}), DVec3(12, 30, -20));
  EXPECT_EQ(position_of(volume, {0, 1, 0}), DVec3(10, 33, -20));
  EXPECT_EQ(position_of(volume, {0, 0, 1}), DVec3(10, 30, -16));
}

/// A point of the body lies at the same position in every space.
TEST(Nrrd, ConvertsEverySpace) {
  const auto origin = [](const std::string& space, const std::string& vector) {
    return position_of(volume_of(tiny("space: " + space + "\nspace origin: (" + vector + ")\n")), {0, 0, 0});
  };
  // 1 to the right, 2 to the front, 3 up.
  const DVec3 expected(-1, 3, 2);
  EXPECT_EQ(origin("RAS", "1,2,3"), expected);
  EXPECT_EQ(origin("right-anterior-superior", "1,2,3"), expected);
  EXPECT_EQ(origin("LAS", "-1,2,3"), expected);
  EXPECT_EQ(origin("Left-Posterior-Superior", "-1,-2,3"), expected);
  EXPECT_EQ(origin("3D-right-handed", "1,2,3"), DVec3(1, 3, -2)) << "as .vox";
  EXPECT_EQ(origin("3D-left-handed", "1,2,3"), DVec3(1, 3, 2));
  EXPECT_LT(glm::determinant(volume_of(tiny("space: 3D-left-handed\n")).world_from_voxel), 0.0);
}

TEST(Nrrd, SkipsLinesAndBytesBeforeData) {
  Bytes data = encode({77, 78, 10, 79, 10, 80}, ScalarType::UInt8);
  const Bytes values = encode(kTwelve, ScalarType::UInt8);
  data.insert(data.end(), values.begin(), values.end());
  EXPECT_EQ(volume_of(tiny("line skip: 2\nbyte skip: 1\n", data)).values, kTwelveFloats);
  EXPECT_EQ(volume_of(tiny("byteskip: 6\n", data)).values, kTwelveFloats);
  EXPECT_EQ(volume_of(tiny("byte skip: -1\n", data)).values, kTwelveFloats);
  EXPECT_NE(error_of(tiny("line skip: 3\n", encode(kTwelve, ScalarType::UInt8))), "none");
}

TEST(Nrrd, LeavesOutValuesBeyondThreeDimensions) {
  const std::string header = "NRRD0004\ntype: uint8\ndimension: 4\nencoding: raw\n";
  Bytes data = encode(kTwelve, ScalarType::UInt8);
  const Volume volume = volume_of(
      file_of(header + "sizes: 3 2 2 9\nspace: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n\n", data));
  EXPECT_EQ(volume.values, kTwelveFloats);
  ASSERT_EQ(volume.warnings.size(), 1U);
}

TEST(Nrrd, ReadsFirstOfSeveralComponents) {
  const std::string header = "NRRD0004\ntype: uint8\ndimension: 4\nencoding: raw\nsizes: 3 2 2 1\n";
  const Bytes data = encode(kTwelve, ScalarType::UInt8);
  const std::vector<float> first = {1, 4, 7, 10};
  for (const std::string lines : {"kinds: RGB-color domain domain domain\nspacings: nan 2 3 4\n",
                                  "space: LPS\nspace directions: none (2,0,0) (0,3,0) (0,0,4)\n"}) {
    const Volume volume = volume_of(file_of(header + lines + "\n", data));
    EXPECT_EQ(volume.values, first) << lines;
    EXPECT_EQ(volume.size, IVec3(2, 2, 1));
    EXPECT_EQ(volume.spacing, DVec3(2, 3, 4));
    ASSERT_EQ(volume.warnings.size(), 1U);
    EXPECT_NE(volume.warnings[0].find("3 values per voxel; only the first is read"), std::string::npos);
  }
  EXPECT_EQ(error_of(file_of(header + "kinds: domain domain vector domain\n\n", data)),
            "byte 63: axis 3 is of kind \"vector\"; the three spatial axes must come first, or after one other axis");
  EXPECT_EQ(error_of(file_of(header + "space directions: (1,0,0) none (0,1,0) (0,0,1)\n\n", data)),
            "byte 63: axis 2 has no direction; the three spatial axes must come first, or after one other axis");
  EXPECT_EQ(error_of(file_of(header + "kinds: vector domain domain domain\n\n", Bytes(11))),
            "byte 99: 2 x 2 x 1 values of uint8 take 12 bytes, but there are 11");
}

TEST(Nrrd, ReadsValuesAsText) {
  const auto file = [](const std::string& type, const std::string& encoding, const std::string& text) {
    const std::string header = "NRRD0004\ndimension: 3\nsizes: 3 2 2\nendian: big\ntype: ";
    return file_of(header + type + "\nencoding: " + encoding + "\n\n" + text, {});
  };
  EXPECT_EQ(volume_of(file("float", "ascii", "1 2\t+3\n4,5, 6 7.0 8 9e0 10\r\n11 12\n")).values, kTwelveFloats);
  EXPECT_EQ(volume_of(file("int16", "txt", "1 2 3 4 5 6 7 8 9 10 11 12 and more")).values, kTwelveFloats);
  EXPECT_EQ(volume_of(file("uint8", "hex", "0102 030405\n060708090a0B0c")).values, kTwelveFloats);
  EXPECT_EQ(volume_of(file("ushort", "hex", "000100020003000400050006000700080009000A000B000C")).values, kTwelveFloats);
  EXPECT_EQ(error_of(file("uint8", "ascii", "1 2 256")), "byte 80: \"256\" is not a value of type uint8");
  EXPECT_EQ(error_of(file("uint8", "hex", "01 0x")), "byte 78: \"x\" is not a hexadecimal digit");
  EXPECT_NE(error_of(file("uint8", "ascii", "1 2 3")), "none");
}

TEST(Nrrd, ReadsDataFileOfDetachedHeader) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "quoin_detached";
  std::filesystem::create_directories(folder);
  const auto write = [&](const char* name, const Bytes& bytes) { ASSERT_TRUE(write_file(bytes, folder / name)); };
  const std::string header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 2 2\n";
  const Bytes data = encode(kTwelve, ScalarType::UInt8);
  write("a.nhdr", file_of(header + "encoding: raw\nline skip: 1\nbyte skip: 2\ndata file: ./a.raw\n", {}));
  Bytes skipped;
  volume_test::append_text(skipped, "a line\n..");
  skipped.insert(skipped.end(), data.begin(), data.end());
  write("a.raw", skipped);
  write("b.nhdr", file_of(header + "encoding: gzip\ndata file: b.raw.gz\n", {}));
  write("b.raw.gz", gzipped(data));
  for (const char* name : {"a.nhdr", "b.nhdr"}) {
    const auto volume = read_volume(folder / name);
    ASSERT_TRUE(volume) << to_string(volume.error());
    EXPECT_EQ(volume->values, kTwelveFloats) << name;
  }
  EXPECT_EQ(sidecar_files_of(folder / "b.nhdr"), std::vector<std::filesystem::path>{folder / "b.raw.gz"});
  write("c.nhdr", file_of(header + "encoding: raw\ndata file: c.raw\n", {}));
  const auto missing = read_volume(folder / "c.nhdr");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::CannotRead);
  std::filesystem::remove_all(folder);
}

TEST(Nrrd, ReportsErrorsInOneLine) {
  const auto header = [](const std::string& text) { return error_of(file_of("NRRD0004\n" + text, {})); };
  EXPECT_EQ(header(""), "byte 9: the header does not end with an empty line");
  EXPECT_EQ(header("\n"), "byte 10: the header has no field \"dimension\"");
  EXPECT_EQ(header("dimension\n\n"), "byte 9: the line \"dimension\" is not a NRRD header field");
  EXPECT_EQ(header("dimension: 2\ndimension: 2\n\n"), "byte 22: the field \"dimension\" is a duplicate");
  EXPECT_EQ(header("dimension: 17\n\n"), "byte 9: invalid dimension \"17\"");
  EXPECT_EQ(header("dimension: 2\n\n"), "byte 9: it has 2 dimensions; a volume has 3");
  EXPECT_EQ(header("dimension: 3\nsizes: 1 2\n\n"), "byte 22: the sizes are not 3 numbers");
  EXPECT_EQ(header("dimension: 3\nsizes: 1 -2 3\n\n"), "byte 22: invalid size \"-2\"");
  EXPECT_EQ(
      header("dimension: 3\nsizes: 4294967296 4294967296 4294967296\n\n"),
      "byte 22: the header claims 4294967296 x 4294967296 x 4294967296 values, more than the limit of 1073741824");
  EXPECT_EQ(header("data file: ../../secret\n"),
            "byte 9: the data file is \"../../secret\"; it must be in the header's folder and named "
            "without a folder");
  EXPECT_EQ(header("data file: LIST\n"), "byte 9: the values are in several files (\"LIST\"); only one is supported");
  EXPECT_EQ(error_of(file_of("NRRD0009\n\n", {})), "byte 0: NRRD version 9 is not supported (1 to 5 are)");
  const auto field = [](const std::string& lines) { return error_of(tiny(lines)); };
  EXPECT_EQ(field("space directions: (1,0,0) (0,1,0)\n"), "byte 73: the space directions are not 3 vectors");
  EXPECT_EQ(field("space directions: (1,0,0) (0,1,0) (1,1,0)\n"),
            "byte 73: the space directions are linearly dependent");
  EXPECT_EQ(field("space directions: (1,0,0) (0,1,0) (0,nan,0)\n"),
            "byte 73: a space direction is not a vector of 3 finite numbers");
  EXPECT_EQ(field("space origin: (1,2\n"), "byte 73: the space origin is not a vector of 3 finite numbers");
  EXPECT_EQ(field("spacings: 1 2 x\n"), "byte 73: the spacings are not 3 numbers");
  EXPECT_EQ(field("spacings: 1 2 +-3\n"), "byte 73: the spacings are not 3 numbers");
  EXPECT_EQ(field("space: scanner-xyz-time\n"),
            "byte 73: the space is \"scanner-xyz-time\", which is not a known space of 3 dimensions");
  EXPECT_EQ(field("byte skip: -2\n"), "byte 73: the byteskip is \"-2\"");
  EXPECT_EQ(error_of(tiny("", {})), "byte 74: 3 x 2 x 2 values of uint8 take 12 bytes, but there are 0");
}

TEST(Nrrd, RefusesOtherEncodingsAndTypes) {
  const std::string header = "NRRD0004\ndimension: 3\nsizes: 1 1 1\n";
  EXPECT_EQ(error_of(file_of(header + "type: uint8\nencoding: zrl\n\n", {})),
            "byte 47: unsupported encoding \"zrl\" (raw, gzip, bzip2, ascii and hex are supported)");
  EXPECT_EQ(error_of(file_of(header + "type: block\nencoding: raw\n\n", {})),
            "byte 35: the values are blocks, and only numbers are supported");
  EXPECT_EQ(error_of(file_of(header + "type: int16\nencoding: raw\n\n", {})),
            "byte 62: the header has no field \"endian\"");
  EXPECT_EQ(error_of(file_of(header + "type: uint8\nencoding: gzip\n\n12345", {})),
            "byte 63: the encoding is gzip, but the data is not gzip");
}

}  // namespace
}  // namespace quoin

#include <gtest/gtest.h>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "io/gltf/glb_for_tests.h"
#include "io/volume/volume_for_tests.h"

namespace quoin {
namespace {

using volume_test::Bytes;
using volume_test::encode;
using volume_test::kTwelve;
using volume_test::kTwelveFloats;
using volume_test::NiftiFile;

TEST(VolumeFiles, ReadsRawFilesByOptions) {
  const TestFolder folder("raw_volume");
  ASSERT_TRUE(write_file(encode(kTwelve, ScalarType::Int16, std::endian::big), folder.file("a.raw")));
  RawVolume raw{.size = {3, 2, 2}, .type = ScalarType::Int16, .order = std::endian::big};
  const auto volume = read_raw_volume(folder.file("a.raw"), raw);
  ASSERT_TRUE(volume) << to_string(volume.error());
  EXPECT_EQ(volume->values, kTwelveFloats);
  EXPECT_EQ(volume->name, "a");
  EXPECT_EQ(volume->format, "raw");
  EXPECT_EQ(DVec3(volume->world_from_voxel * glm::dvec4(1, 2, 3, 1)), DVec3(1, 3, -2));
  raw.size = {3, 2, 1};
  EXPECT_EQ(read_raw_volume(folder.file("a.raw"), raw).error().message,
            "the values end here, but 12 bytes follow; check the size");
  raw.size = {3, 2, 3};
  EXPECT_EQ(read_raw_volume(folder.file("a.raw"), raw).error().code, ErrorCode::BadFormat);
  raw.size = {3, 0, 2};
  EXPECT_EQ(read_raw_volume(folder.file("a.raw"), raw).error().code, ErrorCode::InvalidArgument);
  raw.size = {2147483647, 2147483647, 2147483647};
  EXPECT_EQ(read_raw_volume(folder.file("a.raw"), raw).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(read_raw_volume(folder.file("b.raw"), raw).error().code, ErrorCode::CannotRead);
}

TEST(VolumeFiles, ReadsHeaderAndImagePair) {
  const TestFolder folder("volume_pair");
  NiftiFile file{.vox_offset = 0, .magic = "ni1"};
  Bytes header = file.bytes({});
  header.resize(348);
  ASSERT_TRUE(write_file(header, folder.file("a.hdr")));
  const auto missing = read_volume(folder.file("a.hdr"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().path, folder.file("a.img").string());
  const Bytes values = encode(kTwelve, ScalarType::UInt8);
  ASSERT_TRUE(write_file(volume_test::gzipped(values), folder.file("a.img.gz")));
  EXPECT_EQ(read_volume(folder.file("a.hdr")).value().values, kTwelveFloats);
  ASSERT_TRUE(write_file(values, folder.file("a.img")));
  EXPECT_EQ(read_volume(folder.file("a.hdr")).value().values, kTwelveFloats);
}

TEST(VolumeFiles, DetectsContentAndNamesFileInErrors) {
  const TestFolder folder("volume_content");
  const Bytes compressed = volume_test::gzipped(NiftiFile{}.bytes(encode(kTwelve, ScalarType::UInt8)));
  ASSERT_TRUE(write_file(compressed, folder.file("scan.dat.gz")));
  EXPECT_EQ(detect_format(compressed), FileFormat::Nifti);
  EXPECT_EQ(detect_format(folder.file("scan.dat.gz")).value(), FileFormat::Nifti);
  EXPECT_FALSE(detect_format(folder.file("none")));
  Bytes nrrd;
  volume_test::append_text(nrrd, "NRRD0004\n");
  EXPECT_EQ(detect_format(nrrd), FileFormat::Nrrd);
  const auto volume = read_volume(folder.file("scan.dat.gz"));
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->name, "scan");
  const auto scene = load_scene(folder.file("scan.dat.gz"));
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->format, "nifti");
  EXPECT_GT(scene->scene.grids()[scene->scene.grids().handles().front()].field.solid_count(), 0) << "a field of it";
  ASSERT_TRUE(write_file(nrrd, folder.file("b.nii")));
  EXPECT_EQ(read_volume(folder.file("b.nii")).error().path, folder.file("b.nii").string());
}

TEST(VolumeFiles, StopsWhenCancelled) {
  int reported = 0;
  const Bytes values(std::size_t{1} << 16);
  const RawVolume raw{{64, 32, 32}, ScalarType::UInt8, std::endian::little};
  const auto cancelled = read_raw_volume(values, raw, {}, [&](double) { return ++reported < 2; });
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
  EXPECT_EQ(reported, 2);
}

}  // namespace
}  // namespace quoin

#include "io/image/exr.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <quoin/core/assert.h>
#include <quoin/io/image_files.h>

#include "io/whole_file.h"

#ifdef QUOIN_HAVE_OPENEXR
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfThreading.h>
#include <half.h>
#endif

namespace quoin {
namespace {

Status check_channels(int width, int height, std::span<const ExrChannel> channels) {
  const auto refuse = [](const std::string& message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (width <= 0 || height <= 0) return refuse("the image's width or height is not positive");
  if (channels.empty()) return refuse("the image has no channels");
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::set<std::string> names;
  for (const ExrChannel& channel : channels) {
    if (channel.name.empty() || !names.insert(channel.name).second) return refuse("two channels have the same name");
    const std::size_t count = channel.type == ExrChannel::Type::Uint32 ? channel.numbers.size() : channel.values.size();
    if (count != pixels) return refuse("the channel " + channel.name + " does not have width x height values");
  }
  return {};
}

#ifdef QUOIN_HAVE_OPENEXR

// OpenEXR's streams over memory.
class MemoryOut : public OPENEXR_IMF_NAMESPACE::OStream {
 public:
  MemoryOut() : OStream("memory") {}
  void write(const char* from, int count) override {
    QUOIN_ASSERT(count >= 0, "count >= 0");
    const auto size = static_cast<std::size_t>(count);
    if (bytes.size() < at_ + size) bytes.resize(at_ + size);
    std::copy_n(reinterpret_cast<const std::byte*>(from), size, bytes.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += size;
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t position) override { at_ = position; }

  std::vector<std::byte> bytes;

 private:
  std::size_t at_ = 0;
};

class MemoryIn : public OPENEXR_IMF_NAMESPACE::IStream {
 public:
  explicit MemoryIn(std::span<const std::byte> bytes) : IStream("memory"), bytes_(bytes) {}
  bool read(char* to, int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (at_ > bytes_.size() || bytes_.size() - at_ < size) throw IEX_NAMESPACE::InputExc("the file ends early");
    std::copy_n(reinterpret_cast<const char*>(bytes_.data()) + at_, size, to);
    at_ += size;
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t position) override { at_ = position; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

namespace imf = OPENEXR_IMF_NAMESPACE;

imf::PixelType type_of(ExrChannel::Type type) {
  if (type == ExrChannel::Type::Float16) return imf::HALF;
  return type == ExrChannel::Type::Float32 ? imf::FLOAT : imf::UINT;
}

std::vector<half> halves_of(const std::vector<float>& values) {
  std::vector<half> halves;
  halves.reserve(values.size());
  for (const float value : values) {
    constexpr float kMost = 65504.0F;
    halves.emplace_back(std::isfinite(value) ? std::clamp(value, -kMost, kMost) : value);
  }
  return halves;
}

std::vector<std::byte> encode(int width, int height, std::span<const ExrChannel> channels) {
  imf::Header header(width, height);
  header.compression() = imf::ZIP_COMPRESSION;
  imf::FrameBuffer frame;
  std::vector<std::vector<half>> halves;
  halves.reserve(channels.size());
  for (const ExrChannel& channel : channels) {
    const imf::PixelType type = type_of(channel.type);
    header.channels().insert(channel.name, imf::Channel(type));
    const void* data = channel.type == ExrChannel::Type::Uint32 ? static_cast<const void*>(channel.numbers.data())
                                                                : static_cast<const void*>(channel.values.data());
    std::size_t size = sizeof(float);
    if (channel.type == ExrChannel::Type::Float16) {
      data = halves.emplace_back(halves_of(channel.values)).data();
      size = sizeof(half);
    }
    // The data is only read, but the slice's type is not const.
    char* const base = static_cast<char*>(const_cast<void*>(data));  // NOLINT
    frame.insert(channel.name, imf::Slice(type, base, size, size * static_cast<std::size_t>(width)));
  }
  MemoryOut out;
  {
    imf::OutputFile file(out, header, 0);
    file.setFrameBuffer(frame);
    file.writePixels(height);
  }
  return std::move(out.bytes);
}

#endif

}  // namespace

bool has_exr() {
#ifdef QUOIN_HAVE_OPENEXR
  return true;
#else
  return false;
#endif
}

#ifdef QUOIN_HAVE_OPENEXR

// OpenEXR reports errors by exceptions, which must not leave this file.
Result<RadianceImage> decode_exr(std::span<const std::byte> bytes, std::size_t max_pixels) {
  try {
    MemoryIn in(bytes);
    imf::InputFile file(in, 0);
    const auto window = file.header().dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
    const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
    if (width <= 0 || height <= 0) return make_error(ErrorCode::BadFormat, "the OpenEXR file has no pixels");
    if (static_cast<std::uint64_t>(width) > max_pixels / static_cast<std::uint64_t>(height)) {
      return make_error(ErrorCode::LimitExceeded, "the image has more than " + std::to_string(max_pixels) + " pixels");
    }
    const imf::ChannelList& channels = file.header().channels();
    const bool is_grey = channels.findChannel("R") == nullptr && channels.findChannel("Y") != nullptr;
    if (!is_grey && channels.findChannel("R") == nullptr) {
      return make_error(ErrorCode::BadFormat, "the OpenEXR file has no channels R, G, B or Y");
    }
    RadianceImage image{static_cast<int>(width), static_cast<int>(height),
                        std::vector<float>(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
    imf::FrameBuffer frame;
    constexpr std::size_t kPixel = 3 * sizeof(float);
    const auto insert = [&](const char* name, int channel) {
      frame.insert(name, imf::Slice::Make(imf::FLOAT, image.rgb.data() + channel, window, kPixel,
                                          kPixel * static_cast<std::size_t>(width)));
    };
    if (is_grey) {
      insert("Y", 0);
    } else {
      insert("R", 0), insert("G", 1), insert("B", 2);
    }
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    for (std::size_t i = 0; is_grey && i < image.rgb.size(); i += 3) image.rgb[i + 1] = image.rgb[i + 2] = image.rgb[i];
    return image;
  } catch (const std::exception& exception) {
    std::string message = exception.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    return make_error(ErrorCode::BadFormat, "not a readable OpenEXR file: " + message);
  }
}

Result<std::vector<std::byte>> write_exr(int width, int height, std::span<const ExrChannel> channels) {
  if (Status status = check_channels(width, height, channels); !status) return status.error();
  try {
    return encode(width, height, channels);
  } catch (const std::exception& exception) {
    return make_error(ErrorCode::LimitExceeded, std::string("cannot encode the image: ") + exception.what());
  }
}

#else

Result<RadianceImage> decode_exr(std::span<const std::byte>, std::size_t) {
  return make_error(ErrorCode::Unsupported, "cannot read OpenEXR: Quoin was built without OpenEXR");
}

Result<std::vector<std::byte>> write_exr(int width, int height, std::span<const ExrChannel> channels) {
  if (Status status = check_channels(width, height, channels); !status) return status.error();
  return make_error(ErrorCode::Unsupported, "cannot write OpenEXR: Quoin was built without OpenEXR");
}

#endif

Result<std::uint64_t> write_exr(int width, int height, std::span<const ExrChannel> channels,
                                const std::filesystem::path& path) {
  return write_whole(path, write_exr(width, height, channels));
}

}  // namespace quoin

// Device requirements that are known without Vulkan calls.

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <utility>

#include <quoin/render/vulkan_device.h>

namespace quoin {
namespace {

constexpr std::uint32_t kVersion12 = (1U << 22U) | (2U << 12U);  // VK_API_VERSION_1_2
constexpr std::array kFeatures = {"bufferDeviceAddress"};
constexpr std::array kOptionalFeatures = {"fillModeNonSolid"};

Error refuse(std::string message) {
  return make_error(ErrorCode::Unsupported, "vulkan: " + std::move(message));
}

// The better a device, the less.
int rank_of(const VulkanDeviceInfo& device) {
  constexpr std::array<std::string_view, 4> kOrder = {"discrete", "integrated", "virtual", "cpu"};
  return static_cast<int>(std::find(kOrder.begin(), kOrder.end(), device.kind) - kOrder.begin());
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool is_number(const std::string& text) {
  return !text.empty() && text.size() < 9 &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

}  // namespace

VulkanRequirements vulkan_requirements() {
  return {kVersion12, {}, {}, kFeatures, kOptionalFeatures};
}

Result<std::size_t> choose_vulkan_device(std::span<const VulkanDeviceInfo> devices, const std::string& wanted) {
  const VulkanDeviceInfo* chosen = nullptr;
  if (is_number(wanted)) {
    const auto index = static_cast<std::size_t>(std::stoul(wanted));
    if (index < devices.size()) chosen = &devices[index];
  } else {
    for (const VulkanDeviceInfo& device : devices) {
      if (!wanted.empty() && lower(device.name).find(lower(wanted)) == std::string::npos) continue;
      const auto score = [](const VulkanDeviceInfo& d) { return std::pair(!d.missing.empty(), rank_of(d)); };
      if (chosen == nullptr || score(device) < score(*chosen)) chosen = &device;
    }
  }
  if (chosen == nullptr) {
    std::string message = "no device \"";
    message += wanted;
    message += devices.empty() ? "\": no devices found" : "\"; available: ";
    for (std::size_t i = 0; i < devices.size(); ++i) {
      if (i != 0) message += ", ";
      message += std::to_string(i);
      message += ' ';
      message += devices[i].name;
    }
    return refuse(std::move(message));
  }
  if (!chosen->missing.empty()) return refuse(chosen->name + " lacks " + chosen->missing);
  return static_cast<std::size_t>(chosen - devices.data());
}

}  // namespace quoin
